"""Ranks: what one finds wrong, every rank raises; what they add up is the same to the last bit."""

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


def assemble_in_order() -> None:
    """Let PETSc add what the ranks give to a row of a matrix in their order and not as it arrives: the same bits again.

    PETSc has the order in its older exchange alone. Before a matrix is made; the user's own options stay.
    """
    options = PETSc.Options()
    for name in ("matstash_legacy", "matstash_reproduce"):
        if not options.hasName(name):
            options[name] = "true"


def total(comm: MPI.Comm, partial: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the sum over the ranks, equal to the last bit on all of them; collective."""
    result = np.empty(partial.shape)
    comm.Reduce(np.ascontiguousarray(partial), result, op=MPI.SUM, root=0)
    comm.Bcast(result, root=0)
    return result
