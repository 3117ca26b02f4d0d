"""The place of the counter-body: a rigid motion from the place in which it was meshed.

Space has the axes x, y and z; a plane or axisymmetric model lies in x and z, at y = 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from fenwear.common.arrays import Array

Vector = tuple[float, float, float]
ZERO: Vector = (0.0, 0.0, 0.0)


def in_space(vectors: Array) -> Array:
    """Return vectors (..., d) with all three components (..., 3)."""
    return in_model(vectors, 3)


def in_model(vectors: Array, dim: int) -> Array:
    """Return the components (..., d) along the axes of a model of d dimensions, of vectors of another or of space."""
    if vectors.shape[-1:] in ((), (dim,)):  # a number is for all of them
        return vectors
    return vectors[..., [0, 2]] if dim == 2 else np.insert(vectors, 1, 0.0, axis=-1)


@dataclass(frozen=True)
class Placement:
    """A turn about an axis and then a shift.

    Attributes:
        shift: mm.
        turn: Rotation vector, rad.
        centre: A point on the axis of the turn, mm.
    """

    shift: Vector = ZERO
    turn: Vector = ZERO
    centre: Vector = ZERO

    def __str__(self) -> str:
        """Say where the body is."""
        shift, turn = (next((c for c in v if c), 0.0) for v in (self.shift, self.turn))
        return f"turned by {turn:g} rad" if turn else f"moved by {shift:g} mm"

    def points(self, x: Array) -> Array:
        """Return the points (n, d) of the body at its place, mm."""
        if self.turn == ZERO:
            return x + in_model(np.array([self.shift]), x.shape[1])
        moved = self._rotation.apply(in_space(x) - self.centre) + self.centre + self.shift
        return in_model(moved, x.shape[1])

    def points_back(self, x: Array) -> Array:
        """Return the points (n, d) of space in the body's own frame, mm."""
        if self.turn == ZERO:
            return x - in_model(np.array([self.shift]), x.shape[1])
        moved = self._rotation.inv().apply(in_space(x) - self.centre - self.shift) + self.centre
        return in_model(moved, x.shape[1])

    def vectors(self, v: Array) -> Array:
        """Return vectors (n, d) that turn with the body."""
        return v if self.turn == ZERO else in_model(self._rotation.apply(in_space(v)), v.shape[1])

    def back(self, v: Array) -> Array:
        """Return vectors (n, d) in the body's own frame."""
        return v if self.turn == ZERO else in_model(self._rotation.inv().apply(in_space(v)), v.shape[1])

    @property
    def _rotation(self) -> Rotation:
        return Rotation.from_rotvec(self.turn)


HERE = Placement()
