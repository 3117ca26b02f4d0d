"""Solids that wear: a flat pin on a turning disc, and a sphere on a flat."""

from __future__ import annotations

import numpy as np

from fenwear.steps import jump
from fenwear.system import Tribosystem
from fenwear_verify.half_space import growth_of
from fenwear_verify.solid import RIGID, STEEL, solve
from fenwear_verify.suite import Result, Row, number, order, verification

PIN = 1.0  # mm, its radius; its axis stands 1.25 of it from the disc's


EDGE_GRADING = 4  # of an element's width in the pin's middle over that at its edge
DISC = 10.0  # mm, radius and height of the part of the disc


def edge_width(around: int) -> float:
    """Return the width of the pin's elements at its edge, mm, with 4 `around` elements on it."""
    sizes = EDGE_GRADING ** (-np.arange(around) / around)
    return float(0.5 * PIN * sizes[-1] / sizes.sum())  # from the square, half as large, to the edge


def pin(around: int) -> Tribosystem:
    """Return a rigid pin, which cannot tilt, on a turning disc of steel, with 4 `around` elements on its edge.

    The pressure is singular there, and the disc bends beyond it and below it: its elements start with half the
    width of the pin's at the edge.
    """
    layers, first = around + 3, edge_width(around) / 2
    sizes = {
        "pin_radius": PIN,
        "pin_height": 2,
        "track_radius": 1.25 * PIN,
        "disc_height": DISC,
        "disc_radius": DISC,
        "around": around,
        "across": around,
        "edge_grading": EDGE_GRADING,
        "outer": layers,
        "spread": growth_of(DISC - PIN, first, layers),
        "pin_layers": 1,
        "disc_layers": layers,
        "growth": growth_of(DISC, first, layers),
    }
    return solve(
        {"file": "pin_on_disc.geo", "degree": 2, "order": 2, "parameters": sizes},
        {
            "supports": [{"on": "punch_sides", "fix": ["x", "y"]}],
            "loads": [{"on": "punch_top", "force": [0, 0, -100]}],
        },
        {"supports": [{"on": "strip_bottom", "fix": ["x", "y", "z"]}, {"on": "strip_sides", "fix": ["x", "y", "z"]}]},
        materials=(RIGID, STEEL),
        wear={"punch": {"coefficient": 1e-8}},
        motion={"kind": "rotation", "angular_speed": 1.0, "duration": 1.0},
    )


@verification(
    "pin-on-disc",
    "A flat rigid pin on a turning disc: how fast it wears at first, under uniform pressure, and in the end",
    "the integral of p r over F d: of a rigid pin on a half-space, of the mean pressure, of p r = constant",
)
def pin_on_disc() -> Result:
    """Pin radius a at d = 1.25 a: 1.110698, 1.082460, 0.900749 of beta~ F omega d dt.

    At first the error is that of a singular edge and falls as the elements there do, and so does its bound; the others
    are those of a rule of degree 3 over the face.
    """
    rows: list[Row] = []
    errors: dict[str, list[float]] = {}
    meshes = (3, 4)
    for around in meshes:
        system = pin(around)
        x, weights = system.pair.punch.x, system.pair.weights
        arm = weights * np.hypot(x[:, 0], x[:, 1]) / (1.25 * PIN)
        first = system.contact((1,)).solve(system.gap(0, system.unworn())).pressure[0]
        even, last = np.full(len(weights), 100 / weights.sum()), system.optimum(1).pressure
        width = edge_width(around)
        for name, pressure, exact, bound in (
            ("at first", first, 1.110698, 0.0125 * width),
            ("of uniform pressure", even, 1.082460, 0.75 * width**4),
            ("in the end", last, 0.900749, 20 * width**4),
        ):
            what = f"{4 * around} elements on the edge: rate of wear {name}"
            row = number(what, exact, pressure @ arm / (pressure @ weights), bound)
            rows.append(row)
            errors.setdefault(name, []).append(row.error)
    finer = edge_width(meshes[0]) / edge_width(meshes[1])
    for name, expected, tolerance in (("at first", 1, 0.3), ("in the end", 4, 0.5)):
        what = f"order of the rate's error {name}, by the width at the edge"
        rows.append(order(what, expected, errors[name], tolerance, ratio=finer))
    return Result(rows)


def ball(across: int) -> Tribosystem:
    """Return a steel ball of 50 mm that wears on a steel flat, `across` elements on 1.1 mm; collective."""
    sizes = {
        "radius": 50,
        "contact_width": 1.1,
        "ball_margin": 5,
        "ball_height": 6,
        "flat_length": 11,
        "flat_width": 11,
        "flat_height": 6,
        "stroke": 0,
        "across": across,
        "margin_elements": 4,
        "ball_layers": 6,
        "flat_layers": 6,
        "growth": 2.0,
    }
    return solve(
        {"file": "ball_on_flat.geo", "degree": 1, "order": 2, "parameters": sizes, "follow_wear": "never"},
        {
            "supports": [{"on": "punch_sides", "fix": ["x", "y"]}],
            "loads": [{"on": "punch_top", "force": [0, 0, -10.384615]}],
        },
        {"supports": [{"on": "strip_bottom", "fix": ["x", "y", "z"]}]},
        wear={"punch": {"coefficient": 1.33e-7}},
        motion={"kind": "one-way", "direction": "rightward", "speed": 1.0, "duration": 1.0},
        run={"half_cycles": 320},
    )


@verification(
    "worn-ball",
    "A ball worn flat: radius and depth of the scar",
    "Argatov's theory of the flat scar, 3 to 5 %: radius 0.411390, depth 1.692421e-3 mm; volume beta~ F s",
)
def worn_ball() -> Result:
    """R = 50 mm, 10.38 N, beta~ = 1.33e-7 per MPa, 320 mm of sliding; the worn depth is that of a cap."""
    rows: list[Row] = []
    for across in (8, 16):
        system = ball(across)
        *_, block = jump(system, 320, tolerance=3e-3)
        depth, weights = block.wear[-1], system.pair.weights
        radius = np.sqrt(weights @ (block.pressure[-1] > 0) / np.pi)
        what = f"{across} elements: "
        rows += [
            number(f"{what}radius of the scar (mm)", 0.411390, radius, 0.05),
            number(f"{what}depth (mm)", 1.692421e-3, depth.max(), 0.05),
            number(f"{what}volume (mm³)", 1.33e-7 * 10.384615 * 320, weights @ depth, 1e-3),
        ]
    return Result(rows)
