"""The limit of explicit wear steps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fenwear import System, march
from fenwear.cycle import stability_number

MEAN = 1e4 / 600
EVEN = ("geometry.degree=1", "geometry.parameters.edge_grading=1", "geometry.parameters.elements_along_contact=32")


def at_number(assemble: Callable[..., System], number: float, *settings: str) -> System:
    """Return one-way sliding of Example 1 whose wear step is `number` times the explicit limit."""
    one_way = "motion={kind='one-way', direction='leftward', speed=3, duration=1}"
    start = stability_number(assemble("example1", one_way, "wear.punch.coefficient=1e-7", *settings))
    return assemble("example1", one_way, f"wear.punch.coefficient={1e-7 * number / start!r}", *settings)


@pytest.mark.parametrize("settings", [EVEN, ("geometry.degree=2",), ("geometry.degree=4",)])
def test_limit_is_where_explicit_steps_fail(assemble: Callable[..., System], settings: tuple[str, ...]) -> None:
    """Verification 17: at 0.97 of the limit the pressure tends to the optimum, at 1.03 it oscillates for ever."""
    distances = []
    for number in (0.97, 1.03):
        system = at_number(assemble, number, *settings)
        assert stability_number(system) == pytest.approx(number, rel=1e-3)
        *_, last = march(system, 1000)
        distances.append(last.optimum_distance[-1])
    assert distances[0] < 1e-5
    assert distances[1] > 1e-2
    change = np.diff(last.pressure[-2:], axis=0)[0]
    assert np.abs(change).max() > 0.1 * MEAN
    assert (change > 0.01 * MEAN).any()
    assert (change < -0.01 * MEAN).any()


@pytest.mark.parametrize("number", [1.03, 100.0, 1e4])
def test_implicit_steps_have_none(assemble: Callable[..., System], number: float) -> None:
    """Far above the limit the implicit step comes nearer to the optimum with each half-cycle, without oscillation."""
    system = at_number(assemble, number, *EVEN)
    block = next(march(system, 200, implicit=True))
    deviation = np.sqrt((block.pressure - system.optimum(-1).pressure) ** 2 @ system.facing.weights)
    falling = deviation > 1e-9 * deviation[0]
    assert (np.diff(deviation[falling]) < 0).all()
    assert deviation[-1] < (1e-6 if number > 10 else 0.2) * deviation[0]


def test_order_of_magnitude(rigid_punch: Callable[..., System]) -> None:
    """Verification 17: the limit k ds = 4 h / (pi E*) of a half-plane with nodal spacing h, within a factor of 2."""
    wear = 1e-6
    numbers = []
    for count in (16, 32):
        even = (*EVEN, f"geometry.parameters.elements_along_contact={count}", f"wear.punch.coefficient={wear}")
        numbers.append(stability_number(rigid_punch(*even)))
        estimate = wear * 3 / (4 * (60 / count) / (np.pi * 2e5))
        assert 0.5 < numbers[-1] / estimate < 2
    assert numbers[1] / numbers[0] == pytest.approx(2, rel=0.05)


def test_proportional_to_the_step(assemble: Callable[..., System]) -> None:
    """The number is linear in beta~ and u0; with b, it grows as b p_m^(b - 1)."""
    one = stability_number(assemble("example1"))
    assert stability_number(assemble("example1", "motion.amplitude=4.5")) == pytest.approx(3 * one, rel=1e-3)
    squared = assemble("example1", "wear.punch.pressure_exponent=2", "wear.punch.coefficient=3.926990816987242e-8")
    assert stability_number(squared) == pytest.approx(2 * MEAN * one, rel=1e-3)
