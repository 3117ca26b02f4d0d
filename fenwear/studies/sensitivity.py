"""Derivatives of quantities of interest to keys of a case, and quantities as a function of keys.

Derivatives are central differences of steady states, or of runs with the same jumps, whose meshes, grids and material
properties are updated after the same half-cycles. Every difference is taken with two steps, h and h / 2, and
extrapolated (Richardson): D = (4 D(h/2) - D(h)) / 3; its error is |D(h/2) - D(h)|, of the coarser order. Where it is
too large the step is reduced. The error is that of this step alone: not of the mesh, the positions and the jumps, which
are those of the value itself (`run` has them as numerical uncertainty). A derivative and an error of exactly zero are
held against the change of the quantity by a tenth of the key.

Where contact or scar moves over the mesh such steps are too small. An edge takes its nodes one by one: from one to the
next a computed width, pressure or depth goes another way than over many. Quantities q of a wear contact are near to
powers of their keys x, so that over a window x = x_0 e^t, |t| <= T, which the edge crosses several nodes in,

    ln(q / q_0) = c_0 + c_1 t + c_2 t^2 (+ c_3 t^3)

is fitted by least squares to samples with even steps of t; the derivative is c_1 q_0 / x_0. The residual is the
roughness of the mesh: its standard error times Student's factor, and by what c_3 changes c_1, are the error.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import Any, Literal, Unpack

import numpy as np
from mpi4py import MPI
from scipy.stats import t as student

from fenwear.case import Case
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, ConvergenceError, InputError
from fenwear.common.parallel import on_root
from fenwear.results.disk import finite
from fenwear.studies.model import Model
from fenwear.studies.numeric_keys import Key, find_key, possible, with_values
from fenwear.studies.quantities import NO_PATH, Path, Quantity, evaluate, of_case, parse_quantity
from fenwear.studies.study import Progress, Run, Study, StudyOptions, Values, case_text, named

WINDOWS = (0.6, 0.3, 0.1)  # T, tried until all of the window is possible
SAMPLES = 9
SURE = 0.975  # two-sided: 95 %


def over_window(
    function: Callable[[float], float], value: float, key: float, grain: float = 0.0
) -> tuple[float, float] | None:
    """Return the derivative of a function to a key and its error; None where no window around the key is possible.

    Args:
        function: Of the key, for any other value.
        value: At the key's own value.
        key: That value.
        grain: Largest unnoticed change of a value, as of one that is counted in nodes: where it has not changed by more
            over the window, it may have by so much.
    """
    if key == 0.0 or value == 0.0:
        return None
    for half in WINDOWS:
        t: Array = np.linspace(-half, half, SAMPLES, dtype=np.float64)
        try:
            values = np.array([value if step == 0.0 else function(float(key * np.exp(step))) for step in t])
        except (CaseError, ConvergenceError):
            continue
        ratio = values / value
        if np.isfinite(ratio).all() and (ratio > 0).all():
            slope, error = _slope(t, np.log(ratio))
            if np.ptp(values) < grain:
                error = max(error, grain / abs(value) / (2 * half))
            return slope * value / key, error * abs(value / key)
    return None


def _slope(t: Array, y: Array) -> tuple[float, float]:
    """Return the slope at t = 0 of a parabola through samples, and its error."""
    parabola, cubic = (np.vander(t, order + 1, increasing=True) for order in (2, 3))
    c, rest = np.linalg.lstsq(parabola, y, rcond=None)[:2]
    bent = np.linalg.lstsq(cubic, y, rcond=None)[0]
    free = len(t) - parabola.shape[1]
    variance = float(rest[0]) / free * float(np.linalg.inv(parabola.T @ parabola)[1, 1])
    return float(c[1]), float(student.ppf(SURE, free) * np.sqrt(variance) + abs(bent[1] - c[1]))


STEPS = (1e-3, 1e-4, 1e-5)  # relative to the key's value, tried until the error is small
GOOD = 1e-6  # relative error of a derivative at which the step stays
SURELY = 0.1  # relative change of a key that a quantity without any derivative is held against
ROUNDING = 1e-9  # elasticity below which a derivative is rounding
NONE = 1e-3  # elasticity below which a derivative may have the error of this one
NUMBERS = ("derivative", "error", "elasticity", "low", "high")
Method = Literal["differences", "window"]


@dataclass(frozen=True)
class Derivative:
    """Derivatives of a quantity by a key.

    Attributes:
        key: Its path.
        key_value: In `key_unit`.
        key_unit: The internal one.
        derivative: Of the quantity, in its unit over the key's.
        error: Difference of two steps, or error of a fit over a window, in the same unit; see `error_of`.
        elasticity: Relative change of the quantity over that of the key; NaN where one of them is zero.
        low, high: The quantity with the key smaller and larger by the spread; NaN where that is not possible.
        method: differences, or window.
    """

    key: str
    key_value: float
    key_unit: str
    derivative: float
    error: float
    elasticity: float
    low: float
    high: float
    method: str

    @property
    def shown(self) -> tuple[float, float]:
        """Elasticity and derivative, zero where they are rounding."""
        return (0.0, 0.0) if abs(self.elasticity) < ROUNDING else (self.elasticity, self.derivative)

    @property
    def error_of(self) -> str:
        """Contents of the error: the roughness of the mesh over a window, or the step of the difference alone."""
        return "mesh over a window" if self.method == "window" else "step of the difference"


@dataclass(frozen=True)
class Sensitivity:
    """A quantity and its derivatives.

    Attributes:
        quantity: The quantity's text.
        unit: Its unit.
        value: In that unit.
        spread: Relative change of the keys that `low` and `high` of the derivatives belong to.
        derivatives: To each key.
    """

    quantity: str
    unit: str
    value: float
    spread: float
    derivatives: tuple[Derivative, ...]

    def as_json(self) -> dict[str, Any]:
        """Return the object that --json prints, NaN as null."""
        rows = [{**asdict(row), "error_of": row.error_of} for row in self.derivatives]
        table = {**asdict(self), "derivatives": rows}
        return dict(finite(table))

    def text(self) -> str:
        """Return a table for people, the most influential key first."""
        lines = [f"{self.quantity} = {self.value:.6g} {self.unit}".rstrip()]
        head = f"{100 * self.spread:g} %"
        lines.append(
            f"  {'key':36} {'% per %':>9} {'derivative':>13} {'error':>9}  {'-' + head:>11} {'+' + head:>11}  by"
        )
        for row in self.ranked():
            elasticity, derivative = row.shown
            lines.append(
                f"  {row.key:36} {elasticity:9.4f} {derivative:13.6g} {row.error:9.1e}  "
                f"{row.low:11.5g} {row.high:11.5g}  {row.method}"
            )
        if any(row.method != "window" for row in self.derivatives):
            lines.append("  error: of the step of the difference alone, not of mesh, positions and jumps (see `run`)")
        return "\n".join(lines)

    def ranked(self) -> list[Derivative]:
        """Return the derivatives, the most influential first."""
        return sorted(self.derivatives, key=lambda row: -_influence(row, self.value))


def _influence(row: Derivative, value: float) -> float:
    ends = [abs(end - value) for end in (row.low, row.high) if np.isfinite(end)]
    return max(ends, default=abs(row.elasticity) if np.isfinite(row.elasticity) else 0.0)


def sensitivity(
    case: Case,
    quantities: Sequence[str | Quantity],
    keys: Sequence[str],
    *,
    spread: float = 0.1,
    method: Method | None = None,
    progress: Progress = lambda done, total: None,
    **how: Unpack[StudyOptions],
) -> list[Sensitivity]:
    """Return the sensitivities of quantities to numeric keys of a case; collective. A run of the study is one key.

    Args:
        case: The problem.
        quantities: Such as "depth", "steady pressure" or "cycles until depth 0.2 mm".
        keys: Such as "wear.punch.coefficient".
        spread: Relative change of each key for the tornado plot; 0 for none.
        method: By default over a window where contact or scar grows, and by differences else. Differences that are
            asked for are those of a growing contact's present nodes.
        progress: Called with the numbers of keys done and of all.
        how: Folder, parts, processes, executor and ranks, as `fenwear.studies.StudyOptions`.

    Raises:
        CaseError: a key or a quantity that the case does not have; a key without any value beside its own.
        ConvergenceError: a state did not converge.
        PartDoneError: other parts of the study are not done.
    """
    study = Study(**how)
    if not 0 <= spread < 1:
        raise CaseError(InputError("--spread", f"expected at least 0 and less than 1, got {spread:g}"))
    wanted = [of_case(parse_quantity(q, names=case.names) if isinstance(q, str) else q, case) for q in quantities]
    chosen_keys = [find_key(case, key, "--to") for key in keys]
    if not wanted or not chosen_keys:
        raise CaseError(InputError("--of" if not wanted else "--to", "expected at least one"))
    for key in chosen_keys:
        _sides(case, key)
    model = Model(case)
    bases = on_root(study.comm, lambda: [] if study.collect else _bases(model, wanted))
    store = study.open(case, named(case_text(case), [quantity.text for quantity in wanted], spread, method))
    runs = [Run(key, named(key.path), key.path) for key in chosen_keys]
    done = study.outcomes(_Derivatives(model, wanted, bases, spread, method), runs, store, progress)
    columns = [done[run.name] for run in runs]
    for run, column in zip(runs, columns, strict=True):
        if column.trouble:
            raise ConvergenceError(f"{run.title}: {column.trouble}")

    def of(q: int) -> Sensitivity:
        value = float(columns[0].values["value"][q])
        rows = []
        for key, outcome in zip(chosen_keys, columns, strict=True):
            numbers = {name: float(outcome.values[name][q]) for name in NUMBERS}
            rows.append(Derivative(key.path, key.value, key.unit, method=str(outcome.values["method"][q]), **numbers))
        return Sensitivity(wanted[q].text, wanted[q].unit, value, spread, tuple(rows))

    return [of(q) for q in range(len(wanted))]


def _bases(model: Model, wanted: Sequence[Quantity]) -> list[tuple[float, Path]]:
    """Return each quantity at the keys' own values, and the path on which to compute it nearby.

    Raises:
        CaseError: a level is never reached.
    """
    bases = [evaluate(model, quantity, {}) for quantity in wanted]
    for quantity, (value, _) in zip(wanted, bases, strict=True):
        if not np.isfinite(value):
            raise CaseError(
                InputError("--of", f"{quantity.text!r} is never reached, so it has no derivative. Reduce the level")
            )
    return bases


@dataclass(frozen=True)
class _Derivatives:
    """Computes the derivatives of quantities to one key after another."""

    model: Model
    wanted: Sequence[Quantity]
    bases: Sequence[tuple[float, Path]]
    spread: float
    method: Method | None

    def compute(self, given: Key) -> Values:
        """Return the value of each quantity (q,), the numbers of its derivative, and their method (q,)."""
        derivatives = [self._derivative(*pair, given) for pair in zip(self.wanted, self.bases, strict=True)]
        numbers = dict(zip(NUMBERS, np.array([row for row, _ in derivatives]).T, strict=True))
        values, methods = [value for value, _ in self.bases], [method for _, method in derivatives]
        return {"value": np.array(values), "method": np.array(methods), **numbers}

    def _derivative(
        self, quantity: Quantity, base: tuple[float, Path], key: Key
    ) -> tuple[tuple[float, float, float, float, float], Method]:
        """Return derivative, error, elasticity, and the values at both ends of the spread; and the method."""
        model, (value, path) = self.model, base
        along = NO_PATH if quantity.kind == "life" else path  # with a smaller key a life is longer

        def at(x: float, on: Path) -> float:
            return evaluate(model, quantity, {key.path: x}, path=on)[0]

        by: Method = "differences"
        windowed = None
        if path.rough and self.method != "differences":
            windowed = over_window(lambda x: at(x, along), value, key.value, path.grain)
        if windowed is not None:
            by = "window"
            slope, error = windowed
        else:
            slope, error = _differences(lambda x: at(x, path), model.case, key, abs(value) / _step(key, 1.0))
        wide = self.spread or (SURELY if slope == error == 0 else 0.0)
        low, high = [
            _end(model, quantity, key, factor) if wide > 0 else float("nan") for factor in (1 - wide, 1 + wide)
        ]
        if slope == error == 0 and any(abs(end - value) > GOOD * abs(value) for end in (low, high)):
            slope, error = _coarse((low, high), value, wide * abs(key.value))
        elasticity = slope * key.value / value if key.value != 0 and value != 0 else float("nan")
        return (slope, error, elasticity, low, high), by


def _coarse(ends: Sequence[float], value: float, width: float) -> tuple[float, float]:
    """Return the derivative by the change of a quantity over a wide step, with an error as large."""
    known = [(sign * width, end) for sign, end in zip((-1, 1), ends, strict=True) if np.isfinite(end)]
    if len(known) < len(ends):
        known.append((0.0, value))
    (first, low), (last, high) = sorted(known)
    slope = (high - low) / (last - first)
    return slope, max(abs(high - value), abs(value - low)) / width


def _end(model: Model, quantity: Quantity, key: Key, factor: float) -> float:
    """Return the quantity with the key at another value; NaN where that is not possible."""
    try:
        return evaluate(model, quantity, {key.path: factor * key.value})[0] if key.value else float("nan")
    except (CaseError, ConvergenceError):
        return float("nan")


def _step(key: Key, relative: float) -> float:
    return relative * (abs(key.value) or 1.0)


def _refined(slope: Callable[[float], float], scale: float) -> tuple[float, float]:
    """Return the extrapolated derivative and its error from a slope(h) of second order, for the best of the steps."""
    best = (float("nan"), float("inf"))
    for relative in STEPS:
        coarse, fine = slope(relative), slope(relative / 2)
        error = abs(fine - coarse)
        if error < best[1]:
            best = ((4 * fine - coarse) / 3, error)
        if error <= GOOD * max(abs(fine), NONE * scale):
            break
    if not np.isfinite(best[0]):
        raise ConvergenceError("a derivative has no value: the quantity is not finite beside the key's own value")
    return best


def _sides(case: Case, key: Key) -> tuple[bool, bool]:
    """Return whether values below and above that of a key are possible.

    Raises:
        CaseError: neither is.
    """
    below, above = (possible(case, key.path, key.value + sign * _step(key, STEPS[0])) for sign in (-1, 1))
    if not (below or above):
        raise CaseError(InputError(key.path, f"no value beside {key.value:g} is possible: it has no derivative"))
    return below, above


def _differences(function: Callable[[float], float], case: Case, key: Key, scale: float) -> tuple[float, float]:
    """Return derivative and error by central differences, one-sided where one side is not possible."""
    below, above = _sides(case, key)
    middle = 0.0 if below and above else function(key.value)

    def slope(relative: float) -> float:
        h = _step(key, relative)
        if below and above:
            return (function(key.value + h) - function(key.value - h)) / (2 * h)
        h = h if above else -h
        return (4 * function(key.value + h / 2) - function(key.value + h) - 3 * middle) / h

    return _refined(slope, scale)


KEPT = 64  # Jacobians


class Forward:
    """Quantities of interest of a case as a function of its keys.

    Attributes:
        case: The case.
        quantities: The quantities.
        keys: Keys that they depend on.
    """

    def __init__(self, case: Case, quantities: Sequence[Quantity], keys: Sequence[Key]) -> None:
        self.case, self.quantities, self.keys = case, quantities, keys
        self._model = Model(case)
        self._kept = lru_cache(KEPT)(self._derivatives)

    def values(self, given: Sequence[float]) -> list[float]:
        """Return the quantities at values of the keys (k,).

        Raises:
            CaseError: a value is not possible.
            ConvergenceError: a run or a steady state did not converge.
        """
        return [evaluate(self._model, quantity, self._named(given))[0] for quantity in self.quantities]

    def jacobian(self, given: Sequence[float]) -> Array:
        """Return the derivatives of the quantities to the keys (quantities, keys).

        Raises:
            CaseError, ConvergenceError: as `values`.
        """
        return self._kept(tuple(given))

    def _derivatives(self, given: tuple[float, ...]) -> Array:
        case, paths = with_values(self.case, self._named(given)), [key.path for key in self.keys]
        sensitivities = sensitivity(case, self.quantities, paths, spread=0, comm=MPI.COMM_SELF)
        return np.array([[row.derivative for row in of_quantity.derivatives] for of_quantity in sensitivities])

    def _named(self, given: Sequence[float]) -> dict[str, float]:
        return {key.path: float(value) for key, value in zip(self.keys, given, strict=True)}


def forward(case: Case, quantities: Sequence[str], keys: Sequence[str]) -> Forward:
    """Return quantities of a case as a function of its keys.

    Raises:
        CaseError: one that the case does not have, or none.
    """
    for option, given in (("--of", quantities), ("--to", keys)):
        if not given:
            raise CaseError(InputError(option, "expected at least one"))
    wanted = [of_case(parse_quantity(text, names=case.names), case) for text in quantities]
    return Forward(case, wanted, [find_key(case, key, "--to") for key in keys])
