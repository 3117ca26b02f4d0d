"""Files of runs and shapes for other programs: tables of a run, worn surfaces, shapes to machine.

CSV files are made from history.nc alone: the course of a run, and the profiles of both surfaces. Nothing here knows the
kind of the model: a variable over the records is a column of the course, one over the records and the nodes of a
surface a column of that surface's profile for each chosen record. A record is a kept half-cycle; in partial slip time
steps make a file of their own: the loops of force and displacement.

A shape to machine is written as its profile, its surface as triangles, and the case of the bodies made with it; worn
surfaces for fenwear again, too, as a profile, triangles, and a mesh with depths.

A profile has what a surface lies deeper in its body than the mesh of its case: the wear, and the profile that the
body had before. As `punch.profile.file` or `strip.profile.file` it makes the worn body of a next run, on the same
geometry.
"""

from __future__ import annotations

import csv
import io
import itertools
import math
import tomllib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray
from mpi4py import MPI
from numpy.typing import NDArray

from fenwear.bodies.contact_surface import ContactSurface
from fenwear.case import Case, load_case, make_case
from fenwear.case.body_names import Names, by_roles
from fenwear.common.arrays import Array
from fenwear.common.csv_table import profile_text
from fenwear.common.errors import CaseError, InputError
from fenwear.common.parallel import on_root
from fenwear.results.disk import write_text, writing
from fenwear.results.history import CASE, make_directory, write_case
from fenwear.results.history_surfaces import surface_cells
from fenwear.results.quantity import RECORD
from fenwear.results.stored_history import by_cycles, read_history, resolves
from fenwear.steps.initial_shape import InitialShape
from fenwear.system import place_case

FOLDER = "export"
COURSE, LOOPS = "history.csv", "loops.csv"
SURFACES = {"punch": ("x", "node"), "strip": ("x_strip", "node_strip")}
STEPS = "step"
RAISED = {"": 1, "_strip": -1}  # wear lowers the strip; the punch's surface, which looks down, it raises
ENDS = ("first", "last")

Column = tuple[str, Sequence[Any]]  # heading and values


def export(directory: Path, folder: Path | None = None, at: str = "first,last") -> list[Path]:
    """Write a run's history and profiles as CSV, a line of names and units above the values.

    Args:
        directory: Of the run.
        folder: Where to; by default `export` in the run's. Files of an earlier export are replaced.
        at: Kept half-cycles whose profiles are wanted, with commas; first and last stand for numbers.

    Returns:
        The files.

    Raises:
        CaseError: there is no readable history, or a half-cycle was not kept.
        OutputError: a file cannot be written.
    """
    history = read_history(directory)
    rows = chosen_rows(history, at)
    tables = {COURSE: _course(history)}
    if resolves(history):
        tables[LOOPS] = _loops(history, rows)
    names = Names.of(by_roles(tomllib.loads(history.attrs["case"])))
    for body, dimensions in SURFACES.items():
        for dimension in dimensions:
            if dimension in history.sizes:
                tables[f"profile_{names.by_roles[body]}.csv"] = _profile(history, dimension, rows)
    target = directory / FOLDER if folder is None else folder
    with writing(target):
        target.mkdir(parents=True, exist_ok=True)
    for name, columns in tables.items():
        write_text(target / name, _text(columns))
    return [target / name for name in tables]


def chosen_rows(history: xarray.Dataset, at: str) -> list[int]:
    """Return the rows of the chosen half-cycles, in their order.

    Raises:
        CaseError: one was not kept, or is no number.
    """
    kept: list[int] = [int(number) for number in history.half_cycle.values]
    rows = {str(number): row for row, number in enumerate(kept)}
    rows |= {"first": 0, "last": len(kept) - 1}
    words = [word.strip() for word in at.split(",") if word.strip()]
    plain = [word.lstrip("0") or "0" if word.isdecimal() else word for word in words]
    wrong = [word for word in plain if not (word.isdecimal() or word in ENDS)]
    if wrong or not words:
        text = f"expected numbers of kept half-cycles, first or last, with commas, got {(wrong or [at])[0]!r}"
        raise CaseError(InputError("--at", text))
    missing = [word for word in plain if word not in rows]
    if missing:
        wanted = int(missing[0])
        near = min(kept, key=lambda number: abs(number - wanted))
        text = (
            f"half-cycle {missing[0]} was not kept, but {near} was, the nearest of {len(kept)} "
            f"from {kept[0]} to {kept[-1]}"
        )
        raise CaseError(InputError("--at", text))
    return sorted({rows[word] for word in plain})


def _course(history: xarray.Dataset) -> list[Column]:
    names = ["half_cycle", *(name for name in history.data_vars if history[name].dims == RECORD)]
    return [(_heading(history, name), history[name].values.tolist()) for name in names]


def _loops(history: xarray.Dataset, rows: Sequence[int]) -> list[Column]:
    """Return the time steps of the cycles that end with the chosen half-cycles or hold them, one below the other."""
    cycles = by_cycles(history)
    strokes = round(float(history.half_cycle[-1] / history.cycles[-1]))
    wanted = {-(-int(history.half_cycle[row]) // strokes) for row in rows}
    cycles = cycles.isel(cycle=[k for k, number in enumerate(cycles.cycle.values) if int(number) in wanted])
    there = np.isfinite(cycles.fraction.values)
    columns: list[Column] = [("cycle", np.repeat(cycles.cycle.values, there.sum(axis=1)).tolist())]
    for name in cycles.variables:
        if cycles[name].dims == ("cycle", STEPS):
            columns.append((_heading(cycles, name), cycles[name].values[there].tolist()))
    return columns


def _profile(history: xarray.Dataset, dimension: str, rows: Sequence[int]) -> list[Column]:
    """Return the places on a surface, its unworn height where known, and what there is of each chosen half-cycle."""
    places = [name for name in history.variables if history[name].dims == (dimension,)]
    columns: list[Column] = [(_heading(history, name), history[name].values.tolist()) for name in places]
    end = "_strip" if dimension.endswith("_strip") else ""
    for row in rows:
        at = f" at half-cycle {int(history.half_cycle.values[row])}"
        for name in history.data_vars:
            if history[name].dims != (*RECORD, dimension):
                continue
            values = history[name][row].values
            columns.append((_heading(history, name, at), values.tolist()))
            if name == f"wear{end}" and f"height{end}" in history:
                worn = history[f"height{end}"].values + RAISED[end] * values
                columns.append((f"worn_height{end}{at} (mm)", worn.tolist()))
    return columns


def _heading(history: xarray.Dataset, name: Any, at: str = "") -> str:
    """Return the name of a column with its unit, as pressure at half-cycle 2 (MPa)."""
    unit = history[name].attrs.get("units", "1")
    return f"{name}{at}" if unit == "1" else f"{name}{at} ({unit})"


def _text(columns: Sequence[Column]) -> str:
    return csv_text([heading for heading, _ in columns], zip(*(values for _, values in columns), strict=True))


def csv_text(heading: Sequence[str], rows: Iterable[Iterable[Any]]) -> str:
    """Return a table as CSV, its cells empty where there is no number."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(heading)
    writer.writerows(["" if isinstance(cell, float) and math.isnan(cell) else cell for cell in row] for row in rows)
    return file.getvalue()


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
    tables = case.tables_by_roles()
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


VTK_CELLS = {2: "LINES", 3: "POLYGONS", 4: "POLYGONS"}


def export_worn(directory: Path, folder: Path | None = None, at: str = "last") -> list[Path]:
    """Write the worn surfaces of a run: worn_BODY.csv, .stl and .vtk of each body that wears; collective.

    Args:
        directory: Of the run.
        folder: Where to; by default `export` in the run's.
        at: The kept half-cycle, a number, first or last.

    Returns:
        The files.

    Raises:
        CaseError: there is no readable run, or the half-cycle was not kept.
        OutputError: a file cannot be written.
    """
    comm = MPI.COMM_WORLD
    case = load_case(directory / CASE)
    depths = on_root(comm, lambda: _depths(directory, at))
    placed = place_case(case, comm)
    target = directory / FOLDER if folder is None else folder
    surfaces = {"punch": placed.pair.punch, "strip": placed.pair.strip}

    def write() -> list[Path]:
        with writing(target):
            target.mkdir(parents=True, exist_ok=True)
        return [
            path
            for body, depth in depths.items()
            if getattr(case.wear, body) is not None
            for path in _written(target / f"worn_{case.names.by_roles[body]}", case, surfaces[body], depth)
        ]

    return on_root(comm, write)


def _depths(directory: Path, at: str) -> dict[str, Array]:
    """Return the worn depths (n,) of the chosen half-cycle of each body, mm."""
    history = read_history(directory)
    rows = chosen_rows(history, at)
    if len(rows) != 1:
        raise CaseError(InputError("--at", f"expected one half-cycle for worn surfaces, got {at!r}"))
    names = {"punch": "wear", "strip": "wear_strip"}
    return {body: np.asarray(history[name][rows[0]].values) for body, name in names.items() if name in history}


def _written(stem: Path, case: Case, surface: ContactSurface, depth: Array) -> list[Path]:
    """Write the files of one surface; return them."""
    csv, stl, vtk = (stem.with_suffix(suffix) for suffix in (".csv", ".stl", ".vtk"))
    write_text(csv, profile_text(case.model.kind, profile_of(surface, depth)))
    write_stl(stl, surface, depth, case.model.thickness if case.model.kind == "plane" else 0.0)
    write_text(vtk, _vtk(surface, depth))
    return [csv, stl, vtk]


def _vtk(surface: ContactSurface, depth: Array) -> str:
    """Return a legacy VTK file of the worn surface with the depths at its nodes; in a plane and of rings a line."""
    worn, cells = surface.unworn - depth[:, None] * surface.outward, facing_outward(surface)
    x = np.zeros((len(worn), 3))
    x[:, [0, 2] if surface.dim == 2 else [0, 1, 2]] = worn
    head = f"# vtk DataFile Version 3.0\nworn surface of the {surface.body}, mm\nASCII\nDATASET POLYDATA"
    points = _rows(x)
    size = cells.shape[1]
    lines = _rows(np.column_stack([np.full(len(cells), size), cells]))
    return (
        f"{head}\nPOINTS {len(x)} double\n{points}\n{VTK_CELLS[size]} {len(cells)} {(size + 1) * len(cells)}\n{lines}\n"
        f"POINT_DATA {len(x)}\nSCALARS wear_mm double 1\nLOOKUP_TABLE default\n{_rows(depth[:, None])}\n"
    )


def _rows(values: Array | NDArray[np.int64]) -> str:
    return "\n".join(" ".join(f"{value:.10g}" for value in row) for row in values)
