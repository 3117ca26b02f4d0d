"""Heat in solids and rings."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from fenwear.common.arrays import Array
from fenwear.heat.conduction import HeatBody, Surroundings
from fenwear.steps import critical_speed, growth_rate, march, steady
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import march_within
from fenwear.surfaces.sliding_field import SlidingField
from fenwear.system import Tribosystem, build_bodies
from fenwear_verify.solid import STEEL, describe, solve
from fenwear_verify.suite import Result, Row, number, order, profile, verification
from fenwear_verify.thermal import (
    EXPANSION,
    HEIGHT,
    POISSON,
    RHO_C,
    SMALL_FRICTION,
    WAVE,
    WIDTH,
    YOUNG,
    K,
    burton,
    half_plane_rate,
    rate_without_steps,
)

THERMAL = {**STEEL, "conductivity": 50.0, "heat_capacity": 4.6e8, "density": 7.8e-9, "expansion": 1e-5}


@verification(
    "solid-slice-heat",
    "A solid slice with its sides held is in plane strain, with friction heat, too",
    "the plane model on the same mesh, which is verified by itself",
)
def slice_with_heat() -> Result:
    """Pressure and both surfaces' temperatures after 6 half-cycles, all nodes' temperatures followed."""
    depth = 0.7
    heights = {"punch_height": 1.5, "strip_height": 1, "punch_layers": 2, "strip_layers": 2, "growth": 1.4}
    sizes = {"width": 2, **heights, "margin_elements": 2}
    shared: dict[str, Any] = {
        "materials": (THERMAL, THERMAL),
        "contact": {"friction": 0.3},
        "wear": {"punch": {"coefficient": 2e-7}},
        "motion": {"kind": "reciprocating", "amplitude": 0.5, "period": 1.0},
        "heat": {"operator": "full", "partition": 0.5, "conductance": 1.0},
    }
    cold = {body: {"temperatures": [{"on": f"{body}_far"}]} for body in ("punch", "strip")}
    flat = solve(
        {"file": "blocks.geo", "degree": 2, "parameters": {**sizes, "margin": 0.6, "across": 4}},
        {
            "supports": [{"on": "punch_sides", "fix": ["x"]}],
            "loads": [{"on": "punch_far", "force": [0, -100]}],
            **cold["punch"],
        },
        {"supports": [{"on": "strip_far", "fix": ["x", "z"]}], **cold["strip"]},
        **{**shared, "model": {"plane": "strain", "thickness": depth}},
    )
    held = {body: {"on": f"{body}_ends", "fix": ["y"]} for body in ("punch", "strip")}
    deep = {**sizes, "margin_x": 0.6, "depth": depth, "across_x": 4, "across_y": 1}
    solid = solve(
        {"file": "solid_blocks.geo", "degree": 2, "parameters": deep},
        {
            "supports": [{"on": "punch_sides", "fix": ["x"]}, held["punch"]],
            "loads": [{"on": "punch_far", "force": [0, 0, -100]}],
            **cold["punch"],
        },
        {"supports": [{"on": "strip_far", "fix": ["x", "y", "z"]}, held["strip"]], **cold["strip"]},
        **shared,
    )
    node = np.searchsorted(flat.pair.x, solid.pair.x - 1e-9)
    (exact,), (found,) = (march_within(system, RunLimits(6, block=6)) for system in (flat, solid))
    rows: list[Row] = [profile("pressure (MPa)", exact.pressure[-1][node], found.pressure[-1], 1e-9)]
    if exact.heat is None or found.heat is None:
        return Result(rows)
    for body in ("punch", "strip"):
        one, other = (getattr(heat, f"temperature_{body}")[-1] for heat in (exact.heat, found.heat))
        rows.append(profile(f"temperature of the {body} (K)", one[node], other, 1e-9))
    return Result(rows)


# ---------------------------------------------------------------------------- a turning body

OMEGA, CENTRE, DIFFUSIVITY, CONDUCTIVITY = 30.0, -1.5, 1.5, 3.0


def turning(elements: int, degree: int, *, tetrahedra: bool = False) -> HeatBody:
    """Return conduction in the block of 1 mm below z = 0, about x = y = 0, held everywhere but on top; collective."""
    material = {**STEEL, "conductivity": CONDUCTIVITY, "heat_capacity": 4.0, "density": 0.5, "expansion": 0.0}
    sizes = {"across_x": elements, "across_y": elements, "strip_layers": elements, "punch_layers": 1}
    held = [{"on": f"strip_{name}"} for name in ("far", "sides", "ends")]
    case = describe(
        {"file": "solid_blocks.geo", "degree": degree, "parameters": {**sizes, "strip_tetrahedra": int(tetrahedra)}},
        {
            "supports": [{"on": "punch_sides", "fix": ["x", "y"]}],
            "loads": [{"on": "punch_far", "force": [0, 0, -1]}],
        },
        {"supports": [{"on": "strip_far", "fix": ["x", "y", "z"]}], "temperatures": held},
        materials=(material, material),
        heat={"convection": 1.0},
        motion={"kind": "rotation", "centre": [CENTRE, 0, 0], "angular_speed": OMEGA, "duration": 1.0},
    )
    heat = build_bodies(case).heat
    assert heat is not None
    return heat[1]


def turning_wave(x: Array, beta: complex, factor: complex = 1.0) -> Array:
    """Return Re[factor ((x - c) + i y)^2 e^{beta z}], which a turn about z through x = c turns in itself."""
    return np.asarray((factor * (x[:, 0] - CENTRE + 1j * x[:, 1]) ** 2 * np.exp(beta * x[:, 2])).real)


def turning_error(body: HeatBody, duration: float) -> float:
    """Return the error of a step, over the largest temperature, from the exact wave with its flux at z = 0; collective.

    A field of order m around the axis obeys a beta² = i m omega + (1 - 1/g)/dt, which grows by g in a step.
    """
    wave = 2j * OMEGA
    if np.isinf(duration):
        beta, grown = complex(np.sqrt(wave / DIFFUSIVITY)), 1.0 + 0j
    else:
        beta = 3.0 + 2.0j
        grown = 1 / (1 - duration * (DIFFUSIVITY * beta**2 - wave))
    x = body.space.tabulate_dof_coordinates()[: body.owned]
    exact = turning_wave(x, beta, grown)
    body.held_values = exact[body.held]
    around = Surroundings(sliding=SlidingField(turn=(0.0, 0.0, 1.0), centre=(CENTRE, 0.0, 0.0)))
    step = body.step(OMEGA, duration, around)
    flux = CONDUCTIVITY * turning_wave(body.surface.x, beta, grown * beta)
    found = step.advance(turning_wave(x, beta)) + step.respond(body.load(flux)[:, None])[:, 0]
    comm = body.body.mesh.comm
    squares = comm.allreduce(np.array([((found - exact) ** 2).sum(), (exact**2).sum()]))
    return float(np.sqrt(squares[0] / squares[1]))


@verification(
    "turning-heat",
    "Heat in a turning solid: order of convergence with advection around an axis",
    "exact fields ((x - c) + i y)^2 e^{beta z} of the heat equation of a turning body and of its implicit Euler step",
)
def turning_heat() -> Result:
    """Steady and one step, hexahedra and tetrahedra of degree 2; v L / a reaches 40."""
    rows: list[Row] = []
    for tetrahedra in (False, True):
        bodies = [turning(elements, 2, tetrahedra=tetrahedra) for elements in (5, 10)]
        for name, duration in (("steady", np.inf), ("step of 0.02 s", 0.02)):
            errors = [turning_error(body, duration) for body in bodies]
            what = f"{'tetrahedra' if tetrahedra else 'hexahedra'}, {name}"
            rows.append(number(f"{what}: error at the nodes, 10 elements", 0, errors[-1], 0.01, scale=1))
            rows.append(order(f"{what}: order", 3, errors, 0.5))
    return Result(rows)


# ------------------------------------------------------------------------------------ rings


def heated_rings(**heat: Any) -> Tribosystem:
    """Return rings of 20 to 30 mm, 4 and 6 mm high, pressed by 2 kN, that turn at 10 rad/s; collective."""
    material = {**THERMAL, "expansion": 1e-6}
    sizes = {"inner_radius": 20, "outer_radius": 30, "across": 4, "punch_height": 4, "strip_height": 6}
    cold = {body: {"temperatures": [{"on": f"{body}_far"}]} for body in ("punch", "strip")}
    return solve(
        {"file": "rings.geo", "degree": 2, "parameters": sizes},
        {"loads": [{"on": "punch_far", "force": [0, -2000]}], **cold["punch"]},
        {"supports": [{"on": "strip_far", "fix": ["x", "z"]}], **cold["strip"]},
        kind="axisymmetric",
        materials=(material, {**material, "conductivity": 20.0}),
        contact={"friction": 0.1},
        wear={"punch": {"coefficient": 1e-7}, "strip": {"coefficient": 2e-8}},
        motion={"kind": "rotation", "angular_speed": 10.0, "duration": 1.0},
        heat=heat,
    )


RADIUS = 4e3  # mm: bands of 8 mm do not feel it


def _rate(speed: float, duration: float) -> float:
    system = banded(speed, duration)
    return growth_rate(system, np.ones((1, len(system.pair.x))))


def banded(speed: float, duration: float, radius: float = RADIUS) -> Tribosystem:
    """Return a conductor's ring so large that it is straight, on a rigid insulator, as of `thermal.conductor`."""
    rigid = {"young": 1e14, "poisson": 0.0, "conductivity": 1e-3, "heat_capacity": 1e4, "density": 1e-9}
    ours = {"young": YOUNG, "poisson": POISSON, "conductivity": K, "heat_capacity": RHO_C / 1e-9, "density": 1e-9}
    sizes = {"inner_radius": radius - WIDTH / 2, "outer_radius": radius + WIDTH / 2, "punch_height": HEIGHT,
             "strip_height": WIDTH, "across": 8, "punch_layers": 8, "strip_layers": 2, "growth": 1.3}  # fmt: skip
    held = [{"on": f"punch_{side}", "fix": ["x"]} for side in ("inside", "outside")]
    return solve(
        {"file": "rings.geo", "degree": 3, "parameters": sizes},
        {
            "supports": held,
            "loads": [{"on": "punch_far", "traction": [0, -1]}],
            "temperatures": [{"on": "punch_far"}],
        },
        {"supports": [{"on": "strip_far", "fix": ["x", "z"]}], "temperatures": [{"on": "strip_far"}]},
        kind="axisymmetric",
        materials=({**ours, "expansion": EXPANSION}, {**rigid, "expansion": 0.0}),
        contact={"friction": SMALL_FRICTION},
        motion={"kind": "rotation", "angular_speed": speed / radius, "duration": duration},
        heat={"partition": 1.0, "steps": 1, "reduction_tolerance": 1e-6},
    )


@verification(
    "ring-heat",
    "Rings with friction heat: steady temperature, hot bands",
    "thermal resistances in series by hand; Burton's critical speed and rates, for bands along the sliding",
)
def ring_heat() -> Result:
    """In the steady state p r and so the heat are uniform; bands grow above V = 2 (1 - nu) k m / (mu E alpha)."""
    rows: list[Row] = []
    heat = 0.1 * 2000 / (2 * np.pi * 10) * 10  # mu p r omega
    for name, conductance in (("perfect", np.inf), ("0.5 N/(mm s K)", 0.5)):
        # By the usual basis the same within what its certificate tells: 4e-6.
        between = "perfect" if np.isinf(conductance) else conductance
        system = heated_rings(partition=0.4, conductance=between, reduction_tolerance=1e-6)
        state = steady(system)
        assert state.heat is not None
        # theta_i = q_i l_i / k_i, q_1 + q_2 = q, kappa q - q_1 = h_c (theta_1 - theta_2)
        one, two, loss = 4 / 50, 6 / 20, 0.0 if np.isinf(conductance) else 1 / conductance
        first = heat * (0.4 * loss + two) / (loss + one + two)
        for body, found, exact in (
            ("punch", state.heat.punch, first * one),
            ("strip", state.heat.strip, (heat - first) * two),
        ):
            what = f"conductance {name}: temperature of the {body} (K)"
            rows.append(profile(what, np.full(found[-1].shape, exact), found[-1], 1e-8, scale=exact))
        r = system.pair.x
        rows.append(profile(f"conductance {name}: pressure (MPa)", 100 / np.pi / r, state.pressure[0], 1e-8, scale=1))
        *_, block = march(system, 20)
        if block.heat is not None:
            rows.append(number(f"conductance {name}: heat balance", 0, block.heat.balance_error.max(), 1e-10, scale=1))
    rows.append(
        number("hot bands: critical speed (mm/s)", burton(), RADIUS * critical_speed(banded(100.0, 0.05), 1), 2e-4)
    )
    for ratio in (0.95, 1.5, 3.0):
        cooling = -K / RHO_C * (np.pi / (2 * HEIGHT)) ** 2
        exact = max(cooling, *(half_plane_rate(ratio * burton(), j * WAVE) for j in (1, 2, 3, 4)))
        duration = 0.025 / exact if ratio > 1 else 0.05
        rate = rate_without_steps(partial(_rate, ratio * burton()), duration)
        rows.append(number(f"hot bands at {ratio:g} of it: rate of growth (1/s)", exact, rate, 2e-3))
    return Result(rows)
