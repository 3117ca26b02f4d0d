"""Histories read back: of a run's folder with the present names, by cycles with their time steps, or of blocks.

`to_dataset` has the blocks of a run as one dataset, with the names, units and words of history.nc.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Hashable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fenwear.common.errors import CaseError, InputError
from fenwear.results.hdf5 import load
from fenwear.results.history import HISTORY, columns_of, variables_of
from fenwear.results.history_surfaces import conforming
from fenwear.results.quantity import KELVIN, RECORD, computed, degrees_of, reduced
from fenwear.results.registry import known
from fenwear.results.time_steps import STEP
from fenwear.steps import Block

if TYPE_CHECKING:
    import xarray

# What a quantity was called, with a unit or a body behind it, and is called now; several may follow on each other.
OLD_NAMES = (
    (r"^max_(pressure|temperature)", r"largest_\1"),
    (r"^pressure_beside_max", "pressure_beside_largest"),
    (r"^max_wear_(across|[rxyz])", r"largest_depth_at_\1"),
    (r"^at_(across|[rxyz])_mm", r"largest_depth_at_\1_mm"),
    (r"^(max|largest)_wear", "largest_depth"),
    (r"^scar_(\w+?)_1_percent", r"scar_\1"),
    (r"^scar_(\w+?)_5(?!_percent)", r"scar_\1_5_percent"),
    (r"^largest_pressure_of_cycle", "largest_pressure_in_cycle"),
    (r"^coating_worn_through", "worn_through_of_surface"),
    (r"^layer_creep_volume", "creep_volume_layer"),
    (r"^largest_layer_creep_depth", "largest_creep_depth_layer"),
)
# Names that have come to mean something else: only in files that have one of those above.
TAKEN_NAMES = (
    (r"^largest_temperature(?!_of_run)", "largest_temperature_of_run"),
    (r"^friction_coefficient", "mean_friction_coefficient"),
)
OLDER = (
    "of an older fenwear, in which worn_area and worn_volume were values of a half-cycle, not from the start. "
    "Run the case again with this version"
)


def load_history(directory: Path | str) -> xarray.Dataset:
    """Return all of history.nc of a run, in memory.

    Raises:
        CaseError: there is none, it cannot be read, or it is of a version whose names meant something else.
    """
    path = Path(directory) / HISTORY
    try:
        history = load(path)
    except (OSError, ValueError) as error:
        raise _unreadable(path, error) from None
    if is_older(history.variables):
        raise CaseError(InputError(str(path), OLDER))
    return history.rename(current_names(map(str, history.variables)))


def read_history(directory: Path | str) -> xarray.Dataset:
    """Return the history of a run, in memory.

    Raises:
        CaseError: there is none, it cannot be read, or holds no half-cycle yet.
    """
    history, path = load_history(directory), str(Path(directory) / HISTORY)
    if not {"half_cycle", "pressure", "wear"} <= set(history.variables):
        raise CaseError(InputError(path, "no history of a run: it has other variables"))
    if history.sizes["half_cycle"] == 0:
        raise CaseError(InputError(path, "holds no half-cycle yet"))
    return history


def current_names(names: Iterable[str]) -> dict[str, str]:
    """Return the present name of each of a file's names that has changed, by its old one."""
    known = [*names]
    changes = _changes(any(re.search(old, name) for old, _ in OLD_NAMES for name in known))
    return {name: new for name in known if (new := changes(name)) != name}


def in_current_names(summary: str) -> Any:
    """Return the tables of a summary with the present names of all quantities.

    Raises:
        ValueError: the text is no JSON.
    """
    old = any(re.search(f'"{pattern[1:]}', summary) for pattern, _ in OLD_NAMES)
    changes = _changes(old)
    tables = json.loads(summary, object_pairs_hook=lambda pairs: {changes(key): value for key, value in pairs})
    if old and "mean_pressure_MPa" in tables:  # was the load over the meshed surface; now only of what touches
        tables["pressure_over_surface_MPa"] = tables.pop("mean_pressure_MPa")
    return tables


def _changes(old: bool) -> Callable[[str], str]:
    """Return how names of an older file change to those of today; those of today do not."""

    def changed(name: str) -> str:
        for pattern, new in (*TAKEN_NAMES, *OLD_NAMES) if old else ():
            name = re.sub(pattern, new, name)
        return name

    return changed


def is_older(names: Iterable[Hashable]) -> bool:
    """Return whether the names of a history are those of a version in which worn volumes were of one half-cycle."""
    known = {str(name) for name in names}
    stem = "worn_area" if "worn_area" in known or "worn_area_strip" in known else "worn_volume"
    return bool(known & {stem, f"{stem}_strip"}) and not known & {f"{stem}_increment", f"{stem}_increment_strip"}


def _unreadable(path: Path, error: Exception) -> CaseError:
    reason = "there is no such file" if isinstance(error, FileNotFoundError) else str(error)
    return CaseError(InputError(str(path), f"no readable history of a run: {reason}"))


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
    import xarray  # with pandas, half a second that commands without tables spare themselves

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
            joined = one_after_the_other(history[of].values[rows])
            put(name, ("cycle", STEP, *map(str, history[of].dims[2:])), joined, of)
    data["stick"] = (data["stick"][0], np.nan_to_num(data["stick"][1]).astype(np.int8), data["stick"][2])
    for name, variable in history.data_vars.items():
        if variable.dims[:1] == RECORD and STEP not in variable.dims and name != "weight" and str(name) not in data:
            values = reduced(variable.values[rows], known(str(name)).cycle)
            put(str(name), ("cycle", *map(str, variable.dims[1:])), values, str(name))
    fixed = {name: held for name, held in history.variables.items() if "half_cycle" not in held.dims and name != STEP}
    weight = history.weight.isel(half_cycle=-1, drop=True)
    half = np.where(there, np.repeat(np.arange(1, strokes + 1), history.sizes[STEP]), 0).reshape(*rows.shape, -1)
    fractions = one_after_the_other(history.step_fraction.values[rows])
    coordinates = {
        "cycle": ("cycle", numbers[last] // strokes, {"units": "1", "long_name": "cycles done"}),
        "fraction": (("cycle", STEP), fractions, history.step_fraction.attrs),
        "half_cycle_of_step": (("cycle", STEP), one_after_the_other(half), {"units": "1", "long_name": "half-cycle"}),
        **{str(name): (column.dims, column.values, column.attrs) for name, column in fixed.items()},
        "weight": (weight.dims, weight.values, weight.attrs),
    }
    return xarray.Dataset(data, coordinates, history.attrs)


def cycle_at(history: xarray.Dataset, place: int) -> xarray.Dataset:
    """Return one cycle of `by_cycles` with all of its own time steps."""
    cycle = history.isel(cycle=place)
    return cycle.isel({STEP: np.isfinite(cycle.fraction.values)})


def to_dataset(blocks: Block | Iterable[Block]) -> xarray.Dataset:
    """Return all half-cycles of blocks as a dataset, as `read_history` returns those of a run.

    Args:
        blocks: One, or those that `march`, `jump` or `evolve` yield, in their order.

    Raises:
        CaseError: there is no block.
    """
    import xarray

    block_list = [blocks] if isinstance(blocks, Block) else list(blocks)
    if not block_list:
        raise CaseError(InputError("blocks", "expected at least one: no half-cycle was computed"))
    system = block_list[0].system
    variables, degrees = variables_of(system), degrees_of(system.case)
    parts = [computed(block, variables_of(block.system).values()) for block in block_list]
    data = {name: (c.dimensions, c.values, dict(c.attributes)) for name, c in columns_of(system).items()}
    for name, quantity in variables.items():
        values, unit = np.concatenate([part[name] for part in parts]), quantity.unit
        if unit == KELVIN.unit:
            values, unit = degrees.of(values), degrees.unit
        data[name] = (quantity.dims, values, {"units": unit, "long_name": quantity.long_name})
    attributes = {"title": system.case.title or "fenwear run", "conforming": int(conforming(system.pair))}
    if system.case.model.kind != "plane":
        attributes["model"] = system.case.model.kind
    return xarray.Dataset(data, attrs=attributes).set_coords([name for name in data if name in ("x", "half_cycle")])
