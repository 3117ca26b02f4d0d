"""Temperatures of a body on a small basis as good as asked for: they die out, and are those of the whole mesh."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from scipy.sparse import csc_array, csr_array

from fenwear.arrays import Array
from fenwear.errors import HeatError
from fenwear.heat.certificate import Trial, certificate
from fenwear.heat.conduction import HeatBody, HeatStep, Surroundings
from fenwear.heat.contact_response import contact_responses
from fenwear.heat.field import ReducedBasis, ReducedField
from fenwear.heat.kept_basis import Way
from fenwear.heat.modal import ModalField, modal_basis
from fenwear.heat.reduction import PASSES, ROUNDING, reduced_basis
from fenwear.parallel import once

NEUTRAL = 1e-8  # of a spectral radius above 1: a body that loses no heat has 1
TRIES = 3  # of the basis, each ten times as sharp as the one before, and followed over twice as many steps


@dataclass(frozen=True)
class BasisRequest:
    """What a basis is to be made of, and how good.

    Attributes:
        velocities: Of the body's material in all its steps, and in those of other stages that share the basis.
        duration: Of the shortest step, s.
        tolerance: Singular values below this fraction of the largest are dropped.
        difference: From the whole mesh that is let pass, relative.
        surroundings: What the body meets.
        cycle: Which step each one of a cycle is.
        way: How a basis is come by: made, or taken from what is kept.
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
    own: Sequence[float],
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
        trial: What it is held against the whole mesh with, where the material has one velocity.
        wish: What is wanted.
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
            hold = partial(certificate, steps[0], own[0], wish.surroundings, field, trial)
            comm, key = body.body.mesh.comm, (id(basis), own[0])
            difference = once(comm, body.certified, key, hold) if shared else hold()
            if difference <= wish.difference or tries >= TRIES or tolerance <= ROUNDING:
                break
        elif tolerance <= ROUNDING:
            raise HeatError(
                f"the reduced temperatures of the {body.body.name} grow without heat, by a factor of "
                f"{growth:.6g} a cycle, on any basis: hold the temperature where its material enters, "
                'give heat.inflow, or set heat.operator = "full"'
            )
        tolerance = max(tolerance / 10, ROUNDING)  # more fields: nearer to the full steps
    return field, difference


def _on(
    basis: ReducedBasis, steps: Sequence[HeatStep], wish: BasisRequest, inflow: csc_array, exact: Sequence[Array] | None
) -> ReducedField:
    """Return the field on a basis, of material at rest on its modes; collective."""
    if not any(wish.velocities):
        return ModalField(steps, inflow, modal_basis(basis, steps[0], wish.duration)[0], exact)
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
