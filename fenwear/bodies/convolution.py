"""Forces and displacements on a regular grid: a convolution, and the correction of finite bodies.

    C_ij = T(x_i - x_j) + sum of L(x_i) R L(x_j)^T,

each a matrix of components: T is known at all distances of two nodes, L takes values at few points to the nodes, and R
is what forces at these points do. Products with T go by fast Fourier transforms.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from fenwear.algebra.tensor_interpolation import TensorWeights
from fenwear.common.arrays import Array, Nodes

SAME = 1e-9  # of tables: none
CACHE = 2**18  # bytes of waves that are transformed at a time
EVERY = slice(None)

Waves = NDArray[np.complexfloating[Any, Any]]
Kernel = dict[tuple[int, int], Waves]  # waves by components of displacement and force, where there are any
Smooth = tuple[TensorWeights, Array]  # L, and R (k, a, k, b)


@dataclass(frozen=True, eq=False)
class Convolution:
    """C on n nodes of a grid, of a components of displacement and b of force.

    Attributes:
        places: Whole numbers of each node along the axes of the grid, from 0 (n, axes).
        table: Displacements by unit forces at all distances of two nodes (a, b, 2 m - 1, ...), mm/N.
        smooth: L and R of each part that is smooth.
    """

    places: NDArray[np.int64]
    table: Array
    smooth: Sequence[Smooth] = ()

    @cached_property
    def counts(self) -> tuple[int, ...]:
        """Nodes along the axes of the grid."""
        return tuple((count + 1) // 2 for count in self.table.shape[2:])

    @cached_property
    def size(self) -> tuple[int, ...]:
        """The period of products."""
        return tuple(scipy.fft.next_fast_len(2 * count - 1, real=True) for count in self.counts)

    @cached_property
    def _kernel(self) -> Kernel:
        return kernel(self.table, self.size)

    def apply(self, forces: Array) -> Array:
        """Return the displacements (n, a, ...) of forces (n, b, ...)."""
        n, b, *rest = forces.shape
        flat = forces.reshape(n, b, -1)
        fields, at = np.zeros((flat.shape[2], b, *self.counts)), (EVERY, EVERY, *self.places.T)
        fields[at] = flat.transpose(2, 1, 0)
        displacements = convolved([(self._kernel, fields)], len(self.table), self.size)[at].transpose(2, 1, 0)
        for weights, response in self.smooth:
            moved = np.tensordot(response, weights.to_points(flat), ((2, 3), (0, 1)))
            displacements = displacements + weights.to_nodes(np.asarray(moved, dtype=np.float64))
        return np.asarray(displacements).reshape(n, -1, *rest)

    def entries(self, rows: Nodes, columns: Nodes) -> Array:
        """Return the displacements at some nodes from unit forces at others (rows, a, columns, b)."""
        strides = np.array([*self.table.shape[3:], 1])
        flat = self.places @ strides
        apart = flat[rows][:, None] - flat[columns] + (np.array(self.counts) - 1) @ strides
        displacements = self.table.reshape(*self.table.shape[:2], -1)[:, :, apart].transpose(2, 0, 3, 1)
        for weights, response in self.smooth:
            half = np.tensordot(weights.rows(rows), response, 1)
            displacements = displacements + np.moveaxis(np.tensordot(half, weights.rows(columns), (2, 1)), 3, 2)
        return np.asarray(displacements)

    def diagonal(self) -> Array:
        """Return the displacements at each node from unit forces at itself (n, a, b)."""
        middle = self.table.reshape(*self.table.shape[:2], -1)[..., math.prod(self.table.shape[2:]) // 2]
        displacements = np.broadcast_to(middle, (len(self.places), *middle.shape))
        for weights, response in self.smooth:
            displacements = displacements + weights.diagonal(response.transpose(0, 2, 1, 3))
        return np.asarray(displacements)

    def times(self, factor: float) -> Convolution:
        """Return the convolution times a factor."""
        smooth = [(weights, factor * response) for weights, response in self.smooth]
        return replace(self, table=factor * self.table, smooth=smooth)

    def on_box(self, low: Sequence[int], counts: Sequence[int], nodes: NDArray[np.int64]) -> Convolution:
        """Return the convolution on the nodes of a box of the grid.

        Args:
            low: Least place of the box along each axis.
            counts: Places along each axis.
            nodes: Numbers of the nodes in it (k,).
        """
        cut = (slice(m - b, m + b - 1) for m, b in zip(self.counts, counts, strict=True))
        places = self.places[nodes] - np.array(low)
        smooth = [(TensorWeights(at.within(low, counts), places), response) for at, response in self.smooth]
        return Convolution(places, self.table[:, :, *cut], smooth)


class GridOperator(ABC):
    """An operator of a body that is a convolution on a grid."""

    in_memory = False

    @property
    @abstractmethod
    def convolution(self) -> Convolution:
        """C along its directions, by forces along the model's axes."""

    def apply(self, forces: Array) -> Array:
        """Return the displacements (q, a, ...), mm, of forces (q, d, ...), N, in the plane N/mm."""
        return self.convolution.apply(forces)

    def entries(self, rows: Nodes, columns: Nodes) -> Array:
        """Return the displacements at nodes from unit forces at others (rows, a, columns, d)."""
        return self.convolution.entries(rows, columns)

    def diagonal(self) -> Array:
        """Return the displacements at each node from unit forces at itself (q, a, d)."""
        return self.convolution.diagonal()


def kernel(table: Array, size: Sequence[int]) -> Kernel:
    """Return the waves of tables (a, b, 2 m - 1, ...) over a period."""
    return by_components(scipy.fft.rfftn(over_period(table, size), axes=range(2, table.ndim)))


def by_components(waves: Waves) -> Kernel:
    """Return waves (a, b, ...) by their components, but for those that are zero."""
    sizes = np.abs(waves).reshape(*waves.shape[:2], -1).max(axis=2)
    return {(int(a), int(b)): waves[a, b].copy() for a, b in np.argwhere(sizes > SAME * sizes.max())}


def convolved(parts: Sequence[tuple[Kernel, Array]], count: int, size: Sequence[int]) -> Array:
    """Return the sum of kernels times fields (k, b, ...), `count` components of each (k, count, ...).

    As many fields at a time as stay in the cache. Components without forces are not transformed.

    Args:
        parts: The kernels, each with its fields.
        count: Components of displacement.
        size: The period of the kernels.
    """
    fields = parts[0][1]
    displacements = np.zeros((len(fields), count, *fields.shape[2:]))
    for some in in_cache(len(fields), 8 * int(np.prod(size))):
        moved = dict[int, Waves]()
        for waves, forces in parts:
            for b in range(forces.shape[1]):
                load = forces[some, b]
                if not load.any():
                    continue
                image = forward(load, size)
                for a in (a for a in range(count) if (a, b) in waves):
                    part = waves[a, b] * image
                    moved[a] = moved[a] + part if a in moved else part
        for a, image in moved.items():
            displacements[some, a] = back(image, size, fields.shape[2:])
    return displacements


def in_cache(count: int, size: int) -> list[slice]:
    """Return runs of so many arrays of a size (bytes) that stay in the cache together."""
    step = max(CACHE // size, 1)
    return [slice(start, start + step) for start in range(0, count, step)]


def forward(fields: Array, size: Sequence[int]) -> Waves:
    """Return the waves of fields (k, ...) over a box of at most that size; rows of zeros are not transformed."""
    image = scipy.fft.rfft(fields, size[-1], axis=-1)
    return np.asarray(scipy.fft.fft(image, size[0], axis=1, overwrite_x=True) if len(size) == 2 else image)


def back(image: Waves, size: Sequence[int], counts: Sequence[int]) -> Array:
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
        periodic: Array = np.zeros((period, *lines.shape[1:]))
        if 2 * reach == period:
            periodic[reach] = (lines[0] + lines[-1]) / 2
            lines, reach = lines[1:-1], reach - 1
        periodic[: reach + 1], periodic[period - reach :] = lines[reach:], lines[:reach]
        numbers = np.moveaxis(periodic, 0, axis)
    return numbers
