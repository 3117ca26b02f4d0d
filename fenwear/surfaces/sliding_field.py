"""The sliding field: the velocity of the counter-body over the contact.

The counter-body moves as a rigid one, v = V + omega x (x - c), times the scalar law of the stroke. A
translation is counted in mm, a rotation in rad: then speed, wear and heat vary over the contact.

Sliding of nodes around an axis that passes through the contact of a solid.

At the axis nothing slides, and a node there would never wear. The node stands for its area, though. Where wear is even,
k p^b v^a is the same all over it, so that its mean pressure is that of a node that slides

    v_m = (mean of v^-m over its area)^(-1/m),    m = a / b,

which also gives the heat of friction, with m = 1. An even pressure would take the mean of v^a; the two differ
by the third order of the node's size in the worn volume. In a plane piece of the surface v = omega_n r, with r the
distance from where the axis of its motion meets it. The piece's corners a, b, ... and this point x_0 span triangles,
over each of which

    integral of r^-m dA = A / (1 - m / 2) (integral of r^-m along the edge) / (length of the edge).

For m >= 2 it has no limit: all of the load ends at the axis, and nodes slide what their places do.

Ways of a body from one place to another: screws, exact for turns of any size below half a one.

From (R_0, s_0) to (R_1, s_1), places x -> R (x - c) + c + s, the shortest screw is constant over the way:

    R = R_1 R_0^T = exp(w),  s_1 - R s_0 = J(w) V,  J(w) = 1 + (1 - cos t) / t² [w] + (t - sin t) / t³ [w]²,  t = |w|,

with the velocity V + w x (x - c) for a unit of time (exponential of se(3); R. M. Murray et al., A Mathematical
Introduction to Robotic Manipulation, 1994).
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from scipy.spatial.transform import Rotation as Turn

from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError
from fenwear.surfaces.overlap import ChartedSurface, node_triangles
from fenwear.surfaces.pair import ContactPair
from fenwear.surfaces.placement import HERE, ZERO, Placement, Vector, in_space


@dataclass(frozen=True)
class SlidingField:
    """A rigid motion of unit amount, in space (x, y, z); a plane model lies at y = 0.

    Attributes:
        shift: V, the direction of a translation; a unit vector, or zero, but of a step of a table.
        turn: omega, the axis of a rotation; the same. With a translation it is a screw along its axis.
        centre: c, a point on the axis, mm.
    """

    shift: Vector = ZERO
    turn: Vector = ZERO
    centre: Vector = ZERO

    def velocity(self, x: Array) -> Array:
        """Return v of the counter-body's material at points x (n, d) for a unit of the stroke's law (n, 3)."""
        return np.array(self.shift) + np.cross(self.turn, in_space(x) - self.centre)

    def __post_init__(self) -> None:
        """Raise where it shifts across its axis, which would have to move along."""
        if ZERO not in (self.shift, self.turn):
            across = np.linalg.norm(np.cross(self.shift, self.turn))
            if across > 1e-9 * np.linalg.norm(self.shift) * np.linalg.norm(self.turn):
                message = "expected a translation, a rotation, or a rotation that advances along its own axis"
                raise CaseError(InputError("motion", message))

    def over(self, amount: float) -> SlidingField:
        """Return the motion of which this is so many units."""
        shift, turn = (vector_of(np.array(part) / amount) for part in (self.shift, self.turn))
        return SlidingField(shift, turn, self.centre)

    def rate(self, x: Array, normal: Array) -> Array:
        """Return the sliding of points with normals e_n (n, d) for a unit of the stroke's law (n,): 1, or mm/rad."""
        return np.linalg.norm(self._tangential(x, normal), axis=1)

    def _tangential(self, x: Array, normal: Array) -> Array:
        v, n = self.velocity(x), in_space(normal)
        return v - np.einsum("ic,ic->i", v, n)[:, None] * n

    def direction(self, x: Array, normal: Array) -> Array:
        """Return e_v (n, 3), the unit direction of sliding within the contact of normal e_n (n, d), or zero."""
        tangential = self._tangential(x, normal)
        size = np.linalg.norm(tangential, axis=1, keepdims=True)
        still = size <= 1e-12 * size.max(initial=1e-300)
        return np.where(still, 0.0, tangential / np.where(still, 1.0, size))

    def words(self, dim: int) -> dict[int, str]:
        """Return the words for the two directions d of the sliding in d dimensions, 1 first.

        Turns are seen against their axis; forward in a solid is along the direction of the motion.
        """
        if self.turn != ZERO:
            return {1: "counterclockwise", -1: "clockwise"}
        return {1: "rightward", -1: "leftward"} if dim == 2 else {1: "forward", -1: "backward"}

    def placement(self, amount: float) -> Placement:
        """Return the place of the counter-body after this amount of the motion, mm or rad."""
        if amount == 0.0:
            return Placement()
        (x, y, z), (a, b, c) = self.shift, self.turn
        return Placement((amount * x, amount * y, amount * z), (amount * a, amount * b, amount * c), self.centre)


def screw(shift: Array, turn: Array, centre: Array) -> SlidingField:
    """Return the field of the velocity V + omega x (x - c), about the axis that moves along itself only.

    Args:
        shift: V (3,), mm.
        turn: omega (3,), rad.
        centre: c (3,), mm.
    """
    size = float(turn @ turn)
    if size == 0:
        return SlidingField(shift=vector_of(shift))
    along = (shift @ turn) / size * turn
    return SlidingField(vector_of(along), vector_of(turn), vector_of(centre + np.cross(turn, shift) / size))


def vector_of(values: Array) -> Vector:
    """Return three numbers as a tuple, without a zero that is negative."""
    x, y, z = (float(c) + 0.0 for c in values)
    return x, y, z


ALONG_X = SlidingField(shift=(1.0, 0.0, 0.0))
ALONG_Y = SlidingField(shift=(0.0, 1.0, 0.0))


AROUND = 1.2  # sizes of a node, within which the axis passes through its area; beside the surface nothing is singular
UPRIGHT = 0.1  # cosine between a node's normal and the mean one, below which a rigid motion hardly wears it
NEAR = 4.0  # sizes of a triangle from the axis, beyond which v is smooth over it
POINTS, SHARES = np.polynomial.legendre.leggauss(16)


def node_rates(field: SlidingField, pair: ContactPair, power: float = 1.0) -> Array:
    """Return the sliding of each node for a unit of the stroke's law (n,): 1, or mm/rad.

    Args:
        field: Of the sliding.
        pair: The surfaces opposite each other.
        power: m.
    """
    rates, turn = field.rate(pair.opposite, pair.normal), np.array(field.turn)
    if pair.punch.dim < 3 or field.turn == ZERO or power >= 2:
        return rates
    away = rates / np.maximum(np.abs(pair.normal @ turn) * np.sqrt(pair.weights), 1e-300)  # from the axis, in sizes
    nearest = int(away.argmin())
    facing = pair.normal[nearest] @ (pair.weights @ pair.normal) / pair.weights.sum()
    if away[nearest] > AROUND or facing < UPRIGHT:  # where the rim stands upright it hardly wears
        return rates
    punch = pair.punch
    triangles, node = node_triangles(ChartedSurface(punch.trace, punch.facets, punch.cell, punch.degree, punch.nodes))
    middle = triangles.mean(axis=1)
    square = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    twice = np.linalg.norm(square, axis=1)
    normal = square / twice[:, None]
    speed, spin = field.velocity(middle), normal @ turn
    speed -= np.einsum("md,md->m", speed, normal)[:, None] * normal
    halves = (triangles + np.roll(triangles, -1, axis=1)) / 2 - middle[:, None]
    at_halves = speed[:, None] + spin[:, None, None] * np.cross(normal[:, None], halves)
    size = np.linalg.norm(triangles - middle[:, None], axis=2).max(axis=1)
    near = np.linalg.norm(speed, axis=1) < NEAR * size * np.abs(spin)
    mean_powers = np.zeros(len(triangles))
    mean_powers[~near] = (np.linalg.norm(at_halves[~near], axis=2) ** -power).mean(axis=1)
    still = middle[near] + np.cross(normal[near], speed[near]) / spin[near, None]
    integrals = _integrals(triangles[near] - still[:, None], normal[near], power)
    mean_powers[near] = integrals / (twice[near] / 2) * np.abs(spin[near]) ** -power
    count = len(rates)
    means = np.bincount(node, twice * mean_powers, count) / np.bincount(node, twice, count)
    return np.asarray(means ** (-1 / power))


def _integrals(triangles: Array, normal: Array, power: float) -> Array:
    """Return the integrals of r^-m over triangles (m, 3, 3) in planes through the origin, r the distance from it."""
    after = np.roll(triangles, -1, axis=1)
    edge = after - triangles
    length = np.linalg.norm(edge, axis=2)
    along = edge / length[:, :, None]
    twice = np.einsum("md,med->me", normal, np.cross(triangles, after))  # areas with sign
    away = np.maximum(np.abs(twice) / length, 1e-12 * length)
    # Along the edge by s = d sinh(u): what is integrated is smooth, and constant for m = 1.
    begin, end = (np.arcsinh(np.einsum("med,med->me", corners, along) / away) for corners in (triangles, after))
    u = (begin + end)[:, :, None] / 2 + (end - begin)[:, :, None] / 2 * POINTS
    on_edge = ((away[:, :, None] * np.cosh(u)) ** (1 - power) @ SHARES) * (end - begin) / 2
    return np.asarray((twice / (2 - power) * on_edge / length).sum(axis=1))


ROUNDING = 1e-14  # rad, and of the largest shift: what matrices leave of a motion that is none
SMALL = 1e-4  # rad: a turn whose series ends after three terms


class Way(Protocol):
    """Way of a body in a time step; equal ways there and back are one."""

    def at(self, share: float) -> Placement:
        """Return the place at a share of it, from 0 at its lower end to 1."""


@dataclass(frozen=True)
class Slide:
    """A way along a sliding field.

    Attributes:
        field: The motion of unit amount.
        low, high: Amounts at its ends, mm or rad.
    """

    field: SlidingField
    low: float
    high: float

    def at(self, share: float) -> Placement:
        """Return the place at a share of it."""
        return self.field.placement(self.low + (self.high - self.low) * share)


@dataclass(frozen=True)
class Screw:
    """The shortest screw between two places, which turn about the same centre where both are turned.

    Attributes:
        first, last: Ends of the screw.
    """

    first: Placement
    last: Placement

    @property
    def undirected(self) -> Screw:
        """The way, from whichever end it begins."""
        return Screw(*sorted((self.first, self.last), key=lambda place: (place.turn, place.shift)))

    def parts(self, count: int) -> list[Screw]:
        """Return the screw in parts of equal time."""
        places = [self.at(k / count) for k in range(count + 1)]
        return [Screw(*ends) for ends in itertools.pairwise(places)]

    @property
    def _centre(self) -> Vector:
        return self.last.centre if self.first.turn == ZERO else self.first.centre

    @cached_property
    def _parts(self) -> tuple[Array, Array]:
        """Return V (3,), mm, and w (3,), rad."""
        (s0, r0), (s1, r1) = ((np.array(p.shift), Turn.from_rotvec(p.turn)) for p in (self.first, self.last))
        w = (r1 * r0.inv()).as_rotvec()
        w = np.where(np.abs(w) < ROUNDING, 0.0, w)
        v = np.linalg.solve(_advance(w), s1 - Turn.from_rotvec(w).apply(s0))
        return np.where(np.abs(v) < ROUNDING * max(np.abs(s0).max(), np.abs(s1).max()), 0.0, v), w

    @cached_property
    def field(self) -> SlidingField:
        """The velocity for a unit of time."""
        return screw(*self._parts, np.array(self._centre))

    @property
    def rests(self) -> bool:
        """Whether nothing moves."""
        return not any(part.any() for part in self._parts)

    def at(self, share: float) -> Placement:
        """Return the place at a share of it, from 0 at `first` to 1 at `last`."""
        if share in (0, 1):
            return self.last if share else self.first
        v, w = (share * part for part in self._parts)
        turn = Turn.from_rotvec(w)
        shift = turn.apply(self.first.shift) + _advance(w) @ v
        return placed(shift, (turn * Turn.from_rotvec(self.first.turn)).as_rotvec(), self._centre)


def placed(shift: Array, turn: Array, centre: Vector) -> Placement:
    """Return a place, rounded so that it is the same on the way there and back.

    Args:
        shift: mm.
        turn: Rotation vector, rad.
        centre: Of the turn, mm.
    """
    place = Placement(_rounded(shift), _rounded(turn), centre)
    return place if any(place.shift) or any(place.turn) else HERE


def _advance(w: Array) -> Array:
    """Return J(w) (3, 3), by which a screw's turning bends its way."""
    angle = float(np.linalg.norm(w))
    cross = np.cross(np.eye(3), w)
    if angle < SMALL:
        return np.asarray(np.eye(3) + cross / 2 + cross @ cross / 6)
    first, second = (1 - math.cos(angle)) / angle**2, (angle - math.sin(angle)) / angle**3
    return np.asarray(np.eye(3) + first * cross + second * cross @ cross)


def _rounded(vector: Array) -> Vector:
    x, y, z = (float(c) + 0.0 for c in np.round(vector, 12))
    return x, y, z
