"""Worn scars: depth, place and width of shapes that are known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fenwear import Tribosystem
from fenwear.sliding.scar import neighbours, scar_edges, scar_ends, scar_widths, scars
from fenwear.verify.solid import quarter


@pytest.mark.parametrize("share", [0.01, 0.05])
def test_parabola(share: float) -> None:
    """Where 1 - (x/a)² is a share of its top; the error of straight lines between nodes falls as their square."""
    a, errors = 0.7, []
    for count in (41, 81, 161):
        x = np.linspace(-1, 1, count)
        left, right = scar_edges(x, np.maximum(1 - (x / a) ** 2, 0), share)
        assert left == pytest.approx(-right, rel=1e-12)
        errors.append(abs(right - a * np.sqrt(1 - share)))
    assert errors[-1] < 0.5 * (x[1] - x[0]) ** 2 / a
    whole = scar_edges(x, np.full(count, 2.0), share)
    assert whole == (-1, 1)
    assert scar_edges(x, np.zeros(count), share) == (0, 0)


def test_a_lost_middle_counts_into_the_width() -> None:
    """A profilometer reads a scar from its outer ends, whatever stands in it."""
    x = np.arange(9.0)
    depth = np.array([0, 1, 1, 0, 0, 0, 1, 1, 0.0])
    assert scar_edges(x, depth, 0.05) == pytest.approx((0.05, 7.95))


def test_neighbours_of_a_line(assembled: Callable[..., Tribosystem]) -> None:
    """Along a plane contact each node has the next one beside it."""
    surface = assembled("example1", "geometry.degree=4").pair.punch
    count = np.arange(len(surface.weights) - 1)
    np.testing.assert_array_equal(neighbours(surface), np.column_stack([count, count + 1]))


@pytest.mark.parametrize("element", ["hexahedra", "tetrahedra"])
def test_an_ellipse_on_a_solid(element: str) -> None:
    """Both axes of an elliptic bowl, read on squares and on triangles; several scars at once."""
    surface = quarter(8, 1, tetrahedra=element == "tetrahedra").pair.punch
    x = surface.x[:, :2]
    middle, half = x.mean(axis=0), 0.35 * np.ptp(x, axis=0)
    half[1] *= 0.7
    bowl = np.maximum(1 - (((x - middle) / half) ** 2).sum(axis=1), 0)
    pairs = neighbours(surface)
    longest = np.abs(x[pairs[:, 0]] - x[pairs[:, 1]]).max(axis=0)
    for share in (0.01, 0.05):
        width = scar_widths(surface, np.stack([bowl, 3 * bowl]), share)
        np.testing.assert_allclose(width[1], width[0], rtol=1e-12)
        assert (np.abs(width[0] - 2 * half * np.sqrt(1 - share)) < 1.2 * longest).all()
    low, high = scar_ends(x, pairs, bowl[None], 0.5)
    assert (low[0] > middle - half).all()
    assert (high[0] < middle + half).all()
    found = scars(x, np.stack([bowl, 3 * bowl]))
    assert found.depth[1] == 3 * found.depth[0]
    assert np.abs(found.place[0] - middle).max() < longest.max()
