"""The gallery of measured experiments: each number on coarse meshes, what is compared, and the words of errors."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from fenwear import CaseError
from fenwear_verify.validation import Comparison, experiments
from fenwear_verify.validation.command import validate

PAGES = Path(__file__).parents[2] / "docs" / "validation"


@pytest.mark.slow
def test_files_of_an_experiment(tmp_path: Path) -> None:
    """The whole comparison stands in validation.json, with a figure; the documentation states the error of each."""
    found, folder = validate(["cylinder-liners"], tmp_path / "gallery", lambda _: None, "short")
    (one,) = found["experiments"]
    assert abs(one["percent"]) == pytest.approx(13, abs=1)
    assert json.loads((folder / "validation.json").read_text())["experiments"][0]["comparisons"] == one["comparisons"]
    assert (folder / "cylinder-liners.png").stat().st_size > 10_000


def test_every_experiment_has_a_page() -> None:
    """With its command, and its error for the build of the documentation to hold it against."""
    pages = {page.stem: page.read_text("utf-8") for page in PAGES.glob("*.md") if page.stem != "index"}
    assert sorted(pages) == sorted(one.name for one in experiments())
    for name, text in pages.items():
        assert f"$ fenwear validate --short --only {name} -o results/{name}\n" in text
        assert f"{{experiment}} {name} " in text


def test_comparison_error_and_its_uncertainty() -> None:
    """E = S - D, and u_val adds the squares of its parts; an unknown scatter of the data is left out."""
    one = Comparison("width", 2.0, 2.2, u_data=0.3, u_num=0.4)
    assert (one.error, one.percent, one.u_val) == (pytest.approx(0.2), pytest.approx(10.0), pytest.approx(0.5))
    assert Comparison("width", 2.0, 2.2, u_num=0.1).u_val == pytest.approx(0.1)


def test_unknown_experiment_is_rejected() -> None:
    """By name, with the nearest one."""
    with pytest.raises(CaseError, match=r"--only.*fretting-cylinder"):
        experiments(["freting-cylinder"])
