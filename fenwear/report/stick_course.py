"""What the figures of a run with stick share: its axis in cycles, distance or time, names of its cycles, tractions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray

from fenwear.arrays import Array
from fenwear.errors import CaseError, InputError
from fenwear.report.style import STANDARD, Look, legend_beside, panels, shades

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MANY = 20  # cycles from which on a logarithmic axis shows more


def course(history: xarray.Dataset, look: Look) -> Array:
    """Return where each recorded cycle begins on the axis that was chosen (k,).

    Raises:
        CaseError: the run has no such axis.
    """
    cycles = history.cycle.values.astype(float)
    if look.axis == "time":
        if "period" not in history.attrs:
            raise CaseError(InputError("--axis", "this run does not tell its period; expected cycles"))
        return cycles * float(history.attrs["period"])
    if look.axis == "distance":
        if history.displacement.attrs.get("units") != "mm":
            raise CaseError(InputError("--axis", "the strip turns; expected cycles or time"))
        there = history.displacement.isel(cycle=-1).values
        return cycles * 1e-3 * float(np.abs(there - np.roll(there, 1)).sum())
    return cycles


def course_axis(ax: Axes, history: xarray.Dataset, look: Look) -> Array:
    """Label the axis of the run, logarithmic over many cycles, and return the places of the cycles on it (k,)."""
    x = course(history, look)
    ax.set_xlabel(look.label)
    if history.cycle.values[-1] > MANY:
        ax.set_xscale("log")
        each = x[-1] / max(float(history.cycle.values[-1]), 1.0)
        x = np.maximum(x, each)  # the first cycle has no place on it
    return x


def cycle_name(history: xarray.Dataset, place: int, look: Look) -> str:
    """Return a recorded cycle in words of the axis."""
    value = float(course(history, look)[place])
    return f"{value:,.0f}" if look.axis == "cycles" or value >= 1000 else f"{value:.4g}"


def title(history: xarray.Dataset, place: int, look: Look) -> str:
    """Return what stands above a panel of one recorded cycle."""
    name = cycle_name(history, place, look)
    return {"cycles": f"cycle {name}", "distance": f"after {name} m", "time": f"after {name} s"}[look.axis]


def first_and_last(history: xarray.Dataset) -> list[int]:
    """Return the places of the first and the last recorded cycle."""
    return sorted({0, history.sizes["cycle"] - 1})


def traction_panels(
    history: xarray.Dataset,
    steps: Sequence[int],
    line: Callable[[Array], tuple[Any, Any]],
    limit: Callable[[Axes], None],
    look: Look = STANDARD,
) -> Figure:
    """Draw the tangential traction between its bounds in the first and the last cycle.

    Args:
        history: Of a run with stick.
        steps: Time steps that have a line.
        line: From values at the contact nodes (n,) to places and values along a line.
        limit: Labels the axis along it, and cuts it to the contact.
        look: Width and axis.
    """
    places = first_and_last(history)
    figure, axes = panels(len(places), 2.8, look=look)
    mu = float(history.attrs["friction"])
    for ax, place in zip(axes, places, strict=True):
        cycle = history.isel(cycle=place)
        for colour, step in shades(steps):
            now = cycle.isel(step=step)
            ax.plot(*line(now.traction.values), color=colour, label=f"{float(now.fraction):.3g}")
        x, bound = line(mu * cycle.pressure.max("step").values)
        ax.fill_between(x, -bound, bound, color="0.85", linewidth=0, zorder=0, label="µ p")
        ax.set_ylabel(f"{title(history, place, look)}:\ntraction (MPa)")
        legend_beside(ax, "part of the cycle")
    limit(axes[-1])
    return figure
