"""The end of partial-slip wear in the plane: the exact scar, and the way there by jumps where theory is exact."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cylinders import equal_cylinders, line_load

from fenwear import ConvergenceError, assemble, jump, load_case, make_case
from fenwear.bodies.condensation import CondensedBody
from fenwear.case import Case
from fenwear.common.arrays import Array
from fenwear.steps.stick_cycle import PartialSlipProblem
from fenwear.steps.stick_final import INSIDE, final_shape, stick_zone
from fenwear.steps.stick_setup import partial_slip_problem
from fenwear.steps.stick_state import TimeStepRecords

LOAD, RADIUS, E_STAR = 120.0, 6.0, 2e5 / (2 * (1 - 0.3**2))
C = 0.0609  # half-width that stays


def pressed_on(elements: int, *settings: str) -> Case:
    mesh = f"geometry.parameters.elements_along_contact={elements}"
    return load_case("fretting-partial-slip", [mesh, "geometry.follow_wear='never'", *settings])


def exact_area(c: float) -> float:
    """Return the area of the end of the cylinder on the flat, mm²."""
    return exact_end(c, LOAD, RADIUS)[0]


def exact_end(c: float, load: float, radius: float) -> tuple[float, float]:
    """A parabola pressed into a half-plane over abs(x) < c only: area, mm², and largest depth, mm, of the overlap.

    Hertz's gap (c²/2R) (xi sqrt(xi² - 1) - arcosh xi), xi = x/c, less 2 (P - P_c) / (pi E*) arcosh xi of a flat
    punch under the rest of the load, P_c = pi E* c² / (4 R).
    """
    rest = load - np.pi * E_STAR * c**2 / (4 * radius)
    xi = np.linspace(1, 5, 100_001)
    gap = c**2 / (2 * radius) * (xi * np.sqrt(xi**2 - 1) - np.arccosh(xi))
    depth = np.maximum(2 * rest / (np.pi * E_STAR) * np.arccosh(xi) - gap, 0)
    return float(2 * c * np.trapezoid(depth, xi)), float(depth.max())


def test_the_scar_tends_to_the_exact_one() -> None:
    """Of first order in the distance of nodes, as the edge of a zone of nodes is; hardly any tangential force."""
    errors = []
    for elements in (20, 40):
        pressed = partial_slip_problem(pressed_on(elements, "stick.steps=2", "stick.force='1e-6 N'"))
        x, weights = pressed.interface.middle.pair.x, pressed.weights
        zone = np.abs(x) < C
        area = float(weights @ final_shape(pressed, zone).depth)
        # The edge lies between the last node and the end of what it stands for.
        assert exact_area(float(weights @ zone) / 2) < area < exact_area(float(x[zone].max()))
        errors.append(area / exact_area(float(weights @ zone) / 2) - 1)
    assert errors[1] < 0.55 * errors[0] < 0.08


def test_the_end_is_as_exact_as_it_says() -> None:
    """Mirror images under a force: half-planes whose stick zone is c = a sqrt(1 - Q / (mu P)), on any mesh.

    The exact depth and area lie in the intervals that are told; the middle of these is much nearer than a node's width
    of the zone would let it be, 10 % of the depth for 1 % of the zone.
    """
    half_width, share = 0.17, 0.5
    c, load = half_width * np.sqrt(1 - share), line_load(half_width)
    area, depth = exact_end(c, load, 4.0)
    for elements in (24, 36, 48):
        worn = partial_slip_problem(equal_cylinders(half_width, elements, share * 0.2 * load))
        found = final_shape(worn)
        assert found.deepest is not None
        assert found.volume is not None
        assert found.deepest[0] < depth < found.deepest[1]
        assert found.volume[0] < area < found.volume[1]
        assert abs(found.size - 2 * c) < found.within
        assert found.depth.max() == pytest.approx(depth, rel=0.015)
        assert worn.weights @ found.depth == pytest.approx(area, rel=0.015)
        assert worn.weights @ found.pressure == pytest.approx(load, rel=1e-3)


def approached(elements: int, amplitude: float, **stick: float) -> PartialSlipProblem:
    """Return mirror images that are moved towards each other, mm, in place of loads."""
    tables = equal_cylinders(0.17, elements, 1.0).resolved()
    near = {"punch": ("punch", -7.9e-3), "strip": ("strip", 7.9e-3)}
    for body, (name, by) in near.items():
        tables[body]["loads"] = []
        tables[body]["supports"] = [
            {"on": f"{name}_sides", "fix": ["x"]},
            {"on": f"{name}_far", "fix": ["z"], "by": [by]},
        ]
    tables["stick"] = {"steps": 6, **stick}
    tables["motion"]["amplitude"] = amplitude
    return partial_slip_problem(make_case(tables))


@pytest.mark.parametrize(("elements", "off"), [(48, 0.02), (72, 0.01), (96, 0.005)])
def test_the_end_under_a_prescribed_approach(elements: int, off: float) -> None:
    """Wear takes load off; with a prescribed motion the stick zone is kept, and located within its elements.

    At c = 0.8 a three to six elements slip at each side: errors fall faster than with their length.
    """
    worn = approached(elements, 1.21e-3)
    first = TimeStepRecords.joined(worn.cycle(worn.beginning())[1])
    load, force = float(worn.weights @ first.pressure[-1]), float(np.abs(first.force).max())
    c = np.sqrt(1 - force / (0.2 * load)) * 0.17 * np.sqrt(load / line_load(0.17))
    found = final_shape(worn)
    area, depth = exact_end(c, float(worn.weights @ found.pressure), 4.0)
    assert found.deepest is not None
    assert found.deepest[0] < depth < found.deepest[1] < 1.25 * found.deepest[0]
    assert found.size == pytest.approx(2 * c, rel=2e-3)
    assert found.depth.max() == pytest.approx(depth, rel=off)
    assert worn.weights @ found.depth == pytest.approx(area, rel=off)


def test_a_force_shrinks_the_zone_under_a_prescribed_approach() -> None:
    """What is left of the load holds the force, Q = mu (P' - P_c); where none does there is no end."""
    worn = approached(36, 1e-3, force=90.0)
    found = final_shape(worn)
    c, left = found.size / 2, float(worn.weights @ found.pressure)
    assert 0.2 * (left - line_load(c)) == pytest.approx(90.0, rel=0.02)
    area, depth = exact_end(c, left, 4.0)
    assert found.depth.max() == pytest.approx(depth, rel=0.02)
    assert worn.weights @ found.depth == pytest.approx(area, rel=0.05)
    with pytest.raises(ConvergenceError, match="no final shape"):
        final_shape(approached(36, 1e-3, force=100.0))


def test_jumps_end_in_the_final_shape_where_theory_is_exact(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bodies that give way along the surface as across it, each by itself: under a force the stick zone is kept.

    That is Ciavarella's and Jaeger's contact, node by node. Finite bodies rock under the tangential force.
    """

    def upright(normal: Array) -> Array:
        return np.broadcast_to(np.array([[0.0, 1.0], [1.0, 0.0]]), (len(normal), 2, 2)).copy()

    def alike(body: CondensedBody) -> CondensedBody:
        response = body.response.copy()
        response[:, 0, :, 1] = response[:, 1, :, 0] = 0.0
        response[:, 0, :, 0] = response[:, 1, :, 1]
        return replace(body, response=response)

    monkeypatch.setattr("fenwear.steps.stick_position.contact_frame", upright)
    system = assemble(pressed_on(14, "stick.force='60 N'", "stick.steps=4", "stick.step_tolerance=1"))
    coarse = system.law_state.problem
    interface = coarse.interface
    interface.punch, interface.strip = alike(interface.punch), alike(interface.strip)
    interface._positions = {0.0: interface._position(interface.middle.pair)}
    driven = PartialSlipProblem(interface, coarse.program, coarse.wear, coarse.friction)
    zone = stick_zone(driven)
    end = final_shape(driven, zone)
    alike_bodies = replace(system, law_state=replace(system.law_state, problem=driven))
    last = list(jump(alike_bodies, 4_000_000, tolerance=0.02))[-1]
    depth = last.wear[-1] + interface.middle.pair.wear_interpolation @ last.wear_strip[-1]
    pressure = last.steps[-1].pressure[-1]
    assert driven.weights @ np.where(zone, pressure, 0) == pytest.approx(LOAD, rel=1e-5)
    assert np.abs(pressure - end.pressure)[zone].max() < 2e-3 * pressure.max()
    assert driven.weights @ depth == pytest.approx(driven.weights @ end.depth, rel=2e-3)


@pytest.mark.parametrize("squares", [8, 20])
def test_zones_of_squares_carry_as_smaller_round_ones(squares: int) -> None:
    """A flat punch of squares on a half-space against F = 2 E* a d: how far inside of their edge it carries."""

    def moved(x: Array, y: Array) -> Array:
        """Return pi E* times what unit pressure on a unit square moves a place by (Love)."""
        corners = [(x + a, y + b, 4 * a * b) for a in (0.5, -0.5) for b in (0.5, -0.5)]
        far = [(p, q, np.hypot(p, q), sign) for p, q, sign in corners]
        return np.asarray(sum(sign * (p * np.log(q + r) + q * np.log(p + r)) for p, q, r, sign in far))

    grid = np.arange(-squares - 1, squares + 2.0)
    x, y = (one.ravel() for one in np.meshgrid(grid + 0.3, grid + 0.1, indexing="ij"))
    x, y = x[np.hypot(x, y) < squares], y[np.hypot(x, y) < squares]
    compliance = moved(x[:, None] - x, y[:, None] - y) / np.pi
    force = np.linalg.solve(compliance, np.ones(len(x))).sum()
    assert np.sqrt(len(x) / np.pi) - force / 2 == pytest.approx(INSIDE, abs=0.01)
