"""Sliding as a vector over a cycle: its tensor at each material point, and how much of it crosses the main direction.

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

from dataclasses import dataclass

import numpy as np

from fenwear.arrays import Array


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
        whole = self.work
        squares = np.einsum("iab,iab->i", self.values, self.values)
        # l_1 - l_2 of a tensor with nothing across the surface.
        apart = np.sqrt(np.maximum(2 * squares - whole**2, 0.0))
        slides = whole > 0
        return np.where(slides, np.clip(0.5 * (1 - apart / np.where(slides, whole, 1.0)), 0.0, 0.5), 0.0)

    @property
    def direction(self) -> Array:
        """Unit vectors along which most of the work is done (n, 3); the first component that is not zero positive."""
        along = np.linalg.eigh(self.values)[1][:, :, -1]
        first = np.take_along_axis(along, (np.abs(along) > 1e-9).argmax(axis=1)[:, None], axis=1)
        return np.asarray(along * np.where(first < 0, -1.0, 1.0))


@dataclass(frozen=True)
class CycleShear:
    """What coefficients may know of the whole cycle at the contact nodes.

    Attributes:
        ratio: Cross-shear ratios of the punch's and the strip's material there (n,) each.
        pressure: Mean pressure over the sliding of the cycle (n,), MPa.
    """

    ratio: tuple[Array, Array]
    pressure: Array
