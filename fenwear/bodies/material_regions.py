"""Material regions of a contact surface, and the densities of their worn material."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from mpi4py import MPI

from fenwear.bodies.contact_surface import CORNERS, facet_dofs
from fenwear.bodies.elasticity import ElasticBody
from fenwear.common.arrays import Array


def contact_regions(body: ElasticBody) -> Mapping[str, Array]:
    """Return the share of each material region in the pressure nodes (n,), by its name; collective.

    A node between regions belongs to each by the area of its facets there.
    """
    mesh = body.body
    local, cells = facet_dofs(mesh, body.space)
    index_map = mesh.mesh.topology.index_map(mesh.mesh.topology.dim)
    of_cell = np.zeros((index_map.size_local + index_map.num_ghosts, len(mesh.regions)))
    for column, tag in enumerate(mesh.regions.values()):
        of_cell[mesh.cell_tags.find(tag), column] = 1.0
    blocks = body.space.dofmap.index_map.local_to_global(local.ravel()).astype(np.int64)
    order = np.argsort(body.trace.blocks)
    nodes = order[np.searchsorted(body.trace.blocks[order], blocks)]
    corners = body.space.tabulate_dof_coordinates()[local[:, : CORNERS[body.meshed.cell]]]
    edges = corners[:, 1:] - corners[:, :1]
    areas = np.sqrt(np.linalg.det(edges[:, :2] @ edges[:, :2].transpose(0, 2, 1)))
    sums = np.zeros((len(order), len(mesh.regions)))
    np.add.at(sums, nodes, np.repeat(of_cell[cells] * areas[:, None], local.shape[1], axis=0))
    mesh.mesh.comm.Allreduce(MPI.IN_PLACE, sums, op=MPI.SUM)
    shares = body.on_surface(sums / sums.sum(axis=1, keepdims=True))[body.surface.nodes]
    return dict(zip(mesh.regions, shares.T, strict=True))


def contact_density(shares: Mapping[str, Array], densities: Mapping[str, float | None]) -> Array | None:
    """Return the density at the pressure nodes (n,), N s²/mm⁴; None where a region there has none.

    A node between two regions has the mean of both.

    Args:
        shares: Of the regions in the nodes (n,), by their names.
        densities: Of the regions.
    """
    density = np.zeros(len(next(iter(shares.values()))))
    for name, share in shares.items():
        rho = densities.get(name)
        density += np.where(share > 0, share * (np.nan if rho is None else rho), 0.0)
    return density if bool(np.isfinite(density).all()) else None
