"""Finite-dimensional variational inequalities by PETSc's SNES, on one process.

Find x within its bounds with F_i(x) = 0 where x_i is free, F_i >= 0 where x_i is at its lower and
F_i <= 0 where it is at its upper bound: reduced-space active-set Newton (vinewtonrsls). These
systems are piecewise linear or nearly so, hence full steps, without line search unless asked for.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from petsc4py import PETSc

from fenwear.arrays import Array
from fenwear.errors import ConvergenceError

REASONS = {value: name for name, value in vars(PETSc.SNES.ConvergedReason).items() if isinstance(value, int)}
ZERO_PIVOT = 71  # PETSC_ERR_MAT_LU_ZRPVT


def configure(snes: PETSc.SNES, prefix: str, line_search: str = "basic") -> None:
    """Set what all of fenwear's inequalities share; options with `prefix` override it."""
    snes.setOptionsPrefix(prefix)
    snes.setType("vinewtonrsls")
    # Residuals are scaled to 1 and need few steps; a step that changes nothing ends the iteration.
    snes.setTolerances(rtol=0.0, atol=1e-11, stol=0.0, max_it=100)
    options = PETSc.Options()
    for name, value in (("snes_linesearch_type", line_search), ("snes_vi_zero_tolerance", 1e-12)):
        if not options.hasName(f"{prefix}{name}"):
            options[f"{prefix}{name}"] = value
    snes.ksp.setType("preonly")
    snes.ksp.pc.setType("lu")


def check(snes: PETSc.SNES, what: str) -> None:
    """Raise if the last solve did not converge.

    Raises:
        ConvergenceError: names `what`, PETSc's reason and the options that may help.
    """
    reason = snes.getConvergedReason()
    if reason <= 0:
        raise ConvergenceError(
            f"{what} did not converge: {REASONS.get(reason, reason)} after {snes.getIterationNumber()} iterations, "
            f"residual {snes.getFunctionNorm():.3g} (options: -{snes.getOptionsPrefix()}snes_monitor, ..snes_max_it)"
        )


class _Inequality:
    """A variational inequality on one process, kept for many solves."""

    def __init__(
        self,
        lower: Array,
        upper: Array,
        residual: Callable[[Array, Array], None],
        jacobian: PETSc.Mat,
        fill: Callable[[Array], None],
        prefix: str,
        name: str,
    ) -> None:
        size, comm = len(lower), PETSc.COMM_SELF
        self.iterations = 0  # of the last solve
        self.x = np.zeros(size)
        self.name = name
        self._bounds = [np.clip(b, PETSc.NINFINITY, PETSc.INFINITY) for b in (lower, upper)]
        self._x = PETSc.Vec().createWithArray(self.x, comm=comm)
        self._residual, self._jacobian, self._fill, self._prefix = residual, jacobian, fill, prefix
        self.snes = self._make(prefix, "basic")

    @cached_property
    def _searching(self) -> PETSc.SNES:
        return self._make(f"{self._prefix}search_", "l2")

    def _make(self, prefix: str, line_search: str) -> PETSc.SNES:
        comm = PETSc.COMM_SELF
        snes = PETSc.SNES().create(comm)
        vector = PETSc.Vec().createSeq(len(self.x), comm=comm)
        snes.setFunction(lambda snes, x, f: self._residual(x.array_r, f.array_w), vector)

        def update(_snes: PETSc.SNES, x: PETSc.Vec, J: PETSc.Mat, _P: PETSc.Mat) -> None:
            self._fill(x.array_r)
            J.assemble()

        snes.setJacobian(update, self._jacobian)
        configure(snes, prefix, line_search)
        snes.setVariableBounds(*(PETSc.Vec().createWithArray(b, comm=comm) for b in self._bounds))
        self._set_solver(snes.ksp.pc)
        snes.setFromOptions()
        return snes

    def _set_solver(self, pc: PETSc.PC) -> None:
        """Choose how the Newton steps are solved for."""

    def solve(self, start: Array, *, line_search: bool = False) -> Array:
        """Return the solution (size,), valid until the next solve.

        Args:
            start: Where Newton starts (size,).
            line_search: Whether steps are cut to where the residual is least: slower, but it ends where
                full steps go to and fro between two sets of nodes in contact.

        Raises:
            ConvergenceError: SNES did not converge.
        """
        snes = self._searching if line_search else self.snes
        self.x[:] = start
        try:
            snes.solve(None, self._x)
        except PETSc.Error as error:
            if error.ierr != ZERO_PIVOT:
                raise
            raise ConvergenceError(f"{self.name} did not converge: its Jacobian is singular") from None
        except np.linalg.LinAlgError as error:
            raise ConvergenceError(f"{self.name} did not converge: {error}") from None
        check(snes, self.name)
        self.iterations = snes.getIterationNumber()
        return self.x


class DenseInequality(_Inequality):
    """A variational inequality with a dense Jacobian.

    Args:
        lower, upper: Bounds (size,); infinite where there is none.
        residual: Writes F(x) into its second argument.
        jacobian: Writes dF/dx into its second argument (size, size).
        prefix: Of the PETSc options.
        name: What is solved, for error messages.
    """

    def __init__(
        self,
        lower: Array,
        upper: Array,
        residual: Callable[[Array, Array], None],
        jacobian: Callable[[Array, Array], None],
        prefix: str,
        name: str,
    ) -> None:
        size = len(lower)
        matrix = np.zeros((size, size), order="F")
        dense = PETSc.Mat().createDense((size, size), array=matrix, comm=PETSc.COMM_SELF)
        super().__init__(lower, upper, residual, dense, lambda x: jacobian(x, matrix), prefix, name)


@dataclass
class Bordered:
    """The matrix of blocks that meet in a few quantities only: diag(A_k) + L_k R_j.

    Attributes:
        blocks: A_k (m, size, size).
        left: L_k, on the first n unknowns of each block (m, n, q).
        right: R_j, of the first n unknowns of each block (m, q, n).
    """

    blocks: Array
    left: Array
    right: Array

    def multiply(self, x: Array) -> Array:
        """Return the matrix times x (m size,)."""
        parts = x.reshape(len(self.blocks), -1)
        n = self.left.shape[1]
        result = np.einsum("kij,kj->ki", self.blocks, parts)
        result[:, :n] += self.left @ np.einsum("kqn,kn->q", self.right, parts[:, :n])
        return result.ravel()

    def factor(self, kept: NDArray[np.int32]) -> Callable[[Array], Array]:
        """Return the solution operator of the rows and columns `kept`, by one small factor for each block.

        With z_k = A_k^-1 b_k and Y_k = A_k^-1 L_k the quantities y between the blocks follow from
        (I + sum of R_k Y_k) y = sum of R_k z_k, and x_k = z_k - Y_k y: the work grows with the number of
        blocks, where an elimination of the whole would grow with its cube.

        Raises:
            LinAlgError: a block is singular.
        """
        m, n, q = self.left.shape
        size = self.blocks.shape[1]
        cuts = np.searchsorted(kept, np.arange(m + 1) * size)
        factors, solved, rights = [], [], []
        schur = np.eye(q)
        for k in range(m):
            own = kept[cuts[k] : cuts[k + 1]] - k * size
            nodes = own[own < n]
            block = self.blocks[k][np.ix_(own, own)]
            factor = scipy.linalg.lu_factor(block, check_finite=False)
            if not np.abs(np.diag(factor[0])).min(initial=np.inf) > 1e-14 * np.abs(block).max(initial=0.0):
                raise np.linalg.LinAlgError("its Jacobian is singular")
            columns = np.zeros((len(own), q))
            columns[: len(nodes)] = self.left[k][nodes]
            columns = scipy.linalg.lu_solve(factor, columns, check_finite=False)
            right = self.right[k][:, nodes]
            schur += right @ columns[: len(nodes)]
            factors.append(factor)
            solved.append(columns)
            rights.append(right)
        schur_factor = scipy.linalg.lu_factor(schur, check_finite=False)

        def solve(b: Array) -> Array:
            parts = [
                scipy.linalg.lu_solve(factor, b[cuts[k] : cuts[k + 1]], check_finite=False)
                for k, factor in enumerate(factors)
            ]
            between = sum(
                (right @ part[: right.shape[1]] for right, part in zip(rights, parts, strict=True)), np.zeros(q)
            )
            y = scipy.linalg.lu_solve(schur_factor, between, check_finite=False)
            return np.concatenate([part - columns @ y for part, columns in zip(parts, solved, strict=True)])

        return solve


class _BorderedMatrix:
    """PETSc's view of a bordered matrix: what the active-set method asks of it."""

    def __init__(self, matrix: Bordered, kept: NDArray[np.int32] | None = None) -> None:
        self.matrix, self.kept = matrix, kept

    def mult(self, _mat: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        y.array[:] = self.matrix.multiply(x.array_r)

    def createSubMatrix(self, _mat: PETSc.Mat, rows: PETSc.IS, _columns: PETSc.IS, _out: object) -> PETSc.Mat:  # noqa: N802
        kept = rows.getIndices().copy()
        sub = PETSc.Mat().createPython((len(kept), len(kept)), _BorderedMatrix(self.matrix, kept), PETSc.COMM_SELF)
        sub.setUp()
        return sub


class _BorderedSolver:
    """PETSc's preconditioner that solves with a bordered matrix."""

    def setUp(self, pc: PETSc.PC) -> None:
        context = pc.getOperators()[1].getPythonContext()
        self.solve = context.matrix.factor(context.kept)

    def apply(self, _pc: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        y.array[:] = self.solve(x.array_r)


class BorderedInequality(_Inequality):
    """A variational inequality whose Jacobian is a bordered matrix; arguments as of `DenseInequality`.

    Args:
        jacobian: Updates the matrix at x.
        matrix: The matrix.
    """

    def __init__(
        self,
        lower: Array,
        upper: Array,
        residual: Callable[[Array, Array], None],
        jacobian: Callable[[Array, Bordered], None],
        matrix: Bordered,
        prefix: str,
        name: str,
    ) -> None:
        size = len(lower)
        shell = PETSc.Mat().createPython((size, size), _BorderedMatrix(matrix), comm=PETSc.COMM_SELF)
        shell.setUp()
        super().__init__(lower, upper, residual, shell, lambda x: jacobian(x, matrix), prefix, name)

    def _set_solver(self, pc: PETSc.PC) -> None:
        pc.setType("python")
        pc.setPythonContext(_BorderedSolver())
