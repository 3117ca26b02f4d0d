"""Contact surfaces of solids: weights, order of the nodes, normals, and forces on the trace."""

from __future__ import annotations

import basix
import numpy as np
import pytest
from mpi4py import MPI

from fenwear.bodies.contact_surface import ContactSurface, corner_functions, vertex_surface
from fenwear.bodies.distributed_mesh import build_meshes
from fenwear.bodies.elastic_material import isotropic
from fenwear.bodies.elasticity import ElasticBody
from fenwear.case import Body, Geometry, Material
from fenwear.surfaces.overlap import ChartedSurface, Patch, tabulate
from fenwear.surfaces.transfer import dual_transfer


def elastic(parameters: dict[str, float], degree: int, file: str = "solid_blocks.geo", order: int = 1) -> ElasticBody:
    """Return the punch of a ready geometry."""
    geometry = Geometry(file=file, parameters=parameters, degree=degree, order=order)
    mesh, _ = build_meshes(geometry, None, MPI.COMM_WORLD, "solid")
    regions, materials = {"punch_body": "steel"}, {"steel": Material(young=2e5, poisson=0.3)}
    supports = [{"on": "punch_far" if file == "solid_blocks.geo" else "punch_top", "fix": ["x", "y", "z"]}]
    description = Body.model_validate({"regions": regions, "supports": supports})
    return ElasticBody(mesh, description, isotropic(mesh, regions, materials, "solid"), degree)


@pytest.mark.parametrize(("tetrahedra", "degree"), [*((0, k) for k in (1, 2, 3, 4)), *((1, k) for k in (1, 2, 3))])
@pytest.mark.mpi("0-2", "1-3")
def test_flat_surface(tetrahedra: int, degree: int) -> None:
    """Positive weights that add up to the area, unit normals out of the body, nodes in the element's order."""
    surface = elastic({"width": 1.5, "across_x": 3, "punch_tetrahedra": tetrahedra}, degree).surface
    assert surface.cell == ("triangle" if tetrahedra else "quadrilateral")
    assert surface.weights.min() > 0
    assert surface.weights.sum() == pytest.approx(1.5, rel=1e-13)
    np.testing.assert_allclose(surface.outward, np.broadcast_to([0, 0, -1], surface.outward.shape), atol=1e-12)
    # A polynomial of the elements' degree, interpolated on each facet, is itself between the nodes.
    points, _ = basix.make_quadrature(basix.CellType[surface.cell], 5)
    corners = surface.trace[surface.facets[:, : 3 if tetrahedra else 4]]
    x = np.einsum("qc,fcd->fqd", corner_functions(surface.cell, points), corners)

    def polynomial(x: np.ndarray) -> np.ndarray:
        return np.asarray((x[..., 0] + 0.3 * x[..., 1] - 0.2) ** degree)

    nodal = polynomial(surface.trace)[surface.facets]
    found = np.einsum("qk,fk->fq", tabulate(surface.cell, degree, points), nodal)
    np.testing.assert_allclose(found, polynomial(x), atol=1e-13)


@pytest.mark.parametrize(("degree", "order"), [(1, 1), (2, 2), (3, 2)])
def test_normals_of_a_ball(degree: int, order: int) -> None:
    """The nodes lie on the ball and the normals point from its centre; flat facets are off by half their angle."""
    surface = elastic({"contact_width": 2}, degree, "ball_on_flat.geo", order).surface
    arm = surface.x - [0, 0, 5]
    distance = np.linalg.norm(arm, axis=1)
    np.testing.assert_allclose(distance, 5, atol=1e-11 if degree <= order else 1e-5)
    np.testing.assert_allclose(surface.outward, arm / distance[:, None], atol=0.5 * 0.25 / 5 if order == 1 else 1e-3)


def test_order_does_not_depend_on_ranks() -> None:
    """Trace nodes ascend by x, then y, then z."""
    trace = elastic({"across_x": 3, "across_y": 2}, 3).surface.trace.round(9)
    assert trace.tolist() == sorted(trace.tolist())


def triangles(degree: int) -> tuple[ContactSurface, ChartedSurface]:
    """Return triangles of different shapes in the plane z = 0 as a contact surface and in a chart."""
    points = np.array([[-1, -1], [0.2, -0.9], [1, -1.1], [-0.8, 0.1], [0.1, 0.3], [0.9, 0.2], [0, 1.2]])
    corners = np.array([[0, 1, 3], [1, 4, 3], [1, 2, 4], [2, 5, 4], [3, 4, 6], [5, 6, 4]])
    variant = basix.LagrangeVariant.gll_warped
    element = basix.create_element(basix.ElementFamily.P, basix.CellType.triangle, degree, variant)
    local = tabulate("triangle", 1, element.points) @ points[corners]
    s, facets = np.unique(local.reshape(-1, 2).round(12), axis=0, return_inverse=True)
    facets = facets.reshape(local.shape[:2])
    trace = np.column_stack([s, np.zeros(len(s))])
    surface = vertex_surface("punch", trace, facets, degree, np.broadcast_to([0.0, 0.0, 1.0], (len(facets), 3)))
    return surface, ChartedSurface(s, facets, "triangle", degree, surface.nodes)


def test_forces_on_quadratic_triangles() -> None:
    """A unit force at a vertex of one triangle goes to its six nodes in shares known in closed form."""
    trace = np.array([[0, 0, 0], [2, 0.3, 0], [0.4, 1, 0], [1.2, 0.65, 0], [0.2, 0.5, 0], [1, 0.15, 0]])
    facets = np.arange(6)[None]
    surface = vertex_surface("punch", trace, facets, 2, np.array([[0.0, 0.0, 1.0]]))
    # Vertices, then the middles of the edges opposite them.
    exact = np.concatenate([np.full((3, 3), -0.2) + 0.6 * np.eye(3), np.full((3, 3), 0.6) - 0.8 * np.eye(3)])
    np.testing.assert_allclose(surface.spread.toarray(), exact, atol=1e-14)
    np.testing.assert_allclose(surface.outward, [[0, 0, -1]] * 3)


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_forces_on_the_trace(degree: int) -> None:
    """Forces keep their sum and their moments, and do the work of the dual functions on the surface's own trace."""
    surface, charted = triangles(degree)
    spread = surface.spread
    assert spread.shape == (len(surface.trace), len(surface.nodes))
    np.testing.assert_allclose(spread.sum(axis=0), 1, rtol=1e-13)
    np.testing.assert_allclose(spread.T @ surface.trace, surface.x, atol=1e-13)
    np.testing.assert_allclose(spread.T.toarray(), dual_transfer([Patch.of(charted, charted)]).toarray(), atol=1e-12)


def test_no_pressure_on_the_axis() -> None:
    """At r = 0 the weight of a node is zero for degree 2 and more: it carries none; 2 pi r integrates to the area."""
    from fenwear import load_case
    from fenwear.system import place_case

    for degree in (1, 2, 3):
        sizes = ("inner_radius=0", "margin_inside=0", "strip_across=9")
        settings = [f"geometry.degree={degree}", *(f"geometry.parameters.{size}" for size in sizes)]
        case = load_case("ring-on-ring", settings)
        placed = place_case(case)
        pair = placed.pair
        assert len(pair.weights) == 12 * degree + (degree == 1)
        assert pair.weights.min() > 0
        assert pair.weights.sum() == pytest.approx(np.pi * 30**2, rel=1e-12)
        # Forces of a uniform pressure arrive on the other ring as those of a uniform pressure.
        strip = pair.strip
        np.testing.assert_allclose(
            pair.transfer.T @ pair.weights, strip.spread @ strip.weights, atol=1e-11 * strip.weights.max()
        )
