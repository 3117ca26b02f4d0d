"""Progress of a run: on rank 0, by a bar on a terminal or by lines."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from types import TracebackType
from typing import Literal

from mpi4py import MPI
from tqdm import tqdm

LINE_SECONDS = 10.0  # after which a long step tells that it goes on
LOOK = 0.05  # s between two looks at clock and signals, where no other rank waits for them
How = Literal["bar", "lines", "none"]
Log = Callable[[str], None]


def now_and_then(log: Log) -> Log:
    """Return a log that leaves out lines within seconds of the last one."""
    reported = [-LINE_SECONDS]

    def tell(line: str) -> None:
        now = time.monotonic()
        if now > reported[0] + LINE_SECONDS:
            reported[0] = now
            log(line)

    return tell


class Progress:
    """The progress of a run over half-cycles or cycles.

    Args:
        unit: Of what is counted, such as cycle.
        total: Final number.
        done: Number before.
        comm: The ranks.
        how: A bar where standard error is a terminal, lines, or none.
    """

    def __init__(self, unit: str, total: int, done: int, comm: MPI.Comm, how: How) -> None:
        self.unit, self.total, self.done, self.before = unit, total, done, done
        self.lines = how == "lines" and comm.rank == 0
        hidden = how != "bar" or comm.rank != 0 or not sys.stderr.isatty()
        self.bar = tqdm(total=total, initial=done, unit=f" {unit}s", disable=hidden)
        self.begin = self.reported = time.perf_counter()

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        self.bar.close()

    def reached(self, number: int, state: str) -> None:
        """Tell how many are done, and of the state."""
        self.done = number
        self.bar.update(number - self.bar.n)
        self.bar.set_postfix_str(state)
        if self.lines:
            rate = (number - self.before) / (time.perf_counter() - self.begin)
            pace = f"{rate:,.3g} a second, {(self.total - number) / rate:,.0f} s left, " if rate > 0 else ""
            self._line(f"{self.unit} {number:,} of {self.total:,}, {pace}{state}")

    def working(self) -> None:
        """Tell, now and then, that a long step is being made."""
        self.bar.refresh()
        now = time.perf_counter()
        if self.lines and now - self.reported > LINE_SECONDS:
            self._line(f"{self.unit} {self.done:,} of {self.total:,}, in the step after it, {now - self.begin:,.0f} s")

    def _line(self, text: str) -> None:
        self.reported = time.perf_counter()
        sys.stderr.write(f"{text}\n")  # at once: see cli.base
        sys.stderr.flush()
