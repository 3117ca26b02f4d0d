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
Both look at begin and end alone: where coefficients change with the depth, as where a coating's friction ends,
Simpson's rule with the wear of one more cycle, at the shape halfway, gives it, too.

With heat the temperatures go over the jump by one implicit Euler step with the heat of the cycle at its end, which
is computed again until both belong together; the trapezoidal rule gives its error, too, over the warmest contact.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.linalg
from scipy.sparse import csr_array, diags_array, hstack, vstack

from fenwear.arrays import Array, Mask
from fenwear.errors import ConvergenceError
from fenwear.interface.placement import Placement
from fenwear.layers import Evolution, Layers
from fenwear.layers.between import DEBRIS
from fenwear.layers.memory import Held
from fenwear.layers.step import NUDGE
from fenwear.sliding.wear import WornDepths
from fenwear.stick.creep import ACCURATE, CreepStep, opened_by_creep
from fenwear.stick.cycle import PartialSlipProblem
from fenwear.stick.grid_jump import TOO_LARGE, Answering, GridJump
from fenwear.stick.heat import HeatHistory
from fenwear.stick.records import TimeStepRecords
from fenwear.stick.state import PartialSlipState

MOST_HEATINGS, SAME_HEAT = 20, 1e-6  # cycles that a jump's temperatures take; their change, over the warmest
GAMMA = 1 + np.sqrt(0.5)
CREPT = 1e-2  # of all that has crept: near its end errors are no longer measured by what a jump adds
REST = 1e-3  # of all depths: near the end of wear, errors are no longer measured by what a jump wears alone
SAFETY, LEAST, MOST = 0.85, 0.25, 3.0  # of the next jump's length over the last one's


@dataclass(frozen=True)
class FrettingCycle:
    """A cycle at the shape that so many cycles have worn.

    Attributes:
        number: Of cycles done before it.
        worn: Depths at its shape.
        half_cycles: Records of its half-cycles.
        rate: Depths that a cycle wears there, of coated bodies as if coatings went on.
        bases: The same as if coatings were worn through.
        error: Estimated error of the jump that led there, 0 where there was none: of its depths over what it wore, or
            of the contact temperatures over the warmest if that is more.
        first_step: Number of the time step that its records begin with.
        end: State at its end. What comes next follows from it.
        length: Cycles of the next jump, as wished.
        warm: Temperatures at the start of its records (dim,); None without heat.
    """

    number: int
    worn: WornDepths
    half_cycles: list[TimeStepRecords]
    rate: WornDepths
    bases: WornDepths
    error: float
    first_step: int
    end: PartialSlipState
    length: int = 1
    warm: Array | None = None

    @property
    def records(self) -> TimeStepRecords:
        """All time steps."""
        return TimeStepRecords.joined(self.half_cycles)


def jumped(problem: PartialSlipProblem, now: FrettingCycle, cycles: int, tolerance: float) -> FrettingCycle:
    """Return the cycle after the next jump that is accurate enough.

    Args:
        problem: The bodies and what is done to them.
        now: The cycle to go on from.
        cycles: How many in all.
        tolerance: Largest estimated error of one jump.

    Raises:
        ConvergenceError: the shortest jump did not converge.
    """
    length = now.length
    while True:
        tried = min(length, cycles - now.number)
        try:
            then = _attempt(problem, now, tried)
        except ConvergenceError:
            if tried == 1:
                raise
            length = max(1, tried // 4)
            continue
        factor = SAFETY * np.sqrt(tolerance / max(then.error, 1e-300))
        if then.error > tolerance and tried > 1:
            length = max(1, int(tried * min(0.5, max(LEAST, factor))))
            continue
        if tried == length or factor < 1:
            length = max(1, int(np.ceil(tried * min(MOST, max(LEAST, factor)))))
        return replace(then, length=length)


def first_cycle(
    problem: PartialSlipProblem, at: PartialSlipState, worn: WornDepths, number: int, warm: Array | None = None
) -> FrettingCycle:
    """Return the cycle at a shape from which jumps go on, with its temperatures at its start (dim,)."""
    return _rate(problem, at, worn, number, warm=warm)


def _rate(
    problem: PartialSlipProblem,
    at: PartialSlipState,
    worn: WornDepths,
    number: int,
    before: FrettingCycle | None = None,
    warm: Array | None = None,
) -> FrettingCycle:
    """Return the cycle at a shape, after one that leads to it, half a one where nothing else changes within a cycle.

    Raises:
        ConvergenceError: a time step did not converge, or contact and temperatures over the jump did not.
    """
    program, heat, own = problem.program, problem.heat, (problem.interface.layers.memory, problem.interface.creep)
    worn = problem.interface.layers.flown_as(worn, at.worn)
    at = problem.shaped(at, worn)
    # What goes to and fro in a cycle is its own; what laws know of a whole one is of the shape before.
    settled = heat is None and own == (None, None) and not problem.conditions.asks_cycle
    for _ in range(1 if program.half_cycles == 2 and settled else program.half_cycles):
        at, _ = problem.half_cycle(at)
    if heat is not None and before is None:
        at = replace(at, temperature=heat.initial() if warm is None else warm)
    if heat is None or before is None or before.warm is None or before.end.temperature is None:
        return _recorded(problem, at, worn, number)
    cycles, rate = number - before.number, before.end.temperature - before.warm
    if cycles == 1:  # nothing is jumped over: the temperatures are those after the cycle before
        return _recorded(problem, replace(at, temperature=before.end.temperature), worn, number)
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


def _recorded(problem: PartialSlipProblem, at: PartialSlipState, worn: WornDepths, number: int) -> FrettingCycle:
    layers, creep = problem.interface.layers, problem.interface.creep
    at = problem.shaped(at, layers.flown_as(worn, at.worn))
    first, warm, begin = at.next_step, at.temperature, at
    at, parts = problem.cycle(at)
    rate = problem.losses.worn_in(TimeStepRecords.joined(parts), first, begin, rate=True)
    if creep is not None:
        rate = replace(rate, crept=creep.rate(worn.crept, at.contact.crept, problem.program.period))
    bases = problem.losses.worn_of(TimeStepRecords.joined(parts), first, of_bases=True)
    return FrettingCycle(number, layers.flown_as(worn, at.worn), parts, rate, bases, 0.0, first, at, warm=warm)


def _course(cycle: FrettingCycle, steps: int) -> HeatHistory:
    """Return the heat of a cycle's time steps."""
    records = cycle.records
    numbers = [(cycle.first_step + k) % steps for k in range(len(records))]
    return HeatHistory(numbers, records.dissipated / records.duration[:, None], records.conductance)


def _attempt(problem: PartialSlipProblem, now: FrettingCycle, cycles: int) -> FrettingCycle:
    """Return the cycle after a jump."""
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
    first = solve(rate)
    start = _slid_on(now, cycles)
    middle = _rate(problem, start, parted(risen(begin + cycles * first)), now.number + cycles, now)
    second = solve(rate_of(middle) - 2 * first)
    worn = _balanced(problem, now.worn, parted(risen(begin + cycles * (1.5 * first + 0.5 * second))))
    end = whole(problem.coatings.measured(worn))
    then = _rate(problem, replace(middle.end, slid=start.slid), worn, now.number + cycles, now)
    missing = solve(end - begin - cycles / 2 * (rate + rate_of(then)))
    if cycles > 1 and problem.losses.changes_between(now.worn, worn):
        halfway = (begin + end) / 2 + cycles / 8 * (rate - rate_of(then))  # cubic by Hermite
        shape = parted(np.concatenate([np.clip(halfway, begin, end)[:depths], halfway[depths:]]))
        between_them = _rate(problem, _slid_on(now, cycles / 2), shape, now.number + cycles // 2, now)
        simpson = cycles / 6 * (rate + 4 * rate_of(between_them) + rate_of(then))
        seen = solve(end - begin - simpson)
        missing = np.where(np.abs(seen) > np.abs(missing), seen, missing)
    pair = problem.interface.middle.pair
    felt = [pair.weights * (row == DEBRIS[0]) for row in layers.rows]  # what is ejected opens nothing
    area = np.concatenate([pair.weights, pair.strip.weights, *felt, np.zeros(len(begin) - depths - n * len(felt))])
    scale = area @ np.abs(whole(worn) - whole(now.worn)) + REST * (area @ whole(worn))
    opened = np.concatenate([*problem.coatings.slopes(worn), np.ones(len(begin) - depths)])
    error = float(area @ (opened * np.abs(missing))) / max(float(scale), 1e-300)
    remembered = _Remembered.of(problem, now, depths)
    of_states = 0.0 if remembered is None else remembered.error(missing, begin, end)
    of_creep = _creep_error(problem, missing[size:], (end - begin)[size:], end[size:])
    return replace(then, error=max(error, then.error, of_states, of_creep))


def _balanced(problem: PartialSlipProblem, before: WornDepths, after: WornDepths) -> WornDepths:
    """Return depths whose ejected debris is what was worn and does not lie there, to rounding.

    Else it would not be where depths are kept from falling, or coatings end. What is ejected opens nothing: what is
    missing of it is spread evenly.
    """
    layers, pair = problem.interface.layers, problem.interface.middle.pair
    if layers.debris is None:
        return after
    change, rows = after - before, [layers.row(name) for name in DEBRIS]
    worn = pair.weights @ change.punch + pair.strip.weights @ change.strip
    missing = worn - float(pair.weights @ change.between[rows].sum(axis=0))
    between = after.between.copy()
    between[rows[1]] += missing / pair.weights.sum()
    return replace(after, between=between)


def _creep_error(problem: PartialSlipProblem, missing: Array, change: Array, end: Array) -> float:
    """Return the error of what has crept over what a jump creeps; near the end of creep over a part of all."""
    creep, middle = problem.interface.creep, problem.interface.middle
    if creep is None:
        return 0.0
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

    def __init__(self, problem: PartialSlipProblem, now: FrettingCycle, cycles: int) -> None:
        self.problem, self.now, self.cycles = problem, now, cycles
        self._size = len(now.worn.punch) + len(now.worn.strip) + now.worn.between.size + now.worn.carried.size
        self.groups, itself = _derivative(problem, now)
        creep = problem.interface.creep
        self._solve: Callable[[Array], Array]
        if creep is None and all(group.position.compliance.on_grid is not None for group in self.groups):
            self._solve = GridJump(self.groups, itself, GAMMA * cycles).solve
        else:
            self._solve = self._factored(itself)
        self._creep = (
            None if creep is None else CreepStep(creep, problem.interface.middle, problem.program.period, cycles)
        )
        if self._creep is not None:
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
            self._answers[id(group)] = _stiffness(group)
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
        if self._creep is None:
            return self._solve(rest)
        crept = self._creep.solve(right[self._size :])
        rest = rest + ACCURATE * self.cycles * self._by_creep(crept)
        return np.concatenate([self._solve(rest), crept])

    def _by_creep(self, crept: Array) -> Array:
        """Return how a cycle's wear, and what lies between, change by what creeps (n + n_s + rows n)."""
        creep, found = self.problem.interface.creep, np.zeros(self._size)
        if creep is None:
            return found
        for group in self.groups:
            opened = opened_by_creep(group.position, creep, crept)[group.closed]
            found -= group.left @ (self._answer_of(group) @ opened)
        return found


def _slid_on(now: FrettingCycle, cycles: float) -> PartialSlipState:
    """Return the end of a cycle after so many more, as far as what its nodes have slipped tells."""
    slid = now.end.slid
    if slid is None:
        return now.end
    return replace(now.end, slid=slid + max(cycles - 1, 0) * now.records.slip_magnitude.sum(axis=0))


def _derivative(problem: PartialSlipProblem, now: FrettingCycle) -> tuple[list[Answering], csr_array]:
    """Return A, the derivative of a cycle's wear to depths and what lies between, at the contact zone and slip of now.

    Square, of the depths (n + n_s), the state of what lies between (rows n) and of the strip's material (rows n_s): of
    the time steps in one place with the same nodes closed, on grids with any closed, the part by their pressures; and
    what states do to themselves.
    """
    records, steps, n = now.records, problem.program.steps, len(now.worn.punch)
    depths, layers = n + len(now.worn.strip), problem.interface.layers
    debris, total = layers.debris, depths + now.worn.between.size + now.worn.carried.size
    remembered = _Remembered.of(problem, now, depths)
    of_punch, of_strip = problem.coatings.slopes(now.worn)
    parts, measured = problem.coatings.layers_of_wear(now.worn)
    stored, ejected = (0, 0) if debris is None else (depths + n * layers.row(name) for name in DEBRIS)
    groups = dict[tuple[float | Placement, bytes], list[int]]()
    over = None if debris is None else problem.losses.debris_over(records, _begun(now))
    fed, found = None if over is None else over.fed, list[Answering]()
    answering = np.array([_answering(layers, pressure) for pressure in records.pressure])
    for k in range(len(records)):
        place = steps[(now.first_step + k) % len(steps)].offset if problem.interface.moves else 0.0
        gridded = problem.interface.position(place).compliance.on_grid is not None
        groups.setdefault((place, b"" if gridded else answering[k].tobytes()), []).append(k)
    for (place, _), members in groups.items():
        position = problem.interface.position(place)
        closed = np.flatnonzero(answering[members].any(axis=0))
        slopes = _wear_slopes(problem, now, members, answering)
        of_steps, (by_punch, by_strip) = slopes.sum(axis=2), measured
        left = [(closed, of_steps[0, 0] * by_punch[0] + of_steps[0, 1] * by_punch[1])]
        fills = [] if debris is None else [(stored, 1.0)]
        if fed is not None:
            there = np.array([parts[0], [position.pair.wear_interpolation @ part for part in parts[1]]])
            lost = np.einsum("blkn,bln->kn", slopes, there)
            kept = np.einsum("kn,kn->n", fed[members], lost)
            left += [(stored + closed, kept), (ejected + closed, lost.sum(axis=0) - kept)]
        if remembered is not None:
            for rows, filled, rate in remembered.filling(members):
                left.append((rows.start + closed, rate))
                fills.append((rows.start, filled))
        count, every = len(closed), np.arange(len(closed))
        onto_strip = csr_array(position.pair.wear_projection)[:, closed]
        of_coating, of_base = (
            diags_array(own) @ onto_strip @ diags_array(slope[closed])
            for own, slope in zip(by_strip, of_steps[1], strict=True)
        )
        put = csr_array(of_coating + of_base)
        onto = [csr_array((rate[closed], (rows, every)), shape=(total, count)) for rows, rate in left]
        onto.append(csr_array(vstack([csr_array((n, count)), put, csr_array((total - depths, count))])))
        read = diags_array(of_strip)
        seen = csr_array(position.pair.wear_interpolation)[closed] @ read
        own = csr_array((of_punch[closed], (every, closed)), shape=(count, n))
        by = csr_array(hstack([own, seen, csr_array((count, total - depths))]))
        for first, filled in fills:
            by = by - csr_array((np.full(count, filled), (every, first + closed)), shape=(count, total))
        share = float(records.duration[members].sum() / records.duration.sum())
        pressure = records.pressure[members].mean(axis=0)
        closure = layers.closure_at(position.pair, now.worn)
        found.append(
            Answering(position, closed, pressure, csr_array(sum(onto[1:], onto[0])), csr_array(by), share, closure)
        )
    itself = csr_array((total, total))
    if over is not None:
        lost, at = over.loss, np.arange(n)
        for row, rate in ((stored, -lost), (ejected, lost)):
            itself = itself + csr_array((rate, (row + at, stored + at)), shape=(total, total))
    return found, csr_array(itself if remembered is None else itself + remembered.slopes(total))


def _wear_slopes(problem: PartialSlipProblem, now: FrettingCycle, members: list[int], answering: Mask) -> Array:
    """Return how what time steps wear follows their pressures (2, 2, m, n), of both bodies, of coating and base each.

    Args:
        problem: The bodies and what is done to them.
        now: The cycle of the steps.
        members: Which of them.
        answering: Nodes whose pressures answer in each step of the cycle (k, n).
    """
    records, found = now.records, np.zeros((2, 2, len(members), answering.shape[1]))
    for body, laws in enumerate(problem.wear.layers):
        for layer, law in enumerate(laws):
            if law is None:
                continue
            for row, k in enumerate(members):
                slope = law.slope(records.pressure[k], records.slip_magnitude[k], float(records.duration[k]))
                found[body, layer, row] = slope * answering[k]
    return found


def _begun(now: FrettingCycle) -> PartialSlipState:
    """Return the state that the records of a cycle begin at, as far as laws ask for it."""
    return replace(now.end, worn=now.worn, held=None, next_step=now.first_step)


def _answering(layers: Layers, pressure: Array) -> Mask:
    """Return the nodes whose pressure falls by a depth: they touch, and do not flow, but where all do."""
    found = (pressure > 0) & (pressure < layers.hardness)
    return found if found.any() else pressure > 0


@dataclass(frozen=True)
class _Remembered:
    """The states that laws remember among all unknowns of a jump.

    Attributes:
        rows: Where each is, those of the contact first.
        areas: Of the nodes of each.
        evolution: What a cycle does to them.
        held: Where it begins.
        fills: Gap that a unit of each fills, mm.
    """

    rows: tuple[slice, ...]
    areas: tuple[Array, ...]
    evolution: Evolution
    held: Held
    fills: tuple[float, ...]

    @classmethod
    def of(cls, problem: PartialSlipProblem, now: FrettingCycle, depths: int) -> _Remembered | None:
        """Return those of a cycle, behind so many depths; None without."""
        layers, pair, memory = problem.interface.layers, problem.interface.middle.pair, problem.interface.layers.memory
        evolution = problem.losses.evolution(now.records, _begun(now))
        if memory is None or evolution is None:
            return None
        begin = depths + now.worn.between.size - len(pair.weights) * len(memory.contact)
        weights = [*(pair.weights for _ in memory.contact), *(pair.strip.weights for _ in memory.strip)]
        ends = begin + np.cumsum([len(own) for own in weights])
        rows = tuple(slice(int(end) - len(own), int(end)) for end, own in zip(ends, weights, strict=True))
        fills = tuple(state.fills for state in memory.states)
        return cls(rows, tuple(weights), evolution, layers.held(now.worn), fills)

    def error(self, missing: Array, begin: Array, end: Array) -> float:
        """Return the largest error of a state over its size, both integrated."""
        size = np.maximum(np.abs(end), np.abs(begin))
        pairs = zip(self.rows, self.areas, strict=True)
        return max(float(own @ np.abs(missing[row])) / max(float(own @ size[row]), 1e-300) for row, own in pairs)

    def filling(self, steps: Sequence[int]) -> list[tuple[slice, float, Array]]:
        """Return of states that fill the gap where they are, by how much, and how their rates follow the pressure (n,).

        Args:
            steps: Whose pressures change.
        """
        if not any(self.fills):
            return []
        pressure = np.array([one.pressure for one in self.evolution.conditions])
        size, more = NUDGE * max(float(pressure.max()), 1e-300), pressure.copy()
        more[list(steps)] += size
        change = (self.evolution.at(more).rate(self.held)[0] - self.evolution.rate(self.held)[0]).times(1 / size)
        contact = zip(self.rows, self.fills, change.contact, strict=False)
        return [(row, fills, np.asarray(rate)) for row, fills, rate in contact if fills]

    def slopes(self, total: int) -> csr_array:
        """Return how the rates follow the states themselves, among all unknowns (total, total)."""
        found, slopes = csr_array((total, total)), self.evolution.rate(self.held)[1]
        q = slopes.contact.shape[1]
        for own, part in ((self.rows[:q], slopes.contact), (self.rows[q:], slopes.strip)):
            at = np.arange(part.shape[0])
            for i, one in enumerate(own):
                for j, other in enumerate(own):
                    entries = part[:, i, j], (one.start + at, other.start + at)
                    found = found + csr_array(entries, shape=(total, total))
        return csr_array(found)


def _stiffness(group: Answering) -> Array:
    """Return how the pressures of closed nodes fall by a depth at each, under a constant load (k, k), MPa/mm."""
    position, closed = group.position, group.closed
    k, r = len(closed), position.modes.shape[1]
    n = len(position.pair.weights)
    unit = float(np.median(position.compliance.diagonal()[:n]))
    system = np.zeros((k + r, k + r))
    system[:k, :k] = position.compliance.entries(closed, closed) / unit
    closure = group.closure
    if closure is not None:
        system[np.arange(k), np.arange(k)] += closure.slope(group.pressure)[closed] / unit
    system[:k, k:] = position.modes[closed]
    system[k:, :k] = position.balance[:, closed]
    right = np.eye(k + r)[:, :k]
    return np.asarray(scipy.linalg.solve(system, right)[:k] / unit)
