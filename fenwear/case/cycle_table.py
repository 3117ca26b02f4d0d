"""Cycles as tables: the place of both bodies and the load on the pressed one at times of a cycle, with units.

Between two rows a body moves by a constant screw, the shortest that takes it from one place to the other, and the load
changes linearly. A place is a turn about a point and a shift after it,

    x -> R (x - c) + c + s,

the turn given by a rotation vector (rotation_x, rotation_y, rotation_z) or by angles about the axes in a named order.
Where the punch moves, too, what counts is the strip's place as the punch sees it, R = R_p^T R_s, s = R_p^T (s_s - s_p).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from fenwear.arrays import Array
from fenwear.case.csv_table import headings, read_csv
from fenwear.case.units import convert
from fenwear.errors import CaseError, InputError

AXES = ("x", "y", "z")
TIMES = {"time": "s", "percent": ""}
PLACES = {f"{name}_{axis}": unit for name, unit in (("shift", "mm"), ("rotation", "rad"), ("angle", "rad"))
          for axis in AXES}  # fmt: skip
LOADS = {f"{name}_{axis}": unit for name, unit in (("force", "N"), ("moment", "N*mm")) for axis in AXES}
COLUMNS = {**TIMES, **PLACES, **{f"punch_{name}": unit for name, unit in PLACES.items()}, **LOADS}
HALF_TURN = np.pi * (1 - 1e-9)  # rad: a longer way between two rows is another one back
CLOSED = 1e-9  # of the largest shift and of 1 rad: how far a cycle may end from where it begins


@dataclass(frozen=True)
class CycleCourse:
    """A cycle of k rows.

    Attributes:
        fraction: Of the cycle, from 0 to 1 (k,).
        duration: Of the cycle, s.
        turn: R, the strip's as the punch sees it (k, 3, 3).
        shift: s, the same (k, 3), mm.
        force: On the punch, in its frame (k, 3), N; None where the table has none.
        moment: The same (k, 3), N mm.
    """

    fraction: Array
    duration: float
    turn: Array
    shift: Array
    force: Array | None
    moment: Array | None

    @property
    def rests(self) -> bool:
        """Whether the strip stays in its place."""
        return bool((self.shift == self.shift[0]).all() and (self.turn == self.turn[0]).all())


def with_cycle(data: Mapping[str, Any], folder: Path | None) -> dict[str, Any]:
    """Return the tables of a case with the files of its cycle, and of those of a program, read into columns and rows.

    Raises:
        CaseError: the file cannot be read, or there are rows besides; names column and row.
    """
    found = dict(data)
    if "motion" in data:
        found["motion"] = _with_file(data["motion"], "motion", folder)
    program = data.get("program")
    if isinstance(program, Mapping) and isinstance(program.get("steps"), list | tuple):
        steps = [
            {**step, "motion": _with_file(step["motion"], f"program.steps.{number}.motion", folder)}
            if isinstance(step, Mapping) and "motion" in step
            else step
            for number, step in enumerate(program["steps"])
        ]
        found["program"] = {**program, "steps": steps}
    return found


def _with_file(motion: Any, at: str, folder: Path | None) -> Any:
    """Return a motion with the file of its cycle read into columns and rows; any other as it is."""
    if not isinstance(motion, Mapping) or "file" not in motion or motion.get("kind") != "cycle":
        return motion
    key = f"{at}.file"
    if "rows" in motion or "columns" in motion or not isinstance(motion["file"], str):
        raise CaseError(InputError(key, "expected the name of a CSV file, and neither columns nor rows beside it"))
    table = read_csv(Path(motion["file"]) if folder is None else folder / motion["file"], key, COLUMNS, least=2)
    columns = [f"{name} ({COLUMNS[name]})" if COLUMNS[name] else name for name in table.names]
    for number, message in row_problems(table.names, table.rows):
        raise table.wrong(f"row {table.lines[number]}: {message}" if number >= 0 else message)
    rest = {name: value for name, value in motion.items() if name != "file"}
    return {**rest, "columns": columns, "rows": table.rows}


def row_problems(names: Sequence[str], rows: Sequence[Sequence[float]]) -> Iterator[tuple[int, str]]:
    """Yield what is wrong with a table in the units of its known columns: the number of a row and why; -1 for none."""
    if names[0] not in TIMES or any(name in TIMES for name in names[1:]):
        yield -1, "expected one of time and percent (of the cycle) as the first column"
        return
    if len(set(names)) < len(names):
        yield -1, f"expected no column twice, got {next(name for name in names if names.count(name) > 1)}"
        return
    for body in ("", "punch_"):
        if any(f"{body}rotation_{a}" in names for a in AXES) and any(f"{body}angle_{a}" in names for a in AXES):
            yield -1, f"expected either {body}rotation_ (a rotation vector) or {body}angle_ (angles in an order)"
    for k, row in enumerate(rows):
        if len(row) != len(names):
            yield k, f"expected {len(names)} values, got {len(row)}"
            return
    time = np.array([row[0] for row in rows])
    for k in np.flatnonzero(np.diff(time) <= 0):
        yield int(k) + 1, f"{names[0]} goes back or stands still, from {time[k]:g} to {time[k + 1]:g}"
    if names[0] == "percent" and (time[0], time[-1]) != (0.0, 100.0):
        yield (
            (0 if time[0] else len(rows) - 1),
            f"percent: expected 0 first and 100 last, got {time[0]:g} and {time[-1]:g}",
        )
    for j, name in enumerate(names):
        if "angle_" in name:
            turned = np.abs(np.diff([row[j] for row in rows]))
            for k in np.flatnonzero(turned >= HALF_TURN):
                yield (
                    int(k) + 1,
                    (
                        f"{name} goes on by {np.degrees(turned[k]):.4g} degrees from the row before: expected less "
                        "than 180, by more rows"
                    ),
                )


def table_of(columns: Sequence[str], rows: Sequence[Sequence[float]]) -> dict[str, Array]:
    """Return the columns by their names (k,), in internal units.

    Raises:
        ValueError: a column or unit is not known, or a row does not fit; "rows.N: ..." where it is of a row.
    """
    names, units = headings(columns, COLUMNS)
    scales = [convert(f"1 {unit}" if unit else 1.0, COLUMNS[name]) for name, unit in zip(names, units, strict=True)]
    scaled = [[value * scale for value, scale in zip(row, scales, strict=False)] for row in rows]
    if any(len(row) != len(names) for row in rows):
        scaled = [list(row) for row in rows]
    for number, message in row_problems(names, scaled):
        raise ValueError(f"row {number + 1} of rows: {message}" if number >= 0 else f"columns: {message}")
    return {name: np.array([row[k] for row in scaled]) for k, name in enumerate(names)}


@lru_cache(maxsize=100)
def course_of(
    columns: tuple[str, ...], rows: tuple[tuple[float, ...], ...], order: str, period: float | None, *, in_space: bool
) -> CycleCourse:
    """Return the course of a cycle.

    Args:
        columns: Headings with units.
        rows: Numbers in these units.
        order: Of angles, as of scipy: "xyz" about the axes of space, "XYZ" about those that turn along.
        period: Duration where the first column is the percent of the cycle, s.
        in_space: Whether force and moment stand in space; else they turn with the punch.

    Raises:
        ValueError: the table does not fit together; says where.
    """
    table = table_of(columns, rows)
    name = "time" if "time" in table else "percent"
    if (period is None) == (name == "percent"):
        raise ValueError("period: expected with the column percent, and only then")
    time = table[name]
    strip, punch = (_turns(table, body, order) for body in ("", "punch_"))
    shifts = [_vectors(table, f"{body}shift", len(time)) for body in ("", "punch_")]
    back = np.transpose(punch, (0, 2, 1))
    turn, shift = back @ strip, np.einsum("kij,kj->ki", back, shifts[0] - shifts[1])
    _check_closed(turn, shift)
    loads: list[Array | None] = []
    for kind in ("force", "moment"):
        has = any(f"{kind}_{axis}" in table for axis in AXES)
        vectors = _vectors(table, kind, len(time))
        loads.append((np.einsum("kij,kj->ki", back, vectors) if in_space else vectors) if has else None)
    duration = float(period or time[-1] - time[0])
    return CycleCourse((time - time[0]) / (time[-1] - time[0]), duration, turn, shift, loads[0], loads[1])


def _vectors(table: Mapping[str, Array], name: str, rows: int) -> Array:
    return np.array([table.get(f"{name}_{axis}", np.zeros(rows)) for axis in AXES]).T


def _turns(table: Mapping[str, Array], body: str, order: str) -> Array:
    """Return the rotation matrices of a body (k, 3, 3)."""
    from scipy.spatial.transform import Rotation  # heavy: most cases have no cycle

    rows = len(next(iter(table.values())))
    angles = {axis: table.get(f"{body}angle_{axis}", np.zeros(rows)) for axis in AXES}
    if any(f"{body}angle_{axis}" in table for axis in AXES):
        return np.asarray(Rotation.from_euler(order, np.array([angles[axis.lower()] for axis in order]).T).as_matrix())
    return np.asarray(Rotation.from_rotvec(_vectors(table, f"{body}rotation", rows)).as_matrix())


def _check_closed(turn: Array, shift: Array) -> None:
    """Raise where a cycle does not end where it begins."""
    far = np.abs(shift - shift[0]).max()
    if np.abs(shift[-1] - shift[0]).max() > CLOSED * max(far, 1e-300) or np.abs(turn[-1] - turn[0]).max() > CLOSED:
        raise ValueError(
            "rows: expected a cycle that ends where it begins: the last row has another place of the strip"
        )
