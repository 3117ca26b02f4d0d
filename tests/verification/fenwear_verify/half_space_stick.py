"""Two elastic half-spaces in contact with stick, by the closed forms of uniform tractions on squares: no mesh in it.

Fields that are symmetric about both axes are folded onto one quadrant: a node stands for its four mirror images,
and its force for all of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, eye_array

from fenwear.bodies.condensation import CondensedBody
from fenwear.bodies.contact_surface import ContactSurface
from fenwear.bodies.half_space import HalfSpace, influence
from fenwear.bodies.surface_operators import SurfaceOperator
from fenwear.common.arrays import Array
from fenwear.common.parallel import ALONE
from fenwear.laws import Layers
from fenwear.steps.stick_creep import stiff
from fenwear.steps.stick_interface import StickInterface
from fenwear.steps.stick_position import LoadEffect, Position, position_of
from fenwear.surfaces import ContactPair, RigidEquilibrium
from fenwear.surfaces.placement import HERE, Placement
from fenwear.surfaces.sliding_field import ALONG_X, SlidingField

# Signs of (u_x, u_y, u_z) at the mirror images in x and in y: pulled along x, or pressed alone.
MIRRORS = {"pulled": ((1, -1, 1), (1, -1, 1)), "pressed": ((-1, 1, 1), (1, -1, 1))}


@dataclass(frozen=True)
class Elastic:
    """A half-space: its modulus of shear, MPa, and Poisson's ratio."""

    shear: float
    poisson: float


class OppositeBodies(StickInterface):
    """Two bodies that stay opposite each other under one load.

    Args:
        punch, strip: Their response along all axes at the contact's nodes.
        rigid: The rigid modes, their load, and the pair of surfaces.
        field: Displacement of the strip by the rig.
    """

    def __init__(
        self, punch: SurfaceOperator, strip: SurfaceOperator, rigid: RigidEquilibrium, field: SlidingField
    ) -> None:
        self.punch, self.strip, self.field, self.dim = punch, strip, field, rigid.pair.punch.dim
        self.team, self.moves, self.moved, self.creep = ALONE, False, None, stiff(punch, strip)
        self._load = LoadEffect(rigid.resultant, punch.by_load, strip.by_load, punch.by_load, strip.by_load)
        self._positions = {0.0: position_of(rigid, punch, strip, field)}
        self.layers = Layers(len(rigid.pair.weights))

    @cached_property
    def bulk(self) -> Array:
        """Displacement of the strip by a bulk strain (q, d), mm: none."""
        return np.zeros_like(self.strip.by_load)

    def position(self, offset: float | Placement) -> Position:  # noqa: ARG002
        """Return the one place of the strip."""
        return self.middle

    def loaded(self, fraction: float | None) -> LoadEffect:  # noqa: ARG002
        """Return the effect of the loads, a constant."""
        return self._load


@cache
def half_spaces(
    upper: Elastic,
    lower: Elastic,
    spacing: float,
    reach: float,
    load: float,
    radius: float,
    symmetry: Literal["pulled", "pressed"] = "pulled",
) -> OppositeBodies:
    """Return a quadrant of two half-spaces with nodes in the middles of squares within a radius.

    Args:
        upper, lower: The bodies; the upper one is the punch.
        spacing: Side of the squares, mm.
        reach: Radius, mm.
        load: That presses them together, N.
        radius: Of the sphere, mm; infinite for a flat.
        symmetry: Of the fields: pulled along x, or pressed alone. Pressure and pull have other symmetries: bodies that
            are pulled must be like, so that one does not displace them along the other.
    """
    count = int(np.ceil(reach / spacing))
    middles = (np.arange(count) + 0.5) * spacing
    x = np.stack(np.meshgrid(middles, middles, indexing="ij"), axis=-1).reshape(-1, 2)
    x = x[np.linalg.norm(x, axis=1) <= reach]
    n = len(x)
    into = {1: np.array([1.0, 1.0, 1.0]), -1: np.array([1.0, 1.0, -1.0])}  # the strip's inside lies below
    bodies = []
    for body, side in ((upper, 1), (lower, -1)):
        response = np.zeros((n, 3, n, 3))
        for i in (1, -1):
            for j in (1, -1):
                image = np.array([1.0, 1.0, 1.0])
                for sign, mirror in zip((i, j), MIRRORS[symmetry], strict=True):
                    image = image * (mirror if sign < 0 else (1, 1, 1))
                apart = x[:, None] - x * [i, j]
                local = influence(apart.reshape(-1, 2), (spacing, spacing), body.shear, body.poisson)
                if symmetry == "pulled":
                    local[:, 2, :2] = local[:, :2, 2] = 0.0
                local = local.reshape(n, n, 3, 3).transpose(0, 2, 1, 3)
                response += local * (into[side][:, None, None] * (into[side] * image)) / (4 * spacing**2)
        bodies.append(CondensedBody(csr_array(eye_array(n)), np.tile(np.eye(3), (n, 1, 1)), response, np.zeros((n, 3))))
    rigid = _pressed(x, spacing, load, np.sum(x**2, axis=1) / (2 * radius))
    return OppositeBodies(bodies[0], bodies[1], rigid, ALONG_X)


def _pressed(x: Array, spacing: float, load: float, gap: Array) -> RigidEquilibrium:
    """Return the nodes of both flat surfaces; the punch can come down."""
    n = len(x)
    trace, up = np.column_stack([x, np.zeros(n)]), np.tile([0.0, 0.0, 1.0], (n, 1))
    same, weights = csr_array(eye_array(n)), np.full(n, 4 * spacing**2)
    punch, strip = (
        ContactSurface(body, trace, _squares(x, spacing), "quadrilateral", 1, np.arange(n), weights, outward, same)
        for body, outward in (("punch", -up), ("strip", up))
    )
    pair = ContactPair(punch, strip, HERE, up, weights, same, same, same, gap, HERE)
    return RigidEquilibrium(pair, up[:, :, None], np.array([-load]), ("lambda_F",), of_punch=1)


def on_grid(
    upper: Elastic, lower: Elastic, spacing: float, counts: tuple[int, ...], load: float, radius: float
) -> OppositeBodies:
    """Return two half-spaces, in the plane half-planes, on a grid of their own about the middle: any number of nodes.

    Args:
        upper, lower: The bodies; the upper one is the punch, a sphere or a cylinder.
        spacing: Of the grid, mm.
        counts: Nodes along its axes.
        load: That presses them together, N or N/mm.
        radius: Of the punch, mm.
    """
    places = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, len(counts))
    x = (places - (np.array(counts) - 1) / 2) * spacing
    n, d = len(x), len(counts) + 1
    trace, up = np.column_stack([x, np.zeros(n)]), np.tile(np.eye(d)[-1], (n, 1))
    same, weights = csr_array(eye_array(n)), np.full(n, spacing ** len(counts))
    cell, facets = "interval", np.stack([np.arange(n - 1), np.arange(1, n)], axis=1)
    if d == 3:
        number = np.arange(n).reshape(counts)
        corners = (number[:-1, :-1], number[1:, :-1], number[:-1, 1:], number[1:, 1:])
        cell, facets = "quadrilateral", np.stack(corners, axis=-1).reshape(-1, 4)
    punch, strip = (
        ContactSurface(body, trace, facets, cell, 1, np.arange(n), weights, outward, same)
        for body, outward in (("punch", -up), ("strip", up))
    )
    gap = np.sum(x**2, axis=1) / (2 * radius)
    pair = ContactPair(punch, strip, HERE, up, weights, same, same, same, gap, HERE)
    rigid = RigidEquilibrium(pair, up[:, :, None], np.array([-load]), ("lambda_F",), of_punch=1)
    steps, axes, depth = (spacing,) * len(counts), tuple(range(d)), 1e3 * radius if d == 2 else np.inf
    bodies = [
        HalfSpace(places, steps, body.shear, body.poisson, axes, outward, depth=depth)
        for body, outward in ((upper, -1.0), (lower, 1.0))
    ]
    return OppositeBodies(bodies[0], bodies[1], rigid, ALONG_X)


def _squares(x: Array, spacing: float) -> NDArray[np.int64]:
    """Return the nodes at the corners of the squares between them (f, 4)."""
    places = np.round(x / spacing - 0.5).astype(int)
    number = {(i, j): k for k, (i, j) in enumerate(zip(*places.T.tolist(), strict=True))}
    around = [[(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)] for i, j in number]
    return np.array([[number[c] for c in corners] for corners in around if all(c in number for c in corners)])
