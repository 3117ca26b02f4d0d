"""Whether the contact of a half-cycle with heat has one answer.

The friction heat of a pressure p opens the gap by Theta p by the end of its half-cycle, and where nodes stay
closed, with the loads balanced, an opened gap takes the pressure X away: what a pressure heats gives back G p =
-X Theta p of it. Both compliances together, S + Theta, are singular where an eigenvalue of G is 1: that is
where R. A. Burton's waves neither grow nor decay, for heat that has had one half-cycle to flow. Beyond it a
complementarity problem with the same nodes in contact is none with a P-matrix: it may have several answers, or
none (J. R. Barber, J. Elasticity 8, 1978, 409). Wear within a half-cycle opens the gap against it, by much
less, and is left out.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs

from fenwear.arrays import Array
from fenwear.assembly import Tribosystem
from fenwear.contact import CondensedContact, SlidingContact
from fenwear.contact.operators import Solve

NO_JUMPS = (  # V_cr of R. A. Burton, and what becomes of the contact beyond it: hot bands that wear, cool and move
    'hot bands come and go within few of them, which jumps cannot pass over: run.integration = "implicit" follows them'
)
FEW = 50  # contact nodes up to which all eigenvalues are found


def heat_gain(system: Tribosystem, pressure: Array | None = None) -> float | None:
    """Return the largest share of a pressure that its friction heat of a half-cycle gives back; collective.

    The largest real part of the eigenvalues of G, in the middle phase of each half-cycle. From 1 on the contact may
    have several answers. None without heat, and where nodes stick or slip by themselves.

    Args:
        system: The assembled problem.
        pressure: Of each phase (phases, n), MPa: where it is positive nodes are in contact; by default that of the
            unworn bodies without heat.

    Raises:
        ConvergenceError: contact without heat did not converge.
    """
    exchange, positions = system.exchange, system.motion.positions
    if exchange is None or system.sticks:  # there every time step tells whether its answer is the only one near
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
        opened = opened_by_heat(system, phase, carried)[closed]
        interface = system.interfaces[phase]
        contact = CondensedContact([SlidingContact(interface, system.friction_ratios()[phase])], team=system.team)
        modes = contact.size - len(closed)
        found.append(contact.on_closed_contact(partial(_gain, opened, modes), closed))
    return max(found)


def opened_by_heat(system: Tribosystem, phase: int, pressure: Array) -> Array:
    """Return the gap that the friction heat of each pressure opens by the end of its half-cycle; collective.

    Args:
        system: With its heat prepared.
        phase: Of the motion.
        pressure: Where it is positive nodes conduct, and heat (n,), MPa.

    Returns:
        For each unit at the k nodes in contact (n, k), over the interface's elastic length, as the contact is scaled.
    """
    exchange = system.exchange
    if exchange is None:
        return np.zeros((len(pressure), int((pressure > 0).sum())))
    unit = np.eye(len(pressure))[:, pressure > 0]
    changes, _ = exchange.change(phase, exchange.conductance(pressure), pressure=unit)
    return np.asarray(exchange.gap_change(changes, phase) / system.interfaces[phase].elastic_length)


def heat_warnings(gain: float | None, *, jumps: bool = False) -> list[str]:
    """Return what is to be said of a contact whose friction heat gives back a share of the pressure.

    Args:
        gain: The share.
        jumps: Whether a run goes on by jumps.
    """
    if gain is None or gain < 1:
        return []
    beyond = f"; {NO_JUMPS}" if jumps else ""
    return [
        f"friction heats what presses, and what is heated presses more: within a half-cycle the heat gives back "
        f"{gain:.3g} times the pressure that it is from, and from 1 on the contact may have several answers; which of "
        "them is found depends on how and from where it is solved. Expected less friction or speed, less heat into the "
        f"contact, or, to follow how the contact breaks up, shorter half-cycles{beyond}"
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
