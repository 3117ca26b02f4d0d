"""Sliding over a cycle that is a table: tracks of the strip's material on the punch, and how much crosses their way."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.report.style import BLUE, GREY, STANDARD, Style, bar_place, colour_bar, name_panel, panels_of_maps
from fenwear.report.surface import Surface, surface_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TRACKS, ARROWS = 14, 60  # places that have one
RUBBED = 0.01  # of the largest work of friction in a cycle, below which nothing is told of a place
LONG = 0.07  # of the surface's size: the line of a direction that lies in the map


def tracks_of(history: xarray.Dataset, look: Style = STANDARD) -> dict[str, Figure]:
    """Return their picture by its name; none of a history without them, or of surfaces that are unrolled."""
    drawn = "track" in history and not surface_of(history).unrolled
    return {"tracks": tracks_figure(history, look)} if drawn else {}


def tracks_figure(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw tracks over the cycle, and the cross-shear ratio with the principal direction in the last one."""
    from matplotlib.collections import LineCollection

    surface, last = surface_of(history), history.isel(half_cycle=-1)
    seen = list(surface.seen)
    figure, axes = panels_of_maps(1, 2, np.ptp(surface.map, axis=0), look)
    for ax in axes[0]:
        ax.add_collection(LineCollection(list(surface.border), colors=GREY, linewidths=0.8))
        ax.margins(0.05)
        ax.set_xlabel(surface.axis_labels[0])
    axes[0, 0].set_ylabel(surface.axis_labels[1])
    tracks, left, right = history.track.values[:, :, seen], axes[0, 0], axes[0, 1]
    chosen = _spread(surface.map, TRACKS)
    shift = surface.map[chosen] - surface.x[chosen][:, seen]  # of parts that are laid beside each other
    left.add_collection(LineCollection(list(np.moveaxis(tracks[:, chosen] + shift, 1, 0)), colors=BLUE, linewidths=1.0))
    left.plot(*surface.map[chosen].T, "o", color=BLUE, markersize=2.5)
    name_panel(left, "tracks over a cycle")
    work = _work(history, last)
    ratio = np.where(work > RUBBED * work.max(), last.cross_shear.values, np.nan)
    drawn = _shear_map(right, surface, ratio)
    places = _spread(surface.map, ARROWS)
    places = places[np.isfinite(ratio[places])]
    way = np.column_stack([last[f"principal_{axis}"].values for axis in "xyz"])[places][:, seen]
    half = way * LONG * np.ptp(surface.map) / 2
    ends = np.stack([surface.map[places] - half, surface.map[places] + half], axis=1)
    right.add_collection(LineCollection(list(ends), colors="black", linewidths=0.9))
    name_panel(right, "cross-shear and main direction")
    colour_bar(figure, drawn, list(axes[0]), "cross-shear ratio (-)", **bar_place(look))
    return figure


def _work(history: xarray.Dataset, last: xarray.Dataset) -> Array:
    """Return what is rubbed at each node (n,): the work of friction there, or what slides where there is none."""
    work = np.asarray(last.dissipated_energy.values, dtype=np.float64)
    return work if work.max() > 0 else np.linalg.norm(history.slid.values, axis=2).sum(axis=0)


def _shear_map(ax: Any, surface: Surface, ratio: Array) -> Any:
    """Draw the ratio (n,), NaN where nothing rubs."""
    from matplotlib import colormaps

    levels = np.linspace(0, 0.5, 11)
    triangles, shown = surface.drawn(ratio)
    triangles.set_mask(~np.isfinite(shown)[triangles.triangles].all(axis=1))
    return ax.tricontourf(triangles, np.nan_to_num(shown), levels=levels, cmap=colormaps["YlGnBu"])


def _spread(places: Array, count: int) -> NDArray[np.int64]:
    """Return which of places (n, 2) lie far apart: from that in the middle on each farthest from all before."""
    first = int(np.linalg.norm(places - places.mean(axis=0), axis=1).round(9).argmin())
    found, apart = [first], np.full(len(places), np.inf)
    while len(found) < min(count, len(places)):
        apart = np.minimum(apart, np.linalg.norm(places - places[found[-1]], axis=1))
        found.append(int(apart.round(9).argmax()))
    return np.array(found)
