"""Gaps between the parts of a contact in the plane, over which no line may be drawn.

A history of a contact whose parts lie apart has the part of each node (`part`, `part_strip`). Of rings parts are told
by their radii: both sides of a groove begin at the same one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import xarray
from numpy.typing import NDArray

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


def sides_of(history: xarray.Dataset) -> tuple[str, str] | None:
    """Return the names of two contacts at the same places, such as the sides of a groove; None of others."""
    gaps = gaps_of(history)
    names = history["contact"].attrs.get("flag_meanings", "").split() if "contact" in history else []
    return (names[0], names[1]) if len(names) == 2 and (gaps[:, 1] < gaps[:, 0]).any() else None


def parted(x: Array, values: Array, gaps: Array) -> tuple[Array, Array]:
    """Return places (n,) and values (..., n) with a place of no value in the middle of each gap (g, 2)."""
    at = _behind(x, gaps)
    middles = (x[at - 1] + x[at]) / 2
    return np.insert(x, at, middles), np.insert(np.asarray(values, dtype=float), at, np.nan, axis=-1)


def _behind(x: Array, gaps: Array) -> NDArray[np.int64]:
    """Return the numbers of the first places behind gaps (g, 2), of places (n,)."""
    if not len(gaps) or len(x) < 2:
        return np.zeros(0, dtype=np.int64)
    ends = np.stack([x[:-1], x[1:]], axis=1)
    same = np.abs(ends[:, None] - gaps).max(axis=2) <= NEAR * np.ptp(x)
    return 1 + np.flatnonzero(same.any(axis=1))


def part_lines(figures: Iterable[Figure], gaps: Array) -> None:
    """Break the lines of figures along the contact at gaps (g, 2); behind one that leads back they are dotted."""
    if not len(gaps):
        return
    back = gaps[gaps[:, 1] < gaps[:, 0]]
    lines = [(ax, line) for figure in figures for ax in figure.axes for line in ax.get_lines()]
    for ax, line in lines:
        x, y = (np.asarray(values) for values in line.get_data())
        if x.shape != y.shape or not np.issubdtype(x.dtype, np.number):
            continue
        first = next(iter(_behind(x, back)), len(x))
        line.set_data(*parted(x[:first], y[:first], gaps))
        if first < len(x):
            (other,) = ax.plot(*parted(x[first:], y[first:], gaps), ":", color=line.get_color())
            other.set(linewidth=line.get_linewidth(), zorder=line.get_zorder())
