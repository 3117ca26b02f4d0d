"""Solids: contact on surfaces, transfer between meshes that do not match, slices; and how all of them are described."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np

from fenwear import vary
from fenwear.case import Case, make_case
from fenwear.common.arrays import Array
from fenwear.steps import growth_rate, march, steady
from fenwear.system import Tribosystem, assemble
from fenwear_verify.suite import Line, Plot, Result, Row, number, order, profile, verification

YOUNG, POISSON = 210_000.0, 0.3
STEEL, RIGID = {"young": YOUNG, "poisson": POISSON}, {"young": 1e6 * YOUNG, "poisson": POISSON}
MODULUS = YOUNG / (1 - POISSON**2)  # E* of a rigid body on steel, MPa
ELLIPSE, ELLIPSE_PEAK = (0.2080002, 0.1311640), 2 * 1750.100  # of radii 10 and 5 mm under 200 N: half-axes, p0
ROTATION = {"kind": "rotation", "angular_speed": 1.0, "duration": 1.0}


def describe(
    geometry: Mapping[str, Any],
    punch: Mapping[str, Any],
    strip: Mapping[str, Any],
    *,
    kind: str = "solid",
    materials: tuple[Mapping[str, float], Mapping[str, float]] = (STEEL, STEEL),
    **tables: Any,
) -> Case:
    """Return the case of one material for each body.

    Args:
        geometry: Table of the case file.
        punch, strip: Their supports and loads.
        kind: Of the model.
        materials: Of punch and strip.
        tables: Further tables of the case, or others in place of the defaults.
    """
    case = {
        "geometry": geometry,
        "model": {"kind": kind},
        "materials": {"of_punch": dict(materials[0]), "of_strip": dict(materials[1])},
        "punch": {"regions": {"punch_body": "of_punch"}, **punch},
        "strip": {"regions": {"strip_body": "of_strip"}, **strip},
        "wear": {"punch": {"coefficient": 0}},
        "motion": {"kind": "one-way", "direction": "rightward", "speed": 1.0, "duration": 1.0},
        "run": {"half_cycles": 1},
        **tables,
    }
    return make_case(case)


def solve(
    geometry: Mapping[str, Any], punch: Mapping[str, Any], strip: Mapping[str, Any], **tables: Any
) -> Tribosystem:
    """Return the system of `describe`; collective."""
    return assemble(describe(geometry, punch, strip, **tables))


def middles(body: str) -> list[dict[str, Any]]:
    """Return the supports of the planes of symmetry of a quarter of solid_blocks.geo."""
    return [{"on": f"{body}_middle_{axis}", "fix": [axis]} for axis in "xy"]


# ------------------------------------------------------------------------------- transfer


@verification(
    "solid-patch",
    "Patch test: two blocks whose hexahedra and tetrahedra do not match, pressed by 100 MPa",
    "uniform uniaxial stress, which the elements hold exactly",
)
def patch() -> Result:
    """Uniform pressure whatever the meshes; outer sides are free, the planes of symmetry held.

    Under 100 MPa the rounding of coordinates, 1e-16 mm, is small against what the load closes.
    """
    rows: list[Row] = []
    for punch, strip, degree in (("hexahedra", "tetrahedra", 1), ("hexahedra", "tetrahedra", 2),
                                 ("tetrahedra", "hexahedra", 2), ("hexahedra", "hexahedra", 3),
                                 ("tetrahedra", "tetrahedra", 3)):  # fmt: skip
        sizes = {
            "quarter": 1,
            "across_x": 2,
            "across_y": 3,
            "strip_across_x": 3,
            "strip_across_y": 2,
            "punch_tetrahedra": int(punch == "tetrahedra"),
            "strip_tetrahedra": int(strip == "tetrahedra"),
        }
        system = solve(
            {"file": "solid_blocks.geo", "degree": degree, "parameters": sizes},
            {
                "supports": middles("punch"),
                "loads": [{"on": "punch_far", "traction": [0, 0, -100]}],
            },
            {"supports": [*middles("strip"), {"on": "strip_far", "fix": ["z"]}]},
        )
        pair = system.pair
        p = system.contact((1,)).solve(pair.initial_gap).pressure[0]
        what = f"{punch} on {strip} of degree {degree}"
        forces = pair.strip.spread @ pair.strip.weights
        rows += [
            profile(f"{what}: forces on the strip's nodes (N)", forces, pair.transfer.T @ pair.weights, 1e-12),
            profile(f"{what}: pressure (MPa)", np.full(len(p), 100.0), p, 1e-10, scale=100),
        ]
    return Result(rows)


@verification(
    "solid-slice",
    "A solid slice with its sides held is in plane strain",
    "the plane model on the same mesh, which is verified by itself",
)
def slice_of_plane_strain() -> Result:
    """Pressure with friction, after 20 half-cycles, of the cyclic steady state and of the optimum, along the slice."""
    depth = 0.7
    sizes = {"width": 2, "punch_height": 1.5, "strip_height": 1, "punch_layers": 2, "strip_layers": 2, "growth": 1.4}
    shared: dict[str, Any] = {
        "contact": {"friction": 0.3},
        "wear": {"punch": {"coefficient": 2e-7}},
        "motion": {"kind": "reciprocating", "amplitude": 0.5, "period": 1.0},
    }
    flat = solve(
        {"file": "blocks.geo", "degree": 2, "parameters": {**sizes, "across": 4}},
        {"supports": [{"on": "punch_sides", "fix": ["x"]}], "loads": [{"on": "punch_far", "force": [0, -100]}]},
        {"supports": [{"on": "strip_far", "fix": ["x", "z"]}]},
        **{**shared, "model": {"plane": "strain", "thickness": depth}},
    )
    held = {body: {"on": f"{body}_ends", "fix": ["y"]} for body in ("punch", "strip")}
    solid = solve(
        {
            "file": "solid_blocks.geo",
            "degree": 2,
            "parameters": {**sizes, "depth": depth, "across_x": 4, "across_y": 1},
        },
        {
            "supports": [{"on": "punch_sides", "fix": ["x"]}, held["punch"]],
            "loads": [{"on": "punch_far", "force": [0, 0, -100]}],
        },
        {"supports": [{"on": "strip_far", "fix": ["x", "y", "z"]}, held["strip"]]},
        **shared,
    )
    node = np.searchsorted(flat.pair.x, solid.pair.x - 1e-9)
    rows: list[Row] = []
    compared: dict[str, Callable[[Tribosystem], Array]] = {
        "contact, rightward": lambda s: s.contact((1,)).solve(s.pair.initial_gap).pressure[0],
        "after 20 half-cycles": lambda s: list(march(s, 20))[-1].pressure[-1],
        "cyclic steady state": lambda s: steady(s).pressure[0],
        "optimum": lambda s: s.optimum(1).pressure,
    }
    for name, pressure in compared.items():
        exact = pressure(flat)
        rows.append(profile(f"{name}: pressure (MPa)", exact[node], pressure(solid), 1e-9, scale=exact.max()))
    rates = [growth_rate(s, steady(s).phase_pressure) for s in (flat, solid)]
    rows.append(number("rate of the slowest disturbance (1/s)", rates[0], rates[1], 1e-8))
    return Result(rows)


# --------------------------------------------------------------------------- indentation


@cache
def quarter(elements: int, degree: int, *, tetrahedra: bool = False) -> Tribosystem:
    """Return a quarter of a rigid body, on a square of 0.23 mm, on a steel block ten times as wide; collective."""
    width, far, finer = 0.46, 2.4, elements / 4
    sizes = {
        "quarter": 1,
        "width": width,
        "depth": width,
        "margin_x": far,
        "margin_y": far,
        "margin_elements": round(4 * finer),
        "spread": 2.5 ** (1 / finer),
        "across_x": elements,
        "across_y": elements,
        "punch_height": width / 2,
        "punch_layers": 1,
        "strip_height": far,
        "strip_layers": round(6 * finer),
        "growth": 2.1 ** (1 / finer),
        "punch_tetrahedra": int(tetrahedra),
        "strip_tetrahedra": int(tetrahedra),
    }
    return solve(
        {"file": "solid_blocks.geo", "degree": degree, "parameters": sizes},
        {"supports": middles("punch"), "loads": [{"on": "punch_far", "force": [0, 0, -1]}]},
        {"supports": [*middles("strip"), {"on": "strip_far", "fix": ["x", "y", "z"]}]},
        materials=(RIGID, STEEL),
    )


def indent(system: Tribosystem, load: float, radii: tuple[float, float]) -> tuple[Array, Array]:
    """Return the nodes (n, 3) and the pressure of a body with the gap x²/2R1 + y²/2R2 under a load, N."""
    loaded = vary(system, f"punch.loads=[{{on='punch_far', force=[0, 0, {-load / 4!r}]}}]")
    x = loaded.pair.punch.x
    gap = x[:, 0] ** 2 / (2 * radii[0]) + x[:, 1] ** 2 / (2 * radii[1])
    return x, loaded.contact((1,)).solve(gap).pressure[0]


def hertz(x: Array, axes: tuple[float, float], peak: float) -> Array:
    """Return p0 sqrt(1 - x²/a² - y²/b²), MPa."""
    square = 1 - (x[:, 0] / axes[0]) ** 2 - (x[:, 1] / axes[1]) ** 2
    return np.asarray(peak * np.sqrt(np.maximum(square, 0)))


@verification(
    "solid-hertz",
    "Hertz: a rigid sphere and a rigid ellipsoid on steel",
    "K. L. Johnson, Contact Mechanics, 1985, sections 4.2(a) and (c)",
    slow=True,
)
def sphere() -> Result:
    """The sphere R = 10: p0³ = 6 P E*² / (pi³ R²); radii 10 and 5: half-axes 0.20800, 0.13116 at P = 200 N.

    Both are the contacts of two steel bodies under half the load, as a rigid one makes E* twice as large.
    """
    load, rows = 200.0, list[Row]()
    a = (3 * load * 10 / (4 * MODULUS)) ** (1 / 3)
    peak = 3 * load / (2 * np.pi * a**2)
    plots = []
    for elements, degree, tetrahedra in ((12, 1, False), (6, 2, False), (6, 2, True)):
        system = quarter(elements, degree, tetrahedra=tetrahedra)
        x, p = indent(system, load, (10.0, 10.0))
        exact, inside = hertz(x, (a, a), peak), np.hypot(x[:, 0], x[:, 1]) < 0.8 * a
        what = f"{'tetrahedra' if tetrahedra else 'hexahedra'} of degree {degree}, {elements} over the quarter"
        rows += [
            number(f"sphere, {what}: largest pressure p0 (MPa)", peak, p.max(), 0.02),
            profile(f"sphere, {what}: pressure for r < 0.8 a (MPa)", exact[inside], p[inside], 0.02, scale=peak),
            number(f"sphere, {what}: force (N)", load / 4, p @ system.pair.weights, 1e-11),
        ]
        shown = np.argsort(np.hypot(x[:, 0], x[:, 1]))
        r, dense = np.hypot(x[:, 0], x[:, 1]), np.linspace(0, 1.3 * a, 300)
        lines = [
            Line("Hertz", dense, peak * np.sqrt(np.maximum(1 - (dense / a) ** 2, 0)), reference=True),
            Line("fenwear", r[shown], p[shown]),
        ]
        plots.append(Plot(f"Sphere on a flat, {what}", "r (mm)", "pressure (MPa)", lines))
        x, p = indent(system, load, (10.0, 5.0))
        exact = hertz(x, ELLIPSE, ELLIPSE_PEAK)
        inside = exact > 0.6 * ELLIPSE_PEAK
        rows += [
            number(f"ellipsoid, {what}: largest pressure p0 (MPa)", ELLIPSE_PEAK, p.max(), 0.02),
            profile(f"ellipsoid, {what}: pressure (MPa)", exact[inside], p[inside], 0.04, scale=ELLIPSE_PEAK),
        ]
    # The pressure's slope is infinite at the edge: the order is 1 whatever the elements' degree.
    for name, radii in (("sphere", (10.0, 10.0)), ("ellipsoid", (10.0, 5.0))):
        errors = [indentation_error(elements, radii) for elements in (6, 12)]
        rows += [
            number(f"{name}, hexahedra of degree 1, {elements}: L2 error of four loads", 0, error, 0.1, scale=1)
            for elements, error in zip((6, 12), errors, strict=True)
        ]
        rows.append(order(f"{name}, hexahedra of degree 1: order of it", 1, errors, 0.5))
    return Result(rows, plots)


def indentation_error(elements: int, radii: tuple[float, float]) -> float:
    """Return the L2 error of the pressure over that of the pressure, the mean of four loads.

    Half-axes and largest pressure grow with the cube root of the load.
    """
    system, found = quarter(elements, 1), []
    a = (3 * 200 * 10 / (4 * MODULUS)) ** (1 / 3)
    axes, peak = ((a, a), 300 / (np.pi * a**2)) if radii[0] == radii[1] else (ELLIPSE, ELLIPSE_PEAK)
    for load in (90.0, 120.0, 160.0, 200.0):
        grown = (load / 200) ** (1 / 3)
        x, p = indent(system, load, radii)
        exact = hertz(x, (axes[0] * grown, axes[1] * grown), peak * grown)
        found.append(np.sqrt(system.pair.weights @ (p - exact) ** 2 / (system.pair.weights @ exact**2)))
    return float(np.mean(found))


# ---------------------------------------------------------------------------------- rings
