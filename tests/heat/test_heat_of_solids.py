"""Conduction in solids and rings: the same form as in the plane, seen from cases that one knows."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from dolfinx.mesh import CellType, create_box, create_rectangle
from mpi4py import MPI

from fenwear.bodies.distributed_mesh import own_mesh
from fenwear.bodies.elastic_material import Isotropic, Kind, lame
from fenwear.bodies.elasticity import ElasticBody
from fenwear.case import Body, Heat, Support, Track
from fenwear.common.arrays import Array
from fenwear.heat.closed_track import CELLS, TrackField, section_modes
from fenwear.heat.conduction import HeatBody, Surroundings
from fenwear.heat.fourier_law import ConductionLaw
from fenwear.heat.reduction import reduced_basis
from fenwear.heat.temperature import ReducedField
from fenwear.surfaces.sliding_field import SlidingField

K, RHO_C = 3.0, 2.0
TURNING = SlidingField(turn=(0.0, 0.0, 1.0))


def conducting(
    mesh: Any, kind: Kind, groups: dict[str, Callable[[Any], Any]], *held: str, convection: float = 0.0
) -> HeatBody:
    """Return conduction in a strip whose bottom holds it in place."""
    support = Support(on="bottom", fix=("x", "y", "z") if mesh.geometry.dim == 3 else ("x", "z"))
    description = Body(supports=(support,), temperatures=tuple({"on": name} for name in held))
    elastic = ElasticBody(own_mesh("strip", mesh, groups), description, Isotropic(kind, lame(1.0, 0.3, kind)), degree=2)
    return HeatBody(elastic, description, ConductionLaw(K, RHO_C), Heat(convection=convection))


def groups(dim: int) -> dict[str, Callable[[Any], Any]]:
    """Return contact at z = 1 and bottom at z = 0."""
    return {
        "strip_contact": lambda x: np.isclose(x[dim - 1], 1),
        "bottom": lambda x: np.isclose(x[dim - 1], 0),
    }


def fields(body: HeatBody, sliding: SlidingField, flux: Callable[[Array], Array], speed: float) -> list[Array]:
    """Return the contact temperatures of a steady state and of five steps under a flux."""
    around = Surroundings(sliding=sliding)
    load = body.load(flux(body.surface.x))[:, None]
    steady, step = body.step(speed, np.inf, around), body.step(speed, 0.01, around)
    theta, heating = body.initial(), step.respond(load)[:, 0]
    for _ in range(5):
        theta = step.advance(theta) + heating
    return [body.contact(steady.respond(load)[:, 0]), body.contact(theta)]


@pytest.mark.parametrize("angle", [0.0, np.pi / 2])
def test_a_slice_is_the_plane_model(angle: float) -> None:
    """A slice that nothing leaves through its sides: with sliding along x, or the whole turned to slide along y."""
    plane = conducting(
        create_rectangle(MPI.COMM_WORLD, [(0, 0), (2, 1)], (8, 4), CellType.quadrilateral),
        "strain",
        groups(2),
        "bottom",
    )
    along = 0 if angle == 0 else 1
    sizes, cells = [(2, 0.3, 1), (0.3, 2, 1)][along], [(8, 1, 4), (1, 8, 4)][along]
    box = create_box(MPI.COMM_WORLD, [(0, 0, 0), sizes], cells, CellType.hexahedron)
    solid = conducting(box, "solid", groups(3), "bottom")

    def flux(x: Array) -> Array:
        return 1 + np.sin(x[:, 0])

    direction = SlidingField(shift=(float(along == 0), float(along == 1), 0.0))
    found = fields(solid, direction, lambda x: flux(x[:, along:]), 20.0)
    for one, other in zip(found, fields(plane, SlidingField(shift=(1.0, 0.0, 0.0)), flux, 20.0), strict=True):
        at = np.interp(solid.surface.x[:, along], plane.surface.x[:, 0], other)
        np.testing.assert_allclose(one, at, rtol=0, atol=1e-9 * np.abs(other).max())


def test_a_ring_conducts_through_its_circumference() -> None:
    """theta = A ln(r / r_1) between held cylinders, the flux through each of them 2 pi r H k A / r: as the exact ring.

    With an even flux into the contact the ring's steady heat is that of its area: pi (r_2² - r_1²) q.
    """
    errors = []
    for count in (4, 8):
        mesh = create_rectangle(MPI.COMM_WORLD, [(1, 0), (3, 1)], (count, 2), CellType.quadrilateral)
        sides = {**groups(2), "inner": lambda x: np.isclose(x[0], 1), "outer": lambda x: np.isclose(x[0], 3)}
        body = conducting(mesh, "axisymmetric", sides, "inner", "outer")
        r = body.space.tabulate_dof_coordinates()[: body.owned, 0]
        body.held_values = np.log(r[body.held])
        theta = body.step(5.0, np.inf, Surroundings(sliding=TURNING)).advance(body.initial())
        errors.append(float(np.abs(theta - np.log(r)).max()))
    assert errors[1] < 1e-4
    assert np.log2(errors[0] / errors[1]) > 2.7  # degree 2
    assert not body.flow(TURNING).is_open
    assert body.surface.weights.sum() == pytest.approx(np.pi * (3**2 - 1**2), rel=1e-12)
    assert np.abs(body.flow(TURNING).carried).max() == 0.0


def ring(count: int, quarters: int = 4) -> Any:
    """Return a ring 1 < r < 2, 0 < z < 1 of hexahedra, a quarter of it `count` cells, or a part from -90 degrees on."""
    import basix.ufl
    from dolfinx.mesh import create_mesh

    around, out, up = quarters * count, 4, 2
    lines = around if quarters == 4 else around + 1
    angle = np.pi / 2 * (np.arange(lines) / count - 1)
    radius, height = np.linspace(1, 2, out + 1), np.linspace(0, 1, up + 1)
    points = np.array(
        [(r * np.cos(a), r * np.sin(a), z) for z in height for r in radius for a in angle], dtype=np.float64
    )

    def number(i: int, j: int, k: int) -> int:
        return (k * (out + 1) + j) * lines + i % lines

    cells = np.array(
        [
            [number(i + di, j + dj, k + dk) for dk in (0, 1) for dj in (0, 1) for di in (0, 1)]
            for k in range(up)
            for j in range(out)
            for i in range(around)
        ],
        dtype=np.int64,
    )
    element = basix.ufl.element("Lagrange", "hexahedron", 1, shape=(3,))
    if MPI.COMM_WORLD.rank > 0:
        cells, points = cells[:0], points[:0]
    return create_mesh(MPI.COMM_WORLD, cells, points, element)


def test_a_turning_disc() -> None:
    """Nothing is carried off; what turns under an even flux stays as it is, and a spot is carried around."""
    body = conducting(ring(6), "solid", groups(3), "bottom")
    flow, around = body.flow(TURNING), Surroundings(sliding=TURNING)
    assert not flow.is_open
    assert abs(flow.carried.sum()) < 1e-10
    n = len(body.surface.weights)
    even = body.load(np.ones(n))[:, None]
    still, turning = (body.step(speed, np.inf, around).respond(even)[:, 0] for speed in (0.0, 10.0))
    np.testing.assert_allclose(turning, still, rtol=0, atol=0.01 * still.max())
    x, y = body.surface.x[:, 0], body.surface.x[:, 1]
    spot = np.where((x > 0) & (np.abs(y) < 0.5), 1.0, 0.0)
    step, theta = body.step(10.0, 0.02, around), body.initial()
    load = body.load(spot)
    heating, entered = step.respond(load[:, None])[:, 0], 0.0
    comm = body.body.mesh.comm
    for _ in range(5):
        before, theta = theta, step.advance(theta) + heating
        stored = comm.allreduce(body.storage @ (theta - before)) / 0.02
        held = -comm.allreduce(step.held_by_end @ theta - step.held_by_start @ before)
        entered = comm.allreduce(load.sum())
        carried = comm.allreduce(step.carried @ theta)
        assert stored + held + carried == pytest.approx(entered, rel=1e-9)
        assert abs(carried) < 0.01 * entered
    warm = body.contact(theta)
    angles = np.angle((warm * (x + 1j * y)).sum())
    assert 0.2 < angles < 1.2  # turned on, towards +y, by half of 10 rad/s times 0.1 s


def test_half_a_disc_and_the_rest_of_its_track() -> None:
    """A spot heats a whole turning ring, or half of it whose other half is a bulk: the same.

    A turn lasts as long as heat takes through the section. What both have stored is the same, to rounding.
    """
    whole, half = (conducting(ring(6, quarters), "solid", groups(3)) for quarters in (4, 2))
    speed, duration, count = 10.0, 0.02, 200
    comm = MPI.COMM_WORLD
    loads = [body.load(np.where(np.abs(body.surface.x[:, 1]) < 0.6 * body.surface.x[:, 0], 1.0, 0.0))
             for body in (whole, half)]  # fmt: skip
    turning = whole.step(speed, duration, Surroundings(sliding=TURNING))
    heating = turning.respond(loads[0][:, None])[:, 0]
    passing = Surroundings(renewed=True, sliding=TURNING)
    step = half.step(speed, duration, passing)
    capacities = [comm.allreduce(body.storage.sum()) for body in (whole, half)]
    rest = Track(heat_capacity=capacities[0] - capacities[1])
    section = section_modes(half, TURNING, 1.0, rest.heat_capacity / comm.allreduce(step.entering.sum()))
    inflow = np.column_stack([loads[1], section.entering, step.entering / speed])
    basis = reduced_basis(half, inflow, [speed], duration, 1e-7, passing)
    kelvins = np.ones(inflow.shape[1] - 1)
    reduced = ReducedField([step], inflow, basis)
    track = TrackField(reduced, [step], [speed], kelvins, duration, rest, section, 1.0)
    theta, coordinates = whole.initial(), track.basis.coordinates(half.initial())
    for _ in range(count):
        theta = turning.advance(theta) + heating
        coordinates = track.advance(0, coordinates) + track.responses[0][:, 0]
    on_half = track.basis.temperature(coordinates)
    stored = comm.allreduce(whole.storage @ theta)
    of_half = comm.allreduce(half.storage @ on_half)
    bulks = coordinates[len(reduced.basis) :].reshape(CELLS, -1)[:, -1]
    assert of_half + rest.heat_capacity * bulks.mean() == pytest.approx(stored, rel=1e-9)
    mean = stored / capacities[0]
    found, exact = half.contact(on_half), whole.contact(theta)
    same = np.linalg.norm(whole.surface.x[None] - half.surface.x[:, None], axis=2).argmin(axis=1)
    spot = exact.max() - mean
    assert spot < 0.35 * mean
    assert found.max() - mean == pytest.approx(spot, rel=0.01)
    off = np.abs(found - exact[same])
    leaving = half.surface.x[:, 1] > 0.99 * np.hypot(*half.surface.x[:, :2].T)  # the whole ring conducts on beyond
    assert off[~leaving].max() < 0.02 * spot
    assert off.max() < 0.05 * spot


@pytest.mark.parametrize("count", [3, 4])
def test_modes_of_a_track_carry_no_heat(count: int) -> None:
    """A ring that turns about an axis beside it: material enters and leaves by oblique facets, some only in part.

    Whatever the facets are, the modes bring no heat in all, and uniform material that leaves has none of them. The
    flow is that of the stream function r^2 / 2: through the outer side from r = 1 to 5, through the hole from 2 to 4.
    """
    mesh = ring(count)
    mesh.geometry.x[:, 0] += 3.0
    body = conducting(mesh, "solid", groups(3))
    comm, speed = mesh.comm, 1.0
    step = body.step(speed, 1.0, Surroundings(renewed=True, sliding=TURNING))
    section = section_modes(body, TURNING, speed, 0.1)
    assert len(section.rates) > 2
    flow = comm.allreduce(step.entering.sum())
    assert flow == pytest.approx(RHO_C * ((5**2 - 1**2) + (4**2 - 2**2)) / 2, rel=1e-9)
    sums = [comm.allreduce(loads.sum(axis=0)) for loads in (section.entering, section.leaving)]
    np.testing.assert_allclose(sums, 0.0, atol=1e-12 * flow)
