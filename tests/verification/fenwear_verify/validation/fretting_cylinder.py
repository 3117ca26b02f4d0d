"""Fretting of a steel cylinder on a steel flat: the worn profile of the flat after 18,000 cycles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from fenwear_verify.validation.experiment import Comparison, Curve, Finding, Scope, experiment, table
from fenwear_verify.validation.runs import area_below, history_of, uncertainty, widths

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
    "that the authors measured, 1.9e-8 (cylinder) and 2.9e-8 1/MPa (flat).",
    calibrated="Nothing but the place of x = 0. A second run has both coefficients scaled to the measured worn area.",
    predicted="Profile, largest depth, and widths of the scar at five depths.",
    verdict="Archard's law with constant coefficients is within the digitised profile's own waviness. The measured "
    "scar is flatter in its middle and rougher; debris in the contact, which this run leaves out, would flatten it.",
)
def compare(scope: Scope) -> Finding:
    """Return the comparison of profile, depth and widths."""
    data = table("fretting_cylinder.csv")
    measured = Curve("measured", data["x (mm)"], data["height (um)"], measured=True)
    published = _profile("published coefficients", 1.0, scope)
    scale = area_below(measured) / area_below(published)
    curves, comparisons, misfits = [measured], [], []
    for profile in (published, _profile(f"coefficients times {scale:.2f}", scale, scope)):
        placed = _placed(profile, measured)
        curves.append(placed)
        misfits.append(placed.misfit(measured))
        comparisons.append(
            Comparison(f"largest depth, {profile.name} (µm)", -measured.y.min(), -profile.y.min(),
                       u_num=profile.spread[0])
        )  # fmt: skip
        comparisons += widths(profile.name, measured, profile, LEVELS)
    percent = -100 * misfits[0] / measured.y.min()
    return Finding(
        f"root mean square difference of the profile {misfits[0]:.2f} µm ({percent:.1f} % of its largest depth); "
        f"{misfits[1]:.2f} µm with the coefficients scaled to the worn area",
        percent, comparisons, ("x (mm)", "height of the flat (µm)"), curves,
    )  # fmt: skip


def _profile(name: str, scale: float, scope: Scope) -> Curve:
    """Return the worn flat, µm, with coefficients times a scale, and its numerical uncertainty."""
    settings = [f"wear.punch.coefficient={scale * FIRST}", f"wear.strip.coefficient={scale * SECOND}"]
    history, summary = history_of("fretting", settings, SHORT, scope)
    x = history["x_strip"].values
    height = -1e3 * history["wear_strip"].isel(half_cycle=-1).values
    return Curve(name, x, height, np.full(len(x), 1e3 * uncertainty(summary, "strip", "largest_depth_mm")))


def _placed(profile: Curve, measured: Curve) -> Curve:
    """Return the profile moved along x to where it fits the measured one best."""

    def moved(place: float) -> Curve:
        return replace(profile, x=profile.x + place)

    fit = minimize_scalar(lambda place: moved(place).misfit(measured), bounds=(-0.05, 0.05), method="bounded")
    return moved(float(fit.x))
