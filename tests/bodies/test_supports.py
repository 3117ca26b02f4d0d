"""Rigid motions that supports leave: guides against turning, and bodies that find their place."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fenwear import CaseError, Tribosystem, assemble, jump, load_case, march, steady
from fenwear.results.forces_and_place import quantities
from fenwear.results.quantity import computed

TURNING = """
title = "A bushing that finds its place on a turning shaft"
[geometry]
file = "bushing.geo"
degree = 2
order = 2
[geometry.parameters]
radius = 10
clearance = 0.05
wall = 20
shaft_wall = 9
contact_angle = 180
elements_along_contact = 160
[model]
plane = "strain"
thickness = "1 mm"
[materials.steel]
young = 210e3
poisson = 0.3
[punch]
regions = {punch_body = "steel"}
no_turning_about = ["y"]
pivot = [0, 0]
[[punch.loads]]
on = "punch_top"
force = [0, -50]
[strip]
regions = {strip_body = "steel"}
[[strip.supports]]
on = "strip_bottom"
fix = ["x", "z"]
[contact]
friction = 0.3
[wear.punch]
coefficient = 1e-8
[motion]
kind = "rotation"
axis = [0, 1, 0]
angular_speed = 1
duration = 1
[run]
half_cycles = 1
"""


def floating(folder: Path, *settings: str) -> Tribosystem:
    """Return the bushing free to move in all directions, held against turning alone."""
    (folder / "floating.toml").write_text(TURNING, "utf-8")
    return assemble(load_case(folder / "floating.toml", settings))


@pytest.mark.parametrize("friction", [0.0, 0.1, 0.5])
def test_attitude_angle(friction: float, tmp_path: Path) -> None:
    """Pressure and friction together balance the load: the contact's middle is at atan mu, and stays there worn."""
    system = floating(tmp_path, f"contact.friction={friction}")
    assert system.rigid.mode_names == ("lambda_F", "lambda_Fx")
    assert system.normal_force == pytest.approx(50, rel=1e-12)
    x, weights = system.pair.punch.x, system.pair.weights
    angle = np.arctan2(x[:, 0], x[:, 1] + 0.05)
    *_, worn = jump(system, 100_000, tolerance=0.03)
    for pressure in (next(iter(march(system, 1))).pressure[0], worn.pressure[-1]):
        traction = (system.pair.normal + system.phases.middle_ratio(1)) * (weights * pressure)[:, None]
        np.testing.assert_allclose(traction.sum(axis=0), [0, 50], atol=1e-8)
        middle = angle @ (weights * pressure) / (weights @ pressure)
        assert middle == pytest.approx(-np.arctan(friction), abs=np.radians(0.3))
    found = computed(worn, quantities(worn.system))
    assert found["attitude_angle"][-1] == pytest.approx(-np.degrees(np.arctan(friction)), abs=0.3)
    assert found["eccentricity"][-1] == pytest.approx(0.05 + worn.wear[-1].max(), abs=2e-3)


def test_steady_state_of_a_bushing(tmp_path: Path) -> None:
    """All of one half wears evenly along one way: p = p0 cos psi, p0 = 2 P / (pi R sqrt(1 + mu²)), about atan mu."""
    system = floating(tmp_path)
    exact = 2 * 50 / (np.pi * 10.05 * np.hypot(1, 0.3))
    for pressure in (system.optimum(1).pressure, steady(system).pressure[0]):
        x = system.pair.punch.x
        psi = np.arctan2(x[:, 0], x[:, 1] + 0.05) + np.arctan(0.3)
        np.testing.assert_allclose(pressure, exact * np.maximum(np.cos(psi), 0), atol=0.02 * exact)
        assert pressure.max() == pytest.approx(exact, rel=5e-3)


def test_guided_against_tilting() -> None:
    """Example 1's punch, which friction tilts about its pin: in a guide it wears to an even pressure."""
    case = load_case("example1", ["geometry.parameters.elements_along_contact=16", "punch.no_turning_about=['y']"])
    system = assemble(case)
    assert system.rigid.mode_names == ("lambda_F",)
    np.testing.assert_allclose(system.optimum(1).pressure, system.rigid.mean_pressure, rtol=1e-9)
    pressure = next(iter(march(system, 1))).pressure[0]
    assert pressure @ system.pair.weights == pytest.approx(system.rigid.mean_pressure * system.pair.weights.sum())


@pytest.mark.parametrize(
    ("name", "settings", "message"),
    [
        ("example1", ["punch.no_turning_about=['x']"], "punch.no_turning_about: expected y, got 'x'"),
        ("ring-on-ring", ["punch.no_turning_about=['y']"], "punch.no_turning_about: expected none, got 'y'"),
        ("example1", ["punch.no_turning_about=['w']"], "punch.no_turning_about"),
    ],
)
def test_guides_that_are_none(name: str, settings: list[str], message: str) -> None:
    """Of axes that the model does not turn about."""
    with pytest.raises(CaseError, match=message):
        assemble(load_case(name, settings))


def test_a_flat_contact_carries_nothing_along_it(tmp_path: Path) -> None:
    """A body free along its contact is refused by its key, as the part of a bore that does not wrap the shaft is."""
    narrow = ["geometry.parameters.contact_angle=20", "geometry.parameters.margin_angle=30"]
    with pytest.raises(CaseError, match=r"punch.supports:"):
        floating(tmp_path, *narrow)
