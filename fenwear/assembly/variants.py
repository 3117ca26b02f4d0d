"""A whole case in one call, and variants of it that share what they do not change."""

from __future__ import annotations

from dataclasses import replace

from mpi4py import MPI

from fenwear.arrays import Array
from fenwear.assembly.bodies import build_bodies
from fenwear.assembly.contact_setup import ContactSetup
from fenwear.assembly.growing import answers_anywhere, on_first_contact, relaid
from fenwear.assembly.laws import ContactLaw, law_named
from fenwear.assembly.placing import place, place_case_bodies
from fenwear.assembly.tribosystem import (
    Preparation,
    Tribosystem,
    joined,
    preparation,
    with_exchange,
)
from fenwear.case import Case, Heat, changed_case
from fenwear.sliding.wear import WornDepths


def assemble(
    case: Case,
    comm: MPI.Comm = MPI.COMM_WORLD,
    followed: WornDepths | None = None,
    *,
    heat: Preparation = "as set",
    fresh: bool = False,
    warmed: tuple[Array, Array] | None = None,
) -> Tribosystem:
    """Return the system of a case: all steps; collective.

    Args:
        case: The problem.
        comm: The ranks.
        followed: Worn depths that the meshes follow; by default they are as they were made.
        heat: How the heat of the motion is prepared, which takes longest: as the case sets it, reduced to a
            small basis as whole cycles need it, or not at all.
        fresh: Mesh and condense the bodies and reduce their heat again, even where all that is kept on disk.
        warmed: Temperatures of this rank's own nodes that the materials' properties are taken at; by default the
            initial one.

    Raises:
        CaseError: what only the geometry can tell is wrong.
        MeshQualityError: an element does not survive the motion of its mesh.
    """
    law: ContactLaw = law_named(case.contact.law)
    return law.of_bodies(case, build_bodies(case, comm, followed, warmed, fresh=fresh), heat=heat, fresh=fresh)


def renewed(
    system: Tribosystem, followed: WornDepths | None = None, warmed: tuple[Array, Array] | None = None
) -> Tribosystem:
    """Return the system of the same case on meshes and with properties of now; collective.

    Args:
        system: Of a case.
        followed: Worn depths that the meshes follow.
        warmed: Temperatures of this rank's own nodes that the materials' properties are taken at.

    Raises:
        MeshQualityError: an element does not survive the motion of its mesh.
    """
    law: ContactLaw = system.contact_law
    return on_first_contact(law.renewed(system, build_bodies(system.case, system.comm, followed, warmed)))


def place_case(
    case: Case,
    comm: MPI.Comm = MPI.COMM_WORLD,
    followed: WornDepths | None = None,
    warmed: tuple[Array, Array] | None = None,
) -> ContactSetup:
    """Return both bodies of a case opposite each other, without any elasticity; collective.

    Args:
        case: The problem.
        comm: The ranks.
        followed: Worn depths that the meshes follow.
        warmed: Temperatures that the materials' properties are taken at.

    Raises:
        CaseError: what only the geometry can tell is wrong.
        MeshQualityError: an element does not survive the motion of its mesh.
    """
    return place_case_bodies(case, build_bodies(case, comm, followed, warmed))


def vary(system: Tribosystem, *settings: str) -> Tribosystem:
    """Return the system with changed keys of its case, sharing all operators which the change leaves; collective.

    Args:
        system: Of a case.
        settings: Overrides `key.path=value`, as on the command line.

    Raises:
        CaseError: an override does not fit, or the punch would tip over.
    """
    return with_case(system, changed_case(system.case, *settings))


def with_case(system: Tribosystem, case: Case) -> Tribosystem:
    """Return the system of another case that shares all operators which the change leaves; collective.

    Loads, friction, wear, motion and the exchange of heat factor no stiffness again; another motion
    prepares the steps of heat again. Anything else makes a new system.

    Args:
        system: Of a case.
        case: The other one.

    Raises:
        CaseError: the punch would tip over.
    """
    law: ContactLaw = law_named(case.contact.law)
    made, wanted = set_up_by(system.case), set_up_by(case)
    if law is system.contact_law and made != wanted and answers_anywhere(system):
        as_before = case.model_copy(update={"motion": system.case.motion})
        if set_up_by(as_before) == made:
            return relaid(law.varied(system, as_before), case)
    if law is not system.contact_law or made != wanted:
        return assemble(case, system.comm, system.bodies.followed, heat=preparation(system))
    return law.varied(system, case)


def in_parts(system: Tribosystem, parts: int) -> Tribosystem:
    """Return the system with each phase of the motion cut into parts of equal time; collective."""
    sliding = replace(system.sliding, motion=system.motion.in_parts(parts))
    placed = place(system.bodies, sliding, system.case)
    cut = joined(placed, system.condensed)
    return with_exchange(cut, reduced=system.exchange.reduced) if system.exchange.conducts else cut


def set_up_by(case: Case) -> tuple[object, ...]:
    """Return what the meshes, stiffnesses and thermal expansion of a case are made from: variants share them by it."""
    bodies = (
        (
            *(body.regions, body.supports, body.no_turning_about, body.pivot, body.profile, body.topography),
            *(body.operator, body.creep, {load.on for load in case.loads_of(name)}),
        )
        for name, body in case.bodies.items()
    )
    initial = case.heat.initial if case.heat is not None and case.warming else None
    meshed = (case.geometry, case.folder, case.given.meshes, case.given.stresses, tuple(case.diffusion.items()))
    grid = None if case.grid is None else (case.grid, case.motion)  # it reaches as far as the punch does
    return (*meshed, grid, case.model, case.setup, case.materials, case.heat is None, initial, *bodies)


def same_conduction(one: Case, other: Case) -> bool:
    """Return whether heat is conducted alike in the bodies of two cases, whatever passes between them."""
    if one.heat is None or other.heat is None:
        return one.heat is other.heat
    own, others = (case.heat.model_dump(exclude=set(Heat.exchange_keys)) for case in (one, other) if case.heat)
    held = [(case.punch.boundary_of_heat, case.strip.boundary_of_heat) for case in (one, other)]
    return own == others and held[0] == held[1]
