"""Real faults: full and read-only disks, signals, killed ranks, removed files, NaN. See also test_checkpoint.py."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray

from fenwear import load_case
from fenwear.results.checkpoint import FILE, reached
from fenwear.results.stored_history import load_history
from fenwear.studies import run

Run = Callable[..., Any]
SMALL = (
    "output.report=false",
    "output.uncertainty=false",
    "geometry.degree=2",
    "geometry.parameters.elements_along_contact=8",
)
pytestmark = pytest.mark.process
PATIENCE = 1800  # s; ends what hangs, and is far from anything that a busy machine does
ENDLESS = ("run.half_cycles=10_000_000", "output.checkpoint=0.5", "output.every=10")


def options(*settings: str) -> list[str]:
    return [word for setting in (*SMALL, *settings) for word in ("--set", setting)]


def mount(*arguments: str) -> bool:
    return subprocess.run(["mount", *arguments], capture_output=True, check=False).returncode == 0


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Callable[[int], Path]]:
    """Return small_disk(kilobytes): the folder of a file system of that size, in memory."""
    folder = tmp_path / "disk"
    folder.mkdir()

    def small_disk(kilobytes: int) -> Path:
        if os.getuid() != 0 or not mount("-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs", str(folder)):
            pytest.skip("mounting a small file system is not permitted here; needs root and CAP_SYS_ADMIN")
        return folder

    yield small_disk
    if folder.is_mount():
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


@contextmanager
def running(folder: Path, *settings: str, ranks: int = 1, case: str = "example1-heat") -> Iterator[Any]:
    """Start a run in a process of its own, and pass it on once its first checkpoint is there."""
    start = [sys.executable] if ranks == 1 else ["mpirun", "--oversubscribe", "-n", str(ranks), sys.executable]
    words = [*start, "-m", "fenwear", "run", case, "-o", str(folder), *options(*ENDLESS, *settings)]
    inherited = {k: v for k, v in os.environ.items() if not k.startswith(("PMIX", "PRTE", "OMPI_COMM", "OMPI_FILE"))}
    environment = {**inherited, "PYTHONPATH": str(Path(__file__).parents[1]), "OMP_NUM_THREADS": "1"}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(words, env=environment, **pipes) as process:  # type: ignore[call-overload]
        try:
            wait_until((folder / FILE).exists, process)
            yield process
        finally:
            process.kill()


def wait_until(true: Callable[[], bool], process: Any = None) -> None:
    """Wait for an event, which a process that must not end meanwhile brings about."""
    deadline = time.monotonic() + PATIENCE
    while not true():
        assert process is None or process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.02)


def ended(process: Any) -> tuple[int, str]:
    """Return exit status and messages of a process that ends by itself, long before its run would."""
    _, messages = process.communicate(timeout=PATIENCE)
    assert "Traceback" not in messages, messages
    return process.returncode, messages


def ranks_of(process: Any) -> list[int]:
    """Return the process ids of mpirun's ranks."""
    listed = subprocess.run(["ps", "-eo", "pid=,ppid="], capture_output=True, text=True, check=True).stdout
    pairs = [[int(word) for word in line.split()] for line in listed.splitlines()]
    return sorted(pid for pid, parent in pairs if parent == process.pid)


def check_gone(processes: list[int]) -> None:
    """Check that no process outlives its mpirun for ever."""
    wait_until(lambda: not any(_runs(pid) for pid in processes))


def _runs(pid: int) -> bool:
    try:
        return _state(pid) not in "ZX"
    except (FileNotFoundError, ProcessLookupError):
        return False


def _state(pid: int) -> str:
    """Return the letter that ps shows for a process: R or S for one that runs, T for a stopped one, Z for a zombie."""
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]


def check_history(folder: Path) -> int:
    """Check that history.nc is whole and consistent; return its last half-cycle."""
    history = load_history(folder)
    assert (np.diff(history.half_cycle) > 0).all()
    for name, variable in history.variables.items():
        assert name == "periodicity" or np.isfinite(variable.values).all(), name
    np.testing.assert_allclose((history.pressure * history.weight).sum("x"), 1000, rtol=1e-8)
    return int(history.half_cycle.values[-1]) if history.sizes["half_cycle"] else 0


def check_goes_on(fenwear: Run, folder: Path) -> None:
    """Check that the checkpoint loads, no farther than the history, and that the run goes on."""
    with np.load(folder / FILE) as moment:
        reached = int(moment["state.half_cycle"])
    assert reached <= check_history(folder) + 20  # every tenth cycle is kept
    on = options(f"run.half_cycles={reached + 20}", "output.every=10")
    done = fenwear("run", "example1-heat", "-o", folder, *on, "--resume")
    assert done.returncode == 0, done.stderr
    assert check_history(folder) == reached + 20


# ------------------------------------------------------------------------- full disks


@pytest.mark.parametrize(
    ("kilobytes", "ranks"),
    [
        *((kilobytes, 1) for kilobytes in (8, 40, 160, 500, 900, 1200, 2000)),
        *((kilobytes, 2) for kilobytes in (40, 500, 2000)),
    ],
)
def test_full_disk(fenwear: Run, small_disk: Callable[[int], Path], kilobytes: int, ranks: int) -> None:
    """However much room there is, the run ends with a message, no crash, and what is written is whole."""
    folder = small_disk(kilobytes) / "run"
    done = fenwear(
        "run", "example1-heat", "-o", folder, *options("run.half_cycles=40", "output.report=true"), ranks=ranks
    )
    assert "Traceback" not in done.stderr, done.stderr
    assert "Exception ignored" not in done.stderr, done.stderr
    assert done.stderr.count("No space left on device") == 1, done.stderr
    if done.returncode == 0:  # all but the report is there
        assert "warning: no report of the run" in done.stderr
        assert check_history(folder) == 40
        with np.load(folder / FILE) as moment:
            assert int(moment["state.half_cycle"]) == 40
        return
    assert done.returncode == 1, done.stderr
    assert "cannot be written" in done.stderr
    assert "Mend the cause" in done.stderr
    if (folder / "history.nc").exists():
        check_history(folder)


def test_disk_fills_up_during_the_run(fenwear: Run, small_disk: Callable[[int], Path]) -> None:
    """The files stay at the last write; with room again the run goes on."""
    folder = small_disk(6000) / "run"
    with running(folder) as process:
        filler = folder.parent / "filler"
        filler.write_bytes(b"0" * (shutil.disk_usage(folder).free - 100_000))
        status, messages = ended(process)
    assert status == 1
    assert messages.count("No space left on device") == 1, messages
    assert "then resume from the checkpoint of half-cycle" in messages
    check_history(folder)
    filler.unlink()
    check_goes_on(fenwear, folder)


def test_disk_turns_read_only(fenwear: Run, small_disk: Callable[[int], Path]) -> None:
    """As file systems do after an error of the device: a message, and the files stay as they were."""
    folder = small_disk(20_000) / "run"
    with running(folder) as process:
        assert mount("-o", "remount,ro", str(folder.parent)) or mount("-o", "remount,ro,force", str(folder.parent)), (
            "cannot be remounted"
        )
        status, messages = ended(process)
    assert status == 1
    assert messages.count("Read-only file system") == 1, messages
    assert mount("-o", "remount,rw", str(folder.parent))
    check_goes_on(fenwear, folder)


def test_read_only_folder(fenwear: Run, small_disk: Callable[[int], Path]) -> None:
    """Refused as wrong usage before anything is computed, on one rank and on two."""
    folder = small_disk(1000)
    assert mount("-o", "remount,ro", str(folder))
    for ranks in (1, 2):
        done = fenwear("run", "example1", "-o", folder / "run", *options("run.half_cycles=2"), ranks=ranks)
        assert done.returncode == 2, done.stderr
        assert done.stderr.count("cannot be written: Read-only file system") == 1


def test_full_disk_for_other_commands(fenwear: Run, small_disk: Callable[[int], Path], tmp_path: Path) -> None:
    """plot, compare and mesh say it, too."""
    folder = tmp_path / "run"
    done = fenwear("run", "example1-heat", "-o", folder, *options("run.half_cycles=4"))
    assert done.returncode == 0, done.stderr
    disk = small_disk(4000)
    shutil.copytree(folder, disk / "run", ignore=shutil.ignore_patterns("figures", "report.html"))
    (disk / "filler").write_bytes(b"0" * (shutil.disk_usage(disk).free - 8192))
    commands = (
        ("plot", disk / "run"),
        ("compare", disk / "run", disk / "run", "-o", disk / "compare.png"),
        ("mesh", "example1", "-o", disk / "own.msh"),
    )
    for command in commands:
        done = fenwear(*command)
        assert done.returncode == 1, (command, done.stdout, done.stderr)
        assert "No space left on device" in done.stderr or "only a part of it" in done.stderr, (command, done.stderr)
        assert "Traceback" not in done.stderr, (command, done.stderr)
    assert not (disk / "own.msh").exists()


# ---------------------------------------------------------------------------- signals


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_signal_to_one_rank(fenwear: Run, tmp_path: Path, number: signal.Signals) -> None:
    """All ranks end together, with a checkpoint."""
    folder = tmp_path / "run"
    with running(folder, ranks=2) as process:
        os.kill(ranks_of(process)[1], number)
        status, messages = ended(process)
    assert status == 1
    assert messages.count("--resume") == 1, messages
    check_goes_on(fenwear, folder)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_signal_to_mpirun(fenwear: Run, tmp_path: Path, number: signal.Signals) -> None:
    """mpirun passes it on to all ranks: they end, and what is there is whole."""
    folder = tmp_path / "run"
    with running(folder, ranks=2) as process:
        ranks = ranks_of(process)
        assert len(ranks) == 2
        process.send_signal(number)
        status, _ = ended(process)
    assert status != 0
    check_gone(ranks)
    check_goes_on(fenwear, folder)


@pytest.mark.parametrize("ranks", [1, 2])
def test_jumps_save_and_stop(fenwear: Run, tmp_path: Path, ranks: int) -> None:
    """Jumps of many solves: saved while they go on, and ended by a signal within one."""
    folder = tmp_path / "run"
    settings = ("run.integration=jump", "run.jump_tolerance=1e-4", "output.checkpoint=1")
    with running(folder, *settings, ranks=ranks, case="fretting") as process:
        os.kill((ranks_of(process) if ranks > 1 else [process.pid])[-1], signal.SIGTERM)
        status, messages = ended(process)
    assert status == 1
    assert "interrupted" in messages
    with np.load(folder / FILE) as saved:
        reached = int(saved["state.half_cycle"])
    with xarray.open_dataset(folder / "history.nc", engine="h5netcdf") as history:
        assert history.half_cycle.values[-1] == reached > 0
    words = options(*settings, f"run.half_cycles={reached + 2}", "output.every=1", "output.fields_at=[]")
    done = fenwear("run", "fretting", "-o", folder, *words, "--resume")
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("victims", [1, 2])
def test_killed_ranks(fenwear: Run, tmp_path: Path, victims: int) -> None:
    """One rank killed: the other does not wait for it for ever. Both killed: the files are whole all the same."""
    folder = tmp_path / "run"
    with running(folder, ranks=2) as process:
        ranks = ranks_of(process)
        for pid in ranks[:victims]:
            os.kill(pid, signal.SIGKILL)
        status, messages = ended(process)
    assert status != 0
    assert "killed" in messages.lower(), messages
    check_gone(ranks)
    check_goes_on(fenwear, folder)


def test_killed_at_any_moment(tmp_path: Path) -> None:
    """What a killed run leaves is whole, at any of thirty moments spread over many writes of history and checkpoint.

    The run is stopped, where a kill would have ended it, and goes on once its folder has been copied.
    """
    folder = tmp_path / "run"
    reached = set()
    with running(folder, "output.checkpoint=0.01") as process:
        for number in range(30):
            if number % 6 == 0:  # however busy the machine is, it has gone on meanwhile
                before = int(_kept(folder).get("state.half_cycle", 0))
                wait_until(lambda before=before: int(_kept(folder).get("state.half_cycle", 0)) > before, process)
            time.sleep(0.0037 * number)
            process.send_signal(signal.SIGSTOP)
            wait_until(lambda: _state(process.pid) == "T")
            shutil.copytree(folder, tmp_path / str(number))
            process.send_signal(signal.SIGCONT)
    for number in range(30):
        copy = tmp_path / str(number)
        with np.load(copy / FILE) as moment:
            assert int(moment["state.half_cycle"]) <= check_history(copy) + 20
            reached.add(int(moment["state.half_cycle"]))
    assert len(reached) > 3


RICH = {
    "worn strip": ("fretting", "motion.positions=3", "run.integration=implicit"),
    "followed meshes": ("example1-heat", "run.integration=implicit", "geometry.follow_wear=2e-4"),
}


@pytest.mark.parametrize("name", RICH)
def test_killed_with_more_to_remember(fenwear: Run, tmp_path: Path, name: str) -> None:
    """Killed and gone on with on two ranks: as if never killed, with the strip's wear and meshes that have moved."""
    case, *settings = RICH[name]
    resumed, whole = tmp_path / "resumed", tmp_path / "whole"
    with running(resumed, *settings, case=case) as process:
        if name == "followed meshes":
            _wait_for(resumed, "followed.punch")
        process.send_signal(signal.SIGKILL)
        process.communicate(timeout=PATIENCE)
    with np.load(resumed / FILE) as moment:
        assert np.abs(moment["state.worn.strip"]).max() > 0 or name != "worn strip"
        last = int(moment["state.half_cycle"]) + 40
    words = options(*settings, f"run.half_cycles={last}", "output.every=10", "output.fields_at=[]")
    for folder, ranks, extra in ((resumed, 2, ["--resume"]), (whole, 1, [])):
        done = fenwear("run", case, "-o", folder, *words, *extra, ranks=ranks)
        assert done.returncode == 0, done.stderr
    one, other = (load_history(folder) for folder in (resumed, whole))
    np.testing.assert_array_equal(one.half_cycle, other.half_cycle)
    rounding = {"equilibrium_error", "complementarity_error", "heat_balance_error", "periodicity"}
    for variable in sorted(set(other.data_vars) - rounding):
        measure = {"gap": "wear"}.get(variable, "heat_friction" if str(variable).startswith("heat_") else variable)
        scale = float(np.abs(other[measure]).max())
        np.testing.assert_allclose(one[variable], other[variable], rtol=0, atol=1e-9 * scale, err_msg=str(variable))


def _wait_for(folder: Path, name: str) -> None:
    """Wait until the checkpoint holds these depths."""
    wait_until(lambda: name in _kept(folder))


def _kept(folder: Path) -> dict[str, Any]:
    """Return what the checkpoint holds; nothing at the moment that it is replaced by the next."""
    with suppress(FileNotFoundError), np.load(folder / FILE) as state:
        return dict(state)
    return {}


def _reached(folder: Path) -> int:
    """Return the half-cycle of the checkpoint."""
    return int(_kept(folder).get("state.half_cycle", 0))


# ---------------------------------------------------------------------- removed files


def test_history_removed(fenwear: Run, tmp_path: Path) -> None:
    """The run ends and says so; it goes on with a new history, and says this, too."""
    folder = tmp_path / "run"
    with running(folder, ranks=2) as process:
        (folder / "history.nc").unlink()
        status, messages = ended(process)
    assert status == 1
    assert messages.count("history.nc cannot be written: it or its folder has been removed") == 1, messages
    assert "then resume from the checkpoint" in messages
    with np.load(folder / FILE) as moment:
        reached = int(moment["state.half_cycle"])
    done = fenwear("run", "example1-heat", "-o", folder, *options(f"run.half_cycles={reached + 20}"), "--resume")
    assert done.returncode == 0, done.stderr
    assert "warning: history.nc is gone" in done.stderr
    with xarray.open_dataset(folder / "history.nc", engine="h5netcdf") as history:
        assert history.half_cycle.values.tolist() == list(range(reached + 1, reached + 21))


def test_checkpoint_removed(fenwear: Run, tmp_path: Path) -> None:
    """The next one takes its place: nothing is lost, the run goes on."""
    folder = tmp_path / "run"
    with running(folder) as process:
        (folder / FILE).unlink()
        wait_until((folder / FILE).exists, process)
        process.send_signal(signal.SIGTERM)
        status, messages = ended(process)
    assert status == 1
    assert "interrupted" in messages
    check_goes_on(fenwear, folder)


def test_results_removed(tmp_path: Path) -> None:
    """The whole folder gone: the run ends and says that there is nothing to go on from."""
    folder = tmp_path / "run"
    with running(folder, ranks=2) as process:
        folder.rename(tmp_path / "elsewhere")
        shutil.rmtree(tmp_path / "elsewhere")
        status, messages = ended(process)
    assert status == 1
    assert messages.count("it or its folder has been removed") == 1, messages
    assert "start again" in messages
    assert not folder.exists()


def test_history_is_read_during_the_run(tmp_path: Path) -> None:
    """A reader that keeps history.nc open neither disturbs the run nor sees its values change."""
    folder = tmp_path / "run"
    with running(folder) as process:
        with xarray.open_dataset(folder / "history.nc", engine="h5netcdf") as history:
            before, count = history.half_cycle.values.copy(), history.sizes["half_cycle"]
            wait_until(lambda: _reached(folder) > before[-1], process)
            np.testing.assert_array_equal(history.half_cycle.values, before)
            assert history.pressure.values.shape[0] == count
        process.send_signal(signal.SIGTERM)
        assert ended(process)[0] == 1
    assert check_history(folder) > before[-1]
    assert not list(folder.glob("history.[!n]*"))


# --------------------------------------------------------------------- wrong numbers


def test_divergence_during_a_run(fenwear: Run, tmp_path: Path) -> None:
    """Exit status 3 with the reason; the results before it are whole, and the run goes on with other options."""
    folder = tmp_path / "run"
    words = ("run", "example1-heat", "-o", folder, *options("output.every=10"))
    assert fenwear(*words, "--set", "run.half_cycles=40").returncode == 0
    limits = ("-fenwear_contact_snes_max_it", "0")
    done = fenwear(*words, "--set", "run.half_cycles=60", "--resume", "--", *limits, ranks=2)
    assert done.returncode == 3, done.stderr
    assert "DIVERGED_MAX_IT" in done.stderr  # of the coarser run that tells the uncertainty: it starts from nothing
    assert "results up to half-cycle 60" in done.stderr
    assert "Traceback" not in done.stderr
    check_goes_on(fenwear, folder)


def test_damaged_checkpoint(fenwear: Run, tmp_path: Path) -> None:
    """Cut in half it is refused, on one rank and on two, and nothing is changed."""
    folder = tmp_path / "run"
    assert fenwear("run", "example1-heat", "-o", folder, *options("run.half_cycles=4")).returncode == 0
    damaged = folder / FILE
    damaged.write_bytes(damaged.read_bytes()[: damaged.stat().st_size // 2])
    history = (folder / "history.nc").read_bytes()
    for ranks in (1, 2):
        done = fenwear("run", "example1-heat", "-o", folder, *options("run.half_cycles=8"), "--resume", ranks=ranks)
        assert done.returncode == 2, done.stderr
        assert "the checkpoint" in done.stderr
        assert "Traceback" not in done.stderr
    assert (folder / "history.nc").read_bytes() == history


def test_nan_in_a_checkpoint(fenwear: Run, tmp_path: Path) -> None:
    """A worn shape that is no number is refused."""
    folder = tmp_path / "run"
    assert fenwear("run", "example1-heat", "-o", folder, *options("run.half_cycles=4")).returncode == 0
    path = folder / FILE
    with np.load(path) as stored:
        arrays = dict(stored)
    arrays["state.worn.punch"][3] = np.nan
    np.savez(path, **arrays)
    done = fenwear("run", "example1-heat", "-o", folder, *options("run.half_cycles=8"), "--resume")
    assert done.returncode == 2, done.stderr
    assert "is damaged" in done.stderr


@pytest.mark.parametrize("array", ["state.worn.strip", "followed.punch", "followed.strip"])
@pytest.mark.parametrize("damage", ["NaN", "too short", "missing"])
def test_damaged_depths_in_a_checkpoint(fenwear: Run, tmp_path: Path, array: str, damage: str) -> None:
    """Of the strip's wear and of what the meshes follow."""
    folder, (name, *settings) = tmp_path / "run", RICH["followed meshes"]
    words = ("run", name, "-o", folder, *options(*settings, "geometry.follow_wear=1e-6", "output.fields_at=[]"))
    assert fenwear(*words, "--set", "run.half_cycles=4").returncode == 0
    path = folder / FILE
    with np.load(path) as stored:
        arrays = dict(stored)
    match damage:
        case "NaN":
            arrays[array][3] = np.nan
        case "too short":
            arrays[array] = arrays[array][:-1]
        case _:
            del arrays[array]
    np.savez(path, **arrays)
    done = fenwear(*words, "--set", "run.half_cycles=8", "--resume")
    assert done.returncode == 2, done.stderr
    assert "is damaged" in done.stderr


def test_damaged_history(fenwear: Run, tmp_path: Path) -> None:
    """Refused with what to do; without it the run goes on."""
    folder = tmp_path / "run"
    assert fenwear("run", "example1-heat", "-o", folder, *options("run.half_cycles=4")).returncode == 0
    history = folder / "history.nc"
    history.write_bytes(history.read_bytes()[:5000])
    words = ("run", "example1-heat", "-o", folder, *options("run.half_cycles=8"), "--resume")
    for ranks in (1, 2):
        done = fenwear(*words, ranks=ranks)
        assert done.returncode == 2, done.stderr
        assert "remove it to continue" in done.stderr
    history.unlink()
    assert fenwear(*words).returncode == 0


@pytest.mark.parametrize("coefficient", ["1e290", "1e30"])
@pytest.mark.parametrize(("follow", "expected"), [("never", "did not converge"), ("0.5", "has used up the elements")])
def test_wear_beyond_all_numbers(fenwear: Run, tmp_path: Path, coefficient: str, follow: str, expected: str) -> None:
    """Numbers that overflow end as a solver that did not converge; no NaN gets into the history."""
    folder = tmp_path / "run"
    settings = ("run.half_cycles=6", f"geometry.follow_wear={follow}", f"wear.punch.coefficient={coefficient}")
    done = fenwear("run", "example1-heat", "-o", folder, *options(*settings))
    assert done.returncode == 3, done.stderr
    assert expected in done.stderr
    check_history(folder)


TWICE = """
import os, signal, sys
from mpi4py import MPI
from fenwear.common.signals import Signals

with Signals(MPI.COMM_WORLD):
    MPI.COMM_WORLD.Barrier()  # each notes signals from here on
    if MPI.COMM_WORLD.rank == MPI.COMM_WORLD.size - 1:
        os.dup2(os.open(sys.argv[1], os.O_WRONLY | os.O_CREAT), 2)
        os.kill(os.getpid(), signal.SIGTERM)
        os.write(2, b"noted, ")
        os.kill(os.getpid(), signal.SIGINT)
        os.write(2, b"too late")
    MPI.COMM_WORLD.recv()  # for ever
"""


@pytest.mark.parametrize("ranks", [1, 2])
def test_second_signal_ends_all_ranks(run_python: Run, tmp_path: Path, ranks: int) -> None:
    """Asked twice, a rank leaves at once and takes the other with it, which waits for it.

    What is said is read from a file: mpirun may lose the last words of ranks that it ends.
    """
    said = tmp_path / "said"
    done = run_python("-c", TWICE, said, ranks=ranks)
    assert done.returncode == 1, (done.stdout, done.stderr)
    assert said.read_text().startswith("noted, fenwear: interrupted at once; ")
    assert "too late" not in said.read_text()


def test_signals_until_the_end(tmp_path: Path) -> None:
    """Those that come while an interrupted run ends do not kill it, to the last moment: the exit status stays."""
    folder = tmp_path / "run"
    with running(folder, ranks=2, case="example1") as process:
        ranks = ranks_of(process)
        os.kill(ranks[1], signal.SIGTERM)
        wait_until((folder / "summary.json").exists)
        while process.poll() is None:
            with suppress(ProcessLookupError):
                os.kill(ranks[1], signal.SIGTERM)
            time.sleep(0.002)
        messages = process.communicate()[1]
    assert process.returncode == 1, messages
    check_gone(ranks)


def test_a_signal_while_the_end_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All that was computed is there, to go on from and told; uncertainty and report, which take long, are left out."""

    def interrupted(*_: Any) -> None:
        os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(run, "write_fields", interrupted)
    case = load_case("example1", ["geometry.parameters.elements_along_contact=8", "run.half_cycles=4"])
    summary, folder = run.run_case(case, "short", tmp_path / "out", lambda _: None, progress="none")
    assert summary["half_cycles"] == 4
    assert reached(folder) == 4
    assert "uncertainty" not in summary
    assert (folder / "summary.json").is_file()
    assert not (folder / "report.html").exists()
