"""Who computes the variants: this process, local processes, or the ranks of an MPI job.

Ranks use mpi4py's MPICommExecutor, which needs no process to be started by another one and so runs under
every launcher and in every container. Local processes are joblib's loky: they are started anew, as
MPI and PETSc do not survive a fork, and need no guard in the script that starts them. Either way rank 0, or the
process that began, shares out pieces and gathers; each worker has a system of its own.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import contextmanager
from pathlib import Path
from typing import cast

from mpi4py import MPI
from mpi4py.futures import MPICommExecutor

from fenwear.errors import FenwearError, InterruptedRunError, OutputError
from fenwear.sweeps.evaluate import VariantRunner
from fenwear.sweeps.plan import Of, Variant, in_pieces
from fenwear.sweeps.store import Outcome, keep

WORTH = 8.0  # s of work for one process from which on several are started: each takes about 2 s to begin
_workshop = VariantRunner()  # of a worker: what its last variant was computed on


def compute(piece: Sequence[Variant], of: Of, folder: Path | None) -> list[Outcome]:
    """Compute variants that share their set-up, on this process, and keep each in the folder as it is done.

    Raises:
        OutputError: the folder takes no file.
    """
    return [_one(_workshop, variant, of, folder) for variant in piece]


def _one(workshop: VariantRunner, variant: Variant, of: Of, folder: Path | None) -> Outcome:
    begin = time.perf_counter()
    assert variant.case is not None
    try:
        values = workshop.values(variant.case, of)
    except OutputError:
        raise
    except FenwearError as error:
        return Outcome(variant.place, None, " ".join(str(error).split()), time.perf_counter() - begin)
    except Exception as error:  # one variant must not cost the others
        print(f"fenwear: {', '.join(variant.settings)}", file=sys.__stderr__)
        traceback.print_exc(file=sys.__stderr__)
        text = f"an error that was not foreseen: {' '.join(str(error).split())}"
        return Outcome(variant.place, None, text, time.perf_counter() - begin)
    seconds = time.perf_counter() - begin
    if folder is not None:
        keep(folder, variant.name, values, seconds)
    return Outcome(variant.place, values, "", seconds)


def outcomes(
    left: Sequence[Variant], of: Of, folder: Path | None, processes: int | None, comm: MPI.Intracomm
) -> Iterator[list[Outcome]]:
    """Yield the outcomes of variants as they are done, on rank 0; the others work, and yield nothing; collective.

    Args:
        left: The variants; of the other ranks' nothing is asked.
        of: What is computed of each.
        folder: Where each is kept as it is done; None for nowhere.
        processes: Local processes; None for as many as there are cores, where that is worth their start. On
            several ranks these are the workers instead.
        comm: The ranks.

    Raises:
        InterruptedRunError: a process has ended.
        OutputError: the folder takes no file.
    """
    if comm.size > 1:
        with MPICommExecutor(comm, root=0) as executor:
            if executor is not None:
                yield from _shared_out(cast(Executor, executor), in_pieces(left, of, comm.size - 1), of, folder)
        return
    rest = list(left)
    if processes is None or processes == 1:
        cores = len(os.sched_getaffinity(0)) if processes is None else 1
        for outcome in _alone(left, of, folder, cores):
            rest = [variant for variant in rest if variant.place != outcome.place]
            yield [outcome]
        processes = cores
    if rest:
        pieces = in_pieces(rest, of, processes)
        with _processes(min(processes, len(pieces))) as executor:
            yield from _shared_out(executor, pieces, of, folder)


def _alone(left: Sequence[Variant], of: Of, folder: Path | None, cores: int) -> Iterator[Outcome]:
    """Yield the outcomes that this process computes: all, or those before several cores are worth their start."""
    workshop = VariantRunner()
    firsts: list[float] = []
    others: list[float] = []
    pieces = in_pieces(left, of, 1)
    for number, piece in enumerate(pieces):
        for at, variant in enumerate(piece):
            outcome = _one(workshop, variant, of, folder)
            (others if at else firsts).append(outcome.seconds)
            yield outcome
            if cores > 1 and (others or len(piece) == 1):
                each = sum(firsts) / len(firsts), sum(others) / max(len(others), 1)
                ahead = len(pieces) - number - 1
                inside = len(piece) - at - 1 + sum(len(one) - 1 for one in pieces[number + 1 :])
                if each[0] * ahead + each[1] * inside > WORTH:
                    return


def _shared_out(
    executor: Executor, pieces: Sequence[Sequence[Variant]], of: Of, folder: Path | None
) -> Iterator[list[Outcome]]:
    waiting: set[Future[list[Outcome]]] = set()
    try:
        waiting |= {executor.submit(compute, piece, of, folder) for piece in pieces}
        while waiting:
            done, waiting = wait(waiting, return_when=FIRST_COMPLETED)
            for future in done:
                yield future.result()
    except BrokenExecutor as error:
        raise InterruptedRunError(
            "a process of the sweep has ended, perhaps for lack of memory: expected fewer processes at once"
        ) from error
    finally:
        for future in waiting:
            future.cancel()


@contextmanager
def _processes(count: int) -> Iterator[Executor]:
    """Open local processes; what is not done when the caller leaves is not begun any more."""
    from joblib.externals.loky import ProcessPoolExecutor

    # One thread each: their number times the threads of BLAS must not exceed the cores.
    threads = {name: os.environ.get(name, "1") for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")}
    executor = ProcessPoolExecutor(max_workers=count, env=threads, initializer=_begin)
    try:
        yield executor
    except BaseException:
        executor.shutdown(wait=False, kill_workers=True)
        raise
    executor.shutdown()


def _begin() -> None:
    """Leave an interruption to the process that started this one, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1.0)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
