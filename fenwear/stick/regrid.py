"""Where a run with stick is, on another contact grid: tractions, slips and states stay at their nodes.

What surfaces are moved by is that of the tractions there, as the next time step has it: what sticks goes on to stick.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.assembly import on_nodes
from fenwear.sliding.wear import WornDepths
from fenwear.stick.cycle import PartialSlipProblem
from fenwear.stick.state import PartialSlipState


def on_other_grid(
    at: PartialSlipState,
    before: PartialSlipProblem,
    after: PartialSlipProblem,
    nodes: NDArray[np.int64],
    worn: WornDepths,
) -> PartialSlipState:
    """Return where a run is on another grid; for rank 0 that leads.

    Args:
        at: Where it is, between half-cycles.
        before, after: The bodies on both grids, and what is done to them.
        nodes: The old node of each new one (n_new,), -1 for none.
        worn: Depths there.
    """
    interface, contact, step = after.interface, at.contact, after.program.steps[at.next_step - 1]
    position = interface.position(step.offset)
    loaded = after.expanded(interface.loaded(step.fraction).times(at.load), step.offset)
    opening, pressure = after.opening(position, worn), _at(contact.pressure, nodes)
    traction = _along(contact.traction, nodes)
    force, back = position.forces(np.concatenate([pressure, traction.T.ravel()]))
    beside = None
    if contact.beside is not None:
        old = before.interface.position(before.program.steps[at.next_step - 1].offset)
        beside = _affine(old.pair.punch.x, contact.beside, position.pair.punch.x)
    state = replace(
        contact,
        pressure=pressure,
        traction=traction,
        gap=on_nodes(contact.gap, nodes, opening),
        slip=_along(contact.slip, nodes),
        approach=_at(contact.approach, nodes),
        on_punch=loaded.on_punch + interface.punch.apply(force),
        on_strip=loaded.on_strip + at.imposed.strain * interface.bulk - interface.strip.apply(back),
        trial=_along(contact.trial, nodes),
        crept=worn.crept,
        beside=beside,
        flowed=None if contact.flowed is None else _at(contact.flowed, nodes),
    )
    return replace(
        at,
        contact=state,
        imposed=replace(at.imposed, loaded=loaded, opening=opening, beside=beside),
        worn=worn,
        pressures=None if at.pressures is None else _known(at.pressures, _at(at.pressures, nodes)),
        trials=None if at.trials is None else _known(at.trials, _along(at.trials, nodes)),
        slid=None if at.slid is None else _at(at.slid, nodes),
        speed=None if at.speed is None else _at(at.speed, nodes),
        slips=None if at.slips is None else _known(at.slips, _along(at.slips, nodes)),
        held=None,
    )


def _at(values: Array, nodes: NDArray[np.int64]) -> Array:
    """Return values (..., n) at other nodes, where none was zero."""
    return on_nodes(values, nodes, np.zeros(len(nodes)))


def _along(values: Array, nodes: NDArray[np.int64]) -> Array:
    """Return vectors (..., n, m) at other nodes, where none was zero."""
    return np.swapaxes(_at(np.swapaxes(values, -1, -2), nodes), -1, -2)


def _known(before: Array, values: Array) -> Array:
    """Return values of time steps, NaN of those that are not known."""
    missing = np.isnan(before).reshape(len(before), -1).any(axis=1)
    return np.where(missing.reshape(-1, *(1,) * (values.ndim - 1)), np.nan, values)


def _affine(x: Array, values: Array, there: Array) -> Array:
    """Return vectors (n, d) that a rigid motion gives points (n, d) at other points."""

    def terms(points: Array) -> Array:
        return np.column_stack([np.ones(len(points)), points])

    found, *_ = np.linalg.lstsq(terms(x), values, rcond=None)
    return np.asarray(terms(there) @ found)
