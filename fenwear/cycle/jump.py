"""Cycle jumps: N cycles in one implicit step, N chosen by an error estimate.

The step is that of `fenwear.cycle.jump_step`. A jump is made whole and in two halves. A third of their
difference is the error estimate of the halves, which are kept: of the depths, of the pressures and of
the temperatures, see `fenwear.cycle.jump_error`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from fenwear.assembly import Tribosystem, property_change
from fenwear.cycle.block import Block
from fenwear.cycle.driver import BLOCK, Course, HalfCycle, Loading, Watch, Watching, as_given, drive, unwatched
from fenwear.cycle.jump_error import ORDER
from fenwear.cycle.jump_step import Stepper
from fenwear.cycle.state import RunState
from fenwear.errors import CaseError, ConvergenceError, InputError
from fenwear.heat.field import HeatState
from fenwear.remedies import SHORTER_JUMPS

WARMED = 2.0  # times heat.property_tolerance that properties may change by in a jump of several cycles
SAFETY, LEAST, MOST = 0.9, 0.2, 5.0  # of the next jump's length over the last one's


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
) -> Iterator[Block]:
    """Yield the last cycle of every jump, in blocks; collective.

    Args:
        system: The assembled problem.
        half_cycles: Where to end, a whole number of cycles.
        tolerance: Largest estimated error of one jump, see `fenwear.cycle.jump_error.Estimate`.
        periodic_within, block, leave, watch: As of `fenwear.cycle.driver.Course`; the change per cycle counts.
        start: Where to go on from, such as the end of a block; by default the beginning.
        stops: Half-cycles at which a jump and a block end in any case, or the cycle they are in.
        loading: Factor of all loads, continuous: a stage takes that of its own time, so that the error estimate
            sees how it changes.

    Raises:
        CaseError: `start` lies within a cycle.
        ConvergenceError: the shortest jump did not converge; what came before it is yielded.
        InterruptedRunError: as `watch`.
    """
    strokes = system.motion.half_cycles
    if start is not None and start.half_cycle % strokes:
        message = f"jumps go on from a whole cycle only, got half-cycle {start.half_cycle}"
        raise CaseError(InputError("run.integration", message))
    watching = Watching(system.team, watch)
    stepper = Stepper(system, tolerance, watching, loading)
    heat, state = stepper.coupled.heat, start or stepper.beginning()
    if heat is not None and state.temperature is not None:
        state = replace(state, temperature=heat.exchange.own(state.temperature))  # before rank 0 leads
    whole = frozenset(-(-stop // strokes) * strokes for stop in stops)
    course = Course(half_cycles // strokes * strokes, periodic_within, block, whole, leave, watching)
    yield from drive(stepper.system, _Jumps(stepper, tolerance), state, course)


class _Jumps:
    """Steps of as many cycles as the tolerance allows, and the materials whose properties change with the warmth."""

    def __init__(self, stepper: Stepper, tolerance: float) -> None:
        self.stepper, self.tolerance = stepper, tolerance
        stepper.system.team.serve(self)

    def change(self, temperature: HeatState | None) -> float:
        """Return the largest change of a property at temperatures; collective."""
        return property_change(self.stepper.system, temperature)

    def __call__(self, state: RunState, until: int, /) -> tuple[RunState, list[HalfCycle]]:
        """Return the state after the next jump that is accurate enough, and its last cycle."""
        stepper, tolerance = self.stepper, self.tolerance
        strokes = stepper.system.motion.half_cycles
        length, left = state.jump_length, (until - state.half_cycle) // strokes
        while True:
            tried = min(length, left)
            try:
                end, estimate = stepper.attempt(state, tried)
            except ConvergenceError:
                if tried == 1:
                    raise
                stepper.system.remedies.note(SHORTER_JUMPS)
                length = max(1, tried // 4)
                continue
            largest = estimate.largest
            factor = SAFETY * (tolerance / max(largest, 1e-300)) ** (1 / (ORDER + 1))
            warmed = tried > 1 and stepper.system.team.each(self, "change", end.temperature) > WARMED
            if (largest <= tolerance and not warmed) or tried == 1:
                break
            # A half is half made already.
            length = max(1, int(tried * min(0.5, max(LEAST, factor))))
        if tried == length or factor < 1:  # a step cut short by an end says little of the next length
            length = max(1, int(tried * min(MOST, max(LEAST, factor))))
            if factor > 1 and tried < 4:
                length = max(length, tried + 1)
        number = state.half_cycle + tried * strokes
        after = RunState(number, end.worn, end.contacts, end.temperature, end.totals, length)
        return after, stepper.last_cycle(state, after, tried)
