"""Wear by local slip: depth = beta~ p^b v^a of each node, both bodies; v = abs(slip) over the time of its step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fenwear.arrays import Array
from fenwear.case import Dependence, WearLaw
from fenwear.errors import CaseError, InputError
from fenwear.interface import ContactPair
from fenwear.sliding.friction import ContactConditions, Friction
from fenwear.sliding.wear import coefficient


@dataclass(frozen=True)
class BodyRate:
    """The wear law of a body: beta~ at the nodes (n,), b and a; the pressures below and above which nothing changes."""

    rate: Array
    pressure_exponent: float
    speed_exponent: float
    threshold: float = 0.0
    cap: float = np.inf

    def effective(self, pressure: Array) -> Array:
        """Return what of the pressure (n,) wears, MPa."""
        return np.clip(pressure, self.threshold, self.cap) - self.threshold

    def depth(self, pressure: Array, slid: Array, duration: float) -> Array:
        """Return the depth worn off (n,), mm, by pressure (n,) and slip (n,) in a time."""
        slide = slid if self.speed_exponent == 1 else slid**self.speed_exponent * duration ** (1 - self.speed_exponent)
        return self.rate * self.effective(pressure) ** self.pressure_exponent * slide

    def slope(self, pressure: Array, slid: Array, duration: float) -> Array:
        """Return the derivative of the depth to the pressure (n,), mm/MPa."""
        b = self.pressure_exponent
        slide = slid if self.speed_exponent == 1 else slid**self.speed_exponent * duration ** (1 - self.speed_exponent)
        floor = 1e-9 * max(float(pressure.max(initial=0.0)), 1e-300)
        changes = (pressure >= self.threshold) & (pressure <= self.cap)
        return self.rate * b * np.maximum(self.effective(pressure), floor) ** (b - 1) * slide * changes


@dataclass(frozen=True)
class LocalWear:
    """The wear laws of punch and strip; None where a body does not wear."""

    punch: BodyRate | None
    strip: BodyRate | None

    def depths(self, pressure: Array, slid: Array, duration: float) -> tuple[Array, Array]:
        """Return the depths worn off punch and strip at the contact nodes (n,) each, mm."""
        none = np.zeros_like(pressure)
        return (
            none if self.punch is None else self.punch.depth(pressure, slid, duration),
            none if self.strip is None else self.strip.depth(pressure, slid, duration),
        )


def local_wear(
    laws: tuple[WearLaw | None, WearLaw | None], friction: Friction, pair: ContactPair, mean_pressure: float
) -> LocalWear:
    """Return the wear by local slip of a case's laws.

    Raises:
        CaseError: a coefficient depends on anything.
    """
    n = len(pair.weights)
    state = ContactConditions.at(np.full(n, mean_pressure))
    found = []
    for law, key in zip(laws, ("wear.punch", "wear.strip"), strict=True):
        if law is not None and isinstance(law.coefficient, Dependence):
            raise CaseError(InputError(f"{key}.coefficient", "expected a constant with contact.law = 'coulomb'"))
        found.append(
            None
            if law is None
            else BodyRate(
                coefficient(law, friction, state, key),
                law.pressure_exponent,
                law.speed_exponent,
                law.pressure_threshold,
                np.inf if law.pressure_cap is None else law.pressure_cap,
            )
        )
    return LocalWear(found[0], found[1])
