"""What the exchange of heat knows of each body, and of the steps of a phase."""

from __future__ import annotations

from dataclasses import dataclass

from fenwear.heat.field import Field, Functional


@dataclass(frozen=True)
class Side:
    """One body as the exchange sees it: its field and functionals of its coordinates.

    Attributes:
        field: The coordinates and their steps.
        contact: Temperature at the interface nodes (n,), K.
        gap: Gap that its thermal expansion opens (n,), mm.
        balance: Heat stored, heat convected per second, and for every prepared step what enters per
            second at held temperatures by the end and by the start state, and what the moving
            material carries out; per thickness.
        held_source: Constant part of what enters at held temperatures, per prepared step, mW/mm.
        brought: Heat that new material brings, per prepared step, mW/mm.
        ambient_loss: Constant part of the convected heat, mW/mm.
        capacity: Heat capacity of the body, mJ/(mm K).
        extremes: Coldest and hottest of its initial, held, ambient and entering temperatures, K.
        bounded: Whether nothing but friction makes it hotter: not so where what has left comes back.
        cooled: Whether it loses heat anywhere in some phase: convection, a held temperature or new material.
    """

    field: Field
    contact: Functional
    gap: Functional
    balance: Functional
    held_source: list[float]
    brought: list[float]
    ambient_loss: float
    capacity: float
    extremes: tuple[float, float]
    bounded: bool
    cooled: bool


@dataclass(frozen=True)
class StepPlan:
    """One time step of a phase: which prepared step each body takes, and the mean sliding speed."""

    punch: int
    strip: int
    speed: float
