"""Files of other programs by the ends of their names: which reader takes which, and what a file holds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from fenwear.common.errors import CaseError, InputError
from fenwear.common.table_files import TableError, read_table
from fenwear.files import by_gmsh, mesh_formats
from fenwear.files.by_gmsh import gmsh_model
from fenwear.files.cad import entities, entities_text, read_shapes
from fenwear.files.deck import read_deck
from fenwear.files.groups import MEASURES
from fenwear.files.height_maps import MAPS, read_heights
from fenwear.files.mesh_file import ENTITIES, KINDS, MeshFile, read_as, sound

CAD = (".step", ".stp", ".iges", ".igs", ".brep")
READERS: Mapping[str, tuple[str, Callable[[Path], MeshFile]]] = {
    ".inp": ("Abaqus, CalculiX", read_deck),
    ".med": ("Salome", mesh_formats.read_med),
    ".unv": ("I-deas universal", by_gmsh.read),
    ".cgns": ("CGNS", by_gmsh.read),
    ".bdf": ("Nastran", partial(by_gmsh.read, word="property")),
    ".nas": ("Nastran", partial(by_gmsh.read, word="property")),
    ".exo": ("Exodus", mesh_formats.read_exodus),
    ".e": ("Exodus", mesh_formats.read_exodus),
    ".ex2": ("Exodus", mesh_formats.read_exodus),
    ".vtu": ("VTK", mesh_formats.read_vtu),
    ".xdmf": ("XDMF", mesh_formats.read_xdmf),
}
MESHES = tuple(READERS)


def is_foreign(path: Path) -> bool:
    """Return whether a file is the mesh of another program."""
    return path.suffix.lower() in READERS


def read_mesh(path: Path) -> MeshFile:
    """Return the mesh and sets of another program's file.

    Raises:
        CaseError: it cannot be read, or it has no elements of which bodies are made.
        StackError: a package is missing that reads it.
    """
    if not path.is_file():
        raise CaseError(InputError(path.name, "no such file"))
    if path.suffix.lower() not in READERS:
        message = f"expected a name that ends in {', '.join((*MESHES, *CAD))}. Convert it to .msh."
        raise CaseError(InputError(path.name, message))
    kind, read = READERS[path.suffix.lower()]
    with read_as(path, kind):
        return sound(read(path))


TABLES = (".csv", ".txt", ".dat", ".tsv")


def listed_file(path: Path) -> tuple[str, dict[str, Any]]:
    """Return the content of a file, as lines and as an object of JSON.

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
        content = {
            "file": path.name, "kind": "table", "columns": columns, "rows": len(table.rows),
            "encoding": table.encoding, "separator": table.separator, "decimal": table.decimal,
            "directives": [{"line": n, "name": name, "value": value} for n, name, value in table.directives],
            "comments": [{"line": n, "text": text} for n, text in table.comments], "left_out": list(table.left_out),
        }  # fmt: skip
        return table.listing(), content
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
    for mesh_set in mesh.sets:
        dim = mesh.set_dim(mesh_set)
        sets.append({
            "name": mesh_set.name, "of": mesh_set.of, "dim": dim, "count": len(mesh_set.members),
            "measure": MEASURES[dim], "size": mesh.measure(mesh_set), "line": mesh_set.line,
        })  # fmt: skip
    counts = ", ".join(f"{count:,} {name}" for name, count in kinds.items())
    box = " to ".join("(" + ", ".join(f"{x:.6g}" for x in end) + ")" for end in (low, high))
    kind = READERS[path.suffix.lower()][0]
    lines = [f"{path.name} ({kind}): {len(mesh.points):,} nodes, {counts}, {box} in the file's unit"]
    lines += [_set_text(row) for row in sets] or ["no sets: name regions by geometry.groups, facets by planes"]
    content = {"file": path.name, "kind": "mesh", "nodes": len(mesh.points), "elements": kinds, "from": low, "to": high,
             "sets": sets, "notes": list(mesh.notes)}  # fmt: skip
    return "\n".join((*lines, *mesh.notes)), content


def _set_text(row: Mapping[str, Any]) -> str:
    extent = (
        "nodes" if row["of"] == "nodes" else f"{row['of']} ({ENTITIES[row['dim']]}), {row['measure']} {row['size']:.6g}"
    )
    return f"  {row['name']}: {row['count']:,} {extent}" + (f", line {row['line']}" if row["line"] else "")
