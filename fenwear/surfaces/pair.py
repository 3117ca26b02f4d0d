"""Two contact surfaces opposite each other at one place of the counter-body: gap, frame, weights, transfer.

Pressure and gap live at the punch's pressure nodes. With the weights w_i the force of a node is w_i p_i,
so that each node is one complementarity pair. The contact frame has its normal e_n into the punch, on
the strip's surface opposite each node as the strip lies there, along which it slides; where the surfaces
stick it is half-way between the normals of both (`common_normal`). A traction on one body acts on the other the
opposite way, on curved surfaces and in every place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from fenwear.bodies.contact_surface import ContactSurface
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError
from fenwear.surfaces.common_normal import common_normal, unit
from fenwear.surfaces.overlap import ChartedSurface, Patch
from fenwear.surfaces.patches import folds, patches, radius_of
from fenwear.surfaces.placement import HERE, ZERO, Placement, in_space
from fenwear.surfaces.round_gap import round_shape
from fenwear.surfaces.transfer import dual_transfer, wear_transfer

STEEPEST = 0.7  # cosine between the normals of the two surfaces: steeper parts never touch
BELOW = 0.5  # mean component of e_n against z from which on a plane punch is below, not around or inside


@dataclass(frozen=True)
class ContactPair:
    """The punch's pressure nodes opposite the strip's surface, n nodes in d dimensions.

    Attributes:
        punch: The punch's contact surface.
        strip: The strip's contact surface, as it was meshed.
        placement: Where the strip is.
        normal: e_n (n, d), unit normals into the punch.
        weights: Areas of the nodes seen along e_n (n,), mm in the plane, mm² in a solid.
        transfer: Takes displacements and temperatures at the strip's trace nodes to the punch's nodes (n, N_strip).
        wear_interpolation: Takes worn depths on the strip's material to the punch's nodes (n, n_strip), as `transfer`
            takes the place of its nodes: a depth opens the gap as if the mesh had been made with it.
        wear_projection: Puts depths worn at the contact nodes on the strip's material (n_strip, n): areas kept, and
            no entry negative, so that no surface ever grows.
        initial_gap: Distance along e_n before any deformation and wear (n,), mm.
        material_place: Where the strip's material is, which may move under a strip that stays.
    """

    punch: ContactSurface
    strip: ContactSurface
    placement: Placement
    normal: Array
    weights: Array
    transfer: csr_array
    wear_interpolation: csr_array
    wear_projection: csr_array
    initial_gap: Array
    material_place: Placement

    @cached_property
    def places(self) -> tuple[Array, Array]:
        """Places of the contact nodes on the punch and on the strip's material (n, 3) each, mm."""
        return in_space(self.punch.x), in_space(self.material_place.points_back(self.punch.x))

    @property
    def x(self) -> Array:
        """Abscissae of the contact nodes (n,), mm: x, or the arc length of curves that are no graphs over x."""
        return self.punch.abscissa

    @cached_property
    def opposite(self) -> Array:
        """Place of the strip's surface opposite each node, before any deformation and wear (n, d), mm.

        Sliding of the strip's material there: a flat block's ends are farther from a ring's axis
        than the ring is.
        """
        return self.punch.x - self.initial_gap[:, None] * self.normal

    @cached_property
    def normal_on_strip(self) -> Array:
        """e_n in the strip's own, unmoved frame (n, d)."""
        return self.placement.back(self.normal)

    def opening(self, punch: Array, strip: Array) -> Array:
        """Return the gap opened by depths worn off both bodies (n,), mm."""
        return punch + self.wear_interpolation @ strip


def pair(
    punch: ContactSurface,
    strip: ContactSurface,
    placement: Placement = HERE,
    *,
    axisymmetric: bool = False,
    halfway: bool = False,
) -> ContactPair:
    """Bring the punch's nodes opposite the strip's surface, moved to its place.

    Args:
        punch, strip: The surfaces as they were meshed.
        placement: Of the strip.
        axisymmetric: Whether they are rings, x being the radius.
        halfway: Whether e_n is half-way between the normals of both bodies, not the strip's.

    Raises:
        CaseError: the surfaces do not face each other, or the strip's does not reach below the whole punch.
    """
    if punch.grid is not None and strip.grid is not None:
        return _on_grids(punch, strip, placement)
    strip_trace, strip_outward = placement.points(strip.trace), placement.vectors(strip.outward)
    if placement == HERE:
        for surface in (punch, strip):
            if folds(surface):
                _not_facing(f"{surface.body}_contact folds back on itself: it continues around an edge")
    parts = patches(punch, strip, placement)
    _check_covered(parts, placement)
    if axisymmetric:
        parts = [_around(part, punch) for part in parts]
    transfer = dual_transfer(parts)
    material = _material(parts, transfer)
    of_facets = unit(material @ strip_outward)
    shape = round_shape(parts, punch, strip, placement, transfer, material)
    normal = unit(of_facets + shape.turned)
    facing = -np.einsum("ic,ic->i", punch.outward, normal)
    _check_facing(punch, normal, facing, placement)
    if halfway:  # by the facets of both, opposite each other: mirror images have the plane between them
        normal = common_normal(punch, of_facets)
        facing = -np.einsum("ic,ic->i", punch.outward, normal)
    apart = punch.spread.T @ punch.trace - transfer @ strip_trace + shape.moved
    gap = np.einsum("ic,ic->i", normal, apart) + _profiles(punch, strip, material)
    # Forces act along the common normal: a node's weight is its area seen along it.
    weights = punch.weights * facing
    wear_projection = _wear_projection(parts, weights, strip.weights)
    return ContactPair(punch, strip, placement, normal, weights, transfer, material, wear_projection, gap, placement)


def _on_grids(punch: ContactSurface, strip: ContactSurface, placement: Placement) -> ContactPair:
    """Return the pair of two grids in one plane: values go linearly between nodes, wear back by the same shares.

    Raises:
        CaseError: the strip's grid does not reach below the whole punch.
    """
    here, there = punch.grid, strip.grid
    assert here is not None
    assert there is not None
    moved = placement.points(np.zeros((1, punch.dim)))[0, here.axes]
    transfer = None if placement.turn != ZERO else there.reading(here, moved)
    if transfer is None:
        raise CaseError(InputError("grid", f"the stroke runs off the strip's grid: {placement}"))
    back = csr_array((transfer.multiply(punch.weights[:, None])).T / strip.weights[:, None])
    gap = _profiles(punch, strip, transfer)
    return ContactPair(punch, strip, placement, -punch.outward, punch.weights, transfer, transfer, back, gap, placement)


def pass_material(middle: ContactPair, placement: Placement) -> ContactPair:
    """Return a pair whose strip stays in place while its material moves: only worn depths change place.

    Raises:
        CaseError: the strip's contact surface does not reach below the whole punch there.
    """
    if placement == middle.material_place:
        return middle
    if middle.punch.grid is not None:
        there = _on_grids(middle.punch, middle.strip, placement)
        return replace(there, transfer=middle.transfer)
    parts = patches(middle.punch, middle.strip, placement)
    _check_covered(parts, placement)
    material = _material(parts, dual_transfer(parts))
    wear_projection = _wear_projection(parts, middle.weights, middle.strip.weights)
    # The profile of the strip's surface goes with its material.
    gap = middle.initial_gap + _profiles(middle.punch, middle.strip, material)
    gap -= _profiles(middle.punch, middle.strip, middle.wear_interpolation)
    return replace(
        middle, material_place=placement, wear_interpolation=material, wear_projection=wear_projection, initial_gap=gap
    )


def _profiles(punch: ContactSurface, strip: ContactSurface, material: csr_array) -> Array:
    """Return the gap opened by the profiles of both surfaces (n,), mm."""
    return np.asarray(punch.deeper + material @ strip.deeper)


def transfer_at(middle: ContactPair, placement: Placement) -> csr_array:
    """Return the matrix from the strip's trace nodes to the punch's nodes (n, N), at another place of the strip.

    Raises:
        CaseError: the strip's contact surface does not reach below the whole punch there.
    """
    if placement == middle.placement:
        return middle.transfer
    if middle.punch.grid is not None:
        return _on_grids(middle.punch, middle.strip, placement).transfer
    parts = patches(middle.punch, middle.strip, placement)
    _check_covered(parts, placement)
    return dual_transfer(parts)


def _material(parts: Sequence[Patch], transfer: csr_array) -> csr_array:
    """Return the matrix from the strip's pressure nodes to the punch's (n, n_strip)."""
    strip = parts[0].second
    if len(strip.nodes) == len(strip.s):
        return transfer
    if strip.cell != "triangle":  # a node on the axis of rings stands for nothing: it takes its neighbour's value
        nearest = cKDTree(strip.s[strip.nodes]).query(strip.s)[1]
        to_trace = csr_array((np.ones(len(nearest)), (np.arange(len(nearest)), nearest)))
        return csr_array(transfer @ to_trace)
    # On the vertices alone: linear on each facet.
    linear = []
    for part in parts:
        second, vertices = part.second, np.arange(len(strip.nodes))
        at_vertices = ChartedSurface(second.s[second.nodes], second.pressure_facets, second.cell, 1, vertices)
        linear.append(Patch.of(part.first, at_vertices))
    return dual_transfer(linear)


def _wear_projection(parts: Sequence[Patch], weights: Array, strip_weights: Array) -> csr_array:
    """Return the matrix from depths of the punch's nodes to the strip's, by the areas that nodes of both share."""
    return csr_array(wear_transfer(parts).multiply(weights[:, None]).T / strip_weights[:, None])


def check_distance(pair: ContactPair) -> None:
    """Make sure that the surfaces touch, or nearly so, before anything deforms or wears.

    Raises:
        CaseError: they are apart, or one inside the other.
    """
    made = pair.punch.below_mesh + pair.wear_interpolation @ pair.strip.below_mesh  # which may have a rigid part
    closest = float((pair.initial_gap - made).min())
    if abs(closest) > 0.01 * pair.punch.extent():
        way = "above" if closest > 0 else "inside"
        reason = f"punch_contact lies {abs(closest):g} mm {way} strip_contact where they are closest"
        _not_facing(reason + (_larger_than_its_bore(pair.punch, pair.strip) if closest < 0 else ""))


def _larger_than_its_bore(punch: ContactSurface, strip: ContactSurface) -> str:
    """Say so of a shaft or ball that is larger than the bore or cup opposite; "" of all others."""
    radii = {surface.body: radius_of(surface) for surface in (punch, strip)}
    bore, inner = (next((body for body, radius in radii.items() if sign * radius > 0), "") for sign in (-1, 1))
    sizes = {body: abs(radius) for body, radius in radii.items()}
    if not bore or not inner or sizes[inner] <= sizes[bore]:
        return ""
    there = f"{bore}_contact around it, {sizes[bore]:.4g} mm"
    return f": {inner}_contact, of radius {sizes[inner]:.4g} mm, is larger than {there}"


def _around(part: Patch, punch: ContactSurface) -> Patch:
    """Return a patch of rings, each point with its circumference 2 pi r."""
    first, common = part.first, part.common
    radius = punch.trace[first.facets[common.facet1], 0]
    around = 2 * np.pi * np.einsum("qk,qk->q", first.shape_functions(common.points1), radius)
    return replace(part, common=replace(common, weights=common.weights * around))


def _check_covered(parts: Sequence[Patch], placement: Placement) -> None:
    """Raise where a part of the punch's surface has nothing of the strip's below it."""
    bare = next((part for part in parts if not part.common.covered.all()), None)
    if bare is None:
        return
    if len(parts) > 1 and placement == HERE:  # as seen from the middle, whose coordinates are none of the case
        _not_facing(
            "a part of punch_contact has nothing of strip_contact opposite: it reaches farther, or elements are too "
            "long for the curve that they follow"
        )
    first, second = (used.s[np.unique(used.facets)] for used in (bare.first, bare.second))
    spans = [
        " and ".join(f"{low:g} to {high:g}" for low, high in zip(c.min(axis=0), c.max(axis=0), strict=True))
        for c in (first, second)
    ]
    if placement == HERE:
        _not_facing(
            f"punch_contact spans x = {spans[0]} mm, strip_contact only {spans[1]} "
            "(are the names of punch and strip exchanged?)"
        )
    raise CaseError(
        InputError(
            "motion",
            f"the stroke runs off the meshed strip: {placement}, strip_contact spans x = {spans[1]} mm, "
            f"but punch_contact {spans[0]} mm. Extend strip_contact by {_missing(first, second):.4g} mm there. "
            "A mesh is read in mm",
        )
    )


def _missing(first: Array, second: Array) -> float:
    """Return the largest distance of points beyond the box around others, mm."""
    low, high = second.min(axis=0) - first.min(axis=0), first.max(axis=0) - second.max(axis=0)
    return float(max(low.max(), high.max(), 0.0))


def _check_facing(punch: ContactSurface, normal: Array, facing: Array, placement: Placement) -> None:
    """Raise where the surfaces look past each other."""
    where = "" if placement == HERE else f" with the strip {placement}"
    if (facing < STEEPEST).any():
        worst = int(np.argmin(facing))
        angle = np.degrees(np.arccos(np.clip(facing[worst], -1, 1)))
        place = ", ".join(f"{c:g}" for c in punch.x[worst][: punch.dim - 1])
        _not_facing(
            f"their outward normals do not point at each other at x = {place} mm{where}: they are {angle:.0f} degrees "
            "off"
        )
    if punch.dim == 2 and normal[:, 1].mean() < -BELOW:
        _not_facing("the punch lies below the strip; expected it above, with z upwards")


def _not_facing(reason: str) -> None:
    raise CaseError(InputError("geometry", f"the contact surfaces do not face each other: {reason}"))
