"""The outcomes of all variants as one dataset, and its files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray
from numpy.typing import NDArray

from fenwear.case import Case
from fenwear.results import registry
from fenwear.results.disk import replacing
from fenwear.results.quantity import KELVIN, RECORD, Quantity, TemperatureScale, degrees_of
from fenwear.studies.study import Outcome
from fenwear.studies.sweep_plan import Of, Plan
from fenwear.surfaces import is_translation
from fenwear.system.strokes import make_sliding

if TYPE_CHECKING:
    import pandas

DATASET, TABLE = "sweep.nc", "sweep.csv"
SECONDS = "seconds"
NODES = ("x", "y", "weight", "direction")  # coordinates where they are the same in all variants
SAME = 1e-9  # of their range
Place = tuple[int, ...]


def _other(name: str, dims: tuple[str, ...], unit: str, long_name: str) -> Quantity:
    """Return a quantity of sweeps alone, whose values come with the state."""
    return Quantity(name, dims, unit, long_name, lambda _: np.nan)


# What is not of the registry.
OTHERS = {
    quantity.name: quantity
    for quantity in (
        _other("x", ("node",), "mm", "position along the contact"),
        _other("y", ("node",), "mm", "position across the contact"),
        _other("shape", ("node",), "mm", "worn shape without the rigid motion of the punch"),
        _other("wear_per_cycle", ("node",), "mm", "depth worn off both bodies in a cycle"),
        _other("nominal_pressure", (), "MPa", "load over the projected area of the contact"),
        _other("angle", ("half_cycle", "node"), "rad", "angle chi between the normal and the wear velocity"),
        _other("half_cycles", (), "", "half-cycles done"),
        _other("iterations", (), "", "Newton iterations"),
    )
}


def meaning(name: str, of: Of, case: Case) -> Quantity:
    """Return what a result is, with its dimensions besides those of the sweep."""
    if name in OTHERS:
        return OTHERS[name]
    entry = registry.known(name)
    if not entry.name or name.startswith("lambda_"):
        unit, per = ("mm" if is_translation(name) else "rad"), ("s" if of == "optimum" else "cycle")
        return _other(name, RECORD if of == "optimum" else (), f"{unit}/{per}", "rigid-body wear of the punch")
    nodes = tuple("node" for d in entry.dims[1:])
    if case.model.kind != "plane":
        entry = registry.on_surface(entry)
    each = name == "direction" or (entry.dims and entry.cycle != "last")
    return _other(name, (*(RECORD if each else ()), *nodes), "" if entry.unit == "1" else entry.unit, entry.long_name)


def gathered(case: Case, plan: Plan, outcomes: Mapping[Place, Outcome]) -> xarray.Dataset:
    """Return all outcomes as one dataset, NaN where a variant failed.

    Nodes and directions are coordinates where all variants have the same. Else they are variables of the
    variants too, and arrays end with NaN where another variant has more of them.
    """
    sizes = plan.dimensions
    dims, shape = tuple(sizes), tuple(sizes.values())
    good = {place: done.values for place, done in outcomes.items() if not done.trouble}
    names = list(dict.fromkeys(name for values in good.values() for name in values))
    data, coordinates = {}, _coordinates(plan)
    for name in names:
        entry = meaning(name, plan.of, case)
        scale = degrees_of(case) if entry.unit == KELVIN.unit else TemperatureScale(entry.unit)
        attributes: dict[str, Any] = {"units": scale.unit, "long_name": case.names.with_names(entry.long_name)}
        if name == "direction":
            words = make_sliding(case).field.words(3 if case.model.kind == "solid" else 2)
            attributes |= {"flag_values": list(words), "flag_meanings": " ".join(words.values())}
        arrays = {place: scale.of(np.asarray(values[name])) for place, values in good.items() if name in values}
        if name in NODES and len(arrays) == len(good) and _same(list(arrays.values())):
            coordinates[name] = (entry.dims, next(iter(arrays.values())), attributes)
        else:
            data[name] = ((*dims, *entry.dims), _filled(arrays, shape, len(entry.dims)), attributes)
    trouble, seconds = np.full(shape, "", dtype=object), np.full(shape, np.nan)
    for place, outcome in outcomes.items():
        trouble[place], seconds[place] = outcome.trouble, outcome.seconds
    data["trouble"] = (dims, trouble.astype(str), {"units": "", "long_name": "why a variant failed"})
    data[SECONDS] = (dims, seconds, {"units": "s", "long_name": "time to compute a variant, with its set-up if any"})
    about = {"title": case.title or "fenwear sweep", "Conventions": "CF-1.11", "of": plan.of, "case": case.to_toml()}
    return xarray.Dataset(data, coordinates, about)


def _coordinates(plan: Plan) -> dict[str, tuple[tuple[str, ...], NDArray[Any], dict[str, str]]]:
    coordinates: dict[str, tuple[tuple[str, ...], NDArray[Any], dict[str, str]]] = {}
    for axis, (values, unit) in zip(plan.axes, plan.coordinates, strict=True):
        dimension = "variant" if plan.zipped else axis.key
        coordinates[axis.key] = ((dimension,), np.array(values), {"units": unit, "long_name": axis.key})
    return coordinates


def _same(arrays: Sequence[NDArray[np.generic]]) -> bool:
    first = arrays[0]
    size = float(np.ptp(first)) if first.size else 0.0
    return all(
        array.shape == first.shape and np.allclose(array, first, rtol=0, atol=SAME * size) for array in arrays[1:]
    )


def _filled(arrays: Mapping[Place, NDArray[np.generic]], shape: Place, inner_dims: int) -> NDArray[np.float64]:
    most = np.max([array.shape for array in arrays.values()], axis=0) if inner_dims else ()
    result = np.full((*shape, *map(int, most)), np.nan)
    for place, array in arrays.items():
        at: tuple[Any, ...] = (*place, *(slice(length) for length in array.shape))
        result[at] = array
    return result


def write(folder: Path, dataset: xarray.Dataset) -> None:
    """Write the dataset and the table of its numbers, each in place of an older one as a whole.

    Raises:
        OutputError: they cannot be written.
    """
    with replacing(folder / DATASET, shared=True) as part:
        dataset.to_netcdf(part, engine="h5netcdf")
    with replacing(folder / TABLE, shared=True) as part:
        records(dataset).to_csv(part, index=False)


def records(dataset: xarray.Dataset) -> pandas.DataFrame:
    """Return a row for each variant: its keys and single numbers, the unit behind the name."""
    units = {key: unit for key, axis in dataset.coords.items() if (unit := axis.attrs.get("units"))}
    frame = table(dataset).to_dataframe().reset_index()
    return frame.rename(columns={key: f"{key} ({unit})" for key, unit in units.items()})


def table(dataset: xarray.Dataset) -> xarray.Dataset:
    """Return the single numbers of each variant; those of half-cycles under a name for each, with the unit behind."""
    columns = {}
    for name, values in dataset.data_vars.items():
        if "node" in values.dims:
            continue
        unit = values.attrs["units"]
        behind = f" ({unit})" if unit else ""
        if "half_cycle" not in values.dims:
            columns[f"{name}{behind}"] = values
            continue
        for k in range(values.sizes["half_cycle"]):
            columns[f"{name}_{_way(dataset, k)}{behind}"] = values.isel(half_cycle=k, drop=True)
    return xarray.Dataset({name: values.drop_vars(NODES, errors="ignore") for name, values in columns.items()})


def _way(dataset: xarray.Dataset, k: int) -> str:
    """Return the name of a half-cycle: by its direction where the directions differ."""
    directions = dataset.coords.get("direction")
    if directions is None or len(set(directions.values)) < directions.size:
        return str(k + 1)
    words = dict(zip(directions.attrs["flag_values"], directions.attrs["flag_meanings"].split(), strict=True))
    return str(words[int(directions[k])])
