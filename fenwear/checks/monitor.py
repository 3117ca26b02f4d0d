"""Warnings of runs, checks and steady states: the table of rules, applied to what they see."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from fenwear.checks.rules import RULES, Made, Seen, remarks
from fenwear.common.arrays import Array, Mask
from fenwear.heat.heat_exchange import HeatExchange
from fenwear.heat.temperature import HeatState
from fenwear.steps import Block, heat_gain, heat_warnings
from fenwear.steps.stick_program import passes
from fenwear.system import Tribosystem

if TYPE_CHECKING:
    from fenwear.steps.stick_state import TimeStepRecords

STEPS, CHANGE, DIFFERENCE = "heat_steps", "heat_change_by_halving_steps", "heat_difference_from_whole_mesh"
GAIN = "heat_gain"
KINDS = {CHANGE: "steps", DIFFERENCE: "basis", GAIN: "answers"}  # of what is said of each


def fineness_text(exchange: HeatExchange) -> str:
    """Return how fine the steps and bases of the heat are, "" without heat."""
    fineness = exchange.fineness
    if not fineness.steps:
        return ""
    parts = [f"heat: {fineness.steps} steps in a half-cycle"]
    if np.isfinite(fineness.change):
        parts.append(f"halving them changes contact temperatures by {100 * fineness.change:.2g} %")
    if np.isfinite(fineness.difference):
        parts.append(f"the basis changes contact temperatures and thermal gap by {100 * fineness.difference:.2g} %")
    return "; ".join(parts)


class StateMonitor:
    """Looks at the blocks of a run.

    Args:
        system: The assembled problem on meshes as they were made, not moved by wear.
    """

    def __init__(self, system: Tribosystem) -> None:
        self.system, self._made = system, Made(system)
        self._texts: dict[str, str] = {}
        self._kinds: tuple[str, ...] = ("run", "first")

    def move(self, system: Tribosystem) -> None:
        """Look at another contact grid from now on."""
        self.system, self._made = system, Made(system, self._made.first, self._made.largest)

    def see(self, block: Block) -> list[str]:
        """Take the next block and return the warnings about it that no earlier one had; collective."""
        texts = remarks(Seen.of_block(self._made, block), *self._kinds)
        self._kinds = ("run",)
        new = [text for name, text in texts.items() if name not in self._texts]
        latest = {name: text for name, text in texts.items() if RULES[name].latest}
        self._texts = {**texts, **self._texts, **latest}
        return new

    def warnings(self) -> list[str]:
        """Return the warnings about all blocks so far."""
        return list(self._texts.values())


class HeatMonitor:
    """Looks at the heat of each stage of a run, whose motion, friction and surroundings are its own.

    Attributes:
        numbers: By their names in summary.json: the fewest steps, and the largest of all else.
    """

    def __init__(self, numbers: Mapping[str, float]) -> None:
        """Begin, or continue with the numbers of all earlier stages of a resumed run."""
        self.numbers = {name: numbers[name] for name in (STEPS, CHANGE, DIFFERENCE, GAIN) if name in numbers}
        self._texts: dict[str, str] = {}

    def see(self, system: Tribosystem, pressure: Array | None = None, state: HeatState | None = None) -> list[str]:
        """Look at the heat of a stage and return the warnings that no stage before had; collective.

        Args:
            system: With its heat prepared.
            pressure: Of each phase (phases, n), MPa, for the nodes in contact; by default that without wear and heat.
            state: Temperatures at the end of these phases; by default the initial ones.

        Raises:
            ConvergenceError: contact without heat did not converge.
        """
        gain, fineness = heat_gain(system, pressure, state), system.exchange.fineness
        values = {GAIN: gain, CHANGE: fineness.change, DIFFERENCE: fineness.difference}
        if fineness.steps:
            self.numbers[STEPS] = min(self.numbers.get(STEPS, fineness.steps), fineness.steps)
        texts = remarks(Seen.of_system(system), "heat")
        jumps = system.case.run.integration == "jump"
        for text in heat_warnings(gain, jumps=jumps):
            texts["answers"] = text
        new = [text for kind, text in texts.items() if kind not in self._texts]
        worst = {KINDS[name] for name, value in values.items() if value and value >= self.numbers.get(name, value)}
        self._texts |= {kind: text for kind, text in texts.items() if kind in worst or kind not in self._texts}
        for name, value in values.items():
            if value is not None and np.isfinite(value):
                self.numbers[name] = max(self.numbers.get(name, value), value)
        return new

    def warnings(self) -> list[str]:
        """Return the warnings about all stages so far, of each kind the worst."""
        return list(self._texts.values())


def law_warnings(system: Tribosystem) -> list[str]:
    """Return the warnings about the time steps of a system before it is followed."""
    fineness = None if system.law_state is None else system.law_state.fineness
    return [] if fineness is None or fineness.enough else [fineness.text()]


def unique_text(unique: Mask) -> str:
    """Return the warning about friction so large that there may be several answers; "" if it is not."""
    if unique.all():
        return ""
    return (
        f"contact.friction: friction is so large that contact may have no or several solutions in "
        f"{int((~unique).sum())} of {len(unique)} time steps. The one computed is that which Newton's method reached "
        "from the step before. "
        "Reduce `contact.friction`"
    )


def sliding_text(last: Block) -> str:
    """Return the warning about time steps of the last cycle in which nothing sticks; "" if something does."""
    steps = _last_steps(last)
    slipping = [(stroke.pressure > 0).any(axis=1) & ~stroke.sticking.any(axis=1) for stroke in steps]
    if not steps or not np.concatenate(slipping).any():
        return ""
    share = 100 * float(np.mean(np.concatenate(slipping)))
    return f"gross sliding: in {share:.0f} % of the last cycle's time steps nothing sticks"


def passing_text(last: Block) -> str:
    """Return the warning about a strip that passes and slips less than a node; "" if it does not."""
    system, steps = last.system, _last_steps(last)
    if not steps or system.law_state is None or not system.law_state.problem.interface.moves:
        return ""
    pair = system.pair
    slipped = sum(stroke.slip_amplitude(pair.weights, len(steps)) for stroke in steps)
    if passes(slipped, pair.punch):
        return ""
    return (
        f"motion.positions: the strip slips only {1e3 * slipped:.2g} µm per stroke, less than the node spacing "
        f"({1e3 * pair.punch.spacing():.2g} µm), so its wear is smeared over sticking nodes. Set `motion.positions = 1`"
    )


def _last_steps(last: Block) -> list[TimeStepRecords]:
    steps: tuple[Any, ...] = last.steps[-last.system.motion.half_cycles :]
    return [stroke.records for stroke in steps]


def uniques(block: Block) -> Mask:
    """Return of each time step of a block whether its answer was the only one near (k,)."""
    steps: tuple[Any, ...] = block.steps
    return np.concatenate([np.ones(0, dtype=bool), *(stroke.records.unique.astype(bool) for stroke in steps)])
