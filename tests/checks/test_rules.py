"""What is told of states that were computed as asked but can hardly be."""

from __future__ import annotations

import json
import re
import time
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import basix.ufl
import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx.mesh import CellType, create_mesh, create_rectangle
from markupsafe import escape
from mpi4py import MPI

from fenwear import Case, Tribosystem, assemble, critical_speed, load_case, make_case, march, steady
from fenwear.bodies.distributed_mesh import own_mesh
from fenwear.bodies.elastic_material import Isotropic, lame
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.ready_geometries import meshes_folder
from fenwear.case import Body, Support, changed_case, plausibility_warnings
from fenwear.case.templates import write_case_of
from fenwear.checks import (
    RULES,
    Seen,
    StateMonitor,
    elastic_way,
)
from fenwear.checks.elastic_limits import strain_and_rotation
from fenwear.checks.mesh_fineness import few, heated_layer, turned
from fenwear.checks.surface_ends import contact_chamfers, contact_limits, thickness
from fenwear.common.errors import MeshQualityError, TimeUpError
from fenwear.common.signals import time_limit
from fenwear.report.page import page
from fenwear.results.summary import net_of
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import march_within
from fenwear.steps.stick_setup import partial_slip_problem
from fenwear.steps.stick_state import TimeStepRecords
from fenwear.studies.run import position_warnings, run_case
from fenwear.system import place_case, regridded, with_case, with_reduced_heat
from fenwear_verify.solid import STEEL, describe

Assembled = Callable[..., Tribosystem]
FLAT = ("geometry.degree=2", "geometry.parameters.elements_along_contact=8")
CYLINDER = ("geometry.parameters.elements_along_contact=16", "motion.positions=3", "contact.friction=0")


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("name", "settings", "ends"),
    [
        ("example1", FLAT, []),  # the corners of a flat punch
        ("rounded-punch", (), []),  # its rounded edges end at the sides
        ("fretting", CYLINDER, [-0.3, 0.3]),  # an arc that was tagged too short
        ("ring-on-ring", (), []),
    ],
)
def test_where_bodies_go_on(assembled: Assembled, name: str, settings: tuple[str, ...], ends: list[float]) -> None:
    """An edge ends a contact, an arc that was tagged too short does not."""
    limits = contact_limits(assembled(name, *settings))
    np.testing.assert_allclose(limits.x[limits.clips, 0], ends, rtol=1e-9)


def test_width_by_area(assembled: Assembled) -> None:
    """Reference: A = 4 a³ / (3 2 R) of a parabola worn flat, and Hertz's a² = 4 F R / (pi E*)."""
    limits = contact_limits(assembled("fretting", *CYLINDER))
    for a in (0.5, 0.7):
        assert limits.width_needed(4 * a**3 / (3 * 12), 18.5) == pytest.approx(2 * a, rel=0.01)
    modulus, load = 2e5 / (2 * (1 - 0.09)), 6000.0
    assert limits.width_needed(0.0, load) == pytest.approx(2 * np.sqrt(4 * load * 6 / (np.pi * modulus)), rel=0.02)
    ring = replace(limits, around=7.0)  # volumes and loads of whole rings over their circumference
    assert ring.width_needed(7e-3, 70.0) == limits.width_needed(1e-3, 10.0)


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("name", "settings", "clips"),
    [
        ("ball-on-flat", (), "all around"),
        ("pin-on-disc", (), "nowhere"),  # the pin's edge, on a disc that goes on
        ("brake-pad", ("geometry.parameters.margin_angle=0",), "nowhere"),  # edges of both
    ],
)
def test_rims(name: str, settings: tuple[str, ...], clips: str) -> None:
    """A ball goes on beyond the square that is tagged; an edge ends a contact."""
    placed = place_case(load_case(name, ["geometry.degree=2", *settings]))
    rim = contact_limits(placed)
    if clips == "nowhere":
        assert not rim.clips.any()
        return
    x = placed.pair.punch.x
    np.testing.assert_array_equal(rim.clips, np.abs(x[:, :2]).max(axis=1) > 0.2 - 1e-9)
    assert rim.width == pytest.approx(0.4, rel=1e-9)
    np.testing.assert_allclose(rim.curvatures, 1 / 5, rtol=2e-3)


def test_a_ball_that_needs_more(assembled: Assembled) -> None:
    """Reference: Hertz's a³ = 3 F R / (4 E*), and the volume pi a⁴ / (4 R) of a cap worn flat."""
    system = assembled("ball-on-flat", "geometry.degree=1", "punch.loads.0.force=[0, 0, -600]")
    rim = contact_limits(system)
    modulus = 210e3 / (2 * (1 - 0.09))
    assert rim.width_needed(0.0, 600.0) == pytest.approx(2 * (0.75 * 600 * 5 / modulus) ** (1 / 3), rel=2e-3)
    assert rim.width_needed(np.pi * 0.4**4 / (4 * 5), 0.0) == pytest.approx(0.8, rel=2e-3)
    warning = RULES["clipped"].text(Seen.of_start(system))
    assert re.search(r"at \d+ nodes of its rim, \((0\.2, 0|0, 0\.2), 0\.004\d*\) mm among them", warning)
    assert "about 0.538 mm" in warning
    assert "it has 0.4 mm. Set `geometry.parameters.contact_width`" in warning
    inside = assembled("ball-on-flat", "geometry.degree=1", "punch.loads.0.force=[0, 0, -20]")
    assert RULES["clipped"].text(Seen.of_start(inside)) == ""


def half_tagged(folder: Path) -> Path:
    """Return a case of a flat punch whose left half alone is tagged as its contact."""
    text = (meshes_folder() / "punch_on_strip.geo").read_text("utf-8")
    old = 'Physical Curve("punch_contact") = {across[0], across[1]};'
    assert old in text
    new = 'Physical Curve("punch_contact") = {across[0]}; Physical Curve("punch_rest") = {across[1]};'
    (folder / "half.geo").write_text(text.replace(old, new), "utf-8")
    pins = "parameters = {pin_height_1 = 40, pin_height_2 = 80, pins_on_left_side = 1}"  # it can only go down
    (folder / "half.toml").write_text(f'base = "example2"\n[geometry]\nfile = "half.geo"\n{pins}\n', "utf-8")
    return folder / "half.toml"


def run(folder: Path, name: str | Path, *settings: str) -> tuple[dict[str, Any], list[str]]:
    said: list[str] = []
    summary, _ = run_case(load_case(name, settings), "run", folder / "run", said.append)
    assert json.loads((folder / "run" / "summary.json").read_text())["warnings"] == summary["warnings"]
    return summary, said


@pytest.mark.slow
def test_clipped_contact_is_told(tmp_path: Path) -> None:
    """A scar that outgrows its surface: in the log when it happens, in summary and report, with the width it needs."""
    settings = (*CYLINDER, "wear.punch.coefficient=2e-6", "wear.strip.coefficient=1e-9", "run.jump_tolerance=0.2",
                "output.report=false", "output.uncertainty=false")  # fmt: skip
    narrow, said = run(tmp_path, "fretting", *settings, "run.half_cycles=4000", "geometry.parameters.contact_width=0.4")
    (warning,) = [text for text in narrow["warnings"] if "clipped" in text]
    assert "x = -0.2 and 0.2 mm" in warning
    assert "geometry.parameters.contact_width" in warning
    assert any("contact is clipped in half-cycle" in text for text in said)
    assert str(escape(warning)) in page(tmp_path / "run")
    needed = float(warning.partition("a width of about ")[2].partition(" mm")[0])
    (tmp_path / "wide").mkdir()
    wide, _ = run(tmp_path / "wide", "fretting", *settings, "run.half_cycles=4000",
                  f"geometry.parameters.contact_width={1.1 * needed}")  # fmt: skip
    assert not [text for text in wide["warnings"] if "clipped" in text]  # the width that it names is enough
    assert wide["rightward"]["contact_width_mm"] == pytest.approx(needed, rel=0.15)  # and not far from what is used


@pytest.mark.parametrize("name", ["example1", "example2"])
def test_a_corner_is_no_clip(tmp_path: Path, name: str) -> None:
    """Contact that ends at the corners of the punch."""
    summary, _ = run(tmp_path, name, *FLAT, "run.half_cycles=2", "output.report=false", "output.uncertainty=false")
    assert summary["warnings"] == []


@pytest.mark.parametrize(("size", "clipped"), [("0.1 mm", True), ("0.3 mm", False)])
def test_a_contact_grid_may_be_too_small(size: str, clipped: bool, assembled: Assembled) -> None:
    """Contact at the rim of a grid within the surface is told, with Hertz's width, as it is at the rim of a mesh."""
    grid = f"grid={{nodes=17, size=['{size}', '{size}']}}"
    bodies = ("punch.operator='half-space'", "strip.operator='half-space'", "motion.positions=2")
    coarse = ("geometry.parameters.core=0", "geometry.parameters.core_elements=0", "geometry.parameters.across=4")
    system = assembled("ball-on-flat", grid, *bodies, *coarse)
    found = RULES["clipped"].text(Seen.of_start(system))
    assert bool(found) == clipped
    if clipped:
        width = 2 * (3 * 20 * 5 / (4 * 210e3 / (2 * (1 - 0.3**2)))) ** (1 / 3)
        assert f"about {width:.2g}" in found
        assert "`grid.size`" in found


@pytest.mark.parametrize("grid", ["nodes=9", "across=8"])
def test_a_contact_grid_over_the_whole_surface(grid: str, assembled: Assembled) -> None:
    """The ball goes on beyond what is meshed for its contact: a scar that comes there is clipped, as on the mesh."""
    bodies = ("punch.operator='half-space'", "strip.operator='half-space'", "motion.positions=2")
    coarse = ("geometry.parameters.core=0", "geometry.parameters.core_elements=0", "geometry.parameters.across=4")
    system = assembled("ball-on-flat", f"grid={{{grid}}}", *bodies, *coarse)
    limits = contact_limits(system)
    if "across" in grid:
        assert not limits.clips.any()  # it can still grow
        whole = system.bodies.punch.reach
        assert whole is not None
        system = regridded(system, whole.grid)
        limits = contact_limits(system)
    assert not limits.of_grid
    found = system.pair.punch.grid
    assert found is not None
    outer = ((found.places == 0) | (found.places == np.array(found.counts) - 1)).any(axis=1)
    np.testing.assert_array_equal(limits.clips, outer)
    text = RULES["clipped"].text(Seen.of_pressure(system, outer[None].astype(float), "then"))
    assert "end of the meshed contact surface at" in text


def test_half_a_flat_is_clipped(assembled: Assembled, tmp_path: Path) -> None:
    """The same punch whose tag ends in the middle of its flat: told before anything is computed and by `steady`."""
    system = assembled(half_tagged(tmp_path), *FLAT)
    (warning,) = Seen.of_start(system).warnings()
    assert "at x = 0 mm" in warning
    assert "Widen `punch_contact`" in warning
    (warning,) = Seen.of_steady(system, steady(system)).warnings()
    assert "at x = 0 mm" in warning
    assert "as wide as that surface, 30 mm" in warning


def test_steady_scar_of_a_cylinder(assembled: Assembled) -> None:
    """A cylinder wears for ever wider: the width of the state is that of the mesh, and is called so."""
    tables = tomllib.loads(load_case("fretting", CYLINDER).to_toml())
    del tables["wear"]["strip"]
    tables["motion"]["positions"] = 1
    system = assemble(make_case(tables))
    state = steady(system)
    assert state.contact_width.max() == pytest.approx(0.6, rel=1e-6)
    (warning,) = Seen.of_steady(system, state).warnings()
    assert "as wide as that surface, 0.6 mm" in warning


def test_pressed_beyond_the_hardness() -> None:
    """The mean pressure against the hardness of either body, and against a tenth of Young's modulus."""
    tables = tomllib.loads(load_case("example1", FLAT).to_toml())
    tables["wear"]["punch"] = {"archard": 1e-5, "hardness": "1.2 GPa"}
    hard, plain = place_case(make_case(tables)), place_case(load_case("example1", FLAT))

    def told(system: Tribosystem, pressure: float, name: str) -> str:
        even = np.full((1, len(system.pair.weights)), pressure)
        return RULES[name].text(Seen.of_pressure(system, even, "then"))

    assert told(hard, 1199.0, "hardness") == ""
    assert told(hard, 1201.0, "hardness").startswith("wear.punch.hardness: ")
    assert "1,201 MPa then, above the hardness of 1,200 MPa" in told(hard, 1201.0, "hardness")
    assert told(plain, 1.29e4, "strength") == ""
    assert "Young's modulus of composite" in told(plain, 1.31e4, "strength")


def test_a_run_beyond_the_hardness(tmp_path: Path) -> None:
    """In the summary of a run; 16.7 MPa on 10."""
    tables = tomllib.loads(
        load_case("example2", [*FLAT, "run.half_cycles=2", "output.report=false", "output.uncertainty=false"]).to_toml()
    )
    tables["wear"]["punch"] = {"archard": 1e-9, "hardness": "10 MPa"}
    summary, _ = run_case(make_case(tables), "run", tmp_path / "run", lambda message: None)
    (warning,) = summary["warnings"]
    assert warning.startswith("wear.punch.hardness: ")
    assert "reaches 16.67 MPa in half-cycle 1, above the hardness of 10 MPa" in warning


@pytest.mark.parametrize(("name", "factor"), [("fretting-partial-slip", 4.0), ("ball-on-flat", 4.7)])
def test_shakedown(name: str, factor: float, assembled: Assembled) -> None:
    """Told beyond 4 k in line contact and 4.7 k in point contact, k = Y / sqrt(3), without a hardness alone."""
    small = {"fretting-partial-slip": "geometry.parameters.elements_along_contact=8"}.get(name, "geometry.degree=1")
    settings = [small, "geometry.follow_wear=never", "contact.law='gross-sliding'"]
    system = assembled(name, *settings, *(["stick={}"] if name.startswith("fretting") else []))
    pressure = system.phase_contact((0,)).solve(system.gap(0, system.unworn())).pressure.max()
    material = next(iter(system.case.used_materials))
    for share, told in ((1.01, False), (0.99, True)):
        yields = f"materials.{material}.yield_stress={share * float(pressure) / factor * 3**0.5!r}"
        again = with_case(system, changed_case(system.case, yields))
        texts = [text for text in Seen.of_start(again).warnings() if "shakedown" in text]
        assert bool(texts) == told
        if told:
            assert f"{factor:g} k by materials.{material}.yield_stress" in texts[0]
            capped = with_case(again, changed_case(again.case, f"contact.hardness='{10 * float(pressure)!r} MPa'"))
            assert not [text for text in Seen.of_start(capped).warnings() if "shakedown" in text]


def test_molten(assembled: Assembled) -> None:
    """16,269 K ended with status 0 and no word."""
    system = assembled("example1", *FLAT)
    seen = Seen.of_system(system)
    assert RULES["hot"].text(replace(seen, temperature=np.array([1999.0]))) == ""
    assert re.match(r"heat: .*\b16,270 K", RULES["hot"].text(replace(seen, temperature=np.array([16269.0]))))


def test_a_mesh_is_not_moved_after_the_last_half_cycle(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All half-cycles done is a success, though the next one would have no elements left."""
    monkeypatch.setattr("fenwear.bodies.worn_mesh.LEAST", 1.1)  # no motion leaves so much
    settings = (*FLAT, "geometry.follow_wear=1e-9", "output.report=false", "output.uncertainty=false")
    summary, _ = run(tmp_path, "example2", *settings, "run.half_cycles=1")
    assert summary["stop"] == "all half-cycles done"
    with pytest.raises(MeshQualityError, match="used up the elements"):
        run_case(load_case("example2", [*settings, "run.half_cycles=2"]), "run", tmp_path / "two", lambda message: None)


def test_jumps_end_with_whole_cycles(tmp_path: Path) -> None:
    """An odd number of half-cycles was said to have ended as periodic."""
    settings = (*FLAT, "run.half_cycles=5", "run.integration=jump", "output.report=false", "output.uncertainty=false")
    summary, _ = run(tmp_path, "example2", *settings)
    assert (summary["stop"], summary["half_cycles"]) == ("all half-cycles done", 4)


FRETTING = ("geometry.parameters.elements_along_contact=30", "motion.positions=1")


def pressed_by(assembled: Assembled, load: float, amplitude: float) -> Tribosystem:
    """Return the fretting case under a load in N, with an amplitude in µm."""
    force = f'punch.loads=[{{on="punch_top", force=["0 N", "-{load} N"]}}]'
    return assembled("fretting", FRETTING[0], "motion.positions=5", force, f"motion.amplitude={amplitude} um")


def test_elastic_way_against_stick(assembled: Assembled) -> None:
    """Reference: with stick the work of a cycle is 4 mu P (A - way), the way that the bodies follow friction.

    It is an estimate by the mean of a half-plane and a block.
    """
    load, amplitude = 120.0, 20.0
    settings = (f"motion.amplitude={amplitude} um", *FRETTING)
    problem = partial_slip_problem(load_case("fretting-partial-slip", settings))
    work = TimeStepRecords.joined(problem.cycle(problem.beginning())[1]).energy(problem.weights)
    way = 1e-3 * amplitude - work / (4 * 0.9 * load)
    assert elastic_way(pressed_by(assembled, load, amplitude)) == pytest.approx(way, rel=0.2)


def test_stroke_taken_up(assembled: Assembled) -> None:
    """The case itself slides as a whole: 3 %; a stroke that the bodies take up in part, or wholly, is told."""
    assert Seen.of_system(pressed_by(assembled, 18.5, 25)).warnings("system") == []
    assert Seen.of_system(pressed_by(assembled, 18.5, 10)).warnings("system") == []
    (text,) = Seen.of_system(pressed_by(assembled, 18.5, 5)).warnings("system")
    assert 'contact.law = "coulomb"' in text
    assert "amplitude of 5 µm" in text
    assert text in Seen.of_start(pressed_by(assembled, 18.5, 5)).warnings()
    (text,) = Seen.of_system(pressed_by(assembled, 120, 3)).warnings("system")
    share = float(text.split(" % of the amplitude")[0].split()[-1])
    assert share > 100


@pytest.mark.parametrize("name", ["example1", "rounded-punch"])
def test_long_strokes_are_not_told(assembled: Assembled, name: str) -> None:
    """Strokes of millimetres."""
    assert Seen.of_system(assembled(name, *(FLAT if name == "example1" else ()))).warnings("system") == []


def test_frictionless_stroke_is_not_told(assembled: Assembled) -> None:
    """Nothing follows where there is no friction."""
    assert Seen.of_system(assembled("fretting", *CYLINDER, "motion.amplitude=1 um")).warnings("system") == []


CHAMFERED = """
SetFactory("OpenCASCADE");
rise = {rise}; w = {width};
Point(1) = {{-1.4, 0, 0}}; Point(2) = {{1.4, 0, 0}}; Point(3) = {{w, rise, 0}}; Point(4) = {{w, 4, 0}};
Point(5) = {{-w, 4, 0}}; Point(6) = {{-w, rise, 0}};
Line(1) = {{1, 2}}; Line(2) = {{2, 3}}; Line(3) = {{3, 4}}; Line(4) = {{4, 5}}; Line(5) = {{5, 6}}; Line(6) = {{6, 1}};
Curve Loop(1) = {{1, 2, 3, 4, 5, 6}}; Plane Surface(1) = {{1}};
Point(11) = {{-4, -2, 0}}; Point(12) = {{4, -2, 0}}; Point(13) = {{4, 0, 0}}; Point(14) = {{w, 0, 0}};
Point(15) = {{-w, 0, 0}}; Point(16) = {{-4, 0, 0}};
Line(11) = {{11, 12}}; Line(12) = {{12, 13}}; Line(13) = {{13, 14}}; Line(14) = {{14, 15}}; Line(15) = {{15, 16}};
Line(16) = {{16, 11}};
Curve Loop(2) = {{11, 12, 13, 14, 15, 16}}; Plane Surface(2) = {{2}};
Mesh.MeshSizeMax = 0.7;
"""
IN_PLANE = """
Physical Surface("punch_body") = {{1}}; Physical Surface("strip_body") = {{2}};
Physical Curve("punch_contact") = {{{tagged}}}; Physical Curve("strip_contact") = {{14}};
Physical Curve("punch_top") = {{4}}; Physical Curve("strip_bottom") = {{11}};
"""
IN_SPACE = """
Rotate {{{{1, 0, 0}}, {{0, 0, 0}}, Pi/2}} {{ Surface{{1, 2}}; }}
punch[] = Extrude {{0, 2, 0}} {{ Surface{{1}}; }};
strip[] = Extrude {{0, 2, 0}} {{ Surface{{2}}; }};
e = 1e-3; flat[] = Surface In BoundingBox{{-1.4 - e, -e, -e, 1.4 + e, 2 + e, e}};
below[] = Surface In BoundingBox{{-w - e, -e, -e, w + e, 2 + e, e}}; below[] -= flat[];
cut[] = Surface In BoundingBox{{-w - e, -e, -e, w + e, 2 + e, rise + e}}; cut[] -= {{flat[], below[]}};
Physical Volume("punch_body") = punch[1]; Physical Volume("strip_body") = strip[1];
Physical Surface("punch_contact") = {{flat[]{tagged}}}; Physical Surface("strip_contact") = below[];
Physical Surface("punch_top") = Surface In BoundingBox{{-w - e, -e, 4 - e, w + e, 2 + e, 4 + e}};
Physical Surface("strip_bottom") = Surface In BoundingBox{{-9, -e, -2 - e, 9, 2 + e, -2 + e}};
"""


def chamfered(folder: Path, kind: str, rise: float, width: float = 2.0, *, tagged: bool = False) -> Tribosystem:
    """Return a flat punch 2.8 mm wide with chamfers of this rise and (width - 1.4) mm of run, without elasticity."""
    text = CHAMFERED + (IN_SPACE if kind == "solid" else IN_PLANE)
    chosen = {("solid", True): ", cut[]", ("solid", False): "", ("plane", True): "6, 1, 2", ("plane", False): "1"}
    (folder / "punch.geo").write_text(text.format(rise=rise, width=width, tagged=chosen[kind, tagged]), "utf-8")
    fixed = ["x", "y", "z"] if kind == "solid" else ["x", "z"]
    case = {
        "geometry": {"file": str(folder / "punch.geo"), "degree": 2},
        "model": {"kind": kind},
        "materials": {"steel": {"young": 2e5, "poisson": 0.3}},
        "punch": {
            "regions": {"punch_body": "steel"},
            "supports": [{"on": "punch_top", "fix": fixed[:-1]}],
            "loads": [{"on": "punch_top", "force": [*[0] * (len(fixed) - 1), -10]}],
        },
        "strip": {"regions": {"strip_body": "steel"}, "supports": [{"on": "strip_bottom", "fix": fixed}]},
        "contact": {"friction": 0.1},
        "wear": {"punch": {"coefficient": 1e-8}},
        "motion": {"kind": "reciprocating", "amplitude": 1, "period": 1},
        "run": {"half_cycles": 1},
    }
    return place_case(make_case(case))


@pytest.mark.parametrize("kind", ["plane", "solid"])
@pytest.mark.parametrize(("rise", "wider"), [(0.6, 0.1), (0.3, 0.2), (1.2, 0.05)])
def test_a_chamfer_that_wear_reaches(tmp_path: Path, kind: str, rise: float, wider: float) -> None:
    """Reference: 0.05 mm off a flat beside a chamfer of rise over 0.6 mm makes it 0.05 * 0.6 / rise wider a side."""
    system = chamfered(tmp_path, kind, rise)
    chamfers, worn = contact_chamfers(system), system.unworn()
    assert chamfers.widened(system, worn) == 0
    worn = replace(worn, punch=np.full_like(worn.punch, 0.05))
    assert chamfers.widened(system, worn) == pytest.approx(wider, rel=1e-6)
    text = RULES["chamfer"].text(replace(Seen.of_system(system), end=worn, kind="run"))
    assert ("" if wider < 0.02 * 2.8 else f"about {wider:.2g} mm wider than the 2.8") in text
    assert bool(text) == (wider > 0.02 * 2.8)


@pytest.mark.parametrize("kind", ["plane", "solid"])
def test_what_is_no_chamfer(tmp_path: Path, kind: str) -> None:
    """One that is tagged, and sides that are nearly upright."""
    assert not contact_chamfers(chamfered(tmp_path, kind, 0.3, tagged=True)).cotangent.any()
    assert not contact_chamfers(chamfered(tmp_path, kind, 3.9, 1.5)).cotangent.any()


def test_a_body_worn_through_is_told(assembled: Assembled) -> None:
    """At 10 mm of a ring 10 mm high, by its volume in half-cycle 50; its meshes do not follow."""
    settings = ("geometry.parameters.across=4", "geometry.degree=2", "wear.punch.coefficient=1e-3")
    system = assembled("ring-on-ring", *settings, "geometry.follow_wear=never")
    area = system.bodies.punch.thickness * system.bodies.punch.surface.weights.sum()
    (block,) = march(system, 60, implicit=True)
    first = int(block.half_cycle[block.totals.of("volume_punch") >= 10 * area][0])
    watch = StateMonitor(system)
    (text,) = watch.see(block)
    assert f"the punch is worn through in half-cycle {first}: it has lost 10 mm where it was 10 mm thick" in text
    assert watch.warnings() == [text]
    assert not StateMonitor(system).see(next(march(system, first - 1, implicit=True)))


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("name", "punch", "strip"),
    [
        ("block-on-ring", 10.16, 10.0),  # a ring of 20 mm whose inner 10 mm are left out
        ("ball-on-flat", 0.8, 1.6),  # at its lowest point
    ],
)
def test_thickness(name: str, punch: float, strip: float) -> None:
    """From the contact surface to where the normal leaves the body, also along the side of an upright pin."""
    bodies = place_case(load_case(name)).bodies
    assert thickness(bodies.punch).max() == pytest.approx(punch, rel=1e-9)
    np.testing.assert_allclose(thickness(bodies.strip), strip, rtol=1e-5)


GROWING = ["block-on-ring", "fretting", "rounded-punch", "block-on-ring.toml", "bushing.toml", "cylinder-on-flat.toml",
           "fretting.toml"]  # fmt: skip
SOLIDS = ["ball-on-flat", "brake-pad", "pin-on-disc", "ball-on-flat.toml", "pin-on-disc.toml"]


def case_of(name: str, folder: Path) -> Case:
    """Return a built-in case, or that of the template of such a name."""
    if not name.endswith(".toml"):
        return load_case(name)
    write_case_of(name.removesuffix(".toml"), folder / name)
    return load_case(folder / name)


@pytest.mark.parametrize("name", GROWING)
def test_cases_and_templates_warn_of_nothing(name: str, tmp_path: Path) -> None:
    """What `check` would say of them as they stand."""
    system = assemble(case_of(name, tmp_path), heat="none")
    assert [
        *position_warnings(system),
        *system.bodies.remarks,
        *plausibility_warnings(system.case),
        *Seen.of_start(system).warnings(),
    ] == []


@pytest.mark.parametrize("name", SOLIDS)
def test_solids_warn_of_nothing(name: str, tmp_path: Path) -> None:
    """Without solving for their contact: that of balls is as wide as Hertz's."""
    placed = place_case(case_of(name, tmp_path))
    assert [*position_warnings(placed), *plausibility_warnings(placed.case)] == []
    rim, x = contact_limits(placed), placed.pair.punch.x
    if rim.curvatures and rim.clips.any():
        touching = np.where(np.hypot(*x[:, :2].T) < rim.hertzian(placed.normal_force) / 2, 1.0, 0.0)
        assert few(placed.case, net_of(placed), touching) == {}


def start(system: Tribosystem) -> np.ndarray:
    """Return the pressure of the unworn bodies (n,), MPa."""
    return system.phase_contact((0,)).solve(system.gap(0, system.unworn())).pressure[0]


@pytest.mark.parametrize(("elements", "few"), [(60, False), (16, True), (8, True), (4, True)])
def test_contact_on_a_few_nodes_is_told(assembled: Assembled, elements: int, few: bool) -> None:
    """Of a cylinder, by `check`; with the elements that it names there is nothing to say.

    Reference: Hertz's width over the distance of the nodes.
    """
    key = "geometry.parameters.elements_along_contact"
    system = assembled("fretting", f"{key}={elements}", "motion.positions=2")
    pressure = start(system)
    zone = net_of(system).zone(pressure)
    assert zone is not None
    width = 2 * np.sqrt(4 * 18.5 * 6 / (np.pi * 2e5 / (2 * (1 - 0.09))))
    assert abs(zone.nodes[0] - width / (0.6 / (2 * elements))) < 2
    assert zone.free[0] == 2
    told = [text for text in Seen.of_start(system).warnings() if "across the contact" in text]
    assert bool(told) is few
    if few:
        wanted = int(told[0].rpartition(f"{key} = ")[2].strip("`"))
        assert 32 <= wanted <= 60  # with 60 there are 15 nodes
        finer = assembled("fretting", f"{key}={wanted}", "motion.positions=2")
        assert not [text for text in Seen.of_start(finer).warnings() if "across the contact" in text]


def test_few_nodes_in_a_run_and_a_steady_state(assembled: Assembled, tmp_path: Path) -> None:
    """Told once by a run, and in its summary; of an own mesh the size of elements; the ends of a flat are its own."""
    coarse = ("geometry.parameters.elements_along_contact=8", "motion.positions=2")
    summary, said = run(tmp_path, "fretting", *coarse, "run.half_cycles=2", "run.integration=implicit",
                        "output.report=false", "output.uncertainty=false")  # fmt: skip
    (told,) = [text for text in summary["warnings"] if "across the contact in half-cycle 1" in text]
    assert said.count(f"warning: {told}") == 1
    system = assembled("fretting", *coarse)
    (tmp_path / "own.msh").touch()
    geometry = system.case.geometry.model_copy(update={"file": "own.msh", "order": 1, "parameters": {}})
    own = system.case.model_copy(update={"geometry": geometry}).at(tmp_path)
    text = str(few(own, net_of(system), start(system))["remedy"])
    size = float(re.findall(r"elements at the contact ([\d.e-]+) mm long", text)[0])
    assert 0.6 / 60 < size < 0.6 / 32  # with 60 there are 15 nodes
    state = steady(assembled("example1", "geometry.degree=1", "geometry.parameters.elements_along_contact=4"))
    assert (state.phase_pressure > 0).all(axis=1).any()
    assert not [
        text for text in Seen.of_steady(state.system, state).warnings() if "across" in text
    ]  # five nodes, all of them


CROWN = """
DefineConstant[ field = 0 ];
R = 50; w = 2; h = 40; d = R - Sqrt(R^2 - w^2);
Point(1) = {0,0,0}; Point(2) = {w,d,0}; Point(3) = {h,d+8,0}; Point(4) = {h,h,0};
Point(5) = {0,h,0}; Point(6) = {0,R,0};
Circle(1) = {1,6,2}; Line(2) = {2,3}; Line(3) = {3,4}; Line(4) = {4,5}; Line(5) = {5,1};
Point(11) = {0,0,0}; Point(12) = {w,0,0}; Point(13) = {h,0,0}; Point(14) = {h,-h,0}; Point(15) = {0,-h,0};
Line(11) = {11,12}; Line(12) = {12,13}; Line(13) = {13,14}; Line(14) = {14,15}; Line(15) = {15,11};
Curve Loop(1) = {1:5}; Plane Surface(1) = {1}; Curve Loop(2) = {11:15}; Plane Surface(2) = {2};
Physical Surface("punch_body") = {1}; Physical Surface("strip_body") = {2};
Physical Curve("punch_contact") = {1}; Physical Curve("strip_contact") = {11};
Physical Curve("punch_top") = {4}; Physical Curve("punch_sym") = {5};
Physical Curve("strip_bottom") = {14}; Physical Curve("strip_sym") = {15};
Transfinite Curve{1, 11} = 41; Mesh.MeshSizeMax = 4; Mesh.MeshSizeExtendFromBoundary = 1;
If (field > 0)
  Field[1] = Distance; Field[1].CurvesList = {1, 11}; Field[1].Sampling = 200;
  Field[2] = MathEval; Field[2].F = "0.05 + 0.4 * F1";
  Background Field = 2; Mesh.MeshSizeExtendFromBoundary = 0; Mesh.MeshSizeFromPoints = 0;
EndIf
"""


@pytest.mark.mpi("slivers")
@pytest.mark.parametrize("field", [0, 1], ids=["slivers", "field"])
def test_slivers_below_a_contact_are_told(tmp_path: Path, field: int) -> None:
    """Slivers that are fine along half a cylinder and deep below it, and the same line on elements sized by a field.

    Reference: Hertz's p0 = sqrt(F E* / (pi R)) = 271.03 MPa, a = 0.2349 mm.
    """
    (tmp_path / "crown.geo").write_text(CROWN)
    tables = {
        "geometry": {"file": "crown.geo", "degree": 2, "order": 2, "parameters": {"field": field}},
        "model": {"plane": "strain", "thickness": 10},
        "materials": {"steel": {"young": "210 GPa", "poisson": 0.3}},
        "punch": {
            "regions": {"punch_body": "steel"},
            "supports": [{"on": "punch_sym", "fix": ["x"]}],
            "loads": [{"on": "punch_top", "force": [0, -500]}],
        },
        "strip": {
            "regions": {"strip_body": "steel"},
            "supports": [{"on": "strip_bottom", "fix": ["z"]}, {"on": "strip_sym", "fix": ["x"]}],
        },
        "contact": {"friction": 0},
        "wear": {"punch": {"coefficient": "1e-9 1/MPa"}},
        "motion": {"kind": "reciprocating", "amplitude": 1, "period": 1, "positions": 1},
        "run": {"half_cycles": 2},
    }
    system = assemble(make_case(tables, tmp_path))
    deep = [text for text in Seen.of_start(system).warnings() if text.startswith("geometry: elements of the ")]
    too_high = start(system).max() / 271.03
    if field:
        assert too_high == pytest.approx(1, abs=0.01)
        assert not deep
    else:
        assert too_high > 2
        assert 0.05 < float(re.findall(r"at most ([\d.]+) mm deep", deep[0])[0]) <= 0.2349


@pytest.mark.parametrize("elements", [30, 60])
def test_a_curve_that_is_meshed_as_a_polygon(assembled: Assembled, elements: int) -> None:
    """The waves that are told of are about those by which pressures differ from those on curved elements.

    Where nodes are at the corners alone they lie on the curve: pressures are those of curved elements, and nothing is
    told.
    """
    settings = (f"geometry.parameters.elements_along_contact={elements}", "motion.positions=2")
    for degree in (1, 2):
        straight, curved = (
            assembled("fretting", *settings, f"geometry.degree={degree}", f"geometry.order={order}") for order in (1, 2)
        )
        pressure = start(straight)
        off, told = np.abs(pressure - start(curved)).max(), RULES["polygon"].text(Seen.of_start(straight))
        assert RULES["polygon"].text(Seen.of_start(curved)) == ""
        if degree == 1:
            assert off < 1e-3 * pressure.max()
            assert told == ""
        else:
            assert told in Seen.of_start(straight).warnings()
            waves = float(re.findall(r"about ([\d.]+) MPa", told)[0])
            assert 0.4 * waves < off < 2 * waves


def test_a_rough_strip_stands_still(assembled: Assembled) -> None:
    """Under a punch in few positions: told with how many would do, and nothing with as many."""
    small = ("geometry.parameters.core_elements=0", "geometry.parameters.core=0", "geometry.parameters.across=3")
    grid = ("punch.operator='fine'", "strip.operator='fine'", "grid={nodes=17, size=['0.4 mm', '0.4 mm']}")
    rough = (*small, *grid, "unset=wear.strip", "strip.topography={rms='0.02 um', longest='0.4 mm'}")
    slides = "motion={kind='reciprocating', amplitude='0.05 mm', period='1 s', positions="

    def wanted(positions: int) -> int:
        (warning,) = position_warnings(assembled("ball-on-flat", *rough, f"{slides}{positions}}}"))
        (number,) = re.findall(r"motion\.positions = (\d+)", warning)
        return int(number)

    needed = wanted(1)
    assert position_warnings(assembled("ball-on-flat", *rough, f"{slides}{needed}}}")) == []
    assert wanted(needed // 2) == pytest.approx(needed, abs=2)
    away = "motion={kind='one-way', direction='rightward', speed='2 mm/s', duration='1 s'}"
    (told,) = position_warnings(assembled("ball-on-flat", *rough, away))
    assert "punch.topography" in told


def test_elements_thicker_than_the_layer_that_heats_up() -> None:
    """A pad at 100 rad/s: the number that is told is what it needs, and the ready mesh has it without being asked."""
    layer = np.sqrt(50e3 / 3.6e6 * 1e3 * np.pi / 3 / 100)  # a = k / (rho c), over the time of 60 degrees
    bare = ["motion.angular_speed=100", "geometry.parameters.diffusion_area=0"]

    def told(*settings: str) -> list[str]:
        text = RULES["layer"].text(Seen.of_system(place_case(load_case("brake-pad", list(settings)))))
        return [text] if text else []

    (coarse,) = told(*bare, "geometry.parameters.growth=1", "geometry.parameters.disc_layers=3")
    assert "up to 4 mm high" in coarse
    assert f"{layer:.3g} mm thick" in coarse
    needed = float(re.search(r"at most (\S+) mm", coarse)[1])  # type: ignore[index]
    layers = int(np.ceil(12 / needed))
    assert told(*bare, "geometry.parameters.growth=1", f"geometry.parameters.disc_layers={layers}") == []
    assert told(*bare, "geometry.parameters.growth=1", f"geometry.parameters.disc_layers={layers - 1}") != []
    assert told("motion.angular_speed=100") == []


@pytest.mark.parametrize("tetrahedra", [0, 1])
def test_height_of_elements_that_the_layer_is_held_against(tetrahedra: int) -> None:
    """That of hexahedra, and of the tetrahedra that they are cut into."""
    sizes = {"strip_height": 1.0, "strip_layers": 4, "strip_tetrahedra": tetrahedra, "diffusion_length": 0.0}
    steel = {**STEEL, "conductivity": 50.0, "heat_capacity": 4.6e8, "density": 7.8e-9, "expansion": 0.0}
    case = describe(
        {"file": "solid_blocks.geo", "degree": 2, "parameters": sizes},
        {"supports": [{"on": "punch_sides", "fix": ["x", "y"]}], "loads": [{"on": "punch_far", "force": [0, 0, -1]}]},
        {"supports": [{"on": "strip_far", "fix": ["x", "y", "z"]}]},
        materials=(steel, steel),
        motion={"kind": "one-way", "direction": "rightward", "speed": 1e4, "duration": 1.0},
        heat={},
    )
    layer = heated_layer(place_case(case))
    assert layer.height == pytest.approx(0.25, rel=1e-9)
    assert layer.thickness == pytest.approx(np.sqrt(50.0 / (4.6e8 * 7.8e-9) * 1.0 / 1e4), rel=1e-9)


def test_deep_wear_of_a_bore_turns_its_normals() -> None:
    """A shaft moved by delta into its bore touches it along normals turned by delta / R beside."""
    pair = place_case(load_case("bushing", ["geometry.parameters.elements_along_contact=40"])).pair
    cosine = np.maximum((pair.normal @ pair.normal[np.abs(pair.x).argmin()]), 0.0)
    radius = pair.punch.rounds[0][0].radius
    assert turned(pair, 0.08 * radius * cosine) == pytest.approx(0.08, rel=5e-3)


def test_strain_and_rotation_of_a_linear_displacement() -> None:
    """Exact: e : e = 0.2^2 + 2 0.1^2, rotation 0.2, of u = (0.2 x + 0.1 z, -0.3 x), whatever the elements."""
    mesh = create_rectangle(MPI.COMM_SELF, [(0, 0), (3, 2)], (6, 4), CellType.quadrilateral)
    groups = {"punch_contact": lambda x: np.isclose(x[1], 0), "top": lambda x: np.isclose(x[1], 2)}
    held = Body(supports=(Support(on="top", fix=("x", "z")),))
    law = Isotropic("stress", lame(1, 0.3, "stress"))
    body = ElasticBody(own_mesh("punch", mesh, groups), held, law, degree=2)
    moved = fem.Function(body.space)
    moved.interpolate(lambda x: (0.2 * x[0] + 0.1 * x[1], -0.3 * x[0]))
    assert strain_and_rotation(body, moved) == pytest.approx((0.06**0.5, 0.2), rel=1e-12)


@pytest.mark.parametrize(("young", "told"), [("1 GPa", False), ("100 MPa", True)])
def test_displacements_beyond_small_strain(assembled: Assembled, young: str, told: bool) -> None:
    """A block under 16.7 MPa stretches by 1.7 % or 17 %: `check` tells of the latter, with the size of the error."""
    both = [f"materials.{name}.young='{young}'" for name in ("composite", "steel")]
    texts = [text for text in Seen.of_start(assembled("example2", *FLAT, *both)).warnings() if "small strains" in text]
    assert bool(texts) is told
    if told:
        assert 14 < float(re.findall(r"off by some (\d+) %", texts[0])[0]) < 22


def test_an_unstable_speed_is_foreseen(assembled: Assembled) -> None:
    """A dry seal, twice as fast as full contact is stable, and half as fast."""
    critical = critical_speed(assembled("ring-on-ring-heat"), 1)
    for factor in (0.5, 2.0):
        fast = assembled("ring-on-ring-heat", f"motion.angular_speed={factor * critical!r}")
        texts = Seen.of_system(fast).warnings("speed")
        assert bool(texts) is (factor > 1)
    assert f"{critical:.4g} rad/s" in texts[0]
    assert "is 2 times the critical speed" in texts[0]
    assert not Seen.of_system(assembled("example1-heat", *FLAT)).warnings("speed")  # to and fro


def test_what_takes_longer_than_its_limit_ends() -> None:
    """At once, and nothing comes later."""
    with pytest.raises(TimeUpError), time_limit(0.01, MPI.COMM_SELF):
        time.sleep(10)
    with time_limit(0.01, MPI.COMM_SELF):
        pass
    time.sleep(0.02)


@pytest.mark.mpi
def test_ranks_end_together_where_time_is_up(assembled: Assembled) -> None:
    """Each of them, in the same work; a later try is not late."""
    system = assembled("example1-heat", *FLAT, "heat.operator=full")
    with pytest.raises(TimeUpError), time_limit(1e-4, MPI.COMM_WORLD):
        with_reduced_heat(system, fresh=True)
    with time_limit(100.0, MPI.COMM_WORLD):
        assert with_reduced_heat(system, fresh=True).exchange.reduced


def test_check_has_a_limit_for_heat(fenwear: Callable[..., Any]) -> None:
    """It says what it does, and what it has not looked at."""
    said = fenwear("check", "example1-heat", *[arg for one in FLAT for arg in ("--set", one)], "--heat-seconds", "1e-4")
    assert "for at most 0.0001 s" in said.stdout + said.stderr
    assert "heat: not looked at" in said.stdout + said.stderr
    assert "the case is valid" in said.stdout + said.stderr


def test_balances_are_looked_at(assembled: Assembled) -> None:
    """A thousandth of a term missing in the balance of force, heat, volume or energy is a warning; rounding is none."""
    heated = ("geometry.parameters.elements_along_contact=4", "geometry.degree=2", "geometry.follow_wear=never")
    system = assembled("example1-heat", *heated)
    (block,) = march_within(system, RunLimits(4, block=4))
    fretting = assembled("fretting-partial-slip", "geometry.parameters.elements_along_contact=8", "stick.steps=4")
    (slipping,) = march_within(fretting, RunLimits(2, block=2))
    assert block.heat is not None
    terms = block.heat.terms.copy()
    terms[2, 3] += 2e-3 * terms[2].max()
    record = slipping.steps[1].records
    wrong = {
        "punch.supports": (system, replace(block, equilibrium_error=np.array([0.0, 2e-3, 0.0, 0.0]))),
        "heat.operator": (system, replace(block, heat=replace(block.heat, terms=terms))),
        "geometry": (system, replace(block, wear=1.002 * block.wear)),
        "stick.steps": (fretting, replace(slipping, steps=(*slipping.steps[:1], replace(
            slipping.steps[1], records=replace(record, work=1.004 * record.work))))),
    }  # fmt: skip
    for key, (own, block) in wrong.items():
        (text,) = (one for one in StateMonitor(own).see(block) if "balance" in one)
        assert text.startswith(f"{key}: ")
        assert "is off by 0.2" in text
    for own, block in ((system, next(march_within(system, RunLimits(4, block=4)))), (fretting, slipping)):
        assert not [text for text in StateMonitor(own).see(block) if "balance" in text]


@pytest.mark.parametrize(("growth", "told"), [(1.3, False), (16.0, True)])
def test_coarse_elements_beside_a_fine_contact_are_told(growth: float, told: bool) -> None:
    """Half a cylinder on half a block: rows of elements, 0.02 mm high at the contact, each so many times the last.

    Reference: Hertz's p0 = 271.03 MPa.
    """
    x, z = (np.unique(np.minimum(np.cumsum(steps), 40.0)) for steps in (
        [0.0, *np.full(100, 0.02), *0.04 * 1.3 ** np.arange(30)], [0.0, *0.02 * growth ** np.arange(30)]))  # fmt: skip
    meshes = {}
    for body, way in (("punch", 1), ("strip", -1)):
        crown = np.where(x < 2, x**2 / 100, x / 25 - 0.04)[:, None] if way > 0 else np.zeros((len(x), 1))
        places = np.stack([np.broadcast_to(x[:, None], (len(x), len(z))), way * (crown + (40 - crown) * z / 40)], -1)
        i, j = np.divmod(np.arange((len(x) - 1) * (len(z) - 1)), len(z) - 1)
        first = i * len(z) + j
        cells = np.stack([first, first + len(z), first + 1, first + len(z) + 1], axis=1)
        element = basix.ufl.element("Lagrange", "quadrilateral", 1, shape=(2,))
        mesh = create_mesh(MPI.COMM_SELF, cells, places.reshape(-1, 2), ufl.Mesh(element))
        groups = {
            f"{body}_contact": lambda x, way=way: (x[0] < 2.01) & (np.abs(x[1] - (way > 0) * x[0] ** 2 / 100) < 1e-3),
            "far": lambda x, way=way: np.isclose(x[1], 40 * way),
            "middle": lambda x: np.isclose(x[0], 0),
        }
        meshes[body] = own_mesh(body, mesh, groups)
    tables = {
        "geometry": {"degree": 1},
        "model": {"plane": "strain", "thickness": 10},
        "materials": {"steel": {"young": "210 GPa", "poisson": 0.3}},
        "punch": {
            "regions": {"punch_body": "steel"},
            "supports": [{"on": "middle", "fix": ["x"]}],
            "loads": [{"on": "far", "force": [0, -500]}],
        },
        "strip": {
            "regions": {"strip_body": "steel"},
            "supports": [{"on": "far", "fix": ["z"]}, {"on": "middle", "fix": ["x"]}],
        },
        "contact": {"friction": 0},
        "wear": {"punch": {"coefficient": "1e-9 1/MPa"}},
        "motion": {"kind": "reciprocating", "amplitude": 1, "period": 1, "positions": 1},
        "run": {"half_cycles": 2},
    }
    system = assemble(make_case(tables, meshes=meshes), MPI.COMM_SELF)
    too_high = start(system).max() / 271.03
    texts = [text for text in Seen.of_start(system).warnings() if "deep, too deep for the contact" in text]
    assert bool(texts) is told
    if told:
        assert too_high > 1.15
        assert "below the contact" in texts[0]
    else:
        assert too_high == pytest.approx(1, abs=0.02)
