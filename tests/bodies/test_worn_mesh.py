"""Meshes that follow the wear."""

from __future__ import annotations

import tomllib
from collections.abc import Callable

import dolfinx.fem as fem
import numpy as np
import pytest
import ufl
from mpi4py import MPI

from fenwear import Tribosystem, assemble, make_case
from fenwear.bodies.distributed_mesh import BodyMesh
from fenwear.case.templates import fill_in, find_template
from fenwear.common.errors import MeshQualityError
from fenwear.laws.wear import WornDepths

COARSE = ("geometry.parameters.elements_along_contact=8", "geometry.degree=2")


def area(body: BodyMesh) -> float:
    one = fem.form(fem.Constant(body.mesh, 1.0) * ufl.dx)
    return float(body.mesh.comm.allreduce(fem.assemble_scalar(one)))


@pytest.mark.mpi
def test_the_bodies_lose_what_is_worn(assembled: Callable[..., Tribosystem]) -> None:
    """The cross-sections shrink by the integral of the depth; contact nodes move by it, pins and the rest stay."""
    system = assembled("example1", *COARSE)
    x, strip_x = system.pair.x, system.pair.strip.x[:, 0]
    worn = WornDepths(1 + 0.5 * (x / 30) ** 2, 0.2 * (1 - (strip_x / 30) ** 2))
    moved = assemble(system.case, system.bodies.comm, worn)
    assert moved.bodies.moved is not None
    vertices = slice(None, None, 2)  # straight elements: the middle nodes go with their ends
    np.testing.assert_allclose(moved.bodies.moved.punch[vertices], worn.punch[vertices], atol=1e-10)
    np.testing.assert_allclose(moved.bodies.moved.strip[vertices], worn.strip[vertices], atol=1e-10)
    for new, old, loss in (
        (moved.bodies.punch.body, system.bodies.punch.body, system.pair.weights @ moved.bodies.moved.punch),
        (moved.bodies.strip.body, system.bodies.strip.body, system.pair.strip.weights @ moved.bodies.moved.strip),
    ):
        assert area(old) - area(new) == pytest.approx(loss, rel=1e-9)
    gap = moved.pair.initial_gap - moved.bodies.moved.punch - moved.bodies.moved.strip
    np.testing.assert_allclose(gap, 0, atol=2e-3)  # along the strip's new normal: to the square of its slope
    np.testing.assert_array_equal(moved.bodies.punch.pivot, system.bodies.punch.pivot)
    np.testing.assert_allclose(moved.pair.x, x, atol=1e-12)


@pytest.mark.mpi
def test_an_even_depth_moves_the_punch_only_where_it_must(assembled: Callable[..., Tribosystem]) -> None:
    """An even depth shrinks the punch between contact and pins; gap and stiffness change as little as it is."""
    system = assembled("example1", *COARSE)
    depth = 1e-6
    moved = assemble(
        system.case, system.bodies.comm, WornDepths(np.full_like(system.pair.x, depth), 0 * system.pair.strip.weights)
    )
    scale = np.abs(system.elastic.interface.dense()).max()
    difference = np.abs(moved.elastic.interface.dense() - system.elastic.interface.dense()).max()
    assert 0 < difference < 1e-5 * scale
    worn = WornDepths(np.full_like(system.pair.x, depth), system.unworn().strip)
    np.testing.assert_allclose(moved.gap(0, worn), system.gap(0, worn), atol=1e-13)


@pytest.mark.mpi
def test_circles_are_offset_along_their_own_normals() -> None:
    """Every node of bore and shaft, to 50 degrees from the mean normal, moves by its own depth along the radius."""
    data = tomllib.loads(fill_in(find_template("bushing")))
    data["geometry"]["parameters"]["elements_along_contact"] = 16
    case = make_case(data)
    system = assemble(case)
    gap = 0.5 * 0.04  # the bore's centre lies so far below the shaft's, mm
    circles = ((system.pair.punch, 10 + gap, -gap, 1), (system.pair.strip, 10.0, 0.0, -1))
    for surface, radius, z, way in circles:
        angle = np.arctan2(surface.x[:, 0], surface.x[:, 1] - z)
        depth = 0.02 + 0.01 * np.cos(3 * angle) if surface.body == "punch" else np.full(len(angle), 0.03)
        none = system.unworn()
        worn = WornDepths(depth, none.strip) if surface.body == "punch" else WornDepths(none.punch, depth)
        moved = assemble(case, system.bodies.comm, worn)
        x, z_moved = getattr(moved.pair, surface.body).x.T
        np.testing.assert_allclose(np.hypot(x, z_moved - z), radius + way * depth, atol=2e-5 * depth.max())
        np.testing.assert_allclose(getattr(moved.bodies.moved, surface.body), depth, rtol=1e-9)


@pytest.mark.mpi
def test_a_pin_gets_shorter(assembled: Callable[..., Tribosystem]) -> None:
    """In space the nodes of upright sides slide along them: an even depth shortens all elements evenly.

    The volume falls by the integral of any depth; the pin's top and its circles stay.
    """
    system = assembled("pin-on-disc", "geometry.degree=1", "geometry.order=1")
    x, old = system.pair.punch.x, system.bodies.punch.body
    for depth in (np.full(len(x), 3.0), 1.0 + 0.1 * (x[:, 0] - 15.0) + 0.05 * x[:, 1] ** 2):
        moved = assemble(system.case, system.bodies.comm, WornDepths(depth, system.unworn().strip))
        assert moved.bodies.moved is not None
        np.testing.assert_allclose(moved.bodies.moved.punch, depth, atol=1e-12)
        new = moved.bodies.punch.body
        assert area(old) - area(new) == pytest.approx(system.pair.punch.weights @ depth, rel=1e-12)
        place, there = old.mesh.geometry.x, new.mesh.geometry.x
        np.testing.assert_array_equal(there[:, :2], place[:, :2])
        if np.ptp(depth) == 0:
            np.testing.assert_allclose(there[:, 2], 3.0 + 0.75 * place[:, 2], atol=1e-12)


@pytest.mark.mpi
def test_used_up_elements_are_refused(assembled: Callable[..., Tribosystem]) -> None:
    """A punch that is worn through is an error that says which body and how deep, not a wrong number."""
    system = assembled("example1", *COARSE)
    worn = WornDepths(np.full_like(system.pair.x, 19.0), system.unworn().strip)
    with pytest.raises(MeshQualityError, match=r"wear of the punch has used up .* depth is 19 mm"):
        assemble(system.case, MPI.COMM_WORLD, worn)


def test_limit_of_the_offset(assembled: Callable[..., Tribosystem]) -> None:
    """The meshes follow where the depth exceeds the given share of the elements' height: 2 mm of its first row."""
    system = assembled("example1", *COARSE, "geometry.follow_wear=0.5")
    heights = system.bodies.element_heights.punch
    low, high = (WornDepths(share * heights, system.unworn().strip) for share in (0.49, 0.51))
    assert system.bodies.wear_on_meshes(low, system.case) <= 1
    assert system.bodies.wear_on_meshes(high, system.case) > 1
    still = assembled("example1", *COARSE, "geometry.follow_wear=never")
    assert still.bodies.wear_on_meshes(high, still.case) <= 1
    z = np.unique(system.bodies.punch.body.mesh.geometry.x[:, 1].round(9))
    np.testing.assert_allclose(heights, z[1] - z[0], rtol=1e-9)


@pytest.mark.mpi
def test_pressure_on_some_of_the_nodes() -> None:
    """Where triangles bear on their vertices, and rings on all but the axis, heights and depths are those nodes' own.

    A linear depth is followed exactly, and the volume falls by its integral.
    """
    block = {
        "punch_tetrahedra": 1,
        "strip_tetrahedra": 1,
        "across_x": 2,
        "across_y": 2,
        "margin_x": 0.5,
        "margin_y": 0.5,
    }
    disc = {"inner_radius": 0, "outer_radius": 1, "punch_height": 1, "across": 3, "punch_layers": 2}
    for geometry, kind, sizes in (("solid_blocks.geo", "solid", block), ("rings.geo", "axisymmetric", disc)):
        solid, down = kind == "solid", [0, 0, -1] if kind == "solid" else [0, -1]
        sides = ["x", "y", "z"] if solid else ["x", "z"]
        turn = {"kind": "rotation", "angular_speed": 1, "duration": 1}
        to_and_fro = {"kind": "reciprocating", "amplitude": 1e-3, "period": 1}
        system = assemble(make_case({
            "geometry": {"file": geometry, "degree": 2, "parameters": sizes, "follow_wear": 0.5},
            "model": {"kind": kind},
            "materials": {"steel": {"young": 2e5, "poisson": 0.3}},
            "punch": {"regions": {"punch_body": "steel"}, "loads": [{"on": "punch_far", "force": down}],
                      "supports": [{"on": "punch_far", "fix": ["x", "y"]}] if solid else []},
            "strip": {"regions": {"strip_body": "steel"}, "supports": [{"on": "strip_far", "fix": sides}]},
            "contact": {"friction": 0.1},
            "wear": {"punch": {"coefficient": 1e-8}},
            "motion": to_and_fro if solid else turn,
            "run": {"half_cycles": 1},
        }))  # fmt: skip
        punch, weights = system.bodies.punch, system.pair.punch.weights
        surface = system.pair.punch
        assert len(surface.nodes) < len(surface.trace)
        heights = system.bodies.element_heights.punch
        assert heights.shape == weights.shape
        if not solid:
            np.testing.assert_allclose(heights, 0.5, rtol=1e-9)
        low, high = (WornDepths(share * heights, system.unworn().strip) for share in (0.49, 0.51))
        assert system.bodies.wear_on_meshes(low, system.case) <= 1
        assert system.bodies.wear_on_meshes(high, system.case) > 1
        depth = 0.02 + 0.01 * surface.x @ [1, 2, 0] if solid else np.full(len(weights), 0.02)
        moved = assemble(system.case, system.bodies.comm, WornDepths(depth, system.unworn().strip))
        assert moved.bodies.moved is not None
        np.testing.assert_allclose(moved.bodies.moved.punch, depth, atol=1e-12)
        lost = area(punch.body) - area(moved.bodies.punch.body)
        assert lost == pytest.approx(weights @ depth if solid else 0.02, rel=1e-9)


@pytest.mark.mpi
def test_round_surfaces_stay_round_as_they_follow() -> None:
    """An even depth next to nothing changes no gap: that of the circles goes on to count, not that of the facets."""
    data = tomllib.loads(fill_in(find_template("bushing")))
    data["geometry"]["parameters"]["elements_along_contact"] = 16
    system = assemble(make_case(data))
    none = system.unworn()
    worn = WornDepths(np.full_like(none.punch, 1e-7), none.strip)
    moved = assemble(system.case, system.bodies.comm, worn)
    assert len(system.pair.strip.rounds[0]) == len(moved.pair.strip.rounds[0]) == 1
    np.testing.assert_allclose(moved.gap(0, worn), system.gap(0, worn), atol=1e-9)
    np.testing.assert_allclose(moved.pair.normal, system.pair.normal, atol=1e-7)
