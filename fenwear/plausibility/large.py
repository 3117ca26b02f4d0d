"""Displacements beyond small strain: where a body turns or stretches so much that the linear theory does not hold.

The theory takes the gradient G of the displacement to be small against 1: it leaves out terms of the relative size of
the strain e (symmetric part of G) and the rotation w (the other one). Both are taken as means over the elements,
weighted by e : e, that is by where a body is strained, so that a singular corner or an idle part counts for little:

    strain^2 = sum V (e : e)^2 / sum V e : e,      rotation^2 = sum V (w : w / 2) e : e / sum V e : e
"""

from __future__ import annotations

import numpy as np
from dolfinx import fem
from dolfinx.cpp.mesh import cell_num_vertices
from mpi4py import MPI

from fenwear.arrays import Array
from fenwear.assembly import Tribosystem
from fenwear.bodies.elasticity import ElasticBody
from fenwear.case import CONDENSED
from fenwear.compat import geometry_dofmap
from fenwear.contact import ContactState
from fenwear.parallel import total
from fenwear.plausibility.meshes import Fields
from fenwear.results.fields import displacements

LARGE = 0.05  # strain, or rotation in rad: the linear theory leaves out terms of this relative size


def strain_and_rotation(elastic: ElasticBody, displacement: fem.Function) -> tuple[float, float]:
    """Return the strain and the rotation (rad) of a body where it is strained; collective."""
    mesh, dim = elastic.body.mesh, elastic.dim
    corners, own = cell_num_vertices(mesh.topology.cell_type), mesh.topology.index_map(dim).size_local
    x = mesh.geometry.x[geometry_dofmap(mesh)[:own, :corners], :dim]
    u = displacement.x.array.reshape(-1, dim)[elastic.space.dofmap.list[:own, :corners]]
    x, u = x - x.mean(axis=1, keepdims=True), u - u.mean(axis=1, keepdims=True)
    metric = np.einsum("cki,ckj->cij", x, x)
    gradient = np.linalg.solve(metric, np.einsum("cki,ckj->cij", x, u))
    turned = gradient.transpose(0, 2, 1)
    strain, spin = (gradient + turned) / 2, (gradient - turned) / 2
    squares: Array = np.einsum("cij,cij->c", strain, strain)
    weights = np.sqrt(np.linalg.det(metric)) * squares
    sums = np.array([weights.sum(), weights @ squares, weights @ np.einsum("cij,cij->c", spin, spin) / 2])
    weight, strains, spins = total(mesh.comm, sums)
    return float(np.sqrt(strains / max(weight, 1e-300))), float(np.sqrt(spins / max(weight, 1e-300)))


def large(system: Tribosystem, contact: ContactState) -> Fields:
    """Return the body that a contact moves beyond small strain; nothing where none does; collective."""
    if any(body.operator != CONDENSED for body in (system.bodies.punch, system.bodies.strip)):
        return {}  # bodies that nothing but their contact knows
    for elastic, displacement in displacements(system, contact.pressure[0], contact.rigid[0]):
        stretched, turned = strain_and_rotation(elastic, displacement)
        if max(stretched, turned) > LARGE:
            own = np.linalg.norm(displacement.x.array.reshape(-1, elastic.dim), axis=1).max(initial=0.0)
            return {
                "body": elastic.body.name,
                "farthest": float(elastic.body.mesh.comm.allreduce(float(own), op=MPI.MAX)),
                "stretched": 100 * stretched,
                "turned": np.degrees(turned),
                "percent": 100 * max(stretched, turned),
            }
    return {}
