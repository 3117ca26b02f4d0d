"""The worn shape: meshes that follow the wear, and how far it is still from their elements' size.

Small wear is an offset of the gap. Where it comes near the height of the elements at the contact, their
nodes move instead: the depth worn at the contact is extended harmonically into the body,

    integral of grad s . grad v dx = 0,   s = depth at the contact,   s = 0 at all other boundaries
    that a motion along the contact's normal would bend, and at points that the case names,

and every node moves by s into the body. The motion always starts from the mesh as it was made, so
that it depends on the depth alone and not on the steps in which it was reached.
"""

from __future__ import annotations

from collections.abc import Sequence

import dolfinx.fem.petsc  # noqa: F401  (makes fem.petsc)
import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import exterior_facet_indices
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from fenwear.arrays import Array
from fenwear.bodies.assembly import assembled_vector, compiled, destroy
from fenwear.bodies.contact_surface import Trace, contact_surface, contact_tag, trace_of
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.material import measure
from fenwear.bodies.mesh import BodyMesh
from fenwear.case import Kind
from fenwear.compat import facet_nodes, geometry_degree, geometry_dofmap, interpolation_points
from fenwear.errors import MeshQualityError

LEAST = 0.2  # of an element's volume that the motion may leave anywhere in it
ACROSS = 1e-3  # cosine between a boundary's normal and the motion below which nodes slide along it
PREFIX = "fenwear_shape_"


def follow_wear(body: BodyMesh, depth: Array, degree: int, kind: Kind, held: Sequence[Array]) -> Array:
    """Move a mesh, as it was made, by the depth worn off its contact surface; collective.

    Args:
        body: Its geometry is changed.
        depth: At the pressure nodes of this degree (n,), mm.
        degree: Of the nodes.
        kind: Of the model.
        held: Points that keep their place, such as pins, mm.

    Returns:
        How far the pressure nodes have moved into the body (n,), mm: the depth as far as the geometry's
        polynomials reach, which may be of a lower degree.

    Raises:
        MeshQualityError: an element is left with less than a fifth of its size somewhere.
    """
    mesh, dim = body.mesh, body.mesh.geometry.dim
    space = fem.functionspace(mesh, ("Lagrange", degree))
    trace = _trace(body, space, degree, kind)
    x = space.tabulate_dof_coordinates()
    contact = _contact_dofs(body, space)
    shift = fem.Function(space)
    shift.x.array[trace.local] = (trace.surface.extension @ depth)[trace.own]
    shift.x.scatter_forward()
    normal = _mean_normal(body)
    fixed = np.setdiff1d(_bent_dofs(body, space, normal), contact)
    pins = [np.flatnonzero(np.linalg.norm(x[:, :dim] - point, axis=1) < 1e-6 * np.ptp(x[:, 0])) for point in held]
    fixed = np.union1d(fixed, np.setdiff1d(np.concatenate([*pins, []]).astype(np.int32), contact)).astype(np.int32)
    zero = fem.Function(space)
    u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
    a = compiled(ufl.inner(ufl.grad(u), ufl.grad(v)) * ufl.dx)
    bcs = [fem.dirichletbc(shift, contact), fem.dirichletbc(zero, fixed)]
    solution = _solve(a, bcs, space)
    before = _sizes(body)
    _move(body, solution, -normal)
    displaced = (x - space.tabulate_dof_coordinates())[:, :dim] @ normal
    ratio = mesh.comm.allreduce(float((_sizes(body) / before).min(initial=np.inf)), MPI.MIN)
    if ratio < LEAST:
        raise MeshQualityError(
            f"the wear of the {body.name} has used up the elements at its contact: one is left with "
            f"{max(ratio, 0.0):.0%} of its size; the depth is {depth.max():.3g} mm. Expected a geometry that is higher "
            "where it wears, a chamfer beside the contact that is part of it, or less wear"
        )
    owned = space.dofmap.index_map.size_local
    return trace.pick(displaced[:owned, None])[trace.surface.nodes, 0, 0]


def element_height(elastic: ElasticBody) -> Array:
    """Return the height of the elements at each pressure node, volume over area of the facet (n,), mm; collective."""
    body, mesh = elastic.body, elastic.body.mesh
    cells = fem.functionspace(mesh, ("DG", 0))
    ds = ufl.Measure("ds", domain=mesh, subdomain_data=body.facet_tags)(contact_tag(body))
    v = ufl.TestFunction(cells)
    volume, area = (fem.assemble_vector(compiled(v * over)).array for over in (ufl.dx(domain=mesh), ds))
    height = fem.Function(cells)
    height.x.array[:] = volume / np.maximum(area, 1e-300)
    surface = elastic.trace.surface
    if surface.cell == "triangle":  # shape functions of degree 2 have no integral at vertices: their values are taken
        ds = ds(metadata={"quadrature_rule": "vertex", "quadrature_degree": 1})
    w = ufl.TestFunction(elastic.space)[0]
    sums = []
    for f in (height, ufl.as_ufl(1.0)):
        sums.append(elastic.trace.pick(assembled_vector(f * w * ds)[:, None])[surface.nodes, 0, 0])
    return sums[0] / sums[1]


def _trace(body: BodyMesh, space: fem.FunctionSpace, degree: int, kind: Kind) -> Trace:
    vectors = fem.functionspace(body.mesh, ("Lagrange", degree, (body.mesh.geometry.dim,)))
    _, trace = contact_surface(body, vectors, measure(body.mesh, kind))
    return trace_of(trace, vectors, space)


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


def _bent_dofs(body: BodyMesh, space: fem.FunctionSpace, normal: Array) -> NDArray[np.int32]:
    """Return the nodes on boundary facets whose shape a motion along `normal` would change; collective."""
    mesh, dim = body.mesh, body.mesh.topology.dim
    mesh.topology.create_connectivity(dim - 1, dim)
    facets = exterior_facet_indices(mesh.topology)
    facets = np.setdiff1d(facets, body.facet_tags.find(contact_tag(body))).astype(np.int32)
    corners = mesh.geometry.x[facet_nodes(mesh, facets)][:, :, : mesh.geometry.dim]
    sides = corners[:, 1:dim] - corners[:, :1]  # one of a line, two of a triangle or quadrilateral
    across = np.cross(sides[:, 0], sides[:, 1]) if dim == 3 else sides[:, 0, ::-1] * [1.0, -1.0]
    bent = np.abs(across @ normal) > ACROSS * np.linalg.norm(across, axis=1)
    return fem.locate_dofs_topological(space, dim - 1, facets[bent])


def _solve(a: fem.Form, bcs: list[fem.DirichletBC], space: fem.FunctionSpace) -> fem.Function:
    matrix = fem.petsc.assemble_matrix(a, bcs=bcs)
    matrix.assemble()
    load = fem.Function(space)  # its vector has ghosts, unlike the matrix's own
    fem.petsc.apply_lifting(load.x.petsc_vec, [a], [bcs])
    load.x.petsc_vec.ghostUpdate(PETSc.InsertMode.ADD, PETSc.ScatterMode.REVERSE)
    fem.petsc.set_bc(load.x.petsc_vec, bcs)
    ksp = PETSc.KSP().create(space.mesh.comm)
    ksp.setOptionsPrefix(PREFIX)
    ksp.setOperators(matrix)
    ksp.setType("preonly")
    ksp.pc.setType("lu")
    ksp.pc.setFactorSolverType("mumps")
    ksp.setFromOptions()
    solution = fem.Function(space)
    ksp.solve(load.x.petsc_vec, solution.x.petsc_vec)
    solution.x.scatter_forward()
    destroy(ksp, matrix)
    return solution


def _move(body: BodyMesh, shift: fem.Function, direction: Array) -> None:
    """Move the nodes of the geometry by `shift` along `direction`."""
    mesh = body.mesh
    space = fem.functionspace(mesh, ("Lagrange", geometry_degree(mesh)))
    of_geometry = fem.Function(space)
    of_geometry.interpolate(shift)
    x = mesh.geometry.x
    nodes, dofs = geometry_dofmap(mesh).ravel(), space.dofmap.list.ravel()
    moved, dim = x.copy(), mesh.geometry.dim
    moved[nodes, :dim] = x[nodes, :dim] + of_geometry.x.array[dofs, None] * direction
    x[:] = moved


def _sizes(body: BodyMesh) -> Array:
    """Return the determinant of the Jacobian at points of each element: its local size."""
    space = fem.functionspace(body.mesh, ("DG", 2))
    sizes = fem.Function(space)
    sizes.interpolate(fem.Expression(ufl.JacobianDeterminant(body.mesh), interpolation_points(space)))
    return sizes.x.array.copy()
