"""The limit of explicit wear steps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator

from fenwear import Tribosystem, assemble, load_case, march
from fenwear.common.arrays import Array
from fenwear.steps import stability, stability_number

MEAN = 1e4 / 600
EVEN = ("geometry.degree=1", "geometry.parameters.edge_grading=1", "geometry.parameters.elements_along_contact=32")


def at_number(assembled: Callable[..., Tribosystem], number: float, *settings: str) -> Tribosystem:
    """Return one-way sliding of Example 1 whose wear step is `number` times the explicit limit."""
    one_way = "motion={kind='one-way', direction='leftward', speed=3, duration=1}"
    start = stability_number(assembled("example1", one_way, "wear.punch.coefficient=1e-7", *settings))
    return assembled("example1", one_way, f"wear.punch.coefficient={1e-7 * number / start!r}", *settings)


@pytest.mark.parametrize("settings", [EVEN, ("geometry.degree=2",), ("geometry.degree=4",)])
def test_limit_is_where_explicit_steps_fail(assembled: Callable[..., Tribosystem], settings: tuple[str, ...]) -> None:
    """Verification 17: at 0.97 of the limit the pressure tends to the optimum, at 1.03 it oscillates for ever."""
    distances = []
    for number in (0.97, 1.03):
        system = at_number(assembled, number, *settings)
        assert stability_number(system) == pytest.approx(number, rel=1e-3)
        *_, last = march(system, 1000)
        distances.append(last.optimum_distance[-1])
    assert distances[0] < 1e-5
    assert distances[1] > 1e-2
    change = np.diff(last.pressure[-2:], axis=0)[0]
    assert np.abs(change).max() > 0.1 * MEAN
    assert (change > 0.01 * MEAN).any()
    assert (change < -0.01 * MEAN).any()


def test_limit_with_both_worn(assembled: Callable[..., Tribosystem]) -> None:
    """On a closed track the strip recedes evenly, which disturbs nothing: a march fails at the limit all the same."""
    one_way = "motion={kind='one-way', direction='leftward', speed=3, duration=1, track=1e4}"
    grown = []
    for number in (0.97, 1.03):
        settings = ("geometry.degree=2", "geometry.parameters.elements_along_contact=8", one_way)
        laws = [f"wear.{body}.coefficient=1e-7" for body in ("punch", "strip")]
        start = stability_number(assembled("example1", *settings, *laws))
        laws = [f"wear.{body}.coefficient={1e-7 * number / start!r}" for body in ("punch", "strip")]
        *_, last = march(assembled("example1", *settings, *laws), 1000)
        grown.append(float(np.abs(np.diff(last.pressure[-2:], axis=0)).max()))
    assert grown[0] < 1e-6 * MEAN
    assert grown[1] > 0.1 * MEAN


def test_proportional_to_the_step(assembled: Callable[..., Tribosystem]) -> None:
    """The number is linear in beta~ and u0; with b, it grows as b p_m^(b - 1)."""
    one = stability_number(assembled("example1"))
    assert stability_number(assembled("example1", "motion.amplitude=4.5")) == pytest.approx(3 * one, rel=1e-3)
    squared = assembled("example1", "wear.punch.pressure_exponent=2", "wear.punch.coefficient=3.926990816987242e-8")
    assert stability_number(squared) == pytest.approx(2 * MEAN * one, rel=1e-3)


def test_modes_that_lie_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two shoes that are alike have fastest modes that ARPACK may not tell apart: products alone find their size."""
    system, largest = assemble(load_case("drum-brake")), []

    def not_apart(operator: LinearOperator, **_: object) -> Array:
        largest.append(np.abs(np.linalg.eigvals(operator @ np.eye(operator.shape[0]))).max())
        raise ArpackNoConvergence("not apart", np.zeros(0), np.zeros((0, 0)))

    monkeypatch.setattr(stability, "eigs", not_apart)
    assert stability_number(system) == pytest.approx(max(largest) / 2, rel=0.02)
