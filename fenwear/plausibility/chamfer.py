"""Chamfers beside the punch's contact surface: what wear would bring into contact and the model leaves out.

A surface that is worn by a depth w beside a chamfer at the angle phi becomes wider by w cot phi there. The tagged
contact surface stays as wide as it was made: the worn volume is that of the load, but pressures and depths are those
of the narrower surface, and a mesh that follows the wear draws the chamfer's first elements along.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from dolfinx.mesh import exterior_facet_indices
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.assembly import Tribosystem
from fenwear.bodies.contact_surface import contact_tag
from fenwear.bodies.mesh import BodyMesh
from fenwear.compat import facet_nodes
from fenwear.plausibility.ends import SMOOTH
from fenwear.plausibility.rim import rim_edges
from fenwear.sliding.wear import WornDepths

STEEP = 0.27  # cotangent of 75 degrees: beyond, a chamfer widens by a quarter of the depth
WIDER = 0.02  # of the surface's width
OPPOSED = 1e-6  # length of the mean of unit normals that is rounding


@dataclass(frozen=True)
class Chamfer:
    """The chamfer beside a punch's contact surface, of the meshes as they were made.

    Attributes:
        nodes: Contact nodes beside it (k,).
        cotangent: Of its angle there (k,).
        width: Of the contact surface between its chamfers, mm.
    """

    nodes: NDArray[np.int64]
    cotangent: Array
    width: float

    def widened(self, system: Tribosystem, worn: WornDepths) -> float:
        """Return how much wider the contact would be for the depths worn off both bodies, both sides together, mm."""
        opening = system.pair.opening(worn.punch, worn.strip)[self.nodes]
        return float(2 * (opening * self.cotangent).max())

    def text(self, widened: float) -> str:
        """Say that the contact would be wider; "" where it hardly would."""
        if widened < WIDER * self.width:
            return ""
        return (
            f"the chamfer beside punch_contact comes into contact as the surface wears: it would be about "
            f"{widened:.2g} mm wider than the {self.width:.3g} mm that are tagged, and pressures and depths are those "
            "of the narrow one; make the chamfer part of punch_contact"
        )


def contact_chamfer(system: Tribosystem) -> Chamfer | None:
    """Return the chamfer beside the punch's contact surface; collective. None for upright sides and smooth surfaces.

    None, too, where contacts look opposite ways, as pads on both faces of a disc: they have no normal in common.

    Args:
        system: On meshes as they were made, not moved by wear.
    """
    pair, punch = system.pair, system.bodies.punch
    x: Array = pair.punch.x
    cotangent: Array = np.zeros(len(x))  # of the boundary's angle beyond each node of the rim
    normal = pair.normal.mean(axis=0)
    if np.linalg.norm(normal) < OPPOSED:
        return None
    normal /= np.linalg.norm(normal)
    if pair.punch.dim == 3:
        edges, inward, outward = rim_edges(punch, pair.punch)
        at_trace = np.zeros(len(pair.punch.trace))
        np.maximum.at(at_trace, edges[:, :2].ravel(), np.repeat(_cotangents(inward, outward, normal), 2))
        cotangent = at_trace[pair.punch.nodes]
    else:
        cotangent[[0, -1]] = _at_ends(punch.body, normal)
    nodes: NDArray[np.int64] = np.flatnonzero(cotangent)
    if not len(nodes):
        return None
    middle = (pair.weights @ x) / pair.weights.sum()
    width = 2 * float(np.linalg.norm(x[nodes] - middle, axis=1).min())
    return Chamfer(nodes, cotangent[nodes], width)


def _cotangents(inward: Array, outward: Array, normal: Array) -> Array:
    """Return cot phi (m,) of the boundary beyond edges of a contact surface, zero where it is no chamfer.

    Args:
        inward, outward: Unit vectors into the contact surface and into the boundary beyond (m, d); zero for none.
        normal: Into the body (d,).
    """
    away = inward @ normal[:, None] * normal - inward
    away /= np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-300)
    rise, run = outward @ normal, np.einsum("ij,ij->i", outward, away)
    cotangent = run / np.maximum(rise, 1e-300)
    smooth = np.einsum("ij,ij->i", inward, outward) < -SMOOTH
    return np.where(smooth | (rise <= 0) | (cotangent < STEEP), 0.0, cotangent)


def _at_ends(body: BodyMesh, normal: Array) -> Array:
    """Return cot phi of the boundary beyond the left and right end of a contact curve (2,); collective."""
    mesh = body.mesh
    mesh.topology.create_connectivity(1, 2)
    facets = exterior_facet_indices(mesh.topology)
    corners = facet_nodes(mesh, facets)[:, :2]
    own = (mesh.geometry.x[corners][:, :, :2], np.isin(facets, body.facet_tags.find(contact_tag(body))))
    x, contact = (np.concatenate(part) for part in zip(*mesh.comm.allgather(own), strict=True))
    directions: Array = np.zeros((2, 2, 2))  # into the contact, and beyond
    for k, sign in enumerate((-1, 1)):
        end = x[contact].reshape(-1, 2)[np.argmax(sign * x[contact][..., 0].ravel())]
        near = np.linalg.norm(x - end, axis=2) < 1e-9 * np.ptp(x[..., 0])
        for i, touching in enumerate((True, False)):
            for facet in np.flatnonzero(near.any(axis=1) & (contact == touching)):
                step = x[facet][~near[facet]][0] - end
                directions[i, k] = step / np.linalg.norm(step)
    return _cotangents(directions[0], directions[1], normal)
