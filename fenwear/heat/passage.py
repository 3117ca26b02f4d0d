"""Where the punch is on a strip that passes under it to and fro, in the strip's own frame.

The strip's mesh stays with its material, and the contact moves over it. In each step the friction's flux enters
through the transfer of the places of that step, their mean over what is slid in it: so the flux of a place counts by
the speed with which it is passed. The temperature of the contact is read through the transpose.
"""

from __future__ import annotations

import itertools
from functools import cached_property, reduce
from operator import add

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from fenwear.arrays import Array
from fenwear.interface import ContactPair, transfer_at
from fenwear.sliding.field import SlidingField
from fenwear.sliding.motion import Motion

INSTANTS = 8  # places at most that stand for those of a step


class Passage:
    """The places of the punch's contact on the strip's material over a cycle.

    Args:
        middle: Both surfaces in the middle position.
        sliding: How the strip's material moves for a unit of the motion.
        motion: To and fro.

    Raises:
        CaseError: the stroke runs off the strip's contact surface; says how much is missing.
    """

    def __init__(self, middle: ContactPair, sliding: SlidingField, motion: Motion) -> None:
        self.middle, self._sliding, self.motion = middle, sliding, motion
        self._found: dict[float, csr_array] = {}
        ends = motion.offsets(1)
        self._farthest = float(ends.min()), float(ends.max())
        for offset in sorted(self._farthest, key=abs, reverse=True):  # the farthest first: its error tells all
            self._at(offset)

    @cached_property
    def nodes(self) -> NDArray[np.int64]:
        """The strip's trace nodes that some place of the contact covers, ascending (q,)."""
        punch, (first, last) = self.middle.punch, self._farthest
        moved = np.linalg.norm(self._moved(last) - self._moved(first), axis=1).max()
        count = 2 + int(2 * moved / np.sort(np.ptp(punch.x, axis=0))[1 - punch.dim])  # by half a width
        return np.unique(np.concatenate([self._at(float(x)).indices for x in np.linspace(first, last, count)]))

    @cached_property
    def ends(self) -> list[csr_array]:
        """What takes values at `nodes` to the contact nodes at the end of each phase (n, q) each."""
        return [csr_array(self._at(float(end))[:, self.nodes]) for end in self.motion.offsets(1)[:, -1]]

    def steps(self, count: int) -> tuple[list[csr_array], list[list[int]]]:
        """Return the mean transfers (n, q) of steps, and which of them each of `count` steps of each phase takes."""
        edges = self.motion.offsets(count)
        numbers: dict[tuple[float, float], int] = {}
        kinds = []
        for row in edges:
            places = [(min(float(a), float(b)), max(float(a), float(b))) for a, b in itertools.pairwise(row)]
            kinds.append([numbers.setdefault(place, len(numbers)) for place in places])
        return [self._mean(*ends) for ends in numbers], kinds

    def _mean(self, low: float, high: float) -> csr_array:
        """Return the mean transfer between two offsets (n, q)."""
        slid = np.linalg.norm(self._moved(high) - self._moved(low), axis=1).max()
        count = min(INSTANTS, 1 + int(2 * slid / self._spacing))
        places = low + (high - low) * (np.arange(count) + 0.5) / count
        mean = reduce(add, (self._at(float(place)) for place in places)) / count
        return csr_array(csr_array(mean)[:, self.nodes])

    @cached_property
    def _spacing(self) -> float:
        """The smallest distance of neighbouring trace nodes of the punch, mm."""
        trace, facets = self.middle.punch.trace, self.middle.punch.facets
        corners = trace[facets]
        apart = np.linalg.norm(corners[:, :, None] - corners[:, None], axis=3)
        return float(apart[:, ~np.eye(facets.shape[1], dtype=bool)].min())

    def _moved(self, offset: float) -> Array:
        return self._sliding.placement(offset).points(self.middle.strip.trace)

    def _at(self, offset: float) -> csr_array:
        if offset not in self._found:
            self._found[offset] = transfer_at(self.middle, self._sliding.placement(offset))
        return self._found[offset]
