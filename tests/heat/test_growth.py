"""Thermo-elastic growth with wear: a conductor slides on a rigid insulator."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.optimize import newton

from fenwear import Tribosystem
from fenwear.steps import growth_rate

Make = Callable[..., Any]
WIDTH, HEIGHT, FRICTION = 4.0, 12.0, 1e-3
YOUNG, POISSON, K, RHO_C, EXPANSION = 1e5, 0.25, 40.0, 3.0, 2e-5
M = np.pi / WIDTH  # the longest wave between sides that are insulated and held in x


def burton(m: float = M) -> float:
    """Return V = 2 (1 - nu) k m / (mu E alpha), mm/s; Burton, Nerlikar and Kilaparti 1973."""
    return 2 * (1 - POISSON) * K * m / (FRICTION * YOUNG * EXPANSION)


def rate(speed: float, m: float = M) -> float:
    """Return the growth rate s of a wave on the half-plane, 1/s.

    Its temperature e^{st} e^{-l z} cos m x, l² = m² + s / a, raises the surface by
    2 alpha (1 + nu) theta / (l + m), so that l (l + m) = mu E alpha V m / ((1 - nu) k).
    """
    drive = FRICTION * YOUNG * EXPANSION * speed * m / ((1 - POISSON) * K)
    length = (-m + np.sqrt(m**2 + 4 * drive)) / 2
    return K / RHO_C * (length**2 - m**2)


@pytest.fixture(scope="module")
def conductor(blocks: Make) -> Callable[..., Tribosystem]:
    """Return conductor(speed, ...): a punch in full contact, held in x and insulated at its sides."""
    rigid = {"young": 1e14, "poisson": 0.0, "conductivity": 1e-9, "heat_capacity": 1e9, "density": 1e-9}
    punch = {"young": YOUNG, "poisson": POISSON, "conductivity": K, "heat_capacity": RHO_C / 1e-9, "density": 1e-9}

    def conductor(
        speed: float,
        across: int = 8,
        degree: int = 3,
        duration: float = 0.05,
        partition: float = 1.0,
        wear: float = 0.0,
    ) -> Tribosystem:
        case = {
            "geometry": {"degree": degree},
            "model": {"plane": "strain"},
            "materials": {"rigid": {**rigid, "expansion": 0.0}, "conductor": {**punch, "expansion": EXPANSION}},
            "punch": {
                "regions": {"punch_body": "conductor"},
                "supports": [{"on": "punch_sides", "fix": ["x"]}],
                "loads": [{"on": "punch_far", "traction": [0, -1]}],
                "temperatures": [{"on": "punch_far"}],
            },
            "strip": {
                "regions": {"strip_body": "rigid"},
                "supports": [{"on": "strip_far", "fix": ["x", "z"]}],
                "temperatures": [{"on": "strip_far"}, {"on": "strip_sides"}],  # what flows in is cold
            },
            "contact": {"friction": FRICTION},
            "wear": {"punch": {"coefficient": wear}},
            "motion": {"kind": "one-way", "direction": "rightward", "speed": speed, "duration": duration},
            "heat": {"partition": partition, "steps": 1, "reduction_tolerance": 1e-6},
            "run": {"half_cycles": 1},
        }
        sizes = {"width": WIDTH, "punch_height": HEIGHT, "strip_height": WIDTH, "across": across}
        return blocks(case, punch_layers=across, strip_layers=2, growth=1.3, **sizes)

    return conductor


@pytest.mark.parametrize(("share", "start"), [(0.05, 0.9), (0.2, 0.4 + 0.5j)])
def test_wear_slows_the_growth(conductor: Make, share: float, start: complex) -> None:
    """Dow and Burton 1973: wear beta V p / s opens the wave's gap; much of it makes the growth an oscillation.

    s is the root of the sum of the elastic, the thermal and the worn gap of a wave.
    """
    speed = 1.5 * burton()
    alone = rate(speed)
    elastic = 2 * (1 - POISSON**2) / (YOUNG * M)
    coefficient, duration = share * alone * elastic / speed, 0.05 / alone

    def gap(s: complex) -> complex:
        length = np.sqrt(M**2 + s * RHO_C / K)
        thermal = 2 * EXPANSION * (1 + POISSON) * FRICTION * speed / (K * length * (length + M))
        return (elastic - thermal + coefficient * speed / s) / elastic

    expected = newton(gap, start * alone)
    assert expected.real < (1 - share) * alone
    assert (abs(expected.imag) > 0.1 * alone) == (share > 0.1)
    rates = []
    for parts in (2, 4):
        system = conductor(speed, duration=duration / parts, wear=coefficient)
        rates.append(growth_rate(system, np.ones((1, len(system.pair.x)))))
    # The pressure of a half-cycle is that of its end: of first order, which two durations tell apart from the rate.
    assert 2 * rates[1] - rates[0] == pytest.approx(expected.real, rel=2e-3)
