"""What the paper reports, as printed, and the numbers that it leaves open.

I. Páczelt and Z. Mróz, "Numerical Analysis of Thermo-Mechanical Wear Problems for Reciprocal Punch Sliding".
"""

from __future__ import annotations

from typing import NamedTuple


class Velocity(NamedTuple):
    """A row of the paper's table of wear velocities, as printed: lambda_F at the pin in mm/s, lambda_M in rad/s."""

    case: str
    pin_height: int
    direction: int
    at_pin: str
    rotation: str


VELOCITIES = (
    Velocity("monotonic-lz20", 20, -1, "0.05", "-0.000555"),
    Velocity("monotonic-lz20", 20, 1, "0.0166", "0.000555"),
    Velocity("monotonic-lz40", 40, -1, "0.06666", "-0.001111"),
    Velocity("monotonic-lz40", 40, 1, "0.0", "0.001111"),
)
LARGEST_PRESSURE = "33.33"  # MPa, twice the mean, at the end without heat and, at the centre of Example 2, with heat
MONOTONIC_TEMPERATURE = "47.16"  # K at x = 0, from the two one-way motions
PERIODIC_TEMPERATURE = "50.11"  # K at x = 0 in periodic motion, after 2,200 half-cycles
DIFFERENCE = "5.89"  # %, of the periodic temperature: (50.11 - 47.16) / 50.11
TEMPERATURE_HALF_CYCLE = 2200
PEAK_HALF_CYCLE = 1800  # after which the largest pressure falls again

OPEN = (
    "the share kappa of the friction heat that goes to the punch, and the debris' share gamma_d",
    "plane stress or plane strain",
    "the supports of the strip",
    "the heights of the four hinges of Example 2",
    "the relaxation of the pressure between heat and contact",
)


def last_digit(printed: str) -> float:
    """Return the weight of the last printed digit: the paper cuts its numbers off there."""
    _, _, decimals = printed.partition(".")
    return float(10 ** -len(decimals))
