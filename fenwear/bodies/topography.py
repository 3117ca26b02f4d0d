"""Rough surfaces on a contact grid: measured height maps, and made ones.

A self-affine surface has the isotropic power spectrum C(q) ~ q^-2(1 + H), in the plane q^-(1 + 2 H), between the wave
numbers of its longest and its shortest wave length, and random phases (B. N. J. Persson et al., J. Phys. Condens.
Matter 17, 2005); its root mean square is set exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fenwear.arrays import Array
from fenwear.bodies.grid import RegularGrid
from fenwear.case import Topography
from fenwear.case.csv_table import read_csv
from fenwear.case.units import convert
from fenwear.errors import CaseError, InputError

COARSE = 4.0  # spacings that the shortest wave length needs
USUAL = 8.0  # spacings of the shortest wave length by default
SLACK = 1e-6  # of the map's extent: how far a grid may reach beyond it
COLUMNS = {"x": "mm", "y": "mm", "height": "mm"}


@dataclass(frozen=True)
class HeightMap:
    """Heights at the points of a rectangular raster.

    Attributes:
        places: Ascending coordinates along each axis, mm.
        heights: (m,) or (m, n), mm.
    """

    places: tuple[Array, ...]
    heights: Array


def heights_on(grid: RegularGrid, wanted: Topography, key: str, folder: Path | None) -> Array:
    """Return the heights of a topography at the nodes of a grid (n,), mm.

    Args:
        grid: The contact.
        wanted: What it is.
        key: Of the case, for messages.
        folder: Where its file lies.

    Raises:
        CaseError: a file cannot be read, has holes or does not reach over the grid, or the grid is too coarse.
    """
    if wanted.file is not None:
        path = Path(wanted.file) if folder is None else folder / wanted.file
        found = _interpolated(read_map(path, f"{key}.file"), grid, f"{key}.file")
    elif wanted.wavelength is not None:
        found = _wave(wanted, grid, key)
    else:
        found = _self_affine(wanted, grid, key)
    return wanted.height_factor * found


def _wave(wanted: Topography, grid: RegularGrid, key: str) -> Array:
    assert wanted.wavelength is not None
    if len(wanted.wavelength) > len(grid.counts):
        raise CaseError(InputError(f"{key}.wavelength", f"expected {len(grid.counts)} length(s)"))
    found = np.full(len(grid.flat), float(wanted.amplitude or 0.0))
    for axis, length in enumerate(wanted.wavelength):
        _fine_enough(grid, axis, length, f"{key}.wavelength")
        found *= np.cos(2 * np.pi * (grid.flat[:, axis] - grid.middle[axis]) / length)
    return found


def _fine_enough(grid: RegularGrid, axis: int, length: float, key: str) -> None:
    if length < COARSE * grid.spacing[axis]:
        nodes = int(np.ceil(COARSE * float(np.max(grid.sides)) / length)) + 1
        message = (
            f"{length:.4g} mm is {length / grid.spacing[axis]:.2g} spacings of the contact grid, where a wave takes "
            f"{COARSE:g} at least: set grid.nodes = {nodes} or more"
        )
        raise CaseError(InputError(key, message))


def _self_affine(wanted: Topography, grid: RegularGrid, key: str) -> Array:
    """Return a surface of random phases; of the strip's longer grid it is as long as that."""
    shortest = wanted.shortest or USUAL * float(np.max(grid.spacing))
    for axis in range(len(grid.counts)):
        _fine_enough(grid, axis, shortest, f"{key}.shortest")
    assert wanted.longest is not None
    if wanted.longest <= shortest:
        raise CaseError(InputError(f"{key}.longest", f"expected more than the shortest wave length, {shortest:.4g} mm"))
    waves = [2 * np.pi * np.fft.fftfreq(k, step) for k, step in zip(grid.counts, grid.spacing, strict=True)]
    q = np.sqrt(sum(one**2 for one in np.meshgrid(*waves, indexing="ij")))
    has = (q >= 2 * np.pi / wanted.longest * (1 - 1e-9)) & (q <= 2 * np.pi / shortest)
    if not has.any():
        raise CaseError(InputError(f"{key}.longest", "no wave of these lengths fits on the contact grid"))
    d = len(grid.counts)
    spectrum = np.where(has, np.where(has, q, 1.0) ** (-(wanted.hurst + d / 2)), 0.0)
    noise = np.fft.fftn(np.random.default_rng(wanted.seed).standard_normal(grid.counts))
    found = np.fft.ifftn(spectrum * noise / np.maximum(np.abs(noise), 1e-300)).real.ravel()
    return np.asarray(found * (wanted.rms or 0.0) / np.sqrt(np.mean(found**2)))


def _interpolated(measured: HeightMap, grid: RegularGrid, key: str) -> Array:
    """Return a map at the nodes of a grid, linear between its points; its middle is that of the grid."""
    from scipy.interpolate import RegularGridInterpolator  # which takes long to load

    if len(measured.places) != len(grid.counts):
        raise CaseError(InputError(key, f"has {len(measured.places)} coordinate(s), the contact {len(grid.counts)}"))
    for axis, own in enumerate(measured.places):
        spare = np.ptp(own) * (1 + SLACK) - grid.sides[axis]
        if spare < 0:
            message = f"is {np.ptp(own):.4g} mm long, the contact grid {grid.sides[axis]:.4g}: expected a map over it"
            raise CaseError(InputError(key, message))
        step = float(np.median(np.diff(own)))
        if grid.spacing[axis] > COARSE / 2 * step:
            nodes = int(float(np.max(grid.sides)) / step) + 1
            message = (
                f"has a height every {step:.4g} mm, the contact grid a node every {grid.spacing[axis]:.4g}, which "
                f"leaves its roughness out: set grid.nodes = {nodes}, or average the map"
            )
            raise CaseError(InputError(key, message))
    middles = np.array([(own[0] + own[-1]) / 2 for own in measured.places])
    at = grid.flat - grid.middle + middles
    low, high = (np.array([own[end] for own in measured.places]) for end in (0, -1))
    read = RegularGridInterpolator(measured.places, measured.heights)
    return np.asarray(read(np.clip(at, low, high)))


def read_map(path: Path, key: str) -> HeightMap:
    """Return the height map of a file: .npz without pickles, .nc or .csv, each number with its unit.

    Raises:
        CaseError: it cannot be read, is no full raster, or has holes.
    """
    readers = {".npz": _from_npz, ".nc": _from_nc, ".csv": _from_csv}
    if path.suffix.lower() not in readers:
        raise CaseError(InputError(key, f"expected a file that ends with {', '.join(readers)}, got {path.name}"))
    try:
        places, heights = readers[path.suffix.lower()](path, key)
    except (OSError, ValueError, KeyError) as error:
        if isinstance(error, CaseError):
            raise
        raise CaseError(InputError(key, f"{path.name} cannot be read: {error}")) from None
    if heights.shape != tuple(len(one) for one in places) or min(heights.shape, default=0) < 2:
        sizes = " by ".join(str(len(one)) for one in places)
        raise CaseError(InputError(key, f"{path.name}: expected heights {sizes}, got {heights.shape}"))
    if not np.isfinite(heights).all() or not all(np.isfinite(one).all() for one in places):
        holes = int((~np.isfinite(heights)).sum())
        raise CaseError(InputError(key, f"{path.name} has {holes} holes (not a number): expected them filled"))
    if any((np.diff(one) <= 0).any() for one in places):
        raise CaseError(InputError(key, f"{path.name}: expected coordinates that rise"))
    return HeightMap(places, heights)


def _from_npz(path: Path, key: str) -> tuple[tuple[Array, ...], Array]:
    with np.load(path, allow_pickle=False) as data:
        missing = [name for name in ("height", "x", "unit") if name not in data]
        if missing:
            message = f"{path.name} lacks {', '.join(missing)}: expected height (m, n), x (m,), y (n,) and a unit"
            raise CaseError(InputError(key, message))
        to_mm = convert(f"1 {data['unit']}", "mm")
        names = ["x", "y"][: data["height"].ndim]
        places = tuple(np.asarray(data[name], dtype=np.float64) * to_mm for name in names)
        return places, np.asarray(data["height"], dtype=np.float64) * to_mm


def _from_nc(path: Path, key: str) -> tuple[tuple[Array, ...], Array]:
    import xarray

    with xarray.open_dataset(path, engine="h5netcdf") as data:
        if "height" not in data:
            raise CaseError(InputError(key, f"{path.name} has no variable height"))
        height = data["height"].transpose(*(name for name in ("x", "y") if name in data["height"].dims))
        parts = []
        for name in (*height.dims, "height"):
            unit = data[name].attrs.get("units")
            if unit is None:
                raise CaseError(InputError(key, f"{path.name}: {name} has no attribute units"))
            parts.append(np.asarray(data[name] if name != "height" else height) * convert(f"1 {unit}", "mm"))
        return tuple(parts[:-1]), parts[-1]


def _from_csv(path: Path, key: str) -> tuple[tuple[Array, ...], Array]:
    table = read_csv(path, key, COLUMNS, least=2)
    if sorted(table.names) not in (["height", "x"], ["height", "x", "y"]):
        raise table.wrong("expected the columns x and height, or x, y and height")
    rows = np.array(table.rows)
    names = [name for name in ("x", "y") if name in table.names]
    columns = [rows[:, table.names.index(name)] for name in names]
    places, numbers = zip(*(np.unique(one, return_inverse=True) for one in columns), strict=True)
    shape = tuple(len(one) for one in places)
    heights = np.full(shape, np.nan)
    heights[numbers] = rows[:, table.names.index("height")]
    return tuple(places), heights
