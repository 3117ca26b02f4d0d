"""Two surfaces facing each other: gap, quadrature weights, transfer between the two.

Pressure and gap live at the punch's contact nodes. With the weights w_i of these Gauss-Lobatto
nodes the nodal force per thickness is w_i p_i, so each node is one complementarity pair.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fenwear.arrays import Array
from fenwear.elasticity import ElasticBody
from fenwear.errors import CaseError, Problem
from fenwear.mortar import mortar_transfer
from fenwear.polynomials import interpolation
from fenwear.surface import Surface, SurfaceNodes, rigid_motion


@dataclass(frozen=True)
class Facing:
    """The punch's contact nodes opposite the strip's surface.

    Attributes:
        punch: The punch's contact nodes; the interface takes their coordinates and weights.
        strip: The strip's contact nodes.
        transfer: Takes values at the strip's nodes to the punch's (n, n_strip), by a dual mortar.
        initial_gap: Distance along e_n before any deformation (n,), mm.
    """

    punch: SurfaceNodes
    strip: SurfaceNodes
    transfer: Array
    initial_gap: Array

    @property
    def x(self) -> Array:
        """Abscissae of the interface nodes (n,), mm."""
        return self.punch.x[:, 0]

    @property
    def weights(self) -> Array:
        """Quadrature weights (n,), mm."""
        return self.punch.weights

    def interpolate(self, values: Array, x: Array) -> Array:
        """Return the finite-element function of nodal `values` (n,) at abscissae `x`."""
        return interpolation(self.x, self.punch.degree, np.atleast_1d(x)) @ values


def face(punch: SurfaceNodes, strip: SurfaceNodes) -> Facing:
    """Bring the punch's nodes opposite the strip's surface.

    Raises:
        CaseError: the surfaces do not face each other.
    """
    x, z = punch.x[:, 0], punch.x[:, 1]
    low, high = strip.x[[0, -1], 0]
    slack = 1e-6 * (x[-1] - x[0])
    if x[0] < low - slack or x[-1] > high + slack:
        _not_facing(f"punch_contact spans x = {x[0]:g} to {x[-1]:g} mm, strip_contact only {low:g} to {high:g} mm")
    transfer = mortar_transfer(x, punch.degree, strip.x[:, 0], strip.degree)
    if (np.einsum("ic,ic->i", punch.normal, transfer @ strip.normal) < 0.5).any():
        _not_facing("the outward normals of punch_contact and strip_contact do not point at each other")
    gap = (z - transfer @ strip.x[:, 1]) * punch.normal[:, 1]
    if abs(gap.min()) > 0.01 * (x[-1] - x[0]):
        _not_facing(f"punch_contact lies {gap.min():g} mm above strip_contact where they are closest")
    return Facing(punch, strip, transfer, gap)


def _not_facing(reason: str) -> None:
    raise CaseError(Problem("geometry", f"the contact surfaces do not face each other: {reason}"))


@dataclass(frozen=True)
class Statics:
    """What the equilibrium of the rigid modes needs of the interface; no elasticity in it.

    (H + d mu H_t)^T W p + F = 0, per thickness.

    Attributes:
        facing: The nodes and the transfer.
        rigid_normal: H (n, modes), the gap opened by each rigid mode.
        rigid_tangential: H_t (n, modes).
        resultant: F = R^T f of the loads (modes,), N/mm and N.
        mode_names: Names of the rigid modes, lambda_F and lambda_M for a tilting punch.
    """

    facing: Facing
    rigid_normal: Array
    rigid_tangential: Array
    resultant: Array
    mode_names: tuple[str, ...]

    def equilibrium(self, direction: int, friction: float) -> Array:
        """Return (H + d mu H_t)^T W (modes, n): the load that pressure balances."""
        return ((self.rigid_normal + direction * friction * self.rigid_tangential) * self.facing.weights[:, None]).T

    @property
    def mean_pressure(self) -> float:
        """Load over the nominal contact, MPa; 1 where supports and not the contact carry the load."""
        if "lambda_F" not in self.mode_names:
            return 1.0
        force = abs(self.resultant[self.mode_names.index("lambda_F")])
        return float(force / self.facing.weights.sum()) or 1.0


def statics(facing: Facing, punch: ElasticBody, strip: ElasticBody) -> Statics:
    """Gather the rigid modes at the interface; collective."""
    punch_normal, punch_tangential = rigid_motion(punch, facing.punch)
    strip_normal, strip_tangential = rigid_motion(strip, facing.strip)
    return Statics(
        facing,
        np.hstack([punch_normal, -facing.transfer @ strip_normal]),
        np.hstack([punch_tangential, -facing.transfer @ strip_tangential]),
        np.concatenate([punch.rigid_resultant, strip.rigid_resultant]),
        (*punch.mode_names, *strip.mode_names),
    )


@dataclass(frozen=True)
class Interface:
    """Two condensed bodies in contact: gap = (S_n + d mu S_t) p + H a + g_load + g_0 + w.

    Attributes:
        statics: H, H_t, F, the nodes and the transfer.
        normal_compliance: S_n (n, n), mm/MPa.
        tangential_compliance: S_t (n, n), mm/MPa.
        load_gap: g_load (n,), mm.
    """

    statics: Statics
    normal_compliance: Array
    tangential_compliance: Array
    load_gap: Array

    def compliance(self, direction: int, friction: float) -> Array:
        """Return S_n + d mu S_t (n, n), mm/MPa."""
        return self.normal_compliance + direction * friction * self.tangential_compliance

    @cached_property
    def elastic_length(self) -> float:
        """Gap that a uniform unit pressure opens on average, mm/MPa: the scale of gaps."""
        return float(np.abs(self.normal_compliance.sum(axis=1)).mean())


def join(statics: Statics, punch: Surface, strip: Surface) -> Interface:
    """Join two condensed bodies."""
    to_punch, weights = statics.facing.transfer, statics.facing.weights
    return Interface(
        statics,
        (punch.normal_by_normal + to_punch @ strip.normal_by_normal @ to_punch.T) * weights,
        (punch.normal_by_tangential + to_punch @ strip.normal_by_tangential @ to_punch.T) * weights,
        punch.normal_by_load - to_punch @ strip.normal_by_load,
    )
