"""Two condensed bodies joined: the gap that pressure, friction, rigid motion and loads open."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.bodies.condensation import CondensedBody
from fenwear.interface.equilibrium import RigidEquilibrium
from fenwear.interface.pair import ContactPair
from fenwear.interface.placement import ZERO


@dataclass(frozen=True)
class Interface:
    """Two condensed bodies in contact: gap = S(tau) p + H a + g_load + g_0 + w.

    Attributes:
        rigid: H, F, the nodes and the transfer.
        gap_by_force: Gap at node i from a unit force along each axis at node j, on the punch and its
            reaction on the strip (n, n, d), mm per N/mm in the plane.
        load_gap: g_load (n,), mm.
    """

    rigid: RigidEquilibrium
    gap_by_force: Array
    load_gap: Array

    def compliance(self, friction_ratio: Array | float) -> Array:
        """Return S (n, n), mm/MPa: the gap from unit pressures with their friction.

        Args:
            friction_ratio: tau (n, d), the traction of friction on the punch over the pressure; 0.0 for none.
        """
        traction = (self.pair.normal + friction_ratio) * self.pair.weights[:, None]
        return np.einsum("ijd,jd->ij", self.gap_by_force, traction)

    def compliance_of(self, friction_ratio: Array, nodes: NDArray[np.int64]) -> Array:
        """Return the columns of S of some nodes (n, k), mm/MPa."""
        traction = (self.pair.normal[nodes] + friction_ratio[nodes]) * self.pair.weights[nodes, None]
        return np.einsum("ijd,jd->ij", self.gap_by_force[:, nodes], traction)

    def own_compliance(self, friction_ratio: Array) -> Array:
        """Return the diagonal of S (n,), mm/MPa."""
        traction = (self.pair.normal + friction_ratio) * self.pair.weights[:, None]
        return np.einsum("iid,id->i", self.gap_by_force, traction)

    @cached_property
    def elastic_length(self) -> float:
        """Gap that unit pressures open on average without any rigid motion, mm/MPa: the scale of gaps."""
        elastic = self.compliance(0.0)
        modes = self.rigid.rigid_normal
        elastic = elastic - modes @ np.linalg.lstsq(modes, elastic, rcond=None)[0]
        return float(np.abs(elastic).sum(axis=1).mean())

    @property
    def pair(self) -> ContactPair:
        """The nodes and the transfer."""
        return self.rigid.pair


def join(rigid: RigidEquilibrium, punch: CondensedBody, strip: CondensedBody, *, strip_moves: bool) -> Interface:
    """Join two condensed bodies at the place of a pair.

    Args:
        rigid: The equilibrium there.
        punch: Condensed onto its pressure nodes.
        strip: Condensed onto its trace nodes where it moves as a whole, else onto the contact nodes opposite.
        strip_moves: Which of the two.
    """
    pair = rigid.pair
    reading = pair.transfer if strip_moves else None
    on_strip = strip.normal_response(pair.normal_on_strip, reading)
    if pair.placement.turn != ZERO:
        on_strip = pair.placement.vectors(on_strip.reshape(-1, on_strip.shape[2])).reshape(on_strip.shape)
    by_load = strip.by_load if reading is None else reading @ strip.by_load
    load_gap = _along(pair.normal, punch.by_load) - _along(pair.normal_on_strip, by_load)
    return Interface(rigid, punch.normal_response(pair.normal) + on_strip, load_gap)


def _along(normal: Array, vectors: Array) -> Array:
    return np.einsum("id,id->i", normal, vectors)
