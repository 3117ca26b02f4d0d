"""Shapes from CAD (STEP, IGES, BREP), read by OpenCASCADE within gmsh: their parts get names, their meshes sizes.

A part is named as the file names it (the last word of a path such as Shapes/Disc/top), or by its kind and number in
gmsh: "volume 1", "surface 3", "curve 7". Lengths are in mm: OpenCASCADE takes the file's unit from its header.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fenwear.errors import CaseError, InputError
from fenwear.files.by_gmsh import in_process
from fenwear.files.groups import BODIES, ENTITIES, MEASURES, POWERS, normal
from fenwear.files.mesh import listed

GROWTH = 0.3  # of the distance from a part with a size: how much larger elements may be there


def entities(gmsh: Any, scale: float = 1.0) -> list[dict[str, Any]]:
    """Return a row of each part of the shapes in gmsh's current model: name, type, size and box, mm."""
    rows = []
    for dim, tag in gmsh.model.getEntities():
        if dim == 0:
            continue
        box = scale * np.array(gmsh.model.getBoundingBox(dim, tag))
        rows.append({
            "name": f"{ENTITIES[dim]} {tag}", "label": gmsh.model.getEntityName(dim, tag).rpartition("/")[2],
            "dim": dim, "type": gmsh.model.getType(dim, tag), "measure": MEASURES[dim],
            "size": float(gmsh.model.occ.getMass(dim, tag)) * scale**dim, "from": box[:3].round(6).tolist(),
            "to": box[3:].round(6).tolist(),
        })  # fmt: skip
    return rows


def entities_text(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return the parts of shapes in lines."""
    lines = []
    for row in rows:
        span = " to ".join("(" + ", ".join(f"{x:g}" for x in row[end]) + ")" for end in ("from", "to"))
        label = f" {row['label']!r}" if row["label"] else ""
        lines.append(
            f"{row['name']}{label}: {row['type']}, {row['measure']} {row['size']:.6g} {POWERS[row['dim']]}, {span} mm"
        )
    return "\n".join(lines)


def read_shapes(gmsh: Any, path: str, name: str, scale: float) -> None:
    """Read shapes into gmsh's current model, in mm.

    Raises:
        CaseError: OpenCASCADE cannot read them.
    """
    in_process(Path(path), shapes=True)
    gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
    gmsh.option.setNumber("Geometry.OCCImportLabels", 1)
    gmsh.option.setNumber("General.AbortOnError", 2)
    try:
        shapes = gmsh.model.occ.importShapes(path, highestDimOnly=True)
        gmsh.model.occ.synchronize()
    except Exception as error:  # gmsh raises bare Exception only
        message = f"cannot be read by OpenCASCADE: {str(error)[:160] or 'no reason given'}. Write the file anew."
        raise CaseError(InputError(name, message)) from None
    if not shapes:
        raise CaseError(InputError(name, "holds no shapes. Export the solids or surfaces of both bodies."))
    if scale != 1.0:
        gmsh.model.occ.dilate(shapes, 0, 0, 0, scale, scale, scale)
        gmsh.model.occ.synchronize()


def name_parts(
    gmsh: Any,
    name: str,
    wanted: Mapping[str, str | Sequence[str]],
    dim: int,
    by_role: Callable[[str], str],
) -> None:
    """Make physical groups of the parts that have a group's name, or that `wanted` names.

    Raises:
        CaseError: a part does not exist, or is in two groups.
    """
    known: dict[str, list[tuple[int, int]]] = {}
    for row_dim, tag in gmsh.model.getEntities():
        known.setdefault(normal(f"{ENTITIES[row_dim]} {tag}"), []).append((row_dim, tag))
        if label := gmsh.model.getEntityName(row_dim, tag):
            for text in {normal(label), normal(label.rpartition("/")[2])}:
                known.setdefault(text, []).append((row_dim, tag))
    starts = tuple(f"{body}_" for body in BODIES)
    groups = {by_role(key): parts for key, parts in known.items() if by_role(key).startswith(starts)}
    groups = {key: parts for key, parts in groups.items() if key not in wanted}
    problems, owners = [], dict[tuple[int, int], str]()
    for group, value in wanted.items():
        groups[group] = []
        for text in [value] if isinstance(value, str) else value:
            if text and normal(text) not in known:
                close = difflib.get_close_matches(normal(text), known, n=1)
                hint = f"Did you mean {close[0]!r}? " if close else ""
                count = ", ".join(f"{len(gmsh.model.getEntities(d))} {ENTITIES[d]}s" for d in range(3, 0, -1))
                message = f"{name} has no part {text!r}. {hint}It has {count}: `fenwear info {name}` lists them."
                problems.append(InputError(f"geometry.groups.{group}", message))
            groups[group] += known.get(normal(text), []) if text else []
    for group, parts in groups.items():
        largest = max((d for d, _ in parts), default=0)
        own = sorted({one for one in parts if one[0] == largest})
        if not own:
            continue
        for one in own:
            other = owners.setdefault(one, group)
            if other != group and largest == dim:
                message = f"{ENTITIES[largest]} {one[1]} is in {other} and in {group}. Leave one of them out."
                problems.append(InputError(f"geometry.groups.{group}", message))
        tag = gmsh.model.addPhysicalGroup(largest, [t for _, t in own])
        gmsh.model.setPhysicalName(largest, tag, group)
    if problems:
        raise CaseError(problems)


def set_sizes(gmsh: Any, size: float | None, sizes: Mapping[str, float], names: Mapping[str, tuple[int, int]]) -> None:
    """Say how large elements are: `size` at most, and `sizes` at groups, growing away from them.

    Args:
        gmsh: The module.
        size: mm; by default a fifteenth of the smaller body's longest side.
        sizes: By groups, mm.
        names: Dimension and tag of the physical groups.

    Raises:
        CaseError: a group does not exist.
    """
    unknown = [name for name in sizes if name not in names]
    if unknown:
        message = f"no such group. Name one of {listed(names)}."
        raise CaseError(InputError(f"geometry.sizes.{unknown[0]}", message))
    options = {"Mesh.MeshSizeExtendFromBoundary": 0, "Mesh.MeshSizeFromPoints": 0, "Mesh.MeshSizeFromCurvature": 0}
    for option, value in options.items():
        gmsh.option.setNumber(option, value)
    most = size or _usual_size(gmsh)
    gmsh.option.setNumber("Mesh.MeshSizeMax", most)
    fields = []
    for name, least in sizes.items():
        dim, tag = names[name]
        own = [int(entity) for entity in gmsh.model.getEntitiesForPhysicalGroup(dim, tag)]
        distance = gmsh.model.mesh.field.add("Distance")
        gmsh.model.mesh.field.setNumbers(
            distance, ("PointsList", "CurvesList", "SurfacesList", "SurfacesList")[dim], own
        )
        gmsh.model.mesh.field.setNumber(distance, "Sampling", 200)
        grown = gmsh.model.mesh.field.add("MathEval")
        gmsh.model.mesh.field.setString(grown, "F", f"{least:.12g} + {GROWTH} * F{distance}")
        fields.append(grown)
    if fields:
        whole = gmsh.model.mesh.field.add("Min")
        gmsh.model.mesh.field.setNumbers(whole, "FieldsList", fields)
        gmsh.model.mesh.field.setAsBackgroundMesh(whole)


def _usual_size(gmsh: Any) -> float:
    dim = max((d for d, _ in gmsh.model.getEntities()), default=0)
    boxes = [np.array(gmsh.model.getBoundingBox(d, tag)) for d, tag in gmsh.model.getEntities(dim)]
    return min(float((box[3:] - box[:3]).max()) for box in boxes) / 15
