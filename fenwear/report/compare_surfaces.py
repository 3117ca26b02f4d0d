"""Several runs in one figure where some are solids or rings: lines where all can be drawn on one axis, and series."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import xarray

from fenwear.arrays import Array
from fenwear.report.course import directions_present, mark_few
from fenwear.report.style import legend_beside, panels, run_style
from fenwear.report.surface import centre_of_wear, model_of, radial, surface_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SERIES = {
    "max_pressure": ("Largest contact pressure", "pressure (MPa)"),
    "max_wear": ("Largest worn depth of the punch", "depth (mm)"),
    "max_temperature": ("Largest temperature", "temperature (K)"),
}


def surface_comparison(names: Sequence[str], histories: Sequence[xarray.Dataset]) -> Figure:
    """Draw worn shapes and pressures at the end where all runs are of one model, and their largest values over time."""
    models = {model_of(history) for history in histories}
    lines = _cuts if models == {"solid"} else _radii if models == {"axisymmetric"} else _nothing
    shown = [name for name in SERIES if any(name in history for history in histories)]
    drawn = [lines(history) for history in histories]
    figure, axes = panels(len(drawn[0]) + len(shown), 2.5, share_x=False)
    for number, (name, history) in enumerate(zip(names, histories, strict=True)):
        # Thinner from run to run: where two agree, both are seen.
        style: dict[str, Any] = {**run_style(number), "linewidth": max(1.2, 3.0 - 0.7 * number)}
        for ax, (title, label, place, x, y) in zip(axes, drawn[number], strict=False):
            ax.plot(x, y, label=name, **style)
            ax.set_title(title, loc="left")
            ax.set_ylabel(label)
            ax.set_xlabel(place)
            ax.set_ylim(bottom=0)
        for ax, variable in zip(axes[len(drawn[0]) :], shown, strict=True):
            ax.set_title(SERIES[variable][0], loc="left")
            ax.set_ylabel(SERIES[variable][1])
            ax.set_xscale("log")
            ax.set_xlabel("half-cycle n")
            if variable in history:
                largest = history[variable].rolling(half_cycle=len(directions_present(history)), min_periods=1).max()
                ax.plot(history.half_cycle, largest, label=name, **style, **mark_few(history.half_cycle))
    for ax in axes:
        legend_beside(ax, "run")
    return figure


_Line = tuple[str, str, str, Array, Array]  # title, what is drawn, over what, and both


def _cuts(history: xarray.Dataset) -> list[_Line]:
    surface, at, last = surface_of(history), centre_of_wear(history), history.isel(half_cycle=-1)
    found = []
    for along, way in ((True, "along"), (False, "across")):
        place = f"place {way} the sliding (mm)"
        worn = surface.cut(1e3 * last.wear.values, at, along=along)
        found.append((f"Worn depth of the punch at the end, {way} the sliding", "worn depth w (µm)", place, *worn))
        pressed = surface.cut(last.pressure.values, at, along=along)
        found.append((f"Pressure at the end, {way} the sliding", "pressure p (MPa)", place, *pressed))
    return found


def _radii(history: xarray.Dataset) -> list[_Line]:
    (x, place), last = radial(history), history.isel(half_cycle=-1)
    return [
        ("Worn depth of the punch at the end", "worn depth w (µm)", place, x, 1e3 * last.wear.values),
        ("Pressure at the end", "pressure p (MPa)", place, x, last.pressure.values),
    ]


def _nothing(history: xarray.Dataset) -> list[_Line]:
    del history
    return []
