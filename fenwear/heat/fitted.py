"""Temperatures of a body on a small basis as good as asked for: they die out, and are those of the whole mesh.

The reduced temperatures of a body, kept on disk for the next start like its condensed elasticity.

The response of the contact's temperature to the fluxes there, by the end of a step of the full field.

That is C A^-1 L, C the temperature at the contact nodes and L the loads of unit fluxes. Both touch the trace's degrees
of freedom s alone, so that the Schur complement S of these in A has all of it, (A^-1)_ss = S^-1: one elimination in
place of a solution for each contact node.

The difference of a body's reduced temperatures from those of its whole mesh, at the contact.

Both are led through a cycle of its steps from rest, and to the steady state of the cycle's mean flux, by an even
pressure, one that grows along the contact, and one at random. The comparison is of the values that contact feels: the
temperature at its nodes and the thermal gap beside a rigid motion, at the end of the cycle.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array, hstack, vstack

from fenwear.algebra.factor import Factor, available, entries, make_together
from fenwear.common import disk_cache
from fenwear.common.arrays import Array
from fenwear.common.errors import HeatError
from fenwear.common.parallel import once, total
from fenwear.heat.conduction import PREFIX, HeatBody, HeatStep, Surroundings
from fenwear.heat.reduction import PASSES, ROUNDING, reduced_basis
from fenwear.heat.side import EARLIER
from fenwear.heat.temperature import CHUNK, ReducedBasis, ReducedField, modal_basis

STEPS = 40  # of a cycle, the last ones, that both are led through at most
FLAT = 1e-6  # of the thermal gap: what of it is less beside a rigid motion counts against that


@dataclass(frozen=True)
class Trial:
    """Trial of a body's reduced temperatures.

    Attributes:
        inflow: Loads of unit fluxes (owned, q).
        entering: Fluxes of each step of a cycle (q, m) under m pressures.
        contact: Temperature at the contact nodes at the end of the cycle (n, owned).
        opened: Gap there (n, k), mm, by changes of the temperature of this rank's nodes (owned, k); collective.
        rigid: Gaps of rigid motions, orthonormal (n, r).
        through: Interpolation of temperatures from the places of the fluxes to the contact nodes (n, q); None where
            they are these.
    """

    inflow: csc_array
    entering: Sequence[Array]
    contact: csr_array
    opened: Callable[[Array], Array]
    rigid: Array
    through: csr_array | None = None


def certificate(
    step: HeatStep, velocity: float, surroundings: Surroundings, small: ReducedField, trial: Trial
) -> float:
    """Return the largest difference of the readings over their largest, at any node and under any pressure; collective.

    Args:
        step: A stage of the whole body, which it advances by.
        velocity: Of its material in it, mm/s or rad/s.
        surroundings: Boundary beyond the mesh.
        small: Reduced temperature of the body with this stage.
        trial: Fluxes, and what is compared.
    """
    body, last = step.body, trial.entering[-STEPS:]
    dim, m = len(small.basis), last[0].shape[1]
    compare = _Comparison(body, small, trial)
    full, reduced = np.zeros((body.owned, m)), np.zeros((dim, m))
    for flux in last:
        heated, answer = step.respond(trial.inflow @ flux), small.responses[0] @ flux
        for counts in (EARLIER, 1.0):
            full = full + counts * (step.advance(full, sources=False) + heated - full)
            reduced = reduced + counts * (small.advance(0, reduced, sources=False) + answer - reduced)
    largest = compare.apart(full, reduced, last[-1])
    if body.loses_heat(velocity, surroundings):
        mean = np.mean(trial.entering, axis=0)
        steady = body.step(velocity, np.inf, surroundings)
        full = steady.respond(trial.inflow @ mean)
        steady.free()
        changes = np.eye(dim) - small.advance(0, np.eye(dim), sources=False)
        fixed = scipy.linalg.solve(changes, small.responses[0] @ mean)
        largest = max(largest, compare.apart(full, fixed, mean))
    return largest


def pressures(x: Array) -> Array:
    """Return trial pressures at contact nodes x (n, d): even, growing along the contact, at random."""
    along = x[:, 0] - x[:, 0].min()
    random = np.random.default_rng(0).random(len(x))
    return np.stack([np.ones(len(x)), along / max(float(along.max()), 1e-300), random], axis=1)


def rigid_gaps(body: HeatBody, x: Array) -> Array:
    """Return the gaps at contact nodes x (n, d) of rigid motions, orthonormal (n, r): rings do not tilt."""
    tilts = x[:, :0] if body.kind == "axisymmetric" else x[:, :-1]
    return np.asarray(np.linalg.qr(np.column_stack([np.ones(len(x)), tilts]))[0])


class _Comparison:
    """Readings of a body's whole and reduced temperature; collective to make."""

    def __init__(self, body: HeatBody, small: ReducedField, trial: Trial) -> None:
        self._comm, self._trial, self._columns = body.body.mesh.comm, trial, small.basis.columns
        self._contact = small.observe(trial.contact)
        self._beyond: Array | None = None  # what a flux adds at the contact beside the coordinates
        if small.contact_responses is not None:
            exact = small.contact_responses[0]
            exact = exact if trial.through is None else np.asarray(trial.through @ exact)
            self._beyond = exact - self._contact.of_changes(small.responses[0])

    def apart(self, full: Array, reduced: Array, flux: Array) -> float:
        """Return the largest difference of readings over their largest; collective.

        Args:
            whole: Temperatures (owned, m).
            reduced: Coordinates (dim, m).
            flux: Of the last step (q, m).
        """
        exact = total(self._comm, np.asarray(self._trial.contact @ full))
        contact = self._contact.of_changes(reduced)
        if self._beyond is not None:
            contact = contact + self._beyond @ flux
        both = self._trial.opened(np.hstack([full, self._columns @ reduced - full]))
        (gap, missing), rigid = np.hsplit(both, 2), self._trial.rigid
        size = np.abs(gap).max(axis=0)
        gap, missing = (opening - rigid @ (rigid.T @ opening) for opening in (gap, missing))
        return max(
            _relative(contact - exact, np.abs(exact).max(axis=0)),
            _relative(missing, np.maximum(np.abs(gap).max(axis=0), FLAT * size)),
        )


def _relative(difference: Array, size: Array) -> float:
    return float((np.abs(difference).max(axis=0) / np.maximum(size, 1e-300)).max())


def contact_responses(steps: Sequence[HeatStep], inflow: csc_array, contact_rows: csr_array) -> list[Array]:
    """Return the contact temperature from unit fluxes (n, n) at the end of each full step; collective.

    Args:
        steps: Of a body. Their factors are made and freed one after the other.
        inflow: Loads of unit fluxes at the interface nodes (owned, n), mm.
        contact_rows: Temperature at the contact nodes (n, owned).
    """
    body = steps[0].body
    comm = body.body.mesh.comm
    free: Array = np.ones(body.owned)
    free[body.held] = 0.0
    loads = [csr_array(load) for load in comm.allgather(csr_array(inflow * free[:, None]))]
    rows = comm.allgather(csr_array(contact_rows))
    whole_loads, whole_rows = csr_array(vstack(loads)), csc_array(hstack(rows))
    surface = np.union1d(whole_loads.nonzero()[0], whole_rows.nonzero()[1])
    small = len(surface) ** 2 <= entries(whole_loads.shape[0], body.body.mesh.topology.dim)
    responses = []
    for step in steps:
        factor = _surface_factor(step, surface) if small and available() else None
        if factor is None:
            responses.append(_by_columns(step, inflow, contact_rows))
            continue
        response: Array = np.zeros((contact_rows.shape[0], inflow.shape[1]))
        if factor.schur is not None:
            answers = scipy.linalg.solve(factor.schur, whole_loads[surface].toarray(), overwrite_b=True)
            response = np.asarray(whole_rows[:, surface] @ answers)
        comm.Bcast(response, root=factor.owner)
        factor.free()
        responses.append(response)
    return responses


def _surface_factor(step: HeatStep, surface: NDArray[np.int64]) -> Factor | None:
    """Return the factor with the Schur complement of the surface; None where it would be spread; collective."""
    mesh = step.body.body.mesh
    factor = Factor(step.a, PREFIX, "lu", comm=mesh.comm, dim=mesh.topology.dim, surface=surface)
    if factor.is_spread:
        return None
    make_together([factor])
    return factor


def _by_columns(step: HeatStep, inflow: csc_array, contact_rows: csr_array) -> Array:
    """Return the response of one step by a solution for each flux; collective."""
    n = inflow.shape[1]
    response: Array = np.empty((n, n))
    for begin in range(0, n, CHUNK):
        some = slice(begin, begin + CHUNK)
        response[:, some] = contact_rows @ step.respond(inflow[:, some].toarray())
    step.free_factor()
    return total(step.body.body.mesh.comm, response)


Make = partial[ReducedBasis]  # the function that makes it, after the body all that it follows from
Way = Callable[[Make, Sequence[HeatStep]], ReducedBasis]


def made(make: Make, _: Sequence[HeatStep]) -> ReducedBasis:
    """Return a basis that is made whatever is kept; collective."""
    return make()


def kept_basis(make: Make, steps: Sequence[HeatStep], *, fresh: bool) -> ReducedBasis:
    """Return a basis from disk where it is kept, else make and keep it; collective.

    Args:
        make: Makes it from the body and further arguments.
        steps: Of the body: their matrices have its mesh, materials, convection and held temperatures in them.
        fresh: Make it whatever is kept.

    Raises:
        CaseError: the limit of what is kept is no number.
    """
    body: HeatBody = steps[0].body
    comm = body.body.mesh.comm

    def parts() -> Iterator[object]:
        yield from ("reduced temperatures", body.body.mesh.geometry.x)
        for argument in (*make.args[1:], *make.keywords.values()):
            yield from _parts(argument)
        for step in steps:
            yield from (*step.a.getValuesCSR(), *step.b.getValuesCSR(), step.source, step.carried, step.entering)
        yield from (body.initial(), body.held, body.storage, body.convected)

    place = disk_cache.known(comm, parts, fresh=fresh)
    if place.arrays:
        return ReducedBasis(body, place.arrays["lift"], place.arrays["columns"])
    basis = make()
    place.save({"lift": basis.lift, "columns": basis.columns})
    return basis


def _parts(argument: object) -> Iterator[object]:
    """Yield the arrays of an argument, and objects whose text is complete."""
    if isinstance(argument, csc_array):
        yield from (argument.data, argument.indices, argument.indptr)
    elif isinstance(argument, Surroundings):
        yield from (argument.renewed, argument.sliding, argument.exposed)
    elif isinstance(argument, Sequence):
        yield np.asarray(argument)
    else:
        yield argument


NEUTRAL = 1e-8  # of a spectral radius above 1: a body that loses no heat has 1
TRIES = 3  # of the basis, each ten times as sharp as the one before, and followed over twice as many steps


@dataclass(frozen=True)
class BasisRequest:
    """Parts of a basis, and its tolerance.

    Attributes:
        velocities: Of the body's material in all its steps, and in those of other stages that share the basis.
        duration: Of the shortest step, s.
        tolerance: Singular values below this fraction of the largest are dropped.
        difference: From the whole mesh that is let pass, relative.
        surroundings: Boundary beyond the mesh.
        cycle: Which step each one of a cycle is.
        way: Origin of a basis: made, or taken from what is kept.
    """

    velocities: Sequence[float]
    duration: float
    tolerance: float
    difference: float
    surroundings: Surroundings
    cycle: Sequence[int]
    way: Way


def fitted_field(
    body: HeatBody,
    steps: list[HeatStep],
    velocities: Sequence[float],
    trial: Trial,
    wish: BasisRequest,
    lasting: csr_array | None = None,
) -> tuple[ReducedField, float]:
    """Return the field on a basis that is enlarged until it is good, and its difference from the whole mesh.

    Collective. Every temperature dies out over the cycle of steps. A difference may stay above what is let pass.

    Args:
        body: The body.
        steps: Prepared ones, the shortest first.
        own: Velocity of its material in each of them.
        trial: Trial against the whole mesh, where the material has one velocity.
        wish: Parts and tolerance of the basis.
        lasting: Temperature at the contact nodes, for a basis of what is felt a step later; None for all.

    Raises:
        HeatError: on no basis they die out.
    """
    inflow, speeds, tolerance = trial.inflow, wish.velocities, wish.tolerance
    exact = None if lasting is None else contact_responses(steps, inflow, lasting)
    shared = len(speeds) > len(wish.cycle)
    for tries in range(1, 100):
        settings = (inflow, speeds, wish.duration, tolerance, wish.surroundings)
        passes = PASSES * 2 ** min(tries - 1, TRIES)
        make = partial(reduced_basis, body, *settings, lasting=lasting is not None, passes=passes)
        basis = _shared(body, make, partial(wish.way, make, steps)) if shared else wish.way(make, steps)
        field = _on(basis, steps, wish, inflow, exact)
        growth, difference = field.spectral_radius(wish.cycle), 0.0
        if growth <= 1 + NEUTRAL:
            hold = partial(certificate, steps[0], velocities[0], wish.surroundings, field, trial)
            comm, key = body.body.mesh.comm, (id(basis), velocities[0])
            difference = once(comm, body.certified, key, hold) if shared else hold()
            if difference <= wish.difference or tries >= TRIES or tolerance <= ROUNDING:
                break
        elif tolerance <= ROUNDING:
            raise HeatError(
                f"the reduced temperatures of the {body.body.name} grow without heat, by a factor of "
                f"{growth:.6g} a cycle, on any basis. Hold the temperature where its material enters, "
                'set heat.inflow, or set heat.operator = "full"'
            )
        tolerance = max(tolerance / 10, ROUNDING)  # more fields: nearer to the full steps
    return field, difference


def _on(
    basis: ReducedBasis, steps: Sequence[HeatStep], wish: BasisRequest, inflow: csc_array, exact: Sequence[Array] | None
) -> ReducedField:
    """Return the field on a basis, of material at rest on its modes; collective."""
    if not any(wish.velocities):
        return ReducedField(steps, inflow, modal_basis(basis, steps[0], wish.duration)[0], exact, modal=True)
    one_way = min(wish.velocities) * max(wish.velocities) >= 0 and any(step.moves for step in steps)
    return ReducedField(steps, inflow, basis, exact, one_way=one_way)


def _shared(body: HeatBody, make: partial[ReducedBasis], way: Callable[[], ReducedBasis]) -> ReducedBasis:
    """Return the basis of all stages of a program: the one that the stage before has made; collective."""
    inflow, speeds, duration, tolerance, around = make.args[1:]
    exposed = None if around.exposed is None else around.exposed.tobytes()
    ordered = inflow.sorted_indices()  # products leave them in an order that the first who asks for them changes
    loads = ordered.indices.tobytes(), ordered.data.tobytes()
    key = (loads, tuple(sorted(set(speeds))), duration, tolerance, around.renewed, exposed)

    def another() -> ReducedBasis:
        if len(body.shared_bases) >= TRIES:
            body.shared_bases.clear()
            body.certified.clear()
        return way()

    return once(body.body.mesh.comm, body.shared_bases, key, another)
