"""The contact surfaces in history.nc: nodes and the facets between them, scars, and how finely nodes lie.

Values live on the dimension `node` (`node_strip` for the strip's own material). Coordinates and facets follow the UGRID
conventions (ugrid-conventions.github.io), which programs for maps on meshes read.

A scar is where the depth is more than a share of the largest one, by default a hundredth. Its edge is put between two
nodes by linear interpolation, and beside what is unworn where the slope inside runs out, if that is nearer: a node that
has just been reached does not add an element. Length is along the
sliding and width across it; on rings and on closed tracks the scar goes all the way round, and has a width alone. On
curves that are no graphs over x it is counted along them. Where a contact has parts that lie apart, it is that of the
largest scar, without the gaps between them.

A pressure at a node is that of the contact where the contact is many nodes wide: of Hertz's with 9 nodes across it the
largest is right to 3 %, with 5 to 25 %, with one by a factor. The nodes across the piece of the contact that carries
most are, along each coordinate, one more than the piece's extent over the mean distance of its neighbouring nodes.

A largest pressure may be that of one node, as at an edge, or where wear left a step: the mean over the nodes beside it,
which share a linear facet with it, shows this.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from fenwear.bodies.contact_surface import ContactSurface
from fenwear.bodies.subcells import linear_cells
from fenwear.common.arrays import Array, Mask
from fenwear.surfaces import ContactPair
from fenwear.surfaces.sliding_chart import SlidingChart, sliding_chart
from fenwear.surfaces.sliding_field import SlidingField
from fenwear.system import ContactSetup

SEAM = 3.0  # chords of an element, along a curve: farther apart its ends lie on both sides of a closed curve's seam
UPRIGHT = 1e-6  # of the squares of a facet's sides: seen from above it is a line
ON_FACET = 1e-9  # of a facet: rounding


class Column(NamedTuple):
    """A variable that does not change in a run.

    Attributes:
        dimensions: Their names.
        values: Of these sizes.
        attributes: Units, long name and what else is to be known.
    """

    dimensions: tuple[str, ...]
    values: NDArray[Any]
    attributes: dict[str, Any]


def surface_cells(surface: ContactSurface) -> NDArray[np.int64]:
    """Return the pressure nodes around each linear facet (f, 2, 3 or 4)."""
    if surface.cell == "triangle":  # the pressure lives on the vertices
        return surface.number[surface.facets[:, :3]]
    cells = surface.number[surface.facets[:, linear_cells(surface.cell, surface.degree)]]
    cells = cells.reshape(-1, cells.shape[-1])
    return cells[(cells >= 0).all(axis=1)]


def at_places(surface: ContactSurface, values: Array, places: Array, nodes: Mask | None = None) -> Array:
    """Return nodal values at places on a surface (k,), linear on each of its facets; NaN beside it.

    Args:
        surface: The contact surface of a body.
        values: At its pressure nodes (n,).
        places: Abscissae along a curve (k,), mm; in a solid x and y (k, 2). Where several facets lie one above the
            other, the largest value counts.
        own: Nodes whose facets count (n,).
    """
    cells = surface_cells(surface)
    cells = cells if nodes is None else cells[nodes[cells].all(axis=1)]
    if surface.dim == 2:
        begin, end = surface.abscissa[cells].T
        chord = np.linalg.norm(surface.x[cells[:, 1]] - surface.x[cells[:, 0]], axis=1)
        seam = np.abs(end - begin) > SEAM * chord  # of a closed curve
        begin, end = np.where(seam, np.maximum(begin, end), begin), np.where(seam, np.maximum(begin, end) + chord, end)
        cells = np.where((seam & (surface.abscissa[cells[:, 0]] < begin))[:, None], cells[:, ::-1], cells)
        share = (places.reshape(-1, 1) - begin) / (end - begin)
        shares = np.stack([1 - share, share], axis=-1)
    else:
        cells = np.concatenate([cells[:, [0, k, k + 1]] for k in range(1, cells.shape[1] - 1)])
        corners = surface.x[cells][:, :, :2]
        sides = np.moveaxis(corners[:, 1:] - corners[:, :1], 1, 2)
        flat = np.abs(np.linalg.det(sides)) > UPRIGHT * (np.linalg.norm(sides, axis=1) ** 2).sum(axis=1)
        cells, corners, sides = cells[flat], corners[flat], sides[flat]
        two = np.einsum("fij,kfj->kfi", np.linalg.inv(sides), places[:, None] - corners[:, 0])
        shares = np.concatenate([1 - two.sum(axis=-1, keepdims=True), two], axis=-1)
    inside = (shares > -ON_FACET).all(axis=-1)
    nodal_values = np.where(inside, (shares * values[cells]).sum(axis=-1), -np.inf).max(axis=1, initial=-np.inf)
    return np.asarray(np.where(np.isfinite(nodal_values), nodal_values, np.nan))


def rim(surface: ContactSurface) -> Mask:
    """Return which pressure nodes lie on the rim of a contact surface (n,): on a side of one linear facet alone."""
    cells = surface_cells(surface)
    on_rim: Mask = np.zeros(len(surface.nodes), dtype=bool)
    if cells.shape[1] == 2:
        nodes, count = np.unique(cells, return_counts=True)
        on_rim[nodes[count == 1]] = True
        return on_rim
    sides = np.stack([cells, np.roll(cells, -1, axis=1)], axis=-1).reshape(-1, 2)  # corners come around
    pairs, count = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
    on_rim[pairs[count == 1].ravel()] = True
    return on_rim


def recorded_surfaces(placed: ContactSetup) -> dict[str, ContactSurface]:
    """Return the contact surfaces that a history has values on, by how the names of their variables end."""
    return {"": placed.pair.punch} | ({"_strip": placed.pair.strip} if placed.phases.strip_changes else {})


def surface_columns(placed: ContactSetup) -> dict[str, Column]:
    """Return coordinates and facets of the contact surfaces that a history has values on, by name."""
    chart = sliding_chart(placed.sliding.field, placed.pair)
    columns = [_columns(chart, surface, end) for end, surface in recorded_surfaces(placed).items()]
    return {name: column for of_surface in columns for name, column in of_surface.items()}


def part_columns(placed: ContactSetup, plane: bool) -> dict[str, Column]:
    """Return the named contact that each node of the surfaces is of, and in the plane its part where there are more."""
    columns = {}
    for end, surface in recorded_surfaces(placed).items():
        over = (f"{'x' if plane else 'node'}{end}",)
        if surface.contact is not None:
            flags = {"flag_values": np.arange(len(surface.names)), "flag_meanings": " ".join(surface.names)}
            text = {"units": "1", "long_name": f"contact that each node of the {surface.body} belongs to"}
            columns[f"contact{end}"] = Column(over, surface.contact, {**text, **flags})
        part = surface.part
        if plane and part.max() > 0:
            text = {"units": "1", "long_name": f"part of the {surface.body}'s surface that each node belongs to"}
            columns[f"part{end}"] = Column(over, part, text)
    return columns


def coordinate_names(end: str, dim: int) -> tuple[str, ...]:
    """Return the names of the nodes' coordinates, such as x_strip: r and z of rings, x, y and z of a solid."""
    return tuple(f"{axis}{end}" for axis in (("r", "z") if dim == 2 else ("x", "y", "z")))


def _columns(chart: SlidingChart, surface: ContactSurface, end: str) -> dict[str, Column]:
    node, facet, corner = f"node{end}", f"facet{end}", f"corner{end}"
    names = coordinate_names(end, surface.dim)
    columns = {
        name: Column(
            (node,), surface.unworn[:, k], {"units": "mm", "long_name": f"{name[0]} of the {surface.body}'s nodes"}
        )
        for k, name in enumerate(names)
    }
    if surface.dim == 3:
        along, across = chart.coordinates(surface.x).T
        columns[f"along{end}"] = Column((node,), along, _mm("place along the sliding"))
        columns[f"across{end}"] = Column((node,), across, _mm("place across the sliding"))
    cells, kind = surface_cells(surface), "edge" if surface.dim == 2 else "face"
    facets, mesh = f"facets{end}", f"{surface.body}_surface"
    role = f"{kind}_node_connectivity"
    attributes = {"cf_role": role, "start_index": 0, "units": "1", "long_name": "nodes around each linear facet"}
    columns[facets] = Column((facet, corner), cells, attributes)
    columns[mesh] = Column(
        (),
        np.array(0),
        {
            "cf_role": "mesh_topology",
            "topology_dimension": surface.dim - 1,
            "node_coordinates": " ".join(names),
            role: facets,
            "units": "1",
            "long_name": f"contact surface of the {surface.body}",
        },
    )
    return columns


def _mm(text: str) -> dict[str, Any]:
    return {"units": "mm", "long_name": text}


def on_mesh(dimensions: tuple[str, ...], dim: int) -> dict[str, str]:
    """Return the attributes that name the surface of a variable; none for a series."""
    for end, body in (("", "punch"), ("_strip", "strip")):
        if f"node{end}" in dimensions:
            names = [*coordinate_names(end, dim), *([f"along{end}", f"across{end}"] if dim == 3 else [])]
            return {"mesh": f"{body}_surface", "location": "node", "coordinates": " ".join(names)}
    return {}


EDGE = 0.01  # of the largest depth: where a scar ends
RIDGE = 1e-3  # of the squares that a slope is fitted by, where neighbours lie in one direction, nearly
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
        reaches: Array = np.zeros((len(depth), len(self.names)))
        for k in range(self.part.max(initial=-1) + 1):
            part_depth = np.where(self.part == k, depth, 0.0)
            reaches = np.maximum(reaches, extents(part_depth, self.coordinates, self.edges, share, level))
        return dict(zip(self.names, reaches.T, strict=True))


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
    reached = np.minimum(reached, _until_unworn(depth, coordinates, edges, level, crossed, reached))
    fraction = np.where(outwards, reached, 1.0 - reached)
    reaches = []
    for s in coordinates.T:
        at_edges = s[first] + fraction * (s[second] - s[first])
        values = np.concatenate([np.where(inside, s, np.nan), np.where(crossed, at_edges, np.nan)], axis=1)
        worn = inside.any(axis=1)
        reach = np.zeros(len(depth))
        reach[worn] = np.nanmax(values[worn], axis=1) - np.nanmin(values[worn], axis=1)
        reaches.append(reach)
    return np.stack(reaches, axis=1)


def _until_unworn(
    depth: Array, coordinates: Array, edges: NDArray[np.int64], level: Array, crossed: Mask, reached: Array
) -> Array:
    """Return at which part of edges that leave a scar for what is unworn its slope inside comes to the level (k, m).

    Counted from the node inside; infinite where that gives no bound. The slope at a node is that of least squares to
    those of its neighbours that are worn. Towards nodes that are worn less than the level it turns evenly into where
    the edge `reached` the level: no depth of rounding decides.
    """
    fractions: Array = np.full(crossed.shape, np.inf)
    first, second = edges.T
    outwards = depth[:, first] > level
    near, far = np.where(outwards, first, second), np.where(outwards, second, first)
    row, edge = np.nonzero(crossed)
    if not len(row):  # nothing worn less beside it, as where surfaces conform
        return fractions
    near, far, reached = near[row, edge], far[row, edge], reached[row, edge]
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
    until = (depth[row, near] - level[row, 0]) / np.where(runs_out, falls, 1.0)
    until += (reached - until) * depth[row, far] / level[row, 0]
    fractions[row[runs_out], edge[runs_out]] = until[runs_out]
    return fractions


def _neighbours(edges: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Return the neighbours of each node (n, most), filled up with the node itself."""
    node, other = np.concatenate([edges, edges[:, ::-1]]).T
    order = np.argsort(node, kind="stable")
    node, other = node[order], other[order]
    place = np.arange(len(node)) - np.searchsorted(node, node)
    neighbours = np.tile(np.arange(count)[:, None], (1, int(place.max(initial=-1)) + 1))
    neighbours[node, place] = other
    return neighbours


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
        covered = piece[self.cells].all(axis=1)
        cells = self.cells[covered if covered.any() else piece[self.cells].any(axis=1)]
        spacing = np.ptp(self.coordinates[cells], axis=1).mean(axis=0)
        inside = self.coordinates[piece]
        slack = spacing / 2
        part = self.surface.part
        # another contact's ends are not this one's
        contact_coordinates = self.coordinates[part == part[piece.argmax()]]
        free = (inside.min(axis=0) > contact_coordinates.min(axis=0) + slack).astype(np.int64)
        free += inside.max(axis=0) < contact_coordinates.max(axis=0) - slack
        return Zone(1 + np.ptp(inside, axis=0) / spacing, spacing, free)

    def numbers(self, pressure: Array) -> dict[str, Any]:
        """Return where the largest of pressures (n,) is and what stands beside it, and the nodes across the contact."""
        node, zone = int(pressure.argmax()), self.zone(pressure)
        near = self.beside(node)
        weights = self.surface.weights[near]
        place = without_noise(self.surface.x[node], self.surface.extent())
        return {
            **{f"largest_pressure_at_{axis}_mm": float(x) for axis, x in zip(self.axes, place, strict=False)},
            "pressure_beside_largest_MPa": float(weights @ pressure[near] / weights.sum()),
            **(
                {}
                if zone is None
                else {name: round(float(n), 1) for name, n in zip(self.names, zone.nodes, strict=True)}
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
