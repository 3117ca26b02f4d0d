"""What the tests share: assembled systems, each made once, and the command line in a process of its own."""

from __future__ import annotations

import faulthandler
import gc
import itertools
import os
import subprocess
import sys
import time
import tomllib
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

os.environ.setdefault("HWLOC_HIDE_ERRORS", "2")
os.environ["FENWEAR_KEPT_GIB"] = "0"  # what tests have set up together, and what those of set-ups themselves compute
os.environ["OMPI_MCA_mpi_yield_when_idle"] = "1"  # noqa: SIM112  (Open MPI's name; ranks that wait leave their core)

import forked
import pytest
from hypothesis import HealthCheck, settings
from mpi4py import MPI
from petsc4py import PETSc

from fenwear import Case, Tribosystem, assemble, load_case, make_case
from fenwear.system.variants import set_up_by, with_case

# The same examples on every machine and every rank; --hypothesis-profile=search looks for others.
settings.register_profile(
    "same", derandomize=True, database=None, deadline=None, max_examples=12, suppress_health_check=list(HealthCheck)
)
settings.register_profile("search", settings.get_profile("same"), derandomize=False, max_examples=200)
settings.register_profile("few", settings.get_profile("same"), max_examples=3)
settings.load_profile("same")

TESTS = Path(__file__).parent
_FIRST: deque[Tribosystem] = deque(maxlen=6)
Edit = Callable[[dict[str, Any]], object]
PATIENCE = 1800  # s; ends what hangs, and is far from anything that a busy machine does
TERMINAL = pytest.StashKey[int]()
SET_UPS = (
    "bodies",
    "contact",
    "heat",
    "interface",
    "verify",
    "test_determinism.py",
    "common/test_parallel.py",
    "test_solid.py",
)


@lru_cache(maxsize=24)  # the largest hold some hundred MB
def _assembled(name: str, settings: tuple[str, ...]) -> Tribosystem:
    """Return the system of a case; of what is set up alike, the first is made and the others are variants of it."""
    case = load_case(name, settings)
    alike = next((first for first in _FIRST if set_up_by(first.case) == set_up_by(case)), None)
    if alike is not None:
        return with_case(alike, case)
    _FIRST.append(assemble(case))
    return _FIRST[-1]


@pytest.fixture(scope="session")
def assembled() -> Iterator[Callable[..., Tribosystem]]:
    """Return assembled(name, *settings): the system of a built-in case, made once a session."""
    yield lambda name, *settings: _assembled(name, settings)
    _assembled.cache_clear()
    _FIRST.clear()


@pytest.fixture(scope="session")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of this session's set-ups, with the forms that were compiled before."""
    workers_share = tmp_path_factory.getbasetemp()
    folder = (workers_share.parent if "PYTEST_XDIST_WORKER" in os.environ else workers_share) / "cache"
    with suppress(FileExistsError):
        folder.mkdir()
    with suppress(FileExistsError):
        (folder / "fenics").symlink_to(Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "fenics")
    return folder


@pytest.fixture(autouse=True)
def _set_ups(request: pytest.FixtureRequest, cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let tests of what comes after the set-up share set-ups on one rank: who checks set-ups computes them."""
    if MPI.COMM_WORLD.size == 1 and request.path.relative_to(TESTS).parts[0] not in SET_UPS:
        monkeypatch.setenv("FENWEAR_KEPT_GIB", "4")
        monkeypatch.setenv("XDG_CACHE_HOME", str(cache))


@pytest.fixture
def tmp_path(tmp_path: Path) -> Path:
    """Return the test's folder: that of rank 0 on every rank, since rank 0 writes and all read."""
    return MPI.COMM_WORLD.bcast(tmp_path)


@pytest.fixture(scope="session")
def unmatched(tmp_path_factory: pytest.TempPathFactory) -> Tribosystem:
    """Return Example 1 on meshes whose contact nodes do not match: the strip has two elements more on each half."""
    from fenwear.bodies.ready_geometries import meshes_folder

    text = (meshes_folder() / "punch_on_strip.geo").read_text("utf-8")
    old = "Transfinite Curve{a, b} = half_count + 1 Using Progression contact_ratio;"
    assert old in text
    folder = tmp_path_factory.mktemp("unmatched")
    (folder / "unmatched.geo").write_text(text.replace(old, old.replace("+ 1", "+ 3")), "utf-8")
    (folder / "case.toml").write_text('base = "example1"\ngeometry.file = "unmatched.geo"\n')
    return assemble(load_case(folder / "case.toml"))


@pytest.fixture(scope="session")
def edited() -> Callable[..., Case]:
    """Return edited(name, edit, *settings): a built-in case after `edit` has changed its tables."""

    def edited(name: str, edit: Edit, *settings: str) -> Case:
        tables = tomllib.loads(load_case(name, settings).to_toml())
        edit(tables)
        return make_case(tables)

    return edited


def process_environment() -> dict[str, str]:
    """Return the environment of processes: the session's own MPI must not show through to what they start.

    Ranks that wait leave their cores to other tests, which run beside them.
    """
    inherited = {k: v for k, v in os.environ.items() if not k.startswith(("PMIX", "PRTE", "OMPI_COMM", "OMPI_FILE"))}
    return {**inherited, "OMP_NUM_THREADS": "1", "OMPI_MCA_mpi_yield_when_idle": "1"}


@pytest.fixture(scope="session")
def run_python() -> Callable[..., subprocess.CompletedProcess[str]]:
    """Return run_python(*arguments, ranks=1, ...): python3 in a process of its own, under mpirun where ranks > 1."""
    environment = process_environment()

    def run_python(*arguments: object, ranks: int = 1, cwd: Path | None = None, **variables: str) -> Any:
        start = [sys.executable] if ranks == 1 else ["mpirun", "--oversubscribe", "-n", str(ranks), sys.executable]
        command = [*start, *map(str, arguments)]
        env = {**environment, **variables}
        return subprocess.run(command, capture_output=True, text=True, cwd=cwd, env=env, timeout=PATIENCE, check=False)

    return run_python


@pytest.fixture(scope="session")
def forks(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Return the address of the process that forks fenwear's commands: see tests/forked.py."""
    folder = tmp_path_factory.mktemp("forks")
    address = str(folder / "door")
    with open(folder / "messages", "wb") as said:
        server = subprocess.Popen(
            [sys.executable, str(TESTS / "forked.py"), address],
            stdin=subprocess.PIPE,
            stdout=said,
            stderr=said,
            env={**process_environment(), "PYTHONPATH": f"{TESTS.parent}"},
        )
    end = time.monotonic() + PATIENCE
    while not os.path.exists(address):
        assert server.poll() is None, (folder / "messages").read_text()
        assert time.monotonic() < end
        time.sleep(0.05)
    yield address
    server.communicate()


@pytest.fixture(scope="session")
def fenwear(run_python: Callable[..., Any], forks: str) -> Callable[..., Any]:
    """Return fenwear(*arguments, ranks=1, ...): the command line in a process of its own.

    It is forked from one with all modules loaded, but for several ranks, and for what is read when these are loaded.
    """

    def fenwear(*arguments: object, ranks: int = 1, cwd: Path | None = None, **variables: str) -> Any:
        words = ["-m", "fenwear", *map(str, arguments)]
        if ranks > 1 or variables or "--" in words:
            return run_python(*words, ranks=ranks, cwd=cwd, **variables)
        with TemporaryFile("w+b") as out, TemporaryFile("w+b") as err, open(os.devnull, "rb") as none:
            streams = [none.fileno(), out.fileno(), err.fileno()]
            status = forked.call(forks, words, os.fspath(cwd or Path.cwd()), process_environment(), streams)
            printed = []
            for stream in (out, err):
                stream.seek(0)
                printed.append(stream.read().decode("utf-8"))
        return subprocess.CompletedProcess(words, status, *printed)

    return fenwear


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark what starts a process with the fixtures above, whose imports take seconds, and what long.txt names.

    On several ranks, those marked mpi("a", "b") run with the parameters of these ids alone.
    """
    if MPI.COMM_WORLD.size > 1:
        items[:] = _on_ranks(items)
    long = set((TESTS / "long.txt").read_text("utf-8").split())
    for item in items:
        if "run_python" in getattr(item, "fixturenames", ()):
            item.add_marker("process")
        path, name = item.path.relative_to(TESTS).as_posix(), item.name.partition("[")[0]
        if long & {path, f"{path}::{name}"}:
            item.add_marker("long")
    items[:] = _long_first(items, int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1")))


def _on_ranks(items: list[pytest.Item]) -> list[pytest.Item]:
    """Return the tests that several ranks run, each with the parameters that its mark names."""
    chosen: list[pytest.Item] = []
    for name, found in itertools.groupby(items, lambda item: item.nodeid.partition("[")[0]):
        alike = {item.name.partition("[")[2][:-1]: item for item in found}
        for own, item in alike.items():
            mark = item.get_closest_marker("mpi")
            asked = mark.args if mark else ()
            assert len(alike) == 1 or alike.keys() >= set(asked), (name, asked)
            chosen += [item] if not asked or own in asked else []
    return chosen


def _long_first(items: list[pytest.Item], workers: int) -> list[pytest.Item]:
    """Return the tests so that each worker, which takes an equal run of them, begins with its share of the long ones.

    So none waits at the end for another's long test, and those that use the same systems and folders still follow
    each other on one worker.
    """
    if workers == 1:
        return items
    long = [item for mark in ("slow", "process") for item in items if mark == _length(item)]
    short = [item for item in items if not _length(item)]
    ordered: list[pytest.Item] = []
    for worker in range(workers):
        own = long[worker * len(long) // workers : (worker + 1) * len(long) // workers]
        size = max(0, (len(items) - len(ordered)) // (workers - worker) - len(own))
        ordered += [*own, *short[:size]]
        short = short[size:]
    return ordered


def _length(item: pytest.Item) -> str:
    return next((mark for mark in ("slow", "process") if item.get_closest_marker(mark)), "")


def pytest_configure(config: pytest.Config) -> None:
    """Keep a way to the terminal past what pytest captures."""
    config.stash[TERMINAL] = os.dup(2)


def pytest_collection_finish() -> None:
    """Spare the collector what is loaded by now and stays: it looks at the rest after each test on several ranks."""
    gc.collect()
    gc.freeze()


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Show where each rank is, and end, if the ranks wait for one another for ever."""
    if MPI.COMM_WORLD.size > 1:
        faulthandler.dump_traceback_later(PATIENCE, exit=True, file=item.config.stash[TERMINAL])


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """End all ranks where one fails: the others would wait for it in their next collective for ever."""
    if report.failed and MPI.COMM_WORLD.size > 1:
        text = f"\nrank {MPI.COMM_WORLD.rank}: {report.nodeid} failed in {report.when}\n{report.longreprtext}\n"
        print(text, file=sys.__stderr__, flush=True)
        MPI.COMM_WORLD.Abort(1)


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Let a choice of tests have none for several ranks: on one rank they are all."""
    if MPI.COMM_WORLD.size > 1 and session.exitstatus == pytest.ExitCode.NO_TESTS_COLLECTED:
        session.exitstatus = pytest.ExitCode.OK


def pytest_runtest_teardown() -> None:
    """Destroy what is collective on all ranks together."""
    if MPI.COMM_WORLD.size > 1:
        gc.collect()
        PETSc.garbage_cleanup()
        MPI.COMM_WORLD.Barrier()
        faulthandler.cancel_dump_traceback_later()
