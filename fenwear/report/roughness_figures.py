"""Rough surfaces over a run: heights, bearing curves, and the numbers of their roughness."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import xarray
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.report.course import mark_few, run_axis
from fenwear.report.style import STANDARD, Style, legend_beside, level_line, panels, run_style, shades
from fenwear.report.surface import AXES, model_of, surface_of
from fenwear.results.roughness import bearing_heights, evaluated, levelled
from fenwear.results.sheet import BODIES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHARES = np.asarray(np.linspace(0.0, 1.0, 201), dtype=np.float64)
ROUNDING = 1e-6  # of a surface's size: of coordinates


def rough(history: xarray.Dataset) -> dict[str, str]:
    """Return how names of the bodies with a topography end, by the bodies."""
    return {body: end for body, end in BODIES.items() if f"topography{end}" in history}


def with_surfaces(history: xarray.Dataset, half_cycles: Sequence[int]) -> xarray.Dataset:
    """Return a history with the heights of rough surfaces at some half-cycles as `surface`, mm, NaN at others.

    Less what has worn, and where numbers of roughness are of them less their form, too (the S-F surface of ISO 25178):
    a scar may be many times as deep as its roughness.
    """
    found = {}
    for body, end in rough(history).items():
        worn, places = history[f"wear{end}"], _places(history, body, end)
        heights = np.full(worn.shape, np.nan)
        for row in np.flatnonzero(np.isin(history.half_cycle.values, half_cycles)):
            depth = worn.values[row]
            heights[row] = history[f"topography{end}"].values - depth
            chosen = evaluated(places, depth > 0)
            heights[row, chosen] = levelled(places, heights[row], depth > 0)
        found[f"surface{end}"] = worn.copy(data=heights)
    return history.assign(found)


def roughness_of(history: xarray.Dataset, half_cycles: Sequence[int], look: Style = STANDARD) -> dict[str, Figure]:
    """Return the figure of a run with rough surfaces, by its name; none of others."""
    return {"roughness": roughness_figure(history, half_cycles, look)} if rough(history) else {}


def roughness_figure(history: xarray.Dataset, half_cycles: Sequence[int], look: Style = STANDARD) -> Figure:
    """Draw Sa and Sq, Ssk, and the bearing curves of each rough body at the chosen half-cycles."""
    bodies, x = rough(history), look.course(history)
    figure, axes = panels(2 + len(bodies), 2.4, share_x=False, look=look)
    plane = "y" not in history
    for number, (body, end) in enumerate(bodies.items()):
        names = (("roughness_mean", "Ra" if plane else "Sa"), ("roughness_rms", "Rq" if plane else "Sq"))
        for k, (name, symbol) in enumerate(names):
            label = f"{symbol}, {body}"
            axes[0].plot(x, 1e3 * history[f"{name}{end}"], label=label, **run_style(2 * number + k), **mark_few(x))
        axes[1].plot(x, history[f"roughness_skewness{end}"], label=body, **run_style(2 * number), **mark_few(x))
        ax, places = axes[2 + number], _places(history, body, end)
        for colour, n in shades(half_cycles):
            depth = history[f"wear{end}"].sel(half_cycle=n).values
            z = levelled(places, history[f"topography{end}"].values - depth, depth > 0)
            curve = 1e3 * bearing_heights(z, SHARES)
            ax.plot(100 * SHARES, curve, color=colour, label=look.name(history, n), gid=str(n))
        ax.set_ylabel(f"height of the {body} (µm)")
        ax.set_xlabel("share of the surface above it (%)")
        ax.set_xlim(0, 100)
        legend_beside(ax, look.of_one)
    axes[0].set_ylabel(f"{'Ra, Rq' if plane else 'Sa, Sq'} (µm)")
    axes[0].set_ylim(bottom=0)
    axes[1].set_ylabel("Rsk" if plane else "Ssk")
    level_line(axes[1], 0.0, "symmetric")
    for ax in axes[:2]:
        legend_beside(ax, "")
        run_axis(ax, history, look)
    return figure


def _places(history: xarray.Dataset, body: str, end: str) -> NDArray[np.int64]:
    """Return the places of a body's nodes on their grid (n, axes)."""
    along = [AXES[axis] for axis in surface_of(history, body).seen] if model_of(history) == "solid" else ["x"]
    return np.stack([_numbers(history[f"{axis}{end}"].values) for axis in along], axis=1)


def _numbers(along: Array) -> NDArray[np.int64]:
    """Return the whole numbers of evenly spaced coordinates (n,)."""
    low, size = along.min(), float(np.ptp(along))
    steps = np.diff(np.unique(along))
    return np.rint((along - low) / steps[steps > ROUNDING * size].min()).astype(np.int64)
