"""Distributions of keys of a case: given one by one, or together by a calibration.

wear.punch.coefficient = lognormal(4e-8 1/MPa, 50 %)    median and coefficient of variation
contact.friction = normal(0.25, 0.02)                   mean and standard deviation, or its percentage of the mean
motion.amplitude = uniform(1.4 mm, 1.6 mm)              ends
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy import linalg, stats

from fenwear.case import Case
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError
from fenwear.studies.numeric_keys import find_key, nearest_possible, value_of, with_values

RARE = 1e-6  # probability below which an impossible value does not count
_FORM = re.compile(
    r"(?P<kind>\w+)\s*\((?P<first>[^,()]+(\([^()]*\)[^,()]*)?),(?P<second>[^,()]+(\([^()]*\)[^,()]*)?)\)"
)
KINDS = ("normal", "lognormal", "uniform")


@dataclass(frozen=True)
class Scatter:
    """The joint distribution of keys: of each its own, which depend on each other as normal ones do.

    Attributes:
        keys: Their paths.
        marginals: scipy's distributions of their values, in internal units.
        correlation: Of the normal variables behind them (d, d).
        text: For people, one line for each key.
    """

    keys: tuple[str, ...] = ()
    marginals: tuple[Any, ...] = ()
    correlation: Array = field(default_factory=lambda: np.zeros((0, 0)))
    text: tuple[str, ...] = ()

    def sample(self, size: int, seed: int) -> Array:
        """Return values of the keys (size, d)."""
        generator = np.random.default_rng(seed)
        normal = generator.multivariate_normal(np.zeros(len(self.keys)), self.correlation, size, method="eigh")
        columns = [marginal.ppf(stats.norm.cdf(z)) for marginal, z in zip(self.marginals, normal.T, strict=True)]
        return np.column_stack(columns)

    @classmethod
    def joint(
        cls, keys: Sequence[str], values: Sequence[float], covariance: Array, logarithmic: Sequence[bool]
    ) -> Scatter:
        """Return the normal distribution of keys, or of their logarithms.

        Args:
            keys: Their paths.
            values: Mean, or median where logarithmic.
            covariance: Of the values, or of their logarithms (m, m).
            logarithmic: Of each key.
        """
        errors = np.sqrt(np.diag(covariance))
        correlation = np.clip(covariance / np.outer(errors, errors), -1.0, 1.0)
        np.fill_diagonal(correlation, 1.0)
        marginals = tuple(
            stats.lognorm(error, scale=value) if log else stats.norm(value, error)
            for value, error, log in zip(values, errors, logarithmic, strict=True)
        )
        text = tuple(
            f"{key}: {'lognormal, median' if log else 'normal, mean'} {value:.6g}, "
            + (f"standard deviation of the logarithm {error:.3g}" if log else f"standard deviation {error:.3g}")
            for key, value, error, log in zip(keys, values, errors, logarithmic, strict=True)
        )
        return cls(tuple(keys), marginals, correlation, text)

    def and_also(self, other: Scatter) -> Scatter:
        """Return both, independent of each other.

        Raises:
            CaseError: a key is in both.
        """
        twice = [key for key in self.keys if key in other.keys]
        if twice:
            raise CaseError(
                [InputError(f"--scatter {key}", "has a distribution already. Give one for each key") for key in twice]
            )
        return Scatter(
            (*self.keys, *other.keys),
            (*self.marginals, *other.marginals),
            linalg.block_diag(self.correlation, other.correlation),
            (*self.text, *other.text),
        )

    def check(self, case: Case) -> None:
        """Check that no key gets impossible values.

        Raises:
            CaseError: names the key, the value and how probable it is.
        """
        problems = []
        for key, marginal in zip(self.keys, self.marginals, strict=True):
            find_key(case, key, "--scatter")
            for level in (RARE, 0.5, 1 - RARE):
                value = float(marginal.ppf(level))
                try:
                    with_values(case, {key: value})
                except CaseError as error:
                    share = 0.5 if level == 0.5 else self._share_beyond(case, key, marginal, value)
                    problems.append(
                        InputError(
                            f"--scatter {key}",
                            f"gives impossible values with a probability of {100 * share:.2g} %, such as {value:.4g}: "
                            f"{error.problems[0].message}. Use a distribution of possible values, such as lognormal",
                        )
                    )
                    break
        if problems:
            raise CaseError(problems)

    @staticmethod
    def _share_beyond(case: Case, key: str, marginal: Any, impossible: float) -> float:
        """Return the probability of values beyond the limit between the median and an impossible value."""
        limit = float(marginal.cdf(nearest_possible(case, key, float(marginal.median()), impossible)))
        return min(limit, 1 - limit)


def parse_scatter(case: Case, text: str) -> Scatter:
    """Return the distribution of one key from KEY=KIND(FIRST, SECOND), the numbers with units.

    Raises:
        CaseError: no such key or kind, or numbers that make no distribution.
    """
    path, equals, form = (part.strip() for part in text.partition("="))
    match = _FORM.fullmatch(form)
    name = f"--scatter {path}"
    if not equals or not match or match["kind"].lower() not in KINDS:
        raise CaseError(
            InputError("--scatter", f"expected KEY=KIND(FIRST, SECOND) with {', '.join(KINDS)}, got {text!r}")
        )
    find_key(case, path, "--scatter")
    kind, first, second = match["kind"].lower(), match["first"].strip(), match["second"].strip()
    middle = value_of(case, path, first, "--scatter")
    if kind == "uniform":
        high = value_of(case, path, second, "--scatter")
        if not middle < high:
            raise CaseError(InputError(name, f"expected ends that rise, got {form!r}"))
        line = f"{path}: uniform from {middle:.6g} to {high:.6g}"
        return Scatter((path,), (stats.uniform(middle, high - middle),), np.eye(1), (line,))
    spread = _spread(case, path, name, middle, second)
    if kind == "normal":
        line = f"{path}: normal, mean {middle:.6g}, standard deviation {spread:.4g}"
        return Scatter((path,), (stats.norm(middle, spread),), np.eye(1), (line,))
    if middle <= 0:
        raise CaseError(InputError(name, f"expected a median above zero, got {first!r}"))
    variation = spread / middle
    width = float(np.sqrt(np.log1p(variation**2)))
    line = f"{path}: lognormal, median {middle:.6g}, coefficient of variation {100 * variation:.3g} %"
    return Scatter((path,), (stats.lognorm(width, scale=middle),), np.eye(1), (line,))


def _spread(case: Case, path: str, name: str, middle: float, text: str) -> float:
    """Return a standard deviation, given as such or as a percentage."""
    percentage = re.fullmatch(r"([\d.eE+-]+)\s*%", text)
    try:
        spread = abs(middle) * float(percentage[1]) / 100 if percentage else value_of(case, path, text, "--scatter")
    except ValueError:
        raise CaseError(InputError(name, f"expected a percentage such as 50 %, got {text!r}")) from None
    if not spread > 0:
        raise CaseError(InputError(name, f"expected a spread above zero, got {text!r}"))
    return spread


def load_scatter(path: Path, case: Case) -> Scatter:
    """Return the joint distribution that a calibration has left in its calibration.json.

    Raises:
        CaseError: the file is none, or its data do not determine the unknowns.
    """
    place = path / "calibration.json" if path.is_dir() else path
    try:
        stored = json.loads(place.read_text("utf-8"))
        rows, covariance = stored["unknowns"], stored["covariance"]
        keys, values = [row["key"] for row in rows], [float(row["value"]) for row in rows]
        logarithmic = [bool(row["logarithmic"]) for row in rows]
        not_known = list(stored["not_known"])
    except OSError as error:
        raise CaseError(InputError(f"--from {place}", f"cannot be read: {error.strerror}")) from None
    except (ValueError, KeyError, TypeError):
        raise CaseError(InputError(f"--from {place}", "is not what `fenwear calibrate` writes")) from None
    if not_known or covariance is None:
        lines = not_known or ["its unknowns have no standard errors"]
        raise CaseError([InputError(f"--from {place}", f"gives no distribution: {line}") for line in lines])
    for key in keys:
        find_key(case, key, f"--from {place}:")
    return Scatter.joint(keys, values, np.array(covariance, dtype=float), logarithmic)
