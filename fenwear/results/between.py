"""What lies between the surfaces, in history.nc and summary.json: the third body and its balance, the plastic depth.

worn volume of both bodies + volume at the start = stored + ejected
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fenwear.arrays import Array
from fenwear.assembly import Placed
from fenwear.cycle import Block
from fenwear.layers.between import DEBRIS, PLASTIC

Variable = tuple[tuple[str, ...], str, str]  # dimensions, units, long name

OF_DEBRIS: dict[str, Variable] = {
    "debris_thickness": (("half_cycle", "x"), "mm", "thickness of the debris between the surfaces at the end"),
    "debris_volume": (("half_cycle",), "mm3", "volume of the debris between the surfaces at the end"),
    "ejected_volume": (("half_cycle",), "mm3", "volume of the debris ejected from the start"),
    "debris_balance_error": (("half_cycle",), "1", "worn volume that is neither stored nor ejected, over the worn one"),
}
OF_FLOW: dict[str, Variable] = {
    "plastic_depth": (("half_cycle", "x"), "mm", "depth that has flown beyond the hardness, apart from wear"),
    "plastic_volume": (("half_cycle",), "mm3", "volume that has flown beyond the hardness, apart from wear"),
}


def variables(placed: Placed) -> dict[str, Variable]:
    """Return the variables of what lies between the surfaces."""
    rows = placed.layers.rows
    return {**(OF_DEBRIS if DEBRIS[0] in rows else {}), **(OF_FLOW if PLASTIC in rows else {})}


def values(block: Block) -> dict[str, Array]:
    """Return them for each half-cycle of a block by name: (k,), and (k, n) along the contact."""
    system, rows = block.system, block.system.layers.rows
    areas = system.bodies.punch.thickness * system.pair.weights
    found: dict[str, Array] = {}
    if PLASTIC in rows:
        depth = block.between[:, rows.index(PLASTIC)]
        found = {"plastic_depth": depth, "plastic_volume": depth @ areas}
    if system.layers.debris is None:
        return found
    stored, ejected = (block.between[:, rows.index(name)] for name in DEBRIS)
    begun = float(areas.sum()) * system.layers.debris.initial
    fed = begun + sum(block.totals.of(f"volume_{body}") for body in ("punch", "strip"))
    return {
        **found,
        "debris_thickness": stored,
        "debris_volume": stored @ areas,
        "ejected_volume": ejected @ areas,
        "debris_balance_error": np.abs(fed - (stored + ejected) @ areas) / np.maximum(fed, 1e-300),
    }


def numbers(last: Block) -> dict[str, Any]:
    """Return the key numbers at the end of a run, for summary.json."""
    found = values(last)
    told: dict[str, Any] = {}
    if "plastic_volume" in found:
        told["plastic_volume_mm3"] = float(found["plastic_volume"][-1])
        told["largest_plastic_depth_mm"] = float(found["plastic_depth"][-1].max())
    if "debris_volume" not in found:
        return told
    return {
        **told,
        "debris_volume_mm3": float(found["debris_volume"][-1]),
        "ejected_volume_mm3": float(found["ejected_volume"][-1]),
        "largest_debris_thickness_mm": float(found["debris_thickness"][-1].max()),
        "debris_balance_error": float(found["debris_balance_error"][-1]),
    }
