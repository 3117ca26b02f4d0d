"""The time steps of a history by cycles: what its figures are drawn from."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray

from fenwear.results.quantity import RECORD, reduced
from fenwear.results.registry import known
from fenwear.results.steps import STEP

STEPS = {"displacement": "displacement", "tangential_force": "tangential_force", "pressure": "step_pressure",
         "traction": "traction", "traction_across": "traction_across", "slip": "slip", "slip_across": "slip_across",
         "stick": "stick", "surface_stress": "surface_stress", "temperature_punch": "step_temperature_punch",
         "temperature_strip": "step_temperature_strip"}  # fmt: skip


def resolves(history: xarray.Dataset) -> bool:
    """Return whether a history has the time steps of its half-cycles."""
    return STEP in history.sizes and "step_fraction" in history


def by_cycles(history: xarray.Dataset) -> xarray.Dataset:
    """Return the whole cycles of a history with time steps, each with all of its steps one after the other.

    Dimensions are `cycle`, whose coordinate is the number of cycles done, `step` and those of the nodes; cycles of
    fewer steps than others end in NaN (`cycle_at`). Other variables are reduced to one value of each cycle as the
    registry says: depths and totals at its end, increments added up, pressures and errors the largest.
    """
    numbers = history.half_cycle.values.astype(int)
    strokes = round(float(history.half_cycle[-1] / history.cycles[-1]))
    last = np.flatnonzero(numbers % strokes == 0)
    last = last[last >= strokes - 1]
    last = last[numbers[last] - numbers[last - strokes + 1] == strokes - 1]
    rows = last[:, None] + np.arange(-strokes + 1, 1)  # (cycles, strokes)
    there = np.isfinite(history.step_fraction.values[rows]).reshape(len(rows), -1)  # (cycles, strokes * steps)
    order = np.argsort(~there, axis=1, kind="stable")[:, : there.sum(axis=1).max(initial=0)]
    data: dict[str, tuple[tuple[str, ...], NDArray[Any], dict[str, str]]] = {}

    def one_after_the_other(values: NDArray[Any]) -> NDArray[Any]:
        inner = values.shape[3:]
        return np.take_along_axis(
            values.reshape(len(rows), -1, *inner), order.reshape(*order.shape, *[1] * len(inner)), 1
        )

    def put(name: str, over: tuple[str, ...], values: NDArray[Any], of: str) -> None:
        kept = {key: value for key, value in history[of].attrs.items() if key not in ("coordinates",)}
        data[name] = (over, values, kept)

    for name, of in STEPS.items():
        if of in history:
            found = one_after_the_other(history[of].values[rows])
            put(name, ("cycle", STEP, *map(str, history[of].dims[2:])), found, of)
    data["stick"] = (data["stick"][0], np.nan_to_num(data["stick"][1]).astype(np.int8), data["stick"][2])
    for name, one in history.data_vars.items():
        if one.dims[:1] == RECORD and STEP not in one.dims and name != "weight" and str(name) not in data:
            quantity, values = known(str(name)), one.values[rows]
            put(
                str(name),
                ("cycle", *map(str, one.dims[1:])),
                reduced(values, "last" if quantity is None else quantity.cycle),
                str(name),
            )
    fixed = {name: one for name, one in history.variables.items() if "half_cycle" not in one.dims and name != STEP}
    weight = history.weight.isel(half_cycle=-1, drop=True)
    half = np.where(there, np.repeat(np.arange(1, strokes + 1), history.sizes[STEP]), 0).reshape(*rows.shape, -1)
    fractions = one_after_the_other(history.step_fraction.values[rows])
    coordinates = {
        "cycle": ("cycle", numbers[last] // strokes, {"units": "1", "long_name": "cycles done"}),
        "fraction": (("cycle", STEP), fractions, history.step_fraction.attrs),
        "half_cycle_of_step": (("cycle", STEP), one_after_the_other(half), {"units": "1", "long_name": "half-cycle"}),
        **{str(name): (one.dims, one.values, one.attrs) for name, one in fixed.items()},
        "weight": (weight.dims, weight.values, weight.attrs),
    }
    return xarray.Dataset(data, coordinates, history.attrs)


def cycle_at(history: xarray.Dataset, place: int) -> xarray.Dataset:
    """Return one cycle of `by_cycles` with all of its own time steps."""
    cycle = history.isel(cycle=place)
    return cycle.isel({STEP: np.isfinite(cycle.fraction.values)})
