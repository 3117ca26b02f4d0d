"""One phase with heat: contact and conduction, coupled.

The pressure heats, the heat opens or closes the gap, the gap makes the pressure. Implicitly: the
thermal gap at the end of the half-cycle is linear in its pressure as long as the same nodes conduct,
so its matrix joins the elastic compliance and one inequality solves for both. Or by the paper's
operator split: conduct at fixed pressure, solve contact, relax the pressure (29), repeat until the
volume of the gap rests (30).

Where a node conducts while it touches, both may be a solution. Plain iteration from the phase a cycle ago goes to the
same one on any number of ranks, which combinations of earlier iterates do not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fenwear.common.arrays import Array
from fenwear.common.errors import ConvergenceError
from fenwear.common.parallel import agreed
from fenwear.contact import ContactSolver, ContactState, WearCompliance
from fenwear.heat.temperature import HeatState
from fenwear.steps.block import HalfCycleHeat
from fenwear.system import Tribosystem

MAX_ITERATIONS = 200
ALTERNATES = 20  # iterations after which nodes that open and close in turn are followed half way
APART = (
    "contact and heat did not converge: nodes open and close in turn. "
    'Set heat.conducting = "nominal", or increase heat.steps'
)
SPLIT_ADVICE = 'Reduce heat.relaxation, increase heat.steps, or set heat.coupling = "implicit"'
WORTH_IT = 12  # iterations with the same conductances after which a costly response of their own pays
CLOSE = 1e-10  # change of pressure over the mean pressure that ends the implicit iterations


@dataclass
class _Response:
    """Effect of unit pressures of a half-cycle at its end, for given conductances."""

    conductance: Array
    state: Array
    terms: Array
    gap: Array


class ThermalContact:
    """Contact in one phase of the motion together with the heat of its half-cycle.

    Args:
        system: The assembled problem, with heat.
        phase: Which phase.
        contact: Contact of the phase.
    """

    def __init__(self, system: Tribosystem, phase: int, contact: ContactSolver) -> None:
        self.system, self.exchange, self.phase = system, system.exchange, phase
        self._contact = contact
        self._response: _Response | None = None
        self._asked, self._repeats = b"", 0  # conductances asked for last, and how often in a row

    def slide(self, mu: Array) -> None:
        """Set the friction of the nodes times what they slide for a unit of the stroke (n,)."""
        friction = self.exchange.friction.copy()
        if not np.array_equal(friction[self.phase], mu):
            friction[self.phase] = mu
            self.exchange, self._response = self.exchange.with_friction(friction), None

    def solve(
        self, temperature: HeatState, gap: Array, start: ContactState | None, wearing: WearCompliance | None
    ) -> tuple[ContactState, HeatState, HalfCycleHeat]:
        """Return contact, temperature at the end of the half-cycle, and its heat.

        Args:
            temperature: At the start.
            gap: Of the unloaded bodies at the initial temperature, worn depth included (n,), mm.
            start: State of this phase one cycle ago.
            wearing: Wear of this half-cycle where its step is implicit.

        Raises:
            ConvergenceError: contact and heat do not converge.
        """
        if start is None:
            start = self._contact.solve(gap + self.exchange.gap(temperature, self.phase - 1), None, wearing)
        if self.exchange.heat.coupling == "split":
            return self._split(temperature, gap, start, wearing)
        return self._implicit(temperature, gap, start, wearing)

    def _implicit(
        self, temperature: HeatState, gap: Array, start: ContactState, wearing: WearCompliance | None
    ) -> tuple[ContactState, HeatState, HalfCycleHeat]:
        exchange, contact = self.exchange, start
        mean = self.system.rigid.mean_pressure
        relaxed = 1.0
        pressure = start.pressure[0]
        for iteration in range(1, MAX_ITERATIONS + 1):
            conductance = exchange.conductance(pressure)
            after, terms = exchange.half_cycle(temperature, self.phase, pressure, conductance)
            response = self._respond(conductance)
            free = gap + exchange.gap(after, self.phase) - response.gap @ pressure
            contact = self._contact.solve(free, contact, wearing, response.gap[None, :, None, :])
            change = contact.pressure[0] - pressure
            if agreed(self.system.comm, bool(np.abs(change).max() < CLOSE * mean)):
                return contact, after, self._heat(after, terms, iteration)
            others = response.conductance, exchange.conductance(contact.pressure[0])
            exact = all(np.array_equal(other, conductance, equal_nan=True) for other in others)
            if agreed(self.system.comm, exact):
                after = exchange.at(after.values + response.state @ change)
                return contact, after, self._heat(after, terms + response.terms @ change, iteration)
            if iteration > ALTERNATES:
                relaxed = 0.5
            pressure = pressure + relaxed * change
        raise ConvergenceError(f"{APART} ({MAX_ITERATIONS} iterations)")

    def _respond(self, conductance: Array) -> _Response:
        """Return the response for these conductances, or a near one where it is costly to make."""
        known, key = self._response, conductance.tobytes()
        self._repeats = self._repeats + 1 if key == self._asked else 0
        self._asked = key
        costly = self.exchange.by_pressure or self.exchange.heat.operator == "full"
        near = known is not None and (known.conductance.tobytes() == key or (costly and self._repeats < WORTH_IT))
        if known is not None and agreed(self.system.comm, near):
            return known
        state, terms = self.exchange.change(self.phase, conductance, pressure=np.eye(len(conductance)))
        self._response = _Response(conductance, state, terms, self.exchange.gap_change(state, self.phase))
        return self._response

    def _split(
        self, temperature: HeatState, gap: Array, start: ContactState, wearing: WearCompliance | None
    ) -> tuple[ContactState, HeatState, HalfCycleHeat]:
        exchange = self.exchange
        relaxation, tolerance = exchange.heat.relaxation, exchange.heat.split_tolerance
        contact, pressure, volume = start, start.pressure[0], np.inf
        for iteration in range(1, MAX_ITERATIONS + 1):
            closed = np.where(contact.pressure[0] > 0, pressure, 0.0)  # relaxed pressures never get to zero
            after, terms = exchange.half_cycle(temperature, self.phase, pressure, exchange.conductance(closed))
            free = gap + exchange.gap(after, self.phase)
            try:
                contact = self._contact.solve(free, contact, wearing)
            except ConvergenceError as error:  # the heat of a pressure too far off opens all nodes
                raise ConvergenceError(f"{error}; in iteration {iteration} of the split. {SPLIT_ADVICE}") from error
            before, volume = volume, gap_volume(self.system, free)
            pressure = pressure + relaxation * (contact.pressure[0] - pressure)
            if agreed(self.system.comm, bool(abs(volume - before) < tolerance * volume)):
                return contact, after, self._heat(after, terms, iteration)
            if agreed(self.system.comm, not np.isfinite(volume)):
                break
        raise ConvergenceError(
            f"the operator split of heat and contact did not converge in {iteration} iterations. {SPLIT_ADVICE}"
        )

    def _heat(self, state: HeatState, terms: Array, iterations: int) -> HalfCycleHeat:
        punch, strip = self.exchange.contact_temperatures(state, self.phase)
        return HalfCycleHeat(punch, strip, terms, iterations, state.bulk)


class ColdContact:
    """Contact in one phase of bodies without heat; methods as of `ThermalContact`."""

    def __init__(self, system: Tribosystem, phase: int, contact: ContactSolver) -> None:  # noqa: ARG002
        self._contact = contact

    def slide(self, mu: Array) -> None:
        """Set the friction of the nodes, which heats nothing."""

    def solve(
        self,
        temperature: HeatState,  # noqa: ARG002
        gap: Array,
        start: ContactState | None,
        wearing: WearCompliance | None,
    ) -> tuple[ContactState, None, None]:
        """Return contact, and no heat."""
        return self._contact.solve(gap, start, wearing), None, None


def gap_volume(system: Tribosystem, gap: Array) -> float:
    """Return the cross-section between the unloaded surfaces where they touch first, mm², for (30)."""
    modes, weights = system.rigid.rigid_normal, system.pair.weights
    root = np.sqrt(weights)
    fitted = modes @ np.linalg.lstsq(modes * root[:, None], gap * root, rcond=None)[0]
    return float(weights @ np.abs(gap - fitted))
