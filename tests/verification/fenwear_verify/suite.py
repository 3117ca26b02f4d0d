"""What a verification case is, what it finds, and how the cases are run one after another.

A case is a function that solves a problem with a known answer and returns what it compared. The
decorator `verification` gives it a name, a title and the source of its reference.
"""

from __future__ import annotations

import difflib
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, SupportsFloat, TypeVar

import numpy as np
from numpy.typing import NDArray

from fenwear.common.errors import CaseError, FenwearError, InputError

Verdict = Literal["agrees", "differs", "not run"]
T = TypeVar("T")


@dataclass(frozen=True)
class Row:
    """One comparison.

    Attributes:
        what: What is compared, with its unit.
        reference: The exact or published value.
        ours: fenwear's value.
        error: How far the two are apart, on the scale that the case names.
        tolerance: The largest error that agrees.
        order: Observed order of convergence, where there is one.
    """

    what: str
    reference: float
    ours: float
    error: float
    tolerance: float
    order: float | None = None

    @property
    def agrees(self) -> bool:
        """Whether the error is within the tolerance; a NaN never is."""
        return bool(self.error <= self.tolerance)


def number(
    what: str,
    reference: SupportsFloat,
    ours: SupportsFloat,
    tolerance: float,
    *,
    scale: float | None = None,
    order: float | None = None,
) -> Row:
    """Compare two numbers; the error is relative to `scale`, by default to the reference."""
    exact, found = float(reference), float(ours)
    return Row(what, exact, found, abs(found - exact) / (abs(exact) if scale is None else scale), tolerance, order)


def profile(
    what: str, reference: NDArray[Any], ours: NDArray[Any], tolerance: float, *, scale: float | NDArray[Any] = 1.0
) -> Row:
    """Compare two fields; the row shows the place where they differ most, relative to `scale`."""
    errors = np.abs(ours - reference) / scale
    worst = np.unravel_index(np.argmax(np.nan_to_num(errors, nan=np.inf)), errors.shape)
    return Row(what, float(reference[worst]), float(ours[worst]), float(errors[worst]), tolerance)


def observed_order(errors: Sequence[float] | NDArray[Any], ratio: float = 2.0) -> float:
    """Return the order at which errors fall from the last refinement but one, by `ratio`, to the last."""
    return float(np.log(errors[-2] / errors[-1]) / np.log(ratio))


def order(
    what: str, expected: float, errors: Sequence[float] | NDArray[Any], tolerance: float, *, ratio: float = 2.0
) -> Row:
    """Compare the order at which errors fall with refinement with the theory's."""
    found = observed_order(errors, ratio)
    return Row(what, expected, found, abs(found - expected), tolerance, found)


@dataclass(frozen=True)
class Line:
    """A line of a plot: markers for fenwear's own values, none for the reference's."""

    name: str
    x: NDArray[Any]
    y: NDArray[Any]
    reference: bool = False


@dataclass(frozen=True)
class Plot:
    """A picture of a comparison.

    Attributes:
        title: What it shows.
        x_label, y_label: Quantities with their units.
        lines: What is drawn.
        scales: Of the two axes.
        orders: Orders of convergence, one for each line, drawn as triangles; none by default.
    """

    title: str
    x_label: str
    y_label: str
    lines: Sequence[Line]
    scales: tuple[Literal["linear", "log"], Literal["linear", "log"]] = ("linear", "linear")
    orders: Sequence[float] = ()


@dataclass(frozen=True)
class Result:
    """What a case found.

    Attributes:
        rows: Its comparisons.
        plots: Its pictures.
        note: Why there is nothing to compare, or what went wrong.
    """

    rows: Sequence[Row] = ()
    plots: Sequence[Plot] = ()
    note: str = ""


@dataclass(frozen=True)
class VerificationCase:
    """A problem whose answer is known.

    Attributes:
        name: By which it is asked for.
        title: The problem in a line.
        source: Where the reference comes from.
        compute: Solves the problem and compares; collective.
        slow: Whether it takes longer than ten seconds.
    """

    name: str
    title: str
    source: str
    compute: Callable[[], Result]
    slow: bool = False


@dataclass(frozen=True)
class Outcome:
    """A case with what it found and the time that it took, s."""

    case: VerificationCase
    result: Result
    seconds: float
    failed: bool = field(default=False, kw_only=True)

    @property
    def verdict(self) -> Verdict:
        """Whether all of its rows agree."""
        if self.failed or not all(row.agrees for row in self.result.rows):
            return "differs"
        return "agrees" if self.result.rows else "not run"

    def as_json(self) -> dict[str, Any]:
        """Return what verification.json holds of it."""
        rows = [
            {
                "what": row.what,
                "reference": row.reference,
                "ours": row.ours,
                "error": row.error if np.isfinite(row.error) else None,
                "tolerance": row.tolerance,
                "order": row.order,
                "agrees": row.agrees,
            }
            for row in self.result.rows
        ]
        return {
            "name": self.case.name,
            "title": self.case.title,
            "source": self.case.source,
            "verdict": self.verdict,
            "seconds": round(self.seconds, 3),
            "note": self.result.note,
            "rows": rows,
        }


_CASES: dict[str, VerificationCase] = {}


def verification(
    name: str, title: str, source: str, *, slow: bool = False
) -> Callable[[Callable[[], Result]], Callable[[], Result]]:
    """Return the decorator that registers a function as the verification case `name`."""

    def register(compute: Callable[[], Result]) -> Callable[[], Result]:
        _CASES[name] = VerificationCase(name, title, source, compute, slow)
        return compute

    return register


def registered(names: Sequence[str] = (), besides: Sequence[str] = ()) -> list[VerificationCase]:
    """Return the cases of these names, by default all that are registered.

    Args:
        names: Asked for, with --only.
        besides: Names among them that the caller knows and no case has.

    Raises:
        CaseError: a name that no case has.
    """
    return chosen("verification case", _CASES, names, besides)


def chosen(kind: str, known: Mapping[str, T], names: Sequence[str], besides: Sequence[str] = ()) -> list[T]:
    """Return what is known by these names, by default all.

    Args:
        kind: What a name stands for, in the words of an error.
        known: By name.
        names: Asked for, with --only.
        besides: Names among them that are not known here, but to the caller.

    Raises:
        CaseError: a name that nothing has.
    """
    every = [*known, *besides]
    problems = []
    for name in names:
        if name not in every:
            close = difflib.get_close_matches(name, every, n=1)
            hint = f"did you mean {close[0]!r}?" if close else f"expected one of {', '.join(every)}"
            problems.append(InputError("--only", f"no {kind} {name!r}; {hint}"))
    if problems:
        raise CaseError(problems)
    return [known[name] for name in names if name in known] if names else list(known.values())


def run_cases(cases: Sequence[VerificationCase]) -> Iterator[Outcome]:
    """Compute the cases one after another; collective.

    An error that fenwear raises on purpose counts as a case that differs: the others go on.
    """
    for case in cases:
        begin = time.perf_counter()
        try:
            result, failed = case.compute(), False
        except FenwearError as error:
            result, failed = Result(note=f"{type(error).__name__}: {error}"), True
        yield Outcome(case, result, time.perf_counter() - begin, failed=failed)
