"""Figures of a run, drawn from its folder alone."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray

from fenwear.arrays import Array
from fenwear.errors import CaseError, InputError
from fenwear.report.course import (
    convergence_figure,
    cycle_ends,
    directions_present,
    friction_figure,
    heat_balance_figure,
    is_conforming,
    late_pressures,
    mean_pressure,
    peak_figure,
    place_figure,
    scar_figure,
    shown_unit,
    volume_figure,
)
from fenwear.report.program import program_figure
from fenwear.report.shapes import profile_figure, surfaces_of, wear_map_figure, worn_range
from fenwear.report.style import STANDARD, Look, contact_axis, legend_beside, level_line, panels, shades
from fenwear.results.history import HISTORY
from fenwear.results.reading import load_history

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FOLDER, CAPTIONS = "figures", "captions.txt"
EARLY = 3.0  # times the largest pressure of later states: what is beyond it has a panel of its own
DPI = 200


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


def chosen_half_cycles(history: xarray.Dataset, wanted: Sequence[int] = ()) -> list[int]:
    """Return the recorded half-cycles nearest to the wanted ones, or six spread over the run."""
    recorded = history.half_cycle.values
    # Most of them beyond the end: they were chosen for a longer run.
    if 2 * sum(n <= recorded[-1] for n in wanted) <= len(wanted):
        wanted = [int(n) for n in np.unique(np.geomspace(1, recorded[-1], 6).round().astype(int))]
    return nearest_half_cycles(history, [*wanted, int(recorded[-1])])


def nearest_half_cycles(history: xarray.Dataset, wanted: Sequence[int]) -> list[int]:
    """Return the recorded half-cycles nearest to the wanted ones."""
    recorded = history.half_cycle.values
    return sorted({int(recorded[np.abs(recorded - n).argmin()]) for n in wanted})


def cycle_means(history: xarray.Dataset, half_cycles: Sequence[int]) -> dict[int, Array]:
    """Return mean pressures up to the ends of the cycles that the half-cycles belong to, by their last half-cycle."""
    if "pressure_sum" not in history:
        return {}
    ends = cycle_ends(history)
    own = np.searchsorted(ends, half_cycles)
    wanted = [int(n) for n in np.unique(ends[own[own < len(ends)]])]
    return dict(zip(wanted, late_pressures(history, wanted), strict=True)) if wanted else {}


def pressure_top(history: xarray.Dataset, half_cycles: Sequence[int]) -> float:
    """Return the upper end of an axis of pressure: the edges of a fresh flat punch peak far beyond all that follows."""
    late = float(history.pressure.sel(half_cycle=list(half_cycles[len(half_cycles) // 2 :])).max())
    return 1.15 * max(late, float(history.pressure.median("half_cycle").max()))


def early_half_cycles(history: xarray.Dataset, half_cycles: Sequence[int]) -> list[int]:
    """Return the first half-cycles whose pressures lie far beyond all later ones, as edges of flat punches do."""
    peaks = {n: float(history.pressure.sel(half_cycle=n).max()) for n in half_cycles}
    last = max(list(peaks.values())[len(peaks) // 2 :])
    early = []
    for n in half_cycles[:-1]:
        if peaks[n] <= EARLY * last:
            break
        early.append(n)
    return early


def pressure_figure(history: xarray.Dataset, half_cycles: Sequence[int], look: Look = STANDARD) -> Figure:
    """Draw the pressure in both directions, at each chosen half-cycle and the one beside it.

    What lies far beyond all later pressures has a panel of its own, so that nothing is cut off.
    """
    present = directions_present(history)
    rows = {d: history.isel(half_cycle=np.flatnonzero(history.direction.values == d)) for d in present}
    chosen = {d: nearest_half_cycles(own, half_cycles) for d, own in rows.items()}
    early = {d: early_half_cycles(own, chosen[d]) for d, own in rows.items()}
    has_early = any(early.values())
    figure, axes = panels(len(present) + has_early, 3.0, look=look)
    conforming = is_conforming(history)
    for ax, d in zip(axes, present, strict=False):
        for colour, n in shades(chosen[d]):
            drawn = axes[-1] if n in early[d] else ax
            ax_line = {"color": colour, "label": look.name(history, n), "gid": str(n)}
            drawn.plot(history.x, rows[d].pressure.sel(half_cycle=n), linestyle="-" if d > 0 else "--", **ax_line)
        if conforming:
            mean = mean_pressure(history)
            level_line(ax, mean, f"mean {mean:.4g} MPa")
    for ax in axes:
        ax.set_ylabel("contact pressure p (MPa)")
        ax.set_ylim(bottom=0)
        legend_beside(ax, look.of_one)
    contact_axis(axes[-1])
    return figure


def mean_pressure_figure(history: xarray.Dataset, half_cycles: Sequence[int], look: Look = STANDARD) -> Figure:
    """Draw mean pressures of all directions up to some cycles: what is well posed where a contact's edge moves."""
    means = cycle_means(history, half_cycles)
    peaks = {n: float(mean.max()) for n, mean in means.items()}
    late = max(list(peaks.values())[len(peaks) // 2 :])
    early = [n for n in means if peaks[n] > EARLY * late]
    figure, axes = panels(2 if early else 1, 3.0, look=look)
    for colour, n in shades(list(means)):
        ax = axes[-1] if n in early else axes[0]
        ax.plot(history.x, means[n], color=colour, label=look.name(history, n), gid=str(n))
    if is_conforming(history):
        mean = mean_pressure(history)
        level_line(axes[0], mean, f"mean {mean:.4g} MPa")
    for ax in axes:
        ax.set_ylabel("mean pressure (MPa)")
        ax.set_ylim(bottom=0)
        legend_beside(ax, look.of_one)
    contact_axis(axes[-1])
    return figure


def shape_figure(history: xarray.Dataset, half_cycles: Sequence[int], look: Look = STANDARD) -> Figure:
    """Draw what is worn off the bodies at the chosen half-cycles; the strip's depth downwards."""
    surfaces = surfaces_of(history)
    figure, axes = panels(len(surfaces), 3.0, look=look)
    for ax, (body, (x, depth, _)) in zip(axes, surfaces.items(), strict=True):
        for colour, n in shades(half_cycles):
            values = 1e3 * depth.sel(half_cycle=n).values
            ax.plot(x, values, color=colour, label=look.name(history, n), gid=str(n))
        ax.set_ylabel(f"worn depth of the {body} (µm)")
        top = 1.05e3 * max(float(depth.max()), 1e-12)
        ax.set_ylim((0, top) if body == "punch" else (top, 0))
        legend_beside(ax, look.of_one)
    axes[-1].set_xlim(*worn_range(history))
    contact_axis(axes[-1])
    return figure


def temperature_figure(history: xarray.Dataset, half_cycles: Sequence[int], look: Look = STANDARD) -> Figure:
    """Draw the temperature along both contact surfaces at the chosen half-cycles."""
    figure, axes = panels(2, 3.0, look=look)
    for ax, body in zip(axes, ("punch", "strip"), strict=True):
        values = history[f"temperature_{body}"]
        for colour, n in shades(half_cycles):
            ax.plot(history.x, values.sel(half_cycle=n), color=colour, label=look.name(history, n), gid=str(n))
        ax.set_ylabel(f"temperature of the {body} ({shown_unit(values.attrs.get('units', 'K'))})")
        legend_beside(ax, look.of_one)
    contact_axis(axes[-1])
    return figure


def all_figures(history: xarray.Dataset, wanted: Sequence[int] = (), look: Look = STANDARD) -> dict[str, Figure]:
    """Draw every figure that the history has data for, by its name."""
    chosen = chosen_half_cycles(history, wanted)
    drawn = {
        "profiles": profile_figure(history, chosen, look),
        "shape": shape_figure(history, chosen, look),
        "wear_map": wear_map_figure(history, look),
        "pressure": pressure_figure(history, chosen, look),
    }
    if cycle_means(history, chosen):
        drawn["mean_pressure"] = mean_pressure_figure(history, chosen, look)
    drawn["peaks"] = peak_figure(history, look)
    if "eccentricity" in history:
        drawn["place"] = place_figure(history, look)
    if "sliding_distance" in history:
        drawn["volume"] = volume_figure(history, Look(look.width, "distance"))
        drawn["scar"] = scar_figure(history, look)
        drawn["friction"] = friction_figure(history, look)
    if "load_factor" in history:
        drawn["program"] = program_figure(history, look)
    drawn["convergence"] = convergence_figure(history, look)
    if "max_temperature" in history:
        drawn["temperature"] = temperature_figure(history, chosen, look)
        drawn["heat_balance"] = heat_balance_figure(history, look)
    return drawn
