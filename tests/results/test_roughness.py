"""Roughness of worn surfaces: of waves by closed forms, without their form, and over a run."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest
from waves import FULL, HEIGHT, LENGTH, wavy

from fenwear import run_case
from fenwear.bodies.grid_surface import RegularGrid
from fenwear.results.roughness import levelled, sa_sq


def test_wave_on_a_form() -> None:
    """Sa = 2 A / pi, Sq = A / sqrt(2); a bowl is no roughness."""
    grid = RegularGrid((0.0,), (LENGTH / 40,), (801,), 1, 0.0)
    x = grid.flat[:, 0]
    z = levelled(
        grid.places, HEIGHT * np.cos(2 * np.pi * x / LENGTH) + 3.0 + 0.2 * (x - 0.3) ** 2, np.zeros(801, dtype=bool)
    )
    assert sa_sq(z) == pytest.approx((2 * HEIGHT / np.pi, HEIGHT / np.sqrt(2)), rel=5e-3)


def test_a_scar_has_no_roughness() -> None:
    """A ball that has worn flat is form within its scar; what lies beside it does not count, nor do few nodes alone."""
    grid = RegularGrid((-15.0, -20.0), (1.0, 1.0), (31, 41), 2, 0.0)
    x, y = grid.flat.T
    depth = np.maximum(12.5**2 - x**2 - (y - 2) ** 2 / 2, 0.0)
    worn, wave = depth > 0, np.where(depth > 0, 1e-3 * (-1.0) ** (x + y), 1e3 * np.sin(x + y))
    z = levelled(grid.places, wave - depth, worn)
    assert len(z) == worn.sum()
    assert sa_sq(z)[1] == pytest.approx(1e-3, rel=0.02)
    holes = worn & (np.hypot(x, y) > 4)  # within a scar that has not worn everywhere all counts
    assert len(levelled(grid.places, wave - depth, holes)) == worn.sum()
    assert len(levelled(grid.places, wave - depth, np.hypot(x, y) < 4)) == 31 * 41
    line = (x == y) & (np.abs(x) < 10)
    assert len(levelled(grid.places, wave - depth, line)) == 19**2


def test_run_tells_how_rough_it_is(tmp_path: Path) -> None:
    """A wave in full contact wears off: its numbers in every record, and those of the end in the summary."""
    worn = LENGTH / (np.pi * 2e5 / (1 - 0.3**2) * 0.8)
    load = 2 * FULL
    quiet = {"report": False, "uncertainty": False, "fields_at": []}
    case = wavy(load, 321, worn, quiet, half_cycles=20, integration="jump", jump_tolerance=1e-3)
    summary, folder = run_case(case, output=tmp_path / "wave", log=lambda _: None)
    with h5py.File(folder / "history.nc") as file:
        rms = file["roughness_Sq_strip"][:]
        assert "roughness_Sq" not in file
    assert rms[0] < HEIGHT / np.sqrt(2)
    assert (np.diff(rms)[:4] < 0).all()  # then the ends of the punch, which wear most, count
    assert rms[-1] < 0.8 * HEIGHT / np.sqrt(2)
    assert summary["strip"]["roughness_Sq_mm"] == pytest.approx(rms[-1], rel=1e-9)
