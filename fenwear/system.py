"""The assembled problem: set up once, then solved for many loads, frictions, wear laws and motions."""

from __future__ import annotations

from functools import cached_property

from mpi4py import MPI

from fenwear.case import Body, Case
from fenwear.contact import CondensedContact, ContactSolver
from fenwear.contact_full import FullContact
from fenwear.elasticity import ElasticBody
from fenwear.inequality import Mask
from fenwear.interface import Facing, Interface, Statics, face, join, statics
from fenwear.mesh import BodyMesh, build_meshes
from fenwear.motion import Motion, make_motion
from fenwear.optimum import Optimum, check_equilibrium, optimum
from fenwear.surface import condense, surface_nodes
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
        for direction in self.motion.directions:
            check_equilibrium(self.statics, direction, case.contact.friction)

    def _body(self, mesh: BodyMesh, description: Body) -> ElasticBody:
        return ElasticBody(mesh, description, self.case.materials, self.case.model, self.case.geometry.degree)

    @cached_property
    def facing(self) -> Facing:
        """The contact nodes of the two bodies, opposite each other."""
        return face(surface_nodes(self.punch), surface_nodes(self.strip))

    @cached_property
    def interface(self) -> Interface:
        """The condensed interface: factors both bodies."""
        surfaces = (condense(self.punch, self.facing.punch), condense(self.strip, self.facing.strip))
        return join(self.statics, *surfaces)

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
