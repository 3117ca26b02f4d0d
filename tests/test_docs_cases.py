"""The cases of the pages do what these say: they are taken from their text."""

from __future__ import annotations

import re
import subprocess
import tomllib
from pathlib import Path

import numpy as np
import pytest

from fenwear import assemble, jump, load_case
from fenwear.case import Case

DOCS = Path(__file__).resolve().parents[1] / "docs"
OWN_PART, FIRST_STEPS, LAWS = DOCS / "how-to/own-part.md", DOCS / "first-steps.md", DOCS / "how-to/laws.md"


def saved_as(page: Path, name: str) -> str:
    """Return the block of code that follows "Save this as `name`" on a page."""
    found = re.search(rf"Save this as `{re.escape(name)}`.*?```\w+\n(.*?)```", page.read_text("utf-8"), re.DOTALL)
    assert found, name
    return found[1]


@pytest.fixture(scope="module")
def slider(tmp_path_factory: pytest.TempPathFactory) -> Case:
    """Return the case of the page's own mesh."""
    folder = tmp_path_factory.mktemp("slider")
    for name in ("slider.geo", "slider.toml"):
        (folder / name).write_text(saved_as(OWN_PART, name), "utf-8")
    command = re.search(r"fenwear (gmsh -2 .*)", OWN_PART.read_text("utf-8"))
    assert command
    subprocess.run(command[1].split(), cwd=folder, check=True, capture_output=True, timeout=1800)
    return load_case(folder / "slider.toml")


def test_own_mesh(slider: Case) -> None:
    """Both bodies of a mesh made with gmsh lose exactly K/H times force and distance; the wear widens the contact."""
    system = assemble(slider)
    *_, last = jump(system, 1000, tolerance=0.02)
    force, distance = 6000 / 30, 1000 * 4  # N/mm, mm
    assert system.pair.weights @ last.wear[-1] == pytest.approx(2e-5 / 1200 * force * distance, rel=1e-9)
    assert system.pair.strip.weights @ last.wear_strip[-1] == pytest.approx(1e-6 / 2000 * force * distance, rel=1e-9)
    start = system.contact((1,)).solve(system.pair.initial_gap).pressure[0]
    # Hertz: a cylinder on a flat, of different materials.
    compliance = (1 - 0.34**2) / 110e3 + (1 - 0.3**2) / 210e3
    peak = np.sqrt(force / (np.pi * 400 * compliance))
    assert start.max() == pytest.approx(peak, rel=0.05)  # a slider 20 mm wide and 15 mm high is no half-space
    assert last.contact_width[-1] > 1.5 * float(system.pair.weights @ (start > 0))


def test_case_to_start_from(tmp_path: Path) -> None:
    """The case to start from is valid as it is printed."""
    (tmp_path / "wide-punch.toml").write_text(saved_as(FIRST_STEPS, "wide-punch.toml"), "utf-8")
    assert assemble(load_case(tmp_path / "wide-punch.toml")).pair.x.max() == pytest.approx(40)


def test_laws_that_vary(tmp_path: Path) -> None:
    """The coefficients of the example are accepted by a case with heat."""
    laws = saved_as(LAWS, "laws.toml")
    (tmp_path / "laws.toml").write_text(laws, "utf-8")
    case = load_case(tmp_path / "laws.toml")
    assert case.varies
    assert tomllib.loads(laws)["wear"]["punch"]["coefficient"]["unit"] == "1/MPa"
