"""The table of the motion: how the strip slides or turns under the punch.

A cycle is a table: the place of both bodies and the load on the pressed one at times of it, with units. Between two
rows a body moves by a constant screw, the shortest that takes it from one place to the other, and the load changes
linearly. A place is a turn about a point and a shift after it,

    x -> R (x - c) + c + s,

the turn given by a rotation vector (rotation_x, rotation_y, rotation_z) or by angles about the axes in a named order.
Where the punch moves, too, what counts is the strip's place as the punch sees it, R = R_p^T R_s, s = R_p^T (s_s - s_p).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from fenwear.case.body_tables import CourseLoad
from fenwear.case.table_parts import Angle, AngularFrequency, Check, Length, Number, Part, Point, Speed, Time, Vector
from fenwear.common.arrays import Array
from fenwear.common.csv_table import headings, read_csv
from fenwear.common.units import convert

AXES = ("x", "y", "z")
TIMES = {"time": "s", "percent": ""}
PLACES = {f"{name}_{axis}": unit for name, unit in (("shift", "mm"), ("rotation", "rad"), ("angle", "rad"))
          for axis in AXES}  # fmt: skip
LOADS = {f"{name}_{axis}": unit for name, unit in (("force", "N"), ("moment", "N*mm")) for axis in AXES}
COLUMNS = {**TIMES, **PLACES, **{f"punch_{name}": unit for name, unit in PLACES.items()}, **LOADS}
MOST_POSITIONS = 200  # of the strip in a half-cycle: each has a factor of its own
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
        force: On the punch, in its frame (k, 3), N.
        moment: The same (k, 3), N mm.
        loads: Whether the table has a force or a moment.
    """

    fraction: Array
    duration: float
    turn: Array
    shift: Array
    force: Array
    moment: Array
    loads: bool

    @property
    def rests(self) -> bool:
        """Whether the strip stays in its place."""
        return bool((self.shift == self.shift[0]).all() and (self.turn == self.turn[0]).all())


def read_cycle(path: Path, key: str) -> dict[str, Any]:
    """Return the table of a cycle in a CSV file: its columns with units, and rows.

    Raises:
        CaseError: it cannot be read; names column and row.
    """
    table = read_csv(path, key, COLUMNS, least=2)
    for number, message in row_problems(table.names, table.rows):
        raise table.wrong(f"row {table.lines[number]}: {message}" if number >= 0 else message)
    columns = [f"{name} ({COLUMNS[name]})" if COLUMNS[name] else name for name in table.names]
    return {"columns": columns, "rows": table.rows}


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
                        f"{name} changes by {np.degrees(turned[k]):.4g} degrees from the row before: expected less "
                        "than 180. Add rows between them"
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
    loads = [_vectors(table, kind, len(time)) for kind in ("force", "moment")]
    if in_space:
        loads = [np.einsum("kij,kj->ki", back, vectors) for vectors in loads]
    duration, loaded = float(period or time[-1] - time[0]), not LOADS.keys().isdisjoint(table)
    return CycleCourse((time - time[0]) / (time[-1] - time[0]), duration, turn, shift, loads[0], loads[1], loaded)


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


class _Along(Part):
    """Translations of the strip: their common part."""

    axis: Literal["x", "y"] = Field(
        default="x",
        description="direction of sliding, x: along the contact; y: out of the plane, with bodies that are endless "
        "along y: with heat, no cold material enters",
    )
    along: Vector | None = Field(default=None, description="direction of the sliding in a solid, in place of axis")

    checks: ClassVar[tuple[Check, ...]] = (
        Check(lambda s: s.present("along") and not any(s.along), "along: expected a direction, got zero"),
        Check(lambda s: s.present("along") and s.axis != "x", "along: give either along or axis"),
    )


class _About(Part):
    """Rotations of the strip: their common part."""

    axis: Vector = Field(default=(0.0, 0.0, 1.0), description="axis of the rotation")
    centre: tuple[Length, Length, Length] = Field(default=(0.0, 0.0, 0.0), description="a point on the axis")

    checks: ClassVar[tuple[Check, ...]] = (Check(lambda s: not any(s.axis), "axis: expected a direction, got zero"),)


class _ToAndFro(Part):
    positions: Annotated[int, Field(ge=1, le=MOST_POSITIONS, strict=True)] | None = Field(
        default=None,
        description="positions of the strip under the punch in each half-cycle; 1: opposite each other throughout; by "
        "default 1 unless the strip wears or has a profile or topography, then as many as contact nodes "
        "require, 9 to 61; on grids and with heat 9",
    )


class _Profile(_ToAndFro):
    """The speed over half-cycles to and fro.

    sinusoidal: v = u0 omega |sin omega t|, equation (10); triangular: constant speed; trapezoidal: the
    speed rises linearly over the fraction `ramp` of the half-cycle, stays, and falls again.
    """

    angular_frequency: Annotated[AngularFrequency, Field(gt=0)] | None = Field(
        default=None, description="angular frequency omega; a half-cycle takes pi / omega"
    )
    period: Annotated[Time, Field(gt=0)] | None = Field(default=None, description="or the time of a whole cycle")
    profile: Literal["sinusoidal", "triangular", "trapezoidal"] = Field(
        default="sinusoidal", description="course of the speed over a half-cycle; triangular: constant speed"
    )
    ramp: Annotated[Number, Field(gt=0, le=0.5)] | None = Field(
        default=None, description="with trapezoidal: fraction of the half-cycle in which the speed rises, and falls"
    )

    one_of = (("angular_frequency", "period"),)
    checks: ClassVar[tuple[Check, ...]] = (
        Check(
            lambda s: bool(s.ramp) != (s.profile == "trapezoidal"),
            "ramp: expected with a trapezoidal profile, and only then",
        ),
    )

    @property
    def half_period(self) -> float:
        """Duration of a half-cycle, s."""
        return math.pi / self.angular_frequency if self.angular_frequency else (self.period or 0.0) / 2


class Reciprocating(_Along, _Profile):
    """Sliding to and fro over 2 u0 in each half-cycle; it starts rightward, from -u0."""

    kind: Literal["reciprocating"] = Field(description="to and fro")
    amplitude: Annotated[Length, Field(gt=0)] = Field(description="u0, to both sides of the middle")


class Oscillation(_About, _Profile):
    """Turning to and fro by 2 phi0 in each half-cycle; it starts counterclockwise, from -phi0."""

    kind: Literal["oscillation"] = Field(description="turning to and fro")
    amplitude: Annotated[Angle, Field(gt=0)] = Field(description="phi0, to both sides of the middle")


class OneWay(_Along):
    """Steady sliding in one direction, counted in steps of `duration`."""

    kind: Literal["one-way"] = Field(description="steadily in one direction")
    direction: Literal["leftward", "rightward"] = Field(description="direction of the strip")
    speed: Annotated[Speed, Field(gt=0)] = Field(description="speed of the strip")
    duration: Annotated[Time, Field(gt=0)] = Field(description="duration of a step, which counts as a half-cycle")
    track: Annotated[Length, Field(gt=0)] | None = Field(
        default=None, description="length of the closed track over which the strip's wear spreads"
    )


class Rotation(_About):
    """Steady turning about an axis, counted in steps of `duration`."""

    kind: Literal["rotation"] = Field(description="turning steadily")
    direction: Literal["counterclockwise", "clockwise"] = Field(
        default="counterclockwise", description="direction seen against the axis"
    )
    angular_speed: Annotated[AngularFrequency, Field(gt=0)] = Field(description="angular speed of the strip")
    duration: Annotated[Time, Field(gt=0)] = Field(description="duration of a step, which counts as a half-cycle")


class Tabulated(_Along, _ToAndFro):
    """The strip's position over one cycle, straight lines between the given times; every stroke is a half-cycle."""

    kind: Literal["table"] = Field(description="the strip's position over a cycle")
    times: Annotated[tuple[Time, ...], Field(min_length=3)] = Field(
        description="times from 0 to the cycle's end, rising"
    )
    displacements: Annotated[tuple[Length, ...], Field(min_length=3)] = Field(
        description="displacements of the strip, towards +x"
    )

    checks: ClassVar[tuple[Check, ...]] = (
        Check(
            lambda s: len(s.times) != len(s.displacements),
            "displacements: expected as many values as times, one for each",
        ),
        Check(lambda s: s.times[0] != 0 or np.any(np.diff(s.times) <= 0), "times: expected 0 first, and rising"),
        Check(
            lambda s: s.displacements[0] != s.displacements[-1] or len(set(s.displacements)) < 2,
            "displacements: expected a motion that ends where it starts",
        ),
    )


NO_PLACE = {  # beginnings of columns of a cycle that a model has no place for
    "plane": ("rotation_x", "rotation_z", "angle_x", "angle_z", "force_y", "moment_x", "moment_z"),
    "axisymmetric": ("shift_", "rotation_x", "rotation_y", "angle_x", "angle_y", "force_x", "force_y", "moment_"),
    "solid": (),
}


class CycleLoad(Part):
    """Where the force and the moment of a cycle's table act on the punch."""

    on: str = Field(description="group of the geometry over which force and moment are spread")
    through: Point | None = Field(
        default=None, description="point through which the force acts; by default the centroid"
    )
    factor: Annotated[Number, Field(gt=0)] = Field(
        default=1.0, description="factor of all forces and moments of the table"
    )
    frame: Literal["space", "punch"] = Field(
        default="space", description="space: force and moment are fixed in space; punch: they turn with the punch"
    )


class Cycle(Part):
    """Places of both bodies, and the load, at times of a cycle; each step between two rows is a constant screw."""

    kind: Literal["cycle"] = Field(description="a table of places and loads over a cycle")
    columns: Annotated[tuple[str, ...], Field(min_length=2)] = Field(
        description="headings with units: time (s), or percent of the cycle; shift_x (mm), and rotation_x (rad) of a "
        "rotation vector or angle_x (deg) in an order, of the strip; punch_shift_x and so on of the "
        "punch; force_x (N) and moment_x (N*mm) on the punch. In place of columns and rows file = a CSV "
        "file"
    )
    rows: Annotated[tuple[tuple[Number, ...], ...], Field(min_length=2)] = Field(
        description="numbers below the headings; the last row has the position of the first"
    )
    period: Annotated[Time, Field(gt=0)] | None = Field(default=None, description="period of the cycle, with percent")
    order: Annotated[str, Field(pattern=r"^(?:[xyz]{1,3}|[XYZ]{1,3})$")] = Field(
        default="xyz",
        description="order of angles: the axes of the first, second and third turn; XYZ turn with the body, xyz are "
        "fixed in space",
    )
    centre: tuple[Length, Length, Length] = Field(default=(0.0, 0.0, 0.0), description="point about which bodies turn")
    load: CycleLoad | None = Field(default=None, description="place of force and moment")
    positions: Literal["middle", "steps"] | None = Field(
        default=None,
        description="middle: the strip's material stays at its place in the mesh; steps: it moves, in each step to "
        "its place in the middle of it; by default middle unless the strip wears or is uneven",
    )

    @model_validator(mode="after")
    def _a_cycle(self) -> Self:
        for name in self.column_names:
            if "angle_" in name and name[-1] not in self.order.lower():
                raise ValueError(f"order: expected all axes of the angles, that of {name} among them")
        if len(set(self.order)) < len(self.order):
            raise ValueError(f"order: expected no axis twice, got {self.order!r}")
        if self.course.loads != bool(self.load):  # raises where the table does not fit
            raise ValueError(f"load: expected together with columns of {', '.join(LOADS)}, and only then")
        return self

    @property
    def course(self) -> CycleCourse:
        """The table as places and loads."""
        in_space = self.load is None or self.load.frame == "space"
        return course_of(self.columns, self.rows, self.order, self.period, in_space=in_space)

    def model_problems(self, kind: str, axes: tuple[str, ...]) -> list[str]:
        """Return the problems of the motion in a model of this kind with these axes."""
        problems = [
            f"motion.columns: expected no column {name} in a model that is {kind}"
            for name in self.column_names
            if name.removeprefix("punch_").startswith(NO_PLACE[kind])
        ]
        through = None if self.load is None else self.load.through
        if through is not None and len(through) != len(axes):
            expected = f"expected {len(axes)} components ({', '.join(axes)})"
            problems.append(f"motion.load.through: {expected}, got {len(through)}")
        return problems

    def course_load(self, axes: tuple[str, ...]) -> CourseLoad | None:
        """Return the load of the table on the punch, of a model with these axes; None without."""
        if self.load is None:
            return None
        course, load = self.course, self.load
        of_force, of_moment = ([0, 2], [1]) if len(axes) == 2 else ([0, 1, 2], [0, 1, 2])
        force, moment = course.force[:, of_force], course.moment[:, of_moment]
        return CourseLoad(load.on, load.through, course.fraction, force, moment, load.factor)

    @property
    def column_names(self) -> tuple[str, ...]:
        """Names of the columns, without their units."""
        return tuple(headings(self.columns, COLUMNS)[0])


Motions = Reciprocating | OneWay | Tabulated | Oscillation | Rotation | Cycle
