"""Square matrices as an active-set method needs them: a product, and factors of some of their rows and columns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgetrf, dgetrs
from scipy.sparse import csr_array

from fenwear.algebra.krylov import solution
from fenwear.common.arrays import Array

Indices = NDArray[np.int32]
Solve = Callable[[Array], Array]
SINGULAR = 1e-14  # of the largest entry: a pivot that is rounding
TINY = 1e-300
LARGE = 300  # unknowns above which a factor follows its set; below it a new one costs as little
UPDATES = 0.1  # of the unknowns of a factor: what may have come and gone before a new one is made
DENSE = 400  # unknowns up to which one elimination of the whole beats one for each block
DIRECT = 150  # nodes up to which what all phases open is eliminated; above it GMRES costs less
ALIKE, KEPT = 1.5, 3  # ratio of wear up to which a preconditioner serves; how many are kept


class Operator(Protocol):
    """A square matrix."""

    def multiply(self, x: Array) -> Array:
        """Return the matrix times x."""

    def factor(self, kept: Indices) -> Solve:
        """Return the solution operator of the rows and columns `kept`, ascending.

        Raises:
            LinAlgError: they are singular.
        """


@runtime_checkable
class Approximate(Protocol):
    """An operator whose solutions cost by their digits."""

    def improved(self, x: Array, f: Array, enough: float, below: float) -> Array:
        """Return unknowns within their bounds that fulfil the inequality better than others, by some digits.

        Args:
            x: Unknowns within their bounds.
            f: Their residual.
            enough: The norm of it that need not be less.
            below: Largest negative value that is allowed at the bounds.

        Raises:
            LinAlgError: there are none.
        """


@dataclass(frozen=True)
class _Base:
    """A set that was eliminated, and where each of its unknowns stands in it (size,), -1 for the others."""

    kept: Indices
    place: NDArray[np.int64]
    solve: Solve


class Updating:
    """Factors of sets that differ by a few unknowns from one that was eliminated.

    With K the set that was eliminated, i what has come since and o what has gone, the rows and columns
    kept now are solved by the bordered system

        A_KK x + A_Ki y + E_o z = b_K,    A_iK x + A_ii y = b_i,    E_o^T x = 0,

    whose Schur complement has as many rows as unknowns have come and gone. Columns once solved for are kept.

    Args:
        entries: Returns the numbers of some rows and columns.

    Attributes:
        base: The last elimination.
    """

    def __init__(self, entries: Callable[[Indices, Indices], Array]) -> None:
        self._entries = entries
        self.base: _Base | None = None
        self._columns: dict[int, Array] = {}  # solutions by the base of what has come or gone

    def factor(self, kept: Indices) -> Solve:
        """Return the solution operator of the rows and columns `kept`.

        Raises:
            LinAlgError: they are singular.
        """
        base = self.base
        if base is not None:
            into = np.setdiff1d(kept, base.kept, assume_unique=True)
            out = np.setdiff1d(base.kept, kept, assume_unique=True)
            if not len(into) + len(out):
                return base.solve
            if len(into) + len(out) <= UPDATES * len(base.kept):
                return self._updated(base, kept, into, out)
        self.base, self._columns = None, {}
        solve = eliminate(self._entries(kept, kept))
        place = np.full(int(kept.max(initial=0)) + 1, -1)
        place[kept] = np.arange(len(kept))
        self.base = _Base(kept, place, solve)
        return solve

    def _updated(self, base: _Base, kept: Indices, into: Indices, out: Indices) -> Solve:
        size, come = len(base.kept), len(into)
        gone = base.place[out]
        come_new = [i for i in map(int, into) if i not in self._columns]
        gone_new = [i for i in map(int, out) if i not in self._columns]
        if come_new or gone_new:
            right = np.zeros((size, len(come_new) + len(gone_new)), order="F")
            right[:, : len(come_new)] = self._entries(base.kept, np.array(come_new, dtype=np.int32))
            right[base.place[gone_new], len(come_new) + np.arange(len(gone_new))] = 1.0
            self._columns.update(zip((*come_new, *gone_new), base.solve(right).T, strict=True))
        columns = np.array([self._columns[int(i)] for i in np.concatenate([into, out])]).T
        rows = self._entries(into, base.kept)
        schur = np.zeros((come + len(out), come + len(out)))
        schur[:come, :come] = self._entries(into, into)
        schur[:come] -= rows @ columns
        schur[come:] -= columns[gone]
        solve_schur = eliminate(schur)
        from_base = np.searchsorted(kept, np.delete(base.kept, gone))
        stayed, from_new = np.delete(np.arange(size), gone), np.searchsorted(kept, into)

        def solve(b: Array) -> Array:
            first: Array = np.zeros((size, *b.shape[1:]))
            first[stayed] = b[from_base]
            first = base.solve(first)
            y = solve_schur(np.concatenate([b[from_new] - rows @ first, -first[gone]]))
            x = np.empty_like(b)
            x[from_base] = (first - columns @ y)[stayed]
            x[from_new] = y[:come]
            return x

        return solve


class Dense:
    """A matrix of numbers (size, size)."""

    def __init__(self, matrix: Array) -> None:
        self.matrix = matrix
        self._updating = Updating(lambda rows, columns: matrix[np.ix_(rows, columns)])

    def multiply(self, x: Array) -> Array:
        """Return the matrix times x."""
        return self.matrix @ x

    def factor(self, kept: Indices) -> Solve:
        """Return the solution operator of the rows and columns `kept`."""
        if len(kept) > LARGE:
            return self._updating.factor(kept)
        return eliminate(self.matrix[np.ix_(kept, kept)])


def eliminate(matrix: Array) -> Solve:
    """Return the solution operator of a matrix, for one right-hand side or columns of them.

    Raises:
        LinAlgError: it is singular.
    """
    if not len(matrix):
        return np.zeros_like
    lu, pivots, _ = dgetrf(matrix)
    if not np.abs(np.diagonal(lu)).min() > SINGULAR * np.abs(matrix).max():
        return _equilibrated(matrix)

    def solve(b: Array) -> Array:
        x: Array = dgetrs(lu, pivots, b)[0]
        return x

    return solve


def _equilibrated(matrix: Array) -> Solve:
    """Return the solver of a matrix, by rows and columns that are scaled to 1.

    Where steps wear far more than bodies deform, as with rigid ones, a pivot of the balance of forces is small against
    the wear of a node, and no rounding.
    """
    row = 1 / np.maximum(np.abs(matrix).max(axis=1), TINY)
    column = 1 / np.maximum((np.abs(matrix) * row[:, None]).max(axis=0), TINY)
    lu, pivots, _ = dgetrf(row[:, None] * matrix * column)
    if not np.abs(np.diagonal(lu)).min() > SINGULAR:
        raise np.linalg.LinAlgError("singular matrix")

    def solve(b: Array) -> Array:
        x: Array = (dgetrs(lu, pivots, (b.T * row).T)[0].T * column).T
        return x

    return solve


class Blocks:
    """The matrices A_k = [S_k, H; E_k, 0] of m phases, n pressures and the rigid modes each, and what is kept of them.

    Args:
        matrices: (m, size, size).
        nodes: n; the other unknowns are those of rigid modes.
    """

    def __init__(self, matrices: Array, nodes: int) -> None:
        self.matrices, self.nodes = matrices, nodes
        self.parts = [Dense(matrix) for matrix in matrices]
        self.depths = Depths(np.zeros(nodes), np.zeros((nodes, nodes)))  # of the last step that was eliminated

    def added(self, diagonal: Array) -> Blocks:
        """Return the blocks with numbers (m, n) added to the diagonal of each phase."""
        blocks, every = self.matrices.copy(), np.arange(self.nodes)
        blocks[:, every, every] += diagonal
        return Blocks(blocks, self.nodes)


class Depths:
    """Solution operators of 1 + sum of D_k A_k^-1 on nodes that touch, near to those of other nodes and other wear.

    Args:
        wear: D_k summed up (n,), of the matrix.
        matrix: Sum of D_k A_k^-1 (n, n); zero at nodes that do not touch.
    """

    def __init__(self, wear: Array, matrix: Array) -> None:
        self.wear, self.matrix = wear, matrix
        self._factored: list[tuple[Array, Dense]] = []  # of the last steps, by their wear

    def factor(self, wear: Array, touched: Indices) -> Solve:
        """Return the solution operator of a wear (n,); that of another step serves whose wear is alike."""
        self._factored.sort(key=lambda step: _unlike(step[0], wear))
        if not self._factored or _unlike(self._factored[0][0], wear) > ALIKE:
            ratio = wear / np.where(self.wear > 0, self.wear, 1.0)
            self._factored.insert(0, (wear, Dense(np.eye(len(wear)) + ratio[:, None] * self.matrix)))
            del self._factored[KEPT:]
        return self._factored[0][1].factor(touched)


def _unlike(wear: Array, other: Array) -> float:
    """Return the largest ratio of two wears (n,)."""
    both = np.array([wear, other])
    least, most = both.min(axis=0), both.max(axis=0)
    return float((most / np.where(least > 0, least, np.where(most > 0, TINY, 1.0))).max(initial=0.0))


def joined(
    blocks: Blocks,
    coupling: Array | None = None,
    border: tuple[Array, Array] | None = None,
    local: Array | None = None,
) -> Dense | Phases:
    """Return diag(A_k) + C_kj + L_k R_j, the phases of a cycle and what they meet in, as it is solved best.

    Args:
        blocks: A_k.
        coupling: C (m, n, m, n) on the nodes; None where there is none.
        border: L (m, n, q) and R (m, q, n), on the same; None where there is none.
        local: D (m, n), in place of a border: what unit pressures wear at their own nodes opens all phases.
    """
    m, size, _ = blocks.matrices.shape
    apart = coupling is None and border is None and local is None
    if m == 1 and apart:
        return blocks.parts[0]
    if m == 1 or coupling is not None or m * size <= DENSE:
        return Dense(dense_matrix(blocks.matrices, coupling, border, local))
    if local is not None:
        return Bordered(blocks, *_as_border(local)) if blocks.nodes <= DIRECT else Worn(blocks, local)
    return Phases(blocks) if border is None else Bordered(blocks, *border)


class _Cut:
    """Some unknowns of all phases (ascending), and the factors of each phase's."""

    def __init__(self, blocks: Blocks, kept: Indices) -> None:
        size, m = blocks.matrices.shape[1], len(blocks.parts)
        self.kept = kept
        self.cuts = list(pairwise(np.searchsorted(kept, np.arange(m + 1) * size)))
        rows = [kept[low:high] - np.int32(k * size) for k, (low, high) in enumerate(self.cuts)]
        self.nodes: list[Indices] = [indices[indices < blocks.nodes] for indices in rows]
        self.solves = [part.factor(indices) for part, indices in zip(blocks.parts, rows, strict=True)]

    def solve(self, b: Array) -> list[Array]:
        """Return the solution of each phase by itself."""
        return [solve(b[low:high]) for solve, (low, high) in zip(self.solves, self.cuts, strict=True)]


class Phases:
    """Phases that meet nowhere: diag(A_k).

    Args:
        blocks: A_k.
    """

    def __init__(self, blocks: Blocks) -> None:
        self.blocks = blocks

    @cached_property
    def matrix(self) -> Array:
        """All of it (m size, m size)."""
        return dense_matrix(self.blocks.matrices)

    def multiply(self, x: Array) -> Array:
        """Return the matrix times x (m size,)."""
        n, parts = self.blocks.nodes, x.reshape(len(self.blocks.parts), -1)
        result = np.matmul(self.blocks.matrices, parts[:, :, None])[:, :, 0]
        self._open(parts[:, :n], result[:, :n])
        return result.ravel()

    def factor(self, kept: Indices) -> Solve:
        """Return the solution operator of the rows and columns `kept`.

        Raises:
            LinAlgError: they are singular.
        """
        return self._solution(_Cut(self.blocks, kept))

    def _open(self, pressure: Array, gaps: Array) -> None:
        """Add to gaps (m, n) what pressures (m, n) open in all phases: nothing."""

    def _solution(self, cut: _Cut) -> Solve:
        """Return the solution operator of some unknowns."""
        return lambda b: np.concatenate(cut.solve(b))


class Bordered(Phases):
    """Phases that meet in few quantities: diag(A_k) + L_k R_j, with L (m, n, q) and R (m, q, n)."""

    def __init__(self, blocks: Blocks, left: Array, right: Array) -> None:
        super().__init__(blocks)
        self.left, self.right = left, right

    @cached_property
    def matrix(self) -> Array:
        """All of it (m size, m size)."""
        return dense_matrix(self.blocks.matrices, border=(self.left, self.right))

    def _open(self, pressure: Array, gaps: Array) -> None:
        gaps += self.left @ np.einsum("kqn,kn->q", self.right, pressure)

    def _solution(self, cut: _Cut) -> Solve:
        """Return the solution operator, with the unknowns between the phases eliminated.

        With z_k = A_k^-1 b_k and Y_k = A_k^-1 L_k the quantities y between the blocks follow from
        (I + sum of R_k Y_k) y = sum of R_k z_k, and x_k = z_k - Y_k y: the work grows with the number of
        blocks, where an elimination of the whole would grow with its cube.
        """
        count = self.left.shape[2]
        columns, rights, schur = list[Array](), list[Array](), np.eye(count)
        for k, (solve_block, nodes, (low, high)) in enumerate(zip(cut.solves, cut.nodes, cut.cuts, strict=True)):
            by_between = np.zeros((high - low, count))
            by_between[: len(nodes)] = self.left[k][nodes]
            columns.append(solve_block(by_between))
            rights.append(self.right[k][:, nodes])
            schur += rights[k] @ columns[k][: len(nodes)]
        solve_schur = eliminate(schur)

        def solve(b: Array) -> Array:
            parts = cut.solve(b)
            y = solve_schur(np.sum([at @ part[: at.shape[1]] for at, part in zip(rights, parts, strict=True)], axis=0))
            return np.concatenate([part - by @ y for part, by in zip(parts, columns, strict=True)])

        return solve


class Worn(Phases):
    """Phases that meet in a depth: unit pressure of phase k wears D_k (m, n) at its node, which opens all of them.

    The depth y that all phases have follows from

        (1 + sum of D_k A_k^-1) y = sum of D_k A_k^-1 b_k

    with the phases' factors, which do not change with the length of a step: by GMRES from the factor of another step.
    Another factor is made where it does not lead there in few iterations.
    """

    def __init__(self, blocks: Blocks, wear: Array) -> None:
        super().__init__(blocks)
        self.wear = wear

    @cached_property
    def matrix(self) -> Array:
        """All of it (m size, m size)."""
        return dense_matrix(self.blocks.matrices, local=self.wear)

    def _open(self, pressure: Array, gaps: Array) -> None:
        gaps += (self.wear * pressure).sum(axis=0)

    def _solution(self, cut: _Cut) -> Solve:
        blocks, wear = self.blocks, self.wear.sum(axis=0)
        touched = np.unique(np.concatenate(cut.nodes)).astype(np.int32)
        at = [np.searchsorted(touched, nodes) for nodes in cut.nodes]

        def worn(parts: Sequence[Array]) -> Array:
            depth = np.zeros(len(touched))
            for k, there in enumerate(at):
                depth[there] += self.wear[k, cut.nodes[k]] * parts[k][: len(there)]
            return depth

        def opened(depth: Array) -> list[Array]:
            right = np.zeros(len(cut.kept))
            for there, (low, _) in zip(at, cut.cuts, strict=True):
                right[low : low + len(there)] = depth[there]
            return cut.solve(right)

        def solve(b: Array) -> Array:
            first = cut.solve(b)
            right = worn(first)
            try:
                y = solution(lambda v: v + worn(opened(v)), blocks.depths.factor(wear, touched), right)
            except np.linalg.LinAlgError:
                blocks.depths = Depths(wear, self._depths(cut))
                y = blocks.depths.factor(wear, touched)(right)
            return np.concatenate(first) - np.concatenate(opened(y))

        return solve

    def _depths(self, cut: _Cut) -> Array:
        """Return the sum of D_k A_k^-1 of some unknowns (n, n)."""
        matrix = np.zeros((self.blocks.nodes, self.blocks.nodes))
        for k, (nodes, factor) in enumerate(zip(cut.nodes, cut.solves, strict=True)):
            low, high = cut.cuts[k]
            by_depth = factor(np.eye(int(high - low), len(nodes)))
            matrix[np.ix_(nodes, nodes)] += self.wear[k, nodes, None] * by_depth[: len(nodes)]
        return matrix


def _as_border(local: Array) -> tuple[Array, Array]:
    """Return L and R of the wear by unit pressures at their own nodes (m, n)."""
    m, n = local.shape
    unit = np.eye(n)
    return np.broadcast_to(unit, (m, n, n)), unit * local[:, None, :]


def dense_matrix(
    blocks: Array,
    coupling: Array | None = None,
    border: tuple[Array, Array] | None = None,
    local: Array | None = None,
) -> Array:
    """Return the matrix as one (m size, m size)."""
    m, size, _ = blocks.shape
    matrix: Array = np.zeros((m * size, m * size))
    view = matrix.reshape(m, size, m, size)
    for k, block in enumerate(blocks):
        view[k, :, k, :] = block
    if coupling is not None:
        n = coupling.shape[1]
        view[:, :n, :, :n] += coupling
    if border is not None:
        lefts, right = [csr_array(left) for left in border[0]], border[1]  # next to diagonal
        n = right.shape[2]
        for k, left in enumerate(lefts):
            for j in range(m):
                view[k, :n, j, :n] += left @ right[j]
    if local is not None:
        nodes = np.arange(local.shape[1])
        view[:, nodes, :, nodes] += local.T[:, None, :]
    return matrix
