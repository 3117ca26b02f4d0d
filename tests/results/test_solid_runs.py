"""Runs of solids and rings: what they leave, and that they go on where they were left."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray

import fenwear.common.signals
from fenwear import ConvergenceError, load_case
from fenwear.common.errors import InterruptedRunError
from fenwear.results.history_surfaces import EDGE
from fenwear.results.stored_history import load_history
from fenwear.steps.phase import PhaseEnd, PhaseStep
from fenwear.studies.run import run_case

NO_PICTURES = ("output.report=false", "output.uncertainty=false", "output.fields_at=[]")
COARSE = (*NO_PICTURES, "geometry.degree=1", "geometry.order=1")
SETTINGS = {
    "pin-on-disc": (*COARSE, "geometry.parameters.around=2", "wear.punch.coefficient=2e-7"),
    "ball-on-flat": (*COARSE, "motion.positions=3", "geometry.parameters.across=6", "geometry.parameters.core=0"),
    "ring-on-ring": (*NO_PICTURES, "geometry.degree=2", "geometry.parameters.across=4"),
}
NAMES = sorted(SETTINGS)
SIZES = {"across": 2, "along": 3, "pad_layers": 1, "disc_layers": 2}
SETTINGS["brake-pad"] = (*COARSE, *(f"geometry.parameters.{name}={value}" for name, value in SIZES.items()))


def run(folder: Path, name: str, *settings: str, resume: bool = False) -> tuple[xarray.Dataset, dict[str, Any]]:
    case = load_case(name, [*SETTINGS[name], *settings])
    summary, _ = run_case(case, "test", folder, lambda message: None, resume=resume, progress="none")
    return history(folder), summary


def history(folder: Path) -> xarray.Dataset:
    return load_history(folder)


def area_of_facets(data: xarray.Dataset, end: str = "") -> np.ndarray:
    """Return the areas of the facets, flat ones in a solid, and those of a ring's circles."""
    cells = data[f"facets{end}"].values
    if "r" in data:
        r = data[f"r{end}"].values[cells]
        return np.pi * np.abs(r[:, 1] ** 2 - r[:, 0] ** 2)
    x, y = data[f"x{end}"].values[cells], data[f"y{end}"].values[cells]
    return np.abs((x * np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1) * y).sum(axis=1)) / 2


@pytest.mark.parametrize("name", NAMES)
def test_history(tmp_path: Path, name: str) -> None:
    """Nodes, coordinates, facets and values of the contact surface; load, wear and scars add up."""
    count = 6
    data, summary = run(tmp_path / "run", name, f"run.half_cycles={count}", "run.integration='implicit'")
    for key, variable in data.variables.items():
        assert variable.attrs["units"], key
        assert variable.attrs["long_name"], key
        if key != "periodicity":
            assert np.isfinite(variable.values).all(), key
    assert data.pressure.dims == ("half_cycle", "node")
    load = {"pin-on-disc": 100, "ball-on-flat": 20, "ring-on-ring": 2000}[name]
    np.testing.assert_allclose((data.pressure * data.weight).sum("node"), load, rtol=1e-8)
    assert area_of_facets(data).sum() == pytest.approx(float(data.weight[-1].sum()), rel=2e-3)
    # beta~ times pressure, area and what each node slides: the volume, whatever the pressure.
    slid = {
        "pin-on-disc": 2e-7 * 2 * np.pi * (data.pressure * data.weight * np.hypot(data.x, data.y)).sum("node")
        if name == "pin-on-disc" else 0,
        "ball-on-flat": np.full(count, 1e-8 * 20 * 0.2),
        "ring-on-ring": 5e-9 * 2 * np.pi * (data.pressure * data.weight * data.r).sum("node")
        if name == "ring-on-ring" else 0,
    }[name]  # fmt: skip
    np.testing.assert_allclose(data.worn_volume_increment, slid, rtol=1e-9)
    assert summary["punch"]["worn_volume_mm3"] == pytest.approx(float(data.worn_volume_increment.sum()), rel=1e-9)
    np.testing.assert_array_equal(data.largest_depth, data.wear.max("node"))
    assert summary["punch"]["largest_depth_mm"] == data.largest_depth[-1]
    worn = data.wear[-1] > EDGE * data.wear[-1].max()
    across = data.r if "r" in data else data.across
    reach = np.ptp(across.values[worn.values])
    assert reach <= data.scar_width[-1] <= reach + 2 * np.diff(np.unique(across.values.round(6))).max()
    last = summary["forward" if name == "ball-on-flat" else "counterclockwise"]
    assert last["mean_pressure_MPa"] * last["contact_area_mm2"] == pytest.approx(load)
    assert data.attrs["directions"] == ("forward backward" if name == "ball-on-flat" else "counterclockwise clockwise")
    assert ("nominal_pressure_MPa" in summary) == (name != "ball-on-flat")


def test_worn_strip(tmp_path: Path) -> None:
    """The flat's depth is on its own nodes, and its volume is what the pressure wore: longer than the ball's scar."""
    data, summary = run(tmp_path / "run", "ball-on-flat", "run.half_cycles=6", "run.integration='implicit'")
    assert data.wear_strip.dims == ("half_cycle", "node_strip")
    volume = (data.wear_strip * data.weight_strip).sum("node_strip")
    np.testing.assert_allclose(volume, 2e-8 * 20 * 0.2 * np.arange(1, 7), rtol=1e-9)
    assert summary["strip"]["worn_volume_mm3"] == pytest.approx(float(volume[-1]), rel=1e-12)
    assert data.scar_length_strip[-1] > data.scar_length[-1] + 0.1
    assert data.x_strip.size == data.wear_strip.sizes["node_strip"]


@pytest.mark.parametrize(
    ("name", "integration"),
    [
        ("pin-on-disc", "explicit"),
        ("pin-on-disc", "jump"),
        ("ball-on-flat", "jump"),
        ("ring-on-ring", "implicit"),
        ("brake-pad", "jump"),
    ],
)
def test_resumed_equals_whole(tmp_path: Path, name: str, integration: str) -> None:
    """A run that goes on from its checkpoint comes to the same numbers; jumps are cut where they end anyway."""
    # Fields are written at a chosen half-cycle: there jumps end in both runs.
    how = (f"run.integration='{integration}'", "output.fields_at=[8]")
    run(tmp_path / "halves", name, *how, "run.half_cycles=8")
    halves, _ = run(tmp_path / "halves", name, *how, "run.half_cycles=20", resume=True)
    whole, _ = run(tmp_path / "whole", name, *how, "run.half_cycles=20")
    assert ("temperature_strip" in whole) == (name == "brake-pad")
    if "balance_error" in whole:  # rounding
        halves, whole = halves.drop_vars("balance_error"), whole.drop_vars("balance_error")
    xarray.testing.assert_allclose(halves, whole, rtol=1e-9 if name == "brake-pad" else 1e-10, atol=1e-13)


@pytest.mark.parametrize("name", NAMES)
def test_interrupted_within_a_step(tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A signal between two solves ends the run with its checkpoint; it goes on to what it would have come to."""
    how = ("run.integration='jump'", "run.half_cycles=40")
    looks = 0

    def look(self: Any) -> bool:
        nonlocal looks
        looks += 1
        return looks == 12

    with monkeypatch.context() as patched:
        patched.setattr(fenwear.common.signals.RunMonitor, "look", look)
        patched.setattr(fenwear.common.signals, "LOOK", -1.0)
        with pytest.raises(InterruptedRunError, match="to resume: --resume"):
            run(tmp_path / "cut", name, *how)
    reached = int(history(tmp_path / "cut").half_cycle[-1])
    assert 0 < reached < 40
    resumed, _ = run(tmp_path / "cut", name, *how, resume=True)
    whole, _ = run(tmp_path / "whole", name, *how)
    last = resumed.sel(half_cycle=whole.half_cycle[-1])
    xarray.testing.assert_allclose(last.wear, whole.wear[-1], rtol=1e-10)
    xarray.testing.assert_allclose(last.pressure, whole.pressure[-1], rtol=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_retried_half_cycles(tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A half-cycle that does not converge is taken in parts: the same volume, and the run tells."""
    how = ("run.integration='implicit'", "run.half_cycles=4")
    usual, _ = run(tmp_path / "usual", name, *how)
    solve, failed = PhaseStep.solve, []

    def fail_once(self: PhaseStep, temperature: Any, worn: Any, before: Any, *acting: Any) -> PhaseEnd:
        if before is not None and not failed:
            failed.append(self.phase)
            raise ConvergenceError("on purpose")
        return solve(self, temperature, worn, before, *acting)

    monkeypatch.setattr(PhaseStep, "solve", fail_once)
    data, summary = run(tmp_path / "retried", name, *how)
    assert data.retries.sum() == 1
    assert sum(summary["retries"].values()) == 1
    # What a rotation wears depends a little on the pressure, which the parts follow in smaller steps.
    np.testing.assert_allclose(
        data.worn_volume_increment, usual.worn_volume_increment, rtol=1e-12 if name == "ball-on-flat" else 1e-2
    )


@pytest.mark.parametrize("name", ["pin-on-disc", "brake-pad"])
def test_two_ranks(fenwear: Callable[..., Any], tmp_path: Path, name: str) -> None:
    """Two ranks write the same history as one, to 1e-9 of the largest value of each variable."""
    settings = (*SETTINGS[name], "run.half_cycles=6")
    options = [word for setting in settings for word in ("--set", setting)]
    for ranks in (1, 2):
        done = fenwear("run", name, "-q", "-o", tmp_path / str(ranks), *options, ranks=ranks)
        assert done.returncode == 0, done.stderr
    one, two = (history(tmp_path / str(ranks)) for ranks in (1, 2))
    assert one.sizes == two.sizes
    np.testing.assert_array_equal(one.facets, two.facets)
    values = [
        "x",
        "y",
        "along",
        "across",
        "pressure",
        "wear",
        "weight",
        "worn_volume_increment",
        "scar_length",
        "scar_width",
    ]
    for value in values + (["temperature_punch", "temperature_strip"] if name == "brake-pad" else []):
        scale = float(np.abs(one[value]).max())
        np.testing.assert_allclose(two[value], one[value], rtol=0, atol=1e-9 * scale, err_msg=value)
