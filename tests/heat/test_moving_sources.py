"""Kernels of heat on a half-space against integrals of their own, one after the other, and closed forms."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.integrate import dblquad, quad
from scipy.special import erf

from fenwear.common.arrays import Array
from fenwear.heat.moving_sources import Instants, Periodic, cell_integrals, history_kernel

STEEL, DIFFUSIVITY = 46.0, 12.8  # N/(s K), mm²/s


def _by_quadrature(x: float, y: float, sides: tuple[float, float], decay: complex, drift: float) -> complex:
    def part(real: bool) -> float:
        def integrand(b: float, a: float) -> float:
            r = np.hypot(a, b)
            value = np.exp(drift * a - decay * r) / (2 * np.pi * r)
            return float(value.real if real else value.imag)

        h, k = sides[0] / 2, sides[1] / 2
        rows = [(x - h, 0.0), (0.0, x + h)] if x == 0 else [(x - h, x + h)]
        columns = [(y - k, 0.0), (0.0, y + k)] if y == 0 else [(y - k, y + k)]
        return sum(dblquad(integrand, *a, *b, epsabs=1e-10, epsrel=1e-6)[0] for a in rows for b in columns)

    return part(True) + 1j * part(False)


@pytest.mark.parametrize(
    ("decay", "drift"), [(0.0, 0.0), (3.0, 3.0), (40.0, 40.0), (np.sqrt(50j), 0.0), (np.sqrt(5e4j), 0.0)]
)
def test_cells_near_and_far(decay: complex, drift: float) -> None:
    """At rest, of material that passes slowly and fast, of heat that turns slowly and fast."""
    sides = (0.02, 0.03)
    found = cell_integrals((9, 7), sides, decay, (drift, 0.0))
    largest = abs(found[8, 6])
    for i, j in ((0, 0), (1, 0), (-1, 1), (3, 0), (7, 5), (-6, 2)):
        exact = _by_quadrature(sides[0] * i, sides[1] * j, sides, decay, drift)
        assert abs(found[8 + i, 6 + j] - exact) < 2e-6 * largest


def _square(half: float, nodes: int) -> tuple[tuple[float, float], tuple[int, int], Array]:
    h = 2 * half / nodes
    return (h, h), (nodes, nodes), h * (np.arange(nodes) - (nodes - 1) / 2)


def test_square_at_rest() -> None:
    """Even heat on a square: (4 l / pi K) ln(1 + sqrt 2) q in its middle, l half a side."""
    sides, shape, _ = _square(0.1, 65)
    rise = Instants(STEEL, cell_integrals(shape, sides)[None]).apply(np.ones((1, *shape)))[0]
    assert rise[32, 32] == pytest.approx(4 * 0.1 / (np.pi * STEEL) * np.log(1 + np.sqrt(2)), rel=1e-12)


@pytest.mark.parametrize("peclet", [0.1, 1.0, 10.0, 50.0])
def test_moving_square_of_jaeger(peclet: float) -> None:
    """Even heat on a square that material passes at v, slowly and fast by v a / 2 kappa: pointwise, from instants."""
    a = 0.1
    v = 2 * DIFFUSIVITY * peclet / a
    sides, shape, x = _square(a, 33)
    drift = v / (2 * DIFFUSIVITY)
    kernel = cell_integrals(shape, sides, drift, (drift, 0.0))
    rise = Instants(STEEL, kernel[None]).apply(np.ones((1, *shape)))[0]

    def exact(x: float, y: float) -> float:
        def instant(u: float) -> float:  # s = u^2
            w = 2 * np.sqrt(DIFFUSIVITY) * u
            ex = erf((x + a - v * u * u) / w) - erf((x - a - v * u * u) / w)
            return float(ex * (erf((y + a) / w) - erf((y - a) / w)) / 4)

        ends = [0.0, *np.geomspace(1e-4, 60, 60) * a / np.sqrt(DIFFUSIVITY)]
        whole = sum(quad(instant, *both)[0] for both in itertools.pairwise(ends))
        return 2 * np.sqrt(DIFFUSIVITY / np.pi) / STEEL * whole

    for i, j in ((16, 16), (0, 16), (32, 16), (32, 0), (24, 8), (4, 30)):
        assert rise[i, j] == pytest.approx(exact(x[i], x[j]), abs=1e-9 * rise.max())


def _disc(a: float, nodes: int, reach: float) -> tuple[tuple[float, float], tuple[int, int], Array]:
    """Return a grid over so many radii about the middle of a disc, and the share of each cell in it."""
    h = 2 * reach * a / nodes
    fine = 16
    at = h * (np.arange(nodes * fine) - (nodes * fine - 1) / 2) / fine
    inside = (at[:, None] ** 2 + at**2 < a * a).reshape(nodes, fine, nodes, fine)
    return (h, h), (nodes, nodes), inside.mean(axis=(1, 3))


def test_heat_that_turns() -> None:
    """Heat cos(omega t) on a disc: amplitude and phase of (1 - exp(-lambda a)) / (K lambda) in its middle.

    On a wide one those of the plane: 1 / sqrt(rho c K omega), an eighth of a turn later (Carslaw and Jaeger, 2.6).
    """
    a, steps = 0.1, 16
    for period, tolerance in ((0.1, 1e-3), (2e-5, 1e-3)):
        sides, shape, disc = _disc(a, 65, 1.05)
        turns = 2 * np.pi * (np.arange(steps) + 0.5) / steps
        body = Periodic(STEEL, DIFFUSIVITY, period, sides, shape, np.zeros((steps, 2)))
        rise = body.apply(np.cos(turns)[:, None, None] * disc)[:, 32, 32]
        found = 2 * (rise @ np.exp(-1j * turns)) / steps
        decay = np.sqrt(2j * np.pi / period / DIFFUSIVITY)
        assert found == pytest.approx((1 - np.exp(-decay * a)) / (STEEL * decay), rel=tolerance)
    assert np.angle(found) == pytest.approx(-np.pi / 4, abs=2e-3)
    assert abs(found) == pytest.approx(np.sqrt(DIFFUSIVITY * period / 2 / np.pi) / STEEL, rel=2e-3)


def test_heat_of_hertz() -> None:
    """The mean: sqrt(1 - r^2 / a^2) makes pi (2 a^2 - r^2) / (8 a K), as pressures of Hertz sink in (Boussinesq).

    In the middle 3 Q / (8 a K) by the power Q; the error falls with the grid.
    """
    a, errors = 0.1, []
    for nodes in (17, 33, 65):
        h = 2 * a / nodes
        x = h * (np.arange(nodes) - (nodes - 1) / 2)
        r = np.hypot(x[:, None], x)
        heat = np.sqrt(np.maximum(1 - (r / a) ** 2, 0.0))
        rise = Instants(STEEL, cell_integrals(heat.shape, (h, h))[None]).apply(heat[None])[0]
        exact = np.pi * (2 * a**2 - r**2) / (8 * a * STEEL)
        errors.append(float(np.abs(rise - exact)[r < 0.9 * a].max() / exact.max()))
    assert errors[1] < 0.5 * errors[0]
    assert errors[2] < 0.5 * errors[1]
    assert errors[2] < 2e-3


@pytest.mark.parametrize(("period", "stroke"), [(0.1, 0.0), (0.1, 0.15), (0.01, 0.4)])
def test_to_and_fro_by_harmonics_and_by_instants(period: float, stroke: float) -> None:
    """A source that goes to and fro over the body: harmonics of the cycle, and instants of all that was before.

    They differ by how heat lies on cells between nodes, which falls with the grid.
    """
    steps, width, omega = 96, 0.06, 2 * np.pi / period
    times = period * (np.arange(steps) + 0.5) / steps

    def place(t: Array) -> Array:
        return np.stack([stroke / 2 * np.sin(omega * t), 0 * t], axis=1)

    def heat(t: Array) -> Array:
        return 1.0 + 0.5 * np.cos(omega * t)

    errors = []
    for fine in (1, 2):
        shape, sides = (8 * fine + 1, 8 * fine + 1), (0.03 / fine, 0.03 / fine)
        x = sides[0] * (np.arange(shape[0]) - 4 * fine)
        spot = np.exp(-(x[:, None] ** 2 + x**2) / width**2 * 2)
        body = Periodic(STEEL, DIFFUSIVITY, period, sides, shape, place(times))
        rise = body.apply(heat(times)[:, None, None] * spot)
        errors.append(0.0)
        for n in (5, 40, 71):
            now = times[n : n + 1]
            kernel = history_kernel(
                shape,
                sides,
                DIFFUSIVITY,
                period,
                lambda s, now=now: (place(now - s) - place(now), heat(now - s) / heat(now)),
                omega * stroke / 2,
            )
            other = Instants(STEEL, kernel[None]).apply(heat(now)[:, None, None] * spot)[0]
            errors[-1] = max(errors[-1], float(np.abs(rise[n] - other).max() / rise.max()))
    assert errors[1] < 1e-3
    assert errors[1] < max(0.5 * errors[0], 1e-4)
