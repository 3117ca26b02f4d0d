"""The time steps of a motion: which stages each body takes in them, and where on a strip that passes they are."""

from __future__ import annotations

from dataclasses import dataclass, replace

from scipy.sparse import csr_array

from fenwear.heat.exchange import STAGE
from fenwear.heat.passage import Passage
from fenwear.heat.side import StepPlan
from fenwear.sliding.motion import Motion


@dataclass(frozen=True, order=True)
class StageKind:
    """A kind of stage of a body whose contact stays in its place.

    Attributes:
        duration: s.
        velocity: Of the body's material, mm/s or rad/s.
    """

    duration: float
    velocity: float


def step_plans(
    motion: Motion, count: int, *, moves: bool
) -> tuple[list[list[StepPlan]], list[StageKind], list[StageKind]]:
    """Return the steps of each phase, and the stages of punch and strip that they take, the shortest first.

    Args:
        motion: The sliding motion.
        count: Steps of each phase.
        moves: Whether the strip's material moves through its mesh.
    """
    speeds = [[float(v) for v in own] for own in motion.mean_speeds(count)]
    durations = [STAGE * duration / count for duration in motion.durations]
    taken = [
        [StageKind(duration, d * v if moves else 0.0) for v in own]
        for own, d, duration in zip(speeds, motion.directions, durations, strict=True)
    ]
    of_punch = [StageKind(duration, 0.0) for duration in sorted(set(durations))]
    of_strip = sorted({stage for row in taken for stage in row})
    plans = [
        [
            StepPlan(of_punch.index(StageKind(stage.duration, 0.0)), of_strip.index(stage), v, stage.duration)
            for stage, v in zip(row, own, strict=True)
        ]
        for row, own in zip(taken, speeds, strict=True)
    ]
    return plans, of_punch, of_strip


def at_places(
    passage: Passage, plans: list[list[StepPlan]], count: int
) -> tuple[list[list[StepPlan]], list[tuple[csr_array, int]]]:
    """Return the steps of a strip that passes under the punch, and for each kind its mean transfer and its stage."""
    transfers, places = passage.steps(count)
    numbers: dict[tuple[int, int], int] = {}
    passed = [
        [
            replace(plan, strip=numbers.setdefault((place, plan.strip), len(numbers)))
            for plan, place in zip(row, own, strict=True)
        ]
        for row, own in zip(plans, places, strict=True)
    ]
    return passed, [(transfers[place], stage) for place, stage in numbers]
