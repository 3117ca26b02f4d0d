"""Height maps: one map in every way of writing, holes, fill values, tilt, and scattered points."""

from __future__ import annotations

import random
import sys
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray

from fenwear import CaseError
from fenwear.bodies.grid_surface import RegularGrid
from fenwear.bodies.topography import heights_on
from fenwear.case import Topography
from fenwear.files.height_maps import Heights, raster, read_heights

X, Y = np.linspace(0, 0.4, 41), np.linspace(0, 0.3, 31)
Z = 5e-5 * np.sin(20 * X[:, None]) * np.cos(15 * Y)
GRID = RegularGrid((0.05, 0.05), (0.01, 0.01), (31, 21), 2, 0.0)
RNG = np.random.default_rng(1)


def rows(x: object, y: object, z: object, head: str = "x (mm),y (mm),height (um)") -> str:
    points = zip(np.ravel(x), np.ravel(y), 1e3 * np.ravel(z), strict=True)
    return "\n".join((head, *(f"{a!r},{b!r},{c!r}" for a, b, c in (map(float, point) for point in points))))


def write(folder: Path, way: str) -> Path:
    """Write the map."""
    path = folder / f"map.{way.partition('.')[2]}"
    data = xarray.DataArray(Z, [("x", X, {"units": "mm"}), ("y", Y, {"unit": "mm"})], attrs={"units": "mm"})
    mesh = np.meshgrid(X, Y, indexing="ij")
    if way == "bytes.npz":
        np.savez(path, Z=1e3 * Z, x=1e3 * X, y=1e3 * Y, unit=np.bytes_(b"um"))
    elif way == "descending.npz":
        np.savez(path, height=Z[:, ::-1], x=X, y=Y[::-1], unit="mm")
    elif way == "classic.nc":
        data.to_dataset(name="heights").to_netcdf(path, engine="scipy")
    elif way == "transposed.nc":
        data.T.to_dataset(name="height").to_netcdf(path, engine="h5netcdf")
    elif way == "jitter.csv":
        near = [axis + 1e-7 * RNG.standard_normal(axis.shape) for axis in mesh]
        path.write_text(rows(*near, Z))
    elif way == "semicolons.csv":
        text = rows(*mesh, Z, "X [mm],Y [mm],Z [um]").replace(".", "#").replace(",", ";").replace("#", ",")
        path.write_text(text)
    else:
        np.savez(path, height=Z, x=X, y=Y, unit="mm")
    return path


@pytest.mark.parametrize(
    "way", ["plain.npz", "bytes.npz", "descending.npz", "classic.nc", "transposed.nc", "jitter.csv", "semicolons.csv"]
)
def test_one_map_in_every_way_of_writing(tmp_path: Path, way: str) -> None:
    found = heights_on(GRID, Topography(file=write(tmp_path, way).name), "punch.topography", tmp_path)
    np.testing.assert_allclose(found.reshape(31, 21), Z[5:36, 5:26], rtol=0, atol=3e-9 if "jitter" in way else 1e-15)


@pytest.mark.parametrize("share", [0.01, 0.4])
def test_fill_values_are_holes(tmp_path: Path, share: float) -> None:
    """-9999 and spikes are rejected by default, with their number; filled by their neighbours; or kept."""
    spoiled = Z.copy()
    holes = RNG.random(Z.shape) < share
    spoiled[holes] = -9999
    spoiled[20, 15], holes[20, 15] = 1.0, True
    np.savez(tmp_path / "map.npz", height=spoiled, x=X, y=Y, unit="mm")
    with pytest.raises(CaseError, match=rf"punch.topography.file: .* {holes.sum()} holes, {holes.sum()} of them"):
        heights_on(GRID, Topography(file="map.npz"), "punch.topography", tmp_path)
    found = heights_on(GRID, Topography(file="map.npz", holes="fill"), "punch.topography", tmp_path)
    np.testing.assert_allclose(found.reshape(31, 21), Z[5:36, 5:26], rtol=0, atol=1.5e-6 if share < 0.1 else 1e-5)
    kept = heights_on(GRID, Topography(file="map.npz", holes="keep"), "punch.topography", tmp_path)
    assert kept.min() == pytest.approx(-9999)


def test_holes_get_the_harmonic_function(tmp_path: Path) -> None:
    """A bilinear map is harmonic: its holes come back exactly."""
    z = 1e-3 * (X[:, None] + 2 * Y + 3 * X[:, None] * Y)
    spoiled = z.copy()
    spoiled[10:20, 10:15] = np.nan
    np.savez(tmp_path / "map.npz", height=spoiled, x=X, y=Y, unit="mm")
    np.testing.assert_allclose(read_heights(tmp_path / "map.npz").filled().heights, z, rtol=0, atol=1e-15)


@pytest.mark.parametrize(("degree", "key"), [(1, "plane"), (3, 3)])
def test_a_polynomial_is_levelled(tmp_path: Path, degree: int, key: int | str) -> None:
    """What is left does not depend on it; the coefficients have their units."""
    u, v = X[:, None] - X.mean(), Y - Y.mean()
    added = 2e-3 * u - 1e-3 * v + (0.01 * u**2 * v + 0.02 * v**2 if degree > 1 else 0.0)
    found = []
    for name, z in (("a", Z), ("b", Z + added)):
        np.savez(tmp_path / f"{name}.npz", height=z, x=X, y=Y, unit="mm")
        wanted = Topography(file=f"{name}.npz", level=key)
        found.append(heights_on(GRID, wanted, "punch.topography", tmp_path))
    np.testing.assert_allclose(found[1], found[0], rtol=0, atol=1e-15)
    np.savez(tmp_path / "c.npz", height=1.0 + 2e-3 * u - 1e-3 * v, x=X, y=Y, unit="mm")
    assert read_heights(tmp_path / "c.npz").polynomial(1) == pytest.approx([1, 2e-3, -1e-3])
    assert read_heights(tmp_path / "c.npz").numbers()["tilt_mrad"] == pytest.approx([2, -1])


def test_scattered_points_take_little_memory() -> None:
    """40,000 points of no raster become one of as many points, exact on a plane."""
    x, y = RNG.random((2, 40_000))
    places, found, notes = raster([x, y], 3 * x - y)
    assert found.size < 50_000
    inner = (slice(2, -2),) * 2
    np.testing.assert_allclose(found[inner], (3 * places[0][:, None] - places[1])[inner], atol=1e-12)
    assert "40,000 scattered points" in notes[0]


def test_spoiled_maps_never_end_in_a_traceback(tmp_path: Path) -> None:
    choose = random.Random(11)
    for way in ("plain.npz", "classic.nc", "transposed.nc", "semicolons.csv"):
        content = write(tmp_path, way).read_bytes()
        path = tmp_path / f"bad.{way.partition('.')[2]}"
        for k in range(15):
            spoiled = bytearray(content[: choose.randrange(len(content))] if k % 2 else content)
            for _ in range(5 * (len(spoiled) > 0)):
                spoiled[choose.randrange(len(spoiled))] = choose.randrange(256)
            path.write_bytes(bytes(spoiled))
            with suppress(CaseError):
                read_heights(path)


class Instrument:
    """What SurfaceTopography gives of a file: heights with holes at the middles of cells, or at uneven places."""

    def __init__(self, *, uniform: bool, unit: str | None) -> None:
        self.is_uniform, self.unit, self.physical_sizes = uniform, unit, (4.0, 2.0)
        self.grid = np.ma.masked_equal([[1.0, 2.0], [-1.0, 4.0]], -1.0)

    def topography(self) -> Instrument:
        return self

    def heights(self) -> np.ndarray:
        return self.grid if self.is_uniform else self.grid.data[0]

    def positions(self) -> np.ndarray:
        return np.array([0.0, 7.0])


def test_files_of_instruments(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By SurfaceTopography: units, holes and uneven places are kept; its errors and a missing unit are ours."""
    path = tmp_path / "map.sur"
    monkeypatch.setitem(sys.modules, "SurfaceTopography", None)
    with pytest.raises(CaseError, match=r"map\.sur .*pip install SurfaceTopography"):
        read_heights(path)

    def opened(uniform: bool, unit: str | None = "um") -> Heights:
        stub = SimpleNamespace(open_topography=lambda _: Instrument(uniform=uniform, unit=unit))
        monkeypatch.setitem(sys.modules, "SurfaceTopography", stub)
        return read_heights(path)

    found = opened(True)
    np.testing.assert_allclose(found.heights, [[1e-3, 2e-3], [np.nan, 4e-3]], rtol=1e-14)
    np.testing.assert_allclose(np.concatenate(found.places), [1e-3, 3e-3, 0.5e-3, 1.5e-3], rtol=1e-14)
    np.testing.assert_allclose(opened(False).places[0], [0.0, 7e-3], rtol=1e-14)
    with pytest.raises(CaseError, match=r"no unit.*\.csv"):
        opened(True, None)
    monkeypatch.setitem(sys.modules, "SurfaceTopography", SimpleNamespace(open_topography=float))
    with pytest.raises(CaseError, match=r"ValueError.*\.csv"):
        read_heights(path)
