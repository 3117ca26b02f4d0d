"""The interior-point method against every set of unknowns that may be at zero."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from fenwear.algebra.interior_point import complementary
from fenwear.common.arrays import Array
from fenwear.common.errors import ConvergenceError

FREE = np.array([False] * 7 + [True])


def contact(rng: np.random.Generator, skew: float) -> tuple[Array, Array]:
    """Return the matrix and vector of seven pressures and a rigid motion; `skew` is what friction adds."""
    root = rng.normal(size=(7, 7))
    matrix = np.zeros((8, 8))
    matrix[:7, :7] = root @ root.T + 0.1 * np.eye(7)
    matrix[:7, 7] = matrix[7, :7] = rng.uniform(0.5, 1.5, 7)
    upper = np.triu(rng.normal(size=(7, 7)), 1)
    matrix[:7, :7] += skew * (upper - upper.T)
    return matrix, np.append(rng.normal(size=7), -1.0)


def every_set(matrix: Array, vector: Array) -> list[Array]:
    """Return all solutions, by all sets of unknowns at zero."""
    found = []
    for within in product([False, True], repeat=7):
        kept = np.append(np.flatnonzero(within), 7)
        part = matrix[np.ix_(kept, kept)]
        if np.linalg.matrix_rank(part) < len(kept):
            continue
        x = np.zeros(8)
        x[kept] = np.linalg.solve(part, -vector[kept])
        if (x[:7] >= 0).all() and ((matrix @ x + vector)[:7] >= -1e-12).all():
            found.append(x)
    return found


@pytest.mark.parametrize("skew", [0.0, 1.0])
def test_of_all_sets_the_right_one(skew: float) -> None:
    for seed in range(40):
        matrix, vector = contact(np.random.default_rng(seed), skew)
        (exact,) = every_set(matrix, vector)
        np.testing.assert_allclose(complementary(matrix, vector, FREE), exact, rtol=0, atol=1e-10)


def test_alike_nodes_do_not_go_round() -> None:
    """All ratios of a flat punch on springs tie, and its nodes share the load."""
    springs, ones = np.eye(6), np.ones((6, 1))
    matrix = np.block([[springs, ones], [ones.T, np.zeros((1, 1))]])
    x = complementary(matrix, np.append(np.zeros(6), -3.0), np.array([False] * 6 + [True]))
    np.testing.assert_allclose(x, [0.5] * 6 + [-0.5], rtol=1e-12)


def test_a_load_that_nothing_carries() -> None:
    matrix, vector = contact(np.random.default_rng(0), 0.0)
    vector[7] = 1.0  # it pulls
    with pytest.raises(ConvergenceError):
        complementary(matrix, vector, FREE)
