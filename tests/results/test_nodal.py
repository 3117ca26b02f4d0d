"""Nodal values of checkpoints: the same on any number of ranks, on both sides of a slit."""

from __future__ import annotations

import basix.ufl
import numpy as np
import pytest
from dolfinx import fem
from dolfinx.mesh import Mesh, create_mesh
from mpi4py import MPI

from fenwear.results.checkpoint import nodal_table, nodal_values


def slit_square(comm: MPI.Comm) -> Mesh:
    """Return a unit square of triangles, slit at y = 1/2 from the left side to the middle: nodes there are double."""
    n = 8
    i, j = (a.ravel() for a in np.meshgrid(np.arange(n + 1), np.arange(n + 1)))
    x = np.column_stack([i, j]) / n
    twin = np.arange(len(x))
    on_slit = np.flatnonzero((j == n // 2) & (i < n // 2))
    twin[on_slit] = len(x) + np.arange(len(on_slit))
    corner = np.flatnonzero((i < n) & (j < n))
    quads = corner[:, None] + np.array([0, 1, n + 1, n + 2])
    quads[j[corner] >= n // 2] = twin[quads[j[corner] >= n // 2]]
    cells = np.vstack([quads[:, [0, 1, 3]], quads[:, [0, 2, 3]]])
    mine = slice(comm.rank * len(cells) // comm.size, (comm.rank + 1) * len(cells) // comm.size)
    element = basix.ufl.element("Lagrange", "triangle", 1, shape=(2,))
    x = np.vstack([x, x[on_slit]]) if comm.rank == 0 else np.empty((0, 2))
    return create_mesh(comm, cells=cells[mine].astype(np.int64), x=x, e=element)


def jumping(space: fem.FunctionSpace) -> fem.Function:
    """Return x² + 3 y + 5 x y, and 100 more on the upper side of the slit."""
    function, (x, y) = fem.Function(space), space.tabulate_dof_coordinates()[:, :2].T
    function.x.array[:] = x**2 + 3 * y + 5 * x * y
    on_slit, upper = (
        (x < 0.5 - 1e-9) & (abs(y - 0.5) < 1e-9),
        space.dofmap.list[y[space.dofmap.list].mean(axis=1) > 0.5],
    )
    function.x.array[on_slit & np.isin(np.arange(len(x)), upper)] += 100.0
    return function


@pytest.mark.mpi
def test_slit() -> None:
    """Values jump across the slit; read on one rank what all have gathered, and the other way round."""
    world = MPI.COMM_WORLD
    for degree in (1, 2, 3):
        many, one = (fem.functionspace(slit_square(comm), ("Lagrange", degree)) for comm in (world, MPI.COMM_SELF))
        for gathered, reads in ((many, one), (one, many)):
            table = world.bcast(nodal_table(jumping(gathered)))
            expected = jumping(reads).x.array[: reads.dofmap.index_map.size_local]
            np.testing.assert_allclose(nodal_values(table, reads), expected, rtol=1e-12)
