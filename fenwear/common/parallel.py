"""Ranks: what one finds wrong, every rank raises; what they add up is the same to the last bit; one leads all.

Sums, products and logarithms end in other last bits on other processors. So rank 0 alone computes what works on numbers
that every rank could have, and takes all decisions: `Team.lead`. All ranks act together on distributed data.

PETSc's objects on several ranks are freed by all of them together, so that petsc4py keeps those that
Python drops until it is asked to free them. Large objects are destroyed where they were made, and the rest where
`release` is called.
"""

from __future__ import annotations

import io
import pickle
import time
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar, TypeVar

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from fenwear.common.errors import CaseError, InputError, RanksError, TimeUpError

T = TypeVar("T")
K = TypeVar("K")
BUSY, NAP = 2e-3, 2e-4  # s that a rank looks out for an order without a pause, and its pauses afterwards


def on_root(comm: MPI.Comm, function: Callable[[], T]) -> T:
    """Call `function` on rank 0 alone and return its result on every rank; collective.

    Raises:
        Exception: what `function` raised, on every rank.
    """
    return Team.of(comm).lead(function)


def all_together(comm: MPI.Comm) -> None:
    """Refuse what all ranks do together where one leads them: the others wait for its orders, and would for ever.

    To be called where collective work begins; collective.

    Raises:
        RanksError: this rank leads.
        TimeUpError: by the clock of rank 0 it is too late, see `fenwear.common.signals.time_limit`.
    """
    if comm.size == 1:
        return
    if Team.any_leads():
        raise RanksError(
            "all ranks are asked for where one leads the others: what they make together has to be made before"
        )
    if Team.until < np.inf and comm.bcast(time.monotonic() > Team.until):
        raise TimeUpError


def agreed(comm: MPI.Comm, value: T) -> T:
    """Return the value of rank 0 on every rank, by which further collective calls are decided; collective."""
    return Team.of(comm).lead(lambda: value)


def total(comm: MPI.Comm, partial: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the sum over the ranks, equal to the last bit on all of them; collective."""
    all_together(comm)
    result = np.empty(partial.shape)
    comm.Reduce(np.ascontiguousarray(partial), result, op=MPI.SUM, root=0)
    comm.Bcast(result, root=0)
    result += 0.0  # no -0.0, which another rank's zeros would have made positive
    return result


def once(comm: MPI.Comm, known: dict[K, T], key: K, find: Callable[[], T]) -> T:
    """Return the value that every rank has under a key, else compute and keep it; collective."""
    if not comm.allreduce(int(key in known), MPI.MIN):
        known[key] = find()
    return known[key]


def lasting(comm: MPI.Comm) -> MPI.Comm:
    """Return the communicator for PETSc's objects on these ranks: of all ranks the one that outlives their mesh.

    A mesh has a communicator of its own, with which what was not freed before would stay.
    """
    alike = MPI.Comm.Compare(comm, MPI.COMM_WORLD) in (MPI.IDENT, MPI.CONGRUENT)
    return MPI.COMM_WORLD if alike else comm


def release(comm: MPI.Comm) -> None:
    """Free the objects of PETSc that every one of these ranks has dropped; collective."""
    all_together(comm)
    if comm.size > 1:
        PETSc.garbage_cleanup(lasting(comm))


class Team:
    """Ranks that work for rank 0 while it leads: what it decides needs no other rank's agreement.

    A led call may lead further: the outermost leads all. Ranks of one group are one team.
    """

    _teams: ClassVar[list[Team]] = []
    until: ClassVar[float] = np.inf  # when all ranks are to stop working together, on the clock of each

    def __init__(self, comm: MPI.Comm) -> None:
        self.comm = comm
        self._leads = False  # rank 0, now
        self._parts: weakref.WeakValueDictionary[int, Any] = weakref.WeakValueDictionary()
        self._numbers: dict[int, int] = {}  # of parts, by their identity
        self._served = 0

    @property
    def leads(self) -> bool:
        """Whether this rank leads now."""
        return self._leads

    @classmethod
    def any_leads(cls) -> bool:
        """Whether this rank leads others now."""
        return any(team._leads for team in cls._teams)

    @classmethod
    def of(cls, comm: MPI.Comm) -> Team:
        """Return the team of these ranks, which has a communicator of its own; collective at the first time."""
        for team in cls._teams:
            if MPI.Comm.Compare(comm, team.comm) in (MPI.IDENT, MPI.CONGRUENT):
                return team
        cls._teams.append(cls(comm.Dup()))
        return cls._teams[-1]

    def serve(self, part: T) -> T:
        """Return this rank's part of what all have a part of, known as such as long as it is kept; collective.

        It can be asked for by `call` and `each`, and between ranks it stands for theirs.
        """
        if self._number(part) is None:
            self._parts[self._served] = part
            self._numbers[id(part)] = self._served
            self._served += 1
        return part

    def _number(self, part: object) -> int | None:
        number = self._numbers.get(id(part))
        return number if number is not None and self._parts.get(number) is part else None

    def lead(self, function: Callable[[], T]) -> T:
        """Call `function` on rank 0, which may `call` all ranks meanwhile; return its result on each; collective.

        Raises:
            Exception: what `function` raised, on every rank.
        """
        if self._leads or self.comm.size == 1:
            return function()
        if self.comm.rank:
            return self._follow()  # type: ignore[no-any-return]
        result: T | None = None
        failure: BaseException | None = None
        self._leads = True
        try:
            result = function()
            packed = self._crossed((None, result, None))
        except BaseException as error:  # raised again below, on all ranks, which wait for it: interrupts, too
            failure = self._crossing(error)
            packed = self._packed((None, None, failure))
        finally:
            self._leads = False
        self._tell(packed)
        if failure is not None:
            raise failure
        return result  # type: ignore[return-value]

    def _follow(self) -> Any:
        """Do what rank 0 asks for until it is done; return its result."""
        while True:
            order, *ended = self._received()
            if order is None:
                result, failure = ended
                if failure is not None:
                    raise failure
                return result
            self.comm.gather(self._answer(*order))

    def call(self, part: object, method: str, *arguments: Any) -> list[Any]:
        """Call a method of each rank's part and return what each has returned; on rank 0, while it leads.

        Raises:
            Exception: what it raised on some rank.
        """
        if self.comm.size == 1:
            return [getattr(part, method)(*arguments)]
        self._tell(self._packed(((self._number(part), method, arguments), None, None)))
        self._leads = False  # in what all do together another one may lead
        done = self._done(self._number(part), method, arguments)
        self._leads = True
        gathered = self.comm.gather(b"") or []
        results, errors = zip(done, *map(self._unpacked, gathered[1:]), strict=True)
        for error in errors:
            if error is not None:
                raise error
        return list(results)

    def each(self, part: object, method: str, *arguments: Any) -> Any:
        """Call a method of each rank's part and return what this one's returned; by rank 0 that leads, or collective.

        Raises:
            Exception: what it raised, while rank 0 leads on any rank.
        """
        if self._leads:
            return self.call(part, method, *arguments)[0]
        return getattr(part, method)(*arguments)

    def _done(self, number: int | None, method: str, arguments: tuple[Any, ...]) -> tuple[Any, BaseException | None]:
        try:
            return getattr(self._parts[number], method)(*arguments), None  # type: ignore[index]
        except BaseException as error:  # raised again on rank 0, which all wait for
            return None, error

    def _answer(self, number: int | None, method: str, arguments: tuple[Any, ...]) -> bytes:
        """Return the result of this rank for rank 0, which waits for it, packed."""
        result, failure = self._done(number, method, arguments)
        try:
            return self._crossed((result, failure and self._crossing(failure)))
        except RanksError as error:
            return self._packed((None, error))

    def _crossed(self, content: Any) -> bytes:
        """Return the packed content for other ranks.

        Raises:
            RanksError: it cannot be.
        """
        try:
            return self._packed(content)
        except Exception as error:  # of the packing, whatever the object makes of it
            raise RanksError(f"the result of one rank cannot be sent to the others: {error}") from None

    def _crossing(self, error: BaseException) -> BaseException:
        """Return an error as it can cross ranks: itself, or its words where it cannot be packed or unpacked."""
        try:
            if type(self._unpacked(self._packed(error))) is type(error):
                return error
        except Exception:  # of the packing, whatever the error makes of it
            pass
        return RanksError(f"{type(error).__name__}: {error}")

    def _tell(self, packed: bytes) -> None:
        self.comm.Ibarrier().Wait()
        self.comm.bcast(packed)

    def _received(self) -> Any:
        """Return the value of rank 0; who waits long leaves the core to others."""
        come, begin = self.comm.Ibarrier(), time.perf_counter()
        while not come.Test():
            if time.perf_counter() > begin + BUSY:
                time.sleep(NAP)
        return self._unpacked(self.comm.bcast(None))

    def _packed(self, content: Any) -> bytes:
        """Return the content for other ranks, with parts as their numbers."""
        file = io.BytesIO()
        _Packer(file, self._number).dump(content)
        return file.getvalue()

    def _unpacked(self, packed: bytes) -> Any:
        return _Unpacker(io.BytesIO(packed), self._parts.__getitem__).load()


ALONE = Team(MPI.COMM_SELF)  # each rank by itself


class _Packer(pickle.Pickler):
    def __init__(self, file: io.BytesIO, number: Callable[[object], int | None]) -> None:
        super().__init__(file, protocol=5)
        self._number = number

    def persistent_id(self, part: object) -> int | None:
        """Return the number of a part; None for what is packed as it is."""
        return self._number(part)


class _Unpacker(pickle.Unpickler):
    def __init__(self, file: io.BytesIO, part: Callable[[int], Any]) -> None:
        super().__init__(file)
        self._part = part

    def persistent_load(self, number: int) -> Any:
        """Return this rank's part of a number."""
        return self._part(number)


GIB = 2**30  # bytes
SMALL = GIB  # below which nothing is rejected


def free_memory() -> float:
    """Return the memory that this process may still take, bytes; infinite where the system does not say."""
    memory = [np.inf]
    try:
        lines = Path("/proc/meminfo").read_text("ascii").splitlines()
        memory += [1024.0 * int(line.split()[1]) for line in lines if line.startswith("MemAvailable")]
    except (OSError, ValueError, IndexError):
        pass
    try:  # the limit of a container
        limit, used = (Path(f"/sys/fs/cgroup/memory.{name}").read_text("ascii").strip() for name in ("max", "current"))
        memory += [] if limit == "max" else [float(limit) - float(used)]
    except (OSError, ValueError):
        pass
    return min(memory)


def memory_size(memory: float) -> str:
    """Return a memory (bytes) in words."""
    return f"{memory / GIB:.1f} GiB" if memory > 0.1 * GIB else f"{memory / 2**20:.0f} MiB"


def check_memory(comm: MPI.Comm, taken: float, key: str, subject: str, advice: str, *, spread: bool = False) -> None:
    """Make sure that a step fits into the memory that is free; collective.

    Args:
        comm: The ranks.
        taken: Memory of the step, bytes.
        key: Of the case, which decides over it.
        what: Asks for the memory.
        advice: Advice where it is too much.
        spread: Whether the ranks share what is taken; else rank 0 has it.

    Raises:
        CaseError: it does not fit.
    """
    free = free_on_ranks(comm) if spread else agreed(comm, free_memory())
    if taken > max(free, SMALL):
        sizes = f"{memory_size(taken)}, but {memory_size(free)} are free"
        raise CaseError(InputError(key, f"{subject} takes about {sizes}. {advice}"))


def free_on_ranks(comm: MPI.Comm) -> float:
    """Return the memory that all ranks together may still take, bytes; collective."""
    node = comm.Split_type(MPI.COMM_TYPE_SHARED)
    free = free_memory() if node.rank == 0 else 0.0
    node.Free()
    return float(comm.allreduce(free))
