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
from fenwear.steps.run_state import RunState
from fenwear.steps.run_totals import PhaseMeter
from fenwear.system import Tribosystem

# One seed of each kind, and each thing that is asked at least once; a night tries thousands of others.
SEEDS = {
    "plane, restart": 6000106,
    "plane, refinement": 6000008,
    "both, mirror": 6000037,
    "both, jumps": 6000093,
    "rings, sector": 6000108,
    "solid, mirror": 6000067,
    "curved, ranks": 6000040,
    "curved, jumps": 6000012,
    "stick, scale": 6000013,
    "stick, jumps": 6000069,
    "program, restart": 6000014,
    "heat, ranks": 6000001,
    "heat, scale": 6000057,
    "heat, jumps": 6000239,
    "solid, slice_of_solid": 6000011,
    "passing, scale": 6000016,
    "block, mirror": 6000003,
    "oval, scale": 6000004,
    "sphere, scale": 6000021,
    "warm_stick, mirror": 6000006,
}


@pytest.mark.process
@pytest.mark.parametrize("seed", SEEDS.values(), ids=SEEDS)
def test_sample(seed: int, request: pytest.FixtureRequest) -> None:
    """Balances hold, and other ways come to the same."""
    made, ask = invariants.problem(seed)
    assert f"{made.kind}, {ask}" in request.node.name
    assert invariants.try_problem(seed) == ("ok", f"{made.name}, {ask}")


def test_a_meter_that_is_wrong_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """By what is worn off all material points."""
    true = PhaseMeter.__call__
    monkeypatch.setattr(PhaseMeter, "__call__", lambda self, pressure: true(self, pressure).times(1 + 1e-6))
    verdict, why = invariants.try_problem(SEEDS["plane, restart"])
    assert verdict == "wrong"
    assert "volume" in why


def test_a_checkpoint_that_is_wrong_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """By what a run comes to that never stopped."""
    true = checkpoint.load

    def load(*given: Any) -> tuple[Tribosystem, RunState, dict[str, float]]:
        system, state, extremes = true(*given)
        return system, replace(state, worn=WornDepths((1 + 1e-6) * state.worn.punch, state.worn.strip)), extremes

    monkeypatch.setattr(checkpoint, "load", load)
    verdict, why = invariants.try_problem(SEEDS["plane, restart"])
    assert verdict == "wrong"
    assert "restart: wear" in why
