"""The keys of case files, read off the schema: their units, values, defaults and meaning; and the JSON schema.

Editors complete keys by the JSON schema, explain them, and mark what is wrong.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from types import NoneType
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from fenwear.case.body_names import ROLES
from fenwear.case.body_tables import Body
from fenwear.case.schema import Case, part_models
from fenwear.case.table_parts import UNIT, Unit, unit_of
from fenwear.case.wear_table import Dependence, WearLaw
from fenwear.common.errors import CaseError, InputError

LIMITS = {"ge": "minimum", "gt": "exclusiveMinimum", "le": "maximum", "lt": "exclusiveMaximum"}
SCALARS = ("number", "integer", "string")
WORDS = {float: "number", int: "whole number", str: "text", bool: "true or false"}


@dataclass(frozen=True)
class Key:
    """A key of the case file.

    Attributes:
        path: Its tables and its name; NAME stands for a name of yours, N for a number from 0, BODY for punch or strip.
        unit: Of a number without a unit.
        values: Values that it accepts.
        default: Its default; "required" where it has to be, "" where it then does nothing.
        meaning: Its description.
        kind: The kind of motion that it belongs to.
        table: Whether it is a table with keys of its own.
    """

    path: str
    unit: str
    values: str
    default: str
    meaning: str
    kind: str = ""
    table: bool = False

    def text(self) -> str:
        """Return the key in words."""
        unit = f", in {self.unit} where it has no unit" if self.unit else ""
        default = "; required" if self.default == "required" else f"; default {self.default}" if self.default else ""
        kind = f' (kind "{self.kind}")' if self.kind else ""
        return f"{self.path}{kind}: {self.meaning}\n    {self.values}{unit}{default}"


# Keys that name files, in whose place the schema has what they hold.
READ_FIRST = {
    key.path: key
    for key in (
        Key(
            "base",
            "",
            "text",
            "",
            "a built-in case, or a .toml beside this file: its keys hold unless the case sets them",
        ),
        Key("unset", "", "list", "", 'keys of the base to remove: ["heat.inflow", "wear.punch"]'),
        Key("bodies", "", "table", "", "tables of both bodies by their names in contact.between"),
        Key("program.file", "", "text", "", "in place of steps: a CSV file beside this file, a step in each line"),
        Key("motion.file", "", "text", "", "in place of columns and rows: a CSV file beside this file", "cycle"),
        Key("BODY.profile.file", "", "text", "", "in place of points: a CSV file beside this file, one in each line"),
    )
}


def all_keys() -> list[Key]:
    """Return every key of a case file, tables before what is in them."""
    listed = [*(key for key in READ_FIRST.values() if "." not in key.path), *_keys(Case, "", "")]
    for path, key in READ_FIRST.items():
        if "." in path:
            table = next(n for n, other in enumerate(listed) if other.path == path.rpartition(".")[0])
            listed.insert(table + 1, key)
    return listed


def find_keys(path: str) -> list[Key]:
    """Return the key of this path and, where it is a table, those in it.

    Args:
        path: As in a case file or after --set: "motion.amplitude", "materials.steel.young".

    Raises:
        CaseError: there is none; names the nearest.
    """
    keys = all_keys()
    matching = [key for key in keys if _matches(key.path, path)]
    if not matching:
        known = list(dict.fromkeys(key.path for key in keys))
        last = path.rpartition(".")[2]
        same = [key for key in known if key.rpartition(".")[2] == last]
        close = same or difflib.get_close_matches(path, known, 3, 0.5)
        hint = f"; did you mean {' or '.join(close[:3])}?" if close else "; fenwear info KEY explains one key or table"
        raise CaseError(InputError(path, f"no such key{hint}"))
    below = [key for key in keys if any(f.table and key.path.startswith(f"{f.path}.") for f in matching)]
    return [*matching, *below]


def _matches(pattern: str, path: str) -> bool:
    steps, given = pattern.split("."), re.sub(r"^bodies\.[\w-]+", "punch", path).split(".")
    return len(steps) == len(given) and all(
        s in (g, "NAME") or (s == "N" and g.isdigit()) or (s == "BODY" and (g in ROLES or given[0] == "wear"))
        for s, g in zip(steps, given, strict=True)
    )


def _keys(model: type[BaseModel], at: str, kind: str) -> Iterator[Key]:
    seen: set[type] = set()
    for name, field in model.model_fields.items():
        parts = part_models(field.annotation)
        if parts and parts[0] in (Body, WearLaw):  # the same for both bodies
            if parts[0] in seen:
                continue
            seen.add(parts[0])
            about = "the two bodies" if parts[0] is Body else "wear law; a body without one does not wear"
            first, *rest = _below(field, parts, f"{at}BODY", kind)
            yield from (replace(first, meaning=about), *rest)
        else:
            yield from _below(field, parts, at + name, kind)


def _below(field: FieldInfo, parts: list[Any], path: str, kind: str) -> Iterator[Key]:
    listed = _container(field.annotation)
    key = Key(path, unit_of(field), _values(field.annotation), _default(field), field.description or "", kind)
    if Dependence in parts:
        key = replace(key, values="number, or a table of the keys below")
    elif parts:
        key = replace(key, values="list of tables" if listed == ".N" else "table")
    yield replace(key, table=bool(parts))
    for part in parts:
        words = get_args(part.model_fields["kind"].annotation) if "kind" in part.model_fields else ()
        part_kind = str(words[0]) if len(words) == 1 else kind
        yield from _keys(part, f"{path}{listed}.", part_kind)
    if not parts and get_origin(field.annotation) is dict:
        yield replace(key, path=f"{path}.NAME", values=_values(get_args(field.annotation)[1]), default="")


def _container(annotation: Any) -> str:
    """Return the step from a key to those in it: a name of a table, a number of a list, or nothing."""
    origins = {get_origin(a) for a in (annotation, *get_args(annotation))}
    return ".NAME" if dict in origins else ".N" if tuple in origins else ""


def _values(annotation: Any) -> str:
    origin = get_origin(annotation)
    if annotation in WORDS:
        return WORDS[annotation]
    if origin is Literal:
        return ", ".join(f'"{value}"' for value in get_args(annotation))
    if origin is dict:
        return "table"
    if origin is tuple:
        return "list"
    texts = [_values(a) for a in get_args(annotation) if a is not NoneType and not isinstance(a, Unit)]
    return " or ".join(dict.fromkeys(text for text in texts if text))


def _default(field: FieldInfo) -> str:
    if field.default is PydanticUndefined:
        return "required"
    value = field.default
    if value is None or isinstance(value, BaseModel) or value in ("", (), {}):
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, tuple):
        return f"[{', '.join(f'{entry:g}' for entry in value)}]"
    return f'"{value}"' if isinstance(value, str) else f"{value:g}"


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of a case file; what is missing may stand in the base."""
    schema = _explained(_for_parts(Case.model_json_schema(mode="validation")))
    unset = {"type": "array", "items": {"type": "string"}, "description": READ_FIRST["unset"].meaning}
    schema["properties"] = {"base": _text("base"), "unset": unset, **schema["properties"]}
    bodies = {"type": "object", "description": READ_FIRST["bodies"].meaning, "additionalProperties": _REF["Body"]}
    schema["properties"]["bodies"] = bodies
    schema["$defs"]["Wear"]["additionalProperties"] = _REF["WearLaw"]
    for table, path in (("Program", "program.file"), ("Profile", "BODY.profile.file"), ("Cycle", "motion.file")):
        schema["$defs"][table]["properties"]["file"] = _text(path)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


_REF = {name: {"$ref": f"#/$defs/{name}"} for name in ("Body", "WearLaw")}


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
    rejects nothing.
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
