"""What the tests of heat with stick share."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from fenwear.stick.cycle import Records, Rig
from fenwear.stick.heat import balance_error
from fenwear.stick.jump import march


def half_cycles_whose_work_is_heat(warm: Rig) -> Iterator[Records]:
    """Yield the half-cycles of two cycles, each with all its friction work as heat and both its balances kept."""
    for cycle in march(warm, 2):
        for part in cycle.half_cycles:
            assert part.heat[:, 0].sum() == pytest.approx(part.energy(warm.weights), rel=1e-10)
            assert balance_error(part.heat) < 1e-10
            assert part.balance_error(warm.weights) < 1e-10
            yield part
