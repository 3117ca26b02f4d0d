"""One-way sliding with heat: steady temperatures at the optimal pressure, and their mean for periodic motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fenwear.arrays import Array
from fenwear.assembly import Tribosystem, steady_exchange, warming_key
from fenwear.errors import CaseError, ConvergenceError, InputError

DIRECTIONS = (-1, 1)


@dataclass(frozen=True)
class Monotonic:
    """Steady temperatures of one-way sliding at the mean speed of the motion, leftward and rightward.

    Attributes:
        pressure: Optimal pressure of each direction (2, n), MPa.
        punch: Temperature of the punch's contact surface (2, n), K.
        strip: Of the strip's (2, n), K.
    """

    pressure: Array
    punch: Array
    strip: Array

    @property
    def periodic_punch(self) -> Array:
        """The punch under periodic motion as the paper combines it: each direction heats half of the time (n,), K."""
        return self.punch.mean(axis=0)


def monotonic(system: Tribosystem) -> Monotonic:
    """Return the steady temperatures at the optimal pressures; collective.

    Raises:
        CaseError: the case has no heat, or a body loses heat nowhere.
        ConvergenceError: properties of materials depend on the temperature.
    """
    if system.heat is None:
        raise CaseError(InputError("heat", "missing, but required here"))
    if key := warming_key(system):
        raise ConvergenceError(
            f"no steady temperatures of one-way sliding are solved for where {key} depends on the temperature; "
            'expected `steady`, or a motion.kind = "one-way"'
        )
    speed = system.motion.mean_speed
    exchange = steady_exchange(system, [d * speed for d in DIRECTIONS])
    pressures = system.team.lead(lambda: [system.optimum(d).pressure for d in DIRECTIONS])
    punch, strip = [], []
    for phase, pressure in enumerate(pressures):
        state, _ = exchange.half_cycle(exchange.initial(), phase, pressure, exchange.conductance(pressure))
        temperatures = exchange.contact_temperatures(state)
        punch.append(temperatures[0])
        strip.append(temperatures[1])
    return Monotonic(np.array(pressures), np.array(punch), np.array(strip))
