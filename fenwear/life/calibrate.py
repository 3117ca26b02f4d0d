"""Calibration: keys of a case from measurements, by least squares, with what the data cannot tell.

Minimised is chi^2 = sum ((prediction - value) / sigma)^2 over the unknown keys and, for every profile, the
offset and tilt of the trace where they are asked for. The covariance is (J^T J)^-1, J the Jacobian
of the weighted residuals, times chi^2 / (n - m) where no sigma was given. Unknowns that cannot be
negative are fitted by their logarithms: their intervals are intervals of a ratio.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from mpi4py import MPI
from scipy import stats

from fenwear.arrays import Array
from fenwear.case import Case
from fenwear.errors import CaseError, ConvergenceError, InputError
from fenwear.life.data import DataSet, Series
from fenwear.life.keys import find_key, value_of, with_values
from fenwear.life.model import Model, Snapshot
from fenwear.life.quantities import UNITS, Quantity, cycles_of
from fenwear.life.ranks import share
from fenwear.life.scatter import Scatter

if TYPE_CHECKING:
    import lmfit

STEP = 1e-5  # of the unknowns in the Jacobian, which are of order one
NO_INFLUENCE = 1e-9  # relative change of all predictions over the relative change of an unknown
UNKNOWN = 0.5  # standard error, relative to the value, beyond which a combination of unknowns is not known
TOGETHER = 0.95  # correlation that is told
APART = 0.995  # correlation, of data of one condition, from which two unknowns count as one: errors ten times as wide
CORRELATED = 3.0  # standard errors of an autocorrelation beyond which residuals count as correlated
KEPT = 16  # predictions
REFUSED = 1e3  # times what was measured: the prediction of values that the model refuses
LEAST_TESTS = 3
MOST_TRIALS = 100
ROUNDS = 2  # of fits, each on the jumps of a run at its start
BASELINES = ("offset", "tilt")

Vector: TypeAlias = Sequence[float] | Array


@dataclass(frozen=True)
class Unknown:
    """A key to be found.

    Attributes:
        key: Its path.
        low, high: Bounds in its internal unit; infinite for none.
        start: Where the fit starts; by default the case's value.
    """

    key: str
    low: float = -np.inf
    high: float = np.inf
    start: float | None = None


def parse_unknown(case: Case, text: str) -> Unknown:
    """Return an unknown from KEY or KEY=LOW..HIGH, the bounds with units.

    Raises:
        CaseError: the case has no such key, or the bounds are not possible.
    """
    path, equals, bounds = (part.strip() for part in text.partition("="))
    find_key(case, path, "--unknown")
    if not equals:
        return Unknown(path)
    ends = bounds.split("..")
    if len(ends) != 2:
        raise CaseError(InputError(f"--unknown {path}", f"expected bounds such as LOW..HIGH, got {bounds!r}"))
    low, high = (value_of(case, path, end, "--unknown") for end in ends)
    return Unknown(path, low, high)


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
        inflation: Factor of the standard errors for residuals that are correlated along a profile; 1 for none.
        not_known: What the data cannot tell, in sentences.
        remarks: What else is to be said.
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
    inflation: float
    not_known: tuple[str, ...]
    remarks: tuple[str, ...]
    at_bound: tuple[str, ...]
    evaluations: int
    jacobian: Array = field(repr=False)

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


class Predictor:
    """What a model predicts for data sets: one run for each condition, on jumps that can be kept."""

    def __init__(self, model: Model, data: Sequence[DataSet]) -> None:
        self.model, self.data = model, list(data)
        self._sequences: dict[tuple[str, ...], tuple[int, ...]] = {}

    def keep_jumps(self, values: Mapping[str, float]) -> None:
        """Let the runs from now on jump as those at these values do."""
        self._sequences = {}
        made = {}
        for settings, snapshots in self._runs(values).items():
            made[settings] = tuple(int(s.cycle) for s in snapshots)
        self._sequences = made

    def __call__(self, values: Mapping[str, float], *, strict: bool = False) -> list[Array]:
        """Return the predictions of every series, in the order of the data sets.

        Args:
            values: Of the keys.
            strict: Whether a scar that outgrows the contact surface is an error; in a trial of a fit it is none.

        Raises:
            CaseError: a scar has outgrown the contact surface.
        """
        runs = self._runs(values)
        found = []
        for one in self.data:
            measures = self.model.cycle_measures(values, one.settings)
            found += [_predict(series, runs[one.settings], measures, strict=strict) for series in one.series]
        return found

    def _runs(self, values: Mapping[str, float]) -> dict[tuple[str, ...], list[Snapshot]]:
        wanted: dict[tuple[str, ...], set[int]] = {}
        for one in self.data:
            measures = self.model.cycle_measures(values, one.settings)
            stops = wanted.setdefault(one.settings, set())
            for series in one.series:
                stops |= {max(1, round(cycles_of((a, series.counted), *measures))) for a in np.unique(series.after)}
        runs = {}
        for settings, stops in wanted.items():
            sequence = self._sequences.get(settings)
            last = max(stops) if sequence is None else sequence[-1]
            runs[settings] = list(
                self.model.run(values, last, settings=settings, stops=sorted(stops), sequence=sequence)
            )
        return runs


def _predict(series: Series, snapshots: Sequence[Snapshot], measures: tuple[float, float], *, strict: bool) -> Array:
    ends = np.array([s.cycle for s in snapshots])
    predicted = np.empty(len(series.values))
    quantity = Quantity(series.quantity, series.quantity, "snapshot", UNITS[series.quantity], series.body)
    for amount in np.unique(series.after):
        cycles = cycles_of((float(amount), series.counted), *measures)
        snapshot = snapshots[int(np.argmin(np.abs(ends - cycles)))].at_cycle(cycles)
        own = series.after == amount
        if series.x is None:
            predicted[own] = quantity.of_snapshot(snapshot)
        else:
            predicted[own] = _profile(series, snapshot, series.x[own], strict=strict)
    return predicted


def _profile(series: Series, snapshot: Snapshot, x: Array, *, strict: bool) -> Array:
    """Return the depth at places (k,); nothing is worn beyond the contact surface.

    Raises:
        CaseError: the scar reaches the end of the modelled contact surface, and the profile beyond it.
    """
    surface = snapshot.surfaces[series.body]
    depth = np.zeros(len(surface.x)) if surface.depth is None else surface.depth
    edge = 1e-9 * (surface.x[-1] - surface.x[0])
    worn = 1e-3 * float(depth.max())
    cut = (x.min() < surface.x[0] - edge and depth[0] > worn) or (x.max() > surface.x[-1] + edge and depth[-1] > worn)
    if strict and cut:
        raise CaseError(
            InputError(
                "geometry",
                f"the profile goes from x = {x.min():g} to {x.max():g} mm, and the scar reaches the end of the contact "
                f"surface, which goes from {surface.x[0]:g} to {surface.x[-1]:g} mm; expected a wider one",
            )
        )
    return np.interp(x, surface.x, depth, left=0.0, right=0.0)


@dataclass(frozen=True)
class _Scaled:
    """An unknown as it is fitted: value = start exp(z) by its logarithm, else start + scale z."""

    unknown: Unknown
    unit: str
    start: float
    scale: float
    logarithmic: bool

    def value(self, z: float) -> float:
        return float(self.start * np.exp(z)) if self.logarithmic else self.start + self.scale * z

    def fitted(self, value: float) -> float:
        if not self.logarithmic:
            return (value - self.start) / self.scale
        return float(np.log(value / self.start)) if value > 0 else -np.inf


class LeastSquares:
    """The least-squares problem of data sets and unknowns, kept for fits to several sets of values."""

    def __init__(
        self,
        case: Case,
        data: Sequence[DataSet],
        unknowns: Sequence[Unknown],
        baseline: Sequence[str] = (),
        comm: MPI.Comm = MPI.COMM_WORLD,
    ) -> None:
        """Check what is asked for; computes nothing.

        Raises:
            CaseError: a key, bound or combination of data that makes no sense.
        """
        self.case, self.comm = case, comm
        self.model = Model(case)
        self.data = list(data)
        self.series = [series for one in data for series in one.series]
        self.unknowns = [_scaled(case, unknown) for unknown in unknowns]
        self.baseline = tuple(baseline)
        self._check(unknowns)
        self.predict = Predictor(self.model, data)
        self._known: dict[bytes, Array] = {}  # predictions of fitted unknowns, on the jumps kept
        self.observed = np.concatenate([series.values for series in self.series])
        self.has_sigma = self.series[0].sigma is not None
        self.sigma = np.concatenate([np.ones(len(s.values)) if s.sigma is None else s.sigma for s in self.series])
        self._lines, self.baseline_names = self._baselines()
        count = len(self.unknowns) + self._lines.shape[1]
        if len(self.observed) <= count:
            raise CaseError(
                InputError("data", f"{len(self.observed)} measurements for {count} unknowns; expected more")
            )

    def _check(self, unknowns: Sequence[Unknown]) -> None:
        if not self.series:
            raise CaseError(InputError("data", "expected at least one file of measurements"))
        if not unknowns:
            raise CaseError(InputError("--unknown", "expected at least one key"))
        keys = [unknown.key for unknown in unknowns]
        problems = [InputError(f"--unknown {key}", "given twice") for key in dict.fromkeys(keys) if keys.count(key) > 1]
        for name in self.baseline:
            if name not in BASELINES:
                problems.append(InputError("--baseline", f"expected {' or '.join(BASELINES)}, got {name!r}"))
        if self.baseline and all(series.x is None for series in self.series):
            problems.append(InputError("--baseline", "expected with profiles only: the data hold none"))
        for one in self.data:
            for setting in one.settings:
                key = setting.partition("=")[0]
                if key in keys:
                    problems.append(InputError(f"{one.name}: # set {key}", "is an unknown of the calibration too"))
        kinds = {series.quantity for series in self.series}
        given = {series.sigma is not None for series in self.series}
        if len(given) > 1 or (len(kinds) > 1 and given == {False}):
            names = ", ".join(dict.fromkeys(one.name for one in self.data if any(s.sigma is None for s in one.series)))
            text = "gives no sigma; expected the standard deviation of every measurement where "
            problems.append(InputError(names, text + f"{' and '.join(sorted(kinds))} are fitted together"))
        if problems:
            raise CaseError(problems)

    def _baselines(self) -> tuple[Array, list[tuple[int, str]]]:
        """Return the columns (n, baselines) that offsets and tilts add to the prediction, and whose they are."""
        columns, names, begin = [], [], 0
        for number, series in enumerate(self.series):
            rows = slice(begin, begin + len(series.values))
            begin = rows.stop
            if series.x is None:
                continue
            for name in self.baseline:
                column = np.zeros(len(self.observed))
                column[rows] = 1.0 if name == "offset" else series.x - (series.x.min() + series.x.max()) / 2
                columns.append(column)
                names.append((number, name))
        return (np.array(columns).T if columns else np.zeros((len(self.observed), 0))), names

    def keep_jumps(self, z: Vector) -> None:
        """Let the runs from now on jump as those of these fitted unknowns do: predictions are smooth functions then."""
        self.predict.keep_jumps(self.values(z))
        self._known.clear()

    def values(self, z: Vector) -> dict[str, float]:
        """Return the keys' values of fitted unknowns."""
        return {one.unknown.key: one.value(part) for one, part in zip(self.unknowns, z, strict=True)}

    def predicted(self, z: Vector, *, strict: bool = False) -> Array:
        """Return the predictions without baselines (n,); `strict` as of `Predictor`."""
        return np.concatenate(self.predict(self.values(z), strict=strict))

    def _tried(self, z: Array) -> Array:
        """Return the predictions of a trial; far too large where the model refuses it, so that it is not kept."""
        key, known = z.tobytes(), self._known
        if key not in known:
            while len(known) >= KEPT:
                known.pop(next(iter(known)))
            try:
                known[key] = self.predicted(z)
            except (CaseError, ConvergenceError):
                if not known:
                    raise
                known[key] = self.observed + REFUSED * (np.abs(self.observed) + self.sigma)
        return known[key]

    def jacobian(self, z: Vector) -> Array:
        """Return the predictions' derivatives by the fitted unknowns (n, m); collective, one on each rank."""
        base = np.array(z, dtype=float)

        def shifted(k: int) -> Array:
            ends = []
            for sign in (-1, 1):
                moved = base.copy()
                moved[k] += sign * STEP
                ends.append(self.predicted(moved))
            return np.asarray((ends[1] - ends[0]) / (2 * STEP))

        return np.array(share(self.comm, len(base), shifted), dtype=float).T

    def check_influence(self, jacobian: Array, z: Vector) -> None:
        """Check that every unknown changes some prediction.

        Raises:
            CaseError: names those that do not.
        """
        scale = float(np.abs(self.predicted(z)).max()) or 1.0
        problems = [
            InputError(f"--unknown {one.unknown.key}", "has no influence on what was measured")
            for one, column in zip(self.unknowns, jacobian.T, strict=True)
            if np.abs(column).max() <= NO_INFLUENCE * scale
        ]
        if problems:
            raise CaseError(problems)

    def cannot_tell(self, z: Vector | None = None) -> list[str]:
        """Return which unknowns these data cannot tell apart, before any fit; collective.

        Only the places and conditions of the data count, not their values: a plan of a measurement will do.
        """
        jacobian = self.jacobian(np.zeros(len(self.unknowns)) if z is None else z)
        weighted = np.hstack([jacobian, self._lines]) / self.sigma[:, None]
        return _hardly_known(self, _without_baselines(weighted, len(self.unknowns)))

    def fit(
        self,
        observed: Array | None = None,
        start: Vector | None = None,
        jacobian: Array | None = None,
    ) -> lmfit.minimizer.MinimizerResult:
        """Return lmfit's result; collective.

        Args:
            observed: Values in place of the measured ones (n,).
            start: Fitted unknowns to start from; by default zero, the start of each.
            jacobian: Of the predictions (n, m), kept instead of computed anew in each step: for data near those
                it belongs to.
        """

        def derivative(parameters: lmfit.Parameters) -> Array:
            z = self._parts(parameters)[0]
            columns = self.jacobian(z) if jacobian is None else jacobian
            return np.hstack([columns, self._lines]) / self.sigma[:, None]

        minimizer = self.minimizer(observed, start)
        minimizer.max_nfev = MOST_TRIALS
        with warnings.catch_warnings(action="ignore"):  # a singular covariance is told in our words
            return minimizer.minimize(method="least_squares", jac=derivative, x_scale="jac")

    def minimizer(self, observed: Array | None = None, start: Vector | None = None) -> lmfit.Minimizer:
        """Return lmfit's minimizer of the weighted residuals; arguments as of `fit`."""
        import lmfit

        values = self.observed if observed is None else observed
        parameters = lmfit.Parameters()
        begin = np.zeros(len(self.unknowns)) if start is None else start
        for k, (one, z) in enumerate(zip(self.unknowns, begin, strict=True)):
            bounds = (one.unknown.low, one.unknown.high)
            low, high = (one.fitted(bound) if np.isfinite(bound) else bound for bound in bounds)
            parameters.add(f"u{k}", value=float(np.clip(z, low, high)), min=low, max=high)
        for k in range(self._lines.shape[1]):
            parameters.add(f"b{k}", value=0.0)

        def residual(parameters: lmfit.Parameters) -> Array:
            z, lines = self._parts(parameters)
            return np.asarray((self._tried(z) + self._lines @ lines - values) / self.sigma)

        return lmfit.Minimizer(residual, parameters, scale_covar=not self.has_sigma)

    def _parts(self, parameters: lmfit.Parameters) -> tuple[Array, Array]:
        """Return fitted unknowns and baselines."""
        numbers = np.array([parameters[name].value for name in parameters if name[0] in "ub" and name[1:].isdigit()])
        return numbers[: len(self.unknowns)], numbers[len(self.unknowns) :]


def _scaled(case: Case, unknown: Unknown) -> _Scaled:
    """Return an unknown as it is fitted; checks its bounds.

    Raises:
        CaseError: the bounds are not in order, or do not hold the start.
    """
    key = find_key(case, unknown.key, "--unknown")
    name = f"--unknown {unknown.key}"
    if not unknown.low < unknown.high:
        raise CaseError(InputError(name, f"expected bounds that rise, got {unknown.low:g}..{unknown.high:g}"))
    start = key.value if unknown.start is None else unknown.start
    if not unknown.low <= start <= unknown.high:
        ends = [bound for bound in (unknown.low, unknown.high) if np.isfinite(bound)]
        if unknown.start is not None or len(ends) < 2:
            raise CaseError(
                InputError(name, f"its start {start:g} is outside of its bounds {unknown.low:g}..{unknown.high:g}")
            )
        # The case's own value says nothing then.
        start = float(np.sqrt(ends[0] * ends[1])) if ends[0] > 0 else float(np.mean(ends))
    with_values(case, {unknown.key: start})
    try:
        with_values(case, {unknown.key: -abs(start or 1.0)})
        never_negative = False
    except CaseError:
        never_negative = start > 0
    scale = abs(start) or next((abs(b) for b in (unknown.low, unknown.high) if np.isfinite(b) and b != 0), 1.0)
    return _Scaled(unknown, key.unit, start, scale, never_negative)


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
    problem = LeastSquares(case, data, asked, baseline, comm)
    z = np.zeros(len(asked))
    result = None
    for number in range(ROUNDS):  # the jumps of the start are too long or too short for the end
        problem.keep_jumps(z)
        if number == 0:
            problem.check_influence(problem.jacobian(z), z)
        progress(f"fit {number + 1} of {ROUNDS}")
        result = problem.fit(start=z)
        before, z = z, np.array([result.params[f"u{k}"].value for k in range(len(asked))])
        if np.abs(z - before).max() < STEP:
            break
        if not result.success:
            raise ConvergenceError(
                f"the fit did not converge in {result.nfev} trials; expected fewer unknowns, bounds, or a better start"
            )
    if result is None:
        raise ConvergenceError("the fit did not begin")
    problem.predicted(z, strict=True)  # raises what a trial may do, and a result may not
    return _calibration(problem, result)


def _calibration(problem: LeastSquares, result: Any) -> Calibration:
    """Return the result in the unknowns' own units, with what the data cannot tell."""
    m = len(problem.unknowns)
    weighted = np.asarray(result.jac)
    numbers = np.array([p.value for p in result.params.values()])
    z, lines = numbers[:m], numbers[m:]
    n = len(problem.observed)
    freedom = n - len(numbers)
    noise = float(np.sqrt(result.chisqr / freedom))
    scale = 1.0 if problem.has_sigma else noise
    traces = _traces(problem, np.asarray(result.residual), lines)
    inflation, remarks = _inflation(traces)
    own = _without_baselines(weighted, m)
    free = np.array([not _at_bound(one, part) for one, part in zip(problem.unknowns, z, strict=True)])
    at_bound = [one.unknown.key for one, inside in zip(problem.unknowns, free, strict=True) if not inside]
    relative = own * np.array([_per_relative(one, part) for one, part in zip(problem.unknowns, z, strict=True)])
    not_known = _not_known(problem, relative[:, free] / (scale * inflation), free) if free.any() else []
    covariance = np.full((m, m), np.nan)
    lengths = np.linalg.norm(own[:, free], axis=0)
    if free.any() and (lengths > 0).all():
        unit = own[:, free] / lengths
        if np.linalg.cond(unit) < 1e12:
            inner = np.linalg.inv(unit.T @ unit) / np.outer(lengths, lengths)
            covariance[np.ix_(free, free)] = inner * (scale * inflation) ** 2
    factor = stats.t.ppf(0.975, freedom) if not problem.has_sigma else stats.norm.ppf(0.975)
    fitted = tuple(_fitted(one, part, error, factor) for one, part, error in
                   zip(problem.unknowns, z, np.sqrt(np.diag(covariance)), strict=True))  # fmt: skip
    own_units = np.array([1.0 if one.logarithmic else one.scale for one in problem.unknowns])
    errors = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(errors, errors)
    if not not_known:
        not_known = _hardly_known(problem, own)
    remarks += _remarks(problem, correlation, at_bound, noise)
    return Calibration(
        fitted,
        correlation,
        covariance * np.outer(own_units, own_units),
        tuple(traces),
        noise,
        freedom,
        inflation,
        tuple(not_known),
        tuple(remarks),
        tuple(at_bound),
        problem.model.evaluations,
        weighted,
    )


def _fitted(one: _Scaled, z: float, error: float, factor: float) -> Fitted:
    value = one.value(z)
    if one.logarithmic:
        low, high = (value * np.exp(sign * factor * error) for sign in (-1, 1))
        return Fitted(one.unknown.key, value, one.unit, float(value * error), float(low), float(high), True)
    spread = float(one.scale * error)
    return Fitted(one.unknown.key, value, one.unit, spread, value - factor * spread, value + factor * spread, False)


def _at_bound(one: _Scaled, z: float) -> bool:
    ends = [one.fitted(bound) for bound in (one.unknown.low, one.unknown.high) if np.isfinite(bound)]
    return any(abs(z - end) < 1e-6 * max(1.0, abs(end)) for end in ends)


def _per_relative(one: _Scaled, z: float) -> float:
    """Return the change of the fitted unknown for a relative change of its value."""
    return 1.0 if one.logarithmic else (abs(one.value(z)) or one.scale) / one.scale


def _without_baselines(weighted: Array, m: int) -> Array:
    """Return the unknowns' columns less what offsets and tilts can take over."""
    own, lines = weighted[:, :m], weighted[:, m:]
    if not lines.shape[1]:
        return own
    return own - lines @ np.linalg.lstsq(lines, own, rcond=None)[0]


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


def _inflation(traces: Sequence[Trace]) -> tuple[float, list[str]]:
    """Return by how much residuals that are correlated along profiles widen the errors.

    For a correlation r of neighbours, sqrt((1 + r) / (1 - r)): the factor of the standard error of
    a mean of a first-order autoregressive sequence.
    """
    products = squares = 0.0
    count = 0
    for trace in traces:
        if trace.series.x is None:
            continue
        sigma = 1.0 if trace.series.sigma is None else trace.series.sigma
        ordered = (trace.residual / sigma)[np.argsort(trace.series.x, kind="stable")]
        products += float(ordered[1:] @ ordered[:-1])
        squares += float(ordered @ ordered)
        count += len(ordered)
    if count == 0 or squares == 0:
        return 1.0, []
    r = min(products / squares, 0.999)
    if r < CORRELATED / np.sqrt(count):
        return 1.0, []
    factor = float(np.sqrt((1 + r) / (1 - r)))
    return factor, [
        f"the residuals of neighbouring places have a correlation of {r:.2f}: roughness, or a shape that the model "
        f"does not have; standard errors are {factor:.1f} times those of independent measurements"
    ]


def _not_known(problem: LeastSquares, relative: Array, free: Array) -> list[str]:
    """Return the combinations of unknowns that the data leave open by more than half of their values."""
    keys = [one.unknown.key for one, inside in zip(problem.unknowns, free, strict=True) if inside]
    _, singular, directions = np.linalg.svd(relative, full_matrices=False)
    lines = []
    for size, direction in zip(singular, directions, strict=True):
        if size * UNKNOWN >= 1:
            continue
        parts = [k for k in range(len(keys)) if abs(direction[k]) > 0.05 * np.abs(direction).max()]
        first = direction / direction[max(parts, key=lambda k: abs(direction[k]))]
        if len(parts) == 1:
            lines.append(f"{keys[parts[0]]}: the data do not determine it within {100 * UNKNOWN:g} %")
            continue
        changes = ", ".join(f"{keys[k]} by {first[k]:+.2g} %" for k in parts)
        lines.append(f"{' and '.join(keys[k] for k in parts)} cannot be told apart: changes of {changes} together "
                     "alter nothing that was measured beyond its noise; give one of them, or data at another "
                     "load")  # fmt: skip
    return lines


def _hardly_known(problem: LeastSquares, own: Array) -> list[str]:
    """Return the pairs that one condition tells apart by the finest details of its data only.

    By all columns of the Jacobian, also those of unknowns at a bound: a pair that wanders there is one.
    """
    lengths = np.linalg.norm(own, axis=0)
    if len({one.settings for one in problem.data}) > 1 or not (lengths > 0).all():
        return []
    unit = own / lengths
    inverse = np.linalg.pinv(unit.T @ unit, rcond=1e-15, hermitian=True)
    errors = np.sqrt(np.diag(inverse))
    correlation = inverse / np.outer(errors, errors)
    keys = [one.unknown.key for one in problem.unknowns]
    return [
        f"{keys[j]} and {keys[i]} cannot both be known from one condition: their correlation is "
        f"{correlation[i, j]:.5f}, and errors are more than ten times those of each alone; give one of them, or data "
        "at another load"
        for i in range(len(keys))
        for j in range(i)
        if abs(correlation[i, j]) > APART
    ]


def _remarks(problem: LeastSquares, correlation: Array, at_bound: Sequence[str], noise: float) -> list[str]:
    keys = [one.unknown.key for one in problem.unknowns]
    lines = [
        f"{keys[i]} and {keys[j]} are known together better than alone: correlation {correlation[i, j]:.3f}"
        for i in range(len(keys))
        for j in range(i)
        if abs(correlation[i, j]) > TOGETHER
    ]
    lines += [f"{key} is at a bound: the data want a value beyond it" for key in at_bound]
    if problem.has_sigma and noise > 2:
        lines.append(f"the residuals are {noise:.2g} times their sigma: the model does not describe the data, or "
                     "sigma is too small; standard errors are those of the given sigma")  # fmt: skip
    return lines


def between(found: Sequence[Calibration]) -> Scatter:
    """Return the distribution of the unknowns from test to test: what tests of the same kind differ by.

    Normal, or lognormal where they were fitted so, with mean and covariance of the tests' results.

    Raises:
        CaseError: fewer than three tests, not of the same unknowns, or their results do not differ.
    """
    values, covariance, logarithmic = _between(found)
    return Scatter.joint(list(found[0].values), [float(value) for value in values], covariance, logarithmic)


def _between(found: Sequence[Calibration]) -> tuple[Array, Array, list[bool]]:
    """Return middle values, covariance between tests, and which unknowns are taken by their logarithms."""
    if len(found) < LEAST_TESTS:
        raise CaseError(InputError("--each", f"expected {LEAST_TESTS} tests or more for a scatter, got {len(found)}"))
    if len({tuple(one.values) for one in found}) > 1:
        raise CaseError(InputError("--each", "expected the same unknowns in every calibration"))
    logarithmic = [one.logarithmic for one in found[0].fitted]
    table = np.array([[np.log(u.value) if u.logarithmic else u.value for u in one.fitted] for one in found])
    covariance = np.atleast_2d(np.cov(table.T))
    if not (np.diag(covariance) > 0).all() or len(found) <= table.shape[1]:
        raise CaseError(InputError("--each", "expected more tests than unknowns, and results that differ"))
    middle = table.mean(axis=0)
    return np.where(logarithmic, np.exp(middle), middle), covariance, logarithmic


def between_as_json(found: Sequence[Calibration]) -> dict[str, Any]:
    """Return the scatter between tests in the form of a calibration's result."""
    values, covariance, logarithmic = _between(found)
    rows = [
        {"key": one.key, "value": float(value), "unit": one.unit, "logarithmic": by_log}
        for one, value, by_log in zip(found[0].fitted, values, logarithmic, strict=True)
    ]
    lines = list(dict.fromkeys(line for one in found for line in one.not_known))
    return {"unknowns": rows, "covariance": covariance.tolist(), "not_known": lines}


def repeated(problem: LeastSquares, truth: Vector, repetitions: int, seed: int = 0) -> tuple[Array, Array]:
    """Return estimates and standard errors of fits to made-up data: a parametric bootstrap; twin experiments.

    The data are the model's predictions at `truth` with normal noise of each measurement's sigma. Every
    fit starts at the truth and keeps the Jacobian there, whose change is of second order in the noise.

    Args:
        problem: Unknowns and data sets; their values are not used, their sigma is.
        truth: Fitted unknowns.
        repetitions: How many.
        seed: Of the noise.

    Returns:
        Estimates less truth, and standard errors (repetitions, m) each, of the fitted unknowns.
    """
    generator = np.random.default_rng(seed)
    problem.keep_jumps(truth)
    exact, jacobian = problem.predicted(truth), problem.jacobian(truth)
    m = len(problem.unknowns)
    noise = generator.standard_normal((repetitions, len(exact))) * problem.sigma

    def one(k: int) -> tuple[Array, Array]:
        result = problem.fit(exact + noise[k], truth, jacobian)
        values = [(result.params[f"u{i}"].value, result.params[f"u{i}"].stderr) for i in range(m)]
        return np.array([v for v, _ in values]) - np.asarray(truth), np.array([e for _, e in values], dtype=float)

    found = share(problem.comm, repetitions, one)
    return np.array([value for value, _ in found]), np.array([error for _, error in found])


def without_values(one: DataSet, sigma: float) -> DataSet:
    """Return a data set with zero values and this standard deviation: the plan of a measurement."""
    series = tuple(replace(s, values=np.zeros(len(s.values)), sigma=np.full(len(s.values), sigma)) for s in one.series)
    return replace(one, series=series)
