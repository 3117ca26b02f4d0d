"""The contributions to the numerical uncertainty of a run's end: of the mesh, of steps, of the heat and of the solver.

The contribution of steps and bases of the heat: the exchange knows how far contact temperatures and the thermal gap are
from those of smaller steps and of the whole mesh, relative to themselves. The pressure is solved for once more with a
thermal gap that is larger by as much; worn depths differ by no more than it does beside a rigid motion, and by no more
than the pressure that wears them.

The result is a table of summary.json, with the keys that lower the uncertainty.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fenwear.case import Case, OneWay, Rotation
from fenwear.checks.other_discretisations import (
    LESS,
    Again,
    are_dear,
    coarser,
    in_few_steps,
    in_longer_jumps,
    nodes_across,
    set_up,
)
from fenwear.checks.uncertain_values import Contribution, Quantity, Value, Values, values_of, values_of_steady
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, ConvergenceError
from fenwear.results.quantity import BODIES, KELVIN, degrees_of
from fenwear.results.registry import known
from fenwear.steps import Block, SteadyState, heat_gain, steady
from fenwear.steps.run_state import RunState, all_phases, pressure_scale
from fenwear.system import Tribosystem, led, with_reduced_heat


def of_heat(last: Block, values: Values) -> dict[str, Contribution]:
    """Return the contributions of steps and basis of the heat to a run's end; none without heat; collective.

    Args:
        last: The last half-cycles.
        values: Their numbers.
    """
    fineness = last.system.exchange.fineness
    if last.heat is None:
        return {}
    known = {"heat_steps": fineness.change, "heat_basis": fineness.difference}
    return {source: _of(last, values, share) for source, share in known.items() if np.isfinite(share)}


def of_steady_heat(system: Tribosystem, values: Values) -> dict[str, Contribution]:
    """Return the contributions to a steady state, relative; pressures have at most those of the thermal gap."""
    exchange = with_reduced_heat(system).exchange
    start = {"largest_temperature": system.case.initial_temperature}
    return {
        source: {quantity: share * abs(v.number - start.get(quantity.name, 0.0)) for quantity, v in values.items()}
        for source, share in (("heat_steps", exchange.fineness.change), ("heat_basis", exchange.fineness.difference))
        if np.isfinite(share)
    }


def _of(last: Block, values: Values, share: float) -> Contribution:
    assert last.heat is not None
    system = last.system
    rise = float(last.heat.largest_temperature[-1]) - system.case.initial_temperature
    pressure, depth = led(system, lambda: _felt(last, share)) if not system.law.sticks else (share, np.inf)
    contribution: Contribution = {}
    for quantity, value in values.items():
        relative = pressure * abs(value.number)
        contribution[quantity] = {
            "largest_temperature": share * abs(rise),
            "largest_depth": min(relative, depth),
            "worn_volume": 0.0,
        }.get(quantity.name, relative)
    return contribution


def _felt(last: Block, share: float) -> tuple[float, float]:
    """Return the relative change of the largest pressure by a share more of the thermal gap, and that gap's range."""
    system, exchange, temperature = last.system, last.system.exchange, last.end.temperature
    phase = (int(last.half_cycle[-1]) * system.motion.positions - 1) % len(system.motion.phases)
    thermal = exchange.gap(exchange.on_bases(temperature), phase)
    gap: Array = system.gap(phase, last.end.worn) + thermal
    contact = system.phase_contact((phase,))
    try:
        before, after = (contact.solve(g).pressure.max() for g in (gap, gap + share * thermal))
    except ConvergenceError:
        return share, np.inf
    return abs(float(after / before) - 1), share * float(np.ptp(thermal))


SAFETY = 1.25  # of an estimate by the assumed order, as of grid convergence indices
AT_EDGE, INSIDE, OF_VOLUME = 1.0, 1.5, 2.0  # orders in the distance of nodes, see `order_of`
NOTICED = 0.1  # of the wear from which on meshes follow: before, what it would do is not asked for
FED = 0.1  # of a change of pressure, by its heat of a half-cycle: less is followed by half-cycles
FROM_COLD = 1 / (1 - np.sqrt(0.5))  # of the change by half-cycles half as long: bodies warm with the root of time
LATE = 0.5  # of a cycle: within it temperatures of jumps, which see whole cycles, may be any
ROUNDING = 1e-12
NOTHING_BELOW = "no elements of a lower degree than 1 exist to compare with. Set geometry.degree = 2"


@dataclass(frozen=True)
class Uncertainty:
    """The numerical uncertainty of the numbers of a run's end.

    Attributes:
        values: The numbers, in mm, mm³, MPa and K.
        contributions: Of each source to that of each number, in its unit.
        untold: Why there is none of a source that there should be one of, by its name.
        seconds: That it took.
    """

    values: Values
    contributions: dict[str, Contribution]
    untold: dict[str, str] = field(default_factory=dict)
    seconds: float = 0.0

    @property
    def is_whole(self) -> bool:
        """Whether there is what contributes most: without the mesh's part a sum would say nothing."""
        return "mesh" in self.contributions

    @property
    def total(self) -> Contribution:
        """The sum of all contributions."""
        return {
            quantity: sum(contribution.get(quantity, 0.0) for contribution in self.contributions.values())
            for quantity in self.values
        }

    def largest(self, quantity: Quantity) -> str:
        """Return the source that contributes most to a number."""
        return max(self.contributions, key=lambda source: self.contributions[source].get(quantity, 0.0))


def uncertainty(case: Case, last: Block) -> Uncertainty:
    """Return the numerical uncertainty of a run's end; collective.

    Args:
        case: Of the run, whole, with its law of contact.
        last: The last half-cycles of the run.
    """
    begin = time.perf_counter()
    values, until = values_of(last), int(last.half_cycle[-1])
    contributions: dict[str, Contribution] = {}
    untold: dict[str, str] = {}
    lower = coarser(
        case, last.system.pair, nodes_across(last.system.pair, last.pressure[-last.system.motion.half_cycles :])
    )
    if not lower.differs:
        untold["mesh"] = NOTHING_BELOW
    try:
        base = in_few_steps(lower.case, last.system, until)
        by_jumps = case.run.integration == "jump"
        longer = by_jumps and are_dear(last)
        share = float(by_jumps) * (LESS if longer else 1.0)  # of what its jumps leave: what those of the run do
        again = Again(set_up(in_longer_jumps(base) if longer else base, last.system, lower), until)
        first, end, a_cycle_ago = again.ends()
        before, short = values_of(end), values_of(by_short_jumps(end))
        if lower.differs:
            coarse = {quantity: short[quantity].towards(value, share) for quantity, value in before.items()}
            contributions["mesh"] = of_mesh(values, coarse, lower.ratio)
        of_jumps = {quantity: SAFETY * share * value.apart(short[quantity]) for quantity, value in before.items()}
        warmest = Quantity("largest_temperature")
        if warmest in before and by_jumps:
            late = LATE * before[warmest].apart(values_of(a_cycle_ago)[warmest])
            if last.steps:  # by the last jump's own error
                of_jumps[warmest] = getattr(last.steps[-1], "jump_error", 0.0) * abs(values[warmest].number)
            of_jumps[warmest] = max(of_jumps[warmest], late)
        for source, contribution in _steps(again, before, of_jumps, first, last):
            contributions[source] = contribution
    except (CaseError, ConvergenceError) as error:
        untold["steps" if "mesh" in contributions else "mesh"] = _why(error)
    contributions |= of_heat(last, values)
    contributions["solver"] = _of_solver(values, last)
    return Uncertainty(values, contributions, untold, time.perf_counter() - begin)


def of_mesh(values: Values, coarse: Values, ratio: float) -> Contribution:
    """Return the distance to the limit of small elements, by the numbers on elements some times as large."""
    return {
        quantity: SAFETY * value.apart(coarse[quantity]) / (ratio ** order_of(quantity, value) - 1)
        for quantity, value in values.items()
        if quantity in coarse
    }


def order_of(quantity: Quantity, value: Value) -> float:
    """Return the order at which a number is taken to approach its limit, in the spacing of nodes.

    At the end of a contact displacements go as r^(3/2) and pressures as r^(1/2). In the mean square over the contact
    pressures are off by order 1, nearly all of it beside its ends; what is inside feels the ends by weak norms, by
    order 3/2. A volume is an energy (the work of friction, times a wear coefficient) and has twice the order of
    displacements in the energy norm: 2 of elements of degree 1, with which those of degree 2 are compared, and at
    closed sharp corners, r^(1/2) at worst, whose order in the degree is twice that in the size of elements; else more.
    """
    if quantity.name == "worn_volume":
        return OF_VOLUME
    return AT_EDGE if value.at_edge else INSIDE


def _steps(
    again: Again, before: Values, of_jumps: Contribution, first: Block, last: Block
) -> Iterator[tuple[str, Contribution]]:
    """Yield what steps of wear and of slip, positions of the strip and meshes that follow contribute; collective.

    Args:
        again: The run in another discretisation.
        before: Its numbers.
        of_jumps: Error of the run's own jumps in them.
        first: Its first half-cycles.
        last: The last ones of the run itself.
    """
    case = last.system.case
    positions, follow = last.system.motion.positions, case.geometry.follow_wear
    if case.run.integration == "jump":
        yield "wear_steps", of_jumps
    else:
        yield "wear_steps", _of_half_cycles(before, first, last)
    if isinstance(case.motion, OneWay | Rotation) and case.program is None and (heat_gain(last.system) or 0.0) > FED:
        # Their duration is a time step, in which the pressure stays and its heat does not.
        shorter = replace(again.otherwise(motion={"duration": case.motion.duration / 2}), until=2 * again.until)
        other = shorter.values()
        yield "half_cycles", {quantity: FROM_COLD * value.apart(other[quantity]) for quantity, value in before.items()}
    if last.system.law.sticks:
        fineness = last.system.law_state.fineness
        if fineness is not None:
            yield "slip_steps", {quantity: fineness.change * abs(value.number) for quantity, value in before.items()}
    fewer = max(2, 2 * (positions // 4) + positions % 2)
    if positions > fewer:
        other, factor = again.otherwise(motion={"positions": fewer}).values(), fewer / (positions - fewer)
        # By the fields, too: combs of unlike teeth may be as deep.
        yield "positions", {quantity: factor * value.apart(other[quantity]) for quantity, value in before.items()}
    if follow is None:
        return
    if last.system.bodies.followed is not None:
        yield "following", _apart(before, again.otherwise(geometry={"follow_wear": 2 * follow}).values(), 1.0)
    elif (
        worn := last.system.bodies.wear_on_meshes(last.end.worn, last.system.case)
    ) > NOTICED:  # not yet: with meshes that do half-way
        yield "following", _apart(before, again.otherwise(geometry={"follow_wear": follow * worn / 2}).values(), 2.0)


def _apart(values: Values, other: Values, factor: float) -> Contribution:
    return {quantity: factor * abs(value.number - other[quantity].number) for quantity, value in values.items()}


def _of_half_cycles(before: Values, first: Block, last: Block) -> Contribution:
    """Return the error of half-cycles as steps: in depths, of first order, half of the change by the wear of one.

    The sums of explicit and of implicit steps differ by the wear of the first half-cycle less that of the last one, and
    lie on either side of the wear that continues within the steps. Pressure and temperature are half a half-cycle late.
    """
    strokes = last.system.motion.half_cycles
    late = float(last.periodicity[-1]) * pressure_scale(last.system, last.pressure[-1]) / (2 * strokes)
    contribution: Contribution = {}
    for body, depth, start in (("punch", last.wear, first.wear), ("strip", last.wear_strip, first.wear_strip)):
        rate = float(start[0].max()) / int(first.half_cycle[0])
        mean = float(depth[-1].max()) / int(last.half_cycle[-1])
        contribution[Quantity("largest_depth", body)] = abs(rate - mean) / 2
    if last.heat is not None and len(last.half_cycle) > strokes:
        sides = (last.heat.temperature_punch, last.heat.temperature_strip)
        change = max(float(np.abs(side[-1] - side[-1 - strokes]).max()) for side in sides)
        contribution[Quantity("largest_temperature")] = change / (2 * strokes)
    return {
        quantity: contribution.get(quantity, late if "pressure" in quantity.name and np.isfinite(late) else 0.0)
        for quantity in before
    }


def _of_solver(values: Values, last: Block) -> Contribution:
    left = float(last.equilibrium_error.max()) + float(last.complementarity_error.max()) + ROUNDING
    return {quantity: left * abs(value.number) for quantity, value in values.items()}


def _why(error: CaseError | ConvergenceError) -> str:
    """Return why there is nothing to compare with; an error that rejects a case is that of the coarser one."""
    coarser_one = "of the coarser mesh or grid that would be compared with: " if isinstance(error, CaseError) else ""
    return f"{coarser_one}{error}"


def uncertainty_of_steady(state: SteadyState) -> Uncertainty:
    """Return the numerical uncertainty of a cyclic steady state's largest pressures and temperature; collective.

    Args:
        state: The state; nothing in it comes of steps of wear.
    """
    begin = time.perf_counter()
    system, values = state.system, values_of_steady(state)
    case = system.case
    lower = coarser(case, system.pair, nodes_across(system.pair, np.array(state.pressure)))
    contributions, untold = dict[str, Contribution](), dict[str, str]()
    if not lower.differs:
        untold["mesh"] = NOTHING_BELOW
    else:
        try:
            before = values_of_steady(steady(set_up(lower.case, system, lower)))
            contributions["mesh"] = of_mesh(values, before, lower.ratio)
        except (CaseError, ConvergenceError) as error:
            untold["mesh"] = _why(error)
    contributions |= of_steady_heat(system, values)
    left = state.complementarity_error + ROUNDING
    contributions["solver"] = {quantity: left * abs(value.number) for quantity, value in values.items()}
    return Uncertainty(values, contributions, untold, time.perf_counter() - begin)


def by_short_jumps(last: Block) -> Block:
    """Return the end of a run as short jumps would have it (`fenwear.steps.evolve`); as it is where not followed.

    Its last half-cycle alone, and the pressures of the last cycle. With stick temperatures are those of the run, whose
    jumps know of them only how far the last one is off.

    Args:
        last: The last half-cycles.
    """
    end, finer = last.end, last.end.finer
    if finer is None:
        return last
    off, totals = end.worn - finer.worn, end.totals - finer.totals
    block = replace(
        last,
        wear=_last_less(last.wear, off.punch),
        wear_strip=_last_less(last.wear_strip, off.strip),
        totals=replace(last.totals, sums=_last_less(last.totals.sums, totals.sums)),
    )
    if last.steps:
        return _with_steps(block, finer)
    return _with_heat(_with_pressures(block, finer), finer)


def _with_steps(last: Block, finer: RunState) -> Block:
    """Return a block whose last time steps are those of the cycle on other depths."""
    cycle = None if finer.memory is None else finer.memory.cycle
    return last if cycle is None else replace(last, steps=(replace(last.steps[-1], records=cycle.records),))


def _with_pressures(last: Block, finer: RunState) -> Block:
    """Return a block with the pressures of another state in its last cycle."""
    motion, (coarse, other) = last.system.motion, (all_phases(state.contacts).pressure for state in (last.end, finer))
    if not len(coarse) or not len(other):
        return last
    middle = slice(motion.positions // 2, None, motion.positions)
    pressure = last.pressure.copy()
    pressure[-motion.half_cycles :] -= (coarse - other)[middle]
    return replace(last, pressure=np.maximum(pressure, 0.0))


def _with_heat(last: Block, finer: RunState) -> Block:
    """Return a block with the temperatures of another state at its end; collective."""
    exchange, heat = last.system.exchange, last.heat
    if heat is None:
        return last
    coarse, other = (exchange.contact_temperatures(exchange.on_bases(state.temperature)) for state in (last.end, finer))
    punch, strip = coarse[0] - other[0], coarse[1] - other[1]
    heat = replace(
        heat,
        temperature_punch=_last_less(heat.temperature_punch, punch),
        temperature_strip=_last_less(heat.temperature_strip, strip),
    )
    return replace(last, heat=heat)


def _last_less(rows: Array, change: Array) -> Array:
    """Return rows whose last one is less by a change."""
    changed = rows.copy()
    changed[-1] -= change
    return changed


HIGHEST = 8  # degree of elements


def uncertainty_table(system: Tribosystem, estimate: Uncertainty) -> dict[str, Any]:
    """Return an uncertainty as summary.json has it: under the names of the numbers, in all and by its sources."""
    return {
        **(_named(system, estimate.total) if estimate.is_whole else {}),
        "contributions": {
            source: _named(system, contribution) for source, contribution in estimate.contributions.items()
        },
        **({"untold": estimate.untold} if estimate.untold else {}),
        "remedies": remedies(system, estimate),
        "seconds": estimate.seconds,
    }


def _named(system: Tribosystem, numbers: Contribution) -> dict[str, Any]:
    named: dict[str, Any] = {}
    for quantity, number in numbers.items():
        registered = known(quantity.name)
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
    return system.sliding.words[int(motion.phases[stroke * motion.positions].direction)]


def remedies(system: Tribosystem, estimate: Uncertainty) -> dict[str, str]:
    """Return for each kind of number what would lower its uncertainty most, a key and its value."""
    worst: dict[str, tuple[float, str]] = {}
    for quantity, value in estimate.values.items():
        share = estimate.total[quantity] / max(abs(value.number), 1e-300)
        if share > worst.get(quantity.name, (0.0, ""))[0]:
            worst[quantity.name] = share, estimate.largest(quantity)
    return {name: remedy for name, (_, source) in worst.items() if (remedy := _remedy(system, source))}


def _remedy(system: Tribosystem, source: str) -> str:
    case, positions = system.case, system.motion.positions
    follow = case.geometry.follow_wear or 0.0
    jumps = case.run.integration == "jump"
    steps = 2 * system.exchange.fineness.steps
    tolerance = "" if case.heat is None else f"heat.reduction_tolerance = {case.heat.reduction_tolerance / 10:.2g}"
    return {
        "mesh": _finer(case),
        "wear_steps": f"run.jump_tolerance = {case.run.jump_tolerance / 4:.2g}"
        if jumps
        else 'run.integration = "jump"',
        "half_cycles": "a shorter motion.duration",
        "slip_steps": f"stick.step_tolerance = {case.stick.step_tolerance / 2:.2g}",
        "positions": f"motion.positions = {2 * positions - positions % 2}",
        "following": f"geometry.follow_wear = {follow / 2:.2g}",
        "heat_steps": f"heat.steps = {steps}",
        "heat_basis": tolerance,
    }.get(source, "")


def _finer(case: Case) -> str:
    """Return the key that reduces the spacing of nodes."""
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
