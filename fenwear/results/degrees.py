"""Temperatures as a case gives them: in results they are in degrees Celsius where the case has any in degrees."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from fenwear.arrays import Array
from fenwear.case import Case

if TYPE_CHECKING:
    import xarray  # with pandas, half a second that commands without tables spare themselves

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
    found = history.copy()
    for name, values in history.data_vars.items():
        if values.attrs.get("units") == CELSIUS.unit:
            found[name] = (values + ICE).assign_attrs({**values.attrs, "units": KELVIN.unit})
    return found
