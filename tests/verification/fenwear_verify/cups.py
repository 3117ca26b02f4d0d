"""Balls in cups, against rigid limits: worn in over the whole hemisphere, and worn from a point to most of it."""

from __future__ import annotations

import numpy as np

from fenwear import steady
from fenwear.common.arrays import Array
from fenwear.steps import jump
from fenwear.system import Tribosystem
from fenwear_verify.bodies import builtin
from fenwear_verify.suite import Result, Row, number, observed_order, order, profile, verification

RADIUS, FORCE, RATE = 14.0, 1000.0, 1e-9  # of the ball, mm; N; of the cup, mm³/(N mm)
AXIS = np.array([np.cos(np.radians(95.6)), np.sin(np.radians(95.6)), 0.0])  # square to the pole, through no node
PLAY = 0.1  # radial clearance of the cup that grows, mm
ANGLE = np.radians(80)  # that the ball turns by in a cycle, there and back
GROWING = ((30, 0.06362049, 0.06511247, 0.06), (60, 1.425326, 1.570796, 0.006), (85, 24.33386, 30.03636, 0.003))


def cup(across: int, clearance: float, *more: str) -> Tribosystem:
    """Return a ball that turns to and fro by 20 degrees about an axis square to the pole, along which it is pressed.

    Collective.
    """
    sizes = {"radius": RADIUS, "clearance": clearance, "contact_angle": 90, "across": across,
             "around": 3 * across // 4, "cup_layers": 1, "ball_layers": 1, "overlap_angle": 5}  # fmt: skip
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
    """Whatever the bodies are made of. At the rim normals are square to the load, and nothing wears."""
    largest, errors, rows = 4 * FORCE / (np.pi**2 * RADIUS**2), [], list[Row]()
    for across in (4, 6, 8):
        system = cup(across, 0.0)
        state, normal, what = steady(system), system.pair.normal, f"{across} elements across"
        exact: Array = largest * normal[:, 2] / np.linalg.norm(np.cross(normal, AXIS), axis=1)
        errors.append(float(np.abs(state.phase_pressure - exact).max() / largest))
        depth, volume = 4 * RATE * ANGLE * FORCE / (np.pi**2 * RADIUS), 4 / np.pi * RATE * FORCE * ANGLE * RADIUS
        worn = float((state.wear_per_cycle * system.pair.weights).sum())
        rows += [
            profile(f"{what}: pressure (MPa)", exact, state.phase_pressure[0], 1e-3, scale=largest),
            number(f"{what}: approach of a cycle (mm)", depth, state.velocity["lambda_F"], 5e-4),
            number(f"{what}: volume of a cycle (mm³)", volume, worn, 2e-3),
        ]
    rows.append(order("order of the pressure's largest error, from 4 to 8 elements", 2, errors[::2], 0.7))
    return Result(rows)


@verification(
    "growing-cup",
    "A cup with clearance worn from a point to 30, 60 and 85 degrees from the pole, by jumps: rigid bodies",
    "k F s / (R² D) = 0.06362049, 1.425326, 24.33386; V / (R² D) = 0.06511247, 1.570796, 30.03636",
)
def growing_cup() -> Result:
    """What stiff bodies give way, 1 um, is a sixteenth of the depth at 30 degrees; of stiffer ones a hundredth."""
    rows, system, end = list[Row](), _stiff_cup(4, "40 GPa"), None
    for angle, slid, volume, share in GROWING:
        *_, last = jump(system, _cycles(slid), tolerance=3e-3, start=end)
        end, depth, what = last.end, last.end.worn.punch, f"{angle} degrees"
        rigid = _rigid(system, angle)
        worn = float(system.pair.weights @ depth)
        rows += [
            number(f"{what}: volume / (R² D)", volume, worn / (RADIUS**2 * PLAY), 2e-3),
            profile(f"{what}: depth / D", rigid / PLAY, depth / PLAY, share, scale=rigid.max() / PLAY),
            number(f"{what}: volume by depth over metered", 1, worn / float(end.totals.of("volume_punch")), 1e-9),
        ]
    errors, (angle, slid, *_) = [], GROWING[0]
    for across in (4, 6):
        # From a soft one's first tenth: at first stiff ones touch at a single node, which holds them one way alone.
        *_, begun = jump(_stiff_cup(across, "20 GPa"), _cycles(slid) // 10, tolerance=3e-3)
        system = _stiff_cup(across, "200 GPa")
        *_, last = jump(system, _cycles(slid), tolerance=1e-3, start=begun.end)
        rigid = _rigid(system, angle)
        errors.append(float(np.abs(last.end.worn.punch - rigid).max() / rigid.max()))
    told = f"{angle} degrees, stiffer: error of the depth with 6 elements across in place of 4 (of first order: 0.67)"
    rows.append(Row(told, errors[0], errors[1], errors[1] / errors[0], 4 / 6, observed_order(errors, 6 / 4)))
    return Result(rows)


def _stiff_cup(across: int, young: str) -> Tribosystem:
    """Return a cup with clearance on a ball that gives nothing; collective."""
    stiff = (f"materials.polyethylene.young='{young}'", "materials.cobalt-chromium.young='1000 TPa'")
    return cup(across, PLAY, *stiff, "geometry.follow_wear=never")


def _cycles(slid: float) -> int:
    """Return the cycles of k F s / (R² D)."""
    return round(slid * RADIUS**2 * PLAY / (RATE * FORCE * RADIUS * ANGLE))


def _rigid(system: Tribosystem, angle: float) -> Array:
    """Return the depth of rigid bodies worn to an angle from the pole, degrees (n,), mm."""
    height = system.pair.normal[:, 2]
    return np.asarray(PLAY * np.maximum(height / np.cos(np.radians(angle)) - 1, 0))
