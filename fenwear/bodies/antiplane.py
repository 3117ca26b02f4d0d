"""Displacement out of the plane: antiplane shear by tractions along y, and torsion of rings by those around the axis.

Nothing changes along y, so that u_y(x, z) obeys div(G grad u_y) = 0 on its own: pressure, gap and
wear stay as they are without it. In rings u_y is the displacement around the axis, and its shear strains are
u_y,r - u_y / r and u_y,z. Supports of a body in the plane hold it along y, too; a ring without supports
is taken to be held from turning where it is loaded.
"""

from __future__ import annotations

from typing import Any

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem
from numpy.typing import NDArray
from petsc4py import PETSc

from fenwear.algebra.assembled import assembled
from fenwear.algebra.factor import factored
from fenwear.bodies.elastic_material import measure
from fenwear.bodies.elasticity import PREFIX, ElasticBody
from fenwear.case import Kind
from fenwear.common.arrays import Array

ON_AXIS = 1e-9  # of the contact's largest radius


def shear_strain(u: Any, kind: Kind) -> Any:
    """Return the shear strains (2,) of a displacement out of the plane, or around the axis of rings, in UFL."""
    if kind != "axisymmetric":
        return ufl.grad(u)
    r = ufl.SpatialCoordinate(ufl.domain.extract_unique_domain(u))[0]
    return ufl.as_vector((u.dx(0) - u / r, u.dx(1)))


def shear_out_of_plane(elastic: ElasticBody, blocks: NDArray[np.int64], force: Array) -> fem.Function:
    """Return u_y under nodal forces along y; collective.

    Args:
        elastic: The body.
        blocks: Global numbers of the blocks of displacements at the loaded nodes (n,).
        force: Per thickness (n,), N/mm; of whole rings, N.
    """
    mesh, shear_modulus = elastic.body.mesh, elastic.law.shear_modulus
    element = basix.ufl.element("Lagrange", mesh.basix_cell(), elastic.space.ufl_element().degree)
    space = fem.functionspace(mesh, element)
    # A space of one component may number its nodes in another way: go by the cells.
    to_node = np.empty(space.dofmap.index_map.size_local + space.dofmap.index_map.num_ghosts, dtype=np.int64)
    to_node[space.dofmap.list.ravel()] = elastic.space.dofmap.list.ravel()
    index_map = elastic.space.dofmap.index_map
    given, held = fem.Function(elastic.space), fem.Function(elastic.space)
    start, stop = index_map.local_range
    local = (blocks >= start) & (blocks < stop)
    given.x.array[2 * (blocks[local] - start)] = force[local]
    held.x.array[2 * (_held(elastic) // 2)] = 1.0
    held.x.scatter_forward()

    u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
    strains = ufl.inner(shear_strain(u, elastic.law.kind), shear_strain(v, elastic.law.kind))
    a = shear_modulus * strains * measure(mesh, elastic.law.kind) * ufl.dx
    supports = np.flatnonzero(held.x.array[2 * to_node] > 0).astype(np.int32)
    bc = fem.dirichletbc(PETSc.ScalarType(0), supports, space)
    matrix = assembled(a, [bc])
    matrix.setOption(PETSc.Mat.Option.SPD, True)
    solution = fem.Function(space, name="displacement_out_of_plane")
    owned = space.dofmap.index_map.size_local
    load = given.x.array[2 * to_node[:owned]]
    load[supports[supports < owned]] = 0.0

    factor = factored(matrix, PREFIX, "cholesky", comm=mesh.comm, dim=elastic.dim)
    solution.x.array[:owned] = factor.solve(load)
    factor.free()
    matrix.destroy()
    solution.x.scatter_forward()
    return solution


def _held(elastic: ElasticBody) -> NDArray[np.int64]:
    """Return owned degrees of freedom of the nodes that are held; collective."""
    if elastic.law.kind != "axisymmetric" or not elastic.rigid_modes:
        return elastic.supported.astype(np.int64)
    owned = elastic.space.dofmap.index_map.size_local
    radius = elastic.space.tabulate_dof_coordinates()[:owned, 0]
    on_axis = 2 * np.flatnonzero(radius < ON_AXIS * elastic.surface.trace[:, 0].max())
    return np.concatenate([np.flatnonzero(elastic.load), on_axis])
