"""Creep with stick: displacements of bodies and layer by creep, from time step to time step, and over whole cycles.

As in gross sliding (`fenwear.bodies.creep_law`), with displacements along all axes. Over a time step v, that of the
forces of a time, changes evenly from u to v: y takes up shares a of u and b of v, and at its end a body is displaced by
(1 + sum of c b) v + sum of c (e y + a u). So its compliance is grown, and its state y and u move the surfaces against
each other along the normal and along the tangents. Where they stick, what they were moved by when they stuck stays;
tractions relax.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fenwear.bodies.creep_law import Retardation
from fenwear.bodies.scaled_body import scaled
from fenwear.bodies.surface_operators import SurfaceOperator
from fenwear.common.arrays import Array
from fenwear.steps.stick_position import LoadEffect, Position
from fenwear.steps.stick_state import StickState

PARTS, BODIES = ("punch", "strip", "layer"), 2
Displaced = tuple[Array, Array, Array]  # the punch (n, d), the strip at its operator's nodes (q, d), the layer (n,), mm


@dataclass(frozen=True)
class StickCreep:
    """Parts that creep, of `PARTS` in this order; its state is one vector, of each its y (terms, ...) in turn.

    Attributes:
        laws: Of each part; without terms where it does not creep.
        shapes: Of the displacement of each.
        behind: Operators of punch and strip below a grid that grows, whose states are forces and what loads displace,
            as those of `fenwear.system.creep_members.CreepingForces`; None where they are displacements.
        moved: Displacement of punch and strip by moved supports alone, mm.
        closure: Of the layer by unit pressures at once (n,), mm/MPa.
    """

    laws: tuple[Retardation, Retardation, Retardation]
    shapes: tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]]
    moved: tuple[Array, Array]
    closure: Array
    behind: tuple[SurfaceOperator, SurfaceOperator] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "_kept", {})

    @property
    def creeps(self) -> bool:
        """Whether a part does."""
        return any(law.creeps for law in self.laws)

    @property
    def endless(self) -> str:
        """The key of what creeps without an end; "" where nothing does."""
        keys = ("punch.creep", "strip.creep", "contact.layer.creep")
        return next((key for key, law in zip(keys, self.laws, strict=True) if law.endless), "")

    def beginning(self) -> Array:
        """Return the state at the start: nothing has crept."""
        return np.zeros(sum(self._sizes()))

    def unloaded(self) -> Array:
        """Return v of all parts where nothing presses (size,)."""
        return np.zeros(sum(self._numbers))

    @property
    def _numbers(self) -> list[int]:
        """Of each y."""
        punch, strip, layer = (int(np.prod(shape)) for shape in self.shapes)
        return [punch, strip, layer] if self.behind is None else [2 * punch, 2 * strip, layer]

    def _sizes(self) -> list[int]:
        return [len(law.times) * count for law, count in zip(self.laws, self._numbers, strict=True)]

    def parted(self, state: Array) -> list[Array]:
        """Return the y of each part (terms, size); without terms where it does not creep."""
        parts = np.split(state, np.cumsum(self._sizes())[:-1])
        return [part.reshape(-1, count) for part, count in zip(parts, self._numbers, strict=True)]

    def displacement(self, part: int, y: Array) -> Array:
        """Return the displacement of a part in a state y (size,), mm."""
        shape = self.shapes[part]
        if self.behind is None or part == BODIES:
            return y.reshape(shape)
        forces, by_loads = y.reshape(2, *shape)
        return np.asarray(self.behind[part].apply(forces) + by_loads)

    def of_contact(self, position: Position, f: Array, moved: tuple[Array, Array], loaded: LoadEffect) -> Array:
        """Return v of all parts (size,).

        Args:
            position: Of the strip.
            f: Tractions in the frame (d n,), MPa.
            moved: Displacements of punch and strip by them at once, mm.
            loaded: The loads.
        """
        push, back = position.forces(f)
        punch = self.elastic(push, moved[0], loaded.forced_punch)
        strip = self.elastic(-back, moved[1], loaded.forced_strip)
        return np.concatenate([punch, strip, self.closure * f[: len(self.closure)]])

    def elastic(self, forces: Array, moved: Array, by_loads: Array | float) -> Array:
        """Return v of a body (size,), as its states are.

        Args:
            forces: That press it (q, d), N/mm in the plane, N.
            moved: Their displacement (q, d), mm.
            by_loads: That of the loads, mm.
        """
        if self.behind is None:
            return np.asarray(moved + by_loads).ravel()
        return np.concatenate([forces.ravel(), np.broadcast_to(by_loads, forces.shape).ravel()])

    def displaced(self, state: Array, elastic: Array | None = None, duration: float = 0.0) -> Displaced:
        """Return the displacements of punch, strip and layer at the end of a step, by a state and by v at its begin."""
        displacements = []
        ends = self.after(state, self.unloaded() if elastic is None else elastic, self.unloaded(), duration)
        for part, (law, y) in enumerate(zip(self.laws, self.parted(ends), strict=True)):
            displacements.append(
                self.displacement(part, law.compliances @ y) if law.creeps else np.zeros(self.shapes[part])
            )
        return displacements[0], displacements[1], displacements[2]

    def after(self, state: Array, begin: Array, end: Array, duration: float) -> Array:
        """Return the state after a step over which v of all parts (size,) changes evenly."""
        parts, cuts = [], np.cumsum(self._numbers)[:-1]
        for law, y, u, v in zip(self.laws, self.parted(state), np.split(begin, cuts), np.split(end, cuts), strict=True):
            at_begin, at_end = law.shares(duration)
            left = np.exp(-duration / law.times)[:, None] * y
            parts.append((left + at_begin[:, None] * u + at_end[:, None] * v).ravel())
        return np.concatenate(parts)

    def factors(self, duration: float) -> list[float]:
        """Return the compliance of each part in a step, over that at once; in the end for an infinite duration."""
        return [1.0 + float(law.shares(duration)[1] @ law.compliances) for law in self.laws]

    def grown(self, position: Position, duration: float) -> Position:
        """Return a place of the strip with compliances as they are at the end of a step; the last ones are kept."""
        kept: dict[tuple[int, float], tuple[Position, Position]] = self.__dict__["_kept"]
        key = id(position), duration
        if key not in kept:
            interface, times = position.interface, self.factors(duration)
            if times == [1.0] * len(times):
                kept[key] = position, position
            else:
                punch, strip = (
                    scaled(body, factor, moved)
                    for body, factor, moved in zip(
                        (interface.punch, interface.strip), times[:2], self.moved, strict=True
                    )
                )
                other = replace(interface, punch=punch, strip=strip, layer=times[2] * interface.layer, like=None)
                kept[key] = position, replace(position, interface=other)
        return kept[key][1]

    def lasting(self, begin: Array, end: Array, period: float) -> Array:
        """Return the state that cycles end with which repeat, if each does to its state what one cycle did: E y + g."""
        parts = []
        for law, first, other in zip(self.laws, self.parted(begin), self.parted(end), strict=True):
            x = period / law.times[:, None]
            parts.append((first + (other - first) / -np.expm1(-x)).ravel())
        return np.concatenate(parts)

    def rate(self, begin: Array, end: Array, period: float) -> Array:
        """Return the rate by which the state changes with the cycles, from its change in one cycle."""
        paces = [np.repeat(period / law.times, count) for law, count in zip(self.laws, self._numbers, strict=True)]
        return np.concatenate(paces) * (self.lasting(begin, end, period) - begin)

    def at(self, contact: StickState, state: Array) -> StickState:
        """Return a contact whose bodies have crept to another state, their surfaces where they were."""
        before, now = self.displaced(contact.crept), self.displaced(state)
        on_punch, on_strip = (
            displacement + earlier - other
            for displacement, earlier, other in zip((contact.on_punch, contact.on_strip), before, now, strict=False)
        )
        return replace(contact, on_punch=on_punch, on_strip=on_strip, crept=state)


def stiff(punch: SurfaceOperator, strip: SurfaceOperator) -> StickCreep:
    """Return the creep of bodies and a layer of which none creeps."""
    law, moved = Retardation.of(None), (np.zeros_like(punch.by_load), np.zeros_like(strip.by_load))
    n = len(punch.by_load)
    return StickCreep((law, law, law), (moved[0].shape, moved[1].shape, (n,)), moved, np.zeros(n))


def opened_by_creep(position: Position, creep: StickCreep, state: Array) -> Array:
    """Return the gap (n,) that a state opens in a place of the strip, mm."""
    punch, strip, layer = creep.displaced(state)
    apart = punch - position.pair.placement.vectors(position.reading @ strip)
    return np.asarray(np.einsum("nd,nd->n", position.frame[:, 0], apart) + layer)


class CreepNear:
    """Creep over many cycles like one, by the change of its mean pressure: the implicit part of a jump.

    Along the normals y goes by X = period / tau in a cycle to v, which follows the pressure. Along the tangents all of
    v may be removed where nodes stick: there y goes by X (1 + sum of c) to where it rests in such cycles.

    Args:
        creep: Parts that creep.
        position: The bodies in the middle position of the strip.
        period: Of a cycle, s.
        begin, rate: The state of the cycle, and how much it changes it.
    """

    def __init__(self, creep: StickCreep, position: Position, period: float, begin: Array, rate: Array) -> None:
        self._creep, self._position, self._begin, self._rate = creep, position, begin, creep.parted(rate)
        self._paces = [period / law.times for law in creep.laws]
        self._normals = position.frame[:, 0], _normals_of_strip(position)

    @cached_property
    def _opened_by_units(self) -> list[Array]:
        """Gap (n, n) that v of each part by unit pressures opens, mm/MPa."""
        units, none = np.eye(len(self._normals[0])), np.zeros((len(self._normals[0]),) * 2)
        return [
            np.array([self._opened(part, self._displaced(part, unit)) for unit in units]).T if law.creeps else none
            for part, law in enumerate(self._creep.laws)
        ]

    def coupling(self, cycles: float) -> Array:
        """Return the gap (n, n) that unit mean pressures open by creep in a step, mm/MPa."""
        parts = zip(self._creep.laws, self._paces, self._opened_by_units, strict=True)
        shares = [(law.compliances @ (cycles * pace / (1 + cycles * pace)), opened) for law, pace, opened in parts]
        return np.asarray(sum(share * opened for share, opened in shares))

    def after(self, before: Array, cycles: float, pressure: Array) -> Array:
        """Return the state z = before + cycles M(z) at a change of the mean pressure (n,), MPa."""
        parts = []
        for part, away in enumerate(self._creep.parted(before - self._begin)):
            x = cycles * self._paces[part][:, None]
            along, across = self._split(part, away + cycles * self._rate[part])
            along = along + x * self._displaced(part, pressure)
            parts.append(along / (1 + x) + across / (1 + self._growth(part) * x))
        return self._begin + np.concatenate([part.ravel() for part in parts])

    def rate(self, now: Array, pressure: Array) -> Array:
        """Return M(now) at a change of the mean pressure (n,), MPa."""
        parts = []
        for part, away in enumerate(self._creep.parted(now - self._begin)):
            along, across = self._split(part, away)
            moved = self._displaced(part, pressure) - along - self._growth(part) * across
            parts.append(self._rate[part] + self._paces[part][:, None] * moved)
        return np.concatenate([part.ravel() for part in parts])

    def _growth(self, part: int) -> float:
        return 1 + float(self._creep.laws[part].compliances.sum())

    def _displaced(self, part: int, pressure: Array) -> Array:
        """Return v (size,) of a part by pressures (n,); zero of one that does not creep."""
        if not self._creep.laws[part].creeps:
            return np.zeros(1)
        if part == BODIES:
            return self._creep.closure * pressure
        position, interface = self._position, self._position.interface
        force, operator = position.frame[:, 0] * (position.pair.weights * pressure)[:, None], interface.punch
        if part == 1:
            force, operator = -position.reaction(force), interface.strip
        moved = force if self._creep.behind is not None else operator.apply(force)
        return self._creep.elastic(force, moved, 0.0)

    def _opened(self, part: int, y: Array) -> Array:
        """Return the gap (n,) that a state y (size,) of a part opens."""
        displacement = self._creep.displacement(part, y)
        if part == BODIES:
            return displacement
        if part == 1:
            displacement = -self._position.pair.placement.vectors(self._position.reading @ displacement)
        return np.einsum("nd,nd->n", self._normals[0], displacement)

    def _split(self, part: int, values: Array) -> tuple[Array, Array]:
        """Return states (terms, size) of a part along the normals, and across them."""
        if part == BODIES:
            return values, np.zeros_like(values)
        shape, normals = self._creep.shapes[part], self._normals[part]
        vectors = values.reshape(-1, *shape)
        along = np.einsum("knd,nd,ne->kne", vectors, normals, normals).reshape(values.shape)
        return along, values - along


def _normals_of_strip(position: Position) -> Array:
    """Return the normals at the nodes of the strip's operator (q, d): those of the contact nodes that read them."""
    normals = position.reaction(position.frame[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    mean = position.pair.placement.back(position.frame[:, 0]).mean(axis=0)
    normals[lengths == 0] = mean
    return normals / np.linalg.norm(normals, axis=1)[:, None]
