"""Linear cells between the nodes of elements tile them."""

from __future__ import annotations

import basix
import numpy as np
import pytest

from fenwear.results.subcells import linear_cells

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
