"""Half-cycle by half-cycle: heat, contact, wear, and the next half-cycle the other way."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from fenwear.contact import ContactState
from fenwear.cycle.block import Block, HalfCycleHeat, Recorder
from fenwear.cycle.thermal import ThermalContact
from fenwear.errors import ConvergenceError
from fenwear.inequality import Array
from fenwear.system import System
from fenwear.wear import WornLayer

BLOCK = 200
Solve = Callable[[int, Array, ContactState | None], tuple[ContactState, HalfCycleHeat | None]]


def march(
    system: System,
    half_cycles: int,
    *,
    implicit: bool = False,
    periodic_within: float | None = None,
    block: int = BLOCK,
) -> Iterator[Block]:
    """Yield all half-cycles, in blocks; collective.

    The explicit step wears the surface by the pressure on the shape at its start, as in the paper;
    the implicit one by the pressure on the shape at its end, and is stable for any step.

    Args:
        system: The assembled problem.
        half_cycles: How many at most.
        implicit: Which of the two steps.
        periodic_within: Stop when in a whole cycle the pressure differs from the cycle before by
            less than this fraction of the mean pressure.
        block: Half-cycles in a block.

    Raises:
        ConvergenceError: a half-cycle, which it names, did not converge; all before it are yielded.
    """
    directions = system.motion.directions
    solve = _solver(system, implicit)
    gap0 = system.facing.initial_gap
    wear = np.zeros_like(gap0)
    states: list[ContactState | None] = [None] * len(directions)
    recorder = Recorder(system, block)
    periodic_phases = 0
    for half_cycle in range(1, half_cycles + 1):
        phase = (half_cycle - 1) % len(directions)
        before = states[phase]
        try:
            state, heat = solve(phase, gap0 + wear, before)
        except ConvergenceError as error:
            if recorder:
                yield recorder.take()
            raise ConvergenceError(f"half-cycle {half_cycle}: {error}") from error
        worn = system.wear.depth(state.pressure[0])
        wear = wear + worn
        states[phase] = state
        previous = None if before is None else before.pressure[0]
        change = recorder.add(half_cycle, directions[phase], 0, state, wear, worn, previous, heat)
        periodic_phases = periodic_phases + 1 if periodic_within is not None and change < periodic_within else 0
        finished = periodic_phases >= len(directions)
        if recorder.full or finished or half_cycle == half_cycles:
            yield recorder.take()
        if finished:
            return


def _solver(system: System, implicit: bool) -> Solve:
    """Return what solves a half-cycle of a phase: contact alone, or contact with heat."""
    layer = WornLayer(system.wear) if implicit else None
    phases = range(len(system.motion.directions))
    exchange = system.exchange
    if exchange is None:
        contacts = [system.contact((d,)) for d in system.motion.directions]
        return lambda phase, gap, start: (contacts[phase].solve(gap, start, layer), None)
    thermal = [ThermalContact(system, exchange, phase) for phase in phases]
    temperature = exchange.initial()

    def solve(phase: int, gap: Array, start: ContactState | None) -> tuple[ContactState, HalfCycleHeat]:
        nonlocal temperature
        state, temperature, heat = thermal[phase].solve(temperature, gap, start, layer)
        return state, heat

    return solve
