"""Cycle jumps: N cycles in one implicit step, N chosen by an error estimate; the law of contact says how.

The error of all jumps of a run differs from the sum of their errors: a jump takes on what those before
it have left, and wear evens it out. Beside a state y a run may have its `finer`, y - e, where e continues as the next
jump takes it, and that jump's own error is added (the global error by local extrapolation beside the solution, as of R.
D. Skeel, BIT 26, 1986): how fast errors fade is found by the jumps themselves.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from math import ceil

from fenwear.common.errors import CaseError, InputError
from fenwear.steps.block import Block, HalfCycle
from fenwear.steps.driver import BLOCK, Jumps, Loading, RunLimits, Watch, Watching, as_given, run_steps, unwatched
from fenwear.steps.run_state import RunState, beginning, on_exchange
from fenwear.system import Tribosystem

LATE = 1.5  # times the wear from which on meshes follow, at most at the end of a jump of several cycles


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
    finer: bool = False,
) -> Iterator[Block]:
    """Yield the last cycle of every jump, in blocks; collective.

    Args:
        system: The assembled problem.
        half_cycles: Where to end, a whole number of cycles.
        tolerance: Largest estimated error of one jump, see `fenwear.steps.jump_method.Estimate`.
        periodic_within, block, leave, watch: As of `fenwear.steps.driver.RunLimits`; the change per cycle counts.
        start: State to continue from, such as the end of a block; by default the beginning.
        stops: Half-cycles at which a jump and a block end in any case, or the cycle they are in.
        loading: Factor of all loads, continuous: a stage takes that of its own time, so that the error estimate
            sees how it changes.
        finer: Whether to follow where jumps of next to no length would lead; from a start that has it, it is followed.

    Raises:
        CaseError: `start` lies within a cycle, or the maps of the heat do not fit into the memory.
        ConvergenceError: the shortest jump did not converge; what came before it is yielded.
        InterruptedRunError: as `watch`.
    """
    strokes = system.motion.half_cycles
    if start is not None and start.half_cycle % strokes:
        message = f"jumps start from a whole cycle only, got half-cycle {start.half_cycle}"
        raise CaseError(InputError("run.integration", message))
    watching = Watching(system.team, watch)
    step: Jumps = system.contact_law.jumps(system, tolerance, watching, loading)
    state = on_exchange(start or beginning(step.system), step.system.exchange)  # before rank 0 leads
    if finer and state.finer is None:
        state = replace(state, finer=state)
    whole = frozenset(-(-stop // strokes) * strokes for stop in stops)
    course = RunLimits(half_cycles // strokes * strokes, periodic_within, block, whole, leave, watching)
    system.wear_on_meshes(state.worn)  # before rank 0 leads: the elements' heights take all ranks
    yield from run_steps(step.system, partial(_on_meshes, system, step), state, course)


def _on_meshes(system: Tribosystem, step: Jumps, state: RunState, until: int) -> tuple[RunState, list[HalfCycle]]:
    """Return what a jump does; one that wears far more than meshes are to follow ends about where they are to."""
    after, recorded = step(state, until)
    before, worn = (system.team.lead(partial(system.wear_on_meshes, one.worn)) for one in (state, after))
    strokes = system.motion.half_cycles
    cycles = (after.half_cycle - state.half_cycle) // strokes
    if worn <= LATE or before > 1 or cycles == 1:  # beyond it already: nobody has them follow
        return after, recorded
    fewer = ceil(cycles * max((1 + LATE) / 2 - before, 0.0) / (worn - before))
    return step(state, state.half_cycle + strokes * max(fewer, 1)) if fewer < cycles else (after, recorded)
