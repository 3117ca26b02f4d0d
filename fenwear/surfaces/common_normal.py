"""The common normal of surfaces that stick: half-way between those of both bodies, neither before the other.

Bodies that are mirror images then have the plane between them for their contact, as they do when they are pressed on
each other. Where the punch has an edge, as a flat face beside its chamfer, the face that looks at the other body
counts: it is the one that touches.
"""

from __future__ import annotations

import basix
import numpy as np
from numpy.typing import NDArray

from fenwear.bodies.contact_surface import ContactSurface
from fenwear.common.arrays import Array

ACROSS = 0.95  # component of a normal along x from which on tangents are counted from y
EDGE = np.cos(np.radians(20))  # cosine of the angle between facets beyond which an edge is no smooth surface


def common_normal(punch: ContactSurface, strip: Array) -> Array:
    """Return e_n (n, d), unit normals into the punch.

    Args:
        punch: Whose pressure nodes they are.
        strip: Unit normals out of the strip opposite each node (n, d).
    """
    return unit(strip - facing_normal(punch, strip))


def contact_frame(normal: Array) -> Array:
    """Return e_n and the tangents of each node (n, d, d), by rows, for e_n (n, d).

    The first tangent lies along x as far as it can; in the plane it continues around curves, in a solid it lies along y
    where the normal is nearly that of x.
    """
    if normal.shape[1] == 2:
        return np.stack([normal, np.stack([normal[:, 1], -normal[:, 0]], axis=1)], axis=1)
    along = np.where(np.abs(normal[:, :1]) < ACROSS, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    first = unit(along - np.einsum("ic,ic->i", along, normal)[:, None] * normal)
    return np.stack([normal, first, np.cross(normal, first)], axis=1)


def unit(vectors: Array) -> Array:
    """Return vectors (n, d) of length 1."""
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def facing_normal(surface: ContactSurface, other: Array) -> Array:
    """Return the unit normals out of a body at its pressure nodes (n, d); at an edge of the facets that face most.

    Args:
        surface: The surface.
        other: Unit normals of the other body opposite each node (n, d).
    """
    area, node = _outward_areas(surface)
    area, node = area[node >= 0], node[node >= 0]
    normal = unit(area)
    facing = -np.einsum("ic,ic->i", normal, other[node])
    order = np.lexsort((facing, node))  # of each node the facet that faces most comes last
    most = order[np.append(node[order][1:] != node[order][:-1], True)]
    smooth = np.einsum("ic,ic->i", normal, normal[most][node]) > EDGE
    normals_out = surface.outward.copy()
    edge = np.unique(node[~smooth])
    kept = np.zeros_like(normals_out)
    np.add.at(kept, node[smooth], area[smooth])
    normals_out[edge] = unit(kept[edge])
    return normals_out


def facet_normals(surface: ContactSurface) -> Array:
    """Return the mean unit normals of the facets out of a body (f, d)."""
    area, _ = _outward_areas(surface)
    return unit(area.reshape(len(surface.facets), -1, surface.dim).sum(axis=1))


def _outward_areas(surface: ContactSurface) -> tuple[Array, NDArray[np.int64]]:
    """Return normals out of the body at the trace nodes of each facet (f k, d), and their pressure node, or -1 (f k,).

    They are as long as the facet is large there; where a node carries no pressure the facet's others say which way is
    outward.
    """
    node = surface.number[surface.facets]
    area = _area_vectors(surface)
    along = np.einsum("fkc,fkc->fk", area, surface.outward[node]) * (node >= 0)
    area *= np.sign(np.where(node >= 0, along, along.sum(axis=1, keepdims=True)))[:, :, None]
    return area.reshape(-1, surface.dim), node.ravel()


def _area_vectors(surface: ContactSurface) -> Array:
    """Return normals of the facets at their trace nodes, as long as the facet is large there (f, k, d), of any sign."""
    cell = basix.CellType[surface.cell]
    variant = basix.LagrangeVariant.gll_warped
    element = basix.create_element(basix.ElementFamily.P, cell, surface.degree, variant)
    slopes = np.einsum("tqk,fkd->tfqd", element.tabulate(1, element.points)[1:, :, :, 0], surface.trace[surface.facets])
    if surface.dim == 2:
        return np.stack([slopes[0, :, :, 1], -slopes[0, :, :, 0]], axis=2)
    return np.asarray(np.cross(slopes[0], slopes[1]))
