"""What `fenwear validate` does: computes experiments, prints their numbers, and writes figures and validation.json."""

from __future__ import annotations

import io
import json
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from fenwear.common.parallel import on_root
from fenwear.common.stack import versions
from fenwear.report.style import COLOURS, Style, panels
from fenwear_verify.command import new_folder, write_results
from fenwear_verify.validation.experiment import Comparison, Experiment, Finding, Scope, experiments

DEFAULT, NUMBERS = Path("results") / "validation", "validation.json"
COLUMN = Style(85 / 25.4)  # as wide as a journal's column, inches
TWO_COLUMNS = 30  # letters: names of a line and of points that fit beside each other


def titles() -> dict[str, str]:
    """Return the names of the experiments with their titles."""
    return {one.name: one.title for one in experiments()}


def validate(
    names: Sequence[str], output: Path | None, say: Callable[[str], None], scope: Scope = "full"
) -> tuple[dict[str, Any], Path]:
    """Compute experiments, by default all; write a figure of each and validation.json; collective.

    Args:
        names: Of the experiments.
        output: New folder of the results; by default results/validation, or -2, -3, ...
        say: Called with the lines of each experiment.
        scope: "short" computes on coarse meshes.

    Returns:
        What validation.json holds, and the folder.

    Raises:
        CaseError: no experiment has such a name, or the folder is not empty or cannot be written.
    """
    asked = experiments(names)
    folder = on_root(MPI.COMM_WORLD, lambda: new_folder(output, DEFAULT))
    results = []
    for one in asked:
        begin = time.perf_counter()
        finding = one.compute(scope)
        seconds = time.perf_counter() - begin
        say("\n".join(lines(one, finding)))
        results.append({**as_json(one, finding), "seconds": round(seconds, 1)})
        on_root(MPI.COMM_WORLD, partial(_write_figure, finding, folder / f"{one.name}.png"))
    found = {"scope": scope, "versions": versions(), "experiments": results}
    on_root(MPI.COMM_WORLD, lambda: write_results(folder / NUMBERS, json.dumps(found, indent=2) + "\n"))
    return found, folder


def as_json(one: Experiment, finding: Finding) -> dict[str, Any]:
    """Return what validation.json holds of an experiment."""
    return {
        "name": one.name, "title": one.title, "source": one.source, "calibrated": one.calibrated,
        "number": finding.number, "percent": finding.percent if np.isfinite(finding.percent) else None,
        "comparisons": [c.as_json() for c in finding.comparisons], "predictions": finding.predictions,
    }  # fmt: skip


def lines(one: Experiment, finding: Finding) -> Iterator[str]:
    """Return what the screen shows of an experiment."""
    yield f"{one.name}: {one.title}"
    yield f"  {finding.number}"
    yield f"  {'':64}{'measured':>10}{'fenwear':>10}{'error':>9}{'± 2 u_val':>11}"
    for c in finding.comparisons:
        yield f"  {c.what:64}{c.measured:10.4g}{c.predicted:10.4g}{c.percent:+8.1f} %{_percent(c):>9}"
    for row in finding.predictions:
        yield "  " + "".join(f"{cell:>20}" for cell in row)


def markdown(one: Experiment, finding: Finding, picture: str) -> Iterator[str]:
    """Return the section of an experiment for the documentation, with the path of its picture."""
    yield f"**{finding.number[0].upper()}{finding.number[1:]}.**\n"
    yield f"![{one.title}: measured points and fenwear's curves]({picture})\n"
    parts = {
        "Source": one.source, "Measured": one.measured, "Given": one.given, "Calibrated": one.calibrated,
        "Predicted": one.predicted, "What the comparison says": one.verdict,
    }  # fmt: skip
    for name, text in parts.items():
        yield f"*{name}.* {text}\n"
    yield "| quantity | measured D | fenwear S | error E | 2 u_val | u_D, u_num, u_input |"
    yield "| --- | ---: | ---: | ---: | ---: | ---: |"
    for c in finding.comparisons:
        own = ", ".join("–" if not np.isfinite(u) or u == 0 else f"{u:.2g}" for u in (c.u_data, c.u_num, c.u_input))
        yield f"| {c.what} | {c.measured:.4g} | {c.predicted:.4g} | {c.percent:+.1f} % | {_percent(c)} | {own} |"
    yield ""
    if finding.predictions:
        heading, *rows = finding.predictions
        yield "| " + " | ".join(heading) + " |"
        yield "| " + " | ".join("---:" for _ in heading) + " |"
        yield from ("| " + " | ".join(row) + " |" for row in rows)
        yield ""


def _percent(c: Comparison) -> str:
    return f"{200 * c.u_val / abs(c.measured):.1f} %" if c.u_val > 0 else "–"


def draw(finding: Finding) -> bytes:
    """Return the figure of an experiment as a PNG: measured points with error bars, and predicted curves with bands."""
    from matplotlib.ticker import LogFormatter

    canvas, (ax,) = panels(1, 4.0, look=COLUMN)
    points = [curve for curve in finding.curves if curve.measured]
    lines = [curve for curve in finding.curves if not curve.measured]
    paired = 1 < len(points) <= len(lines)
    for k, curve in enumerate(lines):
        ax.plot(curve.x, curve.y, color=COLOURS[k], linewidth=1.3, label=curve.name)
        if len(curve.spread):
            below, above = np.broadcast_to(curve.spread, (2, len(curve.y)))
            ax.fill_between(curve.x, curve.y - below, curve.y + above, color=COLOURS[k], alpha=0.2, linewidth=0)
    for k, curve in enumerate(points):
        # Single points at one place stand beside each other.
        shift = 0.015 * (2 * k - len(points) + 1) * np.ptp(lines[0].x) if len(curve.x) == 1 else 0.0
        ax.errorbar(curve.x + shift, curve.y, curve.spread if len(curve.spread) else None, fmt="os^D"[k],
                    color=COLOURS[k] if paired else "0.25", markersize=4, capsize=3, markerfacecolor="none",
                    linewidth=0.9, label=curve.name, zorder=3)  # fmt: skip
    ax.set(xlabel=finding.axes[0], ylabel=finding.axes[1], xscale=finding.scales[0], yscale=finding.scales[1])
    if finding.scales[1] == "log":
        ax.yaxis.set_major_formatter(LogFormatter())
        ax.yaxis.set_minor_formatter(LogFormatter(minor_thresholds=(2, 1)))
    wide = sum(max(len(curve.name) for curve in some) for some in (lines, points)) > TWO_COLUMNS
    ax.legend(
        frameon=False, fontsize="small", loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=1 if wide else 2
    )  # fmt: skip
    buffer = io.BytesIO()
    canvas.savefig(buffer, format="png", dpi=220)
    return buffer.getvalue()


def _write_figure(finding: Finding, path: Path) -> None:
    write_results(path, draw(finding))
