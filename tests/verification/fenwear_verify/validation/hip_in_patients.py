"""Hips in patients: penetration of the head over ten years from the wear factor of flat pins."""

from __future__ import annotations

import numpy as np

from fenwear_verify.validation.experiment import Comparison, Curve, Finding, Scope, experiment, table
from fenwear_verify.validation.runs import history_of

PINS = 0  # row of the flat pins of GUR 1050 in the table of wear factors
# Standard uncertainties of the inputs as shares of the penetration, which goes with k N F / R; the pins' are measured.
DIAMETER = 0.10  # heads between 22 and 32 mm, all alike likely
ACTIVITY = 0.30  # cycles a year, judged
WEIGHT = 0.20  # load of walking, judged
SHORT = ("geometry.parameters.across=4", "geometry.parameters.around=3", "run.jump_tolerance=0.1")


@experiment(
    name="hip-in-patients",
    title="Hips in patients: penetration of the head over ten years",
    source="Penetration: Int. Orthop. 36 (2012) 485-490 (PMC3291767) and josr-online.com/content/8/1/20 (CC BY), "
    "abstracts. Wear factor: B. J. Hunt, T. J. Joyce, Lubricants 4 (2016) 25 (CC BY). A million cycles a year: V. "
    "Saikko, Wear 176 (1994) 207-212, whose abstract takes 4.1 mg in a million cycles as 5 µm a year.",
    measured="Cobalt chromium on conventional polyethylene. Ten years after the operation 0.96 mm (95 % interval of "
    "the mean 0.68 to 1.23), by radiostereometry; in 22 other patients 0.133 ± 0.045 mm a year.",
    given="Wear factor of flat pins of GUR 1050 in serum, 3.64 ± 0.39e-6 mm³/(N m), and a million cycles a year. The "
    "abstracts have no diameter of the heads: 28 mm is an assumption. Motion and load are those of the ready case "
    "ball-in-cup, a made cycle of walking with a peak of 1.96 kN. Standard uncertainties: 11 % from the pins, 10 % "
    "from the diameter, and, as a judgement, 30 % from the cycles a year and 20 % from the load.",
    calibrated="Nothing.",
    predicted="The largest worn depth of the cup after ten years. Measured penetrations hold the cup's creep, too.",
    verdict="Both means lie within 2 u_val, and the prediction is above both. Most of u_val is how much and how "
    "heavily patients walk: the comparison can show that the order of magnitude is right, not that the law is.",
)
def compare(scope: Scope) -> Finding:
    """Return the comparison with both studies."""
    measured, factors = table("hip_in_patients.csv"), table("polyethylene.csv")
    factor, deviation = factors["wear factor (1e-6 mm3/Nm)"][PINS], factors["deviation"][PINS]
    settings = [f"wear.punch.coefficient={1e-9 * factor} 1/MPa"]
    history, _ = history_of("hip_in_patients.toml", settings, SHORT, scope)
    years, depth = 1e-6 * history["half_cycle"].values, history["largest_depth"].values
    share = float(np.sqrt((deviation / factor) ** 2 + DIAMETER**2 + ACTIVITY**2 + WEIGHT**2))
    curves = [Curve("from the pins' wear factor", years, depth, share * depth)]
    comparisons = []
    for study, at, penetration, uncertainty, scatter in zip(*measured.values(), strict=True):
        bar = uncertainty if np.isnan(scatter) else scatter
        curves.append(Curve(f"study {study:.0f}", np.array([at]), np.array([penetration]), np.array([bar]), True))
        comparisons.append(
            Comparison(f"penetration after {at:.0f} years, study {study:.0f} (mm)", penetration, float(depth[-1]),
                       u_data=uncertainty, u_input=share * float(depth[-1]))
        )  # fmt: skip
    worst = max(comparisons, key=lambda c: abs(c.percent))
    return Finding(
        f"penetration {comparisons[0].percent:+.0f} and {comparisons[1].percent:+.0f} % from the two measured means; "
        f"2 u_val is {200 * worst.u_val / worst.measured:.0f} %",
        worst.percent, comparisons, ("years in service", "penetration (mm)"), curves,
    )  # fmt: skip
