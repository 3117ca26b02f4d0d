"""Contact with stick: partial slip of half-planes, reversal of the force, bulk stress, any gap."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from fenwear.common.arrays import Array
from fenwear.steps.stick_increment import advance
from fenwear.steps.stick_interface import StickInterface, untouched
from fenwear.steps.stick_position import surface_gradient, surface_strain
from fenwear.steps.stick_state import Imposed, StickState
from fenwear.system import build_bodies, make_sliding
from fenwear_verify.bodies import STEEL, two_block_case
from fenwear_verify.suite import Line, Plot, Result, Row, number, profile, verification

RADIUS, LOAD, FRICTION = 6.0, 120.0, 0.6  # of the cylinder, mm; N/mm
MODULUS = STEEL["young"] / (2 * (1 - STEEL["poisson"] ** 2))  # E*, MPa
HALF_WIDTH = 2 * np.sqrt(LOAD * RADIUS / (np.pi * MODULUS))  # a, mm
PEAK = 2 * LOAD / (np.pi * HALF_WIDTH)  # p0, MPa
CORE, FAR = 0.24, 600.0  # width of the evenly divided part, and half that of the blocks, mm
SLOPE = 0.02  # of the wedge
FORCES = np.linspace(0.05, 0.5, 10)  # Q / (mu P) of the steps
COUNTS = (10, 20, 40, 80)  # elements on the core


@cache
def half_planes(elements: int = 80) -> StickInterface:
    """Return two blocks of steel in plane strain, so large that they are half-planes; collective."""
    return pressed_half_planes(STEEL, STEEL, FRICTION, CORE, elements)


def pressed_half_planes(
    upper: dict[str, float], lower: dict[str, float], friction: float, core: float, elements: int
) -> StickInterface:
    """Return two blocks under LOAD, so large that they are half-planes, with elements on a core; collective."""
    ratio = 1.6
    count = round(np.log(FAR / (core / elements) * (ratio - 1)) / np.log(ratio))
    sizes = {
        "width": 2 * FAR,
        "punch_height": FAR,
        "strip_height": FAR,
        "core": core,
        "across": elements,
        "outer": count,
        "spread": ratio,
        "growth": ratio,
        "punch_layers": count,
        "strip_layers": count,
    }
    case = two_block_case(
        upper,
        lower,
        sizes,
        contact={"friction": friction},
        punch={
            "supports": [{"on": "punch_sides", "fix": ["x"]}],
            "loads": [{"on": "punch_far", "force": [0, -LOAD]}],
        },
    )
    return StickInterface(build_bodies(case), make_sliding(case), case)


def pressed(interface: StickInterface, gap: Array) -> tuple[StickState, Imposed]:
    """Return the contact under the load alone, from a gap (n,), mm, and what is imposed then: no force."""
    loaded, mu = interface.loaded(None), np.full(len(gap), FRICTION)
    end = Imposed(loaded, gap)
    state = advance(interface, untouched(interface), replace(end, loaded=loaded.times(0)), end, mu)
    return state, replace(end, displacement=None, force=0.0)


def follow(
    interface: StickInterface, state: StickState, start: Imposed, forces: Iterable[float], strains: Iterable[float]
) -> tuple[StickState, Imposed]:
    """Return the contact after tangential forces, over mu P, and bulk strains, one after the other."""
    mu = np.full(len(start.opening), FRICTION)
    for force, strain in zip(forces, strains, strict=True):
        end = replace(start, force=force * FRICTION * LOAD, strain=strain)
        state, start = advance(interface, state, start, end, mu), end
    return state, start


def parabola(x: Array) -> Array:
    """Return the cylinder's gap, mm."""
    return np.asarray(x**2 / (2 * RADIUS), dtype=np.float64)


def ellipse(x: Array, half_width: float, middle: float = 0.0) -> Array:
    """Return sqrt(1 - (x - e)²/r²), zero outside."""
    return np.asarray(np.sqrt(np.maximum(1 - ((x - middle) / half_width) ** 2, 0)))


def traction_of(x: Array, force: float, middle: float = 0.0) -> Array:
    """Return Cattaneo's traction at a force Q / (mu P), MPa, its stick zone about `middle`."""
    c = HALF_WIDTH * np.sqrt(1 - force)
    corrected = ellipse(x, HALF_WIDTH) - c / HALF_WIDTH * ellipse(x, c, middle)
    return FRICTION * PEAK * corrected


def back_from(x: Array, most: float, force: float) -> Array:
    """Return Mindlin and Deresiewicz' traction after a force has fallen from its largest, both over mu P, MPa."""
    return traction_of(x, most) - 2 * traction_of(x, (most - force) / 2)


def stretch(x: Array, half_width: float) -> Array:
    """Return what an elliptic traction of unit peak stretches the surface by by: y, less its root outside."""
    y = x / half_width
    return np.asarray(y - np.sign(y) * np.sqrt(np.maximum(y**2 - 1, 0)))


def stress_of(x: Array, force: float) -> Array:
    """Return sigma_xx in the strip's surface at a force Q / (mu P) on it, MPa: -p, and by traction."""
    c = HALF_WIDTH * np.sqrt(1 - force)
    pulled = stretch(x, HALF_WIDTH) - c / HALF_WIDTH * stretch(x, float(c))
    return 2 * FRICTION * PEAK * pulled - PEAK * ellipse(x, HALF_WIDTH)


def surface_stress(interface: StickInterface, state: StickState) -> Array:
    """Return sigma_xx in the strip's surface at the contact nodes, from its displacement and the pressure (n,), MPa."""
    nu, position = STEEL["poisson"], interface.middle
    strain = surface_strain(position, surface_gradient(position.pair.punch), state.on_strip)[:, 0]
    return STEEL["young"] / (1 - nu**2) * strain - nu / (1 - nu) * state.pressure


def slope_of(what: str, errors: Sequence[float]) -> Row:
    """Compare the order of errors over the meshes, fitted to all: each depends on where a node lies near an edge."""
    slope = -float(np.polyfit(np.log(COUNTS), np.log(errors), 1)[0])
    return number(what, 1.0, slope, 0.25)


def away(x: Array, edges: Iterable[float]) -> Array:
    """Return where no edge of contact or stick, at which slopes are infinite, is nearer than 0.06 a (n,) bool."""
    return np.all([np.abs(np.abs(x) - abs(edge)) > 0.06 * HALF_WIDTH for edge in edges], axis=0)


@verification(
    "cattaneo-mindlin",
    "Partial slip of a cylinder on a half-plane: tangential force raised, and taken back to zero",
    "C. Cattaneo, 1938; R. D. Mindlin, 1949; R. D. Mindlin and H. Deresiewicz, J. Appl. Mech. 20, 1953",
)
def cattaneo_mindlin() -> Result:
    """Stick for |x| < c = a sqrt(1 - Q/(mu P)), q = mu p0 [sqrt(1 - x²/a²) - (c/a) sqrt(1 - x²/c²)].

    On the way back slip of the other sign enters from the edges down to c'/a = sqrt(1 - (Q1 - Q)/(2 mu P)).
    """
    interface = half_planes()
    x, weights = interface.middle.pair.x, interface.middle.pair.weights
    state, start = pressed(interface, parabola(x))
    spacing = 2 * float(weights[np.abs(x) < HALF_WIDTH].max()) / HALF_WIDTH
    rows: list[Row] = []
    lines: list[Line] = []
    dense = np.linspace(-1.1, 1.1, 500) * HALF_WIDTH
    most = float(FORCES[-1])
    state, start = follow(interface, state, start, FORCES, 0 * FORCES)
    up = np.sqrt(1 - most)
    cases: list[tuple[str, StickState, Array, Array, tuple[float, ...], float]] = [
        ("Q = mu P / 2", state, traction_of(x, most), traction_of(dense, most), (1.0, up), float(up))
    ]
    state, start = follow(interface, state, start, most - FORCES, 0 * FORCES)
    down = np.sqrt(1 - most / 2)
    cases.append(
        ("back to Q = 0", state, back_from(x, most, 0.0), back_from(dense, most, 0.0), (1.0, up, down), float(down))
    )
    for name, found, exact, drawn, edges, stick in cases:
        q, free = found.traction[:, 0], away(x, np.array(edges) * HALF_WIDTH)
        half = weights[found.sticking].sum() / 2 / HALF_WIDTH
        rows += [
            number(f"{name}: half-width of the stick zone over a, to a node", stick, half, spacing, scale=1.0),
            profile(f"{name}: traction over mu p0", exact[free], q[free], 0.01, scale=FRICTION * PEAK),
            number(f"{name}: force over mu P", 0.0, (weights @ (q - exact)) / (FRICTION * LOAD), 2e-3, scale=1.0),
        ]
        shown = np.abs(x) < 1.1 * HALF_WIDTH
        lines += [Line(f"exact, {name}", dense, drawn, reference=True), Line(f"fenwear, {name}", x[shown], q[shown])]
    errors = [cattaneo_error(count) for count in COUNTS]
    rows.append(slope_of("order of the L2 error over four meshes, forces from 0.2 to 0.8 mu P", errors))
    stress_rows, stress_plot = _stress()
    rows += stress_rows
    plots = [
        stress_plot,
        Plot("Partial slip: traction", "x (mm)", "traction (MPa)", lines),
        Plot(
            "Partial slip: error of the traction, whose slope is infinite at the edges",
            "element size h (mm)",
            "L2 error over that of the traction",
            [Line("mean over forces", CORE / np.array(COUNTS), np.array(errors))],
            ("log", "log"),
            (1.0,),
        ),
    ]
    return Result(rows, plots)


def _stress() -> tuple[list[Row], Plot]:
    """Return the stress in the strip's surface at mu P / 2 node by node, and the order of its error.

    Its slope is infinite at the edges of contact and stick zone; the strain there must not swing beside them.
    """
    interface = half_planes()
    x = interface.middle.pair.x
    state, start = pressed(interface, parabola(x))
    state, _ = follow(interface, state, start, FORCES, 0 * FORCES)
    most = float(FORCES[-1])
    exact, found, scale = stress_of(x, most), surface_stress(interface, state), FRICTION * PEAK
    core, edges = np.abs(x) < CORE / 2, np.array([1, np.sqrt(1 - most)]) * HALF_WIDTH
    free = np.logical_and(core, away(x, edges))
    stuck = np.asarray(np.abs(x) < (np.sqrt(1 - most) - 0.03) * HALF_WIDTH)  # to a node of the edge
    errors = [cattaneo_error(count, stress=True) for count in COUNTS]
    rows = [
        profile("stress in the strip's surface over mu p0", exact[free], found[free], 0.01, scale=scale),
        profile("the same where it sticks, up to the edge", exact[stuck], found[stuck], 0.01, scale=scale),
        number("its largest error over mu p0, at an edge", 0.0, np.abs(found - exact)[core].max(), 0.15, scale=scale),
        slope_of("order of its L2 error over four meshes, forces from 0.2 to 0.8 mu P", errors),
    ]
    shown = np.abs(x) < 1.25 * HALF_WIDTH
    lines = [Line("exact", x[shown], exact[shown], reference=True), Line("fenwear", x[shown], found[shown])]
    return rows, Plot("Partial slip: stress in the strip's surface", "x (mm)", "stress along x (MPa)", lines)


def cattaneo_error(elements: int, *, stress: bool = False) -> float:
    """Return the L2 error of the traction, or of the strip's surface stress, over its norm, the mean over forces."""
    interface = half_planes(elements)
    x, weights = interface.middle.pair.x, interface.middle.pair.weights
    state, start = pressed(interface, parabola(x))
    core, errors = np.abs(x) < CORE / 2, []
    for force in np.linspace(0.2, 0.8, 13):
        state, start = follow(interface, state, start, [force], [0.0])
        exact = stress_of(x, force) if stress else traction_of(x, force)
        found = surface_stress(interface, state) if stress else state.traction[:, 0]
        w = weights[core]
        errors.append(np.sqrt(w @ (found - exact)[core] ** 2 / (w @ exact[core] ** 2)))
    return float(np.mean(errors))


@verification(
    "bulk-stress",
    "Partial slip with bulk stress in the strip, as in fretting fatigue: the stick zone moves",
    "D. A. Hills and D. Nowell, Mechanics of Fretting Fatigue, 1994",
)
def bulk_stress() -> Result:
    """Stick zone of the same width, shifted by e = a sigma / (4 mu p0); force and stress rise together.

    A strain eps of the strip's surface, sigma = 2 E* eps for like bodies in plane strain, needs tractions whose
    displacement has this slope all over the stick zone: those of Cattaneo with the stick zone about -e.
    """
    interface = half_planes()
    x, weights = interface.middle.pair.x, interface.middle.pair.weights
    state, start = pressed(interface, parabola(x))
    rows: list[Row] = []
    lines: list[Line] = []
    shares = np.linspace(0.05, 1, 20)
    for sign in (1, -1):
        middle = -sign * 0.1 * HALF_WIDTH
        strain = sign * 0.1 * 2 * FRICTION * PEAK / MODULUS
        found, _ = follow(interface, state, start, 0.5 * shares, strain * shares)
        exact, q = traction_of(x, 0.5, middle), found.traction[:, 0]
        c = np.sqrt(0.5) * HALF_WIDTH
        edges = np.array([-HALF_WIDTH, HALF_WIDTH, middle - c, middle + c])
        free = np.all([np.abs(x - edge) > 0.06 * HALF_WIDTH for edge in edges], axis=0)
        stuck = x[found.sticking]
        spacing = 2 * float(weights[found.sticking].max()) / HALF_WIDTH
        name = "tension" if sign > 0 else "compression"
        rows += [
            number(
                f"{name}: middle of the stick zone over a, to a node",
                middle / HALF_WIDTH,
                (stuck.max() + stuck.min()) / 2 / HALF_WIDTH,
                spacing,
                scale=1.0,
            ),
            profile(f"{name}: traction over mu p0", exact[free], q[free], 0.01, scale=FRICTION * PEAK),
        ]
        shown = np.abs(x) < 1.1 * HALF_WIDTH
        lines += [
            Line(f"exact, {name}", x[shown], exact[shown], reference=True),
            Line(f"fenwear, {name}", x[shown], q[shown]),
        ]
    for name, error in (("bulk stress", bulk_error), ("force taken back to zero", reversal_error)):
        errors = [error(count) for count in COUNTS]
        rows.append(slope_of(f"{name}: order of the L2 error over four meshes, mean of forces", errors))
    return Result(rows, [Plot("Bulk stress: traction", "x (mm)", "traction (MPa)", lines)])


def bulk_error(elements: int) -> float:
    """Return the L2 error of the traction with bulk stress over its norm, the mean of shifts of the stick zone."""
    interface, errors = half_planes(elements), []
    x, weights = interface.middle.pair.x, interface.middle.pair.weights
    shares = np.linspace(0.1, 1, 10)
    for shift in np.linspace(0.04, 0.12, 9):
        state, start = pressed(interface, parabola(x))
        found, _ = follow(interface, state, start, 0.5 * shares, shift * 2 * FRICTION * PEAK / MODULUS * shares)
        exact = traction_of(x, 0.5, -shift * HALF_WIDTH)
        errors.append(np.sqrt(weights @ (found.traction[:, 0] - exact) ** 2 / (weights @ exact**2)))
    return float(np.mean(errors))


def reversal_error(elements: int) -> float:
    """Return the L2 error of the traction after a force went back to zero over its norm, the mean of forces."""
    interface, errors = half_planes(elements), []
    x, weights = interface.middle.pair.x, interface.middle.pair.weights
    for most in np.linspace(0.2, 0.8, 9):
        state, start = pressed(interface, parabola(x))
        ways = np.concatenate([np.linspace(0, most, 6)[1:], np.linspace(most, 0, 6)[1:]])
        found, _ = follow(interface, state, start, ways, 0 * ways)
        exact = back_from(x, float(most), 0.0)
        errors.append(np.sqrt(weights @ (found.traction[:, 0] - exact) ** 2 / (weights @ exact**2)))
    return float(np.mean(errors))


@verification(
    "ciavarella-jaeger",
    "Partial slip from two normal contacts, for gaps of any form",
    "M. Ciavarella, J. Appl. Mech. 65, 1998; J. Jaeger, Arch. Appl. Mech. 68, 1998",
)
def ciavarella_jaeger() -> Result:
    """Traction q = mu (p(P) - p(P - Q/mu)) for like half-planes; the pressures come from contact without friction."""
    interface = half_planes()
    x = interface.middle.pair.x
    reach = HALF_WIDTH
    gaps: dict[str, Array] = {
        "wavy cylinder": parabola(x) + 2e-5 * np.cos(2 * np.pi * x / (0.5 * reach)),
        "wedge": SLOPE * np.abs(x),
        "rounded on one side": np.where(x > 0, x**2 / 4, x**2 / 12),
    }
    rows: list[Row] = []
    lines: list[Line] = []
    frictionless = np.zeros(len(x))
    for name, gap in gaps.items():
        state, start = pressed(interface, gap)
        state, _ = follow(interface, state, start, FORCES, 0 * FORCES)
        loaded = interface.loaded(None)
        none = Imposed(loaded.times(0), gap)
        full, part = (
            advance(interface, untouched(interface), none, replace(none, loaded=loaded.times(share)), frictionless)
            for share in (1.0, 1 - float(FORCES[-1]))
        )
        exact = FRICTION * (full.pressure - part.pressure)
        q = state.traction[:, 0]
        weights = interface.middle.pair.weights
        error = float(np.sqrt(weights @ (q - exact) ** 2 / (weights @ exact**2)))
        rows.append(number(f"{name}: L2 error of the traction over its norm", 0.0, error, 5e-3, scale=1.0))
        shown = np.abs(x) < 1.3 * reach
        lines += [
            Line(f"superposition, {name}", x[shown], exact[shown], reference=True),
            Line(f"fenwear, {name}", x[shown], q[shown]),
        ]
    wedges = [wedge_error(count) for count in COUNTS]
    rows.append(slope_of("wedge: order of the L2 error over four meshes, mean of forces", wedges))
    return Result(rows, [Plot("Partial slip for other gaps: traction", "x (mm)", "traction (MPa)", lines)])


def wedge_error(elements: int) -> float:
    """Return the L2 error of the traction of a wedge over its norm, the mean over forces.

    From the exact pressure p = E* s / pi arcosh(a / |x|), a = P / (E* s), of a wedge of slope s on a half-plane.
    """
    interface, errors = half_planes(elements), []
    x, weights = interface.middle.pair.x, interface.middle.pair.weights
    state, start = pressed(interface, SLOPE * np.abs(x))
    half = LOAD / (MODULUS * SLOPE)
    away_from_tip = np.where(x == 0, 1e-9 * half, np.abs(x))  # both pressures are infinite there, not the traction
    for force in np.linspace(0.2, 0.8, 13):
        state, start = follow(interface, state, start, [force], [0.0])
        full, part = (
            np.arccosh(np.maximum(width / away_from_tip, 1.0)) * MODULUS * SLOPE / np.pi
            for width in (half, half * (1 - force))
        )
        exact = FRICTION * (full - part)
        errors.append(np.sqrt(weights @ (state.traction[:, 0] - exact) ** 2 / (weights @ exact**2)))
    return float(np.mean(errors))
