"""Reading cases: files, bases, overrides, and problems in the words of case files: keys, tables, lists, texts."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import Any, get_args

import pydantic

from fenwear.case.body_names import ROLES, Names, by_roles
from fenwear.case.heat_table import Heat
from fenwear.case.keys import all_keys, find_keys
from fenwear.case.motion_table import read_cycle
from fenwear.case.program import check_length, half_cycles_of, read_program
from fenwear.case.removed_keys import replacement
from fenwear.case.schema import MADE, Case, Given, Written, part_models
from fenwear.case.unlikely_values import written
from fenwear.case.wear_table import Dependence
from fenwear.common.csv_table import read_profile
from fenwear.common.errors import CaseError, InputError, did_you_mean
from fenwear.common.units import shown

PLACEHOLDER = 2  # half-cycles, until the program is read
UNSET = "unset"  # the key that takes keys of the base away
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


def builtin_cases() -> dict[str, str]:
    """Return the names of the built-in cases with their titles."""
    folder = resources.files("fenwear") / "cases"
    files = {f.name.removesuffix(".toml"): f for f in folder.iterdir() if f.name.endswith(".toml")}
    return {name: tomllib.loads(files[name].read_text("utf-8"))["title"] for name in sorted(files)}


def load_case(source: str | Path, settings: Sequence[str] = ()) -> Case:
    """Read a case file, or a built-in case by its name.

    Args:
        source: Path of a TOML file, or one of `builtin_cases()`.
        settings: Overrides `key.path=value`, the value in TOML notation (a bare word is a string); `unset=key.path`
            takes a key away. They act in their order.

    Raises:
        CaseError: the file cannot be read, or anything in it is wrong; lists all problems.
    """
    data, folder = _read_tables(str(source))
    geometry, beside = _geometry(data), Path(source).parent
    for setting in settings:
        _apply(data, setting)
    if folder is not None and folder != beside:  # that of a base: files of overrides lie beside the case itself
        data = _anchored(data, beside)
        folder = folder if _geometry(data) == geometry else beside
    return make_case(data, folder)


def _geometry(data: Mapping[str, Any]) -> Any:
    """Return the file of the geometry that tables name, whatever it is; None for none."""
    table = data.get("geometry")
    return table.get("file") if isinstance(table, Mapping) else None


def _read_tables(source: str, base_of: tuple[str, ...] = ()) -> tuple[dict[str, Any], Path | None]:
    """Return the tables of a case, laid over those of the case it names as its base, and its folder."""
    path = Path(source)
    if path.suffix != ".toml" and not path.exists():
        file = resources.files("fenwear") / "cases" / f"{source}.toml"
        if not file.is_file():
            known = ", ".join(builtin_cases())
            hint = did_you_mean(source, builtin_cases()) or "."
            raise CaseError(InputError(source, f"no such case file, nor a built-in case{hint} Built-in cases: {known}"))
        text, folder = file.read_text("utf-8"), None
    else:
        text, folder = _read_text(path), path.parent
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise CaseError(InputError(source, f"not a TOML file: {error}")) from None
    except (MemoryError, RecursionError):
        raise CaseError(InputError(source, "not a TOML file that can be read: it nests too deeply")) from None
    base, unset = data.pop("base", None), data.pop(UNSET, None)
    if base is None:
        if unset is not None:
            raise CaseError(InputError(UNSET, "expected with a base, whose keys it removes"))
        return by_roles(data), folder
    if not isinstance(base, str):
        raise CaseError(InputError("base", f"expected the name of a case, got {shown(base)}"))
    if base in base_of or len(base_of) > 8:
        raise CaseError(InputError("base", f"{base!r} has itself as its base"))
    if folder is not None and base.endswith(".toml"):
        base = str(folder / base)
    below, base_folder = _read_tables(base, (*base_of, base))
    data = by_roles(data, below)
    if "program" in data and isinstance(below.get("run"), dict) and "half_cycles" not in data.get("run", {}):
        below["run"].pop("half_cycles", None)  # the program tells how far the run goes
    _take_away(below, [] if unset is None else unset)
    own_geometry = "file" in data.get("geometry", {})
    below, data = _anchored(below, base_folder), _anchored(data, folder)
    return _laid_over(below, data), folder if own_geometry or base_folder is None else base_folder


def _at_files(data: Any, change: Callable[[str, Mapping[str, Any]], Mapping[str, Any]], key: str = "") -> Any:
    """Return tables of a case with those changed, by their keys, that name a file.

    The geometry's own file is left: ready ones have names without a place.
    """
    if isinstance(data, list | tuple) and any(isinstance(value, Mapping) for value in data):
        return [_at_files(value, change, f"{key}.{number}") for number, value in enumerate(data)]
    if not isinstance(data, Mapping) or key == "geometry":
        return data
    tables = {name: _at_files(value, change, f"{key}.{name}" if key else name) for name, value in data.items()}
    return change(key, tables) if key and "file" in tables else tables


def _anchored(data: dict[str, Any], folder: Path | None) -> dict[str, Any]:
    """Return the tables with their files where they are: beside the case that names them."""

    def beside(_: str, table: Mapping[str, Any]) -> Mapping[str, Any]:
        at = table["file"]
        return {**table, "file": str((folder / at).absolute())} if folder and isinstance(at, str) else table

    return dict(_at_files(data, beside))


# Tables that a CSV file may hold in place of some of their keys, by their names.
IN_FILES: Mapping[str, tuple[tuple[str, ...], Callable[[Path, str], dict[str, Any]]]] = {
    "motion": (("columns", "rows"), read_cycle),
    "program": (("steps",), lambda path, _: {"steps": read_program(path)}),
    "profile": (("points",), read_profile),
}


def _with_files(data: Mapping[str, Any], folder: Path | None) -> dict[str, Any]:
    """Return the tables of a case with the files of its program, cycles and profiles read.

    Raises:
        CaseError: a file cannot be read, or there is besides what it holds.
    """

    def read(key: str, table: Mapping[str, Any]) -> Mapping[str, Any]:
        name = key.rpartition(".")[2]
        if name not in IN_FILES or (name == "motion" and table.get("kind") != "cycle"):
            return table
        (others, reader), file = IN_FILES[name], table["file"]
        if not isinstance(file, str) or any(other in table for other in others):
            message = f"expected the name of a CSV file, and no {' or '.join(others)} beside it"
            raise CaseError(InputError(f"{key}.file", message))
        rest = {name: value for name, value in table.items() if name != "file"}
        return {**rest, **reader((folder or Path()) / file, f"{key}.file")}

    return dict(_at_files(data, read))


def _take_away(data: dict[str, Any], unset: Any) -> None:
    """Take keys out of nested tables.

    Args:
        data: The tables.
        unset: Path of a key, or a list of them.

    Raises:
        CaseError: there is no such key, or it is not given in these tables.
    """
    paths = [unset] if isinstance(unset, str) else unset
    if not isinstance(paths, list) or not all(isinstance(path, str) for path in paths):
        raise CaseError(InputError(UNSET, f"expected a list of keys, such as ['heat.inflow'], got {shown(unset)}"))
    names = Names.of(data)
    for path in paths:
        *tables, last = (name.strip() for name in names.key_by_roles(path).split("."))
        place: Any = data
        for name in tables:
            place = _inside(place, name)
        if isinstance(place, dict) and last in place:
            del place[last]
        elif isinstance(place, list) and _inside(place, last) is not None:
            del place[int(last)]
        else:
            find_keys(path)  # names the nearest where there is none
            raise CaseError(InputError(UNSET, f"the case does not set {path!r}. Leave it out of unset"))


def _inside(place: Any, name: str) -> Any:
    """Return the entry of a table by its name, or of a list by its number; None without one."""
    if isinstance(place, list):
        return place[int(name)] if name.isdigit() and int(name) < len(place) else None
    return place.get(name) if isinstance(place, dict) else None


def _laid_over(below: Any, above: Any) -> Any:
    """Return nested tables, those `above` before those `below`; one that names its kind or file stands alone."""
    if (
        not (isinstance(below, dict) and isinstance(above, dict))
        or {"kind", "file", "archard", "energy", "per_area"} & above.keys()
    ):
        return above
    return {**below, **{key: _laid_over(below.get(key), value) for key, value in above.items()}}


def make_case(
    data: Mapping[str, Any],
    folder: Path | None = None,
    *,
    meshes: Mapping[str, Any] = MappingProxyType({}),
    stresses: Mapping[str, Any] = MappingProxyType({}),
) -> Case:
    """Validate `data`, nested as in a case file.

    Args:
        data: The tables.
        folder: Where paths in it start.
        meshes: Of the bodies by their names, "punch" and "strip" without other ones, as `fenwear.own_mesh` makes them,
            in place of `geometry.file`.
        stresses: Of either, as `fenwear.OwnLaw`, in place of the isotropic stress of its material.

    Raises:
        CaseError: lists every unknown key, wrong unit and impossible value.
    """
    data = by_roles(data)
    names = Names.of(data)
    roles = {name: names.role_of(name) for name in (*meshes, *stresses)}
    on = {roles[name]: mesh if roles[name] == name else mesh.for_role(roles[name]) for name, mesh in meshes.items()}
    with names.names_in_errors():
        return _made(data, folder, Given(on, {roles[name]: law for name, law in stresses.items()}))


def _made(data: Mapping[str, Any], folder: Path | None, given: Given) -> Case:
    """Return the case of tables by roles."""
    data = _on_meshes(data, given)
    data = _with_files(data, folder)
    run = data.get("run", {})
    open_end = isinstance(data.get("program"), Mapping) and isinstance(run, Mapping) and "half_cycles" not in run
    if open_end:
        data["run"] = {**run, "half_cycles": PLACEHOLDER}  # a program tells itself how far a run goes
    try:
        case = Case.model_validate(data)
    except pydantic.ValidationError as error:
        # A list whose entries are wrong counts as too short besides.
        errors = [e for e in error.errors() if e["type"] != "too_short" or e["ctx"]["actual_length"] == len(e["input"])]
        raise CaseError([p for e in errors for p in problems_of(e, data)]) from None
    if open_end:
        case = case.model_copy(update={"run": case.run.model_copy(update={"half_cycles": half_cycles_of(case)})})
    check_length(case)
    return case.on(given).at(folder, written(data, case.tables_by_roles()))


def _on_meshes(data: Mapping[str, Any], given: Given) -> Mapping[str, Any]:
    """Return the tables with a geometry that says that meshes are given."""
    if not given.meshes and not given.stresses:
        return data
    if set(given.meshes) != set(ROLES):
        wanted, known = " and ".join(repr(role) for role in ROLES), ", ".join(sorted(given.meshes)) or "none"
        raise CaseError(InputError("meshes", f"expected one of {wanted} each, got {known}"))
    fixed = {"file": MADE, "parameters": {}, "order": 1, "follow_wear": "never"}
    geometry = data.get("geometry", {})
    wrong = next((key for key, value in fixed.items() if geometry.get(key, value) != value), "")
    if wrong:
        raise CaseError(InputError(f"geometry.{wrong}", "expected none with given meshes, which stay as they are"))
    return {**data, "geometry": {**geometry, **fixed}}


def _read_text(path: Path) -> str:
    try:
        return path.read_bytes().decode("utf-8")
    except UnicodeDecodeError as error:
        raise CaseError(InputError(str(path), f"not a UTF-8 text (byte {error.start})")) from None
    except OSError as error:
        raise CaseError(InputError(str(path), f"cannot be read: {error.strerror}")) from None


def _apply(data: dict[str, Any], setting: str) -> None:
    """Set one `key.path=value` in the nested tables of `data`."""
    key, equals, text = setting.partition("=")
    names = [name.strip() for name in Names.of(data).key_by_roles(key).split(".")]
    if names == [UNSET]:
        _take_away(data, _value(text))
        return
    if not equals or not all(names):
        raise CaseError(InputError("--set", f"expected key.path=value, got {setting!r}"))
    value = _value(text)
    place: Any = data
    for name in names[:-1]:
        place = _step(place, name, setting)
    if isinstance(place, list):
        _step(place, names[-1], setting)
        place[int(names[-1])] = value
    else:
        place[names[-1]] = value


def _value(text: str) -> Any:
    """Return a value in TOML notation; a bare word is a string."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text.strip()


def _step(place: Any, name: str, setting: str) -> Any:
    if isinstance(place, list) and name.isdigit() and int(name) < len(place):
        return place[int(name)]
    if isinstance(place, dict):
        return place.setdefault(name, {})
    raise CaseError(InputError("--set", f"{setting!r} reaches into {name!r}, which is not a table"))


def changed_case(case: Case, *settings: str) -> Case:
    """Return the case with overrides `key.path=value` and `unset=key.path`, as of `load_case`.

    Raises:
        CaseError: an override does not fit.
    """
    data = case.tables_by_roles()
    for setting in settings:
        _apply(data, setting)
    changed = make_case(data, case.folder, meshes=case.given.meshes, stresses=case.given.stresses)
    # quantities are resolved now: how they were written is known of before
    written, before = changed.written, case.written
    as_were = {key: before.united.get(key, text) for key, text in written.united.items()}
    return changed.at(case.folder, Written(written.bare, as_were))


def heat_of(settings: Sequence[str]) -> Heat:
    """Return a table of heat by itself, of settings `heat.key=value`, all else of it by default.

    Raises:
        CaseError: lists every unknown key, wrong unit and impossible value.
    """
    data: dict[str, Any] = {"heat": {}}
    for setting in settings:
        _apply(data, setting)
    try:
        return Heat.model_validate(data["heat"])
    except pydantic.ValidationError as error:
        errors = [{**problem, "loc": ("heat", *problem["loc"])} for problem in error.errors()]
        raise CaseError([p for problem in errors for p in problems_of(problem, data)]) from None


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
            return _problems_with(key, message)
        case kind if kind in EXPECTED:
            return [InputError(key, f"expected {EXPECTED[kind]}{got}")]
    return [InputError(key, f"expected {message[:1].lower()}{message[1:]}{got}")]


def _problems_with(key: str, message: str) -> list[InputError]:
    """Return the problems that a check of the schema reports."""
    if not key:
        return [InputError(*line.split(": ", 1)) for line in message.splitlines()]
    name, colon, rest = message.partition(": ")
    return [InputError(f"{key}.{name}", rest) if colon and name.isidentifier() else InputError(key, message)]


def _entries(how: str, count: int, error: Any) -> str:
    return f"{how} {count} {'entry' if count == 1 else 'entries'}, got {error['ctx']['actual_length']}"


def _nearest(value: object, expected: str) -> str:
    """Return a suggestion for a misspelt word out of those expected, quoted each."""
    return did_you_mean(str(value), expected.split("'")[1::2]) if isinstance(value, str) else ""


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
    if hint := did_you_mean(str(location[-1]), names):
        return hint
    elsewhere = [key.path for key in all_keys() if key.path.endswith(f".{location[-1]}")] if len(location) == 1 else []
    if elsewhere:
        return f"; did you mean {' or '.join(dict.fromkeys(elsewhere[:3]))}?"
    return f"; known here are {', '.join(names)}" if names else ""


def _tables(location: Sequence[str | int]) -> list[Any]:
    """Return the tables that may stand at a place: several where its `kind` is not known yet."""
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
    return {
        get_args(table.model_fields["kind"].annotation)[0]: table for table in tables if "kind" in table.model_fields
    }
