"""The validated description of a problem: one typed object, from a TOML file or from Python.

Every number is held in mm, N, s, K (see `fenwear.units`); a case file may give any other unit as a
string. Nothing here knows of meshes or solvers: what only the geometry can tell (whether a group
exists, whether a pin is on the punch) is checked where the geometry is read, and reported with the
same keys.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    PlainSerializer,
    Tag,
    model_validator,
)

from fenwear.arrays import Array
from fenwear.case.dependence import (
    UNITS,
    VARIABLES,
    check_law,
    evaluate,
    evaluate_law,
    parse_expression,
    variables_of,
    variables_of_law,
)
from fenwear.case.units import convert, quantity_text, shown
from fenwear.errors import CaseError, InputError


@dataclass(frozen=True)
class Unit:
    """The unit of a key's bare numbers; in the JSON schema a text with a unit may stand for the number."""

    symbol: str

    def __get_pydantic_json_schema__(self, core: Any, handler: Any) -> dict[str, Any]:
        """Return the schema of a number with this unit."""
        return {"anyOf": [handler(core), {"type": "string"}]}


def _quantity(unit: str) -> Any:
    """Return pydantic metadata: a number read with, and written in, `unit`."""
    return (
        Unit(unit),
        BeforeValidator(lambda value: convert(value, unit)),
        PlainSerializer(lambda value: quantity_text(value, unit)),
    )


Length = Annotated[float, *_quantity("mm")]
Force = Annotated[float, *_quantity("N")]
Stress = Annotated[float, *_quantity("MPa")]
Speed = Annotated[float, *_quantity("mm/s")]
Time = Annotated[float, *_quantity("s")]
AngularFrequency = Annotated[float, *_quantity("rad/s")]
Number = Annotated[float, *_quantity("")]
Temperature = Annotated[float, *_quantity("K")]
CONDUCTANCE = "N/(mm*s*K)"
Conductance = Annotated[float, *_quantity(CONDUCTANCE)]
Angle = Annotated[float, *_quantity("rad")]
Axis = Literal["x", "y", "z"]
Vector = tuple[Number, Number, Number]
Kind = Literal["stress", "strain", "axisymmetric", "solid"]  # of a model: what tells strains and rigid modes
# With as many components as the model has axes.
Point = Annotated[tuple[Length, ...], Field(min_length=2, max_length=3)]
Forces = Annotated[tuple[Force, ...], Field(min_length=2, max_length=3)]
Stresses = Annotated[tuple[Stress, ...], Field(min_length=2, max_length=3)]


class _Part(BaseModel):
    """A table of the case file: unknown keys refused, values frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True, hide_input_in_errors=True, ser_json_inf_nan="strings")


def _parameter(value: object) -> float:
    """Convert a geometry parameter: a plain number, or a length with its unit."""
    try:
        return convert(value, "mm")
    except ValueError:
        raise ValueError(f"expected a number or a length such as '60 mm', got {shown(value)}") from None


class Geometry(_Part):
    """Where the meshes come from: a gmsh .geo with its parameters, or a .msh."""

    file: str = Field(
        default="punch_on_strip.geo", description=".geo or .msh beside the case file, or one of the ready geometries"
    )
    parameters: dict[str, Annotated[float, Unit("mm"), BeforeValidator(_parameter)]] = Field(
        default={}, description="values of parameters of the .geo, by their names"
    )
    degree: Annotated[int, Field(ge=1, le=8, strict=True)] = Field(default=4, description="of the elements, 1 to 8")
    order: Annotated[int, Field(ge=1, le=2, strict=True)] = Field(
        default=1, description="of the elements' shape made from a .geo: 2 follows curved boundaries"
    )
    follow_wear: Annotated[Number, Field(gt=0)] | None = Field(
        default=0.5,
        description="worn depth over the elements' height above which the mesh follows the worn surface; or never",
    )

    @model_validator(mode="before")
    @classmethod
    def _follow_or_not(cls, data: object) -> object:
        if isinstance(data, Mapping) and data.get("follow_wear") == "never":
            return {**data, "follow_wear": None}
        return data


class Model(_Part):
    """Plane bodies in (x, z) with their thickness; rings in (x, z), x the radius; or solids in (x, y, z)."""

    kind: Literal["plane", "axisymmetric", "solid"] = Field(
        default="plane", description="plane bodies, rings, or solids"
    )
    plane: Literal["stress", "strain"] = Field(default="stress", description="plane stress or plane strain")
    thickness: Annotated[Length, Field(gt=0)] = Field(default=1.0, description="of plane bodies, out of their plane")

    @model_validator(mode="after")
    def _plane_alone(self) -> Self:
        if self.kind != "plane":
            for key, default in (("plane", "stress"), ("thickness", 1.0)):
                if getattr(self, key) != default:
                    raise ValueError(f"{key}: belongs to plane models, not with kind = '{self.kind}'")
        return self

    @property
    def law(self) -> Kind:
        """Plane stress, plane strain, axisymmetric or solid."""
        return self.plane if self.kind == "plane" else self.kind

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The axes of vectors."""
        return ("x", "y", "z") if self.kind == "solid" else ("x", "z")


class Material(_Part):
    """An isotropic, linear-elastic material; the thermal values are needed with heat only."""

    young: Annotated[Stress, Field(gt=0)] = Field(description="Young's modulus E")
    poisson: Annotated[Number, Field(gt=-1, le=0.5)] = Field(description="Poisson's ratio nu")
    conductivity: Annotated[float, *_quantity("N/(s*K)"), Field(gt=0)] | None = Field(
        default=None, description="thermal conductivity k; 1 W/(m K) = 1"
    )
    heat_capacity: Annotated[float, *_quantity("mm^2/(s^2*K)"), Field(gt=0)] | None = Field(
        default=None, description="c; 1 J/(kg K) = 1e6: better give the unit"
    )
    density: Annotated[float, *_quantity("N*s^2/mm^4"), Field(gt=0)] | None = Field(
        default=None, description="rho; 1 kg/m³ = 1e-12: better give the unit"
    )
    expansion: Annotated[float, *_quantity("1/K")] | None = Field(
        default=None, description="linear thermal expansion alpha"
    )


class Support(_Part):
    """Displacement components held at zero, on a named group or at a point."""

    on: str | None = Field(default=None, description="group of the geometry")
    at: Point | None = Field(default=None, description="or a point [x, z], in a solid [x, y, z], at a mesh node")
    fix: Annotated[tuple[Axis, ...], Field(min_length=1)] = Field(description="components held at zero")

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if (self.on is None) == (self.at is None):
            raise ValueError("give either on = (a group) or at = (a point)")
        return self


class Load(_Part):
    """A load spread evenly over a named group: its resultant, or a traction; (x, z), in a solid (x, y, z)."""

    on: str = Field(description="group of the geometry")
    force: Forces | None = Field(default=None, description="resultant [x, z], in a solid [x, y, z], spread evenly")
    traction: Stresses | None = Field(default=None, description="or the traction itself")
    over_cycle: tuple[tuple[Number, Number], ...] | None = Field(
        default=None,
        description="[fraction of the cycle, factor] pairs from 0 to 1: the load varies linearly between them",
    )

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        if (self.force is None) == (self.traction is None):
            raise ValueError("give either force or traction")
        if self.over_cycle is not None:
            fractions = [fraction for fraction, _ in self.over_cycle]
            if len(fractions) < 2 or fractions[0] != 0 or fractions[-1] != 1 or np.any(np.diff(fractions) <= 0):
                raise ValueError("over_cycle: expected pairs [fraction, factor] with fractions that rise from 0 to 1")
        return self

    def times(self, factor: float) -> Load:
        """Return the load times a factor at every time."""
        return self._scaled(factor).model_copy(update={"over_cycle": self.over_cycle})

    def at(self, fraction: float) -> Load:
        """Return the load at this fraction of the cycle."""
        if self.over_cycle is None:
            return self
        return self._scaled(float(np.interp(fraction, *np.array(self.over_cycle).T)))

    def mean(self) -> Load:
        """Return the mean of the load over the cycle."""
        if self.over_cycle is None:
            return self
        fractions, factors = np.array(self.over_cycle).T
        return self._scaled(float(np.diff(fractions) @ (factors[1:] + factors[:-1]) / 2))

    def _scaled(self, factor: float) -> Load:
        force, traction = (
            None if vector is None else tuple(factor * component for component in vector)
            for vector in (self.force, self.traction)
        )
        return Load(on=self.on, force=force, traction=traction)


class Prescribed(_Part):
    """A temperature held on a named group of the boundary."""

    on: str = Field(description="group of the geometry")
    temperature: Temperature = Field(default=0.0, description="theta held there")


class Body(_Part):
    """One body: the material of each of its regions, its supports, loads and held temperatures."""

    regions: dict[str, str] = Field(default={}, description="name of the material of each region")
    supports: tuple[Support, ...] = Field(default=(), description="where displacement is held")
    loads: tuple[Load, ...] = Field(default=(), description="forces on the body")
    temperatures: tuple[Prescribed, ...] = Field(default=(), description="where temperature is held")
    pivot: Point | None = Field(
        default=None, description="the point O of lambda_F and lambda_M; by default the first support's centre"
    )


class Dependence(_Part):
    """A coefficient that depends on the state: an expression, a table with straight lines, values of regions, a law."""

    expression: str | None = Field(
        default=None,
        description="arithmetic on T (K), p (MPa), v (mm/s), x, y, z (mm), depth (mm, worn) and s (mm, slid)",
    )
    table: tuple[tuple[Number, Number], ...] | None = Field(
        default=None, description="[argument, value] pairs; beyond its ends the end values hold"
    )
    of: Literal["T", "p", "v", "x", "y", "z", "depth", "s"] = Field(default="T", description="argument of the table")
    regions: dict[str, Annotated[Number, Field(ge=0)]] | None = Field(
        default=None, description="value of each material region of the body, of the punch for friction"
    )
    law: str | None = Field(default=None, description="name of a law registered in Python")
    unit: str = Field(default="", description="unit of the values")

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        if sum(form is not None for form in (self.expression, self.table, self.regions, self.law)) != 1:
            raise ValueError("give one of expression, table, regions and law")
        if self.law is not None:
            try:
                check_law(self.law)
            except ValueError as error:
                raise ValueError(f"law: {error}") from None
        if self.expression is not None:
            try:
                parse_expression(self.expression)
            except ValueError as error:
                raise ValueError(f"expression: {error}") from None
        if self.table is not None:
            arguments = [argument for argument, _ in self.table]
            if len(arguments) < 2 or np.any(np.diff(arguments) <= 0):
                raise ValueError("table: expected at least two pairs [argument, value] with rising arguments")
        return self

    def depends_on(self, name: str) -> bool:
        """Return whether a variable such as T, p or depth is in it."""
        if self.expression is not None:
            return name in variables_of(self.expression)
        if self.law is not None:
            return name in variables_of_law(self.law)
        return self.table is not None and name == self.of

    @property
    def varies(self) -> bool:
        """Whether it changes with more than the place."""
        return any(self.depends_on(name) for name in ("T", "p", "v", "depth", "s"))

    @property
    def passes(self) -> bool:
        """Whether it changes as long as a run goes on: with the worn depth, or with what has been slid."""
        return self.depends_on("depth") or self.depends_on("s")

    def values(self, state: Mapping[str, Array], shape: tuple[int, ...], factor: float, key: str) -> Array:
        """Return the coefficient times `factor` at the `state` (shape), which has shares of regions by their names.

        Raises:
            CaseError: it is negative or not finite somewhere; `key` is the case's key.
        """
        if self.table is not None:
            values = np.interp(np.broadcast_to(state[self.of], shape), *np.array(self.table).T)
        elif self.regions is not None:
            values = np.sum([state[f"region {name}"] * value for name, value in self.regions.items()], axis=0)
        elif self.law is not None:
            try:
                values = evaluate_law(self.law, {name: state[name] for name in VARIABLES}, shape)
            except ValueError as error:
                raise CaseError(InputError(key, str(error))) from error
        else:
            values = evaluate(parse_expression(self.expression or ""), state, shape)
        wrong = ~(np.isfinite(values) & (values >= 0))
        if wrong.any():
            node = int(np.flatnonzero(wrong)[0])
            named = [name for name in VARIABLES if name in ("T", "p", "v") or self.depends_on(name)]
            at = ", ".join(f"{name} = {np.broadcast_to(state[name], shape)[node]:g} {UNITS[name]}" for name in named)
            raise CaseError(InputError(key, f"expected zero or more, got {values[node]:g} at {at}"))
        return values * factor


def _form(value: object) -> str:
    return "dependence" if isinstance(value, (Mapping, Dependence)) else "number"


def _constant_or_dependence(constant: Any) -> Any:
    """Return the type of a coefficient that is a constant of this type, or depends on the state."""
    return Annotated[
        Annotated[constant, Tag("number")] | Annotated[Dependence, Tag("dependence")],
        Discriminator(_form),
    ]


class Contact(_Part):
    """Unilateral contact with Coulomb friction: in gross sliding of known direction, or with stick."""

    law: Literal["gross-sliding", "coulomb"] = Field(
        default="gross-sliding",
        description="gross-sliding: every node slips in the direction of the motion; coulomb: nodes stick or slip, "
        "as in fretting",
    )
    friction: _constant_or_dependence(Annotated[Number, Field(ge=0)]) = Field(  # type: ignore[valid-type]
        default=0.0, description="mu"
    )
    transverse_friction: Number = Field(
        default=0.0, description="mu_d, of the traction -mu_d p across the sliding direction, equation (5)"
    )
    solver: Literal["condensed", "full"] = Field(
        default="condensed", description="full: all displacements as unknowns, slow, to compare with"
    )

    @model_validator(mode="after")
    def _pure_number(self) -> Self:
        if isinstance(self.friction, Dependence) and self.friction.unit:
            raise ValueError(f"friction: expected no unit: its values are pure numbers, got {self.friction.unit!r}")
        return self


class Stick(_Part):
    """How the rig drives a contact with stick, and its time steps; with contact.law = "coulomb"."""

    force: Annotated[Force, Field(gt=0)] | None = Field(
        default=None,
        description="largest tangential force on the strip, which then follows the course of the motion in place of "
        "its displacement",
    )
    bulk_stress: Stress = Field(
        default=0.0, description="largest bulk stress along x in the strip, as in fretting fatigue, with the motion"
    )
    bulk_over_cycle: tuple[tuple[Number, Number], ...] | None = Field(
        default=None,
        description="[fraction of the cycle, factor] pairs from 0 to 1 of the bulk stress; by default it follows the "
        "motion",
    )
    steps: Annotated[int, Field(ge=2, le=1000, strict=True)] = Field(
        default=20, description="time steps of a half-cycle, at least"
    )
    step_tolerance: Annotated[Number, Field(gt=0)] = Field(
        default=0.02,
        description="change of force and friction's work of the first cycle by which the steps are fine enough; they "
        "are doubled until then",
    )
    load_steps: Annotated[int, Field(ge=1, le=1000, strict=True)] = Field(
        default=5, description="in which the loads rise at the start"
    )

    @model_validator(mode="after")
    def _bulk_table(self) -> Self:
        if self.bulk_over_cycle is not None:
            fractions = [fraction for fraction, _ in self.bulk_over_cycle]
            if len(fractions) < 2 or fractions[0] != 0 or fractions[-1] != 1 or np.any(np.diff(fractions) <= 0):
                raise ValueError("bulk_over_cycle: expected pairs [fraction, factor] with fractions rising from 0 to 1")
        return self


class WearLaw(_Part):
    """Wear rate normal to the surface = beta~ p^b v^a, equation (1).

    beta~ is given as `coefficient`; or as `beta`, beta~ = beta mu^b; or, for a = b = 1, by Archard's
    dimensionless coefficient K and the `hardness` H, beta~ = K / H, or by the volume worn for each
    energy of friction, `energy`, beta~ = energy mu.
    """

    coefficient: _constant_or_dependence(Annotated[float | None, Unit("")]) = Field(  # type: ignore[valid-type]
        default=None, description="beta~, in (mm/s) MPa^-b (mm/s)^-a"
    )
    beta: Annotated[float | None, Unit("")] = Field(default=None, description="in the same unit; beta~ = beta mu^b")
    archard: Annotated[Number, Field(ge=0)] | None = Field(default=None, description="K; beta~ = K / hardness")
    hardness: Annotated[Stress, Field(gt=0)] | None = Field(default=None, description="H, with archard")
    energy: Annotated[float, *_quantity("mm^3/(N*mm)"), Field(ge=0)] | None = Field(
        default=None, description="volume worn over the energy of friction; beta~ = energy mu"
    )
    pressure_exponent: Annotated[Number, Field(gt=0)] = Field(default=1.0, description="b")
    pressure_threshold: Annotated[Stress, Field(ge=0)] = Field(
        default=0.0, description="p_0: nothing wears below it, and above it (p - p_0)^b does"
    )
    pressure_cap: Annotated[Stress, Field(gt=0)] | None = Field(
        default=None, description="such as the hardness: more pressure than it wears no more"
    )
    speed_exponent: Annotated[Number, Field(gt=0)] = Field(default=1.0, description="a")

    @staticmethod
    def coefficient_unit(pressure_exponent: float, speed_exponent: float) -> str:
        """Return the unit of beta~ for the exponents b and a."""
        unit = f"MPa^-{pressure_exponent:g}"
        return unit if speed_exponent == 1 else f"{unit}*mm^{1 - speed_exponent:g}*s^{speed_exponent - 1:g}"

    @property
    def unit(self) -> str:
        """The unit of beta~."""
        return self.coefficient_unit(self.pressure_exponent, self.speed_exponent)

    @model_validator(mode="before")
    @classmethod
    def _convert_coefficients(cls, data: object) -> object:
        if not isinstance(data, Mapping):
            return data
        exponents = (data.get("pressure_exponent", 1.0), data.get("speed_exponent", 1.0))
        if not all(isinstance(e, (int, float)) and not isinstance(e, bool) and 0 < e < 100 for e in exponents):
            return data
        converted = dict(data)
        for key in {"coefficient", "beta"} & data.keys():
            if not isinstance(data[key], (Mapping, Dependence, type(None))):
                try:
                    converted[key] = convert(data[key], cls.coefficient_unit(*exponents))
                except ValueError as error:
                    raise ValueError(f"{key}: {error}") from None
        return converted

    @model_validator(mode="after")
    def _one_coefficient(self) -> Self:
        given = [key for key in ("coefficient", "beta", "archard", "energy") if getattr(self, key) is not None]
        if len(given) != 1:
            raise ValueError(f"give one of coefficient, beta, archard and energy, got {' and '.join(given) or 'none'}")
        for key in ("coefficient", "beta"):
            value = getattr(self, key)
            if isinstance(value, float) and not (math.isfinite(value) and value >= 0):
                raise ValueError(f"{key}: expected a finite number, zero or larger")
        if self.pressure_cap is not None and self.pressure_cap <= self.pressure_threshold:
            raise ValueError("pressure_cap: expected more than pressure_threshold")
        if (self.archard is None) != (self.hardness is None):
            raise ValueError("hardness: expected together with archard, and only then")
        if (self.archard, self.energy) != (None, None) and (self.pressure_exponent, self.speed_exponent) != (1.0, 1.0):
            raise ValueError(f"{given[0]}: expected with exponents of 1 only; give coefficient or beta")
        if isinstance(self.coefficient, Dependence):
            try:
                convert(f"1 {self.coefficient.unit}" if self.coefficient.unit else 1.0, self.unit)
            except ValueError as error:
                raise ValueError(f"coefficient: unit: {error}") from None
        return self

    @property
    def scale(self) -> float:
        """What turns values of a dependent coefficient into its internal unit."""
        if isinstance(self.coefficient, Dependence) and self.coefficient.unit:
            return convert(f"1 {self.coefficient.unit}", self.unit)
        return 1.0

    def resolved(self, data: dict[str, Any]) -> dict[str, Any]:
        """Return the dumped tables `data` of this law with the units of its coefficients."""
        for key in ("coefficient", "beta"):
            if isinstance(getattr(self, key), float):
                data[key] = quantity_text(getattr(self, key), self.unit)
        return data


class Wear(_Part):
    """The wear law of each body that wears."""

    punch: WearLaw | None = Field(default=None, description="law of the punch; without it the punch does not wear")
    strip: WearLaw | None = Field(default=None, description="law of the strip; without it the strip does not wear")

    @model_validator(mode="after")
    def _some_law(self) -> Self:
        if self.punch is None and self.strip is None:
            raise ValueError("expected the wear law of punch, strip or both")
        return self


class _Along(_Part):
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


class _About(_Part):
    """What rotations of the strip share."""

    axis: Vector = Field(default=(0.0, 0.0, 1.0), description="of the rotation")
    centre: tuple[Length, Length, Length] = Field(default=(0.0, 0.0, 0.0), description="a point on the axis")

    @model_validator(mode="after")
    def _some_axis(self) -> Self:
        if not any(self.axis):
            raise ValueError("axis: expected a direction, got zero")
        return self


class _ToAndFro(_Part):
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


def _perfect_or_conductance(value: object) -> float | str:
    """Convert a conductance, which may be perfect."""
    if value == "perfect":
        return "perfect"
    try:
        conductance = convert(value, CONDUCTANCE)
    except ValueError as error:
        raise ValueError(f"{error}; or 'perfect'") from None
    if conductance < 0:
        raise ValueError(f"expected greater than or equal to 0, got {shown(value)}")
    return conductance


PerfectOrConductance = Annotated[
    float | Literal["perfect"],
    Unit(CONDUCTANCE),
    BeforeValidator(_perfect_or_conductance),
    PlainSerializer(lambda value: value if value == "perfect" else quantity_text(value, CONDUCTANCE)),
]


Motions = Reciprocating | OneWay | Tabulated | Oscillation | Rotation


class Track(_Part):
    """The rest of a disc or ring whose material passes under the punch, warms up and comes back."""

    heat_capacity: Annotated[float, *_quantity("N*mm/K"), Field(gt=0)] = Field(
        description="of what is not meshed, its mass times c; 1 J/K = 1000"
    )
    loss: Annotated[float, *_quantity("N*mm/(s*K)"), Field(ge=0)] = Field(
        default=0.0, description="to the surroundings, its area times h; 1 W/K = 1000"
    )


class Heat(_Part):
    """Friction heat and its conduction; without this table a case knows no temperature."""

    partition: Annotated[Number, Field(ge=0, le=1)] = Field(
        default=0.5, description="kappa, the punch's share of the friction heat"
    )
    debris: Annotated[Number, Field(ge=0, lt=1)] = Field(default=0.0, description="gamma_d, carried off by debris")
    conductance: PerfectOrConductance = Field(
        default="perfect",
        description="h_c between punch and strip where they touch, 1 W/(m² K) = 0.001; "
        "by default 0 where partition is given",
    )
    conductance_per_pressure: tuple[Annotated[float, *_quantity("N/(mm*s*K*MPa)"), Field(gt=0)], ...] | None = Field(
        default=None, min_length=2, max_length=2, description="h_1, h_2: the conductance is p h_1 h_2 / (h_1 + h_2)"
    )
    conducting: Literal["closed", "nominal"] = Field(
        default="closed", description="the nodes that conduct: those in contact, or the whole nominal interface"
    )
    convection: Annotated[Conductance, Field(ge=0)] = Field(
        default=0.0, description="h on all other boundaries and on the two faces of the plane model, 1 W/(m² K) = 0.001"
    )
    convecting_faces: bool = Field(default=True, description="whether the faces of the plane model convect, too")
    ambient: Temperature = Field(default=0.0, description="theta_a of the surroundings, from any zero")
    inflow: Temperature | None = Field(
        default=None,
        description="of the strip's material that enters through free ends; by default, sliding one way, the "
        "ambient, and to and fro what has left comes back as it was",
    )
    track: Track | None = Field(default=None, description="closed track of one-way sliding, which warms up as a whole")
    initial: Temperature = Field(default=0.0, description="at the start, free of thermal stress")
    steps: Annotated[int, Field(ge=1, le=1000, strict=True)] = Field(default=5, description="in each half-cycle")
    coupling: Literal["implicit", "split"] = Field(
        default="implicit", description="heat and contact together, or in turn by the operator split"
    )
    split_tolerance: Annotated[Number, Field(gt=0, lt=1)] = Field(
        default=1e-4, description="change of the gap volume that ends the operator split, equation (30)"
    )
    relaxation: Annotated[Number, Field(gt=0, le=1)] = Field(
        default=0.5, description="of the pressure in the operator split, equation (29)"
    )
    operator: Literal["reduced", "full"] = Field(
        default="reduced", description="temperatures on a small basis, or on the whole mesh"
    )
    # The keys that the operators of the bodies do not depend on.
    exchange_keys: ClassVar[frozenset[str]] = frozenset(
        (
            *("partition", "debris", "conductance", "conductance_per_pressure", "conducting"),
            *("coupling", "split_tolerance", "relaxation"),
        )
    )

    # Finer than 1e-8 the basis, found by squares, would be made of rounding.
    reduction_tolerance: Annotated[Number, Field(ge=1e-7, lt=1)] = Field(
        default=3e-5, description="of the reduced operator's basis, relative"
    )

    @model_validator(mode="before")
    @classmethod
    def _conductance_by_default(cls, data: object) -> object:
        """Let a partition that is given rule, and leave the sharing to conduction where none is."""
        if not isinstance(data, Mapping) or data.get("conductance") is not None:
            return data
        ruled = data.get("partition") is not None or data.get("conductance_per_pressure") is not None
        return {**data, "conductance": 0.0 if ruled else "perfect"}


class Run(_Part):
    """How far a run goes and how it integrates the wear."""

    half_cycles: Annotated[int, Field(ge=1, strict=True)] = Field(description="how many at most")
    integration: Literal["explicit", "implicit", "jump"] = Field(
        default="explicit", description="of the wear; jump: over many cycles at once"
    )
    jump_tolerance: Annotated[Number, Field(gt=0, le=1)] = Field(
        default=3e-3,
        description="error of one cycle jump: of its depths, and of where the force and the temperatures are",
    )
    periodic_within: Annotated[Number, Field(gt=0)] | None = Field(
        default=None, description="stop when pressure repeats within this fraction of its scale"
    )


@dataclass(frozen=True)
class OneOrTwo:
    """One value, or two that are the ends of a ramp; in the JSON schema a value alone may stand for the list."""

    def __get_pydantic_json_schema__(self, core: Any, handler: Any) -> dict[str, Any]:
        """Return the schema of a value or a list."""
        several = handler(core)
        return {"anyOf": [several, several.get("items", {})]}


def _ramp(quantity: Any) -> Any:
    """Return the type of what is held, or goes from one value to another, in a step of a program."""
    listed = BeforeValidator(lambda value: value if isinstance(value, list | tuple) else (value,))
    return Annotated[tuple[quantity, ...], Field(min_length=1, max_length=2), OneOrTwo(), listed] | None


class ProgramStep(_Part):
    """A step of a test program: how long it takes, and what acts in it; [from, to] is a ramp."""

    cycles: Annotated[int, Field(ge=1, strict=True)] | None = Field(default=None, description="how long it takes")
    distance: Annotated[Length, Field(gt=0)] | None = Field(default=None, description="or: of sliding")
    time: Annotated[Time, Field(gt=0)] | None = Field(default=None, description="or: how long")
    load: _ramp(Annotated[Force, Field(gt=0)]) = Field(  # type: ignore[valid-type]
        default=None, description="normal force: all loads of the case change in its proportion"
    )
    load_factor: _ramp(Annotated[Number, Field(gt=0)]) = Field(  # type: ignore[valid-type]
        default=None, description="or: all loads of the case times this"
    )
    speed: _ramp(Annotated[Speed, Field(ge=0)]) = Field(  # type: ignore[valid-type]
        default=None, description="of one-way sliding"
    )
    angular_speed: _ramp(Annotated[AngularFrequency, Field(ge=0)]) = Field(  # type: ignore[valid-type]
        default=None, description="of a rotation"
    )
    amplitude: _ramp(Annotated[Length, Field(gt=0)]) = Field(  # type: ignore[valid-type]
        default=None, description="of reciprocating sliding"
    )
    angular_frequency: _ramp(Annotated[AngularFrequency, Field(gt=0)]) = Field(  # type: ignore[valid-type]
        default=None, description="of reciprocating sliding or an oscillation"
    )
    period: _ramp(Annotated[Time, Field(gt=0)]) = Field(  # type: ignore[valid-type]
        default=None, description="or: of a whole cycle"
    )
    ambient: _ramp(Temperature) = Field(  # type: ignore[valid-type]
        default=None, description="heat.ambient"
    )

    @model_validator(mode="after")
    def _one_length(self) -> Self:
        if sum(length is not None for length in (self.cycles, self.distance, self.time)) != 1:
            raise ValueError("give one of cycles, distance and time: how long the step takes")
        for one, other in (("load", "load_factor"), ("angular_frequency", "period")):
            if getattr(self, one) is not None and getattr(self, other) is not None:
                raise ValueError(f"{one}: give either {one} or {other}")
        for key in ("speed", "angular_speed"):
            if getattr(self, key) is not None and not any(getattr(self, key)):
                raise ValueError(f"{key}: expected more than zero: nothing slides in this step")
        return self


class Program(_Part):
    """A test program: steps one after the other. What a step does not name stays as it was."""

    steps: Annotated[tuple[ProgramStep, ...], Field(min_length=1)] = Field(description="in their order")
    levels: Annotated[int, Field(ge=1, le=10000, strict=True)] = Field(
        default=20,
        description="that a ramp of motion or ambient temperature is cut into; loads change continuously",
    )


class Output(_Part):
    """What a run keeps."""

    every: Annotated[int, Field(ge=1, strict=True)] = Field(
        default=1, description="keep every k-th cycle in history.nc, and always the last one"
    )
    fields_at: tuple[Annotated[int, Field(ge=1, strict=True)], ...] | None = Field(
        default=None, description="half-cycles whose fields are written; by default the last one, [] for none"
    )
    checkpoint: Annotated[Time, Field(gt=0)] = Field(default=60.0, description="time between two checkpoints")
    report: bool = Field(default=True, description="draw figures and report.html when the run has ended")
    figures_at: tuple[Annotated[int, Field(ge=1, strict=True)], ...] = Field(
        default=(), description="half-cycles that the figures show; by default six spread over the run"
    )


@dataclass(frozen=True)
class Written:
    """How the quantities of a case were written; no part of what the case is, so that all compare as equal.

    Attributes:
        bare: Keys of those that were numbers without a unit.
        united: Those with a unit, as they were written.
    """

    bare: frozenset[str] = field(default=frozenset(), compare=False)
    united: Mapping[str, str] = field(default_factory=dict, compare=False)


class Case(_Part):
    """A problem: the root of the case file."""

    title: str = Field(default="", description="shown with the results")
    geometry: Geometry = Field(default=Geometry(), description="the meshes")
    model: Model = Field(default=Model(), description="of the plane")
    materials: Annotated[dict[str, Material], Field(min_length=1)] = Field(description="by their names")
    punch: Body = Field(description="the body above, body 1")
    strip: Body = Field(description="the body below, which slides, body 2")
    contact: Contact = Field(default=Contact(), description="between the two")
    stick: Stick = Field(default=Stick(), description="of contact with stick: what the rig imposes, time steps")
    wear: Wear = Field(description="of punch, strip or both")
    motion: Annotated[Motions, Field(discriminator="kind")] = Field(description="of the strip under the punch")
    heat: Heat | None = Field(default=None, description="without this table there is no temperature")
    program: Program | None = Field(default=None, description="loads, motion and ambient temperature that change")
    run: Run = Field(description="how far, and how")
    output: Output = Field(default=Output(), description="what is kept")

    def __repr__(self) -> str:
        """Say in a line what it is; `to_toml` has all of it."""
        return f"<Case {self.title!r}: {self.model.kind}, {self.motion.kind}, {self.run.half_cycles} half-cycles>"

    __str__ = __repr__

    _folder: Path | None = None  # where the case file lies: its geometry's paths start there
    _written: Written = Written()

    @model_validator(mode="after")
    def _materials_known(self) -> Self:
        problems = [
            f"{body}.regions.{region}: no material {name!r}; known are {', '.join(sorted(self.materials))}"
            for body, part in (("punch", self.punch), ("strip", self.strip))
            for region, name in part.regions.items()
            if name not in self.materials
        ]
        if self.model.law != "stress":
            where = {"strain": "in plane strain", "axisymmetric": "in rings", "solid": "in solids"}[self.model.law]
            problems += [
                f"materials.{name}.poisson: expected less than 0.5 {where}, got {material.poisson:g}"
                for name, material in self.materials.items()
                if material.poisson >= 0.5
            ]
        if self.heat is not None:
            problems += self._thermal_problems(self.heat)
        if self.contact.solver == "full" and self.run.integration != "explicit":
            problems.append("contact.solver: expected 'condensed' for implicit integration and cycle jumps")
        problems += [*self._kind_problems(), *self._sliding_problems()]
        problems += [*self._program_problems(), *self._stick_problems()]
        problems += [
            f"{body}.regions: missing, but required"
            for body, part in (("punch", self.punch), ("strip", self.strip))
            if not part.regions
        ]
        if not any(load.force or load.traction for load in self.punch.loads):
            problems.append("punch.loads: expected at least one load that presses the punch on the strip")
        if problems:
            raise ValueError("\n".join(problems))
        return self

    def _kind_problems(self) -> list[str]:
        """Return what does not go with a plane, an axisymmetric or a solid model."""
        kind, axes, motion = self.model.kind, self.model.axes, self.motion
        names, problems = " or ".join(f"'{axis}'" for axis in axes), []
        for body, part in (("punch", self.punch), ("strip", self.strip)):
            vectors: dict[str, tuple[float, ...] | None] = {f"{body}.pivot": part.pivot}
            for number, support in enumerate(part.supports):
                vectors[f"{body}.supports.{number}.at"] = support.at
                problems += [
                    f"{body}.supports.{number}.fix.{place}: expected {names} in a {kind} model, got '{axis}'"
                    for place, axis in enumerate(support.fix)
                    if axis not in axes
                ]
            for number, load in enumerate(part.loads):
                vectors[f"{body}.loads.{number}.force"] = load.force
                vectors[f"{body}.loads.{number}.traction"] = load.traction
            problems += [
                f"{key}: expected {len(axes)} components ({', '.join(axes)}) in a {kind} model, got {len(vector)}"
                for key, vector in vectors.items()
                if vector is not None and len(vector) != len(axes)
            ]
        if isinstance(motion, Oscillation | Rotation):
            if kind == "plane" and (motion.axis[0] or motion.axis[2] or not motion.axis[1]):
                problems.append("motion.axis: expected [0, 1, 0], out of the plane, in a plane model")
            if kind == "axisymmetric" and (any(motion.axis[:2]) or any(motion.centre[:2])):
                problems.append("motion.axis: expected the axis z of the rings, through x = y = 0")
        elif kind == "axisymmetric":
            problems.append("motion.kind: expected rotation or oscillation in an axisymmetric model")
        elif kind == "plane" and motion.along is not None:
            problems.append("motion.along: belongs to solids; a plane model has axis = 'x' or 'y'")
        if kind != "plane" and self.contact.solver == "full":
            problems.append("contact.solver: expected 'condensed' but in plane models")
        return problems

    @property
    def passes(self) -> bool:
        """Whether the sliding takes the strip's material past the punch within the model, not out of its plane."""
        return self.model.kind == "solid" or (self.model.kind == "plane" and self.motion.axis != "y")

    def _sliding_problems(self) -> list[str]:
        problems = []
        motion, one_way = self.motion, isinstance(self.motion, OneWay | Rotation)
        least = 1 if one_way else 2
        if self.run.integration == "jump" and self.run.half_cycles < least:
            problems.append("run.half_cycles: expected at least one whole cycle for cycle jumps")
        if self.wear.strip is not None and self.passes and self.contact.law == "gross-sliding":
            problems += self._track_problems()
        if not self.passes and self.model.kind == "plane" and self.heat is not None:
            problems.append("motion.axis: expected 'x' with heat: a plane model does not follow heat out of the plane")
        if self.contact.solver == "full" and (isinstance(self.contact.friction, Dependence) or self.varies):
            problems.append("contact.solver: expected 'condensed' where friction, wear or loads vary")
        if not self.passes and not isinstance(motion, OneWay | Rotation) and (motion.positions or 1) > 1:
            problems.append("motion.positions: expected 1 for sliding out of the plane")
        if self.heat is None:
            given = {"contact.friction": self.contact.friction}
            for body, law in (("punch", self.wear.punch), ("strip", self.wear.strip)):
                given[f"wear.{body}.coefficient"] = None if law is None else law.coefficient
            problems += [
                f"{key}: depends on the temperature T, which a case without the table heat does not know"
                for key, value in given.items()
                if isinstance(value, Dependence) and value.law is None and value.depends_on("T")
            ]
        problems += self._region_problems()
        friction = self.contact.friction
        for body, law in (("punch", self.wear.punch), ("strip", self.wear.strip)):
            if law is not None and law.coefficient is None and law.archard is None and friction == 0:
                problems.append(f"wear.{body}: expected friction where beta or energy gives the coefficient")
        return problems

    def _region_problems(self) -> list[str]:
        """Return what is wrong with coefficients that are given by regions."""
        given = {"contact.friction": (self.contact.friction, self.punch)}
        for name, law, body in (("punch", self.wear.punch, self.punch), ("strip", self.wear.strip, self.strip)):
            given[f"wear.{name}.coefficient"] = (None if law is None else law.coefficient, body)
        problems = []
        for key, (value, body) in given.items():
            if not isinstance(value, Dependence) or value.regions is None:
                continue
            known = ", ".join(body.regions)
            problems += [
                f"{key}.regions.{r}: no such region; known are {known}" for r in value.regions.keys() - body.regions
            ]
            problems += [f"{key}.regions.{r}: missing, but required" for r in body.regions.keys() - value.regions]
        return problems

    def _program_problems(self) -> list[str]:
        """Return what of a program does not go with the motion and the heat."""
        if self.program is None:
            return []
        motion, problems = self.motion, []
        turns = isinstance(motion, Oscillation | Rotation)
        for number, step in enumerate(self.program.steps):
            at = f"program.steps.{number}"
            for key in ("speed", "angular_speed", "amplitude", "angular_frequency", "period"):
                known = key in type(motion).model_fields and not (key == "amplitude" and turns)
                if getattr(step, key) is not None and not known:
                    problems.append(f"{at}.{key}: does not change with motion.kind = '{motion.kind}'")
            if step.distance is not None and turns:
                problems.append(f"{at}.distance: expected cycles or time where the strip turns")
            if step.ambient is not None and self.heat is None:
                problems.append(f"{at}.ambient: expected a case with the table heat")
        if self.contact.solver == "full":
            problems.append("contact.solver: expected 'condensed' with a program")
        if self.run.periodic_within is not None:
            problems.append("run.periodic_within: a program ends with its last step; expected none")
        return problems

    def _track_problems(self) -> list[str]:
        """Return what does not go with wear of a strip that passes under the punch."""
        motion = self.motion
        if isinstance(motion, OneWay) and motion.track is None:
            return ["motion.track: missing, but required where the strip wears in one-way sliding"]
        if not isinstance(motion, OneWay | Rotation) and motion.positions == 1:
            return ["motion.positions: expected 2 or more, since the strip's wear spreads over the stroke"]
        return []

    def _stick_problems(self) -> list[str]:
        """Return what does not go with contact with stick."""
        if self.contact.law == "gross-sliding":
            return [] if self.stick == Stick() else ["stick: expected with contact.law = 'coulomb' only"]
        wrong = {
            "contact.friction: expected a constant": isinstance(self.contact.friction, Dependence),
            "contact.transverse_friction: expected 0": self.contact.transverse_friction != 0,
            "contact.solver: expected 'condensed'": self.contact.solver == "full",
            "model.kind: expected a plane model or a solid": self.model.kind == "axisymmetric",
            "heat: expected none in a solid": self.heat is not None and self.model.kind == "solid",
            "heat.track: expected none": self.heat is not None and self.heat.track is not None,
            "heat.operator: expected 'reduced'": self.heat is not None and self.heat.operator == "full",
            "heat.coupling: expected 'implicit'": self.heat is not None and self.heat.coupling == "split",
            "program: expected none": self.program is not None,
            "motion.kind: expected a motion to and fro": isinstance(self.motion, OneWay | Rotation),
            "motion.axis: expected 'x'": not self.passes,
            "run.integration: expected 'explicit' or 'jump'": self.run.integration == "implicit",
        }
        return [f"{problem} with contact.law = 'coulomb'" for problem, so in wrong.items() if so]

    @property
    def varies(self) -> bool:
        """Whether a coefficient depends on the state, or a load on the time in the cycle."""
        laws = [law.coefficient for law in (self.wear.punch, self.wear.strip) if law is not None]
        loads = [load.over_cycle for body in (self.punch, self.strip) for load in body.loads]
        dependent = any(isinstance(value, Dependence) for value in (self.contact.friction, *laws))
        return dependent or any(table is not None for table in loads)

    def _thermal_problems(self, heat: Heat) -> list[str]:
        needed = ("conductivity", "heat_capacity", "density", "expansion")
        used = {*self.punch.regions.values(), *self.strip.regions.values()} & set(self.materials)
        problems = [
            f"materials.{name}.{key}: missing, but required with heat"
            for name in sorted(used)
            for key in needed
            if getattr(self.materials[name], key) is None
        ]
        if self.contact.solver == "full":
            problems.append("contact.solver: expected 'condensed' with heat")
        if heat.track is not None:
            if not isinstance(self.motion, OneWay | Rotation):
                problems.append("heat.track: expected one-way sliding: to and fro the same material stays")
            if heat.inflow is not None:
                problems.append("heat.inflow: expected none with heat.track, whose bulk comes in")
            if heat.operator != "reduced":
                problems.append("heat.operator: expected 'reduced' with heat.track")
        if heat.conductance_per_pressure is not None and heat.conductance != 0:
            problems.append("heat.conductance: give either conductance or conductance_per_pressure")
        return problems

    @property
    def folder(self) -> Path | None:
        """The folder of the case file, None for a built-in case or one made in Python."""
        return self._folder

    @property
    def written(self) -> Written:
        """How its quantities were written; nothing is known of those of a case made from its parts."""
        return self._written

    def at(self, folder: Path | None, written: Written | None = None) -> Case:
        """Return this case with the folder that its geometry's path starts from, and how it was written."""
        placed = self.model_copy()
        placed._folder = folder
        placed._written = written or self._written
        return placed

    def resolved(self) -> dict[str, Any]:
        """Return every key with its value and unit: what case.toml holds."""
        data = self.model_dump(mode="json", exclude_none=True)
        if self._folder is not None and (self._folder / self.geometry.file).is_file():
            data["geometry"]["file"] = str((self._folder / self.geometry.file).resolve())  # wherever it is read next
        for body, law in (("punch", self.wear.punch), ("strip", self.wear.strip)):
            if law is not None:
                data["wear"][body] = law.resolved(data["wear"][body])
        if self.geometry.follow_wear is None:
            data["geometry"]["follow_wear"] = "never"
        return data

    def to_toml(self) -> str:
        """Return the resolved case as a case file that reads back as the same case."""
        import tomli_w

        return tomli_w.dumps(self.resolved())


def part_models(annotation: Any) -> list[Any]:
    """Return the case models inside a type such as dict[str, Material] or tuple[Load, ...]."""
    if isinstance(annotation, type) and issubclass(annotation, _Part):
        return [annotation]
    return [m for argument in getattr(annotation, "__args__", ()) for m in part_models(argument)]
