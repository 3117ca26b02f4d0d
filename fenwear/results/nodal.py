"""Nodal values in one file with the places of the nodes, for meshes that lie on any number of ranks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from dolfinx import fem, la
from scipy.spatial import cKDTree

from fenwear.arrays import Array
from fenwear.compat import geometry_dofmap
from fenwear.parallel import on_root

NEAR = 1e-6  # of the extent: how far a node may be from where it was


def write(path: Path, function: fem.Function) -> None:
    """Write nodal values of a scalar function with their places; collective.

    Raises:
        OSError: they cannot be written; on every rank.
    """
    space = function.function_space
    own = space.dofmap.index_map.size_local
    parts = space.mesh.comm.gather((_places(space), function.x.array[:own])) or []

    def save() -> None:
        with path.open("wb") as file:
            np.savez(file, places=np.concatenate([p[0] for p in parts]), values=np.concatenate([p[1] for p in parts]))

    on_root(space.mesh.comm, save)


def read(path: Path, space: fem.FunctionSpace) -> Array:
    """Return the values of this rank's own nodes (owned,); collective.

    Raises:
        ValueError: they are of other nodes.
        EOFError, KeyError, OSError, zipfile.BadZipFile: they cannot be read.
    """
    own = _places(space)
    with np.load(path, allow_pickle=False) as stored:
        places, values = stored["places"], np.asarray(stored["values"])
    far, at = cKDTree(places).query(own)
    if far.max(initial=0.0) > NEAR * np.ptp(places, axis=0).max():
        raise ValueError("values of other nodes")
    found: Array = values[at]
    return found


def _places(space: fem.FunctionSpace) -> Array:
    """Return where this rank's own nodes are, and the middle of the cells around each (owned, 6); collective.

    The middle tells the nodes on both sides of a slit apart, which have the same place.
    """
    mesh, index_map = space.mesh, space.dofmap.index_map
    cells = mesh.topology.index_map(mesh.topology.dim).size_local
    nodes = space.dofmap.list[:cells]
    middles = mesh.geometry.x[geometry_dofmap(mesh)[:cells]].mean(axis=1)
    sums = [fem.Function(space) for _ in range(4)]
    for function, values in zip(sums, (*middles.T, np.ones(cells)), strict=True):
        np.add.at(function.x.array, nodes, values[:, None])
        function.x.scatter_reverse(la.InsertMode.add)
    own = np.column_stack([function.x.array[: index_map.size_local] for function in sums])
    return np.hstack([space.tabulate_dof_coordinates()[: len(own)], own[:, :3] / own[:, 3:]])
