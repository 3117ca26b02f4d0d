"""Figures of the bodies: geometry with mesh, supports, loads and coordinates; stresses along both contact surfaces."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.case.units import convert
from fenwear.report.style import (
    BLUE,
    GREEN,
    GREY,
    NARROW,
    RED,
    STANDARD,
    Style,
    contact_axis,
    legend_beside,
    panels,
    run_style,
    strip_moves,
)
from fenwear.results.sheet import BODIES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COMPONENTS = {"xx": "σ xx", "zz": "σ zz", "xz": "σ xz"}
SHOWN_WIDE = 2.0  # widths over height of both bodies that are shown whole
LINE_OF_TEXT = 0.07  # of the height of a panel
WORDS = (0.2, 0.4)  # of its width: how wide a name is; of a narrow figure
AROUND = 0.2  # of its size: how far the middle of what goes all the way round is from it
CLOSE_UP = 0.75  # of the contact's width: what a close view has of the bodies above and below
APART = 5.0  # of the distance of contact nodes: from which on two are of two parts
BETWEEN = 0.1  # of the mean length of parts: the gap between two of them
ROUND = 0.5  # height of a contact over its width: from which on the close view has all of it
PLATE: Any = {"facecolor": "white", "alpha": 0.85, "edgecolor": "none", "pad": 1}
FILLS = {"punch": "#d6e4f0", "strip": "#f3e3d6"}


def stress_figure(fields: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw the components of the stress and von Mises' stress along the contact surfaces of both bodies."""
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
    from scipy.spatial import KDTree

    points = np.column_stack([fields[f"{body}_{a}"].values for a in "xz"])
    return KDTree(points).query(np.column_stack([fields[f"{body}_contact_{a}"].values for a in "xz"]))[1]


def geometry_figure(fields: xarray.Dataset, case: Mapping[str, Any], look: Style = STANDARD) -> Figure:
    """Draw both bodies with their elements, supports, loads and coordinates: whole, and near the contact."""
    from matplotlib.lines import Line2D

    figure, axes = panels(2, 4.2, share_x=False, look=look)
    names = {ax: _Names(ax) for ax in axes}
    x, z = fields.punch_contact_x.values, fields.punch_contact_z.values
    width = float(np.ptp(x))
    steps = np.hypot(np.diff(x), np.diff(z))
    apart = 1 + np.flatnonzero(steps > APART * np.median(steps))  # parts of the contact
    for ax in axes:
        for body in BODIES:
            _elements(ax, fields, body)
            _ends(ax, fields, body, case, names[ax] if ax is axes[0] else None)
        ax.plot(*np.insert(np.stack([x, z]), apart, np.nan, axis=1), color=GREEN, linewidth=2.0)
        ax.set_aspect("equal", adjustable="box")
        ax.set_xlabel("x (mm)")
        ax.set_ylabel("z (mm)")
    low, high = float(z.min()) - CLOSE_UP * width, float(z.min()) + CLOSE_UP * width
    if np.ptp(z) > ROUND * width:
        low, high = float(z.min()) - 0.25 * width, float(z.max()) + 0.25 * width
    _cut_off(axes[0], fields, case)
    names[axes[0]].write()
    axes[1].set_xlim(x.min() - 0.5 * width, x.max() + 0.5 * width)
    axes[1].set_ylim(low, high)
    _sliding(axes[1], fields, float(x.mean()), low, width)
    named = {
        "contact": Line2D([], [], color=GREEN, linewidth=2.0),
        "held": Line2D([], [], color=RED, linewidth=2.5),
        "loaded": Line2D([], [], color=BLUE, linewidth=2.5),
    }
    figure.legend(named.values(), named.keys(), loc="outside upper right", frameon=False, ncols=3, fontsize="small")
    figure.set_layout_engine("compressed")  # the axes keep their aspect
    return figure


def _cut_off(ax: Axes, fields: xarray.Dataset, case: Mapping[str, Any]) -> None:
    """Leave out what of a strip lies far beside the punch, which would be small beside it, and say what is there."""
    high = np.ptp(np.concatenate([fields[f"{body}_z"].values for body in BODIES]))
    strip, punch = fields.strip_x.values, fields.punch_x.values
    middle, half = (punch.max() + punch.min()) / 2, max(SHOWN_WIDE * high / 2, 0.75 * np.ptp(punch))
    supports = case.get("strip", {}).get("supports", ())
    bottom = float(fields.strip_z.values.min())
    figure: Any = ax.figure
    narrow = figure.get_size_inches()[0] < NARROW
    for sign, end in ((-1, float(strip.min())), (1, float(strip.max()))):
        edge = middle + sign * half
        if sign * (end - edge) <= 0.1 * half:
            continue
        ax.set_xlim(**{"left" if sign < 0 else "right": edge})
        groups = [(support["fix"], _group(fields, "strip", support)) for support in supports]
        held = [", ".join(f"u{a}" for a in fix) for fix, lines in groups if _all_beyond(lines, middle, half, sign)]
        held_there = "\nheld there:\n" if narrow else "\nheld there: "
        text = f"to x =\n{end:.4g} mm" if narrow else f"to x = {end:.4g} mm"
        text += held_there + "; ".join(held) if held else ""
        ax.annotate(text, (edge, bottom), (0, -6), textcoords="offset points", ha="left" if sign < 0 else "right",
                    va="top", color=GREY, fontsize="small", zorder=6, bbox=PLATE)  # fmt: skip
        ax.annotate("", (edge, (bottom + float(fields.strip_z.values.max())) / 2), (-18 * sign, 0),
                    textcoords="offset points", arrowprops={"arrowstyle": "-|>", "color": GREY}, zorder=6)  # fmt: skip
    if ax.get_xlim()[1] - ax.get_xlim()[0] <= 2.2 * half:
        ax.set_ylim(bottom - (0.6 if narrow else 0.2) * high)


def _all_beyond(lines: list[Array], middle: float, half: float, sign: int) -> bool:
    """Return whether all of a group lies out of what is shown, some of it on this side."""
    x = np.concatenate([line[:, 0] for line in lines] or [np.array([middle])])
    return bool((np.abs(x - middle) > half).all() and (sign * (x - middle) > 0).any())


class _Names:
    """Names beside what is held, one below the other where they would meet."""

    def __init__(self, ax: Axes) -> None:
        self.ax = ax
        self.found: list[tuple[float, float, str, str, bool]] = []

    def add(self, points: Array, text: str, colour: str) -> None:
        """Take a name of points that are held."""
        around = points.mean(axis=0)
        if len(points) > 1 and np.linalg.norm(points - around, axis=1).min() > AROUND * np.ptp(points):
            top = points[points[:, 1].argmax()]  # of what goes all the way round: in its middle others may be
            self.found.append((float(top[0]), float(top[1]), text, colour, False))
            return
        right = points[points[:, 0] > points[:, 0].max() - 1e-6 * (1 + np.ptp(points[:, 0]))]
        upright = bool(np.ptp(right[:, 1]) > 0 or len(points) == 1)
        x, z = right.mean(axis=0) if upright else points.mean(axis=0)
        self.found.append((float(x), float(z), text, colour, upright))

    def write(self) -> None:
        """Write all names that lie within the axes."""
        (left, right), (low, high) = self.ax.get_xlim(), self.ax.get_ylim()
        within = [one for one in self.found if left <= one[0] <= right and low <= one[1] <= high]
        apart = LINE_OF_TEXT * (high - low)
        figure: Any = self.ax.figure
        beside = WORDS[bool(figure.get_size_inches()[0] < NARROW)]
        taken: list[tuple[float, float]] = []
        for x, z, text, colour, upright in sorted(within, key=lambda one: -one[1]):
            level = z
            while any(abs(x - other) < beside * (right - left) and abs(level - at) < apart for other, at in taken):
                level -= apart / 4
            taken.append((x, level))
            offset = (6, 0) if upright else (0, -6)
            self.ax.annotate(text, (x, level), offset, textcoords="offset points", color=colour, fontsize="small",
                             zorder=5, ha="left" if upright else "center", va="center" if upright else "top",
                             bbox=PLATE)  # fmt: skip


def _elements(ax: Axes, fields: xarray.Dataset, body: str) -> None:
    """Draw the elements of a body: the edges of its linear cells that lie on an element's boundary."""
    from matplotlib.collections import LineCollection, PolyCollection

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


def _ends(ax: Axes, fields: xarray.Dataset, body: str, case: Mapping[str, Any], names: _Names | None) -> None:
    """Draw what holds a body, with its name, and what loads it."""
    size = 0.05 * float(np.hypot(*(np.ptp(fields[f"{body}_{a}"].values) for a in "xz")))
    for support in case.get(body, {}).get("supports", ()):
        lines = _group(fields, body, support)
        for line in lines:
            ax.plot(*line.T, color=RED, linewidth=2.5, marker="^" if len(line) == 1 else None, zorder=3)
        if len(lines) and names is not None:
            names.add(np.concatenate(lines), "held: " + ", ".join(f"u{axis}" for axis in support["fix"]), RED)
    for load in case.get(body, {}).get("loads", ()):
        lines = _group(fields, body, load)
        for line in lines:
            ax.plot(*line.T, color=BLUE, linewidth=2.5, marker="o" if len(line) == 1 else None, zorder=3)
        way = np.array([convert(part, unit) for part, unit in _vector(load)])
        if len(lines) and np.linalg.norm(way) > 0:
            points = np.concatenate(lines)
            step = size * way / np.linalg.norm(way)
            for end in points[np.unique(np.linspace(0, len(points) - 1, 5).round().astype(int))]:
                ax.annotate("", end, end - step, arrowprops={"arrowstyle": "-|>", "color": BLUE}, zorder=4)


def _vector(load: Mapping[str, Any]) -> list[tuple[Any, str]]:
    key, unit = ("force", "N") if load.get("force") is not None else ("traction", "MPa")
    return [(part, unit) for part in load[key]]


def _group(fields: xarray.Dataset, body: str, part: Mapping[str, Any]) -> list[Array]:
    """Return the lines (2, 2) or points (1, 2) of the group that a support or a load is on, mm."""
    if part.get("at") is not None:
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
