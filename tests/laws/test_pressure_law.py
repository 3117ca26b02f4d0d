"""What of a pressure wears."""

import numpy as np
import pytest

from fenwear.case import WearLaw
from fenwear.laws.pressure_law import PressureLaw


@pytest.mark.parametrize("b", [0.5, 1.0, 2.0])
@pytest.mark.parametrize(("threshold", "cap"), [(0.0, None), (5.0, None), (0.0, 20.0), (5.0, 20.0)])
def test_value_and_slope(b: float, threshold: float, cap: float | None) -> None:
    """(min(p, cap) - threshold)_+^b by its definition; the slope by central differences."""
    law = PressureLaw.of(WearLaw(coefficient=1e-8, pressure_exponent=b, pressure_threshold=threshold, pressure_cap=cap))
    p = np.array([0.5, 4.9, 5.1, 12.0, 19.9, 20.1, 50.0])
    exact = [max(min(x, np.inf if cap is None else cap) - threshold, 0.0) ** b for x in p]
    np.testing.assert_allclose(law.value(p), exact, rtol=1e-14)
    differences = (law.value(p + 1e-5) - law.value(p - 1e-5)) / 2e-5
    np.testing.assert_allclose(law.slope(p), differences, rtol=1e-7, atol=1e-10)
    assert law.linear == ((b, threshold, cap) == (1.0, 0.0, None))
