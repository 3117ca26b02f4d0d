"""How finely nodes lie across a contact, and what stands beside its largest pressure.

A pressure at a node is that of the contact where the contact is many nodes wide: of Hertz's with 9 nodes across it the
largest is right to 3 %, with 5 to 25 %, with one by a factor. The nodes across the piece of the contact that carries
most are, along each coordinate, one more than the piece's extent over the mean distance of its neighbouring nodes.

A largest pressure may be that of one node, as at an edge, or where wear left a step: the mean over the nodes beside it,
which share a linear facet with it, tells.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from fenwear.arrays import Array, Mask
from fenwear.bodies.contact_surface import ContactSurface
from fenwear.interface import ContactPair
from fenwear.results.surfaces import surface_cells
from fenwear.sliding.chart import sliding_chart
from fenwear.sliding.field import SlidingField

NOISE = 1e-6  # of the surface's extent: a place in its middle is 0, not what rounding of a mesh leaves of it


@dataclass(frozen=True)
class Zone:
    """The piece of a contact that carries most.

    Attributes:
        nodes: Across it along each coordinate (c,).
        spacing: Mean distance of its neighbouring nodes along each (c,), mm.
        free: At how many of both ends along each coordinate it ends before its own part of the surface does (c,).
    """

    nodes: Array
    spacing: Array
    free: NDArray[np.int64]


@dataclass(frozen=True)
class ContactNet:
    """The pressure nodes of a contact surface, and the linear facets between them.

    Attributes:
        surface: The punch's.
        coordinates: Of the nodes (n, c): along and across the sliding in a solid, else along the curve, mm.
        cells: Nodes of each linear facet (f, k).
        names: Of the numbers of nodes along each coordinate.
        axes: Names of the coordinates of a place on the surface.
    """

    surface: ContactSurface
    coordinates: Array
    cells: NDArray[np.int64]
    names: tuple[str, ...]
    axes: tuple[str, ...]

    def beside(self, node: int) -> NDArray[np.int64]:
        """Return the nodes that share a linear facet with one."""
        return np.setdiff1d(self.cells[(self.cells == node).any(axis=1)], [node])

    def piece(self, pressure: Array) -> Mask:
        """Return the nodes of the piece of a contact that carries most (n,), of pressures (n,), MPa."""
        closed = pressure > 0
        sides = np.stack([self.cells, np.roll(self.cells, -1, axis=1)], axis=-1).reshape(-1, 2)
        edges = sides[closed[sides].all(axis=1)]
        graph = coo_array((np.ones(len(edges)), edges.T), shape=(len(closed), len(closed)))
        _, piece = connected_components(graph, directed=False)
        carried = np.bincount(piece, weights=self.surface.weights * np.where(closed, pressure, 0.0))
        return np.asarray(closed & (piece == carried.argmax()))

    def zone(self, pressure: Array) -> Zone | None:
        """Return how the nodes lie across the contact of pressures (n,), MPa; None where nothing touches."""
        piece = self.piece(pressure)
        if not piece.any():
            return None
        whole = piece[self.cells].all(axis=1)
        cells = self.cells[whole if whole.any() else piece[self.cells].any(axis=1)]
        spacing = np.ptp(self.coordinates[cells], axis=1).mean(axis=0)
        inside = self.coordinates[piece]
        slack = spacing / 2
        part = self.surface.part
        own = self.coordinates[part == part[piece.argmax()]]  # another contact's ends are not this one's
        free = (inside.min(axis=0) > own.min(axis=0) + slack).astype(np.int64)
        free += inside.max(axis=0) < own.max(axis=0) - slack
        return Zone(1 + np.ptp(inside, axis=0) / spacing, spacing, free)

    def numbers(self, pressure: Array) -> dict[str, Any]:
        """Return where the largest of pressures (n,) is and what stands beside it, and the nodes across the contact."""
        node, found = int(pressure.argmax()), self.zone(pressure)
        near = self.beside(node)
        weights = self.surface.weights[near]
        place = without_noise(self.surface.x[node], self.surface.extent())
        return {
            **{f"largest_pressure_at_{axis}_mm": float(x) for axis, x in zip(self.axes, place, strict=False)},
            "pressure_beside_largest_MPa": float(weights @ pressure[near] / weights.sum()),
            **(
                {}
                if found is None
                else {name: round(float(n), 1) for name, n in zip(self.names, found.nodes, strict=True)}
            ),
        }


def without_noise(places: Array, extent: float) -> Array:
    """Return places on a surface of an extent, mm; 0 where only rounding keeps them from it."""
    return np.where(np.abs(places) < NOISE * extent, 0.0, places)


def contact_net(pair: ContactPair, field: SlidingField, axes: tuple[str, ...]) -> ContactNet:
    """Return the nodes of a contact and the facets between them.

    Args:
        pair: The surfaces.
        field: The velocity of the strip.
        axes: Names of the coordinates of a place on the contact: ("x",), ("r",) or ("x", "y", "z").
    """
    surface = pair.punch
    if surface.dim == 2:
        along = surface.abscissa[:, None]
        return ContactNet(surface, along, surface_cells(surface), ("nodes_across_contact",), axes)
    names = ("nodes_along_sliding", "nodes_across_sliding")
    return ContactNet(surface, sliding_chart(field, pair).coordinates(surface.x), surface_cells(surface), names, axes)
