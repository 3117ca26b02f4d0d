"""Workers that may crash or hang: processes that live long, are watched, and are replaced where they die."""

from __future__ import annotations

import multiprocessing
import resource
import signal
import traceback
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection, wait
from typing import Any, NamedTuple

MEMORY = 8 << 30  # bytes of address space of a worker
CASES = 1000  # of a worker, after which another takes its place: every law of a case is compiled, and stays loaded
PATIENCE = 1800.0  # s by the clock, for what hangs without computing


class Verdict(NamedTuple):
    """What became of one case: ok, refused, wrong, traceback, crash or hang."""

    seed: int
    kind: str
    text: str


def _work(task: Callable[[int], tuple[str, str]], connection: Connection, seconds: float) -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    signal.signal(signal.SIGPROF, signal.SIG_DFL)  # which ends the process, whatever it is at
    while True:
        seed = connection.recv()
        if seed is None:
            return
        signal.setitimer(signal.ITIMER_PROF, seconds)
        try:
            connection.send((seed, *task(seed)))
        except Exception:
            connection.send((seed, "traceback", traceback.format_exc()))


class _Worker:
    def __init__(self, task: Callable[[int], tuple[str, str]], seconds: float) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection, theirs = context.Pipe()
        self.process = context.Process(target=_work, args=(task, theirs, seconds), daemon=True)
        self.process.start()
        theirs.close()
        self.seconds, self.left = seconds, CASES

    def answer(self, seed: int) -> Verdict:
        self.left -= 1
        try:
            return Verdict(*self.connection.recv())
        except EOFError:
            self.process.join()
            if self.process.exitcode == -signal.SIGPROF:
                return Verdict(seed, "hang", f"no end after {self.seconds:g} s of processor time")
            return Verdict(seed, "crash", f"exit status {self.process.exitcode}")

    def end(self) -> None:
        self.process.kill()
        self.process.join()


def verdicts(
    task: Callable[[int], tuple[str, str]], seeds: range, workers: int, seconds: float, patience: float = PATIENCE
) -> Iterator[Verdict]:
    """Yield what `task` says of every seed, in any order, or how it took its process down.

    Args:
        task: Returns a kind and a text; what it raises is a traceback.
        seeds: The seeds.
        workers: How many processes.
        seconds: Of processor time, after which a case hangs: the same however busy the machine is.
        patience: Seconds by the clock without any answer, after which all that are under way hang.
    """
    left = iter(seeds)
    busy: dict[Any, tuple[_Worker, int]] = {}

    def give(worker: _Worker) -> None:
        seed = next(left, None)
        if seed is None:
            worker.end()
        else:
            worker.connection.send(seed)
            busy[worker.connection] = (worker, seed)

    for _ in range(workers):
        give(_Worker(task, seconds))
    while busy:
        ready = wait(list(busy), timeout=patience)
        for connection in ready or list(busy):
            worker, seed = busy.pop(connection)
            # Otherwise none has answered for so long.
            verdict = worker.answer(seed) if ready else Verdict(seed, "hang", f"no answer for {patience:g} s")
            yield verdict
            if verdict.kind in ("crash", "hang") or worker.left <= 0:
                worker.end()
                worker = _Worker(task, seconds)
            give(worker)
