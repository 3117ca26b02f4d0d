"""Wear of both bodies in time steps of contact with stick, and its effect on the layers.

The coatings of both bodies in partial slip: what of them and of their bases is worn, and how jumps count depths.

Variables of laws of friction and wear at the nodes in time steps, and of the cycle before them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from fenwear.common.arrays import Array
from fenwear.laws import Evolution, Layers
from fenwear.laws.coating import CoatedBody, Shares, left_of, shares
from fenwear.laws.debris import DebrisCycle
from fenwear.laws.friction import ContactConditions
from fenwear.laws.layers import DEBRIS, PLASTIC
from fenwear.laws.local_laws import LocalLaws, LocalWear
from fenwear.laws.sliding_tensors import CycleShear, SlidingWays
from fenwear.laws.wear import WornDepths
from fenwear.steps.stick_heat import StickHeat
from fenwear.steps.stick_interface import OppositeBodies
from fenwear.steps.stick_program import Program
from fenwear.steps.stick_records import TimeStepRecords
from fenwear.steps.stick_state import PartialSlipState
from fenwear.surfaces import ContactPair


class StepSlips(NamedTuple):
    """Variables of laws in k steps: pressure and slip (k, n), durations (k,), temperatures at their ends (k, 2, n)."""

    pressure: Array
    slid: Array
    duration: Array
    temperature: Array


@dataclass(frozen=True)
class StepConditions:
    """Values at each node in the time steps of a cycle.

    Attributes:
        interface: The bodies.
        program: Of a cycle.
        laws: Of friction and wear that change with the state of each node; None where they stay.
        heat: Of friction; None without.
        strip_wears: Whether the strip does.
    """

    interface: OppositeBodies
    program: Program
    laws: LocalLaws | None
    heat: StickHeat | None
    strip_wears: bool

    @property
    def asks_cycle(self) -> bool:
        """Whether a law depends on what a whole cycle does: its cross-shear, its mean pressure."""
        return self.laws is not None and (self.laws.asks("cs") or self.laws.asks("pm"))

    def at_start(self, at: PartialSlipState) -> dict[str, Any]:
        """Return what is known of the nodes at the start of a time step, by the names of `LocalLaws.conditions`."""
        warm = None
        if self.heat is not None and len(at.temperature):
            punch, strip = self.heat.surfaces(at.temperature)
            warm = punch, strip
        return {
            "temperatures": warm,
            "worn": at.worn,
            "slid": at.slid,
            "speed": at.speed,
            "cycle": self._shear(at),
        }

    def _shear(self, at: PartialSlipState) -> CycleShear | None:
        """Return what laws know of the last cycle before a state; None where none asks.

        A time step that has not been computed slips nothing at the mean pressure.
        """
        if not self.asks_cycle:
            return None
        middle, mean, places = self.interface.middle, self.interface.middle.rigid.mean_pressure, self.program.steps
        positions = [self.interface.position(step.offset) for step in places]
        slips: Array = np.nan_to_num(at.slips)
        ways = np.array([position.slid(slips[k]) for k, position in enumerate(positions)])
        lengths = np.linalg.norm(ways, axis=2)
        directions = ways / np.where(lengths > 0, lengths, 1.0)[:, :, None]
        pairs, wears = [position.pair for position in positions], self.strip_wears
        known = SlidingWays(pairs, middle.pair, lengths, directions, wears, mean, asked=True)
        return known.shear(np.where(np.isnan(at.pressures), mean, at.pressures))

    def of_steps(self, slips: StepSlips, before: PartialSlipState) -> list[ContactConditions]:
        """Return the conditions of laws in steps that begin at a state: temperatures are those at the start of each."""
        laws, known = self.laws, self.at_start(before)
        assert laws is not None
        slid = before.slid + np.cumsum(slips.slid, axis=0)
        warm = [known["temperatures"]] * len(slid)
        if known["temperatures"] is not None:
            warm[1:] = [(punch, strip) for punch, strip in slips.temperature[:-1]]
        return [
            laws.conditions(
                pair,
                slips.pressure[k],
                speed=slips.slid[k] / slips.duration[k],
                temperatures=warm[k],
                worn=before.worn,
                slid=slid[k],
                debris=self.interface.layers.facing(pair, before.worn),
                cycle=known["cycle"],
            )
            for k, pair in enumerate(self.pairs(slips, before))
        ]

    def pairs(self, slips: StepSlips, before: PartialSlipState) -> list[ContactPair]:
        """Return the surfaces opposite each other in steps that begin at a state."""
        steps = self.program.steps
        places = [steps[(before.next_step + k) % len(steps)].offset for k in range(len(slips.slid))]
        return [self.interface.position(place).pair for place in places]


BothShares = tuple[Shares, Shares]  # of punch and strip


@dataclass(frozen=True)
class CoatedBodies:
    """The coatings of punch and strip."""

    punch: CoatedBody
    strip: CoatedBody

    @classmethod
    def bare(cls, punch: int, strip: int) -> CoatedBodies:
        """Return bodies of so many contact nodes without coatings."""
        return cls(*(CoatedBody(np.zeros(nodes), np.ones(nodes)) for nodes in (punch, strip)))

    @property
    def any(self) -> bool:
        """Whether a body is coated."""
        return bool(self.punch.thickness.any() or self.strip.thickness.any())

    def parts(self, before: WornDepths, more: WornDepths, bases: WornDepths) -> BothShares:
        """Return what of coatings and bases is worn at the nodes of punch and strip.

        Args:
            before: Depths where it begins.
            more, bases: Wear of coatings that last, and of bases.
        """
        return (
            shares(more.punch, bases.punch, left_of(self.punch.thickness, before.punch)),
            shares(more.strip, bases.strip, left_of(self.strip.thickness, before.strip)),
        )

    def by(self, worn: WornDepths, bases: WornDepths) -> CoatedBodies:
        """Return the same by the ratio of what would be worn of bases and of coatings, where something is."""
        return CoatedBodies(self.punch.by(worn.punch, bases.punch), self.strip.by(worn.strip, bases.strip))

    def measured_rate(self, rate: WornDepths, bases: WornDepths, worn: WornDepths) -> WornDepths:
        """Return rates of depths as those of `measured`, where these depths are worn.

        Args:
            rate, bases: Of coatings that last, and of bases.
            worn: Depths.
        """
        punch = self.punch.measured_rate(worn.punch, rate.punch, bases.punch)
        return replace(rate, punch=punch, strip=self.strip.measured_rate(worn.strip, rate.strip, bases.strip))

    def measured(self, worn: WornDepths) -> WornDepths:
        """Return depths as the wear of coatings that last: it grows evenly through their end."""
        return replace(worn, punch=self.punch.measure(worn.punch), strip=self.strip.measure(worn.strip))

    def depths(self, measured: WornDepths) -> WornDepths:
        """Return the depths that `measured` made these of."""
        return replace(measured, punch=self.punch.depth(measured.punch), strip=self.strip.depth(measured.strip))

    def with_slopes(self, rate: WornDepths, worn: WornDepths) -> WornDepths:
        """Return rates of depths as those of `measured`, where these depths are worn."""
        punch, strip = self.punch.slope(worn.punch), self.strip.slope(worn.strip)
        return replace(rate, punch=_over(rate.punch, punch), strip=_over(rate.strip, strip))


def _over(rate: Array, slope: Array) -> Array:
    return np.divide(rate, slope, out=np.zeros_like(rate), where=slope > 0)


_Both = tuple[Array, Array]  # of punch and strip


@dataclass(frozen=True)
class StepLosses:
    """Wear of the time steps of a cycle, and its debris.

    Attributes:
        conditions: Variables of laws in them.
        wear: By local slip; of coated bodies that of their coatings.
        coatings: Of both bodies.
    """

    conditions: StepConditions
    wear: LocalWear
    coatings: CoatedBodies

    @property
    def layers(self) -> Layers:
        """The layers between the surfaces."""
        return self.conditions.interface.layers

    def worn_in(
        self, records: TimeStepRecords, first: int, before: PartialSlipState, *, rate: bool = False
    ) -> WornDepths:
        """Return what the steps of a record wear off both bodies, and what becomes of what lies between.

        Args:
            records: Of steps one after the other.
            first: Number of the first of them in the cycle.
            before: Where they began, with the state of what lies between.
            rate: Whether it is that of a cycle that repeats without end, for jumps, not the change in these steps: of a
                coated body then as if all of it were of the coating.
        """
        worn, bases = (self.worn_of(records, first, of_bases=of_bases) for of_bases in (False, True))
        parts = self.unended(before.worn) if rate else self.coatings.parts(before.worn, worn, bases)
        if not rate:
            punch, strip = parts
            worn = WornDepths(punch.of(worn.punch, bases.punch), strip.of(worn.strip, bases.strip))
        return self._with_between(worn, parts, records, first, before, rate=rate)

    def unended(self, before: WornDepths) -> BothShares:
        """Return what of coatings and bases is worn from depths on by so little that no coating ends."""
        return self.coatings.parts(before, *(2 * (before.times(0.0),)))

    def worn_of(self, records: TimeStepRecords, first: int, *, of_bases: bool = False) -> WornDepths:
        """Return what the steps of a record, the first of this number, wear off at the nodes of punch and strip.

        Of coated bodies that is as if all of them were of the coating; or `of_bases`, as if it were worn through.
        """
        pair, steps = self.conditions.interface.middle.pair, self.conditions.program.steps
        punch, below = (
            (records.punch_base, records.strip_base) if of_bases else (records.punch_depth, records.strip_depth)
        )
        strip = np.zeros(len(pair.strip.weights))
        if self.wear.strip.wears:
            places = [steps[(first + k) % len(steps)].offset for k in range(len(records))]
            for place in dict.fromkeys(places):
                depth = below[[k for k, own in enumerate(places) if own == place]].sum(axis=0)
                strip += self.conditions.interface.position(place).pair.wear_projection @ depth
        return WornDepths(punch.sum(axis=0), strip)

    @cached_property
    def one_ratio(self) -> bool:
        """Whether what bases and coatings wear has a ratio that stays; so it has where nothing is coated."""
        alike = all(coating.law == base.law for coating, base in self.wear.layers)
        return not self.wear.bases or (self.conditions.laws is None and alike)

    def _taken(self, coatings: _Both, bases: _Both, parts: BothShares) -> Array:
        """Return what both bodies lose at the contact's nodes (..., n).

        Args:
            coatings, bases: Wear of punch and strip there, of coatings that last, and of bases.
            parts: Wear of both, at the nodes of punch and strip.
        """
        onto = self.conditions.interface.middle.pair.wear_interpolation
        return parts[0].of(coatings[0], bases[0]) + parts[1].at(onto).of(coatings[1], bases[1])

    def _with_between(
        self,
        worn: WornDepths,
        parts: BothShares,
        records: TimeStepRecords,
        first: int,
        before: PartialSlipState,
        *,
        rate: bool,
    ) -> WornDepths:
        """Return what is worn with what steps do to what lies between; arguments as of `worn_in` and `_taken`."""
        layers, now, begin = self.layers, before.worn, replace(before, next_step=first)
        changes, carried = np.zeros_like(now.between), np.zeros_like(now.carried)
        if layers.debris.present:
            over, thickness = self.debris_over(records, begin), layers.lies(now)
            if layers.strip_carries:
                state, taken = carried, self._taken_onto_strip(records, parts, begin)
            else:
                coatings, bases = (records.punch_depth, records.strip_depth), (records.punch_base, records.strip_base)
                state, taken = changes, self._taken(coatings, bases, parts)
            state[: len(DEBRIS)] = over.rate(thickness, taken, 0.0) if rate else over.change(thickness, taken)
        if layers.hardness < np.inf and not rate:  # what flows does so as the shape wants it, however long it takes
            changes[layers.row(PLASTIC)] = records.flowed.sum(axis=0)
        found = replace(worn, between=changes, carried=carried)
        evolution = self.evolution(records, begin)
        if evolution is None:
            return found
        held = layers.held(now)
        return layers.with_held(found, evolution.rate(held)[0] if rate else evolution.after(held) - held)

    def _taken_onto_strip(self, records: TimeStepRecords, parts: BothShares, before: PartialSlipState) -> Array:
        """Return what both bodies lose in each step of a record that begins at a state, on the strip (k, n_strip).

        Args:
            records: Of the steps.
            parts: Wear of both, at the nodes of punch and strip.
            before: Where they begin.
        """
        of_punch, of_strip = parts
        found = []
        for k, pair in enumerate(self.conditions.pairs(slips_of(records), before)):
            above, onto = of_punch.of(records.punch_depth[k], records.punch_base[k]), pair.wear_projection
            found.append(onto @ above + of_strip.of(onto @ records.strip_depth[k], onto @ records.strip_base[k]))
        return np.array(found)

    def debris_over(self, records: TimeStepRecords, before: PartialSlipState) -> DebrisCycle:
        """Return what the steps of a record that begin at a state do to debris."""
        slips = slips_of(records)
        conditions = self.conditions.of_steps(slips, before) if self.layers.varies else ()
        onto = self.layers.places(self.conditions.pairs(slips, before))
        return self.layers.debris.over(slips.slid, conditions, onto)

    def evolution(self, records: TimeStepRecords, before: PartialSlipState) -> Evolution | None:
        """Return what the steps of a record that begin at a state do to the states that laws remember; None without."""
        return self.evolution_of(slips_of(records), before)

    def evolution_of(self, slips: StepSlips, before: PartialSlipState) -> Evolution | None:
        """Return what steps that begin at a state do to the states that laws remember; None without."""
        memory, laws = self.layers.memory, self.conditions.laws
        if not memory.names or laws is None:
            return None
        parts = self.unended(before.worn)

        def wearing(k: int, at: ContactConditions) -> Array:
            tau = float(slips.duration[k])
            coatings, bases = laws.wear_at(at).both(at.pressure, slips.slid[k], tau)
            return np.asarray(self._taken(coatings, bases, parts) / tau)

        conditions, pairs = self.conditions.of_steps(slips, before), self.conditions.pairs(slips, before)
        return Evolution(memory, conditions, slips.duration, pairs, wearing, before.worn.strip)


def slips_of(records: TimeStepRecords) -> StepSlips:
    """Return what laws ask of the time steps of a record."""
    return StepSlips(records.pressure, records.slip_magnitude, records.duration, records.temperature)
