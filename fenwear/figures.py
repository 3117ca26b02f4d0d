"""Pictures of a run, drawn from its folder alone."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray

from fenwear.errors import CaseError, Problem
from fenwear.results import HISTORY

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DIRECTIONS = {1: ("rightward", "-"), -1: ("leftward", "--")}
WIDTH = 7.0  # inches


def open_history(directory: Path) -> xarray.Dataset:
    """Open history.nc of a run.

    Raises:
        CaseError: there is none, or it cannot be read.
    """
    path = directory / HISTORY
    try:
        return xarray.open_dataset(path, engine="h5netcdf")
    except (OSError, ValueError) as error:
        raise CaseError(Problem(str(path), f"no readable history of a run: {error}")) from None


def chosen_half_cycles(history: xarray.Dataset, wanted: tuple[int, ...] = ()) -> list[int]:
    """Return the recorded half-cycles nearest to the wanted ones, or six spread over the run."""
    recorded = history.half_cycle.values
    if not wanted:
        spread = np.unique(np.geomspace(1, recorded[-1], 6).round().astype(int))
        wanted = tuple(int(n) for n in spread)
    return sorted({int(recorded[np.abs(recorded - n).argmin()]) for n in wanted})


def pressure_figure(history: xarray.Dataset, half_cycles: list[int]) -> Figure:
    """Draw the pressure in both directions, at each chosen half-cycle and the one beside it."""
    present = [d for d in (1, -1) if (history.direction == d).any()]
    figure, axes = _panels(len(present), 3.2)
    for ax, d in zip(axes, present, strict=True):
        one_way = history.isel(half_cycle=np.flatnonzero(history.direction.values == d))
        recorded = one_way.half_cycle.values
        nearest = sorted({int(recorded[np.abs(recorded - n).argmin()]) for n in half_cycles})
        for colour, n in _coloured(nearest):
            ax.plot(history.x, one_way.pressure.sel(half_cycle=n), color=colour, label=f"{n:,}")
        ax.set_title(f"strip moves {DIRECTIONS[d][0]}", loc="left")
        ax.set_ylabel("contact pressure p (MPa)")
        ax.legend(title="half-cycle", loc="center left", bbox_to_anchor=(1.0, 0.5))
    # The edges of a fresh flat punch peak beyond all that follows.
    top = float(history.pressure.sel(half_cycle=half_cycles[len(half_cycles) // 2 :]).max())
    first = float(history.pressure.median("half_cycle").max())
    axes[0].set_ylim(0, 1.15 * max(top, first))
    _contact_axis(axes[-1])
    return figure


def shape_figure(history: xarray.Dataset, half_cycles: list[int]) -> Figure:
    """Draw the worn punch: the depth worn off, downwards, at the chosen half-cycles."""
    figure, (ax,) = _panels(1, 3.6)
    for colour, n in _coloured(half_cycles):
        ax.plot(history.x, 1e3 * history.wear.sel(half_cycle=n), color=colour, label=f"{n:,}")
    ax.set_title("the punch's lower surface, worn upwards from w = 0", loc="left")
    ax.set_ylabel("worn depth w (µm)")
    ax.set_ylim(bottom=0)
    ax.legend(title="after half-cycle", loc="center left", bbox_to_anchor=(1.0, 0.5))
    _contact_axis(ax)
    return figure


def peak_figure(history: xarray.Dataset) -> Figure:
    """Draw the largest pressure over the half-cycles, with the mean and twice the mean."""
    figure, (ax,) = _panels(1, 3.6)
    for (d, (name, style)), colour in zip(DIRECTIONS.items(), ("#0072B2", "#D55E00"), strict=True):
        rows = history.direction.values == d
        if rows.any():
            ax.plot(history.half_cycle[rows], history.max_pressure[rows], style, color=colour, label=name)
    mean = float((history.pressure.isel(half_cycle=-1) * history.weight).sum() / history.weight.sum())
    for factor, name in ((1, "mean pressure"), (2, "twice the mean")):
        ax.axhline(factor * mean, color="0.5", linewidth=0.8, linestyle=":")
        ax.annotate(f"{name}, {factor * mean:.2f} MPa", (0, factor * mean), xycoords=("axes fraction", "data"),
                    xytext=(4, 3), textcoords="offset points", color="0.35", fontsize="small")  # fmt: skip
    ax.set_xscale("log")
    ax.set_ylim(bottom=0)
    ax.set_xlabel("half-cycle n")
    ax.set_ylabel("largest contact pressure (MPa)")
    ax.legend(title="strip moves")
    return figure


def temperature_figure(history: xarray.Dataset, half_cycles: list[int]) -> Figure:
    """Draw the temperature along the contact at the chosen half-cycles, and its largest value over all."""
    figure, (along, over) = _panels(2, 3.2, share=False)
    for colour, n in _coloured(half_cycles):
        along.plot(history.x, history.temperature_punch.sel(half_cycle=n), color=colour, label=f"{n:,}")
        along.plot(history.x, history.temperature_strip.sel(half_cycle=n), "--", color=colour)
    along.set_title("contact surfaces: punch solid, strip dashed", loc="left")
    along.set_ylabel("temperature (K)")
    along.legend(title="after half-cycle", loc="center left", bbox_to_anchor=(1.0, 0.5))
    _contact_axis(along)
    over.plot(history.half_cycle, history.max_temperature, color="#D55E00")
    over.set_xlabel("half-cycle n")
    over.set_ylabel("largest temperature (K)")
    return figure


def draw_figures(directory: Path, half_cycles: tuple[int, ...] = ()) -> list[Path]:
    """Draw all figures of a run into its folder `figures`; return their paths."""
    folder = directory / "figures"
    folder.mkdir(exist_ok=True)
    with open_history(directory) as history:
        chosen = chosen_half_cycles(history, half_cycles)
        drawn = {
            "pressure": pressure_figure(history, chosen),
            "shape": shape_figure(history, chosen),
            "peak_pressure": peak_figure(history),
        }
        if "max_temperature" in history:
            drawn["temperature"] = temperature_figure(history, chosen)
    paths = []
    for name, figure in drawn.items():
        paths.append(folder / f"{name}.png")
        figure.savefig(paths[-1], dpi=150)
    return paths


def _panels(count: int, height: float, *, share: bool = True) -> tuple[Figure, list[Axes]]:
    """Return a figure of panels below each other, each as high as given, inches."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context({"axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False}):
        figure = Figure(figsize=(WIDTH, height * count), layout="constrained")
        return figure, list(figure.subplots(count, 1, sharex=share, sharey=share, squeeze=False)[:, 0])


def _coloured(half_cycles: list[int]) -> list[tuple[Any, int]]:
    """Return a colour for each half-cycle, dark to light: readable in print and to the colour-blind."""
    from matplotlib import colormaps

    shades = np.linspace(0.0, 0.85, max(len(half_cycles), 2))
    return [(colormaps["viridis"](shade), n) for shade, n in zip(shades, half_cycles, strict=False)]


def _contact_axis(ax: Axes) -> None:
    ax.set_xlabel("position along the contact x (mm)")
    ax.margins(x=0.01)
