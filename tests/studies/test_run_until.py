"""Runs that end at a level of a quantity."""

from __future__ import annotations

from math import ceil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fenwear import Case, CaseError, load_case, read_history, run_case

SMALL = ("geometry.degree=2", "geometry.parameters.elements_along_contact=8", "output.report=false",
         "output.uncertainty=false", "output.fields_at=[]")  # fmt: skip
PER_CYCLE = 1.25 * np.pi * 1e-8 * 1e4 * 6  # mm³: k F 4 u0 of example 2


def run(path: Path, case: Case) -> tuple[dict[str, Any], Any]:
    summary, folder = run_case(case, "run", path / "run", lambda message: None, progress="none")
    return summary, read_history(folder)


@pytest.mark.parametrize(("integration", "volume"), [("explicit", 0.01), ("jump", 3.0)])
def test_a_volume_is_reached_after_archards_cycles(tmp_path: Path, integration: str, volume: float) -> None:
    """V = k F s to rounding: the run ends with the first cycle that has worn the volume, by jumps, too."""
    level = [f"run.until='volume {volume} mm^3'", f"run.integration={integration}", "run.half_cycles=20000"]
    summary, history = run(tmp_path, load_case("example2", [*SMALL, *level]))
    cycles = ceil(volume / PER_CYCLE)
    assert summary["until"]["reached"]
    assert summary["until"]["cycles"] == cycles
    assert summary["until"]["distance_mm"] == pytest.approx(6 * cycles, rel=1e-12)
    assert int(history["half_cycle"][-1]) == 2 * cycles
    assert "is reached" in summary["stop"]


@pytest.mark.parametrize("text", ["depth of both 0.2 um", "depth of strip 0.05 um", "approach 1 um"])
def test_levels_of_both_bodies(tmp_path: Path, text: str) -> None:
    """A ball and its track, by jumps: the level lies between the last cycle and the one before it."""
    coarse = ("geometry.parameters.elements_along_contact=16", "motion.positions=3", *SMALL[2:])
    level_of = (f"run.until='{text}'", "run.half_cycles=20000", "run.integration=jump")
    case = load_case("fretting", [*coarse, *level_of])
    summary, history = run(tmp_path, case)
    assert summary["until"]["reached"], summary["stop"]
    level = float(text.split()[-2]) * 1e-3
    if text.startswith("approach"):
        (value,) = -history["moved_z"].values[-1:]
    elif "strip" in text:
        value = history["wear_strip"].values[-1].max()
    else:
        value = summary["until"]["value"]
        assert value <= 1.001 * (history["wear"].values[-1].max() + history["wear_strip"].values[-1].max())
        assert value >= history["wear"].values[-1].max()
    assert level <= value < 1.1 * level


def test_a_level_that_is_not_reached_is_told(tmp_path: Path) -> None:
    """With how far it came; and texts without a level, and bodies that do not wear, are rejected."""
    summary, _ = run(tmp_path, load_case("example2", [*SMALL, "run.until='depth 1 mm'", "run.half_cycles=4"]))
    assert not summary["until"]["reached"]
    assert any("run.until" in text and "half-cycle 4" in text for text in summary["warnings"])
    for text in ("depth", "depth 1", "depth of strip 1 mm", "pressure 3 MPa"):
        with pytest.raises(CaseError, match=r"run\.until"):
            run(tmp_path / text, load_case("example2", [*SMALL, f"run.until='{text}'"]))
