"""The time series of fields: what pyvista reads of it is what the half-cycles' own files hold."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray

from fenwear import load_case
from fenwear.results.fields import SERIES
from fenwear.results.hdf5 import TRIANGLE, Step, append
from fenwear.studies.run import run_case


@pytest.mark.parametrize("name", ["fretting", "example1-heat"])
def test_all_times_in_one_file(tmp_path: Path, name: str) -> None:
    """Steps, points, cells and fields of both bodies; after a restart from an earlier state none stands twice."""
    vtk = pytest.importorskip("vtkmodules.vtkIOHDF")
    pyvista = pytest.importorskip("pyvista")
    settings = (
        "geometry.degree=2",
        "geometry.parameters.elements_along_contact=4",
        "output.report=false",
        "output.uncertainty=false",
    )
    at = "output.fields_at=[2, 4, 6]"
    run_case(load_case(name, [*settings, at, "run.half_cycles=4"]), "run", tmp_path / "run", lambda _: None)
    run_case(
        load_case(name, [*settings, at, "run.half_cycles=6"]), "run", tmp_path / "run", lambda _: None, resume=True
    )
    folder = tmp_path / "run" / "fields"
    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(folder / SERIES))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == 3
    for step, number in enumerate((2, 4, 6)):
        with xarray.open_dataset(folder / f"half_cycle_{number:06d}.nc", engine="h5netcdf") as opened:
            data = opened.load()
        reader.SetStep(step)
        reader.Update()
        assert reader.GetTimeValue() == pytest.approx(data.attrs["time"])
        grid = pyvista.wrap(reader.GetOutputDataObject(0))
        if isinstance(grid, pyvista.PartitionedDataSet):
            grid = grid.get(0) if hasattr(grid, "get") else grid[0]
        count = len(data.punch_x)
        assert grid.n_points == count + len(data.strip_x)
        assert grid.n_cells == len(data.punch_cells) + len(data.strip_cells)
        np.testing.assert_allclose(grid.points[:count, 0], data.punch_x, rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(grid["stress (MPa)"][:count, 5], data.punch_stress_xz, rtol=1e-12)
        np.testing.assert_allclose(grid["von Mises stress (MPa)"][count:], data.strip_von_mises, rtol=1e-12)
        on_punch = grid["contact pressure (MPa)"][:count]
        np.testing.assert_allclose(np.sort(on_punch)[-3:], np.sort(data.punch_contact_pressure)[-3:], rtol=1e-12)
        # Away from the edges, whose nodes on the strip share their force with what lies outside.
        x, p = np.abs(grid.points[:, 0]), grid["contact pressure (MPa)"]
        inner = x < 0.7 * x[p > 0].max()
        assert (p * inner)[count:].max() == pytest.approx((p * inner)[:count].max(), rel=0.05)
        assert grid["worn depth (mm)"][:count].max() == pytest.approx(float(data.punch_contact_depth.max()), rel=1e-12)
        assert ("temperature (K)" in grid.array_names) == (name == "example1-heat")
        areas = grid.compute_cell_sizes()["Area"]
        assert areas.min() > 0


def test_stress_of_the_contact(tmp_path: Path) -> None:
    """Under the punch sigma_zz is the pressure with its sign turned and sigma_xz the friction; sigma_yy is zero."""
    settings = (
        "geometry.degree=4",
        "geometry.parameters.elements_along_contact=16",
        "output.report=false",
        "output.uncertainty=false",
    )
    run_case(load_case("example1", [*settings, "run.half_cycles=3"]), "run", tmp_path / "run", lambda _: None)
    with xarray.open_dataset(tmp_path / "run" / "fields" / "half_cycle_000003.nc", engine="h5netcdf") as opened:
        data = opened.load()
    p, x = data.punch_contact_pressure.values, data.punch_contact_x.values
    for body in ("punch", "strip"):
        z = data[f"{body}_z"].values
        nodes = np.flatnonzero((np.abs(z - 100) < 1e-9) & (np.abs(data[f"{body}_x"].values) < 20))
        expected = np.interp(data[f"{body}_x"].values[nodes], x, p)
        np.testing.assert_allclose(data[f"{body}_stress_zz"].values[nodes], -expected, atol=0.02 * p.mean())
        np.testing.assert_allclose(data[f"{body}_stress_xz"].values[nodes], -0.25 * expected, atol=0.02 * p.mean())
        assert not data[f"{body}_stress_yy"].any()
    for variable in data.variables.values():
        assert variable.attrs.get("units") or "degree" in variable.attrs


def test_what_a_killed_run_left_half_written_is_passed_over(tmp_path: Path) -> None:
    """With or without a whole series beside it."""
    path = tmp_path / SERIES
    step = Step(0.5, np.eye(3), [(TRIANGLE, np.array([[0, 1, 2]]))], {"body": np.ones(3)})
    for count in (1, 2):
        path.with_name(f"{SERIES}.part").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(range(200)))
        append(path, replace(step, time=float(count)))
        with h5py.File(path) as file:
            assert file["VTKHDF/Steps/Values"][:].tolist() == list(range(1, count + 1))
