"""The equilibrium of the rigid modes at the interface: what pressure must balance, without any elasticity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fenwear.arrays import Array
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.surface import rigid_motion
from fenwear.interface.facing import Facing


@dataclass(frozen=True)
class Statics:
    """What the equilibrium of the rigid modes needs of the interface; no elasticity in it.

    (H + H_t tau)^T W p + F = 0, per thickness, tau the traction along e_t over the pressure: d mu.

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

    def equilibrium(self, slip: float | Array) -> Array:
        """Return (H + tau H_t)^T W (modes, n): the load that pressure balances.

        Args:
            slip: tau = d mu, the same everywhere or (n,).
        """
        return (self.rigid_normal.T + slip * self.rigid_tangential.T) * self.facing.weights

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
