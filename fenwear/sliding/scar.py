"""Worn scars as a profilometer reads them: the largest depth and its place, and the width at a share of it.

A scar ends where the depth passes a share of its largest one, linear between neighbouring nodes; its width
along an axis is the distance of its outermost ends. The same in the plane, in rings and in solids.
"""

from __future__ import annotations

from dataclasses import dataclass

import basix
import numpy as np
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.bodies.contact_surface import ContactSurface

PLACES = 9  # of a place in mm: the middle is 0, not what rounding of a mesh leaves of it
EDGES = (0.01, 0.05)  # shares of the largest depth at which widths are read


@dataclass(frozen=True)
class Scars:
    """k scars on a surface of d - 1 axes.

    Attributes:
        depth: Largest depth (k,), mm.
        place: Where (k, d - 1), mm.
    """

    depth: Array
    place: Array


def neighbours(surface: ContactSurface) -> NDArray[np.int64]:
    """Return the pairs of pressure nodes that are next to each other on a facet (e, 2)."""
    number = np.full(len(surface.trace), -1)
    number[surface.nodes] = np.arange(len(surface.nodes))
    local = [(0, 1), (1, 2), (2, 0)] if surface.cell == "triangle" else _lattice(surface.cell, surface.degree)
    pairs = np.concatenate([number[surface.facets[:, list(one)]] for one in local])
    pairs = pairs[(pairs >= 0).all(axis=1)]  # a ring's node on the axis carries no pressure
    found: NDArray[np.int64] = np.unique(np.sort(pairs, axis=1), axis=0)
    return found


def _lattice(cell: str, degree: int) -> list[tuple[int, int]]:
    """Return the neighbours among the nodes of a line or a quadrilateral."""
    points = basix.create_element(
        basix.ElementFamily.P, basix.CellType[cell], degree, basix.LagrangeVariant.gll_warped
    ).points
    levels = np.unique(np.round(points[:, 0], 9))
    step = np.searchsorted(levels, np.round(points, 9))
    apart = np.abs(step[:, None] - step[None]).sum(axis=2)
    return [(int(a), int(b)) for a, b in zip(*np.nonzero(np.triu(apart == 1)), strict=True)]


def scars(x: Array, depth: Array) -> Scars:
    """Return the largest depths of k rows of depths (k, n), mm, at nodes x (n, axes)."""
    deepest = depth.argmax(axis=1)
    return Scars(depth[np.arange(len(depth)), deepest], np.round(x[deepest], PLACES) + 0.0)


def scar_ends(x: Array, pairs: NDArray[np.int64], depth: Array, share: float) -> tuple[Array, Array]:
    """Return the least and the largest coordinates of scars (k, axes) each, mm; zero where nothing is worn.

    Args:
        x: Nodes (n, axes), mm.
        pairs: Nodes that are next to each other (e, 2).
        depth: Worn depths (k, n), mm.
        share: Of the largest depth, where a scar ends.
    """
    level = share * depth.max(axis=1, keepdims=True)
    inside = depth > level
    first, second = depth[:, pairs[:, 0]], depth[:, pairs[:, 1]]
    passes = inside[:, pairs[:, 0]] != inside[:, pairs[:, 1]]
    t = (level - first) / np.where(passes, second - first, 1.0)
    ends = []
    for beyond, extreme in ((np.inf, np.min), (-np.inf, np.max)):
        along = []
        for axis in x.T:
            a, b = axis[pairs[:, 0]], axis[pairs[:, 1]]
            crossing = np.where(passes, a + t * (b - a), beyond)
            nodes = np.where(inside, axis, beyond)
            along.append(extreme(np.concatenate([nodes, crossing], axis=1), axis=1))
        found = np.stack(along, axis=1)
        ends.append(np.where(np.isfinite(found), found, 0.0))
    return ends[0], ends[1]


def scar_widths(surface: ContactSurface, depth: Array, share: float) -> Array:
    """Return the widths of scars along each axis of a contact surface (k, d - 1), mm, of depths (k, n)."""
    low, high = scar_ends(surface.x[:, :-1], neighbours(surface), depth, share)
    return high - low


def scar_edges(x: Array, depth: Array, share: float = EDGES[0]) -> tuple[float, float]:
    """Return where a profile (n,) over ascending abscissae passes a share of its largest depth, mm."""
    count = np.arange(len(x) - 1)
    low, high = scar_ends(x[:, None], np.stack([count, count + 1], axis=1), depth[None], share)
    return float(low[0, 0]), float(high[0, 0])
