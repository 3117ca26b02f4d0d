"""Data of each body and of the steps of a phase for the exchange of heat.

The time steps of a motion: which stages each body takes in them, and where on a strip that passes they are.

The error of the steps of a half-cycle: what halving them changes of the contact temperatures.

Where the strip's material passes one way, its steady state is the same by any steps, and what they change is largest at
the end of the first half-cycle, from rest on.

To and fro the strip is at rest in its own frame, and its modes are known, theta_k' = -lambda_k theta_k + b_k, so that
the cycle that repeats needs no marching, whatever the step: with a constant b a step leaves R(lambda dt) of what is
missing to b / lambda, R being that of the rule of `fenwear.heat.heat_exchange`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array

from fenwear.case import Heat
from fenwear.common.arrays import Array
from fenwear.common.parallel import total
from fenwear.heat.conduction import HeatBody, Surroundings
from fenwear.heat.passage import Passage
from fenwear.heat.temperature import Field, Functional
from fenwear.surfaces.motion import Motion

STAGE = 1 - 1 / np.sqrt(
    2
)  # gamma: of a time step, how long each of its two stages is, see `fenwear.heat.heat_exchange`
EARLIER = (1 - STAGE) / STAGE  # r: how often the first one counts


@dataclass(frozen=True)
class Reading:
    """Temperatures and expansions of a body at the contact at the end of a phase.

    Attributes:
        contact: Temperature at the interface nodes (n,), K.
        gap: Gap that its thermal expansion opens (n,), mm.
        left_out: Addition of a unit flux of the last step to `contact` beside the coordinates (n, n); None for nothing.
    """

    contact: Functional
    gap: Functional
    left_out: Array | None = None


@dataclass(frozen=True)
class Side:
    """One body as the exchange sees it: its field and functionals of its coordinates.

    Attributes:
        field: The coordinates and their steps.
        contacts: Temperature at the interface nodes over the places of every prepared step (n,), K.
        readings: Values of the field at the contact at the end of each phase.
        balance: Heat stored, heat convected per second, and for every prepared step what enters per
            second at held temperatures by the end and by the start state, and what the moving
            material carries out; then for every prepared step what is given back; per thickness.
        held_source: Constant part of what enters at held temperatures, per prepared step, mW/mm.
        brought: Heat that new material brings, per prepared step, mW/mm.
        ambient_loss: Constant part of the convected heat, mW/mm.
        capacity: Heat capacity of the body, mJ/(mm K).
        extremes: Coldest and hottest of its initial, held, ambient and entering temperatures, K.
        bounded: Whether nothing but friction makes it hotter: not so where what has left comes back.
        gives_back: Whether what convects under the contact is given back by the flux: last rows of `balance`.
        cooled: Whether it loses heat anywhere in some phase: convection, a held temperature or new material.
    """

    field: Field
    contacts: Sequence[Functional]
    readings: Sequence[Reading]
    balance: Functional
    held_source: list[float]
    brought: list[float]
    ambient_loss: float
    capacity: float
    extremes: tuple[float, float]
    bounded: bool
    cooled: bool
    gives_back: bool = False


@dataclass(frozen=True)
class StepPlan:
    """One time step of a phase.

    Attributes:
        punch, strip: Which prepared step each body takes; together they have one duration.
        speed: Mean sliding speed, mm/s or rad/s.
        duration: Of a stage, s; infinite for a steady state, which has one stage.
    """

    punch: int
    strip: int
    speed: float
    duration: float

    @property
    def seconds(self) -> float:
        """Over which a stage makes and loses heat; of a steady state one."""
        return 1.0 if np.isinf(self.duration) else self.duration

    def of(self, body: HeatBody) -> int:
        """Return the prepared step of one of the bodies."""
        return self.punch if body.body.name == "punch" else self.strip


@dataclass(frozen=True)
class Fineness:
    """Fineness of steps and basis.

    Attributes:
        steps: In each half-cycle; 0 without heat, and where they are not known.
        change: Of contact temperatures by halving the steps, relative; NaN where it is not known.
        difference: Of contact temperature and thermal gap from those of the whole mesh, relative; NaN on that itself.
    """

    steps: int = 0
    change: float = np.nan
    difference: float = np.nan


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
    speeds = [[float(v) for v in phase_speeds] for phase_speeds in motion.mean_speeds(count)]
    durations = [STAGE * duration / count for duration in motion.durations]
    taken = [
        [StageKind(duration, d * v if moves else 0.0) for v in phase_speeds]
        for phase_speeds, d, duration in zip(speeds, motion.directions, durations, strict=True)
    ]
    of_punch = [StageKind(duration, 0.0) for duration in sorted(set(durations))]
    of_strip = sorted({stage for row in taken for stage in row})
    plans = [
        [
            StepPlan(of_punch.index(StageKind(stage.duration, 0.0)), of_strip.index(stage), v, stage.duration)
            for stage, v in zip(row, phase_speeds, strict=True)
        ]
        for row, phase_speeds in zip(taken, speeds, strict=True)
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
            for plan, place in zip(row, phase_places, strict=True)
        ]
        for row, phase_places in zip(plans, places, strict=True)
    ]
    return passed, [(transfers[place], stage) for place, stage in numbers]


STEPS, MOST = 5, 80  # of a half-cycle: to begin with, and the most that are chosen
NEUTRAL = 1e-9  # of a cycle's decay: what loses no heat
COLD = 0.1  # of the largest temperature: below, a change counts against that


@dataclass(frozen=True)
class HeatedCycle:
    """A body at rest that an even pressure heats over the steps of a cycle, on its modes.

    Attributes:
        rates: lambda (dim,), 1/s.
        loads: b of each step (k, dim), K/s.
        reading: Temperature of the contact at the end of the cycle (n, dim).
        durations: Of the steps (k,), s.
    """

    rates: Array
    loads: Sequence[Array]
    reading: Array
    durations: Sequence[float]

    def repeating(self) -> Array:
        """Return the contact's temperature at the end of the cycle that repeats (n,), K, beside a mean without end."""
        lasts = self.rates * sum(self.durations) > NEUTRAL  # else a mean that grows on, by any steps alike
        known = {duration: self._factor(duration) for duration in dict.fromkeys(self.durations)}
        state: Array = np.zeros(len(self.rates))
        through: Array = np.ones(len(self.rates))
        for load, duration in zip(self.loads, self.durations, strict=True):
            factor = known[duration]
            warms = np.divide(1 - factor, self.rates, out=np.zeros_like(factor), where=lasts)
            state, through = factor * state + warms * load, through * factor
        missing = 1 - through
        return np.asarray(self.reading @ np.divide(state, missing, out=np.zeros_like(state), where=lasts))

    def _factor(self, duration: float) -> Array:
        """Return the factor of each mode over a step (dim,), by the rule of `fenwear.heat.heat_exchange`."""
        each = self.rates * duration
        stage = 1 / (1 + STAGE * each)
        return np.asarray(stage * (1 + EARLIER * (stage - 1)))


@dataclass(frozen=True)
class HeatedPassage:
    """A body whose material passes under the contact one way while an even pressure heats it, from rest on.

    Attributes:
        body: On its whole mesh.
        velocity: Of its material, mm/s or rad/s.
        surroundings: Boundary beyond its mesh.
        load: That heats it (owned,), mW/mm.
        contact: Temperature at the contact nodes (n, owned).
        duration: Of the half-cycle, s.
    """

    body: HeatBody
    velocity: float
    surroundings: Surroundings
    load: Array
    contact: csr_array
    duration: float

    def after(self, count: int) -> Array:
        """Return the contact's temperature at the end of the half-cycle in this many steps (n,), K; collective."""
        step = self.body.step(self.velocity, STAGE * self.duration / count, self.surroundings)
        heated = step.respond(self.load[:, None])[:, 0]
        theta: Array = np.zeros(len(self.load))
        for counts in (EARLIER, 1.0) * count:
            theta = theta + counts * (step.advance(theta, sources=False) + heated - theta)
        step.free()
        return total(self.body.body.mesh.comm, self.contact @ theta)


def chosen(heat: Heat, positions: int, temperatures: Callable[[int], tuple[Array, Array]]) -> Fineness:
    """Return the steps of a half-cycle, as given or as many as the tolerance asks for; collective.

    Args:
        heat: Settings of the heat.
        positions: In a half-cycle, at each of which there are as many steps.
        temperatures: Gives the contact's by so many steps at each of them, and by twice as many, (n,) each.
    """
    steps = max(heat.steps or STEPS, positions)
    while True:
        count = -(-steps // positions)
        change = _change(*temperatures(count))
        if heat.steps is not None or change <= heat.step_tolerance or 2 * steps > MOST:
            return Fineness(count * positions, change)
        steps *= 2


def _change(coarse: Array, fine: Array) -> float:
    """Return the largest change of a contact's temperature by steps of half the length, over itself."""
    size = np.abs(fine)
    return float((np.abs(coarse - fine) / np.maximum(size, max(COLD * size.max(), 1e-300))).max())
