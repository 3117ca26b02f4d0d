"""The outline of a body, and the temperature along it."""

from __future__ import annotations

import numpy as np
import pytest
import xarray

from fenwear.report.boundary import boundary_figure, outline


def grid(width: float, height: float, low: float, counts: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Return points and cells of a rectangle, shuffled."""
    x, z = np.meshgrid(np.linspace(-width / 2, width / 2, counts[0] + 1), np.linspace(low, low + height, counts[1] + 1))
    number = np.random.default_rng(1).permutation(x.size).reshape(x.shape)
    corners = [number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]]
    points = np.empty((x.size, 2))
    points[number.ravel()] = np.column_stack([x.ravel(), z.ravel()])
    return points, np.stack(corners, axis=-1).reshape(-1, 4)


def test_outline_goes_round() -> None:
    """Once through every boundary point: its length is the perimeter, its area the rectangle's."""
    points, cells = grid(60, 100, 100, (4, 6))
    path = points[outline(cells)]
    assert len(path) == 2 * (4 + 6)
    steps = np.roll(path, -1, axis=0) - path
    assert np.hypot(*steps.T).sum() == pytest.approx(320)
    x, z = path.T
    assert abs((x * np.roll(z, -1) - np.roll(x, -1) * z).sum() / 2) == pytest.approx(6000)


def test_figure_shows_the_temperatures() -> None:
    """Temperature = x: round the punch it begins at 0, rises to the right edge and ends where it began."""
    data = {}
    for body, (width, low, counts) in {"punch": (60, 100, (4, 6)), "strip": (1140, 0, (12, 3))}.items():
        points, cells = grid(width, 100, low, counts)
        data[f"{body}_cells"] = ((f"{body}_cell", "corner"), cells)
        for name, values in (("x", points[:, 0]), ("z", points[:, 1]), ("temperature", points[:, 0])):
            data[f"{body}_{name}"] = (f"{body}_point", values)
    figure = boundary_figure(xarray.Dataset(data, attrs={"half_cycle": 7}))
    (around, *_), (along, *_) = (ax.lines for ax in figure.axes)
    np.testing.assert_allclose(around.get_ydata()[:3], [0, 15, 30])
    assert around.get_ydata()[-1] == around.get_ydata()[0]
    assert around.get_xdata()[-1] == pytest.approx(320)
    np.testing.assert_allclose(along.get_xdata(), along.get_ydata())
