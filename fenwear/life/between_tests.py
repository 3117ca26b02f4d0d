"""The scatter between tests of the same kind."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fenwear.arrays import Array
from fenwear.errors import CaseError, InputError
from fenwear.life.calibrate import Calibration
from fenwear.life.scatter import Scatter

LEAST_TESTS = 3


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
