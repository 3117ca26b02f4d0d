"""verification.html: the table of all comparisons and their plots on one page that needs nothing else."""

from __future__ import annotations

import io
import math
from collections import Counter
from collections.abc import Sequence
from datetime import datetime
from typing import TYPE_CHECKING

import numpy as np
from markupsafe import Markup

from fenwear.common.arrays import Array
from fenwear.report.page import Picture, picture, render
from fenwear.report.style import COLOURS, DASHES, panels
from fenwear_verify.suite import Line, Outcome, Plot

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLUMNS = ("what is compared", "reference", "fenwear", "error", "tolerance", "order", "")
MARKERS = "os^Dvx+"


def page(outcomes: Sequence[Outcome], beside_paper: Markup | None, ranks: int, versions: dict[str, str]) -> str:
    """Return the page of what the cases found, and of the comparison with the paper where there is one."""
    return render(
        "verification.html",
        title="Verification of fenwear",
        found=_found(outcomes),
        ranks=ranks,
        now=datetime.now().astimezone(),
        outcomes=outcomes,
        columns=COLUMNS,
        largest=_largest,
        drawn=_drawn,
        paper=beside_paper,
        versions=versions,
    )


def _found(outcomes: Sequence[Outcome]) -> str:
    if not outcomes:
        return ""
    found = Counter(outcome.verdict for outcome in outcomes)
    comparisons = sum(len(o.result.rows) for o in outcomes)
    return (
        f"Of {len(outcomes)} cases {found['agrees']} agree with exact solutions and published results, "
        f"{found['differs']} differ and {found['not run']} were not run; {comparisons} comparisons in all, in "
        f"{sum(o.seconds for o in outcomes):.0f} s. "
    )


def _largest(outcome: Outcome) -> str:
    ratios = [row.error / row.tolerance if row.tolerance else row.error for row in outcome.result.rows]
    return f"{max(ratios):.2g}" if ratios else "–"


def _drawn(plot: Plot) -> Picture:
    alt = f"{plot.title}: {plot.y_label} over {plot.x_label}, lines {', '.join(line.name for line in plot.lines)}."
    return picture(draw(plot), "png", plot.title, alt)


def draw(plot: Plot) -> bytes:
    """Return a plot as a PNG: lines for references, markers for fenwear's values."""
    canvas, (ax,) = panels(1, 3.6)
    ours = 0
    for line in plot.lines:
        if line.reference:
            ax.plot(line.x, line.y, color="0.45", linewidth=1.0, zorder=1)
            continue
        colour, marker = COLOURS[ours % len(COLOURS)], MARKERS[ours % len(MARKERS)]
        joined = DASHES[ours % len(DASHES)] if plot.orders else "none"
        # Every other one hollow and larger, so that markers on the same spot both show.
        size, face = (5.5, "none") if ours % 2 else (3.0, colour)
        ax.plot(line.x, line.y, marker=marker, markersize=size, markerfacecolor=face, linestyle=joined, linewidth=0.9,
                color=colour, label=line.name, zorder=2)  # fmt: skip
        ours += 1
    references = [line.name for line in plot.lines if line.reference]
    if references:
        ax.plot([], [], color="0.45", linewidth=1.0, label=references[0] if len(references) == 1 else "reference")
    ax.set(xlabel=plot.x_label, ylabel=plot.y_label, xscale=plot.scales[0], yscale=plot.scales[1])
    measured = [line for line in plot.lines if not line.reference]
    for line, order in zip(measured, plot.orders, strict=bool(plot.orders)):
        _slope_triangle(ax, line, order)
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize="small")
    buffer = io.BytesIO()
    canvas.savefig(buffer, format="png", dpi=110)
    return buffer.getvalue()


def _slope_triangle(ax: Axes, line: Line, order: float) -> None:
    """Draw the slope of the theory's order below the last refinement of a line."""
    (x1, y1), (x0, y0) = _last_two(line.x, line.y)
    width = (x1 / x0) ** 0.5
    left, low = math.sqrt(x0 * x1) / math.sqrt(width), math.sqrt(y0 * y1) / width ** (order / 2) / 2.2
    right, high = left * width, low * width**order
    ax.plot([left, right, right, left], [low, low, high, low], color="0.6", linewidth=0.8, zorder=0)
    ax.annotate(f"{order:g}", (right, math.sqrt(low * high)), xytext=(3, 0), textcoords="offset points", va="center",
                color="0.4", fontsize="x-small")  # fmt: skip


def _last_two(x: Array, y: Array) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the two points of a line with the smallest x, the larger one first."""
    small, next_one = np.argsort(x)[:2]
    return (float(x[next_one]), float(y[next_one])), (float(x[small]), float(y[small]))
