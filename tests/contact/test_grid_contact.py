"""Phases on grids by products alone: as matrices of all nodes have them, in contact, wear and what gives way."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from half_space_ball import WEAR, ball

from fenwear import Case, assemble, evolve
from fenwear.algebra.krylov import flexible
from fenwear.common.arrays import Array
from fenwear.contact import CondensedContact, ContactState
from fenwear.contact.grid_contact import GriddedPhases
from fenwear.steps.block import Block
from fenwear.surfaces import compliance
from fenwear.surfaces.grid_compliance import Box, OnBox
from fenwear.system import Tribosystem

FORCE = 600.0  # N


def solved(system: Tribosystem, *, cycles: float = 30.0) -> ContactState:
    """Return the contact of all phases with the wear of so many cycles in it."""
    contact = system.phase_contact(range(len(system.motion.phases)))
    assert isinstance(contact, CondensedContact)
    unworn = system.unworn()
    gap = np.array([system.gap(k, unworn) for k in range(len(system.motion.phases))])
    return contact.solve(gap, None, system.phases.passing(system.phases.mean_wear).step(unworn.between, cycles))


@pytest.mark.parametrize(
    "more",
    [
        {},
        {"wear": {"strip": WEAR["strip"]}},
        {"wear": {"punch": WEAR["punch"] | {"pressure_exponent": 1.5, "coefficient": "1e-7 1/MPa^1.5"}}},
        {"contact": {"layer": {"kind": "linear", "stiffness": "5e5 MPa/mm"}}},
        {"contact": {"layer": {"kind": "power", "reference": "1 um", "pressure": "300 MPa"}}},
        {"contact": {"friction": {"expression": "0.4 + 0.3 * tanh(3 * x) * tanh(y + 0.5)"}}},
    ],
    ids=["both", "strip", "power", "linear-layer", "layer", "friction of the place"],
)
def test_as_by_matrices(more: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """Pressures and gaps of six phases that meet in their wear, node by node, and the loads carried exactly."""
    system = assemble(ball(FORCE, **more))
    contact = system.phase_contact(range(len(system.motion.phases)))
    assert isinstance(contact, CondensedContact)
    assert contact.gridded
    ours = solved(system)
    monkeypatch.setattr(compliance, "on_one_grid", lambda *_: None)
    theirs = solved(assemble(ball(FORCE, **more)))
    touching = theirs.pressure > 0
    assert 0.1 < touching.mean() < 0.9
    scale = theirs.pressure.max()
    np.testing.assert_allclose(ours.pressure, theirs.pressure, rtol=0, atol=1e-7 * scale)
    np.testing.assert_allclose(ours.gap, theirs.gap, rtol=0, atol=1e-7 * theirs.gap.max())
    forces = ours.pressure @ system.pair.weights
    np.testing.assert_allclose(forces, 600.0, rtol=1e-13)


def test_products_and_solutions_are_of_each_other() -> None:
    """The solution operator of nodes in contact is that of the product's rows and columns."""
    system = assemble(ball(FORCE))
    contact = system.phase_contact(range(len(system.motion.phases)))
    assert isinstance(contact, CondensedContact)
    operator = contact._jacobian(np.zeros(contact.size))
    assert isinstance(operator, GriddedPhases)
    free = np.ones(contact.size, dtype=bool)
    n = len(system.pair.weights)
    apart = np.linalg.norm(system.pair.punch.x[:, :2], axis=1)
    free.reshape(len(system.motion.phases), -1)[:, :n] = apart < 0.7
    kept = np.flatnonzero(free).astype(np.int32)
    x = np.zeros(contact.size)
    x[kept] = np.random.default_rng(3).standard_normal(len(kept))
    found = operator.factor(kept)(operator.multiply(x)[kept])
    np.testing.assert_allclose(found, x[kept], rtol=0, atol=1e-7)


def test_a_box_cuts_the_whole() -> None:
    """Products on a box are those of the whole grid there, of pressures within it."""
    system = assemble(ball(FORCE))
    contact = system.phase_contact([0, 3])
    assert isinstance(contact, CondensedContact)
    of = contact._grid.of
    x = system.pair.punch.x
    inside = np.flatnonzero((np.abs(x[:, 0] - 0.2) < 0.35) & (np.abs(x[:, 1] + 0.1) < 0.3))
    pressure: Array = np.zeros((2, len(x)))
    pressure[:, inside] = np.random.default_rng(1).random((2, len(inside)))
    box = Box.around(of[0].of.places, of[0].of.counts, inside)
    assert box.size < 0.5 * np.prod(of[0].of.counts)
    found = box.values(OnBox(of, box).apply(box.spread(pressure)[:, None]))
    whole = np.array([one.apply(p) for one, p in zip(of, pressure, strict=True)])
    np.testing.assert_allclose(found, whole[:, box.nodes], rtol=0, atol=1e-13 * whole.max())
    rows = np.array([one.matrix() @ p for one, p in zip(of, pressure, strict=True)])
    np.testing.assert_allclose(whole, rows, rtol=0, atol=1e-12 * whole.max())


def test_pressures_are_those_of_tamaas() -> None:
    """At every node, where it is installed: both spread pressures evenly over squares, and have no periods.

    L. Frérot et al., J. Open Source Software 5, 2020; its conjugate gradients are those of Polonsky and Keer.
    """
    tamaas = pytest.importorskip("tamaas")
    system = assemble(ball(FORCE, grid={"nodes": 45, "size": [2.2, 2.2]}, contact={"friction": 0.0}))
    gap, grid = system.gap(0, system.unworn()), system.pair.punch.grid
    pressure = system.phase_contact((0,)).solve(gap).pressure[0]
    assert grid is not None
    sides = np.array(grid.spacing) * grid.counts
    model = tamaas.Model(tamaas.model_type.basic_2d, list(sides), list(grid.counts))
    model.E, model.nu = 1 / sum((1 - nu**2) / young for young, nu in ((2.1e5, 0.3), (1.0e5, 0.34))), 0.0
    tamaas.ModelFactory.registerNonPeriodic(model, "dcfft")
    solver = tamaas.PolonskyKeerRey(model, np.ascontiguousarray(-gap.reshape(grid.counts)), 1e-12)
    solver.setIntegralOperator("dcfft")
    solver.max_iter = 3000
    solver.solve(600 / float(sides.prod()))
    other = np.asarray(model.traction).ravel()
    assert np.array_equal(pressure > 0, other > 0)
    assert np.abs(pressure - other).max() < 1e-6 * pressure.max()


@pytest.mark.parametrize("who", ["punch", "strip"])
def test_creep_with_stick_by_products_is_as_by_matrices(who: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a body is displaced by at once, which is what creeps, is told from what it has crept in a step."""
    creep = {"terms": [{"compliance": 0.5, "time": "3 s"}]}
    more = {
        "grid": {"nodes": 21, "size": [0.7, 0.7]},
        "contact": {"friction": 0.8, "law": "coulomb"},
        "motion": {"kind": "reciprocating", "amplitude": 0.02, "period": 1.0, "positions": 1},
        "stick": {"steps": 4, "step_tolerance": 1},
        "run": {"half_cycles": 3},
    }
    case = ball(60.0, **more).resolved()
    case[who]["creep"] = creep

    def last() -> Block:
        block = list(evolve(assemble(Case.model_validate(case))))[-1]
        assert max(one.records.balance_error(block.system.pair.weights) for one in block.steps) < 1e-8
        return block

    by_products = last()
    monkeypatch.setattr(compliance, "GRIDDED", np.inf)
    by_matrices = last()
    for of in (
        lambda block: block.pressure[-1],
        lambda block: block.end.worn.punch,
        lambda block: block.end.worn.crept,
    ):
        wanted = of(by_matrices)
        assert of(by_products) == pytest.approx(wanted, abs=1e-6 * np.abs(wanted).max())


def test_boxes_of_nodes_in_any_order() -> None:
    """Values within a box are those of its places, cut out where nodes are in the grid's order or looked for."""
    shape, rng = (30, 24), np.random.default_rng(2)
    places = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1).reshape(-1, 2)
    values, touched = rng.standard_normal((3, len(places))), np.flatnonzero(((places - [12, 9]) ** 2).sum(axis=1) < 20)
    order = rng.permutation(len(places))
    number = np.argsort(order)
    boxes = [Box.around(places, shape, touched), Box.around(places[order], shape, number[touched])]
    assert boxes[0].within == shape
    assert not boxes[1].within
    cut, looked_for = boxes[0].spread(values), boxes[1].spread(values[:, order])
    assert cut.shape < (3, *shape)
    np.testing.assert_array_equal(cut, looked_for)
    cut *= 2.0
    assert (values[:, touched] == boxes[0].values(looked_for)[:, np.isin(boxes[0].nodes, touched)]).all()


@pytest.mark.parametrize("restart", [3, 40])
def test_products_of_solutions_come_with_them(restart: int) -> None:
    """What GMRES has multiplied adds up to the product of its solution, rows beside the system's among it."""
    rng = np.random.default_rng(1)
    kept = np.arange(60) % 3 > 0
    matrix = np.eye(60) + 0.4 * rng.standard_normal((60, 60)) / np.sqrt(60)
    b = np.where(kept, rng.standard_normal(60), 0.0)
    x, rest, _, product = flexible(
        lambda p: np.asarray(matrix @ p), lambda r: r, b, 1e-3, restart, 30, kept.astype(np.float64)
    )
    assert rest <= 1e-3
    assert not x[~kept].any()
    np.testing.assert_allclose(product, matrix @ x, rtol=0, atol=1e-13)
    assert np.linalg.norm((b - product)[kept]) <= 1.001e-3 * np.linalg.norm(b)
