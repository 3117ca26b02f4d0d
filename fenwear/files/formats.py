"""Meshes of other programs by the ends of their names: which reader takes which file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from fenwear.errors import CaseError, InputError
from fenwear.files import binary, by_gmsh, xml_meshes
from fenwear.files.deck import read_deck
from fenwear.files.mesh import USABLE, MeshFile, completed

CAD = (".step", ".stp", ".iges", ".igs", ".brep")
READERS: Mapping[str, tuple[str, Callable[[Path], MeshFile]]] = {
    ".inp": ("Abaqus, CalculiX", read_deck),
    ".med": ("Salome", binary.read_med),
    ".unv": ("I-deas universal", by_gmsh.read),
    ".cgns": ("CGNS", by_gmsh.read),
    ".bdf": ("Nastran", by_gmsh.read_bulk),
    ".nas": ("Nastran", by_gmsh.read_bulk),
    ".exo": ("Exodus", binary.read_exodus),
    ".e": ("Exodus", binary.read_exodus),
    ".ex2": ("Exodus", binary.read_exodus),
    ".vtu": ("VTK", xml_meshes.read_vtu),
    ".xdmf": ("XDMF", xml_meshes.read_xdmf),
}
MESHES = tuple(READERS)


def is_foreign(path: Path) -> bool:
    """Return whether a file is the mesh of another program."""
    return path.suffix.lower() in READERS


def read_mesh(path: Path) -> MeshFile:
    """Return what the mesh file of another program holds.

    Raises:
        CaseError: it cannot be read, or it has no elements of which bodies are made.
        StackError: a package is missing that reads it.
    """
    if not path.is_file():
        raise CaseError(InputError(path.name, "no such file"))
    if path.suffix.lower() not in READERS:
        message = f"expected a name that ends in {', '.join((*MESHES, *CAD))}. Convert it to .msh."
        raise CaseError(InputError(path.name, message))
    mesh = READERS[path.suffix.lower()][1](path)
    if not np.isfinite(mesh.points).all():
        raise CaseError(InputError(path.name, "has coordinates that are no numbers. Write the file anew."))
    mesh = completed(mesh)
    if not any(block.kind in USABLE for block in mesh.blocks if len(block.nodes)):
        message = "has no triangles, quadrilaterals, tetrahedra or hexahedra to make bodies of. Export its mesh."
        raise CaseError(InputError(path.name, message))
    return mesh
