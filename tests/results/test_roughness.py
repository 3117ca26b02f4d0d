"""Roughness of worn surfaces: of waves by closed forms, without their form, and over a run."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest
from waves import FULL, HEIGHT, LENGTH, wavy

from fenwear import run_case
from fenwear.bodies.grid import RegularGrid
from fenwear.bodies.topography import roughness
from fenwear.results.roughness import bearing_heights, levelled


def test_wave_on_a_form() -> None:
    """Sa = 2 A / pi, Sq = A / sqrt(2), Ssk = 0; of heights A cos(pi s) lies a share s above; a bowl is no roughness."""
    grid = RegularGrid((0.0,), (LENGTH / 40,), (801,), 1, 0.0)
    x = grid.flat[:, 0]
    z = levelled(
        grid.places, HEIGHT * np.cos(2 * np.pi * x / LENGTH) + 3.0 + 0.2 * (x - 0.3) ** 2, np.zeros(801, dtype=bool)
    )
    found = roughness(z)
    assert found.mean == pytest.approx(2 * HEIGHT / np.pi, rel=5e-3)
    assert found.rms == pytest.approx(HEIGHT / np.sqrt(2), rel=5e-3)
    assert found.skewness == pytest.approx(0.0, abs=0.01)
    shares = np.array([0.1, 0.5, 0.9])
    assert bearing_heights(z, shares) == pytest.approx(HEIGHT * np.cos(np.pi * shares), abs=0.02 * HEIGHT)


def test_rectangle_around_what_has_worn() -> None:
    """Counts alone, once it has some nodes; a plane and a saddle over it are form."""
    grid = RegularGrid((0.0, 0.0), (1.0, 1.0), (30, 40), 2, 0.0)
    x, y = grid.flat.T
    heights = np.where((x >= 5) & (x <= 20) & (y >= 8) & (y <= 31), 0.1 * x * y - 3 * x + y**2, 1e3 * np.sin(x + y))
    worn = np.isin(x, (5, 20)) & np.isin(y, (8, 31))
    assert np.abs(levelled(grid.places, heights, worn)).max() < 1e-9
    assert len(levelled(grid.places, heights, worn)) == 16 * 24
    assert len(levelled(grid.places, heights, worn & (x > 10))) == 1200


def test_run_tells_how_rough_it_is(tmp_path: Path) -> None:
    """A wave in full contact wears off: its numbers in every record, and those of the end in the summary."""
    worn = LENGTH / (np.pi * 2e5 / (1 - 0.3**2) * 0.8)
    load = 2 * FULL
    quiet = {"report": False, "uncertainty": False, "fields_at": []}
    case = wavy(load, 321, worn, quiet, half_cycles=20, integration="jump", jump_tolerance=1e-3)
    summary, folder = run_case(case, output=tmp_path / "wave", log=lambda _: None)
    with h5py.File(folder / "history.nc") as file:
        rms = file["roughness_rms_strip"][:]
        assert "roughness_rms" not in file
    assert rms[0] < HEIGHT / np.sqrt(2)
    assert (np.diff(rms)[:4] < 0).all()  # then the ends of the punch, which wear most, count
    assert rms[-1] < 0.8 * HEIGHT / np.sqrt(2)
    assert summary["strip"]["roughness_Sq_mm"] == pytest.approx(rms[-1], rel=1e-9)
