"""What the tests of heat with stick share."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from fenwear import Tribosystem, march
from fenwear.steps.stick_state import TimeStepRecords


def half_cycles_whose_work_is_heat(warm: Tribosystem) -> Iterator[TimeStepRecords]:
    """Yield the half-cycles of two cycles, each with all its friction work as heat and both its balances kept."""
    weights = warm.pair.weights
    for block in march(warm, 4):
        assert block.heat is not None
        assert block.heat.balance_error.max() < 1e-10
        for part in (steps.records for steps in block.steps):
            assert part.heat[:, 0].sum() == pytest.approx(part.energy(weights), rel=1e-10)
            assert part.balance_error(weights) < 1e-10
            yield part
