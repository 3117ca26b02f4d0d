"""All phases of a cycle with what depends on their pressures: heat, the nodes that conduct, friction and wear."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fenwear.algebra.fixed_point import fixed_point
from fenwear.common.arrays import Array, Mask
from fenwear.common.errors import GRAZING, ConvergenceError
from fenwear.common.parallel import check_memory
from fenwear.contact import ContactState
from fenwear.heat.periodic_heat import CycleHeat, CycleJump, cycle_memory, cycles_of
from fenwear.heat.temperature import HeatState
from fenwear.laws import LayerEvolution
from fenwear.laws.friction import ContactConditions
from fenwear.laws.law_states import Evolution, Held
from fenwear.laws.wear import WornDepths
from fenwear.steps.run_state import pressure_scale
from fenwear.system import Tribosystem, heating_friction, with_reduced_heat

FLAT = 1e-9  # mm: depths below it count as none
MANY, LARGE = 300, 4000  # contact nodes, and pressures of all phases, above which heat is lagged
SMOOTH = 15  # changes of pressure that are combined: the heat of few patterns is not small
EDGES = 2  # times that contact is solved for its own edges in a step
CLOSE = 1e-9  # change of pressure and temperature over their largest that ends the iterations
DISAGREE = (
    'contact, conducting nodes and coefficients did not converge. Set heat.conducting = "nominal", or use weaker '
    "dependences"
)

# Contact of all phases for a thermal gap (m, n) and its coupling (m, n, m, n), None for none, from a start.
SolveContact = Callable[[Array, Array | None, ContactState], ContactState]
# Takes friction and wear at the conditions of the phases, and what these do to the states that laws remember.
Take = Callable[[Sequence[ContactConditions], Evolution], None]


def cycle_heat(system: Tribosystem) -> CycleHeat:
    """Return the heat of whole cycles."""
    return cycles_of(with_reduced_heat(system).exchange)


def end_temperatures(heat: CycleHeat, begin: Array, pressure: Array, conductances: Array) -> tuple[Array, HeatState]:
    """Return the temperatures of both surfaces at the end of each phase (m, 2, n), K, and those of the bodies then.

    Args:
        heat: Of cycles.
        begin: Temperatures at the start (dim,).
        pressure: Of the phases (m, n), times what `heat` leaves out of friction.
        conductances: Of their nodes (m, n).
    """
    states = [heat.exchange.at(coordinates) for coordinates in heat.states(begin, pressure, conductances)[1:]]
    surfaces = [heat.exchange.contact_temperatures(state, phase) for phase, state in enumerate(states)]
    return np.array(surfaces), states[-1]


def check_cycle_memory(system: Tribosystem) -> None:
    """Make sure that the maps of the heat's steps in a cycle fit into the memory; collective.

    Raises:
        CaseError: they do not.
    """
    exchange = with_reduced_heat(system).exchange
    subject = "the map of each heat step in a cycle, which jumps and steady states keep,"
    advice = 'Use fewer `motion.positions` or `heat.steps`, larger elements, or `run.integration = "implicit"`.'
    check_memory(system.bodies.comm, cycle_memory(exchange), "heat", subject, advice)


@dataclass(frozen=True)
class DepthEvolution:
    """The worn depths of an implicit step from its pressures.

    Attributes:
        before: Depths that it begins with.
        cycles: Length of the step.
        wear: Wear of a cycle at pressures (m, n), at the last coefficients.
        half_cycles: Done since the start of the run, at its end.
        follows: Whether coefficients depend on depths, states or distance.
    """

    before: WornDepths
    cycles: float
    wear: Callable[[Array], WornDepths]
    half_cycles: float
    follows: bool = False

    def depths(self, pressure: Array) -> list[Array]:
        """Return the depths of punch and strip at its end, at these pressures."""
        worn = self.before + self.wear(pressure).times(self.cycles)
        return [worn.punch, worn.strip]


@dataclass(frozen=True)
class Solved:
    """Result of `Coupled.solve`.

    Attributes:
        contact: Of all phases.
        temperature: At the start of their cycle (dim,).
        conductances: By which these temperatures have come about (m, n), to be used wherever heat is followed through
            the cycle: pressures that are nothing but for rounding do not say which of their nodes conduct.
    """

    contact: ContactState
    temperature: Array
    conductances: Array


@dataclass(frozen=True)
class _Unknowns:
    """Pressures, and where coefficients depend on them temperatures and depths, in one vector.

    Attributes:
        units: Of each kind, which make them of one size: that is what their combination looks at.
        cuts: Where the kinds begin.
    """

    units: Sequence[float]
    cuts: NDArray[np.int64]

    @classmethod
    def like(cls, parts: Sequence[Array], scale: float, *, warm: bool) -> _Unknowns:
        """Return the layout of these parts, the pressures first, and temperatures next where it is warm."""
        least = [1.0, *([1.0] if warm else []), FLAT, FLAT, FLAT]
        units = [scale / max(float(np.abs(part).max()), low) for part, low in zip(parts, least, strict=False)]
        return cls([1.0, *units[1:]], np.cumsum([part.size for part in parts])[:-1])

    def joined(self, parts: Sequence[Array]) -> Array:
        """Return the vector."""
        return np.concatenate([part * unit for part, unit in zip(parts, self.units, strict=True)])

    def parted(self, x: Array) -> list[NDArray[Any]]:
        """Return the parts of a vector."""
        return [part / unit for part, unit in zip(np.split(x, self.cuts), self.units, strict=True)]

    def close(self, change: Array, x: Array) -> bool:
        """Return whether pressures, and the temperatures and depths behind them, change by rounding only."""
        return all(
            float(np.abs(part).max()) <= CLOSE * max(float(np.abs(value).max()), 1e-300)
            for part, value in zip(np.split(change, self.cuts), np.split(x, self.cuts), strict=True)
            if part.size
        )


def touching(pressure: NDArray[Any]) -> Array:
    """Return pressures with zeros where they are none but for `CLOSE`.

    A combination of pressures tends to nothing at a node that opens and never gets there: the node would conduct on.
    """
    return np.where(pressure > CLOSE * pressure.max(), pressure, 0.0)


def _grazing(pressure: NDArray[Any]) -> Array:
    """Return the pressures: a node whose pressure tends to nothing conducts on.

    There may be no other state: where a node that conducts is opened by the heat and one that does not is closed,
    neither lasts (J. R. Barber, J. Elasticity 8, 1978, 409).
    """
    return np.asarray(pressure)


class Coupled:
    """Contact of all phases of a cycle at the heat and the coefficients of its own end.

    Args:
        system: The assembled problem.
        take: Takes friction and wear at the conditions of the phases, before contact is solved.

    Attributes:
        heat: Of whole cycles. Linear in mu p: where mu is not constant its own mu is 1.
        mu: Factor of the pressures for `heat` (m, n): what friction heats.
        held: States that laws remember, at the end of a step or at rest; None without, and before.
    """

    def __init__(self, system: Tribosystem, take: Take) -> None:
        self.system, self._take = system, take
        self.held: Held | None = None
        self._touching: Mask | None = None  # which nodes do in each phase, for the edges of the contact
        self._passing: LayerEvolution | None = None  # at the conditions last taken, where debris is felt by them
        self.heat = cycle_heat(system)
        self._warm = self.heat.dim > 0 and not system.phases.constant
        self._felt = system.layers.debris.present and system.laws.asks("debris")
        self.mu: Array = np.ones((len(system.motion.phases), len(system.pair.weights)))
        if not system.laws.friction.constant:
            self.heat = cycles_of(self.heat.exchange.with_friction(self.mu))

    def solve(
        self,
        temperature: Array,
        cycles: float,
        start: ContactState,
        solve: SolveContact,
        passing: DepthEvolution,
    ) -> Solved:
        """Return contact, and temperature at the start of its cycle, `cycles` cycles on in one implicit step.

        The unknowns are the pressures, and where coefficients depend on them the temperatures at the start of each
        phase and the worn depths. Without such coefficients the solution is exact once the same nodes conduct.

        Args:
            temperature: Before (dim,).
            cycles: Their number; infinitely many give the periodic temperature.
            start: Where contact starts from.
            solve: Contact at the friction and wear last taken.
            passing: Depths from the pressures.

        Raises:
            ConvergenceError: contact did not converge, or nodes open and close in turn.
        """
        self.held = None
        if self.system.laws.edges is None:
            return self._at_edges(temperature, cycles, start, solve, passing)
        # Of the contact that was found before: nodes that open and close as edges move would never come to an end.
        for _ in range(EDGES):
            self._touching = start.pressure > 0
            solution = self._at_edges(temperature, cycles, start, solve, passing)
            start = solution.contact
            if np.array_equal(start.pressure > 0, self._touching):
                break
        return solution

    def _at_edges(
        self,
        temperature: Array,
        cycles: float,
        start: ContactState,
        solve: SolveContact,
        passing: DepthEvolution,
    ) -> Solved:
        """Return the result of `solve`; where it does not converge, touching nodes of little pressure conduct, too."""
        try:
            return self._solve(temperature, cycles, start, solve, passing, touching)
        except ConvergenceError:
            if not self.heat.dim:
                raise
        solution = self._solve(temperature, cycles, start, solve, passing, _grazing)
        self.system.remedies.note(GRAZING)
        return solution

    def _solve(
        self,
        temperature: Array,
        cycles: float,
        start: ContactState,
        solve: SolveContact,
        passing: DepthEvolution,
        conducting: Callable[[NDArray[Any]], Array],
    ) -> Solved:
        """Return the solution where nodes of these pressures conduct."""
        heat, constant, shape, contact = self.heat, self.system.phases.constant, start.pressure.shape, start
        known: tuple[bytes, CycleJump] | None = None
        # From what was worn before: where wear grows with the depth there may be a deeper solution, beyond a jump.
        depths = [passing.before.punch, passing.before.strip] if passing.follows else []
        lain = [self.system.layers.lies(passing.before)] if self._felt else []
        parts = self._parts(start.pressure, temperature, heat.conductances(start.pressure), depths + lain)
        unknowns = _Unknowns.like(parts, pressure_scale(self.system, start.pressure), warm=self._warm)

        def advance(x: Array) -> tuple[Array, Solved, bool]:
            nonlocal contact, known
            now = unknowns.parted(x)
            pressure = now[0].reshape(shape)
            if not constant:
                surfaces = now[1] if self._warm else np.zeros(0)
                depths = now[:-1] if self._felt else now
                worn = passing.before
                if passing.follows:
                    worn = replace(worn, punch=depths[-2], strip=depths[-1])
                lies = now[-1] if self._felt else None
                self._update(pressure, surfaces.reshape(-1, 2, shape[1]), worn, passing, lies)
            conductances = heat.conductances(conducting(pressure))
            key = conductances.tobytes()
            if known is None or known[0] != key:
                known = (key, heat.jump(temperature, cycles, conductances))
            end = known[1]
            contact = self._in_step(end, contact, solve)
            state = end.state(self.mu * contact.pressure)
            same = np.array_equal(heat.conductances(conducting(contact.pressure)), conductances, equal_nan=True)
            worn_off = passing.depths(contact.pressure) if passing.follows else []
            lying = [self._debris(contact.pressure, passing)] if self._felt else []
            parts = self._parts(contact.pressure, state, conductances, worn_off + lying)
            return unknowns.joined(parts), Solved(contact, state, conductances), same and constant

        return fixed_point(advance, unknowns.joined(parts), unknowns.close, DISAGREE, team=self.system.team)

    def _parts(self, pressure: Array, state: Array, conductances: Array, depths: list[Array]) -> list[Array]:
        """Return the unknowns: pressures, and where coefficients depend on them temperatures, depths and debris."""
        parts: list[Array] = [pressure.ravel()]
        if self._warm:
            parts.append(self.surfaces(state, pressure, conductances).ravel())
        return parts + depths

    def _in_step(self, end: CycleJump, start: ContactState, solve: SolveContact) -> ContactState:
        """Return contact at the heat of its own pressures, which is a smooth and mostly small part of the gap.

        Contact of many nodes is solved at the heat of pressures that are known, again and again: the factor without
        heat serves all of them, where one with heat is of all phases together.
        """
        shape = start.pressure.shape
        few = shape[1] <= MANY and shape[0] * shape[1] <= LARGE
        if few or not self.heat.dim:
            return solve(end.gap, end.coupling(self.mu), start)
        contact = start

        def advance(x: Array) -> tuple[Array, ContactState, bool]:
            nonlocal contact
            contact = solve(end.gaps(self.mu * x.reshape(shape)), None, contact)
            return contact.pressure.ravel(), contact, False

        def close(change: Array, x: Array) -> bool:
            return float(np.abs(change).max()) <= CLOSE * max(float(np.abs(x).max()), 1e-300)

        try:
            return fixed_point(advance, start.pressure.ravel(), close, DISAGREE, depth=SMOOTH, team=self.system.team)
        except ConvergenceError:  # heat that is no small part
            return solve(end.gap, end.coupling(self.mu), start)

    def surfaces(self, state: Array, pressure: Array, conductances: Array) -> Array:
        """Return the contact temperatures of both bodies at the start of each phase (m, 2, n), K."""
        exchange, starts = self.heat.exchange, self.through(state, pressure, conductances)[:-1]
        return np.array(
            [exchange.contact_temperatures(exchange.at(start), phase - 1) for phase, start in enumerate(starts)]
        )

    def through(self, state: Array, pressure: Array, conductances: Array) -> list[Array]:
        """Return the temperatures (dim,) before, between and after the phases; arguments as of `CycleHeat.states`."""
        return self.heat.states(state, self.mu * pressure, conductances)

    def _debris(self, pressure: Array, passing: DepthEvolution) -> Array:
        """Return the thickness of the debris at the end of a step, at the conditions last taken."""
        assert self._passing is not None
        added = self._passing.debris_changes(pressure, passing.before, passing.cycles)[0]
        return self.system.layers.lies(passing.before) + passing.cycles * added

    def _update(
        self,
        pressure: NDArray[Any],
        surfaces: NDArray[Any],
        worn: WornDepths,
        passing: DepthEvolution,
        debris: NDArray[Any] | None,
    ) -> None:
        """Take the coefficients at these pressures and, where there are any, temperatures, depths and debris."""
        system = self.system
        pressure = np.maximum(pressure, 0.0)  # a combination of some may lie below
        shear = system.phases.ways.shear(pressure)
        conditions = [
            system.phases.conditions(
                k,
                p,
                (surfaces[k, 0], surfaces[k, 1]) if len(surfaces) else None,
                worn,
                passing.half_cycles,
                shear,
                None if self._touching is None else self._touching[k],
            )
            for k, p in enumerate(pressure)
        ]
        if debris is not None:
            lies, on_strip = np.maximum(debris, 0.0), system.layers.strip_carries
            facing = [pair.wear_interpolation @ lies if on_strip else lies for pair in system.sliding.pairs]
            conditions = [
                replace(condition, debris=debris) for condition, debris in zip(conditions, facing, strict=True)
            ]
        evolution = replace(system.phases.evolution(conditions, worn), near=self.held)
        conditions = list(self._remembering(evolution, passing))
        evolution = replace(evolution, near=self.held)
        self._take(conditions, evolution)
        if debris is not None:
            self._passing = system.phases.passing(system.phases.wear.phases(conditions), None, evolution, conditions)
        if not system.laws.friction.constant:
            friction = [system.laws.friction.values(state) for state in conditions]
            self.mu = np.array([heating_friction(system, mu, phase) for phase, mu in enumerate(friction)])

    def _remembering(self, evolution: Evolution, passing: DepthEvolution) -> Sequence[ContactConditions]:
        """Return the conditions of the phases with the states of laws at the end of a step."""
        if not self.system.layers.memory.names:
            return evolution.conditions
        before = self.system.layers.held(passing.before)
        self.held = evolution.implicit(before, passing.cycles)
        return evolution.around(self.held, (self.held - before).times(1 / passing.cycles))
