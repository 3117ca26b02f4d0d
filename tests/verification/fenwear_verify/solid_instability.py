"""Thermo-elastic instability of sliding solids: waves along, across and oblique to the sliding."""

from __future__ import annotations

import math
from functools import cache, partial
from typing import Any

import numpy as np
from scipy.optimize import brentq

from fenwear.steps import critical_speed, growth_rate
from fenwear.system import Tribosystem
from fenwear_verify.solid import solve
from fenwear_verify.suite import Line, Plot, Result, Row, number, order, verification
from fenwear_verify.thermal import EXPANSION, POISSON, RHO_C, SMALL_FRICTION, YOUNG, K, rate_without_steps

HEIGHT = 12.0  # mm: deep for waves of up to 8 mm
DENSITY = 1e-9
CONDUCTOR = {
    "young": YOUNG,
    "poisson": POISSON,
    "conductivity": K,
    "heat_capacity": RHO_C / DENSITY,
    "density": DENSITY,
    "expansion": 1e3 * EXPANSION,  # so large that it grows at moderate Peclet numbers
}
OTHER = {  # another conductor, softer and slower
    "young": 6e4,
    "poisson": 0.35,
    "conductivity": 15.0,
    "heat_capacity": 2.0 / DENSITY,
    "density": DENSITY,
    "expansion": 1e-2,
}
INSULATOR = {
    "young": 1e14,
    "poisson": 0.0,
    "conductivity": 1e-9,
    "heat_capacity": 1.0,
    "density": DENSITY,
    "expansion": 0.0,
}


def diffusivity(material: dict[str, float]) -> float:
    """Return a = k / (rho c), mm²/s."""
    return material["conductivity"] / (material["heat_capacity"] * material["density"])


def gap_of_wave(speed: float, m: float, rate: float, second: dict[str, float] | None, conductance: float) -> float:
    """Return how far the gap of a wave of pressure opens, over its elastic part: zero where it grows at `rate`.

    In each half-space a temperature e^{st} e^{-l z} of wave number m, l² = m² + s / a, takes the flux k l theta
    and raises the surface by 2 alpha (1 + nu) theta / (l + m); a unit pressure lowers it by 2 (1 - nu²) / (E m).

    Args:
        speed: V, mm/s.
        m: Wave number in the contact, in any direction that the sliding does not move, 1/mm.
        rate: s, 1/s.
        second: Material of the other half-space; none for a rigid insulator.
        conductance: h_c between them, N/(mm s K); friction heat enters the first, and goes over by it.
    """
    elastic, flux, rise = [], [], []
    for material in (CONDUCTOR, *([second] if second else [])):
        length = math.sqrt(m**2 + rate / diffusivity(material))
        poisson = material["poisson"]
        elastic.append(2 * (1 - poisson**2) / (material["young"] * m))
        flux.append(material["conductivity"] * length)
        rise.append(2 * material["expansion"] * (1 + poisson) / (length + m))
    heat = SMALL_FRICTION * speed
    if second is None:
        thermal = rise[0] * heat / flux[0]
    else:  # q_1 + q_2 = Q, Q - q_1 = h_c (theta_1 - theta_2), theta_i = q_i / (k l)_i
        entering = heat * (1 + conductance / flux[1]) / (1 + conductance / flux[0] + conductance / flux[1])
        thermal = rise[0] * entering / flux[0] + rise[1] * (heat - entering) / flux[1]
    return 1 - thermal / sum(elastic)


def exact_speed(m: float, second: dict[str, float] | None = None, conductance: float = 0.0) -> float:
    """Return the speed at which a wave keeps its height, mm/s: on an insulator V = 2 (1 - nu) k m / (mu E alpha)."""
    return 1 / (1 - gap_of_wave(1.0, m, 0.0, second, conductance))


def exact_rate(speed: float, m: float, second: dict[str, float] | None = None, conductance: float = 0.0) -> float:
    """Return the growth rate of a wave of number m, 1/s."""
    slowest = min(diffusivity(material) for material in (CONDUCTOR, second or CONDUCTOR))
    return float(
        brentq(lambda s: gap_of_wave(speed, m, s, second, conductance), -0.999 * slowest * m**2, 1e4, rtol=1e-13)
    )


@cache
def sliding_blocks(
    width: float,
    depth: float,
    speed: float,
    duration: float,
    *,
    elements: tuple[int, int] = (4, 4),
    layers: int = 8,
    conductance: float | None = None,
) -> Tribosystem:
    """Return a conductor held at its insulated sides: waves cos(i pi x / width) cos(j pi y / depth) fit; collective.

    Args:
        width, depth: Along and across the sliding, mm.
        speed: mm/s.
        duration: Of a step of the heat, s.
        elements: Along and across the sliding.
        layers: Elements over the height.
        conductance: To another conductor as high; none for a rigid insulator.
    """
    sizes = {
        "width": width,
        "depth": depth,
        "punch_height": HEIGHT,
        "strip_height": 2.0 if conductance is None else HEIGHT,
        "across_x": elements[0],
        "across_y": elements[1],
        "punch_layers": layers,
        "strip_layers": 1 if conductance is None else layers,
        "growth": 6.0 ** (1 / layers),
    }
    held = {
        body: [{"on": f"{body}_sides", "fix": ["x"]}, {"on": f"{body}_ends", "fix": ["y"]}]
        for body in ("punch", "strip")
    }
    cold = {body: [{"on": f"{body}_far"}] for body in ("punch", "strip")}
    motion: dict[str, Any] = {"kind": "one-way", "direction": "rightward", "speed": speed, "duration": duration}
    if conductance is not None:  # to and fro, by next to nothing, no new material enters, which would be cold
        stroke = {"amplitude": speed * duration / 2, "period": 2 * duration}
        motion = {"kind": "reciprocating", "profile": "triangular", **stroke}
    return solve(
        {"file": "solid_blocks.geo", "degree": 2, "parameters": sizes},
        {"supports": held["punch"], "loads": [{"on": "punch_far", "traction": [0, 0, -1]}],
         "temperatures": cold["punch"]},
        {"supports": [{"on": "strip_far", "fix": ["x", "y", "z"]}, *held["strip"]], "temperatures": cold["strip"]},
        materials=(CONDUCTOR, INSULATOR if conductance is None else OTHER),
        contact={"friction": SMALL_FRICTION},
        motion=motion,
        heat={"partition": 1.0, "conductance": conductance or 0.0, "steps": 1, "reduction_tolerance": 1e-5},
    )  # fmt: skip


def growth(system: Tribosystem) -> float:
    """Return the growth rate of full contact, 1/s; collective."""
    return growth_rate(system, np.ones((len(system.motion.phases), len(system.pair.x))))


@verification(
    "solid-burton",
    "Thermo-elastic instability of sliding solids: waves along, across and oblique to the sliding",
    "Burton, Nerlikar and Kilaparti, Wear 24, 1973: a wave of any direction in the contact is in plane strain",
)
def instability() -> Result:
    """The critical speed with its order, growth of the wave that grows fastest, and of two conductors across.

    Waves cos(i pi x / W) cos(j pi y / D) have the number pi sqrt((i/W)² + (j/D)²). A good conductor on a rigid
    insulator keeps any of them in its place; between two conductors those across the sliding stay.
    """
    rows: list[Row] = []
    m = np.pi / 4
    for name, turned in (("along", 1), ("across", -1)):
        speeds = []
        for n in (2, 4):
            width, depth = (4.0, 0.5)[::turned]
            elements = (n, 1) if turned == 1 else (1, n)
            speeds.append(critical_speed(sliding_blocks(width, depth, 10.0, 0.05, elements=elements, layers=2 * n), 1))
        errors = [abs(speed - exact_speed(m)) for speed in speeds]
        rows.append(number(f"wave {name} the sliding: critical speed (mm/s)", exact_speed(m), speeds[-1], 1e-4))
        rows.append(order(f"wave {name} the sliding: order of twice the degree", 4, errors, 0.7))
    waves = [m * math.hypot(i, j) for i in range(4) for j in range(4) if i + j > 0]
    ratios, exact, found = (0.95, 1.5, 3.0), [], []
    for ratio in ratios:
        speed = ratio * exact_speed(m)
        exact.append(max(-K / RHO_C * (np.pi / (2 * HEIGHT)) ** 2, *(exact_rate(speed, wave) for wave in waves)))
        duration = 0.025 / exact[-1] if ratio > 1 else 0.05
        found.append(
            rate_without_steps(lambda dt, speed=speed: growth(sliding_blocks(4.0, 4.0, speed, dt)), duration)  # type: ignore[misc]
        )
        which = {0.95: "uniform cooling", 1.5: "waves along and across", 3.0: "oblique wave"}[ratio]
        rows.append(number(f"V = {ratio:g} of the critical speed, {which}: rate (1/s)", exact[-1], found[-1], 5e-3))
    for conductance, ratio in ((0.5, 1.5), (20.0, 1.5), (20.0, 3.0)):
        speed = ratio * exact_speed(m, OTHER, conductance)
        rate = exact_rate(speed, m, OTHER, conductance)
        make = partial(sliding_blocks, 1.0, 4.0, speed, elements=(1, 4), conductance=conductance)
        what = f"two conductors, h_c = {conductance:g} N/(mm s K), V = {ratio:g} of the critical speed: rate (1/s)"
        found_rate = rate_without_steps(lambda dt, make=make: growth(make(duration=dt)), 0.003 / rate)  # type: ignore[misc]
        rows.append(number(what, rate, found_rate, 5e-3))
    dense = np.linspace(0.9, 3.2, 100)
    lines = [Line("fenwear, fastest of all", np.array(ratios), np.array(found))]
    for name, length in (("along, across", 1.0), ("oblique", math.sqrt(2)), ("half as long", 2.0)):
        rates = np.array([exact_rate(v * exact_speed(m), length * m) for v in dense])
        lines.append(Line(f"half-space, {name}", dense, rates, reference=True))
    title = "Growth of waves along, across and oblique to the sliding"
    return Result(rows, [Plot(title, "speed / critical speed", "growth rate (1/s)", lines)])
