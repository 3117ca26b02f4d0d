"""Static condensation of a body onto its contact surface.

All a half-cycle needs of a body is how its contact surface answers to what acts on it. A pattern of
forces B_l, of the trace nodes, acts along a direction e_l; K u = f + B_l e_l gives the response
U_kl = B_k^T u, all components of the displacement as the pattern k weighs it. As K is symmetric,
e_l . U_lk is also the displacement along e_l from a force in any direction: q solves answer for
normal and tangential forces, as long as displacements are asked for along these directions only.
Where the contact frame changes from place to place every pattern is solved for along every axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from petsc4py import PETSc
from scipy.sparse import csr_array

from fenwear.algebra.assembled import transposed_times
from fenwear.algebra.factor import LONG, WORKING, entries, make_together, operations, solve_together
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.response import Request, by_surface, respond_together
from fenwear.common import disk_cache
from fenwear.common.arrays import Array, Nodes
from fenwear.common.parallel import free_on_ranks, total

BOUNDARY_SHARE = 1.0  # of the factor's operations that joining the ranks' boundaries may take
LARGE = 2**26  # entries of a factor, half a GiB, above which it is not kept beside what prepares the heat


@dataclass(frozen=True)
class CondensedBody:
    """A body condensed onto q patterns of force on its contact surface, per thickness, the same on every rank.

    Attributes:
        patterns: Share of each trace node in a unit force (N, q).
        directions: Along which each pattern was solved for (q, d, a): one direction, or all d axes.
        response: Displacement at each pattern from a unit force of each pattern along each of its directions
            (q, d, k, a), mm per N/mm.
        by_load: Displacement at each pattern from the body's loads (q, d), mm.
        by_temperature: Displacement of each pattern along its one direction from the temperature of this
            rank's own nodes (q, owned), mm/K; None without heat. It differs between ranks.
    """

    patterns: csr_array
    directions: Array
    response: Array
    by_load: Array
    by_temperature: Array | None = None
    in_memory: ClassVar[bool] = True

    def arrays(self) -> dict[str, Array]:
        """Return the solved arrays by their names."""
        arrays = {"response": self.response, "by_load": self.by_load}
        return arrays if self.by_temperature is None else {**arrays, "by_temperature": self.by_temperature}

    def first(self, count: int) -> CondensedBody:
        """Return the body condensed onto its first patterns alone."""
        warm = None if self.by_temperature is None else self.by_temperature[:count]
        answers = self.response[:count, :, :count]
        return CondensedBody(self.patterns[:, :count], self.directions[:count], answers, self.by_load[:count], warm)

    def apply(self, forces: Array) -> Array:
        """Return the displacements (q, a, ...) of forces (q, d, ...).

        By Maxwell and Betti the displacement at a pattern is the work of a force there.
        """
        loaded = np.flatnonzero(forces.reshape(len(forces), -1).any(axis=1))
        return product(self.entries(slice(None), loaded), forces[loaded])

    def entries(self, rows: Nodes, columns: Nodes) -> Array:
        """Return the displacements at patterns from unit forces at others (rows, a, columns, d); views of slices."""
        if isinstance(rows, slice) or isinstance(columns, slice):
            return self.response[columns][:, :, rows].transpose(2, 3, 0, 1)
        return self.response[columns, :, rows[:, None]].transpose(0, 3, 1, 2)

    def diagonal(self) -> Array:
        """Return the displacements at each pattern from unit forces at itself (q, a, d)."""
        every = np.arange(len(self.response))
        return self.response[every, :, every].transpose(0, 2, 1)

    def under(self, elastic: ElasticBody) -> CondensedBody:
        """Return the condensed body under other loads, those of `elastic`; collective."""
        return replace(self, by_load=self.patterns.T @ _under_loads([elastic])[0])


def product(numbers: Array, forces: Array) -> Array:
    """Return numbers of an operator (rows, a, columns, d) times forces (columns, d, ...): (rows, a, ...)."""
    summed = np.tensordot(forces, numbers, ((0, 1), (2, 3)))
    return np.moveaxis(np.asarray(summed, dtype=np.float64), (-2, -1), (0, 1))


def condense(
    elastic: ElasticBody,
    patterns: csr_array,
    directions: Array | None = None,
    thermal_coupling: PETSc.Mat | None = None,
) -> CondensedBody:
    """Condense a body onto patterns of force; collective.

    Args:
        elastic: The body.
        patterns: Share of each trace node in a unit force (N, q).
        directions: Unit vector for each pattern (q, d); by default all axes.
        thermal_coupling: G; needs one direction for each pattern.

    Raises:
        ValueError: a thermal coupling with all axes.
    """
    return condense_together([Request(elastic, patterns, directions, thermal_coupling)])[0]


def condense_together(requests: Sequence[Request], *, keep: bool = False, fresh: bool = False) -> list[CondensedBody]:
    """Condense bodies onto patterns of force, each on ranks of its own at once; collective.

    One elimination gives the Schur complement of the surface, or one factor a solution for each pattern
    and direction. With the coupling G of thermal expansion the solutions give B^T K^-1 G, as K is symmetric.

    Args:
        requests: Of the bodies, with their patterns.
        keep: Whether the results are kept on disk, and taken from there where they are.
        fresh: Compute them whatever is kept.

    Raises:
        CaseError: the limit of what is kept is no number.
        ConvergenceError: a stiffness has no factor.
        ValueError: a thermal coupling with all axes.
    """
    if any(request.thermal_coupling is not None and request.directions is None for request in requests):
        raise ValueError("the response to temperature needs one direction for each pattern")
    comm = requests[0].elastic.body.mesh.comm
    if not keep:
        return _condensed(requests)
    places = [disk_cache.known(comm, request.identity, fresh=fresh) for request in requests]
    both = list(zip(requests, places, strict=True))
    computed = iter(_condensed([request for request, place in both if not place.arrays]))
    condensed = []
    for demand, place in both:
        body = CondensedBody(demand.patterns, demand.along, **place.arrays) if place.arrays else next(computed)
        if not place.arrays:
            place.save(body.arrays())
        condensed.append(body)
    return condensed


def _condensed(requests: Sequence[Request]) -> list[CondensedBody]:
    """Factor and solve; collective.

    One rank has nothing to do at once. A large factor beside a response to temperature is freed: what prepares the
    heat takes as much memory, and none of it needs the factor.
    """
    if not requests:
        return []
    if len(requests) > 1 and requests[0].elastic.body.mesh.comm.size == 1:
        return [_condensed([request])[0] for request in requests]
    _eliminate(requests)
    responses = respond_together(requests)
    loads = _under_loads([request.elastic for request in requests])
    condensed = []
    for demand, (response, warm), load in zip(requests, responses, loads, strict=True):
        q, d, along = demand.patterns.shape[1], demand.elastic.dim, demand.along
        answers, by_temperature = _guided(demand, response.reshape(q, d, -1, along.shape[2]), warm)
        answers = _symmetric(answers, along)
        by_load = demand.patterns.T @ load
        condensed.append(CondensedBody(demand.patterns, along, answers, by_load, by_temperature))
        if by_temperature is not None and entries(demand.elastic.size, d) > LARGE:
            demand.elastic.free_factor()
    return condensed


def _guided(request: Request, response: Array, by_temperature: Array | None) -> tuple[Array, Array | None]:
    """Return the response (q, d, k, a) and that to temperature of a body whose guides hold it; collective."""
    answer = request.elastic.guide_answer
    if not len(answer.turning):
        return response, by_temperature
    rotations, moved = (request.seen(fields) for fields in (answer.rotations_there, answer.moved_there))
    couple, work = (np.einsum("kdg,kda->gka", seen, request.along) for seen in (rotations, moved))
    flat = [each.reshape(len(each), -1) for each in (couple, work)]
    response = response + answer.change(rotations, moved, flat[0], flat[1]).reshape(response.shape)
    if by_temperature is not None and request.thermal_coupling is not None:
        warmed = np.array([transposed_times(request.thermal_coupling, field) for field in answer.moved.T])
        by_temperature = by_temperature - np.einsum("kdg,kda,gT->kaT", rotations, request.along, warmed)[:, 0]
    return response, by_temperature


def _eliminate(requests: Sequence[Request]) -> None:
    """Factor each body on ranks of its own, or in substructures on all ranks, all at once; collective."""
    factors = []
    ranks = max(requests[0].elastic.body.mesh.comm.size // len(requests), 1)
    for number, request in enumerate(reversed(requests)):  # the first ranks get the last one
        elastic = request.elastic
        surface = request.thermal_coupling is None and by_surface(elastic)  # temperatures act inside the body
        together = surface and elastic.body.mesh.comm.size > 1 and not elastic.setup.reproducible
        together = together and elastic.boundary.size**3 <= BOUNDARY_SHARE * operations(elastic.size, elastic.dim)
        copies = 1 if surface or together else _copies(request, ranks, len(requests))
        factors.append(elastic.begin_factor(number * ranks, copies, with_surface=surface, together=together))
    make_together([factor for factor in factors if not factor.is_made])


def _copies(request: Request, ranks: int, bodies: int) -> int:
    """Return the number of ranks that solve for the columns of a body, each with a factor of its own; collective.

    Each has half a second of work, and all copies of all bodies take half of the memory that is free.
    """
    elastic = request.elastic
    size = entries(elastic.size, elastic.dim)
    worth = 4 * size * request.count // LONG
    room = 0.5 * free_on_ranks(elastic.body.mesh.comm) // (bodies * 8 * (WORKING * size + elastic.matrix_entries()))
    return int(max(min(ranks, worth, room), 1))


def _symmetric(response: Array, along: Array) -> Array:
    """Return the response with its part along the directions made symmetric: Maxwell and Betti, up to rounding."""
    q, _, _, count = response.shape
    part = np.einsum("kca,kclb->kalb", along, response).reshape(q * count, q * count)
    change = ((part.T - part) / 2).reshape(q, count, q, count)
    return response + np.einsum("kca,kalb->kclb", along, change)


def _under_loads(bodies: Sequence[ElasticBody]) -> list[Array]:
    """Return the displacement of each body's trace nodes under its loads (N, d), mm, all solved at once; collective."""
    solutions = solve_together([body.factor for body in bodies], [body.load for body in bodies])
    displacement = [
        body.trace.pick(solution[:, None])[:, :, 0] for body, solution in zip(bodies, solutions, strict=True)
    ]
    for number, body in enumerate(bodies):
        answer = body.guide_answer
        work = total(body.body.mesh.comm, answer.moved.T @ body.load)
        displacement[number] += answer.change(answer.rotations_there, answer.moved_there, body.guided_resultant, work)
    return displacement
