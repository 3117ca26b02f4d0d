"""Shapes from CAD: named and numbered faces, planes, sizes, and what is wrong with them by name."""

from __future__ import annotations

import random
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from fenwear import CaseError
from fenwear.bodies.distributed_mesh import write_msh
from fenwear.case import Geometry
from fenwear.files.by_gmsh import gmsh_model
from fenwear.files.cad import read_shapes
from fenwear.files.formats import listed_file

FLAT = {"punch_body": "surface 1", "strip_body": "Face 2", "punch_contact": "y = 0 mm", "strip_contact": "y = 0 mm",
        "punch_top": "curve 3"}  # fmt: skip


def shapes(path: Path, *, solid: bool = False) -> Path:
    """Write two blocks, 10 mm and 20 mm long, as shapes."""
    with gmsh_model() as gmsh:
        occ = gmsh.model.occ
        if solid:
            occ.addBox(-5, -4, 0, 10, 8, 6)
            occ.addBox(-10, -5, -4, 20, 10, 4)
        else:
            occ.addRectangle(-5, 0, 0, 10, 4)
            occ.addRectangle(-10, -4, 0, 20, 4)
        occ.synchronize()
        gmsh.write(str(path))
    return path


def sizes(path: Path, **keys: Any) -> dict[str, tuple[int, float]]:
    rows, _ = write_msh(Geometry(file=str(path), **keys), None, path.with_suffix(".msh"), None)
    return {row["group"]: (row["elements"], row["size"]) for row in rows}


@pytest.mark.parametrize("suffix", [".step", ".iges", ".brep"])
def test_faces_by_number_and_by_plane(tmp_path: Path, suffix: str) -> None:
    """Areas and lengths are those of the shapes, elements at the contact those asked for."""
    found = sizes(shapes(tmp_path / f"flat{suffix}"), groups=FLAT, size=2.0, sizes={"punch_contact": 0.5})
    right = {"punch_body": 40, "strip_body": 80, "punch_contact": 10, "strip_contact": 20, "punch_top": 10}
    assert {name: size for name, (_, size) in found.items()} == pytest.approx(right)
    assert found["punch_contact"][0] == pytest.approx(20, abs=2)
    assert found["punch_top"][0] < 12


@pytest.mark.parametrize("suffix", [".step", ".iges"])
def test_solids(tmp_path: Path, suffix: str) -> None:
    """Of IGES, too, whose surfaces are closed to solids."""
    groups = {"punch_body": "volume 1", "strip_body": "solid 2", "punch_contact": "z = 0 mm", "strip_contact": "z=0 mm"}
    path = shapes(tmp_path / f"solid{suffix}", solid=True)
    _, content = listed_file(path)
    first = next(part for part in content["parts"] if part["name"] == "volume 1")
    if first["size"] == pytest.approx(800):
        groups |= {"punch_body": "volume 2", "strip_body": "volume 1"}
    found = {name: size for name, (_, size) in sizes(path, groups=groups, size=4.0).items()}
    right = {"punch_body": 480, "strip_body": 800, "punch_contact": 80, "strip_contact": 200}
    assert found == pytest.approx(right)


def test_names_and_metres(tmp_path: Path) -> None:
    """Labels of the file are groups by themselves; a .brep may be in metres, as it has no unit."""
    path = shapes(tmp_path / "flat.step")
    text = path.read_text()
    labels = sorted({part["label"] for part in listed_file(path)[1]["parts"]} - {""})
    assert len(labels) == 2
    path.write_text(text.replace(f"'{labels[0]}'", "'Punch-Body'").replace(f"'{labels[1]}'", "'STRIP_body'"))
    groups = {name: part for name, part in FLAT.items() if "body" not in name}
    assert sizes(path, groups=groups, size=2.0)["punch_body"][1] == pytest.approx(40)
    found = sizes(shapes(tmp_path / "flat.brep"), groups=FLAT, size=2000.0, unit="m")
    assert found["strip_contact"][1] == pytest.approx(20e3)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"groups": FLAT | {"punch_top": "curve 30"}}, r"punch_top.*'curve 30'"),
        ({"groups": FLAT | {"punch_top": "y = 3 mm"}}, r"punch_top.*'y = 3 mm'"),
        ({"groups": FLAT | {"punch_top": "y = 3 kg"}}, r"punch_top.*kg"),
        ({"groups": FLAT | {"strip_more": "surface 2"}}, r"surface 2.*strip_more"),
        ({"groups": {"punch_body": "surface 1"}}, r"strip_"),
        ({"groups": FLAT, "sizes": {"punch_bottom": 1.0}}, r"sizes.punch_bottom"),
        ({"groups": FLAT, "unit": "kg"}, r"geometry.unit"),
    ],
)
def test_what_a_shape_does_not_have(tmp_path: Path, change: dict[str, Any], reason: str) -> None:
    with pytest.raises(CaseError, match=reason):
        sizes(shapes(tmp_path / "flat.step"), **change)


def test_spoiled_shapes_never_end_the_process(tmp_path: Path) -> None:
    """OpenCASCADE ends on some of them."""
    content = shapes(tmp_path / "flat.step").read_bytes()
    choose = random.Random(2)
    for k in range(3):
        spoiled = bytearray(content[: choose.randrange(len(content))] if k % 2 else content)
        for _ in range(20):
            spoiled[choose.randrange(len(spoiled))] = choose.randrange(32, 127)
        (tmp_path / "bad.step").write_bytes(bytes(spoiled))
        with gmsh_model() as gmsh, suppress(CaseError):
            read_shapes(gmsh, tmp_path / "bad.step", 1.0)
