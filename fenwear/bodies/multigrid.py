"""Conjugate gradients with an algebraic multigrid, for stiffnesses whose factor does not fit: many columns at once.

Smoothed aggregation (PETSc's GAMG) makes the levels from the rigid motions, which elasticity hardly resists. A
cycle goes down and up them once, with a Chebyshev polynomial of D^-1 A on the upper part of its spectrum before and
after (Adams, Brezina, Hu, Tuminaro 2003). All is done to blocks of columns, so that each entry of a matrix
that is read serves all of them.
"""

from __future__ import annotations

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from fenwear.arrays import Array
from fenwear.bodies.assembly import destroy, times
from fenwear.bodies.factor import Approximate, solved, without_factor
from fenwear.errors import ConvergenceError
from fenwear.parallel import total

ACCURACY = 1e-12  # residual over the right-hand side
ITERATIONS = 500
DEGREE = 3  # of the Chebyshev polynomials
SMOOTHED, BEYOND = 0.1, 1.1  # part of the spectrum that they damp, of the largest eigenvalue as it is estimated
POWERS = 12  # iterations for that


class _Level:
    """A matrix of the hierarchy, with its smoother and what brings fields from the next coarser one."""

    def __init__(self, matrix: PETSc.Mat, up: PETSc.Mat, comm: MPI.Comm) -> None:
        self.matrix, self.up = matrix, up
        self.down = PETSc.Mat()
        up.transpose(self.down)
        diagonal = matrix.getDiagonal()
        self._inverse: Array = 1.0 / np.array(diagonal.array_r)[:, None]
        diagonal.destroy()
        # The largest eigenvalue of D^-1 A by powers.
        field: Array = np.random.default_rng(0).random((len(self._inverse), 1)) - 0.5
        largest = 1.0
        for _ in range(POWERS):
            field = self._inverse * times(matrix, field)
            largest = float(np.sqrt(total(comm, (field**2).sum(axis=0))[0]))
            field /= largest
        self._middle, self._half = (0.5 * BEYOND * largest * (1 + sign * SMOOTHED) for sign in (1, -1))

    def smoothed(self, right: Array) -> Array:
        """Return a polynomial of D^-1 A times D^-1 b, from zero (Saad 2003, algorithm 12.1)."""
        sigma = self._middle / self._half
        rho = 1 / sigma
        rest: Array = np.multiply(self._inverse, right)
        step: Array = np.divide(rest, self._middle)
        found: Array = step.copy()
        for _ in range(DEGREE - 1):
            rest = np.subtract(rest, self._inverse * times(self.matrix, step))
            before, rho = rho, 1 / (2 * sigma - rho)
            step = rho * before * step + (2 * rho / self._half) * rest
            found += step
        return found


class Multigrid(Approximate):
    """What solves like a factor that all ranks share, without being one: `make_together` makes its levels."""

    def __init__(self, matrix: PETSc.Mat, rigid: Array, prefix: str, comm: MPI.Comm) -> None:
        """Take what it is made from, as `Approximate`.

        Args:
            matrix, prefix, comm: As there.
            rigid: Rigid motions of this rank's own rows (owned, modes).
        """
        super().__init__(matrix, prefix, comm)
        self._rigid = rigid
        self._levels: list[_Level] = []  # the finest first
        self._coarsest: PETSc.Mat | None = None
        self._ksp: PETSc.KSP | None = None
        self.iterations = 0

    def compute(self) -> None:
        """Make the levels; collective.

        Raises:
            ConvergenceError: there are none.
        """
        self.is_made = True
        matrix = self._matrix
        assert matrix is not None
        vectors = []
        for mode in self._rigid.T:
            vector = matrix.createVecRight()
            vector.array[:] = mode
            vectors.append(vector)
        near = PETSc.NullSpace().create(vectors=_orthonormal(vectors), comm=matrix.comm)
        matrix.setNearNullSpace(near)
        ksp = PETSc.KSP().create(matrix.comm)
        ksp.setOptionsPrefix(self._prefix)
        ksp.setOperators(matrix)
        ksp.pc.setType("gamg")
        ksp.setFromOptions()
        try:
            ksp.setUp()
        except PETSc.Error as error:
            raise without_factor(self._prefix, f"reason {error.ierr}") from error
        pc, self._ksp = ksp.pc, ksp
        count = pc.getMGLevels()
        for level in range(count - 1, 0, -1):
            own = matrix if level == count - 1 else pc.getMGSmoother(level).getOperators()[0]
            self._levels.append(_Level(own, pc.getMGInterpolation(level), self.comm))
        coarse = pc.getMGCoarseSolve().getOperators()[0] if count > 1 else matrix
        factor = PETSc.KSP().create(coarse.comm)
        factor.setOperators(coarse)
        factor.setType("preonly")
        factor.pc.setType("cholesky")
        factor.pc.setFactorSolverType("mumps")
        factor.setUp()
        self._coarsest = factor.pc.getFactorMatrix()
        self._coarse_sizes = coarse.getSizes()[0]

    def _cycle(self, right: Array, level: int = 0) -> Array:
        """Return about A^-1 times right-hand sides of a level (owned, k)."""
        if level == len(self._levels):
            assert self._coarsest is not None
            return solved(self._coarsest, right, self._coarse_sizes)
        own = self._levels[level]
        found = own.smoothed(right)
        rest = times(own.down, right - times(own.matrix, found))
        found += times(own.up, self._cycle(rest, level + 1))
        found += own.smoothed(right - times(own.matrix, found))
        return found

    def solve_here(self, right: Array) -> Array:
        """Return the solutions of right-hand sides (owned, k), by conjugate gradients for each column; collective.

        Raises:
            ConvergenceError: a column does not reach its accuracy.
        """
        matrix, comm = self._matrix, self.comm
        assert matrix is not None
        x: Array = np.zeros_like(right)
        rest, step = right.copy(), np.zeros_like(right)
        size = _dots(comm, right, right)
        before: Array = np.ones(right.shape[1])
        for self.iterations in range(ITERATIONS):
            if (_dots(comm, rest, rest) <= ACCURACY**2 * size).all():
                return x
            near = self._cycle(rest)
            now = _dots(comm, rest, near)
            step = near + (now / before if self.iterations else 0.0 * now) * step
            image = times(matrix, step)
            along = _dots(comm, step, image)
            length = np.where(along > 0, now / np.where(along > 0, along, 1.0), 0.0)
            x += length * step
            rest -= length * image
            before = np.where(now > 0, now, 1.0)
        raise ConvergenceError(
            f"the columns of PETSc's prefix {self._prefix} did not converge in {ITERATIONS} iterations of conjugate "
            "gradients: expected another setup.way, or elements that are less long and thin"
        )

    def free(self) -> None:
        """Free its memory; collective."""
        if self._ksp is not None:
            destroy(self._ksp)
        self._levels, self._ksp, self._matrix, self._coarsest = [], None, None, None


def _orthonormal(vectors: list[PETSc.Vec]) -> list[PETSc.Vec]:
    for k, vector in enumerate(vectors):
        for other in vectors[:k]:
            vector.axpy(-vector.dot(other), other)
        vector.normalize()
    return vectors


def _dots(comm: MPI.Comm, one: Array, other: Array) -> Array:
    """Return the scalar product of each column with its other (k,), the same on every rank."""
    return total(comm, np.einsum("ik,ik->k", one, other))
