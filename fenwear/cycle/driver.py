"""The loop that marches and jumps share: steps, blocks, stops, the end, and what interrupts it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

from fenwear.assembly import Tribosystem
from fenwear.cycle.block import Block, HalfCycleHeat, PhaseRecord, Recorder
from fenwear.cycle.state import RunState
from fenwear.cycle.totals import Totals
from fenwear.errors import ConvergenceError, InterruptedRunError
from fenwear.parallel import agreed
from fenwear.sliding.wear import Worn

BLOCK = 200  # half-cycles

# Asked between solves, on all ranks together: true where the block is to end, InterruptedRunError where all is.
Watch = Callable[[], bool]


# The factor of all loads after a number of half-cycles, which need not be whole.
Loading = Callable[[float], float]


def as_given(_half_cycles: float) -> float:
    """Leave the loads as the case has them."""
    return 1.0


def unwatched() -> bool:
    """Watch nothing."""
    return False


class HalfCycle(NamedTuple):
    """One half-cycle that is to be recorded."""

    number: int
    phases: Sequence[PhaseRecord]
    worn: Worn
    totals: Totals
    heat: HalfCycleHeat | None
    load: float = 1.0


class Step(Protocol):
    """Goes on by a half-cycle, or by a jump."""

    def __call__(self, state: RunState, until: int, /) -> tuple[RunState, list[HalfCycle]]:
        """Return the state after a step that ends at half-cycle `until` at the latest, and what to record of it."""


@dataclass(frozen=True)
class Course:
    """How far to go, and where to stop on the way.

    Attributes:
        half_cycles: The last one at most.
        periodic_within: Stop when in a whole cycle the pressure differs from the cycle before by less than this
            fraction of the pressure scale.
        block: Half-cycles in a block.
        stops: Half-cycles at which a block ends in any case.
        leave: Ends the run at the first state for which it is true.
        watch: Asked between solves.
    """

    half_cycles: int
    periodic_within: float | None = None
    block: int = BLOCK
    stops: frozenset[int] = frozenset()
    leave: Callable[[RunState], bool] = lambda _: False
    watch: Watch = unwatched


def drive(system: Tribosystem, step: Step, state: RunState, course: Course) -> Iterator[Block]:
    """Yield the half-cycles that the steps record, in blocks; collective.

    A failure comes after all that was done before it: the block is yielded, then it is raised.

    Raises:
        ConvergenceError: a step, whose half-cycle it names, did not converge.
        InterruptedRunError: what watches has ended the run within a step.
    """
    recorder = Recorder(system, course.block)
    ends = sorted({stop for stop in course.stops if stop > state.half_cycle} | {course.half_cycles})
    while state.half_cycle < course.half_cycles:
        until = next(end for end in ends if end > state.half_cycle)
        try:
            after, recorded = step(state, until)
        except (ConvergenceError, InterruptedRunError) as error:
            if recorder:
                yield recorder.take(state)
            if isinstance(error, InterruptedRunError):
                raise
            raise type(error)(f"half-cycle {state.half_cycle + 1}: {error}") from error
        periodic = state.periodic_phases
        for one in recorded:
            recorder.add(one.number, one.phases, one.worn, one.totals, one.heat, one.load)
            limit = course.periodic_within
            repeats = limit is not None and agreed(system.comm, recorder.change() < limit)
            periodic = periodic + 1 if repeats else 0
        state = replace(after, periodic_phases=periodic)
        finished = periodic >= system.motion.half_cycles or course.leave(state)
        try:
            due = course.watch()
        except InterruptedRunError:
            yield recorder.take(state)
            raise
        if due or recorder.full or finished or state.half_cycle in ends:
            yield recorder.take(state)
        if finished:
            return
