"""The exact integrals of the speed."""

import numpy as np
import pytest
from scipy.integrate import quad

from fenwear.case import OneWay, Reciprocating
from fenwear.motion import make_motion


@pytest.mark.parametrize("a", [0.3, 0.5, 1.0, 1.7, 2.0, 3.0])
def test_reciprocating_against_quadrature(a: float) -> None:
    """The integral of (u0 omega |sin omega t|)^a over half a period, equation (10), by adaptive quadrature."""
    u0, omega = 1.5, 10.0
    motion = make_motion(Reciprocating(kind="reciprocating", amplitude=u0, angular_frequency=omega))
    exact, _ = quad(lambda t: (u0 * omega * abs(np.sin(omega * t))) ** a, 0, np.pi / omega, epsabs=0, epsrel=1e-11)
    assert motion.sliding(a) == pytest.approx(exact, rel=1e-9)
    assert motion.duration == pytest.approx(np.pi / omega, rel=1e-15)
    assert motion.directions == (1, -1)


def test_sliding_distance_of_a_half_cycle() -> None:
    """For a = 1 the strip slides exactly 2 u0, at any frequency."""
    for omega in (0.1, 10.0, 1e4):
        motion = make_motion(Reciprocating(kind="reciprocating", amplitude=1.5, angular_frequency=omega))
        assert motion.sliding() == pytest.approx(3.0, rel=1e-14)


@pytest.mark.parametrize(("direction", "d"), [("rightward", 1), ("leftward", -1)])
def test_one_way(direction: str, d: int) -> None:
    """Constant speed: v^a times the duration."""
    motion = make_motion(OneWay(kind="one-way", direction=direction, speed=200, duration=0.1))  # type: ignore[arg-type]
    assert motion.directions == (d,)
    assert motion.sliding(2) == pytest.approx(4000, rel=1e-14)
