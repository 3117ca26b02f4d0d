"""Pictures of the deformed bodies, from files of fields made here."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray
from matplotlib.image import imread

from fenwear.report.body_figures import (
    FIELDS,
    DrawingError,
    bodies_figure,
    common_view,
    deformed,
    draw_pictures,
    field_files,
    magnification,
)


def _grid(body: str, x: np.ndarray, z: np.ndarray, half_cycle: int) -> dict[str, Any]:
    """Return a body of a grid of nodes, sinking by 0.01 mm for each half-cycle, warmer and under more stress in it."""
    columns, rows = len(x), len(z)
    points = np.stack(np.meshgrid(x, z), axis=-1).reshape(-1, 2)
    corner = np.arange(rows * columns).reshape(rows, columns)
    cells = np.stack([corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]], axis=-1).reshape(-1, 4)
    at = f"{body}_point"
    bell = np.exp(-(points[:, 0] ** 2 + (points[:, 1] - 10) ** 2) / 50)
    return {
        f"{body}_x": (at, points[:, 0]),
        f"{body}_z": (at, points[:, 1]),
        f"{body}_cells": ((f"{body}_cell", "corner"), cells),
        f"{body}_displacement_x": (at, 0 * bell),
        f"{body}_displacement_z": (at, np.full(len(points), -0.01 * half_cycle)),
        f"{body}_von_mises": (at, 100 * half_cycle * bell),
        f"{body}_temperature": (at, 50 * half_cycle * bell),
        f"{body}_contact_x": (f"{body}_contact", x),
        f"{body}_contact_z": (f"{body}_contact", np.full(len(x), 10.0)),
        f"{body}_contact_wear": (f"{body}_contact", np.full(len(x), {"punch": 0.01, "strip": 0.005}[body])),
    }


def _write(directory: Path, half_cycle: int, *, heat: bool = True) -> xarray.Dataset:
    data = {
        **_grid("punch", np.linspace(-10, 10, 21), np.linspace(10, 40, 31), half_cycle),
        **_grid("strip", np.linspace(-60, 60, 61), np.linspace(0, 10, 11), half_cycle),
    }
    if not heat:
        data = {name: value for name, value in data.items() if "temperature" not in name}
    attributes = {"half_cycle": half_cycle, "direction": 1 if half_cycle % 2 else -1, "time": 0.3 * half_cycle}
    dataset = xarray.Dataset(data, attrs=attributes)
    (directory / FIELDS).mkdir(exist_ok=True)
    dataset.to_netcdf(directory / FIELDS / f"half_cycle_{half_cycle:06d}.nc", engine="h5netcdf")
    return dataset


def test_pictures(tmp_path: Path) -> None:
    """A picture of each field at each half-cycle, coloured where the bell is."""
    (tmp_path / "case.toml").touch()
    _write(tmp_path, 1)
    _write(tmp_path, 2)
    paths = draw_pictures(tmp_path)
    assert [path.name for path in draw_pictures(tmp_path, complete=False)] == ["bodies_temperature_000002.png"]
    names = {f"bodies_{field}{end}" for field in ("von_mises", "temperature") for end in ("_000001.png", "_000002.png")}
    assert {path.name for path in paths} == names
    for path in paths:
        pixels = np.asarray(imread(path))[..., :3]
        # Both bodies fill the picture's middle with colour: neither white nor grey.
        middle = pixels[len(pixels) // 5 : len(pixels) // 2, pixels.shape[1] // 3 : 2 * pixels.shape[1] // 3]
        assert (np.ptp(middle, axis=-1) > 0.04).mean() > 0.5


def test_without_heat_and_without_fields(tmp_path: Path) -> None:
    """Without temperature the view knows stress alone; a run without fields has no pictures."""
    assert draw_pictures(tmp_path) == []
    assert set(common_view([_write(tmp_path, 1, heat=False)]).ranges) == {"von_mises"}
    assert len(field_files(tmp_path)) == 1


def test_nodes_are_moved_by_the_magnified_displacement(tmp_path: Path) -> None:
    """Every node by factor times its displacement; the surfaces by the wear, too, not what lies away from them."""
    data = _write(tmp_path, 2)
    view = common_view([data])
    assert view.centre[2] == 10
    assert view.factor == magnification(0.02, 20) == 100
    punch, strip = (deformed(data, body, view) for body in ("punch", "strip"))
    np.testing.assert_allclose(strip[data.strip_z.values == 10, 2], 10 - 100 * 0.02 - 100 * 0.005)
    below = data.strip_z.values <= 8
    np.testing.assert_allclose(strip[below, 2], data.strip_z.values[below] - 100 * 0.02)
    surface = data.punch_z.values == 10
    np.testing.assert_allclose(punch[surface, 2], 10 - 100 * 0.02 + 100 * 0.01)
    above = data.punch_z.values >= 12
    np.testing.assert_allclose(punch[above, 2], data.punch_z.values[above] - 100 * 0.02)
    np.testing.assert_allclose(punch[:, 0], data.punch_x)


def test_curved_surfaces_are_drawn_as_they_are(tmp_path: Path) -> None:
    """The gap between a curved punch and the strip has no place in magnified displacements."""
    data = _write(tmp_path, 2)
    data.punch_contact_z.values[:] += 0.01 * data.punch_contact_x.values**2
    assert common_view([data]).factor == 1


def test_colours_leave_out_single_points_of_stress(tmp_path: Path) -> None:
    """One corner of a thousand times the stress does not turn everything else pale; temperature is shown whole."""
    data = _write(tmp_path, 1)
    view = common_view([data])
    usual = view.ranges
    assert bodies_figure(data, "von_mises", view).axes[0].collections[0].get_clim() == usual["von_mises"]
    data.punch_von_mises.values[0] = 1e5
    spiked = common_view([data]).ranges
    assert spiked["von_mises"][1] < 2 * usual["von_mises"][1]
    assert usual["temperature"][1] == pytest.approx(50)


@pytest.mark.parametrize(
    ("largest", "factor"), [(0.0, 1), (0.06, 100), (0.059, 100), (0.03, 200), (6.0, 1), (60.0, 0.1)]
)
def test_factor_is_round(largest: float, factor: float) -> None:
    assert magnification(largest, 60) == pytest.approx(factor)


def test_broken_fields_are_told(tmp_path: Path) -> None:
    (tmp_path / FIELDS).mkdir()
    (tmp_path / FIELDS / "half_cycle_000001.nc").write_text("no NetCDF")
    with pytest.raises(DrawingError, match="no pictures of the bodies: "):
        draw_pictures(tmp_path)
