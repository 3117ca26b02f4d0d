"""Figures of solids and rings, drawn from the history of a run: maps and cuts, or lines over the radius; series."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import xarray

from fenwear.report.course import (
    by_direction,
    convergence_figure,
    directions_present,
    heat_balance_figure,
    is_conforming,
    mark_few,
    mean_pressure,
    nominal_width,
    place_figure,
    run_axis,
    temperature_unit,
)
from fenwear.report.figures import chosen_half_cycles, early_half_cycles, nearest_half_cycles
from fenwear.report.maps import cuts_figure, map_figure, quantities
from fenwear.report.program import program_figure
from fenwear.report.style import (
    STANDARD,
    Look,
    legend_beside,
    level_line,
    panels,
    run_style,
    shades,
    strip_moves,
)
from fenwear.report.surface import model_of, radial

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MAPS = 6  # at most


def surface_figures(history: xarray.Dataset, wanted: Sequence[int] = (), look: Look = STANDARD) -> dict[str, Figure]:
    """Draw every figure that the history of a solid or of rings has data for, by its name."""
    chosen = chosen_half_cycles(history, wanted)
    if model_of(history) == "solid":
        shown = chosen[-MAPS:]
        drawn = {name: map_figure(history, quantity, shown, look) for name, quantity in quantities(history).items()}
        drawn["cuts_along"] = cuts_figure(history, chosen, look, along=True)
        drawn["cuts_across"] = cuts_figure(history, chosen, look, along=False)
    else:
        drawn = {
            "shape": ring_shape_figure(history, chosen, look),
            "pressure": ring_pressure_figure(history, chosen, look),
        }
        if "max_temperature" in history:
            drawn["temperature"] = ring_temperature_figure(history, chosen, look)
    drawn["peaks"] = series_figure(history, look)
    if "eccentricity" in history:
        drawn["place"] = place_figure(history, look)
    if "load_factor" in history:
        drawn["program"] = program_figure(history, look)
    drawn["convergence"] = convergence_figure(history, look)
    if "max_temperature" in history:
        drawn["heat_balance"] = heat_balance_figure(history, look)
    return drawn


def series_figure(history: xarray.Dataset, look: Look = STANDARD) -> Figure:
    """Draw over the run: largest pressure, area in contact, depth and size of the scars, and temperature."""
    sizes = [n for n in ("scar_length", "scar_width") if n in history or f"{n}_strip" in history]
    hot = "max_temperature" in history
    figure, axes = panels(4 + hot, 2.3, look=look)
    pressure, area, depth, size, *rest = axes
    by_direction(pressure, history, "max_pressure", look)
    pressure.set_ylabel("largest\npressure (MPa)")
    if is_conforming(history):
        mean = mean_pressure(history)
        level_line(pressure, mean, f"mean {mean:.4g}")
    by_direction(area, history, "contact_area", look)
    area.set_ylabel("area in\ncontact (mm²)")
    if is_conforming(history):
        nominal = nominal_width(history)
        level_line(area, nominal, f"nominal {nominal:.4g}")
        area.set_ylim(top=1.15 * nominal)
    _of_bodies(depth, history, {"max_wear": "worn depth"}, 1e3, look)
    depth.set_ylabel("largest worn\ndepth (µm)")
    _of_bodies(size, history, {name: name.removeprefix("scar_") for name in sizes}, 1.0, look)
    size.set_ylabel("size of the\nscar (mm)")
    for ax in rest:
        by_direction(ax, history, "max_temperature", look)
        ax.set_ylabel(f"largest temper-\nature ({temperature_unit(history)})")
    for ax in axes[:4]:
        ax.set_ylim(bottom=0)
    for ax in (pressure, area, *rest):
        legend_beside(ax, strip_moves(history))
    run_axis(axes[-1], history, look)
    return figure


def _of_bodies(ax: Axes, history: xarray.Dataset, names: dict[str, str], factor: float, look: Look) -> None:
    """Draw variables of both bodies over the run."""
    number = 0
    for name, text in names.items():
        for end, body in (("", "punch"), ("_strip", "strip")):
            if f"{name}{end}" in history:
                style = {**run_style(number), **mark_few(history.half_cycle)}
                ax.plot(look.course(history), factor * history[f"{name}{end}"], label=f"{body}: {text}", **style)
                number += 1
    legend_beside(ax, "")


def ring_pressure_figure(history: xarray.Dataset, half_cycles: Sequence[int], look: Look = STANDARD) -> Figure:
    """Draw the pressure over the radius in both directions, at each chosen half-cycle and the one beside it."""
    present = directions_present(history)
    rows = {d: history.isel(half_cycle=np.flatnonzero(history.direction.values == d)) for d in present}
    chosen = {d: nearest_half_cycles(own, half_cycles) for d, own in rows.items()}
    early = {d: early_half_cycles(own, chosen[d]) for d, own in rows.items()}
    figure, axes = panels(len(present) + any(early.values()), 3.0, look=look)
    x, label = radial(history)
    for ax, d in zip(axes, present, strict=False):
        for colour, n in shades(chosen[d]):
            drawn = axes[-1] if n in early[d] else ax  # what lies far beyond all later ones: nothing is cut off
            drawn.plot(x, rows[d].pressure.sel(half_cycle=n), color=colour, label=look.name(history, n))
        if is_conforming(history):  # named in the legend: lines that wear evenly run along it
            mean = mean_pressure(history)
            level_line(ax, mean, f"mean {mean:.4g}")
    for ax in axes:
        ax.set_ylabel("contact pressure p (MPa)")
        ax.set_ylim(bottom=0)
        legend_beside(ax, look.of_one)
        ax.margins(x=0.01)
    axes[-1].set_xlabel(label)
    return figure


def ring_shape_figure(history: xarray.Dataset, half_cycles: Sequence[int], look: Look = STANDARD) -> Figure:
    """Draw what is worn off both rings over the radius at the chosen half-cycles."""
    bodies = [("punch", "")] + ([("strip", "_strip")] if "wear_strip" in history else [])
    figure, axes = panels(len(bodies), 3.0, look=look)
    for ax, (body, end) in zip(axes, bodies, strict=True):
        x, label = radial(history, end)
        for colour, n in shades(half_cycles):
            ax.plot(x, 1e3 * history[f"wear{end}"].sel(half_cycle=n), color=colour, label=look.name(history, n))
        ax.set_ylabel(f"worn depth of the {body} (µm)")
        ax.set_ylim(bottom=0)
        ax.margins(x=0.01)
        legend_beside(ax, look.of_one)
    axes[-1].set_xlabel(label)
    return figure


def ring_temperature_figure(history: xarray.Dataset, half_cycles: Sequence[int], look: Look = STANDARD) -> Figure:
    """Draw the temperature of both contact surfaces over the radius at the chosen half-cycles."""
    figure, axes = panels(2, 3.0, look=look)
    x, label = radial(history)
    for ax, body in zip(axes, ("punch", "strip"), strict=True):
        for colour, n in shades(half_cycles):
            ax.plot(x, history[f"temperature_{body}"].sel(half_cycle=n), color=colour, label=look.name(history, n))
        ax.set_ylabel(f"temperature of the {body} ({temperature_unit(history)})")
        ax.margins(x=0.01)
        legend_beside(ax, look.of_one)
    axes[-1].set_xlabel(label)
    return figure
