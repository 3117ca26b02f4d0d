"""The sliding field: the velocity of the counter-body over the contact.

The counter-body moves as a rigid one, v = V + omega x (x - c), times the scalar law of the stroke. A
translation is counted in mm, a rotation in rad: then speed, wear and heat vary over the contact.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fenwear.arrays import Array
from fenwear.errors import CaseError, InputError
from fenwear.interface.placement import ZERO, Placement, Vector, in_space


@dataclass(frozen=True)
class SlidingField:
    """A rigid motion of unit amount, in space (x, y, z); a plane model lies at y = 0.

    Attributes:
        shift: V, the direction of a translation; a unit vector, or zero, but of a step of a table.
        turn: omega, the axis of a rotation; the same. With a translation it is a screw along its axis.
        centre: c, a point on the axis, mm.
    """

    shift: Vector = ZERO
    turn: Vector = ZERO
    centre: Vector = ZERO

    def velocity(self, x: Array) -> Array:
        """Return v of the counter-body's material at points x (n, d) for a unit of the stroke's law (n, 3)."""
        return np.array(self.shift) + np.cross(self.turn, in_space(x) - self.centre)

    def __post_init__(self) -> None:
        """Raise where it shifts across its axis, which would have to move along."""
        if ZERO not in (self.shift, self.turn):
            across = np.linalg.norm(np.cross(self.shift, self.turn))
            if across > 1e-9 * np.linalg.norm(self.shift) * np.linalg.norm(self.turn):
                message = "expected a translation, a rotation, or a rotation that advances along its own axis"
                raise CaseError(InputError("motion", message))

    def over(self, amount: float) -> SlidingField:
        """Return the motion of which this is so many units."""
        shift, turn = (_vector(np.array(part) / amount) for part in (self.shift, self.turn))
        return SlidingField(shift, turn, self.centre)

    def rate(self, x: Array, normal: Array) -> Array:
        """Return what each point slides for a unit of the stroke's law (n,): 1, or mm/rad; e_n (n, d) its normal."""
        return np.linalg.norm(self._tangential(x, normal), axis=1)

    def _tangential(self, x: Array, normal: Array) -> Array:
        v, n = self.velocity(x), in_space(normal)
        return v - np.einsum("ic,ic->i", v, n)[:, None] * n

    def direction(self, x: Array, normal: Array) -> Array:
        """Return e_v (n, 3), the unit direction of sliding within the contact of normal e_n (n, d), or zero."""
        tangential = self._tangential(x, normal)
        size = np.linalg.norm(tangential, axis=1, keepdims=True)
        still = size <= 1e-12 * size.max(initial=1e-300)
        return np.where(still, 0.0, tangential / np.where(still, 1.0, size))

    def words(self, dim: int) -> dict[int, str]:
        """Return the words for the two directions d of the sliding in d dimensions, 1 first.

        Turns are seen against their axis; forward in a solid is along the direction of the motion.
        """
        if self.turn != ZERO:
            return {1: "counterclockwise", -1: "clockwise"}
        return {1: "rightward", -1: "leftward"} if dim == 2 else {1: "forward", -1: "backward"}

    def placement(self, amount: float) -> Placement:
        """Return where the counter-body is after this amount of the motion, mm or rad."""
        if amount == 0.0:
            return Placement()
        (x, y, z), (a, b, c) = self.shift, self.turn
        return Placement((amount * x, amount * y, amount * z), (amount * a, amount * b, amount * c), self.centre)


def screw(shift: Array, turn: Array, centre: Array) -> SlidingField:
    """Return the field of the velocity V + omega x (x - c), about the axis that moves along itself only.

    Args:
        shift: V (3,), mm.
        turn: omega (3,), rad.
        centre: c (3,), mm.
    """
    size = float(turn @ turn)
    if size == 0:
        return SlidingField(shift=_vector(shift))
    along = (shift @ turn) / size * turn
    return SlidingField(_vector(along), _vector(turn), _vector(centre + np.cross(turn, shift) / size))


def _vector(values: Array) -> Vector:
    x, y, z = (float(c) + 0.0 for c in values)
    return x, y, z


ALONG_X = SlidingField(shift=(1.0, 0.0, 0.0))
ALONG_Y = SlidingField(shift=(0.0, 1.0, 0.0))
