"""The server for other programs: its tools are commands, and their errors name keys."""

from __future__ import annotations

import asyncio
import importlib.util
import json
from pathlib import Path
from typing import Any

import pytest

from fenwear import CaseError, load_case
from fenwear.case.keys import json_schema
from fenwear.cli import agents
from fenwear.common.errors import StackError

pytestmark = pytest.mark.process


def call(tool: Any, *arguments: Any, **keys: Any) -> Any:
    return json.loads(asyncio.run(tool(*arguments, **keys)))


def test_a_case_by_name_by_path_and_as_text(tmp_path: Path) -> None:
    """All give the same answer; warnings and messages are apart."""
    small = ["geometry.degree=1"]
    by_name = call(agents.check, "example2", small)
    assert by_name["valid"]
    assert any("contact nodes" in line for line in by_name["messages"])
    assert call(agents.check, 'base = "example2"\n[geometry]\ndegree = 1\n') == by_name


def test_errors_are_those_of_the_command_by_key() -> None:
    """With the status."""
    with pytest.raises(ValueError, match=r"contact\.friction") as caught:
        call(agents.steady, "example2", ["contact.friction=-1"])
    assert json.loads(str(caught.value))["status"] == 2


def test_info_of_keys_and_files(tmp_path: Path) -> None:
    (tmp_path / "d.csv").write_text("x (mm); depth (um)\n0; 1,5\n1; 2\n")
    assert call(agents.info, str(tmp_path / "d.csv"))["decimal"] == "decimal commas"
    assert call(agents.info, "geometry.unit")["keys"][0]["path"] == "geometry.unit"


def test_a_server_lists_its_tools() -> None:
    """Where the package mcp is; else an error says how to get it."""
    if importlib.util.find_spec("mcp") is None:
        with pytest.raises(StackError, match=r"fenwear\[agents\]"):
            agents.make_server()
        return
    server = agents.make_server()
    names = {tool.name for tool in asyncio.run(server.list_tools())}
    assert names == {"check", "run", "steady", "shape", "life", "info", "figures"}


@pytest.mark.parametrize(
    ("setting", "good"),
    [("run.half_cycles=10.0", True), ("run.half_cycles=10.5", False), ('output.uncertainty="yes"', False),
     ("output.uncertainty=false", True), ("output.uncertainty=1", False), ("geometry.degree=2.0", True)],
)  # fmt: skip
def test_the_schema_and_the_checker_agree(setting: str, good: bool) -> None:
    """On whole numbers with a point, and on words for true."""
    import tomllib

    table, _, rest = setting.partition(".")
    key, _, value = rest.partition("=")
    parsed = tomllib.loads(f"value = {value}")["value"]
    schema = json_schema()
    place = schema["properties"][table]
    place = schema["$defs"][place.get("$ref", place.get("allOf", [{}])[0].get("$ref", "")).rpartition("/")[2]]
    kind = place["properties"][key].get("type")
    fits = {"integer": lambda v: not isinstance(v, bool) and v == int(v), "boolean": lambda v: isinstance(v, bool)}
    assert fits[kind](parsed) == good
    if good:
        load_case("example1", [setting])
    else:
        with pytest.raises(CaseError, match=f"{table}.{key}"):
            load_case("example1", [setting])
