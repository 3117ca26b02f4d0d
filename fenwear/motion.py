"""The sliding motion: the directions of a cycle and the exact integrals of the speed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import gamma

from fenwear.arrays import Array
from fenwear.case import OneWay, Reciprocating


@dataclass(frozen=True)
class Motion:
    """Equal half-cycles whose directions repeat.

    Attributes:
        directions: Sliding direction d of each phase of a cycle: (1, -1) reciprocating, (d,) one-way.
        duration: Of one half-cycle, s.
    """

    directions: tuple[int, ...]
    duration: float
    _description: OneWay | Reciprocating

    def sliding(self, speed_exponent: float = 1.0) -> float:
        """Return the integral of v^a over a half-cycle, mm^a s^(1-a); for a = 1 the sliding distance.

        Reciprocating, v = u0 omega |sin omega t| over pi / omega (equation 10):
        (u0 omega)^a / omega sqrt(pi) Gamma((a + 1) / 2) / Gamma(a / 2 + 1), which is 2 u0 for a = 1.
        """
        a, motion = speed_exponent, self._description
        if isinstance(motion, OneWay):
            return motion.speed**a * motion.duration
        beta = math.sqrt(math.pi) * gamma((a + 1) / 2) / gamma(a / 2 + 1)
        return float((motion.amplitude * motion.angular_frequency) ** a / motion.angular_frequency * beta)

    def mean_speeds(self, steps: int) -> Array:
        """Return the mean speed of each of equal steps of a half-cycle (steps,), mm/s; they add up exactly."""
        motion = self._description
        if isinstance(motion, OneWay):
            return np.full(steps, motion.speed)
        edges = np.cos(np.linspace(0.0, math.pi, steps + 1))
        speeds = motion.amplitude * (edges[:-1] - edges[1:]) * steps / self.duration
        return (speeds + speeds[::-1]) / 2  # equal pairs to the last digit: they share their operators


def make_motion(description: OneWay | Reciprocating) -> Motion:
    """Return the motion that the case describes."""
    if isinstance(description, OneWay):
        direction = 1 if description.direction == "rightward" else -1
        return Motion((direction,), description.duration, description)
    return Motion((1, -1), math.pi / description.angular_frequency, description)
