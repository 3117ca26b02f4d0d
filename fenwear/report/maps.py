"""Maps of contact surfaces: fields at chosen half-cycles, sliding over a cycle that is a table, flash temperatures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from fenwear.common.arrays import Array, Mask
from fenwear.report.drawn_surface import AXES, Surface, model_of, surface_of
from fenwear.report.lines import Field, pressure_top
from fenwear.report.style import (
    BLUE,
    BODY_COLOURS,
    GREY,
    NARROW,
    STANDARD,
    Style,
    bar_place,
    colour_bar,
    from_zero,
    legend_beside,
    name_panel,
    one_way,
    panels,
    panels_of_maps,
    row_of,
)
from fenwear.results.quantity import BODIES
from fenwear.results.roughness import evaluated, levelled

LEVELS = 16
LONG = 2.2  # length over height of a map from which on fewer stand beside each other
MARGIN = 0.15  # of a contact's extent: what a map of it shows beside it
EDGE_OF_CONTACT = 1e-2  # of the largest pressure
TRACKS, DIRECTIONS = 14, 60  # places that have one
RUBBED = 0.01  # of the largest work of friction in a cycle, below which a place has no ratio
STRAIGHT = 0.07  # of the surface's size: the line of a direction that lies in the map
ROUNDING = 1e-6  # of a surface's size: of coordinates


def map_figure(history: xarray.Dataset, field: Field, half_cycles: Sequence[int], look: Style = STANDARD) -> Figure:
    """Return maps of a field on its surface at each chosen half-cycle.

    All have the same colours, but worn depths, which are shown over the largest one of each half-cycle.
    """
    surface = surface_of(history, field.body)
    values: Array = field.factor * history[field.variable].sel(half_cycle=list(half_cycles)).values
    largest, label = values.max(axis=1), field.label
    levels, extend = _levels(history, field, values, half_cycles)
    names = [look.in_words(history, row_of(history, n)) for n in half_cycles]
    titles = [f"{name}\n{_size(field, values[k])}" for k, name in enumerate(names)]
    if field.variable.startswith("wear"):
        values = values / np.where(largest > 0, largest, 1.0)[:, None]
        levels, extend, label = np.arange(11) / 10, "neither", f"{field.title} over the largest one"
    if field.variable == "pressure" and one_way(history):
        arrows = [surface.arrow(int(d)) for d in history.direction.sel(half_cycle=list(half_cycles)).values]
        titles = [title.replace("\n", f" {arrow}\n") for title, arrow in zip(titles, arrows, strict=True)]
    figure, axes = map_panels(surface, titles, look, within=_reached(history, field.body))
    for k, ax in enumerate(axes):
        shown = np.clip(values[k], levels[0], None)
        drawn = surface.contours(ax, shown, levels=levels, cmap=field.colours, extend=extend)
    colour_bar(figure, drawn, axes, label, **bar_place(look))
    if field.variable == "pressure":
        for k, ax in enumerate(axes):
            level = EDGE_OF_CONTACT * float(values[k].max())
            if values[k].min() < level < values[k].max():
                surface.contours(ax, values[k], filled=False, levels=[level], colors="black", linewidths=1.0)
    return figure


def _reached(history: xarray.Dataset, body: str) -> Mask:
    """Return which nodes of a body's surface touch or wear in a run (n,); all where none does."""
    end = BODIES[body]
    names = [name for name in (f"wear{end}", "pressure" if body == "punch" else "") if name in history]
    reached: Mask = np.any([(history[name].values > 0).any(axis=0) for name in names], axis=0)
    return reached if reached.any() else np.ones_like(reached)


def _size(field: Field, values: Array) -> str:
    """Return the largest of a field's values as text; of heights both ends."""
    most, unit = float(values.max()), "" if field.unit == "1" else field.unit
    size = f"≤ {most:,.0f}" if most >= 1000 else f"≤ {most:.3g}"
    return f"{values.min():.3g} to {most:.3g} {unit}" if field.variable.startswith("surface") else f"{size} {unit}"


def map_panels(
    surface: Surface, titles: Sequence[str], look: Style, *, columns: int = 0, within: Mask | slice = slice(None)
) -> tuple[Figure, list[Axes]]:
    """Return a figure of equal maps with the surface's border on each.

    Args:
        surface: The surface.
        titles: Above each map.
        look: Width of the figure.
        columns: Maps beside each other; 0 for as many as fit.
        within: Nodes around which maps end (n,); by default all.
    """
    seen = surface.map[within]
    low, high = seen.min(axis=0), seen.max(axis=0)
    room = (0.03 if len(seen) == len(surface.map) else MARGIN) * float((high - low).max()) + 1e-9
    size, count = high - low + 2 * room, len(titles)
    fitting = 1 if size[0] > LONG**2 * size[1] else 2 if size[0] > LONG * size[1] else 3
    columns = min(count, columns or fitting, 2 if look.width < NARROW and not columns else count)
    rows = -(-count // columns)
    figure, axes = panels_of_maps(rows, columns, size, look)
    shown = list(axes.ravel()[:count])
    for ax in axes.ravel()[count:]:
        ax.set_visible(False)
    for ax, title in zip(shown, titles, strict=True):
        name_panel(ax, title)
        ax.add_collection(LineCollection(list(surface.border), colors=GREY, linewidths=0.8))
        for name, (across, up) in surface.labels:
            ax.text(across, up, name, ha="center", va="center", fontsize="small", color=GREY)
        ax.set(xlim=(low[0] - room, high[0] + room), ylim=(low[1] - room, high[1] + room))
        surface.set_ticks(ax)
    for lowest in shown[-columns:]:  # the last row may be shorter
        lowest.set_xlabel(surface.axis_labels[0])
        lowest.tick_params(labelbottom=True)
    for ax in axes[:, 0]:
        ax.set_ylabel(surface.axis_labels[1])
    return figure, shown


def _levels(history: xarray.Dataset, field: Field, values: Array, half_cycles: Sequence[int]) -> tuple[Array, str]:
    """Return round steps of the colours, and whether what is above them is cut off."""
    low, high = float(values.min()), float(values.max())
    top = pressure_top(history, half_cycles) if field.variable == "pressure" else np.inf
    low = 0.0 if 0 <= low < high / 2 else low
    most, locator = min(high, top), MaxNLocator(LEVELS, steps=[1, 2, 2.5, 5, 10])
    levels = np.asarray(locator.tick_values(low, most if most > low else low + 1.0))
    return levels, "max" if high > top else "neither"


def with_surfaces(history: xarray.Dataset, half_cycles: Sequence[int]) -> xarray.Dataset:
    """Return a history with the heights of rough surfaces at some half-cycles as `surface`, mm, NaN at others.

    Less what has worn, and where numbers of roughness are of them less their form, too (the S-F surface of ISO 25178):
    a scar may be many times as deep as its roughness.
    """
    surfaces = {}
    for body, end in BODIES.items():
        if f"topography{end}" not in history:
            continue
        worn, places = history[f"wear{end}"], _places(history, body, end)
        heights = np.full(worn.shape, np.nan)
        for row in np.flatnonzero(np.isin(history.half_cycle.values, half_cycles)):
            depth = worn.values[row]
            heights[row] = history[f"topography{end}"].values - depth
            heights[row, evaluated(places, depth > 0)] = levelled(places, heights[row], depth > 0)
        surfaces[f"surface{end}"] = worn.copy(data=heights)
    return history.assign(surfaces)


def _places(history: xarray.Dataset, body: str, end: str) -> NDArray[np.int64]:
    """Return the places of a body's nodes on their grid (n, axes)."""
    along = [AXES[axis] for axis in surface_of(history, body).seen] if model_of(history) == "solid" else ["x"]
    columns = []
    for axis in along:
        x = history[f"{axis}{end}"].values
        steps = np.diff(np.unique(x))
        columns.append(np.rint((x - x.min()) / steps[steps > ROUNDING * np.ptp(x)].min()))
    return np.stack(columns, axis=1).astype(np.int64)


def has_tracks(history: xarray.Dataset) -> bool:
    """Return whether a history has tracks that a map can show: not on surfaces that are unrolled."""
    return "track" in history and not surface_of(history).unrolled


def tracks_figure(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Return tracks over the cycle, and the cross-shear ratio with the principal direction in the last one."""
    surface, last = surface_of(history), history.isel(half_cycle=-1)
    seen = list(surface.seen)
    figure, (left, right) = map_panels(surface, ["tracks over a cycle", "cross-shear and main direction"], look)
    chosen = _spread(surface.map, TRACKS)
    shift = surface.map[chosen] - surface.x[chosen][:, seen]  # of parts that are laid beside each other
    tracks = history.track.values[:, :, seen][:, chosen] + shift
    left.add_collection(LineCollection(list(np.moveaxis(tracks, 1, 0)), colors=BLUE, linewidths=1.0))
    left.plot(*surface.map[chosen].T, "o", color=BLUE, markersize=2.5)
    left.autoscale()
    work = np.asarray(last.dissipated_energy.values, dtype=np.float64)
    if work.max() <= 0:  # without friction: what slides
        work = np.linalg.norm(history.slid.values, axis=2).sum(axis=0)
    ratio = np.where(work > RUBBED * work.max(), last.cross_shear.values, np.nan)
    triangles, shown = surface.drawn(ratio)
    triangles.set_mask(~np.isfinite(shown)[triangles.triangles].all(axis=1))
    drawn = right.tricontourf(triangles, np.nan_to_num(shown), levels=np.linspace(0, 0.5, 11), cmap="YlGnBu")
    places = _spread(surface.map, DIRECTIONS)
    places = places[np.isfinite(ratio[places])]
    way = np.column_stack([last[f"principal_{axis}"].values for axis in "xyz"])[places][:, seen]
    half = way * STRAIGHT * np.ptp(surface.map) / 2
    ends = np.stack([surface.map[places] - half, surface.map[places] + half], axis=1)
    right.add_collection(LineCollection(list(ends), colors="black", linewidths=0.9))
    colour_bar(figure, drawn, [left, right], "cross-shear ratio (-)", **bar_place(look))
    return figure


def _spread(places: Array, count: int) -> NDArray[np.int64]:
    """Return which of places (n, 2) lie far apart: from that in the middle on each farthest from all before."""
    first = int(np.linalg.norm(places - places.mean(axis=0), axis=1).round(9).argmin())
    chosen, apart = [first], np.full(len(places), np.inf)
    while len(chosen) < min(count, len(places)):
        apart = np.minimum(apart, np.linalg.norm(places - places[chosen[-1]], axis=1))
        chosen.append(int(apart.round(9).argmax()))
    return np.array(chosen)


def flash_map(temperatures: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw the rise of both surfaces at the instant at which one of them is hottest, and the edge of the contact."""
    first, second = temperatures.pressure.dims[1:]
    warmth = np.maximum(temperatures.flash_punch.values, temperatures.flash_strip.values)
    at = int(warmth.max(axis=(1, 2)).argmax())  # the instant at which a surface is hottest
    x, y = temperatures[first].values, temperatures[second].values
    figure, axes = panels_of_maps(1, 2, np.array([np.ptp(x), np.ptp(y)]), look)
    rises = [temperatures[f"flash_{body}"].values[at].T for body in BODIES]
    low, high = min(rise.min() for rise in rises), max(rise.max() for rise in rises)
    drawn: Any = None
    for ax, body, rise in zip(axes.ravel(), BODIES, rises, strict=True):
        drawn = ax.pcolormesh(x, y, rise, cmap="YlOrRd", vmin=min(low, 0.0), vmax=high or 1.0, shading="nearest")
        touching = temperatures.pressure.values[at].T > 0
        if touching.any() and not touching.all():
            ax.contour(x, y, touching, levels=[0.5], colors="black", linewidths=0.8)
        name_panel(ax, f"{body}\n≤ {rise.max():.3g} K")
        ax.set_xlabel(f"{first} (mm)")
    axes[0, 0].set_ylabel(f"{second} (mm)")
    colour_bar(figure, drawn, axes, "rise over the bulk (K)", **bar_place(look))
    return figure


def flash_course(temperatures: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw the largest rise of both surfaces, and the mean of the contact, over the cycle."""
    figure, axes = panels(1, 3.0, look=look)
    touching = temperatures.pressure.values > 0
    count = np.maximum(touching.sum(axis=(1, 2)), 1)
    for body in BODIES:
        rise = temperatures[f"flash_{body}"].values
        mean = (rise * touching).sum(axis=(1, 2)) / count
        for values, line, words in ((rise.max(axis=(1, 2)), "-", "largest"), (mean, "--", "mean")):
            axes[0].plot(temperatures.time.values, values, line, color=BODY_COLOURS[body], label=f"{body}: {words}")
    axes[0].set_xlabel("time from the cycle's begin (s)")
    axes[0].set_ylabel("rise over the bulk (K)")
    from_zero(axes[0])
    legend_beside(axes[0], "")
    return figure


def flash_figures(temperatures: xarray.Dataset, look: Style = STANDARD) -> dict[str, Figure]:
    """Return the figures of flash temperatures, by name."""
    drawn = {"flash": flash_map(temperatures, look)}
    if len(temperatures.time) > 1:
        drawn["flash_course"] = flash_course(temperatures, look)
    return drawn
