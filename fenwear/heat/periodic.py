"""Heat over whole cycles: jumps over N of them, and their periodic end.

With constant pressures and the same conducting nodes, each phase of a cycle maps the reduced state
linearly, s' = P s + b + Q p, and so does the cycle, s' = P_c s + b_c + Q_c (p_+, p_-). N cycles in
one implicit Euler step are (I + N (I - P_c)) s_1 = s_0 + N (b_c + Q_c p), whose fixed point is the
periodic state itself, which is N -> infinity: (I - P_c) s = b_c + Q_c p.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from fenwear.arrays import Array
from fenwear.heat.exchange import HeatExchange, State


@dataclass(frozen=True)
class PhaseMap:
    """One phase: s' = propagator s + source + response p, with the thermal gap of its end."""

    propagator: Array
    source: Array
    response: Array


@dataclass(frozen=True)
class CycleJump:
    """Where a jump ends, as a function of the pressures of its phases.

    Attributes:
        gap: Thermal gap at the end of each phase of the cycle that starts there, without pressure (m, n), mm.
        coupling: Thermal gap of each phase from the pressure of each phase (m, n, m, n), mm/MPa.
        end: State at the end without pressure (dim,).
        end_response: Its response to the pressures (dim, m n).
    """

    gap: Array
    coupling: Array
    end: Array
    end_response: Array

    def state(self, pressure: Array) -> Array:
        """Return the state at the end of the jump (dim,) for pressures (m, n)."""
        return self.end + self.end_response @ pressure.ravel()


class CycleHeat:
    """The maps of a cycle on the concatenated, reduced state of both bodies."""

    def __init__(self, exchange: HeatExchange) -> None:
        self.exchange = exchange
        initial = exchange.initial()
        self._split = len(initial[0])
        dim = sum(len(s) for s in initial)
        self.gap_rows = exchange.gap_change(self.parts(np.eye(dim)))
        self._gap_constant = exchange.gap(self.parts(np.zeros(dim)))
        self._maps: dict[bytes, list[PhaseMap]] = {}

    def parts(self, state: Array) -> State:
        """Return the states of the two bodies."""
        return state[: self._split], state[self._split :]

    def initial(self) -> Array:
        """Return the initial state (dim,)."""
        return np.concatenate(self.exchange.initial())

    def conductances(self, pressure: Array) -> Array:
        """Return the conductance of each phase's nodes (m, n)."""
        return np.array([self.exchange.conductance(p) for p in pressure])

    def maps(self, conductances: Array) -> list[PhaseMap]:
        """Return the map of each phase for its conductances (m, n); the last few are kept."""
        key = conductances.tobytes()
        if key not in self._maps:
            if len(self._maps) > 8:
                self._maps.clear()
            self._maps[key] = [self._phase_map(phase, conductances[phase]) for phase in range(len(conductances))]
        return self._maps[key]

    def _phase_map(self, phase: int, conductance: Array) -> PhaseMap:
        dim, n = self.gap_rows.shape[1], len(conductance)
        propagator = np.concatenate(self.exchange.propagate(phase, self.parts(np.eye(dim)), conductance))
        rest = self.exchange.half_cycle(self.parts(np.zeros(dim)), phase, np.zeros(n), conductance)[0]
        response = np.concatenate(self.exchange.response(phase, conductance)[0])
        return PhaseMap(propagator, np.concatenate(rest), response)

    def jump(self, state: Array, cycles: float, conductances: Array) -> CycleJump:
        """Return the end of `cycles` cycles from `state`; infinitely many give the periodic state."""
        maps = self.maps(conductances)
        m, n = conductances.shape
        dim = len(self.gap_rows[0])
        # The cycle: after phase k the state is through[k] s + source + responses of the phases up to k.
        through: Array = np.eye(dim)
        source: Array = np.zeros(dim)
        responses: Array = np.zeros((dim, m, n))
        ends: list[tuple[Array, Array, Array]] = []
        for phase, one in enumerate(maps):
            through, source = one.propagator @ through, one.propagator @ source + one.source
            responses = (one.propagator @ responses.reshape(dim, -1)).reshape(dim, m, n)
            responses[:, phase] += one.response
            ends.append((through, source, responses.copy()))
        if np.isinf(cycles):
            matrix, weight = np.eye(dim) - through, 1.0
            start: Array = np.zeros(dim)
        else:
            matrix, weight, start = np.eye(dim) + cycles * (np.eye(dim) - through), cycles, state
        columns = np.hstack([(start + weight * source)[:, None], weight * responses.reshape(dim, -1)])
        solved = scipy.linalg.solve(matrix, columns)
        end, end_response = solved[:, 0], solved[:, 1:]
        gaps, couplings = [], []
        for before, constant, added in ends:  # phases of the cycle that starts from the end state
            gaps.append(self.gap_rows @ (before @ end + constant))
            couplings.append(self.gap_rows @ (before @ end_response + added.reshape(dim, -1)))
        coupling = np.array(couplings).reshape(m, n, m, n)
        return CycleJump(np.array(gaps) + self._gap_constant, coupling, end, end_response)
