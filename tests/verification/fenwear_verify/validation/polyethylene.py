"""Polyethylene against cobalt chromium: wear of a knee-like ball contact from the wear factor of flat pins."""

from __future__ import annotations

import numpy as np

from fenwear_verify.validation.experiment import Comparison, Curve, Finding, Scope, experiment, table
from fenwear_verify.validation.runs import history_of

GRADES = {"GUR 1050": 0, "GUR 1020": 1}
BALL = 2  # row of the ball contact
MASS_RATE, DENSITY = 0.35, 0.935  # mg in a million cycles; mg/mm³
LOAD, SPEED = 9.0, 10.0  # of the case, N and mm/s
SHORT = ("geometry.parameters.across=6", "geometry.degree=1", "output.uncertainty=false", "run.jump_tolerance=0.1")


@experiment(
    name="polyethylene",
    title="Polyethylene of joint implants: wear of a ball contact from the wear factor of flat pins",
    source="Flat pins: B. J. Hunt, T. J. Joyce, Lubricants 4 (2016) 25 (CC BY). Ball on flat: V. Saikko, Polymer "
    "Testing 60 (2017) 149-152, abstract.",
    measured="Ball of 28 mm radius of cobalt chromium on a flat of polyethylene, in serum, on a path that crosses "
    "itself: 0.35 mg in a million cycles, which is a wear factor of 3.5e-6 mm³/(N m). Its scatter is not in the "
    "abstract.",
    given="Mass rate and wear factor together give the load times the path of a cycle, 0.107 N m. Flat pins of two "
    "grades wear by 3.64 ± 0.39 and 3.92 ± 0.55e-6 mm³/(N m) under crossing paths.",
    calibrated="Nothing on the ball contact: the coefficient is that of flat pins at 1 to 2 MPa.",
    predicted="Mass that the ball contact loses in a million cycles, for each grade, with the scatter of the pins.",
    verdict="A wear factor carries over from flat pins to a ball where both have crossing paths. Under one direction "
    "of sliding polyethylene wears much less: a coefficient of the cross-shear ratio (cs) says so.",
)
def compare(scope: Scope) -> Finding:
    """Return the comparison of both grades."""
    measured = table("polyethylene.csv")
    factors, deviations = measured["wear factor (1e-6 mm3/Nm)"], measured["deviation"]
    work = MASS_RATE / DENSITY / factors[BALL] * 1e3  # load times path of a cycle, N mm
    comparisons, curves = [], [Curve("measured", np.array([1.0]), np.array([MASS_RATE]), measured=True)]
    for grade, row in GRADES.items():
        settings = [f"wear.punch.coefficient={factors[row] * 1e-9}", f"motion.duration={work / LOAD / SPEED} s"]
        history, _ = history_of("polyethylene.toml", settings, SHORT, scope)
        mass = DENSITY * history["worn_volume"].values
        spread = deviations[row] / factors[row] * mass
        curves.append(Curve(f"from {grade} pins", 1e-6 * history["half_cycle"].values, mass, spread))
        comparisons.append(
            Comparison(f"mass lost in 1e6 cycles, from {grade} pins (mg)", MASS_RATE, mass[-1], u_input=spread[-1])
        )
    worst = max(comparisons, key=lambda c: abs(c.percent))
    pins = list(GRADES.values())
    return Finding(
        f"mass within {abs(worst.percent):.0f} %, within the scatter of the pins "
        f"({100 * np.max(deviations[pins] / factors[pins]):.0f} %)",
        worst.percent, comparisons, ("million cycles", "mass lost (mg)"), curves,
    )  # fmt: skip
