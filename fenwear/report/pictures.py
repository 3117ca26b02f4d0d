"""Pictures of the deformed bodies near the contact, from the files in DIR/fields.

Planes and rings are drawn as they are meshed, solids in a section along the sliding through the middle of the contact.
Displacement and wear are magnified together, by the factor that the picture names: else worn bodies would seem to sink
into each other. `fields/fields.hdf` has the whole bodies, for ParaView and pyvista.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fenwear.arrays import Array, Mask
from fenwear.report.course import shown_unit
from fenwear.report.key_numbers import names_in
from fenwear.report.magnification import magnification
from fenwear.report.style import direction_words, further, name_bodies, save, strip_moves
from fenwear.results.netcdf import load

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

FIELDS, FIGURES = "fields", "figures"
BODIES = ("punch", "strip")
AXES = ("x", "y", "z")
# Pale to dark, so that outlines stay visible and grey prints keep the order.
SHOWN = {"von_mises": ("von Mises stress", "MPa", "YlGnBu"), "temperature": ("temperature", "K", "YlOrRd")}
FLAT = 1e-4  # of the contact's length: how far a surface that counts as flat may be from a plane
FADES = 0.1  # of the contact's length: over which wear, as it is drawn, fades into the bodies
NEAR = (0.72, 0.5, 0.75)  # of the length: half of what is shown along it, and most below and above the contact
MARGIN, NEIGHBOURS = 0.04, 4
HEXAHEDRON, TETRAHEDRON = 12, 10  # VTK's numbers


class DrawingError(Exception):
    """Pictures of the bodies could not be drawn; tells why and what may help."""


@dataclass(frozen=True)
class View:
    """What all pictures of a run share, so that they can be compared.

    Attributes:
        centre: Of the contact (3,), mm.
        along, normal: The strip's way there, and the normal into the punch (3,).
        length: Of the contact along the sliding, mm.
        box: What is shown: least and largest place along both, mm.
        factor: Magnification of displacement and wear.
        ranges: Least and largest value of each field's colours.
    """

    centre: Array
    along: Array
    normal: Array
    length: float
    box: tuple[float, float, float, float]
    factor: float
    ranges: dict[str, tuple[float, float]]

    def seen(self, x: Array) -> Array:
        """Return places along the sliding and along the normal (n, 2), mm."""
        return np.column_stack([x @ self.along, x @ self.normal])

    def inside(self, x: Array) -> Mask:
        """Return which points (n, 3) are near the section and in the box (n,)."""
        seen, box = self.seen(x), np.array(self.box).reshape(2, 2)
        aside = np.abs((x - self.centre) @ np.cross(self.along, self.normal)) < self.length
        return np.asarray(aside & ((seen >= box[:, 0]) & (seen <= box[:, 1])).all(axis=1))


def field_files(directory: Path) -> list[Path]:
    """Return the files of a run's fields by half-cycle."""
    return sorted((directory / FIELDS).glob("half_cycle_*.nc"))


def draw_pictures(directory: Path, formats: Sequence[str] = ("png",)) -> list[Path]:
    """Draw the bodies at every half-cycle with fields; return the files.

    Raises:
        DrawingError: a part of the stack is missing, or a file of fields cannot be read.
    """
    folder, paths = directory / FIGURES, list[Path]()
    try:
        datasets = [load(path) for path in field_files(directory)]
        if not datasets:
            return []
        view, names = common_view(datasets), names_in(directory)
        folder.mkdir(exist_ok=True)
        for field in view.ranges:
            for data in datasets:
                png = folder / f"bodies_{field}_{int(data.attrs['half_cycle']):06d}.png"
                figure = bodies_figure(data, field, view)
                name_bodies([figure], names)
                save(figure, png, dpi=150)
                paths += [png, *further(figure, png, formats)]
    except ModuleNotFoundError as error:
        raise DrawingError(f"no pictures of the bodies: install {error.name}") from None
    except (OSError, ValueError) as error:
        raise DrawingError(f"no pictures of the bodies: {error}") from None
    return paths


def points(data: xarray.Dataset, body: str, kind: str = "") -> Array:
    """Return coordinates of a body's nodes, or of its contact nodes (n, 3), mm; planes and rings lie at y = 0."""
    return _columns(data, [f"{body}{kind}_{axis}" for axis in AXES])


def displacement(data: xarray.Dataset, body: str) -> Array:
    """Return the displacement of a body's nodes (n, 3), mm."""
    return _columns(data, [f"{body}_displacement_{axis}" for axis in AXES])


def _columns(data: xarray.Dataset, names: Sequence[str]) -> Array:
    return np.column_stack([data[name].values if name in data else 0 * data[names[0]].values for name in names])


def common_view(datasets: Sequence[xarray.Dataset]) -> View:
    """Return the view that fits all half-cycles: the contact surface of the punch and what lies below and above it."""
    first = datasets[0]
    solid = first.attrs.get("model") == "solid"
    along = np.array(first.attrs["along"] if solid else [1.0, 0.0, 0.0])
    normal = np.array(first.attrs["normal"] if solid else [0.0, 0.0, 1.0])
    x = points(first, "punch", "_contact")
    length, centre = float(np.ptp(x @ along)), (x.max(axis=0) + x.min(axis=0)) / 2
    centre = centre + ((x - centre) @ normal).min() * normal
    heights = [(points(first, body) - centre) @ normal for body in BODIES]
    room = MARGIN * length  # thin bodies do not fill the section
    below, above = min(NEAR[1] * length, room - heights[1].min()), min(NEAR[2] * length, room + heights[0].max())
    middle, level, wide = float(centre @ along), float(centre @ normal), NEAR[0] * length
    box = (middle - wide, middle + wide, level - float(below), level + float(above))
    view = View(centre, along, normal, length, box, 1.0, {})
    inside = {body: view.inside(points(first, body)) for body in BODIES}
    moved = [np.linalg.norm(displacement(d, b), axis=1)[inside[b]].max(initial=0.0) for d in datasets for b in BODIES]
    # Displacement that is magnified fits surfaces which lie on each other, not the gap between curved ones.
    surfaces = [(points(first, body, "_contact") - centre) @ normal for body in BODIES]
    curved = any(np.abs(surface).max() > FLAT * length for surface in surfaces)
    factor = 1.0 if curved else magnification(float(max(moved)), length)
    ranges = {}
    for field in SHOWN:
        if all(f"{b}_{field}" in d for d in datasets for b in BODIES):
            # Late states fill the scale, and a corner's stress has no bound: the bar tells what lies beyond.
            late = datasets[len(datasets) // 2 :]
            values = np.concatenate([d[f"{b}_{field}"].values[inside[b]] for d in late for b in BODIES])
            low, high = float(values.min()), float(np.quantile(values, 0.995 if field == "von_mises" else 1.0))
            ranges[field] = (0.0 if 0 < low < high / 2 else low, high if high > low else low + 1.0)
    return View(centre, along, normal, length, box, factor, ranges)


def deformed(data: xarray.Dataset, body: str, view: View) -> Array:
    """Return a body's nodes (n, 3) after displacement and wear, magnified; wear fades out away from the contact."""
    x, u, contact = points(data, body), displacement(data, body), points(data, body, "_contact")
    plane = np.eye(3) - np.outer(view.normal, view.normal)
    tree = cKDTree(contact @ plane)
    count = min(NEIGHBOURS, len(contact))
    distance, near = (found.reshape(len(x), count) for found in tree.query(x @ plane, k=count))
    share = 1 / np.maximum(distance, 1e-9 * view.length)
    depth = (share * data[f"{body}_contact_wear"].values[near]).sum(axis=1) / share.sum(axis=1)
    apart = float(np.median(tree.query(contact @ plane, k=2)[0][:, 1]))
    height = np.abs((x - contact[near[:, 0]]) @ view.normal)
    depth *= np.clip(1 - height / (FADES * view.length), 0, 1) * (distance[:, 0] < apart)
    sign = 1 if body == "punch" else -1
    return np.asarray(x + view.factor * (u + sign * depth[:, None] * view.normal))


def section(data: xarray.Dataset, body: str, field: str, view: View) -> tuple[Array, NDArray[np.int64], Array, Array]:
    """Return what is seen of a body: points (n, 2), triangles (t, 3), values (n,), and outlines (m, 2, 2)."""
    cells, values, x = data[f"{body}_cells"].values, data[f"{body}_{field}"].values, deformed(data, body, view)
    if data.attrs.get("model") == "solid":
        import pyvista

        kind = HEXAHEDRON if cells.shape[1] == 8 else TETRAHEDRON
        grid = pyvista.UnstructuredGrid({kind: cells}, x)
        grid.point_data[field] = values
        cut = grid.slice(normal=np.cross(view.along, view.normal), origin=view.centre).triangulate()
        x, cells, values = np.asarray(cut.points), cut.faces.reshape(-1, 4)[:, 1:], np.asarray(cut[field])
    seen = view.seen(x)
    edges = np.sort(np.stack([cells, np.roll(cells, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    single, count = np.unique(edges, axis=0, return_counts=True)
    triangles = np.concatenate([cells[:, [0, k, k + 1]] for k in range(1, cells.shape[1] - 1)])
    return seen, triangles, values, seen[single[count == 1]]


def bodies_figure(data: xarray.Dataset, field: str, view: View) -> Figure:
    """Draw both bodies, coloured by a field, with a bar of colours and what is to be known."""
    from matplotlib.collections import LineCollection
    from matplotlib.figure import Figure

    name, unit, colours = SHOWN[field]
    unit = shown_unit(str(data[f"punch_{field}"].attrs.get("units", unit)))
    low, high = view.ranges[field]
    figure = Figure(figsize=(7.0, 6.6), layout="constrained")
    ax: Any = figure.subplots()
    most = low
    for body in BODIES:
        seen, triangles, values, outlines = section(data, body, field, view)
        drawn: Any = ax.tripcolor(*seen.T, triangles, values, shading="gouraud", cmap=colours, vmin=low, vmax=high)
        ax.add_collection(LineCollection(list(outlines), colors="black", linewidths=1.2))
        most = max(most, float(data[f"{body}_{field}"].values[view.inside(points(data, body))].max(initial=low)))
    ax.set(aspect="equal", xlim=view.box[:2], ylim=view.box[2:])
    model, half_cycle = data.attrs.get("model", "plane"), int(data.attrs["half_cycle"])
    axes = {"axisymmetric": ("r (mm)", "z (mm)"), "solid": ("place along the sliding (mm)", "height (mm)")}
    ax.set_xlabel(axes.get(model, ("x (mm)",))[0])
    ax.set_ylabel(axes.get(model, ("", "z (mm)"))[1])
    factor = f"displacement and wear × {view.factor:,g}"
    ax.set_title(f"{name[:1].upper()}{name[1:]}, half-cycle {half_cycle:,}: {factor}", loc="left", fontsize="medium")
    ax.text(0.01, 0.02, _way(data, model), transform=ax.transAxes, fontsize="small",
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8})  # fmt: skip
    bar = figure.colorbar(drawn, ax=ax, location="bottom", shrink=0.7, aspect=30,
                          extend="max" if most > high else "neither")  # fmt: skip
    bar.set_label(f"{name} ({unit})" + (f", at single points up to {most:,.4g} {unit}" if most > high else ""))
    return figure


def _way(data: xarray.Dataset, model: str) -> str:
    """Return in words which way the strip moves."""
    direction = int(data.attrs["direction"])
    if model == "solid":
        return "strip moves →" if direction > 0 else "← strip moves"
    moves = f"{strip_moves(data)} {direction_words(data)[direction]}"
    if "turns" in moves:  # its axis points away from who looks at a plane
        return moves if model == "axisymmetric" else f"{moves} (seen against its axis)"
    return f"{moves} →" if direction > 0 else f"← {moves}"
