"""The place of the punch on a strip that passes under it, to and fro or through a cycle, in the strip's frame.

The strip's mesh stays with its material, and the contact moves over it, whichever way the strip shifts and turns. In
each step the friction's flux enters through the transfer of the places of that step, their mean over what is slid in
it: so the flux of a place counts by the speed with which it is passed. The temperature of the contact is read through
the transpose.
"""

from __future__ import annotations

from functools import cache, cached_property, partial, reduce
from operator import add

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from fenwear.surfaces import ContactPair, Placement, transfer_at
from fenwear.surfaces.motion import Motion
from fenwear.surfaces.placement import HERE
from fenwear.surfaces.sliding_field import SlidingField, Way

INSTANTS = 8  # places at most that stand for those of a step


class Passage:
    """The places of the punch's contact on the strip's material over a cycle.

    Args:
        middle: Both surfaces in the middle position.
        sliding: Motion of the strip's material for a unit of the motion, where its phases have no separate fields.
        motion: To and fro, or a cycle as a table.

    Raises:
        CaseError: the stroke runs off the strip's contact surface; says how much is missing.
    """

    def __init__(self, middle: ContactPair, sliding: SlidingField, motion: Motion) -> None:
        self.middle, self._sliding, self.motion = middle, sliding, motion
        self._at = cache(partial(transfer_at, middle))
        self._whole = list(dict.fromkeys(way for row in motion.ways(sliding, 1) for way in row))
        ends = list(dict.fromkeys(way.at(share) for way in self._whole for share in (0.0, 1.0)))
        for place in sorted(
            ends, key=lambda place: -self._moved(HERE, place)
        ):  # the farthest first: its error tells all
            self._at(place)

    @cached_property
    def nodes(self) -> NDArray[np.int64]:
        """The strip's trace nodes that some place of the contact covers, ascending (q,)."""
        punch = self.middle.punch
        width = np.sort(np.ptp(punch.x, axis=0))[1 - punch.dim]
        covered = []
        for way in self._whole:
            count = 2 + int(2 * self._moved(way.at(0.0), way.at(1.0)) / width)  # by half a width
            covered += [self._at(way.at(float(share))).indices for share in np.linspace(0, 1, count)]
        return np.unique(np.concatenate(covered))

    @cached_property
    def ends(self) -> list[csr_array]:
        """Interpolation from `nodes` to the contact nodes at the end of each phase (n, q) each."""
        return [csr_array(self._at(end)[:, self.nodes]) for end in self.motion.ends(self._sliding)]

    def steps(self, count: int) -> tuple[list[csr_array], list[list[int]]]:
        """Return the mean transfers (n, q) of steps, and which of them each of `count` steps of each phase takes."""
        numbers: dict[Way, int] = {}
        kinds = [
            [numbers.setdefault(way, len(numbers)) for way in row] for row in self.motion.ways(self._sliding, count)
        ]
        return [self._mean(way) for way in numbers], kinds

    def _mean(self, way: Way) -> csr_array:
        """Return the mean transfer over a way (n, q)."""
        count = min(INSTANTS, 1 + int(2 * self._moved(way.at(0.0), way.at(1.0)) / self._spacing))
        places = [way.at((k + 0.5) / count) for k in range(count)]
        mean = reduce(add, (self._at(place) for place in places)) / count
        return csr_array(csr_array(mean)[:, self.nodes])

    @cached_property
    def _spacing(self) -> float:
        """The smallest distance of neighbouring trace nodes of the punch, mm."""
        trace, facets = self.middle.punch.trace, self.middle.punch.facets
        corners = trace[facets]
        apart = np.linalg.norm(corners[:, :, None] - corners[:, None], axis=3)
        return float(apart[:, ~np.eye(facets.shape[1], dtype=bool)].min())

    def _moved(self, first: Placement, other: Placement) -> float:
        """Return the largest distance of the strip's nodes between two places, mm."""
        trace = self.middle.strip.trace
        return float(np.linalg.norm(other.points(trace) - first.points(trace), axis=1).max())
