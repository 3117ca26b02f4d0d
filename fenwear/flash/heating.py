"""Heat of friction on the part of a contact grid that touches, at instants of a cycle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fenwear.arrays import Array, Mask
from fenwear.assembly import ContactSetup
from fenwear.bodies.grid import RegularGrid
from fenwear.flash.course import Past

MARGIN = 0.25  # of the sides of what touches: how far beside it temperatures are told


@dataclass(frozen=True)
class Window:
    """The part of a contact grid that touches, and some nodes beside it.

    Attributes:
        nodes: Their numbers in the grid (m, n).
        sides: Of a cell, mm.
    """

    nodes: NDArray[np.int64]
    sides: tuple[float, float]

    @classmethod
    def around(cls, grid: RegularGrid, pressure: Array) -> Window:
        """Return that of nodes whose pressures (t, N) are above zero at any instant."""
        places = grid.places[pressure.max(axis=0) > 0]
        low, high = places.min(axis=0), places.max(axis=0)
        beside = np.ceil(MARGIN * (high - low + 1)).astype(int)
        low, high = np.maximum(low - beside, 0), np.minimum(high + beside, np.array(grid.counts) - 1)
        number = np.arange(int(np.prod(grid.counts))).reshape(grid.counts)
        first, second = (float(one) for one in grid.spacing)
        return cls(number[low[0] : high[0] + 1, low[1] : high[1] + 1], (first, second))

    @property
    def shape(self) -> tuple[int, int]:
        """Nodes (m, n)."""
        return self.nodes.shape[0], self.nodes.shape[1]

    def extent(self, touching: Mask) -> Array:
        """Return the sides of what touches at any of some instants (t, m, n), as (2,), mm."""
        counts = [len(np.unique(places)) for places in np.nonzero(touching)[1:]]
        return np.asarray(np.array(self.sides) * counts)

    @property
    def cell(self) -> float:
        """Area of a node, mm²."""
        return self.sides[0] * self.sides[1]


@dataclass(frozen=True)
class Heating:
    """Heat of friction at t instants, each of which stands for as much of the cycle.

    Attributes:
        placed: The bodies, on the grid that the pressures are of.
        half_cycle: That the cycle ends with.
        window: The part of the grid.
        times: From the cycle's begin (t,), s.
        pressure: (t, m, n), MPa.
        heat: Q (t, m, n), mW/mm²; on the rim of the grid, whose nodes have a half, over whole cells.
        velocity: Of a strip that goes one way (2,), mm/s; else zero.
        shifts: Where the strip is (t, 2), mm.
        period: Of the cycle, s; infinite where the strip goes one way.
        pasts: Where instants are by themselves, what was before each, see `fenwear.flash.kernels.history_kernel`.
        fastest: Largest speed of the cycle, mm/s.
        way: From one end of the strip's stroke to the other, mm.
    """

    placed: ContactSetup
    half_cycle: int
    window: Window
    times: Array
    pressure: Array
    heat: Array
    velocity: Array
    shifts: Array
    period: float
    pasts: tuple[Past, ...]
    fastest: float
    way: float = 0.0

    @property
    def grid(self) -> RegularGrid:
        """The contact."""
        return grid_of(self.placed)

    @property
    def touching(self) -> Mask:
        """Nodes of the window that touch (t, m, n)."""
        return self.pressure > 0

    @property
    def extent(self) -> Array:
        """Sides of what touches (2,), mm."""
        return self.window.extent(self.touching)


def grid_of(placed: ContactSetup) -> RegularGrid:
    """Return the contact grid of placed bodies, which have one."""
    grid = placed.pair.punch.grid
    assert grid is not None
    return grid
