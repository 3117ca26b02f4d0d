"""Large systems by GMRES: where a factor would cost more than the few products that it saves.

The preconditioner is what couples each node with itself, with the rigid motions and the balance of forces beside it,
eliminated exactly: the compliance of a contact is a smooth operator on top of that, which needs some tens of
iterations at any number of nodes, fewer with wear.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import LinearOperator, gmres, splu

from fenwear.arrays import Array

ACCURACY = 1e-11  # residual over the right-hand side
RESTART, RESTARTS = 80, 4


class NotSolvedError(Exception):
    """GMRES did not reach its accuracy."""


def iterative(
    multiply: Callable[[Array], Array], near: csc_array, count: Callable[[int], None]
) -> Callable[[Array], Array]:
    """Return the solution operator of a square matrix (size, size), for one right-hand side (size,).

    Args:
        multiply: The product with the matrix.
        near: A sparse matrix near it, which is eliminated.
        count: Told of the iterations of each solution.

    Raises:
        LinAlgError: the sparse matrix is singular. The solution operator raises NotSolvedError.
    """
    try:
        factor = splu(near)
    except RuntimeError as error:  # SuperLU's way of saying that it is singular
        raise np.linalg.LinAlgError("singular matrix") from error
    return lambda b: gmres_solution(multiply, factor.solve, b, count)


def gmres_solution(
    multiply: Callable[[Array], Array],
    precondition: Callable[[Array], Array],
    b: Array,
    count: Callable[[int], None] = lambda _: None,
    enough: float = 0.0,
) -> Array:
    """Return the solution of a square system (size,).

    Args:
        multiply: The product with its matrix.
        precondition: That with a matrix near its inverse.
        b: Right-hand side (size,).
        count: Told of the iterations.
        enough: Residual that ends them in any case.

    Raises:
        NotSolvedError: the accuracy was not reached.
    """
    shape, iterations = (len(b), len(b)), 0

    def note(_residual: float) -> None:
        nonlocal iterations
        iterations += 1

    x, failed = gmres(
        LinearOperator(shape, matvec=multiply, dtype=float),
        b,
        rtol=ACCURACY,
        atol=enough,
        restart=min(RESTART, len(b)),
        maxiter=RESTARTS,
        M=LinearOperator(shape, matvec=precondition, dtype=float),
        callback=note,
        callback_type="pr_norm",
    )
    count(iterations)
    if failed or not np.isfinite(x).all():
        raise NotSolvedError
    result: Array = x
    return result
