"""The shape to machine: made with it, nothing runs in."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import nnls

from fenwear import CaseError, Tribosystem, assemble, load_case, make_case, march
from fenwear.results.export import TRIANGLE, profile_of, with_shape
from fenwear.steps.initial_shape import initial_shape, pressure_at, shape_for_pressure
from fenwear.steps.stick_state import TimeStepRecords

SMALL = ("geometry.degree=2", "geometry.parameters.elements_along_contact=6", "geometry.parameters.growth=1.5")

RING = ("geometry.degree=2", "geometry.parameters.across=4", "wear.strip.coefficient=1e-30")


BUSHING = ("geometry.degree=1", "geometry.parameters.elements_along_contact=60")
BLOCK = ("geometry.degree=1", "geometry.parameters.elements_along_contact=30")
DRUM = tuple(f"geometry.parameters.{name}" for name in ("elements_along_lining=12", "elements_along_drum=44"))


def made_with(system: Tribosystem, *shapes: Any) -> Tribosystem:
    return assemble(with_shape(system.case, profile_of(system.pair.punch, *shapes)))


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("example1", SMALL),
        ("example2", (*SMALL, "wear.punch.coefficient='1e-8 MPa^-2'", "wear.punch.pressure_exponent=2.0")),
        ("ring-on-ring", RING),
        ("pin-on-disc", ("geometry.degree=1", "geometry.order=1")),
        ("bushing", BUSHING),
        ("block-on-ring", BLOCK),
        ("drum-brake", DRUM),
    ],
)
def test_nothing_runs_in(assembled: Callable[..., Tribosystem], name: str, settings: tuple[str, ...]) -> None:
    """The first pressures on a surface made so are the steady ones, at every node; on the unworn one they are not."""
    system = assembled(name, *settings)
    shape = initial_shape(system)
    (state,) = shape.states
    assert shape.depth.min() == 0
    assert shape.left_to_run_in[0] < 1e-9
    assert shape.uneven_wear < 1e-9
    own = made_with(system, shape.depth)
    np.testing.assert_allclose(own.pair.initial_gap - system.pair.initial_gap, shape.depth, atol=1e-12)
    first = [own.phase_contact((k,)).solve(own.gap(k, own.unworn())) for k in range(len(own.motion.phases))]
    pressure = np.array([contact.pressure[0] for contact in first])
    np.testing.assert_allclose(pressure, state.phase_pressure, atol=1e-8 * state.phase_pressure.max())
    unworn = system.phase_contact((0,)).solve(system.gap(0, system.unworn())).pressure[0]
    assert np.abs(unworn - state.phase_pressure[0]).max() > 0.03 * state.phase_pressure.max()


def test_it_stays(assembled: Callable[..., Tribosystem]) -> None:
    """A march of a ring made so keeps its pressures; its shape is the optimum's, p r constant."""
    system = assembled("ring-on-ring", *RING)
    own = made_with(system, initial_shape(system).depth)
    *_, block = march(own, 50)
    r = own.pair.x
    np.testing.assert_allclose(block.pressure, np.tile(2000 / (2 * np.pi * 10 * r), (len(block), 1)), rtol=1e-8)


def test_the_least_is_taken_off(assembled: Callable[..., Tribosystem]) -> None:
    """No rigid motion of a bushing or of a hinged shoe takes less off without having material added somewhere."""
    for name, settings in (("bushing", BUSHING), ("drum-brake", DRUM)):
        system = assembled(name, *settings)
        shape, modes = initial_shape(system), system.rigid.rigid_normal / system.rigid.mode_lengths
        (state,) = shape.states
        pressed = state.phase_pressure.max(axis=0) > 0
        touching = pressed & (shape.depth < 1e-9 * shape.depth.max())
        assert touching.sum() >= modes.shape[1]
        # By Farkas' lemma: the volume taken off is a sum of depths at these nodes with factors that are not negative.
        volume = system.pair.weights[pressed] @ modes[pressed]
        rest = nnls(modes[touching].T, volume)[1]
        assert rest < 1e-9 * np.abs(volume).max()
        assert shape.depth[~pressed].max(initial=0.0) <= shape.depth.max()


def test_partial_slip(assembled: Callable[..., Tribosystem]) -> None:
    """A cylinder made so carries its load by the stick zone alone from the first cycle on, and hardly wears."""
    settings = ("geometry.degree=1", "geometry.parameters.elements_along_contact=20", "stick.steps=6")
    system = assembled("fretting-partial-slip", *settings)
    shape = initial_shape(system)
    (state,) = shape.states
    assert shape.left_to_run_in[0] < 0.1  # the ends of the stick zone lie within elements
    problem = made_with(system, shape.depth).law_state.problem
    made, unworn = (
        TimeStepRecords.joined(one.cycle(one.beginning())[1]) for one in (problem, system.law_state.problem)
    )
    np.testing.assert_allclose(made.pressure[-1], state.pressure, atol=0.1 * state.pressure.max())
    assert made.energy(problem.weights) < 0.2 * unworn.energy(problem.weights)
    with pytest.raises(CaseError, match="--load"):
        initial_shape(system, ((1.0, 1.0), (1.2, 1.0)))


def test_tolerance_is_the_one_told(assembled: Callable[..., Tribosystem]) -> None:
    """A surface off by that amplitude, a wave over the contact, has pressures off by a tenth of their scale."""
    system = assembled("ring-on-ring", *RING)
    shape = initial_shape(system)
    r = system.pair.x
    off = shape.tolerance * (1 + np.cos(2 * np.pi * (r - r.min()) / np.ptp(r)))
    own = made_with(system, shape.depth + off)
    pressure = own.phase_contact((0,)).solve(own.gap(0, own.unworn())).pressure[0]
    exact = 2000 / (2 * np.pi * 10 * r)
    scale = (exact**2 * own.pair.weights).sum() / (exact * own.pair.weights).sum()
    assert np.abs(pressure - exact).max() / scale == pytest.approx(0.1, rel=1e-3)


def test_loads_that_take_turns(assembled: Callable[..., Tribosystem]) -> None:
    """The load and 1.2 times it, 3 to 1: the mean of both pressures wears a ring evenly, neither alone does."""
    system = assembled("ring-on-ring", *RING)
    shape = initial_shape(system, ((1.0, 3.0), (1.2, 1.0)))
    profile, pressures = profile_of(system.pair.punch, shape.depth), []
    for force in (-2000.0, -2400.0):
        tables = with_shape(system.case, profile).resolved()
        tables["punch"]["loads"][0]["force"] = [0.0, force]
        own = assemble(make_case(tables))
        pressures.append(own.phase_contact((0,)).solve(own.gap(0, own.unworn())).pressure[0])
    assert min(p.min() for p in pressures) > 0  # whole contact, for which the mean is exact
    worn = [p * system.pair.x for p in (*pressures, 3 * pressures[0] + pressures[1])]
    assert min(np.ptp(one) / one.max() for one in worn[:2]) > 0.02
    np.testing.assert_allclose(worn[2], worn[2].mean(), rtol=1e-8)
    assert shape.largest_pressure == pytest.approx([p.max() for p in pressures], rel=1e-9)


def test_loads_that_reach_different_zones(assembled: Callable[..., Tribosystem]) -> None:
    """Their wear together is even, as that of loads which reach one zone; the light load touches a part alone."""
    block, pressures = assembled("block-on-ring", *BLOCK), []
    assert initial_shape(block, ((1.0, 3.0), (1.2, 1.0))).uneven_wear < 1e-9
    shape = initial_shape(block, ((1.0, 1.0), (0.2, 1.0)))
    assert shape.uneven_wear < 1e-9
    made = with_shape(block.case, profile_of(block.pair.punch, shape.depth)).resolved()
    whole = float(made["punch"]["loads"][0]["force"][1].split()[0])
    for factor in (1.0, 0.2):
        made["punch"]["loads"][0]["force"] = [0.0, factor * whole]
        own = assemble(make_case(made))
        pressures.append(own.phase_contact((0,)).solve(own.gap(0, own.unworn())).pressure[0])
    assert 0.1 < np.mean(pressures[1] > 0) < 0.9
    worn = (pressures[0] + pressures[1]) / block.rigid.rigid_normal[:, 0]
    assert np.ptp(worn) < 1e-6 * np.abs(worn).max()


def test_files(fenwear: Callable[..., Any], tmp_path: Path) -> None:
    """Profile, surface and case; the profile's file reads back as the same shape, with its unit."""
    options = [word for setting in RING for word in ("--set", setting)]
    done = fenwear("shape", "ring-on-ring", *options, "-o", "made", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["loads"][0]["left_to_run_in"] < 1e-9
    (tmp_path / "case.toml").write_text('base = "ring-on-ring"\npunch.profile = {file = "made/profile.csv"}\n')
    for case in (load_case(tmp_path / "case.toml"), load_case(tmp_path / "made" / "case.toml")):
        profile = case.punch.profile
        assert profile is not None
        np.testing.assert_allclose(np.array(profile.points)[:, 1], told["depth"], atol=1e-12)
    stl = (tmp_path / "made" / "surface.stl").read_bytes()
    triangles = np.frombuffer(stl, TRIANGLE, offset=84)
    sides = triangles["corners"][:, 1:] - triangles["corners"][:, :1]
    area = np.linalg.norm(np.cross(sides[:, 0].astype(float), sides[:, 1].astype(float)), axis=1).sum() / 2
    assert area == pytest.approx(np.pi * (30**2 - 20**2), rel=1e-4)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([[20, 0], [25, 1]], r"punch\.profile\.points: spans x = 20 to 25 mm, but the contact surface 20 to 30 mm"),
        ([[20, 0], [20, 1], [30, 0]], r"punch\.profile\.points: two points are at the same place"),
        ([[20, 0, 0], [30, 0, 0], [25, 1, 0]], r"punch\.profile\.points: expected rows \[x, depth\] for this model"),
        ([[20, "1 N"], [30, 0]], r"punch\.profile\.points\.0\.1: .*mm"),
    ],
)
def test_bad_profiles(points: list[list[Any]], message: str) -> None:
    """By key, with what was expected."""
    tables = load_case("ring-on-ring", ["geometry.degree=1", "geometry.parameters.across=4"]).resolved()
    tables["punch"]["profile"] = {"points": points}
    with pytest.raises(CaseError, match=message):
        assemble(make_case(tables))


def test_bad_files(tmp_path: Path) -> None:
    """A column without a unit, and one that nobody knows."""
    for text, message in (("x (mm),depth\n0,0\n1,0\n", "column 'depth': has no unit"),
                          ("x (mm),heigth (um)\n0,0\n1,0\n", "column 'heigth': not known.*did you mean 'height'"),
                          ("x (mm),y (mm)\n0,0\n1,0\n", "expected the columns x and depth or height")):  # fmt: skip
        (tmp_path / "profile.csv").write_text(text)
        (tmp_path / "case.toml").write_text('base = "example1"\nstrip.profile = {file = "profile.csv"}\n')
        with pytest.raises(CaseError, match=f"strip.profile.file: .*{message}"):
            load_case(tmp_path / "case.toml")


@pytest.mark.parametrize("loads", [((0.0, 1.0),), ((1.0, -1.0),)])
def test_bad_loads(assembled: Callable[..., Tribosystem], loads: Any) -> None:
    """A share or factor that is not positive."""
    with pytest.raises(CaseError, match="--load: expected positive numbers"):
        initial_shape(assembled("example2", *SMALL), loads)


def wanted(system: Tribosystem, name: str) -> Any:
    """Return a pressure that no flat surface has, and that balances the loads: lowest in the middle, and zero there."""
    rigid, ratio = system.elastic.interfaces[0].rigid, system.phases.ratios()[0]
    s = system.pair.punch.places
    s = (2 * s - s.min(axis=0) - s.max(axis=0)) / np.ptp(s, axis=0)
    form = 1 + (s**2).sum(axis=1)
    if name != "ring-on-ring":
        form = np.where((s**2).sum(axis=1) < 0.05, 0.0, form)
    shares = form[:, None] * rigid.rigid_normal
    return shares @ np.linalg.solve(rigid.equilibrium(ratio) @ shares, -rigid.resultant)


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("example1", (*SMALL, "contact.friction=0.3")),
        ("ring-on-ring", RING),
        ("pin-on-disc", ("geometry.degree=1", "geometry.order=1")),
        ("ball-on-flat", ("geometry.degree=1", "geometry.order=1", "grid.nodes=17")),
    ],
)
def test_a_wanted_pressure(assembled: Callable[..., Tribosystem], name: str, settings: tuple[str, ...]) -> None:
    """A punch made so has that pressure in its first contact, at every node: plane with friction, ring, solid, grid."""
    system = assembled(name, *settings)
    pressure = wanted(system, name)
    assert pressure.min() >= 0
    shape = shape_for_pressure(system, pressure)
    assert shape.depth.min() >= 0
    own = made_with(system, shape.depth)
    found = own.phase_contact((0,)).solve(own.gap(0, own.unworn())).pressure[0]
    np.testing.assert_allclose(found, pressure, rtol=0, atol=1e-8 * pressure.max())


def test_pressures_that_balance_forbids(assembled: Callable[..., Tribosystem]) -> None:
    """Named are the rigid modes, with what the pressure carries and what it must; a small rest is corrected."""
    system = assembled("example1", *SMALL)
    ratio, rigid, x = system.phases.ratios()[0], system.elastic.interfaces[0].rigid, system.pair.x
    with pytest.raises(CaseError, match=r"lambda_F; loads and friction need 10000 N") as failure:
        shape_for_pressure(system, pressure_at(system.pair.punch, "20 + 0.2*x"))
    assert f"carries {20 * 600:g} N along lambda_F" in str(failure.value)
    assert "N mm along lambda_M" in str(failure.value)
    with pytest.raises(CaseError, match="--pressure: expected numbers of zero or more"):
        shape_for_pressure(system, x)
    with pytest.raises(CaseError, match="--pressure: expected a CSV file or an expression"):
        pressure_at(system.pair.punch, "20 +")
    exact = wanted(system, "example1")
    near = shape_for_pressure(system, 1.003 * exact)
    assert near.largest_pressure[0] == pytest.approx(exact.max(), rel=1e-8)
    np.testing.assert_allclose(rigid.equilibrium(ratio) @ exact, -rigid.resultant, rtol=1e-9)


def test_a_wanted_pressure_of_a_file(fenwear: Callable[..., Any], tmp_path: Path) -> None:
    """The command reads the table, and says how exactly the pressure is met."""
    r = np.linspace(20, 30, 9)
    (tmp_path / "c.csv").write_text(
        "r (mm),pressure (MPa)\n" + "".join(f"{a},{2000 / (2 * np.pi * 10 * a)}\n" for a in r)
    )
    options = [word for setting in RING for word in ("--set", setting)]
    done = fenwear("shape", "ring-on-ring", *options, "--pressure", "c.csv", "-o", "made", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["loads"][0]["left_to_run_in"] < 1e-8
    assert {one.name for one in (tmp_path / "made").iterdir()} == {"case.toml", "profile.csv", "surface.stl"}
    wrong = fenwear("shape", "ring-on-ring", *options, "--pressure", "40", "-o", "wrong", cwd=tmp_path)
    assert wrong.returncode == 2
    assert "loads and friction need 2000 N" in wrong.stderr
