"""All phases of a cycle with what depends on their pressures: heat, the nodes that conduct, friction and wear."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.assembly import Tribosystem, heating_friction, with_reduced_heat
from fenwear.contact import ContactState
from fenwear.cycle.fixed_point import fixed_point
from fenwear.cycle.state import pressure_scale
from fenwear.heat.periodic import CycleHeat, CycleJump
from fenwear.sliding.friction import ContactConditions

CLOSE = 1e-9  # change of pressure and temperature over their largest that ends the iterations
DISAGREE = (
    'set heat.conducting = "nominal", or take weaker dependences: contact and what depends on it, the nodes that '
    "conduct or the coefficients, did not come together"
)

# Contact of all phases for a thermal gap (m, n) and its coupling (m, n, m, n), None without heat, from a start.
SolveContact = Callable[[Array | None, Array | None, ContactState], ContactState]
# Takes friction and wear at the conditions of the phases.
Take = Callable[[Sequence[ContactConditions]], None]


def cycle_heat(system: Tribosystem) -> CycleHeat | None:
    """Return the heat of whole cycles; None without heat."""
    exchange = with_reduced_heat(system).exchange
    return None if exchange is None else CycleHeat(exchange)


class Coupled:
    """Contact of all phases of a cycle at the heat and the coefficients of its own end.

    Args:
        system: The assembled problem.
        take: Takes friction and wear at the conditions of the phases, before contact is solved.

    Attributes:
        heat: Of whole cycles; None without heat. Linear in mu p: where mu is not constant its own mu is 1.
        mu: What the pressures are to be multiplied by for `heat` (m, n): what friction heats.
    """

    def __init__(self, system: Tribosystem, take: Take) -> None:
        self.system, self._take = system, take
        self.heat = cycle_heat(system)
        self.mu: Array = np.ones((len(system.motion.phases), len(system.pair.weights)))
        if self.heat is not None and not system.friction.constant:
            self.heat = CycleHeat(self.heat.exchange.with_friction(self.mu))

    def solve(
        self, temperature: Array | None, cycles: float, start: ContactState, solve: SolveContact
    ) -> tuple[ContactState, Array | None]:
        """Return contact, and temperature (dim,) at the start of its cycle, `cycles` cycles on in one implicit step.

        The unknowns are the pressures, and where coefficients depend on them the temperatures at the start of each
        phase. Without such coefficients the solution is exact once the same nodes conduct.

        Args:
            temperature: Before (dim,); None without heat.
            cycles: How many; infinitely many give the periodic temperature.
            start: Where contact starts from.
            solve: Contact at the friction and wear last taken.

        Raises:
            ConvergenceError: contact did not converge, or nodes open and close in turn.
        """
        system, heat, constant = self.system, self.heat, self.system.constant_coefficients
        shape, size, contact = start.pressure.shape, start.pressure.size, start
        first: Array = start.pressure.ravel()
        unit = 1.0
        known: tuple[bytes, CycleJump] | None = None
        if heat is not None and temperature is not None and not constant:
            now = self.surfaces(temperature, start.pressure)
            # Both kinds of unknown of one size, which is what their combination looks at.
            unit = pressure_scale(system, start.pressure) / max(float(np.abs(now).max()), 1.0)
            first = np.concatenate([first, unit * now.ravel()])

        def advance(x: Array) -> tuple[Array, tuple[ContactState, Array | None], bool]:
            nonlocal contact, known
            pressure = x[:size].reshape(shape)
            if not constant:
                self._update(pressure, x[size:].reshape(-1, 2, shape[1]) / unit)
            if heat is None or temperature is None:
                contact = solve(None, None, contact)
                return contact.pressure.ravel(), (contact, None), constant
            conductances = heat.conductances(pressure)
            key = conductances.tobytes()
            if known is None or known[0] != key:
                known = (key, heat.jump(temperature, cycles, conductances))
            end = known[1]
            contact = solve(end.gap, end.coupling * self.mu, contact)
            state = end.state(self.mu * contact.pressure)
            found: Array = contact.pressure.ravel()
            same = np.array_equal(heat.conductances(contact.pressure), conductances, equal_nan=True)
            if not constant:
                found = np.concatenate([found, unit * self.surfaces(state, contact.pressure).ravel()])
            return found, (contact, state), same and constant

        return fixed_point(advance, first, lambda change, x: _close(change, x, size), DISAGREE)

    def at_friction(self) -> CycleHeat | None:
        """Return the heat of whole cycles at the friction last taken."""
        if self.heat is None or self.system.friction.constant:
            return self.heat
        return CycleHeat(self.heat.exchange.with_friction(self.mu))

    def surfaces(self, state: Array, pressure: Array) -> Array:
        """Return the contact temperatures of both bodies at the start of each phase (m, 2, n), K."""
        heat = self.heat
        if heat is None:
            return np.zeros((0, 2, pressure.shape[1]))
        starts = self.through(state, pressure)[:-1]
        return np.array([heat.exchange.contact_temperatures(heat.parts(one)) for one in starts])

    def through(self, state: Array, pressure: Array) -> list[Array]:
        """Return the temperatures (dim,) before, between and after the phases of a cycle at these pressures."""
        heat, states = self.heat, [state]
        if heat is None:
            return states
        for one, p, mu in zip(heat.maps(heat.conductances(pressure)), pressure, self.mu, strict=True):
            after: Array = one.propagator @ states[-1] + one.source + one.response @ (mu * p)
            states.append(after)
        return states

    def _update(self, pressure: NDArray[Any], surfaces: NDArray[Any]) -> None:
        """Take the coefficients at these pressures and, where there are any, temperatures of the phases."""
        system = self.system
        conditions = [
            system.conditions(k, p, (surfaces[k, 0], surfaces[k, 1]) if len(surfaces) else None)
            for k, p in enumerate(pressure)
        ]
        self._take(conditions)
        if not system.friction.constant:
            self.mu = np.array([heating_friction(system, system.friction.values(state)) for state in conditions])


def _close(change: Array, x: Array, pressures: int) -> bool:
    """Return whether pressures, and the temperatures behind them, change by rounding only."""
    return all(
        float(np.abs(part).max()) <= CLOSE * max(float(np.abs(whole).max()), 1e-300)
        for part, whole in ((change[:pressures], x[:pressures]), (change[pressures:], x[pressures:]))
        if part.size
    )
