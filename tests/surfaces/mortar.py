"""Transfer between two surfaces whose nodes need not match: dual mortar.

The nodal pressures p_i, forces w_i p_i, act on the other surface as the traction sum of p_i lambda_i,
with the dual functions of the first surface: on each of its facets the lambda_i span the same
polynomials as the shape functions phi_i, and

    integral of lambda_i phi_j = delta_ij w_i,    w_i = integral of phi_i.

T_ij = integral of lambda_i psi_j / w_i takes values from the second surface to the first, and T^T w
takes forces back. The lambda_i add up to one, so that a uniform pressure is transferred exactly (the
patch test); rows of T reproduce polynomials of the first surface's degree, so that force and moment
are kept, and T is the identity where nodes match (Wohlmuth, SIAM J. Numer. Anal. 38, 2000).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fenwear.common.arrays import Array


def transfer_matrix(x1: Array, degree1: int, x2: Array, degree2: int) -> Array:
    """Return T (n1, n2): values at the nodes of the second surface to those of the first.

    Args:
        x1: Ascending abscissae of the first surface's nodes (n1,), within the range of the second's.
        degree1: Its degree; every facet has degree1 + 1 of them, its ends shared.
        x2, degree2: The same of the second surface.
    """
    if len(x1) == len(x2) and degree1 == degree2 and np.allclose(x1, x2, rtol=0, atol=1e-9 * (x1[-1] - x1[0])):
        return np.eye(len(x1))
    cuts = np.concatenate([x1[::degree1], np.clip(x2[::degree2], x1[0], x1[-1])])
    cuts = np.unique(cuts)
    cuts = cuts[np.concatenate([[True], np.diff(cuts) > 1e-12 * (cuts[-1] - cuts[0])])]
    points, gauss = np.polynomial.legendre.leggauss((degree1 + degree2) // 2 + 1)
    centre, half = (cuts[1:] + cuts[:-1]) / 2, np.diff(cuts) / 2
    x = np.clip(centre[:, None] + half[:, None] * points, x2[0], x2[-1])
    nodes1, phi = _shape_functions(x1, degree1, x)
    nodes2, psi = _shape_functions(x2, degree2, x)
    dual = np.einsum("sqk,ski->sqi", phi, _duals(x1, degree1)[nodes1[:, 0] // degree1])
    parts = np.einsum("s,q,sqi,sqj->sij", half, gauss, dual, psi)
    matrix = np.zeros((len(x1), len(x2)))
    np.add.at(matrix, (nodes1[:, :, None], nodes2[:, None, :]), parts)
    return matrix / matrix.sum(axis=1, keepdims=True)  # w_i: the psi_j add up to one


def _shape_functions(nodes: Array, degree: int, x: Array) -> tuple[NDArray[np.int64], Array]:
    """Return the nodes of each segment's facet (segments, degree + 1) and its shape functions at points `x`."""
    ends = nodes[::degree]
    facet = np.clip(np.searchsorted(ends, x.mean(axis=1), side="right") - 1, 0, len(ends) - 2)
    numbers = facet[:, None] * degree + np.arange(degree + 1)
    return numbers, lagrange(nodes[numbers][:, None, :], x)


def lagrange(nodes: Array, x: Array) -> Array:
    """Return the Lagrange polynomials of `nodes` (..., k) at `x` (...), shape (..., k)."""
    difference = x[..., None, None] - nodes[..., None, :]
    spacing = nodes[..., :, None] - nodes[..., None, :]
    same = np.eye(nodes.shape[-1], dtype=bool)
    return (np.where(same, 1.0, difference) / np.where(same, 1.0, spacing)).prod(axis=-1)


def _duals(nodes: Array, degree: int) -> Array:
    """Return the coefficients (facets, k, i) of lambda_i = sum of A_ki phi_k on each facet: A = M^-1 D."""
    numbers = np.arange(0, len(nodes) - 1, degree)[:, None] + np.arange(degree + 1)
    local = nodes[numbers]
    points, gauss = np.polynomial.legendre.leggauss(degree + 1)
    half = (local[:, -1] - local[:, 0]) / 2
    x = (local[:, -1] + local[:, 0])[:, None] / 2 + half[:, None] * points
    phi = lagrange(local[:, None, :], x)
    mass = np.einsum("f,q,fqi,fqj->fij", half, gauss, phi, phi)
    return np.linalg.inv(mass) * np.einsum("f,q,fqi->fi", half, gauss, phi)[:, None, :]
