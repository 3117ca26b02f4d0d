"""Wear of both bodies in time steps of contact with stick, by the laws of phases in gross sliding.

A time step wears as a phase of the motion does, over the slip of its nodes. Conditions of the laws are those of each
node in the step, and of the cycle before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fenwear.common.arrays import Array
from fenwear.laws import Evolution, LayerEvolution, Layers
from fenwear.laws.coating import CoatedBody
from fenwear.laws.friction import ContactConditions
from fenwear.laws.local_laws import LocalWear, phases_wear
from fenwear.laws.sliding_tensors import CycleShear, SlidingWays
from fenwear.laws.wear import PhasesWear, WornDepths
from fenwear.steps.stick_records import TimeStepRecords
from fenwear.steps.stick_state import PartialSlipState
from fenwear.surfaces import ContactPair

if TYPE_CHECKING:
    from fenwear.steps.stick_cycle import PartialSlipProblem

ALL = slice(None)  # time steps of a record
BARE = CoatedBody(np.zeros(1), np.ones(1))  # without a coating


@dataclass(frozen=True)
class StepLosses:
    """Wear of the time steps of a cycle, and its effect on what lies between."""

    problem: PartialSlipProblem

    @property
    def layers(self) -> Layers:
        """The layers between the surfaces."""
        return self.problem.interface.layers

    @property
    def asks_cycle(self) -> bool:
        """Whether a law depends on the cross-shear or the mean pressure of a whole cycle."""
        laws = self.problem.laws
        return laws is not None and (laws.asks("cs") or laws.asks("pm"))

    def at_start(self, at: PartialSlipState) -> dict[str, Any]:
        """Return the conditions of the nodes at the start of a time step, by the names of `LocalLaws.conditions`."""
        warm, heat = None, self.problem.heat
        if heat is not None and len(at.temperature):
            punch, strip = heat.surfaces(at.temperature)
            warm = punch, strip
        return {
            "temperatures": warm,
            "worn": at.worn,
            "slid": at.slid,
            "speed": at.speed,
            "cycle": self._shear(at),
        }

    def _shear(self, at: PartialSlipState) -> CycleShear | None:
        """Return the shear of the last cycle before a state, as laws use it; None where no law asks.

        A time step that has not been computed slips nothing at the mean pressure.
        """
        if not self.asks_cycle:
            return None
        interface, middle = self.problem.interface, self.problem.interface.middle
        positions, mean = (
            [interface.position(step.offset) for step in self.problem.program.steps],
            middle.rigid.mean_pressure,
        )
        slips: Array = np.nan_to_num(at.slips)
        ways = np.array([position.slid(slips[k]) for k, position in enumerate(positions)])
        lengths = np.linalg.norm(ways, axis=2)
        directions = ways / np.where(lengths > 0, lengths, 1.0)[:, :, None]
        pairs, wears = [position.pair for position in positions], self.problem.wear.strip.wears
        known = SlidingWays(pairs, middle.pair, lengths, directions, wears, mean, asked=True)
        return known.shear(np.where(np.isnan(at.pressures), mean, at.pressures))

    def of_steps(self, records: TimeStepRecords, before: PartialSlipState) -> list[ContactConditions]:
        """Return the conditions of laws in steps that begin at a state: temperatures are those at the start of each."""
        laws, known = self.problem.laws, self.at_start(before)
        assert laws is not None
        lengths = records.slip_magnitude
        slid = before.slid + np.cumsum(lengths, axis=0)
        warm = [known["temperatures"]] * len(slid)
        if known["temperatures"] is not None:
            warm[1:] = [(punch, strip) for punch, strip in records.temperature[:-1]]
        return [
            laws.conditions(
                pair,
                records.pressure[k],
                speed=lengths[k] / records.duration[k],
                temperatures=warm[k],
                worn=before.worn,
                slid=slid[k],
                debris=self.layers.facing(pair, before.worn),
                cycle=known["cycle"],
            )
            for k, pair in enumerate(self.pairs(records, before))
        ]

    def pairs(self, records: TimeStepRecords, before: PartialSlipState) -> list[ContactPair]:
        """Return the surfaces opposite each other in steps that begin at a state."""
        steps = self.problem.program.steps
        places = [steps[(before.next_step + k) % len(steps)].offset for k in range(len(records))]
        return [self.problem.interface.position(place).pair for place in places]

    def worn(self, records: TimeStepRecords, begin: PartialSlipState, which: slice = ALL) -> WornDepths:
        """Return the depths after time steps, with the changes of the layers' states; arguments as of `over`."""
        passing, flowed = self.over(records, begin, which), records.flowed[which].sum(axis=0)
        return passing.worn(records.pressure[which], begin.worn, flowed=flowed)

    def over(self, records: TimeStepRecords, begin: PartialSlipState, which: slice = ALL) -> LayerEvolution:
        """Return the wear of time steps by their pressures, with the changes of layers and laws.

        Args:
            records: Of time steps one after the other.
            begin: State in which the first of them begins.
            which: Time steps of the record; by default all.
        """
        laws = self.problem.laws
        evolution, conditions = self.evolution(records, begin), list[ContactConditions]()
        if evolution is not None:
            conditions = evolution.through(self.layers.held(begin.worn))[0]
        elif laws is not None:
            conditions = self.of_steps(records, begin)
        chosen = range(len(records))[which]
        conditions, pairs = conditions[which], self.pairs(records, begin)[which]
        slid, durations = records.slip_magnitude[which], records.duration[which]
        wears = [self.problem.wear] * len(chosen) if laws is None else [laws.wear_at(one) for one in conditions]
        wear = self._wear(wears, slid, durations, pairs)
        evolution = None if evolution is None else evolution.some(chosen)
        return LayerEvolution.over(self.layers, wear, slid, evolution, conditions)

    def _wear(
        self, wears: Sequence[LocalWear], slid: Array, durations: Array, pairs: Sequence[ContactPair]
    ) -> PhasesWear:
        """Return the wear of time steps by their laws, slips (k, n) and durations (k,)."""
        punch, strip = (law.slide(slid, durations[:, None]) for law in (wears[0].punch, wears[0].strip))
        coatings = self.problem.coatings[0].thickness, self.problem.coatings[1].thickness
        return phases_wear(wears, (punch, strip), pairs, coatings)

    def evolution(self, records: TimeStepRecords, begin: PartialSlipState) -> Evolution | None:
        """Return the evolution of laws' states in the steps of a record that begin at a state; None without any."""
        memory, laws = self.layers.memory, self.problem.laws
        if not memory.names or laws is None:
            return None
        pairs = self.pairs(records, begin)

        def wearing(k: int, at: ContactConditions) -> Array:
            own, wears = slice(k, k + 1), [laws.wear_at(at)]
            wear = self._wear(wears, records.slip_magnitude[own], records.duration[own], pairs[own])
            return np.asarray(wear.begun(begin.worn, 0.0).taken(at.pressure[None])[0] / records.duration[k])

        conditions = self.of_steps(records, begin)
        return Evolution(memory, conditions, records.duration, pairs, wearing, begin.worn.strip)
