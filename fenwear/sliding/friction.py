"""Friction: the tractions of sliding over the pressure, in the plane and out of it.

The traction on the punch is p (e_n + d mu e_1 - mu_d e_2), equation (5). Sliding along the contact
e_1 is e_x and e_2 points out of the plane; sliding out of the plane e_1 is e_y and e_2 is e_x.
Displacements out of the plane are those of a generalised plane state: they do not change along e_y,
carry the shear alone and leave the gap as it is, so that the contact sees the traction along e_x only.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fenwear.arrays import Array
from fenwear.case import Contact, Dependence


@dataclass(frozen=True)
class ContactConditions:
    """What coefficients may depend on, at the interface nodes in one phase.

    Attributes:
        pressure: p (n,), MPa.
        speed: Mean sliding speed v, mm/s.
        temperatures: Of the punch's and the strip's surface (n,) each, K; the initial ones without heat.
    """

    pressure: Array
    speed: float
    temperatures: tuple[Array, Array]

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of nodal values."""
        return self.pressure.shape

    def of(self, body: Literal["punch", "strip", "mean"]) -> Mapping[str, Array]:
        """Return T, p, v with the temperature of a body's surface, or the mean of both."""
        punch, strip = self.temperatures
        temperature = {"punch": punch, "strip": strip, "mean": (punch + strip) / 2}[body]
        return {"T": temperature, "p": self.pressure, "v": np.asarray(self.speed)}


@dataclass(frozen=True)
class Friction:
    """Coulomb friction of known direction.

    Attributes:
        contact: mu and mu_d.
        axis: Of the sliding: "x" along the contact, "y" out of the plane.
    """

    contact: Contact
    axis: Literal["x", "y"] = "x"

    @property
    def constant(self) -> bool:
        """Whether mu does not depend on temperature, pressure or speed."""
        return not isinstance(self.contact.friction, Dependence)

    def values(self, conditions: ContactConditions) -> Array:
        """Return mu at the nodes (n,).

        Raises:
            CaseError: it is negative or not finite.
        """
        mu = self.contact.friction
        if isinstance(mu, Dependence):
            return mu.values(conditions.of("mean"), conditions.shape, 1.0, "contact.friction")
        return np.full(conditions.shape, float(mu))

    def slip(self, direction: int, mu: Array) -> Array:
        """Return the traction on the punch along +x over the pressure (n,)."""
        if self.axis == "x":
            return direction * mu
        return np.full_like(mu, -self.contact.transverse_friction)

    def cross(self, direction: int, mu: Array) -> Array:
        """Return the traction on the punch along +y over the pressure (n,)."""
        if self.axis == "y":
            return direction * mu
        return np.full_like(mu, -self.contact.transverse_friction)
