"""The contributions to the numerical uncertainty of a run's end."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from fenwear.accuracy.again import (
    LESS,
    Again,
    are_dear,
    coarser,
    in_few_steps,
    in_longer_jumps,
    nodes_across,
    set_up,
)
from fenwear.accuracy.heat import of_heat, of_steady_heat
from fenwear.accuracy.jumps import by_short_jumps
from fenwear.accuracy.values import Contribution, Quantity, Value, Values, values_of, values_of_steady
from fenwear.assembly import Tribosystem
from fenwear.case import Case
from fenwear.cycle import Block, SteadyState, steady
from fenwear.cycle.driver import Watch, unwatched
from fenwear.cycle.state import pressure_scale
from fenwear.errors import CaseError, ConvergenceError

SAFETY = 1.25  # of an estimate by the assumed order, as of grid convergence indices
AT_EDGE, INSIDE, OF_VOLUME = 1.0, 1.5, 2.0  # orders in the distance of nodes, see `order_of`
NOTICED = 0.1  # of the wear from which on meshes follow: before, what it would do is not asked for
LATE = 0.5  # of a cycle: within it temperatures of jumps, which see whole cycles, may be any
ROUNDING = 1e-12
NOTHING_BELOW = "there are no elements of a lower degree than 1 to compare with: set geometry.degree = 2"


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
            quantity: sum(own.get(quantity, 0.0) for own in self.contributions.values()) for quantity in self.values
        }

    def largest(self, quantity: Quantity) -> str:
        """Return the source that contributes most to a number."""
        return max(self.contributions, key=lambda source: self.contributions[source].get(quantity, 0.0))


def uncertainty(case: Case, last: Block, watch: Watch = unwatched) -> Uncertainty:
    """Return the numerical uncertainty of a run's end; collective.

    Args:
        case: Of the run, whole, with its law of contact.
        last: The last half-cycles of the run.
        watch: Asked between solves of the runs that are compared.

    Raises:
        InterruptedRunError: as `watch`.
    """
    begin = time.perf_counter()
    values, until = values_of(last), int(last.half_cycle[-1])
    found: dict[str, Contribution] = {}
    untold: dict[str, str] = {}
    lower = coarser(case, last.system, nodes_across(last.system, last.pressure[-last.system.motion.half_cycles :]))
    if lower is None:
        untold["mesh"] = NOTHING_BELOW
    try:
        base = in_few_steps(case if lower is None else lower.case, last.system, until)
        by_jumps = case.run.integration == "jump"
        longer = by_jumps and are_dear(last)
        share = float(by_jumps) * (LESS if longer else 1.0)  # of what its jumps leave: what those of the run do
        again = Again(set_up(in_longer_jumps(base) if longer else base, last.system, lower), until, watch)
        first, end, a_cycle_ago = again.ends()
        before, without = values_of(end), by_short_jumps(end)
        short = before if without is None else values_of(without)
        if lower is not None:
            coarse = {quantity: short[quantity].towards(value, share) for quantity, value in before.items()}
            found["mesh"] = of_mesh(values, coarse, lower.ratio)
        of_jumps = {quantity: SAFETY * share * value.apart(short[quantity]) for quantity, value in before.items()}
        warmest = Quantity("largest_temperature")
        if warmest in before and by_jumps:
            late = LATE * before[warmest].apart(values_of(a_cycle_ago)[warmest])
            if last.steps:  # by the last jump's own error
                of_jumps[warmest] = getattr(last.steps[-1], "jump_error", 0.0) * abs(values[warmest].number)
            of_jumps[warmest] = max(of_jumps[warmest], late)
        for source, contribution in _steps(again, before, of_jumps, first, last):
            found[source] = contribution
    except (CaseError, ConvergenceError) as error:
        untold["steps" if "mesh" in found else "mesh"] = _why(error)
    found |= of_heat(last, values)
    found["solver"] = _of_solver(values, last)
    return Uncertainty(values, found, untold, time.perf_counter() - begin)


def of_mesh(values: Values, coarse: Values, ratio: float) -> Contribution:
    """Return what is left to the limit of small elements, from the same numbers on some times as large ones."""
    return {
        quantity: SAFETY * value.apart(coarse[quantity]) / (ratio ** order_of(quantity, value) - 1)
        for quantity, value in values.items()
        if quantity in coarse
    }


def order_of(quantity: Quantity, value: Value) -> float:
    """Return the order at which a number is taken to approach its limit, in the distance of nodes.

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
        of_jumps: What jumps of the run itself leave in them.
        first: Its first half-cycles.
        last: The last ones of the run itself.
    """
    case = last.system.case
    positions, follow = last.system.motion.positions, case.geometry.follow_wear
    if case.run.integration == "jump":
        yield "wear_steps", of_jumps
    else:
        yield "wear_steps", _of_half_cycles(before, first, last)
    if last.system.sticks:
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
    elif (worn := last.system.wear_on_meshes(last.end.worn)) > NOTICED:  # not yet: with meshes that do half-way
        yield "following", _apart(before, again.otherwise(geometry={"follow_wear": follow * worn / 2}).values(), 2.0)


def _apart(one: Values, other: Values, factor: float) -> Contribution:
    return {quantity: factor * abs(value.number - other[quantity].number) for quantity, value in one.items()}


def _of_half_cycles(before: Values, first: Block, last: Block) -> Contribution:
    """Return what steps of half-cycles leave: in depths, of first order, half of what the wear of one has changed.

    The sums of explicit and of implicit steps differ by the wear of the first half-cycle less that of the last one, and
    lie on either side of the wear that goes on within the steps. Pressure and temperature are half a half-cycle late.
    """
    strokes = last.system.motion.half_cycles
    late = float(last.periodicity[-1]) * pressure_scale(last.system, last.pressure[-1]) / (2 * strokes)
    found: Contribution = {}
    for body, depth, start in (("punch", last.wear, first.wear), ("strip", last.wear_strip, first.wear_strip)):
        rate = float(start[0].max()) / int(first.half_cycle[0])
        mean = float(depth[-1].max()) / int(last.half_cycle[-1])
        found[Quantity("largest_depth", body)] = abs(rate - mean) / 2
    if last.heat is not None and len(last.half_cycle) > strokes:
        sides = (last.heat.temperature_punch, last.heat.temperature_strip)
        change = max(float(np.abs(side[-1] - side[-1 - strokes]).max()) for side in sides)
        found[Quantity("largest_temperature")] = change / (2 * strokes)
    return {
        quantity: found.get(quantity, late if "pressure" in quantity.name and np.isfinite(late) else 0.0)
        for quantity in before
    }


def _of_solver(values: Values, last: Block) -> Contribution:
    left = float(last.equilibrium_error.max()) + float(last.complementarity_error.max()) + ROUNDING
    return {quantity: left * abs(value.number) for quantity, value in values.items()}


def foreseen(system: Tribosystem, watch: Watch = unwatched) -> Uncertainty:
    """Return what the uncertainty of a run's end will be about, before it is run; collective.

    The run is made on elements of the next two lower degrees, by jumps where it is long, and what the finer of the two
    leaves is taken to the run's own by the assumed order. Where there is only one lower degree it is the run itself.

    Args:
        system: Of the run's case.
        watch: Asked between solves.

    Raises:
        ConvergenceError: a half-cycle did not converge.
    """
    begin = time.perf_counter()
    case, until = system.case, system.case.run.half_cycles
    below = coarser(case, system) if case.geometry.degree > 2 or case.grid is not None else None
    base = in_few_steps(case if below is None else below.case, system, until)
    if base.run.integration == "jump":
        until = until // system.motion.half_cycles * system.motion.half_cycles
    one = replace(system, case=base) if below is None else set_up(base, system, below)
    _, last, _ = Again(one, until, watch).ends()
    found = uncertainty(base, last, watch)
    if below is not None and "mesh" in found.contributions:
        mesh = {
            quantity: own / below.ratio ** order_of(quantity, found.values[quantity])
            for quantity, own in found.contributions["mesh"].items()
        }
        found = replace(found, contributions={**found.contributions, "mesh": mesh})
    return replace(found, seconds=time.perf_counter() - begin)


def _why(error: CaseError | ConvergenceError) -> str:
    """Return why there is nothing to compare with; what a case is refused for is of a coarser one."""
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
    lower = coarser(case, system, nodes_across(system, np.array(state.pressure)))
    found, untold = dict[str, Contribution](), dict[str, str]()
    if lower is None:
        untold["mesh"] = NOTHING_BELOW
    else:
        try:
            before = values_of_steady(steady(set_up(lower.case, system, lower)))
            found["mesh"] = of_mesh(values, before, lower.ratio)
        except (CaseError, ConvergenceError) as error:
            untold["mesh"] = _why(error)
    found |= of_steady_heat(system, values)
    left = state.complementarity_error + ROUNDING
    found["solver"] = {quantity: left * abs(value.number) for quantity, value in values.items()}
    return Uncertainty(values, found, untold, time.perf_counter() - begin)
