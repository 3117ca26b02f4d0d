"""Height maps and made surfaces on a contact grid."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray
from waves import FULL, HEIGHT, LENGTH, wavy

from fenwear import CaseError
from fenwear.bodies.grid_surface import RegularGrid
from fenwear.bodies.topography import heights_on
from fenwear.case import Topography
from fenwear.steps import evolve
from fenwear.system import assemble

GRID = RegularGrid((-0.5, -0.25), (0.01, 0.01), (101, 51), 2, 0.0)


@pytest.mark.parametrize("hurst", [0.4, 0.8])
def test_self_affine_surface(hurst: float) -> None:
    """Sq is exact, the spectrum falls by the power of Hurst's exponent, and a seed gives the same surface again."""
    square = RegularGrid((0.0, 0.0), (0.01, 0.01), (256, 256), 2, 0.0)
    wanted = Topography(rms=1e-4, hurst=hurst, longest=1.28, shortest=0.04, seed=3)
    z = heights_on(square, wanted, "punch.topography", None)
    assert np.sqrt(np.mean(z**2)) == pytest.approx(1e-4, rel=1e-12)
    np.testing.assert_array_equal(z, heights_on(square, wanted, "punch.topography", None))
    power = np.abs(np.fft.fft2(z.reshape(256, 256))) ** 2
    q = 2 * np.pi * np.fft.fftfreq(256, 0.01)
    size = np.hypot(*np.meshgrid(q, q))
    has = (size >= 2 * np.pi / 1.28) & (size <= 2 * np.pi / 0.04)
    slope = np.polyfit(np.log(size[has]), np.log(power[has]), 1)[0]
    assert slope == pytest.approx(-2 * (1 + hurst), abs=1e-3)
    assert power[~has].max() < 1e-20 * power.max()


def test_maps_from_files(tmp_path: Path) -> None:
    """The same map by npz, nc and csv, in other units, is the same on the grid: exact where it is bilinear."""
    x, y = np.linspace(-0.6, 0.6, 121), np.linspace(-0.3, 0.3, 61)
    z = 1e-3 * (x[:, None] + 2 * y + 3 * x[:, None] * y)
    np.savez(tmp_path / "map.npz", height=1e3 * z, x=1e3 * x, y=1e3 * y, unit="um")
    metres = {"units": "m"}
    data = xarray.DataArray(1e-3 * z, [("x", 1e-3 * x, metres), ("y", 1e-3 * y, metres)], name="height", attrs=metres)
    data.to_dataset().to_netcdf(tmp_path / "map.nc", engine="h5netcdf")
    rows = ["x (mm),y (mm),height (um)"] + [
        f"{a:.12g},{b:.12g},{1e3 * c:.12g}" for a, line in zip(x, z, strict=True) for b, c in zip(y, line, strict=True)
    ]
    (tmp_path / "map.csv").write_text("\n".join(rows))
    u, v = GRID.flat.T
    for name in ("map.npz", "map.nc", "map.csv"):
        found = heights_on(GRID, Topography(file=name, height_factor=2.0), "punch.topography", tmp_path)
        np.testing.assert_allclose(found, 2e-3 * (u + 2 * v + 3 * u * v), rtol=0, atol=1e-12)


def test_what_no_map_is(tmp_path: Path) -> None:
    """Holes, missing units, maps that are too small, too fine or of another kind are refused by key."""
    x, y = np.linspace(-0.6, 0.6, 121), np.linspace(-0.3, 0.3, 61)
    z = np.zeros((121, 61))
    holes = z.copy()
    holes[3, 4] = np.nan
    np.savez(tmp_path / "holes.npz", height=holes, x=x, y=y, unit="mm")
    np.savez(tmp_path / "bare.npz", height=z, x=x, y=y)
    np.savez(tmp_path / "small.npz", height=z, x=x / 2, y=y, unit="mm")
    np.savez(tmp_path / "row.npz", height=z[:, 0], x=x, unit="mm")
    np.savez(tmp_path / "pickle.npz", height=np.array([None]), x=x, y=y, unit="mm")
    fine = np.linspace(-0.6, 0.6, 1201)
    np.savez(tmp_path / "fine.npz", height=np.zeros((1201, 61)), x=fine, y=y, unit="mm")
    words = {
        "holes.npz": "1 holes.*holes = .fill.", "bare.npz": "unit", "small.npz": "over it", "row.npz": "coordinate",
        "pickle.npz": "cannot be read", "fine.npz": "grid.nodes", "none.npz": "cannot be read", "map.txt": "ends with",
    }  # fmt: skip
    for name, word in words.items():
        with pytest.raises(CaseError, match=f"punch.topography.file: .*{word}"):
            heights_on(GRID, Topography(file=name), "punch.topography", tmp_path)
    with pytest.raises(CaseError, match=r"shortest: .* spacings of the contact grid"):
        heights_on(GRID, Topography(rms=1e-3, longest=0.5, shortest=0.02), "punch.topography", None)
    with pytest.raises(ValueError, match="one of file"):
        Topography(file="map.npz", rms=1e-3, longest=1.0)


def test_wavy_surface_in_part_contact() -> None:
    """Row 53 (Westergaard): 2 a / lam = (2 / pi) asin sqrt(p / p*), p* = pi E* h / lam, in the middle of 20 waves."""
    system = assemble(wavy(0.3 * FULL))
    pressure = system.phase_contact([0]).solve(system.gap(0, system.unworn())).pressure[0]
    x = system.pair.x
    middle = np.abs(x) <= 0.1 - 1e-9
    mean = pressure[middle].mean()
    share = (pressure[middle] > 0).mean()
    assert share == pytest.approx(2 / np.pi * np.arcsin(np.sqrt(mean / FULL)), abs=0.02)


def test_waviness_wears_off() -> None:
    """Row 53: in full contact by a factor of e in a sliding of lam / (pi k E*); pointwise, the error as the spacing."""
    slid, errors = 0.8, []
    worn = LENGTH / (np.pi * 2e5 / (1 - 0.3**2) * slid)
    for nodes in (321, 641):
        system = assemble(wavy(2 * FULL, nodes, worn, half_cycles=40, integration="jump", jump_tolerance=1e-4))
        *_, last = evolve(system, 40)
        x, depth = system.pair.strip.x[:, 0], last.wear_strip[-1]
        middle = np.abs(x) <= 2 * LENGTH  # away from the edges, where flat punches press most
        x, depth = x[middle], depth[middle]
        wave = HEIGHT * (1 - np.exp(-1)) * np.cos(2 * np.pi * x / LENGTH)
        smooth = np.polynomial.Polynomial.fit(x, depth - wave, 4)  # the even part, more at the edges
        errors.append(float(np.abs(depth - wave - smooth(x)).max()) / HEIGHT)
    assert errors[1] < 2e-3
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.7)
