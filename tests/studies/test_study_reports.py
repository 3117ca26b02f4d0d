"""The commands sensitivity, calibrate and life: what they print and write, and how they refuse."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fenwear import Case
from fenwear.case import changed_case, load_case
from fenwear.cli import app
from fenwear.common.errors import CaseError, InputError
from fenwear.studies import study_reports
from fenwear.studies.model import Model

SMALL = ["--set", "geometry.degree=2", "--set", "geometry.parameters.elements_along_contact=8"]
K = "wear.punch.coefficient"
VOLUMES = "# sigma = 0.01 mm^3\nafter (cycles), volume (mm^3)\n100, 0.25\n200, 0.49\n300, 0.74\n"


Call = Callable[..., Any]


@pytest.fixture
def call(capsys: pytest.CaptureFixture[str]) -> Call:
    """Return call(*arguments): what a command prints on standard output as JSON."""

    def call(*arguments: object) -> Any:
        app(args=[*map(str, arguments), *SMALL, "--json"], standalone_mode=False)
        return json.loads(capsys.readouterr().out)

    return call


def test_sensitivity_writes_its_table_and_a_tornado(call: Call, tmp_path: Path) -> None:
    found = call("sensitivity", "example2", "--of", "steady volume_rate", "--to", K, "-o", tmp_path / "out")
    row = found["sensitivities"][0]["derivatives"][0]
    assert row["elasticity"] == pytest.approx(1.0, rel=1e-9)
    assert {p.name for p in (tmp_path / "out").iterdir()} == {
        "case.toml", "runs", "sensitivity.json", "tornado.png"}  # fmt: skip


def test_from_volumes_to_a_life(call: Call, tmp_path: Path) -> None:
    """calibrate leaves what life --from reads: the lives follow the calibrated coefficient."""
    (tmp_path / "volumes.csv").write_text(VOLUMES)
    fit = call("calibrate", "example2", tmp_path / "volumes.csv", "--unknown", f"{K}=1e-8 1/MPa..1e-6 1/MPa",
               "-o", tmp_path / "fit")  # fmt: skip
    value = fit["unknowns"][0]["value"]
    assert value == pytest.approx(0.00247 / 6e4, rel=0.01)
    assert {p.name for p in (tmp_path / "fit").iterdir()} == {
        "case.toml", "fitted.toml", "calibration.json", "residuals.csv", "residuals.png", "runs"}  # fmt: skip
    assert load_case(tmp_path / "fit" / "fitted.toml").wear.punch.coefficient == pytest.approx(value, rel=1e-12)
    life = call("life", "example2", "--until", "volume 3 mm^3", "--from", tmp_path / "fit", "--samples", 5,
                "--wanted", "600 m", "-o", tmp_path / "life")  # fmt: skip
    middle = next(row for row in life["quantiles"] if row["level"] == 0.5)
    assert middle["value"] == pytest.approx(3.0 / (value * 6e4), rel=0.1)
    assert life["reliability"]["wanted"] == pytest.approx(1e5)
    again = call("life", "example2", "--until", "volume 3 mm^3", "--from", tmp_path / "fit", "--samples", 5,
                 "-o", tmp_path / "life", "--resume")  # fmt: skip
    assert again["quantiles"] == life["quantiles"]
    with pytest.raises(CaseError, match=r"--resume: .*another study"):
        call("life", "example2", "--until", "volume 3 mm^3", "--from", tmp_path / "fit", "--samples", 5,
             "-o", tmp_path / "life", "--resume", "--set", "contact.friction=0.3")  # fmt: skip


def test_tests_one_by_one_give_their_scatter(call: Call, tmp_path: Path) -> None:
    files = []
    for number, factor in enumerate((0.8, 1.0, 1.25)):
        rows = "".join(f"{c}, {factor * 0.0024 * c}\n" for c in (100, 200, 300))
        files.append(tmp_path / f"{number}.csv")
        files[-1].write_text("# sigma = 0.01 mm^3\nafter (cycles), volume (mm^3)\n" + rows)
    found = call("calibrate", "example2", *files, "--unknown", K, "--each", "-o", tmp_path / "fit")
    assert found["unknowns"][0]["value"] == pytest.approx(0.0024 / 6e4, rel=1e-6)
    assert found["covariance"][0][0] ** 0.5 == pytest.approx(0.22314, rel=1e-3)  # ln 1.25
    assert len(found["tests"]) == 3


def test_bounds_that_exclude_the_data_lose_nothing(call: Call, tmp_path: Path) -> None:
    (tmp_path / "volumes.csv").write_text(VOLUMES)
    with pytest.raises(CaseError, match="beyond its bound"):
        call("calibrate", "example2", tmp_path / "volumes.csv", "--unknown", f"{K}=1e-8..2e-8", "-o", tmp_path / "fit")
    assert (tmp_path / "fit" / "calibration.json").is_file()


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["life", "example2", "--until", "volume 3 mm^3", "--scatter", f"{K}=normal(1e-8, 5 %)", "--resume"], "-o DIR"),
        (["life", "example2", "--until", "volume 3", "--scatter", f"{K}=normal(1e-8, 5 %)"], "with its unit"),
        (["calibrate", "example2", "none.csv", "--unknown", K], "cannot be read"),
        (["calibrate", "example2", "none.csv", "--unknown", f"{K}=3"], "LOW..HIGH"),
        (["sensitivity", "example2", "--of", "depth", "--to", "K"], "no such key"),
        (["sensitivity", "example2", "--of", "depth", "--to", K, "--spread", "2"], "--spread"),
    ],
)
def test_wrong_usage_is_refused(call: Call, arguments: list[str], expected: str) -> None:
    with pytest.raises(CaseError, match=expected):
        call(*arguments)


def test_programs_are_not_followed() -> None:
    """A life, a sensitivity and a calibration are of constant loads: a program is refused by its key."""
    case = changed_case(load_case("example1"), "program={steps=[{cycles=3}]}", "run.half_cycles=6")
    with pytest.raises(CaseError, match=r"^program: "):
        Model(case)


def test_stick_that_is_left_out_is_told_before_a_fit(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A case of partial slip, forced to slide as a whole: said at the start, with the estimate of "auto"."""
    told: list[str] = []

    def fit(*_: object, **__: object) -> None:
        raise CaseError(InputError("", "the fit has begun"))

    monkeypatch.setattr(study_reports, "calibrate", fit)
    (tmp_path / "volumes.csv").write_text(VOLUMES)
    case = load_case("fretting-partial-slip", ["contact.law=gross-sliding"])
    with pytest.raises(CaseError, match="the fit has begun"):
        study_reports.run_calibrate(
            case, "x", [tmp_path / "volumes.csv"], [K], [], told.append, folder=tmp_path / "fit"
        )
    (text,) = (line for line in told if "warning" in line)
    assert "% of the amplitude" in text
    assert text.startswith("warning: contact.law: ")
    assert not Model(
        load_case("fretting-partial-slip", ["geometry.parameters.elements_along_contact=8"])
    ).stick_left_out()


def test_a_life_without_scatter(small: Callable[..., Case], tmp_path: Path) -> None:
    """V = k F s: the one number, in cycles and metres; an option of samples is rejected."""
    case, until = small("example2"), ["volume 3 mm^3", "distance until volume 3 mm^3"]
    found, folder = study_reports.run_life(
        case, "e", until, [], None, 5, 0, None, lambda message: None, folder=tmp_path / "life"
    )
    cycles = 3 / (1.25 * np.pi * 1e-8 * 1e4 * 6)
    assert found.as_json()["lives"][0]["value"] == pytest.approx(cycles, rel=1e-9)
    assert found.as_json()["lives"][1]["value"] == pytest.approx(6 * cycles, rel=1e-9)
    assert (folder / "life.json").is_file()
    with pytest.raises(CaseError, match="--wanted"):
        study_reports.run_life(
            case, "e", until, [], None, 5, 0, "9 cycles", lambda message: None, folder=tmp_path / "w"
        )
