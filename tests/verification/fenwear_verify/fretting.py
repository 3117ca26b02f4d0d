"""Fretting: where partial slip wears to, what a long stroke loses elastically, spheres, growth under rising load."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import scipy.integrate

from fenwear.case import load_case, make_case
from fenwear.common.arrays import Array
from fenwear.steps import jump, march
from fenwear.steps.stick_final import final_shape, stick_zone
from fenwear.steps.stick_increment import advance
from fenwear.steps.stick_interface import StickInterface, untouched
from fenwear.steps.stick_setup import partial_slip_problem
from fenwear.steps.stick_state import Imposed, StickState
from fenwear.system import assemble, build_bodies, make_sliding
from fenwear_verify.stick import pressed_half_planes
from fenwear_verify.suite import Line, Plot, Result, Row, number, order, profile, verification

RADIUS, LOAD = 6.0, 120.0  # of the cylinder of the built-in case, mm; N/mm
MODULUS = 2e5 / (2 * (1 - 0.3**2))  # E*, MPa


def worn_end(x: Array, a: float, c: float) -> Array:
    """Return the depth of the scar beside a stick zone of half-width c under a cylinder, mm.

    The zone alone carries the load: p = [P + (pi E* / 2R)(c²/2 - x²)] / (pi sqrt(c² - x²)). Beside it the gap rises
    by dh/dx = [x² - (a² + c²)/2] / (R sqrt(x² - c²)), a the half-width before any wear: where h < 0 it is worn.
    """

    def gap(at: float) -> float:
        """Integrate over u = sqrt(x² - c²)."""
        end = np.sqrt(max(at**2 - c**2, 0.0))
        return float(scipy.integrate.quad(lambda u: (u**2 + (c**2 - a**2) / 2) / (RADIUS * np.hypot(u, c)), 0, end)[0])

    return np.array([max(-gap(abs(place)), 0.0) for place in x])


@verification(
    "partial-slip-end",
    "Where partial slip wears to: the stick zone alone carries the load",
    "M. Ciavarella and D. A. Hills, J. Strain Anal. 34, 1999; closed form of the cylinder",
)
def partial_slip_end() -> Result:
    """The direct solution against the closed form of half-planes, and the end of a run by jumps against it."""
    a = 2 * np.sqrt(LOAD * RADIUS / (np.pi * MODULUS))
    rows: list[Row] = []
    lines: list[Line] = []
    errors = []
    for elements in (30, 60, 120):
        settings = [
            f"geometry.parameters.elements_along_contact={elements}",
            "geometry.parameters.strip_length='24 mm'",
            "geometry.parameters.strip_height='12 mm'",
            "motion.amplitude='0.001 um'",  # tractions small enough not to move the gap of bodies of some millimetres
        ]
        problem = partial_slip_problem(load_case("fretting-partial-slip", settings))
        x, weights = problem.interface.middle.pair.x, problem.weights
        zone = np.abs(x) < 0.0501
        found = final_shape(problem, zone)
        exact = worn_end(x, a, float(weights @ zone) / 2)
        errors.append(abs(float(weights @ found.depth / (weights @ exact) - 1)))
    rows += [
        number("largest depth of the scar (mm)", exact.max(), found.depth.max(), 0.02),
        number("worn cross-section (mm²)", weights @ exact, weights @ found.depth, 0.02),
        profile("depth of the scar over its largest", exact, found.depth, 0.06, scale=float(exact.max())),
        number("pressure outside of the stick zone (MPa)", 0.0, found.pressure[~zone].max(), 0.0, scale=1.0),
        order("order of the worn cross-section", 1, errors, 0.35),
    ]
    lines += [Line("closed form", x, exact, reference=True), Line("fenwear, directly", x, found.depth)]
    system = assemble(load_case("fretting-partial-slip", ["geometry.parameters.elements_along_contact=40", *FAST]))
    end = final_shape(system.law_state.problem, stick_zone(system.law_state.problem))
    *_, last = jump(system, 4_000_000, tolerance=0.02)  # at 0.1 the stick zone's edge is one node off
    depth = system.pair.opening(last.wear[-1], last.wear_strip[-1])
    rows.append(profile("depth after 2,000,000 cycles by jumps", end.depth, depth, 2e-3, scale=float(end.depth.max())))
    return Result(rows, [Plot("End of partial-slip wear: depth of the scar", "x (mm)", "depth (mm)", lines)])


FAST = (
    "stick.steps=10",
    "stick.step_tolerance=1",
    "wear.punch.coefficient='2e-7 1/MPa'",
    "wear.strip.coefficient='2e-7 1/MPa'",
)


@verification(
    "fretting-stroke",
    "Fretting of 25 um with mu = 0.9: what of the stroke the bodies take up elastically",
    "published level-set run of the same test: 97 % of the wear of rigid bodies",
)
def fretting_stroke() -> Result:
    """Worn area of a cycle over k P s of the imposed stroke, both bodies elastic."""
    settings = ["contact.law='coulomb'", "stick.step_tolerance=1", "geometry.parameters.elements_along_contact=40"]
    system = assemble(load_case("fretting", settings))
    *_, last = march(system, 4)  # a cycle after one that leads to it
    stroke = 4 * 0.025
    punch = system.pair.weights @ (last.wear[-1] - last.wear[-3]) / (1.9e-8 * 18.5 * stroke)
    strip = system.pair.strip.weights @ (last.wear_strip[-1] - last.wear_strip[-3]) / (2.9e-8 * 18.5 * stroke)
    return Result(
        [
            number("worn area of the cylinder over k P s", 0.97, punch, 0.01),
            number("worn area of the flat over k P s", 0.97, strip, 0.01),
        ]
    )


@cache
def sphere(poisson: float, *, rigid: bool, friction: float) -> StickInterface:
    """Return a sphere of 10 mm on a block of the same material, or on a rigid one; collective."""
    young = 210_000.0
    held: dict[str, Any] = {"kind": "one-way", "direction": "rightward", "speed": 1.0, "duration": 1.0}
    case = make_case(
        {
            "geometry": {
                "file": "ball_on_flat.geo",
                "degree": 2,
                "order": 2,
                "parameters": {"radius": 10, "contact_width": 0.46, "stroke": 0.005, "across": 8},
            },
            "model": {"kind": "solid"},
            "materials": {
                "ball": {"young": young, "poisson": poisson},
                "flat": {"young": (1e5 if rigid else 1.0) * young, "poisson": poisson},
            },
            "punch": {
                "regions": {"punch_body": "ball"},
                "supports": [{"on": "punch_sides", "fix": ["x", "y"]}],
                "loads": [{"on": "punch_top", "force": [0, 0, -100]}],
            },
            "strip": {
                "regions": {"strip_body": "flat"},
                "supports": [{"on": "strip_bottom", "fix": ["x", "y", "z"]}],
            },
            "contact": {"friction": friction},
            "wear": {"punch": {"coefficient": 0}},
            "motion": {**held, "along": [1, 0, 0]},
            "run": {"half_cycles": 1},
        }
    )
    return StickInterface(build_bodies(case), make_sliding(case), case)


@verification(
    "sphere-partial-slip",
    "Partial slip of a sphere on a half-space: stick zone, tractions, energy of the loop",
    "R. D. Mindlin and H. Deresiewicz, J. Appl. Mech. 20, 1953",
    slow=True,
)
def sphere_partial_slip() -> Result:
    """Stick radius c = a (1 - Q/(mu P))^(1/3), exact for nu = 0; loop energy of a force that goes to and fro.

    9 mu² P² S / (10 a) [1 - (1 - q)^(5/3) - (5 q/6)(1 + (1 - q)^(2/3))], S = 2 (2 - nu)/G of both, q = Q/(mu P).
    """
    load, mu, young = 100.0, 0.5, 210_000.0
    interface = sphere(0.0, rigid=False, friction=mu)
    pair = interface.middle.pair
    weights, friction = pair.weights, np.full(len(pair.weights), mu)
    a = (3 * load * 10 / (4 * young / 2)) ** (1 / 3)
    peak = 1.5 * load / (np.pi * a**2)
    r = np.hypot(pair.punch.x[:, 0], pair.punch.x[:, 1])
    loaded = interface.loaded(None)
    start = Imposed(loaded.times(0), pair.initial_gap)
    end = replace(start, loaded=loaded)
    state = advance(interface, untouched(interface), start, end, friction)
    start = replace(end, displacement=None, force=0.0)
    rows = [number("largest pressure, Hertz (MPa)", peak, state.pressure.max(), 0.015)]
    spacing = float(np.sqrt(weights[state.closed].max())) / a
    most, work, area = 0.7, 0.0, 0.0
    path = [*np.linspace(0, most, 8)[1:], *np.linspace(most, -most, 15)[1:], *np.linspace(-most, most, 15)[1:]]
    for k, force in enumerate(path):
        before, start, end = state, replace(start), replace(start, force=force * mu * load)
        state = advance(interface, before, start, end, friction)
        start = end
        if k == 6:
            c = (1 - most) ** (1 / 3)
            exact = mu * peak * (cap(r, a) - c * cap(r, c * a))
            stuck = float(np.sqrt(weights @ state.sticking / np.pi)) / a
            rows.append(number(f"Q = {most:g} mu P: c / a, to a node", c, stuck, spacing, scale=1.0))
            q = state.traction[:, 0]
            rows.append(
                number(
                    "traction: L2 error over its norm",
                    0.0,
                    np.sqrt(weights @ (q - exact) ** 2 / (weights @ exact**2)),
                    0.08,
                    scale=1.0,
                )
            )
            across = np.abs(state.traction[:, 1]).max() / (mu * peak)
            rows.append(
                number("traction across the force over mu p0: left out by theory", 0.0, across, 0.04, scale=1.0)
            )
        if k > 6:
            work -= float(weights @ (state.traction * state.slip).sum(axis=1))
            area += (state.force + before.force) / 2 * (state.displacement - before.displacement)
    S = 2 * 2 / (young / 2)
    loop = 9 * (mu * load) ** 2 * S / (10 * a)
    loop *= 1 - (1 - most) ** (5 / 3) - 5 * most / 6 * (1 + (1 - most) ** (2 / 3))
    rows += [
        number("energy of the loop, its area (N mm)", loop, area, 0.06),
        number("energy of the loop, work of friction (N mm)", loop, work, 0.06),
    ]
    return Result(rows)


def cap(r: Array, radius: float) -> Array:
    """Return sqrt(1 - r²/R²), zero outside."""
    return np.asarray(np.sqrt(np.maximum(1 - (r / radius) ** 2, 0)))


@verification(
    "spence",
    "Unlike bodies under a load that rises: stick and slip grow alike",
    "D. A. Spence, J. Elasticity 5, 1975: one ratio of stick to contact at every load; its value by convergence",
)
def spence() -> Result:
    """Ratio c/a at four loads with many load steps, and what a single step makes of it."""
    interface = unlike_half_planes()
    x, weights = interface.middle.pair.x, interface.middle.pair.weights
    gap = np.asarray(x**2 / (2 * RADIUS), dtype=np.float64)
    friction = np.full(len(x), 0.25)
    loaded = interface.loaded(None)
    ratios: dict[int, list[float]] = {}
    shapes: dict[int, StickState] = {}
    for steps in (1, 20, 40, 80):
        state = untouched(interface)
        before, ratios[steps] = Imposed(loaded.times(0), gap), []
        for k in range(1, steps + 1):
            end = replace(before, loaded=loaded.times((k / steps) ** 2))  # contact grows evenly
            state, before = advance(interface, state, before, end, friction), end
            if k / steps in (0.55, 0.7, 0.85, 1.0) or steps == 1:
                ratios[steps].append(float(weights @ state.sticking / (weights @ state.closed)))
        shapes[steps] = state
    last = ratios[80]
    node = float(weights[shapes[80].closed].max() / (weights @ shapes[80].closed) * 2)
    tractions = {steps: state.traction[:, 0] for steps, state in shapes.items()}
    change = [float(np.sqrt(weights @ (tractions[s] - tractions[80]) ** 2)) for s in (1, 20, 40)]
    scale = float(np.sqrt(weights @ tractions[80] ** 2))
    mean = float(np.mean(last))
    rows = [number(f"c / a at the {k + 1}. of four loads, to a node", mean, r, 2 * node, scale=1.0)
            for k, r in enumerate(last)]  # fmt: skip
    rows += [
        number("traction with 20 load steps against 80, L2 over its norm", 0.0, change[1] / scale, 3e-3, scale=1.0),
        number("with 40 against 80", 0.0, change[2] / scale, 2e-3, scale=1.0),
        number(
            "a single load step forgets the history: farther off than 20 by", 1.0, float(change[0] > 3 * change[1]), 0.0
        ),
    ]
    shown = np.abs(x) < 0.12
    lines = [Line(f"{s} load steps", x[shown], tractions[s][shown]) for s in (1, 20, 80)]
    return Result(rows, [Plot("Unlike bodies, no tangential force: traction", "x (mm)", "traction (MPa)", lines)])


@cache
def unlike_half_planes() -> StickInterface:
    """Return two large blocks of unlike materials in plane strain; collective."""
    return pressed_half_planes({"young": 1e5, "poisson": 0.1}, {"young": 1e8, "poisson": 0.3}, 0.25, 0.28, 80)
