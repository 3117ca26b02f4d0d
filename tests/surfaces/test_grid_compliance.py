"""Compliances along all axes of one grid, and their inverses on endless ones."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from fenwear.bodies.convolution import over_period
from fenwear.bodies.half_space import HalfSpace
from fenwear.surfaces.grid_compliance import STIFF, GridCompliance, on_one_grid

SIDE = 18


@pytest.mark.parametrize("period", [9, 10, 12, 13, 20])
def test_a_period_holds_all_of_a_table(period: int) -> None:
    """What does not change along a line has no waves but the longest, at odd and even periods; symmetry stays."""
    m = 7
    apart = np.abs(np.arange(1 - m, m))
    waves = np.fft.fft(over_period(np.broadcast_to(1.0 / (1 + apart), (3, 2 * m - 1)), (period,)), axis=-1)
    assert np.abs(waves.imag).max() < 1e-14
    even = np.fft.fft(over_period(np.ones(2 * m - 1), (period,)))
    assert (np.abs(even[1:]).max() < 1e-13) == (period < 2 * m)


@pytest.fixture(scope="module")
def on_grid() -> GridCompliance:
    """Two like half-spaces."""
    places: NDArray[np.int64] = np.stack(np.meshgrid(np.arange(SIDE), np.arange(SIDE), indexing="ij"), axis=-1)
    body = HalfSpace(places.reshape(-1, 2), (0.1, 0.1), 80e3, 0.3, axes=(0, 1, 2), outward=1.0)
    axes = np.broadcast_to(np.eye(3), (SIDE**2, 3, 3))
    found = on_one_grid([body, body], axes, axes, np.full(SIDE**2, 0.01), np.zeros(SIDE**2), {})
    assert found is not None
    return found


@pytest.mark.parametrize("level", range(len(STIFF) + 1))
def test_the_inverse_on_an_endless_grid_is_near_that_of_a_patch(on_grid: GridCompliance, level: int) -> None:
    """It brings modes of a patch to near themselves, but for few at the rim; with tangents that give way, too."""
    n, d = SIDE**2, 3
    on = on_grid.boxes.of_all
    matrix = np.array([on_grid.apply(one) for one in np.eye(d * n)]).T
    np.testing.assert_allclose(matrix.diagonal(), on_grid.diagonal(), rtol=1e-12)
    if level:
        own = on_grid.diagonal().reshape(d, n)[1:].mean()
        matrix[n:, n:] += STIFF[level - 1] * own * np.eye((d - 1) * n)

    def inverse(gaps: NDArray[np.float64]) -> NDArray[np.float64]:
        fields, stiff = gaps.reshape(d, SIDE, SIDE).copy(), np.zeros((len(STIFF), d, SIDE, SIDE))
        if level:
            stiff[level - 1, 1:] = fields[1:]
            fields[1:] = 0.0
        return on.solve(fields, stiff).ravel()

    both = np.array([inverse(column) for column in matrix.T]).T
    size = np.abs(np.linalg.eigvals(both))
    assert size.min() > 0.4
    assert size.max() < 2.5
    assert np.quantile(np.abs(size - 1), 0.9) < 0.3
