"""Differences between versions of the stack, found by feature, never by version number."""

from __future__ import annotations

from typing import Any

import dolfinx.io
import dolfinx.mesh
import numpy as np
from dolfinx.fem import FunctionSpace
from dolfinx.graph import adjacencylist
from dolfinx.mesh import Mesh, MeshTags
from mpi4py import MPI
from numpy.typing import NDArray

from fenwear.common.stack import check_numbers

check_numbers()


CORNERS = {"triangle": 3, "quadrilateral": 4, "tetrahedron": 4, "hexahedron": 8}


def model_to_mesh(model: Any, comm: MPI.Comm, gdim: int, owner: int | None = None) -> tuple[Mesh, MeshTags, MeshTags]:
    """Distribute the gmsh model of rank 0, or what answers as one does: its mesh, cell tags and facet tags.

    Every rank gets as many cells, from left to right: always the same ones, unlike from a graph's
    partitioner; or one rank, the owner, gets all. dolfinx 0.9 has io.gmshio and returns three items,
    later versions io.gmsh and more.
    """
    gmsh_io = getattr(dolfinx.io, "gmsh", None) or __import__("dolfinx.io.gmshio", fromlist=["gmshio"])
    x = gmsh_io.extract_geometry(model)[:, 0] if comm.rank == 0 else np.empty(0)

    def from_left_to_right(_: MPI.Comm, ranks: int, kinds: Any, cells: Any) -> Any:
        """Return the rank of each cell, given by its corners."""
        corners = np.asarray(cells[0]).reshape(-1, CORNERS[kinds[0].name])
        ranks_of = np.empty(len(corners), dtype=np.int32)
        order = np.argsort(x[corners].mean(axis=1).round(9), kind="stable")
        ranks_of[order] = np.arange(len(corners)) * ranks // max(len(corners), 1) if owner is None else owner
        links = adjacencylist(ranks_of)
        return getattr(links, "_cpp_object", links)  # wrapped from 0.10 on

    mesh, cell_tags, facet_tags = gmsh_io.model_to_mesh(model, comm, 0, gdim=gdim, partitioner=from_left_to_right)[:3]
    return mesh, cell_tags, facet_tags


def interpolation_points(space: Any) -> Any:
    """Return the points that functions are interpolated at; a method up to dolfinx 0.9, then a property."""
    points = space.element.interpolation_points
    return points() if callable(points) else points


def collapse(space: FunctionSpace) -> tuple[FunctionSpace, NDArray[np.int32]]:
    """Return a component's own space, and the degree of freedom of the whole for each of its; in 0.11 in a list."""
    collapsed, to_whole = space.collapse()
    return collapsed, np.asarray(to_whole, dtype=np.int32).reshape(-1)


def geometry_dofmap(mesh: Mesh) -> NDArray[np.int32]:
    """Return the geometry's nodes of every cell (cells, nodes); from 0.11 on one such array per cell type."""
    maps = getattr(mesh.geometry, "dofmaps", None)
    return mesh.geometry.dofmap if maps is None else maps[0]


def pattern_rows(pattern: Any) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Return the columns of a sparsity pattern's rows, and where each row starts; a tuple in some versions."""
    graph = pattern.graph
    columns, starts = graph if isinstance(graph, tuple) else (graph.array, graph.offsets)
    return np.asarray(columns), np.asarray(starts)


def facet_nodes(mesh: Mesh, facets: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the geometry's nodes of facets (f, nodes), corners first; dolfinx 0.9 fails where there are none."""
    if not len(facets):
        order, cell = geometry_degree(mesh), mesh.basix_cell().name
        nodes = {"tetrahedron": (order + 1) * (order + 2) // 2, "hexahedron": (order + 1) ** 2}.get(cell, order + 1)
        return np.zeros((0, nodes), dtype=np.int32)
    return np.asarray(dolfinx.mesh.entities_to_geometry(mesh, mesh.topology.dim - 1, facets))


def geometry_degree(mesh: Mesh) -> int:
    """Return the degree of the elements' shape; from 0.11 on there is one for each cell type."""
    maps = getattr(mesh.geometry, "cmaps", None)
    return int((mesh.geometry.cmap if maps is None else maps[0]).degree)


def petsc_library() -> str | None:
    """Return the path of PETSc's library; None where it is not found. Up to 0.9 dolfinx.utils has it."""
    import dolfinx.fem.petsc

    home = dolfinx.fem.petsc
    if not hasattr(home, "get_petsc_lib"):
        home = __import__("dolfinx.utils", fromlist=["utils"])
    try:
        return str(home.get_petsc_lib())
    except RuntimeError:  # not where PETSc's own configuration says
        return None
