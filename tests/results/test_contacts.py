"""Sheets of named contacts: two pads on a plate, each under a load of its own."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray
from mpi4py import MPI

from fenwear import CaseError, assemble, load_case, make_case
from fenwear.report.drawn_surface import surface_of
from fenwear.results.summary import contact_text
from fenwear.studies.run import run_case
from tests.bodies.test_connected_parts import tables

LOADS = {"left": -300.0, "right": -900.0}


def two_pads(folder: Path, **parameters: float) -> dict[str, Any]:
    found = tables(folder, apart=1.0, **parameters)
    groups = [f"punch_{name}" for name in LOADS]
    found["punch"]["supports"] = [{"on": group, "fix": ["x"]} for group in groups]
    found["punch"]["loads"] = [{"on": g, "force": [0.0, f]} for g, f in zip(groups, LOADS.values(), strict=True)]
    found["punch"]["no_turning_about"] = ["y"]
    found["run"] = {"half_cycles": 40}
    found["output"] = {}
    return found


def ran(found: dict[str, Any], folder: Path) -> dict[str, Any]:
    folder = MPI.COMM_WORLD.bcast(folder)
    summary, directory = run_case(make_case(found), "pads", folder, lambda _message: None)
    MPI.COMM_WORLD.barrier()
    assert json.loads((directory / "summary.json").read_text())["contacts"] == summary["contacts"]
    return summary


@pytest.mark.mpi
def test_each_contact_has_its_own(tmp_path: Path) -> None:
    """Each carries its load, and wears and rubs in proportion to it; together they are the whole."""
    summary = ran(two_pads(tmp_path, named=1.0), tmp_path / "run")
    contacts = summary["contacts"]
    assert list(contacts) == ["left", "right"]
    for name, load in LOADS.items():
        assert contacts[name]["pressure_integral_N"] == pytest.approx(-load, rel=1e-9)
        assert contacts[name]["contact_area_mm2"] <= 20 * (1 + 1e-12)
    total = {key: sum(one[key] for one in contacts.values()) for key in ("pressure_integral_N", "friction_work_mJ")}
    assert total["pressure_integral_N"] == pytest.approx(summary["sliding"]["pressure_integral_N"], rel=1e-9)
    assert total["friction_work_mJ"] == pytest.approx(summary["sliding"]["friction_work_mJ"], rel=1e-9)
    left, right = (contacts[name] for name in LOADS)
    assert right["friction_work_mJ"] == pytest.approx(3 * left["friction_work_mJ"], rel=1e-9)
    volumes = [one["punch"]["worn_volume_mm3"] for one in (left, right)]
    assert sum(volumes) == pytest.approx(summary["punch"]["worn_volume_mm3"], rel=1e-12)
    assert volumes[1] == pytest.approx(3 * volumes[0], rel=1e-9)  # k F s
    assert right["punch"]["largest_depth_mm"] == summary["punch"]["largest_depth_mm"]
    assert [one["punch"]["scar_width_mm"] for one in (left, right)] == pytest.approx([2, 2])
    assert left["punch"]["largest_depth_at_x_mm"] <= 2 < 4 <= right["punch"]["largest_depth_at_x_mm"]
    with xarray.open_dataset(tmp_path / "run" / "history.nc", engine="h5netcdf") as history:
        np.testing.assert_array_equal(history.contact, history.x > 3)
        np.testing.assert_array_equal(history.part, history.x > 3)
        assert history.contact.attrs["flag_meanings"] == "left right"
    text = contact_text(summary).splitlines()
    assert text[0].split() == ["left", "right"]
    (integral,) = (line for line in text if line.startswith("integral of the pressure"))
    assert integral.split()[-2:] == ["300", "900"]
    for name, load in LOADS.items():
        assert [contacts[name][f"force_{axis}_N"] for axis in "xz"] == pytest.approx([0, -load], abs=1e-6)


@pytest.mark.mpi
def test_names_change_nothing_else(tmp_path: Path) -> None:
    """Motions have the contacts' names, as lambda_F_left; pressures are those of a contact without names."""
    named, bare = (assemble(make_case(two_pads(tmp_path, named=k))) for k in (1.0, 0.0))
    assert named.rigid.mode_names == ("lambda_F_left", "lambda_F_right")
    assert bare.rigid.mode_names == ("lambda_F_1", "lambda_F_2")
    np.testing.assert_array_equal(named.pair.punch.nodes_of("left"), named.pair.x < 3)
    pressures = [one.contact((1,)).solve(one.pair.initial_gap).pressure for one in (named, bare)]
    np.testing.assert_allclose(*pressures, rtol=1e-12)


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("meet", "reason"),
    [
        (1.0, r"pads\.geo: punch_contact_side .* share 2 curve elements.*geometry\.groups"),
        (2.0, "pads.geo: has punch_contact and punch_contact_left, punch_contact_right, punch_contact_side"),
    ],
)
def test_contacts_that_overlap(meet: float, reason: str, tmp_path: Path) -> None:
    """They are refused by their names."""
    with pytest.raises(CaseError, match=reason):
        assemble(make_case(two_pads(tmp_path, named=1.0, meet=meet)))


COARSE = {"across": 2, "along": 3, "around": 12, "hub_elements": 1, "pad_layers": 1, "disc_layers": 2}


@pytest.mark.slow
@pytest.mark.parametrize("back", [50, 40])
def test_both_faces_of_a_disc(back: int, tmp_path: Path) -> None:
    """Equal pads have the same pressures, node by node; a shorter one has the same load, and wears deeper."""
    settings = [f"geometry.parameters.{name}={value}" for name, value in COARSE.items()]
    shown = ["output.uncertainty=false", f"output.report={str(back == 40).lower()}"]
    case = load_case(
        "disc-brake-two-pads", [*settings, f"geometry.parameters.back_angle={back}", "run.half_cycles=2000", *shown]
    )
    summary, directory = run_case(case, "disc", tmp_path / "run", lambda _message: None, progress="none")
    front, rear = summary["contacts"]["front"], summary["contacts"]["back"]
    for one in (front, rear):
        assert one["pressure_integral_N"] == pytest.approx(5000, rel=1e-9)
        assert one["punch"]["worn_volume_mm3"] == pytest.approx(1e-5 * one["friction_work_mJ"] / 0.35 / 1e3, rel=1e-9)
    with xarray.open_dataset(directory / "history.nc", engine="h5netcdf") as history:
        names = np.array(history.contact.attrs["flag_meanings"].split())[history.contact.values]
        surface, last = surface_of(history), history.isel(half_cycle=-1)
        faces = [np.flatnonzero(names == name) for name in ("front", "back")]
        if back == 50:
            faces = [face[np.lexsort(np.round([history.y[face], history.x[face]], 6))] for face in faces]
            pressures = [last.pressure.values[face] for face in faces]
            np.testing.assert_allclose(*pressures, rtol=1e-7)
        else:
            assert rear["punch"]["largest_depth_mm"] > 1.1 * front["punch"]["largest_depth_mm"]
        assert surface.overlaps
        spans = [(surface.map[face].min(axis=0), surface.map[face].max(axis=0)) for face in faces]
        assert max(low[0] for low, _ in spans) > min(high[0] for _, high in spans)  # beside each other
    if back == 40:
        text = (directory / "figures" / "captions.txt").read_text()
        assert text.count("Each contact through the middle of its own wear") == 2
        assert (directory / "report.html").is_file()
