"""Displacement out of the plane: antiplane shear by tractions along y, and torsion of rings by those around the axis.

Nothing changes along y, so that u_y(x, z) obeys div(G grad u_y) = 0 on its own: pressure, gap and
wear stay as they are without it. In rings u_y is the displacement around the axis, and its shear strains are
u_y,r - u_y / r and u_y,z. Supports of a body in the plane hold it along y, too; a ring without supports
is taken to be held from turning where it is loaded.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem
from numpy.typing import NDArray
from petsc4py import PETSc
from scipy.sparse import csr_array

from fenwear.algebra.assembled import assembled
from fenwear.algebra.factor import factored
from fenwear.bodies.condensation import CondensedBody
from fenwear.bodies.elastic_material import measure
from fenwear.bodies.elasticity import PREFIX, ElasticBody
from fenwear.bodies.response import Request
from fenwear.bodies.surface_operators import SurfaceOperator
from fenwear.case import Kind
from fenwear.common.arrays import Array

ON_AXIS = 1e-9  # of the contact's largest radius


def shear_strain(u: Any, kind: Kind) -> Any:
    """Return the shear strains (2,) of a displacement out of the plane, or around the axis of rings, in UFL."""
    if kind != "axisymmetric":
        return ufl.grad(u)
    r = ufl.SpatialCoordinate(ufl.domain.extract_unique_domain(u))[0]
    return ufl.as_vector((u.dx(0) - u / r, u.dx(1)))


class OutOfPlane:
    """Stiffness of a body against displacements out of the plane, factored; collective.

    Args:
        elastic: The body.
    """

    def __init__(self, elastic: ElasticBody) -> None:
        self._elastic = elastic
        mesh, kind = elastic.body.mesh, elastic.law.kind
        element = basix.ufl.element("Lagrange", mesh.basix_cell(), elastic.space.ufl_element().degree)
        self.space = space = fem.functionspace(mesh, element)
        # A space of one component may number its nodes in another way: go by the cells.
        self._to_node = np.empty(space.dofmap.index_map.size_local + space.dofmap.index_map.num_ghosts, dtype=np.int64)
        self._to_node[space.dofmap.list.ravel()] = elastic.space.dofmap.list.ravel()
        self._owned = space.dofmap.index_map.size_local
        held = fem.Function(elastic.space)
        held.x.array[2 * (_held(elastic) // 2)] = 1.0
        held.x.scatter_forward()
        u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
        strains = ufl.inner(shear_strain(u, kind), shear_strain(v, kind))
        a = elastic.law.shear_modulus * strains * measure(mesh, kind) * ufl.dx
        self._supports = np.flatnonzero(held.x.array[2 * self._to_node] > 0).astype(np.int32)
        matrix = assembled(a, [fem.dirichletbc(PETSc.ScalarType(0), self._supports, space)])
        matrix.setOption(PETSc.Mat.Option.SPD, True)
        self._factor = factored(matrix, PREFIX, "cholesky", comm=mesh.comm, dim=elastic.dim)
        matrix.destroy()

    def free(self) -> None:
        """Free the factor; collective."""
        self._factor.free()

    def displaced(self, force: Array) -> fem.Function:
        """Return u_y under forces along y; collective.

        Args:
            force: At the trace nodes of the mesh (N,), per thickness, N/mm; of whole rings, N.
        """
        given = fem.Function(self._elastic.space)
        placed = self._elastic.trace.place(np.stack([force, np.zeros_like(force)], axis=1)[:, :, None])
        given.x.array[: len(placed)] = placed[:, 0]
        given.x.scatter_forward()
        load = given.x.array[2 * self._to_node[: self._owned]]
        load[self._supports[self._supports < self._owned]] = 0.0
        solution = fem.Function(self.space, name="displacement_out_of_plane")
        solution.x.array[: self._owned] = self._factor.solve(load)
        solution.x.scatter_forward()
        return solution

    def on_trace(self, solution: fem.Function) -> Array:
        """Return u_y at the trace nodes of the mesh (N,), equal on every rank; collective."""
        moved = fem.Function(self._elastic.space)
        moved.x.array[2 * self._to_node] = solution.x.array
        owned = 2 * self._elastic.space.dofmap.index_map.size_local
        return self._elastic.trace.pick(moved.x.array[:owned, None])[:, 0, 0]


def shear_out_of_plane(elastic: ElasticBody, force: Array) -> fem.Function:
    """Return u_y under forces along y at the trace nodes of the mesh (N,), as `OutOfPlane.displaced`; collective."""
    body = OutOfPlane(elastic)
    solution = body.displaced(force)
    body.free()
    return solution


class TurningRings(CondensedBody):
    """A condensed ring with displacements along r, around the axis, and along z: d = 3."""

    def under(self, elastic: ElasticBody) -> TurningRings:
        """Return the condensed body under other loads, those of `elastic`; collective."""
        return replace(self, by_load=np.insert(super().under(elastic).by_load, 1, 0.0, axis=1))


def turning(request: Request, rings: SurfaceOperator) -> TurningRings:
    """Return the operator of rings that turn as well: that of their cross-section, and torsion beside it; collective.

    Args:
        request: The body and its patterns.
        rings: Its operator along r and z.
    """
    body, patterns = OutOfPlane(request.elastic), csr_array(request.patterns)
    moved = [body.on_trace(body.displaced(force)) for force in patterns.T.toarray()]
    body.free()
    torsion, q = np.array(moved) @ patterns, patterns.shape[1]
    response = np.zeros((q, 3, q, 3))
    every = slice(None)
    response[:, ::2, :, ::2] = rings.entries(every, every).transpose(2, 3, 0, 1)
    response[:, 1, :, 1] = (torsion + torsion.T) / 2
    along, by_load = np.broadcast_to(np.eye(3), (q, 3, 3)), np.insert(rings.by_load, 1, 0.0, axis=1)
    return TurningRings(request.patterns, along, response, by_load)


def _held(elastic: ElasticBody) -> NDArray[np.int64]:
    """Return owned degrees of freedom of the nodes that are held; collective."""
    supported = elastic.supported.astype(np.int64)
    if elastic.law.kind != "axisymmetric":
        return supported
    owned = elastic.space.dofmap.index_map.size_local
    radius = elastic.space.tabulate_dof_coordinates()[:owned, 0]
    on_axis = 2 * np.flatnonzero(radius < ON_AXIS * elastic.surface.trace[:, 0].max())
    return np.concatenate([np.flatnonzero(elastic.load) if elastic.rigid_modes else supported, on_axis])
