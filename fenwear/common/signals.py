"""SIGINT and SIGTERM, and what else a run looks out for between two solves: checkpoints that are due.

Asked once, a run ends after its step; asked twice, at once and with all ranks.
"""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType

import numpy as np
from mpi4py import MPI

from fenwear.common.errors import TimeUpError
from fenwear.common.parallel import Team
from fenwear.common.progress import LOOK, Progress

BOTH = (signal.SIGINT, signal.SIGTERM)


@contextmanager
def time_limit(seconds: float, comm: MPI.Comm) -> Iterator[None]:
    """Raise where what is done within takes longer; several ranks look at the clock where they next work together.

    Raises:
        TimeUpError: it does.
    """

    def end(_number: int, _frame: FrameType | None) -> None:
        raise TimeUpError

    if comm.size > 1:
        Team.until = time.monotonic() + seconds
        try:
            yield
        finally:
            Team.until = np.inf
        return
    before = signal.signal(signal.SIGALRM, end)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


class Signals:
    """Notes the signals, while it is entered, instead of letting them end the process.

    Args:
        comm: The ranks that end together.
        last: Whether the process is to end after a signal. Then one that comes later, between here and the
            end of the process, is treated as a second one. Otherwise the caller gets its own handlers back.
    """

    def __init__(self, comm: MPI.Comm, *, last: bool = False) -> None:
        self.comm, self.last = comm, last
        self.received = False  # here
        self.ending = False  # because of a signal that any rank has received

    def __enter__(self) -> Signals:
        self._before = {s: signal.signal(s, self._note) for s in BOTH}
        return self

    def _note(self, _number: int, _frame: FrameType | None) -> None:
        if self.received:  # asked twice: at once, wherever in a solver this is, and with all ranks
            os.write(2, b"fenwear: interrupted at once; what came after the last checkpoint is lost\n")
            if self.comm.size > 1:
                self.comm.Abort(1)
            os._exit(1)
        self.received = True

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        if self.last and (self.received or self.ending):
            return
        for number, handler in self._before.items():
            signal.signal(number, handler)


def ignore_from_now_on() -> None:
    """Let a process that has said its last word end: a signal could only spoil its exit status."""
    for number in BOTH:
        signal.signal(number, signal.SIG_IGN)


class RunMonitor:
    """Looks at signals and at the clock, that of rank 0; a signal to any rank ends all of them.

    Args:
        comm: The ranks.
        signals: That end the run.
        progress: Gets the progress.
        save: Writes a checkpoint, where there is something to save; collective.
        every: Time between two checkpoints, s.
        block: Time after which a block of results ends, s.

    Attributes:
        block_over: Whether it was over when last looked.
    """

    def __init__(
        self,
        comm: MPI.Comm,
        signals: Signals,
        progress: Progress,
        save: Callable[[], None],
        *,
        every: float,
        block: float = np.inf,
    ) -> None:
        self._comm, self._signals, self._progress, self._save = comm, signals, progress, save
        self._every, self._block = every, block
        self.block_over = False
        self._looked = self._begun = time.monotonic()
        self._due = self._looked + every

    def begin_block(self) -> None:
        """Count the time of a block from now on."""
        self._begun = time.monotonic()

    @property
    def too_soon(self) -> bool:
        """Whether there is no need to look yet; other ranks wait for every look."""
        return self._comm.size == 1 and not self._signals.received and time.monotonic() < self._looked + LOOK

    def look(self) -> bool:
        """Save where it is due, report progress, and return whether a signal has come; collective."""
        self._looked = now = time.monotonic()
        root = self._comm.rank == 0
        wishes = [self._signals.received, root and now > self._due, root and now > self._begun + self._block]
        interrupted, save, self.block_over = (self._comm.allreduce(np.array(wishes, dtype=int)) > 0).tolist()
        if interrupted:
            self._signals.ending = True
        if save:
            self._save()
            self._due = time.monotonic() + self._every
        self._progress.working()
        return bool(interrupted)
