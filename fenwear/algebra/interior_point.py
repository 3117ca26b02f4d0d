"""Linear complementarity by an interior-point method: slow, but it ends where sets of nodes in contact go round.

Find z >= 0 with w = M z + q >= 0 and z'w = 0. All z and w are kept above zero and led down the path on which their
products are alike, by Newton's method with Mehrotra's predictor and corrector (M. Kojima, N. Megiddo, T. Noma,
A. Yoshise, Lecture Notes in Computer Science 538, 1991; S. J. Wright, Primal-Dual Interior-Point Methods, SIAM 1997).
For matrices that are positive semidefinite, as those of contact without friction are, the path leads to a solution
wherever there is one, in a number of steps that hardly grows with that of unknowns.
"""

from __future__ import annotations

from contextlib import suppress

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lu_factor, lu_solve

from fenwear.common.arrays import Array, Mask
from fenwear.common.errors import ConvergenceError

STEPS = 100  # at most; contacts take 10 to 30
CLOSE = 1e-13  # of unknowns and residuals over the first ones, that ends them
FAR = 1e14  # of what is added to w, over the first one: there is no solution
SHORT = 0.995  # of the way to the nearest bound


def complementary(matrix: Array, vector: Array, free: Mask) -> Array:
    """Return x with F = M x + q: F >= 0, x >= 0 and x'F = 0, but F = 0 and any x where it is free (size,).

    Args:
        matrix: M (size, size), such as [[S, N], [E, 0]] of pressures and rigid motions, E about a multiple of N'.
        vector: q (size,).
        free: Which unknowns have no bound (size,).

    Raises:
        ConvergenceError: there is no solution, or none that steps find.
    """
    bounded = np.flatnonzero(~free)
    size = max(float(np.abs(vector).max()), 1.0)
    x: Array = np.where(free, 0.0, size)
    w: Array = np.full(len(bounded), size)
    for _ in range(STEPS):
        rest, products = matrix @ x + vector, x[bounded] * w
        rest[bounded] -= w
        if max(float(np.abs(rest).max()), float(products.mean()) / size) <= CLOSE * size:
            x[bounded[x[bounded] < w]] = 0.0
            kept = np.flatnonzero(free | (x > 0))
            with suppress(np.linalg.LinAlgError):  # where several solutions have this set the path's end is one of them
                x[kept] = np.linalg.solve(matrix[np.ix_(kept, kept)], -vector[kept])
            return x
        slope = w / x[bounded]
        if not (w.max() < FAR * size and np.isfinite(slope).all()):
            break
        sloped = matrix.copy()
        sloped[bounded, bounded] += slope
        factor = lu_factor(sloped)

        dx, dw = _step(factor, -rest, bounded, x[bounded], w, -products)
        length = _length(x[bounded], dx[bounded], w, dw)
        after = float(((x[bounded] + length * dx[bounded]) * (w + length * dw)).mean())
        mean = float(products.mean())
        corrected = mean * (after / mean) ** 3 - products - dx[bounded] * dw
        dx, dw = _step(factor, -rest, bounded, x[bounded], w, corrected)
        length = SHORT * _length(x[bounded], dx[bounded], w, dw)
        x, w = x + length * dx, w + length * dw
    raise ConvergenceError("the interior-point method does not end")


def _step(
    factor: tuple[Array, Array], right: Array, bounded: NDArray[np.int64], x: Array, w: Array, products: Array
) -> tuple[Array, Array]:
    """Return changes of all unknowns, and of w, by which products of x and w change by so much."""
    right = right.copy()
    right[bounded] += products / x
    if not np.isfinite(right).all():
        raise ConvergenceError("the interior-point method overflows")
    dx = lu_solve(factor, right)
    return dx, (products - w * dx[bounded]) / x


def _length(x: Array, dx: Array, w: Array, dw: Array) -> float:
    """Return the length of a step until an unknown is zero, at most 1."""
    falls = max(float((-dx / x).max()), float((-dw / w).max()))
    return min(1.0, 1 / max(falls, 1e-300))
