"""Brakes of several pads: two shoes in a drum, two pads on a disc meshed whole."""

from __future__ import annotations

import numpy as np

from fenwear.arrays import Array
from fenwear.assembly import Tribosystem
from fenwear.cycle import steady
from fenwear_verify.bodies import builtin
from fenwear_verify.suite import Line, Plot, Result, Row, number, order, profile, verification

RADIUS, HINGE, WIDTH, MU = 150.0, 122.7, 32.0, 0.32  # of drum and hinges, width of the linings, mm
BELOW, LINING = np.radians(24.06), np.radians(126)  # from straight below to a hinge, and from there to the lining's end
ARM = HINGE * np.cos(BELOW) + 100.0  # of the wheel cylinder's force about a hinge, mm
SINE_SQUARED = (LINING - np.sin(LINING) * np.cos(LINING)) / 2
NORMAL = 1e-3 * WIDTH * RADIUS * HINGE * SINE_SQUARED  # moments of a shoe's pressure and friction at 1 MPa, N m
FRICTION = 1e-3 * MU * WIDTH * RADIUS * (RADIUS * (1 - np.cos(LINING)) - HINGE * np.sin(LINING) ** 2 / 2)
TORQUE = 1e-3 * MU * WIDTH * RADIUS**2 * (1 - np.cos(LINING))
PUBLISHED = {"normal": 787.63, "friction": 304.15, "torque": 365.83, "trailing": 0.44284, "its torque": 162.00}


def drum(elements: int) -> Tribosystem:
    """Return both shoes with linings of 126 degrees, pressed so that the leading one has 1 MPa; collective."""
    force = (NORMAL - FRICTION) * 1e3 / ARM
    return builtin(
        "drum-brake",
        "geometry.parameters.lining_from=0",
        "geometry.parameters.lining_to=126",
        f"geometry.parameters.elements_along_lining={elements}",
        f"geometry.parameters.elements_along_drum={4 * elements}",
        f"punch.loads.0.force=[{force}, 0]",
        f"punch.loads.1.force=[{-force}, 0]",
    )


@verification(
    "drum-brake",
    "A leading and a trailing shoe in a drum, worn in: pressure, torques",
    "J. E. Shigley, Mechanical Engineering Design, long shoes: p = pa sin theta from the hinge; pa = 1 and 0.44284 MPa",
)
def drum_brake() -> Result:
    """Normal moment 787.63 N m, friction's 304.15, torque 365.83 of the leading shoe; 162.00 of the trailing one."""
    trailing = (NORMAL - FRICTION) / (NORMAL + FRICTION)
    known = zip(PUBLISHED.items(), (NORMAL, FRICTION, TORQUE, trailing, trailing * TORQUE), strict=True)
    rows: list[Row] = [number(f"published: {name}", value, exact, 2e-5) for (name, value), exact in known]
    lines: list[Line] = []
    errors = []
    for elements in (12, 24, 48):
        system = drum(elements)
        pressure = steady(system).pressure[0]
        rows.append(profile(f"{elements} elements: optimum (MPa)", pressure, system.optimum(1).pressure, 1e-9))
        x, surface = system.pair.punch.x, system.pair.punch
        area = WIDTH * (system.pair.weights * pressure)[:, None]
        pressed, rubbed = area * system.pair.normal, area * system.friction_ratio(1)
        theta, worst = np.abs(np.arctan2(x[:, 0], -x[:, 1])) - BELOW, 0.0
        for shoe, side, largest in (("right", 1, 1.0), ("left", -1, trailing)):
            own, name = surface.nodes_of(shoe), "leading" if side > 0 else "trailing"
            arm = x[own] - HINGE * np.array([side * np.sin(BELOW), -np.cos(BELOW)])
            exact, what = largest * np.sin(theta[own]), f"{name} shoe, {elements} elements"
            normal, friction = side * _turning(arm, pressed[own]), _turning(arm, rubbed[own])
            worst = max(worst, float(np.abs(pressure[own] - exact).max()) / largest)
            rows += [
                profile(f"{what}: pressure (MPa)", exact, pressure[own], 1e-3, scale=largest),
                number(f"{what}: moment of the pressure (N m)", largest * NORMAL, normal, 1e-4),
                number(f"{what}: moment of friction (N m)", -largest * FRICTION, friction, 1e-4),
                number(f"{what}: torque (N m)", largest * TORQUE, -_turning(x[own], rubbed[own]), 1e-4),
            ]
            if elements == 48:
                at = np.argsort(theta[own])
                angle = np.degrees(theta[own][at])
                lines.append(Line(f"sine, {name}", angle, exact[at], reference=True))
                lines.append(Line(f"fenwear, {name}", angle, pressure[own][at]))
        errors.append(worst)
    rows.append(order("order of the largest error", 3, errors, 1))
    return Result(rows, [Plot("Worn-in shoes: pressure", "angle from the hinge (degrees)", "pressure (MPa)", lines)])


def _turning(arm: Array, force: Array) -> float:
    """Return the moment of forces (n, 2), N, at arms (n, 2), mm, that turns counterclockwise with z up, N m."""
    return 1e-3 * float((arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]).sum())
