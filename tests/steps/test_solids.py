"""Solids with stick: a run's folder and pictures, any direction of the motion, torsion, strains of the surface."""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
import xarray
from scipy.spatial import cKDTree

from fenwear import CaseError, assemble, load_case
from fenwear.cli.case_commands import check_text
from fenwear.cli.state_commands import final_of, final_text
from fenwear.report.page import write_report
from fenwear.results.stored_history import by_cycles, load_history
from fenwear.steps.stick_cycle import PartialSlipProblem
from fenwear.steps.stick_position import surface_gradient, surface_strain
from fenwear.steps.stick_setup import partial_slip_problem
from fenwear.steps.stick_state import TimeStepRecords
from fenwear.studies.run import run_case

COARSE = (
    "geometry.parameters={radius='10 mm', contact_width='0.4 mm', stroke='0 mm', across=4,"
    " margin_elements=1, ball_layers=3, flat_layers=3}",
    "stick.steps=5",
    "stick.step_tolerance=0.5",
)


@lru_cache
def problem(*settings: str) -> PartialSlipProblem:
    return partial_slip_problem(load_case("fretting-sphere", [*COARSE, *settings]))


def second_cycle(of: PartialSlipProblem) -> TimeStepRecords:
    at, _ = of.cycle(of.beginning())
    return TimeStepRecords.joined(of.cycle(at)[1])


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict, Path]:
    settings = [*COARSE, "run.half_cycles=40", "motion.along=[3, 4, 0]", "run.jump_tolerance=0.1"]
    case = load_case("fretting-sphere", settings)
    return run_case(case, "fretting", tmp_path_factory.mktemp("run") / "out", lambda _: None, progress="none")


def test_history_of_a_solid(ran: tuple[dict, Path]) -> None:
    """Nodes with coordinates; load, cone, forces and work from the tractions along and across a slanted sliding."""
    summary, folder = ran
    with xarray.open_dataset(folder / "history.nc") as stored:
        assert all("units" in stored[name].attrs for name in stored.data_vars)
        assert np.abs(stored.normal_force - 50).max() < 0.1
    history = by_cycles(load_history(folder))
    assert history.pressure.dims == ("cycle", "step", "node")
    assert int(history.cycle[-1]) == 20 == summary["sliding"]["cycles"]
    assert history.sliding_along.values == pytest.approx(np.tile([0.6, 0.8, 0.0], (81, 1)), abs=0.02)
    assert np.abs((history.traction * history.weight).sum("node") - history.tangential_force).max() < 0.05
    vectors = history.traction * history.sliding_along + history.traction_across * history.sliding_across
    force = (vectors * history.weight).sum("node")
    exact = history.tangential_force * xarray.DataArray([0.6, 0.8, 0.0], dims="axis")
    assert np.abs((force - exact).isel(axis=[0, 1])).max() < 1e-9 + 0.02 * float(np.abs(exact).max())
    assert np.abs((history.pressure * history.weight).sum("node") - 50).max() < 0.1
    size = np.hypot(history.traction, history.traction_across)
    assert (size <= 0.8 * history.pressure * (1 + 1e-12)).all()
    assert not history.slip.where(history.stick == 1).fillna(0).any()
    assert not history.slip_across.where(history.stick == 1).fillna(0).any()
    work = -(history.traction * history.slip + history.traction_across * history.slip_across)
    assert float(work.min()) >= -1e-18
    energy = (work.sum("step") * history.weight).sum("node")
    assert np.abs(energy - history.friction_work_increment).max() < 1e-9 * float(energy.max())
    assert float(history.energy_balance_error.max()) < 1e-8
    assert (history.stick_area < history.contact_area).all()
    volume = float((history.wear * history.weight).sum("node")[-1])
    assert volume == pytest.approx(float(history.worn_volume_increment[0]) * 20, rel=0.2)
    saved = json.loads((folder / "summary.json").read_text("utf-8"))
    assert saved["stop"] == "all half-cycles done"
    assert saved["punch"]["worn_volume_mm3"] == pytest.approx(volume, rel=1e-9)
    assert all(np.isfinite(value) for value in saved.values() if isinstance(value, float))


def test_report_of_a_solid(ran: tuple[dict, Path]) -> None:
    """Maps and cuts among the figures, and a page with each of them."""
    _, folder = ran
    names = {path.name for path in write_report(folder)}
    assert {"loops.png", "zones.png", "tractions.png", "traction_map.png", "cuts_along.png", "wear_map.png"} <= names
    page = (folder / "report.html").read_text("utf-8")
    assert page.count("<img") == sum(name.endswith(".png") for name in names)
    assert "area that sticks" in page
    assert "worn volume" in page


def test_along_y_is_along_x_turned() -> None:
    """Sphere, square of nodes and supports are the same along both: the fields swap their axes."""
    one, two = second_cycle(problem()), second_cycle(problem("motion.along=[0, 1, 0]"))
    x = problem().interface.middle.pair.punch.x
    far, order = cKDTree(x[:, :2]).query(x[:, 1::-1])
    assert far.max() < 1e-5
    scale = one.pressure.max()
    assert two.pressure[:, order] == pytest.approx(one.pressure, abs=1e-4 * scale)
    assert two.traction[:, order, 1] == pytest.approx(one.traction[:, :, 0], abs=1e-4 * scale)
    assert two.force == pytest.approx(one.force, rel=1e-4)


def test_a_turning_strip_rubs_around_its_axis() -> None:
    """Torsion: tractions around the axis alone, a torque, slip from the edge inwards."""
    turned = problem("motion={kind='oscillation', amplitude='0.01 rad', period=1, axis=[0, 0, 1], centre=[0, 0, 0]}")
    records = second_cycle(turned)
    x, t = turned.interface.middle.pair.punch.x, records.traction[4]
    around = x[:, 0] * t[:, 1] - x[:, 1] * t[:, 0]
    assert records.force[4] == pytest.approx(turned.weights @ around, rel=1e-3)
    radial = (x[:, 0] * t[:, 0] + x[:, 1] * t[:, 1]) / np.maximum(np.hypot(x[:, 0], x[:, 1]), 1e-9)
    assert np.abs(radial).max() < 0.1 * np.linalg.norm(t, axis=1).max()
    r = np.hypot(x[:, 0], x[:, 1])
    stuck, slid = records.sticking[4], (records.pressure[4] > 0) & ~records.sticking[4]
    assert r[stuck].max() <= r[slid].min() + 1e-9
    assert records.balance_error(turned.weights) < 1e-10


def test_check_and_end_of_a_solid() -> None:
    """What `check` and `steady` say."""
    case = load_case("fretting-sphere", list(COARSE))
    system = assemble(case)
    assert "first cycle: partial slip" in check_text(system)[0]
    found, numbers = final_of(system)
    assert not found.pressure[~found.stick].any()
    assert numbers["worn_volume_mm3"] > 0
    assert numbers["scar_to_mm"] == pytest.approx(-numbers["scar_from_mm"], abs=0.06)
    assert "worn volume (mm³)" in final_text(numbers)


def test_strains_of_linear_displacements_are_exact() -> None:
    """Along and across the sliding, whatever its direction."""
    for settings, expected in (((), [1e-3, -5e-4]), (("motion.along=[0, 1, 0]",), [-5e-4, 1e-3])):
        interface = problem(*settings).interface
        position = interface.middle
        gradient = surface_gradient(position.pair.punch)
        x = position.pair.punch.x
        slopes = np.array([[1e-3, 4e-4], [2e-4, -5e-4], [0.0, 0.0]])  # du_c / dx, du_c / dy
        found = surface_strain(position, gradient, x[:, :2] @ slopes.T)
        assert found == pytest.approx(np.tile(expected, (len(x), 1)), abs=1e-6)


def test_bulk_stress_of_a_solid_strains_it_both_ways() -> None:
    """Pulled along x the strip gets narrower along y: both act on the contact."""
    interface = problem().interface
    x = interface.middle.pair.punch.x
    assert interface.bulk[:, 0] == pytest.approx(x[:, 0], abs=1e-6)
    assert interface.bulk[:, 1] == pytest.approx(-0.3 * x[:, 1], abs=1e-6)


def test_a_torque_is_no_force() -> None:
    """What turns is driven by its angle."""
    settings = ["motion={kind='oscillation', amplitude='0.01 rad', period=1, axis=[0, 0, 1]}", "stick.force='1 N'"]
    with pytest.raises(CaseError, match=r"stick\.force:"):
        load_case("fretting-sphere", settings)


def test_cross_shear_of_an_ellipse() -> None:
    """That of its chords, where the way is far longer than the bodies give way, in both laws of contact."""
    x, y = (0.3 * f(2 * np.pi * np.arange(9) / 8) / k for k, f in ((1, np.cos), (2, np.sin)))
    chords = np.diff([x, y]).T
    tensor = np.einsum("ka,kb,k->ab", chords, chords, 1 / np.linalg.norm(chords, axis=1))
    crossing = float(np.linalg.eigvalsh(tensor)[0] / np.trace(tensor))
    rows = [[k / 8, float(1e3 * x[k]), float(1e3 * y[k]), -10] for k in range(9)]
    driven = problem(
        "punch.loads=[]",
        "motion={kind='cycle', columns=['time (s)', 'shift_x (um)', 'shift_y (um)', 'force_z (N)'], "
        f"load={{on='punch_top'}}, rows={rows}}}",
        "contact.friction=0.01",
        "wear={punch={coefficient={expression='1e-9 * cs', unit='1/MPa'}}}",
    )
    at, _ = driven.cycle(driven.beginning())
    found = TimeStepRecords.joined(driven.cycle(at)[1])
    depth = driven.passing(found, at).wear.depth(found.pressure).sum(axis=0)
    rubbed = found.pressure * found.slip_magnitude
    rubs = found.touched
    crosses = depth[rubs] / (1e-9 * rubbed.sum(axis=0)[rubs])
    assert rubs.any()
    assert np.abs(crosses - crossing).max() < 0.005 * crossing
