"""Friction and wear of each node by its own conditions, in gross sliding and in slip.

By local slip depth = beta~ p^b v^a of each node of both bodies, with v = abs(slip) over its step's time. Coefficients
may depend on the conditions of each node: its pressure and temperature, the speed of its slip, how deep it is worn and
how far it has slipped. Friction is that of the pressure at the end of a time step, of the temperature and depth at its
start and of the speed in the step before; wear is that of the step itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.sparse import eye_array

from fenwear.case import WearLaw
from fenwear.common.arrays import Array, Mask
from fenwear.laws.coating import CoatedBody, covering
from fenwear.laws.friction import ContactConditions, Friction, Regions, any_split
from fenwear.laws.pressure_law import PressureLaw
from fenwear.laws.sliding_tensors import CycleShear
from fenwear.laws.wear import BodyWear, CoatedWear, PhasesWear, WornDepths, coefficient, stays
from fenwear.surfaces import ContactPair
from fenwear.surfaces.contact_edges import Edges

States = tuple[Mapping[str, Array], Mapping[str, Array]]


@dataclass(frozen=True)
class BodyRate:
    """The wear law of a body: beta~ at the nodes (n,), what of the pressure wears, a, and whether the body wears."""

    rate: Array
    law: PressureLaw = field(default_factory=PressureLaw)
    speed_exponent: float = 1.0
    wears: bool = True

    def slide(self, slid: Array, duration: float | Array) -> Array:
        """Return the sliding of nodes in a time, to the power a (n,), mm^a s^(1-a)."""
        a = self.speed_exponent
        return slid if a == 1 else slid**a * duration ** (1 - a)


@dataclass(frozen=True)
class LocalWear:
    """The wear laws of punch and strip.

    Attributes:
        punch, strip: Of a coated body as if all of it were of the coating.
        bases: Of both as if all coatings were worn through; empty where nothing is coated.
    """

    punch: BodyRate
    strip: BodyRate
    bases: tuple[BodyRate, ...] = ()

    @property
    def layers(self) -> tuple[tuple[BodyRate, BodyRate], tuple[BodyRate, BodyRate]]:
        """Of punch and strip, the laws of coating and base each; of a body without coating that of the base twice."""
        punch, strip = self.bases or (self.punch, self.strip)
        return (self.punch, punch), (self.strip, strip)


@dataclass(frozen=True)
class LocalLaws:
    """Friction and wear of each node by its own conditions.

    Attributes:
        friction: The law of friction.
        wear: The wear laws of punch and strip.
        regions: Of punch and strip at the contact nodes.
        initial: Temperature without heat, K.
        coatings: Thickness of both bodies' coatings at their own contact nodes, mm.
        edges: Distances from the edge of the contact; None where nothing depends on them.
    """

    friction: Friction
    wear: tuple[WearLaw, WearLaw]
    coatings: tuple[Array, Array]
    regions: tuple[Regions, Regions] = field(default_factory=lambda: (Regions(), Regions()))
    initial: float = 0.0
    edges: Edges | None = None

    @property
    def constant(self) -> bool:
        """Whether nothing depends on more than the place."""
        return self.friction.constant and not self.changes(of_wear=True)

    @property
    def any_coating(self) -> bool:
        """Whether a body is coated."""
        return any(thickness.any() for thickness in self.coatings)

    def changes(self, *, of_wear: bool = False) -> bool:
        """Return whether friction changes with the state, or wear does."""
        if not of_wear:
            return not self.friction.constant
        return not stays(self.wear, self.friction) or any_split(self.regions, self.wear)

    def asks(self, name: str) -> bool:
        """Return whether friction, wear or the loss of debris depends on a variable of coefficients."""
        return self.friction.contact.asks(name, self.wear)

    def conditions(
        self,
        pair: ContactPair,
        pressure: Array,
        *,
        speed: Array | float = 0.0,
        temperatures: tuple[Array, Array] | None = None,
        worn: WornDepths | None = None,
        slid: Array | None = None,
        states: States = ({}, {}),
        debris: Array | float = 0.0,
        touching: Mask | None = None,
        cycle: CycleShear | None = None,
    ) -> ContactConditions:
        """Return the conditions that coefficients depend on.

        Args:
            pair: The surfaces opposite each other.
            pressure: (n,), MPa.
            speed: Of slip (n,), mm/s.
            temperatures: Of the punch's and the strip's surface (n,), K; by default the initial one.
            worn: Depths; by default none.
            slid: Slip of each node from the start (n,), mm; by default nothing.
            states: That laws remember, as those of punch and strip know them.
            debris: Thickness of the third body (n,), mm.
            touching: Which nodes touch (n,), for the edges of the contact; by default those that carry a pressure.
            cycle: Cross-shear and mean pressure of the last cycle; None before the first.
        """
        none = np.zeros_like(pressure)
        initial = np.full_like(pressure, self.initial)
        return ContactConditions(
            pressure,
            speed,
            (initial, initial) if temperatures is None else temperatures,
            pair.places,
            (none, none) if worn is None else (worn.punch, pair.wear_interpolation @ worn.strip),
            none if slid is None else slid,
            self.regions,
            cycle=cycle,
            states=states,
            covered=covering(self.coatings, pair, None if worn is None else (worn.punch, worn.strip)),
            debris=debris,
            friction_temperature=self.friction.friction_temperature,
            edge=None if self.edges is None else self.edges.distance(pressure > 0 if touching is None else touching),
        )

    def wear_at(self, conditions: ContactConditions) -> LocalWear:
        """Return the wear by local slip; of a coated body as if all of it were of the coating, and the base's.

        Raises:
            CaseError: a coefficient is negative or not finite there.
        """

        def rate(law: WearLaw, key: str) -> BodyRate:
            if not law.wears:
                return BodyRate(np.zeros(conditions.shape), wears=False)
            of_pressure = PressureLaw.of(law, self.friction.contact.uniform_share)
            return BodyRate(coefficient(law, self.friction, conditions, key), of_pressure, law.speed_exponent)

        punch, strip = self.wear
        bases = rate(punch, "wear.punch"), rate(strip, "wear.strip")
        if not any(law.coating for law in self.wear):
            return LocalWear(*bases)
        return LocalWear(
            rate(punch.of_coating or punch, "wear.punch"), rate(strip.of_coating or strip, "wear.strip"), bases
        )

    def coated(self, pair: ContactPair, conditions: ContactConditions) -> tuple[CoatedBody, CoatedBody]:
        """Return the coatings of both bodies with the ratio of their base's coefficient to theirs there.

        Raises:
            CaseError: a coefficient is negative or not finite there.
        """
        coatings, identity = [], eye_array(len(conditions.pressure))
        onto = identity, pair.wear_projection
        for thickness, laws, put in zip(self.coatings, self.wear_at(conditions).layers, onto, strict=True):
            coating, base = (put @ law.rate for law in laws)
            ratio = np.divide(base, coating, out=np.ones_like(thickness), where=coating > 0)
            coatings.append(CoatedBody(thickness, ratio))
        return coatings[0], coatings[1]


@dataclass(frozen=True)
class Wear:
    """The wear rule of a motion: both bodies' laws and the sliding of each phase.

    Attributes:
        laws: Of the nodes.
        sliding: Of each body S, the integral of v^a over each phase at each node, (m, n) each, mm^a s^(1-a).
        pairs: The surfaces opposite each other in each phase.
    """

    laws: LocalLaws
    sliding: tuple[Array, Array]
    pairs: Sequence[ContactPair]

    @cached_property
    def constant(self) -> bool:
        """Whether no coefficient depends on more than the place."""
        return not self.laws.changes(of_wear=True)

    def phases(self, conditions: Sequence[ContactConditions], which: Sequence[int] | None = None) -> PhasesWear:
        """Return the wear of all phases or of some of them.

        Args:
            conditions: Of each of these phases, for the coefficients that depend on them.
            which: Numbers of the phases; by default all.

        Raises:
            CaseError: a coefficient is negative or not finite there.
        """
        chosen = list(range(len(self.pairs)) if which is None else which)
        punch, strip = (slid[chosen] for slid in self.sliding)
        wears = [self.laws.wear_at(condition) for condition in conditions]
        return phases_wear(wears, (punch, strip), [self.pairs[k] for k in chosen], self.laws.coatings)


def phases_wear(
    wears: Sequence[LocalWear], slid: tuple[Array, Array], pairs: Sequence[ContactPair], coatings: tuple[Array, Array]
) -> PhasesWear:
    """Return the wear of phases or time steps by their laws at the nodes.

    Args:
        wears: Of each of them.
        slid: Sliding in each to the power a, for the laws of both bodies (m, n), mm^a s^(1-a).
        pairs: The surfaces in each.
        coatings: Thickness of both bodies' coatings at their own contact nodes, mm.
    """
    body_wears: list[BodyWear] = []
    by_body = zip(*(wear.layers for wear in wears), strict=True)
    for laws, distance, thickness, surfaces in zip(by_body, slid, coatings, ((), pairs), strict=True):
        coating, base = (
            BodyWear(
                np.array([law.rate for law in phase_laws]) * distance, phase_laws[0].law, surfaces, phase_laws[0].wears
            )
            for phase_laws in zip(*laws, strict=True)
        )
        if thickness.any():
            base = CoatedWear(base.rate, base.law, surfaces, coating=coating, thickness=thickness)
        body_wears.append(base)
    return PhasesWear(body_wears[0], body_wears[1], pairs)
