"""The runs of a study: shared out among ranks, each with systems of its own, and kept in a file to resume from."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np
from mpi4py import MPI

from fenwear.arrays import Array
from fenwear.errors import CaseError, FenwearError, InputError
from fenwear.results.disk import writing

T = TypeVar("T")
TRIALS = "trials.jsonl"


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


class Trials:
    """Arrays by what they were computed for; each is on the disk as soon as it is known, where there is a file.

    A resumed study asks for the same arrays again, so that those on the disk take the place of runs.
    """

    def __init__(self, path: Path | None = None) -> None:
        """Begin without any; the file appears with the first one."""
        self.path = path
        self._kept: dict[str, Array] = {}

    def begin(self, problem: str, *, resume: bool) -> None:
        """Begin a file, or read the arrays that it holds of the same problem.

        Raises:
            CaseError: there is none to resume, one of another problem, or one already.
        """
        self._kept.clear()
        first = json.dumps({"problem": hashlib.sha256(problem.encode()).hexdigest()})
        if self.path is None:
            return
        if not resume and self.path.exists():
            raise CaseError(InputError("-o", f"{self.path} exists already; expected a new folder, or --resume"))
        if not resume:
            with writing(self.path):
                self.path.parent.mkdir(parents=True, exist_ok=True)
                self.path.write_text(first + "\n", "utf-8")
            return
        try:
            head, *lines = self.path.read_text("utf-8").splitlines()
        except (OSError, ValueError):
            raise CaseError(InputError("--resume", f"{self.path} cannot be read. Start again without it")) from None
        if head != first:
            raise CaseError(
                InputError("--resume", f"{self.path} belongs to another study: case, data, keys or seed differ")
            )
        for line in lines:
            try:
                one = json.loads(line)
            except ValueError:  # the last line of a process that was killed
                break
            self._kept[one["trial"]] = np.array(one["values"])

    def get(self, kind: str, z: Array) -> Array | None:
        """Return the array of a kind at fitted unknowns; None where it has not been computed."""
        return self._kept.get(self._key(kind, z))

    def put(self, kind: str, z: Array, values: Array) -> Array:
        """Keep an array; return it."""
        key = self._key(kind, z)
        self._kept[key] = values
        if self.path is not None:
            with writing(self.path), self.path.open("a", encoding="utf-8") as file:
                file.write(json.dumps({"trial": key, "values": values.tolist()}) + "\n")
        return values

    @staticmethod
    def _key(kind: str, z: Array) -> str:
        return f"{kind} {z.tobytes().hex()}"
