"""Unknown keys of a calibration: their bounds, and the scales on which they are fitted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fenwear.case import Case
from fenwear.errors import CaseError, InputError
from fenwear.life.keys import find_key, value_of, with_values


@dataclass(frozen=True)
class Unknown:
    """A key to be found.

    Attributes:
        key: Its path.
        low, high: Bounds in its internal unit; infinite for none.
        start: Where the fit starts; by default the case's value.
    """

    key: str
    low: float = -np.inf
    high: float = np.inf
    start: float | None = None


def parse_unknown(case: Case, text: str) -> Unknown:
    """Return an unknown from KEY or KEY=LOW..HIGH, the bounds with units.

    Raises:
        CaseError: the case has no such key, or the bounds are not possible.
    """
    path, equals, bounds = (part.strip() for part in text.partition("="))
    find_key(case, path, "--unknown")
    if not equals:
        return Unknown(path)
    ends = bounds.split("..")
    if len(ends) != 2:
        raise CaseError(InputError(f"--unknown {path}", f"expected bounds such as LOW..HIGH, got {bounds!r}"))
    low, high = (value_of(case, path, end, "--unknown") for end in ends)
    return Unknown(path, low, high)


@dataclass(frozen=True)
class ScaledUnknown:
    """An unknown as it is fitted: value = start exp(z) by its logarithm, else start + scale z."""

    unknown: Unknown
    unit: str
    start: float
    scale: float
    logarithmic: bool

    def value(self, z: float) -> float:
        """Return the value, in `unit`, of the fitted unknown z."""
        return float(self.start * np.exp(z)) if self.logarithmic else self.start + self.scale * z

    def fitted(self, value: float) -> float:
        """Return the fitted unknown z of a value."""
        if not self.logarithmic:
            return (value - self.start) / self.scale
        return float(np.log(value / self.start)) if value > 0 else -np.inf


def scaled(case: Case, unknown: Unknown) -> ScaledUnknown:
    """Return an unknown as it is fitted; checks its bounds.

    Raises:
        CaseError: the bounds are not in order, or do not hold the start.
    """
    key = find_key(case, unknown.key, "--unknown")
    name = f"--unknown {unknown.key}"
    if not unknown.low < unknown.high:
        raise CaseError(InputError(name, f"expected bounds that rise, got {unknown.low:g}..{unknown.high:g}"))
    start = key.value if unknown.start is None else unknown.start
    if not unknown.low <= start <= unknown.high:
        ends = [bound for bound in (unknown.low, unknown.high) if np.isfinite(bound)]
        if unknown.start is not None or len(ends) < 2:
            raise CaseError(
                InputError(name, f"its start {start:g} is outside of its bounds {unknown.low:g}..{unknown.high:g}")
            )
        # The case's own value says nothing then.
        start = float(np.sqrt(ends[0] * ends[1])) if ends[0] > 0 else float(np.mean(ends))
    with_values(case, {unknown.key: start})
    try:
        with_values(case, {unknown.key: -abs(start or 1.0)})
        never_negative = False
    except CaseError:
        never_negative = start > 0
    scale = abs(start) or next((abs(b) for b in (unknown.low, unknown.high) if np.isfinite(b) and b != 0), 1.0)
    return ScaledUnknown(unknown, key.unit, start, scale, never_negative)
