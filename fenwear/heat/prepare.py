"""From two bodies to a heat exchange: the steps of the motion, prepared and perhaps reduced."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import csr_array

from fenwear.arrays import Array
from fenwear.case import Case
from fenwear.errors import CaseError, Problem
from fenwear.heat.conduction import HeatBody, HeatStep
from fenwear.heat.exchange import HeatExchange, Side, StepPlan
from fenwear.heat.field import FullField, ReducedField
from fenwear.heat.reduction import reduced_basis
from fenwear.interface import Facing
from fenwear.parallel import total
from fenwear.sliding.motion import Motion


def prepare_exchange(
    case: Case,
    bodies: tuple[HeatBody, HeatBody],
    facing: Facing,
    gap_rows: tuple[Array, Array],
    motion: Motion,
    friction: Array,
    *,
    reduced: bool,
) -> HeatExchange:
    """Return the exchange over the half-cycles of the motion; collective.

    Args:
        case: The case, with heat.
        bodies: Conduction in the punch and in the strip.
        facing: The interface.
        gap_rows: Gap that each kelvin of this rank's nodes opens, (n, owned) each, mm/K.
        motion: The sliding motion.
        friction: mu of the interface nodes (n,), in all phases.
        reduced: Whether the temperatures are projected onto a small basis.

    Raises:
        CaseError: the half-cycles of the motion last unequally long.
    """
    heat = case.heat
    assert heat is not None
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
    for body, inflow, rows, own in zip(bodies, inflows(bodies, facing), gap_rows, ([0.0], velocities), strict=True):
        steps = [body.step(velocity, duration) for velocity in own]
        if reduced:
            moving = [0.0] if len(own) == 1 and own[0] == 0 else every
            lift, basis = reduced_basis(body, inflow, moving, duration, heat.reduction_tolerance)
            field: FullField | ReducedField = ReducedField(body, steps, inflow, lift, basis)
        else:
            field = FullField(body, steps, inflow)
        sides.append(_side(field, steps, facing, rows))
    return _exchange(case, (sides[0], sides[1]), plans, duration, facing, friction)


def prepare_steady(
    case: Case,
    bodies: tuple[HeatBody, HeatBody],
    facing: Facing,
    gap_rows: tuple[Array, Array],
    velocities: Sequence[float],
    friction: Array,
) -> HeatExchange:
    """Return the exchange whose phase k is the steady state of the strip moving at velocity k; collective.

    Raises:
        CaseError: a body has no heat sink.
    """
    plans = [[StepPlan(0, k, abs(v))] for k, v in enumerate(velocities)]
    sides = []
    for body, inflow, rows, own in zip(bodies, inflows(bodies, facing), gap_rows, ([0.0], velocities), strict=True):
        steps = [body.step(velocity, np.inf) for velocity in own]
        sides.append(_side(FullField(body, steps, inflow), steps, facing, rows))
    return _exchange(case, (sides[0], sides[1]), plans, np.inf, facing, friction)


def inflows(bodies: tuple[HeatBody, HeatBody], facing: Facing) -> tuple[Array, Array]:
    """Return the loads of unit fluxes at the interface nodes on each body (owned, n), mm."""
    weights = np.diag(facing.weights)
    return bodies[0].place(weights), bodies[1].place(facing.transfer.T @ weights)


def _exchange(
    case: Case,
    sides: tuple[Side, Side],
    plans: list[list[StepPlan]],
    duration: float,
    facing: Facing,
    friction: Array,
) -> HeatExchange:
    assert case.heat is not None
    return HeatExchange(
        case.heat, sides, plans, duration, np.tile(friction, (len(plans), 1)), facing.weights, case.model.thickness
    )


def _side(field: FullField | ReducedField, steps: Sequence[HeatStep], facing: Facing, gap_rows: Array) -> Side:
    body = field.body
    contact_rows = body.contact_rows
    if body.body.name == "strip":
        contact_rows = csr_array(facing.transfer) @ contact_rows
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
