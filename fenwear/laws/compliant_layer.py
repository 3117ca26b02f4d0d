"""Compliant layers: the closure delta of a place by the pressure on it, beside the elasticity of the bodies.

    power          delta = r (p / p_1)^m
    exponential    p = p_1 (exp(delta / l) - 1)
    coating        delta = c (1 - exp(-p / M)), c what is left of it
    rough          p = (4/3) E* eta sqrt(R) sigma^(3/2) F(d / sigma),  F(h) = integral from h of (z - h)^(3/2) phi(z) dz

That of a coating is Hencky's: its strain is the logarithm of its height, ln(h / c) = -p / M, so that no pressure takes
all of it. The last is the law of Greenwood and Williamson (Proc. R. Soc. Lond. A 295, 1966, 300): eta round asperities
of radius R on an area, of Gaussian heights z sigma with density phi; d the distance of the mean planes. With the
parabolic cylinder function D (Abramowitz and Stegun, 19.5.3) F(h) = Gamma(5/2) / sqrt(2 pi) exp(-h^2/4) D_(-5/2)(h),
and F' = -(3/2) times the same integral of (z - h)^(1/2). The closure counts from where the mean planes are `FIRST`
sigma apart, beyond which less than 1e-9 of the asperities touch.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fenwear.common.arrays import Array

LEAST = 1e-12  # of the largest pressure: where a power below 1 has a slope that is not infinite
FIRST, LAST, POINTS = 6.0, -12.0, 6000  # distances over sigma between which F is inverted; how often it is tabulated
NONE = np.zeros(())
NUDGE, ROUNDS = 1e-6, 20  # of the largest pressure, for differences; iterations of a pressure by that of asperities


class Closure(Protocol):
    """A law of closure at n nodes, whose parameters are numbers or (n,)."""

    def closure(self, pressure: Array) -> Array:
        """Return delta (...), mm, at pressures (...), MPa; zero without pressure."""

    def slope(self, pressure: Array) -> Array:
        """Return its derivative (...), mm/MPa."""


class Law(Closure, Protocol):
    """Closure whose pressure follows from the nearness.

    Surfaces are near each other by what is closed, or less than not at all by what is open, in a measure in which they
    come nearer evenly, whether they touch or not.
    """

    def nearness(self, pressure: Array, gap: Array) -> Array:
        """Return the nearness of surfaces (n,) that press on each other or are apart by a gap, mm; without a unit."""

    def pressure_of(self, nearness: Array) -> Array:
        """Return the pressure by it (n,), MPa."""


@dataclass(frozen=True)
class PowerClosure:
    """delta = reference (p / pressure)^exponent."""

    reference: float | Array
    pressure: float | Array
    exponent: float

    def closure(self, pressure: Array) -> Array:
        """Return delta (...), mm."""
        return np.asarray(self.reference * (np.maximum(pressure, NONE) / self.pressure) ** self.exponent)

    def slope(self, pressure: Array) -> Array:
        """Return its derivative (...), mm/MPa; finite without pressure, too."""
        least = 1e-300 if self.exponent == 1 else LEAST * self.pressure
        floor = np.maximum(LEAST * float(pressure.max(initial=0.0)), least)
        ratio = np.maximum(pressure, floor) / self.pressure
        return np.asarray(self.reference * self.exponent / self.pressure * ratio ** (self.exponent - 1))

    def nearness(self, pressure: Array, gap: Array) -> Array:
        """Return the closure less the gap, over the reference (n,)."""
        return np.asarray((pressure / self.pressure) ** self.exponent - gap / self.reference)

    def pressure_of(self, nearness: Array) -> Array:
        """Return the pressure by it (n,), MPa."""
        return np.asarray(self.pressure * np.maximum(nearness, NONE) ** (1 / self.exponent))


@dataclass(frozen=True)
class ExponentialClosure:
    """p = pressure (exp(delta / length) - 1)."""

    length: float | Array
    pressure: float | Array

    def closure(self, pressure: Array) -> Array:
        """Return delta (...), mm."""
        return np.asarray(self.length * np.log1p(np.maximum(pressure, NONE) / self.pressure))

    def slope(self, pressure: Array) -> Array:
        """Return its derivative (...), mm/MPa."""
        return np.asarray(self.length / (self.pressure + np.maximum(pressure, NONE)))

    def nearness(self, pressure: Array, gap: Array) -> Array:
        """Return the closure less the gap, over the length (n,)."""
        return np.asarray(np.log1p(pressure / self.pressure) - gap / self.length)

    def pressure_of(self, nearness: Array) -> Array:
        """Return the pressure by it (n,), MPa."""
        return np.asarray(self.pressure * np.expm1(np.maximum(nearness, NONE)))


@dataclass(frozen=True)
class SharedClosure:
    """The closure of asperities that carry a share X of the pressure, the fluid between them the rest.

    Attributes:
        law: Of the asperities.
        share: X by the pressure (..., n) and the variables.
        variables: Place, speed and temperature by their names, as laws have them: of all phases (m, n), of one or of
            all alike (n,).
    """

    law: Law
    share: Callable[[Array, Mapping[str, Array]], Array]
    variables: Mapping[str, Array]

    def at(self, phases: int | Sequence[int]) -> SharedClosure:
        """Return the closure in phases of the motion."""
        variables = {name: value[phases] if value.ndim > 1 else value for name, value in self.variables.items()}
        return replace(self, variables=variables)

    def carried(self, pressure: Array) -> Array:
        """Return the pressure of the asperities (...), MPa."""
        return np.asarray(self.share(pressure, self.variables) * pressure)

    def closure(self, pressure: Array) -> Array:
        """Return delta (...), mm."""
        return self.law.closure(self.carried(pressure))

    def slope(self, pressure: Array) -> Array:
        """Return its derivative (...), mm/MPa."""
        nudge = NUDGE * max(float(pressure.max(initial=0.0)), 1e-300)
        carried = self.carried(pressure)
        return np.asarray(self.law.slope(carried) * (self.carried(pressure + nudge) - carried) / nudge)

    def nearness(self, pressure: Array, gap: Array) -> Array:
        """Return the nearness of the asperities (n,)."""
        return self.law.nearness(self.carried(pressure), gap)

    def pressure_of(self, nearness: Array) -> Array:
        """Return the pressure by it (n,), MPa, nearly where the share depends on the pressure."""
        carried = self.law.pressure_of(nearness)
        pressure = carried
        for _ in range(ROUNDS):
            pressure = carried / np.maximum(self.share(pressure, self.variables), LEAST)
        return pressure


@dataclass(frozen=True)
class RoughClosure:
    """Greenwood and Williamson's law.

    Attributes:
        height: sigma, standard deviation of the heights (n,), mm.
        stiffness: (4/3) E* eta sqrt(R) sigma^(3/2) (n,), MPa.
    """

    height: float | Array
    stiffness: float | Array

    def closure(self, pressure: Array) -> Array:
        """Return delta (...), mm."""
        return np.asarray(self.height * _asperities().closure(np.log(self._integral(pressure))))

    def slope(self, pressure: Array) -> Array:
        """Return its derivative (...), mm/MPa."""
        integral = self._integral(pressure)
        return np.asarray(self.height * _asperities().slope(np.log(integral)) / (integral * self.stiffness))

    def nearness(self, pressure: Array, gap: Array) -> Array:
        """Return the closure less the gap, over the standard deviation of the heights (n,)."""
        return np.asarray((self.closure(pressure) - gap) / self.height)

    def pressure_of(self, nearness: Array) -> Array:
        """Return the pressure by it (n,), MPa."""
        known = _asperities()
        pressure = self.stiffness * (np.exp(known.logarithm(np.maximum(nearness, NONE))) - known.first)
        return np.maximum(pressure, NONE)

    def _integral(self, pressure: Array) -> Array:
        """Return F (...)."""
        return np.asarray(np.maximum(pressure, NONE) / self.stiffness + _asperities().first)


class Rigid:
    """No compliance."""

    def closure(self, pressure: Array) -> Array:
        """Return delta (...), mm: none."""
        return np.zeros_like(pressure)

    def slope(self, pressure: Array) -> Array:
        """Return its derivative (...), mm/MPa: none."""
        return np.zeros_like(pressure)


RIGID = Rigid()


@dataclass(frozen=True)
class CoatedClosure:
    """A law and coatings in series, each coating by its remaining thickness.

    Attributes:
        law: Further compliance.
        coatings: Remaining thickness of each (..., n), mm, and its modulus M, MPa.
    """

    law: Closure
    coatings: tuple[tuple[Array, float], ...]

    def closure(self, pressure: Array) -> Array:
        """Return delta (...), mm."""
        closure = self.law.closure(pressure)
        return sum((left * compressed(pressure, modulus) for left, modulus in self.coatings), closure)

    def slope(self, pressure: Array) -> Array:
        """Return its derivative (...), mm/MPa."""
        slope = self.law.slope(pressure)
        parts = (left / modulus * (1 - compressed(pressure, modulus)) for left, modulus in self.coatings)
        return sum(parts, slope)


def compressed(pressure: Array, modulus: float) -> Array:
    """Return the share of its thickness by which a coating is compressed (...)."""
    return np.asarray(-np.expm1(-np.maximum(pressure, NONE) / modulus))


def asperity_integral(distance: NDArray[Any], power: float = 1.5) -> Array:
    """Return the integral of (z - h)^power phi(z) from h = distance on, phi the Gaussian density."""
    from scipy.special import gamma, pbdv

    h = np.asarray(distance, dtype=float)
    return np.asarray(gamma(power + 1) / np.sqrt(2 * np.pi) * np.exp(-(h**2) / 4) * pbdv(-power - 1, h)[0])


class _Asperities:
    """ln F by the closure FIRST - h, and the closure by ln F."""

    def __init__(self) -> None:
        from scipy.interpolate import CubicHermiteSpline

        h = np.linspace(FIRST, LAST, POINTS)
        values = asperity_integral(h)
        known, slopes = np.log(values), 1.5 * asperity_integral(h, 0.5) / values
        self.first = np.array(values[0])
        self.logarithm = CubicHermiteSpline(FIRST - h, known, slopes)
        self.closure = CubicHermiteSpline(known, FIRST - h, 1 / slopes)
        self.slope = self.closure.derivative()


@lru_cache(maxsize=1)
def _asperities() -> _Asperities:
    return _Asperities()
