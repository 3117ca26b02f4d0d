"""The loop that marches and jumps share."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from fenwear import Tribosystem, march
from fenwear.common.errors import InterruptedRunError
from fenwear.steps import Block
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import jump_within, march_within
from fenwear.steps.run_state import RunState

COARSE = ("geometry.degree=2", "geometry.parameters.elements_along_contact=8", "wear.punch.coefficient=4e-7")
Blocks = Callable[..., Iterator[Block]]


def marches(system: Tribosystem, half_cycles: int, start: RunState | None = None, **limits: Any) -> Iterator[Block]:
    return march_within(system, RunLimits(half_cycles, **limits), start=start)


def jumps(system: Tribosystem, half_cycles: int, start: RunState | None = None, **limits: Any) -> Iterator[Block]:
    return jump_within(system, RunLimits(half_cycles, **limits), tolerance=1e-3, start=start)


@pytest.mark.parametrize("run", [marches, jumps])
def test_interrupted_within_a_step(assembled: Callable[..., Tribosystem], run: Blocks) -> None:
    """What was done before it is yielded, then the run ends; going on from there is as if never interrupted."""
    system = assembled("fretting", "motion.positions=3", "geometry.parameters.elements_along_contact=16")
    asked, blocks = 0, []

    def watch() -> bool:
        nonlocal asked
        asked += 1
        if asked > 20:
            raise InterruptedRunError("asked to")
        return False

    with pytest.raises(InterruptedRunError, match="asked to"):
        blocks.extend(run(system, 40 if run is marches else 1000, watch=watch))
    assert len(blocks) == 1
    reached = blocks[0].end.half_cycle
    assert reached > 0
    *_, resumed = run(system, 40 if run is marches else 1000, start=blocks[0].end)
    *_, whole = run(system, 40 if run is marches else 1000)
    np.testing.assert_allclose(resumed.wear[-1], whole.wear[-1], rtol=0, atol=1e-9 * whole.wear[-1].max())


@pytest.mark.parametrize("run", [marches, jumps])
def test_blocks_end_when_asked(assembled: Callable[..., Tribosystem], run: Blocks) -> None:
    """A block ends after the step in which what watches says so, whatever it holds; the results do not change."""
    system = assembled("example1", *COARSE)
    whole = list(run(system, 40))
    cut = list(run(system, 40, watch=lambda: True))
    assert len(cut) > len(whole) == 1
    assert all(len(block) <= 2 for block in cut)
    np.testing.assert_array_equal(np.concatenate([b.wear for b in cut]), whole[0].wear)


def test_measures_do_not_depend_on_what_is_drawn(assembled: Callable[..., Tribosystem]) -> None:
    """A contact surface half as long again, most of it open: the same periodicity and distance to the optimum."""
    narrow, wide = (
        next(
            march(
                assembled(
                    "fretting",
                    "motion.positions=3",
                    f"geometry.parameters.contact_width={width}",
                    f"geometry.parameters.elements_along_contact={count}",
                ),
                20,
            )
        )
        for width, count in ((0.4, 40), (0.6, 60))
    )
    np.testing.assert_allclose(wide.periodicity[2:], narrow.periodicity[2:], rtol=0.05)
    np.testing.assert_allclose(wide.optimum_distance, narrow.optimum_distance, rtol=0.05)
