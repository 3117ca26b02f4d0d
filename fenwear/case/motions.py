"""The table of the motion: how the strip slides or turns under the punch."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from fenwear.case.bodies import CourseLoad
from fenwear.case.csv_table import headings
from fenwear.case.cycle_table import COLUMNS, LOADS, CycleCourse, course_of
from fenwear.case.quantities import Angle, AngularFrequency, Check, Length, Number, Part, Point, Speed, Time, Vector


class _Along(Part):
    """What translations of the strip share."""

    axis: Literal["x", "y"] = Field(
        default="x",
        description="x: along the contact; y: out of the plane, "
        "as of bodies that are endless along y: with heat, no cold material comes in",
    )
    along: Vector | None = Field(default=None, description="direction of the sliding in a solid, in place of axis")

    checks = (
        Check(lambda s: s.given("along") and not any(s.along), "along: expected a direction, got zero"),
        Check(lambda s: s.given("along") and s.axis != "x", "along: give either along or axis"),
    )


class _About(Part):
    """What rotations of the strip share."""

    axis: Vector = Field(default=(0.0, 0.0, 1.0), description="of the rotation")
    centre: tuple[Length, Length, Length] = Field(default=(0.0, 0.0, 0.0), description="a point on the axis")

    checks = (Check(lambda s: not any(s.axis), "axis: expected a direction, got zero"),)


class _ToAndFro(Part):
    positions: Annotated[int, Field(ge=1, le=200, strict=True)] | None = Field(
        default=None,
        description="of the strip under the punch in each half-cycle; 1: opposite each other throughout; "
        "by default 1 unless the strip wears or has a profile or topography, then as many as contact "
        "nodes ask for, 9 to 61; on grids and with heat 9",
    )


class _Profile(_ToAndFro):
    """The speed over half-cycles to and fro.

    sinusoidal: v = u0 omega |sin omega t|, equation (10); triangular: constant speed; trapezoidal: the
    speed rises linearly over the fraction `ramp` of the half-cycle, stays, and falls again.
    """

    angular_frequency: Annotated[AngularFrequency, Field(gt=0)] | None = Field(
        default=None, description="omega; a half-cycle takes pi / omega"
    )
    period: Annotated[Time, Field(gt=0)] | None = Field(default=None, description="or the time of a whole cycle")
    profile: Literal["sinusoidal", "triangular", "trapezoidal"] = Field(
        default="sinusoidal", description="speed over a half-cycle; triangular: constant speed"
    )
    ramp: Annotated[Number, Field(gt=0, le=0.5)] | None = Field(
        default=None, description="trapezoidal: fraction of the half-cycle in which the speed rises, and falls"
    )

    one_of = (("angular_frequency", "period"),)
    checks = (
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
    direction: Literal["leftward", "rightward"] = Field(description="of the strip")
    speed: Annotated[Speed, Field(gt=0)] = Field(description="of the strip")
    duration: Annotated[Time, Field(gt=0)] = Field(description="of a step, which counts as a half-cycle")
    track: Annotated[Length, Field(gt=0)] | None = Field(
        default=None, description="length of the closed track over which the strip's wear spreads"
    )


class Rotation(_About):
    """Steady turning about an axis, counted in steps of `duration`."""

    kind: Literal["rotation"] = Field(description="turning steadily")
    direction: Literal["counterclockwise", "clockwise"] = Field(
        default="counterclockwise", description="seen against the axis"
    )
    angular_speed: Annotated[AngularFrequency, Field(gt=0)] = Field(description="of the strip")
    duration: Annotated[Time, Field(gt=0)] = Field(description="of a step, which counts as a half-cycle")


class Tabulated(_Along, _ToAndFro):
    """The strip's position over one cycle, straight lines between the given times; every stroke is a half-cycle."""

    kind: Literal["table"] = Field(description="the strip's position over a cycle")
    times: Annotated[tuple[Time, ...], Field(min_length=3)] = Field(description="rising from 0 to the cycle's end")
    displacements: Annotated[tuple[Length, ...], Field(min_length=3)] = Field(description="of the strip, towards +x")

    checks = (
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

    on: str = Field(description="group of the geometry that force and moment are spread over")
    through: Point | None = Field(default=None, description="point that the force acts through; else the centroid")
    factor: Annotated[Number, Field(gt=0)] = Field(default=1.0, description="of all forces and moments of the table")
    frame: Literal["space", "punch"] = Field(
        default="space", description="space: force and moment stand in space; punch: they turn with the punch"
    )


class Cycle(Part):
    """Places of both bodies, and the load, at times of a cycle; each step between two rows is a constant screw."""

    kind: Literal["cycle"] = Field(description="a table of places and loads over a cycle")
    columns: Annotated[tuple[str, ...], Field(min_length=2)] = Field(
        description="headings with units: time (s), or percent of the cycle; shift_x (mm), and rotation_x (rad) of a "
        "rotation vector or angle_x (deg) in an order, of the strip; the same of the punch as punch_shift_x; force_x "
        "(N) and moment_x (N*mm) on the punch. In place of columns and rows file = a CSV file"
    )
    rows: Annotated[tuple[tuple[Number, ...], ...], Field(min_length=2)] = Field(
        description="numbers under the headings; the last row has the place of the first"
    )
    period: Annotated[Time, Field(gt=0)] | None = Field(default=None, description="of the cycle, with percent")
    order: Annotated[str, Field(pattern=r"^(?:[xyz]{1,3}|[XYZ]{1,3})$")] = Field(
        default="xyz",
        description="of angles: about which axes the body is turned first, second, third: XYZ those that turn along, "
        "xyz those of space",
    )
    centre: tuple[Length, Length, Length] = Field(default=(0.0, 0.0, 0.0), description="point that bodies turn about")
    load: CycleLoad | None = Field(default=None, description="where force and moment act")
    positions: Literal["middle", "steps"] | None = Field(
        default=None,
        description="middle: the strip's material stays where it is meshed; steps: it moves, in each step to its "
        "place in the middle of it; by default middle unless the strip wears or is uneven",
    )

    @model_validator(mode="after")
    def _a_cycle(self) -> Self:
        for name in self.column_names:
            if "angle_" in name and name[-1] not in self.order.lower():
                raise ValueError(f"order: expected all axes of the angles, that of {name} among them")
        if len(set(self.order)) < len(self.order):
            raise ValueError(f"order: expected no axis twice, got {self.order!r}")
        course = self.course  # raises where the table does not fit
        if (self.load is None) != (course.force is None and course.moment is None):
            raise ValueError(f"load: expected together with columns of {', '.join(LOADS)}, and only then")
        return self

    @property
    def course(self) -> CycleCourse:
        """The table as places and loads."""
        in_space = self.load is None or self.load.frame == "space"
        return course_of(self.columns, self.rows, self.order, self.period, in_space=in_space)

    def model_problems(self, kind: str, axes: tuple[str, ...]) -> list[str]:
        """Return what of it a model of this kind, with these axes, has no place for."""
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
        course, load, plane = self.course, self.load, len(axes) == 2
        force, moment = course.force, course.moment
        if plane:
            force, moment = (None if force is None else force[:, [0, 2]]), (None if moment is None else moment[:, [1]])
        return CourseLoad(load.on, load.through, course.fraction, force, moment, load.factor)

    @property
    def column_names(self) -> tuple[str, ...]:
        """Names of the columns, without their units."""
        return tuple(headings(self.columns, COLUMNS)[0])


Motions = Reciprocating | OneWay | Tabulated | Oscillation | Rotation | Cycle
