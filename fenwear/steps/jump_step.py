"""The implicit step of cycle jumps.

A cycle takes the state y, the worn depths and the temperatures, to y + F(y). Let y(n) be smooth and meet
the states of a march at whole numbers n of cycles: y(n + 1/2) changes by F(y(n)), so that to second order

    dy/dn = f(y) = F(y - f(y) / 2):

the cycle with the middle y begins half a cycle's change before it. (`jump_method`).
A stage solves contact, wear and heat together: all phases of a cycle stand in one inequality
with the wear of h = g N cycles at their own pressures,

    gap_k = S_k p_k + H a_k + g_k + w_n + h beta~ (sum of S_j p_j^b) >= 0,   p_k >= 0,   p_k gap_k = 0,

and, with heat, the thermal gap at the end of each phase, which is linear in the same pressures. The
cycle begins at h - 1/2 cycles. Friction, wear and conductance are those of the stage itself: the
pressure of each phase, and the temperature at its start. All phases meet the shape in the middle of the
cycle, where those of a march come one after the other: they differ by the wear of half a cycle, as an
explicit march does from an implicit one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from fenwear.common.arrays import Array
from fenwear.contact import CondensedContact, ContactState
from fenwear.heat.temperature import HeatState
from fenwear.laws import Evolution
from fenwear.laws.friction import ContactConditions
from fenwear.laws.wear import NOTHING, PhasesWear, WornDepths
from fenwear.steps.block import HalfCycle, HeatRecord, PhaseRecord, heat_of_phases
from fenwear.steps.coupled_phases import Coupled, DepthEvolution, check_cycle_memory
from fenwear.steps.driver import Loading, Watch, as_given, unwatched
from fenwear.steps.jump_method import HALVES, Attempt, Estimate, JumpLaw, Moment, Sizes, attempt
from fenwear.steps.run_state import PhaseMeter, RunState, Totals, all_phases, beginning, parted, with_coated
from fenwear.system import CreepStage, Tribosystem, with_reduced_heat

LOOSEST = 5e-3  # tolerance that contacts are solved to: of a rough run, too, they are told to fulfil their conditions


@dataclass(frozen=True)
class _Rate:
    """Changes of temperature (dim,), depths and totals over the cycle of a solved stage.

    Its conductances (m, n) are those by which it is heated. Wear through coatings depends on the begin and the length
    of a step: `wear` is that of its phases.
    """

    heated: Array
    worn: WornDepths
    adds: Totals
    conductances: Array
    wear: PhasesWear


@dataclass(frozen=True)
class JumpMoment(Moment):
    """Depths, temperatures (dim,) and totals, and of the stage that they are the end of, its rate."""

    temperature: Array
    totals: Totals
    rate: _Rate | None = None


class Stepper(JumpLaw[JumpMoment]):
    """Implicit steps of any number of cycles."""

    def __init__(
        self,
        system: Tribosystem,
        tolerance: float,
        watch: Watch = unwatched,
        loading: Loading = as_given,
        *,
        periodic: bool = False,
    ) -> None:
        self.system = system = with_reduced_heat(system)
        check_cycle_memory(system)
        self.tolerance, self.watch, self.loading = tolerance, watch, loading
        self.periodic = periodic  # whether temperatures are those that repeat, at the end of a stage
        self._sizes = Sizes(system.layers, system.pair, system.elastic.creep.depth)
        self.contact = system.phase_contact(range(len(system.motion.phases)))
        self.ratios = system.phases.ratios()
        self.wear = system.phases.mean_wear
        self.conditions: Sequence[ContactConditions] = [system.phases.conditions(k) for k in range(len(self.ratios))]
        self.evolution = system.phases.evolution(self.conditions)
        self._mu = [system.laws.friction.values(condition) for condition in self.conditions]
        self._meters = [PhaseMeter(system, k) for k in range(len(self.ratios))]
        self.coupled = Coupled(system, self.take)
        self._flowed: Array | float = 0.0  # beyond the hardness, in the stage solved last
        self._begin: RunState = beginning(system)  # of the jump
        self._done, self._load = 0.0, 1.0  # half-cycles at the end of the stage, and the factor of all loads there
        self._last_cycle: list[HalfCycle] = []
        follows = bool(system.case.passing_laws) or system.layers.varies or system.laws.asks("debris")
        follows = follows or bool(system.layers.memory.names)
        self._follows = follows or system.laws.friction.of_coatings != (None, None)  # coefficients do, within a step
        by_friction = any(law.energy for law in system.sliding.wear)
        self._wear_follows = follows or (self._follows and by_friction)

    def attempt(self, state: RunState, cycles: int) -> tuple[Attempt[JumpMoment], Estimate, list[HalfCycle]]:
        """Return a jump, an estimate of its error, and the last cycle.

        Raises:
            ConvergenceError: it did not converge.
        """
        self._begin = state
        made = attempt(self, self.moment(state), cycles)
        return made, self._estimate(made), self._last_cycle

    def state(self, moment: JumpMoment, half_cycle: int) -> RunState:
        """Return the state of a run at a moment."""
        contacts = parted(moment.contact)
        return RunState(half_cycle, moment.worn, contacts, self._temperature(moment.temperature), moment.totals)

    def finer(self, made: Attempt[JumpMoment] | None, end: RunState) -> RunState:
        """Return the end of jumps of vanishing length from the end of such jumps before the last attempt.

        Args:
            made: The attempt; None where it was marched, so that there is no estimate of it.
            end: End of the attempt.
        """
        fine = self._begin.finer
        assert fine is not None
        before = self.moment(fine)
        if made is None:
            moment = self.apart(self.moment(end), before, self.moment(self._begin), 1.0)
        else:
            moment = made.finer(self, made.begin if fine.worn is self._begin.worn else before)
        return self.state(moment, end.half_cycle)

    def apart(self, base: JumpMoment, first: JumpMoment, other: JumpMoment, share: float) -> JumpMoment:
        """Return a moment, and a share of the difference of two others."""
        contact = base.contact
        if len(contact.pressure) and len(first.contact.pressure) and len(other.contact.pressure):
            pressure = contact.pressure + share * (first.contact.pressure - other.contact.pressure)
            rigid = contact.rigid + share * (first.contact.rigid - other.contact.rigid)
            contact = replace(contact, pressure=np.maximum(pressure, 0.0), rigid=rigid)
        return JumpMoment(
            self.system.layers.settled(base.worn + (first.worn - other.worn).times(share)),
            contact,
            base.time,
            base.temperature + share * (first.temperature - other.temperature),
            base.totals + (first.totals - other.totals).times(share),
        )

    def _estimate(self, made: Attempt[JumpMoment]) -> Estimate:
        """Return the error of a jump."""
        worn, wrong = (made.begin.worn, made.end.worn), (made.full.worn - made.end.worn).times(HALVES)
        estimate = self._sizes.estimate(worn, made, [wrong], HALVES * self._heat_difference(made))
        missed = self._missed(made) if self._wear_follows else 0.0
        return replace(estimate, depth=max(estimate.depth, self._through_difference(made), missed))

    def _through_difference(self, made: Attempt[JumpMoment]) -> float:
        """Return the largest difference of depths where coatings end, over the largest that the jump wears.

        Not a part of it: in a step that a coating ends in depths bend, and its order is not that of others.
        """
        largest = 0.0
        for body, thickness in zip(("punch", "strip"), self.system.laws.coatings, strict=True):
            first, full, other = (getattr(moment.worn, body) for moment in (made.begin, made.full, made.end))
            ended = (first < thickness) & (np.maximum(full, other) >= thickness)
            apart = float(np.abs(full - other).max(where=ended, initial=0.0))
            largest = max(largest, apart / max(float((other - first).max()), 1e-300))
        return largest

    def _heat_difference(self, made: Attempt[JumpMoment]) -> float:
        """Return the difference of the reduced contact temperatures over their rise; 0 without heat."""
        exchange = self.system.exchange
        states = (*(exchange.at(moment.temperature) for moment in (made.full, made.end)), exchange.on_bases(None))
        first, second, initial = (np.array(exchange.contact_temperatures(state)) for state in states)
        weights = self.system.pair.weights
        apart, rise = (float(np.sqrt((t**2 @ weights).sum())) for t in (first - second, second - initial))
        return apart / max(rise, 1e-300)

    def _missed(self, made: Attempt[JumpMoment]) -> float:
        """Return the error of what a jump wears where coefficients change with depth or distance, relative.

        Its stages do not look at its begin: a coating that is worn through before the first of them would be missed.
        Simpson's rule on the wear of a cycle at the begin, in the middle and at the end does, and is of higher order.
        """
        if not len(made.begin.contact.pressure):
            return 0.0
        done, strokes = self._begin.half_cycle, self.system.motion.half_cycles
        begin, middle, end = (
            self._rate(moment, done + share * made.cycles * strokes)
            for moment, share in ((made.begin, 0.0), (made.half, 0.5), (made.end, 1.0))
        )
        simpson = (begin + middle.times(4.0) + end).times(made.cycles / 6)
        worn = replace(made.end.worn - made.begin.worn, between=NOTHING, carried=NOTHING)
        return self._sizes.area(simpson - worn) / max(self._sizes.area(worn), 1e-300)

    def _rate(self, state: JumpMoment, half_cycles: float) -> WornDepths:
        """Return the wear of a cycle at the depths, temperatures and pressures of a moment."""
        system, exchange = self.system, self.coupled.heat.exchange
        pressures = state.contact.pressure
        shear = system.phases.ways.shear(pressures)
        surfaces = exchange.contact_temperatures(exchange.at(state.temperature))
        conditions: Sequence[ContactConditions] = [
            system.phases.conditions(k, pressures[k], surfaces, state.worn, half_cycles, shear)
            for k in range(len(pressures))
        ]
        evolution = system.phases.evolution(conditions, state.worn)
        conditions = evolution.around(system.layers.held(state.worn))
        return system.phases.wear.phases(conditions).begun(state.worn).worn(pressures)

    def _solve_to(self, share: float) -> None:
        """Solve contact to a share of the tolerance, where its digits cost; fully beyond a hardness, as flow stays."""
        if isinstance(self.contact, CondensedContact) and self.system.layers.hardness == np.inf:
            self.contact.inequality.close = share * min(self.tolerance, LOOSEST)

    def moment(self, state: RunState) -> JumpMoment:
        """Return the moment of a state of a run."""
        temperature = self.coupled.heat.exchange.on_bases(state.temperature).values
        return JumpMoment(state.worn, all_phases(state.contacts), 0.0, temperature, state.totals)

    def _temperature(self, values: Array) -> HeatState | None:
        """Return the temperatures of coordinates (dim,); None of none."""
        return self.coupled.heat.exchange.at(values) if len(values) else None

    def settled(self, end: JumpMoment) -> JumpMoment:
        """Return the end of a step, which may have overshot."""
        return replace(end, worn=self.system.layers.settled(end.worn))

    def after(self, before: JumpMoment, stage: JumpMoment, cycles: float) -> JumpMoment:
        """Return the moment so many cycles as that of a stage later."""
        rate, contact = stage.rate, stage.contact
        assert rate is not None
        lost, adds = rate.worn.times(cycles), rate.adds.times(cycles)
        if rate.wear.coated:
            worn_off = rate.wear.begun(before.worn, cycles).worn(contact.pressure).times(cycles)
            lost, adds = (
                replace(lost, punch=worn_off.punch, strip=worn_off.strip),
                with_coated(self.system, adds, worn_off),
            )
        temperature = before.temperature + cycles * rate.heated
        return JumpMoment(before.worn + lost, contact, stage.time, temperature, before.totals + adds, rate)

    def _press(self, cycles: float) -> None:
        """Take the time and the loads so many cycles after the begin of the jump."""
        self._done = self._begin.half_cycle + cycles * self.system.motion.half_cycles
        if self.loading is not as_given:
            self._load = self.loading(self._done)
            self.contact.press(self._load)

    def stage(self, before: JumpMoment, cycles: float, time: float, near: ContactState, digits: float) -> JumpMoment:
        """Return the moment `cycles` cycles later, by the cycle whose middle it is.

        Plastic flow is no rate: all of it is there after as many cycles.
        """
        self._solve_to(digits)
        self._press(time)
        gap = np.array([self.system.gap(phase, before.worn) for phase in range(len(self.ratios))])
        if not len(near.pressure):  # the first of all: what conducts is seen from the contact without heat
            near = self._solve(gap, self._of_first_phase(gap), (before.worn, cycles))
        solved = self.coupled.solve(
            before.temperature,
            np.inf if self.periodic else cycles - 0.5,
            near,
            lambda thermal, coupling, near: self._solve(gap + thermal, near, (before.worn, cycles), coupling),
            DepthEvolution(
                before.worn,
                cycles,
                lambda pressure: self.wear.begun(before.worn, cycles).worn(pressure),  # as last taken
                self._done,
                self._follows,
            ),
        )
        contact, begin = solved.contact, solved.temperature
        heated = self.coupled.through(begin, contact.pressure, solved.conductances)[-1] - begin
        if self.periodic:
            before, heated = replace(before, temperature=begin), 0 * begin
        adds = reduce(Totals.__add__, self._adds(contact.pressure))
        passing = self.system.phases.passing(self.wear, None, self.evolution, self.conditions)
        worn = passing.worn(contact.pressure, before.worn, cycles, self._flowed * (1 / cycles))
        worn = replace(worn, crept=self._creep(before.worn, cycles).rate(contact.pressure))
        rate = _Rate(heated, worn, adds, solved.conductances, self.wear)
        return self.after(before, JumpMoment(worn, contact, time, begin, before.totals, rate), cycles)

    def _of_first_phase(self, gap: Array) -> ContactState | None:
        """Return the contact of the first phase alone, in every phase; None where all are found by factors at once.

        Products cost as many times as much as there are phases, and sets of nodes are many from nothing.
        """
        if len(gap) == 1 or not (isinstance(self.contact, CondensedContact) and self.contact.gridded):
            return None
        alone = self.system.phase_contact([0])
        alone.press(self._load)
        first = alone.solve(gap[0])
        pressure, open_, rigid = (
            np.repeat(values, len(gap), axis=0) for values in (first.pressure, first.gap, first.rigid)
        )
        return ContactState(pressure, open_, rigid, first.iterations)

    def _solve(
        self, gap: Array, start: ContactState | None, begin: tuple[WornDepths, float], coupling: Array | None = None
    ) -> ContactState:
        """Return contact of a stage from the depths before it, so many cycles on."""
        self.watch()
        worn, cycles = begin
        passing = self.system.phases.passing(self.wear, None, self.evolution, self.conditions)
        step, near = passing.step(worn, cycles), start
        gap, coupling = self._creep(worn, cycles).opening(gap, coupling)

        def solve(flowed: Array) -> ContactState:
            nonlocal near
            near = self.contact.solve(gap + flowed, near, step, coupling)
            return near

        solved, self._flowed = self.system.layers.flowing(solve, lambda contact: contact.pressure)
        return solved

    def _creep(self, worn: WornDepths, cycles: float) -> CreepStage:
        """Return the creep of a stage."""
        return self.system.elastic.creep.stage(worn.crept, cycles, self.ratios, self._load)

    def take(self, conditions: Sequence[ContactConditions], evolution: Evolution) -> None:
        """Take friction and wear at the conditions of the phases, and what these do to the states of laws."""
        system = self.system
        self.wear, self.evolution, self.conditions = system.phases.wear.phases(conditions), evolution, conditions
        self._mu = [system.laws.friction.values(condition) for condition in conditions]
        if system.laws.friction.constant:
            return
        self.ratios = system.phases.ratios(conditions)
        self.contact.slide(self.ratios)

    def _adds(self, pressure: Array) -> list[Totals]:
        """Return the additions of each phase of a cycle at its pressure (m, n)."""
        return [meter(pressure[k, :], self._mu[k], self.wear.some([k])) for k, meter in enumerate(self._meters)]

    def ended(self, end: JumpMoment, cycles: float) -> None:
        """Take the half-cycles of the last cycle of a jump, whose end is what was solved last."""
        motion, worn, totals = self.system.motion, end.worn, end.totals
        number = self._begin.half_cycle + round(cycles) * motion.half_cycles
        contacts, pressure, load = parted(end.contact), end.contact.pressure, self.loading(number)
        before = np.concatenate([contact.pressure for contact in self._begin.contacts])
        earlier = pressure - (pressure - before) / cycles  # in the cycle before
        heats, adds = self._last_cycle_heat(end), self._adds(pressure)
        if self.wear.coated:
            own_worn = [self._worn([k], contacts, end.worn) for k in range(len(contacts))]
            adds = [with_coated(self.system, addition, lost) for addition, lost in zip(adds, own_worn, strict=True)]
        self._last_cycle = []
        for phases in reversed(np.arange(len(contacts)).reshape(-1, motion.positions).tolist()):
            records = [PhaseRecord(k, contacts[k], earlier[k], adds[k], self.ratios[k]) for k in phases]
            heat = heat_of_phases(heats[k] for k in phases)
            self._last_cycle.insert(0, HalfCycle(number, records, worn, totals, heat, load))
            # Half-cycles before have not worn yet what this one does.
            number, worn = number - 1, worn - self._worn(phases, contacts, worn)
            totals = reduce(Totals.__sub__, [adds[k] for k in phases], totals)

    def _worn(self, phases: Sequence[int], contacts: Sequence[ContactState], now: WornDepths) -> WornDepths:
        pressures = np.concatenate([contacts[k].pressure for k in phases])
        conditions = [self.conditions[k] for k in phases]
        passing = self.system.phases.passing(self.wear.some(phases), phases, self.evolution.some(phases), conditions)
        return passing.worn(pressures, now)

    def _last_cycle_heat(self, end: JumpMoment) -> list[HeatRecord | None]:
        """Return the heat of the cycle that ends a jump."""
        assert end.rate is not None
        if not self.coupled.heat.dim:
            return [None] * len(end.contact.pressure)
        heats: list[HeatRecord | None] = []
        exchange = self.coupled.heat.exchange
        temperature = exchange.at(end.temperature - end.rate.heated)
        for phase, pressure in enumerate(end.contact.pressure):
            heated, conductance = self.coupled.mu[phase] * pressure, end.rate.conductances[phase]
            temperature, terms = exchange.half_cycle(temperature, phase, heated, conductance)
            surfaces = exchange.contact_temperatures(temperature, phase)
            heats.append(HeatRecord(*surfaces, terms, np.array(1), np.array(temperature.bulk)))
        return heats
