"""Implicit differentiation of the cyclic steady state: one linear system for every key.

The steady state is u = (p, omega, a, lambda) with, for each phase k,

    gap_k = (S_n + S_t tau) p_k + H a_k + omega + g_load + g_thermal(p) = 0   where closed,   p_k = 0 elsewhere,
    wear of a cycle - H lambda = 0   at nodes that touch in some phase,
    (H + H_t tau)^T W p_k + F = 0,   a of the first phase zero.

As long as the same nodes stay closed, F(u; theta) = 0 holds for every theta nearby, hence
F_u du/dtheta = -F_theta. F_u is assembled; F_theta is a difference of residuals at fixed u, which
are smooth functions of theta. (Implicit function theorem; the active set is fixed, so that the derivative
is one-sided where a key lets a node open or close.)
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fenwear.arrays import Array, Mask
from fenwear.assembly import Tribosystem
from fenwear.cycle.coupled import cycle_heat, touching
from fenwear.errors import ConvergenceError
from fenwear.heat.periodic import CycleJump
from fenwear.life.model import Snapshot, steady_snapshot
from fenwear.sliding.pressure_law import PressureLaw


def differentiable(system: Tribosystem) -> bool:
    """Return whether the equations above are all there is: constant coefficients and conductances."""
    if system.sticks:
        return False
    if system.layers.closure is not None:
        return False
    if not all(PressureLaw.of(law).power for law in system.sliding.wear):
        return False
    return system.constant_coefficients and not system.exchange.by_pressure


@dataclass(frozen=True)
class _Unknown:
    """u: pressure (m, n), shape omega (n,), rigid motions a (m, r), wear velocity lambda (r,)."""

    pressure: Array
    shape: Array
    rigid: Array
    velocity: Array

    def plus(self, step: _Unknown, factor: float) -> _Unknown:
        """Return u + factor step."""
        return _Unknown(
            self.pressure + factor * step.pressure,
            self.shape + factor * step.shape,
            self.rigid + factor * step.rigid,
            self.velocity + factor * step.velocity,
        )


class SteadyTangent:
    """The steady state of a system, and its change with the system.

    Args:
        system: The assembled problem.
        snapshot: Its cyclic steady state.
    """

    def __init__(self, system: Tribosystem, snapshot: Snapshot) -> None:
        self.system = system
        pressure = touching(snapshot.phase_pressure)
        self.closed: Mask = pressure > 0
        self.touched: Mask = np.asarray(self.closed.any(axis=0))
        velocity = np.array([snapshot.velocity[name] for name in system.rigid.mode_names])
        self.state = self._complete(pressure, velocity)

    def _complete(self, pressure: Array, velocity: Array) -> _Unknown:
        """Return u of these pressures: shape and rigid motions close the gaps of the closed nodes."""
        m, n = pressure.shape
        modes = self.system.rigid.rigid_normal
        r = modes.shape[1]
        empty = _Unknown(pressure, np.zeros(n), np.zeros((m, r)), velocity)
        rest = _gaps(self.system, empty, self.closed)
        # Rows of the closed nodes of all phases; unknown omega and the rigid motions of all phases but the first.
        matrix = np.zeros((m, n, n + (m - 1) * r))
        for k in range(m):
            matrix[k, :, :n] = np.eye(n)
            if k > 0:
                matrix[k, :, n + (k - 1) * r : n + k * r] = modes
        found = np.linalg.lstsq(matrix[self.closed], -rest[self.closed], rcond=None)[0]
        rigid = np.vstack([np.zeros((1, r)), found[n:].reshape(m - 1, r)])
        return _Unknown(pressure, np.asarray(found[:n], dtype=float), rigid, velocity)

    def residual(self, system: Tribosystem, state: _Unknown) -> Array:
        """Return F: gaps of the closed nodes (mm), wear balance of the touched ones (mm), equilibrium (N/mm, N)."""
        modes = system.rigid.rigid_normal
        balance = [
            own.rigid.equilibrium(ratio) @ p + own.rigid.resultant
            for own, ratio, p in zip(system.interfaces, system.friction_ratios(), state.pressure, strict=True)
        ]
        wear = system.phases_wear.opening(state.pressure)[0] - modes @ state.velocity
        return np.concatenate(
            [_gaps(system, state, self.closed)[self.closed], wear[self.touched], np.concatenate(balance)]
        )

    @cached_property
    def _jacobian(self) -> Array:
        """F_u: columns of the closed pressures, the touched shape, the rigid motions and lambda."""
        system, closed, touched = self.system, self.closed, self.touched
        m, n = closed.shape
        modes = system.rigid.rigid_normal
        r = modes.shape[1]
        gaps = np.zeros((m, n, m, n))
        balance = np.zeros((m, r, m, n))
        for k, (own, ratio) in enumerate(zip(system.interfaces, system.friction_ratios(), strict=True)):
            gaps[k, :, k] = own.compliance(ratio).matrix()
            balance[k, :, k] = own.rigid.equilibrium(ratio)
        by_heat = _heat_at_rest(system, closed).coupling(np.ones((m, n)))
        gaps += 0.0 if by_heat is None else by_heat
        left, right = system.phases_wear.border(self.state.pressure)
        wear = np.einsum("iq,kqj->ikj", left[0], right)
        by_pressure = np.concatenate([
            gaps[closed][:, closed], wear[touched][:, closed], balance.reshape(m * r, m, n)[:, closed]
        ])  # fmt: skip
        size = len(by_pressure)
        count, shapes = int(closed.sum()), int(touched.sum())
        by_shape = np.zeros((size, shapes))
        by_shape[:count] = np.broadcast_to(np.eye(n), (m, n, n))[closed][:, touched]
        by_rigid = np.zeros((size, m - 1, r))
        for k in range(1, m):
            rows = np.zeros((m, n, r))
            rows[k] = modes
            by_rigid[:count, k - 1] = rows[closed]
        by_velocity = np.zeros((size, r))
        by_velocity[count : count + shapes] = -modes[touched]
        return np.hstack([by_pressure, by_shape, by_rigid.reshape(size, -1), by_velocity])

    def change(self, before: Tribosystem, after: Tribosystem) -> _Unknown:
        """Return by how much the steady state differs between two systems nearby, to first order.

        Raises:
            ConvergenceError: the linear system is singular, as where a node is about to open or close.
        """
        step = self.residual(after, self.state) - self.residual(before, self.state)
        matrix = self._jacobian
        if matrix.shape[0] != matrix.shape[1]:
            raise ConvergenceError("the steady state cannot be differentiated: its equations and unknowns do not match")
        rows = np.abs(matrix).max(axis=1, keepdims=True)
        columns = np.abs(matrix / rows).max(axis=0)
        scaled = matrix / rows / columns
        try:
            found = np.linalg.solve(scaled, -step / rows[:, 0]) / columns
        except np.linalg.LinAlgError:
            raise ConvergenceError("the steady state cannot be differentiated: its equations are singular") from None
        m, n = self.closed.shape
        r = self.state.velocity.shape[0]
        count, shapes = int(self.closed.sum()), int(self.touched.sum())
        pressure, shape = np.zeros((m, n)), np.zeros(n)
        pressure[self.closed] = found[:count]
        shape[self.touched] = found[count : count + shapes]
        rigid = np.vstack([np.zeros((1, r)), found[count + shapes : count + shapes + (m - 1) * r].reshape(m - 1, r)])
        return _Unknown(pressure, shape, rigid, found[len(found) - r :] if r else np.zeros(0))

    def snapshot(self, system: Tribosystem, step: _Unknown, factor: float) -> Snapshot:
        """Return the steady state of a system nearby, where the state has moved by factor times a step."""
        state = self.state.plus(step, factor)
        velocity = {name: float(part) for name, part in zip(system.rigid.mode_names, state.velocity, strict=True)}
        conductances = cycle_heat(system).conductances(self.closed.astype(float))
        return steady_snapshot(system, state.pressure, velocity, conductances)


def _gaps(system: Tribosystem, state: _Unknown, closed: Mask) -> Array:
    """Return the gap of every node in every phase (m, n), mm; those that are closed conduct."""
    modes = system.rigid.rigid_normal
    gaps = np.array(
        [
            own.compliance(ratio).apply(np.asarray(p))
            + modes @ a
            + own.load_gap
            + own.pair.initial_gap
            - system.pair.initial_gap
            for own, ratio, p, a in zip(
                system.interfaces, system.friction_ratios(), state.pressure, state.rigid, strict=True
            )
        ]
    )
    return gaps + _heat_at_rest(system, closed).gaps(state.pressure) + state.shape


def _heat_at_rest(system: Tribosystem, closed: Mask) -> CycleJump:
    """Return the heat of cycles that repeat, in which closed nodes (m, n) conduct."""
    heat = cycle_heat(system)
    return heat.jump(heat.initial(), np.inf, heat.conductances(closed.astype(float)))
