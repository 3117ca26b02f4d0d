"""The table of the motion: how the strip slides or turns under the punch."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from fenwear.case.quantities import Angle, AngularFrequency, Length, Number, Part, Speed, Time, Vector


class _Along(Part):
    """What translations of the strip share."""

    axis: Literal["x", "y"] = Field(default="x", description="x: along the contact; y: out of the plane")
    along: Vector | None = Field(default=None, description="direction of the sliding in a solid, in place of axis")

    @model_validator(mode="after")
    def _one_direction(self) -> Self:
        if self.along is not None:
            if not any(self.along):
                raise ValueError("along: expected a direction, got zero")
            if self.axis != "x":
                raise ValueError("along: give either along or axis")
        return self


class _About(Part):
    """What rotations of the strip share."""

    axis: Vector = Field(default=(0.0, 0.0, 1.0), description="of the rotation")
    centre: tuple[Length, Length, Length] = Field(default=(0.0, 0.0, 0.0), description="a point on the axis")

    @model_validator(mode="after")
    def _some_axis(self) -> Self:
        if not any(self.axis):
            raise ValueError("axis: expected a direction, got zero")
        return self


class _ToAndFro(Part):
    positions: Annotated[int, Field(ge=1, le=200, strict=True)] | None = Field(
        default=None,
        description="of the strip under the punch in each half-cycle; 1: opposite each other throughout; "
        "by default 1 unless the strip wears, then 9",
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

    @model_validator(mode="after")
    def _one_frequency(self) -> Self:
        if (self.angular_frequency is None) == (self.period is None):
            raise ValueError("give either angular_frequency or period")
        if (self.ramp is not None) != (self.profile == "trapezoidal"):
            raise ValueError("ramp: expected with a trapezoidal profile, and only then")
        return self

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

    @model_validator(mode="after")
    def _a_cycle(self) -> Self:
        if len(self.times) != len(self.displacements):
            raise ValueError(f"displacements: expected {len(self.times)} values, one for each time")
        if self.times[0] != 0 or np.any(np.diff(self.times) <= 0):
            raise ValueError("times: expected 0 first, and rising")
        if self.displacements[0] != self.displacements[-1] or len(set(self.displacements)) < 2:
            raise ValueError("displacements: expected a motion that ends where it starts")
        return self


Motions = Reciprocating | OneWay | Tabulated | Oscillation | Rotation
