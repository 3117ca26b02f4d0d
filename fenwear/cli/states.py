"""Commands that find a state directly: the cyclic steady state, the pressure optimum, and the shape to machine."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from fenwear.case import plausibility_warnings
from fenwear.case.program import held_at
from fenwear.cli.base import CaseArgument, FreshOption, JsonOption, SetOption, app, load, log, print_json, show
from fenwear.errors import CaseError, ConvergenceError, InputError

if TYPE_CHECKING:
    from fenwear.assembly import Tribosystem
    from fenwear.cycle import RunningIn, SteadyState
    from fenwear.initial_shape import InitialShape

T = TypeVar("T")
StepOption = Annotated[
    int | None,
    typer.Option(
        "--step",
        min=1,
        help="Step of a test program whose end is held constant, counted from 1; by default the last.",
    ),
]

CARRIED = {"normal_force": "load", "friction_force": "friction force", "friction_torque": "torque of friction"}
SIZES = ("contact_width", "contact_area", "mean_pressure")
FOLLOWED = 16  # phases a cycle, up to which the way to the steady state is sought: with many it takes minutes


@app.command("steady")
def steady_command(
    case: CaseArgument,
    settings: SetOption = [],  # noqa: B006
    step: StepOption = None,
    fresh: FreshOption = False,
    as_json: JsonOption = False,
    accuracy: Annotated[
        bool,
        typer.Option("--accuracy", help="Estimate the numerical uncertainty of the largest pressures and temperature."),
    ] = False,
) -> None:
    """Solve for the cyclic steady state directly."""
    from fenwear.assembly import with_case, with_reduced_heat
    from fenwear.cycle import growth_rate, held, running_in, steady
    from fenwear.law_choice import resolve_law

    begin = time.perf_counter()
    given = load(case, settings)
    held_at(given, _number(step))  # before anything is set up
    law_state = resolve_law(given, log, heat="reduced" if given.program is None else "none", fresh=fresh)
    system = law_state.system
    held_case, of_step = held(system, _number(step))
    if of_step:
        system = with_case(system, held_case)
    if system.sticks:
        _print_final(case, system, as_json=as_json)
        return
    if of_step:
        system = with_reduced_heat(system, keep=True, fresh=fresh)
    setup = time.perf_counter() - begin
    state = steady(system)
    forces, gain, warnings = _forces(state), *_gain_and_warnings(system, state)
    if not as_json:
        _print_steady(case, state, forces, of_step)
    uncertain: dict[str, Any] = {}
    if accuracy:
        uncertain = _unless_failed("its uncertainty", lambda: _uncertain(state), uncertain)
    way = time.perf_counter()
    rate = _unless_failed("its stability", lambda: growth_rate(state.system, state), math.nan)
    short = len(state.system.motion.phases) <= FOLLOWED
    cycles = None
    if rate < 0 and short:
        cycles = _unless_failed("the way there", lambda: running_in(state.system, state, 0.01), cycles)
    seconds = {"setup": setup, "steady": state.seconds, "way_there": time.perf_counter() - way}
    in_all = time.perf_counter() - begin
    if not as_json:
        _print_way(rate, short, cycles, seconds, in_all)
        return
    print_json(
        {
            **({"of": of_step} if of_step else {}),
            **_state_json(state),
            "growth_rate_per_s": rate,
            "heat_gain": gain,
            **{name: values for name, (_, values) in forces.items()},
            "cycles_to_1_percent": None if cycles is None else round(cycles.cycles),
            "cycles_to_1_percent_uncertainty": None if cycles is None else round(cycles.uncertainty),
            **uncertain,
            "seconds": state.seconds,
            "all_seconds": {**seconds, "in_all": in_all},
            "warnings": warnings,
        }
    )


def _gain_and_warnings(system: Tribosystem, state: SteadyState) -> tuple[float | None, list[str]]:
    """Return the thermoelastic feedback and the warnings of a state, and print the warnings."""
    from fenwear.assembly import with_reduced_heat
    from fenwear.cycle import heat_gain, heat_warnings
    from fenwear.plausibility import fineness_warnings, steady_warnings

    warm = with_reduced_heat(state.system)
    gain = heat_gain(warm, state.phase_pressure, None if state.heat is None else state.heat.end)
    warnings = [
        *system.bodies.remarks,
        *plausibility_warnings(system.case),
        *steady_warnings(state.system, state),
        *heat_warnings(gain),
        *fineness_warnings(system),
    ]
    for warning in warnings:
        log(f"warning: {warning}")
    return gain, warnings


def _state_json(state: SteadyState) -> dict[str, Any]:
    """Return a steady state's pressures, shape, temperatures and wear as --json prints them."""
    from fenwear.results.quantity import degrees_of

    degrees, system = degrees_of(state.system.case), state.system
    pressures = {d: p.tolist() for d, p in zip(state.directions, state.pressure, strict=True)}
    warm: dict[str, Any] = dict.fromkeys(("temperature", "temperature_strip", "temperature_unit"))
    if state.heat is not None:
        sides = [degrees.of(side[-1]).tolist() for side in (state.heat.punch, state.heat.strip)]
        warm = dict(zip(warm, (*sides, degrees.unit), strict=True))
    return {
        **coordinates(system),
        "pressure_plus": pressures.get(1),
        "pressure_minus": pressures.get(-1),
        "shape": state.shape.tolist(),
        **warm,
        "property_passes": state.passes,
        "complementarity_error": state.complementarity_error,
        "wear_per_cycle": state.wear_per_cycle.tolist(),
        **state.velocity,
    }


def _unless_failed(name: str, compute: Callable[[], T], missing: T) -> T:
    """Return what is computed from a state that is found, or what stands for it where that fails; collective."""
    try:
        return compute()
    except (CaseError, ConvergenceError) as error:
        log(f"warning: the state is found, {name} is not: {error}")
        return missing


def _uncertain(state: SteadyState) -> dict[str, Any]:
    """Return how uncertain a state's numbers are, and say it."""
    from fenwear.accuracy import uncertainty_of_steady, uncertainty_table, uncertainty_text

    found = uncertainty_of_steady(state)
    log(uncertainty_text(state.system, found))
    return {"uncertainty": uncertainty_table(state.system, found)}


def _print_final(name: str, system: Tribosystem, *, as_json: bool) -> None:
    """Print the shape to which partial slip wears."""
    from fenwear.cli.partial_slip import final_of, final_text
    from fenwear.plausibility import final_warnings

    found, numbers = final_of(system.case, system)
    numbers["warnings"] = final_warnings(found)
    for warning in numbers["warnings"]:
        log(f"warning: {warning}")
    if as_json:
        print_json(numbers)
    else:
        show(f"end of the wear of {name} in partial slip\n{final_text(numbers)}")


def _number(step: int | None) -> int | None:
    """Return the number of a step, counted from 0, of the one that users count from 1."""
    return None if step is None else step - 1


def _forces(state: SteadyState) -> dict[str, tuple[str, Any]]:
    """Return what the contact carries in each half-cycle of a state, by names: the unit, and values."""
    from fenwear.cycle.steady_cycle import cycle_of_state
    from fenwear.results.registry import quantities_of
    from fenwear.results.summary import nominal_pressure

    known, records = quantities_of(state.system), cycle_of_state(state)
    found = {
        name: (known[name].unit, known[name].compute(records).tolist()) for name in (*SIZES, *CARRIED) if name in known
    }
    nominal = nominal_pressure(state.system, state.system.normal_force)
    return {**found, **{name: ("MPa", value) for name, value in nominal.items()}}


def coordinates(system: Tribosystem) -> dict[str, Any]:
    """Return the coordinates of the contact nodes, mm: x in the plane, r and z of rings, x, y and z of a solid."""
    if system.case.model.kind == "plane":
        return {"x": system.pair.x.tolist()}
    x = system.pair.punch.x
    names = ("r", "z") if x.shape[1] == 2 else ("x", "y", "z")
    return {name: x[:, k].tolist() for k, name in enumerate(names)}


def _print_steady(case: str, state: SteadyState, forces: dict[str, tuple[str, Any]], step: str) -> None:
    """Print the state as soon as it is there: the way to it may take longer."""
    from fenwear.cycle.state import pressure_scale
    from fenwear.results.quantity import degrees_of

    show(f"cyclic steady state of {case} ({state.iterations} Newton iterations)")
    if step:
        show(f"  of {step}")
    system = state.system
    part = "width {:7.3f} mm" if system.case.model.kind == "plane" else "area {:.3f} mm²"
    words, moves = system.direction_words, "turns" if any(system.sliding.field.turn) else "moves"
    for k, (d, p, width) in enumerate(zip(state.directions, state.pressure, state.contact_width, strict=True)):
        show(f"  strip {moves} {words[d]:9} largest pressure {p.max():8.3f} MPa, "
              f"mean {forces['mean_pressure'][1][k]:.3f} MPa, contact {part.format(width)}")  # fmt: skip
        own = [f"{what} {forces[name][1][k]:.5g} {forces[name][0]}" for name, what in CARRIED.items() if name in forces]
        show(f"    {', '.join(own)}")
    if "nominal_pressure" in forces:
        show(f"  nominal pressure {forces['nominal_pressure'][1]:.4f} MPa: load over the projected area")
    scale = pressure_scale(system, state.phase_pressure)
    show(f"  pressure scale {scale:.4f} MPa (integral of p² over integral of p)")
    wear, surface = 1e3 * state.wear_per_cycle, system.pair.weights * (state.wear_per_cycle > 0)
    mean = (surface @ wear) / (surface.sum() or 1.0)
    show(f"  wear per cycle {mean:.4g} µm on average, {wear.max():.4g} µm at most; "
          + _velocities(state.velocity, "per cycle"))  # fmt: skip
    if state.passes:
        times = "once" if state.passes == 1 else f"{state.passes} times"
        show(f"  material properties are those at these temperatures, updated {times}")
    if state.heat is not None:
        degrees = degrees_of(system.case)
        punch, strip = (degrees.of(body.max()) for body in (state.heat.punch, state.heat.strip))
        unit = degrees.shown
        show(f"  largest temperature at the contact: punch {punch:.3f} {unit}, strip {strip:.3f} {unit}")
    sys.stdout.flush()


def _print_way(rate: float, followed: bool, cycles: RunningIn | None, seconds: dict[str, float], in_all: float) -> None:
    """Print how the state is reached, and where the time went."""
    if math.isnan(rate):
        show("  its stability and the way there are not known, see the warning")
    elif rate > 0:
        show(
            f"  unstable: disturbances grow at {rate:.3g} 1/s, so that a run moves away from this state; "
            "it may be one of several"
        )
    elif not followed:
        show('  the way there, cycles of many steps, is not followed: `run` with run.integration = "jump" does so')
    elif cycles is None:
        show("  pressure within 1 % of the pressure scale: not found within ten million cycles from the initial shape")
    else:
        digit = 10 ** math.floor(math.log10(max(cycles.uncertainty, 1)))  # no more are known
        number, wrong = (digit * round(one / digit) for one in (cycles.cycles, cycles.uncertainty))
        about = f"after about {number:,} ± {wrong:,} cycles"
        show(f"  pressure within 1 % of the pressure scale {about} from the initial shape")
    show(f"  {_duration(in_all)} in all: meshes and operators {_duration(seconds['setup'])}, "
          f"steady state {_duration(seconds['steady'])}, the way there {_duration(seconds['way_there'])}")  # fmt: skip


def _duration(seconds: float) -> str:
    return f"{1e3 * seconds:.0f} ms" if seconds < 1 else f"{seconds:.1f} s"


def _velocities(velocity: dict[str, float], per: str) -> str:
    from fenwear.interface import is_translation

    units = {name: "mm" if is_translation(name) else "rad" for name in velocity}
    separator = "/" if len(per) == 1 else " "
    return ", ".join(f"{name} = {value:.5g} {units[name]}{separator}{per}" for name, value in velocity.items())


@app.command("optimum")
def optimum_command(
    case: CaseArgument,
    settings: SetOption = [],  # noqa: B006
    step: StepOption = None,
    as_json: JsonOption = False,
) -> None:
    """Print lambda_F, lambda_M, the optimal pressure and the angle chi of the wear velocity in both directions."""
    from fenwear.assembly import place_case
    from fenwear.cycle import held

    given = load(case, settings)
    if given.sticks:
        reason = "expected 'gross-sliding': the pressure optimum is that of surfaces that slide as a whole"
        raise CaseError(InputError("contact.law", reason))
    held_at(given, _number(step))  # before any mesh is made
    system = place_case(given)
    held_case, of_step = held(system, _number(step))
    if of_step:
        system = place_case(held_case)
    if not system.rigid.mode_names:
        reason = (
            "they hold the punch along the contact's normal: no rigid motion follows the wear, and no pressure stays"
        )
        raise CaseError(InputError("punch.supports", reason))
    found = {name: system.optimum(d) for d, name in reversed(system.direction_words.items())}
    if as_json:
        x = system.pair.x.tolist()
        print_json(
            {
                n: {**o.velocity, "x": x, "pressure": o.pressure.tolist(), "chi": o.tilt.tolist()}
                for n, o in found.items()
            }
            | ({"of": of_step} if of_step else {})
        )
        return
    if of_step:
        show(f"of {of_step}")
    for name, state in found.items():
        show(f"{name:9}  {_velocities(state.velocity, 's')}")
        for end in (0, -1):
            chi = math.degrees(state.tilt[end])
            names, place = system.case.model.axes[:-1], system.pair.punch.x[end]
            at = ", ".join(f"{axis} = {round(c, 9) + 0.0:g}" for axis, c in zip(names, place, strict=False))
            show(f"           p = {state.pressure[end]:.4f} MPa, chi = {chi:.2f}° at {at} mm")


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
    from fenwear.cycle import at_step
    from fenwear.initial_shape import initial_shape
    from fenwear.law_choice import resolve_law
    from fenwear.parallel import on_root
    from fenwear.results.export import write_shape

    law_state = resolve_law(load(case, settings), log, heat="none")
    loaded, system = law_state.case, at_step(law_state.system)
    wanted = [_load_of(text) for text in loads] or [(1.0, 1.0)]
    if not system.sticks:
        system = with_reduced_heat(system, keep=True)
    shape = initial_shape(system, wanted)
    on_root(system.comm, lambda: write_shape(output, loaded, shape))
    if as_json:
        rows = zip(shape.largest_pressure, shape.left_to_run_in, strict=True)
        known = [{"largest_pressure": pressure, "left_to_run_in": left} for pressure, left in rows]
        numbers = {"depth": shape.depth.tolist(), "loads": known, "tolerance": shape.tolerance}
        print_json({**coordinates(system), **numbers, "uneven_wear": shape.uneven_wear})
        return
    _print_shape(case, wanted, shape)
    log(f"profile, surface and case in {output}; next: fenwear run {output / 'case.toml'}")


def _print_shape(case: str, wanted: list[tuple[float, float]], shape: InitialShape) -> None:
    """Print how deep a shape to machine is, and its pressures under each load."""
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


def _load_of(text: str) -> tuple[float, float]:
    """Return the factor and the share of FACTOR or FACTOR:SHARE."""
    factor, _, share = text.partition(":")
    try:
        return float(factor), float(share or 1.0)
    except ValueError:
        raise CaseError(InputError("--load", f"expected FACTOR or FACTOR:SHARE, got {text!r}")) from None
