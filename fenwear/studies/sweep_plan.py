"""Keys of a case, the values that a sweep gives them, and its variants in the order in which they share most."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any, Literal

import numpy as np

from fenwear.case import Case, changed_case
from fenwear.common.errors import CaseError, InputError
from fenwear.common.table_files import TableError
from fenwear.common.table_files import read_table as read_rows
from fenwear.studies.numeric_keys import numeric_keys, settings_of, value_of
from fenwear.studies.study import Run, case_text, named
from fenwear.system import Preparation, set_up_by

OPTION = "--over"
MOST_OF_RANGE = 100_000
Value = float | int | bool | str


@dataclass(frozen=True)
class Axis:
    """A key and its values.

    Attributes:
        key: Path, such as contact.friction.
        values: Numbers in the internal unit of the key, or texts as in a case file.
    """

    key: str
    values: tuple[Value, ...]

    def setting(self, value: Value) -> str:
        """Return the override `key.path=value`."""
        return f"{self.key}={str(value).lower() if isinstance(value, bool) else value}"


def make_axis(case: Case, key: str, values: object) -> Axis:
    """Return a key with its values.

    Args:
        case: The case that is varied.
        key: Its path.
        values: A text as behind --over; or numbers, in the internal unit of the key, and texts.

    Raises:
        CaseError: there are no values, or a range is none.
    """
    if isinstance(values, str):
        return parse_axis(case, f"{key}={values}")
    given = values.tolist() if isinstance(values, np.ndarray) else values
    listed = given if isinstance(given, Sequence | range) else [given]
    plain = [value.item() if isinstance(value, np.generic) else value for value in listed]
    if not all(isinstance(value, bool | int | float | str | list | tuple) for value in plain):
        raise CaseError(InputError(f"over {key}", "expected a list of numbers or texts, or a text such as '0.1:0.3:9'"))
    return _axis(key, [json.dumps(value) if isinstance(value, list | tuple) else value for value in plain])


def parse_axis(case: Case, text: str) -> Axis:
    """Return a key with its values from a text.

    Args:
        case: The case that is varied.
        text: KEY=VALUES; values with commas between them, each a value as in a case file or a range
            FIRST:LAST:NUMBER, with :log behind it where their ratio is to be the same.

    Raises:
        CaseError: it is not of this form, or a range is empty.
    """
    key, equals, listed = (part.strip() for part in text.partition("="))
    if not equals or not key:
        raise CaseError(InputError(OPTION, f"expected KEY=VALUES such as contact.friction=0.1:0.3:9, got {text!r}"))
    values: list[Value] = []
    for item in _split(listed):
        if not item:
            raise CaseError(InputError(f"{OPTION} {key}", f"expected values with commas between them, got {listed!r}"))
        values += _range(case, key, item) if ":" in item and item[0] not in "\"'[{" else [item]
    return _axis(key, values)


def _split(text: str) -> list[str]:
    """Return what stands between commas that are in no bracket and no quotation."""
    return [part.strip() for part in re.split(r",(?![^\[{(]*[\]})])(?=(?:[^\"]*\"[^\"]*\")*[^\"]*$)", text)]


def _range(case: Case, key: str, text: str) -> list[Value]:
    """Return the values of FIRST:LAST:NUMBER[:log]."""
    about = f"{OPTION} {key}"
    parts = [part.strip() for part in text.split(":")]
    wrong = InputError(about, f"expected a range FIRST:LAST:NUMBER such as 0.1:0.3:9, or with :log, got {text!r}")
    if len(parts) not in (3, 4) or not all(parts) or parts[3:] not in ([], ["log"]) or not parts[2].isdigit():
        raise CaseError(wrong)
    number = int(parts[2])
    if not 1 <= number <= MOST_OF_RANGE:
        raise CaseError(InputError(about, f"expected 1 to {MOST_OF_RANGE:,} values, got {number:,} in {text!r}"))
    first, last = (_end(case, key, part) for part in parts[:2])
    if (number == 1) != (first == last):
        raise CaseError(InputError(about, f"expected a range that is not empty, got {number} values in {text!r}"))
    if len(parts) == 4 and not (first > 0 and last > 0):
        raise CaseError(InputError(about, f"expected ends above 0 for a range of equal ratios, got {text!r}"))
    values = np.geomspace(first, last, number) if len(parts) == 4 else np.linspace(first, last, number)
    if not isinstance(first, int) or not isinstance(last, int):
        return list(map(float, values))
    if np.abs(values - np.round(values)).max() > 1e-9 * max(abs(first), abs(last)):
        shown = ", ".join(f"{value:g}" for value in values[:4])
        raise CaseError(InputError(about, f"expected a range of whole numbers, got {shown}, ... of {text!r}"))
    return [round(value) for value in values]


def _end(case: Case, key: str, text: str) -> float:
    """Return an end of a range: a whole number where the case has one, else in the key's internal unit."""
    try:
        number = float(text)
    except ValueError:
        return value_of(case, key, text, OPTION)
    if key in numeric_keys(case) or not isinstance(value_at(case, key)[0], int):
        return number
    return int(number) if number.is_integer() else number


def _axis(key: str, values: Sequence[Value]) -> Axis:
    if not values:
        raise CaseError(InputError(f"{OPTION} {key}", "expected one value or more"))
    return Axis(key, tuple(values))


def check_keys(axes: Sequence[Axis]) -> None:
    """Check that no key has two axes.

    Raises:
        CaseError: there is none, or one key has two or holds another one.
    """
    if not axes:
        raise CaseError(InputError(OPTION, "expected one key or more with its values"))
    keys = [axis.key for axis in axes]
    for at, key in enumerate(keys):
        for other in keys[:at]:
            if key == other:
                raise CaseError(InputError(f"{OPTION} {key}", "is given twice; expected all its values in one"))
            if f"{key}.".startswith(f"{other}.") or f"{other}.".startswith(f"{key}."):
                raise CaseError(InputError(f"{OPTION} {key}", f"is given together with {other}, one inside the other"))


def read_table(path: Path) -> list[Axis]:
    """Return the keys and values of a table: a heading of keys, then a variant in each row.

    Args:
        path: A CSV file; values as in a case file, or numbers of the unit that stands in brackets behind the key.

    Raises:
        CaseError: it cannot be read, or rows have another length than the heading.
    """
    try:
        table = read_rows(path, (), keys=True)
    except TableError as error:
        raise CaseError(InputError(str(path), str(error))) from None
    if not table.rows:
        raise CaseError(InputError(str(path), "expected a heading of keys and a row for each variant"))
    heading, units = zip(*(_key_and_unit(head.name) for head in table.heads), strict=True)
    values = [[f"{text} {unit}".strip() for text, unit in zip(row, units, strict=True)] for row in table.rows]
    return [Axis(key, column) for key, column in zip(heading, zip(*values, strict=True), strict=True)]


def _key_and_unit(name: str) -> tuple[str, str]:
    match = re.fullmatch(r"\s*([^\s(\[]+)\s*[(\[](.*)[)\]]\s*", name)
    return (match[1], match[2].strip()) if match else (name.strip(), "")


def settings(case: Case, given: Mapping[str, tuple[Axis, Value]]) -> list[str]:
    """Return the overrides that give keys their values; a wear coefficient keeps its number where an exponent changes.

    Args:
        case: The case that is varied.
        given: Axis and value of each key.
    """
    known = numeric_keys(case)
    numbers = {key: number for key, (_, v) in given.items() if key in known and (number := _number(v)) is not None}
    texts = [axis.setting(value) for key, (axis, value) in given.items() if key not in numbers]
    return [*settings_of(case, numbers), *texts]


def _number(value: Value) -> float | None:
    """Return a value that is a number without a unit."""
    try:
        return None if isinstance(value, bool) else float(value)
    except ValueError:
        return None


def value_at(case: Case, key: str) -> tuple[Value, str]:
    """Return the value of a case at a key, and its unit; "" where it has none."""
    if (number := numeric_keys(case).get(key)) is not None:
        return number.value, number.unit
    place: Any = case.resolved()
    try:
        for name in key.split("."):
            place = place[int(name) if isinstance(place, list) else name]
    except (KeyError, IndexError, TypeError, ValueError):
        return "", ""
    return (place if type(place) is int else str(place)), ""


Of = Literal["steady", "optimum", "run"]
KINDS: tuple[Of, ...] = ("steady", "optimum", "run")
MOST = 10_000  # variants
MOST_TOLD = 10  # problems


@dataclass(frozen=True)
class Variant:
    """One variant of a sweep.

    Attributes:
        place: Its indices in the dimensions of the sweep.
        settings: Its changes, as `key.path=value`.
        case: The case; that which is varied where the values do not go together.
        error: Why they do not; None where they do.
    """

    place: tuple[int, ...]
    settings: tuple[str, ...]
    case: Case
    error: CaseError | None = None

    @property
    def possible(self) -> bool:
        """Whether the values go together."""
        return self.error is None


@dataclass(frozen=True)
class Plan:
    """A sweep.

    Attributes:
        of: Computation for each variant.
        axes: Keys and their values.
        zipped: Whether all axes go together, one variant for each place in them, or each value with each.
        coordinates: Values of each axis as the cases have them, and their unit.
        variants: All of them, the last axis fastest.
    """

    of: Of
    axes: tuple[Axis, ...]
    zipped: bool
    coordinates: tuple[tuple[tuple[Value, ...], str], ...]
    variants: tuple[Variant, ...]

    @property
    def dimensions(self) -> dict[str, int]:
        """Names and sizes of the dimensions of the sweep."""
        if self.zipped:
            return {"variant": len(self.axes[0].values)}
        return {axis.key: len(axis.values) for axis in self.axes}


def make_plan(case: Case, axes: Sequence[Axis], of: str, *, zipped: bool = False) -> Plan:
    """Return the variants of a case.

    Args:
        case: The case that is varied.
        axes: Keys and their values.
        of: Computation for each variant.
        zipped: Whether the first values go together, the second ones, and so on.

    Raises:
        CaseError: no variant can have a value, a key is given twice, there are too many variants, or axes
            that go together have not equally many values.
    """
    check_keys(axes)
    kind = next((known for known in KINDS if known == of), None)
    if kind is None:
        raise CaseError(InputError("--of", f"expected one of {', '.join(KINDS)}, got {of!r}"))
    lengths = [len(axis.values) for axis in axes]
    if zipped and len(set(lengths)) > 1:
        each = ", ".join(f"{axis.key} {len(axis.values)}" for axis in axes)
        raise CaseError(InputError("--zip", f"expected as many values of each key, got {each}"))
    count = lengths[0] if zipped else math.prod(lengths)
    if count > MOST:
        shape = f"{count:,}" if zipped or len(lengths) == 1 else f"{' x '.join(map(str, lengths))} = {count:,}"
        raise CaseError(InputError(OPTION, f"expected at most {MOST:,} variants, got {shape}"))
    places = [(k,) * len(axes) for k in range(count)] if zipped else list(product(*map(range, lengths)))
    variants = [_variant(case, axes, place, zipped=zipped) for place in places]
    _check_values(axes, places, variants, zipped=zipped)
    coordinates = tuple(_coordinate(axis, k, places, variants) for k, axis in enumerate(axes))
    for axis, (values, _) in zip(axes, coordinates, strict=True):
        twice = [] if zipped else [value for at, value in enumerate(values) if value in values[:at]]
        if twice:
            raise CaseError(InputError(f"{OPTION} {axis.key}", f"has the value {twice[0]} twice"))
    return Plan(kind, tuple(axes), zipped, coordinates, tuple(variants))


def _variant(case: Case, axes: Sequence[Axis], place: tuple[int, ...], *, zipped: bool) -> Variant:
    given = {axis.key: (axis, axis.values[at]) for axis, at in zip(axes, place, strict=True)}
    position = place[:1] if zipped else place
    changes = tuple(axis.setting(value) for axis, value in given.values())
    try:
        changed = changed_case(case, *settings(case, given))
    except CaseError as error:
        return Variant(position, changes, case, error)
    return Variant(position, changes, changed)


def _check_values(
    axes: Sequence[Axis], places: Sequence[tuple[int, ...]], variants: Sequence[Variant], *, zipped: bool
) -> None:
    """Raise for every value that no variant can have; values that do not go together fail alone."""
    problems: dict[InputError, None] = {}
    for k, axis in enumerate(axes):
        for at in range(len(axis.values)):
            with_value = [variant for place, variant in zip(places, variants, strict=True) if place[k] == at]
            if with_value[0].error and not any(variant.possible for variant in with_value):
                row = f"variant {at + 1}: " if zipped else ""
                problems |= {InputError(p.key, f"{row}{p.message}"): None for p in with_value[0].error.problems}
    if problems:
        raise CaseError(list(problems)[:MOST_TOLD])


def _coordinate(
    axis: Axis, k: int, places: Sequence[tuple[int, ...]], variants: Sequence[Variant]
) -> tuple[tuple[Value, ...], str]:
    """Return the values of an axis as the cases have them: numbers in one unit, else texts."""
    by_place: dict[int, tuple[Value, str]] = {}
    for place, variant in zip(places, variants, strict=True):
        if variant.possible and place[k] not in by_place:
            by_place[place[k]] = value_at(variant.case, axis.key)
    values, units = zip(*(by_place[at] for at in range(len(axis.values))), strict=True)
    if len(set(units)) == 1 and all(isinstance(value, int | float) for value in values):
        return values, units[0]
    return tuple(map(str, axis.values)), ""


def preparation_for(case: Case, of: Of) -> Preparation:
    """Return how the heat of a variant is prepared."""
    if of == "optimum":
        return "none"
    return "reduced" if of == "steady" or case.run.integration == "jump" else "as set"


def run_of(variant: Variant, of: Of) -> Run:
    """Return the run of a variant, whose name is the same for the same case, whatever it is swept with.

    Variants share the bodies, and with them the steps of their heat.
    """
    case, heat = variant.case, ""
    if case.heat is not None:
        heat = repr((case.motion, case.heat, case.punch.boundary_of_heat, case.strip.boundary_of_heat))
    bodies = repr((preparation_for(case, of), *set_up_by(case)))
    return Run(case, named(of, case_text(case)), ", ".join(variant.settings), (bodies, heat))
