"""Two condensed bodies joined: the gap that pressure, friction, rigid motion and loads open."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fenwear.arrays import Array
from fenwear.bodies.surface import Surface
from fenwear.interface.equilibrium import Statics
from fenwear.interface.facing import Facing


@dataclass(frozen=True)
class Interface:
    """Two condensed bodies in contact: gap = (S_n + S_t tau) p + H a + g_load + g_0 + w, tau = d mu.

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

    def compliance(self, slip: float | Array) -> Array:
        """Return S_n + S_t tau (n, n), mm/MPa.

        Args:
            slip: tau = d mu, the same everywhere or (n,).
        """
        return self.normal_compliance + self.tangential_compliance * slip

    @cached_property
    def elastic_length(self) -> float:
        """Gap that a uniform unit pressure opens on average, mm/MPa: the scale of gaps."""
        return float(np.abs(self.normal_compliance.sum(axis=1)).mean())

    @property
    def facing(self) -> Facing:
        """The nodes and the transfer."""
        return self.statics.facing


def join(statics: Statics, punch: Surface, strip: Surface) -> Interface:
    """Join two condensed bodies."""
    to_punch, weights = statics.facing.transfer, statics.facing.weights
    return Interface(
        statics,
        (punch.normal_by_normal + to_punch @ strip.normal_by_normal @ to_punch.T) * weights,
        (punch.normal_by_tangential + to_punch @ strip.normal_by_tangential @ to_punch.T) * weights,
        punch.normal_by_load - to_punch @ strip.normal_by_load,
    )
