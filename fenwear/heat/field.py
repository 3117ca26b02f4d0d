"""The temperature of one body as a state that steps advance: the full field, or a reduced one.

Both answer the same questions: the state at the end of a step without flux through the contact,
its response to the fluxes there, and any linear functional of the temperature.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import reduce
from typing import Protocol

import numpy as np
import scipy.linalg
from scipy.sparse import csr_array

from fenwear.arrays import Array
from fenwear.heat.conduction import HeatBody, HeatStep
from fenwear.parallel import total

Functional = Callable[[Array], Array]


class Field(Protocol):
    """A body's temperature, with the steps that advance it numbered as they were given."""

    @property
    def responses(self) -> Sequence[Array]:
        """State from unit fluxes at the interface nodes in each step, each (dim, n)."""

    def initial(self) -> Array:
        """Return the initial state (dim,)."""

    def advance(self, step: int, state: Array) -> Array:
        """Return the state after a step without flux through the contact (dim,)."""

    def advance_linear(self, step: int, states: Array) -> Array:
        """Return what a step makes of changes of the state (dim, k), without its sources."""

    def observe(self, rows: Array | csr_array) -> Functional:
        """Return the functional rows . theta of a state.

        Args:
            rows: (j, owned), over the full field's owned degrees of freedom; dense or sparse.
        """

    def observe_change(self, rows: Array | csr_array) -> Functional:
        """Return the same functional of changes of the state, (dim,) or (dim, k)."""

    def temperature(self, state: Array) -> Array:
        """Return the temperature of the owned degrees of freedom (owned,), K."""

    def state(self, temperature: Array) -> Array:
        """Return the state of a temperature (owned,), or the nearest there is."""


class FullField:
    """The temperature of all nodes, distributed over the ranks; all calls are collective."""

    def __init__(self, body: HeatBody, steps: Sequence[HeatStep], inflow: Array) -> None:
        """Keep the responses to the fluxes.

        Args:
            body: The body.
            steps: Its factored steps.
            inflow: Loads of unit fluxes at the interface nodes (owned, n), mm.
        """
        self.body, self.steps = body, list(steps)
        self.responses: Sequence[Array] = [step.respond(inflow) for step in self.steps]

    def initial(self) -> Array:
        """Return the initial temperature."""
        return self.body.initial()

    def advance(self, step: int, state: Array) -> Array:
        """Solve one step."""
        return self.steps[step].advance(state)

    def advance_linear(self, step: int, states: Array) -> Array:
        """Solve one step for several changes."""
        return self.steps[step].advance_linear(states)

    def observe(self, rows: Array | csr_array) -> Functional:
        """Return the functional, summed over the ranks."""
        comm = self.body.body.mesh.comm

        return lambda state: total(comm, rows @ state)

    observe_change = observe

    def temperature(self, state: Array) -> Array:
        """Return the state itself."""
        return state

    def state(self, temperature: Array) -> Array:
        """Return the temperature itself."""
        return temperature


class ReducedField:
    """Galerkin projection theta = lift + V a onto a basis V, the same state a on every rank."""

    def __init__(self, body: HeatBody, steps: Sequence[HeatStep], inflow: Array, lift: Array, basis: Array) -> None:
        """Project the steps; collective.

        Args:
            body: The body.
            steps: Its factored steps.
            inflow: Loads of unit fluxes at the interface nodes (owned, n), mm.
            lift: A temperature with the held values (owned,).
            basis: V (owned, dim), orthonormal in the heat capacity, zero where temperatures are held.
        """
        self.body, self.lift, self.basis = body, lift, basis
        self._propagators: list[Array] = []
        self._sources: list[Array] = []
        self.responses: list[Array] = []
        for step in steps:
            a_basis, b_basis = step.apply(basis)
            a_lift, b_lift = step.apply(lift[:, None])
            a = self._sum(basis.T @ a_basis)
            self._propagators.append(scipy.linalg.solve(a, self._sum(basis.T @ b_basis)))
            source = basis.T @ (step.source + (b_lift - a_lift)[:, 0])
            self._sources.append(scipy.linalg.solve(a, self._sum(source)))
            self.responses.append(scipy.linalg.solve(a, self._sum(basis.T @ inflow)))

    def spectral_radius(self, cycle: Sequence[int]) -> float:
        """Return the factor by which some temperature changes in every cycle of these steps, the largest in size."""
        product = reduce(lambda through, step: self._propagators[step] @ through, cycle, np.eye(len(self.basis[0])))
        return float(np.abs(np.linalg.eigvals(product)).max(initial=0.0))

    def _sum(self, partial: Array) -> Array:
        return total(self.body.body.mesh.comm, partial)

    def initial(self) -> Array:
        """Return the projection of the initial temperature; collective."""
        return self.state(self.body.initial())

    def advance(self, step: int, state: Array) -> Array:
        """Apply the dense step."""
        return self._propagators[step] @ state + self._sources[step]

    def advance_linear(self, step: int, states: Array) -> Array:
        """Apply the dense step to changes."""
        return self._propagators[step] @ states

    def observe(self, rows: Array | csr_array) -> Functional:
        """Return the projected functional; collective to make, not to call."""
        matrix, constant = self._sum(rows @ self.basis), self._sum(rows @ self.lift)
        return lambda state: matrix @ state + constant

    def observe_change(self, rows: Array | csr_array) -> Functional:
        """Return the projected functional of changes; collective to make, not to call."""
        matrix = self._sum(rows @ self.basis)
        return lambda states: matrix @ states

    def temperature(self, state: Array) -> Array:
        """Return lift + V a."""
        return self.lift + self.basis @ state

    def state(self, temperature: Array) -> Array:
        """Return the projection in the norm of the heat capacity; collective."""
        return self._sum(self.basis.T @ self.body.store(temperature - self.lift))
