"""How the uncertainty of a run is told: as a table of summary.json, and in words, with the key that lowers it."""

from __future__ import annotations

from typing import Any

from fenwear.accuracy.told import Uncertainty
from fenwear.accuracy.values import BODIES, Contribution, Quantity
from fenwear.assembly import Tribosystem
from fenwear.case import Case
from fenwear.results.degrees import KELVIN, degrees_of
from fenwear.results.registry import known

HIGHEST = 8  # degree of elements
WORDS = {
    "largest_depth": "worn depth",
    "worn_volume": "worn volume",
    "largest_pressure": "largest pressure",
    "largest_pressure_in_cycle": "largest pressure",
    "mean_pressure": "mean pressure",
    "largest_temperature": "temperature",
}


def table(system: Tribosystem, found: Uncertainty) -> dict[str, Any]:
    """Return an uncertainty as summary.json has it: under the names of the numbers, in all and by its sources."""
    return {
        **(_named(system, found.total) if found.is_whole else {}),
        "contributions": {source: _named(system, own) for source, own in found.contributions.items()},
        **({"untold": found.untold} if found.untold else {}),
        "remedies": remedies(system, found),
        "seconds": found.seconds,
    }


def _named(system: Tribosystem, numbers: Contribution) -> dict[str, Any]:
    named: dict[str, Any] = {}
    for quantity, number in numbers.items():
        registered = known(quantity.name)
        assert registered is not None
        if quantity.of in BODIES:
            named.setdefault(quantity.of, {})[registered.key] = number
        elif quantity.of:
            named.setdefault(_way(system, quantity), {})[registered.key] = number
        elif registered.unit == KELVIN.unit:
            named[f"{quantity.name}_{degrees_of(system.case).unit}"] = number
        else:
            named[registered.key] = number
    return named


def _way(system: Tribosystem, quantity: Quantity) -> str:
    motion = system.motion
    stroke = (int(quantity.of) - 1) % motion.half_cycles
    return system.direction_words[int(motion.phases[stroke * motion.positions].direction)]


def remedies(system: Tribosystem, found: Uncertainty) -> dict[str, str]:
    """Return for each kind of number what would lower its uncertainty most, a key and its value."""
    worst: dict[str, tuple[float, str]] = {}
    for quantity, value in found.values.items():
        share = found.total[quantity] / max(abs(value.number), 1e-300)
        if share > worst.get(quantity.name, (0.0, ""))[0]:
            worst[quantity.name] = share, found.largest(quantity)
    return {name: text for name, (_, source) in worst.items() if (text := _remedy(system, source))}


def _remedy(system: Tribosystem, source: str) -> str:
    case, positions = system.case, system.motion.positions
    follow = case.geometry.follow_wear or 0.0
    fineness = system.exchange.fineness
    jumps = case.run.integration == "jump"
    steps = 0 if fineness is None else 2 * fineness.steps
    tolerance = "" if case.heat is None else f"heat.reduction_tolerance = {case.heat.reduction_tolerance / 10:.2g}"
    return {
        "mesh": _finer(case),
        "wear_steps": f"run.jump_tolerance = {case.run.jump_tolerance / 4:.2g}"
        if jumps
        else 'run.integration = "jump"',
        "slip_steps": f"stick.step_tolerance = {case.stick.step_tolerance / 2:.2g}",
        "positions": f"motion.positions = {2 * positions - positions % 2}",
        "following": f"geometry.follow_wear = {follow / 2:.2g}",
        "heat_steps": f"heat.steps = {steps}",
        "heat_basis": tolerance,
    }.get(source, "")


def _finer(case: Case) -> str:
    """Return which key has nodes lie closer."""
    grid, degree = case.grid, case.geometry.degree
    if grid is not None and grid.across is not None:
        return f"grid.across = {2 * grid.across}"
    if grid is not None and grid.nodes is not None:
        return f"grid.nodes = {2 * grid.nodes - 1}"
    return (
        f"geometry.degree = {degree + 1}, or smaller elements at and below the contact"
        if degree < HIGHEST
        else "more elements"
    )


def in_words(source: str) -> str:
    """Return a source of uncertainty for people."""
    return source.replace("_", " ")


def text(system: Tribosystem, found: Uncertainty) -> str:
    """Return in a few lines how uncertain the numbers are, what of, and what would help."""
    told, helps, total = [], remedies(system, found), found.total
    for name, words in WORDS.items() if found.is_whole else ():
        shares = {q: total[q] / max(abs(v.number), 1e-300) for q, v in found.values.items() if q.name == name}
        if not shares:
            continue
        worst = max(shares, key=lambda quantity: shares[quantity])
        by = f", most by the {in_words(found.largest(worst))}" if name in helps else ""
        # A share of kelvins tells nothing, nor one of a rise above a temperature that bodies have in part.
        size = f"{total[worst]:.2g} K" if name == "largest_temperature" else f"{100 * shares[worst]:.2g} %"
        told.append(f"{words} {size}{by}")
    lines = [f"numerical uncertainty: {'; '.join(told) or 'not known'}"]
    lines += [f"not told of the {in_words(source)}: {why}" for source, why in found.untold.items()]
    lines += [f"to lower it: {key}" for key in sorted(set(helps.values())) if found.is_whole]
    return "\n".join(lines)
