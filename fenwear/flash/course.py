"""Where a strip is that goes to and fro, and how fast, at any time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fenwear.arrays import Array
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
