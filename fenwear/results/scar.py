"""The geometry of scars: how deep, how long and how wide what is worn off a contact surface is.

A scar is where the depth is more than a share of the largest one, by default a hundredth. Its edge is put between two
nodes by linear interpolation, and beside what is unworn where the slope inside runs out, if that is nearer: a node that
has just been reached does not add an element. Length is along the
sliding and width across it; on rings and on closed tracks the scar goes all the way round, and has a width alone. On
curves that are no graphs over x it is counted along them. Where a contact has parts that lie apart, it is that of the
largest scar, without the gaps between them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fenwear.arrays import Array, Mask
from fenwear.assembly import ContactSetup
from fenwear.bodies.contact_surface import ContactSurface
from fenwear.interface import ContactPair
from fenwear.results.surfaces import surface_cells
from fenwear.sliding.chart import sliding_chart

EDGE = 0.01  # of the largest depth: where a scar ends
RIDGE = 1e-6  # of the squares that a slope is fitted by, where neighbours lie in one direction
CONFORMING = 1e-4  # of the contact's size: gap of unworn surfaces that lie on each other


@dataclass(frozen=True)
class ScarGeometry:
    """Where the nodes of a contact surface lie along and across the sliding.

    Attributes:
        coordinates: Along and across the sliding (n, 2), or across it alone (n, 1), mm.
        edges: Pairs of neighbouring nodes (m, 2).
        part: The connected part of the surface of each node (n,).
        names: Of the extents: ("length", "width"), ("width",) of what is worn all the way round, and none of a plane's
            strip that is.
    """

    coordinates: Array
    edges: NDArray[np.int64]
    part: NDArray[np.int64]
    names: tuple[str, ...]

    def extents(self, depth: Array, share: float = EDGE) -> dict[str, Array]:
        """Return the extents of scars (k,), mm, by their names; 0 where nothing is worn.

        Args:
            depth: Worn depths of k half-cycles (k, n), mm.
            share: Of the largest depth, where a scar ends.
        """
        if not self.names:
            return {}
        level = share * depth.max(axis=1, initial=0.0)
        found: Array = np.zeros((len(depth), len(self.names)))
        for k in range(self.part.max(initial=-1) + 1):
            own = np.where(self.part == k, depth, 0.0)
            found = np.maximum(found, extents(own, self.coordinates, self.edges, share, level))
        return dict(zip(self.names, found.T, strict=True))


def extents(
    depth: Array, coordinates: Array, edges: NDArray[np.int64], share: float = EDGE, level: Array | None = None
) -> Array:
    """Return how far scars reach along each coordinate (k, c), mm.

    Args:
        depth: Worn depths of k half-cycles (k, n), mm.
        coordinates: Of the nodes (n, c), mm.
        edges: Pairs of neighbouring nodes (m, 2).
        share: Of the largest depth, where a scar ends.
        level: The depth where it ends (k,), mm, in place of that share.
    """
    level = (share * depth.max(axis=1, initial=0.0) if level is None else level)[:, None]
    inside = depth > level
    first, second = edges.T
    a, b = depth[:, first] - level, depth[:, second] - level
    crossed = inside[:, first] != inside[:, second]
    fraction = np.where(crossed, a / np.where(crossed, a - b, 1.0), 0.0)
    outwards = inside[:, first]
    reached = np.where(outwards, fraction, 1.0 - fraction)  # from the node inside
    reached = np.minimum(reached, _until_unworn(depth, coordinates, edges, level, crossed))
    fraction = np.where(outwards, reached, 1.0 - reached)
    found = []
    for s in coordinates.T:
        at_edges = s[first] + fraction * (s[second] - s[first])
        values = np.concatenate([np.where(inside, s, np.nan), np.where(crossed, at_edges, np.nan)], axis=1)
        worn = inside.any(axis=1)
        reach = np.zeros(len(depth))
        reach[worn] = np.nanmax(values[worn], axis=1) - np.nanmin(values[worn], axis=1)
        found.append(reach)
    return np.stack(found, axis=1)


def _until_unworn(depth: Array, coordinates: Array, edges: NDArray[np.int64], level: Array, crossed: Mask) -> Array:
    """Return at which part of edges that leave a scar for what is unworn its slope inside comes to the level (k, m).

    Counted from the node inside; infinite where that tells nothing. The slope at a node is that of least squares to
    those of its neighbours that are worn.
    """
    found: Array = np.full(crossed.shape, np.inf)
    first, second = edges.T
    outwards = depth[:, first] > level
    near, far = np.where(outwards, first, second), np.where(outwards, second, first)
    row, edge = np.nonzero(crossed & (np.take_along_axis(depth, far, axis=1) == 0))
    if not len(row):  # nothing unworn beside it, as where surfaces conform
        return found
    near, far = near[row, edge], far[row, edge]
    beside = _neighbours(edges, len(coordinates))[near]  # (e, most), the node itself where there are fewer
    ways, rises = (
        coordinates[beside] - coordinates[near][:, None],
        depth[row[:, None], beside] - depth[row, near][:, None],
    )
    worn = depth[row[:, None], beside] > level[row]
    normal = np.einsum("es,esi,esj->eij", worn, ways, ways)
    ridge = RIDGE * np.trace(normal, axis1=1, axis2=2)[:, None, None] + np.finfo(float).tiny
    right = np.einsum("es,es,esi->ei", worn, rises, ways)
    slope = np.linalg.solve(normal + ridge * np.eye(coordinates.shape[1]), right[..., None])[..., 0]
    falls = -np.einsum("ei,ei->e", slope, coordinates[far] - coordinates[near])
    runs_out = falls > 0
    found[row[runs_out], edge[runs_out]] = (depth[row, near] - level[row, 0])[runs_out] / falls[runs_out]
    return found


def _neighbours(edges: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Return the neighbours of each node (n, most), filled up with the node itself."""
    one, other = np.concatenate([edges, edges[:, ::-1]]).T
    order = np.argsort(one, kind="stable")
    one, other = one[order], other[order]
    place = np.arange(len(one)) - np.searchsorted(one, one)
    found = np.tile(np.arange(count)[:, None], (1, int(place.max(initial=-1)) + 1))
    found[one, place] = other
    return found


def scar_geometry(placed: ContactSetup, surface: ContactSurface) -> ScarGeometry:
    """Return where the nodes of the punch's or the strip's surface lie along and across the sliding."""
    cells = surface_cells(surface)
    ends, count = np.sort(np.stack([cells, np.roll(cells, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1), len(surface.x)
    edges = np.stack(np.divmod(np.unique(ends[:, 0].astype(np.int64) * count + ends[:, 1]), count), axis=1)
    all_round = surface is placed.pair.strip and placed.sliding.track is not None
    part = surface.part
    if surface.dim == 2:
        if all_round:
            return ScarGeometry(surface.x[:, :0], edges, part, ())
        return ScarGeometry(surface.abscissa[:, None], edges, part, ("width",))
    chart = sliding_chart(placed.sliding.field, placed.pair)
    coordinates = chart.coordinates(surface.x)
    if surface is placed.pair.strip and not placed.motion.steps:  # its track has upright sides: no wider than the punch
        across = chart.coordinates(placed.pair.punch.x)[:, 1]
        coordinates[:, 1] = np.clip(coordinates[:, 1], across.min(), across.max())
    if all_round:
        return ScarGeometry(coordinates[:, 1:], edges, part, ("width",))
    return ScarGeometry(coordinates, edges, part, ("length", "width"))


def conforming(pair: ContactPair) -> bool:
    """Return whether the unworn surfaces lie on each other, so that the load over their area is a pressure."""
    return bool(np.ptp(pair.initial_gap) < CONFORMING * pair.punch.extent())
