"""Substructuring: every rank eliminates the inside of its own cells of a body, and one rank joins what is left.

A rank's own cells give a part of K. The boundary b has the degrees of freedom that the rank shares with others, and all
of the contact surface; the others i lie inside:

    S = K_bb - K_bi K_ii^-1 K_ib    by MUMPS, on each rank at once.

The owner adds up the S of all ranks, the contact surface last, so that the last rows of the sum's Cholesky factor are
that of the surface's Schur complement. A solution goes the same way up with forces, and down again with displacements.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.linalg
from dolfinx import fem, la
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from fenwear.algebra.assembled import assembled_here
from fenwear.algebra.factor import Factor, condense_only, factored_here, schur_complement, solved, without_factor
from fenwear.common.arrays import Array, Mask

Numbers = NDArray[np.int64]


class Boundary:
    """The boundary of this rank's own cells of a body.

    Attributes:
        present: Which local blocks of degrees of freedom the cells have (n,).
        numbers: Global numbers of the boundary's degrees of freedom, ascending (b,).
        local: The same by their local numbers.
        size: Number on all ranks together; infinite where a rank has nothing else.
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
        kept = np.isin(numbers, surface // block) | (ranks.array > 1.5)
        local = np.flatnonzero(self.present & kept)
        local = local[np.argsort(numbers[local])]
        axes = np.arange(block)
        self.local = (block * local[:, None] + axes).ravel()
        self.numbers = (block * numbers[local][:, None] + axes).ravel()
        size, comm = float(block * kept[: index_map.size_local].sum()), space.mesh.comm
        self.size = float(comm.allreduce(size if len(local) < count else np.inf))


class Substructures(Factor):
    """The factor of K as substructures."""

    is_spread = is_moved = False
    has_schur = True  # it solves on the surface alone

    def __init__(
        self,
        form: fem.Form,
        bcs: Sequence[fem.DirichletBC],
        boundary: Boundary,
        surface: Numbers,
        *,
        prefix: str,
        comm: MPI.Comm,
        owner: int,
    ) -> None:
        """Take what it is made from.

        Args:
            form: Of K, symmetric and positive definite with its supports.
            bcs: Supports of the body.
            boundary: Of this rank's cells.
            surface: Global numbers of the contact surface's degrees of freedom (m,).
            prefix: Of PETSc's options.
            comm: The ranks.
            owner: The rank that joins the others.
        """
        self._form, self._bcs, self._boundary, self._stays = form, bcs, boundary, surface
        self._prefix, self.comm, self.owner, self.is_made = prefix, comm, owner, False
        self.copies = range(owner, owner + 1)
        self._inside: PETSc.Mat | None = None  # the factor of what lies inside
        self._local: Array = np.zeros((0, 0))  # right-hand sides that are being solved for
        self._places: list[Numbers] = []  # of each rank's boundary among all, on the owner
        self._joint: Array = np.zeros((0, 0))  # Cholesky factor of all boundaries, there

    def compute(self) -> None:
        """Eliminate the inside of this rank's own cells.

        Raises:
            ConvergenceError: it has no factor.
        """
        self.is_made = True
        matrix = assembled_here(self._form, self._bcs, self._boundary.present)
        self._size = matrix.getSize()[0]
        self._inside = factored_here(matrix, self._prefix, self._boundary.local)
        self._schur = schur_complement(self._inside, len(self._boundary.local))
        condense_only(self._inside)  # a part without supports could not be solved for by itself
        matrix.destroy()

    def join(self) -> None:
        """Add up what the ranks have left, on the owner; collective.

        Raises:
            ConvergenceError: the sum is not positive.
        """
        numbers = self.comm.gather(self._boundary.numbers, root=self.owner)
        parts = self.comm.gather(self._schur, root=self.owner)
        del self._schur
        if numbers is None or parts is None:
            return
        inner = np.setdiff1d(np.unique(np.concatenate(numbers)), self._stays)
        order = np.concatenate([inner, self._stays])
        ascending = np.argsort(order)
        self._places = [ascending[np.searchsorted(order[ascending], of_rank)] for of_rank in numbers]
        joint = np.zeros((len(order), len(order)))
        for at, part in zip(self._places, parts, strict=True):
            joint[np.ix_(at, at)] += part
        try:
            self._joint = scipy.linalg.cholesky(joint, lower=True, overwrite_a=True)
        except np.linalg.LinAlgError as error:
            raise without_factor(self._prefix, "not positive") from error

    def solve_on_surface(self, right: Array) -> Array:
        """Return the surface's part of the solutions for right-hand sides there (m, k), on the owner alone."""
        first = len(self._joint) - len(self._stays)
        return np.asarray(scipy.linalg.cho_solve((self._joint[first:, first:], True), right))

    def gather(self, right: Array) -> Array:
        """Return right-hand sides (owned, k) as forces on all boundaries, on the owner; collective."""
        self._local = np.zeros((self._size, right.shape[1]))
        self._owned = len(right)
        self._local[: self._owned] = right  # what ranks share counts on its owner alone
        assert self._inside is not None
        self._forces = solved(self._inside, self._local)[self._boundary.local]
        gathered = self.comm.gather(self._forces, root=self.owner)
        joint: Array = np.zeros((len(self._joint), right.shape[1]))
        for at, forces in zip(self._places, gathered or [], strict=True):
            joint[at] += forces
        return joint

    def solve_here(self, right: Array) -> Array:
        """Return the displacements of all boundaries, on the owner."""
        return np.asarray(scipy.linalg.cho_solve((self._joint, True), right)) if self.is_owner else right

    def scatter(self, solutions: Array, columns: int) -> Array:
        """Return this rank's part of solutions (owned, k); collective."""
        del columns
        local_part = self.comm.scatter(
            [solutions[at] for at in self._places] if self.is_owner else None, root=self.owner
        )
        self._local[self._boundary.local] += local_part - self._forces
        assert self._inside is not None
        return solved(self._inside, self._local)[: self._owned]

    def free(self) -> None:
        """Free its memory: it solves no more."""
        if self._inside is not None:
            self._inside.destroy()
        self._inside = None
