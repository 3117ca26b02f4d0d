"""Derivatives over a window: exact ones, and errors that hold."""

from __future__ import annotations

import numpy as np
import pytest

from fenwear.common.errors import CaseError, InputError
from fenwear.studies.sensitivity import over_window


def test_powers_are_exact() -> None:
    """d(x^a)/dx to rounding, whatever the sign of key and value; none where either is zero."""
    for key in (2.0, -3.0):
        found = over_window(lambda x: -(abs(x) ** 0.4), -(abs(key) ** 0.4), key)
        assert found is not None
        assert found[0] == pytest.approx(-0.4 * abs(key) ** 0.4 / key, rel=1e-12)
        assert found[1] < 1e-12
    assert over_window(lambda x: x, 1.0, 0.0) is None
    assert over_window(lambda x: x, 0.0, 1.0) is None


def test_a_width_that_is_counted_in_nodes() -> None:
    """Rounded to a grain, a power is told within its error in 19 of 20 places; the error falls with it."""
    errors = []
    for grain in (0.1, 0.03):
        held, told = 0, 0.0
        for place in np.linspace(0.0, 1.0, 60):
            scale = 1.0 + place * grain

            def width(x: float, scale: float = scale, grain: float = grain) -> float:
                return float(grain * np.floor(scale * x ** (1 / 3) / grain))

            found = over_window(width, width(1.0), 1.0, grain)
            assert found is not None
            held += abs(found[0] / width(1.0) - 1 / 3) < found[1] / width(1.0)
            told += found[1] / 60
        assert held >= 57
        errors.append(told)
    assert errors[1] < 0.5 * errors[0]
    still = over_window(lambda _: 5.0, 5.0, 1.0, 0.1)
    assert still == pytest.approx((0.0, 0.1 / 1.2))


def test_a_window_of_possible_values() -> None:
    """It shrinks until all of it is possible; there is none at the end of what is."""

    def bounded(limit: float) -> tuple[float, float] | None:
        def function(x: float) -> float:
            if x > limit:
                raise CaseError(InputError("x", "too large"))
            return x**2

        return over_window(function, 1.0, 1.0)

    assert bounded(1.2) == pytest.approx((2.0, 0.0), abs=1e-10)
    assert bounded(1.0) is None
