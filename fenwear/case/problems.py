"""What is wrong with a case, in the words of case files: keys as they are written there, tables, lists, texts."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from typing import Any, get_args

from fenwear.case.keys import all_keys
from fenwear.case.laws import Dependence
from fenwear.case.removed import replacement
from fenwear.case.schema import Case, part_models
from fenwear.case.units import shown
from fenwear.errors import InputError

# What was expected, by the kind of an error of pydantic: its own words are those of Python.
EXPECTED = {
    **dict.fromkeys(("model_type", "model_attributes_type", "dict_type", "mapping_type"), "a table"),
    **dict.fromkeys(("tuple_type", "list_type"), "a list"),
    **dict.fromkeys(("string_type", "string_sub_type", "string_unicode"), "a text"),
    **dict.fromkeys(("int_type", "int_from_float", "int_parsing", "int_parsing_size"), "a whole number"),
    **dict.fromkeys(("bool_type", "bool_parsing"), "true or false"),
    **dict.fromkeys(("float_type", "float_parsing"), "a number"),
    "finite_number": "a finite number",
}


def problems_of(error: Any, data: Mapping[str, Any]) -> list[InputError]:  # noqa: PLR0911
    """Turn one error of pydantic into problems with the key's path as in the case file.

    Args:
        error: One of `ValidationError.errors()`.
        data: The tables that were validated.
    """
    key = _key(error["loc"], data, missing=error["type"] == "missing")
    message = str(error["msg"]).removeprefix("Value error, ").removeprefix("Input should be ")
    got = f", got {shown(error['input'])}"
    if error["type"] in ("extra_forbidden", "literal_error"):
        advice = replacement(key, error["input"])
        if advice is not None:
            return [InputError(key, f"removed. {advice}")]
    match error["type"]:
        case "extra_forbidden":
            return [InputError(key, f"unknown key{_suggestion(error['loc'])}")]
        case "missing":
            return [InputError(key, "missing, but required")]
        case "union_tag_not_found" | "union_tag_invalid":
            expected = f"expected one of {', '.join(f'{kind!r}' for kind in _kinds(_tables(error['loc'])))}"
            return [InputError(f"{key}.kind", expected + _nearest(error.get("ctx", {}).get("tag"), expected))]
        case "too_short":
            return [InputError(key, f"expected {_entries('at least', error['ctx']['min_length'], error)}")]
        case "too_long":
            return [InputError(key, f"expected {_entries('at most', error['ctx']['max_length'], error)}")]
        case "literal_error":
            return [InputError(key, f"expected {message}{got}{_nearest(error['input'], message)}")]
        case "value_error":
            return _own_problems(key, message)
        case kind if kind in EXPECTED:
            return [InputError(key, f"expected {EXPECTED[kind]}{got}")]
    return [InputError(key, f"expected {message[:1].lower()}{message[1:]}{got}")]


def _own_problems(key: str, message: str) -> list[InputError]:
    """Return the problems that a check of the schema tells."""
    if not key:
        return [InputError(*line.split(": ", 1)) for line in message.splitlines()]
    name, colon, rest = message.partition(": ")
    return [InputError(f"{key}.{name}", rest) if colon and name.isidentifier() else InputError(key, message)]


def _entries(how: str, count: int, error: Any) -> str:
    return f"{how} {count} {'entry' if count == 1 else 'entries'}, got {error['ctx']['actual_length']}"


def _nearest(value: object, expected: str) -> str:
    """Return a suggestion for a misspelt word out of those expected, quoted each."""
    close = difflib.get_close_matches(str(value), expected.split("'")[1::2], n=1) if isinstance(value, str) else []
    return f"; did you mean {close[0]!r}?" if close else ""


def _key(location: Sequence[str | int], data: object, *, missing: bool) -> str:
    """Return the path of an error: the steps that lead through the tables, not those through the types in between."""
    steps, place = [], data
    for number, step in enumerate(location):
        in_list = isinstance(place, list | tuple) and isinstance(step, int) and step < len(place)
        if in_list or (isinstance(place, Mapping) and step in place):
            place = place[step]  # type: ignore[index]
        elif step in getattr(type(place), "model_fields", {}):
            place = getattr(place, str(step))
        elif not (missing and number == len(location) - 1):
            continue
        steps.append(str(step))
    return ".".join(steps)


def _suggestion(location: tuple[str | int, ...]) -> str:
    """Return "; did you mean ...?" for a misspelt key, or the keys that are known there."""
    names = list(dict.fromkeys(name for table in _tables(location[:-1]) for name in getattr(table, "model_fields", {})))
    close = difflib.get_close_matches(str(location[-1]), names, n=1)
    if close:
        return f"; did you mean {close[0]!r}?"
    elsewhere = [key.path for key in all_keys() if key.path.endswith(f".{location[-1]}")] if len(location) == 1 else []
    if elsewhere:
        return f"; did you mean {' or '.join(dict.fromkeys(elsewhere[:3]))}?"
    return f"; known here are {', '.join(names)}" if names else ""


def _tables(location: Sequence[str | int]) -> list[Any]:
    """Return the tables that may stand at a place: more than one where its `kind` is not told yet."""
    tables: list[Any] = [Case]
    for step in location:  # names and numbers of entries are no fields: they stay at the same table
        fields = [table.model_fields[step] for table in tables if step in getattr(table, "model_fields", {})]
        if step in (kinds := _kinds(tables)):
            tables = [kinds[step]]
        elif step == "dependence":
            tables = [Dependence]
        elif fields:
            tables = part_models(fields[0].annotation)
    return tables


def _kinds(tables: Sequence[Any]) -> dict[str | int, Any]:
    """Return tables by the word that their key `kind` has."""
    return {get_args(one.model_fields["kind"].annotation)[0]: one for one in tables if "kind" in one.model_fields}
