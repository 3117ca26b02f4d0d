"""Transfer between two surfaces whose facets need not match, patch by patch: dual mortar and wear.

The nodal pressures p_i of the first surface, forces w_i p_i, act as the traction sum of p_i psi_i. On each
facet its dual functions psi_i span the same polynomials as the shape functions lambda_i of the pressure, and

    integral of psi_i lambda_j = delta_ij w_i,    w_i = integral of lambda_i = integral of psi_i

(on a triangle psi_i = 4 lambda_i - 1, on its three vertices). With the shape functions phi_j of the second
surface T_ij = integral of psi_i phi_j / w_i takes values to the first surface, and T^T w takes forces back. As
the psi_i add up to one, a uniform pressure is transferred exactly (the patch test); as T reproduces the
pressure's polynomials, force and moment are kept; T is the identity where nodes match (Wohlmuth, SIAM J.
Numer. Anal. 38, 2000).

The psi_i have negative parts, by which wear would let material grow. Worn depths go by shares of area instead.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array

from fenwear.common.arrays import Array, Mask
from fenwear.surfaces.overlap import Indices, Patch, shared_areas

ROUNDING = 1e-14  # entries of T that are left of zero


def dual_transfer(patches: Sequence[Patch]) -> csr_array:
    """Return T (n1, N2): values at the second surface's trace nodes to the first's pressure nodes.

    The integrals, those of the psi_i too, are sums over the same points, so that constants and the pressure's
    polynomials are reproduced to rounding on facets of any form. Rows of nodes that are not covered are zero.
    """
    matrix = sum((_integrals(patch) for patch in patches[1:]), _integrals(patches[0]))
    matrix = _rows_to_one(matrix)  # by w_i: the phi_j add up to one
    matrix.data[np.abs(matrix.data) < ROUNDING] = 0.0
    covered = np.all([patch.common.covered for patch in patches], axis=0)
    matrix = csr_array(diags_array(covered.astype(float)) @ matrix)
    matrix.eliminate_zeros()
    return _rows_to_one(matrix)


def dual_means(patches: Sequence[Patch], values: Sequence[Array]) -> Array:
    """Return the means of values by the psi_i (n1,), which the transfer takes the second surface's by.

    Args:
        patches: Of the contact.
        values: At the points of each patch's overlap (q,).
    """
    count = len(patches[0].first.nodes)
    sums = np.zeros((2, count))
    for patch, patch_values in zip(patches, values, strict=True):
        duals = _duals(patch)
        if duals is None:
            continue
        at = patch_values[duals.used].reshape(len(duals.number), -1)
        integrals = np.einsum("tpk,tp->tk", duals.weighted, at), duals.weighted.sum(axis=1)
        nodes = patch.first.pressure_facets[duals.facet1]
        for total, part in zip(sums, integrals, strict=True):
            np.add.at(total, nodes[nodes >= 0], np.einsum("tki,tk->ti", duals.dual[duals.number], part)[nodes >= 0])
    return np.asarray(sums[0] / np.where(sums[1] == 0, 1.0, sums[1]))


@dataclass(frozen=True)
class _Duals:
    """The psi_i on the facets of a patch.

    Attributes:
        used: Points of the overlap on facets that are covered (q,).
        facet1, facet2: Facets of each simplex (t,).
        number: Of its first facet among those that occur (t,).
        weighted: Shape functions of the pressure, times the quadrature's weights (t, points, k).
        dual: psi_i = sum of dual_ki lambda_k on each facet (facets, k, k).
    """

    used: Mask
    facet1: Indices
    facet2: Indices
    number: Indices
    weighted: Array
    dual: Array


def _duals(patch: Patch) -> _Duals | None:
    """Return the psi_i of a patch; None where nothing is covered."""
    first, common = patch.first, patch.common
    used = common.covered_facets[common.facet1]
    facet1, facet2 = (facet[used][:: common.per_simplex] for facet in (common.facet1, common.facet2))
    if len(facet1) == 0:
        return None
    points = (len(facet1), common.per_simplex)
    basis = first.pressure_functions(common.points1[used]).reshape(*points, -1)
    weighted = basis * common.weights[used].reshape(*points, 1)
    number = np.unique(facet1, return_inverse=True)[1]
    sums = csr_array((np.ones(len(number)), (number, np.arange(len(number)))))
    functions = basis.shape[2]
    mass = (sums @ (weighted.swapaxes(1, 2) @ basis).reshape(len(number), -1)).reshape(-1, functions, functions)
    weights = sums @ weighted.sum(axis=1)
    dual = np.linalg.solve(mass, weights[:, :, None] * np.eye(functions))
    return _Duals(used, facet1, facet2, number, weighted, dual)


def _integrals(patch: Patch) -> csr_array:
    """Return the integrals of psi_i phi_j over the facets of a patch (n1, N2)."""
    first, second = patch.first, patch.second
    shape, duals = (len(first.nodes), len(second.s)), _duals(patch)
    if duals is None:
        return csr_array(shape)
    other = second.shape_functions(patch.common.points2[duals.used]).reshape(*duals.weighted.shape[:2], -1)
    parts = duals.dual.swapaxes(1, 2)[duals.number] @ (duals.weighted.swapaxes(1, 2) @ other)
    return _assemble(first.pressure_facets[duals.facet1], second.facets[duals.facet2], parts, shape)


def wear_transfer(patches: Sequence[Patch]) -> csr_array:
    """Return W (n1, n2): worn depths at the second surface's pressure nodes to the first's.

    Each entry is the share of node i's area that node k's lies over: none is negative, rows add up to one where
    anything lies over the node. Depths v worn at the first are put down as W^T (w1 v) / w2: volume is kept.
    """
    shared = [shared_areas(patch.first, patch.second) for patch in patches]
    return _rows_to_one(csr_array(sum(shared[1:], shared[0])))


def _assemble(rows: Indices, columns: Indices, parts: Array, shape: tuple[int, int]) -> csr_array:
    """Add up local matrices (t, k, l) of rows (t, k), negative for none, and columns (t, l)."""
    row = np.broadcast_to(rows[:, :, None], parts.shape).ravel()
    column = np.broadcast_to(columns[:, None, :], parts.shape).ravel()
    carries = row >= 0
    return coo_array((parts.ravel()[carries], (row[carries], column[carries])), shape=shape).tocsr()


def _rows_to_one(matrix: csr_array) -> csr_array:
    """Divide each row by its sum; empty rows stay empty."""
    sums = matrix.sum(axis=1)
    data = matrix.data / np.repeat(np.where(sums == 0, 1.0, sums), np.diff(matrix.indptr))
    return csr_array((data, matrix.indices, matrix.indptr), shape=matrix.shape)
