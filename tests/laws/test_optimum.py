"""The optimal pressure: closed forms, equilibrium, bad loads."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import fsolve

from fenwear import CaseError, ConvergenceError, Tribosystem, assemble, jump, load_case, march
from fenwear.common.arrays import Array

A, MEAN = 30.0, 1e4 / 600  # half-width, mm; p_m, MPa


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("name", ["example1", "example2"])
@pytest.mark.parametrize("b", [0.5, 1.0, 2.0, 3.0])
def test_equilibrium(assembled: Callable[..., Tribosystem], name: str, b: float, direction: int) -> None:
    """Verification 6: force and moment balance of the pressure to 1e-10, by hand; p^b is a rigid motion over K."""
    system = assembled(name, f"wear.punch.pressure_exponent={b}", "wear.punch.coefficient=1e-8")
    found = system.optimum(direction)
    x, force = system.pair.x, system.pair.weights * found.pressure
    assert found.residual < 1e-10
    assert (found.pressure >= 0).all()
    assert force.sum() == pytest.approx(1000, rel=1e-10)
    rate = 1e-8 * 3.0 / (np.pi / 10)  # K, the mean of beta~ v
    rigid = found.velocity["lambda_F"] - found.velocity.get("lambda_M", 0.0) * (x - 30)
    np.testing.assert_allclose(rate * found.pressure**b, np.maximum(rigid, 0), rtol=1e-7, atol=1e-9 * rigid.max())
    if name == "example1":
        assert force @ x == pytest.approx(-direction * 0.25 * 20 * 1000, rel=1e-9)
    else:
        np.testing.assert_allclose(found.pressure, MEAN, rtol=1e-10)


@pytest.mark.parametrize("b", [0.5, 2.0, 3.0])
def test_power_law_against_adaptive_quadrature(assembled: Callable[..., Tribosystem], b: float) -> None:
    """The same equilibrium with p = (f + g x)^(1/b), integrated by QUADPACK and solved by MINPACK."""
    system = assembled("example1", f"wear.punch.pressure_exponent={b}", "wear.punch.coefficient=1e-8")

    def shape(x: float, f: float, g: float) -> float:
        return max(f + g * x / A, 0.0) ** (1 / b)

    def balance(unknown: Array) -> list[float]:
        moments = [quad(lambda x, k=k: shape(x, *unknown) * x**k, -A, A, epsabs=1e-11)[0] for k in (0, 1)]  # type: ignore[misc]
        return [moments[0] / 60 - 1, moments[1] / 60 + 0.25 * 20]

    f, g = fsolve(balance, [1.0, -0.4], xtol=1e-12)
    exact = np.array([shape(x, f, g) for x in system.pair.x]) * MEAN
    inside = system.pair.x < 26  # b = 3: p meets zero near the right edge, with an infinite slope
    np.testing.assert_allclose(system.optimum(1).pressure[inside], exact[inside], rtol=2e-5 if b < 3 else 2e-3)


@pytest.mark.parametrize("direction", [1, -1])
def test_open_contact_is_a_triangle(assembled: Callable[..., Tribosystem], direction: int) -> None:
    """b = 1 with c > 1: a triangle whose centroid lies at x = -d mu l_z, so 3 (a - mu l_z) long, peak 2 P / length.

    The kink lies inside an element; the error falls with the nodes' weights, second order.
    """
    mu, height = 0.4, 40
    length = 3 * (A - mu * height)
    errors = []
    for count in (16, 64):
        settings = (f"contact.friction={mu}", f"geometry.parameters.elements_along_contact={count}")
        system = assembled("monotonic-lz40", "geometry.degree=1", *settings)
        edge = -direction * A
        exact = 2 * 1000 / length * np.maximum(1 - np.abs(system.pair.x - edge) / length, 0)
        found = system.optimum(direction)
        errors.append(np.abs(found.pressure - exact).max() / exact.max())
        assert found.residual < 1e-10
    assert errors[1] < min(1e-3, errors[0] / 8)


@pytest.mark.parametrize(
    ("wear", "shape", "start"),
    [
        (
            "{punch={coefficient=1e-8, pressure_exponent=2, pressure_threshold=4}}",
            lambda w: 4 + np.sqrt(np.maximum(w, 0)),
            (170.0, -3.0),
        ),
        (  # 1e-8 p + 2e-10 p^2 = 1e-8 w
            "{punch={coefficient=1e-8}, strip={coefficient=2e-10, pressure_exponent=2}}",
            lambda w: 25 * (np.sqrt(1 + 0.08 * w) - 1),
            (21.0, -0.4),
        ),
    ],
    ids=["threshold", "two laws"],
)
def test_any_law_against_adaptive_quadrature(
    assembled: Callable[..., Tribosystem], wear: str, shape: Callable[[float], float], start: tuple[float, float]
) -> None:
    """Pressure and wear velocity where laws have a threshold, or both bodies wear by other exponents: w_n linear in x,
    the pressure its inverse, force and moment by QUADPACK and MINPACK."""
    moving = ("motion.positions=2", "geometry.parameters.overlap=3", "contact.friction=0.1")
    system = assembled("example1", *moving, f"wear={wear}")

    def balance(unknown: Array) -> list[float]:
        f, g = unknown
        moments = [quad(lambda x, k=k: shape(f + g * x) * x**k, -A, A, epsabs=1e-11)[0] for k in (0, 1)]  # type: ignore[misc]
        return [moments[0] / 1000 - 1, moments[1] / 1000 + 0.1 * 20]

    f, g = fsolve(balance, start, xtol=1e-12)
    found = system.optimum(1)
    np.testing.assert_allclose(found.pressure, shape(f + g * system.pair.x), rtol=2e-5)
    rate = 1e-8 * 3.0 / (np.pi / 10)  # the mean of beta~ v
    at_pin = found.velocity["lambda_F"] - found.velocity["lambda_M"] * (system.pair.x - A)
    np.testing.assert_allclose(at_pin, rate * (f + g * system.pair.x), rtol=2e-5)


def test_threshold_where_the_punch_turns_within_the_contact(assembled: Callable[..., Tribosystem]) -> None:
    """A trapezium p_0 + g (l - x) over a length l: from force and moment. The error falls with the elements."""
    mu, height, threshold = 0.4, 40, 8.0

    def balance(unknown: Array) -> list[float]:
        length, g = unknown
        force = threshold * length + g * length**2 / 2
        moment = threshold * length**2 / 2 + g * length**3 / 6
        return [force / 1000 - 1, moment / 1000 / (A - mu * height) - 1]

    length, g = fsolve(balance, [40.0, 1.0])
    errors = []
    for count in (16, 64, 256):
        system = assembled(
            "monotonic-lz40",
            "geometry.degree=1",
            f"contact.friction={mu}",
            f"geometry.parameters.elements_along_contact={count}",
            f"wear.punch={{coefficient=1e-5, pressure_threshold={threshold}}}",
        )
        found, x = system.optimum(1), system.pair.x + A
        exact = np.where(x < length, threshold + g * (length - x), 0.0)
        beside = np.abs(x - length) > 120 / count  # the jump lies within an element
        errors.append(np.abs(found.pressure - exact)[beside].max())
        assert found.residual < 1e-10
        assert (np.abs(found.pressure - exact)[~beside] < threshold + g * 120 / count).all()
    assert errors[2] < min(0.1, errors[0] / 4)


def test_no_optimum(assembled: Callable[..., Tribosystem]) -> None:
    """Where nothing need wear, or nothing wears fast enough, none is printed, and a run goes on without it."""
    small = ("geometry.degree=1", "geometry.parameters.elements_along_contact=8", "geometry.follow_wear=never")
    light = assembled("example2", *small, "wear.punch={coefficient=1e-5, pressure_threshold=20}")
    with pytest.raises(ConvergenceError, match="below the pressure_threshold of 20 MPa balance the loads"):
        light.optimum(1)
    (block,) = march(light, 2)
    assert np.isnan(block.optimum_distance).all()
    capped = assembled("example1", *small, "wear.punch={coefficient=1e-5, pressure_cap=20}")
    with pytest.raises(ConvergenceError, match=r"would need 2\d.* pressure_cap of 20 MPa"):
        capped.optimum(1)
    steep = assembled("example1", *small, "wear.punch={coefficient=1e-7, pressure_exponent=400}")
    with pytest.raises(ConvergenceError, match="too large or small"):
        steep.optimum(1)
    assert (
        np.ptp(assembled("example2", *small, "wear.punch={coefficient=1e-5, pressure_cap=20}").optimum(1).pressure)
        < 1e-9
    )


def test_zone(assembled: Callable[..., Tribosystem]) -> None:
    """Only nodes of the contact zone carry: on the middle half of Example 2 the optimum is 2 p_m."""
    system = assembled("example2", "geometry.parameters.edge_grading=1")
    zone = np.abs(system.pair.x) < 15.1
    pressure = system.optimum(1, zone).pressure
    assert (pressure[~zone] == 0).all()
    assert np.ptp(pressure[zone]) < 1e-10
    assert system.pair.weights @ pressure == pytest.approx(1000, rel=1e-10)


@pytest.mark.mpi
def test_neither_speed_nor_wear_coefficient_changes_the_pressure(assembled: Callable[..., Tribosystem]) -> None:
    """shared/physics.md, part 5; lambda is proportional to both."""
    one = assembled("monotonic-lz20").optimum(1)
    other = assembled("monotonic-lz20", "motion.speed=50", "wear.punch.coefficient=3e-5").optimum(1)
    np.testing.assert_allclose(other.pressure, one.pressure, rtol=1e-12)
    for name, value in one.velocity.items():
        assert other.velocity[name] == pytest.approx(value * 3 / 4, rel=1e-10)


@pytest.mark.parametrize(
    "settings",
    [
        # 1 kN/mm down at x = 0 and 3 kN/mm to the right at 30 mm above the pin: the resultant acts at x = 90 > 30.
        ("contact.friction=0", "punch.loads=[{on='punch_load', force=[11e3, -10e3]}]"),
        ("contact.friction=0.8", "geometry.parameters.pin_height_1=40"),  # friction alone: mu l_z > a
        ("punch.loads=[{on='punch_load', force=[0, 10e3]}]",),  # lifts off
    ],
)
@pytest.mark.mpi
def test_tipping_punch_is_refused(settings: tuple[str, ...]) -> None:
    """No pressure balances a resultant beyond the contact's edges."""
    with pytest.raises(CaseError, match=r"punch\.loads: no pressure on the contact balances .*(tips|lifts)"):
        assemble(load_case("example1", settings))


def test_almost_tipping_punch_is_accepted() -> None:
    """mu l_z just below a still has an equilibrium, at the edge."""
    system = assemble(load_case("example1", ["contact.friction=0.74", "geometry.parameters.pin_height_1=40"]))
    for d in (1, -1):
        p = system.contact((d,)).solve(system.pair.initial_gap).pressure[0]
        assert system.pair.weights @ (p * system.pair.x) == pytest.approx(-d * 29.6 * 1000, rel=1e-9)


def test_rates_beyond_all_numbers_have_no_optimum() -> None:
    """A run in which they come up goes on without one."""
    settings = ("geometry.parameters.elements_along_contact=4", "motion.positions=3", "motion.period=1e300")
    slow = "wear.punch={coefficient='3e-9 MPa^-1.5', pressure_exponent=1.5}"
    fast = "wear.strip={coefficient='1e-9 MPa^-1*mm^-1*s^1', speed_exponent=2.0}"
    system = assemble(load_case("fretting", [*settings, "geometry.degree=1", slow, fast]))
    (block,) = jump(system, 2, tolerance=0.05)
    assert np.isfinite(block.pressure).all()
    assert np.isnan(block.optimum_distance).all()
