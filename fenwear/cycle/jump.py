"""Cycle jumps: N cycles in one implicit step, N chosen by an error estimate.

A cycle takes the state y, the worn depths and the temperatures, to y + F(y). Let y(n) be smooth and meet
the states of a march at whole numbers n of cycles: y(n + 1/2) changes by F(y(n)), so that to second order

    dy/dn = f(y) = F(y - f(y) / 2):

the cycle with the middle y begins half a cycle's change before it. One jump is a step of the two-stage,
second-order, L-stable and stiffly accurate Runge-Kutta method (SDIRK; Alexander, SIAM J. Numer. Anal.
14, 1977) with g = 1 - 1/sqrt(2):

    y_1 = y + g N f(y_1),    y_2 = y + (1 - g) N f(y_1) + g N f(y_2).

Its weights 1 - g and g are positive, so that no depth decreases, and its end y_2 is itself a solved
contact. A stage solves contact, wear and heat together: all phases of a cycle stand in one inequality
with the wear of h = g N cycles at their own pressures,

    gap_k = S_k p_k + H a_k + g_k + w_n + h beta~ (sum of S_j p_j^b) >= 0,   p_k >= 0,   p_k gap_k = 0,

and, with heat, the thermal gap at the end of each phase, which is linear in the same pressures. Its
cycle begins at h - 1/2 cycles. Friction, wear and conductance are those of the stage itself: the
pressure of each phase, and the temperature at its start. All phases meet the shape in the middle of the
cycle, where those of a march come one after the other: they differ by the wear of half a cycle, as an
explicit march does from an implicit one.

A jump is made whole and in two halves. A third of their difference is the error estimate of the halves,
which are kept: of the depths, of the pressures and of the temperatures.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from fenwear.arrays import Array
from fenwear.assembly import Tribosystem, property_change, with_reduced_heat
from fenwear.contact import CondensedContact, ContactState
from fenwear.cycle.block import Block, HalfCycleHeat, PhaseRecord
from fenwear.cycle.coupled import Coupled, Passing
from fenwear.cycle.driver import BLOCK, Course, HalfCycle, Loading, Watch, as_given, drive, unwatched
from fenwear.cycle.state import RunState, beginning, joined, parted
from fenwear.cycle.totals import PhaseMeter, Totals
from fenwear.errors import CaseError, ConvergenceError, InputError
from fenwear.remedies import SHORTER_JUMPS, SMALLER_STEPS
from fenwear.sliding.friction import ContactConditions
from fenwear.sliding.wear import Worn, WornLayer

GAMMA = 1 - np.sqrt(0.5)
ORDER = 2
WARMED = 2.0  # times heat.property_tolerance that properties may change by in a jump of several cycles
PARTS = 8  # of a cycle that does not converge as a whole
SAFETY, LEAST, MOST = 0.9, 0.2, 5.0  # of the next jump's length over the last one's


def jump(
    system: Tribosystem,
    half_cycles: int,
    *,
    tolerance: float,
    periodic_within: float | None = None,
    block: int = BLOCK,
    start: RunState | None = None,
    stops: frozenset[int] = frozenset(),
    leave: Callable[[RunState], bool] = lambda _: False,
    watch: Watch = unwatched,
    loading: Loading = as_given,
) -> Iterator[Block]:
    """Yield the last cycle of every jump, in blocks; collective.

    Args:
        system: The assembled problem.
        half_cycles: Where to end, a whole number of cycles.
        tolerance: Largest estimated error of one jump, see `Estimate`.
        periodic_within, block, leave, watch: As of `fenwear.cycle.driver.Course`; the change per cycle counts.
        start: Where to go on from, such as the end of a block; by default the beginning.
        stops: Half-cycles at which a jump and a block end in any case, or the cycle they are in.
        loading: Factor of all loads, continuous: a stage takes that of its own time, so that the error estimate
            sees how it changes.

    Raises:
        CaseError: `start` lies within a cycle.
        ConvergenceError: the shortest jump did not converge; what came before it is yielded.
        InterruptedRunError: as `watch`.
    """
    strokes = system.motion.half_cycles
    if start is not None and start.half_cycle % strokes:
        message = f"jumps go on from a whole cycle only, got half-cycle {start.half_cycle}"
        raise CaseError(InputError("run.integration", message))
    stepper = _Stepper(system, watch, loading)
    whole = frozenset(-(-stop // strokes) * strokes for stop in stops)
    course = Course(half_cycles // strokes * strokes, periodic_within, block, whole, leave, watch)
    yield from drive(system, _Jumps(stepper, tolerance), start or stepper.beginning(), course)


@dataclass(frozen=True)
class Estimate:
    """Estimated error of a jump.

    Attributes:
        depth: Of the worn depths over what the jump wears, both integrated over the surfaces; so the errors of
            all jumps add up to at most the largest of them times the depth.
        pressure: How far the contact force lies from where it should, over the width in contact, in the worst phase.
        temperature: Of the contact surfaces over their rise from the initial one, root mean squares.
    """

    depth: float
    pressure: float
    temperature: float

    @property
    def largest(self) -> float:
        """The largest of the three."""
        return max(self.depth, self.pressure, self.temperature)


class _Jumps:
    """Steps of as many cycles as the tolerance allows, and the materials whose properties change with the warmth."""

    def __init__(self, stepper: _Stepper, tolerance: float) -> None:
        self.stepper, self.tolerance = stepper, tolerance

    def __call__(self, state: RunState, until: int, /) -> tuple[RunState, list[HalfCycle]]:
        """Return the state after the next jump that is accurate enough, and its last cycle."""
        stepper, tolerance = self.stepper, self.tolerance
        strokes = stepper.system.motion.half_cycles
        length, left = state.jump_length, (until - state.half_cycle) // strokes
        while True:
            tried = min(length, left)
            try:
                end, estimate = stepper.attempt(state, tried)
            except ConvergenceError:
                if tried == 1:
                    raise
                stepper.system.remedies.note(SHORTER_JUMPS)
                length = max(1, tried // 4)
                continue
            factor = SAFETY * (tolerance / max(estimate.largest, 1e-300)) ** (1 / (ORDER + 1))
            warmed = tried > 1 and property_change(stepper.system, end.temperature) > WARMED
            if (estimate.largest <= tolerance and not warmed) or tried == 1:
                break
            # A half is half made already.
            length = max(1, int(tried * min(0.5, max(LEAST, factor))))
        if tried == length or factor < 1:  # a step cut short by an end says little of the next length
            length = max(1, int(tried * min(MOST, max(LEAST, factor))))
            if factor > 1 and tried < 4:
                length = max(length, tried + 1)
        number = state.half_cycle + tried * strokes
        after = RunState(number, end.worn, end.contacts, end.temperature, end.totals, length)
        return after, stepper.last_cycle(state, after, tried)


@dataclass(frozen=True)
class _Stage:
    """A solved stage: contact of all phases, and what its cycle changes of temperature (dim,), depths and totals."""

    contact: ContactState
    heated: Array
    worn: Worn
    adds: Totals


class _Stepper:
    """Implicit steps of any number of cycles."""

    def __init__(self, system: Tribosystem, watch: Watch = unwatched, loading: Loading = as_given) -> None:
        self.system, self.watch, self.loading = system, watch, loading
        self.contact = system.phase_contact(range(len(system.motion.phases)))
        self.ratios = system.friction_ratios()
        self.wear = system.phases_wear
        self._measure([system.friction.values(system.conditions(k)) for k in range(len(self.ratios))])
        self.coupled = Coupled(system, self.take)
        self._heated: Array = np.zeros(0)  # by the last cycle
        self._done = 0.0  # half-cycles at the end of the stage
        self._half: tuple[RunState, float, RunState] | None = None  # the first half of the last attempt

    def beginning(self) -> RunState:
        """Return the unworn bodies at their initial temperature."""
        return beginning(self.system, None if self.coupled.heat is None else self.coupled.heat.exchange.initial())

    def attempt(self, state: RunState, cycles: int) -> tuple[RunState, Estimate]:
        """Return the state `cycles` cycles later, by two steps, and an estimate of its error.

        Raises:
            ConvergenceError: it did not converge; a single cycle not in smaller steps either.
        """
        try:
            known, self._half = self._half, None
            whole = known[2] if known and known[0] is state and known[1] == cycles else self.step(state, cycles)
            half = self.step(state, cycles / 2)
            self._half = (state, cycles / 2, half)
            halves = self.step(half, cycles / 2, cycles / 2)
            estimate = _estimate(self.system, state, whole, halves)
            if self.system.passing_laws:
                missed = self._missed(state, half, halves, cycles)
                estimate = replace(estimate, depth=max(estimate.depth, missed))
            return halves, estimate
        except ConvergenceError as error:
            if cycles > 1:
                raise
            try:
                parts = self.steps(state, cycles, PARTS)
            except ConvergenceError:
                raise error from None
            self.system.remedies.note(SMALLER_STEPS.format(PARTS))
            return parts, Estimate(np.inf, np.inf, np.inf)

    def _missed(self, state: RunState, half: RunState, halves: RunState, cycles: float) -> float:
        """Return the error of what a jump wears where coefficients change with depth or distance, relative.

        Its stages do not look at its begin: a coating that is worn through before the first of them would be missed.
        Simpson's rule on the wear of a cycle at the begin, in the middle and at the end does, and is of higher order.
        """
        if any(contact is None for contact in state.contacts):
            return 0.0
        strokes = self.system.motion.half_cycles
        begin, middle, end = (
            self._rate(one, state.half_cycle + share * cycles * strokes)
            for one, share in ((state, 0.0), (half, 0.5), (halves, 1.0))
        )
        simpson = (begin + middle.times(4.0) + end).times(cycles / 6)
        worn = halves.worn - state.worn
        wrong, all_worn = (_area(self.system, one) for one in (simpson - worn, worn))
        return wrong / max(all_worn, 1e-300)

    def _rate(self, state: RunState, half_cycles: float) -> Worn:
        """Return what a cycle wears at the depths, temperatures and pressures of a state."""
        system, surfaces = self.system, None
        pressures = np.concatenate([_present(contact).pressure for contact in state.contacts])
        if self.coupled.heat is not None and state.temperature is not None:
            surfaces = self.coupled.heat.exchange.contact_temperatures(state.temperature)
        conditions = [
            system.conditions(k, pressure, surfaces, state.worn, half_cycles) for k, pressure in enumerate(pressures)
        ]
        return system.wear.phases(conditions).worn(pressures)

    def steps(self, state: RunState, cycles: float, count: int) -> RunState:
        """Return the state `cycles` cycles later, by that many equal steps."""
        for number in range(count):
            state = self.step(state, cycles / count, number * cycles / count)
        return state

    def step(self, state: RunState, cycles: float, since: float = 0.0) -> RunState:
        """Return the state `cycles` cycles later, by the two stages of one step.

        Args:
            state: Where it begins; its number of half-cycles is that of the jump's begin.
            cycles: Its length.
            since: Cycles from there to the begin of the step.
        """
        share = GAMMA * cycles
        rest = cycles - share
        heat, temperature = self.coupled.heat, None
        if heat is not None and state.temperature is not None:
            temperature = heat.exchange.own(state.temperature).values
        self._press(state.half_cycle, since + share)
        first = self._stage(state.worn, temperature, joined(state.contacts), share)
        between = None if temperature is None else temperature + rest * first.heated
        worn, totals = state.worn + first.worn.times(rest), state.totals + first.adds.times(rest)
        self._press(state.half_cycle, since + cycles)
        second = self._stage(worn, between, first.contact, share)
        end = None
        if heat is not None and between is not None:
            end = heat.exchange.at(between + share * second.heated)
            self._heated = second.heated
        worn, totals = worn + second.worn.times(share), totals + second.adds.times(share)
        return RunState(state.half_cycle, worn, parted(second.contact), end, totals)

    def _passing(self, worn: Worn, cycles: float) -> Passing | None:
        """Return how depths follow in a stage where coefficients depend on them."""
        if not self.system.passing_laws:
            return None
        return Passing(worn, cycles, self._wear, self._done)

    def _wear(self, pressure: Array) -> Worn:
        return self.wear.worn(pressure)  # as last taken

    def _press(self, half_cycle: int, cycles: float) -> None:
        """Take the time and the loads so many cycles after a half-cycle."""
        self._done = half_cycle + cycles * self.system.motion.half_cycles
        if self.loading is not as_given and isinstance(self.contact, CondensedContact):
            self.contact.press(self.loading(self._done))

    def _stage(self, worn: Worn, temperature: Array | None, start: ContactState | None, cycles: float) -> _Stage:
        """Return the cycle whose middle is y = y_0 + `cycles` f, from the depths and temperatures of y_0."""
        gap = np.array([self.system.gap(phase, worn) for phase in range(len(self.ratios))])
        if start is None:  # the first of all: what conducts is seen from the contact without heat
            start = self._solve(gap, None, cycles)
        contact, begin = self.coupled.solve(
            temperature,
            cycles - 0.5,
            start,
            lambda thermal, coupling, near: self._solve(
                gap if thermal is None else gap + thermal, near, cycles, coupling
            ),
            self._passing(worn, cycles),
            lagged=True,
        )
        heated: Array = np.zeros(0)
        if begin is not None:
            heated = self.coupled.through(begin, contact.pressure)[-1] - begin
        adds = reduce(Totals.__add__, self._adds(contact.pressure))
        return _Stage(contact, heated, self.wear.worn(contact.pressure), adds)

    def _solve(
        self, gap: Array, start: ContactState | None, cycles: float, coupling: Array | None = None
    ) -> ContactState:
        self.watch()
        return self.contact.solve(gap, start, WornLayer(self.wear, cycles), coupling)

    def take(self, conditions: Sequence[ContactConditions]) -> None:
        """Take friction and wear at the conditions of the phases."""
        system = self.system
        self.wear = system.wear.phases(conditions)
        self._measure([system.friction.values(state) for state in conditions])
        if system.friction.constant:
            return
        self.ratios = system.friction_ratios(conditions)
        if isinstance(self.contact, CondensedContact):
            self.contact.slide(self.ratios)

    def _measure(self, friction: Sequence[Array]) -> None:
        self.meters = [PhaseMeter(self.system, k, mu, self.wear.some([k])) for k, mu in enumerate(friction)]

    def _adds(self, pressure: Array) -> list[Totals]:
        """Return what each phase of a cycle adds at its pressure (m, n)."""
        return [meter(pressure[k, :]) for k, meter in enumerate(self.meters)]

    def last_cycle(self, before: RunState, after: RunState, cycles: int) -> list[HalfCycle]:
        """Return the half-cycles of the last cycle of a jump."""
        motion, found = self.system.motion, []
        contacts = [_present(contact) for contact in after.contacts]
        heats = self._last_cycle_heat(after)
        # Half-cycles after one have worn what is missing at its end.
        depths, totals = [after.worn], [after.totals]
        adds = self._adds(np.concatenate([contact.pressure for contact in contacts]))
        phases = list(range(len(contacts)))
        for stroke in reversed(range(1, motion.half_cycles)):
            own = phases[stroke * motion.positions : (stroke + 1) * motion.positions]
            depths.insert(0, depths[0] - self._worn(own, contacts))
            totals.insert(0, reduce(Totals.__sub__, [adds[k] for k in own], totals[0]))
        for stroke, depth in enumerate(depths):
            own = phases[stroke * motion.positions : (stroke + 1) * motion.positions]
            records = [self._phase_record(k, contacts[k], before.contacts[k], cycles, adds[k]) for k in own]
            number = after.half_cycle - (motion.half_cycles - 1 - stroke)
            own_heats = [heat for heat in (heats[k] for k in own) if heat is not None]
            heat = reduce(HalfCycleHeat.then, own_heats) if own_heats else None
            load = self.loading(after.half_cycle)
            found.append(HalfCycle(number, records, depth, totals[stroke], heat, load))
        return found

    def _worn(self, phases: Sequence[int], contacts: Sequence[ContactState]) -> Worn:
        pressures = np.concatenate([contacts[k].pressure for k in phases])
        return self.wear.some(phases).worn(pressures)

    def _phase_record(
        self, phase: int, contact: ContactState, old: ContactState | None, cycles: int, adds: Totals
    ) -> PhaseRecord:
        previous = None
        if old is not None:
            previous = contact.pressure[0] - (contact.pressure[0] - old.pressure[0]) / cycles
        return PhaseRecord(phase, contact, previous, adds, self.ratios[phase])

    def _last_cycle_heat(self, state: RunState) -> list[HalfCycleHeat | None]:
        """Return the heat of the cycle that ends with the state."""
        if self.coupled.heat is None or state.temperature is None:
            return [None] * len(state.contacts)
        heats: list[HalfCycleHeat | None] = []
        exchange = self.coupled.heat.exchange
        temperature = exchange.at(exchange.own(state.temperature).values - self._heated)
        for phase, contact in enumerate(state.contacts):
            pressure = _present(contact).pressure[0]
            conductance = exchange.conductance(pressure)
            temperature, terms = exchange.half_cycle(temperature, phase, self.coupled.mu[phase] * pressure, conductance)
            bulk = np.nan if temperature.bulk is None else temperature.bulk
            heats.append(HalfCycleHeat(*exchange.contact_temperatures(temperature), terms, 1, bulk))
        return heats


def _estimate(system: Tribosystem, before: RunState, whole: RunState, halves: RunState) -> Estimate:
    """Return the error of two half steps from their difference to the whole one, by Richardson."""
    apart, step = whole.worn - halves.worn, halves.worn - before.worn
    wrong, worn = _area(system, apart), _area(system, step)
    pressure = max(
        _force_difference(system, _present(one).pressure[0], _present(other).pressure[0])
        for one, other in zip(whole.contacts, halves.contacts, strict=True)
    )
    share = 1 / (2**ORDER - 1)
    return Estimate(
        share * wrong / max(worn, 1e-300), share * pressure, share * _heat_difference(system, whole, halves)
    )


def _area(system: Tribosystem, worn: Worn) -> float:
    """Return the integral of the size of depths over both surfaces."""
    pair = system.pair
    return float(pair.weights @ np.abs(worn.punch) + pair.strip.weights @ np.abs(worn.strip))


def _force_difference(system: Tribosystem, first: Array, second: Array) -> float:
    """Return how far the force of one pressure (n,) lies from that of another, over the extent of the contact.

    The Wasserstein distance of the two distributions, and the difference of their forces. Not a norm of the pressures'
    difference: a node at the edge closes as soon as the shape changes by what a node gives way, and a norm would be
    that of this node alone.
    """
    x, weights = system.pair.punch.x, system.pair.weights
    forces = [weights * first, weights * second]
    one, other = (float(force.sum()) for force in forces)
    if min(one, other) <= 0:
        return float(max(one, other) > 0)
    touched = x[(first > 0) | (second > 0)]
    width = max(float(np.ptp(touched, axis=0).max()), float(weights.min()))
    apart = forces[0] / one - forces[1] / other
    moved = 0.0
    for along in x.T:  # each axis; scipy's function for it would take half a second of imports
        order = along.argsort()
        moved = max(moved, float(np.abs(apart[order].cumsum())[:-1] @ np.diff(along[order])))
    return moved / width + abs(one - other) / max(one, other)


def _heat_difference(system: Tribosystem, one: RunState, other: RunState) -> float:
    """Return the difference of the contact temperatures over their rise; 0 without heat."""
    exchange = with_reduced_heat(system).exchange
    if exchange is None or one.temperature is None or other.temperature is None:
        return 0.0
    first, second, initial = (
        np.array(exchange.contact_temperatures(t)) for t in (one.temperature, other.temperature, exchange.initial())
    )
    weights = system.pair.weights
    apart, rise = (float(np.sqrt((t**2 @ weights).sum())) for t in (first - second, second - initial))
    return apart / max(rise, 1e-300)


def _present(contact: ContactState | None) -> ContactState:
    """Return the contact of a phase that a step has solved."""
    if contact is None:
        raise ConvergenceError("a phase of the motion has no contact yet")
    return contact
