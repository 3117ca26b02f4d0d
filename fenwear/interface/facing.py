"""Two surfaces facing each other at one position of the strip: gap, quadrature weights, transfer between the two.

Pressure and gap live at the punch's contact nodes. With the weights w_i of these Gauss-Lobatto
nodes the nodal force per thickness is w_i p_i, so each node is one complementarity pair.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fenwear.arrays import Array
from fenwear.bodies.surface import SurfaceNodes
from fenwear.errors import CaseError, Problem
from fenwear.interface.mortar import lagrange, transfer_matrix

STEEPEST = 0.7  # cosine between a surface's normal and the contact's: steeper parts never touch


@dataclass(frozen=True)
class Facing:
    """The punch's contact nodes opposite the strip's surface at one position of the strip.

    The contact frame (e_n into the punch, e_t along the sliding) is that of the strip's surface opposite
    each node, for both bodies: what acts on one then acts on the other the other way.

    Attributes:
        punch: The punch's contact nodes in the contact frame; the interface takes their coordinates and weights.
        strip: The strip's contact nodes, on its material.
        transfer: Takes displacements and temperatures at the strip's nodes to the punch's (n, n_strip).
        material: Takes worn depths on the strip's material to the punch's nodes (n, n_strip).
        initial_gap: Distance along e_n before any deformation and wear (n,), mm.
    """

    punch: SurfaceNodes
    strip: SurfaceNodes
    transfer: Array
    material: Array
    initial_gap: Array

    @property
    def x(self) -> Array:
        """Abscissae of the interface nodes (n,), mm."""
        return self.punch.x[:, 0]

    @property
    def weights(self) -> Array:
        """Quadrature weights (n,), mm."""
        return self.punch.weights

    @cached_property
    def to_strip(self) -> Array:
        """What puts depths worn at the interface nodes on the strip's material (n_strip, n), areas kept."""
        return self.material.T * self.weights / self.strip.weights[:, None]

    def opening(self, punch: Array, strip: Array) -> Array:
        """Return the gap opened by depths worn off both bodies (n,), mm."""
        return punch + self.material @ strip

    def interpolate(self, values: Array, x: Array) -> Array:
        """Return the finite-element function of nodal `values` (n,) at abscissae `x`."""
        return interpolation(self.x, self.punch.degree, np.atleast_1d(x)) @ values

    def moved(self, offset: float, *, whole: bool) -> Facing:
        """Return the surfaces with the strip moved by `offset` towards +x, mm.

        Args:
            whole: Whether the strip moves as a whole; else its material only, past the place where its
                displacements and temperatures are described.

        Raises:
            CaseError: the strip's contact surface does not reach below the whole punch there.
        """
        if offset == 0.0:
            return self
        x, strip = self.x, self.strip.x[:, 0] + offset
        slack = 1e-6 * (x[-1] - x[0])
        if x[0] < strip[0] - slack or x[-1] > strip[-1] + slack:
            raise CaseError(
                Problem(
                    "motion",
                    f"the stroke runs off the meshed strip: moved by {offset:g} mm, strip_contact spans x = "
                    f"{strip[0]:g} to {strip[-1]:g} mm, but punch_contact {x[0]:g} to {x[-1]:g} mm "
                    "(lengths of a mesh are taken as mm)",
                )
            )
        material = transfer_matrix(x, self.punch.degree, strip, self.strip.degree)
        if not whole:
            return replace(self, material=material)
        heights = np.einsum("ic,ic->i", self.punch.normal, self.punch.x - material @ self._shifted(offset))
        return replace(self, transfer=material, material=material, initial_gap=heights)

    def _shifted(self, offset: float) -> Array:
        return self.strip.x + np.array([offset, 0.0])


def face(punch: SurfaceNodes, strip: SurfaceNodes) -> Facing:
    """Bring the punch's nodes opposite the strip's surface.

    Raises:
        CaseError: the surfaces do not face each other.
    """
    x = punch.x[:, 0]
    low, high = strip.x[[0, -1], 0]
    slack = 1e-6 * (x[-1] - x[0])
    for name, nodes in (("punch", punch), ("strip", strip)):
        if np.diff(nodes.x[:, 0]).min() <= 0:
            _not_facing(f"{name}_contact folds back on itself along x")
    if x[0] < low - slack or x[-1] > high + slack:
        _not_facing(
            f"punch_contact spans x = {x[0]:g} to {x[-1]:g} mm, strip_contact only {low:g} to {high:g} mm "
            "(are the names of punch and strip exchanged?)"
        )
    transfer = transfer_matrix(x, punch.degree, strip.x[:, 0], strip.degree)
    normal = transfer @ strip.normal
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    facing = np.einsum("ic,ic->i", punch.normal, normal)
    if (facing < STEEPEST).any():
        worst = int(np.argmin(facing))
        _not_facing(
            f"their outward normals do not point at each other at x = {x[worst]:g} mm: they are "
            f"{np.degrees(np.arccos(np.clip(facing[worst], -1, 1))):.0f} degrees off"
        )
    if normal[:, 1].mean() < 0:
        _not_facing("the punch lies below the strip; expected it above, with z upwards")
    # Forces act along the common normal: a node's weight is its length seen along it.
    common = replace(
        punch,
        normal=normal,
        tangent=np.stack([normal[:, 1], -normal[:, 0]], axis=1),
        weights=punch.weights * facing,
    )
    gap = np.einsum("ic,ic->i", normal, punch.x - transfer @ strip.x)
    return Facing(common, strip, transfer, transfer, gap)


def check_distance(facing: Facing) -> None:
    """Make sure that the surfaces touch, or nearly so, before anything deforms or wears.

    Raises:
        CaseError: they are apart, or one inside the other.
    """
    x = facing.x
    closest = float(facing.initial_gap.min())
    if abs(closest) > 0.01 * (x[-1] - x[0]):
        way = "above" if closest > 0 else "inside"
        _not_facing(f"punch_contact lies {abs(closest):g} mm {way} strip_contact where they are closest")


def _not_facing(reason: str) -> None:
    raise CaseError(Problem("geometry", f"the contact surfaces do not face each other: {reason}"))


def interpolation(nodes: Array, degree: int, x: Array) -> Array:
    """Return the matrix of piecewise Lagrange interpolation from `nodes` to `x`.

    Args:
        nodes: Ascending abscissae; every facet has degree + 1 of them, its ends shared.
        x: Abscissae inside the nodes' range.
    """
    ends = nodes[::degree]
    facet = np.clip(np.searchsorted(ends, x, side="right") - 1, 0, len(ends) - 2)
    columns = facet[:, None] * degree + np.arange(degree + 1)
    matrix = np.zeros((len(x), len(nodes)))
    np.put_along_axis(matrix, columns, lagrange(nodes[columns], x), axis=1)
    return matrix
