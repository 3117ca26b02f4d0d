"""Piecewise polynomials on the nodes of a contact surface."""

from __future__ import annotations

import numpy as np

from fenwear.arrays import Array


def interpolation(nodes: Array, degree: int, x: Array) -> Array:
    """Return the matrix of piecewise Lagrange interpolation from `nodes` to `x`.

    Args:
        nodes: Ascending abscissae; every facet has degree + 1 of them, its ends shared.
        x: Abscissae inside the nodes' range.
    """
    ends = nodes[::degree]
    facet = np.clip(np.searchsorted(ends, x, side="right") - 1, 0, len(ends) - 2)
    columns = facet[:, None] * degree + np.arange(degree + 1)
    local = nodes[columns]
    difference = x[:, None, None] - local[:, None, :]  # point, shape function, factor
    spacing = local[:, :, None] - local[:, None, :]
    same = np.eye(degree + 1, dtype=bool)
    factors = np.where(same, 1.0, difference) / np.where(same, 1.0, spacing)
    matrix = np.zeros((len(x), len(nodes)))
    np.put_along_axis(matrix, columns, factors.prod(axis=2), axis=1)
    return matrix
