"""What a run leaves in its folder."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray

from fenwear import CaseError, ConvergenceError, Tribosystem, load_case, march
from fenwear.common.arrays import Array
from fenwear.report.run_figures import mean_pressure, nominal_width
from fenwear.results.history import HistoryWriter, free_directory, make_directory
from fenwear.results.stored_history import load_history
from fenwear.steps.driver import RunLimits
from fenwear.studies import run
from fenwear.studies.run import run_case

SMALL = ("geometry.degree=2", "geometry.parameters.elements_along_contact=8", "wear.punch.coefficient=4e-7")
QUIET = ("output.report=false", "output.uncertainty=false")


def save(folder: Path, *settings: str, name: str = "example1") -> tuple[xarray.Dataset, dict[str, object]]:
    case = load_case(name, [*SMALL, *QUIET, *settings])
    summary, directory = run_case(case, "test", folder, lambda message: None)
    assert directory == folder
    return load_history(folder), summary


@pytest.mark.parametrize("integration", ["explicit", "implicit", "jump"])
def test_history_is_what_was_computed(assembled: Callable[..., Tribosystem], tmp_path: Path, integration: str) -> None:
    """Every variable has units and a long name, no value is missing, and the dimensions are those of the design."""
    history, summary = save(tmp_path / "run", f"run.integration='{integration}'", "run.half_cycles=30")
    for name, variable in history.variables.items():
        assert variable.attrs["units"], name
        assert variable.attrs["long_name"], name
        if name != "periodicity":
            assert np.isfinite(variable.values).all(), name
    assert set(history.dims) == {"half_cycle", "x"}
    assert history.pressure.dims == ("half_cycle", "x")
    assert history.half_cycle[-1] == summary["half_cycles"] == 30
    np.testing.assert_allclose((history.pressure * history.weight).sum("x"), 1000, rtol=1e-8)
    np.testing.assert_allclose(history.worn_area_increment, 4e-7 * 1e4 * 3 / 10, rtol=1e-10)
    if integration != "jump":
        system = assembled("example1", *SMALL)
        (block,) = march(system, 30, implicit=integration == "implicit")
        np.testing.assert_array_equal(history.pressure, block.pressure)
        np.testing.assert_array_equal(history.wear, block.wear)
        np.testing.assert_array_equal(history.half_cycle, np.arange(1, 31))


def test_a_worn_volume_means_the_same_everywhere(assembled: Callable[..., Tribosystem], tmp_path: Path) -> None:
    """From the start in history and summary, by one name; a history that has another one there is refused."""
    history, summary = save(tmp_path / "run", "run.half_cycles=6")
    volume = history.worn_volume
    np.testing.assert_allclose(volume, 10 * history.worn_area_increment.cumsum(), rtol=1e-12)
    assert isinstance(summary["punch"], dict)
    for name in ("worn_volume_mm3", "worn_area_mm2"):
        assert summary["punch"][name] == float(history[name.rpartition("_")[0]][-1])

    path, system = tmp_path / "run" / "history.nc", assembled("example1", *SMALL)
    with h5py.File(path, "r+") as file:
        file.move("worn_area", "total_area")
        file.move("worn_area_increment", "worn_area")
    with pytest.raises(CaseError, match=r"history\.nc:"):
        load_history(tmp_path / "run")
    with pytest.raises(CaseError, match=r"history\.nc:"):
        HistoryWriter(path.parent, system, 4)


@pytest.mark.parametrize(
    ("name", "every", "count", "kept"),
    [
        ("example1", 4, 21, [1, 2, 9, 10, 17, 18, 20, 21]),  # whole cycles, and the last half-cycles
        ("example1", 4, 17, [1, 2, 9, 10, 16, 17]),  # the last one begins a cycle that is kept
        ("example1", 1, 5, [1, 2, 3, 4, 5]),
        ("example1", 100, 8, [1, 2, 7, 8]),
        ("monotonic-lz20", 3, 8, [1, 4, 7, 8]),
    ],
)
def test_every(tmp_path: Path, name: str, every: int, count: int, kept: list[int]) -> None:
    """Every k-th cycle is kept, and always the last one."""
    history, _ = save(tmp_path / "run", f"output.every={every}", f"run.half_cycles={count}", name=name)
    assert history.half_cycle.values.tolist() == kept


@pytest.mark.parametrize(("every", "count"), [(3, 450), (2, 5), (4, 17)])
def test_blocks_are_written_without_gaps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, every: int, count: int
) -> None:
    """Written block by block instead of at the end, the history is the same: with all of the last cycle, too."""
    settings = (f"run.half_cycles={count}", f"output.every={every}")
    at_once, _ = save(tmp_path / "one", *settings)
    monkeypatch.setattr("fenwear.results.history.SECONDS_BETWEEN_WRITES", 0.0)
    monkeypatch.setattr("fenwear.steps.driver.LOOK", 0.0)
    in_blocks, _ = save(tmp_path / "two", *settings)
    xarray.testing.assert_identical(at_once, in_blocks.assign_attrs(at_once.attrs))


def test_summary_and_case(tmp_path: Path) -> None:
    """summary.json holds the summary, with the history's last values; case.toml runs again to the same history."""
    history, summary = save(tmp_path / "run", "run.half_cycles=6")
    assert json.loads((tmp_path / "run" / "summary.json").read_text()) == summary
    rightward = summary["rightward"]
    assert isinstance(rightward, dict)
    assert rightward["half_cycle"] == 5
    assert rightward["largest_pressure_MPa"] == history.largest_pressure.values[-2] == history.pressure.values[-2].max()
    middle = int(np.abs(history.x.values).argmin())
    assert summary["wear_mm"][1] == pytest.approx(float(history.wear[-1, middle]), rel=1e-12)  # type: ignore[index]
    assert summary["x_mm"] == pytest.approx([-15, 0, 15])
    assert summary["largest_equilibrium_error"] < 1e-8  # type: ignore[operator]
    again = load_case(tmp_path / "run" / "case.toml")
    _, folder = run_case(again, "again", tmp_path / "again", lambda message: None)
    repeated = load_history(folder)
    np.testing.assert_array_equal(repeated.pressure, history.pressure)


def test_weights_follow_the_meshes(tmp_path: Path) -> None:
    """Of each node on the worn strip: the integral of its quadratic shape function along its arc, by hand.

    Records on meshes that have followed the wear had the weights of the first mesh.
    """
    settings = (
        *("geometry.parameters.elements_along_contact=16", "geometry.parameters.contact_width=1.6"),
        *("geometry.follow_wear=0.1", "wear.punch.coefficient=2e-5", "wear.strip.coefficient=3e-5"),
        *("contact.friction=0", "run.half_cycles=300", "run.jump_tolerance=0.2", "motion.positions=3", *QUIET),
    )
    _, folder = run_case(load_case("fretting", settings), "test", tmp_path / "run", lambda message: None)
    history = load_history(folder)
    followed = np.flatnonzero((np.diff(history.weight_strip, axis=0) != 0).any(axis=1)) + 1
    assert len(followed)
    x, (points, shares) = history.x_strip.values, np.polynomial.legendre.leggauss(8)

    def integrals(z: Array) -> Array:
        found = np.zeros_like(x)
        for nodes in np.arange(0, len(x) - 1, 2)[:, None] + np.arange(3):
            shape = np.array([points * (points - 1) / 2, 1 - points**2, points * (points + 1) / 2])
            slope = np.array([points - 0.5, -2 * points, points + 0.5])
            found[nodes] += shape @ (shares * np.hypot(x[nodes] @ slope, z[nodes] @ slope))
        return found

    flat = history.weight_strip.values[0]
    swept = flat / integrals(0 * x)  # where the stroke ends within a node's area, a part of it
    assert (swept <= 1 + 1e-9).all()
    assert np.abs(swept[2:-2] - 1).max() < 1e-9
    for k in followed:
        expected = swept * integrals(-history.wear_strip.values[k - 1])  # where the mesh has moved
        found = history.weight_strip.values[k]
        np.testing.assert_allclose(found, expected, rtol=1e-6)
        assert np.abs(flat / expected - 1).max() > 30 * np.abs(found / expected - 1).max()
    assert not np.diff(history.weight[followed[-1] :], axis=0).any()  # of one mesh they are the same


def test_an_older_history_is_still_drawn(tmp_path: Path) -> None:
    """Of files with the weights of one mesh the width and the mean pressure are the same."""
    history, _ = save(tmp_path / "run", "run.half_cycles=4")
    older = history.assign(weight=history.weight[0])
    assert mean_pressure(older) == mean_pressure(history) == pytest.approx(1000 / 60, rel=1e-9)
    assert nominal_width(older) == nominal_width(history) == pytest.approx(60, rel=1e-12)


def test_periodic_stop_is_said(tmp_path: Path) -> None:
    """summary.json tells why the run ended."""
    history, summary = save(tmp_path / "run", "run.periodic_within=0.05", "run.half_cycles=5000")
    assert summary["stop"] == "periodic"
    assert len(history.half_cycle) == summary["half_cycles"] < 5000


def test_unstable_run_is_warned_about(tmp_path: Path) -> None:
    """Beyond the explicit limit a warning names the way out; implicit there is none."""
    _, explicit = save(tmp_path / "one", "run.half_cycles=4", "wear.punch.coefficient=1e-3")
    assert "run.integration" in str(explicit["warnings"])
    _, implicit = save(tmp_path / "two", "run.half_cycles=4", "wear.punch.coefficient=1e-3", "run.integration=implicit")
    assert implicit["warnings"] == []


def test_failed_half_cycle_leaves_the_results_before_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A solver that fails after two blocks: history, summary and figures of what was computed, and the error."""
    case = load_case("example1", [*SMALL, "run.half_cycles=1000"])

    def failing(system: Tribosystem, limits: RunLimits, *_: object, **_how: object):  # type: ignore[no-untyped-def]
        for number, block in enumerate(march(system, limits.half_cycles)):
            if number == 2:
                raise ConvergenceError("DIVERGED_ON_PURPOSE")
            yield block

    monkeypatch.setattr(run, "integrate", failing)
    with pytest.raises(ConvergenceError, match="DIVERGED_ON_PURPOSE") as failed:
        run_case(case, "test", tmp_path / "run", lambda message: None)
    assert f"half-cycle 400 are in {tmp_path / 'run'}" in str(failed.value)
    history = load_history(tmp_path / "run")
    assert history.half_cycle[-1] == 400
    assert "DIVERGED_ON_PURPOSE" in json.loads((tmp_path / "run" / "summary.json").read_text())["stop"]
    assert (tmp_path / "run" / "figures" / "shape.png").is_file()


def test_directories(tmp_path: Path) -> None:
    """A folder of results is new or empty; a file or a full folder is never touched."""
    make_directory(tmp_path / "a" / "b")
    with pytest.raises(CaseError, match="exists already"):
        make_directory(tmp_path / "a")
    (tmp_path / "file").write_text("mine")
    with pytest.raises(CaseError, match="exists already"):
        make_directory(tmp_path / "file")
    with pytest.raises(CaseError, match="cannot be written"):
        make_directory(tmp_path / "file" / "below")
    assert (tmp_path / "file").read_text() == "mine"
    assert free_directory(tmp_path / "c") == tmp_path / "c"
    (tmp_path / "a-2").mkdir()
    assert free_directory(tmp_path / "a") == tmp_path / "a-3"
