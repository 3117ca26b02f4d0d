"""Contact with heat that has one answer, and contact that has several."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from fenwear import ConvergenceError, Tribosystem, assemble, evolve, jump, load_case, march, run_case
from fenwear.case.program import stages_of
from fenwear.common.arrays import Array
from fenwear.steps import explicit_growth, heat_gain, heat_warnings
from fenwear.steps.program_stages import at_stage
from fenwear.system import heating_friction, vary, with_reduced_heat

NAME = "ring-on-ring-heat"
SMALL = ("geometry.degree=2", "geometry.parameters.across=8")
PLANE = ("geometry.degree=2", "geometry.parameters.elements_along_contact=8")
SOLID = (
    "geometry.degree=1", "geometry.order=1", "geometry.parameters.across=3", "geometry.parameters.along=3",
    "geometry.parameters.pad_layers=2", "geometry.parameters.disc_layers=2",
)  # fmt: skip
SHARP = ("heat.split_tolerance=1e-8",)
HALF_CYCLES = 200


def dense(system: Tribosystem) -> tuple[Array, Array, Array, Array]:
    """Return S + Theta, S, H and E of full contact, made column by column from the compliance and the heat."""
    n, interface, exchange = len(system.pair.weights), system.elastic.interface, system.exchange
    uniform = np.full(n, system.rigid.mean_pressure)
    states, _ = exchange.change(0, exchange.conductance(uniform), pressure=np.eye(n))
    ratio = system.phases.middle_ratio(1)
    compliance = interface.compliance(ratio).matrix()
    rigid = interface.rigid
    return compliance + exchange.gap_change(states), compliance, rigid.rigid_normal, rigid.equilibrium(ratio)


def both(matrix: Array, modes: Array, rows: Array) -> Array:
    zeros = np.zeros((len(rows), modes.shape[1]))
    return np.block([[matrix / np.abs(matrix).max(), modes], [rows, zeros]])


@pytest.mark.mpi
def test_the_gain_is_one_where_contact_and_heat_are_singular(assembled: Callable[..., Tribosystem]) -> None:
    """The determinant of contact with heat over that without changes its sign just where the gain passes 1."""
    gain = heat_gain(assembled(NAME, *SMALL, "contact.friction=0.45"))
    assert gain is not None
    signs = []
    for factor in (0.999, 1.001):
        system = assembled(NAME, *SMALL, f"contact.friction={factor * 0.45 / gain}")
        near = heat_gain(system)
        assert near == pytest.approx(factor, rel=1e-4)
        assert bool(heat_warnings(near)) == (factor > 1)
        hot, cold, modes, rows = dense(system)
        signs.append(np.linalg.slogdet(both(hot, modes, rows))[0] * np.linalg.slogdet(both(cold, modes, rows))[0])
    assert signs[0] == -signs[1] != 0


@pytest.mark.parametrize("name", [NAME, "example2-heat"])
def test_the_gain_is_of_the_tangent_where_friction_depends_on_pressure(
    assembled: Callable[..., Tribosystem], name: str
) -> None:
    """The derivative of contact with heat by the pressure changes its sign where the gain passes 1: mu = a + b p."""
    small = SMALL if name == NAME else PLANE
    system = assembled(name, *small, "contact.friction={table=[[0.0, 0.2], [1e4, 0.2]], of='p'}")
    n, mean = len(system.pair.weights), system.rigid.mean_pressure
    even = np.full(n, mean)

    def of_friction(mu: float) -> tuple[Tribosystem, float]:
        law = f"contact.friction={{table=[[0.0, {mu}], [{100 * mean}, {101 * mu}]], of='p'}}"
        found = vary(system, law)
        gain = heat_gain(found, np.array([even] * len(found.motion.phases)))
        assert gain is not None
        return found, gain

    def determinant(own: Tribosystem, *, heated: bool) -> float:
        phase, exchange = own.motion.positions // 2, own.exchange
        rigid = own.elastic.interfaces[phase].rigid

        def force(pressure: Array) -> Array:
            mu = own.laws.friction.values(own.phases.conditions(phase, pressure))
            ratio = own.phases.ratio(phase, mu)
            gap = own.elastic.interfaces[phase].compliance(ratio).matrix() @ pressure
            if heated:
                heating = heating_friction(own, mu, phase)
                made = exchange.with_friction(np.array([heating] * len(own.motion.phases)))
                states, _ = made.change(phase, exchange.conductance(even), pressure=pressure[:, None])
                gap = gap + made.gap_change(states, phase)[:, 0]
            return np.concatenate([gap / own.elastic.interface.elastic_length, rigid.equilibrium(ratio) @ pressure])

        step = 1e-4 * mean
        columns = [(force(even + step * e) - force(even - step * e)) / (2 * step) for e in np.eye(n)]
        modes = np.vstack([rigid.rigid_normal, np.zeros((rigid.rigid_normal.shape[1],) * 2)])
        return float(np.linalg.slogdet(np.hstack([np.array(columns).T, modes]))[0])

    singular = brentq(lambda mu: of_friction(mu)[1] - 1, 0.02, 1.0, rtol=1e-3)
    signs = []
    for factor in (0.97, 1.03):
        own, gain = of_friction(factor * singular)
        assert (gain > 1) == (factor > 1)
        signs.append(determinant(own, heated=True) * determinant(own, heated=False))
    assert signs == [1.0, -1.0]


def test_beyond_it_contact_has_several_answers(assembled: Callable[..., Tribosystem]) -> None:
    """Surfaces so worn that the even pressure is an answer: at mu = 0.45, where fenwear warns, there are others that
    satisfy g + S p + Theta p + H a >= 0, p >= 0 with the load; at the built-in friction there is none."""
    others = []
    for mu in (0.1, 0.45):
        system = assembled(NAME, *SMALL, f"contact.friction={mu}")
        assert bool(heat_warnings(heat_gain(system))) == (mu == 0.45)
        hot, _, modes, rows = dense(system)
        n, r = modes.shape
        even = np.full(n, system.rigid.mean_pressure)
        matrix = both(hot, modes, rows)
        shape = -matrix[:n, :n] @ even
        away = []
        for low, high in itertools.combinations(range(n + 1), 2):  # contact on all nodes between two
            kept = np.append(np.arange(low, high), n + np.arange(r))
            right = np.append(-shape, -system.rigid.resultant)
            solved: Array = np.zeros(n + r)
            solved[kept] = np.linalg.solve(matrix[np.ix_(kept, kept)], right[kept])
            pressure, gap = solved[:n], shape + matrix[:n] @ solved
            if pressure.min() >= 0 and gap.min() > -1e-9 * np.abs(shape).max():
                away.append(float(np.abs(pressure - even).max() / even[0]))
        others.append(away)
    assert max(others[0]) < 1e-8
    assert max(others[1]) > 0.5


def test_a_run_and_the_steady_state_say_so(fenwear: Callable[..., Any], tmp_path: Any) -> None:
    """The warning of check, run and steady, and none at the built-in friction."""
    small = [word for one in ("geometry.degree=2", "geometry.parameters.across=4") for word in ("--set", one)]
    for command in (("check",), ("steady",), ("run", "--set", "run.half_cycles=1", "-o", str(tmp_path / "out"))):
        name, *more = command
        done = fenwear(name, NAME, *small, *more, "--set", "contact.friction=0.45", "--set", "output.report=false")
        assert "several solutions" in done.stderr
    done = fenwear("check", NAME, *small)
    assert "several solutions" not in done.stderr


def last_cycles(system: Tribosystem) -> dict[str, tuple[Array, Array]]:
    """Return pressures (phases, n) and strip temperatures (cycle, n) of a last cycle by every way to run a case."""
    found = {}
    ways = {
        "explicit": system,
        "implicit": system,
        "split": vary(system, "heat.coupling=split", *SHARP),
        "jump": system,
    }
    for way, own in ways.items():
        if way == "jump":
            *_, block = jump(own, HALF_CYCLES, tolerance=1e-3)
        elif way != "split":
            *_, block = march(own, HALF_CYCLES, implicit=way != "explicit")
        else:
            try:
                *_, block = march(own, HALF_CYCLES, implicit=True)
            except ConvergenceError:  # a node that opens and closes in turn: which it says
                continue
        assert block.heat is not None
        cycle = slice(-system.motion.half_cycles, None)
        found[way] = (block.pressure[cycle].reshape(-1, len(system.pair.weights)), block.heat.temperature_strip[cycle])
    return found


def apart(one: tuple[Array, Array], other: tuple[Array, Array]) -> float:
    return max(float(np.abs(a - b).max() / np.abs(b).max()) for a, b in zip(one, other, strict=True))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("example2-heat", (*PLANE, "contact.friction=0.5")),
        ("brake-pad", SOLID),
    ],
)
def test_all_ways_agree_where_the_heat_gives_back_less(
    assembled: Callable[..., Tribosystem], name: str, settings: tuple[str, ...]
) -> None:
    """Below a gain of 1 explicit and implicit steps, jumps and the split come to the same, to what their steps and
    tolerances leave: explicit and implicit ones to a part that falls with the wear of a step."""
    system = with_reduced_heat(assembled(name, *settings))
    gain = heat_gain(system)
    assert gain is not None
    assert gain < 1
    assert explicit_growth(system) is None
    found = last_cycles(system)
    assert found.keys() >= {"explicit", "implicit", "jump"}
    for way, one in found.items():
        assert apart(one, found["implicit"]) < (1e-3 if way == "split" else 1e-2), way


@pytest.mark.parametrize(("mu", "fails"), [(0.185, False), (0.189, True)])
def test_explicit_wear_fails_before_there_are_several_answers(
    assembled: Callable[..., Tribosystem], mu: float, fails: bool
) -> None:
    """At gains of 0.96 and 0.98 implicit steps settle; explicit ones do so just where `explicit_growth` says so."""
    system = assembled(NAME, *SMALL, f"contact.friction={mu}")
    assert not heat_warnings(heat_gain(system))
    assert (explicit_growth(system) is not None) == fails
    *_, implicit = march(system, 600, implicit=True)
    *_, explicit = march(system, 600)
    assert implicit.periodicity[-1] < 1e-3
    assert (explicit.periodicity[-10:].max() > 1e-2) == fails


def test_of_a_program_the_worst_stage_is_told(tmp_path: Path) -> None:
    """The gain and its warning are those of the fast stage in the middle; differences are the largest of all."""
    stages = [10, 40, 10]
    steps = ", ".join(f"{{cycles=2, angular_speed={speed}}}" for speed in stages)
    settings = [*SMALL, "unset=run.half_cycles", "run.integration=implicit", "contact.friction=0.1"]
    case = load_case(NAME, [*settings, "output.report=false", f"program.steps=[{steps}]"])
    summary, _ = run_case(case, output=tmp_path / "out", progress="none", log=lambda _: None)
    fast = assemble(load_case(NAME, [*SMALL, "motion.angular_speed=40", "contact.friction=0.1"]))
    gain, difference = heat_gain(fast), summary["heat_difference_from_whole_mesh"]
    assert summary["heat_gain"] == pytest.approx(gain, rel=1e-4)
    told = []
    for stage in stages_of(case):
        system = at_stage(assemble(case), stage)
        assert system.exchange.fineness is not None
        told.append(system.exchange.fineness.difference)
    assert difference == pytest.approx(max(told), rel=1e-6)
    assert any("several" in text for text in summary["warnings"])


def test_implicit_steps_follow_hot_bands() -> None:
    """Bands of contact come and go within ten turns (Burton)."""
    turns = ("motion.angular_speed='30 rad/s'", "motion.duration='0.2 s'", "run.half_cycles=1000")
    system = assemble(load_case("ring-on-ring-heat", [*turns, "geometry.parameters.across=8"]))
    bands = [block.pressure > 0 for block in evolve(system, 60, integration="implicit")]
    closed = np.concatenate(bands)
    assert (closed[:-10] != closed[10:]).any(axis=1).mean() > 0.8
    assert 0.1 < closed.mean() < 0.9
