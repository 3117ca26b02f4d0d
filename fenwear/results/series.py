"""The fields of both bodies at one time as a step of a time series: one grid, its fields by names with units."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from fenwear.arrays import Array
from fenwear.results.vtkhdf import Step

if TYPE_CHECKING:
    import xarray

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
