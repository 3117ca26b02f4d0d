"""One-way sliding with heat: steady temperatures at the optimal pressure, and their mean for periodic motion.

Each direction has the temperatures of sliding that way alone, and the properties of materials at them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError
from fenwear.heat.temperature import HeatState
from fenwear.steps.slow_changes import with_own_properties
from fenwear.system import Tribosystem, isothermal, steady_exchange

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


@dataclass(frozen=True)
class _Sliding:
    """Of one direction: pressure (n,), MPa, temperatures of both surfaces (n,), K, and of the whole bodies."""

    pressure: Array
    surfaces: tuple[Array, Array]
    end: HeatState


def monotonic(system: Tribosystem, *, properties_within: float | None = None) -> Monotonic:
    """Return the steady temperatures at the optimal pressures; collective.

    Args:
        system: The assembled problem.
        properties_within: As of `steady`.

    Raises:
        CaseError: the case has no heat, or a body loses heat nowhere; a property that is not positive.
        ConvergenceError: there is no optimum, or properties and temperatures do not converge.
    """
    if system.case.heat is None:
        raise CaseError(InputError("heat", "missing, but required here"))
    unheated = replace(system, exchange=isothermal(system))  # the heat of its motion is not asked for
    states = [
        with_own_properties(unheated, partial(_one_way, d), lambda state: state.end, properties_within)[0]
        for d in DIRECTIONS
    ]
    punch, strip = (np.array(both) for both in zip(*(state.surfaces for state in states), strict=True))
    return Monotonic(np.array([state.pressure for state in states]), punch, strip)


def _one_way(direction: int, system: Tribosystem) -> _Sliding:
    """Return the state of sliding in one direction, with the properties as they are; collective."""
    exchange = steady_exchange(system, [direction * system.motion.mean_speed])
    pressure = system.team.lead(lambda: system.optimum(direction).pressure)
    state, _ = exchange.half_cycle(exchange.initial(), 0, pressure, exchange.conductance(pressure))
    return _Sliding(pressure, exchange.contact_temperatures(state), state)
