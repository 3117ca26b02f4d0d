"""What an experiment of the gallery is, and how a measured value is compared with a predicted one.

The terms are those of ASME V&V 20: the comparison error is E = S - D, with the prediction S and the measured value D.
Its standard uncertainty is u_val = sqrt(u_num^2 + u_input^2 + u_D^2): of the numerical solution, of the inputs, of the
data. The error of the model lies within E ± 2 u_val.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib import resources
from math import hypot, isnan, nan
from typing import Any, Literal

import numpy as np

from fenwear.common.arrays import Array
from fenwear_verify.suite import chosen

Scope = Literal["short", "full"]  # of a computation: short ones have coarser meshes, for the tests


@dataclass(frozen=True)
class Comparison:
    """A measured value and its prediction.

    Attributes:
        what: The quantity, with its unit.
        measured, predicted: D and S.
        u_data: Standard uncertainty of the measured value; NaN where no source states it.
        u_num: Standard uncertainty of the numerical solution, as fenwear reports it.
        u_input: Standard uncertainty that the inputs leave in the prediction.
    """

    what: str
    measured: float
    predicted: float
    u_data: float = nan
    u_num: float = 0.0
    u_input: float = 0.0

    @property
    def error(self) -> float:
        """E = S - D."""
        return self.predicted - self.measured

    @property
    def percent(self) -> float:
        """E over the measured value, %."""
        return 100 * self.error / abs(self.measured)

    @property
    def u_val(self) -> float:
        """Standard uncertainty of E; without that of the data where it is not known."""
        return hypot(self.u_num, self.u_input, 0.0 if isnan(self.u_data) else self.u_data)

    def as_json(self) -> dict[str, Any]:
        """Return the comparison as validation.json has it."""
        return {
            "what": self.what, "measured": self.measured, "predicted": self.predicted, "error": self.error,
            "percent": self.percent, "u_data": None if isnan(self.u_data) else self.u_data, "u_num": self.u_num,
            "u_input": self.u_input, "u_val": self.u_val,
        }  # fmt: skip


@dataclass(frozen=True)
class Curve:
    """A line or points of the figure.

    Attributes:
        name: In the legend.
        x, y: Places and values.
        spread: Half-width of the error bars of points, or of the band about a line; below and above (2, n) where they
            differ; empty for none.
        measured: Whether it is measured (points) or predicted (a line).
    """

    name: str
    x: Array
    y: Array
    spread: Array = field(default_factory=lambda: np.zeros(0))
    measured: bool = False

    def at(self, x: Array) -> Array:
        """Return the values at places (n,), between its own by straight lines."""
        return np.interp(x, self.x, self.y)

    def misfit(self, measured: Curve) -> float:
        """Return the root mean square difference from a measured curve at its places."""
        return root_mean_square(self.at(measured.x) - measured.y)


@dataclass(frozen=True)
class Finding:
    """The outcome of an experiment.

    Attributes:
        number: The one number of the experiment, in words.
        percent: The same as an error, %; NaN for a prediction whose measurement is kept apart.
        comparisons: Values beside each other.
        axes: Labels of x and y with units.
        curves: Of the figure.
        predictions: Rows of a table of predictions that no measurement has been compared with: heading first.
        scales: Of the axes.
    """

    number: str
    percent: float
    comparisons: Sequence[Comparison]
    axes: tuple[str, str]
    curves: Sequence[Curve]
    predictions: Sequence[Sequence[str]] = ()
    scales: tuple[Literal["linear", "log"], Literal["linear", "log"]] = ("linear", "linear")


@dataclass(frozen=True)
class Experiment:
    """A measured experiment of the gallery.

    Attributes:
        name: By which it is asked for.
        title: In a line.
        source: Publication, and the licence of the numbers.
        measured: What was measured, with its scatter.
        given: What the prediction takes from the source.
        calibrated: What is fitted, and to what; "nothing" where nothing is.
        predicted: What is predicted without a fit.
        verdict: What the comparison says of the model, and which law or feature would mend it.
        compute: Computes the prediction and compares; collective.
    """

    name: str
    title: str
    source: str
    measured: str
    given: str
    calibrated: str
    predicted: str
    verdict: str
    compute: Callable[[Scope], Finding]


_EXPERIMENTS: dict[str, Experiment] = {}


def experiment(**about: str) -> Callable[[Callable[[Scope], Finding]], Callable[[Scope], Finding]]:
    """Return the decorator that registers a function as an experiment; takes the texts of `Experiment`."""

    def register(compute: Callable[[Scope], Finding]) -> Callable[[Scope], Finding]:
        _EXPERIMENTS[about["name"]] = Experiment(**about, compute=compute)
        return compute

    return register


def experiments(names: Sequence[str] = ()) -> list[Experiment]:
    """Return the experiments of these names, by default all.

    Raises:
        CaseError: a name that no experiment has.
    """
    return chosen("experiment", _EXPERIMENTS, names)


def table(name: str) -> dict[str, Array]:
    """Return the columns of a file of data/ by their headings; lines that begin with # are remarks."""
    text = (resources.files("fenwear_verify.validation") / "data" / name).read_text("utf-8")
    rows = list(csv.reader(line for line in text.splitlines() if line and not line.startswith("#")))
    values = np.array([[float(cell) for cell in row] for row in rows[1:]])
    return {heading.strip(): values[:, at] for at, heading in enumerate(rows[0])}


def between_factors(values: Array, factor: Array | float) -> Array:
    """Return the spread (2, n) of a band from the values over a factor to the values times it."""
    return np.stack([values - values / factor, values * factor - values])


def root_mean_square(values: Array) -> float:
    """Return sqrt(mean(v^2)) of values (n,), in their unit."""
    return float(np.sqrt(np.mean(np.square(values))))


def percentage_error(predicted: Array, measured: Array) -> float:
    """Return the root mean square percentage error (RMSPE) of predictions (n,), %."""
    return 100 * root_mean_square(predicted / measured - 1)
