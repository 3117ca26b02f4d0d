"""gmsh, opened quietly; and meshes that it reads: UNV and CGNS with groups, Nastran with its property numbers."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fenwear.common.errors import CaseError, InputError
from fenwear.common.stack import importing
from fenwear.files.gmsh_child import arrays_of
from fenwear.files.mesh_file import ENTITIES, KINDS, Block, MeshFile, MeshSet


def _library() -> Any:
    """Return gmsh.

    Raises:
        StackError: it is missing, or a library that it needs.
    """
    with importing():
        import gmsh
    return gmsh


@contextmanager
def gmsh_model() -> Iterator[Any]:
    """Open gmsh quietly, and close it unless someone else had opened it."""
    gmsh = _library()
    was_open = gmsh.isInitialized()
    if not was_open:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.add("fenwear")
    try:
        yield gmsh
    finally:
        if was_open:
            gmsh.model.remove()
        else:
            gmsh.finalize()


LONGEST = 600  # s that gmsh may read


def read(path: Path, word: str = "") -> MeshFile:
    """Return the mesh of a file with its groups; of Nastran's bulk data "property N" is the set of a property.

    Args:
        path: Of the file.
        word: Names the sets of entities without a group; "" for none.

    Raises:
        CaseError: gmsh cannot read it.
        StackError: there is no gmsh.
    """
    return _mesh(path.name, in_process(path), word)


def in_process(path: Path, *, shapes: bool = False) -> dict[str, NDArray[Any]]:
    """Return the arrays of a mesh file that gmsh reads in a process of its own; of shapes nothing, once they are read.

    Raises:
        CaseError: gmsh cannot read it, or ends on it.
        StackError: there is no gmsh.
    """
    _library()
    program = "OpenCASCADE" if shapes else "gmsh"
    with TemporaryDirectory() as folder:
        result = Path(folder) / "mesh.npz"
        child = [sys.executable, str(Path(__file__).with_name("gmsh_child.py")), str(path)]
        command = child if shapes else [*child, str(result)]
        try:
            done = subprocess.run(
                command, capture_output=True, text=True, errors="replace", timeout=LONGEST, stdin=subprocess.DEVNULL,
                check=False,
            )  # fmt: skip
            reason = done.stderr.strip().splitlines()[-1:] if done.returncode > 0 else []
            why = reason[0] if reason else f"it ended with signal {-done.returncode}, as on a broken file"
            failed = done.returncode != 0 or not (shapes or result.is_file())
        except subprocess.TimeoutExpired:
            failed, why = True, f"it came to no end in {LONGEST} s"
        if failed:
            message = f"cannot be read by {program}: {why[:160]}. Write the file again."
            raise CaseError(InputError(path.name, message))
        if shapes:
            return {}
        with np.load(result) as arrays:
            return dict(arrays)


def model_mesh(name: str, gmsh: Any) -> MeshFile:
    """Return the mesh of gmsh's current model, with its physical groups as sets."""
    return _mesh(name, arrays_of(gmsh.model), "")


def _mesh(name: str, arrays: dict[str, NDArray[Any]], word: str) -> MeshFile:
    """Return the mesh of arrays; `word` names the sets of entities without a group."""
    named = json.loads(bytes(arrays["named"]))
    order = np.argsort(arrays["tags"])
    tags = np.asarray(arrays["tags"], dtype=np.int64)[order]
    points = np.asarray(arrays["points"], dtype=np.float64).reshape(-1, 3)[order]
    blocks: list[Block] = []
    members: dict[tuple[int, int], list[Any]] = {}
    notes, start = [], 0
    for number, (dim, tag, kind, title) in enumerate(named["blocks"]):
        labels = np.asarray(arrays[f"labels{number}"], dtype=np.int64)
        if kind not in KINDS:
            notes.append(f"{len(labels):,} {title} elements are left out")
            continue
        table = np.asarray(arrays[f"nodes{number}"], dtype=np.int64).reshape(len(labels), -1)
        if not np.isin(table, tags).all():
            raise CaseError(InputError(name, "has elements on nodes that do not exist. Write the file again."))
        blocks.append(Block(kind, np.searchsorted(tags, table), labels, np.zeros(len(labels), np.int64)))
        members.setdefault((dim, tag), []).append(np.arange(start, start + len(labels)))
        start += len(labels)
    sets = []
    for dim, tag, text, entities in named["groups"]:
        group_elements = [
            np.zeros(0, np.int64),
            *(elements for entity in entities for elements in members.get((dim, entity), [])),
        ]
        sets.append(MeshSet(text or f"{ENTITIES[dim]} group {tag}", "elements", np.concatenate(group_elements)))
    if word:
        twice = {tag for dim, tag in members if any((other, tag) in members for other in range(4) if other != dim)}
        for (dim, tag), parts in members.items():
            text = f"{word} {tag}" + (f" {ENTITIES[dim]}" if tag in twice else "")
            sets.append(MeshSet(text, "elements", np.concatenate(parts)))
    return MeshFile(name, points, tuple(blocks), tuple(sets), tuple(notes))
