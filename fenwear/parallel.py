"""Ranks: what one finds wrong, every rank raises; what they add up is the same to the last bit.

PETSc's objects on several ranks are freed by all of them together, so that petsc4py keeps those that
Python drops until it is told to free them. What is large is destroyed where it was made, and the rest
where `release` is called.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

T = TypeVar("T")


def on_root(comm: MPI.Comm, function: Callable[[], T]) -> T:
    """Call `function` on rank 0 alone and return its result on every rank; collective.

    Raises:
        Exception: what `function` raised, on every rank.
    """
    result: T | None = None
    error: Exception | None = None
    if comm.rank == 0:
        try:
            result = function()
        except Exception as caught:  # raised again below, on all ranks
            error = caught
    error = comm.bcast(error)
    if error is not None:
        raise error
    return comm.bcast(result)


def total(comm: MPI.Comm, partial: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the sum over the ranks, equal to the last bit on all of them; collective."""
    result = np.empty(partial.shape)
    comm.Reduce(np.ascontiguousarray(partial), result, op=MPI.SUM, root=0)
    comm.Bcast(result, root=0)
    result += 0.0  # no -0.0, which another rank's zeros would have made positive
    return result


def lasting(comm: MPI.Comm) -> MPI.Comm:
    """Return the communicator for PETSc's objects on these ranks: of all ranks the one that outlives their mesh.

    A mesh has a communicator of its own, with which what was not freed before would stay.
    """
    alike = MPI.Comm.Compare(comm, MPI.COMM_WORLD) in (MPI.IDENT, MPI.CONGRUENT)
    return MPI.COMM_WORLD if alike else comm


def release(comm: MPI.Comm) -> None:
    """Free the objects of PETSc that every one of these ranks has dropped; collective."""
    if comm.size > 1:
        PETSc.garbage_cleanup(lasting(comm))
