"""The optimal pressure: the minimum of the wear dissipation power, without any elasticity.

With the rigid-body wear velocity w_n = H lambda the steady pressure is p = (w_n / K)^(1/b), with
K the mean of beta~ v^a, and zero where it would turn negative (8), (15), (16); lambda follows from
the equilibrium of force and moment (7), (18) by Newton's method. For a tilting punch lambda is
(lambda_F, lambda_M): w_n = lambda_F - lambda_M (x - x_O).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from fenwear.arrays import Array, Mask
from fenwear.errors import CaseError, ConvergenceError, InputError
from fenwear.interface import RigidEquilibrium

MOVES = {"lambda_F": "move along z", "lambda_M": "tilt", "lambda_Mx": "tilt about x", "lambda_My": "tilt about y"}
TRACK_ROUNDS, AT_REST = 500, 1e-11  # of the pressure on a closed track


@dataclass(frozen=True, repr=False)
class Optimum:
    """The optimal state of one-way sliding.

    Attributes:
        pressure: (n,), MPa.
        velocity: Rigid-body wear velocity lambda of each mode: mm/s for lambda_F, rad/s for lambda_M.
        residual: Largest error of the equilibrium relative to the load.
        tilt: chi (n,), the angle between the normal and the wear velocity, tan chi = w_t / w_n (4), rad.
    """

    pressure: Array
    velocity: dict[str, float]
    residual: float
    tilt: Array

    def __repr__(self) -> str:
        """Say in a line what it is."""
        velocity = ", ".join(f"{name} = {value:.5g}" for name, value in self.velocity.items())
        n, most = len(self.pressure), self.pressure.max()
        return f"<Optimum: {n} contact nodes, largest pressure {most:.5g} MPa, {velocity}>"


def check_equilibrium(rigid: RigidEquilibrium, way: str, friction_ratio: Array) -> None:
    """Make sure that some pressure p >= 0 balances the loads.

    Args:
        way: Word for the sliding direction, for the message.
        friction_ratio: tau (n, d), the traction of friction on the punch over the pressure.

    Raises:
        CaseError: the loads would lift the punch or tip it over, or push a strip away that is not held.
    """
    rows = rigid.equilibrium(friction_ratio)
    scale = np.abs(rows).max(axis=1, initial=1e-300)
    target = -rigid.resultant / scale
    size = np.abs(target).max(initial=0.0)

    def balanced(modes: Sequence[int]) -> bool:
        a, b = rows[modes] / scale[modes, None], target[modes] / size
        least = np.linalg.lstsq(a, b, rcond=None)[0]  # of all pressures that balance, the smallest: mostly this one
        if least.min() >= 0 and np.abs(a @ least - b).max() < 1e-9:
            return True
        # Not scipy 1.15's nnls: it stops before the solution of such a wide system.
        return linprog(np.zeros(rows.shape[1]), A_eq=a, b_eq=b).status == 0

    every, punch = list(range(len(target))), list(range(rigid.of_punch))
    if not every or (size > 0 and balanced(every)):
        return
    beginning = f"no pressure on the contact balances the loads in {way} sliding: "
    if size > 0 and balanced(punch):
        loose = [k for k in every[rigid.of_punch :] if not balanced([*punch, k])] or every[rigid.of_punch :]
        freely = " and to ".join(MOVES[rigid.mode_names[k]] for k in loose)
        message = f"{beginning}the strip is free to {freely}, and the punch pushes it away; hold it against that"
        raise CaseError(InputError("strip.supports", message))
    tips = []
    if size > 0 and balanced(punch[:1]):
        tips = [k for k in punch[1:] if not balanced([*punch[:1], k])] or punch[1:]
    how = " and to ".join(MOVES[rigid.mode_names[k]] for k in tips)
    what = f"the punch tips over, free to {how}" if tips else "the punch lifts off"
    raise CaseError(
        InputError(
            "punch.loads",
            f"{beginning}{what}; expected a load that presses on it between the contact's edges, friction included"
            + (", or supports against tilting" if tips else ""),
        )
    )


def optimum(
    rigid: RigidEquilibrium,
    friction_ratio: Array,
    wear_rate: Array,
    pressure_exponent: float,
    zone: Mask | None = None,
) -> Optimum:
    """Return the optimal pressure and the wear velocity.

    Args:
        friction_ratio: tau (n, d), the traction of friction on the punch over the pressure.
        wear_rate: K of the nodes (n,), the mean of beta~ v^a, mm/s MPa^-b.
        pressure_exponent: b.
        zone: Nodes that are in contact (n,) bool; by default all.

    Raises:
        ConvergenceError: Newton's method found no equilibrium.
    """
    weights_rows = rigid.equilibrium(friction_ratio)
    modes = rigid.rigid_normal
    if zone is not None:
        weights_rows = weights_rows * zone
    p_mean, b = rigid.mean_pressure, pressure_exponent
    lengths = np.abs(modes).max(axis=0, initial=1e-300)
    mean_rate = float(wear_rate.mean())
    relative = wear_rate / mean_rate if mean_rate > 0 else np.ones_like(wear_rate)
    shape = modes / lengths / relative[:, None]
    rows = weights_rows / (lengths[:, None] * p_mean * rigid.pair.weights.sum())
    resultant = rigid.resultant / (lengths * p_mean * rigid.pair.weights.sum())
    # Unknown y: w_n / (K p_mean^b) = shape y at each node, so that p / p_mean = (shape y)_+^(1/b).
    y = np.linalg.lstsq(shape, np.ones(len(shape)), rcond=None)[0]
    pressure, residual = _pressure(shape @ y, b), np.inf
    force = rows @ pressure * p_mean + resultant
    for _ in range(200):
        residual = float(np.abs(force).max(initial=0.0))
        if residual < 1e-13:
            break
        w = shape @ y
        slope = np.where(w > 0, np.maximum(w, 1e-12) ** (1 / b - 1) / b, 0.0)
        step = np.linalg.lstsq((rows * p_mean * slope) @ shape, -force, rcond=None)[0]
        for halving in range(40):
            trial = y + step / 2**halving
            trial_pressure = _pressure(shape @ trial, b)
            trial_force = rows @ trial_pressure * p_mean + resultant
            if np.abs(trial_force).max() < residual:
                break
        else:
            break  # at the rounding of the residual, or no descent
        y, pressure, force = trial, trial_pressure, trial_force
    if residual > 1e-10:
        raise ConvergenceError(f"the optimum did not converge: residual {residual:.3g} of the load")
    velocity = mean_rate * p_mean**b * y / lengths
    names = rigid.mode_names
    if zone is not None:
        pressure = pressure * zone
    tilt = np.arctan2(_tangential(rigid, velocity), modes @ velocity)
    return Optimum(pressure * p_mean, dict(zip(names, velocity.tolist(), strict=True)), residual, tilt)


def optimum_on_track(
    rigid: RigidEquilibrium,
    friction_ratio: Array,
    wear_rate: Array,
    pressure_exponent: float,
    recession: Callable[[Array], Array],
    zone: Mask | None = None,
) -> Optimum:
    """Return the optimum of a punch on a strip that recedes by what is spread along its closed track.

    With r(p) the recession, K p^b + r(p) = w_n: the same as K_eff p^b = w_n with K_eff = K + r(p) / p^b, which is
    taken again until the pressure repeats.

    Args:
        rigid, friction_ratio, wear_rate, pressure_exponent, zone: As of `optimum`; K of the punch alone.
        recession: The velocity at which the strip recedes opposite each node at pressures (n,), mm/s.

    Raises:
        ConvergenceError: Newton's method found no equilibrium, or the pressure does not come to rest.
    """
    b, rate = pressure_exponent, wear_rate
    pressure: Array = np.full(len(wear_rate), rigid.mean_pressure)
    for _ in range(TRACK_ROUNDS):
        before, powered = pressure, pressure**b
        touches = powered > 0
        rate = wear_rate + np.where(touches, recession(pressure), 0.0) / np.where(touches, powered, 1.0)
        found = optimum(rigid, friction_ratio, rate, b, zone)
        pressure = found.pressure
        if np.abs(pressure - before).max() <= AT_REST * pressure.max():
            return found
    raise ConvergenceError(
        "the optimum on a closed track did not come to rest: the strip wears much more than the punch"
    )


def _tangential(rigid: RigidEquilibrium, velocity: Array) -> Array:
    """Return the wear velocity within the contact along +x in the plane, else its size (n,)."""
    motion = rigid.motion @ velocity
    normal = rigid.pair.normal
    if normal.shape[1] == 2:
        return motion[:, 0] * normal[:, 1] - motion[:, 1] * normal[:, 0]
    within = motion - np.einsum("id,id->i", motion, normal)[:, None] * normal
    return np.linalg.norm(within, axis=1)


def _pressure(w: Array, b: float) -> Array:
    return np.maximum(w, 0.0) ** (1 / b)
