"""Where two surfaces lie over each other in a chart."""

from __future__ import annotations

import numpy as np
import pytest
from charted import grid, integrals, line, surface

from fenwear.common.arrays import Array
from fenwear.surfaces.overlap import ChartedSurface, Overlap, node_areas, overlap, shared_areas, tabulate

CELLS = ["triangle", "quadrilateral"]


def pair_sizes(common: Overlap, first: ChartedSurface, second: ChartedSurface) -> Array:
    """Return the size of what each two facets share (f1, f2)."""
    sizes = np.zeros((len(first.facets), len(second.facets)))
    np.add.at(sizes, (common.facet1, common.facet2), common.weights)
    return sizes


def shared(low1: Array, high1: Array, low2: Array, high2: Array) -> Array:
    """Return what intervals share, one by one (m1, m2)."""
    return np.maximum(np.minimum(high1[:, None], high2) - np.maximum(low1[:, None], low2), 0)


def assert_same_places(common: Overlap, first: ChartedSurface, second: ChartedSurface) -> None:
    """Each point has to be the same place on both facets, within them."""
    places = []
    for charted, facet, points in ((first, common.facet1, common.points1), (second, common.facet2, common.points2)):
        places.append(np.einsum("qc,qcd->qd", tabulate(charted.cell, 1, points), charted.corners[facet]))
        assert points.min() > 0
        assert (points.sum(axis=1) if charted.cell == "triangle" else points).max() < 1
    np.testing.assert_allclose(*places, atol=1e-14)


@pytest.mark.parametrize("degrees", [(1, 1), (2, 4), (3, 2)])
def test_intervals(degrees: tuple[int, int]) -> None:
    """Every pair of facets shares what its ends say, in whatever order and orientation they are stored."""
    random = np.random.default_rng(5)
    first = line(np.sort(np.r_[-1, 1, random.uniform(-1, 1, 9)]), degrees[0], 1)
    second = line(np.sort(np.r_[-2, 0.8, random.uniform(-2, 0.8, 14)]), degrees[1], 2)
    common = overlap(first, second)
    ends = [(c.corners.min(axis=1)[:, 0], c.corners.max(axis=1)[:, 0]) for c in (first, second)]
    np.testing.assert_allclose(pair_sizes(common, first, second), shared(*ends[0], *ends[1]), atol=1e-15)
    assert_same_places(common, first, second)


def test_polygons_in_closed_form() -> None:
    """A square and the same turned by 45 degrees share an octagon; two opposite triangles share a hexagon."""
    sides = np.array([-0.5, 0.5])
    square, turned = grid(sides, sides, "quadrilateral", 1), grid(sides, sides, "quadrilateral", 1, turn=np.pi / 4)
    common = overlap(square, turned)
    assert common.weights.sum() == pytest.approx(2 * (np.sqrt(2) - 1), rel=1e-14)
    assert not common.covered.any()
    angle = 2 * np.pi * np.arange(3) / 3
    corners = np.stack([np.cos(angle), np.sin(angle)], axis=1)[None]
    triangle, opposite = surface(corners, "triangle", 1), surface(-corners, "triangle", 1)
    area = 3 * np.sqrt(3) / 4
    assert overlap(triangle, opposite).weights.sum() == pytest.approx(2 / 3 * area, rel=1e-14)


def test_every_pair_of_graded_facets() -> None:
    """On grids graded from 1 to 300 every pair of facets shares the product of what its sides share."""
    graded = np.r_[-1, -1 + np.geomspace(0.006, 2, 12)]
    first = grid(graded, -graded[::-1], "quadrilateral", 2, seed=1)
    second = grid(np.linspace(-1.4, 0.9, 9), graded * 1.1, "quadrilateral", 1, seed=2)
    low1, high1 = first.corners.min(axis=1), first.corners.max(axis=1)
    low2, high2 = second.corners.min(axis=1), second.corners.max(axis=1)
    exact = np.prod([shared(low1[:, c], high1[:, c], low2[:, c], high2[:, c]) for c in range(2)], axis=0)
    np.testing.assert_allclose(pair_sizes(overlap(first, second), first, second), exact, atol=1e-15)


@pytest.mark.parametrize("cell2", CELLS)
@pytest.mark.parametrize("cell1", CELLS)
def test_distorted_facets(cell1: str, cell2: str) -> None:
    """Points are the same place on both facets and cover each facet once; polynomials are integrated exactly."""
    sides = np.linspace(-1, 1, 7)
    first = grid(sides, sides, cell1, 2, distort=0.3, seed=1)
    second = grid(np.linspace(-1.5, 1.5, 8), np.linspace(-1.6, 1.4, 6), cell2, 1, turn=0.3, distort=0.3, seed=2)
    common = overlap(first, second)
    assert_same_places(common, first, second)
    assert common.covered.all()
    assert (common.weights > 0).all()
    x, y = np.einsum("qc,qcd->dq", tabulate(cell1, 1, common.points1), first.corners[common.facet1])
    for powers in ((0, 0), (2, 0), (2, 2), (0, 4)):
        exact = np.prod([2 / (power + 1) for power in powers])
        assert common.weights @ (x ** powers[0] * y ** powers[1]) == pytest.approx(exact, rel=1e-13)
    ring = first.corners[:, [0, 1, 3, 2] if cell1 == "quadrilateral" else [0, 1, 2]]
    after = np.roll(ring, -1, axis=1)
    area = np.abs((ring[..., 0] * after[..., 1] - ring[..., 1] * after[..., 0]).sum(axis=1)) / 2
    np.testing.assert_allclose(np.bincount(common.facet1, common.weights), area, rtol=1e-12)


def test_quadrilaterals_of_any_form() -> None:
    """The inverse of the bilinear map holds in convex quadrilaterals, also where they are almost triangles."""
    random = np.random.default_rng(4)
    angles = np.sort(random.uniform(0, 2 * np.pi, (500, 4)), axis=1)
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=2)
    around = surface(np.array([[[-3.0, -2.0], [3.0, -2.0], [0.0, 4.0]]]), "triangle", 1)
    for corners in ring[:, [0, 1, 3, 2]]:
        first = surface(corners[None], "quadrilateral", 1)
        common = overlap(first, around)
        assert common.covered.all()
        at = tabulate("quadrilateral", 1, common.points1) @ first.corners[0]
        exact = tabulate("triangle", 1, common.points2) @ around.corners[0]
        np.testing.assert_allclose(at, exact, atol=1e-13)
        assert common.points1.min() > 0
        assert common.points1.max() < 1


@pytest.mark.parametrize("beyond", [0.3, 1e-3, 1e-7])
def test_uncovered_nodes(beyond: float) -> None:
    """The nodes are named whose facets reach beyond the other surface by more than a millionth of the size."""
    ends = np.linspace(0, 2, 5)
    first, second = line(ends, 2), line(np.array([-1.0, 1.0, 2.0 - beyond]), 1)
    missing = first.s[first.nodes, 0] > 1.499 if beyond > 1e-6 else np.zeros(9, dtype=bool)
    assert (overlap(first, second).covered == ~missing).all()
    flat = grid(ends, ends, "quadrilateral", 2)
    below = grid(np.array([-1.0, 1.0, 2.0 - beyond]), np.array([-1.0, 1.0, 3.0]), "triangle", 2)
    missing = flat.s[flat.nodes, 0] > 1.499 if beyond > 1e-6 else np.zeros(81, dtype=bool)
    assert (overlap(flat, below).covered == ~missing).all()
    apart = overlap(first, line(np.array([5.0, 6.0]), 2))
    assert len(apart.weights) == 0
    assert not apart.covered.any()


@pytest.mark.parametrize("degree", [1, 2, 3, 4])
def test_node_areas_are_the_weights(degree: int) -> None:
    """Each pressure node owns as much of the surface as the integral of its shape function, and lies in it."""
    x = np.array([-1.0, -0.2, 0.1, 0.9, 1.0])
    for charted in (line(x, degree), *(grid(x, x + 0.1, cell, degree, turn=0.4) for cell in CELLS)):
        areas = node_areas(charted)
        np.testing.assert_allclose(areas.sizes, integrals(charted)[1], rtol=1e-13)
        low, high = areas.polygons.min(axis=1), areas.polygons.max(axis=1)
        at = charted.s[charted.nodes][areas.node]
        assert ((at >= low - 1e-12) & (at <= high + 1e-12)).all()


@pytest.mark.parametrize("degrees", [(1, 1), (2, 3), (4, 2)])
def test_shared_areas_of_grids(degrees: tuple[int, int]) -> None:
    """On grids along the axes what two nodes share is the product of the lengths shared by nodes of lines."""
    random = np.random.default_rng(8)
    x1, y1 = np.sort(np.r_[-1, 1, random.uniform(-1, 1, 4)]), np.sort(np.r_[0, 1, random.uniform(0, 1, 3)])
    x2, y2 = np.sort(np.r_[-2, 1, random.uniform(-2, 1, 5)]), np.sort(np.r_[0, 2, random.uniform(0, 2, 3)])
    lines = [(line(a, degrees[0]), line(b, degrees[1])) for a, b in ((x1, x2), (y1, y2))]
    along = [shared_areas(a, b).toarray() for a, b in lines]
    for (a, b), lengths in zip(lines, along, strict=True):
        assert lengths.sum() == pytest.approx(min(a.s.max(), b.s.max()) - max(a.s.min(), b.s.min()), rel=1e-14)
    first, second = grid(x1, y1, "quadrilateral", degrees[0]), grid(x2, y2, "quadrilateral", degrees[1])
    rows, columns = (
        [
            np.abs(charted.s[charted.nodes, c, None] - side.s[side.nodes, 0]).argmin(axis=1)
            for c, side in enumerate(sides)
        ]
        for charted, sides in ((first, (lines[0][0], lines[1][0])), (second, (lines[0][1], lines[1][1])))
    )
    exact = along[0][np.ix_(rows[0], columns[0])] * along[1][np.ix_(rows[1], columns[1])]
    np.testing.assert_allclose(shared_areas(first, second).toarray(), exact, atol=1e-14)


@pytest.mark.parametrize("cell2", CELLS)
@pytest.mark.parametrize("cell1", CELLS)
def test_shared_areas_add_up(cell1: str, cell2: str) -> None:
    """Over one square, what nodes share adds up to the areas of either surface's nodes."""
    first = grid(np.linspace(0, 1, 6), np.linspace(0, 1, 4), cell1, 2, distort=0.3, seed=1)
    second = grid(np.linspace(0, 1, 5), np.linspace(0, 1, 8), cell2, 3, distort=0.3, seed=2)
    areas = shared_areas(first, second)
    assert areas.data.min() > 0
    np.testing.assert_allclose(areas.sum(axis=1), node_areas(first).sizes, rtol=1e-12)
    np.testing.assert_allclose(areas.sum(axis=0), node_areas(second).sizes, rtol=1e-12)
