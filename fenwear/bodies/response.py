"""The response of bodies' contact surfaces to forces on them, each body solved on ranks of its own.

Where the surface is small against the body, the Schur complement S of its degrees of freedom has all of
the answer, (K^-1)_ss = S^-1. Else each column of forces is solved for: sparse right-hand sides, of which
MUMPS leaves out what their zeros do not reach. Columns are solved for in blocks, the same on any ranks: those
that have a copy of the factor take turns.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc
from scipy.sparse import csr_array

from fenwear.algebra.factor import available, entries, moved, solve_together
from fenwear.bodies.elasticity import ElasticBody
from fenwear.common.arrays import Array
from fenwear.common.parallel import total

BLOCK = 64  # right-hand sides solved at once: enough for BLAS 3, and the memory stays small
SAME = 1e-9  # of unit vectors: one direction
SURFACE_SHARE = 10  # entries of the factor for each of the Schur complement, from which on that pays


@dataclass(frozen=True)
class Request:
    """Unknowns that a body is condensed onto.

    Attributes:
        elastic: The body.
        patterns: Share of each trace node in a unit force (N, q).
        directions: Unit vector for each pattern (q, d); None for all axes.
        thermal_coupling: G; needs one direction for each pattern.
    """

    elastic: ElasticBody
    patterns: csr_array
    directions: Array | None = None
    thermal_coupling: PETSc.Mat | None = None

    @property
    def along(self) -> Array:
        """The directions of each pattern (q, d, a)."""
        q, d = self.patterns.shape[1], self.elastic.dim
        return np.broadcast_to(np.eye(d), (q, d, d)) if self.directions is None else self.directions[:, :, None]

    @property
    def places(self) -> Array:
        """Places of the patterns (q, d), mm."""
        shares = np.asarray(self.patterns.sum(axis=0)).reshape(-1, 1)
        return np.asarray((self.patterns.T @ self.elastic.surface.trace) / shares)

    @property
    def even_direction(self) -> Array | None:
        """The one direction of all patterns (1, d); None where they are more."""
        if self.directions is None or np.abs(self.directions - self.directions[0]).max() > SAME:
            return None
        return self.directions[:1]

    @property
    def count(self) -> int:
        """Number of columns q a."""
        return int(self.patterns.shape[1] * self.along.shape[2])

    def identity(self) -> list[object]:
        """Return the data that the answer follows from, on this rank."""
        patterns, coupling = csr_array(self.patterns), self.thermal_coupling
        values = [patterns.data, patterns.indices, patterns.indptr, np.asarray(self.along)]
        setup = self.elastic.setup
        return [setup, *self.elastic.identity(), *values, *(() if coupling is None else coupling.getValuesCSR())]

    def on_mesh(self) -> Request:
        """Return the request with patterns on the trace nodes of the mesh, where the contact surface is a grid."""
        reading = self.elastic.reading
        return self if reading is None else replace(self, patterns=csr_array(reading.T @ self.patterns))

    def forces(self, columns: NDArray[np.int64]) -> Array:
        """Return the forces on the trace nodes of some columns (N, d, k): column l a is pattern l along direction a."""
        count = self.along.shape[2]
        along = self.along[columns // count, :, columns % count]
        return np.einsum("Nk,kd->Ndk", self.patterns[:, columns // count].toarray(), along)

    def seen(self, displacement: Array) -> Array:
        """Return the readings by the patterns of displacements of the trace nodes (N, d, k), as (q, d, k)."""
        q, d = self.patterns.shape[1], self.elastic.dim
        product = self.patterns.T.tocsr() @ displacement.reshape(len(displacement), -1)
        return np.asarray(product).reshape(q, d, -1)


def identity(size: int) -> csr_array:
    """Return patterns that are the nodes themselves (size, size)."""
    every = np.arange(size)
    return csr_array((np.ones(size), (every, every)), shape=(size, size))


def by_surface(elastic: ElasticBody) -> bool:
    """Return whether a body may be eliminated down to its surface: where that is small against the factor."""
    return elastic.surface_dofs.size**2 * SURFACE_SHARE <= entries(elastic.size, elastic.dim) and available()


def respond_together(requests: Sequence[Request]) -> list[tuple[Array, Array | None]]:
    """Return the response (q, d, q a) and that to temperature (q, owned), or None, of each body; collective.

    Bodies whose factors are on different ranks are solved at once.
    """
    answers = [_Answer(request) for request in requests]
    response = [answer.solve() for answer in answers]
    for answer in answers:
        answer.factor.free_copies()
    return [answer.shared(*solved) for answer, solved in zip(answers, response, strict=True)]


class _Answer:
    """The response of one body, solved for in blocks of columns."""

    def __init__(self, request: Request) -> None:
        """Bring to the owner what it needs; collective."""
        elastic, coupling = request.elastic, request.thermal_coupling
        self.request = request
        self.factor = elastic.factor
        self.comm: MPI.Comm = self.factor.comm
        held = np.zeros(len(elastic.load))
        held[elastic.supported] = 1.0
        self._held = elastic.trace.pick(held[:, None])[:, :, 0].ravel() > 0
        self._coupling: csr_array | None = None
        self._temperatures: NDArray[np.int64] = np.zeros(0, dtype=np.int64)  # first one of each rank
        if coupling is not None:
            self._temperatures = np.append(0, np.cumsum(self.comm.allgather(coupling.getLocalSize()[1])))
            self._coupling = _rows(coupling if self.factor.is_spread else moved(coupling, self.factor.copies))

    def solve(self) -> tuple[Array, Array | None]:
        """Return the response and G^T times the solutions, on ranks with the factor; collective where it is spread.

        Where it is spread, the second is this rank's own part.
        """
        request = self.request
        response: Array = np.empty((request.patterns.shape[1], request.elastic.dim, request.count))
        warm = None
        for some, rank in self._blocks():
            if self.factor.is_spread or self.comm.rank == rank:
                response[:, :, some], by_heat = self._solved(np.arange(some.start, some.stop))
                if by_heat is not None:
                    warm = np.empty((request.count, len(by_heat))) if warm is None else warm
                    warm[some] = by_heat.T
        return response, warm

    def _blocks(self) -> Iterator[tuple[slice, int]]:
        """Yield the blocks of columns, and the rank that solves for each: those with a copy of the factor in turn."""
        count, copies = self.request.count, self.factor.copies
        size = count if self.factor.has_schur else BLOCK
        for number, first in enumerate(range(0, count, size)):
            yield slice(first, min(first + size, count)), copies[number % len(copies)]

    def _solved(self, columns: NDArray[np.int64]) -> tuple[Array, Array | None]:
        """Return the response to some columns and G^T times their solutions."""
        elastic, factor, forces = self.request.elastic, self.factor, self.request.forces(columns)
        at_surface = forces.reshape(-1, len(columns))
        at_surface[self._held] = 0.0
        warm = None
        if factor.has_schur:
            displacement = factor.solve_on_surface(at_surface)
            displacement[self._held] = 0.0
        elif factor.is_spread:
            solution = solve_together([factor], [elastic.trace.place(at_surface.reshape(forces.shape))])[0]
            displacement = elastic.trace.pick(solution)
        else:
            dofs = elastic.surface_dofs
            nodes, which = np.nonzero(at_surface)
            shape = (len(columns), elastic.size)
            right = csr_array((at_surface[nodes, which], (which, dofs[nodes])), shape=shape)
            solution = factor.solve_sparse(right)
            displacement = solution[dofs]
        if self._coupling is not None:
            warm = np.asarray(self._coupling.T @ solution)
            if factor.is_spread:
                warm = total(self.comm, warm)[slice(*self._temperatures[self.comm.rank :][:2])]
        return self.request.seen(displacement.reshape(forces.shape)), warm

    def shared(self, response: Array, warm: Array | None) -> tuple[Array, Array | None]:
        """Return the response on every rank, and to each its part of that to temperature (q a, owned); collective."""
        if not self.factor.is_spread and self.comm.size > 1:  # where it is spread, equal to the last bit on all ranks
            counts = np.diff(self._temperatures)
            local_part: Array = np.empty((self.request.count, counts[self.comm.rank] if len(counts) else 0))
            for some, rank in self._blocks():
                block = np.ascontiguousarray(response[:, :, some])
                self.comm.Bcast(block, root=rank)
                response[:, :, some] = block
                if len(counts):
                    part = np.empty((local_part.shape[1], some.stop - some.start))
                    sizes: Any = counts * part.shape[1]
                    sent = None if warm is None else (np.ascontiguousarray(warm[some].T), sizes)
                    self.comm.Scatterv(sent, part, root=rank)
                    local_part[some] = part.T
            warm = local_part if len(counts) else None
        return response, warm


def _rows(matrix: PETSc.Mat | None) -> csr_array | None:
    """Return this rank's rows of a matrix (owned, all columns)."""
    if matrix is None:
        return None
    starts, columns, values = matrix.getValuesCSR()
    return csr_array((values, columns, starts), shape=(len(starts) - 1, matrix.getSize()[1]))
