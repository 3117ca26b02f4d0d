"""Named sets of a mesh file as the groups of fenwear: regions, facets and points of both bodies.

A set becomes a group by its own name, whatever its case and spaces (PUNCH CONTACT is punch_contact), or by
`geometry.groups`, where the value is the name of a set, a list of them, a plane such as "y = 0 mm" for all facets of
the body on it, or "" to leave a set out. A node set becomes the facets of its body whose corners it has all, else
points. Where a node set and an element set have one name (as Abaqus/CAE writes them), the element set is the region if
its nodes are those of the node set; else the node set counts: its facets lie on these elements.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError
from fenwear.files.mesh_file import (
    ENTITIES,
    KINDS,
    SHOWN,
    USABLE,
    Ints,
    MeshFile,
    MeshSet,
    bad_elements,
    in_plane,
    listed,
    measure,
    sorted_rows,
    stacked,
)

BODIES = ("punch", "strip")
MEASURES = ("", "length", "area", "volume")
POWERS = ("", "mm", "mm²", "mm³")
PLANE = re.compile(r"\s*(?P<axis>[xyzr])\s*=\s*(?P<at>.+)")
ON_PLANE = 1e-6  # of the mesh's size: how far a node may lie from a plane
SMALLEST = 0.5  # mm: a whole mesh that is smaller is likely one in metres


@dataclass(frozen=True)
class Group:
    """A group of fenwear.

    Attributes:
        name: Such as punch_contact.
        dim: Of its elements.
        cells: Points (n, k) by gmsh's number of their kind.
        source: The set that it was, for people.
        elements: The numbers of a region's elements.
    """

    name: str
    dim: int
    cells: Mapping[int, Ints]
    source: str
    elements: Ints = field(default_factory=lambda: np.zeros(0, np.int64))

    @property
    def count(self) -> int:
        """Number of its elements, or points."""
        return sum(map(len, self.cells.values()))


@dataclass(frozen=True)
class GroupedMesh:
    """A mesh with the groups that it gives.

    Attributes:
        points: (n, 3), mm.
        groups: By name.
        unused: Sets that are no groups.
        notes: Descriptions of parts left out or changed.
    """

    points: Array
    groups: tuple[Group, ...]
    unused: tuple[str, ...]
    notes: tuple[str, ...]

    def text(self) -> str:
        """Return the groups with their sizes, and what was left out, in lines."""
        unused = [f"unused sets: {listed(self.unused)}"] if self.unused else []
        return "\n".join((rows_text(self.rows()), *unused, *self.notes))

    def rows(self) -> list[dict[str, Any]]:
        """Return a row of each group: what it is, and how large."""
        return [
            {
                "group": one.name, "set": one.source, "dim": one.dim, "elements": one.count,
                "nodes": len(np.unique(np.concatenate([cells.ravel() for cells in one.cells.values()]))),
                "measure": MEASURES[one.dim], "size": measure(self.points, one.cells),
            }
            for one in sorted(self.groups, key=lambda group: (group.name.partition("_")[0], -group.dim, group.name))
        ]  # fmt: skip


def rows_text(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return rows of groups in lines."""
    lines = []
    for row in rows:
        size = f", {row['measure']} {row['size']:.6g} {POWERS[row['dim']]}" if row["dim"] else ""
        count = f"{row['elements']:,} {ENTITIES[row['dim']]} elements on {row['nodes']:,} nodes"
        source = f" (from {row['set']})" if row["set"] != row["group"] else ""
        lines.append(f"{row['group']}: {count}{size}{source}")
    return "\n".join(lines)


def normal(name: str) -> str:
    """Return a name as names are compared: in small letters, spaces and signs as one underscore."""
    return re.sub(r"[^\w]+|_+", "_", name.strip().strip('"').casefold()).strip("_")


def grouped(
    mesh: MeshFile,
    wanted: Mapping[str, str | Sequence[str]],
    scale: float | None,
    dim: int,
    by_role: Callable[[str], str],
    length: Callable[[str], float],
) -> GroupedMesh:
    """Return the groups of a mesh file.

    Args:
        mesh: Contents of the file.
        wanted: Names of sets, or planes, by the groups that they become.
        scale: Millimetres in the file's unit of length; None where nobody says it.
        dim: Of the bodies.
        by_role: Gives a group's name that starts with punch_ or strip_.
        length: Gives a length in mm.

    Raises:
        CaseError: a set is missing or of another dimension, groups overlap, or elements are degenerate.
    """
    if mesh.dim != dim:
        kind = "kind = 'solid'" if mesh.dim == 3 else "a plane or axisymmetric model"
        message = f"{mesh.name} has {ENTITIES[mesh.dim]} elements as the largest. Set model for them: {kind}."
        raise CaseError(InputError("geometry.file", message))
    mesh = in_plane(mesh)
    size = float(np.ptp(mesh.points[np.unique(np.concatenate([b.nodes.ravel() for b in mesh.blocks]))], axis=0).max())
    if scale is None and size < SMALLEST:
        message = (
            f"{mesh.name} is {size:.3g} mm long in all. Set geometry.unit = 'm' if its lengths are in metres, "
            "or geometry.unit = 'mm' if they are right."
        )
        raise CaseError(InputError("geometry.unit", message))
    choice = _Choice(mesh, {by_role(name): value for name, value in wanted.items()}, by_role, length, scale or 1.0)
    return choice.result(dim)


class _Sides:
    """The sides of the elements of a body (n,)."""

    def __init__(self, mesh: MeshFile, elements: Ints) -> None:
        self.mesh, self.elements = mesh, elements

    @cached_property
    def boundary(self) -> Ints:
        """Facets of one element alone, by element and number (n, 2)."""
        return self.mesh.boundary(self.elements)

    @cached_property
    def corners(self) -> Ints:
        """The corners of all, ascending and filled with -1 (n, 4)."""
        return self.mesh.side_corners(self.mesh.all_sides(self.elements))

    def has(self, corners: Ints) -> NDArray[np.bool_]:
        """Return which facets with these corners (n, k) are among them (n,)."""
        facets = np.sort(np.pad(corners, ((0, 0), (0, 4 - corners.shape[1])), constant_values=-1), axis=1)
        marked = np.zeros(len(self.mesh.points) + 1, dtype=bool)
        marked[facets] = marked[-1] = True  # others cannot be any facet's
        return _rows_in(facets, self.corners[marked[self.corners].all(axis=1)])


class _Choice:
    def __init__(
        self,
        mesh: MeshFile,
        wanted: Mapping[str, str | Sequence[str]],
        by_role: Callable[[str], str],
        length: Callable[[str], float],
        scale: float,
    ) -> None:
        self.mesh, self.wanted, self.by_role, self.length, self.scale = mesh, wanted, by_role, length, scale
        self.problems: list[InputError] = []
        self.by_name: dict[str, list[MeshSet]] = {}
        for one in mesh.sets:
            self.by_name.setdefault(normal(one.name), []).append(one)
        for one in mesh.sets:  # the name without that of its instance, where no other has it
            short = normal(one.name.rpartition(".")[2])
            if "." in one.name:
                self.by_name.setdefault(short, []).append(one)

    def result(self, dim: int) -> GroupedMesh:
        chosen = self.chosen()
        regions = self.regions(chosen, dim)
        if self.problems:
            raise CaseError(self.problems)
        groups = list(regions)
        bodies = {body: _Sides(self.mesh, self.elements_of(regions, body)) for body in BODIES}
        used = {source for _, sets in chosen.items() for source in sets if isinstance(source, MeshSet)}
        for name, sets in chosen.items():
            if any(name == region.name for region in regions):
                continue
            groups += self.lower(name, sets, bodies, dim)
        self.check(groups, regions, dim)
        if self.problems:
            raise CaseError(self.problems)
        notes = list(self.mesh.notes)
        whole = {k for k, b in enumerate(self.mesh.blocks) if KINDS[b.kind].dim == dim}
        left = sum(len(self.mesh.blocks[k].nodes) for k in whole) - sum(r.count for r in regions)
        if left:
            notes.append(f"in no region, left out: {left:,} {ENTITIES[dim]} elements")
        unused = tuple(one.name for one in self.mesh.sets if one not in used)
        return GroupedMesh(self.scale * self.mesh.points, tuple(groups), unused, tuple(notes))

    def wrong(self, key: str, message: str) -> None:
        self.problems.append(InputError(key, message))

    def where(self, one: MeshSet) -> str:
        """Return a set and where it stands, for messages."""
        return f"{one.name}" + (f" in line {one.line}" if one.line else "")

    def chosen(self) -> dict[str, list[MeshSet | str]]:
        """Return the sets, or planes, of each group."""
        found: dict[str, list[MeshSet | str]] = {}
        for group, value in self.wanted.items():
            names = [value] if isinstance(value, str) else list(value)
            if not group.startswith(tuple(f"{body}_" for body in BODIES)):
                self.wrong(f"geometry.groups.{group}", "expected a group that starts with punch_ or strip_")
                continue
            found[group] = []
            for name in names:
                if name and PLANE.fullmatch(name) and normal(name) not in self.by_name:
                    found[group].append(name)
                elif name:
                    found[group] += self.named(group, name)
        mapped = {one.name for sets in found.values() for one in sets if isinstance(one, MeshSet)}
        alike: dict[str, list[MeshSet]] = {}
        for key, sets in self.by_name.items():
            group = self.by_role(key)
            if group.startswith(tuple(f"{body}_" for body in BODIES)) and group not in self.wanted:
                alike.setdefault(group, []).extend(one for one in sets if one.name not in mapped)
        for group, own in alike.items():
            found[group] = list(own)
            if len({normal(one.name) for one in own}) > 1:
                text = f"several sets have this name: {listed(one.name for one in own)}. Name one of them, or all"
                self.wrong(f"geometry.groups.{group}", text)
        return {group: sets for group, sets in found.items() if sets}

    def named(self, group: str, name: str) -> list[MeshSet]:
        """Return the sets of a name."""
        key = normal(name)
        if key in self.by_name:
            return self.by_name[key]
        close = difflib.get_close_matches(key, self.by_name, n=1)
        hint = f"Did you mean {self.by_name[close[0]][0].name!r}? " if close else ""
        has = listed(one.name for one in self.mesh.sets)
        self.wrong(f"geometry.groups.{group}", f"{self.mesh.name} has no set {name!r}. {hint}It has {has}.")
        return []

    def regions(self, chosen: Mapping[str, list[MeshSet | str]], dim: int) -> list[Group]:
        """Return the groups that are regions, and complain of those that hold nothing."""
        groups = []
        for name, sets in chosen.items():
            real = [one for one in sets if isinstance(one, MeshSet)]
            for one in real:
                if not len(one.members):
                    self.wrong(
                        name, f'the set {self.where(one)} of {self.mesh.name} is empty. Fill it, or leave it out by "".'
                    )
            cells = [one for one in real if one.of == "elements" and self.mesh.set_dim(one) == dim]
            if not cells or (len(cells) < len(real) and not self.is_region(name, cells, real)):
                continue
            elements = np.unique(np.concatenate([one.members for one in cells]))
            elements = elements[self.mesh.element_dims(elements) == dim]
            kinds = self.mesh.cells(elements)
            unusable = [KINDS[kind].name for kind in kinds if kind not in USABLE]
            if unusable:
                text = f"has {unusable[0]}: {self.mesh.place(self.first_of(elements, unusable[0]))}"
                self.wrong(name, f"the set {self.where(cells[0])} {text}. Mesh it with other elements.")
            if any(len(_unique(rows)) < len(rows) for rows in kinds.values()):
                self.wrong(self.mesh.name, f"some elements of {name} are there twice. Remove one of them.")
            bad = bad_elements(self.mesh, elements)
            if len(bad):
                text = ", ".join(self.mesh.place(int(one)) for one in bad[:SHOWN])
                rest = f" and {len(bad) - SHOWN} more" if len(bad) > SHOWN else ""
                message = f"degenerate or twisted: {text}{rest}. Check the order of their nodes, or mesh it again."
                self.wrong(f"{self.mesh.name}: {name}", message)
            groups.append(Group(name, dim, kinds, ", ".join(map(self.where, cells)), elements))
        return groups

    def is_region(self, name: str, cells: list[MeshSet], every: list[MeshSet]) -> bool:
        """Return whether of sets of one name, of elements and of others, the elements are meant."""
        if any(name.startswith(f"{body}_contact") for body in BODIES) or any(one.of == "sides" for one in every):
            return False
        nodes = [one.members for one in every if one.of == "nodes"]
        if not nodes:
            return False
        corners = [part.ravel() for one in cells for part in self.mesh.cells(one.members).values()]
        return np.array_equal(np.unique(np.concatenate(corners)), np.unique(np.concatenate(nodes)))

    def first_of(self, elements: Any, kind: str) -> int:
        return next(int(e) for e in elements if KINDS[self.mesh.blocks[int(self.mesh.block_of(e))].kind].name == kind)

    def elements_of(self, regions: list[Group], body: str) -> Ints:
        """Return the elements of a body (n,)."""
        own = [one.elements for one in regions if one.name.startswith(f"{body}_")]
        return np.unique(np.concatenate([np.zeros(0, np.int64), *own]))

    def lower(self, name: str, sets: list[MeshSet | str], bodies: Mapping[str, _Sides], dim: int) -> list[Group]:
        """Return a group of facets or points; none where something is wrong."""
        body = bodies[name.partition("_")[0]]
        source = ", ".join(one if isinstance(one, str) else self.where(one) for one in sets)
        cells: dict[int, Ints] = {}
        points: list[Ints] = []
        for one in self.counting(sets, dim):
            if isinstance(one, MeshSet) and one.of == "elements" and self.mesh.set_dim(one) == dim:
                text = f"has {ENTITIES[dim]} elements; expected {ENTITIES[dim - 1]} elements, their faces or nodes"
                self.wrong(name, f"the set {self.where(one)} {text}. Name a surface or a node set.")
                continue
            found, alone = self.facets(name, one, body)
            for kind, rows in found.items():
                cells[kind] = stacked(cells.get(kind), rows)
            points += [alone] if len(alone) else []
        if cells:
            largest = max(KINDS[kind].dim for kind in cells)
            kept = {kind: _unique(rows) for kind, rows in cells.items() if KINDS[kind].dim == largest}
            return [Group(name, largest, kept, source)]
        return [Group(name, 0, {15: np.unique(np.concatenate(points))[:, None]}, source)] if points else []

    def counting(self, sets: list[MeshSet | str], dim: int) -> list[MeshSet | str]:
        """Return the sets of a group of facets that count: sides before nodes before elements of bodies."""
        of = [one.of for one in sets if isinstance(one, MeshSet)]
        if "sides" in of:
            return [one for one in sets if isinstance(one, str) or one.of == "sides"]
        if "nodes" in of:
            return [one for one in sets if isinstance(one, str) or one.of == "nodes" or self.mesh.set_dim(one) < dim]
        return sets

    def facets(self, name: str, one: MeshSet | str, body: _Sides) -> tuple[dict[int, Ints], Ints]:
        """Return the facets that a set, or a plane, gives by their kind, or else its points."""
        none, boundary = np.zeros(0, np.int64), body.boundary
        if isinstance(one, str) or one.of == "nodes":
            nodes = self.on_plane(name, one) if isinstance(one, str) else one.members
            own = self.facets_within(boundary, nodes)
            if isinstance(one, str) and not len(own):
                spot = f"{self.mesh.name} has no facets of this body on the plane {one!r}. Correct the place."
                self.wrong(f"geometry.groups.{name}", spot)
            return self.mesh.sides(own), none if len(own) else nodes
        if one.of == "sides":
            inner = ~_rows_in(self.mesh.side_corners(one.members), self.mesh.side_corners(boundary))
            if inner.any():
                place = self.mesh.place(int(one.members[inner][0, 0]))
                text = f"the surface {self.where(one)} has faces that are not on the boundary of the body's regions"
                self.wrong(name, f"{text}, such as one of {place}. Correct the faces, or the regions.")
            return self.mesh.sides(one.members), none
        if self.mesh.set_dim(one) == 0:
            return {}, np.concatenate([rows.ravel() for rows in self.mesh.cells(one.members).values()])
        cells = self.mesh.cells(one.members)
        stray = sum(int((~body.has(rows[:, : KINDS[kind].corners])).sum()) for kind, rows in cells.items())
        if stray and self.mesh.set_dim(one) == self.mesh.dim - 1:
            text = f"has {stray} elements that are no sides of the elements of its body. Correct the set."
            self.wrong(name, f"the set {self.where(one)} of {self.mesh.name} {text}")
        return cells, none

    def on_plane(self, name: str, text: str) -> Ints:
        """Return the points on a plane such as "y = 0 mm"."""
        match = PLANE.fullmatch(text)
        assert match is not None
        points = self.scale * self.mesh.points
        try:
            at = self.length(match["at"])
        except ValueError as error:
            self.wrong(f"geometry.groups.{name}", str(error))
            return np.zeros(0, np.int64)
        column = "xyz".index("x" if match["axis"] == "r" else match["axis"])
        return np.flatnonzero(np.abs(points[:, column] - at) <= ON_PLANE * np.ptp(points, axis=0).max())

    def facets_within(self, boundary: Ints, nodes: Ints) -> Ints:
        """Return the sides of a boundary whose corners are all among some points."""
        inside = np.zeros(len(self.mesh.points) + 1, dtype=bool)
        inside[nodes] = True
        inside[-1] = True  # what a side has fewer corners than four
        return boundary[inside[self.mesh.side_corners(boundary)].all(axis=1)] if len(boundary) else boundary

    def check(self, groups: list[Group], regions: list[Group], dim: int) -> None:
        """Complain of bodies without a region or a contact, of mixed kinds, and of elements in two groups."""
        has = listed(one.name for one in self.mesh.sets)
        for body in BODIES:
            kinds = {KINDS[kind].name: one for one in regions if one.name.startswith(f"{body}_") for kind in one.cells}
            if len(kinds) > 1:
                names, last = " and ".join(kinds), list(kinds)[-1]
                place = self.mesh.place(self.first_of(kinds[last].elements, last))
                text = f"the {body} mixes {names} (such as {place}). Mesh it with elements of one kind."
                self.wrong(self.mesh.name, text)
            whole = any(one.name.startswith(f"{body}_") for one in regions)
            if not whole:
                text = f"no set of {ENTITIES[dim]} elements is named {body}_...: set geometry.groups.{body}_body"
                self.wrong(self.mesh.name, f'{text} = "SET". It has {has}.')
            contacts = [one for one in groups if one.name.startswith(f"{body}_contact")]
            named = [one.name for one in contacts if one.name != f"{body}_contact"]
            if 0 < len(named) < len(contacts):
                text = f"has {body}_contact and {listed(named)}. Keep {body}_contact alone, or the others"
                self.wrong(self.mesh.name, text)
            for one in contacts:
                if whole and one.dim != dim - 1:
                    text = f"{one.source} has no whole facet of the {body}; expected {ENTITIES[dim - 1]} elements"
                    self.wrong(one.name, f"{text} or all nodes of facets. Correct the set in {self.mesh.name}.")
            if not contacts:
                text = f"no set of facets or their nodes is named {body}_contact: set geometry.groups.{body}_contact"
                self.wrong(self.mesh.name, f'{text} = "SET", or a plane: "y = 0 mm". It has {has}.')
        facets = ([one for one in groups if one.dim == dim - 1 and one.name.startswith(body)] for body in BODIES)
        for alike in (regions, *facets):
            for first, second, rows in _shared(alike):
                kind = ENTITIES[first.dim]
                text = f"{first.name} (set {first.source}) and {second.name} (set {second.source}) share {rows} {kind}"
                other = second if first.name.endswith("_contact") else first
                advice = f'Leave one out by geometry.groups: {other.name} = "", or name another set'
                self.wrong(self.mesh.name, f"{text} elements. {advice}.")


def _unique(rows: Ints) -> Ints:
    """Return rows of points without those that are there before in another order."""
    order, new = sorted_rows(np.sort(rows, axis=1))
    return rows[np.sort(order[new])]


def _rows_in(rows: Ints, among: Ints) -> Any:
    """Return which rows are among others (n,)."""
    known = {row.tobytes() for row in np.ascontiguousarray(among)}
    return np.array([row.tobytes() in known for row in np.ascontiguousarray(rows)], dtype=bool)


def _shared(groups: list[Group]) -> list[tuple[Group, Group, int]]:
    """Return pairs of groups with elements in common, and how many."""
    found: list[tuple[Group, Group, int]] = []
    for kind in sorted({kind for one in groups for kind in one.cells}):
        own = [one for one in groups if kind in one.cells]
        rows = np.concatenate([np.sort(one.cells[kind], axis=1) for one in own])
        owner = np.repeat(np.arange(len(own)), [len(one.cells[kind]) for one in own])
        order, new = sorted_rows(rows)
        same = ~new[1:]
        pairs = np.sort(np.column_stack([owner[order[1:][same]], owner[order[:-1][same]]]), axis=1)
        different = pairs[pairs[:, 0] != pairs[:, 1]]
        for (a, b), count in zip(*np.unique(different, axis=0, return_counts=True), strict=True):
            found.append((own[a], own[b], int(count)))
    return found


def into_gmsh(gmsh: Any, mesh: GroupedMesh, name: Callable[[str], str]) -> None:
    """Add the groups to gmsh's current model: each is a discrete entity and a physical group, with a name."""
    used = np.unique(np.concatenate([cells.ravel() for one in mesh.groups for cells in one.cells.values()]))
    first = True
    for tag, one in enumerate(sorted(mesh.groups, key=lambda group: -group.dim), start=1):
        gmsh.model.addDiscreteEntity(one.dim, tag)
        if first:
            gmsh.model.mesh.addNodes(one.dim, tag, used + 1, mesh.points[used].ravel())
            first = False
        for kind, cells in one.cells.items():
            gmsh.model.mesh.addElementsByType(tag, kind, [], cells.ravel() + 1)
        gmsh.model.addPhysicalGroup(one.dim, [tag], tag)
        gmsh.model.setPhysicalName(one.dim, tag, name(one.name))
