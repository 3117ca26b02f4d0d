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
from fenwear.parallel import Rows, total

EVERY, RUN = slice(None), 512  # rows that are taken at once, where whole matrices would take memory


@dataclass(frozen=True)
class Interface:
    """Two condensed bodies in contact: gap = S(tau) p + H a + g_load + g_0 + w.

    What the bodies answer along e_n is made when it is first asked for, and kept.

    Attributes:
        rigid: H, F, the nodes and the transfer.
        punch: Condensed onto its pressure nodes.
        strip: Condensed onto its trace nodes where it moves as a whole, else onto the contact nodes opposite.
        strip_moves: Which of the two.
        rows: Of the contact nodes on each rank; None where every rank has all.
    """

    rigid: RigidEquilibrium
    punch: CondensedBody
    strip: CondensedBody
    strip_moves: bool
    rows: Rows | None = None

    @property
    def _own(self) -> slice:
        """This rank's own rows."""
        return slice(0, len(self.pair.weights)) if self.rows is None else self.rows.own

    @cached_property
    def gap_by_force(self) -> Array:
        """Gap at node i from a unit force along each axis at node j, on the punch and its reaction on the strip.

        (n, n, d), mm per N/mm in the plane; this rank's own rows where ranks share them.
        """
        pair = self.pair
        reading = pair.transfer if self.strip_moves else None
        on_strip = self.strip.normal_response(pair.normal_on_strip, reading, self._own)
        if pair.placement.turn != ZERO:
            on_strip = pair.placement.vectors(on_strip.reshape(-1, on_strip.shape[2])).reshape(on_strip.shape)
        return self.punch.normal_response(pair.normal, None, self._own) + on_strip

    @cached_property
    def load_gap(self) -> Array:
        """g_load (n,), mm."""
        pair, strip = self.pair, self.strip.by_load
        by_load = pair.transfer @ strip if self.strip_moves else strip
        return _along(pair.normal, self.punch.by_load) - _along(pair.normal_on_strip, by_load)

    @cached_property
    def own_by_force(self) -> Array:
        """Gap at each node from a unit force along each axis at itself (n, d); collective where ranks share rows."""
        own, by_force = self._own, self.gap_by_force
        diagonal = by_force[np.arange(len(by_force)), np.arange(own.start, own.stop)]
        return diagonal if self.rows is None else self.rows.gathered(diagonal)

    @cached_property
    def by_even(self) -> Array:
        """Gap that an even unit pressure opens without friction (n,), mm/MPa; collective where ranks share rows."""
        even = np.einsum("ijd,jd->i", self.gap_by_force, self.pair.normal * self.pair.weights[:, None])
        return even if self.rows is None else self.rows.gathered(even)

    def compliance(self, friction_ratio: Array | float) -> Array:
        """Return S (n, n), mm/MPa: the gap from unit pressures with their friction; collective where ranks share it.

        Args:
            friction_ratio: tau (n, d), the traction of friction on the punch over the pressure; 0.0 for none.
        """
        own = self._own_rows(friction_ratio)
        return own if self.rows is None else self.rows.gathered(own)

    def _own_rows(self, friction_ratio: Array | float, run: slice = EVERY) -> Array:
        traction = (self.pair.normal + friction_ratio) * self.pair.weights[:, None]
        return np.einsum("ijd,jd->ij", self.gap_by_force[run], traction)

    def compliance_of(self, friction_ratio: Array, nodes: NDArray[np.int64]) -> Array:
        """Return the columns of S of some nodes (n, k), mm/MPa; this rank's own rows where ranks share them."""
        traction = (self.pair.normal[nodes] + friction_ratio[nodes]) * self.pair.weights[nodes, None]
        return np.einsum("ijd,jd->ij", self.gap_by_force[:, nodes], traction)

    def own_compliance(self, friction_ratio: Array) -> Array:
        """Return the diagonal of S (n,), mm/MPa."""
        traction = (self.pair.normal + friction_ratio) * self.pair.weights[:, None]
        return np.einsum("id,id->i", self.own_by_force, traction)

    @cached_property
    def elastic_length(self) -> float:
        """Gap that unit pressures open on average without any rigid motion, mm/MPa: the scale of gaps."""
        modes = self.rigid.rigid_normal
        here = EVERY if self.rows is None else self.rows.own
        own, inverse = modes[here], np.linalg.pinv(modes)[:, here]
        runs = [slice(start, start + RUN) for start in range(0, len(own), RUN)]
        elastic = (self._own_rows(0.0, run) for run in runs)
        rigid: Array = np.zeros((modes.shape[1], len(modes)))
        for run, part in zip(runs, elastic, strict=True):
            rigid += inverse[:, run] @ part
        if self.rows is not None:
            rigid = total(self.rows.comm, rigid)
        elastic = (self._own_rows(0.0, run) for run in runs)
        parts = [np.abs(part - own[run] @ rigid).sum(axis=1) for run, part in zip(runs, elastic, strict=True)]
        lengths = np.concatenate([np.zeros(0), *parts])
        return float((lengths if self.rows is None else self.rows.gathered(lengths)).mean())

    @property
    def pair(self) -> ContactPair:
        """The nodes and the transfer."""
        return self.rigid.pair


def join(
    rigid: RigidEquilibrium, punch: CondensedBody, strip: CondensedBody, *, strip_moves: bool, rows: Rows | None = None
) -> Interface:
    """Join two condensed bodies at the place of a pair; collective where ranks share the rows.

    Args:
        rigid: The equilibrium there.
        punch: Condensed onto its pressure nodes.
        strip: Condensed onto its trace nodes where it moves as a whole, else onto the contact nodes opposite.
        strip_moves: Which of the two.
        rows: Of the contact nodes on each rank; None where every rank has all.
    """
    interface = Interface(rigid, punch, strip, strip_moves, rows)
    if rows is not None:  # now, while all ranks are here
        _ = interface.own_by_force, interface.by_even, interface.elastic_length
    return interface


def _along(normal: Array, vectors: Array) -> Array:
    return np.einsum("id,id->i", normal, vectors)
