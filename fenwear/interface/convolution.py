"""The compliance of two bodies on one grid: one convolution, and what finite bodies do besides.

Where both answer on the nodes of the same regular grid, and the traction that goes with a unit pressure is the same
everywhere, S is a table of one number for each distance of two nodes, and a correction on a few points for each body:

    S_ij = w_j (T(x_i - x_j) + sum over the bodies of L(x_i) C L(x_j)^T).

So it is in any place of a strip that passes under the punch: half-spaces do not know where they are. Only the
correction moves.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from fenwear.arrays import Array, Nodes

TRANSFORM = 85.0  # numbers that memory could give while one is transformed, there and back over two (measured)
EVERY = slice(None)


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

    def smooth(self, traction: Array) -> tuple[Array, Array] | None:
        """Return values at points to the nodes (q, k), and what forces along it at points do (k, k); None for none."""


class Convolution:
    """S (n, n) on a grid, mm/MPa.

    Args:
        places: Whole numbers of each node along the axes of the grid (n, d - 1).
        table: Gap by a unit force at all distances of two nodes (2 m - 1, ...), mm/N, scaled.
        smooth: L (n, k) and C (k, k) of each body that has a correction.
        weights: w (n,).
    """

    def __init__(
        self, places: NDArray[np.int64], table: Array, smooth: Sequence[tuple[Array, Array]], weights: Array
    ) -> None:
        self.places, self.numbers, self.smooth, self.weights = places, table, list(smooth), weights
        self.shape = tuple((count + 1) // 2 for count in table.shape)

    @property
    def cost(self) -> float:
        """Of a product, in numbers that memory could give meanwhile."""
        over = TRANSFORM * 2.0 ** len(self.shape) / 4 * 2 * float(np.prod(self.shape))
        return over + sum(2.0 * points.size for points, _ in self.smooth)

    @cached_property
    def whole(self) -> OnBox:
        """Its products on all nodes."""
        return OnBox([self], np.arange(len(self.weights)))

    def apply(self, x: Array) -> Array:
        """Return the gaps (n,) of pressures (n,)."""
        return self.whole.apply(x[None])[0]

    def entries(self, rows: Nodes, columns: Nodes) -> Array:
        """Return the numbers of some rows and columns."""
        apart = self.places[rows][:, None] - self.places[columns] + np.array(self.shape) - 1
        found = self.numbers[tuple(np.moveaxis(apart, -1, 0))]
        for points, response in self.smooth:
            found = found + (points[rows] @ response) @ points[columns].T
        return np.asarray(found * self.weights[columns])

    def columns(self, nodes: Nodes, rows: Nodes = EVERY) -> Array:
        """Return the columns of some nodes (n, k), or some rows of them."""
        return self.entries(rows, nodes)

    def diagonal(self) -> Array:
        """Return the diagonal (n,)."""
        found = np.full(len(self.weights), self.numbers[tuple(count - 1 for count in self.shape)])
        for points, response in self.smooth:
            found += np.einsum("nk,nk->n", points @ response, points)
        return np.asarray(found * self.weights)

    def matrix(self) -> Array:
        """Return all of it (n, n)."""
        return self.entries(EVERY, EVERY)


class OnBox:
    """Products of several convolutions at once, on nodes of a grid alone and no wider than these.

    Args:
        of: The convolutions, on one grid.
        nodes: Numbers of the nodes (k,).
    """

    def __init__(self, of: Sequence[Convolution], nodes: NDArray[np.int64]) -> None:
        places = of[0].places[nodes]
        low = places.min(axis=0)
        self.at = tuple((places - low).T)
        self.box = tuple(int(count) for count in np.ptp(places, axis=0) + 1)
        self.size = tuple(scipy.fft.next_fast_len(2 * count - 1, real=True) for count in self.box)
        self._axes = tuple(range(1, len(self.box) + 1))
        self._weights = of[0].weights[nodes]
        same = all(one.numbers is of[0].numbers for one in of)
        self._kernels = np.array([self._transformed(one) for one in ([of[0]] if same else of)])
        self._smooth = [[(points[nodes], response) for points, response in one.smooth] for one in of]

    def numbers(self, of: Convolution) -> Array:
        """Return the table of a convolution over the distances within the box (2 b - 1, ...)."""
        cut = tuple(slice(m - b, m + b - 1) for m, b in zip(of.shape, self.box, strict=True))
        return of.numbers[cut]

    def _transformed(self, of: Convolution) -> NDArray[np.complex128]:
        wrapped = np.zeros(self.size)
        to = np.ix_(*(np.arange(1 - b, b) % size for b, size in zip(self.box, self.size, strict=True)))
        wrapped[to] = self.numbers(of)
        return np.asarray(scipy.fft.rfftn(wrapped))

    def apply(self, x: Array) -> Array:
        """Return the gaps (m, k) of pressures (m, k) of each convolution."""
        grid = np.zeros((len(x), *self.box))
        force = x * self._weights
        grid[(slice(None), *self.at)] = force
        image = scipy.fft.rfftn(grid, self.size, axes=self._axes)
        image *= self._kernels
        found: Array = scipy.fft.irfftn(image, self.size, axes=self._axes, overwrite_x=True)[(slice(None), *self.at)]
        for k, smooth in enumerate(self._smooth):
            for points, response in smooth:
                found[k] += points @ (response @ (force[k] @ points))
        return found


def convolution(
    bodies: Sequence[object], traction: Array, weights: Array, scale: float, known: dict[bytes, Array]
) -> Convolution | None:
    """Return S of bodies on one grid; None where they are on none, or the traction differs from node to node.

    Args:
        bodies: Their operators.
        traction: On the punch by a unit pressure (n, d), and as much on the strip.
        weights: Areas of the nodes (n,).
        scale: A factor of S.
        known: Tables that were made, by the traction: they are the same in every place.
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
    return Convolution(places, known[key], smooth, weights)
