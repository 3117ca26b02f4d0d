"""Cycle jumps in partial slip: many cycles in one implicit-explicit step.

A cycle at a fixed shape y, after half a cycle that makes it forget the shape before, wears F(y) off both
bodies, so that dy/dn = F(y) over the number n of cycles. Where the strip passes it takes many cycles to forget: there
the contact runs in at y until a cycle ends as it begins, over no more cycles than the jump has, and without heat.
With M(y) the wear of a cycle whose nodes slip as in the last one (`frozen`), and R = F - M what
cycles do beside it, one jump of N cycles is a step of the two-stage Runge-Kutta
method ARS(2,2,2) of second order (U. M. Ascher et al., Applied Numerical Mathematics 25, 1997): that of gross sliding
(`fenwear.cycle.jump_step`), where nothing is beside M, with R as it was seen last, linear in n. With g = 1 - 1/sqrt(2)

    y_1 = y + g N (M(y_1) + R(g N)),
    y_2 = y + (1 - g) N (M(y_1) + R(g N)) + g N (M(y_2) + R(N)).

R is known from the cycle at the begin and one halfway, to which a first step with R as it is at the begin leads. A
second step starts there; the cycle at its end begins the next jump. A jump in which nodes come into contact ends by a
step of the implicit Euler method over a part of it, as in gross sliding. Its error has two parts: of M a third of the
difference to one step over the whole jump, and of R Simpson's rule against the line, each as the last stage damps it.

What lies between goes on with the depths: y has its state, too. Of coated bodies y has what their coatings would have
lost if they went on, by the ratio of what base and coating would wear in the jump's first cycle: that grows evenly
through their end (`fenwear.sliding.coating.CoatedBody`) where the ratio stays, and nearly so elsewhere.
No depth decreases. A cycle whose error is too large goes in parts, of which each is such a jump: N is below 1.
Loads that change are those of each cycle's own time.

With heat the temperatures go over the jump by one implicit Euler step with the heat of the cycle at its end, which
is computed again until both belong together; the trapezoidal rule gives its error, too, over the warmest contact.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fenwear.arrays import Array
from fenwear.contact import ContactState
from fenwear.cycle.jump_error import HALVES, Estimate, Lengths, Sizes, force_difference
from fenwear.errors import ConvergenceError
from fenwear.sliding.wear import WornDepths
from fenwear.stick.creep import opened_by_creep
from fenwear.stick.cycle import PartialSlipProblem
from fenwear.stick.frozen import Frozen
from fenwear.stick.heat import HeatHistory
from fenwear.stick.records import FrettingCycle, TimeStepRecords
from fenwear.stick.state import PartialSlipState

MOST_HEATINGS, SAME_HEAT = 20, 1e-6  # cycles that a jump's temperatures take; their change, over the warmest
SHARE = 1 - np.sqrt(0.5)  # of a step, that a stage is long
LAST = 1 / 8  # of a jump in which nodes come into contact, that its last step covers
TOO_LARGE = "wear of many cycles is too large for numbers: expected a smaller wear coefficient"
REST = 1e-3  # of all depths: near the end of wear, errors are no longer measured by what a jump wears alone
MOST_RUN_IN, CLOSED = 20, 1e-3  # cycles until one closes; its change of tractions, over all of them
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
    begin, length, error, lengths = now, now.length, 0.0, Lengths(tolerance, SHORTEST)
    while True:
        left = cycles - begin.number if now is begin and length >= 1 else begin.number + 1 - now.number
        tried = left if left < min(length, 1) + SHORTEST else min(length, left)
        try:
            then, estimate = _attempt(problem, now, tried, load, begin)
        except ConvergenceError:
            if tried <= SHORTEST:
                raise
            length = lengths.cut(tried / 4)
            continue
        if tried > 1 and not fits(then):
            length = lengths.cut(tried / 2)
            continue
        if estimate.largest > tolerance and tried > SHORTEST:
            length = lengths.shorter(tried, estimate)
            continue
        error, length = max(error, estimate.largest), lengths.following(tried, length, estimate)
        if tried == left or tried >= 1:
            return replace(then, number=round(then.number), length=length, error=error)
        now = then


def first_cycle(
    problem: PartialSlipProblem, at: PartialSlipState, worn: WornDepths, number: float, warm: Array | None = None
) -> FrettingCycle:
    """Return the cycle at a shape from which jumps go on, with its temperatures at its start (dim,).

    Raises:
        ConvergenceError: a time step did not converge.
    """
    at, heat = _led_to(problem, at, worn), problem.heat
    if heat is not None:
        at = replace(at, temperature=heat.initial() if warm is None else warm)
    return _recorded(problem, at, worn, number)


def _led_to(problem: PartialSlipProblem, at: PartialSlipState, worn: WornDepths) -> PartialSlipState:
    """Return the state after a cycle at a shape, or half a one where nothing else changes within a cycle."""
    program, own = problem.program, problem.interface
    at = problem.shaped(at, own.layers.flown_as(worn, at.worn))
    # What goes to and fro in a cycle is its own; what laws know of a whole one is of the shape before.
    constant = not own.layers.memory.names and not own.creep.creeps and not problem.conditions.asks_cycle
    half = program.half_cycles == 2 and constant and problem.heat is None
    for _ in range(1 if half else program.half_cycles):
        at, _ = problem.half_cycle(at)
    return at


def _cycle_after(
    problem: PartialSlipProblem, before: FrettingCycle, at: PartialSlipState, worn: WornDepths, number: float
) -> FrettingCycle:
    """Return the cycle at a shape, with the temperatures that the cycles since one before lead to.

    Raises:
        ConvergenceError: a time step did not converge, or contact and temperatures over the jump did not.
    """
    at, heat = _led_to(problem, at, worn), problem.heat
    if heat is None or before.warm is None or before.end.temperature is None:
        return _recorded(problem, at, worn, number, min(int(number - before.number), MOST_RUN_IN))
    cycles, rate, steps = number - before.number, before.end.temperature - before.warm, len(problem.program.steps)
    if cycles <= 1:  # nothing is jumped over: the temperatures go to those after the cycle before
        return _recorded(problem, replace(at, temperature=before.warm + cycles * rate), worn, number)
    warm = heat.through(_course(before, steps)).after(before.warm, cycles)
    for _ in range(MOST_HEATINGS):
        found = _recorded(problem, replace(at, temperature=warm), worn, number)
        over = heat.through(_course(found, steps))
        again = over.after(before.warm, cycles)
        warmest = float(np.abs(heat.surfaces(again)).max())
        if np.abs(heat.surfaces(again) - heat.surfaces(warm)).max() <= SAME_HEAT * warmest:
            wrong = heat.surface_changes(over.error(before.warm, again, rate, cycles))
            return replace(found, error=float(np.abs(wrong).max() / max(warmest, 1e-300)))
        warm = again
    raise ConvergenceError(f"the temperatures of a jump did not settle in {MOST_HEATINGS} cycles")


def _recorded(
    problem: PartialSlipProblem, at: PartialSlipState, worn: WornDepths, number: float, most: int = 0
) -> FrettingCycle:
    """Return the cycle at a shape from a state: where the strip passes, of at most so many more the one that closes."""
    layers, creep = problem.interface.layers, problem.interface.creep
    begin = problem.shaped(at, layers.flown_as(worn, at.worn))
    first, warm = begin.next_step, begin.temperature
    at, parts = problem.cycle(begin)
    for _ in range(most if problem.interface.moves else 0):
        last = at.contact.traction
        if np.abs(last - begin.contact.traction).sum() <= CLOSED * np.abs(last).sum():
            break
        begin = problem.shaped(replace(at, slid=begin.slid), layers.flown_as(worn, at.worn))
        at, parts = problem.cycle(begin)
    rate = problem.losses.worn_in(TimeStepRecords.joined(parts), first, begin, rate=True)
    rate = replace(rate, crept=creep.rate(worn.crept, at.contact.crept, problem.program.period))
    bases = problem.losses.worn_of(TimeStepRecords.joined(parts), first, of_bases=True)
    return FrettingCycle(number, layers.flown_as(worn, at.worn), parts, rate, bases, 0.0, first, at, warm=warm)


def _course(cycle: FrettingCycle, steps: int) -> HeatHistory:
    """Return the heat of a cycle's time steps."""
    records = cycle.records
    numbers = [(cycle.first_step + k) % steps for k in range(len(records))]
    return HeatHistory(numbers, records.dissipated / records.duration[:, None], records.conductance)


class _Packing:
    """Depths and what goes with them as one array: of coated bodies what their coatings would have lost."""

    def __init__(self, problem: PartialSlipProblem, like: WornDepths) -> None:
        self.problem, self._like = problem, like
        self.depths = len(like.punch) + len(like.strip)
        self._cuts = np.cumsum([part.size for part in _parts(like)])[:-1]

    def of(self, worn: WornDepths) -> Array:
        """Return depths as an array (size,)."""
        return np.concatenate(_parts(self.problem.coatings.measured(worn)))

    def parted(self, y: Array) -> WornDepths:
        """Return the depths of an array (size,), no thickness below zero."""
        return self.problem.interface.layers.settled(self.on_the_way(y))

    def on_the_way(self, y: Array) -> WornDepths:
        """Return the depths (size,) at the begin of a stage: they may overshoot, and so may debris."""
        punch, strip, between, carried, crept = np.split(y, self._cuts)
        shapes = self._like.between.shape, self._like.carried.shape
        found = WornDepths(punch, strip, between.reshape(shapes[0]), crept, carried.reshape(shapes[1]))
        return self.problem.interface.layers.bounded(self.problem.coatings.depths(found))

    def rate(self, cycle: FrettingCycle) -> Array:
        """Return the rate of a cycle (size,).

        Raises:
            ConvergenceError: it is beyond all numbers.
        """
        found = np.concatenate(_parts(self.problem.coatings.measured_rate(cycle.rate, cycle.bases, cycle.worn)))
        if not np.isfinite(found).all():
            raise ConvergenceError(TOO_LARGE)
        return found

    def measured(self, rate: WornDepths, worn: WornDepths) -> Array:
        """Return the rate of depths (size,) at depths."""
        found, slopes = np.concatenate(_parts(rate)), np.concatenate(self.problem.coatings.slopes(worn))
        own = found[: self.depths]
        own[:] = np.divide(own, slopes, out=np.zeros_like(own), where=slopes > 0)
        return found


def _parts(worn: WornDepths) -> list[Array]:
    return [worn.punch, worn.strip, worn.between.ravel(), worn.carried.ravel(), worn.crept]


@dataclass(frozen=True)
class _Moment:
    """The end of a stage (size,), the contact there, and where the stage began and how many cycles it was long."""

    y: Array
    contact: ContactState
    begin: Array
    length: float = 0.0


class _Steps:
    """Steps of a jump from a cycle."""

    def __init__(self, packing: _Packing, cycle: FrettingCycle) -> None:
        self.packing, self._frozen, y = packing, Frozen(packing.problem, cycle), packing.of(cycle.worn)
        self.begin = _Moment(y, self._frozen.contact, y)

    def beside(self, cycle: FrettingCycle, at: _Moment) -> Array:
        """Return R (size,) of a cycle at the end of a stage."""
        rate = self._frozen.rate(at.contact, cycle.worn)
        return self.packing.rate(cycle) - self.packing.measured(rate, cycle.worn)

    def stage(self, begin: Array, cycles: float, near: ContactState) -> _Moment:
        """Return y = begin + cycles M(y)."""
        worn, contact = self._frozen.stage(self.packing.on_the_way(begin), cycles, near)
        return _Moment(self.packing.of(worn), contact, begin, cycles)

    def step(self, before: _Moment, cycles: float, beside: Callable[[float], Array], last: float = 0.0) -> _Moment:
        """Return what y' = M(y) + beside(n) leads to.

        Args:
            before: Where it begins.
            cycles: How many later.
            beside: R after so many of them.
            last: Cycles of the last step, of the implicit Euler method; 0 for none.
        """
        own = cycles - last
        h = SHARE * own
        first = self.stage(before.y + h * beside(h), h, before.contact)
        rate = (first.y - first.begin) / h + beside(h)
        found = self.stage(before.y + (own - h) * rate + h * beside(own), h, first.contact)
        if last:
            found = self.stage(found.y + last * beside(cycles), last, found.contact)
        return self.risen(found)

    def risen(self, end: _Moment, more: Array | float = 0.0) -> _Moment:
        """Return the end with so much more (size,), without depths below those at the begin of the jump."""
        y, depths = end.y + more, self.packing.depths
        y[:depths] = np.maximum(y[:depths], self.begin.y[:depths])
        return replace(end, y=y)


def _attempt(
    problem: PartialSlipProblem,
    now: FrettingCycle,
    cycles: float,
    load: Callable[[float], float],
    begin_of_heat: FrettingCycle,
) -> tuple[FrettingCycle, Estimate]:
    """Return the cycle after a jump, and its error; temperatures go on from those of the last whole cycle."""
    problem = problem.worn_like(now.records, now.first_step)
    packing = _Packing(problem, now.worn)
    steps = _Steps(packing, now)
    begin = steps.beside(now, steps.begin)

    def cycle_at(end: _Moment, done: float, after: PartialSlipState) -> FrettingCycle:
        start = _slid_on(now, done, load)
        worn = _balanced(problem, now.worn, packing.parted(end.y))
        at = replace(after, slid=start.slid, load=start.load)
        return _cycle_after(problem, begin_of_heat, at, worn, now.number + done)

    half = steps.step(steps.begin, cycles / 2, lambda _: begin)
    middle = cycle_at(half, cycles / 2, now.end)
    bend = (steps.beside(middle, half) - begin) / (cycles / 2)
    whole = steps.step(steps.begin, cycles, lambda n: begin + n * bend)
    half = steps.risen(half, cycles**2 / 8 * bend)
    last = LAST * cycles if _comes(steps.begin, half, whole) else 0.0
    end = steps.step(half, cycles / 2, lambda n: begin + (cycles / 2 + n) * bend, last)
    then = cycle_at(end, cycles, middle.end)
    curved = steps.beside(then, end) - begin - cycles * bend
    by_simpson = end.y - steps.stage(end.begin + cycles / 6 * curved, end.length, end.contact).y
    estimate = _estimate(packing, (steps.begin, whole, end), by_simpson, max(middle.error, then.error))
    finer = None
    if now.finer is not None:
        off = replace(steps.begin, y=packing.of(now.finer))
        moved = steps.step(off, cycles, lambda n: begin + n * bend).y - whole.y
        finer = packing.parted(end.y - HALVES * (whole.y - end.y) - by_simpson + moved)
    return replace(then, finer=finer), estimate


def _estimate(
    packing: _Packing, found: tuple[_Moment, _Moment, _Moment], by_simpson: Array, of_heat: float
) -> Estimate:
    """Return the error of a jump.

    Args:
        packing: Of its arrays.
        found: Its begin, and its end as a whole and in halves.
        by_simpson: What R leaves of it (size,).
        of_heat: That of temperatures.
    """
    interface, (begin, whole, end) = packing.problem.interface, (packing.parted(one.y) for one in found)
    pair, contacts = interface.middle.pair, [one.contact.pressure for one in found]
    sizes = Sizes(interface.layers, pair, partial(opened_by_creep, interface.middle, interface.creep))
    parts = (whole - end).times(HALVES), packing.on_the_way(found[2].y) - packing.on_the_way(found[2].y - by_simpson)
    pressure = max(force_difference(pair, one, other) for one, other in zip(*contacts[1:], strict=True))
    return Estimate(
        sum(sizes.of_depth(part, end - begin, end, REST) for part in parts),
        HALVES * pressure,
        of_heat,
        sum(sizes.of_states(part, begin, end) for part in parts),
    )


def _comes(begin: _Moment, half: _Moment, whole: _Moment) -> bool:
    """Return whether a node comes into contact from the begin of a jump or its middle to its end."""
    before = np.minimum(begin.contact.pressure, half.contact.pressure)
    return bool(((whole.contact.pressure > 0) & (before <= 0)).any())


def _balanced(problem: PartialSlipProblem, before: WornDepths, after: WornDepths) -> WornDepths:
    """Return depths whose ejected debris is what was worn and does not lie there, to rounding.

    Else it would not be where depths are kept from falling, or coatings end. What is ejected opens nothing: what is
    missing of it is spread evenly.
    """
    layers, pair = problem.interface.layers, problem.interface.middle.pair
    if not layers.debris.present:
        return after
    change = after - before
    worn = pair.weights @ change.punch + pair.strip.weights @ change.strip
    if layers.strip_carries:
        weights, changed, state = pair.strip.weights, change.carried, after.carried.copy()
    else:
        weights, changed, state = pair.weights, change.between, after.between.copy()
    state[1] += (worn - float(weights @ changed[:2].sum(axis=0))) / weights.sum()
    return layers.with_debris(after, state)


def _slid_on(now: FrettingCycle, cycles: float, load: Callable[[float], float]) -> PartialSlipState:
    """Return the end of a cycle under the load of so many later, as far as what its nodes have slipped tells."""
    slid, end = now.end.slid, replace(now.end, load=load(now.number + cycles))
    if slid is None:
        return end
    return replace(end, slid=slid + (cycles - 1) * now.records.slip_magnitude.sum(axis=0))
