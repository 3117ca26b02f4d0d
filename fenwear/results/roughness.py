"""Roughness of worn surfaces in history.nc and summary.json: what a topography is, less what has worn off it.

Sa and Sq of ISO 25178 (Ra and Rq of ISO 4287 in the plane), of all within the convex hull of what has worn, its form
taken off: the polynomial of second order that is nearest by least squares, as a scar's own shape is no roughness.
Before anything has worn they are those of the whole grid.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from fenwear.bodies.contact_surface import ContactSurface
from fenwear.common.arrays import Array
from fenwear.results.history_surfaces import Column
from fenwear.results.quantity import BODIES, RECORD, InTable, Quantity
from fenwear.steps import Block
from fenwear.surfaces import ContactPair
from fenwear.system import Tribosystem

FEWEST = 8  # nodes along each axis of a place as large, below which the whole grid is taken
ON_HULL = 1e-9  # spacings: rounding
NAMES = {
    "roughness_Sa": ("mm", "mean distance of the {} from its mean and form (Sa) where it has worn, at the end"),
    "roughness_Sq": ("mm", "root mean square of the same heights (Sq) of the {}"),
}


def _rough(pair: ContactPair) -> dict[str, ContactSurface]:
    """Return the surfaces with a topography, by their bodies."""
    both = {"punch": pair.punch, "strip": pair.strip}
    return {body: surface for body, surface in both.items() if surface.grid is not None and surface.heights.any()}


def columns(system: Tribosystem) -> dict[str, Column]:
    """Return the topographies before anything has worn, by name."""
    plane = system.case.model.kind == "plane"
    return {
        f"topography{BODIES[body]}": Column(
            (f"{'x' if plane else 'node'}{BODIES[body]}",),
            np.asarray(surface.heights),
            {"units": "mm", "long_name": f"height of the unworn {body} over its smooth shape, out of it"},
        )
        for body, surface in _rough(system.pair).items()
        if body == "punch" or system.phases.strip_changes
    }


def quantities(system: Tribosystem) -> list[Quantity]:
    """Return the quantities of rough surfaces."""
    return [quantity for body in _rough(system.pair) for quantity in of_body(body)]


def of_body(body: str) -> list[Quantity]:
    """Return the quantities of a rough body."""
    table = partial(_values, body=body)
    return [
        Quantity(f"{name}{BODIES[body]}", RECORD, unit, text.format(body), InTable(table, name), of=body)
        for name, (unit, text) in NAMES.items()
    ]


def _values(block: Block, body: str) -> dict[str, Array]:
    """Return Sa and Sq of a body for each half-cycle of a block (k,)."""
    rows = np.array([sa_sq(worn_heights(block, body, k)) for k in range(len(block))]).reshape(-1, 2)
    return dict(zip(NAMES, rows.T, strict=True))


def sa_sq(z: Array) -> tuple[float, float]:
    """Return Sa and Sq of heights over their mean (n,), in their unit."""
    return float(np.abs(z).mean()), float(np.sqrt((z**2).mean()))


def worn_heights(block: Block, body: str, row: int) -> Array:
    """Return heights of a rough surface at the end of a half-cycle, without its form, mm, as `levelled`."""
    surface, depth = _rough(block.system.pair)[body], {"punch": block.wear, "strip": block.wear_strip}[body][row]
    assert surface.grid is not None
    return levelled(surface.grid.places, surface.heights - depth, depth > 0)


def evaluated(places: NDArray[np.int64], worn: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which nodes roughness is of (n,): within the convex hull of what has worn; all where that is next to none.

    Args:
        places: Of the nodes on their grid (n, axes).
        worn: Which nodes have worn (n,).
    """
    if worn.any():
        within = _within_hull(places, places[worn])
        if within.sum() >= FEWEST ** places.shape[1]:
            return within
    return np.ones(len(places), dtype=bool)


def levelled(places: NDArray[np.int64], heights: Array, worn: NDArray[np.bool_]) -> Array:
    """Return heights over their mean and form where they are `evaluated` (m,), mm.

    Args:
        places: Of the nodes on their grid (n, axes).
        heights: (n,), mm.
        worn: Which nodes have worn (n,).
    """
    chosen = evaluated(places, worn)
    x = 2.0 * (places[chosen] - places[chosen].mean(axis=0)) / np.maximum(np.ptp(places[chosen], axis=0), 1)
    powers = [x[:, k] for k in range(x.shape[1])]
    powers += [x[:, i] * x[:, j] for i in range(x.shape[1]) for j in range(i + 1)]
    form = np.column_stack([np.ones(len(x)), *powers])
    z = heights[chosen]
    return np.asarray(z - form @ np.linalg.lstsq(form, z)[0])


def _within_hull(places: NDArray[np.int64], worn: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which places lie within the convex hull of others (n,); of those on a line the rectangle around it."""
    low, high = worn.min(axis=0), worn.max(axis=0)
    within: NDArray[np.bool_] = ((places >= low) & (places <= high)).all(axis=1)
    if places.shape[1] == 1 or np.linalg.matrix_rank(worn - low) < places.shape[1]:
        return within
    from scipy.spatial import ConvexHull  # which takes long to load

    sides = ConvexHull(worn).equations
    within[within] = (places[within] @ sides[:, :-1].T + sides[:, -1] <= ON_HULL).all(axis=1)
    return within
