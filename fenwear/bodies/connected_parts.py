"""Parts of a mesh that share no node: nothing holds one to the other."""

from __future__ import annotations

from itertools import accumulate

import numpy as np
from dolfinx.mesh import Mesh
from mpi4py import MPI
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from fenwear.common.arrays import Array
from fenwear.common.compat import geometry_dofmap


def connected_parts(mesh: Mesh) -> NDArray[np.int64]:
    """Return the number of the part that each cell of this rank, ghosts too, belongs to (cells,); collective.

    Parts are numbered from 0 by where they begin along x, then y and z, the same on every rank.
    """
    comm, topology = mesh.comm, mesh.topology
    of_cells = topology.connectivity(topology.dim, 0)
    cells, vertices = of_cells.num_nodes, topology.index_map(0)
    known = vertices.size_local + vertices.num_ghosts
    corner_of = np.repeat(np.arange(cells), np.diff(of_cells.offsets))
    here = _components(cells + known, corner_of, cells + of_cells.array)
    # Vertices that several ranks have join the pieces of each.
    numbers = vertices.local_to_global(np.arange(known, dtype=np.int32))
    shared = np.unique(np.concatenate(comm.allgather(vertices.ghosts)))
    mine = np.isin(numbers, shared)
    count = int(here.max(initial=-1)) + 1
    pieces = comm.allgather((count, numbers[mine], here[cells:][mine]))
    starts = [0, *accumulate(piece[0] for piece in pieces)]
    places = np.concatenate([np.searchsorted(shared, piece[1]) for piece in pieces])
    joined = np.concatenate([start + piece[2] for start, piece in zip(starts, pieces, strict=False)])
    labels = _components(starts[-1] + len(shared), joined, starts[-1] + places)[: starts[-1]]
    local_labels = labels[starts[comm.rank] : starts[comm.rank + 1]][here[:cells]]
    names = np.unique(labels)
    return np.searchsorted(names, local_labels) if len(names) == 1 else _in_order(mesh, local_labels, names)


def _components(size: int, first: NDArray[np.int64], second: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the component of each of `size` things, some of which are joined in pairs."""
    graph = coo_array((np.ones(len(first), dtype=np.int8), (first, second)), shape=(size, size))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def _in_order(mesh: Mesh, local_labels: NDArray[np.int64], names: NDArray[np.int64]) -> NDArray[np.int64]:
    boxes = part_boxes(mesh, np.searchsorted(names, local_labels), len(names))
    order = np.lexsort(boxes[:, 0].T[::-1])
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    return np.asarray(place[np.searchsorted(names, local_labels)])


def part_boxes(mesh: Mesh, part: NDArray[np.int64], count: int) -> Array:
    """Return the lowest and the highest corner of the box around each part (count, 2, 3), mm; collective.

    Args:
        mesh: The mesh.
        part: Number of the part of each cell (cells,).
        count: Number of parts.
    """
    boxes = np.tile(np.array([[np.inf] * 3, [-np.inf] * 3]), (count, 1, 1))
    corners = mesh.geometry.x[geometry_dofmap(mesh)[: len(part)]]
    np.minimum.at(boxes[:, 0], part, corners.min(axis=1))
    np.maximum.at(boxes[:, 1], part, corners.max(axis=1))
    mesh.comm.Allreduce(MPI.IN_PLACE, low := np.ascontiguousarray(boxes[:, 0]), op=MPI.MIN)
    mesh.comm.Allreduce(MPI.IN_PLACE, high := np.ascontiguousarray(boxes[:, 1]), op=MPI.MAX)
    return np.stack([low, high], axis=1)
