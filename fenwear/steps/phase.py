"""One phase of the motion: contact, with or without heat, and its wear, at coefficients of its own state.

The contacts of a phase over the last cycles, and where the next one is looked for from.

Nodes in contact change as a polynomial of the cycles, which is known at the cycles before. Where surfaces close by a
law, pressures near the edges of the contact are far from that; how near they are is not, whether they touch or not (see
`fenwear.laws.compliant_layer`): so nodes come to touch where the polynomial has them.

One phase with heat: contact and conduction, coupled.

The pressure heats, the heat opens or closes the gap, the gap makes the pressure. Implicitly: the
thermal gap at the end of the half-cycle is linear in its pressure as long as the same nodes conduct,
so its matrix joins the elastic compliance and one inequality solves for both. Or by the paper's
operator split: conduct at fixed pressure, solve contact, relax the pressure (29), repeat until the
volume of the gap rests (30).

Where a node conducts while it touches, both may be a solution. Plain iteration from the phase a cycle ago goes to the
same one on any number of ranks, which combinations of earlier iterates do not.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import comb

import numpy as np

from fenwear.algebra.fixed_point import fixed_point
from fenwear.common.arrays import Array, Mask
from fenwear.common.errors import ConvergenceError
from fenwear.common.parallel import agreed
from fenwear.contact import CondensedContact, ContactSolver, ContactState, WearCompliance
from fenwear.heat.temperature import HeatState
from fenwear.laws import LayerEvolution
from fenwear.laws.compliant_layer import Law
from fenwear.laws.friction import ContactConditions, FollowingFriction
from fenwear.laws.sliding_tensors import CycleShear
from fenwear.laws.wear import WornDepths
from fenwear.steps.block import HeatRecord, PhaseRecord
from fenwear.steps.run_state import PhaseMeter, Totals, pressure_scale, with_coated
from fenwear.system import Tribosystem, heating_friction

MAX_ITERATIONS = 200
ALTERNATES = 20  # iterations after which nodes that open and close in turn are followed half way
APART = (
    "contact and heat did not converge: nodes open and close in turn. "
    'Set heat.conducting = "nominal", or increase heat.steps'
)
SPLIT_ADVICE = 'Reduce heat.relaxation, increase heat.steps, or set heat.coupling = "implicit"'
WORTH_IT = 12  # iterations with the same conductances after which a costly response of their own pays


_Contact = tuple[ContactState, HeatState | None, HeatRecord | None]


@dataclass
class _Response:
    """Effect of unit pressures of a half-cycle at its end, for given conductances."""

    conductance: Array
    state: Array
    terms: Array
    gap: Array


class ThermalContact:
    """Contact in one phase of the motion together with the heat of its half-cycle.

    Args:
        system: The assembled problem.
        phase: Which phase.
        contact: Contact of the phase.
    """

    def __init__(self, system: Tribosystem, phase: int, contact: ContactSolver) -> None:
        self.system, self.exchange, self.phase = system, system.exchange, phase
        self._contact = contact
        self._response: _Response | None = None
        self._asked, self._repeats = b"", 0  # conductances asked for last, and how often in a row

    def slide(self, mu: Array) -> None:
        """Set the friction of the nodes times what they slide for a unit of the stroke (n,)."""
        if self.exchange.conducts and not np.array_equal(self.exchange.friction[self.phase], mu):
            friction = self.exchange.friction.copy()
            friction[self.phase] = mu
            self.exchange, self._response = self.exchange.with_friction(friction), None

    def solve(
        self, temperature: HeatState, gap: Array, start: ContactState | None, wearing: WearCompliance | None
    ) -> _Contact:
        """Return contact, temperature at the end of the half-cycle, and its heat; None of bodies without heat.

        Args:
            temperature: At the start.
            gap: Of the unloaded bodies at the initial temperature, worn depth included (n,), mm.
            start: State of this phase one cycle ago.
            wearing: Wear of this half-cycle where its step is implicit.

        Raises:
            ConvergenceError: contact and heat do not converge.
        """
        if not self.exchange.conducts:
            return self._contact.solve(gap, start, wearing), None, None
        if start is None:
            start = self._contact.solve(gap + self.exchange.gap(temperature, self.phase - 1), None, wearing)
        if self.exchange.heat.coupling == "split":
            return self._split(temperature, gap, start, wearing)
        return self._implicit(temperature, gap, start, wearing)

    def _implicit(
        self, temperature: HeatState, gap: Array, start: ContactState, wearing: WearCompliance | None
    ) -> tuple[ContactState, HeatState, HeatRecord]:
        exchange, contact = self.exchange, start
        mean = self.system.rigid.mean_pressure
        relaxed = 1.0
        pressure = start.pressure[0]
        for iteration in range(1, MAX_ITERATIONS + 1):
            conductance = exchange.conductance(pressure, self.phase)
            after, terms = exchange.half_cycle(temperature, self.phase, pressure, conductance)
            response = self._respond(conductance)
            free = gap + exchange.gap(after, self.phase) - response.gap @ pressure
            contact = self._contact.solve(free, contact, wearing, response.gap[None, :, None, :])
            change = contact.pressure[0] - pressure
            if agreed(self.system.bodies.comm, bool(np.abs(change).max() < CLOSE * mean)):
                return contact, after, self._heat(after, terms, iteration)
            others = response.conductance, exchange.conductance(contact.pressure[0], self.phase)
            exact = all(np.array_equal(other, conductance, equal_nan=True) for other in others)
            if agreed(self.system.bodies.comm, exact):
                after = exchange.at(after.values + response.state @ change)
                return contact, after, self._heat(after, terms + response.terms @ change, iteration)
            if iteration > ALTERNATES:
                relaxed = 0.5
            pressure = pressure + relaxed * change
        raise ConvergenceError(f"{APART} ({MAX_ITERATIONS} iterations)")

    def _respond(self, conductance: Array) -> _Response:
        """Return the response for these conductances, or a near one where it is costly to make."""
        known, key = self._response, conductance.tobytes()
        self._repeats = self._repeats + 1 if key == self._asked else 0
        self._asked = key
        costly = self.exchange.by_pressure or self.exchange.heat.operator == "full"
        near = known is not None and (known.conductance.tobytes() == key or (costly and self._repeats < WORTH_IT))
        if known is not None and agreed(self.system.bodies.comm, near):
            return known
        state, terms = self.exchange.change(self.phase, conductance, pressure=np.eye(len(conductance)))
        self._response = _Response(conductance, state, terms, self.exchange.gap_change(state, self.phase))
        return self._response

    def _split(
        self, temperature: HeatState, gap: Array, start: ContactState, wearing: WearCompliance | None
    ) -> tuple[ContactState, HeatState, HeatRecord]:
        exchange = self.exchange
        relaxation, tolerance = exchange.heat.relaxation, exchange.heat.split_tolerance
        contact, pressure, volume = start, start.pressure[0], np.inf
        for iteration in range(1, MAX_ITERATIONS + 1):
            closed = np.where(contact.pressure[0] > 0, pressure, 0.0)  # relaxed pressures never get to zero
            after, terms = exchange.half_cycle(
                temperature, self.phase, pressure, exchange.conductance(closed, self.phase)
            )
            free = gap + exchange.gap(after, self.phase)
            try:
                contact = self._contact.solve(free, contact, wearing)
            except ConvergenceError as error:  # the heat of a pressure too far off opens all nodes
                raise ConvergenceError(f"{error}; in iteration {iteration} of the split. {SPLIT_ADVICE}") from error
            before, volume = volume, gap_volume(self.system, free)
            pressure = pressure + relaxation * (contact.pressure[0] - pressure)
            if agreed(self.system.bodies.comm, bool(abs(volume - before) < tolerance * volume)):
                return contact, after, self._heat(after, terms, iteration)
            if agreed(self.system.bodies.comm, not np.isfinite(volume)):
                break
        raise ConvergenceError(
            f"the operator split of heat and contact did not converge in {iteration} iterations. {SPLIT_ADVICE}"
        )

    def _heat(self, state: HeatState, terms: Array, iterations: int) -> HeatRecord:
        punch, strip = self.exchange.contact_temperatures(state, self.phase)
        return HeatRecord(punch, strip, terms, np.array(iterations), np.array(state.bulk))


def gap_volume(system: Tribosystem, gap: Array) -> float:
    """Return the cross-section between the unloaded surfaces where they touch first, mm², for (30)."""
    modes, weights = system.rigid.rigid_normal, system.pair.weights
    root = np.sqrt(weights)
    fitted = modes @ np.linalg.lstsq(modes * root[:, None], gap * root, rcond=None)[0]
    return float(weights @ np.abs(gap - fitted))


# Shares of the last cycles in the next, by polynomials of rising degree.
ONWARDS = np.array([[-comb(n, k) * (-1) ** k if k <= n else 0 for k in range(1, 7)] for n in range(1, 7)], dtype=float)
MOST = np.array(1.0)  # change of nearness


class Onwards:
    """Extrapolates contacts of one phase from cycle to cycle.

    Args:
        nodes, modes: Numbers of nodes and of rigid modes.
        law: Closure of the surfaces; None where they do not, or in proportion to the pressure.
        hardness: Largest pressure, MPa.
    """

    def __init__(self, nodes: int, modes: int, law: Law | None, hardness: float) -> None:
        self._law, self._hardness = law, hardness
        self._nodes, self._known = nodes, np.zeros((len(ONWARDS), nodes + modes))  # each with its rigid motions
        self._values = self._known[:, :nodes]
        self._last: ContactState | None = None
        self._count = 0  # of cycles that are known
        self._alike = 0  # of them, in which the same nodes touch as in the last one
        self._touching = b""

    def keep(self, before: ContactState, contact: ContactState) -> None:
        """Take a contact, and the one a cycle before it; what was known is forgotten where that is not the last one."""
        pressure = contact.pressure[0]
        self._count = min(self._count + 1, len(ONWARDS)) if before is self._last else 1
        self._known[1:] = self._known[:-1]
        self._values[0] = pressure if self._law is None else self._law.nearness(pressure, contact.gap[0])
        self._known[0, self._nodes :], self._last = contact.rigid[0], contact
        if self._law is None:
            touching = (pressure > 0).tobytes()
            self._alike = min(self._alike + 1, self._count) if touching == self._touching else 1
            self._touching = touching

    def start(self, before: ContactState) -> ContactState:
        """Return the contact extrapolated from the last cycles."""
        count = self._count
        if count < 2 or before is not self._last:
            return before
        recent, every = before.pressure[0], ONWARDS[count - 1, :count] @ self._known[:count]
        further, rigid = every[: self._nodes], every[None, self._nodes :]
        if self._law is None:
            if self._alike < count:
                self._as_long_as_they_touch(further)
            further = np.where((recent > 0) & (further > 0), further, recent)
        else:
            last = self._values[0]
            further = self._law.pressure_of(np.minimum(np.maximum(further, last - MOST), last + MOST))
        if self._hardness < np.inf:
            further = np.where((recent < self._hardness) & (further < self._hardness), further, recent)
        return ContactState(further[None], before.gap, rigid, before.iterations)

    def _as_long_as_they_touch(self, further: Array) -> None:
        """Put pressures in place, extrapolated as far back as their nodes touch."""
        values = self._values[: self._count]
        fresh = np.flatnonzero((values[-1] <= 0) & (values[0] > 0))
        touch = np.logical_and.accumulate(values[:, fresh] > 0).sum(axis=0)
        further[fresh] = (ONWARDS[touch - 1, : self._count].T * values[:, fresh]).sum(axis=0)


CLOSE = 1e-10  # change of pressure over its scale that ends the iterations of coefficients, heat and pressure
COEFFICIENTS_FAIL = (
    "the coefficients of friction and wear and the pressure they depend on did not converge. Use a weaker dependence "
    "on p, or a smoother table"
)
_Solved = tuple[ContactState, HeatState | None, HeatRecord | None, LayerEvolution]


@dataclass(frozen=True)
class _Begin:
    """The begin of a phase.

    Attributes:
        temperature: Of both bodies.
        worn: Depths.
        before: Contact of this phase one cycle ago.
        start: Where its contact is looked for; None from nothing.
        near: Pressures there (n,), MPa: even ones where none are known. By edges of the contact those nodes touch that
            carry one, as in a cycle ago: they do not go to and fro.
        half_cycles: Done since the start of the run, in its middle.
        cycle: Cross-shear and pressures a cycle ago; None in the first cycle.
    """

    temperature: HeatState
    worn: WornDepths
    before: ContactState
    start: ContactState | None
    near: Array
    half_cycles: float
    cycle: CycleShear | None


@dataclass(frozen=True)
class PhaseEnd:
    """The end of a phase: its record, temperature and heat (None without), and the depths worn in it."""

    record: PhaseRecord
    temperature: HeatState | None
    heat: HeatRecord | None
    worn: WornDepths


class PhaseStep:
    """Steps through one phase of the motion, again and again.

    Args:
        system: The assembled problem.
        phase: Number of the phase in the cycle.
        implicit: Whether the pressure is that on the shape at the end of the phase.
    """

    def __init__(self, system: Tribosystem, phase: int, *, implicit: bool) -> None:
        self.system, self.phase, self.implicit = system, phase, implicit
        flows = implicit and system.layers.hardness < np.inf
        self._at_begin = PhaseStep(system, phase, implicit=False) if flows else None
        self._constant, self._load = system.phases.constant, 1.0
        # Explicitly, wear and what remembers follow the pressure, and do not change it.
        friction, asks = system.laws.friction, system.laws.friction.asks
        apart = not self._constant and not implicit and not friction.remembers and not asks("edge")
        self._wears_after = apart and friction.constant
        self._slides_before = apart and not friction.constant and not asks("p", "pm")
        follows = apart and not system.exchange.conducts and asks("p", "pm")
        self._contact = system.passed_contact(phase)
        self._follows = follows and isinstance(self._contact, CondensedContact) and self._contact.can_follow
        self._thermal = ThermalContact(system, phase, self._contact)
        conditions = system.phases.conditions(phase)
        # Where nothing asks for more than the pressure and debris of the moment, all else stays as it is.
        changing = (
            system.laws.any_coating
            or system.exchange.conducts
            or any(map(system.laws.asks, ("depth", "s", "cs", "pm", "edge")))
        )
        self._staying = None if changing else conditions
        self._mu = system.laws.friction.values(conditions)
        self._friction_ratio = system.phases.ratio(phase, self._mu)
        wear = system.phases.wear.phases([conditions], [phase])
        self._passing = system.phases.passing(wear, [phase])
        self._flowed: Array | float = 0.0  # beyond the hardness, in the last solve
        self._bare = system.phases.ratio(phase, np.zeros_like(self._mu))
        self._along = system.phases.ratio(phase, np.ones_like(self._mu)) - self._bare
        self._onwards: Onwards | None = None  # where the iterations of contact depend on their start
        self._layers = layers = system.layers.at(phase)
        if self._follows or layers.closure is not None:
            modes = system.rigids[phase].rigid_normal.shape[1]
            self._onwards = Onwards(len(self._mu), modes, layers.closure, layers.hardness)
        self._even = np.full(len(self._mu), system.rigid.mean_pressure)
        self._meter = PhaseMeter(system, phase)

    def solve(
        self,
        temperature: HeatState | None,
        worn: WornDepths,
        before: ContactState,
        load: float = 1.0,
        half_cycles: float = 0.0,
        near: ContactState | None = None,
        cycle: CycleShear | None = None,
    ) -> PhaseEnd:
        """Return the end of the phase.

        Args:
            temperature: At its start; None for the initial one.
            worn: Depths at its start.
            before: Contact of this phase one cycle ago.
            load: Factor of all loads.
            half_cycles: Done since the start of the run, in its middle.
            near: Where to start from in the first cycle, such as the phase before.
            cycle: Cross-shear and pressures a cycle ago; None in the first cycle.

        Raises:
            ConvergenceError: contact, heat or the coefficients did not converge.
        """
        if load != self._load:
            self._contact.press(load)
            self._load = load
        start = near
        if before.solved:
            start = before if self._onwards is None else self._onwards.start(before)
        pressure = self._even if start is None else start.pressure[0]
        at = _Begin(self.system.exchange.on_bases(temperature), worn, before, start, pressure, half_cycles, cycle)
        if self._at_begin is None:
            return self._end_of(at)
        # Surfaces flow as soon as they are pressed, before anything wears.
        pressed = self._at_begin.solve(temperature, worn, before, load, half_cycles, near, cycle)
        flown = self.system.layers.flown_as(worn, worn + pressed.worn)
        end = self._end_of(replace(at, worn=flown))
        return replace(end, worn=end.worn + (flown - worn))

    def _end_of(self, at: _Begin) -> PhaseEnd:
        """Return the end of the phase."""
        gap = self.system.gap(self.phase, at.worn, passing=True)
        if self._constant:
            return self._end(at, *self._solve(at, gap, self._passing), self._passing)
        if self._slides_before:  # friction is that of the state at the start
            self._update(at.near, at, touching=at.near > 0)
        if self._wears_after or self._slides_before:
            contact, after, heat = self._solve(at, gap, self._passing)
            return self._end(at, contact, after, heat, self._update(contact.pressure[0], at, ended=True))
        if self._follows:
            try:
                return self._end_of_following(at, gap)
            except ConvergenceError:  # in turn they may come together yet
                pass
        return self._end(at, *self._in_turn(at, gap))

    def _end_of_following(self, at: _Begin, gap: Array) -> PhaseEnd:
        """Return the end of the phase whose friction follows its pressure.

        Raises:
            ConvergenceError: Newton's method does not find both together.
        """
        mu = FollowingFriction(self.system.laws.friction, self._conditions(at.near, None, at, at.near > 0))
        contact = self._following(mu, at, gap)
        if self.system.laws.edges is None and not self.system.laws.asks("depth"):
            passing = self._taken(mu.at(contact.pressure[0]), at.worn, ended=True)
        else:
            passing = self._update(contact.pressure[0], at, ended=True)
        return self._end(at, contact, None, None, passing)

    def _in_turn(self, at: _Begin, gap: Array) -> _Solved:
        """Return contact, heat and coefficients that belong together, found in turn.

        Raises:
            ConvergenceError: they do not converge.
        """

        def solve(pressure: Array) -> tuple[Array, _Solved, bool]:
            nonlocal at
            passing = self._update(pressure, at, touching=at.near > 0)
            try:
                contact, after, heat = self._solve(at, gap, passing)
            except ConvergenceError as error:
                largest = float(np.linalg.norm(self._friction_ratio, axis=1).max())
                raise ConvergenceError(f"{error}. Friction reaches {largest:.3g} times the pressure") from error
            at = replace(at, start=contact)
            return contact.pressure[0], (contact, after, heat, passing), False

        return fixed_point(
            solve,
            at.near,
            lambda change, pressure: bool(np.abs(change).max() < CLOSE * pressure_scale(self.system, pressure)),
            COEFFICIENTS_FAIL,
            team=self.system.team,
        )

    def _following(self, mu: FollowingFriction, at: _Begin, gap: Array) -> ContactState:
        """Return the contact whose friction follows its pressure."""
        assert isinstance(self._contact, CondensedContact)
        self._contact.follow(mu, self._bare, self._along)
        if self.system.layers.hardness == np.inf:
            return self._contact.solve(gap, at.start, self._passing.step(at.worn, implicit=self.implicit))
        if self._contact.most < np.inf:
            return self._capped(at, gap, self._passing)[0]
        return self._flowing(self._contact, at, gap, self._passing)[0]

    def _update(
        self, pressure: Array, at: _Begin, *, ended: bool = False, touching: Mask | None = None
    ) -> LayerEvolution:
        """Take friction and wear at this pressure, at the temperature at the start of the phase and the middle depths.

        Where it is that of the end, the states of laws are those at the end. Edges of the contact are those of nodes
        that touch, by default those that carry this pressure.
        """
        surfaces = self.system.exchange.contact_temperatures(at.temperature, self.phase - 1)
        passing = self._taken(self._conditions(pressure, surfaces, at, touching), at.worn, ended=ended)
        if not self.system.laws.asks("depth"):
            return passing
        middle = at.worn + passing.worn(pressure[None], at.worn).times(0.5)
        halfway = replace(at, worn=replace(at.worn, punch=middle.punch, strip=middle.strip))
        return self._taken(self._conditions(pressure, surfaces, halfway, touching), at.worn, ended=ended)

    def _conditions(
        self, pressure: Array, surfaces: tuple[Array, Array] | None, at: _Begin, touching: Mask | None
    ) -> ContactConditions:
        """Return the conditions that coefficients depend on, as `PhaseLaws.conditions`."""
        system, worn = self.system, at.worn
        if self._staying is None:
            return system.phases.conditions(self.phase, pressure, surfaces, worn, at.half_cycles, at.cycle, touching)
        return self._staying.pressed(pressure, system.layers.facing(system.sliding.pairs[self.phase], worn))

    def _taken(self, conditions: ContactConditions, worn: WornDepths, *, ended: bool) -> LayerEvolution:
        """Take friction and wear at conditions and depths at the start of the phase, as `_update`."""
        system = self.system
        evolution = system.phases.evolution([conditions], worn, [self.phase])
        # Coefficients are those of the states in the middle of the phase.
        (conditions,), end, _ = evolution.through(system.layers.held(worn))
        # Once the phase has ended its friction is known, but for one that has followed the pressure.
        changes = not system.laws.friction.constant and (self._follows or not ended)
        if changes:
            mu = self._mu = system.laws.friction.values(conditions)
            self._friction_ratio = self._bare + mu[:, None] * self._along
            if not ended:
                self._contact.slide([self._friction_ratio])
                self._thermal.slide(heating_friction(system, mu, self.phase))
        wear = (
            self._passing.wear if system.phases.wear.constant else system.phases.wear.phases([conditions], [self.phase])
        )
        layers, debris = self._layers.under([conditions]), self._passing.debris
        if layers.varies:
            onto = layers.places([system.sliding.pairs[self.phase]])
            debris = layers.debris.over(system.sliding.path[[self.phase]], [conditions], onto)
        return LayerEvolution(layers, wear, debris, evolution, end if ended else None)

    @cached_property
    def _uncapped(self) -> ContactSolver:
        """The contact whose surfaces flow by and by."""
        return self.system.passed_contact(self.phase, capped=False)

    def _solve(self, at: _Begin, gap: Array, passing: LayerEvolution) -> _Contact:
        contact = self._contact
        if self.system.layers.hardness == np.inf:
            wearing = passing.step(at.worn, implicit=self.implicit)
            return self._thermal.solve(at.temperature, gap, at.start, wearing)
        if isinstance(contact, CondensedContact) and contact.most < np.inf:
            try:
                return self._capped(at, gap, passing)
            except ConvergenceError:  # so much flows that too little else carries on the way to the solution
                contact = self._uncapped
                contact.press(self._load)
                contact.slide([self._friction_ratio])
        return self._flowing(contact, at, gap, passing)

    def _capped(self, at: _Begin, gap: Array, passing: LayerEvolution) -> _Contact:
        """Return the end of a phase whose contact lets no pressure beyond the hardness."""
        wearing = passing.step(at.worn, implicit=self.implicit, capped=True)
        contact, after, heat = self._thermal.solve(at.temperature, gap, at.start, wearing)
        self._flowed = self.system.layers.flowed(contact.pressure[0], contact.gap[0])
        return replace(contact, gap=contact.gap + self._flowed), after, heat

    def _flowing(self, solver: ContactSolver, at: _Begin, gap: Array, passing: LayerEvolution) -> _Contact:
        """Return the end of a phase whose contact flows by and by."""
        wearing, near, thermal = passing.step(at.worn, implicit=self.implicit), at.start, self._thermal
        if solver is not self._contact:
            thermal = ThermalContact(self.system, self.phase, solver)
            thermal.slide(heating_friction(self.system, self._mu, self.phase))

        def solve(flowed: Array) -> _Contact:
            nonlocal near
            solution = thermal.solve(at.temperature, gap + flowed, near, wearing)
            near = solution[0]
            return solution

        solved, self._flowed = self.system.layers.flowing(solve, lambda solution: solution[0].pressure)
        return solved

    def _end(
        self,
        at: _Begin,
        contact: ContactState,
        temperature: HeatState | None,
        heat: HeatRecord | None,
        passing: LayerEvolution,
    ) -> PhaseEnd:
        if self._onwards is not None:
            self._onwards.keep(at.before, contact)

        def left() -> tuple[Totals, WornDepths]:
            pressure = contact.pressure[0]
            lost = passing.worn(contact.pressure, at.worn, flowed=self._flowed)
            creep = self.system.elastic.creep
            if creep.creeps:
                crept = creep.change(self.phase, at.worn.crept, pressure, self._friction_ratio, self._load)
                lost = replace(lost, crept=crept)
            return with_coated(self.system, self._meter(pressure, self._mu, passing.wear), lost), lost

        adds, lost = self.system.team.lead(left)
        record = PhaseRecord(self.phase, contact, at.before.pressure[0], adds, self._friction_ratio)
        return PhaseEnd(record, temperature, heat, lost)
