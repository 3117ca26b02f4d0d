"""The output of `check` and `steady` for a case with stick."""

from __future__ import annotations

from typing import Any

import numpy as np

from fenwear.arrays import Array
from fenwear.assembly import Tribosystem, assemble
from fenwear.case import Case
from fenwear.cycle.totals import approach
from fenwear.plausibility import RULES, Seen, law_warnings, unique_text
from fenwear.results.quantity import CELSIUS, KELVIN, degrees_of
from fenwear.results.steps import REGIMES, regime_of
from fenwear.sliding.chart import sliding_chart
from fenwear.stick.final import FinalShape
from fenwear.stick.interface import meshed
from fenwear.stick.records import TimeStepRecords


def check_text(case: Case, system: Tribosystem | None = None) -> str:
    """Return what a case with stick comes to in its first cycle; collective.

    Args:
        case: With contact.law = "coulomb".
        system: Of the case, where there is one already.

    Raises:
        CaseError: what only the geometry can tell is wrong.
        ConvergenceError: a time step did not converge.
    """
    system = system or assemble(case)
    system.check_touching()
    problem = system.law_state.problem
    both = meshed(problem.interface)
    setup = both.needs.text()
    records = TimeStepRecords.joined(problem.cycle(problem.beginning())[1])
    thick, weights = case.model.thickness, problem.weights
    closed = weights @ (records.pressure > 0).any(axis=0)
    stuck = weights @ records.sticking.all(axis=0)
    regime = REGIMES[regime_of(records, stuck / closed)]
    seen = Seen.of_pressure(system, records.pressure, "in the first cycle")
    texts = [RULES[name].text(seen) for name in ("unit", "depth", "few", "shakedown", "large")]
    warnings = (*texts, *law_warnings(system), unique_text(records.unique.astype(bool)))
    return (
        f"{setup}\n"
        f"the case is valid: {len(weights)} contact nodes, {len(records)} time steps in a cycle\n"
        f"first cycle: {regime}, "
        f"tangential force up to {thick * np.abs(records.force).max():.4g} N, of the contact "
        f"{100 * stuck / closed:.0f} % stick all through, work of friction {thick * records.energy(weights):.4g} mJ"
        + "".join(f"\nwarning: {text}" for text in warnings if text)
    )


def final_of(case: Case, system: Tribosystem | None = None) -> tuple[FinalShape, dict[str, Any]]:
    """Return the final shape of a case's partial slip, and its key numbers; collective.

    Args:
        case: With contact.law = "coulomb".
        system: Of the case, where there is one already.

    Raises:
        CaseError: what only the geometry can tell is wrong.
        ConvergenceError: nothing sticks.
    """
    system = system or assemble(case)
    system.check_touching()
    found = system.contact_law.end(system)
    problem = found.system.law_state.problem
    solid = case.model.kind == "solid"
    pair, weights = problem.interface.middle.pair, problem.weights
    x = sliding_chart(problem.interface.field, pair).coordinates(pair.punch.x)[:, 0] if solid else pair.x
    scar, seen = x[found.depth > 0], np.einsum("id,id->i", pair.normal, approach(problem.interface.middle.rigid))
    names = ("stick_area_mm2", "worn_volume_mm3") if solid else ("stick_width_mm", "worn_area_mm2")
    places = {a: pair.punch.x[:, k].tolist() for k, a in enumerate("xyz")} if solid else {"x": pair.x.tolist()}
    numbers = {
        names[0]: found.size,
        names[0].replace("_mm", "_within_mm"): found.within,
        "scar_from_mm": float(scar.min()) if len(scar) else None,
        "scar_to_mm": float(scar.max()) if len(scar) else None,
        "largest_depth_mm": float(found.depth.max()),
        "largest_depth_between_mm": found.deepest,
        names[1]: float(weights @ found.depth),
        names[1].replace("_mm", "_between_mm"): found.volume,
        "largest_pressure_MPa": float(found.pressure.max()),
        "normal_force_N": case.model.thickness * float((weights * found.pressure) @ seen),
        **places,
        "pressure": found.pressure.tolist(),
        "depth": found.depth.tolist(),
    }
    if found.temperature is not None:
        degrees = degrees_of(case)
        for body, values in zip(("punch", "strip"), degrees.of(found.temperature), strict=True):
            numbers[f"temperature_{body}_{degrees.unit}"] = values.tolist()
    return found, numbers


def final_text(numbers: dict[str, Any]) -> str:
    """Return the key numbers of a final shape for readers."""
    solid = "worn_volume_mm3" in numbers
    scar = "no scar"
    if numbers["scar_from_mm"] is not None:
        axis = "along the sliding" if solid else "x ="
        scar = f"scar from {axis} {numbers['scar_from_mm']:.4g} to {numbers['scar_to_mm']:.4g} mm"
    size, unit = ("stick_area", "mm²") if solid else ("stick_width", "mm")
    plain = unit.replace("²", "2")
    stick = f"{numbers[f'{size}_{plain}']:.4g} ± {numbers[f'{size}_within_{plain}']:.1g} {unit}"
    stick = f"of {stick}" if solid else f"{stick} wide"
    what, unit = ("worn_volume", "mm3") if solid else ("worn_area", "mm2")
    depth = _between(1e3 * numbers["largest_depth_mm"], 1e3 * np.array(numbers["largest_depth_between_mm"]))
    worn = _between(numbers[f"{what}_{unit}"], np.array(numbers[f"{what}_between_{unit}"]))
    return (
        f"  the stick zone, {stick}, carries all of the load in the end, {numbers['normal_force_N']:.5g} N\n"
        f"  {scar}, {depth} µm deep in both bodies together, {worn} {'mm³' if solid else 'mm²'};\n"
        "  the ranges come from the node spacing at the ends of the stick zone\n"
        f"  largest pressure {numbers['largest_pressure_MPa']:.4g} MPa, at the edges of the stick zone; "
        "it rises as nodes come closer to them" + _warm_text(numbers)
    )


def _between(value: float, ends: Array) -> str:
    """Return a number with no more digits than the interval lets it have, and the interval."""
    open_by = float(np.ptp(ends)) / max(abs(value), 1e-300)
    digits = 1 + int(np.clip(np.ceil(-np.log10(max(open_by, 1e-3))), 1, 3))
    return f"{value:.{digits}g} ({ends[0]:.{digits}g} to {ends[1]:.{digits}g})"


def _warm_text(numbers: dict[str, Any]) -> str:
    """Return what is to be said of the temperatures, if there are any."""
    for unit in (KELVIN, CELSIUS):
        warmest = [max(numbers.get(f"temperature_{body}_{unit.unit}", [-np.inf])) for body in ("punch", "strip")]
        if np.isfinite(warmest[0]):
            return (
                f"\n  nothing that slips carries pressure, so that friction makes no heat: the punch's contact is at "
                f"{warmest[0]:.4g} {unit.shown} at most, the strip's at {warmest[1]:.4g} {unit.shown}"
            )
    return ""
