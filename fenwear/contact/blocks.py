"""Contacts of many nodes: the phases' compliances as operators, of which only what nodes near contact ask for is made.

A phase has the unknowns (p, a) and the matrix A_k = [S_k, H; E_k, 0]. Its columns are made when their nodes first
touch; its factor is that of the nodes in contact and follows them (`Updating`). Where wear of the phases' own pressures
opens all of them, with D_k what unit pressure of phase k wears at its node,

    A_k x_k + omega = b_k,    omega = sum of D_k p_k,

the depth omega follows from (1 + sum of D_k A_k^-1) omega = sum of D_k A_k^-1 b_k by GMRES: with the phases' factors,
which do not change with the length of a step, and preconditioned by (mean of S) (mean of S + sum of D_k)^-1. Its factor
serves all steps that wear a few times more or less: 5 to 20 iterations.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.contact.krylov import NotSolvedError, gmres_solution
from fenwear.contact.operators import Indices, Phases, Solve, Updating

FEW = 0.7  # of the columns: above it all are made
SPARE = 1.2  # room for columns over those that are asked for
ALIKE, KEPT = 1.5, 3  # ratio of wear up to which a preconditioner serves; how many are kept
ENOUGH = 2e-12  # residual of the depth, scaled to 1, that ends the iterations


class Columns:
    """A matrix whose columns are made when they are first asked for.

    Args:
        size: Columns.
        make: Returns the columns of these numbers (rows, k).
        rows: By default as many as columns.
    """

    def __init__(self, size: int, make: Callable[[NDArray[np.int64]], Array], rows: int | None = None) -> None:
        self._size, self._make = size, make
        self._place = np.full(size, -1)  # of each column among those made
        self._numbers: NDArray[np.int64] = np.zeros(0, dtype=np.int64)
        self._made: Array = np.zeros((size if rows is None else rows, 0))

    @property
    def made(self) -> int:
        """How many columns there are."""
        return len(self._numbers)

    def _have(self, asked: NDArray[np.int64]) -> None:
        """Make the columns that lack."""
        new = asked[self._place[asked] < 0]
        if not len(new):
            return
        if self.made + len(new) > FEW * self._size:
            new = np.flatnonzero(self._place < 0)
        count = self.made + len(new)
        if count > self._made.shape[1]:
            room: Array = np.empty((len(self._made), min(self._size, int(SPARE * count))))
            room[:, : self.made] = self._made[:, : self.made]
            self._made = room
        self._made[:, self.made : count] = self._make(new)
        self._place[new] = np.arange(self.made, count)
        self._numbers = np.concatenate([self._numbers, new])

    cost: float | None = None  # its numbers are in memory

    def apply(self, x: Array) -> Array:
        """Return the matrix times x (size,)."""
        self._have(np.flatnonzero(x))
        return np.asarray(self._made[:, : self.made] @ x[self._numbers])

    def entries(self, rows: Indices, columns: Indices) -> Array:
        """Return the numbers of some rows and columns."""
        self._have(columns.astype(np.int64))
        return self._made[np.ix_(rows, self._place[columns])]


class Compliance(Protocol):
    """A square matrix that gives products and some of its numbers."""

    @property
    def cost(self) -> float | None:
        """Of a product, in numbers that memory could give meanwhile; None for a matrix of numbers."""

    def apply(self, x: Array) -> Array:
        """Return the matrix times x (size,)."""

    def entries(self, rows: Indices, columns: Indices) -> Array:
        """Return the numbers of some rows and columns."""


class PhaseBlock:
    """[S, H; E, 0] of one phase, with n pressures and r rigid modes.

    Args:
        compliance: S.
        diagonal: Of S (n,).
        modes: H (n, r).
        balance: E (r, n).
        iterated: Whether a set that is far from the last may be solved by iterations; not within others.
    """

    def __init__(
        self, compliance: Compliance, diagonal: Array, modes: Array, balance: Array, *, iterated: bool = True
    ) -> None:
        self.compliance, self.modes, self.balance = compliance, modes, balance
        self.nodes, self.size = len(modes), len(modes) + modes.shape[1]
        self.diagonal = np.concatenate([diagonal, np.zeros(modes.shape[1])])
        self.updating = self.factors(self.entries, self.diagonal if iterated else None, np.zeros(self.nodes))
        self._worn: tuple[Array, Updating] | None = None

    @property
    def iterations(self) -> int:
        """All that its sets were solved by."""
        return self.updating.iterations + (0 if self._worn is None else self._worn[1].iterations)

    def multiply(self, x: Array) -> Array:
        """Return the matrix times x (n + r,)."""
        p, a = x[: self.nodes], x[self.nodes :]
        return np.concatenate([self.compliance.apply(p) + self.modes @ a, self.balance @ p])

    def entries(self, rows: Indices, columns: Indices) -> Array:
        """Return the numbers of some rows and columns, ascending or of pressures alone."""
        n = self.nodes
        (i, more), (j, others) = (np.split(one, [int((one < n).sum())]) for one in (rows, columns))
        found: Array = np.zeros((len(rows), len(columns)))
        found[: len(i), : len(j)] = self.compliance.entries(i, j)
        found[: len(i), len(j) :] = self.modes[np.ix_(i, others - n)]
        found[len(i) :, : len(j)] = self.balance[np.ix_(more - n, j)]
        return found

    def matrix(self) -> Array:
        """Return all of it."""
        every = np.arange(self.size, dtype=np.int32)
        return self.entries(every, every)

    def factors(self, entries: Callable[[Indices, Indices], Array], diagonal: Array | None, wear: Array) -> Updating:
        """Return the factors of its sets, with wear (n,) on the diagonal that is in the entries already."""
        if self.compliance.cost is None:
            return Updating(entries, diagonal)

        def multiply(x: Array) -> Array:
            found = self.multiply(x)
            found[: self.nodes] += wear * x[: self.nodes]
            return found

        return Updating(entries, diagonal, multiply, self.compliance.cost)

    def worn(self, wear: Array) -> Updating:
        """Return factors of the same with wear (n,) on the diagonal; those of the last are kept."""
        if self._worn is None or not np.array_equal(self._worn[0], wear):
            added = np.concatenate([wear, np.zeros(self.size - self.nodes)])

            def entries(rows: Indices, columns: Indices) -> Array:
                found = self.entries(rows, columns)
                at = np.searchsorted(rows, columns).clip(max=max(len(rows) - 1, 0))
                same = np.flatnonzero(rows[at] == columns) if len(rows) else np.zeros(0, dtype=np.int64)
                found[at[same], same] += added[columns[same]]
                return found

            self._worn = (wear, self.factors(entries, self.diagonal + added, wear))
        return self._worn[1]


class ManyNodes:
    """The phases' blocks side by side; where wear is given, with what all phases' pressures open in each.

    Args:
        blocks: Of each phase.
        wear: D (m, n), depth at a node by unit pressure there in each phase; None without.
        before: The same with another wear, whose preconditioners may serve.
        layer: What unit pressure opens at its node in its own phase alone (m, n); None without.

    Attributes:
        near: The preconditioners, the one that is used first.
    """

    def __init__(
        self,
        blocks: Sequence[PhaseBlock],
        wear: Array | None = None,
        before: ManyNodes | None = None,
        layer: Array | None = None,
    ) -> None:
        if layer is not None and len(blocks) == 1:  # both are on the one diagonal
            wear, layer = layer if wear is None else wear + layer, None
        self.blocks, self.wear, self.layer = list(blocks), wear, layer
        self.near: list[Near] = []
        if wear is not None and len(self.blocks) > 1:
            others = sorted([] if before is None else before.near, key=lambda near: near.unlike(wear))
            mean = others[0].mean if others else _Mean(self.blocks)
            new = [] if others and others[0].unlike(wear) <= ALIKE else [Near(mean, wear)]
            self.near = [*new, *others][:KEPT]

    def multiply(self, x: Array) -> Array:
        """Return the matrix times x."""
        parts = x.reshape(len(self.blocks), -1)
        result = np.array([block.multiply(part) for block, part in zip(self.blocks, parts, strict=True)])
        if self.wear is not None:
            n = self.wear.shape[1]
            result[:, :n] += (self.wear * parts[:, :n]).sum(axis=0)
        if self.layer is not None:
            n = self.layer.shape[1]
            result[:, :n] += self.layer * parts[:, :n]
        return result.ravel()

    def factor(self, kept: Indices) -> Solve:
        """Return the solution operator of the rows and columns `kept`.

        Raises:
            LinAlgError: they are singular.
        """
        if len(self.blocks) == 1:
            block = self.blocks[0]
            return (block.updating if self.wear is None else block.worn(self.wear[0])).factor(kept)
        size = self.blocks[0].size
        cuts = np.searchsorted(kept, np.arange(len(self.blocks) + 1) * size)
        own = [kept[cuts[k] : cuts[k + 1]] - np.int32(k * size) for k in range(len(self.blocks))]
        factors = [
            block.updating if self.layer is None else block.worn(self.layer[k]) for k, block in enumerate(self.blocks)
        ]
        solves = [updating.factor(rows) for updating, rows in zip(factors, own, strict=True)]

        def apart(b: Array) -> list[Array]:
            return [solve(b[cuts[k] : cuts[k + 1]]) for k, solve in enumerate(solves)]

        if self.wear is None:
            return lambda b: np.concatenate(apart(b))
        return _Together(self, kept, own, apart).solve


class _Mean:
    """The mean of the phases' S with the balance of forces added, for rigid modes open gaps, too."""

    def __init__(self, blocks: Sequence[PhaseBlock]) -> None:
        self._blocks = blocks
        self._nodes: Indices = np.zeros(0, dtype=np.int32)  # whose numbers are kept
        self._kept: Array = np.zeros((0, 0))

    def entries(self, rows: Indices, columns: Indices) -> Array:
        """Return the numbers of some rows and columns."""
        asked = np.union1d(rows, columns)
        if not np.isin(asked, self._nodes, assume_unique=True).all():
            nodes = self._nodes = np.union1d(self._nodes, asked).astype(np.int32)
            self._kept = np.zeros((len(nodes), len(nodes)))
            for block in self._blocks:
                self._kept += block.compliance.entries(nodes, nodes)
                self._kept += block.modes[nodes] @ block.balance[:, nodes]
            self._kept /= len(self._blocks)
        i, j = (np.searchsorted(self._nodes, some) for some in (rows, columns))
        return self._kept[np.ix_(i, j)]


class Near:
    """The preconditioner of the common depth: (mean of S) (mean of S + sum of D)^-1 on the nodes that touch.

    Args:
        mean: Of S.
        wear: D of each phase (m, n).
    """

    def __init__(self, mean: _Mean, wear: Array) -> None:
        self.mean = mean
        self._wear: Array = np.asarray(wear.sum(axis=0))
        self._updating = Updating(self._entries)

    def unlike(self, wear: Array) -> float:
        """Return the largest ratio of its wear and another one."""
        now = wear.sum(axis=0)
        both = np.array([now, self._wear])
        least, most = both.min(axis=0), both.max(axis=0)
        return float((most / np.where(least > 0, least, np.where(most > 0, 1e-300, 1.0))).max(initial=0.0))

    def _entries(self, rows: Indices, columns: Indices) -> Array:
        found = self.mean.entries(rows, columns)
        i, j = np.equal.outer(rows, columns).nonzero()
        found[i, j] += self._wear[rows[i]]
        return found

    def on(self, touched: Indices) -> Solve:
        """Return its product for the nodes that touch."""
        solve, own = self._updating.factor(touched), self._wear[touched]
        # S (S + D)^-1 v = v - D (S + D)^-1 v
        return lambda v: v - own * solve(v)


class _Together:
    """The solution of phases that open each other by their wear."""

    def __init__(
        self, phases: ManyNodes, kept: Indices, own: Sequence[Indices], apart: Callable[[Array], list[Array]]
    ) -> None:
        n = phases.blocks[0].nodes
        every: Sequence[Array] = [] if phases.wear is None else list(phases.wear)
        self._phases, self._kept, self._apart = phases, kept, apart
        self._nodes = [rows[rows < n] for rows in own]
        self._touched = np.unique(np.concatenate(self._nodes)).astype(np.int32)
        self._at = [np.searchsorted(self._touched, nodes) for nodes in self._nodes]
        self._wear = [wear[nodes] for wear, nodes in zip(every, self._nodes, strict=True)]
        self._lengths = [len(rows) for rows in own]
        self._near = phases.near[0].on(self._touched)

    def _depth(self, parts: Sequence[Array]) -> Array:
        """Return the depth that the phases' pressures wear at the nodes that touch."""
        depth = np.zeros(len(self._touched))
        for at, wear, part in zip(self._at, self._wear, parts, strict=True):
            depth[at] += wear * part[: len(at)]
        return depth

    def _by_depth(self, depth: Array) -> list[Array]:
        """Return what the phases answer to a gap."""
        right = [np.zeros(length) for length in self._lengths]
        for one, at in zip(right, self._at, strict=True):
            one[: len(at)] = depth[at]
        return self._apart(np.concatenate(right))

    def solve(self, b: Array) -> Array:
        """Return the unknowns."""
        first = self._apart(b)
        try:
            depth = gmres_solution(
                lambda y: y + self._depth(self._by_depth(y)), self._near, self._depth(first), enough=ENOUGH
            )
        except NotSolvedError:
            return self._whole(b)
        return np.concatenate(first) - np.concatenate(self._by_depth(depth))

    def _whole(self, b: Array) -> Array:
        blocks, wear = self._phases.blocks, self._phases.wear
        border = None
        if wear is not None:
            ones = np.eye(wear.shape[1])
            border = (np.broadcast_to(ones, (len(wear), *ones.shape)), wear[:, :, None] * ones)
        whole = np.array([block.matrix() for block in blocks])
        if self._phases.layer is not None:
            nodes = np.arange(self._phases.layer.shape[1])
            whole[:, nodes, nodes] += self._phases.layer
        return Phases(whole, None, border).factor(self._kept)(b)
