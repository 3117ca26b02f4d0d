"""Cycle jumps in partial slip: many cycles in one linearly implicit step.

A cycle at a fixed shape y, after half a cycle that makes it forget the shape before, wears F(y) off both
bodies, so that dy/dn = F(y) over the number n of cycles. One jump of N cycles is a step of the two-stage
Rosenbrock method of second order (J. G. Verwer et al., SIAM J. Sci. Comput. 20, 1999)

    (1 - g N A) k1 = F(y),    (1 - g N A) k2 = F(y + N k1) - 2 k1,    y + N (3 k1 + k2) / 2,

which is of second order for any matrix A, and stable for jumps far beyond the explicit limit where A is
near dF/dy: the slip of each node, times its pressure's answer to depth while the contact stays as it is.
What lies between goes on with the depths: y has its state, too. Of coated bodies y has what their coatings would have
lost if they went on, by the ratio of what base and coating would wear in the jump's first cycle: that grows evenly
through their end (`fenwear.sliding.coating.CoatedBody`) where the ratio stays, and nearly so elsewhere.
The wear at the end, which the next jump begins with, gives the error by the trapezoidal rule. No depth decreases.
A cycle whose error is too large goes in parts, of which each is such a jump: N is below 1.
Loads that change are those of each rate's own time: alone they would leave that rule nothing to see, so that the wear
halfway is looked at, too.
Both look at begin and end alone: where coefficients change with the depth, as where a coating's friction ends,
Simpson's rule with the wear of one more cycle, at the shape halfway, gives it, too.

With heat the temperatures go over the jump by one implicit Euler step with the heat of the cycle at its end, which
is computed again until both belong together; the trapezoidal rule gives its error, too, over the warmest contact.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property

import numpy as np
import scipy.linalg
from scipy.sparse import csr_array

from fenwear.arrays import Array
from fenwear.errors import ConvergenceError
from fenwear.layers.between import DEBRIS
from fenwear.sliding.wear import WornDepths
from fenwear.stick.creep import ACCURATE, CreepStep, opened_by_creep
from fenwear.stick.cycle import PartialSlipProblem
from fenwear.stick.derivative import Remembered, derivative, rows_of_debris, stiffness
from fenwear.stick.grid_jump import TOO_LARGE, Answering, GridJump
from fenwear.stick.heat import HeatHistory
from fenwear.stick.records import FrettingCycle, TimeStepRecords
from fenwear.stick.state import PartialSlipState

MOST_HEATINGS, SAME_HEAT = 20, 1e-6  # cycles that a jump's temperatures take; their change, over the warmest
GAMMA = 1 + np.sqrt(0.5)
CREPT = 1e-2  # of all that has crept: near its end errors are no longer measured by what a jump adds
REST = 1e-3  # of all depths: near the end of wear, errors are no longer measured by what a jump wears alone
SAFETY, LEAST, MOST = 0.85, 0.25, 3.0  # of the next jump's length over the last one's
SHORTEST = 1 / 256  # of a cycle: the shortest part of one


def jumped(
    problem: PartialSlipProblem,
    now: FrettingCycle,
    cycles: int,
    tolerance: float,
    load: Callable[[float], float] = lambda _: 1.0,
    fits: Callable[[FrettingCycle], bool] = lambda _: True,
) -> FrettingCycle:
    """Return the cycle after the next jump that is accurate enough: of many cycles, or of one in parts.

    Args:
        problem: The bodies and what is done to them.
        now: The cycle to go on from.
        cycles: How many in all.
        tolerance: Largest estimated error of one jump.
        load: Factor of all loads after so many cycles.
        fits: Whether the nodes suffice for the cycle after it: it is halved where they do not.

    Raises:
        ConvergenceError: the shortest part of a cycle did not converge.
    """
    begin, length, error = now, now.length, 0.0
    while True:
        left = cycles - begin.number if now is begin and length >= 1 else begin.number + 1 - now.number
        tried = left if left < min(length, 1) + SHORTEST else min(length, left)
        try:
            then = _attempt(problem, now, tried, load, begin)
        except ConvergenceError:
            if tried <= SHORTEST:
                raise
            length = _length(tried / 4)
            continue
        if tried > 1 and not fits(then):
            length = _length(tried / 2)
            continue
        factor = float(SAFETY * np.sqrt(tolerance / max(then.error, 1e-300)))
        if then.error > tolerance and tried > SHORTEST:
            length = _length(tried * min(0.5, max(LEAST, factor)))
            continue
        error = max(error, then.error)
        if tried == length or factor < 1:
            longer = tried * min(MOST, max(LEAST, factor))
            length = _length(longer if longer < 1 else np.ceil(longer))
        if tried == left or tried >= 1:
            return replace(then, number=round(then.number), length=length, error=error)
        now = then


def _length(cycles: float) -> float:
    """Return a length of jumps: whole cycles, or a part of one."""
    return int(cycles) if cycles >= 1 else max(float(cycles), SHORTEST)


def first_cycle(
    problem: PartialSlipProblem, at: PartialSlipState, worn: WornDepths, number: float, warm: Array | None = None
) -> FrettingCycle:
    """Return the cycle at a shape from which jumps go on, with its temperatures at its start (dim,)."""
    return _rate(problem, at, worn, number, warm=warm)


def _rate(
    problem: PartialSlipProblem,
    at: PartialSlipState,
    worn: WornDepths,
    number: float,
    before: FrettingCycle | None = None,
    warm: Array | None = None,
) -> FrettingCycle:
    """Return the cycle at a shape, after one that leads to it, half a one where nothing else changes within a cycle.

    Raises:
        ConvergenceError: a time step did not converge, or contact and temperatures over the jump did not.
    """
    program, heat, own = problem.program, problem.heat, problem.interface
    worn = problem.interface.layers.flown_as(worn, at.worn)
    at = problem.shaped(at, worn)
    # What goes to and fro in a cycle is its own; what laws know of a whole one is of the shape before.
    constant = not own.layers.memory.names and not own.creep.creeps and not problem.conditions.asks_cycle
    settled = heat is None and constant
    for _ in range(1 if program.half_cycles == 2 and settled else program.half_cycles):
        at, _ = problem.half_cycle(at)
    if heat is not None and before is None:
        at = replace(at, temperature=heat.initial() if warm is None else warm)
    if heat is None or before is None or before.warm is None or before.end.temperature is None:
        return _recorded(problem, at, worn, number)
    cycles, rate = number - before.number, before.end.temperature - before.warm
    if cycles <= 1:  # nothing is jumped over: the temperatures go to those after the cycle before
        return _recorded(problem, replace(at, temperature=before.warm + cycles * rate), worn, number)
    over = heat.through(_course(before, len(program.steps)))
    warm = over.after(before.warm, cycles)
    for _ in range(MOST_HEATINGS):
        found = _recorded(problem, replace(at, temperature=warm), worn, number)
        over = heat.through(_course(found, len(program.steps)))
        again = over.after(before.warm, cycles)
        warmest = float(np.abs(heat.surfaces(again)).max())
        if np.abs(heat.surfaces(again) - heat.surfaces(warm)).max() <= SAME_HEAT * warmest:
            wrong = heat.surface_changes(over.error(before.warm, again, rate, cycles))
            return replace(found, error=float(np.abs(wrong).max() / max(warmest, 1e-300)))
        warm = again
    raise ConvergenceError(f"the temperatures of a jump did not settle in {MOST_HEATINGS} cycles")


def _recorded(problem: PartialSlipProblem, at: PartialSlipState, worn: WornDepths, number: float) -> FrettingCycle:
    layers, creep = problem.interface.layers, problem.interface.creep
    at = problem.shaped(at, layers.flown_as(worn, at.worn))
    first, warm, begin = at.next_step, at.temperature, at
    at, parts = problem.cycle(at)
    rate = problem.losses.worn_in(TimeStepRecords.joined(parts), first, begin, rate=True)
    rate = replace(rate, crept=creep.rate(worn.crept, at.contact.crept, problem.program.period))
    bases = problem.losses.worn_of(TimeStepRecords.joined(parts), first, of_bases=True)
    return FrettingCycle(number, layers.flown_as(worn, at.worn), parts, rate, bases, 0.0, first, at, warm=warm)


def _course(cycle: FrettingCycle, steps: int) -> HeatHistory:
    """Return the heat of a cycle's time steps."""
    records = cycle.records
    numbers = [(cycle.first_step + k) % steps for k in range(len(records))]
    return HeatHistory(numbers, records.dissipated / records.duration[:, None], records.conductance)


def _attempt(
    problem: PartialSlipProblem,
    now: FrettingCycle,
    cycles: float,
    load: Callable[[float], float],
    begin_of_heat: FrettingCycle,
) -> FrettingCycle:
    """Return the cycle after a jump; its temperatures go on from those of the last whole cycle."""
    problem = problem.worn_like(now.records, now.first_step)
    n, depths = len(now.worn.punch), len(now.worn.punch) + len(now.worn.strip)
    between, layers = depths + now.worn.between.size, problem.interface.layers
    size = between + now.worn.carried.size

    def parted(y: Array) -> WornDepths:
        shapes = now.worn.between.shape, now.worn.carried.shape
        state, carried = y[depths:between].reshape(shapes[0]), y[between:size].reshape(shapes[1])
        found = problem.coatings.depths(WornDepths(y[:n], y[n:depths], state, y[size:], carried))
        return layers.settled(found)

    def whole(worn: WornDepths) -> Array:
        return np.concatenate([worn.punch, worn.strip, worn.between.ravel(), worn.carried.ravel(), worn.crept])

    def rate_of(cycle: FrettingCycle) -> Array:
        return whole(problem.coatings.measured_rate(cycle.rate, cycle.bases, cycle.worn))

    begin, rate = whole(problem.coatings.measured(now.worn)), rate_of(now)

    def risen(y: Array) -> Array:
        return np.concatenate([np.maximum(y[:depths], begin[:depths]), y[depths:]])

    if not np.isfinite(rate).all():
        raise ConvergenceError(TOO_LARGE)
    solve = _Implicit(problem, now, cycles).solve
    off = None if now.finer is None else begin - whole(problem.coatings.measured(now.finer))
    first = solve(rate)
    start = _slid_on(now, cycles, load)
    middle = _rate(problem, start, parted(risen(begin + cycles * first)), now.number + cycles, begin_of_heat)
    second = solve(rate_of(middle) - 2 * first)
    worn = _balanced(problem, now.worn, parted(risen(begin + cycles * (1.5 * first + 0.5 * second))))
    end = whole(problem.coatings.measured(worn))
    then = _rate(problem, replace(middle.end, slid=start.slid), worn, now.number + cycles, begin_of_heat)
    missing = solve(end - begin - cycles / 2 * (rate + rate_of(then)))
    if cycles > 1 and (start.load != now.end.load or problem.losses.changes_between(now.worn, worn)):
        halfway = (begin + end) / 2 + cycles / 8 * (rate - rate_of(then))  # cubic by Hermite
        shape = parted(np.concatenate([np.clip(halfway, begin, end)[:depths], halfway[depths:]]))
        between_them = _rate(problem, _slid_on(now, cycles / 2, load), shape, now.number + cycles / 2, begin_of_heat)
        simpson = cycles / 6 * (rate + 4 * rate_of(between_them) + rate_of(then))
        seen = solve(end - begin - simpson)
        missing = np.where(np.abs(seen) > np.abs(missing), seen, missing)
    felt = _felt(problem)
    area = np.concatenate([felt, np.zeros(len(begin) - len(felt))])  # states of laws and creep have errors of their own
    scale = area @ np.abs(whole(worn) - whole(now.worn)) + REST * (area @ whole(worn))
    opened = np.concatenate([*problem.coatings.slopes(worn), np.ones(len(begin) - depths)])
    error = float(area @ (opened * np.abs(missing))) / max(float(scale), 1e-300)
    remembered = Remembered.of(problem, now, depths)
    of_states = 0.0 if remembered is None else remembered.error(missing, begin, end)
    of_creep = _creep_error(problem, missing[size:], (end - begin)[size:], end[size:])
    of_debris = _debris_error(problem, missing, begin, end)
    finer = None if off is None else parted(end - missing - _went_on(solve, off))
    return replace(then, error=max(error, then.error, of_states, of_creep, of_debris), finer=finer)


def _went_on(solve: Callable[[Array], Array], off: Array) -> Array:
    """Return what a jump makes of a difference of its begin: (1 + (1 - 2 g) z) / (1 - g z)^2 of it, z = N A."""
    once = solve(off)
    return np.asarray((1 - GAMMA) / GAMMA * solve(once) + (2 * GAMMA - 1) / GAMMA * once)


def _balanced(problem: PartialSlipProblem, before: WornDepths, after: WornDepths) -> WornDepths:
    """Return depths whose ejected debris is what was worn and does not lie there, to rounding.

    Else it would not be where depths are kept from falling, or coatings end. What is ejected opens nothing: what is
    missing of it is spread evenly.
    """
    layers, pair = problem.interface.layers, problem.interface.middle.pair
    if layers.debris is None:
        return after
    change = after - before
    worn = pair.weights @ change.punch + pair.strip.weights @ change.strip
    if layers.strip_carries:
        rows, weights, changed, state = [0, 1], pair.strip.weights, change.carried, after.carried.copy()
    else:
        rows, weights = [layers.row(name) for name in DEBRIS], pair.weights
        changed, state = change.between, after.between.copy()
    state[rows[1]] += (worn - float(weights @ changed[rows].sum(axis=0))) / weights.sum()
    return replace(after, carried=state) if layers.strip_carries else replace(after, between=state)


def _felt(problem: PartialSlipProblem) -> Array:
    """Return the areas by which depths and what lies between are felt as gaps: what is ejected opens nothing."""
    layers, pair = problem.interface.layers, problem.interface.middle.pair
    here = [pair.weights * (row == DEBRIS[0]) for row in layers.rows]
    on_strip = [pair.strip.weights * (row == DEBRIS[0]) for row in layers.carried_rows]
    return np.concatenate([pair.weights, pair.strip.weights, *here, *on_strip])


def _debris_error(problem: PartialSlipProblem, missing: Array, begin: Array, end: Array) -> float:
    """Return the error of the debris' thickness over its size; 0 without.

    Beside what a jump wears, in many of its lives, it is next to nothing: an error of that says nothing of it.
    """
    layers, pair = problem.interface.layers, problem.interface.middle.pair
    if layers.debris is None:
        return 0.0
    weights = pair.strip.weights if layers.strip_carries else pair.weights
    stored, _ = rows_of_debris(layers, len(pair.weights), len(pair.strip.weights))
    wrong, first, last = (float(weights @ np.abs(y[stored : stored + len(weights)])) for y in (missing, begin, end))
    return wrong / max(first, last, 1e-300)


def _creep_error(problem: PartialSlipProblem, missing: Array, change: Array, end: Array) -> float:
    """Return the error of what has crept over what a jump creeps; near the end of creep over a part of all."""
    creep, middle = problem.interface.creep, problem.interface.middle
    wrong, done, there = (
        float(problem.weights @ np.abs(opened_by_creep(middle, creep, state))) for state in (missing, change, end)
    )
    return wrong / max(done, CREPT * there, 1e-300)


class _Implicit:
    """(1 - T) z = r with T near N dF/dy: depths and what lies between by g N A, and what creeps.

    Along the normal what creeps follows the pressures' answer to it, as depths do. Its steps are of the more accurate
    of the two methods that are stable to infinity, g = 1 - 1/sqrt(2), which takes T as it is: along the tangents, where
    sticking nodes relax as fast as their bodies let them, the other one serves, with the fastest pace there may be.
    How depths change what creeps is left out: of second order the method is with any T.

    Args:
        problem: The bodies and what is done to them.
        now: The cycle that the jump begins with.
        cycles: N.

    Raises:
        ConvergenceError: T is beyond all numbers.
    """

    def __init__(self, problem: PartialSlipProblem, now: FrettingCycle, cycles: float) -> None:
        self.problem, self.now, self.cycles = problem, now, cycles
        self._size = len(now.worn.punch) + len(now.worn.strip) + now.worn.between.size + now.worn.carried.size
        self.groups, itself = derivative(problem, now)
        creep = problem.interface.creep
        self._solve: Callable[[Array], Array]
        if not creep.creeps and all(group.position.compliance.on_grid is not None for group in self.groups):
            self._solve = GridJump(self.groups, itself, GAMMA * cycles).solve
        else:
            self._solve = self._factored(itself)
        self._creep = CreepStep(creep, problem.interface.middle, problem.program.period, cycles)
        if creep.creeps:
            self._creep.answering(self._answer())

    def _factored(self, itself: csr_array) -> Callable[[Array], Array]:
        """Return the solution operator by a factor of all unknowns."""
        derivative = itself.toarray()
        for group in self.groups:
            derivative -= group.left @ (self._answer_of(group) @ group.right.toarray())
        matrix = np.eye(self._size) - GAMMA * self.cycles * derivative
        if not np.isfinite(matrix).all():
            raise ConvergenceError(TOO_LARGE)
        factor = scipy.linalg.lu_factor(matrix)
        return lambda right: np.asarray(scipy.linalg.lu_solve(factor, right))

    def _answer_of(self, group: Answering) -> Array:
        """Return how pressures of a group fall by a depth at each (k, k), MPa/mm, which is kept."""
        if id(group) not in self._answers:
            self._answers[id(group)] = stiffness(group)
        return self._answers[id(group)]

    @cached_property
    def _answers(self) -> dict[int, Array]:
        return {}

    def _answer(self) -> Array:
        """Return how pressures fall by a depth that stays all through the cycle (n, n), on the mean of its steps."""
        found = np.zeros((len(self.problem.weights),) * 2)
        for group in self.groups:
            found[np.ix_(group.closed, group.closed)] += group.share * self._answer_of(group)
        return found

    def solve(self, right: Array) -> Array:
        """Return z."""
        rest = right[: self._size]
        if not self.problem.interface.creep.creeps:
            return self._solve(rest)
        crept = self._creep.solve(right[self._size :])
        rest = rest + ACCURATE * self.cycles * self._by_creep(crept)
        return np.concatenate([self._solve(rest), crept])

    def _by_creep(self, crept: Array) -> Array:
        """Return how a cycle's wear, and what lies between, change by what creeps (n + n_s + rows n)."""
        creep, found = self.problem.interface.creep, np.zeros(self._size)
        for group in self.groups:
            opened = opened_by_creep(group.position, creep, crept)[group.closed]
            found -= group.left @ (self._answer_of(group) @ opened)
        return found


def _slid_on(now: FrettingCycle, cycles: float, load: Callable[[float], float]) -> PartialSlipState:
    """Return the end of a cycle under the load of so many later, as far as what its nodes have slipped tells."""
    slid, end = now.end.slid, replace(now.end, load=load(now.number + cycles))
    if slid is None:
        return end
    return replace(end, slid=slid + (cycles - 1) * now.records.slip_magnitude.sum(axis=0))
