"""The key numbers of a run: at its end, and over all of it."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fenwear import Case, load_case, make_case
from fenwear.report.page import page
from fenwear.report.run_figures import program_figure
from fenwear.results.export import export
from fenwear.results.sheet import sheet_text
from fenwear.results.stored_history import load_history
from fenwear.studies.run import run_case

STEPS = [
    {"time": "0.5 s", "angular_speed": "20 rad/s"},
    {"time": "1 s", "angular_speed": ["20 rad/s", "0 rad/s"]},
    {"time": "3 s", "angular_speed": "0 rad/s"},
]


def braked(ring: str, count: int | None = None, **run: Any) -> Case:
    """Return a ring that is braked to rest and cools, warmest while it still turns."""
    tables = tomllib.loads(
        load_case(
            ring, ["heat.steps=2", "output.report=false", "output.uncertainty=false", "output.fields_at=[]"]
        ).to_toml()
    )
    tables["motion"] = {"kind": "rotation", "axis": tables["motion"]["axis"], "angular_speed": 20, "duration": 0.05}
    tables["program"] = {"steps": STEPS, "levels": 2}
    tables["heat"] |= {"initial": "20 degC", "ambient": "20 degC"}
    tables["run"] = {**run, **({} if count is None else {"half_cycles": count})}
    return make_case(tables)


def lines(text: str) -> dict[str, str]:
    return {" ".join(line.split()[:-1]): line.split()[-1] for line in text.splitlines() if line}


@pytest.mark.parametrize("integration", ["implicit", "jump"])
def test_of_a_stop(tmp_path: Path, integration: str) -> None:
    """A stop is cold at its end: the largest temperature is that of all half-cycles, those before a run went on, too.

    And the strip turns: its speed is in rad/s in the history, in what is exported and in the figure.
    """
    for name, count, resume in (("parts", 20, False), ("parts", None, True), ("whole", None, False)):
        case = braked("ring-on-ring-heat", count, integration=integration)
        summary, folder = run_case(case, name, tmp_path / name, lambda message: None, resume=resume, progress="none")
    hottest = load_history(folder).largest_temperature
    peak, end = float(hottest.max()), float(hottest[-1])
    assert int(hottest.half_cycle[np.argmax(hottest.data)]) < 20 < int(hottest.half_cycle[-1])
    assert end < peak - 1
    parts = json.loads((tmp_path / "parts" / "summary.json").read_text("utf-8"))
    for told in (parts, summary):
        assert told["largest_temperature_of_run_degC"] == pytest.approx(peak, rel=1e-9)
        assert told["largest_temperature_degC"] == pytest.approx(end, rel=1e-9)
        assert told["largest_temperature_of_run_half_cycle"] == int(hottest.half_cycle[np.argmax(hottest.data)])
    sheet = lines(sheet_text(summary))
    assert float(sheet["largest temperature over the run (°C)"]) == pytest.approx(peak, rel=1e-4)
    assert float(sheet["largest temperature at the end (°C)"]) == pytest.approx(end, rel=1e-4)

    history = load_history(tmp_path / "parts")
    assert summary["sliding"]["normal_force_N"] == pytest.approx(float(history["load"][-1]), rel=1e-9)  # at rest, too
    assert summary["sliding"]["friction_force_N"] == 0
    assert history.speed.attrs["units"] == "rad s-1"
    assert "angular" in history.speed.attrs["long_name"]
    assert history.speed.values[[0, -1]] == pytest.approx([20.0, 0.0])
    (course,) = (path for path in export(tmp_path / "parts") if path.name == "history.csv")
    assert "speed (rad s-1)" in course.read_text("utf-8").splitlines()[0].split(",")
    assert "mean speed (rad/s)" in [ax.get_ylabel() for ax in program_figure(history).axes]
    if integration == "implicit":
        shown = page(tmp_path / "parts")
        assert "largest temperature over the run" in shown
        assert "largest temperature at the end" in shown
        assert f"{peak:,.5g}" in shown


@pytest.mark.parametrize("integration", ["jump", "implicit"])
def test_loads_are_drawn_as_they_leap_and_rise(tmp_path: Path, integration: str) -> None:
    """Not as straight lines from one recorded half-cycle to another; a run that stops within a ramp ends there."""
    steps = "[{cycles=10}, {cycles=10, load_factor=2}, {cycles=20, load=['5 kN', '15 kN']}]"
    settings = ["geometry.degree=2", "geometry.parameters.elements_along_contact=8", f"program.steps={steps}",
                f"run={{integration='{integration}', half_cycles=60}}", "output.report=false",
                "output.uncertainty=false", "output.fields_at=[]"]  # fmt: skip
    run_case(load_case("example1", settings), "leaps", tmp_path / "out", lambda _: None, progress="none")
    (ax,) = program_figure(load_history(tmp_path / "out")).axes
    expected = [[0, 10], [10, 10], [10, 20], [20, 20], [20, 5], [30, 10]]  # cycles, kN
    half = 0.25 if integration == "implicit" else 0  # kN in half a half-cycle, whose middle counts
    np.testing.assert_allclose(ax.lines[0].get_xydata() / [1, 1e3], expected, atol=half)
