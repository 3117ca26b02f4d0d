"""Two surfaces that face each other."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fenwear import System


def test_transfer_between_unmatched_nodes(unmatched: System) -> None:
    """Taking values from the strip's nodes to the punch's is exact for polynomials of the elements' degree."""
    pair = unmatched.pair
    strip, punch = pair.strip.x[:, 0], pair.x
    assert len(strip) > len(punch)
    for power in range(pair.strip.degree + 1):
        np.testing.assert_allclose(pair.transfer @ (strip / 30) ** power, (punch / 30) ** power, atol=1e-12)


def test_interpolate(unmatched: System) -> None:
    """A nodal field is a finite-element function between its nodes."""
    pair, x = unmatched.pair, np.linspace(-30, 30, 77)
    np.testing.assert_allclose(pair.interpolate(pair.x**3, x), x**3, rtol=1e-10, atol=1e-9)


@pytest.mark.mpi
def test_statics_of_example_1(assemble: Callable[..., System]) -> None:
    """H and H_t by hand: the gap opened and the slip made by lambda_F and lambda_M about O = (30, 120)."""
    statics = assemble("example1").statics
    x = statics.pair.x
    assert statics.mode_names == ("lambda_F", "lambda_M")
    np.testing.assert_allclose(statics.rigid_normal, np.stack([0 * x + 1, 30 - x], axis=1), atol=1e-10)
    np.testing.assert_allclose(statics.rigid_tangential, np.stack([0 * x, 0 * x - 20], axis=1), atol=1e-10)
    # 1 kN/mm at x = 0, 30 mm to the left of O.
    np.testing.assert_allclose(statics.resultant, [-1000, -1000 * 30], rtol=1e-12)


@pytest.mark.mpi
def test_compliance_of_mirrored_directions(assemble: Callable[..., System]) -> None:
    """Example 2 is its own mirror image: without the rigid part S_n is even and S_t odd under x -> -x."""
    interface = assemble("example2").interface
    weights = interface.statics.pair.weights
    balanced = np.eye(len(weights)) - 1 / len(weights)  # forces without resultant, gaps without mean
    for compliance, sign in ((interface.normal_compliance, 1), (interface.tangential_compliance, -1)):
        per_force = balanced @ (compliance / weights) @ balanced
        np.testing.assert_allclose(per_force[::-1, ::-1], sign * per_force, atol=1e-9 * np.abs(per_force).max())
