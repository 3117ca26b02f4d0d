"""Files in HDF5: netCDF-4 for histories, fields and maps, and time series of fields that ParaView and pyvista open.

netCDF-4: dimensions are scales, and variables hang on to them.
h5netcdf opens a variable again at every question, and asks all variables for the size of a dimension that
grows: to lay out the forty of a small run took a third of it. The files are those that h5netcdf writes: see
"NetCDF-4 Format Specification" in Unidata's NetCDF User's Guide, appendix C.

VTKHDF, of its version 2.0 (docs.vtk.org, "VTKHDF File Format"): an unstructured grid whose points, cells and values of
all steps stand one after the other, with the offsets of each step. A step is appended to a copy that takes the place of
the file: a reader always finds a whole one. Both bodies are one grid.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import h5py
import numpy as np
from numpy.typing import DTypeLike, NDArray
from scipy.spatial import KDTree

from fenwear.common.arrays import Array
from fenwear.results.disk import check_room, replacing
from fenwear.results.quantity import BODIES

if TYPE_CHECKING:
    import xarray

# What netCDF-4 keeps for itself in the attributes of a file and of its variables.
INNER = {"CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST", "_NCProperties", "_Netcdf4Coordinates", "_Netcdf4Dimid"}
NO_VARIABLE = b"This is a netCDF dimension but not a netCDF variable"


def load(path: Path) -> xarray.Dataset:
    """Return all variables of a netCDF-4 file without groups, in memory.

    It is what xarray.load_dataset returns.

    Raises:
        OSError: it is no such file, or cannot be read.
        ValueError: it is HDF5, but not netCDF-4.
    """
    import xarray  # with pandas a third of a second, which who writes alone spares himself

    with h5py.File(path, "r") as file:
        variables = {
            name: (_dimensions(name, data), data[()], _attributes(data))
            for name, data in file.items()
            if isinstance(data, h5py.Dataset) and not bytes(data.attrs.get("NAME", b"")).startswith(NO_VARIABLE)
        }
        return xarray.decode_cf(xarray.Dataset(variables, attrs=_attributes(file)))


def _dimensions(name: str, data: Any) -> tuple[str, ...]:
    if data.is_scale and "DIMENSION_LIST" not in data.attrs:
        return (name,)
    if not all(len(data.dims[axis]) for axis in range(data.ndim)):
        raise ValueError(f"{name} has no named dimensions")
    return tuple(data.dims[axis][0].name.rpartition("/")[2] for axis in range(data.ndim))


def _attributes(owner: Any) -> dict[str, Any]:
    attributes = {name: value for name, value in owner.attrs.items() if name not in INNER}
    return {n: v[0] if isinstance(v, np.ndarray) and v.shape == (1,) else v for n, v in attributes.items()}


def write(path: Path, dataset: xarray.Dataset) -> None:
    """Write variables of numbers as a new file, in place of an older one."""
    with Netcdf(path, {str(name): size for name, size in dataset.sizes.items()}) as file:
        file.attributes.update(dataset.attrs)
        for name, variable in dataset.variables.items():
            file.add(str(name), [str(d) for d in variable.dims], variable.attrs, variable.values)


class Netcdf:
    """A new netCDF-4 file without groups; a context that closes it."""

    def __init__(self, path: Path, sizes: Mapping[str, int | None]) -> None:
        """Make the file, in place of an older one.

        Args:
            path: Of the file.
            sizes: Of the dimensions by their names; None of one that grows, and is empty.
        """
        self._file = h5py.File(path, "w", track_order=True)
        self._sizes = dict(sizes)
        self._ids = {name: np.int32(k) for k, name in enumerate(sizes)}
        self._scales: dict[str, h5py.Dataset] = {}
        self.attributes = self._file.attrs
        self._hanging: list[tuple[h5py.Dataset, Sequence[str]]] = []

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Hang the variables on to the dimensions, and close the file."""
        with self._file:
            if error is None:
                self._finish()

    def add(
        self,
        name: str,
        dimensions: Sequence[str],
        attributes: Mapping[str, Any],
        values: NDArray[Any] | None = None,
        *,
        kind: DTypeLike = None,
        chunks: tuple[int, ...] | None = None,
    ) -> None:
        """Add a variable.

        Args:
            name: Its name; that of a dimension has its coordinates.
            dimensions: Names of its dimensions.
            attributes: Its units and so on.
            values: All of them, or None of a variable that grows.
            kind: Of its values, where there are none yet.
            chunks: That its storage grows by.
        """
        shape = tuple(self._sizes[d] or 0 for d in dimensions)
        most = tuple(self._sizes[d] for d in dimensions)
        data = self._file.create_dataset(
            name,
            shape,
            dtype=kind,
            data=values,
            chunks=chunks,
            maxshape=most if None in most else None,
            track_order=True,
        )
        for key, value in attributes.items():
            data.attrs[key] = value
        if name in self._sizes:
            self._scales[name] = data
        else:
            self._hanging.append((data, dimensions))

    def _finish(self) -> None:
        for name, size in self._sizes.items():
            if name in self._scales:
                scale: bytes = name.encode()
            else:
                self._scales[name] = self._file.create_dataset(
                    name, (size or 0,), dtype=">f4", maxshape=(None,) if size is None else None, track_order=True
                )
                scale = NO_VARIABLE + b".%10d" % (size or 1)
            self._scales[name].make_scale(scale)
            self._scales[name].attrs["_Netcdf4Dimid"] = self._ids[name]
        for data, dimensions in self._hanging:
            for axis, d in enumerate(dimensions):
                data.dims[axis].attach_scale(self._scales[d])
            if dimensions:
                data.attrs["_Netcdf4Dimid"] = self._ids[dimensions[0]]
            if len(dimensions) > 1:
                data.attrs["_Netcdf4Coordinates"] = np.array([self._ids[d] for d in dimensions], "int32")
        parts = f"version=2,h5py={h5py.__version__},hdf5={h5py.version.hdf5_version}"
        self.attributes["_NCProperties"] = np.array(parts, h5py.string_dtype("ascii", len(parts)))


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
    points = [node_places(data, body) for body in BODIES]
    starts = (0, len(points[0]))
    cells = [
        _kind(data[f"{body}_cells"].values, begin, solid=f"{body}_y" in data)
        for body, begin in zip(BODIES, starts, strict=True)
    ]
    values: dict[str, Array] = {}
    for name, parts in FIELDS.items():
        if any(f"{body}_{parts[0]}" in data for body in BODIES):
            unit = data[f"punch_{parts[0]}"].attrs.get("units", "")
            columns = np.concatenate([_field(data, body, parts) for body in BODIES])
            values[name.format(unit=unit)] = columns[:, 0] if len(parts) == 1 else columns
    for name, part in OF_CONTACT.items():
        values[name] = np.concatenate([_of_contact(data, b, part, p) for b, p in zip(BODIES, points, strict=True)])
    values["body"] = np.repeat([1, 2], [len(p) for p in points])
    return Step(float(data.attrs["time"]), np.concatenate(points), cells, values)


def node_places(data: xarray.Dataset, body: str, kind: str = "") -> Array:
    """Return coordinates of a body's nodes, or of its contact nodes (n, 3), mm; planes and rings lie at y = 0."""
    return side_by_side(data, [f"{body}{kind}_{axis}" for axis in "xyz"])


def side_by_side(data: xarray.Dataset, names: Sequence[str]) -> Array:
    """Return variables side by side, zero where there is none; there is the first one."""
    return np.column_stack([data[name].values if name in data else 0 * data[names[0]].values for name in names])


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
    places = points[:, ["xyz".index(axis) for axis in axes]]
    nodes = np.column_stack([data[f"{at}_{axis}"].values for axis in axes])
    distance, nearest = KDTree(places).query(nodes)
    near = distance < NEAR * float(np.ptp(places, axis=0).max())
    values = np.zeros(len(points))
    values[nearest[near]] = data[f"{at}_{part}"].values[near]
    return values
