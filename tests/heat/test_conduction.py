"""Conduction in one body against exact solutions: in space, in time, with moving material; thermal strain."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from typing import Any, Literal

import numpy as np
import pytest
import ufl
from dolfinx import fem
from scipy.integrate import quad
from scipy.special import k0e

from fenwear.arrays import Array
from fenwear.elasticity import ElasticBody, stress
from fenwear.heat.conduction import HeatBody
from fenwear.surface import condense, surface_nodes

Make = Callable[..., Any]
K, RHO_C, AMBIENT, HEAT_TRANSFER = 3.0, 2.0, 7.0, 4.0
MATERIAL = {"young": 1.0, "poisson": 0.3, "conductivity": K, "heat_capacity": RHO_C / 0.5, "density": 0.5}
STEEL = {"young": 2e5, "poisson": 0.3, "conductivity": 55.0, "heat_capacity": 4.6e8, "density": 7.8e-9}


def coordinates(body: HeatBody) -> Array:
    return body.space.tabulate_dof_coordinates()[: body.owned, :2].T


def norms(body: HeatBody, theta: Array, exact: Callable[[Any, Any], Any]) -> tuple[float, ...]:
    """Return the L2 norms of the error and of its gradient."""
    found = fem.Function(body.space)
    found.x.array[: body.owned] = theta
    found.x.scatter_forward()
    x = ufl.SpatialCoordinate(body.body.mesh)
    error = found - exact(x[0], x[1])
    forms = (ufl.inner(e, e) * ufl.dx(degree=14) for e in (error, ufl.grad(error)))
    comm = body.body.mesh.comm
    return tuple(math.sqrt(comm.allreduce(fem.assemble_scalar(fem.form(form)))) for form in forms)


def wave(x: Any, z: Any, m: float, beta: complex, factor: complex, module: Any) -> Any:
    """Return ambient + Re[factor e^{imx} (e^{beta (z - 1)} + B e^{-beta (z + 1)})], which convects at z = 0."""
    total = AMBIENT
    for amplitude, rate in ((1.0, beta), (_reflected(beta), -beta)):
        c = factor * amplitude * np.exp(-beta)
        phase = m * x + rate.imag * z
        total += module.exp(rate.real * z) * (c.real * module.cos(phase) - c.imag * module.sin(phase))
    return total


def _reflected(beta: complex) -> complex:
    return (K * beta - HEAT_TRANSFER) / (K * beta + HEAT_TRANSFER)


def end_of_wave_step(
    body: HeatBody, m: float, beta: complex, factor: complex, velocity: float, duration: float
) -> Array:
    """Return the end of a step from the wave with factor 1: held on its sides, with the wave's flux at z = 1."""
    x, z = coordinates(body)
    body.held_values = wave(x, z, m, beta, factor, np)[body.held]
    step = body.step(velocity, duration)
    top = np.sort(np.concatenate(body.body.mesh.comm.allgather(x[z > 1 - 1e-9])))
    slope = factor * beta * (1 - _reflected(beta) * np.exp(-2 * beta))
    load = body.place(body.weights * K * (slope * np.exp(1j * m * top)).real)
    return step.advance(wave(x, z, m, beta, 1.0 + 0j, np)) + step.respond(load[:, None])[:, 0]


@pytest.mark.parametrize("degree", [1, 2, 3, 4])
@pytest.mark.parametrize(
    ("velocity", "duration"), [(0.0, math.inf), (3.0, math.inf), (-150.0, math.inf), (0.0, 0.1), (150.0, 0.02)]
)
@pytest.mark.mpi
def test_order_in_space(rectangle: Make, conducting: Make, degree: int, velocity: float, duration: float) -> None:
    """Verification 1: L2 order degree + 1, H1 order degree, at rest and at cell Peclet numbers above 10.

    With i m v + (1 - 1/g) / dt = a (beta² - m²) - 2 h / (t rho c) the wave is an exact solution of an
    implicit Euler step from factor 1 to g, and of the steady state: flux at the contact, convection
    at the bottom and on the faces, ambient temperature, held sides; nothing is added to the equations.
    """
    m, thickness = 3.0, 20.0
    diffusivity, loss = K / RHO_C, 2 * HEAT_TRANSFER / thickness / RHO_C
    if math.isinf(duration):
        beta, factor = np.sqrt(m**2 + (1j * m * velocity + loss) / diffusivity), 1.0 + 0j
    else:
        beta = 2.0 + 1.5j
        factor = 1 / (1 - duration * (diffusivity * (beta**2 - m**2) - loss - 1j * m * velocity))
    heat = {"convection": HEAT_TRANSFER, "ambient": AMBIENT}
    exact = partial(wave, m=m, beta=complex(beta), factor=complex(factor))
    errors = []
    for count in {1: (96, 192), 2: (12, 24), 3: (12, 24), 4: (12, 24)}[degree]:
        body = conducting(
            rectangle(cells=(count, count)), degree, [MATERIAL], heat, thickness, temperatures=[{"on": "strip_sides"}]
        )
        theta = end_of_wave_step(body, m, complex(beta), complex(factor), velocity, duration)
        errors.append(norms(body, theta, partial(exact, module=ufl)))
        best = norms(body, exact(*coordinates(body), module=np), partial(exact, module=ufl))  # of the interpolant
        assert (np.divide(errors[-1], best) < (5, 1.4)).all()
    assert np.log2(np.divide(*errors)) == pytest.approx([degree + 1, degree], abs=0.35)


def relaxation(conducting: Make, mesh: Any, degree: int, duration: float, steps: int) -> float:
    """Return by how much steps without any flux shrink sin(pi x) cos(pi z), held on the sides, insulated elsewhere."""
    body = conducting(mesh, degree, [MATERIAL], temperatures=[{"on": "strip_sides"}])
    x, z = coordinates(body)
    mode = np.sin(np.pi * x) * np.cos(np.pi * z)
    theta, step = mode, body.step(0.0, duration)
    for _ in range(steps):
        theta = step.advance(theta)
    total = body.body.mesh.comm.allreduce
    return total(float(mode @ body.store(theta))) / total(float(mode @ body.store(mode)))


@pytest.mark.mpi
def test_order_in_time(rectangle: Make, conducting: Make) -> None:
    """Verification 1: implicit Euler divides a mode by exactly 1 + rate dt, and so is of first order in time."""
    rate, end, mesh = 2 * np.pi**2 * K / RHO_C, 0.05, rectangle(cells=(8, 8))
    errors = []
    for steps in (10, 20, 40):
        shrunk = relaxation(conducting, mesh, 4, end / steps, steps)
        assert shrunk == pytest.approx((1 + rate * end / steps) ** -steps, rel=1e-6)
        errors.append(shrunk - math.exp(-rate * end))
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx([1, 1], abs=0.1)


def test_periodic_flux_on_a_half_space(rectangle: Make, conducting: Make) -> None:
    """Verification 12, Carslaw and Jaeger 2.6: amplitude q0 / sqrt(k rho c omega), lag 45 degrees.

    An implicit Euler step has s = (1 - e^{-i omega dt}) / dt for i omega: exactly q0 / sqrt(k rho c s).
    """
    omega, flux, periods = 10.0, 2.0, 6
    depth = 10 * math.sqrt(2 * K / (RHO_C * omega))
    body = conducting(rectangle(0.5, depth, (1, 20)), 4, [MATERIAL])
    amplitudes, lags = [], []
    for steps in (50, 100, 200):
        dt = 2 * math.pi / omega / steps
        step = body.step(0.0, dt)
        response = step.respond(body.place(body.weights * flux)[:, None])[:, 0]
        theta, surface = body.initial(), []
        for n in range(1, periods * steps + 1):
            theta = step.advance(theta) + response * math.cos(omega * n * dt)
            surface.append(body.contact_rows @ theta)
        times = dt * np.arange(1, len(surface) + 1)[-steps:]
        basis = np.stack([np.cos(omega * times), np.sin(omega * times), np.ones(steps), times], axis=1)
        (c, s, *_), *_ = np.linalg.lstsq(basis, np.array(surface)[-steps:, 0], rcond=None)
        discrete = flux / np.sqrt(K * RHO_C * (1 - np.exp(-1j * omega * dt)) / dt)
        assert c - 1j * s == pytest.approx(discrete, rel=2e-3)
        amplitudes.append(math.hypot(c, s) / (flux / math.sqrt(K * RHO_C * omega)))
        lags.append(math.degrees(math.atan2(s, c)))
    assert amplitudes[-1] == pytest.approx(1, abs=5e-3)
    assert lags[-1] == pytest.approx(45, abs=0.6)
    assert np.diff(lags)[0] / np.diff(lags)[1] == pytest.approx(2, abs=0.3)  # of first order in time


def jaeger(x: float, half_width: float, speed: float, diffusivity: float) -> float:
    """Return the surface rise k theta / q of a band source on a half-plane that moves to +x, by quadrature.

    (1 / pi) times the integral over the source of e^u K0(|u|), u = v (x - x') / (2 a); Carslaw and Jaeger 10.7.
    """
    scale = speed / (2 * diffusivity)

    def kernel(u: float) -> float:
        return float(k0e(abs(u)) * (1.0 if u > 0 else math.exp(2 * u)))

    low, high = scale * (x - half_width), scale * (x + half_width)
    ends = [low, *(p for p in (-1.0, 0.0, 1.0) if low < p < high), high]
    parts = pairwise(ends)
    return sum(quad(kernel, a, b, limit=200)[0] for a, b in parts) / (math.pi * scale)


@pytest.mark.parametrize("peclet", [1.0, 10.0, 200.0])
@pytest.mark.parametrize("direction", [1, -1])
def test_moving_band_source(assemble: Make, peclet: float, direction: int) -> None:
    """Verification 13, Jaeger 1942: the profile of his integral, and the largest rise of his formula for Pe > 10.

    Example 1's strip, whose far ends and bottom stay cold, on Example 1's mesh.
    """
    system = assemble(
        "example1-heat",
        "heat.convection=0",
        "geometry.parameters.growth=0.3",
        "geometry.parameters.strip_height=2000",
        "geometry.parameters.strip_length=20000",
    )
    body, half_width, diffusivity = system.heat_bodies[1], 30.0, 55 / (7.8e-9 * 4.6e8)
    speed = 2 * diffusivity * peclet / half_width
    step = body.step(direction * speed, math.inf)
    rise = (body.contact_rows @ step.respond(body.place(body.weights)[:, None]))[:, 0] * 55
    exact = np.array([jaeger(direction * x, half_width, speed, diffusivity) for x in system.facing.x])
    inner = np.abs(system.facing.x) < 29.9
    np.testing.assert_allclose(rise[inner], exact[inner], rtol=0, atol=0.005 * exact.max())
    if peclet >= 10:
        published = 2 * math.sqrt(2 * half_width * diffusivity / (math.pi * speed))
        assert rise.max() == pytest.approx(published, rel=0.01 if peclet > 100 else 0.03)


@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.mpi
def test_thermal_strain(
    rectangle: Make, elastic: Make, conducting: Make, degree: int, plane: Literal["stress", "strain"]
) -> None:
    """Verification 1: u = grad phi with phi = sin² pi x sin² pi z in a clamped square, of orders degree + 1 and degree.

    By Goodier's potential laplace phi = (1 + nu) alpha theta in plane stress, (1 + nu) / (1 - nu) alpha theta in
    plane strain, the thermal stress needs no further force.
    """
    nu, alpha = 0.3, 1e-3
    material = {**MATERIAL, "young": 130.0, "poisson": nu, "expansion": alpha}
    factor = (1 + nu) * alpha / (1 if plane == "stress" else 1 - nu)
    errors = []
    for count in (10, 20):
        mesh = rectangle(cells=(count, count))
        every = [{"on": g, "fix": ["x", "z"]} for g in mesh.curves]
        body, materials = elastic(mesh, degree, [material], plane, supports=every)
        heat = conducting(mesh, degree, [material])
        x, z = coordinates(heat)
        s, t, c, d = np.sin(np.pi * x) ** 2, np.sin(np.pi * z) ** 2, np.cos(2 * np.pi * x), np.cos(2 * np.pi * z)
        theta = 2 * np.pi**2 * (c * t + s * d) / factor
        u = displacement(body, heat, theta, materials)
        X, Z = ufl.SpatialCoordinate(mesh.mesh)
        sin, pi = ufl.sin, np.pi
        exact = pi * ufl.as_vector((sin(2 * pi * X) * sin(pi * Z) ** 2, sin(pi * X) ** 2 * sin(2 * pi * Z)))
        forms = (ufl.inner(e, e) * ufl.dx(degree=12) for e in (u - exact, ufl.grad(u - exact)))
        errors.append([math.sqrt(mesh.mesh.comm.allreduce(fem.assemble_scalar(fem.form(f)))) for f in forms])
    assert np.log2(np.divide(*errors)) == pytest.approx([degree + 1, degree], abs=0.2)


def displacement(body: ElasticBody, heat: HeatBody, theta: Array, materials: Any) -> fem.Function:
    """Return the displacement under a temperature alone."""
    coupling = body.thermal_coupling(heat.space, materials)
    field, force, solution = coupling.createVecRight(), coupling.createVecLeft(), coupling.createVecLeft()
    field.array[:] = theta
    coupling.mult(field, force)
    body.factor.solve(force, solution)
    u = fem.Function(body.space)
    u.x.array[: len(solution.array_r)] = solution.array_r
    u.x.scatter_forward()
    return u


PINS = [{"at": [0, 0], "fix": ["x", "z"]}, {"at": [8, 0], "fix": ["z"]}]  # of a bar 8 mm long


@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.mpi
def test_free_expansion(rectangle: Make, elastic: Make, conducting: Make, plane: Literal["stress", "strain"]) -> None:
    """Verification 2: a bar under a temperature linear in x and z expands without any stress; exact at degree 2.

    u_x = a (t0 x + tx (x² - z²) / 2 + tz x z) and its like along z, a = alpha, in plane strain (1 + nu) alpha.
    """
    nu, alpha, (t0, tx, tz) = 0.3, 1e-5, (50.0, 3.0, -20.0)
    material = {**MATERIAL, "young": 2e5, "poisson": nu, "expansion": alpha}
    a = alpha if plane == "stress" else (1 + nu) * alpha
    mesh = rectangle(8.0, 1.0, (8, 2))
    body, materials = elastic(mesh, 2, [material], plane, supports=PINS)
    heat = conducting(mesh, 2, [material])
    x, z = coordinates(heat)
    u = displacement(body, heat, t0 + tx * x + tz * z, materials)
    exact = [t0 * x + tx * (x**2 - z**2) / 2 + tz * x * z, t0 * z + tz * (z**2 - x**2) / 2 + tx * x * z]
    turn = -tz * 8 / 2  # the rotation that the second pin prevents
    expected = a * np.stack([exact[0] + turn * z, exact[1] - turn * x], axis=1)
    nodal = u.x.array.reshape(-1, 2)[: len(x)]
    np.testing.assert_allclose(nodal, expected, rtol=0, atol=1e-10 * a * t0 * 8)
    X, Z = ufl.SpatialCoordinate(mesh.mesh)
    # Of the stress in the plane: gamma theta is what a clamped bar would bear.
    gamma = 2e5 * alpha / (1 - nu) if plane == "stress" else 2e5 * alpha / (1 - 2 * nu)
    remaining = stress(u, *body.lame) - gamma * (t0 + tx * X + tz * Z) * ufl.Identity(2)
    square = fem.assemble_scalar(fem.form(ufl.inner(remaining, remaining) * ufl.dx))
    assert math.sqrt(mesh.mesh.comm.allreduce(square)) < 1e-9 * gamma * t0


@pytest.mark.parametrize(("m", "n", "poisson"), [(1.0, 1.0, 0.3), (0.5, 4.0, 0.3), (3.0, 0.2, 0.1)])
@pytest.mark.mpi
def test_bimetal_strip(rectangle: Make, elastic: Make, conducting: Make, m: float, n: float, poisson: float) -> None:
    """Verification 2, Timoshenko 1925: curvature 6 (a1 - a2) dT (1 + m)² / (h (3 (1 + m)² + (1 + mn)(m² + 1/(mn)))).

    m and n are the ratios of height and modulus of the lower to the upper layer. Plane stress; away from
    the ends the beam's curvature is exact, also where Poisson's ratios differ.
    """
    height, warming, expansions = 1.0, 40.0, (3e-5, 1e-5)
    lower = height * m / (1 + m)
    materials = [
        {**MATERIAL, "young": 1e5 * n, "poisson": 0.3, "expansion": expansions[0]},
        {**MATERIAL, "young": 1e5, "poisson": poisson, "expansion": expansions[1]},
    ]
    mesh = rectangle(8.0, height, (32, 12), [lower])
    body, known = elastic(mesh, 3, materials, "stress", supports=PINS)
    heat = conducting(mesh, 3, materials)
    nodes = surface_nodes(body)
    surface = condense(body, nodes, body.thermal_coupling(heat.space, known))
    rows = surface.normal_by_temperature
    assert rows is not None
    deflection = mesh.mesh.comm.allreduce(rows @ np.full(heat.owned, warming))
    middle = np.abs(nodes.x[:, 0] - 4) < 1
    curvature = 2 * np.polyfit(nodes.x[middle, 0] - 4, deflection[middle], 2)[0]
    bending = 3 * (1 + m) ** 2 + (1 + m * n) * (m**2 + 1 / (m * n))
    timoshenko = 6 * (expansions[0] - expansions[1]) * warming * (1 + m) ** 2 / (height * bending)
    # The lower layer expands more, the ends rise: e_n points up.
    assert curvature == pytest.approx(timoshenko, rel=1e-5)
