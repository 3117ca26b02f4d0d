"""Ranks: what one finds wrong, every rank raises; what they add up is the same to the last bit; one leads all.

PETSc's objects on several ranks are freed by all of them together, so that petsc4py keeps those that
Python drops until it is told to free them. What is large is destroyed where it was made, and the rest
where `release` is called.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

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


def agreed(comm: MPI.Comm, found: T) -> T:
    """Return what rank 0 has found, on every rank: what decides over further collective calls; collective."""
    return found if comm.size == 1 else comm.bcast(found)


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


@dataclass(frozen=True)
class Rows:
    """A run of rows for each rank, of a matrix or of vectors that are too large for every rank to have them all.

    Attributes:
        comm: The ranks.
        starts: First row of each rank, and the number of all (ranks + 1,).
    """

    comm: MPI.Comm
    starts: NDArray[np.int64]

    @classmethod
    def equal(cls, comm: MPI.Comm, size: int) -> Rows:
        """Return as many rows of `size` for each rank as for the others, or one less."""
        return cls(comm, size * np.arange(comm.size + 1, dtype=np.int64) // comm.size)

    @property
    def own(self) -> slice:
        """The rows of this rank."""
        first, last = self.starts[self.comm.rank : self.comm.rank + 2]
        return slice(int(first), int(last))

    def gathered(self, part: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return all rows (size, ...) from this rank's own, the same on every rank; collective."""
        whole = np.empty((int(self.starts[-1]), *part.shape[1:]))
        counts: Any = np.diff(self.starts) * math.prod(part.shape[1:])
        self.comm.Allgatherv(np.ascontiguousarray(part), (whole, counts))
        return whole


class Team:
    """Ranks that work for rank 0 while it leads: what it decides needs no other rank's agreement.

    Args:
        comm: The ranks.
    """

    def __init__(self, comm: MPI.Comm) -> None:
        self.comm = comm
        self._parts: dict[int, object] = {}

    def serve(self, number: int, part: object) -> None:
        """Have this rank's part of what is shared called by its number."""
        self._parts[number] = part

    def lead(self, function: Callable[[], T]) -> T:
        """Call `function` on rank 0, which may `call` all ranks meanwhile; return its result on each; collective.

        Raises:
            Exception: what `function` raised, on every rank.
        """
        if self.comm.rank:
            while (order := self.comm.bcast(None)) is not None:
                self.comm.gather(self._done(*order))
            return on_root(self.comm, function)

        def led() -> T:
            try:
                return function()
            finally:
                self.comm.bcast(None)

        return on_root(self.comm, led)

    def call(self, number: int, method: str, *arguments: Any) -> list[Any]:
        """Call a method of each rank's part and return what each has returned; on rank 0, while it leads.

        Raises:
            Exception: what it raised on some rank.
        """
        self.comm.bcast((number, method, arguments))
        results, errors = zip(*(self.comm.gather(self._done(number, method, arguments)) or []), strict=True)
        for error in errors:
            if error is not None:
                raise error
        return list(results)

    def _done(self, number: int, method: str, arguments: tuple[Any, ...]) -> tuple[Any, Exception | None]:
        try:
            return getattr(self._parts[number], method)(*arguments), None
        except Exception as error:  # raised again on rank 0, which all wait for
            return None, error
