"""What the exchange of heat knows of each body, and of the steps of a phase."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fenwear.arrays import Array
from fenwear.heat.conduction import HeatBody
from fenwear.heat.field import Field, Functional


@dataclass(frozen=True)
class Reading:
    """What is seen of a body at the end of a phase, with the contact where it is then.

    Attributes:
        contact: Temperature at the interface nodes (n,), K.
        gap: Gap that its thermal expansion opens (n,), mm.
        left_out: What a unit flux of the last step adds to `contact` beside the coordinates (n, n); None for nothing.
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
        readings: What is seen of it at the end of each phase.
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
    """How fine steps and basis are.

    Attributes:
        steps: In each half-cycle.
        change: Of contact temperatures by halving the steps, relative; None where it is not known.
        difference: Of contact temperature and thermal gap from those of the whole mesh, relative; None on that itself.
    """

    steps: int
    change: float | None = None
    difference: float | None = None
