"""The loop that marches and jumps share: steps, blocks, stops, the end, and what interrupts it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple, Protocol

from fenwear.common.errors import CaseError, ConvergenceError, InterruptedRunError
from fenwear.common.parallel import Team
from fenwear.steps.block import Block, HalfCycle, Recorder
from fenwear.steps.run_state import RunState
from fenwear.system import Tribosystem, led

BLOCK = 200  # half-cycles

# Asked between solves, on all ranks together: true where the block is to end, InterruptedRunError where all is.
Watch = Callable[[], bool]
LOOK = 0.05  # s between two looks of all ranks while one leads


# The factor of all loads after a number of half-cycles, which need not be whole.
Loading = Callable[[float], float]


def as_given(_half_cycles: float) -> float:
    """Leave the loads as the case has them."""
    return 1.0


def unwatched() -> bool:
    """Watch nothing."""
    return False


class Watching:
    """Has all ranks look together, now and then where one leads.

    Args:
        team: The ranks.
        watch: Where they look.
    """

    def __init__(self, team: Team, watch: Callable[[], object]) -> None:
        self._team, self._watch, self._looked = team, watch, time.monotonic()
        team.serve(self)

    def __call__(self) -> bool:
        """Look; return whether the block is to end.

        Raises:
            InterruptedRunError: all is to end.
        """
        if self._watch is unwatched:
            return False
        if not self._team.leads:
            return self.look()
        if time.monotonic() < self._looked + LOOK:
            return False
        due = self._team.each(self, "look")
        self._looked = time.monotonic()
        return bool(due)

    def look(self) -> bool:
        """Look at once; collective."""
        return bool(self._watch())


class Step(Protocol):
    """Goes on by a half-cycle, or by a jump."""

    def __call__(self, state: RunState, until: int, /) -> tuple[RunState, list[HalfCycle]]:
        """Return the state after a step that ends at half-cycle `until` at the latest, and what to record of it."""


class Jumps(Step, Protocol):
    """Goes on by jumps."""

    @property
    def system(self) -> Tribosystem:
        """With its heat on bases as jumps need them."""


@dataclass(frozen=True)
class RunLimits:
    """End of the run, and stops on the way.

    Attributes:
        half_cycles: The last one at most.
        periodic_within: Stop when in a whole cycle the pressure differs from the cycle before by less than this
            fraction of the pressure scale.
        block: Half-cycles in a block.
        stops: Half-cycles at which a block ends in any case, and a jump, or the cycle that they are in.
        leave: Ends the run at the first state for which it is true.
        watch: Asked between solves.
        loading: Factor of all loads, continuous: a half-cycle has that of its middle, a stage of a jump that of its own
            time, so that the error estimate sees how it changes.
    """

    half_cycles: int
    periodic_within: float | None = None
    block: int = BLOCK
    stops: frozenset[int] = frozenset()
    leave: Callable[[RunState], bool] = lambda _: False
    watch: Watch = unwatched
    loading: Loading = as_given


def run_steps(system: Tribosystem, step: Step, state: RunState, limits: RunLimits) -> Iterator[Block]:
    """Yield the half-cycles that the steps record, in blocks; collective.

    Rank 0 computes a block for all, wherever no step of it needs them. A failure comes after all that was done before
    it: the block is yielded, then it is raised.

    Raises:
        ConvergenceError: a step, whose half-cycle it names, did not converge.
        InterruptedRunError: what watches has ended the run within a step.
    """
    system.team.serve(system)
    stretches = _Stretches(system, step, state.half_cycle, limits)
    while state.half_cycle < limits.half_cycles:
        done = led(system, partial(stretches.next, state))
        state = done.state
        if done.block is not None:
            yield done.block
        if done.failure is not None:
            raise done.failure
        if done.finished:
            return


class _Stretch(NamedTuple):
    """Results: a block, the state at its end, whether all is, and the error that ended it."""

    block: Block | None
    state: RunState
    finished: bool = False
    failure: Exception | None = None


class _Stretches:
    """Goes on block by block."""

    def __init__(self, system: Tribosystem, step: Step, begin: int, limits: RunLimits) -> None:
        self.system, self.step, self.limits = system, step, limits
        self._recorder = Recorder(system, limits.block)
        self._ends = sorted({stop for stop in limits.stops if stop > begin} | {limits.half_cycles})

    def next(self, state: RunState) -> _Stretch:
        """Return the next block."""
        recorder, limits = self._recorder, self.limits
        while True:
            until = next(end for end in self._ends if end > state.half_cycle)
            try:
                after, recorded = self.step(state, until)
            except (ConvergenceError, InterruptedRunError) as error:
                self.system.case.names.tell(error)
                failure: Exception = error
                if isinstance(error, ConvergenceError) and not isinstance(error, CaseError):
                    failure = type(error)(f"half-cycle {state.half_cycle + 1}: {error}")
                    failure.__cause__ = error
                return _Stretch(recorder.take(state) if recorder else None, state, failure=failure)
            periodic, state = self._recorded(recorded, state.periodic_phases), after
            if state.periodic_phases != periodic:
                state = replace(state, periodic_phases=periodic)
            finished = state.periodic_phases >= self.system.motion.half_cycles or limits.leave(state)
            try:
                due = limits.watch()
            except InterruptedRunError as error:
                return _Stretch(recorder.take(state), state, failure=error)
            if due or recorder.full or finished or state.half_cycle in self._ends:
                return _Stretch(recorder.take(state), state, finished)

    def _recorded(self, recorded: list[HalfCycle], periodic: int) -> int:
        """Record half-cycles; return how many in a row have repeated, from those before them."""
        recorder, limit, team = self._recorder, self.limits.periodic_within, self.system.team
        for half_cycle in recorded:
            recorder.add(half_cycle)
            repeats = limit is not None and team.lead(lambda: recorder.change() < limit)
            periodic = periodic + 1 if repeats else 0
        return periodic
