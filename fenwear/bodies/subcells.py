"""Elements of a higher degree as linear cells between their nodes, for drawing programs."""

from __future__ import annotations

from functools import lru_cache
from itertools import permutations

import basix
import numpy as np
from numpy.typing import NDArray


@lru_cache
def linear_cells(cell: str, degree: int) -> NDArray[np.int64]:
    """Return the corners (count, k) of the linear cells between the Gauss-Lobatto nodes of an element.

    Corners come around each quadrilateral, and around the bottom and then the top of each hexahedron.

    Args:
        cell: "interval", "triangle", "quadrilateral", "tetrahedron" or "hexahedron".
        degree: Polynomial degree of the element.
    """
    variant = basix.LagrangeVariant.equispaced  # the order of its nodes is that of the Gauss-Lobatto ones
    points = basix.create_element(basix.ElementFamily.P, basix.CellType[cell], degree, variant).points
    lattice = np.rint(degree * points).astype(np.int64)
    if cell in ("triangle", "tetrahedron"):
        return _simplices(lattice)
    dim = lattice.shape[1]
    grid = np.lexsort(lattice.T).reshape((degree + 1,) * dim)  # the last axis is x
    low, high = slice(None, -1), slice(1, None)
    if dim == 1:
        return np.stack([grid[low], grid[high]], axis=-1)
    if dim == 2:
        around = [grid[low, low], grid[low, high], grid[high, high], grid[high, low]]
        return np.stack(around, axis=-1).reshape(-1, 4)
    corners = [(low, low), (low, high), (high, high), (high, low)]
    return np.stack([grid[z, y, x] for z in (low, high) for y, x in corners], axis=-1).reshape(-1, 8)


def _simplices(lattice: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return Kuhn's division (degree^d, d + 1), which meets that of a neighbour on every side.

    In the sums s_i = a_i + ... + a_d of a node's numbers the element is degree >= s_1 >= ... >= s_d >= 0, and its parts
    are ways from corner to corner of unit cubes, a step along each axis, in any order.

    Args:
        lattice: Numbers a_i of each node along the axes (nodes, d), from 0 to the degree.
    """
    dim = lattice.shape[1]
    sums = np.cumsum(lattice[:, ::-1], axis=1)[:, ::-1]
    node = {tuple(int(n) for n in sums[k]): k for k in range(len(sums))}
    simplices = []
    for start in node:
        for order in permutations(range(dim)):
            steps = np.cumsum(np.eye(dim, dtype=np.int64)[list(order)], axis=0)
            way = [start, *(tuple(int(n) for n in corner) for corner in np.array(start) + steps)]
            if all(corner in node for corner in way):
                simplices.append([node[corner] for corner in way])
    return np.array(simplices, dtype=np.int64)
