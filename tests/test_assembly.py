"""Bodies made in Python; and what a variant shares."""

from __future__ import annotations

import runpy
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import ufl
from dolfinx.mesh import CellType, create_rectangle
from mpi4py import MPI

from fenwear import CaseError, Tribosystem, assemble, evolve, load_case, make_case, march, sweep, to_dataset, vary
from fenwear.bodies.distributed_mesh import own_mesh
from fenwear.bodies.elastic_material import OwnLaw, lame, strain, stress
from fenwear.bodies.elasticity import ElasticBody
from fenwear.case import Body, Heat, Support
from fenwear.heat.conduction import HeatBody
from fenwear.heat.fourier_law import ConductionLaw
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import march_within
from fenwear.system import build_bodies, elastic, make_sliding, place, with_exchange, with_reduced_heat

DEMO = Path(__file__).parents[1] / "demos" / "own_materials.py"
GROUPS: dict[str, Callable[[Any], Any]] = {
    "punch_contact": lambda x: np.isclose(x[1], 0),
    "top": lambda x: np.isclose(x[1], 1),
}
HELD = Body(supports=(Support(on="top", fix=("x", "z")),))


def block(groups: dict[str, Callable[[Any], Any]], law: OwnLaw) -> ElasticBody:
    mesh = create_rectangle(MPI.COMM_WORLD, [(0, 0), (1, 1)], (4, 4), CellType.quadrilateral)
    return ElasticBody(own_mesh("punch", mesh, groups), HELD, law, degree=2)


def isotropic(u: Any) -> Any:
    return stress(strain(u), *lame(2e5, 0.3, "stress"))


def test_own_materials(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A demo of at most 60 lines; its steady state is twice the mean pressure of 10 MPa, whatever the material."""
    assert len(DEMO.read_text("utf-8").splitlines()) <= 60
    monkeypatch.chdir(tmp_path)
    names = runpy.run_path(str(DEMO))
    pressure, weights = names["state"].pressure, names["system"].pair.weights
    assert pressure.max() == pytest.approx(20, rel=1e-9)
    np.testing.assert_allclose(pressure @ weights, 200, rtol=1e-10)  # N/mm of 2 kN over 10 mm
    system, case = names["system"], names["case"]
    assert "made in Python" in case.to_toml()
    found = sweep(case, {"contact.friction": [0.1, 0.2]})
    np.testing.assert_allclose(found["largest_pressure"][-1], pressure.max(axis=1), rtol=1e-9)
    again = vary(system, "punch.loads.0.force=[0, '-4 kN']")
    assert again.rigid.mean_pressure == pytest.approx(2 * system.rigid.mean_pressure, rel=1e-12)
    assert again.bodies.punch.body is names["pad"]
    data = to_dataset(list(evolve(vary(system, "run.half_cycles=4"))))
    np.testing.assert_allclose(data["pressure"].values @ weights, 200, rtol=1e-10)
    # The stiffness of the fibres' direction is felt: the pad's compliance is that of neither isotropic bound.
    assert system.bodies.punch.law.stress(ufl.Coefficient(system.bodies.punch.space)).ufl_shape == (2, 2)
    response = system.elastic.condensed.punch.response[:, :, :, 0]
    sideways, down = np.abs(response[:, 0]).max(), np.abs(response[:, 1]).max()
    assert 0.01 < sideways / down < 1  # pressed fibres at 30 degrees give way sideways, too


def test_anisotropic_conductivity() -> None:
    """theta = a x + b z under the flux that it drives through the contact: exact with any tensor."""
    tensor, slope = np.array([[5.0, 2.0], [2.0, 3.0]]), np.array([7.0, -4.0])
    elastic_body = block({**GROUPS, "sides": lambda x: np.isclose(x[0] * (1 - x[0]), 0)}, OwnLaw("stress", isotropic))
    held = Body(supports=HELD.supports, temperatures=({"on": "sides"}, {"on": "top"}))
    body = HeatBody(elastic_body, held, ConductionLaw(ufl.as_matrix(tensor.tolist()), 2.0), Heat())
    exact = body.space.tabulate_dof_coordinates()[: body.owned, :2] @ slope
    body.held_values = exact[body.held]
    n = len(elastic_body.surface.weights)
    step = body.step(0.0, np.inf)
    found = step.advance(body.initial()) + step.respond(body.load(np.full(n, -(tensor @ slope)[1]))[:, None])[:, 0]
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-11)
    np.testing.assert_allclose(body.contact(found), elastic_body.surface.x @ slope, rtol=0, atol=1e-11)


def hand_made(conductivity: Any) -> Tribosystem:
    """Return a pad on a strip, both made in Python, with heat; the pad's conductivity is any tensor."""
    meshes = {}
    for name, corners, cells in (("punch", [(-2, 0), (2, 3)], (8, 6)), ("strip", [(-6, -3), (6, 0)], (24, 6))):
        height = 3 if name == "punch" else -3
        groups = {f"{name}_contact": GROUPS["punch_contact"], "far": lambda x, height=height: np.isclose(x[1], height)}
        meshes[name] = own_mesh(name, create_rectangle(MPI.COMM_WORLD, corners, cells, CellType.quadrilateral), groups)
    held = {"temperatures": [{"on": "far"}], "supports": [{"on": "far", "fix": ["x", "z"]}]}
    tables = {
        "geometry": {"degree": 2},
        "materials": {"any": {"young": 2e5, "poisson": 0.3, "conductivity": 1, "heat_capacity": 1, "density": 1,
                              "expansion": 1e-6}},
        "punch": {**held, "regions": {"punch_body": "any"}, "supports": [{"on": "far", "fix": ["x"]}],
                  "loads": [{"on": "far", "force": [0, -20]}]},
        "strip": {**held, "regions": {"strip_body": "any"}},
        "contact": {"friction": 0.3},
        "wear": {"punch": {"coefficient": 1e-8}},
        "motion": {"kind": "reciprocating", "amplitude": 1.0, "period": 0.5},
        "heat": {"partition": 0.5, "conductance": 0},
        "run": {"half_cycles": 2},
    }  # fmt: skip
    laws = {name: OwnLaw("stress", isotropic, expansion) for name in meshes}
    case = make_case(tables, meshes=meshes, stresses=laws)
    bodies = build_bodies(case)
    conduction = (ConductionLaw(conductivity, 0.5), ConductionLaw(50.0, 3.6))
    heat = [
        HeatBody(elastic_body, description, law, case.heat)
        for elastic_body, description, law in zip(
            (bodies.punch, bodies.strip), (case.punch, case.strip), conduction, strict=True
        )
    ]
    return with_exchange(elastic(place(replace(bodies, heat=tuple(heat)), make_sliding(case), case)))


def expansion(theta: Any) -> Any:
    return 2e5 / 0.7 * 1e-6 * theta * ufl.Identity(2)


def test_heat_of_bodies_made_in_python() -> None:
    """Friction heat is balanced in every half-cycle; a tensor k I is k, and tilted fibres tilt the temperature."""
    scalar, equal, tilted = (
        hand_made(k) for k in (2.0, 2.0 * ufl.Identity(2), ufl.as_matrix([[6.0, 3.0], [3.0, 2.0]]))
    )
    found = []
    for system in (scalar, equal, tilted):
        (block,) = march_within(system, RunLimits(20, block=20))
        assert block.heat is not None
        assert block.heat.balance_error.max() < 1e-9
        found.append((block.heat.temperature_punch[-2:].mean(axis=0), block.pressure[-1]))
    for one, other in zip(found[0], found[1], strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9)
    asymmetry = [np.abs(t - t[::-1]).max() / t.max() for t, _ in found]
    assert asymmetry[2] > 3 * asymmetry[0]


def test_a_stress_that_is_not_linear_is_named() -> None:
    """And groups that are missing or empty."""
    with pytest.raises(CaseError, match=r"punch\.stress:"):
        block(GROUPS, OwnLaw("stress", lambda u: isotropic(u) * (1 + ufl.tr(strain(u)))))
    with pytest.raises(CaseError, match="punch_contact: missing"):
        block({"top": GROUPS["top"]}, OwnLaw("stress", isotropic))
    with pytest.raises(CaseError, match="bottom: no facet"):
        block({**GROUPS, "bottom": lambda x: np.isclose(x[1], -5)}, OwnLaw("stress", isotropic))


def test_a_variant_equals_a_new_system(assembled: Callable[..., Tribosystem]) -> None:
    """Other loads, friction, wear, motion and positions: shared operators give what new ones do."""
    small = ("geometry.parameters.elements_along_contact=4", "geometry.degree=3", "geometry.parameters.overlap=4")
    base = assembled("example1", *small)
    for settings in (
        ("punch.loads.0.force=['0 N', '-5 kN']",),
        ("contact.friction=0.1", "wear.punch.coefficient=1e-8"),
        ("motion.amplitude=1", "wear.strip.coefficient=1e-8", "motion.positions=3"),
        ("motion.axis=y",),
    ):
        shared, new = vary(base, *settings), assemble(vary(base, *settings).case)
        assert shared.bodies.punch.factor is base.bodies.punch.factor
        for one, other in zip(shared.elastic.interfaces, new.elastic.interfaces, strict=True):
            scale = np.abs(other.dense()).max()
            np.testing.assert_allclose(one.dense(), other.dense(), rtol=0, atol=1e-12 * scale)
            np.testing.assert_allclose(one.load_gap, other.load_gap, rtol=0, atol=1e-9 * np.abs(other.load_gap).max())


def test_a_long_stroke_takes_as_many_positions_as_nodes_ask_for() -> None:
    """Where the whole punch passes, the strip loses k times the integral of p a half-cycle, everywhere; nine comb it.

    And no more where they are given; variants and programs have those of the longest stroke.
    """
    stroke = "motion={kind='reciprocating', amplitude=45, period=1, profile='triangular'}"
    long = (stroke, "geometry.parameters.overlap=47", "geometry.parameters.elements_along_contact=12")
    settings = (*long, "geometry.degree=1", "wear.punch.coefficient=1e-12", "wear.strip.coefficient=1e-9")
    off = []
    for more in ((), ("motion.positions=9",)):
        system = assemble(load_case("example1", [*settings, *more]))
        (block,) = march(system, 2)
        strip, load = system.pair.strip, system.normal_force / system.bodies.punch.thickness
        depth = block.wear_strip[-1][np.abs(strip.x[:, 0] - strip.x[:, 0].mean()) < 10]
        off.append(np.abs(depth / (2 * 1e-9 * load) - 1).max())
        if not more:
            assert system.motion.positions % 2
            assert system.sliding.position_spacing < 1 < 9 < system.motion.positions
            assert vary(system, "motion.amplitude=40").motion.positions == system.motion.positions
            steps = "program={steps=[{time=2, amplitude=5}, {time=2, amplitude=45}]}"
            short = assemble(load_case("example1", [*settings, "motion.amplitude=5", steps, "run.half_cycles=8"]))
            assert short.motion.positions == system.motion.positions
        else:
            assert system.motion.positions == 9
    assert off[0] < 0.01
    assert off[1] > 3 * off[0]


def test_a_variant_takes_the_operator_of_its_own_settings() -> None:
    """Whatever that of the system was; what was reduced for whole cycles stays so."""
    small = ("geometry.parameters.elements_along_contact=4", "geometry.degree=1", "heat.steps=1")
    full = assemble(load_case("example1-heat", [*small, "heat.operator=full"]))
    reduced = vary(full, "heat.operator=reduced")
    again = vary(reduced, "heat.operator=full")
    cycles = vary(with_reduced_heat(full), "motion.amplitude=1")
    assert cycles.case.heat is not None
    assert cycles.case.heat.operator == "full"
    found = [one.exchange.reduced for one in (full, reduced, again, cycles)]
    assert found == [False, True, False, True]


def test_meshes_given_are_all() -> None:
    """Both are given or none, and the geometry's own keys do not go with them."""
    tables = load_case("example1").resolved()
    with pytest.raises(CaseError, match="meshes: expected"):
        make_case(tables, meshes={"punch": None})
    with pytest.raises(CaseError, match=r"geometry\.file"):
        make_case(tables, meshes={"punch": None, "strip": None})
