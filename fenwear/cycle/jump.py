"""Cycle jumps: N cycles in one implicit step, N chosen by an error estimate.

All phases of a cycle stand in one inequality with the wear of N cycles at their own pressures:

    gap_k = S_k p_k + H a_k + g_k + w_n + N beta~ (sum of S_j p_j^b) >= 0,   p_k >= 0,   p_k gap_k = 0,

and, with heat, the thermal gap at the end of N cycles, which is linear in the same pressures. It is
stable for any N. A step is made whole and in two halves; their difference in pressure is the error
estimate, and the halves are kept.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import reduce

import numpy as np

from fenwear.arrays import Array
from fenwear.assembly import Tribosystem, heating_friction, with_reduced_heat
from fenwear.contact import CondensedContact, ContactState
from fenwear.cycle.block import Block, HalfCycleHeat, PhaseRecord, Recorder
from fenwear.cycle.moment import Moment, beginning, joined, parted
from fenwear.errors import ConvergenceError
from fenwear.heat.periodic import CycleHeat
from fenwear.remedies import SHORTER_JUMPS, SMALLER_STEPS
from fenwear.sliding.friction import ContactConditions
from fenwear.sliding.wear import Worn, WornLayer

PARTS = 8  # of a cycle that does not converge as a whole
MAX_ITERATIONS = 60  # of contact with the nodes that conduct
CLOSE = 1e-9  # change of pressure over the mean pressure that ends them

# Contact of all phases for a thermal gap (m, n) and its coupling (m, n, m, n), from a start.
SolveContact = Callable[[Array, Array, ContactState], ContactState]


def jump(
    system: Tribosystem,
    half_cycles: int,
    *,
    tolerance: float,
    periodic_within: float | None = None,
    block: int = 200,
    start: Moment | None = None,
    stops: frozenset[int] = frozenset(),
    leave: Callable[[Moment], bool] = lambda _: False,
) -> Iterator[Block]:
    """Yield the last cycle of every jump, in blocks; collective.

    Args:
        system: The assembled problem.
        half_cycles: Where to end, a whole number of cycles.
        tolerance: Largest error of pressure in one jump, root mean square over the contact and over the mean pressure.
        periodic_within: Stop when the pressure changes per cycle by less than this fraction of the
            mean pressure.
        block: Half-cycles in a block.
        start: Where to go on from, such as the end of a block; by default the beginning.
        stops: Half-cycles at which a jump and a block end in any case.
        leave: Ends the run at the first moment for which it is true.

    Raises:
        ConvergenceError: the shortest jump did not converge; what came before it is yielded.
    """
    strokes = system.motion.half_cycles
    stepper = _Stepper(system)
    cycles = half_cycles // strokes
    ends = sorted({-(-stop // strokes) for stop in stops} | {cycles})
    moment = start or stepper.beginning()
    recorder = Recorder(system, block)
    done, length = moment.half_cycle // strokes, moment.jump_length
    while done < cycles:
        tried = min(length, next(end for end in ends if end > done) - done)
        try:
            end, estimate = stepper.attempt(moment, tried, tolerance)
        except ConvergenceError as error:
            if tried > 1:
                system.remedies.note(SHORTER_JUMPS)
                length = max(1, tried // 4)
                continue
            if recorder:
                yield recorder.take(moment)
            raise ConvergenceError(f"half-cycle {done * strokes + 1}: {error}") from error
        factor = 0.9 * np.sqrt(tolerance / max(estimate, 1e-300))
        if estimate > tolerance and tried > 1:
            length = max(1, int(tried * max(0.2, factor)))
            continue
        done += tried
        if tried == length or factor < 1:  # a step cut short by an end says little of the next length
            length = max(1, int(tried * min(5.0, factor)))
        end = replace(end, half_cycle=done * strokes, jump_length=length)
        change = stepper.record(recorder, moment, end, tried)
        moment = end
        finished = (periodic_within is not None and change < periodic_within) or leave(moment)
        if recorder.full or finished or done in ends:
            yield recorder.take(moment)
        if finished:
            return


class _Stepper:
    """Implicit steps of any number of cycles."""

    def __init__(self, system: Tribosystem) -> None:
        self.system = system
        self.contact = system.phase_contact(range(len(system.motion.phases)))
        self.heat = cycle_heat(system)
        self.ratios = system.friction_ratios()
        self.wear = system.phases_wear

    def beginning(self) -> Moment:
        """Return the unworn bodies at their initial temperature."""
        return beginning(self.system, None if self.heat is None else self.heat.exchange.initial())

    def attempt(self, moment: Moment, cycles: int, tolerance: float) -> tuple[Moment, float]:
        """Return the moment `cycles` cycles later, by two steps, and an estimate of its error.

        Raises:
            ConvergenceError: it did not converge; a single cycle not in smaller steps either.
        """
        try:
            whole, halves = self.step(moment, cycles), self.steps(moment, cycles, 2)
        except ConvergenceError as error:
            if cycles > 1:
                raise
            try:
                parts = self.steps(moment, cycles, PARTS)
            except ConvergenceError:
                raise error from None
            self.system.remedies.note(SMALLER_STEPS.format(PARTS))
            return parts, tolerance
        return halves, _difference(self.system, whole, halves)

    def steps(self, moment: Moment, cycles: float, count: int) -> Moment:
        """Return the moment `cycles` cycles later, by that many equal steps."""
        for _ in range(count):
            moment = self.step(moment, cycles / count)
        return moment

    def step(self, moment: Moment, cycles: float) -> Moment:
        """Return the moment `cycles` cycles later."""
        if not self.system.constant_coefficients:
            self._update(moment)
        layer = WornLayer(self.wear, cycles)
        phases = range(len(self.ratios))
        gap = np.array([self.system.gap(phase, moment.worn) for phase in phases])
        contact, temperature = joined(moment.contacts), moment.temperature
        if self.heat is None or temperature is None or contact is None:
            # With heat this is the first step: which nodes conduct is seen from the contact without it.
            contact = self.contact.solve(gap, contact, layer)
        if self.heat is not None and temperature is not None:
            contact, end = solve_with_heat(
                self.heat,
                np.concatenate(temperature),
                cycles,
                contact,
                lambda thermal, coupling, start: self.contact.solve(gap + thermal, start, layer, coupling),
                self.system.rigid.mean_pressure,
            )
            temperature = self.heat.parts(end)
        worn = moment.worn + self.wear.worn(contact.pressure).times(cycles)
        return Moment(moment.half_cycle, worn, parted(contact), temperature)

    def _update(self, moment: Moment) -> None:
        """Take friction and wear at the pressures and temperatures at the start of the step."""
        surfaces = None
        if self.heat is not None and moment.temperature is not None:
            surfaces = self.heat.exchange.contact_temperatures(moment.temperature)
        pressures = [None if contact is None else contact.pressure[0] for contact in moment.contacts]
        self.take([self.system.conditions(k, pressure, surfaces) for k, pressure in enumerate(pressures)])

    def take(self, conditions: Sequence[ContactConditions]) -> None:
        """Take friction and wear at the conditions of the phases."""
        system = self.system
        self.wear = system.wear.phases(conditions)
        if system.friction.constant:
            return
        self.ratios = system.friction_ratios(conditions)
        if isinstance(self.contact, CondensedContact):
            self.contact.slide(self.ratios)
        if self.heat is not None:
            mu = np.array([heating_friction(system, system.friction.values(state)) for state in conditions])
            self.heat = CycleHeat(self.heat.exchange.with_friction(mu))

    def record(self, recorder: Recorder, before: Moment, after: Moment, cycles: int) -> float:
        """Record the half-cycles of the last cycle; return the largest change of pressure per cycle."""
        motion, changes = self.system.motion, []
        contacts = [_present(contact) for contact in after.contacts]
        heats = self._last_cycle_heat(after)
        # Half-cycles after one have worn what is missing at its end.
        depths = [after.worn]
        phases = list(range(len(contacts)))
        for stroke in reversed(range(1, motion.half_cycles)):
            own = phases[stroke * motion.positions : (stroke + 1) * motion.positions]
            depths.insert(0, depths[0] - self._worn(own, contacts))
        for stroke, depth in enumerate(depths):
            own = phases[stroke * motion.positions : (stroke + 1) * motion.positions]
            records = [self._phase_record(k, contacts[k], before.contacts[k], cycles) for k in own]
            number = after.half_cycle - (motion.half_cycles - 1 - stroke)
            own_heats = [heat for heat in (heats[k] for k in own) if heat is not None]
            heat = reduce(HalfCycleHeat.then, own_heats) if own_heats else None
            changes.append(recorder.add(number, records, depth, heat))
        return max(changes)

    def _worn(self, phases: Sequence[int], contacts: Sequence[ContactState]) -> Worn:
        pressures = np.concatenate([contacts[k].pressure for k in phases])
        return self.wear.some(phases).worn(pressures)

    def _phase_record(self, phase: int, contact: ContactState, old: ContactState | None, cycles: int) -> PhaseRecord:
        previous = None
        if old is not None:
            previous = contact.pressure[0] - (contact.pressure[0] - old.pressure[0]) / cycles
        areas = self.wear.some([phase]).worn_area(contact.pressure)
        return PhaseRecord(phase, contact, previous, areas, self.ratios[phase])

    def _last_cycle_heat(self, moment: Moment) -> list[HalfCycleHeat | None]:
        """Return the heat of one more cycle at the pressures of the moment."""
        if self.heat is None or moment.temperature is None:
            return [None] * len(moment.contacts)
        heats: list[HalfCycleHeat | None] = []
        exchange, state = self.heat.exchange, moment.temperature
        for phase, contact in enumerate(moment.contacts):
            pressure = _present(contact).pressure[0]
            state, terms = exchange.half_cycle(state, phase, pressure, exchange.conductance(pressure))
            heats.append(HalfCycleHeat(*exchange.contact_temperatures(state), terms, 1))
        return heats


def cycle_heat(system: Tribosystem) -> CycleHeat | None:
    """Return the heat of whole cycles; None without heat."""
    exchange = with_reduced_heat(system).exchange
    return None if exchange is None else CycleHeat(exchange)


def solve_with_heat(
    heat: CycleHeat,
    temperature: Array,
    cycles: float,
    start: ContactState,
    solve: SolveContact,
    mean_pressure: float,
) -> tuple[ContactState, Array]:
    """Return contact and temperature after `cycles` cycles, with the nodes that conduct in contact.

    Raises:
        ConvergenceError: nodes open and close in turn.
    """
    contact, pressure, share = start, start.pressure, 1.0
    for iteration in range(MAX_ITERATIONS):
        conductances = heat.conductances(pressure)
        end = heat.jump(temperature, cycles, conductances)
        contact = solve(end.gap, end.coupling, contact)
        settled = np.array_equal(heat.conductances(contact.pressure), conductances, equal_nan=True)
        change = contact.pressure - pressure
        if settled or np.abs(change).max() < CLOSE * mean_pressure:
            return contact, end.state(contact.pressure)
        if iteration > 15:  # go half way
            share = 0.5
        pressure = pressure + share * change
    raise ConvergenceError(
        f"contact and the nodes that conduct did not come together in {MAX_ITERATIONS} iterations; "
        'set heat.conducting = "nominal"'
    )


def _difference(system: Tribosystem, one: Moment, other: Moment) -> float:
    """Return the root mean square of the pressures' difference over what is in contact, over the mean pressure there.

    Not the largest: that is the whole pressure of the one node which is in contact here and not there.
    """
    weights, largest = system.pair.weights, 0.0
    for a, b in zip(one.contacts, other.contacts, strict=True):
        first, second = _present(a).pressure[0], _present(b).pressure[0]
        width = float(weights @ (np.maximum(first, second) > 0))
        largest = max(largest, float(weights @ (first - second) ** 2) * width)
    return float(np.sqrt(largest) / (system.rigid.mean_pressure * weights.sum()))


def _present(contact: ContactState | None) -> ContactState:
    """Return the contact of a phase that a step has solved."""
    if contact is None:
        raise ConvergenceError("a phase of the motion has no contact yet")
    return contact
