"""Figures of a run, drawn from its folder alone."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray

from fenwear.errors import CaseError, InputError
from fenwear.report.course import (
    bores_of,
    convergence_figure,
    creep_figure,
    directions_present,
    friction_figure,
    heat_balance_figure,
    is_conforming,
    mean_pressure,
    peak_figure,
    place_figure,
    scar_figure,
    temperature_unit,
    volume_figure,
)
from fenwear.report.lies_between import between_figure, lies_between
from fenwear.report.maps import cuts_figure, map_figure, quantities, quantities_between
from fenwear.report.program import program_figure
from fenwear.report.roughness_figures import roughness_of, with_surfaces
from fenwear.report.shapes import profile_figure, shape_figure, wear_map_figure
from fenwear.report.shown import chosen_half_cycles, cycle_means, early_half_cycles, early_of, nearest_half_cycles
from fenwear.report.stick import stick_figures
from fenwear.report.style import (
    STANDARD,
    Style,
    contact_axis,
    from_zero,
    legend_beside,
    level_line,
    panels,
    shades,
    wrapped,
)
from fenwear.report.surface import along_contact, model_of
from fenwear.report.tracks import tracks_of
from fenwear.results.cycles import by_cycles, resolves
from fenwear.results.history import HISTORY
from fenwear.results.reading import load_history
from fenwear.results.sheet import BODIES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FOLDER = "figures"
MAPS = 6  # at most


def read_history(directory: Path) -> xarray.Dataset:
    """Return the history of a run, in memory.

    Raises:
        CaseError: there is none, it cannot be read, or holds no half-cycle yet.
    """
    return of_half_cycles(directory, load_history(directory))


def of_half_cycles(directory: Path, history: xarray.Dataset) -> xarray.Dataset:
    """Return the history of a run if it is one of half-cycles.

    Raises:
        CaseError: it is none, or holds no half-cycle yet.
    """
    if not {"half_cycle", "pressure", "wear"} <= set(history.variables):
        raise CaseError(InputError(str(directory / HISTORY), "no history of a run: it has other variables"))
    if history.sizes["half_cycle"] == 0:
        raise CaseError(InputError(str(directory / HISTORY), "holds no half-cycle yet"))
    return history


def pressure_figure(history: xarray.Dataset, half_cycles: Sequence[int], look: Style = STANDARD) -> Figure:
    """Draw the pressure in both directions, at each chosen half-cycle and the one beside it.

    What lies far beyond all later pressures has a panel of its own, so that nothing is cut off.
    """
    present = directions_present(history)
    rows = {d: history.isel(half_cycle=np.flatnonzero(history.direction.values == d)) for d in present}
    chosen = {d: nearest_half_cycles(own, half_cycles) for d, own in rows.items()}
    early = {d: early_half_cycles(own, chosen[d]) for d, own in rows.items()}
    figure, axes = panels(len(present) + any(early.values()), 3.0, look=look)
    x = along_contact(history)[0]
    for ax, d in zip(axes, present, strict=False):
        for colour, n in shades(chosen[d]):
            drawn = axes[-1] if n in early[d] else ax
            style = {
                "color": colour,
                "label": look.name(history, n),
                "gid": str(n),
                "linestyle": "-" if d > 0 else "--",
            }
            drawn.plot(x, rows[d].pressure.sel(half_cycle=n), **style)
    return _along(history, figure, axes, "contact pressure p (MPa)", axes[: len(present)], look)


def mean_pressure_figure(history: xarray.Dataset, half_cycles: Sequence[int], look: Style = STANDARD) -> Figure:
    """Draw mean pressures of all directions up to some cycles: what is well posed where a contact's edge moves."""
    means = cycle_means(history, half_cycles)
    early = early_of(means)
    figure, axes = panels(2 if early else 1, 3.0, look=look)
    x = along_contact(history)[0]
    for colour, n in shades(list(means)):
        ax = axes[-1] if n in early else axes[0]
        ax.plot(x, means[n], color=colour, label=look.name(history, n), gid=str(n))
    return _along(history, figure, axes, "mean pressure (MPa)", axes[:1], look)


def temperature_figure(history: xarray.Dataset, half_cycles: Sequence[int], look: Style = STANDARD) -> Figure:
    """Draw the temperature along both contact surfaces at the chosen half-cycles."""
    figure, axes = panels(2, 3.0, look=look)
    x, label = along_contact(history)
    for ax, body in zip(axes, BODIES, strict=True):
        for colour, n in shades(half_cycles):
            values = history[f"temperature_{body}"].sel(half_cycle=n)
            ax.plot(x, values, color=colour, label=look.name(history, n), gid=str(n))
        ax.set_ylabel(f"temperature of the {body} ({temperature_unit(history)})")
        legend_beside(ax, look.of_one)
    contact_axis(axes[-1], label)
    return figure


def _along(
    history: xarray.Dataset, figure: Figure, axes: Sequence[Axes], name: str, with_mean: Sequence[Axes], look: Style
) -> Figure:
    """Name the axes of pressures along a contact, some with their mean."""
    if is_conforming(history):
        mean = mean_pressure(history)
        for ax in with_mean:
            level_line(ax, mean, f"mean {mean:.4g} MPa")
    for ax in axes:
        ax.set_ylabel(name)
        from_zero(ax)
        legend_beside(ax, look.of_one)
    contact_axis(axes[-1], along_contact(history)[1])
    return figure


def all_figures(history: xarray.Dataset, wanted: Sequence[int] = (), look: Style = STANDARD) -> dict[str, Figure]:
    """Draw every figure that the history has data for, by its name."""
    chosen = chosen_half_cycles(history, wanted)
    drawn: dict[str, Figure] = {}
    model = model_of(history)
    if model == "solid":
        surfaces = with_surfaces(history, chosen[-MAPS:])
        shown = quantities(surfaces) | quantities_between(history)
        drawn |= {name: map_figure(surfaces, one, chosen[-MAPS:], look) for name, one in shown.items()}
        drawn |= tracks_of(history, look)
        drawn["cuts_along"] = cuts_figure(history, chosen, look, along=True)
        drawn["cuts_across"] = cuts_figure(history, chosen, look, along=False)
    else:
        if model == "plane":
            drawn["profiles"] = profile_figure(history, chosen, look)
            drawn["wear_map"] = wear_map_figure(history, look)
        drawn["shape"] = shape_figure(history, chosen, look)
        drawn["pressure"] = pressure_figure(history, chosen, look)
        if cycle_means(history, chosen):
            drawn["mean_pressure"] = mean_pressure_figure(history, chosen, look)
        if "largest_temperature" in history:
            drawn["temperature"] = temperature_figure(history, chosen, look)
        if lies_between(history):
            drawn["between"] = between_figure(history, chosen, look)
    drawn |= roughness_of(history, look)
    drawn["peaks"] = peak_figure(history, look)
    if bores_of(history):
        drawn["place"] = place_figure(history, look)
    if "sliding_distance" in history:
        drawn["volume"] = volume_figure(history, Style(look.width, "distance"))
        drawn["scar"] = scar_figure(history, look)
        drawn["friction"] = friction_figure(history, look)
    if any(str(name).startswith("creep_volume") for name in history.data_vars):
        drawn["creep"] = creep_figure(history, Style(look.width, "time"))
    if "load_factor" in history:
        drawn["program"] = program_figure(history, look)
    drawn["convergence"] = convergence_figure(history, look)
    if "largest_temperature" in history:
        drawn["heat_balance"] = heat_balance_figure(history, look)
    if resolves(history):
        drawn |= stick_figures(by_cycles(history), look)
    return wrapped(drawn)
