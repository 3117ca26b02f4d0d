"""Nodal values in one file with the places of the nodes, for meshes of which some rank has no cells.

adios4dolfinx does not take those.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from scipy.spatial import cKDTree

from fenwear.arrays import Array
from fenwear.parallel import on_root

NEAR = 1e-6  # of the extent: how far a node may be from where it was


def lacks_cells(space: fem.FunctionSpace) -> bool:
    """Return whether some rank has no cells of a mesh; collective."""
    topology = space.mesh.topology
    return bool(space.mesh.comm.allreduce(topology.index_map(topology.dim).size_local, MPI.MIN) == 0)


def write(path: Path, function: fem.Function) -> None:
    """Write nodal values with their places; collective.

    Raises:
        OSError: they cannot be written; on every rank.
    """
    comm, own = function.function_space.mesh.comm, function.function_space.dofmap.index_map.size_local
    x = function.function_space.tabulate_dof_coordinates()[:own]
    parts = comm.gather((x, function.x.array[:own])) or []

    def save() -> None:
        with path.open("wb") as file:
            np.savez(file, x=np.concatenate([p[0] for p in parts]), values=np.concatenate([p[1] for p in parts]))

    on_root(comm, save)


def read(path: Path, space: fem.FunctionSpace) -> Array:
    """Return the values of this rank's own nodes (owned,); collective.

    Raises:
        ValueError: they are of other nodes.
        OSError, KeyError: they cannot be read.
    """
    with np.load(path, allow_pickle=False) as stored:
        x, values = stored["x"], np.asarray(stored["values"])
    own = space.tabulate_dof_coordinates()[: space.dofmap.index_map.size_local]
    far, place = cKDTree(x).query(own)
    if far.max(initial=0.0) > NEAR * np.ptp(x, axis=0).max():
        raise ValueError("values of other nodes")
    found: Array = values[place]
    return found
