"""The implicit step of cycle jumps.

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

A node that comes into contact within a step has f(y_1) = 0: all that it must lose to follow its neighbours
it loses by g N f(y_2), and at the end it carries up to 1 / g = 3.4 times their pressure. So a jump in which
nodes come into contact ends by one step of the implicit Euler method over a share of it, `LAST`:
y_3 = y_2 + h f(y_3). In it such a node loses what its neighbours lose.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial, reduce

import numpy as np

from fenwear.arrays import Array
from fenwear.assembly import CreepStage, Tribosystem, with_reduced_heat
from fenwear.contact import CondensedContact, ContactState
from fenwear.cycle.block import HalfCycle, HalfCycleHeat, PhaseRecord, heat_of_phases
from fenwear.cycle.coupled import Coupled, DepthEvolution, check_cycle_memory
from fenwear.cycle.driver import Loading, Watch, as_given, unwatched
from fenwear.cycle.jump_error import ORDER, Estimate, estimated, sizes_of
from fenwear.cycle.state import RunState, joined, parted, present
from fenwear.cycle.totals import PhaseMeter, Totals, with_coated
from fenwear.errors import ConvergenceError
from fenwear.heat.field import HeatState
from fenwear.layers import Evolution
from fenwear.sliding.friction import ContactConditions
from fenwear.sliding.wear import NOTHING, PhasesWear, WornDepths

GAMMA = 1 - np.sqrt(0.5)
LAST = 1 / 8  # of a jump in which nodes come into contact, that its last step covers
ROUGH, FINE = 0.1, 0.01  # of the tolerance, to which the stages of a jump are solved, and its end
LOOSEST = 5e-3  # tolerance that these are of: contact of a rough run, too, is told to fulfil its conditions


@dataclass(frozen=True)
class _Stage:
    """A solved stage: contact of all phases, and what its cycle changes of temperature (dim,), depths and totals.

    Its conductances (m, n) are those by which it is heated. What is worn through coatings depends on where a step
    begins and how long it is: `wear` is that of its phases.
    """

    contact: ContactState
    heated: Array
    worn: WornDepths
    adds: Totals
    conductances: Array
    wear: PhasesWear


@dataclass(frozen=True)
class _Moment:
    """Depths, temperatures (dim,) and totals."""

    worn: WornDepths
    temperature: Array
    totals: Totals


class _Trend:
    """How contacts change over a jump, by what is solved of it so far: where the next ones are looked for.

    Lines through two of them, as those near borders that move come and go: parabolas begin farther away.
    """

    def __init__(self) -> None:
        self._contacts: dict[float, ContactState] = {}  # by their time, cycles since the begin of the jump

    def copy(self) -> _Trend:
        """Return one that goes its own way from here."""
        found = _Trend()
        found._contacts = dict(self._contacts)
        return found

    def add(self, time: float, contact: ContactState | None) -> None:
        """Take a contact at a time, cycles since the begin of the jump, if none is known there."""
        if contact is not None:
            self._contacts.setdefault(time, contact)

    def from_one(self, contact: ContactState | None, since: float, to: float) -> ContactState | None:
        """Return what a contact at one time will be near at another one; where it is not known, what is known there."""
        if contact is None:
            contact, since = self._near(to)
        if contact is None or len(self._contacts) < 2:
            return contact
        pressure, rigid = contact.pressure.copy(), contact.rigid.copy()
        for time, sign in ((to, 1.0), (since, -1.0)):
            for share, known in self._line(time):
                pressure += sign * share * known.pressure
                rigid += sign * share * known.rigid
        return replace(contact, pressure=np.maximum(pressure, 0.0), rigid=rigid)

    def _near(self, time: float) -> tuple[ContactState | None, float]:
        """Return the contact that is known next to a time, and when it is; None of none."""
        known = min(self._contacts, key=lambda known: abs(known - time), default=time)
        return self._contacts.get(known), known

    def _line(self, time: float) -> list[tuple[float, ContactState]]:
        """Return the shares at a time of the two contacts next to it, and them; of one alone that is of that time."""
        if time in self._contacts:
            return [(1.0, self._contacts[time])]
        one, other = sorted(self._contacts, key=lambda known: abs(known - time))[:2]
        share = (time - one) / (other - one)
        return [(1 - share, self._contacts[one]), (share, self._contacts[other])]


class Stepper:
    """Implicit steps of any number of cycles."""

    def __init__(
        self, system: Tribosystem, tolerance: float, watch: Watch = unwatched, loading: Loading = as_given
    ) -> None:
        self.system = system = with_reduced_heat(system)
        check_cycle_memory(system)
        self.tolerance, self.watch, self.loading = tolerance, watch, loading
        self._sizes = sizes_of(system)
        self.contact = system.phase_contact(range(len(system.motion.phases)))
        self.ratios = system.friction_ratios()
        self.wear = system.phases_wear
        self.conditions: Sequence[ContactConditions] = [system.conditions(k) for k in range(len(self.ratios))]
        self.evolution = system.evolution(self.conditions)
        self._measure([system.friction.values(one) for one in self.conditions])
        self.coupled = Coupled(system, self.take)
        self._heated: Array = np.zeros(0)  # by the last cycle
        self._flowed: Array | None = None  # beyond the hardness, in the stage solved last
        self._conductances: Array | None = None  # in it
        self._done, self._load = 0.0, 1.0  # half-cycles at the end of the stage, and the factor of all loads there
        self._whole: tuple[RunState, _Trend, WornDepths | None] | None = (
            None  # the last attempt as one step: see `finer`
        )
        follows = bool(system.passing_laws) or system.layers.varies or system.asks("debris")
        follows = follows or bool(system.layers.memory.names)
        self._follows = follows or system.friction.of_coatings != (None, None)  # coefficients do, within a step
        by_friction = any(law.beta or law.energy for law in system.sliding.wear)
        self._wear_follows = follows or (self._follows and by_friction)

    def attempt(self, state: RunState, cycles: int) -> tuple[RunState, Estimate, list[HalfCycle]]:
        """Return the state `cycles` cycles later, by two steps, an estimate of its error, and the last cycle.

        Raises:
            ConvergenceError: it did not converge.
        """
        self._whole, trend = None, _Trend()
        half = self.step(state, cycles / 2, near=trend)
        early = _comes(state, half, half)  # then begun near the halves, whose steps are not as long
        whole = half if early else self.step(state, cycles, near=trend.copy())
        comes = _comes(state, half, whole)
        last = LAST * cycles if comes else 0.0
        halves = self.step(half, cycles / 2 - last, cycles / 2, trend, ROUGH if comes else FINE)
        if comes:
            halves = self._last_step(halves, last, cycles - last, trend)
        recorded = self._last_cycle(state, halves, cycles)  # by the coefficients and the heat of their end
        if early:
            whole = self.step(state, cycles, near=trend.copy())
        estimate, bent = estimated(self.system, state, whole, halves), None
        if comes:
            first, second = half.worn - state.worn, whole.worn - half.worn
            # The last step is of first order: h^2 y'' / 2 by 4 (d_2 - d_1) / N^2.
            bent = (second - first).times(2 * LAST**2)
            share = self._sizes.area(bent) / max(self._sizes.area(first + second), 1e-300)
            estimate = replace(estimate, depth=max(estimate.depth, share))
        self._whole = whole, trend, bent
        if self._wear_follows:
            missed = self._missed(state, half, halves, cycles)
            estimate = replace(estimate, depth=max(estimate.depth, missed))
        return halves, estimate, recorded

    def finer(self, state: RunState, fine: RunState, end: RunState, cycles: int) -> RunState:
        """Return where jumps of next to no length lead, from where they had led before the last attempt.

        From the begin y to y_h in halves and to y_w as a whole y_h is off by a third of y_w - y_h; what was off before,
        y - f, goes on as a whole step takes it, to y_w - f_w. So they lead to f_w + 4/3 (y_h - y_w). Where nodes have
        come into contact y_h has the error of its last step, of first order, too, which is taken from it.

        Args:
            state: Before the attempt.
            fine: Where they had led.
            end: The attempt's.
            cycles: Its length.
        """
        if self._whole is None:  # in smaller steps than there is an estimate of
            return self._apart(end, fine, state, 1.0)
        whole, trend, bent = self._whole
        moved = whole
        if fine is not state:
            try:
                moved = self.step(replace(fine, half_cycle=state.half_cycle), cycles, near=trend.copy())
            except ConvergenceError:  # it may lie where no contact is: then what was off stays
                moved = self._apart(whole, fine, state, 1.0)
        halves = end if bent is None else replace(end, worn=end.worn - bent)
        return replace(self._apart(moved, halves, whole, 2**ORDER / (2**ORDER - 1)), half_cycle=end.half_cycle)

    def _apart(self, state: RunState, one: RunState, other: RunState, share: float) -> RunState:
        """Return a state, and a share of the difference of two others."""
        exchange = self.coupled.heat.exchange
        base, first, second = (exchange.own(own.temperature).values for own in (state, one, other))
        return RunState(
            state.half_cycle,
            self.system.layers.settled(state.worn + (one.worn - other.worn).times(share)),
            tuple(
                _between(own, first, second, share)
                for own, first, second in zip(state.contacts, one.contacts, other.contacts, strict=True)
            ),
            self._temperature(base + share * (first - second)),
            state.totals + (one.totals - other.totals).times(share),
        )

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
        worn = replace(halves.worn - state.worn, between=NOTHING, carried=NOTHING)
        return self._sizes.area(simpson - worn) / max(self._sizes.area(worn), 1e-300)

    def _rate(self, state: RunState, half_cycles: float) -> WornDepths:
        """Return what a cycle wears at the depths, temperatures and pressures of a state."""
        system, exchange = self.system, self.coupled.heat.exchange
        pressures = np.concatenate([present(contact).pressure for contact in state.contacts])
        shear = system.ways.shear(pressures)
        surfaces = exchange.contact_temperatures(exchange.own(state.temperature))
        conditions: Sequence[ContactConditions] = [
            system.conditions(k, pressure, surfaces, state.worn, half_cycles, shear)
            for k, pressure in enumerate(pressures)
        ]
        evolution = system.evolution(conditions, state.worn)
        conditions = evolution.around(system.layers.held(state.worn))
        return system.wear.phases(conditions).begun(state.worn).worn(pressures)

    def _solve_to(self, share: float) -> None:
        """Solve contact to a share of the tolerance, where its digits cost; fully beyond a hardness, as flow stays."""
        if isinstance(self.contact, CondensedContact) and self.system.layers.hardness == np.inf:
            self.contact.inequality.close = share * min(self.tolerance, LOOSEST)

    def step(
        self, state: RunState, cycles: float, since: float = 0.0, near: _Trend | None = None, digits: float = ROUGH
    ) -> RunState:
        """Return the state `cycles` cycles later, by the two stages of one step.

        Args:
            state: Where it begins; its number of half-cycles is that of the jump's begin.
            cycles: Its length.
            since: Cycles from there to the begin of the step.
            near: How contacts change, which takes those of the step, too; by default it begins with the step.
            digits: Share of the tolerance that its last contact is solved to, where they cost.
        """
        share, near = GAMMA * cycles, near or _Trend()
        self._solve_to(ROUGH)  # of a first stage its wear is all that stays
        begin, contact = self._moment(state), joined(state.contacts)
        near.add(since, contact)
        self._press(state.half_cycle, since + share)
        first = self._stage(begin, near.from_one(contact, since, since + share), share, cycles - share)
        near.add(since + share, first.contact)
        between = self._after(begin, first, cycles - share)
        self._press(state.half_cycle, since + cycles)
        start = near.from_one(first.contact, since + share, since + cycles)
        self._solve_to(digits)
        last = self._stage(between, start, share)
        near.add(since + cycles, last.contact)
        return self._end(state, between, last, share)

    def _last_step(self, state: RunState, cycles: float, since: float, near: _Trend) -> RunState:
        """Return the state `cycles` cycles later, by one implicit Euler step; as `step`."""
        begin, contact = self._moment(state), joined(state.contacts)
        self._solve_to(FINE)
        self._press(state.half_cycle, since + cycles)
        last = self._stage(begin, near.from_one(contact, since, since + cycles), cycles)
        near.add(since + cycles, last.contact)
        return self._end(state, begin, last, cycles)

    def _moment(self, state: RunState) -> _Moment:
        return _Moment(state.worn, self.coupled.heat.exchange.own(state.temperature).values, state.totals)

    def _temperature(self, values: Array) -> HeatState | None:
        """Return the temperatures of coordinates (dim,); None of none."""
        return self.coupled.heat.exchange.at(values) if len(values) else None

    def _after(self, before: _Moment, stage: _Stage, cycles: float) -> _Moment:
        """Return the moment so many cycles as that of a stage later."""
        lost, adds = stage.worn.times(cycles), stage.adds.times(cycles)
        if stage.wear.coated:
            own = stage.wear.begun(before.worn, cycles).worn(stage.contact.pressure).times(cycles)
            lost, adds = replace(lost, punch=own.punch, strip=own.strip), with_coated(self.system, adds, own)
        return _Moment(before.worn + lost, before.temperature + cycles * stage.heated, before.totals + adds)

    def _end(self, state: RunState, before: _Moment, last: _Stage, cycles: float) -> RunState:
        """Return the end of a step whose last stage is solved."""
        now = self._after(before, last, cycles)
        worn = self.system.layers.settled(now.worn)
        self._heated, self._conductances = last.heated, last.conductances
        return RunState(state.half_cycle, worn, parted(last.contact), self._temperature(now.temperature), now.totals)

    def _passing(self, worn: WornDepths, cycles: float) -> DepthEvolution | None:
        """Return how depths follow in a stage where coefficients depend on them."""
        if not self._follows:
            return None
        return DepthEvolution(worn, cycles, partial(self._wear, worn, cycles), self._done)

    def _wear(self, before: WornDepths, cycles: float, pressure: Array) -> WornDepths:
        return self.wear.begun(before, cycles).worn(pressure)  # as last taken

    def _press(self, half_cycle: int, cycles: float) -> None:
        """Take the time and the loads so many cycles after a half-cycle."""
        self._done = half_cycle + cycles * self.system.motion.half_cycles
        if self.loading is not as_given:
            self._load = self.loading(self._done)
            self.contact.press(self._load)

    def _stage(
        self, before: _Moment, start: ContactState | None, cycles: float, followed: float | None = None
    ) -> _Stage:
        """Return the cycle whose middle is y = y_0 + `cycles` f, from the depths and temperatures of y_0.

        What flows is no rate: all of it is there after as many cycles as follow the stage, by default those of its own.
        """
        gap = np.array([self.system.gap(phase, before.worn) for phase in range(len(self.ratios))])
        if start is None:  # the first of all: what conducts is seen from the contact without heat
            start = self._solve(gap, self._of_first_phase(gap), (before.worn, cycles))
        solved = self.coupled.solve(
            before.temperature,
            cycles - 0.5,
            start,
            lambda thermal, coupling, near: self._solve(gap + thermal, near, (before.worn, cycles), coupling),
            self._passing(before.worn, cycles),
            lagged=True,
        )
        contact, begin = solved.contact, solved.temperature
        heated = self.coupled.through(begin, contact.pressure, solved.conductances)[-1] - begin
        adds = reduce(Totals.__add__, self._adds(contact.pressure))
        flowed: Array | None = None
        if self._flowed is not None:
            flowed = np.asarray(self._flowed / (cycles if followed is None else followed), dtype=np.float64)
        passing = self.system.passing(self.wear, None, self.evolution, self.conditions)
        worn = passing.worn(contact.pressure, before.worn, cycles, flowed)
        worn = replace(worn, crept=self._creep(before.worn, cycles).rate(contact.pressure))
        return _Stage(contact, heated, worn, adds, solved.conductances, self.wear)

    def _of_first_phase(self, gap: Array) -> ContactState | None:
        """Return the contact of the first phase alone, in every phase; None where all are found by factors at once.

        Products cost as many times as much as there are phases, and sets of nodes are many from nothing.
        """
        if len(gap) == 1 or not (isinstance(self.contact, CondensedContact) and self.contact.gridded):
            return None
        alone = self.system.phase_contact([0])
        alone.press(self._load)
        first = alone.solve(gap[0])
        pressure, open_, rigid = (np.repeat(own, len(gap), axis=0) for own in (first.pressure, first.gap, first.rigid))
        return ContactState(pressure, open_, rigid, first.iterations)

    def _solve(
        self, gap: Array, start: ContactState | None, begin: tuple[WornDepths, float], coupling: Array | None = None
    ) -> ContactState:
        """Return contact of a stage from the depths before it, so many cycles on."""
        self.watch()
        worn, cycles = begin
        passing = self.system.passing(self.wear, None, self.evolution, self.conditions)
        step, near = passing.step(worn, cycles), start
        gap, coupling = self._creep(worn, cycles).opening(gap, coupling)

        def solve(flowed: Array) -> ContactState:
            nonlocal near
            near = self.contact.solve(gap + flowed, near, step, coupling)
            return near

        found, self._flowed = self.system.layers.flowing(solve, lambda found: found.pressure)
        return found

    def _creep(self, worn: WornDepths, cycles: float) -> CreepStage:
        """Return what creeps in a stage."""
        return self.system.creep.stage(worn.crept, cycles, self.ratios, self._load)

    def take(self, conditions: Sequence[ContactConditions], evolution: Evolution) -> None:
        """Take friction and wear at the conditions of the phases, and what these do to the states of laws."""
        system = self.system
        self.wear, self.evolution, self.conditions = system.wear.phases(conditions), evolution, conditions
        self._measure([system.friction.values(state) for state in conditions])
        if system.friction.constant:
            return
        self.ratios = system.friction_ratios(conditions)
        self.contact.slide(self.ratios)

    def _measure(self, friction: Sequence[Array]) -> None:
        self.meters = [PhaseMeter(self.system, k, mu, self.wear.some([k])) for k, mu in enumerate(friction)]

    def _adds(self, pressure: Array) -> list[Totals]:
        """Return what each phase of a cycle adds at its pressure (m, n)."""
        return [meter(pressure[k, :]) for k, meter in enumerate(self.meters)]

    def _last_cycle(self, before: RunState, after: RunState, cycles: int) -> list[HalfCycle]:
        """Return the half-cycles of the last cycle of a jump, whose end is what was solved last."""
        motion, found = self.system.motion, []
        reached = before.half_cycle + cycles * motion.half_cycles
        contacts = [present(contact) for contact in after.contacts]
        heats = self._last_cycle_heat(after)
        # Half-cycles after one have worn what is missing at its end.
        depths, totals = [after.worn], [after.totals]
        adds = self._adds(np.concatenate([contact.pressure for contact in contacts]))
        phases = list(range(len(contacts)))
        if self.wear.coated:
            own_worn = [self._worn([k], contacts, after.worn) for k in phases]
            adds = [with_coated(self.system, one, lost) for one, lost in zip(adds, own_worn, strict=True)]
        for stroke in reversed(range(1, motion.half_cycles)):
            own = phases[stroke * motion.positions : (stroke + 1) * motion.positions]
            depths.insert(0, depths[0] - self._worn(own, contacts, depths[0]))
            totals.insert(0, reduce(Totals.__sub__, [adds[k] for k in own], totals[0]))
        for stroke, depth in enumerate(depths):
            own = phases[stroke * motion.positions : (stroke + 1) * motion.positions]
            records = [self._phase_record(k, contacts[k], before.contacts[k], cycles, adds[k]) for k in own]
            number = reached - (motion.half_cycles - 1 - stroke)
            heat = heat_of_phases(heats[k] for k in own)
            load = self.loading(reached)
            found.append(HalfCycle(number, records, depth, totals[stroke], heat, load))
        return found

    def _worn(self, phases: Sequence[int], contacts: Sequence[ContactState], now: WornDepths) -> WornDepths:
        pressures = np.concatenate([contacts[k].pressure for k in phases])
        conditions = [self.conditions[k] for k in phases]
        passing = self.system.passing(self.wear.some(phases), phases, self.evolution.some(phases), conditions)
        return passing.worn(pressures, now)

    def _phase_record(
        self, phase: int, contact: ContactState, old: ContactState | None, cycles: int, adds: Totals
    ) -> PhaseRecord:
        previous = None
        if old is not None:
            previous = contact.pressure[0] - (contact.pressure[0] - old.pressure[0]) / cycles
        return PhaseRecord(phase, contact, previous, adds, self.ratios[phase])

    def _last_cycle_heat(self, state: RunState) -> list[HalfCycleHeat | None]:
        """Return the heat of the cycle that ends with the state."""
        if not self.coupled.heat.dim:
            return [None] * len(state.contacts)
        heats: list[HalfCycleHeat | None] = []
        exchange = self.coupled.heat.exchange
        temperature = exchange.at(exchange.own(state.temperature).values - self._heated)
        for phase, contact in enumerate(state.contacts):
            pressure = present(contact).pressure[0]
            conductance = exchange.conductance(pressure) if self._conductances is None else self._conductances[phase]
            temperature, terms = exchange.half_cycle(temperature, phase, self.coupled.mu[phase] * pressure, conductance)
            surfaces = exchange.contact_temperatures(temperature, phase)
            heats.append(HalfCycleHeat(*surfaces, terms, 1, temperature.bulk))
        return heats


def _between(
    contact: ContactState | None, one: ContactState | None, other: ContactState | None, share: float
) -> ContactState | None:
    """Return a contact, and a share of the difference of two others."""
    if contact is None or one is None or other is None:
        return contact
    pressure = contact.pressure + share * (one.pressure - other.pressure)
    rigid = contact.rigid + share * (one.rigid - other.rigid)
    return replace(contact, pressure=np.maximum(pressure, 0.0), rigid=rigid)


def _comes(before: RunState, half: RunState, end: RunState) -> bool:
    """Return whether a node comes into contact from the begin of a jump or from its middle to its end."""
    return any(
        bool(np.any((late.pressure > 0) & ((middle.pressure == 0) | (early is not None and early.pressure == 0))))
        for early, middle, late in zip(
            before.contacts, map(present, half.contacts), map(present, end.contacts), strict=True
        )
    )
