"""Commands that find a state directly: the cyclic steady state, the pressure optimum, and the shape to machine."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import numpy as np
import typer

from fenwear.case import plausibility_warnings
from fenwear.case.program import held_at
from fenwear.cli.application import CaseArgument, FreshOption, JsonOption, SetOption, answer, app, load, log, show
from fenwear.common.errors import CaseError, ConvergenceError, InputError

if TYPE_CHECKING:
    from fenwear.laws.optimum import Optimum
    from fenwear.steps import RunningIn, SteadyState
    from fenwear.steps.initial_shape import InitialShape
    from fenwear.steps.stick_final import FinalShape
    from fenwear.system import ContactSetup, Tribosystem

T = TypeVar("T")
StepOption = Annotated[
    int | None,
    typer.Option(
        "--step",
        min=1,
        help="Step of a test program whose end is held constant, counted from 1; by default the last.",
    ),
]
AccuracyOption = Annotated[
    bool,
    typer.Option("--accuracy", help="Estimate the numerical uncertainty of the largest pressures and temperature."),
]

DIGITS_OF_ANGLE = 9  # in degrees: the rest is rounding
SIZES = ("largest_pressure", "mean_pressure", "contact_width", "contact_area")
CARRIED = ("normal_force", "friction_force", "friction_torque")
FOLLOWED = 16  # phases a cycle, up to which the way to the steady state is sought: with many it takes minutes


@app.command("steady")
def steady_command(
    case: CaseArgument,
    settings: SetOption = [],  # noqa: B006
    step: StepOption = None,
    fresh: FreshOption = False,
    as_json: JsonOption = False,
    accuracy: AccuracyOption = False,
) -> None:
    """Solve for the cyclic steady state directly."""
    from fenwear.checks.law_choice import resolve_law
    from fenwear.steps import growth_rate, held, running_in, steady
    from fenwear.system import with_case, with_reduced_heat

    begin = time.perf_counter()
    given = load(case, settings)
    held_at(given, _number(step))  # before anything is set up
    law_state = resolve_law(given, log, heat="reduced" if given.program is None else "none", fresh=fresh)
    system = law_state.system
    held_case, of_step = held(system, _number(step))
    if of_step:
        system = with_case(system, held_case)
    if system.law.sticks:
        _show_final(case, system, as_json=as_json)
        return
    if of_step:
        system = with_reduced_heat(system, keep=True, fresh=fresh)
    setup = time.perf_counter() - begin
    state = steady(system)
    results = {**({"of": of_step} if of_step else {}), **_state_json(state), **_forces(state), **_gain(system, state)}
    if not as_json:  # the way to it may take longer
        show(_steady_text(case, state, results))
    if accuracy:
        results |= _unless_failed("the uncertainty", lambda: _uncertain(state), dict[str, Any]())
    way = time.perf_counter()
    rate = _unless_failed("the stability", lambda: growth_rate(state.system, state), math.nan)
    short, cycles = len(state.system.motion.phases) <= FOLLOWED, None
    if rate < 0 and short:
        cycles = _unless_failed("the running-in", lambda: running_in(state.system, state, 0.01), cycles)
    seconds = {"setup": setup, "steady": state.seconds, "way_there": time.perf_counter() - way}
    seconds["in_all"] = time.perf_counter() - begin
    results |= {
        "growth_rate_per_s": rate,
        "cycles_to_1_percent": None if cycles is None else round(cycles.cycles),
        "cycles_to_1_percent_uncertainty": None if cycles is None else round(cycles.uncertainty),
        "seconds": state.seconds,
        "all_seconds": seconds,
    }
    answer(results, lambda: _way_text(rate, short, cycles, seconds), as_json=as_json)


def _gain(system: Tribosystem, state: SteadyState) -> dict[str, Any]:
    """Return the thermoelastic feedback and the warnings of a state, and log the warnings."""
    from fenwear.checks import Seen
    from fenwear.steps import heat_gain, heat_warnings
    from fenwear.system import with_reduced_heat

    warm = with_reduced_heat(state.system)
    gain = heat_gain(warm, state.phase_pressure, None if state.heat is None else state.heat.end)
    warnings = [
        *system.bodies.remarks,
        *plausibility_warnings(system.case),
        *Seen.of_steady(state.system, state).warnings(),
        *heat_warnings(gain),
        *Seen.of_system(system).warnings("heat"),
    ]
    for warning in warnings:
        log(f"warning: {warning}")
    return {"heat_gain": gain, "warnings": warnings}


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
    """Return a result of a steady state, or its replacement where the computation fails; collective."""
    try:
        return compute()
    except (CaseError, ConvergenceError) as error:
        log(f"warning: {name} of the steady state was not computed: {error}")
        return missing


def _uncertain(state: SteadyState) -> dict[str, Any]:
    """Return how uncertain a state's numbers are, and say it."""
    from fenwear.checks import uncertainty_of_steady, uncertainty_table
    from fenwear.report.key_numbers import NO_NUMBERS, flat, line_of
    from fenwear.results.sheet import columns_text, shown

    table = uncertainty_table(state.system, uncertainty_of_steady(state))
    rows = []
    for path, within in flat({key: value for key, value in table.items() if key not in NO_NUMBERS}).items():
        line, of = line_of(path), path.rpartition(".")[0]
        rows.append((f"{line.heading}, {of}" if of else line.heading, [shown(within, line)]))
    log(columns_text(("uncertainty",), rows))
    for source, why in table.get("untold", {}).items():
        log(f"uncertainty from the {source.replace('_', ' ')} not estimated: {why}")
    log(f"to lower it: {'; '.join(sorted(set(table['remedies'].values())))}")
    return {"uncertainty": table}


def _show_final(name: str, system: Tribosystem, *, as_json: bool) -> None:
    """Show the shape to which partial slip wears."""
    from fenwear.checks import Seen

    final, numbers = final_of(system)
    numbers["warnings"] = Seen.of_final(final).warnings()
    for warning in numbers["warnings"]:
        log(f"warning: {warning}")
    answer(numbers, lambda: f"end of the wear of {name} in partial slip\n{final_text(numbers)}", as_json=as_json)


def final_of(system: Tribosystem) -> tuple[FinalShape, dict[str, Any]]:
    """Return the final shape of partial slip, and its key numbers; collective.

    Raises:
        CaseError: a property of the geometry is wrong.
        ConvergenceError: nothing sticks.
    """
    from fenwear.results.quantity import degrees_of
    from fenwear.steps.run_state import approach
    from fenwear.surfaces.sliding_chart import sliding_chart

    system.law.check_touching(system)
    final, case = system.law.end(system), system.case
    problem = final.system.law_state.problem
    solid = case.model.kind == "solid"
    pair, weights = problem.interface.middle.pair, problem.weights
    x = sliding_chart(problem.interface.field, pair).coordinates(pair.punch.x)[:, 0] if solid else pair.x
    scar, seen = x[final.depth > 0], np.einsum("id,id->i", pair.normal, approach(problem.interface.middle.rigid))
    area = problem.interface.dim == 3
    size, worn, unit = ("stick_area", "worn_volume", "mm3") if area else ("stick_width", "worn_area", "mm2")
    of_size = "mm2" if area else "mm"
    numbers = {
        f"{size}_{of_size}": final.size,
        f"{size}_within_{of_size}": final.within,
        "scar_from_mm": float(scar.min()) if len(scar) else None,
        "scar_to_mm": float(scar.max()) if len(scar) else None,
        "largest_depth_mm": float(final.depth.max()),
        "largest_depth_between_mm": final.deepest,
        f"{worn}_{unit}": float(weights @ final.depth),
        f"{worn}_between_{unit}": final.volume,
        "largest_pressure_MPa": float(final.pressure.max()),
        "normal_force_N": case.model.thickness * float((weights * final.pressure) @ seen),
        **coordinates(final.system),
        "pressure": final.pressure.tolist(),
        "depth": final.depth.tolist(),
    }
    if final.temperature is not None:
        degrees = degrees_of(case)
        for body, values in zip(("punch", "strip"), degrees.of(final.temperature), strict=True):
            numbers[f"temperature_{body}_{degrees.unit}"] = values.tolist()
    return final, numbers


def final_text(numbers: dict[str, Any]) -> str:
    """Return the key numbers of a final shape as a table: each with the interval that the node spacing leaves."""
    from fenwear.results.sheet import LINES, OF_CONTACT, columns_text, shown

    rows = [("scar, from (mm)", [numbers["scar_from_mm"]]), ("... to (mm)", [numbers["scar_to_mm"]])]
    for key, line in (LINES | OF_CONTACT).items():
        if key in numbers and "within" not in key:
            name, _, unit = key.rpartition("_")
            value, within = numbers[key], numbers.get(f"{name}_within_{unit}", 0.0)
            ends = numbers.get(f"{name}_between_{unit}", (value - within, value + within) if within else ())
            rows.append((line.heading, [shown(number, line) for number in (value, *ends)]))
    for key, values in numbers.items():
        if key.startswith("temperature_"):
            _, body, unit = key.split("_")
            rows.append((f"largest temperature of the {body}'s contact ({unit.replace('deg', '°')})", [max(values)]))
    text = columns_text(("value", "at least", "at most"), rows)
    return (
        f"{text}\nThe stick zone carries all of the load. Its largest pressure rises as nodes come closer to its edges."
    )


def _number(step: int | None) -> int | None:
    """Return the number of a step, counted from 0, of the one that users count from 1."""
    return None if step is None else step - 1


def _forces(state: SteadyState) -> dict[str, Any]:
    """Return the sizes and forces of the contact in each half-cycle of a state, and its nominal pressure, by names."""
    from fenwear.results.registry import quantities_of
    from fenwear.results.summary import nominal_pressure
    from fenwear.steps.steady_cycle import cycle_of_state

    known, records = quantities_of(state.system), cycle_of_state(state)
    values = {name: known[name].compute(records).tolist() for name in (*SIZES, *CARRIED) if name in known}
    return {**values, **nominal_pressure(state.system, state.system.normal_force)}


def coordinates(system: Tribosystem) -> dict[str, Any]:
    """Return the coordinates of the contact nodes, mm: x in the plane, r and z of rings, x, y and z of a solid."""
    if system.case.model.kind == "plane":
        return {"x": system.pair.x.tolist()}
    x = system.pair.punch.x
    names = ("r", "z") if x.shape[1] == 2 else ("x", "y", "z")
    return {name: x[:, k].tolist() for k, name in enumerate(names)}


def _steady_text(case: str, state: SteadyState, results: dict[str, Any]) -> str:
    """Return a state as a table, a column for each sliding direction."""
    from fenwear.results.quantity import degrees_of
    from fenwear.results.registry import quantities_of
    from fenwear.results.sheet import LINES, OF_CONTACT, columns_text, shown
    from fenwear.steps.run_state import pressure_scale

    system, lines, degrees = state.system, LINES | OF_CONTACT, degrees_of(state.system.case)
    known = quantities_of(system)
    keys = {name: known[name].key for name in (*SIZES, *CARRIED) if name in results}
    rows = [(lines[key].heading, [shown(entry, lines[key]) for entry in results[name]]) for name, key in keys.items()]
    wear, surface = 1e3 * state.wear_per_cycle, system.pair.weights * (state.wear_per_cycle > 0)
    in_all = {
        "nominal pressure: load over the projected area (MPa)": results.get("nominal_pressure"),
        "pressure scale: integral of p² over integral of p (MPa)": pressure_scale(system, state.phase_pressure),
        "wear per cycle, mean (µm)": float(surface @ wear) / (float(surface.sum()) or 1.0),
        "wear per cycle, largest (µm)": float(wear.max()),
        **{f"{name} ({_unit(name)} per cycle)": value for name, value in state.velocity.items()},
    }
    if state.heat is not None:
        for body, warm in (("punch", state.heat.punch), ("strip", state.heat.strip)):
            in_all[f"largest temperature of the {body}'s contact ({degrees.shown})"] = float(degrees.of(warm).max())
    rows += [(label, [value]) for label, value in in_all.items() if value is not None]
    title = f"cyclic steady state of {case}, Newton iterations: {state.iterations}"
    of_step = [f"of {results['of']}"] if "of" in results else []
    if state.passes:
        of_step.append(f"material properties updated {state.passes} times to these temperatures")
    return "\n".join([title, *of_step, columns_text([system.sliding.words[d] for d in state.directions], rows)])


def _way_text(rate: float, followed: bool, cycles: RunningIn | None, seconds: dict[str, float]) -> str:
    """Return how the state is reached, and where the time went."""
    if math.isnan(rate):
        text = "stability and running-in are not known: see the warning"
    elif rate > 0:
        text = (
            f"unstable: disturbances grow at {rate:.3g} 1/s. A run moves away from this state; it may be one of several"
        )
    elif not followed:
        text = 'running-in is not computed for cycles of many steps: use `run` with run.integration = "jump"'
    elif cycles is None:
        text = "pressure within 1 % of the pressure scale: not found within ten million cycles from the initial shape"
    else:
        digit = 10 ** math.floor(math.log10(max(cycles.uncertainty, 1)))  # no more are known
        number, wrong = (digit * round(value / digit) for value in (cycles.cycles, cycles.uncertainty))
        about = f"after about {number:,} ± {wrong:,} cycles"
        text = f"pressure within 1 % of the pressure scale {about} from the initial shape"
    setup, state, way, in_all = (_duration(duration) for duration in seconds.values())
    return f"{text}\n{in_all} in all: meshes and operators {setup}, steady state {state}, running-in {way}"


def _duration(seconds: float) -> str:
    return f"{1e3 * seconds:.0f} ms" if seconds < 1 else f"{seconds:.1f} s"


def _unit(mode: str) -> str:
    """Return the unit of a rigid motion."""
    from fenwear.surfaces import is_translation

    return "mm" if is_translation(mode) else "rad"


@app.command("optimum")
def optimum_command(
    case: CaseArgument,
    settings: SetOption = [],  # noqa: B006
    step: StepOption = None,
    as_json: JsonOption = False,
) -> None:
    """Print lambda_F, lambda_M, the optimal pressure and the angle chi of the wear velocity in both directions."""
    from fenwear.steps import held
    from fenwear.system import place_case

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
            "they hold the punch along the contact's normal, so that no rigid motion follows the wear. Free this "
            "motion and give a load, or use `run`"
        )
        raise CaseError(InputError("punch.supports", reason))
    optima = {name: system.optimum(d) for d, name in reversed(system.sliding.words.items())}
    x = system.pair.x.tolist()
    data: dict[str, Any] = {
        name: {**optimum.velocity, "x": x, "pressure": optimum.pressure.tolist(), "chi": optimum.tilt.tolist()}
        for name, optimum in optima.items()
    }
    answer(data | ({"of": of_step} if of_step else {}), lambda: _optimum_text(system, optima, of_step), as_json=as_json)


def _optimum_text(system: ContactSetup, optima: dict[str, Optimum], of_step: str) -> str:
    """Return the optima of both directions as a table, with the pressure and the angle at both ends of the contact."""
    from fenwear.results.sheet import columns_text

    states = list(optima.values())
    rows = [
        (f"{name} ({_unit(name)}/s)", [optimum.velocity[name] for optimum in states]) for name in states[0].velocity
    ]
    for end in (0, -1):
        names, place = system.case.model.axes[:-1], system.pair.punch.x[end]
        at = ", ".join(f"{axis} = {round(c, 9) + 0.0:g}" for axis, c in zip(names, place, strict=False))
        rows.append((f"pressure at {at} mm (MPa)", [float(optimum.pressure[end]) for optimum in states]))
        angles = [round(math.degrees(optimum.tilt[end]), DIGITS_OF_ANGLE) + 0.0 for optimum in states]
        rows.append((f"angle chi at {at} mm (degrees)", angles))
    return "\n".join([*([f"of {of_step}"] if of_step else []), columns_text(list(optima), rows)])


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
    pressure: Annotated[
        str,
        typer.Option(metavar="FILE|EXPR", help="Pressure of the first contact, MPa: a table, or 20*(1-(x/30)**2)."),
    ] = "",
    as_json: JsonOption = False,
) -> None:
    """Find the shape to machine: that of the steady state (of a program: in its last step), or for a pressure."""
    from fenwear.checks.law_choice import resolve_law
    from fenwear.common.parallel import on_root
    from fenwear.results.export import write_shape
    from fenwear.steps import at_step
    from fenwear.steps.initial_shape import initial_shape, pressure_at, shape_for_pressure
    from fenwear.system import with_reduced_heat

    law_state = resolve_law(load(case, settings), log, heat="none")
    loaded, system = law_state.system.case, at_step(law_state.system)
    wanted = [_load_of(text) for text in loads] or [(1.0, 1.0)]
    if pressure:
        if loads:
            raise CaseError(
                InputError(
                    "--pressure",
                    "given together with --load. Leave out --load: the pressure balances the loads of the case",
                )
            )
        shape = shape_for_pressure(system, pressure_at(system.pair.punch, pressure))
    else:
        shape = initial_shape(system if system.law.sticks else with_reduced_heat(system, keep=True), wanted)
    on_root(system.bodies.comm, lambda: write_shape(output, loaded, shape))
    rows = zip(shape.largest_pressure, shape.left_to_run_in, strict=True)
    known = [{"largest_pressure": pressure, "left_to_run_in": left} for pressure, left in rows]
    numbers = {"depth": shape.depth.tolist(), "loads": known, "tolerance": shape.tolerance}
    data = {**coordinates(system), **numbers, "uneven_wear": shape.uneven_wear}
    answer(data, lambda: _shape_text(case, wanted, shape), as_json=as_json)
    log(f"profile, surface and case in {output}; next: fenwear run {output / 'case.toml'}")


def _shape_text(case: str, wanted: list[tuple[float, float]], shape: InitialShape) -> str:
    """Return how deep a shape to machine is, and its pressures under each load."""
    from fenwear.results.sheet import columns_text

    rows: list[tuple[str, Sequence[float | None]]] = [
        ("largest pressure in the first cycle (MPa)", [None if math.isnan(p) else p for p in shape.largest_pressure]),
        ("largest pressure once worn in (MPa)", [float(state.pressure.max()) for state in shape.states]),
        ("largest difference of both, of the pressure scale (%)", [100 * round(x, 6) for x in shape.left_to_run_in]),
    ]
    if not shape.states:
        rows[1:] = [("largest difference from the pressure wanted, of its scale (%)", rows[2][1])]
    lines = [
        f"shape to machine for {case}: {1e3 * shape.depth.max():.4g} µm deep",
        f"made within ± {1e3 * shape.tolerance:.3g} µm, pressures are within a tenth of their scale",
        columns_text([f"load {factor:g}:{share:g}" for factor, share in wanted], rows),
    ]
    return "\n".join(lines)


def _load_of(text: str) -> tuple[float, float]:
    """Return the factor and the share of FACTOR or FACTOR:SHARE."""
    factor, _, share = text.partition(":")
    try:
        return float(factor), float(share or 1.0)
    except ValueError:
        raise CaseError(InputError("--load", f"expected FACTOR or FACTOR:SHARE, got {text!r}")) from None
