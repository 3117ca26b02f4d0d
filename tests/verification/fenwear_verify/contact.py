"""Contact of half-planes: cylinders and flat punches, without and with friction."""

from __future__ import annotations

from functools import cache

import numpy as np

from fenwear import vary
from fenwear.common.arrays import Array
from fenwear.system import Tribosystem
from fenwear_verify.bodies import builtin, rigid_punch, two_blocks
from fenwear_verify.suite import Line, Plot, Result, Row, number, order, profile, verification

UPPER, LOWER = {"young": 7e4, "poisson": 0.1}, {"young": 2e5, "poisson": 0.35}
RADIUS = 200.0  # of the cylinder, mm
LOADS = (2e4, 4e4, 8e4)  # on the cylinder, N/mm
CORE = 48.0  # width of the evenly divided part of the surfaces, mm
HALF_WIDTH, LOAD = 30.0, 1000.0  # of the flat punch, mm; N/mm
FINE = ("geometry.parameters.elements_along_contact=32", "geometry.parameters.edge_grading=64")


@cache
def half_planes(friction: float, elements: int = 40) -> Tribosystem:
    """Return two elastic blocks of 300 m in plane strain, evenly divided where |x| < 24 mm; collective.

    So large because the friction force tilts the surfaces of any finite block, which shifts the contact.
    """
    far, ratio = 3e5, 1.6
    size = CORE / elements
    count = round(np.log(far / size * (ratio - 1)) / np.log(ratio))
    sizes = {
        "width": 2 * far,
        "punch_height": far,
        "strip_height": far,
        "core": CORE,
        "across": elements,
        "outer": count,
        "spread": ratio,
        "punch_layers": count,
        "strip_layers": count,
        "growth": ratio,
    }
    return two_blocks(UPPER, LOWER, sizes, degree=3, contact={"friction": friction})


def pressed(load: float, friction: float = 0.0, elements: int = 40) -> Tribosystem:
    """Return the half-planes under a load, N/mm; collective."""
    return vary(half_planes(friction, elements), f"punch.loads=[{{on='punch_far', force=[0, {-load!r}]}}]")


def contact_modulus() -> float:
    """Return E* of the two materials in plane strain, 1/E* = sum of (1 - nu²)/E, MPa."""
    return 1 / sum((1 - m["poisson"] ** 2) / m["young"] for m in (UPPER, LOWER))


def dundurs() -> float:
    """Return Dundurs' beta of the two materials in plane strain, the punch's first."""
    shear = [m["young"] / (2 * (1 + m["poisson"])) for m in (UPPER, LOWER)]
    nu = [m["poisson"] for m in (UPPER, LOWER)]
    return ((1 - 2 * nu[0]) / shear[0] - (1 - 2 * nu[1]) / shear[1]) / (
        2 * ((1 - nu[0]) / shear[0] + (1 - nu[1]) / shear[1])
    )


def measured_half_width(x: Array, p: Array) -> float:
    """Return a of p² = p0² (1 - x²/a²), fitted inside the contact where the edge does not show."""
    inside = np.abs(x) < 0.8 * np.abs(x[p > 0]).max()
    slope, square = np.polyfit(x[inside] ** 2, p[inside] ** 2, 1)
    return float(np.sqrt(-square / slope))


def semi_ellipse(x: Array, a: float, peak: float) -> Array:
    """Return Hertz's pressure p0 sqrt(1 - x²/a²)."""
    return peak * np.sqrt(np.maximum(1 - (x / a) ** 2, 0))


@verification(
    "hertz",
    "Hertz: a cylinder on a half-plane, both elastic, without friction",
    "K. L. Johnson, Contact Mechanics, 1985, section 4.2",
    slow=True,
)
def hertz() -> Result:
    """Half-width a = 2 sqrt(P R / (pi E*)), p0 = 2 P / (pi a), p = p0 sqrt(1 - x²/a²) for the gap x²/2R."""
    rows: list[Row] = []
    lines: list[Line] = []
    for load in LOADS:
        a = 2 * np.sqrt(load * RADIUS / (np.pi * contact_modulus()))
        peak = 2 * load / (np.pi * a)
        x, p, gap = pressed_cylinder(load)
        exact = semi_ellipse(x, a, peak)
        case = f"P = {load / 1e3:g} kN/mm"
        inside, outside = np.abs(x) < 0.9 * a, np.abs(x) > 1.05 * a
        rows.append(number(f"{case}: half-width a (mm)", a, measured_half_width(x, p), 1e-3))
        rows.append(number(f"{case}: largest pressure p0 (MPa)", peak, p.max(), 5e-4))
        rows.append(profile(f"{case}: pressure for |x| < 0.9 a (MPa)", exact[inside], p[inside], 5e-3, scale=peak))
        rows.append(profile(f"{case}: pressure for |x| > 1.05 a (MPa)", exact[outside], p[outside], 0, scale=peak))
        beside = (np.abs(x) > a) & (np.abs(x) < 1.2 * CORE / 2)
        ratio = np.abs(x[beside]) / a
        opening = a**2 / (2 * RADIUS) * (ratio * np.sqrt(ratio**2 - 1) - np.arccosh(ratio))
        rows.append(profile(f"{case}: gap beside the contact (mm)", opening, gap[beside], 5e-3, scale=opening.max()))
        dense, shown = np.linspace(-1.3, 1.3, 400) * a, np.abs(x) < 1.3 * a
        lines.append(Line(f"Hertz, {case}", dense, semi_ellipse(dense, a, peak), reference=True))
        lines.append(Line(f"fenwear, {case}", x[shown], p[shown]))
    elements = (10, 20, 40, 80)
    found = [rms_error(count) for count in elements]
    plots = [
        Plot("Hertz: pressure", "x (mm)", "pressure (MPa)", lines),
        Plot(
            "Hertz: error of the pressure, whose slope is infinite at the edge",
            "element size h (mm)",
            "L2 error over that of the pressure",
            [Line("mean of the loads", CORE / np.array(elements), np.array(found))],
            ("log", "log"),
            (1.0,),
        ),
    ]
    return Result(rows, plots)


def parabola(x: Array) -> Array:
    """Return the cylinder's gap x²/2R, mm."""
    return np.asarray(x**2 / (2 * RADIUS), dtype=np.float64)


def pressed_cylinder(load: float, elements: int = 40) -> tuple[Array, Array, Array]:
    """Return x, the pressure and the gap of the cylinder under a load, N/mm."""
    system = pressed(load, elements=elements)
    x = system.pair.x
    state = system.contact((1,)).solve(parabola(x))
    return x, state.pressure[0], state.gap[0]


def rms_error(elements: int) -> float:
    """Return the L2 error of Hertz's pressure relative to the pressure's norm, the mean over the loads."""
    found = []
    for load in LOADS:
        a = 2 * np.sqrt(load * RADIUS / (np.pi * contact_modulus()))
        x, p, _ = pressed_cylinder(load, elements)
        weights, exact = half_planes(0.0, elements).pair.weights, semi_ellipse(x, a, 2 * load / (np.pi * a))
        found.append(np.sqrt(weights @ (p - exact) ** 2 / (weights @ exact**2)))
    return float(np.mean(found))


@verification(
    "sliding-cylinder",
    "A cylinder that slides on a half-plane, both elastic, with friction",
    "singular integral equation with Dundurs' beta, solved by Plemelj's formulas; "
    "Hills, Nowell and Sackfield, Mechanics of Elastic Contacts, 1993",
)
def sliding_cylinder() -> Result:
    """Pressure p = C (a + s)^(1/2 + g) (a - s)^(1/2 - g), s = x - e, with tan pi g = -d mu beta.

    From (1/pi) PV int p/(x - s) + tan(pi g) p = E* x / 2R by Plemelj's formulas: the contact's middle
    lies at e = 2 g a, C = E* cos(pi g) / 2R, and a² = 4 P R / (pi E* (1 - 4 g²)).
    """
    load, friction = 4e4, 0.8
    system = pressed(load, friction)
    x = system.pair.x
    rows: list[Row] = []
    lines: list[Line] = []
    for d in (1, -1):
        g = -d * np.arctan(friction * dundurs()) / np.pi
        a = 2 * np.sqrt(load * RADIUS / (np.pi * contact_modulus() * (1 - 4 * g**2)))

        def pressure(x: Array, a: float = a, g: float = g) -> Array:
            s = x - 2 * g * a
            left, right = np.maximum(a + s, 0), np.maximum(a - s, 0)
            return contact_modulus() * np.cos(np.pi * g) / (2 * RADIUS) * left ** (0.5 + g) * right ** (0.5 - g)

        p = system.contact((d,)).solve(parabola(x)).pressure[0]
        name = "rightward" if d > 0 else "leftward"
        inside = np.abs(x - 2 * g * a) < 0.9 * a
        exact = pressure(x)
        rows.append(
            profile(f"{name}: pressure for |x - e| < 0.9 a (MPa)", exact[inside], p[inside], 5e-3, scale=exact.max())
        )
        force = system.pair.weights * p
        rows.append(number(f"{name}: centre of pressure, 8 g a / 3 (mm)", 8 * g * a / 3, force @ x / force.sum(), 5e-3))
        dense = np.linspace(-1.3, 1.3, 400) * a
        shown = np.abs(x) < 1.3 * a
        lines += [
            Line(f"exact, {name}", dense, pressure(dense), reference=True),
            Line(f"fenwear, {name}", x[shown], p[shown]),
        ]
    return Result(rows, [Plot("Sliding cylinder: pressure", "x (mm)", "pressure (MPa)", lines)])


def standing(system: Tribosystem, direction: int = 1) -> tuple[Array, Array]:
    """Return x and the pressure under the flat punch away from its edges, |x| < 0.8 a."""
    x, p = system.pair.x, system.contact((direction,)).solve(system.pair.initial_gap).pressure[0]
    inside = np.abs(x) < 0.8 * HALF_WIDTH
    return x[inside], p[inside]


@verification(
    "flat-punch",
    "A flat rigid punch on a half-plane, without friction",
    "K. L. Johnson, Contact Mechanics, 1985, section 2.8(a)",
    slow=True,
)
def flat_punch() -> Result:
    """Pressure P / (pi sqrt(a² - x²)); the strip's depth H enters as (a/H)²."""
    rows: list[Row] = []
    lines: list[Line] = []
    for plane in ("stress", "strain"):
        x, p = standing(rigid_punch(1e4, *FINE, f"model.plane='{plane}'"))
        exact = LOAD / (np.pi * np.sqrt(HALF_WIDTH**2 - x**2))
        rows.append(profile(f"plane {plane}: pressure for |x| < 0.8 a (MPa)", exact, p, 5e-4, scale=exact))
        lines.append(Line(f"fenwear, plane {plane}", x, p))
        if plane == "stress":
            lines.append(Line("exact", x, exact, reference=True))
    depths = np.array([150.0, 300.0, 600.0])
    centres = []
    for depth in depths:
        x, p = standing(rigid_punch(depth, *FINE))
        centres.append(p[np.argmin(np.abs(x))])
    exact_centre = LOAD / (np.pi * HALF_WIDTH)
    deviations = np.abs(np.array(centres) / exact_centre - 1)
    rows.append(order("depth H of the strip: order in a/H at the centre", 2, deviations, 0.15))
    plots = [
        Plot("Flat punch: pressure", "x (mm)", "pressure (MPa)", lines),
        Plot(
            "Flat punch: pressure at the centre on a strip of depth H",
            "a/H",
            "relative difference to the half-plane",
            [Line("fenwear", HALF_WIDTH / depths, deviations)],
            ("log", "log"),
            (2.0,),
        ),
    ]
    return Result(rows, plots)


@verification(
    "sliding-punch",
    "A flat rigid punch that slides on a half-plane, with friction",
    "K. L. Johnson, Contact Mechanics, 1985, section 2.8(b)",
    slow=True,
)
def sliding_punch() -> Result:
    """Pressure P cos(pi g) / (pi sqrt(a² - x²)) ((a - x)/(a + x))^g with tan(pi g) = d mu beta.

    Dundurs' beta under a rigid punch is -(1 - 2 nu)/(2 (1 - nu)) in plane strain; in plane stress nu/(1 + nu)
    stands for nu. The exponent is measured: the slope of ln(p sqrt(a² - x²)) over ln((a - x)/(a + x)).
    """
    friction = 0.6
    rows: list[Row] = []
    lines: list[Line] = []
    for plane, nu in (("strain", 0.0), ("strain", 0.3), ("stress", 0.3)):
        settings = (f"model.plane='{plane}'", f"contact.friction={friction}", f"materials.steel.poisson={nu}")
        system = rigid_punch(1e5, *FINE, *settings)  # friction tilts the surface by a / H
        effective = nu if plane == "strain" else nu / (1 + nu)
        for d in (1, -1):
            x, p = standing(system, d)
            g = -d * np.arctan(friction * (1 - 2 * effective) / (2 * (1 - effective))) / np.pi
            root, ratio = np.sqrt(HALF_WIDTH**2 - x**2), (HALF_WIDTH - x) / (HALF_WIDTH + x)
            exact = LOAD * np.cos(np.pi * g) / (np.pi * root) * ratio**g
            measured = np.polyfit(np.log(ratio), np.log(p * root), 1)[0]
            case = f"plane {plane}, nu = {nu:g}, {'rightward' if d > 0 else 'leftward'}"
            rows.append(number(f"{case}: exponent g", g, measured, 2e-3))
            rows.append(profile(f"{case}: pressure for |x| < 0.8 a (MPa)", exact, p, 1e-3, scale=exact))
            if (plane, nu) == ("strain", 0.0):
                name = "rightward" if d > 0 else "leftward"
                lines += [Line(f"exact, {name}", x, exact, reference=True), Line(f"fenwear, {name}", x, p)]
    return Result(rows, [Plot("Sliding flat punch, nu = 0: pressure", "x (mm)", "pressure (MPa)", lines)])


@verification(
    "equilibrium-of-contact",
    "Force and moment balance of contact with friction",
    "statics by hand: friction mu p at the arm l_z of the pin",
)
def equilibrium_of_contact() -> Result:
    """Examples 1 and 2 with mu = 0.4 and the pin 40 mm high, where Example 1's rear edge lifts off."""
    rows: list[Row] = []
    for name in ("example1", "example2"):
        system = builtin(name, "contact.friction=0.4", "geometry.parameters.pin_height_1=40")
        x, weights = system.pair.x, system.pair.weights
        for d in (1, -1):
            p = system.contact((d,)).solve(system.pair.initial_gap).pressure[0]
            case = f"{name}, {'rightward' if d > 0 else 'leftward'}"
            rows.append(number(f"{case}: force on the contact (N/mm)", LOAD, weights @ p, 1e-11))
            if name == "example1":
                # About the pin at (30, 40) above the contact: friction d mu P pulls the centre of pressure by d mu l_z.
                rows.append(
                    number(
                        f"{case}: moment of the pressure about x = 0 (N)",
                        -d * 0.4 * 40 * LOAD,
                        weights @ (p * x),
                        1e-10,
                    )
                )
    return Result(rows)
