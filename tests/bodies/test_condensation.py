"""Static condensation of the bodies onto their contact nodes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import ufl
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from fenwear import Tribosystem, assemble, load_case
from fenwear.bodies import supports
from fenwear.bodies.condensation import CondensedBody, condense
from fenwear.bodies.elasticity import ElasticBody
from fenwear.common.arrays import Array

SMALL = ("geometry.parameters.elements_along_contact=8",)


def solve_directly(body: ElasticBody, traction: Callable[[ufl.SpatialCoordinate], ufl.core.expr.Expr]) -> Array:
    """Return the displacement under a traction on the contact, integrated consistently, by CG."""
    x = ufl.SpatialCoordinate(body.body.mesh)
    force = body.surface_integral(traction(x), body.body.curves[f"{body.body.name}_contact"])
    force[body.supported] = 0.0
    ksp = PETSc.KSP().create(body.stiffness.comm)
    ksp.setOperators(body.stiffness)
    ksp.setType("cg")
    ksp.pc.setType("jacobi" if body.body.mesh.comm.size > 1 else "icc")
    ksp.setTolerances(rtol=1e-13, max_it=20_000)
    right, solution = body.stiffness.createVecs()
    right.array[:] = force
    ksp.solve(right, solution)
    assert ksp.getConvergedReason() > 0
    return solution.array_r.copy()


UP = np.array([0.0, 1.0])


def condensed(body: ElasticBody) -> CondensedBody:
    """Condense a body onto its contact nodes, with forces along z."""
    return condense(body, body.surface.spread, np.broadcast_to(UP, body.surface.x.shape))


@pytest.mark.parametrize("name", ["punch", "strip"])
@pytest.mark.mpi("punch")
def test_compliance_is_symmetric_and_positive(assembled: Callable[..., Tribosystem], name: str) -> None:
    """Maxwell and Betti, and the work of any pressure is positive."""
    body = getattr(assembled("example1", *SMALL).bodies, name)
    matrix = condensed(body).response[:, 1, :, 0]
    np.testing.assert_allclose(matrix, matrix.T, rtol=0, atol=1e-14 * np.abs(matrix).max())
    assert np.linalg.eigvalsh(matrix).min() > 1e-6 * np.abs(matrix).max()


@pytest.mark.parametrize("every_axis", [False, True])
@pytest.mark.parametrize("kind", ["normal", "tangential"])
@pytest.mark.parametrize("name", ["punch", "strip"])
@pytest.mark.mpi("punch-normal-True", "strip-tangential-False")
def test_compliance_equals_a_direct_solve(
    assembled: Callable[..., Tribosystem], name: str, kind: str, every_axis: bool
) -> None:
    """The displacement along z under a traction along z or x, but for free motions, as solved by CG with its integral.

    Condensed along z alone, where it follows by symmetry, or along every axis. Lumping at Gauss-Lobatto
    nodes is exact for p of degree k - 1 (here 3).
    """
    body = getattr(assembled("example1", *SMALL).bodies, name)
    surface = body.surface

    def p(x):  # type: ignore[no-untyped-def]
        t = x / 30  # Legendre's polynomials of the second and third degree: in equilibrium on the punch
        return 5 * ((3 * t**2 - 1) / 2 + (5 * t**3 - 3 * t) / 2)

    axis = (0, 1) if kind == "normal" else (1, 0)
    direct = solve_directly(body, lambda x: ufl.as_vector([c * p(x[0]) for c in axis]))
    displacement = body.trace.pick(direct[:, None])[:, 1, 0]
    found = condense(body, surface.spread) if every_axis else condensed(body)
    moved = found.apply(np.outer(surface.weights * p(surface.x[:, 0]), axis))
    along = moved @ UP if every_axis else moved[:, 0]
    # Where a body is free its motion is measured elsewhere than at the nodes that hold it in the direct solution.
    rigid = np.stack([np.ones(len(along)), surface.x[:, 0]], axis=1) if body.mode_names else np.zeros((len(along), 0))
    apart = along - displacement
    apart -= rigid @ np.linalg.lstsq(rigid, apart, rcond=None)[0]
    np.testing.assert_allclose(apart, 0, rtol=0, atol=1e-8 * np.abs(displacement).max())


@pytest.mark.parametrize("every_axis", [False, True])
def test_operator(assembled: Callable[..., Tribosystem], every_axis: bool) -> None:
    """Products, some of its numbers and its diagonal are those of one matrix; of several forces at once, too."""
    body = assembled("example1", *SMALL).bodies.strip
    found = condense(body, body.surface.spread) if every_axis else condensed(body)
    every, n = slice(None), len(body.surface.x)
    whole = found.entries(every, every)
    assert whole.shape == (n, found.directions.shape[2], n, 2)
    forces = np.random.default_rng(1).uniform(-1, 1, (n, 2, 3))
    forces[3:7] = 0.0
    np.testing.assert_allclose(found.apply(forces), np.einsum("iajc,jck->iak", whole, forces), rtol=1e-11)
    np.testing.assert_allclose(found.apply(forces)[:, :, 1], found.apply(forces[:, :, 1]), rtol=1e-11)
    rows, columns = np.array([1, 5, 3]), np.array([2, 0])
    np.testing.assert_array_equal(found.entries(rows, columns), whole[rows][:, :, columns])
    np.testing.assert_array_equal(found.entries(rows, every), whole[rows])
    np.testing.assert_array_equal(found.diagonal(), np.einsum("iaic->iac", whole))


@pytest.mark.parametrize("degree", range(1, 9))
@pytest.mark.mpi("1", "3")
def test_weights_integrate_polynomials(assembled: Callable[..., Tribosystem], degree: int) -> None:
    """Gauss-Lobatto with degree + 1 nodes: exact up to degree 2 k - 1, positive; the interval is [-30, 30]."""
    nodes = assembled("example1", *SMALL, f"geometry.degree={degree}").bodies.punch.surface
    assert (nodes.weights > 0).all()
    xi = nodes.x[:, 0] / 30
    for power in range(2 * degree):
        exact = 60 / (power + 1) * (power % 2 == 0)
        assert nodes.weights @ xi**power == pytest.approx(exact, rel=1e-12, abs=1e-11)


@pytest.mark.parametrize("name", ["example1", "example2"])
def test_further_supports_carry_nothing(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The supports that make K regular are arbitrary: others give the same pressure and the same gap."""

    def solve() -> tuple[set[int], NDArray[np.float64], NDArray[np.float64]]:
        system = assemble(load_case(name, [*SMALL, "contact.friction=0.4", "geometry.parameters.pin_height_1=40"]))
        state = system.contact((1,)).solve(system.pair.initial_gap + 1e-4 * np.cos(system.pair.x))
        return set(system.bodies.punch.supported.tolist()), state.pressure, state.gap

    best_rows = supports._best_rows
    supported, pressure, gap = solve()
    assert (pressure == 0).any()
    assert gap.max() > 1e-6

    def other_rows(matrix: NDArray[np.float64], count: int, comm: MPI.Comm) -> list[int]:
        random = np.random.default_rng(3).uniform(0.01, 1, len(matrix)) ** 2
        return best_rows(matrix * random[:, None], count, comm)

    monkeypatch.setattr(supports, "_best_rows", other_rows)
    others, other_pressure, other_gap = solve()
    assert others != supported
    np.testing.assert_allclose(other_pressure, pressure, rtol=0, atol=1e-8 * pressure.max())
    np.testing.assert_allclose(other_gap, gap, rtol=0, atol=1e-8 * gap.max())
