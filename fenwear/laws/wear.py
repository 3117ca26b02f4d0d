"""The wear rule: depths worn in a phase on both bodies, and the wear of a step as a compliance of the contact.

The punch's worn depth belongs to its contact nodes, the strip's to the strip's nodes, whose material
moves under the punch: what is worn in a phase is put on the strip at its offset, so that its
cross-section is what the pressure wore, and what is felt is read there. On a closed track the
strip's wear spreads along the whole of it, see `fenwear.surfaces.track`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np
from scipy.sparse import csr_array, diags_array

from fenwear.case import Dependence, WearLaw
from fenwear.common.arrays import Added, Array
from fenwear.laws.coating import Shares, left_of, shares
from fenwear.laws.friction import ContactConditions, Friction
from fenwear.laws.pressure_law import PressureLaw
from fenwear.surfaces import ContactPair

NOTHING: Array = np.zeros((0, 0))  # between the surfaces
STIFF: Array = np.zeros(0)  # what bodies have crept that do not creep


@dataclass(frozen=True)
class WornDepths(Added):
    """Worn depths, and the states of what lies between the surfaces and of what creeps.

    Attributes:
        punch: At the punch's contact nodes (n,), mm.
        strip: At the strip's contact nodes (n_strip,), on its material, mm.
        between: By the rows of `fenwear.laws.Layers` (rows, n); without rows where nothing lies between that changes.
        crept: Of what creeps (size,), as `fenwear.system.surface_creep.Creep` has it; empty where nothing does.
        carried: States of the strip's own material (rows, n_strip), see `fenwear.laws.law_states`; without rows mostly.
    """

    punch: Array
    strip: Array
    between: Array = field(default_factory=lambda: NOTHING)
    crept: Array = field(default_factory=lambda: STIFF)
    carried: Array = field(default_factory=lambda: NOTHING)

    def same(self, other: WornDepths) -> bool:
        """Return whether all of it is equal to another's."""
        return all(map(np.array_equal, vars(self).values(), vars(other).values()))


@dataclass(frozen=True)
class BodyWear:
    """Wear of a body in each phase: rate = beta~ S (m, n), mm/MPa^b, times what of the pressure wears.

    Attributes:
        rate: At the interface nodes; zero where the body does not wear.
        law: Part of the pressure that wears it.
        pairs: The surfaces in each phase, where its nodes are not those of the contact.
        wears: Whether the body does.
    """

    rate: Array
    law: PressureLaw
    pairs: Sequence[ContactPair] = ()
    wears: bool = True

    @property
    def coated(self) -> bool:
        """Whether it has a coating."""
        return False

    @property
    def linear(self) -> bool:
        """Whether wear is in proportion to the pressure."""
        return self.law.linear

    def some(self, phases: list[int]) -> Self:
        """Return the wear in some of the phases."""
        return replace(self, rate=self.rate[phases], pairs=[self.pairs[k] for k in phases] if self.pairs else ())

    def begun(self, depth: Array, cycles: float) -> BodyWear:  # noqa: ARG002
        """Return the wear from a depth on, through the coating that is left there, in a step of so many cycles."""
        return self

    def at(self, pressure: Array) -> BodyWear:  # noqa: ARG002
        """Return the wear at pressures (m, n), which determine the shares of the coating and the base."""
        return self

    def depth(self, pressure: Array) -> Array:
        """Return the depths at the interface nodes (m, n), mm."""
        return self.rate * self.law.value(pressure)

    def slope(self, pressure: Array) -> Array:
        """Return their derivatives to the pressures (m, n), mm/MPa."""
        return self.rate * self.law.slope(pressure)

    def on_material(self, pressure: Array) -> list[Array]:
        """Return the depths at the body's own nodes, of each phase (n_own,), mm."""
        return self._put(self.depth(pressure))

    def slopes_on_material(self, pressure: Array) -> list[csr_array]:
        """Return the derivatives of these depths to the pressures of each phase (n_own, n), mm/MPa."""
        pairs = zip(self.pairs, self.slope(pressure), strict=True)
        return [csr_array(pair.wear_projection @ diags_array(slope)) for pair, slope in pairs]

    def _put(self, depths: Array) -> list[Array]:
        """Return depths at the interface nodes (m, n) at the body's own ones, of each phase."""
        return [pair.wear_projection @ depth for pair, depth in zip(self.pairs, depths, strict=True)]


OF_BASE = Shares(*map(np.asarray, (0.0, 1.0, 0.0, 1.0)))


@dataclass(frozen=True)
class CoatedWear(BodyWear):
    """Wear of a coated body in each phase, of its coating as long as that lasts, and of the base, `rate` and `law`.

    Attributes:
        coating: Wear of the coating if it lasted.
        thickness: Of it at the body's own contact nodes, mm.
        left: Of it where a step begins (n_own,), mm.
        cycles: Length of the step, by which what is worn in a cycle is that of the whole step over it.
        shares: Worn parts of coating and base at the body's own nodes.
        here: The same at the interface nodes.
    """

    coating: BodyWear = field(kw_only=True)
    thickness: Array = field(kw_only=True)
    left: Array = field(default_factory=lambda: np.zeros(1), kw_only=True)
    cycles: float = 1.0
    shares: Shares = OF_BASE
    here: Shares = OF_BASE

    @property
    def coated(self) -> bool:
        """Whether it has a coating."""
        return True

    @property
    def linear(self) -> bool:
        """Whether wear is in proportion to the pressure: where the coating is worn through."""
        return self.law.linear and not self.left.any()

    def some(self, phases: list[int]) -> Self:
        """Return the wear in some of the phases."""
        return replace(super().some(phases), coating=self.coating.some(phases))

    def begun(self, depth: Array, cycles: float) -> BodyWear:
        """Return the wear from a depth on."""
        return replace(self, left=left_of(self.thickness, depth), cycles=cycles)

    def at(self, pressure: Array) -> BodyWear:
        """Return the wear at pressures (m, n)."""
        both = (self.coating.depth(pressure), super().depth(pressure))
        coating, base = (np.sum(self._put(depths) if self.pairs else depths, axis=0) for depths in both)
        phase_shares = shares(self.cycles * coating, self.cycles * base, self.left)
        here = phase_shares.at(self.pairs[0].wear_interpolation) if self.pairs else phase_shares
        return replace(self, shares=phase_shares, here=here)

    def depth(self, pressure: Array) -> Array:
        """Return the depths at the interface nodes (m, n), mm."""
        return self.here.of(self.coating.depth(pressure), super().depth(pressure))

    def slope(self, pressure: Array) -> Array:
        """Return their derivatives to the pressures (m, n), mm/MPa."""
        here = self.here
        return here.by_coating * self.coating.slope(pressure) + here.by_base * super().slope(pressure)

    def on_material(self, pressure: Array) -> list[Array]:
        """Return the depths at the body's own nodes, of each phase (n_own,), mm."""
        both = zip(self._put(self.coating.depth(pressure)), self._put(super().depth(pressure)), strict=True)
        return [self.shares.of(*depths) for depths in both]

    def slopes_on_material(self, pressure: Array) -> list[csr_array]:
        """Return the derivatives of these depths to the pressures of each phase (n_own, n), mm/MPa."""
        by_coating, by_base = (diags_array(share) for share in (self.shares.by_coating, self.shares.by_base))
        both = zip(self.pairs, self.coating.slope(pressure), super().slope(pressure), strict=True)
        return [
            csr_array(by_coating @ pair.wear_projection @ diags_array(coating))
            + csr_array(by_base @ pair.wear_projection @ diags_array(base))
            for pair, coating, base in both
        ]


@dataclass(frozen=True)
class PhasesWear:
    """The wear of the phases of a motion, or of some of them; equations (1), (26), (27).

    Attributes:
        punch, strip: beta~ S p^b at the interface nodes.
        pairs: The surfaces opposite each other in each phase.
    """

    punch: BodyWear
    strip: BodyWear
    pairs: Sequence[ContactPair]

    @property
    def bodies(self) -> tuple[BodyWear, ...]:
        """Bodies that wear."""
        return tuple(body for body in (self.punch, self.strip) if body.wears)

    @property
    def cap(self) -> float:
        """The lowest pressure beyond which the wear of a body grows no more, MPa; infinite without."""
        return min(self.punch.law.cap, self.strip.law.cap)

    def some(self, phases: Sequence[int]) -> PhasesWear:
        """Return the wear of some of the phases."""
        chosen = list(phases)
        return PhasesWear(self.punch.some(chosen), self.strip.some(chosen), [self.pairs[k] for k in chosen])

    @cached_property
    def coated(self) -> bool:
        """Whether a body has a coating."""
        return self.punch.coated or self.strip.coated

    def begun(self, worn: WornDepths, cycles: float | None = None) -> PhasesWear:
        """Return the wear from these depths on, through the coatings that are left there.

        Args:
            worn: Depths where a step begins.
            cycles: Of the step, of which each is worn the same; None for the phases once.
        """
        if not self.coated:
            return self
        length = 1.0 if cycles is None else cycles
        return replace(self, punch=self.punch.begun(worn.punch, length), strip=self.strip.begun(worn.strip, length))

    def depth(self, pressure: Array) -> Array:
        """Return the depth worn off the punch in each phase (m, n), mm."""
        return self.punch.at(pressure).depth(pressure)

    def taken(self, pressure: Array) -> Array:
        """Return the depths worn off both bodies together at the contact nodes in each phase (m, n), mm."""
        return np.asarray(sum(self.by_bodies(pressure)))

    def by_bodies(self, pressure: Array) -> tuple[Array, Array]:
        """Return the depths worn off punch and strip at the contact nodes in each phase (m, n), mm."""
        punch, strip = (body.at(pressure).depth(pressure) for body in (self.punch, self.strip))
        return punch, strip

    def taken_slope(self, pressure: Array) -> Array:
        """Return the derivatives of `taken` to the pressures (m, n), mm/MPa."""
        return np.asarray(sum((body.at(pressure).slope(pressure) for body in self.bodies), np.zeros_like(pressure)))

    def worn(self, pressure: Array) -> WornDepths:
        """Return the wear of both bodies in all phases at pressures (m, n)."""
        strip: Array = np.zeros(len(self.pairs[0].strip.weights))
        if self.strip.wears:
            strip = sum(self.strip.at(pressure).on_material(pressure), strip)
        punch = self.depth(pressure)
        return WornDepths(punch[0] if len(punch) == 1 else punch.sum(axis=0), strip)

    def opening(self, pressure: Array) -> Array:
        """Return the gap that the wear of all phases opens in each of them (m, n), mm."""
        worn = self.worn(pressure)
        if not self.strip.wears:
            return np.broadcast_to(worn.punch, pressure.shape)
        return np.array([pair.opening(worn.punch, worn.strip) for pair in self.pairs])

    def border(self, pressure: Array) -> tuple[Array, Array]:
        """Return L (m, n, q) and R (m, q, n): gap opened in phase k by unit pressures of phase j is L_k R_j.

        Worn depths are the q quantities between: R of what pressure wears, L of what worn depth opens.
        """
        m, n = pressure.shape
        right = np.zeros((m, self._left.shape[2], n))
        strip = n if self.punch.wears else 0
        if self.punch.wears:
            nodes = np.arange(n)
            right[:, nodes, nodes] = self.punch.at(pressure).slope(pressure)
        if self.strip.wears:
            right[:, strip:] = [slope.toarray() for slope in self.strip.at(pressure).slopes_on_material(pressure)]
        return self._left, right

    def by_body(self, pressure: Array) -> tuple[Array | None, Array | None]:
        """Return the wear of both bodies by unit pressures at pressures (m, n), mm/MPa; None of one without wear."""
        punch, strip = (body.at(pressure).slope(pressure) if body.wears else None for body in (self.punch, self.strip))
        return punch, strip

    def local(self, pressure: Array) -> Array | None:
        """Return the gap that unit pressures open at their own nodes (m, n), mm/MPa; None where others open, too."""
        if self.strip.wears or not self.punch.wears:
            return None
        return self.punch.at(pressure).slope(pressure)

    def slopes(self, pressure: Array) -> list[csr_array]:
        """Return the gap opened in the first phase by unit pressures of each phase (n, n), the same as L_1 R_k."""
        opened = [csr_array(diags_array(slope)) for slope in self.punch.at(pressure).slope(pressure)]
        if self.strip.wears:
            material = self.pairs[0].wear_interpolation
            below = self.strip.at(pressure).slopes_on_material(pressure)
            opened = [csr_array(above + material @ slope) for above, slope in zip(opened, below, strict=True)]
        return opened

    @cached_property
    def _left(self) -> Array:
        m, n = len(self.pairs), len(self.pairs[0].weights)
        parts: list[Array] = [np.zeros((m, n, 0))]
        if self.punch.wears:
            parts.append(np.broadcast_to(np.eye(n), (m, n, n)))
        if self.strip.wears:
            parts.append(np.array([pair.wear_interpolation.toarray() for pair in self.pairs]))
        return np.concatenate(parts, axis=2)


def stays(wear: tuple[WearLaw, WearLaw], friction: Friction) -> bool:
    """Return whether no wear coefficient depends on more than the place, those of coatings as well."""
    laws = [layer_law for law in wear for layer_law in (law, law.of_coating) if layer_law is not None]
    of_friction = any(law.energy is not None for law in laws)
    dependent = any(law.varies or friction.contact.splits_pressure(law) for law in laws)
    return not dependent and not friction.mixed and (friction.constant or not of_friction)


def coefficient(law: WearLaw, friction: Friction, conditions: ContactConditions, key: str) -> Array:
    """Return beta~ at the nodes (n,), in the internal unit of its exponents.

    beta~ is the coefficient itself, K / H (Archard), the energy wear coefficient times mu, or k_A over the pressure
    from which on surfaces touch, beyond which wear grows no more. Under a share X of the pressure that asperities carry
    the wear is that of X p: beta~ has X^b, or the ratio of what of X p wears to what of p does by `PressureLaw.of`.

    Raises:
        CaseError: it is negative or not finite; `key` is the law's key.
    """
    beta = _of_asperities(law, friction, conditions, key)
    if friction.contact.lubrication is not None:
        share = friction.share(conditions)
        if friction.contact.splits_pressure(law):
            part = PressureLaw.of(law).value(share * conditions.pressure)
            of_node = PressureLaw.of(law, None).value(conditions.pressure)
            beta = beta * np.divide(part, of_node, out=np.zeros_like(of_node), where=of_node > 0)
        else:
            beta = beta * (share if law.pressure_exponent == 1 else share**law.pressure_exponent)
    return beta if isinstance(beta, np.ndarray) else np.full(conditions.shape, beta)


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
    return (law.energy or 0.0) * friction.of_asperities(conditions.of("friction"), conditions)
