"""What lies between the surfaces, in history.nc and summary.json: the third body and its balance.

worn volume of both bodies + volume at the start = stored + ejected
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fenwear.arrays import Array
from fenwear.assembly import Placed
from fenwear.cycle import Block
from fenwear.layers.between import DEBRIS

Variable = tuple[tuple[str, ...], str, str]  # dimensions, units, long name

OF_DEBRIS: dict[str, Variable] = {
    "debris_thickness": (("half_cycle", "x"), "mm", "thickness of the debris between the surfaces at the end"),
    "debris_volume": (("half_cycle",), "mm3", "volume of the debris between the surfaces at the end"),
    "ejected_volume": (("half_cycle",), "mm3", "volume of the debris ejected from the start"),
    "debris_balance_error": (("half_cycle",), "1", "worn volume that is neither stored nor ejected, over the worn one"),
}


def variables(placed: Placed) -> dict[str, Variable]:
    """Return the variables of what lies between the surfaces."""
    return {} if placed.layers.debris is None else OF_DEBRIS


def values(block: Block) -> dict[str, Array]:
    """Return them for each half-cycle of a block by name: (k,), and (k, n) along the contact."""
    system, rows = block.system, block.system.layers.rows
    if system.layers.debris is None:
        return {}
    areas = system.bodies.punch.thickness * system.pair.weights
    stored, ejected = (block.between[:, rows.index(name)] for name in DEBRIS)
    begun = float(areas.sum()) * system.layers.debris.initial
    fed = begun + sum(block.totals.of(f"volume_{body}") for body in ("punch", "strip"))
    return {
        "debris_thickness": stored,
        "debris_volume": stored @ areas,
        "ejected_volume": ejected @ areas,
        "debris_balance_error": np.abs(fed - (stored + ejected) @ areas) / np.maximum(fed, 1e-300),
    }


def numbers(last: Block) -> dict[str, Any]:
    """Return the key numbers at the end of a run, for summary.json."""
    found = values(last)
    if not found:
        return {}
    return {
        "debris_volume_mm3": float(found["debris_volume"][-1]),
        "ejected_volume_mm3": float(found["ejected_volume"][-1]),
        "largest_debris_thickness_mm": float(found["debris_thickness"][-1].max()),
        "debris_balance_error": float(found["debris_balance_error"][-1]),
    }
