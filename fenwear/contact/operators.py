"""Square matrices as an active-set method needs them: a product, and factors of some of their rows and columns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgetrf, dgetrs
from scipy.sparse import coo_array, csc_array, csr_array

from fenwear.arrays import Array
from fenwear.contact.krylov import NotSolvedError, iterative

Indices = NDArray[np.int32]
Solve = Callable[[Array], Array]
SINGULAR = 1e-14  # of the largest entry: a pivot that is rounding
TINY = 1e-300
LARGE = 300  # unknowns above which a factor follows its set; below it a new one costs as little
UPDATES = 0.1  # of the unknowns of a factor: what may have come and gone before a new one is made
ITERATED = 1000  # unknowns from which on a set that is far from the factor's may be solved by iterations
FACTOR, COLUMN = 0.03, 0.1  # products that cost as much: a factor for each unknown, a column of an update (measured)
ITERATIONS = 40  # that a solution takes, before there was one
BORDERS = 12  # rows without a diagonal entry, as the balance of forces has none, that iterations go with
DENSE = 400  # unknowns up to which one elimination of the whole beats one for each block


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
            below: How far below zero it may be at the bounds.

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

    A large set that is far from K is solved by iterations, until as much was spent on them as a factor costs: so
    whatever comes, it takes about twice the time at most of who knows it before. Costs are counted, not measured by a
    clock: every process comes to the same decision.

    Args:
        entries: Returns the numbers of some rows and columns.
        diagonal: The numbers on the diagonal (size,); without them there are no iterations.
        multiply: The product with the whole matrix; None to have that of the entries.
        cost: Of that product, in entries of a matrix in memory that could be multiplied meanwhile.

    Attributes:
        base: What was eliminated last.
        iterations: All that there were.
    """

    def __init__(
        self,
        entries: Callable[[Indices, Indices], Array],
        diagonal: Array | None = None,
        multiply: Callable[[Array], Array] | None = None,
        cost: float | None = None,
    ) -> None:
        self._entries, self._multiply, self._diagonal, self._cost = entries, multiply, diagonal, cost
        self.base: _Base | None = None
        self.iterations = 0
        self._expected = ITERATIONS
        self._spent = 0.0  # on iterations since the last factor, in entries
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
            if len(into) + len(out) <= UPDATES * len(base.kept) and self._update_pays(base, into, out):
                return self._updated(base, kept, into, out)
        if self._diagonal is not None and len(kept) >= ITERATED and self._spent < FACTOR * len(kept) ** 3:
            solve = self._by_iterations(kept, self._diagonal)
            if solve is not None:
                return solve
        return self._eliminated(kept)

    def _update_pays(self, base: _Base, into: Indices, out: Indices) -> bool:
        """Return whether what has come and gone costs less than iterations."""
        size = len(base.kept)
        if self._diagonal is None or size < ITERATED:
            return True
        new = sum(int(i) not in self._columns for i in (*into, *out))
        return COLUMN * new * size**2 <= self._expected * self._product_cost(size)

    def _product_cost(self, size: int) -> float:
        return float(size**2) if self._cost is None or self._multiply is None else self._cost

    def _eliminated(self, kept: Indices) -> Solve:
        self.base, self._columns, self._spent = None, {}, 0.0
        solve = eliminate(self._entries(kept, kept))
        place = np.full(int(kept.max(initial=0)) + 1, -1)
        place[kept] = np.arange(len(kept))
        self.base = _Base(kept, place, solve)
        return solve

    def _by_iterations(self, kept: Indices, diagonal: Array) -> Solve | None:
        """Return the solution operator by GMRES; None where the matrix is none for it."""
        own = diagonal[kept]
        border = np.flatnonzero(np.abs(own) <= SINGULAR * np.abs(own).max(initial=0.0))
        if len(border) > BORDERS:
            return None
        near, multiply = _bordered(own, border, kept, self._entries), self._product(kept)
        try:
            solve = iterative(multiply, near, lambda iterations: self._count(iterations, len(kept)))
        except np.linalg.LinAlgError:
            return None

        eliminated: Solve | None = None

        def solve_or_eliminate(b: Array) -> Array:
            nonlocal eliminated
            if eliminated is None and self._spent < FACTOR * len(kept) ** 3:
                try:
                    return solve(b)
                except NotSolvedError:
                    pass
            if eliminated is None:  # a set that stays has its factor in the end
                eliminated = self._eliminated(kept)
            return eliminated(b)

        return solve_or_eliminate

    def _count(self, iterations: int, size: int) -> None:
        self.iterations += iterations
        self._expected = iterations
        self._spent += iterations * self._product_cost(size)

    def _product(self, kept: Indices) -> Callable[[Array], Array]:
        """Return the product with the rows and columns `kept`."""
        if self._multiply is None:
            matrix = self._entries(kept, kept)
            return lambda x: matrix @ x
        multiply, whole = self._multiply, np.zeros(len(self._diagonal if self._diagonal is not None else kept))

        def product(x: Array) -> Array:
            whole[kept] = x.ravel()
            return multiply(whole)[kept]

        return product

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
            first: Array = np.zeros(size)
            first[stayed] = b[from_base]
            first = base.solve(first)
            y = solve_schur(np.concatenate([b[from_new] - rows @ first, -first[gone]]))
            x = np.empty_like(b)
            x[from_base] = (first - columns @ y)[stayed]
            x[from_new] = y[:come]
            return x

        return solve


def _bordered(
    own: Array, border: NDArray[np.int64], kept: Indices, entries: Callable[[Indices, Indices], Array]
) -> csc_array:
    """Return the diagonal of some rows and columns, with the whole of those rows and columns that have none."""
    size, inner = len(kept), np.setdiff1d(np.arange(len(kept)), border)
    parts = [(inner, inner, own[inner])]
    if len(border):
        rows, columns = entries(kept[border], kept), entries(kept[inner], kept[border])
        every = np.arange(size)
        parts.append((np.repeat(border, size), np.tile(every, len(border)), rows.ravel()))
        parts.append((np.repeat(inner, len(border)), np.tile(border, len(inner)), columns.ravel()))
    i, j, values = (np.concatenate(part) for part in zip(*parts, strict=True))
    return csc_array(coo_array((values, (i, j)), shape=(size, size)))


class Dense:
    """A matrix of numbers (size, size)."""

    def __init__(self, matrix: Array) -> None:
        self.matrix = matrix
        self._updating = Updating(lambda rows, columns: matrix[np.ix_(rows, columns)], matrix.diagonal())

    def multiply(self, x: Array) -> Array:
        """Return the matrix times x."""
        return self.matrix @ x

    def factor(self, kept: Indices) -> Solve:
        """Return the solution operator of the rows and columns `kept`."""
        if len(kept) > LARGE:
            return self._updating.factor(kept)
        return eliminate(self.matrix[np.ix_(kept, kept)])


@dataclass(frozen=True)
class Shifted:
    """A matrix of numbers (size, size) with others (n,) added to the first of its diagonal."""

    matrix: Array
    added: Array

    def multiply(self, x: Array) -> Array:
        """Return the matrix times x."""
        found: Array = self.matrix @ x
        found[: len(self.added)] += self.added * x[: len(self.added)]
        return found

    def factor(self, kept: Indices) -> Solve:
        """Return the solution operator of the rows and columns `kept`."""
        part, first = self.matrix[np.ix_(kept, kept)], np.searchsorted(kept, len(self.added))
        part.flat[: first * (len(kept) + 1) : len(kept) + 1] += self.added[kept[:first]]
        return eliminate(part)


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
    """Return the same by a matrix whose rows and columns are scaled to 1.

    Where steps wear far more than bodies give way, as rigid ones do, a pivot of the balance of forces is small against
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


class Phases:
    """The blocks of the phases of a cycle, and what they meet in: diag(A_k) + C_kj + diag(d_j) + L_k R_j.

    Args:
        blocks: A_k (m, size, size).
        coupling: C (m, n, m, n) on the first n unknowns of each block; None where there is none.
        border: L (m, n, q) and R (m, q, n), on the same; None where there is none.
        local: d (m, n), in place of a border: what each unknown of phase j adds to its own place in all phases.
    """

    def __init__(
        self,
        blocks: Array,
        coupling: Array | None = None,
        border: tuple[Array, Array] | None = None,
        local: Array | None = None,
    ) -> None:
        m, size, _ = blocks.shape
        self.blocks, self.border = blocks, border
        self._whole: Dense | None = None
        if m == 1 and coupling is None and border is None and local is None:
            self._whole = Dense(blocks[0])
        elif m == 1 or coupling is not None or m * size <= DENSE:
            self._whole = Dense(whole(blocks, coupling, border, local))
        elif local is not None:
            unit, n = np.eye(local.shape[1]), local.shape[1]
            self.border = np.broadcast_to(unit, (m, n, n)), unit * local[:, None, :]

    def multiply(self, x: Array) -> Array:
        """Return the matrix times x (m size,)."""
        if self._whole is not None:
            return self._whole.multiply(x)
        parts = x.reshape(len(self.blocks), -1)
        result = np.matmul(self.blocks, parts[:, :, None])[:, :, 0]
        if self.border is not None:
            left, right = self.border
            n = left.shape[1]
            result[:, :n] += left @ np.einsum("kqn,kn->q", right, parts[:, :n])
        return result.ravel()

    def factor(self, kept: Indices) -> Solve:
        """Return the solution operator of the rows and columns `kept`.

        With z_k = A_k^-1 b_k and Y_k = A_k^-1 L_k the quantities y between the blocks follow from
        (I + sum of R_k Y_k) y = sum of R_k z_k, and x_k = z_k - Y_k y: the work grows with the number of
        blocks, where an elimination of the whole would grow with its cube.
        """
        if self._whole is not None:
            return self._whole.factor(kept)
        m, size, _ = self.blocks.shape
        cuts = list(np.searchsorted(kept, np.arange(m + 1) * size))
        own: list[Indices] = [kept[cuts[k] : cuts[k + 1]] - k * size for k in range(m)]
        solves = [eliminate(self.blocks[k][np.ix_(rows, rows)]) for k, rows in enumerate(own)]
        if self.border is None:
            return lambda b: np.concatenate([solve(b[cuts[k] : cuts[k + 1]]) for k, solve in enumerate(solves)])
        left, right = self.border
        n, q = left.shape[1:]
        columns: list[Array] = []
        rights: list[Array] = []
        schur: Array = np.eye(q)
        for k, (solve_block, rows) in enumerate(zip(solves, own, strict=True)):
            nodes = rows[rows < n]
            by_between = np.zeros((len(rows), q))
            by_between[: len(nodes)] = left[k][nodes]
            columns.append(solve_block(by_between))
            rights.append(right[k][:, nodes])
            schur = schur + rights[k] @ columns[k][: len(nodes)]
        solve_schur = eliminate(schur)

        def solve(b: Array) -> Array:
            parts = [solve_block(b[cuts[k] : cuts[k + 1]]) for k, solve_block in enumerate(solves)]
            between = np.zeros(q)
            for at, part in zip(rights, parts, strict=True):
                between += at @ part[: at.shape[1]]
            y = solve_schur(between)
            return np.concatenate([part - by @ y for part, by in zip(parts, columns, strict=True)])

        return solve


def whole(blocks: Array, coupling: Array | None, border: tuple[Array, Array] | None, local: Array | None) -> Array:
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
