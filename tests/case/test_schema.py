"""The description of a problem: case files, overrides, refusals."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fenwear import CaseError, load_case, make_case
from fenwear.case import builtin_cases, changed_case


@pytest.mark.parametrize("name", builtin_cases())
def test_builtin_case_resolves_and_reads_back(name: str, tmp_path: Path) -> None:
    """case.toml holds every key with its unit and reads back as the same case."""
    case = load_case(name)
    file = tmp_path / "case.toml"
    file.write_text(case.to_toml(), "utf-8")
    assert load_case(file).resolved() == case.resolved()
    if case.model.kind != "plane":
        assert not {"thickness", "plane", "convecting_faces"} & set(
            re.findall(r"^(\w+) =", case.to_toml(), re.MULTILINE)
        )


def test_example_1_holds_the_papers_data() -> None:
    """Reference: the table of shared/physics.md, in mm, N, s, MPa."""
    case = load_case("example1")
    assert case.punch.loads[0].force == (0, -1e4)
    assert case.model.thickness == 10
    assert (case.materials["steel"].young, case.materials["steel"].poisson) == (2e5, 0.3)
    assert (case.materials["composite"].young, case.materials["composite"].poisson) == (1.3e5, 0.23)
    assert case.contact.friction == 0.25
    assert case.wear.punch.coefficient == pytest.approx(1.25 * 3.141592653589793e-8, rel=1e-12)
    assert (case.motion.amplitude, case.motion.angular_frequency) == (1.5, 10)  # type: ignore[union-attr]


@pytest.mark.parametrize("exponents", [(1.0, 1.0), (2.0, 1.0), (0.5, 2.0), (1.0, 0.5), (1.3, 1.7)])
def test_wear_coefficient_keeps_its_unit(exponents: tuple[float, float]) -> None:
    """The unit of beta~ follows from the exponents b and a, and survives the round trip."""
    b, a = exponents
    settings = [f"wear.punch.pressure_exponent={b}", f"wear.punch.speed_exponent={a}"]
    case = load_case("example1", [*settings, "wear.punch.coefficient=1e-7"])
    assert make_case(tomllib.loads(case.to_toml())) == case
    metres = f"1e-7 m*s^-1*MPa^-{b}*(m/s)^-{a}"
    in_metres = load_case("example1", [*settings, f"wear.punch.coefficient='{metres}'"]).wear.punch.coefficient
    assert in_metres == pytest.approx(1e-7 * 1000 ** (1 - a), rel=1e-12)


def test_base_and_overrides(tmp_path: Path) -> None:
    """A case is its base's tables with its own above, and --set above both."""
    (tmp_path / "base.toml").write_text('base = "example1"\ntitle = "base"\ncontact.friction = 0.3\n')
    (tmp_path / "case.toml").write_text('base = "base.toml"\ntitle = "case"\n')
    case = load_case(tmp_path / "case.toml", ['motion.amplitude="2 mm"', "punch.loads.0.force=[0, '-5 kN']"])
    assert case.title == "case"
    assert case.contact.friction == 0.3
    assert case.motion.amplitude == 2  # type: ignore[union-attr]
    assert case.punch.loads[0].force == (0, -5000)
    assert case.materials == load_case("example1").materials


@pytest.mark.parametrize("named", ["shapes/base.toml", "../shapes/base.toml"])
def test_files_lie_beside_the_case_that_names_them(tmp_path: Path, named: str) -> None:
    """Profiles and programs of a base in another folder are read there, those of the case itself beside it."""
    place = tmp_path / "own" if named.startswith("..") else tmp_path
    shapes = tmp_path / "shapes"
    place.mkdir(exist_ok=True)
    shapes.mkdir()
    (shapes / "worn.csv").write_text("x (mm),depth (um)\n-5,1\n5,3\n")
    (shapes / "steps.csv").write_text("cycles,load_factor\n0,1\n4,2\n")
    base = 'base = "example1"\nprogram.file = "steps.csv"\n[punch.profile]\nfile = "worn.csv"\n'
    (shapes / "base.toml").write_text(base)
    (place / "case.toml").write_text(f'base = "{named}"\n[strip.profile]\nfile = "counter.csv"\n')
    (place / "counter.csv").write_text("x (mm),depth (um)\n-9,2\n9,2\n")
    case = load_case(place / "case.toml")
    assert case.punch.profile == load_case(shapes / "base.toml").punch.profile
    assert case.program == load_case(shapes / "base.toml").program
    assert case.strip.profile is not None
    assert case.strip.profile.points[0] == (-9, 2e-3)
    (place / "flat.csv").write_text("x (mm),depth (um)\n-7,1\n7,1\n")
    (place / "own.geo").touch()
    told = load_case(place / "case.toml", ["punch.profile.file=flat.csv", "geometry.file=own.geo"])
    assert told.punch.profile is not None
    assert told.punch.profile.points[0] == (-7, 1e-3)
    assert told.folder is not None
    assert (told.folder / told.geometry.file).samefile(place / "own.geo")
    assert told.program == case.program


def test_keys_of_a_base_are_taken_away(tmp_path: Path) -> None:
    """A case without them is the case that never had them; what is taken away twice, or is none, is refused by name."""
    base = tmp_path / "base.toml"
    base.write_text("""
base = "brake-pad"
unset = ["heat.track"]
[heat]
inflow = "300 K"
[wear.strip]
coefficient = "1e-9 1/MPa"
""")
    own = tmp_path / "own.toml"
    track = 'track = {heat_capacity = "120 J/K", loss = "0.6 W/K"}\n'
    own.write_text(f'base = "base.toml"\nunset = ["heat.inflow", "wear.strip", "punch.loads.0"]\n[heat]\n{track}')
    with pytest.raises(CaseError, match=r"punch\.loads"):
        load_case(own)  # its only load is gone
    own.write_text(f'base = "base.toml"\nunset = ["heat.inflow", "wear.strip"]\n[heat]\n{track}')
    case = load_case(own)
    assert case.heat is not None
    assert (case.heat.inflow, case.wear.strip) == (None, None)
    assert case.heat.track is not None
    by_settings = ["unset=['heat.inflow', 'wear.strip']", "heat.track.heat_capacity=120 J/K", "heat.track.loss=0.6 W/K"]
    assert load_case(base, by_settings).resolved() == case.resolved()
    assert changed_case(load_case(base), *by_settings).resolved() == case.resolved()
    other = ["wear.punch.coefficient=1e-8", "unset=wear.punch", "wear.punch.energy=1e-8 mm^3/(N*mm)"]
    later = load_case("example1", other)
    assert later.wear.punch is not None
    assert later.wear.punch.coefficient is None
    for wrong, message in (
        ("heat.inflo", "heat.inflo: no such key; did you mean heat.inflow or"),
        ("heat.debris", r"unset: .*'heat\.debris'"),
        ("punch.loads.7", "punch.loads.7: no such key"),
        ("[1]", "unset: expected a list of keys"),
    ):
        with pytest.raises(CaseError, match=message):
            load_case(base, [f"unset={wrong}"])
    own.write_text('unset = ["heat"]\n')
    with pytest.raises(CaseError, match="unset: expected with a base"):
        load_case(own)


def test_a_motion_replaces_the_bases_motion() -> None:
    """A table that states its kind stands alone: no amplitude is left in one-way sliding."""
    assert load_case("monotonic-lz20").motion.kind == "one-way"


SUPPORT_TWICE = "punch.supports=[{on='punch_pin', at=[1, 2], fix=['x']}]"
LOAD_TWICE = "punch.loads=[{on='punch_load', force=[0, -1], traction=[0, -1]}]"


@pytest.mark.parametrize(
    ("settings", "key", "expected"),
    [
        (["contact.frction=0.3"], "contact.frction", "did you mean 'friction'"),
        (["colour='red'"], "colour", "unknown key"),
        (["materials.steel.alpha_=1"], "materials.steel.alpha_", "unknown key"),
        (["model.thickness='10 s'"], "model.thickness", "mm"),
        (["materials.steel.young='200 kg'"], "materials.steel.young", "MPa"),
        (["materials.steel.young=-1"], "materials.steel.young", "greater than 0"),
        (["materials.steel.young=nan"], "materials.steel.young", "finite"),
        (["materials.steel.poisson=0.6"], "materials.steel.poisson", "0.5"),
        (["model.plane='strain'", "materials.steel.poisson=0.5"], "materials.steel.poisson", "plane strain"),
        (["model.plane='strange'"], "model.plane", "'stress' or 'strain'"),
        (["run.half_cycles=0"], "run.half_cycles", "1"),
        (["run.half_cycles=1.5"], "run.half_cycles", "whole number"),
        (["run.integration='jump'", "run.half_cycles=1"], "run.half_cycles", "whole cycle"),
        (["geometry.degree=9"], "geometry.degree", "8"),
        (["geometry.degree=0"], "geometry.degree", "1"),
        (["contact.friction=-0.1"], "contact.friction", "0"),
        (["wear.punch.coefficient=-1"], "wear.punch.coefficient", "zero or larger"),
        (["wear.punch.coefficient='1 mm'"], "wear.punch.coefficient", "mm^3/(N*mm)"),
        (["wear.punch.pressure_exponent=0"], "wear.punch.pressure_exponent", "greater than 0"),
        (["wear.punch.speed_exponent=-1"], "wear.punch.speed_exponent", "greater than 0"),
        (["motion={kind='sideways'}"], "motion.kind", "reciprocating"),
        (["motion={amplitude=1, angular_frequency=1}"], "motion.kind", "one-way"),
        (["motion.amplitude=0"], "motion.amplitude", "greater than 0"),
        (["motion.angular_frequency='10 Hz'"], "motion.angular_frequency", "2 pi"),
        (["punch.regions.punch_lower='cheese'"], "punch.regions.punch_lower", "composite, steel"),
        (["punch.loads=[]"], "punch.loads", "at least one load"),
        ([SUPPORT_TWICE], "punch.supports.0", "one of on and at"),
        (["punch.supports.0.fix=[]"], "punch.supports.0.fix", "at least 1"),
        (["punch.supports.0.fix=['y']"], "punch.supports.0.fix.0", "'x' or 'z'"),
        ([LOAD_TWICE], "punch.loads.0", "either"),
        (["output.every=0"], "output.every", "1"),
        (["geometry.parameters.punch_width='60 s'"], "geometry.parameters.punch_width", "60 mm"),
        (["title=3"], "title", "text"),
        (["nonsense"], "--set", "key.path=value"),
        (["title.a.b=1"], "--set", "not a table"),
    ],
)
def test_refusal_names_the_key(settings: list[str], key: str, expected: str) -> None:
    """A message naming the key and what was expected."""
    with pytest.raises(CaseError) as refused:
        load_case("example1", settings)
    assert key in [p.key for p in refused.value.problems]
    assert expected in str(refused.value)


def test_all_problems_at_once() -> None:
    """Every problem is reported in one go, each under its own key."""
    settings = {"contact.friction": "-1", "colour": "1", "motion.amplitude": "'1 s'", "run.half_cycles": "0",
                "materials.steel.young": "-1"}  # fmt: skip
    with pytest.raises(CaseError) as refused:
        load_case("example1", [f"{k}={v}" for k, v in settings.items()])
    assert {p.key for p in refused.value.problems} == set(settings)


def test_missing_keys_are_named() -> None:
    """An empty case lists what a case cannot do without."""
    with pytest.raises(CaseError) as refused:
        make_case({})
    required = {"materials", "punch", "strip", "wear", "motion", "run"}
    assert {p.key for p in refused.value.problems} == required


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"title = 'caf\xe9'", "UTF-8"),
        (b"title = ", "not a TOML file"),
        (b"base = 3", "name of a case"),
        (b"base = 'case.toml'", "itself"),
        (b"base = 'nowhere.toml'", "cannot be read"),
        (b"base = 'nowhere'", "built-in"),
        (b"a = " + 2000 * b"[" + 2000 * b"]", "not a TOML file"),
    ],
)
def test_unreadable_file(content: bytes, expected: str, tmp_path: Path) -> None:
    """A file that is no case is refused in words, whatever it holds."""
    file = tmp_path / "case.toml"
    file.write_bytes(content)
    with pytest.raises(CaseError, match=expected):
        load_case(file)


@pytest.mark.parametrize("name", ["nowhere", "nowhere.toml", "."])
def test_no_such_case(name: str) -> None:
    """Neither a file nor a built-in case."""
    with pytest.raises(CaseError, match=f"{name}: "):
        load_case(name)


def test_a_case_is_frozen() -> None:
    """One typed object, never changed behind a system's back."""
    case: Any = load_case("example1")
    with pytest.raises(Exception, match="frozen"):
        case.contact.friction = 0.5


@pytest.mark.parametrize(
    ("name", "settings", "key", "expected"),
    [
        ("ball-on-flat", ["punch.loads.0.force=[0, -20]"], "punch.loads.0.force", "3 components (x, y, z)"),
        ("example1", ["punch.loads.0.force=[0, 0, -20]"], "punch.loads.0.force", "2 components (x, z)"),
        ("example1", ["punch.pivot=[0, 0, 1]"], "punch.pivot", "2 components"),
        ("ball-on-flat", ["strip.supports.0={at=[0, 0], fix=['x']}"], "strip.supports.0.at", "3 components"),
        ("example1", ["strip.supports.0.fix=['y']"], "strip.supports.0.fix.0", "'x' or 'z' in a plane model"),
        ("ring-on-ring", ["strip.supports.0.fix=['y']"], "strip.supports.0.fix.0", "axisymmetric"),
        ("ball-on-flat", ["model.thickness='2 mm'"], "model.thickness", "plane models"),
        ("ring-on-ring", ["model.plane=strain"], "model.plane", "plane models"),
        ("example1", ["motion={kind='rotation', angular_speed=1, duration=1}"], "motion.axis", "out of the plane"),
        ("example1", ["motion.along=[1, 0, 0]"], "motion.along", "belongs to solids"),
        ("ball-on-flat", ["motion.along=[0, 0, 0]"], "motion.along", "got zero"),
        ("ball-on-flat", ["motion.axis=y"], "motion.along", "either along or axis"),
        ("ring-on-ring", ["motion.axis=[1, 0, 1]"], "motion.axis", "axis z"),
        ("ring-on-ring", ["motion={kind='one-way', direction='leftward', speed=1, duration=1}"], "motion.kind",
         "rotation or oscillation"),
        ("pin-on-disc", ["motion.axis=[0, 0, 0]"], "motion.axis", "got zero"),
        ("ball-on-flat", ["motion.positions=1"], "motion.positions", "2 or more"),
        ("pin-on-disc", ["materials.brass.poisson=0.5"], "materials.brass.poisson", "in solids"),
        ("pin-on-disc", ["motion.angular_speed='10 mm/s'"], "motion.angular_speed", "another kind"),
    ],
)  # fmt: skip
def test_what_does_not_go_with_the_model(name: str, settings: list[str], key: str, expected: str) -> None:
    """Plane, axisymmetric and solid models each have their axes, motions and settings."""
    with pytest.raises(CaseError) as refused:
        load_case(name, settings)
    messages = [p.message for p in refused.value.problems if p.key == key]
    assert any(expected in message for message in messages), str(refused.value)


def test_angles_have_units() -> None:
    """Degrees become radians, and a resolved case reads back as the same one."""
    motion = "motion={kind='oscillation', amplitude='90 deg', period='1 s', axis=[0, 0, 2]}"
    case = load_case("pin-on-disc", [motion])
    assert case.motion.amplitude == pytest.approx(np.pi / 2)  # type: ignore[union-attr]
    assert make_case(tomllib.loads(case.to_toml())) == case
