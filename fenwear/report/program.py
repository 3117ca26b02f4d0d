"""The figure of a test program: what acted over the run, read from its history."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import xarray

from fenwear.arrays import Array
from fenwear.report.style import STANDARD, Style, panels

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ACTED = {
    "load": "normal force (N)",
    "load_factor": "loads over the case's",
    "speed": "mean speed",
    "ambient": "ambient",
}


def program_figure(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw over the run what acted: the load, the speed and the ambient temperature, where they change."""
    shown = [name for name in ACTED if name in history and _changes(history[name])]
    if "load" in shown and "load_factor" in shown:  # the same twice
        shown.remove("load_factor")
    figure, axes = panels(max(1, len(shown)), 2.4, look=look)
    for ax, name in zip(axes, shown or ["load_factor"], strict=True):
        held = "steps-pre" if name in ("speed", "ambient") else "default"  # constant since the record before
        x, y = look.course(history), history[name].values
        line = _by_stages(history, x, y) if name in ("load", "load_factor") and "stage_ends" in history else (x, y)
        ax.plot(*line, color="0", linewidth=1, drawstyle=held)
        ax.plot(x, y, color="0", marker=".", markersize=3, linestyle="")
        units = {"mm s-1": " (mm/s)", "rad s-1": " (rad/s)", "K": " (K)", "degC": " (°C)"}
        unit = units.get(str(history[name].attrs.get("units")), "") if name in ("speed", "ambient") else ""
        ax.set_ylabel(f"{ACTED[name]}{unit}")
        low, high = float(history[name].min()), float(history[name].max())
        ax.set_ylim(min(0.0, 1.1 * low), 1.1 * max(high, 1e-300))
    axes[-1].set_xlabel(look.label)
    return figure


def _by_stages(history: xarray.Dataset, x: Array, loads: Array) -> tuple[Array, Array]:
    """Return the course of loads that leap from stage to stage and are linear within, through what is recorded of each.

    Args:
        history: With the stages of its program.
        x: Where recorded half-cycles end on the axis (k,).
        loads: In them (k,).
    """
    done, places, course = history.half_cycle.values, [], []
    for (begin, end), ends in zip(history.stage_ends.values, history.stage_loads.values, strict=True):
        rows = np.flatnonzero((done > begin) & (done <= end))
        if len(rows):
            shown = np.array([begin, min(end, done[-1])])
            of_end, there = (np.interp(at, (begin, end), ends) for at in (done[rows[-1]], shown))
            places.append(np.interp(shown, [0, *done], [0, *x]))
            course.append(loads[rows[-1]] * there / of_end)
    return np.concatenate(places), np.concatenate(course)


def _changes(values: xarray.DataArray) -> bool:
    low, high = float(values.min()), float(values.max())
    return high - low > 1e-9 * max(abs(low), abs(high))
