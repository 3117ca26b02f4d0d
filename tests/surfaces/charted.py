"""Surfaces in a chart for tests: shuffled, mirrored, turned and distorted."""

from __future__ import annotations

import basix
import numpy as np

from fenwear.common.arrays import Array
from fenwear.surfaces.overlap import ChartedSurface, tabulate


def surface(corners: Array, cell: str, degree: int, seed: int = 0) -> ChartedSurface:
    """Number the nodes of facets with `corners` (f, c, d - 1) at random, facets in any order."""
    random = np.random.default_rng(seed)
    variant = basix.LagrangeVariant.gll_warped
    element = basix.create_element(basix.ElementFamily.P, basix.CellType[cell], degree, variant)
    local = tabulate(cell, 1, element.points) @ random.permutation(corners)
    flat = corners.shape[2]
    _, first, number = np.unique(
        local.reshape(-1, flat).round(10) + 0.0, axis=0, return_index=True, return_inverse=True
    )
    order = random.permutation(len(first))
    s = local.reshape(-1, flat)[first][order]
    facets = np.argsort(order)[number.ravel()].reshape(local.shape[:2])
    carrying = facets[:, :3] if cell == "triangle" else facets
    return ChartedSurface(s, facets, cell, degree, random.permutation(np.unique(carrying)))


def line(ends: Array, degree: int, seed: int = 0) -> ChartedSurface:
    """Return intervals between ascending `ends`, some of them turned around."""
    turned = np.random.default_rng(seed).random(len(ends) - 1) < 0.5
    corners = np.stack([ends[:-1], ends[1:]], axis=1)
    corners[turned] = corners[turned, ::-1]
    return surface(corners[:, :, None], "interval", degree, seed)


def grid(
    x: Array, y: Array, cell: str, degree: int, *, turn: float = 0.0, distort: float = 0.0, seed: int = 0
) -> ChartedSurface:
    """Return quadrilaterals between lines, or each cut into two triangles; some facets mirrored.

    Args:
        turn: Angle by which the surface is turned, rad.
        distort: Random displacement of inner corners, as a share of the smallest facet.
    """
    random = np.random.default_rng(seed)
    at = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
    smallest = min(np.diff(x).min(), np.diff(y).min())
    at[1:-1, 1:-1] += distort * smallest * random.uniform(-1, 1, at[1:-1, 1:-1].shape)
    at = at @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    corners = np.stack([at[:-1, :-1], at[1:, :-1], at[:-1, 1:], at[1:, 1:]], axis=2).reshape(-1, 4, 2)
    if cell == "triangle":
        corners = np.concatenate([corners[:, [0, 1, 3]], corners[:, [3, 2, 0]]])
    mirrored = random.random(len(corners)) < 0.5
    corners[mirrored] = corners[mirrored][:, [0, 2, 1, 3][: corners.shape[1]]]
    return surface(corners, cell, degree, seed)


def integrals(charted: ChartedSurface) -> tuple[Array, Array]:
    """Return the integrals of the shape functions of trace and pressure nodes, on facets that are affine."""
    cell = basix.CellType[charted.cell]
    points, gauss = basix.make_quadrature(cell, 2 * charted.degree)
    corners = charted.corners
    flat = corners.shape[2]
    scale = np.abs(np.linalg.det(corners[:, 1 : flat + 1] - corners[:, :1]))
    trace, pressure = np.zeros(len(charted.s)), np.zeros(len(charted.nodes))
    np.add.at(trace, charted.facets, scale[:, None] * (gauss @ charted.shape_functions(points)))
    np.add.at(pressure, charted.pressure_facets, scale[:, None] * (gauss @ charted.pressure_functions(points)))
    return trace, pressure
