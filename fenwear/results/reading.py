"""Open what a run has left."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import xarray

from fenwear.errors import CaseError, InputError
from fenwear.results.history import HISTORY

# What netCDF-4 keeps for itself in the attributes of a file and of its variables.
INNER = {"CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST", "_NCProperties", "_Netcdf4Coordinates", "_Netcdf4Dimid"}
OLDER = (
    "of an older fenwear, in which worn_area and worn_volume were those of a half-cycle and not from the start; "
    "expected the results of this version: run the case anew"
)
NO_VARIABLE = b"This is a netCDF dimension but not a netCDF variable"


def load_history(directory: Path) -> xarray.Dataset:
    """Return all of history.nc of a run, in memory.

    Raises:
        CaseError: there is none, it cannot be read, or it is of a version whose names meant something else.
    """
    path = directory / HISTORY
    try:
        history = load(path)
    except (OSError, ValueError) as error:
        raise _unreadable(path, error) from None
    if is_older(history.variables):
        raise CaseError(InputError(str(path), OLDER))
    return history


def is_older(names: Iterable[Hashable]) -> bool:
    """Return whether the names of a history are those of a version in which worn volumes were of one half-cycle."""
    worn = [str(name) for name in names if str(name).startswith(("worn_area", "worn_volume"))]
    return bool(worn) and not any("_increment" in name for name in worn)


def _unreadable(path: Path, error: Exception) -> CaseError:
    reason = "there is no such file" if isinstance(error, FileNotFoundError) else str(error)
    return CaseError(InputError(str(path), f"no readable history of a run: {reason}"))


def load(path: Path) -> xarray.Dataset:
    """Return all variables of a netCDF-4 file without groups, in memory.

    As xarray.load_dataset does, but straight from HDF5: h5netcdf asks every variable for the size of a dimension
    that grows, at each turn, which takes a second for the 40 variables of a run with a few half-cycles.

    Raises:
        OSError: it is no such file, or cannot be read.
        ValueError: it is HDF5, but not netCDF-4.
    """
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
