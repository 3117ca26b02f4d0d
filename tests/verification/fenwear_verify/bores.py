"""Shafts in bores: the pressure of a pin in a hole, and how a bore wears from a line contact to half of it.

D is the radial clearance, psi the angle from where the load presses, P and Q the load per length, k the wear
coefficient and s what is slid.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from fenwear.case import make_case
from fenwear.common.arrays import Array
from fenwear.results.forces_and_place import quantities
from fenwear.results.quantity import computed
from fenwear.steps import Block, jump
from fenwear.system import Tribosystem, assemble
from fenwear_verify.suite import Line, Plot, Result, Row, number, order, profile, verification

RADIUS, YOUNG, POISSON, LOAD = 10.0, 210e3, 0.3, 50.0  # of the bore, mm; MPa; N/mm
MODULUS = YOUNG / (1 - POISSON**2)
EDGE = 0.9  # of the contact's angle: what lies outside is as near to its edge as a node of the coarsest mesh


@cache
def bore(elements: int, clearance: float, young: float = YOUNG, wear: float = 1e-8, load: float = LOAD) -> Tribosystem:
    """Return a shaft held at its axis in the whole bore of a plate of 80 radii, which a load presses on it; collective.

    Args:
        elements: Around the bore.
        clearance: D, mm.
        young: Of both, MPa.
        wear: Coefficient of the bore, 1/MPa.
        load: P, N/mm.
    """
    steel = {"young": young, "poisson": POISSON}
    sizes = {"wall": 79 * RADIUS, "shaft_wall": 0.99 * RADIUS, "contact_angle": 180, "elements_along_contact": elements}
    case = {
        "geometry": {
            "file": "bushing.geo",
            "degree": 2,
            "order": 2,
            "parameters": {"radius": RADIUS - clearance, "clearance": clearance, **sizes},
        },
        "model": {"plane": "strain", "thickness": 1.0},
        "materials": {"steel": steel},
        "punch": {
            "regions": {"punch_body": "steel"},
            "supports": [{"on": "punch_top", "fix": ["x"]}],
            "loads": [{"on": "punch_top", "force": [0, -load]}],
        },
        "strip": {
            "regions": {"strip_body": "steel"},
            "supports": [{"on": "strip_bottom", "fix": ["x", "z"]}],
        },
        "contact": {"friction": 0},
        "wear": {"punch": {"coefficient": wear}},
        "motion": {"kind": "rotation", "axis": [0, 1, 0], "angular_speed": 1, "duration": 1},
        "run": {"half_cycles": 1},
    }
    return assemble(make_case(case))


def angles(system: Tribosystem) -> Array:
    """Return psi of the contact nodes (n,), rad."""
    x = system.pair.punch.unworn
    return np.arctan2(x[:, 0], x[:, 1] + RADIUS - x[:, 1].max())


def clearance_of(half_angle: float) -> float:
    """Return Persson's E' D / Q of a contact of this half angle, rad; negative where the pin was pressed in."""
    b = np.tan(half_angle / 2)
    return float((2 - np.log(b**2 + 1) - 2 * b**4) / (np.pi * b**2 * (b**2 + 1)))


def persson(psi: Array, half_angle: float) -> Array:
    """Return R p / Q at angles, rad."""
    b, y = np.tan(half_angle / 2), np.tan(psi / 2)
    root, inner = np.sqrt(b**2 + 1), np.sqrt(np.maximum(b**2 - y**2, 0))
    found = 2 * inner / (np.pi * root * (1 + y**2))
    found += np.log((root + inner) / (root - inner)) / (2 * np.pi * b**2 * (1 + b**2))
    return np.where(np.abs(psi) < half_angle, found, 0.0)


@verification(
    "pin-in-hole",
    "A pin in a hole of its own material: pressure over contacts of 10 to 100 degrees to each side",
    "A. Persson, On the stress distribution of cylindrical elastic bodies in contact, 1964; E' D / Q = 7.943540 at 30",
)
def pin_in_hole() -> Result:
    """Clearances of each half angle; beyond 85 degrees, where none is left, the pin is larger than the hole was."""
    rows: list[Row] = []
    lines: list[Line] = []
    degrees = np.arange(10, 101, 10)
    errors = []
    for elements in (80, 160, 320):
        system, found = bore(elements, 1e-3), []
        psi, weights = angles(system), system.pair.weights
        for angle in degrees:
            half = np.radians(angle)
            gap = clearance_of(half) * LOAD / MODULUS * (1 - np.cos(psi))
            pressure = system.contact((1,)).solve(gap).pressure[0]
            exact = LOAD / RADIUS * persson(psi, half)
            inside = np.abs(psi) < EDGE * half
            found.append(np.abs(pressure - exact)[inside].max() / exact.max())
            if elements < 320:
                continue
            what, outside = f"{angle} degrees", np.abs(psi) > half + 2 * np.pi / 320
            theirs, ours = (RADIUS / LOAD * p[inside] for p in (exact, pressure))
            rows += [
                profile(f"{what}: R p / Q", theirs, ours, 3e-3, scale=theirs.max()),
                number(f"{what}: largest R p / Q", persson(np.zeros(1), half)[0], ours.max(), 1e-3),
                number(f"{what}: pressure beyond the contact (MPa)", 0, pressure[outside].max(initial=0.0), 0, scale=1),
                number(f"{what}: load (N/mm)", LOAD, weights * pressure @ system.pair.normal[:, 1], 1e-9),
            ]
            if angle % 30 == 10:
                seen = np.abs(psi) < 1.2 * half
                dense = np.linspace(-1.2, 1.2, 400) * half
                lines.append(Line(f"Persson, {what}", np.degrees(dense), persson(dense, half), reference=True))
                lines.append(Line(f"fenwear, {what}", np.degrees(psi[seen]), RADIUS / LOAD * pressure[seen]))
        errors.append(float(np.mean(found)))
    rows.append(order("order of the largest error, mean of the angles", 1.5, errors, 0.5))
    return Result(rows, [Plot("Pin in a hole: pressure", "psi (degrees)", "R p / Q", lines)])


def wear_of(half_angle: float) -> float:
    """Return k P s / (R D) of rigid bodies at this half angle, rad."""
    return float(half_angle / np.cos(half_angle) - np.sin(half_angle))


def worn(system: Tribosystem, slid: float, tolerance: float = 0.003) -> Block:
    """Return the bore after sliding by so many mm, by jumps."""
    *_, last = jump(system, round(slid / float(system.sliding.ratio[0].mean())), tolerance=tolerance)
    return last


@verification(
    "bushing",
    "A bushing worn from a line contact to 85 degrees, by jumps: rigid bodies",
    "k P s / (R D) = psi0 / cos psi0 - sin psi0; depth D (cos psi / cos psi0 - 1); p = p0 cos psi",
)
def bushing() -> Result:
    """From a line to contacts of 30, 60 and 85 degrees to each side; bodies 10,000 times as stiff as steel."""
    rows: list[Row] = []
    lines: list[Line] = []
    clearance, coefficient, errors = 1e-3, 1e-11, []
    for elements in (80, 160):
        system, found = bore(elements, clearance, 1e4 * YOUNG, coefficient), []
        psi, weights = angles(system), system.pair.weights
        for angle in (30, 60, 85):
            half = np.radians(angle)
            last = worn(system, wear_of(half) * RADIUS * clearance / (coefficient * LOAD))
            depth, pressure = last.wear[-1], last.pressure[-1]
            exact = clearance * np.maximum(np.cos(psi) / np.cos(half) - 1, 0)
            largest, inside = LOAD / RADIUS / (half + np.sin(half) * np.cos(half)), np.abs(psi) < EDGE * half
            area, metered = weights @ depth, float(last.totals.of("volume_punch")[-1])
            path = float(last.totals.of("load_path")[-1])
            what = f"{angle} degrees, {elements} elements"
            found.append(np.abs(pressure - largest * np.cos(psi))[inside].max() / largest)
            theirs, ours = exact / clearance, depth / clearance
            rows += [
                profile(f"{what}: depth / D", theirs, ours, 1e-3, scale=theirs.max()),
                number(f"{what}: eccentricity / D", 1 / np.cos(half), _eccentricity(last) / clearance, 1e-3),
                number(f"{what}: area / (R D)", 2 * (np.tan(half) - half), area / RADIUS / clearance, 1e-3),
                profile(f"{what}: p / p0", np.cos(psi[inside]), pressure[inside] / largest, 0.03),
                number(f"{what}: volume by depth over metered", 1, area / metered, 1e-9),
                number(f"{what}: volume over k and the sliding of p", 1, metered / coefficient / path, 1e-9),
                number(f"{what}: load (N/mm)", LOAD, weights * pressure @ system.pair.normal[:, 1], 1e-9),
            ]
            if elements == 160:
                dense = np.linspace(-np.pi / 2, np.pi / 2, 400)
                shape = np.maximum(np.cos(dense) / np.cos(half) - 1, 0)
                seen = np.abs(psi) < np.pi / 2
                lines.append(Line(f"exact, {angle} degrees", np.degrees(dense), shape, reference=True))
                lines.append(Line(f"fenwear, {angle} degrees", np.degrees(psi[seen]), depth[seen] / clearance))
        errors.append(float(np.mean(found)))
    rows.append(order("order of the pressure's largest error, mean of the angles", 1, errors, 0.7))
    return Result(rows, [Plot("Worn bushing: depth", "psi (degrees)", "depth / D", lines, ("linear", "log"))])


def _eccentricity(last: Block) -> float:
    """Return the way from the bore's middle to the shaft's at the end, mm."""
    return float(computed(last, quantities(last.system))["eccentricity"][-1])


TABLE = (  # s (mm); depth (mm), half angle (degrees), area (mm²), largest pressure (MPa) at D = 0.05 mm and P = 50 N/mm
    (1e5, 7.446e-3, 29.8, 0.051368, 5.317),
    (1e6, 42.191e-3, 57.1, 0.552101, 3.445),
    (1e7, 331.773e-3, 82.4, 6.130718, 3.1863),
)


@verification(
    "bushing-elastic",
    "The same of steel in steel, R = 10, D = 0.05 mm, 50 N/mm, k = 1e-8 / MPa, after 0.1, 1 and 10 km",
    "an independent spectral solution of elastic planes, of leading order in D / R",
)
def bushing_elastic() -> Result:
    """The arc grows to 82.4 degrees on each side; P and D a tenth: no ratio changes but D / R."""
    tenth = 0.1
    system = bore(160, 0.05 * tenth, load=50.0 * tenth)
    psi, weights, rows = angles(system), system.pair.weights, list[Row]()
    first = system.contact((1,)).solve(system.pair.initial_gap).pressure.max() / tenth
    rows.append(number("start: largest pressure (MPa)", 30.43, first, 2e-2))
    for slid, depth, degrees, area, largest in TABLE:
        last, what = worn(system, slid), f"{slid / 1e6:g} km"
        touching = np.degrees(np.abs(psi[last.pressure[-1] > 0]).max())
        rows += [
            number(f"{what}: depth (mm)", depth, last.wear[-1].max() / tenth, 1e-3),
            number(f"{what}: half angle (degrees), in nodes", degrees, touching, 1, scale=360 / 320),
            number(f"{what}: worn area (mm²)", area, weights @ last.wear[-1] / tenth, 1e-3),
            number(f"{what}: largest pressure (MPa)", largest, last.pressure[-1].max() / tenth, 5e-3),
        ]
    return Result(rows)
