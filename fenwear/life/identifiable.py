"""What measurements cannot tell: unknowns and combinations of unknowns that the data leave open."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fenwear.arrays import Array
from fenwear.life.data import DataSet

UNKNOWN = 0.5  # standard error, relative to the value, beyond which a combination of unknowns is not known
TOGETHER = 0.95  # correlation that is told
APART = 0.995  # correlation, of data of one condition, from which two unknowns count as one: errors ten times as wide


def without_baselines(weighted: Array, m: int) -> Array:
    """Return the unknowns' columns less what offsets and tilts can take over."""
    own, lines = weighted[:, :m], weighted[:, m:]
    if not lines.shape[1]:
        return own
    return own - lines @ np.linalg.lstsq(lines, own, rcond=None)[0]


def not_determined(keys: Sequence[str], relative: Array) -> list[str]:
    """Return the combinations of unknowns that the data leave open by more than half of their values."""
    _, singular, directions = np.linalg.svd(relative, full_matrices=False)
    lines = []
    for size, direction in zip(singular, directions, strict=True):
        if size * UNKNOWN >= 1:
            continue
        parts = [k for k in range(len(keys)) if abs(direction[k]) > 0.05 * np.abs(direction).max()]
        first = direction / direction[max(parts, key=lambda k: abs(direction[k]))]
        if len(parts) == 1:
            lines.append(f"{keys[parts[0]]}: the data do not determine it within {100 * UNKNOWN:g} %")
            continue
        changes = ", ".join(f"{keys[k]} by {first[k]:+.2g} %" for k in parts)
        lines.append(f"{' and '.join(keys[k] for k in parts)} cannot be told apart: changes of {changes} together "
                     "alter nothing that was measured beyond its noise; give one of them, or data at another "
                     "load")  # fmt: skip
    return lines


def hardly_known(keys: Sequence[str], data: Sequence[DataSet], own: Array) -> list[str]:
    """Return the pairs that one condition tells apart by the finest details of its data only.

    By all columns of the Jacobian, also those of unknowns at a bound: a pair that wanders there is one.
    """
    lengths = np.linalg.norm(own, axis=0)
    if len({one.settings for one in data}) > 1 or not (lengths > 0).all():
        return []
    unit = own / lengths
    inverse = np.linalg.pinv(unit.T @ unit, rcond=1e-15, hermitian=True)
    errors = np.sqrt(np.diag(inverse))
    correlation = inverse / np.outer(errors, errors)
    return [
        f"{keys[j]} and {keys[i]} cannot both be known from one condition: their correlation is "
        f"{correlation[i, j]:.5f}, and errors are more than ten times those of each alone; give one of them, or data "
        "at another load"
        for i in range(len(keys))
        for j in range(i)
        if abs(correlation[i, j]) > APART
    ]


def known_together(keys: Sequence[str], correlation: Array, at_bound: Sequence[str]) -> list[str]:
    """Return what is to be said of unknowns that are known."""
    lines = [
        f"{keys[i]} and {keys[j]} are known together better than alone: correlation {correlation[i, j]:.3f}"
        for i in range(len(keys))
        for j in range(i)
        if abs(correlation[i, j]) > TOGETHER
    ]
    lines += [f"{key} is at a bound: the data want a value beyond it" for key in at_bound]
    return lines
