"""Half-cycle by half-cycle: heat, contact, wear, and the next half-cycle the other way."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import reduce

from fenwear.assembly import Tribosystem
from fenwear.cycle.block import Block, HalfCycleHeat, Recorder
from fenwear.cycle.moment import Moment, beginning
from fenwear.cycle.phase import PhaseEnd, PhaseStep
from fenwear.cycle.retry import SmallerSteps
from fenwear.errors import ConvergenceError

BLOCK = 200


def march(
    system: Tribosystem,
    half_cycles: int,
    *,
    implicit: bool = False,
    periodic_within: float | None = None,
    block: int = BLOCK,
    start: Moment | None = None,
    stops: frozenset[int] = frozenset(),
    leave: Callable[[Moment], bool] = lambda _: False,
) -> Iterator[Block]:
    """Yield all half-cycles, in blocks; collective.

    The explicit step wears the surface by the pressure on the shape at its start, as in the paper;
    the implicit one by the pressure on the shape at its end, and is stable for any step.

    Args:
        system: The assembled problem.
        half_cycles: The last one at most.
        implicit: Which of the two steps.
        periodic_within: Stop when in a whole cycle the pressure differs from the cycle before by
            less than this fraction of the mean pressure.
        block: Half-cycles in a block.
        start: Where to go on from, such as the end of a block; by default the beginning.
        stops: Half-cycles at which a block ends in any case.
        leave: Ends the run at the first moment for which it is true.

    Raises:
        ConvergenceError: a half-cycle, which it names, did not converge; all before it are yielded.
    """
    motion, exchange = system.motion, system.exchange
    steps = [PhaseStep(system, phase, implicit=implicit) for phase in range(len(motion.phases))]
    moment = start or beginning(system, None if exchange is None else exchange.initial())
    smaller = SmallerSteps(system, implicit=implicit)
    recorder = Recorder(system, block)
    for half_cycle in range(moment.half_cycle + 1, half_cycles + 1):
        first = (half_cycle - 1) % motion.half_cycles * motion.positions
        phases = range(first, first + motion.positions)
        try:
            ends = _half_cycle(steps, moment, phases, smaller)
        except ConvergenceError as error:
            if recorder:
                yield recorder.take(moment)
            raise ConvergenceError(f"half-cycle {half_cycle}: {error}") from error
        worn, contacts = moment.worn, list(moment.contacts)
        for phase, end in zip(phases, ends, strict=True):
            worn, contacts[phase] = worn + end.worn, end.record.contact
        heats = [end.heat for end in ends if end.heat is not None]
        heat = reduce(HalfCycleHeat.then, heats) if heats else None
        change = recorder.add(half_cycle, [end.record for end in ends], worn, heat)
        repeats = periodic_within is not None and change < periodic_within
        periodic = moment.periodic_phases + 1 if repeats else 0
        moment = Moment(half_cycle, worn, tuple(contacts), ends[-1].temperature, periodic_phases=periodic)
        finished = periodic >= motion.half_cycles or leave(moment)
        if recorder.full or finished or half_cycle == half_cycles or half_cycle in stops:
            yield recorder.take(moment)
        if finished:
            return


def _half_cycle(steps: Sequence[PhaseStep], moment: Moment, phases: range, smaller: SmallerSteps) -> list[PhaseEnd]:
    """Return the ends of the phases of a half-cycle, in smaller steps where it must be."""
    worn, temperature, ends = moment.worn, moment.temperature, []
    try:
        for phase in phases:
            end = steps[phase].solve(temperature, worn, moment.contacts[phase])
            worn, temperature = worn + end.worn, end.temperature
            ends.append(end)
    except ConvergenceError as error:
        return smaller.half_cycle(moment, phases, error)
    return ends
