"""From two bodies to a heat exchange: the steps of the motion, prepared and perhaps reduced."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from scipy.sparse import csc_array, csr_array, diags_array, hstack

from fenwear.arrays import Array
from fenwear.case import Heat, Track
from fenwear.errors import CaseError, HeatError, InputError
from fenwear.heat.conduction import HeatBody, HeatStep, Surroundings
from fenwear.heat.contact_response import contact_responses
from fenwear.heat.exchange import HeatExchange
from fenwear.heat.field import FullField, ReducedField
from fenwear.heat.kept_basis import Way, kept_basis, made
from fenwear.heat.reduction import ROUNDING, reduced_basis
from fenwear.heat.side import Side, StepPlan
from fenwear.heat.track import TrackField
from fenwear.interface import ContactPair
from fenwear.parallel import total
from fenwear.sliding.field import SlidingField
from fenwear.sliding.motion import Motion

MANY = 300  # contact nodes above which a basis holds what is felt a step later alone
NEUTRAL = 1e-8  # of a spectral radius above 1: a body that loses no heat has 1


def prepare_exchange(
    heat: Heat,
    bodies: tuple[HeatBody, HeatBody],
    pair: ContactPair,
    expansions: tuple[Array, Array],
    sliding: SlidingField,
    motion: Motion,
    friction: Array,
    thickness: float,
    *,
    reduced: bool,
    at_rest: bool = False,
    keep: bool = False,
    fresh: bool = False,
) -> HeatExchange:
    """Return the exchange over the half-cycles of the motion; collective.

    Args:
        heat: Settings of the heat.
        bodies: Conduction in the punch and in the strip.
        pair: The contact.
        expansions: What each kelvin of this rank's nodes moves each surface along the normal, (n, owned) each, mm/K.
        sliding: The velocity of the strip's material for a unit speed.
        motion: The sliding motion.
        friction: mu of the contact nodes times what they slide for a unit of the stroke (n,), in all phases.
        thickness: Of a plane model, mm.
        reduced: Whether the temperatures are projected onto a small basis.
        at_rest: Whether the strip's material stays where it is, whatever the motion.
        keep: Whether bases are kept on disk, and taken from there where they are.
        fresh: Make them whatever is kept.

    Raises:
        CaseError: the half-cycles of the motion last unequally long.
        HeatError: no basis gives temperatures that die out.
    """
    plans, velocities, duration = _plans(heat, motion, at_rest=at_rest)
    # Sliding to and fro brings back what it took away, unless the case says what comes instead.
    renewed = heat.inflow is not None or velocities[0] * velocities[-1] > 0
    cycles = [[getattr(step, body.body.name) for plan in plans for step in plan] for body in bodies]
    sides = []
    for body, inflow, rows, own, cycle in zip(
        bodies, inflows(bodies, pair), expansions, ([0.0], velocities), cycles, strict=True
    ):
        around = _surroundings(body, pair, sliding, renewed=renewed)
        steps = [body.step(velocity, duration, around, at_once=reduced) for velocity in own]
        field: FullField | ReducedField | TrackField
        moving = [own[step] for step in cycle]
        if heat.track is not None and body.body.name == "strip":
            field = _on_track(heat, heat.track, body, steps, inflow, own, duration, around, cycle, thickness)
        elif reduced:
            lasting = contact_rows(body, pair) if len(pair.weights) > MANY else None
            tolerance, way = heat.reduction_tolerance, partial(kept_basis, fresh=fresh) if keep else made
            field = _reduced(body, steps, inflow, moving, duration, tolerance, around, cycle, lasting, way)
        else:
            field = FullField(body, steps, inflow)
        cooled = any(body.loses_heat(velocity, around) for velocity in own)  # the same on every rank
        sides.append(_side(field, steps, around, pair, rows, cooled=cooled))
        for step in steps if reduced else ():  # what is left of them is in the small field
            step.free()
    return _exchange(heat, (sides[0], sides[1]), plans, duration, pair, friction, thickness)


def _plans(heat: Heat, motion: Motion, *, at_rest: bool) -> tuple[list[list[StepPlan]], list[float], float]:
    """Return the steps of each phase, the velocities of the strip's material in them, and how long each lasts, s.

    Raises:
        CaseError: the half-cycles of the motion last unequally long.
    """
    if len({round(phase.duration, 12) for phase in motion.phases}) > 1:
        raise CaseError(InputError("motion", "expected half-cycles of equal duration with heat"))
    count = -(-heat.steps // motion.positions)  # of each phase: at least as many in a half-cycle as asked for
    speeds = motion.mean_speeds(count)
    signed = [[0.0 if at_rest else d * float(v) for v in speeds[phase]] for phase, d in enumerate(motion.directions)]
    velocities = sorted({velocity for row in signed for velocity in row})
    of_strip = {velocity: kind for kind, velocity in enumerate(velocities)}
    plans = [[StepPlan(0, of_strip[velocity], abs(velocity)) for velocity in row] for row in signed]
    return plans, velocities, motion.phases[0].duration / count


def prepare_steady(
    heat: Heat,
    bodies: tuple[HeatBody, HeatBody],
    pair: ContactPair,
    expansions: tuple[Array, Array],
    sliding: SlidingField,
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
    for body, inflow, rows, own in zip(bodies, inflows(bodies, pair), expansions, ([0.0], velocities), strict=True):
        around = _surroundings(body, pair, sliding, renewed=True)
        steps = [body.step(velocity, np.inf, around) for velocity in own]
        sides.append(_side(FullField(body, steps, inflow), steps, around, pair, rows, cooled=True))
    return _exchange(heat, (sides[0], sides[1]), plans, np.inf, pair, friction, thickness)


def _reduced(
    body: HeatBody,
    steps: list[HeatStep],
    inflow: csc_array,
    speeds: Sequence[float],
    duration: float,
    tolerance: float,
    surroundings: Surroundings,
    cycle: Sequence[int],
    lasting: csr_array | None = None,
    way: Way = made,
) -> ReducedField:
    """Return the field on a basis whose cycle of steps lets every temperature die out; collective.

    Args:
        lasting: Temperature at the contact nodes, for a basis of what is felt a step later; None for all.
        way: How a basis is come by: made, or taken from what is kept.

    Raises:
        HeatError: none does.
    """
    exact = None if lasting is None else contact_responses(steps, inflow, lasting)
    while True:
        settings = (inflow, speeds, duration, tolerance, surroundings)
        basis = way(partial(reduced_basis, body, *settings, lasting=lasting is not None), steps)
        field = ReducedField(steps, inflow, basis, exact)
        growth = field.spectral_radius(cycle)
        if growth <= 1 + NEUTRAL:
            return field
        if tolerance <= ROUNDING:
            raise HeatError(
                f"the reduced temperatures of the {body.body.name} grow without heat, by a factor of "
                f"{growth:.6g} a cycle, on any basis: hold the temperature where its material enters, "
                'give heat.inflow, or set heat.operator = "full"'
            )
        tolerance = max(tolerance / 10, ROUNDING)  # more fields: nearer to the full steps, whose temperatures die out


def _on_track(
    heat: Heat,
    track: Track,
    body: HeatBody,
    steps: list[HeatStep],
    inflow: csc_array,
    speeds: Sequence[float],
    duration: float,
    surroundings: Surroundings,
    cycle: Sequence[int],
    thickness: float,
) -> TrackField:
    """Return the strip's reduced field with the bulk of its closed track; collective.

    Raises:
        CaseError: nothing enters the mesh.
    """
    if not surroundings.renewed or not body.flow(surroundings.sliding).is_open:
        message = "expected a strip whose material enters through a free end: none leaves the mesh to come back"
        raise CaseError(InputError("heat.track", message))
    # What enters at a kelvin, as large as a unit flux: what is small against the largest is dropped from the basis.
    comm, entering = body.body.mesh.comm, steps[0].entering
    fluxes, unit = total(comm, np.array([np.abs(inflow).sum() / inflow.shape[1], np.abs(entering).sum()]))
    both = csc_array(hstack([inflow, csc_array(entering[:, None] * (fluxes / unit))]))
    moving = [speeds[step] for step in cycle]
    inner = _reduced(body, steps, both, moving, duration, heat.reduction_tolerance, surroundings, cycle)
    kelvins = [abs(speed / speeds[0]) * unit / fluxes for speed in speeds]
    return TrackField(inner, steps, kelvins, duration, track, thickness)


def _surroundings(body: HeatBody, pair: ContactPair, sliding: SlidingField, *, renewed: bool) -> Surroundings:
    """Return what a body meets beyond its mesh: the strip new material, and beside the punch the surroundings."""
    if body.body.name == "punch":
        return Surroundings()
    flow = body.flow(sliding)
    renewed = renewed and (flow.is_open or not flow.turns)  # what turns in its place comes back
    areas = body.surface.spread @ body.surface.weights
    covered = pair.transfer.T @ pair.weights
    bare = np.maximum(areas - covered, 0.0)  # unlike meshes leave less than nothing beside an edge
    bare[bare < 1e-9 * areas] = 0.0
    if not bare.any():
        return Surroundings(renewed, sliding=sliding)
    bare *= (areas.sum() - covered.sum()) / bare.sum()
    return Surroundings(renewed, body.place(bare), sliding)


def contact_rows(body: HeatBody, pair: ContactPair) -> csr_array:
    """Return what gives the temperature of a body at the interface nodes, (n, owned) of this rank."""
    onto_nodes = pair.transfer if body.body.name == "strip" else pair.punch.spread.T
    return csr_array(onto_nodes @ body.trace.rows)


def inflows(bodies: tuple[HeatBody, HeatBody], pair: ContactPair) -> tuple[csc_array, csc_array]:
    """Return the loads of unit fluxes at the interface nodes on each body (owned, n), mm."""
    weights = diags_array(pair.weights)
    punch, strip = (
        csc_array(body.trace.rows.T @ (onto @ weights))
        for body, onto in zip(bodies, (pair.punch.spread, pair.transfer.T), strict=True)
    )
    return punch, strip


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


def _side(
    field: FullField | ReducedField | TrackField,
    steps: Sequence[HeatStep],
    surroundings: Surroundings,
    pair: ContactPair,
    expansion: Array,
    *,
    cooled: bool,
) -> Side:
    body = field.basis.body
    convected = body.convected
    if surroundings.exposed is not None:
        convected = convected + body.heat.convection * surroundings.exposed
    balance_rows = [body.storage, convected]
    for step in steps:
        balance_rows += [step.held_by_end, step.held_by_start, step.carried]
    rows = np.array(balance_rows)
    comm, moves = body.body.mesh.comm, body.body.name == "strip"
    initial = total(comm, expansion @ np.full(body.owned, body.heat.initial))  # the bodies fit at this temperature
    capacity, ambient_loss = (float(sums) for sums in total(comm, np.array([body.storage.sum(), convected.sum()])))
    side = Side(
        field,
        field.observe(contact_rows(body, pair)),
        field.observe(expansion).less(initial).times(-1.0 if moves else 1.0),  # few rows of a basis: no copy of all
        field.observe(rows),
        [step.held_source for step in steps],
        [step.brought for step in steps],
        body.heat.ambient * ambient_loss,
        capacity,
        body.extremes(surroundings),
        surroundings.renewed or not moves or not body.flow(surroundings.sliding).is_open,
        cooled,
    )
    return field.balanced(side) if isinstance(field, TrackField) else side
