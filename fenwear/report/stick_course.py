"""What the figures of a run with stick share: its axis in cycles, distance or time, its cycles, lines along it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import xarray

from fenwear.arrays import Array, Mask
from fenwear.errors import CaseError, InputError
from fenwear.report.style import Style, by_powers, contact_axis
from fenwear.report.surface import along_contact, model_of, surface_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHARES = (0.25, 0.5, 0.75, 1.0)  # of a half-cycle: what is drawn of it
THROUGH_MIDDLE = "place along the sliding, through the middle (mm)"
MANY = 20  # cycles from which on a logarithmic axis shows more


def course(history: xarray.Dataset, look: Style) -> Array:
    """Return where each recorded cycle ends on the axis that was chosen (k,).

    Raises:
        CaseError: the run has no such axis.
    """
    if look.axis == "time":
        return np.asarray(history.time.values, dtype=np.float64)
    if look.axis == "distance":
        if history.displacement.attrs.get("units") != "mm":
            raise CaseError(InputError("--axis", "the strip turns; expected cycles or time"))
        return np.asarray(1e-3 * history.sliding_distance.values, dtype=np.float64)
    return np.asarray(history.cycle.values, dtype=np.float64)


def course_axis(ax: Axes, history: xarray.Dataset, look: Style) -> Array:
    """Label the axis of the run, logarithmic over many cycles, and return the places of the cycles on it (k,)."""
    x = course(history, look)
    ax.set_xlabel(look.label)
    if history.cycle.values[-1] > MANY:
        by_powers(ax)
        each = x[-1] / max(float(history.cycle.values[-1]), 1.0)
        x = np.maximum(x, each)  # the first cycle has no place on it
    return x


def cycle_name(history: xarray.Dataset, place: int, look: Style) -> str:
    """Return a recorded cycle in words of the axis."""
    value = float(course(history, look)[place])
    return f"{value:,.0f}" if look.axis == "cycles" or value >= 1000 else f"{value:.4g}"


def title(history: xarray.Dataset, place: int, look: Style) -> str:
    """Return what stands above a panel of one recorded cycle."""
    name = cycle_name(history, place, look)
    return {"cycles": f"cycle {name}", "distance": f"after {name} m", "time": f"after {name} s"}[look.axis]


def first_and_last(history: xarray.Dataset) -> list[int]:
    """Return the places of the first and the last recorded cycle."""
    return sorted({0, history.sizes["cycle"] - 1})


def shown_steps(cycle: xarray.Dataset) -> list[int]:
    """Return the time steps of a cycle that end at the quarters of its first half-cycle."""
    half = int((cycle.half_cycle_of_step == 1).sum())
    return [max(round(share * half) - 1, 0) for share in SHARES]


def touched(history: xarray.Dataset) -> Mask:
    """Return which nodes ever touch (n,), all where none does."""
    ever = (history.pressure.values > 0).any(axis=(0, 1))
    return ever if ever.any() else np.ones_like(ever)


def middle_of_contact(history: xarray.Dataset) -> Array:
    """Return the places along and across the sliding of the middle of what touches in a solid (2,), mm."""
    weight = history.weight.values * touched(history)
    return np.array([np.average(history[name].values, weights=weight) for name in ("along", "across")])


Line = Callable[[Array], tuple[Array, Array]]  # from values at the nodes of the punch to places, mm, and values there


def line_along(history: xarray.Dataset) -> Line:
    """Return what takes values at the nodes to those along the contact; of a solid on a cut through its middle."""
    if model_of(history) == "solid":
        return partial(surface_of(history).cut, at=middle_of_contact(history), along=True)
    x = along_contact(history)[0]
    return lambda values: (x, values)


def to_contact(ax: Axes, history: xarray.Dataset) -> None:
    """Label the axis along the contact and leave out what lies far beside it."""
    solid = model_of(history) == "solid"
    x = history.along.values if solid else along_contact(history)[0]
    ends, beside = x[touched(history)], 0.2 * float(np.ptp(x[touched(history)])) + 1e-9
    contact_axis(ax, THROUGH_MIDDLE if solid else along_contact(history)[1])
    ax.set_xlim(max(ends.min() - beside, x.min()), min(ends.max() + beside, x.max()))
