"""Test programs: what acts is what was asked for, and wear, sliding and heat add up over all of it."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fenwear import Case, assemble, load_case, make_case, march, read_history, run_case, steady
from fenwear.case.program import cycle_of, read_program, stages_of
from fenwear.checks import Seen
from fenwear.common.errors import CaseError
from fenwear.steps import Block, at_step, evolve, follow_program
from fenwear.steps import program_stages as program
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import jump_within, march_within
from tests.results.test_contacts import two_pads

Edited = Callable[..., Case]
SMALL = ("geometry.degree=2", "geometry.parameters.elements_along_contact=8", "geometry.follow_wear=never")
K = 1.25 * np.pi * 1e-8  # of the examples, 1/MPa


marched = partial(march_within, implicit=True)
jumped = partial(jump_within, tolerance=3e-3)


def steps_of(steps: list[dict[str, Any]], **more: Any) -> Callable[[dict[str, Any]], object]:
    return lambda tables: tables.update(program={"steps": steps, **more}) or tables["run"].pop("half_cycles")


def test_a_program_ends_where_the_cycles_of_its_last_step_repeat(edited: Edited, tmp_path: Path) -> None:
    """Steps before it go on to their ends, though cycles repeat there; in parts it ends where it does in one piece."""
    limit, first = 0.03, 200
    steps = [{"cycles": first // 2, "load_factor": 0.5}, {"cycles": 5000, "load_factor": 1}]

    def case(count: int, within: float | None = limit) -> Case:
        def change(tables: dict[str, Any]) -> None:
            tables.update(program={"steps": steps}, output={"report": False, "uncertainty": False})
            tables["run"].update(half_cycles=count, integration="implicit")
            tables["run"].update({} if within is None else {"periodic_within": within})

        return edited("example1", change, *SMALL)

    summary, _ = run_case(case(10_200), "whole", tmp_path / "whole", lambda _: None)
    count = summary["half_cycles"]
    assert summary["stop"] == "periodic"
    history = read_history(tmp_path / "whole")
    change = history["periodicity"].values
    assert first < count < 10_200
    assert (change[first - 2 : first] < limit).all()  # it was not asked for
    assert not np.isnan(change[first:][2:]).any()
    repeats = (change[first:] < limit) & (np.append(np.inf, change[first:-1]) < limit)
    assert np.flatnonzero(repeats)[0] == count - first - 1  # the first whole cycle that does
    *_, alone = evolve(assemble(case(count, None)))
    np.testing.assert_allclose(history["pressure"].values[-1], alone.pressure[-1], rtol=0, atol=1e-9)
    run_case(case(first + 3), "parts", tmp_path / "parts", lambda _: None)
    resumed, _ = run_case(case(10_200), "parts", tmp_path / "parts", lambda _: None, resume=True)
    assert resumed["half_cycles"] == count
    with pytest.raises(CaseError, match=r"run\.periodic_within: .*program\.steps\.1\.load_factor"):
        edited(
            "example1",
            steps_of([{"cycles": 9}, {"cycles": 9, "load_factor": [1, 2]}]),
            *SMALL,
            "run.periodic_within=0.1",
        )


def of(blocks: list[Block], name: str) -> np.ndarray:
    return np.concatenate([getattr(block, name) for block in blocks])


def test_load_steps_wear_what_load_and_distance_say(edited: Edited) -> None:
    """Worn area = k sum of F s / t: load steps and ramps, marched and jumped, whatever the pressures are."""
    steps = [
        {"cycles": 20, "load": "5 kN"},
        {"cycles": 20, "load": ["5 kN", "15 kN"]},
        {"distance": "120 mm", "load_factor": 2},
        {"cycles": 10},
    ]
    case = edited("example1", steps_of(steps), *SMALL)
    assert case.run.half_cycles == 2 * (20 + 20 + 20 + 10)
    system = assemble(case)
    path = 6.0 * (5e3 * 20 + 10e3 * 20 + 20e3 * 20 + 20e3 * 10)  # a cycle slides 4 u0
    for way in (marched, jumped):
        blocks = list(follow_program(system, way, RunLimits(case.run.half_cycles)))
        worn = float(system.pair.weights @ blocks[-1].wear[-1])
        assert worn == pytest.approx(K * path / system.bodies.punch.thickness, rel=1e-10), way
        assert of(blocks, "equilibrium_error").max() < 1e-9
        force = of(blocks, "pressure") @ system.pair.weights * system.bodies.punch.thickness
        np.testing.assert_allclose(force, of(blocks, "load"), rtol=1e-9)
    assert set(np.round(of(blocks, "half_cycle")[of(blocks, "load") == 5e3])) <= set(range(1, 42))


def test_distance_where_the_strip_turns() -> None:
    """A turn slides 2 pi R at the radius given, which is warned of beside the contact, from 20 to 30 mm."""
    turning = ("motion={kind='rotation', angular_speed=4, duration=1.5707963267948966}", "program.radius=25")
    case = load_case("ring-on-ring", [*turning, "program.steps=[{distance='3 m'}, {time=4}]", "run.half_cycles=22"])
    first, second = stages_of(case)
    assert (first.end, second.end) == (round(3000 / (2 * np.pi * 25)), 19 + round(4 / (np.pi / 2)))
    with pytest.raises(CaseError, match=r"program\.radius: missing"):
        load_case("ring-on-ring", [turning[0], "program.steps=[{distance='3 m'}]"])
    with pytest.raises(CaseError, match=r"program\.radius: .*motion\.kind = 'reciprocating'"):
        load_case("example1", ["program.radius=3", "program.steps=[{cycles=3}]", "run.half_cycles=6"])
    small = ("geometry.parameters.across=2", "geometry.degree=2", "run.half_cycles=6")
    case = load_case("ring-on-ring", [*turning, *small, "program.radius=31", "program.steps=[{cycles=6}]"])
    (told,) = Seen.of_system(assemble(case)).warnings("system")
    assert told.startswith("program.radius: ")
    assert all(number in told for number in ("31 mm", "20 and 30 mm", "25.33 mm"))  # 2/3 (30³ - 20³) / (30² - 20²)


def test_jumps_meet_the_march_in_a_ramp(edited: Edited) -> None:
    """Shapes and pressures of jumps over a program come near those of a march, as their tolerance falls."""
    steps = [{"cycles": 150, "load": ["4 kN", "12 kN"]}, {"cycles": 50, "load": "6 kN"}]
    case = edited("example1", steps_of(steps), *SMALL, "wear.punch.coefficient=4e-6 1/MPa")
    system = assemble(case)
    exact = list(follow_program(system, marched, RunLimits(case.run.half_cycles)))[-1]
    errors = []
    for tolerance in (3e-2, 1e-3):
        found = list(follow_program(system, partial(jumped, tolerance=tolerance), RunLimits(case.run.half_cycles)))[-1]
        errors.append(np.abs(found.wear[-1] - exact.wear[-1]).max() / exact.wear[-1].max())
    assert errors[1] < 3e-3
    assert errors[1] < errors[0]


def test_stop_braking_slides_and_heats_as_much_as_it_stops(edited: Edited) -> None:
    """A speed that falls to zero under a constant load: s = v t / 2, and friction makes mu F s of heat, which is
    stored, convected, held or carried away."""
    steps = [{"time": "0.4 s", "speed": "100 mm/s"}, {"time": "2 s", "speed": ["100 mm/s", "0 mm/s"]}]

    def brake(tables: dict[str, Any]) -> None:
        tables["motion"] = {"kind": "one-way", "direction": "rightward", "speed": 100, "duration": 0.1}
        tables["heat"]["steps"] = 2
        steps_of(steps, levels=10)(tables)

    case = edited("example1-heat", brake, *SMALL, "heat.reduction_tolerance=1e-3")
    system = assemble(case)
    stages = stages_of(case)
    assert [stage.begin for stage in stages] == [0, *range(4, 24, 2)]
    blocks = list(follow_program(system, marched, RunLimits(case.run.half_cycles)))
    terms = np.concatenate([block.heat.terms for block in blocks])
    distance = 100 * 0.4 + 100 * 2 / 2
    assert terms[:, 0].sum() == pytest.approx(0.25 * 10e3 * distance, rel=1e-9)
    assert max(float(block.heat.balance_error.max()) for block in blocks) < 1e-8
    worn = float(system.pair.weights @ blocks[-1].wear[-1])
    assert worn == pytest.approx(K * 1000 * distance, rel=1e-9)
    assert of(blocks, "time")[-1] == pytest.approx(2.4)
    assert np.all(np.diff(of(blocks, "time")) > 0)
    assert (of(blocks, "speed")[[0, -1]] == [100.0, 5.0]).all()
    hottest = np.concatenate([block.heat.largest_temperature for block in blocks])
    assert 3 < hottest.argmax() < len(hottest) - 1  # it cools while it still slides


def test_amplitude_and_period(edited: Edited) -> None:
    """A longer stroke wears more and a longer period takes longer; a ramp's levels add up to its mean."""
    steps = [
        {"cycles": 3, "amplitude": "1 mm", "period": "0.5 s"},
        {"cycles": 40, "amplitude": ["1 mm", "2 mm"], "period": "1 s"},
    ]
    case = edited("example1", steps_of(steps, levels=8), *SMALL)
    system = assemble(case)
    blocks = list(follow_program(system, jumped, RunLimits(case.run.half_cycles)))
    worn = float(system.pair.weights @ blocks[-1].wear[-1])
    assert worn == pytest.approx(K * 1000 * (3 * 4 * 1.0 + 40 * 4 * 1.5), rel=1e-10)
    assert of(blocks, "time")[-1] == pytest.approx(3 * 0.5 + 40)


def test_stages_that_come_again_are_set_up_once(edited: Edited, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the bits of a program in which every stage is."""
    steps = [{"cycles": 1, "amplitude": "1.5 mm"}, {"cycles": 1, "amplitude": "1 mm"}] * 3
    case = edited("example1-heat", steps_of(steps), *SMALL, "heat.steps=2")
    system, state, made = assemble(case), None, []
    for stage in stages_of(case):
        *_, each = march(program.at_stage(system, stage), stage.end, start=state, implicit=True)
        state = each.end
    set_up = program.at_stage
    monkeypatch.setattr(program, "at_stage", lambda *given: (made.append(given), set_up(*given))[1])
    *_, last = follow_program(system, marched, RunLimits(case.run.half_cycles))
    assert len(made) == 2
    for name in ("pressure", "wear"):
        np.testing.assert_array_equal(getattr(last, name), getattr(each, name), err_msg=name)
    np.testing.assert_array_equal(last.heat.temperature_strip, each.heat.temperature_strip)


def test_ambient(edited: Edited) -> None:
    """Bodies that only convect come to the ambient temperature of the last step."""

    def warm(tables: dict[str, Any]) -> None:
        tables["contact"]["friction"] = 0.0
        for body in ("punch", "strip"):
            tables[body].pop("temperatures", None)
        tables["wear"]["punch"] = {"coefficient": 1e-12}
        tables["heat"]["convection"] = 10.0
        steps_of([{"cycles": 3}, {"time": "4000 s", "ambient": 40}])(tables)
        tables["motion"] = {"kind": "reciprocating", "amplitude": 1.5, "period": 100}

    case = edited("example1-heat", warm, *SMALL, "heat.reduction_tolerance=1e-3")
    blocks = list(follow_program(assemble(case), marched, RunLimits(case.run.half_cycles)))
    assert abs(blocks[0].heat.temperature_punch[5]).max() < 1e-9
    assert blocks[-1].heat.temperature_punch[-1] == pytest.approx(40, abs=0.1)
    assert (of(blocks, "ambient")[[0, -1]] == [0, 40]).all()


def test_goes_on_from_any_half_cycle(edited: Edited) -> None:
    """A run that is interrupted within a ramp goes on to the same end."""
    steps = [{"cycles": 6, "load": ["5 kN", "10 kN"]}, {"cycles": 4, "amplitude": "2 mm"}]
    case = edited("example1", steps_of(steps), *SMALL)
    system = assemble(case)
    whole = list(follow_program(system, marched, RunLimits(20)))[-1]
    *_, part = follow_program(system, marched, RunLimits(7))
    assert part.half_cycle[-1] == 7
    rest = list(follow_program(system, marched, RunLimits(20), part.end))[-1]
    np.testing.assert_allclose(rest.wear[-1], whole.wear[-1], rtol=1e-12)


def test_a_run_goes_on_within_a_ramp(edited: Edited, tmp_path: Path) -> None:
    """Resumed from its checkpoint within a ramp, a run has the history of the one that was not ended."""
    steps = [{"cycles": 3, "load": ["5 kN", "10 kN"]}, {"cycles": 2, "amplitude": "2 mm"}]
    whole = edited(
        "example1", steps_of(steps), *SMALL, "output.report=false", "output.uncertainty=false", "output.fields_at=[]"
    )
    part = whole.model_copy(update={"run": whole.run.model_copy(update={"half_cycles": 3})})
    for name, case, resume in (("whole", whole, False), ("part", part, False), ("part", whole, True)):
        run_case(case, name, tmp_path / name, lambda message: None, resume=resume, progress="none")
    one, other = (read_history(tmp_path / name) for name in ("whole", "part"))
    assert other.sizes == one.sizes
    for name in ("wear", "pressure", "load", "time", "sliding_distance", "worn_volume", "friction_work"):
        np.testing.assert_allclose(other[name], one[name], rtol=1e-10, err_msg=name)


@pytest.mark.parametrize(
    ("program", "key", "expected"),
    [
        ([{"cycles": 3, "distance": 5}], "program.steps.0", "give one of cycles, distance and time"),
        ([{"load": 5}], "program.steps.0", "give one of cycles"),
        ([{"cycles": 3, "load": "5 mm"}], "program.steps.0.load", "another kind"),
        ([{"cycles": 3, "load": -5}], "program.steps.0.load", "greater than 0"),
        ([{"cycles": 3, "load": [1, 2, 3]}], "program.steps.0.load", "at most 2"),
        ([{"cycles": 3, "load": 5, "load_factor": 1}], "program.steps.0.load", "either load or load_factor"),
        ([{"cycles": 3, "speed": 5}], "program.steps.0.speed", "does not change with motion.kind = 'reciprocating'"),
        ([{"cycles": 3, "ambient": 5}], "program.steps.0.ambient", "table heat"),
        ([{"distance": 1}], "program.steps.0.distance", "at least a cycle of 6 mm, got 1 mm"),
        ([{"cycles": 3, "load_factors": {"punch_lid": 2}}], "program.steps.0.load_factors.punch_lid", "no load of the"),
        ([{"cycles": 3, "load_factors": {"punch_load": -2}}], "program.steps.0.load_factors.punch_load", "greater"),
        ([{"cycles": 3, "load": 5, "load_factors": {"punch_load": 2}}], "program.steps.0.load", "load or load_factors"),
        ([{"cycles": 3, "lod": 5}], "program.steps.0.lod", "did you mean 'load'"),
        ([], "program.steps", "at least 1 entry"),
    ],
)  # fmt: skip
def test_what_is_wrong(edited: Edited, program: list[dict[str, Any]], key: str, expected: str) -> None:
    """Each is told with its key."""
    with pytest.raises(CaseError) as refused:
        edited("example1", steps_of(program))
    assert [(p.key, expected in p.message) for p in refused.value.problems] == [(key, True)], str(refused.value)


def test_runs_no_farther_than_it(edited: Edited) -> None:
    """A run that is to go on behind the end of its program is refused; the resolved case reads back as it is."""
    with pytest.raises(CaseError, match=r"run\.half_cycles: .*\b6\b.*\b8\b"):
        edited("example1", lambda tables: tables.update(program={"steps": [{"cycles": 3}]}), "run.half_cycles=8")
    case = edited("example1", steps_of([{"cycles": 3, "load": ["1 kN", "2 kN"]}]))
    assert make_case(tomllib.loads(case.to_toml())) == case


def written(folder: Path, text: str) -> Path:
    path = folder / "program.csv"
    path.write_text(text)
    return path


def test_table(tmp_path: Path) -> None:
    """A CSV file: straight lines between its rows, a jump where a place is repeated, units in its headings."""
    path = written(tmp_path, "distance (m), load (kN), speed [m/s]\n0, 1, 0.1\n10, 2, 0.1\n10, 3, 0.1\n15, 3, 0.2\n")
    assert read_program(path) == [
        {"distance": 10000.0, "load": [1000.0, 2000.0], "speed": [100.0]},
        {"distance": 5000.0, "load": [3000.0], "speed": [100.0, 200.0]},
    ]
    (tmp_path / "case.toml").write_text('base = "example1"\n[program]\nfile = "program.csv"\nlevels = 3\n')
    written(tmp_path, "cycles, load_factor\n0, 1\n10, 2\n")
    with pytest.raises(CaseError, match="the program ends after 20 half-cycles"):
        load_case(tmp_path / "case.toml", ["run.half_cycles=21"])
    case = load_case(tmp_path / "case.toml")
    assert case.run.half_cycles == 20
    assert case.program is not None
    assert case.program.steps[0].load_factor == (1.0, 2.0)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("distance (m), load (N)\n0, 1\n10, 2\n5, 3\n", "row 4: distance runs backwards, from 10000 to 5000"),
        ("distance (m), load (N)\n0, 1\n5, 2\n5, 3\n5, 4\n", "row 5: distance = 5000"),
        ("distance (m), load (N)\n1, 1\n5, 2\n", "row 2: expected distance = 0 in the first row"),
        ("distance (m), load (N)\n0, 1\n", "at least two rows of numbers"),
        ("distance (m), load (N)\n0, 1\n0, 2\n", "distance ends at 0"),
        ("distance (m), load\n0, 1\n5, 2\n", "column 'load': has no unit; expected one in brackets"),
        ("distance (kg), load (N)\n0, 1\n5, 2\n", "column 'distance': unit: "),
        ("distance (m), lode (N)\n0, 1\n5, 2\n", "did you mean 'load'"),
        ("load (N), distance (m)\n0, 1\n5, 2\n", "as the first column"),
        ("distance (m), load (N)\n0, 1\n5\n", "row 3: expected 2 columns, got 1"),
        ("distance (m), load (N)\n0, 1\n5, much\n", "row 3, column 'load': expected a finite number, got 'much'"),
        ("cycles, load (N)\n0, 1\n5.5, 2\n", "row 3: cycles: expected a whole number"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_table(tmp_path: Path, text: str, expected: str) -> None:
    """Each is told with the file, the column and the row."""
    with pytest.raises(CaseError) as refused:
        read_program(written(tmp_path, text))
    assert expected in str(refused.value)
    assert "program.csv" in str(refused.value)


def test_steady_state_of_a_step(edited: Edited) -> None:
    """The state of a program is that of what acts at the end of its last step, or of the one asked for, as a case of
    its own has it."""
    steps = [
        {"cycles": 20, "load": "5 kN"},
        {"cycles": 20, "load": ["5 kN", "20 kN"], "amplitude": ["1.5 mm", "3 mm"]},
        {"cycles": 10, "load_factor": 3},
    ]
    system = assemble(edited("example1", steps_of(steps), *SMALL))
    for step, force, amplitude in ((0, 5e3, 1.5), (1, 20e3, 3.0), (None, 30e3, 3.0)):
        loads = [{"on": "punch_load", "force": [0.0, -force]}]
        alone = edited(
            "example1",
            lambda tables, loads=loads: tables["punch"].update(loads=loads),
            *SMALL,
            f"motion.amplitude={amplitude}",
        )
        exact, chosen = steady(assemble(alone)), at_step(system, step)
        found = steady(system) if step is None else steady(chosen)
        np.testing.assert_allclose(found.pressure, exact.pressure, atol=1e-9 * exact.pressure.max())
        np.testing.assert_allclose(found.wear_per_cycle, exact.wear_per_cycle, rtol=1e-9)
        assert found.system.normal_force == pytest.approx(force, rel=1e-12)
        assert chosen.optimum(1).velocity == pytest.approx(exact.system.optimum(1).velocity, rel=1e-9)
    with pytest.raises(CaseError, match=r"program.steps: .*3.*4"):
        at_step(system, 3)


def test_a_step_that_ends_at_rest_has_no_steady_state(fenwear: Any, tmp_path: Path) -> None:
    """What `steady` and `optimum` print names the step and its load; a stop is refused by its key."""
    (tmp_path / "stop.toml").write_text("""
base = "monotonic-lz20"
[geometry]
degree = 2
[[program.steps]]
cycles = 2
load = "20 kN"
[[program.steps]]
time = "2 s"
speed = ["100 mm/s", "0 mm/s"]
""")
    small = ("--set", "geometry.parameters.elements_along_contact=8")
    for command in ("steady", "optimum"):
        done = fenwear(command, "stop.toml", *small, cwd=tmp_path)
        assert done.returncode == 2, done.stdout
        assert "program.steps.1.speed: nothing slides at the end of step 2" in done.stderr
    done = fenwear("optimum", "stop.toml", *small, "--step", "1", cwd=tmp_path)
    assert (
        "of step 1 of 2 of the program (program.steps.0), as it ends, held for ever: normal force 20,000 N"
        in done.stdout
    )
    assert re.search(r"pressure at x = 30 mm \(MPa\) +50 ", done.stdout)  # 33.333 MPa (1 + c), c = 0.5
    done = fenwear("optimum", "monotonic-lz20", "--step", "1", cwd=tmp_path)
    assert done.returncode == 2
    assert "program: missing" in done.stderr


@pytest.mark.parametrize("jumps", [False, True])
def test_each_load_has_factors_of_its_own(jumps: bool, tmp_path: Path) -> None:
    """Two pads over three blocks: each wears k F s of its own loads; what is not named stays; it is held at its end."""
    tables = two_pads(tmp_path, named=1.0)
    tables["program"] = {"steps": [
        {"cycles": 4, "load_factors": {"punch_left": 2.0}},
        {"cycles": 6, "load_factors": {"punch_right": 0.5}, "load_factor": [1.0, 3.0]},
        {"cycles": 2, "load_factors": {"punch_left": 0.5, "punch_right": 1.0}, "load_factor": 1.0},
    ]}  # fmt: skip
    tables["run"] = {"integration": "jump" if jumps else "explicit"}
    case = make_case(tables)
    assert tomllib.loads(case.to_toml())["program"]["steps"][1]["load_factors"] == {"punch_right": 0.5}
    system = assemble(case)
    last = list(follow_program(system, jumped if jumps else marched, RunLimits(case.run.half_cycles)))[-1]
    law = case.wear.punch
    assert law is not None
    _, distance, _ = cycle_of(case)
    surface = system.pair.punch
    for name, load, shares in (("left", 300.0, (8, 24, 1)), ("right", 900.0, (4, 6, 2))):
        own = surface.nodes_of(name)
        worn = float(surface.weights[own] @ last.wear[-1][own]) * system.bodies.punch.thickness
        assert worn == pytest.approx(law.coefficient * load * distance * sum(shares), rel=1e-6)
    pressed = at_step(system, 1).optimum(1).pressure * surface.weights * system.bodies.punch.thickness
    forces = [float(pressed[surface.nodes_of(name)].sum()) for name in ("left", "right")]
    assert forces == pytest.approx([300 * 2 * 3, 900 * 0.5 * 3], rel=1e-9)
