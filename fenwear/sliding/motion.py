"""The sliding motion: the phases of a cycle and the exact integrals of the speed.

A cycle is a sequence of half-cycles (strokes in one direction), and each half-cycle is cut into equal
times, one for each position of the strip under the punch. Such a phase has one contact: a direction,
an offset of the strip, and the sliding that is done there. Rotations are counted in rad in place of mm.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.special import beta, betainc

from fenwear.arrays import Array
from fenwear.case import Motions, OneWay, Oscillation, Reciprocating, Rotation, Tabulated
from fenwear.errors import CaseError, InputError

DEFAULT_POSITIONS = 9  # in a half-cycle where the strip wears; odd, so that one is the middle of the stroke


@dataclass(frozen=True)
class Phase:
    """One position of the strip in a half-cycle.

    Attributes:
        direction: Sliding direction d: 1 where the strip moves to +x, -1 to -x.
        offset: How far the strip stands from its middle position towards +x, mm.
        duration: s.
        distance: Slid in it, mm.
        fraction: Of the cycle, at the middle of the phase.
    """

    direction: int
    offset: float
    duration: float
    distance: float
    fraction: float

    @property
    def speed(self) -> float:
        """Mean speed, mm/s."""
        return self.distance / self.duration


class _Stroke(Protocol):
    """The speed over one half-cycle."""

    @property
    def duration(self) -> float:
        """Of the half-cycle, s."""

    def power(self, begin: float, end: float, exponent: float) -> float:
        """Return the integral of v^exponent over a time inside the stroke."""


@dataclass(frozen=True)
class _Sinusoidal:
    """v = u0 omega |sin omega t| over pi / omega, equation (10)."""

    amplitude: float
    angular_frequency: float

    @property
    def duration(self) -> float:
        return math.pi / self.angular_frequency

    def power(self, begin: float, end: float, exponent: float) -> float:
        """(u0 omega)^a / omega times the integral of sin^a, an incomplete beta function; 2 u0 in all for a = 1."""
        scale = (self.amplitude * self.angular_frequency) ** exponent / self.angular_frequency
        return scale * (self._to(end, exponent) - self._to(begin, exponent))

    def _to(self, time: float, a: float) -> float:
        angle = self.angular_frequency * time
        half = float(beta((a + 1) / 2, 0.5)) / 2
        part = half * float(betainc((a + 1) / 2, 0.5, min(1.0, math.sin(angle) ** 2)))
        return part if angle <= math.pi / 2 else 2 * half - part


@dataclass(frozen=True)
class _PiecewiseLinear:
    """Speeds that change linearly in each interval: from `first` to `last`, at `times` (one more)."""

    times: tuple[float, ...]
    first: tuple[float, ...]
    last: tuple[float, ...]

    @property
    def duration(self) -> float:
        return self.times[-1]

    def power(self, begin: float, end: float, exponent: float) -> float:
        """Exact on each interval: the integral of (v0 + c t)^a."""
        total = 0.0
        for t0, t1, v0, v1 in zip(self.times, self.times[1:], self.first, self.last, strict=False):
            low, high = max(begin, t0), min(end, t1)
            if high <= low:
                continue
            a, b = (v0 + (v1 - v0) * (t - t0) / (t1 - t0) for t in (low, high))
            if abs(b - a) <= 1e-9 * max(a, b):
                total += ((a + b) / 2) ** exponent * (high - low)
            else:
                total += (b ** (exponent + 1) - a ** (exponent + 1)) / ((exponent + 1) * (b - a)) * (high - low)
        return total


@dataclass(frozen=True)
class Motion:
    """A cycle of sliding.

    Attributes:
        phases: All positions of a cycle in their order.
        positions: Phases in each half-cycle.
        half_cycles: Half-cycles in a cycle: 2 to and fro, 1 one way.
    """

    phases: tuple[Phase, ...]
    positions: int
    half_cycles: int
    _strokes: tuple[_Stroke, ...]
    _starts: tuple[float, ...]  # offset of the strip at the start of each stroke

    @property
    def directions(self) -> tuple[int, ...]:
        """Sliding direction of each phase."""
        return tuple(phase.direction for phase in self.phases)

    @property
    def stroke_directions(self) -> tuple[int, ...]:
        """Sliding direction of each half-cycle of a cycle."""
        return self.directions[:: self.positions]

    @property
    def period(self) -> float:
        """Duration of a cycle, s."""
        return sum(stroke.duration for stroke in self._strokes)

    @property
    def mean_speed(self) -> float:
        """Mean sliding speed of a cycle, mm/s."""
        return sum(phase.distance for phase in self.phases) / self.period

    @property
    def reach(self) -> float:
        """Largest offset of the strip, mm."""
        return max(abs(phase.offset) for phase in self.phases)

    def in_parts(self, parts: int) -> Motion:
        """Return the motion with each phase cut into parts of equal time at its position."""
        if parts == 1:
            return self
        phases = []
        for number, phase in enumerate(self.phases):
            stroke, place = self._strokes[number // self.positions], number % self.positions
            edges = _edges(stroke, self.positions * parts)[place * parts : (place + 1) * parts + 1]
            for low, high in itertools.pairwise(edges):
                distance = stroke.power(low, high, 1.0)
                phases.append(replace(phase, duration=high - low, distance=distance))
        return replace(self, phases=tuple(phases), positions=self.positions * parts)

    def time(self, half_cycle: NDArray[np.int64]) -> Array:
        """Return the time at the end of half-cycles, given by their numbers from 1, s."""
        ends = np.cumsum([stroke.duration for stroke in self._strokes])
        number = np.asarray(half_cycle, dtype=int)
        return (number - 1) // self.half_cycles * self.period + ends[(number - 1) % self.half_cycles]

    def sliding(self, exponent: float = 1.0) -> Array:
        """Return the integral of v^a over each phase (phases,), mm^a s^(1-a); for a = 1 the sliding distance.

        Raises:
            CaseError: it is beyond all numbers.
        """
        powers = []
        for stroke in self._strokes:
            edges = itertools.pairwise(_edges(stroke, self.positions))
            powers += [_power(stroke, a, b, exponent) for a, b in edges]
        return np.array(powers)

    def mean_speeds(self, steps: int) -> Array:
        """Return the mean speed in equal steps of each phase (phases, steps), mm/s; they add up exactly.

        Speeds that differ by rounding alone are the same to the last digit: such steps share their operators.
        """
        rows = []
        for stroke in self._strokes:
            edges = itertools.pairwise(_edges(stroke, self.positions * steps))
            distances = np.array([_power(stroke, a, b, 1.0) for a, b in edges])
            speeds = distances / (stroke.duration / len(distances))
            mirrored = (speeds + speeds[::-1]) / 2
            mean = _power(stroke, 0.0, stroke.duration, 1.0) / stroke.duration
            rounding = 1e-9 * max(speeds.max(), 1e-300)
            if np.abs(mean - speeds).max() < rounding:
                speeds = np.full(len(speeds), mean)
            elif np.abs(mirrored - speeds).max() < rounding:
                speeds = mirrored
            rows.append(speeds.reshape(self.positions, steps))
        return np.concatenate(rows)

    def offsets(self, steps: int) -> Array:
        """Return where the strip is at the ends of equal steps of each phase (phases, steps + 1), mm or rad."""
        rows = []
        directions = self.stroke_directions
        for stroke, start, direction in zip(self._strokes, self._starts, directions, strict=True):
            edges = _edges(stroke, self.positions * steps)
            slid = np.array([_power(stroke, 0.0, edge, 1.0) for edge in edges])
            places = np.round(start + direction * slid, 12)  # the same on the way there and back
            rows += [places[k * steps : (k + 1) * steps + 1] for k in range(self.positions)]
        return np.array(rows)


def make_motion(description: Motions, *, strip_wears: bool = False) -> Motion:
    """Return the motion that the case describes.

    Args:
        description: Of the case.
        strip_wears: Whether the strip wears and passes under the punch, so that its positions matter by default.

    Raises:
        CaseError: it is faster than numbers are large.
    """
    if isinstance(description, OneWay | Rotation):
        forward = description.direction in ("rightward", "counterclockwise")
        speed = (description.speed if isinstance(description, OneWay) else description.angular_speed,)
        steady = _PiecewiseLinear((0.0, description.duration), speed, speed)
        return _motion(((1 if forward else -1, 0.0, steady),), 1)
    positions = description.positions or (DEFAULT_POSITIONS if strip_wears else 1)
    if isinstance(description, Tabulated):
        return _motion(_table_strokes(description), positions)
    stroke, amplitude = _to_and_fro(description), description.amplitude
    return _motion(((1, -amplitude, stroke), (-1, amplitude, stroke)), positions)


def _power(stroke: _Stroke, begin: float, end: float, exponent: float) -> float:
    try:
        power = stroke.power(begin, end, exponent)
    except (OverflowError, ZeroDivisionError):
        power = math.inf
    if not math.isfinite(power):
        raise CaseError(InputError("motion", f"its speed to the power of {exponent:g} is beyond all numbers"))
    return power


def _edges(stroke: _Stroke, count: int) -> list[float]:
    """Return the ends of equal times of a stroke, s."""
    return [float(time) for time in np.linspace(0.0, stroke.duration, count + 1)]


def _motion(strokes: tuple[tuple[int, float, _Stroke], ...], positions: int) -> Motion:
    """Put strokes, each with its direction and the offset of its start, together."""
    period = sum(stroke.duration for _, _, stroke in strokes)
    phases, begin = [], 0.0
    for direction, start, stroke in strokes:
        for low, high in itertools.pairwise(_edges(stroke, positions)):
            before, distance = _power(stroke, 0.0, low, 1.0), _power(stroke, low, high, 1.0)
            # One position alone stands for the whole stroke, punch and strip opposite each other.
            offset = 0.0 if positions == 1 else start + direction * (before + distance / 2)
            offset = round(offset, 12)  # the same on the way there and back
            phases.append(Phase(direction, offset, high - low, distance, (begin + (low + high) / 2) / period))
        begin += stroke.duration
    starts = tuple(start for _, start, _ in strokes)
    return Motion(tuple(phases), positions, len(strokes), tuple(stroke for _, _, stroke in strokes), starts)


def _to_and_fro(description: Reciprocating | Oscillation) -> _Stroke:
    duration, distance = description.half_period, 2 * description.amplitude
    if description.profile == "sinusoidal":
        return _Sinusoidal(description.amplitude, math.pi / duration)
    if description.profile == "triangular":
        return _PiecewiseLinear((0.0, duration), (distance / duration,), (distance / duration,))
    ramp = (description.ramp or 0.5) * duration
    top = distance / (duration - ramp)
    return _PiecewiseLinear((0.0, ramp, duration - ramp, duration), (0.0, top, top), (top, top, 0.0))


def _table_strokes(description: Tabulated) -> tuple[tuple[int, float, _Stroke], ...]:
    """Cut the table into strokes of one direction each; rests belong to the stroke before them."""
    times, positions = np.array(description.times), np.array(description.displacements)
    middle = (positions.max() + positions.min()) / 2
    signs = np.sign(np.diff(positions)).astype(int)
    moving = np.flatnonzero(signs)
    signs[: moving[0]] = signs[moving[0]]
    for k in range(1, len(signs)):
        signs[k] = signs[k] or signs[k - 1]
    cuts = [0, *(int(k) + 1 for k in np.flatnonzero(np.diff(signs))), len(signs)]
    strokes: list[tuple[int, float, _Stroke]] = []
    for a, b in itertools.pairwise(cuts):
        local = times[a : b + 1] - times[a]
        speeds = tuple((np.abs(np.diff(positions[a : b + 1])) / np.diff(local)).tolist())
        strokes.append(
            (int(signs[a]), float(positions[a] - middle), _PiecewiseLinear(tuple(local.tolist()), speeds, speeds))
        )
    return tuple(strokes)
