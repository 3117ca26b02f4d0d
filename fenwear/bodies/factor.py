"""Factors of sparse matrices, for many solutions that are the same to the last bit in every run.

A factor that is spread over the ranks adds up what they send as it arrives, so that its last bits are
others in every run. Matrices that fit one rank are gathered and factored there, which is also faster
for them; larger ones are spread.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from petsc4py import PETSc

from fenwear.arrays import Array
from fenwear.bodies.assembly import dense, destroy
from fenwear.errors import ConvergenceError
from fenwear.parallel import on_root

GATHERED = 1_000_000  # unknowns that one rank takes


class Factor:
    """The factor of a distributed matrix."""

    def __init__(
        self, matrix: PETSc.Mat, prefix: str, kind: Literal["lu", "cholesky"], *, repeated: bool = False
    ) -> None:
        """Factor a matrix; collective.

        Args:
            matrix: Square; for "cholesky" symmetric and positive definite.
            prefix: Of PETSc's options.
            kind: Of the factor.
            repeated: Whether it solves thousands of times.

        Raises:
            ConvergenceError: it has no factor.
        """
        self._comm, self._sizes = matrix.comm.tompi4py(), matrix.getSizes()[0]
        self._gathered = self._comm.size > 1 and matrix.getSize()[0] <= GATHERED
        self._rows = matrix.getOwnershipRanges()
        if not self._gathered:
            self._ksp: PETSc.KSP | None = _factored(matrix, prefix, kind, repeated=repeated and self._comm.size == 1)
            return
        parts = self._comm.gather(matrix.getValuesCSR())
        made: list[PETSc.KSP] = []
        on_root(self._comm, lambda: made.append(_factored(_joined(parts or [], kind), prefix, kind, repeated=repeated)))
        self._ksp = made[0] if made else None  # of rank 0

    def solve(self, right: Array) -> Array:
        """Return the solutions for right-hand sides on this rank's own rows, (owned,) or (owned, k); collective."""
        columns = right.reshape(len(right), -1)
        if self._gathered or self._ksp is None:
            return self._on_root(columns).reshape(right.shape)
        return _solve(self._ksp, columns, self._sizes).reshape(right.shape)

    def free(self) -> None:
        """Free its memory: it solves no more; collective."""
        if self._ksp is not None:
            self._ksp.destroy()

    def _on_root(self, right: Array) -> Array:
        columns = right.shape[1]
        counts = np.diff(self._rows) * columns
        whole: Array = np.empty((int(self._rows[-1]) if self._comm.rank == 0 else 0, columns))
        own = np.empty(right.shape)
        self._comm.Gatherv(np.ascontiguousarray(right), (whole, counts))
        if self._ksp is not None:
            whole = np.ascontiguousarray(_solve(self._ksp, whole, (len(whole), len(whole))))
        self._comm.Scatterv((whole, counts), own)
        return own


def _solve(ksp: PETSc.KSP, right: Array, sizes: tuple[int, int]) -> Array:
    """Return the solutions of right-hand sides (owned, k); collective."""
    factor = ksp.pc.getFactorMatrix()
    if right.shape[1] == 1:
        before = PETSc.Vec().createWithArray(np.ascontiguousarray(right[:, 0]), size=sizes, comm=ksp.comm)
        after = before.duplicate()
        factor.solve(before, after)
        solution = np.array(after.array_r)[:, None]
    else:
        before = dense(sizes, right, ksp.comm)
        after = before.duplicate()
        factor.matSolve(before, after)
        solution = np.array(after.getDenseArray())
    destroy(before, after)
    return solution


def _joined(parts: list[tuple[Array, Array, Array]], kind: str) -> PETSc.Mat:
    """Return the whole matrix on this rank from the rows of all ranks, as row starts, columns and values."""
    lengths = np.concatenate([np.diff(starts) for starts, _, _ in parts])
    starts = np.concatenate([[0], np.cumsum(lengths)]).astype(PETSc.IntType)
    columns, values = (np.concatenate([part[k] for part in parts]) for k in (1, 2))
    whole = PETSc.Mat().createAIJ((len(lengths),) * 2, csr=(starts, columns, values), comm=PETSc.COMM_SELF)
    whole.setOption(PETSc.Mat.Option.SPD, kind == "cholesky")
    return whole


def _factored(matrix: PETSc.Mat, prefix: str, kind: str, *, repeated: bool) -> PETSc.KSP:
    ksp = PETSc.KSP().create(matrix.comm)
    ksp.setOptionsPrefix(prefix)
    ksp.setOperators(matrix)
    ksp.setType("preonly")
    ksp.pc.setType(kind)
    if repeated:  # PETSc's own factor answers four times as fast as MUMPS
        ksp.pc.setFactorSolverType("petsc")
        ksp.pc.setFactorOrdering("amd")
    else:
        ksp.pc.setFactorSolverType("mumps")
    ksp.setFromOptions()
    try:
        ksp.setUp()
        failed = int(ksp.pc.getFailedReason())
    except PETSc.Error as error:
        failed = error.ierr
    if failed:
        raise ConvergenceError(
            f"the matrix of PETSc's prefix {prefix} has no factor (reason {failed}): a material, a time or a "
            "coefficient is too large or too small to compute with"
        )
    return ksp
