"""Cycle jumps: N cycles in one implicit step, N chosen by an error estimate.

Both phases of a cycle stand in one inequality with the wear of N cycles at their own pressures:

    gap_d = S_d p_d + H a_d + g + w_n + N beta~ S (p_+^b + p_-^b) >= 0,   p_d >= 0,   p_d gap_d = 0.

It is stable for any N. A step is made whole and in two halves; their difference in pressure is the
error estimate, and the halves are kept.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fenwear.contact import ContactSolver, ContactState
from fenwear.cycle.block import Block, Recorder
from fenwear.errors import ConvergenceError
from fenwear.inequality import Array
from fenwear.system import System
from fenwear.wear import WornLayer


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
        ConvergenceError: the shortest jump did not converge; what was yielded before stands.
    """
    directions = system.motion.directions
    contact = system.contact(directions)
    phases = len(directions)
    scale = system.statics.mean_pressure
    cycles = half_cycles // phases
    wear = np.zeros_like(system.facing.initial_gap)
    state: ContactState | None = None
    recorder = Recorder(system, block)
    done, length = 0, 1
    while done < cycles:
        length = min(length, cycles - done)
        try:
            whole, _ = _step(system, contact, wear, state, length)
            middle, worn = _step(system, contact, wear, state, length / 2)
            end, end_worn = _step(system, contact, worn, middle, length / 2)
        except ConvergenceError:
            if length == 1:
                raise
            length = max(1, length // 4)
            continue
        error = float(np.abs(end.pressure - whole.pressure).max()) / scale
        if error > tolerance and length > 1:
            length = max(1, int(length * max(0.2, 0.9 * np.sqrt(tolerance / error))))
            continue
        done += length
        previous, state, wear = state, end, end_worn
        change = _record(recorder, system, done * phases, state, wear, previous, length)
        finished = periodic_within is not None and change < periodic_within
        if recorder.full or finished or done == cycles:
            yield recorder.take()
        if finished:
            return
        length = max(1, int(length * min(5.0, 0.9 * np.sqrt(tolerance / max(error, 1e-300)))))


def _step(
    system: System, contact: ContactSolver, wear: Array, start: ContactState | None, cycles: float
) -> tuple[ContactState, Array]:
    """Return the contact and the worn depth `cycles` cycles later."""
    layer = WornLayer(system.wear, cycles)
    state = contact.solve(system.facing.initial_gap + wear, start, layer)
    return state, wear + layer.opening(state.pressure)


def _record(
    recorder: Recorder,
    system: System,
    half_cycle: int,
    state: ContactState,
    wear: Array,
    previous: ContactState | None,
    length: int,
) -> float:
    """Record the phases of the last cycle; return the largest change of pressure per cycle."""
    directions = system.motion.directions
    worn = system.wear.depth(state.pressure)
    changes = []
    for phase, direction in enumerate(directions):
        remaining = len(directions) - 1 - phase
        before = (
            None if previous is None else state.pressure[phase] - (state.pressure - previous.pressure)[phase] / length
        )
        depth = wear - worn[phase + 1 :].sum(axis=0)
        changes.append(recorder.add(half_cycle - remaining, direction, phase, state, depth, worn[phase], before))
    return max(changes)
