"""Linear cells between the nodes of elements tile them."""

from __future__ import annotations

import basix
import numpy as np
import pytest

from fenwear.bodies.subcells import linear_cells

TETRAHEDRA = {8: [(0, 1, 3, 4), (1, 2, 3, 6), (1, 4, 5, 6), (3, 4, 6, 7), (1, 3, 4, 6)], 4: [(0, 1, 2, 3)]}


@pytest.mark.parametrize("degree", [1, 2, 3, 4])
@pytest.mark.parametrize(
    ("cell", "size"),
    [("interval", 1), ("triangle", 1 / 2), ("quadrilateral", 1), ("tetrahedron", 1 / 6), ("hexahedron", 1)],
)
def test_cells_tile_the_element(cell: str, size: float, degree: int) -> None:
    """Their measures, each positive, add up to that of the element."""
    variant = basix.LagrangeVariant.gll_warped
    x = basix.create_element(basix.ElementFamily.P, basix.CellType[cell], degree, variant).points
    corners = linear_cells(cell, degree)
    if cell == "interval":
        sizes = x[corners[:, 1], 0] - x[corners[:, 0], 0]
    elif cell in ("triangle", "quadrilateral"):
        a, b = x[corners, 0], x[corners, 1]
        sizes = np.abs((a * np.roll(b, -1, axis=1) - np.roll(a, -1, axis=1) * b).sum(axis=1)) / 2
    else:
        four = [x[corners[:, list(part)]] for part in TETRAHEDRA[corners.shape[1]]]
        sizes = np.abs([np.linalg.det(p[:, 1:] - p[:, :1]) / 6 for p in four]).sum(axis=0)
    assert (sizes > 0).all()
    assert sizes.sum() == pytest.approx(size, rel=1e-12)


@pytest.mark.parametrize("degree", [1, 2, 3, 4])
@pytest.mark.parametrize(("cell", "sides"), [("triangle", 3), ("tetrahedron", 4)])
def test_parts_of_simplices_meet(cell: str, sides: int, degree: int) -> None:
    """Inside, two parts share each side; outside there are degree^(d - 1) alike on each side of the element."""
    variant = basix.LagrangeVariant.equispaced
    x = basix.create_element(basix.ElementFamily.P, basix.CellType[cell], degree, variant).points
    corners = linear_cells(cell, degree)
    dim = x.shape[1]
    facets = np.sort(np.concatenate([np.delete(corners, k, axis=1) for k in range(dim + 1)]), axis=1)
    facets, times = np.unique(facets, axis=0, return_counts=True)
    assert set(times) <= {1, 2}
    outer = x[facets[times == 1]]
    barycentric = np.concatenate([outer, 1 - outer.sum(axis=2, keepdims=True)], axis=2)
    on_side = (np.abs(barycentric) < 1e-12).all(axis=1)
    np.testing.assert_array_equal(on_side.sum(axis=0), np.full(sides, degree ** (dim - 1)))
    assert on_side.any(axis=1).all()
    # Those of a side have edges along its own edges, whatever its orientation: the neighbour's are the same.
    lengths = np.linalg.norm(outer - np.roll(outer, 1, axis=1), axis=2) if dim == 3 else np.ones((1, 1)) / degree
    allowed = np.array([1.0, np.sqrt(2.0)]) / degree
    assert (np.abs(lengths[..., None] - allowed).min(axis=-1) < 1e-12).all()
