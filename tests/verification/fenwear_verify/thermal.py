"""Heat between two bodies: resistances in series, thermo-elastic instability, and the balance of energy."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np

from fenwear import vary
from fenwear.heat.heat_exchange import TERMS
from fenwear.steps import critical_speed, growth_rate, jump, march
from fenwear.system import Tribosystem, steady_exchange
from fenwear_verify.bodies import builtin, two_blocks
from fenwear_verify.suite import Line, Plot, Result, Row, number, profile, verification

HEIGHTS, CONDUCTIVITIES, FAR = (2.0, 3.0), (5.0, 1.5), (90.0, 20.0)  # of punch and strip: mm, mW/(mm K), K
SPEED, FRICTION, DEBRIS, PARTITION = 12.0, 0.3, 0.2, 0.3  # mm/s, mu, gamma_d, kappa


def series(conductance: float, friction_heat: float) -> tuple[float, float]:
    """Solve q1 + q2 = Q, kappa Q - q1 = h (t1 - t2), t_i = T_i + q_i l_i / k_i by hand; return t1 and t2, K."""
    r1, r2 = (height / k for height, k in zip(HEIGHTS, CONDUCTIVITIES, strict=True))
    if math.isinf(conductance):
        q1 = (FAR[1] - FAR[0] + friction_heat * r2) / (r1 + r2)
    else:
        drop = FAR[0] - FAR[1] - friction_heat * r2
        q1 = (PARTITION * friction_heat - conductance * drop) / (1 + conductance * (r1 + r2))
    return FAR[0] + q1 * r1, FAR[1] + (friction_heat - q1) * r2


@verification(
    "conductance", "Two bodies with contact conductance and friction heat", "thermal resistances in series, by hand"
)
def conductance() -> Result:
    """Two blocks of held far sides in the steady state, under 1 MPa: the temperatures of both surfaces.

    The material stores next to nothing, so that what enters the sliding strip at its end is at once as warm as it.
    """
    first, second = (
        {"young": 1e5, "poisson": 0.3, "heat_capacity": 1e-3, "density": 1e-9, "expansion": 1e-5, "conductivity": k}
        for k in CONDUCTIVITIES
    )
    held = {
        body: {"temperatures": [{"on": f"{body}_far", "temperature": t}]}
        for body, t in zip(("punch", "strip"), FAR, strict=True)
    }
    sizes = dict(zip(("punch_height", "strip_height"), HEIGHTS, strict=True))
    shared = {"partition": PARTITION, "debris": DEBRIS}
    system = two_blocks(
        first, second, sizes, contact={"friction": FRICTION}, heat=shared, punch=held["punch"], strip=held["strip"]
    )
    rows: list[Row] = []
    for text, value, heat in (
        ("none", 0.0, ("heat.conductance=0",)),
        ("0.7", 0.7, ("heat.conductance=0.7",)),
        ("0.1 p", 0.1, ("heat.conductance_per_pressure=[0.5, 0.125]",)),
        ("perfect", math.inf, ("heat.conductance=perfect",)),
    ):
        for velocity in (0.0, -SPEED):
            varied = vary(system, *heat)
            exchange = steady_exchange(varied, [velocity])
            pressure = np.ones(len(varied.pair.x))
            state, _ = exchange.half_cycle(exchange.initial(), 0, pressure, exchange.conductance(pressure))
            exact = series(value, (1 - DEBRIS) * FRICTION * abs(velocity))
            case = f"conductance {text}, {'sliding' if velocity else 'at rest'}"
            for name, t, found in zip(("punch", "strip"), exact, exchange.contact_temperatures(state), strict=True):
                rows.append(profile(f"{case}: {name}'s surface (K)", np.full_like(found, t), found, 1e-9, scale=t))
            jumps = np.subtract(*exchange.contact_temperatures(state))
            rows.append(
                profile(
                    f"{case}: temperature jump (K)", np.full_like(jumps, exact[0] - exact[1]), jumps, 1e-9, scale=FAR[0]
                )
            )
    return Result(rows)


WIDTH, HEIGHT, SMALL_FRICTION = 4.0, 12.0, 1e-3
YOUNG, POISSON, K, RHO_C, EXPANSION = 1e5, 0.25, 40.0, 3.0, 2e-5
WAVE = np.pi / WIDTH  # the wave number of the longest wave between sides that are insulated and held in x, 1/mm


def burton() -> float:
    """Return the critical speed V = 2 (1 - nu) k m / (mu E alpha) of the longest wave, mm/s."""
    return 2 * (1 - POISSON) * K * WAVE / (SMALL_FRICTION * YOUNG * EXPANSION)


def half_plane_rate(speed: float, m: float = WAVE) -> float:
    """Return the growth rate s of a wave on the half-plane, 1/s.

    Its temperature e^{st} e^{-l z} cos m x, l² = m² + s/a, raises the surface by 2 alpha (1 + nu) theta/(l + m),
    so that l (l + m) = mu E alpha V m / ((1 - nu) k); s = 0 for l = m is Burton's speed.
    """
    drive = SMALL_FRICTION * YOUNG * EXPANSION * speed * m / ((1 - POISSON) * K)
    length = (-m + math.sqrt(m**2 + 4 * drive)) / 2
    return K / RHO_C * (length**2 - m**2)


@cache
def conductor(speed: float, duration: float = 0.05, partition: float = 1.0) -> Tribosystem:
    """Return a good conductor, held in x and insulated at its sides, that slides on a rigid insulator; collective."""
    rigid = {
        "young": 1e14,
        "poisson": 0.0,
        "conductivity": 1e-9,
        "heat_capacity": 1e9,
        "density": 1e-9,
        "expansion": 0.0,
    }
    punch = {
        "young": YOUNG,
        "poisson": POISSON,
        "conductivity": K,
        "heat_capacity": RHO_C / 1e-9,
        "density": 1e-9,
        "expansion": EXPANSION,
    }
    sizes = {
        "width": WIDTH,
        "punch_height": HEIGHT,
        "strip_height": WIDTH,
        "across": 8,
        "punch_layers": 8,
        "strip_layers": 2,
        "growth": 1.3,
    }
    cold = {"temperatures": [{"on": "strip_far"}, {"on": "strip_sides"}]}  # what flows in is cold
    return two_blocks(
        punch,
        rigid,
        sizes,
        degree=3,
        punch={"temperatures": [{"on": "punch_far"}]},
        strip=cold,
        contact={"friction": SMALL_FRICTION},
        motion={"kind": "one-way", "direction": "rightward", "speed": speed, "duration": duration},
        heat={"partition": partition, "steps": 1, "reduction_tolerance": 1e-6},
    )


def _rate(speed: float, duration: float) -> float:
    system = conductor(speed, duration)
    return growth_rate(system, np.ones((1, len(system.pair.x))))


def rate_without_steps(rate: Callable[[float], float], duration: float) -> float:
    """Return the rate of growth, 1/s, from that of half-cycles of this duration and of half of it.

    The pressure of a half-cycle is that of its end, an error of first order.
    """
    return 2 * rate(duration / 2) - rate(duration)


@verification(
    "burton",
    "Thermo-elastic instability: a conductor slides on a rigid insulator",
    "Burton, Nerlikar and Kilaparti, Thermoelastic instability in a seal-like configuration, Wear 24, 1973",
)
def instability() -> Result:
    """A wave of number m grows above V = 2 (1 - nu) k m / (mu E alpha) and decays below; the rate as on the half-plane.

    The load holds the uniform wave; below the critical speed the slowest to decay is the uniform cooling,
    a (pi / 2 H)².
    """
    rows: list[Row] = []
    for partition in (1.0, 0.4):
        for d in (1, -1):
            found = critical_speed(conductor(100.0, partition=partition), d)
            case = f"kappa = {partition:g}, {'rightward' if d > 0 else 'leftward'}"
            rows.append(number(f"{case}: critical speed (mm/s)", burton() / partition, found, 1e-4))
    ratios = (0.1, 0.95, 1.1, 1.5, 3.0)
    rates, exact = [], []
    for ratio in ratios:
        waves = max(half_plane_rate(ratio * burton(), j * WAVE) for j in (1, 2, 3, 4))
        cooling = -K / RHO_C * (np.pi / (2 * HEIGHT)) ** 2
        exact.append(max(waves, cooling))
        duration = 0.025 / max(exact[-1], K / RHO_C * WAVE**2) if ratio > 1 else 0.05  # short for growth and diffusion
        rates.append(rate_without_steps(partial(_rate, ratio * burton()), duration))
        word = "grows" if exact[-1] > 0 else "decays"
        rows.append(number(f"V = {ratio:g} of the critical speed: {word} at (1/s)", exact[-1], rates[-1], 2e-3))
    dense = np.linspace(0.1, 3.0, 200)
    curve = [max(*(half_plane_rate(v * burton(), j * WAVE) for j in (1, 2, 3, 4)), cooling) for v in dense]
    lines = [
        Line("half-plane", dense, np.array(curve), reference=True),
        Line("fenwear", np.array(ratios), np.array(rates)),
    ]
    return Result(rows, [Plot("Growth of the fastest wave", "speed / critical speed", "growth rate (1/s)", lines)])


COARSE = (
    "geometry.parameters.elements_along_contact=4",
    "geometry.degree=2",
    "wear.punch.coefficient=4e-6",
    "heat.partition=0.2",
)
HELD = "strip.temperatures=[{on='strip_bottom', temperature=-30}, {on='strip_ends', temperature=12}]"
EXCHANGES: dict[str, tuple[str, ...]] = {  # sliding 3 mm in a half-cycle, one-way 40 mm
    "Example 1": (),
    "perfect contact": ("heat.conductance=perfect",),
    "conductance by pressure, debris": (
        "heat.conductance=0",
        "heat.conductance_per_pressure=[0.1, 0.3]",
        "heat.debris=0.3",
    ),
    "warm surroundings": ("heat.ambient=35", "heat.initial=-10", HELD),
    "isolated": ("heat.convection=0", "strip.temperatures=[]"),
    "one-way, 200 mm/s": (
        "motion={kind='one-way', direction='leftward', speed=200, duration=0.2}",
        "heat.ambient=35",
        HELD,
    ),
    "one-way, through open ends": (
        "motion={kind='one-way', direction='leftward', speed=200, duration=0.2}",
        "heat.ambient=35",
        "strip.temperatures=[]",
    ),
}


@verification(
    "energy",
    "Energy: friction power against heat in the bodies, losses and storage",
    "first law: mu F0 times the sliding distance = debris + stored + convected + held + carried",
)
def energy() -> Result:
    """Example 1 with heat, marched and by jumps: the balance of every half-cycle, and the work of friction."""
    rows: list[Row] = []
    runs: dict[str, Any] = {
        "march": lambda s: list(march(s, 12, implicit=True)),
        "jumps": lambda s: list(jump(s, 2000, tolerance=1e-2)),
    }
    for name, settings in EXCHANGES.items():
        system = builtin("example1-heat-unstable", *COARSE, *settings)
        work = 0.25 * 1e4 * (200 * 0.2 if name.startswith("one-way") else 2 * 1.5)
        for kind, run in runs.items():
            terms = np.concatenate([block.heat.terms[:, : len(TERMS)] for block in run(system)])
            friction, rest = terms[:, 0], terms[:, 1:].sum(axis=1)
            largest = np.abs(terms).max(axis=1)
            rows.append(
                profile(f"{name}, {kind}: friction against the other terms (mJ)", friction, rest, 1e-8, scale=largest)
            )
            if kind == "march":
                rows.append(
                    profile(
                        f"{name}, {kind}: friction work mu F0 2 u0 (mJ)",
                        np.full_like(friction, work),
                        friction,
                        1e-9,
                        scale=work,
                    )
                )
    return Result(rows)
