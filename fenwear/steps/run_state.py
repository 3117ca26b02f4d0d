"""The state of a run between two half-cycles: all that its continuation needs.

Totals over all half-cycles of a run, recorded or jumped over: wear, sliding, the work of friction.

In a phase in which the strip moves by ds, mm or rad, its material moves by v_i ds at node i, and along the contact
by r_i ds: v_i = 1 in a translation, and r_i = v_i where the surface is not inclined to the motion.

    sliding distance    s = integral of <v> ds,         <v> = sum w_i p_i v_i / sum w_i p_i, the mean over the load;
    load path           integral of sum w_i p_i r_i ds, N mm: load times s of flat contacts, in scars too;
    load distance       integral of F <v> ds, N mm, F = sum w_i p_i (e_n + tau)_i . e_z the load: what the contact
                        carries along the approach of the bodies, by pressure and friction, as a rig measures it;
    drag distance       integral of |sum w_i p_i tau_i| <v> ds, N mm, of the resultant of friction, tau its traction
                        over the pressure; in a model of rings of its sum all round;
    work of friction    integral of sum w_i mu p_i r_i ds, N mm = mJ;
    energy per area     integral of mu p_i r_i ds, mJ/mm²;
    pressure sum        sum of the mean of p_i over each half-cycle's path, MPa: between two moments, over the
                        half-cycles between them, it is the mean pressure, by what is worn and well posed at edges, too;
    worn volume, mass   sum w_i h_i, sum w_i rho_i h_i of the depths h_i worn in the phase, of each body.

w_i are the nodes' areas, those of the plane times the thickness. On curved contacts the integral of the pressure,
sum w_i p_i, is more than the load. With a = b = 1 volume = beta~ times the load path, whatever the pressure and the
meshes do. A step of a jump adds these as it adds depths.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate
from operator import sub
from typing import Any, TypeVar

import numpy as np

from fenwear.common.arrays import Added, Array, Mask
from fenwear.contact import ContactState
from fenwear.heat.heat_exchange import HeatExchange
from fenwear.heat.temperature import HeatState
from fenwear.laws.friction import ContactConditions
from fenwear.laws.wear import PhasesWear, WornDepths
from fenwear.surfaces import ContactPair, RigidEquilibrium
from fenwear.surfaces.placement import in_model
from fenwear.system import ContactSetup, Tribosystem, carried, node_maps, on_nodes

T = TypeVar("T")
SUMS = (
    "distance", "load_path", "load_distance", "drag_distance", "work", "volume_punch", "mass_punch", "volume_strip",
    "mass_strip",
)  # fmt: skip
AROUND = 0.1  # mean normal of a part of the contact below which it looks all ways
MILLIGRAM = 1e9  # in N s²/mm, a tonne


@dataclass(frozen=True)
class Totals(Added):
    """Totals, of one state or of k of them.

    Attributes:
        sums: By `SUMS` (9,) or (k, 9): mm, N mm, mJ, and mm³ and mg of each body; NaN for a mass without density.
        energy: Dissipated at the contact nodes per area (n,) or (k, n), mJ/mm².
        pressure: Sum of their mean pressures in each half-cycle (n,) or (k, n), MPa.
    """

    sums: Array
    energy: Array
    pressure: Array

    def of(self, name: str) -> Array:
        """Return the sum () or (k,) of this name in `SUMS`."""
        values: Array = self.sums[..., SUMS.index(name)]
        return values


def none_yet(pair: ContactPair) -> Totals:
    """Return the totals at the start: zero."""
    nodes = len(pair.weights)
    return Totals(np.zeros(len(SUMS)), np.zeros(nodes), np.zeros(nodes))


class PhaseMeter:
    """Additions of a phase at a pressure.

    Args:
        system: The bodies.
        phase: Number of the phase.
    """

    def __init__(self, system: ContactSetup, phase: int) -> None:
        pair, slid = system.sliding.pairs[phase], system.sliding.ratio[phase]
        self._areas = system.bodies.punch.thickness * pair.weights
        self._path = system.motion.phases[phase].distance * slid
        positions, phases = system.motion.positions, system.motion.phases
        first = phase // positions * positions
        length = sum(phase.distance for phase in phases[first : first + positions])
        self._share = phases[phase].distance / length if length else 1 / positions  # at rest by the time
        speed = np.linalg.norm(system.sliding.field_of(phase).velocity(pair.opposite), axis=1)
        self._weights, self._moved = pair.weights, pair.weights * system.motion.phases[phase].distance * speed
        self._mean_distance = float(self._moved.sum() / pair.weights.sum())  # where nothing presses
        self._approach = approach(system.rigids[phase])
        unknown = np.full(len(slid), np.nan)
        self._weigh = [
            np.array([self._areas, unknown if density is None else MILLIGRAM * density * self._areas])
            for density in opposite_densities(system, phase)
        ]
        normal, none = pair.normal, np.zeros(len(slid))
        bare = system.phases.ratio_in_space(phase, none)
        along = system.phases.ratio_in_space(phase, none + 1) - bare  # of a unit of mu
        pressing, dragging = normal + in_model(bare, normal.shape[1]), in_model(along, normal.shape[1])
        carried, dragged = (np.einsum("id,id->i", force, self._approach) for force in (pressing, dragging))
        path, areas = self._areas * self._path, self._areas
        # What is linear in the pressure, and in mu times it: each with what friction drags along the three axes.
        self._by_pressure = np.array([self._weights, self._moved, path, areas * carried, *(areas * bare.T)])
        self._by_friction = np.array([path, areas * dragged, *(areas * along.T)])

    def __call__(self, pressure: Array, mu: Array, wear: PhasesWear) -> Totals:
        """Return the additions of the phase.

        Args:
            pressure: At the nodes (n,), MPa.
            mu: Friction coefficient there (n,).
            wear: Of this phase alone.
        """
        rubbed = mu * pressure
        parts = [*map(float, self._by_pressure @ pressure), *map(float, self._by_friction @ rubbed)]
        for body_wear, weigh in zip((wear.punch, wear.strip), self._weigh, strict=True):
            parts += (weigh @ body_wear.depth(pressure[None])[0]).tolist()
        force, moved, path, carried, x, y, z, work, dragged, by_x, by_y, by_z, *worn = parts
        distance = moved / force if force else self._mean_distance
        drag = math.hypot(x + by_x, y + by_y, z + by_z)
        sums = np.array([distance, path, (carried + dragged) * distance, drag * distance, work, *worn])
        return Totals(sums, self._path * rubbed, self._share * pressure)


def with_coated(system: ContactSetup, totals: Totals, lost: WornDepths) -> Totals:
    """Return totals to which coated bodies add their worn volume and mass by the depths themselves.

    Args:
        system: The bodies.
        totals: Other additions.
        lost: Depths worn meanwhile.
    """
    return with_worn(system, totals, lost, [bool(coating.any()) for coating in system.laws.coatings])


def with_worn(system: ContactSetup, totals: Totals, lost: WornDepths, counts: Sequence[bool] = (True, True)) -> Totals:
    """Return totals with the worn volume and mass of the bodies that count by these depths."""
    sums = totals.sums.copy()
    rows = zip(
        ("punch", "strip"), counts, (system.pair.weights, system.pair.strip.weights), (lost.punch, lost.strip),
        system.bodies.densities, strict=True,
    )  # fmt: skip
    for body, counted, weights, depth, density in rows:
        if counted:
            areas, first = system.bodies.punch.thickness * weights, SUMS.index(f"volume_{body}")
            mass = np.nan if density is None else float(MILLIGRAM * (areas * density) @ depth)
            sums[first : first + 2] = float(areas @ depth), mass
    return Totals(sums, totals.energy, totals.pressure)


def approach(rigid: RigidEquilibrium) -> Array:
    """Return the way in which the load acts at each node (n, d).

    It is the translation of the bodies that brings them together. Parts of the contact that supports hold against that,
    or that turn about a hinge, are pressed along their mean normal; along each normal where these add up to nothing,
    as around a whole bore.
    """
    along, pair = rigid.approach, rigid.pair
    directions = np.zeros_like(pair.normal) if along is None else along.copy()
    for k in range(pair.punch.part.max() + 1):
        in_part = pair.punch.part == k
        if np.abs(directions[in_part]).max() > 0:
            continue
        mean = pair.weights[in_part] @ pair.normal[in_part] / pair.weights[in_part].sum()
        size = np.linalg.norm(mean)
        directions[in_part] = mean / size if size > AROUND else pair.normal[in_part]
    return directions


def phase_totals(system: ContactSetup, pressure: Array, conditions: Sequence[ContactConditions]) -> list[Totals]:
    """Return the additions of each phase of a cycle at pressures (m, n), with coefficients at their conditions.

    Raises:
        CaseError: a coefficient is negative or not finite there.
    """
    wear = system.phases.wear.phases(conditions)
    return [
        PhaseMeter(system, k)(pressure[k], system.laws.friction.values(state), wear.some([k]))
        for k, state in enumerate(conditions)
    ]


def cycle_totals(system: ContactSetup, pressure: Array, conditions: Sequence[ContactConditions]) -> Totals:
    """Return the additions of a cycle, as `phase_totals`."""
    return sum(phase_totals(system, pressure, conditions), none_yet(system.pair))


def stacked(totals: Sequence[Totals]) -> Totals:
    """Return k totals as one of k rows."""
    return Totals(*(np.array([getattr(t, name) for t in totals]) for name in ("sums", "energy", "pressure")))


def counted_back(end: T, added: Sequence[T]) -> list[T]:
    """Return depths or totals at the ends of half-cycles, from the last end and the additions of each half-cycle."""
    return list(accumulate(reversed(added[1:]), sub, initial=end))[::-1]


def opposite_densities(system: ContactSetup, phase: int) -> tuple[Array | None, Array | None]:
    """Return the densities of punch and strip at the contact nodes in a phase, N s²/mm⁴."""
    pair, (punch, strip) = system.sliding.pairs[phase], system.bodies.densities
    if strip is None:
        return punch, None
    nodes = pair.strip.weights
    if system.sliding.track is not None:
        return punch, np.full(len(pair.weights), float(nodes @ strip) / float(nodes.sum()))
    return punch, (pair.wear_projection.T @ (nodes * strip)) / pair.weights


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
        finer: Where jumps of next to no length would have led, to the next order, see `fenwear.steps.evolve`; None
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
    return RunState(0, system.unworn(), contacts, temperature, none_yet(system.pair))


def on_exchange(state: RunState, exchange: HeatExchange) -> RunState:
    """Return the state with its temperatures on the bases of an exchange; collective."""
    finer = None if state.finer is None else on_exchange(state.finer, exchange)
    return replace(state, temperature=exchange.on_bases(state.temperature) if exchange.conducts else None, finer=finer)


def carried_by(state: RunState) -> Mask:
    """Return the nodes of the punch that touch in some phase or have worn (n,)."""
    touched = [contact.pressure[0] > 0 for contact in state.contacts]
    return np.asarray(np.any([state.worn.punch > 0, *touched], axis=0))


def on_other_grid(state: RunState, before: Tribosystem, after: Tribosystem) -> RunState:
    """Return the state on another contact grid; worn volumes are kept."""
    nodes, _ = node_maps(before, after)
    none, totals = np.zeros(len(nodes)), state.totals
    contacts = [
        replace(
            contact,
            pressure=on_nodes(contact.pressure, nodes, none),
            gap=on_nodes(contact.gap, nodes, after.pair.initial_gap),
        )
        for contact in state.contacts
    ]
    return replace(
        state,
        worn=carried(state.worn, before, after),
        memory=None if state.memory is None else after.law.on_other_grid(state.memory, before, after),
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
    return np.where(loaded, carried / np.where(loaded, force, 1.0), system.elastic.interface.pressure_scale)
