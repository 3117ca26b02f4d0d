"""netCDF-4 straight in HDF5: dimensions are scales, and variables hang on to them.

h5netcdf opens what it is asked about anew at every question, and asks all variables for the size of a dimension that
grows: to lay out the forty of a small run took a third of it. What is written here is what h5netcdf writes: see
"NetCDF-4 Format Specification" in Unidata's NetCDF User's Guide, appendix C.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import h5py
import numpy as np
from numpy.typing import DTypeLike, NDArray

if TYPE_CHECKING:
    import xarray

# What netCDF-4 keeps for itself in the attributes of a file and of its variables.
INNER = {"CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST", "_NCProperties", "_Netcdf4Coordinates", "_Netcdf4Dimid"}
NO_VARIABLE = b"This is a netCDF dimension but not a netCDF variable"


def load(path: Path) -> xarray.Dataset:
    """Return all variables of a netCDF-4 file without groups, in memory.

    It is what xarray.load_dataset returns.

    Raises:
        OSError: it is no such file, or cannot be read.
        ValueError: it is HDF5, but not netCDF-4.
    """
    import xarray  # with pandas a third of a second, which who writes alone spares himself

    with h5py.File(path, "r") as file:
        variables = {
            name: (_dimensions(name, data), data[()], _attributes(data))
            for name, data in file.items()
            if isinstance(data, h5py.Dataset) and not bytes(data.attrs.get("NAME", b"")).startswith(NO_VARIABLE)
        }
        return xarray.decode_cf(xarray.Dataset(variables, attrs=_attributes(file)))


def _dimensions(name: str, data: Any) -> tuple[str, ...]:
    if data.is_scale and "DIMENSION_LIST" not in data.attrs:
        return (name,)
    if not all(len(data.dims[axis]) for axis in range(data.ndim)):
        raise ValueError(f"{name} has no named dimensions")
    return tuple(data.dims[axis][0].name.rpartition("/")[2] for axis in range(data.ndim))


def _attributes(owner: Any) -> dict[str, Any]:
    found = {name: value for name, value in owner.attrs.items() if name not in INNER}
    return {n: v[0] if isinstance(v, np.ndarray) and v.shape == (1,) else v for n, v in found.items()}


def write(path: Path, dataset: xarray.Dataset) -> None:
    """Write variables of numbers as a new file, in place of an older one."""
    with Netcdf(path, {str(name): size for name, size in dataset.sizes.items()}) as file:
        file.attributes.update(dataset.attrs)
        for name, one in dataset.variables.items():
            file.add(str(name), [str(d) for d in one.dims], one.attrs, one.values)


class Netcdf:
    """A new netCDF-4 file without groups; a context that closes it."""

    def __init__(self, path: Path, sizes: Mapping[str, int | None]) -> None:
        """Make the file, in place of an older one.

        Args:
            path: Of the file.
            sizes: Of the dimensions by their names; None of one that grows, and is empty.
        """
        self._file = h5py.File(path, "w", track_order=True)
        self._sizes = dict(sizes)
        self._ids = {name: np.int32(k) for k, name in enumerate(sizes)}
        self._scales: dict[str, h5py.Dataset] = {}
        self.attributes = self._file.attrs
        self._hanging: list[tuple[h5py.Dataset, Sequence[str]]] = []

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Hang the variables on to the dimensions, and close the file."""
        with self._file:
            if error is None:
                self._finish()

    def add(
        self,
        name: str,
        dimensions: Sequence[str],
        attributes: Mapping[str, Any],
        values: NDArray[Any] | None = None,
        *,
        kind: DTypeLike = None,
        chunks: tuple[int, ...] | None = None,
    ) -> None:
        """Add a variable.

        Args:
            name: Its name; that of a dimension has its coordinates.
            dimensions: Names of its dimensions.
            attributes: Its units and so on.
            values: All of them, or None of a variable that grows.
            kind: Of its values, where there are none yet.
            chunks: That its storage grows by.
        """
        shape = tuple(self._sizes[d] or 0 for d in dimensions)
        most = tuple(self._sizes[d] for d in dimensions)
        data = self._file.create_dataset(
            name,
            shape,
            dtype=kind,
            data=values,
            chunks=chunks,
            maxshape=most if None in most else None,
            track_order=True,
        )
        for key, value in attributes.items():
            data.attrs[key] = value
        if name in self._sizes:
            self._scales[name] = data
        else:
            self._hanging.append((data, dimensions))

    def _finish(self) -> None:
        for name, size in self._sizes.items():
            if name in self._scales:
                told: bytes = name.encode()
            else:
                self._scales[name] = self._file.create_dataset(
                    name, (size or 0,), dtype=">f4", maxshape=(None,) if size is None else None, track_order=True
                )
                told = NO_VARIABLE + b".%10d" % (size or 1)
            self._scales[name].make_scale(told)
            self._scales[name].attrs["_Netcdf4Dimid"] = self._ids[name]
        for data, dimensions in self._hanging:
            for axis, d in enumerate(dimensions):
                data.dims[axis].attach_scale(self._scales[d])
            if dimensions:
                data.attrs["_Netcdf4Dimid"] = self._ids[dimensions[0]]
            if len(dimensions) > 1:
                data.attrs["_Netcdf4Coordinates"] = np.array([self._ids[d] for d in dimensions], "int32")
        parts = f"version=2,h5py={h5py.__version__},hdf5={h5py.version.hdf5_version}"
        self.attributes["_NCProperties"] = np.array(parts, h5py.string_dtype("ascii", len(parts)))
