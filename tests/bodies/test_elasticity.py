"""Linear elasticity of one body: patch test, rigid modes, loads and supports."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, Literal

import basix.ufl
import dolfinx.fem.petsc
import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx.mesh import CellType, Mesh, create_rectangle, locate_entities_boundary, meshtags
from mpi4py import MPI

from fenwear import CaseError, Tribosystem, assemble, load_case
from fenwear.bodies.distributed_mesh import BodyMesh, build_meshes
from fenwear.bodies.elastic_material import Isotropic, lame, region_field, strain
from fenwear.common.compat import interpolation_points
from fenwear.system import elastic_body

Plane = Literal["stress", "strain"]
COMM = MPI.COMM_WORLD


def solve(mesh: Mesh, degree: int, exact: Any, force: Any, moduli: Any) -> fem.Function:
    """Solve -div sigma = force with u = exact on the whole boundary, by LU."""
    V = fem.functionspace(mesh, basix.ufl.element("Lagrange", mesh.basix_cell(), degree, shape=(2,)))
    u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    boundary = fem.Function(V)
    boundary.interpolate(fem.Expression(exact, interpolation_points(V)))
    facets = locate_entities_boundary(mesh, 1, lambda x: np.full(x.shape[1], True))
    bc = fem.dirichletbc(boundary, fem.locate_dofs_topological(V, 1, facets))
    a = ufl.inner(Isotropic("solid", moduli, 0.0).stress(u), strain(v)) * ufl.dx
    options = {"ksp_type": "preonly", "pc_type": "lu", "pc_factor_mat_solver_type": "mumps"}
    # Required from dolfinx 0.10 on, not known before.
    known = "petsc_options_prefix" in inspect.signature(fem.petsc.LinearProblem).parameters
    prefix = {"petsc_options_prefix": "fenwear_exact_"} if known else {}
    problem = fem.petsc.LinearProblem(a, ufl.inner(force, v) * ufl.dx, bcs=[bc], petsc_options=options, **prefix)
    return problem.solve()


def norm(expression: Any) -> float:
    square = fem.assemble_scalar(fem.form(ufl.inner(expression, expression) * ufl.dx(degree=12)))
    return float(np.sqrt(COMM.allreduce(square)))


@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.mpi
def test_patch_of_two_materials(plane: Plane) -> None:
    """Two layers under uniform stress across their joint: piecewise linear displacement, exact at any degree."""
    pressure, layers = 7.0, {"lower": (100.0, 0.3), "upper": (400.0, 0.3)}
    mesh = create_rectangle(COMM, [(0, 0), (2, 2)], (3, 4), CellType.quadrilateral)
    cells = np.arange(mesh.topology.index_map(2).size_local + mesh.topology.index_map(2).num_ghosts, dtype=np.int32)
    z = dolfinx.mesh.compute_midpoints(mesh, 2, cells)[:, 1]
    body = BodyMesh("punch", mesh, meshtags(mesh, 2, cells, np.where(z < 1, 1, 2).astype(np.int32)),
                    meshtags(mesh, 1, cells[:0], cells[:0]), {"lower": 1, "upper": 2}, {}, {})  # fmt: skip
    young, nu = (region_field(body, {name: m[i] for name, m in layers.items()}) for i in (0, 1))
    # Confined sideways: eps_zz = sigma_zz (1 - nu²) / E in plane stress; (1 + nu)(1 - 2 nu) / ((1 - nu) E) in strain.
    confined = 1 - 0.3**2 if plane == "stress" else 1.3 * 0.4 / 0.7
    x = ufl.SpatialCoordinate(mesh)
    low, high = (-pressure * confined / layers[name][0] for name in ("lower", "upper"))
    exact = ufl.as_vector((0 * x[0], ufl.conditional(x[1] < 1, low * x[1], low + high * (x[1] - 1))))
    u = solve(mesh, 1, exact, fem.Constant(mesh, np.zeros(2)), lame(young, nu, plane))
    sigma = Isotropic(plane, lame(young, nu, plane), 0.0).stress(u)
    assert norm(u - exact) < 1e-12
    assert norm(sigma[1, 1] + pressure) < 1e-10


def test_lame_against_the_compliance() -> None:
    """Hooke's law inverted: uniaxial stress gives sigma / E along and -nu sigma / E across (plane stress)."""
    young, nu = 2e5, 0.3
    lmbda, mu = lame(young, nu, "stress")
    stiffness = np.array([[lmbda + 2 * mu, lmbda], [lmbda, lmbda + 2 * mu]])
    assert np.linalg.solve(stiffness, [1, 0]) == pytest.approx([1 / young, -nu / young], rel=1e-13)
    lmbda, mu = lame(young, nu, "strain")  # and with sigma_yy = nu sigma across the plane
    stiffness = np.array([[lmbda + 2 * mu, lmbda], [lmbda, lmbda + 2 * mu]])
    along, across = (1 - nu**2) / young, -nu * (1 + nu) / young
    assert np.linalg.solve(stiffness, [1, 0]) == pytest.approx([along, across], rel=1e-13)


@pytest.mark.parametrize(
    ("name", "settings", "names"),
    [
        ("example1", (), ("lambda_F", "lambda_M")),
        ("example2", (), ("lambda_F",)),
        ("example2", ("punch.supports.0.fix=['x', 'z']",), ()),
        ("example1", ("punch.supports.0.fix=['x', 'z']", "punch.loads.0.force=[100, -1e4]"), ("lambda_M",)),
    ],
)
@pytest.mark.mpi
def test_rigid_modes(name: str, settings: tuple[str, ...], names: tuple[str, ...]) -> None:
    """What the supports leave free: a pin lets the punch fall and tilt, hinges let it fall, a clamp nothing.

    lambda_F lifts the pin by 1 mm; lambda_M turns about the pin O = (30, 120), u = (z - 120, -(x - 30)).
    """
    case = load_case(name, [*settings, "geometry.parameters.elements_along_contact=4"])
    mesh, _ = build_meshes(case.geometry, None, COMM)
    body = elastic_body(case, mesh, case.punch)
    assert tuple(body.mode_names) == names
    x = body.space.tabulate_dof_coordinates()[: body.space.dofmap.index_map.size_local]
    expected = {
        "lambda_F": np.stack([0 * x[:, 0], 1 + 0 * x[:, 0]], axis=1),
        "lambda_M": np.stack([x[:, 1] - 120, 30 - x[:, 0]], axis=1),
    }
    for mode, which in zip(body.rigid_modes, names, strict=True):
        np.testing.assert_allclose(mode.reshape(-1, 2), expected[which], atol=1e-9)


def test_pivot_is_a_choice_of_coordinates(assembled: Callable[..., Tribosystem]) -> None:
    """Another O changes lambda_F by lambda_M times the distance, and no pressure."""
    at_pin = assembled("monotonic-lz20")
    at_centre = assembled("monotonic-lz20", "punch.pivot=[0, 120]")
    for d in (1, -1):
        pin, centre = at_pin.optimum(d), at_centre.optimum(d)
        np.testing.assert_allclose(pin.pressure, centre.pressure, rtol=1e-12)
        assert pin.velocity["lambda_M"] == pytest.approx(centre.velocity["lambda_M"], rel=1e-10)
        shifted = centre.velocity["lambda_F"] - 30 * centre.velocity["lambda_M"]
        assert pin.velocity["lambda_F"] == pytest.approx(shifted, rel=1e-10)


def test_traction_and_force_are_the_same_load(assembled: Callable[..., Tribosystem]) -> None:
    """10 kN on 60 mm x 10 mm is 16.666... MPa; the resultant per thickness is 1000 N/mm."""
    force = assembled("example1")
    traction = assembled("example1", f"punch.loads=[{{on='punch_load', traction=[0, {-1e4 / 600!r}]}}]")
    assert traction.rigid.resultant == pytest.approx(force.rigid.resultant, rel=1e-12)
    assert force.rigid.resultant[0] == pytest.approx(-1000, rel=1e-12)
    assert force.rigid.mean_pressure == pytest.approx(1e4 / 600, rel=1e-12)


def test_a_support_at_a_point_is_the_same_as_on_its_group(assembled: Callable[..., Tribosystem]) -> None:
    """`at` the pin's coordinates finds the pin's node."""
    named = assembled("example1", "geometry.degree=2")
    placed = assembled("example1", "geometry.degree=2", "punch.supports.0={at=[30, 120], fix=['x']}")
    np.testing.assert_array_equal(placed.elastic.interface.dense(), named.elastic.interface.dense())
    assert tuple(placed.bodies.punch.pivot) == tuple(named.bodies.punch.pivot) == (30, 120)


def test_a_support_off_the_body_is_refused() -> None:
    """A point between nodes, or of the other body, holds nothing."""
    with pytest.raises(CaseError, match=r"punch\.supports\.0\.at"):
        assemble(load_case("example1", ["punch.supports.0={at=[0, 50], fix=['x']}"]))
