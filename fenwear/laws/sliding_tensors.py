"""Sliding as a vector over a cycle on the materials of both bodies: tensors, cross-shear, mean pressure.

Sliding as a vector over a cycle: its tensor at each material point, and how much of it crosses the main direction.

In phase k a point slides the way ds_k in the direction e_k, as the material of a body sees it (turned back with the
body), under the pressure p_k. With the tensor

    T = sum of p_k ds_k e_k e_k^T,    l_1 >= l_2 its principal values in the surface,

p_k ds_k is the work of friction over its coefficient; cos² of the angle between e_k and a direction is the share of
that work along the direction, sin² the share across. The direction with most of the work along it is the principal one,
to which molecules of a polymer are drawn out (A. Wang, Wear 248, 2001), and the share of the work across it,

    cross-shear ratio = l_2 / (l_1 + l_2),

is 0 on a straight way and 1/2 where all directions are alike, as on a circle (L. Kang et al., J. Biomech. 41, 2008).
The mean pressure of a cycle is that over the sliding, sum of p_k ds_k over sum of ds_k.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fenwear.common.arrays import Array
from fenwear.surfaces import ContactPair


@dataclass(frozen=True)
class SlidingTensor:
    """The tensor of sliding at n points of a material.

    Attributes:
        values: T (n, 3, 3), N/mm; mm where it is of the ways alone.
    """

    values: Array

    @property
    def work(self) -> Array:
        """Sum of p ds (n,), N/mm."""
        return np.asarray(np.trace(self.values, axis1=1, axis2=2))

    @property
    def ratio(self) -> Array:
        """The cross-shear ratio (n,) in [0, 1/2]; 0 where nothing slides."""
        work = self.work
        squares = np.einsum("iab,iab->i", self.values, self.values)
        # l_1 - l_2 of a tensor with nothing across the surface.
        apart = np.sqrt(np.maximum(2 * squares - work**2, 0.0))
        slides = work > 0
        return np.where(slides, np.clip(0.5 * (1 - apart / np.where(slides, work, 1.0)), 0.0, 0.5), 0.0)

    @property
    def direction(self) -> Array:
        """Unit vectors along which most of the work is done (n, 3); the first component that is not zero positive."""
        along = np.linalg.eigh(self.values)[1][:, :, -1]
        first = np.take_along_axis(along, (np.abs(along) > 1e-9).argmax(axis=1)[:, None], axis=1)
        return np.asarray(along * np.where(first < 0, -1.0, 1.0))


@dataclass(frozen=True)
class CycleShear:
    """Variables of the whole cycle at the contact nodes, for coefficients.

    Attributes:
        ratio: Cross-shear ratios of the punch's and the strip's material there (n,) each.
        pressure: Mean pressure over the sliding of the cycle (n,), MPa.
    """

    ratio: tuple[Array, Array]
    pressure: Array


@dataclass(frozen=True, eq=False)
class SlidingWays:
    """Distances and directions of sliding in each phase of a cycle.

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
        """Return the tensor at the strip's contact nodes, of the strip's material that moves under the punch."""
        weights = self.lengths if pressure is None else self.lengths * pressure
        values = np.zeros((len(self.middle.strip.weights), 9))
        for k, facing in enumerate(self.pairs):
            along = facing.material_place.back(self.directions[k])
            values += facing.wear_projection @ (weights[k][:, None] * _squares(along))
        return SlidingTensor(values.reshape(-1, 3, 3))

    def shear(self, pressure: Array | None) -> CycleShear | None:
        """Return the shear of a whole cycle, as coefficients use it; None where no coefficient asks for it.

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
        tensor, ways, slid = self.tensor(pressure), self.tensor(), self.lengths.sum(axis=0)
        ratio = np.where(tensor.work > 0, tensor.ratio, ways.ratio)
        mean = np.where(slid > 0, tensor.work / np.where(slid > 0, slid, 1.0), pressure.mean(axis=0))
        return CycleShear((ratio, self._of_strip(pressure)), mean)

    def _of_strip(self, pressure: Array | None) -> Array:
        """Return the cross-shear ratio of the strip's material at the contact nodes."""
        if not self.strip_wears:
            return np.zeros(self.lengths.shape[1])
        return np.asarray(self.middle.wear_interpolation @ self.tensor_of_strip(pressure).ratio)


def _squares(along: Array) -> Array:
    """Return the products of all components of directions (..., 3) with each other (..., 9)."""
    return np.reshape(along[..., :, None] * along[..., None, :], (*along.shape[:-1], 9))
