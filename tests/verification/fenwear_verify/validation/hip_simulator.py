"""A hip simulator: volume that a larger head wears off, from the rate of a smaller one."""

from __future__ import annotations

import numpy as np

from fenwear.common.arrays import Array
from fenwear_verify.validation.experiment import Comparison, Curve, Finding, Scope, experiment, table
from fenwear_verify.validation.runs import history_of

FIRST = 1e-9  # coefficient of the run that the calibration scales, mm²/N
PENALTY, DEVIATION = 7.5, 0.87  # published 6 to 9 % of wear for each mm of diameter: mean and standard deviation, %
SHORT = ("geometry.parameters.across=4", "geometry.parameters.around=3", "run.jump_tolerance=0.1")


@experiment(
    name="hip-simulator",
    title="Hip simulator: wear of polyethylene cups by the diameter of the head",
    source="Hip-simulator ranking of polyethylene wear: Comparisons between ceramic heads of different sizes. The "
    "abstract alone was at hand (scilit.com/publications/64289e6e6b72826d39a6324680edadad).",
    measured="Volumes lost in a million cycles: 23 mm³ with a head of 22 mm and up to 32 mm³ with 28 mm, precision 9 "
    "%. Each mm of diameter adds 6 to 9 % of wear.",
    given="Diameters, and a sinusoidal load with a peak of 2 kN. The abstract has neither motion nor clearance: "
    "rocking by 23° about two axes and 0.1 mm are assumptions, which are the same for both heads.",
    calibrated="One wear coefficient, on the volume of the head of 22 mm.",
    predicted="The volume of the head of 28 mm, and the wear that each mm of diameter adds.",
    verdict="Archard's law makes wear grow with the path, which grows with the diameter. Measured wear grows faster, "
    "between the diameter and its square. Wear that falls with the pressure would give that: a coefficient of the "
    "mean pressure (pm), or wear by the area of contact (per_area).",
)
def compare(scope: Scope) -> Finding:
    """Return the comparison of both heads."""
    measured = table("hip_simulator.csv")
    diameters, volumes, precision = (measured[key] for key in ("head diameter (mm)", "volume (mm3)", "precision"))
    small, large = diameters
    scale = volumes[0] / _volume(small, FIRST, scope)[1][-1]
    curves, ends = [], []
    for diameter, volume, share in zip(diameters, volumes, precision, strict=True):
        cycles, worn = _volume(diameter, scale * FIRST, scope)
        ends.append(float(worn[-1]))
        curves += [
            Curve(f"{diameter:g} mm, measured", np.array([1.0]), np.array([volume]), np.array([share * volume]), True),
            Curve(f"{diameter:g} mm", 1e-6 * cycles, worn, precision[0] * worn),
        ]
    penalty = 100 * (ends[1] / ends[0] - 1) / (large - small)
    comparisons = [
        Comparison(
            f"volume lost in 1e6 cycles, head of {large:g} mm (mm³)", volumes[1], ends[1],
            u_data=precision[1] * volumes[1], u_input=precision[0] * ends[1],
        ),
        Comparison("more wear for each mm of diameter (%)", PENALTY, penalty, u_data=DEVIATION),
    ]  # fmt: skip
    return Finding(
        f"volume of the larger head {comparisons[0].percent:+.0f} % from the measured one, whose precision is 9 %",
        comparisons[0].percent, comparisons, ("million cycles", "volume lost (mm³)"), curves,
    )  # fmt: skip


def _volume(diameter: float, coefficient: float, scope: Scope) -> tuple[Array, Array]:
    """Return cycles (n,) and the volumes lost until then (n,), mm³."""
    settings = [f"geometry.parameters.radius={diameter / 2} mm", f"wear.punch.coefficient={coefficient} 1/MPa"]
    history, _ = history_of("hip_simulator.toml", settings, SHORT, scope)
    return history["half_cycle"].values, history["worn_volume"].values
