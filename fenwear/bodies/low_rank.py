"""Factors with blocks of low rank, over all ranks: where an exact factor does not fit into the memory.

MUMPS compresses the blocks of its fronts to an accuracy (Amestoy et al., ACM Trans. Math. Software 45, 2019, article
2). What that leaves is taken away by refinement with the matrix itself, x <- x + F^-1 (b - K x), which multiplies the
residual by about the accuracy in each step.
"""

from __future__ import annotations

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from fenwear.arrays import Array
from fenwear.bodies.assembly import times
from fenwear.bodies.factor import Approximate, solved, without_factor
from fenwear.errors import ConvergenceError

COMPRESSED = 1e-7  # accuracy of the blocks
ACCURACY = 1e-13  # residual over the right-hand side
STEPS = 10


class LowRank(Approximate):
    """A factor that all ranks share, whose blocks are compressed: `make_together` computes it."""

    def __init__(self, matrix: PETSc.Mat, prefix: str, comm: MPI.Comm) -> None:
        """Take what it is made from, as `Approximate`."""
        super().__init__(matrix, prefix, comm)
        self._solver = None
        self.steps = 0

    def compute(self) -> None:
        """Factor the matrix; collective.

        Raises:
            ConvergenceError: it has no factor.
        """
        self.is_made = True
        assert self._matrix is not None
        ksp = PETSc.KSP().create(self._matrix.comm)
        ksp.setOptionsPrefix(self._prefix)
        ksp.setOperators(self._matrix)
        ksp.setType("preonly")
        ksp.pc.setType("cholesky")
        ksp.pc.setFactorSolverType("mumps")
        ksp.setFromOptions()
        try:
            ksp.pc.setFactorSetUpSolverType()
            factor = ksp.pc.getFactorMatrix()
            factor.setMumpsIcntl(35, 2)  # in the factor and in solutions
            factor.setMumpsIcntl(37, 1)  # what the fronts hand on as well
            factor.setMumpsCntl(7, COMPRESSED)
            ksp.setUp()
            failed = int(ksp.pc.getFailedReason())
        except PETSc.Error as error:
            failed = error.ierr
        if failed:
            raise without_factor(self._prefix, f"reason {failed}")
        self._solver = ksp.pc.getFactorMatrix()
        ksp.destroy()

    def solve_here(self, right: Array) -> Array:
        """Return the solutions of right-hand sides (owned, k), refined; collective.

        Raises:
            ConvergenceError: a column does not reach its accuracy.
        """
        matrix, factor = self._matrix, self._solver
        assert matrix is not None
        assert factor is not None
        size = self._largest(right)
        x = solved(factor, right, self._sizes)
        before = np.inf
        for self.steps in range(STEPS):
            rest = right - times(matrix, x)
            left = float((self._largest(rest) / np.where(size > 0, size, 1.0)).max(initial=0.0))
            # Rounding ends it, too: a step that takes away no more.
            if left <= ACCURACY or (left < 100 * ACCURACY and left > before / 2):
                return x
            before = left
            x += solved(factor, rest, self._sizes)
        raise ConvergenceError(
            f"the columns of PETSc's prefix {self._prefix} did not converge in {STEPS} steps of refinement: expected "
            "another setup.way"
        )

    def _largest(self, columns: Array) -> Array:
        """Return the largest of each column (k,), the same on every rank."""
        largest = np.abs(columns).max(axis=0, initial=0.0)
        self.comm.Allreduce(MPI.IN_PLACE, largest, op=MPI.MAX)
        return np.asarray(largest)

    def free(self) -> None:
        """Free its memory; collective."""
        if self._solver is not None:
            self._solver.destroy()
        self._solver = self._matrix = None
