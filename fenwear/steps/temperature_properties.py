"""States of bodies whose materials have the properties of the temperatures there.

State and bodies follow each other: the state of the bodies as they are, the bodies with the properties of its
temperatures, and so on, until no property changes any more.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from fenwear.common.errors import ConvergenceError
from fenwear.heat.temperature import HeatState
from fenwear.system import Tribosystem, property_change, taken_at, warmed_system, warming_key

T = TypeVar("T")
LEFT = 0.1  # of heat.property_tolerance: what properties may still change by in the state that is found
FALLING = 0.7  # of the change of the properties in the pass before
PASSES = 30


def with_own_properties(
    system: Tribosystem,
    found: Callable[[Tribosystem], T],
    temperatures: Callable[[T], HeatState | None],
    within: float | None = None,
) -> tuple[T, int]:
    """Return the state whose bodies have the properties of its own temperatures, and the number of updates.

    Where the change does not fall from pass to pass, half of it is followed, then a quarter, and so on. Collective.

    Args:
        system: The assembled problem.
        found: Function that returns the state with the properties as they are; collective.
        temperatures: Of a state.
        within: Relative change of the properties that is left; by default a tenth of heat.property_tolerance.

    Raises:
        CaseError: a property is not positive at a temperature.
        ConvergenceError: the properties do not come to rest.
    """
    state, key = found(system), warming_key(system)
    if not key or system.heat is None:
        return state, 0
    share = LEFT if within is None else within / system.heat.property_tolerance
    followed, before = 1.0, np.inf
    for done in range(PASSES):
        end = temperatures(state)
        if end is None:
            return state, 0
        change = property_change(system, end)
        if change <= share:
            return state, done
        followed, before = followed / 2 if change > FALLING * before else followed, change
        if followed < 1:
            pairs = zip(end.temperatures(), taken_at(system), strict=True)
            between = [followed * new + (1 - followed) * old for new, old in pairs]
            end = HeatState.nodal(system.bodies.heat, between, end.track)
        system = warmed_system(system, end)
        state = found(system)
    raise ConvergenceError(
        f"the temperatures of the steady state and the properties that depend on them, {key}, did not converge "
        f"in {PASSES} passes: follow them by `run`"
    )
