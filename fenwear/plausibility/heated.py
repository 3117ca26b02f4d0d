"""What is told of the heat of all stages of a run: the worst of each of its numbers, and what is said of it."""

from __future__ import annotations

from collections.abc import Mapping

from fenwear.arrays import Array
from fenwear.assembly import Tribosystem
from fenwear.cycle import heat_gain, heat_warnings
from fenwear.heat.field import HeatState
from fenwear.plausibility.fineness import fineness_remarks

STEPS, CHANGE, DIFFERENCE = "heat_steps", "heat_change_by_halving_steps", "heat_difference_from_whole_mesh"
GAIN = "heat_gain"
KINDS = {CHANGE: "steps", DIFFERENCE: "basis", GAIN: "answers"}  # of what is said of each


class HeatMonitor:
    """Looks at the heat of each stage of a run, whose motion, friction and surroundings are its own.

    Attributes:
        numbers: By their names in summary.json: the fewest steps, and the largest of all else.
    """

    def __init__(self, numbers: Mapping[str, float]) -> None:
        """Begin anew, or where a run goes on with the numbers of all stages before."""
        self.numbers = {name: numbers[name] for name in (STEPS, CHANGE, DIFFERENCE, GAIN) if name in numbers}
        self._texts: dict[str, str] = {}

    def see(self, system: Tribosystem, pressure: Array | None = None, state: HeatState | None = None) -> list[str]:
        """Look at the heat of a stage and return what was not said of one before; collective.

        Args:
            system: With its heat prepared.
            pressure: Of each phase (phases, n), MPa, for the nodes in contact; by default that without wear and heat.
            state: Temperatures at the end of these phases; by default the initial ones.

        Raises:
            ConvergenceError: contact without heat did not converge.
        """
        gain = heat_gain(system, pressure, state)
        fineness = None if system.exchange is None else system.exchange.fineness
        values = {GAIN: gain}
        if fineness is not None:
            self.numbers[STEPS] = min(self.numbers.get(STEPS, fineness.steps), fineness.steps)
            values |= {CHANGE: fineness.change, DIFFERENCE: fineness.difference}
        found = dict(fineness_remarks(system))
        jumps = system.made_from is not None and system.made_from.run.integration == "jump"
        for text in heat_warnings(gain, jumps=jumps):
            found["answers"] = text
        new = [text for kind, text in found.items() if kind not in self._texts]
        worst = {KINDS[name] for name, value in values.items() if value and value >= self.numbers.get(name, value)}
        self._texts |= {kind: text for kind, text in found.items() if kind in worst or kind not in self._texts}
        for name, value in values.items():
            if value is not None:
                self.numbers[name] = max(self.numbers.get(name, value), value)
        return new

    def warnings(self) -> list[str]:
        """Return what is to be said of all stages so far, of each kind the worst."""
        return list(self._texts.values())
