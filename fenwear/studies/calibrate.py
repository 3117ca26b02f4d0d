"""Calibration: keys of a case from measurements, by least squares, with the limits of the data, and their scatter.

Minimised is chi^2 = sum ((prediction - value) / sigma)^2 over the unknown keys and, for every profile, the
offset and tilt of the trace where they are asked for. The covariance is (J^T J)^-1, J the Jacobian
of the weighted residuals, times chi^2 / (n - m) where no sigma was given. Unknowns that cannot be
negative are fitted by their logarithms: their intervals are intervals of a ratio. Intervals end at the key's bounds.
Errors that depend on each other are whitened, see `fenwear.studies.measured_data`. Tests
of the same kind, each fitted by itself, give the scatter between them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Unpack

import numpy as np
from scipy import stats
from scipy.optimize import OptimizeResult

from fenwear.case import Case
from fenwear.common.arrays import Array, Mask
from fenwear.common.errors import CaseError, ConvergenceError, InputError
from fenwear.common.progress import Log
from fenwear.results.disk import finite
from fenwear.studies.least_squares import (
    LeastSquares,
    hardly_known,
    known_together,
    not_determined,
    without_baselines,
)
from fenwear.studies.measured_data import FEW, NONE, SMOOTH, DataSet, Noise, Series, in_order, neighbours_ratio
from fenwear.studies.numeric_keys import ScaledUnknown, Unknown, nearest_possible
from fenwear.studies.quantities import GROWING, unit_of
from fenwear.studies.scatter import Scatter
from fenwear.studies.study import Study, StudyOptions, case_text, named

LARGEST_CONDITION = 1e12  # of the Jacobian, beyond which the data do not tell what is fitted
WIDER = 1.5  # factor of a standard error worth a word


@dataclass(frozen=True)
class Fitted:
    """An unknown that was found.

    Attributes:
        key: Its path.
        value: In `unit`.
        unit: The internal one.
        standard_error: Of the value; NaN where the data do not determine it.
        low, high: Ends of the 95 % interval.
        logarithmic: Whether it was fitted by its logarithm.
    """

    key: str
    value: float
    unit: str
    standard_error: float
    low: float
    high: float
    logarithmic: bool


@dataclass(frozen=True)
class Trace:
    """A fitted series.

    Attributes:
        name: Of the data set.
        series: Measured values.
        predicted: By the model, with offset and tilt of the trace (k,).
        offset, tilt: Of the trace: mm, and mm/mm about its middle; NaN where they were not asked for.
    """

    name: str
    series: Series
    predicted: Array
    offset: float = float("nan")
    tilt: float = float("nan")

    @property
    def residual(self) -> Array:
        """Prediction minus value (k,)."""
        return self.predicted - self.series.values


@dataclass(frozen=True)
class Calibration:
    """The result of a calibration.

    Attributes:
        fitted: The unknowns.
        correlation: Of the unknowns (m, m).
        covariance: Of the unknowns as they were fitted: by their logarithms or in their units (m, m).
        traces: Every series with its prediction.
        noise: Standard deviation of a measurement over its sigma, or where none was given in internal units.
        degrees_of_freedom: Measurements less unknowns.
        not_known: Limits of the data, in sentences.
        remarks: Further remarks.
        at_bound: Keys whose value is at a bound.
        evaluations: Runs computed.
        jacobian: Of the weighted residuals by the fitted unknowns and baselines (n, m + baselines).
    """

    fitted: tuple[Fitted, ...]
    correlation: Array
    covariance: Array
    traces: tuple[Trace, ...]
    noise: float
    degrees_of_freedom: int
    not_known: tuple[str, ...]
    remarks: tuple[str, ...]
    at_bound: tuple[str, ...]
    evaluations: int
    jacobian: Array = field(repr=False)

    @property
    def values(self) -> dict[str, float]:
        """Values by key."""
        return {unknown.key: unknown.value for unknown in self.fitted}

    def scatter(self) -> Scatter:
        """Return the unknowns' joint distribution: normal, of the logarithms where they were fitted so.

        Raises:
            CaseError: the data do not determine them.
        """
        if self.not_known:
            raise CaseError([InputError("calibration", f"gives no distribution: {line}") for line in self.not_known])
        return Scatter.joint(
            [unknown.key for unknown in self.fitted],
            [unknown.value for unknown in self.fitted],
            self.covariance,
            [unknown.logarithmic for unknown in self.fitted],
        )

    def as_json(self) -> dict[str, Any]:
        """Return the object that --json prints and calibration.json holds."""
        table = {
            "unknowns": [
                {"key": unknown.key, "value": unknown.value, "unit": unknown.unit,
                 "standard_error": unknown.standard_error, "interval_95": [unknown.low, unknown.high],
                 "logarithmic": unknown.logarithmic}
                for unknown in self.fitted
            ],
            "correlation": self.correlation.tolist(),
            "covariance": self.covariance.tolist() if np.isfinite(self.covariance).all() else None,
            "traces": [
                {"name": t.name, "quantity": t.series.quantity, "measurements": len(t.series.values),
                 "offset_mm": t.offset, "tilt": t.tilt,
                 "rms_residual": float(np.sqrt(np.mean(t.residual**2)))}
                for t in self.traces
            ],
            "noise": self.noise,
            "degrees_of_freedom": self.degrees_of_freedom,
            "not_known": list(self.not_known),
            "remarks": list(self.remarks),
            "at_bound": list(self.at_bound),
            "evaluations": self.evaluations,
        }  # fmt: skip
        return dict(finite(table))

    def text(self) -> str:
        """Return a table for people."""
        lines = [f"  {'key':36} {'value':>13} {'std. error':>11} {'95 % interval':>27}  unit"]
        for unknown in self.fitted:
            lines.append(
                f"  {unknown.key:36} {unknown.value:13.6g} {unknown.standard_error:11.3g} "
                f"{unknown.low:13.5g} {unknown.high:13.5g}  {unknown.unit or '-'}"
            )
        if len(self.fitted) > 1:
            lines.append("  correlation")
            lines += [
                f"    {row_unknown.key:34} " + " ".join(f"{value:7.3f}" for value in np.atleast_1d(row))
                for row_unknown, row in zip(self.fitted, list(self.correlation), strict=True)
            ]
        lines.append(f"  noise {self.noise:.4g}, {self.degrees_of_freedom} degrees of freedom, {self.evaluations} runs")
        for trace in self.traces:
            base = "" if np.isnan(trace.offset) else f", offset {trace.offset:.4g} mm"
            base += "" if np.isnan(trace.tilt) else f", tilt {trace.tilt:.3g} mm/mm"
            lines.append(f"  {trace.name}: {trace.series.quantity}, {len(trace.series.values)} measurements, "
                         f"rms residual {np.sqrt(np.mean(trace.residual**2)):.4g} "
                         f"{unit_of(trace.series.quantity)}{base}".rstrip())  # fmt: skip
        lines += [f"  not known: {line}" for line in self.not_known] + [f"  {line}" for line in self.remarks]
        return "\n".join(lines)


def calibrate(
    case: Case,
    data: Sequence[DataSet],
    unknowns: Sequence[str | Unknown],
    *,
    baseline: Sequence[str] = (),
    progress: Log = lambda message: None,
    **how: Unpack[StudyOptions],
) -> Calibration:
    """Return the unknown keys of a case that fit measurements best; collective.

    Args:
        case: The problem; its values of the unknowns are where the fit starts.
        data: Measured values.
        unknowns: Keys, with or without bounds.
        baseline: "offset" and "tilt" of each profile's trace, to be found too.
        progress: Gets the stage, and the number of runs with their residual.
        how: Folder, parts and ranks, as `fenwear.studies.StudyOptions`. Each part returns the result.

    Raises:
        CaseError: an unknown without influence, bounds that make no sense, or too few data.
        ConvergenceError: a run or the fit did not converge.
    """
    return calibrate_each(case, [data], unknowns, baseline=baseline, progress=progress, **how)[0]


def calibrate_each(
    case: Case,
    tests: Sequence[Sequence[DataSet]],
    unknowns: Sequence[str | Unknown],
    *,
    baseline: Sequence[str] = (),
    progress: Log = lambda message: None,
    **how: Unpack[StudyOptions],
) -> list[Calibration]:
    """Return the calibration on the data sets of each test, as `calibrate`; collective."""
    study = Study(**how)
    asked = [Unknown(unknown) if isinstance(unknown, str) else unknown for unknown in unknowns]
    problems = [LeastSquares(case, data, asked, baseline, progress, study) for data in tests]
    store = study.open(case, named(case_text(case), [problem.key for problem in problems], asked, list(baseline)))
    calibrations = []
    while problems:
        problem = problems.pop(0)  # whose systems are then free
        if len(tests) > 1:
            progress(f"calibrating on {problem.data[0].name}")
        problem.store = store
        calibrations.append(problem.team.lead(partial(_calibrated, problem, progress)))
    return calibrations


def _calibrated(problem: LeastSquares, progress: Log) -> Calibration:
    z: Array = np.zeros(len(problem.unknowns))
    _begin(problem, z)
    problem.check_influence(problem.jacobian(z), z)
    progress("first fit: each run finds its own jumps")
    z = problem.approach(z)
    if _begin(problem, z):  # the jumps of the start are too long or too short for the end
        progress("last fit: all runs jump as the end of the first fit")
    result = problem.fit(start=z)
    if not result.success:
        raise ConvergenceError(
            f"the fit did not converge in {result.nfev} trials. Give fewer unknowns, bounds, or a better start"
        )
    z = np.asarray(result.x[: len(z)])
    problem.predicted(z, strict=True)  # raises what a trial may do, and a result may not
    return _calibration(problem, result)


def _begin(problem: LeastSquares, z: Array) -> bool:
    """Run the model where a round of the fit begins, and return whether it jumps otherwise than in the round before.

    Errors there name the values.
    """
    try:
        return problem.keep_jumps(z)
    except ConvergenceError as error:
        values = ", ".join(f"{key} = {value:.4g}" for key, value in problem.values(z).items())
        raise type(error)(
            f"{error}\nthis is at {values}, where the fit begins. Give a better start by --set KEY=VALUE. For a wear "
            "coefficient, use worn volume over load and sliding distance"
        ) from error


def _calibration(problem: LeastSquares, result: OptimizeResult) -> Calibration:
    """Return the result in the unknowns' own units, with the limits of the data."""
    m, n = len(problem.unknowns), len(problem.observed)
    z, lines, weighted = result.x[:m], result.x[m:], np.asarray(result.jac)
    free = np.array([not _at_bound(scaled, part) for scaled, part in zip(problem.unknowns, z, strict=True)])
    freedom = n - len(result.x)
    noise = float(np.sqrt(2 * result.cost / freedom))
    scale = 1.0 if problem.has_sigma else noise
    columns = without_baselines(weighted, m)
    covariance = _covariance(columns, free, scale)
    factor = stats.norm.ppf(0.975) if problem.has_sigma else stats.t.ppf(0.975, freedom)
    errors = np.sqrt(np.diag(covariance))
    keys = [scaled.unknown.key for scaled in problem.unknowns]
    at_bound = [key for key, inside in zip(keys, free, strict=True) if not inside]
    relative = columns * np.array(
        [_per_relative(scaled, part) for scaled, part in zip(problem.unknowns, z, strict=True)]
    )
    not_known = not_determined([key for key in keys if key not in at_bound], relative[:, free] / scale)
    own_units = np.array([1.0 if scaled.logarithmic else scaled.scale for scaled in problem.unknowns])
    correlation = covariance / np.outer(errors, errors)
    traces = _traces(problem, problem.with_baselines(result.x), lines)
    remarks = [*_scatter_remarks(result, traces, free, errors), *known_together(keys, correlation, at_bound)]
    if problem.has_sigma and noise > 2:
        remarks.append(f"the residuals are {noise:.2g} times their sigma: the model does not describe the data, or "
                       "sigma is too small. Standard errors are those of the given sigma")  # fmt: skip
    return Calibration(
        tuple(map(partial(_fitted, problem.case), problem.unknowns, z, errors, factor * errors)),
        correlation,
        covariance * np.outer(own_units, own_units),
        tuple(traces),
        noise,
        freedom,
        tuple(not_known or hardly_known(keys, problem.data, columns)),
        tuple(remarks),
        tuple(at_bound),
        problem.evaluations,
        weighted,
    )


def _scatter_remarks(result: OptimizeResult, traces: Sequence[Trace], free: Mask, errors: Array) -> list[str]:
    """Return a remark where the files do not state the kind of scatter, and the data do not show it."""
    remarks: list[str] = []
    added, m, begin = [], len(free), 0
    both = np.column_stack([result.jac, result.fun])
    for trace in traces:
        series, ratio = trace.series, neighbours_ratio(trace.residual)
        rows = slice(begin, begin + len(series.values))
        begin = rows.stop
        if series.noise.kind or not trace.residual.any():
            continue
        if not series.is_profile and series.quantity in GROWING and (len(series.values) < FEW or ratio < SMOOTH):
            added.append(series.quantity)
            both[rows] = Noise("adds up").whitened(both[rows], NONE, NONE, series.after)
        elif series.is_profile and ratio < SMOOTH:
            alike = 1 - ratio / 2
            length = -float(np.median(in_order(series.places)[1])) / np.log(alike)
            remarks.append(
                f"{trace.name}: neighbouring residuals are alike (correlation {alike:.2f}), so standard errors are too "
                f"small. Set `# scatter = alike over {length:.2g} mm` in the file"
            )
    if added:
        columns, residual = both[:, :-1], both[:, -1]
        residual = residual - columns @ np.linalg.lstsq(columns, residual, rcond=None)[0]
        noise = float(np.sqrt(residual @ residual / (len(both) - columns.shape[1])))
        other = np.diag(_covariance(without_baselines(columns, m), free, noise))
        factor = float(np.nanmax(np.sqrt(other) / errors, initial=1.0))
        if factor > WIDER:
            remarks.append(
                f"the rows do not show whether the scatter of {' and '.join(dict.fromkeys(added))} adds up from one to "
                f"the next. If it does, standard errors are up to {factor:.2g} times as large. Set `# scatter = adds "
                "up` or `# scatter = independent` in the file"
            )
    return remarks


def _covariance(columns: Array, free: Mask, scale: float) -> Array:
    """Return the covariance of the fitted unknowns (m, m); NaN of those at a bound, and where they are not known."""
    m = columns.shape[1]
    covariance = np.full((m, m), np.nan)
    lengths = np.linalg.norm(columns[:, free], axis=0)
    if free.any() and (lengths > 0).all():
        unit = columns[:, free] / lengths
        if np.linalg.cond(unit) < LARGEST_CONDITION:
            inner = np.linalg.inv(unit.T @ unit) / np.outer(lengths, lengths)
            covariance[np.ix_(free, free)] = inner * scale**2
    return covariance


def _fitted(case: Case, scaled: ScaledUnknown, z: float, error: float, reach: float) -> Fitted:
    """Return an unknown in its own unit, whose interval reaches from z by `reach` and ends at the key's bounds."""
    key, value = scaled.unknown.key, scaled.value(z)

    def end(z: float) -> float:
        reached = float(np.clip(scaled.value(z), scaled.unknown.low, scaled.unknown.high))
        return nearest_possible(case, key, value, reached) if np.isfinite(reached) else reached

    spread = float((value if scaled.logarithmic else scaled.scale) * error)
    return Fitted(key, value, scaled.unit, spread, end(z - reach), end(z + reach), scaled.logarithmic)


def _at_bound(scaled: ScaledUnknown, z: float) -> bool:
    ends = [scaled.fitted(bound) for bound in (scaled.unknown.low, scaled.unknown.high) if np.isfinite(bound)]
    return any(abs(z - end) < 1e-6 * max(1.0, abs(end)) for end in ends)


def _per_relative(scaled: ScaledUnknown, z: float) -> float:
    """Return the change of the fitted unknown for a relative change of its value."""
    return 1.0 if scaled.logarithmic else (abs(scaled.value(z)) or scaled.scale) / scaled.scale


def _traces(problem: LeastSquares, predicted: Array, lines: Array) -> list[Trace]:
    """Return every series with its prediction, of all predictions (n,) with their baselines."""
    traces, begin = [], 0
    names = [data_set.name for data_set in problem.data for _ in data_set.series]
    for number, (name, series) in enumerate(zip(names, problem.series, strict=True)):
        rows = slice(begin, begin + len(series.values))
        begin = rows.stop
        baselines = {
            term: float(value) for (k, term), value in zip(problem.baseline_names, lines, strict=True) if k == number
        }
        traces.append(Trace(name, series, predicted[rows], **baselines))
    return traces


LEAST_TESTS = 3


def check_count(tests: Sequence[object]) -> None:
    """Raise where tests are too few for a scatter between them."""
    if len(tests) < LEAST_TESTS:
        raise CaseError(InputError("--each", f"expected {LEAST_TESTS} tests or more for a scatter, got {len(tests)}"))


def between(calibrations: Sequence[Calibration]) -> Scatter:
    """Return the distribution of the unknowns from test to test: what tests of the same kind differ by.

    Normal, or lognormal where they were fitted so, with mean and covariance of the tests' results.

    Raises:
        CaseError: fewer than three tests, not of the same unknowns, or their results do not differ.
    """
    values, covariance, logarithmic = _between(calibrations)
    return Scatter.joint(list(calibrations[0].values), [float(value) for value in values], covariance, logarithmic)


def _between(calibrations: Sequence[Calibration]) -> tuple[Array, Array, list[bool]]:
    """Return middle values, covariance between tests, and which unknowns are taken by their logarithms."""
    check_count(calibrations)
    if len({tuple(calibration.values) for calibration in calibrations}) > 1:
        raise CaseError(InputError("--each", "expected the same unknowns in every calibration"))
    logarithmic = [fitted.logarithmic for fitted in calibrations[0].fitted]
    table = np.array(
        [[np.log(u.value) if u.logarithmic else u.value for u in calibration.fitted] for calibration in calibrations]
    )
    covariance = np.atleast_2d(np.cov(table.T))
    if not (np.diag(covariance) > 0).all() or len(calibrations) <= table.shape[1]:
        raise CaseError(InputError("--each", "expected more tests than unknowns, and results that differ"))
    middle = table.mean(axis=0)
    return np.where(logarithmic, np.exp(middle), middle), covariance, logarithmic


def between_as_json(calibrations: Sequence[Calibration]) -> dict[str, Any]:
    """Return the scatter between tests in the form of a calibration's result."""
    values, covariance, logarithmic = _between(calibrations)
    rows = [
        {"key": fitted.key, "value": float(value), "unit": fitted.unit, "logarithmic": by_log}
        for fitted, value, by_log in zip(calibrations[0].fitted, values, logarithmic, strict=True)
    ]
    lines = list(dict.fromkeys(line for calibration in calibrations for line in calibration.not_known))
    return {"unknowns": rows, "covariance": covariance.tolist(), "not_known": lines}
