"""Ranks: what one finds wrong, every rank raises; what they add up is the same to the last bit."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

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
    return result
