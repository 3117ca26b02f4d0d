"""The optimal pressure: the minimum of the wear dissipation power, without any elasticity.

With the rigid-body wear velocity w_n = H lambda the steady pressure is that which wears so fast: p = (w_n / K)^(1/b),
with K the mean of beta~ v^a, above a threshold p_0 p = p_0 + (w_n / K)^(1/b), and zero where w_n would turn negative
(8), (15), (16); lambda follows from the equilibrium of force and moment (7), (18) by Newton's method. For a tilting
punch lambda is (lambda_F, lambda_M): w_n = lambda_F - lambda_M (x - x_O).

With a threshold the pressure of w_n = 0 is any between 0 and p_0: where the punch turns about a place within the
contact it jumps there; here it rises over the first `RAMP` of the mean wear rate instead. Where pressures below the
threshold balance the loads nothing wears, and there is no optimum; nor is there one beyond a cap.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from fenwear.common.arrays import Array, Mask
from fenwear.common.errors import CaseError, ConvergenceError, InputError
from fenwear.laws.pressure_law import PressureLaw
from fenwear.surfaces import RigidEquilibrium

MOVES = {
    "lambda_F": "move along z",
    "lambda_Fx": "move along x",
    "lambda_Fy": "move along y",
    "lambda_M": "tilt",
    "lambda_Mx": "tilt about x",
    "lambda_My": "tilt about y",
    "lambda_Mz": "tilt about z",
}
TRACK_ROUNDS, AT_REST = 500, 1e-11  # of the pressure on a closed track
RAMP = 1e-6  # of the mean wear rate, over which the pressure rises to a threshold
RAMPS = (1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, RAMP)  # on the way there
SMALL = 0.1  # of the motion that wears a flat contact evenly
HALVINGS = 60  # of an interval that holds a pressure


def motion_words(mode: str) -> str:
    """Return the motion of a body by a rigid mode of this name, in words."""
    name, kind, part = mode.split("_", maxsplit=1)[0], mode.split("_")[1], mode.split("_")[2:]
    return MOVES[f"{name}_{kind}"] + (f" ({'_'.join(part)})" if part else "")


def _lifts(mode: str) -> bool:
    """Whether a rigid mode of this name takes the punch, or a part of it, off along z."""
    return mode.split("_")[:2] == ["lambda", "F"]


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


def check_equilibrium(rigid: RigidEquilibrium, when: str, friction_ratio: Array, key: str = "punch.loads") -> None:
    """Make sure that some pressure p >= 0 balances the loads.

    Args:
        when: In words, such as "in rightward sliding".
        friction_ratio: tau (n, d), the traction of friction on the punch over the pressure.
        key: Where the loads are given.

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
        return scipy.optimize.linprog(np.zeros(rows.shape[1]), A_eq=a, b_eq=b).status == 0

    every, punch = list(range(len(target))), list(range(rigid.of_punch))
    if not every or (size > 0 and balanced(every)):
        return
    beginning = f"no pressure on the contact balances the loads {when}: "
    if size > 0 and balanced(punch):
        loose = [k for k in every[rigid.of_punch :] if not balanced([*punch, k])] or every[rigid.of_punch :]
        freely = " and to ".join(motion_words(rigid.mode_names[k]) for k in loose)
        message = f"{beginning}the strip is free to {freely}, and the punch pushes it away. Add a support of it"
        raise CaseError(InputError("strip.supports", message))
    tips: list[int] = []
    lifted = [k for k in punch if _lifts(rigid.mode_names[k]) and not (size > 0 and balanced([k]))]
    if not lifted and size > 0 and balanced(punch[:1]):
        tips = [k for k in punch[1:] if not balanced([*punch[:1], k])] or punch[1:]
    how = " and to ".join(motion_words(rigid.mode_names[k]) for k in tips)
    parts = ", ".join("_".join(rigid.mode_names[k].split("_")[2:]) for k in lifted)
    failure = (
        f"the punch tips over, free to {how}" if tips else "the punch lifts off" + (f" ({parts})" if parts else "")
    )
    raise CaseError(
        InputError(
            key,
            f"{beginning}{failure}. Press it between the contact's edges, friction included"
            + (", or add supports against tilting (or no_turning_about)" if tips else ""),
        )
    )


@dataclass(frozen=True)
class WearRates:
    """Wear rate of both bodies together by pressures: W(p) = sum of K_i times the law of body i.

    Attributes:
        rates: K of each body that wears (n,), the mean of beta~ v^a, mm/s MPa^-b.
        laws: Of the pressure, of each.
    """

    rates: tuple[Array, ...]
    laws: tuple[PressureLaw, ...]

    @classmethod
    def together(cls, rates: Sequence[Array], laws: Sequence[PressureLaw]) -> WearRates:
        """Return the rates of bodies, in one where their laws are equal."""
        if len(set(laws)) > 1:
            return cls(tuple(rates), tuple(laws))
        return cls((np.sum(rates, axis=0),), (laws[0],))

    @property
    def threshold(self) -> float:
        """The pressure below which nothing wears, MPa."""
        return min(law.threshold for law in self.laws)

    @property
    def cap(self) -> float:
        """The pressure beyond which the wear of no body grows any more, MPa."""
        return max(law.cap for law in self.laws)

    def uncapped(self) -> WearRates:
        """Return the rates without the highest cap, so that any rate has a pressure."""
        laws = (replace(law, cap=np.inf) if law.cap == self.cap else law for law in self.laws)
        return replace(self, laws=tuple(laws))

    def at(self, pressure: Array) -> Array:
        """Return W (n,), mm/s, of pressures (n,)."""
        return np.sum([k * law.value(pressure) for k, law in zip(self.rates, self.laws, strict=True)], axis=0)

    @np.errstate(over="ignore")
    def without_threshold(self, pressure: float) -> Array:
        """Return the rates of a pressure (n,), mm/s, were there no thresholds; infinite where they overflow."""
        size = np.float64(pressure)
        return np.sum([k * size**law.exponent for k, law in zip(self.rates, self.laws, strict=True)], axis=0)

    def pressure(self, rate: Array) -> Array:
        """Return the pressure (n,) that wears at a rate (n,) >= 0, at least the threshold."""
        pairs = list(zip(self.rates, self.laws, strict=True))
        highest = [
            law.threshold + np.divide(rate, k, out=np.full_like(k, np.inf), where=k > 0) ** (1 / law.exponent)
            for k, law in pairs
            if law.cap == np.inf
        ]
        if len(pairs) == 1:
            return highest[0]
        low: Array = np.full(len(rate), self.threshold)
        high: Array = np.min(highest, axis=0)
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            short = self.at(middle) < rate
            low, high = np.where(short, middle, low), np.where(short, high, middle)
        return (low + high) / 2

    def slope(self, pressure: Array) -> Array:
        """Return dW/dp (n,), mm/s MPa^-1."""
        return np.sum([k * law.slope(pressure) for k, law in zip(self.rates, self.laws, strict=True)], axis=0)


def optimum(rigid: RigidEquilibrium, friction_ratio: Array, wear: WearRates, zone: Mask | None = None) -> Optimum:
    """Return the optimal pressure and the wear velocity.

    Args:
        friction_ratio: tau (n, d), the traction of friction on the punch over the pressure.
        wear: Wear rate by pressures; where all its coefficients are zero, the pressure is as if they were alike.
        zone: Nodes that are in contact (n,) bool; by default all.

    Raises:
        ConvergenceError: Newton's method found no equilibrium, a threshold or a cap leaves none, or numbers overflow.
    """
    balance = rigid.equilibrium(friction_ratio)
    if zone is not None:
        balance = balance * zone
    n, p_mean = balance.shape[1], rigid.mean_pressure
    wears = any(k.any() for k in wear.rates)
    law = (wear if wears else WearRates((np.ones(n),), wear.laws[:1])).uncapped()
    lengths = np.abs(rigid.rigid_normal).max(axis=0, initial=1e-300)
    even = law.without_threshold(p_mean)
    rate = float(even.mean())
    shape, size = rigid.rigid_normal / lengths, lengths * p_mean * rigid.pair.weights.sum()
    rows, resultant = balance / size[:, None], rigid.resultant / size
    if law.threshold > 0 and _balanced_below(rows, resultant, law.threshold):
        raise ConvergenceError(
            f"no optimum: pressures below the pressure_threshold of {law.threshold:.4g} MPa balance the loads, "
            "and nothing wears. Reduce it, or increase the loads"
        )
    if not (np.isfinite(even).all() and np.isfinite(rate / even).all()):
        raise ConvergenceError(
            "no optimum: wear rates of the mean pressure are too large or small to compute. Check the wear law"
        )
    # Unknown y: w_n over the mean rate at the mean pressure is shape y.
    y = np.linalg.lstsq(shape * (rate / even)[:, None], np.ones(n), rcond=None)[0]
    if np.linalg.norm(y) < SMALL:  # a bore wears evenly by no motion: from that along the loads on
        y = -resultant / np.linalg.norm(resultant)
    for ramp in RAMPS if law.threshold > 0 else (RAMP,):
        y, pressure, residual = _newton(law, shape * rate, rows, resultant, y, ramp * rate)
    if not residual <= 1e-10:
        raise ConvergenceError(f"the optimum did not converge: residual {residual:.3g} of the load")
    if zone is not None:
        pressure = pressure * zone
    if pressure.max(initial=0.0) > wear.cap:
        raise ConvergenceError(
            f"no optimum: it would need {pressure.max():.4g} MPa, above the pressure_cap of {wear.cap:.4g} MPa, where "
            "wear does not grow with pressure. Raise the cap"
        )
    velocity = rate * y / lengths
    tilt = np.arctan2(_tangential(rigid, velocity), rigid.rigid_normal @ velocity)
    velocities = (velocity if wears else 0 * velocity).tolist()
    return Optimum(pressure, dict(zip(rigid.mode_names, velocities, strict=True)), residual, tilt)


def _newton(
    law: WearRates, modes: Array, rows: Array, resultant: Array, y: Array, ramp: float
) -> tuple[Array, Array, float]:
    """Return y, the pressures of the wear rates `modes` y, and the largest error of their equilibrium."""

    def pressures(y: Array) -> Array:
        return _pressure(law, modes @ y, ramp)

    pressure = pressures(y)
    force = rows @ pressure + resultant
    residual = np.inf
    for _ in range(200):
        residual = float(np.abs(force).max(initial=0.0))
        if residual < 1e-13:
            break
        slope = _slope(law, modes @ y, ramp)
        if not np.isfinite(slope).all():
            return y, pressure, np.inf
        step = np.linalg.lstsq((rows * slope) @ modes, -force, rcond=None)[0]
        for halving in range(40):
            trial = y + step / 2**halving
            trial_pressure = pressures(trial)
            trial_force = rows @ trial_pressure + resultant
            if np.abs(trial_force).max() < residual:
                break
        else:
            break  # at the rounding of the residual, or no descent
        y, pressure, force = trial, trial_pressure, trial_force
    return y, pressure, residual


def _pressure(law: WearRates, rate: Array, ramp: float) -> Array:
    """Return the pressures (n,) of wear rates (n,), which rise to the threshold over a ramp, 0 below."""
    pressure = law.pressure(np.maximum(rate, 0.0))
    return pressure - law.threshold * (1 - np.clip(rate / ramp, 0.0, 1.0))


def _slope(law: WearRates, rate: Array, ramp: float) -> Array:
    """Return the derivatives (n,) of `_pressure`; where the rate is zero that of a small one: it may be infinite."""
    least = 1e-6 * ramp
    slope = 1 / law.slope(law.pressure(np.maximum(rate, least))) + np.where(rate < ramp, law.threshold / ramp, 0.0)
    return np.where(rate > 0, slope, 0.0)


def _balanced_below(rows: Array, resultant: Array, pressure: float) -> bool:
    """Return whether pressures of no more than this one balance the loads."""
    solution = scipy.optimize.linprog(np.zeros(rows.shape[1]), A_eq=rows, b_eq=-resultant, bounds=(0, pressure))
    return bool(solution.status == 0)


def optimum_on_track(
    rigid: RigidEquilibrium,
    friction_ratio: Array,
    punch: WearRates,
    strip: PressureLaw,
    recession: Callable[[Array], Array],
    zone: Mask | None = None,
) -> Optimum:
    """Return the optimum of a punch on a strip whose wear spreads along its closed track.

    With r(p) the recession, W(p) + r(p) = w_n: the same as K_eff q^b = w_n with K_eff = (W(p) + r(p)) / q^b, which is
    taken again until the pressure repeats; q^b is the law of the body that begins to wear at the lower pressure.

    Args:
        rigid, friction_ratio, zone: As of `optimum`.
        punch: Wear rate of the punch by pressures.
        strip: The strip's law of the pressure.
        recession: The velocity at which the strip recedes opposite each node at pressures (n,), mm/s.

    Raises:
        ConvergenceError: as `optimum`, or the pressure does not come to rest.
    """
    first = min((*punch.laws, strip), key=lambda law: law.threshold)
    law = replace(first, cap=np.inf)
    pressure: Array = np.full(rigid.rigid_normal.shape[0], law.threshold + rigid.mean_pressure)
    rate = np.zeros_like(pressure)
    for _ in range(TRACK_ROUNDS):
        before, felt = pressure, law.value(pressure)
        worn = punch.at(pressure) + recession(pressure)
        rate = np.divide(worn, felt, out=rate.copy(), where=felt > 0)
        optimal = optimum(rigid, friction_ratio, WearRates((rate,), (law,)), zone)
        pressure = optimal.pressure
        if np.abs(pressure - before).max() <= AT_REST * pressure.max():
            return optimal
    raise ConvergenceError("the optimum on a closed track did not converge: the strip wears much more than the punch")


def _tangential(rigid: RigidEquilibrium, velocity: Array) -> Array:
    """Return the wear velocity within the contact along +x in the plane, else its size (n,)."""
    motion = rigid.motion @ velocity
    normal = rigid.pair.normal
    if normal.shape[1] == 2:
        return motion[:, 0] * normal[:, 1] - motion[:, 1] * normal[:, 0]
    within = motion - np.einsum("id,id->i", motion, normal)[:, None] * normal
    return np.linalg.norm(within, axis=1)
