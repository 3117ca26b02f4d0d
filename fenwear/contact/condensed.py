"""Contact as a variational inequality: Signorini's conditions with friction of known direction.

For every phase of the motion (a sliding direction d) and every contact node:

    gap = S(tau) p + H a + g >= 0,    p >= 0,    p gap = 0,
    sum of w_i p_i (e_n + tau)_i . m_i + F = 0   for the rigid modes a and their motions m,

tau the traction of friction over the pressure, g the gap of the unloaded bodies with their
loads' effect and the worn depth. A `Layer` adds to the gaps of all phases what their own pressures
open, such as the wear of the step they belong to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
import scipy.linalg

from fenwear.arrays import Array
from fenwear.contact.inequality import Bordered, BorderedInequality, DenseInequality
from fenwear.errors import ConvergenceError
from fenwear.interface import Interface
from fenwear.remedies import FULL_START, FULL_START_SEARCH, LINE_SEARCH, Remedies

DENSE = 400  # unknowns up to which one dense elimination beats one for each phase
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
        self._blocks = np.zeros((m, size, size))
        self._elastic: Array | None = None
        self._offset = np.zeros((m, size))
        self._loads = np.array([phase.interface.load_gap for phase in self.phases])
        for phase, block, offset in zip(self.phases, self._blocks, self._offset, strict=True):
            offset[n:] = phase.interface.rigid.resultant / self._resultant_scale
            block[:n, n:] = phase.interface.rigid.rigid_normal * (self._rigid_scale / self._gap_scale)
        self._ratios = [phase.friction_ratio for phase in self.phases]
        for k, ratio in enumerate(self._ratios):
            self._fill_friction(k, ratio)
        self._coupling: Array | None = None
        self._layer: Layer | None = None
        self._filled = False
        lower = np.tile(np.concatenate([np.zeros(n), np.full(r, -np.inf)]), m)
        self._bounds = (lower, np.full(m * size, np.inf))

    def _fill_friction(self, k: int, ratio: Array) -> None:
        n, interface = self.shape[1], self.phases[k].interface
        balance = interface.rigid.equilibrium(ratio)
        self._blocks[k, :n, :n] = interface.compliance(ratio) * (self._pressure_scale / self._gap_scale)
        self._blocks[k, n:, :n] = balance * (self._pressure_scale / self._resultant_scale[:, None])

    def slide(self, ratios: Sequence[Array]) -> None:
        """Set tau of each phase, (n,) each."""
        for k, (ratio, before) in enumerate(zip(ratios, self._ratios, strict=True)):
            if ratio is not before and not np.array_equal(ratio, before):
                self._fill_friction(k, ratio)
                self._elastic, self._filled = None, False
        self._ratios = list(ratios)

    @cached_property
    def _dense(self) -> DenseInequality:
        return DenseInequality(*self._bounds, self._residual, self._dense_jacobian, PREFIX, NAME)

    @cached_property
    def _bordered(self) -> BorderedInequality:
        m, n = self.shape
        matrix = Bordered(self._blocks, np.zeros((m, n, 0)), np.zeros((m, 0, n)))
        return BorderedInequality(*self._bounds, self._residual, self._bordered_jacobian, matrix, PREFIX, NAME)

    def _pressures(self, x: Array) -> Array:
        return x.reshape(self._offset.shape)[:, : self.shape[1]] * self._pressure_scale

    def _residual(self, x: Array, f: Array) -> None:
        n, parts = self.shape[1], f.reshape(self._offset.shape)
        np.matmul(self._blocks, x.reshape(self._offset.shape)[:, :, None], out=parts[:, :, None])
        parts += self._offset
        if self._coupling is not None:
            parts[:, :n] += np.tensordot(self._coupling, self._pressures(x), axes=2) / self._gap_scale
        if self._layer is not None:
            parts[:, :n] += self._layer.opening(self._pressures(x)) / self._gap_scale

    def _dense_jacobian(self, x: Array, jacobian: Array) -> None:
        if self._layer is None and self._filled:
            return  # the operator alone, as the last time
        jacobian[:] = self._operator()
        self._filled = self._layer is None
        if self._layer is not None:
            m, n = self.shape
            left, right = self._layer.border(self._pressures(x))
            scale, size = self._pressure_scale / self._gap_scale, self._offset.shape[1]
            for k in range(m):
                for j in range(m):
                    jacobian[k * size : k * size + n, j * size : j * size + n] += (left[k] @ right[j]) * scale

    def _operator(self) -> Array:
        """Return the derivative of the residual without the layer (m size, m size)."""
        (m, n), size = self.shape, self._offset.shape[1]
        if self._elastic is None:
            self._elastic = scipy.linalg.block_diag(*self._blocks)
        if self._coupling is None:
            return self._elastic
        operator = self._elastic.copy()
        operator.reshape(m, size, m, size)[:, :n, :, :n] += self._coupling * (self._pressure_scale / self._gap_scale)
        return operator

    def _bordered_jacobian(self, x: Array, matrix: Bordered) -> None:
        if self._layer is not None:
            left, right = self._layer.border(self._pressures(x))
            matrix.left, matrix.right = left, right * (self._pressure_scale / self._gap_scale)

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
        offset[:, :n] = (gap + self._loads) / self._gap_scale
        if coupling is not self._coupling:
            self._coupling, self._filled = coupling, False
        self._layer = layer
        alone = coupling is None and layer is not None and offset.size > DENSE
        inequality = self._bordered if alone else self._dense
        x = self._solve(inequality, start).reshape(offset.shape)
        pressure = np.where(x[:, :n] > ZERO, x[:, :n], 0.0) * self._pressure_scale
        residual = np.empty_like(offset)
        self._residual(x.ravel(), residual.ravel())
        return ContactState(
            pressure,
            residual[:, :n] * self._gap_scale,
            x[:, n:] * self._rigid_scale,
            inequality.iterations,
        )

    def _solve(self, inequality: DenseInequality | BorderedInequality, start: ContactState | None) -> Array:
        """Return the solution by the first way that finds it."""
        n = self.shape[1]
        full = np.zeros_like(self._offset)
        full[:, :n] = 1.0
        ways = [(full, False, FULL_START), (full, True, FULL_START_SEARCH)]
        if start is not None:
            near = np.concatenate([start.pressure / self._pressure_scale, start.rigid / self._rigid_scale], axis=1)
            ways = [(near, False, ""), (near, True, LINE_SEARCH), *ways]
        failure: ConvergenceError | None = None
        for guess, line_search, name in ways:
            try:
                x = inequality.solve(guess.ravel(), line_search=line_search)
            except ConvergenceError as error:
                failure = failure or error  # the usual way's says most
                continue
            if failure is not None:
                self._remedies.note(name)
            return x
        raise failure or ConvergenceError(inequality.name)
