"""Schur complements of sparse matrices by MUMPS, through the C functions of PETSc that petsc4py does not have.

    S = K_ss - K_si K_ii^-1 K_is, and (S^-1) is the part of K^-1 in rows and columns s.

The elimination ends with the rows s, so that K^-1 on a surface costs little more than the factor
alone: no solution for each of its nodes.
"""

from __future__ import annotations

import ctypes
from functools import cache

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from fenwear.arrays import Array
from fenwear.compat import petsc_library

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
