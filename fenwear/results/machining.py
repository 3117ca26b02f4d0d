"""The files of a shape to machine: its profile, its surface as triangles, and the case of the bodies made with it."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.bodies.contact_surface import ContactSurface
from fenwear.case import Case, make_case
from fenwear.case.csv_table import profile_text
from fenwear.initial_shape import InitialShape
from fenwear.results.disk import write_text, writing
from fenwear.results.history import make_directory, write_case
from fenwear.results.surfaces import surface_cells

PROFILE, SURFACE = "profile.csv", "surface.stl"
AROUND = 360  # facets around a ring
TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])  # of a binary STL


def write_shape(directory: Path, case: Case, shape: InitialShape) -> None:
    """Write profile.csv, surface.stl and case.toml into a new folder; for one rank.

    Args:
        directory: The folder.
        case: That the shape was found for.
        shape: In addition to the profile that the punch's contact surface has already.

    Raises:
        CaseError: the folder is not empty.
        OutputError: it cannot be written.
    """
    make_directory(directory)
    surface = shape.surface
    profile = profile_of(surface, shape.depth)
    write_text(directory / PROFILE, profile_text(case.model.kind, profile))
    thickness = case.model.thickness if case.model.kind == "plane" else 0.0
    write_stl(directory / SURFACE, surface, shape.depth, thickness)
    write_case(directory, with_shape(case, profile))


def profile_of(surface: ContactSurface, depth: Array) -> dict[str, Any]:
    """Return the table of a profile at the nodes, mm: a depth, and all that the surface lies below its mesh already."""
    rows = np.column_stack([surface.places, depth + surface.below_mesh])
    return {"points": rows.tolist(), "along": "x" if surface.arc is None else "arc"}


def with_shape(case: Case, profile: dict[str, Any]) -> Case:
    """Return a case whose punch is made with the table of a profile."""
    tables = case.resolved()
    tables["punch"]["profile"] = profile
    tables["punch"].pop("topography", None)  # which the points have in them
    return make_case(tables, case.folder, meshes=case.given.meshes, stresses=case.given.stresses)


def write_stl(path: Path, surface: ContactSurface, depth: Array, thickness: float) -> None:
    """Write the machined or worn contact surface as a binary STL, mm, its normals out of the body.

    Args:
        path: Of the file.
        surface: Of the punch.
        depth: At its pressure nodes (n,), mm.
        thickness: Of a plane model, along y; 0 for rings, which are turned about z, and solids.
    """
    x, cells = surface.unworn - depth[:, None] * surface.outward, facing_outward(surface)
    if surface.dim == 2:
        turned = np.linspace(0, 2 * np.pi, AROUND + 1)
        rows = (
            [np.column_stack([x[:, 0], np.full(len(x), y), x[:, 1]]) for y in (0.0, thickness)]
            if thickness
            else [np.column_stack([x[:, 0] * np.cos(a), x[:, 0] * np.sin(a), x[:, 1]]) for a in turned]
        )
        pairs = itertools.pairwise(rows)
        quads = [np.stack([a[cells[:, 0]], a[cells[:, 1]], b[cells[:, 1]], b[cells[:, 0]]], axis=1) for a, b in pairs]
        corners = np.concatenate(quads)
    else:
        corners = x[cells]
    parts = [corners[:, [0, 1, 2]]] + ([corners[:, [0, 2, 3]]] if corners.shape[1] == 4 else [])
    triangles = np.zeros(sum(map(len, parts)), dtype=TRIANGLE)
    triangles["corners"] = np.concatenate(parts)
    a, b, c = np.moveaxis(triangles["corners"].astype(float), 1, 0)
    across = np.cross(b - a, c - a)
    triangles["normal"] = across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-300)
    with writing(path):
        path.write_bytes(b"fenwear".ljust(80) + np.uint32(len(triangles)).tobytes() + triangles.tobytes())


def facing_outward(surface: ContactSurface) -> NDArray[np.int64]:
    """Return the pressure nodes around each linear facet (f, k), counter-clockwise as seen from outside the body.

    Of a line the second node is where the first one sees it to its left along y, so that pulled along y it looks out.
    """
    cells = surface_cells(surface)
    out, x = surface.outward[cells].mean(axis=1), surface.unworn[cells]
    if surface.dim == 2:
        along = x[:, 1] - x[:, 0]
        looks = along[:, 0] * out[:, 1] - along[:, 1] * out[:, 0]
    else:
        looks = np.einsum("fi,fi->f", np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), out)
    return np.where(looks[:, None] < 0, cells[:, ::-1], cells)
