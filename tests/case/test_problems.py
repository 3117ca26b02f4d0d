"""What is wrong with a case is told in the words of case files."""

from __future__ import annotations

import copy
import tomllib
from typing import Any

import pytest

from fenwear import CaseError, load_case, make_case


def problems(*settings: str, name: str = "example1-heat") -> list[str]:
    with pytest.raises(CaseError) as refused:
        load_case(name, settings)
    return str(refused.value).splitlines()


@pytest.mark.parametrize(
    ("setting", "expected"),
    [
        # The key was heat.conductance.function-after[functools.partial(...)], and it was told twice.
        ("heat.conductance=perfekt", "heat.conductance: expected a number or a string with a unit such as "
                                     "'1 N/(mm*s*K)', got 'perfekt'; or 'perfect' or 'layer'"),
        ("heat.conductance=-1", "heat.conductance: expected greater than or equal to 0, got -1"),
        ("heat=3", "heat: expected a table, got 3"),
        ("heat.ambient=[1]", "heat.ambient: expected a number or a string with a unit such as '1 K', got a list"),
        ("heat.convecting_faces=maybe", "heat.convecting_faces: expected true or false, got 'maybe'"),
        ("run.half_cycles=true", "run.half_cycles: expected a whole number, got true"),
        ("punch.loads=x", "punch.loads: expected a list, got 'x'"),
        ("punch.loads.0.force=[1]", "punch.loads.0.force: expected at least 2 entries, got 1"),
        ("punch.loads.0.force=[1, 2, 3]", "punch.loads.0.force: expected 2 components (x, z) in a plane model, got 3"),
        ("punch.supports.0.fix=[]", "punch.supports.0.fix: expected at least 1 entry, got 0"),
        ("punch.regions={}", "punch.regions: missing, but required"),
        ("model.plane=stres", "model.plane: expected 'stress' or 'strain', got 'stres'; did you mean 'stress'?"),
        ("motion.profile=sinus", "motion.profile: expected 'sinusoidal', 'triangular' or 'trapezoidal', got 'sinus'; "
                                 "did you mean 'sinusoidal'?"),
        ("contact.friction={table = 3}", "contact.friction.table: expected a list, got 3"),
        ("contact.layer.kind=powr", "contact.layer.kind: expected one of 'linear', 'power', 'exponential', 'rough'; "
                                    "did you mean 'power'?"),
        ("contact.layer={kind='power', stiffness=1, reference=1, pressure=1}",
         "contact.layer.stiffness: unknown key; known here are kind, reference, pressure, exponent"),
        ("contact.friction={tabel = [[0, 1], [1, 1]]}", "contact.friction.tabel: unknown key; did you mean 'table'?"),
        ("materials.number={poisson = 0.3}", "materials.number.young: missing, but required"),
    ],
)  # fmt: skip
def test_in_words_of_case_files(setting: str, expected: str) -> None:
    """The key as it is written, said once, and what was expected there."""
    assert problems(setting) == [expected]


def test_a_run_of_a_program_is_a_table() -> None:
    """Without its end, which the program tells, it was looked into before it was known to be one."""
    assert problems("program={steps=[{cycles=1}]}", "run=3") == ["run: expected a table, got 3"]


def test_loads_next_to_nothing_over_a_cycle() -> None:
    """Of which no equilibrium could be told from rounding."""
    told = problems("punch.loads.0.over_cycle=[[0, 1e-300], [1, 1e-300]]")
    assert told == ["punch.loads.0.over_cycle: expected a factor of at least 1e-09, or none but zeros"]


def test_from_python() -> None:
    """Objects that no case file can hold."""
    tables: dict[str, Any] = copy.deepcopy(tomllib.loads(load_case("example1").to_toml()))
    tables["contact"]["friction"] = object()
    tables["title"] = None
    tables["model"]["thickness"] = (1, 2)
    with pytest.raises(CaseError) as refused:
        make_case(tables)
    text = str(refused.value)
    for part in (
        "friction: expected a number, got something else",
        "title: expected a text, got nothing",
        "got a list",
    ):
        assert part in text


def test_perfect_contact_by_default() -> None:
    """Without a partition conduction shares the heat; a given partition, or a law of the pressure, rules alone."""
    bare = tomllib.loads(load_case("example1-heat").to_toml())
    for key in ("partition", "conductance"):
        del bare["heat"][key]

    def conductance(**given: Any) -> object:
        case = make_case({**bare, "heat": {**bare["heat"], **given}})
        assert case.heat is not None
        assert make_case(tomllib.loads(case.to_toml())) == case
        return case.heat.conductance

    assert conductance() == "perfect"
    assert conductance(partition=0.3) == 0
    assert conductance(conductance_per_pressure=[1, 2]) == 0
    assert conductance(partition=0.3, conductance=0.08) == 0.08
    assert conductance(conductance="perfect") == "perfect"
    assert conductance(conductance=0) == 0
