"""The sliding of the counter-body by a case, which stays in its surface."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fenwear.case import Case, Cycle, OneWay, Oscillation, Rotation, WearLaw
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError
from fenwear.heat.passage import Passage
from fenwear.laws.friction import Friction
from fenwear.surfaces import ContactPair, Placement
from fenwear.surfaces.motion import DEFAULT_POSITIONS, Motion, Phase, make_motion
from fenwear.surfaces.placement import in_space
from fenwear.surfaces.sliding_field import ALONG_X, ALONG_Y, SlidingField, node_rates

OUT_OF_SURFACE = 1e-2  # sine between the sliding of a strip that turns in place and its surface, as it is meshed
FACET = 0.1  # the same at a single node, beside facets of no regular form


ROUNDING = 1e-12  # of the mean speed: phases whose speeds differ by less are alike


@dataclass(frozen=True)
class Clock:
    """When a motion began that is one of several.

    Attributes:
        half_cycles: Before it.
        time: s.
        slid: Distance of the motions before it, mm or rad.
    """

    half_cycles: int = 0
    time: float = 0.0
    slid: float = 0.0


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
        clock: When the motion began.
    """

    motion: Motion
    field: SlidingField
    friction: Friction
    wear: tuple[WearLaw, WearLaw]
    track: float | None = None
    to_and_fro: bool = False
    clock: Clock = Clock()

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

    def over(
        self, middle: ContactPair, pairs: Sequence[ContactPair], passage: Passage | None = None, *, passes: bool = True
    ) -> PlacedSliding:
        """Return the sliding of surfaces opposite each other, see `PlacedSliding`."""
        given = {field.name: getattr(self, field.name) for field in fields(Sliding)}
        return PlacedSliding(**given, middle=middle, pairs=tuple(pairs), passage=passage, passes=passes)

    def time(self, half_cycle: NDArray[np.int64]) -> Array:
        """Return the time at the end of half-cycles, given by their numbers from 1, s."""
        return self.clock.time + self.motion.time(np.asarray(half_cycle) - self.clock.half_cycles)

    def slid_after(self, half_cycles: float) -> float:
        """Return the sliding distance after half-cycles of the run, mm or rad; of tables the number of cycles."""
        each = 1.0 if self.motion.steps else sum(phase.distance for phase in self.motion.phases)
        return self.clock.slid + (half_cycles - self.clock.half_cycles) / self.motion.half_cycles * each

    @property
    def strip_wears(self) -> bool:
        """Whether the strip has a wear law."""
        return self.wear[1].wears


@dataclass(frozen=True, kw_only=True)
class PlacedSliding(Sliding):
    """The sliding of surfaces opposite each other.

    Attributes:
        middle: The surfaces in the middle position.
        pairs: The surfaces in each phase.
        passage: Where the punch is on a strip that conducts and passes under it to and fro; None where none does.
        passes: Whether the strip's material moves past the punch's; not where nodes stick and it stays opposite.
    """

    middle: ContactPair
    pairs: tuple[ContactPair, ...]
    passage: Passage | None = None
    passes: bool = True

    def field_of(self, phase: int) -> SlidingField:
        """Return the sliding field of a phase, in its direction of the motion or as a step of a table."""
        return self.motion.phases[phase].field or self.field

    def rates(self, power: float) -> Array:
        """Return the sliding of nodes in each phase for a unit of the stroke's law (phases, n), see `node_rates`."""
        return np.array([node_rates(self.field_of(phase), pair, power) for phase, pair in enumerate(self.pairs)])

    @cached_property
    def ratio(self) -> Array:
        """Sliding of each node in each phase for a unit of the stroke's law (phases, n): 1, or mm/rad."""
        return self.rates(1.0)

    @cached_property
    def path(self) -> Array:
        """Sliding of each node in each phase (phases, n), mm."""
        return np.array([phase.distance for phase in self.motion.phases])[:, None] * self.ratio

    @cached_property
    def directions(self) -> Array:
        """Unit vectors of the sliding of each phase in space (m, n, 3), d e_v, or zero."""
        return np.array(
            [
                phase.direction * self.field_of(k).direction(pair.opposite, pair.normal)
                for k, (phase, pair) in enumerate(zip(self.motion.phases, self.pairs, strict=True))
            ]
        )

    @cached_property
    def speeds(self) -> tuple[Array, ...]:
        """Mean speeds of the nodes in each phase, and of the motion in the middle position at last (n,), mm/s."""
        motion = self.motion
        speeds = [np.asarray(phase.speed * rate) for phase, rate in zip(motion.phases, self.ratio, strict=True)]
        mean = motion.mean_speed * node_rates(self.field, self.middle)
        return (*speeds, self.path.sum(axis=0) / motion.period if motion.steps else mean)

    @property
    def steady_speed(self) -> Array:
        """The speeds of the phases (n,) or (phases, n), mm/s: one where all are alike."""
        speeds = np.array([np.broadcast_to(self.speeds[k], len(self.middle.weights)) for k in range(len(self.pairs))])
        return speeds[0] if np.abs(speeds - speeds[0]).max() <= ROUNDING * np.abs(speeds).max() else speeds

    @property
    def words(self) -> dict[int, str]:
        """The words for the two directions d of the sliding, 1 first; a table has one, through all of its steps."""
        return {1: "cyclically", -1: "back"} if self.motion.steps else self.field.words(self.middle.punch.dim)

    @property
    def many_ways(self) -> bool:
        """Whether places of a solid slide in directions of their own, step by step of a table, as a whole surface."""
        return self.motion.steps and len(self.pairs) > 1 and self.middle.punch.dim == 3

    @property
    def position_spacing(self) -> float:
        """Largest distance between neighbouring positions of the strip over that between contact nodes; 0 for one."""
        offsets = np.unique([phase.offset for phase in self.motion.phases])
        moved = self.path.max() if self.motion.steps else np.diff(offsets).max(initial=0.0) * self.ratio.max()
        return float(moved / self.middle.punch.spacing())

    @cached_property
    def carried_areas(self) -> Array:
        """Areas that nodes of the strip stand for where it carries debris (n_strip,), mm or mm².

        On a closed track, of which the mesh is a part, those by which what is put on it keeps its volume.
        """
        if self.track is None:
            return self.middle.strip.weights
        onto = self.middle.wear_projection.toarray()
        return np.asarray(np.linalg.lstsq(onto.T, self.middle.weights, rcond=None)[0])


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
