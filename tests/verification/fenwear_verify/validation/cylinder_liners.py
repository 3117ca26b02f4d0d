"""Wear in service: the later readings of two cylinder liners from their first ones."""

from __future__ import annotations

import numpy as np
from scipy.stats import t as student

from fenwear_verify.validation.experiment import (
    Comparison,
    Curve,
    Finding,
    Scope,
    between_factors,
    experiment,
    percentage_error,
    table,
)
from fenwear_verify.validation.runs import history_of

FIRST = 2  # readings of each liner that its coefficient is fitted to
YEARS = 8.0
LAWS = {"running-in": "1e-6*(1 + s/100)**-0.5", "Archard": "1e-6"}  # coefficient by distance slid s, mm


@experiment(
    name="cylinder-liners",
    title="Wear in service: two cylinder liners of a ship's engine",
    source="M. Giorgio, M. Guida, G. Pulcini: 64 readings of 32 liners over years; two of the liners are given.",
    measured="Wear depths at four times of each liner. No scatter of a reading is published.",
    given="Times of the readings. Pressure and speed are not published: they are held constant.",
    calibrated="One coefficient for each liner, on its first two readings. Its law is a coefficient that falls with "
    "the square root of the distance slid (running-in), beside a constant one (Archard). The square root was chosen "
    "with all eight readings in sight, so the error below is not a blind one.",
    predicted="The later two readings, with an interval of 95 %: the scatter of the four fitted readings about both "
    "curves (two degrees of freedom), and that of the coefficient. Other liners are predicted in the same way.",
    verdict="Constant coefficients overpredict the later readings: the liners run in. The square root is an "
    "assumption; a law with the distance slid, fitted to the first readings of many liners, would narrow the "
    "interval.",
)
def compare(scope: Scope) -> Finding:
    """Return the predicted later readings of both liners."""
    data = table("cylinder_liners.csv")
    liners = [
        Curve(f"liner {number}", data["time (years)"][own], data["depth (mm)"][own], measured=True)
        for number, own in ((1, data["liner"] == 1), (2, data["liner"] == 2))
    ]
    comparisons, curves, rows = [], [], [("liner", "years", "predicted (mm)", "95 % from", "to", "measured (mm)")]
    errors = {}
    for law, coefficient in LAWS.items():
        shape = _shape(coefficient, scope)
        ratios = [np.log(liner.y[:FIRST] / shape.at(liner.x[:FIRST])) for liner in liners]
        free = len(liners) * (FIRST - 1)
        scatter = float(np.sqrt(sum(np.sum((r - r.mean()) ** 2) for r in ratios) / free))
        wide = np.exp(student.ppf(0.975, free) * scatter * np.sqrt(1 + 1 / FIRST))
        of_law = []
        for liner, ratio in zip(liners, ratios, strict=True):
            depth = np.exp(ratio.mean()) * shape.y
            predicted = Curve(f"{liner.name}, {law}", shape.x, depth, between_factors(depth, wide))
            later = list(zip(liner.x[FIRST:], predicted.at(liner.x[FIRST:]), liner.y[FIRST:], strict=True))
            of_law += [
                Comparison(
                    f"{liner.name} after {year:.2f} years, {law} (mm)", d, s, u_input=s * scatter / np.sqrt(FIRST)
                )
                for year, s, d in later
            ]
            if law == "running-in":
                curves += [liner, predicted]
                rows += [
                    (liner.name[-1], f"{year:.2f}", f"{s:.2f}", f"{s / wide:.2f}", f"{s * wide:.2f}", f"{d:.2f}")
                    for year, s, d in later
                ]
        errors[law] = percentage_error(np.array([c.predicted for c in of_law]), np.array([c.measured for c in of_law]))
        comparisons += of_law
    return Finding(
        f"root mean square error of the four later readings {errors['running-in']:.0f} % with running-in, "
        f"{errors['Archard']:.0f} % with a constant coefficient",
        errors["running-in"], comparisons, ("years in service", "worn depth (mm)"), curves, rows,
    )  # fmt: skip


def _shape(coefficient: str, scope: Scope) -> Curve:
    """Return the depth over years, in an arbitrary unit, of a flat contact with this coefficient."""
    law = f'wear.punch.coefficient={{expression = "{coefficient}", unit = "1/MPa"}}'
    history, _ = history_of("cylinder_liners.toml", [law], (), scope)
    cycles = history["half_cycle"].values
    return Curve(coefficient, YEARS * cycles / cycles[-1], history["wear"].mean("x").values)
