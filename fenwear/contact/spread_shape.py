"""The linear system of the cyclic steady state of so many nodes that no matrix of them is made.

As `fenwear.contact.worn_shape` has it; solved by `fenwear.contact.row_blocks`, rank 0 leading.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from fenwear.arrays import Array
from fenwear.contact.operators import Indices, Solve
from fenwear.contact.row_blocks import Meeting, RowBlocks, SpreadPhases
from fenwear.contact.worn_shape import ShapeRows


@dataclass(frozen=True)
class SpreadShape(ShapeRows):
    """What contact and equilibrium give, linear in the unknowns and scaled.

    Attributes:
        phases: What multiplies with S_k of all phases.
        modes: H (n, r), the gap that each rigid mode opens.
        balances: E_k (m, r, n), what each node's pressure puts on each mode.
    """

    phases: SpreadPhases
    modes: Array
    balances: Array

    def gaps(self, pressure: Array) -> Array:
        """Return what pressures open in all phases (m, n)."""
        return self.phases.multiply(pressure)

    def derivative(self, wear: Sequence[csr_array], held: Array) -> WornOperator:
        """Return the left side's derivative with wear.

        Args:
            wear: M_k, the wear of each node by the pressures of phase k (n, n).
            held: D (n,), what holds the shape where no phase touches; else zero.
        """
        m, n, r = self.shape
        beside = m * r  # a of the later phases, and lambda
        opened, balance = np.zeros((m + 1, n, beside)), np.zeros((m * r, m, n))
        for k in range(m):
            own = slice(k * r, (k + 1) * r)
            opened[k + 1, :, own] = self.modes
            balance[own, k] = self.balances[k]
        return WornOperator(self, Meeting(list(wear), held, opened, balance))


class WornOperator:
    """The derivative of the cyclic steady state.

    Attributes:
        iterations: All that its solutions took.
    """

    def __init__(self, equations: SpreadShape, meeting: Meeting) -> None:
        self.equations, self.meeting = equations, meeting
        self.iterations = 0

    def multiply(self, x: Array) -> Array:
        """Return the matrix times x."""
        return self.equations.multiply_with(x, self.meeting.wear, self.meeting.held)

    def factor(self, kept: Indices) -> Solve:
        """Return the solution operator of the rows and columns `kept`, all rigid motions among them.

        Raises:
            LinAlgError: they are singular.
        """
        m, n, _ = self.equations.shape
        free = np.zeros(self.equations.size, dtype=bool)
        free[kept] = True
        found = RowBlocks(self.equations.phases, self.meeting, free[: (m + 1) * n].reshape(m + 1, n), self._count)
        return found.solve

    def _count(self, iterations: int) -> None:
        self.iterations += iterations
