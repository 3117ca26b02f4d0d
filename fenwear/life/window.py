"""Derivatives of what is rough from node to node and smooth beyond: a fit over a window of the key.

An edge that moves over a mesh takes its nodes one by one. From one to the next a computed width, pressure or depth goes
another way than it does over many: its slope at a point says little, however small the step is. Quantities q of a wear
contact are near to powers of their keys x, so that over a window x = x_0 e^t, |t| <= T,

    ln(q / q_0) = c_0 + c_1 t + c_2 t^2 (+ c_3 t^3)

is fitted by least squares to samples with even steps of t; the derivative is c_1 q_0 / x_0. What the fit leaves
is the roughness of the mesh: its standard error times Student's factor, and by what c_3 changes c_1, are the
error that is told.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.stats import t as student

from fenwear.arrays import Array
from fenwear.errors import CaseError, ConvergenceError

WINDOWS = (0.6, 0.3, 0.1)  # T, tried until all of the window is possible
SAMPLES = 13
SURE = 0.975  # two-sided: 95 %


def over_window(
    function: Callable[[float], float], value: float, key: float, grain: float = 0.0
) -> tuple[float, float] | None:
    """Return the derivative of a function to a key and its error; None where no window around the key is possible.

    Args:
        function: Of the key, for any other value.
        value: At the key's own value.
        key: That value.
        grain: What a value may change by unnoticed, as one that is counted in nodes: where it has not changed by more
            over the window, it may have by so much.
    """
    if key == 0.0 or value == 0.0:
        return None
    for half in WINDOWS:
        t: Array = np.linspace(-half, half, SAMPLES, dtype=np.float64)
        try:
            found = np.array([value if step == 0.0 else function(float(key * np.exp(step))) for step in t])
        except (CaseError, ConvergenceError):
            continue
        ratio = found / value
        if np.isfinite(ratio).all() and (ratio > 0).all():
            slope, error = _slope(t, np.log(ratio))
            if np.ptp(found) < grain:
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
