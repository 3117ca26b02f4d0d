"""The assembled problem: set up once, then solved for many loads, frictions, wear laws and motions."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from fenwear.arrays import Array, Mask
from fenwear.case import Body, Case, Heat, changed_case
from fenwear.contact import CondensedContact, ContactSolver
from fenwear.contact.full import FullContact
from fenwear.elasticity import ElasticBody
from fenwear.errors import CaseError, Problem
from fenwear.heat.conduction import HeatBody
from fenwear.heat.exchange import HeatExchange
from fenwear.heat.prepare import prepare_exchange, prepare_steady
from fenwear.interface import Facing, Interface, Statics, face, join, statics
from fenwear.mesh import BodyMesh, build_meshes
from fenwear.motion import Motion, make_motion
from fenwear.optimum import Optimum, check_equilibrium, optimum
from fenwear.surface import Surface, condense, respond_to_load, surface_nodes
from fenwear.wear import Wear


class System:
    """Two bodies in contact, ready to be solved.

    What is costly (stiffness factors, condensation) is made at first use and kept. All members are
    collective at first use: every rank must reach them.
    """

    def __init__(self, case: Case, comm: MPI.Comm = MPI.COMM_WORLD) -> None:
        """Build the meshes and the bodies of `case`; collective.

        Raises:
            CaseError: what only the geometry can tell is wrong, such as a missing group.
        """
        self.case, self.comm = case, comm
        meshes = build_meshes(case.geometry, case.folder, comm)
        self.punch, self.strip = (self._body(m, d) for m, d in zip(meshes, (case.punch, case.strip), strict=True))
        self.statics: Statics = statics(self.facing, self.punch, self.strip)
        self.heat_bodies  # noqa: B018  (finds missing groups before anything costly)
        for direction in self.motion.directions:
            check_equilibrium(self.statics, direction, case.contact.friction)

    def vary(self, *settings: str) -> System:
        """Return the system of a changed case that shares all operators which the change leaves; collective.

        Loads, friction, wear, motion and the exchange of heat factor no stiffness again; the motion
        prepares the steps of heat again. Anything else makes a new system.

        Args:
            settings: Overrides `key.path=value`, as on the command line.

        Raises:
            CaseError: an override does not fit, or the punch would tip over.
        """
        return self.with_case(changed_case(self.case, *settings))

    def with_case(self, case: Case) -> System:
        """Return the system of another case, as `vary`; collective."""
        if not _same_bodies(self.case, case):
            return System(case, self.comm)
        self.prepare()  # what is not made yet would be made anew in every variant
        other = copy.copy(self)
        for name in ("motion", "wear", "interface", "exchange", "reduced_exchange", "heat_bodies", "_surfaces"):
            other.__dict__.pop(name, None)
        other.case = case
        other._share_elasticity(self)
        other._share_heat(self)
        for direction in other.motion.directions:
            check_equilibrium(other.statics, direction, case.contact.friction)
        return other

    def _share_elasticity(self, base: System) -> None:
        thickness, surfaces = self.case.model.thickness, base.__dict__.get("_surfaces")
        if self.case.punch.loads != base.case.punch.loads or self.case.strip.loads != base.case.strip.loads:
            self.punch = base.punch.with_loads(self.case.punch.loads, thickness)
            self.strip = base.strip.with_loads(self.case.strip.loads, thickness)
            resultant = np.concatenate([self.punch.rigid_resultant, self.strip.rigid_resultant])
            self.statics = replace(base.statics, resultant=resultant)
            if surfaces is not None:
                surfaces = tuple(
                    replace(surface, normal_by_load=respond_to_load(elastic, surface.nodes))
                    for surface, elastic in zip(surfaces, (self.punch, self.strip), strict=True)
                )
        if surfaces is not None:
            self.__dict__["_surfaces"] = surfaces

    def _share_heat(self, base: System) -> None:
        heat, before = self.case.heat, base.case.heat
        if heat is None or before is None:
            return
        keys = Heat.exchange_keys
        same = heat.model_dump(exclude=set(keys)) == before.model_dump(exclude=set(keys))
        held = [(c.punch.temperatures, c.strip.temperatures) for c in (self.case, base.case)]
        if not same or held[0] != held[1]:
            return
        self.__dict__["heat_bodies"] = base.heat_bodies
        if self.case.motion == base.case.motion:
            for name in ("exchange", "reduced_exchange"):
                exchange = base.__dict__.get(name)
                if exchange is not None:
                    self.__dict__[name] = exchange.varied(heat, self.case.contact.friction)

    def _body(self, mesh: BodyMesh, description: Body) -> ElasticBody:
        return ElasticBody(mesh, description, self.case.materials, self.case.model, self.case.geometry.degree)

    @cached_property
    def facing(self) -> Facing:
        """The contact nodes of the two bodies, opposite each other."""
        return face(surface_nodes(self.punch), surface_nodes(self.strip))

    @cached_property
    def interface(self) -> Interface:
        """The condensed interface: factors both bodies."""
        return join(self.statics, *self._surfaces)

    @cached_property
    def _surfaces(self) -> tuple[Surface, Surface]:
        couplings: list[PETSc.Mat | None] = [None, None]
        if self.heat_bodies is not None:
            couplings = [
                elastic.thermal_coupling(heat.space, self.case.materials)
                for elastic, heat in zip((self.punch, self.strip), self.heat_bodies, strict=True)
            ]
        return (
            condense(self.punch, self.facing.punch, couplings[0]),
            condense(self.strip, self.facing.strip, couplings[1]),
        )

    @cached_property
    def heat_bodies(self) -> tuple[HeatBody, HeatBody] | None:
        """Conduction in the two bodies; None where the case has no heat."""
        case = self.case
        if case.heat is None:
            return None
        punch, strip = (
            HeatBody(elastic.body, description, case.materials, case.model, case.heat, case.geometry.degree)
            for elastic, description in ((self.punch, case.punch), (self.strip, case.strip))
        )
        return punch, strip

    def _gap_rows(self) -> tuple[Array, Array]:
        """Return the gap that each kelvin of this rank's nodes opens, (n, owned) each, mm/K."""
        punch, strip = (surface.normal_by_temperature for surface in self._surfaces)
        if punch is None or strip is None:
            raise CaseError(Problem("heat", "missing, but required here"))
        return punch, -self.facing.transfer @ strip

    @cached_property
    def exchange(self) -> HeatExchange | None:
        """The bodies' temperatures over half-cycles; None where the case has no heat."""
        if self.heat_bodies is None or self.case.heat is None:
            return None
        return self._prepare_exchange(reduced=self.case.heat.operator == "reduced")

    @cached_property
    def reduced_exchange(self) -> HeatExchange | None:
        """The same on a small basis, whatever the case says: what whole cycles need."""
        if self.case.heat is None or self.case.heat.operator == "reduced":
            return self.exchange
        return self._prepare_exchange(reduced=True)

    def _prepare_exchange(self, *, reduced: bool) -> HeatExchange:
        if self.heat_bodies is None:
            raise CaseError(Problem("heat", "missing, but required here"))
        rows = self._gap_rows()
        return prepare_exchange(self.case, self.heat_bodies, self.facing, rows, self.motion, reduced=reduced)

    def steady_exchange(self, velocities: Sequence[float]) -> HeatExchange:
        """Return the exchange whose phases are steady states at these velocities of the strip; collective.

        Raises:
            CaseError: the case has no heat, or a body no heat sink.
        """
        if self.heat_bodies is None:
            raise CaseError(Problem("heat", "missing, but required here"))
        return prepare_steady(self.case, self.heat_bodies, self.facing, self._gap_rows(), velocities)

    def prepare(self) -> None:
        """Make all that is costly now: the condensation and, with heat, the steps of the motion; collective."""
        self.interface  # noqa: B018
        self.exchange  # noqa: B018

    @cached_property
    def motion(self) -> Motion:
        """The sliding motion."""
        return make_motion(self.case.motion)

    @cached_property
    def wear(self) -> Wear:
        """The punch's wear in one half-cycle."""
        law = self.case.wear.punch
        return Wear(law, self.motion.sliding(law.speed_exponent))

    def contact(self, directions: tuple[int, ...]) -> ContactSolver:
        """Return the contact of the given phases, by the solver that the case names."""
        friction = self.case.contact.friction
        if self.case.contact.solver == "full":
            return FullContact(self.punch, self.strip, self.interface, friction, directions[0])
        return CondensedContact(self.interface, friction, directions)

    def optimum(self, direction: int, zone: Mask | None = None) -> Optimum:
        """Return the optimal pressure and wear velocity of one-way sliding at the mean wear rate.

        Args:
            direction: Sliding direction d.
            zone: Nodes in contact (n,) bool; by default all.
        """
        law = self.case.wear.punch
        rate = self.wear.per_power / self.motion.duration
        return optimum(self.statics, direction, self.case.contact.friction, rate, law.pressure_exponent, zone)


def _same_bodies(one: Case, other: Case) -> bool:
    """Return whether two cases have the same meshes, stiffnesses and thermal expansion."""
    parts = [
        (
            case.geometry,
            case.folder,
            case.model,
            case.materials,
            case.heat is None,
            *((body.regions, body.supports, body.pivot) for body in (case.punch, case.strip)),
        )
        for case in (one, other)
    ]
    return parts[0] == parts[1]
