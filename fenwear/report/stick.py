"""What a run with stick has beside all others: figures of the time steps of its cycles."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import xarray

from fenwear.report import stick_maps
from fenwear.report.gaps import gaps_of, parted
from fenwear.report.stick_course import (
    course_axis,
    cycle_name,
    first_and_last,
    line_along,
    shown_steps,
    title,
    to_contact,
)
from fenwear.report.style import BLUE, RED, STANDARD, Style, from_zero, legend_beside, level_line, panels, shades
from fenwear.report.surface import model_of
from fenwear.results.cycles import cycle_at

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GROSS = 0.2  # energy ratio above which sliding is called gross (Fouvry)


def chosen(history: xarray.Dataset, count: int = 5) -> list[int]:
    """Return the places of recorded cycles at even shares of the wear, the first and the last among them."""
    worn = [history[name] for name in ("wear", "wear_strip") if name in history]
    depth = np.sum([depths.max(depths.dims[1:]).values for depths in worn], axis=0)
    course = depth if depth[-1] > depth[0] else np.arange(len(depth), dtype=float)
    return sorted({int(np.abs(course - target).argmin()) for target in np.linspace(course[0], course[-1], count)})


def loops(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw the fretting loops: tangential force over displacement, and over what is more than full stick's."""
    figure, (whole, beyond) = panels(2, 3.0, share_x=False, look=look)
    turns = history.displacement.units == "rad"
    factor, unit, of = (1.0, "rad", "turn") if turns else (1e3, "µm", "displacement")
    first = cycle_at(history, 0)
    slopes = np.diff(first.tangential_force) / np.where(
        np.diff(first.displacement) == 0, np.inf, np.diff(first.displacement)
    )
    stiffness = float(slopes.max(initial=0.0)) or np.inf
    for colour, place in shades(chosen(history)):
        cycle = cycle_at(history, place)
        closed = np.arange(cycle.sizes["step"] + 1) % cycle.sizes["step"]
        x, y = cycle.displacement.values[closed], cycle.tangential_force.values[closed]
        whole.plot(factor * x, y, color=colour, label=cycle_name(history, place, look))
        beyond.plot(factor * (x - y / stiffness), y, color=colour)
    whole.set_xlabel(f"{of} of the strip ({unit})")
    beyond.set_xlabel(f"{of} less that of full stick\nat the same force ({unit})")
    for ax in (whole, beyond):
        ax.set_ylabel(f"{'torque' if turns else 'tangential force'} ({history.tangential_force.units})")
    legend_beside(whole, look.of_one)
    return figure


def energy(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw friction's work and the energy ratio over the cycles."""
    figure, (upper, lower) = panels(2, 2.2, look=look)
    x = course_axis(lower, history, look)
    upper.plot(x, 1e3 * history.friction_work_increment, color=BLUE, marker=".", markersize=3)
    upper.set_ylabel("work of friction in a cycle (µJ)")
    from_zero(upper)
    lower.plot(x, history.energy_ratio, color=RED, marker=".", markersize=3, label="energy ratio")
    level_line(lower, GROSS, "gross sliding above,\npartial slip below")
    lower.set_ylabel("energy ratio (-)")
    lower.set_ylim(0, max(0.3, 1.1 * float(history.energy_ratio.max())))
    legend_beside(lower, "")
    return figure


def zones(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw where the surfaces stick, slip and are open over the first and the last cycle."""
    from matplotlib.colors import ListedColormap

    places = first_and_last(history)
    figure, axes = panels(len(places), 2.4, look=look)
    colours, x = ListedColormap(("white", RED, BLUE)), history.x.values
    for ax, place in zip(axes, places, strict=True):
        cycle = cycle_at(history, place)
        state = np.where(cycle.stick.values == 1, 2, np.where(cycle.pressure.values > 0, 1, 0))
        steps = np.arange(1, cycle.sizes["step"] + 1)
        at, states = parted(x, state, gaps_of(history))
        ax.pcolormesh(at, steps, states, cmap=colours, vmin=0, vmax=2, shading="nearest", rasterized=True)
        ax.set_ylabel(f"{title(history, place, look)}:\ntime step")
        for colour, name in ((BLUE, "stick"), (RED, "slip")):
            ax.plot([], [], marker="s", linestyle="", color=colour, label=name)
        legend_beside(ax, "")
    to_contact(axes[-1], history)
    return figure


def tractions(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw the tangential traction along the sliding between its bounds in the first and the last cycle."""
    places, line = first_and_last(history), line_along(history)
    figure, axes = panels(len(places), 2.8, look=look)
    mu = float(history.attrs["friction"])
    for ax, place in zip(axes, places, strict=True):
        cycle = cycle_at(history, place)
        for colour, step in shades([*shown_steps(cycle), cycle.sizes["step"] - 1]):
            now = cycle.isel(step=step)
            ax.plot(*line(now.traction.values), color=colour, label=f"{float(now.fraction):.3g}")
        x, bound = line(mu * cycle.pressure.max("step").values)
        ax.fill_between(x, -bound, bound, color="0.85", linewidth=0, zorder=0, label="µ p")
        ax.set_ylabel(f"{title(history, place, look)}:\ntraction (MPa)")
        legend_beside(ax, "part of the cycle")
    to_contact(axes[-1], history)
    return figure


def stresses(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw the stress along x in the strip's surface, its range over the cycle."""
    figure, (ax,) = panels(1, 3.0, look=look)
    for colour, place in shades(chosen(history, 3)):
        cycle = cycle_at(history, place)
        low, high = cycle.surface_stress.min("step"), cycle.surface_stress.max("step")
        ax.plot(history.x, high, color=colour, label=cycle_name(history, place, look))
        ax.plot(history.x, low, color=colour, linestyle=":")
    ax.set_ylabel("stress σ xx in the strip's surface (MPa)")
    legend_beside(ax, look.of_one)
    to_contact(ax, history)
    return figure


def sliding_map(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw where each node slips: its slip in a cycle and its share of friction's work."""
    figure, (slip, work) = panels(2, 2.2, look=look)
    for colour, place in shades(chosen(history, 3)):
        cycle = cycle_at(history, place)
        slid, label = np.abs(cycle.slip), cycle_name(history, place, look)
        slip.plot(history.x, 1e3 * slid.where(cycle.pressure > 0, 0).sum("step"), color=colour, label=label)
        work.plot(history.x, 1e3 * (np.abs(cycle.traction) * slid).sum("step"), color=colour, label=label)
    slip.set_ylabel("slip in a cycle (µm)")
    work.set_ylabel("work of friction in a cycle (µJ/mm²)")
    for ax in (slip, work):
        from_zero(ax)
        legend_beside(ax, look.of_one)
    to_contact(work, history)
    return figure


def stick_figures(history: xarray.Dataset, look: Style = STANDARD) -> dict[str, Figure]:
    """Draw the figures of the time steps, by their names.

    Args:
        history: By cycles, as `fenwear.results.cycles.by_cycles` gives it.
        look: Width and axis.

    Raises:
        CaseError: the run has no such axis.
    """
    common = {"loops": loops, "tractions": tractions, "energy": energy}
    own: dict[str, Callable[[xarray.Dataset, Style], Figure]] = (
        {
            "zones": stick_maps.zones,
            "traction_map": stick_maps.tractions,
            "sliding": stick_maps.sliding_map,
            "stress_range": stick_maps.stresses,
        }
        if model_of(history) == "solid"
        else {"zones": zones, "sliding": sliding_map, "stress_range": stresses}
    )
    return {name: draw(history, look) for name, draw in (common | own).items()}
