"""The wear rule: depths worn in a phase on both bodies, and the wear of a step as a compliance of the contact.

The punch's worn depth belongs to its contact nodes, the strip's to the strip's nodes, whose material
moves under the punch: what is worn in a phase is put on the strip at its offset, so that its
cross-section is what the pressure wore, and what is felt is read there. On a closed track the
strip's wear spreads along the whole of it, see `fenwear.sliding.track`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array, diags_array

from fenwear.arrays import Array
from fenwear.case import Dependence, WearLaw
from fenwear.interface import ContactPair
from fenwear.sliding.coating import Shares, left_of, shares
from fenwear.sliding.friction import ContactConditions, Friction
from fenwear.sliding.pressure_law import PressureLaw

NOTHING: Array = np.zeros((0, 0))  # between the surfaces
STIFF: Array = np.zeros(0)  # what bodies have crept that do not creep


@dataclass(frozen=True)
class WornDepths:
    """Worn depths, and the states of what lies between the surfaces and of what creeps.

    Attributes:
        punch: At the punch's contact nodes (n,), mm.
        strip: At the strip's contact nodes (n_strip,), on its material, mm.
        between: By the rows of `fenwear.layers.Layers` (rows, n); without rows where nothing lies between that changes.
        crept: Of what creeps (size,), as `fenwear.assembly.creep.Creep` has it; empty where nothing does.
        carried: States of the strip's own material (rows, n_strip), see `fenwear.layers.memory`; without rows mostly.
    """

    punch: Array
    strip: Array
    between: Array = field(default_factory=lambda: NOTHING)
    crept: Array = field(default_factory=lambda: STIFF)
    carried: Array = field(default_factory=lambda: NOTHING)

    def __add__(self, other: WornDepths) -> WornDepths:
        if self.plain and other.plain:
            return WornDepths(self.punch + other.punch, self.strip + other.strip, *self._kept)
        return WornDepths(
            self.punch + other.punch,
            self.strip + other.strip,
            _added(self.between, other.between),
            _added(self.crept, other.crept),
            _added(self.carried, other.carried),
        )

    def __sub__(self, other: WornDepths) -> WornDepths:
        return self + other.times(-1.0)

    @property
    def plain(self) -> bool:
        """Whether nothing lies between, creeps or is remembered."""
        return not (len(self.between) or len(self.crept) or len(self.carried))

    def same(self, other: WornDepths) -> bool:
        """Return whether all of it is equal to another's."""
        mine, theirs = ((one.punch, one.strip, *one._kept) for one in (self, other))
        return all(np.array_equal(a, b) for a, b in zip(mine, theirs, strict=True))

    def times(self, factor: float) -> WornDepths:
        """Return all of it times a factor."""
        if self.plain:
            return WornDepths(factor * self.punch, factor * self.strip, *self._kept)
        return WornDepths(factor * self.punch, factor * self.strip, *(factor * state for state in self._kept))

    @property
    def _kept(self) -> tuple[Array, Array, Array]:
        """What is not worn; where nothing is, still as wide as the surface, which rows of a run have to be alike in."""
        return self.between, self.crept, self.carried


def _added(one: Array, other: Array) -> Array:
    """Return the sum of states of what lies between or creeps; where one has none it adds nothing."""
    if not len(other):
        return one
    return one + other if len(one) else other


@dataclass(frozen=True)
class BodyWear:
    """What a body loses in each phase: rate = beta~ S (m, n), mm/MPa^b, times what of the pressure wears."""

    rate: Array
    law: PressureLaw
    coating: CoatingWear | None = None

    def depth(self, pressure: Array, worn: Shares | None = None) -> Array:
        """Return the depths (m, n), mm, of pressures (m, n) at the interface nodes.

        Args:
            pressure: MPa.
            worn: What of coating and base there; by default of the base alone.
        """
        if worn is None or self.coating is None:
            return self.rate * self.law.value(pressure)
        of_coating = self.coating.rate * worn.coating * self.coating.law.value(pressure)
        return of_coating + self.rate * worn.base * self.law.value(pressure)

    def slope(self, pressure: Array, worn: Shares | None = None) -> Array:
        """Return their derivatives to the pressures (m, n), mm/MPa."""
        if worn is None or self.coating is None:
            return self.rate * self.law.slope(pressure)
        of_coating = self.coating.rate * worn.by_coating * self.coating.law.slope(pressure)
        return of_coating + self.rate * worn.by_base * self.law.slope(pressure)

    @property
    def linear(self) -> bool:
        """Whether wear is in proportion to the pressure."""
        return self.law.linear and (self.coating is None or self.coating.left is None)


@dataclass(frozen=True)
class CoatingWear:
    """What a coating would lose in each phase: beta~ S (m, n), mm/MPa^b, as of `BodyWear`.

    Attributes:
        rate: Of the coating.
        law: What of the pressure wears it.
        thickness: At the body's own contact nodes, mm.
        left: Of it where a step begins; None where it is worn through everywhere.
        cycles: Length of the step, by which what is worn in a cycle is that of the whole step over it.
    """

    rate: Array
    law: PressureLaw
    thickness: Array
    left: Array | None = None
    cycles: float = 1.0


@dataclass(frozen=True)
class PhasesWear:
    """The wear of the phases of a motion, or of some of them; equations (1), (26), (27).

    Attributes:
        punch, strip: beta~ S p^b at the interface nodes; None where the body does not wear.
        pairs: The surfaces opposite each other in each phase.
    """

    punch: BodyWear | None
    strip: BodyWear | None
    pairs: Sequence[ContactPair]

    @property
    def cap(self) -> float:
        """The lowest pressure beyond which the wear of a body grows no more, MPa; infinite without."""
        return min((body.law.cap for body in (self.punch, self.strip) if body is not None), default=np.inf)

    def softened(self, share: float) -> PhasesWear:
        """Return the same where a share of the pressure beyond a cap wears, too: 1 is without cap, 0 with it."""
        punch, strip = (
            None if one is None else replace(one, law=replace(one.law, beyond=share))
            for one in (self.punch, self.strip)
        )
        return replace(self, punch=punch, strip=strip)

    def some(self, phases: Sequence[int]) -> PhasesWear:
        """Return the wear of some of the phases."""
        chosen = list(phases)
        punch, strip = (None if body is None else _some(body, chosen) for body in (self.punch, self.strip))
        return PhasesWear(punch, strip, [self.pairs[k] for k in chosen])

    @cached_property
    def coated(self) -> bool:
        """Whether a body has a coating."""
        return any(body is not None and body.coating is not None for body in (self.punch, self.strip))

    def begun(self, worn: WornDepths, cycles: float | None = None) -> PhasesWear:
        """Return the wear from these depths on, through the coatings that are left there.

        Args:
            worn: Depths where a step begins.
            cycles: Of the step, of which each is worn the same; None for the phases once.
        """
        if not self.coated:
            return self
        parts = []
        for body, depth in ((self.punch, worn.punch), (self.strip, worn.strip)):
            if body is None or body.coating is None:
                parts.append(body)
                continue
            left = left_of(body.coating.thickness, depth)
            coating = replace(body.coating, left=left, cycles=1.0 if cycles is None else cycles)
            parts.append(replace(body, coating=coating))
        return replace(self, punch=parts[0], strip=parts[1])

    def _shares(self, body: BodyWear | None, pressure: Array) -> Shares | None:
        """Return what is worn of coating and base of a body, at its own nodes; None where all is of the base."""
        if body is None or body.coating is None or body.coating.left is None:
            return None
        own, left = body.coating, body.coating.left
        worn = (own.rate * own.law.value(pressure), body.rate * body.law.value(pressure))
        if body is self.punch:
            coating, base = (np.asarray(one.sum(axis=0)) for one in worn)
        else:
            coating, base = (
                np.sum([pair.wear_projection @ part for pair, part in zip(self.pairs, one, strict=True)], axis=0)
                for one in worn
            )
        return shares(own.cycles * coating, own.cycles * base, left)

    def _at_contact(self, pressure: Array) -> tuple[Shares | None, Shares | None]:
        """Return what is worn of coatings and bases, at the contact's nodes."""
        punch, strip = self._shares(self.punch, pressure), self._shares(self.strip, pressure)
        return punch, None if strip is None else strip.at(self.pairs[0].wear_interpolation)

    def depth(self, pressure: Array) -> Array:
        """Return the depth worn off the punch in each phase (m, n), mm."""
        if self.punch is None:
            return np.zeros_like(pressure)
        return self.punch.depth(pressure, self._shares(self.punch, pressure))

    def taken(self, pressure: Array) -> Array:
        """Return the depths worn off both bodies together at the contact nodes in each phase (m, n), mm."""
        bodies = zip((self.punch, self.strip), self._at_contact(pressure), strict=True)
        depths = [body.depth(pressure, worn) for body, worn in bodies if body is not None]
        if len(depths) == 1:
            return depths[0]
        return np.asarray(sum(depths, np.zeros_like(pressure)))

    def taken_slope(self, pressure: Array) -> Array:
        """Return the derivatives of `taken` to the pressures (m, n), mm/MPa."""
        slopes = [slope for slope in self.by_body(pressure) if slope is not None]
        return np.asarray(sum(slopes, np.zeros_like(pressure)))

    def worn(self, pressure: Array) -> WornDepths:
        """Return what all phases wear off both bodies at pressures (m, n)."""
        first = self.pairs[0]
        strip = np.zeros(len(first.strip.weights))
        if self.strip is not None:
            worn, coating = self._shares(self.strip, pressure), self.strip.coating
            for k, (pair, depth) in enumerate(zip(self.pairs, self.strip.depth(pressure), strict=True)):
                of_base = pair.wear_projection @ depth
                if worn is not None and coating is not None:
                    of_coating = pair.wear_projection @ (coating.rate[k] * coating.law.value(pressure[k]))
                    of_base = worn.coating * of_coating + worn.base * of_base
                strip += of_base
        punch = self.depth(pressure)
        return WornDepths(punch[0] if len(punch) == 1 else punch.sum(axis=0), strip)

    def opening(self, pressure: Array) -> Array:
        """Return the gap that the wear of all phases opens in each of them (m, n), mm."""
        worn = self.worn(pressure)
        if self.strip is None:
            return np.broadcast_to(worn.punch, pressure.shape)
        return np.array([pair.opening(worn.punch, worn.strip) for pair in self.pairs])

    def border(self, pressure: Array) -> tuple[Array, Array]:
        """Return L (m, n, q) and R (m, q, n): gap opened in phase k by unit pressures of phase j is L_k R_j.

        Worn depths are the q quantities between: R of what pressure wears, L of what worn depth opens.
        """
        m, n = pressure.shape
        right = np.zeros((m, self._left.shape[2], n))
        strip = 0
        if self.punch is not None:
            nodes, strip = np.arange(n), n
            right[:, nodes, nodes] = self.punch.slope(pressure, self._shares(self.punch, pressure))
        if self.strip is not None:
            for k, slope in enumerate(self._strip_slopes(pressure)):
                right[k, strip:] = slope.toarray()
        return self._left, right

    def _strip_slopes(self, pressure: Array) -> list[csr_array]:
        """Return the depth of the strip's nodes by unit pressures of each phase (n_strip, n), mm/MPa."""
        assert self.strip is not None
        worn, coating, found = self._shares(self.strip, pressure), self.strip.coating, list[csr_array]()
        for k, slope in enumerate(self.strip.slope(pressure)):
            onto = self.pairs[k].wear_projection
            of_base = csr_array(onto @ diags_array(slope))
            if worn is not None and coating is not None:
                of_coating = onto @ diags_array(coating.rate[k] * coating.law.slope(pressure)[k])
                of_base = csr_array(diags_array(worn.by_coating) @ of_coating + diags_array(worn.by_base) @ of_base)
            found.append(of_base)
        return found

    def by_body(self, pressure: Array) -> tuple[Array | None, Array | None]:
        """Return what unit pressures wear off punch and strip at pressures (m, n), mm/MPa; None where one does not."""
        bodies = zip((self.punch, self.strip), self._at_contact(pressure), strict=True)
        punch, strip = (None if body is None else body.slope(pressure, worn) for body, worn in bodies)
        return punch, strip

    def local(self, pressure: Array) -> Array | None:
        """Return the gap that unit pressures open at their own nodes (m, n), mm/MPa; None where others open, too."""
        if self.strip is not None or self.punch is None:
            return None
        return self.punch.slope(pressure, self._shares(self.punch, pressure))

    def slopes(self, pressure: Array) -> list[csr_array]:
        """Return the gap opened in the first phase by unit pressures of each phase (n, n), the same as L_1 R_k."""
        m, n = pressure.shape
        found = [csr_array((n, n)) for _ in range(m)]
        if self.punch is not None:
            slopes = self.punch.slope(pressure, self._shares(self.punch, pressure))
            found = [csr_array(diags_array(slope)) for slope in slopes]
        if self.strip is not None:
            material = self.pairs[0].wear_interpolation
            for k, slope in enumerate(self._strip_slopes(pressure)):
                found[k] = csr_array(found[k] + material @ slope)
        return found

    @cached_property
    def _left(self) -> Array:
        parts = []
        if self.punch is not None:
            n = len(self.pairs[0].weights)
            parts.append(np.broadcast_to(np.eye(n), (len(self.pairs), n, n)))
        if self.strip is not None:
            parts.append(np.array([pair.wear_interpolation.toarray() for pair in self.pairs]))
        return np.concatenate(parts, axis=2)


def _some(body: BodyWear, phases: list[int]) -> BodyWear:
    """Return the wear of a body in some of the phases."""
    coating = None if body.coating is None else replace(body.coating, rate=body.coating.rate[phases])
    return replace(body, rate=body.rate[phases], coating=coating)


@dataclass(frozen=True)
class StepWear:
    """The wear of `repeats` cycles at the pressures of their phases, as a compliance of the contact.

    Put into the inequality it makes the step implicit: pressure and wear belong to its end, so that
    it is stable for any number of repeats.
    """

    wear: PhasesWear
    repeats: float = 1.0

    def opening(self, pressure: Array) -> Array:
        """Return the gap opened in each phase (m, n), mm, by the pressures (m, n)."""
        return self.repeats * self.wear.opening(pressure)

    def local(self, pressure: Array) -> Array | None:
        """Return the gap that unit pressures open at their own nodes (m, n), mm/MPa; None where others open, too."""
        found = self.wear.local(pressure)
        return None if found is None else self.repeats * found

    def by_body(self, pressure: Array) -> tuple[Array | None, Array | None]:
        """Return what unit pressures wear off punch and strip in the step (m, n), mm/MPa; None where one does not."""
        punch, strip = (None if one is None else self.repeats * one for one in self.wear.by_body(pressure))
        return punch, strip

    def border(self, pressure: Array) -> tuple[Array, Array]:
        """Return L (m, n, q) and R (m, q, n) of its derivative L_k R_j."""
        left, right = self.wear.border(pressure)
        return left, self.repeats * right

    @property
    def curved(self) -> bool:
        """Whether something gives way by a law that is not linear: nothing does."""
        return False

    def layer(self, _pressure: Array) -> Array | None:
        """Return what opens each phase's own gaps alone: nothing does."""
        return None


@dataclass(frozen=True)
class Wear:
    """The wear rule of a motion: both bodies' laws and the sliding of each phase.

    Attributes:
        punch, strip: The laws.
        sliding: Of each body S, the integral of v^a over each phase at each node, (m, n) each, mm^a s^(1-a).
        pairs: The surfaces opposite each other in each phase.
        friction: Enters where the case gives beta or the energy of friction.
        coatings: Thickness of both bodies' coatings at their own contact nodes, mm.
        split: Whether nodes between regions share their pressure among unlike coefficients.
    """

    punch: WearLaw
    strip: WearLaw
    sliding: tuple[Array, Array]
    pairs: Sequence[ContactPair]
    friction: Friction
    coatings: tuple[Array, Array]
    split: bool = False

    @cached_property
    def constant(self) -> bool:
        """Whether no coefficient depends on more than the place."""
        return stays((self.punch, self.strip), self.friction) and not self.split

    @cached_property
    def _of_pressure(self) -> dict[str, PressureLaw]:
        """What of a pressure wears each body, by its key."""
        laws = {"wear.punch": self.punch, "wear.strip": self.strip}
        share = self.friction.contact.uniform_share
        return {key: PressureLaw.of(law, share) for key, law in laws.items()}

    def phases(self, conditions: Sequence[ContactConditions], which: Sequence[int] | None = None) -> PhasesWear:
        """Return the wear of all phases or of some of them.

        Args:
            conditions: Of each of these phases, for the coefficients that depend on them.
            which: Numbers of the phases; by default all.

        Raises:
            CaseError: a coefficient is negative or not finite there.
        """
        chosen = range(len(self.pairs)) if which is None else which
        bodies: list[BodyWear | None] = []
        given = zip((self.punch, self.strip), self.sliding, ("wear.punch", "wear.strip"), self.coatings, strict=True)
        for law, sliding, key, thickness in given:
            if not law.wears:
                bodies.append(None)
                continue

            def rates(law: WearLaw, sliding: Array = sliding, key: str = key) -> Array:
                numbered = zip(chosen, conditions, strict=True)
                found = [sliding[k] * coefficient(law, self.friction, state, key) for k, state in numbered]
                return found[0][None] if len(found) == 1 else np.array(found)

            above = law.of_coating
            coating = (
                None
                if above is None
                else CoatingWear(rates(above), PressureLaw.of(above, self.friction.contact.uniform_share), thickness)
            )
            bodies.append(BodyWear(rates(law), self._of_pressure[key], coating))
        return PhasesWear(bodies[0], bodies[1], [self.pairs[k] for k in chosen])


def stays(wear: tuple[WearLaw, WearLaw], friction: Friction) -> bool:
    """Return whether no wear coefficient depends on more than the place, those of coatings as well."""
    laws = [one for law in wear for one in (law, law.of_coating) if one is not None]
    of_friction = any(law.beta is not None or law.energy is not None for law in laws)
    dependent = any(isinstance(one, Dependence) and one.varies for one in (law.given_coefficient for law in laws))
    dependent = dependent or any(map(friction.contact.splits_pressure, laws))
    return not dependent and not friction.mixed and (friction.constant or not of_friction)


def coefficient(law: WearLaw, friction: Friction, conditions: ContactConditions, key: str) -> Array:
    """Return beta~ at the nodes (n,), in the internal unit of its exponents.

    beta~ = beta mu^b, K / H (Archard), the energy wear coefficient times mu, or k_A over the pressure from which on
    surfaces touch, beyond which wear grows no more. Under a share X of the pressure that asperities carry the wear is
    that of X p: beta~ has X^b, or the ratio of what of X p wears to what of p does by `PressureLaw.of`.

    Raises:
        CaseError: it is negative or not finite; `key` is the law's key.
    """
    found = _of_asperities(law, friction, conditions, key)
    if friction.contact.lubrication is not None:
        share = friction.share(conditions)
        if friction.contact.splits_pressure(law):
            part = PressureLaw.of(law).value(share * conditions.pressure)
            whole = PressureLaw.of(law, None).value(conditions.pressure)
            found = found * np.divide(part, whole, out=np.zeros_like(whole), where=whole > 0)
        else:
            found = found * (share if law.pressure_exponent == 1 else share**law.pressure_exponent)
    return found if isinstance(found, np.ndarray) else np.full(conditions.shape, found)


def _of_asperities(law: WearLaw, friction: Friction, conditions: ContactConditions, key: str) -> Array | float:
    """Return beta~ where asperities carry all the pressure (n,), or everywhere, as `coefficient`."""
    n, given = conditions.shape, law.given_coefficient
    scale = law.scale if law.per_area is None else 1 / law.touching_from
    if isinstance(given, Dependence):
        body = conditions.of("punch" if key.endswith("punch") else "strip")
        return given.values(
            body,
            n,
            scale,
            f"{key}.{law.coefficient_key}",
            effect=PressureLaw.of(law, friction.contact.uniform_share).value,
        )
    if given is not None:
        return scale * given
    if law.archard is not None and law.hardness is not None:
        return law.archard / law.hardness
    mu = friction.of_asperities(conditions)
    if law.energy is not None:
        return law.energy * mu
    return (law.beta or 0.0) * mu**law.pressure_exponent
