"""Both bodies opposite each other in every phase of the sliding, in equilibrium; nothing elastic in it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from fenwear.bodies.worn_mesh import element_height
from fenwear.case import Case, Heat
from fenwear.case.body_names import Names, with_body_names
from fenwear.common.arrays import Array, Mask
from fenwear.common.errors import CaseError, InputError, Remedies
from fenwear.common.parallel import Team
from fenwear.heat.heat_exchange import Isothermal
from fenwear.heat.passage import Passage
from fenwear.laws import Evolution, LayerEvolution, Layers, common_modulus, conductance_of, layers_of
from fenwear.laws.friction import ContactConditions, Friction
from fenwear.laws.local_laws import LocalLaws, Wear
from fenwear.laws.optimum import Optimum, WearRates, optimum, optimum_on_track
from fenwear.laws.sliding_tensors import CycleShear, SlidingWays
from fenwear.laws.wear import PhasesWear, WornDepths
from fenwear.surfaces import (
    ContactPair,
    RigidEquilibrium,
)
from fenwear.surfaces.contact_edges import Edges
from fenwear.surfaces.motion import Motion
from fenwear.surfaces.placement import in_model
from fenwear.surfaces.sliding_field import SlidingField, node_rates
from fenwear.system.both_bodies import Bodies, laws_of
from fenwear.system.contact_laws import law_named
from fenwear.system.strokes import Sliding

MIDDLE = -1  # in place of a phase: the middle position, at the mean speed
ROUNDING = 1e-12  # of the largest sliding: what lies on the axis
OF_SIDES = 3  # times that an optimum is found anew, at the pressures beside nodes between regions


@dataclass(frozen=True)
class Clock:
    """When a motion began that is one of several.

    Attributes:
        half_cycles: Before it.
        time: s.
        slid: Distance of the motions before it, mm or rad.
    """

    half_cycles: int = 0
    time: float = 0.0
    slid: float = 0.0


@dataclass(frozen=True, kw_only=True, repr=False)
class ContactSetup:
    """Both bodies opposite each other in every phase, in equilibrium; nothing elastic in it.

    Attributes:
        bodies: Under the mean loads.
        sliding: Motion, friction and wear.
        heat: Settings of the heat between the bodies; None without.
        law: Of the contact, by its name: see `contact_laws`.
        case: The problem; of a stage that of the whole program.
        loaded: The bodies under the loads of each phase.
        rigids: Equilibrium of the rigid modes in each phase, with its pair of surfaces.
        rigid: The same in the middle position under the mean loads.
        passes: Whether the strip's material moves past the punch's; not where nodes stick and it stays opposite.
        passage: Where the punch is on a strip that conducts and passes under it to and fro; None where none does.
        remedies: Descriptions of parts solved in another way.
        clock: When its motion began.
    """

    bodies: Bodies
    sliding: Sliding
    heat: Heat | None
    law: str = "gross-sliding"
    case: Case
    loaded: tuple[Bodies, ...]
    rigids: tuple[RigidEquilibrium, ...]
    rigid: RigidEquilibrium
    passes: bool = True
    passage: Passage | None = None
    remedies: Remedies = field(default_factory=Remedies)
    clock: Clock = Clock()

    def time(self, half_cycle: NDArray[np.int64]) -> Array:
        """Return the time at the end of half-cycles of its motion, given by their numbers from 1, s."""
        return self.clock.time + self.motion.time(np.asarray(half_cycle) - self.clock.half_cycles)

    @property
    def contact_law(self) -> Any:
        """The law of contact, a `contact_laws.ContactLaw`."""
        return law_named(self.law)

    @property
    def sticks(self) -> bool:
        """Whether nodes stick or slip by themselves."""
        return bool(self.contact_law.sticks)

    @property
    def normal_force(self) -> float:
        """The mean force of the loads on the contact, N; 0 where supports and not the contact carry it."""
        force, both = self.rigid.carried * self.bodies.punch.thickness, (self.bodies.punch, self.bodies.strip)
        return force if force > ROUNDING * max(body.acting for body in both) else 0.0

    def __repr__(self) -> str:
        """Say in a line what it is."""
        sizes = f"{len(self.pair.weights)} contact nodes, {len(self.pairs)} phases"
        return f"<{type(self).__name__} {self.case.title!r}: {sizes}>"

    @property
    def comm(self) -> MPI.Comm:
        """The ranks."""
        return self.bodies.comm

    @cached_property
    def team(self) -> Team:
        """The ranks, of which one leads."""
        return Team.of(self.comm)

    @property
    def names(self) -> Names:
        """Names of the bodies."""
        return self.case.names

    @property
    def motion(self) -> Motion:
        """The phases of a cycle."""
        return self.sliding.motion

    @cached_property
    def laws(self) -> LocalLaws:
        """Friction and wear of each node.

        Raises:
            CaseError: a coating's thickness is negative somewhere.
        """
        return laws_of(self.bodies, self.pair, self.sliding, self.case)

    @cached_property
    def friction(self) -> Friction:
        """The law of friction."""
        return self.laws.friction

    @property
    def pair(self) -> ContactPair:
        """The surfaces in the middle position of the strip."""
        return self.rigid.pair

    @cached_property
    def pairs(self) -> tuple[ContactPair, ...]:
        """The surfaces opposite each other in each phase."""
        return tuple(rigid.pair for rigid in self.rigids)

    @property
    def initial_temperature(self) -> float:
        """The temperature at which bodies fit, K; 0 without heat."""
        return self.case.initial_temperature

    @property
    def isothermal(self) -> Isothermal:
        """The exchange of bodies that stay at their initial temperature."""
        return Isothermal(len(self.pairs), len(self.pair.weights), self.initial_temperature)

    @property
    def direction_words(self) -> dict[int, str]:
        """The words for the two directions d of the sliding, 1 first; a table has one, through all of its steps."""
        if self.motion.steps:
            return {1: "cyclically", -1: "back"}
        return self.sliding.field.words(self.pair.punch.dim)

    @property
    def strip_wears(self) -> bool:
        """Whether the strip has a wear law."""
        return self.sliding.wear[1].wears

    @cached_property
    def sliding_ratio(self) -> Array:
        """Sliding of each node in each phase for a unit of the stroke's law (phases, n): 1, or mm/rad."""
        return self._rates(1.0)

    def _rates(self, power: float) -> Array:
        """Return the sliding of nodes in each phase for a unit of the stroke's law (phases, n), see `node_rates`."""
        return np.array([node_rates(self.field_of(phase), pair, power) for phase, pair in enumerate(self.pairs)])

    def field_of(self, phase: int) -> SlidingField:
        """Return the sliding field of a phase, in its direction of the motion or as a step of a table."""
        return self.motion.phases[phase].field or self.sliding.field

    @cached_property
    def path(self) -> Array:
        """Sliding of each node in each phase (phases, n), mm."""
        return np.array([phase.distance for phase in self.motion.phases])[:, None] * self.sliding_ratio

    @cached_property
    def sliding_directions(self) -> Array:
        """Unit vectors of the sliding of each phase in space (m, n, 3), d e_v, or zero."""
        return np.array(
            [
                phase.direction * self.field_of(k).direction(pair.opposite, pair.normal)
                for k, (phase, pair) in enumerate(zip(self.motion.phases, self.pairs, strict=True))
            ]
        )

    @property
    def slides_many_ways(self) -> bool:
        """Whether places of a solid slide in directions of their own, step by step of a table, as a whole surface."""
        return self.motion.steps and not self.sticks and self.pair.punch.dim == 3

    @cached_property
    def ways(self) -> SlidingWays:
        """Distances and directions of sliding in each phase of a cycle: tensors, cross-shear."""
        mean, asked = self.rigid.mean_pressure, self.asks("cs") or self.asks("pm")
        return SlidingWays(self.pairs, self.pair, self.path, self.sliding_directions, self.strip_wears, mean, asked)

    def friction_in_space(self, phase: int, mu: Array) -> Array:
        """Return tau of a phase in space (n, 3), as `phase_friction`."""
        return self.friction.along(
            self.sliding_directions[phase], mu, self.pairs[phase], self.motion.phases[phase].direction
        )

    @cached_property
    def wear(self) -> Wear:
        """The wear rule of both bodies over the phases of the motion."""
        slid = []
        for law in self.sliding.wear:
            a, b = law.speed_exponent, law.pressure_exponent
            rates = self.sliding_ratio if a == b else self._rates(a / b)
            slid.append(self.motion.sliding(a)[:, None] * rates**a)
        return Wear(self.laws, (slid[0], slid[1]), self.pairs)

    @property
    def strip_carries(self) -> bool:
        """Whether debris lies on the strip's material."""
        third = self.friction.contact.third_body
        return third is not None and self.names.role_of(third.carried_by) == "strip"

    @property
    def strip_changes(self) -> bool:
        """Whether something of the strip's material changes: it wears, or carries debris."""
        return self.strip_wears or self.layers.strip_carries

    @cached_property
    def carried_areas(self) -> Array:
        """Areas that nodes of the strip stand for where it carries debris (n_strip,), mm or mm².

        On a closed track, of which the mesh is a part, those by which what is put on it keeps its volume.
        """
        if self.sliding.track is None:
            return self.pair.strip.weights
        onto = self.pair.wear_projection.toarray()
        return np.asarray(np.linalg.lstsq(onto.T, self.pair.weights, rcond=None)[0])

    @cached_property
    def coated(self) -> bool:
        """Whether a body is."""
        return any(thickness.any() for thickness in self.coatings)

    @property
    def coatings(self) -> tuple[Array, Array]:
        """Thickness of the coatings of punch and strip at their own contact nodes, mm; 0 without."""
        return self.laws.coatings

    @cached_property
    def layers(self) -> Layers:
        """Layers between the surfaces.

        Raises:
            CaseError: a value of it is not positive somewhere, the modulus of rough surfaces is missing, or the
                hardness does not carry the load.
        """
        modulus = common_modulus(self.case, self.bodies.regions, self.pair)
        initial, mean = self.initial_temperature, self.rigid.mean_pressure
        contact = self.friction.contact
        carries = self.strip_carries and self.passes  # else it lies where it is on either body
        layers = layers_of(
            contact, self.pair, modulus, self.sliding.wear, initial, strip_carries=carries, alike=self._alike
        )
        if layers.hardness <= mean:
            message = f"expected more than the mean pressure of {mean:.6g} MPa, which no softer surface carries"
            raise CaseError(InputError("contact.hardness", message))
        return layers

    @property
    def _alike(self) -> dict[str, Array]:
        """Variables of laws that are the same in all cycles: the speed of the phases, without heat the temperature."""
        speeds = np.array([np.broadcast_to(self._speeds[k], self._none.shape) for k in range(len(self.motion.phases))])
        variables = {} if self.heat is not None else {"T": self._initial}
        same = np.abs(speeds - speeds[0]).max() <= ROUNDING * np.abs(speeds).max()
        return {**variables, "v": speeds[0] if same else speeds}

    def layer_conductance(self) -> Callable[[Array], Array] | None:
        """Return h_c by the pressures (n,), where the layer gives it (`fenwear.laws.contact_conductance`)."""
        return conductance_of(self.layers, self.case, self.bodies.regions, self.pair)

    def passing(
        self,
        wear: PhasesWear,
        phases: Sequence[int] | None = None,
        evolution: Evolution | None = None,
        conditions: Sequence[ContactConditions] = (),
    ) -> LayerEvolution:
        """Return the evolution of wear and layers over phases of the motion, by default all.

        Args:
            wear: Of these phases.
            phases: Their numbers.
            evolution: Their change of the states that laws remember; None where there are none.
            conditions: Of the phases, which debris may be lost by; by default those of the mean pressure.
        """
        chosen = list(range(len(self.motion.phases)) if phases is None else phases)
        if not conditions and self.layers.varies:
            conditions = [self.conditions(k) for k in chosen]
        return LayerEvolution.over(self.layers.at(chosen), wear, self.path[chosen], evolution, conditions)

    def evolution(
        self,
        conditions: Sequence[ContactConditions],
        worn: WornDepths | None = None,
        phases: Sequence[int] | None = None,
    ) -> Evolution:
        """Return the evolution of laws' states over phases of the motion, by default all.

        Args:
            conditions: Of these phases.
            worn: Depths; by default none.
            phases: Their numbers.
        """
        chosen = list(range(len(self.motion.phases)) if phases is None else phases)
        durations = np.array([self.motion.phases[k].duration for k in chosen])

        def wearing(k: int, at: ContactConditions) -> Array:
            phase_wear = self.wear.phases([at], [chosen[k]]).begun(self.unworn() if worn is None else worn)
            taken = phase_wear.taken(at.pressure[None])[0]
            return np.asarray(taken / durations[k])

        depth = np.zeros(len(self.pair.strip.weights)) if worn is None else worn.strip
        return Evolution(self.layers.memory, conditions, durations, [self.pairs[k] for k in chosen], wearing, depth)

    def rested(self, conditions: Sequence[ContactConditions]) -> WornDepths:
        """Return no depths, with the states of laws that cycles at conditions of the phases leave as they are.

        Raises:
            ConvergenceError: a state changes as long as it slides.
        """
        unworn = self.unworn()
        return self.layers.with_held(unworn, self.evolution(conditions).rest(self.layers.held(unworn)))

    @property
    def position_spacing(self) -> float:
        """Largest distance between neighbouring positions of the strip over that between contact nodes; 0 for one."""
        offsets = np.unique([phase.offset for phase in self.motion.phases])
        moved = self.path.max() if self.motion.steps else np.diff(offsets).max(initial=0.0) * self.sliding_ratio.max()
        return float(moved / self.pair.punch.spacing())

    @property
    def track_deepens(self) -> bool:
        """Whether the strip wears to and fro under the punch, so that no shape of its track stays."""
        return self.strip_wears and self.sliding.to_and_fro

    @property
    def track_changes(self) -> bool:
        """Whether the strip wears, or carries debris, to and fro under the punch: each position finds another track."""
        return self.strip_changes and self.sliding.to_and_fro

    @property
    def track_varies(self) -> bool:
        """Whether each position finds another track: the strip changes to and fro under the punch, or is uneven."""
        return self.case.strip_varies and self.sliding.to_and_fro

    @property
    def passing_laws(self) -> list[str]:
        """Keys of coefficients that change throughout a run: with the worn depth, or with what is slid."""
        return self.case.passing_laws

    @cached_property
    def constant_coefficients(self) -> bool:
        """Whether friction, wear and loss of debris are alike at any temperature, pressure, speed, depth, distance."""
        return self.friction.constant and self.wear.constant and not self.layers.varies

    def asks(self, name: str) -> bool:
        """Return whether friction, wear or the loss of debris depends on a variable of coefficients."""
        return self.laws.asks(name)

    @property
    def edges(self) -> Edges | None:
        """Distances from the edge of the contact; None where nothing depends on them."""
        return self.laws.edges

    @cached_property
    def mode_lengths(self) -> Array:
        """Largest displacement along e_n of each rigid mode for a unit velocity (modes,): 1, and mm for a rotation."""
        return np.abs(self.rigid.rigid_normal).max(axis=0, initial=1e-300)

    def gap(self, phase: int, worn: WornDepths) -> Array:
        """Return the gap of the unloaded, worn bodies in a phase (n,), mm."""
        pair = self.pairs[phase]
        between = self.layers.opening(pair, worn)
        if self.bodies.moved is not None:
            worn = worn - self.bodies.moved
        elif not self.strip_wears:
            return pair.initial_gap + worn.punch + between
        return pair.initial_gap + pair.opening(worn.punch, worn.strip) + between

    def unworn(self) -> WornDepths:
        """Return the worn depths at the start, none, and the initial layers."""
        return self.layers.unworn(len(self.pair.strip.weights))

    def mesh_update_due(self, worn: WornDepths) -> bool:
        """Return whether the wear since the meshes were moved is large against the elements at the contact."""
        return self.wear_on_meshes(worn) > 1

    def wear_on_meshes(self, worn: WornDepths) -> float:
        """Return the largest wear since the meshes were moved over that from which on they follow; 0 where none do."""
        limit = self.case.geometry.follow_wear
        if limit is None or self.pair.punch.grid is not None:  # nothing of a grid's wear is the mesh's
            return 0.0
        followed, heights = self.bodies.followed, self.element_heights
        rest = worn if followed is None else worn - followed
        pairs = ((rest.punch, heights.punch), (rest.strip, heights.strip))
        return max(float((np.abs(wear) / (limit * height)).max(initial=0.0)) for wear, height in pairs)

    @cached_property
    def element_heights(self) -> WornDepths:
        """Height of the elements at the contact nodes of both bodies, mm."""
        return WornDepths(element_height(self.bodies.punch), element_height(self.bodies.strip))

    @cached_property
    def _speeds(self) -> tuple[Array, ...]:
        """Mean speeds of the nodes in each phase, and of the motion in the middle position at last (n,), mm/s."""
        motion, pair = self.motion, self.pair
        speeds = [
            np.asarray(phase.speed * ratio) for phase, ratio in zip(motion.phases, self.sliding_ratio, strict=True)
        ]
        mean = motion.mean_speed * node_rates(self.sliding.field, pair)
        return (*speeds, self.path.sum(axis=0) / motion.period if motion.steps else mean)

    @cached_property
    def _none(self) -> Array:
        """Nothing at the nodes (n,)."""
        return np.zeros(len(self.pair.weights))

    @cached_property
    def _initial(self) -> Array:
        """The initial temperature at the nodes (n,), K."""
        return np.full(len(self.pair.weights), self.initial_temperature)

    def slid_after(self, half_cycles: float) -> float:
        """Return the sliding distance after half-cycles of the run, mm or rad; of tables the number of cycles."""
        strokes, each = self.motion.half_cycles, sum(phase.distance for phase in self.motion.phases)
        if self.motion.steps:
            each = 1.0
        return self.clock.slid + (half_cycles - self.clock.half_cycles) / strokes * each

    def conditions(
        self,
        phase: int,
        pressure: Array | None = None,
        temperatures: tuple[Array, Array] | None = None,
        worn: WornDepths | None = None,
        half_cycles: float | None = None,
        cycle: CycleShear | None = None,
        touching: Mask | None = None,
    ) -> ContactConditions:
        """Return the conditions that coefficients depend on in a phase.

        Args:
            phase: Number of the phase; MIDDLE for the mean speed of the motion in the middle position.
            pressure: (n,), MPa; by default the mean pressure.
            temperatures: Of the punch's and the strip's surface (n,), K; by default the initial one.
            worn: Depths, and states that laws remember; by default those at the start.
            half_cycles: Done since the start of the run; by default those before its motion.
            cycle: Of the pressures of all phases, by `SlidingWays.shear`; by default they are not known.
            touching: Which nodes touch (n,), for the edges of the contact; by default those that carry a pressure.
        """
        slid = self.path.sum(axis=0) if self.motion.steps else self.sliding_ratio[max(phase, 0)]
        pair = (*self.pairs, self.pair)[phase]
        if pressure is None:
            pressure = self._none + self.rigid.mean_pressure
            touching = pressure >= 0 if touching is None else touching
        return self.laws.conditions(
            pair,
            pressure,
            speed=self._speeds[phase],
            temperatures=temperatures,
            worn=worn,
            slid=slid * self.slid_after(self.clock.half_cycles if half_cycles is None else half_cycles),
            states=self.layers.known(pair, worn),
            debris=self.layers.facing(pair, worn),
            touching=touching,
            cycle=self.ways.shear(None) if cycle is None else cycle,
        )

    def friction_ratio(self, direction: int, pressure: Array | None = None) -> Array:
        """Return tau (n, d) in the middle position at the mean speed.

        Args:
            direction: d, the sign of the sliding.
            pressure: (n,), MPa; by default the mean pressure.
        """
        mu = self.friction.values(self.conditions(MIDDLE, pressure))
        return in_model(self.friction.ratio(direction, mu, self.pair), self.pair.punch.dim)

    def phase_friction(self, phase: int, mu: Array) -> Array:
        """Return tau of a phase (n, d), the traction of friction on the punch over the pressure, for mu (n,)."""
        pair = self.pairs[phase]
        return in_model(self.friction_in_space(phase, mu), pair.punch.dim)

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

    @with_body_names
    def optimum(self, direction: int, zone: Mask | None = None) -> Optimum:
        """Return the optimal pressure and wear velocity of one-way sliding at the mean wear rate.

        The wear rate is the sum over both bodies of the mean of beta~ v^a times their laws of the pressure, at the mean
        pressure. On a closed track the strip recedes by what is spread along it.

        Args:
            direction: Sliding direction d.
            zone: Nodes in contact (n,) bool; by default all.

        Raises:
            CaseError: nothing slides at a node on the axis of rotation, nothing slides one way, or nodes stick.
            ConvergenceError: a pressure_threshold or a pressure_cap leaves no optimum.
        """
        if self.motion.steps:
            message = "directions and loads change within a cycle, so no optimum exists. Use `fenwear steady`"
            raise CaseError(InputError("motion.kind", message))
        if self.sticks:
            message = "expected 'gross-sliding': the pressure optimum is that of surfaces that slide as a whole"
            raise CaseError(InputError("contact.law", message))
        # none slide in a rest
        sliding = [distance.sum(axis=0) / distance.max() for distance in self.wear.sliding if distance.max() > 0]
        if not all((ratio > ROUNDING).all() for ratio in sliding):
            message = "lies within the contact: nothing slides there, so that no pressure wears it evenly"
            raise CaseError(InputError("motion.centre", message))
        optimal = self._optimum(direction, zone, None)
        for _ in range(OF_SIDES if any(len(regions.mixed) for regions in self.laws.regions) else 0):
            optimal = self._optimum(direction, zone, optimal.pressure)
        return optimal

    def _optimum(self, direction: int, zone: Mask | None, pressure: Array | None) -> Optimum:
        """Return the optimum at the coefficients of a pressure (n,), MPa; by default of the mean."""
        wear, ratio = self.phases_wear, self.friction_ratio(direction, pressure)
        if pressure is not None:
            wear = self.wear.phases([self.conditions(k, pressure) for k in range(len(self.motion.phases))])
        bodies = wear.bodies
        rates = tuple(body.rate.sum(axis=0) / self.motion.period for body in bodies)
        laws = tuple(body.law for body in bodies)
        if self.sliding.track is None or not wear.strip.wears:
            return optimum(self.rigid, ratio, WearRates.together(rates, laws), zone)

        def recession(pressure: Array) -> Array:
            worn = wear.worn(np.tile(pressure, (len(self.motion.phases), 1)))
            return np.asarray(self.pair.wear_interpolation @ worn.strip / self.motion.period)

        if wear.punch.wears:
            return optimum_on_track(self.rigid, ratio, WearRates(rates[:1], laws[:1]), laws[1], recession, zone)
        # The strip alone: of all pressures that wear it evenly, one that is even along it.
        law = laws[0]
        some = np.full(len(self.pair.weights), min(law.threshold + 1.0, law.cap))
        return optimum(self.rigid, ratio, WearRates((recession(some) / law.value(some),), laws), zone)
