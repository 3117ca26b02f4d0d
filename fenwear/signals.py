"""SIGINT and SIGTERM: asked once, a run ends after its step; asked twice, at once and with all ranks."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType

from mpi4py import MPI

BOTH = (signal.SIGINT, signal.SIGTERM)


class TimeUpError(Exception):
    """What was to be done within a time limit took longer."""


@contextmanager
def time_limit(seconds: float, comm: MPI.Comm) -> Iterator[None]:
    """Raise where what is done within takes longer; several ranks, which would not end together, have no limit.

    Raises:
        TimeUpError: it does.
    """

    def end(_number: int, _frame: FrameType | None) -> None:
        raise TimeUpError

    if comm.size > 1:
        yield
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
