"""A mesh as a file has it: points, elements and named sets, with the lines that name them.

Elements are numbered through all blocks. A set holds elements, sides of elements, or nodes. Kinds of elements and the
order of their nodes are gmsh's; second-order quadrilaterals and hexahedra without middle nodes get them from their own
(serendipity) shape functions, which leaves the shape as it is.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal
from xml.etree import ElementTree

import basix
import numpy as np
from numpy.typing import NDArray

from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError

Ints = NDArray[np.int64]
FLATTEST = 1e-6  # sine of a corner, or scaled Jacobian, below which an element is degenerate
FLAT = 1e-9  # of the mesh's size: what a node may lie out of its plane; of an element's: the shortest edge
SHOWN = 8  # sets or elements that an error lists
AT_ONCE = 20_000  # elements that are looked at at a time
ENTITIES = ("point", "curve", "surface", "volume")  # gmsh's words for groups of dimension 0 to 3


@dataclass(frozen=True)
class Kind:
    """A kind of element.

    Attributes:
        name: For messages.
        dim: Its dimension.
        corners: Number of its corners.
        nodes: Number of its nodes.
        sides: Corners of each side, in the order of Abaqus' face numbers.
        edges: Corners of the edge of each node behind the corners.
        middles: Corners of the face of each node behind those, and last none for the volume.
    """

    name: str
    dim: int
    corners: int
    nodes: int
    sides: tuple[tuple[int, ...], ...] = ()
    edges: tuple[tuple[int, int], ...] = ()
    middles: tuple[tuple[int, ...], ...] = ()

    def side_nodes(self, side: int) -> list[int]:
        """Return all nodes of a side, in gmsh's order of the kind that the side is."""
        corners = self.sides[side]
        if not self.edges:
            return list(corners)
        ends = {frozenset(edge): self.corners + k for k, edge in enumerate(self.edges)}
        around = corners[:1] if len(corners) == 2 else corners
        mids = [ends[frozenset((corner, corners[(k + 1) % len(corners)]))] for k, corner in enumerate(around)]
        faces = {frozenset(face): self.corners + len(self.edges) + k for k, face in enumerate(self.middles)}
        middle = [faces[frozenset(corners)]] if frozenset(corners) in faces and len(corners) == 4 else []
        return [*corners, *mids, *middle]


_TRI = ((0, 1), (1, 2), (2, 0))
_QUAD = ((0, 1), (1, 2), (2, 3), (3, 0))
_TET = ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))
_HEX = ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0))
_WEDGE = ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0))
_PYRAMID = ((0, 1, 2, 3), (0, 4, 1), (1, 4, 2), (2, 4, 3), (3, 4, 0))
_TET_EDGES = ((0, 1), (1, 2), (2, 0), (3, 0), (2, 3), (1, 3))
_HEX_EDGES = (
    (0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7)
)  # fmt: skip
_HEX_FACES = ((0, 3, 2, 1), (0, 1, 5, 4), (0, 4, 7, 3), (1, 2, 6, 5), (2, 3, 7, 6), (4, 5, 6, 7))

KINDS: Mapping[int, Kind] = {  # by gmsh's number
    15: Kind("points", 0, 1, 1),
    1: Kind("lines", 1, 2, 2, ((0,), (1,))),
    8: Kind("second-order lines", 1, 2, 3, ((0,), (1,))),
    2: Kind("triangles", 2, 3, 3, _TRI),
    3: Kind("quadrilaterals", 2, 4, 4, _QUAD),
    9: Kind("second-order triangles", 2, 3, 6, _TRI, _TRI),
    16: Kind("second-order quadrilaterals", 2, 4, 8, _QUAD, _QUAD),
    10: Kind("second-order quadrilaterals", 2, 4, 9, _QUAD, _QUAD, ((0, 1, 2, 3),)),
    4: Kind("tetrahedra", 3, 4, 4, _TET),
    5: Kind("hexahedra", 3, 8, 8, _HEX),
    6: Kind("wedges", 3, 6, 6, _WEDGE),
    7: Kind("pyramids", 3, 5, 5, _PYRAMID),
    11: Kind("second-order tetrahedra", 3, 4, 10, _TET, _TET_EDGES),
    17: Kind("second-order hexahedra", 3, 8, 20, _HEX, _HEX_EDGES),
    12: Kind("second-order hexahedra", 3, 8, 27, _HEX, _HEX_EDGES, (*_HEX_FACES, ())),
}
SIDE_KINDS = {1: 15, 2: 1, 3: 2, 4: 3, 6: 9, 9: 10, 8: 16}  # by the number of nodes; three are a line in a plane
FULL = {16: 10, 17: 12}  # the kinds with all middle nodes
# Nodes of Abaqus and VTK in gmsh's order, of kinds where they differ.
ORDERS = {11: [0, 1, 2, 3, 4, 5, 6, 7, 9, 8],
          17: [0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 16, 9, 17, 10, 18, 19, 12, 15, 13, 14]}  # fmt: skip
USABLE = (2, 3, 4, 5, 9, 10, 11, 12)  # of which bodies are made


@dataclass(frozen=True)
class Block:
    """Elements of one kind.

    Attributes:
        kind: gmsh's number.
        nodes: Points of each element (n, k).
        labels: Their numbers in the file (n,).
        lines: Where they stand in the file (n,); 0 where it has no lines.
    """

    kind: int
    nodes: Ints
    labels: Ints
    lines: Ints

    @classmethod
    def of(cls, kind: int, nodes: Ints, first: int = 1) -> Block:
        """Return a block of a file without numbers and lines."""
        return cls(kind, nodes, first + np.arange(len(nodes)), np.zeros(len(nodes), np.int64))


@dataclass(frozen=True, eq=False)
class MeshSet:
    """A named set.

    Attributes:
        name: As the file writes it.
        of: Contents.
        members: Elements or points (n,); of sides each element and the number of its side (n, 2).
        line: Where the file names it; 0 where it has no lines.
    """

    name: str
    of: Literal["elements", "sides", "nodes"]
    members: Ints
    line: int = 0


@dataclass(frozen=True)
class MeshFile:
    """Contents of a mesh file.

    Attributes:
        name: Of the file.
        points: (n, 3), in the file's unit of length.
        blocks: Its elements.
        sets: Its named sets.
        notes: Descriptions of parts left out or changed, for people.
    """

    name: str
    points: Array
    blocks: tuple[Block, ...]
    sets: tuple[MeshSet, ...]
    notes: tuple[str, ...] = ()

    @property
    def dim(self) -> int:
        """Largest dimension of the elements."""
        return max((KINDS[block.kind].dim for block in self.blocks if len(block.nodes)), default=0)

    @property
    def starts(self) -> Ints:
        """Number of each block's first element, and of all elements."""
        return np.cumsum([0, *(len(block.nodes) for block in self.blocks)])

    def set_dim(self, mesh_set: MeshSet) -> int:
        """Return the largest dimension of what a set holds."""
        if mesh_set.of == "nodes":
            return 0
        dims = self.element_dims(mesh_set.members if mesh_set.of == "elements" else mesh_set.members[:, 0])
        return int(dims.max(initial=0)) - (mesh_set.of == "sides")

    def element_dims(self, elements: Ints) -> Ints:
        """Return the dimensions of elements."""
        dims = np.array([KINDS[block.kind].dim for block in self.blocks], dtype=np.int64)
        return dims[self.block_of(elements)]

    def block_of(self, elements: Ints) -> Ints:
        """Return the blocks of elements."""
        return np.searchsorted(self.starts, elements, side="right") - 1

    def by_block(self, elements: Ints) -> Iterator[tuple[Block, Ints, Ints]]:
        """Yield each block of elements, those that are of it, and the rows of their nodes (n, k)."""
        of = self.block_of(elements)
        for number in np.unique(of):
            block, block_elements = self.blocks[number], elements[of == number]
            yield block, block_elements, block.nodes[block_elements - self.starts[number]]

    def cells(self, elements: Ints) -> dict[int, Ints]:
        """Return the points of elements (n, k) by their kind."""
        points: dict[int, Ints] = {}
        for block, _, nodes in self.by_block(elements):
            points[block.kind] = stacked(points.get(block.kind), nodes)
        return points

    def sides(self, members: Ints) -> dict[int, Ints]:
        """Return the points of sides (n, k) by their kind, of elements and numbers of sides (n, 2)."""
        points: dict[int, Ints] = {}
        blocks = self.block_of(members[:, 0])
        for number in np.unique(blocks):
            block = self.blocks[number]
            kind = KINDS[block.kind]
            for side in range(len(kind.sides)):
                rows = members[(blocks == number) & (members[:, 1] == side), 0] - self.starts[number]
                columns = kind.side_nodes(side)
                of = 8 if kind.dim == 2 and len(columns) == 3 else SIDE_KINDS[len(columns)]
                if len(rows):
                    points[of] = stacked(points.get(of), block.nodes[rows][:, columns])
        return points

    def all_sides(self, elements: Ints) -> Ints:
        """Return every side of elements (n, 2): the element and the number of the side."""
        pairs = [np.zeros((0, 2), np.int64)]
        for block, block_elements, _ in self.by_block(elements):
            for side in range(len(KINDS[block.kind].sides)):
                pairs.append(np.column_stack([block_elements, np.full(len(block_elements), side)]))
        return np.concatenate(pairs)

    def side_corners(self, members: Ints) -> Ints:
        """Return the corners of sides, ascending and filled with -1 (n, 4)."""
        corner_rows = np.full((len(members), 4), -1, dtype=np.int64)
        blocks = self.block_of(members[:, 0])
        for number in np.unique(blocks):
            block = self.blocks[number]
            for side, corners in enumerate(KINDS[block.kind].sides):
                mask = (blocks == number) & (members[:, 1] == side)
                corner_rows[mask, : len(corners)] = block.nodes[members[mask, 0] - self.starts[number]][
                    :, list(corners)
                ]
        return np.sort(corner_rows, axis=1)

    def boundary(self, elements: Ints) -> Ints:
        """Return the sides of one of these elements alone (n, 2)."""
        every = self.all_sides(elements)
        order, new = sorted_rows(self.side_corners(every))
        alone = new & np.append(new[1:], True) if len(new) else new
        return every[np.sort(order[alone])]

    def place(self, element: int) -> str:
        """Return an element's number and line, for messages."""
        number = int(self.block_of(np.array([element]))[0])
        block, row = self.blocks[number], element - int(self.starts[number])
        line = f" (line {block.lines[row]})" if block.lines[row] else ""
        return f"element {block.labels[row]}{line}"

    def measure(self, mesh_set: MeshSet) -> float:
        """Return the length, area or volume of a set, in powers of the file's unit; 0 of nodes."""
        if mesh_set.of == "nodes":
            return 0.0
        if mesh_set.of == "sides":
            return measure(self.points, self.sides(mesh_set.members))
        dims = self.element_dims(mesh_set.members)
        return measure(self.points, self.cells(mesh_set.members[dims == dims.max(initial=0)]))


def in_space(x: Array) -> Array:
    """Return coordinates (n, 1 to 3) with all three (n, 3)."""
    return np.pad(np.asarray(x, dtype=np.float64), ((0, 0), (0, 3 - x.shape[1])))


def stacked(above: Ints | None, below: Ints) -> Ints:
    """Return rows below others, if there are any."""
    return below if above is None else np.vstack([above, below])


def sorted_rows(rows: Ints) -> tuple[Ints, NDArray[np.bool_]]:
    """Return an order in which equal rows follow each other, and where in it a new row begins.

    Args:
        rows: Numbers from -1 to 2^31 - 2 (n, k).
    """
    shifted = np.pad(rows + 1, ((0, 0), (0, rows.shape[1] % 2)))
    pairs = (shifted[:, ::2] << 32) | shifted[:, 1::2]
    order = np.lexsort(pairs.T)
    new = np.ones(len(rows), dtype=bool)
    new[1:] = (pairs[order[1:]] != pairs[order[:-1]]).any(axis=1)
    return order, new


def measure(points: Array, cells: Mapping[int, Ints]) -> float:
    """Return the length, area or volume of elements by their kind: of polygons through edge nodes, of corners in space.

    Args:
        points: Coordinates (n, 3).
        cells: Points of elements (n, k) by gmsh's number of their kind.
    """
    total = 0.0
    for number, nodes in cells.items():
        kind = KINDS[number]
        if kind.dim == 1:
            ends = nodes[:, [0, 2, 1]] if kind.nodes == 3 else nodes
            total += float(np.linalg.norm(np.diff(points[ends], axis=1), axis=2).sum())
        elif kind.dim == 2:
            around = np.arange(kind.corners)
            if kind.nodes > kind.corners:
                around = np.column_stack([around, around + kind.corners]).ravel()
            total += float(np.linalg.norm(_polygons(points[nodes[:, around]]), axis=1).sum())
        elif kind.dim == 3:
            total += float(np.abs(_volumes(points, nodes, kind)).sum())
    return total


def _polygons(x: Array) -> Array:
    """Return the area vectors (n, 3) of polygons of corners x (n, k, 3)."""
    spokes = x[:, 1:] - x[:, :1]
    return np.asarray(np.cross(spokes[:, :-1], spokes[:, 1:]).sum(axis=1) / 2)


def _volumes(points: Array, nodes: Ints, kind: Kind) -> Array:
    """Return the volumes of elements (n,), whose sides are cut into triangles around their middles."""
    middle = points[nodes[:, : kind.corners]].mean(axis=1)
    total = np.zeros(len(nodes))
    for corners in kind.sides:
        x = points[nodes[:, list(corners)]] - middle[:, None]
        centre = x.mean(axis=1)
        for k in range(len(corners)):
            total += np.einsum("ni,ni->n", centre, np.cross(x[:, k], x[:, (k + 1) % len(corners)])) / 6
    return total


CELLS = {(2, 3): "triangle", (2, 4): "quadrilateral", (3, 4): "tetrahedron", (3, 8): "hexahedron"}
AROUND = {"quadrilateral": [0, 1, 3, 2], "hexahedron": [0, 1, 3, 2, 4, 5, 7, 6]}  # basix' corners in gmsh's order


@lru_cache
def _slopes(number: int) -> Array:
    """Return the derivatives of a kind's shape functions at its nodes (d, nodes, functions), in gmsh's order."""
    kind = KINDS[number]
    name = CELLS[kind.dim, kind.corners]
    corners = basix.geometry(basix.CellType[name])[AROUND.get(name, slice(None))]
    spans = [[k] for k in range(kind.corners)] + [list(span) or slice(None) for span in (*kind.edges, *kind.middles)]
    points = np.array([corners[span].mean(axis=0) for span in spans])
    degree = 1 if kind.nodes == kind.corners else 2
    variant = basix.LagrangeVariant.equispaced
    table = basix.create_element(basix.ElementFamily.P, basix.CellType[name], degree, variant).tabulate(1, points)
    return np.asarray(table[1:, :, table[0, :, :, 0].argmax(axis=1), 0])


def bad_elements(mesh: MeshFile, elements: Ints) -> Ints:
    """Return the elements that are degenerate or twisted at a node; mirrored elements are neither."""
    bad = [np.zeros(0, np.int64)]
    for block, block_elements, nodes in mesh.by_block(elements):
        if block.kind not in USABLE:
            continue
        slopes = _slopes(block.kind)
        for some in (slice(k, k + AT_ONCE) for k in range(0, len(block_elements), AT_ONCE)):
            x = mesh.points[nodes[some]][:, :, : KINDS[block.kind].dim]
            edges = np.tensordot(x, slopes, (1, 2)).transpose(0, 3, 2, 1)  # (n, nodes, along, d)
            sizes = np.linalg.norm(edges, axis=3)
            signs = np.linalg.det(edges) / np.maximum(np.prod(sizes, axis=2), 1e-300)
            good = (signs > FLATTEST).all(axis=1) | (signs < -FLATTEST).all(axis=1)
            good &= sizes.min(axis=(1, 2)) > FLAT * sizes.max(axis=(1, 2))
            bad.append(block_elements[some][~good])
    return np.concatenate(bad)


def sound(mesh: MeshFile) -> MeshFile:
    """Return the mesh with all middle nodes.

    Raises:
        CaseError: it has coordinates that are no numbers, or no elements of which bodies are made.
    """
    if not np.isfinite(mesh.points).all():
        raise CaseError(InputError(mesh.name, "has coordinates that are no numbers. Write the file again."))
    mesh = completed(mesh)
    if not any(block.kind in USABLE for block in mesh.blocks if len(block.nodes)):
        message = "has no triangles, quadrilaterals, tetrahedra or hexahedra to make bodies of. Export its mesh."
        raise CaseError(InputError(mesh.name, message))
    return mesh


def completed(mesh: MeshFile) -> MeshFile:
    """Return the mesh with middle nodes in its second-order quadrilaterals and hexahedra."""
    if not any(block.kind in FULL for block in mesh.blocks):
        return mesh
    points, blocks, count = [mesh.points], [], len(mesh.points)
    known: dict[tuple[int, ...], int] = {}
    for block in mesh.blocks:
        if block.kind not in FULL:
            blocks.append(block)
            continue
        kind, full = KINDS[block.kind], KINDS[FULL[block.kind]]
        x, columns = mesh.points[block.nodes], [block.nodes]
        for face in full.middles:
            edges = [k for k, edge in enumerate(kind.edges) if not face or set(edge) <= set(face)]
            corners = list(face) or list(range(kind.corners))
            mids = x[:, [kind.corners + k for k in edges]]
            middle = mids.sum(axis=1) * (1 / 2 if face else 1 / 4) - x[:, corners].sum(axis=1) / 4
            rows: Any = np.sort(block.nodes[:, corners], axis=1).tolist()
            keys: list[tuple[int, ...]] = [tuple(row) for row in rows]
            numbers = np.empty(len(keys), dtype=np.int64)
            new: list[int] = []
            for row, key in enumerate(keys):
                if key not in known:
                    known[key] = count + len(new)
                    new.append(row)
                numbers[row] = known[key]
            points.append(middle[new])
            count += len(new)
            columns.append(numbers[:, None])
        blocks.append(replace(block, kind=FULL[block.kind], nodes=np.hstack(columns)))
    return replace(mesh, points=np.concatenate(points), blocks=tuple(blocks))


def in_plane(mesh: MeshFile) -> MeshFile:
    """Return a flat mesh in the plane of x and y: one in the plane of x and z is turned.

    Raises:
        CaseError: it lies in another plane, or in none.
    """
    if mesh.dim != 2:
        return mesh
    used = np.unique(np.concatenate([b.nodes.ravel() for b in mesh.blocks if KINDS[b.kind].dim == 2]))
    thick = np.ptp(mesh.points[used], axis=0)
    flat = thick <= FLAT * thick.max()
    if flat[2]:
        return mesh
    if flat[1]:
        turned = mesh.points[:, [0, 2, 1]] * [1.0, 1.0, 0.0]
        return replace(mesh, points=turned, notes=(*mesh.notes, "z was taken for y: the mesh lies in the x-z plane"))
    spread = ", ".join(f"{name} over {width:.4g}" for name, width in zip("xyz", thick, strict=True))
    message = f"its surface elements lie in no plane of x and y: they reach {spread}. Give a plane mesh, or solids."
    raise CaseError(InputError(mesh.name, message))


BROKEN = (OSError, KeyError, ValueError, IndexError, TypeError, AttributeError, RuntimeError, MemoryError,
          ArithmeticError, ElementTree.ParseError)  # fmt: skip


@contextmanager
def read_as(path: Path, kind: str) -> Iterator[None]:
    """Let what readers raise on a broken file name the file.

    Raises:
        CaseError: it cannot be read.
    """
    try:
        yield
    except BROKEN as error:
        text = str(error).partition("\n")[0][:140] or type(error).__name__
        message = f"cannot be read as {kind}: {text}. Write the file again, or convert it to .msh."
        raise CaseError(InputError(path.name, message)) from None


def known_nodes(nodes: Ints, points: int, of: str) -> Ints:
    """Return the nodes of elements or of a set, counted from 0.

    Raises:
        ValueError: one does not exist.
    """
    if nodes.size and not (nodes.min() >= 0 and nodes.max() < points):
        raise ValueError(f"{of} has nodes that do not exist")
    return nodes


def wrong(file: str, line: int, message: str) -> CaseError:
    """Return the error of a line of a file."""
    return CaseError(InputError(f"{file}, line {line}" if line else file, message))


def listed(names: Iterable[str]) -> str:
    """Return names for a message, not too many."""
    every = sorted(set(names), key=str.casefold)
    rest = f" and {len(every) - 2 * SHOWN} more" if len(every) > 2 * SHOWN else ""
    return ", ".join(every[: 2 * SHOWN]) + rest or "none"
