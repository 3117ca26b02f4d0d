"""Heat of friction on the part of a contact grid that touches, at instants of a cycle.

Where a strip is that goes to and fro, and how fast, at any time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fenwear.arrays import Array, Mask
from fenwear.assembly import ContactSetup
from fenwear.bodies.grid import RegularGrid
from fenwear.sliding.motion import Motion

FINE = 64  # parts of a position of the strip between which places are taken as straight

Past = Callable[[Array], tuple[Array, Array]]


@dataclass(frozen=True)
class Course:
    """Where the strip is, and how fast, over a cycle to and fro.

    Attributes:
        times: From 0 to the period (k + 1,), s.
        offsets: Of the strip then (k + 1,), mm or rad of the motion.
        slid: Up to then (k + 1,), the same.
        ends: Of the phases (phases,), s.
    """

    times: Array
    offsets: Array
    slid: Array
    ends: Array

    @classmethod
    def of(cls, motion: Motion) -> Course:
        """Return that of a motion."""
        offsets = motion.offsets(FINE)
        durations = np.array([phase.duration for phase in motion.phases])
        times = np.append(0.0, np.repeat(durations / FINE, FINE).cumsum())
        slid = np.append(0.0, np.abs(np.diff(offsets, axis=1)).ravel().cumsum())
        return cls(times, np.append(offsets[0, 0], offsets[:, 1:].ravel()), slid, durations.cumsum())

    @property
    def period(self) -> float:
        """Of the cycle, s."""
        return float(self.times[-1])

    @property
    def speeds(self) -> Array:
        """Mean ones between the times (k,), mm/s or rad/s."""
        return np.asarray(np.diff(self.slid) / np.diff(self.times))

    def place(self, t: Array) -> Array:
        """Return offsets at any times, mm or rad."""
        return np.asarray(np.interp(t % self.period, self.times, self.offsets))

    def speed(self, t: Array) -> Array:
        """Return speeds at any times, mm/s or rad/s."""
        middles = (self.times[1:] + self.times[:-1]) / 2
        return np.asarray(np.interp(t, middles, self.speeds, period=self.period))

    def phase(self, t: Array) -> NDArray[np.int64]:
        """Return the numbers of the phases at times within the cycle."""
        return np.minimum(np.searchsorted(self.ends, t), len(self.ends) - 1)


def past_of(course: Course, along: Array, now: float) -> Past:
    """Return what gives, for times before an instant, places of the strip now less those then, and heat over now's."""
    here, speed = course.place(np.array([now])), float(course.speed(np.array([now]))[0])

    def past(before: Array) -> tuple[Array, Array]:
        then = now - before
        return (course.place(then) - here)[:, None] * along, np.asarray(course.speed(then) / speed, dtype=np.float64)

    return past


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
        pasts: Where instants are by themselves, what was before each, see `fenwear.flash.response.history_kernel`.
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
