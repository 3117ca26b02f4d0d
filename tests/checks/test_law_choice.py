"""The law of contact that a case leaves open."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from fenwear import CaseError, load_case
from fenwear.checks import Seen
from fenwear.checks.law_choice import check_decided, resolve_law
from fenwear.studies.run import run_case
from fenwear.studies.variant import VariantRunner
from fenwear.system import assemble

SMALL = (
    "contact.law='auto'",
    "geometry.parameters.elements_along_contact=16",
    "geometry.follow_wear='never'",
    "motion.positions=2",
)
WIDE = "geometry.parameters.overlap='0.6 mm'"
ONE_WAY = "motion={kind='one-way', speed='1 mm/s', direction='leftward', duration='1 s'}"


ACROSS = "contact.transverse_friction=0.1"


@pytest.mark.parametrize(
    ("settings", "law", "reason"),
    [
        (("motion.amplitude='3 um'",), "coulomb", "times the stroke"),
        (("motion.amplitude='300 um'", WIDE), "gross-sliding", "% of the stroke"),
        (
            ("motion.amplitude='3 um'", "contact.transverse_friction=0.1"),
            "gross-sliding",
            "contact.transverse_friction",
        ),
        (("motion.amplitude='300 um'", "stick.force='60 N'"), "coulomb", "table stick"),
        ((ONE_WAY, "wear={punch={coefficient=1e-8}}"), "gross-sliding", "one way"),
    ],
)
def test_the_stroke_decides(settings: tuple[str, ...], law: str, reason: str) -> None:
    """Against the way that the bodies follow friction; what does not go with stick slides, and is told."""
    told: list[str] = []
    case = load_case("fretting-partial-slip", [*SMALL, *settings])
    found = resolve_law(case, told.append)
    assert found.system.case.contact.law == found.numbers["contact_law"] == law
    assert found.system.law.sticks == (law == "coulomb")
    assert found.system.case.folder == case.folder
    assert found.system.case.materials == case.materials
    assert len(told) == 1
    assert f"'{law}' is taken" in told[0]
    assert reason in told[0]
    if reason == "contact.transverse_friction":
        assert (
            "cannot be followed here: contact.transverse_friction" in Seen.of_system(found.system).warnings("system")[0]
        )


def test_the_estimate_decides_where_it_says() -> None:
    """The way that is taken up is of the bodies alone, and the law changes where its share passes a tenth."""
    ways, laws = [], []
    for amplitude in (12.0, 60.0):
        found = resolve_law(
            load_case("fretting-partial-slip", [*SMALL, WIDE, f"motion.amplitude='{amplitude} um'"]), str
        )
        share = found.numbers["elastic_share_of_stroke"]
        ways.append(share * amplitude)
        laws.append(found.system.case.contact.law)
        assert (share > 0.1) == (laws[-1] == "coulomb")
    assert laws == ["coulomb", "gross-sliding"]
    assert ways == pytest.approx([ways[0]] * 2, rel=1e-9)


def test_a_law_that_is_given_stays() -> None:
    """Without a word; a table stick that does not go with the case is an error."""
    case = load_case("fretting-partial-slip", [*SMALL, "contact.law='gross-sliding'", "stick={}"])
    assert resolve_law(case, pytest.fail).system.case is case
    with pytest.raises(CaseError, match=r"contact\.transverse_friction: expected 0, .* with contact\.law = 'coulomb'"):
        load_case("fretting-partial-slip", [*SMALL, "stick.force='60 N'", "contact.transverse_friction=0.1"])


def test_what_follows_one_law_says_so() -> None:
    """Sweeps and lives are no results of a law that the case does not call for; the law given, they are."""
    case = load_case("fretting-partial-slip", [*SMALL, "motion.amplitude='3 um'"])
    with pytest.raises(CaseError, match=r"contact\.law:"):
        VariantRunner("steady").compute(case)
    with pytest.raises(CaseError, match=r"contact\.law: 'coulomb' is taken"):
        check_decided(assemble(case))
    check_decided(assemble(load_case("fretting-partial-slip", [*SMALL, "contact.law='gross-sliding'"])))


def test_a_run_tells_its_law(tmp_path: Path) -> None:
    """The case in its folder has the one that was taken, the summary besides why; it goes on with the same one."""
    told: list[str] = []
    settings = [*SMALL, "run.half_cycles=2", "stick.steps=4", "output.report=false", "output.uncertainty=false"]
    settings[0] = "contact={law='auto', friction=0.9}"
    case = load_case("fretting-partial-slip", settings)
    out = tmp_path / "out"
    run_case(case, "auto", out, told.append, progress="none")
    assert any("'coulomb' is taken" in text for text in told)
    assert 'law = "coulomb"' in (out / "case.toml").read_text("utf-8")
    summary = json.loads((out / "summary.json").read_text("utf-8"))
    assert summary["energy_ratio"] > 0
    assert summary["contact_law"] == "coulomb"


def test_a_slide_tells_its_law_and_goes_on(tmp_path: Path) -> None:
    """The estimate is in the log, the summary, and the run goes on from its checkpoint by the case or its folder's."""
    told: list[str] = []
    settings = [
        "geometry.parameters.elements_along_contact=8",
        "run.half_cycles=2",
        "output.report=false",
        "output.uncertainty=false",
    ]
    out = tmp_path / "out"
    run_case(load_case("example1", settings), "auto", out, told.append, progress="none")
    assert any("'gross-sliding' is taken: the bodies take up about " in text for text in told)
    summary = json.loads((out / "summary.json").read_text("utf-8"))
    assert summary["contact_law"] == "gross-sliding"
    assert summary["elastic_share_of_stroke"] == pytest.approx(0.0045, rel=0.1)
    for case, half_cycles in (("example1", 4), (str(out / "case.toml"), 6)):
        farther = load_case(case, [*settings, f"run.half_cycles={half_cycles}"])
        done, _ = run_case(farther, "auto", out, told.append, resume=True, progress="none")
        assert done["half_cycles"] == half_cycles
