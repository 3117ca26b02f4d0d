"""Numeric keys of a case by their paths: values and units; bounds and scales of those that a calibration fits."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fenwear.case import Case, changed_case
from fenwear.common.errors import CaseError, InputError

BY_EXPONENTS = "coefficient"  # whose unit follows from the exponents
EXPONENTS = ("pressure_exponent", "speed_exponent")
BISECTIONS = 40


@dataclass(frozen=True)
class Key:
    """A number of a case.

    Attributes:
        path: Such as wear.punch.coefficient, or punch.loads.0.force.1 for the second number of a list.
        value: In `unit`.
        unit: The internal one; "" for a pure number.
    """

    path: str
    value: float
    unit: str


def numeric_keys(case: Case) -> dict[str, Key]:
    """Return every key of a case that holds a real number, by its path."""
    return {key.path: key for key in _walk(case.resolved(), ())}


def _walk(part: Any, path: tuple[str, ...]) -> Iterator[Key]:
    if isinstance(part, dict):
        for name, value in part.items():
            yield from _walk(value, (*path, name))
    elif isinstance(part, list):
        for place, value in enumerate(part):
            yield from _walk(value, (*path, str(place)))
    elif isinstance(part, float):
        yield Key(".".join(path), part, "")
    elif isinstance(part, str):
        number, _, unit = part.partition(" ")
        try:
            yield Key(".".join(path), float(number), unit)
        except ValueError:
            return


def find_key(case: Case, path: str, option: str = "") -> Key:
    """Return a key of a case.

    Args:
        path: Its path.
        option: Of the command line, for the message.

    Raises:
        CaseError: the case has no such number; names near ones.
    """
    keys = numeric_keys(case)
    if path in keys:
        return keys[path]
    near = difflib.get_close_matches(path, keys, n=3)
    hint = f"; did you mean {' or '.join(near)}?" if near else "; `fenwear check` prints all keys"
    raise CaseError(InputError(f"{option} {path}".strip(), f"the case has no such key with a real number{hint}"))


def settings_of(case: Case, values: Mapping[str, float]) -> list[str]:
    """Return overrides `key.path=value` that give keys these values, in their internal units, which stand with them.

    A wear coefficient's unit follows from its exponents: where only an exponent changes, the
    coefficient keeps its number.
    """
    keys = numeric_keys(case)
    filled = dict(values)
    for path in values:
        body, _, name = path.rpartition(".")
        if name in EXPONENTS and (coefficient := f"{body}.{BY_EXPONENTS}") in keys:
            filled.setdefault(coefficient, keys[coefficient].value)
    units = {path: keys[path].unit for path in filled if path in keys and path.rpartition(".")[2] != BY_EXPONENTS}
    return [
        f'{path}="{float(value)!r} {units[path]}"' if units.get(path) else f"{path}={float(value)!r}"
        for path, value in filled.items()
    ]


def with_values(case: Case, values: Mapping[str, float], settings: Sequence[str] = ()) -> Case:
    """Return the case with further overrides and with keys at these values.

    Raises:
        CaseError: a value is not possible; names its key.
    """
    changed = changed_case(case, *settings) if settings else case
    return changed_case(changed, *settings_of(changed, values)) if values else changed


def value_of(case: Case, path: str, text: str, option: str = "") -> float:
    """Return a number with or without unit in the internal unit of a key.

    Raises:
        CaseError: not a number, of another kind, or not possible for this key.
    """
    find_key(case, path, option)
    try:
        number = float(text)
    except ValueError:
        return find_key(changed_case(case, f'{path}="{text.strip()}"'), path).value
    return find_key(with_values(case, {path: number}), path).value


def possible(case: Case, path: str, value: float) -> bool:
    """Return whether a key of a case can have a value."""
    try:
        with_values(case, {path: value})
    except CaseError:
        return False
    return True


def nearest_possible(case: Case, path: str, inside: float, outside: float) -> float:
    """Return the possible value of a key that is nearest to `outside`, from `inside`, which is possible."""
    if possible(case, path, outside):
        return outside
    for _ in range(BISECTIONS):
        middle = (inside + outside) / 2
        inside, outside = (middle, outside) if possible(case, path, middle) else (inside, middle)
    return inside


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
    never_negative = start > 0 and not possible(case, unknown.key, -abs(start))
    scale = abs(start) or next((abs(b) for b in (unknown.low, unknown.high) if np.isfinite(b) and b != 0), 1.0)
    return ScaledUnknown(unknown, key.unit, start, scale, never_negative)
