"""The sliding motion: the phases of a cycle and the exact integrals of the speed.

A cycle is a sequence of half-cycles (strokes in one direction), and each half-cycle is cut into equal
times, one for each position of the strip under the punch. Such a phase has one contact: a direction,
an offset of the strip, and the sliding that is done there. Rotations are counted in rad in place of mm.

A cycle that is a table is one half-cycle, whose phases are the steps between its rows. Each has a sliding field of its
own, that of the constant screw which takes the strip from one row to the next (`fenwear.surfaces.sliding_field`): what
slides past a place in space is exact for steps of any size.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation as Turn
from scipy.special import beta, betainc

from fenwear.case import Cycle, Motions, OneWay, Oscillation, Reciprocating, Rotation, Tabulated
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError
from fenwear.surfaces.placement import HERE, Placement, Vector
from fenwear.surfaces.sliding_field import ALONG_X, Screw, Slide, SlidingField, Way, vector_of

DEFAULT_POSITIONS = 9  # at least, in a half-cycle where the strip wears or is uneven; odd, with one in the middle


@dataclass(frozen=True)
class Phase:
    """One position of the strip in a half-cycle.

    Attributes:
        direction: Sliding direction d: 1 where the strip moves to +x, -1 to -x.
        offset: Distance of the strip from its middle position towards +x, mm.
        duration: s.
        distance: Slid in it, mm.
        fraction: Of the cycle, at the middle of the phase.
        field: Of a step of a table, in its direction; None where it is that of the whole motion.
        place: Where the strip is in the middle of such a step, where it moves.
        way: From its begin to its end.
    """

    direction: int
    offset: float
    duration: float
    distance: float
    fraction: float
    field: SlidingField | None = None
    place: Placement = HERE
    way: Screw | None = None

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
    _ends: tuple[float, ...] = ()  # times of the phases' ends in the only stroke of a table, 0 first

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
    def durations(self) -> list[float]:
        """Of the phases, s; those that differ by rounding alone are the same to the last digit."""
        durations: list[float] = []
        for phase in self.phases:
            alike = (duration for duration in durations if abs(duration - phase.duration) < 1e-9 * phase.duration)
            durations.append(next(alike, phase.duration))
        return durations

    @property
    def reach(self) -> float:
        """Largest offset of the strip, mm."""
        return max(abs(phase.offset) for phase in self.phases)

    @property
    def longest(self) -> SlidingField:
        """The direction of the step of a table that turns farthest, or of the longest one where none turns.

        Either of both ways, the one along the first axis on which it goes.
        """
        fields = [phase.field for phase in self.phases if phase.field is not None]
        if any(any(field.turn) for field in fields):
            farthest = max(fields, key=lambda field: float(np.linalg.norm(field.turn)))
            return SlidingField(turn=_unit(farthest.turn), centre=farthest.centre)
        shift = max((field.shift for field in fields), key=lambda shift: float(np.linalg.norm(shift)))
        return SlidingField(shift=_unit(shift)) if any(shift) else ALONG_X  # where nothing moves: any

    @property
    def one_way(self) -> bool:
        """Whether the strip's material goes one way without end, and not through a cycle."""
        return not self.steps and len(set(self.directions)) == 1

    def in_parts(self, parts: int) -> Motion:
        """Return the motion with each phase cut into parts of equal time at its position."""
        if parts == 1:
            return self
        phases, ends = [], self._cut(0, parts)
        for number, phase in enumerate(self.phases):
            stroke, place = self._strokes[number // self.positions], number % self.positions
            edges = self._cut(number // self.positions, parts)[place * parts : (place + 1) * parts + 1]
            for low, high in itertools.pairwise(edges):
                distance = stroke.power(low, high, 1.0)
                phases.append(replace(phase, duration=high - low, distance=distance))
            if phase.way is not None:
                phases[-parts:] = [
                    replace(part, way=way) for part, way in zip(phases[-parts:], phase.way.parts(parts), strict=True)
                ]
        cut = replace(self, phases=tuple(phases), positions=self.positions * parts)
        return replace(cut, _ends=tuple(ends)) if self.steps else cut

    def _cut(self, stroke: int, parts: int) -> list[float]:
        """Return the ends of equal parts of the phases of a half-cycle, s."""
        if not self.steps:
            return _edges(self._strokes[stroke], self.positions * parts)
        shares = np.arange(parts) / parts
        inner = [a + share * (b - a) for a, b in itertools.pairwise(self._ends) for share in shares]
        return [float(time) for time in (*inner, self._ends[-1])]

    def as_single_phase(self, field: SlidingField) -> Motion:
        """Return a measured table as one phase, in which all of it is slid: of laws that follow its steps themselves.

        Args:
            field: Of the phase, for a millimetre of it.
        """
        phase_of_all = Phase(1, 0.0, self.period, sum(phase.distance for phase in self.phases), 0.5, field)
        speed = (phase_of_all.speed,)
        ends = (0.0, self.period)
        return Motion((phase_of_all,), 1, 1, (_PiecewiseLinear(ends, speed, speed),), (0.0,), ends)

    @property
    def steps(self) -> bool:
        """Whether it is a table, whose steps have sliding fields of their own."""
        return bool(self._ends)

    def measured(self, amounts: Sequence[float]) -> Motion:
        """Return the motion as a table, with the distances of its phases times these amounts (phases,).

        Their fields are divided by them: what slides stays as it is.
        """
        phases = tuple(
            replace(phase, distance=phase.distance * amount, field=phase.field.over(amount))
            if phase.field is not None and amount > 0
            else phase
            for phase, amount in zip(self.phases, amounts, strict=True)
        )
        speeds = tuple(phase.speed for phase in phases)
        stroke = _PiecewiseLinear(self._ends, speeds, speeds)
        return replace(self, phases=phases, _strokes=(stroke,))

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
        for number, stroke in enumerate(self._strokes):
            powers += [_power(stroke, a, b, exponent) for a, b in itertools.pairwise(self._cut(number, 1))]
        return np.array(powers)

    def mean_speeds(self, steps: int) -> Array:
        """Return the mean speed in equal steps of each phase (phases, steps), mm/s; they add up exactly.

        Speeds that differ by rounding alone are the same to the last digit: such steps share their operators.
        """
        if self.steps:
            return np.repeat([[phase.speed] for phase in self.phases], steps, axis=1)
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
        """Return the strip's positions at the ends of equal steps of each phase (phases, steps + 1), mm or rad."""
        rows = []
        directions = self.stroke_directions
        for stroke, start, direction in zip(self._strokes, self._starts, directions, strict=True):
            edges = _edges(stroke, self.positions * steps)
            slid = np.array([_power(stroke, 0.0, edge, 1.0) for edge in edges])
            places = np.round(start + direction * slid, 12)  # the same on the way there and back
            rows += [places[k * steps : (k + 1) * steps + 1] for k in range(self.positions)]
        return np.array(rows)

    def ways(self, field: SlidingField, steps: int) -> list[list[Way]]:
        """Return the strip's ways in equal steps of each phase.

        Args:
            field: Of the motion, where its phases have none of their own.
            steps: Of each phase.
        """
        if self.steps:
            return [[way.undirected for way in phase.way.parts(steps)] if phase.way else [] for phase in self.phases]
        return [
            [Slide(field, *sorted((float(a), float(b)))) for a, b in itertools.pairwise(row)]
            for row in self.offsets(steps)
        ]

    def ends(self, field: SlidingField) -> list[Placement]:
        """Return the strip's place at the end of each phase."""
        if self.steps:
            return [phase.way.last if phase.way else HERE for phase in self.phases]
        return [field.placement(float(end)) for end in self.offsets(1)[:, -1]]


def make_motion(description: Motions, *, strip_varies: bool = False, positions: int = DEFAULT_POSITIONS) -> Motion:
    """Return the motion that the case describes.

    Args:
        description: Of the case.
        strip_varies: Whether the strip wears or is uneven, and passes under the punch: its positions matter by default.
        positions: Their number then, where the case leaves them open.

    Raises:
        CaseError: it is faster than numbers are large.
    """
    if isinstance(description, OneWay | Rotation):
        forward = description.direction in ("rightward", "counterclockwise")
        speed = (description.speed if isinstance(description, OneWay) else description.angular_speed,)
        steady = _PiecewiseLinear((0.0, description.duration), speed, speed)
        return _motion(((1 if forward else -1, 0.0, steady),), 1)
    if isinstance(description, Cycle):
        moves = strip_varies if description.positions is None else description.positions == "steps"
        return _table_motion(description, moves=moves)
    count = description.positions or (positions if strip_varies else 1)
    if isinstance(description, Tabulated):
        return _motion(_table_strokes(description), count)
    stroke, amplitude = _to_and_fro(description), description.amplitude
    return _motion(((1, -amplitude, stroke), (-1, amplitude, stroke)), count)


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


def _table_motion(description: Cycle, *, moves: bool) -> Motion:
    """Return the motion of a table of places, in steps of a unit of their own fields.

    Args:
        description: The table.
        moves: Whether the strip is in its place in the middle of each step, not where it is meshed.
    """
    course, centre = description.course, description.centre
    times = course.fraction * course.duration
    turns = Turn.from_matrix(course.turn).as_rotvec()
    rows = [Placement(vector_of(course.shift[k]), vector_of(turn), centre) for k, turn in enumerate(turns)]
    phases = []
    for k, (first, last) in enumerate(itertools.pairwise(rows)):
        way = Screw(first, last)
        middle = float(course.fraction[k] + course.fraction[k + 1]) / 2
        place = way.at(0.5) if moves else HERE
        unit = 0.0 if way.rests else 1.0
        phases.append(Phase(1, 0.0, float(times[k + 1] - times[k]), unit, middle, way.field, place, way))
    speeds = tuple(phase.speed for phase in phases)
    ends = tuple(float(time) for time in times)
    return Motion(tuple(phases), len(phases), 1, (_PiecewiseLinear(ends, speeds, speeds),), (0.0,), ends)


def _unit(vector: Vector) -> Vector:
    size = np.linalg.norm(vector)
    first = next(c for c in vector if abs(c) > 1e-9 * size)
    return vector_of(np.array(vector) / np.copysign(size, first))
