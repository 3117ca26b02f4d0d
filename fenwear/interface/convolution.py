"""The compliance of two bodies on one grid: one convolution, and what finite bodies do besides.

Where both answer on the nodes of the same regular grid, and the traction that goes with a unit pressure is the same
everywhere, S is a table of one number for each distance of two nodes, and a correction on a few points for each body:

    S_ij = w_j (T(x_i - x_j) + sum over the bodies of L(x_i) C L(x_j)^T) + c_i delta_ij,

with c what a layer between the bodies closes by a unit pressure.

So it is in any place of a strip that passes under the punch: half-spaces do not know where they are. Only the
correction moves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol, runtime_checkable

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from fenwear.arrays import Array, Nodes
from fenwear.bodies.tensor import TensorWeights

TRANSFORM = 85.0  # numbers that memory could give while one is transformed, there and back over two (measured)
EVERY = slice(None)
CACHE = 2**18  # bytes of waves that are transformed at a time


@runtime_checkable
class Convolving(Protocol):
    """An operator that is a convolution on a grid, and smooth besides."""

    @property
    def directions(self) -> Array:
        """Unit vectors (q, d, a)."""

    @property
    def places(self) -> NDArray[np.int64]:
        """Whole numbers of each node along the axes of the grid (q, d - 1)."""

    def table(self, traction: Array) -> Array:
        """Return the displacement by a force (d,) at all distances of two nodes (2 m - 1, ...)."""

    def smooth(self, traction: Array) -> tuple[TensorWeights, Array] | None:
        """Return values at points to the nodes, and what forces along it at points do (k, k); None for none."""


class Convolution:
    """S (n, n) on a grid, mm/MPa.

    Args:
        places: Whole numbers of each node along the axes of the grid (n, d - 1).
        table: Gap by a unit force at all distances of two nodes (2 m - 1, ...), mm/N, scaled.
        smooth: L and C (k, k) of each body that has a correction.
        weights: w (n,).
        local: c (n,), scaled; None for none.
    """

    def __init__(
        self,
        places: NDArray[np.int64],
        table: Array,
        smooth: Sequence[tuple[TensorWeights, Array]],
        weights: Array,
        local: Array | None = None,
    ) -> None:
        self.numbers, self.smooth, self.weights, self.local = table, list(smooth), weights, local
        self.places = places - places.min(axis=0)
        self.shape = tuple((count + 1) // 2 for count in table.shape)

    @property
    def cost(self) -> float:
        """Of a product, in numbers that memory could give meanwhile."""
        over = TRANSFORM * 2.0 ** len(self.shape) / 4 * 2 * float(np.prod(self.shape))
        return over + sum(2.0 * len(self.weights) * max(weights.factors[0].shape) for weights, _ in self.smooth)

    @cached_property
    def whole(self) -> OnBox:
        """Its products on all nodes."""
        return OnBox([self], Box.around(self.places, self.shape))

    def apply(self, x: Array) -> Array:
        """Return the gaps (n,) of pressures (n,)."""
        box = self.whole.box
        return box.values(self.whole.apply(box.spread(x[None])))[0]

    def entries(self, rows: Nodes, columns: Nodes) -> Array:
        """Return the numbers of some rows and columns."""
        if isinstance(rows, slice) and isinstance(columns, slice) and columns == EVERY:
            return self._rows(rows)
        apart = self.places[rows][:, None] - self.places[columns] + np.array(self.shape) - 1
        found = self.numbers[tuple(np.moveaxis(apart, -1, 0))]
        for points, response in self.smooth:
            found = found + (points.rows(rows) @ response) @ points.rows(columns).T
        found = np.asarray(found * self.weights[columns])
        if self.local is not None:
            every = np.arange(len(self.weights))
            i, j = np.equal.outer(every[rows], every[columns]).nonzero()
            found[i, j] += self.local[rows][i]
        return found

    def _rows(self, rows: slice) -> Array:
        """Return all numbers of some rows: the table about each of their nodes, turned round."""
        nodes, at = np.arange(len(self.weights))[rows], tuple(self.places.T)
        found = np.empty((len(nodes), len(self.weights)))
        turned = self.numbers[(slice(None, None, -1),) * len(self.shape)]
        for k, place in enumerate(self.places[rows]):
            window = tuple(slice(m - 1 - here, 2 * m - 1 - here) for m, here in zip(self.shape, place, strict=True))
            found[k] = turned[window][at]
        for points, response in self.smooth:
            found += points.to_nodes((points.rows(rows) @ response).T).T
        found *= self.weights
        if self.local is not None:
            found[np.arange(len(nodes)), nodes] += self.local[nodes]
        return found

    def columns(self, nodes: Nodes, rows: Nodes = EVERY) -> Array:
        """Return the columns of some nodes (n, k), or some rows of them."""
        return self.entries(rows, nodes)

    def diagonal(self) -> Array:
        """Return the diagonal (n,)."""
        found = np.full(len(self.weights), self.numbers[tuple(count - 1 for count in self.shape)])
        for points, response in self.smooth:
            found += points.diagonal(response)
        return np.asarray(found * self.weights + (0.0 if self.local is None else self.local))

    def matrix(self) -> Array:
        """Return all of it (n, n)."""
        return self.entries(EVERY, EVERY)


@dataclass(frozen=True, eq=False)
class Box:
    """A box of places of a grid.

    Attributes:
        low: Its least place along each axis.
        counts: Places along each axis.
        nodes: Numbers of the nodes in it (k,).
        at: Where they stand in it, its last axis the fastest (k,).
        within: Places of the whole grid, where all have a node, numbered with the last axis the fastest; else None.
    """

    low: tuple[int, ...]
    counts: tuple[int, ...]
    nodes: NDArray[np.int64]
    at: NDArray[np.int64]
    within: tuple[int, ...] | None = None

    @classmethod
    def around(cls, places: NDArray[np.int64], shape: Sequence[int], touched: NDArray[np.int64] | None = None) -> Box:
        """Return the box of all places (n, axes) of a grid of that shape, or as wide as some of them ask for.

        No narrower than products on it cost as much.
        """
        whole = np.array(shape, dtype=np.int64)
        low, counts = np.zeros_like(whole), whole
        if touched is not None and len(touched):
            first, wide = places[touched].min(axis=0), np.ptp(places[touched], axis=0) + 1
            counts = np.minimum([_padded(int(count)) for count in wide], whole)
            low = np.clip(first - (counts - wide) // 2, 0, whole - counts)
        inside = ((places >= low) & (places < low + counts)).all(axis=1)
        nodes = np.flatnonzero(inside)
        at = np.ravel_multi_index(tuple((places[nodes] - low).T), tuple(counts))
        full = len(places) == np.prod(whole) and np.array_equal(
            np.ravel_multi_index(tuple(places.T), tuple(whole)), np.arange(len(places))
        )
        within = tuple(int(k) for k in whole) if full else None
        return cls(tuple(int(k) for k in low), tuple(int(k) for k in counts), nodes, at, within)

    def holds(self, places: NDArray[np.int64]) -> bool:
        """Return whether all of some places (k, axes) are in it."""
        low, high = places.min(axis=0, initial=self.low[0]), places.max(axis=0, initial=self.low[0])
        return bool((low >= self.low).all() and (high < np.array(self.low) + self.counts).all())

    def spread(self, values: Array) -> Array:
        """Return values of all nodes (m, n) in the box, zero where no node is (m, ...)."""
        if self.within is not None:
            cut = (slice(low, low + count) for low, count in zip(self.low, self.counts, strict=True))
            return values.reshape(-1, *self.within)[:, *cut].copy()
        found = np.zeros((len(values), int(np.prod(self.counts))), dtype=values.dtype)
        found[:, self.at] = values[:, self.nodes]
        return found.reshape(-1, *self.counts)

    def values(self, boxed: Array) -> Array:
        """Return what a box (m, ...) has at its nodes (m, k)."""
        flat = boxed.reshape(len(boxed), -1)
        return np.asarray(flat if self.within is not None else flat[:, self.at])


def _padded(count: int) -> int:
    """Return how many places along an axis cost no more than so many: transforms are of twice as many."""
    return (int(scipy.fft.next_fast_len(2 * count - 1, real=True)) + 1) // 2


class OnBox:
    """Products of several convolutions at once, on a box of places.

    Args:
        of: The convolutions, on one grid.
        box: Where pressures are, and gaps are asked for.
    """

    def __init__(self, of: Sequence[Convolution], box: Box) -> None:
        self.box, self.size = box, tuple(scipy.fft.next_fast_len(2 * k - 1, real=True) for k in box.counts)
        self._weights = box.spread(of[0].weights[None])[0]
        tables = {id(one.numbers): one for one in of}
        self._kernels = [self._transformed(one) for one in tables.values()]
        self._of = [np.array([k for k, one in enumerate(of) if id(one.numbers) == key]) for key in tables]
        local = [one.local for one in of if one.local is not None]
        self._local = box.spread(np.array(local)) if local else None
        self._smooth = [_Smooth([one.smooth[k] for one in of], box) for k in range(min(len(one.smooth) for one in of))]

    def numbers(self, of: Convolution) -> Array:
        """Return the table of a convolution over the distances within the box (2 b - 1, ...)."""
        cut = tuple(slice(m - b, m + b - 1) for m, b in zip(of.shape, self.box.counts, strict=True))
        return of.numbers[cut]

    def _transformed(self, of: Convolution) -> NDArray[np.complexfloating[Any, Any]]:
        return np.asarray(scipy.fft.rfftn(over_period(self.numbers(of), self.size)))

    def apply(self, x: Array) -> Array:
        """Return the gaps (m, ...) of pressures (m, ...) of each convolution, in the box."""
        force = x * self._weights
        found = self._convolved(force)
        for smooth in self._smooth:
            smooth.add(force, found)
        if self._local is not None:
            found += self._local * x
        return found

    def _convolved(self, force: Array) -> Array:
        """Return the products with the tables alone; as many at a time as stay in the cache."""
        counts, size, found = self.box.counts, self.size, np.empty_like(force)
        for kernel, of in zip(self._kernels, self._of, strict=True):
            for some in in_cache(len(of), kernel.nbytes):
                image = forward(force[of[some]], size)
                image *= kernel
                found[of[some]] = back(image, size, counts)
        return found


def in_cache(count: int, size: int) -> list[slice]:
    """Return runs of so many arrays of a size (bytes) that stay in the cache together."""
    step = max(CACHE // size, 1)
    return [slice(start, start + step) for start in range(0, count, step)]


def forward(fields: Array, size: Sequence[int]) -> NDArray[np.complexfloating[Any, Any]]:
    """Return the waves of fields (k, ...) over a box of at most that size; rows of zeros are not transformed."""
    image = scipy.fft.rfft(fields, size[-1], axis=-1)
    return np.asarray(scipy.fft.fft(image, size[0], axis=1, overwrite_x=True) if len(size) == 2 else image)


def back(image: NDArray[np.complexfloating[Any, Any]], size: Sequence[int], counts: Sequence[int]) -> Array:
    """Return the fields (k, ...) over a box of waves, which are overwritten."""
    if len(size) == 2:
        image = scipy.fft.ifft(image, axis=1, overwrite_x=True)[:, : counts[0]]
    return np.asarray(scipy.fft.irfft(image, size[-1], axis=-1, overwrite_x=True)[..., : counts[-1]])


def over_period(numbers: Array, size: Sequence[int]) -> Array:
    """Return numbers at all distances (..., 2 m - 1, ...) over a period, their zero distance first.

    Farther ones than half a period are left out. Half a period away both ways are one place, with the mean of both:
    without it the shortest waves would have next to nothing of what does not change along a line.
    """
    axes = len(size)
    for k, period in enumerate(size):
        axis = numbers.ndim - axes + k
        middle = numbers.shape[axis] // 2
        reach = min(middle, period // 2)
        lines = np.moveaxis(numbers, axis, 0)[middle - reach : middle + reach + 1]
        found: Array = np.zeros((period, *lines.shape[1:]))
        if 2 * reach == period:
            found[reach] = (lines[0] + lines[-1]) / 2
            lines, reach = lines[1:-1], reach - 1
        found[: reach + 1], found[period - reach :] = lines[reach:], lines[:reach]
        numbers = np.moveaxis(found, 0, axis)
    return numbers


class _Smooth:
    """The corrections of one body in several phases, on a box."""

    def __init__(self, parts: Sequence[tuple[TensorWeights, Array]], box: Box) -> None:
        factors = [weights.within(box.low, box.counts) for weights, _ in parts]
        self._factors = [np.array(own) for own in zip(*factors, strict=True)]  # of each axis (m, k, c)
        self._response = np.array([response for _, response in parts])

    def add(self, force: Array, to: Array) -> None:
        """Add the gaps of forces (m, ...) to others."""
        m = len(force)
        if len(self._factors) == 1:
            (one,) = self._factors
            points = np.einsum("mxa,mx->ma", one, force)
            to += np.einsum("mxa,ma->mx", one, np.einsum("mab,mb->ma", self._response, points))
            return
        first, second = self._factors
        points = first.transpose(0, 2, 1) @ (force @ second)
        moved = (self._response @ points.reshape(m, -1, 1)).reshape(points.shape)
        to += (first @ moved) @ second.transpose(0, 2, 1)


def convolution(
    bodies: Sequence[object],
    traction: Array,
    weights: Array,
    scale: float,
    known: dict[bytes, Array],
    local: Array | None = None,
) -> Convolution | None:
    """Return S of bodies on one grid; None where they are on none, or the traction differs from node to node.

    Args:
        bodies: Their operators.
        traction: On the punch by a unit pressure (n, d), and as much on the strip.
        weights: Areas of the nodes (n,).
        scale: A factor of S.
        known: Tables that were made, by the traction: they are the same in every place.
        local: What a layer between them closes by unit pressures (n,), mm/MPa; None for none.
    """
    operators = [body for body in bodies if isinstance(body, Convolving) and body.directions.shape[2] == 1]
    if len(operators) < len(bodies) or not len(traction) or np.ptp(traction, axis=0).any():
        return None
    force, places = scale * traction[0], operators[0].places
    if any(not np.array_equal(places, one.places) for one in operators[1:]):
        return None
    key = force.tobytes()
    if key not in known:
        known[key] = np.sum([one.table(force) for one in operators], axis=0)
    smooth = [part for one in operators if (part := one.smooth(force)) is not None]
    return Convolution(places, known[key], smooth, weights, None if local is None else scale * local)
