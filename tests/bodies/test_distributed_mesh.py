"""Geometries: the contract of named groups, parameters, matching and mirrored meshes."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI
from numpy.typing import NDArray

from fenwear import CaseError, Tribosystem, assemble, load_case, steady
from fenwear.bodies.distributed_mesh import BodyMesh, build_meshes, write_msh
from fenwear.bodies.ready_geometries import meshes_folder
from fenwear.case import Geometry
from fenwear.case.table_parts import Kind
from fenwear.common.parallel import on_root

READY = "punch_on_strip.geo"
SMALL = {"elements_along_contact": 4, "growth": 2.0}


def build(**parameters: float) -> tuple[BodyMesh, BodyMesh]:
    return build_meshes(Geometry(file=READY, parameters=SMALL | parameters), None, MPI.COMM_WORLD)


@pytest.mark.mpi
def test_contract() -> None:
    """The physical groups, each with its own place (3 and 4 of Example 1's geometry)."""
    punch, strip = build()
    assert set(punch.regions) == {"punch_lower", "punch_upper"}
    assert set(strip.regions) == {"strip_body"}
    assert set(punch.curves) == {"punch_contact", "punch_load", "punch_free"}
    assert set(strip.curves) == {"strip_contact", "strip_free", "strip_bottom", "strip_ends"}
    assert punch.points["punch_pin"].tolist() == [[30, 120]]
    for body, area in ((punch, 60 * 100), (strip, 1140 * 100)):
        assert integral(body) == pytest.approx(area, rel=1e-12)
    assert integral(punch, region="punch_lower") == pytest.approx(60 * 20, rel=1e-12)
    lengths = {"punch_contact": 60, "punch_load": 60, "punch_free": 200, "strip_contact": 60,
               "strip_free": 1080, "strip_bottom": 1140, "strip_ends": 200}  # fmt: skip
    for name, length in lengths.items():
        assert integral(punch if name in punch.curves else strip, curve=name) == pytest.approx(length, rel=1e-12)


def test_scaling_factor_of_a_geometry(tmp_path: Path) -> None:
    """It scales all lengths, points and what is written, too; not the geometry that is read next."""
    text = (meshes_folder() / READY).read_text("utf-8")
    (tmp_path / "own.geo").write_text(f"{text}\nMesh.ScalingFactor = 0.5;\n", "utf-8")
    own = Geometry(file="own.geo", parameters=SMALL)
    write_msh(own, tmp_path, tmp_path / "own.msh")
    for geometry in (own, Geometry(file="own.msh")):
        punch, _ = build_meshes(geometry, tmp_path, MPI.COMM_SELF)
        assert integral(punch) == pytest.approx(0.25 * 60 * 100, rel=1e-12)
        assert punch.points["punch_pin"].tolist() == [[15, 60]]
    assert integral(build()[0]) == pytest.approx(60 * 100, rel=1e-12)


@pytest.mark.parametrize("file", sorted(meshes_folder().glob("*.geo")), ids=lambda file: file.stem)
def test_every_ready_geometry(file: Path) -> None:
    """Parameters, one a line; groups of the two bodies and no others, each with a region and a contact."""
    import gmsh

    assert re.search(r"^DefineConstant\[\n( +\w+ = [^,\n]+,?( +// .*)?\n)+\];$", file.read_text("utf-8"), re.MULTILINE)
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(file))
        dim = gmsh.model.getDimension()
        groups = {gmsh.model.getPhysicalName(*group): group[0] for group in gmsh.model.getPhysicalGroups()}
    finally:
        gmsh.finalize()
    assert all(name.startswith(("punch_", "strip_")) for name in groups)
    for body in ("punch", "strip"):
        contacts = [name for name in groups if name.startswith(f"{body}_contact")]
        assert [groups[name] for name in contacts] == [dim - 1] * max(len(contacts), 1)
        assert contacts == [f"{body}_contact"] or f"{body}_contact" not in contacts
        assert dim in [groups[name] for name in groups if name.startswith(body)]


LAYERED = [file for file in sorted(meshes_folder().glob("*.geo")) if "diffusion_" in file.read_text("utf-8")]


@pytest.mark.parametrize("file", LAYERED, ids=lambda file: file.stem)
def test_elements_are_as_high_as_the_layer_that_heats_up(file: Path) -> None:
    """Those of the strip alone, and the bodies are the same; one that is thick enough changes nothing."""
    text = file.read_text("utf-8")
    name = re.search(r"diffusion_\w+", text)[0]  # type: ignore[index]
    dim = 3 if "Physical Volume" in text else 2
    found = [
        build_meshes(Geometry(file=file.name), None, MPI.COMM_SELF, "solid" if dim == 3 else "strain", known={name: d})
        for d in (0.0, 1e9, 1e-3)
    ]
    (punch, strip), unchanged, fine = found
    assert [len(m.mesh.geometry.x) for m in unchanged] == [len(m.mesh.geometry.x) for m in (punch, strip)]
    assert len(fine[0].mesh.geometry.x) == len(punch.mesh.geometry.x)
    assert integral(fine[1]) == pytest.approx(integral(strip), rel=0.01)
    length = np.ptp(punch.mesh.geometry.x[:, 0]) if name == "diffusion_length" else np.pi
    assert top_heights(fine[1]).max() <= np.sqrt(1e-3 * length)


def top_heights(body: BodyMesh) -> NDArray[np.float64]:
    """Return volume over area of the elements at the contact, mm."""
    import ufl
    from dolfinx import fem

    v = ufl.TestFunction(fem.functionspace(body.mesh, ("DG", 0)))
    ds = ufl.Measure("ds", domain=body.mesh, subdomain_data=body.facet_tags)(body.curves[f"{body.name}_contact"])
    volumes, areas = (fem.assemble_vector(fem.form(v * over)).array for over in (ufl.dx(body.mesh), ds))
    return np.asarray(volumes[areas > 0] / areas[areas > 0])


def integral(body: BodyMesh, region: str | None = None, curve: str | None = None) -> float:
    """Return the area of a region or of all, or the length of a curve."""
    import ufl
    from dolfinx import fem

    if curve is not None:
        measure = ufl.Measure("ds", domain=body.mesh, subdomain_data=body.facet_tags)(body.curves[curve])
    else:
        measure = ufl.Measure("dx", domain=body.mesh, subdomain_data=body.cell_tags)
        measure = measure(tuple(body.regions.values()) if region is None else body.regions[region])
    one = fem.Constant(body.mesh, 1.0)
    return body.mesh.comm.allreduce(fem.assemble_scalar(fem.form(one * measure)))


@pytest.mark.parametrize("degree", [1, 3, 8])
@pytest.mark.mpi("3")
def test_facing_nodes_coincide(degree: int) -> None:
    """The two contact surfaces have the same nodes, to the last digits, whatever the partition."""
    system = assemble(
        load_case("example1", [f"geometry.degree={degree}", "geometry.parameters.elements_along_contact=6"])
    )
    pair = system.pair
    assert len(pair.x) == 6 * degree + 1
    np.testing.assert_allclose(pair.punch.x, pair.strip.x, rtol=0, atol=1e-12)
    np.testing.assert_allclose(pair.x, -pair.x[::-1], rtol=0, atol=1e-12)
    np.testing.assert_allclose(pair.initial_gap, 0, atol=1e-12)


def test_meshes_are_mirror_images() -> None:
    """Both bodies' nodes are symmetric about x = 0, so that a symmetric problem stays symmetric."""
    for body in build(pins_on_left_side=1, pin_height_2=55):
        x = body.mesh.geometry.x.round(8) + 0.0
        assert {tuple(p) for p in x} == {tuple(p) for p in x * [-1, 1, 1] + 0.0}


def test_finest_at_the_edges() -> None:
    """edge_grading is the ratio of the element sizes in the middle of the contact and at its edges."""
    system = assemble(load_case("example1", ["geometry.degree=1", "geometry.parameters.edge_grading=7"]))
    sizes = np.diff(system.pair.x)
    assert sizes.max() / sizes.min() == pytest.approx(7, rel=1e-6)
    assert sizes.argmin() in (0, len(sizes) - 1)


@pytest.mark.parametrize(
    ("parameters", "points"),
    [
        ({"pin_height_1": 20}, {(30, 120)}),  # on the line between the materials
        ({"pin_height_1": 100}, {(30, 200)}),  # at the top
        ({"pin_height_1": 80, "pin_height_2": 40, "pins_on_left_side": 1},
         {(30, 140), (30, 180), (-30, 140), (-30, 180)}),
    ],
)  # fmt: skip
def test_pins(parameters: dict[str, float], points: set[tuple[float, float]]) -> None:
    """Examples 1 and 2: pins on one side or both, at any height, in any order."""
    punch, _ = build(**parameters)
    assert {tuple(p) for p in punch.points["punch_pin"]} == points


@pytest.mark.parametrize(
    ("parameters", "expected"),
    [
        (
            {"punch_with": 60},
            "geometry.parameters.punch_with: .* has no such parameter.*growth.*; did you mean .punch_width.",
        ),
        ({"pin_height_1": 101}, "a pin is off the punch"),
        ({"pin_height_1": 0}, "a pin is off the punch"),
        ({"punch_width": -1}, "must be positive"),
        ({"layer_height": 100}, "layer_height"),
        ({"strip_length": 60}, "strip_length"),
        ({"elements_along_contact": 5}, "even"),
        ({"growth": 0}, "growth"),
    ],
)
@pytest.mark.mpi
def test_parameters_refused(parameters: dict[str, float], expected: str) -> None:
    """An unknown or impossible parameter is refused by its name, on all ranks alike."""
    with pytest.raises(CaseError, match=expected):
        build(**parameters)


def test_two_unknown_parameters_at_once() -> None:
    """Every unknown parameter is named."""
    with pytest.raises(CaseError) as refused:
        build(height=1, width=2)
    assert [p.key for p in refused.value.problems] == ["geometry.parameters.height", "geometry.parameters.width"]


def refuse(file: Path, expected: str, **parameters: float) -> None:
    with pytest.raises(CaseError, match=expected):
        build_meshes(Geometry(file=file.name, parameters=parameters), file.parent, MPI.COMM_WORLD)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('Physical Curve("punch_contact")', 'Physical Curve("punch_touch")', "geometry.groups.punch_contact"),
        ('Physical Surface("strip_body")', 'Physical Surface("body")', "geometry.groups.strip_body"),
        ("Recombine Surface{:};", "Recombine Surface{strip[]};\nRecombine Surface{lower[0]};", "the punch mixes"),
        ("half_width = punch_width / 2;", "half_width = ;", "gmsh on changed.geo"),
    ],
)
def test_bad_geo(old: str, new: str, expected: str, tmp_path: Path) -> None:
    """A geometry that breaks the contract, or is none, is refused in words."""
    text = (meshes_folder() / READY).read_text("utf-8")
    assert old in text
    (tmp_path / "changed.geo").write_text(text.replace(old, new), "utf-8")
    refuse(tmp_path / "changed.geo", expected)


def test_bad_files(tmp_path: Path) -> None:
    """No file, no mesh, no parameters of a mesh."""
    refuse(tmp_path / "nowhere.geo", f"no file 'nowhere.geo'; ready ones are .*{READY}")
    (tmp_path / "mesh.stl").touch()
    refuse(tmp_path / "mesh.stl", "expected a file that ends in")
    (tmp_path / "nonsense.msh").write_text("$Nonsense\n")
    refuse(tmp_path / "nonsense.msh", "nonsense.msh")
    (tmp_path / "binary.msh").write_bytes(bytes(range(256)))
    refuse(tmp_path / "binary.msh", "binary.msh")
    refuse(tmp_path / "nonsense.msh", "geometry.parameters: a .msh file has none", punch_width=60)
    (tmp_path / "nonsense.geo").write_text("a b c d;\n e f;\n")
    refuse(tmp_path / "nonsense.geo", "gmsh on nonsense.geo: .*syntax error")
    build()  # a bad file leaves nothing behind in gmsh's parser


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        (["punch.supports.0.on='punch_pine'"], r"punch\.supports\.0\.on: no physical curve or point 'punch_pine'"),
        (["strip.supports.1.on='punch_pin'"], r"strip\.supports\.1\.on: "),
        (["punch.loads.0.on='lid'"], r"punch\.loads\.0\.on: no physical curve 'lid' .*punch_load"),
        (["punch.regions.punch_middle='steel'"], r"punch\.regions\.punch_middle: no physical surface"),
        (["strip.regions={strip_soil='steel'}"], r"strip\.regions: no material for .*'strip_body'"),
        (["punch.supports.0={at=[31, 120], fix=['x']}"], r"punch\.supports\.0\.at: .*31, 120"),
        (["punch.supports=[]"], r"punch\.supports: the punch is free to slide along x"),
        (["punch.supports.0.fix=['z']"], r"punch\.supports: the punch is free to slide along x"),
    ],
)
@pytest.mark.mpi
def test_case_that_does_not_fit_the_geometry(settings: list[str], expected: str) -> None:
    """Missing groups, pins off the body, bodies that slide away: the key is named, on all ranks alike."""
    with pytest.raises(CaseError, match=expected):
        assemble(load_case("example1", ["geometry.parameters.elements_along_contact=4", *settings]))


def test_surfaces_that_do_not_face(tmp_path: Path) -> None:
    """A punch beside the strip, above it, or upside down does not touch it."""
    text = (meshes_folder() / READY).read_text("utf-8")
    tail = 'Physical Curve("strip_contact") = strip_contact[];'
    for number, (new, expected) in enumerate(
        [
            ('Physical Curve("strip_contact") = {strip_contact[0]};', "punch_contact spans"),
            (
                'Physical Curve("strip_contact") = {bottom_lines[0], bottom_lines[#distances[] - 1]};',
                "do not point at each other",
            ),
            ('Physical Curve("strip_contact") = {strip_contact[], strip_ends[]};', "strip_contact .* share"),
            (tail + " Translate{0, 5, 0}{Surface{lower[], upper[]};}", "5 mm above"),
            (tail + " Symmetry{0, 1, 0, -100}{Surface{lower[], upper[], strip[]};}", "the punch lies below the strip"),
        ]
    ):
        file = tmp_path / f"{number}.geo"
        file.write_text(text.replace(tail, new).replace("= bottom_lines[];", "= {bottom_lines[1]};"), "utf-8")
        case = load_case("example1").model_copy(update={"geometry": Geometry(file=file.name)}).at(tmp_path)
        with pytest.raises(CaseError, match=expected):
            assemble(case)


@pytest.mark.mpi
def test_own_msh_gives_the_same_answer(assembled: Callable[..., Tribosystem], tmp_path: Path) -> None:
    """A mesh written by fenwear and read back as the case's own geometry changes nothing."""
    comm = MPI.COMM_WORLD
    folder = tmp_path
    geo = assembled("example1", "geometry.degree=2")
    on_root(comm, lambda: write_msh(geo.case.geometry, None, folder / "own.msh"))
    case = geo.case.model_copy(update={"geometry": Geometry(file="own.msh", degree=2)}).at(folder)
    msh = assemble(case)
    np.testing.assert_allclose(msh.pair.x, geo.pair.x, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(steady(msh).pressure, steady(geo).pressure, rtol=0, atol=1e-7)


def test_msh_that_cannot_be_written(tmp_path: Path) -> None:
    """The path is named."""
    with pytest.raises(CaseError, match=r"nowhere.*cannot be written"):
        write_msh(Geometry(parameters=SMALL), None, tmp_path / "nowhere" / "mesh.msh")


SOLID = {"width": 2.0, "depth": 1.5, "punch_height": 0.5, "margin_x": 0.5, "across_x": 2, "across_y": 3}


@pytest.mark.parametrize("tetrahedra", [0, 1])
@pytest.mark.mpi
def test_contract_of_solids(tetrahedra: int) -> None:
    """Volumes are regions, surfaces the groups: each with its own size, on any number of ranks."""
    geometry = Geometry(file="solid_blocks.geo", parameters=SOLID | {"punch_tetrahedra": tetrahedra})
    punch, strip = build_meshes(geometry, None, MPI.COMM_WORLD, "solid")
    assert punch.mesh.geometry.dim == strip.mesh.topology.dim == 3
    assert set(punch.regions) == {"punch_body"}
    assert integral(punch) == pytest.approx(2 * 1.5 * 0.5, rel=1e-12)
    assert integral(strip) == pytest.approx(3 * 1.5, rel=1e-12)
    areas = {"punch_contact": 3, "punch_far": 3, "punch_sides": 1.5, "punch_ends": 2, "strip_contact": 4.5}
    for name, area in areas.items():
        assert integral(punch if name in punch.curves else strip, curve=name) == pytest.approx(area, rel=1e-12)


def test_own_msh_of_a_solid(tmp_path: Path) -> None:
    """A .msh of volumes gives the same bodies as its .geo."""
    geometry = Geometry(file="solid_blocks.geo", parameters=SOLID)
    write_msh(geometry, None, tmp_path / "own.msh", "solid")
    punch, strip = build_meshes(Geometry(file="own.msh"), tmp_path, MPI.COMM_SELF, "solid")
    assert integral(punch) + integral(strip) == pytest.approx(1.5 + 4.5, rel=1e-12)


@pytest.mark.parametrize(
    ("change", "kind", "expected"),
    [
        (("Recombine Surface{fx[], fy[], fz[]};", "Recombine Surface{fx[], fy[]};"), "solid", "wedges"),
        (("Physical Volume(\"punch_body\")", "Physical Volume(\"body\")"), "solid", "geometry.groups.punch_body"),
        (("Physical Surface(\"strip_contact\")", "Physical Surface(\"strip_top\")"), "solid", "groups.strip_contact"),
        (("Physical Volume", "Physical Volume"), "stress", "expected model.kind = 'solid'"),
    ],
)  # fmt: skip
def test_refused_solids(change: tuple[str, str], kind: str, expected: str, tmp_path: Path) -> None:
    """What is wrong with groups and elements is told in words."""
    text = (meshes_folder() / "solid_blocks.geo").read_text("utf-8")
    assert change[0] in text
    (tmp_path / "own.geo").write_text(text.replace(*change), "utf-8")
    with pytest.raises(CaseError) as refused:
        build_meshes(Geometry(file="own.geo"), tmp_path, MPI.COMM_SELF, kind)  # type: ignore[arg-type]
    assert expected in str(refused.value)


def test_flat_volumes_are_refused(tmp_path: Path) -> None:
    """Elements whose corners have slipped into one plane are counted."""
    write_msh(Geometry(file="solid_blocks.geo", parameters={"punch_layers": 1}), None, tmp_path / "own.msh", "solid")
    lines = (tmp_path / "own.msh").read_text("utf-8").split("\n")
    corner = lines.index("0.5 0.5 1")
    lines[corner] = "0.5 0.5 0"  # the upper corner onto the lower one
    (tmp_path / "own.msh").write_text("\n".join(lines), "utf-8")
    with pytest.raises(CaseError, match="punch_body: degenerate or twisted: element"):
        build_meshes(Geometry(file="own.msh"), tmp_path, MPI.COMM_SELF, "solid")


def test_a_ring_across_its_axis_is_refused() -> None:
    """In an axisymmetric model x is the radius."""
    with pytest.raises(CaseError, match="x is the radius"):
        build_meshes(Geometry(file="blocks.geo"), None, MPI.COMM_SELF, "axisymmetric")


def test_a_large_geometry_leaves_small_ones_as_they_are() -> None:
    """Points 10 nm apart are two, whatever this process has read before: gmsh would compare them by its size."""

    def read(file: str, kind: Kind, **parameters: float) -> None:
        build_meshes(Geometry(file=file, parameters=parameters), None, MPI.COMM_SELF, kind)

    with pytest.raises(CaseError, match="overlap must not be negative"):
        read("punch_on_strip.geo", "stress", overlap=1e9)
    read("pin_on_disc.geo", "solid", across=2, around=2, outer=1, pin_layers=1, disc_layers=1)
    read("two_bushings.geo", "solid", clearance=1e-5, along=2, between_elements=2, overhang_elements=1, fine_elements=4)


@pytest.mark.parametrize(
    ("setting", "told"),
    [
        ("geometry.file=" + 300 * "x" + ".geo", "geometry.file: no file 'xxx"),
        ("geometry.parameters.elements_along_contact=1e9", "expected at most 1,000,000 elements, got 1e[+]09"),
    ],
)
def test_what_no_file_and_no_mesh_can_be(setting: str, told: str) -> None:
    """A name that is too long was an OSError, and gmsh came to no end."""
    with pytest.raises(CaseError, match=told):
        build_meshes(load_case("example1", [setting]).geometry, None, MPI.COMM_WORLD)
