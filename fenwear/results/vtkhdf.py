"""A time series of fields as one VTKHDF file, which ParaView and pyvista open as such.

The format is VTK's own, of its version 2.0 (docs.vtk.org, "VTKHDF File Format"): an unstructured grid whose points,
cells and values of all steps stand one after the other, with the offsets of each step. A step is appended to a
copy that takes the place of the file: a reader always finds a whole one. Both bodies are one grid.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from fenwear.arrays import Array
from fenwear.results.disk import check_room, replacing

if TYPE_CHECKING:
    import xarray

ROOT, GROWS = "VTKHDF", 65536
HEADER = 65536  # bytes of HDF5's own, generously


@dataclass(frozen=True)
class Step:
    """The fields of one time on one grid.

    Attributes:
        time: s.
        points: (n, 3), mm.
        cells: Corners of the cells (m, k) of each kind, with the kind's number in VTK.
        values: Of each field at the points, (n,) or (n, components).
    """

    time: float
    points: Array
    cells: Sequence[tuple[int, NDArray[np.int64]]]
    values: Mapping[str, Array]


def append(path: Path, step: Step) -> None:
    """Append a step to a series; steps that are not before it are dropped, as those of a run that was killed.

    Raises:
        OutputError: the file cannot be written; the old one stays.
    """
    size = step.points.nbytes + sum(10 * c.nbytes for _, c in step.cells) + sum(v.nbytes for v in step.values.values())
    before = path.stat().st_size if path.exists() else 0
    with replacing(path) as part:
        check_room(path.parent, 2 * size + HEADER * (8 + len(step.values)) + before)
        if before:
            shutil.copyfile(path, part)
        with h5py.File(part, "a") as file:
            _append(file.require_group(ROOT), step)


def _append(root: Any, step: Step) -> None:
    if "Steps" not in root:
        root.attrs["Version"] = [2, 0]
        root.attrs["Type"] = np.bytes_("UnstructuredGrid")
        root.create_group("Steps").attrs["NSteps"] = 0
    steps = root["Steps"]
    count = int(steps.attrs["NSteps"])
    if count:
        count = int(np.searchsorted(steps["Values"][:count], step.time, side="left"))
    _set(steps, "Values", count, np.array([step.time]))
    corners = np.concatenate([np.full(len(cells), cells.shape[1]) for _, cells in step.cells])
    connectivity = np.concatenate([cells.ravel() for _, cells in step.cells])
    parts = {
        "NumberOfPoints": np.array([len(step.points)]),
        "NumberOfCells": np.array([len(corners)]),
        "NumberOfConnectivityIds": np.array([len(connectivity)]),
        "Points": step.points,
        "Connectivity": connectivity,
        "Offsets": np.concatenate([[0], np.cumsum(corners)]),
        "Types": np.concatenate([np.full(len(cells), kind, dtype=np.uint8) for kind, cells in step.cells]),
    }
    begins = {name: _extend(root, name, values) for name, values in parts.items()}
    _set(steps, "PartOffsets", count, np.array([begins["NumberOfPoints"]]))
    _set(steps, "NumberOfParts", count, np.array([1]))
    _set(steps, "PointOffsets", count, np.array([[begins["Points"]]]))
    _set(steps, "CellOffsets", count, np.array([[begins["Types"]]]))
    _set(steps, "ConnectivityIdOffsets", count, np.array([[begins["Connectivity"]]]))
    data, offsets = root.require_group("PointData"), steps.require_group("PointDataOffsets")
    for name, values in step.values.items():
        _set(offsets, name, count, np.array([_extend(data, name, values)]))
    steps.attrs["NSteps"] = count + 1


def _extend(group: Any, name: str, values: NDArray[Any]) -> int:
    """Put rows behind those of a dataset; return where they begin."""
    if name not in group:
        rest = values.shape[1:]
        chunks = (max(1, min(GROWS, len(values))), *rest)
        group.create_dataset(name, (0, *rest), values.dtype, maxshape=(None, *rest), chunks=chunks)
    begin = len(group[name])
    group[name].resize(begin + len(values), axis=0)
    group[name][begin:] = values
    return begin


def _set(group: Any, name: str, row: int, values: NDArray[Any]) -> None:
    """Make a row the last one of a dataset."""
    if name in group:
        group[name].resize(row, axis=0)
    _extend(group, name, values)


BODIES = ("punch", "strip")
TRIANGLE, QUADRILATERAL, TETRAHEDRON, HEXAHEDRON = 5, 9, 10, 12  # as VTK numbers them
NEAR = 1e-9  # of the body's size: nodes at the same place
# Name in the series: the parts of its name in the file of a half-cycle. A slash has a meaning in HDF5.
FIELDS = {
    "displacement (mm)": ("displacement_x", "displacement_out_of_plane|displacement_y", "displacement_z"),
    "stress (MPa)": tuple(f"stress_{part}" for part in ("xx", "yy", "zz", "xy", "yz", "xz")),
    "von Mises stress (MPa)": ("von_mises",),
    "temperature ({unit})": ("temperature",),
    "heat flux (mW mm^-2)": ("heat_flux_x", "heat_flux_y", "heat_flux_z"),
}
OF_CONTACT = {"contact pressure (MPa)": "pressure", "worn depth (mm)": "depth"}


def step_of(data: xarray.Dataset) -> Step:
    """Return the step of the fields of a half-cycle, as its file has them; zero stands for what a body has not."""
    points = [_points(data, body) for body in BODIES]
    starts = (0, len(points[0]))
    cells = [
        _kind(data[f"{body}_cells"].values, begin, solid=f"{body}_y" in data)
        for body, begin in zip(BODIES, starts, strict=True)
    ]
    values: dict[str, Array] = {}
    for name, parts in FIELDS.items():
        if any(f"{body}_{parts[0]}" in data for body in BODIES):
            unit = data[f"punch_{parts[0]}"].attrs.get("units", "")
            found = np.concatenate([_field(data, body, parts) for body in BODIES])
            values[name.format(unit=unit)] = found[:, 0] if len(parts) == 1 else found
    for name, part in OF_CONTACT.items():
        values[name] = np.concatenate([_of_contact(data, b, part, p) for b, p in zip(BODIES, points, strict=True)])
    values["body"] = np.repeat([1, 2], [len(p) for p in points])
    return Step(float(data.attrs["time"]), np.concatenate(points), cells, values)


def _points(data: xarray.Dataset, body: str) -> Array:
    """Return the nodes of a body in space (n, 3), mm; a plane lies at y = 0."""
    x, z = data[f"{body}_x"].values, data[f"{body}_z"].values
    y = data[f"{body}_y"].values if f"{body}_y" in data else np.zeros_like(x)
    return np.column_stack([x, y, z])


def _kind(cells: NDArray[np.int64], begin: int, *, solid: bool) -> tuple[int, NDArray[np.int64]]:
    if cells.shape[1] == 8:
        return HEXAHEDRON, cells + begin
    if cells.shape[1] == 4 and (cells[:, 2] == cells[:, 3]).all():  # triangles have the last corner twice
        return TRIANGLE, cells[:, :3] + begin
    if solid:
        return TETRAHEDRON, cells + begin
    return QUADRILATERAL, cells + begin


def _field(data: xarray.Dataset, body: str, parts: tuple[str, ...]) -> Array:
    nothing = np.zeros(len(data[f"{body}_x"]))
    columns = []
    for part in parts:
        names = [f"{body}_{name}" for name in part.split("|") if f"{body}_{name}" in data]
        columns.append(data[names[0]].values if names else nothing)
    return np.column_stack(columns)


def _of_contact(data: xarray.Dataset, body: str, part: str, points: Array) -> Array:
    """Return a value of the contact surface on the nodes of a body, zero away from it (n,)."""
    at = f"{body}_contact"
    axes = [axis for axis in "xyz" if f"{at}_{axis}" in data]
    own = points[:, ["xyz".index(axis) for axis in axes]]
    nodes = np.column_stack([data[f"{at}_{axis}"].values for axis in axes])
    distance, nearest = KDTree(own).query(nodes)
    near = distance < NEAR * float(np.ptp(own, axis=0).max())
    values = np.zeros(len(points))
    values[nearest[near]] = data[f"{at}_{part}"].values[near]
    return values
