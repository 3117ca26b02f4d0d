"""Meshes of other programs: sets of elements and of nodes become groups, and what lacks is refused by name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fenwear import CaseError, assemble, make_case
from fenwear.arrays import Array

pytest.importorskip("meshio")
from fenwear.bodies.imported import import_mesh

STEEL = {"young": 2e5, "poisson": 0.3}
SETS = {  # of nodes, by what they are at: name, body, coordinate, its value
    "PUNCH_CONTACT": ("punch", 1, 1.0),
    "PUNCH_FAR": ("punch", 1, 2.0),
    "STRIP_CONTACT": ("strip", 1, 1.0),
    "STRIP_FAR": ("strip", 1, 0.0),
}


def block(low: float, count: tuple[int, int]) -> tuple[Array, Array]:
    """Return nodes (n, 2) and quadrilaterals (m, 4) of a unit square above a height."""
    nx, nz = count
    x, z = np.meshgrid(np.linspace(-0.5, 0.5, nx + 1), low + np.linspace(0, 1, nz + 1), indexing="ij")
    number = np.arange(x.size).reshape(x.shape)
    cells = [number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]]
    return np.column_stack([x.ravel(), z.ravel()]), np.stack([c.ravel() for c in cells], axis=1)


def abaqus(unit: float = 1.0, **renamed: str) -> str:
    """Return an input file of two blocks on each other."""
    bodies = {"punch": block(1.0, (6, 3)), "strip": block(0.0, (6, 4))}
    text, first, cell = ["*HEADING", "two blocks"], 0, 0
    sets: list[str] = []
    nodes: list[str] = ["*NODE"]
    for body, (x, cells) in bodies.items():
        nodes += [f"{first + k + 1}, {unit * a:.12g}, {unit * b:.12g}" for k, (a, b) in enumerate(x.tolist())]
        name = f"{body.upper()}_BODY"
        elements = [
            f"{cell + k + 1}, " + ", ".join(str(first + n + 1) for n in row) for k, row in enumerate(cells.tolist())
        ]
        sets += [f"*ELEMENT, TYPE=CPE4, ELSET={renamed.get(name, name)}", *elements]
        for group, (of, axis, value) in SETS.items():
            if of == body:
                found = np.flatnonzero(np.abs(x[:, axis] - value) < 1e-9) + first + 1
                sets += [f"*NSET, NSET={renamed.get(group, group)}", ", ".join(map(str, found))]
        first, cell = first + len(x), cell + len(cells)
    return "\n".join([*text, *nodes, *sets]) + "\n"


def pressure_of(geometry: dict[str, Any]) -> tuple[Array, Array]:
    """Return x and the contact pressure of two blocks under 1 MPa."""
    case = make_case(
        {
            "geometry": {"degree": 2, **geometry},
            "model": {"plane": "strain"},
            "materials": {"steel": STEEL, "soft": {"young": 5e4, "poisson": 0.3}},
            "punch": {
                "regions": {"punch_body": "soft"},
                "supports": [{"on": "punch_far", "fix": ["x"]}],
                "loads": [{"on": "punch_far", "traction": [0, -1]}],
            },
            "strip": {"regions": {"strip_body": "steel"}, "supports": [{"on": "strip_far", "fix": ["x", "z"]}]},
            "wear": {"punch": {"coefficient": 0}},
            "contact": {"law": "gross-sliding"},
            "motion": {"kind": "one-way", "direction": "rightward", "speed": 1.0, "duration": 1.0},
            "run": {"half_cycles": 1},
        }
    )
    system = assemble(case)
    return system.pair.x, system.phase_contact((0,)).solve(system.gap(0, system.unworn())).pressure[0]


def test_abaqus_blocks_are_those_of_gmsh(tmp_path: Path) -> None:
    """The same elements give the same pressures, in metres too."""
    sizes = {"across": 6, "punch_layers": 3, "strip_layers": 4}
    x, exact = pressure_of({"file": "blocks.geo", "parameters": sizes})
    for unit, scale in ((1.0, 1.0), (1e-3, 1e3)):
        (tmp_path / "blocks.inp").write_text(abaqus(unit))
        told = import_mesh(tmp_path / "blocks.inp", tmp_path / "blocks.msh", {}, scale)
        assert told.groups["punch_contact"] == (1, 6)
        assert told.groups["strip_body"] == (2, 24)
        at, found = pressure_of({"file": str(tmp_path / "blocks.msh")})
        assert at == pytest.approx(x, abs=1e-12)
        assert found == pytest.approx(exact, rel=1e-9, abs=1e-9)


def test_sets_of_other_names_are_mapped(tmp_path: Path) -> None:
    """By --group; what is asked for and lacks is named, with what there is."""
    (tmp_path / "b.inp").write_text(abaqus(PUNCH_CONTACT="PAD_LOW", PUNCH_BODY="PAD"))
    named = {"punch_contact": "pad_low", "punch_body": "PAD"}
    assert import_mesh(tmp_path / "b.inp", tmp_path / "b.msh", named).groups["punch_contact"] == (1, 6)
    with pytest.raises(CaseError, match=r"punch_contact: .* no set 'PAD_LOWER'; did you mean 'PAD_LOW'"):
        import_mesh(tmp_path / "b.inp", tmp_path / "b.msh", {**named, "punch_contact": "PAD_LOWER"})
    with pytest.raises(CaseError, match="punch_contact=SET"):
        import_mesh(tmp_path / "b.inp", tmp_path / "b.msh", {"punch_body": "PAD"})


def test_gmsh_meshes_and_solids_go_the_same_way(tmp_path: Path) -> None:
    """Physical groups are sets, of facets too."""
    from fenwear.bodies.mesh import write_msh
    from fenwear.case import Geometry

    write_msh(Geometry(file="solid_blocks.geo"), None, tmp_path / "solid.msh", "solid")
    told = import_mesh(tmp_path / "solid.msh", tmp_path / "again.msh", {})
    assert told.groups["punch_body"][0] == 3
    assert told.groups["punch_contact"][0] == 2
    again = import_mesh(tmp_path / "again.msh", tmp_path / "third.msh", {})
    assert again.groups == told.groups


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda text: text.replace("CPE4", "CPE8"), "no mesh that meshio reads|quad8"),
        (lambda text: "", "no mesh|elements"),
        (lambda text: text.replace("NSET=STRIP_CONTACT", "NSET=STRIP_UP"), "strip_contact=SET"),
        (lambda text: text.replace("NSET=PUNCH_FAR", "NSET=PUNCH_CONTACT2").replace(
            "*NSET, NSET=STRIP_FAR", "*NSET, NSET=PUNCH_BACK, GENERATE\n1, 28, 1\n*NSET, NSET=STRIP_FAR"), "both of"),
    ],
)  # fmt: skip
def test_what_is_no_mesh_for_fenwear_is_refused(tmp_path: Path, change: Callable[[str], str], reason: str) -> None:
    """By the file, the group and the set."""
    (tmp_path / "b.inp").write_text(change(abaqus()))
    with pytest.raises(CaseError, match=reason):
        import_mesh(tmp_path / "b.inp", tmp_path / "b.msh", {})
    with pytest.raises(CaseError, match="no such file"):
        import_mesh(tmp_path / "none.inp", tmp_path / "b.msh", {})
