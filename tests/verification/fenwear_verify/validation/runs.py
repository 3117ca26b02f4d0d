"""Runs of the gallery, and measures of a profile that several experiments compare."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from fenwear import load_case, read_history, run_case
from fenwear.case import Case
from fenwear_verify.validation.experiment import Comparison, Curve, Scope

HERE = Path(__file__).parent


def case_of(name: str | Path, settings: Sequence[str], short: Sequence[str], scope: Scope) -> Case:
    """Return a case with settings, after those of a coarser one where the scope is short.

    Args:
        name: A file beside this module, a path, or a ready case.
        settings: As `--set` takes them.
        short: Settings of the coarser case.
        scope: Of the computation.
    """
    place = HERE / name if Path(name).suffix else str(name)
    return load_case(place, [*(short if scope == "short" else ()), *settings])


def history_of(
    name: str | Path, settings: Sequence[str], short: Sequence[str], scope: Scope
) -> tuple[xr.Dataset, dict[str, Any]]:
    """Return the history of a run, with its fields at the last half-cycles, and its summary; collective."""
    case = case_of(name, settings, short, scope)
    with tempfile.TemporaryDirectory() as folder:
        summary, place = run_case(case, output=Path(folder) / "run", log=lambda _: None, progress="none")
        return read_history(place).load(), summary


def uncertainty(summary: dict[str, Any], *path: str) -> float:
    """Return the numerical uncertainty of a quantity in its unit; 0 where the run was not asked for it."""
    found: Any = summary.get("uncertainty", {})
    for name in path:
        found = found.get(name, {})
    return float(found or 0.0)


def area_below(profile: Curve) -> float:
    """Return the area of a profile of heights, mm µm, below the surface: that above it counts negative."""
    return -float(np.trapezoid(profile.y, profile.x))


def widths(name: str, measured: Curve, predicted: Curve, levels: Sequence[float]) -> list[Comparison]:
    """Return the comparisons of both profiles' widths at depths, µm."""
    return [
        Comparison(f"width at {level:g} µm, {name} (mm)", _width(measured, level), _width(predicted, level))
        for level in levels
    ]


def _width(profile: Curve, level: float) -> float:
    """Return the width of a profile of heights where it is deeper than a level, mm: between its outermost crossings."""
    x, depth = profile.x, -profile.y
    deep = np.flatnonzero(depth > level)
    if not len(deep):
        return 0.0
    first, last = deep[0], deep[-1]
    left = x[first] if first == 0 else np.interp(level, depth[[first - 1, first]], x[[first - 1, first]])
    right = x[last] if last == len(x) - 1 else np.interp(-level, -depth[[last, last + 1]], x[[last, last + 1]])
    return float(right - left)
