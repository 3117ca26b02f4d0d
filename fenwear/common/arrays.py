"""Types of arrays, for hints, and data classes of arrays that are added part by part."""

from __future__ import annotations

from typing import Any, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]
Nodes: TypeAlias = NDArray[np.integer[Any]] | slice  # some of them, by their numbers


class Added:
    """A data class of arrays that is added and multiplied part by part; an empty part adds nothing."""

    def __add__(self, other: Self) -> Self:
        return type(self)(*map(_added, vars(self).values(), vars(other).values()))

    def __sub__(self, other: Self) -> Self:
        return self + other.times(-1.0)

    def times(self, factor: float) -> Self:
        """Return all parts times a factor."""
        return type(self)(*(factor * part for part in vars(self).values()))


def _added(first: Array, other: Array) -> Array:
    """Return the sum of two parts; an empty one adds nothing."""
    if not len(other):
        return first
    return first + other if len(first) else other
