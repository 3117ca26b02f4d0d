"""The validated description of a problem: one typed object, from a TOML file or from Python.

Every number is held in mm, N, s, K (see `fenwear.units`); a case file may give any other unit as a
string. Nothing here knows of meshes or solvers: what only the geometry can tell (whether a group
exists, whether a pin is on the punch) is checked where the geometry is read, and reported with the
same keys.
"""

from __future__ import annotations

import difflib
import math
import tomllib
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

import pydantic
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, PlainSerializer, model_validator

from fenwear.errors import CaseError, Problem
from fenwear.units import convert, quantity_text


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
        default=1e-4, description="of the reduced operator's basis, relative"
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

    def changed(self, *settings: str) -> Case:
        """Return the case with overrides `key.path=value`, as of `load_case`.

        Raises:
            CaseError: an override does not fit.
        """
        data = self.resolved()
        for setting in settings:
            _apply(data, setting)
        return make_case(data, self._folder)

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


def builtin_cases() -> dict[str, str]:
    """Return the names of the built-in cases with their titles."""
    folder = resources.files("fenwear") / "cases"
    files = {f.name.removesuffix(".toml"): f for f in folder.iterdir() if f.name.endswith(".toml")}
    return {name: tomllib.loads(files[name].read_text("utf-8"))["title"] for name in sorted(files)}


def load_case(source: str | Path, settings: Sequence[str] = ()) -> Case:
    """Read a case file, or a built-in case by its name.

    Args:
        source: Path of a TOML file, or one of `builtin_cases()`.
        settings: Overrides `key.path=value`, the value in TOML notation (a bare word is a string).

    Raises:
        CaseError: the file cannot be read, or anything in it is wrong; lists all problems.
    """
    data, folder = _read_tables(str(source))
    for setting in settings:
        _apply(data, setting)
    return make_case(data, folder)


def _read_tables(source: str, base_of: tuple[str, ...] = ()) -> tuple[dict[str, Any], Path | None]:
    """Return the tables of a case, laid over those of the case it names as its base, and its folder."""
    path = Path(source)
    if path.suffix != ".toml" and not path.exists():
        if source not in builtin_cases():
            known = ", ".join(builtin_cases())
            raise CaseError(Problem(source, f"no such case file, nor a built-in case ({known})"))
        text, folder = (resources.files("fenwear") / "cases" / f"{source}.toml").read_text("utf-8"), None
    else:
        text, folder = _read_text(path), path.parent
    try:
        data = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise CaseError(Problem(source, f"not a TOML file: {error}")) from None
    base = data.pop("base", None)
    if base is None:
        return data, folder
    if not isinstance(base, str):
        raise CaseError(Problem("base", f"expected the name of a case, got {base!r}"))
    if base in base_of or len(base_of) > 8:
        raise CaseError(Problem("base", f"{base!r} has itself as its base"))
    if folder is not None and base.endswith(".toml"):
        base = str(folder / base)
    below, base_folder = _read_tables(base, (*base_of, base))
    own_geometry = "file" in data.get("geometry", {})
    return _laid_over(below, data), folder if own_geometry or base_folder is None else base_folder


def _laid_over(below: Any, above: Any) -> Any:
    """Return nested tables, those `above` before those `below`; one that states its kind stands alone."""
    if not (isinstance(below, dict) and isinstance(above, dict)) or "kind" in above:
        return above
    return {**below, **{key: _laid_over(below.get(key), value) for key, value in above.items()}}


def make_case(data: Mapping[str, Any], folder: Path | None = None) -> Case:
    """Validate `data`, nested as in a case file.

    Raises:
        CaseError: lists every unknown key, wrong unit and impossible value.
    """
    try:
        return Case.model_validate(data).at(folder)
    except pydantic.ValidationError as error:
        raise CaseError([p for e in error.errors() for p in _problems(e)]) from None


def _read_text(path: Path) -> str:
    try:
        return path.read_bytes().decode("utf-8")
    except UnicodeDecodeError as error:
        raise CaseError(Problem(str(path), f"not a UTF-8 text (byte {error.start})")) from None
    except OSError as error:
        raise CaseError(Problem(str(path), f"cannot be read: {error.strerror}")) from None


def _apply(data: dict[str, Any], setting: str) -> None:
    """Set one `key.path=value` in the nested tables of `data`."""
    key, equals, text = setting.partition("=")
    names = [name.strip() for name in key.split(".")]
    if not equals or not all(names):
        raise CaseError(Problem("--set", f"expected key.path=value, got {setting!r}"))
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        value = text.strip()
    place: Any = data
    for name in names[:-1]:
        place = _step(place, name, setting)
    if isinstance(place, list):
        _step(place, names[-1], setting)
        place[int(names[-1])] = value
    else:
        place[names[-1]] = value


def _step(place: Any, name: str, setting: str) -> Any:
    if isinstance(place, list) and name.isdigit() and int(name) < len(place):
        return place[int(name)]
    if isinstance(place, dict):
        return place.setdefault(name, {})
    raise CaseError(Problem("--set", f"{setting!r} reaches into {name!r}, which is not a table"))


def _problems(error: Any) -> list[Problem]:  # noqa: PLR0911
    """Turn one pydantic error into problems with the key's path as in the case file."""
    union_tags = ("reciprocating", "one-way")
    key = ".".join(str(step) for step in error["loc"] if step not in union_tags)
    message = str(error["msg"]).removeprefix("Value error, ").removeprefix("Input should be ")
    match error["type"]:
        case "extra_forbidden":
            return [Problem(key, f"unknown key{_suggestion(error['loc'])}")]
        case "missing":
            return [Problem(key, "missing, but required")]
        case "union_tag_not_found" | "union_tag_invalid":
            return [Problem(f"{key}.kind", f"expected one of {', '.join(union_tags)}")]
        case "value_error" if key and ": " in message and message.split(":")[0].isidentifier():
            name, _, rest = message.partition(": ")
            return [Problem(f"{key}.{name}", rest)]
        case "value_error" if not key:
            return [Problem(*line.split(": ", 1)) for line in message.splitlines()]
        case "value_error":
            return [Problem(key, message)]
    return [Problem(key, f"expected {message[:1].lower()}{message[1:]}")]


def _suggestion(location: tuple[str | int, ...]) -> str:
    """Return "; did you mean ...?" for a misspelt key, or the keys that are known there."""
    model: Any = Case
    for step in location[:-1]:
        field = getattr(model, "model_fields", {}).get(step)
        models = _models_in(field.annotation if field else model)
        model = next((m for m in models if getattr(m, "model_fields", {}).get("kind") is None), None) or (
            models[0] if models else None
        )
        if isinstance(step, str) and len(models) > 1:
            model = None
    names = list(getattr(model, "model_fields", {}))
    close = difflib.get_close_matches(str(location[-1]), names, n=1)
    if close:
        return f"; did you mean {close[0]!r}?"
    return f"; known here are {', '.join(names)}" if names else ""


def _models_in(annotation: Any) -> list[Any]:
    """Return the case models inside a type such as dict[str, Material] or tuple[Load, ...]."""
    if isinstance(annotation, type) and issubclass(annotation, _Part):
        return [annotation]
    return [m for argument in getattr(annotation, "__args__", ()) for m in _models_in(argument)]
