"""Loads that act through a point, and moments."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fenwear import CaseError, assemble, load_case, make_case


def example(loads: list[dict[str, Any]]) -> Any:
    """Example 1's punch, guided along x at its top and free to come down and to tilt."""
    tables = load_case("example1").resolved()
    group = tables["punch"]["loads"][0]["on"]
    tables["punch"]["supports"] = [{"on": group, "fix": ["x"]}]
    tables["punch"]["loads"] = [{"on": group, **load} for load in loads]
    tables["punch"]["pivot"] = [0.0, 0.0]
    tables["contact"] = {"friction": 0.0}
    return assemble(make_case(tables))


def carried(system: Any) -> np.ndarray:
    """Return force and moment about the origin that pressures without friction carry, N and N mm per mm."""
    pressure = system.contact((1,)).solve(system.pair.initial_gap).pressure[0]
    return np.array([system.pair.weights @ pressure, (system.pair.weights * system.pair.x) @ pressure])


@pytest.mark.mpi
def test_a_force_through_a_point_is_carried_there() -> None:
    """Contact pressures have the resultant and its line of action; a force and its moment are the same load."""
    force = [0.0, -1000.0]
    even, apart, with_moment = (
        example([load])
        for load in ({"force": force}, {"force": force, "through": [4.0, 7.0]}, {"force": force, "moment": [4000.0]})
    )
    np.testing.assert_allclose(apart.bodies.punch.load, with_moment.bodies.punch.load, atol=1e-9)
    thickness = even.bodies.punch.thickness
    for system, place in ((even, 0.0), (apart, 4.0)):
        rigid = system.bodies.punch.rigid_resultant * thickness  # of modes along z at the origin and about it
        by_name = dict(zip(system.bodies.punch.mode_names, rigid, strict=True))
        assert by_name["lambda_F"] == pytest.approx(-1000, rel=1e-9)
        assert by_name["lambda_M"] == pytest.approx(1000 * place, abs=1e-6)
        np.testing.assert_allclose(carried(system), np.array([1, place]) * 1000 / thickness, rtol=1e-9, atol=1e-7)
    assert even.bodies.remarks == apart.bodies.remarks == []


def test_moments_add_up() -> None:
    """Two loads on one group are their sum, and a load times a factor is that of a factor."""
    whole = example([{"force": [0.0, -1000.0], "moment": [3000.0]}])
    parts = example([{"force": [0.0, -1000.0]}, {"moment": [3000.0]}])
    np.testing.assert_allclose(whole.bodies.punch.load, parts.bodies.punch.load, atol=1e-9)
    half = whole.bodies.punch.with_loads([load.times(0.5) for load in whole.case.punch.loads])
    np.testing.assert_allclose(half.load, whole.bodies.punch.load / 2, atol=1e-12)


def test_in_a_solid() -> None:
    """The moments of a load about the axes across the contact, and its resultant, from its nodal forces."""
    tables = load_case("pin-on-disc").resolved()
    group = tables["punch"]["loads"][0]["on"]
    tables["punch"]["supports"] = [{"on": group, "fix": ["x", "y"]}]
    tables["punch"]["pivot"] = [0.0, 0.0, 0.0]
    tables["contact"] = {"friction": 0.0}
    force, place, moment = [0.0, 0.0, -50.0], np.array([15.3, -0.2, 9.0]), np.array([10.0, -5.0, 0.0])
    load = {"on": group, "force": force, "through": place.tolist(), "moment": moment.tolist()}
    tables["punch"]["loads"] = [load]
    punch = assemble(make_case(tables)).bodies.punch
    found = dict(zip(punch.mode_names, punch.rigid_resultant, strict=True))
    expected = moment + np.cross(place, force)
    assert found["lambda_F"] == pytest.approx(-50, rel=1e-9)
    assert [found["lambda_Mx"], found["lambda_My"]] == pytest.approx(expected[:2], rel=1e-9)


@pytest.mark.parametrize(
    ("load", "told"),
    [
        ({"force": [0.0, -1.0], "moment": [1.0, 2.0, 3.0]}, "expected 1 component"),
        ({"moment": ["3 N"]}, "punch.loads.0.moment"),
        ({"force": [0.0, -1.0], "through": [1.0, 2.0, 3.0]}, "through: expected 2 components"),
        ({"traction": [0.0, -1.0], "through": [1.0, 2.0]}, "acts through this point"),
        ({}, "expected a force, a traction or a moment"),
    ],
)
def test_loads_that_are_none(load: dict[str, Any], told: str) -> None:
    """Each is refused by its key."""
    with pytest.raises(CaseError, match=told):
        example([load])
