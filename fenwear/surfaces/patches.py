"""Patches: parts of two surfaces that look at each other one way, where both are graphs over a plane.

A flat or gently curved contact is one patch, seen along the axis that it looks along. A full bore is four, a cup five:
seen from the axis of the bore or the middle of the cup through the sides of a square or cube around it, so that points
of both surfaces that lie behind each other along the normal do so in every patch. Both faces of a disc between pads are
two, seen along the axis. Straight edges stay straight both ways. Integrals over facets are added up over the patches; a
node where two of them meet has a part in each.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fenwear.bodies.contact_surface import ContactSurface
from fenwear.common.arrays import Array, Mask
from fenwear.common.errors import CaseError, InputError
from fenwear.surfaces.common_normal import facet_normals, unit
from fenwear.surfaces.overlap import RING, ChartedSurface, Patch
from fenwear.surfaces.placement import HERE, Placement

GRAPH = 0.5  # cosine between the axis and the normals of all facets from which on a contact is one patch
SEEN = 0.2  # the same of facets of the second surface that a patch of several sees
AROUND = 0.35  # cosine between the axis and the ways to facets of the second surface that a patch sees from the middle
ROUND = 0.05  # of the radius: how far, in the mean, normals of round surfaces may pass the middle
SLIVER = 0.5  # the same of any one facet
NOWHERE = (
    "the contact surfaces do not face each other: they touch nowhere: no part of strip_contact looks at a part of "
    "punch_contact"
)
STRAIGHT = 1e-3  # of the largest second moment of the normals: what they have along the axis of a cylinder


@dataclass(frozen=True)
class Side:
    """A surface where it lies.

    Attributes:
        surface: As it was meshed.
        trace: Trace nodes of the side (N, d), mm.
        normal: Of its facets (f, d).
    """

    surface: ContactSurface
    trace: Array
    normal: Array

    @property
    def middles(self) -> Array:
        """The middles of the facets (f, d) by their corners."""
        corners = self.surface.facets[:, : len(RING[self.surface.cell])]
        return np.asarray(self.trace[corners].mean(axis=1))

    def charted(self, s: Array, part: NDArray[np.bool_]) -> ChartedSurface:
        """Return some of the facets, whose trace nodes a chart has at s (N, d - 1), mm."""
        surface = self.surface
        return ChartedSurface(s, surface.facets[part], surface.cell, surface.degree, surface.nodes)


# The patches of a contact, the punch's surface first in each; None where the chart does not fit the surfaces.
Chart = Callable[[Side, Side], list[Patch] | None]


def patches(punch: ContactSurface, strip: ContactSurface, placement: Placement = HERE) -> list[Patch]:
    """Return the patches of a contact with the strip in its place, by the first of `CHARTS` that fits."""
    punch_side = Side(punch, punch.trace, facet_normals(punch))
    other = Side(strip, placement.points(strip.trace), placement.vectors(facet_normals(strip)))
    of_charts = (chart(punch_side, other) for chart in CHARTS)
    return next(parts for parts in of_charts if parts is not None)


def _along_axes(punch_side: Side, other: Side) -> list[Patch]:
    """Return the parts of a contact that look along each axis to each side, as graphs over the plane across it."""
    parts = []
    for axis, side, part in _sides(punch_side.normal):
        seen = other.normal[:, axis] * side <= -SEEN
        if not seen.any() or (part.all() and (other.normal[:, axis] * side < 0).all()):
            seen[:] = True
        first, second = (np.delete(side.trace, axis, axis=1) for side in (punch_side, other))
        parts.append(Patch.of(punch_side.charted(first, part), other.charted(second, seen)))
    return parts


def folds(surface: ContactSurface) -> bool:
    """Return whether a surface is neither a graph, nor two of them back to back, nor round: more than can touch."""
    normal = facet_normals(surface)
    back_to_back = (np.abs(normal) >= GRAPH).all(axis=0).any()
    return not (_is_graph(normal) or back_to_back or _middle(surface, normal) is not None)


def facet_side(surface: ContactSurface) -> tuple[int, float]:
    """Return the axis that a surface looks along, and which way; of one that looks several ways along its mean."""
    mean = facet_normals(surface).sum(axis=0)
    axis = int(np.abs(mean).argmax())
    return axis, float(np.sign(mean[axis]))


def _is_graph(normal: Array) -> bool:
    """Return whether facets with these normals (f, d) all look along one axis."""
    return len(_sides(normal)) == 1


def _sides(directions: Array) -> list[tuple[int, float, Mask]]:
    """Return the axis and the side of it of each part of directions (f, d), and which these are (f,)."""
    mean = directions.sum(axis=0)
    axis = int(np.abs(mean).argmax())
    side = float(np.sign(mean[axis]))
    if (directions[:, axis] * side >= GRAPH).all():
        return [(axis, side, np.ones(len(directions), dtype=bool))]
    nearest = np.abs(directions).argmax(axis=1)
    towards = np.sign(np.take_along_axis(directions, nearest[:, None], axis=1)[:, 0])
    keys = np.unique(np.column_stack([nearest, towards]), axis=0)
    return [(int(k), float(end), (nearest == k) & (towards == end)) for k, end in keys]


def radius_of(surface: ContactSurface) -> float:
    """Return the radius of a round surface, mm, negative where its body lies around it; 0 of all others."""
    normal = facet_normals(surface)
    middle = None if _is_graph(normal) else _middle(surface, normal)
    if middle is None:
        return 0.0
    ways = middle.ways(Side(surface, surface.trace, normal).middles)
    outwards = np.einsum("fc,fc->", ways, normal @ middle.across.T) > 0
    radius = float(np.median(np.linalg.norm((surface.trace - middle.point) @ middle.across.T, axis=1)))
    return radius if outwards else -radius


@dataclass(frozen=True)
class _Middle:
    """The middle of round surfaces, a point or an axis.

    Attributes:
        point: In the middle, or on the axis (d,), mm.
        across: Directions that go round (2 or 3, d).
        along: The axis (0 or 1, d).
        radius: mm.
    """

    point: Array
    across: Array
    along: Array
    radius: float

    def ways(self, x: Array) -> Array:
        """Return unit vectors from the middle to points (n, d), in the directions that go round."""
        return unit((x - self.point) @ self.across.T)

    def chart(self, x: Array, axis: int) -> Array:
        """Return the points (n, d) projected from the middle to the plane at the radius across one direction, mm."""
        seen = (x - self.point) @ self.across.T
        flat = np.delete(seen, axis, axis=1) / seen[:, axis, None] * self.radius
        return np.column_stack([flat, (x - self.point) @ self.along.T])


def _middle(surface: ContactSurface, normal: Array) -> _Middle | None:
    """Return the middle that normals (f, d) of facets pass, in least squares; None where they pass none.

    Along the axis of a cylinder no normal has a component; across it, or of a sphere in all directions, the lines along
    the normals pass the middle.
    """
    x, d = Side(surface, surface.trace, normal).middles, surface.dim
    sizes, axes = np.linalg.eigh(normal.T @ normal / len(normal))
    turns = sizes > STRAIGHT * sizes[-1]
    if (~turns).sum() > d - 2:
        return None
    round_ = axes[:, turns] if not turns.all() else np.eye(d)
    way, seen = unit(normal @ round_), x @ round_
    across = np.eye(round_.shape[1]) - way[:, :, None] * way[:, None, :]
    middle = np.linalg.solve(across.mean(axis=0), np.einsum("fab,fb->a", across, seen) / len(x))
    off = np.linalg.norm(np.einsum("fab,fb->fa", across, seen - middle), axis=1)
    radius = np.linalg.norm(seen - middle, axis=1)
    if (off / radius).mean() > ROUND or (off > SLIVER * radius).any():
        return None
    return _Middle(round_ @ middle, round_.T, axes[:, ~turns].T, float(np.median(radius)))


def _from_middle(punch_side: Side, other: Side) -> list[Patch] | None:
    """Return the parts of round surfaces as seen from their middle; None of a graph, or where there is no middle.

    Raises:
        CaseError: a part of the first has nothing of the second opposite.
    """
    middle = None if _is_graph(punch_side.normal) else _middle(punch_side.surface, punch_side.normal)
    if middle is None:
        return None
    ways, opposite = (middle.ways(side.middles) for side in (punch_side, other))
    outwards, facing = (
        np.sign(np.einsum("fc,fc->f", way, side.normal @ middle.across.T))
        for way, side in ((ways, punch_side), (opposite, other))
    )
    parts = []
    for axis, side, part in _sides(ways):
        for out in np.unique(outwards[part]):
            seen = (opposite[:, axis] * side >= AROUND) & (facing == -out)
            if not seen.any():
                raise CaseError(InputError("geometry", NOWHERE))
            views = []
            for body_side, facets in ((punch_side, part & (outwards == out)), (other, seen)):
                s, used = (
                    np.zeros((len(body_side.trace), body_side.surface.dim - 1)),
                    np.unique(body_side.surface.facets[facets]),
                )
                s[used] = middle.chart(body_side.trace[used], axis)
                views.append(body_side.charted(s, facets))
            parts.append(Patch.of(*views))
    return parts


CHARTS: list[Chart] = [_from_middle, _along_axes]  # asked in turn; the last fits all
