"""Both bodies opposite each other in every phase of the sliding, in equilibrium; nothing elastic in it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from fenwear.case import Case
from fenwear.case.body_names import with_body_names
from fenwear.common.arrays import Array, Mask
from fenwear.common.errors import CaseError, InputError, Remedies
from fenwear.common.parallel import Team
from fenwear.laws import Evolution, LayerEvolution, Layers, common_modulus, layers_of
from fenwear.laws.friction import ContactConditions
from fenwear.laws.local_laws import LocalLaws, Wear
from fenwear.laws.optimum import Optimum, WearRates, optimum, optimum_on_track
from fenwear.laws.sliding_tensors import CycleShear, SlidingWays
from fenwear.laws.wear import PhasesWear, WornDepths
from fenwear.surfaces import (
    ContactPair,
    RigidEquilibrium,
)
from fenwear.surfaces.motion import Motion
from fenwear.surfaces.placement import in_model
from fenwear.system.both_bodies import Bodies, laws_of
from fenwear.system.contact_laws import GROSS, ContactLaw, law_named
from fenwear.system.strokes import PlacedSliding

MIDDLE = -1  # in place of a phase: the middle position, at the mean speed
ROUNDING = 1e-12  # of the largest sliding: what lies on the axis
OF_SIDES = 3  # times that an optimum is found anew, at the pressures beside nodes between regions


@dataclass(frozen=True)
class PhaseLaws:
    """Friction, wear and layers over the phases of the sliding.

    Attributes:
        laws: Friction and wear of each node.
        layers: Between the surfaces.
        sliding: Of the surfaces.
        rigid: Equilibrium in the middle position.
        unworn: Depths and layers at the start.
    """

    laws: LocalLaws
    layers: Layers
    sliding: PlacedSliding
    rigid: RigidEquilibrium
    unworn: WornDepths

    @cached_property
    def ways(self) -> SlidingWays:
        """Distances and directions of sliding in each phase of a cycle: tensors, cross-shear."""
        mean, asked = self.rigid.mean_pressure, self.laws.asks("cs") or self.laws.asks("pm")
        return SlidingWays(
            self.sliding.pairs,
            self.sliding.middle,
            self.sliding.path,
            self.sliding.directions,
            self.sliding.strip_wears,
            mean,
            asked,
        )

    @cached_property
    def wear(self) -> Wear:
        """The wear rule of both bodies over the phases of the motion."""
        slid = []
        for law in self.sliding.wear:
            a, b = law.speed_exponent, law.pressure_exponent
            rates = self.sliding.ratio if a == b else self.sliding.rates(a / b)
            slid.append(self.sliding.motion.sliding(a)[:, None] * rates**a)
        return Wear(self.laws, (slid[0], slid[1]), self.sliding.pairs)

    @cached_property
    def mean_wear(self) -> PhasesWear:
        """The wear of all phases at the mean pressure and the initial temperature."""
        return self.wear.phases([self.conditions(k) for k in range(len(self.sliding.motion.phases))])

    @cached_property
    def constant(self) -> bool:
        """Whether friction, wear and loss of debris are alike at any temperature, pressure, speed, depth, distance."""
        return self.laws.friction.constant and self.wear.constant and not self.layers.varies

    @property
    def strip_changes(self) -> bool:
        """Whether something of the strip's material changes: it wears, or carries debris."""
        return self.sliding.strip_wears or self.layers.strip_carries

    @property
    def track_changes(self) -> bool:
        """Whether the strip wears, or carries debris, to and fro under the punch: each position finds another track."""
        return self.strip_changes and self.sliding.to_and_fro

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
        slid = self.sliding.path.sum(axis=0) if self.sliding.motion.steps else self.sliding.ratio[max(phase, 0)]
        pair = (*self.sliding.pairs, self.sliding.middle)[phase]
        if pressure is None:
            pressure = np.full(len(pair.weights), self.rigid.mean_pressure)
            touching = pressure >= 0 if touching is None else touching
        return self.laws.conditions(
            pair,
            pressure,
            speed=self.sliding.speeds[phase],
            temperatures=temperatures,
            worn=worn,
            slid=slid * self.sliding.slid_after(self.sliding.clock.half_cycles if half_cycles is None else half_cycles),
            states=self.layers.known(pair, worn),
            debris=self.layers.facing(pair, worn),
            touching=touching,
            cycle=self.ways.shear(None) if cycle is None else cycle,
        )

    def middle_ratio(self, direction: int, pressure: Array | None = None) -> Array:
        """Return tau (n, d) in the middle position at the mean speed.

        Args:
            direction: d, the sign of the sliding.
            pressure: (n,), MPa; by default the mean pressure.
        """
        mu = self.laws.friction.values(self.conditions(MIDDLE, pressure))
        return in_model(self.laws.friction.ratio(direction, mu, self.sliding.middle), self.sliding.middle.punch.dim)

    def ratios(self, conditions: Sequence[ContactConditions] | None = None) -> list[Array]:
        """Return tau of each phase (n, d), the traction of friction on the punch over the pressure.

        Args:
            conditions: Of each phase, for friction that depends on them; by default at the mean pressure.

        Raises:
            CaseError: the friction coefficient is negative or not finite there.
        """
        states = [self.conditions(k) for k in range(len(self.sliding.pairs))] if conditions is None else conditions
        return [self.ratio(k, self.laws.friction.values(state)) for k, state in enumerate(states)]

    def ratio(self, phase: int, mu: Array) -> Array:
        """Return tau of a phase (n, d), the traction of friction on the punch over the pressure, for mu (n,)."""
        pair = self.sliding.pairs[phase]
        return in_model(self.ratio_in_space(phase, mu), pair.punch.dim)

    def ratio_in_space(self, phase: int, mu: Array) -> Array:
        """Return tau of a phase in space (n, 3), as `ratio`."""
        return self.laws.friction.along(
            self.sliding.directions[phase], mu, self.sliding.pairs[phase], self.sliding.motion.phases[phase].direction
        )

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
        chosen = list(range(len(self.sliding.motion.phases)) if phases is None else phases)
        if not conditions and self.layers.varies:
            conditions = [self.conditions(k) for k in chosen]
        layers = self.layers.at(chosen).under(conditions)
        return LayerEvolution.over(layers, wear, self.sliding.path[chosen], evolution, conditions)

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
        chosen = list(range(len(self.sliding.motion.phases)) if phases is None else phases)
        durations = np.array([self.sliding.motion.phases[k].duration for k in chosen])

        def wearing(k: int, at: ContactConditions) -> PhasesWear:
            return self.wear.phases([at], [chosen[k]]).begun(self.unworn if worn is None else worn)

        depth = np.zeros(len(self.sliding.middle.strip.weights)) if worn is None else worn.strip
        return Evolution(
            self.layers.memory, conditions, durations, [self.sliding.pairs[k] for k in chosen], wearing, depth
        )

    def rested(self, conditions: Sequence[ContactConditions]) -> WornDepths:
        """Return no depths, with the states of laws that cycles at conditions of the phases leave as they are.

        Raises:
            ConvergenceError: a state changes as long as it slides.
        """
        return self.layers.with_held(self.unworn, self.evolution(conditions).rest(self.layers.held(self.unworn)))


@dataclass(frozen=True, kw_only=True, repr=False)
class ContactSetup:
    """Both bodies opposite each other in every phase, in equilibrium; nothing elastic in it.

    Attributes:
        bodies: Under the mean loads.
        sliding: Of the surfaces, with friction and wear laws.
        law: Of the contact.
        case: The problem; of a stage that of the whole program.
        loaded: The bodies under the loads of each phase.
        rigids: Equilibrium of the rigid modes in each phase, with its pair of surfaces.
        rigid: The same in the middle position under the mean loads.
        remedies: Descriptions of parts solved in another way.
    """

    bodies: Bodies
    sliding: PlacedSliding
    law: ContactLaw = field(default_factory=lambda: law_named(GROSS))
    case: Case
    loaded: tuple[Bodies, ...]
    rigids: tuple[RigidEquilibrium, ...]
    rigid: RigidEquilibrium
    remedies: Remedies = field(default_factory=Remedies)

    @property
    def normal_force(self) -> float:
        """The mean force of the loads on the contact, N; 0 where supports and not the contact carry it."""
        force, both = self.rigid.carried * self.bodies.punch.thickness, (self.bodies.punch, self.bodies.strip)
        return force if force > ROUNDING * max(body.acting for body in both) else 0.0

    def __repr__(self) -> str:
        """Say in a line what it is."""
        sizes = f"{len(self.pair.weights)} contact nodes, {len(self.sliding.pairs)} phases"
        return f"<{type(self).__name__} {self.case.title!r}: {sizes}>"

    @cached_property
    def team(self) -> Team:
        """The ranks, of which one leads."""
        return Team.of(self.bodies.comm)

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

    @property
    def pair(self) -> ContactPair:
        """The surfaces in the middle position of the strip."""
        return self.rigid.pair

    @cached_property
    def layers(self) -> Layers:
        """Layers between the surfaces.

        Raises:
            CaseError: a value of it is not positive somewhere, the modulus of rough surfaces is missing, or the
                hardness does not carry the load.
        """
        modulus = common_modulus(self.case, self.bodies.regions, self.pair)
        initial, mean = self.case.initial_temperature, self.rigid.mean_pressure
        contact = self.laws.friction.contact
        carries = self.case.debris_on_strip and self.sliding.passes  # else it lies where it is on either body
        layers = layers_of(
            contact, self.pair, modulus, self.sliding.wear, initial, strip_carries=carries, alike=self._alike
        )
        if layers.hardness <= mean:
            message = f"expected more than the mean pressure of {mean:.6g} MPa, which no softer surface carries"
            raise CaseError(InputError("contact.hardness", message))
        return layers

    @property
    def _alike(self) -> dict[str, Array]:
        """Variables of laws: the speed of the phases, and the initial temperature."""
        initial = np.full(len(self.pair.weights), self.case.initial_temperature)
        return {"T": initial, "v": self.sliding.steady_speed}

    @cached_property
    def phases(self) -> PhaseLaws:
        """Friction, wear and layers over the phases of the motion."""
        return PhaseLaws(self.laws, self.layers, self.sliding, self.rigid, self.unworn())

    def gap(self, phase: int, worn: WornDepths) -> Array:
        """Return the gap of the unloaded, worn bodies in a phase (n,), mm."""
        pair = self.sliding.pairs[phase]
        between = self.layers.opening(pair, worn)
        if self.bodies.moved is not None:
            worn = worn - self.bodies.moved
        elif not self.sliding.strip_wears:
            return pair.initial_gap + worn.punch + between
        return pair.initial_gap + pair.opening(worn.punch, worn.strip) + between

    def unworn(self) -> WornDepths:
        """Return the worn depths at the start, none, and the initial layers."""
        return self.layers.unworn(len(self.pair.strip.weights))

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
        if self.law.sticks:
            message = "expected 'gross-sliding': the pressure optimum is that of surfaces that slide as a whole"
            raise CaseError(InputError("contact.law", message))
        # none slide in a rest
        slid = (distance for distance in self.phases.wear.sliding if distance.max() > 0)
        if not all((distance.sum(axis=0) / distance.max() > ROUNDING).all() for distance in slid):
            message = "lies within the contact: nothing slides there, so that no pressure wears it evenly"
            raise CaseError(InputError("motion.centre", message))
        optimal = self._optimum(direction, zone, None)
        for _ in range(OF_SIDES if any(len(regions.mixed) for regions in self.laws.regions) else 0):
            optimal = self._optimum(direction, zone, optimal.pressure)
        return optimal

    def _optimum(self, direction: int, zone: Mask | None, pressure: Array | None) -> Optimum:
        """Return the optimum at the coefficients of a pressure (n,), MPa; by default of the mean."""
        wear, ratio = self.phases.mean_wear, self.phases.middle_ratio(direction, pressure)
        if pressure is not None:
            wear = self.phases.wear.phases(
                [self.phases.conditions(k, pressure) for k in range(len(self.motion.phases))]
            )
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
