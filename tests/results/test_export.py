"""CSV of a run: what history.nc holds, to the last bit, whatever the model; and what cannot be exported."""

from __future__ import annotations

import csv
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray

from fenwear import CaseError, load_case
from fenwear.common.errors import OutputError
from fenwear.results.export import export
from fenwear.results.stored_history import by_cycles, load_history
from fenwear.studies.run import run_case

BARE = ("output.fields_at=[]", "output.report=false", "output.uncertainty=false")
SMALL = ("geometry.degree=1", "geometry.parameters.elements_along_contact=8", *BARE)
RUNS = {
    "example1-heat": (*SMALL, "run.half_cycles=6"),
    "fretting": (*BARE, "run.half_cycles=40"),
    "ring-on-ring": (*BARE, "run.half_cycles=3"),
    "fretting-partial-slip": (*SMALL[1:], "run.half_cycles=4"),
}
Table = dict[str, list[str]]


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Return folders(name): of a short run of a built-in case, computed once."""
    base = tmp_path_factory.mktemp("runs")

    def folder(name: str) -> Path:
        if not (base / name).exists():
            run_case(load_case(name, RUNS[name]), name, base / name, lambda message: None)
        return base / name

    return folder


def read(path: Path) -> Table:
    with path.open(newline="") as file:
        heading, *rows = csv.reader(file)
    assert len(set(heading)) == len(heading)
    return {name: [row[k] for row in rows] for k, name in enumerate(heading)}


def numbers(column: list[str]) -> Any:
    return np.array([float(cell) if cell else np.nan for cell in column])


def headed(history: xarray.Dataset, name: str, at: str = "") -> str:
    unit = history[name].attrs["units"]
    return f"{name}{at}" if unit == "1" else f"{name}{at} ({unit})"


@pytest.mark.parametrize("name", RUNS)
def test_course_is_the_history(folders: Callable[[str], Path], name: str, tmp_path: Path) -> None:
    """A line for each record, a column for each variable that has one value then, bit by bit."""
    paths = export(folders(name), tmp_path / "new" / "tables")
    assert all(path.is_file() for path in paths)
    found = read(tmp_path / "new" / "tables" / "history.csv")
    history = load_history(folders(name))
    series = ["half_cycle", *(v for v in history.data_vars if history[v].dims == ("half_cycle",))]
    assert list(found) == [headed(history, str(v)) for v in series]
    for variable in series:
        np.testing.assert_array_equal(numbers(found[headed(history, str(variable))]), history[variable].values)
    assert {"contact_width (mm)", "contact_area (mm2)"} & set(found)


@pytest.mark.parametrize("name", ["example1-heat", "fretting", "ring-on-ring"])
def test_profiles_are_the_history(folders: Callable[[str], Path], name: str, tmp_path: Path) -> None:
    """Places and every variable along a surface, of the chosen half-cycles alone, each once and in their order."""
    export(folders(name), tmp_path, "last, 1,001,last")
    history = load_history(folders(name))
    last = int(history.half_cycle[-1])
    for end in ("", "_strip"):
        path = tmp_path / f"profile_{'strip' if end else 'punch'}.csv"
        assert path.exists() == (f"wear{end}" in history)
        if not path.exists():
            continue
        found, over = read(path), history[f"wear{end}"].dims[1]
        for place in (v for v in history.variables if history[v].dims == (over,)):
            np.testing.assert_array_equal(numbers(found[headed(history, str(place))]), history[place].values)
        fields = [str(v) for v in history.data_vars if history[v].dims == ("half_cycle", over)]
        assert f"wear{end}" in fields
        assert end or {"pressure", "gap"} <= set(fields)
        assert ("temperature_strip" in fields) == (name == "example1-heat")
        for n in (1, last):
            for variable in fields:
                column = numbers(found[headed(history, variable, f" at half-cycle {n}")])
                np.testing.assert_array_equal(column, history[variable].sel(half_cycle=n).values)
        assert [h for h in found if h.startswith(f"wear{end} at")] == [
            f"wear{end} at half-cycle {n} (mm)" for n in (1, last)
        ]


def test_worn_surfaces_part(folders: Callable[[str], Path], tmp_path: Path) -> None:
    """Wear raises the lower surface of the punch and lowers the strip; what is missing is the worn area."""
    folder = folders("fretting")
    export(folder, tmp_path)
    history = load_history(folder)
    last = int(history.half_cycle[-1])
    for body, end, sign in (("punch", "", 1), ("strip", "_strip", -1)):
        found = read(tmp_path / f"profile_{body}.csv")
        worn = numbers(found[f"worn_height{end} at half-cycle {last} (mm)"]) - numbers(found[f"height{end} (mm)"])
        assert (sign * worn).max() > 0
        assert (sign * worn).min() >= 0
        area = history[f"weight{end}"].sel(half_cycle=last).values @ (sign * worn)
        assert area == pytest.approx(float(history[f"worn_area{end}"][-1]), rel=1e-3)


def test_loops_of_partial_slip(folders: Callable[[str], Path], tmp_path: Path) -> None:
    """Force and displacement of every time step; their closed loop holds the work of friction of the cycle."""
    folder = folders("fretting-partial-slip")
    export(folder, tmp_path, "last")
    found = read(tmp_path / "loops.csv")
    history = by_cycles(load_history(folder))
    force, way = (numbers(found[f"{v}"]) for v in ("tangential_force (N)", "displacement (mm)"))
    np.testing.assert_array_equal(force, history.tangential_force[-1].values)
    np.testing.assert_array_equal(way, history.displacement[-1].values)
    np.testing.assert_array_equal(numbers(found["cycle"]), float(history.cycle[-1]))
    assert "fraction" in found
    work = float((force * (np.roll(way, -1) - np.roll(way, 1)) / 2).sum())
    assert abs(work) == pytest.approx(float(history.friction_work_increment[-1]), rel=0.05)


def test_what_is_not_there(folders: Callable[[str], Path], tmp_path: Path) -> None:
    """Each wrong word has a message that names it, and nothing is written."""
    run = folders("example1-heat")
    for at, message in {
        "7": "half-cycle 7 was not kept, but 6 was, the nearest of 6 from 1 to 6",
        "2,0": "half-cycle 0 was not kept",
        "2,x": "expected numbers of kept half-cycles, first or last, with commas, got 'x'",
        "-1": "got '-1'",
        "1.5": "got '1.5'",
        " ,": "got ' ,'",
    }.items():
        with pytest.raises(CaseError, match=f"^--at: .*{message}"):
            export(run, tmp_path / "out", at)
    with pytest.raises(CaseError, match="no readable history of a run"):
        export(tmp_path / "nowhere", tmp_path / "out")
    with pytest.raises(CaseError, match="cycle 9 was not kept"):
        export(folders("fretting-partial-slip"), tmp_path / "out", "9")
    assert not (tmp_path / "out").exists()
    (tmp_path / "file").write_text("mine")
    with pytest.raises(OutputError, match="file cannot be written"):
        export(run, tmp_path / "file")
    assert (tmp_path / "file").read_text() == "mine"


def test_what_is_no_history(tmp_path: Path) -> None:
    """Another NetCDF file, and a run that has just begun."""
    begun = {name: ("half_cycle", np.zeros(0)) for name in ("half_cycle", "pressure", "wear")}
    for name, data, message in (
        ("other", xarray.Dataset({"y": ("t", [1.0])}), "it has other variables"),
        ("begun", xarray.Dataset(begun), "no half-cycle yet"),
    ):
        (tmp_path / name).mkdir()
        data.to_netcdf(tmp_path / name / "history.nc", engine="h5netcdf")
        with pytest.raises(CaseError, match=message):
            export(tmp_path / name)


def test_command(folders: Callable[[str], Path], fenwear: Callable[..., Any], tmp_path: Path) -> None:
    """On two ranks: the names of the files once on standard output; a wrong folder ends with status 2."""
    run = tmp_path / "run"
    shutil.copytree(folders("example1-heat"), run)
    done = fenwear("export", run, "--at", "2", ranks=2)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == [str(run / "export" / f"{name}.csv") for name in ("history", "profile_punch")]
    done = fenwear("export", tmp_path)
    assert done.returncode == 2
    assert "no readable history" in done.stderr
    assert "Traceback" not in done.stderr
