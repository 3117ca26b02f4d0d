"""The run of a solid as an animation, from its history alone: maps of pressure and of what is worn off the punch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray

from fenwear.report.shown import pressure_top
from fenwear.report.style import colour_bar, panels_of_maps
from fenwear.report.surface import surface_of

if TYPE_CHECKING:
    from collections.abc import Sequence


class MapFrames:
    """One figure whose maps change from frame to frame."""

    def __init__(self, history: xarray.Dataset, half_cycles: Sequence[int]) -> None:
        self.history = history
        self._surface = surface_of(history)
        size = np.ptp(self._surface.map, axis=0)
        beside = size[0] < 2 * size[1]
        self.figure, axes = panels_of_maps(*((1, 2) if beside else (2, 1)), size)
        triangles, values = self._surface.drawn(np.zeros(len(self._surface.x)))
        self._drawn: list[Any] = []
        named = ("contact pressure (MPa)", "YlGnBu"), ("worn depth of the punch (µm)", "YlOrBr")
        limits = (pressure_top(history, half_cycles), max(1e3 * float(history.wear.max()), 1e-12))
        for ax, (name, colours), top in zip(axes.ravel(), named, limits, strict=True):
            found = ax.tripcolor(triangles, values, shading="gouraud", cmap=colours, vmin=0, vmax=top)
            self._surface.set_ticks(ax)
            ax.set_xlabel(self._surface.axis_labels[0])
            colour_bar(self.figure, found, ax, name, location="bottom", shrink=0.8, aspect=25)
            self._drawn.append(found)
        axes[0, 0].set_ylabel(self._surface.axis_labels[1])
        self._title = self.figure.suptitle(" ", x=0.01, ha="left", fontsize="medium")

    def show(self, half_cycle: int) -> None:
        """Show a half-cycle."""
        one = self.history.sel(half_cycle=half_cycle)
        for drawn, found in zip(self._drawn, (one.pressure.values, 1e3 * one.wear.values), strict=True):
            drawn.set_array(self._surface.drawn(found)[1])
        self._title.set_text(f"half-cycle {half_cycle:,} of {int(self.history.half_cycle[-1]):,}")
