"""Slow changes: meshes follow the worn shape, contact grids the contact, properties the temperature.

Small wear is an offset of the gap. When it grows past a share of the elements' height at the contact,
both meshes move by the depths worn so far, all operators are made again, and temperatures keep their
place in space: theta(x + s) = theta + grad theta . s at a node that moves by s.

Where properties of materials depend on the temperature, the bodies are made again, on the same meshes, at the end of a
cycle after which one has changed by more than heat.property_tolerance: see `fenwear.system.variants`.

When all that happens is found by thresholds. A run may follow at the half-cycles of another one, so that its results
are a smooth function of their difference.

States of bodies whose materials have the properties of the temperatures there.

State and bodies follow each other: the state of the bodies as they are, the bodies with the properties of its
temperatures, and so on, until no property changes any more.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from enum import Enum
from functools import partial
from typing import TypeVar

import dolfinx
import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI

from fenwear.algebra.assembled import interpolate
from fenwear.common.arrays import Array
from fenwear.common.errors import ConvergenceError
from fenwear.heat.temperature import HeatState
from fenwear.laws.wear import WornDepths
from fenwear.steps.block import Block
from fenwear.steps.driver import RunLimits
from fenwear.steps.run_state import RunState, carried_by, on_other_grid
from fenwear.system import (
    Tribosystem,
    outgrown,
    properties_outdated,
    property_change,
    regridded,
    renewed,
    taken_at,
    warmed_system,
    warming_key,
)

# Yields the blocks of a system within limits from a state, or the beginning.
Integrate = Callable[[Tribosystem, RunLimits, RunState | None], Iterator[Block]]


class Renewal(Enum):
    """Parts that are updated."""

    MESHES = "meshes"
    PROPERTIES = "properties"
    GRID = "grid"


def follow(
    system: Tribosystem,
    integrate: Integrate,
    limits: RunLimits,
    start: RunState | None = None,
    adapt: Callable[[Tribosystem], Tribosystem] = lambda system: system,
    *,
    given: Mapping[int, Renewal] | None = None,
    heights_of: Tribosystem | None = None,
    on_renewal: Callable[[int, Renewal], None] = lambda half_cycle, renewal: None,
) -> Iterator[Block]:
    """Yield the blocks of a run whose bodies follow large wear and temperature; collective. Each knows its system.

    Args:
        system: The assembled problem.
        integrate: Yields the blocks on one system within limits, such as `march_within`.
        limits: Of the run; it also ends where parts are to be updated.
        start: State to continue from; by default the beginning.
        adapt: Change of the system of the case on moved meshes, such as another motion; collective.
        given: Half-cycles after which parts are updated, and at no other; by default where it is large.
        heights_of: Another system on the same meshes, whose elements' heights are known.
        on_renewal: Called with every half-cycle after which parts are updated.

    Raises:
        ConvergenceError: as `integrate`.
        MeshQualityError: an element does not survive the motion of its mesh.
    """
    state, leave = start, _Leaving(system, given, heights_of)
    while True:
        renewal = None if state is None else leave.renewal(state)  # a run may also go on from just there
        if state is not None and renewal is not None:
            on_renewal(state.half_cycle, renewal)
            system, state = _renewed(system, state, renewal, adapt)
            given = None if given is None else {k: renewal for k, renewal in given.items() if k > state.half_cycle}
            leave = _Leaving(system, given)
        for block in integrate(system, replace(limits, leave=leave), state):
            yield block
            state = block.end
        if state is None or not leave(state):
            return


def _renewed(
    system: Tribosystem, state: RunState, renewal: Renewal, adapt: Callable[[Tribosystem], Tribosystem]
) -> tuple[Tribosystem, RunState]:
    """Return the updated system, and the state on it; collective."""
    if renewal is Renewal.MESHES:
        warmed = None if state.temperature is None else state.temperature.temperatures()
        moved = adapt(renewed(system, state.worn, warmed))
        return moved, _moved_along(state, moved)
    if renewal is Renewal.PROPERTIES and state.temperature is not None:
        return adapt(warmed_system(system, state.temperature)), state
    grid = outgrown(system, carried_by(state))
    if grid is None:  # of a run that follows another one, and needs less
        return system, state
    larger = regridded(system, grid)
    return adapt(larger), on_other_grid(state, system, larger)


class _Leaving:
    """Asks whether a run is to leave its system, and for what."""

    def __init__(
        self,
        system: Tribosystem,
        given: Mapping[int, Renewal] | None = None,
        heights_of: Tribosystem | None = None,
    ) -> None:
        self.system, self.given, self._heights_of = system, given, heights_of or system
        system.team.serve(self)
        if given is None:  # before rank 0 leads: the elements' heights take all ranks
            self._mesh_update_due(system.unworn())

    def __call__(self, state: RunState) -> bool:
        """Return whether parts need an update; collective, or for rank 0 that leads."""
        return self._renewal(state, partial(self.system.team.each, self, "is_warm")) is not None

    def renewal(self, state: RunState) -> Renewal | None:
        """Return the parts to update; collective."""
        return self._renewal(state, self.is_warm)

    def _mesh_update_due(self, worn: WornDepths) -> bool:
        """Return whether the wear since the meshes were moved is large against the elements at the contact."""
        return self._heights_of.bodies.wear_on_meshes(worn, self._heights_of.case) > 1

    def _renewal(self, state: RunState, is_warm: Callable[[RunState], bool]) -> Renewal | None:
        team = self.system.team
        if self.given is not None:
            return self.given.get(state.half_cycle)
        if team.lead(partial(self._mesh_update_due, state.worn)):
            return Renewal.MESHES
        if warming_key(self.system.case) and is_warm(state):
            return Renewal.PROPERTIES
        grows = team.lead(lambda: outgrown(self.system, carried_by(state)) is not None)
        return Renewal.GRID if grows else None

    def is_warm(self, state: RunState) -> bool:
        """Return whether a whole cycle ends at temperatures for which properties need an update; collective."""
        ended = state.half_cycle % self.system.motion.half_cycles == 0
        return ended and properties_outdated(self.system, state.temperature)


def _moved_along(state: RunState, moved: Tribosystem) -> RunState:
    """Return the state on moved meshes; collective."""
    finer = None if state.finer is None else _moved_along(state.finer, moved)
    return replace(state, temperature=_carried(state.temperature, moved), finer=finer)


def _carried(state: HeatState | None, moved: Tribosystem) -> HeatState | None:
    """Return the state of the same temperatures on the moved meshes; collective."""
    bodies = moved.bodies.heat
    if state is None:
        return None
    pairs = zip(state.functions(), bodies, strict=True)
    moved_along = [_in_place(old, body.function(body.initial())) for old, body in pairs]
    return HeatState.nodal(bodies, moved_along, state.track)


def _in_place(old: fem.Function, new: fem.Function) -> Array:
    """Return theta + grad theta . s on this rank's own nodes, s how far those of the new function have moved."""
    space, mesh = old.function_space, old.function_space.mesh
    shift = new.function_space.tabulate_dof_coordinates() - space.tabulate_dof_coordinates()
    largest = mesh.comm.allreduce(float(np.abs(shift).max(initial=0.0)), MPI.MAX)
    broken = fem.functionspace(mesh, ("DG", space.ufl_element().degree, (mesh.geometry.dim,)))
    gradient = fem.Function(broken)
    interpolate(ufl.grad(old), gradient)
    sums, counts = fem.Function(space), fem.Function(space)
    cells = mesh.topology.index_map(mesh.topology.dim).size_local
    to, from_ = space.dofmap.list[:cells].ravel(), broken.dofmap.list[:cells].ravel()
    slopes = gradient.x.array.reshape(-1, mesh.geometry.dim)[from_]
    np.add.at(sums.x.array, to, (slopes * shift[to, : mesh.geometry.dim]).sum(axis=1))
    np.add.at(counts.x.array, to, 1.0)
    for function in (sums, counts):
        function.x.scatter_reverse(dolfinx.la.InsertMode.add)
    change = sums.x.array / np.maximum(counts.x.array, 1.0) if largest > 0 else 0 * sums.x.array
    owned = space.dofmap.index_map.size_local * space.dofmap.bs
    return (old.x.array + change)[:owned]


T = TypeVar("T")
LEFT = 0.1  # of heat.property_tolerance: what properties may still change by in the state that is found
FALLING = 0.7  # of the change of the properties in the pass before
PASSES = 30


def with_own_properties(
    system: Tribosystem,
    solve: Callable[[Tribosystem], T],
    temperatures: Callable[[T], HeatState | None],
    within: float | None = None,
) -> tuple[T, int]:
    """Return the state whose bodies have the properties of its own temperatures, and the number of updates.

    Where the change does not fall from pass to pass, half of it is followed, then a quarter, and so on. Collective.

    Args:
        system: The assembled problem.
        found: Function that returns the state with the properties as they are; collective.
        temperatures: Of a state.
        within: Relative change of the properties that is left; by default a tenth of heat.property_tolerance.

    Raises:
        CaseError: a property is not positive at a temperature.
        ConvergenceError: the properties do not come to rest.
    """
    state, key = solve(system), warming_key(system.case)
    if not key or system.case.heat is None:
        return state, 0
    share = LEFT if within is None else within / system.case.heat.property_tolerance
    followed, before = 1.0, np.inf
    for done in range(PASSES):
        end = temperatures(state)
        if end is None:
            return state, 0
        change = property_change(system, end)
        if change <= share:
            return state, done
        followed, before = followed / 2 if change > FALLING * before else followed, change
        if followed < 1:
            pairs = zip(end.temperatures(), taken_at(system), strict=True)
            between = [followed * new + (1 - followed) * old for new, old in pairs]
            end = HeatState.nodal(system.bodies.heat, between, end.track)
        system = warmed_system(system, end)
        state = solve(system)
    raise ConvergenceError(
        f"the temperatures of the steady state and the properties that depend on them, {key}, did not converge "
        f"in {PASSES} passes: follow them by `run`"
    )
