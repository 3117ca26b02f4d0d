"""Coordinates along and across the sliding."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fenwear import Tribosystem
from fenwear.surfaces.sliding_chart import sliding_chart
from fenwear.surfaces.sliding_field import SlidingField


def contact(x: np.ndarray, normal: np.ndarray) -> Any:
    """Return nodes of equal areas with their normals, as a pair has them."""
    weights = np.ones(len(x))
    return SimpleNamespace(punch=SimpleNamespace(x=x), normal=normal, weights=weights)


def test_translation() -> None:
    """Along V, and across it to its left seen from above."""
    x = np.random.default_rng(0).normal(size=(20, 3))
    pair = contact(x, np.tile([0.0, 0.0, 1.0], (20, 1)))
    chart = sliding_chart(SlidingField(shift=(0.6, 0.8, 0.0)), pair)
    np.testing.assert_allclose(chart.coordinates(x), np.column_stack([x @ [0.6, 0.8, 0], x @ [-0.8, 0.6, 0]]))


def test_disc(assembled: Callable[..., Tribosystem]) -> None:
    """A step along the track is a step along the circle through the pin's middle, across it is one of the radius."""
    system = assembled("pin-on-disc", "geometry.degree=1", "geometry.order=1")
    chart = sliding_chart(system.sliding.field, system.pair)
    turn = np.linspace(-1, 1, 7)
    for radius in (12.0, 17.0):
        x = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), 0 * turn])
        along, across = chart.coordinates(x).T
        np.testing.assert_allclose(along, chart.radius * turn, atol=1e-9)
        np.testing.assert_allclose(across, radius, rtol=1e-12)
    # The mean radius of a pin's face is that of its centre and a little more: R (1 + (a / R)^2 / 8 + ...).
    assert chart.radius == pytest.approx(15 * (1 + (3 / 15) ** 2 / 8), rel=1e-3)


def test_roller() -> None:
    """Where the contact is on a cylinder's side, across the sliding is along its axis."""
    turn = np.linspace(-0.1, 0.1, 5)
    x = np.array([[20 * np.sin(t), y, 20 * np.cos(t)] for t in turn for y in (-2.0, 0.0, 2.0)])
    chart = sliding_chart(SlidingField(turn=(0.0, 1.0, 0.0)), contact(x, x * [1, 0, 1] / 20))
    along, across = chart.coordinates(x).T
    np.testing.assert_allclose(along, np.repeat(20 * turn, 3), atol=1e-12)
    np.testing.assert_allclose(across, np.tile([-2.0, 0.0, 2.0], 5), atol=1e-12)


def test_a_pin_that_spins_on_its_own_axis() -> None:
    """There is no direction of sliding that the contact has as a whole: x and y are taken."""
    x = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
    chart = sliding_chart(SlidingField(turn=(0.0, 0.0, 1.0)), contact(x, np.tile([0.0, 0.0, 1.0], (4, 1))))
    np.testing.assert_allclose(chart.coordinates(x), x[:, :2], atol=1e-15)
