"""A pin that turns about an axis through its contact: what nodes at the axis slide."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.special import ellipe

from fenwear import Tribosystem, steady
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import march_within
from fenwear.surfaces.sliding_field import node_rates

RADIUS, FORCE, K = 3.0, 100.0, 1e-8
PIN = (
    "geometry={file='pin_on_disc.geo', degree=1, order=1}",
    "punch.no_turning_about=['x', 'y']",
    "contact.friction=0",
)


def pin(assembled: Callable[..., Tribosystem], axis: tuple[float, float], around: int, across: int) -> Tribosystem:
    sizes = f"pin_radius=3, track_radius=0, disc_radius=6, across={across}, around={around}, outer=1, pin_layers=1"
    return assembled(
        "pin-on-disc",
        *PIN,
        f"geometry.parameters={{{sizes}, disc_layers=1}}",
        f"motion={{kind='rotation', centre=[{axis[0]}, {axis[1]}, 0], angular_speed=1, duration={2 * np.pi}}}",
        f"wear.punch.coefficient={K}",
    )


@pytest.mark.parametrize("axis", [(0.0, 0.0), (1.1, 0.3), (2.5, -0.2)])
def test_wear_about_an_axis_in_the_contact(assembled: Callable[..., Tribosystem], axis: tuple[float, float]) -> None:
    """In the end p = c / r: V' = k F omega A / (integral of 1 / r), with 4 R E(d / R) for it at d from the middle.

    The volume of a turn comes nearer to it with the mesh, at a node of which the axis passes or between nodes.
    """
    away = np.hypot(*axis)
    exact = K * FORCE * 2 * np.pi * np.pi * RADIUS**2 / (4 * RADIUS * ellipe((away / RADIUS) ** 2))
    errors = []
    for around, across in ((3, 2), (6, 4)):
        system = pin(assembled, axis, around, across)
        state, weights = steady(system), system.pair.weights
        assert weights @ state.phase_pressure[0] == pytest.approx(FORCE, rel=1e-9)
        errors.append(abs(float(weights @ state.wear_per_cycle) / exact - 1))
        optimum = system.optimum(1)
        np.testing.assert_allclose(optimum.pressure, state.phase_pressure[0], rtol=1e-6)
    assert errors[0] < 0.03, errors
    assert errors[1] < 0.01, errors


def test_nodes_at_the_axis(assembled: Callable[..., Tribosystem]) -> None:
    """The square around the axis: v_m is exact; a first turn under even pressure wears within 2 % of k p v."""
    system = pin(assembled, (0.0, 0.0), 6, 4)
    pair, radius = system.pair, np.linalg.norm(system.pair.punch.x[:, :2], axis=1)
    (block,) = march_within(system, RunLimits(1, block=1))
    slid = 2 * np.pi * (pair.weights * radius) @ block.pressure[0]
    assert pair.weights @ block.wear[-1] == pytest.approx(K * slid, rel=0.02)
    middle = radius.argmin()
    half, t = np.sqrt(pair.weights[middle]) / 2, np.linspace(0, np.pi / 4, 2001)
    for power in (0.5, 1.0, 1.5):
        to_edge = np.trapezoid((half / np.cos(t)) ** (2 - power), t) / (2 - power)
        rates = node_rates(system.sliding.field, pair, power)
        assert rates[middle] == pytest.approx((8 * to_edge / (4 * half**2)) ** (-1 / power), rel=1e-6)


def test_ball_that_turns_about_an_axis_through_its_cup(assembled: Callable[..., Tribosystem]) -> None:
    """The hemisphere of a cup wears k F omega R 2 / pi about its pole; about (0.8, 0, 0.6) it moves aside, too.

    Rigid bodies, with p = (lambda . n) / v and no force aside, over 85 degrees: 0.63196; 1.06675, and velocities whose
    ratio is -0.34151.
    """
    found = []
    for axis in ([0.0, 0.0, 1.0], [0.8, 0.0, 0.6]):
        system = assembled(
            "ball-in-cup",
            "geometry={file='ball_in_cup.geo', degree=1, order=1, parameters={across=8, around=6, clearance=0, "
            "contact_angle=85, cup_layers=1, ball_layers=1}}",
            "contact.friction=0",
            "punch.loads=[{on='punch_back', force=[0, 0, -1000], through=[0, 0, 0]}]",
            f"motion={{kind='rotation', axis={axis}, angular_speed=1, duration={2 * np.pi}}}",
        )
        state = steady(system)
        volume = system.pair.weights @ state.wear_per_cycle / (1e-9 * 1000 * 14 * 2 * np.pi)
        found.append([volume, state.velocity["lambda_Fx"] / state.velocity["lambda_F"]])
    np.testing.assert_allclose(found, [[0.63196, 0.0], [1.06675, -0.34151]], rtol=0.006, atol=1e-6)
