"""What gross sliding leaves out of a stroke: the way that the bodies follow friction elastically before they slide."""

from __future__ import annotations

import numpy as np

from fenwear.assembly import Tribosystem

TAKEN_UP = 0.1  # of the amplitude: slip and worn volume are too large by that
SHEARED = 1.9  # displacement along the surface by a friction over that across it by an equal pressure


def elastic_way(system: Tribosystem) -> float:
    """Return about how far each way the bodies follow friction elastically before they slide as a whole, mm.

    mu times the mean displacement of the contact by an even pressure, as seen from where the load acts, times the
    ratio of displacements along and across the surface. That is 1 on a half-plane and (2 - nu) / (2 - 2 nu) on a
    half-space (K. L. Johnson, Contact Mechanics, 1985), and 2 / (1 - nu) and 2 (1 + nu) for a block that is sheared and
    not compressed. Both displacements add up; where each is a half, the ratio is 1.9 at nu = 0.3.
    Equal shares are an assumption, kept as one case with stick bears it out (12 % off; a geometric mean was 22 % off).
    0 where supports and not the contact carry the load.
    """
    if not system.normal_force:
        return 0.0
    weights = system.pair.weights
    pressed_in = float(weights @ system.interface.by_even / weights.sum()) * system.rigid.mean_pressure
    ratio = float(weights @ np.linalg.norm(system.friction_ratio(1), axis=1) / weights.sum())
    return SHEARED * ratio * max(pressed_in, 0.0)


def stroke_amplitude(system: Tribosystem) -> float:
    """Return the mean amplitude of the sliding to and fro, mm."""
    slid = float((system.sliding_ratio.mean(axis=1) * system.motion.sliding()).sum())
    return slid / (2 * system.motion.half_cycles)


def elastic_share(system: Tribosystem) -> float | None:
    """Return the share of the amplitude that the bodies take up elastically before they slide as a whole.

    None for sliding one way, and where nodes stick: there it is followed.
    """
    if system.sticks or len(set(system.motion.directions)) == 1:
        return None
    return elastic_way(system) / max(stroke_amplitude(system), 1e-300)
