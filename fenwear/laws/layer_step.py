"""A step of half-cycles or cycles with what lies between: the gap by its own pressures, and its change of state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from fenwear.common.arrays import Array
from fenwear.laws.compliant_layer import CoatedClosure, compressed
from fenwear.laws.debris import DebrisCycle
from fenwear.laws.friction import ContactConditions
from fenwear.laws.law_states import Evolution, Held
from fenwear.laws.layers import DEBRIS, PLASTIC, Layers
from fenwear.laws.wear import PhasesWear, WornDepths

NUDGE, LEAST = 1e-6, 1e-300  # of the largest pressure, for differences; what divides where there is nothing


@dataclass(frozen=True)
class LayerEvolution:
    """Wear of phases of the motion, one after the other, and its effect on the layers.

    Attributes:
        layers: The layers.
        wear: Of these phases.
        debris: Their effect on them.
        evolution: Their effect on the states of laws; None without.
        ended: States of laws at their end, where they are known.
    """

    layers: Layers
    wear: PhasesWear
    debris: DebrisCycle
    evolution: Evolution | None = None
    ended: Held | None = None

    @classmethod
    def over(
        cls,
        layers: Layers,
        wear: PhasesWear,
        slid: Array,
        evolution: Evolution | None = None,
        conditions: Sequence[ContactConditions] = (),
    ) -> LayerEvolution:
        """Return the evolution of phases with these sliding distances (m, n), mm, at conditions for the debris."""
        return cls(layers, wear, layers.debris.over(slid, conditions, layers.places(wear.pairs)), evolution)

    def worn(
        self, pressure: Array, before: WornDepths, cycles: float | None = None, flowed: Array | float = 0.0
    ) -> WornDepths:
        """Return the wear of the phases, with the changes of the layers' states.

        Args:
            pressure: (m, n), MPa.
            before: Depths and state at the start of the step.
            cycles: Of a step that is implicit, for each of which changes are returned, or with 0 the rate at its start;
                None for the phases once.
            flowed: Addition to the plastic depth (n,), mm; by default nothing.
        """
        worn = self.wear.begun(before, cycles).worn(pressure)
        if not len(before.between) and not len(before.carried):
            return worn
        changes, carried = np.zeros(before.between.shape), np.zeros(before.carried.shape)
        if self.layers.debris.present:
            lies = carried if self.layers.strip_carries else changes
            lies[: len(DEBRIS)] = self.debris_changes(pressure, before, cycles)
        if self.layers.hardness < np.inf:
            changes[self.layers.row(PLASTIC)] = flowed
        depths = WornDepths(worn.punch, worn.strip, changes, carried=carried)
        if self.evolution is None or not self.layers.memory.names:
            return depths
        return self.layers.with_held(depths, self._evolved(pressure, before, cycles))

    def _evolved(self, pressure: Array, before: WornDepths, cycles: float | None) -> Held:
        """Return by how much the states of laws change, as `worn`."""
        assert self.evolution is not None
        held = self.layers.held(before)
        if cycles is None and self.ended is not None:
            return self.evolution.memory.bounded(self.ended) - held
        evolution = self.evolution.at(pressure)
        if cycles is None:
            return evolution.after(held) - held
        if cycles == 0:
            return evolution.rate(held)[0]
        return (evolution.implicit(held, cycles) - held).times(1 / cycles)

    def filled(self, pressure: Array, before: WornDepths, cycles: float | None) -> tuple[Array, Array]:
        """Return the gap that states of laws fill more at the contact's nodes (n,) and on the strip (n_s,), mm."""
        (contact, strip), changes = self.layers.memory.fills, self._evolved(pressure, before, cycles)
        return contact @ changes.contact, strip @ changes.strip

    def debris_changes(self, pressure: Array, before: WornDepths, cycles: float | None) -> tuple[Array, Array]:
        """Return the change of the debris' thickness and the ejected debris, as `worn`.

        At the contact's nodes (n,) each, or at those of a strip that carries it (n_strip,).
        """
        taken = self._at_debris(self.wear.begun(before, cycles).taken(pressure))
        thickness = self.layers.lies(before)
        if cycles is None:
            return self.debris.change(thickness, taken)
        return self.debris.rate(thickness, taken, cycles)

    def resting(self, pressure: Array) -> Array:
        """Return the thickness of the debris that such cycles leave in the end (n,), mm."""
        lies = self.resting_at_debris(pressure)
        return np.asarray(self.wear.pairs[0].wear_interpolation @ lies) if self.layers.strip_carries else lies

    def resting_at_debris(self, pressure: Array) -> Array:
        """Return the thickness at rest where debris lies: at contact nodes, or on a strip that carries it."""
        fed = (self.debris.fed * self._at_debris(self.wear.taken(pressure))).sum(axis=0)
        return np.asarray(fed / self.debris.loss)

    def _at_debris(self, depths: Array) -> Array:
        """Return depths of the phases at the contact's nodes (m, n) where debris lies: there, or on the strip."""
        places = self.layers.places(self.wear.pairs)
        return np.array([onto @ depth for onto, depth in zip(places, depths, strict=True)]) if places else depths

    def step(
        self, before: WornDepths, cycles: float | None = None, *, implicit: bool = True, capped: bool = False
    ) -> LayerStep | None:
        """Return the opening law of a step by its pressures; explicitly the compliance alone, None without one.

        Args:
            before, cycles: As of `worn`.
            implicit: Whether the wear of the step, and what becomes of it, opens its own gaps.
            capped: Whether the contact itself lets no pressure beyond the hardness.
        """
        gives_way = implicit or self.layers.gives_way(capped=capped)
        return LayerStep(self, before, cycles, implicit, capped) if gives_way else None


@dataclass(frozen=True)
class Filling:
    """The gap that states of laws fill in a step, linear in the pressures around those of its conditions.

    The change by all phases is shared among them as their wear is: a way to the solution, at which conditions have its
    pressures.

    Attributes:
        near: These pressures (m, n), MPa.
        filled: In a cycle, at the contact's nodes (n,) and on the strip (n_s,), mm.
        share: Of the phases in what pressures change (m, n).
        onto: From the contact's nodes onto the strip, of each phase.
        here, below: Change at the end of the step by unit pressures in all phases (n,) and (n_s,), mm/MPa.
    """

    near: Array
    filled: tuple[Array, Array]
    share: Array
    onto: Sequence[csr_array]
    here: Array
    below: Array

    def at(self, pressure: Array, length: float) -> tuple[Array, Array]:
        """Return the gap that is filled in a cycle at pressures (m, n), in a step of a length."""
        change = self.share * (pressure - self.near) / length
        put = sum(place @ change_there for place, change_there in zip(self.onto, change, strict=True))
        return self.filled[0] + self.here * change.sum(axis=0), self.filled[1] + self.below * put


@dataclass(frozen=True)
class LayerStep:
    """The wear of a step at the pressures of its phases, and what lies between, as a compliance of the contact.

    Put into the inequality it makes the step implicit: pressure, wear and the state of what lies between belong to its
    end, so that it is stable for any number of cycles.

    Attributes:
        passing: The phases.
        before: Depths and state at the start.
        cycles: Of the step; None for the phases once.
        implicit: Whether wear opens the gaps of the step itself; else the compliance alone.
        capped: Whether the contact itself lets no pressure beyond the hardness.
    """

    passing: LayerEvolution
    before: WornDepths
    cycles: float | None
    implicit: bool = True
    capped: bool = False

    @property
    def _length(self) -> float:
        return 1.0 if self.cycles is None else self.cycles

    @property
    def _worn(self) -> PhasesWear:
        return self.passing.wear.begun(self.before, self.cycles)

    def opening(self, pressure: Array) -> Array:
        """Return the gap opened in each phase (m, n), mm, by the pressures (m, n)."""
        passing = self.passing
        closed = passing.layers.closing(pressure, capped=self.capped)
        if passing.layers.softens:
            closed = closed + self._coatings(pressure).closure(pressure)
        if not self.implicit:
            return closed
        added, below = self._added(pressure)
        opened = self._worn.opening(pressure) - added
        if self._fills_below:
            opened = opened - np.array([pair.wear_interpolation @ below for pair in passing.wear.pairs])
        return self._length * opened + closed

    def _added(self, pressure: Array) -> tuple[Array | float, Array | float]:
        """Return the thickness that debris and states gain in a cycle at the contact's nodes, and on the strip, mm."""
        passing = self.passing
        added: Array | float = 0.0
        below: Array | float = 0.0
        if self._fills:
            added, below = self._filling.at(pressure, self._length)
        if not passing.layers.debris.present:
            return added, below
        debris = passing.debris_changes(pressure, self.before, self.cycles)[0]
        return (added, below + debris) if passing.layers.strip_carries else (added + debris, below)

    def local(self, pressure: Array) -> Array | None:
        """Return the gap that unit pressures open at their own nodes in all phases (m, n); None where others open."""
        if not self.implicit:
            return np.zeros_like(pressure)
        if self._fills_below:
            return None
        by_wear = self._worn.local(pressure)
        if by_wear is None:
            return None
        softens = self.passing.layers.softens
        share = self._felt(pressure)[0].mean(axis=0) if softens else 1.0  # of all phases: a step to the solution
        return self._length * share * by_wear - self._covered(pressure)

    def border(self, pressure: Array) -> tuple[Array, Array]:
        """Return L (m, n, q) and R (m, q, n) of the openings L_k R_j by pressures in all phases."""
        left, right = self._worn.border(pressure)
        right = self._length * right
        if self.passing.layers.softens:
            left = self._felt_by_border(left, pressure)
        if not self._fills_here and not self._fills_below:
            return left, right
        if self._fills_below:
            left, right = self._with_carried(left, right, pressure)
        if not self._fills_here:
            return left, right
        covered = self._covered(pressure)
        unit = np.eye(pressure.shape[1])
        left = np.concatenate([left, np.broadcast_to(unit, (len(left), *unit.shape))], axis=2)
        return left, np.concatenate([right, -covered[:, None, :] * unit], axis=1)

    def _felt_by_border(self, left: Array, pressure: Array) -> Array:
        """Return L of `border`, reduced by the compression of coatings."""
        (punch, strip), n = self._felt(pressure), pressure.shape[1]
        first = n if self._worn.punch.wears else 0
        reduced = left.copy()
        reduced[:, :, :first] *= punch[:, :, None]
        reduced[:, :, first:] *= strip[:, :, None]
        return reduced

    def _with_carried(self, left: Array, right: Array, pressure: Array) -> tuple[Array, Array]:
        """Return both with what the strip carries, as its wear."""
        reads = np.array([pair.wear_interpolation.toarray() for pair in self.passing.wear.pairs])
        onto = np.array([pair.wear_projection.toarray() for pair in self.passing.wear.pairs])
        puts = sum(onto * slopes[:, :, None] * taken[:, None, :] for slopes, taken in self._puts(pressure))
        return np.concatenate([left, reads], axis=2), np.concatenate([right, -puts], axis=1)

    def _puts(self, pressure: Array) -> list[tuple[Array, Array]]:
        """Return what unit pressures put on the strip: factors there (m, n_s) and at the contact's nodes (m, n)."""
        factors = []
        if self.passing.layers.strip_carries:
            factors.append((self.passing.debris.slope(self.cycles), self._worn.taken_slope(pressure)))
        if self._fills:
            factors.append((np.tile(self._filling.below, (len(pressure), 1)), self._filling.share))
        return factors

    def by_body(self, pressure: Array) -> tuple[Array | None, Array | None]:
        """Return the openings by unit pressures at the punch's nodes, and the strip's wear (m, n), mm/MPa."""
        if not self.implicit:
            return None, None
        felt: Sequence[Array | float] = (1.0, 1.0)
        if self.passing.layers.softens:
            felt = [share.mean(axis=0) for share in self._felt(pressure)]
        both = zip(self._worn.by_body(pressure), felt, strict=True)
        punch, strip = (None if compliance is None else self._length * compliance * share for compliance, share in both)
        if not self._fills_here and not self._fills_below:
            return punch, strip
        if self._fills_below:
            strip = self._carried_below(pressure, strip)
        if not self._fills_here:
            return punch, strip
        covered = self._covered(pressure)
        return -covered if punch is None else punch - covered, strip

    def _carried_below(self, pressure: Array, strip: Array | None) -> Array:
        """Return the strip's wear by unit pressures less what they put on it (m, n), at places below.

        A step to the solution, on grids, whose residual has what is put on the strip as it is.
        """
        reads = [pair.wear_interpolation for pair in self.passing.wear.pairs]
        put = np.zeros_like(pressure)
        for slopes, taken in self._puts(pressure):
            put += np.array([read @ slope for read, slope in zip(reads, slopes, strict=True)]) * taken
        return -put if strip is None else strip - put

    @property
    def curved(self) -> bool:
        """Whether a layer has a closure that is not linear."""
        return self.passing.layers.gives_way(capped=self.capped)

    def layer(self, pressure: Array) -> Array | None:
        """Return the gap that unit pressures open at their own nodes in their own phase alone (m, n); None for none."""
        if not self.curved:
            return None
        slope = self.passing.layers.slope(pressure, capped=self.capped)
        return slope + self._coatings(pressure).slope(pressure) if self.passing.layers.softens else slope

    def _depths(self, pressure: Array) -> tuple[Array, Array]:
        """Return the depths of punch and strip for the compliance of coatings: those at the step's end."""
        punch, strip = self.before.punch, self.before.strip
        if not self.implicit:
            return punch, strip
        lost = self._worn.worn(pressure)
        return punch + self._length * lost.punch, strip + self._length * lost.strip

    def _coatings(self, pressure: Array) -> CoatedClosure:
        """Return the compliant coatings in each phase (m, n)."""
        return self.passing.layers.coatings_closure(self.passing.wear.pairs, *self._depths(pressure))

    def _felt(self, pressure: Array) -> tuple[Array, Array]:
        """Return the shares of the wear of punch and strip that open the gap of each phase (m, n) each.

        Where a coating goes that was compressed its compression does, too.
        """
        layers = self.passing.layers
        left = layers.coatings_left(self.passing.wear.pairs, *self._depths(pressure))
        punch, strip = (
            np.where(thickness > 0, 1 - compressed(pressure, soft.modulus), 1.0)
            for thickness, soft in zip(left, layers.soft, strict=True)
        )
        return punch, strip

    def _covered(self, pressure: Array) -> Array:
        """Return the thickness at the end by unit pressures at the contact's nodes (m, n), mm/MPa."""
        covered = np.zeros_like(pressure)
        if self.passing.layers.lies_here:
            covered = self.passing.debris.slope(self.cycles) * self._worn.taken_slope(pressure)
        return covered + self._filling.here * self._filling.share if self._fills else covered

    @cached_property
    def _filling(self) -> Filling:
        """The gap that states fill at the pressures that the conditions of the phases have, and nearby."""
        passing, evolution = self.passing, self.passing.evolution
        assert evolution is not None
        near = np.array([condition.pressure for condition in evolution.conditions])
        size = NUDGE * max(float(np.abs(near).max()), LEAST)
        smaller, larger = (passing.filled(pressures, self.before, self.cycles) for pressures in (near, near + size))
        wearing = np.maximum(self._worn.taken_slope(near), LEAST)
        share = wearing / wearing.sum(axis=0)
        onto = [pair.wear_projection for pair in passing.wear.pairs]
        below = sum(place @ share_there for place, share_there in zip(onto, share, strict=True))
        by_here, by_below = ((after - begin) / size for begin, after in zip(smaller, larger, strict=True))
        length = self._length
        return Filling(near, smaller, share, onto, length * by_here, length * by_below / np.maximum(below, LEAST))

    @property
    def _fills(self) -> bool:
        """Whether states of laws fill a part of the gap."""
        return self.passing.evolution is not None and self.passing.layers.memory.filling

    @property
    def _fills_here(self) -> bool:
        """Whether what lies at the contact's nodes fills a part of the gap."""
        layers = self.passing.layers
        return layers.lies_here or (self._fills and bool(layers.memory.fills[0].any()))

    @property
    def _fills_below(self) -> bool:
        """Whether what the strip carries fills a part of the gap."""
        layers = self.passing.layers
        return layers.strip_carries or (self._fills and bool(layers.memory.fills[1].any()))
