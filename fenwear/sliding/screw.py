"""Ways of a body from one place to another: screws, exact for turns of any size below half a one.

From (R_0, s_0) to (R_1, s_1), places x -> R (x - c) + c + s, the shortest screw is constant over the way:

    R = R_1 R_0^T = exp(w),  s_1 - R s_0 = J(w) V,  J(w) = 1 + (1 - cos t) / t² [w] + (t - sin t) / t³ [w]²,  t = |w|,

with the velocity V + w x (x - c) for a unit of time (exponential of se(3); R. M. Murray et al., A Mathematical
Introduction to Robotic Manipulation, 1994).
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from scipy.spatial.transform import Rotation as Turn

from fenwear.arrays import Array
from fenwear.interface.placement import HERE, ZERO, Placement, Vector
from fenwear.sliding.field import SlidingField, screw

ROUNDING = 1e-14  # rad, and of the largest shift: what matrices leave of a motion that is none
SMALL = 1e-4  # rad: a turn whose series ends after three terms


class Way(Protocol):
    """Where a body goes in a time step; equal ways there and back are one."""

    def at(self, share: float) -> Placement:
        """Return the place at a share of it, from 0 at its lower end to 1."""


@dataclass(frozen=True)
class Slide:
    """A way along a sliding field.

    Attributes:
        field: The motion of unit amount.
        low, high: Amounts at its ends, mm or rad.
    """

    field: SlidingField
    low: float
    high: float

    def at(self, share: float) -> Placement:
        """Return the place at a share of it."""
        return self.field.placement(self.low + (self.high - self.low) * share)


@dataclass(frozen=True)
class Screw:
    """The shortest screw between two places, which turn about the same centre where both are turned.

    Attributes:
        first, last: Its ends.
    """

    first: Placement
    last: Placement

    @property
    def undirected(self) -> Screw:
        """The same way, from whichever end it begins."""
        return Screw(*sorted((self.first, self.last), key=lambda place: (place.turn, place.shift)))

    def parts(self, count: int) -> list[Screw]:
        """Return it in parts of equal time."""
        places = [self.at(k / count) for k in range(count + 1)]
        return [Screw(*ends) for ends in itertools.pairwise(places)]

    @property
    def _centre(self) -> Vector:
        return self.last.centre if self.first.turn == ZERO else self.first.centre

    @cached_property
    def _parts(self) -> tuple[Array, Array]:
        """Return V (3,), mm, and w (3,), rad."""
        (s0, r0), (s1, r1) = ((np.array(p.shift), Turn.from_rotvec(p.turn)) for p in (self.first, self.last))
        w = (r1 * r0.inv()).as_rotvec()
        w = np.where(np.abs(w) < ROUNDING, 0.0, w)
        v = np.linalg.solve(_advance(w), s1 - Turn.from_rotvec(w).apply(s0))
        return np.where(np.abs(v) < ROUNDING * max(np.abs(s0).max(), np.abs(s1).max()), 0.0, v), w

    @cached_property
    def field(self) -> SlidingField:
        """The velocity for a unit of time."""
        return screw(*self._parts, np.array(self._centre))

    @property
    def rests(self) -> bool:
        """Whether nothing moves."""
        return not any(part.any() for part in self._parts)

    def at(self, share: float) -> Placement:
        """Return the place at a share of it, from 0 at `first` to 1 at `last`."""
        if share in (0, 1):
            return self.last if share else self.first
        v, w = (share * part for part in self._parts)
        turn = Turn.from_rotvec(w)
        shift = turn.apply(self.first.shift) + _advance(w) @ v
        return placed(shift, (turn * Turn.from_rotvec(self.first.turn)).as_rotvec(), self._centre)


def placed(shift: Array, turn: Array, centre: Vector) -> Placement:
    """Return a place, rounded so that it is the same on the way there and back.

    Args:
        shift: mm.
        turn: Rotation vector, rad.
        centre: Of the turn, mm.
    """
    place = Placement(_rounded(shift), _rounded(turn), centre)
    return place if any(place.shift) or any(place.turn) else HERE


def _advance(w: Array) -> Array:
    """Return J(w) (3, 3), by which a screw's turning bends its way."""
    angle = float(np.linalg.norm(w))
    cross = np.cross(np.eye(3), w)
    if angle < SMALL:
        return np.asarray(np.eye(3) + cross / 2 + cross @ cross / 6)
    first, second = (1 - math.cos(angle)) / angle**2, (angle - math.sin(angle)) / angle**3
    return np.asarray(np.eye(3) + first * cross + second * cross @ cross)


def _rounded(vector: Array) -> Vector:
    x, y, z = (float(c) + 0.0 for c in np.round(vector, 12))
    return x, y, z
