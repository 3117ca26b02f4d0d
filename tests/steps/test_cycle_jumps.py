"""Cycle jumps: many cycles in one implicit step."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import pytest

from fenwear import Case, Tribosystem, assemble, jump, load_case, march
from fenwear.common.arrays import Array
from fenwear.contact import ContactState
from fenwear.steps import Block
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import jump_within
from fenwear.steps.jump_method import force_difference

MEAN = 1e4 / 600
OPENING = ("contact.friction=0.4", "geometry.parameters.pin_height_1=40")
TEN_TIMES = ("geometry.degree=2", "wear.punch.coefficient=4e-7")  # a tenth of the cycles of the paper's coefficient


def end(system: Tribosystem, half_cycles: int, tolerance: float) -> tuple[Array, Array]:
    *_, last = jump(system, half_cycles, tolerance=tolerance)
    assert last.half_cycle[-1] == half_cycles
    return last.pressure[-2:], last.wear[-1]


@pytest.mark.parametrize("half_cycles", [200, 2000])
@pytest.mark.parametrize("settings", [(), OPENING, ("wear.punch.pressure_exponent=2", "wear.punch.coefficient=2e-8")])
def test_jump_equals_march(assembled: Callable[..., Tribosystem], settings: tuple[str, ...], half_cycles: int) -> None:
    """The same cycles one by one: pressures within 2 % of p_m, wear within 1 %."""
    system = assembled("example1", *TEN_TIMES, *settings)
    *_, last = march(system, half_cycles, implicit=True)
    pressure, wear = end(system, half_cycles, 1e-3)
    inner = np.abs(system.pair.x) < 29
    np.testing.assert_allclose(pressure[:, inner], last.pressure[-2:][:, inner], rtol=0, atol=0.02 * MEAN)
    np.testing.assert_allclose(wear, last.wear[-1], rtol=0, atol=0.01 * last.wear[-1].max())


def test_error_follows_the_tolerance(assembled: Callable[..., Tribosystem]) -> None:
    """Against the same cycles one at a time in the same inequality, the error falls with the tolerance."""
    system, cycles = assembled("example1", *TEN_TIMES), 400
    contact = system.contact((1, -1))
    wear, state = np.zeros_like(system.pair.x), None
    for _ in range(2 * cycles):  # steps of half a cycle, as accurate as the shortest jump
        wearing = system.phases.passing(system.phases.mean_wear).step(system.unworn(), 0.5)
        assert wearing is not None
        state = contact.solve(system.pair.initial_gap + wear, state, wearing)
        wear = wear + wearing.opening(state.pressure)[0]
    assert isinstance(state, ContactState)
    errors = [np.abs(end(system, 2 * cycles, t)[0] - state.pressure).max() / MEAN for t in (1e-2, 1e-3, 1e-4)]
    assert errors[2] < errors[1] < errors[0] < 0.1
    assert errors[2] < 2e-3


def test_laws_come_to_the_march(assembled: Callable[..., Tribosystem]) -> None:
    """As the tolerance falls, depths come to lie between explicit and implicit marches; more laws: `fenwear verify`."""
    law = "wear.punch.coefficient={expression='4e-8 * (1 + p / 20)'}"
    system = assembled("example2", "geometry.degree=2", "geometry.parameters.elements_along_contact=8", law)
    weights = system.pair.weights

    def depth(blocks: Iterable[Block]) -> Array:
        *_, last = blocks
        return last.wear[-1]

    explicit, implicit = (depth(march(system, 200, implicit=way)) for way in (False, True))
    middle = (explicit + implicit) / 2
    errors = [
        float(weights @ np.abs(depth(jump(system, 200, tolerance=tolerance)) - middle) / (weights @ middle))
        for tolerance in (3e-2, 3e-4)
    ]
    assert errors[1] < float(weights @ np.abs(explicit - implicit) / (weights @ middle))
    assert errors[1] < errors[0] < 3e-2


def test_growing_contact(edited: Callable[..., Case]) -> None:
    """A cylinder worn flat over many nodes, one by one: few steps, depths and edge pressures of single steps."""

    def one_way(tables: dict[str, Any]) -> None:
        del tables["wear"]["strip"]
        tables["wear"]["punch"]["coefficient"] = 2e-8
        tables["motion"] = {"kind": "one-way", "direction": "rightward", "speed": 200, "duration": 1}

    width = ("geometry.parameters.contact_width=1", "geometry.parameters.elements_along_contact=80")
    system = assemble(edited("fretting", one_way, *width))
    marched = list(march(system, 220, implicit=True))
    pressure = np.concatenate([block.pressure for block in marched])
    depth = np.concatenate([block.wear for block in marched])[199]
    assert (pressure[0] > 0).sum() < 0.5 * (pressure[199] > 0).sum()
    for tolerance in (2e-2, 3e-3, 5e-4):
        blocks = list(jump(system, 200, tolerance=tolerance))
        if tolerance == 3e-3:
            assert sum(len(block) for block in blocks) < 60
            np.testing.assert_allclose(blocks[-1].wear[-1], depth, rtol=0, atol=1e-3 * depth.max())
        # A node comes into contact a little earlier or later: compared with what it carries in 3 % of the half-cycles,
        # of a march that itself knows no less than two.
        missed = []
        for block in blocks:
            for number, found in zip(block.half_cycle, block.pressure, strict=True):
                if number > 20:
                    around = max(2, int(0.03 * number))
                    own = pressure[number - 1 - around : number + around]
                    beyond = np.maximum(found - own.max(axis=0), own.min(axis=0) - found).max()
                    missed.append(max(beyond, 0.0) / pressure[number - 1].max())
        assert np.mean(missed) < 0.03
        assert max(missed) < 0.12


@pytest.mark.mpi
def test_mean_pressures_at_a_growing_edge() -> None:
    """Means over turns of all nodes, those that come into contact among them, near the march's as the tolerance falls.

    At an instant the outermost nodes are off by 0.05 to 0.5 of the largest pressure, whatever the tolerance.
    """
    sizes = ("geometry.parameters.elements_along_contact=40", "geometry.parameters.contact_width=2 mm")
    system, ends = assemble(load_case("block-on-ring", sizes)), [50, 100, 200, 400]
    rate = 2e-9 * 500.0  # of a turn

    def means(blocks: Iterable[Block]) -> Array:
        found = {0: np.zeros(len(system.pair.weights))}
        for block in blocks:
            found |= dict(zip(block.half_cycle.tolist(), block.totals.pressure, strict=True))
            radii = np.linalg.norm(system.pair.opposite, axis=1) / 20.0
            np.testing.assert_allclose(rate * radii * block.totals.pressure, block.wear, rtol=1e-9, atol=1e-12)
        return np.array([(found[b] - found[a]) / (b - a) for a, b in zip([0, *ends[:-1]], ends, strict=True)])

    expected = means(march(system, ends[-1], implicit=True))
    errors = []
    for tolerance in (0.03, 3e-3, 3e-4):
        apart = np.abs(
            means(jump_within(system, RunLimits(ends[-1], stops=frozenset(ends)), tolerance=tolerance)) - expected
        )
        errors.append((apart.max(axis=1) / expected.max(axis=1)).max())
    assert errors[0] < 1e-3
    assert errors[1] < 0.6 * errors[0]
    assert errors[2] < 3.2e-4  # 3.07e-4 of which are of the half-cycle by which phases of a jump and a march differ


def test_worn_area_of_a_jump_is_exact(assembled: Callable[..., Tribosystem]) -> None:
    """Verification 8 holds over any jump: N cycles wear 2 N beta~ F0 2 u0 / t."""
    system = assembled("example1", *OPENING)
    area = 1.25e-8 * np.pi * 1e4 * 3 / 10
    for block in jump(system, 20_000, tolerance=3e-3):
        np.testing.assert_allclose(block.worn_area_increment, area, rtol=1e-10)
        np.testing.assert_allclose(block.wear @ system.pair.weights, area * block.half_cycle, rtol=1e-9)
        assert block.equilibrium_error.max() < 1e-8
    assert block.half_cycle[-1] == 20_000


def test_few_steps(assembled: Callable[..., Tribosystem]) -> None:
    """20,000 half-cycles take a hundred jumps at most, growing towards the end."""
    numbers = np.concatenate([b.half_cycle for b in jump(assembled("example1"), 20_000, tolerance=3e-3)])
    ends = numbers[1::2]
    assert (numbers[::2] + 1 == ends).all()
    assert len(ends) <= 100
    assert np.diff(ends)[-5:].max() > 100 * np.diff(ends)[0]


def test_example_2_stays_symmetric(assembled: Callable[..., Tribosystem]) -> None:
    """Both phases stand in one inequality: p+(x) = p-(-x) to round-off all the way."""
    for block in jump(assembled("example2"), 20_000, tolerance=3e-3):
        for plus, minus in zip(block.pressure[::2], block.pressure[1::2], strict=True):
            np.testing.assert_allclose(plus, minus[::-1], rtol=0, atol=1e-7 * plus.max())


def test_stops_when_periodic(assembled: Callable[..., Tribosystem]) -> None:
    """A jump run ends where the change per cycle falls below the tolerance."""
    *_, last = jump(assembled("example1"), 10_000_000, tolerance=3e-3, periodic_within=1e-6)
    assert last.half_cycle[-1] < 1_000_000
    assert last.periodicity[-2:].max() < 1e-6


def test_distance_of_forces(assembled: Callable[..., Tribosystem]) -> None:
    """The distance by which force is moved is scipy's, over the width; and what one is larger by."""
    from scipy.stats import wasserstein_distance

    system = assembled("example1", "geometry.degree=2")
    x, weights = system.pair.x, system.pair.weights
    random = np.random.default_rng(1)
    one, other = (np.where(np.abs(x) < 20, random.uniform(0, 1, len(x)), 0.0) for _ in range(2))
    forces = weights @ one, weights @ other
    expected = wasserstein_distance(x, x, weights * one, weights * other) / np.ptp(x[(one > 0) | (other > 0)])
    expected += abs(forces[0] - forces[1]) / max(forces)
    assert force_difference(system.pair, one, other) == pytest.approx(expected, rel=1e-12)
