"""Phases on one grid, whose compliances are convolutions: any number of nodes, by products alone.

Each phase has the unknowns (p, a) and [S_k, H; E_k, 0]; with wear in the step all pressures open all phases, too. The
rows and columns of nodes in contact are solved by GMRES, with products by Fourier transforms no wider than the contact.
The compliance is an operator of order -1, near that of an endless grid, whose inverse takes two transforms:

    P = restriction of (S^ + D^)^-1 to the nodes in contact,

with D what wear opens where it acts, and the rigid motions eliminated exactly: about as many iterations for any number
of nodes. What phases have in common, the wear opens; what they differ by, it does not: P is of both apart.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import scipy.fft
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator, gmres

from fenwear.arrays import Array
from fenwear.contact.blocks import PhaseBlock
from fenwear.contact.operators import Indices, Solve
from fenwear.interface.convolution import Convolution, OnBox

ACCURACY, NEAR = 1e-12, 1e-6  # residual over the right-hand side, and where Newton's method goes on
FAR = 1e-5  # residual over the right-hand side that is no solution, where the accuracy was not reached
RESTART, RESTARTS = 60, 10
LEAST = 0.05  # of the operator's symbol at its mean wave number: what a table cut off may leave of it

Opening = Callable[[Array], Array]


class GriddedPhases:
    """The phases' blocks side by side; where wear is given, with what all phases' pressures open in each.

    Args:
        blocks: Of each phase, whose compliances are convolutions on one grid.
        opening: What pressures (m, n) wear open in each phase (m, n), linear; None without wear.
        local: What unit pressures wear at their own nodes alone (m, n).
    """

    def __init__(
        self, blocks: Sequence[PhaseBlock], opening: Opening | None = None, local: Array | None = None
    ) -> None:
        self.blocks, self.opening, self.local = list(blocks), opening, local
        self.of = [block.compliance for block in self.blocks if isinstance(block.compliance, Convolution)]
        self.n, self.size = self.blocks[0].nodes, self.blocks[0].size
        self._every = OnBox(self.of, np.arange(self.n))

    def multiply(self, x: Array) -> Array:
        """Return the matrix times x."""
        parts = x.reshape(len(self.blocks), -1)
        p, a = parts[:, : self.n], parts[:, self.n :]
        found = np.empty_like(parts)
        found[:, : self.n] = self._every.apply(p)
        if self.opening is not None:
            found[:, : self.n] += self.opening(p)
        for k, block in enumerate(self.blocks):
            found[k, : self.n] += block.modes @ a[k]
            found[k, self.n :] = block.balance @ p[k]
        return found.ravel()

    def factor(self, kept: Indices) -> Solve:
        """Return the solution operator of the rows and columns `kept`."""
        return _Closed(self, kept, ACCURACY).solve

    def to_some_digits(self, kept: Indices) -> Solve:
        """Return the same to some digits, for Newton's method."""
        return _Closed(self, kept, NEAR).solve


class _Closed:
    """The solution on the nodes in contact."""

    def __init__(self, phases: GriddedPhases, kept: Indices, accuracy: float) -> None:
        m, n, size = len(phases.blocks), phases.n, phases.size
        self.phases, self.accuracy = phases, accuracy
        free = np.zeros(m * size, dtype=bool)
        free[kept] = True
        parts = free.reshape(m, size)
        self.touched = np.flatnonzero(parts[:, :n].any(axis=0))
        self.closed = parts[:, self.touched].astype(float)
        self._kept = np.concatenate([parts[:, self.touched], parts[:, n:]], axis=1).ravel()
        blocks = phases.blocks
        self.modes = np.array([block.modes[self.touched] for block in blocks])  # (m, k, r)
        self.balance = np.array([block.balance[:, self.touched] for block in blocks])
        self.box = OnBox(phases.of, self.touched)
        self._symbol()
        self._eliminate()

    def _symbol(self) -> None:
        """Take the inverse of S, and of S with wear, on an endless grid of the contact's size."""
        box, of = self.box, self.phases.of[0]
        self.period = tuple(scipy.fft.next_fast_len(int(1.5 * count) + 2, real=True) for count in box.box)
        reach = [min(b - 1, (size - 1) // 2) for b, size in zip(box.box, self.period, strict=True)]
        table = box.numbers(of)
        cut = tuple(slice(b - 1 - r, b + r) for b, r in zip(box.box, reach, strict=True))
        wrapped = np.zeros(self.period)
        wrapped[np.ix_(*(np.arange(-r, r + 1) % s for r, s in zip(reach, self.period, strict=True)))] = table[cut]
        symbol = scipy.fft.rfftn(wrapped).real * float(of.weights.max())
        self.symbol = np.maximum(symbol, LEAST * np.median(np.abs(symbol)))
        local = self.phases.local
        self.worn = 0.0
        if local is not None:
            sums = local[:, self.touched].sum(axis=0)
            self.worn = float(sums[sums > 0].mean()) if (sums > 0).any() else 0.0

    def _inverse(self, r: Array, worn: float) -> Array:
        """Return the product of the inverse of S + worn on an endless grid with fields (m, k)."""
        grid = np.zeros((len(r), *self.period))
        at = (slice(None), *self.box.at)
        grid[at] = r
        axes = tuple(range(1, grid.ndim))
        image = scipy.fft.rfftn(grid, axes=axes)
        image /= self.symbol + worn
        return np.asarray(scipy.fft.irfftn(image, self.period, axes=axes, overwrite_x=True)[at])

    def _of_pressures(self, r: Array) -> Array:
        """Return P times what is left of the gaps (m, k)."""
        if not self.worn:
            return self._inverse(r, 0.0) * self.closed
        share = self.closed / np.maximum(self.closed.sum(axis=0), 1.0)
        common = (share * r).sum(axis=0)
        alike = self._inverse(common[None], self.worn)
        if len(r) == 1:
            return alike * self.closed
        return (alike + self._inverse((r - common) * self.closed, 0.0)) * self.closed

    def _eliminate(self) -> None:
        """Prepare the rigid motions of every phase."""
        r = self.modes.shape[2]
        self._by_modes = np.stack(
            [self._of_pressures(self.modes[:, :, j] * self.closed) for j in range(r)], axis=2
        ) if r else np.zeros((*self.closed.shape, 0))  # fmt: skip
        self._schur = np.einsum("mrk,mks->mrs", self.balance, self._by_modes)
        if r and not np.abs(np.linalg.det(self._schur)).min() > 0:
            raise np.linalg.LinAlgError("singular matrix")

    def _precondition(self, b: Array) -> Array:
        parts = self._spread(b)
        k = len(self.touched)
        p = self._of_pressures(parts[:, :k])
        if not self.modes.shape[2]:
            return self._picked(p, parts[:, k:])
        left = np.einsum("mrk,mk->mr", self.balance, p) - parts[:, k:]
        a = np.linalg.solve(self._schur, left[:, :, None])[:, :, 0]
        return self._picked(p - np.einsum("mks,ms->mk", self._by_modes, a), a)

    def _spread(self, x: Array) -> Array:
        whole: Array = np.zeros(len(self._kept))
        whole[self._kept] = x.ravel()
        return whole.reshape(len(self.closed), -1)

    def _picked(self, p: Array, a: Array) -> Array:
        return np.asarray(np.concatenate([p, a], axis=1).ravel()[self._kept])

    def _multiply(self, x: Array) -> Array:
        parts = self._spread(x)
        k = len(self.touched)
        p, a = parts[:, :k], parts[:, k:]
        gap = self.box.apply(p) + np.einsum("mkr,mr->mk", self.modes, a)
        if self.phases.opening is not None:
            whole = np.zeros((len(p), self.phases.n))
            whole[:, self.touched] = p
            gap += self.phases.opening(whole)[:, self.touched]
        return self._picked(gap, np.einsum("mrk,mk->mr", self.balance, p))

    def solve(self, b: Array) -> Array:
        """Return the unknowns.

        Raises:
            LinAlgError: no solution was found.
        """
        if not len(b):
            return np.zeros_like(b)
        shape, count = (len(b), len(b)), 0

        def note(_: float) -> None:
            nonlocal count
            count += 1

        x, failed = gmres(
            LinearOperator(shape, matvec=self._multiply, dtype=float),
            b,
            rtol=self.accuracy,
            atol=0.0,
            restart=min(RESTART, len(b)),
            maxiter=RESTARTS,
            M=LinearOperator(shape, matvec=self._precondition, dtype=float),
            callback=note,
            callback_type="pr_norm",
        )
        self.iterations = count
        if failed and not np.linalg.norm(b - self._multiply(x)) <= FAR * np.linalg.norm(b):
            raise np.linalg.LinAlgError("singular matrix")
        result: NDArray[np.float64] = x
        return result
