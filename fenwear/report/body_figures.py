"""Figures of the bodies from the files in DIR/fields: geometry, stress at the surface, and pictures when deformed.

Pictures show planes and rings as they are meshed, solids in a section along the sliding through the middle of the
contact. Displacement and wear are magnified together, by the factor that the picture names: else worn bodies would seem
to sink into each other. `fields/fields.hdf` has the whole bodies, for ParaView and pyvista.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fenwear.common.arrays import Array, Mask
from fenwear.common.units import convert
from fenwear.report.key_numbers import names_in
from fenwear.report.run_figures import shown_unit
from fenwear.report.style import (
    BLUE,
    GREEN,
    GREY,
    RED,
    STANDARD,
    Style,
    contact_axis,
    direction_words,
    further,
    legend_beside,
    name_bodies,
    panels,
    run_style,
    save,
    strip_moves,
    wrapped,
)
from fenwear.results.hdf5 import load, node_places, side_by_side
from fenwear.results.quantity import BODIES

FIELDS, FIGURES = "fields", "figures"
# Pale to dark, so that outlines stay visible and grey prints keep the order.
SHOWN = {"von_mises": ("von Mises stress", "MPa", "YlGnBu"), "temperature": ("temperature", "K", "YlOrRd")}
FLAT = 1e-4  # of the contact's length: how far a surface that counts as flat may be from a plane
FADES = 0.1  # of the contact's length: over which wear, as it is drawn, fades into the bodies
NEAR = (0.72, 0.5, 0.75)  # of the length: half of what is shown along it, and most below and above the contact
MARGIN, NEIGHBOURS = 0.04, 4
HEXAHEDRON, TETRAHEDRON = 12, 10  # VTK's numbers
COMPONENTS = {"xx": "σ xx", "zz": "σ zz", "xz": "σ xz"}
CLOSE_UP = 0.75  # of the contact's width: what a close view has of the bodies above and below
APART = 5.0  # of the distance of contact nodes: from which on two are of two parts
BETWEEN = 0.1  # of the mean length of parts: the gap between two of them
ROUND = 0.5  # height of a contact over its width: from which on the close view has all of it
PLATE: Any = {"facecolor": "white", "alpha": 0.85, "edgecolor": "none", "pad": 1}
FILLS = {"punch": "#d6e4f0", "strip": "#f3e3d6"}


def field_files(directory: Path) -> list[Path]:
    """Return the files of a run's fields by half-cycle."""
    return sorted((directory / FIELDS).glob("half_cycle_*.nc"))


def field_figures(directory: Path, case: Mapping[str, Any], look: Style = STANDARD) -> dict[str, Figure]:
    """Return geometry and surface stress by the fields of the last half-cycle that has them, by name."""
    files = field_files(directory)
    if not files:
        return {}
    fields = load(files[-1])
    drawn = {"geometry": geometry_figure(fields, case, look)}
    if "punch_stress_xx" in fields:
        drawn["surface_stress"] = stress_figure(fields, look)
    return wrapped(drawn)


def stress_figure(fields: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Return the components of the stress and von Mises' stress along the contact surfaces of both bodies."""
    figure, axes = panels(2, 3.0, look=look)
    contact = _along(fields.punch_contact_x.values, fields.punch_contact_z.values)
    margin = 0.25 * np.ptp(contact)
    for ax, body in zip(axes, BODIES, strict=True):
        x = _along(*(fields[f"{body}_contact_{axis}"].values for axis in "xz"))
        nodes = _contact_nodes(fields, body)
        order = np.argsort(x)
        for number, (part, text) in enumerate(COMPONENTS.items()):
            values = fields[f"{body}_stress_{part}"].values[nodes][order]
            ax.plot(x[order], values, label=text, **run_style(number))
        values = fields[f"{body}_von_mises"].values[nodes][order]
        ax.plot(x[order], values, label="von Mises", **run_style(len(COMPONENTS)))
        ax.set_ylabel(f"stress of the {body} (MPa)")
        legend_beside(ax, "")
    contact_axis(axes[-1])
    axes[-1].set_xlim(contact.min() - margin, contact.max() + margin)
    return figure


def _along(x: Array, z: Array) -> Array:
    """Return where contact nodes are along a contact (n,), mm: x, or the arc length, which is x in the middle."""
    if (np.diff(x) > 0).all():
        return x
    steps = np.hypot(np.diff(x), np.diff(z))
    far = steps > APART * np.median(steps)
    arc = np.append(0.0, np.cumsum(np.where(far, BETWEEN * steps[~far].sum() / (1 + far.sum()), steps)))
    middle = int(np.abs(arc - arc[-1] / 2).argmin())
    return np.asarray(arc - arc[-1] / 2 if far.any() else arc - arc[middle] + x[middle])


def _contact_nodes(fields: xarray.Dataset, body: str) -> NDArray[np.int64]:
    """Return which nodes of a body its contact nodes are."""
    points = np.column_stack([fields[f"{body}_{a}"].values for a in "xz"])
    return cKDTree(points).query(np.column_stack([fields[f"{body}_contact_{a}"].values for a in "xz"]))[1]


def geometry_figure(fields: xarray.Dataset, case: Mapping[str, Any], look: Style = STANDARD) -> Figure:
    """Return both bodies with their elements, supports, loads and coordinates: whole, and near the contact."""
    figure, axes = panels(2, 4.2, share_x=False, look=look)
    x, z = fields.punch_contact_x.values, fields.punch_contact_z.values
    width = float(np.ptp(x))
    steps = np.hypot(np.diff(x), np.diff(z))
    apart = 1 + np.flatnonzero(steps > APART * np.median(steps))  # parts of the contact
    for ax in axes:
        for body in BODIES:
            _elements(ax, fields, body)
            _ends(ax, fields, body, case)
        ax.plot(*np.insert(np.stack([x, z]), apart, np.nan, axis=1), color=GREEN, linewidth=2.0)
        ax.set_aspect("equal", adjustable="box")
        ax.set_xlabel("x (mm)")
        ax.set_ylabel("z (mm)")
    low, high = float(z.min()) - CLOSE_UP * width, float(z.min()) + CLOSE_UP * width
    if np.ptp(z) > ROUND * width:
        low, high = float(z.min()) - 0.25 * width, float(z.max()) + 0.25 * width
    axes[1].set_xlim(x.min() - 0.5 * width, x.max() + 0.5 * width)
    axes[1].set_ylim(low, high)
    _sliding(axes[1], fields, float(x.mean()), low, width)
    named = {"contact": GREEN, "held": RED, "loaded": BLUE}
    handles = [Line2D([], [], color=colour, linewidth=2.5, label=name) for name, colour in named.items()]
    heights = [min(0.75 * look.width * ax.viewLim.height / ax.viewLim.width, 4.2) for ax in axes]
    figure.set_figheight(sum(heights) + 1.5)
    grid: Any = axes[0].get_gridspec()
    grid.set_height_ratios(heights)
    figure.legend(handles=handles, loc="outside upper right", frameon=False, ncols=len(named), fontsize="small")
    figure.set_layout_engine("compressed")  # the axes keep their aspect
    return figure


def _elements(ax: Axes, fields: xarray.Dataset, body: str) -> None:
    """Draw the elements of a body: the edges of its linear cells that lie on an element's boundary."""
    cells = fields[f"{body}_cells"].values
    points = np.column_stack([fields[f"{body}_{a}"].values for a in "xz"])
    parts = int(fields[f"{body}_cells"].attrs["degree"]) ** 2  # linear cells of an element
    ax.add_collection(PolyCollection(points[cells], facecolors=FILLS[body], edgecolors="none", rasterized=True))
    lines = element_edges(cells, parts)
    ax.add_collection(LineCollection(list(points[lines]), colors=GREY, linewidths=0.3))
    ax.update_datalim(points)
    ax.autoscale_view()


def element_edges(cells: NDArray[np.int64], parts: int) -> NDArray[np.int64]:
    """Return the edges (e, 2) that belong to one linear cell alone of the `parts` of its element.

    Args:
        cells: Corners of the linear cells (count, 4), those of an element one after the other.
        parts: Linear cells of an element.
    """
    edges = np.sort(np.stack([cells, np.roll(cells, -1, axis=1)], axis=-1), axis=-1).reshape(-1, 2)
    element = np.repeat(np.arange(len(cells)) // parts, cells.shape[1])
    keep = edges[:, 0] != edges[:, 1]  # of triangles the last corner stands twice
    keyed, counts = np.unique(np.column_stack([element, edges])[keep], axis=0, return_counts=True)
    return np.unique(keyed[counts == 1, 1:], axis=0)


def _ends(ax: Axes, fields: xarray.Dataset, body: str, case: Mapping[str, Any]) -> None:
    """Draw what holds a body, and what loads it."""
    size = 0.05 * float(np.hypot(*(np.ptp(fields[f"{body}_{a}"].values) for a in "xz")))
    for kind, colour, mark in (("supports", RED, "^"), ("loads", BLUE, "o")):
        for part in case.get(body, {}).get(kind, ()):
            for line in _group(fields, body, part):
                ax.plot(*line.T, color=colour, linewidth=2.5, marker=mark if len(line) == 1 else None, zorder=3)
    for part in case.get(body, {}).get("loads", ()):
        key, unit = ("force", "N") if "force" in part else ("traction", "MPa")
        lines, way = _group(fields, body, part), np.array([convert(component, unit) for component in part[key]])
        if lines and np.linalg.norm(way) > 0:
            points = np.concatenate(lines)
            step = size * way / np.linalg.norm(way)
            for end in points[np.unique(np.linspace(0, len(points) - 1, 5).round().astype(int))]:
                ax.annotate("", end, end - step, arrowprops={"arrowstyle": "-|>", "color": BLUE}, zorder=4)


def _group(fields: xarray.Dataset, body: str, part: Mapping[str, Any]) -> list[Array]:
    """Return the lines (2, 2) or points (1, 2) of the group that a support or a load is on, mm."""
    if "at" in part:
        return [np.array([[convert(c, "mm") for c in part["at"]]])]
    name = f"{body}_group_{part['on']}"
    return list(fields[name].values) if name in fields else []


def _sliding(ax: Axes, fields: xarray.Dataset, x: float, z: float, width: float) -> None:
    """Draw the axes and the way of the strip."""
    turns = strip_moves(fields) == "strip turns"
    if not turns:
        ax.annotate("", (x + 0.25 * width, z + 0.12 * width), (x - 0.25 * width, z + 0.12 * width),
                    arrowprops={"arrowstyle": "<|-|>", "color": "0"}, zorder=5)  # fmt: skip
    ax.annotate(
        "strip turns" if turns else "strip slides",
        (x, z + 0.14 * width),
        ha="center",
        va="bottom",
        fontsize="small",
        bbox=PLATE,
        zorder=5,
    )
    for end, text in (((0.16, 0.06), "x"), ((0.06, 0.20), "z")):
        ax.annotate("", end, (0.06, 0.06), xycoords="axes fraction", textcoords="axes fraction",
                    arrowprops={"arrowstyle": "-|>", "color": "0"}, zorder=6)  # fmt: skip
        ax.text(*end, text, transform=ax.transAxes, bbox=PLATE, zorder=6)


class DrawingError(Exception):
    """Pictures of the bodies could not be drawn; names the reason and the remedy."""


@dataclass(frozen=True)
class View:
    """Common scales of all pictures of a run, so that they can be compared.

    Attributes:
        centre: Of the contact (3,), mm.
        along, normal: The strip's way there, and the normal into the punch (3,).
        length: Of the contact along the sliding, mm.
        box: The field: least and largest place along both, mm.
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


def draw_pictures(directory: Path, formats: Sequence[str] = ("png",), *, complete: bool = True) -> list[Path]:
    """Draw the bodies at every half-cycle with fields; return the files.

    Args:
        directory: The folder of a run.
        formats: Of the files.
        complete: Draw all; else one field at the last half-cycle, of planes and rings alone, which takes half a second.

    Raises:
        DrawingError: a part of the stack is missing, or a file of fields cannot be read.
    """
    folder, paths = directory / FIGURES, list[Path]()
    try:
        datasets = [load(path) for path in field_files(directory)[0 if complete else -1 :]]
        if not datasets or not (complete or datasets[0].attrs.get("model") != "solid"):
            return []
        view, names = common_view(datasets), names_in(directory)
        folder.mkdir(exist_ok=True)
        for field in list(view.ranges)[0 if complete else -1 :]:
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


def displacement(data: xarray.Dataset, body: str) -> Array:
    """Return the displacement of a body's nodes (n, 3), mm."""
    return side_by_side(data, [f"{body}_displacement_{axis}" for axis in "xyz"])


def common_view(datasets: Sequence[xarray.Dataset]) -> View:
    """Return the view that fits all half-cycles: the contact surface of the punch and what lies below and above it."""
    first = datasets[0]
    solid = first.attrs.get("model") == "solid"
    along = np.array(first.attrs["along"] if solid else [1.0, 0.0, 0.0])
    normal = np.array(first.attrs["normal"] if solid else [0.0, 0.0, 1.0])
    x = node_places(first, "punch", "_contact")
    length, centre = float(np.ptp(x @ along)), (x.max(axis=0) + x.min(axis=0)) / 2
    centre = centre + ((x - centre) @ normal).min() * normal
    heights = [(node_places(first, body) - centre) @ normal for body in BODIES]
    room = MARGIN * length  # thin bodies do not fill the section
    below, above = min(NEAR[1] * length, room - heights[1].min()), min(NEAR[2] * length, room + heights[0].max())
    above = max(above, room + ((x - centre) @ normal).max())  # a round contact reaches higher
    middle, level, wide = float(centre @ along), float(centre @ normal), NEAR[0] * length
    box = (middle - wide, middle + wide, level - float(below), level + float(above))
    view = View(centre, along, normal, length, box, 1.0, {})
    inside = {body: view.inside(node_places(first, body)) for body in BODIES}
    moved = [np.linalg.norm(displacement(d, b), axis=1)[inside[b]].max(initial=0.0) for d in datasets for b in BODIES]
    # Displacement that is magnified fits surfaces which lie on each other, not the gap between curved ones.
    surfaces = [(node_places(first, body, "_contact") - centre) @ normal for body in BODIES]
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
    x, u, contact = node_places(data, body), displacement(data, body), node_places(data, body, "_contact")
    plane = np.eye(3) - np.outer(view.normal, view.normal)
    tree = cKDTree(contact @ plane)
    count = min(NEIGHBOURS, len(contact))
    distance, near = (table.reshape(len(x), count) for table in tree.query(x @ plane, k=count))
    share = 1 / np.maximum(distance, 1e-9 * view.length)
    depth = (share * data[f"{body}_contact_wear"].values[near]).sum(axis=1) / share.sum(axis=1)
    apart = float(np.median(tree.query(contact @ plane, k=2)[0][:, 1]))
    height = np.abs((x - contact[near[:, 0]]) @ view.normal)
    depth *= np.clip(1 - height / (FADES * view.length), 0, 1) * (distance[:, 0] < apart)
    sign = 1 if body == "punch" else -1
    return np.asarray(x + view.factor * (u + sign * depth[:, None] * view.normal))


def section(data: xarray.Dataset, body: str, field: str, view: View) -> tuple[Array, NDArray[np.int64], Array, Array]:
    """Return the visible section of a body: points (n, 2), triangles (t, 3), values (n,), outlines (m, 2, 2)."""
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
    name, unit, colours = SHOWN[field]
    unit = shown_unit(str(data[f"punch_{field}"].attrs.get("units", unit)))
    low, high = view.ranges[field]
    wide, tall = view.box[1] - view.box[0], view.box[3] - view.box[2]
    figure = Figure(figsize=(7.0, min(6.3 * tall / wide + 1.4, 8.0)), layout="constrained")
    ax: Any = figure.subplots()
    most = low
    for body in BODIES:
        seen, triangles, values, outlines = section(data, body, field, view)
        drawn: Any = ax.tripcolor(*seen.T, triangles, values, shading="gouraud", cmap=colours, vmin=low, vmax=high)
        ax.add_collection(LineCollection(list(outlines), colors="black", linewidths=1.2))
        most = max(most, float(data[f"{body}_{field}"].values[view.inside(node_places(data, body))].max(initial=low)))
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


def magnification(largest: float, width: float) -> float:
    """Return a round factor that shows the largest displacement as about a tenth of the width."""
    if largest <= 0:
        return 1.0
    target = 0.1 * width / largest
    power = 10.0 ** np.floor(np.log10(target))
    return float(max(step * power for step in (1, 2, 5) if step * power <= target))
