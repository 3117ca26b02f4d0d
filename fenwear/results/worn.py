"""The worn surfaces of a run as files for other programs, and for fenwear again: profile, triangles, mesh with depths.

A profile has what a surface lies deeper in its body than the mesh of its case: the wear, and the profile that the
body had before. As `punch.profile.file` or `strip.profile.file` it makes the worn body of a next run, on the same
geometry.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.assembly import place_case
from fenwear.bodies.contact_surface import ContactSurface
from fenwear.case import Case, load_case
from fenwear.case.csv_table import profile_text
from fenwear.errors import CaseError, InputError
from fenwear.parallel import on_root
from fenwear.results.disk import write_text, writing
from fenwear.results.export import FOLDER, RECORDS, chosen_rows
from fenwear.results.history import CASE
from fenwear.results.machining import facing_outward, profile_of, write_stl
from fenwear.results.reading import load_history

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
            for path in _written(target / f"worn_{body}", case, surfaces[body], depth)
        ]

    return on_root(comm, write)


def _depths(directory: Path, at: str) -> dict[str, Array]:
    """Return the worn depths (n,) of the chosen half-cycle of each body, mm."""
    history = load_history(directory)
    rows = chosen_rows(history, next(iter(RECORDS)), at)
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
