"""Fixed points: pressures and quantities that follow from them, such as coefficients or conducting nodes.

x = g(x) is solved by Anderson's acceleration: the next x is the combination of the last ones whose
residuals g(x) - x cancel best, which for a linear g is GMRES (Walker and Ni, SIAM J. Numer. Anal. 49,
2011). Where g jumps, as where nodes open and close in turn, or the residual grows, it starts afresh
with a part of the residual.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from fenwear.common.arrays import Array
from fenwear.common.errors import ConvergenceError
from fenwear.common.parallel import ALONE, Team

T = TypeVar("T")
DEPTH = 5  # residuals that are combined
MAX_ITERATIONS = 60
LEAST = 0.1  # of the residual that is followed where it does not fall
WORSE = 2.0  # growth of the residual that counts as going astray


def fixed_point(
    advance: Callable[[Array], tuple[Array, T, bool]],
    start: Array,
    close: Callable[[Array, Array], bool],
    failure: str,
    iterations: int = MAX_ITERATIONS,
    depth: int = DEPTH,
    *,
    team: Team = ALONE,
) -> T:
    """Return the result of x = g(x); collective where several ranks compute it.

    Args:
        advance: From x returns g(x), what belongs to it, and whether it is exact already.
        start: The first x.
        close: Whether a change of x, its first argument, is small against the x that is its second.
        failure: The message where they do not converge.
        iterations: At most so many.
        depth: Residuals that are combined.
        team: The ranks, of which one decides on the way and on the end.

    Raises:
        ConvergenceError: x and g(x) do not converge.
    """
    x, share, best = team.lead(lambda: start), 1.0, np.inf
    points: list[Array] = []
    residuals: list[Array] = []
    for _ in range(iterations):
        new, result, exact = advance(x)
        residual = (new - x).ravel()
        if team.lead(lambda: bool(exact or close(residual, new))):  # noqa: B023
            return result
        size = float(np.linalg.norm(residual))
        if size > WORSE * best:
            share, points, residuals = max(LEAST, share / 2), [], []
        best = min(best, size)
        points, residuals = [*points[-depth:], x.ravel()], [*residuals[-depth:], residual]
        x = team.lead(lambda: _mixed(points, residuals, share).reshape(start.shape))  # noqa: B023
    raise ConvergenceError(f"{failure} ({iterations} iterations)")


def _mixed(points: list[Array], residuals: list[Array], share: float) -> Array:
    """Return the next x: Anderson's combination of the last ones, and a share of its residual."""
    x, residual = points[-1], residuals[-1]
    if len(points) == 1:
        return x + share * residual
    steps, changes = (np.diff(np.array(a), axis=0).T for a in (points, residuals))
    weights = np.linalg.lstsq(changes, residual, rcond=1e-10)[0]
    return np.asarray(x - steps @ weights + share * (residual - changes @ weights))
