"""Runs of the gallery: from a case to its history and summary, without a trace on the disk."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from fenwear import read_history, run_case
from fenwear.arrays import Array
from fenwear.case import Case


def history_of(case: Case) -> tuple[xr.Dataset, dict[str, Any]]:
    """Return the history of a run, with its fields at the last half-cycles, and its summary; collective."""
    with tempfile.TemporaryDirectory() as folder:
        summary, place = run_case(case, output=Path(folder) / "run", log=lambda _: None, progress="none")
        return read_history(place).load(), summary


def width_below(x: Array, depth: Array, level: float) -> float:
    """Return the width of a profile (n,) where it is deeper than a level, mm: between its outermost crossings."""
    deep = np.flatnonzero(depth > level)
    if not len(deep):
        return 0.0
    first, last = deep[0], deep[-1]
    left = x[first] if first == 0 else np.interp(level, depth[[first - 1, first]], x[[first - 1, first]])
    right = x[last] if last == len(x) - 1 else np.interp(-level, -depth[[last, last + 1]], x[[last, last + 1]])
    return float(right - left)


def area_below(x: Array, depth: Array) -> float:
    """Return the area of a profile (n,), mm²: that above the surface counts negative."""
    return float(np.trapezoid(depth, x))


def with_settings(settings: Sequence[str], short: Sequence[str], scope: str) -> list[str]:
    """Return the settings of a run, with those of a coarser one where the scope is short."""
    return [*settings, *(short if scope == "short" else ())]
