"""Factors of sparse matrices, for many solutions that are the same to the last bit in every run.

A factor that is spread over the ranks adds up what they send as it arrives, so that its last bits are
others in every run. A matrix whose factor fits one rank is moved to one, its owner, and factored there,
which is also faster for it. Other ranks make copies where it is to solve for many columns, of which each
solves for a share: columns hardly gain by a factor that is spread. Larger matrices are spread. Factors of
different owners are made at once, and solve at once.

A matrix whose factor does not fit the memory is solved without one, by conjugate gradients on all ranks,
preconditioned by algebraic multigrid (`Iterative`).

Schur complements come from MUMPS, through the C functions of PETSc that petsc4py does not have:

    S = K_ss - K_si K_ii^-1 K_is, and (S^-1) is the part of K^-1 in rows and columns s.

The elimination ends with the rows s, so that K^-1 on a surface costs little more than the factor
alone: no solution for each of its nodes.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Container, Sequence
from functools import cache
from typing import Any, Literal

import numpy as np
import scipy.linalg
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc
from scipy.sparse import csr_array

from fenwear.algebra.assembled import dense, destroy
from fenwear.common.arrays import Array
from fenwear.common.compat import petsc_library
from fenwear.common.errors import ConvergenceError
from fenwear.common.parallel import SMALL, all_together, free_on_ranks

SPREAD = 4 * 2**30  # bytes of a factor: larger ones are spread over the ranks
WORKING = 1.3  # of a factor: what it is made in
TOLERANCE, MOST = 1e-10, 1000  # of solutions without a factor: residual in the preconditioner's norm, iterations
LONG = 2e10  # operations on columns, half a second, for which a copy of the factor pays


def entries(size: int, dim: int) -> int:
    """Return about how many entries the factor of a symmetric matrix has: 5 n log2 n in the plane, 22 n^(4/3) else.

    Nested dissection's growth (George 1973), with constants measured on elements of degree 2 to 4.
    """
    return int(5 * size * math.log2(max(size, 2)) if dim == 2 else 22 * size ** (4 / 3))


def fits(size: int, dim: int, comm: MPI.Comm) -> bool:
    """Return whether the factor of a symmetric matrix fits the memory that the ranks have together; collective."""
    return 8 * WORKING * entries(size, dim) <= max(free_on_ranks(comm), SMALL)


def operations(size: int, dim: int) -> float:
    """Return about how many operations making such a factor takes: 60 n^1.5 in the plane, 8 n² else."""
    return 60.0 * size**1.5 if dim == 2 else 8.0 * size**2


class Factor:
    """The factor of a distributed matrix: `make_together` computes it.

    Attributes:
        is_spread: Whether all ranks share it; else its owner has it.
        is_moved: Whether the matrix is another one than that which was given.
        is_made: Whether it is computed.
        owner: The rank that has it, unless all share it.
        copies: The ranks that have one, the owner first.
        has_schur: Whether it solves on the surface alone.
        schur: On its owner the Schur complement of the surface (m, m), where it was asked for; else None.
    """

    def __init__(
        self,
        matrix: PETSc.Mat,
        prefix: str,
        kind: Literal["lu", "cholesky"],
        *,
        comm: MPI.Comm,
        dim: int,
        owner: int = 0,
        copies: int = 1,
        surface: NDArray[np.int64] | None = None,
    ) -> None:
        """Move a matrix to those that are to hold its factor; collective.

        Args:
            matrix: Square; for "cholesky" symmetric and positive definite.
            prefix: Of PETSc's options.
            kind: Of the factor.
            comm: Ranks of the matrix: PETSc frees its own communicator with the last of its objects.
            dim: Number of space dimensions, for its size.
            owner: The rank that has it, unless it is spread; a rank that has the whole matrix is the owner.
            copies: Number of ranks from the owner on that make one, where it is not spread.
            surface: Rows whose Schur complement is kept (m,), by the owner alone.
        """
        self.comm, self._sizes = comm, matrix.getSizes()[0]
        self._rows: NDArray[np.int64] = np.asarray(matrix.getOwnershipRanges(), dtype=np.int64)
        having = np.flatnonzero(np.diff(self._rows))
        single = len(having) == 1  # a matrix that one rank has is not spread: the same bits on any number of ranks
        self._prefix, self._kind = prefix, kind
        self.owner = int(having[0]) if single else owner % self.comm.size
        needed = 8 * entries(self._sizes[1], dim) * (2 if kind == "lu" else 1)
        self.is_spread = self.comm.size > 1 and not single and needed > SPREAD
        self._surface = None if self.is_spread else surface
        self.has_schur = self._surface is not None
        self.is_moved, self.is_made = self.comm.size > 1 and not self.is_spread, False
        self.copies = range(self.owner, self.owner + (1 if single or self.is_spread or self.has_schur else copies))
        self._matrix: PETSc.Mat | None = _moved(matrix, self.copies, kind) if self.is_moved else matrix
        self._solver: PETSc.Mat | None = None
        self.schur: Array | None = None
        self._schur_factor: Array | None = None

    @property
    def is_owner(self) -> bool:
        """Whether this rank is the owner."""
        return self.comm.rank == self.owner

    @property
    def answers(self) -> bool:
        """Whether this rank solves where all ask: its owner, or all that share it."""
        return self.is_spread or self.is_owner

    def compute(self) -> None:
        """Factor the matrix, on the ranks that have it; collective where it is spread.

        Raises:
            ConvergenceError: it has no factor.
        """
        self.is_made = True
        if self._matrix is None:
            return
        matrix, self._matrix = self._matrix, None
        surface = self._surface
        self._solver = _factored(matrix, self._prefix, self._kind, surface)
        if surface is not None:
            self.schur = schur_complement(self._solver, len(surface))
        if self.is_moved:
            matrix.destroy()

    def join(self) -> None:
        """Join the ranks' parts, where each has one: here one has all; collective."""

    def solve(self, right: Array) -> Array:
        """Return the solutions for right-hand sides on this rank's own rows, (owned,) or (owned, k); collective."""
        return solve_together([self], [right])[0]

    def gather(self, right: Array) -> Array:
        """Return the right-hand sides (owned, k) where they are solved; collective."""
        if self.is_spread or self.comm.size == 1:
            return right
        columns = right.shape[1]
        rights: Array = np.empty((self._sizes[1] if self.is_owner else 0, columns))
        counts: Any = np.diff(self._rows) * columns
        self.comm.Gatherv(np.ascontiguousarray(right), (rights, counts), root=self.owner)
        return rights

    def scatter(self, solutions: Array, columns: int) -> Array:
        """Return this rank's part of solutions (owned, k); collective."""
        if self.is_spread or self.comm.size == 1:
            return solutions
        local_part: Array = np.empty((self._sizes[0], columns))
        counts: Any = np.diff(self._rows) * columns
        self.comm.Scatterv((np.ascontiguousarray(solutions), counts), local_part, root=self.owner)
        return local_part

    def solve_here(self, right: Array) -> Array:
        """Return the solutions of right-hand sides (rows, k) where they are solved; collective where it is spread."""
        factor = self._solver
        if factor is None or not self.answers:
            return right
        return solved(factor, right, self._sizes if self.is_spread else None)

    def solve_sparse(self, right: csr_array) -> Array:
        """Return the solutions (n, k) for the rows of a sparse matrix (k, n), on a rank that has the factor or a copy.

        MUMPS leaves out what the zeros of a right-hand side do not reach.
        """
        assert self._solver is not None
        if self.schur is not None:  # MUMPS takes no sparse right-hand sides with a Schur complement
            return self.solve_here(right.T.toarray())
        size, count = right.shape[1], right.shape[0]
        csr = (right.indptr.astype(PETSc.IntType), right.indices.astype(PETSc.IntType), right.data)
        rows = PETSc.Mat().createAIJ((count, size), csr=csr, comm=PETSc.COMM_SELF)
        columns = PETSc.Mat().createTranspose(rows)
        dense = PETSc.Mat().createDense((size, count), comm=PETSc.COMM_SELF)
        dense.setUp()
        self._solver.matSolve(columns, dense)
        solution = np.array(dense.getDenseArray())
        destroy(columns, rows, dense)
        return solution

    def free_copies(self) -> None:
        """Free the copies, whose work is done: the owner keeps its factor."""
        if self.comm.rank in self.copies and not self.answers:
            self.free()

    def solve_on_surface(self, right: Array) -> Array:
        """Return the surface's part of the solutions for right-hand sides there (m, k), on the owner alone."""
        if self._schur_factor is None:
            assert self.schur is not None
            try:
                self._schur_factor = scipy.linalg.cho_factor(self.schur, lower=True, overwrite_a=False)[0]
            except np.linalg.LinAlgError as error:
                raise without_factor(self._prefix, "not positive") from error
        return np.asarray(scipy.linalg.cho_solve((self._schur_factor, True), right))

    def free(self) -> None:
        """Free its memory: it solves no more; collective where it is spread."""
        for petsc_object in (self._solver, self._matrix if self.is_moved else None):
            if petsc_object is not None:
                petsc_object.destroy()
        self._solver = self._matrix = None


class Iterative(Factor):
    """Solver of few right-hand sides without a factor: conjugate gradients with PETSc's algebraic multigrid."""

    is_spread, is_moved, has_schur, schur, owner, copies = True, False, False, None, 0, range(1)

    def __init__(self, matrix: PETSc.Mat, prefix: str, *, comm: MPI.Comm, x: Array) -> None:
        """Take the matrix.

        Args:
            matrix: Symmetric and positive definite, in blocks of the nodes' components.
            prefix: Of PETSc's options.
            comm: Ranks of the matrix.
            x: This rank's nodes (n, d), for the rigid motions.
        """
        self.comm, self._prefix, self.is_made = comm, prefix, False
        places = PETSc.Vec().createWithArray(np.ascontiguousarray(x).ravel(), bsize=x.shape[1], comm=matrix.comm)
        modes = PETSc.NullSpace().createRigidBody(places)
        matrix.setNearNullSpace(modes)
        destroy(modes, places)
        self._ksp = PETSc.KSP().create(matrix.comm)
        self._ksp.setOptionsPrefix(prefix)
        self._ksp.setOperators(matrix)
        self._ksp.setType("cg")
        self._ksp.pc.setType("gamg")
        self._ksp.setTolerances(rtol=TOLERANCE, max_it=MOST)
        self._ksp.setFromOptions()

    def compute(self) -> None:
        """Make the preconditioner; collective."""
        self.is_made = True
        self._ksp.setUp()

    def solve_here(self, right: Array) -> Array:
        """Return the solutions of right-hand sides (owned, k); collective.

        Raises:
            ConvergenceError: the iteration does not converge.
        """
        before, after = self._ksp.getOperators()[0].createVecs()
        solutions = np.empty_like(right)
        for column, values in enumerate(right.T):
            before.array[:] = values
            self._ksp.solve(before, after)
            if self._ksp.reason < 0:
                raise without_factor(self._prefix, f"{self._ksp.its} iterations, reason {self._ksp.reason}")
            solutions[:, column] = after.array_r
        destroy(before, after)
        return solutions

    def free(self) -> None:
        """Free its memory: it solves no more; collective."""
        self._ksp.destroy()


def factored(
    matrix: PETSc.Mat,
    prefix: str,
    kind: Literal["lu", "cholesky"],
    *,
    comm: MPI.Comm,
    dim: int,
) -> Factor:
    """Return the factor of a matrix; collective.

    Raises:
        ConvergenceError: it has no factor.
    """
    factor = Factor(matrix, prefix, kind, comm=comm, dim=dim)
    make_together([factor])
    return factor


def make_together(factors: Sequence[Factor]) -> None:
    """Compute factors, each where it is solved, at once; collective.

    Raises:
        ConvergenceError: a matrix has no factor; on every rank.
    """
    for make in ("compute", "join"):
        error: ConvergenceError | None = None
        for factor in factors:
            try:
                getattr(factor, make)()
            except ConvergenceError as caught:  # raised below, on all ranks
                error = error or caught
        if factors:
            raised_together(factors[0].comm, error)


def without_factor(prefix: str, reason: str) -> ConvergenceError:
    """Return the error of a matrix that has no factor."""
    return ConvergenceError(
        f"the matrix of PETSc's prefix {prefix} has no factor ({reason}). A material, a time or a "
        "coefficient is too large or too small"
    )


def raised_together(comm: MPI.Comm, error: ConvergenceError | None) -> None:
    """Raise the first error that any rank has, on every rank; collective.

    Raises:
        ConvergenceError: there is one.
    """
    all_together(comm)
    errors = [raised for raised in comm.allgather(error) if raised is not None]
    if errors:
        raise errors[0]


def solved(factor: PETSc.Mat, right: Array, sizes: tuple[int, int] | None = None) -> Array:
    """Return the solutions of right-hand sides (rows, k); collective where the factor is spread.

    Args:
        factor: Computed.
        right: This rank's rows.
        sizes: Number of rows here and in all; by default all are here.
    """
    sizes = sizes or (len(right), len(right))
    if right.shape[1] == 1:
        before = PETSc.Vec().createWithArray(np.ascontiguousarray(right[:, 0]), size=sizes, comm=factor.comm)
        after = before.duplicate()
        factor.solve(before, after)
        solution = np.array(after.array_r)[:, None]
    else:
        before = dense(sizes, right, factor.comm)
        after = before.duplicate()
        factor.matSolve(before, after)
        solution = np.array(after.getDenseArray())
    destroy(before, after)
    return solution


def solve_together(factors: Sequence[Factor], rights: Sequence[Array]) -> list[Array]:
    """Return the solutions of each factor for its right-hand sides (owned,) or (owned, k), at once; collective."""
    for factor in factors:
        all_together(factor.comm)
    columns = [right.reshape(len(right), math.prod(right.shape[1:])) for right in rights]
    gathered = [factor.gather(right) for factor, right in zip(factors, columns, strict=True)]
    solutions = [factor.solve_here(gathered_right) for factor, gathered_right in zip(factors, gathered, strict=True)]
    return [
        factor.scatter(solution, right.shape[1]).reshape(given.shape)
        for factor, solution, right, given in zip(factors, solutions, columns, rights, strict=True)
    ]


def moved(matrix: PETSc.Mat, ranks: Container[int]) -> PETSc.Mat | None:
    """Return the whole of a distributed matrix on some ranks; None on others; collective."""
    here = matrix.comm.rank in ranks
    # General index sets: those of a stride give wrong values.
    rows, columns = (
        PETSc.IS().createGeneral(np.arange(size if here else 0, dtype=PETSc.IntType), comm=PETSc.COMM_SELF)
        for size in matrix.getSize()
    )
    for chosen, block in zip((rows, columns), matrix.getBlockSizes(), strict=True):
        chosen.setBlockSize(block)  # MUMPS orders by blocks
    (copied,) = matrix.createSubMatrices([rows], [columns])
    if here:
        return copied
    copied.destroy()
    return None


def _moved(matrix: PETSc.Mat, ranks: Container[int], kind: str) -> PETSc.Mat | None:
    copied = moved(matrix, ranks)
    if copied is not None:
        copied.setOption(PETSc.Mat.Option.SPD, kind == "cholesky")
    return copied


def factored_here(matrix: PETSc.Mat, prefix: str, surface: NDArray[np.int64]) -> PETSc.Mat:
    """Return the Cholesky factor of this rank's own matrix, with the Schur complement of some rows (m,).

    Raises:
        ConvergenceError: it has no factor.
    """
    matrix.setOption(PETSc.Mat.Option.SPD, True)
    return _factored(matrix, prefix, "cholesky", surface)


def _factored(matrix: PETSc.Mat, prefix: str, kind: str, surface: NDArray[np.int64] | None) -> PETSc.Mat:
    ksp = PETSc.KSP().create(matrix.comm)
    ksp.setOptionsPrefix(prefix)
    ksp.setOperators(matrix)
    ksp.setType("preonly")
    ksp.pc.setType(kind)
    ksp.pc.setFactorSolverType("mumps")
    ksp.setFromOptions()
    try:
        if surface is not None:
            ksp.pc.setFactorSetUpSolverType()
            eliminate_last(ksp.pc.getFactorMatrix(), surface)
        ksp.setUp()
        failed = int(ksp.pc.getFailedReason())
    except PETSc.Error as error:
        failed = error.ierr
    if failed:
        raise without_factor(prefix, f"reason {failed}")
    factor = ksp.pc.getFactorMatrix()
    ksp.destroy()  # and with it the matrix, where nothing else holds it
    return factor


INVERTED = 2  # PETSc's MAT_FACTOR_SCHUR_INVERTED


@cache
def _library() -> ctypes.CDLL | None:
    """Return PETSc's library; None where it is not found."""
    path = petsc_library()
    if path is None:
        return None
    library = ctypes.cdll.LoadLibrary(path)
    pointer = ctypes.c_void_p
    for name, count in (
        ("MatFactorSetSchurIS", 2),
        ("MatFactorCreateSchurComplement", 3),
        ("MatFactorGetSchurComplement", 3),
        ("MatDenseGetArrayRead", 2),
        ("MatDenseRestoreArrayRead", 2),
        ("MatDestroy", 1),
        ("MatZeroEntries", 1),
    ):
        getattr(library, name).argtypes = [pointer] * count
    library.MatShift.argtypes = [pointer, ctypes.c_double]
    library.MatFactorRestoreSchurComplement.argtypes = [pointer, pointer, ctypes.c_int]
    return library


def available() -> bool:
    """Return whether Schur complements can be had here."""
    return _library() is not None


def eliminate_last(factor: PETSc.Mat, rows: NDArray[np.int64]) -> None:
    """Make a factor that is to be computed keep the Schur complement of these rows.

    Args:
        factor: Of MUMPS, on one process, before it is computed.
        rows: Their numbers (m,).
    """
    chosen = PETSc.IS().createGeneral(rows.astype(PETSc.IntType), comm=PETSc.COMM_SELF)
    _call("MatFactorSetSchurIS", factor.handle, chosen.handle)


def schur_complement(factor: PETSc.Mat, size: int) -> Array:
    """Return the Schur complement of a computed factor (m, m)."""
    matrix, status = ctypes.c_void_p(), ctypes.c_int()
    _call("MatFactorCreateSchurComplement", factor.handle, ctypes.byref(matrix), ctypes.byref(status))
    values = ctypes.POINTER(ctypes.c_double)()
    _call("MatDenseGetArrayRead", matrix, ctypes.byref(values))
    complement = np.array(np.ctypeslib.as_array(values, (size, size))).T  # column by column
    _call("MatDenseRestoreArrayRead", matrix, ctypes.byref(values))
    _call("MatDestroy", ctypes.byref(matrix))
    return complement


def condense_only(factor: PETSc.Mat) -> None:
    """Make a computed factor solve for what is eliminated alone, as if S were the identity.

    For right-hand sides f_i and f_s its solutions are then

        x_s = f_s - K_si K_ii^-1 f_i,    x_i = K_ii^-1 (f_i - K_is x_s).

    MUMPS needs no more of S than its inverse, which is given to it as the identity.
    """
    matrix, status = ctypes.c_void_p(), ctypes.c_int()
    _call("MatFactorGetSchurComplement", factor.handle, ctypes.byref(matrix), ctypes.byref(status))
    _call("MatZeroEntries", matrix)
    _call("MatShift", matrix, 1.0)
    _call("MatFactorRestoreSchurComplement", factor.handle, ctypes.byref(matrix), INVERTED)


def _call(name: str, *arguments: object) -> None:
    code = getattr(_library(), name)(*arguments)
    if code:
        raise PETSc.Error(code)
