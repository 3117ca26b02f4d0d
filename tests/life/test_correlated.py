"""Intervals of calibrations whose residuals are correlated: how often they hold the truth, by linear models alone."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy import stats

from fenwear.arrays import Array
from fenwear.life import Series
from fenwear.life.correlated import Correlation

N, REPETITIONS, OUTSIDE = 60, 200, 1e-3  # measurements; repetitions; probability that a right program fails
LEAST, MOST = 0.93, 0.97  # how often 95 % intervals are to hold the truth

Draw = Callable[[np.random.Generator], Array]


def volumes() -> tuple[Series, Array]:
    """Return volumes after equal steps, and their derivative by the coefficient."""
    after = np.arange(1.0, N + 1)
    return Series("volume", "punch", None, after, "cycles", np.zeros(N), None, tuple(range(N))), after[:, None]


def scar() -> tuple[Series, Array]:
    """Return a profile, and the derivative of its depths by the coefficient."""
    x = np.linspace(-1, 1, N)
    series = Series("depth", "punch", 30 * x, np.full(N, 9.0), "cycles", np.zeros(N), None, tuple(range(N)))
    return series, (1.0 + 0.3 * x**2 - 0.2 * x)[:, None]


def rough(draw: np.random.Generator) -> Array:
    """Return a first-order autoregressive sequence with a correlation of 0.9 of neighbours."""
    found = draw.standard_normal(N)
    for k in range(1, N):
        found[k] = 0.9 * found[k - 1] + np.sqrt(1 - 0.9**2) * found[k]
    return found


def holds(correlation: Correlation, jacobian: Array, errors: Array) -> bool:
    """Return whether the interval of the unknown, whose truth is zero, holds it."""
    n, p = jacobian.shape
    step = np.linalg.lstsq(jacobian, -errors, rcond=None)[0]
    residual = errors + jacobian @ step
    found, _ = correlation.test(residual)
    if found is not None:
        low, high = correlation.mixture(residual, 1).interval(0)
    else:
        high = float(
            stats.t.ppf(0.975, n - p) * np.sqrt(residual @ residual / (n - p) / (jacobian[:, 0] @ jacobian[:, 0]))
        )
        low = -high
    return bool(low <= -step[0] <= high)


@pytest.mark.parametrize(
    ("measured", "errors"),
    [
        pytest.param(volumes, lambda draw: draw.standard_normal(N), id="volumes, independent readings"),
        pytest.param(volumes, lambda draw: draw.standard_normal(N).cumsum(), id="volumes, scatter that adds up"),
        pytest.param(scar, lambda draw: draw.standard_normal(N), id="profile, independent readings"),
        pytest.param(scar, rough, id="profile, rough"),
    ],
)
def test_intervals_hold_the_truth_as_often_as_they_say(measured: Any, errors: Draw) -> None:
    """95 % of them, 93 to 97 %, within what chance allows; the full number is in tests/benchmarks/calibration.py."""
    series, jacobian = measured()
    correlation, draw = Correlation([series], jacobian, np.ones(N), has_sigma=False), np.random.default_rng(5)
    held = sum(holds(correlation, jacobian, errors(draw)) for _ in range(REPETITIONS))
    assert stats.binom(REPETITIONS, LEAST).ppf(OUTSIDE) <= held <= stats.binom(REPETITIONS, MOST).ppf(1 - OUTSIDE)


def test_whitened_residuals_are_independent() -> None:
    """L S L^T = 1 and the determinant are those of the dense covariance, of both kinds of series together."""
    (volume, first), (profile, second) = volumes(), scar()
    shuffled = np.random.default_rng(0).permutation(N)
    assert profile.x is not None
    profile = Series(**{**vars(profile), "x": profile.x[shuffled], "after": np.full(N, 7.0)})
    jacobian = np.zeros((2 * N, 2))
    jacobian[:N, :1], jacobian[N:, 1:] = first, second[shuffled]
    correlation = Correlation([volume, profile], jacobian, np.ones(2 * N), has_sigma=False)
    draw = np.random.default_rng(2)
    found, _ = correlation.test(np.concatenate([draw.standard_normal(N).cumsum(), rough(draw)[shuffled]]))
    assert found is not None
    assert "adds up" in found.lines[0]
    assert "roughness" in found.lines[0]
    lower = np.linalg.inv(found.whiten(np.eye(2 * N)))
    covariance = lower @ lower.T
    assert profile.x is not None
    apart = np.abs(np.subtract.outer(profile.x, profile.x))
    length = -apart[0, 1] / np.log(covariance[N, N + 1])
    np.testing.assert_allclose(covariance[N:, N:], np.exp(-apart / length), atol=1e-9)
    ratio = covariance[0, 0] - 1
    added = np.minimum.outer(volume.after, volume.after)
    np.testing.assert_allclose(covariance[:N, :N], np.eye(N) + ratio * added, rtol=1e-7, atol=1e-9)
    assert not covariance[:N, N:].any()


def test_a_few_volumes_cannot_tell_and_that_is_told() -> None:
    """Six readings of which nothing shows: the errors of scatter that adds up are told beside."""
    after = np.arange(1.0, 7.0)
    series = Series("volume", "punch", None, after, "cycles", np.zeros(6), None, tuple(range(6)))
    errors = np.array([0.3, -0.5, 0.2, 0.4, -0.6, 0.2])
    residual = errors - after * (after @ errors) / (after @ after)
    found, lines = Correlation([series], after[:, None], np.ones(6), has_sigma=False).test(residual)
    assert found is None
    assert "too few to tell" in lines[0]
