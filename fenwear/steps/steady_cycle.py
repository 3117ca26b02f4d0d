"""The half-cycles of a steady state, as quantities see those of a run: pressures, temperatures, and what they add."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from fenwear.common.arrays import Array
from fenwear.heat.heat_exchange import CROSSING, TERMS
from fenwear.laws.wear import WornDepths
from fenwear.steps.block import HeatRecord
from fenwear.steps.run_state import Totals, phase_totals, stacked
from fenwear.steps.steady import SteadyState
from fenwear.system import Tribosystem


@dataclass(frozen=True)
class SteadyCycle:
    """The k half-cycles of a steady state, of n contact nodes.

    Attributes:
        system: System of the state.
        pressure: In the middle position of each half-cycle (k, n), MPa.
        phase_pressure: In every phase (m, n), MPa.
        adds: Additions of each half-cycle to the totals, k of them.
        rate: Depths worn in the cycle.
        velocity: Rigid-body wear in the cycle of each mode, mm and rad.
        heat: Temperatures at the ends of the half-cycles; None without heat.
        moves: Whether what half-cycles add is known: forces, work and wear.
    """

    system: Tribosystem
    pressure: Array
    phase_pressure: Array
    adds: Totals
    rate: WornDepths
    velocity: Mapping[str, float]
    heat: HeatRecord | None
    moves: bool = True

    def __len__(self) -> int:
        return len(self.pressure)

    @property
    def half_cycle(self) -> NDArray[np.int64]:
        """Number of each half-cycle in the cycle (k,), from 1."""
        return np.arange(1, len(self) + 1)

    @property
    def contact_width(self) -> Array:
        """Width of the nodes in contact (k,), mm; in solids and rings their area, mm²."""
        return np.where(self.pressure > 0, self.system.pair.weights, 0.0).sum(axis=1)

    @property
    def load(self) -> Array:
        """Normal force (k,), N; 0 where supports and not the contact carry the loads."""
        return np.full(len(self), self.system.normal_force)


def cycle_of_state(state: SteadyState) -> SteadyCycle:
    """Return the half-cycles of a cyclic steady state."""
    system, warm, positions = state.system, state.heat, state.system.motion.positions
    latest = None if warm is None else (warm.punch[-1], warm.strip[-1])
    each: list[tuple[int, Array]] = [(k, np.asarray(p)) for k, p in enumerate(state.phase_pressure)]
    states = [system.phases.conditions(k, p, latest, None, None) for k, p in each]
    if system.layers.memory.names:
        rest = system.phases.rested(states)
        states = [system.phases.conditions(k, p, latest, rest, None) for k, p in each]
    adds, rate = phase_totals(system, state.phase_pressure, states), system.phases.wear.phases(states)
    half_cycles = stacked([reduce(Totals.__add__, adds[k : k + positions]) for k in range(0, len(adds), positions)])
    heat = None if warm is None else heat_of(warm.punch, warm.strip)
    worn = rate.worn(state.phase_pressure)
    return SteadyCycle(system, state.pressure, state.phase_pressure, half_cycles, worn, state.velocity, heat)


def heat_of(punch: Array, strip: Array) -> HeatRecord:
    """Return the temperatures of both surfaces at the ends of half-cycles (k, n) as a record without a balance."""
    terms, unknown = np.zeros((len(punch), len(TERMS) + len(CROSSING))), np.full(len(punch), np.nan)
    return HeatRecord(punch, strip, terms, np.zeros(len(punch), dtype=np.int64), unknown)
