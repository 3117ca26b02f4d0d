"""Creep of bodies and of a layer in gross sliding: marches, jumps, ends and resumed runs agree; wrong input is told."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from combinations import SMALL
from mpi4py import MPI

from fenwear import Case, CaseError, ConvergenceError, Tribosystem, assemble, load_case, march, steady
from fenwear.laws.wear import WornDepths
from fenwear.results.stored_history import load_history
from fenwear.steps import Block, decay_rates, evolve, growth_rate
from fenwear.steps.coupled_phases import cycle_heat
from fenwear.steps.run_state import all_phases
from fenwear.steps.tangent import phase_tangent
from fenwear.studies.run import run_case
from fenwear_verify.bodies import two_blocks

TERMS = "{terms=[{compliance=0.5, time='20 s'}, {compliance=1, time='400 s'}]}"
LAYER = f"contact.layer={{kind='linear', stiffness='1e6 MPa/mm', creep={TERMS}}}"
WHO = {
    "punch": (f"punch.creep={TERMS}",),
    "strip": (f"strip.creep={TERMS}", "motion.positions=3"),
    "layer": (LAYER,),
    "all": (f"punch.creep={TERMS}", f"strip.creep={TERMS}", LAYER, "motion.positions=3"),
}


def case_of(*more: str) -> Case:
    fast = ("motion.period='1 s'", "wear.punch.coefficient='1e-6 1/MPa'", "run.half_cycles=80")
    return load_case("fretting-partial-slip", [*SMALL, "contact.law='gross-sliding'", "stick={}", *fast, *more])


def end(system: Tribosystem, how: str, count: int | None = None, tolerance: float = 1e-4) -> Block:
    block = list(evolve(system, count, integration=how, tolerance=tolerance))[-1]
    assert block.equilibrium_error.max() < 1e-12
    assert block.complementarity_error.max() < 1e-9
    return block


def crept(block: Block) -> np.ndarray:
    return block.system.elastic.creep.depth(block.end.worn.crept)


@pytest.mark.parametrize("who", WHO)
def test_marches_and_jumps_agree(who: str) -> None:
    """In depths that are worn and that have crept; the load is carried."""
    system = assemble(case_of(*WHO[who]))
    marched, jumped = end(system, "implicit"), end(system, "jump")
    for one, other in ((marched.end.worn.punch, jumped.end.worn.punch), (crept(marched), crept(jumped))):
        assert np.abs(one - other).max() < 2e-3 * np.abs(one).max()
    explicit = end(system, "explicit")
    assert np.abs(crept(explicit) - crept(marched)).max() < 1e-2 * np.abs(crept(marched)).max()


@pytest.mark.parametrize("who", [pytest.param(one, marks=() if one == "all" else pytest.mark.slow) for one in WHO])
def test_runs_end_in_the_steady_state(who: str) -> None:
    """With the compliances that the bodies come to in the end: pressures, shapes and what has crept."""
    system = assemble(case_of(*WHO[who], "wear.punch.coefficient='1e-4 1/MPa'"))
    state, last = steady(system), end(system, "jump", 400_000, 1e-2)
    assert state.crept is not None
    assert np.abs(last.pressure[-1] - state.pressure[-1]).max() < 1e-6 * state.pressure.max()
    assert np.abs(crept(last) - state.crept).max() < 1e-6 * np.abs(state.crept).max()
    touched = ~np.isnan(state.shape) & (state.pressure > 0).any(axis=0)
    apart = (last.end.worn.punch - state.shape)[touched]
    assert np.ptp(apart) < 1e-6 * np.ptp(state.shape[touched])


def blocks(punch: dict[str, Any], strip: dict[str, Any], duration: float) -> Tribosystem:
    """Return two bars on each other, 2 mm of E = 1000 MPa on 3 mm of 500 MPa, nu = 0."""
    bars = ({"young": 1000.0, "poisson": 0.0}, {"young": 500.0, "poisson": 0.0})
    sizes = {"width": 1.0, "punch_height": 2.0, "strip_height": 3.0}
    motion = {"kind": "one-way", "axis": "y", "direction": "rightward", "speed": 1.0, "duration": duration}
    return two_blocks(*bars, sizes, punch=punch, strip=strip, motion=motion)


def test_a_bar_gets_shorter() -> None:
    """By J(t) / J(0) - 1 times its elastic shortening under a constant load, of both bodies, at every time."""
    one, other = ({"terms": [{"compliance": c, "time": tau}]} for c, tau in ((0.5, 2.0), (3.0, 7.0)))
    system = blocks({"creep": one}, {"creep": other}, 1.0)
    first = system.phase_contact((0,)).solve(system.gap(0, system.unworn())).rigid[0, 0]
    block = next(march(system, 20))
    time = np.arange(1, 21)
    shorter = [2 / 1000 * 0.5 * -np.expm1(-time / 2), 3 / 500 * 3.0 * -np.expm1(-time / 7)]
    found = system.elastic.creep.depths(block.crept.T)
    for name, exact in zip(("punch", "strip"), shorter, strict=True):
        assert np.abs(found[name] - exact).max() < 1e-9 * exact.max()
    assert block.rigid[:, 0] - first == pytest.approx(-sum(shorter), rel=1e-9)
    assert block.pressure == pytest.approx(1.0, rel=1e-9)


def test_a_pressure_relaxes_under_supports_that_have_moved() -> None:
    """By the relaxation function that belongs to J; moved supports do not creep. Errors fall with the half-cycles."""
    moved = {"supports": [{"on": "punch_far", "fix": ["x", "z"], "by": [0.0, -0.01]}], "loads": []}
    creep, wrong = {"terms": [{"compliance": 1.5, "time": 1.0}]}, []
    for steps in (10, 20):
        system = blocks({**moved, "creep": creep}, {"creep": creep}, 1 / steps)
        first = system.phase_contact((0,)).solve(system.gap(0, system.unworn())).pressure.mean()
        pressure = next(march(system, 2 * steps)).pressure.mean(axis=1)
        time = np.arange(1, 2 * steps + 1) / steps
        exact = 0.01 / (2 / 1000 + 3 / 500) * (1 + 1.5 * np.exp(-2.5 * time)) / 2.5
        wrong.append(float(np.abs(pressure - exact).max()))
        assert first == pytest.approx(0.01 / (2 / 1000 + 3 / 500), rel=1e-9)
    assert wrong[1] < 0.05 * first
    assert wrong[0] / wrong[1] == pytest.approx(2, abs=0.2)


@pytest.mark.parametrize("tau", [0.002, 0.05, 0.6])
@pytest.mark.parametrize("how", ["explicit", "jump"])
def test_creep_faster_than_a_half_cycle(how: str, tau: float) -> None:
    """A layer between stiff bodies under a load that varies within each half-cycle, in one phase: the exact history."""
    stiff = [f"materials.{name}.young='1e9 MPa'" for name in ("steel", "composite")]
    mesh = ["geometry.degree=1", "geometry.parameters.elements_along_contact=4", "geometry.parameters.edge_grading=1"]
    load = "punch.loads=[{on='punch_load', force=['0 N', '-10 kN'], over_cycle=[[0, 0.2], [0.5, 1.8], [1, 0.2]]}]"
    layer = (
        f"contact.layer={{kind='linear', stiffness='1e3 MPa/mm', creep={{terms=[{{compliance=1, time='{tau} s'}}]}}}}"
    )
    system = assemble(load_case("example2", [*mesh, *stiff, load, layer, "wear.punch.coefficient=1e-14"]))
    half, steps = np.pi / 10, 2000
    exact, y = [], 0.0
    for number in range(40):
        ends = (0.2, 1.8) if number % 2 == 0 else (1.8, 0.2)
        load_at = np.interp((np.arange(steps) + 0.5) / steps, (0, 1), ends)
        for v in load_at * (1e4 / 600 / 1e3):
            y = v + (y - v) * np.exp(-half / steps / tau)
        exact.append(y)
    block = end(system, how, 40, 1e-3)
    assert crept(block) == pytest.approx(exact[-1], rel=1e-3)


@pytest.mark.parametrize("load", ["", "punch.loads.0.over_cycle=[[0, 0.9], [0.3, 1.1], [0.7, 0.8], [1, 0.9]]"])
def test_growth_rates_see_creep(load: str) -> None:
    """Small changes of depths and of what has crept become in a cycle what the cycle's tangent makes of them."""
    system = assemble(case_of(*WHO["all"][:-1], "wear.punch.coefficient='1e-4 1/MPa'", *([load] if load else [])))
    creep = system.elastic.creep
    assert creep is not None
    begin = end(system, "jump", 4000, 1e-2).end
    rng = np.random.default_rng(1)
    worn = 1e-9 * rng.random(len(begin.worn.punch))
    state = 1e-9 * rng.random(len(begin.worn.crept))
    other = replace(begin, worn=begin.worn + WornDepths(worn, np.zeros_like(begin.worn.strip), crept=state))
    done = begin.half_cycle + 2
    ends = [next(march(system, done, implicit=True, start=one)) for one in (begin, other)]
    assert (np.diff([one.pressure > 0 for one in ends], axis=0) == 0).all()
    changed = ends[1].end.worn - ends[0].end.worn
    tangent = np.eye(len(state) + len(worn))
    for phase, pressure in enumerate(ends[0].pressure):
        tangent = phase_tangent(system, phase, pressure, cycle_heat(system)) @ tangent
    expected = tangent @ np.concatenate([state, worn])
    assert np.abs(changed.crept - expected[: len(state)]).max() < 1e-6 * 1e-9
    assert np.abs(changed.punch - expected[len(state) :]).max() < 1e-6 * 1e-9
    even = np.full((2, len(worn)), system.rigid.mean_pressure)
    assert decay_rates(system, even)[0] == pytest.approx(growth_rate(system, even), rel=1e-12)


def test_resumed(tmp_path: Path) -> None:
    """A run in parts ends where one in one piece does, with what has crept."""

    def run(name: str, count: int, *, resume: bool = False) -> None:
        case = case_of(*WHO["all"], f"run.half_cycles={count}")
        run_case(case, name, tmp_path / name, lambda _: None, progress="none", resume=resume)

    run("whole", 8)
    run("parts", 4)
    run("parts", 8, resume=True)
    one, other = (load_history(tmp_path / name) for name in ("whole", "parts"))
    for name in ("pressure", "wear", "creep_depth", "creep_depth_strip", "creep_volume_layer"):
        assert np.abs(one[name].values - other[name].values).max() <= 1e-9 * np.abs(one[name].values).max(), name
    assert (np.diff(one["creep_volume"].values) > 0).all()


@pytest.mark.mpi
def test_on_ranks() -> None:
    """All ranks come to what one comes to, in marches and jumps."""
    case = case_of(*WHO["all"])
    for how in ("explicit", "jump"):
        together, alone = (end(assemble(case, comm), how) for comm in (MPI.COMM_WORLD, MPI.COMM_SELF))
        assert np.abs(together.pressure - alone.pressure).max() < 1e-9 * alone.pressure.max()
        assert np.abs(crept(together) - crept(alone)).max() < 1e-9 * np.abs(crept(alone)).max()


def test_growth_without_an_end() -> None:
    """With the logarithm of time jumps agree with marches; there is no steady state."""
    system = assemble(case_of("punch.creep={per_decade=0.3, onset='1 s'}"))
    marched, jumped = end(system, "implicit"), end(system, "jump")
    assert np.abs(crept(marched) - crept(jumped)).max() < 5e-3 * np.abs(crept(marched)).max()
    with pytest.raises(ConvergenceError, match=r"punch\.creep grows with the logarithm of time"):
        steady(system)


@pytest.mark.parametrize(
    ("setting", "text"),
    [
        ("punch.creep={terms=[{compliance=1, time=0}]}", "punch.creep.terms.0.time"),
        ("punch.creep={terms=[{compliance=-1, time=1}]}", "punch.creep.terms.0.compliance"),
        ("strip.creep={}", "strip.creep: expected terms"),
        ("strip.creep={per_decade=1}", "strip.creep.onset"),
        ("strip.creep={per_decade=0, onset=1}", "strip.creep.per_decade"),
    ],
)
def test_what_makes_no_sense_is_refused_by_its_key(setting: str, text: str) -> None:
    """The message names the key."""
    with pytest.raises(CaseError, match=text):
        case_of(setting)


def test_material_that_leaves_the_contact_does_not_creep_there() -> None:
    """A strip that passes under the punch one way takes with it what it has crept."""
    one_way = "motion={kind='one-way', direction='rightward', speed='10 mm/s', duration='0.1 s'}"
    with pytest.raises(CaseError, match=r"strip\.creep:"):
        load_case("example1", [one_way, f"strip.creep={TERMS}"])


def test_a_shaft_that_creeps_comes_to_be_the_same_all_around() -> None:
    """Quarters that pass under the load one after the other differ until they have crept, as its retardation goes on.

    The first one meets a shaft that has not crept, the others what crept before them. What is left of that falls by
    exp(-T / time) in each turn of duration T, or faster, and to nothing in the end.
    """
    turn = (
        "motion={kind='cycle', columns=['time (s)', 'angle_y (deg)'], positions='steps', "
        "rows=[[0, 0], [1, 90], [2, 180], [3, 270], [4, 360]]}"
    )
    settings = (
        "geometry.parameters.elements_along_contact=24",
        "geometry.follow_wear='never'",
        "contact.friction=0",
        "wear={punch={coefficient='1e-15 mm^3/(N mm)'}}",
        "strip.creep={terms=[{compliance=0.5, time='10 s'}]}",
        "run.integration='explicit'",
        "run.half_cycles=16",
        "output.uncertainty=false",
    )
    system, state, apart = assemble(load_case("bushing", [turn, *settings])), None, []
    for turns in (1, 8, 16):
        state = next(march(system, turns, start=state)).end
        pressure = all_phases(state.contacts).pressure
        apart.append(float(np.ptp(pressure, axis=0).max() / pressure.max()))
    assert apart[0] > 1e-2
    assert apart[1] < apart[0] * np.exp(-7 * 0.4) * 1.1
    assert apart[2] < apart[1] * np.exp(-8 * 0.4) * 1.1
