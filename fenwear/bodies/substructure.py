"""Substructuring: every rank eliminates the inside of its own cells, and what is left is joined in pairs.

A rank's own cells give a part of K. Its boundary b are the degrees of freedom that it shares with other
ranks and those of the contact surface; the others i lie inside:

    S = K_bb - K_bi K_ii^-1 K_ib    by MUMPS, on each rank at once.

Two ranks add up their S and eliminate what no other rank shares any more, then pairs of pairs do, until the
last one has the Schur complement of the contact surface. Nothing depends on the order in which messages
arrive. A solution goes the same way up with right-hand sides, and down again with displacements.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from dolfinx import fem, la
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc
from scipy.sparse import csr_array

from fenwear.arrays import Array, Mask
from fenwear.bodies.assembly import assembled_here
from fenwear.bodies.factor import factored_here, raised_together, solved, without_factor
from fenwear.bodies.schur import condense_only, schur_complement
from fenwear.errors import ConvergenceError

Numbers = NDArray[np.int64]
ALWAYS = 1 << 40  # ranks that share a degree of freedom of the contact surface: more than there are, so that it stays


class Boundary:
    """The boundary of this rank's own cells of a body.

    Attributes:
        present: Which local blocks of degrees of freedom the cells have (n,).
        numbers: Global numbers of the boundary's degrees of freedom, ascending (b,).
        local: The same by their local numbers.
        sharing: How many ranks share each (b,).
        largest: b of the rank that has most.
    """

    def __init__(self, space: fem.FunctionSpace, surface: Numbers) -> None:
        """Find it; collective.

        Args:
            space: Of the displacement.
            surface: Global numbers of the degrees of freedom that stay.
        """
        index_map, block = space.dofmap.index_map, space.dofmap.index_map_bs
        cells = space.mesh.topology.index_map(space.mesh.topology.dim).size_local
        count = index_map.size_local + index_map.num_ghosts
        self.present: Mask = np.zeros(count, dtype=bool)
        self.present[space.dofmap.list[:cells]] = True
        ranks = la.vector(index_map)
        ranks.array[:] = self.present
        ranks.scatter_reverse(la.InsertMode.add)
        ranks.scatter_forward()
        numbers = index_map.local_to_global(np.arange(count, dtype=np.int32))
        on_surface = np.isin(numbers, surface // block)
        local = np.flatnonzero(self.present & (on_surface | (ranks.array > 1.5)))
        local = local[np.argsort(numbers[local])]
        axes = np.arange(block)
        self.local = (block * local[:, None] + axes).ravel()
        self.numbers = (block * numbers[local][:, None] + axes).ravel()
        sharing = np.where(on_surface, ALWAYS, ranks.array.round().astype(np.int64))
        self.sharing = np.repeat(sharing[local], block)
        self.largest = int(space.mesh.comm.allreduce(len(self.numbers), MPI.MAX))


@dataclass(frozen=True)
class Part:
    """The cells of some ranks, eliminated down to their boundary.

    Attributes:
        numbers: Global numbers of the boundary's degrees of freedom, ascending (b,).
        having: How many of these ranks have each (b,).
        sharing: How many ranks in all (b,).
        schur: S (b, b).
    """

    numbers: Numbers
    having: Numbers
    sharing: Numbers
    schur: Array


class Joint:
    """Two parts joined to one, whose boundary is what is left."""

    def __init__(self, one: Part, other: Part) -> None:
        """Add them up and eliminate what no other rank shares."""
        numbers = np.union1d(one.numbers, other.numbers)
        self._places = [np.searchsorted(numbers, part.numbers) for part in (one, other)]
        whole = np.zeros((len(numbers), len(numbers)))
        having, sharing = np.zeros((2, len(numbers)), dtype=np.int64)
        for place, part in zip(self._places, (one, other), strict=True):
            whole[np.ix_(place, place)] += part.schur
            having[place] += part.having
            sharing[place] = part.sharing
        gone, left = (np.flatnonzero(these) for these in (having == sharing, having < sharing))
        self._gone, self._left = gone, left
        self._factor = _cholesky(whole[np.ix_(gone, gone)])
        self._across = self._lower(whole[np.ix_(gone, left)])  # L^-1 K_gone,left
        schur = whole[np.ix_(left, left)] - self._across.T @ self._across
        self._part: Part | None = Part(numbers[left], having[left], sharing[left], schur)
        self._forces: Array = np.zeros((0, 0))  # L^-1 f of what has gone, of the solution under way

    def take(self) -> Part:
        """Return the part that both are together, once."""
        assert self._part is not None
        part, self._part = self._part, None
        return part

    def up(self, one: Array, other: Array) -> Array:
        """Return the right-hand sides of what is left from those of the parts (b, k)."""
        whole = np.zeros((len(self._gone) + len(self._left), one.shape[1]))
        for place, forces in zip(self._places, (one, other), strict=True):
            whole[place] += forces
        self._forces = self._lower(whole[self._gone])
        return np.asarray(whole[self._left] - self._across.T @ self._forces)

    def down(self, left: Array) -> tuple[Array, Array]:
        """Return the displacements of both parts' boundaries from those of what is left."""
        whole = np.empty((len(self._gone) + len(self._left), left.shape[1]))
        whole[self._left] = left
        whole[self._gone] = self._lower(self._forces - self._across @ left, transposed=True)
        return whole[self._places[0]], whole[self._places[1]]

    def _lower(self, right: Array, *, transposed: bool = False) -> Array:
        if not len(self._factor):
            return right
        way = {"lower": True, "trans": int(transposed), "check_finite": False}
        return np.asarray(scipy.linalg.solve_triangular(self._factor, right, **way))


def _cholesky(matrix: Array) -> Array:
    """Return L with L L^T a matrix (n, n); not a number where it has none, so that the other ranks need not wait."""
    try:
        return np.asarray(scipy.linalg.cholesky(matrix, lower=True, check_finite=False))
    except np.linalg.LinAlgError:
        return np.full_like(matrix, np.nan)


class Substructures:
    """K of one body, eliminated down to its contact surface: `make_substructures` computes it.

    Attributes:
        owner: The rank that has the Schur complement of the contact surface.
        holders: The same, as of a factor.
        is_made: Whether it is computed.
        is_spread: False: its owner answers for the surface.
        schur: On its owner that Schur complement (m, m), in the order of the surface; else None.
    """

    is_spread = False

    def __init__(
        self,
        form: fem.Form,
        bcs: Sequence[fem.DirichletBC],
        boundary: Boundary,
        surface: Numbers,
        *,
        prefix: str,
        comm: MPI.Comm,
        backwards: bool = False,
    ) -> None:
        """Take what it is made from.

        Args:
            form: Of K, symmetric and positive definite with its supports.
            bcs: Its supports.
            boundary: Of this rank's cells.
            surface: Global numbers of the contact surface's degrees of freedom (m,).
            prefix: Of PETSc's options.
            comm: The ranks.
            backwards: Whether ranks are joined from the last to the first, so that the last is the owner.
        """
        self._form, self._bcs, self._boundary, self._surface = form, bcs, boundary, surface
        self._prefix, self.comm, self._backwards = prefix, comm, backwards
        self.owner, self.is_made = (comm.size - 1 if backwards else 0), False
        self.holders = (self.owner,)
        self._factor: PETSc.Mat | None = None
        self._joints: list[tuple[int, Joint]] = []  # with the ranks that the other parts came from
        self._above: int | None = None  # the rank that the part was sent to
        self._part: Part | None = None
        self.schur: Array | None = None
        self._surface_factor: Array | None = None

    def eliminate(self) -> None:
        """Eliminate the inside of this rank's own cells; collective.

        Raises:
            ConvergenceError: it has no factor.
        """
        self.is_made = True
        boundary = self._boundary
        matrix = assembled_here(self._form, self._bcs, boundary.present)
        if len(boundary.local) == matrix.getSize()[0]:
            starts, columns, values = matrix.convert("seqaij").getValuesCSR()
            schur = csr_array((values, columns, starts), shape=matrix.getSize()).toarray()
            schur = schur[np.ix_(boundary.local, boundary.local)]
        else:
            self._factor = factored_here(matrix, self._prefix, boundary.local)
            schur = schur_complement(self._factor, len(boundary.local))
            if self.comm.size > 1:  # a part without supports could not be solved for by itself
                condense_only(self._factor)
        self._size = matrix.getSize()[0]
        matrix.destroy()
        self._part = Part(boundary.numbers, np.ones_like(boundary.numbers), boundary.sharing, schur)

    def send(self, step: int, tag: int) -> list[MPI.Request]:
        """Begin to send the part to the rank that it is joined on in this step, if it is this one's turn."""
        place = self._place
        if self._part is None or place % (2 * step) != step:
            return []
        part, self._part, self._above = self._part, None, self._rank(place - step)
        numbers = (part.numbers, part.having, part.sharing)
        return [
            self.comm.isend(numbers, self._above, tag),
            self.comm.Isend(np.ascontiguousarray(part.schur), self._above, tag + 1),
        ]

    def receive(self, step: int, tag: int) -> None:
        """Join the part with that of another rank in this step, if there is one."""
        place = self._place
        if self._part is None or place % (2 * step) or place + step >= self.comm.size:
            return
        below = self._rank(place + step)
        numbers, having, sharing = self.comm.recv(source=below, tag=tag)
        schur = np.empty((len(numbers), len(numbers)))
        self.comm.Recv(schur, below, tag + 1)
        joint = Joint(self._part, Part(numbers, having, sharing, schur))
        self._joints.append((below, joint))
        self._part = joint.take()

    def finish(self) -> ConvergenceError | None:
        """Keep the Schur complement of the surface and its factor, on the rank where it has arrived.

        Returns:
            The error if it has no factor.
        """
        if self._part is None:
            return None
        order = np.searchsorted(self._part.numbers, self._surface)
        self.schur = self._part.schur[np.ix_(order, order)]
        self._part = None
        self._surface_factor = _cholesky(self.schur)
        return None if np.isfinite(self._surface_factor).all() else without_factor(self._prefix, "not positive")

    @property
    def _place(self) -> int:
        return self._rank(self.comm.rank)

    def _rank(self, place: int) -> int:
        """Return the rank at a place in the order in which they are joined, or the place of a rank."""
        return int(self.comm.size - 1 - place if self._backwards else place)

    def solve_on_surface(self, right: Array) -> Array:
        """Return the surface's part of the solutions for right-hand sides there (m, k), on the owner alone."""
        return np.asarray(scipy.linalg.cho_solve((self._surface_factor, True), right))

    def surface_solution(self, right: Array) -> Array:
        """Return the surface's part of the solutions (m, k) for right-hand sides (owned, k); collective."""
        if self.comm.allreduce(float(np.abs(right).max(initial=0.0)), MPI.MAX) == 0:
            return np.zeros((len(self._surface), right.shape[1]))
        brought = self._brought(self._local(right))
        found = brought if self._is_whole else self.comm.bcast(self._root_solution(brought), root=self.owner)
        return np.asarray(found[np.searchsorted(np.sort(self._surface), self._surface)])

    def solve(self, right: Array) -> Array:
        """Return the solutions for right-hand sides on this rank's own rows, (owned,) or (owned, k); collective."""
        local = self._local(right.reshape(len(right), math.prod(right.shape[1:])))
        if self._is_whole:
            return self._inside(local).reshape(right.shape)
        forces = self._brought(local)
        found = self._handed_down(self._root_solution(forces))
        local[self._boundary.local] += found - forces
        solution = self._inside(local)
        return solution[: len(right)].reshape(right.shape)

    @property
    def _is_whole(self) -> bool:
        """Whether this rank alone has all, and its factor solves for all."""
        return self.comm.size == 1 and self._factor is not None

    def _local(self, right: Array) -> Array:
        """Return right-hand sides on all that this rank has; what it shares counts on its owner alone."""
        local = np.zeros((self._size, right.shape[1]))
        local[: len(right)] = right
        return local

    def _inside(self, local: Array) -> Array:
        return local if self._factor is None else solved(self._factor, local)

    def _brought(self, local: Array) -> Array:
        """Return the forces on this rank's boundary (b, k), with those inside brought to it."""
        return self._inside(local)[self._boundary.local]

    def _root_solution(self, forces: Array) -> Array | None:
        """Return the surface's displacements (m, k) in ascending order on the owner, None elsewhere; collective."""
        for below, joint in self._joints:
            forces = joint.up(forces, self.comm.recv(source=below))
        if self._above is not None:
            self.comm.send(forces, self._above)
            return None
        ascending = np.argsort(self._surface)
        found = np.empty_like(forces)
        found[ascending] = forces
        return self.solve_on_surface(found)[ascending]

    def _handed_down(self, found: Array | None) -> Array:
        """Return the displacements of this rank's boundary from those of the surface on the owner; collective."""
        if self._above is not None:
            found = self.comm.recv(source=self._above)
        assert found is not None
        for below, joint in reversed(self._joints):
            found, other = joint.down(found)
            self.comm.send(other, below)
        return found


def make_substructures(bodies: Sequence[Substructures]) -> None:
    """Eliminate bodies down to their surfaces, all at once; collective.

    Raises:
        ConvergenceError: a matrix has no factor; on every rank.
    """
    bodies = [body for body in bodies if not body.is_made]
    if not bodies:
        return
    comm, step = bodies[0].comm, 1
    error: ConvergenceError | None = None
    for body in bodies:
        try:
            body.eliminate()
        except ConvergenceError as caught:  # raised below, on all ranks
            error = error or caught
    raised_together(comm, error)
    while step < comm.size:
        requests = [request for k, body in enumerate(bodies) for request in body.send(step, 2 * k)]
        for k, body in enumerate(bodies):
            body.receive(step, 2 * k)
        MPI.Request.waitall(requests)
        step *= 2
    found = [body.finish() for body in bodies]
    raised_together(comm, next((one for one in found if one is not None), None))
