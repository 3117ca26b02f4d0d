"""Contact as a variational inequality: Signorini's conditions with friction of known direction.

For every phase of the motion (a sliding direction d) and every contact node:

    gap = S(tau) p + H a + g >= 0,    p >= 0,    p gap = 0,
    sum of w_i p_i (e_n + tau)_i . m_i + F = 0   for the rigid modes a and their motions m,

tau the traction of friction over the pressure, g the gap of the unloaded bodies with their
loads' effect and the worn depth. A `Layer` adds to the gaps of all phases what their own pressures
open, such as the wear of the step they belong to.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fenwear.arrays import Array
from fenwear.contact.inequality import Inequality
from fenwear.contact.operators import Phases
from fenwear.errors import ConvergenceError
from fenwear.interface import Interface
from fenwear.remedies import FULL_START, FULL_START_SEARCH, LINE_SEARCH, Remedies

PREFIX, NAME = "fenwear_contact_", "the contact of punch and strip"
ZERO = 1e-12  # of the mean pressure: what an open node may have left by rounding


@dataclass(frozen=True)
class ContactState:
    """Contact in each of m phases.

    Attributes:
        pressure: p (m, n), MPa.
        gap: (m, n), mm.
        rigid: Amplitudes a of the rigid modes (m, modes).
        iterations: Newton iterations of the inequality.
    """

    pressure: Array
    gap: Array
    rigid: Array
    iterations: int


@dataclass(frozen=True)
class SlidingContact:
    """What slides in one phase.

    Attributes:
        interface: The surfaces opposite each other, under the loads of the phase.
        friction_ratio: tau (n, d), the traction of friction on the punch over the pressure.
    """

    interface: Interface
    friction_ratio: Array


class Layer(Protocol):
    """What the phases' own pressures add to every phase's gap."""

    def opening(self, pressure: Array) -> Array:
        """Return the added gap (m, n), mm, from the pressures (m, n)."""

    def border(self, pressure: Array) -> tuple[Array, Array]:
        """Return L (m, n, q) and R (m, q, n): its derivative, of phase k to pressures j, is L_k R_j, mm/MPa."""


class ContactSolver(Protocol):
    """Contact in a fixed sequence of phases, kept for many solves."""

    def solve(
        self,
        gap: Array,
        start: ContactState | None = None,
        layer: Layer | None = None,
        coupling: Array | None = None,
    ) -> ContactState:
        """Return the contact for the unloaded gap (n,) or (m, n), mm."""


class CondensedContact:
    """The inequality on the condensed interface, with unknown (p, a) for each phase.

    Pressure is scaled by the mean pressure, gap by the elastic length that belongs to it, so that
    PETSc's absolute tolerances mean the same for every case. Phases meet in the layer only: where
    there are many, one small elimination for each of them takes the place of one of all.
    """

    def __init__(self, phases: Sequence[SlidingContact], remedies: Remedies | None = None) -> None:
        """Take the phases, and where to note that a contact was solved in another way than usual."""
        self.phases = list(phases)
        self._remedies = remedies or Remedies()
        interface = phases[0].interface
        rigid = interface.rigid
        n, r, m = len(rigid.pair.weights), len(rigid.resultant), len(self.phases)
        self.shape = (m, n)
        self._pressure_scale = rigid.mean_pressure
        self._gap_scale = self._pressure_scale * interface.elastic_length
        lengths = np.abs(rigid.rigid_normal).max(axis=0, initial=0.0)
        self._rigid_scale = self._gap_scale / lengths
        self._resultant_scale = lengths * self._pressure_scale * rigid.pair.weights.sum()
        size = n + r
        self._unit = np.concatenate([np.full(n, self._pressure_scale), self._rigid_scale])
        self._blocks = np.zeros((m, size, size))
        self._offset = np.zeros((m, size))
        self.press(1.0)
        for phase, block in zip(self.phases, self._blocks, strict=True):
            block[:n, n:] = phase.interface.rigid.rigid_normal * (self._rigid_scale / self._gap_scale)
        self._ratios = [phase.friction_ratio for phase in self.phases]
        for k, ratio in enumerate(self._ratios):
            self._fill_friction(k, ratio)
        self._coupling: Array | None = None
        self._layer: Layer | None = None
        self._right: Array | None = None  # of the layer's border
        self._elastic: Phases | None = None
        self._operator: Phases | None = None
        lower = np.tile(np.concatenate([np.zeros(n), np.full(r, -np.inf)]), m)
        self.inequality = Inequality(lower, np.full(m * size, np.inf), self._residual, self._jacobian, PREFIX, NAME)

    def _fill_friction(self, k: int, ratio: Array) -> None:
        n, interface = self.shape[1], self.phases[k].interface
        balance = interface.rigid.equilibrium(ratio)
        self._blocks[k, :n, :n] = interface.compliance(ratio) * (self._pressure_scale / self._gap_scale)
        self._blocks[k, n:, :n] = balance * (self._pressure_scale / self._resultant_scale[:, None])

    def press(self, factor: float) -> None:
        """Take all loads times a factor."""
        n = self.shape[1]
        self._loads = factor * np.array([phase.interface.load_gap for phase in self.phases])
        for phase, offset in zip(self.phases, self._offset, strict=True):
            offset[n:] = factor * phase.interface.rigid.resultant / self._resultant_scale

    def slide(self, ratios: Sequence[Array]) -> None:
        """Set tau of each phase, (n, d) each."""
        for k, (ratio, before) in enumerate(zip(ratios, self._ratios, strict=True)):
            if ratio is not before and not np.array_equal(ratio, before):
                self._fill_friction(k, ratio)
                self._elastic = self._operator = None
        self._ratios = list(ratios)

    def _residual(self, x: Array) -> Array:
        f = self._linear.multiply(x)
        f += self._offset.ravel()
        if self._layer is not None:
            m, n = self.shape
            pressure = x.reshape(m, -1)[:, :n] * self._pressure_scale
            f.reshape(m, -1)[:, :n] += self._layer.opening(pressure) / self._gap_scale
        return f

    @property
    def _linear(self) -> Phases:
        """The derivative of the residual without the layer."""
        if self._elastic is None:
            coupling = self._coupling
            scaled = None if coupling is None else coupling * (self._pressure_scale / self._gap_scale)
            self._elastic = Phases(self._blocks, scaled)
        return self._elastic

    def _jacobian(self, x: Array) -> Phases:
        if self._layer is None:
            return self._linear
        m, n = self.shape
        left, right = self._layer.border(x.reshape(m, -1)[:, :n] * self._pressure_scale)
        if self._operator is None or self._right is None or not np.array_equal(right, self._right):
            scale = self._pressure_scale / self._gap_scale
            coupling = None if self._coupling is None else self._coupling * scale
            self._right, self._operator = right, Phases(self._blocks, coupling, (left, right * scale))
        return self._operator

    def solve(
        self,
        gap: Array,
        start: ContactState | None = None,
        layer: Layer | None = None,
        coupling: Array | None = None,
    ) -> ContactState:
        """Return the contact of all phases.

        Args:
            gap: Gap of the undeformed bodies, initial gap and worn depth together, (n,) or (m, n), mm.
            start: Where Newton starts, such as the same phases one cycle ago; by default full contact.
            layer: Adds what the pressures themselves open.
            coupling: Gap of each phase's nodes from each phase's pressures (m, n, m, n), mm/MPa, on
                top of the elastic compliance: what the heat of these pressures opens.

        Raises:
            ConvergenceError: SNES did not converge.
        """
        m, n = self.shape
        self._offset[:, :n] = (gap + self._loads) / self._gap_scale
        if coupling is not self._coupling:
            self._coupling, self._elastic, self._operator = coupling, None, None
        self._layer = layer
        x = self._solve(start).reshape(m, -1)
        pressure = x[:, :n] * self._pressure_scale
        pressure[x[:, :n] <= ZERO] = 0.0
        return ContactState(
            pressure,
            self.inequality.residual.reshape(m, -1)[:, :n] * self._gap_scale,
            x[:, n:] * self._rigid_scale,
            self.inequality.iterations,
        )

    def _solve(self, start: ContactState | None) -> Array:
        """Return the solution by the first way that finds it."""
        failure: ConvergenceError | None = None
        for guess, line_search, name in self._ways(start):
            try:
                x = self.inequality.solve(guess.ravel(), near=not name and start is not None, line_search=line_search)
            except ConvergenceError as error:
                failure = failure or error  # the usual way's says most
                continue
            if failure is not None:
                self._remedies.note(name)
            return x
        raise failure or ConvergenceError(self.inequality.name)

    def _ways(self, start: ContactState | None) -> Iterator[tuple[Array, bool, str]]:
        """Yield where to start, whether with a line search, and the name of the remedy that this is."""
        if start is not None:
            near = np.concatenate([start.pressure, start.rigid], axis=1) / self._unit
            yield near, False, ""
            yield near, True, LINE_SEARCH
        full = np.zeros_like(self._offset)
        full[:, : self.shape[1]] = 1.0
        yield full, False, FULL_START
        yield full, True, FULL_START_SEARCH
