"""Contact of curved surfaces that are meshed: their gap and normals come from the geometry, not from a formula."""

from __future__ import annotations

import numpy as np

from fenwear import vary
from fenwear.checks.surface_ends import contact_limits
from fenwear.common.arrays import Array
from fenwear.system import Tribosystem
from fenwear_verify.bodies import STEEL, builtin
from fenwear_verify.contact import measured_half_width, semi_ellipse
from fenwear_verify.suite import Line, Plot, Result, Row, number, order, profile, verification

LIGHT = {"young": 7e4, "poisson": 0.33}  # the cylinder; the flat is of steel
RADIUS, LOADS, SCAR = 6.0, (18.5, 50.0, 150.0), 0.6  # mm; N/mm; width of the even elements, mm
FLAT, EDGE = 25.0, 200.0  # half-width of the flat and radius of the edges of the rounded punch, mm


def cylinder(elements: int) -> Tribosystem:
    """Return a light cylinder on a steel flat, without friction, with `elements` elements on 0.6 mm; collective."""
    return builtin(
        "fretting",
        "contact.friction=0",
        f"materials.light={{young={LIGHT['young']}, poisson={LIGHT['poisson']}}}",
        "punch.regions={punch_body='light'}",
        f"geometry.parameters.elements_along_contact={elements}",
    )


def pressed(system: Tribosystem, load: float) -> tuple[Array, Array]:
    """Return x and the pressure under a load on the punch's top, N/mm."""
    thickness = system.case.model.thickness
    loaded = vary(system, f"punch.loads=[{{on='punch_top', force=[0, {-float(load) * thickness!r}]}}]")
    return system.pair.x, loaded.contact((1,)).solve(loaded.pair.initial_gap).pressure[0]


@verification(
    "cylinder-on-flat",
    "Hertz: a meshed cylinder on a block of another material",
    "K. L. Johnson, Contact Mechanics, 1985, section 4.2",
)
def cylinder_on_flat() -> Result:
    """Half-width a = 2 sqrt(P R / (pi E*)), p0 = 2 P / (pi a), 1/E* = sum (1 - nu²)/E, on bodies of some millimetres.

    The bodies are 40 and more times as large as a: (a/R)² < 6e-4 is what half-planes and the parabola leave out.
    """
    modulus = 1 / sum((1 - m["poisson"] ** 2) / m["young"] for m in (LIGHT, STEEL))
    rows: list[Row] = []
    lines: list[Line] = []
    errors = []
    for load in LOADS:
        a = 2 * np.sqrt(load * RADIUS / (np.pi * modulus))
        peak = 2 * load / (np.pi * a)
        system = cylinder(120)
        x, p = pressed(system, load)
        exact, inside, case = semi_ellipse(x, a, peak), np.abs(x) < 0.9 * a, f"P = {load:g} N/mm"
        rows += [
            number(f"{case}: half-width a (mm)", a, measured_half_width(x, p), 1e-3),
            number(f"{case}: largest pressure p0 (MPa)", peak, p.max(), 1e-3),
            number(f"{case}: force (N/mm)", load, system.pair.weights @ p, 1e-11),
            profile(f"{case}: pressure for |x| < 0.9 a (MPa)", exact[inside], p[inside], 5e-3, scale=peak),
        ]
        shown, dense = np.abs(x) < 1.3 * a, np.linspace(-1.3, 1.3, 400) * a
        lines.append(Line(f"Hertz, {case}", dense, semi_ellipse(dense, a, peak), reference=True))
        lines.append(Line(f"fenwear, {case}", x[shown], p[shown]))
    for elements in (30, 60, 120):
        system, found = cylinder(elements), []
        for load in LOADS:
            a = 2 * np.sqrt(load * RADIUS / (np.pi * modulus))
            x, p = pressed(system, load)
            exact, weights = semi_ellipse(x, a, 2 * load / (np.pi * a)), system.pair.weights
            found.append(np.sqrt(weights @ (p - exact) ** 2 / (weights @ exact**2)))
        errors.append(float(np.mean(found)))
    # The pressure's slope is infinite at the edge: the order is 1 whatever the elements' degree.
    rows.append(order("order in the element size, mean of the loads", 1, errors, 0.5))
    return Result(rows, [Plot("Meshed cylinder on a flat: pressure", "x (mm)", "pressure (MPa)", lines)])


def rounded(x: Array, b: float, load: float) -> Array:
    """Return the pressure under a flat punch with rounded edges, in contact where |x| < b, in MPa.

    With sin phi = x/b and sin phi0 = (half-width of the flat)/b, the solution of the half-plane's equation
    for a gap whose slope grows by 1/R from the end of the flat.
    """
    x = np.where(np.abs(np.abs(x) - FLAT) < 1e-9, x * (1 + 1e-9), x)  # the limit at the end of the flat exists
    phi0, phi = np.arcsin(FLAT / b), np.arcsin(np.clip(x / b, -1, 1))
    angle = np.pi - 2 * phi0
    ratio = np.abs(np.sin(phi + phi0) / np.sin(phi - phi0))
    tangents = np.abs(np.tan((phi + phi0) / 2) * np.tan((phi - phi0) / 2))
    shape = angle * np.cos(phi) + np.sin(phi) * np.log(ratio) + np.sin(phi0) * np.log(tangents)
    found = 2 * load / (np.pi * b) / (angle - np.sin(2 * phi0)) * shape
    return np.asarray(np.where(np.abs(x) < b, found, 0.0))


@verification(
    "rounded-punch",
    "A flat rigid punch with rounded edges on a half-plane, without friction",
    "Ciavarella, Hills and Monno, The influence of rounded edges on indentation by a flat punch, 1998",
)
def rounded_punch() -> Result:
    """Load E* b² (pi - 2 phi0 - sin 2 phi0) / 4R for a contact |x| < b, sin phi0 = a/b, and its pressure."""
    system = builtin(
        "rounded-punch",
        "contact.friction=0",
        "materials.rigid={young=2e11, poisson=0.3}",
        "punch.regions={punch_body='rigid'}",
        f"geometry.parameters.edge_radius={EDGE}",
        "geometry.parameters.strip_height=3000",
        "geometry.parameters.strip_length=12000",
        "geometry.parameters.elements_along_flat=40",
        "geometry.degree=3",
    )
    modulus = STEEL["young"] / (1 - STEEL["poisson"] ** 2)
    rows: list[Row] = []
    lines: list[Line] = []
    for b in (27.5, 29.0):
        phi0 = np.arcsin(FLAT / b)
        load = modulus * b**2 / (4 * EDGE) * (np.pi - 2 * phi0 - np.sin(2 * phi0))
        x, p = pressed(system, load)
        exact, inside, case = rounded(x, b, load), np.abs(x) < 0.98 * b, f"b = {b:g} mm"
        spacing = np.diff(x)[np.searchsorted(x, b) - 1]
        rows += [
            number(f"{case}: outermost node in contact (mm), in node spacings", b, x[p > 0].max(), 1, scale=spacing),
            number(f"{case}: pressure at the centre (MPa)", rounded(np.zeros(1), b, load)[0], p[len(x) // 2], 5e-4),
            number(f"{case}: largest pressure (MPa)", exact.max(), p.max(), 5e-4),
            profile(f"{case}: pressure for |x| < 0.98 b (MPa)", exact[inside], p[inside], 2e-3, scale=exact.max()),
        ]
        dense = np.linspace(-1.02, 1.02, 1000) * b
        lines.append(Line(f"exact, {case}", dense, rounded(dense, b, load), reference=True))
        lines.append(Line(f"fenwear, {case}", x, p))
    return Result(rows, [Plot("Punch with rounded edges: pressure", "x (mm)", "pressure (MPa)", lines)])


@verification(
    "clipped",
    "Contact that its meshed surface clips: it is told, with the width that is needed",
    "Hertz for the first contact; the chord c of a cylinder worn flat, A = c³ / (12 R)",
)
def clipped_contact() -> Result:
    """A surface of 0.1 mm under loads whose contact is wider, then worn to a chord of 0.5 mm; and one wide enough."""
    modulus = 1 / sum((1 - m["poisson"] ** 2) / m["young"] for m in (LIGHT, STEEL))
    rows: list[Row] = []
    for width, load in ((0.1, 150.0), (0.6, 150.0)):
        settings = (f"geometry.parameters.contact_width={width}", "geometry.parameters.elements_along_contact=20")
        system = vary(cylinder(20), *settings)
        a = 2 * np.sqrt(load * RADIUS / (np.pi * modulus))
        _, p = pressed(system, load)
        limits = contact_limits(system)
        clipped = float((limits.clips & (p > 0)).sum())
        wanted = 2.0 if 2 * a > width else 0.0
        rows.append(number(f"surface of {width:g} mm: clipped ends", wanted, clipped, 1e-12, scale=1.0))
        if clipped:
            rows.append(number("width needed, unworn (mm)", 2 * a, limits.width_needed(0.0, load), 0.01))
            chord = 0.5
            area = chord**3 / (12 * RADIUS)
            rows.append(number("width needed, worn to 0.5 mm (mm)", chord, limits.width_needed(area, 1e-3), 0.01))
    return Result(rows)
