"""Meshes that meshio reads: VTU and XDMF, whose whole numbers of cells become sets."""

from __future__ import annotations

import io
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np

from fenwear.errors import CaseError, InputError, StackError
from fenwear.files.mesh import Block, MeshFile, MeshSet

KIND_NUMBERS = {"vertex": 15, "line": 1, "line3": 8, "triangle": 2, "triangle6": 9, "quad": 3, "quad8": 16, "quad9": 10,
                "tetra": 4, "tetra10": 11, "hexahedron": 5, "hexahedron20": 17, "hexahedron27": 12, "wedge": 6,
                "pyramid": 7}  # fmt: skip
ORDERS = {11: [0, 1, 2, 3, 4, 5, 6, 7, 9, 8],
          17: [0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 16, 9, 17, 10, 18, 19, 12, 15, 13, 14]}  # fmt: skip
MOST_VALUES = 1000  # of an array of cells that names sets


def read(path: Path) -> MeshFile:
    """Return the mesh of a file; "material 1" is the set of the cells whose array "material" is 1.

    Raises:
        CaseError: meshio cannot read it.
        StackError: there is no meshio.
    """
    try:
        import meshio
    except ImportError:
        message = f"{path.name} is read by the package meshio: pip install meshio, on Debian python3-meshio"
        raise StackError(message) from None
    said = io.StringIO()  # meshio prints, too, and ends the process
    with redirect_stdout(said), redirect_stderr(said):
        try:
            mesh = meshio.read(path)
        except (Exception, SystemExit) as error:
            text = said.getvalue().partition("\n")[0] or str(error) or type(error).__name__
            message = f"cannot be read by meshio: {text[:160]}. Write the file anew."
            raise CaseError(InputError(path.name, message)) from None
    return _mesh(path.name, mesh)


def _mesh(name: str, mesh: Any) -> MeshFile:
    points = np.zeros((len(mesh.points), 3))
    points[:, : mesh.points.shape[1]] = mesh.points
    notes = sorted({f"{block.type} elements are left out" for block in mesh.cells if block.type not in KIND_NUMBERS})
    kept = [k for k, block in enumerate(mesh.cells) if block.type in KIND_NUMBERS]
    blocks = []
    for k in kept:
        nodes = np.asarray(mesh.cells[k].data, dtype=np.int64)
        if nodes.size and not (nodes.min() >= 0 and nodes.max() < len(points)):
            raise CaseError(InputError(name, "has cells on points that do not exist. Write the file anew."))
        kind = KIND_NUMBERS[mesh.cells[k].type]
        blocks.append(Block.of(kind, nodes[:, ORDERS[kind]] if kind in ORDERS else nodes))
    sets = []
    for array, parts in mesh.cell_data.items():
        values = np.concatenate([np.asarray(parts[k]) for k in kept]) if kept else np.zeros(0)
        if values.ndim != 1 or not len(values) or not np.array_equal(values, np.round(values)):
            continue
        found = np.unique(values)
        for value in found if len(found) <= MOST_VALUES else []:
            sets.append(MeshSet(f"{array} {int(value)}", "elements", np.flatnonzero(values == value)))
    for array, nodes in mesh.point_sets.items():
        sets.append(MeshSet(array, "nodes", np.unique(np.asarray(nodes, dtype=np.int64))))
    return MeshFile(name, points, tuple(blocks), tuple(sets), tuple(notes))
