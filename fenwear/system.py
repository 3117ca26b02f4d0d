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
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.mesh import BodyMesh, build_meshes
from fenwear.bodies.shape import element_height, follow_wear
from fenwear.bodies.surface import Surface, condense, respond_to_load, surface_nodes
from fenwear.case import Body, Case, Heat, Load, OneWay, changed_case
from fenwear.contact import CondensedContact, ContactSolver, Sliding
from fenwear.contact.full import FullContact
from fenwear.errors import CaseError, Problem
from fenwear.heat.conduction import HeatBody
from fenwear.heat.exchange import HeatExchange
from fenwear.heat.prepare import prepare_exchange, prepare_steady
from fenwear.interface import Facing, Interface, Statics, check_distance, face, join, statics
from fenwear.optimum import Optimum, check_equilibrium, optimum
from fenwear.remedies import Remedies
from fenwear.sliding.friction import ContactConditions, Friction
from fenwear.sliding.motion import Motion, make_motion
from fenwear.sliding.wear import PhasesWear, Wear, Worn


class System:
    """Two bodies in contact, ready to be solved.

    What is costly (stiffness factors, condensation) is made at first use and kept. All members are
    collective at first use: every rank must reach them.
    """

    def __init__(self, case: Case, comm: MPI.Comm = MPI.COMM_WORLD, followed: Worn | None = None) -> None:
        """Build the meshes and the bodies of `case`; collective.

        Args:
            case: The problem.
            comm: The ranks.
            followed: Worn depths that the meshes follow; by default they are as they were made.

        Raises:
            CaseError: what only the geometry can tell is wrong, such as a missing group.
            MeshQualityError: an element does not survive the motion.
        """
        self.case, self.comm, self.followed = case, comm, followed
        self.remedies = Remedies()
        self._parts = 1  # into which each phase of the motion is cut
        meshes = build_meshes(case.geometry, case.folder, comm)
        self.moved: Worn | None = None if followed is None else self._move(meshes, followed)
        self.punch, self.strip = (self._body(m, d) for m, d in zip(meshes, (case.punch, case.strip), strict=True))
        self.statics: Statics = statics(self.facing, self.punch, self.strip)
        self.heat_bodies  # noqa: B018  (finds missing groups before anything costly)
        self._check_equilibrium()

    def _move(self, meshes: tuple[BodyMesh, BodyMesh], followed: Worn) -> Worn:
        """Let the meshes follow the wear; return how far their contact nodes have moved into the bodies."""
        moved, degree = [], self.case.geometry.degree
        for mesh, depth, description in zip(
            meshes, (followed.punch, followed.strip), (self.case.punch, self.case.strip), strict=True
        ):
            pins = [np.array(support.at) for support in description.supports if support.at is not None]
            groups = [point for points in mesh.points.values() for point in points]
            moved.append(follow_wear(mesh, depth, degree, [*pins, *groups]))
        return Worn(moved[0], moved[1])

    def outworn(self, worn: Worn) -> bool:
        """Return whether the wear since the meshes were moved is large against the elements at the contact."""
        limit = self.case.geometry.follow_wear
        if limit is None:
            return False
        rest = worn if self.followed is None else worn - self.followed
        heights = self.element_heights.times(limit)
        return bool((np.abs(rest.punch) > heights.punch).any() or (np.abs(rest.strip) > heights.strip).any())

    @cached_property
    def element_heights(self) -> Worn:
        """Height of the elements at the contact nodes of both bodies, mm."""
        degree = self.case.geometry.degree
        return Worn(element_height(self.punch.body, degree), element_height(self.strip.body, degree))

    def _check_equilibrium(self) -> None:
        for phase, one, slip in zip(self.motion.phases, self._phase_statics, self.slips(), strict=True):
            check_equilibrium(one, phase.direction, slip)

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

    def in_parts(self, parts: int) -> System:
        """Return the system with each phase of the motion cut into parts of equal time; collective."""
        return self._changed(self.case, parts)

    def with_case(self, case: Case) -> System:
        """Return the system of another case, as `vary`; collective."""
        if not _same_bodies(self.case, case):
            return System(case, self.comm, self.followed)
        return self._changed(case, 1)

    def _changed(self, case: Case, parts: int) -> System:
        self.prepare()  # what is not made yet would be made anew in every variant
        other = copy.copy(self)
        kept = {"facing", "punch", "strip", "statics", "comm"}
        for name in [n for n, member in vars(System).items() if isinstance(member, cached_property) and n not in kept]:
            other.__dict__.pop(name, None)
        other.case, other._parts = case, parts
        other._share_elasticity(self)
        other._share_heat(self)
        other._check_equilibrium()
        return other

    def _share_elasticity(self, base: System) -> None:
        surfaces = base.__dict__.get("_surfaces")
        if self.case.punch.loads != base.case.punch.loads or self.case.strip.loads != base.case.strip.loads:
            self.punch, self.strip = base._loaded(
                [load.mean() for load in self.case.punch.loads],
                [load.mean() for load in self.case.strip.loads],
                self.case.model.thickness,
            )
            self.statics = replace(base.statics, resultant=_resultant(self.punch, self.strip))
            if surfaces is not None:
                surfaces = _under_load(surfaces, self.punch, self.strip)
        if surfaces is not None:
            self.__dict__["_surfaces"] = surfaces

    def _loaded(
        self, punch: Sequence[Load], strip: Sequence[Load], thickness: float
    ) -> tuple[ElasticBody, ElasticBody]:
        """Return both bodies under other loads."""
        return self.punch.with_loads(punch, thickness), self.strip.with_loads(strip, thickness)

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
        if self.motion == base.motion:
            for name in ("exchange", "reduced_exchange"):
                exchange = base.__dict__.get(name)
                if exchange is not None:
                    self.__dict__[name] = exchange.varied(
                        heat, np.tile(self._nominal_friction, (len(self.motion.phases), 1))
                    )

    def _body(self, mesh: BodyMesh, description: Body) -> ElasticBody:
        at_mean = description.model_copy(update={"loads": tuple(load.mean() for load in description.loads)})
        return ElasticBody(mesh, at_mean, self.case.materials, self.case.model, self.case.geometry.degree)

    @cached_property
    def facing(self) -> Facing:
        """The contact nodes of the two bodies, opposite each other in the middle position of the strip."""
        facing = face(surface_nodes(self.punch), surface_nodes(self.strip))
        if self.followed is None:
            check_distance(facing)
        return facing

    @cached_property
    def interface(self) -> Interface:
        """The condensed interface in the middle position, under the mean loads: factors both bodies."""
        return join(self.statics, *self._surfaces)

    @cached_property
    def facings(self) -> tuple[Facing, ...]:
        """The contact nodes of the two bodies in each phase of the motion.

        Without heat the strip moves as a whole. With heat it is described in the punch's frame, where its
        material moves: then only its worn depth changes place.
        """
        offsets = [phase.offset for phase in self.motion.phases]
        whole = self.case.heat is None
        moved = {offset: self.facing.moved(offset, whole=whole) for offset in sorted(set(offsets))}
        return tuple(moved[offset] for offset in offsets)

    @cached_property
    def phase_bodies(self) -> tuple[tuple[ElasticBody, ElasticBody], ...]:
        """Both bodies under the loads of each phase."""
        case = self.case
        fractions = [phase.fraction for phase in self.motion.phases]
        if all(load.over_cycle is None for body in (case.punch, case.strip) for load in body.loads):
            return ((self.punch, self.strip),) * len(fractions)
        return tuple(
            self._loaded(
                [load.at(f) for load in case.punch.loads],
                [load.at(f) for load in case.strip.loads],
                case.model.thickness,
            )
            for f in fractions
        )

    @cached_property
    def _phase_statics(self) -> tuple[Statics, ...]:
        return tuple(
            self.statics if facing is self.facing and bodies == (self.punch, self.strip) else statics(facing, *bodies)
            for facing, bodies in zip(self.facings, self.phase_bodies, strict=True)
        )

    @cached_property
    def interfaces(self) -> tuple[Interface, ...]:
        """The condensed interface of each phase of the motion."""
        made: dict[tuple[int, int], Interface] = {(id(self.statics), id(self.punch)): self.interface}
        found = []
        for one, bodies in zip(self._phase_statics, self.phase_bodies, strict=True):
            key = (id(one), id(bodies[0]))
            if key not in made:
                surfaces = self._surfaces
                if bodies != (self.punch, self.strip):
                    surfaces = _under_load(surfaces, *bodies)
                made[key] = join(one, *surfaces)
            found.append(made[key])
        return tuple(found)

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
        return prepare_exchange(
            self.case, self.heat_bodies, self.facing, rows, self.motion, self._nominal_friction, reduced=reduced
        )

    def steady_exchange(self, velocities: Sequence[float]) -> HeatExchange:
        """Return the exchange whose phases are steady states at these velocities of the strip; collective.

        Raises:
            CaseError: the case has no heat, or a body no heat sink.
        """
        if self.heat_bodies is None:
            raise CaseError(Problem("heat", "missing, but required here"))
        rows = self._gap_rows()
        return prepare_steady(self.case, self.heat_bodies, self.facing, rows, velocities, self._nominal_friction)

    def prepare(self) -> None:
        """Make all that is costly now: the condensation and, with heat, the steps of the motion; collective."""
        self.interfaces  # noqa: B018
        self.exchange  # noqa: B018

    @cached_property
    def motion(self) -> Motion:
        """The sliding motion."""
        return make_motion(self.case.motion, strip_wears=self.case.wear.strip is not None).in_parts(self._parts)

    @cached_property
    def friction(self) -> Friction:
        """The law of friction."""
        return Friction(self.case.contact, self.case.motion.axis)

    @cached_property
    def wear(self) -> Wear:
        """The wear rule of both bodies over the phases of the motion."""
        laws = (self.case.wear.punch, self.case.wear.strip)
        sliding = [self.motion.sliding(1.0 if law is None else law.speed_exponent) for law in laws]
        track = self.case.motion.track if isinstance(self.case.motion, OneWay) else None
        return Wear(*laws, (sliding[0], sliding[1]), self.facings, self.friction, track)

    def check_touching(self) -> None:
        """Make sure that the surfaces touch in some phase; collective.

        Raises:
            CaseError: they never meet: no pressure, no wear, nothing to follow.
            ConvergenceError: the contact of a phase did not converge.
        """
        gaps = []
        for phase in range(len(self.motion.phases)):
            contact = self.phase_contact((phase,)).solve(self.gap(phase, self.unworn()))
            if contact.pressure.max() > 0:
                return
            gaps.append(float(contact.gap.min()))
        raise CaseError(
            Problem(
                "geometry",
                f"the surfaces never meet within the stroke: under load they stay {min(gaps):.3g} mm apart; "
                "expected a punch that its supports let come down, or that starts in contact",
            )
        )

    @property
    def position_spacing(self) -> float:
        """Largest distance between neighbouring positions of the strip over that between contact nodes; 0 for one."""
        offsets = np.unique([phase.offset for phase in self.motion.phases])
        return float(np.diff(offsets).max(initial=0.0) / np.median(np.diff(self.facing.x)))

    @property
    def track_deepens(self) -> bool:
        """Whether the strip wears to and fro under the punch, so that no shape of its track stays."""
        motion = self.case.motion
        return self.case.wear.strip is not None and motion.axis == "x" and not isinstance(motion, OneWay)

    @property
    def constant_coefficients(self) -> bool:
        """Whether friction and wear are the same at any temperature, pressure and speed."""
        return self.friction.constant and self.wear.constant

    def gap(self, phase: int, worn: Worn) -> Array:
        """Return the gap of the unloaded, worn bodies in a phase (n,), mm."""
        facing = self.facings[phase]
        if self.moved is not None:
            worn = worn - self.moved
            return facing.initial_gap + facing.opening(worn.punch, worn.strip)
        if self.case.wear.strip is None:
            return facing.initial_gap + worn.punch
        return facing.initial_gap + facing.opening(worn.punch, worn.strip)

    def unworn(self) -> Worn:
        """Return the worn depths at the start: none."""
        return Worn(np.zeros(len(self.facing.punch.weights)), np.zeros(len(self.facing.strip.weights)))

    def conditions(
        self, phase: int, pressure: Array | None = None, temperatures: tuple[Array, Array] | None = None
    ) -> ContactConditions:
        """Return what coefficients depend on in a phase.

        Args:
            phase: Its number.
            pressure: (n,), MPa; by default the mean pressure.
            temperatures: Of the punch's and the strip's surface (n,), K; by default the initial one.
        """
        n = len(self.facing.weights)
        initial = np.full(n, 0.0 if self.case.heat is None else self.case.heat.initial)
        return ContactConditions(
            np.full(n, self.statics.mean_pressure) if pressure is None else pressure,
            self.motion.phases[phase].speed,
            (initial, initial) if temperatures is None else temperatures,
        )

    @cached_property
    def mode_lengths(self) -> Array:
        """Largest displacement along e_n of each rigid mode for a unit velocity (modes,): 1, and mm for a rotation."""
        return np.abs(self.statics.rigid_normal).max(axis=0, initial=1e-300)

    def slips(self, conditions: Sequence[ContactConditions] | None = None) -> list[Array]:
        """Return tau = d mu of each phase (n,), the traction on the punch along e_t over the pressure.

        Args:
            conditions: Of each phase, for friction that depends on them; by default at the mean pressure.

        Raises:
            CaseError: the friction coefficient is negative or not finite there.
        """
        phases = self.motion.phases
        states = [self.conditions(k) for k in range(len(phases))] if conditions is None else conditions
        return [
            self.friction.slip(phase.direction, self.friction.values(state))
            for phase, state in zip(phases, states, strict=True)
        ]

    @cached_property
    def phases_wear(self) -> PhasesWear:
        """The wear of all phases at the mean pressure and the initial temperature."""
        return self.wear.phases([self.conditions(k) for k in range(len(self.motion.phases))])

    @cached_property
    def _nominal_friction(self) -> Array:
        return self.friction.values(self.conditions(0))

    def contact(self, directions: tuple[int, ...]) -> ContactSolver:
        """Return the contact in the middle position under the mean loads, by the solver that the case names.

        Args:
            directions: Sliding direction d of each phase that is solved for.
        """
        return self._contact([Sliding(self.interface, self.slip(d)) for d in directions])

    def slip(self, direction: int) -> Array:
        """Return tau = d mu (n,) at the mean pressure."""
        return self.friction.slip(direction, self._nominal_friction)

    def phase_contact(self, phases: Sequence[int]) -> ContactSolver:
        """Return the contact of phases of the motion, given by their numbers, by the solver that the case names."""
        slips = self.slips()
        return self._contact([Sliding(self.interfaces[k], slips[k]) for k in phases])

    def _contact(self, phases: list[Sliding]) -> ContactSolver:
        if self.case.contact.solver == "full":
            return FullContact(self.punch, self.strip, phases[0].interface, phases[0].slip)
        return CondensedContact(phases, self.remedies)

    def optimum(self, direction: int, zone: Mask | None = None) -> Optimum:
        """Return the optimal pressure and wear velocity of one-way sliding at the mean wear rate.

        K is the sum over both bodies of the mean of beta~ v^a (the punch's alone where their pressure
        exponents differ), at the mean pressure. On a closed track the strip recedes evenly instead.

        Args:
            direction: Sliding direction d.
            zone: Nodes in contact (n,) bool; by default all.
        """
        case, wear = self.case, self.phases_wear
        laws = [law for law in (case.wear.punch, case.wear.strip) if law is not None]
        exponent = laws[0].pressure_exponent
        bodies = [body for body in (wear.punch, wear.strip) if body is not None and body.exponent == exponent]
        on_track = wear.track is not None and wear.punch is not None
        rates = [float(body.rate.mean(axis=1).sum()) / self.motion.period for body in bodies]
        found = optimum(self.statics, self.slip(direction), rates[0] if on_track else sum(rates), exponent, zone)
        if on_track and wear.strip is not None and "lambda_F" in found.velocity:
            depth = wear.worn(np.tile(found.pressure, (len(self.motion.phases), 1))).strip.mean()
            velocity = {**found.velocity, "lambda_F": found.velocity["lambda_F"] + depth / self.motion.period}
            return replace(found, velocity=velocity)
        return found


def _resultant(punch: ElasticBody, strip: ElasticBody) -> Array:
    return np.concatenate([punch.rigid_resultant, strip.rigid_resultant])


def _under_load(surfaces: tuple[Surface, Surface], punch: ElasticBody, strip: ElasticBody) -> tuple[Surface, Surface]:
    """Return condensed bodies with their loads' displacements anew; collective."""
    first, second = (
        replace(surface, normal_by_load=respond_to_load(elastic, surface.nodes))
        for surface, elastic in zip(surfaces, (punch, strip), strict=True)
    )
    return first, second


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
