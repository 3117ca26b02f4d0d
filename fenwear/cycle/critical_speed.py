"""The speed of sliding beyond which full contact is thermo-elastically unstable."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fenwear.arrays import Array, Mask
from fenwear.assembly import Tribosystem, steady_exchange


def critical_speed(system: Tribosystem, direction: int) -> float:
    """Return the sliding speed above which full contact is thermo-elastically unstable; collective.

    Of disturbances that grow without moving along the contact, and without wear: there the steady
    temperature of a pressure makes just this pressure, p = -V X Theta p, with X the elastic stiffness
    of the contact and Theta the thermal gap of the friction heat at unit speed (for a half-plane on
    an insulator: Burton, V = 2 (1 - nu) k m / (mu E alpha)). Infinite where no speed is critical.
    In mm/s; in rad/s where the strip turns.

    Args:
        system: The assembled problem, with heat.
        direction: Sliding direction d.

    Raises:
        CaseError: the case has no heat, or a body no heat sink.
    """
    n = len(system.pair.weights)
    everywhere = np.ones(n, dtype=bool)
    friction_ratio = system.friction_ratio(direction)
    compliance = system.interface.compliance(friction_ratio).matrix()
    stiffness = _restricted_stiffness(system, friction_ratio, compliance, everywhere)
    speed = system.motion.mean_speed
    for _ in range(50):  # the strip's temperature depends on its speed
        exchange = steady_exchange(system, [direction * speed])
        uniform = np.full(n, system.rigid.mean_pressure)
        states, _terms = exchange.change(0, exchange.conductance(uniform), pressure=np.eye(n))
        thermal = exchange.gap_change(states) / speed
        before, speed = speed, system.team.lead(partial(_unstable_speed, stiffness, thermal))
        if np.isinf(speed):
            break
        if abs(speed - before) < 1e-6 * speed:
            break
    return speed


def _restricted_stiffness(system: Tribosystem, friction_ratio: Array, compliance: Array, closed: Mask) -> Array:
    """Return minus the pressure (n, n) that each unit of gap makes where `closed` nodes stay closed."""
    rigid = system.rigid
    nodes = np.flatnonzero(closed)
    k, r = len(nodes), rigid.rigid_normal.shape[1]
    scale = system.interface.elastic_length
    matrix = np.zeros((k + r, k + r))
    matrix[:k, :k] = compliance[np.ix_(nodes, nodes)] / scale
    matrix[:k, k:] = rigid.rigid_normal[nodes]
    matrix[k:, :k] = rigid.equilibrium(friction_ratio)[:, nodes]
    stiffness = np.zeros((len(closed), len(closed)))
    stiffness[np.ix_(nodes, nodes)] = np.linalg.inv(matrix)[:k, :k] / scale
    return stiffness


def _unstable_speed(stiffness: Array, thermal: NDArray[Any]) -> float:
    """Return the lowest V of p = -V X Theta p; infinite where there is none."""
    values = np.linalg.eigvals(-stiffness @ thermal)
    growing = values.real[(np.abs(values.imag) < 1e-6 * np.abs(values.real).max()) & (values.real > 0)]
    return float(1 / growing.max()) if len(growing) else float("inf")
