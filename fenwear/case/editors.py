"""The JSON schema of case files, by which editors complete keys, explain them, and mark what is wrong."""

from __future__ import annotations

from typing import Any

from fenwear.case.keys import READ_FIRST
from fenwear.case.schema import Case


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of a case file; what is missing may stand in the base."""
    schema = _for_parts(Case.model_json_schema(mode="validation"))
    schema["properties"] = {"base": _text("base"), **schema["properties"]}
    schema["$defs"]["Program"]["properties"]["file"] = _text("program.file")
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def _text(path: str) -> dict[str, str]:
    return {"type": "string", "description": READ_FIRST[path].meaning}


def _for_parts(node: Any) -> Any:
    """Return a schema that takes any part of what it takes as a whole."""
    if isinstance(node, list):
        return [_for_parts(entry) for entry in node]
    if not isinstance(node, dict):
        return node
    parts = {k: _for_parts(v) for k, v in node.items() if not (k == "required" and isinstance(v, list))}
    return _by_kind(parts) if "discriminator" in parts else parts


def _by_kind(node: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a table with a kind: that of its kind, so that the very key that is wrong is marked.

    Without a kind, which the base then has, that of any. Editors find what they complete in the first list, which
    refuses nothing.
    """
    which = node["discriminator"]
    name, kinds = which["propertyName"], which["mapping"]
    any_of = node["oneOf"]
    chosen = [{"if": {"properties": {name: {"const": kind}}}, "then": {"$ref": place}} for kind, place in kinds.items()]
    return {
        **{k: v for k, v in node.items() if k not in ("discriminator", "oneOf")},
        "anyOf": [*any_of, {}],
        "if": {"required": [name]},
        "then": {"properties": {name: {"enum": list(kinds)}}, "allOf": chosen},
        "else": {"anyOf": any_of},
    }
