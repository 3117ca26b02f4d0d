"""What a mesh must be before it is distributed: later, bad elements end in crashes or in wrong numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fenwear.arrays import Array

Elements = NDArray[np.int64]
FLAT = 1e-9  # of the mesh's size: what a node may lie out of the plane
SMALLEST = 1e-6  # sine of an element's smallest corner that is still an element; scaled Jacobian of a volume
# Corners of the faces of gmsh's volumes, by the number of their corners.
FACES = {
    4: [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]],
    8: [[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]],
}


def element_problems(gmsh: Any, groups: list[dict[str, int]], *, axisymmetric: bool = False) -> list[str]:
    """Return what is wrong with nodes and elements of gmsh's current model, in words.

    Args:
        gmsh: The module, with the mesh in its current model.
        groups: Tags of the physical groups to look at by their names, of dimension 0 to that of the bodies.
        axisymmetric: Whether x is the radius.
    """
    whole = len(groups) - 1
    tags, flat_coordinates, _ = gmsh.model.mesh.getNodes()
    x = np.asarray(flat_coordinates, dtype=float).reshape(-1, 3)
    if not len(x):
        return ["it has no nodes"]
    if not np.isfinite(x).all():
        return [f"{np.count_nonzero(~np.isfinite(x).all(axis=1))} of its nodes have coordinates that are no numbers"]
    size = float(np.ptp(x, axis=0).max())
    if whole == 2 and np.ptp(x[:, 2]) > FLAT * size:
        return ["it is not plane: expected the same third coordinate at all nodes"]
    if axisymmetric and x[:, 0].min() < -FLAT * size:
        return [
            f"it reaches to x = {x[:, 0].min():g} mm, but x is the radius of an axisymmetric model: expected x >= 0"
        ]
    order = np.argsort(tags)
    facets = {name: _elements(gmsh, whole - 1, tag)[0] for name, tag in groups[whole - 1].items()}
    on_facets = np.unique(np.concatenate([corners.ravel() for corners in facets.values()]))
    problems, cells, sides = [], [], set()
    for name, tag in groups[whole].items():
        corners, nodes = _elements(gmsh, whole, tag)
        if not np.isin(nodes, tags).all():
            return [f"{name} has elements on nodes that are not there"]
        flat = whole == 2
        bad = _bad(x[order[np.searchsorted(tags, corners, sorter=order)], :2]) if flat else _bad_volumes(gmsh, tag)
        if bad > 0:
            problems.append(f"{name} has {bad} elements that are degenerate or twisted")
        cells.append(np.sort(corners, axis=1))
        of_cells = np.concatenate([corners[:, side] for side in _sides(corners.shape[1], flat=flat)])
        sides.update(_rows(of_cells[np.isin(of_cells, on_facets).all(axis=1)]))  # others cannot be any facet's
    if len({c.shape[1] for c in cells}) == 1 and len(np.unique(every := np.concatenate(cells), axis=0)) < len(every):
        problems.append("some of its elements are there twice")
    for name, corners in facets.items():
        if not sides.issuperset(_rows(corners)):
            kind = "surfaces" if whole == 2 else "volumes"
            problems.append(f"{name} has elements that are no sides of the {kind}' elements")
    return problems


def _sides(corners: int, *, flat: bool) -> list[list[int]]:
    """Return the corners of each side of an element."""
    return [[k, (k + 1) % corners] for k in range(corners)] if flat else FACES[corners]


def _rows(sides: Elements) -> set[bytes]:
    """Return the corners of sides (..., corners) in ascending order, each side once, as words to compare."""
    return {row.tobytes() for row in np.sort(sides.reshape(-1, sides.shape[-1]), axis=1)}


def _elements(gmsh: Any, dim: int, tag: int) -> tuple[Elements, Elements]:
    """Return corners (count, corners) and all nodes of a group's elements."""
    corners, every = [], []
    for entity in gmsh.model.getEntitiesForPhysicalGroup(dim, tag):
        for kind, _, nodes in zip(*gmsh.model.mesh.getElements(dim, entity), strict=True):
            _, _, _, per_element, _, primary = gmsh.model.mesh.getElementProperties(kind)
            table = np.asarray(nodes, dtype=np.int64).reshape(-1, per_element)
            corners.append(table[:, :primary])
            every.append(table.ravel())
    return np.concatenate(corners), np.concatenate(every)


def _bad(x: Array) -> int:
    """Return how many elements do not turn the same way at all of their corners x (count, corners, 2)."""
    to_next, to_last = np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x
    lengths = np.linalg.norm(to_next, axis=2) * np.linalg.norm(to_last, axis=2)
    cross = to_next[..., 0] * to_last[..., 1] - to_next[..., 1] * to_last[..., 0]
    sine = cross / np.where(lengths > 0, lengths, 1.0)
    good = (sine > SMALLEST).all(axis=1) | (sine < -SMALLEST).all(axis=1)
    return int(np.count_nonzero(~good))


def _bad_volumes(gmsh: Any, tag: int) -> int:
    """Return how many volumes of a group are flat or turn inside out somewhere, as gmsh measures them."""
    bad = 0
    for entity in gmsh.model.getEntitiesForPhysicalGroup(3, tag):
        elements = np.concatenate(gmsh.model.mesh.getElements(3, entity)[1])
        least, most, scaled = (
            np.asarray(gmsh.model.mesh.getElementQualities(elements, name))
            for name in ("minDetJac", "maxDetJac", "minSJ")
        )
        # Mirrored elements, whose determinant is negative everywhere, are as good as others.
        bad += int(np.count_nonzero(~((least * most > 0) & (np.abs(scaled) > SMALLEST))))
    return bad
