"""Reading cases: files, bases, overrides, and problems named by their keys."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import pydantic

from fenwear.case.schema import (
    Case,
    Dependence,
    OneWay,
    Oscillation,
    Reciprocating,
    Rotation,
    Tabulated,
    part_models,
)
from fenwear.errors import CaseError, Problem

MOTIONS: dict[str | int, type] = {
    "reciprocating": Reciprocating,
    "one-way": OneWay,
    "table": Tabulated,
    "rotation": Rotation,
    "oscillation": Oscillation,
}

FORMS = {*MOTIONS, "number", "dependence"}  # what pydantic puts into a path besides keys


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
    """Return nested tables, those `above` before those `below`; one that names its kind or file stands alone."""
    if (
        not (isinstance(below, dict) and isinstance(above, dict))
        or {"kind", "file", "beta", "archard", "energy"} & above.keys()
    ):
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
    key = ".".join(str(step) for step in error["loc"] if step not in FORMS)
    message = str(error["msg"]).removeprefix("Value error, ").removeprefix("Input should be ")
    match error["type"]:
        case "extra_forbidden":
            return [Problem(key, f"unknown key{_suggestion(error['loc'])}")]
        case "missing":
            return [Problem(key, "missing, but required")]
        case "union_tag_not_found" | "union_tag_invalid":
            return [Problem(f"{key}.kind", f"expected one of {', '.join(map(str, MOTIONS))}")]
        case "value_error" if key and ": " in message and message.split(":")[0].isidentifier():
            name, _, rest = message.partition(": ")
            return [Problem(f"{key}.{name}", rest)]
        case "value_error" if not key:
            return [Problem(*line.split(": ", 1)) for line in message.splitlines()]
        case "value_error":
            return [Problem(key, message)]
    got = f", got {error['input']!r}" if isinstance(error["input"], str | int | float) else ""
    return [Problem(key, f"expected {message[:1].lower()}{message[1:]}{got}")]


def _suggestion(location: tuple[str | int, ...]) -> str:
    """Return "; did you mean ...?" for a misspelt key, or the keys that are known there."""
    model: Any = Case
    for step in location[:-1]:  # names and numbers of entries are no fields: they stay at the same table
        field = getattr(model, "model_fields", {}).get(step)
        if step in MOTIONS:
            model = MOTIONS[step]
        elif step == "dependence":
            model = Dependence
        elif field is not None:
            model = next(iter(part_models(field.annotation)), None)
    names = list(getattr(model, "model_fields", {}))
    close = difflib.get_close_matches(str(location[-1]), names, n=1)
    if close:
        return f"; did you mean {close[0]!r}?"
    return f"; known here are {', '.join(names)}" if names else ""


def changed_case(case: Case, *settings: str) -> Case:
    """Return the case with overrides `key.path=value`, as of `load_case`.

    Raises:
        CaseError: an override does not fit.
    """
    data = case.resolved()
    for setting in settings:
        _apply(data, setting)
    return make_case(data, case.folder)
