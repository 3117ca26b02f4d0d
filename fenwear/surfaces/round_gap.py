"""The gap of round surfaces: that of their circles, cylinders and spheres, not of the facets that follow them.

Facets of both surfaces leave their circles here and there, by what differs from node to node where meshes do not match:
pressures of stiff or closely fitting bodies would go to and fro by it, and no wear of the punch would even it out under
a strip that moves. With the surfaces x_p and x_s of the facets opposite each other, and the distance g of the circles,

    g_i = integral of psi_i g / w_i,    e_n = the normal of the strip's circle at the node,

by the psi_i of the transfer (`transfer`), which take displacements along, too. Where meshes have followed the wear what
the circles add to the facets is that of the meshes as they were made.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from fenwear.bodies.contact_surface import ContactSurface
from fenwear.bodies.round_surfaces import Round
from fenwear.common.arrays import Array
from fenwear.surfaces.common_normal import unit
from fenwear.surfaces.overlap import Patch
from fenwear.surfaces.placement import Placement
from fenwear.surfaces.transfer import dual_means


@dataclass(frozen=True)
class RoundShape:
    """Depth of round surfaces below their facets, at the punch's pressure nodes; zero where the strip is not round.

    Attributes:
        turned: To be added to the normal of the facets (n, d).
        moved: To be added to the way from the strip's facets to the punch's (n, d), mm.
    """

    turned: Array
    moved: Array


def round_shape(
    parts: Sequence[Patch],
    punch: ContactSurface,
    strip: ContactSurface,
    placement: Placement,
    transfer: csr_array,
    material: csr_array,
) -> RoundShape:
    """Return the differences of round surfaces from their facets.

    Args:
        parts: The patches of the contact.
        punch, strip: The surfaces.
        placement: Of the strip.
        transfer, material: As of `pair.ContactPair`: what takes the strip's trace and its pressure nodes to the punch.
    """
    surface, other = punch.made or punch, strip.made or strip
    none: Array = np.zeros_like(punch.x)
    of_strip = [_placed(shape, placement) for shape in strip.rounds[0]]
    if not of_strip:
        return RoundShape(none, none)
    opposite = _opposite(parts, len(punch.weights), strip)
    round_ = opposite >= 0
    if not round_.any():
        return RoundShape(none, none)
    of_punch, on_punch = punch.rounds
    gaps = []
    for part in parts:
        first, second, common = part.first, part.second, part.common
        nodes = first.facets[common.facet1]
        x = np.einsum("qk,qkc->qc", first.shape_functions(common.points1), surface.trace[nodes])
        for k, shape in enumerate(of_punch):
            there = on_punch[nodes[:, 0]] == k
            x[there] = shape.onto(x[there])
        gap: Array = np.zeros(len(x))
        below = strip.rounds[1][second.facets[common.facet2][:, 0]]
        for k, shape in enumerate(of_strip):
            there = below == k
            gap[there] = shape.sign * (np.linalg.norm(shape.ways(x[there]), axis=1) - shape.radius)
        gaps.append(gap)
    means, normal = dual_means(parts, gaps), np.ones_like(surface.x)
    for k, shape in enumerate(of_strip):
        normal[opposite == k] = shape.sign * unit(shape.ways(surface.x[opposite == k]))
    of_facets = unit(material @ placement.vectors(other.outward))
    apart = surface.spread.T @ surface.trace - transfer @ placement.points(other.trace)
    missing = means - np.einsum("ic,ic->i", normal, apart)
    return RoundShape(
        np.where(round_[:, None], normal - of_facets, none), np.where(round_[:, None], missing[:, None] * normal, none)
    )


def _placed(shape: Round, placement: Placement) -> Round:
    """Return a round surface where its body is."""
    return Round(
        placement.points(shape.middle[None])[0], placement.vectors(shape.axis[None])[0], shape.radius, shape.sign
    )


def _opposite(parts: Sequence[Patch], count: int, strip: ContactSurface) -> Array:
    """Return the number of the strip's round surface opposite each of the punch's nodes (n,), -1 for none."""
    most = len(strip.rounds[0])
    lowest = np.full(count, most)
    for part in parts:
        common, nodes = part.common, part.first.pressure_facets[part.common.facet1]
        below = np.broadcast_to(strip.rounds[1][part.second.facets[common.facet2][:, :1]], nodes.shape)
        np.minimum.at(lowest, nodes[nodes >= 0], below[nodes >= 0])
    return np.where(lowest == most, -1, lowest)
