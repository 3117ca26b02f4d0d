"""Half-cycle by half-cycle: heat, contact, wear, and the next half-cycle the other way."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import reduce

from fenwear.assembly import Tribosystem
from fenwear.cycle.block import Block, HalfCycleHeat
from fenwear.cycle.driver import BLOCK, Course, HalfCycle, Loading, Watch, Watching, as_given, drive, unwatched
from fenwear.cycle.phase import PhaseEnd, PhaseStep
from fenwear.cycle.retry import SmallerSteps
from fenwear.cycle.state import RunState, beginning
from fenwear.errors import ConvergenceError


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
        periodic_within, block, stops, leave, watch: As of `fenwear.cycle.driver.Course`.
        start: Where to go on from, such as the end of a block; by default the beginning.
        loading: Factor of all loads; that in the middle of a half-cycle acts in it.

    Raises:
        ConvergenceError: a half-cycle, which it names, did not converge; all before it are yielded.
        InterruptedRunError: as `watch`.
    """
    exchange = system.exchange
    state = start or beginning(system, None if exchange is None else exchange.initial())
    if exchange is not None and state.temperature is not None:
        state = replace(state, temperature=exchange.own(state.temperature))  # before rank 0 leads
    watching = Watching(system.team, watch)
    course = Course(half_cycles, periodic_within, block, stops, leave, watching)
    yield from drive(system, _HalfCycles(system, watching, loading, implicit=implicit), state, course)


class _HalfCycles:
    """Steps of one half-cycle."""

    def __init__(self, system: Tribosystem, watch: Watch, loading: Loading, *, implicit: bool) -> None:
        self.system, self.watch, self.loading = system, watch, loading
        phases = range(len(system.motion.phases))
        self.steps = [PhaseStep(system, phase, implicit=implicit) for phase in phases]
        self.smaller = SmallerSteps(system, implicit=implicit)

    def __call__(self, state: RunState, _until: int, /) -> tuple[RunState, list[HalfCycle]]:
        """Return the state after the next half-cycle, and its record."""
        motion = self.system.motion
        first = state.half_cycle % motion.half_cycles * motion.positions
        phases = range(first, first + motion.positions)
        load = self.loading(state.half_cycle + 0.5)
        try:
            ends = self._whole(state, phases, load)
        except ConvergenceError as error:
            ends = self.smaller.half_cycle(state, phases, error, load)
        worn, totals, contacts = state.worn, state.totals, list(state.contacts)
        for phase, end in zip(phases, ends, strict=True):
            worn, totals, contacts[phase] = worn + end.worn, totals + end.record.adds, end.record.contact
        heats = [end.heat for end in ends if end.heat is not None]
        heat = reduce(HalfCycleHeat.then, heats) if heats else None
        number = state.half_cycle + 1
        after = RunState(number, worn, tuple(contacts), ends[-1].temperature, totals)
        return after, [HalfCycle(number, [end.record for end in ends], worn, totals, heat, load)]

    def _whole(self, state: RunState, phases: range, load: float) -> list[PhaseEnd]:
        """Return the ends of the phases of a half-cycle, each solved as a whole."""
        worn, temperature, ends = state.worn, state.temperature, []
        for place, phase in enumerate(phases):
            if place:
                self.watch()
            done = state.half_cycle + (place + 0.5) / len(phases)
            end = self.steps[phase].solve(temperature, worn, state.contacts[phase], load, done)
            worn, temperature = worn + end.worn, end.temperature
            ends.append(end)
        return ends
