"""The linear equations of a cycle jump on a contact grid, by products alone.

With h = g N, of unknowns z (depths, and what lies between) and the pressures q that they take away,

    (1 - h B) z + h L q = r,        C q + H a = R z,        balances of q = 0,

L what pressures add to a cycle's wear and states, R the gap that these open, both of each node by itself, B what states
do to themselves. Without z, h R (1 - h B)^-1 L is next to diagonal: what a pressure wears in the jump stands beside
what it displaces. GMRES is preconditioned by the inverse of C on an endless grid between square roots of that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array, eye_array
from scipy.sparse.linalg import splu

from fenwear.arrays import Array
from fenwear.contact.krylov import flexible
from fenwear.errors import ConvergenceError
from fenwear.interface.convolution import STIFF
from fenwear.layers.closure import Closure
from fenwear.stick.position import Position

ACCURACY = 1e-7  # residual over the right-hand side
FAR = 1e-4  # the same that is no solution
RESTART, RESTARTS = 60, 6
TOO_LARGE = "what many cycles wear is too large for numbers: expected a smaller wear coefficient"


@dataclass(frozen=True, eq=False)
class Answering:
    """Time steps of a cycle in one place of the strip, whose pressures answer to depths.

    Attributes:
        position: The place.
        closed: The nodes that touch (k,).
        pressure: There (n,), MPa.
        left: What their pressures add to a cycle's wear and to what lies between (total, k).
        right: The gap that depths and what lies between open there (k, total).
        share: Of the cycle's time.
        closure: By what all that lies between gives way there; None for nothing.
    """

    position: Position
    closed: NDArray[np.int64]
    pressure: Array
    left: csr_array
    right: csr_array
    share: float
    closure: Closure | None = None


class GridJump:
    """The solution operator.

    Args:
        groups: Of the cycle's time steps.
        itself: B (total, total).
        step: H.

    Raises:
        ConvergenceError: the step is beyond all numbers.
    """

    def __init__(self, groups: Sequence[Answering], itself: csr_array, step: float) -> None:
        self.groups, self.step = groups, step
        self._alone = None
        if itself.nnz:
            self._alone = splu(csc_array(eye_array(itself.shape[0]) - step * itself))
        self._parts = [_Part(group, step) for group in groups]
        self._cuts = np.cumsum([part.size for part in self._parts])[:-1]

    def _without_pressure(self, right: Array) -> Array:
        """Return z where no pressure answers."""
        return right if self._alone is None else np.asarray(self._alone.solve(right))

    def _worn(self, x: Array) -> Array:
        """Return what pressures wear in the jump (total,)."""
        lost = sum(
            part.group.left @ (own[: part.k] * part.unit)
            for part, own in zip(self._parts, np.split(x, self._cuts), strict=True)
        )
        return self._without_pressure(self.step * np.asarray(lost))

    def _multiply(self, x: Array) -> Array:
        worn = self._worn(x)
        found = []
        for part, own in zip(self._parts, np.split(x, self._cuts), strict=True):
            answer = part.multiply(own)
            answer[: part.k] += part.group.right @ worn
            found.append(answer)
        return np.concatenate(found)

    def _precondition(self, r: Array) -> Array:
        parts = zip(self._parts, np.split(r, self._cuts), strict=True)
        return np.concatenate([part.precondition(own) for part, own in parts])

    def solve(self, right: Array) -> Array:
        """Return z (total,).

        Raises:
            ConvergenceError: GMRES found no solution.
        """
        alone = self._without_pressure(right)
        opened = [np.concatenate([part.group.right @ alone, np.zeros(part.r)]) for part in self._parts]
        b = np.concatenate(opened)
        if not np.isfinite(b).all():
            raise ConvergenceError(TOO_LARGE)
        if not b.any():
            return alone
        x, rest, *_ = flexible(self._multiply, self._precondition, b, ACCURACY, RESTART, RESTARTS)
        if not (rest <= FAR and np.isfinite(x).all()):
            raise ConvergenceError("the pressures' answer to a jump's wear did not converge")
        return alone - self._worn(x)


class _Part:
    """C with rigid motions on the nodes of a group; pressures in a unit by which both are of one size."""

    def __init__(self, group: Answering, step: float) -> None:
        position, closed, closure = group.position, group.closed, group.closure
        on = position.compliance.on_grid
        assert on is not None
        self.group, self.k, self.r = group, len(closed), position.modes.shape[1]
        self.on = on.boxes.around(closed)
        self.at = self.on.box.where(on.of.places[closed])
        self.size, diagonal = self.k + self.r, on.diagonal()
        own = diagonal[closed]
        self.unit = 1 / float(np.median(diagonal[: len(on.weights)]))  # MPa for a gap of one
        self.gives = 0.0 if closure is None else closure.slope(group.pressure)[closed]
        worn = step * np.asarray(group.right.multiply(group.left.T).sum(axis=1)).ravel()
        self.shrunk = 1 / np.sqrt(1 + np.maximum(worn + self.gives, 0.0) / own)
        modes = position.modes[closed]
        sizes = np.maximum(np.abs(modes).max(axis=0, initial=0.0), 1e-300)
        self.modes = (modes / sizes).T
        weights = position.pair.weights[closed]
        self.held = self.modes * (weights / weights.sum())
        self.by_modes = np.array([self._inverse(one) for one in self.modes]).reshape(self.modes.shape)
        self.schur = self.held @ self.by_modes.T

    def _grid(self, values: Array) -> Array:
        whole = np.zeros((self.on.d, int(np.prod(self.on.counts))))
        whole[0, self.at] = values
        return whole.reshape(self.on.d, *self.on.counts)

    def _inverse(self, gaps: Array) -> Array:
        fields = self._grid(gaps * self.shrunk)
        found = self.on.solve(fields, np.zeros((len(STIFF), *fields.shape)))[0].ravel()[self.at]
        return np.asarray(found * (self.shrunk / self.unit))

    def multiply(self, x: Array) -> Array:
        """Return gaps and forces of pressures and motions (k + r,)."""
        p, a = x[: self.k] * self.unit, x[self.k :]
        gaps = self.on.products(self._grid(p))[0].ravel()[self.at] + self.gives * p + a @ self.modes
        return np.concatenate([gaps, self.held @ x[: self.k]])

    def precondition(self, r: Array) -> Array:
        """Return pressures and motions (k + r,) that have about these gaps, and these forces."""
        x = self._inverse(r[: self.k])
        if not self.r:
            return x
        a = np.linalg.solve(self.schur, self.held @ x - r[self.k :])
        return np.concatenate([x - a @ self.by_modes, a])
