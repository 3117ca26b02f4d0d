"""The run of solids and rings as an animation, from its history alone: pressure and what is worn off the punch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray

from fenwear.report.figures import pressure_top
from fenwear.report.style import WIDTH, panels
from fenwear.report.surface import model_of, radial, surface_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.figure import Figure


class SurfaceFrames:
    """One figure whose maps, or lines over the radius of rings, change from frame to frame."""

    def __init__(self, history: xarray.Dataset, half_cycles: Sequence[int]) -> None:
        self.history = history
        self.figure: Figure
        limits = (pressure_top(history, half_cycles), max(1e3 * float(history.wear.max()), 1e-12))
        if model_of(history) == "solid":
            self._maps(limits)
        else:
            self._lines(limits)

    def _lines(self, limits: tuple[float, float]) -> None:
        self.figure, axes = panels(2, 2.6)
        x, label = radial(self.history)
        self._drawn: list[Any] = [ax.plot(x, 0 * x, color="0")[0] for ax in axes]
        for ax, name, top in zip(axes, ("contact pressure (MPa)", "worn depth (µm)"), limits, strict=True):
            ax.set_ylabel(name)
            ax.set_ylim(0, 1.05 * top)
            ax.margins(x=0.01)
        axes[-1].set_xlabel(label)
        self._title = axes[0].set_title(" ", loc="left")

    def _maps(self, limits: tuple[float, float]) -> None:
        from matplotlib.figure import Figure

        self._surface = surface_of(self.history)
        size = np.ptp(self._surface.map, axis=0)
        beside = size[0] < 2 * size[1]
        height = (WIDTH / 2 if beside else 2 * WIDTH) * min(size[1] / size[0], 2.0) + 1.2
        self.figure = Figure(figsize=(WIDTH, height), layout="constrained")
        axes = self.figure.subplots(*((1, 2) if beside else (2, 1)), sharex=True, sharey=True)
        triangles, values = self._surface.drawn(np.zeros(len(self._surface.x)))
        self._drawn = []
        named = ("contact pressure (MPa)", "YlGnBu"), ("worn depth of the punch (µm)", "YlOrBr")
        for ax, (name, colours), top in zip(axes, named, limits, strict=True):
            found = ax.tripcolor(triangles, values, shading="gouraud", cmap=colours, vmin=0, vmax=top)
            ax.set_aspect("equal")
            ax.set_xlabel(f"{self._surface.names[0]} (mm)")
            self.figure.colorbar(found, ax=ax, location="bottom", shrink=0.8, aspect=25).set_label(name)
            self._drawn.append(found)
        axes[0].set_ylabel(f"{self._surface.names[1]} (mm)")
        self._title = self.figure.suptitle(" ", x=0.01, ha="left", fontsize="medium")

    def show(self, half_cycle: int) -> None:
        """Show a half-cycle."""
        one = self.history.sel(half_cycle=half_cycle)
        values = one.pressure.values, 1e3 * one.wear.values
        for drawn, found in zip(self._drawn, values, strict=True):
            if model_of(self.history) == "solid":
                drawn.set_array(self._surface.drawn(found)[1])
            else:
                drawn.set_ydata(found)
        self._title.set_text(f"half-cycle {half_cycle:,} of {int(self.history.half_cycle[-1]):,}")
