"""The keys of case files as they are explained: all of them, with the units that they are read in."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from fenwear.case import builtin_cases, load_case
from fenwear.case.keys import all_keys, find_keys, json_schema
from fenwear.case.wear_table import Dependence
from fenwear.common.errors import CaseError
from fenwear.common.units import convert

ROOT = Path(__file__).parents[2]


def _leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the values of nested tables and lists of tables by their paths."""
    tables = value.items() if isinstance(value, dict) else enumerate(value) if _tables(value) else None
    if tables is None:
        yield path, value
        return
    for name, below in tables:
        yield from _leaves(below, f"{path}.{name}".lstrip("."))


def _tables(value: Any) -> bool:
    return isinstance(value, list) and any(isinstance(entry, dict) for entry in value)


def test_every_key_has_a_meaning() -> None:
    """Also those that are added to the schema later."""
    assert [key.path for key in all_keys() if not key.meaning] == []


@pytest.mark.parametrize("name", builtin_cases())
def test_keys_of_cases_are_known_by_their_units(name: str) -> None:
    """Each key of a resolved case is explained, and its values are in the unit that is said."""
    resolved = load_case(name).resolved()
    for path, value in _leaves(resolved):
        key = next(key for key in find_keys(path) if key.kind in ("", resolved["motion"]["kind"]))
        for text in value if isinstance(value, list) else [value]:
            if key.unit and text != "perfect" and not path.startswith("geometry.parameters."):
                assert convert(text, key.unit) == pytest.approx(float(str(text).split()[0]), rel=1e-12)


def test_find_keys() -> None:
    """A key by its path in a file or after --set, a table with what is in it; the nearest of what is not there."""
    assert [key.path for key in find_keys("punch.loads.0.force")] == ["BODY.loads.N.force"]
    assert {"materials", "materials.NAME.young"} <= {key.path for key in find_keys("materials")}
    assert {key.kind for key in find_keys("motion.kind")} >= {"reciprocating", "one-way", "table"}
    for wrong in ("motion.amplitud", "run.amplitude"):
        with pytest.raises(CaseError, match=r"did you mean .*motion\.amplitude"):
            find_keys(wrong)


def test_schema_takes_cases_and_nothing_else() -> None:
    """Every built-in case with and without its units; a misspelt key and a wrong word are no case."""
    jsonschema = pytest.importorskip("jsonschema")
    check = jsonschema.Draft202012Validator(json_schema())
    for name in builtin_cases():
        assert list(check.iter_errors(load_case(name).resolved())) == []
    assert list(check.iter_errors({"base": "example1", "motion": {"kind": "reciprocating", "amplitude": 2}})) == []
    for right in (
        {"motion": {"period": 0.5}},
        {"motion": {"speed": 3}},
        {"program": {"file": "steps.csv", "levels": 5}},
    ):
        assert list(check.iter_errors({"base": "example1", **right})) == []
    for wrong in (
        {"titel": "x"},
        {"model": {"plane": "stres"}},
        {"motion": {"kind": "one-way", "amplitude": 2}},
        {"motion": {"kind": "circular"}},
        {"motion": {"perod": 0.5}},
        {"program": {"fil": "steps.csv"}},
    ):
        assert list(check.iter_errors({"base": "example1", **wrong})) != []
    for low in ({"contact": {"friction": -0.1}}, {"materials": {"steel": {"young": 0}}}, {"motion": {"period": -1}}):
        assert list(check.iter_errors({"base": "example1", **low})) != []
    (error,) = check.iter_errors({"base": "example1", "motion": {"kind": "reciprocating", "amplitud": 2}})
    assert "'amplitud' was unexpected" in error.message  # of the key, not of the table


def test_editors_find_the_meaning_of_every_key() -> None:
    """Where they look, which is in each alternative of a key: its meaning, the unit of a bare number; and no null."""
    schema = json_schema()
    tables = {"": schema["properties"]} | {name: table["properties"] for name, table in schema["$defs"].items()}
    for table, keys in tables.items():
        for name, key in keys.items():
            places = [part for part in key.get("anyOf", [key]) if "$ref" not in part and part]
            assert all(part.get("description") or table == "" for part in places), (table, name)
            assert sum(part.get("type") != "array" for part in places) <= 1, (table, name)
    assert "null" not in json.dumps(schema)
    assert "x-unit" not in json.dumps(schema)
    assert set(tables["Dependence"]) == set(Dependence.model_fields)
    assert tables["Reciprocating"]["amplitude"]["description"].endswith("; in mm where it has no unit")
    assert tables["Support"]["at"]["description"].endswith("; in mm where it has no unit")  # of a list's entries


def test_schema_takes_the_cases_of_the_pages() -> None:
    """Every case that a page shows, but for what it shows to be wrong."""
    jsonschema = pytest.importorskip("jsonschema")
    check, found = jsonschema.Draft202012Validator(json_schema()), 0
    for page in (ROOT / "docs").rglob("*.md"):
        for text in re.findall(r"^```toml\n(.*?)^```$", page.read_text("utf-8"), re.MULTILINE | re.DOTALL):
            case = tomllib.loads(text)
            if page.name != "editor.md":
                assert [f"{page}: {error.message}" for error in check.iter_errors(case)] == []
                found += 1
    assert found > 10


def test_commands(fenwear: Callable[..., Any]) -> None:
    """`info KEY` tells unit and meaning, or the nearest key with status 2; `schema` prints one object."""
    done = fenwear("info", "motion.amplitude")
    assert done.stdout.splitlines()[:2] == [
        'motion.amplitude (kind "reciprocating"): u0, to both sides of the middle',
        "    number, in mm where it has no unit; required",
    ]
    ready = fenwear("info", "geometry.file").stdout
    assert "\n  bushing.geo            A shaft in a bushing, a conformal contact\n" in ready
    assert "    radius = 10   of the shaft\n" in fenwear("info", "bushing.geo").stdout
    assert "\nregions and surfaces: punch_body, punch_contact, punch_far, " in fenwear("info", "blocks.geo").stdout
    wrong = fenwear("info", "motion.amplitud")
    assert (wrong.returncode, "did you mean motion.amplitude" in wrong.stderr) == (2, True)
    assert json.loads(fenwear("schema").stdout) == json_schema()
