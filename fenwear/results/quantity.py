"""A quantity: its name, unit and meaning, and how it is computed of half-cycles, whoever has computed these.

Runs and studies have a block of half-cycles, steady states a `SteadyCycle`; a quantity is computed of both by one
function. `fenwear.results.registry` lists them. Temperatures are in degrees Celsius where the case has any in degrees.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from fenwear.case import Case
from fenwear.common.arrays import Array

if TYPE_CHECKING:
    import xarray  # with pandas, half a second that commands without tables spare themselves

RECORD = ("half_cycle",)
BODIES = {"punch": "", "strip": "_strip"}  # and how the names of their variables end
SUFFIXES = {
    "1": "",
    "degree": "deg",
    "mm3/(N m)": "mm3_per_N_m",
    "mJ/mm2": "mJ_per_mm2",
    "N mm": "N_mm",
    "mm s-1": "mm_per_s",
    "rad s-1": "rad_per_s",
}  # fmt: skip  (of keys that end in their unit)


@dataclass(frozen=True)
class Quantity:
    """A quantity of a contact.

    Attributes:
        name: In histories, studies, sweeps and figures; with its unit behind it in summaries.
        dims: Dimensions of its values: the half-cycles, and nodes or time steps; none of one number of a cycle.
        unit: Of its values.
        long_name: Its description.
        compute: Values (k, ...) of k half-cycles, from a block of them or from a `SteadyCycle`.
        cycle: Which number is that of a cycle: the last half-cycle's, the largest, the mean, or the sum.
        steady: Whether a steady state has it, too.
        nodal: Whether values at contact nodes determine it, so that each of several contacts has a value.
        of: The table of summary.json that has it: sliding, punch, strip, or end for the top; "" for none.
    """

    name: str
    dims: tuple[str, ...]
    unit: str
    long_name: str
    compute: Callable[[Any], Any]
    cycle: Literal["last", "largest", "mean", "sum"] = "last"
    steady: bool = False
    nodal: bool = False
    of: str = ""

    @property
    def key(self) -> str:
        """Its key in a summary: the name with the unit behind it; of the strip below the strip's name."""
        name, suffix = self.name.removesuffix("_strip"), SUFFIXES.get(self.unit, self.unit)
        return f"{name}_{suffix}" if suffix else name

    def of_cycle(self, records: Any) -> Array:
        """Return its value in the last cycle of the records of half-cycles (...)."""
        if not self.dims:
            return np.asarray(self.compute(records), dtype=np.float64)
        values: Array = np.asarray(self.compute(records), dtype=np.float64)[-records.system.motion.half_cycles :]
        return np.asarray(reduced(values[None], self.cycle)[0])


def reduced(values: Array, cycle: Literal["last", "largest", "mean", "sum"]) -> Array:
    """Return one value of each of m cycles (m, ...) from those of its half-cycles (m, k, ...)."""
    if cycle == "last":
        return values[:, -1]
    by: dict[str, Callable[..., Any]] = {"largest": np.max, "mean": np.mean, "sum": np.sum}
    return np.asarray(by[cycle](values, axis=1))


@dataclass(frozen=True)
class InTable:
    """Computation of several quantities at once, as a table by their names."""

    table: Callable[[Any], Mapping[str, Any]]
    name: str

    def __call__(self, records: Any) -> Any:
        """Return its values."""
        return self.table(records)[self.name]


def numbers(records: Any, of: str, known: Iterable[Quantity]) -> dict[str, float]:
    """Return the numbers of the last half-cycle or cycle for a table of summary.json, by its keys."""
    chosen = [quantity for quantity in known if quantity.of == of]
    values = computed(records, chosen)
    return {
        quantity.key: float(np.asarray(values[quantity.name])[-1] if quantity.dims else values[quantity.name])
        for quantity in chosen
    }


def computed(records: Any, quantities: Iterable[Quantity]) -> dict[str, Any]:
    """Return the values of quantities by their names; each table is computed once."""
    tables: dict[int, Mapping[str, Any]] = {}
    values = {}
    for quantity in quantities:
        how = quantity.compute
        if isinstance(how, InTable):
            if id(how.table) not in tables:
                tables[id(how.table)] = how.table(records)
            values[quantity.name] = tables[id(how.table)][how.name]
        else:
            values[quantity.name] = how(records)
    return values


ICE = 273.15  # K, at 0 degrees Celsius


@dataclass(frozen=True)
class TemperatureScale:
    """A scale of temperature.

    Attributes:
        unit: In files.
        zero: Its zero, K.
    """

    unit: str = "K"
    zero: float = 0.0

    @property
    def shown(self) -> str:
        """The unit for people."""
        return "°C" if self.zero else self.unit

    def of(self, kelvin: Array) -> Array:
        """Return temperatures on this scale."""
        return kelvin - self.zero


KELVIN, CELSIUS = TemperatureScale(), TemperatureScale("degC", ICE)


def degrees_of(case: Case) -> TemperatureScale:
    """Return the scale that a case gives its temperatures in."""
    return CELSIUS if case.in_degrees else KELVIN


def degrees_in(unit: str) -> TemperatureScale:
    """Return the scale of a unit of a file."""
    return CELSIUS if unit == CELSIUS.unit else KELVIN


def in_kelvin(history: xarray.Dataset) -> xarray.Dataset:
    """Return a history with all temperatures in kelvin."""
    converted = history.copy()
    for name, values in history.data_vars.items():
        if values.attrs.get("units") == CELSIUS.unit:
            converted[name] = (values + ICE).assign_attrs({**values.attrs, "units": KELVIN.unit})
    return converted
