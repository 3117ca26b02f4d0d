"""A run whose pressure is relaxed (29) from that of the half-cycle before, until the volume of the gap rests (30).

The paper does not give the factor of (29), nor the pressure that each half-cycle starts from. One half-cycle warms the
bodies by little, so that the volume of the gap rests at once, (30) ends the iterations after two or three, and a
small factor leaves the pressure far behind the contact: the bulge comes later. `march` with
`heat.coupling = "split"` starts each half-cycle from the contact one cycle before, so that nothing lags.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fenwear.common.arrays import Array
from fenwear.common.errors import ConvergenceError
from fenwear.steps.phase import gap_volume
from fenwear.system import Tribosystem

MOST = 100.0  # iterations times relaxation: long before, the pressure is the contact's


class Course(NamedTuple):
    """What a run was, half-cycle by half-cycle.

    Attributes:
        pressure: Along the contact (k, n), MPa; likewise
        wear: worn depth of the punch at the end, mm, and
        temperature: temperature of the punch's contact surface at the end, K.
        width: Width in contact (k,), mm.
        friction: Friction heat (k,), mJ.
    """

    pressure: Array
    wear: Array
    temperature: Array
    width: Array
    friction: Array


def run_relaxed(system: Tribosystem, half_cycles: int, relaxation: float) -> Course:
    """Return a run of constant coefficients with heat and an explicit wear step; collective.

    In each half-cycle, from the pressure p of the one before: conduct at p, solve contact for p*, relax p by
    relaxation (p* - p), and again until the volume of the gap changes by less than `heat.split_tolerance`. This p
    is the half-cycle's, also for its wear; the nodes that were in contact one cycle ago conduct.

    Args:
        system: The assembled problem.
        half_cycles: How many.
        relaxation: Factor of (29).

    Raises:
        ConvergenceError: a contact did not converge, or the volume of the gap did not rest.
    """
    exchange, heat, phases = system.exchange, system.case.heat, range(len(system.motion.phases))
    if heat is None:
        raise ValueError("expected a case with heat")
    contacts = [system.phase_contact((phase,)) for phase in phases]
    laws = [system.phases.wear.phases([system.phases.conditions(phase)], [phase]) for phase in phases]
    worn, temperature = system.unworn(), exchange.initial()
    states = [contacts[p].solve(system.gap(p, worn) + exchange.gap(temperature, p - 1), None, None) for p in phases]
    pressure = states[0].pressure[0]
    rows: list[tuple[Array, Array, Array, float, float]] = []
    for half_cycle in range(half_cycles):
        phase = half_cycle % len(phases)
        state, volume, gap = states[phase], np.inf, system.gap(phase, worn)
        # By what was closed one cycle ago: a node that opens and closes in turn would not let the gap rest.
        conductance = exchange.conductance(np.where(state.pressure[0] > 0, pressure, 0.0))
        for _ in range(int(MOST / relaxation)):
            after, terms = exchange.half_cycle(temperature, phase, pressure, conductance)
            free = gap + exchange.gap(after, phase)
            state = contacts[phase].solve(free, state, None)
            pressure = pressure + relaxation * (state.pressure[0] - pressure)
            before, volume = volume, gap_volume(system, free)
            if abs(volume - before) < heat.split_tolerance * volume:
                break
        else:
            raise ConvergenceError(f"half-cycle {half_cycle + 1}: the volume of the gap did not come to rest")
        temperature, states[phase] = after, state
        worn = worn + laws[phase].worn(pressure[None])
        width = float(system.pair.weights @ (state.pressure[0] > 0))
        rows.append((pressure, worn.punch, exchange.contact_temperatures(after, phase)[0], width, float(terms[0])))
    return Course(*(np.array(column) for column in zip(*rows, strict=True)))
