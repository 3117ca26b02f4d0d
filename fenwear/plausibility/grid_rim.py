"""Contact that reaches the rim of a contact grid within the surface: clipped, as at the rim of a mesh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fenwear import compat
from fenwear.arrays import Array, Mask
from fenwear.assembly import Tribosystem
from fenwear.bodies.contact_surface import contact_tag
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.grid import RegularGrid
from fenwear.plausibility.ends import ContactEnds, contact_ends, contact_modulus
from fenwear.plausibility.rim import ContactRim, curvatures

BESIDE = 1.5  # spacings of the grid that it may end before the surface does


def grid_limits(system: Tribosystem, grid: RegularGrid) -> ContactEnds | ContactRim | None:
    """Return how the contact grid of a system ends; collective. None where it reaches over the whole surface."""
    low, high = _surface_ends(system.bodies.punch, grid)
    corner, sides, slack = np.array(grid.corner), grid.sides, BESIDE * np.array(grid.spacing)
    within: Mask = np.stack([corner - low > slack, high - corner - sides > slack])
    if (reach := system.bodies.punch.reach) is not None:  # it grows, where it is not at its end
        first, steps = np.array(reach.grid.corner), np.array(grid.spacing)
        within &= np.stack([corner - first < steps, first + reach.grid.sides - corner - sides < steps])
    if not within.any():
        return None
    if len(grid.counts) == 1:
        ends = contact_ends(system)
        if ends is None:
            return None
        goes_on = (bool(within[0, 0]), bool(within[1, 0]))
        return replace(ends, goes_on=goes_on, ends=(float(corner[0]), float(corner[0] + sides[0])))
    places = np.rint((grid.flat - corner) / np.array(grid.spacing)).astype(np.int64)
    outer = np.stack([places == 0, places == np.array(grid.counts) - 1])
    clips: Mask = np.asarray((outer & within[:, None]).any(axis=(0, 2)))
    return ContactRim(clips, system.pair.punch.x, float(sides.max()), curvatures(system), contact_modulus(system.case))


def _surface_ends(elastic: ElasticBody, grid: RegularGrid) -> tuple[Array, Array]:
    """Return the least and largest coordinates along a grid of the meshed contact surface; collective."""
    body = elastic.body
    facets = body.facet_tags.find(contact_tag(body))
    x = body.mesh.geometry.x[compat.facet_nodes(body.mesh, facets).ravel()][:, grid.axes]
    every = np.concatenate(body.mesh.comm.allgather(x))
    return every.min(axis=0), every.max(axis=0)
