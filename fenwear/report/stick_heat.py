"""Pictures of the heat of contact with stick: temperatures of both surfaces, and where the heat of a cycle goes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray

from fenwear.report.course import WHERE_HEAT_GOES, temperature_unit
from fenwear.report.stick_course import course_axis, cycle_name, first_and_last, title
from fenwear.report.stick_maps import panels_of_maps
from fenwear.report.style import (
    RED,
    STANDARD,
    Look,
    contact_axis,
    legend_beside,
    name_panel,
    panels,
    run_style,
    shades,
)
from fenwear.report.surface import surface_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SMALL = 1e-6  # of the largest heat of friction: not drawn


def temperatures(history: xarray.Dataset, chosen: Sequence[int], look: Look = STANDARD) -> Figure:
    """Draw the temperatures of both surfaces at the end of chosen cycles."""
    figure, (ax,) = panels(1, 3.0, look=look)
    for colour, place in shades(chosen):
        end = history.isel(cycle=place, step=-1)
        ax.plot(history.x, end.temperature_punch, color=colour, label=cycle_name(history, place, look))
        ax.plot(history.x, end.temperature_strip, color=colour, linestyle=":")
    ax.set_ylabel(f"temperature at the end\nof the cycle ({temperature_unit(history)}):\npunch, dotted strip")
    contact_axis(ax)
    legend_beside(ax, look.of_one)
    return figure


def temperature_maps(history: xarray.Dataset, look: Look = STANDARD) -> Figure:
    """Draw the temperatures of both surfaces of a solid at the end of the first and the last cycle."""
    surface, places = surface_of(history), first_and_last(history)
    figure, axes = panels_of_maps(history, surface, len(places), 2, look)
    ends = history.isel(cycle=places, step=-1)
    both = [ends[f"temperature_{body}"].values for body in ("punch", "strip")]
    low, high = min(float(values.min()) for values in both), max(float(values.max()) for values in both)
    drawn: Any = None
    for row, place in enumerate(places):
        for ax, body, values in zip(axes[row], ("punch", "strip"), both, strict=True):
            drawn = ax.tripcolor(*surface.drawn(values[row]), shading="gouraud", cmap="YlOrRd", vmin=low,
                                 vmax=max(high, low + 1e-9), rasterized=True)  # fmt: skip
            name_panel(ax, f"{body}, {title(history, place, look)}, end")
    bar = figure.colorbar(drawn, ax=axes, location="bottom", shrink=0.6, aspect=35)
    bar.set_label(f"temperature of the surface ({temperature_unit(history)})")
    return figure


def heat_course(history: xarray.Dataset, look: Look = STANDARD) -> Figure:
    """Draw the largest temperature over the cycles, and where the heat of each goes."""
    figure, (upper, lower) = panels(2, 2.4, look=look)
    mark: dict[str, Any] = {"marker": ".", "markersize": 3}
    x = course_axis(lower, history, look)
    upper.plot(x, history.max_temperature, color=RED, **mark)
    upper.set_ylabel(f"largest temperature\nin a cycle ({temperature_unit(history)})")
    lower.plot(x, 1e3 * history.heat_friction, color="0", linewidth=2.5, label="made by friction", **mark)
    largest = float(np.abs(history.heat_friction).max())
    for number, (name, text) in enumerate(WHERE_HEAT_GOES.items()):
        values = history[f"heat_{name}"]
        if float(np.abs(values).max()) > SMALL * largest:
            lower.plot(x, 1e3 * values, label=text, **run_style(number), **mark)
    lower.set_ylabel("heat of a cycle (µJ)")
    legend_beside(lower, "")
    return figure
