"""Heat over whole cycles: jumps over N of them, and their periodic end.

With constant pressures and the same conducting nodes, each phase of a cycle maps the reduced state
linearly, s' = P s + b + Q p, and so does the cycle, s' = P_c s + b_c + Q_c (p_+, p_-). N cycles in
one implicit Euler step are (I + N (I - P_c)) s_1 = s_0 + N (b_c + Q_c p), whose fixed point is the
periodic state itself, which is N -> infinity: (I - P_c) s = b_c + Q_c p.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.linalg

from fenwear.arrays import Array
from fenwear.heat.exchange import HeatExchange, StepMap

KEPT, MEMORY = 8, 5 * 10**8  # cycles of different conducting nodes that are kept, and bytes that they may take


@dataclass(frozen=True)
class PhaseMap:
    """One phase: s' = propagator s + source + response p."""

    propagator: Array
    source: Array
    response: Array


@dataclass(frozen=True)
class _Passed:
    """What is there after a phase of a cycle: through s + source + responses p, s at its start, p of all phases."""

    through: Array
    source: Array
    responses: Array  # (dim, m n)


class CycleJump:
    """Where a jump ends, as a function of the pressures of its phases.

    Args:
        start: What the end solves for without pressure and without what cycles bring (dim,).
        weight: How many cycles bring it.
        matrix: Of the end (dim, dim).
        passed: The cycle, phase by phase.
        gap_rows: Thermal gap of the coordinates (n, dim), mm.
        gap_constant: The same where they are zero (n,), mm.
    """

    def __init__(
        self,
        start: Array,
        weight: float,
        matrix: Array,
        passed: Sequence[_Passed],
        gap_rows: Array,
        gap_constant: Array,
    ) -> None:
        self._start, self._weight, self._passed = start, weight, passed
        self._gap_rows, self._gap_constant = gap_rows, gap_constant
        self._factor = scipy.linalg.lu_factor(matrix)

    def state(self, pressure: Array) -> Array:
        """Return the state at the end of the jump (dim,) for pressures (m, n)."""
        last = self._passed[-1]
        brought = last.source + last.responses @ pressure.ravel()
        return np.asarray(scipy.linalg.lu_solve(self._factor, self._start + self._weight * brought))

    def gaps(self, pressure: Array) -> Array:
        """Return the thermal gap at the end of each phase of the cycle that starts there (m, n), mm, at pressures."""
        end, p = self.state(pressure), pressure.ravel()
        return (
            np.array([self._gap_rows @ (one.through @ end + one.source + one.responses @ p) for one in self._passed])
            + self._gap_constant
        )

    @cached_property
    def gap(self) -> Array:
        """The same without pressure."""
        return self.gaps(np.zeros((len(self._passed), len(self._gap_constant))))

    @cached_property
    def coupling(self) -> Array:
        """Thermal gap of each phase from the pressure of each phase (m, n, m, n), mm/MPa."""
        m, n = len(self._passed), len(self._gap_constant)
        end_response = scipy.linalg.lu_solve(self._factor, self._weight * self._passed[-1].responses)
        parts = [self._gap_rows @ (one.through @ end_response + one.responses) for one in self._passed]
        return np.array(parts).reshape(m, n, m, n)


class CycleHeat:
    """The maps of a cycle on the reduced state of both bodies."""

    def __init__(self, exchange: HeatExchange) -> None:
        self.exchange = exchange
        dim = sum(len(basis) for basis in exchange.bases)
        self.gap_rows = exchange.gap_change(np.eye(dim))
        self._gap_constant = exchange.gap(exchange.at(np.zeros(dim)))
        self._maps: dict[bytes, tuple[list[PhaseMap], list[_Passed]]] = {}

    def initial(self) -> Array:
        """Return the initial state (dim,)."""
        return self.exchange.initial().values

    def conductances(self, pressure: Array) -> Array:
        """Return the conductance of each phase's nodes (m, n)."""
        return np.array([self.exchange.conductance(p) for p in pressure])

    def maps(self, conductances: Array) -> list[PhaseMap]:
        """Return the map of each phase for its conductances (m, n); the last few are kept."""
        return self._cycle(conductances)[0]

    def _cycle(self, conductances: Array) -> tuple[list[PhaseMap], list[_Passed]]:
        """Return the map of each phase, and what is there after each one of a cycle."""
        key = conductances.tobytes()
        if key not in self._maps:
            m, n = conductances.shape
            each = 8 * m * (2 * self.gap_rows.shape[1] ** 2 + self.gap_rows.shape[1] * (m + 1) * n)
            if len(self._maps) > min(KEPT, MEMORY // each):
                self._maps.clear()
            maps = [self._phase_map(phase, conductances[phase]) for phase in range(len(conductances))]
            self._maps[key] = maps, self._passed(maps)
        return self._maps[key]

    def _phase_map(self, phase: int, conductance: Array) -> PhaseMap:
        exchange, dim = self.exchange, self.gap_rows.shape[1]
        steps: dict[tuple[int, int], StepMap] = {}
        propagator: Array = np.eye(dim)
        source: Array = np.zeros(dim)
        response: Array = np.zeros((dim, len(conductance)))
        for plan in exchange.plans[phase]:
            kinds = (plan.punch, plan.strip)
            if kinds not in steps:
                steps[kinds] = exchange.step_map(kinds, conductance)
            one = steps[kinds]
            propagator, source = one.propagator @ propagator, one.propagator @ source + one.source
            response = one.propagator @ response + one.response * (exchange.friction[phase] * plan.speed)
        return PhaseMap(propagator, source, response)

    @staticmethod
    def _passed(maps: Sequence[PhaseMap]) -> list[_Passed]:
        m, (dim, n) = len(maps), maps[0].response.shape
        through: Array = np.eye(dim)
        source: Array = np.zeros(dim)
        responses: Array = np.zeros((dim, m, n))
        passed = []
        for phase, one in enumerate(maps):
            through, source = one.propagator @ through, one.propagator @ source + one.source
            for before in range(phase):
                responses[:, before] = one.propagator @ responses[:, before]
            responses[:, phase] = one.response
            passed.append(_Passed(through, source, responses.reshape(dim, -1).copy()))
        return passed

    def jump(self, state: Array, cycles: float, conductances: Array) -> CycleJump:
        """Return the end of `cycles` cycles from `state`; infinitely many give the periodic state."""
        _, passed = self._cycle(conductances)
        changes = np.eye(len(passed[0].source)) - passed[-1].through
        if np.isinf(cycles):
            return CycleJump(np.zeros(len(changes)), 1.0, changes, passed, self.gap_rows, self._gap_constant)
        matrix = np.eye(len(changes)) + cycles * changes
        return CycleJump(state, cycles, matrix, passed, self.gap_rows, self._gap_constant)
