"""A whole case in one call, and variants of it that share what they do not change."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from mpi4py import MPI

from fenwear.arrays import Array
from fenwear.assembly.bodies import build_bodies, build_conduction
from fenwear.assembly.laws import GROSS, LAWS, law_named
from fenwear.assembly.placed import Placed, place
from fenwear.assembly.strokes import make_sliding
from fenwear.assembly.tribosystem import (
    Preparation,
    Tribosystem,
    answers_for,
    condense_bodies,
    elastic,
    heating_friction,
    joined,
    preparation,
    with_exchange,
    with_reduced_heat,
)
from fenwear.case import Case, Cycle, Heat, changed_case
from fenwear.sliding.wear import Worn


def assemble(
    case: Case,
    comm: MPI.Comm = MPI.COMM_WORLD,
    followed: Worn | None = None,
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
        fresh: Condense the bodies and reduce their heat again, even where they are kept on disk.
        warmed: Temperatures of this rank's own nodes that the materials' properties are taken at; by default the
            initial one.

    Raises:
        CaseError: what only the geometry can tell is wrong.
        MeshQualityError: an element does not survive the motion of its mesh.
    """
    if case.contact.law in LAWS and case.contact.law != GROSS:
        law = law_named(case.contact.law)
        return law.assemble(case, comm, followed, heat=heat, fresh=fresh, warmed=warmed)
    system = elastic(place_case(case, comm, followed, warmed), fresh=fresh)
    if heat == "none":
        return system
    prepare = with_reduced_heat if heat == "reduced" else with_exchange
    return prepare(system, keep=True, fresh=fresh)


def renewed(
    system: Tribosystem, followed: Worn | None = None, warmed: tuple[Array, Array] | None = None
) -> Tribosystem:
    """Return the system of the same case on meshes and with properties of now; collective.

    Args:
        system: Of a case.
        followed: Worn depths that the meshes follow.
        warmed: Temperatures of this rank's own nodes that the materials' properties are taken at.

    Raises:
        MeshQualityError: an element does not survive the motion of its mesh.
    """
    if system.law != GROSS:
        return law_named(system.law).renewed(system, followed, warmed)
    return assemble(system.case, system.comm, followed, heat=preparation(system), warmed=warmed)


def place_case(
    case: Case,
    comm: MPI.Comm = MPI.COMM_WORLD,
    followed: Worn | None = None,
    warmed: tuple[Array, Array] | None = None,
) -> Placed:
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
    bodies = build_bodies(case, comm, followed, warmed)
    return place(bodies, make_sliding(case), case.heat, solver=case.contact.solver, case=case)


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
    before = system.case
    if {before.contact.law, case.contact.law} & (LAWS.keys() - {GROSS}):
        return law_named(case.contact.law).varied(system, case)
    if set_up_by(before) != set_up_by(case):
        return assemble(case, system.comm, system.bodies.followed, heat=preparation(system))
    bodies, condensed, sliding = system.bodies, system.condensed, system.sliding
    if (before.motion, before.contact, before.wear) != (case.motion, case.contact, case.wear):
        sliding = make_sliding(case)
    tables = [one.motion if isinstance(one.motion, Cycle) else None for one in (before, case)]
    if (before.punch.loads, before.strip.loads, tables[0]) != (case.punch.loads, case.strip.loads, tables[1]):
        bodies = bodies.under(case)
    conducts_alike = _same_conduction(before, case)
    if not conducts_alike:
        bodies = replace(bodies, heat=build_conduction(case, bodies.punch, bodies.strip, bodies.warmed))
    placed = place(bodies, sliding, case.heat, solver=case.contact.solver, case=case)
    if not answers_for(condensed, system, placed):
        condensed = condense_bodies(placed)
    elif (bodies.punch, bodies.strip) != (system.bodies.punch, system.bodies.strip):
        condensed = condensed.under_loads(bodies)
    if system.exchange is None or case.heat is None:
        return joined(placed, condensed)
    if not conducts_alike or placed.motion != system.motion:
        prepare = with_reduced_heat if preparation(system) == "reduced" else with_exchange
        return prepare(joined(placed, condensed))
    friction = np.tile(heating_friction(placed), (len(placed.motion.phases), 1))
    return joined(placed, condensed, system.exchange.varied(case.heat, friction))


def in_parts(system: Tribosystem, parts: int) -> Tribosystem:
    """Return the system with each phase of the motion cut into parts of equal time; collective."""
    sliding = replace(system.sliding, motion=system.motion.in_parts(parts))
    placed = place(system.bodies, sliding, system.heat, solver=system.solver, case=system.made_from)
    cut = joined(placed, system.condensed)
    return cut if system.exchange is None else with_exchange(cut, reduced=system.exchange.reduced)


def set_up_by(case: Case) -> tuple[object, ...]:
    """Return what the meshes, stiffnesses and thermal expansion of a case are made from: variants share them by it."""
    bodies = (
        (body.regions, body.supports, body.pivot, body.profile, body.operator) for body in (case.punch, case.strip)
    )
    initial = case.heat.initial if case.heat is not None and case.warming else None
    meshed = (case.geometry, case.folder, tuple(case.diffusion.items()))
    return (*meshed, case.model, case.setup, case.materials, case.heat is None, initial, *bodies)


def _same_conduction(one: Case, other: Case) -> bool:
    """Return whether heat is conducted alike in the bodies of two cases, whatever passes between them."""
    if one.heat is None or other.heat is None:
        return one.heat is other.heat
    own, others = (case.heat.model_dump(exclude=set(Heat.exchange_keys)) for case in (one, other) if case.heat)
    held = [(case.punch.temperatures, case.strip.temperatures) for case in (one, other)]
    return own == others and held[0] == held[1]
