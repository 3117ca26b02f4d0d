"""Figures of a run, drawn from its folder alone."""

from __future__ import annotations

from collections.abc import Sequence, Sized
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray

from fenwear.errors import CaseError, InputError
from fenwear.report.program import program_figure
from fenwear.report.style import (
    DIRECTIONS,
    GREY,
    contact_axis,
    direction_style,
    legend_beside,
    panels,
    reference_line,
    run_style,
    shades,
)
from fenwear.results.history import HEAT_TERMS, HISTORY

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FOLDER = "figures"


def open_history(directory: Path) -> xarray.Dataset:
    """Open history.nc of a run.

    Raises:
        CaseError: there is none, or it cannot be read.
    """
    path = directory / HISTORY
    try:
        return xarray.open_dataset(path, engine="h5netcdf")
    except (OSError, ValueError) as error:
        raise CaseError(InputError(str(path), f"no readable history of a run: {error}")) from None


def read_history(directory: Path) -> xarray.Dataset:
    """Return the history of a run, in memory.

    Raises:
        CaseError: there is none, it cannot be read, or holds no half-cycle yet.
    """
    with open_history(directory) as history:
        if not {"half_cycle", "pressure", "wear"} <= set(history.variables):
            raise CaseError(InputError(str(directory / HISTORY), "no history of a run: it has other variables"))
        if history.sizes["half_cycle"] == 0:
            raise CaseError(InputError(str(directory / HISTORY), "holds no half-cycle yet"))
        return history.load()


def chosen_half_cycles(history: xarray.Dataset, wanted: Sequence[int] = ()) -> list[int]:
    """Return the recorded half-cycles nearest to the wanted ones, or six spread over the run."""
    recorded = history.half_cycle.values
    # Most of them beyond the end: they were chosen for a longer run.
    if 2 * sum(n <= recorded[-1] for n in wanted) <= len(wanted):
        wanted = [int(n) for n in np.unique(np.geomspace(1, recorded[-1], 6).round().astype(int))]
    return nearest_half_cycles(history, wanted)


def nearest_half_cycles(history: xarray.Dataset, wanted: Sequence[int]) -> list[int]:
    """Return the recorded half-cycles nearest to the wanted ones."""
    recorded = history.half_cycle.values
    return sorted({int(recorded[np.abs(recorded - n).argmin()]) for n in wanted})


def mean_pressure(history: xarray.Dataset) -> float:
    """Return the load over the nominal contact, MPa."""
    last = history.isel(half_cycle=-1)
    return float((last.pressure * last.weight).sum() / last.weight.sum())


def nominal_width(history: xarray.Dataset) -> float:
    """Return the width of the nominal contact at the end, mm."""
    return float(history.weight.isel(half_cycle=-1, missing_dims="ignore").sum())


def directions_present(history: xarray.Dataset) -> list[int]:
    """Return the sliding directions of a run, rightward first."""
    return [d for d in DIRECTIONS if bool((history.direction == d).any())]


def cycle_means(history: xarray.Dataset, half_cycles: Sequence[int]) -> dict[int, xarray.DataArray]:
    """Return (p+ + p-)/2 of the cycles that the half-cycles belong to, by the cycle's number."""
    recorded = set(history.half_cycle.values.tolist())
    cycles = sorted({(n + 1) // 2 for n in half_cycles})
    pairs = {c: [2 * c - 1, 2 * c] for c in cycles if {2 * c - 1, 2 * c} <= recorded}
    return {c: history.pressure.sel(half_cycle=pair).mean("half_cycle") for c, pair in pairs.items()}


def pressure_top(history: xarray.Dataset, half_cycles: Sequence[int]) -> float:
    """Return the upper end of an axis of pressure: the edges of a fresh flat punch peak far beyond all that follows."""
    late = float(history.pressure.sel(half_cycle=list(half_cycles[len(half_cycles) // 2 :])).max())
    return 1.15 * max(late, float(history.pressure.median("half_cycle").max()))


def pressure_figure(history: xarray.Dataset, half_cycles: Sequence[int]) -> Figure:
    """Draw the pressure in both directions, at each chosen half-cycle and the one beside it."""
    present = directions_present(history)
    figure, axes = panels(len(present), 3.2, share_y=True)
    mean, top = mean_pressure(history), pressure_top(history, half_cycles)
    for ax, d in zip(axes, present, strict=True):
        one_way = history.isel(half_cycle=np.flatnonzero(history.direction.values == d))
        nearest = nearest_half_cycles(one_way, half_cycles)
        for colour, n in shades(nearest):
            ax.plot(history.x, one_way.pressure.sel(half_cycle=n), color=colour, label=f"{n:,}")
        arrow = "→" if d > 0 else "←"
        ax.set_title(f"Contact pressure while the strip moves {DIRECTIONS[d][0]} {arrow}", loc="left")
        ax.set_ylabel("contact pressure p (MPa)")
        ax.set_ylim(0, top)
        reference_line(ax, mean, f"mean {mean:.2f}")
        highest = float(one_way.pressure.sel(half_cycle=nearest).max())
        if highest > top:
            ax.annotate(f"cut off: the first peaks reach {highest:.0f} MPa", (0.5, 1), xycoords="axes fraction",
                        ha="center", va="top", color=GREY, fontsize="small")  # fmt: skip
        legend_beside(ax, "half-cycle")
    contact_axis(axes[-1])
    return figure


def mean_pressure_figure(history: xarray.Dataset, half_cycles: Sequence[int]) -> Figure:
    """Draw the mean of the pressures in the two directions of a cycle, with the mean over the contact."""
    figure, (ax,) = panels(1, 3.6)
    means = cycle_means(history, half_cycles)
    mean = mean_pressure(history)
    for colour, c in shades(list(means)):
        ax.plot(history.x, means[c], color=colour, label=f"{c:,}")
    late = list(means)[len(means) // 2 :]
    top = 1.15 * max([float(means[c].max()) for c in late] + [2 * mean])
    ax.set_ylim(0, top)
    reference_line(ax, mean, f"mean {mean:.2f}")
    ax.set_title("Mean of the pressures in the two directions of a cycle", loc="left")
    ax.set_ylabel("(p⁺ + p⁻) / 2 (MPa)")
    legend_beside(ax, "cycle")
    contact_axis(ax)
    return figure


def shape_figure(history: xarray.Dataset, half_cycles: Sequence[int]) -> Figure:
    """Draw what is worn off the punch, and off the strip where it wears, at the chosen half-cycles."""
    strip_wears = "wear_strip" in history
    figure, axes = panels(1 + strip_wears, 3.6)
    surfaces = [("Worn shape: the punch's surface above its start, w = 0", history.x, history.wear)]
    if strip_wears:
        title = "Worn shape: the strip's surface below its start, on its material"
        surfaces.append((title, history.x_strip, history.wear_strip))
    for ax, (title, x, depth) in zip(axes, surfaces, strict=True):
        for colour, n in shades(half_cycles):
            ax.plot(x, 1e3 * depth.sel(half_cycle=n), color=colour, label=f"{n:,}")
        ax.set_title(title, loc="left")
        legend_beside(ax, "after half-cycle")
    axes[0].set_ylabel("worn depth w (µm)")
    axes[0].set_ylim(bottom=0)
    if strip_wears:
        axes[1].set_ylabel("worn depth, downwards (µm)")
        axes[1].set_ylim(top=0, bottom=1.05e3 * max(float(history.wear_strip.max()), 1e-12))
        left, right = _worn_range(history)
        axes[1].set_xlim(left, right)
    contact_axis(axes[-1])
    return figure


def _worn_range(history: xarray.Dataset) -> tuple[float, float]:
    """Return the ends of the punch's contact and of the strip's scar, mm."""
    worn = history.x_strip.values[history.wear_strip.values.max(axis=0) > 0]
    x = np.concatenate([worn, history.x.values])
    return float(x.min()), float(x.max())


def peak_figure(history: xarray.Dataset) -> Figure:
    """Draw over the half-cycles: largest pressure, width in contact and, with heat, largest temperature."""
    hot = "max_temperature" in history
    figure, axes = panels(3 if hot else 2, 2.5)
    over = {
        "max_pressure": ("Largest contact pressure", "pressure (MPa)"),
        "contact_width": ("Width in contact", "width (mm)"),
        "max_temperature": ("Largest temperature of the contact surfaces, at the end of each half-cycle",
                            "temperature (K)"),
    }  # fmt: skip
    for ax, (name, (title, label)) in zip(axes, over.items(), strict=False):
        by_direction(ax, history, name)
        ax.set_title(title, loc="left")
        ax.set_ylabel(label)
    mean = mean_pressure(history)
    reference_line(axes[0], mean, f"mean {mean:.2f}")
    reference_line(axes[0], 2 * mean, f"twice the mean {2 * mean:.2f}")
    nominal = nominal_width(history)
    reference_line(axes[1], nominal, f"nominal width {nominal:g}")
    for ax in axes[:2]:
        ax.set_ylim(bottom=0)
    axes[1].set_ylim(top=1.15 * nominal)
    axes[0].legend(title="strip moves", frameon=False)
    half_cycle_axis(axes[-1], history)
    return figure


def convergence_figure(history: xarray.Dataset) -> Figure:
    """Draw over the half-cycles: the change against one cycle ago and the distance to the optimal pressure."""
    figure, axes = panels(2, 2.7)
    over = {
        "periodicity": "Periodicity: largest change of pressure against one cycle ago",
        "optimum_distance": "Distance to the optimum: largest difference to the optimal pressure",
    }
    for ax, (name, title) in zip(axes, over.items(), strict=True):
        by_direction(ax, history, name)
        ax.set_title(title, loc="left")
        ax.set_ylabel("over mean pressure (-)")
    axes[0].set_yscale("log")
    axes[1].set_ylim(bottom=0)
    axes[0].legend(title="strip moves", frameon=False)
    half_cycle_axis(axes[-1], history)
    return figure


def temperature_figure(history: xarray.Dataset, half_cycles: Sequence[int]) -> Figure:
    """Draw the temperature along both contact surfaces at the chosen half-cycles."""
    figure, axes = panels(2, 3.0)
    for ax, body in zip(axes, ("punch", "strip"), strict=True):
        for colour, n in shades(half_cycles):
            ax.plot(history.x, history[f"temperature_{body}"].sel(half_cycle=n), color=colour, label=f"{n:,}")
        ax.set_title(f"Temperature of the {body}'s contact surface", loc="left")
        ax.set_ylabel("temperature (K)")
        legend_beside(ax, "after half-cycle")
    contact_axis(axes[-1])
    return figure


def heat_balance_figure(history: xarray.Dataset) -> Figure:
    """Draw where the friction heat of each half-cycle goes."""
    figure, (ax,) = panels(1, 3.8)
    friction = history.heat_friction
    ax.plot(history.half_cycle, friction, color="0", linewidth=2.5, label="made by friction")
    names = {
        "convected": "lost to the surroundings",
        "held": "lost where temperature is held",
        "stored": "gained by both bodies",
        "debris": "carried off by debris",
        "carried": "carried out by the strip",
    }
    assert names.keys() == HEAT_TERMS.keys() - {"friction"}
    threshold = 1e-6 * float(np.abs(friction).max())
    for number, (name, text) in enumerate(names.items()):
        values = history[f"heat_{name}"]
        if float(np.abs(values).max()) > threshold:
            ax.plot(history.half_cycle, values, label=text, **run_style(number))
        else:
            ax.plot([], [], " ", label=f"{text}: none")
    ax.set_title("Heat of each half-cycle: what friction makes is the sum of the others", loc="left")
    ax.set_ylabel("heat per half-cycle (mJ)")
    legend_beside(ax, "")
    half_cycle_axis(ax, history)
    return figure


def all_figures(history: xarray.Dataset, wanted: Sequence[int] = ()) -> dict[str, Figure]:
    """Draw every figure that the history has data for, by its name."""
    chosen = chosen_half_cycles(history, wanted)
    drawn = {"shape": shape_figure(history, chosen), "pressure": pressure_figure(history, chosen)}
    if cycle_means(history, chosen) and len(directions_present(history)) == 2:
        drawn["mean_pressure"] = mean_pressure_figure(history, chosen)
    drawn["peaks"] = peak_figure(history)
    if "load_factor" in history:
        drawn["program"] = program_figure(history)
    drawn["convergence"] = convergence_figure(history)
    if "max_temperature" in history:
        drawn["temperature"] = temperature_figure(history, chosen)
        drawn["heat_balance"] = heat_balance_figure(history)
    return drawn


def mark_few(points: Sized) -> dict[str, Any]:
    """Return the style of a line of so few points that without marks nothing may be seen."""
    return {"marker": "o", "markersize": 3} if len(points) < 3 else {}


def by_direction(ax: Axes, history: xarray.Dataset, name: str) -> None:
    """Draw a variable over the half-cycles, a line for each direction."""
    for d in directions_present(history):
        text, dashes, colour = direction_style(history, d)
        rows = history.direction.values == d
        ax.plot(
            history.half_cycle[rows],
            history[name][rows],
            dashes,
            color=colour,
            label=text,
            **mark_few(rows.nonzero()[0]),
        )


def half_cycle_axis(ax: Axes, history: xarray.Dataset) -> None:
    """Label the axis of half-cycles: logarithmic where wear alone slows down, linear with heat's own pace."""
    first, last = int(history.half_cycle[0]), int(history.half_cycle[-1])
    if last > 10_000 or "max_temperature" not in history:
        ax.set_xscale("log")
    if last > first:
        ax.set_xlim(first, last)
    ax.set_xlabel("half-cycle n")
