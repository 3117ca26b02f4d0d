"""Checkpoints and resumed runs, ended by real signals in processes of their own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray

from fenwear import Tribosystem, load_case
from fenwear.results import checkpoint
from fenwear.results.stored_history import load_history
from fenwear.steps.run_state import RunState
from fenwear.studies.run import run_case

Run = Callable[..., Any]
SMALL = (
    "output.report=false",
    "output.uncertainty=false",
    "geometry.degree=2",
    "geometry.parameters.elements_along_contact=8",
    "heat.steps=2",
)


def options(*settings: str) -> list[str]:
    return [word for setting in (*SMALL, *settings) for word in ("--set", setting)]


def history(folder: Path) -> xarray.Dataset:
    return load_history(folder)


def check_equal(resumed: Path, whole: Path) -> None:
    one, other = history(resumed), history(whole)
    assert (one.half_cycle == other.half_cycle).all()
    for name in ("pressure", "temperature_punch", "temperature_strip"):
        scale = float(np.abs(other[name]).max())
        np.testing.assert_allclose(one[name], other[name], rtol=0, atol=1e-10 * scale)
    np.testing.assert_allclose(one.wear, other.wear, rtol=1e-10)


@pytest.mark.parametrize("integration", ["explicit", "jump"])
@pytest.mark.parametrize("operator", ["reduced", "full"])
def test_resumed_equals_whole(fenwear: Run, tmp_path: Path, integration: str, operator: str) -> None:
    """A resumed run continues to the same numbers, 1e-10; a jump run is cut where a jump ends."""
    case = options(f"run.integration={integration}", f"heat.operator={operator}", "output.fields_at=[40]")
    halves = ("--set", "run.half_cycles=40"), ("--set", "run.half_cycles=90", "--resume")
    for half in halves:
        done = fenwear("run", "example1-heat", "-o", str(tmp_path / "resumed"), *case, *half)
        assert done.returncode == 0, done.stderr
    done = fenwear("run", "example1-heat", "-o", str(tmp_path / "whole"), *case, "--set", "run.half_cycles=90")
    assert done.returncode == 0, done.stderr
    check_equal(tmp_path / "resumed", tmp_path / "whole")


def test_another_number_of_ranks(fenwear: Run, tmp_path: Path) -> None:
    """A run on two ranks goes on on one: the same scalars as a run on one, to 1e-9."""
    for ranks, count, extra in ((2, 20, ()), (1, 50, ("--resume",))):
        settings = options(f"run.half_cycles={count}")
        done = fenwear("run", "example1-heat", "-o", str(tmp_path / "two"), *settings, *extra, ranks=ranks)
        assert done.returncode == 0, done.stderr
    fenwear("run", "example1-heat", "-o", str(tmp_path / "one"), *options("run.half_cycles=50"))
    one, two = history(tmp_path / "one"), history(tmp_path / "two")
    for name in ("largest_pressure", "largest_temperature", "worn_area_increment"):
        np.testing.assert_allclose(two[name], one[name], rtol=1e-9)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGKILL])
def test_a_signal_loses_nothing(fenwear: Run, tmp_path: Path, number: signal.Signals) -> None:
    """Ended by a signal the run leaves whole files and goes on; killed, from its last checkpoint."""
    folder = tmp_path / "run"
    settings = options("run.half_cycles=10_000_000", "output.checkpoint=0.5", "output.every=10")
    command = [sys.executable, "-m", "fenwear", "run", "example1-heat", "-o", str(folder), *settings]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment) as process:
        while not (folder / checkpoint.FILE).exists():
            assert process.poll() is None
            time.sleep(0.05)
        process.send_signal(number)
        _, messages = process.communicate(timeout=1800)  # ends what hangs, however busy the machine
    if number == signal.SIGKILL:
        assert process.returncode == -number
    else:
        assert process.returncode == 1
        assert "--resume" in messages
        assert "Traceback" not in messages
    with np.load(folder / checkpoint.FILE) as moment:
        reached = int(moment["state.half_cycle"])
    assert (np.diff(history(folder).half_cycle) > 0).all()
    on = options(f"run.half_cycles={reached + 20}", "output.every=10")
    done = fenwear("run", "example1-heat", "-o", str(folder), *on, "--resume")
    assert done.returncode == 0, done.stderr
    whole = fenwear("run", "example1-heat", "-o", str(tmp_path / "whole"), *on)
    assert whole.returncode == 0, whole.stderr
    one, other = history(folder), history(tmp_path / "whole")
    np.testing.assert_allclose(one.wear[-1], other.wear[-1], rtol=1e-10)
    assert int(one.half_cycle[-1]) == reached + 20


def test_refusals(fenwear: Run, tmp_path: Path) -> None:
    """A checkpoint of another case is refused with the difference named; so is a folder without one."""
    folder = str(tmp_path / "run")
    assert fenwear("run", "example1-heat", "-o", folder, *options("run.half_cycles=4")).returncode == 0
    before = (tmp_path / "run" / "history.nc").read_bytes()
    for settings, expected in (
        (("run.half_cycles=8", "contact.friction=0.2"), "contact.friction: the checkpoint has 0.25, the case 0.2"),
        (("run.half_cycles=4",), "run.half_cycles: the run is at half-cycle 4 already"),
    ):
        done = fenwear("run", "example1-heat", "-o", folder, *options(*settings), "--resume")
        assert done.returncode == 2
        assert expected in done.stderr
    (tmp_path / "run" / checkpoint.FILE).unlink()
    (tmp_path / "run" / "checkpoint").mkdir()  # as earlier versions have it
    done = fenwear("run", "example1-heat", "-o", folder, *options("run.half_cycles=8"), "--resume")
    assert done.returncode == 2
    assert "is damaged, or of an earlier version" in done.stderr
    assert (tmp_path / "run" / "history.nc").read_bytes() == before
    done = fenwear("run", "example1-heat", "-o", str(tmp_path / "none"), *options(), "--resume")
    assert done.returncode == 2
    assert "no checkpoint in" in done.stderr
    assert not (tmp_path / "none").exists()


def test_jumps_are_saved_long_before_a_block_of_them_is_full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the clock, which is always over here: each jump is recorded and saved."""
    saved: list[int] = []
    save = checkpoint.save

    def noted(directory: Path, system: Tribosystem, state: RunState, extremes: Mapping[str, float]) -> None:
        saved.append(state.half_cycle)
        save(directory, system, state, extremes)

    monkeypatch.setattr("fenwear.studies.run.BLOCK_SECONDS", 0.0)
    monkeypatch.setattr("fenwear.common.signals.LOOK", 0.0)
    monkeypatch.setattr(checkpoint, "save", noted)
    settings = (
        "run.half_cycles=400",
        "run.jump_tolerance=0.02",
        "output.checkpoint=1e-9",
        "output.report=false",
        "output.uncertainty=false",
    )
    case = load_case(
        "block-on-ring", [*settings, "output.fields_at=[]", "geometry.parameters.elements_along_contact=8"]
    )
    _, folder = run_case(case, "run", tmp_path / "run", lambda message: None, progress="none")
    recorded = history(folder).half_cycle.values.tolist()
    assert len(recorded) < 200
    assert sorted(set(saved)) == recorded
