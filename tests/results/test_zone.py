"""Nodes across a contact, and the largest pressure with what stands beside it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from fenwear import load_case
from fenwear.report.page import page
from fenwear.results.sheet import sheet_text
from fenwear.results.stored_history import load_history
from fenwear.results.summary import net_of
from fenwear.studies.run import run_case
from fenwear.system import place_case


def test_nodes_across_a_line_contact() -> None:
    """A count, on an uneven mesh, too; of two pieces that which carries more; an end of the surface is not free."""
    net = net_of(place_case(load_case("rounded-punch", ["geometry.degree=2"])))
    count = len(net.coordinates)
    assert len(set(np.diff(net.coordinates[:, 0]).round(6))) > 3
    pressure = np.zeros(count)
    pressure[5:14], pressure[20:40] = 10.0, 0.1
    zone = net.zone(pressure)
    assert zone is not None
    assert (zone.nodes[0], zone.free[0]) == (pytest.approx(9), 2)
    pressure[20:] = 50.0
    zone = net.zone(pressure)
    assert zone is not None
    assert (zone.nodes[0], zone.free[0]) == (pytest.approx(count - 20), 1)
    assert net.zone(np.zeros(count)) is None


def test_ends_are_those_of_its_own_contact() -> None:
    """A pad in full contact ends nowhere within its surface, whatever other pads are there; one that tips does."""
    net = net_of(place_case(load_case("drum-brake", [])))
    right = net.surface.nodes_of("right")
    for own in (right, ~right):
        zone = net.zone(np.where(own, 1.0, 0.0))
        assert zone is not None
        assert zone.free[0] == 0
        along = net.coordinates[:, 0]
        zone = net.zone(np.where(own & (along > np.median(along[own])), 1.0, 0.0))
        assert zone is not None
        assert zone.free[0] == 1


@pytest.mark.parametrize("degree", [1, 2])
def test_nodes_across_a_point_contact(degree: int) -> None:
    """An ellipse of nodes on an even grid is as many wide as it covers lines of the grid, along and across."""
    even = ("geometry.parameters.core=0", "geometry.parameters.across=16", "geometry.order=1")
    net = net_of(place_case(load_case("ball-on-flat", [*even, f"geometry.degree={degree}", "motion.positions=2"])))
    step, (x, y) = 0.4 / 16 / degree, net.surface.x[:, :2].T
    zone = net.zone(np.where((x / (5.5 * step)) ** 2 + (y / (3.5 * step)) ** 2 < 1, 1.0, 0.0))
    assert zone is not None
    assert zone.nodes == pytest.approx([11, 7], rel=1e-3)  # along x, across it y
    assert zone.free.tolist() == [2, 2]


def test_a_spike_is_told_as_one() -> None:
    """One node of 188 MPa among 75: where it is, and what is beside it; in a plane its two neighbours."""
    net = net_of(place_case(load_case("fretting", ["motion.positions=3"])))
    pressure = np.where(np.abs(net.coordinates[:, 0]) < 0.1, 75.0, 0.0)
    pressure[70] = 188.0
    told = net.numbers(pressure)
    assert told["pressure_beside_largest_MPa"] == pytest.approx(75.0)
    assert told["largest_pressure_at_x_mm"] == pytest.approx(net.coordinates[70, 0])
    assert told["nodes_across_contact"] == np.count_nonzero(pressure)
    ball = net_of(
        place_case(load_case("ball-on-flat", ["geometry.degree=1", "geometry.order=1", "motion.positions=2"]))
    )
    node = len(ball.coordinates) // 2
    assert len(ball.beside(node)) == 8
    told = ball.numbers(np.where(np.arange(len(ball.coordinates)) == node, 5.0, 2.0))
    assert told["pressure_beside_largest_MPa"] == pytest.approx(2.0)


def test_largest_pressure_of_a_run(tmp_path: Path) -> None:
    """Place, neighbours and nodes across in the summary, on the sheet and on the page are those of the history."""
    case = load_case("fretting", ["run.half_cycles=4", "run.integration=implicit", "motion.positions=2",
                                  "output.fields_at=[]", "output.report=false",
                                  "output.uncertainty=false"])  # fmt: skip
    summary, folder = run_case(case, "run", tmp_path / "run", lambda message: None, progress="none")
    last = load_history(folder).isel(half_cycle=-1)
    told = json.loads((folder / "summary.json").read_text("utf-8"))["leftward" if last.direction < 0 else "rightward"]
    node = int(np.argmax(last.pressure.data))
    assert told["largest_pressure_at_x_mm"] == pytest.approx(float(last.x[node]), abs=1e-9)
    weights = last.weight.data[[node - 1, node + 1]]
    beside = weights @ last.pressure.data[[node - 1, node + 1]] / weights.sum()
    assert told["pressure_beside_largest_MPa"] == pytest.approx(beside, rel=1e-12)
    assert told["nodes_across_contact"] == np.count_nonzero(last.pressure)
    lines = [" ".join(line.split()) for line in sheet_text(summary).splitlines()]
    assert "rightward leftward" in lines
    for label in (
        "largest pressure (MPa)",
        "at x (mm)",
        "mean of the nodes beside it (MPa)",
        "nodes across the contact",
    ):
        assert any(line.startswith(label) for line in lines[lines.index("rightward leftward") :]), label
    shown = page(folder)
    for label in (
        "at x",
        "mean of the nodes beside it",
        "nodes across the contact",
    ):
        assert label in shown
