"""Temperatures of the contact by heat that enters a half-space, over twice the grid and in harmonics of the time.

A place of the punch is always the same of its material. A strip that is X(t) away is heated at x - X(t) of its own:

    T_n(k) = q_n(k) / (K sqrt(k^2 + i n omega / kappa)),    the strip's q times exp(i k . X), its T times exp(-i k . X)

with the kernels of `fenwear.heat.moving_sources` in place of their symbols.

Temperatures of a half-space's surface by even heat over a cell of a regular grid, at all distances of two nodes.

With K the conductivity and kappa the diffusivity, heat q that enters the surface of a half-space makes there

    T = (1 / K) integral of q exp(P . x - L r) / (2 pi r)

x from the source to the place and r its size: at rest and for ever L = 0, P = 0; material that passes at v has
P = v / (2 kappa), L = |P| (D. Rosenthal, Trans. ASME 68, 1946, 849; J. C. Jaeger, Proc. R. Soc. NSW 76, 1942, 203);
heat that varies as exp(i w t) has L = sqrt(i w / kappa) (H. S. Carslaw, J. C. Jaeger, Conduction of Heat in Solids,
2nd ed., 1959, section 10.4). In the Fourier plane they are 1 / sqrt(k^2), 1 / sqrt(k^2 + i k . v / kappa) and
1 / sqrt(k^2 + i w / kappa): here they are integrated over cells in real space, so that products over twice the grid
have no images.

Heat of a source that has moved in any way, x(s) a time s ago from where it is now, is added up from instants
(Carslaw and Jaeger, section 10.7), over a cell a product of differences of error functions:

    T = (1 / rho c) integral of w(s) E_x(s) E_y(s) / sqrt(pi kappa s) ds,
    E_x = (erf((x + x(s) + h / 2) / sqrt(4 kappa s)) - erf((x + x(s) - h / 2) / sqrt(4 kappa s))) / 2
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
import scipy.fft
from numpy.typing import NDArray
from scipy.special import erf

from fenwear.common.arrays import Array

NEAR = 2  # cells from the source, up to which many points are taken in each
FINE, ROUGH = (
    12,
    4,
)  # points along each side of a near cell and of one beyond, where the heated layer is thicker than it
MORE, MOST = 0.75, 32  # further points for each decay over a cell, and how many at most
ROUND = 24  # points of an angle of an eighth of a turn

Complex = NDArray[np.complex128]


def cell_integrals(
    shape: tuple[int, ...], sides: tuple[float, ...], decay: complex = 0.0, drift: tuple[float, ...] = (0.0, 0.0)
) -> NDArray[Any]:
    """Return integrals of exp(P . x - L r) / (2 pi r) over cells at all distances (2 m - 1, 2 n - 1), mm.

    Args:
        shape: Nodes (m, n).
        sides: Of a cell, mm.
        decay: L, 1/mm.
        drift: P, 1/mm; where material passes along +x it is positive there, and heat is carried to +x.
    """
    moves, kind = any(drift), np.result_type(type(decay), np.float64)
    low = tuple(1 - count for count in shape) if moves else (0, 0)
    places: list[Array] = [
        np.asarray(side * np.arange(first, count)) for side, first, count in zip(sides, low, shape, strict=True)
    ]
    integrals = np.zeros(tuple(len(axis_places) for axis_places in places), dtype=kind)
    extra_points = int(MORE * min(abs(decay) * max(sides), MOST / MORE))
    _add(integrals, places, sides, decay, drift, ROUGH + extra_points)
    near = tuple(slice(max(-first - NEAR, 0), NEAR + 1 - first) for first in low)
    inner, close = integrals[near], [axis_places[part] for axis_places, part in zip(places, near, strict=True)]
    inner[:] = 0.0
    _add(inner, close, sides, decay, drift, FINE + extra_points)
    integrals[tuple(-first for first in low)] = _cell_about_source(sides, decay, drift)
    if not moves:
        for axis in range(2):
            integrals = np.concatenate(
                [np.flip(integrals, axis).take(range(integrals.shape[axis] - 1), axis), integrals], axis
            )
    return integrals / (2 * np.pi)


def _add(
    integrals: NDArray[Any],
    places: list[Array],
    sides: tuple[float, ...],
    decay: complex,
    drift: tuple[float, ...],
    n: int,
) -> None:
    """Add integrals by Gauss' rule of n by n points."""
    points, weights = np.polynomial.legendre.leggauss(n)
    for a, wa in zip(points, weights, strict=True):
        x = places[0][:, None] + sides[0] / 2 * a
        for b, wb in zip(points, weights, strict=True):
            y = places[1] + sides[1] / 2 * b
            r = np.hypot(x, y)
            with np.errstate(divide="ignore", invalid="ignore"):  # at the source itself, which is found by angles
                integrals += wa * wb * sides[0] * sides[1] / 4 * np.exp(drift[0] * x + drift[1] * y - decay * r) / r


def _cell_about_source(sides: tuple[float, ...], decay: complex, drift: tuple[float, ...]) -> Any:
    """Return the integral over the cell about the source: along each ray in closed form, then over the angle."""
    points, weights = np.polynomial.legendre.leggauss(ROUND)
    corner = np.arctan2(sides[1], sides[0])
    total: Any = 0.0
    for first, last, axis, sign in (
        (-corner, corner, 0, 1),
        (corner, np.pi - corner, 1, 1),
        (np.pi - corner, np.pi + corner, 0, -1),
        (np.pi + corner, 2 * np.pi - corner, 1, -1),
    ):
        middle = (first + last) / 2
        for low, high in ((first, middle), (middle, last)):
            angle = (low + high) / 2 + (high - low) / 2 * points
            ray = np.array([np.cos(angle), np.sin(angle)])
            reach = sign * sides[axis] / 2 / ray[axis]
            rate = decay - drift[0] * ray[0] - drift[1] * ray[1]
            with np.errstate(divide="ignore", invalid="ignore"):
                along = np.where(np.abs(rate * reach) > 1e-12, -np.expm1(-rate * reach) / rate, reach)
            total += (high - low) / 2 * (weights @ along)
    return total


PER_WIDTH, GROWTH, POINTS = 0.5, 4.0, 4  # of panels of the time: of what heat has spread, of the time, and their points
PER_PERIOD = 48  # panels of a period at least
PERIODS = 16  # after which a motion to and fro is where it is on average


def history_kernel(
    shape: tuple[int, int],
    sides: tuple[float, float],
    diffusivity: float,
    period: float,
    past: Callable[[Array], tuple[Array, Array]],
    fastest: float,
) -> Array:
    """Return the kernel of a source that moves to and fro, with heat w(s) a time s ago (2 m - 1, 2 n - 1), mm.

    It is K times the temperature of an even unit flux now.

    Args:
        shape: Nodes (m, n).
        sides: Of a cell, mm.
        diffusivity: kappa, mm²/s.
        period: Of the motion, s.
        past: For times s (k,) gives x(s), by how much a place now lies from where the source was then (k, 2), mm,
            and w(s) (k,), the heat then over that now.
        fastest: Largest speed, mm/s.
    """
    places: list[Array] = [
        np.asarray(side * np.arange(1 - count, count)) for side, count in zip(sides, shape, strict=True)
    ]
    root, end = float(np.sqrt(diffusivity)), float(np.sqrt(PERIODS * period))
    edges = [0.0]  # of u, s = u^2: heat spreads evenly in it
    while edges[-1] < end:
        u = edges[-1]
        steps = [max(min(sides) / (2 * root), u / GROWTH)]
        if fastest > 0:
            steps.append(PER_WIDTH * root / fastest)
        if u > 0:
            steps.append(period / (2 * PER_PERIOD * u))
        edges.append(min(end, u + min(steps)))
    points, weights = _panels(np.array(edges))
    moved, heat = past(points**2)
    parts = [
        _spread(axis_places, side, moved[:, k], root * points)
        for k, (axis_places, side) in enumerate(zip(places, sides, strict=True))
    ]
    # 1 / (rho c) = kappa / K, and ds / sqrt(pi kappa s) = 2 du / sqrt(pi kappa)
    share = 2 * root / np.sqrt(np.pi) * weights * heat
    kernel = (parts[0] * share) @ parts[1].T
    return np.asarray(kernel + _before(places, sides, root * end, period, past, fastest))


def _panels(edges: Array) -> tuple[Array, Array]:
    """Return points and weights of Gauss' rule on panels."""
    points, weights = np.polynomial.legendre.leggauss(POINTS)
    half = np.diff(edges)[:, None] / 2
    return (edges[:-1, None] + half * (1 + points)).ravel(), (half * weights).ravel()


def _spread(places: Array, side: float, moved: Array, width: Array) -> Array:
    """Return E at places (k,) for sources so far away (t,), heat spread over sqrt(kappa s) (t,), as (k, t)."""
    at = places[:, None] + moved
    return np.asarray((erf((at + side / 2) / (2 * width)) - erf((at - side / 2) / (2 * width))) / 2)


def _before(
    places: list[Array],
    sides: tuple[float, float],
    width: float,
    period: float,
    past: Callable[[Array], tuple[Array, Array]],
    fastest: float,
) -> Array:
    """Return the temperatures by all earlier periods, for heat at each place of the source that is even in time."""
    count = max(PER_PERIOD, int(np.ceil(2 * fastest * period / width)))
    moved, heat = past(period * (np.arange(count) + 0.5) / count)
    temperatures: Array = np.zeros((len(places[0]), len(places[1])))
    for x, y, part in zip(*moved.T, heat, strict=True):
        r = np.maximum(np.hypot(places[0][:, None] + x, places[1] + y), 1e-6 * width)
        temperatures += part / count * erf(r / (2 * width)) / r
    return np.asarray(temperatures * (sides[0] * sides[1] / (2 * np.pi)), dtype=np.float64)


PLANE = (1, 2)


class Response(Protocol):
    """Map from heat (t, m, n), mW/mm², at t instants of a grid to the temperatures there, K."""

    def apply(self, heat: Array) -> Array:
        """Return the temperatures (t, m, n), K."""


@dataclass(frozen=True)
class Instants:
    """Instants that do not feel each other: of what is steady, or by kernels of what was before.

    Attributes:
        conductivity: K, N/(s K).
        kernels: Of each instant, or one of all (t or 1, 2 m - 1, 2 n - 1), mm.
    """

    conductivity: float
    kernels: Array

    @cached_property
    def _size(self) -> tuple[int, ...]:
        return tuple(scipy.fft.next_fast_len(count + 1, real=True) for count in self.kernels.shape[1:])

    @cached_property
    def _waves(self) -> Complex:
        return np.asarray(scipy.fft.rfftn(_wrapped(self.kernels, self._size), axes=PLANE) / self.conductivity)

    def apply(self, heat: Array) -> Array:
        """Return the temperatures (t, m, n), K."""
        waves = scipy.fft.rfftn(heat, self._size, axes=PLANE)
        temperatures = scipy.fft.irfftn(waves * self._waves, self._size, axes=PLANE)
        return np.asarray(temperatures[:, : heat.shape[1], : heat.shape[2]])


@dataclass(frozen=True)
class Periodic:
    """A cycle in t equal steps.

    Attributes:
        conductivity: K, N/(s K).
        diffusivity: kappa, mm²/s.
        period: s.
        sides: Of a cell, mm.
        shape: Nodes (m, n).
        shifts: Where the body is in the middle of each step, from anywhere (t, 2), mm.
    """

    conductivity: float
    diffusivity: float
    period: float
    sides: tuple[float, float]
    shape: tuple[int, int]
    shifts: Array

    @cached_property
    def _reach(self) -> tuple[int, ...]:
        """Nodes of the grid with all of its places."""
        far = np.ceil(np.ptp(self.shifts, axis=0) / self.sides - 1e-9).astype(int)
        return tuple(int(count + extra) for count, extra in zip(self.shape, far, strict=True))

    @cached_property
    def _size(self) -> tuple[int, ...]:
        return tuple(scipy.fft.next_fast_len(2 * count, real=True) for count in self._reach)

    @cached_property
    def _waves(self) -> Complex:
        """Of the kernel of each harmonic (t, ...)."""
        steps = len(self.shifts)
        waves = np.empty((steps, self._size[0], self._size[1] // 2 + 1), dtype=complex)
        for n in range(steps // 2 + 1):
            decay = np.sqrt(1j * 2 * np.pi * n / self.period / self.diffusivity)
            kernel = _wrapped(cell_integrals(self._reach, self.sides, decay if n else 0.0), self._size)
            real, other = (
                scipy.fft.rfftn(np.ascontiguousarray(part), axes=(0, 1)) for part in (kernel.real, kernel.imag)
            )
            waves[n] = real if 2 * n == steps else real + 1j * other
            waves[-n] = real if n == 0 or 2 * n == steps else real - 1j * other
        return np.asarray(waves / self.conductivity, dtype=np.complex128)

    @cached_property
    def _phases(self) -> Complex:
        """Map of heat to its place on the body (t, ...): exp(i k . X), real at the shortest waves."""
        if not np.ptp(self.shifts, axis=0).any():
            return np.ones((1, 1, 1), dtype=complex)
        parts: list[Complex] = []
        for axis, (count, side) in enumerate(zip(self._size, self.sides, strict=True)):
            k = 2 * np.pi * (scipy.fft.fftfreq(count, side) if axis == 0 else scipy.fft.rfftfreq(count, side))
            turn = np.exp(1j * k * self.shifts[:, axis, None])
            if count % 2 == 0:
                turn[:, count // 2] = turn[:, count // 2].real
            parts.append(turn)
        return np.asarray(parts[0][:, :, None] * parts[1][:, None, :])

    def apply(self, heat: Array) -> Array:
        """Return the temperatures (t, m, n), K."""
        waves = scipy.fft.rfftn(heat, self._size, axes=PLANE) * self._phases
        waves = scipy.fft.ifft(scipy.fft.fft(waves, axis=0) * self._waves, axis=0) * self._phases.conj()
        temperatures = scipy.fft.irfftn(waves, self._size, axes=PLANE)
        return np.asarray(temperatures[:, : heat.shape[1], : heat.shape[2]])


def _wrapped(kernel: NDArray[Any], size: tuple[int, ...]) -> NDArray[Any]:
    """Return kernels at all distances (..., 2 m - 1, 2 n - 1) on a grid of this size, distance 0 first."""
    counts = [(count + 1) // 2 for count in kernel.shape[-2:]]
    wrapped = np.zeros((*kernel.shape[:-2], *size), dtype=kernel.dtype)
    rows, columns = (np.arange(1 - count, count) % length for count, length in zip(counts, size, strict=True))
    wrapped[..., rows[:, None], columns] = kernel
    return wrapped
