"""Contacts of so many nodes that no rank has the whole compliance: each has a run of its rows, and rank 0 leads.

Rank 0 takes every decision of the active-set method, and asks all ranks for products with their own rows: one vector
goes out, its image comes back. Sets of few nodes are eliminated on rank 0, as in a contact on one rank. Those of
many are solved by GMRES on the operator, with z = M^-1 v of

    M = [D, H; E, 0],    D = runs of neighbouring nodes, eliminated on the rank that has their rows,

so that no rank needs more than its own rows, and iterations hardly depend on the number of ranks.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.contact.blocks import Columns, PhaseBlock
from fenwear.contact.krylov import NotSolvedError, gmres_solution
from fenwear.contact.operators import Indices, Solve, Updating, eliminate
from fenwear.parallel import Rows, Team

FEW = 2000  # unknowns of a set up to which rank 0 eliminates it
RUN = 500  # neighbouring nodes that are eliminated together
ENOUGH = 1e-12  # residual, scaled to 1, that ends the iterations: a tenth of the inequality's


class OwnRows:
    """This rank's rows of a compliance S, and of the preconditioner.

    Args:
        rows: Of each rank.
        make: Returns this rank's rows of some columns (own, k).
    """

    def __init__(self, rows: Rows, make: Callable[[NDArray[np.int64]], Array]) -> None:
        first, last = rows.own.start, rows.own.stop
        self._first, self._last = first, last
        self._columns = Columns(int(rows.starts[-1]), make, rows=last - first)
        self._runs: dict[int, tuple[bytes, Solve]] = {}  # nodes and wear of each run, and its factor
        self._cuts: list[tuple[slice, Solve]] = []

    def multiply(self, x: Array) -> Array:
        """Return own rows of S x (own,)."""
        return self._columns.apply(x)

    def entries(self, rows: Indices, columns: Indices) -> Array:
        """Return the numbers of those of the rows, ascending, that are own, in some columns."""
        return self._columns.entries(rows[slice(*self._own(rows))] - np.int32(self._first), columns)

    def _own(self, rows: Indices) -> NDArray[np.int64]:
        return np.searchsorted(rows, [self._first, self._last])

    def prepare(self, nodes: Indices, wear: Array) -> bool:
        """Eliminate the runs of own nodes of a set, ascending, with wear on their diagonal; return whether all can be.

        Runs whose nodes and wear have stayed keep their factors.
        """
        begin, end = self._own(nodes)
        own, worn = nodes[begin:end], wear[begin:end]
        cuts = np.append(np.flatnonzero(np.diff(own // RUN, prepend=-1)), len(own))
        kept, self._cuts, self._runs = self._runs, [], {}
        for first, last in pairwise(cuts):
            some, extra = own[first:last], worn[first:last]
            run, key = int(some[0]) // RUN, some.tobytes() + extra.tobytes()
            found = kept.get(run)
            if found is None or found[0] != key:
                matrix = self._columns.entries(some - np.int32(self._first), some) + np.diag(extra)
                try:
                    found = key, eliminate(matrix)
                except np.linalg.LinAlgError:
                    return False
            self._runs[run] = found
            self._cuts.append((slice(int(begin + first), int(begin + last)), found[1]))
        return True

    def near(self, v: Array) -> Array:
        """Return own rows of D^-1 v of the prepared set."""
        return np.concatenate([np.zeros(0), *(solve(v[cut]) for cut, solve in self._cuts)])


class SpreadCompliance:
    """A compliance whose rows the ranks share, for rank 0 to ask for while it leads.

    Args:
        team: The ranks.
        own: This rank's rows.
    """

    def __init__(self, team: Team, own: OwnRows) -> None:
        self.team, self.own = team, team.serve(own)

    cost: float | None = None  # its numbers are in the ranks' memory

    def apply(self, x: Array) -> Array:
        """Return S x (n,)."""
        return np.concatenate(self.team.call(self.own, "multiply", x))

    def entries(self, rows: Indices, columns: Indices) -> Array:
        """Return the numbers of some rows and columns."""
        order = np.argsort(rows, kind="stable")
        found: Array = np.empty((len(rows), len(columns)))
        found[order] = np.concatenate(self.team.call(self.own, "entries", rows[order], columns))
        return found


class DistributedBlock(PhaseBlock):
    """[S, H; E, 0] of one phase whose compliance the ranks share."""

    def __init__(self, compliance: SpreadCompliance, diagonal: Array, modes: Array, balance: Array) -> None:
        self.spread = compliance
        super().__init__(compliance, diagonal, modes, balance)

    def factors(self, entries: Callable[[Indices, Indices], Array], diagonal: Array | None, wear: Array) -> Updating:
        """Return the factors of its sets, or what solves for large ones."""
        return _Spread(self, entries, diagonal, wear)


class _Spread(Updating):
    """Factors of sets of few unknowns on rank 0; of many, iterations of all ranks."""

    def __init__(
        self, block: DistributedBlock, entries: Callable[[Indices, Indices], Array], diagonal: Array | None, wear: Array
    ) -> None:
        super().__init__(entries, diagonal)
        self._block, self._wear = block, wear

    def factor(self, kept: Indices) -> Solve:
        """Return the solution operator of the rows and columns `kept`.

        Raises:
            LinAlgError: they are singular.
        """
        return super().factor(kept) if len(kept) <= FEW else self._by_all(kept)

    def _by_all(self, kept: Indices) -> Solve:
        block, spread = self._block, self._block.spread
        n, count = block.nodes, int((kept < block.nodes).sum())
        nodes, modes = kept[:count], kept[count:] - np.int32(n)
        wear = self._wear[nodes]
        if not all(spread.team.call(spread.own, "prepare", nodes, wear)):
            raise np.linalg.LinAlgError("singular matrix")

        def inner(v: Array) -> Array:
            return np.concatenate(spread.team.call(spread.own, "near", v))

        opened, balance = block.modes[np.ix_(nodes, modes)], block.balance[np.ix_(modes, nodes)]
        followed = np.array([inner(mode) for mode in opened.T]).reshape(len(modes), count).T  # D^-1 H
        solve_modes = eliminate(balance @ followed)
        whole = np.zeros(block.size)

        def precondition(v: Array) -> Array:
            z = inner(v[:count])
            a = solve_modes(balance @ z - v[count:])
            return np.concatenate([z - followed @ a, a])

        def multiply(x: Array) -> Array:
            whole[kept] = x.ravel()
            image = block.multiply(whole)[kept]
            image[:count] += wear * x.ravel()[:count]
            return image

        def solve(b: Array) -> Array:
            try:
                return gmres_solution(multiply, precondition, b, self._iterated, ENOUGH)
            except NotSolvedError:
                return self._eliminated(kept)(b)

        return solve

    def _iterated(self, iterations: int) -> None:
        self.iterations += iterations
