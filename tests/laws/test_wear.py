"""The wear rule of both bodies."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fenwear import CaseError, Tribosystem, load_case
from fenwear.case import Contact, Dependence, WearLaw
from fenwear.common.arrays import Array
from fenwear.laws import LayerStep
from fenwear.laws.friction import ContactConditions, Friction
from fenwear.laws.wear import coefficient

BOTH = (
    "geometry.parameters.elements_along_contact=8",
    "geometry.parameters.overlap=4",
    "wear.strip={coefficient=2e-8, pressure_exponent=2.0}",
    "motion.positions=3",
)


def conditions(pressure: Array, speed: float = 2.0, temperature: float = 300.0) -> ContactConditions:
    surfaces = (np.full_like(pressure, temperature), np.full_like(pressure, 280.0))
    return ContactConditions.at(pressure, speed, surfaces)


@pytest.mark.parametrize("b", [0.5, 1.0, 2.0, 3.0])
def test_depth(assembled: Callable[..., Tribosystem], b: float) -> None:
    """w = beta~ p^b S, node by node, and none where there is no pressure; equations (1), (26)."""
    system = assembled("example1", f"wear.punch={{coefficient=2e-8, pressure_exponent={b}}}")
    n = len(system.pair.x)
    p = np.stack([np.linspace(0, 9, n), np.linspace(5, 0, n)])
    np.testing.assert_allclose(system.phases.mean_wear.depth(p), 6e-8 * p**b, rtol=1e-13)
    assert system.phases.mean_wear.worn(p).strip.max() == 0


def test_layer_and_its_border(assembled: Callable[..., Tribosystem]) -> None:
    """The layer opens the gap by N cycles' wear of both bodies; L_k R_j is its derivative (central differences)."""
    system = assembled("example1", *BOTH)
    layer = LayerStep(system.phases.passing(system.phases.mean_wear), system.unworn(), 50)
    shape = (len(system.motion.phases), len(system.pair.x))
    random = np.random.default_rng(1)
    p, change = random.uniform(1, 20, shape), random.uniform(-1, 1, shape)
    left, right = layer.border(p)
    derivative = np.einsum("knq,jqi,ji->kn", left, right, change)
    step = 1e-5
    difference = (layer.opening(p + step * change) - layer.opening(p - step * change)) / (2 * step)
    np.testing.assert_allclose(derivative, difference, rtol=1e-6, atol=1e-6 * np.abs(difference).max())


def test_strip_loses_what_its_pressure_wears(assembled: Callable[..., Tribosystem]) -> None:
    """The cross-section worn off the strip is the integral of beta~ p^b S, at every offset."""
    system = assembled("example1", *BOTH)
    p = np.random.default_rng(2).uniform(1, 20, (len(system.motion.phases), len(system.pair.x)))
    worn = system.phases.mean_wear.worn(p)
    sliding = np.array([phase.distance for phase in system.motion.phases])
    exact = 2e-8 * (sliding[:, None] * p**2) @ system.pair.weights
    assert system.pair.strip.weights @ worn.strip == pytest.approx(exact.sum(), rel=1e-13)


def test_uniform_pressure_wears_the_strip_evenly(assembled: Callable[..., Tribosystem]) -> None:
    """Where the punch stands in every position the track is flat, though no node meets another: a patch test."""
    system = assembled("example1", *BOTH)
    p = np.full((len(system.motion.phases), len(system.pair.x)), 10.0)
    worn, x = system.phases.mean_wear.worn(p), system.pair.strip.x[:, 0]
    always = np.abs(x) < 25
    np.testing.assert_allclose(worn.strip[always], 2e-8 * 100 * 6, rtol=1e-12)
    assert worn.strip[np.abs(x) > 33].max() == 0


def test_coefficients_of_archard_and_energy() -> None:
    """beta~ = K / H, energy mu: 1e-4 / 2 GPa = 5e-8 / MPa; 2e-5 mm³/J at mu = 0.25: 5e-9 / MPa."""
    friction, state = Friction(Contact(friction=0.25)), conditions(np.array([1.0, 3.0]))
    settings = {
        'archard = 1e-4, hardness = "2 GPa"': 5e-8,
        'energy = "2e-5 mm^3/J"': 5e-9,
        'coefficient = "1e-15 m^2/N"': 1e-9,
        'coefficient = {expression = "1e-6 * (1 + p) * v", unit = "1/GPa"}': [4e-9, 8e-9],
        'coefficient = {table = [[200, 0], [400, 2e-8]], of = "T"}': 1e-8,
    }
    for text, expected in settings.items():
        law = load_case("example1-heat", (f"wear.punch={{{text}}}",)).wear.punch
        assert isinstance(law, WearLaw)
        found = coefficient(law, friction, state, "wear.punch")
        np.testing.assert_allclose(found, np.broadcast_to(expected, 2), rtol=1e-12)


def test_friction_of_temperature_pressure_and_speed() -> None:
    """An expression in T (mean of both surfaces), p and v; a table in v with its end values beyond."""
    state = conditions(np.array([1.0, 4.0]))
    law = Friction(Contact(friction=Dependence(expression="0.1 + sqrt(p) * 0.1 + (T - 290) * v")))
    np.testing.assert_allclose(law.values(state), [0.2, 0.3], rtol=1e-12)
    table = Friction(Contact(friction=Dependence(table=((0.0, 0.4), (1.0, 0.1)), of="v")))
    np.testing.assert_allclose(table.values(state), 0.1)


@pytest.mark.parametrize("expression", ["p - 3", "log(0 * p)", "1 / (p - p)"])
def test_bad_values_are_named(expression: str) -> None:
    """A coefficient that is negative or not a number somewhere is an error, with the place in T, p and v."""
    law = Friction(Contact(friction=Dependence(expression=expression)))
    with pytest.raises(CaseError, match=r"contact.friction: .*290.*1.*2"):
        law.values(conditions(np.array([1.0, 4.0])))
