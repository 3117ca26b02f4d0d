"""What a file of another program holds, for people and as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fenwear.errors import CaseError, InputError
from fenwear.files.cad import entities, entities_text, read_shapes
from fenwear.files.formats import CAD, MESHES, READERS, read_mesh
from fenwear.files.groups import ENTITIES, MEASURES
from fenwear.files.heights import MAPS, read_heights
from fenwear.files.mesh import KINDS
from fenwear.files.session import gmsh_model
from fenwear.files.table import TableError, read_table

TABLES = (".csv", ".txt", ".dat", ".tsv")


def listed_file(path: Path) -> tuple[str, dict[str, Any]]:
    """Return what a file holds, as lines and as an object of JSON.

    Raises:
        CaseError: it cannot be read, or is of no known kind.
    """
    suffix = path.suffix.lower()
    if not path.is_file():
        raise CaseError(InputError(str(path), "no such file"))
    if suffix in MESHES:
        return _mesh(path)
    if suffix in CAD:
        with gmsh_model() as gmsh:
            read_shapes(gmsh, path, 1.0)
            rows = entities(gmsh)
        return entities_text(rows), {"file": path.name, "kind": "shapes", "parts": rows}
    if suffix in TABLES:
        try:
            table = read_table(path, ())
        except TableError as error:
            raise CaseError(InputError(str(path), str(error))) from None
        columns = [{"name": head.name, "unit": head.unit} for head in table.heads]
        found = {
            "file": path.name, "kind": "table", "columns": columns, "rows": len(table.rows),
            "encoding": table.encoding, "separator": table.separator, "decimal": table.decimal,
            "directives": [{"line": n, "name": name, "value": value} for n, name, value in table.directives],
            "left_out": list(table.left_out),
        }  # fmt: skip
        return table.listing(), found
    if suffix in MAPS:
        heights = read_heights(path)
        return heights.text(), {"file": path.name, "kind": "heights", **heights.numbers()}
    known = ", ".join((*MESHES, *CAD, *TABLES, *MAPS))
    raise CaseError(InputError(str(path), f"expected a file that ends in {known}"))


def _mesh(path: Path) -> tuple[str, dict[str, Any]]:
    mesh = read_mesh(path)
    kinds: dict[str, int] = {}
    for block in mesh.blocks:
        kinds[KINDS[block.kind].name] = kinds.get(KINDS[block.kind].name, 0) + len(block.nodes)
    low, high = (end(mesh.points, axis=0).tolist() for end in (np.min, np.max))
    sets = []
    for one in mesh.sets:
        dim = mesh.set_dim(one)
        sets.append({
            "name": one.name, "of": one.of, "dim": dim, "count": len(one.members), "measure": MEASURES[dim],
            "size": mesh.measure(one), "line": one.line,
        })  # fmt: skip
    counts = ", ".join(f"{count:,} {name}" for name, count in kinds.items())
    box = " to ".join("(" + ", ".join(f"{x:.6g}" for x in end) + ")" for end in (low, high))
    kind = READERS[path.suffix.lower()][0]
    lines = [f"{path.name} ({kind}): {len(mesh.points):,} nodes, {counts}, {box} in the file's unit"]
    lines += [_set_text(one) for one in sets] or ["no sets: name regions by geometry.groups, facets by planes"]
    found = {"file": path.name, "kind": "mesh", "nodes": len(mesh.points), "elements": kinds, "from": low, "to": high,
             "sets": sets, "notes": list(mesh.notes)}  # fmt: skip
    return "\n".join((*lines, *mesh.notes)), found


def _set_text(one: Mapping[str, Any]) -> str:
    what = (
        "nodes" if one["of"] == "nodes" else f"{one['of']} ({ENTITIES[one['dim']]}), {one['measure']} {one['size']:.6g}"
    )
    return f"  {one['name']}: {one['count']:,} {what}" + (f", line {one['line']}" if one["line"] else "")
