"""The state of a run between two half-cycles: all that its continuation needs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fenwear.common.arrays import Array, Mask
from fenwear.contact import ContactState
from fenwear.heat.heat_exchange import HeatExchange
from fenwear.heat.temperature import HeatState
from fenwear.laws.wear import WornDepths
from fenwear.steps.run_totals import Totals, none_yet
from fenwear.system import Tribosystem, carried, node_maps, on_nodes


@dataclass(frozen=True)
class RunState:
    """The state at the end of a half-cycle.

    Attributes:
        half_cycle: Number of the half-cycle; 0 before the first.
        worn: Worn depths of both bodies.
        contacts: The last contact of each phase; unsolved where there was none yet.
        temperature: Of both bodies; None without heat.
        totals: Totals of all half-cycles so far.
        jump_length: Cycles that the next jump tries; below 1 a part of one, with stick alone.
        periodic_phases: Half-cycles in a row that repeated.
        memory: Memory of the law of contact; a data class of arrays, numbers and such classes.
        finer: Where jumps of next to no length would have led, to the next order, see `fenwear.steps.cycle_jumps`; None
            where nobody asks.
    """

    half_cycle: int
    worn: WornDepths
    contacts: tuple[ContactState, ...]
    temperature: HeatState | None
    totals: Totals
    jump_length: float = 1
    periodic_phases: int = 0
    memory: Any = None
    finer: RunState | None = None


def with_phases(state: RunState | None, count: int) -> RunState | None:
    """Return the state for a motion of so many phases: the contacts of another number of them are of no use."""
    if state is None or len(state.contacts) == count:
        return state
    contacts = (ContactState.unsolved(len(state.worn.punch)),) * count
    return replace(state, contacts=contacts, periodic_phases=0, finer=with_phases(state.finer, count))


def beginning(system: Tribosystem, temperature: HeatState | None = None) -> RunState:
    """Return the unworn bodies at a temperature, by default the initial one."""
    contacts = (ContactState.unsolved(len(system.pair.weights)),) * len(system.motion.phases)
    return RunState(0, system.unworn(), contacts, temperature, none_yet(system))


def on_exchange(state: RunState, exchange: HeatExchange) -> RunState:
    """Return the state with its temperatures on the bases of an exchange; collective."""
    finer = None if state.finer is None else on_exchange(state.finer, exchange)
    return replace(state, temperature=exchange.own(state.temperature) if exchange.conducts else None, finer=finer)


def carried_by(state: RunState) -> Mask:
    """Return the nodes of the punch that touch in some phase or have worn (n,)."""
    touched = [contact.pressure[0] > 0 for contact in state.contacts]
    return np.asarray(np.any([state.worn.punch > 0, *touched], axis=0))


def on_other_grid(state: RunState, before: Tribosystem, after: Tribosystem) -> RunState:
    """Return the state on another contact grid; worn volumes are kept."""
    nodes, _ = node_maps(before, after)
    none, totals = np.zeros(len(nodes)), state.totals
    contacts = [
        replace(one, pressure=on_nodes(one.pressure, nodes, none), gap=on_nodes(one.gap, nodes, after.pair.initial_gap))
        for one in state.contacts
    ]
    return replace(
        state,
        worn=carried(state.worn, before, after),
        memory=None if state.memory is None else after.contact_law.on_other_grid(state.memory, before, after),
        contacts=tuple(contacts),
        totals=replace(
            totals, energy=on_nodes(totals.energy, nodes, none), pressure=on_nodes(totals.pressure, nodes, none)
        ),
        finer=None if state.finer is None else on_other_grid(state.finer, before, after),
    )


def all_phases(contacts: tuple[ContactState, ...]) -> ContactState:
    """Return the contacts of all phases as one state; of no phases unless all are solved."""
    if not all(contact.solved for contact in contacts):
        return ContactState(*(np.zeros((0, 0)),) * 3, 0)
    pressure, gap, rigid = (np.concatenate([getattr(c, n) for c in contacts]) for n in ("pressure", "gap", "rigid"))
    return ContactState(pressure, gap, rigid, max(c.iterations for c in contacts))


def parted(contact: ContactState) -> tuple[ContactState, ...]:
    """Return the contact of each phase of a state."""
    return tuple(
        ContactState(contact.pressure[k : k + 1], contact.gap[k : k + 1], contact.rigid[k : k + 1], contact.iterations)
        for k in range(len(contact.pressure))
    )


def pressure_scale(system: Tribosystem, pressure: Array) -> float:
    """Return the pressure where the load is carried, integral of p^2 over integral of p, MPa.

    Its own mean weighted by itself: uniform pressure gives itself, and surface that carries nothing, however
    much of it is drawn, changes nothing.

    Args:
        system: The assembled problem.
        pressure: Of one or more phases (n,) or (m, n), MPa.
    """
    return float(pressure_scales(system, np.atleast_2d(pressure)[None])[0])


def pressure_scales(system: Tribosystem, pressure: Array) -> Array:
    """Return the pressure scales (k,), MPa, of k half-cycles, each of all its phases: pressures (k, m, n), MPa."""
    weights = system.pair.weights
    force = (np.abs(pressure) * weights).sum(axis=(1, 2))
    carried = (pressure**2 * weights).sum(axis=(1, 2))
    loaded = force > 0
    return np.where(loaded, carried / np.where(loaded, force, 1.0), system.interface.pressure_scale)
