"""Layers that give way: the closure delta of a place by the pressure on it, beside the elasticity of the bodies.

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

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fenwear.arrays import Array

LEAST = 1e-12  # of the largest pressure: where a power below 1 has a slope that is not infinite
FIRST, LAST, POINTS = 6.0, -12.0, 6000  # distances over sigma between which F is inverted; how often it is tabulated
STEPS = 4  # of Newton's method that find the distances at even places


class Closure(Protocol):
    """A law of closure at n nodes, whose parameters are numbers or (n,)."""

    @property
    def onset(self) -> float | Array:
        """Pressure up to which it is about linear, beyond which about logarithmic (n,), MPa."""

    def closure(self, pressure: Array) -> Array:
        """Return delta (...), mm, at pressures (...), MPa; zero without pressure."""

    def slope(self, pressure: Array) -> Array:
        """Return its derivative (...), mm/MPa."""


@dataclass(frozen=True)
class PowerClosure:
    """delta = reference (p / pressure)^exponent."""

    reference: float | Array
    pressure: float | Array
    exponent: float

    @property
    def onset(self) -> float | Array:
        """That from which the slope is that of the law, MPa."""
        return LEAST * self.pressure

    def closure(self, pressure: Array) -> Array:
        """Return delta (...), mm."""
        return np.asarray(self.reference * (np.maximum(pressure, 0.0) / self.pressure) ** self.exponent)

    def slope(self, pressure: Array) -> Array:
        """Return its derivative (...), mm/MPa; finite without pressure, too."""
        least = 1e-300 if self.exponent == 1 else LEAST * self.pressure
        floor = np.maximum(LEAST * float(pressure.max(initial=0.0)), least)
        ratio = np.maximum(pressure, floor) / self.pressure
        return np.asarray(self.reference * self.exponent / self.pressure * ratio ** (self.exponent - 1))


@dataclass(frozen=True)
class ExponentialClosure:
    """p = pressure (exp(delta / length) - 1)."""

    length: float | Array
    pressure: float | Array

    @property
    def onset(self) -> float | Array:
        """The law's own, MPa."""
        return self.pressure

    def closure(self, pressure: Array) -> Array:
        """Return delta (...), mm."""
        return np.asarray(self.length * np.log1p(np.maximum(pressure, 0.0) / self.pressure))

    def slope(self, pressure: Array) -> Array:
        """Return its derivative (...), mm/MPa."""
        return np.asarray(self.length / (self.pressure + np.maximum(pressure, 0.0)))


@dataclass(frozen=True)
class RoughClosure:
    """Greenwood and Williamson's law.

    Attributes:
        height: sigma, standard deviation of the heights (n,), mm.
        stiffness: (4/3) E* eta sqrt(R) sigma^(3/2) (n,), MPa.
    """

    height: float | Array
    stiffness: float | Array

    @property
    def onset(self) -> float | Array:
        """That at `FIRST` heights, MPa."""
        return self.stiffness * _inverse().first

    def closure(self, pressure: Array) -> Array:
        """Return delta (...), mm."""
        inverse = _inverse()
        return np.asarray(self.height * (FIRST - inverse.distance(np.log(self._integral(pressure, inverse)))))

    def slope(self, pressure: Array) -> Array:
        """Return its derivative (...), mm/MPa."""
        inverse = _inverse()
        integral = self._integral(pressure, inverse)
        return np.asarray(-self.height * inverse.slope(np.log(integral)) / (integral * self.stiffness))

    def _integral(self, pressure: Array, inverse: _Inverse) -> Array:
        """Return F (...)."""
        return np.asarray(np.maximum(pressure, 0.0) / self.stiffness + inverse.first)


@dataclass(frozen=True)
class CoatedClosure:
    """A law and coatings that give way beside each other, each by what is left of it.

    Attributes:
        law: What else gives way; None for nothing.
        coatings: What is left of each (..., n), mm, and its modulus M, MPa.
    """

    law: Closure | None
    coatings: tuple[tuple[Array, float], ...]

    @property
    def onset(self) -> float | Array:
        """Of the law, or the stiffest modulus, MPa."""
        return max(modulus for _, modulus in self.coatings) if self.law is None else self.law.onset

    def closure(self, pressure: Array) -> Array:
        """Return delta (...), mm."""
        found = np.zeros_like(pressure) if self.law is None else self.law.closure(pressure)
        return sum((left * compressed(pressure, modulus) for left, modulus in self.coatings), found)

    def slope(self, pressure: Array) -> Array:
        """Return its derivative (...), mm/MPa."""
        found = np.zeros_like(pressure) if self.law is None else self.law.slope(pressure)
        parts = (left / modulus * (1 - compressed(pressure, modulus)) for left, modulus in self.coatings)
        return sum(parts, found)


def compressed(pressure: Array, modulus: float) -> Array:
    """Return the share of its thickness by which a coating is compressed (...)."""
    return np.asarray(-np.expm1(-np.maximum(pressure, 0.0) / modulus))


def asperity_integral(distance: NDArray[Any], power: float = 1.5) -> Array:
    """Return the integral of (z - h)^power phi(z) from h = distance on, phi the Gaussian density."""
    from scipy.special import gamma, pbdv

    h = np.asarray(distance, dtype=float)
    return np.asarray(gamma(power + 1) / np.sqrt(2 * np.pi) * np.exp(-(h**2) / 4) * pbdv(-power - 1, h)[0])


class _Inverse:
    """The distance h as a function of ln F(h): Hermite's cubics between values and slopes at even places, of no search.

    A third of a half-cycle would go into places that are searched for.
    """

    def __init__(self) -> None:
        from scipy.interpolate import CubicHermiteSpline

        h = np.linspace(FIRST, LAST, POINTS)
        known = np.log(asperity_integral(h))
        places = np.linspace(known[0], known[-1], POINTS)
        h = np.interp(places, known, h)
        for _ in range(STEPS):
            values, slopes = asperity_integral(h), -1.5 * asperity_integral(h, 0.5)
            h = h - (np.log(values) - places) * values / slopes
        h[0] = FIRST
        values, slopes = asperity_integral(h), -1.5 * asperity_integral(h, 0.5)
        self.first = float(values[0])
        self._begin, self._width = places[0], places[1] - places[0]
        powers = self._width ** np.arange(3.0, -1.0, -1.0)[:, None]
        self._cubics = CubicHermiteSpline(places, h, values / slopes).c * powers

    def distance(self, logarithm: Array) -> Array:
        """Return h (...)."""
        (a, b, c, d), t = self._cubic(logarithm)
        return np.asarray(((a * t + b) * t + c) * t + d)

    def slope(self, logarithm: Array) -> Array:
        """Return its derivative (...)."""
        (a, b, c, _), t = self._cubic(logarithm)
        return np.asarray(((3 * a * t + 2 * b) * t + c) / self._width)

    def _cubic(self, logarithm: Array) -> tuple[Array, Array]:
        """Return the coefficients of the cubics at places (4, ...), and where these are in them (...)."""
        t = (logarithm - self._begin) / self._width
        number = np.fmin(np.fmax(t, 0.0), POINTS - 2.0).astype(np.intp)  # the first for what is no number
        return self._cubics[:, number], t - number


@lru_cache(maxsize=1)
def _inverse() -> _Inverse:
    return _Inverse()
