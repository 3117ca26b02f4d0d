"""The command that finds the shape to machine."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from fenwear.cli.base import CaseArgument, JsonOption, SetOption, app, load, log, print_json, show
from fenwear.cli.states import coordinates
from fenwear.errors import CaseError, InputError

SAME = 1e-6  # of the pressure scale


@app.command("shape")
def shape_command(
    case: CaseArgument,
    output: Annotated[Path, typer.Option("-o", "--output", help="New folder of the profile, surface and case.")],
    settings: SetOption = [],  # noqa: B006
    loads: Annotated[
        list[str],
        typer.Option(
            "--load",
            metavar="FACTOR[:SHARE]",
            help="Factor of all loads, and its share of the sliding; repeatable, for loads that take turns.",
        ),
    ] = [],  # noqa: B006
    as_json: JsonOption = False,
) -> None:
    """Find the shape to machine: that of the steady state (of a program: in its last step), without run-in."""
    from fenwear.assembly import with_reduced_heat
    from fenwear.assembly.variants import with_case
    from fenwear.cycle import held
    from fenwear.initial_shape import initial_shape
    from fenwear.law_choice import resolve_law
    from fenwear.parallel import on_root
    from fenwear.results.machining import write_shape

    law_state = resolve_law(load(case, settings), log, heat="none")
    loaded, system = law_state.case, law_state.system
    wanted = [_load_of(text) for text in loads] or [(1.0, 1.0)]
    of_step = held(system)
    if of_step is not None:
        system = with_case(system, of_step[0])
    if not system.sticks:
        system = with_reduced_heat(system, keep=True)
    shape = initial_shape(system, wanted)
    on_root(system.comm, lambda: write_shape(output, loaded, shape))
    if as_json:
        rows = zip(shape.largest_pressure, shape.left_to_run_in, strict=True)
        names = ("largest_pressure", "left_to_run_in")
        known = [dict(zip(names, (None, None) if math.isnan(row[0]) else row, strict=True)) for row in rows]
        numbers = {"depth": shape.depth.tolist(), "loads": known, "tolerance": shape.tolerance}
        uneven = None if math.isnan(shape.uneven_wear) else shape.uneven_wear
        print_json({**coordinates(system), **numbers, "uneven_wear": uneven})
        return
    show(f"shape to machine for {case}: {1e3 * shape.depth.max():.4g} µm deep")
    show(f"  made within ± {1e3 * shape.tolerance:.3g} µm, pressures are within a tenth of their scale")
    for (factor, share), state, p, left in zip(
        wanted, shape.states, shape.largest_pressure, shape.left_to_run_in, strict=True
    ):
        at = "" if len(wanted) == 1 else f" at {factor:g} of the loads, {share:g} of the sliding"
        worn = f"{state.pressure.max():.3f} MPa once worn in"
        if math.isnan(p):
            show(f"  largest pressure{at}: {worn}, and as warm as then from the start")
        else:
            change = "the same" if left < SAME else f"differ by {100 * left:.2g} % at most"
            show(f"  largest pressure{at}: {p:.3f} MPa in the first cycle, {worn} ({change})")
    if shape.uneven_wear > SAME:
        show(f"  the loads reach different zones: their wear together is uneven by {100 * shape.uneven_wear:.2g} %")
    log(f"profile, surface and case in {output}; next: fenwear run {output / 'case.toml'}")


def _load_of(text: str) -> tuple[float, float]:
    """Return the factor and the share of FACTOR or FACTOR:SHARE."""
    factor, _, share = text.partition(":")
    try:
        return float(factor), float(share or 1.0)
    except ValueError:
        raise CaseError(InputError("--load", f"expected FACTOR or FACTOR:SHARE, got {text!r}")) from None
