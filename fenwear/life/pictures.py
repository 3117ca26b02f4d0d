"""Pictures of sensitivities, calibrations and lives."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fenwear.life.calibrate import Calibration
from fenwear.life.lifetime import Lifetime
from fenwear.life.quantities import unit_of
from fenwear.life.sensitivity import Sensitivity
from fenwear.report.style import BLUE, GREY, RED, panels, reference_line
from fenwear.results.disk import writing

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DECADE = 10.0


def tornado(sensitivities: Sequence[Sensitivity]) -> Figure:
    """Return a panel for each quantity: its values with each key smaller and larger, the most influential on top."""
    most = max(len(one.derivatives) for one in sensitivities)
    figure, axes = panels(len(sensitivities), 0.9 + 0.35 * most, share_x=False)
    for ax, one in zip(axes, sensitivities, strict=True):
        rows = one.ranked()[::-1]
        for height, row in enumerate(rows):
            for end, colour, name in ((row.low, BLUE, "smaller"), (row.high, RED, "larger")):
                if np.isfinite(end):
                    label = f"key {100 * one.spread:g} % {name}" if height == len(rows) - 1 else None
                    ax.barh(height, end - one.value, left=one.value, color=colour, height=0.7, label=label)
        ax.set_yticks(range(len(rows)), [row.key for row in rows])
        ax.axvline(one.value, color=GREY, linewidth=0.8)
        ax.set_xlabel(f"{one.quantity} ({one.unit or '-'})")
        if ax.get_legend_handles_labels()[0]:
            ax.legend(frameon=False)
    return figure


def residuals(calibration: Calibration) -> Figure:
    """Return two panels for each series: measured and fitted, and their difference."""
    traces = calibration.traces
    figure, axes = panels(2 * len(traces), 2.0, share_x=False)
    for k, trace in enumerate(traces):
        fit, rest = axes[2 * k : 2 * k + 2]
        series = trace.series
        factor, unit = (1e3, "µm") if unit_of(series.quantity) == "mm" else (1.0, unit_of(series.quantity) or "-")
        x = series.after if series.x is None else series.x
        order = np.argsort(x, kind="stable")
        fit.plot(x, factor * series.values, ".", color=GREY, markersize=3, label="measured")
        fit.plot(x[order], factor * trace.predicted[order], color=BLUE, label="fitted")
        fit.set_title(trace.name)
        fit.set_ylabel(f"{series.quantity} ({unit})")
        fit.legend(frameon=False)
        rest.plot(x[order], factor * trace.residual[order], color=RED, linewidth=0.8)
        reference_line(rest, 0.0, "")
        rest.set_ylabel(f"fitted - measured ({unit})")
        counted = {"cycles": "cycles", "distance": "sliding distance (mm)", "time": "time (s)"}[series.counted]
        rest.set_xlabel(counted if series.x is None else "x (mm)")
    return figure


def _label_places(ax: Axes) -> None:
    """Label a logarithmic axis of less than a decade by few numbers: powers of ten would stand on each other."""
    from matplotlib.ticker import MaxNLocator, NullLocator, ScalarFormatter  # which takes long to load

    low, high = ax.get_xlim()
    if high < DECADE * low:
        ax.xaxis.set_major_locator(MaxNLocator(6))
        ax.xaxis.set_major_formatter(ScalarFormatter(useMathText=True))
        ax.xaxis.set_minor_locator(NullLocator())


def life_figure(life: Lifetime) -> Figure:
    """Return the distribution of the lives."""
    figure, axes = panels(1, 3.0, share_x=False)
    known = np.sort(life.lives[~np.isnan(life.lives)])
    share = np.arange(1, len(known) + 1) / len(known)
    finite = np.isfinite(known)
    axes[0].step(known[finite], share[finite], where="post", color=BLUE)
    for own, style in zip(life.each, itertools.cycle(("--", ":", "-.")), strict=False):
        alone = np.sort(own.lives[np.isfinite(own.lives)])
        height = np.arange(1, len(alone) + 1) / len(known)
        axes[0].step(alone, height, where="post", color=GREY, linestyle=style, label=own.quantity)
    if life.each:
        axes[0].lines[0].set_label("the first")
        axes[0].legend(frameon=False)
    for one in life.quantiles:
        if np.isfinite(one.value) and np.isfinite(one.high):
            axes[0].plot([one.low, one.high], [one.level, one.level], color=RED, linewidth=1.5)
    axes[0].set_xscale("log")
    _label_places(axes[0])
    axes[0].set_xlabel(f"{life.quantity} ({life.unit or 'cycles'})")
    axes[0].set_ylabel("share that has failed")
    axes[0].set_title("95 % intervals of the quantiles in red")
    return figure


def save(figure: Figure, path: Path) -> None:
    """Write a figure.

    Raises:
        OutputError: it cannot be written.
    """
    with writing(path):
        figure.savefig(path, dpi=150)
