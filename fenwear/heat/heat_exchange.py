"""Heat across the interface: friction heat shared, conduction between the bodies, half-cycle by half-cycle.

At a node that conducts, with friction heat Q = mu p v (23), the debris' share gamma_d and the
partition kappa,

    q_1 + q_2 = (1 - gamma_d) Q,    kappa (1 - gamma_d) Q - q_1 = h_c (theta_1 - theta_2),

h_c -> infinity giving theta_1 = theta_2 (24); elsewhere both surfaces lose h (theta - theta_a). As
each body answers a flux linearly, theta_i = theta_i without flux + T_i q_i, every stage is one small
dense system for the 2 n fluxes, whatever nodes conduct: nothing is factored again.

A time step dt has two stages, each an implicit Euler step E of gamma dt, gamma = 1 - 1/sqrt(2), with these conditions
at its end:

    theta* = E(theta),    theta' = E(theta + r (theta* - theta)),    r = (1 - gamma) / gamma,

which is the L-stable, singly diagonally implicit Runge-Kutta rule of second order (Alexander, SIAM J. Numer. Anal. 14,
1977). The first stage counts r times in all balances.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from functools import partial
from typing import TypeVar

import numpy as np

from fenwear.case import Heat
from fenwear.common.arrays import Array
from fenwear.common.errors import HeatError
from fenwear.common.parallel import Team
from fenwear.heat.conduction import HeatBody
from fenwear.heat.contact_fluxes import Exchanged, FluxFactor, FluxUpdate
from fenwear.heat.side import EARLIER, Fineness, Side, StepPlan
from fenwear.heat.stage import HeatBalance, PreparedStage, PreparedStep, Stage, StepMap
from fenwear.heat.temperature import Basis, HeatState, ReducedBasis

T = TypeVar("T")
FEW = 300  # contact nodes up to which fluxes are worth a matrix
LEAST = 12  # flux maps that are kept: of the steps of two phases and more
MEMORY = 2 * 10**8  # bytes that kept flux maps may take
SLOPE = 1e-4  # of the pressure: half the step of differences
# What elements and a small basis may add to the heat of a half-cycle, as shares of friction's and of what is there.
# Elements longer than what passes in a half-cycle take in a third through a held end that a warm front comes to.
OVERSHOOT, DRIFT = 0.5, 1e-3


# The heat of a half-cycle: done by friction, carried off by debris, gained by both bodies, lost to the
# surroundings, lost through boundaries of held temperature, carried out by the strip's material less what it brings.
TERMS = ("friction", "debris", "stored", "convected", "held", "carried")
# And what crosses the contact where it conducts: all of friction that debris does not carry off.
CROSSING = ("into_punch", "into_strip")


class HeatExchange:
    """Both bodies' temperatures over half-cycles, with the heat between them.

    Args:
        heat: Partition, conductance and convection.
        sides: The punch and the strip.
        plans: The steps of each phase.
        friction: mu of the interface nodes in each phase (phases, n).
        weights: Quadrature weights of the interface (n,), mm.
        thickness: Of the plane model, mm.
    """

    conducts = True

    def __init__(
        self,
        heat: Heat,
        sides: tuple[Side, Side],
        plans: list[list[StepPlan]],
        friction: Array,
        weights: Array,
        thickness: float,
    ) -> None:
        self.heat, self.sides, self.plans, self.bases = heat, sides, plans, _bases(sides)
        self.friction, self.weights, self.thickness = friction, weights, thickness
        self._steady = np.isinf(plans[0][0].duration)
        # T_i: temperature at the contact from unit fluxes there, per prepared step.
        self._contact_responses = [
            side.field.contact_responses
            or [contact.of_changes(r) for contact, r in zip(side.contacts, side.field.responses, strict=True)]
            for side in sides
        ]
        self.fineness = Fineness()  # of the steps
        self._conductance, self.by_pressure = _given_conductance(heat)
        self._forget()
        for basis in self.bases:
            self.team.serve(basis)
        # Known before rank 0 leads: where temperatures are reduced, that takes all ranks.
        self._initial = self.on_bases(HeatState.nodal(*self._unheated())) if self.reduced else None

    @property
    def ambient(self) -> float:
        """The temperature of the surroundings, K."""
        return self.heat.ambient

    @property
    def team(self) -> Team:
        """The ranks, of which one leads."""
        return Team.of(self.bases[0].body.body.mesh.comm)

    def _led(self, function: Callable[[], T]) -> T:
        """Call what is the same on all ranks: on rank 0 for all, unless every rank could continue alone."""
        return function() if self.reduced else self.team.lead(function)

    def _unheated(self) -> tuple[tuple[HeatBody, ...], list[Array]]:
        bodies = (self.bases[0].body, self.bases[1].body)
        return bodies, [body.initial() for body in bodies]

    def _forget(self) -> None:
        """Begin without any fluxes, which follow from friction's partition and the conductances."""
        self._flux_maps: dict[tuple[int, int, bytes], FluxFactor | FluxUpdate] = {}
        self._flux_factors: dict[tuple[int, int], FluxFactor] = {}  # the last one of each step
        self._prepared: dict[tuple[int, int], PreparedStep] = {}
        self._few: dict[tuple[int, int, bytes], Stage] = {}
        self._prepared_few: dict[tuple[int, int], PreparedStage] = {}

    @property
    def reduced(self) -> bool:
        """Whether both bodies' temperatures live on a small basis, equal on every rank."""
        return all(isinstance(basis, ReducedBasis) for basis in self.bases)

    def with_friction(self, friction: Array) -> HeatExchange:
        """Return the exchange at another mu (phases, n)."""
        other = copy.copy(self)
        other.friction = friction
        return other

    def through(self, of_layer: Callable[[Array, int], Array] | None) -> HeatExchange:
        """Return the exchange whose conductance a layer gives by pressures (n,) and phase; None where none does."""
        if of_layer is None:
            return self
        other = copy.copy(self)
        other._conductance, other.by_pressure = of_layer, True
        return other

    def varied(self, heat: Heat, friction: Array) -> HeatExchange:
        """Return the exchange of another friction, partition or conductance with the same prepared bodies."""
        other = copy.copy(self)
        other.heat, other.friction = heat, friction
        other._conductance, other.by_pressure = _given_conductance(heat)
        other._forget()
        return other

    def initial(self) -> HeatState:
        """Return the initial state."""
        return self._initial or self.on_bases(HeatState.nodal(*self._unheated()))

    def on_bases(self, state: HeatState | None) -> HeatState:
        """Return a state, by default the initial one, on this exchange's bases; collective where it is on others."""
        return self.initial() if state is None else state.on(self.bases)

    def at(self, values: Array) -> HeatState:
        """Return the state of coordinates (dim,) on this exchange's bases."""
        return HeatState(self.bases, values)

    def gap(self, state: HeatState, phase: int = -1) -> Array:
        """Return the gap that thermal expansion opens at the end of a phase (n,), mm.

        Args:
            state: The temperatures.
            phase: Number of the phase, for the place of the contact; -1 for the last phase, before the first.
        """
        punch, strip = self._parts(self.on_bases(state).values)
        return self.sides[0].readings[phase].gap(punch) + self.sides[1].readings[phase].gap(strip)

    def gap_change(self, changes: Array, phase: int = -1) -> Array:
        """Return the thermal gap at the end of a phase of changes of the coordinates (dim, k), mm."""
        punch, strip = self._parts(changes)
        return self.sides[0].readings[phase].gap.of_changes(punch) + self.sides[1].readings[phase].gap.of_changes(strip)

    def contact_temperatures(self, state: HeatState, phase: int = -1) -> tuple[Array, Array]:
        """Return the temperatures of the two surfaces at the interface nodes at the end of a phase (n,), K."""
        state = self.on_bases(state)
        if state.surfaces is not None:
            return state.surfaces
        punch, strip = self._parts(state.values)
        return self.sides[0].readings[phase].contact(punch), self.sides[1].readings[phase].contact(strip)

    def contact_changes(self, changes: Array, phase: int = -1) -> tuple[Array, Array]:
        """Return the changes of both contact temperatures by changes of the coordinates (dim, k), (n, k) each."""
        first, second = (
            side.readings[phase].contact.of_changes(part)
            for side, part in zip(self.sides, self._parts(changes), strict=True)
        )
        return first, second

    def _parts(self, values: Array) -> tuple[Array, Array]:
        """Return the coordinates of punch and strip."""
        split = len(self.bases[0])
        return values[:split], values[split:]

    def conductance(self, pressure: Array, phase: int = 0) -> Array:
        """Return h_c of each node (n,), N/(mm s K): infinite for perfect contact, NaN where none conducts."""
        value = self._conductance(pressure, phase)
        if self.heat.conducting == "closed":
            value[pressure <= 0] = np.nan
        return value

    def conductance_slope(self, pressure: Array, phase: int) -> Array:
        """Return dh_c/dp of each node (n,), N/(mm s K MPa): zero where h_c is constant or none conducts."""
        if not self.by_pressure:
            return np.zeros_like(pressure)
        ends = [self.conductance((1 + sign * SLOPE) * pressure, phase) for sign in (1, -1)]
        return np.divide(ends[0] - ends[1], 2 * SLOPE * pressure, out=np.zeros_like(pressure), where=pressure > 0)

    def half_cycle(self, state: HeatState, phase: int, pressure: Array, conductance: Array) -> tuple[HeatState, Array]:
        """Conduct over a half-cycle at constant pressure; return the state at its end and its heat terms.

        Args:
            state: At its start.
            phase: Which of the motion's phases.
            pressure: During it (n,), MPa.
            conductance: Of each node, from `conductance`.

        Raises:
            HeatError: the bodies are hotter or colder than friction and their boundaries can make them.
        """
        after, terms = self.conduct(state, phase, pressure, conductance)
        self.check_bounds(state, after, float(terms[0] - terms[1]))
        return after, terms

    def conduct(self, state: HeatState, phase: int, pressure: Array, conductance: Array) -> tuple[HeatState, Array]:
        """Return the state after a part of a half-cycle, within its bounds or not, and the balance."""
        values, terms, surfaces = self._conduct(self.on_bases(state).values, phase, pressure, conductance, sources=True)
        return HeatState(self.bases, values, surfaces=surfaces), terms * self.thickness

    def check_bounds(self, before: HeatState, after: HeatState, made: float) -> None:
        """Hold the heat of the bodies against what can have entered them.

        By the maximum principle friction raises the heat above the hottest boundary or initial temperature by
        no more than its own, and nothing cools below the coldest of them.

        Args:
            before, after: A half-cycle.
            made: Heat of friction in it that debris has not taken, mJ.

        Raises:
            HeatError: it is out of these bounds.
        """
        if self._steady or not all(side.bounded for side in self.sides):
            return
        start, end = (
            sum(balance[0] for balance in self._balances(self.on_bases(state).values, sources=True))
            for state in (before, after)
        )
        self._led(partial(self._check_bounds, start, end, made / self.thickness))

    def change(
        self, phase: int, conductance: Array, changes: Array | None = None, pressure: Array | None = None
    ) -> tuple[Array, Array]:
        """Return the changes of the coordinates at the end of a half-cycle, (dim, k), and of its heat terms.

        Args:
            phase: Which of the motion's phases.
            conductance: Of each node.
            changes: Of the coordinates at its start (dim, k); by default none.
            pressure: Changes of the pressure (n, k), MPa; by default none.
        """
        columns = next((a.shape[1] for a in (changes, pressure) if a is not None), 0)
        if changes is None:
            changes = np.zeros((sum(len(basis) for basis in self.bases), columns))
        if pressure is None:
            pressure = np.zeros((len(conductance), columns))
        values, terms, _ = self._conduct(changes, phase, pressure, conductance, sources=False)
        return values, terms * self.thickness

    def _conduct(
        self, values: Array, phase: int, pressure: Array, conductance: Array, *, sources: bool
    ) -> tuple[Array, Array, tuple[Array, Array] | None]:
        """Return the coordinates at the end, the heat terms, and the contact temperatures where they hold more.

        Args:
            values: Coordinates at the start (dim,), or without sources their changes (dim, k).
            pressure: (n,), or its changes (n, k).
            sources: Whether there is more than changes.
        """
        if self.reduced and len(conductance) <= FEW:
            return self._conduct_few(values, phase, pressure, conductance, sources=sources)
        terms: Array = np.zeros((len(TERMS), *pressure.shape[1:]))
        heated: Array = np.zeros_like(pressure)
        entered = [np.zeros_like(pressure), np.zeros_like(pressure)]
        surfaces = None
        for plan in self.plans[phase]:
            kinds = (plan.punch, plan.strip)
            heat = (self.friction[phase] * plan.speed * pressure.T).T
            starts: Array = np.zeros_like(values)
            reached: Array = np.zeros_like(values)
            for counts in self._stages:
                ends, fluxes, _ = self._stage(kinds, values, heat, conductance, sources=sources)
                starts += counts * values
                reached += counts * ends
                heated += counts * plan.seconds * heat
                entered = [amount + counts * plan.seconds * q for amount, q in zip(entered, fluxes, strict=True)]
                values = values + counts * (ends - values)
            terms += self._kept(plan, starts, reached, sources=sources)
        terms += self._led(partial(self._made, heated, entered[0] + entered[1]))
        crossed = [self._crossing(conductance) @ q for q in entered]
        if sources and any(side.field.contact_responses is not None for side in self.sides):
            surfaces = self._read(phase, values, fluxes)
        return values, np.concatenate([terms, crossed]), surfaces

    def _conduct_few(
        self, values: Array, phase: int, pressure: Array, conductance: Array, *, sources: bool
    ) -> tuple[Array, Array, tuple[Array, Array] | None]:
        """Return the result of `conduct` on small bases and of few nodes, whose stages are matrices."""
        heated = (self.friction[phase] * pressure.T).T
        slid = sum(self._stages) * sum(plan.speed * plan.seconds for plan in self.plans[phase])
        made = self._made(slid * heated, np.zeros_like(pressure))
        terms: Array = np.concatenate([made, np.zeros((len(CROSSING), *made.shape[1:]))])
        for plan in self.plans[phase]:
            stage = self._stage_of(plan, conductance)
            entering = stage.entering(plan.speed * heated, sources=sources)
            for counts in self._stages:
                begun = values
                ends, gained = stage.of(begun, entering, sources=sources)
                terms += counts * gained
                values = ends if counts == 1 else begun + counts * (ends - begun)
        if sources and any(side.field.contact_responses is not None for side in self.sides):
            return values, terms, self._read(phase, values, np.split(stage.fluxes(begun, entering), 2))
        return values, terms, None

    def _stage_of(self, plan: StepPlan, conductance: Array) -> Stage:
        """Return a stage of few nodes on small bases; kept for conductances met before."""
        kinds = (plan.punch, plan.strip)
        key = (*kinds, conductance.tobytes())
        if key not in self._few:
            if len(self._few) > max(LEAST, MEMORY // (48 * len(conductance) ** 2)):
                self._few.clear()
            if kinds not in self._prepared_few:
                self._prepared_few[kinds] = self._prepared_stage(plan)
            crossing = plan.seconds * self._crossing(conductance)
            self._few[key] = self._prepared_few[kinds].at(self._flux_map(kinds, conductance), crossing)
        return self._few[key]

    def _prepared_stage(self, plan: StepPlan) -> PreparedStage:
        """Return a stage on small bases, whatever conducts."""
        of_kinds = list(zip(self.sides, (plan.punch, plan.strip), strict=True))
        motions = [motion for side, kind in of_kinds if (motion := side.field.propagation(kind)) is not None]
        every = np.eye(sum(len(basis) for basis in self.bases))
        none = np.zeros_like(every)
        by_start, by_end = (self._kept(plan, *ends, sources=False) for ends in ((every, none), (none, every)))
        each = plan.seconds * np.eye(len(self.weights))
        by_flux = self._made(np.zeros((len(each), 2 * len(each))), np.hstack([each, each]))
        constant = np.asarray(self._kept(plan, none[0], none[0], sources=True) / sum(self._stages), dtype=float)
        ledger = HeatBalance(by_start, by_end, by_flux, constant)
        return PreparedStage(motions, [side.contacts[kind] for side, kind in of_kinds], ledger, self.heat.ambient)

    @property
    def _stages(self) -> tuple[float, ...]:
        """Weight of each stage of a step."""
        return (1.0,) if self._steady else (EARLIER, 1.0)

    def _read(self, phase: int, values: Array, fluxes: list[Array]) -> tuple[Array, Array]:
        """Return the temperatures of both contact surfaces at the end of a phase, from the fluxes of its last step."""
        readings = [side.readings[phase] for side in self.sides]
        first, second = (
            reading.contact(part) + (0.0 if reading.left_out is None else reading.left_out @ q)
            for reading, part, q in zip(readings, self._parts(values), fluxes, strict=True)
        )
        return first, second

    def _surfaces(self, kinds: tuple[int, int], bare: list[Array], fluxes: list[Array]) -> tuple[Array, Array]:
        """Return the temperatures of both contact surfaces at the end of a step."""
        first, second = (
            free + responses[kind] @ q
            for free, responses, kind, q in zip(bare, self._contact_responses, kinds, fluxes, strict=True)
        )
        return first, second

    def _stage(
        self,
        kinds: tuple[int, int],
        values: Array,
        heat: Array,
        conductance: Array,
        *,
        sources: bool,
        further: Array | None = None,
    ) -> tuple[Array, list[Array], list[Array]]:
        """Return the coordinates at the end of a stage, the fluxes q_1 and q_2, and surface temperatures without them.

        Args:
            further: Further fluxes into both (2 n, k).
        """
        free = [
            side.field.advance(kind, part, sources=sources)
            for side, kind, part in zip(self.sides, kinds, self._parts(values), strict=True)
        ]
        bare = [
            side.contacts[kind](part) if sources else side.contacts[kind].of_changes(part)
            for side, kind, part in zip(self.sides, kinds, free, strict=True)
        ]
        ambient = self.heat.ambient if sources else 0.0
        both = self._led(lambda: self._flux_map(kinds, conductance).of(np.concatenate(bare), heat, ambient))
        fluxes = [both[: len(heat)], both[len(heat) :]]
        if further is not None:
            fluxes = [q + part for q, part in zip(fluxes, np.split(further, 2), strict=True)]
        ends = [
            part + side.field.responses[kind] @ q
            for part, side, kind, q in zip(free, self.sides, kinds, fluxes, strict=True)
        ]
        return np.concatenate(ends), fluxes, bare

    def _balances(self, values: Array, *, sources: bool) -> list[Array]:
        """Return the terms of both bodies in the balance of heat."""
        return [
            side.balance(part) if sources else side.balance.of_changes(part)
            for side, part in zip(self.sides, self._parts(values), strict=True)
        ]

    def _check_bounds(self, start: float, end: float, friction: float) -> None:
        """Hold the heat stored at both ends against that of friction, all per thickness.

        Raises:
            HeatError: it is out of bounds.
        """
        coldest, hottest = (pick(side.extremes[k] for side in self.sides) for k, pick in enumerate((min, max)))
        capacity = sum(side.capacity for side in self.sides)
        span, least = capacity * (hottest - coldest), capacity * coldest
        slack = OVERSHOOT * abs(friction) + DRIFT * (abs(start - least) + span)
        if end - start <= abs(friction) + span + slack and end - least >= -slack:  # not so for NaN
            return
        mean = end / capacity
        raise HeatError(
            f"the heat has failed, not the contact: the bodies are at {mean:.4g} K in the mean after a half-cycle. "
            f"Friction can warm them by {abs(friction) / capacity:.3g} K. Without it they are between {coldest:.4g} "
            f"and {hottest:.4g} K. "
            'Set heat.operator = "full", reduce heat.reduction_tolerance, or increase heat.steps'
        )

    def by_conductance(self, phase: int, state: HeatState, pressure: Array, conductance: Array) -> Array:
        """Return the change at the end of a half-cycle for each node's change of conductance (dim, n).

        The rate of kappa (1 - gamma_d) Q - q_1 = h_c (theta_1 - theta_2): where h_c changes by one unit,
        theta_1 - theta_2 is missing in q_1.

        Args:
            phase, state, pressure, conductance: As of `half_cycle`.
        """
        n, values = len(conductance), self.on_bases(state).values
        conducts = np.isfinite(conductance)
        changes: Array = np.zeros((len(values), n))
        for plan in self.plans[phase]:
            kinds = (plan.punch, plan.strip)
            heat = self.friction[phase] * plan.speed * pressure
            inverse = FluxFactor(self._exchanged(kinds, conductance)).solve(np.eye(2 * n, n))
            for counts in self._stages:
                ends, fluxes, bare = self._stage(kinds, values, heat, conductance, sources=True)
                first, second = self._surfaces(kinds, bare, fluxes)
                further = inverse * np.where(conducts, second - first, 0.0)
                after, _, _ = self._stage(kinds, changes, np.zeros((n, n)), conductance, sources=False, further=further)
                values, changes = (a + counts * (b - a) for a, b in ((values, ends), (changes, after)))
        return changes

    def _kept(self, plan: StepPlan, starts: Array, reached: Array, *, sources: bool) -> Array:
        """Return the terms of heat stored and lost in a step, per thickness; of a steady state in a second.

        Args:
            plan: The step.
            starts, reached: The coordinates at the start and at the end of its stages, summed as often as each counts.
            sources: Whether there is more than changes.
        """
        counted, constants = sources * sum(self._stages), [side.balance.constant for side in self.sides]

        def rows(values: Array) -> list[Array]:
            balances = self._balances(values, sources=False)
            return [
                balance + counted * _down(balance.ndim - 1, constant)
                for balance, constant in zip(balances, constants, strict=True)
            ]

        before, after = rows(starts), rows(reached)
        return self._led(partial(self._account, plan, before, after, counted))

    def _account(self, plan: StepPlan, before: Sequence[Array], after: Sequence[Array], counted: float) -> Array:
        """Return these terms from the rows of the balances.

        Args:
            plan: The step.
            before, after: Of both bodies, at the start and at the end of the stages.
            counted: Weights of the constant parts of a stage in a step; 0 for changes.
        """
        stored, convected, held, carried = (np.zeros(after[0].shape[1:]) for _ in range(4))
        seconds = plan.seconds
        for side, kind, a, b in zip(self.sides, (plan.punch, plan.strip), after, before, strict=True):
            if not self._steady:
                stored = stored + a[0] - b[0]
            convected = convected + seconds * (a[1] - counted * side.ambient_loss)
            held = held - seconds * (a[2 + 3 * kind] - b[3 + 3 * kind] - counted * side.held_source[kind])
            carried = carried + seconds * (a[4 + 3 * kind] - counted * side.brought[kind])
            if side.gives_back:
                convected = convected - seconds * a[kind - len(side.contacts)]
        none = np.zeros_like(stored)
        return np.array([none, none, stored, convected, held, carried])

    def _made(self, heat: Array, entered: Array) -> Array:
        """Return the terms of the heat made at the contact, per thickness; of a steady state a second.

        Args:
            heat: Of friction over all stages, as often as each counts (n,) or (n, k), mJ/mm².
            entered: By the fluxes into both bodies alike.
        """
        friction = self.weights @ heat
        debris, none = self.heat.debris * friction, np.zeros_like(friction)
        # At open nodes the surfaces lose heat to the surroundings: what of the friction heat did not go in.
        lost = friction - debris - self.weights @ entered
        return np.array([friction, debris, none, lost, none, none])

    def _crossing(self, conductance: Array) -> Array:
        """Return the weights of the fluxes that cross the contact, which they do where it conducts (n,), mm."""
        return np.where(np.isnan(conductance), 0.0, self.weights)

    def step_map(self, kinds: tuple[int, int], conductance: Array) -> StepMap:
        """Return the map of the coordinates over a step; for both on a small basis.

        Args:
            kinds: Which prepared step each body takes.
            conductance: Of each node.
        """
        if kinds not in self._prepared:
            fields = [side.field for side in self.sides]
            contacts = [side.contacts[kind] for side, kind in zip(self.sides, kinds, strict=True)]
            self._prepared[kinds] = PreparedStep(fields, kinds, contacts, self.heat.ambient)
        single = self._prepared[kinds].map(self._flux_map(kinds, conductance))
        return single if len(self._stages) == 1 else single.twice(EARLIER)

    def _flux_map(self, kinds: tuple[int, int], conductance: Array) -> FluxFactor | FluxUpdate:
        """Return the map to the fluxes; kept for conductances met before."""
        key = (*kinds, conductance.tobytes())
        if key not in self._flux_maps:
            if len(self._flux_maps) > max(LEAST, MEMORY // (48 * len(conductance) ** 2)):
                self._flux_maps.clear()
            self._flux_maps[key] = self._make_flux_map(kinds, conductance)
        return self._flux_maps[key]

    def _make_flux_map(self, kinds: tuple[int, int], conductance: Array) -> FluxFactor | FluxUpdate:
        step = self._exchanged(kinds, conductance)
        if len(conductance) <= FEW:
            return FluxFactor(step)
        last = self._flux_factors.get(kinds)
        factor = None if last is None else last.updated(step)
        if factor is None:
            self._flux_maps = {key: value for key, value in self._flux_maps.items() if key[:2] != kinds}
            self._flux_factors.pop(kinds, None)
            factor = self._flux_factors[kinds] = FluxFactor(step)
        return factor

    def _exchanged(self, kinds: tuple[int, int], conductance: Array) -> Exchanged:
        first, second = (responses[k] for responses, k in zip(self._contact_responses, kinds, strict=True))
        heat = self.heat
        return Exchanged((first, second), conductance, heat.convection, heat.partition, heat.debris)


def _given_conductance(heat: Heat) -> tuple[Callable[[Array, int], Array], bool]:
    """Return h_c by the pressure (n,), N/(mm s K), as a table of heat gives it, and whether it depends on that."""
    if heat.conductance_per_pressure is None:
        constant = np.inf if isinstance(heat.conductance, str) else float(heat.conductance)  # a layer's comes later
        return lambda pressure, _phase: np.full(len(pressure), constant), False
    h1, h2 = heat.conductance_per_pressure
    return lambda pressure, _phase: np.maximum(pressure, 0.0) * (h1 * h2 / (h1 + h2)), True


def _bases(sides: Sequence[Side]) -> tuple[Basis, ...]:
    """Return the bases of the coordinates of punch and strip."""
    return tuple(side.field.basis for side in sides)


class Isothermal(HeatExchange):
    """Bodies without heat, at one temperature: no coordinates, no gaps, nothing that conducts.

    Args:
        phases, nodes: Of the motion, and of the contact.
        temperature: Of both bodies, K.
    """

    conducts = False
    by_pressure = False
    ambient = 0.0

    def __init__(self, phases: int, nodes: int, temperature: float) -> None:
        self.plans: list[list[StepPlan]] = [[] for _ in range(phases)]
        self.bases, self.friction = (), np.zeros((phases, nodes))
        self.fineness = Fineness()
        self._initial, self._surface = HeatState((), np.zeros(0)), np.full(nodes, temperature)

    @property
    def reduced(self) -> bool:
        """Whether every rank could continue alone: it has no temperatures of all nodes."""
        return True

    def through(self, of_layer: Callable[[Array, int], Array] | None) -> HeatExchange:  # noqa: ARG002
        """Return the exchange itself, as nothing conducts."""
        return self

    def on_bases(self, state: HeatState | None) -> HeatState:  # noqa: ARG002
        """Return the initial state, which is the only one."""
        return self.initial()

    def gap(self, state: HeatState, phase: int = -1) -> Array:  # noqa: ARG002
        """Return the gap that expansion opens (n,), mm: none."""
        return np.zeros(len(self._surface))

    def gap_change(self, changes: Array, phase: int = -1) -> Array:  # noqa: ARG002
        """Return the gap of changes of no coordinates (0, k), mm: none."""
        return np.zeros((len(self._surface), changes.shape[1]))

    def contact_temperatures(self, state: HeatState, phase: int = -1) -> tuple[Array, Array]:  # noqa: ARG002
        """Return the temperatures of both surfaces (n,), K."""
        return self._surface, self._surface

    def contact_changes(self, changes: Array, phase: int = -1) -> tuple[Array, Array]:
        """Return the changes of both by changes of no coordinates (0, k): none."""
        none = self.gap_change(changes, phase)
        return none, none

    def conductance(self, pressure: Array, phase: int = 0) -> Array:  # noqa: ARG002
        """Return h_c of each node (n,), N/(mm s K): none."""
        return np.zeros(len(pressure))

    def change(
        self,
        phase: int,  # noqa: ARG002
        conductance: Array,  # noqa: ARG002
        changes: Array | None = None,
        pressure: Array | None = None,
    ) -> tuple[Array, Array]:
        """Return the changes of no coordinates (0, k) and of the heat terms: none."""
        columns = next((a.shape[1] for a in (changes, pressure) if a is not None), 0)
        return np.zeros((0, columns)), np.zeros((len(TERMS) + len(CROSSING), columns))


def _down(further: int, constants: Array) -> Array:
    """Return constants (rows,) for arrays with so many further dimensions."""
    return constants.reshape(-1, *(1,) * further)
