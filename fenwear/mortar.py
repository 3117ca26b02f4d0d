"""Transfer between two contact surfaces whose nodes do not lie opposite each other.

A dual mortar: psi_i, on each facet of the punch the combination of its shape functions with
integral psi_i phi_j = delta_ij w_i (Wohlmuth 2000), weighs the strip's surface around each punch
node. Whatever the meshes, a uniform pressure then acts as a uniform pressure on both bodies and
force and moment go over unchanged, which values picked at the nodes do not achieve.
"""

from __future__ import annotations

import numpy as np

from fenwear.arrays import Array
from fenwear.polynomials import interpolation

SLIVER = 1e-9  # of the surface's length: facet ends nearer than that are the same


def mortar_transfer(nodes: Array, degree: int, other: Array, other_degree: int) -> Array:
    """Return the matrix that takes values at the `other` surface's nodes to `nodes` (n, n_other).

    Row i is the integral of psi_i times the other surface's shape functions over w_i. It is exact
    for polynomials of both degrees, and interpolation where the nodes coincide.

    Args:
        nodes: Ascending abscissae; every facet has degree + 1 of them, its ends shared.
        other: The same of the other surface, which spans `nodes`.
    """
    ends, other_ends = nodes[::degree], other[::other_degree]
    slack = SLIVER * (ends[-1] - ends[0])
    inside = other_ends[(other_ends > ends[0] + slack) & (other_ends < ends[-1] - slack)]
    if degree == other_degree and len(inside) == len(ends) - 2 and (np.abs(inside - ends[1:-1]) < slack).all():
        return interpolation(other, other_degree, nodes)  # the same, without rounding
    cuts = np.unique(np.concatenate([ends, inside]))
    cuts = cuts[np.concatenate([[True], np.diff(cuts) > slack])]
    points, weights = _gauss(cuts, (degree + other_degree) // 2 + 1)
    shapes = interpolation(nodes, degree, points)
    facet = np.clip(np.searchsorted(ends, points, side="right") - 1, 0, len(ends) - 2)
    duals = np.zeros_like(shapes)
    for k in range(len(ends) - 1):
        own, columns = facet == k, slice(k * degree, (k + 1) * degree + 1)
        inner, inner_weights = _gauss(ends[k : k + 2], degree + 1)
        local = interpolation(nodes, degree, inner)[:, columns]
        mass = local.T @ (inner_weights[:, None] * local)
        duals[own, columns] = shapes[own, columns] @ np.linalg.inv(mass) * mass.sum(axis=0)
    carried = duals.T @ (weights[:, None] * interpolation(other, other_degree, points))
    return carried / carried.sum(axis=1, keepdims=True)


def _gauss(ends: Array, count: int) -> tuple[Array, Array]:
    """Return the points and weights of Gauss's rule on each of consecutive intervals."""
    points, weights = np.polynomial.legendre.leggauss(count)
    middle, half = (ends[1:] + ends[:-1]) / 2, np.diff(ends) / 2
    return (middle[:, None] + half[:, None] * points).ravel(), (half[:, None] * weights).ravel()
