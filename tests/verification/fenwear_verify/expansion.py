"""Thermal strain in one body: a manufactured solution, free expansion, bimetal."""

from __future__ import annotations

import numpy as np

from fenwear import vary
from fenwear.algebra.assembled import times
from fenwear.common.arrays import Array
from fenwear.heat.temperature import HeatState
from fenwear.results.fields import body_fields
from fenwear_verify.bodies import bodies_of_blocks, builtin, clamped, two_blocks
from fenwear_verify.conduction import MATERIAL, owned_nodes
from fenwear_verify.manufactured import (
    DEGREES,
    displacement,
    errors,
    stacked,
    unit_square,
)
from fenwear_verify.suite import Result, Row, number, order, profile, verification


@verification(
    "thermal-strain",
    "Thermal strain: order of convergence of a manufactured solution",
    "Goodier's potential; Timoshenko and Goodier, Theory of Elasticity, 1970",
)
def thermal_strain() -> Result:
    """Displacement grad phi, phi = sin² pi X sin² pi z, in a clamped square.

    For laplace phi = (1 + nu) alpha theta in plane stress, (1 + nu)/(1 - nu) alpha theta in plane strain, the
    thermal stress needs no further force.
    """
    nu, alpha = MATERIAL["poisson"], MATERIAL["expansion"]
    pi = np.pi

    def exact(x: Array, z: Array) -> Array:
        x = x + 0.5
        return pi * stacked(np.sin(2 * pi * x) * np.sin(pi * z) ** 2, np.sin(pi * x) ** 2 * np.sin(2 * pi * z))

    rows: list[Row] = []
    for plane, factor in (("stress", (1 + nu) * alpha), ("strain", (1 + nu) / (1 - nu) * alpha)):
        for degree in DEGREES[:3]:
            pairs = []
            for count in (10, 20):
                bodies = bodies_of_blocks(
                    MATERIAL, MATERIAL, unit_square(count), degree=degree, plane=plane, strip=clamped("strip"), heat={}
                )
                heat = bodies.heat[1]
                x, z = owned_nodes(heat)
                s, t = np.sin(pi * (x + 0.5)) ** 2, np.sin(pi * z) ** 2
                c, d = np.cos(2 * pi * (x + 0.5)), np.cos(2 * pi * z)
                theta = heat.function(2 * pi**2 * (c * t + s * d) / factor)
                coupling = bodies.strip.thermal_coupling(heat.space)
                force = times(coupling, theta.x.array[: heat.owned])
                pairs.append(errors(displacement(bodies.strip, force), exact))
            in_l2, in_h1 = np.array(pairs).T
            rows.append(order(f"plane {plane}, degree {degree}: order in L2", degree + 1, in_l2, 0.2))
            rows.append(order(f"plane {plane}, degree {degree}: order in H1", degree, in_h1, 0.2))
    return Result(rows)


@verification(
    "free-expansion",
    "Free thermal expansion of a bar",
    "Timoshenko and Goodier, Theory of Elasticity, 1970: a linear temperature makes no stress",
)
def free_expansion() -> Result:
    """The punch as a bar on two pins, its temperature linear in x and z: no stress, and the displacement by hand.

    u_x = a (t0 x + tx (x² - z²)/2 + tz x z) and its like along z, a = alpha, in plane strain (1 + nu) alpha.
    """
    alpha, nu, (t0, tx, tz), half = 1e-5, 0.3, (50.0, 3.0, -20.0), 4.0
    bar = {**MATERIAL, "young": 2e5, "expansion": alpha}
    pins = {"supports": [{"at": [-half, 0], "fix": ["x", "z"]}, {"at": [half, 0], "fix": ["z"]}]}
    sizes = {"width": 2 * half, "across": 8, "punch_layers": 2, "strip_layers": 1}
    rows: list[Row] = []
    for plane in ("stress", "strain"):
        system = two_blocks(bar, bar, sizes, plane=plane, punch=pins, heat={})
        x, z = owned_nodes(system.bodies.heat[0])
        theta = t0 + tx * x + tz * z
        strip = np.zeros(system.bodies.heat[1].owned)
        nothing = np.zeros(len(system.pair.x))
        unloaded = vary(system, "punch.loads=[{on='punch_far', traction=[0, -1e-12]}]")
        fields, _ = body_fields(unloaded, nothing, np.zeros(0), 0, (theta, strip))
        ours = fields["displacement"].x.array[: 2 * len(x)].reshape(-1, 2)
        s, expansion = x + half, alpha if plane == "stress" else (1 + nu) * alpha
        start = t0 - half * tx  # the temperature at the first pin, from where s is counted
        exact = expansion * np.stack(
            [start * s + tx * (s**2 - z**2) / 2 + tz * s * z, start * z + tz * (z**2 - s**2) / 2 + tx * s * z], axis=1
        )
        turn = expansion * tz * half  # the rotation that the second pin prevents
        exact += turn * np.stack([-z, s], axis=1)
        exact, ours = (np.concatenate(system.bodies.comm.allgather(part)) for part in (exact, ours))
        scale = np.abs(exact).max()
        rows.append(profile(f"plane {plane}: displacement (mm)", exact, ours, 1e-9, scale=scale))
        if plane == "stress":
            held = 2e5 * alpha * t0  # what a bar held at its ends would bear
            largest = system.bodies.comm.allreduce(float(np.abs(fields["von_mises"].x.array).max()), max)
            rows.append(number(f"plane {plane}: largest stress / E alpha t0", 0, largest / held, 1e-8, scale=1))
    return Result(rows)


@verification(
    "bimetal", "A heated bimetal strip", "S. Timoshenko, Analysis of bi-metal thermostats, J. Opt. Soc. Am. 11, 1925"
)
def bimetal() -> Result:
    """Curvature 6 (a1 - a2) dT (1 + m)² / (h (3 (1 + m)² + (1 + m n)(m² + 1/(m n)))), m and n lower over upper layer.

    The punch of two layers on two pins, in plane stress, whose contact surface bends; the strip does not expand.
    """
    length, height, warming, (alpha1, alpha2) = 8.0, 1.0, 40.0, (3e-5, 1e-5)
    rows: list[Row] = []
    for m, n, poisson in ((1.0, 1.0, 0.3), (0.5, 4.0, 0.3), (3.0, 0.2, 0.1)):
        lower = height * m / (1 + m)
        size = {
            "punch_width": length,
            "punch_height": height,
            "layer_height": lower,
            "pin_height_1": lower,
            "strip_length": 2 * length,
            "strip_height": height,
            "overlap": length / 4,
        }
        values = {**size, "elements_along_contact": 32, "edge_grading": 1, "growth": 0.2}
        parameters = ", ".join(f"{name}={value!r}" for name, value in values.items())
        thermal = "conductivity=1, heat_capacity=1, density=1"
        pins = ", ".join(f"{{at=[{x}, {height}], fix={fix}}}" for x, fix in ((-4, "['x', 'z']"), (4, "['z']")))
        system = builtin(
            "example1-heat",
            f"geometry={{parameters={{{parameters}}}, degree=3}}",
            f"materials.lower={{young={1e5 * n}, poisson=0.3, expansion={alpha1}, {thermal}}}",
            f"materials.upper={{young=1e5, poisson={poisson}, expansion={alpha2}, {thermal}}}",
            f"materials.still={{young=1e5, poisson=0.3, expansion=0, {thermal}}}",
            "punch.regions={punch_lower='lower', punch_upper='upper'}",
            "strip.regions={strip_body='still'}",
            f"punch.supports=[{pins}]",
            "heat={operator='full', steps=1}",
            "strip.temperatures=[]",
        )
        warm = [np.full(body.owned, value) for body, value in zip(system.bodies.heat, (warming, 0.0), strict=True)]
        x, deflection = system.pair.x, system.exchange.gap(HeatState.nodal(system.bodies.heat, warm))
        middle = np.abs(x) < 1
        curvature = 2 * np.polyfit(x[middle], deflection[middle], 2)[0]
        bending = 3 * (1 + m) ** 2 + (1 + m * n) * (m**2 + 1 / (m * n))
        timoshenko = 6 * (alpha1 - alpha2) * warming * (1 + m) ** 2 / (height * bending)
        # The lower layer expands more: the ends rise.
        case = f"heights {m:g}, moduli {n:g}, Poisson's ratios 0.3 and {poisson:g}"
        rows.append(number(f"{case}: curvature (1/mm)", timoshenko, curvature, 1e-5))
    return Result(rows)
