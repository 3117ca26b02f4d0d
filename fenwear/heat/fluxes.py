"""The heat fluxes of a step at the contact, from what the surfaces' temperatures would be without them.

At a node that conducts, with the friction heat Q,

    q_1 + q_2 = (1 - gamma_d) Q,    kappa (1 - gamma_d) Q - q_1 = h_c (theta_1 - theta_2),

elsewhere q_i = -h (theta_i - theta_a), and theta_i = bare_i + T_i q_i: a dense system. Of few nodes its solution
is made into a matrix, which serves many steps; of many it is eliminated down to q_1 and what open nodes of the
second body lose, n unknowns or a few more in place of 2 n, and kept as a factor.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from fenwear.arrays import Array


@dataclass(frozen=True)
class Exchanged:
    """What the fluxes of a step follow from.

    Attributes:
        responses: T_1 and T_2 (n, n), K mm²/mW.
        conductance: h_c of each node: infinite for perfect contact, NaN where none conducts (n,), mW/(mm² K).
        convection: h, mW/(mm² K).
        partition: kappa.
        debris: gamma_d.
    """

    responses: tuple[Array, Array]
    conductance: Array
    convection: float
    partition: float
    debris: float

    def row_factors(self) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
        """Return where nodes conduct, and the factors of q_1 and of theta_1 - theta_2 in their first row."""
        perfect = np.isinf(self.conductance)
        jump = np.where(perfect, 1.0, np.nan_to_num(self.conductance, nan=0.0, posinf=0.0))
        return ~np.isnan(self.conductance), np.where(perfect, 0.0, 1.0), jump

    def matrix(self) -> Array:
        """Return the matrix of the system for (q_1, q_2) (2 n, 2 n)."""
        t1, t2 = self.responses
        conducts, own, jump = (a[:, None] for a in self.row_factors())
        eye, h = np.eye(len(self.conductance)), self.convection
        first = np.hstack([np.where(conducts, own * eye + jump * t1, eye + h * t1), np.where(conducts, -jump * t2, 0)])
        second = np.hstack([np.where(conducts, eye, 0), np.where(conducts, eye, eye + h * t2)])
        return np.vstack([first, second])


class Fluxes(Protocol):
    """The fluxes (q_1, q_2) of a step, both surfaces concatenated, linear in what they come from."""

    def of(self, bare: Array, heat: Array | None, ambient: float) -> Array:
        """Return them (2 n,) or (2 n, k), mW/mm².

        Args:
            bare: The surfaces' temperatures without flux (2 n,) or (2 n, k), K.
            heat: Of friction (n,) or (n, k), mW/mm²; None for none.
            ambient: Temperature of the surroundings, K.
        """

    def heat_of(self, rows: Array) -> Array:
        """Return rows (r, 2 n) of the fluxes as rows of the friction heat (r, n)."""


@dataclass(frozen=True)
class FluxMap:
    """They as matrices.

    Attributes:
        by_temperature: From the surfaces' temperatures without flux (2 n, 2 n).
        by_heat: From the friction heat (2 n, n).
        by_ambient: From the temperature of the surroundings (2 n,).
    """

    by_temperature: Array
    by_heat: Array
    by_ambient: Array

    @classmethod
    def made(cls, step: Exchanged) -> FluxMap:
        """Return the map of a step."""
        conducts, own, jump = step.row_factors()
        kept, h, n = 1 - step.debris, step.convection, len(conducts)
        inverse = scipy.linalg.inv(step.matrix())
        loss = np.where(conducts, 0.0, h)
        first, second = inverse[:, :n], inverse[:, n:]
        by_temperature = np.hstack([first * (-jump * conducts - loss), first * (jump * conducts) - second * loss])
        by_heat = (first * (own * step.partition) + second) * (kept * conducts)
        return cls(by_temperature, by_heat, first @ loss + second @ loss)

    def of(self, bare: Array, heat: Array | None, ambient: float) -> Array:
        """Return the fluxes."""
        total = self.by_temperature @ bare
        if heat is not None:
            total += self.by_heat @ heat
        if ambient:
            total += _down(bare.ndim)(self.by_ambient) * ambient
        return total

    def heat_of(self, rows: Array) -> Array:
        """Return rows of the fluxes as rows of the friction heat."""
        return rows @ self.by_heat


class FluxFactor:
    """They by a factor for q_1 (n,) and q_2 of open nodes: where a node conducts q_2 = (1 - gamma_d) Q - q_1."""

    def __init__(self, step: Exchanged) -> None:
        """Factor the system of a step."""
        self._step = step
        conducts, own, jump = step.row_factors()
        self._open = np.flatnonzero(~conducts)
        self._conducts, self._own, self._jump = conducts, np.where(conducts, own, 1.0), jump * conducts
        self._loss = np.where(conducts, 0.0, step.convection)
        t1, t2 = step.responses
        n, apart = len(conducts), self._open
        matrix: Array = np.empty((n + len(apart), n + len(apart)))
        matrix[:n, :n] = t1 * (self._jump + self._loss)[:, None]
        matrix[:n, :n] += t2 * np.outer(self._jump, conducts)
        matrix[np.arange(n), np.arange(n)] += self._own
        matrix[:n, n:] = -t2[:, apart] * self._jump[:, None]
        matrix[n:, :n] = t2[apart] * (-step.convection * conducts)
        matrix[n:, n:] = np.eye(len(apart)) + step.convection * t2[np.ix_(apart, apart)]
        self._factor = scipy.linalg.lu_factor(matrix, overwrite_a=True, check_finite=False)

    def of(self, bare: Array, heat: Array | None, ambient: float) -> Array:
        """Return the fluxes."""
        step, n, apart = self._step, len(self._conducts), self._open
        down = _down(bare.ndim)
        first, second = bare[:n], bare[n:]
        right = np.concatenate([down(self._jump) * (second - first) - down(self._loss) * (first - ambient),
                                -step.convection * (second[apart] - ambient)])  # fmt: skip
        if heat is not None:
            kept = down(self._conducts * (1 - step.debris)) * heat
            met = step.responses[1] @ kept
            right[:n] += down(self._own * self._conducts * step.partition) * kept + down(self._jump) * met
            right[n:] -= step.convection * met[apart]
        found = scipy.linalg.lu_solve(self._factor, right, overwrite_b=True, check_finite=False)
        other = np.where(down(self._conducts), (0.0 if heat is None else kept) - found[:n], 0.0)
        other[apart] = found[n:]
        return np.concatenate([found[:n], other])

    def heat_of(self, rows: Array) -> Array:
        """Return rows of the fluxes as rows of the friction heat."""
        step, n, apart = self._step, len(self._conducts), self._open
        first, second = rows[:, :n], rows[:, n:] * self._conducts
        right = np.hstack([first - second, rows[:, n:][:, apart]]).T
        z = scipy.linalg.lu_solve(self._factor, right, trans=1, overwrite_b=True, check_finite=False).T
        through = z[:, :n] * self._jump
        through[:, apart] -= z[:, n:] * step.convection
        found = through @ step.responses[1] + z[:, :n] * (self._own * self._conducts * step.partition) + second
        return np.asarray(found * (self._conducts * (1 - step.debris)))


def _down(ndim: int) -> Callable[[NDArray[Any]], NDArray[Any]]:
    """Return what makes a vector (n,) a factor of the rows of an array of so many dimensions."""
    return lambda vector: vector if ndim == 1 else vector[:, None]
