"""Phases of so many nodes in contact that no matrix of them is made, with what all of them wear.

With the common depth omega as an unknown beside the pressures, omega - sum of D_k p_k = 0, they are what
`fenwear.contact.row_blocks` solves.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import csr_array, diags_array

from fenwear.arrays import Array
from fenwear.contact.blocks import ManyNodes, PhaseBlock
from fenwear.contact.operators import Indices, Solve
from fenwear.contact.row_blocks import Meeting, RowBlocks, SpreadPhases
from fenwear.memory import free_memory

FEW = 2000  # nodes in contact up to which each phase is eliminated by itself
NUMBER, MATRICES = 8, 5  # bytes; matrices for each phase that eliminating them takes, preconditioners with them


class SpreadNodes(ManyNodes):
    """The phases' blocks side by side, as `ManyNodes` has them: where many nodes touch by products of all phases.

    Args:
        phases: The compliances of all of them.
        blocks, wear, before: As of `ManyNodes`.

    Attributes:
        iterations: All that sets of many nodes took.
    """

    def __init__(
        self,
        phases: SpreadPhases,
        blocks: Sequence[PhaseBlock],
        wear: Array | None = None,
        before: ManyNodes | None = None,
    ) -> None:
        super().__init__(blocks, wear, before)
        self._phases, self.iterations = phases, 0

    def multiply(self, x: Array) -> Array:
        """Return the matrix times x."""
        n, parts = self.blocks[0].nodes, x.reshape(len(self.blocks), -1)
        p, a = parts[:, :n], parts[:, n:]
        if np.count_nonzero(p, axis=1).max() <= FEW:
            return super().multiply(x)
        result: Array = np.empty_like(parts)
        result[:, :n] = self._phases.multiply(p)
        for k, block in enumerate(self.blocks):
            result[k, :n] += block.modes @ a[k]
            result[k, n:] = block.balance @ p[k]
        if self.wear is not None:
            result[:, :n] += (self.wear * p).sum(axis=0)
        return result.ravel()

    def factor(self, kept: Indices) -> Solve:
        """Return the solution operator of the rows and columns `kept`, all rigid motions among them.

        Raises:
            LinAlgError: they are singular.
        """
        n, m, size = self.blocks[0].nodes, len(self.blocks), self.blocks[0].size
        whole = np.zeros(m * size, dtype=bool)
        whole[kept] = True
        touching = whole.reshape(m, size)[:, :n]
        if touching.sum(axis=1).max() <= FEW:
            return super().factor(kept)
        nodes, place = touching.any(axis=0), kept % size
        found = RowBlocks(self._phases, self._meeting(), np.vstack([touching, nodes]), self._count)
        pressures, last = place < n, len(kept) + int(nodes.sum())
        here = np.empty(len(kept), dtype=np.int64)  # of each unknown, among pressures, depths and rigid motions
        here[pressures] = np.arange(int(pressures.sum()))
        here[~pressures] = last - int((~pressures).sum()) + np.arange(int((~pressures).sum()))

        def solve(b: Array) -> Array:
            right = np.zeros(last)
            right[here] = b
            try:
                return found.solve(right)[here]
            except np.linalg.LinAlgError:
                self._check_memory(int(nodes.sum()))
                return super(SpreadNodes, self).factor(kept)(b)

        return solve

    def _check_memory(self, touching: int) -> None:
        """Raise LinAlgError where what so many nodes take as matrices of each phase does not fit."""
        free = free_memory()
        if free is not None and MATRICES * NUMBER * len(self.blocks) * touching**2 > free:
            raise np.linalg.LinAlgError("the iterations of a large contact did not converge")

    def _meeting(self) -> Meeting:
        m, n = len(self.blocks), self.blocks[0].nodes
        r = self.blocks[0].size - n
        opened, balance = np.zeros((m + 1, n, m * r)), np.zeros((m * r, m, n))
        for k, block in enumerate(self.blocks):
            own = slice(k * r, (k + 1) * r)
            opened[k, :, own], balance[own, k] = block.modes, block.balance
        wear = np.zeros((m, n)) if self.wear is None else self.wear
        return Meeting([csr_array(diags_array(own)) for own in wear], np.ones(n), opened, balance)

    def _count(self, iterations: int) -> None:
        self.iterations += iterations
