"""A body whose compliance is that of another one times a number, as creep makes it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fenwear.arrays import Array, Nodes
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.operators import SurfaceOperator


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
    def cost(self) -> float | None:
        """Of a product."""
        return self.operator.cost

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
        """Return the same under the loads of a body that differs by them alone; collective."""
        return type(self)(self.operator.under(elastic), self.factor, self.moved)


class ScaledConvolution(Scaled):
    """The same of an operator that is a convolution on a grid."""

    operator: Any

    @property
    def places(self) -> NDArray[np.int64]:
        """Whole numbers of each node along the axes of the grid (q, d - 1)."""
        return np.asarray(self.operator.places)

    def table(self, traction: Array) -> Array:
        """Return the displacement by a force (d,) at all distances of two nodes (2 m - 1, ...)."""
        return np.asarray(self.factor * self.operator.table(traction))

    @property
    def tables(self) -> Array:
        """Displacements by unit forces at all distances of two nodes (2 m - 1, ..., a, d), mm."""
        return np.asarray(self.factor * self.operator.tables)

    @property
    def mixed(self) -> tuple[Any, Array] | None:
        """Values at points to the nodes, and what forces at points do (k, a, k, d); None for none."""
        found = self.operator.mixed
        return None if found is None else (found[0], self.factor * found[1])

    def smooth(self, traction: Array) -> tuple[Array, Array] | None:
        """Return values at points to the nodes (q, k), and what forces along it at points do (k, k); None for none."""
        found = self.operator.smooth(traction)
        return None if found is None else (found[0], self.factor * found[1])


def scaled(operator: SurfaceOperator, factor: float, moved: Array | None = None) -> SurfaceOperator:
    """Return an operator of a number times its compliance.

    Args:
        operator: Of the body.
        factor: The number.
        moved: Displacement of each pattern by moved supports alone (q, d), mm; by default none.
    """
    if factor == 1:
        return operator
    kind = ScaledConvolution if hasattr(operator, "table") and hasattr(operator, "smooth") else Scaled
    return kind(operator, factor, np.zeros_like(operator.by_load) if moved is None else moved)
