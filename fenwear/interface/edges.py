"""How far nodes of a contact are from its edge: where the surfaces part, or the punch's surface ends.

Between a node that touches and one that does not the edge is half-way. Distances are straight lines, no longer than the
surface is wide.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from fenwear.arrays import Array, Mask
from fenwear.bodies.contact_surface import ContactSurface

ON_AXIS = 1e-9  # of the extent of a surface of rings: a radius that is none


class Edges:
    """The edges of contacts on a surface.

    Args:
        surface: The punch's contact surface.
        rings: Whether x is the radius: nothing ends on the axis.
    """

    def __init__(self, surface: ContactSurface, *, rings: bool = False) -> None:
        self._x, self._most = surface.x, surface.extent()
        self._surface, self._rings = surface, rings

    @cached_property
    def _to_rim(self) -> Array:
        """Distance of the nodes from where the surface ends (n,), mm."""
        rim = rim_points(self._surface)
        if self._rings:
            rim = rim[rim[:, 0] > ON_AXIS * self._most]
        if not len(rim):
            return np.full(len(self._x), self._most)
        return np.asarray(cKDTree(rim).query(self._x)[0])

    def distance(self, touching: Mask) -> Array:
        """Return the distance of nodes from the edge (n,), mm, where these nodes touch; 0 where they do not."""
        found = np.where(touching, np.minimum(self._to_rim, self._most), 0.0)
        if touching.all() or not touching.any():
            return found
        inside, outside = self._x[touching], self._x[~touching]
        beside, _ = cKDTree(inside).query(outside)
        far, nearest = cKDTree(outside).query(inside)
        found[touching] = np.minimum(found[touching], far - beside[nearest] / 2)
        return found


def rim_points(surface: ContactSurface) -> Array:
    """Return the points where a surface ends (k, d), mm: none of a closed one, nor of a grid."""
    if surface.grid is not None:
        return np.zeros((0, surface.dim))
    if surface.dim == 2:
        ends, count = np.unique(surface.facets[:, :2], return_counts=True)
        return surface.trace[ends[count == 1]]
    corners = surface.facets[:, : 3 if surface.cell == "triangle" else 4]
    order = [0, 1, 2] if surface.cell == "triangle" else [0, 1, 3, 2]  # around it: the element numbers them by rows
    around = corners[:, order]
    edges = np.sort(np.stack([around, np.roll(around, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    edges, count = np.unique(edges, axis=0, return_counts=True)
    return surface.trace[np.unique(edges[count == 1])]
