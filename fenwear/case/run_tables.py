"""The tables of the course of a run: how it is set up, how far it goes, the test program, and what is kept."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from fenwear.case.motion_table import Cycle
from fenwear.case.table_parts import AngularFrequency, Check, Force, Length, Number, Part, Speed, Temperature, Time


class Run(Part):
    """Length of a run, and its integration of the wear."""

    half_cycles: Annotated[int, Field(ge=1, strict=True)] = Field(description="largest number of half-cycles")
    integration: Literal["explicit", "implicit", "jump"] = Field(
        default="explicit", description="integration of the wear, explicit or implicit; jump: over many cycles at once"
    )
    jump_tolerance: Annotated[Number, Field(gt=0, le=1)] = Field(
        default=3e-3,
        description="error of one cycle jump: of its depths, and of the place of the contact force, and of "
        "temperatures",
    )
    periodic_within: Annotated[Number, Field(gt=0)] | None = Field(
        default=None,
        description="fraction of its scale within which a repeating pressure ends the run; with a program within its "
        "last step",
    )
    until: str = Field(
        default="",
        description='level that ends the run: "depth 0.1 mm", "depth of both 5 um", "volume of strip 2 mm^3"; "depth '
        'in left 10 um" of a named contact; "approach 0.05 mm" of the bodies',
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


def _either(key: str, other: str) -> Check:
    """Return the check of two keys of which at most one is given."""
    return Check(lambda step: len(step.present(key, other)) > 1, f"{key}: give either {key} or {other}")


def _slides(key: str) -> Check:
    """Return the check of a step with a distance, in which something has to slide."""
    message = f"distance: expected time or cycles: {key} is zero, and nothing slides in this step"
    return Check(lambda step: step.distance and step.present(key) and not any(getattr(step, key)), message)


class ProgramStep(Part):
    """A step of a test program: how long it takes, and what acts in it; [from, to] is a ramp."""

    cycles: Annotated[int, Field(ge=1, strict=True)] | None = Field(
        default=None, description="length of the step in cycles"
    )
    distance: Annotated[Length, Field(gt=0)] | None = Field(default=None, description="or its sliding distance")
    time: Annotated[Time, Field(gt=0)] | None = Field(default=None, description="or its time")
    load: _ramp(Annotated[Force, Field(gt=0)]) = Field(  # type: ignore[valid-type]
        default=None, description="normal force, its mean over a cycle; all loads of the case change in this proportion"
    )
    load_factor: _ramp(Annotated[Number, Field(gt=0)]) = Field(  # type: ignore[valid-type]
        default=None, description="or a factor of all loads of the case"
    )
    load_factors: dict[str, Annotated[Number, Field(gt=0)]] | None = Field(
        default=None,
        description="or factors of single loads of the case, by the group that they act on",
    )
    speed: _ramp(Annotated[Speed, Field(ge=0)]) = Field(  # type: ignore[valid-type]
        default=None, description="speed of one-way sliding; 0: a rest"
    )
    angular_speed: _ramp(Annotated[AngularFrequency, Field(ge=0)]) = Field(  # type: ignore[valid-type]
        default=None, description="angular speed of a rotation; 0: a rest"
    )
    amplitude: _ramp(Annotated[Length, Field(gt=0)]) = Field(  # type: ignore[valid-type]
        default=None, description="amplitude of reciprocating sliding"
    )
    angular_frequency: _ramp(Annotated[AngularFrequency, Field(gt=0)]) = Field(  # type: ignore[valid-type]
        default=None, description="angular frequency of reciprocating sliding or an oscillation"
    )
    period: _ramp(Annotated[Time, Field(gt=0)]) = Field(  # type: ignore[valid-type]
        default=None, description="or the period of a whole cycle"
    )
    motion: Cycle | None = Field(
        default=None,
        description="another table of a cycle from here on, with kind = 'cycle' and its keys",
    )
    ambient: _ramp(Temperature) = Field(  # type: ignore[valid-type]
        default=None, description="temperature of the surroundings, heat.ambient"
    )

    one_of = (("cycles", "distance", "time"),)
    checks = (
        _either("load", "load_factor"),
        _either("load", "load_factors"),
        _either("angular_frequency", "period"),
        _slides("speed"),
        _slides("angular_speed"),
    )

    @property
    def ramps(self) -> list[str]:
        """The keys of what goes from one value to another."""
        values = {key: getattr(self, key) for key in type(self).model_fields}
        return [key for key, value in values.items() if isinstance(value, tuple) and len(set(value)) > 1]


class Program(Part):
    """A test program: steps one after the other. Values that a step does not name stay constant."""

    steps: Annotated[tuple[ProgramStep, ...], Field(min_length=1)] = Field(description="steps in their order")
    radius: Annotated[Length, Field(gt=0)] | None = Field(
        default=None, description="radius of the wear track, for sliding distances where the strip turns"
    )
    levels: Annotated[int, Field(ge=1, le=10000, strict=True)] = Field(
        default=20,
        description="number of levels of a ramp of motion or ambient temperature; loads change continuously",
    )


class Output(Part):
    """Results that a run keeps."""

    every: Annotated[int, Field(ge=1, strict=True)] = Field(
        default=1,
        description="keep every k-th cycle in history.nc, and always the last cycle; with jumps each computed cycle",
    )
    fields_at: tuple[Annotated[int, Field(ge=1, strict=True)], ...] | None = Field(
        default=None, description="half-cycles whose fields are written; by default the last, [] for none"
    )
    checkpoint: Annotated[Time, Field(gt=0)] = Field(default=60.0, description="time between two checkpoints")
    report: bool = Field(default=True, description="draw figures and report.html when the run has ended")
    uncertainty: bool = Field(
        default=True,
        description="estimate the numerical uncertainty of depths, volumes, pressures and temperatures at the end of a "
        "run, from the same run on coarser elements",
    )
    figures_at: tuple[Annotated[int, Field(ge=1, strict=True)], ...] = Field(
        default=(), description="half-cycles that the figures show; by default six spread over the run"
    )


class Setup(Part):
    """By which ranks the bodies are condensed onto the contact; results agree on any of them."""

    reproducible: bool = Field(
        default=False,
        description="results equal to the last bit on any number of ranks: each body is on one rank, so that two work",
    )
