"""Half-cycle by half-cycle: heat, contact, wear, and the next half-cycle the other way."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from fenwear.arrays import Array
from fenwear.contact import ContactState
from fenwear.cycle.block import Block, HalfCycleHeat, Recorder
from fenwear.cycle.moment import Moment, beginning
from fenwear.cycle.thermal import ThermalContact
from fenwear.errors import ConvergenceError
from fenwear.heat.exchange import State
from fenwear.system import System
from fenwear.wear import WornLayer

BLOCK = 200
# Of a phase: temperature at the start, gap, the same phase one cycle ago -> contact, temperature, heat.
Solve = Callable[
    [int, State | None, Array, ContactState | None], tuple[ContactState, State | None, HalfCycleHeat | None]
]


def march(
    system: System,
    half_cycles: int,
    *,
    implicit: bool = False,
    periodic_within: float | None = None,
    block: int = BLOCK,
    start: Moment | None = None,
    stops: frozenset[int] = frozenset(),
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

    Raises:
        ConvergenceError: a half-cycle, which it names, did not converge; all before it are yielded.
    """
    directions = system.motion.directions
    solve = _solver(system, implicit)
    exchange = system.exchange
    moment = start or beginning(system, None if exchange is None else exchange.initial())
    gap0, contacts = system.facing.initial_gap, list(moment.contacts)
    wear, temperature, periodic_phases = moment.wear, moment.temperature, moment.periodic_phases
    recorder = Recorder(system, block)
    for half_cycle in range(moment.half_cycle + 1, half_cycles + 1):
        phase = (half_cycle - 1) % len(directions)
        before = contacts[phase]
        try:
            contact, temperature, heat = solve(phase, temperature, gap0 + wear, before)
        except ConvergenceError as error:
            if recorder:
                yield recorder.take(moment)
            raise ConvergenceError(f"half-cycle {half_cycle}: {error}") from error
        worn = system.wear.depth(contact.pressure[0])
        wear = wear + worn
        contacts[phase] = contact
        previous = None if before is None else before.pressure[0]
        change = recorder.add(half_cycle, directions[phase], 0, contact, wear, worn, previous, heat)
        periodic_phases = periodic_phases + 1 if periodic_within is not None and change < periodic_within else 0
        finished = periodic_phases >= len(directions)
        moment = Moment(half_cycle, wear, tuple(contacts), temperature, periodic_phases=periodic_phases)
        if recorder.full or finished or half_cycle == half_cycles or half_cycle in stops:
            yield recorder.take(moment)
        if finished:
            return


def _solver(system: System, implicit: bool) -> Solve:
    """Return what solves a half-cycle of a phase: contact alone, or contact with heat."""
    layer = WornLayer(system.wear) if implicit else None
    exchange = system.exchange
    if exchange is None:
        contacts = [system.contact((d,)) for d in system.motion.directions]
        return lambda phase, _, gap, start: (contacts[phase].solve(gap, start, layer), None, None)
    thermal = [ThermalContact(system, exchange, phase) for phase in range(len(system.motion.directions))]
    initial = exchange.initial()
    return lambda phase, temperature, gap, start: thermal[phase].solve(temperature or initial, gap, start, layer)
