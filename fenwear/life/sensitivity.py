"""Derivatives of quantities of interest to keys of a case.

Of a steady state by implicit differentiation; of a run, and of what is not differentiable so, such as a steady
state whose materials depend on its temperatures, by central differences of runs with the same jumps, whose meshes,
grids and properties of materials are made anew after the same half-cycles. Every
difference is taken with two steps, h and h / 2, and extrapolated (Richardson): D = (4 D(h/2) - D(h)) / 3; the
error that is told is |D(h/2) - D(h)|, of the coarser order. Where it is too large the step is reduced.

The error that differences and implicit derivatives tell is that of this step alone: not of the mesh, the positions and
the jumps, which are those of the value itself (`run` tells them as numerical uncertainty). A derivative and an error of
exactly zero are held against the change of the quantity by a tenth of the key.

Where contact or scar moves over the mesh such steps are too small: as long as the same nodes are in contact a computed
quantity changes with a key in another way than from node to node. There it is computed at keys over a window that
the edge crosses several nodes in, see `fenwear.life.window`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
from mpi4py import MPI

from fenwear.case import Case
from fenwear.errors import CaseError, ConvergenceError, InputError
from fenwear.life.keys import Key, find_key, with_values
from fenwear.life.linearised import SteadyTangent, differentiable
from fenwear.life.model import Model, Snapshot
from fenwear.life.quantities import Path, Quantity, evaluate, of_case, parse_quantity
from fenwear.life.ranks import everywhere, share
from fenwear.life.window import over_window

STEPS = (1e-3, 1e-4, 1e-5)  # relative to the key's value, tried until the error is small
GOOD = 1e-6  # relative error of a derivative at which the step stays
SURELY = 0.1  # relative change of a key that a quantity without any derivative is held against
NONE = 1e-3  # elasticity below which a derivative may have the error of this one
Method = Literal["implicit", "differences", "window"]


@dataclass(frozen=True)
class Derivative:
    """How a quantity changes with a key.

    Attributes:
        key: Its path.
        key_value: In `key_unit`.
        key_unit: The internal one.
        derivative: Of the quantity, in its unit over the key's.
        error: What two steps differ by, or what a fit over a window leaves open, in the same unit; see `error_of`.
        elasticity: Relative change of the quantity over that of the key; NaN where one of them is zero.
        low, high: The quantity with the key smaller and larger by the spread; NaN where that is not possible.
        method: implicit, differences, or window.
    """

    key: str
    key_value: float
    key_unit: str
    derivative: float
    error: float
    elasticity: float
    low: float
    high: float
    method: Method

    @property
    def error_of(self) -> str:
        """What the error contains: the roughness of the mesh over a window, or the step of the difference alone."""
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
        """Return what --json prints: NaN as null."""
        rows = [
            {
                **{name: None if isinstance(v, float) and not np.isfinite(v) else v for name, v in asdict(row).items()},
                "error_of": row.error_of,
            }
            for row in self.derivatives
        ]
        return {"quantity": self.quantity, "unit": self.unit, "value": self.value, "spread": self.spread,
                "derivatives": rows}  # fmt: skip

    def text(self) -> str:
        """Return a table for people, the most influential key first."""
        lines = [f"{self.quantity} = {self.value:.6g} {self.unit}".rstrip()]
        head = f"{100 * self.spread:g} %"
        lines.append(
            f"  {'key':36} {'% per %':>9} {'derivative':>13} {'error':>9}  {'-' + head:>11} {'+' + head:>11}  by"
        )
        for row in self.ranked():
            lines.append(
                f"  {row.key:36} {row.elasticity:9.4f} {row.derivative:13.5e} {row.error:9.1e}  "
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
    comm: MPI.Comm = MPI.COMM_WORLD,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> list[Sensitivity]:
    """Return the sensitivities of quantities to numeric keys of a case; collective, one key on each rank.

    Args:
        case: The problem.
        quantities: Such as "depth", "steady pressure" or "cycles until depth 0.2 mm".
        keys: Such as "wear.punch.coefficient".
        spread: Relative change of each key for the tornado plot; 0 for none.
        method: By default implicit where that is possible, over a window where contact or scar grows, and by
            differences else. Differences that are asked for are those of a growing contact's present nodes.
        comm: The ranks.
        progress: Told of the derivatives done and of all.

    Raises:
        CaseError: a key or a quantity that the case does not have; a key without any value beside its own.
        ConvergenceError: a state did not converge.
    """
    if not 0 <= spread < 1:
        raise CaseError(InputError("--spread", f"expected at least 0 and less than 1, got {spread:g}"))
    wanted = [of_case(parse_quantity(q, names=case.names) if isinstance(q, str) else q, case) for q in quantities]
    found = [find_key(case, key, "--to") for key in keys]
    if not wanted or not found:
        raise CaseError(InputError("--of" if not wanted else "--to", "expected at least one"))
    model = Model(case)
    bases = everywhere(comm, lambda: [evaluate(model, quantity, {}) for quantity in wanted])
    for quantity, (value, _) in zip(wanted, bases, strict=True):
        if not np.isfinite(value):
            raise CaseError(
                InputError("--of", f"{quantity.text!r} is never reached in this case: it has no derivative")
            )
    methods = [_method(model, quantity, method) for quantity in wanted]
    implicit = "implicit" in methods
    tangent = everywhere(comm, lambda: SteadyTangent(model.system(), model.steady({})) if implicit else None)

    def one(k: int) -> list[Derivative]:
        nearby = None if tangent is None else _Nearby(model, found[k], tangent)
        return [
            _derivative(model, quantity, base, found[k], spread, nearby if by == "implicit" else None, method)
            for quantity, base, by in zip(wanted, bases, methods, strict=True)
        ]

    columns = share(comm, len(found), one, progress)
    return [
        Sensitivity(quantity.text, quantity.unit, value, spread, tuple(column[q] for column in columns))
        for q, (quantity, (value, _)) in enumerate(zip(wanted, bases, strict=True))
    ]


def _implicitly(model: Model) -> bool:
    """Return whether steady states are differentiated implicitly: not where properties are of their own warmth."""
    return not model.warming and differentiable(model.system())


def _method(model: Model, quantity: Quantity, asked: Method | None) -> Method:
    if quantity.kind == "steady" and asked != "differences" and _implicitly(model):
        return "implicit"
    if asked == "implicit":
        raise CaseError(
            InputError("--method", f"{quantity.text!r} is not differentiated implicitly; expected 'differences'")
        )
    return "differences"


def _derivative(
    model: Model,
    quantity: Quantity,
    base: tuple[float, Path],
    key: Key,
    spread: float,
    nearby: _Nearby | None,
    asked: Method | None,
) -> Derivative:
    value, path = base
    scale = abs(value) / _step(key, 1.0)
    along = None if quantity.kind == "life" else path  # with a smaller key a life is longer

    def at(x: float, on: Path | None) -> float:
        return evaluate(model, quantity, {key.path: x}, path=on)[0]

    by: Method = "differences" if nearby is None else "implicit"
    windowed = None
    if path.rough and by != asked:
        windowed = over_window(lambda x: at(x, along), value, key.value, path.grain)
    if windowed is not None:
        by = "window"
        slope, error = windowed
    elif nearby is not None:
        slope, error = _refined(lambda relative: nearby.slope(quantity, relative), scale)
    else:
        slope, error = _differences(lambda x: at(x, path), model.case, key, scale)
    wide = spread or (SURELY if slope == error == 0 else 0.0)
    ends = [_end(model, quantity, key, factor) if wide > 0 else float("nan") for factor in (1 - wide, 1 + wide)]
    if slope == error == 0 and any(abs(end - value) > GOOD * abs(value) for end in ends):
        slope, error = _coarse(ends, value, wide * abs(key.value))
    elasticity = slope * key.value / value if key.value != 0 and value != 0 else float("nan")
    return Derivative(key.path, key.value, key.unit, slope, error, elasticity, ends[0], ends[1], by)


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


def _possible(case: Case, values: Mapping[str, float]) -> bool:
    try:
        with_values(case, values)
    except CaseError:
        return False
    return True


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
    """Return whether values below and above the key's own are possible.

    Raises:
        CaseError: neither is.
    """
    below, above = (_possible(case, {key.path: key.value + sign * _step(key, STEPS[0])}) for sign in (-1, 1))
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


class _Nearby:
    """The steady states of systems beside the base, to first order; kept for several quantities."""

    def __init__(self, model: Model, key: Key, tangent: SteadyTangent) -> None:
        self._model, self._key, self._tangent = model, key, tangent
        self._sides = _sides(model.case, key)
        self._known: dict[float, tuple[Snapshot, Snapshot, float]] = {}

    def slope(self, quantity: Quantity, relative: float) -> float:
        """Return the derivative of a quantity by steps of this relative size."""
        if relative not in self._known:
            self._known[relative] = self._ends(_step(self._key, relative))
        first, last, width = self._known[relative]
        return (quantity.of_snapshot(last) - quantity.of_snapshot(first)) / width

    def _ends(self, h: float) -> tuple[Snapshot, Snapshot, float]:
        key, (below, above) = self._key, self._sides
        values = (key.value - h if below else key.value, key.value + h if above else key.value)
        first, last = (self._model.system({key.path: x}) for x in values)
        width = values[1] - values[0]
        step = self._tangent.change(first, last)
        factors = [(x - key.value) / width for x in values]
        return (
            self._tangent.snapshot(first, step, factors[0]),
            self._tangent.snapshot(last, step, factors[1]),
            width,
        )
