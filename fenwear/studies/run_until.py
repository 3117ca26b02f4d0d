"""The end of a run at a level of a quantity, such as a worn depth: `run.until`.

The level is looked for at the end of each cycle, or of each jump. A jump across it is made again to the cycle at which
a cubic through values and rates at its ends meets the level.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fenwear.case import Case
from fenwear.common.progress import Log
from fenwear.steps import Block
from fenwear.steps.run_state import RunState
from fenwear.studies.model import snapshot_of
from fenwear.studies.quantities import Quantity, crossing, of_case, parse_level
from fenwear.system import Tribosystem

KEY = "run.until"


class RunLevel:
    """Looks at the blocks of a run.

    Args:
        case: With `run.until`.

    Attributes:
        quantity: Whose level ends the run.
        value: Its latest value.

    Raises:
        CaseError: it names no quantity that grows, or one that the case does not have.
    """

    def __init__(self, case: Case) -> None:
        self.text = case.run.until
        self.quantity: Quantity = of_case(parse_level(self.text, KEY, case.names), case, KEY)
        self._before = (0.0, 0.0, float("nan"))
        self.value = 0.0

    @property
    def reached(self) -> bool:
        """Whether the latest value is at the level or beyond."""
        return self.value >= self.quantity.level * (1 - 1e-12)

    def missed(self, half_cycle: int) -> list[str]:
        """Return the warning of a run that has ended at a half-cycle below the level; none of others."""
        if self.reached:
            return []
        return [
            f"run.until: {self.text} is not reached by half-cycle {half_cycle:,}: it is "
            f"{self.value:.4g} {self.quantity.level_unit}. Increase `run.half_cycles`"
        ]

    def summary(self, system: Tribosystem, state: RunState, log: Log) -> dict[str, Any]:
        """Return when the level that ends the run is reached, and log it."""
        cycles = state.half_cycle / system.motion.half_cycles
        distance, time = float(state.totals.of("distance")), float(system.sliding.time(np.array(state.half_cycle)))
        if self.reached:
            way = f"{distance / 1e3:.5g} m, {time:.5g} s"
            log(f"{self.text} is reached after {cycles:,.6g} cycles, {way}")
        level = {"level": self.text, "reached": self.reached, "value": self.value}
        return {"until": {**level, "cycles": cycles, "distance_mm": distance, "time_s": time}}

    def see(self, block: Block) -> int:
        """Return the half-cycle at which a block reaches the level; 0 where it does not."""
        snapshot, strokes = snapshot_of(block), block.system.motion.half_cycles
        now = (snapshot.cycle, self.quantity.of_snapshot(snapshot), self.quantity.rate(snapshot))
        last, self.value = int(block.half_cycle[-1]), now[1]
        if not self.reached:
            self._before = now
            return 0
        cycles = crossing(np.array([self._before, now]), self.quantity.level)
        half_cycle = strokes * math.ceil(cycles - 1e-9) if math.isfinite(cycles) else last
        return half_cycle if strokes * self._before[0] < half_cycle < last else last
