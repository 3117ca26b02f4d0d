"""A run with stick: its folder, figures, page, warnings."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import xarray

from fenwear import CaseError, load_case
from fenwear.report.page import write_report
from fenwear.run import run_case

SMALL = ("geometry.parameters.elements_along_contact=20", "stick.steps=10", "run.jump_tolerance=0.05")


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict, Path]:
    case = load_case("fretting-partial-slip", [*SMALL, "run.half_cycles=4000"])
    return run_case(case, "fretting", tmp_path_factory.mktemp("run") / "out", lambda _: None, progress="none")


def test_history_holds_loops_zones_energy_and_stress(ran: tuple[dict, Path]) -> None:
    """Every variable has its unit; numbers that can be made of others agree with them."""
    summary, folder = ran
    with xarray.open_dataset(folder / "history.nc") as history:
        assert all("units" in history[name].attrs for name in history.data_vars)
        assert list(history.cycle.values)[:1] == [0]
        assert int(history.cycle[-1]) == 2000 == summary["cycles"]
        force = (history.traction * history.weight).sum("x")
        assert np.abs(force - history.tangential_force).max() < 1e-9 * np.abs(force).max()
        load = (history.pressure * history.weight).sum("x")
        assert np.abs(load - 120).max() < 1e-8
        assert (np.abs(history.traction) <= 0.9 * history.pressure * (1 + 1e-12)).all()
        stuck = history.slip.where(history.stick == 1).fillna(0)
        assert not stuck.any()
        work = (np.abs(history.traction * history.slip).sum("step") * history.weight).sum("x")
        assert np.abs(work - history.dissipated_energy).max() < 1e-9 * float(work.max())
        assert float(history.energy_balance_error.max()) < 1e-8
        assert (history.wear.diff("cycle") >= 0).all()
    saved = json.loads((folder / "summary.json").read_text("utf-8"))
    assert saved["stop"] == "all cycles done"
    assert saved["warnings"] == []


def test_report_is_drawn_and_drawn_again(ran: tuple[dict, Path]) -> None:
    """Seven figures and a page; `plot` makes the same."""
    _, folder = ran
    names = {path.name for path in write_report(folder)}
    assert {"loops.png", "zones.png", "tractions.png", "surface_stress.png", "report.html"} <= names
    page = (folder / "report.html").read_text("utf-8")
    assert page.count("<img") == 7
    assert "energy ratio" in page


def test_gross_sliding_and_what_is_missing_are_told(tmp_path: Path) -> None:
    """A long stroke is told as gross sliding; there is nothing to resume."""
    case = load_case("fretting-partial-slip", [*SMALL, "motion.amplitude='20 um'", "motion.positions=1",
                                               "run.half_cycles=2", "run.integration='explicit'"])  # fmt: skip
    told: list[str] = []
    summary, _ = run_case(case, "fretting", tmp_path / "out", told.append, progress="none")
    assert any("gross sliding" in text for text in summary["warnings"])
    assert any("gross sliding" in text for text in told)
    assert summary["energy_ratio"] > 0.5
    with pytest.raises(CaseError, match="--resume"):
        run_case(case, "fretting", tmp_path / "out", told.append, resume=True)
