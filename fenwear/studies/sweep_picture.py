"""The picture of a sweep: its key numbers over one or two of its keys.

Of contact with stick over two keys, such as amplitude and load, it is a map of fretting.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import xarray
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from fenwear.report.style import BLUE, GREY, RED, legend_beside, panels, run_style, shades
from fenwear.results.disk import replacing
from fenwear.results.time_steps import REGIMES

PICTURE = "sweep.png"
FRETTING = ("regime", "stick_share", "energy_ratio", "largest_depth", "largest_depth_strip")
SHOWN = (
    "largest_pressure",
    "contact_width",
    "contact_area",
    "lambda_F",
    "largest_depth",
    "largest_depth_strip",
    "largest_temperature",
)
LINES = 7  # that can be told apart; more become a map
FACTORS = {"mm": (1e3, "µm"), "mm/cycle": (1e3, "µm/cycle")}
FLAT = 1e-6  # of the largest value: what differs by less is the same
MICROMETRES = ("lambda_F", "largest_depth", "largest_depth_strip")


def sweep_figure(dataset: xarray.Dataset) -> Figure:
    """Return a panel for each key number over the key with most values: a line for each value of a second key.

    Where the second one has many values, too, a panel is a map of both. Further keys stay at their first value.
    """
    first, second, fixed = _chosen(dataset)
    at_first = dataset.isel(dict.fromkeys(fixed, 0))
    of_fretting = bool(second) and "regime" in at_first
    shown = [
        name
        for name in (FRETTING if of_fretting else SHOWN)
        if name in at_first and np.isfinite(at_first[name].values).any()
    ]
    count = len(shown)
    figure, axes = panels(count, 2.6, share_x=False)
    for ax, name in zip(axes, shown, strict=True):
        values = _cycle_largest(at_first[name])
        factor, unit = FACTORS.get(values.attrs["units"], (1.0, "")) if name in MICROMETRES else (1.0, "")
        unit = unit or values.attrs["units"]
        name_of = values.attrs["long_name"].partition(":")[0]
        ax.set_title(name_of[:1].upper() + name_of[1:], loc="left")
        label = f"{values.attrs['long_name'].split(' of ')[0]} ({unit})" if unit else values.attrs["long_name"]
        if second and (at_first.sizes[second] > LINES or of_fretting):
            _map(figure, ax, factor * values, first, second, label if unit else "")
        else:
            _lines(ax, factor * values, first, second)
            ax.set_ylabel(label)
    if fixed:
        names = ", ".join(f"{key} = {_label(dataset, key, 0)}" for key in fixed)
        figure.suptitle(f"at {names}", fontsize="medium")
    return figure


def draw(dataset: xarray.Dataset, folder: Path) -> None:
    """Write the picture, where there is anything to draw.

    Raises:
        OutputError: it cannot be written.
    """
    if not any(name in dataset for name in SHOWN):
        return
    with replacing(folder / PICTURE, shared=True) as part:
        sweep_figure(dataset).savefig(part, dpi=150, format="png")


def _chosen(dataset: xarray.Dataset) -> tuple[str, str, list[str]]:
    """Return the keys along the axis, of the lines ("" for one line), and those that stay at their first value."""
    swept = [str(name) for name in dataset["trouble"].dims]
    numeric = [key for key in swept if key not in dataset.coords or dataset[key].dtype.kind in "if"]
    ordered = sorted(swept, key=lambda key: (key not in numeric, -dataset.sizes[key]))
    several = [key for key in ordered if dataset.sizes[key] > 1] or ordered
    first, second = several[0], several[1] if len(several) > 1 else ""
    return first, second, [key for key in swept if key not in (first, second)]


def _cycle_largest(values: xarray.DataArray) -> xarray.DataArray:
    if "half_cycle" not in values.dims:
        return values
    return values.max("half_cycle", skipna=True, keep_attrs=True)


def _places(values: xarray.DataArray, key: str) -> tuple[np.ndarray[Any, Any], list[str]]:
    """Return where the values of a key stand on an axis, and the names of those that are no numbers."""
    column = values[key].values if key in values.coords else np.arange(1, values.sizes[key] + 1)
    if column.dtype.kind in "if":
        return column, []
    return np.arange(len(column)), [str(name) for name in column]


def _axis_label(values: xarray.DataArray, key: str) -> str:
    unit = values[key].attrs.get("units", "") if key in values.coords else ""
    return f"{key} ({unit})" if unit else key


def _label(values: xarray.Dataset | xarray.DataArray, key: str, at: int) -> str:
    if key not in values.coords:
        return str(at + 1)
    value = values[key].values[at]
    unit = values[key].attrs.get("units", "")
    return f"{value:.4g} {unit}".strip() if values[key].dtype.kind in "if" else str(value)


Line = tuple[str | None, xarray.DataArray, dict[str, Any]]


def _rows(values: xarray.DataArray, second: str) -> Iterator[Line]:
    """Yield name, values and style of each line."""
    if not second:
        yield None, values, {**run_style(0)}
        return
    numeric = second not in values.coords or values[second].dtype.kind in "if"
    colours = shades(range(values.sizes[second]))
    for k in range(values.sizes[second]):
        style = run_style(k)
        if numeric:
            style["color"] = colours[k][0]
        yield _label(values, second, k), values.isel({second: k}), style


def _lines(ax: Axes, values: xarray.DataArray, first: str, second: str) -> None:
    places, names = _places(values, first)
    for label, row, style in _rows(values, second):
        ax.plot(places, row.values, marker="o", markersize=3, label=label, **style)
    if names:
        ax.set_xticks(places, names)
    ax.set_xlabel(_axis_label(values, first))
    if _even_ratios(places):
        ax.set_xscale("log")
    if np.nanmax(values.values) - np.nanmin(values.values) < FLAT * np.nanmax(np.abs(values.values)):
        ax.set_ylim(0.0, 1.2 * float(np.nanmax(values.values)) or 1.0)  # not the rounding of what stays the same
    if second:
        name = _axis_label(values, second)
        legend_beside(ax, name if len(name) < 20 else name.rpartition(".")[2])


def _map(figure: Figure, ax: Axes, values: xarray.DataArray, first: str, second: str, label: str) -> None:
    (x, x_names), (y, y_names) = (_places(values, key) for key in (first, second))
    colours: dict[str, Any] = {"cmap": "viridis"}
    if values.name == "regime":  # a map of fretting
        colours = {"cmap": ListedColormap([BLUE, GREY, RED]), "vmin": -0.5, "vmax": len(REGIMES) - 0.5}
    mesh = ax.pcolormesh(x, y, values.transpose(second, first).values, shading="nearest", **colours)
    bar = figure.colorbar(mesh, ax=ax, label=label)
    if values.name == "regime":
        bar.set_ticks(range(len(REGIMES)), labels=REGIMES)
    if x_names:
        ax.set_xticks(x, x_names)
    if y_names:
        ax.set_yticks(y, y_names)
    for places, scale in ((x, ax.set_xscale), (y, ax.set_yscale)):
        if _even_ratios(places):
            scale("log")
    ax.set_xlabel(_axis_label(values, first))
    ax.set_ylabel(_axis_label(values, second))


def _even_ratios(places: np.ndarray[Any, Any]) -> bool:
    """Return whether values follow each other by one ratio, not by one difference."""
    if len(places) < 3 or not (places > 0).all() or places.dtype.kind != "f":
        return False
    ratios = places[1:] / places[:-1]
    return bool(np.ptp(ratios) < 1e-6 * ratios.max() and abs(ratios[0] - 1) > 1e-6)
