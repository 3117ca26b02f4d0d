"""Where a run ends at a level of a quantity, such as a worn depth: `run.until`.

The level is looked for at the end of each cycle, or of each jump. A jump across it is made again to the cycle at which
a cubic through values and rates at its ends meets the level.
"""

from __future__ import annotations

import math

import numpy as np

from fenwear.case import Case
from fenwear.cycle import Block
from fenwear.life.model import snapshot_of
from fenwear.life.quantities import Quantity, crossing, of_case, parse_level

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
        self.quantity: Quantity = of_case(parse_level(case.run.until, KEY, case.names), case, KEY)
        self._before = (0.0, 0.0, float("nan"))
        self.value = 0.0

    @property
    def reached(self) -> bool:
        """Whether the latest value is at the level or beyond."""
        return self.value >= self.quantity.level * (1 - 1e-12)

    def see(self, block: Block) -> int:
        """Return the half-cycle at which a block reaches the level; 0 where it does not."""
        snapshot, strokes = snapshot_of(block), block.system.motion.half_cycles
        now = (snapshot.cycle, self.quantity.of_snapshot(snapshot), self.quantity.rate(snapshot))
        last, self.value = int(block.half_cycle[-1]), now[1]
        if not self.reached:
            self._before = now
            return 0
        cycles = crossing(np.array([self._before, now]), self.quantity.level)
        found = strokes * math.ceil(cycles - 1e-9) if math.isfinite(cycles) else last
        return found if strokes * self._before[0] < found < last else last
