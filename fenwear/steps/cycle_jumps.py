"""Cycle jumps: N cycles in one implicit step, N chosen by an error estimate; the law of contact says how.

The error of all jumps of a run differs from the sum of their errors: a jump takes on what those before
it have left, and wear evens it out. Beside a state y a run may have its `finer`, y - e, where e continues as the next
jump takes it, and that jump's own error is added (the global error by local extrapolation beside the solution, as of R.
D. Skeel, BIT 26, 1986): how fast errors fade is found by the jumps themselves.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from math import ceil

from fenwear.common.errors import CaseError, InputError
from fenwear.steps.block import Block, HalfCycle
from fenwear.steps.driver import Jumps, RunLimits, Watching, run_steps
from fenwear.steps.run_state import RunState, beginning, on_exchange
from fenwear.system import Tribosystem

LATE = 1.5  # times the wear from which on meshes follow, at most at the end of a jump of several cycles


def jump(
    system: Tribosystem,
    half_cycles: int,
    *,
    tolerance: float,
    periodic_within: float | None = None,
    start: RunState | None = None,
) -> Iterator[Block]:
    """Yield the last cycle of every jump, in blocks; collective.

    Args:
        system: The assembled problem.
        half_cycles: Where to end, a whole number of cycles.
        tolerance: Largest estimated error of one jump, see `fenwear.steps.jump_method.Estimate`.
        periodic_within: Fraction of the pressure scale by which the pressure changes in a cycle where the run ends.
        start: State to continue from, such as the end of a block; by default the beginning.

    Raises:
        CaseError: `start` lies within a cycle, or the maps of the heat do not fit into the memory.
        ConvergenceError: the shortest jump did not converge; what came before it is yielded.
    """
    return jump_within(system, RunLimits(half_cycles, periodic_within), tolerance=tolerance, start=start)


def jump_within(
    system: Tribosystem, limits: RunLimits, *, tolerance: float, start: RunState | None = None, finer: bool = False
) -> Iterator[Block]:
    """Yield the last cycle of every jump, as `jump`, within limits; collective.

    Args:
        system: The assembled problem.
        limits: End, loads and stops.
        tolerance: As of `jump`.
        start: As of `jump`.
        finer: Whether to follow where jumps of next to no length would lead; from a start that has it, it is followed.
    """
    strokes = system.motion.half_cycles
    if start is not None and start.half_cycle % strokes:
        message = f"jumps start from a whole cycle only, got half-cycle {start.half_cycle}"
        raise CaseError(InputError("run.integration", message))
    watching = Watching(system.team, limits.watch)
    step: Jumps = system.contact_law.jumps(system, tolerance, watching, limits.loading)
    state = on_exchange(start or beginning(step.system), step.system.exchange)  # before rank 0 leads
    if finer and state.finer is None:
        state = replace(state, finer=state)
    stops = frozenset(-(-stop // strokes) * strokes for stop in limits.stops)
    limits = replace(limits, half_cycles=limits.half_cycles // strokes * strokes, stops=stops, watch=watching)
    system.wear_on_meshes(state.worn)  # before rank 0 leads: the elements' heights take all ranks
    yield from run_steps(step.system, partial(_on_meshes, system, step), state, limits)


def _on_meshes(system: Tribosystem, step: Jumps, state: RunState, until: int) -> tuple[RunState, list[HalfCycle]]:
    """Return the state and the records of a jump, shortened where it wears far more than meshes are to follow."""
    after, recorded = step(state, until)
    before, worn = (system.team.lead(partial(system.wear_on_meshes, one.worn)) for one in (state, after))
    strokes = system.motion.half_cycles
    cycles = (after.half_cycle - state.half_cycle) // strokes
    if worn <= LATE or before > 1 or cycles == 1:  # beyond it already: nobody has them follow
        return after, recorded
    fewer = ceil(cycles * max((1 + LATE) / 2 - before, 0.0) / (worn - before))
    return step(state, state.half_cycle + strokes * max(fewer, 1)) if fewer < cycles else (after, recorded)
