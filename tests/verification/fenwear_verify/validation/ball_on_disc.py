"""Ball on disc, the interlaboratory tests behind ASTM G99: the scar's width from the worn volume."""

from __future__ import annotations

import numpy as np
import xarray as xr

from fenwear_verify.validation.experiment import Comparison, Curve, Finding, Scope, experiment, table
from fenwear_verify.validation.runs import history_of

RADIUS = 5.0  # of the ball, mm
WORK = 10.0 * 1e6  # load times sliding distance, N mm
DISCS = {  # settings of the disc's material
    "steel": (),
    "alumina": ("materials.disc.young=380 GPa", "materials.disc.poisson=0.22"),
}
SHORT = (
    "geometry.parameters.across=8", "geometry.degree=1", "output.uncertainty=false", "run.jump_tolerance=0.1",
)  # fmt: skip


@experiment(
    name="ball-on-disc",
    title="Ball on disc (ASTM G99): width of the ball's scar on discs of steel and alumina",
    source="Interlaboratory tests of VAMAS, as ASTM G99 cites them; not checked with the standard's own text.",
    measured="Means over the laboratories: scars of 2.11 ± 0.27 mm (steel disc) and 2.08 ± 0.35 mm (alumina disc).",
    given="Ball of 10 mm of steel 52100, 10 N, 0.1 m/s, 1,000 m, track of 32 mm, friction 0.60.",
    calibrated="One wear coefficient for each disc, from the worn volume: k = V / (F s).",
    predicted="Width of the scar at the end, and how it grows.",
    verdict="The width follows from the volume by geometry. A width is a weak measure: 13 % of it are 51 % of the "
    "volume, so that the scatter between laboratories is one of the wear coefficient.",
)
def compare(scope: Scope) -> Finding:
    """Return the comparison of both discs."""
    measured = table("ball_on_disc.csv")
    comparisons, curves = [], []
    for at, (disc, settings) in enumerate(DISCS.items()):
        width, deviation = measured["scar (mm)"][at], measured["scar deviation (mm)"][at]
        coefficient = 1e-3 * measured["volume (1e-3 mm3)"][at] / WORK
        history, _ = history_of("ball_on_disc.toml", [*settings, f"wear.punch.coefficient={coefficient}"], SHORT, scope)
        distance, scar = 1e-3 * history["sliding_distance"].values, history["scar_width"].values
        volume, u_num = float(history["worn_volume"][-1]), _half_node(history)
        cap = float(np.pi * scar[-1] ** 4 / (64 * RADIUS))
        # Volume goes with the fourth power of the width: what scatters in one scatters four times as much in the other.
        comparisons += [
            Comparison(f"width of the scar, {disc} disc (mm)", width, float(scar[-1]), deviation, u_num),
            Comparison(f"volume of the cap of that width, {disc} disc (mm³)", volume, cap),
        ]
        curves += [
            Curve(f"{disc} disc, measured", np.array([1000.0]), np.array([width]), np.array([deviation]), True),
            Curve(f"{disc} disc", distance, scar, np.full(len(scar), u_num)),
        ]
    percent = float(max((c.percent for c in comparisons[::2]), key=abs))
    scatter = 100 * measured["scar deviation (mm)"][0] / measured["scar (mm)"][0]
    return Finding(
        f"widths within {abs(percent):.1f} % of the measured means, whose scatter is {scatter:.0f} % in width and "
        f"{4 * scatter:.0f} % in volume",
        percent, comparisons, ("sliding distance (m)", "width of the scar (mm)"), curves,
    )  # fmt: skip


def _half_node(history: xr.Dataset) -> float:
    """Return the standard uncertainty of a width that the spacing of nodes leaves, mm: its edge lies between two."""
    x = np.unique(np.round(history["x"].values, 6))
    return float(np.diff(x).max() / np.sqrt(12) * np.sqrt(2))
