"""The worn shape: meshes that follow the wear, and how far it is still from their elements' size.

Small wear is an offset of the gap. Where it comes near the height of the elements at the contact, their
nodes move instead: each node of the contact by its depth along e, the normal of the contact there, in which the gap
counts the depth. The motion u is extended harmonically into the body, component by component,

    integral of grad u . grad v dx = 0,   u = depth e at the contact,   u = 0 at points that the case names;

along the mean normal of the contact u = 0 at all other boundaries that such a motion would bend, across it at all
others. The motion always starts from the mesh as it was made, so that it depends on the depth alone and not on the
steps in which it was reached. Volumes and pressures are then those of the moved surface: on one of the radius R they
differ from those of the offset by the depth over R.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import dolfinx.fem.petsc  # noqa: F401  (makes fem.petsc)
import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import exterior_facet_indices
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from fenwear.algebra.assembled import assembled, assembled_vector, compiled, interpolate
from fenwear.algebra.factor import factored
from fenwear.bodies.contact_surface import ContactSurface, Trace, contact_surface, contact_tag, trace_of
from fenwear.bodies.distributed_mesh import BodyMesh
from fenwear.bodies.elastic_material import measure
from fenwear.bodies.elasticity import ElasticBody
from fenwear.case import Kind
from fenwear.common.arrays import Array
from fenwear.common.compat import facet_nodes, geometry_degree, geometry_dofmap
from fenwear.common.errors import MeshQualityError

LEAST = 0.2  # of an element's volume that the motion may leave anywhere in it
ACROSS = 1e-3  # cosine between a boundary's normal and the motion below which nodes slide along it
PREFIX = "fenwear_shape_"


@dataclass(frozen=True)
class MovableSurface:
    """The contact surface of a body as its mesh was made.

    Attributes:
        body: Its geometry can be changed.
        space: Scalar, of the degree of the displacements.
        trace: Of that space.
    """

    body: BodyMesh
    space: fem.FunctionSpace
    trace: Trace

    @property
    def surface(self) -> ContactSurface:
        """The contact surface."""
        return self.trace.surface


def movable_surface(body: BodyMesh, degree: int, kind: Kind) -> MovableSurface:
    """Gather the contact surface of a mesh that is to move; collective.

    Args:
        body: The mesh.
        degree: Of the displacements.
        kind: Of the model.
    """
    vectors = fem.functionspace(body.mesh, ("Lagrange", degree, (body.mesh.geometry.dim,)))
    _, trace = contact_surface(body, vectors, measure(body.mesh, kind))
    space = fem.functionspace(body.mesh, ("Lagrange", degree))
    return MovableSurface(body, space, trace_of(trace, vectors, space))


def follow_wear(movable: MovableSurface, depth: Array, into: Array, held: Sequence[Array]) -> Array:
    """Move a mesh, as it was made, by the depth worn off its contact surface; collective.

    Args:
        movable: The geometry of its mesh is changed.
        depth: At the pressure nodes (n,), mm.
        into: Unit vectors into the body at the pressure nodes, along which depth is counted (n, d).
        held: Points that keep their place, such as pins, mm.

    Returns:
        Displacements of the pressure nodes along `into` (n,), mm: the depth as far as the geometry's
        polynomials reach, which may be of a lower degree.

    Raises:
        MeshQualityError: an element is left with less than a fifth of its size somewhere.
    """
    body, space, trace = movable.body, movable.space, movable.trace
    mesh, dim, surface = body.mesh, body.mesh.geometry.dim, movable.surface
    x = space.tabulate_dof_coordinates()
    contact = _contact_dofs(body, space)
    normal = _mean_normal(body)
    bent, others = _free_dofs(body, space, normal)
    pins = [np.flatnonzero(np.linalg.norm(x[:, :dim] - point, axis=1) < 1e-6 * np.ptp(x[:, 0])) for point in held]
    pinned = np.concatenate([*pins, []]).astype(np.int32)
    motion = surface.extension @ (depth[:, None] * into)
    before = _sizes(body)
    axes = np.vstack([normal, np.linalg.svd(normal[None])[2][1:]])
    moves = np.zeros((len(x), dim))
    for axis, edge in zip(axes, (bent, *(others,) * (dim - 1)), strict=True):
        part = motion @ axis
        if np.abs(part).max(initial=0.0) > 1e-12 * np.abs(motion).max(initial=0.0):
            fixed = np.setdiff1d(np.union1d(edge, pinned), contact).astype(np.int32)
            moves += np.outer(_extended(space, trace, part, contact, fixed), axis)
    _move(body, space, moves)
    displaced = (space.tabulate_dof_coordinates() - x)[:, :dim]
    ratio = mesh.comm.allreduce(float((_sizes(body) / before).min(initial=np.inf)), MPI.MIN)
    if ratio < LEAST:
        raise MeshQualityError(
            f"the wear of the {body.name} has used up the elements at its contact: {100 * max(ratio, 0.0):.0f} % "
            f"of the thinnest is left. The depth is {depth.max():.3g} mm. Make the geometry higher "
            "where it wears, let the contact contain the chamfer beside it, or reduce the wear"
        )
    owned = space.dofmap.index_map.size_local
    moved = np.stack([trace.pick(part[:owned, None])[surface.nodes, 0, 0] for part in displaced.T], axis=1)
    return np.einsum("nd,nd->n", moved, into)


def element_height(elastic: ElasticBody) -> Array:
    """Return the height of the elements at each pressure node, volume over area of the facet (n,), mm; collective."""
    body, mesh = elastic.body, elastic.body.mesh
    cells = fem.functionspace(mesh, ("DG", 0))
    ds = ufl.Measure("ds", domain=mesh, subdomain_data=body.facet_tags)(contact_tag(body))
    v = ufl.TestFunction(cells)
    volume, area = (fem.assemble_vector(compiled(v * over)).array for over in (ufl.dx(domain=mesh), ds))
    height = fem.Function(cells)
    np.divide(volume, area, out=height.x.array, where=area > 0)
    surface = elastic.trace.surface
    if surface.cell == "triangle":  # shape functions of degree 2 have no integral at vertices: their values are taken
        ds = ds(metadata={"quadrature_rule": "vertex", "quadrature_degree": 1})
    w = ufl.TestFunction(elastic.space)[0]
    sums = []
    for f in (height, ufl.as_ufl(1.0)):
        sums.append(elastic.trace.pick(assembled_vector(f * w * ds)[:, None])[surface.nodes, 0, 0])
    return sums[0] / sums[1]


def _contact_dofs(body: BodyMesh, space: fem.FunctionSpace) -> NDArray[np.int32]:
    facets = body.facet_tags.find(contact_tag(body))
    return fem.locate_dofs_topological(space, body.mesh.topology.dim - 1, facets)


def _mean_normal(body: BodyMesh) -> Array:
    """Return the mean outward unit normal of the contact surface (d,); collective."""
    ds = ufl.Measure("ds", domain=body.mesh, subdomain_data=body.facet_tags)
    tag, n, dim = contact_tag(body), ufl.FacetNormal(body.mesh), body.mesh.geometry.dim
    parts = [body.mesh.comm.allreduce(fem.assemble_scalar(compiled(n[i] * ds(tag)))) for i in range(dim)]
    normal = np.array(parts) / np.linalg.norm(parts)
    normal[np.abs(normal) < 1e-9] = 0.0
    return normal / np.linalg.norm(normal)


def _free_dofs(body: BodyMesh, space: fem.FunctionSpace, normal: Array) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return the nodes of the boundary beside the contact, those where a motion along `normal` bends it and all.

    Collective.
    """
    mesh, dim = body.mesh, body.mesh.topology.dim
    mesh.topology.create_connectivity(dim - 1, dim)
    facets = exterior_facet_indices(mesh.topology)
    facets = np.setdiff1d(facets, body.facet_tags.find(contact_tag(body))).astype(np.int32)
    corners = mesh.geometry.x[facet_nodes(mesh, facets)][:, :, : mesh.geometry.dim]
    sides = corners[:, 1:dim] - corners[:, :1]  # one of a line, two of a triangle or quadrilateral
    across = np.cross(sides[:, 0], sides[:, 1]) if dim == 3 else sides[:, 0, ::-1] * [1.0, -1.0]
    bent = np.abs(across @ normal) > ACROSS * np.linalg.norm(across, axis=1)
    some, all_ = (fem.locate_dofs_topological(space, dim - 1, chosen) for chosen in (facets[bent], facets))
    return some, all_


def _extended(
    space: fem.FunctionSpace, trace: Trace, values: Array, contact: NDArray[np.int32], fixed: NDArray[np.int32]
) -> Array:
    """Return the harmonic function of values at the trace nodes (N,), 0 at `fixed`, at all nodes; collective."""
    given, zero = fem.Function(space), fem.Function(space)
    given.x.array[trace.local] = values[trace.owned]
    given.x.scatter_forward()
    u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
    a = compiled(ufl.inner(ufl.grad(u), ufl.grad(v)) * ufl.dx)
    return _solve(a, [fem.dirichletbc(given, contact), fem.dirichletbc(zero, fixed)], space).x.array


def _solve(a: fem.Form, bcs: list[fem.DirichletBC], space: fem.FunctionSpace) -> fem.Function:
    matrix, solution = assembled(a, bcs), fem.Function(space)
    load = fem.Function(space)  # its vector has ghosts, unlike the matrix's own
    fem.petsc.apply_lifting(load.x.petsc_vec, [a], [bcs])
    load.x.petsc_vec.ghostUpdate(PETSc.InsertMode.ADD, PETSc.ScatterMode.REVERSE)
    fem.petsc.set_bc(load.x.petsc_vec, bcs)
    factor = factored(matrix, PREFIX, "lu", comm=space.mesh.comm, dim=space.mesh.geometry.dim)
    owned = space.dofmap.index_map.size_local
    solution.x.array[:owned] = factor.solve(load.x.array[:owned])
    solution.x.scatter_forward()
    factor.free()
    matrix.destroy()
    return solution


def _move(body: BodyMesh, space: fem.FunctionSpace, moves: Array) -> None:
    """Move the nodes of the geometry by a function of the space, given at its nodes (dofs, d)."""
    mesh = body.mesh
    of_geometry = fem.Function(fem.functionspace(mesh, ("Lagrange", geometry_degree(mesh))))
    of_space = fem.Function(space)
    x, dim = mesh.geometry.x, mesh.geometry.dim
    nodes, dofs = geometry_dofmap(mesh).ravel(), of_geometry.function_space.dofmap.list.ravel()
    moved = x.copy()
    for k in range(dim):
        of_space.x.array[:] = moves[:, k]
        of_geometry.interpolate(of_space)
        moved[nodes, k] = x[nodes, k] + of_geometry.x.array[dofs]
    x[:] = moved


def _sizes(body: BodyMesh) -> Array:
    """Return the determinant of the Jacobian at points of each element: its local size."""
    space = fem.functionspace(body.mesh, ("DG", 2))
    sizes = fem.Function(space)
    interpolate(ufl.JacobianDeterminant(body.mesh), sizes)
    return sizes.x.array.copy()
