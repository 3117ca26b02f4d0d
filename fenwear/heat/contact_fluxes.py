"""The heat fluxes of a step at the contact, from what the surfaces' temperatures would be without them.

At a node that conducts, with the friction heat Q,

    q_1 + q_2 = (1 - gamma_d) Q,    kappa (1 - gamma_d) Q - q_1 = h_c (theta_1 - theta_2),

elsewhere q_i = -h (theta_i - theta_a), and theta_i = bare_i + T_i q_i: a dense system M q = r. Of few nodes its
solution is made into matrices, which serve many steps. M is eliminated down to q_1 and what open nodes of the second
body lose, n unknowns or a few more in place of 2 n, and kept as a factor.

From one step to the next few nodes begin or cease to conduct: of M and r other rows c than those of the factor's M_0
and r_0. With E the columns of the identity at these rows the factor serves on, exactly, by Woodbury's formula:

    q = M_0^-1 (r_0 + E y),    Z = M_c M_0^-1,    (Z E) y = r_c - Z r_0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from fenwear.common.arrays import Array

UPDATED = 0.1  # of the nodes: those that may conduct otherwise than a factor has it


@dataclass(frozen=True)
class Sources:
    """Rows of something that is linear in what fluxes come from.

    Attributes:
        first, second: On the surfaces' temperatures without flux (r, n) each.
        heat: On the friction heat (r, n).
        ambient: On the temperature of the surroundings (r,).
    """

    first: Array
    second: Array
    heat: Array
    ambient: Array

    def of(self, bare: Array, heat: Array, ambient: float) -> Array:
        """Return the values (r,) or (r, k), see `Fluxes.of`."""
        n = self.first.shape[1]
        total = self.first @ bare[:n] + self.second @ bare[n:]
        total += self.heat @ heat
        return total + _down(bare.ndim)(self.ambient) * ambient


@dataclass(frozen=True)
class Exchanged:
    """Equations of the fluxes of a step.

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
        """Return the mask of conducting nodes, and the factors of q_1 and of theta_1 - theta_2 in their first row."""
        perfect = np.isinf(self.conductance)
        jump = np.where(perfect, 1.0, np.nan_to_num(self.conductance, nan=0.0, posinf=0.0))
        return ~np.isnan(self.conductance), np.where(perfect, 0.0, 1.0), jump

    @property
    def loss(self) -> Array:
        """H where no heat is conducted, else 0 (n,), mW/(mm² K)."""
        return np.where(np.isnan(self.conductance), self.convection, 0.0)

    def rows(self, nodes: NDArray[np.int64]) -> Array:
        """Return the rows of both bodies' nodes in the matrix of the system for (q_1, q_2) (2 k, 2 n)."""
        (t1, t2), k, n = self.responses, len(nodes), len(self.conductance)
        conducts, diagonal, jump = (a[nodes] for a in self.row_factors())
        loss, every = self.loss[nodes], np.arange(k)
        rows: Array = np.empty((2 * k, 2 * n))
        rows[:k, :n] = (jump + loss)[:, None] * t1[nodes]
        rows[:k, n:] = -jump[:, None] * t2[nodes]
        rows[k:, :n] = 0.0
        rows[k:, n:] = loss[:, None] * t2[nodes]
        rows[every, nodes] += diagonal
        rows[k + every, nodes] += conducts
        rows[k + every, n + nodes] += 1.0
        return rows

    def right(self, bare: Array, heat: Array, ambient: float) -> Array:
        """Return the right-hand side of the system, see `Fluxes.of`."""
        conducts, diagonal, jump = self.row_factors()
        n, loss, down = len(conducts), self.loss, _down(bare.ndim)
        first, second = bare[:n], bare[n:]
        right = np.concatenate(
            [down(jump) * (second - first) - down(loss) * (first - ambient), -down(loss) * (second - ambient)]
        )
        kept = down(conducts * (1 - self.debris)) * heat
        right[:n] += down(diagonal * self.partition) * kept
        right[n:] += kept
        return right

    def sources(self, rows: Array) -> Sources:
        """Return rows (r, 2 n) of the right-hand side as rows of its sources."""
        conducts, diagonal, jump = self.row_factors()
        first, second = np.hsplit(rows, 2)
        loss, kept = self.loss, conducts * (1 - self.debris)
        return Sources(
            -first * (jump + loss),
            first * jump - second * loss,
            (first * (diagonal * self.partition) + second) * kept,
            (first + second) @ loss,
        )


class Fluxes(Protocol):
    """The fluxes (q_1, q_2) of a step, both surfaces concatenated, linear in what they come from."""

    def of(self, bare: Array, heat: Array, ambient: float) -> Array:
        """Return the fluxes (2 n,) or (2 n, k), mW/mm².

        Args:
            bare: The surfaces' temperatures without flux (2 n,) or (2 n, k), K.
            heat: Of friction (n,) or (n, k), mW/mm².
            ambient: Temperature of the surroundings, K.
        """

    def sources(self, rows: Array) -> Sources:
        """Return rows (r, 2 n) of the fluxes as rows of what they come from."""


class FluxFactor:
    """The fluxes by a factor for q_1 (n,) and q_2 of open nodes: where a node conducts q_2 follows from q_1.

    Attributes:
        step: Their equations.
    """

    def __init__(self, step: Exchanged) -> None:
        """Factor the system of a step."""
        self.step = step
        conducts, diagonal, self._jump = step.row_factors()
        self._open, self._conducts = np.flatnonzero(~conducts), conducts
        t1, t2 = step.responses
        n, apart = len(conducts), self._open
        matrix: Array = np.empty((n + len(apart), n + len(apart)))
        matrix[:n, :n] = t1 * (self._jump + step.loss)[:, None]
        matrix[:n, :n] += t2 * np.outer(self._jump, conducts)
        matrix[np.arange(n), np.arange(n)] += diagonal
        matrix[:n, n:] = -t2[:, apart] * self._jump[:, None]
        matrix[n:, :n] = t2[apart] * (-step.convection * conducts)
        matrix[n:, n:] = np.eye(len(apart)) + step.convection * t2[np.ix_(apart, apart)]
        self._factor = scipy.linalg.lu_factor(matrix, overwrite_a=True, check_finite=False)
        self._adjoint: dict[tuple[int, float], Array] = {}  # rows Z of nodes and their conductances

    def of(self, bare: Array, heat: Array, ambient: float) -> Array:
        """Return the fluxes."""
        return self.solve(self.step.right(bare, heat, ambient))

    def sources(self, rows: Array) -> Sources:
        """Return rows of the fluxes as rows of what they come from."""
        return self.step.sources(self.solve_rows(rows))

    def solve(self, right: Array) -> Array:
        """Return M^-1 times right-hand sides (2 n,) or (2 n, k)."""
        step, n, apart, down = self.step, len(self._conducts), self._open, _down(right.ndim)
        entering = down(self._conducts) * right[n:]
        reduced = np.concatenate([right[:n], right[n:][apart]])
        if entering.any():
            met = step.responses[1] @ entering
            reduced[:n] += down(self._jump) * met
            reduced[n:] -= step.convection * met[apart]
        fluxes = scipy.linalg.lu_solve(self._factor, reduced, overwrite_b=True, check_finite=False)
        other: Array = entering - down(self._conducts) * fluxes[:n]
        other[apart] = fluxes[n:]
        return np.concatenate([fluxes[:n], other])

    def solve_rows(self, rows: Array) -> Array:
        """Return rows (r, 2 n) times M^-1."""
        step, n, apart = self.step, len(self._conducts), self._open
        second = rows[:, n:] * self._conducts
        right = np.hstack([rows[:, :n] - second, rows[:, n:][:, apart]]).T
        z = scipy.linalg.lu_solve(self._factor, right, trans=1, overwrite_b=True, check_finite=False).T
        through = z[:, :n] * self._jump
        through[:, apart] -= z[:, n:] * step.convection
        second += (through @ step.responses[1]) * self._conducts
        second[:, apart] = z[:, n:]
        return np.hstack([z[:, :n], second])

    def updated(self, step: Exchanged) -> FluxFactor | FluxUpdate | None:
        """Return the fluxes of a step at other conductances by this factor; None where too many nodes differ."""
        ours, others = np.nan_to_num(self.step.conductance, nan=-1.0), np.nan_to_num(step.conductance, nan=-1.0)
        nodes = np.flatnonzero(ours != others)
        if not len(nodes):
            return self
        most = int(UPDATED * len(ours))
        if len(nodes) > most:
            return None
        keys = [(int(node), float(others[node])) for node in nodes]
        if len(self._adjoint) + len(keys) > 2 * most:
            self._adjoint.clear()
        new = np.array([key[0] for key in keys if key not in self._adjoint], dtype=np.int64)
        if len(new):
            pairs = self.solve_rows(step.rows(new)).reshape(2, len(new), -1).transpose(1, 0, 2)
            self._adjoint.update(zip([key for key in keys if key not in self._adjoint], pairs, strict=True))
        rows = np.array([self._adjoint[key] for key in keys]).reshape(len(keys), 2, 2 * len(ours))
        return FluxUpdate(self, step, nodes, np.concatenate([rows[:, 0], rows[:, 1]]))


class FluxUpdate:
    """The fluxes by the factor of a step in which a few nodes conduct otherwise.

    Attributes:
        base: That factor.
        changed: Rows of the system that differ (2 k,).
        added: Addition to their right-hand sides, y.
    """

    def __init__(self, base: FluxFactor, step: Exchanged, nodes: NDArray[np.int64], rows: Array) -> None:
        """Solve for what is added.

        Args:
            base: The factor.
            step: Equations of the fluxes.
            nodes: Nodes that differ (k,).
            rows: Z, their rows times the inverse of the factor's matrix (2 k, 2 n).
        """
        self.base, self.changed = base, np.concatenate([nodes, nodes + len(step.conductance)])
        picked: Array = np.zeros_like(rows)
        picked[np.arange(len(rows)), self.changed] = 1.0
        sources, others = step.sources(picked), base.step.sources(rows)
        factor = scipy.linalg.lu_factor(rows[:, self.changed])
        self.added = Sources(
            *(
                scipy.linalg.lu_solve(factor, getattr(sources, name) - getattr(others, name))
                for name in ("first", "second", "heat", "ambient")
            )
        )

    def of(self, bare: Array, heat: Array, ambient: float) -> Array:
        """Return the fluxes."""
        right = self.base.step.right(bare, heat, ambient)
        right[self.changed] += self.added.of(bare, heat, ambient)
        return self.base.solve(right)

    def sources(self, rows: Array) -> Sources:
        """Return rows of the fluxes as rows of what they come from."""
        through = self.base.solve_rows(rows)
        base, picked, added = self.base.step.sources(through), through[:, self.changed], self.added
        return Sources(
            base.first + picked @ added.first,
            base.second + picked @ added.second,
            base.heat + picked @ added.heat,
            base.ambient + picked @ added.ambient,
        )


def _down(ndim: int) -> Callable[[NDArray[Any]], NDArray[Any]]:
    """Return the function that makes a vector (n,) a factor of the rows of an array of so many dimensions."""
    return lambda vector: vector if ndim == 1 else vector[:, None]
