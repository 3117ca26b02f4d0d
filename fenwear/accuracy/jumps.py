"""What the jumps of a run have left in its numbers: the end as jumps of next to no length would have it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fenwear.arrays import Array
from fenwear.cycle import Block
from fenwear.cycle.state import RunState, joined


def by_short_jumps(last: Block) -> Block:
    """Return the end of a run as short jumps would have it, see `fenwear.cycle.jump`; as it is where not followed.

    Its last half-cycle alone, and the pressures of the last cycle. With stick temperatures are those of the run, whose
    jumps know of them only how far the last one is off.

    Args:
        last: The last half-cycles.
    """
    end, finer = last.end, last.end.finer
    if finer is None:
        return last
    off, totals = end.worn - finer.worn, end.totals - finer.totals
    found = replace(
        last,
        wear=_last_less(last.wear, off.punch),
        wear_strip=_last_less(last.wear_strip, off.strip),
        totals=replace(last.totals, sums=_last_less(last.totals.sums, totals.sums)),
    )
    if last.steps:
        return _with_steps(found, finer)
    return _with_heat(_with_pressures(found, finer), finer)


def _with_steps(last: Block, finer: RunState) -> Block:
    """Return a block whose last time steps are those of the cycle on other depths."""
    cycle = None if finer.memory is None else finer.memory.cycle
    return last if cycle is None else replace(last, steps=(replace(last.steps[-1], records=cycle.records),))  # type: ignore[type-var]


def _with_pressures(last: Block, finer: RunState) -> Block:
    """Return a block with the pressures of another state in its last cycle."""
    motion, contacts = last.system.motion, [joined(state.contacts) for state in (last.end, finer)]
    if contacts[0] is None or contacts[1] is None:
        return last
    middle = slice(motion.positions // 2, None, motion.positions)
    pressure = last.pressure.copy()
    pressure[-motion.half_cycles :] -= (contacts[0].pressure - contacts[1].pressure)[middle]
    return replace(last, pressure=np.maximum(pressure, 0.0))


def _with_heat(last: Block, finer: RunState) -> Block:
    """Return a block with the temperatures of another state at its end; collective."""
    exchange, heat = last.system.exchange, last.heat
    if heat is None:
        return last
    own, other = (exchange.contact_temperatures(exchange.own(one.temperature)) for one in (last.end, finer))
    punch, strip = own[0] - other[0], own[1] - other[1]
    heat = replace(
        heat,
        temperature_punch=_last_less(heat.temperature_punch, punch),
        temperature_strip=_last_less(heat.temperature_strip, strip),
    )
    return replace(last, heat=heat)


def _last_less(rows: Array, change: Array) -> Array:
    """Return rows whose last one is less by a change."""
    found = rows.copy()
    found[-1] -= change
    return found
