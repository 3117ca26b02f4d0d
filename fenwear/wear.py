"""The wear rule: depth worn in a step, and the wear of a step as a layer of the contact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fenwear.arrays import Array
from fenwear.case import WearLaw


@dataclass(frozen=True)
class Wear:
    """Depth worn = coefficient p^b S, S the integral of v^a over the step; equations (1), (26), (27).

    Attributes:
        law: beta~, b and a.
        sliding: S of one half-cycle, mm^a s^(1-a).
    """

    law: WearLaw
    sliding: float

    @property
    def per_power(self) -> float:
        """beta~ S: depth worn in one half-cycle for each unit of p^b, mm/MPa^b."""
        return self.law.coefficient * self.sliding

    def depth(self, pressure: Array) -> Array:
        """Return the depth worn in a half-cycle at `pressure`, mm."""
        if self.law.pressure_exponent == 1:
            return self.per_power * pressure
        return self.per_power * np.maximum(pressure, 0.0) ** self.law.pressure_exponent


@dataclass(frozen=True)
class WornLayer:
    """The wear of `repeats` cycles at the pressures of their phases, as a layer of the contact.

    Put into the inequality it makes the step implicit: pressure and wear belong to its end, so that
    it is stable for any number of repeats.
    """

    wear: Wear
    repeats: float = 1.0

    def opening(self, pressure: Array) -> Array:
        """Return the depth worn (n,), mm, from the pressures (m, n)."""
        return self.repeats * self.wear.depth(pressure).sum(axis=0)

    def slope(self, pressure: Array) -> Array:
        """Return its derivative to each pressure (m, n), mm/MPa."""
        b = self.wear.law.pressure_exponent
        if b == 1:
            return np.full_like(pressure, self.repeats * self.wear.per_power)
        floor = 1e-9 * max(float(pressure.max()), 1e-300)  # b < 1: the slope at p = 0 is infinite
        return self.repeats * self.wear.per_power * b * np.maximum(pressure, floor) ** (b - 1)
