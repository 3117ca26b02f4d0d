"""The law of contact where a case leaves it open."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from fenwear import CaseError, load_case
from fenwear.law import with_law
from fenwear.run import run_case

SMALL = (
    "contact.law='auto'",
    "geometry.parameters.elements_along_contact=16",
    "geometry.follow_wear='never'",
    "motion.positions=2",
)


@pytest.mark.parametrize(
    ("settings", "law", "reason"),
    [
        (("motion.amplitude='3 um'",), "coulomb", "% of the amplitude"),
        (("motion.amplitude='300 um'", "geometry.parameters.overlap='0.6 mm'"), "gross-sliding", "% of the amplitude"),
        (("motion.amplitude='3 um'", "run.integration='implicit'"), "gross-sliding", "run.integration"),
        (("motion.amplitude='300 um'", "stick.force='60 N'"), "coulomb", "table stick"),
    ],
)
def test_the_stroke_decides(settings: tuple[str, ...], law: str, reason: str) -> None:
    """Against the way that the bodies follow friction; what does not go with stick slides, and is told."""
    told: list[str] = []
    case = load_case("fretting-partial-slip", [*SMALL, *settings])
    found = with_law(case, told.append)
    assert found.contact.law == law
    assert found.folder == case.folder
    assert found.materials == case.materials
    assert len(told) == 1
    assert f"'{law}' is taken" in told[0]
    assert reason in told[0]


def test_a_law_that_is_given_stays() -> None:
    """Without a word; a table stick that does not go with the case is an error."""
    case = load_case("example1")
    assert with_law(case, pytest.fail) is case
    with pytest.raises(CaseError, match=r"run\.integration: expected 'explicit' or 'jump'"):
        load_case("fretting-partial-slip", [*SMALL, "stick.force='60 N'", "run.integration='implicit'"])


def test_a_run_tells_its_law(tmp_path: Path) -> None:
    """The case in its folder has the one that was taken."""
    told: list[str] = []
    case = load_case("fretting-partial-slip", [*SMALL, "run.half_cycles=2", "stick.steps=4", "output.report=false"])
    run_case(case, "auto", tmp_path / "out", told.append, progress="none")
    assert any("'coulomb' is taken" in text for text in told)
    assert 'law = "coulomb"' in (tmp_path / "out" / "case.toml").read_text("utf-8")
    assert json.loads((tmp_path / "out" / "summary.json").read_text("utf-8"))["energy_ratio"] > 0
