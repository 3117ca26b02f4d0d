"""Cycles of contact with stick: time step by time step, with slip, friction's work and wear of every node.

Where a run with stick is, on another contact grid: tractions, slips and states stay at their nodes.

Displacements of the surfaces are those of the tractions there, as the next time step has them: nodes that stick
continue to stick.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from fenwear.common.arrays import Array
from fenwear.common.errors import ConvergenceError
from fenwear.laws import Evolution, LayerEvolution
from fenwear.laws.coating import CoatedBody
from fenwear.laws.friction import ContactConditions
from fenwear.laws.local_laws import LocalLaws, LocalWear, phases_wear
from fenwear.laws.sliding_tensors import CycleShear, SlidingWays
from fenwear.laws.wear import PhasesWear, WornDepths
from fenwear.steps.stick_heat import StickHeat, coupled_step
from fenwear.steps.stick_increment import advance
from fenwear.steps.stick_interface import StickInterface, untouched
from fenwear.steps.stick_position import LoadEffect, Position, surface_strain
from fenwear.steps.stick_program import Program, TimeStep
from fenwear.steps.stick_state import NO_HEAT, NO_SHIFT, Imposed, PartialSlipState, StickState, TimeStepRecords
from fenwear.surfaces import ContactPair
from fenwear.surfaces.placement import HERE, Placement, in_model
from fenwear.surfaces.sliding_field import Screw
from fenwear.system import on_nodes

T = TypeVar("T")
ALL = slice(None)  # time steps of a record
BARE = CoatedBody(np.zeros(1), np.ones(1))  # without a coating
MOST_FRICTIONS, SAME_FRICTION = 50, 1e-9  # of a time step whose friction depends on its pressure; their change


@dataclass(frozen=True, eq=False)
class PartialSlipProblem:
    """Two bodies, what is done to them, and their wear.

    Attributes:
        interface: The bodies.
        program: Of a cycle.
        wear: By local slip.
        friction: mu (n,).
        watch: Called before every time step: may raise InterruptedRunError.
        heat: Of friction; None without.
        expanded: Gaps by loads with a constant thermal expansion, at an offset of the strip.
        laws: Of friction and wear that change with the state of each node; None where `friction` and `wear` stay.
        coatings: Of both bodies.
        pressed: State in which the first cycle begins, unworn, under the loads of the case, once it is known.
    """

    interface: StickInterface
    program: Program
    wear: LocalWear
    friction: Array
    watch: Callable[[], object] = lambda: None
    heat: StickHeat | None = None
    expanded: Callable[[LoadEffect, float | Placement], LoadEffect] = lambda loaded, _: loaded
    laws: LocalLaws | None = None
    coatings: tuple[CoatedBody, CoatedBody] = (BARE, BARE)
    pressed: list[PartialSlipState] = field(default_factory=list)

    @property
    def weights(self) -> Array:
        """Areas of the contact nodes (n,)."""
        return self.interface.middle.pair.weights

    def led(self, function: Callable[[], T]) -> T:
        """Call the function that continues from condensed bodies, on rank 0 for all; collective.

        Raises:
            Exception: what `function` raised, on every rank.
        """
        return self.interface.team.lead(function)

    def kept_at(self, heat: StickHeat, temperature: Array) -> PartialSlipProblem:
        """Return the problem at a constant temperature (dim,)."""
        return replace(self, heat=None, expanded=partial(heat.expanded, temperature), pressed=[])

    def elastic(self) -> PartialSlipProblem:
        """Return the problem with surfaces of unlimited hardness."""
        interface = copy(self.interface)
        interface.layers = replace(interface.layers, hardness=np.inf)
        return replace(self, interface=interface, pressed=[])

    def driven(self, program: Program) -> PartialSlipProblem:
        """Return the problem with other time steps, without heat."""
        same = self.program.same_way(program)
        return replace(self, program=program, heat=None, pressed=self.pressed if same else [])

    @cached_property
    def reach(self) -> float:
        """Largest way of the strip's supports, or a fraction of the contact where a force is imposed, mm."""
        ways = [abs(step.displacement) for step in self.program.steps if step.displacement is not None]
        return max(ways, default=0.0) or 1e-3 * self.interface.middle.pair.punch.extent()

    def unworn(self) -> WornDepths:
        """Return the worn depths at the start, none, and the initial layers."""
        depths = self.interface.layers.unworn(len(self.interface.middle.pair.strip.weights))
        return replace(depths, crept=self.interface.creep.beginning())

    def shaped(self, at: PartialSlipState, worn: WornDepths) -> PartialSlipState:
        """Return a state on another shape, whose bodies have crept as it says; sticking nodes stay in place."""
        creep, contact = self.interface.creep, at.contact
        if creep.creeps and contact.crept is not worn.crept:
            contact = creep.at(contact, worn.crept)
        return replace(at, worn=worn, held=None, contact=contact)

    def forgotten(self, at: PartialSlipState) -> PartialSlipState:
        """Return a state at the start of a cycle whose time steps have not been computed yet."""
        steps, (n, m) = len(self.program.steps), at.contact.trial.shape
        none = np.full((steps, n, m), np.nan)
        return replace(at, next_step=0, pressures=np.full((steps, n), np.nan), trials=none, slips=none)

    def beginning(self, shape: WornDepths | None = None, load: float = 1.0) -> PartialSlipState:
        """Return the state in which the first cycle begins: pressed, and moved to its start; collective.

        Args:
            shape: Depths worn before; by default none.
            load: Factor of all loads.

        Raises:
            ConvergenceError: a step did not converge.
        """
        return self.led(partial(self._begun, shape, load))

    def _begun(self, shape: WornDepths | None, load: float) -> PartialSlipState:
        unworn = self.unworn()
        as_made = load == 1.0 and (shape is None or shape.same(unworn))
        if not as_made:
            at = self._pressed_to(shape or unworn, load)
        else:
            if not self.pressed:
                self.pressed.append(self._pressed_to(unworn, load))
            at = self.pressed[0]
        at = self.forgotten(at)
        if self.heat is None:
            return at
        return replace(at, temperature=self.heat.initial(), heating=np.zeros_like(at.contact.pressure))

    def _pressed_to(self, worn: WornDepths, load: float) -> PartialSlipState:
        """Return the state in which the first cycle begins, at a shape and a factor of all loads."""
        interface, program = self.interface, self.program
        given = interface.loaded(None if program.steps[-1].fraction is None else 0.0).times(load)
        loaded = self.expanded(given, 0.0)
        opening = self.opening(interface.middle, worn)
        state, before = untouched(interface), Imposed(loaded.times(0), opening)
        for k in range(1, program.pressing + 1):
            imposed = replace(
                before,
                loaded=loaded.times(k / program.pressing),
                opening=self.opening(interface.middle, worn),
                closure=interface.layers.closure_at(interface.middle.pair, worn),
            )
            if interface.creep.creeps:  # creep comes with the loads
                state = interface.creep.at(state, k / program.pressing * worn.crept)
            state, before = advance(interface, state, before, imposed, self.friction), imposed
            worn = interface.layers.flown(worn, state.flowed)
        if program.steps[0].force is not None:
            before = replace(before, displacement=None, force=state.force)
        none, still = np.zeros((0, 0)), np.zeros(len(self.weights))
        at = PartialSlipState(state, replace(before, closure=None), worn, none, none, none, still, still, load=load)
        for step in program.lead_in:
            at = self._stepped(self.forgotten(at), step)
        return at

    def opening(self, position: Position, worn: WornDepths) -> Array:
        """Return the gap of the unloaded, worn bodies (n,), mm."""
        moved = self.interface.moved
        rest = worn if moved is None else worn - moved
        between = self.interface.layers.opening(position.pair, worn)
        return position.pair.initial_gap + position.pair.opening(rest.punch, rest.strip) + between

    def imposed(self, step: TimeStep, at: PartialSlipState) -> tuple[Position, Imposed]:
        """Return the place of the strip in the time step after a state, and loads and motion at its end; collective."""
        interface, worn, load = self.interface, at.worn, at.load
        position = interface.position(step.offset)
        given = interface.loaded(step.fraction if step.fraction is not None else 0.0).times(load)
        opening, loaded = self.opening(position, worn), self.expanded(given, step.offset)
        duration = 0.0 if step.fraction is None else step.duration  # before the cycle begins nothing creeps
        beside = self._beside(position, step, at.imposed)
        closure = interface.layers.closure_at(position.pair, worn)
        return position, Imposed(loaded, opening, step.displacement, step.force, step.strain, duration, beside, closure)

    def _beside(self, position: Position, step: TimeStep, before: Imposed) -> Array:
        """Return the motion of the strip's supports beside the displacement at the end of a step (n, d), mm.

        Near its place every point of the strip keeps the one opposite: it is moved by the screw that leads from there
        to its place, and a cycle brings it back. Going far, others come: it is moved on by what slides past them.
        """
        if step.way is None:
            return NO_SHIFT
        x, field, now = position.pair.punch.x, self.interface.field, step.displacement or 0.0
        if not position.far:
            moved = Screw(HERE, step.way.last).field.velocity(x) - now * field.velocity(x)
            return np.asarray(in_model(moved, self.interface.dim))
        on = step.way.field.velocity(x) - (now - (before.displacement or 0.0)) * field.velocity(x)
        return np.asarray(before.beside + in_model(on, self.interface.dim))

    def step(self, at: PartialSlipState, step: TimeStep) -> tuple[PartialSlipState, TimeStepRecords]:
        """Return the state after a time step, and its record; the shape stays; collective."""
        return self.led(partial(self._step, at, step))

    def _step(self, at: PartialSlipState, step: TimeStep) -> tuple[PartialSlipState, TimeStepRecords]:
        after = self._stepped(at, step)
        made = self._record(at, after, step)
        evolution = self.evolution(made, at)
        if evolution is None:
            return after, made
        return replace(after, held=evolution.after(at.held or self.interface.layers.held(at.worn))), made

    def _stepped(self, at: PartialSlipState, step: TimeStep) -> PartialSlipState:
        if self.laws is None or not self.laws.changes():
            return self._advanced(at, step, self.friction)
        laws, layers, position = self.laws, self.interface.layers, self.interface.position(step.offset)
        pressure = at.contact.pressure if at.near is None else at.near[0]
        for _ in range(MOST_FRICTIONS):
            conditions = laws.conditions(
                position.pair,
                pressure,
                **self.at_start(at),
                states=layers.known(position.pair, at.worn, at.held),
                debris=layers.facing(position.pair, at.worn),
                touching=at.contact.pressure > 0,  # in the step before: nodes that open and close in turn end nowhere
            )
            after = self._advanced(at, step, laws.friction.values(conditions))
            change, pressure = np.abs(after.contact.pressure - pressure).max(), after.contact.pressure
            if change <= SAME_FRICTION * max(float(pressure.max()), 1e-300):
                return after
        raise ConvergenceError(
            "friction and the pressure that it depends on did not converge in a time step. Use a weaker dependence "
            "on p, or a smoother table"
        )

    def _advanced(self, at: PartialSlipState, step: TimeStep, friction: Array) -> PartialSlipState:
        """Return the state after a time step with friction mu (n,)."""
        self.watch()
        position, imposed = self.imposed(step, at)
        if self.heat is None or not len(at.temperature):  # before the first cycle nothing heats
            state = advance(self.interface, at.contact, at.imposed, imposed, friction, position, at.near)
            return self._after(at, state, imposed, step)

        def solved(loaded: LoadEffect, near: tuple[Array, Array] | None) -> StickState:
            end = replace(imposed, loaded=loaded)
            return advance(self.interface, at.contact, at.imposed, end, friction, position, near)

        flux = float((friction * at.contact.pressure).max()) * self.reach / step.duration
        state, loaded, warm = coupled_step(self.heat, solved, imposed.loaded, at, step, flux)
        return replace(self._after(at, state, replace(imposed, loaded=loaded), step), **warm)

    def _after(self, at: PartialSlipState, state: StickState, imposed: Imposed, step: TimeStep) -> PartialSlipState:
        worn = self.interface.layers.flown(at.worn, state.flowed)
        return at.then(state, replace(imposed, closure=None), worn, step.duration)  # it follows from the depths

    def _record(self, at: PartialSlipState, after: PartialSlipState, step: TimeStep) -> TimeStepRecords:
        """Return the record of a time step between two states."""
        state, position = after.contact, self.interface.position(step.offset)
        weights, (work, stored) = position.pair.weights, self._work(position, at, after)
        values = (
            state.displacement,
            state.force,
            state.pressure,
            state.traction,
            state.slip,
            state.gap,
            work,
            stored,
            state.heat,
            weights @ (state.pressure * state.approach),
            surface_strain(position, self.interface.gradient, state.on_strip),
            float(state.iterations),
            state.unique,
            step.duration,
            *self._heat_of(at, after),
            float(after.coupling),
            state.rigid,
            state.flowed,
        )
        return TimeStepRecords(*(np.asarray(value)[None] for value in values))

    def _work(self, position: Position, at: PartialSlipState, after: PartialSlipState) -> tuple[float, float]:
        """Return the work of rig and loads in a time step in a place of the strip, and the energy that bodies store."""
        interface, before, state = self.interface, at.contact, after.contact
        f = np.concatenate([state.pressure, state.traction.T.ravel()])
        force, back = position.forces(f)
        on_punch, on_strip = state.on_punch - before.on_punch, state.on_strip - before.on_strip
        layers, closure = interface.layers, interface.layers.closure_at(position.pair, at.worn)
        closed = layers.given(state.pressure, closure) - layers.given(before.pressure, closure)
        if interface.creep.creeps:
            crept = zip(*map(interface.creep.displaced, (state.crept, before.crept)), strict=True)
            on_punch, on_strip, closed = (
                elastic + now - had for elastic, (now, had) in zip((on_punch, on_strip, closed), crept, strict=True)
            )
        stored = float(np.vdot(force, on_punch) - np.vdot(back, on_strip))
        lowered = float(after.imposed.loaded.resultant @ (state.rigid - before.rigid))
        work = state.force * (state.displacement - before.displacement) + lowered
        carried = position.beside(state.beside) - position.beside(before.beside)
        work += float((f * position.weights) @ carried)
        return work, stored + float(position.pair.weights @ (state.pressure * closed))

    def _heat_of(self, at: PartialSlipState, after: PartialSlipState) -> tuple[Array, Array, Array]:
        """Return the terms of the heat, the contact temperatures, and the conductances; empty without heat."""
        heat = self.heat
        if heat is None:
            return NO_HEAT, np.zeros((2, 0)), NO_HEAT
        warm, terms = heat.step(at.next_step, at.temperature, after.heating, after.conductance)
        return terms, np.array(heat.exchange.contact_temperatures(warm, at.next_step)), after.conductance

    @property
    def asks_cycle(self) -> bool:
        """Whether a law depends on the cross-shear or the mean pressure of a whole cycle."""
        laws = self.laws
        return laws is not None and (laws.asks("cs") or laws.asks("pm"))

    def at_start(self, at: PartialSlipState) -> dict[str, Any]:
        """Return the conditions of the nodes at the start of a time step, by the names of `LocalLaws.conditions`."""
        warm, heat = None, self.heat
        if heat is not None and len(at.temperature):
            punch, strip = heat.surfaces(at.temperature)
            warm = punch, strip
        return {
            "temperatures": warm,
            "worn": at.worn,
            "slid": at.slid,
            "speed": at.speed,
            "cycle": self._shear(at),
        }

    def _shear(self, at: PartialSlipState) -> CycleShear | None:
        """Return the shear of the last cycle before a state, as laws use it; None where no law asks.

        A time step that has not been computed slips nothing at the mean pressure.
        """
        if not self.asks_cycle:
            return None
        interface, middle = self.interface, self.interface.middle
        positions, mean = (
            [interface.position(step.offset) for step in self.program.steps],
            middle.rigid.mean_pressure,
        )
        slips: Array = np.nan_to_num(at.slips)
        ways = np.array([position.slid(slips[k]) for k, position in enumerate(positions)])
        lengths = np.linalg.norm(ways, axis=2)
        directions = ways / np.where(lengths > 0, lengths, 1.0)[:, :, None]
        pairs, wears = [position.pair for position in positions], self.wear.strip.wears
        known = SlidingWays(pairs, middle.pair, lengths, directions, wears, mean, asked=True)
        return known.shear(np.where(np.isnan(at.pressures), mean, at.pressures))

    def of_steps(self, records: TimeStepRecords, before: PartialSlipState) -> list[ContactConditions]:
        """Return the conditions of laws in steps that begin at a state: temperatures are those at the start of each."""
        laws, known = self.laws, self.at_start(before)
        assert laws is not None
        lengths = records.slip_magnitude
        slid = before.slid + np.cumsum(lengths, axis=0)
        warm = [known["temperatures"]] * len(slid)
        if known["temperatures"] is not None:
            warm[1:] = [(punch, strip) for punch, strip in records.temperature[:-1]]
        return [
            laws.conditions(
                pair,
                records.pressure[k],
                speed=lengths[k] / records.duration[k],
                temperatures=warm[k],
                worn=before.worn,
                slid=slid[k],
                debris=self.interface.layers.facing(pair, before.worn),
                cycle=known["cycle"],
            )
            for k, pair in enumerate(self.pairs(records, before))
        ]

    def pairs(self, records: TimeStepRecords, before: PartialSlipState) -> list[ContactPair]:
        """Return the surfaces opposite each other in steps that begin at a state."""
        steps = self.program.following(before.next_step, len(records))
        return [self.interface.position(step.offset).pair for step in steps]

    def worn(self, records: TimeStepRecords, begin: PartialSlipState, which: slice = ALL) -> WornDepths:
        """Return the depths after time steps, with the changes of the layers' states; arguments as of `passing`."""
        passing, flowed = self.passing(records, begin, which), records.flowed[which].sum(axis=0)
        return passing.worn(records.pressure[which], begin.worn, flowed=flowed)

    def passing(self, records: TimeStepRecords, begin: PartialSlipState, which: slice = ALL) -> LayerEvolution:
        """Return the wear of time steps by their pressures, with the changes of layers and laws.

        Args:
            records: Of time steps one after the other.
            begin: State in which the first of them begins.
            which: Time steps of the record; by default all.
        """
        laws = self.laws
        evolution, conditions = self.evolution(records, begin), list[ContactConditions]()
        if evolution is not None:
            conditions = evolution.through(begin.held or self.interface.layers.held(begin.worn))[0]
        elif laws is not None:
            conditions = self.of_steps(records, begin)
        chosen = range(len(records))[which]
        conditions, pairs = conditions[which], self.pairs(records, begin)[which]
        slid, durations = records.slip_magnitude[which], records.duration[which]
        wears = [self.wear] * len(chosen) if laws is None else [laws.wear_at(condition) for condition in conditions]
        wear = self._wear(wears, slid, durations, pairs)
        evolution = None if evolution is None else evolution.some(chosen)
        return LayerEvolution.over(self.interface.layers, wear, slid, evolution, conditions)

    def _wear(
        self, wears: Sequence[LocalWear], slid: Array, durations: Array, pairs: Sequence[ContactPair]
    ) -> PhasesWear:
        """Return the wear of time steps by their laws, slips (k, n) and durations (k,)."""
        punch, strip = (law.slide(slid, durations[:, None]) for law in (wears[0].punch, wears[0].strip))
        coatings = self.coatings[0].thickness, self.coatings[1].thickness
        return phases_wear(wears, (punch, strip), pairs, coatings)

    def evolution(self, records: TimeStepRecords, begin: PartialSlipState) -> Evolution | None:
        """Return the evolution of laws' states in the steps of a record that begin at a state; None without any."""
        memory, laws = self.interface.layers.memory, self.laws
        if not memory.names or laws is None:
            return None
        pairs = self.pairs(records, begin)

        def wearing(k: int, at: ContactConditions) -> PhasesWear:
            row, wears = slice(k, k + 1), [laws.wear_at(at)]
            wear = self._wear(wears, records.slip_magnitude[row], records.duration[row], pairs[row])
            return wear.begun(begin.worn, 0.0)

        conditions = self.of_steps(records, begin)
        return Evolution(memory, conditions, records.duration, pairs, wearing, begin.worn.strip)

    def half_cycle(self, at: PartialSlipState) -> tuple[PartialSlipState, TimeStepRecords]:
        """Return the state at the end of the next half-cycle, and its records; the shape stays; collective."""
        return self.led(partial(self._half_cycle, at))

    def _half_cycle(self, at: PartialSlipState) -> tuple[PartialSlipState, TimeStepRecords]:
        steps, parts, begin = self.program.steps, [], at
        number = steps[at.next_step].half_cycle
        while steps[at.next_step].half_cycle == number:
            at, record = self.step(at, steps[at.next_step])
            parts.append(record)
            if at.next_step == 0:
                break
        records = TimeStepRecords.joined(parts)
        if self.heat is not None:
            self.heat.check_bounds(begin.temperature, at.temperature, records.heat)
        return at, records

    def cycle(self, at: PartialSlipState) -> tuple[PartialSlipState, list[TimeStepRecords]]:
        """Return the state a cycle later and the records of its half-cycles; the shape stays; collective."""
        return self.led(partial(self._cycle, at))

    def _cycle(self, at: PartialSlipState) -> tuple[PartialSlipState, list[TimeStepRecords]]:
        recorded = []
        for _ in range(self.program.half_cycles):
            at, records = self.half_cycle(at)
            recorded.append(records)
        return at, recorded


def on_other_grid(
    at: PartialSlipState,
    before: PartialSlipProblem,
    after: PartialSlipProblem,
    nodes: NDArray[np.int64],
    worn: WornDepths,
) -> PartialSlipState:
    """Return the state of a run on another grid; for rank 0 that leads.

    Args:
        at: Where it is, between half-cycles.
        before, after: The bodies on both grids, and what is done to them.
        nodes: The old node of each new one (n_new,), -1 for none.
        worn: Depths there.
    """
    interface, contact, step = after.interface, at.contact, after.program.steps[at.next_step - 1]
    position = interface.position(step.offset)
    loaded = after.expanded(interface.loaded(step.fraction).times(at.load), step.offset)
    opening, pressure = after.opening(position, worn), _at(contact.pressure, nodes)
    traction = _along(contact.traction, nodes)
    f = np.concatenate([pressure, traction.T.ravel()])
    force, back = position.forces(f)
    moved = interface.punch.apply(force), -interface.strip.apply(back)
    old = before.interface.position(before.program.steps[at.next_step - 1].offset).pair.punch.x
    beside = _affine(old, np.broadcast_to(contact.beside, old.shape), position.pair.punch.x)
    state = replace(
        contact,
        pressure=pressure,
        traction=traction,
        gap=on_nodes(contact.gap, nodes, opening),
        slip=_along(contact.slip, nodes),
        approach=_at(contact.approach, nodes),
        on_punch=loaded.on_punch + moved[0],
        on_strip=loaded.on_strip + at.imposed.strain * interface.bulk + moved[1],
        trial=_along(contact.trial, nodes),
        crept=worn.crept,
        elastic=interface.creep.of_contact(position, f, moved, loaded),
        beside=beside,
        flowed=_at(contact.flowed, nodes),
    )
    return replace(
        at,
        contact=state,
        imposed=replace(at.imposed, loaded=loaded, opening=opening, beside=beside),
        worn=worn,
        pressures=_known(at.pressures, _at(at.pressures, nodes)),
        trials=_known(at.trials, _along(at.trials, nodes)),
        slips=_known(at.slips, _along(at.slips, nodes)),
        slid=_at(at.slid, nodes),
        speed=_at(at.speed, nodes),
        held=None,
    )


def _at(values: Array, nodes: NDArray[np.int64]) -> Array:
    """Return values (..., n) at other nodes, where none was zero."""
    return on_nodes(values, nodes, np.zeros(len(nodes)))


def _along(values: Array, nodes: NDArray[np.int64]) -> Array:
    """Return vectors (..., n, m) at other nodes, where none was zero."""
    return np.swapaxes(_at(np.swapaxes(values, -1, -2), nodes), -1, -2)


def _known(before: Array, values: Array) -> Array:
    """Return values of time steps, NaN of those that are not known."""
    missing = np.isnan(before).reshape(len(before), -1).any(axis=1)
    return np.where(missing.reshape(-1, *(1,) * (values.ndim - 1)), np.nan, values)


def _affine(x: Array, values: Array, there: Array) -> Array:
    """Return vectors (n, d) that a rigid motion gives points (n, d) at other points."""

    def terms(points: Array) -> Array:
        return np.column_stack([np.ones(len(points)), points])

    motion, *_ = np.linalg.lstsq(terms(x), values, rcond=None)
    return np.asarray(terms(there) @ motion)
