"""From two bodies to a heat exchange: the steps of the motion, prepared and perhaps reduced."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, partial

import numpy as np
from scipy.sparse import csc_array, csr_array, diags_array, hstack

from fenwear.case import Heat, Track
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError
from fenwear.common.parallel import once, total
from fenwear.heat.closed_track import TrackField, section_modes
from fenwear.heat.conduction import HeatBody, HeatStep, Surroundings
from fenwear.heat.fitted import BasisRequest, Trial, Way, fitted_field, kept_basis, made, pressures, rigid_gaps
from fenwear.heat.heat_exchange import HeatExchange
from fenwear.heat.passage import Passage
from fenwear.heat.passing_strip import MANY, PassingStrip, ReciprocatingField
from fenwear.heat.side import (
    STEPS,
    Fineness,
    HeatedPassage,
    Reading,
    Side,
    StageKind,
    StepPlan,
    at_places,
    chosen,
    step_plans,
)
from fenwear.heat.temperature import FullField, Functional, ReducedField
from fenwear.surfaces import ContactPair
from fenwear.surfaces.motion import Motion
from fenwear.surfaces.sliding_field import SlidingField

Moved = Callable[[Array], Array]  # displacement of the trace nodes (N, d, k), mm, by temperatures (owned, k)
Opened = Callable[[Array], Array]  # gap at the contact nodes (n, k), mm, by temperatures (owned, k)


def prepare_exchange(
    heat: Heat,
    bodies: tuple[HeatBody, ...],
    pair: ContactPair,
    expansions: tuple[Array, Array],
    sliding: SlidingField,
    motion: Motion,
    friction: Array,
    thickness: float,
    *,
    reduced: bool,
    passage: Passage | None = None,
    moved: tuple[Moved, Moved] | None = None,
    others: Sequence[float] = (),
    keep: bool = False,
    fresh: bool = False,
) -> HeatExchange:
    """Return the exchange over the half-cycles of the motion; collective.

    Args:
        heat: Settings of the heat.
        bodies: Conduction in the punch and in the strip.
        pair: The contact.
        expansions: Motion of each surface along the normal by each kelvin of this rank's nodes (n, owned), mm/K; of a
            strip that passes under the punch at the nodes of the passage (q, owned).
        sliding: The velocity of the strip's material for a unit speed.
        motion: The sliding motion.
        friction: mu of the contact nodes times what they slide for a unit of the stroke (n,), or in each phase (m, n).
        thickness: Of a plane model, mm.
        reduced: Whether the temperatures are projected onto a small basis.
        passage: Where the punch is on a strip that passes to and fro or through a cycle; None where it moves one way
            or not at all.
        moved: Motion of the surfaces by the bodies' temperatures, for the certificates, where `expansions` are not to
            open the contact.
        others: Speeds of all stages of a program one way, which share their bases.
        keep: Whether bases are kept on disk, and taken from there where they are.
        fresh: Make them whatever is kept.

    Raises:
        HeatError: no basis gives temperatures that die out.
    """
    one_way = motion.one_way
    friction = np.broadcast_to(friction, (len(motion.phases), len(pair.weights)))
    way: Way = partial(kept_basis, fresh=fresh) if keep else made
    strip = None if passage is None else PassingStrip(heat, bodies[1], passage, way)
    fineness = Fineness(heat.steps or STEPS)
    if strip is not None and (motion.steps or motion.positions < STEPS):
        fineness = strip.fineness(motion, heat)
    elif one_way and motion.positions < STEPS:
        fineness = _passed_fineness(heat, bodies, pair, sliding, motion, friction[0], others)
    count = -(-fineness.steps // motion.positions)  # of each phase: at least as many in a half-cycle as asked for
    plans, *stages = step_plans(motion, count, moves=one_way)
    shortest = stages[0][0].duration
    of_places: list[tuple[csr_array, int]] = []
    if passage is not None:
        plans, of_places = at_places(passage, plans, count)
    sides, differences = [], []
    for body, inflow, rows, phase_stages, by in zip(
        bodies, inflows(bodies, pair), expansions, stages, moved or (None, None), strict=True
    ):
        velocities = [stage.velocity for stage in phase_stages]
        if strip is not None and body is strip.body:
            opened = opened_gap(body, pair, rows, by, strip.passage)
            side, difference = _passing(heat, strip, of_places, phase_stages, plans, rows, opened, reduced=reduced)
        else:
            around = _surroundings(body, pair, sliding, renewed=one_way)
            steps = [body.step(stage.velocity, stage.duration, around) for stage in phase_stages]
            rated = None
            if reduced:
                cycle = [step.of(body) for row in plans for step in row]
                moving = [velocities[step] for step in cycle] + [v for v in others if body.body.name == "strip"]
                wish = BasisRequest(
                    moving, shortest, heat.reduction_tolerance, heat.reduction_difference, around, cycle, way
                )
                rated = wish, _trial(body, pair, inflow, opened_gap(body, pair, rows, by), friction, plans)
            side, difference = _in_place(
                heat, body, steps, velocities, pair, inflow, rows, plans, around, rated, thickness
            )
        sides.append(side)
        differences += [] if difference is None else [difference]
    exchange = HeatExchange(heat, (sides[0], sides[1]), plans, friction.copy(), pair.weights, thickness)
    exchange.fineness = replace(fineness, steps=count * motion.positions, difference=max(differences, default=np.nan))
    return exchange


def _in_place(
    heat: Heat,
    body: HeatBody,
    steps: list[HeatStep],
    velocities: Sequence[float],
    pair: ContactPair,
    inflow: csc_array,
    rows: Array,
    plans: Sequence[Sequence[StepPlan]],
    around: Surroundings,
    rated: tuple[BasisRequest, Trial] | None,
    thickness: float,
) -> tuple[Side, float | None]:
    """Return the side of a body whose contact stays in its place, and its difference from its whole mesh; collective.

    Args:
        steps: Prepared ones.
        own: Velocity of its material in each of them.
        inflow: Loads of unit fluxes (owned, n).
        rows: Of the gap that its expansion opens (n, owned), mm/K.
        plans: The steps of each phase.
        around: Boundary beyond its mesh.
        rated: Requirements of its basis, and its trial; None for the whole mesh.
        thickness: Of a plane model, mm.
    """
    field: FullField | ReducedField | TrackField
    difference = None
    if rated is None:
        field = FullField(body, steps, inflow)
    elif heat.track is not None and body.body.name == "strip":
        field, difference = _on_track(heat.track, body, steps, velocities, *rated, thickness)
    else:
        lasting = contact_rows(body, pair) if len(pair.weights) > MANY else None
        field, difference = fitted_field(body, steps, velocities, rated[1], rated[0], lasting)
    cooled = any(body.loses_heat(velocity, around) for velocity in velocities)  # the same on every rank
    side = _side(field, steps, around, pair, rows, [row[-1].of(body) for row in plans], cooled=cooled)
    for step in steps if rated is not None else ():  # what is left of them is in the small field
        step.free()
    return side, difference


def _passed_fineness(
    heat: Heat,
    bodies: tuple[HeatBody, ...],
    pair: ContactPair,
    sliding: SlidingField,
    motion: Motion,
    friction: Array,
    others: Sequence[float],
) -> Fineness:
    """Return the steps of a half-cycle one way, by the fastest speed of all stages; collective.

    All stages of a program have the same, chosen for the first.
    """
    velocities = np.array(motion.directions) * motion.mean_speeds(1)[:, 0]
    fastest, duration = max([*velocities, *others], key=abs), motion.phases[0].duration
    if fastest == 0:
        return Fineness(heat.steps or STEPS)
    strip, load = bodies[1], np.asarray(inflows(bodies, pair)[1] @ friction)
    around = _surroundings(strip, pair, sliding, renewed=True)
    passage = HeatedPassage(strip, fastest, around, load, contact_rows(strip, pair), duration)
    exposed = None if around.exposed is None else around.exposed.tobytes()
    settings = (fastest, duration, motion.positions, heat.steps, heat.step_tolerance)
    after = cache(passage.after)

    def choose() -> Fineness:
        return chosen(heat, motion.positions, lambda count: (after(count), after(2 * count)))

    return once(strip.body.mesh.comm, strip.fineness, (*settings, load.tobytes(), exposed), choose)


def _trial(
    body: HeatBody,
    pair: ContactPair,
    inflow: csc_array,
    opened: Opened,
    friction: Array,
    plans: Sequence[Sequence[StepPlan]],
) -> Trial:
    """Return the trial heat of a body whose contact stays in its place, for its reduced temperatures."""
    tried, moves = pressures(pair.punch.x), any(plan.speed for row in plans for plan in row)
    entering = [
        tried * friction[phase, :, None] * (plan.speed if moves else 1.0)
        for phase, row in enumerate(plans)
        for plan in row
    ]
    return Trial(inflow, entering, contact_rows(body, pair), opened, rigid_gaps(body, pair.punch.x))


def opened_gap(
    body: HeatBody, pair: ContactPair, rows: Array, moved: Moved | None, passage: Passage | None = None
) -> Opened:
    """Return the function from changes of a body's temperature (owned, k) to the gap (n, k); collective.

    Args:
        body: The body.
        pair: The contact.
        rows: Motion of the surface along the normal by each kelvin, at the contact nodes, or at those of the passage.
        moved: Motion of the surface in their place; None for the rows.
        passage: Of a strip that passes under the punch: its end is looked at.
    """
    if moved is None:
        at_nodes = rows if passage is None else np.asarray(passage.ends[-1] @ rows)
        return lambda fields: total(body.body.mesh.comm, at_nodes @ fields)
    onto = pair.transfer if body.body.name == "strip" else pair.punch.spread.T
    picked = slice(None) if passage is None else passage.nodes
    reading = onto if passage is None else passage.ends[-1]

    def by_displacement(fields: Array) -> Array:
        moves = moved(fields)[picked]
        at_contact = np.asarray(reading @ moves.reshape(len(moves), -1)).reshape(-1, *moves.shape[1:])
        return np.asarray(np.einsum("nd,ndk->nk", pair.normal, at_contact))

    return by_displacement


def prepare_steady(
    heat: Heat,
    bodies: tuple[HeatBody, ...],
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
    plans = [[StepPlan(0, k, abs(v), np.inf)] for k, v in enumerate(velocities)]
    sides = []
    for body, inflow, rows, body_velocities in zip(
        bodies, inflows(bodies, pair), expansions, ([0.0], velocities), strict=True
    ):
        around = _surroundings(body, pair, sliding, renewed=True)
        steps = [body.step(velocity, np.inf, around) for velocity in body_velocities]
        last = [row[-1].of(body) for row in plans]
        sides.append(_side(FullField(body, steps, inflow), steps, around, pair, rows, last, cooled=True))
    of_phases = np.tile(friction, (len(plans), 1))
    return HeatExchange(heat, (sides[0], sides[1]), plans, of_phases, pair.weights, thickness)


def _passing(
    heat: Heat,
    strip: PassingStrip,
    of_places: Sequence[tuple[csr_array, int]],
    stages: Sequence[StageKind],
    plans: Sequence[Sequence[StepPlan]],
    expansion: Array,
    opened: Opened,
    *,
    reduced: bool,
) -> tuple[Side, float | None]:
    """Return the side of a strip that passes under the punch, and its difference from the whole mesh; collective.

    Args:
        strip: With its modes.
        of_places: The mean transfer of each kind of step, and which stage it takes.
        stages: Of the strip, the shortest first.
        plans: The steps of each phase.
        expansion: Of the nodes of the passage (q, owned), mm/K.
        opened: Gap that changes of its temperature open.
        reduced: Whether it is on its modes.
    """
    body, around, passage = strip.body, strip.around, strip.passage
    transfers, kinds = [transfer for transfer, _ in of_places], [kind for _, kind in of_places]
    steps = [body.step(0.0, stage.duration, around) for stage in stages]
    inner: FullField | ReducedField
    difference = None
    if reduced:
        shortest = stages[0].duration
        inner, difference = strip.fitted(steps, shortest, transfers, plans, opened, heat.reduction_difference)
    else:
        inner = FullField(body, steps, strip.loads)
    field = ReciprocatingField(
        inner, strip.nodes, transfers, kinds, passage.middle.weights, heat.convection, heat.ambient
    )
    initial = total(body.body.mesh.comm, expansion @ np.full(body.owned, heat.initial))
    expanded = field.observe(expansion).less(initial).times(-1.0)
    readings = [
        Reading(field.reading(end), expanded.through(end), field.left_out(end, row[-1].strip))
        for end, row in zip(passage.ends, plans, strict=True)
    ]
    cooled = body.loses_heat(0.0, around)
    taken = [steps[kind] for kind in kinds]
    side = _on_balance(field, taken, around, field.contacts, readings, field.given_back, cooled=cooled)
    for step in steps if reduced else ():
        step.free()
    return side, difference


def _on_track(
    track: Track,
    body: HeatBody,
    steps: list[HeatStep],
    velocities: Sequence[float],
    wish: BasisRequest,
    trial: Trial,
    thickness: float,
) -> tuple[TrackField, float]:
    """Return the strip's reduced field with the bulk of its closed track, and its difference from the whole mesh.

    Collective.

    Raises:
        CaseError: nothing enters the mesh.
    """
    around = wish.surroundings
    if not around.renewed or not body.flow(around.sliding).is_open:
        message = "expected a strip whose material enters through a free end: none leaves the mesh to come back"
        raise CaseError(InputError("heat.track", message))
    # What enters at a kelvin, as large as a unit flux: what is small against the largest is dropped from the basis.
    comm, inflow = body.body.mesh.comm, trial.inflow
    fastest = max(wish.velocities, key=abs) or 1.0
    unit_step = body.step(fastest, wish.duration, around)
    entering = unit_step.entering / abs(fastest)
    unit_step.free()
    fluxes, flow = total(comm, np.array([np.abs(inflow).sum() / inflow.shape[1], entering.sum()]))
    away = body.bulk(track)[0] / thickness / (flow * abs(fastest))
    section = section_modes(body, around.sliding, float(np.sign(fastest)), away)
    steady = body.step(fastest, np.inf, around)
    heated = steady.respond(inflow @ (trial.entering[-1][:, :2]))  # even, and growing along the contact
    steady.free()
    rises = np.abs(total(comm, trial.contact @ heated)).max(axis=0)
    section = section.of_note(total(comm, section.leaving.T @ heated) / flow, rises, away)
    loads = np.column_stack([section.entering, entering])
    kelvins = total(comm, np.abs(loads).sum(axis=0)) / fluxes
    both = csc_array(hstack([inflow, csc_array(loads / kelvins)]))
    tried = [_with_inlets(flux, len(kelvins)) for flux in trial.entering]
    inner, difference = fitted_field(body, steps, velocities, replace(trial, inflow=both, entering=tried), wish)
    return TrackField(inner, steps, velocities, kelvins, wish.duration, track, section, thickness), difference


def _with_inlets(flux: Array, count: int) -> Array:
    """Return fluxes (n, m) with none that enters by the end of the mesh, and then as much by each mode, (., m + 1)."""
    extended: Array = np.zeros((len(flux) + count, flux.shape[1] + 1))
    extended[: len(flux), :-1] = flux
    extended[len(flux) :, -1] = flux[:, 0].sum()
    return extended


def _surroundings(body: HeatBody, pair: ContactPair, sliding: SlidingField, *, renewed: bool) -> Surroundings:
    """Return the surroundings of a body beyond its mesh: new material for the strip, ambient air beside the punch."""
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
    """Return the matrix from a body's temperature to the interface nodes, (n, owned) of this rank."""
    onto_nodes = pair.transfer if body.body.name == "strip" else pair.punch.spread.T
    return csr_array(onto_nodes @ body.trace.rows)


def inflows(bodies: tuple[HeatBody, ...], pair: ContactPair) -> tuple[csc_array, csc_array]:
    """Return the loads of unit fluxes at the interface nodes on each body (owned, n), mm."""
    weights = diags_array(pair.weights)
    punch, strip = (
        csc_array(body.trace.rows.T @ (onto @ weights))
        for body, onto in zip(bodies, (pair.punch.spread, pair.transfer.T), strict=True)
    )
    return punch, strip


def _side(
    field: FullField | ReducedField | TrackField,
    steps: Sequence[HeatStep],
    surroundings: Surroundings,
    pair: ContactPair,
    expansion: Array,
    last: Sequence[int],
    *,
    cooled: bool,
) -> Side:
    """Return the side of a body whose contact stays in its place, with the last step of each phase; collective."""
    body = field.basis.body
    comm, moves = body.body.mesh.comm, body.body.name == "strip"
    initial = total(comm, expansion @ np.full(body.owned, body.heat.initial))  # the bodies fit at this temperature
    contact = field.observe(contact_rows(body, pair))
    gap = field.observe(expansion).less(initial).times(-1.0 if moves else 1.0)  # few rows of a basis: no copy of all
    answers = field.contact_responses
    beyond = {} if answers is None else {k: answers[k] - contact.of_changes(field.responses[k]) for k in set(last)}
    readings = [Reading(contact, gap, beyond.get(kind)) for kind in last]
    side = _on_balance(field, steps, surroundings, [contact] * len(steps), readings, cooled=cooled)
    return field.balanced(side) if isinstance(field, TrackField) else side


def _on_balance(
    field: FullField | ReducedField | TrackField | ReciprocatingField,
    steps: Sequence[HeatStep],
    surroundings: Surroundings,
    contacts: Sequence[Functional],
    readings: Sequence[Reading],
    given_back: Array | None = None,
    *,
    cooled: bool,
) -> Side:
    """Return a side with the terms of its heat balance; collective."""
    body = field.basis.body
    convected = body.convected
    if surroundings.exposed is not None:
        convected = convected + body.heat.convection * surroundings.exposed
    balance_rows = [body.storage, convected]
    for step in steps:
        balance_rows += [step.held_by_end, step.held_by_start, step.carried]
    returned = 0.0
    if given_back is not None:
        balance_rows += list(given_back)
        returned = float(given_back[0].sum())
    rows, comm = np.array(balance_rows), body.body.mesh.comm
    sums = total(comm, np.array([body.storage.sum(), convected.sum() - returned]))
    capacity, ambient_loss = (float(value) for value in sums)
    return Side(
        field,
        contacts,
        readings,
        field.observe(rows),
        [step.held_source for step in steps],
        [step.brought for step in steps],
        body.heat.ambient * ambient_loss,
        capacity,
        body.extremes(surroundings),
        surroundings.renewed or given_back is not None or not _moves(body, surroundings),
        cooled,
        given_back is not None,
    )


def _moves(body: HeatBody, surroundings: Surroundings) -> bool:
    """Return whether material moves through the ends of a mesh; collective."""
    return body.body.name == "strip" and body.flow(surroundings.sliding).is_open
