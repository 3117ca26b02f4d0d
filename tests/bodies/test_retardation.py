"""Compliances that grow with time: what a cycle does to their memory is what half-cycle after half-cycle does."""

from __future__ import annotations

import numpy as np
import pytest

from fenwear.bodies.creep_law import Retardation
from fenwear.case.material_tables import Creep, Retarded

LAW = Retardation(np.array([0.5, 2.0]), np.array([0.3, 40.0]))
DURATIONS = np.array([0.2, 0.1, 0.4])


def test_a_constant_load_creeps_as_the_compliance_grows() -> None:
    """Whatever the phases are, at the end of each the displacement is J(t) / J(0) times the elastic one."""
    cycle, y, time = LAW.over(DURATIONS), np.zeros(2), 0.0
    for _ in range(5):
        for phase, duration in enumerate(DURATIONS):
            time += duration
            now = cycle.factors[phase] + cycle.left[phase] @ y
            y = cycle.decays[phase] * y + cycle.taken[phase]
            assert now == pytest.approx(LAW.growth(time), rel=1e-12)
            assert now == pytest.approx(1 + LAW.compliances @ y, rel=1e-12)


def test_cycles_that_repeat() -> None:
    """Many cycles of the same displacements come to the state and to the openings that are asked for at once."""
    cycle, v = LAW.over(DURATIONS), np.array([1.0, -2.0, 5.0])
    y = np.zeros(2)
    for _ in range(2000):
        openings = []
        for phase in range(3):
            y = cycle.decays[phase] * y + cycle.taken[phase] * v[phase]
            openings.append(LAW.compliances @ y)
    assert y == pytest.approx(cycle.lasting.T @ v, rel=1e-12)
    repeating, _ = cycle.within(np.inf)
    assert openings == pytest.approx(repeating @ v, rel=1e-12)
    assert repeating.sum(axis=1) == pytest.approx(np.full(3, LAW.compliances.sum()), rel=1e-12)


def test_steps_over_many_cycles() -> None:
    """Without an end an implicit step is the cycle that repeats; of no length its rate is that of the state."""
    cycle, v, y = LAW.over(DURATIONS), np.array([1.0, -2.0, 5.0]), np.array([0.7, -0.2])
    by_v, by_y = cycle.within(1e12)
    assert by_v == pytest.approx(cycle.within(np.inf)[0], rel=1e-9)
    assert np.abs(by_y).max() < 1e-9
    rate_v, rate_y = cycle.rate(0.0)
    after = y.copy()
    for phase in range(3):
        after = cycle.decays[phase] * after + cycle.taken[phase] * v[phase]
    slow = Retardation(LAW.compliances[1:], LAW.times[1:]).over(DURATIONS)
    assert (rate_v @ v + rate_y * y)[1] == pytest.approx((after - y)[1], rel=slow.cycles[0])
    kept, rest = cycle.within(0.0)
    opened = []
    begun = y - (rate_v @ v + rate_y * y) / 2
    for phase in range(3):
        begun = cycle.decays[phase] * begun + cycle.taken[phase] * v[phase]
        opened.append(LAW.compliances @ begun)
    assert kept @ v + rest @ y == pytest.approx(np.array(opened), rel=1e-12)


def test_growth_with_the_logarithm_of_time() -> None:
    """Its sum of terms is per_decade log10(1 + t / onset), far below and far above the onset."""
    law = Retardation.of(Creep(terms=(Retarded(compliance=0.5, time=3.0),), per_decade=0.2, onset=7.0))
    times = np.geomspace(1e-2, 1e12, 60)
    exact = 1 + 0.5 * -np.expm1(-times / 3) + 0.2 * np.log10(1 + times / 7)
    assert law.endless
    assert np.abs(law.growth(times) - exact).max() < 5e-4 * 0.2
