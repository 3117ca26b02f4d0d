"""Contact as a variational inequality: Signorini's conditions with friction of known direction.

For every phase of the motion (a sliding direction d) and every contact node:

    gap = (S_n + d mu S_t) p + H a + g >= 0,    p >= 0,    p gap = 0,
    (H + d mu H_t)^T W p + F = 0   for the rigid modes a,

g the gap of the unloaded bodies with their loads' effect and the worn depth. A `Layer` adds to the
gaps of all phases what their own pressures open, such as the wear of the step they belong to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fenwear.arrays import Array
from fenwear.contact.inequality import DenseInequality
from fenwear.interface import Interface

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


class Layer(Protocol):
    """What the phases' own pressures add to every phase's gap, node by node."""

    def opening(self, pressure: Array) -> Array:
        """Return the added gap (n,), mm, from the pressures (m, n)."""

    def slope(self, pressure: Array) -> Array:
        """Return its derivative to each pressure (m, n), mm/MPa."""


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
    PETSc's absolute tolerances mean the same for every case.
    """

    def __init__(self, interface: Interface, friction: float, directions: Sequence[int]) -> None:
        self.interface = interface
        self.directions = tuple(directions)
        statics = interface.statics
        n, r, m = len(statics.facing.weights), len(statics.resultant), len(self.directions)
        self.shape = (m, n)
        self._pressure_scale = statics.mean_pressure
        self._gap_scale = self._pressure_scale * interface.elastic_length
        lengths = np.abs(statics.rigid_normal).max(axis=0, initial=0.0)
        self._rigid_scale = self._gap_scale / lengths
        self._resultant_scale = lengths * self._pressure_scale * statics.facing.weights.sum()
        size = n + r
        self._elastic = np.zeros((m * size, m * size))
        self._offset = np.zeros((m, size))
        self._offset[:, n:] = statics.resultant / self._resultant_scale
        for phase, d in enumerate(self.directions):
            block = self._elastic[phase * size : (phase + 1) * size, phase * size : (phase + 1) * size]
            block[:n, :n] = interface.compliance(d, friction) * (self._pressure_scale / self._gap_scale)
            block[:n, n:] = statics.rigid_normal * (self._rigid_scale / self._gap_scale)
            block[n:, :n] = statics.equilibrium(d, friction) * (self._pressure_scale / self._resultant_scale[:, None])
        self._operator, self._coupling = self._elastic, None  # type: Array, Array | None
        self._layer: Layer | None = None
        self._filled = False
        lower = np.tile(np.concatenate([np.zeros(n), np.full(r, -np.inf)]), m)
        upper = np.full(m * size, np.inf)
        self._inequality = DenseInequality(
            lower, upper, self._residual, self._jacobian, "fenwear_contact_", "the contact of punch and strip"
        )

    def _pressures(self, x: Array) -> Array:
        return x.reshape(len(self.directions), -1)[:, : self.shape[1]] * self._pressure_scale

    def _residual(self, x: Array, f: Array) -> None:
        np.dot(self._operator, x, out=f)
        f += self._offset.ravel()
        if self._layer is not None:
            f.reshape(self._offset.shape)[:, : self.shape[1]] += (
                self._layer.opening(self._pressures(x)) / self._gap_scale
            )

    def _jacobian(self, x: Array, jacobian: Array) -> None:
        if self._layer is None and self._filled:
            return  # the operator alone, as the last time
        jacobian[:] = self._operator
        self._filled = self._layer is None
        if self._layer is not None:
            m, n = self.shape
            slope = self._layer.slope(self._pressures(x)) * (self._pressure_scale / self._gap_scale)
            nodes, size = np.arange(n), self._offset.shape[1]
            for row in range(m):
                for column in range(m):
                    jacobian[row * size + nodes, column * size + nodes] += slope[column]

    def _couple(self, coupling: Array | None) -> None:
        """Add what pressures open besides elasticity to the operator, where it is not there yet."""
        if coupling is self._coupling:
            return
        self._coupling, self._filled = coupling, False
        if coupling is None:
            self._operator = self._elastic
            return
        m, n = self.shape
        self._operator = self._elastic.copy()
        phases = self._operator.reshape(m, -1, m, self._offset.shape[1])
        phases[:, :n, :, :n] += coupling * (self._pressure_scale / self._gap_scale)

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
        n = self.shape[1]
        offset = self._offset
        offset[:, :n] = (gap + self.interface.load_gap) / self._gap_scale
        guess = np.zeros_like(offset)
        if start is None:
            guess[:, :n] = 1.0
        else:
            guess[:, :n] = start.pressure / self._pressure_scale
            guess[:, n:] = start.rigid / self._rigid_scale
        self._layer = layer
        self._couple(coupling)
        x = self._inequality.solve(guess.ravel()).reshape(offset.shape)
        pressure = np.where(x[:, :n] > ZERO, x[:, :n], 0.0) * self._pressure_scale
        residual = self._operator @ x.ravel() + offset.ravel()
        gaps = residual.reshape(offset.shape)[:, :n] * self._gap_scale
        if layer is not None:
            gaps = gaps + layer.opening(pressure)
        return ContactState(pressure, gaps, x[:, n:] * self._rigid_scale, self._inequality.snes.getIterationNumber())
