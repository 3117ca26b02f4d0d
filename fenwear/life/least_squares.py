"""The least-squares problem of a calibration: chi^2 = sum ((prediction - value) / sigma)^2, and twin experiments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from mpi4py import MPI
from scipy.optimize import OptimizeResult, least_squares

from fenwear.arrays import Array
from fenwear.case import Case
from fenwear.errors import CaseError, ConvergenceError, InputError
from fenwear.life.data import DataSet
from fenwear.life.identifiable import hardly_known, without_baselines
from fenwear.life.model import Model
from fenwear.life.predictor import Predictor
from fenwear.life.ranks import share
from fenwear.life.trials import Trials
from fenwear.life.unknowns import Unknown, scaled
from fenwear.parallel import Team
from fenwear.progress import Log, now_and_then

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
    """The least-squares problem of data sets and unknowns, kept for fits to several sets of values."""

    def __init__(
        self,
        case: Case,
        data: Sequence[DataSet],
        unknowns: Sequence[Unknown],
        baseline: Sequence[str] = (),
        comm: MPI.Comm = MPI.COMM_WORLD,
        progress: Log = lambda message: None,
        trials: Trials | None = None,
    ) -> None:
        """Check the problem; computes nothing. `progress` gets the number of runs, `trials` keeps their predictions.

        Raises:
            CaseError: a key, bound or combination of data that makes no sense.
        """
        self.case, self.comm, self.team = case, comm, Team.of(comm)
        self.team.serve(self)
        self._tell = now_and_then(progress)
        self.model = Model(case)
        self.data = list(data)
        self.series = [series for one in data for series in one.series]
        self.unknowns = [scaled(case, unknown) for unknown in unknowns]
        self.baseline = tuple(baseline)
        self._check(unknowns)
        self.predict = Predictor(self.model, data)
        self.trials = Trials() if trials is None else trials
        self._jumps = 0  # how often the jumps that runs follow have changed
        self._computed = False  # whether a trial on them has a prediction
        self.observed = np.concatenate([series.values for series in self.series])
        self.has_sigma = self.series[0].sigma is not None
        self.sigma = np.concatenate([np.ones(len(s.values)) if s.sigma is None else s.sigma for s in self.series])
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
        self._jumps += 1
        self._computed = False
        return bool(self.team.each(self, "keep_own_jumps", z))

    def keep_own_jumps(self, z: Vector) -> bool:
        """Let runs of this rank follow those jumps; return whether they differ from those before."""
        return self.predict.keep_jumps(self.values(z))

    def values(self, z: Vector) -> dict[str, float]:
        """Return the keys' values of fitted unknowns."""
        return {one.unknown.key: one.value(part) for one, part in zip(self.unknowns, z, strict=True)}

    def predicted(self, z: Vector, *, strict: bool = False) -> Array:
        """Return the predictions without baselines (n,); `strict` as of `Predictor`."""
        return np.concatenate(self.predict(self.values(z), strict=strict))

    def _tried(self, z: Array) -> Array:
        """Return the predictions of a trial (n,); far too large where the model rejects it, so that it is not kept."""
        kind = f"prediction {self._jumps}"
        known = self.trials.get(kind, z)
        if known is not None:
            return known
        try:
            found = self.trials.put(kind, z, self.predicted(z))
            self._computed = True
            return found
        except (CaseError, ConvergenceError):
            if not self._computed:
                raise
            return self.trials.put(kind, z, self.observed + REFUSED * (np.abs(self.observed) + self.sigma))

    def jacobian(self, z: Vector, *, central: bool = False) -> Array:
        """Return the predictions' derivatives by the fitted unknowns (n, m); collective, or for rank 0 that leads.

        Args:
            z: The fitted unknowns.
            central: Whether by differences to both sides, for standard errors; else to one side, for half the runs.
        """
        at = np.array(z, dtype=float)
        if central:
            return (self.jacobian(at) + self._one_sided(at, -STEP)) / 2
        return self._one_sided(at, STEP)

    def _one_sided(self, at: Array, step: float) -> Array:
        kind = f"derivative {self._jumps} {step}"
        known = self.trials.get(kind, at)
        if known is not None:
            return known
        here = self._tried(at)
        return self.trials.put(kind, at, np.asarray(self.team.each(self, "shared_jacobian", at, here, step)))

    def shared_jacobian(self, base: Array, here: Array, step: float) -> Array:
        """Return the derivatives by differences to the predictions `here`, one column on each rank; collective."""

        def shifted(k: int) -> Array:
            return np.asarray((self.predicted(base + step * np.eye(len(base))[k]) - here) / step)

        return np.array(share(self.comm, len(base), shifted), dtype=float).T

    def check_influence(self, jacobian: Array, z: Vector) -> None:
        """Check that every unknown changes some prediction.

        Raises:
            CaseError: names those that do not.
        """
        scale = float(np.abs(self._tried(np.asarray(z, dtype=float))).max()) or 1.0
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
        weighted = self.whitened(np.hstack([jacobian, self._lines]))
        return hardly_known(
            [one.unknown.key for one in self.unknowns], self.data, without_baselines(weighted, len(self.unknowns))
        )

    def whitened(self, values: Array) -> Array:
        """Return residuals, or columns of their Jacobian (n, ...), as those of independent errors."""
        rows = np.split(values, np.cumsum([len(series.values) for series in self.series])[:-1])
        return np.concatenate([series.whitened(own) for series, own in zip(self.series, rows, strict=True)])

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

        found = least_squares(
            residual,
            at,
            derivative,
            (low, high),
            x_scale=np.where([one.logarithmic for one in self.unknowns], FAR, 1.0),
            xtol=NEAR,
            ftol=NEAR,
            max_nfev=MOST_TRIALS,
        )
        return np.asarray(found.x)

    def _ends(self) -> Array:
        """Return the bounds of the fitted unknowns (2, m)."""
        ends = [
            [one.fitted(b) if np.isfinite(b) else b for b in (one.unknown.low, one.unknown.high)]
            for one in self.unknowns
        ]
        return np.array(ends).T

    def fit(
        self,
        observed: Array | None = None,
        start: Vector | None = None,
        jacobian: Array | None = None,
        settled: float = SETTLED,
    ) -> OptimizeResult:
        """Return scipy's result, whose `x` has the fitted unknowns and the baselines; collective.

        Args:
            observed: Values in place of the measured ones (n,).
            start: Fitted unknowns to start from; by default zero, the start of each.
            jacobian: Of the predictions (n, m), kept instead of computed anew in each step: for data near those
                it belongs to.
            settled: Change of the unknowns over themselves that ends the fit.
        """
        values = self.observed if observed is None else observed
        m, lines = len(self.unknowns), self._lines.shape[1]
        low, high = np.hstack([self._ends(), np.outer([-np.inf, np.inf], np.ones(lines))])
        z = np.clip(np.zeros(m) if start is None else start, low[:m], high[:m])
        traces = self.whitened(self._lines), self.whitened(values - self._tried(z))
        begin = np.concatenate([z, np.linalg.lstsq(*traces, rcond=None)[0]])

        def derivative(both: Array) -> Array:
            columns = self.jacobian(both[:m]) if jacobian is None else jacobian
            return self.whitened(np.hstack([columns, self._lines]))

        def residual(both: Array) -> Array:
            found = self.whitened(self.with_baselines(both) - values)
            self._tell(f"{self.model.evaluations:,} runs, residual {np.sqrt(np.mean(found**2)):.3g} sigma or units")
            return found

        result = least_squares(
            residual, begin, derivative, (low, high), x_scale=self._reach, xtol=settled, ftol=FLAT, max_nfev=MOST_TRIALS
        )
        if jacobian is None and settled == SETTLED:
            columns = self.jacobian(result.x[:m], central=True)
            result.jac = self.whitened(np.hstack([columns, self._lines]))
        return result

    def with_baselines(self, both: Array) -> Array:
        """Return the predictions (n,) of fitted unknowns and baselines."""
        m = len(self.unknowns)
        return np.asarray(self._tried(np.asarray(both[:m])) + self._lines @ both[m:])


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
    colour = np.linalg.inv(problem.whitened(np.eye(len(exact))))
    noise = generator.standard_normal((repetitions, len(exact))) @ colour.T

    def one(k: int) -> tuple[Array, Array]:
        result = problem.fit(exact + noise[k], truth, jacobian)
        covariance = np.linalg.inv(result.jac.T @ result.jac)
        scale = 1.0 if problem.has_sigma else np.sqrt(2 * result.cost / (len(exact) - len(result.x)))
        return result.x[:m] - np.asarray(truth), scale * np.sqrt(np.diag(covariance)[:m])

    found = share(problem.comm, repetitions, one)
    return np.array([value for value, _ in found]), np.array([error for _, error in found])


def without_values(one: DataSet, sigma: float) -> DataSet:
    """Return a data set with zero values and this standard deviation: the plan of a measurement."""
    series = tuple(replace(s, values=np.zeros(len(s.values)), sigma=np.full(len(s.values), sigma)) for s in one.series)
    return replace(one, series=series)
