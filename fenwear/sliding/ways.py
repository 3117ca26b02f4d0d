"""Sliding as a vector over a cycle on the materials of both bodies: tensors, cross-shear, mean pressure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fenwear.arrays import Array
from fenwear.interface import ContactPair
from fenwear.sliding.cross_shear import CycleShear, SlidingTensor


@dataclass(frozen=True, eq=False)
class SlidingWays:
    """What slides how far and where to in each phase of a cycle.

    Attributes:
        pairs: The surfaces in each phase.
        middle: The same in the middle position.
        lengths: Of the ways of the contact nodes (m, n), mm.
        directions: Unit vectors of the sliding in space (m, n, 3), or zero.
        strip_wears: Whether the strip's material matters.
        mean_pressure: That of the load over the contact, MPa.
        asked: Whether a coefficient depends on the cross-shear or the mean pressure of a cycle.
    """

    pairs: Sequence[ContactPair]
    middle: ContactPair
    lengths: Array
    directions: Array
    strip_wears: bool
    mean_pressure: float
    asked: bool

    @cached_property
    def _squares(self) -> Array:
        return _squares(self.directions)

    def tensor(self, pressure: Array | None = None) -> SlidingTensor:
        """Return the tensor of a cycle's sliding at the punch's contact nodes.

        Args:
            pressure: Of all phases (m, n), MPa; None for the ways alone.
        """
        weights = self.lengths if pressure is None else self.lengths * pressure
        return SlidingTensor(np.einsum("mi,mic->ic", weights, self._squares).reshape(-1, 3, 3))

    def tensor_of_strip(self, pressure: Array | None = None) -> SlidingTensor:
        """Return the same at the strip's contact nodes, of its own material that moves under the punch."""
        weights = self.lengths if pressure is None else self.lengths * pressure
        values = np.zeros((len(self.middle.strip.weights), 9))
        for k, facing in enumerate(self.pairs):
            along = facing.material_place.back(self.directions[k])
            values += facing.wear_projection @ (weights[k][:, None] * _squares(along))
        return SlidingTensor(values.reshape(-1, 3, 3))

    def shear(self, pressure: Array | None) -> CycleShear | None:
        """Return what coefficients know of a whole cycle; None where none asks for it.

        Where nothing presses in the whole cycle the ways alone count, as where no pressures are known yet; where
        nothing slides the mean pressure is that of the phases.

        Args:
            pressure: Of all phases (m, n), MPa; None where they are not known.
        """
        return self._unknown if pressure is None else self._known(pressure)

    @cached_property
    def _unknown(self) -> CycleShear | None:
        if not self.asked:
            return None
        ways = self.tensor()
        return CycleShear((ways.ratio, self._of_strip(None)), np.full(len(ways.work), self.mean_pressure))

    def _known(self, pressure: Array) -> CycleShear | None:
        if not self.asked:
            return None
        found, ways, slid = self.tensor(pressure), self.tensor(), self.lengths.sum(axis=0)
        ratio = np.where(found.work > 0, found.ratio, ways.ratio)
        mean = np.where(slid > 0, found.work / np.where(slid > 0, slid, 1.0), pressure.mean(axis=0))
        return CycleShear((ratio, self._of_strip(pressure)), mean)

    def _of_strip(self, pressure: Array | None) -> Array:
        """Return the cross-shear ratio of the strip's material at the contact nodes."""
        if not self.strip_wears:
            return np.zeros(self.lengths.shape[1])
        return np.asarray(self.middle.wear_interpolation @ self.tensor_of_strip(pressure).ratio)


def _squares(along: Array) -> Array:
    """Return the products of all components of directions (..., 3) with each other (..., 9)."""
    return np.reshape(along[..., :, None] * along[..., None, :], (*along.shape[:-1], 9))
