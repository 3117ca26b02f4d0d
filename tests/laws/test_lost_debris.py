"""Debris that leaves at the edges of a contact, or by a law of the user, and laws that know of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from combinations import SMALL, STICK

from fenwear import Tribosystem, assemble, load_case, steady
from fenwear.common.arrays import Array
from fenwear.steps import Block, evolve, growth_rate
from fenwear.steps.coupled_phases import cycle_heat
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import march_within
from fenwear.steps.tangent import lies_after, phase_tangent

WORN = {"gross-sliding": 1e-6, "coulomb": 2e-5}  # 1/MPa: the scar grows by some nodes
EDGES = "contact.third_body={share=0.9, life='30 mm', edge_life='0.3 mm', edge_length='0.02 mm'}"
OWN = "contact.third_body={share=0.8, life={expression='3 * (1 + p / 300) / (1 + 100 * debris)', unit='mm'}}"
LASTS = "contact.third_body={share=0.6, life='3 mm'}"
PROTECTS = "wear.punch.coefficient={expression='WORN * (0.2 + 0.8 * exp(-debris / 1e-3))', unit='1/MPa'}"


def system_of(law: str, *more: str) -> Tribosystem:
    stick = STICK if law == "coulomb" else ("stick={}",)
    worn = f"wear={{punch={{coefficient='{WORN[law]} 1/MPa'}}}}"
    return assemble(load_case("fretting-partial-slip", [*SMALL, f"contact.law='{law}'", *stick, worn, *more]))


def end(system: Tribosystem, how: str, tolerance: float = 1e-3) -> Block:
    return list(evolve(system, integration=how, tolerance=tolerance))[-1]


def unbalanced(block: Block) -> float:
    """Return what is worn and neither stored nor ejected, over what is worn."""
    weights = block.system.pair.weights
    worn = sum(float(block.totals.of(f"volume_{body}")[-1]) for body in ("punch", "strip"))
    kept = float(weights @ block.end.worn.between[:2].sum(axis=0)) * block.system.bodies.punch.thickness
    return abs(kept / worn - 1)


@pytest.mark.parametrize("laws", [(EDGES,), (OWN,), (EDGES, PROTECTS)], ids=["edges", "own law", "protects"])
def test_jumps_fall_to_the_march_with_their_tolerance(laws: tuple[str, ...]) -> None:
    """Thickness and depth at every node; what is worn is stored or ejected, to rounding."""
    more = [law.replace("WORN", f"{WORN['gross-sliding']}") for law in laws]
    system = system_of("gross-sliding", "run.half_cycles=300", *more)
    marched = end(system, "explicit")
    assert unbalanced(marched) < 1e-12
    errors = []
    for tolerance in (0.3, 0.003):
        block = end(system, "jump", tolerance)
        assert unbalanced(block) < 1e-12
        pairs = (
            (block.end.worn.punch, marched.end.worn.punch),
            (block.end.worn.between[0], marched.end.worn.between[0]),
        )
        errors.append(max(float(np.abs(a - b).max() / b.max()) for a, b in pairs))
    assert errors[0] < 0.1
    assert errors[1] < 5e-3


def test_with_stick_too() -> None:
    """March and jump, both bodies worn; in rough jumps, whose depths are kept from falling, nothing is lost either."""
    both = "wear.strip.coefficient='5e-6 1/MPa'"
    system = system_of("coulomb", "run.half_cycles=60", EDGES, PROTECTS.replace("WORN", "4e-5"), both)
    marched = end(system, "implicit")
    assert unbalanced(marched) < 1e-12
    for tolerance, wrong in ((0.3, 0.2), (0.01, 2e-2)):
        block = end(system, "jump", tolerance)
        assert unbalanced(block) < 1e-12
        apart = np.abs(block.end.worn.between[0] - marched.end.worn.between[0]).max()
        assert apart < wrong * marched.end.worn.between[0].max()


def test_the_steady_state_has_what_is_lost_there() -> None:
    """A march to the end has its thickness, where debris is lost at the edges and wear feels it."""
    system = system_of("gross-sliding", "run.half_cycles=60000", EDGES, PROTECTS.replace("WORN", "3e-6"))
    state, last = steady(system), end(system, "jump", 1e-2)
    assert state.debris is not None
    assert np.abs(last.end.worn.between[0] - state.debris).max() < 1e-3 * state.debris.max()
    assert np.abs(last.pressure[-1] - state.pressure[-1]).max() < 1e-2 * state.pressure.max()


FELT = "contact.friction={expression='0.2 + 0.3 * exp(-debris / 1e-3)'}"


@pytest.mark.parametrize("implicit", [True, False])
@pytest.mark.parametrize("laws", [(LASTS,), (OWN,), (LASTS, PROTECTS, FELT)], ids=["linear", "own law", "felt"])
def test_growth_rates_follow_debris(laws: tuple[str, ...], *, implicit: bool) -> None:
    """A cycle's map of thickness and depth is the derivative of a march's, by differences."""
    system = system_of("gross-sliding", *(law.replace("WORN", "3e-6") for law in laws))
    start = list(march_within(system, RunLimits(200, block=200), implicit=implicit))[-1].end
    n = len(system.pair.weights)

    def cycle(change: Array) -> Block:
        between = start.worn.between + np.array([change[:n], np.zeros(n)])
        worn = replace(start.worn, punch=start.worn.punch + change[n:], between=between)
        return list(march_within(system, RunLimits(202, block=2), implicit=implicit, start=replace(start, worn=worn)))[
            -1
        ]

    pressures, predicted, worn = cycle(np.zeros(2 * n)).pressure, np.eye(2 * n), start.worn
    for phase, pressure in enumerate(pressures):
        predicted = phase_tangent(system, phase, pressure, cycle_heat(system), implicit=implicit, worn=worn) @ predicted
        worn = lies_after(system, phase, pressure, cycle_heat(system), None, worn)
    change = 1e-9 * np.sin(np.arange(2 * n) ** 2)
    ends = [cycle(sign * change).end.worn for sign in (1.0, -1.0)]
    found = np.concatenate([ends[0].between[0] - ends[1].between[0], ends[0].punch - ends[1].punch]) / 2
    assert np.abs(found - predicted @ change).max() < 1e-5 * np.abs(found - change).max()


def test_debris_that_never_leaves_neither_grows_nor_decays() -> None:
    """All of it kept: the gap never changes, and disturbances of pressure neither; with a life they die out."""
    kept = system_of("gross-sliding", "contact.third_body={share=1, life='1e12 m'}")
    lasts = system_of("gross-sliding", LASTS)
    even = np.full((2, len(kept.pair.weights)), kept.rigid.mean_pressure)
    assert abs(growth_rate(kept, even)) < 1e-6
    slowest = -sum(phase.distance for phase in lasts.motion.phases) / 3 / lasts.motion.period
    assert slowest <= growth_rate(lasts, even) < 0
