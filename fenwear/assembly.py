"""The whole way from a case to bodies that are ready to slide, step by step.

    bodies   = build_bodies(case)              meshes, stiffness, supports, loads, conduction
    sliding  = make_sliding(case)              motion, sliding field, friction, wear laws
    placed   = place(bodies, sliding)          surfaces opposite each other in every phase, in equilibrium
    system   = elastic(placed)                 both bodies condensed and joined in every phase
    system   = with_exchange(system)           heat: the steps of the motion, prepared

`assemble` takes all of them. Each step returns plain data and is collective: every rank takes it.
`vary` takes again what a changed case makes necessary and keeps the rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc
from scipy.sparse import csr_array

from fenwear.arrays import Array, Mask
from fenwear.bodies.condensation import CondensedBody, condense, respond_to_load
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.material import isotropic
from fenwear.bodies.mesh import BodyMesh, build_meshes
from fenwear.bodies.shape import element_height, follow_wear
from fenwear.case import Body, Case, Heat, OneWay, Oscillation, Rotation, WearLaw, changed_case
from fenwear.contact import CondensedContact, ContactSolver, SlidingContact
from fenwear.contact.full import FullContact
from fenwear.errors import CaseError, Problem
from fenwear.heat.conduction import HeatBody
from fenwear.heat.exchange import HeatExchange
from fenwear.heat.prepare import prepare_exchange, prepare_steady
from fenwear.interface import (
    ContactPair,
    Interface,
    RigidEquilibrium,
    check_distance,
    join,
    pair,
    pass_material,
    rigid_equilibrium,
)
from fenwear.interface.placement import in_model, in_space
from fenwear.optimum import Optimum, check_equilibrium, optimum
from fenwear.remedies import Remedies
from fenwear.sliding.field import ALONG_X, ALONG_Y, SlidingField
from fenwear.sliding.friction import ContactConditions, Friction
from fenwear.sliding.motion import Motion, make_motion
from fenwear.sliding.wear import PhasesWear, Wear, Worn

Preparation = Literal["as set", "reduced", "none"]  # of the heat
ROUNDING = 1e-12  # of unit normals: frames that differ by less are the same
OUT_OF_SURFACE = 1e-2  # sine between the sliding of a strip that turns in place and its surface, as it is meshed

# ------------------------------------------------------------------------------ the bodies


@dataclass(frozen=True)
class Bodies:
    """Both bodies on their meshes, under the mean of their loads.

    Attributes:
        punch, strip: Elasticity.
        heat: Conduction in both; None without heat.
        followed: Worn depths that the meshes follow; None where they are as they were made.
        moved: How far the contact nodes have moved for it.
    """

    punch: ElasticBody
    strip: ElasticBody
    heat: tuple[HeatBody, HeatBody] | None = None
    followed: Worn | None = None
    moved: Worn | None = None

    @property
    def comm(self) -> MPI.Comm:
        """The ranks."""
        return self.punch.body.mesh.comm

    @property
    def unknowns(self) -> int:
        """Number of degrees of freedom of both displacements."""
        return self.punch.stiffness.size[0] + self.strip.stiffness.size[0]

    def under(self, case: Case, fraction: float | None = None) -> Bodies:
        """Return the bodies under the loads of a case at a fraction of the cycle, or their mean; collective."""
        punch, strip = (
            body.with_loads([load.mean() if fraction is None else load.at(fraction) for load in description.loads])
            for body, description in ((self.punch, case.punch), (self.strip, case.strip))
        )
        return replace(self, punch=punch, strip=strip)


def build_bodies(case: Case, comm: MPI.Comm = MPI.COMM_WORLD, followed: Worn | None = None) -> Bodies:
    """Mesh both bodies and assemble them; collective.

    Args:
        case: The problem.
        comm: The ranks.
        followed: Worn depths that the meshes follow; by default they are as they were made.

    Raises:
        CaseError: what only the geometry can tell is wrong, such as a missing group.
        MeshQualityError: an element does not survive the motion.
    """
    meshes = build_meshes(case.geometry, case.folder, comm, case.model.law)
    moved = None if followed is None else _moved(case, meshes, followed)
    punch, strip = (elastic_body(case, m, d) for m, d in zip(meshes, (case.punch, case.strip), strict=True))
    return Bodies(punch, strip, build_conduction(case, punch, strip), followed, moved)


def build_conduction(case: Case, punch: ElasticBody, strip: ElasticBody) -> tuple[HeatBody, HeatBody] | None:
    """Prepare conduction in both bodies; None for a case without heat; collective."""
    if case.heat is None:
        return None
    of_punch, of_strip = (
        HeatBody(elastic.body, description, case.materials, case.model, case.heat, case.geometry.degree)
        for elastic, description in ((punch, case.punch), (strip, case.strip))
    )
    return of_punch, of_strip


def elastic_body(case: Case, mesh: BodyMesh, description: Body) -> ElasticBody:
    """Assemble the elasticity of one body of a case under the mean of its loads; collective."""
    law = isotropic(mesh, description.regions, case.materials, case.model.law)
    at_mean = description.model_copy(update={"loads": tuple(load.mean() for load in description.loads)})
    return ElasticBody(mesh, at_mean, law, case.geometry.degree, case.model.thickness)


def _moved(case: Case, meshes: tuple[BodyMesh, BodyMesh], followed: Worn) -> Worn:
    """Let the meshes follow the wear; return how far their contact nodes have moved into the bodies."""
    moved = []
    for mesh, depth, description in zip(
        meshes, (followed.punch, followed.strip), (case.punch, case.strip), strict=True
    ):
        pins = [np.array(support.at) for support in description.supports if support.at is not None]
        groups = [point for points in mesh.points.values() for point in points]
        moved.append(follow_wear(mesh, depth, case.geometry.degree, [*pins, *groups]))
    return Worn(moved[0], moved[1])


# ----------------------------------------------------------------------------- the sliding


@dataclass(frozen=True)
class Sliding:
    """How the counter-body slides, and what that does to both surfaces.

    Attributes:
        motion: The phases of a cycle.
        field: The velocity of the counter-body over the contact.
        friction: The law of friction.
        wear: The wear laws of punch and strip; None where a body does not wear.
        track: Length of the closed track that the strip runs on, mm; None for its own nodes.
        to_and_fro: Whether the strip's worn track passes to and fro under the punch.
    """

    motion: Motion
    field: SlidingField
    friction: Friction
    wear: tuple[WearLaw | None, WearLaw | None]
    track: float | None = None
    to_and_fro: bool = False


def make_sliding(case: Case, parts: int = 1) -> Sliding:
    """Return the sliding of a case, with each phase of the motion cut into `parts` of equal time."""
    motion = make_motion(case.motion, strip_wears=case.wear.strip is not None and case.passes).in_parts(parts)
    sliding_field = _sliding_field(case)
    one_way = isinstance(case.motion, OneWay | Rotation)
    return Sliding(
        motion,
        sliding_field,
        Friction(case.contact, sliding_field),
        (case.wear.punch, case.wear.strip),
        case.motion.track if isinstance(case.motion, OneWay) else None,
        case.passes and not one_way,
    )


def _sliding_field(case: Case) -> SlidingField:
    motion = case.motion
    if isinstance(motion, Oscillation | Rotation):
        return SlidingField(turn=_unit(motion.axis), centre=motion.centre)
    if motion.along is not None:
        return SlidingField(shift=_unit(motion.along))
    return ALONG_X if motion.axis == "x" else ALONG_Y


def _unit(vector: tuple[float, float, float]) -> tuple[float, float, float]:
    x, y, z = (np.array(vector) / np.linalg.norm(vector)).tolist()
    return x, y, z


# ---------------------------------------------------------------------------- the surfaces


@dataclass(frozen=True, kw_only=True)
class Placed:
    """Both bodies opposite each other in every phase, in equilibrium; nothing elastic in it.

    Attributes:
        bodies: Under the mean loads.
        sliding: Motion, friction and wear.
        heat: Settings of the heat between the bodies; None without.
        solver: Of the contact: "condensed", or "full" for the reference on both bodies' meshes.
        made_from: The case; None where it was made in Python.
        loaded: The bodies under the loads of each phase.
        rigids: Equilibrium of the rigid modes in each phase, with its pair of surfaces.
        rigid: The same in the middle position under the mean loads.
        remedies: What had to be solved in another way.
    """

    bodies: Bodies
    sliding: Sliding
    heat: Heat | None
    solver: str
    made_from: Case | None
    loaded: tuple[Bodies, ...]
    rigids: tuple[RigidEquilibrium, ...]
    rigid: RigidEquilibrium
    remedies: Remedies = field(default_factory=Remedies)

    @property
    def comm(self) -> MPI.Comm:
        """The ranks."""
        return self.bodies.comm

    @property
    def case(self) -> Case:
        """The case that it was made from.

        Raises:
            CaseError: it was made in Python, without one.
        """
        if self.made_from is None:
            raise CaseError(Problem("", "expected bodies made from a case: those made in Python have none"))
        return self.made_from

    @property
    def motion(self) -> Motion:
        """The phases of a cycle."""
        return self.sliding.motion

    @property
    def friction(self) -> Friction:
        """The law of friction."""
        return self.sliding.friction

    @property
    def pair(self) -> ContactPair:
        """The surfaces in the middle position of the strip."""
        return self.rigid.pair

    @cached_property
    def pairs(self) -> tuple[ContactPair, ...]:
        """The surfaces opposite each other in each phase."""
        return tuple(rigid.pair for rigid in self.rigids)

    @property
    def strip_wears(self) -> bool:
        """Whether the strip has a wear law."""
        return self.sliding.wear[1] is not None

    @cached_property
    def wear(self) -> Wear:
        """The wear rule of both bodies over the phases of the motion."""
        rate = self.sliding.field.rate(self.pair.punch.x)
        slid = []
        for law in self.sliding.wear:
            exponent = 1.0 if law is None else law.speed_exponent
            slid.append(self.motion.sliding(exponent)[:, None] * rate**exponent)
        return Wear(*self.sliding.wear, (slid[0], slid[1]), self.pairs, self.friction, self.sliding.track)

    @property
    def position_spacing(self) -> float:
        """Largest distance between neighbouring positions of the strip over that between contact nodes; 0 for one."""
        offsets = np.unique([phase.offset for phase in self.motion.phases])
        return float(np.diff(offsets).max(initial=0.0) / np.median(np.diff(self.pair.x)))

    @property
    def track_deepens(self) -> bool:
        """Whether the strip wears to and fro under the punch, so that no shape of its track stays."""
        return self.strip_wears and self.sliding.to_and_fro

    @property
    def constant_coefficients(self) -> bool:
        """Whether friction and wear are the same at any temperature, pressure and speed."""
        return self.friction.constant and self.wear.constant

    @cached_property
    def mode_lengths(self) -> Array:
        """Largest displacement along e_n of each rigid mode for a unit velocity (modes,): 1, and mm for a rotation."""
        return np.abs(self.rigid.rigid_normal).max(axis=0, initial=1e-300)

    def gap(self, phase: int, worn: Worn) -> Array:
        """Return the gap of the unloaded, worn bodies in a phase (n,), mm."""
        pair = self.pairs[phase]
        if self.bodies.moved is not None:
            worn = worn - self.bodies.moved
        elif not self.strip_wears:
            return pair.initial_gap + worn.punch
        return pair.initial_gap + pair.opening(worn.punch, worn.strip)

    def unworn(self) -> Worn:
        """Return the worn depths at the start: none."""
        return Worn(np.zeros(len(self.pair.punch.weights)), np.zeros(len(self.pair.strip.weights)))

    def outworn(self, worn: Worn) -> bool:
        """Return whether the wear since the meshes were moved is large against the elements at the contact."""
        limit = None if self.made_from is None else self.made_from.geometry.follow_wear
        if limit is None:
            return False
        followed = self.bodies.followed
        rest = worn if followed is None else worn - followed
        heights = self.element_heights
        return bool(
            (np.abs(rest.punch) > limit * heights.punch).any() or (np.abs(rest.strip) > limit * heights.strip).any()
        )

    @cached_property
    def element_heights(self) -> Worn:
        """Height of the elements at the contact nodes of both bodies, mm."""
        return Worn(element_height(self.bodies.punch), element_height(self.bodies.strip))

    def conditions(
        self, phase: int, pressure: Array | None = None, temperatures: tuple[Array, Array] | None = None
    ) -> ContactConditions:
        """Return what coefficients depend on in a phase.

        Args:
            phase: Its number.
            pressure: (n,), MPa; by default the mean pressure.
            temperatures: Of the punch's and the strip's surface (n,), K; by default the initial one.
        """
        n = len(self.pair.weights)
        initial = np.full(n, 0.0 if self.heat is None else self.heat.initial)
        return ContactConditions(
            np.full(n, self.rigid.mean_pressure) if pressure is None else pressure,
            self.motion.phases[phase].speed * self.sliding.field.rate(self.pair.punch.x),
            (initial, initial) if temperatures is None else temperatures,
        )

    def friction_ratio(self, direction: int) -> Array:
        """Return tau (n, d) in the middle position at the mean pressure.

        Args:
            direction: d, the sign of the sliding.
        """
        mu = self.friction.values(self.conditions(0))
        return in_model(self.friction.ratio(direction, mu, self.pair), self.pair.punch.dim)

    def phase_friction(self, phase: int, mu: Array) -> Array:
        """Return tau of a phase (n, d), the traction of friction on the punch over the pressure, for mu (n,)."""
        pair = self.pairs[phase]
        return in_model(self.friction.ratio(self.motion.phases[phase].direction, mu, pair), pair.punch.dim)

    def friction_ratios(self, conditions: Sequence[ContactConditions] | None = None) -> list[Array]:
        """Return tau of each phase (n, d), the traction of friction on the punch over the pressure.

        Args:
            conditions: Of each phase, for friction that depends on them; by default at the mean pressure.

        Raises:
            CaseError: the friction coefficient is negative or not finite there.
        """
        states = [self.conditions(k) for k in range(len(self.pairs))] if conditions is None else conditions
        return [self.phase_friction(k, self.friction.values(state)) for k, state in enumerate(states)]

    @cached_property
    def phases_wear(self) -> PhasesWear:
        """The wear of all phases at the mean pressure and the initial temperature."""
        return self.wear.phases([self.conditions(k) for k in range(len(self.motion.phases))])

    def optimum(self, direction: int, zone: Mask | None = None) -> Optimum:
        """Return the optimal pressure and wear velocity of one-way sliding at the mean wear rate.

        K is the sum over both bodies of the mean of beta~ v^a (the punch's alone where their pressure
        exponents differ), at the mean pressure. On a closed track the strip recedes evenly instead.

        Args:
            direction: Sliding direction d.
            zone: Nodes in contact (n,) bool; by default all.

        Raises:
            CaseError: a node of the contact lies on the axis of rotation.
        """
        slides = self.sliding.field.rate(self.pair.punch.x)
        if not (slides > ROUNDING * slides.max()).all():
            message = "lies within the contact: nothing slides there, so that no pressure wears it evenly"
            raise CaseError(Problem("motion.centre", message))
        wear = self.phases_wear
        laws = [law for law in self.sliding.wear if law is not None]
        exponent = laws[0].pressure_exponent
        bodies = [body for body in (wear.punch, wear.strip) if body is not None and body.exponent == exponent]
        on_track = wear.track is not None and wear.punch is not None
        rates = [body.rate.sum(axis=0) / self.motion.period for body in bodies]
        rate = rates[0] if on_track else np.sum(rates, axis=0)
        found = optimum(self.rigid, self.friction_ratio(direction), rate, exponent, zone)
        if on_track and wear.strip is not None and "lambda_F" in found.velocity:
            depth = wear.worn(np.tile(found.pressure, (len(self.motion.phases), 1))).strip.mean()
            velocity = {**found.velocity, "lambda_F": found.velocity["lambda_F"] + depth / self.motion.period}
            return replace(found, velocity=velocity)
        return found


def place(
    bodies: Bodies, sliding: Sliding, heat: Heat | None = None, *, solver: str = "condensed", case: Case | None = None
) -> Placed:
    """Bring the surfaces opposite each other in every phase of the motion; collective.

    Without heat the strip moves as a whole. With heat it is described in the punch's frame, where its
    material moves: then only its worn depth changes place.

    Args:
        bodies: Both bodies.
        sliding: Motion, friction and wear.
        heat: Settings of the heat between the bodies.
        solver: Of the contact, "condensed" or "full".
        case: What they were made from: it gives the loads of each phase, and whether meshes follow the wear.

    Raises:
        CaseError: the surfaces do not face each other, or no pressure balances the loads.
    """
    rings = bodies.punch.law.kind == "axisymmetric"
    middle = pair(bodies.punch.surface, bodies.strip.surface, axisymmetric=rings)
    if bodies.followed is None:
        check_distance(middle)
    _check_axis(middle, sliding)
    whole = heat is None
    pairs = {
        offset: pair(middle.punch, middle.strip, moved) if whole else pass_material(middle, moved)
        for offset in sorted({phase.offset for phase in sliding.motion.phases} - {0.0})
        for moved in [sliding.field.placement(offset)]
    }
    pairs[0.0] = middle
    loaded = _loaded(bodies, sliding.motion, case)
    rigid = rigid_equilibrium(middle, bodies.punch, bodies.strip)
    rigids: list[RigidEquilibrium] = []
    for phase, own in zip(sliding.motion.phases, loaded, strict=True):
        if phase.offset == 0.0 and own is bodies:
            rigids.append(rigid)
        else:
            rigids.append(rigid_equilibrium(pairs[phase.offset], own.punch, own.strip))
    placed = Placed(
        bodies=bodies,
        sliding=sliding,
        heat=heat,
        solver=solver,
        made_from=case,
        loaded=loaded,
        rigids=tuple(rigids),
        rigid=rigid,
    )
    for phase, one, ratio in zip(sliding.motion.phases, rigids, placed.friction_ratios(), strict=True):
        check_equilibrium(one, phase.direction, ratio)
    return placed


def _check_axis(middle: ContactPair, sliding: Sliding) -> None:
    """Raise where a strip that turns in place is no body of revolution about the axis."""
    if not any(sliding.field.turn) or sliding.motion.reach > 0:
        return
    velocity, normal = sliding.field.velocity(middle.punch.x), in_space(middle.normal)
    out = np.abs(np.einsum("ic,ic->i", velocity, normal)).max()
    if out > OUT_OF_SURFACE * np.linalg.norm(velocity, axis=1).max():
        raise CaseError(
            Problem(
                "motion.axis", "the strip's contact surface is none of revolution about it: it would not stay there"
            )
        )


def _loaded(bodies: Bodies, motion: Motion, case: Case | None) -> tuple[Bodies, ...]:
    """Return the bodies under the loads of each phase; collective."""
    loads = [] if case is None else [*case.punch.loads, *case.strip.loads]
    if case is None or all(load.over_cycle is None for load in loads):
        return (bodies,) * len(motion.phases)
    return tuple(bodies.under(case, phase.fraction) for phase in motion.phases)


# -------------------------------------------------------------------------- the elasticity


@dataclass(frozen=True)
class Condensed:
    """Both bodies condensed onto the contact.

    Attributes:
        punch: Onto the contact nodes.
        strip: Onto its own trace nodes where it moves as a whole, else onto the contact nodes opposite.
        strip_moves: Which of the two.
    """

    punch: CondensedBody
    strip: CondensedBody
    strip_moves: bool

    def under_loads(self, bodies: Bodies) -> Condensed:
        """Return the same under the loads of these bodies; collective."""
        punch, strip = (
            replace(condensed, by_load=respond_to_load(elastic, condensed.patterns))
            for condensed, elastic in ((self.punch, bodies.punch), (self.strip, bodies.strip))
        )
        return replace(self, punch=punch, strip=strip)


@dataclass(frozen=True, kw_only=True)
class Tribosystem(Placed):
    """Punch and strip, condensed and joined in every phase of the motion: ready for contact, wear and cycles.

    Attributes:
        condensed: Both bodies' answers to forces on the contact.
        interface: The condensed interface in the middle position, under the mean loads.
        interfaces: The same in each phase.
        exchange: The bodies' temperatures over the phases; None without heat, or where it was not asked for.
    """

    condensed: Condensed
    interface: Interface
    interfaces: tuple[Interface, ...]
    exchange: HeatExchange | None = None

    def contact(self, directions: Sequence[int]) -> ContactSolver:
        """Return the contact in the middle position under the mean loads.

        Args:
            directions: Sliding direction d of each phase that is solved for.
        """
        return self._contact([SlidingContact(self.interface, self.friction_ratio(d)) for d in directions])

    def phase_contact(self, phases: Sequence[int]) -> ContactSolver:
        """Return the contact of phases of the motion, given by their numbers."""
        ratios = self.friction_ratios()
        return self._contact([SlidingContact(self.interfaces[k], ratios[k]) for k in phases])

    def _contact(self, phases: list[SlidingContact]) -> ContactSolver:
        if self.solver == "full":
            return FullContact(self.bodies.punch, self.bodies.strip, phases[0].interface, phases[0].friction_ratio)
        return CondensedContact(phases, self.remedies)

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

    def vary(self, *settings: str) -> Tribosystem:
        """Return the system of a changed case that shares all operators which the change leaves; collective.

        Args:
            settings: Overrides `key.path=value`, as on the command line.

        Raises:
            CaseError: an override does not fit, or the punch would tip over.
        """
        return vary(self, changed_case(self.case, *settings))


def elastic(placed: Placed) -> Tribosystem:
    """Condense both bodies and join them in every phase: factors both stiffnesses; collective."""
    condensed = _condense(placed)
    return _joined(placed, condensed)


def _condense(placed: Placed) -> Condensed:
    bodies, middle = placed.bodies, placed.pair
    couplings: list[PETSc.Mat | None] = [None, None]
    if bodies.heat is not None:
        couplings = [
            body.thermal_coupling(conduction.space)
            for body, conduction in zip((bodies.punch, bodies.strip), bodies.heat, strict=True)
        ]
    # In one frame, forces and displacements along its normals are all that is ever asked for.
    moves, fixed, flat = _frame(placed)
    punch = condense(bodies.punch, middle.punch.spread, middle.normal if fixed else None, couplings[0])
    if not moves:
        onto_contact = csr_array(middle.transfer.T)
        return Condensed(punch, condense(bodies.strip, onto_contact, middle.normal_on_strip, couplings[1]), moves)
    trace = middle.strip.trace
    along = np.broadcast_to(middle.normal_on_strip[0], trace.shape) if fixed and flat else None
    return Condensed(punch, condense(bodies.strip, _identity(len(trace)), along, couplings[1]), moves)


def _identity(size: int) -> csr_array:
    every = np.arange(size)
    return csr_array((np.ones(size), (every, every)), shape=(size, size))


def _joined(placed: Placed, condensed: Condensed, exchange: HeatExchange | None = None) -> Tribosystem:
    """Join the condensed bodies in every phase; what phases share is made once; collective."""
    interface = join(placed.rigid, condensed.punch, condensed.strip, strip_moves=condensed.strip_moves)
    found: list[Interface] = []
    for k, (rigid, bodies) in enumerate(zip(placed.rigids, placed.loaded, strict=True)):
        earlier = next((j for j in range(k) if placed.rigids[j] is rigid and placed.loaded[j] is bodies), None)
        if rigid is placed.rigid:
            found.append(interface)
        elif earlier is not None:
            found.append(found[earlier])
        else:
            own = condensed if bodies is placed.bodies else condensed.under_loads(bodies)
            found.append(join(rigid, own.punch, own.strip, strip_moves=condensed.strip_moves))
    parts = {name: getattr(placed, name) for name in Placed.__dataclass_fields__}
    return Tribosystem(**parts, condensed=condensed, interface=interface, interfaces=tuple(found), exchange=exchange)


# -------------------------------------------------------------------------------- the heat


def with_exchange(system: Tribosystem, *, reduced: bool | None = None) -> Tribosystem:
    """Return the system with the heat of its motion prepared; collective.

    Args:
        system: With condensed bodies.
        reduced: Whether temperatures are reduced to a small basis, as whole cycles need; by default as
            the settings say.

    Raises:
        CaseError: with heat, half-cycles of unequal duration.
    """
    if system.heat is None or system.bodies.heat is None:
        return system
    reduced = system.heat.operator == "reduced" if reduced is None else reduced
    exchange = prepare_exchange(
        system.heat,
        system.bodies.heat,
        system.pair,
        gap_rows(system),
        system.motion,
        heating_friction(system),
        system.bodies.punch.thickness,
        reduced=reduced,
    )
    return replace(system, exchange=exchange)


def with_reduced_heat(system: Tribosystem) -> Tribosystem:
    """Return the system with its heat on a small basis, whatever the settings say; collective."""
    if system.heat is None or (system.exchange is not None and system.exchange.reduced):
        return system
    return with_exchange(system, reduced=True)


def preparation(system: Tribosystem) -> Preparation:
    """Return how the heat of a system was prepared."""
    if system.exchange is None:
        return "none"
    return "reduced" if system.exchange.reduced else "as set"


def steady_exchange(system: Tribosystem, velocities: Sequence[float]) -> HeatExchange:
    """Return the exchange whose phases are steady states at these velocities of the strip; collective.

    Raises:
        CaseError: there is no heat, or a body has no heat sink.
    """
    if system.heat is None or system.bodies.heat is None:
        raise CaseError(Problem("heat", "missing, but required here"))
    return prepare_steady(
        system.heat,
        system.bodies.heat,
        system.pair,
        gap_rows(system),
        velocities,
        heating_friction(system),
        system.bodies.punch.thickness,
    )


def gap_rows(system: Tribosystem) -> tuple[Array, Array]:
    """Return the gap that each kelvin of this rank's nodes opens, (n, owned) each, mm/K."""
    punch, strip = system.condensed.punch.by_temperature, system.condensed.strip.by_temperature
    if punch is None or strip is None:
        raise CaseError(Problem("heat", "missing, but required here"))
    return punch, -strip


def heating_friction(system: Placed, mu: Array | None = None) -> Array:
    """Return mu times what each node slides for a unit of the stroke's law (n,): friction heat is that times p v.

    Args:
        system: The placed bodies.
        mu: (n,); by default at the mean pressure.
    """
    mu = system.friction.values(system.conditions(0)) if mu is None else mu
    return mu * system.sliding.field.rate(system.pair.punch.x)


# ----------------------------------------------------------------------------- from a case


def assemble(
    case: Case, comm: MPI.Comm = MPI.COMM_WORLD, followed: Worn | None = None, *, heat: Preparation = "as set"
) -> Tribosystem:
    """Return the system of a case: all steps; collective.

    Args:
        case: The problem.
        comm: The ranks.
        followed: Worn depths that the meshes follow; by default they are as they were made.
        heat: How the heat of the motion is prepared, which takes longest: as the case sets it, reduced to a
            small basis as whole cycles need it, or not at all.

    Raises:
        CaseError: what only the geometry can tell is wrong.
        MeshQualityError: an element does not survive the motion of its mesh.
    """
    system = elastic(place_case(case, comm, followed))
    if heat == "none":
        return system
    return with_reduced_heat(system) if heat == "reduced" else with_exchange(system)


def place_case(case: Case, comm: MPI.Comm = MPI.COMM_WORLD, followed: Worn | None = None) -> Placed:
    """Return both bodies of a case opposite each other, without any elasticity; collective.

    Args:
        case: The problem.
        comm: The ranks.
        followed: Worn depths that the meshes follow.

    Raises:
        CaseError: what only the geometry can tell is wrong.
        MeshQualityError: an element does not survive the motion of its mesh.
    """
    bodies = build_bodies(case, comm, followed)
    return place(bodies, make_sliding(case), case.heat, solver=case.contact.solver, case=case)


def vary(system: Tribosystem, case: Case, parts: int = 1) -> Tribosystem:
    """Return the system of another case that shares all operators which the change leaves; collective.

    Loads, friction, wear, motion and the exchange of heat factor no stiffness again; another motion
    prepares the steps of heat again. Anything else makes a new system.

    Args:
        system: Of a case.
        case: The other one.
        parts: Into which each phase of the motion is cut.

    Raises:
        CaseError: the punch would tip over.
    """
    before = system.case
    if not _same_bodies(before, case):
        return assemble(case, system.comm, system.bodies.followed, heat=preparation(system))
    bodies, condensed = system.bodies, system.condensed
    if (before.punch.loads, before.strip.loads) != (case.punch.loads, case.strip.loads):
        bodies = bodies.under(case)
    conducts_alike = _same_conduction(before, case)
    if not conducts_alike:
        bodies = replace(bodies, heat=build_conduction(case, bodies.punch, bodies.strip))
    placed = place(bodies, make_sliding(case, parts), case.heat, solver=case.contact.solver, case=case)
    if not _same_frame(system, placed):
        condensed = _condense(placed)
    elif (bodies.punch, bodies.strip) != (system.bodies.punch, system.bodies.strip):
        condensed = condensed.under_loads(bodies)
    if system.exchange is None or case.heat is None:
        return _joined(placed, condensed)
    if not conducts_alike or placed.motion != system.motion:
        return with_exchange(_joined(placed, condensed), reduced=system.exchange.reduced)
    friction = np.tile(heating_friction(placed), (len(placed.motion.phases), 1))
    return _joined(placed, condensed, system.exchange.varied(case.heat, friction))


def in_parts(system: Tribosystem, parts: int) -> Tribosystem:
    """Return the system with each phase of the motion cut into parts of equal time; collective."""
    return vary(system, system.case, parts)


def _same_bodies(one: Case, other: Case) -> bool:
    """Return whether two cases have the same meshes, stiffnesses and thermal expansion."""
    first, second = (
        (
            case.geometry,
            case.folder,
            case.model,
            case.materials,
            case.heat is None,
            *((body.regions, body.supports, body.pivot) for body in (case.punch, case.strip)),
        )
        for case in (one, other)
    )
    return first == second


def _same_conduction(one: Case, other: Case) -> bool:
    """Return whether heat is conducted alike in the bodies of two cases, whatever passes between them."""
    if one.heat is None or other.heat is None:
        return one.heat is other.heat
    own, others = (case.heat.model_dump(exclude=set(Heat.exchange_keys)) for case in (one, other) if case.heat)
    held = [(case.punch.temperatures, case.strip.temperatures) for case in (one, other)]
    return own == others and held[0] == held[1]


def _same_frame(system: Tribosystem, placed: Placed) -> bool:
    """Return whether bodies condensed for one motion answer for another one, too."""
    return _frame(system) == _frame(placed)


def _frame(placed: Placed) -> tuple[bool, bool, bool]:
    """Return whether the strip moves as a whole, whether the frame stays, and whether the strip is flat."""
    middle = placed.pair
    moves = any(pair.transfer is not middle.transfer for pair in placed.pairs)
    fixed = all(_close(pair.normal, middle.normal) for pair in placed.pairs)
    return moves, fixed, not moves or _close(middle.normal_on_strip, middle.normal_on_strip[:1])


def _close(first: Array, second: Array) -> bool:
    return bool(np.abs(first - second).max() < ROUNDING)
