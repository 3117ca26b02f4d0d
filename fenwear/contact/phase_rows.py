"""This rank's rows of the compliances of all phases of a motion, and of what comes near the inverse.

Phases in one place of the strip share one matrix, of which friction takes other tractions: the products of all of them
take one pass through it, and no matrix of a phase is made.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fenwear.arrays import Array, Mask, Nodes
from fenwear.bodies.condensation import product
from fenwear.contact.operators import Solve, eliminate
from fenwear.contact.worn_shape import WornShape

EVERY = slice(None)
RUN = 1000  # pressures of neighbouring nodes that are eliminated together
FEW = 0.5  # of all nodes: where no more touch in any phase, what they open at each other is copied


class Place(Protocol):
    """What forces on nodes open at this rank's own, as `fenwear.interface.Interface` has it in a place of the strip."""

    def apply(self, forces: Array) -> Array:
        """Return the gaps (own, 1, k), mm, by forces (n, d, k)."""

    def entries(self, rows: Nodes, columns: Nodes) -> Array:
        """Return the gaps at some nodes from unit forces along the axes at others (rows, 1, columns, d)."""


@dataclass(frozen=True)
class SomeNodes:
    """The same of some nodes, by numbers (own, 1, n, d)."""

    numbers: Array

    def apply(self, forces: Array) -> Array:
        """Return the gaps (own, 1, k), mm, by forces (n, d, k)."""
        return product(self.numbers, forces)

    def entries(self, rows: Nodes, columns: Nodes) -> Array:
        """Return those of some rows and columns."""
        return self.numbers[rows][:, :, columns]


@dataclass(frozen=True)
class PhaseRows:
    """What the pressures of some phases at some nodes open at some of this rank's nodes.

    Attributes:
        places: What forces open, one for each place of the strip.
        traction: Of unit pressures with their friction, times the nodes' weights and the scale, (phases, n, d) each.
        phases: Which have each place.
    """

    places: Sequence[Place]
    traction: Sequence[Array]
    phases: Sequence[NDArray[np.int64]]

    @property
    def count(self) -> int:
        """How many phases there are."""
        return sum(map(len, self.phases))

    @property
    def nodes(self) -> int:
        """How many nodes have pressures."""
        return int(self.traction[0].shape[1])

    def multiply(self, pressure: Array) -> Array:
        """Return the gaps (m, own) from pressures (m, n)."""
        found: list[Array] = [np.zeros(0)] * self.count
        for place, traction, which in zip(self.places, self.traction, self.phases, strict=True):
            gaps = place.apply((traction * pressure[which][:, :, None]).transpose(1, 2, 0))[:, 0]
            for column, k in enumerate(which):
                found[k] = gaps[:, column]
        return np.array(found)

    def of(self, rows: NDArray[np.int64], nodes: NDArray[np.int64]) -> PhaseRows:
        """Return the same of some rows, given by their place among this rank's, and of some nodes."""
        places = [SomeNodes(place.entries(rows, nodes)) for place in self.places]
        return PhaseRows(places, [one[:, nodes] for one in self.traction], self.phases)

    def matrices(self) -> Array:
        """Return the matrix of each phase (m, own, n)."""
        found: list[Array] = [np.zeros((0, 0))] * self.count
        for place, traction, which in zip(self.places, self.traction, self.phases, strict=True):
            numbers = place.entries(EVERY, EVERY)[:, 0]
            for k, own in zip(which, traction, strict=True):
                found[k] = np.einsum("ijd,jd->ij", numbers, own)
        return np.array(found)


class OwnPhases:
    """This rank's rows of all phases, and runs of neighbouring nodes that are eliminated with what they wear.

    With z_k the gaps of the phases and z_w the balance of wear at the nodes of a run,

        [S_k, 1; -M_k, D] (p, omega) = (z_k, z_w),

    where S_k is what the run's own nodes open at each other and M_k what they wear.

    Args:
        own: This rank's nodes.
        rows: What all nodes open at these.
    """

    def __init__(self, own: slice, rows: PhaseRows) -> None:
        self._first, self._last = own.start, own.stop
        self._rows = rows
        none: NDArray[np.int64] = np.zeros(0, dtype=np.int64)
        self._nodes = self._own = none  # that are prepared, and own ones among them
        self._within: PhaseRows | None = None
        self._runs: dict[int, tuple[bytes, Solve]] = {}
        self._cuts: list[tuple[NDArray[np.int64], Mask, Solve]] = []

    def multiply(self, pressure: Array) -> Array:
        """Return the gaps of all phases at own nodes (m, own) from pressures (m, n)."""
        return self._rows.multiply(pressure)

    def multiply_within(self, pressure: Array) -> Array:
        """Return the same at those of the prepared nodes that are own, from pressures there alone."""
        if self._within is not None:
            return self._within.multiply(pressure)
        whole = np.zeros((len(pressure), self._rows.nodes))
        whole[:, self._nodes] = pressure
        return self._rows.multiply(whole)[:, self._own]

    def prepare(self, nodes: NDArray[np.int64], free: Mask, wear: Array, held: Array) -> bool:
        """Take the nodes that are solved for, and eliminate their runs; return whether all can be.

        Args:
            nodes: Ascending (c,).
            free: Which of the pressures of each phase are free, and which shapes (m + 1, c).
            wear: Diagonals of M_k (m, c).
            held: D (c,).
        """
        begin, end = np.searchsorted(nodes, [self._first, self._last])
        if not np.array_equal(nodes, self._nodes):
            self._nodes, self._own = nodes, nodes[begin:end] - self._first
            few = len(nodes) <= FEW * self._rows.nodes
            self._within = self._rows.of(self._own, nodes) if few else None
        return self._eliminate(nodes, int(begin), free[:, begin:end], wear[:, begin:end], held[begin:end])

    def _eliminate(self, nodes: NDArray[np.int64], begin: int, free: Mask, wear: Array, held: Array) -> bool:
        """Eliminate the runs of own nodes; those whose unknowns and wear have stayed keep their factors."""
        m, count = wear.shape
        length = max(RUN // m, 1)
        cuts = np.append(np.flatnonzero(np.diff(nodes[begin : begin + count] // length, prepend=-1)), count)
        kept, self._cuts, self._runs = self._runs, [], {}
        for first, last in pairwise(cuts):
            some, chosen = nodes[begin + first : begin + last], free[:, first:last]
            run, parts = int(some[0]) // length, (some, chosen, wear[:, first:last], held[first:last])
            key = b"".join(np.ascontiguousarray(part).tobytes() for part in parts)
            found = kept.get(run)
            if found is None or found[0] != key:
                try:
                    found = key, self._eliminated(*parts)
                except np.linalg.LinAlgError:
                    return False
            self._runs[run] = found
            self._cuts.append((np.arange(begin + first, begin + last), chosen, found[1]))
        return True

    def _eliminated(self, nodes: NDArray[np.int64], free: Mask, wear: Array, held: Array) -> Solve:
        """Return the solution operator of a run's free unknowns."""
        m, count = wear.shape
        here, blocks = np.arange(count), self._rows.of(nodes - self._first, nodes).matrices()
        # What nothing wears and nothing holds stays where it is.
        held = np.where((wear * free[:m]).any(axis=0), held, np.where(held > 0, held, 1.0))
        if (held > 0).all():
            return _with_depth(blocks, free, wear, held)
        whole: Array = np.zeros(((m + 1) * count, (m + 1) * count))
        view = whole.reshape(m + 1, count, m + 1, count)
        for k, matrix in enumerate(blocks):
            view[k, :, k, :] = matrix
            view[k, here, m, here] = 1.0
            view[m, here, k, here] = -wear[k]
        view[m, here, m, here] = held
        return WornShape(whole, m, count).factor(np.flatnonzero(free).astype(np.int32))

    def near(self, v: Array) -> Array:
        """Return own columns of the solution of all runs (m + 1, own, q) for (m + 1, c, q) on the prepared nodes."""
        found = [np.zeros((v.shape[0], 0, v.shape[2]))]
        for at, free, solve in self._cuts:
            part = np.zeros((v.shape[0], len(at), v.shape[2]))
            part[free] = solve(v[:, at][free])
            found.append(part)
        return np.concatenate(found, axis=1)


def _with_depth(blocks: Array, free: Mask, wear: Array, held: Array) -> Solve:
    """Return the solution operator of a run whose shape is held everywhere: it follows from the pressures.

    Args:
        blocks: S_k of its nodes (m, n, n).
        free, wear, held: As of `OwnPhases.prepare`, of its nodes.
    """
    m, n, _ = blocks.shape
    touching, shaped, here = free[:m], free[m], np.arange(n)
    soft = np.where(shaped, 1 / held, 0.0)
    whole: Array = np.zeros((m * n, m * n))
    view = whole.reshape(m, n, m, n)
    for k, matrix in enumerate(blocks):
        view[k, :, k, :] = matrix
    view[:, here, :, here] += (soft * wear).T[:, None, :]
    kept = np.flatnonzero(touching)
    solve_pressures = eliminate(whole[np.ix_(kept, kept)])

    def solve(b: Array) -> Array:
        right = np.zeros((m + 1, n, b.shape[1]))
        right[free] = b
        opened = soft[:, None] * right[m]
        right[:m][touching] = solve_pressures((right[:m] - opened)[touching])
        right[:m][~touching] = 0.0
        right[m] = opened + np.einsum("kn,knq->nq", soft * wear, right[:m])
        return right[free]

    return solve
