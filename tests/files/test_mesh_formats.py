"""Meshes of other programs: each way of writing gives the same areas and lengths, or an error with file and line."""

from __future__ import annotations

import random
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from decks import BASE, RIGHT, SAME, WRONG

from fenwear import CaseError, assemble, make_case
from fenwear.bodies.distributed_mesh import write_msh
from fenwear.case import Geometry
from fenwear.files.formats import read_mesh
from fenwear.files.mesh_file import KINDS, Block, MeshFile, completed, measure

SIZES = {"across": 6, "punch_layers": 3, "strip_layers": 4}


def sizes_of(path: Path, groups: dict[str, str] | None = None, unit: str | None = None) -> dict[str, float]:
    """Return the length or area of each group."""
    rows, text = write_msh(
        Geometry(file=str(path), groups=groups or {}, unit=unit), None, path.with_suffix(".msh"), None
    )
    assert all(f"{row['group']}: {row['elements']:,}" in text for row in rows)
    return {row["group"]: row["size"] for row in rows}


@pytest.mark.parametrize("way", SAME)
def test_a_deck_in_every_way_of_writing(tmp_path: Path, way: str) -> None:
    """Areas and lengths are those of the two blocks."""
    path = tmp_path / "deck.inp"
    path.write_bytes(SAME[way]().encode("latin-1"))
    assert sizes_of(path) == pytest.approx(RIGHT)


@pytest.mark.parametrize(
    "written",
    [BASE.encode("utf-16"), b"\xef\xbb\xbf" + BASE.encode(), BASE.replace("\n", "\r\n").encode(),
     BASE.replace(", ", ",\t").encode(), BASE.lower().encode(), BASE.replace("*N", "  *N").encode()],
    ids=["utf-16", "bom", "crlf", "tabs", "small", "indented"],
)  # fmt: skip
def test_a_deck_in_every_encoding(tmp_path: Path, written: bytes) -> None:
    """The text decides, not its bytes."""
    (tmp_path / "deck.inp").write_bytes(written)
    assert sizes_of(tmp_path / "deck.inp") == pytest.approx(RIGHT)


@pytest.mark.parametrize("way", WRONG)
def test_a_wrong_deck_is_named_by_file_and_line(tmp_path: Path, way: str) -> None:
    """No traceback and no silence."""
    write, reason = WRONG[way]
    (tmp_path / "deck.inp").write_text(write())
    with pytest.raises(CaseError, match=f"(?s){reason}"):
        sizes_of(tmp_path / "deck.inp")


def test_includes_are_beside_the_deck(tmp_path: Path) -> None:
    """Whatever the working directory."""
    head, _, rest = BASE.partition("*ELEMENT")
    (tmp_path / "mesh.inc").write_text(head)
    (tmp_path / "deck.inp").write_text(f"*INCLUDE, INPUT=mesh.inc\n*ELEMENT{rest}")
    assert sizes_of(tmp_path / "deck.inp") == pytest.approx(RIGHT)


def test_sets_of_other_names_are_mapped(tmp_path: Path) -> None:
    """Whatever their case and spaces; by planes; a set is left out by an empty name."""
    (tmp_path / "d.inp").write_text(BASE.replace("PUNCH_BODY", '"Pad 1"').replace("=PUNCH_CONTACT", "=LOW"))
    named = {"punch_body": "PAD-1", "punch_contact": "y = 0 mm", "punch_top": ""}
    found = sizes_of(tmp_path / "d.inp", named)
    assert found == pytest.approx({name: size for name, size in RIGHT.items() if name != "punch_top"})
    with pytest.raises(CaseError, match=r"groups.punch_body.*'PAD-2'.*'Pad 1'"):
        sizes_of(tmp_path / "d.inp", {**named, "punch_body": "PAD-2"})
    assert sizes_of(tmp_path / "d.inp", named | {"punch_contact": "y = 0 m"}, "m")["punch_body"] == pytest.approx(40e6)


def written(folder: Path, suffix: str) -> Path:
    """Write the blocks in the format of another program, as gmsh or VTK does, or by hand."""
    (folder / "d.inp").write_text(BASE)
    sizes_of(folder / "d.inp")
    path = folder / f"d{suffix}"
    if suffix in (".unv", ".cgns", ".bdf"):
        from fenwear.files.by_gmsh import gmsh_model

        with gmsh_model() as gmsh:
            gmsh.merge(str(folder / "d.msh"))
            gmsh.option.setNumber("Mesh.SaveGroupsOfElements", 1)
            gmsh.write(str(path))
    elif suffix == ".exo":
        write_exodus(path)
    elif suffix == ".med":
        write_med(path, read_mesh(folder / "d.inp"))
    else:
        write_vtu(path, read_mesh(folder / "d.inp"))
    return path


def numbered(mesh: MeshFile) -> tuple[Any, Any, list[int]]:
    """Return the blocks' quadrilaterals, the lines of their contacts, and how many each part has."""
    sets = {one.name: one for one in mesh.sets}
    lines = [np.column_stack([n[:-1], n[1:]]) for n in (sets[f"{b}_CONTACT"].members for b in ("STRIP", "PUNCH"))]
    quads = [block.nodes for block in mesh.blocks]
    return np.vstack(quads), np.vstack(lines), list(map(len, (*quads, *lines)))


def write_vtu(
    path: Path, mesh: MeshFile, mode: str = "Binary", packer: str = "ZLib", wide: int = 32, coded: int = 1
) -> None:
    """Write blocks and the lines of their contacts, with the numbers 1 to 4 as an array of cells."""
    pyvista = pytest.importorskip("pyvista")
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    quads, lines, counts = numbered(mesh)
    grid = pyvista.UnstructuredGrid({9: quads, 3: lines}, mesh.points)
    grid.cell_data["material"] = np.repeat([1, 2, 3, 4], counts)
    writer = vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(grid)
    getattr(writer, f"SetDataModeTo{mode}")()
    getattr(writer, f"SetCompressorTypeTo{packer}")()
    writer.SetHeaderType(wide)
    writer.SetEncodeAppendedData(coded)
    writer.Write()


@pytest.mark.parametrize(
    "how",
    [("Ascii", "None"), ("Binary", "None", 64), ("Binary", "LZMA"), ("Appended", "None", 32, 0),
     ("Appended", "ZLib", 64), ("Appended", "ZLib", 32, 0)],
    ids=str,
)  # fmt: skip
def test_arrays_of_vtu_in_every_way(tmp_path: Path, how: tuple[Any, ...]) -> None:
    """As text, in base64, appended, packed or not."""
    (tmp_path / "d.inp").write_text(BASE)
    mesh = read_mesh(tmp_path / "d.inp")
    write_vtu(tmp_path / "d.vtu", mesh, *how)
    found = read_mesh(tmp_path / "d.vtu")
    assert {one.name: found.measure(one) for one in found.sets} == pytest.approx(
        {"material 1": 80, "material 2": 40, "material 3": 20, "material 4": 10}
    )


def write_med(path: Path, mesh: MeshFile) -> None:
    """Write blocks and the lines of their contacts with Salome's groups."""
    import h5py

    quads, lines, counts = numbered(mesh)
    families = np.repeat([-1, -2, -3, -4], counts)
    with h5py.File(path, "w") as file:
        step = file.create_group("ENS_MAA/mesh/-0000000000000000001-0000000000000000001")
        file["ENS_MAA/mesh"].attrs["ESP"] = 2
        step["NOE/COO"] = mesh.points[:, :2].T.ravel()
        step["NOE/COO"].attrs["NBR"] = len(mesh.points)
        for kind, nodes, own in (("QU4", quads, families[: len(quads)]), ("SE2", lines, families[len(quads) :])):
            step[f"MAI/{kind}/NOD"], step[f"MAI/{kind}/FAM"] = (nodes + 1).T.ravel(), own
        for number, name in enumerate(("STRIP BODY", "punch_body", "strip_contact", "Punch_Contact"), 1):
            family = file.create_group(f"FAS/mesh/ELEME/FAM_{-number}")
            family.attrs["NUM"] = -number
            family["GRO/NOM"] = np.array([name.encode().ljust(80, b"\0")], dtype="V80")


def write_exodus(path: Path) -> None:
    """Write blocks, a side set of each block and node sets, as Exodus in NetCDF-3."""
    from scipy.io import netcdf_file

    mesh = read_mesh(path.with_suffix(".inp"))
    with netcdf_file(path, "w") as file:
        file.createDimension("node", len(mesh.points))
        file.createDimension("dim", 2)
        file.createDimension("text", 33)
        file.createDimension("two", 2)
        file.createVariable("coord", "d", ("dim", "node"))[:] = mesh.points[:, :2].T
        for k, block in enumerate(mesh.blocks, 1):
            file.createDimension(f"el{k}", len(block.nodes))
            file.createDimension(f"nod{k}", 4)
            variable = file.createVariable(f"connect{k}", "i", (f"el{k}", f"nod{k}"))
            variable[:] = block.nodes + 1
            variable.elem_type = "QUAD4"
        sides = {1: (np.arange(11, 21), 3), 2: (np.arange(21, 26), 1)}
        for k, (elements, side) in sides.items():
            file.createDimension(f"ss{k}", len(elements))
            file.createVariable(f"elem_ss{k}", "i", (f"ss{k}",))[:] = elements
            file.createVariable(f"side_ss{k}", "i", (f"ss{k}",))[:] = side
        for stem, names in (("eb", ("strip body", "punch body")), ("ss", ("strip_contact", "PUNCH_CONTACT"))):
            variable = file.createVariable(f"{stem}_names", "c", ("two", "text"))
            for k, name in enumerate(names):
                variable[k] = np.array(list(name.ljust(33, "\0")), "S1")


@pytest.mark.parametrize("suffix", [".med", ".unv", ".cgns", ".bdf", ".vtu", ".exo"])
def test_the_blocks_in_other_formats(tmp_path: Path, suffix: str) -> None:
    """Groups, properties, cell arrays and blocks become the same groups."""
    path, groups = written(tmp_path, suffix), dict[str, str]()
    if suffix == ".bdf":
        groups = {"punch_body": "property 2", "strip_body": "property 1", "punch_contact": "y = 0 mm",
                  "strip_contact": "y = 0 mm"}  # fmt: skip
        mesh = read_mesh(path)
        if {one.name: mesh.measure(one) for one in mesh.sets}["property 1"] == pytest.approx(40):
            groups["punch_body"], groups["strip_body"] = "property 1", "property 2"
    if suffix == ".vtu":
        groups = {"strip_body": "material 1", "punch_body": "material 2", "strip_contact": "material 3",
                  "punch_contact": "Material 4"}  # fmt: skip
    found = sizes_of(path, groups)
    wanted = ("punch_body", "strip_body", "punch_contact", "strip_contact")
    assert {name: found[name] for name in wanted} == pytest.approx({name: RIGHT[name] for name in wanted})


def pressure_of(geometry: dict[str, Any]) -> tuple[Any, Any]:
    """Return x and the contact pressure of two blocks under a load."""
    steel = {"young": 2e5, "poisson": 0.3}
    case = make_case(
        {
            "geometry": {"degree": 2, **geometry},
            "model": {"plane": "strain"},
            "materials": {"steel": steel, "soft": {"young": 5e4, "poisson": 0.3}},
            "punch": {
                "regions": {"punch_body": "soft"},
                "supports": [{"on": "punch_top", "fix": ["x"]}],
                "loads": [{"on": "punch_top", "traction": [0, -1]}],
            },
            "strip": {"regions": {"strip_body": "steel"}, "supports": [{"on": "strip_bottom", "fix": ["x", "z"]}]},
            "wear": {"punch": {"coefficient": 0}},
            "contact": {"law": "gross-sliding"},
            "motion": {"kind": "one-way", "direction": "rightward", "speed": 1.0, "duration": 1.0},
            "run": {"half_cycles": 1},
        }
    )
    system = assemble(case)
    return system.pair.x, system.phase_contact((0,)).solve(system.gap(0, system.unworn())).pressure[0]


def test_a_deck_is_a_geometry_of_a_case(tmp_path: Path) -> None:
    """Pressures are the same to rounding through parts and instances, in metres, and of second order."""
    (tmp_path / "base.inp").write_text(BASE)
    x, exact = pressure_of({"file": str(tmp_path / "base.inp")})
    assert len(x) > 5
    (tmp_path / "parts.inp").write_text(SAME["parts, shift and rotation"]())
    (tmp_path / "metres.inp").write_text(WRONG["metres"][0]())
    (tmp_path / "second.inp").write_text(second_order(read_mesh(tmp_path / "base.inp")))
    for geometry in ({"file": "parts.inp"}, {"file": "metres.inp", "unit": "m"}, {"file": "second.inp"}):
        at, found = pressure_of({**geometry, "file": str(tmp_path / geometry["file"])})
        assert np.sort(at) == pytest.approx(np.sort(x), abs=1e-9)
        assert np.sort(found) == pytest.approx(np.sort(exact), rel=1e-8)


def second_order(mesh: MeshFile) -> str:
    """Return the blocks as a deck of CPE8 elements."""
    points, middles = [tuple(x[:2]) for x in mesh.points], dict[tuple[int, int], int]()
    rows, sets = [], {one.name: set(one.members.tolist()) for one in mesh.sets if one.of == "nodes"}
    for block, name in zip(mesh.blocks, ("STRIP_BODY", "PUNCH_BODY"), strict=True):
        rows.append(f"*ELEMENT, TYPE=CPE8R, ELSET={name}")
        for label, row in zip(block.labels, block.nodes.tolist(), strict=True):
            mids = []
            for a, b in zip(row, row[1:] + row[:1], strict=True):
                key = (min(a, b), max(a, b))
                if key not in middles:
                    middles[key] = len(points)
                    points.append(tuple((np.array(points[a]) + points[b]) / 2))
                mids.append(middles[key])
            rows.append(f"{label}, " + ", ".join(str(n + 1) for n in row + mids))
    lines = ["*NODE", *(f"{k + 1}, {x:g}, {y:g}" for k, (x, y) in enumerate(points)), *rows]
    for name, members in sets.items():
        lines += [f"*NSET, NSET={name}", *(str(n + 1) for n in sorted(members))]
    return "\n".join(lines) + "\n"


def test_middle_nodes_of_second_order_elements() -> None:
    """Those of serendipity elements are where their own shape functions have them; sides share them."""
    x = np.array([[i, j, k] for k in (0.0, 1.0, 2.0) for j in (0.0, 1.0, 2.0) for i in (0.0, 1.0, 2.0)])
    number = {tuple(p): n for n, p in enumerate((x - 1).round().astype(int).tolist())}
    corners = [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)]
    edges = [tuple(np.add(corners[a], corners[b]) // 2) for a, b in KINDS[17].edges]
    row = np.array([[number[tuple(int(c) for c in p)] for p in corners + edges]])
    mesh = completed(MeshFile("x", x, (Block.of(17, row),), ()))
    assert mesh.blocks[0].kind == 12
    middles = mesh.points[mesh.blocks[0].nodes[0, 20:]]
    assert middles[-1] == pytest.approx([1, 1, 1])
    for middle, face in zip(middles, KINDS[12].middles, strict=False):
        if face:
            assert middle == pytest.approx(x[row[0, list(face)]].mean(axis=0))
    assert measure(mesh.points, {12: mesh.blocks[0].nodes}) == pytest.approx(8)
    for side in range(6):
        nodes = mesh.blocks[0].nodes[0, KINDS[12].side_nodes(side)]
        assert mesh.points[nodes[8]] == pytest.approx(mesh.points[nodes[:4]].mean(axis=0))


@pytest.mark.parametrize("kind", [2, 3, 4, 5, 6, 7])
def test_sides_enclose_an_element(kind: int) -> None:
    """Each edge of a side is one of another side: the sides close."""
    sides = KINDS[kind].sides
    if KINDS[kind].dim == 2:
        assert sorted(corner for side in sides for corner in side) == sorted(2 * list(range(KINDS[kind].corners)))
        return
    edges = [(side[k], side[(k + 1) % len(side)]) for side in sides for k in range(len(side))]
    assert sorted(edges) == sorted((b, a) for a, b in edges)


def test_spoiled_decks_never_end_in_a_traceback(tmp_path: Path) -> None:
    """Bytes, lines and fields changed at random: a mesh, or an error of the deck."""
    texts = [BASE, *(write() for write in SAME.values())]
    choose = random.Random(5)
    path = tmp_path / "deck.inp"
    for _ in range(400):
        lines = choose.choice(texts).splitlines()
        for _ in range(choose.choice((1, 1, 2, 5))):
            at = choose.randrange(len(lines))
            what = choose.randrange(6)
            other = choose.choice(lines)
            junk = choose.choice(("*", ",", "=", "\x00", "-", "1e999", "9" * 30, '"', "*PART", "S1", "é", ".", "nan"))
            cut = choose.randrange(len(lines[at]) + 1)
            lines[at] = (other, "", lines[at][:cut], lines[at][:cut] + junk + lines[at][cut:], junk, lines[at][cut:])[
                what
            ]
        path.write_bytes("\n".join(lines).encode("latin-1", "replace"))
        try:
            mesh = read_mesh(path)
            for one in mesh.sets:
                mesh.measure(one)
        except CaseError:
            pass


@pytest.mark.parametrize("suffix", [".med", ".exo", ".vtu", ".unv", ".cgns", ".bdf"])
def test_spoiled_files_of_other_formats_never_end_in_a_traceback(tmp_path: Path, suffix: str) -> None:
    """Cut short, or with bytes changed at random."""
    content = written(tmp_path, suffix).read_bytes()
    choose = random.Random(7)
    path = tmp_path / f"bad{suffix}"
    for k in range(2 if suffix in (".unv", ".cgns", ".bdf") else 40):
        spoiled = bytearray(content[: choose.randrange(len(content))] if k % 2 else content)
        for _ in range(5 * (len(spoiled) > 0)):
            spoiled[choose.randrange(len(spoiled))] = choose.randrange(256)
        path.write_bytes(bytes(spoiled))
        with suppress(CaseError):
            read_mesh(path)
