"""The shape to machine: the one that wear would make in the end, so that nothing is left to run in.

At the cyclic steady state the wear of a cycle is a rigid motion of the punch. Its shape omega, the depth worn off
without the rigid part, is the optimal contact shape of Paczelt and Mroz: a punch that is made with it has the steady
pressures from its first cycle on, and keeps them, at the load it was found for.

For loads of several sizes that take turns, with shares w_k of the sliding, the pressures are to first order
p_k(omega) = p_k - S_k^-1 (omega - omega_k), which wear the contact evenly in all where

    omega = sum of w_k omega_k,

exactly so for linear wear and one contact zone, as the shapes of the loads differ by elasticity alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fenwear.arrays import Array
from fenwear.assembly import Tribosystem
from fenwear.assembly.variants import with_case
from fenwear.cycle import SteadyState, steady
from fenwear.cycle.state import pressure_scale
from fenwear.errors import CaseError, InputError

ALLOWED = 0.1  # of the pressure scale: what a deviation of the size of the tolerance changes the pressure by
PROBE = 1e-3  # of the elastic gap under the pressure scale: a deviation that is small
CLEAR = 2.0  # of the shape's depth: where the surfaces never touch they are this far apart at least


@dataclass(frozen=True)
class InitialShape:
    """The shape to machine, for one load or several.

    Attributes:
        depth: To be taken off the punch at its contact nodes (n,), mm; 0 somewhere, and never less.
        states: The steady state of each load.
        largest_pressure: On that shape, of each load, MPa; NaN with heat.
        left_to_run_in: Largest difference between the first cycle's pressures on that shape and the steady ones, over
            the pressure scale, of each load; NaN with heat, where the first cycle is colder.
        tolerance: Amplitude of a wave once over the contact that changes the pressure by a tenth of its scale, mm.
    """

    depth: Array
    states: tuple[SteadyState, ...]
    largest_pressure: tuple[float, ...]
    left_to_run_in: tuple[float, ...]
    tolerance: float


def initial_shape(system: Tribosystem, loads: Sequence[tuple[float, float]] = ((1.0, 1.0),)) -> InitialShape:
    """Return the shape of the punch that has nothing left to run in; collective.

    Args:
        system: The assembled problem.
        loads: Factor of all loads of the case, and share of the sliding, of each load that acts in turn.

    Raises:
        CaseError: a factor or share is not positive.
        ConvergenceError: there is no steady state.
    """
    for factor, share in loads:
        if not (0 < factor < np.inf and 0 < share < np.inf):
            raise CaseError(InputError("--load", f"expected positive numbers FACTOR or FACTOR:SHARE, got {factor:g}"))
    systems = [system if factor == 1.0 else _under(system, factor) for factor, _ in loads]
    states = tuple(steady(one) for one in systems)
    depth = _mean_shape(states, np.array([share for _, share in loads]))
    first = [np.full_like(state.phase_pressure, np.nan) for state in states]
    if system.case.heat is None:
        first = [_pressures(one, depth) for one in systems]
    left = [
        float(np.abs(p - state.phase_pressure).max() / pressure_scale(system, state.phase_pressure))
        for p, state in zip(first, states, strict=True)
    ]
    tolerance = min(_tolerance(one, state, depth) for one, state in zip(systems, states, strict=True))
    return InitialShape(depth, states, tuple(float(p.max()) for p in first), tuple(left), tolerance)


def _under(system: Tribosystem, factor: float) -> Tribosystem:
    """Return the system with all loads times a factor; collective."""
    case, of = system.case, {}
    for name, body in case.bodies.items():
        of[name] = body.model_copy(update={"loads": tuple(load.times(factor) for load in body.loads)})
    return with_case(system, case.model_copy(update=of))


def _mean_shape(states: Sequence[SteadyState], shares: Array) -> Array:
    """Return the mean of the shapes, from its highest point down (n,), mm."""
    shapes = np.array([state.shape for state in states])
    mean = shares @ shapes / shares.sum()  # NaN where the surfaces never touch under one of the loads
    touched = np.isfinite(mean)
    depth: Array = mean - mean[touched].min()
    depth[~touched] = CLEAR * max(depth[touched].max(), *(-state.gap.min(initial=0.0) for state in states))
    return depth


def _pressures(system: Tribosystem, depth: Array) -> Array:
    """Return the pressure of each phase on a shape (phases, n), MPa; collective."""
    worn = replace(system.unworn(), punch=depth)
    phases = range(len(system.motion.phases))
    return np.array([system.phase_contact((k,)).solve(system.gap(k, worn)).pressure[0] for k in phases])


def _tolerance(system: Tribosystem, state: SteadyState, depth: Array) -> float:
    """Return the amplitude of a wave over the contact that changes the pressure by a share of its scale, mm."""
    scale = pressure_scale(system, state.phase_pressure)
    small = PROBE * system.interface.elastic_length * scale
    before, x, found = _pressures(system, depth), system.pair.punch.x, []
    axis = int(np.abs(system.pair.weights @ system.pair.normal).argmax())
    for s in np.delete(x, axis, axis=1).T:
        wave = np.cos(2 * np.pi * (s - s.min()) / np.ptp(s))
        change = _pressures(system, depth + small * (1 + wave)) - before
        found.append(small * ALLOWED * scale / float(np.abs(change).max()))
    return min(found)
