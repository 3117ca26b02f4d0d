"""The mesh of one body as gmsh has made it, in arrays: kept on disk, and read by dolfinx as a model of gmsh is read.

A mesh is checked before it is distributed: later, bad elements end in crashes or in wrong numbers.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fenwear.arrays import Array


@dataclass(frozen=True)
class Elements:
    """Elements of one kind on one entity of a group.

    Attributes:
        dim: Of the group.
        group: Its tag.
        kind: gmsh's number of the kind of element.
        nodes: Of each element in gmsh's order, counted from 0 (elements, nodes).
    """

    dim: int
    group: int
    kind: int
    nodes: NDArray[np.int64]


@dataclass(frozen=True)
class RawMesh:
    """The mesh of one body on one rank.

    Attributes:
        x: Of the nodes (n, 3), mm.
        elements: Of the regions and of the groups of their facets.
        groups: Tags of the groups by their names, of each dimension.
        points: Coordinates (count, dim) of each group of points, mm.
    """

    x: Array
    elements: tuple[Elements, ...]
    groups: list[dict[str, int]]
    points: dict[str, Array]

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return all of it as arrays, to be kept."""
        named = {
            "groups": self.groups,
            "points": {name: x.tolist() for name, x in self.points.items()},
            "kinds": [(one.dim, one.group, one.kind) for one in self.elements],
        }
        return {
            "x": self.x,
            "named": np.frombuffer(json.dumps(named).encode(), dtype=np.uint8),
            **{f"elements{number}": one.nodes for number, one in enumerate(self.elements)},
        }

    @classmethod
    def of_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> RawMesh:
        """Return the mesh of `arrays`."""
        named = json.loads(bytes(arrays["named"]))
        elements = (
            Elements(dim, group, kind, arrays[f"elements{number}"])
            for number, (dim, group, kind) in enumerate(named["kinds"])
        )
        points = {name: np.array(x) for name, x in named["points"].items()}
        return cls(arrays["x"], tuple(elements), named["groups"], points)


class GmshView:
    """A mesh as dolfinx reads a model of gmsh, by the names and with the answers that gmsh's functions have.

    Each of its elements' arrays is an entity, counted from 1.
    """

    def __init__(self, mesh: RawMesh) -> None:
        self.raw = mesh

    @property
    def mesh(self) -> GmshView:
        """The group of gmsh with this name."""
        return self

    def getPhysicalGroups(self, dim: int = -1) -> list[tuple[int, int]]:  # noqa: N802
        """Return the dimension and tag of the groups."""
        return sorted({(one.dim, one.group) for one in self.raw.elements if dim in (-1, one.dim)})

    def getPhysicalName(self, dim: int, tag: int) -> str:  # noqa: N802
        """Return the name of a group."""
        return next(name for name, own in self.raw.groups[dim].items() if own == tag)

    def getEntitiesForPhysicalGroup(self, dim: int, tag: int) -> list[int]:  # noqa: N802
        """Return the entities of a group."""
        found = enumerate(self.raw.elements, start=1)
        return [entity for entity, one in found if (one.dim, one.group) == (dim, tag)]

    def getNodes(self) -> tuple[NDArray[np.int64], Array, Array]:  # noqa: N802
        """Return the tags of the nodes and their coordinates, one after the other."""
        return np.arange(1, len(self.raw.x) + 1), self.raw.x.ravel(), np.empty(0)

    def getElements(self, dim: int = -1, tag: int = -1) -> tuple[list[int], list[Any], list[Any]]:  # noqa: N802
        """Return the kinds of the elements of an entity, or of all, with their tags and their nodes."""
        found: dict[int, tuple[list[Any], list[Any]]] = {}
        for one, tags in self._tagged(dim, tag):
            of_kind = found.setdefault(one.kind, ([], []))
            of_kind[0].append(tags)
            of_kind[1].append(one.nodes.ravel() + 1)
        joined = [(np.concatenate(tags), np.concatenate(nodes)) for tags, nodes in found.values()]
        return list(found), [of_kind[0] for of_kind in joined], [of_kind[1] for of_kind in joined]

    def getElementProperties(self, kind: int) -> tuple[str, int, int, int, Array, int]:  # noqa: N802
        """Return of a kind of element what is asked for: its dimension, second, and the number of its nodes, fourth."""
        one = next(one for one in self.raw.elements if one.kind == kind)
        return "", one.dim, 0, one.nodes.shape[1], np.empty(0), 0

    def _tagged(self, dim: int, entity: int) -> Iterator[tuple[Elements, NDArray[np.int64]]]:
        """Find elements by dimension and entity, -1 for all of them, with their tags."""
        first = 1
        for number, one in enumerate(self.raw.elements, start=1):
            tags = np.arange(first, first + len(one.nodes))
            first += len(one.nodes)
            if dim in (-1, one.dim) and entity in (-1, number):
                yield one, tags


def raw_mesh(gmsh: Any, body: str, whole: int) -> RawMesh:
    """Return the part of a body of gmsh's current model, its nodes numbered without gaps.

    Args:
        gmsh: The module.
        body: "punch" or "strip": what the names of its groups start with.
        whole: Dimension of the bodies.
    """
    model = gmsh.model
    groups: list[dict[str, int]] = []
    for dim in range(whole + 1):
        named = {model.getPhysicalName(dim, tag): tag for _, tag in model.getPhysicalGroups(dim)}
        groups.append({name: tag for name, tag in named.items() if name.startswith(f"{body}_")})
    points = {
        name: np.asarray(model.mesh.getNodesForPhysicalGroup(0, tag)[1]).reshape(-1, 3)[:, :whole]
        for name, tag in groups[0].items()
    }
    parts = [
        (dim, tag, kind, np.asarray(nodes).reshape(len(elements), -1))
        for dim in (whole, whole - 1)
        for tag in groups[dim].values()
        for entity in model.getEntitiesForPhysicalGroup(dim, tag)
        for kind, elements, nodes in zip(*model.mesh.getElements(dim, entity), strict=True)
    ]
    node_tags, coordinates, _ = model.mesh.getNodes()
    used = np.unique(np.concatenate([nodes.ravel() for dim, _, _, nodes in parts if dim == whole]))
    position = np.argsort(node_tags)[np.searchsorted(np.sort(node_tags), used)]
    x = np.asarray(coordinates).reshape(-1, 3)[position]
    elements = (Elements(dim, tag, int(kind), np.searchsorted(used, nodes)) for dim, tag, kind, nodes in parts)
    return RawMesh(x, tuple(elements), groups, points)


Table = NDArray[np.int64]
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


def _rows(sides: Table) -> set[bytes]:
    """Return the corners of sides (..., corners) in ascending order, each side once, as words to compare."""
    return {row.tobytes() for row in np.sort(sides.reshape(-1, sides.shape[-1]), axis=1)}


def _elements(gmsh: Any, dim: int, tag: int) -> tuple[Table, Table]:
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
