"""Static condensation of a body onto its contact surface.

All a half-cycle needs of a body is how its contact surface answers to what acts on it. A pattern of
forces B_l, of the trace nodes, acts along a direction e_l; K u = f + B_l e_l gives the response
U_kl = B_k^T u, all components of the displacement as the pattern k weighs it. As K is symmetric,
e_l . U_lk is also the displacement along e_l from a force in any direction: q solves answer for
normal and tangential forces, as long as displacements are asked for along these directions only.
Where the contact frame changes from place to place every pattern is solved for along every axis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc
from scipy.sparse import csr_array

from fenwear.arrays import Array
from fenwear.bodies.elasticity import ElasticBody
from fenwear.parallel import total

BLOCK = 64  # right-hand sides solved at once: enough for BLAS 3, and the memory stays small


@dataclass(frozen=True)
class CondensedBody:
    """A body condensed onto q patterns of force on its contact surface, per thickness, the same on every rank.

    Attributes:
        patterns: Share of each trace node in a unit force (N, q).
        directions: Along which each pattern was solved for (q, d, a): one direction, or all d axes.
        response: Displacement at each pattern from a unit force of each pattern along each of its
            directions (q, d, q, a), mm per N/mm.
        by_load: Displacement at each pattern from the body's loads (q, d), mm.
        by_temperature: Displacement of each pattern along its one direction from the temperature of this
            rank's own nodes (q, owned), mm/K; None without heat. The one member that differs between ranks.
    """

    patterns: csr_array
    directions: Array
    response: Array
    by_load: Array
    by_temperature: Array | None = None

    def normal_response(self, normal: Array, reading: csr_array | None = None) -> Array:
        """Return the displacement along e_n at each contact node from unit forces along the axes at each (n, n, d).

        Args:
            normal: e_n of the contact nodes (n, d), in the body's own frame.
            reading: Share of each pattern in what a contact node sees, and in the force that it gives
                back (n, q); by default the patterns are the contact nodes'.
        """
        if self.directions.shape[2] == 1:
            # e_l . U_lk = displacement at l along e_l from a force along each axis at k.
            at_patterns = self.response[:, :, :, 0].transpose(2, 0, 1)
            return at_patterns if reading is None else _both_ways(reading, at_patterns)
        q, d = self.by_load.shape
        if reading is None:
            return np.einsum("ic,icjb->ijb", normal, self.response)
        n = len(normal)
        seen = (reading @ self.response.reshape(q, -1)).reshape(n, d, q, d)
        along = np.einsum("ic,iclb->ilb", normal, seen)
        return np.stack([(reading @ along[:, :, b].T).T for b in range(d)], axis=2)


def _both_ways(reading: csr_array, response: Array) -> Array:
    """Return R X_b R^T for each component b of a response (q, q, d)."""
    return np.stack([(reading @ (reading @ response[:, :, b]).T).T for b in range(response.shape[2])], axis=2)


def condense(
    elastic: ElasticBody,
    patterns: csr_array,
    directions: Array | None = None,
    thermal_coupling: PETSc.Mat | None = None,
) -> CondensedBody:
    """Condense a body onto patterns of force: one solve for each and direction with one factorisation; collective.

    With the coupling G of thermal expansion the same solves give B^T K^-1 G, as K is symmetric.

    Args:
        elastic: The body.
        patterns: Share of each trace node in a unit force (N, q).
        directions: One unit vector for each pattern (q, d); by default all axes.
        thermal_coupling: G; needs one direction for each pattern.

    Raises:
        ValueError: a thermal coupling with all axes.
    """
    if thermal_coupling is not None and directions is None:
        raise ValueError("the response to temperature needs one direction for each pattern")
    q, d = patterns.shape[1], elastic.dim
    along = np.broadcast_to(np.eye(d), (q, d, d)) if directions is None else directions[:, :, None]
    count = along.shape[2]
    response = np.empty((q, d, q * count))
    rows: list[Array] = []
    weighted = patterns.T.tocsr()
    # The forces of column l a: pattern l along its direction a.
    for start in range(0, q * count, BLOCK):
        columns = np.arange(start, min(start + BLOCK, q * count))
        forces = np.einsum(
            "Nk,kd->Ndk", patterns[:, columns // count].toarray(), along[columns // count, :, columns % count]
        )
        displacement, by_temperature = _solve(elastic, forces, thermal_coupling)
        if by_temperature is not None:
            rows.append(by_temperature)
        response[:, :, columns] = (weighted @ displacement.reshape(len(forces), -1)).reshape(q, d, -1)
    return CondensedBody(
        patterns,
        along,
        _symmetric(response.reshape(q, d, q, count), along),
        respond_to_load(elastic, patterns),
        np.concatenate(rows) if rows else None,
    )


def _symmetric(response: Array, along: Array) -> Array:
    """Return the response with its part along the directions made symmetric: Maxwell and Betti, up to rounding."""
    q, _, _, count = response.shape
    part = np.einsum("kca,kclb->kalb", along, response).reshape(q * count, q * count)
    change = ((part.T - part) / 2).reshape(q, count, q, count)
    return response + np.einsum("kca,kalb->kclb", along, change)


def respond_to_load(elastic: ElasticBody, patterns: csr_array) -> Array:
    """Return the displacement at each pattern under the body's loads (q, d), mm; collective."""
    return patterns.T @ elastic.trace.pick(elastic.factor.solve(elastic.load)[:, None])[:, :, 0]


def _solve(elastic: ElasticBody, forces: Array, thermal_coupling: PETSc.Mat | None) -> tuple[Array, Array | None]:
    """Return the trace's displacements (N, d, k) from forces on it (N, d, k), and G^T of the whole; collective."""
    right = elastic.trace.place(forces)
    right[elastic.supported] = 0.0
    found = elastic.factor.solve(right)
    return elastic.trace.pick(found), None if thermal_coupling is None else _transposed_times(thermal_coupling, found)


def _transposed_times(matrix: PETSc.Mat, fields: Array) -> Array:
    """Return the transpose of matrix^T fields (k, owned columns), added up in the order of the ranks; collective."""
    starts, columns, values = matrix.getValuesCSR()
    part = csr_array((values, columns, starts), shape=(len(fields), matrix.getSize()[1])).T @ fields
    first, last = matrix.getOwnershipRangeColumn()
    return np.ascontiguousarray(total(matrix.comm.tompi4py(), part)[first:last].T)
