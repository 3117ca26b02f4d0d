"""Stability: the limit of explicit wear steps, and the thermo-elastic stability of a state."""

from __future__ import annotations

import numpy as np
import scipy.linalg
from scipy.sparse.linalg import LinearOperator, eigs

from fenwear.arrays import Array, Mask
from fenwear.assembly import Tribosystem, steady_exchange
from fenwear.cycle.coupled import cycle_heat

NEUTRAL = 1e-8  # distance of an eigenvalue from 1 that counts as none


def stability_number(system: Tribosystem) -> float:
    """Return the wear step over its explicit limit: above 1 an explicit run oscillates and diverges; collective.

    On closed contact a worn depth lowers the pressure by P = (I - H-part) S^-1, the leading block of
    the inverse of [[S, H], [E, 0]]. An explicit half-cycle multiplies an error of the shape by
    I - K P with K = beta~ S b p^(b-1) of both bodies at the mean pressure, in the phase that wears most:
    stable while K times the largest eigenvalue of P is below 2.
    """
    rigid = system.rigid
    n, r = rigid.rigid_normal.shape
    uniform = np.full((len(system.motion.phases), n), rigid.mean_pressure)
    wear = system.phases_wear
    slopes = sum((body.slope(uniform) for body in (wear.punch, wear.strip) if body is not None), np.zeros_like(uniform))
    scale = system.interface.elastic_length
    largest = 0.0
    for d in sorted(set(system.motion.directions)):
        friction_ratio = system.friction_ratio(d)
        matrix = np.zeros((n + r, n + r))
        matrix[:n, :n] = system.interface.compliance(friction_ratio) / scale
        matrix[:n, n:] = rigid.rigid_normal
        matrix[n:, :n] = rigid.equilibrium(friction_ratio)
        factor = scipy.linalg.lu_factor(matrix)

        def respond(shape: Array, factor: tuple[Array, Array] = factor) -> Array:
            return scipy.linalg.lu_solve(factor, np.concatenate([shape.ravel(), np.zeros(r)]))[:n]

        operator = LinearOperator((n, n), matvec=respond, dtype=float)
        start = np.where(np.arange(n) % 2, 1.0, -1.0)  # the fastest mode alternates from node to node
        values = eigs(operator, k=1, v0=start, return_eigenvectors=False, tol=1e-4)
        largest = max(largest, float(np.abs(values).max()) / scale)
    return float(slopes.max()) * largest / 2


def growth_rate(system: Tribosystem, pressure: Array) -> float:
    """Return the rate at which the least stable disturbance of a state grows, 1/s; collective.

    Negative: every disturbance dies out. Not for a strip whose worn material moves to and fro. The
    cycle's map of temperature and worn depth is linearised around the given pressures with the same
    nodes in contact and implicit wear, and its eigenvalue largest in size taken: ln |lambda| over the
    duration of a cycle. A rigid motion of the worn shape changes nothing, nor does the shape where
    nothing touches; these disturbances (lambda = 1) do not count.

    Args:
        system: The assembled problem.
        pressure: Of each phase (phases, n), MPa; positive where the nodes are in contact.
    """
    heat = cycle_heat(system)
    n = pressure.shape[1]
    dim = 0 if heat is None else heat.gap_rows.shape[1]
    maps = None if heat is None else heat.maps(heat.conductances(pressure))
    left, right = system.phases_wear.border(pressure)
    ratios = system.friction_ratios()
    cycle = np.eye(dim + n)
    for phase, interface in enumerate(system.interfaces):
        change = np.zeros((dim + n, dim + n))  # of temperature and depth over the phase
        compliance = interface.compliance(ratios[phase])
        disturbance = np.zeros((n, dim + n))
        disturbance[:, dim:] = np.eye(n)
        if heat is not None and maps is not None:
            one = maps[phase]
            disturbance[:, :dim] = heat.gap_rows @ one.propagator
            compliance = compliance + heat.gap_rows @ one.response
            change[:dim, :dim] = one.propagator
        wear = left[phase] @ right[phase]  # depth by pressure
        compliance = compliance + wear  # wear at the end of the phase: no step is too long
        answer = -_restricted_stiffness(system, ratios[phase], compliance, pressure[phase] > 0) @ disturbance
        if maps is not None:
            change[:dim] += maps[phase].response @ answer
        change[dim:, dim:] = np.eye(n)
        change[dim:] += wear @ answer
        cycle = change @ cycle
    values = np.linalg.eigvals(cycle)
    counted = np.abs(values - 1.0) > NEUTRAL
    return float(np.log(np.abs(values[counted]).max()) / system.motion.period)


def _restricted_stiffness(system: Tribosystem, friction_ratio: Array, compliance: Array, closed: Mask) -> Array:
    """Return minus the pressure (n, n) that each unit of gap makes where `closed` nodes stay closed."""
    rigid = system.rigid
    nodes = np.flatnonzero(closed)
    k, r = len(nodes), rigid.rigid_normal.shape[1]
    scale = system.interface.elastic_length
    matrix = np.zeros((k + r, k + r))
    matrix[:k, :k] = compliance[np.ix_(nodes, nodes)] / scale
    matrix[:k, k:] = rigid.rigid_normal[nodes]
    matrix[k:, :k] = rigid.equilibrium(friction_ratio)[:, nodes]
    stiffness = np.zeros((len(closed), len(closed)))
    stiffness[np.ix_(nodes, nodes)] = np.linalg.inv(matrix)[:k, :k] / scale
    return stiffness


def critical_speed(system: Tribosystem, direction: int) -> float:
    """Return the sliding speed above which full contact is thermo-elastically unstable, mm/s; collective.

    Of disturbances that grow without moving along the contact, and without wear: there the steady
    temperature of a pressure makes just this pressure, p = -V X Theta p, with X the elastic stiffness
    of the contact and Theta the thermal gap of the friction heat at unit speed (for a half-plane on
    an insulator: Burton, V = 2 (1 - nu) k m / (mu E alpha)). Infinite where no speed is critical.

    Args:
        system: The assembled problem, with heat.
        direction: Sliding direction d.

    Raises:
        CaseError: the case has no heat, or a body no heat sink.
    """
    n = len(system.pair.weights)
    everywhere = np.ones(n, dtype=bool)
    friction_ratio = system.friction_ratio(direction)
    compliance = system.interface.compliance(friction_ratio)
    stiffness = _restricted_stiffness(system, friction_ratio, compliance, everywhere)
    speed = system.motion.mean_speed
    for _ in range(50):  # the strip's temperature depends on its speed
        exchange = steady_exchange(system, [direction * speed])
        uniform = np.full(n, system.rigid.mean_pressure)
        states, _terms = exchange.response(0, exchange.conductance(uniform))
        thermal = exchange.gap_change(states) / speed
        values = np.linalg.eigvals(-stiffness @ thermal)
        growing = values.real[(np.abs(values.imag) < 1e-6 * np.abs(values.real).max()) & (values.real > 0)]
        if not len(growing):
            return float("inf")
        before, speed = speed, float(1 / growing.max())
        if abs(speed - before) < 1e-6 * speed:
            break
    return speed
