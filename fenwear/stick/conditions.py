"""What laws of friction and wear know of the nodes in time steps, and of the cycle before them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from fenwear.arrays import Array
from fenwear.interface import ContactPair
from fenwear.sliding.cross_shear import CycleShear
from fenwear.sliding.friction import ContactConditions
from fenwear.sliding.ways import SlidingWays
from fenwear.stick.heat import StickHeat
from fenwear.stick.interface import OppositeBodies
from fenwear.stick.program import Program
from fenwear.stick.state import PartialSlipState
from fenwear.stick.wear import LocalLaws


class StepSlips(NamedTuple):
    """What laws ask of k time steps: pressure and slip (k, n), durations (k,), temperatures at their ends (k, 2, n)."""

    pressure: Array
    slid: Array
    duration: Array
    temperature: Array | None


@dataclass(frozen=True)
class StepConditions:
    """What is known of each node in the time steps of a cycle.

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
        if self.heat is not None and at.temperature is not None:
            punch, strip = self.heat.surfaces(at.temperature)
            warm = punch, strip
        speed = 0.0 if at.speed is None else at.speed
        return {
            "temperatures": warm,
            "worn": at.worn,
            "slid": at.slid,
            "speed": speed,
            "cycle": self._shear(at),
        }

    def _shear(self, at: PartialSlipState) -> CycleShear | None:
        """Return what laws know of the last cycle before a state; None where none asks, or before the first.

        A time step that has not been computed slips nothing at the mean pressure.
        """
        if at.slips is None or at.pressures is None:
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
        begun = np.zeros(slips.slid.shape[1]) if before.slid is None else before.slid
        slid = begun + np.cumsum(slips.slid, axis=0)
        warm = [known["temperatures"]] * len(slid)
        if slips.temperature is not None and known["temperatures"] is not None:
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
