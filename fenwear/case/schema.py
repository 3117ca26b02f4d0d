"""The validated description of a problem: one typed object, from a TOML file or from Python.

Every number is held in mm, N, s, K (see `fenwear.units`); a case file may give any other unit as a
string. Nothing here knows of meshes or solvers: what only the geometry can tell (whether a group
exists, whether a pin is on the punch) is checked where the geometry is read, and reported with the
same keys.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

import pydantic
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, PlainSerializer, model_validator

from fenwear.case.units import convert, quantity_text


def _quantity(unit: str) -> Any:
    """Return pydantic metadata: a number read with, and written in, `unit`."""
    return (
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
Conductance = Annotated[float, *_quantity("N/(mm*s*K)")]
Axis = Literal["x", "z"]


class _Part(BaseModel):
    """A table of the case file: unknown keys refused, values frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True, hide_input_in_errors=True, ser_json_inf_nan="strings")


def _parameter(value: object) -> float:
    """Convert a geometry parameter: a plain number, or a length with its unit."""
    try:
        return convert(value, "mm")
    except ValueError:
        raise ValueError(f"expected a number or a length such as '60 mm', got {value!r}") from None


class Geometry(_Part):
    """Where the meshes come from: a gmsh .geo with its parameters, or a .msh."""

    file: str = "punch_on_strip.geo"
    parameters: dict[str, Annotated[float, BeforeValidator(_parameter)]] = {}
    degree: Annotated[int, Field(ge=1, le=8, strict=True)] = 4


class Model(_Part):
    """The plane model and its thickness."""

    plane: Literal["stress", "strain"] = "stress"
    thickness: Annotated[Length, Field(gt=0)] = 1.0


class Material(_Part):
    """An isotropic, linear-elastic material; the thermal values are needed with heat only."""

    young: Annotated[Stress, Field(gt=0)]
    poisson: Annotated[Number, Field(gt=-1, le=0.5)]
    conductivity: Annotated[float, *_quantity("N/(s*K)"), Field(gt=0)] | None = None
    heat_capacity: Annotated[float, *_quantity("mm^2/(s^2*K)"), Field(gt=0)] | None = None
    density: Annotated[float, *_quantity("N*s^2/mm^4"), Field(gt=0)] | None = None
    expansion: Annotated[float, *_quantity("1/K")] | None = None


class Support(_Part):
    """Displacement components held at zero, on a named group or at a point."""

    on: str | None = None
    at: tuple[Length, Length] | None = None
    fix: Annotated[tuple[Axis, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if (self.on is None) == (self.at is None):
            raise ValueError("give either on = (a group) or at = (a point)")
        return self


class Load(_Part):
    """A load spread evenly over a named group: its resultant, or a traction (x, z)."""

    on: str
    force: tuple[Force, Force] | None = None
    traction: tuple[Stress, Stress] | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        if (self.force is None) == (self.traction is None):
            raise ValueError("give either force or traction")
        return self


class Prescribed(_Part):
    """A temperature held on a named group of the boundary."""

    on: str
    temperature: Temperature = 0.0


class Body(_Part):
    """One body: the material of each of its regions, its supports, loads and held temperatures."""

    regions: Annotated[dict[str, str], Field(min_length=1)]
    supports: tuple[Support, ...] = ()
    loads: tuple[Load, ...] = ()
    temperatures: tuple[Prescribed, ...] = ()
    pivot: tuple[Length, Length] | None = Field(
        default=None, description="the point O of lambda_F and lambda_M; by default the first support's centre"
    )


class Contact(_Part):
    """Unilateral contact with Coulomb friction in gross sliding."""

    friction: Annotated[Number, Field(ge=0)] = 0.0
    solver: Literal["condensed", "full"] = "condensed"


class WearLaw(_Part):
    """Wear rate normal to the surface = coefficient p^b v^a, equation (1)."""

    coefficient: float = Field(description="beta~, in (mm/s) MPa^-b (mm/s)^-a")
    pressure_exponent: Annotated[Number, Field(gt=0)] = 1.0
    speed_exponent: Annotated[Number, Field(gt=0)] = 1.0

    @staticmethod
    def coefficient_unit(pressure_exponent: float, speed_exponent: float) -> str:
        """Return the unit of beta~ for the exponents b and a."""
        unit = f"MPa^-{pressure_exponent:g}"
        return unit if speed_exponent == 1 else f"{unit}*mm^{1 - speed_exponent:g}*s^{speed_exponent - 1:g}"

    @model_validator(mode="before")
    @classmethod
    def _convert_coefficient(cls, data: object) -> object:
        if isinstance(data, Mapping) and "coefficient" in data:
            exponents = (data.get("pressure_exponent", 1.0), data.get("speed_exponent", 1.0))
            if all(isinstance(e, (int, float)) and not isinstance(e, bool) and 0 < e < 100 for e in exponents):
                try:
                    number = convert(data["coefficient"], cls.coefficient_unit(*exponents))
                except ValueError as error:
                    raise ValueError(f"coefficient: {error}") from None
                return {**data, "coefficient": number}
        return data

    @pydantic.field_validator("coefficient")
    @classmethod
    def _not_negative(cls, value: float) -> float:
        if not (math.isfinite(value) and value >= 0):
            raise ValueError("expected a finite number, zero or larger")
        return value


class Wear(_Part):
    """The wear law of each body that wears."""

    punch: WearLaw


class Reciprocating(_Part):
    """Harmonic sliding, v = u0 omega |sin omega t|, equation (10); it starts rightward."""

    kind: Literal["reciprocating"]
    amplitude: Annotated[Length, Field(gt=0)]
    angular_frequency: Annotated[AngularFrequency, Field(gt=0)]
    phases: ClassVar[int] = 2


class OneWay(_Part):
    """Steady sliding in one direction, counted in steps of `duration`."""

    kind: Literal["one-way"]
    direction: Literal["leftward", "rightward"]
    speed: Annotated[Speed, Field(gt=0)]
    duration: Annotated[Time, Field(gt=0)]
    phases: ClassVar[int] = 1


class Heat(_Part):
    """Friction heat and its conduction; without this table a case knows no temperature."""

    partition: Annotated[Number, Field(ge=0, le=1)] = Field(
        default=0.5, description="kappa, the punch's share of the friction heat"
    )
    debris: Annotated[Number, Field(ge=0, lt=1)] = Field(default=0.0, description="gamma_d, carried off by debris")
    conductance: Annotated[Conductance, Field(ge=0)] | Literal["perfect"] = Field(
        default=0.0, description="h_c between punch and strip where they touch"
    )
    conductance_per_pressure: tuple[Annotated[float, *_quantity("N/(mm*s*K*MPa)"), Field(gt=0)], ...] | None = Field(
        default=None, min_length=2, max_length=2, description="h_1, h_2: the conductance is p h_1 h_2 / (h_1 + h_2)"
    )
    conducting: Literal["closed", "nominal"] = Field(
        default="closed", description="the nodes that conduct: those in contact, or the whole nominal interface"
    )
    convection: Annotated[Conductance, Field(ge=0)] = Field(
        default=0.0, description="h on all other boundaries and on the two faces of the plane model"
    )
    convecting_faces: bool = True
    ambient: Temperature = 0.0
    initial: Temperature = 0.0
    steps: Annotated[int, Field(ge=1, le=1000, strict=True)] = Field(default=5, description="in each half-cycle")
    coupling: Literal["implicit", "split"] = "implicit"
    split_tolerance: Annotated[Number, Field(gt=0, lt=1)] = Field(
        default=1e-4, description="change of the gap volume that ends the operator split, equation (30)"
    )
    relaxation: Annotated[Number, Field(gt=0, le=1)] = Field(
        default=0.5, description="of the pressure in the operator split, equation (29)"
    )
    operator: Literal["reduced", "full"] = "reduced"
    # The keys that the operators of the bodies do not depend on.
    exchange_keys: ClassVar[frozenset[str]] = frozenset(
        (
            *("partition", "debris", "conductance", "conductance_per_pressure", "conducting"),
            *("coupling", "split_tolerance", "relaxation"),
        )
    )

    reduction_tolerance: Annotated[Number, Field(gt=0, lt=1)] = Field(
        default=3e-5, description="of the reduced operator's basis, relative"
    )


class Run(_Part):
    """How far a run goes and how it integrates the wear."""

    half_cycles: Annotated[int, Field(ge=1, strict=True)]
    integration: Literal["explicit", "implicit", "jump"] = "explicit"
    jump_tolerance: Annotated[Number, Field(gt=0, le=1)] = Field(
        default=3e-3, description="largest error of pressure in a cycle jump, over the mean pressure"
    )
    periodic_within: Annotated[Number, Field(gt=0)] | None = Field(
        default=None, description="stop when pressure repeats within this fraction of the mean pressure"
    )


class Output(_Part):
    """What a run keeps."""

    every: Annotated[int, Field(ge=1, strict=True)] = Field(
        default=1, description="keep every k-th cycle in history.nc, and always the last one"
    )
    fields_at: tuple[Annotated[int, Field(ge=1, strict=True)], ...] | None = Field(
        default=None, description="half-cycles whose fields are written; by default the last one, () for none"
    )
    checkpoint: Annotated[Time, Field(gt=0)] = Field(default=60.0, description="time between two checkpoints")
    figures_at: tuple[Annotated[int, Field(ge=1, strict=True)], ...] = Field(
        default=(), description="half-cycles that the figures show; by default six spread over the run"
    )


class Case(_Part):
    """A problem: the root of the case file."""

    title: str = ""
    geometry: Geometry = Geometry()
    model: Model = Model()
    materials: Annotated[dict[str, Material], Field(min_length=1)]
    punch: Body
    strip: Body
    contact: Contact = Contact()
    wear: Wear
    motion: Annotated[Reciprocating | OneWay, Field(discriminator="kind")]
    heat: Heat | None = None
    run: Run
    output: Output = Output()

    _folder: Path | None = None  # where the case file lies: its geometry's paths start there

    @model_validator(mode="after")
    def _materials_known(self) -> Self:
        problems = [
            f"{body}.regions.{region}: no material {name!r}; known are {', '.join(sorted(self.materials))}"
            for body, part in (("punch", self.punch), ("strip", self.strip))
            for region, name in part.regions.items()
            if name not in self.materials
        ]
        if self.model.plane == "strain":
            problems += [
                f"materials.{name}.poisson: expected less than 0.5 in plane strain, got {material.poisson:g}"
                for name, material in self.materials.items()
                if material.poisson >= 0.5
            ]
        if self.heat is not None:
            problems += self._thermal_problems(self.heat)
        if self.contact.solver == "full" and self.run.integration != "explicit":
            problems.append("contact.solver: expected 'condensed' for implicit integration and cycle jumps")
        if self.run.integration == "jump" and self.run.half_cycles < self.motion.phases:
            problems.append("run.half_cycles: expected at least one whole cycle for cycle jumps")
        if not any(load.force or load.traction for load in self.punch.loads):
            problems.append("punch.loads: expected at least one load that presses the punch on the strip")
        if problems:
            raise ValueError("\n".join(problems))
        return self

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
        if heat.conductance_per_pressure is not None and heat.conductance != 0:
            problems.append("heat.conductance: give either conductance or conductance_per_pressure")
        return problems

    @property
    def folder(self) -> Path | None:
        """The folder of the case file, None for a built-in case or one made in Python."""
        return self._folder

    def at(self, folder: Path | None) -> Case:
        """Return this case with the folder that its geometry's path starts from."""
        placed = self.model_copy()
        placed._folder = folder
        return placed

    def resolved(self) -> dict[str, Any]:
        """Return every key with its value and unit: what case.toml holds."""
        data = self.model_dump(mode="json", exclude_none=True)
        if self._folder is not None and (self._folder / self.geometry.file).is_file():
            data["geometry"]["file"] = str((self._folder / self.geometry.file).resolve())  # wherever it is read next
        law = self.wear.punch
        data["wear"]["punch"]["coefficient"] = quantity_text(
            law.coefficient, law.coefficient_unit(law.pressure_exponent, law.speed_exponent)
        )
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
