"""Static condensation of a body onto its contact surface.

All a half-cycle needs of a body is how its contact surface answers to what acts on it. With the
contact frame (e_n into the punch, e_t along the sliding direction), K u = f + C p gives for unit
nodal forces at the n contact nodes the compliances D_nn = N K^-1 N^T and D_nt = N K^-1 T^T, where
N and T pick the normal and tangential displacement of the nodes. As K is symmetric the n normal
forces suffice: D_nt is the transpose of their tangential displacements.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import ufl
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc
from scipy.sparse import csr_array

from fenwear.arrays import Array
from fenwear.bodies.elasticity import ElasticBody
from fenwear.parallel import total

BLOCK = 64  # right-hand sides solved at once: enough for BLAS 3, and the memory stays small


@dataclass(frozen=True)
class SurfaceNodes:
    """The nodes of a contact surface in order along it, the same on every rank.

    Attributes:
        x: Coordinates (n, 2), mm, ascending in x.
        weights: Integrals of the nodes' shape functions over the surface (n,), mm; all positive.
        normal: Unit normals e_n into the punch (n, 2).
        tangent: Unit tangents e_t, towards +x (n, 2).
        block: Global number of each node's block of displacement degrees of freedom (n,).
        degree: Polynomial degree: every facet has degree + 1 consecutive nodes.
    """

    x: Array
    weights: Array
    normal: Array
    tangent: Array
    block: NDArray[np.int64]
    degree: int


@dataclass(frozen=True)
class Surface:
    """A body condensed onto its contact nodes, per thickness, the same on every rank.

    Attributes:
        nodes: The contact nodes.
        normal_by_normal: D_nn (n, n), mm per N/mm.
        normal_by_tangential: D_nt (n, n), mm per N/mm.
        normal_by_load: Normal displacement from the body's loads (n,), mm.
        normal_by_temperature: Normal displacement from the temperature of this rank's own nodes
            (n, owned), mm/K; None without heat. The one member that is not the same on every rank.
    """

    nodes: SurfaceNodes
    normal_by_normal: Array
    normal_by_tangential: Array
    normal_by_load: Array
    normal_by_temperature: Array | None = None


def surface_nodes(elastic: ElasticBody) -> SurfaceNodes:
    """Gather the contact nodes of a body; collective."""
    body, space = elastic.body, elastic.space
    own = elastic.contact_nodes()
    tag = body.curves[f"{body.name}_contact"]
    into_punch = -1.0 if body.name == "punch" else 1.0
    one = ufl.as_vector((1.0, 1.0))
    weights = elastic.surface_integral(one, tag).array_r.reshape(-1, 2)[own, 0]
    normals = into_punch * elastic.surface_integral(ufl.FacetNormal(body.mesh), tag).array_r.reshape(-1, 2)[own]
    index_map = space.dofmap.index_map
    part = (
        space.tabulate_dof_coordinates()[own, :2],
        weights,
        normals / np.linalg.norm(normals, axis=1, keepdims=True),
        index_map.local_to_global(own).astype(np.int64),
    )
    x, weights, normal, block = (np.concatenate(items) for items in zip(*body.mesh.comm.allgather(part), strict=True))
    order = np.argsort(x[:, 0], kind="stable")
    normal = normal[order]
    tangent = np.stack([normal[:, 1], -normal[:, 0]], axis=1)
    degree = space.ufl_element().degree
    return SurfaceNodes(x[order], weights[order], normal, tangent, block[order], degree)


def rigid_motion(elastic: ElasticBody, nodes: SurfaceNodes) -> tuple[Array, Array]:
    """Return the normal and the tangential displacement of the rigid modes, (n, modes) each; collective."""
    modes = [at_nodes(elastic, nodes, mode[:, None]) for mode in elastic.rigid_modes]
    rigid = np.concatenate(modes, axis=2) if modes else np.zeros((len(nodes.block), 2, 0))
    return np.einsum("ic,icm->im", nodes.normal, rigid), np.einsum("ic,icm->im", nodes.tangent, rigid)


def condense(elastic: ElasticBody, nodes: SurfaceNodes, thermal_coupling: PETSc.Mat | None = None) -> Surface:
    """Condense a body onto its contact nodes: n solves with one factorisation; collective.

    With the coupling G of thermal expansion the same solves give N K^-1 G, as K is symmetric.
    """
    n = len(nodes.weights)
    normal_by_normal, tangential_by_normal = np.empty((n, n)), np.empty((n, n))
    rows: list[Array] = []
    for start in range(0, n, BLOCK):
        columns = slice(start, min(start + BLOCK, n))
        displacement, by_temperature = _respond(elastic, nodes, columns, thermal_coupling)
        if by_temperature is not None:
            rows.append(by_temperature)
        normal_by_normal[:, columns] = np.einsum("ic,icj->ij", nodes.normal, displacement)
        tangential_by_normal[:, columns] = np.einsum("ic,icj->ij", nodes.tangent, displacement)
    return Surface(
        nodes,
        (normal_by_normal + normal_by_normal.T) / 2,
        tangential_by_normal.T.copy(),
        respond_to_load(elastic, nodes),
        np.concatenate(rows) if rows else None,
    )


def respond_to_load(elastic: ElasticBody, nodes: SurfaceNodes) -> Array:
    """Return the normal displacement of the nodes under the body's loads (n,), mm; collective."""
    solution = elastic.load.duplicate()
    elastic.factor.solve(elastic.load, solution)
    return np.einsum("ic,ick->i", nodes.normal, at_nodes(elastic, nodes, solution.array_r[:, None]))


def at_nodes(elastic: ElasticBody, nodes: SurfaceNodes, values: Array) -> Array:
    """Pick fields at the contact nodes and share them with every rank; collective.

    Args:
        values: Owned degrees of freedom of k fields (local, k).

    Returns:
        Shape (n, 2, k), equal to the last bit on every rank.
    """
    start, stop = elastic.space.dofmap.index_map.local_range
    own = np.flatnonzero((nodes.block >= start) & (nodes.block < stop))
    picked = np.zeros((len(nodes.block), 2, values.shape[1]))
    local = (nodes.block[own] - start)[:, None] * 2 + np.arange(2)
    picked[own] = values[local]
    elastic.body.mesh.comm.Allreduce(MPI.IN_PLACE, picked, op=MPI.SUM)  # each node has one owner: exact
    return picked


def _transposed_times(matrix: PETSc.Mat, fields: Array) -> Array:
    """Return the transpose of matrix^T fields (k, owned columns), added up in the order of the ranks; collective."""
    starts, columns, values = matrix.getValuesCSR()
    part = csr_array((values, columns, starts), shape=(len(fields), matrix.getSize()[1])).T @ fields
    first, last = matrix.getOwnershipRangeColumn()
    return np.ascontiguousarray(total(matrix.comm.tompi4py(), part)[first:last].T)


def _respond(
    elastic: ElasticBody, nodes: SurfaceNodes, columns: slice, thermal_coupling: PETSc.Mat | None
) -> tuple[Array, Array | None]:
    """Return the nodes' displacements (n, 2, k) from unit normal forces at `columns`, and G^T of them; collective."""
    comm = elastic.body.mesh.comm
    local, every = elastic.stiffness.getSizes()[0]
    chosen = range(*columns.indices(len(nodes.block)))
    sizes = ((local, every), (PETSc.DECIDE, len(chosen)))
    forces = PETSc.Mat().createDense(sizes, comm=comm)
    forces.setUp()
    start, stop = elastic.space.dofmap.index_map.local_range
    array = forces.getDenseArray()
    for column, node in enumerate(chosen):
        row = nodes.block[node] - start
        if 0 <= row < stop - start:
            array[2 * row : 2 * row + 2, column] = nodes.normal[node]
    array[elastic.supported] = 0.0
    forces.assemble()
    displacement = forces.duplicate()
    displacement.setUp()
    elastic.factor.matSolve(forces, displacement)
    result = at_nodes(elastic, nodes, displacement.getDenseArray())
    by_temperature = None
    if thermal_coupling is not None:
        by_temperature = _transposed_times(thermal_coupling, displacement.getDenseArray())
    forces.destroy()
    displacement.destroy()
    return result, by_temperature
