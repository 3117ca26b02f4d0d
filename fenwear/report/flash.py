"""The picture of flash temperatures: maps at the instant that is hottest, and their course over the cycle."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray

from fenwear.report.style import (
    BODY_COLOURS,
    STANDARD,
    Style,
    bar_place,
    colour_bar,
    from_zero,
    legend_beside,
    name_panel,
    panels,
    panels_of_maps,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BODIES = ("punch", "strip")


def flash_map(found: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw the rise of both surfaces at the instant at which one of them is hottest, and the edge of the contact."""
    first, second = found.pressure.dims[1:]
    at = _hottest(found)
    x, y = found[first].values, found[second].values
    figure, axes = panels_of_maps(1, 2, np.array([np.ptp(x), np.ptp(y)]), look)
    rises = [found[f"flash_{body}"].values[at].T for body in BODIES]
    low, high = min(rise.min() for rise in rises), max(rise.max() for rise in rises)
    drawn: Any = None
    for ax, body, rise in zip(axes.ravel(), BODIES, rises, strict=True):
        drawn = ax.pcolormesh(x, y, rise, cmap="YlOrRd", vmin=min(low, 0.0), vmax=high or 1.0, shading="nearest")
        touching = found.pressure.values[at].T > 0
        if touching.any() and not touching.all():
            ax.contour(x, y, touching, levels=[0.5], colors="black", linewidths=0.8)
        name_panel(ax, f"{body}\n≤ {rise.max():.3g} K")
        ax.set_xlabel(f"{first} (mm)")
    axes[0, 0].set_ylabel(f"{second} (mm)")
    colour_bar(figure, drawn, axes, "rise over the bulk (K)", **bar_place(look))
    return figure


def flash_course(found: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw the largest rise of both surfaces, and the mean of what touches, over the cycle."""
    figure, axes = panels(1, 3.0, look=look)
    touching = found.pressure.values > 0
    count = np.maximum(touching.sum(axis=(1, 2)), 1)
    for body in BODIES:
        rise = found[f"flash_{body}"].values
        mean = (rise * touching).sum(axis=(1, 2)) / count
        for values, line, words in ((rise.max(axis=(1, 2)), "-", "largest"), (mean, "--", "mean")):
            axes[0].plot(found.time.values, values, line, color=BODY_COLOURS[body], label=f"{body}: {words}")
    axes[0].set_xlabel("time from the cycle's begin (s)")
    axes[0].set_ylabel("rise over the bulk (K)")
    from_zero(axes[0])
    legend_beside(axes[0], "")
    return figure


def _hottest(found: xarray.Dataset) -> int:
    """Return the number of the instant at which a surface is hottest."""
    rise = np.maximum(found.flash_punch.values, found.flash_strip.values)
    return int(rise.max(axis=(1, 2)).argmax())


def figures(found: xarray.Dataset, look: Style = STANDARD) -> dict[str, Figure]:
    """Return all that is drawn of them, by name."""
    drawn = {"flash": flash_map(found, look)}
    if len(found.time) > 1:
        drawn["flash_course"] = flash_course(found, look)
    return drawn
