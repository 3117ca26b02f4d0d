"""The compliance of two bodies along all axes of one contact grid: convolutions, and what finite bodies do besides.

As `convolution` has it for one traction that goes with a pressure, here with a table for each pair of components,

    C f = sum over components b of (T_ab(x_i - x_j) + sum over the bodies of L(x_i) C_ab L(x_j)^T) w_j f_jb + c_i p_i,

in the one contact frame that all nodes of a grid have. Bodies of like materials have no table between normal and
tangential components, and nothing is transformed for it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol, runtime_checkable

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.bodies.tensor import TensorWeights
from fenwear.interface.convolution import back, forward, over_period

SAME = 1e-9  # of a frame: one frame; of tables: none
LEAST = 0.05  # of the symbol at its mean wave number: what a table cut off may leave of it
WASTE = 1.3  # of a box: how much larger than needed along an axis it may be
STIFF = 3.0, 20.0  # of tangents, over what a node's own traction moves it
MARGIN = {1: 2.0, 2: 1.0}  # of a line, of a rectangle: the period of what is inverted, which does not end
Waves = NDArray[np.complexfloating[Any, Any]]
Mixed = tuple[TensorWeights, Array]  # L, and what forces at points do along each axis (k, a, k, d)


@runtime_checkable
class ConvolvingAlongAxes(Protocol):
    """An operator that is a convolution along all axes on a grid, and smooth besides."""

    @property
    def places(self) -> NDArray[np.int64]:
        """Whole numbers of each node along the axes of the grid (q, d - 1)."""

    @property
    def tables(self) -> Array:
        """Displacements by unit forces at all distances of two nodes (2 m - 1, ..., d, d), mm."""

    @property
    def mixed(self) -> Mixed | None:
        """Values at points to the nodes, and what forces at points do (k, d, k, d); None for none."""


@dataclass(frozen=True, eq=False)
class FrameConvolution:
    """C on a grid in one frame, mm/MPa.

    Vectors are of all components, one after the other (d n,); fields on the grid (d, m, ...).

    Attributes:
        at: Where each node stands in the grid, its last axis the fastest (n,).
        counts: Nodes along the axes of the grid.
        table: Displacement of component a by a unit force along b at all distances (d, d, 2 m - 1, ...), mm/N.
        smooth: L and C (d, k, d, k) of each body that has a correction.
        weights: w (n,).
        local: c (n,), mm/MPa; None for none.
    """

    at: NDArray[np.int64]
    counts: tuple[int, ...]
    table: Array
    smooth: Sequence[tuple[TensorWeights, Array]]
    weights: Array
    local: Array | None = None

    @property
    def d(self) -> int:
        """Components."""
        return len(self.table)

    @cached_property
    def pairs(self) -> list[list[int]]:
        """Which components displace along each."""
        size = np.abs(self.table).reshape(self.d, self.d, -1).max(axis=2)
        return [[b for b in range(self.d) if row[b] > SAME * size.max()] for row in size]

    @cached_property
    def _size(self) -> tuple[int, ...]:
        return tuple(scipy.fft.next_fast_len(2 * count - 1, real=True) for count in self.counts)

    def kernel(self, size: Sequence[int]) -> Waves:
        """Return the waves of the tables over a period."""
        return np.asarray(scipy.fft.rfftn(over_period(self.table, size), axes=range(2, 2 + len(size))))

    @cached_property
    def _waves(self) -> Waves:
        return self.kernel(self._size)

    def spread(self, values: Array) -> Array:
        """Return values at the nodes (..., n) on the grid, zero where no node is (..., m, ...)."""
        found = np.zeros((*values.shape[:-1], int(np.prod(self.counts))), dtype=values.dtype)
        found[..., self.at] = values
        return found.reshape(*values.shape[:-1], *self.counts)

    def values(self, fields: Array) -> Array:
        """Return fields on the grid (..., m, ...) at the nodes (..., n)."""
        lead = fields.shape[: fields.ndim - len(self.counts)]
        return np.asarray(fields.reshape(*lead, -1)[..., self.at])

    @cached_property
    def _areas(self) -> Array:
        return self.spread(self.weights)

    @cached_property
    def _factors(self) -> list[tuple[tuple[Array, ...], Array]]:
        zero = (0,) * len(self.counts)
        return [(weights.within(zero, self.counts), response) for weights, response in self.smooth]

    def apply(self, traction: Array) -> Array:
        """Return the displacements (d n,) of tractions (d n,)."""
        return self.values(self.on_grid(self.spread(traction.reshape(self.d, -1)))).ravel()

    def on_grid(self, fields: Array) -> Array:
        """Return the displacements (d, m, ...) of tractions (d, m, ...)."""
        force = fields * self._areas
        found = self.through([(self._waves, force, range(self.d))], self._size)
        if not force.any():
            return found
        for factors, response in self._factors:
            self._add(factors, response, force, found)
        if self.local is not None:
            found[0] += self.spread(self.local) * fields[0]
        return found

    def through(self, parts: Sequence[tuple[Waves, Array, Sequence[int]]], size: Sequence[int]) -> Array:
        """Return what waves make of fields over a period (d, m, ...), all of them added: of what acts on each other.

        Args:
            parts: Waves, of component a by component b, where `pairs` has them (d, d, ...); and fields (k, m, ...) of
                these components.
            size: The period.
        """
        found: Array = np.zeros((self.d, *self.counts))
        moved = dict[int, Waves]()
        for waves, fields, components in parts:
            acting = [k for k, field in enumerate(fields) if field.any()]
            if not acting:
                continue
            image = forward(fields if len(acting) == len(fields) else fields[acting], size)
            for k, wave in zip(acting, image, strict=True):
                for a in range(self.d):
                    b = components[k]
                    if b not in self.pairs[a]:
                        continue
                    if a in moved:
                        moved[a] += waves[a, b] * wave
                    else:
                        moved[a] = waves[a, b] * wave
        if moved:
            found[list(moved)] = back(np.array(list(moved.values())), size, self.counts)
        return found

    def _add(self, factors: tuple[Array, ...], response: Array, force: Array, to: Array) -> None:
        """Add the displacements of forces by a correction."""
        points = factors[0].T @ (force if len(factors) == 1 else force @ factors[1]).reshape(self.d, self.counts[0], -1)
        size = self.d * points[0].size
        moved = (response.reshape(size, size) @ points.ravel()).reshape(points.shape)
        spread = factors[0] @ moved
        to += spread[..., 0] if len(factors) == 1 else spread @ factors[1].T

    def around(self, nodes: NDArray[np.int64]) -> tuple[FrameConvolution, NDArray[np.int64]]:
        """Return the same on a box that holds some nodes, the last one if it does, and where these stand in it."""
        places = np.stack(np.unravel_index(self.at, self.counts), axis=1)
        low, high = places[nodes].min(axis=0), places[nodes].max(axis=0) + 1
        last: _Box | None = self.__dict__.get("_box")
        if last is None or not last.fits(low, high):
            box = _Box.around(low, high, self.counts)
            inside = np.flatnonzero(((places >= box.low) & (places < box.low + box.sides)).all(axis=1))
            cut = tuple(slice(m - b, m + b - 1) for m, b in zip(self.counts, box.sides, strict=True))
            corner, sides = ([int(k) for k in one] for one in (box.low, box.sides))
            smooth = [
                (TensorWeights(points.within(corner, sides), points.at[inside] - box.low), response)
                for points, response in self.smooth
            ]
            on = FrameConvolution(
                np.ravel_multi_index(tuple((places[inside] - box.low).T), tuple(box.sides)),
                tuple(int(side) for side in box.sides),
                np.ascontiguousarray(self.table[(slice(None), slice(None), *cut)]),
                smooth,
                self.weights[inside],
                None if self.local is None else self.local[inside],
            )
            last = self.__dict__["_box"] = replace(box, on=on)
        assert last.on is not None
        return last.on, np.ravel_multi_index(tuple((places[nodes] - last.low).T), last.on.counts)

    @cached_property
    def diagonal(self) -> Array:
        """The diagonal (d n,)."""
        middle = tuple(count - 1 for count in self.counts)
        found = np.array([np.full(len(self.weights), self.table[(a, a, *middle)]) for a in range(self.d)])
        for points, response in self.smooth:
            found += np.array([points.diagonal(response[a, :, a]) for a in range(self.d)])
        found *= self.weights
        if self.local is not None:
            found[0] += self.local
        return found.ravel()

    @cached_property
    def endless(self) -> EndlessFrame:
        """Its inverse on an endless grid."""
        return EndlessFrame(self)


@dataclass(frozen=True)
class _Box:
    """A box of a grid: its least places and its sides, and the compliance on it."""

    low: NDArray[np.int64]
    sides: NDArray[np.int64]
    on: FrameConvolution | None = None

    @classmethod
    def around(cls, low: NDArray[np.int64], high: NDArray[np.int64], counts: Sequence[int]) -> _Box:
        """Return a box around places that costs no more than the least one."""
        wide = [int(scipy.fft.next_fast_len(2 * int(side) - 1, real=True) + 1) // 2 for side in high - low]
        sides = np.minimum(np.array(wide, dtype=np.int64), counts)
        return cls(np.clip(low - (sides - (high - low)) // 2, 0, np.array(counts) - sides), sides)

    def fits(self, low: NDArray[np.int64], high: NDArray[np.int64]) -> bool:
        """Return whether it holds places, and is not much larger."""
        holds = (low >= self.low).all() and (high <= self.low + self.sides).all()
        return bool(holds and (self.sides <= np.maximum(WASTE * (high - low), high - low + 4)).all())


class EndlessFrame:
    """The inverse of C on an endless grid: each wave by itself; restricted to nodes in contact, near what these have.

    It is known with tangents that give way besides, too, by `STIFF` times what a node's own traction moves it.

    Args:
        of: The compliance.
    """

    def __init__(self, of: FrameConvolution) -> None:
        self.of, margin = of, MARGIN[len(of.counts)]
        self.period = tuple(scipy.fft.next_fast_len(int(margin * count) + 2, real=True) for count in of.counts)
        symbol = np.moveaxis(of.kernel(self.period), (0, 1), (-2, -1)) * float(of.weights.max())
        if of.local is not None:
            symbol[..., 0, 0] += float(of.local.mean())
        symbol = (symbol + symbol.conj().swapaxes(-2, -1)) / 2
        size, axes = np.linalg.eigh(symbol)
        size = np.maximum(size, LEAST * np.median(np.abs(size)))
        self._symbol = (axes * size[..., None, :]) @ axes.conj().swapaxes(-2, -1)
        self._inverses: dict[float, Waves] = {}

    def _inverse(self, stiff: float) -> Waves:
        """Return the waves of the inverse where tangents give way besides."""
        if stiff not in self._inverses:
            symbol, tangents = self._symbol.copy(), range(1, self.of.d)
            own = float(self.of.diagonal.reshape(self.of.d, -1)[1:].mean())
            symbol[..., tangents, tangents] += stiff * own
            inverse = np.moveaxis(np.linalg.inv(symbol), (-2, -1), (0, 1))
            self._inverses[stiff] = np.ascontiguousarray(inverse)
        return self._inverses[stiff]

    def solve(self, fields: Array, *stiff: Array | None) -> Array:
        """Return the tractions (d, m, ...) of displacements (d, m, ...).

        Args:
            fields: Where nothing gives way besides.
            stiff: Along the tangents (d - 1, m, ...) where they do, of each of `STIFF`; None for nowhere.
        """
        parts = [(self._inverse(0.0), fields, range(self.of.d))]
        for size, own in zip(STIFF, stiff, strict=False):
            if own is not None:
                parts.append((self._inverse(size), own, range(1, self.of.d)))
        return self.of.through(parts, self.period)


def frame_convolution(
    bodies: Sequence[object], frame: Array, weights: Array, local: Array | None
) -> FrameConvolution | None:
    """Return C of bodies on one grid; None where they are on none, or the frame differs from node to node.

    Args:
        bodies: Their operators.
        frame: e_n and the tangents of each node (n, d, d), by rows.
        weights: Areas of the nodes (n,).
        local: What a layer between them closes by unit pressures (n,), mm/MPa; None for none.
    """
    operators = [body for body in bodies if isinstance(body, ConvolvingAlongAxes)]
    if len(operators) < len(bodies) or not len(weights) or np.abs(frame - frame[0]).max() > SAME:
        return None
    places = operators[0].places - operators[0].places.min(axis=0)
    d = frame.shape[2]
    if any(not np.array_equal(places, one.places - one.places.min(axis=0)) for one in operators):
        return None
    if any(one.tables.shape[-2:] != (d, d) for one in operators):
        return None
    axes = frame[0]
    whole = np.sum([one.tables for one in operators], axis=0)
    table = np.moveaxis(axes @ whole @ axes.T, (-2, -1), (0, 1))
    found = [one.mixed for one in operators]
    smooth = [
        (points, np.einsum("ac,kcle,be->akbl", axes, response, axes, optimize=True))
        for points, response in (one for one in found if one is not None)
    ]
    counts = tuple((count + 1) // 2 for count in whole.shape[:-2])
    at = np.ravel_multi_index(tuple(places.T), counts)
    return FrameConvolution(at, counts, np.ascontiguousarray(table), smooth, weights, local)
