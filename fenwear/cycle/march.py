"""Half-cycle by half-cycle: heat, contact, wear, and the next half-cycle the other way."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from fenwear.assembly import Tribosystem
from fenwear.cycle.block import Block
from fenwear.cycle.driver import BLOCK, Loading, RunLimits, Watch, Watching, as_given, run_steps, unwatched
from fenwear.cycle.state import RunState, beginning, on_exchange


def march(
    system: Tribosystem,
    half_cycles: int,
    *,
    implicit: bool = False,
    periodic_within: float | None = None,
    block: int = BLOCK,
    start: RunState | None = None,
    stops: frozenset[int] = frozenset(),
    leave: Callable[[RunState], bool] = lambda _: False,
    watch: Watch = unwatched,
    loading: Loading = as_given,
) -> Iterator[Block]:
    """Yield all half-cycles, in blocks; collective.

    The explicit step wears the surface by the pressure on the shape at its start, as in the paper;
    the implicit one by the pressure on the shape at its end, and is stable for any step.

    Args:
        system: The assembled problem.
        half_cycles: The last one at most.
        implicit: Which of the two steps.
        periodic_within, block, stops, leave, watch: As of `fenwear.cycle.driver.RunLimits`.
        start: Where to go on from, such as the end of a block; by default the beginning.
        loading: Factor of all loads; that in the middle of a half-cycle acts in it.

    Raises:
        ConvergenceError: a half-cycle, which it names, did not converge; all before it are yielded.
        InterruptedRunError: as `watch`.
    """
    state = on_exchange(start or beginning(system), system.exchange)  # before rank 0 leads
    watching = Watching(system.team, watch)
    course = RunLimits(half_cycles, periodic_within, block, stops, leave, watching)
    step = system.contact_law.half_cycles(system, watching, loading, implicit=implicit)
    yield from run_steps(system, step, state, course)
