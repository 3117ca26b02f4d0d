"""Contact that reaches the rim of a contact grid, or of the surface below it: clipped, as at the rim of a mesh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from fenwear import compat
from fenwear.arrays import Array, Mask
from fenwear.assembly import Tribosystem
from fenwear.bodies.contact_surface import contact_tag
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.grid import RegularGrid
from fenwear.plausibility.ends import ContactEnds, contact_ends, contact_modulus
from fenwear.plausibility.rim import ContactRim, curvatures, smooth_rim

BESIDE = 1.5  # spacings of the grid that it may end before the surface does


def grid_limits(system: Tribosystem, grid: RegularGrid) -> ContactEnds | ContactRim | None:
    """Return how the contact grid of a system ends; collective.

    A side may lie within the surface, or reach over it: there it is the surface's own end that clips, where the body
    goes on. None where no side clips.
    """
    punch = system.bodies.punch
    low, high = _surface_ends(punch, grid)
    corner, sides, steps = np.array(grid.corner), grid.sides, np.array(grid.spacing)
    within: Mask = np.stack([corner - low > BESIDE * steps, high - corner - sides > BESIDE * steps])
    last = np.ones_like(within)
    if (reach := punch.reach) is not None:  # it grows, where it is not at its end
        first = np.array(reach.grid.corner)
        last = np.stack([corner - first < steps, first + reach.grid.sides - corner - sides < steps])
    own = within & last
    if len(grid.counts) == 1:
        ends = contact_ends(system)
        if ends is None:
            return None
        of_surface = last & ~within & np.array(ends.goes_on)[:, None]
        goes_on = own | of_surface
        found = replace(ends, goes_on=(bool(goes_on[0, 0]), bool(goes_on[1, 0])), of_grid=bool(own.any()))
        return replace(found, ends=(float(corner[0]), float(corner[0] + sides[0]))) if goes_on.any() else None
    places = np.rint((grid.flat - corner) / steps).astype(np.int64)
    outer = np.stack([places == 0, places == np.array(grid.counts) - 1])
    clips: Mask = np.asarray((outer & own[:, None]).any(axis=(0, 2)))
    over = np.flatnonzero((outer & (last & ~within)[:, None]).any(axis=(0, 2)))
    clips[over] |= _beside_smooth_rim(punch, grid, grid.flat[over])
    if not clips.any():
        return None
    modulus = contact_modulus(system.case)
    return ContactRim(clips, system.pair.punch.x, float(sides.max()), curvatures(system), modulus, bool(own.any()))


def _beside_smooth_rim(elastic: ElasticBody, grid: RegularGrid, flat: Array) -> Mask:
    """Return which points along a grid (k, a) are nearest to where the body goes on beyond its surface; collective."""
    goes_on, ends = smooth_rim(elastic, elastic.meshed)
    edges = np.concatenate([goes_on, ends])
    if not len(edges) or not len(flat):
        return np.zeros(len(flat), dtype=bool)
    middles = elastic.meshed.trace[edges[:, :2]].mean(axis=1)[:, grid.axes]
    return np.asarray(cKDTree(middles).query(flat)[1] < len(goes_on))


def _surface_ends(elastic: ElasticBody, grid: RegularGrid) -> tuple[Array, Array]:
    """Return the least and largest coordinates along a grid of the meshed contact surface; collective."""
    body = elastic.body
    facets = body.facet_tags.find(contact_tag(body))
    x = body.mesh.geometry.x[compat.facet_nodes(body.mesh, facets).ravel()][:, grid.axes]
    every = np.concatenate(body.mesh.comm.allgather(x))
    return every.min(axis=0), every.max(axis=0)
