"""A contact surface of its own: a regular grid in the tangent plane, whatever the mesh below it is.

Nodes of it stand in the plane in which the bodies touch first; how deep the body's surface lies below each is the
profile that opens the gap. Forces on it act along the plane's normal and in the plane, as in the theory of Hertz: what
the slope of a curved surface changes is of the order of the square of contact width over radius.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, identity, kron

from fenwear.common.arrays import Array

SNAP = 1e-9  # of a spacing: rounding of a place


@dataclass(frozen=True)
class RegularGrid:
    """Nodes at even distances in a plane across an axis, in the plane along a line.

    Attributes:
        corner: Least coordinates along the axes of the grid (d - 1,), mm.
        spacing: mm (d - 1,).
        counts: Nodes along these axes (d - 1,).
        normal: The model's axis across the grid.
        level: Where it stands along that, mm.
    """

    corner: tuple[float, ...]
    spacing: tuple[float, ...]
    counts: tuple[int, ...]
    normal: int
    level: float

    @property
    def axes(self) -> list[int]:
        """The model's axes along the grid."""
        return [axis for axis in range(len(self.counts) + 1) if axis != self.normal]

    @property
    def sides(self) -> Array:
        """Extents of the grid (d - 1,), mm."""
        return np.array(self.spacing) * (np.array(self.counts) - 1)

    @property
    def middle(self) -> Array:
        """Middle of the grid (d - 1,), mm."""
        return np.array(self.corner) + self.sides / 2

    @property
    def numbers(self) -> Array:
        """Corner, spacing and counts (3, d - 1): all that grids of one plane differ by."""
        return np.array([self.corner, self.spacing, self.counts])

    def with_numbers(self, numbers: Array) -> RegularGrid:
        """Return the grid of this plane with other ones."""
        corner, spacing, counts = (tuple(float(number) for number in row) for row in numbers)
        return replace(self, corner=corner, spacing=spacing, counts=tuple(int(count) for count in counts))

    @cached_property
    def flat(self) -> Array:
        """Coordinates of the nodes along the grid (n, d - 1), mm, the first axis the slowest."""
        along = [low + step * np.arange(k) for low, step, k in zip(self.corner, self.spacing, self.counts, strict=True)]
        return np.stack(np.meshgrid(*along, indexing="ij"), axis=-1).reshape(-1, len(along))

    @cached_property
    def points(self) -> Array:
        """Coordinates of the nodes (n, d), mm."""
        return np.insert(self.flat, self.normal, self.level, axis=1)

    @cached_property
    def weights(self) -> Array:
        """Part of the plane that belongs to each node (n,), mm or mm²: half as much on the rim."""
        product = np.ones(1)
        for step, count in zip(self.spacing, self.counts, strict=True):
            on_axis = np.full(count, step)
            on_axis[[0, -1]] /= 2
            product = np.multiply.outer(product, on_axis).ravel()
        return product

    @property
    def places(self) -> NDArray[np.int64]:
        """Whole numbers of the nodes along its axes (n, d - 1), from 0."""
        return np.indices(self.counts).reshape(len(self.counts), -1).T

    def of_other(self, other: RegularGrid) -> NDArray[np.int64]:
        """Return the node of another grid, as fine or finer, at the place of each node here (n,); -1 for none.

        Args:
            other: A grid whose lines go through all nodes here that it reaches.
        """
        numbers: NDArray[np.int64] = np.zeros(1, dtype=np.int64)
        for k, count in enumerate(other.counts):
            away = self.corner[k] + self.spacing[k] * np.arange(self.counts[k]) - other.corner[k]
            at = np.rint(away / other.spacing[k]).astype(np.int64)
            within = (at >= 0) & (at < count)
            known = np.logical_and.outer(numbers >= 0, within)
            numbers = np.where(known, np.add.outer(numbers * count, at), -1).ravel()
        return numbers

    def thinned(self, every: int, less: int = 0) -> RegularGrid:
        """Return a grid of every so manieth node of this one, in its middle as far as there is one.

        Args:
            every: Ratio of the node spacings.
            less: Spacings that it ends before this one at each end.
        """
        left = [(count - 1) % every // 2 + less * every for count in self.counts]
        return replace(
            self,
            corner=tuple(low + k * step for low, k, step in zip(self.corner, left, self.spacing, strict=True)),
            spacing=tuple(every * step for step in self.spacing),
            counts=tuple((count - 1) // every + 1 - 2 * less for count in self.counts),
        )

    def holds(self, other: RegularGrid) -> bool:
        """Return whether another grid in its plane reaches no further, a coarser one than to its next whole spacing."""
        low, high, spacing = np.array(self.corner), np.array(other.corner), np.array(other.spacing)
        apart = np.where(spacing > (1 + SNAP) * np.array(self.spacing), spacing, SNAP * self.sides)
        within = (high >= low - apart).all() and (high + other.sides <= low + self.sides + apart).all()
        return bool(within and self.normal == other.normal)

    @property
    def facets(self) -> NDArray[np.int64]:
        """Nodes of each interval or square, in the order of basix (f, 2 or 4)."""
        number = np.arange(int(np.prod(self.counts))).reshape(self.counts)
        if number.ndim == 1:
            return np.stack([number[:-1], number[1:]], axis=1)
        corners = (number[:-1, :-1], number[1:, :-1], number[:-1, 1:], number[1:, 1:])
        return np.stack(corners, axis=-1).reshape(-1, 4)

    def sharing(self, other: RegularGrid) -> csr_array:
        """Return the matrix from forces at another grid's nodes to these (n, n_other), with their sum and moment.

        Forces beyond this grid move to its rim, without their moment.
        """
        points = [
            np.clip((low + step * np.arange(count) - first) / other_step, 0, last - 1)
            for low, step, count, first, other_step, last in zip(
                other.corner, other.spacing, other.counts, self.corner, self.spacing, self.counts, strict=True
            )
        ]
        return csr_array(self._linear(points).T)

    def reading(self, to: RegularGrid, shift: Array) -> csr_array | None:
        """Return the matrix from values here to the nodes of another grid (n_to, n), linear between nodes.

        Args:
            to: Another grid, whose axes are the same.
            shift: By how much this one is moved (d - 1,), mm.

        Returns:
            None where the other one reaches beyond this one.
        """
        points = [
            (to.corner[k] - self.corner[k] - shift[k] + to.spacing[k] * np.arange(to.counts[k])) / step
            for k, step in enumerate(self.spacing)
        ]
        reach = zip(points, self.counts, strict=True)
        if any(at.min() < -SNAP * count or at.max() > count - 1 + SNAP * count for at, count in reach):
            return None
        return self._linear(points)

    def _linear(self, points: list[Array]) -> csr_array:
        """Return the matrix to the crossings of points on each axis, in spacings, linear between nodes."""
        matrix = identity(1, format="csr")
        for at, count in zip(points, self.counts, strict=True):
            near = np.rint(at)
            snapped = np.where(np.abs(at - near) < SNAP * count, near, at)
            low = np.minimum(np.floor(snapped).astype(np.int64), max(count - 2, 0))
            share, rows = snapped - low, np.arange(len(at))
            entries = (np.concatenate([1 - share, share]), (np.tile(rows, 2), np.concatenate([low, low + 1])))
            on_axis = csr_array(entries, shape=(len(at), count))
            on_axis.eliminate_zeros()
            matrix = kron(matrix, on_axis, format="csr")
        return csr_array(matrix)
