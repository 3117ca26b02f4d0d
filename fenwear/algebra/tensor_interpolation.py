"""Values at few points of a box, taken to the nodes of a regular grid: one small matrix for each axis.

    L(x, y) = L_x(x) L_y(y)

No array of nodes by points is made: products take as many numbers as there are nodes, times the points of one axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fenwear.common.arrays import Array, Nodes


@dataclass(frozen=True)
class TensorWeights:
    """L (q, m) of q nodes of a grid and m points, the last axis of both the fastest.

    Attributes:
        factors: Of each axis, from its points to its places (k, c).
        at: Place of each node along each axis (q, axes).
    """

    factors: tuple[Array, ...]
    at: NDArray[np.int64]

    @property
    def points(self) -> int:
        """M."""
        return int(np.prod([factor.shape[1] for factor in self.factors]))

    def rows(self, nodes: Nodes = slice(None)) -> Array:
        """Return the rows of some nodes (k, m)."""
        products: Array = np.ones((1, 1))
        for factor, place in zip(self.factors, self.at[nodes].T, strict=True):
            products = products[:, :, None] * factor[place][:, None]
            products = products.reshape(len(products), products.shape[1] * products.shape[2])  # of no nodes, too
        return products

    def to_nodes(self, values: Array) -> Array:
        """Return values at the nodes (q, ...) of those at points (m, ...)."""
        at_points = values.reshape(*(factor.shape[1] for factor in self.factors), -1)
        for axis, factor in enumerate(self.factors):
            at_points = along(factor, at_points, axis)
        return np.asarray(at_points[tuple(self.at.T)]).reshape(-1, *values.shape[1:])

    def to_points(self, values: Array) -> Array:
        """Return the product of the transpose (m, ...) with values at the nodes (q, ...)."""
        return self._gathered(values, [factor.T for factor in self.factors])

    def fitted(self, values: Array) -> Array:
        """Return the values at points (m, ...) that are nearest to those at the nodes of a whole grid (q, ...)."""
        return self._gathered(values, [np.asarray(np.linalg.pinv(factor)) for factor in self.factors])

    def _gathered(self, values: Array, factors: Sequence[Array]) -> Array:
        """Return the product of one matrix for each axis (c, k) with values at the nodes."""
        flat = values.reshape(len(values), -1)
        at_nodes = np.zeros((*(factor.shape[0] for factor in self.factors), flat.shape[1]))
        at_nodes[tuple(self.at.T)] = flat
        for axis, factor in enumerate(factors):
            at_nodes = along(factor, at_nodes, axis)
        return at_nodes.reshape(int(np.prod(at_nodes.shape[:-1])), *values.shape[1:])

    def diagonal(self, between: Array) -> Array:
        """Return the diagonal (q, ...) of L C L^T, with C (m, m, ...) between points."""
        counts = [factor.shape[1] for factor in self.factors]
        rest = between.shape[2:]
        tensor = between.reshape(*counts, *counts, -1)
        if len(counts) == 1:
            at_all = np.einsum("xa,abr,xb->xr", self.factors[0], tensor, self.factors[0], optimize=True)
        else:
            across = np.einsum("xa,aibjr,xb->xijr", self.factors[0], tensor, self.factors[0], optimize=True)
            at_all = np.einsum("yi,xijr,yj->xyr", self.factors[1], across, self.factors[1], optimize=True)
        return np.asarray(at_all[tuple(self.at.T)]).reshape(-1, *rest)

    def within(self, low: Sequence[int], counts: Sequence[int]) -> tuple[Array, ...]:
        """Return the factors over a box of places."""
        return tuple(f[at : at + count] for f, at, count in zip(self.factors, low, counts, strict=True))


def along(matrix: Array, values: Array, axis: int) -> Array:
    """Return the product of a matrix (k, c) with one axis (c) of values (..., c, ...)."""
    return np.moveaxis(np.asarray(np.tensordot(matrix, values, (1, axis))), 0, axis)
