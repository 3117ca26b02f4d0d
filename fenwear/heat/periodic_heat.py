"""Heat over whole cycles: jumps over N of them, and their periodic end.

With constant pressures and the same conducting nodes, each phase of a cycle maps the reduced state
linearly, s' = P s + b + Q p, and so does the cycle, s' = P_c s + b_c + Q_c (p_+, p_-). N cycles in
one implicit Euler step are (I + N (I - P_c)) s_1 = s_0 + N (b_c + Q_c p), whose fixed point is the
periodic state itself, which is N -> infinity: (I - P_c) s = b_c + Q_c p.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, reduce
from itertools import accumulate, groupby

import numpy as np
import scipy.linalg

from fenwear.common.arrays import Array
from fenwear.heat.heat_exchange import HeatExchange
from fenwear.heat.stage import StepMap

KEPT, MEMORY = 8, 10**9  # cycles of different conducting nodes that are kept, and bytes that they may take


def cycle_memory(exchange: HeatExchange) -> float:
    """Return the bytes of the maps of a cycle's steps and of their parts, for one set of nodes."""
    dim, (phases, n) = sum(len(basis) for basis in exchange.bases), exchange.friction.shape
    kinds = [{(plan.punch, plan.strip) for plan in plans} for plans in exchange.plans]
    maps, prepared = sum(map(len, kinds)), len(set[tuple[int, int]]().union(*kinds))
    return 8.0 * dim * (maps * (dim + n) + prepared * (dim + 2 * n) + (2 * phases + 1) * dim)


class PhaseMap:
    """One phase: s' = propagator s + source + response p.

    Args:
        steps: Steps of the phase in their order, with the friction heat of unit pressures in each (n,).
    """

    def __init__(self, steps: Sequence[tuple[StepMap, Array]]) -> None:
        self.steps = steps

    @cached_property
    def propagator(self) -> Array:
        """From the state at its start (dim, dim)."""
        alike = [list(group) for _, group in groupby(self.steps, lambda step: id(step[0]))]
        powers = [np.linalg.matrix_power(group[0][0].propagator, len(group)) for group in alike]
        return np.asarray(reduce(lambda through, power: power @ through, powers))

    @cached_property
    def source(self) -> Array:
        """Without state and pressure (dim,)."""
        return self.after(np.zeros(len(self.steps[0][0].source)), np.zeros(len(self.steps[0][1])))

    @cached_property
    def response(self) -> Array:
        """From its pressure (dim, n): of few nodes, which ask for it; of many `after` costs less."""
        response: Array = np.zeros_like(self.steps[0][0].response)
        for step, friction in self.steps:
            response = step.propagator @ response + step.response * friction
        return response

    def after(self, state: Array, pressure: Array) -> Array:
        """Return the state at its end (dim,) from that at its start and its pressure (n,)."""
        heated: dict[int, Array] = {}  # steps there and back are of one kind
        for step, friction in self.steps:
            if id(step) not in heated:
                heated[id(step)] = step.response @ (friction * pressure)
            state = step.propagator @ state + step.source + heated[id(step)]
        return state


class Cycle:
    """The phases of a cycle one after the other.

    Attributes:
        maps: Of each phase.
    """

    def __init__(self, maps: Sequence[PhaseMap]) -> None:
        self.maps = maps
        self._end: JumpEnd | None = None  # the last one

    def end(self, cycles: float) -> JumpEnd:
        """Return the matrices of the end of a jump over so many cycles; the last are kept for further attempts."""
        if self._end is None or self._end.cycles != cycles:
            self._end = None  # its memory first
            self._end = JumpEnd(self.propagator, cycles)
        return self._end

    @cached_property
    def propagator(self) -> Array:
        """State after the cycle from that at its start without sources and pressures (dim, dim)."""
        return reduce(lambda through, phase_map: phase_map.propagator @ through, self.maps[1:], self.maps[0].propagator)

    @cached_property
    def through(self) -> list[Array]:
        """The map from the start to the end of each phase (m, dim, dim), for few phases and nodes."""
        return list(
            accumulate(
                (phase_map.propagator for phase_map in self.maps), lambda through, propagator: propagator @ through
            )
        )

    def states(self, state: Array, pressure: Array) -> list[Array]:
        """Return the states after each phase from that at the start (dim,) and the pressures (m, n)."""
        states = []
        for phase, phase_map in enumerate(self.maps):
            state = phase_map.after(state, pressure[phase])
            states.append(state)
        return states

    @cached_property
    def responses(self) -> list[Array]:
        """State after each phase from the pressures of all phases (dim, m n), m of them."""
        m, (dim, n) = len(self.maps), self.maps[0].response.shape
        responses: Array = np.zeros((dim, m, n))
        ends: list[Array] = []
        for phase, phase_map in enumerate(self.maps):
            for before in range(phase):
                responses[:, before] = phase_map.propagator @ responses[:, before]
            responses[:, phase] = phase_map.response
            ends.append(responses.reshape(dim, -1).copy())
        return ends


class JumpEnd:
    """The end of a jump as far as it does not depend on its begin.

    Args:
        propagator: State after a cycle from that at its start (dim, dim).
        cycles: Their number; infinitely many lead to the periodic state.
    """

    def __init__(self, propagator: Array, cycles: float) -> None:
        self.cycles, identity, endless = cycles, np.eye(len(propagator)), np.isinf(cycles)
        self._weight = 1.0 if endless else cycles
        self._factor = scipy.linalg.lu_factor(
            identity - propagator if endless else identity + cycles * (identity - propagator)
        )
        self._coupling: Array | None = None

    def state(self, start: Array, brought: Array) -> Array:
        """Return the state there (dim,) from that at the begin (dim,), and what a cycle brings to none (dim,)."""
        begun = np.zeros_like(start) if np.isinf(self.cycles) else start
        return np.asarray(scipy.linalg.lu_solve(self._factor, begun + self._weight * brought))

    def coupling(self, cycle: Cycle, gap_rows: Sequence[Array]) -> Array:
        """Return the thermal gap of each phase from the pressure of each phase (m, n, m, n), mm/MPa; made once.

        Args:
            cycle: Its own.
            gap_rows: Thermal gap of the coordinates at the end of each phase (n, dim), mm.
        """
        if self._coupling is None:
            m, n, responses = len(cycle.maps), len(gap_rows[0]), cycle.responses
            end = scipy.linalg.lu_solve(self._factor, self._weight * responses[-1])
            phases = zip(gap_rows, cycle.through, responses, strict=True)
            gaps = np.array([rows @ (through @ end + response) for rows, through, response in phases])
            self._coupling = gaps.reshape(m, n, m, n)
        return self._coupling


class CycleJump:
    """End of a jump as a function of the pressures of its phases.

    Args:
        start: The state at its begin (dim,).
        cycle: The cycle.
        cycles: Their number; infinitely many lead to the periodic state.
        gap_rows: Thermal gap of the coordinates at the end of each phase (n, dim), mm.
        gap_constants: The same where they are zero (n,), mm.
    """

    def __init__(
        self,
        start: Array,
        cycle: Cycle,
        cycles: float,
        gap_rows: Sequence[Array],
        gap_constants: Sequence[Array],
    ) -> None:
        self._start, self._cycle, self._end = start, cycle, cycle.end(cycles)
        self._gap_rows, self._gap_constants = gap_rows, gap_constants

    def state(self, pressure: Array) -> Array:
        """Return the state at the end of the jump (dim,) for pressures (m, n)."""
        return self._end.state(self._start, self._cycle.states(np.zeros(len(self._start)), pressure)[-1])

    def gaps(self, pressure: Array) -> Array:
        """Return the thermal gap at the end of each phase of the cycle that starts there (m, n), mm, at pressures."""
        states = self._cycle.states(self.state(pressure), pressure)
        phases = zip(self._gap_rows, states, self._gap_constants, strict=True)
        return np.array([rows @ state + constant for rows, state, constant in phases])

    @cached_property
    def gap(self) -> Array:
        """The thermal gaps without pressure."""
        return self.gaps(np.zeros((len(self._cycle.maps), len(self._gap_constants[0]))))

    def coupling(self, factors: Array) -> Array | None:
        """Return the thermal gap of each phase from the pressure of each phase (m, n, m, n), mm/MPa; None for none.

        Args:
            factors: Factor of pressures for the heat (m, n).
        """
        return self._end.coupling(self._cycle, self._gap_rows) * factors


class CycleHeat:
    """The maps of a cycle on the reduced state of both bodies, of `dim` coordinates.

    Attributes:
        gap_rows: Thermal gap of the coordinates at the end of each phase (n, dim), mm.
    """

    def __init__(self, exchange: HeatExchange) -> None:
        self.exchange = exchange
        self.dim = sum(len(basis) for basis in exchange.bases)
        every, none = np.eye(self.dim), exchange.at(np.zeros(self.dim))
        self.gap_rows = [exchange.gap_change(every, phase) for phase in range(len(exchange.plans))]
        self._gap_constants = [exchange.gap(none, phase) for phase in range(len(exchange.plans))]
        self._cycles: dict[bytes, Cycle] = {}
        self._phases: dict[tuple[int, bytes], PhaseMap] = {}

    def initial(self) -> Array:
        """Return the initial state (dim,)."""
        return self.exchange.initial().values

    def conductances(self, pressure: Array) -> Array:
        """Return the conductance of each phase's nodes (m, n)."""
        return np.array([self.exchange.conductance(pressure[phase], phase) for phase in range(len(pressure))])

    def cycle(self, conductances: Array) -> Cycle:
        """Return the cycle for the conductances of its phases (m, n); the last few are kept."""
        key = conductances.tobytes()
        if key not in self._cycles:
            (m, n), dim = conductances.shape, self.dim
            steps = len({(plan.punch, plan.strip) for plans in self.exchange.plans for plan in plans})
            each = 8 * dim * ((2 * m + 1) * dim + steps * (dim + n))
            if len(self._cycles) > min(KEPT, MEMORY // each):
                self._cycles.clear()
                self._phases.clear()
            self._cycles[key] = Cycle([self._phase_map(phase, conductances[phase]) for phase in range(m)])
        return self._cycles[key]

    def states(self, state: Array, pressure: Array, conductances: Array) -> list[Array]:
        """Return the states (dim,) before, between and after the phases of a cycle.

        Args:
            state: Before.
            pressure: Of the phases (m, n), MPa.
            conductances: Of the phases (m, n).
        """
        return [state, *self.cycle(conductances).states(state, pressure)]

    def _phase_map(self, phase: int, conductance: Array) -> PhaseMap:
        """Return the map of a phase, which cycles with other conductances in other phases share."""
        key, exchange = (phase, conductance.tobytes()), self.exchange
        if key in self._phases:
            return self._phases[key]
        maps: dict[tuple[int, int], StepMap] = {}
        steps = []
        for plan in exchange.plans[phase]:
            kinds = (plan.punch, plan.strip)
            if kinds not in maps:
                maps[kinds] = exchange.step_map(kinds, conductance)
            steps.append((maps[kinds], exchange.friction[phase] * plan.speed))
        self._phases[key] = PhaseMap(steps)
        return self._phases[key]

    def jump(self, state: Array, cycles: float, conductances: Array) -> CycleJump:
        """Return the end of `cycles` cycles from `state`; infinitely many give the periodic state."""
        return CycleJump(state, self.cycle(conductances), cycles, self.gap_rows, self._gap_constants)


class ColdJump(CycleJump):
    """A jump of bodies without heat: no coordinates, no gaps."""

    def __init__(self, phases: int, nodes: int) -> None:
        self._none = np.zeros((phases, nodes))

    def state(self, pressure: Array) -> Array:  # noqa: ARG002
        """Return the state at its end: no coordinates."""
        return np.zeros(0)

    def gaps(self, pressure: Array) -> Array:  # noqa: ARG002
        """Return the thermal gap at the end of each phase (m, n), mm: none."""
        return self._none

    @property
    def gap(self) -> Array:
        """The thermal gaps without pressure: none."""
        return self._none

    def coupling(self, factors: Array) -> Array | None:  # noqa: ARG002
        """Return no coupling."""
        return None


class ColdCycles(CycleHeat):
    """Cycles of bodies without heat."""

    def jump(self, state: Array, cycles: float, conductances: Array) -> CycleJump:  # noqa: ARG002
        """Return the end of cycles."""
        return ColdJump(*conductances.shape)

    def states(self, state: Array, pressure: Array, conductances: Array) -> list[Array]:  # noqa: ARG002
        """Return no coordinates before, between and after the phases."""
        return [state] * (len(pressure) + 1)


def cycles_of(exchange: HeatExchange) -> CycleHeat:
    """Return the heat of whole cycles."""
    return (CycleHeat if exchange.conducts else ColdCycles)(exchange)
