"""How friction heat is shared where two bodies touch, node by node and at every instant.

    q_1 + q_2 = Q,    kappa Q - q_1 = h_c (theta_1 - theta_2),    theta_1 = theta_2 where h_c has no end,

theta_i = base_i + b_i P_i + T_i q_i by the half-spaces of `fenwear.flash.response` and what the finite bodies add to
them, in proportion to the mean power P_i that enters each. So

    (T_1 + T_2 + (b_1 + b_2) P + 1 / h_c) q_1 = base_2 - base_1 + T_2 Q + b_2 P Q + kappa Q / h_c

at the nodes in contact; elsewhere nothing enters. GMRES solves it, with the inverse of the symbols of both bodies at
rest before it, (K_1 and K_2) sqrt(k^2 + i n omega / kappa).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.fft

from fenwear.arrays import Array, Mask
from fenwear.contact.krylov import flexible
from fenwear.errors import ConvergenceError
from fenwear.flash.response import Response

ACCURACY, ENOUGH = 1e-9, 1e-6  # residual over the right-hand side: aimed at, and taken
RESTART, RESTARTS = 40, 5


@dataclass(frozen=True)
class Bulk:
    """What a finite body adds at the contact to the half-space that it is.

    Attributes:
        base: Its temperature there without friction, over the surroundings, K.
        per_power: Rise for a unit of mean power into it, K/mW.
    """

    base: float = 0.0
    per_power: float = 0.0


NO_BULK = Bulk()


@dataclass(frozen=True)
class HeatedSide:
    """One of the bodies.

    Attributes:
        response: The half-space.
        conductivity: K, N/(s K).
        diffusivity: kappa, mm²/s.
        bulk: Of the finite body.
    """

    response: Response
    conductivity: float
    diffusivity: float
    bulk: Bulk = NO_BULK

    def rise(self, heat: Array, cell: float) -> Array:
        """Return the temperatures over the surroundings (t, m, n), K, of heat into it (t, m, n), mW/mm²."""
        return self.response.apply(heat) + self.bulk.base + self.bulk.per_power * mean_power(heat, cell)


def mean_power(heat: Array, cell: float) -> float:
    """Return the mean over instants of what enters, mW."""
    return cell * float(heat.sum()) / len(heat)


def shared(
    first: HeatedSide,
    second: HeatedSide,
    heat: Array,
    touching: Mask,
    sides: tuple[float, float],
    period: float,
    *,
    resistance: Array | None = None,
    given: float = 0.5,
) -> Array:
    """Return what of the heat of friction enters the first body (t, m, n), mW/mm².

    Args:
        first, second: The bodies.
        heat: Q (t, m, n), mW/mm².
        touching: Where they touch (t, m, n).
        sides: Of a cell, mm.
        period: Of the cycle, s; infinite where each instant is for itself.
        resistance: 1 / h_c (t, m, n), mm s K/N; None for none.
        given: kappa, the first body's share of what enters by itself.

    Raises:
        ConvergenceError: it is not found.
    """
    cell = sides[0] * sides[1]
    both = first.bulk.per_power + second.bulk.per_power
    precondition = _Inverse(first, second, touching, sides, period, resistance)

    def inside(values: Array) -> Array:
        return np.where(touching, values, 0.0).ravel()

    def multiply(x: Array) -> Array:
        own = x.reshape(heat.shape)
        found = first.response.apply(own) + second.response.apply(own) + both * mean_power(own, cell)
        return inside(found if resistance is None else found + resistance * own)

    right = second.rise(heat, cell) - first.bulk.base
    if resistance is not None:
        right = right + given * resistance * heat
    x, rest, *_ = flexible(
        multiply, lambda x: inside(precondition(x.reshape(heat.shape))), inside(right), ACCURACY, RESTART, RESTARTS
    )
    if not rest <= ENOUGH:
        raise ConvergenceError(f"the share of the friction heat was not found: {rest:.2g} of it is left")
    return x.reshape(heat.shape)


class _Inverse:
    """The inverse of both bodies at rest and of the least resistance between them, on a grid without rims.

    Where the resistance R is larger what a node answers to itself, s, falls as (s + R_0) / (s + R).

    Args:
        first, second: The bodies.
        touching: Where they touch (t, m, n).
        sides: Of a cell, mm.
        period: s.
        resistance: (t, m, n), mm s K/N; None for none.
    """

    def __init__(
        self,
        first: HeatedSide,
        second: HeatedSide,
        touching: Mask,
        sides: tuple[float, float],
        period: float,
        resistance: Array | None,
    ) -> None:
        shape = self.shape = touching.shape
        x, y = scipy.fft.fftfreq(shape[1], sides[0]), scipy.fft.rfftfreq(shape[2], sides[1])
        square = (2 * np.pi) ** 2 * (x[:, None] ** 2 + y**2)
        square[0, 0] = square[square > 0].min() / 4
        rate = 2 * np.pi * scipy.fft.fftfreq(shape[0], 1 / shape[0]) / period
        ease = sum(
            1 / (side.conductivity * np.sqrt(square + 1j * rate[:, None, None] / side.diffusivity))
            for side in (first, second)
        )
        self.share: Array | float = 1.0
        if resistance is not None:
            least, itself = float(resistance[touching].min()), float(np.mean(ease.real))
            ease, self.share = ease + least, np.sqrt((itself + least) / (itself + resistance))
        self.symbol = 1 / ease

    def __call__(self, values: Array) -> Array:
        waves = scipy.fft.fft(scipy.fft.rfftn(self.share * values, axes=(1, 2)), axis=0)
        waves = scipy.fft.ifft(waves * self.symbol, axis=0)
        return np.asarray(self.share * scipy.fft.irfftn(waves, self.shape[1:], axes=(1, 2)))
