"""A sample of the random problems that are held against invariants, and what they see."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import invariants

from fenwear.laws.wear import WornDepths
from fenwear.results import checkpoint
from fenwear.steps.run_state import PhaseMeter, RunState
from fenwear.system import Tribosystem

# One seed of most kinds, and most things that are asked at least once; a night tries thousands of others.
SEEDS = {
    "plane; scale, mirror, restart": 6001525,
    "both; scale, mirror, restart": 6000459,
    "rings; scale, mirror, restart": 6000492,
    "solid; scale, mirror, restart": 6000520,
    "curved; scale, mirror, restart": 6000025,
    "stick; scale, mirror": 6401560,
    "heat; scale, mirror, restart": 6402200,
    "block; scale, mirror, restart": 6000204,
    "ball; scale, mirror": 6401240,
    "sphere; scale, mirror": 6401322,
    "program; scale, restart": 6000088,
    "oval; scale, restart": 6000240,
    "plane; refinement": 6000410,
    "both; jumps": 6000441,
    "solid; slice_of_solid": 6001671,
    "curved; scale, afresh": 6000598,
}


@pytest.mark.parametrize("seed", SEEDS.values(), ids=SEEDS)
def test_sample(seed: int, request: pytest.FixtureRequest) -> None:
    """Balances hold, and other ways come to the same."""
    made, asks = invariants.problem(seed)
    assert f"{made.kind}; {', '.join(asks)}" in request.node.name
    assert invariants.try_problem(seed) == ("ok", f"{made.name}; {', '.join(asks)}")


def test_a_meter_that_is_wrong_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """By what is worn off all material points."""
    true = PhaseMeter.__call__
    monkeypatch.setattr(PhaseMeter, "__call__", lambda self, *given: true(self, *given).times(1 + 1e-6))
    verdict, why = invariants.try_problem(SEEDS["plane; scale, mirror, restart"])
    assert verdict == "wrong"
    assert "volume" in why


def test_a_checkpoint_that_is_wrong_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """By what a run comes to that never stopped."""
    true = checkpoint.load

    def load(*given: Any) -> tuple[Tribosystem, RunState, dict[str, float]]:
        system, state, extremes = true(*given)
        return system, replace(state, worn=WornDepths((1 + 1e-6) * state.worn.punch, state.worn.strip)), extremes

    monkeypatch.setattr(checkpoint, "load", load)
    verdict, why = invariants.try_problem(SEEDS["plane; scale, mirror, restart"])
    assert verdict == "wrong"
    assert "restart: wear" in why
