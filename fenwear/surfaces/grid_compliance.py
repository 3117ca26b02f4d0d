"""The compliance of two bodies on one grid: the convolutions of both, areas of nodes, and what lies between.

Where both answer on the nodes of the same regular grid, and the tractions of the unknowns are equal everywhere,

    S x = C w x + c x_0,

with C the sum of both bodies' convolutions, w the areas of the nodes, and c what a layer between the bodies closes
along e_n by a unit pressure. In gross sliding x is the pressure with its friction, and the gap is asked for; where
nodes stick x has a component along each axis of the contact frame.

So it is in any place of a strip that passes under the punch: half-spaces do not know where they are. Only the
corrections move.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from fenwear.bodies.convolution import (
    EVERY,
    SAME,
    Convolution,
    GridOperator,
    Kernel,
    Smooth,
    Waves,
    by_components,
    convolved,
    kernel,
    over_period,
)
from fenwear.common.arrays import Array, Nodes

T = TypeVar("T")
WASTE = 1.3  # of a box: how much larger than needed along an axis it may be
LEAST = 0.05  # of the symbol at its mean wave number: what a table cut off may leave of it
STIFF = 3.0, 20.0  # of tangents, over what a node's own traction moves it
MARGIN = {1: 2.0, 2: 1.0}  # of a line, of a rectangle: the period of what is inverted, which does not end


@dataclass(frozen=True, eq=False)
class GridCompliance:
    """S (a n, b n) on a grid, mm/MPa; vectors are of all components, one after the other.

    Attributes:
        of: C.
        weights: w (n,).
        local: c (n,).
    """

    of: Convolution
    weights: Array
    local: Array

    @cached_property
    def boxes(self) -> Boxes[FrameBox]:
        """The compliance on boxes of the grid, along all axes of a frame."""
        return Boxes(self.of.places, self.of.counts, lambda box: FrameBox(self, box))

    def apply(self, x: Array) -> Array:
        """Return the displacements (a n,) of tractions (b n,)."""
        parts = x.reshape(-1, len(self.weights))
        displacements = self.of.apply((parts * self.weights).T).T
        displacements[0] += self.local * parts[0]
        return displacements.ravel()

    def columns(self, nodes: Nodes, rows: Nodes = EVERY) -> Array:
        """Return the columns of some nodes (k, nodes), or some rows of them, of the first component."""
        columns = self.of.entries(rows, nodes)[:, 0, :, 0] * self.weights[nodes]
        every = np.arange(len(self.weights))
        i, j = np.equal.outer(every[rows], every[nodes]).nonzero()
        columns[i, j] += self.local[every[rows][i]]
        return columns

    def entries(self, rows: Nodes, columns: Nodes) -> Array:
        """Return the numbers of some rows and columns, of the first component."""
        return self.columns(columns, rows)

    def diagonal(self) -> Array:
        """Return the diagonal (a n,)."""
        diagonal = np.einsum("naa->an", self.of.diagonal()) * self.weights
        diagonal[0] += self.local
        return np.asarray(diagonal.ravel())

    def matrix(self) -> Array:
        """Return the compliance of the first component as one matrix (n, n)."""
        return self.columns(EVERY)


@dataclass(frozen=True, eq=False)
class Box:
    """A box of places of a grid.

    Attributes:
        low: Least place of the box along each axis.
        counts: Places along each axis.
        nodes: Numbers of the nodes in it (k,).
        at: Where they stand in it, its last axis the fastest (k,).
        within: Places of the whole grid, where all have a node, numbered with the last axis the fastest; else empty.
    """

    low: tuple[int, ...]
    counts: tuple[int, ...]
    nodes: NDArray[np.int64]
    at: NDArray[np.int64]
    within: tuple[int, ...] = ()

    @classmethod
    def around(cls, places: NDArray[np.int64], shape: Sequence[int], touched: Nodes = EVERY) -> Box:
        """Return a box as wide as some of the places (n, axes) of a grid of that shape ask for, by default all.

        No narrower than products on it cost as much.
        """
        sizes = np.array(shape, dtype=np.int64)
        first, wide = places[touched].min(axis=0), np.ptp(places[touched], axis=0) + 1
        counts = np.minimum([_padded(int(count)) for count in wide], sizes)
        low = np.clip(first - (counts - wide) // 2, 0, sizes - counts)
        nodes = np.flatnonzero(((places >= low) & (places < low + counts)).all(axis=1))
        at = np.ravel_multi_index(tuple((places[nodes] - low).T), tuple(counts))
        numbers = np.ravel_multi_index(tuple(places.T), tuple(sizes))
        full = len(places) == np.prod(sizes) and np.array_equal(numbers, np.arange(len(places)))
        corner, sides = (tuple(int(coordinate) for coordinate in each) for each in (low, counts))
        return cls(corner, sides, nodes, at, tuple(int(side) for side in shape) if full else ())

    @property
    def size(self) -> int:
        """Number of places."""
        return int(np.prod(self.counts))

    def holds(self, places: NDArray[np.int64]) -> bool:
        """Return whether all of some places (k, axes) are in it."""
        return bool(((places >= self.low) & (places < np.array(self.low) + self.counts)).all())

    def where(self, places: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the numbers of places (k, axes) in the box, its last axis the fastest (k,)."""
        return np.asarray(np.ravel_multi_index(tuple((places - np.array(self.low)).T), self.counts))

    def spread(self, values: Array) -> Array:
        """Return values of all nodes (m, n) in the box, zero where no node is (m, ...)."""
        if self.within:
            cut = (slice(low, low + count) for low, count in zip(self.low, self.counts, strict=True))
            return values.reshape(-1, *self.within)[:, *cut].copy()
        in_box = np.zeros((len(values), self.size), dtype=values.dtype)
        in_box[:, self.at] = values[:, self.nodes]
        return in_box.reshape(-1, *self.counts)

    def values(self, boxed: Array) -> Array:
        """Return the values of a box (m, ...) at its nodes (m, k)."""
        flat = boxed.reshape(len(boxed), -1)
        return np.asarray(flat if self.within else flat[:, self.at])


def _padded(count: int) -> int:
    """Return the most places along an axis at the cost of this number: transforms take twice as many."""
    return (int(scipy.fft.next_fast_len(2 * count - 1, real=True)) + 1) // 2


class Boxes(Generic[T]):
    """Parts of boxes of a grid; the last one is kept as long as it is not much too large.

    Args:
        places: Of the nodes (n, axes).
        shape: Of the grid.
        make: Makes it of a box.
    """

    def __init__(self, places: NDArray[np.int64], shape: Sequence[int], make: Callable[[Box], T]) -> None:
        self.places, self._shape, self._make = places, shape, make
        self._last: list[tuple[Box, T]] = []

    @cached_property
    def of_all(self) -> T:
        """That of all nodes."""
        return self._make(Box.around(self.places, self._shape))

    def around(self, touched: NDArray[np.int64]) -> T:
        """Return the value of a box around some nodes."""
        places = self.places[touched]
        wide = np.ptp(places, axis=0) + 1
        largest = np.maximum(WASTE * wide, wide + 4)
        if not any(last.holds(places) and (np.array(last.counts) <= largest).all() for last, _ in self._last):
            box = Box.around(self.places, self._shape, touched)
            self._last = [(box, self._make(box))]
        return self._last[0][1]


class OnBox:
    """Products of several compliances at once, on a box of places.

    Args:
        of: The compliances, on one grid.
        box: Where tractions are, and displacements are asked for.
    """

    def __init__(self, of: Sequence[GridCompliance], box: Box) -> None:
        parts = [compliance.of.on_box(box.low, box.counts, box.nodes) for compliance in of]
        self.box, self.size, self.of = box, parts[0].size, parts
        self.largest = float(of[0].weights.max())
        self._weights, self.local = (
            box.spread(of[0].weights[None])[0],
            box.spread(np.array([compliance.local for compliance in of])),
        )
        tables = {id(compliance.of.table): part for compliance, part in zip(of, parts, strict=True)}
        self._kernels = [
            (
                np.array([k for k, compliance in enumerate(of) if id(compliance.of.table) == key]),
                kernel(part.table, part.size),
            )
            for key, part in tables.items()
        ]
        self._smooth = [
            _Smooth([compliance.smooth[k] for compliance in parts])
            for k in range(min(len(compliance.smooth) for compliance in parts))
        ]

    def apply(self, x: Array) -> Array:
        """Return the displacements (m, a, ...) of tractions (m, b, ...) of each compliance, in the box."""
        force = x * self._weights
        displacements = np.empty((len(x), len(self.of[0].table), *self.box.counts))
        for numbers, waves in self._kernels:
            displacements[numbers] = convolved([(waves, force[numbers])], displacements.shape[1], self.size)
        for smooth in self._smooth:
            smooth.add(force, displacements)
        displacements[:, 0] += self.local * x[:, 0]
        return displacements


class _Smooth:
    """Additional response of one body in several phases, on a box."""

    def __init__(self, parts: Sequence[Smooth]) -> None:
        m = len(parts)
        factors = [
            np.array(factor_parts) for factor_parts in zip(*(weights.factors for weights, _ in parts), strict=True)
        ]
        self._first, self._second = (*factors, np.ones((m, 1, 1)))[:2]  # of each axis (m, 1, k, c)
        self._first, self._second = self._first[:, None], self._second[:, None]
        between = np.array([response for _, response in parts]).transpose(0, 2, 1, 4, 3)
        self._between = between.reshape(m, between.shape[1] * between.shape[2], -1)

    def add(self, force: Array, to: Array) -> None:
        """Add the displacements (m, a, ...) by forces (m, b, ...) to others."""
        m, b, first, *_ = force.shape
        points = self._first.swapaxes(2, 3) @ force.reshape(m, b, first, -1) @ self._second
        moved = (self._between @ points.reshape(m, -1, 1)).reshape(m, -1, *points.shape[2:])
        to += (self._first @ moved @ self._second.swapaxes(2, 3)).reshape(to.shape)


class FrameBox(OnBox):
    """The compliance along all axes of one contact frame on a box, and its inverse.

    Args:
        of: The compliance.
        box: The box.
    """

    def __init__(self, of: GridCompliance, box: Box) -> None:
        super().__init__([of], box)
        self.d, self.counts = len(of.of.table), box.counts
        self._own = of.diagonal().reshape(self.d, -1)[1:].mean()

    def products(self, fields: Array) -> Array:
        """Return the displacements (d, ...) of tractions (d, ...)."""
        return self.apply(fields[None])[0]

    @cached_property
    def _endless(self) -> tuple[tuple[int, ...], Waves]:
        """The period and the symbol (..., d, d) of an endless grid."""
        margin, table = MARGIN[len(self.counts)], self.of[0].table
        period = tuple(scipy.fft.next_fast_len(int(margin * count) + 2, real=True) for count in self.counts)
        waves = scipy.fft.rfftn(over_period(table, period), axes=range(2, table.ndim)) * self.largest
        symbol = np.moveaxis(waves, (0, 1), (-2, -1))
        symbol[..., 0, 0] += float(self.box.values(self.local).mean())
        symbol = (symbol + symbol.conj().swapaxes(-2, -1)) / 2
        size, axes = np.linalg.eigh(symbol)
        size = np.maximum(size, LEAST * np.median(np.abs(size)))
        return period, (axes * size[..., None, :]) @ axes.conj().swapaxes(-2, -1)

    @cached_property
    def _inverses(self) -> list[Kernel]:
        """The waves of the inverse, and of those with the additional compliance of each of `STIFF`."""
        inverses = []
        for stiff in (0.0, *STIFF):
            symbol, tangents = self._endless[1].copy(), range(1, self.d)
            symbol[..., tangents, tangents] += stiff * self._own
            inverses.append(by_components(np.moveaxis(np.linalg.inv(symbol), (-2, -1), (0, 1))))
        return inverses

    def solve(self, fields: Array, stiff: Array) -> Array:
        """Return the tractions (d, ...) of displacements on an endless grid.

        Each wave by itself; restricted to nodes in contact, near what these have.

        Args:
            fields: Without additional compliance (d, ...).
            stiff: Where tangents do, by each of `STIFF` (k, d, ...).
        """
        parts = [(waves, part[None]) for waves, part in zip(self._inverses, (fields, *stiff), strict=True)]
        return convolved(parts, self.d, self._endless[0])[0]


def on_one_grid(
    bodies: Sequence[object], axes: Array, traction: Array, weights: Array, local: Array, known: dict[bytes, Array]
) -> GridCompliance | None:
    """Return S of bodies on one grid; None where they are on none, or axes or tractions differ from node to node.

    Args:
        bodies: Their operators.
        axes: That displacements are asked for along (n, a, d).
        traction: On the punch by units of the unknowns (n, d, b), and as much on the strip.
        weights: Areas of the nodes (n,).
        local: Closure of a layer between them by unit pressures (n,), scaled as the tractions are.
        known: Tables that were made, by the traction: they are the same in every place.
    """
    operators = [body.convolution for body in bodies if isinstance(body, GridOperator)]
    if len(operators) < len(bodies) or not len(weights) or not (_even(axes) and _even(traction)):
        return None
    if any(not np.array_equal(operators[0].places, operator.places) for operator in operators[1:]):
        return None
    along, force = axes[0], traction[0]
    # e_n is all that they are asked for along
    bare = len(along) == 1 and all(len(operator.table) == 1 for operator in operators)
    seen = np.ones((1, 1)) if bare else along
    if any(len(operator.table) != seen.shape[1] for operator in operators):
        return None
    key = force.tobytes()
    if key not in known:
        summed = np.sum([operator.table for operator in operators], axis=0)
        known[key] = np.ascontiguousarray(np.tensordot(seen, np.tensordot(force.T, summed, (1, 1)), (1, 1)))
    smooth = [
        (points, np.einsum("ac,kcle,eb->kalb", seen, response, force, optimize=True))
        for operator in operators
        for points, response in operator.smooth
    ]
    return GridCompliance(Convolution(operators[0].places, known[key], smooth), weights, local)


def _even(values: Array) -> bool:
    """Return whether values (n, ...) are the same at all nodes."""
    return bool(np.abs(values - values[0]).max() <= SAME)
