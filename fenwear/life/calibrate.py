"""Calibration: keys of a case from measurements, by least squares, with what the data cannot tell.

Minimised is chi^2 = sum ((prediction - value) / sigma)^2 over the unknown keys and, for every profile, the
offset and tilt of the trace where they are asked for. The covariance is (J^T J)^-1, J the Jacobian
of the weighted residuals, times chi^2 / (n - m) where no sigma was given. Unknowns that cannot be
negative are fitted by their logarithms: their intervals are intervals of a ratio. Residuals that are correlated
are fitted again as such, see `fenwear.life.correlated`; a given sigma is a relative one then.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from mpi4py import MPI
from scipy import stats

from fenwear.arrays import Array, Mask
from fenwear.case import Case
from fenwear.errors import CaseError, ConvergenceError, InputError
from fenwear.life.correlated import LARGEST_CONDITION, Correlated, Correlation
from fenwear.life.data import DataSet, Series
from fenwear.life.identifiable import hardly_known, known_together, not_determined, without_baselines
from fenwear.life.least_squares import STEP, LeastSquares
from fenwear.life.quantities import UNITS
from fenwear.life.scatter import Scatter
from fenwear.life.unknowns import ScaledUnknown, Unknown

ROUNDS = 2  # of fits, each on the jumps of a run at its start


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
        series: What was measured.
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
        inflation: Largest factor of the standard errors for residuals that are correlated; 1 for none.
        not_known: What the data cannot tell, in sentences.
        remarks: What else is to be said.
        at_bound: Keys whose value is at a bound.
        evaluations: Runs computed.
        jacobian: Of the weighted residuals by the fitted unknowns and baselines (n, m + baselines).
        correlated: How the residuals are correlated; None where they are not.
    """

    fitted: tuple[Fitted, ...]
    correlation: Array
    covariance: Array
    traces: tuple[Trace, ...]
    noise: float
    degrees_of_freedom: int
    inflation: float
    not_known: tuple[str, ...]
    remarks: tuple[str, ...]
    at_bound: tuple[str, ...]
    evaluations: int
    jacobian: Array = field(repr=False)
    correlated: Correlated | None = field(default=None, repr=False)

    @property
    def values(self) -> dict[str, float]:
        """Values by key."""
        return {one.key: one.value for one in self.fitted}

    def scatter(self) -> Scatter:
        """Return the unknowns' joint distribution: normal, of the logarithms where they were fitted so.

        Raises:
            CaseError: the data do not determine them.
        """
        if self.not_known:
            raise CaseError([InputError("calibration", f"gives no distribution: {line}") for line in self.not_known])
        return Scatter.joint(
            [one.key for one in self.fitted],
            [one.value for one in self.fitted],
            self.covariance,
            [one.logarithmic for one in self.fitted],
        )

    def as_json(self) -> dict[str, Any]:
        """Return what --json prints and calibration.json holds."""

        def number(value: float) -> float | None:
            return float(value) if np.isfinite(value) else None

        return {
            "unknowns": [
                {"key": one.key, "value": one.value, "unit": one.unit, "standard_error": number(one.standard_error),
                 "interval_95": [number(one.low), number(one.high)], "logarithmic": one.logarithmic}
                for one in self.fitted
            ],
            "correlation": self.correlation.tolist(),
            "covariance": self.covariance.tolist() if np.isfinite(self.covariance).all() else None,
            "traces": [
                {"name": t.name, "quantity": t.series.quantity, "measurements": len(t.series.values),
                 "offset_mm": number(t.offset), "tilt": number(t.tilt),
                 "rms_residual": float(np.sqrt(np.mean(t.residual**2)))}
                for t in self.traces
            ],
            "noise": self.noise,
            "degrees_of_freedom": self.degrees_of_freedom,
            "inflation": self.inflation,
            "not_known": list(self.not_known),
            "remarks": list(self.remarks),
            "at_bound": list(self.at_bound),
            "evaluations": self.evaluations,
        }  # fmt: skip

    def text(self) -> str:
        """Return a table for people."""
        lines = [f"  {'key':36} {'value':>13} {'std. error':>11} {'95 % interval':>27}  unit"]
        for one in self.fitted:
            lines.append(
                f"  {one.key:36} {one.value:13.6g} {one.standard_error:11.3g} "
                f"{one.low:13.5g} {one.high:13.5g}  {one.unit or '-'}"
            )
        if len(self.fitted) > 1:
            lines.append("  correlation")
            lines += [
                f"    {one.key:34} " + " ".join(f"{value:7.3f}" for value in np.atleast_1d(row))
                for one, row in zip(self.fitted, list(self.correlation), strict=True)
            ]
        lines.append(f"  noise {self.noise:.4g}, {self.degrees_of_freedom} degrees of freedom, {self.evaluations} runs")
        for trace in self.traces:
            base = "" if np.isnan(trace.offset) else f", offset {trace.offset:.4g} mm"
            base += "" if np.isnan(trace.tilt) else f", tilt {trace.tilt:.3g} mm/mm"
            lines.append(f"  {trace.name}: {trace.series.quantity}, {len(trace.series.values)} measurements, "
                         f"rms residual {np.sqrt(np.mean(trace.residual**2)):.4g} "
                         f"{UNITS[trace.series.quantity]}{base}".rstrip())  # fmt: skip
        lines += [f"  not known: {line}" for line in self.not_known] + [f"  {line}" for line in self.remarks]
        return "\n".join(lines)


def calibrate(
    case: Case,
    data: Sequence[DataSet],
    unknowns: Sequence[str | Unknown],
    *,
    baseline: Sequence[str] = (),
    comm: MPI.Comm = MPI.COMM_WORLD,
    progress: Callable[[str], None] = lambda message: None,
) -> Calibration:
    """Return the unknown keys of a case that fit measurements best; collective.

    Args:
        case: The problem; its values of the unknowns are where the fit starts.
        data: What was measured.
        unknowns: Keys, with or without bounds.
        baseline: "offset" and "tilt" of each profile's trace, to be found too.
        comm: The ranks.
        progress: Told what goes on.

    Raises:
        CaseError: an unknown without influence, bounds that make no sense, or too few data.
        ConvergenceError: a run or the fit did not converge.
    """
    asked = [Unknown(one) if isinstance(one, str) else one for one in unknowns]
    problem = LeastSquares(case, data, asked, baseline, comm, progress)
    return problem.team.lead(partial(_calibrated, problem, progress))


def _calibrated(problem: LeastSquares, progress: Callable[[str], None]) -> Calibration:
    z = np.zeros(len(problem.unknowns))
    result = None
    for number in range(ROUNDS):  # the jumps of the start are too long or too short for the end
        if not _begin(problem, z):
            break  # the fit is on the jumps of its own end
        if number == 0:
            problem.check_influence(problem.jacobian(z), z)
        progress(f"fit {number + 1} of {ROUNDS}")
        result = problem.fit(start=z)
        before, z = z, np.array([result.params[f"u{k}"].value for k in range(len(z))])
        if np.abs(z - before).max() < STEP:
            break
        if not result.success:
            raise ConvergenceError(
                f"the fit did not converge in {result.nfev} trials; expected fewer unknowns, bounds, or a better start"
            )
    if result is None:
        raise ConvergenceError("the fit did not begin")
    correlated: Correlated | None = None
    remarks: tuple[str, ...] = ()
    if _parts(problem, result)[2].all():  # at a bound residuals are what the data want beyond it, too
        correlated, remarks = _correlation(problem, result).test(np.asarray(result.residual))
    if correlated is not None:
        progress("fit with residuals that are correlated")
        problem.correlated, remarks = correlated, correlated.lines
        result = problem.fit(start=z)
        z = np.array([result.params[f"u{k}"].value for k in range(len(z))])
    problem.predicted(z, strict=True)  # raises what a trial may do, and a result may not
    return _calibration(problem, result, list(remarks))


def _parts(problem: LeastSquares, result: Any) -> tuple[Array, Array, Mask]:
    """Return the fitted unknowns (m,), the baselines, and which of the unknowns are at no bound (m,)."""
    numbers, m = np.array([p.value for p in result.params.values()]), len(problem.unknowns)
    free = [not _at_bound(one, part) for one, part in zip(problem.unknowns, numbers, strict=False)]
    return numbers[:m], numbers[m:], np.array(free)


def _correlation(problem: LeastSquares, result: Any, jacobian: Array | None = None) -> Correlation:
    """Return how the residuals of a fit may be correlated."""
    whole = np.asarray(result.jac) if jacobian is None else jacobian
    return Correlation(problem.series, whole, problem.sigma, has_sigma=problem.has_sigma)


def _begin(problem: LeastSquares, z: Array) -> bool:
    """Run the model where a round of the fit begins, and return whether it jumps otherwise than in the round before.

    What fails there is told with the values.
    """
    try:
        return problem.keep_jumps(z)
    except ConvergenceError as error:
        values = ", ".join(f"{key} = {value:.4g}" for key, value in problem.values(z).items())
        raise type(error)(
            f"{error}\nthis is at {values}, where the fit begins: expected a better start there, by --set KEY=VALUE; "
            "worn volume over load and sliding distance is one of a wear coefficient"
        ) from error


def _calibration(problem: LeastSquares, result: Any, remarks: list[str]) -> Calibration:
    """Return the result in the unknowns' own units, with what the data cannot tell."""
    m, n = len(problem.unknowns), len(problem.observed)
    z, lines, free = _parts(problem, result)
    freedom = n - m - len(lines)
    noise = float(np.sqrt(result.chisqr / freedom))
    scale = 1.0 if problem.absolute else noise
    residual, weighted = np.asarray(result.residual), np.asarray(result.jac)
    own = without_baselines(weighted, m)
    covariance = _covariance(own, free, scale)
    factor = stats.t.ppf(0.975, freedom) if not problem.absolute else stats.norm.ppf(0.975)
    ends = np.outer(np.sqrt(np.diag(covariance)), [-factor, factor])
    inflation = 1.0
    if problem.correlated is not None:
        residual, weighted = problem.weighted(z, lines)
        known = 1.0 if problem.has_sigma else float(np.sqrt(residual @ residual / freedom))
        independent = _covariance(without_baselines(weighted, m), free, known)
        if np.isfinite(covariance).all():
            mixture = _correlation(problem, result, weighted).mixture(residual, m)
            covariance, ends = mixture.covariance, np.array([mixture.interval(k) for k in range(m)])
            inflation = float(np.sqrt((np.diag(covariance) / np.diag(independent)).max()))
    keys = [one.unknown.key for one in problem.unknowns]
    at_bound = [key for key, inside in zip(keys, free, strict=True) if not inside]
    relative = own * np.array([_per_relative(one, part) for one, part in zip(problem.unknowns, z, strict=True)])
    not_known = not_determined([key for key in keys if key not in at_bound], relative[:, free] / scale)
    errors = np.sqrt(np.diag(covariance))
    fitted = tuple(map(_fitted, problem.unknowns, z, errors, ends))
    own_units = np.array([1.0 if one.logarithmic else one.scale for one in problem.unknowns])
    correlation = covariance / np.outer(errors, errors)
    if not not_known:
        not_known = hardly_known(keys, problem.data, own)
    remarks = [*remarks, *known_together(keys, correlation, at_bound)]
    if problem.correlated is not None:
        remarks.append(f"standard errors are up to {inflation:.2g} times those of independent residuals")
    if problem.absolute and noise > 2:
        remarks.append(f"the residuals are {noise:.2g} times their sigma: the model does not describe the data, or "
                       "sigma is too small; standard errors are those of the given sigma")  # fmt: skip
    return Calibration(
        fitted,
        correlation,
        covariance * np.outer(own_units, own_units),
        tuple(_traces(problem, residual, lines)),
        noise,
        freedom,
        inflation,
        tuple(not_known),
        tuple(remarks),
        tuple(at_bound),
        problem.model.evaluations,
        weighted,
        problem.correlated,
    )


def _covariance(own: Array, free: Mask, scale: float) -> Array:
    """Return the covariance of the fitted unknowns (m, m); NaN of those at a bound, and where they are not known."""
    m = own.shape[1]
    covariance = np.full((m, m), np.nan)
    lengths = np.linalg.norm(own[:, free], axis=0)
    if free.any() and (lengths > 0).all():
        unit = own[:, free] / lengths
        if np.linalg.cond(unit) < LARGEST_CONDITION:
            inner = np.linalg.inv(unit.T @ unit) / np.outer(lengths, lengths)
            covariance[np.ix_(free, free)] = inner * scale**2
    return covariance


def _fitted(one: ScaledUnknown, z: float, error: float, ends: Array) -> Fitted:
    """Return an unknown in its own unit; `ends` are those of its interval less z."""
    value = one.value(z)
    low, high = (one.value(z + end) for end in ends)
    spread = float((value if one.logarithmic else one.scale) * error)
    return Fitted(one.unknown.key, value, one.unit, spread, low, high, one.logarithmic)


def _at_bound(one: ScaledUnknown, z: float) -> bool:
    ends = [one.fitted(bound) for bound in (one.unknown.low, one.unknown.high) if np.isfinite(bound)]
    return any(abs(z - end) < 1e-6 * max(1.0, abs(end)) for end in ends)


def _per_relative(one: ScaledUnknown, z: float) -> float:
    """Return the change of the fitted unknown for a relative change of its value."""
    return 1.0 if one.logarithmic else (abs(one.value(z)) or one.scale) / one.scale


def _traces(problem: LeastSquares, residual: Array, lines: Array) -> list[Trace]:
    found, begin = [], 0
    names = [one.name for one in problem.data for _ in one.series]
    for number, (name, series) in enumerate(zip(names, problem.series, strict=True)):
        rows = slice(begin, begin + len(series.values))
        begin = rows.stop
        own = {
            what: float(value) for (k, what), value in zip(problem.baseline_names, lines, strict=True) if k == number
        }
        predicted = series.values + residual[rows] * problem.sigma[rows]
        found.append(Trace(name, series, predicted, **own))
    return found
