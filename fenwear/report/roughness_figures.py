"""Rough surfaces over a run: heights, and the numbers of their roughness."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import xarray
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.report.course import mark_few, run_axis
from fenwear.report.style import STANDARD, Style, legend_beside, panels, run_style
from fenwear.report.surface import AXES, model_of, surface_of
from fenwear.results.roughness import evaluated, levelled
from fenwear.results.sheet import BODIES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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


def roughness_of(history: xarray.Dataset, look: Style = STANDARD) -> dict[str, Figure]:
    """Return the figure of Sa and Sq of each rough body over the run, by its name; none of others."""
    bodies, x = rough(history), look.course(history)
    if not bodies:
        return {}
    figure, (ax,) = panels(1, 2.4, share_x=False, look=look)
    symbols = ("Sa", "Sq") if "y" in history else ("Ra", "Rq")
    for number, (body, end) in enumerate(bodies.items()):
        for k, (name, symbol) in enumerate(zip(("roughness_Sa", "roughness_Sq"), symbols, strict=True)):
            line = run_style(2 * number + k)
            ax.plot(x, 1e3 * history[f"{name}{end}"], label=f"{symbol}, {body}", **line, **mark_few(x))
    ax.set_ylabel(f"{', '.join(symbols)} (µm)")
    ax.set_ylim(bottom=0)
    legend_beside(ax, "")
    run_axis(ax, history, look)
    return {"roughness": figure}


def _places(history: xarray.Dataset, body: str, end: str) -> NDArray[np.int64]:
    """Return the places of a body's nodes on their grid (n, axes)."""
    along = [AXES[axis] for axis in surface_of(history, body).seen] if model_of(history) == "solid" else ["x"]
    return np.stack([_numbers(history[f"{axis}{end}"].values) for axis in along], axis=1)


def _numbers(along: Array) -> NDArray[np.int64]:
    """Return the whole numbers of evenly spaced coordinates (n,)."""
    low, size = along.min(), float(np.ptp(along))
    steps = np.diff(np.unique(along))
    return np.rint((along - low) / steps[steps > ROUNDING * size].min()).astype(np.int64)
