"""Laws: coefficients of position, depth, distance, regions and one's own functions; threshold and cap."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import fenwear
from fenwear import Tribosystem, assemble, jump, load_case, make_case, march, steady
from fenwear.case import Case, changed_case, dependence
from fenwear.case.dependence import evaluate_law
from fenwear.common.errors import CaseError, ConvergenceError
from fenwear.laws import LayerStep
from fenwear.laws.compliant_layer import RoughClosure
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import jump_within, march_within
from fenwear.steps.stability import growth_rate
from fenwear.studies.model import Model
from fenwear.system import layer_conductance

Assemble = Callable[..., Tribosystem]
SMALL = ("geometry.degree=2", "geometry.parameters.elements_along_contact=16", "geometry.follow_wear=never")
# One way, without friction: all pressures come to one that wears evenly.
PLAIN = (*SMALL, "contact.friction=0", "motion={kind='one-way', direction='rightward', speed=100, duration=1}")
HEIGHT = 1e-3 * (np.pi / 2) ** 0.5  # mm: rms of a roughness Sa of 1 um
MEAN = 1e4 / 600


def law_of(system: Tribosystem, **given: Any) -> np.ndarray:
    return system.phases.wear.phases([system.phases.conditions(0, **given)], [0]).punch.rate[0]


def test_position(assembled: Assemble) -> None:
    """Steady one-way wear is even: p = p_m (1 / k) / mean(1 / k), for any k(x)."""
    system = assembled("example2", *PLAIN, "wear.punch.coefficient={expression='1e-8*(1 + (x/30)**2)'}")
    state, x, weights = steady(system), system.pair.x, system.pair.weights
    inverse = 1 / (1 + (x / 30) ** 2)
    np.testing.assert_allclose(state.pressure[0], MEAN * inverse * weights.sum() / (weights @ inverse), rtol=1e-8)
    np.testing.assert_allclose(system.optimum(1).pressure, state.pressure[0], rtol=1e-8)
    assert system.phases.constant


def two_linings(tmp_path: Any, *settings: str) -> Case:
    """Return a case of two linings side by side on a plate, for x below and above zero."""
    (tmp_path / "linings.geo").write_text("""
For body In {0 : 1}
  w = 10 + 5 * body; low = -5 * body; high = 5 - 5 * body;
  p = newp; Point(p) = {-w, low, 0}; Point(p + 1) = {0, low, 0}; Point(p + 2) = {w, low, 0};
  Point(p + 3) = {w, high, 0}; Point(p + 4) = {0, high, 0}; Point(p + 5) = {-w, high, 0};
  l = newl; Line(l) = {p, p + 1}; Line(l + 1) = {p + 1, p + 2}; Line(l + 2) = {p + 2, p + 3};
  Line(l + 3) = {p + 3, p + 4}; Line(l + 4) = {p + 4, p + 5}; Line(l + 5) = {p + 5, p}; Line(l + 6) = {p + 1, p + 4};
  Transfinite Curve{l, l + 1, l + 3, l + 4} = 9; Transfinite Curve{l + 2, l + 5, l + 6} = 5;
  c = newll; Curve Loop(c) = {l, l + 6, l + 4, l + 5}; Curve Loop(c + 1) = {l + 1, l + 2, l + 3, -l - 6};
  s = news; Plane Surface(s) = {c}; Plane Surface(s + 1) = {c + 1};
  first~{body} = s; line~{body} = l;
EndFor
Transfinite Surface{:}; Recombine Surface{:};
Physical Surface("punch_left") = {first_0}; Physical Surface("punch_right") = {first_0 + 1};
Physical Surface("strip_body") = {first_1, first_1 + 1};
Physical Curve("punch_contact") = {line_0, line_0 + 1}; Physical Curve("punch_top") = {line_0 + 3, line_0 + 4};
Physical Curve("punch_sides") = {line_0 + 2, line_0 + 5};
Physical Curve("strip_contact") = {line_1 + 3, line_1 + 4}; Physical Curve("strip_bottom") = {line_1, line_1 + 1};
""")
    data = {
        "geometry": {"file": "linings.geo", "degree": 2, "follow_wear": "never"},
        "materials": {"steel": {"young": 2e5, "poisson": 0.3}},
        "punch": {
            "regions": {"punch_left": "steel", "punch_right": "steel"},
            "supports": [{"on": "punch_sides", "fix": ["x"]}],
            "loads": [{"on": "punch_top", "force": [0, -1000]}],
        },
        "strip": {"regions": {"strip_body": "steel"}, "supports": [{"on": "strip_bottom", "fix": ["x", "z"]}]},
        "wear": {"punch": {"coefficient": {"regions": {"punch_left": 1e-8, "punch_right": 3e-8}}}},
        "motion": {"kind": "one-way", "direction": "rightward", "speed": 10, "duration": 1},
        "run": {"half_cycles": 10},
    }
    return changed_case(make_case(data, tmp_path), *settings) if settings else make_case(data, tmp_path)


def test_two_linings_side_by_side(tmp_path: Any) -> None:
    """The node between two linings wears as its halves do: at first under one pressure, in the end under two.

    Under even pressure its rate is the mean of both, weighted by the areas beside it. In the end the pressures are to
    each other as 3 to 1 to rounding, on any mesh, and the node between carries the mean of both.
    """
    system = assemble(two_linings(tmp_path))
    x, weights = system.pair.x, system.pair.weights
    between = abs(x) < 1e-9
    rate = law_of(system)
    exact = np.where(between, 2e-7, np.where(x < 0, 1e-7, 3e-7))
    np.testing.assert_allclose(rate, exact, rtol=1e-12)
    exact = np.where(between, 50.0, np.where(x < 0, 75.0, 25.0))
    state = steady(system)
    np.testing.assert_allclose(state.pressure[0], exact, rtol=1e-7)
    np.testing.assert_allclose(system.optimum(1).pressure, exact, rtol=1e-8)
    np.testing.assert_allclose(state.wear_per_cycle, state.wear_per_cycle.mean(), rtol=1e-7)
    assert state.pressure[0] @ weights == pytest.approx(1000, rel=1e-9)
    with pytest.raises(CaseError, match=r"wear\.punch.coefficient.regions.punch_middle: no such region"):
        two_linings(tmp_path, "wear.punch.coefficient={regions={punch_left=1e-8, punch_middle=1}}")


def test_a_node_between_linings_shares_friction_and_powers_of_the_pressure(tmp_path: Any) -> None:
    """With p^2 the pressures are as the roots of the coefficients; friction heats by mu_i p_i of each half."""
    system = assemble(
        two_linings(
            tmp_path,
            "wear.punch={coefficient={regions={punch_left=1e-9, punch_right=9e-9}}, pressure_exponent=2}",
            "contact.friction={regions={punch_left=0.02, punch_right=0.04}}",
            "punch.no_turning_about=['y']",
        )
    )
    between, left = (abs(system.pair.x) < 1e-9), system.pair.x < -1e-9
    state = steady(system)
    np.testing.assert_allclose(state.pressure[0], np.where(between, 50.0, np.where(left, 75.0, 25.0)), rtol=1e-6)
    mu = system.laws.friction.values(system.phases.conditions(0, state.pressure[0]))
    assert mu[between] == pytest.approx((0.02 * 75 + 0.04 * 25) / 100, rel=1e-6)


def test_regions_take_expressions_and_tables(tmp_path: Any) -> None:
    """Each region has its own function of the place, the pressure or the depth, in the unit of all."""
    left, right = "{expression='1e-3*(1 + x*x)'}", "{table=[[0, 1e-3], [1e-2, 3e-3]], of='depth'}"
    settings = (f"wear.punch.coefficient={{regions={{punch_left={left}, punch_right={right}}}, unit='1/GPa'}}",)
    system = assemble(two_linings(tmp_path, *settings))
    x, worn = system.pair.x, system.unworn()
    worn.punch[:] = 5e-3
    exact = np.where(x < 0, 1e-5 * (1 + x**2), 2e-5)
    exact[abs(x) < 1e-9] = 1.5e-5
    np.testing.assert_allclose(law_of(system, worn=worn), exact, rtol=1e-12)
    assert not system.phases.constant
    for wrong in ("{expression='1e-8*q'}", "{table=[[0, 1]]}", "{law='mine'}"):
        with pytest.raises(CaseError, match=r"wear\.punch\.coefficient.*regions\.punch_right"):
            two_linings(tmp_path, f"wear.punch.coefficient={{regions={{punch_left=1e-8, punch_right={wrong}}}}}")


def test_rough_linings_of_two_materials_close_and_conduct_as_each_does(tmp_path: Any) -> None:
    """By E* and the mean conductivity of the place: h_c = 2 k_1 k_2 / (k_1 + k_2) / E* dp/d(delta)."""
    thermal = "density='7800 kg/m^3', heat_capacity='460 J/(kg K)', expansion='12e-6 1/K'"
    settings = (
        f"materials.steel={{young=2e5, poisson=0.3, conductivity='45 W/(m K)', {thermal}}}",
        f"materials.lining={{young=2e4, poisson=0.2, conductivity='5 W/(m K)', {thermal}}}",
        "punch.regions={punch_left='steel', punch_right='lining'}",
        "contact.layer={kind='rough', roughness='1 um', asperity_radius='50 um', asperity_density='1000 1/mm^2'}",
        "heat={convection='20 W/(m^2 K)', conductance='layer'}",
    )
    system = assemble(two_linings(tmp_path, *settings))
    x, closure, conductance = system.pair.x, system.layers.closure, layer_conductance(system)
    assert isinstance(closure, RoughClosure)
    assert conductance is not None
    pressure = np.full(len(x), 50.0)
    found, slope = conductance(pressure, 0), closure.slope(pressure)
    for side, young, poisson, k in ((x < -0.1, 2e5, 0.3, 45.0), (x > 0.1, 2e4, 0.2, 5.0)):
        modulus = 1 / ((1 - 0.3**2) / 2e5 + (1 - poisson**2) / young)
        np.testing.assert_allclose(closure.stiffness[side], 4 / 3 * modulus * 1e3 * 0.05**0.5 * HEIGHT**1.5)
        np.testing.assert_allclose(found[side] * slope[side], 2 * k * 45 / (k + 45) / modulus)


def test_coating_worn_through(assembled: Assemble) -> None:
    """A coating of 0.05 mm and k_1 on a substrate of k_2 = 5 k_1, k straight between them over h = 0.5 um.

    At the mean pressure d = k_1 p s up to 0.05 mm, then h more over h ln(k_2 / k_1) / ((k_2 - k_1) p), then k_2 p s.
    """
    table = "{table=[[0, 1e-6], [0.05, 1e-6], [0.0505, 5e-6], [1, 5e-6]], of='depth'}"
    system = assembled("example2", *PLAIN, "motion.duration=0.1", f"wear.punch.coefficient={table}")
    steps, weights = 750, system.pair.weights  # of 10 mm
    through = 0.05 / (1e-6 * MEAN) + 5e-4 * np.log(5) / (4e-6 * MEAN)
    exact = 0.0505 + 5e-6 * MEAN * (10 * steps - through)
    *_, marched = march_within(system, RunLimits(steps, block=50), implicit=True)
    assert weights @ marched.wear[-1] / weights.sum() == pytest.approx(exact, rel=2e-3)
    assert np.ptp(marched.wear[-1]) < 0.01 * exact
    errors, counts = [], []
    for tolerance in (3e-2, 3e-3):
        blocks = list(jump_within(system, RunLimits(steps, block=1), tolerance=tolerance))
        errors.append(abs(weights @ blocks[-1].wear[-1] / weights.sum() / exact - 1))
        counts.append(len(blocks))
        depths = [float(block.wear[-1].max()) for block in blocks]
        assert any(0.045 < depth < 0.055 for depth in depths)  # no jump goes over the end of the coating
    assert errors[1] < 3e-4
    assert errors[1] < errors[0]
    assert max(counts) < steps / 10


@pytest.mark.parametrize("implicit", [False, True])
def test_a_coefficient_grows_with_the_depth_within_a_half_cycle(assembled: Assemble, implicit: bool) -> None:
    """k = k_0 (1 + w / w_0): half-cycles of pressures p_i wear 1 + w / w_0 = exp(k_0 s / w_0 sum of p_i)."""
    system = assembled("example2", *PLAIN, "wear.punch.coefficient={expression='1e-6 * (1 + depth / 0.2)'}")
    *_, marched = march(system, 40, implicit=implicit)
    exact = 0.2 * np.expm1(1e-6 * 100 / 0.2 * marched.pressure.sum(axis=0))
    np.testing.assert_allclose(marched.wear[-1], exact, rtol=5e-4)


def test_running_in(assembled: Assemble) -> None:
    """k(s) = k_0 (1 + 9 exp(-s / s_0)): worn area = F / t times the integral of k; jumps as near as their tolerance."""
    law = "{expression='1e-8 * (1 + 9 * exp(-s / 20000))'}"
    system = assembled("example2", *PLAIN, f"wear.punch.coefficient={law}")
    slid = 100.0 * 2000
    exact = 1e-8 * 1000 * (slid + 9 * 20000 * (1 - np.exp(-slid / 20000)))
    *_, last = march(system, 2000)
    assert system.pair.weights @ last.wear[-1] == pytest.approx(exact, rel=1e-5)  # the middle of each step
    errors = []
    for tolerance in (3e-2, 1e-3):
        *_, last = jump(system, 2000, tolerance=tolerance)
        errors.append(abs(system.pair.weights @ last.wear[-1] / exact - 1))
    assert errors[1] < 1e-3
    assert errors[1] < errors[0]


def test_threshold_and_cap(assembled: Assemble) -> None:
    """Below the threshold nothing wears, above it what is more; beyond the cap no more; slopes by differences."""
    law = "wear.punch={coefficient=1e-8, pressure_threshold=5, pressure_cap=20, pressure_exponent=2}"
    system = assembled("example2", *PLAIN, law)
    wear = system.phases.mean_wear
    p = np.resize(np.array([0.0, 4.0, 6.0, 15.0, 25.0]), (1, len(system.pair.x)))
    depths = 1e-8 * 100 * np.resize(np.array([0.0, 0.0, 1.0, 100.0, 225.0]), p.shape)
    np.testing.assert_allclose(wear.depth(p), depths, rtol=1e-12)
    layer, change = LayerStep(system.phases.passing(wear), system.unworn(), 3.0), np.full_like(p, 1e-6)
    left, right = layer.border(p)
    derivative = np.einsum("knq,jqi,ji->kn", left, right, change)
    differences = (layer.opening(p + change) - layer.opening(p - change)) / 2
    np.testing.assert_allclose(derivative, differences, atol=1e-6 * np.abs(differences).max())
    # A flat punch at less than the threshold wears at its edges until nothing is above it.
    light = assembled("example2", *PLAIN, "wear.punch={coefficient=1e-5, pressure_threshold=20}")
    *_, last = jump(light, 20000, tolerance=1e-2)
    assert last.pressure[-1].max() < 20.1
    assert last.pressure[0].max() <= 20.1 or last.pressure[0].max() > last.pressure[-1].max()
    with pytest.raises(ConvergenceError, match="pressure_threshold"):
        steady(light)


def test_own_law_in_python(assembled: Assemble) -> None:
    """A registered function is a law like an expression; a case that names one that is not registered is refused."""
    with pytest.raises(CaseError, match="no law 'mine' is registered"):
        load_case("example2", ["wear.punch.coefficient={law='mine'}"])
    fenwear.register_law("mine", lambda now: 1e-8 * (1 + now["p"] / 50))
    try:
        settings = (*SMALL, "run.half_cycles=10")
        own = assemble(load_case("example2", [*settings, "wear.punch.coefficient={law='mine', unit='1/MPa'}"]))
        same = assembled("example2", *settings, "wear.punch.coefficient={expression='1e-8*(1 + p/50)'}")
        one, other = (next(march(system, 10)).wear[-1] for system in (own, same))
        np.testing.assert_allclose(one, other, rtol=1e-12)
        np.testing.assert_allclose(steady(own).pressure, steady(same).pressure, rtol=1e-9)
        for wrong, message in (
            (lambda now: now["p"][:3], "expected one for each of"),
            (lambda now: now["p"] * np.nan, "expected zero or more, got nan"),
            (lambda now: -1e-8, "expected zero or more, got -1e-08"),
            (lambda now: now["depth"], r"wear\.punch\.coefficient: .*'depth'.* T, p, v"),
            (lambda now: 1j * now["p"], "the law 'mine' fails: it gives complex numbers"),
        ):
            fenwear.register_law("mine", wrong)
            with pytest.raises(CaseError, match=message):
                next(march(own, 2))
    finally:
        dependence.forget_laws()
    with pytest.raises(CaseError, match="expected a word"):
        fenwear.register_law("my law", abs)
    with pytest.raises(CaseError, match="expected a function"):
        fenwear.register_law("mine", 3)
    with pytest.raises(CaseError, match=r"law 'mine': .*got 'q'"):
        fenwear.register_law("mine", abs, of=["p", "q"])


def test_a_law_is_registered_by_a_decorator() -> None:
    """Which gives the function back."""
    state = {"p": np.ones(5)}
    function = fenwear.register_law("mine", of=["p"])(lambda now: now["p"])
    try:
        assert function(state) is state["p"]
        np.testing.assert_array_equal(evaluate_law("mine", state, (5,)), state["p"])
    finally:
        dependence.forget_laws()


def test_what_changes_for_ever_has_no_steady_state(assembled: Assemble) -> None:
    """A law of depth or distance is refused, by its key, where a state that repeats is asked for."""
    system = assembled("example2", *SMALL, "contact.friction={expression='0.2 + 0.1*exp(-s)'}")
    assert system.case.passing_laws == ["contact.friction"]
    with pytest.raises(ConvergenceError, match=r"contact\.friction changes with the worn depth or the distance"):
        steady(system)
    with pytest.raises(CaseError, match=r"contact\.friction"):
        growth_rate(system, np.full((2, len(system.pair.x)), MEAN))
    with pytest.raises(CaseError, match=r"contact\.friction: depends on"):
        Model(system.case).steady({})


def test_laws_are_asked_at_pressures_alone() -> None:
    """In jumps of a contact that grows combinations of pressures had lain below zero, where a law may mean nothing."""
    asked: list[float] = []

    def law(now: dict[str, Any]) -> Any:
        asked.append(float(now["p"].min()))
        return 2e-8 * (1 + np.exp(-now["p"] / 30))

    fenwear.register_law("mine", law, of=["p"])
    try:
        system = assemble(load_case("fretting", ["wear.punch.coefficient={law='mine', unit='1/MPa'}"]))
        (*_, jumped), (*_, marched) = jump(system, 200, tolerance=0.02), march(system, 200)
    finally:
        dependence.forget_laws()
    assert min(asked) == 0
    depth = marched.end.worn.punch
    np.testing.assert_allclose(jumped.end.worn.punch, depth, rtol=0, atol=0.01 * depth.max())


@pytest.mark.parametrize(
    ("setting", "expected"),
    [
        ("wear.punch.coefficient={expression='1e-8*depht'}", "'depht' is not known"),
        ("wear.punch.coefficient={table=[['5 mm', 1], [6, 2]], of='depth'}", "another kind|expected a number"),
        ("wear.punch.coefficient={table=[[5, 1], [4, 2]], of='depth'}", "rising arguments"),
        ("wear.punch.coefficient={expression='1', regions={a=1}}", "give one of expression, table, regions and law"),
        ("wear.punch={coefficient=1e-8, pressure_threshold=5, pressure_cap=4}", "more than pressure_threshold"),
        ("wear.punch.coefficient={table=[[0, 1], [1, 2]], of='dept'}", "did you mean 'depth'"),
    ],
)  # fmt: skip
def test_what_is_wrong(setting: str, expected: str) -> None:
    with pytest.raises(CaseError, match=expected):
        load_case("example2", [setting])


def test_a_coefficient_that_fails_in_a_run_names_its_key(assembled: Assemble) -> None:
    """As it does where a case is read."""
    system = assembled("example1", *SMALL, "contact.friction={expression='0.3 - p / 100'}")
    with pytest.raises(CaseError, match=r"contact\.friction"):
        list(march(system, 40))
