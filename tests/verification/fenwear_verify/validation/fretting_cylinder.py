"""Fretting of a steel cylinder on a steel flat: the worn profile of the flat after 18,000 cycles."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from fenwear import load_case
from fenwear.arrays import Array
from fenwear_verify.validation.experiment import (
    Comparison,
    Curve,
    Finding,
    Scope,
    experiment,
    root_mean_square,
    table,
)
from fenwear_verify.validation.runs import area_below, history_of, width_below, with_settings

LEVELS = (0.5, 1.0, 1.5, 2.0, 2.5)  # depths at which the scar's width is compared, um
SHORT = (
    "geometry.parameters.elements_along_contact=24", "motion.positions=9",
)  # fmt: skip
FIRST, SECOND = 1.9e-8, 2.9e-8  # published coefficients of cylinder and flat, 1/MPa


@experiment(
    name="fretting-cylinder",
    title="Fretting in gross sliding, cylinder on flat: worn profile of the flat",
    source="I. R. McColl, J. Ding, S. B. Leen, Wear 256 (2004) 1114-1127; one profile, digitised from its figure.",
    measured="One worn profile of the flat after 18,000 cycles, 23 points. Its scatter between tests is not published.",
    given="Radius 6 mm, 18.5 N/mm, stroke ±25 µm, friction 0.9, Young's modulus 200 GPa, and the wear coefficients "
    "that "
    "the authors measured, 1.9e-8 (cylinder) and 2.9e-8 1/MPa (flat).",
    calibrated="Nothing but the place of x = 0. A second run has both coefficients scaled to the measured worn area.",
    predicted="Profile, largest depth, and widths of the scar at five depths.",
    verdict="Archard's law with constant coefficients is within the digitised profile's own waviness. The measured "
    "scar "
    "is flatter in its middle and rougher; debris in the contact, which this run leaves out, would flatten it.",
)
def compare(scope: Scope) -> Finding:
    """Return the comparison of profile, depth and widths."""
    measured = table("fretting_cylinder.csv")
    x, depth = measured["x (mm)"], -measured["height (um)"]
    plain = _profile(1.0, scope)
    scale = area_below(x, depth) / (1e3 * area_below(plain[0], plain[1]))
    fitted = _profile(scale, scope)
    curves = [Curve("measured", x, -depth, measured=True)]
    comparisons = []
    for name, (at, worn, spread), place in (
        ("published coefficients", plain, _shift(x, depth, *plain[:2])),
        (f"coefficients times {scale:.2f}", fitted, _shift(x, depth, *fitted[:2])),
    ):
        difference = 1e3 * np.interp(x - place, at, worn) - depth
        number = root_mean_square(difference)
        curves.append(Curve(name, at + place, -1e3 * worn, np.full(len(at), 1e3 * spread)))
        comparisons.append(Comparison(f"largest depth, {name} (µm)", depth.max(), 1e3 * worn.max(), u_num=1e3 * spread))
        comparisons += [
            Comparison(
                f"width at {level} µm, {name} (mm)", width_below(x, depth, level), width_below(at, 1e3 * worn, level)
            )
            for level in LEVELS
        ]
        if name.startswith("published"):
            first = number
    percent = 100 * first / depth.max()
    return Finding(
        f"root mean square difference of the profile {first:.2f} µm ({percent:.1f} % of its largest depth); "
        f"{number:.2f} µm with the coefficients scaled to the worn area",
        percent, comparisons, ("x (mm)", "height of the flat (µm)"), curves,
    )  # fmt: skip


def _profile(scale: float, scope: Scope) -> tuple[Array, Array, float]:
    """Return places (n,), depths of the flat (n,), mm, and the numerical uncertainty of the largest one, mm."""
    settings = [f"wear.punch.coefficient={scale * FIRST}", f"wear.strip.coefficient={scale * SECOND}"]
    history, summary = history_of(load_case("fretting", with_settings(settings, SHORT, scope)))
    return (
        history["x_strip"].values,
        history["wear_strip"].isel(half_cycle=-1).values,
        _uncertainty(summary, "strip"),
    )


def _uncertainty(summary: dict[str, Any], body: str) -> float:
    """Return the numerical uncertainty of the largest depth, mm; 0 where the run was not asked for it."""
    return float(summary.get("uncertainty", {}).get(body, {}).get("largest_depth_mm", 0.0))


def _shift(x: Array, depth: Array, at: Array, worn: Array) -> float:
    """Return where the prediction's middle lies on the measured trace, mm."""

    def missed(place: float) -> float:
        return root_mean_square(1e3 * np.interp(x - place, at, worn) - depth)

    return float(minimize_scalar(missed, bounds=(-0.05, 0.05), method="bounded").x)
