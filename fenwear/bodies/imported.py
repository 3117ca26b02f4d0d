"""Meshes of other programs, read by meshio: their named sets become the groups that fenwear knows.

Regions are sets of the elements that the bodies are made of. Facets and points, which contact, supports and loads need,
are sets of elements of a lower dimension, or sets of nodes: a facet of the boundary belongs to a set of nodes that has
all its corners, a set of nodes that has no whole facet is one of points.
"""

from __future__ import annotations

import difflib
import io
import re
from collections.abc import Iterator, Mapping
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fenwear.arrays import Array, Mask
from fenwear.bodies.mesh import BODIES, ENTITIES, gmsh_model
from fenwear.errors import CaseError, InputError, OutputError

Ints = NDArray[np.int64]

# Of each kind of element: gmsh's number, the dimension, the number of corners, its facets by their corners.
SIDES = ((0, 1), (1, 2), (2, 0))
QUAD_SIDES = ((0, 1), (1, 2), (2, 3), (3, 0))
TETRA_FACES = ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))
HEX_FACES = ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
LINEAR: dict[str, tuple[int, int, tuple[tuple[int, ...], ...]]] = {
    "triangle": (2, 2, SIDES),
    "quad": (3, 2, QUAD_SIDES),
    "tetra": (4, 3, TETRA_FACES),
    "hexahedron": (5, 3, HEX_FACES),
}
ABAQUS = re.compile(r"(TYPE\s*=\s*)(?:CPEG?|C?G?AX)(\d)\w*", re.IGNORECASE)  # strain, rings: shapes are what counts
LOWER = {"vertex": (15, 0), "line": (1, 1), "triangle": (2, 2), "quad": (3, 2)}


@dataclass(frozen=True)
class Imported:
    """What became of a mesh's sets.

    Attributes:
        groups: Dimension and number of elements of each group.
        left_out: Sets that are no groups.
    """

    groups: Mapping[str, tuple[int, int]]
    left_out: tuple[str, ...]

    def text(self) -> str:
        """Return it in lines."""
        lines = [f"{name}: {count:,} {ENTITIES[dim]} elements" for name, (dim, count) in sorted(self.groups.items())]
        if self.left_out:
            lines.append(f"left out: {', '.join(self.left_out)}")
        return "\n".join(lines)


def import_mesh(source: Path, target: Path, named: Mapping[str, str], scale: float = 1.0) -> Imported:
    """Write a mesh that meshio reads as a .msh file with fenwear's groups; for one rank.

    Args:
        source: Such as an input file of Abaqus.
        target: The .msh file.
        named: Sets by the groups that they become; others become groups by their own names, whatever their case.
        scale: Millimetres in the mesh's unit of length.

    Raises:
        CaseError: it cannot be read, a set is missing, or it has elements of another kind.
        OutputError: there is no room for it.
    """
    mesh = _read(source)
    kinds = [block.type for block in mesh.cells]
    dim = max((LINEAR[kind][1] for kind in kinds if kind in LINEAR), default=0)
    wrong = sorted({kind for kind in kinds if kind not in LINEAR and kind not in LOWER})
    if wrong or not dim:
        known = ", ".join(LINEAR)
        raise CaseError(
            InputError(str(source), f"has elements {', '.join(wrong or kinds) or 'of none'}; expected {known}")
        )
    sets = _sets(mesh)
    chosen = _chosen(source, sets, named)
    parts = {group: _elements(mesh, dim, sets[name]) for group, name in chosen.items()}
    _check(source, parts, dim, sets)
    _write(target, scale * _space(mesh.points), parts)
    used = {*chosen.values()}
    groups = {group: (part.dim, sum(map(len, part.cells.values()))) for group, part in parts.items()}
    return Imported(groups, tuple(sorted(name for name in sets if name not in used)))


def _read(source: Path) -> Any:
    """Return what meshio reads of a file."""
    try:
        import meshio
    except ImportError:
        message = "needs the package meshio: pip install meshio, on Debian python3-meshio"
        raise CaseError(InputError("import", message)) from None
    if not source.is_file():
        raise CaseError(InputError(str(source), "no such file"))
    said = io.StringIO()  # meshio prints, too, and ends the process
    with TemporaryDirectory() as folder, redirect_stdout(said), redirect_stderr(said):
        try:
            return meshio.read(_readable(source, Path(folder)))
        except (meshio.ReadError, OSError, ValueError, KeyError, IndexError, AttributeError, SystemExit) as error:
            text = said.getvalue().partition("\n")[0] or str(error)
    raise CaseError(InputError(str(source), f"no mesh that meshio reads: {text}"))


def _readable(source: Path, folder: Path) -> Path:
    """Return the file, of Abaqus one whose plane-strain and axisymmetric elements are called as meshio knows them."""
    if source.suffix.lower() != ".inp":
        return source
    path = folder / source.name
    path.write_text(ABAQUS.sub(r"\1CPS\2", source.read_text("utf-8", errors="replace")), "utf-8")
    return path


def _space(points: Array) -> Array:
    """Return points in space (n, 3)."""
    return np.column_stack([points, np.zeros((len(points), 3 - points.shape[1]))])


@dataclass(frozen=True)
class _Set:
    """A set of a mesh: elements of each block of it, or nodes."""

    cells: tuple[Ints, ...] | None = None
    nodes: Ints | None = None


def _sets(mesh: Any) -> dict[str, _Set]:
    found = {}
    for name, nodes in mesh.point_sets.items():
        found[name] = _Set(nodes=np.unique(np.asarray(nodes, dtype=np.int64)))
    for name, blocks in mesh.cell_sets.items():
        cells = tuple(np.zeros(0, np.int64) if b is None else np.asarray(b, dtype=np.int64) for b in blocks)
        if any(map(len, cells)) and not name.startswith("gmsh:"):
            found[name] = _Set(cells=cells)
    return found


def _chosen(source: Path, sets: Mapping[str, _Set], named: Mapping[str, str]) -> dict[str, str]:
    """Return the set of each group: those asked for, and those whose own names are those of groups."""
    by_lower = {name.lower(): name for name in sets}
    problems = []
    for group, name in named.items():
        if not group.startswith(tuple(f"{body}_" for body in BODIES)):
            problems.append(InputError(f"--group {group}", "expected a group that starts with punch_ or strip_"))
        elif name.lower() not in by_lower:
            close = difflib.get_close_matches(name.lower(), by_lower, n=1)
            hint = f"did you mean {by_lower[close[0]]!r}? " if close else ""
            text = f"{source.name} has no set {name!r}; {hint}It has {', '.join(sorted(sets)) or 'none'}"
            problems.append(InputError(f"--group {group}", text))
    if problems:
        raise CaseError(problems)
    own = {low: name for low, name in by_lower.items() if low.startswith(tuple(f"{body}_" for body in BODIES))}
    return {**own, **{group: by_lower[name.lower()] for group, name in named.items()}}


@dataclass(frozen=True)
class _Part:
    """Elements of a group: their dimension, and their nodes (n, k) by gmsh's number of the kind."""

    dim: int
    cells: dict[int, Ints]


def _elements(mesh: Any, dim: int, of: _Set) -> _Part:
    """Return the elements of a set; of nodes the facets of the boundary that it has all corners of, or points."""
    if of.cells is not None:
        kinds = [(LOWER | {k: v[:2] for k, v in LINEAR.items()})[block.type] for block in mesh.cells]
        whole = max(kind[1] for kind, cells in zip(kinds, of.cells, strict=True) if len(cells))
        return _Part(whole, _joined(
            (kind[0], np.asarray(block.data)[cells])
            for kind, block, cells in zip(kinds, mesh.cells, of.cells, strict=True)
            if len(cells) and kind[1] == whole
        ))  # fmt: skip
    assert of.nodes is not None
    inside: Mask = np.zeros(len(mesh.points), dtype=bool)
    inside[of.nodes] = True
    found = {}
    for number, facets in _boundary(mesh, dim).items():
        own = facets[inside[facets].all(axis=1)]
        if len(own):
            found[number] = own
    return _Part(dim - 1, found) if found else _Part(0, {15: of.nodes[:, None]})


def _joined(pairs: Iterator[tuple[int, Ints]]) -> dict[int, Ints]:
    found: dict[int, Ints] = {}
    for number, cells in pairs:
        found[number] = np.vstack([found[number], cells]) if number in found else cells
    return found


def _boundary(mesh: Any, dim: int) -> dict[int, Ints]:
    """Return the facets of one element alone (m, k) by gmsh's number of their kind."""
    every = _joined(
        (len(side) - 1, np.asarray(block.data)[:, list(side)])  # gmsh's number of lines, triangles, quadrilaterals
        for block in mesh.cells
        if block.type in LINEAR and LINEAR[block.type][1] == dim
        for side in LINEAR[block.type][2]
    )
    found = {}
    for number, facets in every.items():
        _, first, count = np.unique(np.sort(facets, axis=1), axis=0, return_index=True, return_counts=True)
        found[number] = facets[first[count == 1]]
    return found


def _check(source: Path, parts: Mapping[str, _Part], dim: int, sets: Mapping[str, _Set]) -> None:
    """Raise where a body has no region or no contact among the groups, or a facet is of two of them."""
    problems, told = [], ", ".join(sorted(sets)) or "none"
    for body in BODIES:
        if not any(name.startswith(f"{body}_") and part.dim == dim for name, part in parts.items()):
            text = f"no set of {ENTITIES[dim]} elements is named {body}_...: name one by --group {body}_body=SET"
            problems.append(InputError(source.name, f"{text}; it has {told}"))
        contacts = [part for name, part in parts.items() if name.startswith(f"{body}_contact")]
        if not contacts or any(part.dim != dim - 1 for part in contacts):
            text = f"no set of facets or their nodes is named {body}_contact: name one by --group {body}_contact=SET"
            problems.append(InputError(source.name, f"{text}; it has {told}"))
    owners: dict[tuple[int, ...], str] = {}
    for name, part in parts.items():
        for cells in part.cells.values() if part.dim in (dim, dim - 1) else ():
            for row in np.sort(cells, axis=1):
                other = owners.setdefault(tuple(int(node) for node in row), name)
                if other != name:
                    problems.append(InputError(source.name, f"an element is both of {other} and of {name}"))
                    break
    if problems:
        raise CaseError(problems)


def _write(target: Path, points: Array, parts: Mapping[str, _Part]) -> None:
    """Write elements of groups as discrete entities of gmsh, each the one of its group."""
    with gmsh_model() as gmsh:
        node = 1 + np.arange(len(points))
        used = np.unique(np.concatenate([cells.ravel() for part in parts.values() for cells in part.cells.values()]))
        first = True
        for tag, (name, part) in enumerate(sorted(parts.items(), key=lambda one: -one[1].dim), start=1):
            gmsh.model.addDiscreteEntity(part.dim, tag)
            if first:
                gmsh.model.mesh.addNodes(part.dim, tag, node[used], points[used].ravel())
                first = False
            for kind, cells in part.cells.items():
                gmsh.model.mesh.addElementsByType(tag, kind, [], node[cells].ravel())
            gmsh.model.addPhysicalGroup(part.dim, [tag], tag)
            gmsh.model.setPhysicalName(part.dim, tag, name)
        try:
            target.touch()
        except OSError as error:
            raise CaseError(InputError(str(target), f"cannot be written: {error.strerror}")) from None
        gmsh.write(str(target))
        if not target.read_bytes().endswith(b"$EndElements\n"):
            target.unlink()
            raise OutputError(target, "gmsh wrote only a part of it; is there room?")
