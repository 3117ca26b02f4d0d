"""Contact that reaches the rim of a solid's meshed surface where both bodies go on: clipped.

Beyond its rim a contact surface has an edge, as a flat-ended pin, or the body goes on smoothly, as a ball of which a
part is tagged. strip_contact reaches at least as far as punch_contact, so that the punch's rim is what is met: it
clips the contact wherever the punch goes on, and the strip has no edge.

How wide it should be is estimated by volumes. With a paraboloid of the unworn gap's principal curvatures,
g = (k_1 s_1² + k_2 s_2²) / 2, the space below a level D has the volume pi D² / sqrt(k_1 k_2) and reaches as far as
s_i = sqrt(2 D / k_i). D is at least what Hertz closes under the load F,

    D = a² / (2 R),    a³ = 3 F R / (4 E*),    R = 1 / sqrt(k_1 k_2).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import basix
import numpy as np
from dolfinx.mesh import exterior_facet_indices
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fenwear import compat
from fenwear.arrays import Array, Mask
from fenwear.assembly import Tribosystem
from fenwear.bodies.contact_surface import ContactSurface, contact_tag
from fenwear.bodies.elasticity import ElasticBody
from fenwear.plausibility.ends import SMOOTH, WIDER, contact_modulus

NEAR = 1e-6  # of the surface's extent: corners that are the same
BESIDE = 1e-3  # of the surface's extent: nodes on an edge of the other body
ROUND = 1e-3  # least of both curvatures over the other: below, contact is no ellipse

_Ints = NDArray[np.int64]


@dataclass(frozen=True)
class ContactRim:
    """The rim of the contact surface of a solid, of the meshes as they were made.

    Attributes:
        clips: Contact nodes on the rim where both bodies go on (n,) bool.
        x: Contact nodes (n, 3), mm.
        width: Of the surface along the direction in which it is widest, mm.
        curvatures: k_1 >= k_2 of the unworn gap, 1/mm; None where it is no paraboloid.
        modulus: E*, MPa.
        of_grid: Whether it is the rim of a contact grid within the surface.
    """

    clips: Mask
    x: Array
    width: float
    curvatures: tuple[float, float] | None
    modulus: float
    of_grid: bool = False

    @property
    def reach(self) -> float | None:
        """How wide a contact surface could be: not known of a solid."""
        return None

    def touched(self, carried: Mask) -> Mask:
        """Return where the contact is clipped (k,) bool, of nodes that carry pressure or wear (k, n)."""
        return np.asarray((carried & self.clips).any(axis=1))

    def where(self, carried: Mask) -> str:
        """Return in words where the contact is clipped, of nodes that carry pressure or wear (n,); "" for nowhere."""
        found = self.x[carried & self.clips]
        if not len(found):
            return ""
        middle = found[np.linalg.norm(found - found.mean(axis=0), axis=1).argmin()]
        place = ", ".join(f"{value:.4g}" for value in np.round(middle, 9) + 0.0)
        return f"at {len(found)} nodes of its rim, ({place}) mm among them"

    def width_needed(self, worn_volume: float, load: float) -> float | None:
        """Return about how wide the contact surface should be, mm; None where that cannot be told.

        Args:
            worn_volume: Worn off both bodies, mm³.
            load: On the contact, N.
        """
        if self.curvatures is None:
            return None
        radius = 1 / np.sqrt(self.curvatures[0] * self.curvatures[1])
        level = max(self._closed(radius, load), np.sqrt(max(worn_volume, 0.0) / (np.pi * radius)))
        return float(max(2 * np.sqrt(2 * level / self.curvatures[1]), WIDER * self.width))

    def hertzian(self, load: float) -> float | None:
        """Return about how wide the contact of the unworn bodies is where it is narrowest, mm; None as above."""
        if self.curvatures is None:
            return None
        radius = 1 / np.sqrt(self.curvatures[0] * self.curvatures[1])
        return float(2 * np.sqrt(2 * self._closed(radius, load) / self.curvatures[0]))

    def _closed(self, radius: float, load: float) -> float:
        """Return the level that a load closes, mm."""
        return float((0.75 * max(load, 0.0) * radius / self.modulus) ** (2 / 3) / (2 * radius))


def contact_rim(system: Tribosystem) -> ContactRim | None:
    """Return the rim of the contact surface of a solid; collective. None where nothing clips it.

    Args:
        system: On meshes as they were made, not moved by wear.
    """
    pair = system.pair
    if pair.punch.dim != 3:
        return None
    smooth, _ = smooth_rim(system.bodies.punch, pair.punch)
    _, edges = smooth_rim(system.bodies.strip, pair.strip)
    clips = np.zeros(len(pair.punch.trace), dtype=bool)
    clips[smooth.ravel()] = True
    at_nodes = clips[pair.punch.nodes]
    on_rim, x = np.flatnonzero(at_nodes), pair.punch.x
    ends = pair.strip.trace[edges[:, :2]]
    at_nodes[on_rim[_beside(x[on_rim], ends, BESIDE * pair.strip.extent())]] = False
    if not at_nodes.any():
        return None
    widths = np.ptp(x @ _tangents(pair.normal.mean(axis=0)).T, axis=0)
    return ContactRim(at_nodes, x, float(widths.max()), curvatures(system), contact_modulus(system.case))


def rim_edges(elastic: ElasticBody, surface: ContactSurface) -> tuple[NDArray[np.int64], Array, Array]:
    """Return the trace nodes on each edge of the rim (m, k), two corners first, and where the surface lies; collective.

    Args:
        elastic: The body.
        surface: Its contact surface, or the meshed one of a body on a contact grid.

    Returns:
        The edges, and unit vectors (m, 3) at right angles to them into the contact surface and into the boundary
        beyond it, which are zero where nothing is beyond.
    """
    edges, middles = _outer_edges(surface)
    beyond, ends = _beyond(elastic, surface, edges)
    first, second = surface.trace[edges[:, 0]], surface.trace[edges[:, 1]]
    inward, outward = (_across(first, second, point) for point in (middles, beyond))
    return edges, inward, np.where(ends[:, None], outward, 0.0)


def smooth_rim(elastic: ElasticBody, surface: ContactSurface) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the edges of the rim as `rim_edges` does: where the body goes on smoothly, and where not; collective."""
    edges, inward, outward = rim_edges(elastic, surface)
    goes_on = np.einsum("ij,ij->i", inward, outward) < -SMOOTH
    return edges[goes_on], edges[~goes_on]


def _outer_edges(surface: ContactSurface) -> tuple[_Ints, Array]:
    """Return the trace nodes on each edge of one facet alone (m, k), two corners first, and that facet's middle."""
    closures, corners = _closures(surface.cell, surface.degree)
    nodes = surface.facets[:, closures]  # (f, edges, k)
    pairs = np.sort(nodes[:, :, :2], axis=2).reshape(-1, 2)
    _, where, count = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    outer = np.flatnonzero(count[where.ravel()] == 1)
    middles = surface.trace[surface.facets[:, :corners]].mean(axis=1)
    return nodes.reshape(-1, nodes.shape[2])[outer], middles[outer // len(closures)]


@lru_cache
def _closures(cell: str, degree: int) -> tuple[_Ints, int]:
    """Return the nodes on each edge of an element, its corners first, and the number of corners of the element."""
    element = basix.create_element(
        basix.ElementFamily.P, basix.CellType[cell], degree, basix.LagrangeVariant.gll_warped
    )
    edges, corners = element.entity_closure_dofs[1], len(element.entity_dofs[0])
    return np.array([sorted(edge) for edge in edges]), corners


def _beyond(elastic: ElasticBody, surface: ContactSurface, edges: _Ints) -> tuple[Array, Mask]:
    """Return the middle of the facet beyond each edge of the rim (m, 3), and whether there is one; collective."""
    body = elastic.body
    mesh, dim = body.mesh, body.mesh.topology.dim
    mesh.topology.create_connectivity(dim - 1, dim)
    facets = np.setdiff1d(exterior_facet_indices(mesh.topology), body.facet_tags.find(contact_tag(body)))
    corners = mesh.geometry.x[compat.facet_nodes(mesh, facets.astype(np.int32))]
    rim = np.unique(edges[:, :2])
    tree = cKDTree(surface.trace[rim])
    far, found = tree.query(corners.reshape(-1, 3), distance_upper_bound=NEAR * surface.extent())
    known = np.where(np.isfinite(far), rim[np.minimum(found, len(rim) - 1)], -1).reshape(corners.shape[:2])
    beside = np.flatnonzero((known >= 0).sum(axis=1) >= 2)
    parts = mesh.comm.allgather((known[beside], corners[beside].mean(axis=1)))
    known, middles = (np.concatenate(part) for part in zip(*parts, strict=True))
    closures, _ = _closures(surface.cell, 1)
    size = len(surface.trace)
    pairs = np.sort(known[:, closures], axis=2)  # (f, edges, 2)
    codes = np.where(pairs[..., 0] >= 0, pairs[..., 0] * size + pairs[..., 1], -1).ravel()
    wanted = np.sort(edges[:, :2], axis=1) @ [size, 1]
    order = np.argsort(codes, kind="stable")
    place = np.minimum(np.searchsorted(codes[order], wanted), max(len(codes) - 1, 0))
    if not len(codes):
        return np.zeros((len(edges), 3)), np.zeros(len(edges), dtype=bool)
    at = order[place]
    return middles[at // len(closures)], codes[at] == wanted


def _across(first: Array, second: Array, point: Array) -> Array:
    """Return the unit vectors (m, 3) at right angles from edges to points beside them."""
    along = (second - first) / np.linalg.norm(second - first, axis=1, keepdims=True)
    to = point - first
    to = to - np.einsum("ij,ij->i", to, along)[:, None] * along
    return np.asarray(to / np.maximum(np.linalg.norm(to, axis=1, keepdims=True), 1e-300))


def _beside(x: Array, edges: Array, slack: float) -> Mask:
    """Return which points (k, 3) lie on one of the edges (m, 2, 3)."""
    if not len(edges) or not len(x):
        return np.zeros(len(x), dtype=bool)
    start, along = edges[:, 0], edges[:, 1] - edges[:, 0]
    to = x[:, None] - start
    share = np.clip(np.einsum("kmi,mi->km", to, along) / np.einsum("mi,mi->m", along, along), 0, 1)
    return np.asarray((np.linalg.norm(to - share[..., None] * along, axis=2) < slack).any(axis=1))


def _tangents(normal: Array) -> Array:
    """Return two unit vectors (2, 3) at right angles to a normal."""
    _, _, rows = np.linalg.svd(normal[None])
    return np.asarray(rows[1:])


def curvatures(system: Tribosystem) -> tuple[float, float] | None:
    """Return the principal curvatures of the paraboloid that is nearest to the unworn gap; None where it is none."""
    pair = system.pair
    s, t = ((pair.punch.x - pair.punch.x.mean(axis=0)) @ _tangents(pair.normal.mean(axis=0)).T).T
    columns = np.column_stack([np.ones_like(s), s, t, s * s / 2, s * t, t * t / 2])
    found, *_ = np.linalg.lstsq(columns, pair.initial_gap, rcond=None)
    small, large = np.linalg.eigvalsh([[found[3], found[4]], [found[4], found[5]]])
    noise = 1e-9 * pair.punch.extent()
    if large * pair.punch.extent() ** 2 < noise or small < ROUND * large:
        return None
    return float(large), float(small)
