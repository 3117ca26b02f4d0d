"""The time steps of a history by cycles: what its figures are drawn from."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray

from fenwear.heat.exchange import CROSSING, TERMS
from fenwear.results.steps import STEP

STEPS = {"displacement": "displacement", "tangential_force": "tangential_force", "pressure": "step_pressure",
         "traction": "traction", "traction_across": "traction_across", "slip": "slip", "slip_across": "slip_across",
         "stick": "stick", "surface_stress": "surface_stress", "temperature_punch": "step_temperature_punch",
         "temperature_strip": "step_temperature_strip"}  # fmt: skip
AT_END = (
    "time",
    "sliding_distance",
    "wear",
    "wear_strip",
    "stick_width",
    "stick_area",
    "stick_width_within",
    "stick_area_within",
)
SUMMED = ("worn_area_increment", "worn_area_increment_strip", "worn_volume_increment", "worn_volume_increment_strip")
LARGEST = ("complementarity_error", "energy_balance_error", "jump_error", "heat_balance_error")


def resolves(history: xarray.Dataset) -> bool:
    """Return whether a history has the time steps of its half-cycles."""
    return STEP in history.sizes and "step_fraction" in history


def by_cycles(history: xarray.Dataset) -> xarray.Dataset:
    """Return the whole cycles of a history with time steps, each with all of its steps one after the other.

    Dimensions are `cycle`, whose coordinate is the number of cycles done, `step` and those of the nodes; cycles of
    fewer steps than others end in NaN (`cycle_at`). Worn depths are those at the end of the cycle, `dissipated_energy`
    is the work of friction in it, mJ.
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
    for name in AT_END:
        if name in history:
            put(name, ("cycle", *map(str, history[name].dims[1:])), history[name].values[last], name)
    for name in LARGEST:
        if name in history:
            put(name, ("cycle",), history[name].values[rows].max(axis=1), name)
    for name in SUMMED:
        if name in history:
            put(name, ("cycle",), history[name].values[rows].sum(axis=1), name)
    touched = data["pressure"][1] > 0
    size = "contact_width" if "contact_width" in history else "contact_area"
    put(size, ("cycle",), (touched * history.weight.values[last][:, None]).sum(axis=2).max(axis=1), size)
    put("energy_ratio", ("cycle",), history.energy_ratio.values[rows].mean(axis=1), "energy_ratio")
    work = history.friction_work_increment.values[rows].sum(axis=1)
    put("dissipated_energy", ("cycle",), work, "friction_work_increment")
    put("accumulated_energy", ("cycle",), history.friction_work.values[last], "friction_work")
    for term in (*TERMS, *CROSSING) if "heat_friction" in history else ():
        put(f"heat_{term}", ("cycle",), history[f"heat_{term}"].values[rows].sum(axis=1), f"heat_{term}")
    if "temperature_punch" in data:
        hottest = np.maximum(*(np.nanmax(data[f"temperature_{body}"][1], axis=(1, 2)) for body in ("punch", "strip")))
        put("largest_temperature", ("cycle",), hottest, "largest_temperature")
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
