"""The third body by itself: its exact steps against an integration, its rate against whole cycles."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fenwear.laws.debris import Debris

SLID = np.array([[0.3, 2.0, 0.0], [0.5, 1.0, 0.0]])  # mm, of two phases at three nodes
WORN = np.array([[1.0, 2.0, 0.5], [3.0, 0.5, 0.0]])
LAW = Debris(0.7, np.array([0.4, 1.5, 1.0]))


def test_a_cycle_is_integrated_exactly() -> None:
    """Thickness follows dt/ds = share dw/ds - t / life over each phase; what is ejected is the rest."""
    start = np.array([0.8, 0.1, 2.0])
    added, ejected = LAW.over(SLID).change(start, WORN)
    for node in range(2):
        t, lost = start[node], 0.0
        for slid, worn in zip(SLID[:, node], WORN[:, node], strict=True):

            def rates(_: float, y: np.ndarray, fed: float = worn / slid, life: float = LAW.life[node]) -> list[float]:
                return [0.7 * fed - y[0] / life, 0.3 * fed + y[0] / life]

            t, lost = solve_ivp(rates, (0, slid), [t, lost], rtol=1e-11, atol=1e-13).y[:, -1]
        assert start[node] + added[node] == pytest.approx(t, rel=1e-8)
        assert ejected[node] == pytest.approx(lost, rel=1e-8)
    assert added[2] == pytest.approx(0.7 * 0.5)  # where nothing slides nothing is lost
    assert added + ejected == pytest.approx(WORN.sum(axis=0), rel=1e-14)


def test_many_cycles_by_the_rate() -> None:
    """The rate of jumps gives after whole cycles what the cycles give one by one; a long step their end."""
    cycle, t = LAW.over(SLID), np.array([0.8, 0.1, 2.0])
    marched = t.copy()
    for _ in range(7):
        marched = marched + cycle.change(marched, WORN)[0]

    def rate(_: float, y: np.ndarray) -> np.ndarray:
        return cycle.rate(y, WORN, 0.0)[0]

    assert solve_ivp(rate, (0, 7), t, rtol=1e-11, atol=1e-13).y[:, -1] == pytest.approx(marched, rel=1e-8)
    end = t + 1e9 * cycle.rate(t, WORN, 1e9)[0]
    for _ in range(400):
        marched = marched + cycle.change(marched, WORN)[0]
    assert end[:2] == pytest.approx(marched[:2], rel=1e-6)


def test_slopes_of_implicit_steps() -> None:
    """They are those of the thickness to what is worn."""
    cycle, t = LAW.over(SLID), np.array([0.8, 0.1, 2.0])
    for cycles in (None, 0.29, 50.0):
        for phase in range(2):
            more = WORN.copy()
            more[phase] += 1.0
            if cycles is None:
                change = cycle.change(t, more)[0] - cycle.change(t, WORN)[0]
            else:
                change = cycles * (cycle.rate(t, more, cycles)[0] - cycle.rate(t, WORN, cycles)[0])
            assert change == pytest.approx(cycle.slope(cycles)[phase], rel=1e-12)
