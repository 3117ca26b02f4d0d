"""The contact seen along and across the sliding: coordinates in which scars have a length and a width.

A translation along V has s = x . V along it, and across it the coordinate of e_n x V. Around an axis s is the
arc r_0 theta on the circle of the mean radius r_0, from the middle of the contact on; across it is the radius on a
disc, and the place along the axis on a roller. The arc of a whole bore counts from its top.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fenwear.common.arrays import Array
from fenwear.surfaces.pair import ContactPair
from fenwear.surfaces.placement import in_space
from fenwear.surfaces.sliding_field import SlidingField

AXIAL = 0.7  # cosine between the contact's normal and the axis above which the body is a disc, not a roller
ROUNDING = 1e-9  # rad
INSIDE = 0.5  # of the mean radius: where the nodes' mean is nearer to the axis, the axis goes through the contact


@dataclass(frozen=True)
class SlidingChart:
    """Coordinates along and across the sliding.

    Attributes:
        along, across: Directions of a translation; around an axis the first radius, and the way on from it (3,).
        axis: Of a rotation (3,); None for a translation, and where the axis goes through the contact.
        centre: A point on the axis (3,), mm.
        radius: r_0, mm.
        disc: Whether the contact lies across the axis, so that the radius is what changes across the sliding.
    """

    along: Array
    across: Array
    axis: Array | None
    centre: Array
    radius: float
    disc: bool

    def coordinates(self, x: Array) -> Array:
        """Return both coordinates (n, 2), mm, of points (n, d)."""
        points = in_space(x) - self.centre
        if self.axis is None:
            return np.column_stack([points @ self.along, points @ self.across])
        height = points @ self.axis
        radial = points - height[:, None] * self.axis
        angle = np.arctan2(radial @ self.across, radial @ self.along)
        angle[angle > np.pi - ROUNDING] = -np.pi  # nodes in line behind the middle stay in line
        arc = self.radius * angle
        return np.column_stack([arc, np.linalg.norm(radial, axis=1) if self.disc else height])


def sliding_chart(field: SlidingField, pair: ContactPair) -> SlidingChart:
    """Return the coordinates along and across the sliding of a contact.

    Args:
        field: The velocity of the counter-body.
        pair: The surfaces in the middle position.
    """
    weights, x = pair.weights / pair.weights.sum(), in_space(pair.punch.x)
    normal = weights @ in_space(pair.normal)
    normal /= np.linalg.norm(normal)
    if not any(field.turn):
        along = np.array(field.shift)
        return SlidingChart(along, np.cross(normal, along), None, np.zeros(3), 0.0, disc=False)
    axis, centre = np.array(field.turn), np.array(field.centre)
    points = x - centre
    radial = points - np.outer(points @ axis, axis)
    radii = np.linalg.norm(radial, axis=1)
    radius, middle = float(weights @ radii), weights @ radial
    if (np.abs(in_space(pair.normal) @ axis) < AXIAL).all() and np.linalg.norm(middle) < INSIDE * radius:
        return SlidingChart(*_around(axis, pair), axis, centre, radius, disc=False)
    if np.linalg.norm(middle) < INSIDE * radius:
        along = _first_axis(normal)
        return SlidingChart(along, np.cross(normal, along), None, np.zeros(3), 0.0, disc=False)
    first = middle / np.linalg.norm(middle)
    return SlidingChart(first, np.cross(axis, first), axis, centre, radius, disc=bool(abs(normal @ axis) > AXIAL))


def _around(axis: Array, pair: ContactPair) -> tuple[Array, Array]:
    """Return the first radius and the way on from it of a whole bore or shaft (3,): where its middle is on a chart.

    As of plane ones where it looks at the other body most, the punch being above: a bore's top, a shaft's bottom.
    """
    up = np.array([0.0, 0.0, 1.0]) if abs(axis[2]) < AXIAL else np.array([1.0, 0.0, 0.0])
    first: Array = up - (up @ axis) * axis
    x, normal = in_space(pair.punch.x), in_space(pair.normal)
    outside = np.einsum("ic,ic->", x - pair.weights @ x / pair.weights.sum(), normal) > 0  # e_n goes into the punch
    first *= (1.0 if outside else -1.0) / np.linalg.norm(first)
    return first, np.asarray(np.cross(axis, first), dtype=np.float64)


def _first_axis(normal: Array) -> Array:
    """Return the direction within the surface that is nearest to x."""
    along = np.array([1.0, 0.0, 0.0]) if abs(normal[0]) < AXIAL else np.array([0.0, 1.0, 0.0])
    along = along - (along @ normal) * normal
    return along / np.linalg.norm(along)
