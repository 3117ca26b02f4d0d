"""Distance of a contact from Signorini's conditions p >= 0, gap >= 0, p gap = 0, measured apart from its solver.

Balances of force, volume and energy hold where these do not: a body pressed into the other one carries its load, too.
The error of a node is abs(min(p / P, gap / G)), which is zero where all three conditions hold and nowhere else; the
scales are P, the largest pressure, and G, the gap that this pressure opens elastically, were it everywhere.
"""

from __future__ import annotations

import numpy as np

from fenwear.common.arrays import Array

BROKEN = 1e-3  # above which the conditions do not hold; solvers leave 1e-8, the coupling with heat 1e-5


def complementarity_error(pressure: Array, gap: Array, elastic_length: float) -> Array:
    """Return the largest error of contacts (...).

    Args:
        pressure: p (..., n), MPa.
        gap: (..., n), mm.
        elastic_length: Gap that unit pressures open on average without any rigid motion, mm/MPa.
    """
    scale = np.maximum(np.abs(pressure).max(axis=-1, keepdims=True), 1e-300)
    return np.abs(np.minimum(pressure / scale, gap / (elastic_length * scale))).max(axis=-1)
