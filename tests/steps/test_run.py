"""A run with stick: its folder, figures, page, warnings."""

from __future__ import annotations

import itertools
import json
import os
import shutil
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray

from fenwear import CaseError, assemble, load_case, march, vary
from fenwear.common.errors import InterruptedRunError
from fenwear.report.compare import compare, comparison_figure
from fenwear.report.page import write_report
from fenwear.report.stick_figures import chosen, stick_figures
from fenwear.report.style import Style
from fenwear.results.export import export
from fenwear.results.sheet import sheet_text
from fenwear.results.stored_history import by_cycles, cycle_at, load_history
from fenwear.steps.coulomb import Meter
from fenwear.steps.run_state import Totals
from fenwear.studies.run import run_case

SMALL = ("geometry.parameters.elements_along_contact=20", "stick.steps=10", "run.jump_tolerance=0.05")


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict, Path]:
    case = load_case("fretting-partial-slip", [*SMALL, "run.half_cycles=4000"])
    return run_case(case, "fretting", tmp_path_factory.mktemp("run") / "out", lambda _: None, progress="none")


def test_history_holds_loops_zones_energy_and_stress(ran: tuple[dict, Path]) -> None:
    """Every variable has its unit; numbers that can be made of others agree with them."""
    summary, folder = ran
    with xarray.open_dataset(folder / "history.nc") as stored:
        assert all("units" in stored[name].attrs for name in stored.data_vars)
        assert np.abs(stored.normal_force - 120).max() < 1e-8
        assert float(stored.equilibrium_error.max()) < 1e-10
    history = by_cycles(load_history(folder))
    assert list(history.cycle.values)[:1] == [1]
    assert int(history.cycle[-1]) == 2000 == summary["sliding"]["cycles"]
    along = history.normal_z * history.traction + history.normal_x * history.pressure
    force = (along * history.weight).sum("x")
    assert np.abs(force - history.tangential_force).max() < 1e-9 * np.abs(force).max()
    down = history.normal_z * history.pressure - history.normal_x * history.traction
    load = (down * history.weight).sum("x")
    assert np.abs(load - 120).max() < 1e-8
    assert (np.abs(history.traction) <= 0.9 * history.pressure * (1 + 1e-12)).all()
    stuck = history.slip.where(history.stick == 1).fillna(0)
    assert not stuck.any()
    work = (np.abs(history.traction * history.slip).sum("step") * history.weight).sum("x")
    assert np.abs(work - history.friction_work_increment).max() < 1e-9 * float(work.max())
    assert float(history.energy_balance_error.max()) < 1e-8
    assert (history.wear.diff("cycle") >= 0).all()
    saved = json.loads((folder / "summary.json").read_text("utf-8"))
    assert saved["stop"] == "all half-cycles done"
    assert saved["warnings"] == []


def test_report_is_drawn_and_drawn_again(ran: tuple[dict, Path]) -> None:
    """All figures of a run and those of its time steps, and a page with each of them; `plot` makes the same."""
    summary, folder = ran
    lines = sheet_text(summary).splitlines()
    assert any(line.startswith("largest tangential force in the last cycle (N)") for line in lines)
    names = {path.name for path in write_report(folder)}
    assert {"loops.png", "zones.png", "tractions.png", "volume.png", "report.html"} <= names
    page = (folder / "report.html").read_text("utf-8")
    assert page.count("<img") == sum(name.endswith(".png") for name in names)
    assert "energy ratio" in page


@pytest.mark.parametrize("body", ["punch", "strip"])
def test_figures_of_one_body_that_wears(tmp_path: Path, body: str) -> None:
    """Where the other body does not wear every figure of the time steps is drawn, its cycles spread over the wear."""
    coarse = ["geometry.degree=1", "geometry.parameters.elements_along_contact=8", "stick.steps=4", "run.half_cycles=8"]
    silent = ["output.report=false", "output.uncertainty=false", "run.integration='explicit'", f"unset=wear.{body}"]
    case = load_case("fretting-partial-slip", [*coarse, *silent, "motion.positions=1", "output.every=1"])
    _, folder = run_case(case, "fretting", tmp_path / "out", lambda _: None, progress="none")
    history = by_cycles(load_history(folder))
    places = chosen(history, 3)
    assert (places[0], places[-1]) == (0, history.sizes["cycle"] - 1)
    assert {"loops", "zones"} <= set(stick_figures(history))


def test_gross_sliding_is_told(tmp_path: Path) -> None:
    """A long stroke is told as gross sliding; a run that has ended goes on with more half-cycles only."""
    case = load_case("fretting-partial-slip", [*SMALL, "motion.amplitude='20 um'", "motion.positions=1",
                                               "run.half_cycles=2", "run.integration='explicit'"])  # fmt: skip
    told: list[str] = []
    summary, _ = run_case(case, "fretting", tmp_path / "out", told.append, progress="none")
    assert any("gross sliding" in text for text in summary["warnings"])
    assert any("gross sliding" in text for text in told)
    assert summary["energy_ratio"] > 0.5
    with pytest.raises(CaseError, match=r"run\.half_cycles: .*2"):
        run_case(case, "fretting", tmp_path / "out", told.append, resume=True)
    other = load_case("fretting-partial-slip", [*SMALL, "run.half_cycles=4"])
    with pytest.raises(CaseError, match=r"motion\.amplitude: .*0\.02"):
        run_case(other, "fretting", tmp_path / "out", told.append, resume=True)


def run(folder: Path, settings: list[str], *, resume: bool = False) -> xarray.Dataset:
    case = load_case("fretting-partial-slip", [*SMALL, "output.report=false", "output.uncertainty=false", *settings])
    run_case(case, "fretting", folder, lambda _: None, progress="none", resume=resume)
    return by_cycles(load_history(folder))


@pytest.mark.parametrize("integration", ["explicit", "jump"])
def test_every_half_cycle_wears(tmp_path: Path, integration: str) -> None:
    """n half-cycles wear n / 2 cycles off, and friction works in as many: volume = k times the integral of p |slip|.

    So little is worn that every cycle is as the first; the rows that are kept do not matter.
    """
    laws = [f"wear.{body}.coefficient='1e-13 1/MPa'" for body in ("punch", "strip")]
    how = [
        *SMALL,
        "output.report=false",
        "output.uncertainty=false",
        "output.every=3",
        f"run.integration='{integration}'",
        *laws,
    ]
    case = load_case("fretting-partial-slip", [*how, "run.half_cycles=8"])
    summary, folder = run_case(case, "fretting", tmp_path / "out", lambda _: None, progress="none")
    history = by_cycles(load_history(folder))
    slid = np.abs(history.slip).where(history.pressure > 0, 0)
    rubbed = float(((history.pressure * slid).sum("step") * history.weight).sum("x").isel(cycle=-1))
    worn, work = summary["punch"]["worn_area_mm2"], summary["sliding"]["friction_work_mJ"]
    assert summary["sliding"]["cycles"] == 4
    assert worn == pytest.approx(4e-13 * rubbed, rel=2e-3)  # the first settles
    assert work == pytest.approx(4 * 0.9 * rubbed, rel=2e-3)
    if integration == "explicit":
        assert work == pytest.approx(0.9 * worn / 1e-13, rel=1e-9)


def interrupted_after(monkeypatch: pytest.MonkeyPatch, rows: int) -> None:
    """Send SIGTERM to this process when so many cycles have been metered."""
    made, whole = itertools.count(1), Meter.__call__

    def counted(*args: Any) -> Totals:
        if next(made) == 2 * rows:
            os.kill(os.getpid(), signal.SIGTERM)
        return whole(*args)

    monkeypatch.setattr(Meter, "__call__", counted)


@pytest.mark.parametrize(
    "how",
    [
        ["run.integration='explicit'", "run.half_cycles=14", "output.every=2", "wear.punch.coefficient='1e-6 1/MPa'"],
        ["run.half_cycles=800", "stick.force='60 N'"],
    ],
)
def test_interrupted_and_resumed_equals_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, how: list[str]) -> None:
    """After SIGTERM nothing is lost, and the end is that of a run in one piece; kept set-ups may round anew."""
    whole = run(tmp_path / "whole", how)
    with monkeypatch.context() as patched:
        interrupted_after(patched, 3)
        with pytest.raises(InterruptedRunError, match="to resume: --resume"):
            run(tmp_path / "parts", how)
    so_far = load_history(tmp_path / "parts")
    assert len(so_far.half_cycle) < 2 * len(whole.cycle)
    stop = json.loads((tmp_path / "parts" / "summary.json").read_text("utf-8"))["stop"]
    assert stop.startswith("interrupted")
    resumed = run(tmp_path / "parts", how, resume=True)
    xarray.testing.assert_identical(resumed.coords.to_dataset(), whole.coords.to_dataset())
    assert set(resumed) == set(whole)
    for name in set(whole) - {"energy_balance_error", "equilibrium_error"}:  # which are rounding
        scale = float(np.abs(whole[name]).max())
        np.testing.assert_allclose(resumed[name], whole[name], rtol=0, atol=1e-9 * scale, err_msg=str(name))


def test_a_kill_between_checkpoints_costs_what_came_after(tmp_path: Path) -> None:
    """What the history has beyond the checkpoint is computed again; a checkpoint cut short is told."""
    how = ["run.integration='explicit'", "wear.punch.coefficient='1e-6 1/MPa'"]
    run(tmp_path / "one", [*how, "run.half_cycles=6"])
    whole = run(tmp_path / "two", [*how, "run.half_cycles=10"])
    shutil.copyfile(tmp_path / "two" / "history.nc", tmp_path / "one" / "history.nc")
    xarray.testing.assert_identical(run(tmp_path / "one", [*how, "run.half_cycles=10"], resume=True), whole)
    with (tmp_path / "one" / "checkpoint.npz").open("r+b") as file:
        file.truncate(5000)
    with pytest.raises(CaseError, match=r"--resume: the checkpoint in .* is damaged"):
        run(tmp_path / "one", [*how, "run.half_cycles=20"], resume=True)


def test_runs_are_compared(ran: tuple[dict, Path], tmp_path: Path) -> None:
    """Loops, shapes and work of both in one figure, their numbers in one table."""
    _, folder = ran
    run(tmp_path / "short", ["run.half_cycles=4"])
    found = compare([folder, tmp_path / "short"])
    assert found.cases["run.half_cycles"] == [4000, 4]
    assert "energy ratio" in found.text()
    titles = [ax.get_title(loc="left") for ax in comparison_figure(found).axes]
    assert titles[0] == "Loop of the last cycle"
    assert "Work of friction in a half-cycle" in titles


def test_time_steps_are_chosen_anew_where_others_are_asked_for() -> None:
    """Steps that end at numbers of finer ones than there are would never end a half-cycle."""
    small = ("geometry.parameters.elements_along_contact=12", "motion.positions=1", "contact.law=coulomb")
    system = assemble(load_case("fretting-partial-slip", [*small, "stick.steps=4"]))
    for settings in (["stick.steps=8"], ["motion.amplitude=2 um"], ["stick.step_tolerance=1", "stick.steps=3"]):
        varied = vary(system, *settings)
        (block,) = march(varied, 2)
        assert block.end.half_cycle == 2
        again = assemble(varied.case)
        if "stick.steps" in " ".join(settings):
            np.testing.assert_allclose(block.pressure, next(march(again, 2)).pressure, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("asked", [{"motion.positions": 3}, {"motion.positions": 3, "motion.amplitude": "20 um"}, {}])
def test_a_strip_that_passes_in_vain_is_told_of(asked: dict[str, object], tmp_path: Path) -> None:
    """Where positions are asked for and little slips; not where it slips by nodes, nor where it stays by default."""
    wears = {f"wear.{body}.coefficient": "1e-8 1/MPa" for body in ("punch", "strip")}
    small = {
        "geometry.parameters.overlap": 0.1,
        "motion.amplitude": "4 um",
        "run.half_cycles": 4,
        "output.report": False,
        "output.uncertainty": False,
    }
    keys = {**small, **wears, **asked}
    case = load_case("fretting-partial-slip", [*SMALL, *(f"{key}={json.dumps(keys[key])}" for key in keys)])
    told: list[str] = []
    run_case(case, "fretting", tmp_path / "out", told.append, progress="none")
    assert any("smeared" in text for text in told) == (len(asked) == 1)


def test_steps_of_a_program_with_more_time_steps_than_the_first(tmp_path: Path) -> None:
    """Cycles of two and of four time steps stand in one history, in one piece and in parts, each with its own work."""
    columns = "columns=['time (s)', 'shift_x (um)', 'force_z (N)'], load={on='punch_top'}"
    two = "[[0, -3, -120], [1, 3, -120], [2, -3, -120]]"
    four = "[[0, -2, -100], [1, 0, -120], [2, 2, -140], [3, 0, -120], [4, -2, -100]]"
    second = f"{{cycles=3, motion={{kind='cycle', {columns}, rows={four}}}}}"
    settings = [
        "unset=['punch.loads', 'run.half_cycles']",
        "geometry.parameters.elements_along_contact=20",
        f"motion={{kind='cycle', {columns}, rows={two}}}",
        "stick={step_tolerance=1}",
        f"program.steps=[{{cycles=4}}, {second}, {{cycles=2}}]",
        "run.integration=explicit",
        "output={report=false, uncertainty=false}",
    ]
    histories = {}
    for name, stops in (("whole", (9,)), ("parts", (3, 6, 9))):
        for stop in stops:
            case = load_case("fretting-partial-slip", [*settings, f"run.half_cycles={stop}"])
            run_case(case, "fretting", tmp_path / name, lambda _: None, resume=stop != stops[0], progress="none")
        histories[name] = load_history(tmp_path / name)
    xarray.testing.assert_allclose(histories["parts"], histories["whole"], rtol=1e-12)
    history = by_cycles(histories["whole"])
    np.testing.assert_array_equal(np.isfinite(history.fraction).sum("step"), [2] * 4 + [4] * 5)
    work = (np.abs(history.traction * history.slip).sum("step") * history.weight).sum("x")
    np.testing.assert_allclose(work, history.friction_work_increment, rtol=1e-9)
    np.testing.assert_allclose(cycle_at(history, 0).displacement, [3e-3, -3e-3], rtol=1e-9)
    np.testing.assert_allclose(cycle_at(history, -1).displacement, [0, 2e-3, 0, -2e-3], rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(Style(axis="time").course(history), [2, 4, 6, 8, 12, 16, 20, 24, 28], rtol=1e-12)
    slid = histories["whole"].sliding_distance  # of each cycle, which a table counts as a half-cycle
    np.testing.assert_allclose(Style(axis="distance").course(history), slid / 1e3, rtol=1e-12)
    export(tmp_path / "whole", tmp_path / "tables", at="4,last")
    assert len((tmp_path / "tables" / "loops.csv").read_text("utf-8").splitlines()) == 1 + 2 + 4
    assert "loops.png" in {path.name for path in write_report(tmp_path / "whole")}
