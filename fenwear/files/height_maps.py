"""Height maps as instruments write them: rasters, scattered points, with holes, fill values and tilt.

Holes are points without a number, those of a mask, and those that lie far beyond all others, as fill values (-9999) and
spikes do. They are counted, and filled on request by a harmonic function, that is by the mean of their neighbours.
"""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations_with_replacement
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fenwear.common.arrays import Array, Mask
from fenwear.common.errors import CaseError, InputError
from fenwear.common.table_files import TableError, known_units, read_table

NAMES = ("height", "heights", "z", "h")
COLUMNS = {"x": "mm", "y": "mm", "height": "mm", "z": "mm"}
INSTRUMENTS = (
    ".sur", ".plu", ".al3d", ".opd", ".xyz", ".sdf", ".vk4", ".vk6", ".x3p", ".ibw", ".mi", ".nms", ".plux",
    ".bcr", ".datx", ".gwy", ".lext", ".mnt", ".opdx", ".os3d", ".spm", ".zmg",
)  # fmt: skip
FAR, REPEATED = (
    20.0,
    3,
)  # times what 98 % of the others span: how far off a fill value is, and how often it stands there
SPIKE = 50.0  # times what the middle half of the heights spans: how far off a spike is
MOST_HOLES = 0.5  # of a map
JITTER = 1e-3  # of the mean spacing of scattered points: places that are as close are one


@dataclass(frozen=True)
class Heights:
    """Heights at the points of a rectangular raster.

    Attributes:
        name: Of the file.
        places: Rising coordinates along each axis, mm.
        heights: (m,) or (m, n), mm; no numbers where holes are.
        far: Where heights are fill values or spikes.
        notes: Descriptions of changes.
    """

    name: str
    places: tuple[Array, ...]
    heights: Array
    far: Mask
    notes: tuple[str, ...] = ()

    @property
    def holes(self) -> int:
        """Number of points without a height."""
        return int(np.count_nonzero(~np.isfinite(self.heights) | self.far))

    def numbers(self) -> dict[str, Any]:
        """Return size, spacing, roughness and tilt."""
        level = replace(self, heights=np.where(self.far, np.nan, self.heights))
        flat = level.levelled(1).heights
        tilt = [float(slope) for slope in level.polynomial(1)[1:]]
        return {
            "points": list(self.heights.shape), "length_mm": [float(np.ptp(x)) for x in self.places],
            "spacing_mm": [float(np.median(np.diff(x))) for x in self.places], "holes": self.holes,
            "far": int(self.far.sum()), "range_mm": float(np.nanmax(level.heights) - np.nanmin(level.heights)),
            "Sq_mm": float(np.sqrt(np.nanmean(flat**2))), "tilt_mrad": [1e3 * slope for slope in tilt],
            "notes": list(self.notes),
        }  # fmt: skip

    def text(self) -> str:
        """Return `numbers` in lines."""
        numbers = self.numbers()
        size = " x ".join(map(str, numbers["points"]))
        length = " x ".join(f"{side:.4g}" for side in numbers["length_mm"])
        step = " x ".join(f"{1e3 * spacing:.4g}" for spacing in numbers["spacing_mm"])
        tilt = " and ".join(f"{angle:.3g}" for angle in numbers["tilt_mrad"])
        lines = [
            f"{self.name}: {size} heights, {length} mm, one every {step} µm",
            f"  range {1e3 * numbers['range_mm']:.4g} µm, Sq {1e3 * numbers['Sq_mm']:.4g} µm "
            f"over a plane of {tilt} mrad",
            f"  holes: {numbers['holes']}"
            + (f", of them {numbers['far']} far beyond the others" if numbers["far"] else ""),
        ]
        return "\n".join((*lines, *self.notes))

    def filled(self) -> Heights:
        """Return the map with its holes filled.

        Raises:
            ValueError: there are more holes than heights.
        """
        holes = ~np.isfinite(self.heights) | self.far
        if holes.mean() > MOST_HOLES:
            raise ValueError(f"{int(holes.sum())} of {holes.size} points are holes. Measure it again.")
        return replace(self, heights=_harmonic(np.where(holes, 0.0, self.heights), holes), far=np.zeros_like(holes))

    def polynomial(self, degree: int) -> Array:
        """Return the coefficients of a polynomial through the heights: 1, then each coordinate, then higher terms."""
        return self._fit(degree)[1]

    def levelled(self, degree: int) -> Heights:
        """Return the map over a polynomial of a degree that is fitted to it."""
        matrix, coefficients = self._fit(degree)
        return replace(self, heights=self.heights - (matrix @ coefficients).reshape(self.heights.shape))

    def _fit(self, degree: int) -> tuple[Array, Array]:
        """Return the terms of a polynomial at all points, and their coefficients in mm."""
        mesh = np.meshgrid(*self.places, indexing="ij")
        middles = [float(place.mean()) for place in self.places]
        scaled = [(axis.ravel() - middle) for axis, middle in zip(mesh, middles, strict=True)]
        sizes = [max(float(np.ptp(place)), 1e-300) / 2 for place in self.places]
        terms, units = [np.ones(self.heights.size)], [1.0]
        for power in range(1, degree + 1):
            for axes in combinations_with_replacement(range(len(mesh)), power):
                terms.append(np.prod([scaled[axis] / sizes[axis] for axis in axes], axis=0))
                units.append(float(np.prod([sizes[axis] for axis in axes])))
        matrix = np.column_stack(terms)
        good = np.isfinite(self.heights.ravel()) & ~self.far.ravel()
        coefficients = np.linalg.lstsq(matrix[good], self.heights.ravel()[good], rcond=None)[0]
        return matrix * np.array(units), coefficients / np.array(units)


BROKEN = (OSError, ValueError, KeyError, EOFError, IndexError, TypeError, AttributeError, RuntimeError, MemoryError,
          OverflowError, zipfile.BadZipFile, zlib.error)  # fmt: skip


def read_heights(path: Path) -> Heights:
    """Return the height map of a file.

    Raises:
        CaseError: it cannot be read; says what was expected, and what to do.
        StackError: a package is missing that reads it.
    """
    suffix = path.suffix.lower()
    if suffix not in MAPS:
        raise CaseError(InputError("", f"expected a file that ends with {', '.join(MAPS)}, got {path.name}"))
    try:
        with np.errstate(all="ignore"):  # what is not finite afterwards is a hole
            places, heights, notes = MAPS[suffix](path)
            return _checked(path, places, heights, notes)
    except BROKEN as error:
        text = str(error).partition("\n")[0][:300] or "it is empty or cut short"
        text = "it is empty or cut short" if isinstance(error, EOFError | zipfile.BadZipFile) else text
        raise CaseError(InputError("", f"{path.name} cannot be read: {text}")) from None


Raw = tuple[Sequence[Array], Array, list[str]]


def _checked(path: Path, places: Sequence[Array], heights: Array, notes: list[str]) -> Heights:
    """Return a map with rising coordinates, and with fill values and spikes marked."""
    places = [np.asarray(axis_places, dtype=np.float64) for axis_places in places]
    if (
        heights.shape != tuple(len(axis_places) for axis_places in places)
        or not heights.shape
        or min(heights.shape) < 2
    ):
        sizes = " by ".join(str(len(axis_places)) for axis_places in places)
        raise ValueError(f"expected heights {sizes} along x and y, got {' by '.join(map(str, heights.shape))}")
    for axis, name in zip(range(len(places)), "xy", strict=False):
        steps = np.diff(places[axis])
        if not np.isfinite(places[axis]).all():
            raise ValueError(f"{name} has places that are no numbers")
        if (steps < 0).all():
            places[axis], heights = places[axis][::-1], np.flip(heights, axis)
        elif not (steps > 0).all():
            raise ValueError(f"expected coordinates that rise, got {name} that stands still or goes back")
    heights = np.where(np.isfinite(heights), heights, np.nan)
    if not np.isfinite(heights).any():
        raise ValueError("has no height that is a number")
    return Heights(path.name, tuple(places), heights, _far(heights), tuple(notes))


def _far(heights: Array) -> Mask:
    """Return where heights are fill values, which repeat, or spikes: far beyond what all others span."""
    good = np.isfinite(heights)
    far: Mask = np.zeros(heights.shape, dtype=bool)
    for value in (np.nanmin(heights), np.nanmax(heights)):
        same = heights == value
        rest = heights[good & ~same]
        if np.count_nonzero(same) >= REPEATED and len(rest):
            low, middle, high = np.percentile(rest, [1, 50, 99])
            far |= same & (np.abs(value - middle) > FAR * (high - low)) & (high > low)
    low, middle, high = np.percentile(heights[good & ~far], [25, 50, 75])
    with np.errstate(invalid="ignore"):
        return far | ((np.abs(heights - middle) > SPIKE * (high - low)) & (high > low))


def _harmonic(heights: Array, holes: Mask) -> Array:
    """Return heights whose holes, zero now, have the mean of their neighbours."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import laplacian
    from scipy.sparse.linalg import spsolve

    number, size = np.arange(heights.size).reshape(heights.shape), heights.size
    along = [np.moveaxis(number, axis, 0) for axis in range(heights.ndim)]
    ends = np.concatenate([[lines[:-1].ravel(), lines[1:].ravel()] for lines in along], axis=1)
    joined = coo_array((np.ones(ends.shape[1]), ends), shape=(size, size)).tocsr()
    rows = laplacian(joined + joined.T).tocsr()[number[holes]]
    filled = heights.copy()
    filled[holes] = spsolve(rows[:, number[holes]].tocsc(), -(rows @ heights.ravel()))
    return filled


def _unit(text: object, of: str) -> float:
    """Return the length of a unit, mm.

    Raises:
        ValueError: it is none.
    """
    from fenwear.common.units import convert  # cases read tables

    unit = text.decode("utf-8", "replace") if isinstance(text, bytes) else str(text)
    try:
        return convert(f"1 {unit.strip() or 1}", "mm")  # none is an error
    except ValueError:
        raise ValueError(f"{of} is in {unit!r}; expected a unit of length such as um or mm") from None


def _named(names: Sequence[str], wanted: Sequence[str]) -> str | None:
    """Return the name that is one of those wanted, whatever its case."""
    return next((name for candidate in wanted for name in names if name.casefold() == candidate), None)


def _from_npz(path: Path) -> Raw:
    with np.load(path, allow_pickle=False) as data:
        names = list(data.keys())
        height, x, unit = (_named(names, accepted) for accepted in (NAMES, ("x",), ("unit", "units")))
        if height is None or x is None or unit is None:
            missing = ", ".join(name for name, there in (("height", height), ("x", x), ("unit", unit)) if there is None)
            raise ValueError(f"lacks {missing}: expected height (m, n), x (m,), y (n,) and a unit")
        z = np.array(data[height], dtype=np.float64)
        mask = _named(names, ("mask",))
        if mask is not None and data[mask].shape == z.shape:
            z[np.asarray(data[mask], dtype=bool)] = np.nan
        to_mm = _unit(data[unit][()].item() if data[unit].shape == () else data[unit], "the map")
        axes = [x, _named(names, ("y",))][: z.ndim]
        if None in axes:
            raise ValueError("lacks y: expected height (m, n), x (m,), y (n,) and a unit")
        return [np.asarray(data[str(name)], np.float64) * to_mm for name in axes], z * to_mm, []


def _from_nc(path: Path) -> Raw:
    import xarray

    engine = "scipy" if path.read_bytes()[:3] == b"CDF" else "h5netcdf"
    with xarray.open_dataset(path, engine=engine) as data:  # type: ignore[arg-type]
        name = _named([str(variable) for variable in data.data_vars], NAMES)
        if name is None:
            raise ValueError(f"has no variable height; it has {', '.join(map(str, data.variables)) or 'none'}")
        height = data[name].transpose(*(axis for axis in ("x", "y") if axis in data[name].dims), ...)
        parts: list[Array] = []
        for axis_name in (*map(str, height.dims), name):
            if axis_name not in data.variables:
                raise ValueError(f"has no variable {axis_name} with the places of the heights along it")
            attributes = data[axis_name].attrs
            unit = next((attributes[key] for key in ("units", "unit", "length_unit") if key in attributes), None)
            if unit is None:
                raise ValueError(f"{axis_name} has no attribute units")
            values = np.asarray(height if axis_name == name else data[axis_name], dtype=np.float64)
            parts.append(values * _unit(unit, axis_name))
        return parts[:-1], parts[-1], []


def _from_table(path: Path) -> Raw:
    try:
        table = read_table(path, COLUMNS, ("missing",))
        known_units(table.heads, COLUMNS)
        columns = {head.name: table.numbers(k, "mm") for k, head in enumerate(table.heads)}
    except TableError as error:
        raise ValueError(str(error)) from None
    columns = {"height" if name == "z" else name: values for name, values in columns.items()}
    if sorted(columns) not in (["height", "x"], ["height", "x", "y"]):
        raise ValueError("expected the columns x and height, or x, y and height")
    axes = [columns[name] for name in ("x", "y") if name in columns]
    return raster(axes, columns["height"])


def raster(axes: Sequence[Array], heights: Array) -> Raw:
    """Return scattered heights on a raster: their own, where they lie on one but for jitter, else by triangles.

    Args:
        axes: Coordinates of the points (n,), mm.
        heights: (n,), mm.

    Raises:
        ValueError: the points lie on a line, or are too few.
    """
    count = len(heights)
    if count < 2:
        raise ValueError("expected at least two rows of heights")
    sides = [max(float(np.ptp(axis)), 1e-300) for axis in axes]
    mean = float(np.prod(sides) / count) ** (1 / len(axes))
    places, numbers = zip(*(_clusters(axis, JITTER * mean) for axis in axes), strict=True)
    shape = tuple(map(len, places))
    if np.prod(shape) <= 4 * count:
        at = np.ravel_multi_index(numbers, shape)
        total = np.bincount(at, heights, minlength=int(np.prod(shape)))
        times = np.bincount(at, minlength=int(np.prod(shape)))
        with np.errstate(invalid="ignore"):
            mapped = (total / times).reshape(shape)
        twice = int((times > 1).sum())
        return list(places), mapped, [f"{twice} places have several heights: their mean counts"] if twice else []
    from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator
    from scipy.spatial import QhullError

    counts = [max(2, min(4 * count, 1 + round(side / mean))) for side in sides]
    grid = [np.linspace(axis.min(), axis.max(), n) for axis, n in zip(axes, counts, strict=True)]
    mesh = np.meshgrid(*grid, indexing="ij")
    points = np.column_stack(axes)
    try:
        scattered_heights = LinearNDInterpolator(points, heights)(*mesh)
    except QhullError:
        raise ValueError("the points lie on a line: expected a raster, or points over an area") from None
    outside = ~np.isfinite(scattered_heights)
    scattered_heights[outside] = NearestNDInterpolator(points, heights)(*(coordinate[outside] for coordinate in mesh))
    size = " x ".join(map(str, counts))
    return grid, scattered_heights, [f"{count:,} scattered points: interpolated onto a raster of {size}"]


def _clusters(values: Array, close: float) -> tuple[Array, NDArray[np.int64]]:
    """Return the places of values that are as close as one, ascending, and which of them each value has."""
    order = np.argsort(values)
    new = np.concatenate([[0], np.cumsum(np.diff(values[order]) > close)])
    places = np.bincount(new, values[order]) / np.bincount(new)
    number = np.empty(len(values), dtype=np.int64)
    number[order] = new
    return places, number


def _from_instrument(path: Path) -> Raw:
    """Return the map of an instrument's file by SurfaceTopography."""
    advice = "Export the map as .csv with columns x (mm), y (mm), height (um)"
    try:
        from SurfaceTopography import open_topography
    except ImportError:
        raise ValueError(f"{path.suffix} files need pip install SurfaceTopography. {advice}") from None
    try:
        topography = open_topography(str(path)).topography()
    except Exception as error:  # each of its readers has errors of its own
        reason = str(error).partition("\n")[0].rstrip(".")
        raise ValueError(f"SurfaceTopography fails ({type(error).__name__}: {reason}). {advice}") from None
    if not topography.unit:
        raise ValueError(f"has no unit of length. {advice}")
    unit = _unit(topography.unit, "the map")
    if not topography.is_uniform:
        return [np.asarray(topography.positions()) * unit], np.asarray(topography.heights()) * unit, []
    heights = topography.heights()  # masked where there are holes
    z = np.array(getattr(heights, "data", heights), dtype=np.float64)
    z[np.broadcast_to(np.asarray(getattr(heights, "mask", False)), z.shape)] = np.nan
    axes = [(np.arange(n) + 0.5) * size / n for n, size in zip(z.shape, topography.physical_sizes, strict=True)]
    return [axis * unit for axis in axes], z * unit, []


MAPS: Mapping[str, Callable[[Path], Raw]] = {
    ".npz": _from_npz, ".nc": _from_nc, ".csv": _from_table, **dict.fromkeys(INSTRUMENTS, _from_instrument)
}  # fmt: skip
