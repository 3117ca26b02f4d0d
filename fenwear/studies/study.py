"""The runs of a study: each has a name by what it computes, a file of its own, and a place in one part of the study.

The runs of a sweep, of lives with scatter, of sensitivities and of one iteration of a fit do not depend on each other.
A run is a file in the folder `runs` as soon as it is done, whole or not at all. Its name is a checksum of all that its
result depends on. A study therefore resumes at any run. Its parts may start at once in one folder, on all machines that
share it, and a part that is killed loses one run. Part i of n has pieces i, i + n, ... of the runs, whatever is done
already. Within a part its runs are shared out among ranks, local processes, or the workers of an executor.

Local processes are joblib's loky: they are new processes, as MPI and PETSc do not survive a fork.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import re
import shlex
import signal
import sys
import threading
import time
import traceback
import zipfile
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from itertools import chain, groupby
from pathlib import Path
from typing import Any, Protocol, TypeAlias, TypedDict, Unpack

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

import fenwear
from fenwear.case import Case
from fenwear.common.errors import CaseError, FenwearError, InputError, InterruptedRunError, OutputError, PartDoneError
from fenwear.common.parallel import on_root
from fenwear.results.disk import replacing, writing
from fenwear.results.history import free_directory, make_directory, write_case

RUNS = "runs"
WORTH = 8.0  # s of work for one process from which on several are started: each takes about 2 s to begin
UNKNOWN_WORKERS = 16  # that pieces are cut for where an executor has a number of its own
Values: TypeAlias = Mapping[str, NDArray[Any]]
Progress: TypeAlias = Callable[[int, int], None]


@dataclass(frozen=True)
class Run:
    """One run of a study.

    Attributes:
        given: Its case.
        name: A checksum of all that its result depends on.
        title: For messages.
        sharing: Parts that it shares with other runs, the dearest first: runs of one set-up stay together.
    """

    given: Any
    name: str
    title: str = ""
    sharing: tuple[str, ...] = ("",)


@dataclass(frozen=True)
class Outcome:
    """The outcome of a run.

    Attributes:
        values: Its results; none where it failed.
        trouble: The reason of a failure.
        seconds: Its time.
    """

    values: Values
    trouble: str = ""
    seconds: float = 0.0


ABSENT = Outcome({}, "not computed")


class Job(Protocol):
    """Computes one run after another. It keeps what runs share, and crosses processes without that."""

    def compute(self, given: Any) -> Values:
        """Return the results of a run."""


def named(*parts: object) -> str:
    """Return a checksum of what a result depends on, and of this version."""
    texts = [part.hex() if isinstance(part, bytes) else str(part) for part in (fenwear.__version__, *parts)]
    return hashlib.sha256("\n".join(texts).encode()).hexdigest()[:20]


def case_text(case: Case) -> str:
    """Return the text of a case, with a checksum of the file of its geometry."""
    return f"{case.to_toml()}\n{_checksum(case.resolved()['geometry']['file'])}"


@lru_cache
def _checksum(path: str) -> str:
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:  # one of those that come with the package
        return ""


class Store:
    """Outcomes by the names of their runs: in memory, and on the disk where there is a folder."""

    def __init__(self, folder: Path | None = None, study: str = "") -> None:
        self.folder, self.study = folder, study
        self.computed = 0
        self._known: dict[str, Outcome] = {}

    def __reduce__(self) -> tuple[type[Store], tuple[Path | None, str]]:
        return type(self), (self.folder, self.study)

    def load(self, runs: Sequence[Run], *, failed: bool = False) -> dict[str, Outcome]:
        """Return the outcomes of runs that are done; of those that failed in an earlier process if they are wanted."""
        for name in {run.name for run in runs} - self._known.keys():
            outcome = self._read(name)
            if not outcome.trouble or (failed and outcome is not ABSENT):
                self._known[name] = outcome
        return {run.name: self._known[run.name] for run in runs if run.name in self._known}

    def _read(self, name: str) -> Outcome:
        if self.folder is None:
            return ABSENT
        try:
            with np.load(self._path(self.folder, name), allow_pickle=False) as file:
                values = dict(file)
                return Outcome(values, str(values.pop("trouble")), float(values.pop("seconds")))
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
            return ABSENT

    def _path(self, folder: Path, name: str) -> Path:
        return folder / RUNS / f"{self.study}-{name}.npz"

    def add(self, outcomes: Mapping[str, Outcome], computed: int) -> None:
        """Remember outcomes that others have computed, and count them."""
        self._known |= outcomes
        self.computed += computed

    def put(self, name: str, outcome: Outcome) -> Outcome:
        """Keep the outcome of a run; return it.

        Raises:
            OutputError: it cannot be written.
        """
        self._known[name] = outcome
        if self.folder is not None:
            extra = {"trouble": np.array(outcome.trouble), "seconds": np.array(outcome.seconds)}
            with replacing(self._path(self.folder, name), shared=True) as part, part.open("wb") as file:
                np.savez(file, allow_pickle=False, **outcome.values, **extra)
        return outcome


def _compute(job: Job, runs: Sequence[Run], store: Store) -> dict[str, Outcome]:
    """Compute runs one after another, and keep each as soon as it is done; one that another part has is taken.

    Raises:
        OutputError: the folder takes no file.
    """
    return {run.name: store.load([run]).get(run.name) or store.put(run.name, _attempt(job, run)) for run in runs}


def _attempt(job: Job, run: Run) -> Outcome:
    begin = time.perf_counter()
    try:
        return Outcome(job.compute(run.given), "", time.perf_counter() - begin)
    except OutputError:
        raise
    except FenwearError as error:
        text = str(error)
    except Exception as error:  # one run must not cost the others
        print(f"fenwear: {run.title}", file=sys.__stderr__)
        traceback.print_exc(file=sys.__stderr__)
        text = f"an error that was not foreseen: {error}"
    return Outcome({}, " ".join(text.split()), time.perf_counter() - begin)


@lru_cache(maxsize=1)
def _unpacked(job: bytes) -> Job:
    """Return the job of a worker, which keeps what its runs share until another one comes."""
    return pickle.loads(job)  # type: ignore[no-any-return]


def _piece(job: bytes, runs: Sequence[Run], store: Store) -> dict[str, Outcome]:
    return _compute(_unpacked(job), runs, store)


def in_pieces(runs: Sequence[Run], workers: int) -> list[list[Run]]:
    """Return runs in pieces: those in one share their set-up. Some pieces are cut, so that no worker is idle."""
    ordered = sorted(runs, key=lambda run: run.sharing)  # stable: else in the order of the study
    pieces = [list(group) for _, group in groupby(ordered, key=lambda run: run.sharing[0])]
    while workers > 1 and len(pieces) < 4 * workers:
        pieces.sort(key=len)
        longest = pieces.pop()
        if len(longest) < 2:
            return [*pieces, longest]
        half = len(longest) // 2
        pieces += [longest[:half], longest[half:]]
    return sorted(pieces, key=lambda piece: piece[0].sharing)


class StudyOptions(TypedDict, total=False):
    """The way in which a study computes its runs: options of `sweep`, `lifetime`, `sensitivity` and `calibrate`.

    Attributes:
        folder: New folder of the results, where each run is kept as soon as it is done.
        resume: Take the runs that the folder has, and compute the others.
        part: Compute part (i, n) of the runs, for i from 1 to n; parts share the folder.
        collect: Put together what all parts have computed; nothing is computed.
        processes: Local processes; None for as many as there are cores, where several pay.
        executor: Any executor of `concurrent.futures`, whose workers take the runs.
        comm: The ranks, which share the runs.
    """

    folder: Path | str | None
    resume: bool
    part: tuple[int, int] | None
    collect: bool
    processes: int | None
    executor: Executor | None
    comm: MPI.Comm


class Study:
    """Computes the runs of a study; the attributes are those of `StudyOptions`.

    Raises:
        CaseError: they make no sense.
    """

    def __init__(self, **how: Unpack[StudyOptions]) -> None:
        folder = how.get("folder")
        self.folder = None if folder is None else Path(folder)
        self.resume, self.collect, self.part = how.get("resume", False), how.get("collect", False), how.get("part")
        self.processes, self.executor = how.get("processes", 1), how.get("executor")
        self.comm = MPI.COMM_SELF if self.executor else how.get("comm", MPI.COMM_WORLD)  # its workers replace ranks
        number, count = self.part or (1, 1)
        if not 1 <= number <= count:
            raise CaseError(InputError("--part", f"expected I/N with I from 1 to N, got {number}/{count}"))
        if self.processes is not None and self.processes < 1:
            raise CaseError(InputError("--processes", f"expected one or more, got {self.processes}"))
        for option, asked in (("--resume", self.resume), ("--collect", self.collect), ("--part", self.part)):
            if asked and self.folder is None:
                raise CaseError(InputError(option, "expected the folder of the study, as -o DIR"))

    def open(self, case: Case, key: str) -> Store:
        """Return the store of a study with this key, and begin its folder; collective.

        Raises:
            CaseError: there is a study already, or none to resume, or another one.
            OutputError: the folder takes no file.
        """
        on_root(self.comm, lambda: self._begin(case, key))
        return Store(self.folder, key)

    def _begin(self, case: Case, key: str) -> None:
        if self.folder is None:
            return
        runs = self.folder / RUNS
        option = "--collect" if self.collect else "--resume" if self.resume else "--part" if self.part else ""
        if option in ("--collect", "--resume") and not runs.is_dir():
            raise CaseError(InputError(option, f"{self.folder} holds no runs of a study"))
        if not option and runs.is_dir():
            message = f"{self.folder} holds a study already; expected a new or an empty folder, or --resume to continue"
            raise CaseError(InputError("-o", message))
        if option and any(runs.glob("*.npz")) and not any(runs.glob(f"{key}-*")):
            message = f"{runs} belongs to another study: version, case, data, keys or seed differ"
            raise CaseError(InputError(option, message))
        if not option:
            make_directory(self.folder)
        with writing(self.folder):
            runs.mkdir(parents=True, exist_ok=True)
        write_case(self.folder, case)

    def outcomes(
        self,
        job: Job,
        runs: Sequence[Run],
        store: Store,
        progress: Progress = lambda done, total: None,
        *,
        by_all: bool = False,
    ) -> dict[str, Outcome]:
        """Return the outcomes of all runs by their names; collective.

        Args:
            job: Computes a run.
            runs: The runs.
            store: Keeps outcomes.
            progress: Called with the numbers of runs done and of all of this part.
            by_all: Whether each part needs all runs: it begins with its own, and takes from the others what is done.

        Raises:
            PartDoneError: other parts are not done.
            CaseError: runs are missing that are to be put together.
            InterruptedRunError: interrupted; what is in the folder stays.
            OutputError: the folder takes no file.
        """
        number, parts = self.part or (1, 1)
        known = self.comm.bcast(store.load(runs, failed=self.collect))
        workers = self.comm.size * (UNKNOWN_WORKERS if self.executor else self._processes)
        dealt = in_pieces(runs, parts)  # alike for all parts, whatever workers each of them has
        shares = [list(chain(*dealt[(number - 1 + k) % parts :: parts])) for k in range(parts)]
        pieces_here = [piece for share in (shares if by_all else shares[:1]) for piece in in_pieces(share, workers)]
        left = [kept for piece in pieces_here if (kept := [run for run in piece if run.name not in known])]
        total = sum(map(len, pieces_here))
        before = total - sum(map(len, left))
        done_here: dict[str, Outcome] = {}
        failure: Exception | None = None
        progress(before, total)
        try:
            for done in self._computed(job, [] if self.collect else left[self.comm.rank :: self.comm.size], store):
                done_here |= done
                progress(min(before + len(done_here) * self.comm.size, total), total)
        except KeyboardInterrupt:
            failure = InterruptedRunError("interrupted")
        except Exception as error:  # raised below, on all ranks
            failure = error
        each = self.comm.allgather((done_here, failure))
        store.add(
            {name: outcome for outcomes, _ in each for name, outcome in outcomes.items()}, sum(len(o) for o, _ in each)
        )
        for _, problem in each:
            if problem is not None:
                raise self._with_advice(problem, runs, store)
        everything = self.comm.bcast(store.load(runs, failed=True))
        missing = len({run.name for run in runs}) - len(everything)
        lacks = f"{self.folder} lacks {missing} of {len(runs)} runs"
        if missing and self.collect:
            raise CaseError(InputError("--collect", f"{lacks}. Start their parts again, or use --resume"))
        if missing:
            raise PartDoneError(
                f"part {number} of {parts} is done. {lacks} of other parts: the last one writes results"
            )
        return everything

    def _with_advice(self, problem: Exception, runs: Sequence[Run], store: Store) -> Exception:
        """Return what ended a study; of an interruption with the way to continue."""
        if self.folder is None or not isinstance(problem, InterruptedRunError):
            return problem
        done = f"{len(store.load(runs))} of {len(runs)} runs are in {self.folder}"
        return InterruptedRunError(f"{problem}\n{done}, to resume: --resume")

    @property
    def _processes(self) -> int:
        if self.comm.size > 1:
            return 1
        return self.processes or len(os.sched_getaffinity(0))

    def _computed(self, job: Job, pieces: Sequence[Sequence[Run]], store: Store) -> Iterator[dict[str, Outcome]]:
        """Yield the outcomes of runs as they are done.

        This process begins, where nobody says how many are to compute: until several are worth their start.
        """
        if self.executor is not None:
            yield from _shared_out(self.executor, job, pieces, store)
            return
        count = self._processes
        alone = count == 1 or self.processes is None
        left, seconds, done = deque(run for piece in pieces for run in piece), 0.0, 0
        while left and alone:
            outcomes = _compute(job, [left.popleft()], store)
            seconds += sum(outcome.seconds for outcome in outcomes.values())
            done += 1
            yield outcomes
            alone = count == 1 or done < 2 or seconds / done * len(left) < WORTH
        if left:
            pieces = in_pieces(left, count)
            with _local(min(count, len(pieces))) as executor:
                yield from _shared_out(executor, job, pieces, store)


def _shared_out(
    executor: Executor, job: Job, pieces: Sequence[Sequence[Run]], store: Store
) -> Iterator[dict[str, Outcome]]:
    waiting: set[Future[dict[str, Outcome]]] = set()
    packed = pickle.dumps(job)
    try:
        waiting |= {executor.submit(_piece, packed, piece, store) for piece in pieces}
        while waiting:
            done, waiting = wait(waiting, return_when=FIRST_COMPLETED)
            for future in done:
                yield future.result()
    except BrokenExecutor as error:
        raise InterruptedRunError(
            "a process of the study has ended, perhaps for lack of memory. Reduce --processes"
        ) from error
    finally:
        for future in waiting:
            future.cancel()


@contextmanager
def _local(count: int) -> Iterator[Executor]:
    """Open local processes; what is not done when the caller leaves is not begun any more."""
    from joblib.externals.loky import ProcessPoolExecutor

    # One thread each: their number times the threads of BLAS must not exceed the cores.
    threads = {name: os.environ.get(name, "1") for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")}
    executor = ProcessPoolExecutor(max_workers=count, env=threads, initializer=_begin_worker)
    try:
        yield executor
    except BaseException:
        executor.shutdown(wait=False, kill_workers=True)
        raise
    executor.shutdown()


def _begin_worker() -> None:
    """Leave an interruption to the process that started this one, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1.0)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def parse_part(text: str) -> tuple[int, int] | None:
    """Return part (i, n) of I/N; by default that of a job array of Slurm, None outside of one.

    Raises:
        CaseError: it is not of this form.
    """
    task = {name: os.environ.get(f"SLURM_ARRAY_TASK_{name}", "1") for name in ("ID", "COUNT", "MIN", "STEP")}
    if not text:
        inside = "SLURM_ARRAY_TASK_ID" in os.environ
        return ((int(task["ID"]) - int(task["MIN"])) // int(task["STEP"]) + 1, int(task["COUNT"])) if inside else None
    match = re.fullmatch(r"(\d+)/(\d+)", text.strip())
    if not match:
        raise CaseError(InputError("--part", f"expected I/N such as 1/4, got {text!r}"))
    return int(match[1]), int(match[2])


def in_results(how: StudyOptions, name: str) -> tuple[StudyOptions, Path, MPI.Comm]:
    """Return the options with a folder, by default results/NAME or with a number behind it, the folder, and the ranks.

    Collective.

    Raises:
        CaseError: the options need a folder with a name.
    """
    study = Study(**how)
    folder = study.folder or on_root(study.comm, lambda: free_directory(Path("results") / name))
    return {**how, "folder": folder}, folder, study.comm


def batch_file(arguments: Sequence[str], parts: int) -> str:
    """Return the batch file of Slurm whose job array computes a study, each job one part."""
    command = re.sub(r" --(part|script)[= ]\S+", "", shlex.join(arguments))
    return f"""#!/bin/sh
#SBATCH --job-name=fenwear-{arguments[0]}
#SBATCH --array=1-{parts}
#SBATCH --ntasks=1
# Each job computes one part, and the last one writes the results. Submit the file again if jobs were killed.
export OMP_NUM_THREADS=1
exec fenwear {command}"""
