"""What a run with stick and heat leaves besides: temperatures of each time step, and the balance of heat of a cycle."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray

from fenwear.heat.exchange import TERMS
from fenwear.results.degrees import degrees_in
from fenwear.results.history import HEAT_TERMS
from fenwear.results.summary import HOTTEST
from fenwear.stick.heat import balance_error
from fenwear.stick.jump import Cycle

# name: (dimensions, units, long_name)
HEAT_VARIABLES = {
    "temperature_punch": (("cycle", "step", "x"), "K", "temperature of the punch's contact surface at the end"),
    "temperature_strip": (("cycle", "step", "x"), "K", "temperature of the strip's contact surface at the end"),
    "max_temperature": (("cycle",), "K", "largest temperature of the contact surfaces"),
    "heat_balance_error": (("cycle",), "1", "missing heat of a half-cycle over its largest term, the larger one"),
    **{f"heat_{name}": (("cycle",), "mJ", text.replace("half-cycle", "cycle")) for name, text in HEAT_TERMS.items()},
}


def heat_values(cycle: Cycle, order: NDArray[np.int64]) -> dict[str, Any]:
    """Return the values of `HEAT_VARIABLES` of a cycle, its time steps in this order; none without heat."""
    records = cycle.records
    if not records.heat.size:
        return {}
    totals = records.heat.sum(axis=0)
    return {
        "temperature_punch": records.temperature[order, 0],
        "temperature_strip": records.temperature[order, 1],
        "max_temperature": float(records.temperature.max()),
        "heat_balance_error": _balance_error(cycle),
        **{f"heat_{name}": float(total) for name, total in zip(TERMS, totals, strict=True)},
    }


def heat_extremes(cycle: Cycle) -> dict[str, float]:
    """Return what of a cycle's heat is largest over a run: the temperature, in K, and the balance's error."""
    if not cycle.records.heat.size:
        return {}
    return {"temperature": float(cycle.records.temperature.max()), "heat_balance_error": _balance_error(cycle)}


def _balance_error(cycle: Cycle) -> float:
    return max(balance_error(part.heat) for part in cycle.half_cycles)


def heat_summary(history: xarray.Dataset, extremes: Mapping[str, float]) -> dict[str, Any]:
    """Return the largest temperatures at the end of a run and over it; none without heat."""
    if "max_temperature" not in history:
        return {}
    degrees = degrees_in(history.max_temperature.attrs["units"])
    return {
        f"max_temperature_{degrees.unit}": float(history.max_temperature[-1]),
        f"{HOTTEST}_{degrees.unit}": extremes[HOTTEST] - degrees.zero,
    }
