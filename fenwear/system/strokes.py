"""The sliding of the counter-body by a case, which stays in its surface."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from fenwear.case import Case, Cycle, OneWay, Oscillation, Rotation, WearLaw
from fenwear.common.errors import CaseError, InputError
from fenwear.laws.friction import Friction
from fenwear.surfaces import ContactPair, Placement
from fenwear.surfaces.motion import DEFAULT_POSITIONS, Motion, Phase, make_motion
from fenwear.surfaces.placement import in_space
from fenwear.surfaces.sliding_field import ALONG_X, ALONG_Y, SlidingField

OUT_OF_SURFACE = 1e-2  # sine between the sliding of a strip that turns in place and its surface, as it is meshed
FACET = 0.1  # the same at a single node, beside facets of no regular form


@dataclass(frozen=True)
class Sliding:
    """The sliding of the counter-body, with its effect on both surfaces.

    Attributes:
        motion: The phases of a cycle.
        field: The velocity of the counter-body over the contact.
        friction: The law of friction.
        wear: The wear laws of punch and strip; `NoWear` where a body does not wear.
        track: Closure of the track that a wearing strip runs on: its length, mm, or 2 pi rad; None for none.
        to_and_fro: Whether the strip's worn track passes to and fro under the punch.
    """

    motion: Motion
    field: SlidingField
    friction: Friction
    wear: tuple[WearLaw, WearLaw]
    track: float | None = None
    to_and_fro: bool = False

    def measured_on(self, middle: ContactPair) -> Sliding:
        """Return the sliding with steps of a table counted by the mean distance that contact nodes slide, mm."""
        if not self.motion.steps:
            return self
        areas = middle.weights / middle.weights.sum()
        fields = [phase.field or self.field for phase in self.motion.phases]
        return replace(
            self, motion=self.motion.measured([float(areas @ f.rate(middle.opposite, middle.normal)) for f in fields])
        )

    def placement(self, phase: Phase) -> Placement:
        """Return the place of the strip in a phase."""
        return phase.place if self.motion.steps else self.field.placement(phase.offset)


def make_sliding(case: Case, *, positions: int = DEFAULT_POSITIONS) -> Sliding:
    """Return the sliding of a case, in so many positions of a strip that varies where the case leaves them open."""
    motion = make_motion(case.motion, strip_varies=case.strip_varies and case.passes, positions=positions)
    sliding_field = _sliding_field(case, motion)
    one_way = isinstance(case.motion, OneWay | Rotation)
    return Sliding(
        motion,
        sliding_field,
        friction_of(case, sliding_field),
        case.wear.of_bodies,
        _closed_track(case),
        case.passes and not one_way,
    )


def friction_of(case: Case, field: SlidingField) -> Friction:
    """Return the law of friction of a case, with that of its coatings."""
    punch, strip = (law.coating.friction if law.coating else None for law in case.wear.of_bodies)
    temperature = case.names.role_of(case.contact.friction_temperature)
    return Friction(case.contact, field, (punch, strip), temperature)


def _sliding_field(case: Case, made: Motion) -> SlidingField:
    motion = case.motion
    if isinstance(motion, Cycle):
        return made.longest
    if isinstance(motion, Oscillation | Rotation):
        return SlidingField(turn=_unit(motion.axis), centre=motion.centre)
    if motion.along is not None:
        return SlidingField(shift=_unit(motion.along))
    return ALONG_X if motion.axis == "x" else ALONG_Y


def _closed_track(case: Case) -> float | None:
    if isinstance(case.motion, OneWay):
        return case.motion.track
    turns = isinstance(case.motion, Rotation) and case.passes  # rings have their whole track under the punch
    return 2 * math.pi if turns and case.strip_changes else None


def _unit(vector: tuple[float, float, float]) -> tuple[float, float, float]:
    x, y, z = (np.array(vector) / np.linalg.norm(vector)).tolist()
    return x, y, z


def check_stays(middle: ContactPair, sliding: Sliding) -> None:
    """Raise where a strip that turns in place is none of revolution about the axis, or a moving one leaves contact."""
    if sliding.motion.steps:
        _check_steps_stay(middle, sliding.motion)
        return
    along = np.array(sliding.field.shift)
    if middle.punch.dim == 3 and along.any():
        normal = middle.weights @ middle.normal
        out = abs(along @ normal) / np.linalg.norm(normal)
        if out > OUT_OF_SURFACE:
            way = ", ".join(f"{part:.3g}" for part in along - (along @ normal) / (normal @ normal) * normal + 0.0)
            hint = f"Set ({way})" if out < 1 - OUT_OF_SURFACE else "Set a direction at right angles to it"
            raise CaseError(InputError("motion.along", f"the strip would move out of the contact. {hint}"))
    if not any(sliding.field.turn) or sliding.motion.reach > 0:
        return
    velocity, normal = sliding.field.velocity(middle.punch.x), in_space(middle.normal)
    out = np.abs(np.einsum("ic,ic->i", velocity, normal)) / np.linalg.norm(velocity, axis=1).max()
    if out.mean() > OUT_OF_SURFACE or out.max() > FACET:
        raise CaseError(
            InputError(
                "motion.axis", "the strip's contact surface would turn out of the contact. Set its axis of revolution"
            )
        )


def _check_steps_stay(middle: ContactPair, motion: Motion) -> None:
    """Raise where a step of a table would take the strip's surface out of the contact, or into the punch."""
    for number, phase in enumerate(motion.phases):
        if phase.field is None or not phase.distance:
            continue
        velocity, normal = phase.field.velocity(middle.opposite), in_space(middle.normal)
        out = np.abs(np.einsum("ic,ic->i", velocity, normal))
        if any(phase.field.turn):
            leaves = out.mean() > OUT_OF_SURFACE * np.linalg.norm(velocity, axis=1).max()
        else:
            mean = middle.weights @ normal
            leaves = abs(velocity[0] @ mean) > OUT_OF_SURFACE * np.linalg.norm(velocity[0]) * np.linalg.norm(mean)
        if leaves:
            message = (
                f"from row {number + 1} to row {number + 2} the strip's surface does not slide along itself: it would "
                "open the contact, or overlap the punch. Turn round surfaces about their middle (motion.centre), and "
                "shift flat ones along themselves. The load brings bodies together"
            )
            raise CaseError(InputError("motion.rows", message))
