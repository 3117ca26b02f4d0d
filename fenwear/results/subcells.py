"""Elements of a higher degree as linear cells between their nodes: what drawing programs know."""

from __future__ import annotations

from functools import lru_cache

import basix
import numpy as np
import scipy.spatial
from numpy.typing import NDArray

from fenwear.arrays import Array

FLAT = 1e-9  # of the largest of the cells: what Delaunay leaves of points in one plane


@lru_cache
def linear_cells(cell: str, degree: int) -> NDArray[np.int64]:
    """Return the corners (count, k) of the linear cells between the Gauss-Lobatto nodes of an element.

    Corners come around each quadrilateral, and around the bottom and then the top of each hexahedron.

    Args:
        cell: "interval", "triangle", "quadrilateral", "tetrahedron" or "hexahedron".
        degree: Polynomial degree of the element.
    """
    family, variant = basix.ElementFamily.P, basix.LagrangeVariant.gll_warped
    points = basix.create_element(family, basix.CellType[cell], degree, variant).points
    if cell in ("triangle", "tetrahedron"):
        simplices = scipy.spatial.Delaunay(points).simplices.astype(np.int64)
        sizes = _sizes(points, simplices)
        return simplices[sizes > FLAT * sizes.max()]
    dim = points.shape[1]
    grid = np.lexsort(points.T).reshape((degree + 1,) * dim)  # the last axis is x
    low, high = slice(None, -1), slice(1, None)
    if dim == 1:
        return np.stack([grid[low], grid[high]], axis=-1)
    if dim == 2:
        around = [grid[low, low], grid[low, high], grid[high, high], grid[high, low]]
        return np.stack(around, axis=-1).reshape(-1, 4)
    corners = [(low, low), (low, high), (high, high), (high, low)]
    return np.stack([grid[z, y, x] for z in (low, high) for y, x in corners], axis=-1).reshape(-1, 8)


def _sizes(points: Array, simplices: NDArray[np.int64]) -> Array:
    corners = points[simplices]
    return np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1]))
