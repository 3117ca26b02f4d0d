"""What a run looks out for between two solves: signals that end it, and checkpoints that are due."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from mpi4py import MPI

from fenwear.progress import LOOK, Progress
from fenwear.signals import Signals


class RunMonitor:
    """Looks at signals and at the clock, that of rank 0; a signal to any rank ends all of them.

    Args:
        comm: The ranks.
        signals: That end the run.
        told: Told that it goes on.
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
        told: Progress,
        save: Callable[[], None],
        *,
        every: float,
        block: float = np.inf,
    ) -> None:
        self._comm, self._signals, self._told, self._save = comm, signals, told, save
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
        """Save where it is due, tell that the run goes on, and return whether a signal has come; collective."""
        self._looked = now = time.monotonic()
        root = self._comm.rank == 0
        wishes = [self._signals.received, root and now > self._due, root and now > self._begun + self._block]
        interrupted, save, self.block_over = (self._comm.allreduce(np.array(wishes, dtype=int)) > 0).tolist()
        if interrupted:
            self._signals.ending = True
        if save:
            self._save()
            self._due = time.monotonic() + self._every
        self._told.working()
        return bool(interrupted)
