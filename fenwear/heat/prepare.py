"""From two bodies to a heat exchange: the steps of the motion, prepared and perhaps reduced."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fenwear.arrays import Array
from fenwear.case import Heat
from fenwear.errors import CaseError, Problem
from fenwear.heat.conduction import HeatBody, HeatStep
from fenwear.heat.exchange import HeatExchange, Side, StepPlan
from fenwear.heat.field import FullField, ReducedField
from fenwear.heat.reduction import reduced_basis
from fenwear.interface import ContactPair
from fenwear.parallel import total
from fenwear.sliding.motion import Motion


def prepare_exchange(
    heat: Heat,
    bodies: tuple[HeatBody, HeatBody],
    pair: ContactPair,
    gap_rows: tuple[Array, Array],
    motion: Motion,
    friction: Array,
    thickness: float,
    *,
    reduced: bool,
) -> HeatExchange:
    """Return the exchange over the half-cycles of the motion; collective.

    Args:
        heat: Settings of the heat.
        bodies: Conduction in the punch and in the strip.
        pair: The contact.
        gap_rows: Gap that each kelvin of this rank's nodes opens, (n, owned) each, mm/K.
        motion: The sliding motion.
        friction: mu of the contact nodes times what they slide for a unit of the stroke (n,), in all phases.
        thickness: Of a plane model, mm.
        reduced: Whether the temperatures are projected onto a small basis.

    Raises:
        CaseError: the half-cycles of the motion last unequally long.
    """
    if len({round(phase.duration, 12) for phase in motion.phases}) > 1:
        raise CaseError(Problem("motion", "expected half-cycles of equal duration with heat"))
    count = -(-heat.steps // motion.positions)  # of each phase: at least as many in a half-cycle as asked for
    duration = motion.phases[0].duration / count
    speeds = motion.mean_speeds(count)
    signed = [[d * float(v) for v in speeds[phase]] for phase, d in enumerate(motion.directions)]
    every = [velocity for row in signed for velocity in row]
    velocities = sorted(set(every))
    of_strip = {velocity: kind for kind, velocity in enumerate(velocities)}
    plans = [[StepPlan(0, of_strip[velocity], abs(velocity)) for velocity in row] for row in signed]
    sides = []
    for body, inflow, rows, own in zip(bodies, inflows(bodies, pair), gap_rows, ([0.0], velocities), strict=True):
        steps = [body.step(velocity, duration) for velocity in own]
        if reduced:
            moving = [0.0] if len(own) == 1 and own[0] == 0 else every
            lift, basis = reduced_basis(body, inflow, moving, duration, heat.reduction_tolerance)
            field: FullField | ReducedField = ReducedField(body, steps, inflow, lift, basis)
        else:
            field = FullField(body, steps, inflow)
        sides.append(_side(field, steps, pair, rows))
    return _exchange(heat, (sides[0], sides[1]), plans, duration, pair, friction, thickness)


def prepare_steady(
    heat: Heat,
    bodies: tuple[HeatBody, HeatBody],
    pair: ContactPair,
    gap_rows: tuple[Array, Array],
    velocities: Sequence[float],
    friction: Array,
    thickness: float,
) -> HeatExchange:
    """Return the exchange whose phase k is the steady state of the strip moving at velocity k; collective.

    Raises:
        CaseError: a body has no heat sink.
    """
    plans = [[StepPlan(0, k, abs(v))] for k, v in enumerate(velocities)]
    sides = []
    for body, inflow, rows, own in zip(bodies, inflows(bodies, pair), gap_rows, ([0.0], velocities), strict=True):
        steps = [body.step(velocity, np.inf) for velocity in own]
        sides.append(_side(FullField(body, steps, inflow), steps, pair, rows))
    return _exchange(heat, (sides[0], sides[1]), plans, np.inf, pair, friction, thickness)


def inflows(bodies: tuple[HeatBody, HeatBody], pair: ContactPair) -> tuple[Array, Array]:
    """Return the loads of unit fluxes at the interface nodes on each body (owned, n), mm."""
    weights = np.diag(pair.weights)
    return bodies[0].place(weights), bodies[1].place(pair.transfer.T @ weights)


def _exchange(
    heat: Heat,
    sides: tuple[Side, Side],
    plans: list[list[StepPlan]],
    duration: float,
    pair: ContactPair,
    friction: Array,
    thickness: float,
) -> HeatExchange:
    return HeatExchange(heat, sides, plans, duration, np.tile(friction, (len(plans), 1)), pair.weights, thickness)


def _side(field: FullField | ReducedField, steps: Sequence[HeatStep], pair: ContactPair, gap_rows: Array) -> Side:
    body = field.body
    contact_rows = body.contact_rows
    if body.body.name == "strip":
        contact_rows = pair.transfer @ contact_rows
    balance_rows = [body.storage, body.convected]
    for step in steps:
        balance_rows += [step.held_by_end, step.held_by_start, step.velocity * body.carried]
    rows = np.array(balance_rows)
    comm = body.body.mesh.comm
    initial = total(comm, gap_rows @ np.full(body.owned, body.heat.initial))  # the bodies fit at this temperature
    gap = field.observe(gap_rows)
    ambient = body.heat.ambient * float(total(comm, np.array([body.convected.sum()]))[0])
    return Side(
        field,
        field.observe(contact_rows),
        lambda state: gap(state) - initial,
        field.observe(rows),
        field.observe_change(contact_rows),
        field.observe_change(gap_rows),
        field.observe_change(rows),
        [step.held_source for step in steps],
        ambient,
    )
