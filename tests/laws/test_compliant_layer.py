"""Laws of closure: Greenwood and Williamson's integrals by quadrature, slopes by differences, what is not given."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from fenwear.laws.compliant_layer import Closure, ExponentialClosure, PowerClosure, RoughClosure

LAWS = [PowerClosure(1e-3, 100.0, 0.5), ExponentialClosure(1e-3, 10.0), RoughClosure(1e-3, 500.0)]


@pytest.mark.parametrize("distance", [3.0, 2.0, 1.0, 0.0, -2.0, -6.0])
def test_greenwood_and_williamson(distance: float) -> None:
    """The mean pressure at a distance of the mean planes is the integral over the heights of the asperities."""

    def of_height(z: float) -> float:
        return float((z - distance) ** 1.5 * np.exp(-z * z / 2) / np.sqrt(2 * np.pi))

    pressure = 500.0 * quad(of_height, distance, max(distance, 0) + 9, epsabs=0, epsrel=1e-12, limit=200)[0]
    closed = float(LAWS[2].closure(np.array([pressure]))[0])
    assert closed / 1e-3 == pytest.approx(6.0 - distance, abs=2e-7)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_slopes(law: Closure) -> None:
    """They are those of the closure; without pressure nothing closes, and the slope is a number."""
    p = np.geomspace(1e-4, 1e4, 30)
    step = 1e-5 * p
    assert (law.closure(p + step) - law.closure(p - step)) / (2 * step) == pytest.approx(law.slope(p), rel=1e-8)
    nothing = np.array([0.0, 1.0])
    assert law.closure(nothing)[0] == pytest.approx(0, abs=1e-15)
    assert np.isfinite(law.slope(nothing)).all()
    assert (np.diff(law.closure(p)) > 0).all()
