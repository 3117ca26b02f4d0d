"""Conduction in one body: manufactured solutions, periodic flux, plug flow."""

from __future__ import annotations

import math
from functools import cache, partial

import numpy as np

from fenwear.common.arrays import Array
from fenwear.heat.conduction import HeatBody, Surroundings
from fenwear_verify.bodies import bodies_of_blocks, clamped
from fenwear_verify.manufactured import (
    DEGREES,
    convergence_plot,
    errors,
    unit_square,
)
from fenwear_verify.suite import Line, Plot, Result, Row, number, order, profile, verification

K, RHO_C, AMBIENT, CONVECTION, THICKNESS = 3.0, 2.0, 7.0, 4.0, 20.0
MATERIAL = {
    "young": 130.0,
    "poisson": 0.3,
    "conductivity": K,
    "heat_capacity": RHO_C / 0.5,
    "density": 0.5,
    "expansion": 1e-3,
}
HELD_SIDES = {"temperatures": [{"on": "strip_sides"}]}


@cache
def conducting_square(elements: int, degree: int, *, free: bool = True) -> HeatBody:
    """Return conduction in the strip -1/2 < x < 1/2, -1 < z < 0, held at its sides, free to convect or insulated."""
    heat = {"convection": CONVECTION if free else 0.0, "ambient": AMBIENT}
    bodies = bodies_of_blocks(
        MATERIAL,
        MATERIAL,
        unit_square(elements),
        degree=degree,
        strip={**clamped("strip"), **HELD_SIDES},
        model={"thickness": THICKNESS},
        heat=heat,
    )
    return bodies.heat[1]


def owned_nodes(body: HeatBody) -> tuple[Array, Array]:
    """Return x and z of this rank's nodes."""
    points = body.space.tabulate_dof_coordinates()[: body.owned]
    return points[:, 0], points[:, 1]


def wave(x: Array, z: Array, m: float, beta: complex, factor: complex) -> Array:
    """Return ambient + Re[factor e^{imx} (e^{beta z} + B e^{-beta (z + 2)})], which convects at z = -1."""
    field = factor * np.exp(1j * m * x) * (np.exp(beta * z) + _reflected(beta) * np.exp(-beta * (z + 2)))
    return AMBIENT + field.real


def _reflected(beta: complex) -> complex:
    return (K * beta - CONVECTION) / (K * beta + CONVECTION)


def end_of_step(body: HeatBody, m: float, beta: complex, factor: complex, velocity: float, duration: float) -> Array:
    """Return the end of a step from the wave of factor 1: held on its sides, with the wave's flux at z = 0."""
    x, z = owned_nodes(body)
    body.held_values = wave(x, z, m, beta, factor)[body.held]
    step = body.step(velocity, duration)
    slope = factor * beta * (1 - _reflected(beta) * np.exp(-2 * beta))
    flux = K * (slope * np.exp(1j * m * contact_abscissae(body))).real
    load = body.load(flux)
    return step.advance(wave(x, z, m, beta, 1.0)) + step.respond(load[:, None])[:, 0]


def contact_abscissae(body: HeatBody) -> Array:
    """Return x of the contact nodes of a body on every rank (n,), mm."""
    x, _ = owned_nodes(body)
    return body.contact(x)


REGIMES = {
    "steady, at rest": (0.0, math.inf),
    "steady, Pe = 100": (-150.0, math.inf),
    "transient, at rest": (0.0, 0.1),
    "transient, Pe = 100": (150.0, 0.02),
}


@verification(
    "conduction",
    "Conduction: order of convergence with advection, convection and flux",
    "exact waves of the heat equation and of its implicit Euler step, nothing added to the equations",
    slow=True,
)
def conduction() -> Result:
    """L2 order degree + 1 and H1 order degree, at rest and at high Peclet numbers v L / a.

    With i m v + (1 - 1/g)/dt = a (beta² - m²) - 2 h/(t rho c) the wave is an exact solution of an implicit
    Euler step from factor 1 to g, and of the steady state.
    """
    m, diffusivity, loss = 3.0, K / RHO_C, 2 * CONVECTION / THICKNESS / RHO_C
    rows: list[Row] = []
    plots: list[Plot] = []
    for name, (velocity, duration) in REGIMES.items():
        if math.isinf(duration):
            beta, factor = complex(np.sqrt(m**2 + (1j * m * velocity + loss) / diffusivity)), 1.0 + 0j
        else:
            beta = 2.0 + 1.5j
            factor = 1 / (1 - duration * (diffusivity * (beta**2 - m**2) - loss - 1j * m * velocity))
        tolerance = 0.1 if velocity == 0 else 0.3
        sizes, found = [], []
        for degree in DEGREES:
            counts = np.array([96, 192] if degree == 1 else [16, 32])
            pairs = []
            for count in counts:
                body = conducting_square(int(count), degree)
                theta = body.function(end_of_step(body, m, beta, factor, velocity, duration))
                pairs.append(errors(theta, partial(wave, m=m, beta=beta, factor=factor)))
            in_l2, in_h1 = np.array(pairs).T
            rows.append(order(f"{name}, degree {degree}: order in L2", degree + 1, in_l2, tolerance))
            rows.append(order(f"{name}, degree {degree}: order in H1", degree, in_h1, tolerance))
            sizes.append(1 / counts)
            found.append(in_l2 / AMBIENT)
        if name == "steady, Pe = 100":
            names = [f"degree {k}" for k in DEGREES]
            title = "Conduction with advection, Pe = 100: L2 error"
            plots.append(convergence_plot(title, sizes, found, names, [k + 1 for k in DEGREES]))
    return Result(rows, plots)


@verification(
    "time-steps",
    "Conduction: order of convergence in time",
    "decay e^(-2 pi² a t) of sin pi X cos pi z; implicit Euler divides by 1 + rate dt",
)
def time_steps() -> Result:
    """A mode held on the sides and insulated elsewhere: exactly implicit Euler, and so of first order."""
    body = conducting_square(8, 4, free=False)
    comm = body.body.mesh.comm
    x, z = owned_nodes(body)
    body.held_values = np.zeros(len(body.held))
    mode = np.sin(np.pi * (x + 0.5)) * np.cos(np.pi * z)
    rate, end = 2 * np.pi**2 * K / RHO_C, 0.05
    weight = body.store(mode)
    rows: list[Row] = []
    differences = []
    for steps in (10, 20, 40, 80):
        theta, step = mode, body.step(0.0, end / steps)
        for _ in range(steps):
            theta = step.advance(theta)
        left = comm.allreduce(float(weight @ theta)) / comm.allreduce(float(weight @ mode))
        differences.append(abs(left - math.exp(-rate * end)))
        rows.append(number(f"{steps} steps: what is left of the mode", (1 + rate * end / steps) ** -steps, left, 1e-6))
    rows.append(order("order in the time step, against e^(-rate t)", 1, differences, 0.1))
    durations = [end / n for n in (10, 20, 40, 80)]
    plot = Plot(
        "Conduction: error of implicit Euler",
        "time step (s)",
        "error of what is left of the mode",
        [Line("fenwear", np.array(durations), np.array(differences))],
        ("log", "log"),
        (1.0,),
    )
    return Result(rows, [plot])


@verification(
    "periodic-flux",
    "Periodic heat flux on a half-space",
    "Carslaw and Jaeger, Conduction of Heat in Solids, 1959, section 2.6",
)
def periodic_flux() -> Result:
    """Amplitude q0 / sqrt(k rho c omega), lag 45 degrees.

    Implicit Euler has s = (1 - e^(-i omega dt))/dt for i omega. The strip is ten penetration
    depths deep and insulated but for the flux.
    """
    omega, flux, periods = 10.0, 2.0, 6
    depth = 10 * math.sqrt(2 * K / (RHO_C * omega))
    sizes = {"width": 0.5, "strip_height": depth, "across": 2, "strip_layers": 20, "punch_layers": 1}
    bodies = bodies_of_blocks(MATERIAL, MATERIAL, sizes, degree=4, heat={})
    body = bodies.heat[1]
    rows: list[Row] = []
    lines: list[Line] = []
    amplitudes, lags = [], []
    unit = flux / math.sqrt(K * RHO_C * omega)
    for steps in (50, 100, 200, 400):
        dt = 2 * math.pi / omega / steps
        step = body.step(0.0, dt)
        response = step.respond(body.load(np.full(len(body.surface.weights), flux))[:, None])[:, 0]
        theta, surface = body.initial(), []
        for n in range(1, periods * steps + 1):
            theta = step.advance(theta) + response * math.cos(omega * n * dt)
            surface.append(body.contact(theta)[0])
        times, last = dt * np.arange(1, len(surface) + 1)[-steps:], np.array(surface)[-steps:]
        basis = np.stack([np.cos(omega * times), np.sin(omega * times), np.ones(steps), times], axis=1)
        (c, s, *_), *_ = np.linalg.lstsq(basis, last, rcond=None)
        discrete = flux / np.sqrt(K * RHO_C * (1 - np.exp(-1j * omega * dt)) / dt)
        rows.append(
            number(f"{steps} steps a period: amplitude of implicit Euler (K)", abs(discrete), math.hypot(c, s), 2e-3)
        )
        amplitudes.append(math.hypot(c, s))
        lags.append(math.degrees(math.atan2(s, c)))
        if steps == 400:
            phase = np.degrees(omega * (times - times[0] + dt))
            lines = [
                Line("fenwear", phase[::10], last[::10]),
                Line("exact", phase, unit * np.cos(omega * times - np.pi / 4), reference=True),
            ]
    # Of first order in the step: what two steps extrapolate to.
    rows.append(number("amplitude extrapolated to no step (K)", unit, 2 * amplitudes[-1] - amplitudes[-2], 2e-3))
    rows.append(number("lag extrapolated to no step (degrees)", 45, 2 * lags[-1] - lags[-2], 2e-3))
    rows.append(order("lag: order in the time step", 1, np.abs(np.array(lags) - 45).tolist(), 0.15))
    plot = Plot(
        "Periodic flux: surface temperature in the sixth period",
        "phase of the flux (degrees)",
        "temperature (K)",
        lines,
    )
    return Result(rows, [plot])


def plug_flow(x: Array, peclet: float) -> Array:
    """Return (theta - theta_in) rho c v H / (q L) of material that enters at x = 0 and leaves at L, x over L.

    rho c v theta' = k theta'' + q/H with k theta' = rho c v (theta - theta_in) at x = 0 and theta' = 0 at x = L,
    for v L / a = peclet: x + (1 - e^(peclet (x - 1))) / peclet (Danckwerts, Continuous flow systems, 1953).
    """
    return np.asarray(x + (1 - np.exp(peclet * (x - 1))) / peclet)


@verification(
    "open-strip",
    "A strip with free ends: new material enters, is heated, and carries the heat away",
    "P. V. Danckwerts, Continuous flow systems, Chem. Eng. Sci. 2, 1953: conditions at inflow and outflow",
)
def open_strip() -> Result:
    """Even heat q on a strip 1 mm long and so thin that it is as warm below as above, insulated elsewhere.

    The steady state, and marching to it from a temperature far off, in both directions.
    """
    entering, flux, height = 20.0, 5.0, 1e-3
    sizes = {"strip_height": height, "across": 32, "strip_layers": 1, "punch_layers": 1}
    bodies = bodies_of_blocks(MATERIAL, MATERIAL, sizes, degree=3, heat={"ambient": AMBIENT, "inflow": entering})
    body, new = bodies.heat[1], Surroundings(renewed=True)
    along = contact_abscissae(body) + 0.5
    load = body.load(np.full(len(body.surface.weights), flux))[:, None]
    rows: list[Row] = []
    lines: list[Line] = []
    for peclet in (0.1, 1.0, 10.0, 50.0):
        for d in (1, -1):
            speed = peclet * K / RHO_C
            rise = flux / (height * RHO_C * speed)
            x = along if d > 0 else 1 - along
            exact = plug_flow(x, peclet)
            case = f"v L / a = {peclet:g}, {'rightward' if d > 0 else 'leftward'}"
            step = body.step(d * speed, math.inf, new)
            steady = step.advance(body.initial()) + step.respond(load)[:, 0]
            found = (body.contact(steady) - entering) / rise
            rows.append(profile(f"{case}: rise / (q L / rho c v H)", exact, found, 1e-4, scale=exact.max()))
            step = body.step(d * speed, 0.2 / speed, new)
            theta, heating = np.full(body.owned, -300.0), step.respond(load)[:, 0]
            for _ in range(400):
                theta = step.advance(theta) + heating
            apart = body.contact(theta - steady) / rise
            rows.append(profile(f"{case}: after 80 renewals", np.zeros_like(apart), apart, 1e-6))
            if d > 0:
                lines += [
                    Line(f"fenwear, v L / a = {peclet:g}", x, found / exact.max()),
                    Line(f"Danckwerts, v L / a = {peclet:g}", x, exact / exact.max(), reference=True),
                ]
    return Result(rows, [Plot("Open strip: rise along it", "x / L", "rise over its largest", lines)])
