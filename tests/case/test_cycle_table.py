"""Cycles as tables of places and loads: read, turned into the punch's frame, and refused by row and column."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fenwear import CaseError, load_case
from fenwear.case import Cycle

TURNS = {
    "columns": ["time (s)", "angle_y (deg)", "force_z (kN)"],
    "rows": [[0, 0, -1], [0.5, 30, -2], [1, 0, -1]],
    "load": {"on": "punch_top"},
}


def cycle(**changes: Any) -> Cycle:
    return Cycle.model_validate({"kind": "cycle", **TURNS, **changes})


def test_units_and_frames() -> None:
    """Degrees, kilonewtons and percent are read; what stands in space turns back in the frame of a punch that turns."""
    course = cycle().course
    np.testing.assert_allclose(course.turn[1] @ [0, 0, 1], [0.5, 0, np.sqrt(0.75)], atol=1e-15)
    np.testing.assert_allclose(course.force, [[0, 0, -1e3], [0, 0, -2e3], [0, 0, -1e3]])
    columns = ["percent", "punch_angle_y (deg)", "force_z (N)"]
    rows = [[0, 0, -1], [50, -30, -2], [100, 0, -1]]
    moving = cycle(columns=columns, rows=rows, period="2 s").course
    np.testing.assert_allclose(moving.turn, course.turn, atol=1e-15)  # the strip as the punch sees it
    np.testing.assert_allclose(moving.force[1], [-1, 0, -2 * np.sqrt(0.75)], atol=1e-15)
    assert moving.duration == 2
    held = cycle(columns=columns, rows=rows, period="2 s", load={"on": "punch_top", "frame": "punch"}).course
    np.testing.assert_allclose(held.force[1], [0, 0, -2])


def test_order_of_angles() -> None:
    """Capital letters are about axes that turn along, in their order; small ones about those of space."""
    columns = ["time (s)", "angle_x (rad)", "angle_z (rad)"]
    rows = [[0, 0, 0], [1, np.pi / 2, np.pi / 2], [2, 0, 0]]
    course = Cycle(kind="cycle", columns=columns, rows=rows, order="XZ").course  # type: ignore[arg-type]
    np.testing.assert_allclose(course.turn[1] @ [1, 0, 0], [0, 0, 1], atol=1e-15)
    course = Cycle(kind="cycle", columns=columns, rows=rows, order="xz").course  # type: ignore[arg-type]
    np.testing.assert_allclose(course.turn[1] @ [1, 0, 0], [0, 1, 0], atol=1e-15)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"rows": [[0, 0, -1], [0.5, 30, -2], [0.4, 0, -1]]}, "row 3 of rows: time goes back or stands still"),
        ({"columns": ["time (s)", "angel_y (deg)", "force_z (kN)"]}, "did you mean 'angle_y'"),
        ({"columns": ["time (s)", "angle_y (mm)", "force_z (kN)"]}, "column 'angle_y': unit: "),
        ({"columns": ["time (s)", "angle_y", "force_z (kN)"]}, "column 'angle_y': has no unit"),
        ({"columns": ["angle_y (deg)", "time (s)", "force_z (kN)"]}, "expected one of time and percent"),
        ({"rows": [[0, 0, -1], [0.5, 30], [1, 0, -1]]}, "row 2 of rows: expected 3 values, got 2"),
        ({"rows": [[0, 0, -1], [0.5, 200, -2], [1, 0, -1]]}, "row 2 of rows: angle_y changes by 200 degrees"),
        ({"rows": [[0, 0, -1], [0.5, 30, -2], [1, 10, -1]]}, "ends where it begins"),
        ({"load": None}, "load: expected together with columns"),
        ({"period": "1 s"}, "period: expected with the column percent"),
        ({"order": "xz"}, "order: expected all axes of the angles"),
    ],
)
def test_bad_tables(changes: dict[str, Any], told: str) -> None:
    with pytest.raises(ValueError, match="Value error") as caught:
        cycle(**changes)
    assert told in str(caught.value)


def test_file(tmp_path: Path) -> None:
    """A CSV file beside the case is read, resolved into the case, and its rows are named by their lines."""
    (tmp_path / "gait.csv").write_text("time (ms),shift_x (mm),force_z (N)\n0,0,-10\n500,2,-20\n1000,0,-10\n")
    motion = 'motion={kind="cycle", file="gait.csv", load={on="punch_top"}}'
    text = 'base = "example1"\nunset = ["punch.loads"]\n'
    (tmp_path / "case.toml").write_text(text)
    case = load_case(tmp_path / "case.toml", [motion])
    assert isinstance(case.motion, Cycle)
    assert case.motion.course.duration == 1
    assert [load.mean().force for load in case.loads_of("punch")] == [(0.0, -15.0)]
    (tmp_path / "again.toml").write_text(case.to_toml())
    assert load_case(tmp_path / "again.toml") == case
    for line, told in (
        ("1500,0,-10", "row 5: time goes back"),
        ("x,0,-10", "row 5, column 'time': expected a finite number"),
    ):
        (tmp_path / "gait.csv").write_text(
            f"time (ms),shift_x (mm),force_z (N)\n0,0,-10\n500,2,-2\n2000,1,-1\n{line}\n"
        )
        with pytest.raises(CaseError, match=told):
            load_case(tmp_path / "case.toml", [motion])


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        (["motion.columns=['time (s)', 'angle_x (deg)']"], "motion.columns: expected no column angle_x"),
        (["motion.columns=['time (s)', 'shift_y (mm)']", "contact.law=coulomb"], "no column shift_y in a plane model"),
        (["contact.law=coulomb", "stick.force=5"], "stick.force: expected none in a cycle, whose forces are columns"),
        (["motion.rows=[[0, 1], [1, 1]]"], "motion.columns: the strip"),
        (["program={steps=[{distance=5}]}"], "distance: expected cycles or time"),
    ],
)
def test_what_does_not_go_with_it(settings: list[str], told: str) -> None:
    motion = "motion={kind='cycle', columns=['time (s)', 'shift_x (mm)'], rows=[[0, 0], [1, 2], [2, 0]]}"
    with pytest.raises(CaseError) as caught:
        load_case("example1", [motion, *settings])
    assert told in str(caught.value)
