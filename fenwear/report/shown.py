"""Which half-cycles of a run its figures show, and how far an axis of pressure reaches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import takewhile

import numpy as np
import xarray

from fenwear.arrays import Array
from fenwear.report.course import cycle_ends, late_pressures

EARLY = 3.0  # times the largest pressure of later states: what is beyond it has a panel of its own


def chosen_half_cycles(history: xarray.Dataset, wanted: Sequence[int] = ()) -> list[int]:
    """Return the recorded half-cycles nearest to the wanted ones, or six spread over the run."""
    recorded = history.half_cycle.values
    # Most of them beyond the end: they were chosen for a longer run.
    if 2 * sum(n <= recorded[-1] for n in wanted) <= len(wanted):
        wanted = [int(n) for n in np.unique(np.geomspace(1, recorded[-1], 6).round().astype(int))]
    return nearest_half_cycles(history, [*wanted, int(recorded[-1])])


def nearest_half_cycles(history: xarray.Dataset, wanted: Sequence[int]) -> list[int]:
    """Return the recorded half-cycles nearest to the wanted ones."""
    recorded = history.half_cycle.values
    return sorted({int(recorded[np.abs(recorded - n).argmin()]) for n in wanted})


def cycle_means(history: xarray.Dataset, half_cycles: Sequence[int]) -> dict[int, Array]:
    """Return mean pressures up to the ends of the cycles that the half-cycles belong to, by their last half-cycle."""
    if "pressure_sum" not in history:
        return {}
    ends = cycle_ends(history)
    own = np.searchsorted(ends, half_cycles)
    wanted = [int(n) for n in np.unique(ends[own[own < len(ends)]])]
    return dict(zip(wanted, late_pressures(history, wanted), strict=True)) if wanted else {}


def pressure_top(history: xarray.Dataset, half_cycles: Sequence[int]) -> float:
    """Return the upper end of an axis of pressure: the edges of a fresh flat punch peak far beyond all that follows."""
    late = float(history.pressure.sel(half_cycle=list(half_cycles[len(half_cycles) // 2 :])).max())
    return 1.15 * max(late, float(history.pressure.median("half_cycle").max()))


def early_half_cycles(history: xarray.Dataset, half_cycles: Sequence[int]) -> list[int]:
    """Return the first half-cycles whose pressures lie far beyond all later ones, as edges of flat punches do."""
    return early_of({n: history.pressure.sel(half_cycle=n).values for n in half_cycles})


def early_of(pressures: Mapping[int, Array]) -> list[int]:
    """Return the first half-cycles whose pressures lie far beyond all later ones."""
    peaks = {n: float(values.max()) for n, values in pressures.items()}
    late = max(list(peaks.values())[len(peaks) // 2 :])
    return list(takewhile(lambda n: peaks[n] > EARLY * late, list(peaks)[:-1]))
