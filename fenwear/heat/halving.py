"""How far the steps of a half-cycle are from the limit: what halving them changes of the contact temperatures.

Of bodies at rest the modes are known, theta_k' = -lambda_k theta_k + b_k, so that the cycle that repeats needs no
marching, whatever the step: with a constant b a step leaves R(lambda dt) of what is missing to b / lambda, R being that
of the rule of `fenwear.heat.exchange`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fenwear.arrays import Array
from fenwear.heat.exchange import EARLIER, STAGE

NEUTRAL = 1e-9  # of a cycle's decay: what loses no heat
COLD = 0.1  # of the largest temperature: below, a change counts against that


@dataclass(frozen=True)
class HeatedCycle:
    """A body at rest that an even pressure heats over the steps of a cycle, on its modes.

    Attributes:
        rates: lambda (dim,), 1/s.
        loads: b of each step (k, dim), K/s.
        reading: Temperature of the contact at the end of the cycle (n, dim).
        duration: Of a step, s.
    """

    rates: Array
    loads: Sequence[Array]
    reading: Array
    duration: float

    def repeating(self) -> Array:
        """Return the contact's temperature at the end of the cycle that repeats (n,), K, beside a mean without end."""
        each = self.rates * self.duration
        stage = 1 / (1 + STAGE * each)
        factor = stage * (1 + EARLIER * (stage - 1))
        lasts = each * len(self.loads) > NEUTRAL  # else a mean that grows on, by any steps alike
        warms = np.divide(1 - factor, self.rates, out=np.zeros_like(factor), where=lasts)
        state: Array = np.zeros(len(factor))
        for load in self.loads:
            state = factor * state + warms * load
        missing = 1 - factor ** len(self.loads)
        return np.asarray(self.reading @ np.divide(state, missing, out=np.zeros_like(state), where=lasts))


def change_by_halving(coarse: HeatedCycle, fine: HeatedCycle) -> float:
    """Return the largest change of a contact's temperature by steps of half the length, over itself."""
    limit = fine.repeating()
    size = np.abs(limit)
    return float((np.abs(coarse.repeating() - limit) / np.maximum(size, max(COLD * size.max(), 1e-300))).max())
