"""The dual mortar transfer between surfaces whose nodes do not match."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from basix import CellType, ElementFamily, LagrangeVariant, create_element

from fenwear.arrays import Array
from fenwear.interface.mortar import lagrange, transfer_matrix


def nodes(ends: Array, degree: int) -> Array:
    """Return the Gauss-Lobatto nodes of facets."""
    element = create_element(ElementFamily.P, CellType.interval, degree, LagrangeVariant.gll_warped)
    local = np.sort(element.points[:, 0])
    return np.unique(np.concatenate([a + (b - a) * local for a, b in itertools.pairwise(ends)]).round(13))


def integrals(x: Array, degree: int, low: float, high: float) -> Array:
    """Return the integrals of the shape functions over [low, high]."""
    points, gauss = np.polynomial.legendre.leggauss(12)
    result = np.zeros(len(x))
    for first in range(0, len(x) - 1, degree):
        own = slice(first, first + degree + 1)
        a, b = max(x[own][0], low), min(x[own][-1], high)
        if b > a:
            at = (a + b) / 2 + (b - a) / 2 * points
            result[own] += (b - a) / 2 * gauss @ lagrange(x[own][None], at)
    return result


@pytest.mark.parametrize("degrees", [(1, 1), (1, 2), (2, 1), (2, 4), (4, 1), (4, 4), (3, 5)])
def test_force_moment_and_patch(degrees: tuple[int, int]) -> None:
    """Rows reproduce constants and x, so that force and moment are kept; a uniform pressure gives its exact loads."""
    random = np.random.default_rng(3)
    x1 = nodes(np.sort(np.r_[-1, 1, random.uniform(-1, 1, 6)]), degrees[0])
    x2 = nodes(np.sort(np.r_[-1.5, 1.7, random.uniform(-1.3, 1.3, 9)]), degrees[1])
    transfer = transfer_matrix(x1, degrees[0], x2, degrees[1])
    weights = integrals(x1, degrees[0], -1, 1)
    np.testing.assert_allclose(transfer.sum(axis=1), 1, rtol=1e-13)
    np.testing.assert_allclose(transfer @ x2, x1, atol=1e-13)
    np.testing.assert_allclose(transfer.T @ weights, integrals(x2, degrees[1], -1, 1), atol=1e-13)


def test_identity_where_nodes_match() -> None:
    """Nodes opposite each other exchange their own values, also where the other surface reaches farther."""
    ends = np.array([-2.0, -1.0, -0.3, 0.4, 1.0, 1.9])
    x1, x2 = nodes(ends[1:5], 4), nodes(ends, 4)
    np.testing.assert_allclose(transfer_matrix(x1, 4, x2, 4), np.eye(len(x2))[4:17], atol=1e-13)
    assert (transfer_matrix(x2, 4, x2, 4) == np.eye(len(x2))).all()


@pytest.mark.parametrize("degree", [1, 2, 4])
def test_converges(degree: int) -> None:
    """A smooth function is transferred with order degree + 1 as both meshes are refined."""
    errors = []
    for count in (8, 32):
        x1 = nodes(np.linspace(-1, 1, count + 1), degree)
        found = []
        for shift in np.linspace(0, 1, 12) / count:  # nodes meet differently each time
            x2 = nodes(np.linspace(-1.2, 1.3, 3 * count // 2 + 1) + shift - 0.1, degree)
            found.append(transfer_matrix(x1, degree, x2, degree) @ np.sin(3 * x2) - np.sin(3 * x1))
        errors.append(np.sqrt(np.mean(np.square(found))))
    assert np.log2(errors[0] / errors[1]) / 2 > degree + 0.7
