"""Meshes in HDF5, NetCDF and XML: MED of Salome, Exodus of Cubit and MOOSE, VTU of VTK, and XDMF with its HDF5 file.

Of VTU and XDMF the values of a whole-numbered array of cells become sets.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from fenwear.files.mesh_file import KINDS, ORDERS, Block, Ints, MeshFile, MeshSet, in_space, known_nodes

MED_KINDS = {"PO1": 15, "SE2": 1, "SE3": 8, "TR3": 2, "TR6": 9, "QU4": 3, "QU8": 16, "QU9": 10, "TE4": 4, "T10": 11,
             "HE8": 5, "H20": 17, "PE6": 6, "PY5": 7}  # fmt: skip
# MED's nodes of solids in gmsh's order: MED turns the other way round the base.
MED_ORDERS = {4: [0, 2, 1, 3], 5: [0, 3, 2, 1, 4, 7, 6, 5], 6: [0, 2, 1, 3, 5, 4], 7: [0, 3, 2, 1, 4],
              11: [0, 2, 1, 3, 6, 5, 4, 7, 8, 9],
              17: [0, 3, 2, 1, 4, 7, 6, 5, 11, 8, 16, 10, 19, 9, 18, 17, 15, 12, 14, 13]}  # fmt: skip
EXODUS_KINDS = {  # by the begin of the name and the number of nodes
    ("SPH", 1): 15, ("BAR", 2): 1, ("TRU", 2): 1, ("BEA", 2): 1, ("EDG", 2): 1, ("EDG", 3): 8, ("BAR", 3): 8,
    ("TRI", 3): 2, ("TRI", 6): 9, ("QUA", 4): 3, ("QUA", 8): 16, ("QUA", 9): 10, ("SHE", 4): 3, ("SHE", 8): 16,
    ("TET", 4): 4, ("TET", 10): 11, ("HEX", 8): 5, ("HEX", 20): 17, ("WED", 6): 6, ("PYR", 5): 7,
}  # fmt: skip
EXODUS_ORDERS = {11: [0, 1, 2, 3, 4, 5, 6, 7, 9, 8],
                 17: [0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 12, 9, 13, 10, 14, 15, 16, 19, 17, 18]}  # fmt: skip
# Exodus' sides of solids in Abaqus' order.
SOLID_SIDES = {4: (1, 2, 3, 0), 11: (1, 2, 3, 0), 5: (2, 3, 4, 5, 0, 1), 12: (2, 3, 4, 5, 0, 1),
               17: (2, 3, 4, 5, 0, 1)}  # fmt: skip


def read_med(path: Path) -> MeshFile:
    """Return the mesh of a MED file with the groups of Salome; the first of several meshes.

    Raises:
        Exception: it cannot be read.
    """
    import h5py

    with h5py.File(path) as file:
        return _med(path.name, file)


def _med(name: str, file: Any) -> MeshFile:
    meshes = sorted(file["ENS_MAA"])
    group = file["ENS_MAA"][meshes[0]]
    step = group[sorted(group)[-1]] if "NOE" not in group else group
    coordinates = np.asarray(step["NOE"]["COO"], dtype=np.float64)
    count = int(step["NOE"]["COO"].attrs.get("NBR", len(coordinates) // int(group.attrs.get("ESP", 3))))
    points = in_space(coordinates.reshape(-1, count).T)
    blocks, families, notes = [], [], []
    for kind in step.get("MAI", {}):
        part = step["MAI"][kind]
        if kind not in MED_KINDS:
            notes.append(f"elements of the kind {kind} are left out")
            continue
        number = MED_KINDS[kind]
        table = np.asarray(part["NOD"], dtype=np.int64).reshape(KINDS[number].nodes, -1).T - 1
        nodes = known_nodes(table, count, f"the kind {kind} of elements")
        blocks.append(Block.of(number, nodes[:, MED_ORDERS.get(number, slice(None))]))
        families.append(np.asarray(part["FAM"] if "FAM" in part else np.zeros(len(nodes)), dtype=np.int64))
    if len(meshes) > 1:
        notes.append(f"meshes left out: {', '.join(meshes[1:])}")
    of_elements = np.concatenate(families) if families else np.zeros(0, np.int64)
    of_nodes = np.asarray(step["NOE"]["FAM"], np.int64) if "FAM" in step["NOE"] else np.zeros(count, np.int64)
    sets = []
    named = file["FAS"][meshes[0]] if "FAS" in file and meshes[0] in file["FAS"] else {}
    for word, of, values in (("ELEME", "elements", of_elements), ("NOEUD", "nodes", of_nodes)):
        for group_name, numbers in _families(named.get(word, {})).items():
            members = np.flatnonzero(np.isin(values, numbers))
            if len(members):
                sets.append(MeshSet(group_name, of, members))  # type: ignore[arg-type]
    return MeshFile(name, points, tuple(blocks), tuple(sets), tuple(notes))


def _families(group: Mapping[str, Any]) -> dict[str, list[int]]:
    """Return the numbers of the families of each group."""
    import h5py

    numbers: dict[str, list[int]] = {}
    for family in group.values():
        if "GRO" not in family:
            continue
        kind = family["GRO"]["NOM"].id.get_type()
        rows = np.empty(family["GRO"]["NOM"].shape[0], f"V{kind.get_size()}")
        family["GRO"]["NOM"].id.read(h5py.h5s.ALL, h5py.h5s.ALL, rows, mtype=kind)
        for row in rows:
            name = row.tobytes().split(b"\0")[0].decode("utf-8", "replace").strip()
            numbers.setdefault(name, []).append(int(family.attrs["NUM"]))
    return numbers


def read_exodus(path: Path) -> MeshFile:
    """Return the mesh of an Exodus file with its blocks, side sets and node sets.

    Raises:
        Exception: it cannot be read.
    """
    if path.read_bytes()[:3] == b"CDF":
        from scipy.io import netcdf_file

        with netcdf_file(path, mmap=False) as file:
            variables = file.variables
            return _exodus(path.name, lambda name: variables[name][:] if name in variables else None,
                           lambda name: getattr(variables[name], "elem_type", b""))  # fmt: skip
    import h5py

    with h5py.File(path) as data:
        return _exodus(path.name, lambda name: data[name][()] if name in data else None,
                       lambda name: data[name].attrs.get("elem_type", b""))  # fmt: skip


def _exodus(name: str, get: Callable[[str], Any], kind_of: Callable[[str], Any]) -> MeshFile:
    if get("coord") is not None:
        columns = [np.asarray(row, dtype=np.float64) for row in get("coord")]
    else:
        columns = [np.asarray(get(f"coord{axis}"), np.float64) for axis in "xyz" if get(f"coord{axis}") is not None]
    points = in_space(np.column_stack(columns))
    blocks, sets, start = [], [], 0
    ids, names = get("eb_prop1"), _texts(get("eb_names"))
    for number in _numbered("connect", get):
        nodes = np.asarray(get(f"connect{number}"), dtype=np.int64) - 1
        word = _text(kind_of(f"connect{number}")).upper()
        key = (word[:3], nodes.shape[1])
        if key not in EXODUS_KINDS:
            raise ValueError(f"block {number} has elements {word} with {nodes.shape[1]} nodes")
        nodes, kind = known_nodes(nodes, len(points), f"block {number}"), EXODUS_KINDS[key]
        blocks.append(Block.of(kind, nodes[:, EXODUS_ORDERS.get(kind, slice(None))], start + 1))
        members = np.arange(start, start + len(nodes))
        sets.append(MeshSet(_name(names, ids, number, "block"), "elements", members))
        start += len(nodes)
    mesh = MeshFile(name, points, tuple(blocks), ())
    ids, names = get("ss_prop1"), _texts(get("ss_names"))
    for number in _numbered("elem_ss", get):
        elements = np.asarray(get(f"elem_ss{number}"), dtype=np.int64) - 1
        sides = np.asarray(get(f"side_ss{number}"), dtype=np.int64) - 1
        if elements.size and not (elements.min() >= 0 and elements.max() < start):
            raise ValueError(f"side set {number} has elements that do not exist")
        sets.append(MeshSet(_name(names, ids, number, "sideset"), "sides", _ordered_sides(mesh, elements, sides)))
    ids, names = get("ns_prop1"), _texts(get("ns_names"))
    for number in _numbered("node_ns", get):
        nodes = np.unique(np.asarray(get(f"node_ns{number}"), dtype=np.int64) - 1)
        known_nodes(nodes, len(points), f"node set {number}")
        sets.append(MeshSet(_name(names, ids, number, "nodeset"), "nodes", nodes))
    return MeshFile(name, points, tuple(blocks), tuple(sets))


def _ordered_sides(mesh: MeshFile, elements: Ints, sides: Ints) -> Ints:
    """Return elements and sides in the order of sides that `KINDS` has."""
    kinds = np.array([block.kind for block in mesh.blocks])[mesh.block_of(elements)]
    converted = sides.copy()
    for kind, order in SOLID_SIDES.items():
        of_kind = kinds == kind
        converted[of_kind] = np.array(order)[sides[of_kind]]
    most = np.array([len(KINDS[kind].sides) for kind in kinds])
    if ((converted < 0) | (converted >= most)).any():
        raise ValueError("a side set has sides that its elements do not have")
    return np.column_stack([elements, converted])


def _numbered(stem: str, get: Callable[[str], Any]) -> Iterator[int]:
    number = 1
    while get(f"{stem}{number}") is not None:
        yield number
        number += 1


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace").strip("\0 ") if isinstance(value, bytes) else str(value)


def _texts(value: Any) -> list[str]:
    if value is None:
        return []
    rows = (b"".join(bytes(np.asarray(letter, dtype="S1")) for letter in row) for row in value)
    return [re.sub(r"\0.*", "", row.decode("utf-8", "replace"), flags=re.DOTALL).strip() for row in rows]


def _name(names: list[str], ids: Any, number: int, word: str) -> str:
    """Return the name of a set, or its word and number."""
    if number <= len(names) and names[number - 1]:
        return names[number - 1]
    return f"{word} {int(ids[number - 1]) if ids is not None and number <= len(ids) else number}"


VTK_KINDS = {1: 15, 3: 1, 21: 8, 5: 2, 22: 9, 9: 3, 23: 16, 28: 10, 10: 4, 24: 11, 12: 5, 25: 17, 13: 6, 14: 7}
XDMF_KINDS = {"polyvertex": 15, "polyline": 1, "edge_3": 8, "triangle": 2, "tri_6": 9, "triangle_6": 9,
              "quadrilateral": 3, "quad_8": 16, "quadrilateral_8": 16, "quad_9": 10, "quadrilateral_9": 10,
              "tetrahedron": 4, "tet_10": 11, "tetrahedron_10": 11, "hexahedron": 5, "hex_20": 17, "hexahedron_20": 17,
              "wedge": 6, "pyramid": 7}  # fmt: skip
TYPES = {"Int8": "i1", "UInt8": "u1", "Int16": "i2", "UInt16": "u2", "Int32": "i4", "UInt32": "u4", "Int64": "i8",
         "UInt64": "u8", "Float32": "f4", "Float64": "f8"}  # fmt: skip
MOST_VALUES = 1000  # of an array of cells that names sets


def read_vtu(path: Path) -> MeshFile:
    """Return the mesh of a VTU file; "material 1" is the set of the cells whose array "material" is 1.

    Raises:
        Exception: it cannot be read.
    """
    try:
        import pyvista
    except ImportError:
        needs = "needs pyvista: `pip install pyvista`, or the image of `docker/fenwear --build`. Or save it as .msh"
        raise ValueError(needs) from None
    grid = pyvista.UnstructuredGrid(path)
    ends, kinds, nodes = grid.offset[1:], grid.celltypes, np.asarray(grid.cell_connectivity, dtype=np.int64)
    blocks, notes = [], []
    kept: list[Ints] = [np.zeros(0, dtype=np.int64)]
    for kind in np.unique(kinds).tolist():
        cells_of_kind = np.flatnonzero(kinds == kind)
        if kind not in VTK_KINDS:
            notes.append(f"{len(cells_of_kind):,} cells of VTK's type {kind} are left out")
            continue
        number = VTK_KINDS[kind]
        count = KINDS[number].nodes
        table = known_nodes(
            nodes[ends[cells_of_kind][:, None] - count + np.arange(count)], grid.n_points, f"type {kind} of cells"
        )
        blocks.append(Block.of(number, table[:, ORDERS.get(number, slice(None))]))
        kept.append(cells_of_kind)
    cells = np.concatenate(kept)
    sets = _sets({name: np.asarray(values)[cells] for name, values in grid.cell_data.items()})
    return MeshFile(path.name, np.asarray(grid.points, dtype=np.float64), tuple(blocks), tuple(sets), tuple(notes))


def _sets(arrays: Mapping[str, NDArray[Any]]) -> Iterator[MeshSet]:
    """Yield a set for each value of whole-numbered arrays of cells."""
    for name, values in arrays.items():
        if values.ndim == 1 and len(values) and np.array_equal(values, np.round(values)):
            distinct = np.unique(values)
            for value in distinct if len(distinct) <= MOST_VALUES else []:
                yield MeshSet(f"{name} {int(value)}", "elements", np.flatnonzero(values == value))


def read_xdmf(path: Path) -> MeshFile:
    """Return the mesh of the first grid of an XDMF file, with sets by its cell arrays as of `read_vtu`.

    Raises:
        Exception: it cannot be read.
    """
    root = ElementTree.parse(path).getroot()
    grid = next(grid for grid in root.iter("Grid") if grid.find("Topology") is not None)
    geometry, topology = grid.find("Geometry"), grid.find("Topology")
    if geometry is None or topology is None:
        raise ValueError("has no grid with points and cells")
    points = in_space(_item(path, geometry.find("DataItem")))
    kind = (topology.get("TopologyType") or topology.get("Type") or "").casefold()
    if kind not in XDMF_KINDS:
        raise ValueError(f"has cells of the kind {kind!r}; expected one of {', '.join(XDMF_KINDS)}")
    number = XDMF_KINDS[kind]
    nodes: Ints = _item(path, topology.find("DataItem")).astype(np.int64).reshape(-1, KINDS[number].nodes)
    known_nodes(nodes, len(points), "a cell")
    blocks = (Block.of(number, nodes[:, ORDERS.get(number, slice(None))]),)
    arrays = {
        attribute.get("Name", ""): _item(path, attribute.find("DataItem")).ravel()
        for attribute in grid.iterfind("Attribute")
        if attribute.get("Center") == "Cell"
    }
    sets = _sets({name: values for name, values in arrays.items() if len(values) == len(nodes)})
    return MeshFile(path.name, points, blocks, tuple(sets))


def _item(path: Path, item: ElementTree.Element | None) -> NDArray[Any]:
    """Return the numbers of a DataItem: as text, or in an HDF5 file beside."""
    if item is None:
        raise ValueError("lacks a DataItem")
    shape = [int(n) for n in re.findall(r"\d+", item.get("Dimensions", ""))] or [-1]
    text = (item.text or "").strip()
    if item.get("Format", "XML") == "XML":
        return np.array(text.split(), dtype=np.float64).reshape(shape)
    if item.get("Format") != "HDF":
        raise ValueError(f"keeps numbers as {item.get('Format')}; expected XML or HDF")
    import h5py

    name, _, place = text.partition(":")
    with h5py.File(path.parent / name) as file:
        return np.asarray(file[place]).reshape(shape)
