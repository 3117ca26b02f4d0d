"""Bodies whose mesh is hardly in mm."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fenwear import CaseError, load_case
from fenwear.bodies.ready_geometries import meshes_folder
from fenwear.case.templates import template_names, write_case_of
from fenwear.checks import RULES, Seen
from fenwear.system import place_case


def told(case: Path | str, *settings: str) -> list[str]:
    placed = place_case(load_case(str(case), ["contact.law='gross-sliding'", *settings]))
    text = RULES["unit"].text(Seen.of_system(placed))
    return [text] if text else []


@pytest.mark.parametrize("name", ["example1", "rounded-punch", "ring-on-ring", "fretting-sphere"])
def test_built_in_cases_are_in_mm(name: str) -> None:
    """Nothing is said of what is as it should be."""
    assert told(name) == []


@pytest.mark.parametrize("name", template_names())
def test_usual_tests_in_metres(name: str, tmp_path: Path) -> None:
    """A usual test is in mm; with its mesh in metres, and the rest as it was, it is told so."""
    write_case_of(name, tmp_path / "case.toml")
    assert told(tmp_path / "case.toml") == []
    file = meshes_folder() / load_case(str(tmp_path / "case.toml")).geometry.file
    (tmp_path / "own.geo").write_text(file.read_text("utf-8") + "Mesh.ScalingFactor = 0.001;\n", "utf-8")
    if name == "fretting":  # its stroke would leave the strip
        with pytest.raises(CaseError, match=r"^motion: .*\d mm"):
            told(tmp_path / "case.toml", "geometry.file='own.geo'")
        return
    (warning,) = told(tmp_path / "case.toml", "geometry.file='own.geo'")
    assert "geometry.file: a mesh is read in mm, and this one may be in m: " in warning
    assert "Mesh.ScalingFactor = 1000;" in warning


def test_mesh_in_micrometres(tmp_path: Path, fenwear: Callable[..., Any]) -> None:
    """Told with what it is held against, where a case is checked; the case is valid none the less."""
    text = (meshes_folder() / "punch_on_strip.geo").read_text("utf-8")
    (tmp_path / "own.geo").write_text(text + "Mesh.ScalingFactor = 1000;\n", "utf-8")
    (tmp_path / "case.toml").write_text(
        'base = "example2"\n[geometry]\nfile = "own.geo"\ndegree = 1\nparameters.elements_along_contact = 8\n'
    )
    done = fenwear("check", "case.toml", cwd=tmp_path)
    assert "warning: geometry.file: a mesh is read in mm, and this one may be in µm: " in done.stderr
    assert "the punch is 1e+05 mm in all, model.thickness is 10 mm, the stroke is 3 mm" in done.stderr
    assert (done.returncode, "the case is valid" in done.stderr) == (0, True)
