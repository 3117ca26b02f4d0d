"""Conduction in one body against exact waves: as near to them as the elements can be."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
import ufl
from dolfinx import fem

from fenwear.common.arrays import Array
from fenwear.heat.conduction import HeatBody

Make = Callable[..., Any]
K, RHO_C, AMBIENT, HEAT_TRANSFER = 3.0, 2.0, 7.0, 4.0
MATERIAL = {"young": 1.0, "poisson": 0.3, "conductivity": K, "heat_capacity": RHO_C / 0.5, "density": 0.5}


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
    load = body.load(K * (slope * np.exp(1j * m * top)).real)
    return step.advance(wave(x, z, m, beta, 1.0 + 0j, np)) + step.respond(load[:, None])[:, 0]


@pytest.mark.parametrize("degree", [1, 2, 3, 4])
@pytest.mark.parametrize(
    ("velocity", "duration"),
    [
        (0.0, math.inf),
        (3.0, math.inf),
        pytest.param(-150.0, math.inf, marks=pytest.mark.mpi("-150.0-inf-2")),
        (0.0, 0.1),
        pytest.param(150.0, 0.02, marks=pytest.mark.mpi("150.0-0.02-3")),
    ],
)
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


@pytest.mark.mpi
def test_insulated_sides_lose_nothing(rectangle: Make, conducting: Make) -> None:
    """A column that loses heat at its bottom alone: ambient + q (1 / h + z / k) everywhere, all that enters is lost.

    And one that loses none there either has no steady state.
    """
    heat = {"convection": HEAT_TRANSFER, "ambient": AMBIENT, "convecting_faces": False}
    body = conducting(rectangle(), 2, [MATERIAL], heat, insulated=["strip_sides"])
    top = coordinates(body)[0][coordinates(body)[1] > 1 - 1e-9]
    top = np.sort(np.concatenate(body.body.mesh.comm.allgather(top)))
    step = body.step(0.0, math.inf)
    load = body.load(np.full(len(top), 5.0))
    theta = step.advance(np.zeros(body.owned)) + step.respond(load[:, None])[:, 0]
    np.testing.assert_allclose(theta, AMBIENT + 5.0 * (1 / HEAT_TRANSFER + coordinates(body)[1] / K), rtol=1e-12)
    lost = body.body.mesh.comm.allreduce(float(body.convected @ (theta - AMBIENT)))
    assert lost == pytest.approx(5.0, rel=1e-12)
    assert not conducting(rectangle(), 1, [MATERIAL], heat, insulated=["strip_sides", "strip_bottom"]).loses_heat()
