"""What a mesh must be before it is distributed: later, bad elements end in crashes or in wrong numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fenwear.arrays import Array

Elements = NDArray[np.int64]
FLAT = 1e-9  # of the mesh's size: what a node may lie out of the plane
SMALLEST = 1e-6  # sine of an element's smallest corner that is still an element


def element_problems(gmsh: Any, groups: list[dict[str, int]]) -> list[str]:
    """Return what is wrong with nodes and elements of gmsh's current model, in words.

    Args:
        gmsh: The module, with the mesh in its current model.
        groups: Tags of the physical groups to look at by their names, of dimension 0, 1 and 2.
    """
    tags, flat_coordinates, _ = gmsh.model.mesh.getNodes()
    x = np.asarray(flat_coordinates, dtype=float).reshape(-1, 3)
    if not len(x):
        return ["it has no nodes"]
    if not np.isfinite(x).all():
        return [f"{np.count_nonzero(~np.isfinite(x).all(axis=1))} of its nodes have coordinates that are no numbers"]
    size = float(np.ptp(x, axis=0).max())
    if np.ptp(x[:, 2]) > FLAT * size:
        return ["it is not plane: expected the same third coordinate at all nodes"]
    order = np.argsort(tags)
    problems, cells, edges = [], [], []
    for name, tag in groups[2].items():
        corners, nodes = _elements(gmsh, 2, tag)
        if not np.isin(nodes, tags).all():
            return [f"{name} has elements on nodes that are not there"]
        if (count := _bad(x[order[np.searchsorted(tags, corners, sorter=order)], :2])) > 0:
            problems.append(f"{name} has {count} elements that are degenerate or twisted")
        cells.append(np.sort(corners, axis=1))
        edges.append(np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1))
    if len({c.shape[1] for c in cells}) == 1 and len(np.unique(every := np.concatenate(cells), axis=0)) < len(every):
        problems.append("some of its elements are there twice")
    sides = {(int(a), int(b)) for part in edges for a, b in part}
    for name, tag in groups[1].items():
        ends = np.sort(_elements(gmsh, 1, tag)[0], axis=1)
        if any((int(a), int(b)) not in sides for a, b in ends):
            problems.append(f"{name} has elements that are no sides of the surfaces' elements")
    return problems


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
