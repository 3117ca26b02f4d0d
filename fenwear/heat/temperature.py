"""The temperature of one body as coordinates that steps advance: of all nodes, or of a reduced basis.

Both answer the same questions: the coordinates at the end of a step without flux through the contact,
its response to the fluxes there, and any linear functional of the temperature. All these are affine,
s' = P s + b; without their sources, b = 0, they are what becomes of changes.

The temperature of a body at rest on its modes.

Of material at rest capacity M and conductivity K are symmetric, so that on a small basis both are diagonal at once:
theta_k' = -lambda_k theta_k + b_k, and steps of any length need a factor for each mode.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import Protocol

import numpy as np
import scipy.linalg
from dolfinx import fem
from mpi4py import MPI
from scipy.sparse import csc_array, csr_array

from fenwear.common.arrays import Array
from fenwear.common.parallel import Team, total
from fenwear.heat.conduction import HeatBody, HeatStep

CHUNK = 256  # right-hand sides at once


@dataclass(frozen=True, eq=False)
class Basis:
    """Meaning of the coordinates of a body's temperature: by themselves, the temperatures of this rank's own nodes.

    Attributes:
        body: The body.
    """

    body: HeatBody

    def __len__(self) -> int:
        """Return the number of coordinates on this rank."""
        return self.body.owned

    def temperature(self, coordinates: Array) -> Array:
        """Return the temperature of this rank's own nodes (owned,), K."""
        return coordinates

    def coordinates(self, temperature: Array) -> Array:
        """Return the coordinates of a temperature (owned,), or of the nearest there is; collective."""
        return temperature

    def translated(self, other: Basis, coordinates: Array) -> Array:
        """Return the coordinates here from coordinates on another basis; collective, or for rank 0 that leads."""
        return Team.of(self.body.body.mesh.comm).each(self, "from_other", other, coordinates)  # type: ignore[no-any-return]

    def from_other(self, other: Basis, coordinates: Array) -> Array:
        """Return the coordinates of a state on another basis; collective."""
        return self.coordinates(other.temperature(coordinates))


@dataclass(frozen=True, eq=False)
class ReducedBasis(Basis):
    """A small basis, theta = lift + V s, with the same coordinates s on every rank.

    Attributes:
        lift: A temperature with the held values (owned,).
        columns: V (owned, dim), orthonormal in the heat capacity, zero where temperatures are held.
    """

    lift: Array
    columns: Array

    def __len__(self) -> int:
        """Return dim."""
        return self.columns.shape[1]

    def temperature(self, coordinates: Array) -> Array:
        """Return lift + V s."""
        return self.lift + self.columns @ coordinates

    def coordinates(self, temperature: Array) -> Array:
        """Return the projection in the norm of the heat capacity; collective."""
        return total(self.body.body.mesh.comm, self.columns.T @ self.body.store(temperature - self.lift))


@dataclass(frozen=True, eq=False)
class TrackBasis(ReducedBasis):
    """A reduced basis with what is on its way back on a closed track as its last coordinates.

    Of each cell of the track, from where the mesh is left on, they are the modes over its section and the temperature
    of its bulk, less the reference.

    Attributes:
        reference: K.
        modes: Number over a section.
        cells: Of the track.
    """

    reference: float
    modes: int
    cells: int

    def __len__(self) -> int:
        """Return dim + cells (modes + 1)."""
        return self.columns.shape[1] + self.cells * (self.modes + 1)

    def temperature(self, coordinates: Array) -> Array:
        """Return the temperature of the mesh."""
        return self.lift + self.columns @ coordinates[: self.columns.shape[1]]

    def coordinates(self, temperature: Array) -> Array:
        """Return the projection, with all of the track at the reference."""
        return np.append(super().coordinates(temperature), np.zeros(self.cells * (self.modes + 1)))

    def track(self, coordinates: Array) -> Array:
        """Return modes and temperature of each cell (cells, modes + 1), K, of coordinates that end with them."""
        track = coordinates[-self.cells * (self.modes + 1) :].reshape(self.cells, -1).copy()
        track[:, -1] += self.reference
        return track

    def on_track(self, coordinates: Array, track: Array) -> Array:
        """Return coordinates with the heat on its way back: of a track with other modes its temperatures alone."""
        of_track: Array = np.zeros((self.cells, self.modes + 1))
        if track.shape == of_track.shape:
            of_track[:] = track
        else:
            of_track[:, -1] = track[:, -1].mean()
        of_track[:, -1] -= self.reference
        return np.append(coordinates[: self.columns.shape[1]], of_track)


@dataclass(frozen=True, eq=False)
class HeatState:
    """The temperatures of both bodies, with what gives them meaning.

    Attributes:
        bases: Of the punch and of the strip; none of bodies that stay at their initial temperature.
        values: Coordinates on the punch's and then on the strip's basis.
        returning: Temperatures that return on a closed track, see `closed_track`, where no basis has them; None
            at the start.
        surfaces: Temperatures of both contact surfaces at the interface nodes (n,), K, at the end of a step: a basis
            may leave out what fades within one. None where the coordinates say all.
    """

    bases: tuple[Basis, ...]
    values: Array
    returning: Array | None = None
    surfaces: tuple[Array, Array] | None = None

    @classmethod
    def nodal(
        cls, bodies: tuple[HeatBody, ...], temperatures: Sequence[Array], track: Array | None = None
    ) -> HeatState:
        """Return the state of these temperatures of this rank's own nodes of both bodies, and of a closed track."""
        return cls((Basis(bodies[0]), Basis(bodies[1])), np.concatenate(list(temperatures)), track)

    @property
    def bulk(self) -> float:
        """Temperature of the bulk of the strip's closed track, K; NaN where there is none, or for the initial one."""
        return np.nan if self.track is None else float(self.track[:, -1].mean())

    @property
    def track(self) -> Array | None:
        """Temperatures that return on the strip's closed track, see `TrackBasis.track`."""
        basis = self.bases[1]
        return basis.track(self.values) if isinstance(basis, TrackBasis) else self.returning

    def temperatures(self) -> tuple[Array, Array]:
        """Return the temperatures of this rank's own nodes of punch and strip (owned,), K."""
        punch, strip = np.split(self.values, [len(self.bases[0])])
        return self.bases[0].temperature(punch), self.bases[1].temperature(strip)

    def functions(self) -> tuple[fem.Function, fem.Function]:
        """Return the temperatures as functions on the meshes; collective."""
        punch, strip = (basis.body.function(t) for basis, t in zip(self.bases, self.temperatures(), strict=True))
        return punch, strip

    def on(self, bases: tuple[Basis, ...]) -> HeatState:
        """Return the temperatures on other bases, or the nearest there are; collective, or while one leads."""
        if all(basis is other for basis, other in zip(self.bases, bases, strict=True)):
            return self
        coordinates = np.split(self.values, [len(self.bases[0])])
        parts = [to.translated(old, part) for to, old, part in zip(bases, self.bases, coordinates, strict=True)]
        track = self.track
        if isinstance(bases[1], TrackBasis) and track is not None:
            parts[1] = bases[1].on_track(parts[1], track)
        return HeatState(bases, np.concatenate(parts), track)


@dataclass(frozen=True)
class Functional:
    """An affine functional of coordinates, equal on every rank: collective to call where `comm` is one.

    Attributes:
        rows: Of the coordinates on this rank (j, dim).
        constant: Value at coordinates of zero (j,).
        comm: The ranks that the coordinates are spread over; None where each has all of them.
    """

    rows: Array | csr_array
    constant: Array
    comm: MPI.Comm | None = None

    def __call__(self, coordinates: Array) -> Array:
        """Return the value at coordinates (dim,)."""
        return self.of_changes(coordinates) + self.constant

    def of_changes(self, changes: Array) -> Array:
        """Return the changes of the value by changes of the coordinates (dim,) or (dim, k)."""
        product: Array = self.rows @ changes
        return product if self.comm is None else total(self.comm, product)

    def less(self, value: Array) -> Functional:
        """Return the functional less a constant value (j,)."""
        return replace(self, constant=self.constant - value)

    def through(self, matrix: csr_array) -> Functional:
        """Return the functional whose values are multiplied by a matrix (k, j)."""
        return replace(self, rows=matrix @ self.rows, constant=matrix @ self.constant)

    def times(self, factor: float) -> Functional:
        """Return the functional times a number."""
        return self if factor == 1 else replace(self, rows=self.rows * factor, constant=self.constant * factor)


@dataclass(frozen=True)
class Propagation:
    """A step of coordinates that every rank has: s' = D s + b + R (q + h_b (theta_c - theta_a)).

    Attributes:
        decay: D, or its diagonal (dim,).
        source: b (dim,).
        response: R, from fluxes at the interface nodes (dim, n).
        given_back: h_b, what is given back there for each kelvin above the surroundings, mW/(mm² K).
    """

    decay: Array
    source: Array
    response: Array
    given_back: float = 0.0

    def free(self, coordinates: Array, *, sources: bool = True) -> Array:
        """Return D s + b, or D s for changes (dim,) or (dim, k)."""
        moved: Array = self.decay @ coordinates if self.decay.ndim == 2 else (self.decay * coordinates.T).T
        return moved + self.source if sources else moved


class Field(Protocol):
    """A body's temperature, with the steps that advance it numbered as they were given."""

    @property
    def basis(self) -> Basis:
        """Meaning of the coordinates."""

    @property
    def responses(self) -> Sequence[Array]:
        """Coordinates from unit fluxes at the interface nodes in each step, each (dim, n)."""

    @property
    def contact_responses(self) -> Sequence[Array] | None:
        """Contact temperature at these nodes from the same (n, n) where coordinates do not say it all, else None."""

    def advance(self, step: int, coordinates: Array, *, sources: bool = True) -> Array:
        """Return the coordinates after a step without flux through the contact.

        Args:
            step: Number of the step.
            coordinates: (dim,), or without sources (dim,) or (dim, k).
            sources: False for what it makes of changes.
        """

    def propagation(self, step: int) -> Propagation | None:
        """Return a step of coordinates that every rank has; None of those that are spread over the ranks."""

    def observe(self, rows: Array | csr_array) -> Functional:
        """Return the functional rows . theta; collective.

        Args:
            rows: (j, owned), over the full field's owned degrees of freedom; dense or sparse.
        """


class FullField:
    """The temperature of all nodes, distributed over the ranks; all calls are collective."""

    contact_responses: Sequence[Array] | None = None

    def __init__(self, body: HeatBody, steps: Sequence[HeatStep], inflow: csc_array) -> None:
        """Keep the responses to the fluxes.

        Args:
            body: The body.
            steps: Factored steps of the body.
            inflow: Loads of unit fluxes at the interface nodes (owned, n), mm.
        """
        self.steps, self.basis = list(steps), Basis(body)
        self.responses: Sequence[Array] = [step.respond(inflow.toarray()) for step in self.steps]

    def advance(self, step: int, coordinates: Array, *, sources: bool = True) -> Array:
        """Solve one step."""
        return self.steps[step].advance(coordinates, sources=sources)

    def propagation(self, step: int) -> None:
        """Return none: the coordinates are spread over the ranks."""

    def observe(self, rows: Array | csr_array) -> Functional:
        """Return the functional, summed over the ranks."""
        return Functional(rows, np.zeros(rows.shape[0]), self.basis.body.body.mesh.comm)


class ReducedField:
    """Projection theta = lift + V s onto a basis V, the same coordinates s on every rank.

    Galerkin's where the material rests, or comes back. Where it moves on the operator is far from symmetric and
    Galerkin's projection far from the best: there s has the least residual of A theta = rhs, each row over its heat
    capacity (least-squares Petrov-Galerkin, Carlberg et al., J. Comput. Phys. 330, 2017), among those with which the
    sum of all rows, the balance of heat, is exact.

    V may leave out what is gone by the end of the next step: fields of short wave length in a layer below the
    contact. Within a step the contact meets them all the same: its response to the fluxes is then that of the full
    steps, which in structural dynamics is called a static correction.

    Attributes:
        contact_responses: That response (n, n), of each step; None where V has all of it.
    """

    def __init__(
        self,
        steps: Sequence[HeatStep],
        inflow: csc_array,
        basis: ReducedBasis,
        contact_responses: Sequence[Array] | None = None,
        *,
        one_way: bool = False,
        modal: bool = False,
    ) -> None:
        """Project the steps; collective.

        Args:
            steps: Of the body.
            inflow: Loads of unit fluxes at the interface nodes (owned, n), mm.
            basis: V with its lift.
            contact_responses: Of the full steps, for a basis of what later steps feel alone.
            one_way: Whether the material moves through the mesh in one direction.
            modal: Whether V is of `modal_basis`, on which each step of a body at rest is a factor for each mode.
        """
        self._one_way = one_way
        self.basis, self.contact_responses = basis, contact_responses
        self._propagators: list[Array] = []
        self._sources: list[Array] = []
        self.responses: list[Array] = []
        for step in steps:
            propagator, source, response = self._projected(step, inflow)
            self._propagators.append(propagator)
            self._sources.append(source)
            self.responses.append(response)
        self._decays = [np.diag(propagator).copy() for propagator in self._propagators] if modal else self._propagators

    def _projected(self, step: HeatStep, inflow: csc_array) -> tuple[Array, Array, Array]:
        """Return the maps of a step from coordinates, from sources alone, and from unit fluxes; collective."""
        lift, columns = self.basis.lift, self.basis.columns
        dim, n = len(self.basis), inflow.shape[1]
        a_lift, b_lift = step.apply(lift[:, None])
        ahead: Array = np.empty_like(columns)
        rights: Array = np.zeros((dim, dim + 1 + n))  # of the coordinates, the sources and the fluxes
        sums: Array = np.zeros(dim + 1 + n)
        test, free = columns, ~step.is_held
        for begin in range(0, dim, CHUNK):
            ahead[:, begin : begin + CHUNK] = step.apply(columns[:, begin : begin + CHUNK])[0]
        if self._one_way:
            test = ahead / self.basis.body.capacities[:, None]
        for begin in range(0, dim, CHUNK):
            some = slice(begin, min(begin + CHUNK, dim))
            before = step.apply(columns[:, some])[1]
            rights[:, some], sums[some] = test.T @ before, free @ before
        alone = step.source + (b_lift - a_lift)[:, 0]
        rights[:, dim], sums[dim] = test.T @ alone, free @ alone
        rights[:, dim + 1 :], sums[dim + 1 :] = (inflow.T @ test).T, inflow.T @ free.astype(float)
        rights, sums, matrix = self._sum(rights), self._sum(sums), self._sum(test.T @ ahead)
        solution: Array = scipy.linalg.solve(matrix, rights)
        if self._one_way:
            row = self._sum(free @ ahead)
            way = scipy.linalg.solve(matrix, row)
            solution += np.outer(way / (row @ way), sums - row @ solution)
        return solution[:, :dim], solution[:, dim], solution[:, dim + 1 :]

    def spectral_radius(self, cycle: Sequence[int]) -> float:
        """Return the factor by which some temperature changes in every cycle of these steps, the largest in size."""
        product = reduce(lambda through, step: self._propagators[step] @ through, cycle, np.eye(len(self.basis)))
        return float(np.abs(np.linalg.eigvals(product)).max(initial=0.0))

    def _sum(self, partial: Array) -> Array:
        return total(self.basis.body.body.mesh.comm, partial)

    def advance(self, step: int, coordinates: Array, *, sources: bool = True) -> Array:
        """Apply the step."""
        return self.propagation(step).free(coordinates, sources=sources)

    def propagation(self, step: int) -> Propagation:
        """Return the step: dense, or one that lets each mode decay."""
        return Propagation(self._decays[step], self._sources[step], self.responses[step])

    def observe(self, rows: Array | csr_array) -> Functional:
        """Return the projected functional; collective to make, not to call."""
        return Functional(self._sum(rows @ self.basis.columns), self._sum(rows @ self.basis.lift))


def modal_basis(basis: ReducedBasis, step: HeatStep, duration: float) -> tuple[ReducedBasis, Array]:
    """Return the basis on which a step of material at rest is diagonal, and the rates lambda (dim,), 1/s; collective.

    Args:
        basis: Orthonormal in the heat capacity.
        step: A step of the body, not moving.
        duration: Duration of the step, s.
    """
    projected = total(basis.body.body.mesh.comm, basis.columns.T @ step.apply(basis.columns)[0])
    values, vectors = np.linalg.eigh((projected + projected.T) / 2)
    modes = ReducedBasis(basis.body, basis.lift, np.asarray(basis.columns @ vectors))
    return modes, np.maximum(values - 1 / duration, 0.0)
