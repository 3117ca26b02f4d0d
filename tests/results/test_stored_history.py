"""Reading what a run has left: as xarray reads it, and words for what is none."""

from __future__ import annotations

import ctypes
from ctypes.util import find_library
from pathlib import Path

import h5netcdf
import h5py
import numpy as np
import pytest
import xarray

from fenwear import CaseError, load_case
from fenwear.results.hdf5 import load
from fenwear.results.history import HISTORY
from fenwear.results.stored_history import load_history
from fenwear.studies.run import run_case

SMALL = (
    "geometry.degree=2",
    "geometry.parameters.elements_along_contact=6",
    "output.report=false",
    "output.uncertainty=false",
    "run.half_cycles=4",
)


def same(path: Path) -> None:
    """Values, names, coordinates, attributes and all their types are those of xarray's own reader."""
    expected, found = xarray.load_dataset(path, engine="h5netcdf"), load(path)
    xarray.testing.assert_identical(found, expected)
    for name in expected.variables:
        assert found[name].dtype == expected[name].dtype
        assert {k: type(v) for k, v in found[name].attrs.items()} == {
            k: type(v) for k, v in expected[name].attrs.items()
        }
    assert list(found.sizes) == list(expected.sizes)


def as_netcdf_has_it(path: Path) -> dict[str, list[tuple[str, int]]]:
    """Return the dimensions and their sizes of each variable, as Unidata's own library reads a file."""
    library, file, count = ctypes.CDLL(find_library("netcdf")), ctypes.c_int(), ctypes.c_int()
    name, size = ctypes.create_string_buffer(257), ctypes.c_size_t()
    found: dict[str, list[tuple[str, int]]] = {}
    assert library.nc_open(str(path).encode(), 0, ctypes.byref(file)) == 0
    assert library.nc_inq_nvars(file, ctypes.byref(count)) == 0
    for variable in range(count.value):
        ids, rank = (ctypes.c_int * 9)(), ctypes.c_int()
        assert library.nc_inq_varname(file, variable, name) == 0
        own = found[name.value.decode()] = []
        assert library.nc_inq_varndims(file, variable, ctypes.byref(rank)) == 0
        assert library.nc_inq_vardimid(file, variable, ids) == 0
        for dimension in ids[: rank.value]:
            assert library.nc_inq_dim(file, dimension, name, ctypes.byref(size)) == 0
            own.append((name.value.decode(), size.value))
    assert library.nc_close(file) == 0
    return found


def test_a_run_is_read_as_by_xarray(tmp_path: Path) -> None:
    """History and fields of bodies with heat."""
    folder = run_case(
        load_case("example1-heat", [*SMALL, "run.half_cycles=4"]), "run", tmp_path / "run", lambda message: None
    )[1]
    for path in (folder / HISTORY, *(folder / "fields").glob("*.nc")):
        same(path)
        if find_library("netcdf"):
            expected = {str(name): list(one.sizes.items()) for name, one in load(path).variables.items()}
            assert as_netcdf_has_it(path) == expected
    assert load_history(folder).sizes["half_cycle"] == 4


def test_any_dimensions_and_attributes(tmp_path: Path) -> None:
    """Growing dimensions with and without a variable, two of one length, numbers and words, nothing in it yet."""
    path = tmp_path / "any.nc"
    with h5netcdf.File(path, "w") as file:
        file.dimensions = {"row": None, "node": 3, "side": 3}
        for name, dimensions in (
            ("row", ("row",)),
            ("both", ("node", "side")),
            ("grown", ("row", "side")),
            ("one", ()),
        ):
            variable = file.create_variable(name, dimensions, float)
            variable.attrs.update(units="mm", several=np.array([1.0, 2.0]), single=np.array([3]), number=4)
        file.attrs["title"] = "é"
    same(path)
    with h5netcdf.File(path, "a") as file:
        file.resize_dimension("row", 2)
        file["grown"][...] = np.arange(6.0).reshape(2, 3)
        file["row"][...] = [5.0, 7.0]
    same(path)


def test_what_is_no_history_is_told(tmp_path: Path) -> None:
    """No file, no HDF5, HDF5 of another program: a message with its name, and no traceback."""
    with pytest.raises(CaseError, match="no such file"):
        load_history(tmp_path)
    (tmp_path / HISTORY).write_text("half_cycle 1 2 3")
    with pytest.raises(CaseError, match="no readable history"):
        load_history(tmp_path)
    with h5py.File(tmp_path / HISTORY, "w") as file:
        file["pressure"] = np.ones((2, 3))
    with pytest.raises(CaseError, match="no named dimensions"):
        load_history(tmp_path)
