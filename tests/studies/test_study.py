"""Studies: parts that start at once, killed parts, executors, and the batch file; all give the same runs."""

from __future__ import annotations

import random
import threading
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

import numpy as np
import pytest
import xarray

from fenwear import CaseError, load_case, sweep
from fenwear.common.errors import PartDoneError
from fenwear.studies import calibrate, lifetime, parse_scatter, sensitivity
from fenwear.studies.study import Run, Study, batch_file, named, parse_part
from tests import forked
from tests.conftest import process_environment
from tests.studies.test_calibrate import volumes

K = "wear.punch.coefficient"
COUNT, KILLS, PARTS = 40, 10, 4
PART = """
import os, signal, sys, threading, time
from pathlib import Path

import numpy as np

from fenwear import load_case
from fenwear.common.errors import PartDoneError
from fenwear.studies.study import Run, Study, named


class Roots:
    def compute(self, given):
        time.sleep(0.01)
        return {"roots": np.sqrt(np.arange(given, given + 5000.0))}


part, parts, seconds = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])
if seconds:
    threading.Timer(seconds, os.kill, (os.getpid(), signal.SIGKILL)).start()
study = Study(folder=Path("study"), part=(part, parts))
store = study.open(load_case("example1"), "key")
try:
    study.outcomes(Roots(), [Run(k, named(k)) for k in range(COUNT)], store)
except PartDoneError:
    pass
"""
SMALL = ("geometry.degree=1", "geometry.parameters.elements_along_contact=4")
OVER = {"contact.friction": "0.1:0.3:4", "geometry.parameters.pin_height_1": ["20 mm", "30 mm", "40 mm"]}


class Nothing:
    """Computes no run."""

    def compute(self, given: int) -> dict[str, Any]:
        """Fail."""
        raise AssertionError(given)


class Squares:
    """Computes squares."""

    def compute(self, given: int) -> dict[str, Any]:
        """Return a square."""
        return {"square": np.array(given**2)}


def test_parts_on_machines_of_other_cores(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Every run belongs to one part, however many cores each part finds."""
    runs, case = [Run(k, named(k)) for k in range(COUNT)], load_case("example1")
    for part, cores in ((1, 1), (2, 3), (3, 16)):
        monkeypatch.setattr("os.sched_getaffinity", lambda _, cores=cores: set(range(cores)))
        study = Study(folder=tmp_path / "study", part=(part, 3), processes=None)
        if part < 3:
            with pytest.raises(PartDoneError):
                study.outcomes(Squares(), runs, study.open(case, "key"))
    found = study.outcomes(Squares(), runs, study.open(case, "key"))
    assert [int(found[run.name].values["square"]) for run in runs] == [k**2 for k in range(COUNT)]


def test_killed_at_ten_moments(forks: str, tmp_path: Path) -> None:
    """Four parts start at once in an empty folder and are killed at random moments; what they leave is collected."""
    (tmp_path / "part.py").write_text(PART.replace("COUNT", str(COUNT)))
    moments = random.Random(0)
    killed: list[int] = []

    def start(part: int, seconds: float) -> int:
        with TemporaryFile("w+b") as out, open("/dev/null", "rb") as none:
            streams = [none.fileno(), out.fileno(), out.fileno()]
            words = [str(tmp_path / "part.py"), str(part), str(PARTS), str(seconds)]
            return forked.call(forks, words, str(tmp_path), process_environment(), streams)

    def in_turn(part: int, kills: int) -> None:
        killed.extend(start(part, moments.uniform(0.005, 0.08)) for _ in range(kills))
        assert start(part, 0.0) == 0

    turns = [threading.Thread(target=in_turn, args=(k + 1, (KILLS + k) // PARTS)) for k in range(PARTS)]
    for turn in turns:
        turn.start()
    for turn in turns:
        turn.join()
    assert len(killed) == KILLS
    assert killed.count(128 + 9) >= KILLS // 2  # the others were done before
    study = Study(folder=tmp_path / "study", collect=True)
    runs = [Run(k, named(k)) for k in range(COUNT)]
    found = study.outcomes(Nothing(), runs, study.open(load_case("example1"), "key"))
    for k, run in enumerate(runs):
        np.testing.assert_array_equal(found[run.name].values["roots"], np.sqrt(np.arange(k, k + 5000.0)))
    next((tmp_path / "study" / "runs").iterdir()).unlink()
    with pytest.raises(CaseError, match=rf"--collect: .* lacks 1 of {COUNT} runs"):
        study.outcomes(Nothing(), runs, study.open(load_case("example1"), "key"))


@pytest.fixture(scope="module")
def alone() -> xarray.Dataset:
    """Return a sweep by this process."""
    return sweep(load_case("example1", SMALL), OVER)


def test_executor_of_processes(alone: xarray.Dataset, tmp_path: Path) -> None:
    """Processes of the standard library compute equal rows; `tests/test_other_programs.py` has dask."""
    with ProcessPoolExecutor(2, get_context("spawn")) as executor:
        found = sweep(load_case("example1", SMALL), OVER, executor=executor, folder=tmp_path / "out")
    xarray.testing.assert_equal(found.drop_vars("seconds"), alone.drop_vars("seconds"))


def test_executor_of_mpi(run_python: Callable[..., Any], alone: xarray.Dataset, tmp_path: Path) -> None:
    """The executor of mpi4py.futures, whose workers are ranks; each has loaded PETSc, which all begin together."""
    (tmp_path / "pool.py").write_text(f"""
from mpi4py import MPI
from mpi4py.futures import MPICommExecutor

from fenwear import load_case, sweep

with MPICommExecutor(MPI.COMM_WORLD) as executor:
    if executor is not None:
        sweep(load_case("example1", {SMALL!r}), {OVER!r}, executor=executor, folder="out")
""")
    done = run_python("pool.py", ranks=3, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    found = xarray.open_dataset(tmp_path / "out" / "sweep.nc", engine="h5netcdf")
    for name in ("pressure", "shape", "lambda_F", "largest_pressure"):
        np.testing.assert_array_equal(found[name], alone[name])


def test_parts_of_a_sweep(alone: xarray.Dataset, tmp_path: Path) -> None:
    """Each part tells that others are not done; the last one, and whoever collects, has all rows."""
    case, folder = load_case("example1", SMALL), tmp_path / "out"
    with pytest.raises(PartDoneError, match=r"part 2 of 2 is done\. .* lacks 6 of 12 runs"):
        sweep(case, OVER, folder=folder, part=(2, 2))
    with pytest.raises(CaseError, match=r"--collect: .* lacks 6 of 12 runs"):
        sweep(case, OVER, folder=folder, collect=True)
    last = sweep(case, OVER, folder=folder, part=(1, 2))
    collected = sweep(case, OVER, folder=folder, collect=True)
    xarray.testing.assert_equal(last, collected)
    xarray.testing.assert_equal(last.drop_vars("seconds"), alone.drop_vars("seconds"))
    with pytest.raises(CaseError, match="--part: expected the folder"):
        sweep(case, OVER, part=(1, 2))


def test_parts_of_lives_sensitivities_and_fits(small: Callable[..., Any], tmp_path: Path) -> None:
    """Every other study has parts, too: results are those of one process, and a collection computes nothing."""
    case, keys = small("example2"), [K, "contact.friction"]
    scatter = parse_scatter(case, f"{K}=lognormal(4e-8 1/MPa, 50 %)")
    lives = tmp_path / "life"
    with pytest.raises(PartDoneError):
        lifetime(case, "volume 3 mm^3", scatter, samples=4, folder=lives, part=(1, 2))
    found = lifetime(case, "volume 3 mm^3", scatter, samples=4, folder=lives, part=(2, 2))
    np.testing.assert_array_equal(found.lives, lifetime(case, "volume 3 mm^3", scatter, samples=4).lives)
    more = lifetime(case, "volume 3 mm^3", scatter, samples=6, folder=lives, resume=True)
    np.testing.assert_array_equal(more.lives[:4], found.lives)
    what, folder = ["steady worn_volume_increment"], tmp_path / "what"
    with pytest.raises(PartDoneError):
        sensitivity(case, what, keys, folder=folder, part=(1, 2))
    parted = sensitivity(case, what, keys, folder=folder, part=(2, 2))
    assert (
        str(parted)
        == str(sensitivity(case, what, keys))
        == str(sensitivity(case, what, keys, folder=folder, collect=True))
    )
    data = [volumes(np.array([100.0, 200.0, 300.0]), [0.25, 0.49, 0.74], [0.01] * 3)]
    one, other = (calibrate(case, data, [K], folder=tmp_path / "fit", part=(k, 2)) for k in (1, 2))
    assert one.as_json() | {"evaluations": 0} == other.as_json() | {"evaluations": 0}
    assert other.evaluations < one.evaluations / 2  # it takes what the first has


def test_part_of_a_job_array(monkeypatch: pytest.MonkeyPatch) -> None:
    """Slurm numbers parts; an array of the parts that were killed is one of its own."""
    for name in ("ID", "COUNT", "MIN", "STEP"):
        monkeypatch.delenv(f"SLURM_ARRAY_TASK_{name}", raising=False)
    assert parse_part("") is None
    assert parse_part("2/3") == (2, 3)
    for name, value in {"ID": "7", "COUNT": "3", "MIN": "5", "STEP": "2"}.items():
        monkeypatch.setenv(f"SLURM_ARRAY_TASK_{name}", value)
    assert parse_part("") == (2, 3)
    with pytest.raises(CaseError, match="--part: expected I/N"):
        parse_part("2")
    text = batch_file(["life", "case.toml", "--part", "1/8", "--until", "depth 5 um", "--script=slurm", "-o", "out"], 8)
    assert "#SBATCH --array=1-8\n" in text
    assert text.endswith("exec fenwear life case.toml --until 'depth 5 um' -o out")
