"""The contacts of a phase over the last cycles, and where the next one is looked for from.

What touches goes on as a polynomial of the cycles, which is known at those before. Where surfaces give way by a law,
pressures near the edges of the contact are far from that; how near they are is not, whether they touch or not (see
`fenwear.layers.closure`): so nodes come to touch where the polynomial has them.
"""

from __future__ import annotations

from math import comb

import numpy as np

from fenwear.arrays import Array
from fenwear.contact import ContactState
from fenwear.layers.closure import Law

# Shares of the last cycles in the next, by polynomials of rising degree.
ONWARDS = np.array([[-comb(n, k) * (-1) ** k if k <= n else 0 for k in range(1, 7)] for n in range(1, 7)], dtype=float)
MOST = np.array(1.0)  # change of nearness


class Onwards:
    """Extrapolates contacts of one phase from cycle to cycle.

    Args:
        nodes, modes: Numbers of nodes and of rigid modes.
        law: By which surfaces give way; None where they do not, or in proportion to the pressure.
        hardness: Largest pressure, MPa.
    """

    def __init__(self, nodes: int, modes: int, law: Law | None, hardness: float) -> None:
        self._law, self._hardness = law, hardness
        self._nodes, self._known = nodes, np.zeros((len(ONWARDS), nodes + modes))  # each with its rigid motions
        self._values = self._known[:, :nodes]
        self._last: ContactState | None = None
        self._count = 0  # of cycles that are known
        self._alike = 0  # of them, in which the same nodes touch as in the last one
        self._touching = b""

    def keep(self, before: ContactState | None, contact: ContactState) -> None:
        """Take a contact, and the one a cycle before it; what was known is forgotten where that is not the last one."""
        pressure = contact.pressure[0]
        follows = before is not None and before is self._last
        self._count = min(self._count + 1, len(ONWARDS)) if follows else 1
        self._known[1:] = self._known[:-1]
        self._values[0] = pressure if self._law is None else self._law.nearness(pressure, contact.gap[0])
        self._known[0, self._nodes :], self._last = contact.rigid[0], contact
        if self._law is None:
            touching = (pressure > 0).tobytes()
            self._alike = min(self._alike + 1, self._count) if touching == self._touching else 1
            self._touching = touching

    def start(self, before: ContactState | None) -> ContactState | None:
        """Return the contact that goes on as over the last cycles, from that of the last one."""
        count = self._count
        if before is None or count < 2 or before is not self._last:
            return before
        own, every = before.pressure[0], ONWARDS[count - 1, :count] @ self._known[:count]
        further, rigid = every[: self._nodes], every[None, self._nodes :]
        if self._law is None:
            if self._alike < count:
                self._as_long_as_they_touch(further)
            further = np.where((own > 0) & (further > 0), further, own)
        else:
            last = self._values[0]
            further = self._law.pressure_of(np.minimum(np.maximum(further, last - MOST), last + MOST))
        if self._hardness < np.inf:
            further = np.where((own < self._hardness) & (further < self._hardness), further, own)
        return ContactState(further[None], before.gap, rigid, before.iterations)

    def _as_long_as_they_touch(self, further: Array) -> None:
        """Put pressures in place that go on as far back as their nodes touch."""
        values = self._values[: self._count]
        fresh = np.flatnonzero((values[-1] <= 0) & (values[0] > 0))
        touch = np.logical_and.accumulate(values[:, fresh] > 0).sum(axis=0)
        further[fresh] = (ONWARDS[touch - 1, : self._count].T * values[:, fresh]).sum(axis=0)
