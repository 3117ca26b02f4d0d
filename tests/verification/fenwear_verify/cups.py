"""Balls in cups, against rigid limits: worn in over the whole hemisphere, and worn from a point to most of it."""

from __future__ import annotations

import numpy as np

from fenwear import steady
from fenwear.arrays import Array
from fenwear.assembly import Tribosystem
from fenwear.cycle import jump
from fenwear_verify.bodies import builtin
from fenwear_verify.suite import Result, Row, number, order, profile, verification

RADIUS, FORCE, RATE = 14.0, 1000.0, 1e-9  # of the ball, mm; N; of the cup, mm³/(N mm)
AXIS = np.array([np.cos(np.radians(95.6)), np.sin(np.radians(95.6)), 0.0])  # square to the pole, through no node
ANGLE = np.radians(80)  # that the ball turns by in a cycle, there and back
GROWING = ((30, 0.06362049, 0.06511247, 0.1), (60, 1.425326, 1.570796, 0.012), (85, 24.33386, 30.03636, 0.004))


def cup(across: int, clearance: float, *more: str) -> Tribosystem:
    """Return a ball that turns to and fro by 20 degrees about an axis square to the pole, along which it is pressed.

    Collective.
    """
    sizes = {"radius": RADIUS, "clearance": clearance, "contact_angle": 90, "across": across,
             "around": 3 if across == 4 else 4, "cup_layers": 1, "ball_layers": 1, "overlap_angle": 5}  # fmt: skip
    turns = np.radians([-20.0, 20.0, -20.0])[:, None] * AXIS
    rows = [[float(k), *(float(c) for c in turn), -FORCE] for k, turn in enumerate(turns)]
    columns = ["time (s)", "rotation_x (rad)", "rotation_y (rad)", "rotation_z (rad)", "force_z (N)"]
    told = ", ".join(f"{name}={value}" for name, value in sizes.items())
    return builtin(
        "ball-in-cup",
        f"geometry.parameters={{{told}}}",
        "contact.friction=0",
        f"motion={{kind='cycle', columns={columns}, rows={rows}, load={{on='punch_back', through=[0,0,0]}}}}",
        *more,
    )


@verification(
    "ball-in-cup",
    "A ball in a hemispherical cup, worn in: pressure, depth and volume of a cycle",
    "p = p0 cos(longitude about the axis of turning), p0 = 4 F / (pi² R²); volume (4 / pi) k F R times the angle",
)
def ball_in_cup() -> Result:
    """Whatever the bodies are made of; the largest error is at the rim, whose normals are square to the load."""
    largest, errors, rows = 4 * FORCE / (np.pi**2 * RADIUS**2), [], list[Row]()
    for across in (4, 6):
        system = cup(across, 0.0)
        state, normal, what = steady(system), system.pair.normal, f"{across} elements across"
        exact: Array = largest * normal[:, 2] / np.linalg.norm(np.cross(normal, AXIS), axis=1)
        errors.append(float(np.abs(state.phase_pressure - exact).max() / largest))
        depth, volume = 4 * RATE * ANGLE * FORCE / (np.pi**2 * RADIUS), 4 / np.pi * RATE * FORCE * ANGLE * RADIUS
        worn = float((state.wear_per_cycle * system.pair.weights).sum())
        rows += [
            profile(f"{what}: pressure (MPa)", exact, state.phase_pressure[0], 1e-2, scale=largest),
            number(f"{what}: approach of a cycle (mm)", depth, state.velocity["lambda_F"], 5e-4),
            number(f"{what}: volume of a cycle (mm³)", volume, worn, 2e-3),
        ]
    rows.append(order("order of the pressure's largest error, at the rim", 2, errors, 0.7, ratio=6 / 4))
    return Result(rows)


@verification(
    "growing-cup",
    "A cup with clearance worn from a point to 30, 60 and 85 degrees from the pole, by jumps: rigid bodies",
    "k F s / (R² D) = 0.06362049, 1.425326, 24.33386; V / (R² D) = 0.06511247, 1.570796, 30.03636",
)
def growing_cup() -> Result:
    """What stiff bodies give way, 1.5 um, is a tenth of the depth at 30 degrees."""
    clearance, way, rows = 0.1, RADIUS * ANGLE, list[Row]()
    stiff = ("materials.polyethylene.young='20 GPa'", "geometry.follow_wear=never",
             "materials.cobalt-chromium.young='1000 TPa'")  # fmt: skip
    system, end = cup(4, clearance, *stiff), None
    height = system.pair.normal[:, 2]
    for angle, slid, volume, share in GROWING:
        cycles = round(slid * RADIUS**2 * clearance / (RATE * FORCE * way))
        *_, last = jump(system, cycles, tolerance=3e-3, start=end)
        end, depth, what = last.end, last.end.worn.punch, f"{angle} degrees"
        rigid = np.maximum(clearance * (height / np.cos(np.radians(angle)) - 1), 0)
        worn = float(system.pair.weights @ depth)
        rows += [
            number(f"{what}: volume / (R² D)", volume, worn / (RADIUS**2 * clearance), 2e-3),
            profile(f"{what}: depth / D", rigid / clearance, depth / clearance, share, scale=rigid.max() / clearance),
            number(f"{what}: volume by depth over metered", 1, worn / float(end.totals.of("volume_punch")), 1e-9),
        ]
    return Result(rows)
