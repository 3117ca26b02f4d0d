"""Half-cycle by half-cycle: contact, wear, and the next half-cycle the other way."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fenwear.contact import ContactState
from fenwear.cycle.block import Block, Recorder
from fenwear.system import System
from fenwear.wear import WornLayer

BLOCK = 200


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
        ConvergenceError: a contact did not converge; what was yielded before stands.
    """
    directions = system.motion.directions
    contacts = [system.contact((d,)) for d in directions]
    layer = WornLayer(system.wear) if implicit else None
    gap0 = system.facing.initial_gap
    wear = np.zeros_like(gap0)
    states: list[ContactState | None] = [None] * len(directions)
    recorder = Recorder(system, block)
    periodic_phases = 0
    for half_cycle in range(1, half_cycles + 1):
        phase = (half_cycle - 1) % len(directions)
        before = states[phase]
        state = contacts[phase].solve(gap0 + wear, before, layer)
        worn = system.wear.depth(state.pressure[0])
        wear = wear + worn
        states[phase] = state
        previous = None if before is None else before.pressure[0]
        change = recorder.add(half_cycle, directions[phase], 0, state, wear, worn, previous)
        periodic_phases = periodic_phases + 1 if periodic_within is not None and change < periodic_within else 0
        finished = periodic_phases >= len(directions)
        if recorder.full or finished or half_cycle == half_cycles:
            yield recorder.take()
        if finished:
            return
