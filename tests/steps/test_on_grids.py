"""Stick by products on grids: as matrices have it, node by node, and as theory has it, in space and in the plane."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from laws import check_laws

from fenwear import load_case
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, ConvergenceError
from fenwear.laws.local_laws import BodyRate, LocalWear
from fenwear.steps.stick_cycle import PartialSlipProblem
from fenwear.steps.stick_final import final_shape
from fenwear.steps.stick_increment import CLOSE, GridStep, _step, advance
from fenwear.steps.stick_interface import untouched
from fenwear.steps.stick_jump import first_cycle, jumped
from fenwear.steps.stick_setup import partial_slip_problem
from fenwear.steps.stick_state import FrettingCycle, Imposed, StickState
from fenwear.surfaces import compliance
from fenwear_verify.half_space_stick import Elastic, OppositeBodies, on_grid
from fenwear_verify.stick_solids import to_and_fro

STEEL, BRASS = Elastic(80_769.0, 0.3), Elastic(37_000.0, 0.34)
LOAD, RADIUS, FRICTION = 100.0, 10.0, 0.5
SHIFTS = (2e-4, 8e-4, 1.2e-3, 5e-4, -6e-4)  # mm, to and fro


def unlike(count: int = 23) -> OppositeBodies:
    """Return a steel sphere on brass, on a square of 0.54 mm."""
    return on_grid(STEEL, BRASS, 0.54 / (count - 1), (count, count), LOAD, RADIUS)


def pressed(bodies: OppositeBodies, friction: float = FRICTION) -> tuple[StickState, Imposed]:
    load, gap = bodies.loaded(None), bodies.middle.pair.initial_gap
    state, start = untouched(bodies), Imposed(load.times(0), gap)
    for share in (0.1, 0.4, 1.0):
        end = replace(start, loaded=load.times(share))
        state, start = advance(bodies, state, start, end, np.full(len(gap), friction)), end
    return state, start


def path(bodies: OppositeBodies, *, by_force: bool) -> Iterator[tuple[StickState, StickState, Imposed]]:
    """Yield states before and after each step, and what is imposed at its end."""
    state, start = pressed(bodies)
    yield state, state, start
    if by_force:
        start = replace(start, displacement=None, force=state.force)
    for shift in SHIFTS:
        force = shift / 1.6e-3 * FRICTION * LOAD
        end = replace(start, force=force) if by_force else replace(start, displacement=shift)
        after = advance(bodies, state, start, end, np.full(len(end.opening), FRICTION))
        yield state, after, end
        state, start = after, end


@pytest.mark.parametrize("by_force", [False, True])
def test_as_by_matrices(by_force: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Unlike bodies, whose pressure follows what pulls them: all fields at all nodes, and the laws themselves."""
    bodies = unlike()
    friction = np.full(len(bodies.middle.pair.weights), FRICTION)
    ours = list(path(bodies, by_force=by_force))
    assert isinstance(_step(bodies, bodies.middle, ours[0][0], ours[0][2], friction), GridStep)
    monkeypatch.setattr(compliance, "GRIDDED", np.inf)
    for (before, after, end), (_, other, _) in zip(ours, path(unlike(), by_force=by_force), strict=True):
        top = other.pressure.max()
        np.testing.assert_allclose(after.pressure, other.pressure, rtol=0, atol=10 * CLOSE * top)
        np.testing.assert_allclose(after.traction, other.traction, rtol=0, atol=10 * CLOSE * top)
        most = max(np.abs(other.slip).max(), 1e-6)
        np.testing.assert_allclose(after.slip, other.slip, rtol=0, atol=10 * CLOSE * most)
        np.testing.assert_allclose(after.on_strip, other.on_strip, rtol=0, atol=1e-6 * np.abs(other.on_strip).max())
        assert (after.sticking ^ other.sticking).sum() <= 2
        assert after.parts == other.parts == 1  # whole, where the motion turns back, too
        assert np.isclose(bodies.middle.pair.weights @ after.pressure, LOAD, rtol=10 * CLOSE)
        if after is not before:
            assert np.ptp(after.pressure - ours[0][1].pressure) > 1e-3 * top  # coupled
            check_laws(bodies.middle, before, after, end, FRICTION, LOAD, 100 * CLOSE)


def rig(bodies: OppositeBodies, rate: float = 1e-8) -> PartialSlipProblem:
    n = len(bodies.middle.pair.weights)
    wear = LocalWear(BodyRate(np.full(n, rate)), BodyRate(np.full(n, 2 * rate)))
    return PartialSlipProblem(bodies, to_and_fro(1.2e-3, 3), wear, np.full(n, FRICTION))


def test_jumps_as_by_matrices(monkeypatch: pytest.MonkeyPatch) -> None:
    """Depths after many cycles by jumps."""
    problem = rig(unlike())

    def worn(problem: PartialSlipProblem) -> FrettingCycle:
        cycle = first_cycle(problem, problem.beginning(), problem.unworn(), 0)
        while cycle.number < 20_000:
            cycle = jumped(problem, cycle, 20_000, 0.05)
        return cycle

    ours = worn(problem)
    monkeypatch.setattr(compliance, "GRIDDED", np.inf)
    other = worn(rig(unlike()))
    depth, expected = ours.worn.punch, other.worn.punch
    assert np.abs(depth - expected).max() < 0.02 * expected.max()  # jumps of their own lengths, to the tolerance
    np.testing.assert_allclose(ours.worn.strip, 2 * depth, rtol=1e-9, atol=0)


def test_sphere_in_partial_slip() -> None:
    """Cattaneo's tractions node by node, for nu = 0, and what half-spaces give way by: errors fall with the grid."""
    poisson, young, q = 0.0, 210_000.0, 0.7
    body, modulus = Elastic(young / 2, poisson), young / 2
    a = (3 * LOAD * RADIUS / (4 * modulus)) ** (1 / 3)
    top, c = FRICTION * 1.5 * LOAD / (np.pi * a**2), a * (1 - q) ** (1 / 3)
    gives = 3 * FRICTION * LOAD * 2 * (2 - poisson) / body.shear / (16 * a) * (1 - (1 - q) ** (2 / 3))
    found = []
    for nodes in (24, 48, 96):
        bodies = on_grid(body, body, 2 * a / nodes, (nodes + 4,) * 2, LOAD, RADIUS)
        state, start = pressed(bodies)
        start = replace(start, displacement=None, force=0.0)
        end = replace(start, force=q * FRICTION * LOAD)
        state = advance(bodies, state, start, end, np.full(len(end.opening), FRICTION))
        r = np.linalg.norm(bodies.middle.pair.punch.x, axis=1)
        exact = top * (_cap(r / a) - c / a * _cap(r / c))
        wrong = np.abs(state.traction[:, 0] - exact) / top
        found.append((np.sqrt(np.mean(wrong**2)), wrong.max(), abs(state.displacement / gives - 1)))
        assert np.abs(state.traction[:, 1]).max() < 1e-6 * top
    errors = np.array(found)
    assert (errors[1:] < 0.75 * errors[:-1]).all()
    assert errors[-1, 0] < 3e-3
    assert errors[-1, 2] < 1e-4


def _cap(x: Array) -> Array:
    return np.sqrt(np.maximum(1 - x**2, 0))


def test_cylinder_in_partial_slip() -> None:
    """Cattaneo's tractions in the plane, on 2,001 nodes, raised and taken back: node by node."""
    load, q, friction = 120.0, 0.5, 0.6
    modulus = STEEL.shear / (1 - STEEL.poisson)
    a = np.sqrt(4 * load * RADIUS / (np.pi * modulus))
    top, c = 2 * load / (np.pi * a), a * np.sqrt(1 - q)
    bodies = on_grid(STEEL, STEEL, 2.4 * a / 2000, (2001,), load, RADIUS)
    x = bodies.middle.pair.punch.x[:, 0]
    state, start = pressed(bodies, friction)
    inside = np.abs(np.abs(x) - a) > 0.01 * a
    assert np.abs(state.pressure - top * _cap(x / a))[inside].max() < 2e-3 * top
    start = replace(start, displacement=None, force=0.0)
    mu = np.full(len(x), friction)
    up = advance(bodies, state, start, replace(start, force=q * friction * load), mu)
    exact = friction * top * (_cap(x / a) - c / a * _cap(x / c))
    away = inside & (np.abs(np.abs(x) - c) > 0.01 * a)
    assert np.abs(up.traction[:, 0] - exact)[away].max() < 3e-3 * friction * top
    assert abs(np.abs(x[up.sticking]).max() / c - 1) < 3e-3
    before = replace(start, force=q * friction * load)
    down = advance(bodies, up, before, replace(start, force=0.0), mu)
    back = a * np.sqrt(1 - q / 2)
    edge = np.abs(x[down.closed & ~down.sticking]).min()
    assert abs(edge / back - 1) < 3e-3


def test_a_strip_that_passes_under_a_fine_grid_is_refused() -> None:
    """Its steps are solved by factors: the key says what would do."""
    bodies = [f"{name}.operator='half-space'" for name in ("punch", "strip")]
    mesh = ["geometry.degree=1", "geometry.parameters.across=2"]
    case = load_case("fretting-sphere", [*bodies, *mesh, "grid.nodes=65", "motion.positions=3"])
    with pytest.raises(CaseError, match=r"motion.positions: .*1\.2.*1"):
        partial_slip_problem(case)


@pytest.mark.parametrize("share", [0.99, 1.01])
def test_gross_sliding_is_told(share: float) -> None:
    """A force next to what friction holds is carried; a larger one is said to slide."""
    bodies = on_grid(STEEL, STEEL, 0.02, (27, 27), LOAD, RADIUS)
    state, start = pressed(bodies)
    start = replace(start, displacement=None, force=0.0)
    move = partial(advance, bodies, state, start, replace(start, force=share * FRICTION * LOAD))
    friction = np.full(len(start.opening), FRICTION)
    if share < 1:
        assert np.isclose(move(friction).force, share * FRICTION * LOAD, rtol=1e-6)
    else:
        with pytest.raises(ConvergenceError, match="gross sliding"):
            move(friction)


def test_where_partial_slip_ends() -> None:
    """A sphere worn by a fixed amplitude, c = a / 2: depth and volume of the closed form, the zone located in nodes."""
    sphere = Elastic(80_769.2, 0.3)
    a, steps = 0.1866256, 2
    bodies = on_grid(sphere, sphere, a / 12, (42, 42), LOAD, RADIUS)
    n = len(bodies.middle.pair.weights)
    wear = LocalWear(BodyRate(np.full(n, 1e-8)), BodyRate(np.zeros(n), wears=False))
    problem = PartialSlipProblem(bodies, to_and_fro(1.58597e-3, steps), wear, np.full(n, FRICTION))
    found = final_shape(problem)
    volume = problem.weights @ found.depth
    assert found.deepest is not None
    assert found.volume is not None
    assert np.isclose(np.sqrt(found.size / np.pi) / a, 0.5, rtol=5e-3)
    assert np.isclose(found.depth.max(), 1.83246e-3, rtol=0.03)
    assert np.isclose(volume, 2.55879e-4, rtol=0.03)
    assert found.deepest[0] < 1.83246e-3 < found.deepest[1]
    assert found.volume[0] < 2.55879e-4 < found.volume[1]
