"""Several runs side by side."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fenwear import CaseError, load_case
from fenwear.report.compare import compare, comparison_figure, draw_comparison
from fenwear.studies.run import run_case

SMALL = ("geometry.degree=1", "geometry.parameters.elements_along_contact=4", "run.half_cycles=6")
RUNS = {"plain": ("example1",), "rough": ("example1", "contact.friction=0.3"), "hot": ("example1-heat",)}


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    base = tmp_path_factory.mktemp("compare")
    for name, (case, *settings) in RUNS.items():
        loaded = load_case(
            case, [*SMALL, *settings, "output.fields_at=[]", "output.report=false", "output.uncertainty=false"]
        )
        run_case(loaded, name, base / name, lambda message: None)
    return [base / name for name in RUNS]


def test_numbers_are_the_summaries(folders: list[Path]) -> None:
    """A column per run with the values of its summary, and nothing where it has none."""
    found = compare(folders).as_json()
    assert found["runs"] == list(RUNS)
    assert json.dumps(found, allow_nan=False)
    for k, folder in enumerate(folders):
        summary = json.loads((folder / "summary.json").read_text())
        column = {key: row[k] for key, row in found["numbers"].items()}
        assert column["rightward.largest_pressure_MPa"] == summary["rightward"]["largest_pressure_MPa"]
        assert column["wear_mm[1]"] == summary["wear_mm"][1]
        assert column["heat_mJ.friction"] == summary.get("heat_mJ", {}).get("friction")
        assert column["stop"] == summary["stop"]


def test_only_what_differs_between_the_cases(folders: list[Path]) -> None:
    """Key by key; equal cases say so."""
    plain, rough, _ = folders
    found = compare([plain, rough])
    assert found.cases == {"contact.friction": [0.25, 0.3]}
    assert found.versions == {}
    text = found.text()
    assert "contact.friction" in text
    assert "0.3" in text
    same = compare([plain, plain])
    assert "the cases are equal" in same.text()
    assert same.names == [str(plain), str(plain)]


def test_curves_are_the_histories(folders: list[Path], tmp_path: Path) -> None:
    """The last shape and pressures of each run, in its own dashes; temperature of the hot one alone."""
    comparison = compare(folders)
    shape, rightward, leftward, peak, depth, temperature = comparison_figure(comparison).axes
    for k, history in enumerate(comparison.histories):
        np.testing.assert_allclose(shape.lines[k].get_ydata(), 1e3 * history.wear[-1], rtol=1e-12)
        np.testing.assert_array_equal(rightward.lines[k].get_ydata(), history.pressure[-2])
        np.testing.assert_array_equal(leftward.lines[k].get_ydata(), history.pressure[-1])
        assert peak.lines[k].get_ydata()[-1] == history.largest_pressure[-2:].max()
        assert depth.lines[k].get_ydata()[-1] == history.largest_depth[-1]
    assert [line.get_label() for line in temperature.lines] == ["hot"]
    assert len({str(line.get_linestyle()) for line in shape.lines}) == 3
    assert draw_comparison(comparison, tmp_path / "runs.pdf").read_bytes().startswith(b"%PDF")


def test_refusals_name_every_folder(folders: list[Path], tmp_path: Path) -> None:
    """One run, folders that are none, and an ending that is no picture."""
    with pytest.raises(CaseError, match="at least two"):
        compare(folders[:1])
    with pytest.raises(CaseError) as caught:
        compare([folders[0], tmp_path / "a", tmp_path / "b"])
    assert all(name in str(caught.value) for name in (str(tmp_path / "a"), str(tmp_path / "b")))
    with pytest.raises(CaseError, match=r"-o: expected a file ending in \.png"):
        draw_comparison(compare(folders[:2]), tmp_path / "runs.doc")


def test_command(folders: list[Path], tmp_path: Path, fenwear: Callable[..., Any]) -> None:
    """compare prints the table or one JSON object, and writes the figure; status 2 for what is no run."""
    out = tmp_path / "runs.svg"
    done = fenwear("compare", *folders[:2], "-o", out, "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["cases"] == {"contact.friction": [0.25, 0.3]}
    assert "<svg" in out.read_text()
    done = fenwear("compare", folders[0], tmp_path, "-o", out)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr


def test_names_with_units(folders: list[Path]) -> None:
    """The table has names with units, and no values at places of their own in each run."""
    text = compare(folders[:2]).text()
    assert "worn volume, punch (mm³)" in text
    assert "largest_pressure_MPa" not in text
    assert "wear_mm" not in text


def test_worn_strips_are_drawn(tmp_path: Path) -> None:
    """A panel for the strip, where one wears; temperatures in degrees are put beside those in kelvin."""
    for name, settings in {"one": [], "other": ["wear.strip.coefficient=2e-8"]}.items():
        coarse = [
            "geometry.degree=1",
            "geometry.parameters.elements_along_contact=8",
            "output.report=false",
            "output.uncertainty=false",
        ]
        case = load_case("fretting", [*coarse, "run.half_cycles=2", "run.integration=explicit", *settings])
        run_case(case, name, tmp_path / name, lambda message: None)
    comparison = compare([tmp_path / "one", tmp_path / "other"])
    titles = [ax.get_title("left") for ax in comparison_figure(comparison).axes]
    assert any("strip at the end" in title for title in titles)
