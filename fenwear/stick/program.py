"""What the rig does over a cycle, cut into time steps: displacement or force, bulk stress, loads."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fenwear.bodies.contact_surface import ContactSurface
from fenwear.case import Case, OneWay, Oscillation, Rotation
from fenwear.errors import CaseError, InputError
from fenwear.sliding.motion import Motion, make_motion

SPACINGS = 1.0  # contact nodes that the strip moves to each side before its place matters


@dataclass(frozen=True)
class TimeStep:
    """One step of the cycle; what is imposed holds at its end.

    Attributes:
        half_cycle: Of the cycle, from 0.
        fraction: Of the cycle at its end; None before the cycle begins.
        duration: s.
        offset: Of the strip in the middle of the step along its motion, mm or rad: its place under the punch.
        displacement: Of the strip's supports, mm or rad; None where the force is imposed.
        force: On the strip, N/mm or N; None where the displacement is imposed.
        strain: Bulk strain of the strip's surface along x.
    """

    half_cycle: int
    fraction: float | None
    duration: float
    offset: float
    displacement: float | None
    force: float | None
    strain: float


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
    count = settings.steps if steps is None else steps
    motion = make_motion(case.motion.model_copy(update={"positions": count}))
    largest = _largest(motion)
    bulk = _bulk_strain(case)
    per = case.model.thickness

    def step(half_cycle: int, fraction: float | None, duration: float, middle: float, end: float) -> TimeStep:
        share = end / largest
        table = settings.bulk_over_cycle
        bulk_share = share if table is None else float(np.interp(fraction or 0.0, *np.array(table).T))
        return TimeStep(
            half_cycle,
            fraction,
            duration,
            middle,
            end if settings.force is None else None,
            None if settings.force is None else share * settings.force / per,
            bulk * bulk_share,
        )

    begin = motion.phases[0].offset - motion.phases[0].direction * motion.phases[0].distance / 2
    found, time, place = [], 0.0, begin
    for number, phase in enumerate(motion.phases):
        time += phase.duration
        place += phase.direction * phase.distance
        place = 0.0 if abs(place) < 1e-12 * largest else place
        found.append(step(number // count, time / motion.period, phase.duration, phase.offset, place))
    ways = math.ceil(count * abs(begin) / (2 * largest)) if begin else 0
    ends = begin * np.arange(1, ways + 1) / max(ways, 1)
    lead = tuple(step(-1, None, motion.period, float(e), float(e)) for e in ends)
    return Program(settings.load_steps, lead, tuple(found), motion.half_cycles, motion.period)


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
    return stress * stiffer / material.young


def far_enough(case: Case, surface: ContactSurface) -> bool:
    """Return whether the strip moves so far against the nodes of a contact surface that its place matters."""
    motion = make_motion(case.motion.model_copy(update={"positions": 2}))
    far = _largest(motion)
    if isinstance(case.motion, Oscillation):
        far *= float(np.linalg.norm(surface.x[:, :2] - np.array(case.motion.centre)[:2], axis=1).max())
    return far > SPACINGS * surface.spacing()
