"""Cycles as tables with stick: the rows' loads and places step by step, in any direction."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from combinations import SMALL as SMALLEST
from combinations import STICK

from fenwear import assemble, load_case, march
from fenwear.common.arrays import Array
from fenwear.steps.stick_cycle import PartialSlipProblem
from fenwear.steps.stick_setup import partial_slip_problem
from fenwear.steps.stick_state import TimeStepRecords
from fenwear.surfaces.placement import in_space

STEPS = 6
PLANE = ("geometry.parameters.elements_along_contact=12", f"stick.steps={STEPS}", "stick.step_tolerance=1")
COARSE = (
    "geometry.parameters={radius='10 mm', contact_width='0.4 mm', stroke='0 mm', across=4,"
    " margin_elements=1, ball_layers=3, flat_layers=3}",
    "stick.step_tolerance=1",
    "stick.steps=4",
)
STEEL = (
    "materials.steel={young='200 GPa', poisson=0.3, conductivity='45 W/(m K)', heat_capacity='460 J/(kg K)', "
    "density='7800 kg/m^3', expansion='1.2e-5 1/K'}",
    "heat={convection='20 W/(m^2 K)', steps=2}",
    "strip.temperatures=[{on='strip_bottom', temperature='0 K'}]",
)


def table(rows: list[list[float]], *columns: str, load: str = "") -> str:
    return f"motion={{kind='cycle', columns={['time (s)', *columns]}, rows={rows}{load}}}"


def circle(radius: float, count: int) -> list[list[float]]:
    """Return rows that go round in µm from (radius, 0)."""
    angles = np.linspace(0, 2 * np.pi, count + 1)
    return [[float(a), float(radius * np.cos(a)), float(radius * np.sin(a))] for a in angles]


def cycle_of(problem: PartialSlipProblem, number: int = 1) -> TimeStepRecords:
    """Return the time steps of a cycle, on the unworn shape."""
    at = problem.beginning()
    for _ in range(number - 1):
        at, _ = problem.cycle(at)
    return TimeStepRecords.joined(problem.cycle(at)[1])


def assert_alike(found: TimeStepRecords, expected: TimeStepRecords, within: float = 1e-9) -> None:
    for name in ("displacement", "force", "pressure", "traction", "slip", "work", "dissipated", "heat"):
        one, other = getattr(expected, name), getattr(found, name)
        np.testing.assert_allclose(other, one, rtol=0, atol=within * max(float(np.abs(one).max(initial=0)), 1e-300))


@pytest.mark.parametrize("warm", [False, True])
def test_a_sine_is_the_reciprocating_motion(warm: bool) -> None:
    """Under loads that change in the cycle, with wear of a strip that passes under the punch, and with heat."""
    passes = "motion.positions=2", "motion.profile=sinusoidal"
    heat = (*STEEL, "motion.period='0.001 s'") if warm else ()
    factors = 1 + 0.3 * np.sin(np.linspace(0, 2 * np.pi, 2 * STEPS + 1))
    course = [[k / (2 * STEPS), float(f)] for k, f in enumerate(factors)]
    known = load_case("fretting-partial-slip", [*PLANE, *heat, *passes, f"punch.loads.0.over_cycle={course}"])
    period, amplitude = known.motion.period, known.motion.amplitude  # type: ignore[union-attr]
    angles = np.linspace(0, 2 * np.pi, 2 * STEPS + 1)
    rows = [[float(period * a / (2 * np.pi)), float(-amplitude * np.cos(a)), float(-120 * f)]
            for a, f in zip(angles, factors, strict=True)]  # fmt: skip
    own = table(rows, "shift_x (mm)", "force_z (N)", load=", load={on='punch_top'}, positions='steps'")
    found = load_case("fretting-partial-slip", [*PLANE, *(heat[:3]), "punch.loads=[]", own])
    first, second = partial_slip_problem(known), partial_slip_problem(found)
    assert first.interface.moves
    assert second.interface.moves
    assert_alike(cycle_of(second), cycle_of(first))


@lru_cache
def solid(*settings: str) -> PartialSlipProblem:
    return partial_slip_problem(
        load_case("fretting-sphere", [*COARSE, "wear={punch={coefficient='1e-8 1/MPa'}}", *settings])
    )


def in_place(problem: PartialSlipProblem, components: Array) -> Array:
    """Return tangential vectors (k, n, m) in space (k, n, 3)."""
    return np.einsum("nac,kna->knc", problem.interface.middle.frame[:, 1:], components)


def test_round_and_round() -> None:
    """On a contact of four-fold symmetry a quarter of a circle is the quarter before, turned."""
    problem = solid(table(circle(1.5, 8), "shift_x (um)", "shift_y (um)"))
    records, x = cycle_of(problem, 4), in_space(problem.interface.middle.pair.punch.x)[:, :2]
    turned = np.array([[0.0, -1.0], [1.0, 0.0]])
    apart = np.linalg.norm((x @ turned.T)[:, None] - x, axis=2)
    opposite = apart.argmin(axis=1)
    assert apart.min(axis=1).max() < 1e-8
    assert 0.1 < records.sticking.mean() / (records.pressure > 0).mean() < 0.9
    for values, way in ((records.pressure[:, :, None], None), (in_place(problem, records.traction), turned)):
        for step in range(6):
            before = values[step] if way is None else values[step, :, :2] @ way.T
            after = values[step + 2][opposite][..., : before.shape[1]]
            np.testing.assert_allclose(after, before, rtol=0, atol=1e-5 * np.abs(values).max())
    assert records.balance_error(problem.weights) < 1e-10


def test_turning_is_an_oscillation() -> None:
    """A table that turns the flat to and fro about the normal has the torques of an oscillation."""
    angle, half = 2e-4, 0.05
    rows = [[half * k / 4, angle * s] for k, s in enumerate((-1, -0.5, 0, 0.5, 1, 0.5, 0, -0.5, -1))]
    turning = f"motion={{kind='oscillation', amplitude='{angle} rad', period='{2 * half} s', profile='triangular'}}"
    assert_alike(cycle_of(solid(table(rows, "rotation_z (rad)"))), cycle_of(solid(turning)))


def test_long_ways_slide_as_a_whole() -> None:
    """The longer the way round, the nearer is friction's work to that of all of the load on all of the way."""
    missing = []
    for radius in (150.0, 300.0):
        problem = solid(table(circle(radius, 8), "shift_x (um)", "shift_y (um)"))
        assert problem.interface.far
        way = 8 * 2 * radius * 1e-3 * np.sin(np.pi / 8)
        missing.append(1 - cycle_of(problem, 2).energy(problem.weights) / (0.8 * 50 * way))
    assert 0 < missing[1] < 0.02
    assert missing[1] == pytest.approx(missing[0] / 2, rel=0.2)


def test_a_table_of_loads_alone() -> None:
    """Under a load that comes and goes like bodies stay stuck, unlike ones slip: the balance of energy holds."""
    rows = [[k, -load] for k, load in enumerate((60, 90, 120, 90, 60))]
    own = (table(rows, "force_z (N)", load=", load={on='punch_top'}"), "punch.loads=[]")
    softer = ("materials.brass={young='70 GPa', poisson=0.3}", "strip.regions={strip_body='brass'}")
    for further, slips in (((), False), (softer, True)):
        problem = partial_slip_problem(
            load_case("fretting-partial-slip", [*PLANE, *own, *further, "contact.friction=0.3"])
        )
        records = cycle_of(problem, 2)
        np.testing.assert_allclose(records.pressure @ problem.weights, [90, 120, 90, 60], rtol=2e-3)
        assert (np.abs(records.force) < 1e-6).all()
        slid = float(np.where(records.pressure > 0, records.slip_magnitude, 0.0).max())
        assert (slid > 1e-5) == slips, slid
        assert records.balance_error(problem.weights) < 1e-10


def test_the_middle_of_an_odd_number_of_steps() -> None:
    """Two steps end as near to it: rounding of the period does not choose which one a half-cycle is told by."""
    given = (
        *SMALLEST,
        *STICK,
        "contact.law='coulomb'",
        "motion.profile='triangular'",
        "stick.steps=5",
        "run.half_cycles=2",
    )
    pressures = []
    for period in (0.1, 28.79, 0.3, 0.7, 1.1, 1.3):
        *_, block = march(assemble(load_case("fretting-partial-slip", [*given, f"motion.period='{period} s'"])), 2)
        pressures.append(block.pressure)
    np.testing.assert_allclose(pressures, np.tile(pressures[0], (6, 1, 1)), rtol=0, atol=1e-9 * pressures[0].max())
