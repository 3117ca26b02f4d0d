"""Figures over a run: peaks, convergence, worn volume and rate, scars, forces, heat."""

from __future__ import annotations

from collections.abc import Sequence, Sized
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.heat.exchange import TERMS
from fenwear.report.style import (
    BLUE,
    BODY_COLOURS,
    DIRECTIONS,
    RED,
    STANDARD,
    Style,
    by_powers,
    direction_style,
    from_zero,
    legend_beside,
    level_line,
    panels,
    run_style,
    strip_moves,
)
from fenwear.results.sheet import BODIES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LAST = 0.1  # of what is done, that a mean pressure is of
BEYOND = 0.05  # of an axis: what is left free beyond its lines
MANY = 100.0  # last over first of a logarithmic axis, at least
SHORT = 0.01  # of cycles, m or s: an end whose labels are long, so that few of them go beside each other


def peak_figure(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw largest pressure, width or area in contact and, with heat, largest temperature."""
    over = {
        "largest_pressure": "largest pressure (MPa)",
        "contact_width": "width in contact (mm)",
        "contact_area": "area in contact (mm²)",
        "largest_temperature": f"largest temperature ({temperature_unit(history)})",
    }
    over = {name: label for name, label in over.items() if name in history}
    if "contact_width" in over:
        over.pop("contact_area", None)  # the same, times the thickness
    figure, axes = panels(len(over), 2.5, look=look)
    for ax, (name, label) in zip(axes, over.items(), strict=True):
        by_direction(ax, history, name, look)
        ax.set_ylabel(label)
    if "pressure_sum" in history and len(ends := cycle_ends(history)):
        x = look.course(history)[np.searchsorted(history.half_cycle.values, ends)]
        late = late_pressures(history, ends).max(axis=1)
        axes[0].plot(x, late, color="0.5", linestyle="-.", linewidth=1.0, label="of the mean over the last tenth")
    if is_conforming(history):
        mean = mean_pressure(history)
        level_line(axes[0], mean, f"mean {mean:.4g}")
        level_line(axes[1], nominal_width(history), f"nominal {nominal_width(history):.4g}")
    for ax in axes[:2]:
        from_zero(ax)
    for ax in axes:
        legend_beside(ax, strip_moves(history))
    run_axis(axes[-1], history, look)
    return figure


def convergence_figure(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw the change against one cycle ago and the distance to the optimal pressure."""
    over = {
        "periodicity": "change in a cycle, largest of a node (-)",
        "optimum_distance": "load elsewhere than in the optimum (-)",
    }
    over = {name: label for name, label in over.items() if name == "periodicity" or history[name].notnull().any()}
    figure, axes = panels(len(over), 2.7, look=look)
    for ax, (name, label) in zip(axes, over.items(), strict=True):
        by_direction(ax, history, name, look)
        ax.set_ylabel(label)
        legend_beside(ax, strip_moves(history))
    by_powers(axes[0], "y")
    for ax in axes[1:]:
        from_zero(ax)
    run_axis(axes[-1], history, look)
    return figure


def volume_figure(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw the worn volume and the specific wear rate of the bodies that wear."""
    figure, axes = panels(2, 2.7, look=look)
    x = look.course(history)
    for body, end in BODIES.items():
        if f"worn_volume{end}" not in history:
            continue
        colour = BODY_COLOURS[body]
        axes[0].plot(x, history[f"worn_volume{end}"], color=colour, label=body, **mark_few(x))
        axes[1].plot(x, history[f"wear_rate{end}"], color=colour, label=f"{body}, current", **mark_few(x))
        axes[1].plot(x, history[f"mean_wear_rate{end}"], color=colour, linestyle="--", label=f"{body}, mean")
    axes[0].set_ylabel("worn volume (mm³)")
    axes[1].set_ylabel("specific wear rate (mm³/(N m))")
    for ax in axes:
        from_zero(ax)
        legend_beside(ax, "")
    run_axis(axes[-1], history, look, logarithmic=False)
    return figure


def creep_figure(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw what is worn and what has crept, of each body and of a layer: largest depth and volume."""
    figure, axes = panels(2, 2.7, look=look)
    x = look.course(history)
    for body, end in {**BODIES, "layer": "_layer"}.items():
        colour = BODY_COLOURS.get(body, "0.4")
        for text, dashes, depth, volume in (
            ("worn off", "-", f"largest_depth{end}", f"worn_volume{end}"),
            ("crept", "--", f"creep_depth{end}", f"creep_volume{end}"),
        ):
            if depth not in history:
                continue
            deepest = history[depth].max([d for d in history[depth].dims if d != "half_cycle"])
            style: dict[str, Any] = {"color": colour, "linestyle": dashes, "label": f"{body}, {text}", **mark_few(x)}
            axes[0].plot(x, 1e3 * deepest, **style)
            axes[1].plot(x, history[volume], **style)
    axes[0].set_ylabel("largest depth (µm)")
    axes[1].set_ylabel("volume (mm³)")
    for ax in axes:
        from_zero(ax)
        legend_beside(ax, "")
    run_axis(axes[-1], history, look, logarithmic=False)
    return figure


def scar_figure(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw the largest worn depths and the sizes of the scars, unless they are worn all the way round."""
    sizes = [n for n in ("scar_length", "scar_width") if any(f"{n}{end}" in history for end in BODIES.values())]
    figure, axes = panels(1 + len(sizes), 2.5, look=look)
    x = look.course(history)
    for body, end in BODIES.items():
        if f"largest_depth{end}" not in history:
            continue
        colour = BODY_COLOURS[body]
        axes[0].plot(x, 1e3 * history[f"largest_depth{end}"], color=colour, label=body, **mark_few(x))
        for ax, name in zip(axes[1:], sizes, strict=True):
            for share, dashes in (("", "-"), ("_5", "--")):
                if f"{name}{share}{end}" in history:
                    of = f"{body}, at {5 if share else 1} %"
                    ax.plot(x, history[f"{name}{share}{end}"], dashes, color=colour, label=of, **mark_few(x))
    axes[0].set_ylabel("largest worn depth (µm)")
    for ax, name in zip(axes[1:], sizes, strict=True):
        ax.set_ylabel(f"{name.replace('_', ' ')} (mm)")
    for ax in axes:
        from_zero(ax)
        legend_beside(ax, "")
    run_axis(axes[-1], history, look)
    return figure


def place_figure(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw a shaft's place in its bores over a run: the path of its middle, eccentricity and attitude angle."""
    figure, axes = panels(3, 2.7, share_x=False, look=look)
    x, bores = look.course(history), bores_of(history)
    axes[0].plot(0, 0, "+", color="0", label="middle of the bore")
    for number, (name, end) in enumerate(bores.items()):
        style = run_style(number) if name else {"color": "0"}
        words = f", {name}" if name else ""
        e_x, e_z = (1e3 * history[f"eccentricity_{axis}{end}"].values for axis in "xz")
        axes[0].plot(e_x, e_z, **style, **mark_few(x))
        axes[0].plot(e_x[:1], e_z[:1], "o", color=style["color"] if name else BLUE, markersize=4,
                     label=f"shaft, at first{words}")  # fmt: skip
        axes[0].plot(e_x[-1:], e_z[-1:], "s", color=style["color"] if name else RED, markersize=4,
                     label=f"shaft, at the end{words}")  # fmt: skip
        label = name or "_"  # no entry of a legend
        axes[1].plot(x, 1e3 * history[f"eccentricity{end}"], label=label, **style, **mark_few(x))
        axes[2].plot(x, history[f"attitude_angle{end}"], label=label, **style, **mark_few(x))
    axes[0].set_aspect("equal", adjustable="datalim")
    axes[0].margins(0.15)
    axes[0].set_xlabel("x (µm)")
    axes[0].set_ylabel("z (µm)")
    axes[1].set_ylabel("eccentricity (µm)")
    from_zero(axes[1])
    axes[2].set_ylabel("attitude angle (degrees)")
    low, high = axes[2].get_ylim()
    low, high = min(low, -1.0), max(high, 1.0)
    axes[2].set_ylim(low - BEYOND * (high - low), high + BEYOND * (high - low))
    for ax in axes if len(bores) > 1 else axes[:1]:
        legend_beside(ax, "")
    for ax in axes[1:]:
        run_axis(ax, history, look)
    return figure


def bores_of(history: xarray.Dataset) -> dict[str, str]:
    """Return how the names of variables of a shaft's place end, by the name of the bore; "" of the only one."""
    start = "attitude_angle"
    return {name[len(start) + 1 :]: name[len(start) :] for name in map(str, history) if name.startswith(start)}


def friction_figure(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw normal and friction force and the work of friction."""
    figure, axes = panels(2, 2.4, look=look)
    x, strokes = look.course(history), round(float(history.half_cycle[-1] / history.cycles[-1]))
    for number, (name, text) in enumerate((("normal_force", "normal"), ("friction_force", "friction"))):
        for stroke in range(strokes):  # a line for each half-cycle of the cycle: their loads may be others
            of = (history.half_cycle.values - 1) % strokes == stroke
            label = text if stroke == 0 else None
            axes[0].plot(x[of], history[name].values[of], label=label, **run_style(number), **mark_few(x[of]))
    axes[0].set_ylabel("force (N)")
    axes[1].plot(x, 1e-3 * history.friction_work, color="0", **mark_few(x))
    axes[1].set_ylabel("work of friction (J)")
    legend_beside(axes[0], "")
    for ax in axes:
        from_zero(ax)
    run_axis(axes[-1], history, look, logarithmic=False)
    return figure


WHERE_HEAT_GOES = {
    "convected": "lost to the surroundings",
    "held": "lost where temperature is held",
    "stored": "gained by both bodies",
    "debris": "carried off by debris",
    "carried": "carried out by the strip",
}
assert WHERE_HEAT_GOES.keys() == set(TERMS) - {"friction"}


def heat_balance_figure(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw where the friction heat of each half-cycle goes; ways that none goes are left out."""
    figure, (ax,) = panels(1, 3.8, look=look)
    friction, x = history.heat_friction, look.course(history)
    largest = float(np.abs(friction).max())
    scale, unit = (1e-3, "J") if largest > 1e4 else (1.0, "mJ")
    ax.plot(x, scale * friction, color="0", linewidth=2.5, label="made by friction")
    threshold = 1e-6 * largest
    for number, (name, text) in enumerate(WHERE_HEAT_GOES.items()):
        values = history[f"heat_{name}"]
        if float(np.abs(values).max()) > threshold:
            ax.plot(x, scale * values, label=text, **run_style(number))
    ax.set_ylabel(f"heat per half-cycle ({unit})")
    legend_beside(ax, "")
    run_axis(ax, history, look)
    return figure


def cycle_ends(history: xarray.Dataset) -> NDArray[np.int64]:
    """Return the recorded half-cycles that end a cycle (k,)."""
    strokes = round(float(history.half_cycle[-1] / history.cycles[-1]))
    recorded = history.half_cycle.values
    return np.asarray(recorded[recorded % strokes == 0], dtype=np.int64)


def late_pressures(history: xarray.Dataset, half_cycles: Sequence[int] | NDArray[np.int64]) -> Array:
    """Return mean pressures (k, n), MPa, over the last tenth of what is done at recorded ends of cycles.

    From the end of a cycle before that tenth on, however far it lies back. At an instant the nodes at an edge that
    moves are at any fraction of their coming; what they have borne since is what they have lost.
    """
    ends = cycle_ends(history)
    borne = history.pressure_sum.sel(half_cycle=ends).values
    ends, borne = np.concatenate([[0], ends]), np.vstack([np.zeros(borne.shape[1]), borne])
    numbers = np.asarray(half_cycles)
    at = np.searchsorted(ends, numbers)
    before = np.searchsorted(ends, (1 - LAST) * numbers, side="right") - 1
    return np.asarray((borne[at] - borne[before]) / (ends[at] - ends[before])[:, None], dtype=np.float64)


def mean_pressure(history: xarray.Dataset) -> float:
    """Return the load over the nominal contact, MPa."""
    last = history.isel(half_cycle=-1)
    return float((last.pressure * last.weight).sum() / last.weight.sum())


def nominal_width(history: xarray.Dataset) -> float:
    """Return the width of the nominal contact at the end, mm."""
    return float(history.weight.isel(half_cycle=-1, missing_dims="ignore").sum())


def is_conforming(history: xarray.Dataset) -> bool:
    """Return whether the unworn surfaces lie on each other: only then is load over nominal contact a pressure."""
    return bool(history.attrs.get("conforming", 0))


def directions_present(history: xarray.Dataset) -> list[int]:
    """Return the sliding directions of a run, rightward first."""
    return [d for d in DIRECTIONS if bool((history.direction == d).any())]


def shown_unit(unit: str) -> str:
    """Return a unit as figures show it."""
    return {"degC": "°C"}.get(unit, unit)


def temperature_unit(history: xarray.Dataset) -> str:
    """Return the unit of the temperatures of a history as figures show it."""
    known = "largest_temperature" in history
    return shown_unit(str(history.largest_temperature.attrs.get("units", "K"))) if known else "K"


def mark_few(points: Sized) -> dict[str, Any]:
    """Return the style of a line of so few points that without marks nothing may be seen."""
    return {"marker": "o", "markersize": 3} if len(points) < 3 else {}


def by_direction(ax: Axes, history: xarray.Dataset, name: str, look: Style = STANDARD) -> None:
    """Draw a variable over the run, a line for each direction."""
    x = look.course(history)
    for d in directions_present(history):
        text, dashes, colour = direction_style(history, d)
        rows = history.direction.values == d
        ax.plot(x[rows], history[name][rows], dashes, color=colour, label=text, **mark_few(rows.nonzero()[0]))


def run_axis(ax: Axes, history: xarray.Dataset, look: Style, *, logarithmic: bool = True) -> None:
    """Label the axis of the run: logarithmic where wear alone slows down, linear with heat's own pace."""
    x = look.course(history)
    first, last = float(x[0]), float(x[-1])
    slows_down = int(history.half_cycle[-1]) > 10_000 or "largest_temperature" not in history
    if logarithmic and slows_down and first > 0 and last > MANY * first:
        by_powers(ax)
        ax.set_xlim(first, last)
    elif last > first:
        ax.set_xlim(0 if not logarithmic else first, last)
        if last < SHORT:
            from matplotlib.ticker import MaxNLocator

            ax.xaxis.set_major_locator(MaxNLocator(4))
    ax.set_xlabel(look.label)
