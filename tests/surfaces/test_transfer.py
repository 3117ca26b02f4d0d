"""Transfer between two surfaces in a chart: dual mortar and wear."""

from __future__ import annotations

from dataclasses import replace

import basix
import numpy as np
import pytest
from charted import grid, integrals, line, surface
from mortar import transfer_matrix

from fenwear.common.arrays import Array
from fenwear.surfaces.overlap import ChartedSurface, Patch, node_areas, tabulate
from fenwear.surfaces.transfer import dual_transfer, wear_transfer

CELLS = ["triangle", "quadrilateral"]
QUADS_AND_TRIANGLES = [
    *[("quadrilateral", degree, "quadrilateral", other) for degree, other in ((1, 1), (2, 2), (3, 1), (4, 4))],
    ("quadrilateral", 2, "triangle", 2),
    ("triangle", 2, "quadrilateral", 2),
    ("triangle", 1, "triangle", 2),
]


def ascending(charted: ChartedSurface) -> tuple[Array, Array, Array]:
    """Return the coordinates along a line in order, and what puts pressure and trace nodes in that order."""
    rows, columns = np.argsort(charted.s[charted.nodes, 0]), np.argsort(charted.s[:, 0])
    return charted.s[columns, 0], rows, columns


def pair(cell1: str, degree1: int, cell2: str, degree2: int, count: int = 5) -> tuple[ChartedSurface, ChartedSurface]:
    """Return distorted surfaces, the second turned and larger."""
    sides, larger = np.linspace(-1, 1, count + 1), np.linspace(-1.6, 1.5, 3 * count // 2 + 1)
    first = grid(sides, sides, cell1, degree1, distort=0.25, seed=1)
    return first, grid(larger, larger, cell2, degree2, turn=0.3, distort=0.25, seed=2)


@pytest.mark.parametrize("degree2", [1, 2, 3, 4])
@pytest.mark.parametrize("degree1", [1, 2, 3, 4])
def test_lines(degree1: int, degree2: int) -> None:
    """It is the transfer between surfaces whose nodes are in order, whatever the order of nodes and facets."""
    random = np.random.default_rng(3)
    first = line(np.sort(np.r_[-1, 1, random.uniform(-1, 1, 7)]), degree1, 1)
    second = line(np.sort(np.r_[-1.5, 1.2, random.uniform(-1, 1, 10)]), degree2, 2)
    (x1, rows, _), (x2, _, columns) = ascending(first), ascending(second)
    found = dual_transfer([Patch.of(first, second)]).toarray()[np.ix_(rows, columns)]
    np.testing.assert_allclose(found, transfer_matrix(x1, degree1, x2, degree2), atol=1e-12)


@pytest.mark.parametrize("degrees", [(1, 2), (2, 2), (4, 3)])
def test_grids(degrees: tuple[int, int]) -> None:
    """On grids along the axes it is the product of the transfers between lines."""
    random = np.random.default_rng(8)
    ends = [(np.sort(np.r_[-1, 1, random.uniform(-1, 1, 3)]), np.sort(np.r_[-2, 1.1, random.uniform(-2, 1, 4)]))] * 2
    first = grid(ends[0][0], ends[1][0], "quadrilateral", degrees[0])
    second = grid(ends[0][1], ends[1][1], "quadrilateral", degrees[1])
    exact = np.ones((len(first.nodes), len(second.s)))
    for c, (a, b) in enumerate(ends):
        x1, x2 = (ascending(line(side, degree))[0] for side, degree in zip((a, b), degrees, strict=True))
        rows = np.abs(first.s[first.nodes, c, None] - x1).argmin(axis=1)
        columns = np.abs(second.s[:, c, None] - x2).argmin(axis=1)
        exact *= transfer_matrix(x1, degrees[0], x2, degrees[1])[np.ix_(rows, columns)]
    np.testing.assert_allclose(dual_transfer([Patch.of(first, second)]).toarray(), exact, atol=1e-12)


def test_triangles_below_one_facet() -> None:
    """The rows of triangles are the integrals of 4 lambda_i - 1 times the functions of the one facet opposite."""
    sides = np.linspace(-1, 1, 4)
    first = grid(sides, sides, "triangle", 2, distort=0.3, seed=6)
    second = grid(np.array([-2.0, 1.5]), np.array([-1.2, 3.0]), "quadrilateral", 3)
    points, gauss = basix.make_quadrature(basix.CellType.triangle, 7)
    dual = 4 * tabulate("triangle", 1, points) - 1
    loads, weights = np.zeros((len(first.nodes), len(second.s))), np.zeros(len(first.nodes))
    corner, *_ = second.corners[0]
    inverse = np.linalg.inv(np.stack([second.corners[0, 1] - corner, second.corners[0, 2] - corner]))
    for corners, nodes in zip(first.corners, first.pressure_facets, strict=True):
        scale = abs(np.linalg.det(corners[1:] - corners[0]))
        values = second.shape_functions((tabulate("triangle", 1, points) @ corners - corner) @ inverse)
        for i, node in enumerate(nodes):
            loads[node, second.facets[0]] += scale * (gauss * dual[:, i]) @ values
            weights[node] += scale * gauss @ dual[:, i]
    np.testing.assert_allclose(dual_transfer([Patch.of(first, second)]).toarray(), loads / weights[:, None], atol=1e-13)


@pytest.mark.parametrize(("cell1", "degree1", "cell2", "degree2"), QUADS_AND_TRIANGLES)
def test_polynomials(cell1: str, degree1: int, cell2: str, degree2: int) -> None:
    """Constants, and polynomials up to the pressure's degree and the trace's opposite, are transferred exactly."""
    first, second = pair(cell1, degree1, cell2, degree2)
    transfer = dual_transfer([Patch.of(first, second)])
    np.testing.assert_allclose(transfer.sum(axis=1), 1, rtol=1e-14)
    x, y = first.s[first.nodes].T
    # A distorted quadrilateral has the polynomials of its degree in x and y, all of them.
    degree = min(first.pressure_degree, degree2)
    for power in range(degree + 1):
        for other in range(degree + 1 - power):
            field = second.s[:, 0] ** power * second.s[:, 1] ** other
            np.testing.assert_allclose(transfer @ field, x**power * y**other, atol=1e-11)


@pytest.mark.parametrize(("cell1", "degree1", "cell2", "degree2"), QUADS_AND_TRIANGLES)
def test_uniform_pressure_gives_exact_loads(cell1: str, degree1: int, cell2: str, degree2: int) -> None:
    """Over one rectangle a uniform pressure acts on the other surface as the integrals of its shape functions."""
    first = grid(np.linspace(-1, 1, 6), np.linspace(0, 1, 4), cell1, degree1, turn=0.3, seed=1)
    second = grid(np.linspace(-1, 1, 5), np.linspace(0, 1, 8), cell2, degree2, turn=0.3, seed=2)
    weights = integrals(first)[1]
    np.testing.assert_allclose(dual_transfer([Patch.of(first, second)]).T @ weights, integrals(second)[0], atol=1e-13)


@pytest.mark.parametrize("degree", [1, 2, 3, 4])
def test_identity_where_nodes_match(degree: int) -> None:
    """Nodes opposite each other exchange their own values, however facets are stored."""
    x = np.array([-1.0, -0.2, 0.1, 0.9, 1.0])
    for kind in ("interval", *CELLS):
        if kind == "interval":
            first, second = line(x, degree, 1), line(x, degree, 2)
        else:
            first = grid(x, x, kind, degree, distort=0.3, seed=1)
            turned = surface(first.corners, kind, degree, seed=7)
            second = turned
        apart = np.linalg.norm(first.s[first.nodes][:, None] - second.s, axis=2)
        if first.pressure_degree == degree:
            np.testing.assert_allclose(dual_transfer([Patch.of(first, second)]).toarray(), apart < 1e-9, atol=1e-13)
        assert (wear_transfer([Patch.of(first, second)]).toarray() == (apart[:, second.nodes] < 1e-9)).all()


@pytest.mark.parametrize(("cell", "degree"), [("quadrilateral", 1), ("quadrilateral", 2), ("triangle", 2)])
def test_converges(cell: str, degree: int) -> None:
    """A smooth function is transferred with an order above the pressure's degree as both meshes are refined."""
    errors = []
    for count in (6, 24):
        first, second = pair(cell, degree, "quadrilateral", degree, count)
        values = dual_transfer([Patch.of(first, second)]) @ np.sin(3 * second.s[:, 0] + second.s[:, 1])
        error = values - np.sin(3 * first.s[first.nodes, 0] + first.s[first.nodes, 1])
        errors.append(np.sqrt(np.mean(error**2)))
    assert np.log2(errors[0] / errors[1]) / 2 > first.pressure_degree + 0.7


def test_rows_of_uncovered_nodes_are_zero() -> None:
    """Where the other surface ends, nodes with a facet beyond it get nothing and the others keep constants."""
    sides = np.linspace(0, 1, 5)
    first = grid(sides, sides, "quadrilateral", 2)
    second = grid(np.linspace(-1, 0.6, 4), np.linspace(-1, 2, 4), "triangle", 2)
    sums = dual_transfer([Patch.of(first, second)]).sum(axis=1)
    np.testing.assert_allclose(sums, first.s[first.nodes, 0] < 0.499, atol=1e-14)
    beyond = grid(sides + 7, sides, "quadrilateral", 2)
    for transfer in (dual_transfer([Patch.of(first, beyond)]), wear_transfer([Patch.of(first, beyond)])):
        assert transfer.nnz == 0


def test_patches_add_up() -> None:
    """Facets dealt among patches, seen under other scales, give the same: nodes between have a part in each."""
    first, second = pair("triangle", 2, "quadrilateral", 2)
    whole = [Patch.of(first, second)]
    here = first.s[first.facets].mean(axis=1)[:, 0] < 0.4
    dealt = [
        Patch.of(replace(first, facets=first.facets[part], s=scale * first.s), replace(second, s=scale * second.s))
        for part, scale in ((here, 1.0), (~here, 1.0))
    ]
    for transfer in (dual_transfer, wear_transfer):
        np.testing.assert_allclose(transfer(dealt).toarray(), transfer(whole).toarray(), atol=1e-13)
    steep = [
        dealt[0],
        Patch.of(replace(first, facets=first.facets[~here], s=2 * first.s), replace(second, s=2 * second.s)),
    ]
    found = dual_transfer(steep)
    x = second.s
    for values, at in ((x[:, 0], first.s[:, 0]), (x[:, 1], first.s[:, 1]), (np.ones(len(x)), np.ones(len(first.s)))):
        np.testing.assert_allclose(found @ values, at[first.nodes], atol=1e-12)


@pytest.mark.parametrize(("cell1", "degree1", "cell2", "degree2"), QUADS_AND_TRIANGLES)
def test_wear(cell1: str, degree1: int, cell2: str, degree2: int) -> None:
    """Wear never grows material, keeps constants read and volumes put down, and stays below its place."""
    first, second = pair(cell1, degree1, cell2, degree2)
    transfer = wear_transfer([Patch.of(first, second)])
    assert transfer.data.min() > 0
    np.testing.assert_allclose(transfer.sum(axis=1), 1, rtol=1e-14)
    worn = np.random.default_rng(1).uniform(0, 1, len(first.nodes))
    weights1, weights2 = node_areas(first).sizes, node_areas(second).sizes
    put_down = transfer.T @ (weights1 * worn) / weights2
    assert weights2 @ put_down == pytest.approx(weights1 @ worn, rel=1e-13)
    assert put_down.min() >= 0
    assert put_down.max() <= worn.max() + 1e-14
    # A part of a facet's size is all that a node may be apart from one it shares area with.
    size = max(np.ptp(charted.corners, axis=1).max() for charted in (first, second))
    i, k = transfer.nonzero()
    apart = np.linalg.norm(first.s[first.nodes][i] - second.s[second.nodes][k], axis=1)
    assert apart.max() < 2 * size
