"""Cycles of contact with stick: time step by time step, with slip, friction's work and wear of every node."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, fields, replace
from functools import cached_property, partial
from typing import Any, NamedTuple, TypeVar

import numpy as np

from fenwear.arrays import Array, Mask
from fenwear.errors import ConvergenceError
from fenwear.interface import ContactPair
from fenwear.interface.placement import HERE, Placement, in_model
from fenwear.layers import Evolution
from fenwear.layers.between import DEBRIS, PLASTIC
from fenwear.layers.debris import DebrisCycle
from fenwear.layers.memory import Held
from fenwear.sliding.coating import CoatedBody, Shares, covering, left_of, shares
from fenwear.sliding.cross_shear import CycleShear
from fenwear.sliding.friction import ContactConditions
from fenwear.sliding.screw import Screw
from fenwear.sliding.ways import SlidingWays
from fenwear.sliding.wear import WornDepths
from fenwear.stick.heat import StickHeat
from fenwear.stick.heated import StepStart, coupled_step
from fenwear.stick.increment import advance
from fenwear.stick.interface import OppositeBodies, untouched
from fenwear.stick.position import LoadEffect, Position
from fenwear.stick.program import Program, TimeStep
from fenwear.stick.state import Imposed, StickState
from fenwear.stick.strain import surface_gradient, surface_strain
from fenwear.stick.wear import LocalLaws, LocalWear

T = TypeVar("T")
_Both = tuple[Array, Array]  # of punch and strip
_Parts = tuple[Shares | None, Shares | None]
_PerLayer = tuple[tuple[Array, Array], tuple[Array, Array]]  # of punch and strip, of coating and base each
MOST_FRICTIONS, SAME_FRICTION = 50, 1e-9  # of a time step whose friction depends on its pressure; their change


@dataclass(frozen=True)
class TimeStepRecords:
    """k time steps of n contact nodes, m = d - 1 tangential directions; forces and work per thickness in the plane.

    Attributes:
        displacement: delta of the strip's supports at the end (k,), mm or rad.
        force: Q on the strip (k,), N/mm or N.
        pressure: (k, n), MPa.
        traction: On the punch along the tangents (k, n, m), MPa.
        slip: Of the punch against the strip in the step (k, n, m), mm.
        gap: (k, n), mm.
        work: What rig and loads do in the step (k,), N or N mm.
        stored: What both bodies take up, or lose in creep (k,).
        dissipated: Friction's work of each node over its area (k, n), N/mm.
        closing: Work of the pressure on gaps that close or open in the step (k,): of the step's size, it vanishes
            with it.
        punch_depth, strip_depth: Worn off each body in the step, at the contact nodes (k, n), mm; of a coated one as if
            all of it were of the coating.
        punch_base, strip_base: The same as if all coatings were worn through.
        strain: Of the strip's surface opposite each node, along and across the sliding (k, n, m).
        iterations: Newton steps (k,).
        unique: Whether the answer was the only one near (k,).
        duration: s (k,).
        heat: Terms of the balance of heat (k, 6), mJ, as `heat.exchange.TERMS`; (k, 0) without heat, as the next two.
        temperature: Of both contact surfaces, punch and strip, at the end (k, 2, n), K.
        conductance: Of each node (k, n), N/(mm s K); NaN where none conducts.
        coupling: Iterations of contact and heat (k,); 0 without heat.
        rigid: Amplitudes of the rigid modes at the end (k, r).
        flowed: Depth that the surfaces have flown beyond the hardness (k, n), mm.
    """

    displacement: Array
    force: Array
    pressure: Array
    traction: Array
    slip: Array
    gap: Array
    work: Array
    stored: Array
    dissipated: Array
    closing: Array
    punch_depth: Array
    strip_depth: Array
    punch_base: Array
    strip_base: Array
    strain: Array
    iterations: Array
    unique: Mask
    duration: Array
    heat: Array
    temperature: Array
    conductance: Array
    coupling: Array
    rigid: Array
    flowed: Array

    def __len__(self) -> int:
        return len(self.force)

    @property
    def slip_magnitude(self) -> Array:
        """abs(slip) (k, n), mm."""
        return np.linalg.norm(self.slip, axis=2)

    @property
    def sticking(self) -> Mask:
        """Which nodes carry pressure and have not slipped (k, n)."""
        return (self.pressure > 0) & (self.slip_magnitude == 0)

    @property
    def stuck(self) -> Mask:
        """Which nodes stick in all steps (n,)."""
        return np.asarray(self.sticking.all(axis=0))

    @property
    def touched(self) -> Mask:
        """Which nodes carry pressure in any step (n,)."""
        return np.asarray((self.pressure > 0).any(axis=0))

    def energy(self, weights: Array) -> float:
        """Return what friction has dissipated, N in the plane and N mm in a solid."""
        return float(self.dissipated.sum(axis=0) @ weights)

    def balance_error(self, weights: Array) -> float:
        """Return what is missing in the balance of energy of all steps together, over its largest term."""
        terms = np.array([self.work.sum(), self.stored.sum(), self.energy(weights), self.closing.sum()])
        largest = max(np.abs(self.work).sum(), np.abs(terms).max(), 1e-300)
        return float(abs(terms[0] - terms[1] - terms[2] + terms[3]) / largest)

    @staticmethod
    def joined(parts: Sequence[TimeStepRecords]) -> TimeStepRecords:
        """Return records one after the other."""
        return TimeStepRecords(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(TimeStepRecords)))


@dataclass(frozen=True)
class PartialSlipState:
    """Where a run is.

    Attributes:
        contact: With what it remembers.
        imposed: On it, expansion by heat among it.
        worn: Depths.
        next_step: Its number in the cycle.
        temperature: Of both bodies, on the bases of the rig's heat (dim,); None without heat.
        heating: Heat of friction of the nodes in the last step (n,), mW/mm²; None without heat.
        conductance: Of the nodes in the last step (n,), N/(mm s K), NaN where none conducts; None without heat.
        pressures, trials: Of each time step of the cycle when it was computed last (k, n) and (k, n, m), NaN where it
            was not: zones come back from cycle to cycle, so that Newton starts there. None before the first cycle.
        load: Factor of all loads in the steps to come.
        slid: What each node has slipped from the start (n,), mm, where a law depends on it; else None.
        speed: Of the slip of each node in the last step (n,), mm/s, where a law depends on it; else None.
        coupling: Iterations of contact and heat in the last step.
        held: What laws remember after the last step, where that is not what `worn` has; the shape stays until the end
            of a half-cycle.
        slips: Of the nodes in each time step of the cycle (k, n, m), mm, as `trials`; None where no law depends on
            what a whole cycle does.
    """

    contact: StickState
    imposed: Imposed
    worn: WornDepths
    next_step: int = 0
    temperature: Array | None = None
    heating: Array | None = None
    conductance: Array | None = None
    pressures: Array | None = None
    trials: Array | None = None
    load: float = 1.0
    coupling: int = 0
    slid: Array | None = None
    speed: Array | None = None
    held: Held | None = None
    slips: Array | None = None

    @property
    def near(self) -> tuple[Array, Array] | None:
        """Pressure and trial of the next time step a cycle ago; None where there was none."""
        if self.pressures is None or self.trials is None or np.isnan(self.pressures[self.next_step, 0]):
            return None
        return self.pressures[self.next_step], self.trials[self.next_step]

    def then(self, state: StickState) -> tuple[Array | None, Array | None]:
        """Return pressures and trials of the time steps with those of the next one."""
        if self.pressures is None or self.trials is None:
            return None, None
        pressures, trials = self.pressures.copy(), self.trials.copy()
        pressures[self.next_step], trials[self.next_step] = state.pressure, state.trial
        return pressures, trials


class _Slips(NamedTuple):
    """What laws ask of k time steps: pressure and slip (k, n), durations (k,), temperatures at their ends (k, 2, n)."""

    pressure: Array
    slid: Array
    duration: Array
    temperature: Array | None


class PartialSlipProblem:
    """Two bodies, what is done to them, and their wear.

    Args:
        interface: The bodies.
        program: Of a cycle.
        wear: By local slip.
        friction: mu (n,).
        heat: Of friction; None without.
        watch: Called before every time step: may raise InterruptedRunError.
        expanded: What loads do with a thermal expansion that stays as it is, at an offset of the strip.
        laws: Of friction and wear that change with the state of each node; None where `friction` and `wear` stay.
        coatings: Of both bodies, whose `wear` is then that of the coating, by the ratio of coefficients where nothing
            tells another one; None for a body without.
    """

    def __init__(
        self,
        interface: OppositeBodies,
        program: Program,
        wear: LocalWear,
        friction: Array,
        watch: Callable[[], object] = lambda: None,
        heat: StickHeat | None = None,
        expanded: Callable[[LoadEffect, float | Placement], LoadEffect] = lambda loaded, _: loaded,
        laws: LocalLaws | None = None,
        coatings: tuple[CoatedBody | None, CoatedBody | None] = (None, None),
    ) -> None:
        self.expanded, self.laws, self.coatings = expanded, laws, coatings
        self.interface, self.program, self.wear, self.friction = interface, program, wear, friction
        self.weights, self.watch, self.heat = interface.middle.pair.weights, watch, heat
        self._gradient = surface_gradient(interface.middle.pair.punch)

    def watching(self, watch: Callable[[], object]) -> PartialSlipProblem:
        """Return the same with what is called before every time step."""
        return self._with(watch=watch)

    def _with(self, **changed: Any) -> PartialSlipProblem:
        """Return the same with other arguments."""
        names = ("interface", "program", "wear", "friction", "watch", "heat", "expanded", "laws", "coatings")
        return PartialSlipProblem(**{**{name: getattr(self, name) for name in names}, **changed})

    def led(self, function: Callable[[], T]) -> T:
        """Call what goes on from condensed bodies, on rank 0 for all; collective.

        Raises:
            Exception: what `function` raised, on every rank.
        """
        return self.interface.team.lead(function)

    def kept_at(self, heat: StickHeat, temperature: Array) -> PartialSlipProblem:
        """Return the same at a temperature (dim,) that stays as it is."""

        def expanded(loaded: LoadEffect, offset: float | Placement) -> LoadEffect:
            return heat.expanded(loaded, temperature, offset)

        return self._with(heat=None, expanded=expanded)

    def elastic(self) -> PartialSlipProblem:
        """Return the same whose surfaces are as hard as they like."""
        interface = copy(self.interface)
        interface.layers = replace(interface.layers, hardness=np.inf)
        return self._with(interface=interface)

    def with_heat(self, heat: StickHeat | None) -> PartialSlipProblem:
        """Return the same with the heat of friction."""
        return self._with(heat=heat)

    def driven(self, program: Program) -> PartialSlipProblem:
        """Return the same in other time steps, without heat."""
        return self._with(program=program, heat=None)

    @cached_property
    def reach(self) -> float:
        """Largest way of the strip's supports, or a fraction of the contact where a force is imposed, mm."""
        ways = [abs(step.displacement) for step in self.program.steps if step.displacement is not None]
        return max(ways, default=0.0) or 1e-3 * float(self.weights.sum())

    def unworn(self) -> WornDepths:
        """Return the worn depths at the start, none, and what lies between then."""
        found = self.interface.layers.unworn(len(self.interface.middle.pair.strip.weights))
        return found if self.interface.creep is None else replace(found, crept=self.interface.creep.beginning())

    def shaped(self, at: PartialSlipState, worn: WornDepths) -> PartialSlipState:
        """Return a state on another shape, whose bodies have crept as it says; what sticks stays where it stuck."""
        creep, contact = self.interface.creep, at.contact
        if creep is not None and contact.crept is not worn.crept:
            contact = creep.at(contact, worn.crept)
        return replace(at, worn=worn, held=None, contact=contact)

    @property
    def asks_cycle(self) -> bool:
        """Whether a law depends on what a whole cycle does: its cross-shear, its mean pressure."""
        return self.laws is not None and (self.laws.asks("cs") or self.laws.asks("pm"))

    def forgotten(self, at: PartialSlipState) -> PartialSlipState:
        """Return a state at the start of a cycle whose time steps have not been computed yet."""
        steps, (n, m) = len(self.program.steps), at.contact.trial.shape
        none = np.full((steps, n, m), np.nan)
        slips = none if self.asks_cycle else None
        return replace(at, next_step=0, pressures=np.full((steps, n), np.nan), trials=none, slips=slips)

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
        interface, program, worn = self.interface, self.program, shape or self.unworn()
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
            if interface.creep is not None and len(worn.crept):  # creep comes with the loads
                state = interface.creep.at(state, k / program.pressing * worn.crept)
            state, before = advance(interface, state, before, imposed, self.friction), imposed
            worn = interface.layers.flown(worn, state.flowed)
        if program.steps[0].force is not None:
            before = replace(before, displacement=None, force=state.force)
        at = PartialSlipState(state, replace(before, closure=None), worn, load=load)
        for step in program.lead_in:
            at = self._stepped(at, step)
        at = self.forgotten(at)
        if self.heat is None:
            return at
        return replace(at, temperature=self.heat.initial(), heating=np.zeros_like(state.pressure))

    def opening(self, position: Position, worn: WornDepths) -> Array:
        """Return the gap of the unloaded, worn bodies (n,), mm."""
        moved = self.interface.moved
        rest = worn if moved is None else worn - moved
        between = self.interface.layers.opening(worn.between)
        return position.pair.initial_gap + position.pair.opening(rest.punch, rest.strip) + between

    def imposed(self, step: TimeStep, at: PartialSlipState) -> tuple[Position, Imposed]:
        """Return the place of the strip in the time step after a state, and what is imposed at its end; collective."""
        interface, worn, load = self.interface, at.worn, at.load
        position = interface.position(step.offset)
        given = interface.loaded(step.fraction if step.fraction is not None else 0.0).times(load)
        opening, loaded = self.opening(position, worn), self.expanded(given, step.offset)
        duration = 0.0 if step.fraction is None else step.duration  # before the cycle begins nothing creeps
        beside = self._beside(position, step, at.imposed)
        closure = interface.layers.closure_at(position.pair, worn)
        return position, Imposed(loaded, opening, step.displacement, step.force, step.strain, duration, beside, closure)

    def _beside(self, position: Position, step: TimeStep, before: Imposed) -> Array | None:
        """Return what the strip's supports are moved by beside the displacement at the end of a step (n, d), mm.

        Near its place every point of the strip keeps the one opposite: it is moved by the screw that leads from there
        to its place, and a cycle brings it back. Going far, others come: it is moved on by what slides past them.
        """
        if step.way is None:
            return None
        x, field, now = position.pair.punch.x, self.interface.field, step.displacement or 0.0
        if not position.far:
            moved = Screw(HERE, step.way.last).field.velocity(x) - now * field.velocity(x)
            return np.asarray(in_model(moved, x.shape[1]))
        on = step.way.field.velocity(x) - (now - (before.displacement or 0.0)) * field.velocity(x)
        return np.asarray((0.0 if before.beside is None else before.beside) + in_model(on, x.shape[1]))

    def step(self, at: PartialSlipState, step: TimeStep) -> tuple[PartialSlipState, TimeStepRecords]:
        """Return the state after a time step, and its record; the shape stays; collective."""
        return self.led(partial(self._step, at, step))

    def _step(self, at: PartialSlipState, step: TimeStep) -> tuple[PartialSlipState, TimeStepRecords]:
        after = self._stepped(at, step)
        wear, held = self._passed(at, after, step)
        return replace(after, held=held), self._record(at, after, step, wear)

    def _passed(self, at: PartialSlipState, after: PartialSlipState, step: TimeStep) -> tuple[LocalWear, Held | None]:
        """Return by what law a time step wears, and what laws remember at its end."""
        laws, layers, slipped = self.laws, self.interface.layers, np.linalg.norm(after.contact.slip, axis=1)
        if laws is None:
            return self.wear, None
        steps = _Slips(after.contact.pressure[None], slipped[None], np.array([step.duration]), None)
        evolution = self._evolution(steps, at)
        if evolution is None:
            return laws.wear_at(self._conditions(steps, at)[0]), None
        (conditions,), end, _ = evolution.through(at.held or layers.held(at.worn))
        return laws.wear_at(conditions), evolution.memory.bounded(end)

    def _stepped(self, at: PartialSlipState, step: TimeStep) -> PartialSlipState:
        if self.laws is None or not self.laws.changes():
            return self._advanced(at, step, self.friction)
        laws, position = self.laws, self.interface.position(step.offset)
        pressure = at.contact.pressure if at.near is None else at.near[0]
        for _ in range(MOST_FRICTIONS):
            states = self.interface.layers.known(position.pair, at.worn, at.held)
            touching = at.contact.pressure > 0  # in the step before: nodes that open and close in turn end nowhere
            conditions = laws.conditions(position.pair, pressure, **self._known(at), states=states, touching=touching)
            after = self._advanced(at, step, laws.friction.values(conditions))
            change, pressure = np.abs(after.contact.pressure - pressure).max(), after.contact.pressure
            if change <= SAME_FRICTION * max(float(pressure.max()), 1e-300):
                return after
        raise ConvergenceError(
            "friction and the pressure that it depends on did not come together in a time step: a weaker dependence "
            "on p, or a smoother table may help"
        )

    def _known(self, at: PartialSlipState) -> dict[str, Any]:
        """Return what is known of the nodes at the start of a time step, by the names of `LocalLaws.conditions`."""
        warm = None
        if self.heat is not None and at.temperature is not None:
            punch, strip = self.heat.surfaces(at.temperature)
            warm = punch, strip
        speed, debris = 0.0 if at.speed is None else at.speed, self.interface.layers.thickness(at.worn)
        return {
            "temperatures": warm,
            "worn": at.worn,
            "slid": at.slid,
            "speed": speed,
            "debris": debris,
            "cycle": self._shear(at),
        }

    def _shear(self, at: PartialSlipState) -> CycleShear | None:
        """Return what laws know of the last cycle before a state; None where none asks, or before the first.

        A time step that has not been computed slips nothing at the mean pressure.
        """
        if at.slips is None or at.pressures is None:
            return None
        middle, mean, places = self.interface.middle, self.interface.middle.rigid.mean_pressure, self.program.steps
        positions = [self.interface.position(step.offset) for step in places]
        slips: Array = np.nan_to_num(at.slips)
        ways = np.array([position.slid(slips[k]) for k, position in enumerate(positions)])
        lengths = np.linalg.norm(ways, axis=2)
        directions = ways / np.where(lengths > 0, lengths, 1.0)[:, :, None]
        pairs, wears = [position.pair for position in positions], self.wear.strip is not None
        known = SlidingWays(pairs, middle.pair, lengths, directions, wears, mean, asked=True)
        return known.shear(np.where(np.isnan(at.pressures), mean, at.pressures))

    def _advanced(self, at: PartialSlipState, step: TimeStep, friction: Array) -> PartialSlipState:
        """Return the state after a time step with friction mu (n,)."""
        self.watch()
        position, imposed = self.imposed(step, at)
        if self.heat is None or at.temperature is None or at.heating is None:
            state = advance(self.interface, at.contact, at.imposed, imposed, friction, position, at.near)
            return self._after(at, state, imposed, step)

        def solved(loaded: LoadEffect, near: tuple[Array, Array] | None) -> StickState:
            end = replace(imposed, loaded=loaded)
            return advance(self.interface, at.contact, at.imposed, end, friction, position, near or at.near)

        flux = float((friction * at.contact.pressure).max()) * self.reach / step.duration
        start = StepStart(at.next_step, step.duration, step.offset, at.temperature, at.heating)
        found = coupled_step(self.heat, solved, imposed.loaded, at.contact, start, flux)
        after = self._after(at, found.state, replace(imposed, loaded=found.loaded), step)
        return replace(
            after,
            temperature=found.temperature,
            heating=found.heating,
            conductance=found.conductance,
            coupling=found.iterations,
        )

    def _after(self, at: PartialSlipState, state: StickState, imposed: Imposed, step: TimeStep) -> PartialSlipState:
        pressures, trials = at.then(state)
        following = (at.next_step + 1) % len(self.program.steps)
        worn = self.interface.layers.flown(at.worn, state.flowed)
        imposed = replace(imposed, closure=None)  # what gives way follows from the depths
        after = PartialSlipState(state, imposed, worn, following, pressures=pressures, trials=trials, load=at.load)
        if self.laws is None:
            return after
        slipped = np.linalg.norm(state.slip, axis=1)
        before, slips = np.zeros_like(slipped) if at.slid is None else at.slid, at.slips
        if slips is not None:
            slips = slips.copy()
            slips[at.next_step] = state.slip
        return replace(after, slid=before + slipped, speed=slipped / step.duration, slips=slips)

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
        if self.heat is not None and begin.temperature is not None and at.temperature is not None:
            self.heat.check_bounds(begin.temperature, at.temperature, records.heat)
        return at, records

    def cycle(self, at: PartialSlipState) -> tuple[PartialSlipState, list[TimeStepRecords]]:
        """Return the state a cycle later and the records of its half-cycles; the shape stays; collective."""
        return self.led(partial(self._cycle, at))

    def _cycle(self, at: PartialSlipState) -> tuple[PartialSlipState, list[TimeStepRecords]]:
        found = []
        for _ in range(self.program.half_cycles):
            at, records = self.half_cycle(at)
            found.append(records)
        return at, found

    def worn_in(
        self, records: TimeStepRecords, first: int, before: PartialSlipState, *, rate: bool = False
    ) -> WornDepths:
        """Return what the steps of a record wear off both bodies, and what becomes of what lies between.

        Args:
            records: Of steps one after the other.
            first: Number of the first of them in the cycle.
            before: Where they began, with the state of what lies between.
            rate: Whether it is that of a cycle that goes on for ever, for jumps, not the change in these steps: of a
                coated body then as if all of it were of the coating.
        """
        worn = self.worn_of(records, first)
        if self.coatings == (None, None):
            parts: _Parts = (None, None)
        else:
            bases = self.worn_of(records, first, of_bases=True)
            parts = self._parts(before.worn) if rate else self._parts(before.worn, worn, bases)
            if not rate:
                punch, strip = parts
                worn = WornDepths(
                    worn.punch if punch is None else punch.coating * worn.punch + punch.base * bases.punch,
                    worn.strip if strip is None else strip.coating * worn.strip + strip.base * bases.strip,
                )
        return self._with_between(worn, parts, records, first, before, rate=rate)

    def worn_of(self, records: TimeStepRecords, first: int, *, of_bases: bool = False) -> WornDepths:
        """Return what the steps of a record, the first of this number, wear off at the nodes of punch and strip.

        Of coated bodies that is as if all of them were of the coating; or `of_bases`, as if it were worn through.
        """
        pair, steps = self.interface.middle.pair, self.program.steps
        punch, below = (
            (records.punch_base, records.strip_base) if of_bases else (records.punch_depth, records.strip_depth)
        )
        strip = np.zeros(len(pair.strip.weights))
        if self.wear.strip is not None:
            places = [steps[(first + k) % len(steps)].offset for k in range(len(records))]
            for place in dict.fromkeys(places):
                depth = below[[k for k, own in enumerate(places) if own == place]].sum(axis=0)
                strip += self.interface.position(place).pair.wear_projection @ depth
        return WornDepths(punch.sum(axis=0), strip)

    def _parts(
        self, before: WornDepths, more: WornDepths | None = None, bases: WornDepths | None = None
    ) -> tuple[Shares | None, Shares | None]:
        """Return what of coatings and bases is worn at the nodes of punch and strip; None for a body without coating.

        Args:
            before: Depths where it begins.
            more, bases: What would be worn of coatings that go on, and of bases; by default so little that no coating
                ends.
        """
        found: list[Shares | None] = []
        for name, coated in zip(("punch", "strip"), self.coatings, strict=True):
            if coated is None:
                found.append(None)
                continue
            left = left_of(coated.thickness, getattr(before, name))
            of_coating, of_base = (
                np.zeros_like(left) if one is None else np.asarray(getattr(one, name)) for one in (more, bases)
            )
            found.append(shares(of_coating, of_base, left))
        return found[0], found[1]

    def worn_like(self, records: TimeStepRecords, first: int) -> PartialSlipProblem:
        """Return the same whose coatings have the ratios of what a cycle's steps would wear of bases and of them."""
        if self._one_ratio:
            return self
        worn, bases = self.worn_of(records, first), self.worn_of(records, first, of_bases=True)
        found = [
            None if coated is None else coated.by(getattr(worn, name), getattr(bases, name))
            for name, coated in zip(("punch", "strip"), self.coatings, strict=True)
        ]
        other = copy(self)
        other.coatings = found[0], found[1]
        return other

    def measured_rate(self, rate: WornDepths, bases: WornDepths, worn: WornDepths) -> WornDepths:
        """Return rates of depths as those of `measured`, where these depths are worn.

        Args:
            rate, bases: Of coatings that go on, and of bases.
            worn: Depths.
        """
        found = {
            name: coated.measured_rate(getattr(worn, name), getattr(rate, name), getattr(bases, name))
            for name, coated in zip(("punch", "strip"), self.coatings, strict=True)
            if coated is not None
        }
        return replace(rate, **found)

    def measured(self, worn: WornDepths) -> WornDepths:
        """Return depths as what coatings would have lost if they went on: it grows evenly through their end."""
        punch, strip = self.coatings
        if punch is not None:
            worn = replace(worn, punch=punch.measure(worn.punch))
        return worn if strip is None else replace(worn, strip=strip.measure(worn.strip))

    def slopes(self, worn: WornDepths) -> tuple[Array, Array]:
        """Return the derivative of depths to what coatings would have lost, at the nodes of punch and strip."""
        punch, strip = self.coatings
        return (
            np.ones_like(worn.punch) if punch is None else punch.slope(worn.punch),
            np.ones_like(worn.strip) if strip is None else strip.slope(worn.strip),
        )

    def layers_of_wear(self, worn: WornDepths) -> tuple[_PerLayer, _PerLayer]:
        """Return for punch and strip what of coating and base wears at their nodes, and over what `measured` counts it.

        Args:
            worn: Depths.
        """
        there: list[tuple[Array, Array]] = []
        counted: list[tuple[Array, Array]] = []
        for name, coated in zip(("punch", "strip"), self.coatings, strict=True):
            depth = getattr(worn, name)
            lies = np.zeros(len(depth)) if coated is None else np.where(depth < coated.thickness, 1.0, 0.0)
            there.append((lies, 1 - lies))
            by_ratio = 1 - lies if coated is None else coated.measured_rate(depth, np.zeros_like(lies), 1 - lies)
            counted.append((lies, by_ratio))
        return (there[0], there[1]), (counted[0], counted[1])

    def changes_between(self, before: WornDepths, after: WornDepths) -> bool:
        """Return whether coefficients change with depths from some to others, or with what is slid meanwhile."""
        if not self._one_ratio and self._ends_between(before, after):
            return True
        if self.laws is None:
            return False
        pair = self.interface.middle.pair
        return self.laws.passes or any(
            of_coating is not None and first is not None and then is not None and bool((first != then).any())
            for of_coating, first, then in zip(
                self.laws.friction.of_coatings,
                covering(self.laws.coatings, pair, (before.punch, before.strip)),
                covering(self.laws.coatings, pair, (after.punch, after.strip)),
                strict=True,
            )
        )

    @cached_property
    def _one_ratio(self) -> bool:
        """Whether what bases and coatings wear has a ratio that stays; so it has where nothing is coated."""
        laws = [pair for pair in self.wear.layers if pair[0] is not None]
        alike = all(coating is not None and base is not None and coating.law == base.law for coating, base in laws)
        return not laws or (self.laws is None and alike)

    def _ends_between(self, before: WornDepths, after: WornDepths) -> bool:
        """Return whether a coating ends somewhere between these depths."""
        return any(
            coated is not None
            and bool(((getattr(before, name) < coated.thickness) & (getattr(after, name) >= coated.thickness)).any())
            for name, coated in zip(("punch", "strip"), self.coatings, strict=True)
        )

    def _taken(self, coatings: _Both, bases: _Both, parts: _Parts) -> Array:
        """Return what both bodies lose at the contact's nodes (..., n).

        Args:
            coatings, bases: What of punch and strip would be worn there of coatings that go on, and of bases.
            parts: What is worn of both, at the nodes of punch and strip.
        """
        onto = self.interface.middle.pair.wear_interpolation
        of_punch, of_strip = parts[0], None if parts[1] is None else parts[1].at(onto)
        found = [
            of_coating if part is None else part.coating * of_coating + part.base * of_base
            for part, of_coating, of_base in zip((of_punch, of_strip), coatings, bases, strict=True)
        ]
        return np.asarray(found[0] + found[1])

    def _with_between(
        self,
        worn: WornDepths,
        parts: _Parts,
        records: TimeStepRecords,
        first: int,
        before: PartialSlipState,
        *,
        rate: bool,
    ) -> WornDepths:
        """Return what is worn with what steps do to what lies between; arguments as of `worn_in` and `_taken`."""
        layers, now = self.interface.layers, before.worn
        changes = np.zeros_like(now.between)
        if layers.debris is not None:
            over = self.debris_over(records, replace(before, next_step=first))
            coatings, bases = (records.punch_depth, records.strip_depth), (records.punch_base, records.strip_base)
            taken = self._taken(coatings, bases, parts)
            rows = [layers.row(name) for name in DEBRIS]
            thickness = now.between[rows[0]]
            changes[rows] = over.rate(thickness, taken, 0.0) if rate else over.change(thickness, taken)
        if layers.hardness < np.inf and not rate:  # what flows does so as the shape wants it, however long it takes
            changes[layers.row(PLASTIC)] = records.flowed.sum(axis=0)
        found = replace(worn, between=changes)
        evolution = self.evolution(records, replace(before, next_step=first))
        if evolution is None:
            return found
        held = layers.held(now)
        return layers.with_held(found, evolution.rate(held)[0] if rate else evolution.after(held) - held)

    def debris_over(self, records: TimeStepRecords, before: PartialSlipState) -> DebrisCycle:
        """Return what the steps of a record that begin at a state do to debris."""
        debris = self.interface.layers.debris
        assert debris is not None
        if not self.interface.layers.varies:
            return debris.over(records.slip_magnitude)
        slips = _Slips(records.pressure, records.slip_magnitude, records.duration, records.temperature)
        return debris.over(slips.slid, self._conditions(slips, before))

    def evolution(self, records: TimeStepRecords, before: PartialSlipState) -> Evolution | None:
        """Return what the steps of a record that begin at a state do to the states that laws remember; None without."""
        slips = _Slips(records.pressure, records.slip_magnitude, records.duration, records.temperature)
        return self._evolution(slips, before)

    def _evolution(self, slips: _Slips, before: PartialSlipState) -> Evolution | None:
        """Return what steps that begin at a state do to the states that laws remember; None without."""
        memory, laws = self.interface.layers.memory, self.laws
        if memory is None or laws is None:
            return None
        parts = self._parts(before.worn)

        def wearing(k: int, at: ContactConditions) -> Array:
            tau = float(slips.duration[k])
            coatings, bases = laws.wear_at(at).both(at.pressure, slips.slid[k], tau)
            return np.asarray(self._taken(coatings, bases, parts) / tau)

        conditions, pairs = self._conditions(slips, before), self._pairs(slips, before)
        return Evolution(memory, conditions, slips.duration, pairs, wearing, before.worn.strip)

    def _conditions(self, slips: _Slips, before: PartialSlipState) -> list[ContactConditions]:
        """Return the conditions of laws in steps that begin at a state: temperatures are those at the start of each."""
        laws, known = self.laws, self._known(before)
        assert laws is not None
        begun = np.zeros_like(self.weights) if before.slid is None else before.slid
        slid = begun + np.cumsum(slips.slid, axis=0)
        warm = [known["temperatures"]] * len(slid)
        if slips.temperature is not None and known["temperatures"] is not None:
            warm[1:] = [(punch, strip) for punch, strip in slips.temperature[:-1]]
        return [
            laws.conditions(
                pair,
                slips.pressure[k],
                speed=slips.slid[k] / slips.duration[k],
                temperatures=warm[k],
                worn=before.worn,
                slid=slid[k],
                debris=known["debris"],
                cycle=known["cycle"],
            )
            for k, pair in enumerate(self._pairs(slips, before))
        ]

    def _pairs(self, slips: _Slips, before: PartialSlipState) -> list[ContactPair]:
        steps = self.program.steps
        places = [steps[(before.next_step + k) % len(steps)].offset for k in range(len(slips.slid))]
        return [self.interface.position(place).pair for place in places]

    def _record(
        self, at: PartialSlipState, after: PartialSlipState, step: TimeStep, wear: LocalWear
    ) -> TimeStepRecords:
        before, state, position = at.contact, after.contact, self.interface.position(step.offset)
        weights = position.pair.weights
        f = np.concatenate([state.pressure, state.traction.T.ravel()])
        force = position.in_space(f * position.weights)
        back = position.reading.T @ position.pair.placement.back(force)
        on_punch, on_strip = state.on_punch - before.on_punch, state.on_strip - before.on_strip
        layers, closure = self.interface.layers, self.interface.layers.closure_at(position.pair, at.worn)
        closed = layers.given(state.pressure, closure) - layers.given(before.pressure, closure)
        if self.interface.creep is not None:
            crept = zip(*map(self.interface.creep.displaced, (state.crept, before.crept)), strict=True)
            on_punch, on_strip, closed = (
                own + now - had for own, (now, had) in zip((on_punch, on_strip, closed), crept, strict=True)
            )
        stored = np.vdot(force, on_punch) - np.vdot(back, on_strip)
        lowered = float(after.imposed.loaded.resultant @ (state.rigid - before.rigid))
        work = state.force * (state.displacement - before.displacement) + lowered
        carried = position.beside(state.beside) - position.beside(before.beside)
        work += float((f * position.weights) @ carried)
        stored += weights @ (state.pressure * closed)
        slipped = np.linalg.norm(state.slip, axis=1)
        coatings, bases = wear.both(state.pressure, slipped, step.duration)
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
            *coatings,
            *bases,
            surface_strain(position, self._gradient, state.on_strip),
            float(state.iterations),
            state.unique,
            step.duration,
            *self._heat_record(at, after),
            float(after.coupling),
            state.rigid,
            np.zeros_like(state.pressure) if state.flowed is None else state.flowed,
        )
        return TimeStepRecords(*(np.asarray(value)[None] for value in values))

    def _heat_record(self, at: PartialSlipState, after: PartialSlipState) -> tuple[Array, Array, Array]:
        """Return the terms of the heat, the contact temperatures, and the conductances; empty without heat."""
        heat, none = self.heat, np.zeros(0)
        conductance = after.conductance
        if heat is None or at.temperature is None or after.heating is None or conductance is None:
            return none, np.zeros((2, 0)), none
        made = heat.step(at.next_step, at.temperature, after.heating, conductance)
        return made.terms, made.surfaces, conductance
