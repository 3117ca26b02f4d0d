"""Uniqueness of the contact of a half-cycle with heat.

The friction heat of a change dp of pressure opens the gap by Theta dp by the end of its half-cycle, and where nodes
stay closed, with the loads balanced, an opened gap takes the pressure X away: the heat of a change feeds back G dp = -X
Theta dp of it. Both compliances together, S + Theta, are singular where an eigenvalue of G is 1: that is where R. A.
Burton's waves neither grow nor decay, for heat that has had one half-cycle to flow. Beyond it a complementarity problem
with the same nodes in contact is none with a P-matrix: it may have several answers, or none (J. R. Barber, J.
Elasticity 8, 1978, 409). Wear within a half-cycle opens the gap against it, by much less, and is left out.

Where friction depends on the pressure S and Theta are derivatives: of the traction mu p by d(mu p)/dp, and so of its
heat. One answer is certain where the derivative is one with a P-matrix at every pressure (D. Gale and H. Nikaido, Math.
Ann. 159, 1965, 81), which is why the steepest traction up to the largest pressure counts. A conductance by the pressure
counts with its slope at the pressures given.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs

from fenwear.algebra.submatrices import Solve
from fenwear.common.arrays import Array
from fenwear.contact import CondensedContact, SlidingContact
from fenwear.heat.temperature import HeatState
from fenwear.system import Tribosystem, heating_friction

NO_JUMPS = (  # V_cr of R. A. Burton, and what becomes of the contact beyond it: hot bands that wear, cool and move
    'Hot bands appear and vanish within few half-cycles, too fast for jumps. Set run.integration = "implicit"'
)
LEVELS = 200  # pressures at which the steepest traction of friction is looked for
FEW = 50  # contact nodes up to which all eigenvalues are found


def heat_gain(system: Tribosystem, pressure: Array | None = None, state: HeatState | None = None) -> float | None:
    """Return the thermoelastic feedback: largest rise of a pressure by its heat of a half-cycle, over it; collective.

    The largest real part of the eigenvalues of G, in the middle phase of each half-cycle. From 1 on the contact may
    have several answers. None without heat, and where nodes stick or slip by themselves.

    Args:
        system: The assembled problem.
        pressure: Of each phase (phases, n), MPa: where it is positive nodes are in contact; by default that of the
            unworn bodies without heat.
        state: Temperatures at the start of the half-cycles; by default the initial ones.

    Raises:
        ConvergenceError: contact without heat did not converge.
    """
    exchange, positions = system.exchange, system.motion.positions
    if not exchange.conducts or system.sticks:  # there every time step tells whether its answer is the only one near
        return None
    found = [0.0]
    for phase in range(positions // 2, len(system.motion.phases), positions):
        if pressure is None:
            carried = system.phase_contact((phase,)).solve(system.gap(phase, system.unworn())).pressure[0]
        else:
            carried = pressure[phase]
        closed = carried > 0
        if not closed.any():
            continue
        slope = _steepest_traction(system, phase, carried, state)
        opened = opened_by_heat(system, phase, carried, slope, state)[closed]
        sliding = SlidingContact(system.interfaces[phase], system.phase_friction(phase, slope))
        contact = CondensedContact([sliding], team=system.team)
        modes = contact.size - len(closed)
        found.append(contact.on_closed_contact(partial(_gain, opened, modes), closed))
    return max(found)


def _steepest_traction(system: Tribosystem, phase: int, pressure: Array, state: HeatState | None) -> Array:
    """Return the largest d(mu p)/dp of each node from no pressure to the largest one (n,)."""
    exchange, friction = system.exchange, system.friction
    surfaces = exchange.contact_temperatures(exchange.on_bases(state), phase - 1)
    conditions = system.conditions(phase, pressure, surfaces)
    if not friction.asks("p", "pm"):
        return friction.values(conditions)
    levels = np.linspace(0.0, float(pressure.max()), LEVELS + 1)[:, None] * np.ones(len(pressure))
    traction = np.array([p * friction.values(conditions.pressed(p)) for p in levels])
    return np.asarray(np.diff(traction, axis=0).max(axis=0) / (levels[1] - levels[0]))


def opened_by_heat(
    system: Tribosystem, phase: int, pressure: Array, slope: Array | None = None, state: HeatState | None = None
) -> Array:
    """Return the gap that the friction heat of each change of pressure opens by the end of its half-cycle; collective.

    Args:
        system: With its heat prepared.
        phase: Of the motion.
        pressure: Where it is positive nodes conduct, and heat (n,), MPa.
        slope: d(mu p)/dp (n,); by default mu at the mean pressure.
        state: Temperatures at the start of the half-cycle, by which a conductance follows the pressure; by default that
            of the pressures stays.

    Returns:
        For each unit at the k nodes in contact (n, k), over the interface's elastic length, as the contact is scaled.
    """
    exchange = system.exchange
    if slope is not None:
        heating = [heating_friction(system, slope, k) for k in range(len(system.motion.phases))]
        exchange = exchange.with_friction(np.array(heating))
    unit = np.eye(len(pressure))[:, pressure > 0]
    conductance, rise = exchange.conductance(pressure), exchange.conductance_slope(pressure)
    changes, _ = exchange.change(phase, conductance, pressure=unit)
    if state is not None and rise.any():
        by_rise = system.exchange.by_conductance(phase, state, pressure, conductance) * rise
        changes = changes + by_rise[:, pressure > 0]
    return np.asarray(exchange.gap_change(changes, phase) / system.interfaces[phase].elastic_length)


def heat_warnings(gain: float | None, *, jumps: bool = False) -> list[str]:
    """Return the warning of a contact whose friction heat feeds back a share of the pressure.

    Args:
        gain: The share.
        jumps: Whether a run continues by jumps.
    """
    if gain is None or gain < 1:
        return []
    beyond = f". {NO_JUMPS}" if jumps else ""
    return [
        "Thermoelastic feedback is strong: within one half-cycle, friction heat adds "
        f"{gain:.3g} times a change of pressure to this change. Above 1 the contact may have several solutions, and "
        "the start decides which one is computed. Reduce friction, speed or the heat that flows into the contact"
        f"{beyond}"
    ]


def _gain(opened: Array, modes: int, solve: Solve) -> float:
    """Return the largest real part of the eigenvalues of -X Theta on closed nodes."""
    n = len(opened)
    if not opened.any():
        return 0.0

    def apply(pressure: Array) -> Array:
        right = np.zeros(n + modes)
        right[:n] = opened @ pressure.ravel()
        return -np.asarray(solve(right)[:n])

    operator = LinearOperator((n, n), matvec=apply, dtype=float)
    if n <= FEW:
        return float(np.linalg.eigvals(operator @ np.eye(n)).real.max())
    start = np.cos(np.pi * np.arange(n) / n)  # the longest waves are fed most
    try:
        return float(eigs(operator, k=1, which="LR", v0=start, return_eigenvectors=False, tol=1e-4).real.max())
    except ArpackNoConvergence:
        return float(np.linalg.eigvals(operator @ np.eye(n)).real.max())
