"""How far the steps of a half-cycle are from the limit: what halving them changes of the contact temperatures.

Where the strip's material passes one way, its steady state is the same by any steps, and what they change is largest at
the end of the first half-cycle, from rest on.

To and fro the strip is at rest in its own frame, and its modes are known, theta_k' = -lambda_k theta_k + b_k, so that
the cycle that repeats needs no marching, whatever the step: with a constant b a step leaves R(lambda dt) of what is
missing to b / lambda, R being that of the rule of `fenwear.heat.exchange`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from fenwear.arrays import Array
from fenwear.case import Heat
from fenwear.heat.conduction import HeatBody, Surroundings
from fenwear.heat.exchange import EARLIER, STAGE
from fenwear.heat.side import Fineness
from fenwear.parallel import total

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
        """Return what a step leaves of each mode (dim,), by the rule of `fenwear.heat.exchange`."""
        each = self.rates * duration
        stage = 1 / (1 + STAGE * each)
        return np.asarray(stage * (1 + EARLIER * (stage - 1)))


@dataclass(frozen=True)
class HeatedPassage:
    """A body whose material passes under the contact one way while an even pressure heats it, from rest on.

    Attributes:
        body: On its whole mesh.
        velocity: Of its material, mm/s or rad/s.
        surroundings: What it meets.
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
