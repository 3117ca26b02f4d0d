"""Sliding metal wear at three loads: growth of the scar's width with cycles and load."""

from __future__ import annotations

import csv
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.stats import t as student

from fenwear.case import Case
from fenwear.common.arrays import Array
from fenwear.studies import calibrate, read_data
from fenwear.studies.model import Model
from fenwear.studies.numeric_keys import parse_unknown
from fenwear.studies.predictor import Predictor
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
from fenwear_verify.validation.runs import case_of

GRAVITY = 9.80665e-3  # N/g
LOADS = (10, 100)  # g
KEPT = 50  # g: its measured values are kept apart
SHARE = 0.1  # of a width: the standard deviation given to each, the same for all
LENGTH = 10.0  # of the contact line, mm: not published, without a part in exponents and ratios
SHORT = ("geometry.parameters.elements_along_contact=24",)


@experiment(
    name="sliding-metal",
    title="Sliding metal wear at three loads: width of the scar over the cycles",
    source="W. Q. Meeker, L. A. Escobar, Statistical Methods for Reliability Data, Wiley (1998); means of four "
    "specimens.",
    measured="Widths of scars after eight numbers of cycles at 10 g and at 100 g. Widths at 50 g are kept apart.",
    given="Loads and cycles. The geometry is not published: the case is a cylinder on a flat, so that exponents and "
    "ratios alone count.",
    calibrated="Coefficient k and pressure exponent b of the law k p^b, on the 16 widths at 10 g and 100 g. Each "
    "width has the same relative weight, which was chosen after a first fit with equal absolute weights had left 12 "
    "to 16 %.",
    predicted="Widths at 50 g at the same eight numbers of cycles, with intervals of 95 %.",
    verdict="Archard's law (b = 1) has exponents 1/3 of the cycles and 1/3 of the load. Measured are 0.20 and 0.65. A "
    "law k p^b on a line contact has 1/(2+b) and b/(2+b): with b = 3 both are nearly met. A wear rate that falls with "
    "the cycles, as below a growing oxide, would free the two exponents from each other.",
)
def compare(scope: Scope) -> Finding:
    """Return the fit at two loads and the prediction at the third."""
    measured = table("sliding_metal.csv")
    cycles = measured["cycles"]
    widths = [measured[f"width at {load} g (um)"] for load in LOADS]
    case = case_of("sliding_metal.toml", (), SHORT, scope)
    unknowns = ["wear.punch.coefficient=1e-14..1e-4", "wear.punch.pressure_exponent=0.5..6"]
    with tempfile.TemporaryDirectory() as folder:
        files = [_data(Path(folder), load, cycles, width) for load, width in zip(LOADS, widths, strict=True)]
        found = calibrate(case, [read_data(path, case) for path in files], [parse_unknown(case, u) for u in unknowns])
    exponent = found.values["wear.punch.pressure_exponent"]
    fitted = [1e3 * trace.predicted for trace in found.traces]
    predicted, slope = _at_load(case, found.values, cycles)
    # The scatter about the fit is one of ratios: fitted widths differ by a factor of 15.
    misfit = np.log(np.concatenate(fitted) / np.concatenate(widths))
    free = len(misfit) - len(found.values)
    scatter = float(np.sqrt(np.sum(misfit**2) / free))
    of_fit = np.sqrt(np.einsum("ni,ij,nj->n", slope, found.covariance, slope))
    factor = np.exp(student.ppf(0.975, free) * np.hypot(scatter, of_fit))
    percent = percentage_error(np.concatenate(fitted), np.concatenate(widths))
    rows = [("cycles", "width at 50 g (µm)", "95 % from", "to")]
    rows += [
        (f"{n:,.0f}", f"{w:.2f}", f"{w / f:.2f}", f"{w * f:.2f}")
        for n, w, f in zip(cycles, predicted, factor, strict=True)
    ]
    curves = [
        *(Curve(f"{load} g", cycles, width, measured=True) for load, width in zip(LOADS, widths, strict=True)),
        *(Curve(f"{load} g, fitted", cycles, width) for load, width in zip(LOADS, fitted, strict=True)),
        Curve(f"{KEPT} g, predicted", cycles, predicted, between_factors(predicted, factor)),
    ]
    comparisons = [
        Comparison(f"exponent of the cycles at {load} g", _slope(cycles, width), _slope(cycles, fit))
        for load, width, fit in zip(LOADS, widths, fitted, strict=True)
    ]
    ratio = np.log(LOADS[1] / LOADS[0])
    comparisons.append(
        Comparison(
            "exponent of the load, mean of the eight",
            float(np.mean(np.log(widths[1] / widths[0])) / ratio),
            float(np.mean(np.log(fitted[1] / fitted[0])) / ratio),
        )
    )
    return Finding(
        f"root mean square error of the fitted widths {percent:.0f} % with b = {exponent:.2f} "
        f"({found.evaluations} runs); widths at 50 g are predictions that nothing has been compared with",
        percent, comparisons, ("cycles", "width of the scar (µm)"), curves, rows, ("log", "log"),
    )  # fmt: skip


def _data(folder: Path, load: int, cycles: Array, width: Array) -> Path:
    """Write the widths at a load as a file of measurements; return it. Each is known to the same share of itself."""
    path = folder / f"{load}g.csv"
    with path.open("w", newline="") as file:
        file.write(f'# set punch.loads.0.force = ["0 N", "{-load * GRAVITY} N"]\n')
        writer = csv.writer(file)
        writer.writerow(["after (cycles)", "scar_width (um)", "sigma (um)"])
        writer.writerows(zip(cycles, width, SHARE * width, strict=True))
    return path


def _at_load(case: Case, values: dict[str, float], cycles: Array) -> tuple[Array, Array]:
    """Return the widths (n,), µm, at the load kept apart, and the slopes of their logarithms by unknown (n, m)."""
    with tempfile.TemporaryDirectory() as folder:
        plan = [read_data(_data(Path(folder), KEPT, cycles, np.ones(len(cycles))), case)]
    predictor = Predictor(Model(case), plan)

    def widths(at: dict[str, float]) -> Array:
        return 1e3 * predictor(at)[0]

    here = widths(values)
    keys: Sequence[str] = list(values)
    step = 0.02
    slopes = [np.log(widths({**values, key: values[key] * np.exp(step)}) / here) / step for key in keys]
    return here, np.array(slopes).T


def _slope(x: Array, y: Array) -> float:
    """Return the exponent of y by x of a power law through the points."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])
