"""Block on ring: the shape of three worn blocks, from a coefficient that their worn areas give."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fenwear.studies import measured_folder
from fenwear_verify.validation.experiment import Comparison, Curve, Finding, Scope, experiment, root_mean_square
from fenwear_verify.validation.runs import area_below, history_of, uncertainty, widths

DISTANCE, LINE_LOAD = 3.6e6, 65 / 6  # mm, N/mm
OUTSIDE = 1.5  # beyond it the block is not worn, mm: the trace's zero is its mean there
LEVELS = (5.0, 20.0)  # um
MIDDLE = 0.25  # half of the part over which the depth is averaged, mm
SHORT = ("geometry.parameters.elements_along_contact=24",)


@experiment(
    name="block-on-ring",
    title="Block on ring, three tests: the shape of the worn block",
    source="A. Cruzado, A. Zabala, M. A. Urchegui, X. Gomez, Revista de Metalurgia 46 (2010) 106-114, Fig. 12; "
    "digitised by I. Llavori (LevelSetWear, BSD 3-Clause, Copyright (c) 2026 Inigo Llavori, Mondragon "
    "Unibertsitatea).",
    measured="Three worn profiles after 3,600 m, every 0.05 mm. The coefficients of the three tests scatter by 11 %.",
    given="65 N on 6 mm, ring of radius 20 mm, steel on steel, friction 0.65.",
    calibrated="One coefficient for each test, from its worn area alone: k = A / (P' s).",
    predicted="Widths at 5 and 20 µm, mean depth within 0.25 mm of the middle, and the profile.",
    verdict="The shape follows from the area. The measured scars are rough, and their widths differ by a few per cent.",
)
def compare(scope: Scope) -> Finding:
    """Return the comparison of the three shapes."""
    folder = measured_folder()
    comparisons, curves, misfits, depths = [], [], [], []
    for number in (1, 2, 3):
        measured = _trace(folder / f"block_on_ring_{number}.csv", f"test {number}")
        coefficient = 1e-3 * area_below(measured) / (LINE_LOAD * DISTANCE)
        settings = [f"wear.punch.coefficient={coefficient}"]
        history, summary = history_of(folder / "block_on_ring.toml", settings, SHORT, scope)
        x, height = history["x"].values, -1e3 * history["wear"].isel(half_cycle=-1).values
        u_num = 1e3 * uncertainty(summary, "punch", "largest_depth_mm")
        predicted = Curve(f"k = {1e9 * coefficient:.2f}e-9 mm²/N", x, height, np.full(len(x), u_num))
        middle = np.abs(measured.x) <= MIDDLE
        bottom = -measured.y[middle]
        depths.append(bottom.mean())
        misfits.append(predicted.misfit(measured))
        comparisons += widths(measured.name, measured, predicted, LEVELS)
        comparisons.append(
            Comparison(
                f"mean depth in the middle, {measured.name} (µm)", depths[-1],
                -float(predicted.at(measured.x[middle]).mean()),
                float(np.std(bottom) / np.sqrt(len(bottom))),  # of the mean of a rough bottom
                u_num,
            )
        )  # fmt: skip
        curves += [measured, predicted]
    misfit = root_mean_square(np.array(misfits))
    percent = 100 * misfit / float(np.mean(depths))
    return Finding(
        f"root mean square difference of the profiles {misfit:.1f} µm ({percent:.0f} % of the mean depth)",
        percent, comparisons, ("x (mm)", "height of the block (µm)"), curves,
    )  # fmt: skip


def _trace(path: Path, name: str) -> Curve:
    """Return the measured heights, µm, above the mean of the unworn surface on both sides."""
    rows = [line.split(",") for line in path.read_text("utf-8").splitlines() if line and line[0] in "-0123456789"]
    x, height = np.array(rows, dtype=float).T
    unworn = np.abs(x) >= OUTSIDE
    line = np.polyfit(x[unworn], height[unworn], 1)
    return Curve(name, x, height - np.polyval(line, x), measured=True)
