"""Large systems by GMRES: where a factor would cost more than the few products that it saves."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fenwear.common.arrays import Array

ACCURACY, ENOUGH = 1e-11, 2e-12  # residual over the right-hand side, and scaled to 1, that end iterations of `solution`
MOST = 30  # iterations of `solution`
FEW = 1e-6  # accuracy that directions which are at right angles to half of all digits are enough for


def solution(multiply: Callable[[Array], Array], precondition: Callable[[Array], Array], b: Array) -> Array:
    """Return the solution of a square system (size,) to many digits by few iterations; arguments as of `flexible`.

    Raises:
        LinAlgError: the accuracy was not reached.
    """
    accuracy = max(ACCURACY, ENOUGH / max(float(np.linalg.norm(b)), 1e-300))
    x, rest, *_ = flexible(multiply, precondition, b, accuracy, MOST, 1)
    if not (rest <= accuracy and np.isfinite(x).all()):
        raise np.linalg.LinAlgError("iterations do not converge")
    return x


def flexible(
    multiply: Callable[[Array], Array],
    precondition: Callable[[Array], Array],
    b: Array,
    accuracy: float,
    restart: int,
    restarts: int,
    kept: Array | float = 1.0,
) -> tuple[Array, float, int, Array]:
    """Return the solution of a square system in the precision of b (size,), by flexible GMRES.

    Preconditioned from the right, so that the residual is that of the system itself: a few digits end it where they
    are asked for (Y. Saad, SIAM J. Sci. Comput. 14, 1993).

    Args:
        multiply: The product with its matrix.
        precondition: That with a matrix near its inverse.
        b: Right-hand side (size,).
        accuracy: Residual over the right-hand side that ends it.
        restart: Iterations after which it restarts.
        restarts: Number of restarts.
        kept: One where products are those of the system, else zero; directions are zero there.

    Returns:
        The solution, its residual over the right-hand side, how many iterations it took, and its product.
    """
    x, product, r = np.zeros_like(b), np.zeros_like(b), b
    first_size = size = float(np.linalg.norm(b))
    iterations, enough = 0, accuracy * first_size
    for _ in range(restarts):
        if not size > enough:
            break
        directions, products = list[Array](), list[Array]()
        basis = np.empty((restart + 1, len(b)), dtype=b.dtype)
        basis[0] = r / size
        rows: Array = np.zeros((restart + 1, restart))
        for k in range(restart):
            directions.append(precondition(basis[k]))
            products.append(multiply(directions[k]))
            w = products[k] * kept
            for _again in range(1 if accuracy > FEW else 2):  # classical Gram and Schmidt, twice for many digits
                parts = basis[: k + 1] @ w
                w = w - parts @ basis[: k + 1]
                rows[: k + 1, k] += parts
            rows[k + 1, k] = length = float(np.linalg.norm(w))
            iterations += 1
            right = np.zeros(k + 2)
            right[0] = size
            y, *_ = np.linalg.lstsq(rows[: k + 2, : k + 1], right)
            rest = float(np.linalg.norm(right - rows[: k + 2, : k + 1] @ y))
            if rest <= enough or not length > 0:
                break
            basis[k + 1] = w / length
        for part, direction, of_direction in zip(y.astype(b.dtype), directions, products, strict=True):
            x += part * direction
            product += part * of_direction
        if rest <= enough:
            return x, rest / first_size, iterations, product
        product = multiply(x)
        r = b - product * kept
        before, size = size, float(np.linalg.norm(r))
        if not size < before:
            break
    return x, size / max(first_size, 1e-300), iterations, product
