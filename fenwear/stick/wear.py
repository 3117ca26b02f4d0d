"""Wear by local slip: depth = beta~ p^b v^a of each node, both bodies; v = abs(slip) over the time of its step."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fenwear.arrays import Array
from fenwear.case import Dependence, WearLaw
from fenwear.errors import CaseError, InputError
from fenwear.interface import ContactPair
from fenwear.sliding.friction import ContactConditions, Friction
from fenwear.sliding.pressure_law import PressureLaw
from fenwear.sliding.wear import coefficient


@dataclass(frozen=True)
class BodyRate:
    """The wear law of a body: beta~ at the nodes (n,), what of the pressure wears, and a."""

    rate: Array
    law: PressureLaw = field(default_factory=PressureLaw)
    speed_exponent: float = 1.0

    def depth(self, pressure: Array, slid: Array, duration: float) -> Array:
        """Return the depth worn off (n,), mm, by pressure (n,) and slip (n,) in a time."""
        return self.rate * self.law.value(np.maximum(pressure, 0.0)) * self._slide(slid, duration)

    def slope(self, pressure: Array, slid: Array, duration: float) -> Array:
        """Return the derivative of the depth to the pressure (n,), mm/MPa."""
        return self.rate * self.law.slope(np.maximum(pressure, 0.0)) * self._slide(slid, duration) * (pressure >= 0)

    def _slide(self, slid: Array, duration: float) -> Array:
        a = self.speed_exponent
        return slid if a == 1 else slid**a * duration ** (1 - a)


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
            else BodyRate(coefficient(law, friction, state, key), PressureLaw.of(law), law.speed_exponent)
        )
    return LocalWear(found[0], found[1])
