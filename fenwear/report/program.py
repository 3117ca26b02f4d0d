"""The figure of a test program: what acted over the run, read from its history."""

from __future__ import annotations

from typing import TYPE_CHECKING

import xarray

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
        ax.plot(look.course(history), history[name], color="0", marker=".", markersize=3, linewidth=1, drawstyle=held)
        units = {"mm s-1": " (mm/s)", "rad s-1": " (rad/s)", "K": " (K)", "degC": " (°C)"}
        unit = units.get(str(history[name].attrs.get("units")), "") if name in ("speed", "ambient") else ""
        ax.set_ylabel(f"{ACTED[name]}{unit}")
        low, high = float(history[name].min()), float(history[name].max())
        ax.set_ylim(min(0.0, 1.1 * low), 1.1 * max(high, 1e-300))
    axes[-1].set_xlabel(look.label)
    return figure


def _changes(values: xarray.DataArray) -> bool:
    low, high = float(values.min()), float(values.max())
    return high - low > 1e-9 * max(abs(low), abs(high))
