"""Distance of a contact's nodes from its edge: where the surfaces part, or the punch's surface ends.

Between a node that touches and one that does not the edge is half-way. Distances are straight lines, no longer than the
surface is wide.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from fenwear.bodies.contact_surface import ContactSurface
from fenwear.common.arrays import Array, Mask

KEPT = 64  # contacts whose distances are kept: those of a cycle come again and again
IN_PLANE = 1e-6  # of the extent of a surface
ON_AXIS = 1e-9  # of the extent of a surface of rings: a radius that is none


class Edges:
    """The edges of contacts on a surface.

    Args:
        surface: The punch's contact surface.
        rings: Whether x is the radius: nothing ends on the axis.
        planes: Of symmetry, each square to an axis by its number and at a place on it, mm: nothing ends there either.
    """

    def __init__(
        self, surface: ContactSurface, *, rings: bool = False, planes: Sequence[tuple[int, float]] = ()
    ) -> None:
        self._x, self._most, self._planes = surface.x, surface.extent(), planes
        self._surface, self._rings = surface, rings
        self._known: dict[bytes, Array] = {}  # distances, by which nodes touch

    @cached_property
    def _to_rim(self) -> Array:
        """Distance of the nodes from where the surface ends (n,), mm."""
        rim = rim_points(self._surface, self._planes)
        if self._rings:
            rim = rim[rim[:, 0] > ON_AXIS * self._most]
        if not len(rim):
            return np.full(len(self._x), self._most)
        return np.asarray(cKDTree(rim).query(self._x)[0])

    def distance(self, touching: Mask) -> Array:
        """Return the nodes' distance from the edge (n,), mm, where these nodes touch; 0 where they do not."""
        key = touching.tobytes()
        if key not in self._known:
            if len(self._known) == KEPT:
                self._known.clear()
            self._known[key] = self._distances(touching)
        return self._known[key]

    def _distances(self, touching: Mask) -> Array:
        distances = np.where(touching, np.minimum(self._to_rim, self._most), 0.0)
        if touching.all() or not touching.any():
            return distances
        inside, outside = self._x[touching], self._x[~touching]
        beside, _ = cKDTree(inside).query(outside)
        far, nearest = cKDTree(outside).query(inside)
        distances[touching] = np.minimum(distances[touching], far - beside[nearest] / 2)
        return distances


def rim_points(surface: ContactSurface, planes: Sequence[tuple[int, float]] = ()) -> Array:
    """Return the points where a surface ends (k, d), mm: none of a closed one, nor of a grid.

    Args:
        surface: The surface.
        planes: Of symmetry, which end nothing, as those of `Edges`.
    """
    if surface.grid is not None:
        return np.zeros((0, surface.dim))
    near = IN_PLANE * surface.extent()
    mirrored = [np.abs(surface.trace[:, axis] - place) < near for axis, place in planes]
    if surface.dim == 2:
        ends, count = np.unique(surface.facets[:, :2], return_counts=True)
        rim = ends[count == 1]
        return surface.trace[
            rim[~np.any([mirrored_nodes[rim] for mirrored_nodes in mirrored], axis=0)] if mirrored else rim
        ]
    corners = surface.facets[:, : 3 if surface.cell == "triangle" else 4]
    order = [0, 1, 2] if surface.cell == "triangle" else [0, 1, 3, 2]  # around it: the element numbers them by rows
    around = corners[:, order]
    edges = np.sort(np.stack([around, np.roll(around, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    edges, count = np.unique(edges, axis=0, return_counts=True)
    edges = edges[count == 1]
    for on_plane in mirrored:
        edges = edges[~on_plane[edges].all(axis=1)]
    return surface.trace[np.unique(edges)]
