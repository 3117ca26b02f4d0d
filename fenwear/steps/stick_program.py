"""Motion and loads of the rig over a cycle, cut into time steps: displacement or force, bulk stress, loads.

A cycle as a table goes row by row: its loads and the place of the strip are those of each row at the end of a step. The
displacement is the motion along the direction of the longest step; the other components of the motion are in the `way`
of the step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from fenwear.bodies.contact_surface import ContactSurface
from fenwear.case import Case, Cycle, OneWay, Oscillation, Rotation, Stick
from fenwear.common.errors import CaseError, InputError
from fenwear.surfaces.motion import Motion, make_motion
from fenwear.surfaces.placement import HERE, Placement
from fenwear.surfaces.sliding_field import Screw, SlidingField

SPACINGS = 1.0  # contact nodes that the strip moves to each side before its place matters


@dataclass(frozen=True)
class TimeStep:
    """One step of the cycle; what is imposed holds at its end.

    Attributes:
        half_cycle: Of the cycle, from 0.
        fraction: Of the cycle at its end; None before the cycle begins.
        duration: s.
        offset: Of the strip in the middle of the step along its motion, mm or rad, or there by a table: its place under
            the punch.
        displacement: Of the strip's supports, mm or rad; None where the force is imposed.
        force: On the strip, N/mm or N; None where the displacement is imposed.
        strain: Bulk strain of the strip's surface along x.
        way: Of the strip in the step, by a table; None where it is the displacement alone.
    """

    half_cycle: int
    fraction: float | None
    duration: float
    offset: float | Placement
    displacement: float | None
    force: float | None
    strain: float
    way: Screw | None = None


@dataclass(frozen=True)
class Program:
    """A cycle in time steps, and the way to its beginning.

    Attributes:
        pressing: Steps in which the loads rise.
        lead_in: From the middle of the motion to where the cycle begins.
        steps: Of the cycle.
        half_cycles: In a cycle.
        period: s.
    """

    pressing: int
    lead_in: tuple[TimeStep, ...]
    steps: tuple[TimeStep, ...]
    half_cycles: int
    period: float

    def same_way(self, other: Program) -> bool:
        """Return whether another cycle has the start and the lead-in of this one."""
        return self._way == other._way

    def following(self, first: int, count: int) -> list[TimeStep]:
        """Return so many time steps from this number on, cycle after cycle."""
        return [self.steps[(first + k) % len(self.steps)] for k in range(count)]

    def with_force(self, factor: float) -> Program:
        """Return the program with imposed tangential forces times a factor."""
        way, steps = (
            tuple(step if step.force is None else replace(step, force=factor * step.force) for step in part)
            for part in (self.lead_in, self.steps)
        )
        return replace(self, lead_in=way, steps=steps)

    @property
    def _way(self) -> tuple[object, ...]:
        return self.pressing, self.lead_in, self.steps[-1].fraction is None, self.steps[0].force is None


def make_program(case: Case, steps: int | None = None) -> Program:
    """Return the program of a case.

    Args:
        case: The problem.
        steps: Of a half-cycle, in place of the case's.

    Raises:
        CaseError: the motion goes one way; a bulk stress in a strip of several materials.
    """
    if isinstance(case.motion, OneWay | Rotation):
        raise CaseError(InputError("motion.kind", "expected a motion to and fro with contact.law = 'coulomb'"))
    settings = case.stick
    count = steps_of(case) if steps is None else steps
    motion = timed_motion(case, count)
    if isinstance(case.motion, Cycle):
        return _table(case, motion)
    largest = _largest(motion)
    bulk = _bulk_strain(case)
    per = case.model.thickness

    def step(half_cycle: int, fraction: float | None, duration: float, middle: float, end: float) -> TimeStep:
        share = end / largest
        return TimeStep(
            half_cycle,
            fraction,
            duration,
            middle,
            end if settings.force is None else None,
            None if settings.force is None else share * settings.force / per,
            bulk * _bulk_share(settings, share, fraction),
        )

    begin = motion.phases[0].offset - motion.phases[0].direction * motion.phases[0].distance / 2
    program_steps, time, place = [], 0.0, begin
    for number, phase in enumerate(motion.phases):
        time += phase.duration
        place += phase.direction * phase.distance
        place = 0.0 if abs(place) < 1e-12 * largest else place
        program_steps.append(step(number // count, time / motion.period, phase.duration, phase.offset, place))
    ways = math.ceil(count * abs(begin) / (2 * largest)) if begin else 0
    ends = begin * np.arange(1, ways + 1) / max(ways, 1)
    lead = tuple(step(-1, None, motion.period, float(e), float(e)) for e in ends)
    return Program(settings.load_steps, lead, tuple(program_steps), motion.half_cycles, motion.period)


def steps_of(case: Case) -> int:
    """Return the number of time steps in a half-cycle: of a table the steps between its rows."""
    return len(case.motion.rows) - 1 if isinstance(case.motion, Cycle) else case.stick.steps


def timed_motion(case: Case, steps: int) -> Motion:
    """Return the motion with so many phases in a half-cycle: those of a table in as many parts each."""
    if isinstance(case.motion, Cycle):
        return make_motion(case.motion).in_parts(max(1, steps // steps_of(case)))
    return make_motion(case.motion.model_copy(update={"positions": steps}))


def _table(case: Case, motion: Motion) -> Program:
    """Return the program of a cycle as a table, whose motion has a phase for each time step."""
    ways = [phase.way for phase in motion.phases if phase.way is not None]
    ends = [_along(motion.longest, way.last) for way in ways]
    largest, bulk = max(abs(end) for end in ends) or 1.0, _bulk_strain(case)

    def step(half_cycle: int, fraction: float | None, duration: float, way: Screw, end: float) -> TimeStep:
        share = _bulk_share(case.stick, end / largest, fraction)
        return TimeStep(half_cycle, fraction, duration, way.at(0.5), end, None, bulk * share, way)

    time, program_steps = 0.0, []
    for phase, way, end in zip(motion.phases, ways, ends, strict=True):
        time += phase.duration
        program_steps.append(step(0, time / motion.period, phase.duration, way, end))
    to_begin = Screw(HERE, ways[0].first)
    lead = [] if to_begin.rests else to_begin.parts(max(1, math.ceil(len(ways) * _part(to_begin, ways))))
    lead_in = [step(-1, None, motion.period, way, _along(motion.longest, way.last)) for way in lead]
    lead_in = [replace(step, offset=way.last) for step, way in zip(lead_in, lead, strict=True)]
    return Program(case.stick.load_steps, tuple(lead_in), tuple(program_steps), 1, motion.period)


def _along(field: SlidingField, place: Placement) -> float:
    """Return the position of a place along a motion, mm or rad."""
    return float(np.dot(field.turn, place.turn) if any(field.turn) else np.dot(field.shift, place.shift))


def _part(way: Screw, ways: list[Screw]) -> float:
    """Return the share of a way in the length of all ways, by turns or by shifts, whichever is larger."""
    parts = []
    for which in ("turn", "shift"):
        ends = [(getattr(screw.first, which), getattr(screw.last, which)) for screw in (way, *ways)]
        sizes = [float(np.linalg.norm(np.array(last) - first)) for first, last in ends]
        parts.append(sizes[0] / max(sum(sizes[1:]), 1e-300) if sizes[0] else 0.0)
    return max(parts)


def _bulk_share(settings: Stick, share: float, fraction: float | None) -> float:
    """Return the share of the bulk stress that acts: the share of the displacement, or by a course of its own."""
    table = settings.bulk_over_cycle
    return share if table is None else float(np.interp(fraction or 0.0, *np.array(table).T))


def _largest(motion: Motion) -> float:
    return max(abs(p.offset + side * p.distance / 2) for p in motion.phases for side in (-1, 1))


def _bulk_strain(case: Case) -> float:
    """Return the strain of the strip's surface by the bulk stress, eps = sigma / E, in plane strain (1 - nu²) / E."""
    stress = case.stick.bulk_stress
    if stress == 0.0:
        return 0.0
    names = set(case.strip.regions.values())
    if len(names) > 1:
        raise CaseError(InputError("stick.bulk_stress", "expected a strip of one material"))
    material = case.materials[names.pop()]
    stiffer = 1 - material.poisson**2 if case.model.law == "strain" else 1.0
    strain = stress * stiffer / material.young
    if abs(strain) >= 1:
        message = f"expected a stress below Young's modulus: the strip would be strained by {strain:.3g}"
        raise CaseError(InputError("stick.bulk_stress", message))
    return strain


def far_enough(case: Case, surface: ContactSurface) -> bool:
    """Return whether the strip moves so far against the nodes of a contact surface that its place matters."""
    if isinstance(case.motion, Cycle):
        ends = make_motion(case.motion).ends(SlidingField())
        moved = max(float(np.linalg.norm(end.points(surface.x) - surface.x, axis=1).max()) for end in ends)
        return passes(moved, surface)
    motion = make_motion(case.motion.model_copy(update={"positions": 2}))
    far = _largest(motion)
    if isinstance(case.motion, Oscillation):
        far *= float(np.linalg.norm(surface.x[:, :2] - np.array(case.motion.centre)[:2], axis=1).max())
    return passes(far, surface)


def passes(far: float, surface: ContactSurface) -> bool:
    """Return whether a strip that moves or slips so far to each side, mm, passes nodes of a contact surface."""
    return far > SPACINGS * surface.spacing()
