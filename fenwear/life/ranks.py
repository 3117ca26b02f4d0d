"""Independent computations shared out among ranks, each rank with systems of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

from mpi4py import MPI

from fenwear.errors import FenwearError

T = TypeVar("T")


def share(
    comm: MPI.Comm,
    count: int,
    function: Callable[[int], T],
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> list[T]:
    """Return function(0), ..., function(count - 1) on every rank; collective.

    Raises:
        FenwearError: the first that a call raised, on every rank.
    """
    results: list[T] = []
    for chunk in in_chunks(comm, range(count), function):
        for outcome in chunk:
            if isinstance(outcome, FenwearError):
                raise outcome
            results.append(outcome)
        progress(len(results), count)
    return results


def everywhere(comm: MPI.Comm, function: Callable[[], T]) -> T:
    """Return what a call on this rank returns, all ranks calling their own; collective.

    Raises:
        Exception: what a call on any rank raised, on every rank.
    """
    results: list[T] = []
    failure: Exception | None = None
    try:
        results.append(function())
    except Exception as error:  # raised on all ranks below: none waits for another
        failure = error
    for problem in comm.allgather(failure):
        if problem is not None:
            raise problem
    return results[0]


def in_chunks(comm: MPI.Comm, numbers: Sequence[int], function: Callable[[int], T]) -> Iterator[list[T | FenwearError]]:
    """Yield the outcomes, in order and on every rank, of one call on each rank after another; collective.

    A call that raises one of our errors has it as its outcome.
    """
    for begin in range(0, len(numbers), comm.size):
        own = numbers[begin : begin + comm.size]
        outcome: T | FenwearError | None = None
        failure: Exception | None = None
        if comm.rank < len(own):
            try:
                outcome = function(own[comm.rank])
            except FenwearError as error:
                outcome = error
            except Exception as error:  # raised on all ranks below: none waits for another
                failure = error
        gathered = comm.allgather((outcome, failure))
        for _, problem in gathered:
            if problem is not None:
                raise problem
        yield [result for result, _ in gathered[: len(own)]]
