"""Quantities of interest: what is exact of them, and what they refuse."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from mpi4py import MPI

from fenwear import Case, CaseError, assemble, load_case, make_case
from fenwear.steps import critical_speed, follow
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import jump_within
from fenwear.studies import Model, evaluate, parse_quantity
from fenwear.studies.model import cycle_of
from fenwear.studies.quantities import of_case

LOAD, AMPLITUDE, BETA = 1e4, 1.5, 3.926990816987242e-8  # N, mm, 1/MPa of Example 2


def value(case: Case, text: str) -> float:
    return evaluate(Model(case), parse_quantity(text), {})[0]


def test_volume_and_the_life_to_a_volume_are_archards(small: Callable[..., Case]) -> None:
    """V = beta~ F s for a = b = 1, whatever the pressure: in cycles, distance and time."""
    case = small("example2")
    volume = BETA * LOAD * 4 * AMPLITUDE * 100
    assert value(case, "volume after 100 cycles") == pytest.approx(volume, rel=1e-9)
    assert value(case, "volume after 600 mm") == pytest.approx(volume, rel=1e-9)
    level = 3.0  # mm^3
    cycles = level / (BETA * LOAD * 4 * AMPLITUDE)
    assert value(case, "cycles until volume 3 mm^3") == pytest.approx(cycles, rel=1e-9)
    assert value(case, "distance until volume 3 mm^3") == pytest.approx(cycles * 4 * AMPLITUDE, rel=1e-9)
    assert value(case, "time until volume 3 mm^3") == pytest.approx(cycles * 2 * np.pi / 10, rel=1e-9)


@pytest.mark.parametrize(
    ("name", "body", "settings"),
    [
        ("pin-on-disc", "strip", ["geometry.order=1", "geometry.degree=1", "geometry.parameters.across=2"]),
        ("block-on-ring", "strip", ["geometry.parameters.elements_along_contact=8"]),
        ("block-on-ring", "punch", ["geometry.parameters.elements_along_contact=8"]),
        ("monotonic-lz20", "strip", ["geometry.parameters.elements_along_contact=8", "motion.track=20000"]),
    ],
)
def test_volumes_are_k_f_s_on_the_whole_of_a_closed_track(name: str, body: str, settings: list[str]) -> None:
    """V = beta~ F s for a = b = 1, s of the load's own path: the meshed patch is a part of the track alone."""
    case = load_case(name, ["geometry.degree=2", "wear.strip.coefficient=1e-9", *settings])
    model, cycles = Model(case), 3
    ends = list(model.run({}, cycles))
    slid = float(cycle_of(ends[-1].end).of("distance"))  # the mean over the load is the same all along so short a run
    law = getattr(case.wear, body)
    expected = law.coefficient * model.system().normal_force * slid * cycles
    assert float(ends[-1].end.totals.of(f"volume_{body}")[-1]) == pytest.approx(expected, rel=1e-4)
    assert float(cycle_of(ends[-1].end).of(f"volume_{body}")) == pytest.approx(expected / cycles, rel=1e-4)
    assert value(case, f"volume of {body} after {cycles} cycles") == pytest.approx(expected, rel=1e-4)
    assert value(case, f"steady volume_rate of {body}") == pytest.approx(expected / cycles, rel=2e-3)
    level = 5 * expected
    life = value(case, f"cycles until volume of {body} {level!r} mm^3")
    assert life == pytest.approx(5 * cycles, rel=1e-3)


def test_distance_of_a_turning_strip(small: Callable[..., Case]) -> None:
    """A ring's surface slides its angle times its radius under a block, of which nothing is known but the radius."""
    case = small("block-on-ring")
    distance, period = Model(case).cycle_measures()
    radius, speed = case.geometry.parameters["radius"], case.motion.angular_speed
    assert distance == pytest.approx(radius * speed * period, rel=1e-3)  # the facets are chords


def test_a_life_is_where_a_run_to_it_reaches_the_level(small: Callable[..., Case]) -> None:
    """As near as the tolerance of jumps says, and nearer with a smaller one."""
    errors = []
    for tolerance in (3e-3, 1e-4):
        case = small("example2", f"run.jump_tolerance={tolerance}")
        life = value(case, "cycles until depth 0.01 mm")
        errors.append(abs(value(case, f"depth after {life} cycles") / 0.01 - 1))
        assert errors[-1] < tolerance
        assert value(case, f"depth after {0.99 * life} cycles") < 0.01
    assert errors[1] < errors[0] / 3


def test_the_steady_state(small: Callable[..., Case]) -> None:
    """Translating punch: the largest pressure is twice the mean, the approach that of the mean pressure (row 11)."""
    case = small("example2")
    mean = LOAD / 600
    assert value(case, "steady pressure") == pytest.approx(2 * mean, rel=1e-9)
    assert value(case, "steady lambda_F") == pytest.approx(BETA * mean * 4 * AMPLITUDE, rel=1e-9)
    assert value(case, "steady volume_rate") == pytest.approx(BETA * LOAD * 4 * AMPLITUDE, rel=1e-9)
    assert value(case, "steady friction") == pytest.approx(0.25, rel=1e-12)


def test_run_in_and_critical_speed(small: Callable[..., Case]) -> None:
    case = small("example2")
    assert value(case, "run-in distance") == pytest.approx(4 * AMPLITUDE * value(case, "run-in cycles"))
    hot = small("example1-heat")
    speeds = [critical_speed(assemble(hot), d) for d in (-1, 1)]
    assert value(hot, "critical speed") == pytest.approx(min(speeds), rel=1e-6)
    for case, unit in ((hot, "mm/s"), (load_case("ring-on-ring-heat"), "rad/s")):
        assert of_case(parse_quantity("critical speed"), case).unit == unit


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("dept", "did you mean depth"),
        ("depth of ring", "'of punch', or 'of strip'"),
        ("pressure of strip", "of strip.*each body has"),
        ("volume at 3 mm", "volume is one number"),
        ("depth at 3 kg", "another kind"),
        ("depth after -3 m", "more than zero"),
        ("depth after 3 kg", "cycles, a distance or a time"),
        ("steady depth", "lasts for ever"),
        ("lambda_F", "steady lambda_F"),
        ("cycles until depth 0.2", "with its unit"),
        ("cycles until pressure 3 MPa", "largest_depth, worn_volume"),
        ("hours until depth 1 mm", "cycles, distance or time"),
        ("cycles until depth 0 mm", "above zero"),
    ],
)
def test_what_is_no_quantity_is_refused(text: str, expected: str) -> None:
    with pytest.raises(CaseError, match=expected):
        parse_quantity(text)


def test_what_a_case_does_not_know_is_refused(small: Callable[..., Case]) -> None:
    for text, expected in (
        ("steady temperature", "heat"),
        ("critical speed", "heat"),
        ("depth of strip", "wear.strip"),
    ):
        with pytest.raises(CaseError, match=expected):
            of_case(parse_quantity(text), small("example2"))
    with pytest.raises(CaseError, match="not on the contact"):
        value(small("example2"), "depth at 31 mm after 10 cycles")


@pytest.mark.slow
def test_a_grid_that_grows() -> None:
    """A quantity of a run is that of the run, which goes over to a larger grid on its way."""
    case = load_case("ball-on-flat", [
        "punch.operator=fine", "strip.operator=fine", "geometry.parameters.core=0",
        "geometry.parameters.core_elements=0", "geometry.parameters.across=4", "grid.across=16", "motion.positions=2",
    ])  # fmt: skip
    system, cycles = assemble(case, MPI.COMM_SELF), 300

    limits = RunLimits(cycles * system.motion.half_cycles)
    *_, last = follow(system, partial(jump_within, tolerance=case.run.jump_tolerance), limits)
    *_, found = Model(case).run({}, cycles)
    assert len(found.end.wear[-1]) == len(last.system.pair.weights) > len(system.pair.weights)
    assert found.end.wear[-1] == pytest.approx(last.end.worn.punch, rel=1e-12)


def test_a_hardness_varies_in_its_unit(small: Callable[..., Case]) -> None:
    """V = K F s / H: a life goes by H; the number that a study sets is in MPa, though a case file needs the unit."""
    tables = small("example2").resolved()
    tables["wear"]["punch"] = {"archard": 1e-5, "hardness": "1.2 GPa"}
    case, quantity = make_case(tables), parse_quantity("cycles until volume 3 mm^3")
    lives = [evaluate(Model(case), quantity, {"wear.punch.hardness": hardness})[0] for hardness in (1200.0, 2400.0)]
    assert lives[1] == pytest.approx(2 * lives[0], rel=1e-9)
