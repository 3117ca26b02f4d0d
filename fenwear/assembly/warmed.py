"""Materials' properties that depend on the temperature: when they have changed, and the bodies with those of now.

Within the steps properties are fields that stay, each at the temperature of its own node at the end of the cycle that
they were taken from. When at some node one has changed by more than a tolerance the bodies are made anew with those of
the temperatures of now, on the same meshes. So they follow what is slow: their swing within a cycle is left out.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.assembly.bodies import Bodies, build_conduction, elastic_body
from fenwear.assembly.laws import ContactLaw
from fenwear.assembly.tribosystem import Tribosystem
from fenwear.case import Body, Case
from fenwear.errors import CaseError
from fenwear.heat.conduction import HeatBody
from fenwear.heat.field import HeatState

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
    if case.heat is None or conduction is None or state is None or not case.warming:
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
    problems = [one for one in system.comm.allgather(problem) if one is not None]
    if problems:
        raise problems[0]
    return float(system.comm.allreduce(changed, op=MPI.MAX)) / case.heat.property_tolerance


def taken_at(system: Tribosystem) -> tuple[Array, Array]:
    """Return the temperatures of this rank's own nodes of both bodies that the properties are taken at, K."""
    if system.bodies.warmed is not None or system.bodies.heat is None or system.case.heat is None:
        return system.bodies.warmed or (np.zeros(0), np.zeros(0))
    start = system.case.heat.initial
    punch, strip = (np.full(body.owned, start) for body in system.bodies.heat)
    return punch, strip


def warming_key(system: Tribosystem) -> str:
    """Return the key of a property that depends on the temperature; "" where none does."""
    case = system.case
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
        for one in material.dependent:
            new, old = (material.values(one, theta[nodes], f"materials.{name}") for theta in (now, then))
            scale = np.abs(old) if one != "expansion" else np.abs(old).max(initial=0.0)  # it may pass through zero
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
    law: ContactLaw = system.contact_law
    return law.renewed(system, bodies)


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
