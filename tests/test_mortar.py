"""Transfer between surfaces whose nodes do not lie opposite each other."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from fenwear.arrays import Array
from fenwear.mortar import mortar_transfer


def lobatto(ends: list[float], degree: int) -> tuple[Array, Array]:
    """Return the Gauss-Lobatto nodes of consecutive facets, and their summed weights."""
    inner = np.polynomial.legendre.Legendre.basis(degree).deriv().roots().real if degree > 1 else np.zeros(0)
    points = np.concatenate([[-1], inner, [1]])
    weights = 2 / (degree * (degree + 1) * np.polynomial.legendre.Legendre.basis(degree)(points) ** 2)
    nodes, total = np.zeros((len(ends) - 1) * degree + 1), np.zeros((len(ends) - 1) * degree + 1)
    for k, (a, b) in enumerate(itertools.pairwise(ends)):
        part = slice(k * degree, (k + 1) * degree + 1)
        nodes[part] = (a + b) / 2 + (b - a) / 2 * points
        total[part] += (b - a) / 2 * weights
    return nodes, total


OWN = [-2.0, -1.5, -0.3, 0.4, 2.0]
OTHER = [-3.0, -2.0, -1.1, -0.3, 0.9, 1.0, 2.5]  # meets -2 and -0.3, and reaches beyond


@pytest.mark.parametrize(("degree", "other_degree"), [(1, 1), (2, 2), (4, 4), (1, 3), (3, 1)])
def test_uniform_pressure_stays_uniform(degree: int, other_degree: int) -> None:
    """The patch condition: what a uniform pressure puts on the other nodes is what it does on their own shapes."""
    nodes, weights = lobatto(OWN, degree)
    covering = [-2.0, -1.1, -0.3, 0.9, 1.0, 2.0]
    other, other_weights = lobatto(covering, other_degree)
    transfer = mortar_transfer(nodes, degree, other, other_degree)
    np.testing.assert_allclose(transfer.T @ weights, other_weights, rtol=1e-12)


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 8])
def test_force_and_moment_go_over(degree: int) -> None:
    """Any nodal forces have the same resultant on both surfaces; fields of the elements' degree come back exactly."""
    nodes, _ = lobatto(OWN, degree)
    other, _ = lobatto(OTHER, degree)
    transfer = mortar_transfer(nodes, degree, other, degree)
    force = np.cos(7 * nodes) + 0.3
    assert (transfer.T @ force).sum() == pytest.approx(force.sum(), rel=1e-12)
    assert (transfer.T @ force) @ other == pytest.approx(force @ nodes, rel=1e-12)
    for power in range(degree + 1):
        np.testing.assert_allclose(transfer @ (other / 2) ** power, (nodes / 2) ** power, atol=1e-11)


def test_the_same_nodes() -> None:
    """Facing nodes hand over to each other alone, to the last digit, also where the other surface goes on."""
    nodes, _ = lobatto(OWN, 3)
    np.testing.assert_array_equal(mortar_transfer(nodes, 3, nodes, 3), np.eye(len(nodes)))
    other, _ = lobatto([-4.0, *OWN, 7.0], 3)
    np.testing.assert_array_equal(mortar_transfer(nodes, 3, other, 3), np.eye(len(other))[3:-3])
