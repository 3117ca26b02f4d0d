"""Overlap of two surfaces: geometry in a common chart, no mechanics.

A chart takes the points of both surfaces to coordinates s in R^(d - 1): the plane of a flat contact, or of
a patch of a curved one. In it the facets are intervals, triangles or quadrilaterals with straight edges, and two of
them meet in an interval or a convex polygon, which is cut into simplices: everything that follows is a sum
over these. Polygons are clipped edge by edge (Sutherland and Hodgman, Comm. ACM 17, 1974).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TypeAlias

import basix
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from fenwear.common.arrays import Array, Mask
from fenwear.common.errors import CaseError, InputError

Indices: TypeAlias = NDArray[np.int64]

SLACK = 1e-6  # of the surface's size: how far the first surface may reach beyond the second
CURVED, CURVED_STEPS = 1e-13, 20  # of the surface's size: rounding of a point's place; Newton steps to it
ASTRAY, FOLDED = 1e-9, 1e3  # of the surface's size: what Newton's method may leave, and where it has no end
BENT = 4  # degrees more where facets are bent, in which no quadrature is exact: its error falls to rounding
ONTO = 1e-3  # of a facet: how far beyond its straight edges a point may be that its curved ones take in
NOTHING = 1e-12  # of the smaller of two polygons: they share an edge up to rounding, no area
RING = {"interval": [0, 1], "triangle": [0, 1, 2], "quadrilateral": [0, 1, 3, 2]}  # basix' corners in order around


@dataclass(frozen=True)
class ChartedSurface:
    """A contact surface laid out in a chart, where its facets do not overlap.

    The pressure lives at all trace nodes of intervals and quadrilaterals, and at the vertices of triangles,
    whose other nodes have no or negative weights; not at nodes on the axis of rings that have no weight.
    Facets with curved edges are taken by their corners.

    Attributes:
        s: Chart coordinates of the trace nodes (N, d - 1), mm.
        facets: Trace nodes of each facet (f, k), in the order of basix' Lagrange element (gll_warped) on the cell;
            facets come in any order and orientation.
        cell: "interval", "triangle" or "quadrilateral".
        degree: Polynomial degree of the trace.
        nodes: Trace nodes that carry a pressure, in the order of the pressure nodes (n,).
    """

    s: Array
    facets: Indices
    cell: str
    degree: int
    nodes: Indices

    @property
    def pressure_degree(self) -> int:
        """Polynomial degree of the pressure on a facet."""
        return 1 if self.cell == "triangle" else self.degree

    @cached_property
    def pressure_facets(self) -> Indices:
        """Pressure nodes of each facet, numbered as in `nodes`; -1 for one that carries none."""
        number = np.full(len(self.s), -1)
        number[self.nodes] = np.arange(len(self.nodes))
        return number[self.facets[:, :3] if self.cell == "triangle" else self.facets]

    @property
    def corners(self) -> Array:
        """Corners of each facet in the order of basix (f, c, d - 1), mm."""
        return self.s[self.facets[:, : len(RING[self.cell])]]

    @property
    def extent(self) -> float:
        """Longest side of the box around the surface, mm."""
        return float(np.ptp(self.s, axis=0).max())

    @property
    def bent(self) -> bool:
        """Whether a facet is anything but an interval, triangle or parallelogram with its nodes at their places."""
        corners, reference = self.corners, _element(self.cell, self.degree).points
        sides = corners[:, 1 : 1 + reference.shape[1]] - corners[:, :1]
        away = self.s[self.facets] - corners[:, :1] - reference @ sides
        return bool(np.abs(away).max(initial=0.0) > ASTRAY * self.extent)

    def shape_functions(self, points: Array) -> Array:
        """Return the trace's shape functions at reference points (q, d - 1), shape (q, k)."""
        return tabulate(self.cell, self.degree, points)

    def pressure_functions(self, points: Array) -> Array:
        """Return the shape functions of the pressure nodes at reference points (q, d - 1)."""
        return tabulate(self.cell, self.pressure_degree, points)


@dataclass(frozen=True)
class Overlap:
    """Quadrature where the facets of two surfaces lie over each other.

    It is exact for products of two shape functions of the first surface, or of one of each, and to rounding where
    facets are bent: else it would depend on how the simplices of an overlap lie, which rounding decides. Points come
    simplex by simplex, `per_simplex` of them each.

    Attributes:
        facet1, facet2: Facets that meet at each point (q,).
        points1, points2: Reference coordinates on them (q, d - 1).
        weights: Weights in the chart's measure (q,), mm^(d - 1).
        per_simplex: Points in each simplex.
        covered_facets: Whether each facet of the first surface lies within the second (f1,).
        covered: Whether all facets of each pressure node of the first surface do (n1,).
    """

    facet1: Indices
    facet2: Indices
    points1: Array
    points2: Array
    weights: Array
    per_simplex: int
    covered_facets: Mask
    covered: Mask


@dataclass(frozen=True)
class Patch:
    """Parts of two surfaces laid out in one chart, where they lie over each other.

    Attributes:
        first, second: Facets of both that are seen there; their nodes are numbered as on the whole surfaces.
        common: Their overlap.
    """

    first: ChartedSurface
    second: ChartedSurface
    common: Overlap

    @classmethod
    def of(cls, first: ChartedSurface, second: ChartedSurface) -> Patch:
        """Lay one surface over the other."""
        return cls(first, second, overlap(first, second))


@dataclass(frozen=True)
class NodeAreas:
    """The parts of a surface that belong to its pressure nodes.

    Attributes:
        polygons: Corners of the parts in order around (m, c, d - 1), mm; ends of intervals in a plane.
        node: Pressure node that each part belongs to (m,).
        sizes: Area (length) of each pressure node (n,), mm^(d - 1).
    """

    polygons: Array
    node: Indices
    sizes: Array


def overlap(first: ChartedSurface, second: ChartedSurface) -> Overlap:
    """Return quadrature points on all pairs of facets that lie over each other.

    Uncovered is a facet of the first surface where a strip wider than SLACK times the surface's size is left, or
    more than half of it.
    """
    corners1, corners2 = first.corners, second.corners
    ring1, ring2 = corners1[:, RING[first.cell]], corners2[:, RING[second.cell]]
    facet1, facet2, simplices = _intersect(ring1, ring2)
    flat = corners1.shape[2]
    degree, other = (surface.degree * (2 if surface.cell == "quadrilateral" else 1) for surface in (first, second))
    shape = basix.CellType.interval if flat == 1 else basix.CellType.triangle
    extra = BENT if first.bent or second.bent else 0
    points, gauss = basix.make_quadrature(shape, degree + max(degree, other) + extra)
    edges = simplices[:, 1:] - simplices[:, :1]
    s = (simplices[:, :1] + points @ edges).reshape(-1, flat)
    weights = (np.abs(np.linalg.det(edges))[:, None] * gauss).ravel()
    facet1, facet2 = np.repeat(facet1, len(gauss)), np.repeat(facet2, len(gauss))
    size1 = np.abs(_sizes(ring1))
    left = size1 - np.bincount(facet1, weights, minlength=len(corners1))
    diameter = np.linalg.norm(np.ptp(corners1, axis=1), axis=1)
    covered_facets = left <= np.minimum(SLACK * first.extent * diameter ** (flat - 1), size1 / 2)
    covered = np.ones(len(first.nodes), dtype=bool)
    uncovered = first.pressure_facets[~covered_facets]
    covered[uncovered[uncovered >= 0]] = False
    return Overlap(
        facet1,
        facet2,
        _pull_back_curved(first, facet1, s),
        _pull_back_curved(second, facet2, s),
        weights,
        len(gauss),
        covered_facets,
        covered,
    )


def node_areas(surface: ChartedSurface) -> NodeAreas:
    """Divide each facet among its pressure nodes, in the shares of their quadrature weights.

    On intervals and quadrilaterals the cumulated Gauss-Lobatto weights are the borders in each reference
    direction; a triangle is divided from its centroid to the middles of its edges. The sizes are the
    integrals of the nodes' shape functions, on quadrilaterals if they are parallelograms.
    """
    reference = _reference_parts(surface.cell, surface.pressure_degree)
    _, count, flat = reference.shape
    corners = surface.corners
    polygons = tabulate(surface.cell, 1, reference.reshape(-1, flat)) @ corners
    polygons = polygons.reshape(-1, count, flat)
    node: Indices = surface.pressure_facets.ravel()
    polygons, node = polygons[node >= 0], node[node >= 0]
    sizes: Array = np.zeros(len(surface.nodes))
    np.add.at(sizes, node, np.abs(_sizes(polygons)))
    return NodeAreas(polygons, node, sizes)


def node_triangles(surface: ChartedSurface) -> tuple[Array, Indices]:
    """Divide a surface, whose trace may have all coordinates, among its pressure nodes as `node_areas` does.

    Returns:
        Triangles on the curved facets (m, 3, d), mm, and the pressure node that each belongs to (m,).
    """
    reference = _reference_parts(surface.cell, surface.pressure_degree)
    _, count, flat = reference.shape
    shape = surface.shape_functions(reference.reshape(-1, flat))
    polygons = (shape @ surface.s[surface.facets]).reshape(-1, count, surface.s.shape[1])
    node = surface.pressure_facets.ravel()
    fan = np.arange(1, count - 1)
    corners = np.stack([np.zeros_like(fan), fan, fan + 1], axis=1)
    triangles = polygons[node >= 0][:, corners].reshape(-1, 3, polygons.shape[2])
    return triangles, np.repeat(node[node >= 0], len(fan))


def shared_areas(first: ChartedSurface, second: ChartedSurface) -> csr_array:
    """Return the area that each pressure node of the first surface shares with each of the second (n1, n2)."""
    areas1, areas2 = node_areas(first), node_areas(second)
    part1, part2, simplices = _intersect(areas1.polygons, areas2.polygons)
    size = np.abs(_sizes(simplices))
    shape = (len(first.nodes), len(second.nodes))
    return csr_array((size, (areas1.node[part1], areas2.node[part2])), shape=shape)


def reading_at(surface: ChartedSurface, points: Array) -> csr_array | None:
    """Return the matrix from trace nodes to points of the chart (p, N); None with a point off the surface."""
    ring, grain = surface.corners[:, RING[surface.cell]], SLACK * surface.extent
    around = points[:, None] + grain * np.array([-1.0, 1.0])[:, None]
    point, facet = _boxes_that_meet(around, ring)
    local = _pull_back(surface.cell, surface.corners, facet, points[point])
    beyond = np.maximum(local - 1, -local).max(axis=1)
    if surface.cell == "triangle":
        beyond = np.maximum(beyond, local.sum(axis=1) - 1)
    order = np.lexsort((facet, beyond.round(9), point))
    first = order[np.unique(point[order], return_index=True)[1]]
    if len(first) < len(points) or beyond[first].max(initial=0.0) > ONTO:
        return None
    facets = facet[first]
    values = surface.shape_functions(_pull_back_curved(surface, facets, points))
    rows = np.broadcast_to(np.arange(len(points))[:, None], values.shape)
    shape = (len(points), len(surface.s))
    return csr_array((values.ravel(), (rows.ravel(), surface.facets[facets].ravel())), shape=shape)


def tabulate(cell: str, degree: int, points: Array) -> Array:
    """Return the Lagrange shape functions (gll_warped) of a cell at reference points (q, d - 1), shape (q, k)."""
    return _element(cell, degree).tabulate(0, points)[0, :, :, 0]


@lru_cache
def _element(cell: str, degree: int) -> basix.finite_element.FiniteElement:
    variant = basix.LagrangeVariant.gll_warped
    return basix.create_element(basix.ElementFamily.P, basix.CellType[cell], degree, variant)


@lru_cache
def _reference_parts(cell: str, degree: int) -> Array:
    """Return the polygons (k, c, d - 1) that belong to the nodes of the reference cell."""
    if cell == "triangle":
        corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
        after, before = np.roll(corners, -1, axis=0), np.roll(corners, 1, axis=0)
        centroid = np.broadcast_to(corners.mean(axis=0), corners.shape)
        return np.stack([corners, (corners + after) / 2, centroid, (corners + before) / 2], axis=1)
    points, gauss = basix.make_quadrature(basix.CellType.interval, degree)
    lobatto = _element("interval", degree).points[:, 0]
    order = np.argsort(lobatto)
    borders = np.concatenate([[0.0], np.cumsum((gauss @ tabulate("interval", degree, points))[order])])
    borders[-1] = 1.0
    rank = np.abs(_element(cell, degree).points[:, :, None] - lobatto[order]).argmin(axis=2)
    low, high = borders[rank], borders[rank + 1]
    if cell == "interval":
        return np.stack([low, high], axis=1)
    ends = np.stack([low, high])
    return np.stack([np.stack([ends[i, :, 0], ends[j, :, 1]], axis=1) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))], 1)


def _sizes(polygons: Array) -> Array:
    """Return the signed lengths of intervals (m, 2, 1) or areas of polygons (m, c, 2)."""
    if polygons.shape[2] == 1:
        return polygons[:, 1, 0] - polygons[:, 0, 0]
    spokes = polygons[:, 1:] - polygons[:, :1]  # from a corner: no cancellation far from the origin
    return _cross(spokes[:, :-1], spokes[:, 1:]).sum(axis=1) / 2


def _cross(a: Array, b: Array) -> Array:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _pull_back_curved(surface: ChartedSurface, facet: Indices, s: Array) -> Array:
    """Return the reference coordinates (q, d - 1) of the points s (q, d - 1) on facets whose edges may be curved.

    Newton's method on s = sum of phi_a s_a over the facet's trace nodes, from the facet of straight edges on: the
    transfer then takes every node's own place to just this place, so that moments are kept.

    Raises:
        CaseError: a facet folds where the other surface's lies over it.
    """
    points = _pull_back(surface.cell, surface.corners, facet, s)
    if not len(points):
        return points
    nodes, size = surface.s[surface.facets], surface.extent
    element = _element(surface.cell, surface.degree)
    for step in range(CURVED_STEPS + 1):
        table = element.tabulate(1, points)[..., 0]
        rest = s - np.einsum("qa,qad->qd", table[0], nodes[facet])
        slopes = np.einsum("cqa,qad->qdc", table[1:], nodes[facet])
        largest = float(np.abs(rest).max())
        if largest <= CURVED * size:
            break
        if step == CURVED_STEPS or not largest < FOLDED * size or not np.abs(np.linalg.det(slopes)).min() > 0:
            if largest <= ASTRAY * size:
                break
            message = "elements at the contact are so curved that they fold; expected smaller ones there, or order 1"
            raise CaseError(InputError("geometry.order", message))
        points = points + np.linalg.solve(slopes, rest[:, :, None])[:, :, 0]
    return points


def _pull_back(cell: str, corners: Array, facet: Indices, s: Array) -> Array:
    """Return the reference coordinates (q, d - 1) on facets (q,) of the points with chart coordinates s (q, d - 1)."""
    origin, a = corners[:, 0], corners[:, 1] - corners[:, 0]
    r = s - origin[facet]
    if cell == "interval":
        return r / a[facet]
    b = corners[:, 2] - corners[:, 0]
    if cell == "triangle":
        a, b = a[facet], b[facet]
        return np.stack([_cross(r, b), _cross(a, r)], axis=1) / _cross(a, b)[:, None]
    # r = a x + b y + c x y: what is left after a x is parallel to b + c x. Of the two roots the one is taken where
    # the map keeps the orientation of the facet.
    c = corners[:, 3] - corners[:, 2] - a
    side = np.sign(_cross(2 * a + c, 2 * b + c))[facet]
    a, b, c = a[facet], b[facet], c[facet]
    square, linear, constant = -side * _cross(a, c), side * (_cross(r, c) - _cross(a, b)), side * _cross(r, b)
    root = np.sqrt(np.maximum(linear**2 - 4 * square * constant, 0.0))
    x = 2 * constant / (root - linear)  # root is the determinant at (x, y), root - linear twice that at (0, y)
    along = b + c * x[:, None]
    y = np.einsum("qc,qc->q", r - a * x[:, None], along) / np.einsum("qc,qc->q", along, along)
    return np.stack([x, y], axis=1)


def _intersect(first: Array, second: Array) -> tuple[Indices, Indices, Array]:
    """Cut two sets of intervals (m, 2, 1) or convex polygons (m, c, 2) with each other.

    Returns:
        The polygons that meet in each simplex, of the first set and of the second (t,), and its vertices (t, d, d - 1).
    """
    size1, size2 = _sizes(first), _sizes(second)
    polygons1 = np.where(size1[:, None, None] < 0, first[:, ::-1], first)  # ascending, anticlockwise
    polygons2 = np.where(size2[:, None, None] < 0, second[:, ::-1], second)
    i, j = _boxes_that_meet(polygons1, polygons2)
    if first.shape[2] == 1:
        simplices = np.stack(
            [np.maximum(polygons1[i, 0], polygons2[j, 0]), np.minimum(polygons1[i, 1], polygons2[j, 1])], axis=1
        )
        kept = simplices[:, 1, 0] - simplices[:, 0, 0] > NOTHING * np.minimum(abs(size1[i]), abs(size2[j]))
        return i[kept], j[kept], simplices[kept]
    pair, polygons = _clip(polygons1[i], polygons2[j])
    i, j = i[pair], j[pair]
    fan = np.arange(1, polygons.shape[1] - 1)
    simplices = polygons[:, np.stack([np.zeros_like(fan), fan, fan + 1], axis=1)]
    kept = _sizes(simplices.reshape(-1, 3, 2)) > NOTHING * np.repeat(np.minimum(abs(size1[i]), abs(size2[j])), len(fan))
    return np.repeat(i, len(fan))[kept], np.repeat(j, len(fan))[kept], simplices.reshape(-1, 3, 2)[kept]


def _boxes_that_meet(first: Array, second: Array) -> tuple[Indices, Indices]:
    """Return the pairs of polygons (m, c, d - 1) whose boxes overlap."""
    (low1, high1), (low2, high2) = ((polygons.min(axis=1), polygons.max(axis=1)) for polygons in (first, second))
    reach = ((high1 - low1).max(initial=0.0) + (high2 - low2).max(axis=1)) / 2
    near = cKDTree((low1 + high1) / 2).query_ball_point((low2 + high2) / 2, reach, p=np.inf, return_sorted=True)
    i = np.concatenate([np.zeros(0, dtype=np.int64), *near]).astype(np.int64)
    j = np.repeat(np.arange(len(near)), [len(row) for row in near])
    meet = ((low1[i] < high2[j]) & (low2[j] < high1[i])).all(axis=1)
    return i[meet], j[meet]


def _clip(subject: Array, clip: Array) -> tuple[Indices, Array]:
    """Intersect pairs of convex anticlockwise polygons (p, c, 2).

    Returns:
        The pairs that meet, and their common polygons (pairs, vertices, 2), filled up with their last vertex.
    """
    pair = np.arange(len(subject))
    polygons = subject
    for edge in range(clip.shape[1]):
        start, end = clip[pair, edge, None], clip[pair, (edge + 1) % clip.shape[1], None]
        height = _cross(end - start, polygons - start)
        after, following = np.roll(height, -1, axis=1), np.roll(polygons, -1, axis=1)
        inside = height >= 0
        crosses = inside != (after >= 0)
        share = height / np.where(crosses, height - after, 1.0)
        crossing = polygons + np.where(crosses, share, 0.0)[:, :, None] * (following - polygons)
        vertices = np.stack([polygons, crossing], axis=2).reshape(len(pair), 2 * polygons.shape[1], 2)
        present = np.stack([inside, crosses], axis=2).reshape(vertices.shape[:2])
        count = present.sum(axis=1)
        kept = count > 2
        pair, count = pair[kept], count[kept]
        place = np.argsort(~present[kept], axis=1, kind="stable")[:, : count.max(initial=3)]
        place = np.take_along_axis(place, np.minimum(np.arange(place.shape[1]), count[:, None] - 1), axis=1)
        polygons = np.take_along_axis(vertices[kept], place[:, :, None], axis=1)
    return pair, polygons
