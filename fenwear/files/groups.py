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
                "group": group.name, "set": group.source, "dim": group.dim, "elements": group.count,
                "nodes": len(np.unique(np.concatenate([cells.ravel() for cells in group.cells.values()]))),
                "measure": MEASURES[group.dim], "size": measure(self.points, group.cells),
            }
            for group in sorted(self.groups, key=lambda group: (group.name.partition("_")[0], -group.dim, group.name))
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
        """The corners of all, ascending and real_set with -1 (n, 4)."""
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
        for mesh_set in mesh.sets:
            self.by_name.setdefault(normal(mesh_set.name), []).append(mesh_set)
        for mesh_set in mesh.sets:  # the name without that of its instance, where no other has it
            short = normal(mesh_set.name.rpartition(".")[2])
            if "." in mesh_set.name:
                self.by_name.setdefault(short, []).append(mesh_set)

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
        region_blocks = {k for k, b in enumerate(self.mesh.blocks) if KINDS[b.kind].dim == dim}
        left = sum(len(self.mesh.blocks[k].nodes) for k in region_blocks) - sum(r.count for r in regions)
        if left:
            notes.append(f"in no region, left out: {left:,} {ENTITIES[dim]} elements")
        unused = tuple(mesh_set.name for mesh_set in self.mesh.sets if mesh_set not in used)
        return GroupedMesh(self.scale * self.mesh.points, tuple(groups), unused, tuple(notes))

    def wrong(self, key: str, message: str) -> None:
        self.problems.append(InputError(key, message))

    def where(self, mesh_set: MeshSet) -> str:
        """Return a set and where it stands, for messages."""
        return f"{mesh_set.name}" + (f" in line {mesh_set.line}" if mesh_set.line else "")

    def chosen(self) -> dict[str, list[MeshSet | str]]:
        """Return the sets, or planes, of each group."""
        chosen: dict[str, list[MeshSet | str]] = {}
        for group, value in self.wanted.items():
            names = [value] if isinstance(value, str) else list(value)
            if not group.startswith(tuple(f"{body}_" for body in BODIES)):
                self.wrong(f"geometry.groups.{group}", "expected a group that starts with punch_ or strip_")
                continue
            chosen[group] = []
            for name in names:
                if name and PLANE.fullmatch(name) and normal(name) not in self.by_name:
                    chosen[group].append(name)
                elif name:
                    chosen[group] += self.named(group, name)
        mapped = {mesh_set.name for sets in chosen.values() for mesh_set in sets if isinstance(mesh_set, MeshSet)}
        alike: dict[str, list[MeshSet]] = {}
        for key, sets in self.by_name.items():
            group = self.by_role(key)
            if group.startswith(tuple(f"{body}_" for body in BODIES)) and group not in self.wanted:
                alike.setdefault(group, []).extend(mesh_set for mesh_set in sets if mesh_set.name not in mapped)
        for group, namesakes in alike.items():
            chosen[group] = list(namesakes)
            if len({normal(mesh_set.name) for mesh_set in namesakes}) > 1:
                known = listed(mesh_set.name for mesh_set in namesakes)
                text = f"several sets have this name: {known}. Name one of them, or all"
                self.wrong(f"geometry.groups.{group}", text)
        return {group: sets for group, sets in chosen.items() if sets}

    def named(self, group: str, name: str) -> list[MeshSet]:
        """Return the sets of a name."""
        key = normal(name)
        if key in self.by_name:
            return self.by_name[key]
        close = difflib.get_close_matches(key, self.by_name, n=1)
        hint = f"Did you mean {self.by_name[close[0]][0].name!r}? " if close else ""
        has = listed(mesh_set.name for mesh_set in self.mesh.sets)
        self.wrong(f"geometry.groups.{group}", f"{self.mesh.name} has no set {name!r}. {hint}It has {has}.")
        return []

    def regions(self, chosen: Mapping[str, list[MeshSet | str]], dim: int) -> list[Group]:
        """Return the groups that are regions, and complain of those that hold nothing."""
        groups = []
        for name, sets in chosen.items():
            real = [mesh_set for mesh_set in sets if isinstance(mesh_set, MeshSet)]
            for real_set in real:
                if not len(real_set.members):
                    self.wrong(
                        name,
                        f'the set {self.where(real_set)} of {self.mesh.name} is empty. Fill it, or leave it out by "".',
                    )
            cells = [mesh_set for mesh_set in real if mesh_set.of == "elements" and self.mesh.set_dim(mesh_set) == dim]
            if not cells or (len(cells) < len(real) and not self.is_region(name, cells, real)):
                continue
            elements = np.unique(np.concatenate([mesh_set.members for mesh_set in cells]))
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
                text = ", ".join(self.mesh.place(int(element)) for element in bad[:SHOWN])
                rest = f" and {len(bad) - SHOWN} more" if len(bad) > SHOWN else ""
                message = f"degenerate or twisted: {text}{rest}. Check the order of their nodes, or mesh it again."
                self.wrong(f"{self.mesh.name}: {name}", message)
            groups.append(Group(name, dim, kinds, ", ".join(map(self.where, cells)), elements))
        return groups

    def is_region(self, name: str, cells: list[MeshSet], every: list[MeshSet]) -> bool:
        """Return whether of sets of one name, of elements and of others, the elements are meant."""
        if any(name.startswith(f"{body}_contact") for body in BODIES) or any(
            mesh_set.of == "sides" for mesh_set in every
        ):
            return False
        nodes = [mesh_set.members for mesh_set in every if mesh_set.of == "nodes"]
        if not nodes:
            return False
        corners = [part.ravel() for mesh_set in cells for part in self.mesh.cells(mesh_set.members).values()]
        return np.array_equal(np.unique(np.concatenate(corners)), np.unique(np.concatenate(nodes)))

    def first_of(self, elements: Any, kind: str) -> int:
        return next(int(e) for e in elements if KINDS[self.mesh.blocks[int(self.mesh.block_of(e))].kind].name == kind)

    def elements_of(self, regions: list[Group], body: str) -> Ints:
        """Return the elements of a body (n,)."""
        elements = [region.elements for region in regions if region.name.startswith(f"{body}_")]
        return np.unique(np.concatenate([np.zeros(0, np.int64), *elements]))

    def lower(self, name: str, sets: list[MeshSet | str], bodies: Mapping[str, _Sides], dim: int) -> list[Group]:
        """Return a group of facets or points; none where something is wrong."""
        body = bodies[name.partition("_")[0]]
        source = ", ".join(part if isinstance(part, str) else self.where(part) for part in sets)
        cells: dict[int, Ints] = {}
        points: list[Ints] = []
        for chosen_set in self.counting(sets, dim):
            if isinstance(chosen_set, MeshSet) and chosen_set.of == "elements" and self.mesh.set_dim(chosen_set) == dim:
                text = f"has {ENTITIES[dim]} elements; expected {ENTITIES[dim - 1]} elements, their faces or nodes"
                self.wrong(name, f"the set {self.where(chosen_set)} {text}. Name a surface or a node set.")
                continue
            facets, alone = self.facets(name, chosen_set, body)
            for kind, rows in facets.items():
                cells[kind] = stacked(cells.get(kind), rows)
            points += [alone] if len(alone) else []
        if cells:
            largest = max(KINDS[kind].dim for kind in cells)
            kept = {kind: _unique(rows) for kind, rows in cells.items() if KINDS[kind].dim == largest}
            return [Group(name, largest, kept, source)]
        return [Group(name, 0, {15: np.unique(np.concatenate(points))[:, None]}, source)] if points else []

    def counting(self, sets: list[MeshSet | str], dim: int) -> list[MeshSet | str]:
        """Return the sets of a group of facets that count: sides before nodes before elements of bodies."""
        of = [part.of for part in sets if isinstance(part, MeshSet)]
        if "sides" in of:
            return [part for part in sets if isinstance(part, str) or part.of == "sides"]
        if "nodes" in of:
            return [
                part for part in sets if isinstance(part, str) or part.of == "nodes" or self.mesh.set_dim(part) < dim
            ]
        return sets

    def facets(self, name: str, part: MeshSet | str, body: _Sides) -> tuple[dict[int, Ints], Ints]:
        """Return the facets that a set, or a plane, gives by their kind, or else its points."""
        none, boundary = np.zeros(0, np.int64), body.boundary
        if isinstance(part, str) or part.of == "nodes":
            nodes = self.on_plane(name, part) if isinstance(part, str) else part.members
            facets = self.facets_within(boundary, nodes)
            if isinstance(part, str) and not len(facets):
                spot = f"{self.mesh.name} has no facets of this body on the plane {part!r}. Correct the place."
                self.wrong(f"geometry.groups.{name}", spot)
            return self.mesh.sides(facets), none if len(facets) else nodes
        if part.of == "sides":
            inner = ~_rows_in(self.mesh.side_corners(part.members), self.mesh.side_corners(boundary))
            if inner.any():
                place = self.mesh.place(int(part.members[inner][0, 0]))
                text = f"the surface {self.where(part)} has faces that are not on the boundary of the body's regions"
                self.wrong(name, f"{text}, such as one of {place}. Correct the faces, or the regions.")
            return self.mesh.sides(part.members), none
        if self.mesh.set_dim(part) == 0:
            return {}, np.concatenate([rows.ravel() for rows in self.mesh.cells(part.members).values()])
        cells = self.mesh.cells(part.members)
        stray = sum(int((~body.has(rows[:, : KINDS[kind].corners])).sum()) for kind, rows in cells.items())
        if stray and self.mesh.set_dim(part) == self.mesh.dim - 1:
            text = f"has {stray} elements that are no sides of the elements of its body. Correct the set."
            self.wrong(name, f"the set {self.where(part)} of {self.mesh.name} {text}")
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
        has = listed(mesh_set.name for mesh_set in self.mesh.sets)
        for body in BODIES:
            kinds = {
                KINDS[kind].name: region
                for region in regions
                if region.name.startswith(f"{body}_")
                for kind in region.cells
            }
            if len(kinds) > 1:
                names, last = " and ".join(kinds), list(kinds)[-1]
                place = self.mesh.place(self.first_of(kinds[last].elements, last))
                text = f"the {body} mixes {names} (such as {place}). Mesh it with elements of one kind."
                self.wrong(self.mesh.name, text)
            has_region = any(region.name.startswith(f"{body}_") for region in regions)
            if not has_region:
                text = f"no set of {ENTITIES[dim]} elements is named {body}_...: set geometry.groups.{body}_body"
                self.wrong(self.mesh.name, f'{text} = "SET". It has {has}.')
            contacts = [group for group in groups if group.name.startswith(f"{body}_contact")]
            named = [contact.name for contact in contacts if contact.name != f"{body}_contact"]
            if 0 < len(named) < len(contacts):
                text = f"has {body}_contact and {listed(named)}. Keep {body}_contact alone, or the others"
                self.wrong(self.mesh.name, text)
            for contact in contacts:
                if has_region and contact.dim != dim - 1:
                    text = f"{contact.source} has no whole facet of the {body}; expected {ENTITIES[dim - 1]} elements"
                    self.wrong(contact.name, f"{text} or all nodes of facets. Correct the set in {self.mesh.name}.")
            if not contacts:
                text = f"no set of facets or their nodes is named {body}_contact: set geometry.groups.{body}_contact"
                self.wrong(self.mesh.name, f'{text} = "SET", or a plane: "y = 0 mm". It has {has}.')
        facets = (
            [group for group in groups if group.dim == dim - 1 and group.name.startswith(body)] for body in BODIES
        )
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
    shared: list[tuple[Group, Group, int]] = []
    for kind in sorted({kind for group in groups for kind in group.cells}):
        of_kind = [group for group in groups if kind in group.cells]
        rows = np.concatenate([np.sort(group.cells[kind], axis=1) for group in of_kind])
        owner = np.repeat(np.arange(len(of_kind)), [len(group.cells[kind]) for group in of_kind])
        order, new = sorted_rows(rows)
        same = ~new[1:]
        pairs = np.sort(np.column_stack([owner[order[1:][same]], owner[order[:-1][same]]]), axis=1)
        different = pairs[pairs[:, 0] != pairs[:, 1]]
        for (a, b), count in zip(*np.unique(different, axis=0, return_counts=True), strict=True):
            shared.append((of_kind[a], of_kind[b], int(count)))
    return shared


def into_gmsh(gmsh: Any, mesh: GroupedMesh, name: Callable[[str], str]) -> None:
    """Add the groups to gmsh's current model: each is a discrete entity and a physical group, with a name."""
    used = np.unique(np.concatenate([cells.ravel() for group in mesh.groups for cells in group.cells.values()]))
    first = True
    for tag, mesh_group in enumerate(sorted(mesh.groups, key=lambda group: -group.dim), start=1):
        gmsh.model.addDiscreteEntity(mesh_group.dim, tag)
        if first:
            gmsh.model.mesh.addNodes(mesh_group.dim, tag, used + 1, mesh.points[used].ravel())
            first = False
        for kind, cells in mesh_group.cells.items():
            gmsh.model.mesh.addElementsByType(tag, kind, [], cells.ravel() + 1)
        gmsh.model.addPhysicalGroup(mesh_group.dim, [tag], tag)
        gmsh.model.setPhysicalName(mesh_group.dim, tag, name(mesh_group.name))
