"""Gaps between the parts of a contact in the plane, over which no line may be drawn.

A history of a contact whose parts lie apart has the part of each node (`part`, `part_strip`). Of rings parts are told
by their radii: both sides of a groove begin at the same one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import xarray

from fenwear.arrays import Array

if TYPE_CHECKING:
    from collections.abc import Iterable

    from matplotlib.figure import Figure

NEAR = 1e-9  # of the contact's length: places are the same
BACK = 0.5  # of it: where radii begin anew


def gaps_of(history: xarray.Dataset) -> Array:
    """Return the last place before and the first place after each gap of both surfaces (g, 2), mm."""
    found: list[Array] = [np.zeros((0, 2))]
    for end in ("", "_strip"):
        if f"part{end}" in history and f"x{end}" in history:
            x: Array = history[f"x{end}"].values
            at = np.flatnonzero(np.diff(history[f"part{end}"].values))
        elif f"r{end}" in history:
            x = history[f"r{end}"].values
            at = np.flatnonzero(np.diff(x) < -BACK * max(float(np.ptp(x)), 1e-300))
        else:
            continue
        found.append(np.stack([x[at], x[at + 1]], axis=1))
    return np.unique(np.concatenate(found), axis=0)


def parted(x: Array, values: Array, gaps: Array) -> tuple[Array, Array]:
    """Return places (n,) and values (..., n) with a place of no value in the middle of each gap (g, 2)."""
    if not len(gaps) or len(x) < 2:
        return x, values
    near = NEAR * np.ptp(x)
    ends = np.stack([x[:-1], x[1:]], axis=1)
    same = np.abs(ends[:, None] - gaps).max(axis=2) <= near
    at = 1 + np.flatnonzero(same.any(axis=1))
    middles = ends[at - 1].mean(axis=1)
    return np.insert(x, at, middles), np.insert(np.asarray(values, dtype=float), at, np.nan, axis=-1)


def part_lines(figures: Iterable[Figure], gaps: Array) -> None:
    """Break the lines of figures along the contact where there are gaps (g, 2)."""
    if not len(gaps):
        return
    for line in (line for figure in figures for ax in figure.axes for line in ax.get_lines()):
        x, y = (np.asarray(values) for values in line.get_data())
        if x.shape == y.shape and np.issubdtype(x.dtype, np.number):
            line.set_data(*parted(x, y, gaps))
