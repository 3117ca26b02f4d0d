"""Heat that cannot be is refused, in words and with the key."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest

from fenwear import CaseError, Tribosystem, assemble, load_case, march, steady
from fenwear.system import steady_exchange

COARSE = ("geometry.parameters.elements_along_contact=4", "geometry.degree=2")
ISOLATED = ("heat.convection=0", "strip.temperatures=[]")


@pytest.mark.parametrize(
    ("settings", "key", "expected"),
    [
        (["materials.steel.conductivity=0"], "materials.steel.conductivity", "greater than 0"),
        (["materials.steel.conductivity=-55"], "materials.steel.conductivity", "greater than 0"),
        (["materials.steel.conductivity='55 W/m'"], "materials.steel.conductivity", "K"),
        (["materials.steel.density=0"], "materials.steel.density", "greater than 0"),
        (["materials.steel.heat_capacity=-1"], "materials.steel.heat_capacity", "greater than 0"),
        (["heat.partition=-0.1"], "heat.partition", "greater than or equal to 0"),
        (["heat.partition=1.1"], "heat.partition", "less than or equal to 1"),
        (["heat.debris=1"], "heat.debris", "less than 1"),
        (["heat.debris=-0.1"], "heat.debris", "greater than or equal to 0"),
        (["heat.convection=-1"], "heat.convection", "greater than or equal to 0"),
        (["heat.conductance=-1"], "heat.conductance", "greater than or equal to 0"),
        (["heat.conductance_per_pressure=[1, 2]"], "heat.conductance", "either"),
        (["heat.conductance=0", "heat.conductance_per_pressure=[1]"], "heat.conductance_per_pressure", "2"),
        (["heat.conducting=never"], "heat.conducting", "'closed' or 'nominal'"),
        (["heat.steps=0"], "heat.steps", "1"),
        (["heat.step_tolerance=0"], "heat.step_tolerance", "greater than 0"),
        (["heat.inflow=300"], "heat.inflow", "to and fro the same material stays, and none enters"),
        (["heat.relaxation=0"], "heat.relaxation", "greater than 0"),
        (["heat.split_tolerance=1"], "heat.split_tolerance", "less than 1"),
        (["heat.operator=magic"], "heat.operator", "'reduced' or 'full'"),
        (["heat.partiton=0.5"], "heat.partiton", "did you mean 'partition'"),
    ],
)
def test_refusal_names_the_key(settings: list[str], key: str, expected: str) -> None:
    """A message naming the key and what was expected."""
    with pytest.raises(CaseError) as refused:
        load_case("example1-heat", settings)
    messages = [p.message for p in refused.value.problems if p.key.startswith(key)]
    assert any(expected in message for message in messages), refused.value.problems


@pytest.mark.parametrize("name", ["conductivity", "heat_capacity", "density", "expansion"])
def test_missing_thermal_property(edited: Callable[..., Any], name: str) -> None:
    """Every thermal property of a material in use is needed with heat."""
    with pytest.raises(CaseError, match=rf"materials\.composite\.{name}: missing, but required with heat"):
        edited("example1-heat", lambda tables: tables["materials"]["composite"].pop(name))


@pytest.mark.parametrize(
    ("group", "expected"), [("strip_side", "no physical curve 'strip_side'"), ("strip_contact", "cannot be held")]
)
@pytest.mark.mpi
def test_held_temperature_off_the_body(group: str, expected: str) -> None:
    """A group that is not there, or that takes the friction heat: refused when the geometry is read."""
    case = load_case("example1-heat", [*COARSE, f"strip.temperatures.1={{on='{group}'}}"])
    with pytest.raises(CaseError, match=rf"strip\.temperatures\.1\.on: .*{expected}"):
        assemble(case)
    case = load_case("example1-heat", [*COARSE, f"strip.insulated=['{group}']"])
    with pytest.raises(CaseError, match=rf"strip\.insulated\.0: .*{expected.replace('held', 'insulated')}"):
        assemble(case)


@pytest.mark.parametrize("settings", [ISOLATED, ("heat.convection=0",)])
@pytest.mark.mpi
def test_isolated_body_has_no_steady_state(assembled: Callable[..., Tribosystem], settings: tuple[str, ...]) -> None:
    """Without any heat sink no temperature is steady; for some half-cycles there is no need of one."""
    system = assembled("example1-heat", *COARSE, *settings)
    with pytest.raises(CaseError, match=r"heat\.convection:"):
        steady(system)
    with pytest.raises(CaseError, match=r"heat\.convection:"):
        steady_exchange(system, [9.5])
    (block,) = march(system, 4)
    assert block.heat.largest_temperature[-1] > 0


def test_the_convection_that_is_proposed_does(assembled: Callable[..., Tribosystem]) -> None:
    """What the error proposes carries all heat off at a mean rise of 100 K of what convects."""
    case = (*COARSE, "strip.temperatures=[]", "heat.conductance=0", "heat.partition=1", "heat.debris=0")
    with pytest.raises(CaseError, match=r"100 K warmer than the surroundings") as refused:
        steady(assembled("example1-heat", *case, "heat.convection=0"))
    found = re.search(r"(\S+) N/\(mm", str(refused.value))
    assert found is not None
    system = assembled("example1-heat", *case, f"heat.convection={found[1]}")
    state = steady(system)
    assert state.heat is not None
    punch, loss = system.bodies.heat[0], system.bodies.heat[0].convected
    comm, theta = punch.body.mesh.comm, state.heat.end.temperatures()[0]
    assert comm.allreduce(loss @ theta) / comm.allreduce(loss.sum()) == pytest.approx(100, rel=0.01)


def test_isolated_body_on_the_command_line(fenwear: Callable[..., Any]) -> None:
    """`steady` ends with status 2 and the key, without a traceback."""
    settings = [a for s in (*COARSE, *ISOLATED) for a in ("--set", s)]
    result = fenwear("steady", "example1-heat", *settings)
    assert result.returncode == 2
    assert "heat.convection" in result.stderr
    assert "Traceback" not in result.stderr
