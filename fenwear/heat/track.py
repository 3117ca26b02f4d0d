"""A closed track: what the strip's material carries out of the mesh warms the rest of the disc or ring, and comes back.

Beyond the mesh it goes through a row of cells, in each of which it mixes. With the capacity C / N of one of N, its
part G / N of the mW/K by which the track loses heat to the surroundings, F the flow of heat capacity, and what is
carried out of the mesh for F T_0,

    C / N dT_c/dt = F (T_{c-1} - T_c) - G / N (T_c - theta_a),

implicitly in each step together with the temperatures of the mesh, which T_N enters. What differs over the section
comes back, too, less what has decayed until then: each mode phi_j of `fenwear.heat.section` by lambda_j over C / F,

    C / N dB_c/dt = F (B_{c-1} - e^(lambda_j C / (N F)) B_c),   F B_0 = integral of rho c (v . n) theta phi_j,

over the end by which the material leaves, in whose steady state e^(-lambda_j C / F) of what leaves comes back; at rest
it decays by lambda_j. These modes carry no heat in all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from scipy.sparse import csr_array

from fenwear.arrays import Array
from fenwear.case import Track
from fenwear.heat.conduction import HeatStep
from fenwear.heat.field import Functional, Propagation, ReducedField, TrackBasis
from fenwear.heat.section import Section
from fenwear.heat.side import Side
from fenwear.parallel import total

CELLS = 8  # of a track
GONE = 40.0  # e-folds after which nothing comes back


@dataclass(frozen=True)
class _Coupling:
    """How the cells of a track meet the mesh in a step, each of them m modes over the section, and its bulk.

    Attributes:
        enters: Coordinates at the end for each kelvin that the material of the last cell enters warmer (dim, m + 1).
        leaves: What is carried out a second into the first cell for each coordinate (m + 1, dim), mW/mm.
        constant: The same without any, and what the cells lose at the reference, as a gain (cells (m + 1),), mW/mm.
        stays: Capacity of a cell over the duration of the step, mW/(mm K).
        takes: What a kelvin takes in all, inverted (cells (m + 1), cells (m + 1)), mm K/mW.
    """

    enters: Array
    leaves: Array
    constant: Array
    stays: float
    takes: Array


class TrackField:
    """The reduced temperature of the strip with what comes back on its track as the last coordinates.

    Args:
        inner: Of the strip, whose last inflows are what enters at a kelvin of each mode and of the bulk, scaled.
        steps: Of the strip.
        speeds: Of its material in each of them.
        kelvins: What of the last inflows a kelvin is at unit speed (m + 1,).
        duration: Of a step, s.
        track: The bulk.
        section: The modes over its section.
        thickness: Of a plane model, mm.
    """

    contact_responses: Sequence[Array] | None = None

    def __init__(
        self,
        inner: ReducedField,
        steps: Sequence[HeatStep],
        speeds: Sequence[float],
        kelvins: Array,
        duration: float,
        track: Track,
        section: Section,
        thickness: float,
    ) -> None:
        self.inner, body = inner, steps[0].body
        reference, modes = body.heat.initial, len(section.rates)
        self._inlets = modes + 1
        comm, lift, columns = body.body.mesh.comm, inner.basis.lift, inner.basis.columns
        self.basis = TrackBasis(body, lift, columns, reference, modes, CELLS)
        self.capacity, self.loss = (value / thickness for value in body.bulk(track))
        read = total(comm, section.leaving.T @ np.column_stack([columns, lift - reference]))
        lost = np.tile(np.append(np.zeros(modes), self.loss / CELLS * (reference - body.heat.ambient)), CELLS)
        self._couplings: list[_Coupling] = []
        self._kept: list[Array] = []  # of what enters, where temperatures are held: it warms nothing (m + 1,), in steps
        self.responses: Sequence[Array] = []
        found = []
        for step, velocity, answers in zip(steps, speeds, inner.responses, strict=True):
            speed, stays, own = abs(velocity), self.capacity / CELLS / duration, answers[:, : -self._inlets]
            carried = total(comm, np.append(step.carried @ columns, step.carried @ lift))
            flow = float(total(comm, np.array(step.entering.sum())))
            held = step.is_held
            kept = np.append(speed * section.entering[held].sum(axis=0), step.entering[held].sum())
            self._kept.append(total(comm, kept))
            leaves = np.vstack([speed * read[:, :-1], carried[:-1]])
            constant = -lost
            constant[: self._inlets] += np.append(speed * read[:, -1], carried[-1] - flow * reference)
            enters = speed * kelvins * answers[:, -self._inlets :]
            each = np.append(_decaying(section.rates, self.capacity / CELLS, flow), flow + self.loss / CELLS)
            takes = np.diag(np.tile(stays + each, CELLS)) - flow * np.eye(len(constant), k=-self._inlets)
            takes[: self._inlets, -self._inlets :] -= leaves @ enters
            self._couplings.append(_Coupling(enters, leaves, constant, stays, np.asarray(scipy.linalg.inv(takes))))
            warms = self._couplings[-1].takes[:, : self._inlets] @ (leaves @ own)
            found.append(np.vstack([own + enters @ warms[-self._inlets :], warms]))
        self.responses = found

    def advance(self, step: int, coordinates: Array, *, sources: bool = True) -> Array:
        """Apply the step to the mesh and to what comes back."""
        one, mesh = self._couplings[step], len(coordinates) - CELLS * self._inlets
        free = self.inner.advance(step, coordinates[:mesh], sources=sources)
        gained = one.stays * coordinates[mesh:]
        gained[: self._inlets] += one.leaves @ free
        track = one.takes @ (gained + one.constant if sources else gained)
        return np.concatenate([free + one.enters @ track[-self._inlets :], track])

    def propagation(self, step: int) -> Propagation:
        """Return the step as one matrix."""
        every, none = np.eye(len(self.basis)), np.zeros(len(self.basis))
        return Propagation(self.advance(step, every, sources=False), self.advance(step, none), self.responses[step])

    def observe(self, rows: Array | csr_array) -> Functional:
        """Return the functional of the mesh's temperatures; collective."""
        return _with_track(self.inner.observe(rows), CELLS * self._inlets)

    def balanced(self, side: Side) -> Side:
        """Return the strip's side with the bulk in its balance: nothing is carried out any more."""
        rows, constant = side.balance.rows.copy(), side.balance.constant.copy()
        reference = self.basis.reference
        for row, value in ((0, self.capacity), (1, self.loss)):
            rows[row, len(self.inner.basis) :].reshape(CELLS, -1)[:, -1] += value / CELLS
            constant[row] += value * reference
        for step, kept in enumerate(self._kept):
            rows[2 + 3 * step, -self._inlets :] -= kept
        rows[4::3], constant[4::3] = 0.0, 0.0
        return replace(
            side,
            balance=replace(side.balance, rows=rows, constant=constant),
            brought=[0.0] * len(side.brought),
            ambient_loss=side.ambient_loss + self.loss * self.inner.basis.body.heat.ambient,
            capacity=side.capacity + self.capacity,
            bounded=True,
            cooled=self.loss > 0 or self.inner.basis.body.loses_heat(),
        )


def _decaying(rates: Array, capacity: float, flow: float) -> Array:
    """Return what a kelvin of each mode takes in a cell (m,), mW/(mm K), through which F flows; at rest all decays."""
    if flow == 0:
        return capacity * rates
    return np.asarray(flow * np.exp(np.minimum(rates * capacity / flow, GONE)))


def _with_track(functional: Functional, count: int) -> Functional:
    rows = np.asarray(functional.rows)
    return replace(functional, rows=np.hstack([rows, np.zeros((len(rows), count))]))
