"""The least-squares problem of a calibration: chi^2 = sum ((prediction - value) / sigma)^2.

Limits of measurements are found: unknowns and combinations of unknowns that the data leave open. The predictions of
one point under one condition are a run of the study (`fenwear.studies.study`). Ranks and parts share the runs of a
point, and of its differences; each part computes the fit itself, with the runs of all.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from fenwear.case import Case
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, ConvergenceError, InputError
from fenwear.common.parallel import Team
from fenwear.common.progress import Log, now_and_then
from fenwear.studies.measured_data import DataSet
from fenwear.studies.model import Model
from fenwear.studies.numeric_keys import Unknown, scaled
from fenwear.studies.predictor import Predictor
from fenwear.studies.study import Outcome, Run, Store, Study, named

UNKNOWN = 0.5  # standard error, relative to the value, beyond which a combination of unknowns is not known
TOGETHER = 0.95  # correlation that is told
APART = 0.995  # correlation, of data of one condition, from which two unknowns count as one: errors ten times as wide


def without_baselines(weighted: Array, m: int) -> Array:
    """Return the unknowns' columns less what offsets and tilts can take over."""
    columns, lines = weighted[:, :m], weighted[:, m:]
    if not lines.shape[1]:
        return columns
    return columns - lines @ np.linalg.lstsq(lines, columns, rcond=None)[0]


def not_determined(keys: Sequence[str], relative: Array) -> list[str]:
    """Return the combinations of unknowns that the data leave open by more than half of their values."""
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
        lines.append(f"{' and '.join(keys[k] for k in parts)} cannot be separated: changes of {changes} together "
                     "alter nothing that was measured beyond its noise; give one of them, or data at another "
                     "load")  # fmt: skip
    return lines


def hardly_known(keys: Sequence[str], data: Sequence[DataSet], columns: Array) -> list[str]:
    """Return the pairs that the data of one condition can hardly separate.

    By all columns of the Jacobian, also those of unknowns at a bound: a pair that wanders there is one.
    """
    lengths = np.linalg.norm(columns, axis=0)
    if len({data_set.settings for data_set in data}) > 1 or not (lengths > 0).all():
        return []
    unit = columns / lengths
    inverse = np.linalg.pinv(unit.T @ unit, rcond=1e-15, hermitian=True)
    errors = np.sqrt(np.diag(inverse))
    correlation = inverse / np.outer(errors, errors)
    return [
        f"{keys[j]} and {keys[i]} cannot both be known from one condition: their correlation is "
        f"{correlation[i, j]:.5f}. Errors are more than ten times those of each alone. Set one of them, or add data "
        "at another load"
        for i in range(len(keys))
        for j in range(i)
        if abs(correlation[i, j]) > APART
    ]


def known_together(keys: Sequence[str], correlation: Array, at_bound: Sequence[str]) -> list[str]:
    """Return the remarks on unknowns that the data determine."""
    lines = [
        f"{keys[i]} and {keys[j]} are known together better than alone: correlation {correlation[i, j]:.3f}"
        for i in range(len(keys))
        for j in range(i)
        if abs(correlation[i, j]) > TOGETHER
    ]
    lines += [f"{key} is at a bound: the best fit lies beyond it" for key in at_bound]
    return lines


STEP = 1e-5  # of the unknowns in the Jacobian, which are of order one
NO_INFLUENCE = 1e-9  # relative change of all predictions over the relative change of an unknown
REFUSED = 1e3  # times what was measured: the prediction of values that the model refuses
MOST_TRIALS = 100
SETTLED = 1e-5  # change of the unknowns over themselves that ends a fit: Newton's next one would be its square
FLAT = 1e-3  # change of chi^2 over itself that ends a fit: a thirtieth of a standard deviation of each measurement
NEAR = 1e-2  # the same of the approach to the fit, which is on jumps of its start
FAR = 10.0  # e-folds that the first step of an approach may go, where logarithms are nearly linear in each other
BASELINES = ("offset", "tilt")

Vector: TypeAlias = Sequence[float] | Array


class LeastSquares:
    """The least-squares problem of data sets and unknowns, kept for fits to several sets of values.

    Attributes:
        store: Keeps the predictions.
        evaluations: Runs computed so far.
    """

    def __init__(
        self,
        case: Case,
        data: Sequence[DataSet],
        unknowns: Sequence[Unknown],
        baseline: Sequence[str] = (),
        progress: Log = lambda message: None,
        study: Study = Study(),  # noqa: B008
    ) -> None:
        """Check the problem; computes nothing. `progress` gets the number of runs.

        Raises:
            CaseError: a key, bound or combination of data that makes no sense.
        """
        self.case, self.study, self.store, self.team = case, study, Store(), Team.of(study.comm)
        self.team.serve(self)
        self._tell = now_and_then(progress)
        self.model = Model(case)
        self.data = list(data)
        self.series = [series for data_set in data for series in data_set.series]
        self.unknowns = [scaled(case, unknown) for unknown in unknowns]
        self.baseline = tuple(baseline)
        self._check(unknowns)
        self.predict = Predictor(self.model, data)
        with np.printoptions(threshold=sys.maxsize, floatmode="unique"):
            self.key = named(self.data)
        self.evaluations = 0
        self._jumps = 0  # how often the jumps that runs follow have changed
        self._computed = False  # whether a trial on them has a prediction
        self.observed = np.concatenate([series.values for series in self.series])
        self.has_sigma = self.series[0].has_sigma
        self.sigma = np.concatenate([series.scale for series in self.series])
        self._lines, self.baseline_names = self._baselines()
        self._reach = self._first_reach()
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
        problems = [
            InputError(f"--unknown {key}", "given twice. Give each key once")
            for key in dict.fromkeys(keys)
            if keys.count(key) > 1
        ]
        for name in self.baseline:
            if name not in BASELINES:
                problems.append(InputError("--baseline", f"expected {' or '.join(BASELINES)}, got {name!r}"))
        if self.baseline and not any(series.is_profile for series in self.series):
            problems.append(InputError("--baseline", "works with profiles only, and the data hold none. Leave it out"))
        for data_set in self.data:
            for setting in data_set.settings:
                key = setting.partition("=")[0]
                if key in keys:
                    problems.append(
                        InputError(
                            f"{data_set.name}: # set {key}",
                            "is an unknown of the calibration, too. Remove this line or --unknown",
                        )
                    )
        kinds = {series.quantity for series in self.series}
        given = {series.has_sigma for series in self.series}
        if len(given) > 1 or (len(kinds) > 1 and given == {False}):
            names = ", ".join(
                dict.fromkeys(without.name for without in self.data if not all(s.has_sigma for s in without.series))
            )
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
            if not series.is_profile:
                continue
            x = series.places
            for name in self.baseline:
                column = np.zeros(len(self.observed))
                column[rows] = 1.0 if name == "offset" else x - (x.min() + x.max()) / 2
                columns.append(column)
                names.append((number, name))
        return (np.array(columns).T if columns else np.zeros((len(self.observed), 0))), names

    def _first_reach(self) -> Array:
        """Return how far the first step of a fit may go, by each parameter: a factor of e; a line through the data.

        scipy's own scale, the Jacobian, lets a fit from zero begin with steps of one standard deviation, and doubles.
        """
        size = float(max(np.abs(self.observed).max(), self.sigma.max()))
        return np.concatenate([np.ones(len(self.unknowns)), size / np.abs(self._lines).max(axis=0)])

    def keep_jumps(self, z: Vector) -> bool:
        """Let the runs from now on jump as those of these fitted unknowns do: predictions are smooth functions then.

        Collective, or for rank 0 that leads. Returns whether they jump otherwise than before.
        """
        self._computed = False
        return bool(self.team.each(self, "keep_own_jumps", z))

    def keep_own_jumps(self, z: Vector) -> bool:
        """Let runs of this rank follow those jumps; return whether they differ from those before."""
        self._jumps += 1
        self.evaluations += len(self.predict.conditions)
        return self.predict.keep_jumps(self.values(z))

    def values(self, z: Vector) -> dict[str, float]:
        """Return the keys' values of fitted unknowns."""
        return {scaled.unknown.key: scaled.value(part) for scaled, part in zip(self.unknowns, z, strict=True)}

    def predicted(self, z: Vector, *, strict: bool = False) -> Array:
        """Return the predictions without baselines (n,); `strict` as of `Predictor`."""
        self.evaluations += len(self.predict.conditions)
        return np.concatenate(self.predict(self.values(z), strict=strict))

    def shared_predictions(self, points: Sequence[Array]) -> list[Outcome]:
        """Return the predictions (n,) without baselines at fitted unknowns; collective, a run for each condition."""
        conditions = list(self.predict.conditions)
        runs = [
            [
                Run((self.values(z), condition), named(self.key, self._jumps, z.tobytes(), condition), str(z))
                for condition in conditions
            ]
            for z in points
        ]
        before = self.store.computed
        done = self.study.outcomes(self.predict, [run for row in runs for run in row], self.store, by_all=True)
        self.evaluations += self.store.computed - before
        return [self._joined([done[run.name] for run in row]) for row in runs]

    def _joined(self, parts: Sequence[Outcome]) -> Outcome:
        """Return the predictions of all series from those under each condition."""
        trouble = next((part.trouble for part in parts if part.trouble), "")
        if trouble:
            return Outcome({}, trouble)
        of = dict(zip(self.predict.conditions, (part.values["prediction"] for part in parts), strict=True))
        predictions, begin = [], dict.fromkeys(of, 0)
        for data_set in self.data:
            for series in data_set.series:
                end = begin[data_set.settings] + len(series.values)
                predictions.append(of[data_set.settings][begin[data_set.settings] : end])
                begin[data_set.settings] = end
        return Outcome({"prediction": np.concatenate(predictions)})

    def _tried(self, z: Array) -> Array:
        """Return the predictions of a trial (n,); far too large where the model rejects it, so that it is not kept.

        Raises:
            ConvergenceError: it is the first one on its jumps.
        """
        (outcome,) = self.team.each(self, "shared_predictions", [z])
        if not outcome.trouble:
            self._computed = True
            return np.asarray(outcome.values["prediction"])
        if not self._computed:
            raise ConvergenceError(outcome.trouble)
        return self.observed + REFUSED * (np.abs(self.observed) + self.sigma)

    def jacobian(self, z: Vector, *, central: bool = False) -> Array:
        """Return the predictions' derivatives by the fitted unknowns (n, m); collective, or for rank 0 that leads.

        Args:
            z: The fitted unknowns.
            central: Whether by differences to both sides, for standard errors; else to one side, for half the runs.

        Raises:
            ConvergenceError: a run beside these unknowns failed.
        """
        at = np.array(z, dtype=float)
        here = self._tried(at)
        steps = np.vstack([side * STEP * np.eye(len(at)) for side in ((1, -1) if central else (1,))])
        outcomes = self.team.each(self, "shared_predictions", list(at + steps))
        for outcome in outcomes:
            if outcome.trouble:
                raise ConvergenceError(outcome.trouble)
        columns = [
            (trial.values["prediction"] - here) / step.sum() for trial, step in zip(outcomes, steps, strict=True)
        ]
        return np.asarray(np.reshape(columns, (-1, *np.shape(columns[: len(at)]))).mean(axis=0).T)

    def check_influence(self, jacobian: Array, z: Vector) -> None:
        """Check that every unknown changes some prediction.

        Raises:
            CaseError: names those that do not.
        """
        scale = float(np.abs(self._tried(np.asarray(z, dtype=float))).max()) or 1.0
        problems = [
            InputError(f"--unknown {scaled.unknown.key}", "has no influence on the measured values. Leave it out")
            for scaled, column in zip(self.unknowns, jacobian.T, strict=True)
            if np.abs(column).max() <= NO_INFLUENCE * scale
        ]
        if problems:
            raise CaseError(problems)

    def cannot_tell(self) -> list[str]:
        """Return the unknowns that these data cannot separate, before any fit; collective.

        Only the places and conditions of the data count, not their values: a plan of a measurement will do.
        """
        jacobian = self.jacobian(np.zeros(len(self.unknowns)))
        weighted = self.whitened(np.hstack([jacobian, self._lines]))
        return hardly_known(
            [scaled.unknown.key for scaled in self.unknowns], self.data, without_baselines(weighted, len(self.unknowns))
        )

    def whitened(self, values: Array) -> Array:
        """Return residuals, or columns of their Jacobian (n, ...), as those of independent errors."""
        rows = np.split(values, np.cumsum([len(series.values) for series in self.series])[:-1])
        return np.concatenate([series.whitened(part) for series, part in zip(self.series, rows, strict=True)])

    def approach(self, start: Array) -> Array:
        """Return fitted unknowns near those of the fit (m,), from any start within the bounds; collective.

        The logarithms of scars, volumes and depths are nearly linear in those of coefficients and loads: where all
        values are above zero, their logarithms are fitted, whatever their sigma.
        """
        if self._lines.shape[1] or not (self.observed > 0).all() or not (self._tried(start) > 0).all():
            return np.asarray(self.fit(start=start, settled=NEAR).x[: len(start)])
        low, high = self._ends()

        def residual(z: Array) -> Array:
            return np.log(np.maximum(self._tried(z) / self.observed, NO_INFLUENCE))

        at = np.clip(start, low, high)
        slope = self.jacobian(at) / self._tried(at)[:, None]

        def derivative(z: Array) -> Array:
            """Return the slope at the start with Broyden's update for the way since, which takes no run."""
            nonlocal at, slope
            way = z - at
            if way.any():
                slope = slope + np.outer(residual(z) - residual(at) - slope @ way, way) / (way @ way)
                at = z.copy()
            return slope

        solution = least_squares(
            residual,
            at,
            derivative,
            (low, high),
            x_scale=np.where([scaled.logarithmic for scaled in self.unknowns], FAR, 1.0),
            xtol=NEAR,
            ftol=NEAR,
            max_nfev=MOST_TRIALS,
        )
        return np.asarray(solution.x)

    def _ends(self) -> Array:
        """Return the bounds of the fitted unknowns (2, m)."""
        ends = [
            [scaled.fitted(b) if np.isfinite(b) else b for b in (scaled.unknown.low, scaled.unknown.high)]
            for scaled in self.unknowns
        ]
        return np.array(ends).T

    def fit(self, start: Vector, settled: float = SETTLED) -> OptimizeResult:
        """Return scipy's result, whose `x` has the fitted unknowns and the baselines; collective.

        Args:
            start: Fitted unknowns to start from.
            settled: Change of the unknowns over themselves that ends the fit.
        """
        m, lines = len(self.unknowns), self._lines.shape[1]
        low, high = np.hstack([self._ends(), np.outer([-np.inf, np.inf], np.ones(lines))])
        z = np.clip(start, low[:m], high[:m])
        traces = self.whitened(self._lines), self.whitened(self.observed - self._tried(z))
        begin = np.concatenate([z, np.linalg.lstsq(*traces, rcond=None)[0]])

        def derivative(both: Array) -> Array:
            return self.whitened(np.hstack([self.jacobian(both[:m]), self._lines]))

        def residual(both: Array) -> Array:
            residuals = self.whitened(self.with_baselines(both) - self.observed)
            size = np.sqrt(np.mean(residuals**2))
            self._tell(f"{self.evaluations:,} runs so far: root mean square of the residuals {size:.3g} sigma")
            return residuals

        result = least_squares(
            residual, begin, derivative, (low, high), x_scale=self._reach, xtol=settled, ftol=FLAT, max_nfev=MOST_TRIALS
        )
        if settled == SETTLED:
            columns = self.jacobian(result.x[:m], central=True)
            result.jac = self.whitened(np.hstack([columns, self._lines]))
        return result

    def with_baselines(self, both: Array) -> Array:
        """Return the predictions (n,) of fitted unknowns and baselines."""
        m = len(self.unknowns)
        return np.asarray(self._tried(np.asarray(both[:m])) + self._lines @ both[m:])
