"""Strains of the strip's surface at the contact nodes: what displacement changes along the surface."""

from __future__ import annotations

import basix
import numpy as np
from scipy.sparse import coo_array, csr_array

from fenwear.arrays import Array
from fenwear.bodies.contact_surface import ContactSurface
from fenwear.bodies.subcells import linear_cells
from fenwear.stick.position import Position


def along_sliding(position: Position) -> Array:
    """Return what turns tangential components at each node to those along and across the sliding (n, m, m).

    In the plane along x; where a turning strip does not move, on its axis, along the first tangent.
    """
    n, d = position.pair.normal.shape
    if d == 2:
        return np.ones((n, 1, 1))
    moved = position.drive[n:].reshape(2, n).T
    size = np.linalg.norm(moved, axis=1, keepdims=True)
    still = size <= 1e-12 * size.max(initial=1e-300)
    along = np.where(still, [1.0, 0.0], moved / np.where(still, 1.0, size))
    return np.stack([along, np.column_stack([-along[:, 1], along[:, 0]])], axis=1)


def directions(position: Position) -> Array:
    """Return the unit vectors along and across the sliding at each node (n, m, d)."""
    return np.einsum("nam,nmc->nac", along_sliding(position), position.frame[:, 1:])


def surface_gradient(surface: ContactSurface) -> list[csr_array]:
    """Return the derivatives along each axis, within the surface, of values at its pressure nodes, d of (n, n).

    The values go straight from node to node: at the edge of a stick zone, where the strain has a vertical tangent, a
    parabola through nodes that stick and one that has slipped turns round and sets strains of the wrong sign beside it.
    At a node the mean of the linear cells about it, each weighted by one over its size: no larger than the largest of
    them, and of second order, which the mean by size is not where cells differ in size.
    """
    straight = surface.cell == "triangle"  # values live on the vertices
    cells = linear_cells(surface.cell, 1 if straight else surface.degree)
    if surface.cell == "quadrilateral":
        cells = cells[:, [0, 1, 3, 2]]  # basix' order of corners
    corners = cells.shape[1]
    facets = surface.facets[:, cells].reshape(-1, corners)
    element = basix.create_element(basix.ElementFamily.P, basix.CellType[surface.cell], 1)
    table = element.tabulate(1, element.points)[1:, :, :, 0]
    jacobian = np.einsum("dqk,fkc->fqcd", table, surface.trace[facets])
    values = np.einsum("fqdc,dqk->cfqk", np.linalg.pinv(jacobian), table)
    weight = 1 / np.sqrt(np.linalg.det(np.swapaxes(jacobian, -1, -2) @ jacobian)).mean(axis=1)
    number = np.zeros(len(surface.trace), dtype=np.int64)
    number[surface.nodes] = np.arange(len(surface.nodes))
    places, n = number[facets], len(surface.nodes)
    rows = np.broadcast_to(places[:, :, None], values.shape[1:]).ravel()
    columns = np.broadcast_to(places[:, None, :], values.shape[1:]).ravel()
    share = np.bincount(places.ravel(), np.repeat(weight, corners), n)
    scaled = values * weight[:, None, None]
    return [csr_array(coo_array((v.ravel() / share[rows], (rows, columns)), shape=(n, n))) for v in scaled]


def surface_strain(position: Position, gradient: list[csr_array], on_strip: Array) -> Array:
    """Return the strip's strains along and across the sliding opposite each contact node (n, m).

    Args:
        position: The place of the strip.
        gradient: Of the punch's contact surface.
        on_strip: Displacement of what the strip was condensed onto (q, d), mm.
    """
    u = position.pair.placement.vectors(position.reading @ on_strip)
    slopes = np.stack([derivative @ u for derivative in gradient], axis=2)  # (n, d of u, d)
    ways = directions(position)
    return np.einsum("nac,ncb,nab->na", ways, slopes, ways)
