"""What time steps of contact with stick wear off both bodies, and what they do to what lies between."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fenwear.arrays import Array
from fenwear.layers import Evolution, Layers
from fenwear.layers.between import DEBRIS, PLASTIC
from fenwear.layers.debris import DebrisCycle
from fenwear.sliding.coating import covering
from fenwear.sliding.friction import ContactConditions
from fenwear.sliding.wear import WornDepths
from fenwear.stick.coated import BothShares, CoatedBodies
from fenwear.stick.conditions import StepConditions, StepSlips
from fenwear.stick.records import TimeStepRecords
from fenwear.stick.state import PartialSlipState
from fenwear.stick.wear import LocalWear

_Both = tuple[Array, Array]  # of punch and strip


@dataclass(frozen=True)
class StepLosses:
    """What the time steps of a cycle wear, and what becomes of it.

    Attributes:
        conditions: What laws know in them.
        wear: By local slip; of coated bodies that of their coatings.
        coatings: Of both bodies.
    """

    conditions: StepConditions
    wear: LocalWear
    coatings: CoatedBodies

    @property
    def layers(self) -> Layers:
        """What lies between the surfaces."""
        return self.conditions.interface.layers

    def worn_in(
        self, records: TimeStepRecords, first: int, before: PartialSlipState, *, rate: bool = False
    ) -> WornDepths:
        """Return what the steps of a record wear off both bodies, and what becomes of what lies between.

        Args:
            records: Of steps one after the other.
            first: Number of the first of them in the cycle.
            before: Where they began, with the state of what lies between.
            rate: Whether it is that of a cycle that goes on for ever, for jumps, not the change in these steps: of a
                coated body then as if all of it were of the coating.
        """
        worn = self.worn_of(records, first)
        if self.coatings.none:
            parts: BothShares = (None, None)
        else:
            bases = self.worn_of(records, first, of_bases=True)
            parts = self.coatings.parts(*((before.worn,) if rate else (before.worn, worn, bases)))
            if not rate:
                punch, strip = parts
                worn = WornDepths(
                    worn.punch if punch is None else punch.coating * worn.punch + punch.base * bases.punch,
                    worn.strip if strip is None else strip.coating * worn.strip + strip.base * bases.strip,
                )
        return self._with_between(worn, parts, records, first, before, rate=rate)

    def worn_of(self, records: TimeStepRecords, first: int, *, of_bases: bool = False) -> WornDepths:
        """Return what the steps of a record, the first of this number, wear off at the nodes of punch and strip.

        Of coated bodies that is as if all of them were of the coating; or `of_bases`, as if it were worn through.
        """
        pair, steps = self.conditions.interface.middle.pair, self.conditions.program.steps
        punch, below = (
            (records.punch_base, records.strip_base) if of_bases else (records.punch_depth, records.strip_depth)
        )
        strip = np.zeros(len(pair.strip.weights))
        if self.wear.strip is not None:
            places = [steps[(first + k) % len(steps)].offset for k in range(len(records))]
            for place in dict.fromkeys(places):
                depth = below[[k for k, own in enumerate(places) if own == place]].sum(axis=0)
                strip += self.conditions.interface.position(place).pair.wear_projection @ depth
        return WornDepths(punch.sum(axis=0), strip)

    def changes_between(self, before: WornDepths, after: WornDepths) -> bool:
        """Return whether coefficients change with depths from some to others, or with what is slid meanwhile."""
        laws, pair = self.conditions.laws, self.conditions.interface.middle.pair
        if not self.one_ratio and self.coatings.ends_between(before, after):
            return True
        if laws is None:
            return False
        return laws.passes or any(
            of_coating is not None and first is not None and then is not None and bool((first != then).any())
            for of_coating, first, then in zip(
                laws.friction.of_coatings,
                covering(laws.coatings, pair, (before.punch, before.strip)),
                covering(laws.coatings, pair, (after.punch, after.strip)),
                strict=True,
            )
        )

    @cached_property
    def one_ratio(self) -> bool:
        """Whether what bases and coatings wear has a ratio that stays; so it has where nothing is coated."""
        laws = [pair for pair in self.wear.layers if pair[0] is not None]
        alike = all(coating is not None and base is not None and coating.law == base.law for coating, base in laws)
        return not laws or (self.conditions.laws is None and alike)

    def _taken(self, coatings: _Both, bases: _Both, parts: BothShares) -> Array:
        """Return what both bodies lose at the contact's nodes (..., n).

        Args:
            coatings, bases: What of punch and strip would be worn there of coatings that go on, and of bases.
            parts: What is worn of both, at the nodes of punch and strip.
        """
        onto = self.conditions.interface.middle.pair.wear_interpolation
        of_punch, of_strip = parts[0], None if parts[1] is None else parts[1].at(onto)
        found = [
            of_coating if part is None else part.coating * of_coating + part.base * of_base
            for part, of_coating, of_base in zip((of_punch, of_strip), coatings, bases, strict=True)
        ]
        return np.asarray(found[0] + found[1])

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
        if layers.debris is not None:
            over = self.debris_over(records, begin)
            if layers.strip_carries:
                state, thickness, rows = carried, now.carried[0], list(range(len(DEBRIS)))
                taken = self._taken_onto_strip(records, parts, begin)
            else:
                rows = [layers.row(name) for name in DEBRIS]
                state, thickness = changes, now.between[rows[0]]
                coatings, bases = (records.punch_depth, records.strip_depth), (records.punch_base, records.strip_base)
                taken = self._taken(coatings, bases, parts)
            state[rows] = over.rate(thickness, taken, 0.0) if rate else over.change(thickness, taken)
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
            parts: What is worn of both, at the nodes of punch and strip.
            before: Where they begin.
        """
        of_punch, of_strip = parts
        found = []
        for k, pair in enumerate(self.conditions.pairs(slips_of(records), before)):
            above, below, onto = records.punch_depth[k], records.strip_depth[k], pair.wear_projection
            if of_punch is not None:
                above = of_punch.coating * above + of_punch.base * records.punch_base[k]
            on_strip = onto @ below
            if of_strip is not None:
                on_strip = of_strip.coating * on_strip + of_strip.base * (onto @ records.strip_base[k])
            found.append(onto @ above + on_strip)
        return np.array(found)

    def debris_over(self, records: TimeStepRecords, before: PartialSlipState) -> DebrisCycle:
        """Return what the steps of a record that begin at a state do to debris."""
        debris = self.layers.debris
        assert debris is not None
        slips = slips_of(records)
        conditions = self.conditions.of_steps(slips, before) if self.layers.varies else None
        onto = None
        if self.layers.strip_carries:
            onto = [pair.wear_projection for pair in self.conditions.pairs(slips, before)]
        return debris.over(slips.slid, conditions, onto)

    def evolution(self, records: TimeStepRecords, before: PartialSlipState) -> Evolution | None:
        """Return what the steps of a record that begin at a state do to the states that laws remember; None without."""
        return self.evolution_of(slips_of(records), before)

    def evolution_of(self, slips: StepSlips, before: PartialSlipState) -> Evolution | None:
        """Return what steps that begin at a state do to the states that laws remember; None without."""
        memory, laws = self.layers.memory, self.conditions.laws
        if memory is None or laws is None:
            return None
        parts = self.coatings.parts(before.worn)

        def wearing(k: int, at: ContactConditions) -> Array:
            tau = float(slips.duration[k])
            coatings, bases = laws.wear_at(at).both(at.pressure, slips.slid[k], tau)
            return np.asarray(self._taken(coatings, bases, parts) / tau)

        conditions, pairs = self.conditions.of_steps(slips, before), self.conditions.pairs(slips, before)
        return Evolution(memory, conditions, slips.duration, pairs, wearing, before.worn.strip)


def slips_of(records: TimeStepRecords) -> StepSlips:
    """Return what laws ask of the time steps of a record."""
    return StepSlips(records.pressure, records.slip_magnitude, records.duration, records.temperature)
