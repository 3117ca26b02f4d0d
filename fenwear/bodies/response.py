"""How the contact surfaces of bodies answer to forces on them, each body solved on ranks of its own.

Where the surface is small against the body, the Schur complement S of its degrees of freedom has all of
the answer, (K^-1)_ss = S^-1. Else each column of forces is solved for: sparse right-hand sides, of which
MUMPS leaves out what their zeros do not reach. Columns are solved for in blocks, the same on any ranks, which those
that hold a body's factor share.
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

from fenwear.arrays import Array
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.factor import entries, moved, operations
from fenwear.bodies.schur import available
from fenwear.bodies.substructure import Substructures
from fenwear.parallel import total

BLOCK = 64  # right-hand sides solved at once: enough for BLAS 3, and the memory stays small
SURFACE_SHARE = 10  # entries of the factor for each of the Schur complement, from which on that pays
BOUNDARY_SHARE = 0.5  # of the factor's operations that joining the ranks' boundaries may take

Columns = NDArray[np.int64]
Found = tuple[Array, Array | None]  # what solves for columns: the response, and that to temperature


@dataclass(frozen=True)
class Request:
    """What a body is to be condensed onto.

    Attributes:
        elastic: The body.
        patterns: Share of each trace node in a unit force (N, q).
        directions: One unit vector for each pattern (q, d); None for all axes.
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
    def count(self) -> int:
        """Number of columns q a."""
        return int(self.patterns.shape[1] * self.along.shape[2])

    def identity(self) -> list[object]:
        """Return all that the answer follows from, on this rank."""
        patterns, coupling = csr_array(self.patterns), self.thermal_coupling
        values = [patterns.data, patterns.indices, patterns.indptr, np.asarray(self.along)]
        setup = self.elastic.setup
        return [setup, *self.elastic.identity(), *values, *(() if coupling is None else coupling.getValuesCSR())]

    def on_mesh(self) -> Request:
        """Return the same with patterns on the trace nodes of the mesh, where the contact surface is a grid."""
        reading = self.elastic.reading
        return self if reading is None else replace(self, patterns=csr_array(reading.T @ self.patterns))

    def forces(self, columns: NDArray[np.int64]) -> Array:
        """Return the forces on the trace nodes of some columns (N, d, k): column l a is pattern l along direction a."""
        count = self.along.shape[2]
        along = self.along[columns // count, :, columns % count]
        return np.einsum("Nk,kd->Ndk", self.patterns[:, columns // count].toarray(), along)

    def seen(self, displacement: Array) -> Array:
        """Return what the patterns see of displacements of the trace nodes (N, d, k), as (q, d, k)."""
        q, d = self.patterns.shape[1], self.elastic.dim
        product = self.patterns.T.tocsr() @ displacement.reshape(len(displacement), -1)
        return np.asarray(product).reshape(q, d, -1)

    @property
    def by_surface(self) -> bool:
        """Whether the body is eliminated down to its surface: where that is small against the factor.

        The response to temperature needs the whole body's displacements.
        """
        way, surface = self.elastic.setup.way, self.elastic.surface_dofs.size
        small = surface**2 * SURFACE_SHARE <= entries(self.elastic.size, self.elastic.dim)
        chosen = way in ("substructures", "elimination") or (way == "automatic" and small)
        chosen = chosen and self.elastic.solver == "factor"
        return self.thermal_coupling is None and chosen and available()

    @property
    def in_substructures(self) -> bool:
        """Whether all ranks eliminate the body together: where what they share is small; collective at first use."""
        elastic = self.elastic
        if elastic.setup.reproducible or not self.by_surface:
            return False
        if elastic.setup.way != "automatic":
            return elastic.setup.way == "substructures"
        return elastic.boundary.largest**3 <= BOUNDARY_SHARE * operations(elastic.size, elastic.dim)


def identity(size: int) -> csr_array:
    """Return patterns that are the nodes themselves (size, size)."""
    every = np.arange(size)
    return csr_array((np.ones(size), (every, every)), shape=(size, size))


def respond_together(requests: Sequence[Request]) -> list[tuple[Array, Array | None]]:
    """Return the response (q, d, q a) and that to temperature (q, owned), or None, of each body; collective.

    They are factored, or eliminated in substructures. Each holder of a body's factor solves a block of its columns,
    then all share what they have found: bodies of different holders are solved at once.
    """
    answers = [_Answer(one) for one in requests]
    for number in range(max(answer.rounds for answer in answers)):
        found = [answer.solve(number) for answer in answers]
        for answer, one in zip(answers, found, strict=True):
            answer.share(number, one)
    return [answer.gathered() for answer in answers]


class _Answer:
    """The response of one body, as its blocks of columns are solved for."""

    def __init__(self, request: Request) -> None:
        """Bring to the owner what it needs; collective."""
        elastic, coupling = request.elastic, request.thermal_coupling
        self.request = request
        self.factor = elastic.begin_substructures() if request.in_substructures else elastic.factor
        self.comm: MPI.Comm = self.factor.comm
        held = np.zeros(len(elastic.load))
        held[elastic.supported] = 1.0
        self._held = elastic.trace.pick(held[:, None])[:, :, 0].ravel() > 0
        count = request.count
        whole = request.by_surface and not self.factor.is_spread
        self.blocks: list[Columns] = (
            [np.arange(start, min(start + BLOCK, count)) for start in range(0, count, BLOCK)]
            if not whole
            else [np.arange(count)]
        )
        self._coupling: csr_array | None = None
        self._temperatures: NDArray[np.int64] | None = None
        if coupling is not None:
            self._temperatures = np.append(0, np.cumsum(self.comm.allgather(coupling.getLocalSize()[1])))
            self._coupling = _rows(coupling) if self.factor.is_spread else _rows(moved(coupling, self.factor.holders))
        q, d = request.patterns.shape[1], elastic.dim
        self._response: Array = np.empty((q, d, count))
        self._by_temperature: Array | None = None  # (q, owned): as large as a factor, so there once
        self._filled = 0

    @property
    def rounds(self) -> int:
        """How many blocks a holder of the factor solves, at most."""
        return -(-len(self.blocks) // len(self.factor.holders))

    def _round(self, number: int) -> Iterator[tuple[int, Columns]]:
        """Yield what is solved in a round: the ranks and their blocks."""
        count = len(self.factor.holders)
        yield from zip(self.factor.holders, self.blocks[number * count : (number + 1) * count], strict=False)

    def solve(self, number: int) -> Found | None:
        """Return what this rank solves in a round, if anything; collective where the factor is spread."""
        own = (one for rank, one in self._round(number) if self.factor.is_spread or rank == self.comm.rank)
        columns = next(own, None)
        return None if columns is None else self._solved(columns)

    def _solved(self, columns: Columns) -> Found:
        """Return the response to some columns and G^T times their solutions."""
        elastic, forces = self.request.elastic, self.request.forces(columns)
        at_surface = forces.reshape(-1, len(columns))
        at_surface[self._held] = 0.0
        if isinstance(self.factor, Substructures):
            displacement = self.factor.solve_on_surface(at_surface)
            displacement[self._held] = 0.0
        elif self.factor.is_spread:
            solution = self.factor.solve(elastic.trace.place(at_surface.reshape(forces.shape)))
            displacement = elastic.trace.pick(solution)
        elif self.factor.schur is not None and self._coupling is None:
            displacement = self.factor.solve_on_surface(at_surface)
            displacement[self._held] = 0.0
        else:
            dofs = elastic.surface_dofs
            nodes, which = np.nonzero(at_surface)
            shape = (len(columns), elastic.size)
            right = csr_array((at_surface[nodes, which], (which, dofs[nodes])), shape=shape)
            solution = self.factor.solve_sparse(right)
            displacement = solution[dofs]
        warm = None if self._coupling is None else np.asarray(self._coupling.T @ solution)
        return self.request.seen(displacement.reshape(forces.shape)), warm

    def share(self, number: int, found: Found | None) -> None:
        """Keep what was found in a round; collective."""
        for holder, columns in self._round(number):
            self._share(holder, columns, found if self.factor.is_spread or holder == self.comm.rank else None)

    def _share(self, holder: int, columns: Columns, found: Found | None) -> None:
        """Keep what a rank found for a block, and give each its part of the response to temperature; collective."""
        if found is not None:
            self._response[:, :, _run(columns)] = found[0]
        if self._temperatures is None:
            return
        warm = None if found is None else found[1]
        counts = np.diff(self._temperatures)
        if self.factor.is_spread:
            assert warm is not None
            first, last = self._temperatures[self.comm.rank : self.comm.rank + 2]
            self._fill(total(self.comm, warm)[first:last])
            return
        own = np.empty((counts[self.comm.rank], len(columns)))
        sizes: Any = counts * len(columns)
        sent = None if warm is None else (np.ascontiguousarray(warm), sizes)
        self.comm.Scatterv(sent, own, root=holder)
        self._fill(own)

    def _fill(self, warm: Array) -> None:
        """Keep this rank's part of the response to temperature for a block (owned, k)."""
        if self._by_temperature is None:
            self._by_temperature = np.empty((self.request.count, len(warm)))
        after = self._filled + warm.shape[1]
        self._by_temperature[self._filled : after] = warm.T
        self._filled = after

    def gathered(self) -> tuple[Array, Array | None]:
        """Return the response, all of it on every rank, and that to temperature; collective."""
        for number in range(self.rounds if self.comm.size > 1 else 0):
            for holder, columns in self._round(number):  # where it is spread, equal to the last bit on all ranks
                part = np.ascontiguousarray(self._response[:, :, _run(columns)])
                self.comm.Bcast(part, root=holder)
                self._response[:, :, _run(columns)] = part
        return self._response, self._by_temperature


def _run(columns: Columns) -> slice:
    """Return the same columns, which follow one another, as a slice."""
    return slice(int(columns[0]), int(columns[-1]) + 1)


def _rows(matrix: PETSc.Mat | None) -> csr_array | None:
    """Return this rank's rows of a matrix (owned, all columns)."""
    if matrix is None:
        return None
    starts, columns, values = matrix.getValuesCSR()
    return csr_array((values, columns, starts), shape=(len(starts) - 1, matrix.getSize()[1]))
