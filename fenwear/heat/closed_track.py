"""Closed tracks: heat that the strip's material carries out of the mesh warms the rest of the ring, and comes back.

Beyond the mesh it goes through a row of cells, in each of which it mixes. With the capacity C / N of one of N, its
part G / N of the mW/K by which the track loses heat to the surroundings, F the flow of heat capacity, and what is
carried out of the mesh for F T_0,

    C / N dT_c/dt = F (T_{c-1} - T_c) - G / N (T_c - theta_a),

implicitly in each step together with the temperatures of the mesh, which T_N enters. Differences over the section
return, too, as far as they have not decayed: each mode phi_j of `fenwear.heat.closed_track` by lambda_j over C / F,

    C / N dB_c/dt = F (B_{c-1} - e^(lambda_j C / (N F)) B_c),   F B_0 = integral of rho c (v . n) theta phi_j,

over the end by which the material leaves, in whose steady state e^(-lambda_j C / F) of what leaves comes back; at rest
it decays by lambda_j. These modes carry no heat in all.

Differences of temperature over the section of a closed track that remain until its material returns.

Of material that enters the mesh through its free end, v . n < 0, a slab as thick as what enters in a second conducts
heat over the section alone. The slab's modes phi_j, orthonormal in the flow of heat capacity, decay by lambda_j:

    integral of rho c |v . n| phi_i phi_j = F delta_ij,
    integral of k |v . n| grad phi_i . grad phi_j = lambda_j F delta_ij

over the end, with F the flow of all of it. Uniform temperature does not decay: it is the bulk's. All modes lie beside
it, so that they carry no heat into the mesh, and read none of uniform material that leaves at the other end, at the
same places of the section.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
import ufl
from mpi4py import MPI
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array

from fenwear.algebra.assembled import assembled, destroy
from fenwear.case import Track
from fenwear.common.arrays import Array
from fenwear.common.parallel import total
from fenwear.heat.conduction import HeatBody, HeatStep
from fenwear.heat.side import Side
from fenwear.heat.temperature import Functional, Propagation, ReducedField, TrackBasis
from fenwear.surfaces.placement import ZERO, in_space
from fenwear.surfaces.sliding_field import SlidingField

ROUNDING = 1e-9  # of the largest capacity
MOST = 100  # modes
NOTED = 1e-2  # of the contact's rise
LASTS = 5.0  # e-folds of a mode until it comes back, beyond which it is gone


@dataclass(frozen=True)
class Section:
    """Modes over the section of a track, for a unit speed.

    Attributes:
        entering: Loads of material that enters with a mode's temperature (owned, m), mW/(mm K).
        leaving: Flow of a mode out of the mesh for each kelvin (owned, m), mW/(mm K).
        rates: lambda (m,), 1/s.
    """

    entering: Array
    leaving: Array
    rates: Array

    def of_note(self, leaving: Array, rise: Array, until_back: float) -> Section:
        """Return the modes that steady temperatures of the mesh bring back to more than a share of their rise.

        Args:
            leaving: Outflow of each mode over the flow of capacity (m, k), K, in k cases.
            rise: Of the contact in each of them (k,), K.
            until_back: Time of the material away from the mesh, s.
        """
        returns = np.abs(leaving) / np.expm1(self.rates * until_back)[:, None]
        kept = (returns > NOTED * rise).any(axis=1)
        return Section(self.entering[:, kept], self.leaving[:, kept], self.rates[kept])


def section_modes(body: HeatBody, sliding: SlidingField, way: float, until_back: float) -> Section:
    """Return the modes that last until the material comes back, the bulk's left out; collective.

    Args:
        body: The strip.
        sliding: Motion of its material for a unit speed.
        way: 1 or -1: of the speed.
        until_back: Time of the material away from the mesh at the largest speed, s.
    """
    flow = body.flow(sliding)
    domain, law = body.body.mesh, body.law
    n, u, w = ufl.FacetNormal(domain), ufl.TrialFunction(body.space), ufl.TestFunction(body.space)
    into, out = flow.entering(way * flow.velocity), flow.entering(-way * flow.velocity)

    def along(theta: object) -> object:
        return ufl.grad(theta) - n * ufl.dot(n, ufl.grad(theta))

    conductivity = law.diffusivity * law.capacity
    ends = [_Face(body, sliding, integrand) for integrand in (law.capacity * into * u * w, law.capacity * out * u * w)]
    conducting = _Face(body, sliding, conductivity * into * ufl.inner(along(u), along(w)), like=ends[0])
    capacity, conduction = ends[0].matrix.toarray(), conducting.matrix.toarray()
    sizes, vectors = scipy.linalg.eigh((capacity + capacity.T) / 2)
    kept = sizes > ROUNDING * sizes.max(initial=0.0)
    even = vectors[:, kept] / np.sqrt(sizes[kept])
    even = even @ scipy.linalg.null_space(capacity.sum(axis=0)[None] @ even)  # the bulk's heat is no mode's
    rates, modes = scipy.linalg.eigh(even.T @ (conduction + conduction.T) @ even / 2)
    lasting = slice(min(MOST, int((rates * until_back < LASTS).sum())))
    modes = even @ modes[:, lasting] * np.sqrt(capacity.sum())
    modes = modes * np.sign(modes[np.abs(modes).argmax(axis=0), np.arange(modes.shape[1])])
    leaving = _carried_over(ends[0].places, modes, ends[1].places)
    flows = ends[1].matrix.sum(axis=0)
    leaving = leaving - flows @ leaving / flows.sum()
    return Section(ends[0].loads(modes), ends[1].loads(leaving), rates[lasting])


class _Face:
    """An end of the mesh with a form on it, gathered on every rank; collective.

    Attributes:
        dofs: Degrees of freedom of the face, by their global numbers (k,).
        places: Where they are in the section (k, 2), mm.
        matrix: Of the form (k, k).
    """

    def __init__(self, body: HeatBody, sliding: SlidingField, integrand: object, like: _Face | None = None) -> None:
        comm, index = body.body.mesh.comm, body.space.dofmap.index_map
        matrix = assembled(body.on_free_boundary(integrand))
        begins, columns, values = matrix.getValuesCSR()
        first = index.local_range[0]
        rows = np.repeat(np.arange(body.owned), np.diff(begins))
        x = _in_section(sliding, body.space.tabulate_dof_coordinates()[: body.owned])
        largest = comm.allreduce(float(np.abs(values).max(initial=0.0)), op=MPI.MAX)
        kept = np.abs(values) > 1e-14 * largest
        parts = comm.allgather((rows[kept] + first, columns[kept], values[kept], np.arange(body.owned) + first, x))
        rows, columns, values, numbers, places = (np.concatenate(part) for part in zip(*parts, strict=True))
        destroy(matrix)
        self.dofs: NDArray[np.int64] = np.unique(rows) if like is None else like.dofs
        self.places: Array = places[np.searchsorted(numbers, self.dofs)]
        shape = (len(self.dofs), len(self.dofs))
        at = np.isin(rows, self.dofs) & np.isin(columns, self.dofs)
        ij = np.searchsorted(self.dofs, rows[at]), np.searchsorted(self.dofs, columns[at])
        self.matrix: csr_array = csr_array(coo_array((values[at], ij), shape=shape))
        self._own = (self.dofs >= first) & (self.dofs < first + body.owned)
        self._rows, self._owned = self.dofs[self._own] - first, body.owned

    def loads(self, fields: Array) -> Array:
        """Return the matrix times fields (k, m) at this rank's own nodes (owned, m)."""
        loads: Array = np.zeros((self._owned, fields.shape[1]))
        loads[self._rows] = (self.matrix @ fields)[self._own]
        return loads


def _in_section(sliding: SlidingField, x: Array) -> Array:
    """Return the coordinates of places (k, 3) beside the motion (k, 2): along its axis and from it, or square to it."""
    points = in_space(x)
    if sliding.turn != ZERO:
        axis = np.array(sliding.turn)
        away = points - np.array(sliding.centre)
        along = away @ axis
        return np.column_stack([np.linalg.norm(away - along[:, None] * axis, axis=1), along])
    beside = np.linalg.svd(np.array(sliding.shift)[None])[2][1:]
    return np.asarray(points @ beside.T)


def _carried_over(places: Array, modes: Array, to: Array) -> Array:
    """Return modes (k, m) that are known at places (k, 2) of the section at others (l, 2)."""
    from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator  # which takes long to load

    if not modes.shape[1]:
        return np.zeros((len(to), 0))
    wide = np.ptp(places, axis=0)
    spread = wide > 1e-9 * wide.max()
    if spread.sum() == 1:
        x, at = places[:, spread][:, 0], to[:, spread][:, 0]
        order = x.argsort()
        return np.column_stack([np.interp(at, x[order], mode[order]) for mode in modes.T])
    carried = np.asarray(LinearNDInterpolator(places / wide, modes)(to / wide))
    beyond = np.isnan(carried).any(axis=1)
    carried[beyond] = NearestNDInterpolator(places / wide, modes)(to[beyond] / wide)
    return carried


CELLS = 8  # of a track
GONE = 40.0  # e-folds after which nothing comes back


@dataclass(frozen=True)
class _Coupling:
    """Exchange of a track's cells with the mesh in a step, each with m modes over the section, and its bulk.

    Attributes:
        enters: Coordinates at the end for each kelvin that the material of the last cell enters warmer (dim, m + 1).
        leaves: Flow into the first cell for each coordinate (m + 1, dim), mW/mm.
        constant: The same without any, and what the cells lose at the reference, as a gain (cells (m + 1),), mW/mm.
        stays: Capacity of a cell over the duration of the step, mW/(mm K).
        takes: Inverse of the heat that a kelvin takes (cells (m + 1), cells (m + 1)), mm K/mW.
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
        kelvins: Share of the last inflows of a kelvin at unit speed (m + 1,).
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
        responses = []
        for step, velocity, answers in zip(steps, speeds, inner.responses, strict=True):
            speed, stays, mesh_answers = abs(velocity), self.capacity / CELLS / duration, answers[:, : -self._inlets]
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
            warms = self._couplings[-1].takes[:, : self._inlets] @ (leaves @ mesh_answers)
            responses.append(np.vstack([mesh_answers + enters @ warms[-self._inlets :], warms]))
        self.responses = responses

    def advance(self, step: int, coordinates: Array, *, sources: bool = True) -> Array:
        """Apply the step to the mesh and to what comes back."""
        coupling, mesh = self._couplings[step], len(coordinates) - CELLS * self._inlets
        free = self.inner.advance(step, coordinates[:mesh], sources=sources)
        gained = coupling.stays * coordinates[mesh:]
        gained[: self._inlets] += coupling.leaves @ free
        track = coupling.takes @ (gained + coupling.constant if sources else gained)
        return np.concatenate([free + coupling.enters @ track[-self._inlets :], track])

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
    """Return the heat flow into a cell (m,), mW/(mm K), by a kelvin of each mode, where F flows; all decays at rest."""
    if flow == 0:
        return capacity * rates
    return np.asarray(flow * np.exp(np.minimum(rates * capacity / flow, GONE)))


def _with_track(functional: Functional, count: int) -> Functional:
    rows = np.asarray(functional.rows)
    return replace(functional, rows=np.hstack([rows, np.zeros((len(rows), count))]))
