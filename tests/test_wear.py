"""The wear rule."""

import numpy as np
import pytest

from fenwear.case import WearLaw
from fenwear.wear import Wear, WornLayer


@pytest.mark.parametrize("b", [0.5, 1.0, 2.0, 3.0])
def test_depth(b: float) -> None:
    """w = beta~ p^b S, node by node, and none where there is no pressure; equations (1), (26)."""
    wear = Wear(WearLaw(coefficient=2e-8, pressure_exponent=b), sliding=3.0)
    np.testing.assert_allclose(wear.depth(np.array([0.0, 1.0, 9.0])), 6e-8 * np.array([0, 1, 9**b]), rtol=1e-14)


@pytest.mark.parametrize("b", [0.5, 1.0, 2.0, 3.0])
def test_layer_and_its_slope(b: float) -> None:
    """The layer sums the phases' wear over N cycles; its slope is the derivative (central differences)."""
    layer = WornLayer(wear := Wear(WearLaw(coefficient=2e-8, pressure_exponent=b), sliding=3.0), repeats=50)
    p = np.array([[1.0, 7.0, 20.0], [9.0, 3.0, 0.5]])
    np.testing.assert_allclose(layer.opening(p), 50 * (wear.depth(p[0]) + wear.depth(p[1])), rtol=1e-14)
    step = 1e-5
    for phase in range(2):
        change = step * (np.arange(2) == phase)[:, None]
        difference = (layer.opening(p + change) - layer.opening(p - change)) / (2 * step)
        np.testing.assert_allclose(layer.slope(p)[phase], difference, rtol=1e-8)
