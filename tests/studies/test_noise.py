"""Scatter of measurements: how often intervals hold the truth, by linear models alone."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from fenwear import CaseError, load_case
from fenwear.common.arrays import Array
from fenwear.studies import Noise, read_data
from fenwear.studies.measured_data import NONE

REPETITIONS, OUTSIDE = 2000, 1e-4  # probability that a right program fails


def rough(draw: np.random.Generator, n: int) -> Array:
    """Return an autoregressive sequence whose neighbours have the correlation exp(-1/5)."""
    alike = np.exp(-0.2)
    found = draw.standard_normal(n)
    for k in range(1, n):
        found[k] = alike * found[k - 1] + np.sqrt(1 - alike**2) * found[k]
    return found


@pytest.mark.parametrize("n", [4, 8, 60])
@pytest.mark.parametrize("kind", ["independent", "adds up", "alike over 5 mm"])
def test_intervals_hold_the_truth_as_often_as_they_say(kind: str, n: int) -> None:
    """95 %, with few points, too: eight that add up were covered in 68 % of the cases (issue 51, line 20)."""
    noise, draw = Noise.parse(kind), np.random.default_rng(5)
    after = np.arange(1.0, n + 1)
    x = after if noise.kind == "alike" else NONE
    column = np.ones(n) if noise.kind == "alike" else after
    j = noise.whitened(column, NONE, x, after)
    held = 0
    for _ in range(REPETITIONS):
        errors = rough(draw, n) if noise.kind == "alike" else draw.standard_normal(n)
        errors = errors.cumsum() if noise.kind == "adds up" else errors
        r = noise.whitened(errors, NONE, x, after)
        found = j @ r / (j @ j)
        scale = np.sqrt(((r - j * found) ** 2).sum() / (n - 1) / (j @ j))
        held += abs(found) < stats.t.ppf(0.975, n - 1) * scale
    chance = stats.binom(REPETITIONS, 0.95)
    assert chance.ppf(OUTSIDE) <= held <= chance.ppf(1 - OUTSIDE)


def test_increments_scatter_with_the_sliding_between_them() -> None:
    """L S L^T = 1 for S_ij = min(s_i, s_j), up to one factor; a sigma is that of each increment."""
    after = np.array([1.0, 2.0, 5.0, 9.0])
    lower = Noise("adds up").whitened(np.eye(4), NONE, NONE, after)
    whole = lower @ np.minimum.outer(after, after) @ lower.T
    assert whole == pytest.approx(whole[0, 0] * np.eye(4), abs=1e-12)
    sigma = np.array([1.0, 1.0, 2.0, 4.0])
    assert Noise("adds up").whitened(sigma.cumsum(), sigma, NONE, after) == pytest.approx(np.ones(4))


@pytest.mark.parametrize(
    ("line", "column", "key"),
    [
        ("normal", "volume (mm^3)", "# scatter"),
        ("adds up", "friction (1)", "# scatter"),
        ("alike over 1 mm", "volume (mm^3)", "# scatter"),
        ("alike over 0 mm", "volume (mm^3)", "# scatter"),
        ("alike over 1 kg", "volume (mm^3)", "# scatter"),
    ],
)
def test_scatter_that_a_quantity_cannot_have(tmp_path, line: str, column: str, key: str) -> None:
    path = tmp_path / "data.csv"
    path.write_text(f"# scatter = {line}\nafter (cycles), {column}\n1, 0.1\n2, 0.2\n3, 0.3\n")
    with pytest.raises(CaseError, match=key):
        read_data(path, load_case("example2"))
