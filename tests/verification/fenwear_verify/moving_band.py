"""A band source of heat that moves over a half-plane: Jaeger's problem, with the steps and the mesh of a run."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from scipy.integrate import quad
from scipy.special import erf, k0e

from fenwear import load_case
from fenwear.common.arrays import Array
from fenwear.heat.conduction import Surroundings
from fenwear.heat.prepare import prepare_exchange
from fenwear.system import ContactSetup, place_case
from fenwear_verify.suite import Line, Plot, Result, Row, number, order, profile, verification

HALF, CONDUCTIVITY, CAPACITY = 30.0, 55.0, 7.8e-9 * 4.6e8  # of the source, mm; of the strip
DIFFUSIVITY = CONDUCTIVITY / CAPACITY
PUBLISHED = {0.5: (1.304172, 1.121667), 2.0: (0.736803, 0.557499), 10.0: (0.348500, 0.241324)}
"""k theta / (q l) at L = v l / (2 a), the largest and the mean."""


def jaeger(x: float, half_width: float, speed: float, diffusivity: float) -> float:
    """Return the surface rise k theta / q of a band source on a half-plane that moves to +x, by quadrature.

    (1/pi) times the integral over the source of e^u K0(|u|), u = v (x - x') / (2 a).
    """
    scale = speed / (2 * diffusivity)

    def kernel(u: float) -> float:
        return float(k0e(abs(u)) * (1.0 if u > 0 else math.exp(2 * u)))

    low, high = scale * (x - half_width), scale * (x + half_width)
    ends = [low, *(p for p in (-1.0, 0.0, 1.0) if low < p < high), high]
    return float(sum(quad(kernel, a, b, limit=200)[0] for a, b in pairwise(ends)) / (math.pi * scale))


def after(x: float, half_width: float, speed: float, diffusivity: float, time: float) -> float:
    """Return the same for a source that has acted for a time, from a half-plane without any heat.

    The integral over that time of sqrt(a / pi s) (erf((x + l - v s) / sqrt(4 a s)) - erf((x - l - v s) / ...)) / 2,
    with r = sqrt(s) for s.
    """

    def kernel(r: float) -> float:
        wide = math.sqrt(4 * diffusivity) * r
        moved = x - speed * r**2
        return float(erf((moved + half_width) / wide) - erf((moved - half_width) / wide))

    end = math.sqrt(time)
    kinks = [math.sqrt(at / speed) for at in (x + half_width, x - half_width) if 0 < at < speed * time]
    whole = sum(quad(kernel, a, b, limit=400)[0] for a, b in pairwise([0.0, *sorted(kinks), end]))
    return float(math.sqrt(diffusivity / math.pi) * whole)


DEEP = ("geometry.parameters.strip_height=2000", "geometry.parameters.strip_length=20000")


def band(peclet: float, direction: int = 1, *settings: str) -> ContactSetup:
    """Return the punch of Example 1 with its strip, which slides one way; collective.

    A half-cycle takes material past half the source.

    Args:
        peclet: L = v l / (2 a).
        direction: 1 where the strip moves to +x, -1 to -x.
        settings: Further overrides of the case; by default it has the mesh that a run would have.
    """
    speed = 2 * DIFFUSIVITY * peclet / HALF
    return place_case(
        load_case(
            "example1-heat",
            [
                "unset=motion.amplitude",
                "unset=motion.angular_frequency",
                "motion.kind=one-way",
                f"motion.direction={'rightward' if direction > 0 else 'leftward'}",
                f"motion.speed={speed}",
                f"motion.duration={HALF / speed}",
                "heat.partition=0",
                "heat.debris=0",
                "heat.conductance=0",
                "heat.convection=0",
                *settings,
            ],
        )
    )


def steady_rise(placed: ContactSetup) -> tuple[Array, Array]:
    """Return k theta / q of the steady state at the contact nodes, found and exact (n,), mm; collective."""
    body, pair, phase = placed.bodies.heat[1], placed.pair, placed.motion.phases[0]
    step = body.step(phase.direction * phase.speed, math.inf, Surroundings(sliding=placed.sliding.field))
    theta = step.respond(body.place(pair.transfer.T @ pair.weights)[:, None])
    found = CONDUCTIVITY * (pair.transfer @ body.trace.pick(theta)[:, 0, 0])
    return found, np.array([jaeger(phase.direction * x, HALF, phase.speed, DIFFUSIVITY) for x in pair.x])


def rise_after(placed: ContactSetup, *, reduced: bool = False) -> tuple[Array, Array]:
    """Return k theta / q at the end of the first half-cycle by the steps of a run, found and exact (n,); collective."""
    bodies, pair, motion, heat = placed.bodies.heat, placed.pair, placed.motion, placed.case.heat
    assert bodies is not None
    assert heat is not None
    phase = motion.phases[0]
    none = tuple(np.zeros((len(pair.weights), body.owned)) for body in bodies)
    even = np.full(len(pair.weights), 1 / phase.speed)
    field = placed.sliding.field
    exchange = prepare_exchange(heat, bodies, pair, (none[0], none[1]), field, motion, even, 1.0, reduced=reduced)
    pressure = np.ones(len(pair.weights))
    state, _ = exchange.half_cycle(exchange.initial(), 0, pressure, exchange.conductance(pressure))
    found = CONDUCTIVITY * exchange.contact_temperatures(state)[1]
    x = phase.direction * pair.x
    return found, np.array([after(at, HALF, phase.speed, DIFFUSIVITY, phase.duration) for at in x])


@verification(
    "jaeger",
    "Jaeger: a moving band source of heat",
    "J. C. Jaeger, Moving sources of heat and the temperature at sliding contacts, 1942; "
    "Carslaw and Jaeger, 1959, section 10.7",
)
def moving_source() -> Result:
    """Contact temperatures at L = v l / 2 a from 0.1 to 1,000: steady, and while the source starts.

    On the mesh and by the steps that a run has when nothing is set, at all contact nodes but the outermost. The flux
    jumps at the source's edge, where the temperature is like r log r.
    """
    rows: list[Row] = []
    lines: list[Line] = []
    for peclet in (0.1, 0.5, 2.0, 10.0, 50.0, 1000.0):
        placed = band(peclet, 1, *DEEP)
        found, exact = steady_rise(placed)
        weights, inner = placed.pair.weights, _inner(placed)
        name = f"L = {peclet:g}"
        rows.append(profile(f"{name}: rise k theta / q (mm)", exact[inner], found[inner], 5e-3, scale=exact.max()))
        rows.append(number(f"{name}: mean of it (mm)", weights @ exact, weights @ found, 1e-3))
        for what, value, ours in zip(
            ("largest", "mean"), PUBLISHED.get(peclet, ()), (found.max(), weights @ found / weights.sum()), strict=False
        ):
            rows.append(number(f"{name}: {what} k theta / (q l)", value, ours / HALF, 2e-3))
        lines += [
            Line(f"fenwear, {name}", placed.pair.x, found / exact.max()),
            Line(f"Jaeger, {name}", placed.pair.x, exact / exact.max(), reference=True),
        ]
    placed = band(10.0, -1, *DEEP)
    found, exact = steady_rise(placed)
    inner = _inner(placed)
    rows.append(profile("L = 10, leftward: rise (mm)", exact[inner], found[inner], 5e-3, scale=exact.max()))
    rows += [_by_mesh(), *_by_steps()]
    return Result(rows, [Plot("Moving band source: rise over its largest", "x (mm)", "rise", lines)])


def _inner(placed: ContactSetup) -> Array:
    """Return which contact nodes are not the outermost (n,)."""
    return np.asarray(np.abs(placed.pair.x) < HALF * (1 - 1e-9))


def _by_mesh() -> Row:
    """The largest error is next to the edge, where r log r is not smooth: it falls as the elements do."""
    errors = []
    for count in (16, 32):
        even = (f"geometry.parameters.elements_along_contact={count}", "geometry.parameters.edge_grading=1")
        placed = band(10.0, 1, *DEEP, *even, "geometry.degree=2")
        found, exact = steady_rise(placed)
        errors.append(float(np.abs(found - exact)[_inner(placed)].max() / exact.max()))
    return order("L = 10, degree 2, even elements: order of the largest error", 1, errors, 0.2)


def _by_steps() -> list[Row]:
    """The first half-cycle, from a strip without heat, is the hardest: by the steps of a run, and by 5, 10 and 20."""
    rows = []
    for peclet, tolerance in ((10.0, 5e-3), (50.0, 5e-3), (1000.0, 1e-2)):
        placed = band(peclet)
        found, exact = rise_after(placed)
        inner = _inner(placed)
        what = f"L = {peclet:g}: rise once half the source has passed (mm)"
        rows.append(profile(what, exact[inner], found[inner], tolerance, scale=exact.max()))
    for peclet in (10.0, 50.0):
        inner = _inner(band(peclet))
        by_steps = [rise_after(band(peclet, 1, f"heat.steps={steps}"))[0][inner] for steps in (5, 10, 20)]
        changes = [float(np.abs(b - a).max()) for a, b in pairwise(by_steps)]
        rows.append(order(f"L = {peclet:g}: order in the steps", 2, changes, 0.2))
    return rows
