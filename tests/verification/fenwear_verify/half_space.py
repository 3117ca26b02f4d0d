"""A half-space under pressure and under heat: Hertz, Boussinesq and Love, on rings and on solids, at two mesh sizes."""

from __future__ import annotations

from functools import cache, partial
from typing import Any

import numpy as np

from fenwear.case import Case
from fenwear.common.arrays import Array
from fenwear.system import Tribosystem, assemble, place_case
from fenwear_verify.solid import MODULUS, RIGID, ROTATION, STEEL, describe, middles
from fenwear_verify.suite import Line, Plot, Result, Row, number, order, profile, verification

FAR = 60.0  # extent of the body over that of the contact
CONDUCTING = {**STEEL, "conductivity": 50.0, "heat_capacity": 4.6e8, "density": 7.8e-9, "expansion": 0.0}


def _sizes(radius: float, across: int) -> dict[str, float]:
    """Return a rigid disc on a body `FAR` times as large, whose elements are even under the disc."""
    finer = across / 16
    size = radius / across
    count = round(22 * finer)
    return {
        "inner_radius": 0,
        "outer_radius": radius,
        "margin_outside": FAR * radius,
        "margin_elements": count,
        "spread": growth_of(FAR * radius, size, count),
        "across": across,
        "punch_height": radius,
        "punch_layers": 1,
        "strip_height": FAR * radius,
        "strip_layers": count,
        "growth": growth_of(FAR * radius, size, count),
    }


def growth_of(length: float, first: float, count: int) -> float:
    """Return the ratio of neighbours in a line of `count` elements, of which the first has this length."""
    low, high = 1.0 + 1e-9, 10.0
    for _ in range(100):
        ratio = (low + high) / 2
        low, high = (ratio, high) if first * (ratio**count - 1) / (ratio - 1) < length else (low, ratio)
    return low


def disc_case(radius: float, across: int, **tables: Any) -> Case:
    """Return a rigid disc on steel, in an axisymmetric model of degree 2."""
    held = [{"on": f"strip_{name}"} for name in ("far", "outside")]
    return describe(
        {"file": "rings.geo", "degree": 2, "parameters": _sizes(radius, across)},
        {"loads": [{"on": "punch_far", "force": [0, -200]}]},
        {"supports": [{**group, "fix": ["x", "z"]} for group in held], "temperatures": held},
        kind="axisymmetric",
        motion=ROTATION,
        **tables,
    )


@cache
def disc(radius: float, across: int) -> Tribosystem:
    """Return the system of a rigid disc on steel; collective."""
    return assemble(disc_case(radius, across, materials=(RIGID, STEEL)))


@verification(
    "round-hertz",
    "Hertz: a sphere on steel in an axisymmetric model",
    "K. L. Johnson, Contact Mechanics, 1985, section 4.2(a): a³ = 3 P R / 4 E*, delta = a² / R",
)
def round_hertz() -> Result:
    """R = 10 mm, 200 N on a rigid sphere, which are 100 N on one of steel: a = 0.18663, delta = 3.4829e-3 mm."""
    a = (3 * 200 * 10 / (4 * MODULUS)) ** (1 / 3)
    peak = 3 * 200 / (2 * np.pi * a**2)
    rows, errors, lines = list[Row](), [], list[Line]()
    for across in (16, 32):
        system = disc(0.3, across)
        r = system.pair.x
        contact = system.contact((1,)).solve(r**2 / 20)
        p = contact.pressure[0]
        exact = peak * np.sqrt(np.maximum(1 - (r / a) ** 2, 0))
        errors.append(float(np.sqrt(system.pair.weights @ (p - exact) ** 2 / (system.pair.weights @ exact**2))))
        inside, what = r < 0.85 * a, f"{across} elements"
        rows += [
            number(f"{what}: largest pressure (MPa)", peak, p.max(), 5e-3),
            profile(f"{what}: pressure for r < 0.85 a (MPa)", exact[inside], p[inside], 0.02, scale=peak),
            number(f"{what}: radius (mm)", a, np.sqrt(system.pair.weights @ (p > 0) / np.pi), 0.05),
            number(f"{what}: approach (mm)", a**2 / 10, abs(contact.rigid[0, 0]), 0.01),
        ]
        lines.append(Line(what, r, p))
    rows.append(order("order of the pressure's L2 error", 1, errors, 0.6))
    dense = np.linspace(0, 1.3 * a, 300)
    shape = Line("Hertz", dense, peak * np.sqrt(np.maximum(1 - (dense / a) ** 2, 0)), reference=True)
    return Result(rows, [Plot("Sphere on a flat", "r (mm)", "pressure (MPa)", [shape, *lines])])


@verification(
    "flat-round-punch",
    "A rigid flat round punch on steel, without grading: order of convergence at the singular edge",
    "Boussinesq: p = P / (2 pi a sqrt(a² - r²)), delta = P / (2 E* a)",
)
def flat_punch() -> Result:
    """P = 1,000 N, a = 1 mm; the approach is an energy, whose error falls as the elements at the edge do."""
    rows, far, near = list[Row](), [], []
    delta = 1000 / (2 * MODULUS)
    for across in (8, 16, 32):
        system = disc(1.0, across)
        r = system.pair.x
        contact = system.contact((1,)).solve(np.zeros(len(r)))
        p = 5 * contact.pressure[0]
        exact = 1000 / (2 * np.pi * np.sqrt(np.maximum(1 - r**2, 1e-12)))
        inside = r < 0.8
        far.append(5 * abs(contact.rigid[0, 0]))
        near.append(float(np.sqrt(np.mean((p[inside] / exact[inside] - 1) ** 2))))
    rows += [
        number("32 elements: pressure for r < 0.8 a, rms", 0, near[-1], 0.01, scale=1),
        number("32 elements: approach (mm), on a body 60 times as wide", delta, far[-1], 0.02),
        order("order of the pressure's error for r < 0.8 a", 1, near, 0.5),
        order("order of the approach", 1, np.abs(np.diff(far)), 0.3),
    ]
    return Result(rows)


# ----------------------------------------------------------------------------- uniform sources


def square_case(elements: int, **tables: Any) -> Case:
    """Return a quarter of a rigid square of 1 mm on a steel block ten times as wide."""
    held = [{"on": f"strip_{name}"} for name in ("far", "sides", "ends")]
    return describe(
        {"file": "solid_blocks.geo", "degree": 2, "parameters": _square_sizes(elements)},
        {"supports": middles("punch"), "loads": [{"on": "punch_far", "force": [0, 0, -1]}]},
        {
            "supports": [*middles("strip"), *({**group, "fix": ["x", "y", "z"]} for group in held)],
            "temperatures": held,
        },
        **tables,
    )


def _square_sizes(elements: int) -> dict[str, float]:
    layers = round(1.5 * elements)
    spread = growth_of(10, 0.5 / elements, layers)
    return {
        "quarter": 1,
        "margin_x": 10,
        "margin_y": 10,
        "margin_elements": layers,
        "spread": spread,
        "across_x": elements,
        "across_y": elements,
        "punch_layers": 1,
        "strip_height": 10,
        "strip_layers": layers,
        "growth": spread,
    }


def _apart(x: Array, values: Array) -> tuple[float, float]:
    """Return the value in the middle of a source, and how much less it is at its edge or corner."""
    middle, edge = (float(values[np.argmin(sign * np.linalg.norm(x[:, :-1], axis=1))]) for sign in (1, -1))
    return middle, middle - edge


def _warmed(case: Case) -> Array:
    """Return the steady temperature at the contact nodes from a unit flux at each of them, K; collective."""
    placed = place_case(case)
    body, pair = placed.bodies.heat[1], placed.pair
    theta = body.step(0.0, np.inf).respond(body.place(pair.transfer.T @ pair.weights)[:, None])
    return np.asarray(pair.transfer @ body.trace.pick(theta)[:, 0, 0])


@verification(
    "love",
    "Uniform pressure and uniform heat on a disc and on a square of a half-space",
    "Love: u E* / p L = 1.1221997 and 0.5610999 on a unit square, 2 and 4/pi on a disc; T = q L / K times half of that",
    slow=True,
)
def love() -> Result:
    """In the middle, where the finite body of steel shows, and how much less it is at the edge or corner."""
    rows: list[Row] = []
    hot: dict[str, Any] = {"materials": (CONDUCTING, CONDUCTING), "heat": {}}
    for name, middle, edge, sizes in (("disc", 2.0, 4 / np.pi, (8, 16)), ("square", 1.1221997, 0.5610999, (3, 5))):
        make = partial(disc_case, 1.0) if name == "disc" else square_case
        errors: dict[str, list[float]] = {}
        for elements in sizes:
            system = assemble(make(elements, materials=(RIGID, STEEL)))
            x = system.pair.punch.x
            answers = {
                "displacement (p L / E*)": (
                    1.0,
                    system.elastic.interface.compliance(0.0).apply(np.ones(len(x))) * MODULUS,
                ),
                "temperature (q L / K)": (0.5, _warmed(make(elements, **hot)) * CONDUCTING["conductivity"]),
            }
            for what, (factor, values) in answers.items():
                found, less = _apart(x, values)
                said = f"{name}, {elements} elements: {what}"
                rows += [
                    number(f"{said} in the middle", factor * middle, found, 0.06),
                    number(f"{said}, less at the edge", factor * (middle - edge), less, 0.01),
                ]
                errors.setdefault(what, []).append(abs(less - factor * (middle - edge)))
        if name == "disc":
            rows += [order(f"disc: {what}, order at the edge", 2, found, 0.5) for what, found in errors.items()]
    return Result(rows)
