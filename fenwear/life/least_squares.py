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
from fenwear.life.unknowns import Unknown, scaled
from fenwear.parallel import Team
from fenwear.progress import Log, now_and_then

STEP = 1e-5  # of the unknowns in the Jacobian, which are of order one
NO_INFLUENCE = 1e-9  # relative change of all predictions over the relative change of an unknown
KEPT = 16  # predictions
REFUSED = 1e3  # times what was measured: the prediction of values that the model refuses
MOST_TRIALS = 100
SETTLED = 1e-5  # change of the unknowns over themselves that ends a fit: Newton's next one would be its square
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
    ) -> None:
        """Check what is asked for; computes nothing. `progress` is told now and then of the runs that are done.

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
        self._known: dict[bytes, Array] = {}  # predictions of fitted unknowns, on the jumps kept
        self._derivatives: dict[bytes, Array] = {}  # of predictions at the last of them, on every rank
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
        return bool(self.team.each(self, "keep_own_jumps", z))

    def keep_own_jumps(self, z: Vector) -> bool:
        """Do so on this rank."""
        if not self.predict.keep_jumps(self.values(z)):
            return False
        self._known.clear()
        self._derivatives.clear()
        return True

    def values(self, z: Vector) -> dict[str, float]:
        """Return the keys' values of fitted unknowns."""
        return {one.unknown.key: one.value(part) for one, part in zip(self.unknowns, z, strict=True)}

    def predicted(self, z: Vector, *, strict: bool = False) -> Array:
        """Return the predictions without baselines (n,); `strict` as of `Predictor`."""
        found = np.concatenate(self.predict(self.values(z), strict=strict))
        self._tell(f"{self.model.evaluations:,} runs done")
        return found

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
        """Return the predictions' derivatives by the fitted unknowns (n, m); collective, or for rank 0 that leads."""
        return np.asarray(self.team.each(self, "shared_jacobian", np.array(z, dtype=float)))

    def shared_jacobian(self, base: Array) -> Array:
        """Return the same, one column on each rank; collective."""
        key = base.tobytes()
        if key in self._derivatives:
            return self._derivatives[key]

        def shifted(k: int) -> Array:
            ends = []
            for sign in (-1, 1):
                moved = base.copy()
                moved[k] += sign * STEP
                ends.append(self.predicted(moved))
            return np.asarray((ends[1] - ends[0]) / (2 * STEP))

        found = np.array(share(self.comm, len(base), shifted), dtype=float).T
        self._derivatives = {key: found}
        return found

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

    def fit(
        self,
        observed: Array | None = None,
        start: Vector | None = None,
        jacobian: Array | None = None,
    ) -> OptimizeResult:
        """Return scipy's result, whose `x` has the fitted unknowns and the baselines; collective.

        Args:
            observed: Values in place of the measured ones (n,).
            start: Fitted unknowns to start from; by default zero, the start of each.
            jacobian: Of the predictions (n, m), kept instead of computed anew in each step: for data near those
                it belongs to.
        """
        values = self.observed if observed is None else observed
        m, lines = len(self.unknowns), self._lines.shape[1]
        ends = [[one.fitted(b) if np.isfinite(b) else b for b in (one.unknown.low, one.unknown.high)]
                for one in self.unknowns]  # fmt: skip
        low, high = np.array([*ends, *[[-np.inf, np.inf]] * lines]).T
        begin = np.clip(np.concatenate([np.zeros(m) if start is None else start, np.zeros(lines)]), low, high)

        def derivative(both: Array) -> Array:
            columns = self.jacobian(both[:m]) if jacobian is None else jacobian
            return self.whitened(np.hstack([columns, self._lines]))

        def residual(both: Array) -> Array:
            return self.whitened(self.with_baselines(both) - values)

        return least_squares(
            residual, begin, derivative, (low, high), x_scale=self._reach, xtol=SETTLED, max_nfev=MOST_TRIALS
        )

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
