"""Cycles as tables: what a reciprocating motion does in another form, and rounds of any direction."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fenwear import CaseError, Tribosystem, assemble, evolve, jump, load_case, march, steady
from fenwear.common.errors import INTERIOR, ConvergenceError
from fenwear.results.time_steps import table_cycle
from fenwear.system import place_case
from tests.results.test_contacts import COARSE as PADS

MESHES = Path(__file__).parents[2] / "meshes"
POSITIONS = 3
SMALL = ("geometry.degree=2", "geometry.parameters.elements_along_contact=8", "geometry.parameters.overlap=3",
         'wear.strip={coefficient="1e-8 1/MPa"}')  # fmt: skip


def table(rows: list[list[float]], *columns: str) -> str:
    return f"motion={{kind='cycle', positions='steps', columns={['time (s)', *columns]}, rows={rows}}}"


def sine() -> str:
    """Return the reciprocating motion of example 1 as rows at its positions' ends."""
    half = load_case("example1").motion.half_period  # type: ignore[union-attr]
    times = np.linspace(0, 2 * half, 2 * POSITIONS + 1)
    return table([[float(t), float(-1.5 * np.cos(np.pi * t / half))] for t in times], "shift_x (mm)")


@pytest.mark.mpi
def test_a_sine_is_the_reciprocating_motion(assembled: Callable[..., Tribosystem]) -> None:
    """Pressures, depths of both bodies and totals to rounding, in marches of both kinds and in jumps."""
    known, own = assembled("example1", *SMALL, f"motion.positions={POSITIONS}"), assembled("example1", *SMALL, sine())
    runs = [
        (list(march(known, 20, implicit=implicit))[-1], list(march(own, 10, implicit=implicit))[-1])
        for implicit in (False, True)
    ]
    runs.append((list(jump(known, 20000, tolerance=1e-2))[-1], list(jump(own, 10000, tolerance=1e-2))[-1]))
    for one, other in runs:
        for body in ("punch", "strip"):
            depth = getattr(one.end.worn, body)
            np.testing.assert_allclose(getattr(other.end.worn, body), depth, rtol=0, atol=1e-12 * depth.max())
        for first, second in zip(one.end.contacts, other.end.contacts, strict=True):
            assert first is not None
            assert second is not None
            np.testing.assert_allclose(second.pressure, first.pressure, rtol=0, atol=1e-12 * first.pressure.max())
        np.testing.assert_allclose(other.end.totals.sums, one.end.totals.sums, rtol=1e-12)


@pytest.mark.mpi
def test_steady_state_of_changing_loads_and_ways(assembled: Callable[..., Tribosystem]) -> None:
    """The direct solution is where jumps end; a cycle wears all that touches by one rigid motion."""
    rows = [[0, 2, 0, -2], [1, 0, 1, -4], [2, -1, 0, -8], [3, 0, -2, -4], [4, 2, 0, -2]]
    columns = ["time (s)", "shift_x (mm)", "shift_y (mm)", "force_z (kN)"]
    motion = f"motion={{kind='cycle', columns={columns}, rows={rows}, load={{on='punch_load'}}}}"
    system = assembled("example1", *SMALL[:3], "punch.loads=[]", "wear.punch={coefficient=1e-8}", motion)
    state = steady(system)
    *_, last = jump(system, 400_000, tolerance=1e-3)
    ended = np.concatenate([contact.pressure for contact in last.end.contacts])
    np.testing.assert_allclose(ended, state.phase_pressure, atol=0.01 * state.phase_pressure.max())
    worn = (1e-8 * system.sliding.path * state.phase_pressure).sum(axis=0)
    np.testing.assert_allclose(worn, state.wear_per_cycle, rtol=1e-9)
    touching = state.phase_pressure.max(axis=0) > 0
    x = system.pair.x[touching]
    fit = np.polynomial.Polynomial.fit(x, worn[touching], 1)
    np.testing.assert_allclose(worn[touching], fit(x), atol=1e-9 * worn.max())


def test_what_a_cycle_wears_is_of_the_coating_while_it_lasts(assembled: Callable[..., Tribosystem]) -> None:
    """A million such cycles: it was told of the base, ten times as much."""
    found = []
    for wear in ("{coefficient=1e-7, coating={thickness=1.0, coefficient=1e-8}}", "{coefficient=1e-8}"):
        *_, last = march(assembled("example1", *SMALL[:3], sine(), f"wear.punch={wear}"), 4)
        cycle = table_cycle(last)
        assert cycle is not None
        found.append(cycle.worn.punch)
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9)


def test_a_ring_wears_both_sides_of_its_groove(assembled: Callable[..., Tribosystem]) -> None:
    """Worn in, p r is the same all over the side it is pressed on; each wears by its own load and way, both bodies.

    Axisymmetric: p = F / (2 pi (r2 - r1) r), and a cycle wears k F theta / (2 pi (r2 - r1)) off, whatever r is.
    """
    system = assembled("ring-in-groove", "geometry.parameters.across=4")
    pair = system.pair
    *_, earlier = jump(system, 2_000_000, tolerance=1e-2)
    *_, last = jump(system, 2_001_000, tolerance=1e-2, start=earlier.end)
    grown, r = last.end.worn - earlier.end.worn, pair.punch.x[:, 0]
    sides = [pair.punch.nodes_of(name) for name in ("lower", "upper")]
    for phase, contact in enumerate(last.end.contacts):
        assert contact is not None
        own, force = ((1, 500.0), (0, 150.0), (0, 800.0))[min(phase, 5 - phase)]  # first and last, and so on
        assert (contact.pressure[0][sides[1 - own]] == 0).all()
        assert pair.weights @ contact.pressure[0] == pytest.approx(force, rel=1e-9)
        if force != 150.0:  # while it changes sides, where it does not slide
            exact = force / (2 * np.pi * 7 * r[sides[own]])
            np.testing.assert_allclose(contact.pressure[0][sides[own]], exact, rtol=1e-5)
    for own, force, turn in ((0, 800.0, 4 * np.pi / 3), (1, 500.0, 2 * np.pi / 3)):
        exact = force * turn / (2 * np.pi * 7)
        np.testing.assert_allclose(grown.punch[sides[own]] / 1000, 5e-9 * exact, rtol=1e-5)
        off_groove = (pair.wear_interpolation @ grown.strip)[sides[own]]
        np.testing.assert_allclose(off_groove / 1000, 1e-9 * exact, rtol=1e-5)
    worn, totals = last.end.worn, last.end.totals
    assert pair.weights @ worn.punch == pytest.approx(float(totals.of("volume_punch")), rel=1e-9)
    assert pair.strip.weights @ worn.strip == pytest.approx(float(totals.of("volume_strip")), rel=1e-9)


@pytest.mark.parametrize("across", [4, 8])  # Newton's method ends somewhere, or nowhere
def test_a_ring_pressed_to_either_side_has_no_steady_state(assembled: Callable[..., Tribosystem], across: int) -> None:
    """No one motion wears both sides, which is said; pressed to one side alone there is one, with p r all over it."""
    with pytest.raises(ConvergenceError, match="to either side in turn"):
        steady(assembled("ring-in-groove", f"geometry.parameters.across={across}"))
    rows = "rows=[[0, 0, -500], [1, 120, -500], [2, 240, -800], [3, 360, -500]]"
    columns = "columns=['time (s)', 'angle_z (deg)', 'force_z (N)']"
    motion = f"motion={{kind='cycle', {columns}, {rows}, load={{on='punch_rims'}}}}"
    system = assembled("ring-in-groove", "geometry.parameters.across=4", motion)
    found, pair = steady(system), system.pair
    own, force = pair.punch.nodes_of("lower"), np.array([500.0, 650.0, 650.0])  # in the middle of each step
    exact = force[:, None] / (2 * np.pi * 7 * pair.punch.x[own, 0])
    assert (found.phase_pressure[:, ~own] == 0).all()
    np.testing.assert_allclose((found.phase_pressure[:, own]).mean(axis=0), exact.mean(axis=0), rtol=1e-9)


def test_a_ring_that_rolls_in_its_groove(tmp_path: Path) -> None:
    """Pressed at its rim alone it touches at an edge, of either side in turn: sets of nodes go round."""
    geometry = (MESHES / "ring_in_groove.geo").read_text()
    both, outer = '"punch_rims") = {uprights_0[0], uprights_0[2]}', '"punch_rims") = {uprights_0[2]}'
    assert both in geometry
    (tmp_path / "rolling.geo").write_text(geometry.replace(both, outer))
    settings = [f"geometry.file={tmp_path / 'rolling.geo'}", "geometry.parameters.across=3"]
    system = assemble(load_case("ring-in-groove", settings))
    *_, last = blocks = list(jump(system, 20, tolerance=1e-2))
    assert sum(block.remedies[INTERIOR] for block in blocks) > 0
    pair, sides = system.pair, [system.pair.punch.nodes_of(name) for name in ("lower", "upper")]
    for contact, force in zip(last.end.contacts, (500.0, 150.0, 800.0, 800.0, 150.0, 500.0), strict=True):
        assert contact is not None
        pressure, gap = contact.pressure[0], contact.gap[0]
        assert pair.weights @ pressure == pytest.approx(force, rel=1e-9)
        assert (pressure[sides[0 if force == 500.0 else 1]] == 0).all()
        assert pressure.min() >= 0
        assert gap.min() > -1e-9 * 0.05
        assert np.abs(pressure * gap).max() < 1e-9 * 0.05 * pressure.max()
    assert pair.weights @ last.end.worn.punch == pytest.approx(float(last.end.totals.of("volume_punch")), rel=1e-9)


def test_a_group_that_is_none(assembled: Callable[..., Tribosystem]) -> None:
    rows = "rows=[[0, 0, -1], [1, 1, -1], [2, 0, -1]], load={on='punch_top'}"
    motion = f"motion={{kind='cycle', columns=['time (s)', 'shift_x (mm)', 'force_z (N)'], {rows}}}"
    with pytest.raises(CaseError, match=r"motion\.load\.on:"):
        assembled("example1", *SMALL[:3], motion)


def test_a_step_that_opens_the_contact(assembled: Callable[..., Tribosystem]) -> None:
    turned = table([[0, 0], [1, 1], [2, 0]], "angle_y (deg)")
    with pytest.raises(CaseError, match=r"motion.rows: .*1.*2"):
        assembled("example1", *SMALL[:3], turned)


def test_blocks_of_cycles(assembled: Callable[..., Tribosystem]) -> None:
    """So many of one table, so many of another with more steps: each wears what it wears alone."""
    walk, run = [[0, 0, -4], [1, 2, -4], [2, 0, -4]], [[0, 0, -8], [0.5, 1, -8], [1, 3, -8], [2, 0, -8]]
    columns = ["time (s)", "shift_x (mm)", "force_z (kN)"]
    first, second = (
        f"{{kind='cycle', columns={columns}, rows={rows}, load={{on='punch_load'}}}}" for rows in (walk, run)
    )
    steps = f"[{{cycles=20}}, {{cycles=30, motion={second}}}, {{cycles=10, load_factor=0.5}}]"
    settings = (*SMALL[:3], "punch.loads=[]", "wear.punch={coefficient=1e-9}", f"motion={first}", "run.half_cycles=60")
    system = assembled("example1", *settings, f"program={{steps={steps}}}")
    law = 1e-9 / 10  # k over the thickness
    areas = np.cumsum([20 * law * 4e3 * 4, 30 * law * 8e3 * 6, 10 * law * 4e3 * 6])
    for integration in ("implicit", "jump"):
        ends = {block.end.half_cycle: block.end for block in evolve(system, integration=integration)}
        for half_cycle, area in zip((20, 50, 60), areas, strict=True):
            assert ends[half_cycle].worn.punch @ system.pair.weights == pytest.approx(area, rel=1e-9)
    for wrong, told in (
        (
            f"program={{steps=[{{cycles=2, motion={first.replace('shift_x (mm)', 'angle_x (rad)')}}}]}}",
            "no column angle_x",
        ),
        ("program={steps=[{cycles=2, period=3}]}", "does not change with motion.kind = 'cycle'"),
    ):
        with pytest.raises(CaseError, match=told):
            load_case("example1", [*settings, wrong])


ROWS = "motion={kind='cycle', load={on='punch_load'}, columns=['time (s)', 'shift_x (mm)', 'force_z (N)', %s"
AWAY = ROWS % "'moment_y (N*mm)'], rows=[[0, 0, -500, 0], [0.5, 0.3, -500, 0], [0.8, 0.1, 900, 0], [1, 0, -500, 0]]}"
TIPS = ROWS % "'moment_y (N*mm)'], rows=[[0, 0, -500, 0], [0.5, 0.3, -500, 5e5], [1, 0, -500, 0]]}"
OPENS = ROWS % "'shift_z (mm)'], rows=[[0, 0, -500, 0], [0.5, 0.3, -500, 0], [0.8, 0.1, -500, 4], [1, 0, -500, 0]]}"
TURNS = ROWS % "'punch_angle_y (deg)'], rows=[[0, 0, -500, 0], [0.5, 0.3, -500, 30], [1, 0, -500, 0]]}"


@pytest.mark.parametrize(
    ("name", "settings", "told"),
    [
        (
            "example1",
            [AWAY, "punch.loads=[]"],
            "motion.load: .*row 2 to row 3: the block lifts off",
        ),
        ("example1", [TIPS, "punch.loads=[]"], "motion.load: .* the loads from row 1 to row 2: the block tips over"),
        ("example1", [OPENS, "punch.loads=[]"], "motion.rows: from row 2 to row 3 the strip.*open the contact"),
        ("example1", [TURNS, "punch.loads=[]"], "motion.rows: from row 1 to row 2 the strip.*open the contact"),
        (
            "bushing",
            ["geometry.parameters.contact_angle=60", "punch.loads.0.force=[0, 50]"],
            r"punch\.loads: .*the punch lifts off",
        ),
        (
            "disc-brake-two-pads",
            [
                *(f"geometry.parameters.{key}={count}" for key, count in PADS.items()),
                "punch.loads.1.force=[0, 0, -5000]",
            ],
            r"punch\.loads: .*the punch lifts off \(back\)",
        ),
    ],
)
def test_loads_that_no_contact_can_carry(name: str, settings: list[str], told: str) -> None:
    """Told by the rows between which they act, the body and the part."""
    names = ["contact.between=['block', 'strip']"] if name == "example1" else []
    with pytest.raises(CaseError, match=told):
        place_case(load_case(name, [*settings, *names]))
