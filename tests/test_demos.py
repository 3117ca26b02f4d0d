"""The notebooks of demos/: made from their scripts; docs/extensions/executed.py executes them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

jupytext = pytest.importorskip("jupytext")

DEMOS = Path(__file__).parents[1] / "demos"
NAMES = [
    "01_first_tour",
    "02_steady_state",
    "03_heat_and_instability",
    "04_mpi_and_restart",
    "05_own_material_and_geometry",
    "06_the_paper",
    "07_fretting",
    "08_measurement_to_life",
    "09_solids",
    "10_partial_slip",
    "11_bearings_and_brakes",
    "12_what_lies_between",
]


def _cells(notebook: Any) -> list[tuple[str, str]]:
    return [(cell.cell_type, cell.source) for cell in notebook.cells]


def test_names() -> None:
    """Every script has its notebook, and none is left out here."""
    assert sorted(p.stem for p in DEMOS.glob("[0-9]*.py")) == NAMES
    assert sorted(p.stem for p in DEMOS.glob("*.ipynb")) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_notebook_is_made_from_its_script(name: str) -> None:
    """The same cells in both, and nothing executed: jupytext --to notebook demos/*.py brings them together."""
    script, notebook = (jupytext.read(DEMOS / f"{name}{suffix}") for suffix in (".py", ".ipynb"))
    assert _cells(notebook) == _cells(script)
    assert not any(cell.get("outputs") or cell.get("execution_count") for cell in notebook.cells)
