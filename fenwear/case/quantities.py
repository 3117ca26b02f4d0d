"""What the tables of a case file are made of: numbers with units, and tables that refuse unknown keys.

Every number is held in mm, N, s, K (see `fenwear.case.units`); a case file may give any other unit as a string.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    model_validator,
)
from pydantic.fields import FieldInfo

from fenwear.case.units import convert, hardness, quantity_text

UNIT = "x-unit"  # where the JSON schema made by pydantic has the unit of a number


@dataclass(frozen=True)
class Unit:
    """The unit of a key's bare numbers; in the JSON schema a text with a unit may stand for the number.

    Attributes:
        symbol: The unit.
        bare: Whether numbers without a unit are allowed.
    """

    symbol: str
    bare: bool = True

    def __get_pydantic_json_schema__(self, core: Any, handler: Any) -> dict[str, Any]:
        """Return the schema of a number with this unit."""
        return {"anyOf": [*([handler(core)] if self.bare else []), {"type": "string"}], UNIT: self.symbol}


def quantity(unit: str) -> Any:
    """Return pydantic metadata: a number read with, and written in, `unit`."""
    return (
        Unit(unit),
        BeforeValidator(lambda value: convert(value, unit)),
        PlainSerializer(lambda value: quantity_text(value, unit)),
    )


def unit_of(field: FieldInfo) -> str:
    """Return the unit of a key's bare numbers; "" where they are pure."""
    return next((m.symbol for m in (*field.metadata, *_metadata(field.annotation)) if isinstance(m, Unit)), "")


def _metadata(annotation: Any) -> Iterator[Any]:
    yield from getattr(annotation, "__metadata__", ())
    for argument in get_args(annotation):
        yield from _metadata(argument)


Length = Annotated[float, *quantity("mm")]
Force = Annotated[float, *quantity("N")]
Stress = Annotated[float, *quantity("MPa")]
Hardness = Annotated[
    float,
    Unit("MPa", bare=False),
    BeforeValidator(hardness),
    PlainSerializer(lambda value: quantity_text(value, "MPa")),
    Field(gt=0),
]
Speed = Annotated[float, *quantity("mm/s")]
Time = Annotated[float, *quantity("s")]
AngularFrequency = Annotated[float, *quantity("rad/s")]
Number = Annotated[float, *quantity("")]
Temperature = Annotated[float, *quantity("K")]
CONDUCTANCE = "N/(mm*s*K)"
Conductance = Annotated[float, *quantity(CONDUCTANCE)]
Angle = Annotated[float, *quantity("rad")]
Axis = Literal["x", "y", "z"]
Vector = tuple[Number, Number, Number]
Kind = Literal["stress", "strain", "axisymmetric", "solid"]  # of a model: what tells strains and rigid modes
# With as many components as the model has axes.
Point = Annotated[tuple[Length, ...], Field(min_length=2, max_length=3)]
Forces = Annotated[tuple[Force, ...], Field(min_length=2, max_length=3)]
Moments = Annotated[tuple[Annotated[float, *quantity("N*mm")], ...], Field(min_length=1, max_length=3)]
Stresses = Annotated[tuple[Stress, ...], Field(min_length=2, max_length=3)]


@cache
def _kinds(part: type[BaseModel], name: str) -> frozenset[object]:
    """Return the plain types that a key takes, without None."""

    def plain(kind: object) -> set[object]:
        if get_origin(kind) is Annotated:
            return plain(get_args(kind)[0])
        if get_origin(kind) in (Union, UnionType):
            return {one for part in get_args(kind) for one in plain(part)}
        return {kind}

    return frozenset(plain(part.model_fields[name].annotation) - {type(None)})


class Part(BaseModel):
    """A table of the case file: unknown keys refused, values frozen."""

    # Validators are built when a whole case is first read: once, and not once more for each table on the way.
    model_config = ConfigDict(
        defer_build=True, extra="forbid", frozen=True, hide_input_in_errors=True, ser_json_inf_nan="strings"
    )

    @model_validator(mode="before")
    @classmethod
    def _as_in_the_schema(cls, data: object) -> object:
        """Take whole numbers with a point and no words for true, as the JSON schema does."""
        if not isinstance(data, Mapping):
            return data
        changed = dict[str, object]()
        for name, value in data.items():
            kinds = _kinds(cls, name) if isinstance(value, str | int | float) and name in cls.model_fields else None
            if kinds == frozenset({bool}) and not isinstance(value, bool):
                raise ValueError(f"{name}: expected true or false, got {value!r}")
            if isinstance(value, float) and value.is_integer() and kinds and int in kinds and float not in kinds:
                changed[name] = int(value)
        return {**data, **changed} if changed else data
