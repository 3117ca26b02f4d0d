"""Parts of the tables of a case file: numbers with units, and tables that reject unknown keys.

Every number is held in mm, N, s, K (see `fenwear.common.units`); a case file may give any other unit as a string.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from types import UnionType
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Self, Union, get_args, get_origin

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    model_validator,
)
from pydantic.fields import FieldInfo

from fenwear.common.units import convert, hardness, quantity_text

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
            return {plain_type for part in get_args(kind) for plain_type in plain(part)}
        return {kind}

    return frozenset(plain(part.model_fields[name].annotation) - {type(None)})


class Check(NamedTuple):
    """A condition that rejects a table.

    Attributes:
        wrong: Of the table.
        message: With the values of the table, as in "by: expected {0.fix}".
    """

    wrong: Callable[[Any], object]
    message: str


class Part(BaseModel):
    """A table of the case file: unknown keys rejected, values frozen.

    Attributes:
        one_of: Keys of which exactly one is given.
        together: Keys of which all are given, or none.
        checks: Further conditions.
    """

    # Validators are built when a whole case is first read: once, and not once more for each table on the way.
    model_config = ConfigDict(
        defer_build=True, extra="forbid", frozen=True, hide_input_in_errors=True, ser_json_inf_nan="strings"
    )
    one_of: ClassVar[tuple[tuple[str, ...], ...]] = ()
    together: ClassVar[tuple[tuple[str, ...], ...]] = ()
    checks: ClassVar[tuple[Check, ...]] = ()

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

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        namespaces = [vars(kind) for kind in type(self).__mro__]
        for keys in (keys for names in namespaces for keys in names.get("one_of", ())):
            if len(self.present(*keys)) != 1:
                got = " and ".join(self.present(*keys)) or "none"
                raise ValueError(f"give one of {', '.join(keys[:-1])} and {keys[-1]}, got {got}")
        for keys in (keys for names in namespaces for keys in names.get("together", ())):
            given = self.present(*keys)
            missing = [key for key in keys if key not in given]
            if given and missing:
                raise ValueError(f"{missing[0]}: expected together with {' and '.join(given)}, and only then")
        for check in (check for names in namespaces for check in names.get("checks", ())):
            if check.wrong(self):
                raise ValueError(check.message.format(self))
        return self

    def present(self, *keys: str) -> list[str]:
        """Return the given keys among these."""
        return [key for key in keys if getattr(self, key) is not None]


def rising(expected: str, *ends: float) -> AfterValidator:
    """Return pydantic metadata: at least two pairs whose first numbers rise, from one end to the other if given."""

    def check(pairs: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
        numbers = [number for number, _ in pairs]
        rises = len(numbers) > 1 and all(a < b for a, b in pairwise(numbers))
        if not rises or (ends and (numbers[0], numbers[-1]) != ends):
            raise ValueError(f"expected {expected}")
        return pairs

    return AfterValidator(check)


Pairs = tuple[tuple[Number, Number], ...]
OverCycle = Annotated[Pairs, rising("pairs [fraction, factor] with fractions that rise from 0 to 1", 0, 1)]
