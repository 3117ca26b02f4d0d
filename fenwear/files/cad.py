"""Shapes from CAD (STEP, IGES, BREP), read by OpenCASCADE within gmsh: their parts get names, their meshes sizes.

A part is named as the file names it (the last word of a path such as Shapes/Disc/top), or by its kind and number in
gmsh: "volume 1", "surface 3", "curve 7". Lengths are in mm: OpenCASCADE takes the file's unit from its header.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from fenwear.common.errors import CaseError, InputError, did_you_mean
from fenwear.files.by_gmsh import in_process
from fenwear.files.groups import BODIES, MEASURES, PLANE, POWERS, normal
from fenwear.files.mesh_file import ENTITIES, listed

FLAT = 1e-3  # of its length: how deep a flat shape may be, as OpenCASCADE's boxes are larger than shapes
WORDS = (("vertex",), ("edge",), ("face",), ("solid", "body"))  # what others call points, curves, surfaces, volumes
GROWTH = 0.3  # of the distance from a part with a size: how much larger elements may be there


def entities(gmsh: Any) -> list[dict[str, Any]]:
    """Return a row of each part of the shapes in gmsh's current model: name, type, size and box, mm.

    Of solids they are volumes and surfaces, of flat shapes surfaces and curves.
    """
    top_dim = max((dim for dim, _ in gmsh.model.getEntities()), default=0)
    rows = []
    for dim, tag in sorted(gmsh.model.getEntities(), key=lambda entity: (-entity[0], entity[1])):
        if dim < max(top_dim - 1, 1):
            continue
        box = np.array(gmsh.model.getBoundingBox(dim, tag)).round(6) + 0.0
        rows.append({
            "name": f"{ENTITIES[dim]} {tag}", "label": gmsh.model.getEntityName(dim, tag).rpartition("/")[2],
            "dim": dim, "type": gmsh.model.getType(dim, tag), "measure": MEASURES[dim],
            "size": float(gmsh.model.occ.getMass(dim, tag)), "from": box[:3].tolist(), "to": box[3:].tolist(),
        })  # fmt: skip
    return rows


def entities_text(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return the parts of shapes in lines."""
    lines = []
    for row in rows:
        span = " to ".join("(" + ", ".join(f"{x:g}" for x in row[end]) + ")" for end in ("from", "to"))
        label = f" {row['label']!r}" if row["label"] else ""
        size = f"{row['measure']} {row['size']:.6g} {POWERS[row['dim']]}"
        lines.append(f"{row['name']}{label}: {row['type']}, {size}, {span} mm")
    return "\n".join(lines)


def read_shapes(gmsh: Any, path: Path, scale: float) -> None:
    """Read shapes into gmsh's current model, in mm; of IGES the closed surfaces as solids.

    Raises:
        CaseError: OpenCASCADE cannot read them.
    """
    in_process(path, shapes=True)
    if path.suffix.lower() in (".step", ".stp"):
        gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
    gmsh.option.setNumber("Geometry.OCCImportLabels", 1)
    gmsh.option.setNumber("Geometry.OCCScaling", scale)
    gmsh.option.setNumber("General.AbortOnError", 2)
    try:
        with _quiet():
            shapes = gmsh.model.occ.importShapes(str(path), highestDimOnly=True)
            gmsh.model.occ.synchronize()
            if path.suffix.lower() in (".iges", ".igs") and shapes and _has_depth(gmsh):
                gmsh.model.occ.remove(gmsh.model.occ.getEntities(), recursive=True)
                gmsh.option.setNumber("Geometry.OCCSewFaces", 1)
                gmsh.model.occ.importShapes(str(path), highestDimOnly=True)
                gmsh.model.occ.synchronize()
                shapes = _solids(gmsh)
    except Exception as error:  # gmsh raises bare Exception only
        message = f"cannot be read by OpenCASCADE: {str(error)[:160] or 'no reason given'}. Write the file again."
        raise CaseError(InputError(path.name, message)) from None
    if not shapes:
        raise CaseError(InputError(path.name, "holds no shapes. Export the solids or surfaces of both bodies."))


def _has_depth(gmsh: Any) -> bool:
    """Return whether surfaces without volumes lie in no plane of x and y."""
    box = gmsh.model.getBoundingBox(-1, -1)
    return not gmsh.model.getEntities(3) and box[5] - box[2] > FLAT * (box[3] - box[0])


def _solids(gmsh: Any) -> list[tuple[int, int]]:
    """Make a solid of the surfaces that hang together by their curves, and return the solids."""
    loose = {tag: set(gmsh.model.getAdjacencies(2, tag)[1].tolist()) for _, tag in gmsh.model.getEntities(2)}
    solids = []
    while loose:
        first = min(loose)
        shell, edges = [first], loose.pop(first)
        while near := [tag for tag, curves in loose.items() if curves & edges]:
            for tag in near:
                edges |= loose.pop(tag)
            shell += near
        loop = gmsh.model.occ.addSurfaceLoop(shell, sewing=True)
        solids.append((3, gmsh.model.occ.addVolume([loop])))
    gmsh.model.occ.synchronize()
    return solids


@contextmanager
def _quiet() -> Iterator[None]:
    """Let OpenCASCADE, which prints past gmsh, print nowhere."""
    sys.stdout.flush()
    kept, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)


def name_parts(
    gmsh: Any,
    name: str,
    wanted: Mapping[str, str | Sequence[str]],
    dim: int,
    by_role: Callable[[str], str],
    length: Callable[[str], float],
) -> None:
    """Make physical groups of the parts that have a group's name, or that `wanted` names, by planes too.

    Raises:
        CaseError: a part does not exist, or is in two groups.
    """
    known = _known_parts(gmsh)
    starts = tuple(f"{body}_" for body in BODIES)
    groups = {by_role(key): parts for key, parts in known.items() if by_role(key).startswith(starts)}
    groups = {key: parts for key, parts in groups.items() if key not in wanted}
    problems: list[InputError] = []
    planes: list[tuple[str, str]] = []
    for group, value in wanted.items():
        groups[group] = []
        for text in [value] if isinstance(value, str) else value:
            if text and normal(text) in known:
                groups[group] += known[normal(text)]
            elif text and PLANE.fullmatch(text):
                planes.append((group, text))
            elif text:
                count = ", ".join(f"{len(gmsh.model.getEntities(d))} {ENTITIES[d]}s" for d in range(3, 0, -1))
                hint = did_you_mean(normal(text), known) or "."
                message = f"{name} has no part {text!r}{hint} It has {count}: `fenwear info {name}` lists them."
                problems.append(InputError(f"geometry.groups.{group}", message))
    for group, text in planes:
        body_parts = [
            part for key, parts in groups.items() for part in parts if key.partition("_")[0] == group.partition("_")[0]
        ]
        try:
            sides = _on_plane(gmsh, text, [part for part in body_parts if part[0] == dim], length)
        except ValueError as error:
            problems.append(InputError(f"geometry.groups.{group}", str(error)))
            continue
        groups[group] += sides
        if not sides:
            message = f"{name} has no {ENTITIES[dim - 1]} of this body on the plane {text!r}. Correct the place."
            problems.append(InputError(f"geometry.groups.{group}", message))
    problems += _make_groups(gmsh, groups, dim)
    if problems:
        raise CaseError(problems)


def _known_parts(gmsh: Any) -> dict[str, list[tuple[int, int]]]:
    """Return the parts by their numbers and labels, as names are compared."""
    known: dict[str, list[tuple[int, int]]] = {}
    for dim, tag in gmsh.model.getEntities():
        for word in (ENTITIES[dim], *WORDS[dim]):
            known.setdefault(normal(f"{word} {tag}"), []).append((dim, tag))
        if label := gmsh.model.getEntityName(dim, tag):
            for text in {normal(label), normal(label.rpartition("/")[2])}:
                known.setdefault(text, []).append((dim, tag))
    return known


def _on_plane(
    gmsh: Any, text: str, regions: Sequence[tuple[int, int]], length: Callable[[str], float]
) -> list[tuple[int, int]]:
    """Return the sides of regions that lie on a plane such as "y = 0 mm".

    Raises:
        ValueError: it is no length.
    """
    match = PLANE.fullmatch(text)
    assert match is not None
    at, axis = length(match["at"]), "xyz".index("x" if match["axis"] == "r" else match["axis"])
    box = np.array(gmsh.model.getBoundingBox(-1, -1))
    near = FLAT * float((box[3:] - box[:3]).max())
    sides = []
    for dim, tag in gmsh.model.getBoundary(list(regions), combined=False, oriented=False):
        bounds = np.array(gmsh.model.getBoundingBox(dim, tag))
        if max(abs(bounds[axis] - at), abs(bounds[3 + axis] - at)) <= near:
            sides.append((dim, tag))
    return sides


def _make_groups(gmsh: Any, groups: Mapping[str, list[tuple[int, int]]], dim: int) -> list[InputError]:
    """Make the physical groups; return what is wrong with regions that share a part."""
    problems, owners = [], dict[tuple[int, int], str]()
    for group, parts in groups.items():
        largest = max((d for d, _ in parts), default=0)
        largest_parts = sorted({part for part in parts if part[0] == largest})
        if not largest_parts:
            continue
        for member in largest_parts:
            other = owners.setdefault(member, group)
            if other != group and largest == dim:
                message = f"{ENTITIES[largest]} {member[1]} is in {other} and in {group}. Leave one of them out."
                problems.append(InputError(f"geometry.groups.{group}", message))
        tag = gmsh.model.addPhysicalGroup(largest, [t for _, t in largest_parts])
        gmsh.model.setPhysicalName(largest, tag, group)
    return problems


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
        entities = [int(entity) for entity in gmsh.model.getEntitiesForPhysicalGroup(dim, tag)]
        distance = gmsh.model.mesh.field.add("Distance")
        gmsh.model.mesh.field.setNumbers(
            distance, ("PointsList", "CurvesList", "SurfacesList", "SurfacesList")[dim], entities
        )
        gmsh.model.mesh.field.setNumber(distance, "Sampling", 200)
        grown = gmsh.model.mesh.field.add("MathEval")
        gmsh.model.mesh.field.setString(grown, "F", f"{least:.12g} + {GROWTH} * F{distance}")
        fields.append(grown)
    if fields:
        field_of_least = gmsh.model.mesh.field.add("Min")
        gmsh.model.mesh.field.setNumbers(field_of_least, "FieldsList", fields)
        gmsh.model.mesh.field.setAsBackgroundMesh(field_of_least)


def _usual_size(gmsh: Any) -> float:
    dim = max((d for d, _ in gmsh.model.getEntities()), default=0)
    boxes = [np.array(gmsh.model.getBoundingBox(d, tag)) for d, tag in gmsh.model.getEntities(dim)]
    return min(float((box[3:] - box[:3]).max()) for box in boxes) / 15
