"""Bodies that are worn through: a depth beyond what there is of the body below the contact surface.

The wear of a run is a depth at each contact node, whatever the meshes make of it. The body is as thick there as the
line from the node along the normal into the body is long, up to where it leaves the body as it was made.
"""

from __future__ import annotations

import numpy as np
from dolfinx.mesh import exterior_facet_indices

from fenwear.arrays import Array
from fenwear.bodies.contact_surface import contact_tag
from fenwear.bodies.elasticity import ElasticBody
from fenwear.compat import facet_nodes

AT_ONCE = 2_000_000  # pairs of a node and a facet
SLACK = 1e-6  # of a facet's size: what a line may miss it by
SHARE = 0.05  # of a contact surface, that is worn through: less may be the thin end of a wedge


def thickness(elastic: ElasticBody) -> Array:
    """Return how thick a body is below each contact node (n,), mm; collective.

    Args:
        elastic: On its mesh as it was made.
    """
    surface, opposite = elastic.surface, _opposite(elastic)
    begin: Array = surface.x
    inward = -surface.outward
    found = np.empty(len(begin))
    size = max(1, AT_ONCE // max(1, len(opposite)))
    for first in range(0, len(begin), size):
        some = slice(first, first + size)
        found[some] = _lengths(begin[some], inward[some], opposite)
    # A line that slips out along an edge: as far as the body reaches at all.
    reach = np.array([((opposite - x) @ d).max(initial=0.0) for x, d in zip(begin, inward, strict=True)])
    return np.where(np.isfinite(found), found, reach)


def least_thickness(elastic: ElasticBody) -> float:
    """Return a length, mm, that a body is at least thick below its contact nodes; collective.

    The distance of the box around the nodes from those around what else the body ends at: of no cost, and enough where
    the contact lies far from it.
    """
    x, opposite = elastic.surface.x, _opposite(elastic)
    low, high = opposite.min(axis=1), opposite.max(axis=1)
    apart = np.maximum(np.maximum(low - x.max(axis=0), x.min(axis=0) - high), 0.0)
    return float(np.linalg.norm(apart, axis=1).min(initial=np.inf))


def _opposite(elastic: ElasticBody) -> Array:
    """Return the corners (f, d, d) of segments or triangles of the boundary beside the contact surface; collective."""
    body, mesh = elastic.body, elastic.body.mesh
    dim = mesh.topology.dim
    mesh.topology.create_connectivity(dim - 1, dim)
    facets = np.setdiff1d(exterior_facet_indices(mesh.topology), body.facet_tags.find(contact_tag(body)))
    nodes, cell = facet_nodes(mesh, facets.astype(np.int32)), mesh.basix_cell().name
    halves = [[0, 1, 2], [1, 2, 3]] if cell == "hexahedron" else [list(range(dim))]
    own = np.concatenate([mesh.geometry.x[nodes[:, half], :dim] for half in halves])
    return np.concatenate(mesh.comm.allgather(own))


def _lengths(begin: Array, along: Array, facets: Array) -> Array:
    """Return how far lines (m, d) go in unit directions until they meet a facet (f, d, d); infinite for none."""
    sides = facets[:, 1:] - facets[:, :1]  # (f, d - 1, d)
    dim = begin.shape[1]
    first, last = sides[:, 0], sides[:, -1]
    normals: Array = np.column_stack([first[:, 1], -first[:, 0]])
    if dim == 3:
        normals = np.cross(first, last).astype(np.float64)
    areas = np.linalg.norm(normals, axis=1)
    across = along @ normals.T  # (m, f)
    meets = np.abs(across) > SLACK * areas
    to = ((facets[:, 0] * normals).sum(axis=1) - begin @ normals.T) / np.where(meets, across, 1.0)
    dual = np.linalg.pinv(sides)  # (f, d, d - 1): coordinates of a point in the facet
    shift = np.einsum("fi,fij->fj", facets[:, 0], dual)
    inside = np.einsum("mi,fij->mfj", begin, dual) - shift + to[..., None] * np.einsum("mi,fij->mfj", along, dual)
    hit = meets & (inside > -SLACK).all(axis=2) & (inside.sum(axis=2) < 1 + SLACK)
    size = float(np.ptp(facets.reshape(-1, dim), axis=0).max())
    return np.where(hit & (to > SLACK * size), to, np.inf).min(axis=1, initial=np.inf)


def worn_through(elastic: ElasticBody, thick: Array, depths: Array) -> Array:
    """Return in which of k half-cycles a body is worn through (k,) bool.

    Args:
        elastic: The body.
        thick: Its thickness below the contact nodes (n,), mm.
        depths: Worn off them (k, n), mm.
    """
    weights = elastic.surface.weights
    return np.asarray((depths >= thick) @ weights >= SHARE * weights.sum())
