"""Meshes in XML: VTU of VTK, and XDMF with its HDF5 file. The values of a whole-numbered cell array become sets."""

from __future__ import annotations

import base64
import lzma
import re
import zlib
from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from fenwear.files.mesh import KINDS, Block, Ints, MeshFile, MeshSet, known_nodes, read_as

VTK_KINDS = {1: 15, 3: 1, 21: 8, 5: 2, 22: 9, 9: 3, 23: 16, 28: 10, 10: 4, 24: 11, 12: 5, 25: 17, 13: 6, 14: 7}
# VTK's nodes in gmsh's order, of kinds where they differ.
VTK_ORDERS = {11: [0, 1, 2, 3, 4, 5, 6, 7, 9, 8],
              17: [0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 16, 9, 17, 10, 18, 19, 12, 15, 13, 14]}  # fmt: skip
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
        CaseError: it cannot be read.
    """
    with read_as(path, "VTU"):
        return _Vtu(path).mesh()


def read_xdmf(path: Path) -> MeshFile:
    """Return the mesh of the first grid of an XDMF file, with sets by its cell arrays as of `read_vtu`.

    Raises:
        CaseError: it cannot be read.
    """
    with read_as(path, "XDMF"):
        return _xdmf(path)


class _Vtu:
    """The arrays of a VTU file: as text, in base64, or appended; packed by zlib or lzma, or not."""

    def __init__(self, path: Path) -> None:
        raw = path.read_bytes()
        head, mark, tail = raw.partition(b"<AppendedData")
        self.appended, self.raw = b"", False
        if mark:
            attributes, _, rest = tail.partition(b">")
            self.raw = b"raw" in attributes
            self.appended = rest[rest.index(b"_") + 1 :]
            raw = head + b"</VTKFile>"
        self.root = ElementTree.fromstring(raw)
        if self.root.get("type") != "UnstructuredGrid":
            raise ValueError(f"holds a {self.root.get('type')}; expected an UnstructuredGrid")
        self.order = ">" if self.root.get("byte_order") == "BigEndian" else "<"
        self.header = self.order + TYPES[self.root.get("header_type", "UInt32")]
        packer = self.root.get("compressor", "")
        known = {"": None, "vtkZLibDataCompressor": zlib.decompress, "vtkLZMADataCompressor": lzma.decompress}
        if packer not in known:
            raise ValueError(f"is packed by {packer}; expected zlib, lzma or none")
        self.unpack, self.path = known[packer], path

    def mesh(self) -> MeshFile:
        points, blocks, arrays, notes = [], [], dict[str, list[Any]](), set[str]()
        start = 0
        for piece in self.root.iter("Piece"):
            part = self.array(piece.find("Points/DataArray"))
            named = {array.get("Name"): self.array(array) for array in piece.iterfind("Cells/DataArray")}
            data = {a.get("Name", ""): self.array(a) for a in piece.iterfind("CellData/DataArray")}
            ends, kinds = named["offsets"].astype(np.int64), named["types"].astype(np.int64)
            nodes = named["connectivity"].astype(np.int64)
            kept = []
            for kind in np.unique(kinds):
                own = np.flatnonzero(kinds == kind)
                if int(kind) not in VTK_KINDS:
                    notes.add(f"{len(own):,} cells of VTK's type {kind} are left out")
                    continue
                number = VTK_KINDS[int(kind)]
                count = KINDS[number].nodes
                table = nodes[ends[own][:, None] - count + np.arange(count)]
                known_nodes(table, len(part) // 3, f"type {kind} of cells")
                blocks.append(Block.of(number, start + table[:, VTK_ORDERS.get(number, list(range(count)))]))
                kept.append(own)
            cells = np.concatenate(kept) if kept else np.zeros(0, np.int64)
            for name, values in data.items():
                if len(values) == len(kinds):
                    arrays.setdefault(name, []).append(values[cells])
            points.append(part.reshape(-1, 3).astype(np.float64))
            start += len(points[-1])
        total = sum(len(block.nodes) for block in blocks)
        whole = {name: np.concatenate(parts) for name, parts in arrays.items()}
        sets = _sets({name: values for name, values in whole.items() if len(values) == total})
        return MeshFile(self.path.name, np.concatenate(points), tuple(blocks), tuple(sets), tuple(sorted(notes)))

    def array(self, element: ElementTree.Element | None) -> NDArray[Any]:
        """Return the numbers of an element."""
        if element is None:
            raise ValueError("has no points")
        kind = np.dtype(self.order + TYPES[element.get("type", "Float64")])
        way, text = element.get("format", "ascii"), (element.text or "").strip()
        if way == "ascii":
            return np.array(text.split(), dtype=kind)
        if way == "appended" and self.raw:
            return np.frombuffer(self.plain(self.appended[int(element.get("offset", 0)) :]), kind)
        coded = self.appended[int(element.get("offset", 0)) :] if way == "appended" else text.encode()
        return np.frombuffer(self.decoded(coded), kind)

    def plain(self, raw: bytes) -> bytes:
        """Return the bytes of an array that begins with its header."""
        width = np.dtype(self.header).itemsize
        first = int(np.frombuffer(raw, self.header, 1)[0])
        if self.unpack is None:
            return raw[width : width + first]
        sizes = np.frombuffer(raw, self.header, 3 + first)[3:].astype(np.int64)
        ends = (3 + first) * width + np.concatenate([[0], np.cumsum(sizes)])
        return b"".join(self.unpack(raw[a:b]) for a, b in pairwise(ends))

    def decoded(self, text: bytes) -> bytes:
        """Return the bytes of an array in base64, whose header is coded by itself where it is packed."""
        width = np.dtype(self.header).itemsize
        if self.unpack is None:
            size = int(np.frombuffer(_unbase(text, width), self.header, 1)[0])
            return self.plain(_unbase(text, width + size))
        count = int(np.frombuffer(_unbase(text, width), self.header, 1)[0])
        head = _unbase(text, (3 + count) * width)
        sizes = np.frombuffer(head, self.header, 3 + count)[3:]
        rest = text[4 * -(-len(head) // 3) :]
        return self.plain(head + _unbase(rest, int(sizes.sum())))


def _unbase(text: bytes, count: int) -> bytes:
    """Return the first bytes that a text in base64 stands for."""
    return base64.b64decode(text[: 4 * -(-count // 3)])[:count]


def _sets(arrays: Mapping[str, NDArray[Any]]) -> Iterator[MeshSet]:
    """Yield a set for each value of whole-numbered arrays of cells."""
    for name, values in arrays.items():
        if values.ndim == 1 and len(values) and np.array_equal(values, np.round(values)):
            found = np.unique(values)
            for value in found if len(found) <= MOST_VALUES else []:
                yield MeshSet(f"{name} {int(value)}", "elements", np.flatnonzero(values == value))


def _xdmf(path: Path) -> MeshFile:
    root = ElementTree.parse(path).getroot()
    grid = next(grid for grid in root.iter("Grid") if grid.find("Topology") is not None)
    geometry, topology = grid.find("Geometry"), grid.find("Topology")
    if geometry is None or topology is None:
        raise ValueError("has no grid with points and cells")
    flat = _item(path, geometry.find("DataItem"))
    points = np.zeros((len(flat), 3))
    points[:, : flat.shape[1]] = flat
    kind = (topology.get("TopologyType") or topology.get("Type") or "").casefold()
    if kind not in XDMF_KINDS:
        raise ValueError(f"has cells of the kind {kind!r}; expected one of {', '.join(XDMF_KINDS)}")
    number = XDMF_KINDS[kind]
    nodes: Ints = _item(path, topology.find("DataItem")).astype(np.int64).reshape(-1, KINDS[number].nodes)
    known_nodes(nodes, len(points), "a cell")
    blocks = (Block.of(number, nodes[:, VTK_ORDERS.get(number, list(range(nodes.shape[1])))]),)
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
