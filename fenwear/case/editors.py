"""The JSON schema of case files, by which editors complete keys, explain them, and mark what is wrong."""

from __future__ import annotations

from typing import Any

from fenwear.case.keys import READ_FIRST
from fenwear.case.quantities import UNIT
from fenwear.case.schema import Case

LIMITS = {"ge": "minimum", "gt": "exclusiveMinimum", "le": "maximum", "lt": "exclusiveMaximum"}
SCALARS = ("number", "integer", "string")


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of a case file; what is missing may stand in the base."""
    schema = _explained(_for_parts(Case.model_json_schema(mode="validation")))
    unset = {"type": "array", "items": {"type": "string"}, "description": READ_FIRST["unset"].meaning}
    schema["properties"] = {"base": _text("base"), "unset": unset, **schema["properties"]}
    for table, path in (("Program", "program.file"), ("Profile", "BODY.profile.file"), ("Cycle", "motion.file")):
        schema["$defs"][table]["properties"]["file"] = _text(path)
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


def _explained(node: Any) -> Any:
    """Return a schema that editors complete once for each key, with its meaning, unit, default and limits.

    They look for these in the alternatives of a key, not beside them; a file in TOML knows no null.
    """
    if isinstance(node, list):
        return [_explained(entry) for entry in node]
    if not isinstance(node, dict):
        return node
    if "description" in node and (unit := _unit(node)):
        node = {**node, "description": f"{node['description']}; in {unit} where it has no unit"}
    left_out = {UNIT} | ({"default"} if isinstance(node.get("default"), dict | None) else set())
    said = {LIMITS.get(k, k): _explained(v) for k, v in node.items() if k not in left_out}
    union = next((k for k in ("anyOf", "oneOf") if k in said), None)
    return said if union is None or "if" in said or {} in said[union] else _merged(said, union)


def _unit(node: Any) -> str:
    """Return the unit of the numbers that stand for a key, which its alternatives and entries have."""
    if isinstance(node, list):
        return next((unit for entry in node if (unit := _unit(entry))), "")
    if not isinstance(node, dict):
        return ""
    below = (node.get(k) for k in ("anyOf", "oneOf", "items", "prefixItems"))
    return str(node.get(UNIT) or next((unit for entry in below if (unit := _unit(entry))), ""))


def _merged(node: dict[str, Any], union: str) -> dict[str, Any]:
    """Return a schema with alternatives: a number or a text are one, and what is said of all is said of each."""
    about = {k: v for k, v in node.items() if k != union}
    flat = [part for entry in node[union] for part in (entry["anyOf"] if set(entry) == {"anyOf"} else [entry])]
    kept = [part for part in flat if part != {"type": "null"}]
    plain = [part for part in kept if part.get("type") in SCALARS or isinstance(part.get("type"), list)]
    if len(plain) > 1:
        types = [t for part in plain for t in (part["type"] if isinstance(part["type"], list) else [part["type"]])]
        limits = {k: v for part in plain for k, v in part.items() if k in LIMITS.values()}
        kept = [{"type": list(dict.fromkeys(types)), **limits}, *(part for part in kept if part not in plain)]
    if len(kept) == 1:
        return {**about, **kept[0]}
    return {"anyOf": [{**about, **part} for part in kept]}
