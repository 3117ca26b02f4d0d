"""Depth, length and width of scars of known shape."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fenwear import Tribosystem, load_case
from fenwear.bodies.subcells import linear_cells
from fenwear.results.history_surfaces import EDGE, conforming, extents, scar_geometry
from fenwear.system import place_case


def grid(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return nodes of a square of 4 mm x 2 mm and the pairs of neighbours along its lines."""
    x, y = np.meshgrid(np.linspace(-2, 2, 2 * count + 1), np.linspace(-1, 1, count + 1), indexing="ij")
    nodes = np.arange(x.size).reshape(x.shape)
    edges = [np.stack([nodes[:-1], nodes[1:]], -1), np.stack([nodes[:, :-1], nodes[:, 1:]], -1)]
    return np.column_stack([x.ravel(), y.ravel()]), np.concatenate([e.reshape(-1, 2) for e in edges])


@pytest.mark.parametrize("count", [40, 80, 160])
def test_extents_of_an_elliptic_scar(count: int) -> None:
    """1 - (x/a)^2 - (y/b)^2: the extents are those of its edge level, to an element."""
    x, edges = grid(count)
    depth = np.maximum(1 - (x[:, 0] / 1.31) ** 2 - (x[:, 1] / 0.77) ** 2, 0)
    found = extents(np.array([depth, 3e-4 * depth, 0 * depth]), x, edges)
    exact = 2 * np.sqrt(1 - EDGE) * np.array([1.31, 0.77])
    spacing = 2 / count
    assert np.abs(found[:2] - exact).max() < spacing
    np.testing.assert_allclose(found[0], found[1], rtol=1e-12)
    np.testing.assert_array_equal(found[2], 0)


def test_a_cap_that_grows_over_coarse_nodes() -> None:
    """R^2 - r^2 over 4 to 15 elements: its diameter is right to 0.7 of them wherever its rim is, most often to 0.2.

    By interpolation alone it was up to two of them too large.
    """
    x, edges = grid(16)
    radii = np.linspace(0.25, 0.95, 80)
    found = extents(np.maximum(radii[:, None] ** 2 - (x**2).sum(axis=1), 0), x, edges)
    off = (found - 2 * np.sqrt(1 - EDGE) * radii[:, None]) / (2 / 16)
    assert np.abs(off).max() < 0.7
    assert np.median(np.abs(off)) < 0.2


def test_no_rounding_decides() -> None:
    """Over nodes moved by 1e-6, and beside nodes worn by next to nothing or by nothing, the extents are the same.

    Two rows that are worn alone, at both sides of a middle that sticks, have neighbours in one direction.
    """
    x, edges = grid(8)
    moved = x + 1e-6 * np.cos(7 * np.arange(x.size)).reshape(x.shape)
    rows = np.where(np.abs(x[:, 1]) == 0.75, np.maximum(1 - (x[:, 0] / 1.31) ** 2, 0), 0)
    cap = np.maximum(0.81 - (x**2).sum(axis=1), 0)
    for depth in (rows, cap):
        exact = extents(depth[None], x, edges, 0.05)
        np.testing.assert_allclose(extents(depth[None], moved, edges, 0.05), exact, rtol=1e-3)
        np.testing.assert_allclose(extents(np.maximum(depth, 1e-9)[None], x, edges, 0.05), exact, rtol=1e-6)


def test_extents_at_another_share() -> None:
    """At 5 % of the depth of a parabola; a middle that is not worn counts into the width."""
    x = np.linspace(-1, 1, 401)
    pairs = np.stack([np.arange(400), np.arange(1, 401)], axis=1)
    depth = np.maximum(1 - (x / 0.7) ** 2, 0)
    for share in (0.01, 0.05):
        (width,) = extents(depth[None], x[:, None], pairs, share)[0]
        assert width == pytest.approx(1.4 * np.sqrt(1 - share), abs=1e-5)
    gap = np.array([0, 1, 1, 0, 0, 0, 1, 1, 0.0])
    assert extents(gap[None], np.arange(9.0)[:, None], pairs[:8], 0.05)[0, 0] == pytest.approx(7.9)


def test_a_scar_to_the_edge_of_the_surface() -> None:
    """Worn everywhere, the scar is as large as the surface."""
    x, edges = grid(10)
    np.testing.assert_allclose(extents(np.ones((1, len(x))), x, edges), [[4, 2]])


def test_edges_are_those_of_the_facets(assembled: Callable[..., Tribosystem]) -> None:
    """On the pin's face no edge is longer than a facet, and every node has one."""
    system = assembled("pin-on-disc", "geometry.degree=2", "geometry.order=1", "geometry.parameters.around=2")
    geometry = scar_geometry(system, system.pair.punch)
    x = system.pair.punch.x
    lengths = np.linalg.norm(x[geometry.edges[:, 0]] - x[geometry.edges[:, 1]], axis=1)
    facets = system.pair.punch.trace[system.pair.punch.facets]
    assert lengths.max() < np.ptp(facets, axis=1).max()
    assert set(geometry.edges.ravel()) == set(range(len(x)))
    assert linear_cells("quadrilateral", 2).shape == (4, 4)


def test_which_contacts_conform() -> None:
    """A flat pin and a ring lie on their counter-bodies as they are made, a ball does not."""
    coarse = ("geometry.degree=1", "geometry.order=1")
    assert conforming(place_case(load_case("pin-on-disc", [*coarse, "geometry.parameters.around=2"])).pair)
    assert conforming(place_case(load_case("ring-on-ring", ["geometry.parameters.across=4"])).pair)
    assert not conforming(place_case(load_case("ball-on-flat", coarse)).pair)
