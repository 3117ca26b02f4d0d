"""Cycle jumps: N cycles in one implicit step, N chosen by an error estimate.

All phases of a cycle stand in one inequality with the wear of N cycles at their own pressures:

    gap_d = S_d p_d + H a_d + g + w_n + N beta~ S (p_+^b + p_-^b) >= 0,   p_d >= 0,   p_d gap_d = 0,

and, with heat, the thermal gap at the end of N cycles, which is linear in the same pressures. It is
stable for any N. A step is made whole and in two halves; their difference in pressure is the error
estimate, and the halves are kept.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from fenwear.contact import ContactState
from fenwear.cycle.block import Block, HalfCycleHeat, Recorder
from fenwear.errors import ConvergenceError
from fenwear.heat.periodic import CycleHeat
from fenwear.inequality import Array
from fenwear.system import System
from fenwear.wear import WornLayer

MAX_ITERATIONS = 60  # of contact with the nodes that conduct
CLOSE = 1e-9  # change of pressure over the mean pressure that ends them

# Contact of all phases for a thermal gap (m, n) and its coupling (m, n, m, n), from a start.
SolveContact = Callable[[Array, Array, ContactState], ContactState]


@dataclass(frozen=True)
class _Moment:
    """The end of a jump: contact of its last cycle, worn depth, reduced temperature."""

    contact: ContactState | None
    wear: Array
    temperature: Array | None


def jump(
    system: System,
    half_cycles: int,
    *,
    tolerance: float,
    periodic_within: float | None = None,
    block: int = 200,
) -> Iterator[Block]:
    """Yield the last cycle of every jump, in blocks; collective.

    Args:
        system: The assembled problem.
        half_cycles: Where to end, a whole number of cycles.
        tolerance: Largest error of pressure in one jump, as a fraction of the mean pressure.
        periodic_within: Stop when the pressure changes per cycle by less than this fraction of the
            mean pressure.
        block: Half-cycles in a block.

    Raises:
        ConvergenceError: the shortest jump did not converge; what came before it is yielded.
    """
    phases = len(system.motion.directions)
    stepper = _Stepper(system)
    cycles = half_cycles // phases
    moment = stepper.start()
    recorder = Recorder(system, block)
    done, length = 0, 1
    while done < cycles:
        length = min(length, cycles - done)
        try:
            whole = stepper.step(moment, length)
            middle = stepper.step(moment, length / 2)
            end = stepper.step(middle, length / 2)
        except ConvergenceError as error:
            if length > 1:
                length = max(1, length // 4)
                continue
            if recorder:
                yield recorder.take()
            raise ConvergenceError(f"half-cycle {done * phases + 1}: {error}") from error
        error_estimate = _largest_change(whole, end) / system.statics.mean_pressure
        if error_estimate > tolerance and length > 1:
            length = max(1, int(length * max(0.2, 0.9 * np.sqrt(tolerance / error_estimate))))
            continue
        done += length
        change = stepper.record(recorder, done * phases, moment, end, length)
        moment = end
        finished = periodic_within is not None and change < periodic_within
        if recorder.full or finished or done == cycles:
            yield recorder.take()
        if finished:
            return
        length = max(1, int(length * min(5.0, 0.9 * np.sqrt(tolerance / max(error_estimate, 1e-300)))))


class _Stepper:
    """Implicit steps of any number of cycles."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.contact = system.contact(system.motion.directions)
        self.heat = cycle_heat(system)

    def start(self) -> _Moment:
        """Return the unworn bodies at their initial temperature."""
        temperature = None if self.heat is None else self.heat.initial()
        return _Moment(None, np.zeros_like(self.system.facing.initial_gap), temperature)

    def step(self, moment: _Moment, cycles: float) -> _Moment:
        """Return the moment `cycles` cycles later."""
        layer = WornLayer(self.system.wear, cycles)
        gap = self.system.facing.initial_gap + moment.wear
        temperature = moment.temperature
        if self.heat is None or temperature is None or moment.contact is None:
            # With heat this is the first step: which nodes conduct is seen from the contact without it.
            contact = self.contact.solve(gap, moment.contact, layer)
        else:
            contact = moment.contact
        if self.heat is not None and temperature is not None:
            contact, temperature = solve_with_heat(
                self.heat,
                temperature,
                cycles,
                contact,
                lambda thermal, coupling, start: self.contact.solve(gap + thermal, start, layer, coupling),
                self.system.statics.mean_pressure,
            )
        return _Moment(contact, moment.wear + layer.opening(contact.pressure), temperature)

    def record(self, recorder: Recorder, half_cycle: int, before: _Moment, after: _Moment, length: int) -> float:
        """Record the phases of the last cycle; return the largest change of pressure per cycle."""
        directions, state = self.system.motion.directions, after.contact
        assert state is not None
        worn = self.system.wear.depth(state.pressure)
        changes = []
        heats = self._last_cycle_heat(after)
        for phase, direction in enumerate(directions):
            remaining = len(directions) - 1 - phase
            previous = None
            if before.contact is not None:
                previous = state.pressure[phase] - (state.pressure - before.contact.pressure)[phase] / length
            depth = after.wear - worn[phase + 1 :].sum(axis=0)
            number = half_cycle - remaining
            changes.append(recorder.add(number, direction, phase, state, depth, worn[phase], previous, heats[phase]))
        return max(changes)

    def _last_cycle_heat(self, moment: _Moment) -> list[HalfCycleHeat | None]:
        """Return the heat of one more cycle at the pressures of the moment."""
        if self.heat is None or moment.temperature is None or moment.contact is None:
            return [None] * len(self.system.motion.directions)
        heats: list[HalfCycleHeat | None] = []
        exchange, state = self.heat.exchange, self.heat.parts(moment.temperature)
        for phase in range(len(moment.contact.pressure)):
            pressure = moment.contact.pressure[phase]
            state, terms = exchange.half_cycle(state, phase, pressure, exchange.conductance(pressure))
            heats.append(HalfCycleHeat(*exchange.contact_temperatures(state), terms, 1))
        return heats


def cycle_heat(system: System) -> CycleHeat | None:
    """Return the heat of whole cycles; None without heat."""
    exchange = system.reduced_exchange
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


def _largest_change(one: _Moment, other: _Moment) -> float:
    assert one.contact is not None
    assert other.contact is not None
    return float(np.abs(one.contact.pressure - other.contact.pressure).max())
