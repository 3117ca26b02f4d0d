"""Brakes of several pads: two shoes in a drum, two pads on a disc meshed whole."""

from __future__ import annotations

import numpy as np

from fenwear import vary
from fenwear.common.arrays import Array
from fenwear.steps import jump, steady
from fenwear.system import Tribosystem
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
        pressed, rubbed = area * system.pair.normal, area * system.phases.middle_ratio(1)
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


PADS = {"front": (60.0, 5000.0), "back": (30.0, 2000.0)}  # angle, degrees, and load, N
INNER, OUTER, SPEED = 60.0, 100.0, 10.0  # mm; rad/s
PAD, DISC = 1e-8, 1e-9  # wear coefficients, 1/MPa


def pads(across: int) -> Tribosystem:
    """Return two pads that wear on the same face of a disc; collective."""
    return builtin(
        "disc-brake-two-pads",
        "geometry.parameters.same_face=1",
        f"geometry.parameters.across={across}",
        f"geometry.parameters.along={2 * across}",
        f"geometry.parameters.around={12 * across}",
        *(f"geometry.parameters.{name}_angle={angle}" for name, (angle, _) in PADS.items()),
        *(f"punch.loads.{k}.force=[0, 0, {-load}]" for k, (_, load) in enumerate(PADS.values())),
        f"wear.punch={{coefficient={PAD}}}",
    )


@verification(
    "two-pads",
    "Two pads on one disc, all worn in: pressure and how fast pads and disc recede; what couples them",
    "p r uniform in each pad; rates 1.1936621e-5, 9.5492966e-6 and 2.7852115e-7 mm/s; Maxwell and Betti",
)
def two_pads() -> Result:
    """60 degrees with 5,000 N and 30 with 2,000 N, r 60..100, tilt locked; the disc wears under both."""
    rows: list[Row] = []
    rates, errors = {"front": 1.1936621e-5, "back": 9.5492966e-6, "disc": 2.7852115e-7}, []
    of_pads, of_disc = [], []  # errors where the disc wears, too
    for across in (2, 4):
        system, worst, both_worst = pads(across), 0.0, 0.0
        worn_in = vary(system, f"wear.strip={{coefficient={DISC}}}")
        surface, weights = system.pair.punch, system.pair.weights
        alone, best = system.optimum(1), worn_in.optimum(1)
        radius = np.hypot(*surface.x[:, :2].T)
        track = np.hypot(*worn_in.pair.strip.x[:, :2].T)
        disc = worn_in.phases.mean_wear.worn(best.pressure[None]).strip / (2 * np.pi / SPEED)  # in a turn
        inside = np.abs(track - (INNER + OUTER) / 2) < 0.3 * (OUTER - INNER)
        of_disc.append(float(np.abs(disc[inside] / rates["disc"] - 1).max()))
        what = f"disc, {across} elements across: recedes (mm/s)"
        rows.append(profile(what, np.full(inside.sum(), rates["disc"]), disc[inside], 1e-2, scale=rates["disc"]))
        for name, (angle, load) in PADS.items():
            own, what = surface.nodes_of(name), f"{name} pad, {across} elements across"
            exact, approach = load / (np.radians(angle) * (OUTER - INNER) * radius[own]), f"lambda_F_{name}"
            worst = max(worst, float(np.abs(alone.pressure[own] / exact - 1).max()))
            both_worst = max(both_worst, float(np.abs(best.pressure[own] / exact - 1).max()))
            both = rates[name] + rates["disc"]
            rows += [
                profile(f"{what}: pressure (MPa)", exact, best.pressure[own], 1e-3, scale=exact),
                number(f"{what}: load (N)", load, weights[own] @ best.pressure[own], 1e-9),
                number(f"{what}: approach, the disc unworn (mm/s)", rates[name], alone.velocity[approach], 1e-3),
                number(f"{what}: approach (mm/s)", both, best.velocity[approach], 1e-3),
            ]
        errors.append(worst)
        of_pads.append(both_worst)
        if across == 2:
            *_, last = jump(worn_in, 1_000_000, tolerance=3e-3)
            what = "pads and disc worn in, by jumps from flat on: pressure (MPa)"
            rows.append(profile(what, best.pressure, last.pressure[-1], 1e-4, scale=best.pressure.max()))
            by_force = system.elastic.interface.compliance(0.0).matrix() / weights
            front, back = (surface.nodes_of(name) for name in PADS)
            through = by_force[np.ix_(front, back)]
            scale = float(np.abs(through).max())
            there, unfelt = by_force[np.ix_(back, front)].T, scale < 1e-6 * by_force[front].max()
            rows += [
                profile("disc: gap of each pad by forces on the other, both ways", there, through, 1e-9, scale=scale),
                number("disc: pads that do not feel each other", 0, unfelt, 0, scale=1),
            ]
    rows.append(order("order of the pressure's largest error, the disc unworn", 2, errors, 1))
    rows.append(order("the same with the disc worn, the edges of the pads the worst", 1, of_pads, 0.3))
    rows.append(order("order of the disc's largest error, off the rims", 2, of_disc, 0.7))
    return Result(rows)
