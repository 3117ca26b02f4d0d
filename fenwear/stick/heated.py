"""A time step of contact with stick and of heat, solved together.

A node conducts where it touches at the end of the step. Nodes that open as they are heated, and close as they cool, may
have no answer of that kind: then those conduct that touched when the iterations had seen enough of it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fenwear.arrays import Array, Mask
from fenwear.cycle.fixed_point import fixed_point
from fenwear.interface.placement import Placement
from fenwear.stick.heat import StickHeat
from fenwear.stick.position import LoadEffect
from fenwear.stick.state import StickState

CLOSE = 1e-9  # change of heat and pressure over their largest that ends the iterations of a step
ENOUGH = 12  # iterations after which nodes that open and close no longer decide who conducts
APART = "contact with stick and heat did not come together: expected more stick.steps, or less friction heat; tried"


@dataclass(frozen=True)
class StepStart:
    """A time step with heat, and what is there at its start.

    Attributes:
        number: In the cycle.
        duration: s.
        offset: Of the strip, mm or rad, or its place.
        temperature: At its start (dim,).
        heating: Heat of friction of the nodes in the step before (n,), mW/mm².
    """

    number: int
    duration: float
    offset: float | Placement
    temperature: Array
    heating: Array


@dataclass(frozen=True)
class CoupledStep:
    """The contact at the end, loads with the expansion, temperatures (dim,), heat and conductance of the nodes (n,)."""

    state: StickState
    loaded: LoadEffect
    temperature: Array
    heating: Array
    conductance: Array
    iterations: int


def coupled_step(
    heat: StickHeat,
    solved: Callable[[LoadEffect, tuple[Array, Array] | None], StickState],
    loaded: LoadEffect,
    before: StickState,
    start: StepStart,
    flux: float,
) -> CoupledStep:
    """Return contact and heat of a time step that belong together.

    Args:
        heat: Of both bodies.
        solved: Returns the contact under loads, from the pressure and the trial of one that is near.
        loaded: The loads without expansion.
        before: The contact at the start.
        start: The step, with what is there before it.
        flux: What friction makes at most, about, mW/mm².

    Raises:
        ConvergenceError: they do not come together.
    """
    n = len(before.pressure)
    units = np.repeat([1 / max(flux, 1e-300), 1 / max(float(before.pressure.max()), 1e-300)], n)
    last, conducting, settled, tries = before, before.closed, False, 0
    near: tuple[Array, Array] | None = None

    def conductance(pressure: Array, closed: Mask) -> Array:
        return heat.conductance(np.where(closed, np.maximum(pressure, 1e-300), 0.0))

    def once(x: Array) -> tuple[Array, LoadEffect, bool]:
        nonlocal last, conducting, settled, tries, near
        # Pressures that iterations have mixed are not zero where nodes are open: the last contact tells who conducts.
        conducting = last.closed if tries < ENOUGH else conducting
        made, pressure = np.split(x / units, 2)
        warm = heat.step(start.number, start.temperature, made, conductance(pressure, conducting)).values
        expanded = heat.expanded(loaded, warm, start.offset)
        last = solved(expanded, near)
        near, tries = (last.pressure, last.trial), tries + 1
        settled = tries >= ENOUGH or bool((last.closed == conducting).all())
        return units * np.concatenate([last.heat / start.duration, last.pressure]), expanded, False

    def close(change: Array, _: Array) -> bool:
        return settled and float(np.abs(change).max()) < CLOSE

    expanded = fixed_point(once, units * np.concatenate([start.heating, before.pressure]), close, APART)
    made, conducts = np.asarray(last.heat / start.duration), conductance(last.pressure, conducting)
    warm = heat.step(start.number, start.temperature, made, conducts).values
    return CoupledStep(last, expanded, warm, made, conducts, tries)
