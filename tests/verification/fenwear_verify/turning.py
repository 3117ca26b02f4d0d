"""Rings, discs and pads that turn: decay by wear, steady states, volumes."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np

from fenwear import vary
from fenwear.common.arrays import Array
from fenwear.steps import growth_rate, march, steady
from fenwear.system import Tribosystem
from fenwear_verify.bodies import relief_rates
from fenwear_verify.solid import (
    MODULUS,
    RIGID,
    ROTATION,
    STEEL,
    solve,
)
from fenwear_verify.suite import Line, Plot, Result, Row, number, order, profile, verification


@cache
def ring(inner: float, across: int = 16, degree: int = 3, friction: float = 0.2) -> Tribosystem:
    """Return a rigid ring, or a disc, of outer radius 1 under 1,000 N on a steel body of 60 mm; collective."""
    sizes = {
        "inner_radius": inner,
        "outer_radius": 1,
        "margin_inside": inner,
        "margin_outside": 60,
        "margin_elements": 26,
        "spread": 1.4,
        "across": across,
        "edge_grading": 12,
        "punch_height": 1,
        "strip_height": 60,
        "strip_layers": 22,
        "growth": 1.45,
    }
    return solve(
        {"file": "rings.geo", "degree": degree, "parameters": sizes},
        {"loads": [{"on": "punch_far", "force": [0, -1000]}]},
        {"supports": [{"on": "strip_far", "fix": ["x", "z"]}]},
        kind="axisymmetric",
        materials=(RIGID, STEEL),
        contact={"friction": friction},
        wear={"punch": {"coefficient": 0.02 / MODULUS}},
        motion=ROTATION,
    )


def decay_rates(system: Tribosystem, speed: Array) -> Array:
    """Return the rates at which pressure disturbances decay by wear k p v, ascending, in E* k.

    On closed contact S p' + H a' = -k v p with the equilibrium of p' (full contact, no friction in S).
    """
    values = relief_rates(system, MODULUS, speed)
    return np.sort(values[values > 1e-6 * values.max()])


@verification(
    "round-punch",
    "A flat round punch and an annular one: pressure, and its decay by wear",
    "Boussinesq; Galin and Goryacheva: 2.0606500, 3.6710391; annular rates by a spectral solution of the half-space",
)
def round_punch() -> Result:
    """Pressure P / (2 pi a sqrt(a² - r²)); rates in E* k V / a of a translation and of a turn about the axis."""
    system = ring(0.0)
    r, p = system.pair.x, system.contact((1,)).solve(system.pair.initial_gap).pressure[0]
    exact = 1000 / (2 * np.pi * np.sqrt(np.maximum(1 - r**2, 1e-12)))
    inside = r < 0.8
    rows = [profile("disc: pressure for r < 0.8 a (MPa)", exact[inside], p[inside], 3e-3, scale=exact[inside])]
    one = np.ones(len(r))
    for k, (rate, found) in enumerate(zip((2.0606500, 3.6710391), decay_rates(system, one), strict=False)):
        rows.append(number(f"disc, translation: symmetric mode {k + 1} (E* k V/a)", rate, found, 2e-3))
    annular = ring(0.5)
    turning = annular.sliding.field.rate(annular.pair.punch.x, annular.pair.normal)
    for name, speed, rates in (
        ("translation", np.ones(len(turning)), (3.91876, 6.9196)),
        ("turn about the axis", turning, (2.74886, 4.9628)),
    ):
        for k, (rate, found) in enumerate(zip(rates, decay_rates(annular, speed), strict=False)):
            rows.append(number(f"r1/r2 = 0.5, {name}: symmetric mode {k + 1} (E* k V/r2)", rate, found, 1e-3))
    step = 0.02  # E* k of a half-cycle of 1 rad
    growth = growth_rate(annular, annular.optimum(1).pressure[None])
    rows.append(number("r1/r2 = 0.5, turn: growth rate (E* k V/r2)", 2.74886, np.expm1(-growth) / step, 1e-3))
    dense = np.linspace(0, 0.99, 300)
    lines = [
        Line("exact", dense, 1000 / (2 * np.pi * np.sqrt(1 - dense**2)), reference=True),
        Line("fenwear", r[r < 0.99], p[r < 0.99]),
    ]
    return Result(rows, [Plot("Flat round punch: pressure", "r (mm)", "pressure (MPa)", lines)])


@verification(
    "rotation",
    "A ring and a pad on a turning disc: steady pressure, worn volume",
    "p r = constant where all wears evenly; volume rate = beta~ omega torque / mu",
)
def rotation() -> Result:
    """P = F / (2 pi (r2 - r1) r) of a ring, from the optimum and from a march; a pad of 60 degrees with b = 1 and 2."""
    system = ring(0.5, friction=0.2)
    r, weights = system.pair.x, system.pair.weights
    exact = 1000 / (2 * np.pi * 0.5 * r)
    found = steady(system)
    blocks = list(march(system, 200, implicit=True))
    pressure = np.concatenate([block.pressure for block in blocks])
    torque = 0.2 * pressure @ (weights * r)
    depth = np.diff(np.concatenate([block.wear for block in blocks]), axis=0) @ weights
    rate = 0.02 / MODULUS  # beta~ omega of a half-cycle
    rows = [
        profile("ring, optimum: pressure (MPa)", exact, system.optimum(1).pressure, 1e-10, scale=exact),
        profile("ring, steady state: pressure (MPa)", exact, found.pressure[0], 1e-10, scale=exact),
        profile("ring, marched: pressure (MPa)", exact, pressure[-1], 1e-3, scale=exact),
        profile("ring, marched: volume in each half-cycle (mm³)", rate * torque[1:] / 0.2, depth, 1e-9,
                scale=rate * torque[-1] / 0.2),
    ]  # fmt: skip
    both = vary(system, f"wear.strip.coefficient={0.01 / MODULUS!r}")
    rows.append(profile("ring, both wear: pressure (MPa)", exact, steady(both).pressure[0], 1e-9, scale=exact))
    for b, inside, outside in ((1.0, 1.9894368, 1.1936621), (2.0, 1.7274554, 1.3380812)):
        turning = pad(b)
        x = turning.pair.punch.x
        r, optimum = np.hypot(x[:, 0], x[:, 1]), turning.optimum(1)
        state = steady(turning)
        for radius, value in ((60, inside), (100, outside)):
            there = np.abs(r - radius) < 1e-3
            what = f"pad, b = {b:g}: pressure at r = {radius} mm (MPa)"
            rows.append(profile(what, np.full(there.sum(), value), optimum.pressure[there], 1e-5, scale=value))
        rows.append(profile(f"pad, b = {b:g}, steady state: pressure (MPa)", optimum.pressure, state.pressure[0], 1e-9))
        if b == 1:
            torque = 0.35 * (optimum.pressure * r) @ turning.pair.weights
            rows += [
                number("pad: torque (N mm)", 140_000, torque, 1e-5),
                number("pad: rate of approach (mm/s)", 1.1936621e-5, optimum.velocity["lambda_F"], 1e-5),
            ]
    return Result([*rows, *worn_disc()])


def worn_disc() -> list[Row]:
    """Compare a pad on a disc that both wear: a sixth of what the disc loses is lost at each place, p r = constant."""
    rates, rows, errors = (1e-8, 3e-8), list[Row](), []
    for across in (2, 4):
        both = pad(
            wear={"punch": {"coefficient": rates[0]}, "strip": {"coefficient": rates[1]}},
            sizes={"across": across},
        )
        x = both.pair.punch.x
        optimum, state, (block,) = both.optimum(1), steady(both), march(both, 1, implicit=True)
        exact = 375 / np.pi / np.hypot(x[:, 0], x[:, 1])
        errors.append(float(np.abs(optimum.pressure / exact - 1).max()))
        torque = block.pressure[-1] @ (both.pair.weights * np.hypot(x[:, 0], x[:, 1]))
        worn = block.worn_area_increment_strip[-1]
        what = f"pad and disc, {across} elements across"
        rows += [
            profile(f"{what}: steady pressure (MPa)", exact, state.pressure[0], 0.02, scale=exact),
            profile(f"{what}: optimum (MPa)", state.pressure[0], optimum.pressure, 1e-9),
            number(f"{what}: approach (mm/s)", 1.790493e-5, optimum.velocity["lambda_F"], 2e-3),
            number(f"{what}: volume of the disc (mm³)", rates[1] * 10 * torque, worn, 1e-12),
        ]
    return [*rows, order("pad and disc: order of the pressure's largest error", 1, errors, 0.7)]


def pad(b: float = 1.0, sizes: Mapping[str, float] | None = None, **tables: Any) -> Tribosystem:
    """Return the annular sector r 60..100 mm, 60 degrees, F = 5,000 N, on a disc that turns; collective."""
    return solve(
        {"file": "pad_on_disc.geo", "degree": 2, "order": 2, "parameters": dict(sizes or {})},
        {
            "supports": [{"on": "punch_sides", "fix": ["x", "y"]}],
            "loads": [{"on": "punch_far", "force": [0, 0, -5000]}],
        },
        {"supports": [{"on": "strip_far", "fix": ["x", "y", "z"]}]},
        materials=({"young": 1000.0, "poisson": 0.25}, STEEL),
        **{
            "contact": {"friction": 0.35},
            "wear": {"punch": {"coefficient": 1e-8, "pressure_exponent": b}},
            "motion": {"kind": "rotation", "angular_speed": 10.0, "duration": 1.0},
            **tables,
        },
    )


@verification(
    "solid-volume",
    "Worn volumes of both solids, sliding to and fro and turning to and fro",
    "beta~ F 2 u0 in a translation; beta~ 2 phi0 times the integral of p r in a rotation",
)
def volumes() -> Result:
    """Blocks that slide askew over nodes that do not match, and the pad on a disc that oscillates; both bodies wear."""
    rows: list[Row] = []
    rates = {"punch": 1e-6, "strip": 5e-7}
    wear = {body: {"coefficient": rate} for body, rate in rates.items()}
    run, amplitude = {"half_cycles": 4}, 0.05
    sizes = {"margin_x": 0.3, "margin_y": 0.3, "margin_elements": 1, "across_x": 2, "across_y": 3, "strip_across_x": 3}
    for tetrahedra in (0, 1):
        blocks = solve(
            {"file": "solid_blocks.geo", "degree": 2, "parameters": {**sizes, "strip_tetrahedra": tetrahedra}},
            {
                "supports": [{"on": "punch_sides", "fix": ["x", "y"]}],
                "loads": [{"on": "punch_far", "force": [0, 0, -100]}],
            },
            {"supports": [{"on": "strip_far", "fix": ["x", "y", "z"]}]},
            contact={"friction": 0.2},
            wear=wear,
            motion={"kind": "reciprocating", "amplitude": amplitude, "period": 1.0, "along": [3, 4, 0], "positions": 3},
            run=run,
        )
        last = list(march(blocks, 4))[-1]
        for body, surface, depth in (
            ("punch", blocks.pair.weights, last.wear[-1]),
            ("strip", blocks.pair.strip.weights, last.wear_strip[-1]),
        ):
            exact = rates[body] * 100 * 2 * amplitude * 4
            kind = ("hexahedra", "tetrahedra")[tetrahedra]
            rows.append(number(f"blocks on {kind}: volume of the {body} (mm³)", exact, surface @ depth, 1e-9))
    angle = 0.1
    turning = {"kind": "oscillation", "amplitude": angle, "period": 1.0}
    alone = pad(wear={"punch": wear["punch"]}, motion=turning, run=run)
    x = alone.pair.punch.x
    last = list(march(alone, 4))[-1]
    exact = rates["punch"] * 2 * angle * (last.pressure @ (alone.pair.weights * np.hypot(x[:, 0], x[:, 1]))).sum()
    rows.append(number("pad alone: volume (mm³)", exact, alone.pair.weights @ last.wear[-1], 1e-12))
    both = pad(wear=wear, motion={**turning, "positions": 3}, run=run)
    last = list(march(both, 4))[-1]
    worn = both.pair.weights @ last.wear[-1]
    rows.append(
        number("pad and disc: volume of the disc (mm³)", worn / 2, both.pair.strip.weights @ last.wear_strip[-1], 1e-12)
    )
    rows.append(number("pad and disc: volume of the pad (mm³)", exact, worn, 1e-3))
    return Result(rows)
