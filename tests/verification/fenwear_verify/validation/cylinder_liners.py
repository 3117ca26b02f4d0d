"""Wear in service: the later readings of two cylinder liners from their first ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.stats import t as student

from fenwear import load_case
from fenwear.arrays import Array
from fenwear_verify.validation.experiment import Comparison, Curve, Finding, Scope, experiment, percentage_error, table
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
    calibrated="One coefficient for each liner, on its first two readings. Its law is a "
    "coefficient that falls with the square root of the distance slid (running-in), beside a constant one (Archard). "
    "The square root was chosen with all eight readings in sight, so the error below is not a blind one.",
    predicted="The later two readings, with an interval of 95 %: the scatter of the four fitted readings about both "
    "curves "
    "(two degrees of freedom), and that of the coefficient. Other liners are predicted in the same way.",
    verdict="Constant coefficients overpredict the later readings: the liners run in. The square root is an "
    "assumption; a "
    "law with the distance slid, fitted to the first readings of many liners, would narrow the interval.",
)
def compare(scope: Scope) -> Finding:  # noqa: ARG001 (both scopes take a second)
    """Return the predicted later readings of both liners."""
    measured = table("cylinder_liners.csv")
    liners = [
        (measured["time (years)"][own], measured["depth (mm)"][own])
        for own in (measured["liner"] == 1, measured["liner"] == 2)
    ]
    comparisons, curves, rows = [], [], [("liner", "years", "predicted (mm)", "95 % from", "to", "measured (mm)")]
    later: dict[str, list[tuple[Array, Array]]] = {law: [] for law in LAWS}
    for law, coefficient in LAWS.items():
        time, depth = _unit_curve(coefficient)
        shapes = [np.interp(years, time, depth) for years, _ in liners]
        factors = [np.exp(np.mean(np.log(d[:FIRST] / s[:FIRST]))) for (_, d), s in zip(liners, shapes, strict=True)]
        missed = [np.log(f * s[:FIRST] / d[:FIRST]) for f, s, (_, d) in zip(factors, shapes, liners, strict=True)]
        free = len(liners) * (FIRST - 1)
        scatter = float(np.sqrt(np.sum(np.square(missed)) / free))
        wide = student.ppf(0.975, free) * scatter * np.sqrt(1 + 1 / FIRST)
        for number, ((years, measured_depth), shape, factor) in enumerate(zip(liners, shapes, factors, strict=True), 1):
            predicted = factor * shape
            later[law].append((predicted[FIRST:], measured_depth[FIRST:]))
            if law == "running-in":
                curves.append(Curve(f"liner {number}", years, measured_depth, measured=True))
                curves.append(
                    Curve(f"liner {number}, running-in", time, factor * depth, factor * depth * np.expm1(wide))
                )
                rows += [
                    (
                        str(number),
                        f"{y:.2f}",
                        f"{p:.2f}",
                        f"{p * np.exp(-wide):.2f}",
                        f"{p * np.exp(wide):.2f}",
                        f"{m:.2f}",
                    )
                    for y, p, m in zip(years[FIRST:], predicted[FIRST:], measured_depth[FIRST:], strict=True)
                ]
            comparisons += [
                Comparison(
                    f"liner {number} after {y:.2f} years, {law} (mm)", m, p, u_input=p * scatter * np.sqrt(1 / FIRST)
                )
                for y, p, m in zip(years[FIRST:], predicted[FIRST:], measured_depth[FIRST:], strict=True)
            ]
    errors = {
        law: percentage_error(np.concatenate([p for p, _ in found]), np.concatenate([m for _, m in found]))
        for law, found in later.items()
    }
    return Finding(
        f"root mean square error of the four later readings {errors['running-in']:.0f} % with running-in, "
        f"{errors['Archard']:.0f} % with a constant coefficient",
        errors["running-in"], comparisons, ("years in service", "worn depth (mm)"), curves, rows,
    )  # fmt: skip


def _unit_curve(coefficient: str) -> tuple[Array, Array]:
    """Return times (n,), years, and depths (n,), in an arbitrary unit, of a flat contact with this coefficient."""
    law = f'wear.punch.coefficient={{expression = "{coefficient}", unit = "1/MPa"}}'
    case = load_case(Path(__file__).with_name("cylinder_liners.toml"), [law])
    history, _ = history_of(case)
    return YEARS * history["half_cycle"].values / case.run.half_cycles, history["wear"].mean("x").values
