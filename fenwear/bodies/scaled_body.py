"""A body whose compliance is that of another one times a number, as creep makes it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fenwear.bodies.convolution import Convolution, GridOperator
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.surface_operators import SurfaceOperator
from fenwear.common.arrays import Array, Nodes


@dataclass(frozen=True)
class Scaled:
    """An operator of `factor` times the compliance; what moved supports do stays as it is.

    Attributes:
        operator: Of the body.
        factor: Over its compliance.
        moved: Displacement of each pattern by moved supports alone (q, d), mm.
    """

    operator: SurfaceOperator
    factor: float
    moved: Array

    @property
    def directions(self) -> Array:
        """Unit vectors (q, d, a)."""
        return self.operator.directions

    @property
    def by_load(self) -> Array:
        """Displacement by the loads (q, d), mm."""
        return self.moved + self.factor * (self.operator.by_load - self.moved)

    @property
    def by_temperature(self) -> Array | None:
        """Displacement from temperatures (q, owned), mm/K, which depends on no modulus."""
        return self.operator.by_temperature

    @property
    def in_memory(self) -> bool:
        """Whether its numbers are in memory."""
        return self.operator.in_memory

    def apply(self, forces: Array) -> Array:
        """Return the displacements (q, a, ...) of forces (q, d, ...)."""
        return self.factor * self.operator.apply(forces)

    def entries(self, rows: Nodes, columns: Nodes) -> Array:
        """Return the displacements at some patterns from unit forces at others (rows, a, columns, d)."""
        return self.factor * self.operator.entries(rows, columns)

    def diagonal(self) -> Array:
        """Return the displacements at each pattern from unit forces at itself (q, a, d)."""
        return self.factor * self.operator.diagonal()

    def under(self, elastic: ElasticBody) -> Scaled:
        """Return the scaled operator under other loads, those of `elastic`; collective."""
        return type(self)(self.operator.under(elastic), self.factor, self.moved)


class ScaledOnGrid(GridOperator, Scaled):
    """A scaled operator that is a convolution on a grid."""

    operator: Any

    @cached_property
    def convolution(self) -> Convolution:
        """C along its directions, by forces along the model's axes."""
        return self.operator.convolution.times(self.factor)


def scaled(operator: SurfaceOperator, factor: float, moved: Array | None = None) -> SurfaceOperator:
    """Return an operator of a number times its compliance.

    Args:
        operator: Of the body.
        factor: The number.
        moved: Displacement of each pattern by moved supports alone (q, d), mm; by default none.
    """
    if factor == 1:
        return operator
    kind = ScaledOnGrid if isinstance(operator, GridOperator) else Scaled
    return kind(operator, factor, np.zeros_like(operator.by_load) if moved is None else moved)
