"""Flash temperatures of runs on contact grids: balances, published temperatures, and one way against another."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fenwear import CaseError, load_case, run_case
from fenwear.results import flash_source
from fenwear.results.flash_temperatures import FlashTemperatures, flash_temperatures
from fenwear.results.hdf5 import load

STEEL = (
    "materials.steel.conductivity='46 W/(m K)'",
    "materials.steel.heat_capacity='460 J/(kg K)'",
    "materials.steel.density='7800 kg/m^3'",
)
KAPPA = 46 / (460 * 7800) * 1e6
QUIET = (
    "output.report=false",
    "output.uncertainty=false",
    "output.fields_at=[]",
    "run.integration='implicit'",
    "run.half_cycles=2",
    "grid.size=['0.3 mm', '0.3 mm']",
)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Return run(name, *settings): the folder of a small run on a grid, made once."""
    made: dict[tuple[str, ...], Path] = {}

    def run(name: str, *settings: str) -> Path:
        key = (name, *settings)
        if key not in made:
            folder = tmp_path_factory.mktemp("flash") / "run"
            run_case(load_case(name, [*QUIET, *settings]), "flash", folder, lambda _: None, progress="none")
            made[key] = folder
        return made[key]

    return run


BALL = ("ball-on-flat", "grid.nodes=33", "motion.positions=3")
FAR = ("geometry.parameters.stroke=0.6", "motion.amplitude=0.6", "motion.period=0.01")


def _check(found: FlashTemperatures, power: float) -> None:
    """Check that heat is whole and that both surfaces are as warm where they touch."""
    assert sum(found.powers) == pytest.approx(power, rel=1e-6)
    levels = found.bulk or (0.0, 0.0)
    one, two = (flash + level for flash, level in zip(found.flash, levels, strict=True))
    assert np.abs(one - two)[found.heating.touching].max() < 1e-5 * found.flash[0].max()
    assert not found.heat[0][~found.heating.touching].any()


def test_to_and_fro(run: Callable[..., Path]) -> None:
    """Power of friction, bodies that are alike, what debris takes; and as Hertz' heat at rest, that slow a motion."""
    found = flash_temperatures(run(*BALL), STEEL)
    assert found.way == "harmonics"
    power = 0.6 * 20 * 4 * 0.1 / 0.1  # mu F times twice the stroke in a period
    _check(found, power)
    assert found.powers[0] == pytest.approx(power / 2, rel=0.01)
    assert found.bulk is None
    carried = flash_temperatures(run(*BALL), (*STEEL, "heat.debris=0.25"))
    assert np.allclose(carried.flash, 0.75 * np.array(found.flash), rtol=1e-6, atol=1e-8)
    # Nearly at rest each moment: 3 Q / (8 a K), both sharing; the largest Q is pi / 2 times the mean.
    a = (3 * 20 * 5 / (4 * 210e3 / (2 * (1 - 0.3**2)))) ** (1 / 3)
    assert found.flash[0].max() == pytest.approx(3 * power * np.pi / 4 / (8 * a * 46), rel=0.08)


def test_bodies_that_are_cooled(run: Callable[..., Path]) -> None:
    """Held far from the contact both surfaces are at one temperature, and the half-spaces and bodies add up to it."""
    held = [f"{body}.temperatures=[{{on='{body}_{end}',temperature={t}}}]" for body, end, t in
            (("punch", "top", 3.0), ("strip", "bottom", 1.0))]  # fmt: skip
    found = flash_temperatures(run(*BALL), (*STEEL, *held))
    assert found.bulk is not None
    _check(found, 48.0)
    assert found.bulk[0] == pytest.approx(3.0, abs=0.1)
    assert found.powers[0] < found.powers[1]  # heat passes from the warmer body to the other


@pytest.mark.parametrize("speed", [30.0, 1000.0])
def test_one_way_against_tian_and_kennedy(run: Callable[..., Path], speed: float) -> None:
    """A Hertzian pressure on steel that passes, which takes all the heat: within 3 % of the published largest."""
    motion = f"motion={{kind='one-way',speed={speed},duration=0.01,direction='rightward'}}"
    unworn = ("wear.punch.coefficient=1e-13", "unset=wear.strip", "run.half_cycles=1")
    folder = run("ball-on-flat", "grid.nodes=65", motion, *unworn)
    found = flash_temperatures(folder, (*STEEL, "heat.partition=0"))
    assert found.way == "steady"
    a = (3 * 20 * 5 / (4 * 210e3 / (2 * (1 - 0.3**2)))) ** (1 / 3)
    mean = 0.6 * speed * 20 / (np.pi * a**2)
    fitted = 2.32 * mean * a / (46 * np.sqrt(np.pi * (1.234 + speed * a / (2 * KAPPA))))
    assert found.flash[1].max() == pytest.approx(fitted, rel=0.03)
    assert not found.flash[0].any()
    both = flash_temperatures(folder, STEEL)
    _check(both, 0.6 * speed * 20)
    assert both.powers[0] < both.powers[1]


def test_long_strokes_by_instants(run: Callable[..., Path], monkeypatch: pytest.MonkeyPatch) -> None:
    """Instants with all that was before them are the harmonics' temperatures, but for shares that had changed."""
    folder = run("ball-on-flat", "grid.nodes=25", "motion.positions=3", *FAR)
    whole = flash_temperatures(folder, STEEL)
    monkeypatch.setattr(flash_source, "CELLS", 0.0)
    found = flash_temperatures(folder, STEEL)
    assert (whole.way, found.way) == ("harmonics", "instants")
    _check(found, sum(found.powers))
    for body in range(2):
        for t, flash in zip(found.heating.times, found.flash[body], strict=True):
            near = np.abs(whole.heating.times - t).argsort()[:2]
            apart = np.abs(whole.heating.times[near] - t)
            there = np.tensordot(apart[::-1] / apart.sum(), whole.flash[body][near], 1)
            assert np.abs(flash - there).max() < 0.015 * whole.flash[0].max()


def test_stick_and_slip(run: Callable[..., Path]) -> None:
    """Heat is what friction does in the time steps of a cycle that goes on from the end."""
    small = ("geometry.parameters.across=4", "grid.nodes=11", "grid.size=['0.34 mm', '0.34 mm']")
    folder = run("fretting-sphere", *small, "stick.steps=6")
    found = flash_temperatures(folder, STEEL)
    system = found.heating.placed
    work = system.pair.weights[found.heating.window.nodes]
    power = (found.heating.heat * work).sum() / len(found.heating.times)
    _check(found, power)
    assert found.powers[0] == pytest.approx(power / 2, rel=1e-3)
    longer = run("fretting-sphere", *small, "stick.steps=6", "run.half_cycles=4")
    done = load(longer / "history.nc").friction_work.values
    assert power == pytest.approx((done[3] - done[1]) / 0.1, rel=1e-5)  # steps are solved to 1e-7


def test_command(run: Callable[..., Path], fenwear: Callable[..., Any], tmp_path: Path) -> None:
    """Numbers, maps and pictures; what the bulge would do."""
    folder, more = run(*BALL), "materials.steel.expansion='12e-6 1/K'"
    settings = [word for one in (*STEEL, more) for word in ("--set", one)]
    done = fenwear("flash", folder, "--json", "-o", tmp_path / "maps", *settings)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    maps = load(tmp_path / "maps" / "flash.nc")
    assert maps.flash_strip.max() == pytest.approx(told["strip"]["largest_flash_K"])
    assert {path.name for path in (tmp_path / "maps").iterdir()} == {"flash.nc", "flash.png", "flash_course.png"}
    assert 0 < told["thermal_feedback"] < 0.1
    assert "loses heat nowhere" in told["warnings"][0]
    cooled = [*settings, "--set", 'heat.convection="20 W/(m^2 K)"', "--json", "-o", tmp_path / "ranks"]
    done = [fenwear("flash", folder, *cooled, ranks=ranks) for ranks in (1, 2)]
    one, two = (json.loads(each.stdout) for each in done)
    for body in ("punch", "strip"):
        assert one[body] == pytest.approx(two[body], rel=1e-9)
    done = fenwear("flash", folder, *settings)
    assert "share of the heat into the punch 5" in done.stdout or "share of the heat into the punch 4" in done.stdout


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ((), "materials.steel.conductivity: missing"),
        (("contact.friction=0.3",), "contact.friction is of the run itself"),
        ((*STEEL, "heat.conductance='layer'"), "heat.conductance: expected a number"),
        ((*STEEL, "heat.conductivity=3"), "heat.conductivity: unknown key"),
        ((*STEEL, "heat.steps=3"), "^heat.steps: "),
        ((*STEEL, "heat.inflow=3"), "heat.inflow: expected one-way sliding"),
    ],
)
def test_refused(run: Callable[..., Path], settings: tuple[str, ...], message: str) -> None:
    """What is missing or of something else is said by its key."""
    with pytest.raises(CaseError, match=message):
        flash_temperatures(run(*BALL), settings)


def test_refused_without_memory(run: Callable[..., Path], monkeypatch: pytest.MonkeyPatch) -> None:
    """What does not fit is said before it is tried."""
    folder = run(*BALL)
    for module in ("bodies.distributed_mesh", "system.contact_grids"):  # of the same run set up again
        monkeypatch.setattr(f"fenwear.{module}.check_memory", lambda *_, **__: None)
    monkeypatch.setattr("fenwear.common.parallel.SMALL", 0)
    monkeypatch.setattr("fenwear.common.parallel.free_memory", lambda: 1e6)
    with pytest.raises(CaseError, match=r"grid\.nodes: .*1"):
        flash_temperatures(folder, STEEL)


def test_program_on_a_grid_that_grows(run: Callable[..., Path]) -> None:
    """Of the motion of its last step, on the grid that the run has come to: as the same motion and load all along."""
    grid = ("grid.across=12", "unset=wear.strip", "wear.punch.coefficient=3e-7")
    steps = "program={steps=[{cycles=20,period=0.2},{cycles=20,period=0.1}]}"
    jumps = ("run.integration='jump'", "unset=run.half_cycles")
    found = flash_temperatures(run("ball-on-flat", *grid, steps, *jumps), STEEL)
    _check(found, 48.0)
    whole = flash_temperatures(run("ball-on-flat", *grid, "run.integration='jump'", "run.half_cycles=80"), STEEL)
    assert found.heating.window.sides == pytest.approx(whole.heating.window.sides)
    assert found.flash[1].max() == pytest.approx(whole.flash[1].max(), rel=1e-3)


def test_refused_turning_about_the_contact(run: Callable[..., Path]) -> None:
    """A strip that turns below the punch slides in all directions there."""
    turns = "motion={kind='rotation',angular_speed=1,duration=0.1,centre=[0.25,0,0]}"
    folder = run("ball-on-flat", "grid.nodes=17", turns, "run.half_cycles=1", "unset=wear.strip")
    with pytest.raises(CaseError, match=r"motion\.centre:"):
        flash_temperatures(folder, STEEL)


def test_refused_without_a_grid(tmp_path: Path) -> None:
    """Nothing that is no run on a grid."""
    for name, key in (("example1", "model.kind"), ("ball-on-flat", "grid"), ("example1-heat", "heat")):
        (tmp_path / "case.toml").write_text(load_case(name).to_toml())
        with pytest.raises(CaseError, match=f"^{key}: "):
            flash_temperatures(tmp_path)
