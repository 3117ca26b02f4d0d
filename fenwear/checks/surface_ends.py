"""Ends of a contact surface: clipped where the bodies continue smoothly, beside chamfers, and worn through.

Beyond its ends a contact surface has an edge, as a flat punch, or the bodies continue smoothly, as a ball of which a
part is tagged. strip_contact reaches at least as far as punch_contact, so the punch's rim is what a growing contact
meets: it clips the contact wherever the punch continues, and the strip has no edge.

The width that the surface needs follows from the curvatures k of the unworn gap. A parabola g = k s² / 2 below a level
D has the area A = 4 D s / 3, a paraboloid the volume V = pi D² / sqrt(k_1 k_2). Both reach as far as s = sqrt(2 D / k).
D is at least what Hertz closes under the load F: 2 F / (pi E*) over the thickness, or a² / (2 R) with a³ = 3 F R / (4
E*) and R = 1 / sqrt(k_1 k_2).

A surface worn by a depth w beside a chamfer at the angle phi becomes wider by w cot phi there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import basix
import numpy as np
from dolfinx.mesh import compute_midpoints, exterior_facet_indices
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fenwear.bodies.contact_surface import ContactSurface, contact_tag
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.grid_surface import RegularGrid
from fenwear.case import Case
from fenwear.common.arrays import Array, Mask
from fenwear.common.compat import facet_nodes
from fenwear.laws.wear import WornDepths
from fenwear.surfaces import ContactPair
from fenwear.system import Tribosystem

SMOOTH = np.cos(np.radians(20))  # cosine of the angle between two facets up to which the boundary goes on
STEEP = 0.27  # cotangent of 75 degrees: beyond, a chamfer widens by a quarter of the depth
NEAR, BESIDE = 1e-6, 1e-3  # of a surface's extent: places that are the same, and rims that lie above each other
ROUND = 1e-3  # least of both curvatures over the other: below, contact is no ellipse
WITHIN = 1.5  # spacings of a grid that it may end before the surface does
AT_ONCE = 2_000_000  # pairs of a node and a facet
SLACK = 1e-6  # of a facet's size: what a line may miss it by


@dataclass(frozen=True)
class Facets:
    """The facets of a body's boundary, of all ranks.

    Attributes:
        numbers: Of their corners (f, c).
        x: Coordinates of these (f, c, d), mm.
        normal: Unit normals out of the body (f, d).
        contact: Which are of the contact surface (f,).
    """

    numbers: NDArray[np.int64]
    x: Array
    normal: Array
    contact: Mask


def boundary_of(elastic: ElasticBody) -> Facets:
    """Return the facets of a body's boundary; collective."""
    body, mesh = elastic.body, elastic.body.mesh
    dim = mesh.topology.dim
    mesh.topology.create_connectivity(dim - 1, dim)
    facets = exterior_facet_indices(mesh.topology)
    nodes = facet_nodes(mesh, facets)[:, : 4 if mesh.basix_cell().name == "hexahedron" else dim]
    x = mesh.geometry.x[nodes][:, :, :dim]
    cells = mesh.topology.connectivity(dim - 1, dim).array[mesh.topology.connectivity(dim - 1, dim).offsets[facets]]
    out = x.mean(axis=1) - compute_midpoints(mesh, dim, cells.astype(np.int32))[:, :dim]
    along = x[:, -1] - x[:, 0]
    normal = np.cross(along, x[:, -2] - x[:, 1]) if nodes.shape[1] == 4 else (
        np.cross(along, x[:, 1] - x[:, 0]) if dim == 3 else np.column_stack([along[:, 1], -along[:, 0]])
    )  # fmt: skip
    normal *= np.sign((normal * out).sum(axis=1) / np.linalg.norm(normal, axis=1))[:, None]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    numbers = mesh.geometry.index_map().local_to_global(nodes.ravel().astype(np.int32)).reshape(nodes.shape)
    local_facets = numbers, x, normal, np.isin(facets, body.facet_tags.find(contact_tag(body)))
    return Facets(*(np.concatenate(part) for part in zip(*mesh.comm.allgather(local_facets), strict=True)))


@dataclass(frozen=True)
class Rim:
    """The corners of a contact surface's elements on its rim.

    Attributes:
        x: Where they lie (k, d), mm.
        smooth: Mask of ends where the boundary continues smoothly (k,).
        cotangent: Of the angle of a chamfer there (k,); zero for none.
    """

    x: Array
    smooth: Mask
    cotangent: Array


def rim_of(elastic: ElasticBody) -> Rim:
    """Return the rim of a body's meshed contact surface; collective."""
    facets = boundary_of(elastic)
    within, beyond = facets.contact, ~facets.contact
    numbers = np.intersect1d(facets.numbers[within], facets.numbers[beyond])
    place = np.searchsorted(numbers, facets.numbers)
    on_rim = np.isin(facets.numbers, numbers)
    x: Array = np.zeros((len(numbers), facets.x.shape[2]))
    x[place[on_rim]] = facets.x[on_rim]
    mean = np.zeros_like(x)  # normal of the contact surface
    facet, corner = np.nonzero(on_rim & within[:, None])
    np.add.at(mean, place[facet, corner], facets.normal[facet])
    mean /= np.linalg.norm(mean, axis=1, keepdims=True)
    facet, corner = np.nonzero(on_rim & beyond[:, None])
    at = place[facet, corner]
    cosine = (mean[at] * facets.normal[facet]).sum(axis=1)
    rises = ((facets.x[facet].mean(axis=1) - x[at]) * mean[at]).sum(axis=1) < 0  # away from the other body
    steep = facets.normal[facet] @ facets.normal[within].mean(axis=0)  # across the whole surface, where it has a normal
    slope = steep / np.sqrt(np.maximum(1 - steep**2, 1e-300))
    smooth, cotangent = np.zeros(len(x), dtype=bool), np.zeros(len(x))
    smooth[at[cosine > SMOOTH]] = True
    np.maximum.at(cotangent, at, np.where(rises & (cosine <= SMOOTH) & (slope >= STEEP), slope, 0.0))
    return Rim(x, smooth, cotangent)


def _at_nodes(surface: ContactSurface, x: Array, values: Array) -> Array:
    """Return values at corners (k, d) of a surface at its pressure nodes (n,), zero elsewhere.

    Nodes on an outer edge have the lesser of both its corners.
    """
    nodal: Array = np.zeros(len(surface.trace))
    if len(x):
        far, nearest = cKDTree(x).query(surface.trace, distance_upper_bound=NEAR * surface.extent())
        nodal = np.where(np.isfinite(far), np.append(values, 0.0)[nearest], 0.0)
    if surface.dim == 3 and surface.degree > 1:
        closures = _closures(surface.cell, surface.degree)
        nodes = surface.facets[:, closures].reshape(-1, closures.shape[1])
        _, which, count = np.unique(np.sort(nodes[:, :2], axis=1), axis=0, return_inverse=True, return_counts=True)
        outer = nodes[count[which.ravel()] == 1]
        nodal[outer[:, 2:]] = nodal[outer[:, :2]].min(axis=1)[:, None]
    return nodal[surface.nodes]


@lru_cache
def _closures(cell: str, degree: int) -> NDArray[np.int64]:
    """Return the nodes on each edge of an element, its corners first."""
    kind = basix.ElementFamily.P, basix.CellType[cell], degree, basix.LagrangeVariant.gll_warped
    return np.array([sorted(edge) for edge in basix.create_element(*kind).entity_closure_dofs[1]])


@dataclass(frozen=True)
class Limits:
    """Where a contact is clipped, of the meshes as they were made.

    Attributes:
        clips: Contact nodes where both bodies continue beyond the surface (n,).
        x: Contact nodes (n, d), mm.
        width: Of the surface along the direction in which it is widest, mm.
        curvatures: Of the unworn gap, descending, 1/mm; none where it is no paraboloid.
        modulus: E*, MPa.
        around: Of a ring its mean circumference, mm; else 1.
        of_grid: Whether it is the rim of a contact grid within the surface.
    """

    clips: Mask
    x: Array
    width: float
    curvatures: tuple[float, ...]
    modulus: float
    around: float = 1.0
    of_grid: bool = False

    def where(self, carried: Mask) -> str:
        """Return in words where the contact is clipped, of nodes that carry pressure or wear (n,); "" for nowhere."""
        clipped = self.x[carried & self.clips]
        if not len(clipped):
            return ""
        if clipped.shape[1] == 2:
            return f"at x = {' and '.join(f'{x:.4g}' for x in np.unique(np.round(clipped[:, 0], 9) + 0.0))} mm"
        middle = clipped[np.linalg.norm(clipped - clipped.mean(axis=0), axis=1).argmin()]
        place = ", ".join(f"{value:.4g}" for value in np.round(middle, 9) + 0.0)
        return f"at {len(clipped)} nodes of its rim, ({place}) mm among them"

    def width_needed(self, worn: float, load: float) -> float:
        """Return about how wide the contact surface should be, mm; 0 where that is not known.

        Args:
            worn: Cross-section worn off both bodies, mm²; of rings and solids the volume, mm³.
            load: On the contact over the thickness, N/mm; of rings and solids all of it, N.
        """
        if not self.curvatures:
            return 0.0
        *_, least = self.curvatures
        if len(self.curvatures) == 1:
            level = (0.75 * max(worn / self.around, 0.0) * np.sqrt(least / 2)) ** (2 / 3)
        else:
            level = np.sqrt(max(worn, 0.0) * np.sqrt(np.prod(self.curvatures)) / np.pi)
        level = max(float(level), self._closed(load))
        return float(max(2 * np.sqrt(2 * level / least), 1.1 * self.width))

    def hertzian(self, load: float) -> float:
        """Return the width of the contact of the unworn bodies where it is narrowest, mm; 0 where it is not known."""
        return float(2 * np.sqrt(2 * self._closed(load) / self.curvatures[0])) if self.curvatures else 0.0

    def _closed(self, load: float) -> float:
        """Return the level that a load closes, mm."""
        if len(self.curvatures) == 1:
            return 2 * max(load, 0.0) / self.around / (np.pi * self.modulus)
        radius = 1 / np.sqrt(np.prod(self.curvatures))
        return float((0.75 * max(load, 0.0) * radius / self.modulus) ** (2 / 3) / (2 * radius))


def contact_limits(system: Tribosystem) -> Limits:
    """Return where the contact of a system is clipped; collective.

    Args:
        system: On meshes as they were made, not moved by wear.
    """
    pair = system.pair
    rim, grid, around = rim_of(system.bodies.punch), pair.punch.grid, 1.0
    if system.case.model.kind == "axisymmetric":
        around = float(2 * np.pi * (pair.weights @ pair.punch.x[:, 0]) / pair.weights.sum())
    if grid is not None:
        clips, of_grid = _clipped_by_grid(system.bodies.punch, grid, rim)
        width = float(grid.sides.max())
    else:
        clips, of_grid = _at_nodes(pair.punch, rim.x, rim.smooth.astype(float)) > 0, False
        other = rim_of(system.bodies.strip)
        edge = other.x[~other.smooth]
        if len(edge) and clips.any():  # where rims lie above each other the strip's edge ends the contact
            apart = cKDTree(edge).query(edge, k=2)[0][:, 1] if pair.punch.dim == 3 else np.zeros(1)
            slack = BESIDE * pair.strip.extent() + 0.6 * float(np.median(apart))
            clips &= cKDTree(edge).query(pair.punch.x)[0] > slack
        width = float(np.ptp(_along(pair.punch.x, pair.normal.mean(axis=0)), axis=0).max())
    return Limits(clips, pair.punch.x, width, curvatures(system.pair), contact_modulus(system.case), around, of_grid)


def _clipped_by_grid(punch: ElasticBody, grid: RegularGrid, rim: Rim) -> tuple[Mask, bool]:
    """Return which nodes of a contact grid clip the contact (n,), and whether some do within the surface; collective.

    A side may lie within the surface, or reach over it: there the surface's own end clips, where the body continues. A
    grid that grows clips where it is at its end.
    """
    surface = punch.meshed.trace[:, grid.axes]
    corner, sides, steps = np.array(grid.corner), grid.sides, np.array(grid.spacing)
    low, high = corner - surface.min(axis=0), surface.max(axis=0) - corner - sides
    within: Mask = np.stack([low > WITHIN * steps, high > WITHIN * steps])
    last = np.ones_like(within)
    if (reach := punch.reach) is not None:
        first = np.array(reach.grid.corner)
        last = np.stack([corner - first < steps, first + reach.grid.sides - corner - sides < steps])
    places = np.rint((grid.flat - corner) / steps).astype(np.int64)
    outer = np.stack([places == 0, places == np.array(grid.counts) - 1])
    clips: Mask = np.asarray((outer & (within & last)[:, None]).any(axis=(0, 2)))
    over = np.flatnonzero((outer & (last & ~within)[:, None]).any(axis=(0, 2)))
    if len(over) and len(rim.x):
        clips[over] |= rim.smooth[cKDTree(rim.x[:, grid.axes]).query(grid.flat[over])[1]]
    return clips, bool((within & last).any())


def opened(pair: ContactPair, worn: WornDepths) -> float:
    """Return the gap that worn depths open in the middle position: mm² in a plane, mm³ of rings and solids."""
    return float(pair.weights @ pair.opening(worn.punch, worn.strip))


def contact_modulus(case: Case) -> float:
    """Return E* of the softest region of each body, MPa: 1 / E* = sum of (1 - nu²) / E, without nu in plane stress."""
    compliance = 0.0
    for body in (case.punch, case.strip):
        used = [case.initial_materials[name] for name in body.regions.values()]
        compliance += max((1 - (case.model.law != "stress") * m.poisson**2) / m.young for m in used)
    return 1 / compliance


def _along(x: Array, normal: Array) -> Array:
    """Return coordinates (n, d - 1) across a normal."""
    return np.asarray((x - x.mean(axis=0)) @ np.linalg.svd(normal[None])[2][1:].T)


def curvatures(pair: ContactPair) -> tuple[float, ...]:
    """Return the principal curvatures, descending, of the paraboloid nearest to the unworn gap; none of other gaps."""
    s = _along(pair.punch.x, pair.normal.mean(axis=0))
    rows, columns = np.triu_indices(s.shape[1])
    powers = np.column_stack([np.ones(len(s)), s, s[:, rows] * s[:, columns]])
    coefficients = np.linalg.lstsq(powers, pair.initial_gap, rcond=None)[0][1 + s.shape[1] :]
    hessian = np.zeros((s.shape[1],) * 2)
    hessian[rows, columns] += coefficients
    values = np.linalg.eigvalsh(hessian + hessian.T)
    flat = values[-1] * pair.punch.extent() ** 2 < 1e-9 * pair.punch.extent()
    return () if flat or values[0] < ROUND * values[-1] else tuple(map(float, values[::-1]))


@dataclass(frozen=True)
class Chamfers:
    """The chamfers beside a punch's contact surface, of the meshes as they were made.

    Attributes:
        cotangent: Of the chamfer's angle at contact nodes beside it (n,); zero elsewhere.
        width: Of the contact surface between its chamfers, mm.
    """

    cotangent: Array
    width: float

    def widened(self, system: Tribosystem, worn: WornDepths) -> float:
        """Return how much wider the contact would be for the depths worn off both bodies, both sides together, mm."""
        return float(2 * (system.pair.opening(worn.punch, worn.strip) * self.cotangent).max(initial=0.0))


def contact_chamfers(system: Tribosystem) -> Chamfers:
    """Return the chamfers beside the punch's contact surface; collective."""
    surface, rim = system.pair.punch, rim_of(system.bodies.punch)
    cotangent = _at_nodes(surface, rim.x, rim.cotangent)
    middle = (surface.weights @ surface.x) / surface.weights.sum()
    beside = np.linalg.norm(surface.x[cotangent > 0] - middle, axis=1)
    return Chamfers(cotangent, 2 * float(beside.min(initial=np.inf)))


def thickness(elastic: ElasticBody) -> Array:
    """Return how thick a body is below each contact node (n,), mm; collective.

    That is the length of the line along the normal into the body, up to where it leaves it.

    Args:
        elastic: On its mesh as it was made.
    """
    facets, surface = boundary_of(elastic), elastic.surface
    x = facets.x[~facets.contact]
    opposite = x if x.shape[1] < 4 else np.concatenate([x[:, :3], x[:, 1:]])
    begin, inward = surface.x, -surface.outward
    size = max(1, AT_ONCE // max(1, len(opposite)))
    parts = [_lengths(begin[k : k + size], inward[k : k + size], opposite) for k in range(0, len(begin), size)]
    nodal_thickness = np.concatenate(parts)
    # A line that slips out along an edge: as far as the body reaches at all.
    reach = np.array([((opposite - x) @ d).max(initial=0.0) for x, d in zip(begin, inward, strict=True)])
    return np.where(np.isfinite(nodal_thickness), nodal_thickness, reach)


def _lengths(begin: Array, along: Array, facets: Array) -> Array:
    """Return how far lines (m, d) go in unit directions until they meet a facet (f, d, d); infinite for none."""
    sides = facets[:, 1:] - facets[:, :1]  # (f, d - 1, d)
    dim = begin.shape[1]
    first, last = sides[:, 0], sides[:, -1]
    normals: Array = np.column_stack([first[:, 1], -first[:, 0]])
    if dim == 3:
        normals = np.cross(first, last).astype(np.float64)
    across = along @ normals.T  # (m, f)
    meets = np.abs(across) > SLACK * np.linalg.norm(normals, axis=1)
    to = ((facets[:, 0] * normals).sum(axis=1) - begin @ normals.T) / np.where(meets, across, 1.0)
    dual = np.linalg.pinv(sides)  # (f, d, d - 1): coordinates of a point in the facet
    shift = np.einsum("fi,fij->fj", facets[:, 0], dual)
    inside = np.einsum("mi,fij->mfj", begin, dual) - shift + to[..., None] * np.einsum("mi,fij->mfj", along, dual)
    hit = meets & (inside > -SLACK).all(axis=2) & (inside.sum(axis=2) < 1 + SLACK)
    size = float(np.ptp(facets.reshape(-1, dim), axis=0).max())
    return np.where(hit & (to > SLACK * size), to, np.inf).min(axis=1, initial=np.inf)
