"""Linear complementarity by Lemke's method: slow, but it ends where sets of nodes in contact go round.

Find z >= 0 with w = M z + q >= 0 and z'w = 0 (C. E. Lemke, Management Science 11, 1965; R. W. Cottle, J.-S. Pang,
R. E. Stone, The Linear Complementarity Problem, Academic Press 1992, 4.4). All conditions are fulfilled at first by one
number that is added to every w; pivots that let one unknown in and another one out take it down to zero. For matrices
that are positive semidefinite, as those of contact without friction are, they end at a solution wherever there is one.
"""

from __future__ import annotations

import numpy as np

from fenwear.arrays import Array, Mask
from fenwear.errors import ConvergenceError

PIVOTS = 20  # at most, times the number of unknowns
SMALLEST = 1e-10  # pivot, of columns that are scaled to 1
TIE = 1e-12  # of ratios, within which they are the same


def complementary(matrix: Array, vector: Array, free: Mask) -> Array:
    """Return x with F = M x + q: F >= 0, x >= 0 and x'F = 0, but F = 0 and any x where it is free (size,).

    Args:
        matrix: M (size, size), such as [[S, N], [E, 0]] of pressures and rigid motions, E about a multiple of N'.
        vector: q (size,).
        free: Which unknowns have no bound (size,).

    Raises:
        ConvergenceError: there is no solution, or none that pivots find.
    """
    bounded, both = np.flatnonzero(~free), np.flatnonzero(free)
    # What is free is the difference of two that are not. With its rows turned round, M is as monotone as its part S is.
    rows = np.concatenate([bounded, both, both])
    sign = np.repeat([1.0, 1.0, -1.0], [len(bounded), len(both), len(both)])
    turned = np.where(free[rows], -sign, 1.0)
    z = _lemke(turned[:, None] * matrix[np.ix_(rows, rows)] * sign, turned * vector[rows])
    x = np.zeros(len(vector))
    np.add.at(x, rows, sign * z)
    return x


def _lemke(matrix: Array, vector: Array) -> Array:
    """Return z >= 0 with M z + q >= 0 and z'(M z + q) = 0 (n,).

    Raises:
        ConvergenceError: pivots end in a ray, or do not end.
    """
    n = len(vector)
    if (vector >= 0).all():
        return np.zeros(n)
    # Columns: w, z, what is added to all w, and the values of the unknowns that are in.
    tableau = np.hstack([np.eye(n), -matrix, -np.ones((n, 1)), vector[:, None]])
    inside = np.arange(n)
    row, entering = int(np.argmin(vector)), 2 * n
    for _ in range(PIVOTS * n):
        leaving = int(inside[row])
        tableau[row] /= tableau[row, entering]
        column = tableau[:, entering].copy()
        column[row] = 0.0
        tableau -= np.outer(column, tableau[row])
        inside[row] = entering
        if leaving == 2 * n:
            found = np.zeros(2 * n + 1)
            found[inside] = tableau[:, -1]
            return found[n : 2 * n]
        entering = leaving + n if leaving < n else leaving - n
        row = _leaving(tableau, tableau[:, entering], inside == 2 * n)
    raise ConvergenceError("Lemke's method does not end")


def _leaving(tableau: Array, column: Array, last: Mask) -> int:
    """Return the row of the unknown that comes to zero first as that of a column grows: what is added, if it may be.

    Raises:
        ConvergenceError: none does.
    """
    rows = np.flatnonzero(column > SMALLEST * np.abs(column).max())
    if not len(rows):
        raise ConvergenceError("Lemke's method ends in a ray")
    ratios = tableau[rows, -1] / column[rows]
    ties = rows[ratios <= ratios.min() + TIE * max(1.0, abs(ratios.min()))]
    if last[ties].any():
        return int(ties[np.argmax(last[ties])])
    if len(ties) == 1:
        return int(ties[0])
    # Lexicographic order: no set of unknowns comes twice.
    ordered = tableau[ties, : len(tableau)] / column[ties, None]
    return int(ties[np.lexsort(ordered.T[::-1])[0]])
