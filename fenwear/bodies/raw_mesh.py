"""The mesh of one body in arrays: kept on disk, and read by dolfinx as a model of gmsh is read."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fenwear.common.arrays import Array
from fenwear.files.groups import GroupedMesh


@dataclass(frozen=True)
class Elements:
    """Elements of one kind on one entity of a group.

    Attributes:
        dim: Of the group.
        group: Tag of the group.
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
        """Return the mesh as arrays, to be kept."""
        named = {
            "groups": self.groups,
            "points": {name: x.tolist() for name, x in self.points.items()},
            "kinds": [(block.dim, block.group, block.kind) for block in self.elements],
        }
        return {
            "x": self.x,
            "named": np.frombuffer(json.dumps(named).encode(), dtype=np.uint8),
            **{f"elements{number}": block.nodes for number, block in enumerate(self.elements)},
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
        return sorted({(block.dim, block.group) for block in self.raw.elements if dim in (-1, block.dim)})

    def getPhysicalName(self, dim: int, tag: int) -> str:  # noqa: N802
        """Return the name of a group."""
        return next(name for name, number in self.raw.groups[dim].items() if number == tag)

    def getEntitiesForPhysicalGroup(self, dim: int, tag: int) -> list[int]:  # noqa: N802
        """Return the entities of a group."""
        numbered = enumerate(self.raw.elements, start=1)
        return [entity for entity, block in numbered if (block.dim, block.group) == (dim, tag)]

    def getNodes(self) -> tuple[NDArray[np.int64], Array, Array]:  # noqa: N802
        """Return the tags of the nodes and their coordinates, one after the other."""
        return np.arange(1, len(self.raw.x) + 1), self.raw.x.ravel(), np.empty(0)

    def getElements(self, dim: int = -1, tag: int = -1) -> tuple[list[int], list[Any], list[Any]]:  # noqa: N802
        """Return the kinds of the elements of an entity, or of all, with their tags and their nodes."""
        kinds: dict[int, tuple[list[Any], list[Any]]] = {}
        for block, tags in self._tagged(dim, tag):
            of_kind = kinds.setdefault(block.kind, ([], []))
            of_kind[0].append(tags)
            of_kind[1].append(block.nodes.ravel() + 1)
        joined = [(np.concatenate(tags), np.concatenate(nodes)) for tags, nodes in kinds.values()]
        return list(kinds), [of_kind[0] for of_kind in joined], [of_kind[1] for of_kind in joined]

    def getElementProperties(self, kind: int) -> tuple[str, int, int, int, Array, int]:  # noqa: N802
        """Return the properties of a kind of element: second its dimension, fourth the number of its nodes."""
        block = next(known for known in self.raw.elements if known.kind == kind)
        return "", block.dim, 0, block.nodes.shape[1], np.empty(0), 0

    def _tagged(self, dim: int, entity: int) -> Iterator[tuple[Elements, NDArray[np.int64]]]:
        """Find elements by dimension and entity, -1 for all of them, with their tags."""
        first = 1
        for number, block in enumerate(self.raw.elements, start=1):
            tags = np.arange(first, first + len(block.nodes))
            first += len(block.nodes)
            if dim in (-1, block.dim) and entity in (-1, number):
                yield block, tags


def raw_mesh(mesh: GroupedMesh, body: str, dim: int) -> RawMesh:
    """Return the part of a body of a mesh, its nodes numbered without gaps.

    Args:
        mesh: Of both bodies.
        body: "punch" or "strip": what the names of its groups start with.
        whole: Dimension of the bodies.
    """
    body_groups = sorted(
        (group for group in mesh.groups if group.name.startswith(f"{body}_")), key=lambda group: -group.dim
    )
    groups: list[dict[str, int]] = [{} for _ in range(dim + 1)]
    for tag, mesh_group in enumerate(body_groups, start=1):
        groups[mesh_group.dim][mesh_group.name] = tag
    used = np.unique(
        np.concatenate([cells.ravel() for group in body_groups if group.dim == dim for cells in group.cells.values()])
    )
    elements = (
        Elements(group.dim, groups[group.dim][group.name], kind, np.searchsorted(used, cells))
        for group in body_groups
        if group.dim >= dim - 1
        for kind, cells in group.cells.items()
    )
    points = {
        group.name: mesh.points[cells.ravel(), :dim]
        for group in body_groups
        if not group.dim
        for cells in group.cells.values()
    }
    return RawMesh(mesh.points[used], tuple(elements), groups, points)
