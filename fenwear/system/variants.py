"""A whole case in one call, and variants of it that share what they do not change.

Materials' properties that depend on the temperature: when they have changed, and the bodies with those of now.

Within the steps properties are fields that stay, each at the temperature of its own node at the end of the cycle that
they were taken from. When at some node one has changed by more than a tolerance the bodies are made again with
properties at the present temperatures, on the same meshes. So they follow what is slow: their swing within a cycle is
left out.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from numpy.typing import NDArray

from fenwear.case import Body, Case, Heat, changed_case
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError
from fenwear.heat.conduction import HeatBody
from fenwear.heat.temperature import HeatState
from fenwear.laws.wear import WornDepths
from fenwear.system.both_bodies import Bodies, build_bodies, build_conduction, elastic_body
from fenwear.system.contact_laws import law_named
from fenwear.system.contact_setup import ContactSetup
from fenwear.system.growing_grids import answers_anywhere, on_first_contact, relaid
from fenwear.system.placing import place, place_case_bodies
from fenwear.system.tribosystem import (
    Preparation,
    Tribosystem,
    joined,
    preparation,
    with_exchange,
)


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
        heat: Preparation of the heat of the motion, which takes longest: as the case sets it, reduced to a
            small basis as whole cycles need it, or not at all.
        fresh: Mesh and condense the bodies and reduce their heat again, even where all that is kept on disk.
        warmed: Temperatures of this rank's own nodes that the materials' properties are taken at; by default the
            initial one.

    Raises:
        CaseError: a property of the geometry is wrong.
        MeshQualityError: an element does not survive the motion of its mesh.
    """
    return law_named(case.contact.law).of_bodies(
        case, build_bodies(case, comm, followed, warmed, fresh=fresh), heat=heat, fresh=fresh
    )


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
    return on_first_contact(system.law.renewed(system, build_bodies(system.case, system.bodies.comm, followed, warmed)))


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
        CaseError: a property of the geometry is wrong.
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
    law = law_named(case.contact.law)
    case = case.graded_as(system.case)  # so that studies are of one mesh
    made, wanted = set_up_by(system.case), set_up_by(case)
    if law is system.law and made != wanted and answers_anywhere(system):
        as_before = case.model_copy(update={"motion": system.case.motion})
        if set_up_by(as_before) == made:
            return relaid(law.varied(system, as_before), case)
    if law is not system.law or made != wanted:
        return assemble(case, system.bodies.comm, system.bodies.followed, heat=preparation(system))
    return law.varied(system, case)


def in_parts(system: Tribosystem, parts: int) -> Tribosystem:
    """Return the system with each phase of the motion cut into parts of equal time; collective."""
    sliding = replace(system.sliding, motion=system.motion.in_parts(parts))
    placed = place(system.bodies, sliding, system.case)
    cut = joined(placed, system.elastic.condensed)
    if not system.exchange.conducts:
        return cut
    # Of a stage of a program, whose surroundings are not those of the case.
    case = system.case.model_copy(update={"heat": system.exchange.heat})
    return replace(with_exchange(replace(cut, case=case), reduced=system.exchange.reduced), case=system.case)


def set_up_by(case: Case) -> tuple[object, ...]:
    """Return the settings behind meshes, stiffnesses and thermal expansion of a case: equal variants share them."""
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


def same_conduction(first: Case, other: Case) -> bool:
    """Return whether heat is conducted alike in the bodies of two cases, whatever passes between them."""
    if first.heat is None or other.heat is None:
        return first.heat is other.heat
    values, others = (case.heat.model_dump(exclude=set(Heat.exchange_keys)) for case in (first, other) if case.heat)
    held = [(case.punch.boundary_of_heat, case.strip.boundary_of_heat) for case in (first, other)]
    return values == others and held[0] == held[1]


ELASTIC = frozenset(("young", "expansion"))


def properties_outdated(system: Tribosystem, state: HeatState | None) -> bool:
    """Return whether a property has changed by more than the case's tolerance since it was taken; collective.

    Args:
        system: The assembled problem.
        state: The temperatures of now.

    Raises:
        CaseError: a property is not positive at a temperature.
    """
    return property_change(system, state) > 1


def property_change(system: Tribosystem, state: HeatState | None) -> float:
    """Return the largest change of a property since it was taken, over the case's tolerance; collective.

    Args:
        system: The assembled problem.
        state: The temperatures of now.

    Raises:
        CaseError: a property is not positive at a temperature.
    """
    case, conduction = system.case, system.bodies.heat
    if case.heat is None or state is None or not case.warming:
        return 0.0
    before = taken_at(system)
    changed, problem = 0.0, None
    for body, description, now, then in zip(
        conduction, (case.punch, case.strip), state.temperatures(), before, strict=True
    ):
        try:
            changed = max(changed, _change(case, body, description, now, then))
        except CaseError as error:  # raised below, on all ranks
            problem = error
    problems = [raised for raised in system.bodies.comm.allgather(problem) if raised is not None]
    if problems:
        raise problems[0]
    return float(system.bodies.comm.allreduce(changed, op=MPI.MAX)) / case.heat.property_tolerance


def taken_at(system: Tribosystem) -> tuple[Array, ...]:
    """Return the temperatures of this rank's own nodes of both bodies that the properties are taken at, K."""
    start = tuple(np.full(body.owned, system.case.initial_temperature) for body in system.bodies.heat)
    return system.bodies.warmed or start


def warming_key(case: Case) -> str:
    """Return the key of a property that depends on the temperature; "" where none does."""
    used = sorted(case.used_materials)
    return next((f"materials.{name}.{key}" for name in used for key in case.materials[name].dependent), "")


def _change(case: Case, body: HeatBody, description: Body, now: Array, then: Array) -> float:
    """Return the largest change of a property at this rank's own nodes, over what it was."""
    largest = 0.0
    for region, name in description.regions.items():
        material, nodes = (
            case.materials[name],
            _nodes_of(body.space, body.body.cell_tags.find(body.body.regions[region])),
        )
        for quantity in material.dependent:
            new, old = (material.values(quantity, theta[nodes], f"materials.{name}") for theta in (now, then))
            scale = np.abs(old) if quantity != "expansion" else np.abs(old).max(initial=0.0)  # it may pass through zero
            largest = max(largest, float((np.abs(new - old) / np.maximum(scale, 1e-300)).max(initial=0.0)))
    return largest


def _nodes_of(space: fem.FunctionSpace, cells: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return this rank's own nodes of some cells."""
    nodes = np.unique(space.dofmap.list[cells])
    return nodes[nodes < space.dofmap.index_map.size_local]


def warmed_system(system: Tribosystem, state: HeatState) -> Tribosystem:
    """Return the system of the same case and meshes with the properties of these temperatures; collective.

    Args:
        system: Of a case, or of a stage of its program: the new one is of the case as it stands.
        state: The temperatures.

    Raises:
        CaseError: a property is not positive at a temperature.
    """
    case = system.case
    bodies = _bodies_at(system.bodies, case, state.temperatures())
    return system.law.renewed(system, bodies)


def _bodies_at(bodies: Bodies, case: Case, temperatures: tuple[Array, Array]) -> Bodies:
    """Return the bodies on their meshes with the properties of these temperatures; collective."""
    used = case.used_materials
    punch, strip = bodies.punch, bodies.strip
    if any(ELASTIC & set(case.materials[name].dependent) for name in used):
        punch, strip = (
            elastic_body(case, body.body, description, theta)
            for body, description, theta in zip((punch, strip), (case.punch, case.strip), temperatures, strict=True)
        )
    heat = build_conduction(case, punch, strip, temperatures)
    return replace(bodies, punch=punch, strip=strip, heat=heat, warmed=temperatures)
