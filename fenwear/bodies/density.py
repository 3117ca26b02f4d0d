"""The density of what is worn off a body: that of the regions which its contact surface belongs to."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from mpi4py import MPI

from fenwear.arrays import Array
from fenwear.bodies.contact_surface import facet_dofs
from fenwear.bodies.elasticity import ElasticBody


def contact_density(body: ElasticBody, densities: Mapping[str, float | None]) -> Array | None:
    """Return the density at the pressure nodes (n,), N s²/mm⁴; None where a region there has none; collective.

    A node between two regions has the mean of both.

    Args:
        body: The body.
        densities: Of its regions, by their names.
    """
    mesh = body.body
    local, cells = facet_dofs(mesh, body.space)
    of_tag = {mesh.regions[name]: np.nan if rho is None else rho for name, rho in densities.items()}
    index_map = mesh.mesh.topology.index_map(mesh.mesh.topology.dim)
    of_cell = np.full(index_map.size_local + index_map.num_ghosts, np.nan)
    for tag, rho in of_tag.items():
        of_cell[mesh.cell_tags.find(tag)] = rho
    blocks = body.space.dofmap.index_map.local_to_global(local.ravel()).astype(np.int64)
    order = np.argsort(body.trace.blocks)
    nodes = order[np.searchsorted(body.trace.blocks[order], blocks)]
    sums = np.zeros((2, len(order)))
    np.add.at(sums[0], nodes, np.repeat(of_cell[cells], local.shape[1]))
    np.add.at(sums[1], nodes, 1.0)
    mesh.mesh.comm.Allreduce(MPI.IN_PLACE, sums, op=MPI.SUM)
    density = (sums[0] / sums[1])[body.surface.nodes]
    return density if bool(np.isfinite(density).all()) else None
