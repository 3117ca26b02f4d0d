"""Contact on an endless grid, all nodes in contact: each wave by itself, solved exactly; near what a patch does.

The pressures p_k of m phases open by a wave of wave number q

    g_k = s p_k + sum over j of (a_j + t_k b_j conj(t_j)) p_j,

with s the symbol of the compliance of bodies and layers in each phase, a_j what is worn at the punch's nodes
by unit pressures, b_j what is worn off the strip's material, and t_k the symbol that takes values on the strip where it
is in phase k to the punch's nodes. For every wave that is s times the identity and two products more,

    A = s + U V,   U = [1, t],  V = [a; b conj(t)]:   A^-1 = (1 - U (s + V U)^-1 V) / s,

so that phases which meet in what they wear cost no more than phases by themselves. Restricted to the nodes in contact,
R A^-1 R^T =: P, it is near the inverse there, as A is an operator of order -1 with wear of order 0 besides. With rigid
motions H and balances of forces E the approximate solution holds the balances exactly:

    p = P (r - H a),    E P H a = E P r - f,

inner products of fields being those of their waves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from fenwear.bodies.convolution import Waves, back, forward, in_cache, over_period
from fenwear.common.arrays import Array
from fenwear.surfaces.grid_compliance import OnBox

LEAST = 0.05  # of the symbol at its mean wave number: what a table cut off may leave of it
SAME = 1e-12  # of symbols, and of modes
MARGIN = 1.0  # of a box: the period of what is solved, which does not end


@dataclass(frozen=True)
class Passing:
    """Weights by which a node of the punch reads depths of the strip, and puts the wear below it there.

    Attributes:
        read: Numbers that the values are taken by (k,).
        read_at: Places of these on the strip, counted from that of the node where nothing is moved (k, axes).
        put, put_at: The same of what is put there.
    """

    read: Array
    read_at: NDArray[np.int64]
    put: Array
    put_at: NDArray[np.int64]


class EndlessGrid:
    """The inverse of S with wear on an endless grid.

    Waves of m phases are arrays (i, m, j), in the plane j = 1: numbers that change along i alone, as those of a strip
    that moves along the first axis, are matrices of phases for each i.

    Args:
        of: The compliances on a box, whose first one is that of all.
        passing: Of each phase; none where the strip does not wear.
    """

    def __init__(self, of: OnBox, passing: Sequence[Passing] = ()) -> None:
        self.box = of.box
        self.period = tuple(scipy.fft.next_fast_len(int(MARGIN * count) + 2, real=True) for count in self.box.counts)
        waves = scipy.fft.rfftn(over_period(of.of[0].table[0, 0], self.period))
        symbol = _rows(waves).real * of.largest + float(of.local[0].mean())
        self._symbol = np.maximum(symbol, LEAST * np.median(np.abs(symbol)))
        if passing:
            self._read = _short([self._transfer(weights.read, -weights.read_at) for weights in passing])
            self._put = _short([self._transfer(weights.put, weights.put_at) for weights in passing])
        self.take(np.zeros(1), np.zeros(1), 0.0)

    def _transfer(self, numbers: Array, at: NDArray[np.int64]) -> Waves:
        """Return the waves (i, j) of numbers at places (k, axes)."""
        wrapped = np.zeros(self.period)
        np.add.at(wrapped, tuple((at % np.array(self.period)).T), numbers)
        return _rows(scipy.fft.rfftn(wrapped))

    def take(self, common: Array, strip: Array, local: float) -> None:
        """Take what unit pressures open besides the bodies, on average.

        Args:
            common: Worn off the punch in each phase (m,).
            strip: Worn off the strip (m,).
            own: In their own phase alone.
        """
        symbol = self._symbol + local
        pairs: list[tuple[Waves, Waves]] = []  # of U (i, j, m) and V
        if common.any():
            pairs.append((np.ones((1, 1, len(common)), dtype=complex), common[None, None].astype(complex)))
        if strip.any():
            pairs.append((self._read, strip * self._put))
        self.inverse: Array = 1 / symbol[:, None]
        self._worn: tuple[Waves, Waves, Waves] | None = None
        if not pairs:
            return
        waves = np.broadcast_shapes(*(u.shape[:2] for u, _ in pairs))
        to, by = (
            np.stack([np.broadcast_to(pair[k], (*waves, pair[k].shape[2])) for pair in pairs], axis=2) for k in (0, 1)
        )  # (i, j, pairs, m)
        small = np.linalg.inv(by @ to.swapaxes(2, 3) + symbol[:, :, None, None] * np.eye(len(pairs)))
        if waves[1] == 1:  # (i, pairs, m), (i, m, pairs), and of each wave (i, pairs, pairs, j)
            by, to = by[:, 0], to[:, 0].swapaxes(1, 2)
        else:  # (i, pairs, m, j), (i, m, pairs, j)
            by, to = by.transpose(0, 2, 3, 1), to.transpose(0, 3, 2, 1)
        small = small.transpose(0, 2, 3, 1)
        self._worn = np.ascontiguousarray(by), np.ascontiguousarray(to), np.ascontiguousarray(small)

    def forward(self, fields: Array) -> Waves:
        """Return the waves of fields in the box (m, ...)."""
        i, _, j = self.inverse.shape
        waves = np.empty((i, len(fields), j), dtype=np.complex128)
        for some in in_cache(len(fields), waves[:, :1].nbytes):
            waves[:, some] = forward(fields[some], self.period).reshape(-1, i, j).swapaxes(0, 1)
        return waves

    def back(self, waves: Waves) -> Array:
        """Return the fields in the box of waves."""
        i, m, j = waves.shape
        fields: Array = np.empty((m, *self.box.counts))
        shape = (-1, i, j) if len(self.period) == 2 else (-1, i)
        for some in in_cache(m, waves[:, :1].nbytes):
            image = np.ascontiguousarray(waves[:, some].swapaxes(0, 1)).reshape(shape)
            fields[some] = back(image, self.period, self.box.counts)
        return fields

    def solve(self, waves: Waves) -> Waves:
        """Return A^-1 of the waves of all phases."""
        if self._worn is not None:
            by, to, small = self._worn
            if by.ndim == 3:
                waves = waves - to @ _through(small, by @ waves)
            else:
                common = _through(small, (by * waves[:, None]).sum(axis=2))
                waves = waves - (to * common[:, None]).sum(axis=2)
        return waves * self.inverse

    def between(self, held: Waves, moved: Waves) -> Array:
        """Return the sums, held in each phase, of A^-1 times waves in a single phase (m, m)."""
        divided = held * self.inverse
        sums = np.diag(np.einsum("imj,imj->m", divided, moved).real)
        if self._worn is None:
            return sums
        by, to, small = self._worn
        if by.ndim == 3:
            by, to = by[..., None], to[..., None]
        m = moved.shape[1]
        columns = _through(small[:, :, :, None], by * moved[:, None])  # (i, pairs, m, j)
        rows = (to * divided[:, :, None]).transpose(1, 0, 2, 3)  # (m, i, pairs, j)
        return sums - (rows.reshape(m, -1) @ columns.transpose(0, 1, 3, 2).reshape(-1, m)).real

    def measure(self, waves: Waves) -> Waves:
        """Return the factors of other fields' waves in the sums over the box of their products with these fields."""
        twice = np.full(self.period[-1] // 2 + 1, 2.0)  # waves along the last axis stand for two, but for the ends
        twice[0] = 1.0
        if self.period[-1] % 2 == 0:
            twice[-1] = 1.0
        shaped = twice if len(self.period) == 2 else twice[:, None, None]
        return np.asarray(waves.conj() * (shaped / np.prod(self.period)))


class Patch:
    """The inverse on an endless grid, restricted to the nodes in contact, with rigid motions.

    Args:
        endless: The grid, with its wear.
        modes: H (m, r, ...) in the box, zero where no node is in contact and where a motion is not asked for.
        balance: E (m, r, ...), likewise; a number that it is times H.

    Raises:
        LinAlgError: the loads are not balanced by the nodes in contact.
    """

    def __init__(self, endless: EndlessGrid, modes: Array, balance: Array | float) -> None:
        self.endless = endless
        self._m, self._r = m, r = modes.shape[:2]
        self._moved = [endless.forward(modes[:, s]) for s in range(r)]
        if isinstance(balance, float):
            held = [endless.measure(balance * moved) for moved in self._moved]
        else:
            held = [endless.measure(endless.forward(balance[:, s])) for s in range(r)]
        # Real parts of their products with waves are products of numbers twice as many.
        self._held = [np.conj(mode).view(np.float64) for mode in held]
        schur = np.zeros((m, r, m, r))
        for s in range(r):
            for t in range(r):
                schur[:, s, :, t] = endless.between(held[s], self._moved[t])
        free = modes.any(axis=tuple(range(2, modes.ndim))).ravel()
        self._schur = np.where(np.outer(free, free), schur.reshape(m * r, m * r), np.diag(np.where(free, 0.0, 1.0)))
        if r and not (np.abs(np.diagonal(self._schur)) > 0).all():
            raise np.linalg.LinAlgError("singular matrix")

    def _forces(self, waves: Waves) -> Array:
        """Return E of pressures (m, r)."""
        forces = [np.einsum("imj,imj->m", held, waves.view(np.float64)) for held in self._held]
        return np.stack(forces, axis=1) if forces else np.zeros((self._m, 0))

    def solve(self, gaps: Array, forces: Array) -> tuple[Array, Array]:
        """Return pressures (m, ...) and rigid motions (m, r) for gaps, zero beside the contact, and forces."""
        endless, a = self.endless, np.zeros((self._m, self._r))
        waves = endless.forward(gaps)
        if self._r:
            left = self._forces(endless.solve(waves)) - forces
            a = np.linalg.solve(self._schur, left.ravel()).reshape(self._m, self._r)
            for s, moved in enumerate(self._moved):
                waves -= moved * a[:, s, None]
        return endless.back(endless.solve(waves)), a


def _through(small: Waves, waves: Waves) -> Waves:
    """Return products of each wave's matrix of pairs (i, pairs, pairs, ...) with numbers of it (i, pairs, ...)."""
    products = small[:, :, 0] * waves[:, :1]
    for pair in range(1, waves.shape[1]):
        products += small[:, :, pair] * waves[:, pair, None]
    return products


def _rows(waves: Waves) -> Waves:
    """Return waves (i, j), in the plane (i, 1)."""
    return waves if waves.ndim == 2 else waves[:, None]


def _short(symbols: Sequence[Waves]) -> Waves:
    """Return symbols (i, j, m), with one number where they do not change along j."""
    stacked = np.stack(symbols, axis=2)
    first = stacked[:, :1]
    return first if np.abs(stacked - first).max() < SAME else stacked
