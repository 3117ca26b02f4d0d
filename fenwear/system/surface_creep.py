"""Creep of the bodies and of layers between them: crept depths open the gap, and grow with pressure.

A body that creeps has a displacement y of its contact surface for each term of its compliance (`bodies.creep_law`), at
the patterns of its operator: of a strip that moves as a whole on its material. A layer has one of its nodes. With v_k
the elastic displacement in phase k of the motion, after that phase

    gap_k = g + (1 + sum of c (1 - e)) v_k + sum of c e y:

contact with compliances that are `grown` by numbers, and a gap that the state opens. Many cycles in one implicit step,
or cycles that repeat in the end, open each phase by the v_i of all phases: a coupling of the pressures.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fenwear.bodies.creep_law import Retardation, RetardedCycle
from fenwear.bodies.scaled_body import scaled
from fenwear.bodies.surface_operators import SurfaceOperator
from fenwear.common.arrays import Array
from fenwear.surfaces import Interface
from fenwear.system.contact_setup import ContactSetup
from fenwear.system.creep_members import BODIES, LAYER, CreepingBody, CreepingForces, CreepingLayer, Member, both

TIMES = 33  # in a phase whose loads vary; odd
KEPT = 4  # couplings of the last steps


class CreepTangent(NamedTuple):
    """Effect of changes of the creep state, and of the pressures, in a phase.

    Attributes:
        opened: Gap by a state (n, state).
        stay, seen: Shares of its changes that remain at the end of the phase, and that the contact sees (state,).
        by_pressure, seen_by_pressure: State at the end, and as the contact sees it, by the pressures (state, n).
    """

    opened: Array
    stay: Array
    seen: Array
    by_pressure: Array
    seen_by_pressure: Array


@dataclass(frozen=True)
class Creep:
    """All that creeps, and its state: of each member in turn its y (terms, size), as one vector.

    Attributes:
        members: The bodies and the layer that creep.
        durations: Of the phases of the motion (m,), s.
        courses: Loads over those of the middle, at even times of each phase (m, 2 k + 1).
        interfaces: Elastic compliance of the surfaces in each phase.
        moved: Displacement of punch and strip by moved supports alone in each phase (q, d), mm.
        middle: A phase in the middle of a half-cycle.
    """

    members: tuple[Member, ...]
    durations: Array
    courses: Array
    interfaces: tuple[Interface, ...]
    moved: tuple[tuple[Array, Array], ...]
    middle: int = 0

    @cached_property
    def cycles(self) -> list[RetardedCycle]:
        """Change of each member over a cycle."""
        return [member.retardation.over(self.durations, self.courses) for member in self.members]

    @cached_property
    def _ends(self) -> list[int]:
        """Ends of the members' states."""
        return [int(end) for end in np.cumsum([len(member.retardation.times) * member.size for member in self.members])]

    @property
    def creeps(self) -> bool:
        """Whether a body or a layer does."""
        return bool(self.members)

    @property
    def size(self) -> int:
        """Of the state."""
        return self._ends[-1] if self.members else 0

    @property
    def endless(self) -> str:
        """The key of what creeps without an end; "" where nothing does."""
        return next((member.key for member in self.members if member.retardation.endless), "")

    def beginning(self) -> Array:
        """Return the state at the start: nothing has crept."""
        return np.zeros(self.size)

    def parted(self, crept: Array) -> list[Array]:
        """Return the y of each member (terms, size), or (terms, size, k) of k states (size, k)."""
        parts = np.split(crept, self._ends)  # behind the last of them nothing is left
        return [
            part.reshape(-1, member.size, *crept.shape[1:]) for part, member in zip(parts, self.members, strict=False)
        ]

    def depth(self, crept: Array) -> Array:
        """Return the gap that has crept open (n,), mm, in the middle of a half-cycle."""
        return sum(self.depths(crept).values(), np.zeros(self._nodes))

    def depths(self, crept: Array) -> dict[str, Array]:
        """Return the creep of punch, strip and layer (n,), or of states (size, k) each, (n, k), mm, by name."""
        by_name = {}
        for member, y in self._each(crept):
            by_name[member.name] = member.opened(
                self.middle, np.asarray(np.tensordot(member.retardation.compliances, y, 1))
            )
        return by_name

    def _each(self, crept: Array) -> list[tuple[Member, Array]]:
        return list(zip(self.members, self.parted(crept), strict=True))

    def from_other(self, other: Creep, crept: Array, nodes: NDArray[np.int64]) -> Array:
        """Return a state of those on another contact grid, whose `nodes` (n,) those here were, or none."""
        of_each = zip(self.members, other.members, other.parted(crept), strict=True)
        return _joined([member.from_other(before, y, nodes).ravel() for member, before, y in of_each])

    @property
    def _nodes(self) -> int:
        return len(self.interfaces[0].pair.weights)

    # ------------------------------------------------------------------ one phase after the other

    @cached_property
    def grown(self) -> tuple[Interface, ...]:
        """Compliance of the surfaces in each phase of a march, including the creep within it."""
        if not self.creeps:
            return self.interfaces
        known: dict[tuple[float, ...], Interface] = {}
        scaled = []
        for phase, interface in enumerate(self.interfaces):
            times = self.factors(phase)
            alike = (id(interface), *times)
            if alike not in known:
                known[alike] = self._scaled(interface, times, self.moved[phase])
            scaled.append(known[alike])
        return tuple(scaled)

    def factors(self, phase: int) -> tuple[float, ...]:
        """Return the compliances of punch, strip and layer over a phase of a march, over their immediate ones."""
        factors = {member.name: cycle.factors for member, cycle in zip(self.members, self.cycles, strict=True)}
        return tuple(float(factors[name][phase]) if name in factors else 1.0 for name in (*BODIES, LAYER))

    def _scaled(self, interface: Interface, times: Sequence[float], by_supports: tuple[Array, Array]) -> Interface:
        bodies = zip(both(interface), times[:2], by_supports, strict=True)
        punch, strip = (scaled(body, factor, moved) for body, factor, moved in bodies)
        return replace(interface, punch=punch, strip=strip, layer=times[2] * interface.layer, like=None)

    def offset(self, phase: int, crept: Array) -> Array:
        """Return the gap (n,) that a state opens at the end of the phase that it is the beginning of, mm."""
        return sum(
            (
                member.opened(phase, cycle.left[phase] @ y)
                for (member, y), cycle in zip(self._each(crept), self.cycles, strict=True)
            ),
            np.zeros(self._nodes),
        )

    def change(self, phase: int, crept: Array, pressure: Array, ratio: Array, load: float) -> Array:
        """Return the change of the state in a phase.

        Args:
            phase: Number of the phase.
            crept: State at its start.
            pressure: (n,), MPa.
            ratio: tau (n, d).
            load: Factor of all loads.
        """
        changes = [
            cycle.taken[phase][:, None] * member.displacement(phase, pressure, ratio, load)
            - (1 - cycle.decays[phase])[:, None] * y
            for (member, y), cycle in zip(self._each(crept), self.cycles, strict=True)
        ]
        return _joined([change.ravel() for change in changes])

    def tangent(self, phase: int, ratio: Array) -> CreepTangent:
        """Return the derivatives of a phase by changes of state and pressure."""
        n = self._nodes
        gaps: list[Array] = [np.zeros((n, 0))]
        by_pressure: tuple[list[Array], list[Array]] = [np.zeros((0, n))], [np.zeros((0, n))]
        stay: tuple[list[Array], list[Array]] = [np.zeros(0)], [np.zeros(0)]
        for member, cycle in zip(self.members, self.cycles, strict=True):
            opened, matrix = member.opened(phase, np.eye(member.size)), member.matrix(phase, ratio)
            for k, compliance in enumerate(member.retardation.compliances):
                gaps.append(compliance * opened)
                for seen, decays, taken in (
                    (0, cycle.decays, cycle.taken),
                    (1, cycle.seen_decays, cycle.seen_taken),
                ):
                    stay[seen].append(np.full(member.size, decays[phase, k]))
                    by_pressure[seen].append(taken[phase, k] * matrix)
        return CreepTangent(
            np.concatenate(gaps, axis=1),
            *map(np.concatenate, stay),
            *map(np.concatenate, by_pressure),
        )

    # ------------------------------------------------------------------ whole cycles

    def stage(self, crept: Array, cycles: float, ratios: Sequence[Array], load: float) -> CreepStage:
        """Return the creep of all phases in an implicit step of so many cycles from a state.

        Args:
            crept: State at its start.
            cycles: Length of the step.
            ratios: tau of each phase, (n, d) each.
            load: Factor of all loads.
        """
        shares = [cycle.within(cycles) for cycle in self.cycles]
        gap = self._by_loads([by for by, _ in shares], ratios, load)
        for (member, y), (_, by_state) in zip(self._each(crept), shares, strict=True):
            for phase, share in enumerate(by_state):
                gap[phase] += member.opened(phase, share @ y)
        return CreepStage(self, gap, [by for by, _ in shares], crept, cycles, list(ratios), load)

    def lasting(self, pressure: Array, ratios: Sequence[Array], load: float) -> list[Array]:
        """Return the v_i of each member in all phases (m, size), mm, at pressures (m, n)."""
        return [
            np.array([member.displacement(k, np.asarray(p), ratios[k], load) for k, p in enumerate(pressure)])
            for member in self.members
        ]

    def _by_loads(self, shares: Sequence[Array], ratios: Sequence[Array], load: float) -> Array:
        """Return the gap (m, n) that the loads alone creep open."""
        m = len(self.durations)
        none, gap = np.zeros((m, self._nodes)), np.zeros((m, self._nodes))
        for member, member_shares, v in zip(self.members, shares, self.lasting(none, ratios, load), strict=True):
            for phase in range(m):
                gap[phase] += member.opened(phase, member_shares[phase] @ v)
        return gap

    @cached_property
    def _couplings(self) -> list[tuple[list[Array], list[Array], Array]]:
        return []

    def coupling(self, shares: Sequence[Array], ratios: Sequence[Array]) -> Array:
        """Return the gaps of each phase by the pressures of each phase (m, n, m, n), mm/MPa; the last ones are kept.

        Args:
            shares: Of the v_i in each phase (phases, i), of each member.
            ratios: tau of each phase.
        """
        for known_shares, known_ratios, gaps in self._couplings:
            if _same(known_ratios, ratios) and _same(known_shares, shares):
                return gaps
        m, n = len(self.durations), self._nodes
        gaps = np.zeros((m, n, m, n))
        for member, member_shares in zip(self.members, shares, strict=True):
            for i in range(m):
                displaced = member.matrix(i, ratios[i])
                for phase in range(m):
                    gaps[phase, :, i] += member_shares[phase, i] * member.opened(phase, displaced)
        self._couplings.append((list(shares), list(ratios), gaps))
        del self._couplings[:-KEPT]
        return gaps


def _courses(placed: ContactSetup) -> Array:
    """Return the loads over those of the middle, at even times of each phase (m, 2 k + 1); ones where they stay."""
    phases, case, courses = placed.motion.phases, placed.case, np.ones((len(placed.motion.phases), TIMES))
    loads = [load for body in case.bodies for load in case.loads_of(body)]
    if all(load.steady for load in loads):
        return courses
    period = sum(phase.duration for phase in phases)

    def at(fraction: float) -> Array:
        given = [load.at(fraction % 1.0 if fraction > 1 else max(fraction, 0.0)) for load in loads]
        return np.concatenate([part for load in given for part in (load.force, load.traction, load.moment) if part])

    for course, phase in zip(courses, phases, strict=True):
        middle, half = at(phase.fraction), phase.duration / period / 2
        if middle.any():
            times = np.linspace(phase.fraction - half, phase.fraction + half, TIMES)
            course[:] = [at(float(time)) @ middle / (middle @ middle) for time in times]
    return courses


def _joined(parts: Sequence[Array]) -> Array:
    """Return the parts of a state as one vector; of none an empty one."""
    return np.concatenate([np.zeros(0), *parts])


def _same(first: Sequence[Array], other: Sequence[Array]) -> bool:
    return all(a is b or np.array_equal(a, b) for a, b in zip(first, other, strict=True))


@dataclass(frozen=True)
class CreepStage:
    """Effect of creep on the contact of all phases in one implicit step.

    Attributes:
        creep: All that creeps.
        gap: That state and loads open (m, n), mm.
        shares: Of the elastic displacement of each phase in each phase (phases, i), of each member.
        crept: State at the start.
        cycles: Length of the step.
        ratios: tau of each phase.
        load: Factor of all loads.
    """

    creep: Creep
    gap: Array
    shares: Sequence[Array]
    crept: Array
    cycles: float
    ratios: list[Array]
    load: float

    def opening(self, gap: Array, coupling: Array | None) -> tuple[Array, Array | None]:
        """Return gaps (m, n), mm, and a coupling (m, n, m, n), mm/MPa, with creep; None for no coupling."""
        if not self.creep.creeps:
            return gap, coupling
        by_creep = self.creep.coupling(self.shares, self.ratios)
        return gap + self.gap, by_creep if coupling is None else by_creep + coupling

    def rate(self, pressure: Array) -> Array:
        """Return the change of the state in each cycle of the step, at pressures (m, n)."""
        creep, changes = self.creep, []
        displaced = creep.lasting(pressure, self.ratios, self.load)
        for cycle, y, v in zip(creep.cycles, creep.parted(self.crept), displaced, strict=True):
            by_v, by_y = cycle.rate(self.cycles)
            changes.append((by_v @ v + by_y[:, None] * y).ravel())
        return _joined(changes)


def creep_of(
    placed: ContactSetup,
    operators: tuple[SurfaceOperator, SurfaceOperator],
    interfaces: tuple[Interface, ...],
    on_material: Callable[[int], Interface],
) -> Creep:
    """Return the creep of both bodies and the layer; collective.

    Args:
        placed: The bodies.
        operators: Compliance of both, under the mean of their loads.
        interfaces: Both joined in each phase.
        on_material: Returns them joined in a phase with what the strip's own material answers, wherever it is.
    """
    bodies, given = (
        (placed.bodies.punch, placed.bodies.strip),
        getattr(placed.laws.friction.contact.layer, "creep", None),
    )
    laws = [Retardation.of(body.creep) for body in bodies]

    def by_supports(which: int, operator: SurfaceOperator) -> Array:
        body = bodies[which]
        creeps = laws[which].creeps and body.moved
        return operator.under(body.with_loads(())).by_load if creeps else 0.0 * operator.by_load

    moved = by_supports(0, operators[0]), by_supports(1, operators[1])
    faces = tuple(on_material(phase) for phase in range(len(interfaces)))
    members: list[Member] = [
        (CreepingBody if bodies[which].reach is None else CreepingForces)(which, law, faces, moved[which])
        for which, law in enumerate(laws)
        if law.creeps
    ]
    if given is not None and np.any(placed.layers.winkler):
        members.append(CreepingLayer(Retardation.of(given), np.asarray(placed.layers.winkler)))
    durations = np.array([phase.duration for phase in placed.motion.phases])
    by_phase = [  # on a grid the strip answers opposite the punch in each of its places
        moved if face is interface else (moved[0], by_supports(1, interface.strip))
        for face, interface in zip(faces, interfaces, strict=True)
    ]
    return Creep(tuple(members), durations, _courses(placed), interfaces, tuple(by_phase), placed.motion.positions // 2)
