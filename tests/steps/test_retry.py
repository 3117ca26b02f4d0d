"""What does not converge is tried again in another way, from the same state, and told."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

from fenwear import ConvergenceError, Tribosystem, jump
from fenwear.case.program import stages_of
from fenwear.common.errors import FULL_START, INTERIOR, MARCHED, SHORTER_JUMPS, SMALLER_STEPS, SOFTER_START
from fenwear.contact import ContactState
from fenwear.contact.inequality import Inequality
from fenwear.steps import Block
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import march_within
from fenwear.steps.phase import PhaseEnd, PhaseStep
from fenwear.steps.program_stages import at_stage
from fenwear.system import in_parts

Assemble = Callable[..., Tribosystem]
COARSE = ("geometry.parameters.elements_along_contact=4", "geometry.degree=2")
# So much heat in a half-cycle that contact and heat taken together have no solution.
HOT = (*COARSE, "motion.amplitude=20", "heat.convecting_faces=true", "heat.debris=0")
MEAN = 1e4 / 600


def test_parts_of_a_later_stage(assembled: Assemble) -> None:
    """Phases cut into parts keep the clock and the surroundings of their stage."""
    steps = "program.steps=[{cycles=2}, {cycles=2, ambient='50 K'}]"
    system = assembled("example1-heat", *COARSE, steps, "run.half_cycles=8")
    staged = at_stage(system, stages_of(system.case)[1])
    parts = in_parts(staged, 3)
    assert parts.sliding.clock == staged.sliding.clock != system.sliding.clock
    assert parts.exchange.ambient == staged.exchange.ambient == 50.0


def run(system: Tribosystem, half_cycles: int, **options: Any) -> Block:
    (block,) = march_within(system, RunLimits(half_cycles, block=half_cycles), **options)
    return block


@pytest.fixture
def failing(monkeypatch: pytest.MonkeyPatch) -> Callable[[Tribosystem], list[int]]:
    """Return fails(system): phases of a system do not converge at their second cycle; lists the failures."""

    def fails(system: Tribosystem) -> list[int]:
        original, failed = PhaseStep.solve, []

        def solve(self: PhaseStep, temperature: Any, worn: Any, before: ContactState | None, *load: Any) -> PhaseEnd:
            if self.system is system and before is not None and self.phase not in failed:
                failed.append(self.phase)
                raise ConvergenceError("on purpose")
            return original(self, temperature, worn, before, *load)

        monkeypatch.setattr(PhaseStep, "solve", solve)
        return failed

    return fails


@pytest.mark.parametrize("implicit", [False, True])
@pytest.mark.parametrize(
    ("case", "settings"),
    [
        ("example1", COARSE),
        ("example1", (*COARSE, "wear.strip.coefficient=1e-8", "motion.positions=3", "geometry.parameters.overlap=3")),
        ("example1-heat", (*COARSE, "heat.partition=0.2")),
        ("example1-heat", (*COARSE, "heat.partition=0.2", "heat.operator=full")),
    ],
)
@pytest.mark.mpi("example1-settings1-True", "example1-heat-settings3-False")
def test_half_cycles_in_parts(
    assembled: Assemble,
    failing: Callable[[Tribosystem], list[int]],
    case: str,
    settings: tuple[str, ...],
    implicit: bool,
) -> None:
    """A half-cycle in five parts wears and heats what it does as a whole, but for the size of the steps."""
    system = assembled(case, *settings)
    usual = run(system, 8, implicit=implicit)
    assert usual.retries.max() == 0
    strokes = failing(system)
    retried = run(system, 8, implicit=implicit)
    half_cycles = MPI.COMM_WORLD.bcast(len(strokes))  # a stroke fails at each of its phases, in turn
    assert half_cycles == len(system.motion.phases)
    assert retried.retries.sum() == half_cycles
    parts = 5 * system.motion.positions
    assert retried.remedies == {SMALLER_STEPS.format(parts): half_cycles}
    np.testing.assert_allclose(retried.worn_area_increment, usual.worn_area_increment, rtol=1e-12)
    np.testing.assert_allclose(retried.worn_area_increment_strip, usual.worn_area_increment_strip, rtol=1e-12)
    assert retried.equilibrium_error.max() < 1e-12
    np.testing.assert_allclose(retried.pressure, usual.pressure, rtol=0, atol=0.02 * usual.pressure.max())
    if retried.heat is None or usual.heat is None:
        return
    assert retried.heat.balance_error.max() < 1e-8
    np.testing.assert_allclose(retried.heat.terms[:, 0], usual.heat.terms[:, 0], rtol=1e-12)
    largest = usual.heat.largest_temperature.max()
    np.testing.assert_allclose(
        retried.heat.temperature_punch, usual.heat.temperature_punch, rtol=0, atol=0.05 * largest
    )


def test_heat_too_strong_for_a_half_cycle(assembled: Assemble) -> None:
    """A run that ended here goes on in smaller steps: nothing of wear, force and heat is lost."""
    system = assembled("example1-heat", *HOT)
    block = run(system, 20)
    assert 0 < np.count_nonzero(block.retries) < 20
    assert any(name.startswith("solved in") for name in block.remedies)
    np.testing.assert_allclose(block.worn_area_increment, 1.25e-8 * np.pi * 1e4 * 40 / 10, rtol=1e-12)
    assert block.heat is not None
    assert block.heat.balance_error.max() < 1e-10
    assert block.equilibrium_error.max() < 1e-10


def test_no_parts_converge(assembled: Assemble, monkeypatch: pytest.MonkeyPatch) -> None:
    """The error is that of the whole half-cycle, and names it."""
    system = assembled("example1", *COARSE)

    def solve(self: PhaseStep, *_: Any) -> PhaseEnd:
        raise ConvergenceError("the whole" if self.system is system else "a part")

    monkeypatch.setattr(PhaseStep, "solve", solve)
    with pytest.raises(ConvergenceError, match="half-cycle 1: the whole"):
        run(system, 4)


@pytest.mark.parametrize("ways", [1, 2, 3])
def test_contact_by_another_way(assembled: Assemble, monkeypatch: pytest.MonkeyPatch, ways: int) -> None:
    """With the first ways closed the next one finds the same contact; which one is noted."""
    system = assembled("example1", *COARSE)
    usual = run(system, 6)
    original, closed = Inequality.solve, [0]

    def solve(self: Inequality, start: Any, **options: Any) -> Any:
        if closed[0] < min(ways, 2):
            closed[0] += 1
            raise ConvergenceError("closed")
        return original(self, start, **options)

    def from_inside(*_: Any) -> Any:
        raise ConvergenceError("closed")

    monkeypatch.setattr(Inequality, "solve", solve)
    if ways == 3:
        monkeypatch.setattr(Inequality, "solve_from_inside", from_inside)
    start = ContactState(usual.pressure[-2:-1], usual.gap[-2:-1], usual.rigid[-2:-1], 0)
    found = system.contact((1,)).solve(usual.wear[-3], start)
    assert system.remedies.take() == {(FULL_START, INTERIOR, SOFTER_START)[ways - 1]: 1}
    np.testing.assert_allclose(found.pressure[0], usual.pressure[-2], rtol=0, atol=1e-9 * MEAN)


@pytest.mark.parametrize("shortest", [16, 1])
def test_jumps_that_fail(assembled: Assemble, monkeypatch: pytest.MonkeyPatch, shortest: int) -> None:
    """A jump that does not converge is shortened; a single cycle is marched. All is reported."""
    system = assembled("example1", *COARSE)
    *_, usual = jump(system, 400, tolerance=1e-3)
    method = sys.modules["fenwear.steps.jump_method"]
    original = method.two_stages

    def step(law: Any, moment: Any, cycles: float, *since: Any) -> Any:
        if cycles >= shortest:
            raise ConvergenceError("on purpose")
        return original(law, moment, cycles, *since)

    monkeypatch.setattr(method, "two_stages", step)
    blocks = list(jump(system, 400, tolerance=1e-3))
    told = sum((block.remedies for block in blocks), start=type(usual.remedies)())
    if shortest == 16:
        assert set(told) == {SHORTER_JUMPS}
    else:
        assert told == {MARCHED: 200}
    last = blocks[-1]
    assert last.half_cycle[-1] == 400
    np.testing.assert_allclose(last.pressure[-2:], usual.pressure[-2:], rtol=0, atol=0.01 * usual.pressure.max())
    np.testing.assert_allclose(last.worn_area_increment, usual.worn_area_increment[-1], rtol=1e-12)
