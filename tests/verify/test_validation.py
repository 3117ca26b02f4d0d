"""The gallery of measured experiments: each number on coarse meshes, what is compared, and the words of errors."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from fenwear import CaseError
from fenwear_verify.validation import Comparison, experiments
from fenwear_verify.validation.command import validate

# The number of each experiment, %, on coarse meshes: what the pages say. Errors stand here as they are.
NUMBERS = {
    "ball-on-disc": 1,
    "block-on-ring": 5,
    "cylinder-liners": 13,
    "disc-brake": 17,
    "fretting-cylinder": 6,
    "hip-in-patients": 83,
    "hip-simulator": 11,
    "polyethylene": 12,
    "sliding-metal": 8,
}


@pytest.mark.slow
@pytest.mark.parametrize("name", NUMBERS)
def test_number(name: str, tmp_path: Path) -> None:
    """An experiment comes out as its page says, with a figure and the whole comparison in validation.json."""
    found, folder = validate([name], tmp_path / "gallery", lambda _: None, "short")
    (one,) = found["experiments"]
    assert abs(one["percent"]) == pytest.approx(NUMBERS[name], abs=1)
    assert json.loads((folder / "validation.json").read_text())["experiments"][0]["comparisons"] == one["comparisons"]
    assert (folder / f"{name}.png").stat().st_size > 10_000


def test_every_experiment_has_a_number_and_a_page() -> None:
    """None is left out, and each has its page with its command."""
    assert sorted(NUMBERS) == sorted(one.name for one in experiments())
    pages = Path(__file__).parents[2] / "docs" / "validation"
    assert sorted(NUMBERS) == sorted(page.stem for page in pages.glob("*.md") if page.stem != "index")
    for name in NUMBERS:
        page = (pages / f"{name}.md").read_text("utf-8")
        assert f"$ fenwear validate --short --only {name} -o results/{name}\n" in page


def test_comparison_error_and_its_uncertainty() -> None:
    """E = S - D, and u_val adds the squares of its parts; an unknown scatter of the data is left out."""
    one = Comparison("width", 2.0, 2.2, u_data=0.3, u_num=0.4)
    assert (one.error, one.percent, one.u_val) == (pytest.approx(0.2), pytest.approx(10.0), pytest.approx(0.5))
    assert Comparison("width", 2.0, 2.2, u_num=0.1).u_val == pytest.approx(0.1)


def test_unknown_experiment_is_rejected() -> None:
    """By name, with the nearest one."""
    with pytest.raises(CaseError, match=r"--only.*fretting-cylinder"):
        experiments(["freting-cylinder"])
