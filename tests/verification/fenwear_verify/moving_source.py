"""A square source of heat that moves over a half-space."""

from __future__ import annotations

import math

import numpy as np

from fenwear.common.arrays import Array
from fenwear.heat.conduction import Surroundings
from fenwear.surfaces.sliding_field import SlidingField
from fenwear.system import ContactSetup, place_case
from fenwear_verify.solid import STEEL, describe
from fenwear_verify.suite import Line, Plot, Result, Row, number, order, profile, verification

HALF, MARGIN = 1.0, 1.0  # half the source's side, and what the body reaches beyond it on all sides and below, mm
K, RHO_C = 3.0, 2.0
MATERIAL = {**STEEL, "conductivity": K, "heat_capacity": RHO_C / 0.5, "density": 0.5, "expansion": 0.0}
POINTS = 24  # of Gauss' rule


def rise_in_source(x: Array, y: Array, speed: float) -> Array:
    """Return k theta / q of the surface within the source (n,), mm, whose material moves to +x at `speed`.

    A part q dA of it at (x', y') gives q dA e^{-v (R - x + x') / (2 a)} / (2 pi k R) at the distance R. Along a ray
    from (x, y) at the angle phi, which leaves the source after R1, the integral of that is known: with
    c = v (1 + cos phi) / (2 a), k theta / q = (1 / 2 pi) integral of (1 - e^{-c R1}) / c d phi, by Gauss' rule on each
    half of each side.
    """
    nodes, weights = np.polynomial.legendre.leggauss(POINTS)
    total: Array = np.zeros(len(x))
    corners = [(HALF, -HALF), (HALF, HALF), (-HALF, HALF), (-HALF, -HALF)]
    for side, corner in enumerate(corners):
        normal = side * np.pi / 2  # of the side from this corner to the next: angles are counted from it
        turn = np.exp(-1j * normal)
        away = HALF - (turn * (x + 1j * y)).real
        ends = [np.angle(turn * (u - x + 1j * (v - y))) for u, v in (corner, corners[(side + 1) % 4])]
        for low, high in ((ends[0], np.zeros_like(x)), (np.zeros_like(x), ends[1])):
            for node, weight in zip(nodes, weights, strict=True):
                angle = low + (high - low) * (1 + node) / 2
                reach = away / np.cos(angle)
                c = speed * RHO_C * (1 + np.cos(angle + normal)) / (2 * K)
                small = np.maximum(c * reach, 1e-12)
                total += weight * (high - low) / 2 * reach * -np.expm1(-small) / small
    return np.asarray(total / (2 * np.pi))


def rise_away(x: Array, speed: float) -> Array:
    """Return k theta / q of points that are not near the source (n, 3), mm, by Gauss' rule over it."""
    nodes, weights = np.polynomial.legendre.leggauss(POINTS)
    found = np.zeros(len(x))
    for u, wu in zip(HALF * nodes, HALF * weights, strict=True):
        for v, wv in zip(HALF * nodes, HALF * weights, strict=True):
            distance = np.sqrt((x[:, 0] - u) ** 2 + (x[:, 1] - v) ** 2 + x[:, 2] ** 2)
            behind = np.exp(-speed * RHO_C * (distance - x[:, 0] + u) / (2 * K))
            found += wu * wv * behind / (2 * np.pi * distance)
    return found


def heated_block(elements: int) -> ContactSetup:
    """Return a block below a punch as large as the source, held on its sides and below; collective."""
    sizes = {
        "width": 2 * HALF,
        "depth": 2 * HALF,
        "margin_x": MARGIN,
        "margin_y": MARGIN,
        "strip_height": MARGIN,
        "across_x": elements,
        "across_y": elements,
        "margin_elements": elements // 2,
        "strip_layers": elements // 2,
        "punch_layers": 1,
    }
    held = [{"on": f"strip_{name}"} for name in ("far", "sides", "ends")]
    case = describe(
        {"file": "solid_blocks.geo", "degree": 2, "parameters": sizes},
        {
            "supports": [{"on": "punch_sides", "fix": ["x", "y"]}],
            "loads": [{"on": "punch_far", "force": [0, 0, -1]}],
            "temperatures": [{"on": "punch_far"}],
        },
        {"supports": [{"on": "strip_far", "fix": ["x", "y", "z"]}], "temperatures": held},
        materials=(MATERIAL, MATERIAL),
        heat={},
    )
    return place_case(case)


def moving_rise(placed: ContactSetup, speed: float, direction: tuple[float, float, float]) -> tuple[Array, Array]:
    """Return k theta / q found and exact where the source is (n,), mm, of material that moves so; collective.

    The flux enters by the pair's transfer, as friction heat does; the block's outer faces have the exact temperature.

    Args:
        placed: The block, from `heated_block`.
        speed: mm/s.
        direction: Unit vector along x or y.
    """
    body, pair = placed.bodies.heat[1], placed.pair
    along = np.array([direction, [-direction[1], direction[0], 0], [0, 0, 1]])
    x = body.space.tabulate_dof_coordinates()[: body.owned]
    body.held_values = rise_away(x[body.held] @ along.T, speed) / K
    step = body.step(speed, math.inf, Surroundings(sliding=SlidingField(shift=direction)))
    flux = body.place(pair.transfer.T @ pair.weights)
    theta = step.advance(body.initial()) + step.respond(flux[:, None])[:, 0]
    found = pair.transfer @ body.trace.pick(theta[:, None])[:, 0, 0]
    turned = pair.punch.x @ along.T
    return K * found, rise_in_source(turned[:, 0], turned[:, 1], speed)


@verification(
    "square-source",
    "Jaeger: a square source of heat that moves over a half-space",
    "J. C. Jaeger, Moving sources of heat and the temperature at sliding contacts, 1942: moving point sources",
)
def square_source() -> Result:
    """The surface below the source, in three directions, up to Pe = v l / 2 a = 5, l half its side.

    The flux jumps at the source's edge, where the temperature is like r log r: its error there is of order 1, in a
    band as wide as an element, so that the mean square falls with order 1.5.
    """
    coarse, fine = heated_block(4), heated_block(8)
    rows: list[Row] = []
    lines: list[Line] = []
    for peclet in (0.1, 1.0, 5.0):
        speed = 2 * peclet * K / RHO_C / HALF
        directions = {"+x": (1.0, 0.0, 0.0), "-x": (-1.0, 0.0, 0.0), "+y": (0.0, 1.0, 0.0)}
        for name, direction in directions.items():
            if peclet != 1.0 and name != "+x":
                continue
            found, exact = moving_rise(fine, speed, direction)
            case, weights = f"Pe = {peclet:g}, to {name}", fine.pair.weights
            what = f"{case}: rise k theta / q (mm)"
            rows.append(profile(what, exact, found, 0.004 * (1 + peclet), scale=exact.max()))
            what = f"{case}: mean of it (mm)"
            rows.append(number(what, weights @ exact / weights.sum(), weights @ found / weights.sum(), 1e-3))
            if name == "+x":
                if peclet <= 1:  # beyond, the elements are longer than what the heat goes upstream
                    before, reference = moving_rise(coarse, speed, direction)
                    errors = [_rms(coarse, before - reference), _rms(fine, found - exact)]
                    rows.append(order(f"{case}: order of the root mean square", 1.5, errors, 0.3))
                x, y = fine.pair.punch.x[:, :2].T
                middle = np.flatnonzero(np.abs(y) < 1e-9)
                middle = middle[np.argsort(x[middle])]
                lines += [
                    Line(f"fenwear, Pe = {peclet:g}", x[middle], found[middle]),
                    Line(f"exact, Pe = {peclet:g}", x[middle], exact[middle], reference=True),
                ]
    title = "Moving square source: rise along its middle, the material moves to +x"
    return Result(rows, [Plot(title, "x over half the side", "k theta / (q l)", lines)])


def _rms(placed: ContactSetup, error: Array) -> float:
    weights = placed.pair.weights
    return float(np.sqrt(weights @ error**2 / weights.sum()))
