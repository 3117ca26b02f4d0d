"""The part of a pressure that wears: q^b of equation (1), with q = min(X p, cap) - threshold >= 0.

X is the share of the pressure that asperities carry. A number divides threshold and cap, and the coefficient has X^b.
Of a share that depends on anything the coefficient has all that it changes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fenwear.case import WearLaw
from fenwear.common.arrays import Array


@dataclass(frozen=True)
class PressureLaw:
    """The dependence of a body's wear rate on the pressure: beta~ v^a times `value`, in gross sliding and in slip.

    Attributes:
        exponent: b.
        threshold: Below it nothing wears, MPa.
        cap: Beyond it wear grows no more, MPa.
    """

    exponent: float = 1.0
    threshold: float = 0.0
    cap: float = np.inf

    @classmethod
    def of(cls, law: WearLaw, share: float | None = 1.0) -> PressureLaw:
        """Return the part that a wear law of the case wears, under a share of the pressure; None if no number."""
        if share is None:
            return cls(law.pressure_exponent, law.pressure_threshold)
        bounds = law.pressure_threshold, law.cap
        return cls(law.pressure_exponent, *(bound / share if bound > 0 and share > 0 else bound for bound in bounds))

    @property
    def power(self) -> bool:
        """Whether it is p^b and no more."""
        return self.threshold == 0 and self.cap == np.inf

    @property
    def linear(self) -> bool:
        """Whether wear is in proportion to the pressure."""
        return self.power and self.exponent == 1

    def value(self, pressure: Array) -> Array:
        """Return q^b (...), MPa^b, of pressures."""
        if self.linear:
            return pressure
        return np.maximum(np.minimum(pressure, self.cap) - self.threshold, 0.0) ** self.exponent

    def slope(self, pressure: Array) -> Array:
        """Return its derivatives to the pressures (...), MPa^(b-1)."""
        if self.linear:
            return np.ones_like(pressure)
        floor = 1e-9 * max(float(pressure.max(initial=0.0)), 1e-300)  # b < 1: the slope at p = 0 is infinite
        above = np.maximum(np.minimum(pressure, self.cap) - self.threshold, floor)
        wears = ((pressure >= self.threshold) | (self.threshold == 0)) & (pressure <= self.cap)
        return wears * self.exponent * above ** (self.exponent - 1)
