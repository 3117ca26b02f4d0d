"""Stability: how fast disturbances of a state grow, the critical speed, the limit of explicit steps, uniqueness.

Uniqueness is that of the contact of a half-cycle with heat. The friction heat of a change dp of pressure opens the gap
by Theta dp by the end of its half-cycle, and where nodes stay closed, with the loads balanced, an opened gap takes the
pressure X away: the heat of a change feeds back G dp = -X Theta dp of it. Both compliances together, S + Theta, are
singular where an eigenvalue of G is 1: that is where R. A. Burton's waves neither grow nor decay, for heat that has had
one half-cycle to flow. Beyond it a complementarity problem with the same nodes in contact is none with a P-matrix: it
may have several answers, or none (J. R. Barber, J. Elasticity 8, 1978, 409). Wear within a half-cycle opens the gap
against it, by much less, and is left out.

Where friction depends on the pressure S and Theta are derivatives: of the traction mu p by d(mu p)/dp, and so of its
heat. One answer is certain where the derivative is one with a P-matrix at every pressure (D. Gale and H. Nikaido, Math.
Ann. 159, 1965, 81), which is why the steepest traction up to the largest pressure counts. A conductance by the pressure
counts with its slope at the pressures given.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any, Protocol

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs

from fenwear.algebra.submatrices import Solve
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, ConvergenceError, InputError
from fenwear.contact import CondensedContact, SlidingContact
from fenwear.heat.periodic_heat import CycleHeat
from fenwear.heat.temperature import HeatState
from fenwear.laws.wear import WornDepths
from fenwear.steps.coupled_phases import cycle_heat, touching
from fenwear.steps.tangent import answered, lies_after, phase_tangent
from fenwear.system import Tribosystem, heating_friction, steady_exchange, with_reduced_heat

ROUNDING = 1e-12  # of a disturbance: what is left of it that is gone
NEUTRAL = 1e-8  # distance of an eigenvalue from 1 that counts as none
MAX_ITERATIONS = 60  # of friction and the temperatures that it depends on
CLOSE = 1e-10  # change of these temperatures over their range that ends them
LONGER = "Run longer, or use `steady`"
APART = 0.1  # what a nearly stationary state may be away from itself a cycle later, or from its own temperatures


class StationaryState(Protocol):
    """A state whose disturbances grow or decay, such as a `SteadyState`."""

    @property
    def phase_pressure(self) -> Array:
        """The pressure of each phase (phases, n), MPa."""

    @property
    def conductances(self) -> Array | None:
        """By which its temperatures have come about (phases, n), N/(mm s K); None without heat."""


def growth_rate(
    system: Tribosystem, state: Array | StationaryState, conductances: Array | None = None, *, implicit: bool = True
) -> float:
    """Return the rate at which the least stable disturbance of a state grows, 1/s; collective.

    Negative: every disturbance dies out. Not for a strip whose worn material moves to and fro. The
    state is that of the given pressures and of the temperatures that repeat under them. The cycle's map
    of temperature and worn depth is linearised there, friction, wear and conductance with it, for the
    same nodes in contact, and its eigenvalue largest in size taken: ln |lambda| over
    the duration of a cycle. A rigid motion of the worn shape changes nothing, nor does the shape where
    nothing touches; these disturbances (lambda = 1) do not count.

    Args:
        system: The assembled problem.
        state: Result of `steady`, or the pressure of each phase (phases, n), MPa, positive where nodes touch.
        conductances: By which its temperatures have come about (phases, n); by default those of the state, or of the
            nodes that these pressures close by more than rounding.
        implicit: Which of the two steps wears; explicit ones may grow where implicit ones do not.

    Raises:
        CaseError: a coefficient is negative or not finite there, or the pressures are of other phases or nodes.
        ConvergenceError: friction and the temperatures that it depends on do not converge, or numbers overflow.
    """
    rates = _rates(system, state, conductances, implicit=implicit)
    return float(rates[0]) if len(rates) else 0.0  # as where all that is worn stays, and fills what it opens


def decay_rates(system: Tribosystem, state: Array | StationaryState, conductances: Array | None = None) -> Array:
    """Return the rates at which all disturbances of a state grow, 1/s, the largest first; collective.

    Real parts; those that neither grow nor decay, such as rigid motions of the shape, and those that are gone after a
    cycle are left out. Arguments and errors as of `growth_rate`, which is the first of them.
    """
    rates = _rates(system, state, conductances)
    return rates[rates > np.log(ROUNDING) / system.motion.period]


def _rates(
    system: Tribosystem, state: Array | StationaryState, conductances: Array | None, *, implicit: bool = True
) -> Array:
    """Return the rates of the disturbances that a cycle changes, 1/s, the largest first; collective."""
    pressure, conductances = _parts(system, state, conductances)
    system = with_reduced_heat(system)  # before rank 0 leads
    values = system.team.lead(partial(_factors, system, pressure, conductances, implicit=implicit))
    sizes = np.abs(values[np.abs(values - 1.0) > NEUTRAL])
    return np.sort(np.log(np.maximum(sizes, 1e-300)) / system.motion.period)[::-1]


def _parts(
    system: Tribosystem, state: Array | StationaryState, conductances: Array | None
) -> tuple[Array, Array | None]:
    """Return the pressures and conductances of a state.

    Raises:
        CaseError: no state of the system grows or decays, or the pressures are of other phases or nodes.
    """
    pressure, state_conductances = (
        (state, None) if isinstance(state, np.ndarray) else (state.phase_pressure, state.conductances)
    )
    if system.case.passing_laws:
        raise CaseError(
            InputError(system.case.passing_laws[0], "changes as long as it slides, so that no state grows or decays")
        )
    shape = (len(system.motion.phases), len(system.pair.weights))
    if pressure.shape != shape:
        message = f"expected pressures of {shape[0]} phases at {shape[1]} nodes, as `SteadyState.phase_pressure`"
        raise CaseError(InputError("state", f"{message}, got {pressure.shape}"))
    return pressure, state_conductances if conductances is None else conductances


def _factors(
    system: Tribosystem, pressure: Array, conductances: Array | None, *, implicit: bool
) -> NDArray[np.complex128]:
    """Return the factors by which a cycle multiplies the disturbances of a state: the eigenvalues of its map."""
    pressure = touching(pressure)
    heat, states = repeating_temperatures(system, pressure, conductances)
    n = pressure.shape[1]
    dim = heat.dim + system.elastic.creep.size
    if system.layers.debris.present:
        dim += len(system.pair.strip.weights) if system.layers.strip_carries else n
    cycle, rest = np.eye(dim + n), _rested(system, pressure, heat, states)
    for phase in range(len(pressure)):
        conductance = None if conductances is None else conductances[phase]
        state = states[phase] if states else None
        tangent = phase_tangent(system, phase, pressure[phase], heat, state, conductance, implicit=implicit, worn=rest)
        cycle, rest = tangent @ cycle, lies_after(system, phase, pressure[phase], heat, state, rest)
    if not np.isfinite(cycle).all():
        raise ConvergenceError("the growth of disturbances in a cycle overflows. Reduce wear, heat or load")
    return np.asarray(np.linalg.eigvals(cycle), dtype=complex)


def explicit_growth(system: Tribosystem) -> float | None:
    """Return the rate at which explicit steps of wear let disturbances of full contact grow, 1/s; collective.

    The feedback of the friction heat reduces the loss of pressure by an opened gap, half-cycle for half-cycle, so that
    explicit steps may fail far below `stability_number` = 1. None where they do not, where implicit ones let
    disturbances grow, too, and where it is unknown: without heat, or with laws that pass.
    """
    if not system.exchange.conducts or system.case.passing_laws:
        return None
    even = np.full((len(system.motion.phases), len(system.pair.weights)), system.rigid.mean_pressure)
    try:
        rate = growth_rate(system, even, implicit=False)
        return rate if rate > 0 >= growth_rate(system, even) else None
    except (CaseError, ConvergenceError):
        return None


def stationary_growth(
    system: Tribosystem, pressure: Array, surfaces: tuple[Array, Array], phase: int, change: float
) -> tuple[float | None, str]:
    """Return the growth rate of a run's last state, or None with the reason why it has none; collective.

    A state that itself changes about as fast as its disturbances grow has no growth rate, nor has one whose
    temperatures are not yet those that repeat at its pressures.

    Args:
        system: The assembled problem.
        pressure: Of each phase in the last cycle (phases, n), MPa.
        surfaces: Temperatures of the punch's and the strip's surface at the end of the run (n,), K.
        phase: The one that would come next.
        change: Largest change of pressure in the last cycle over the pressure scale.
    """
    if not change < 1:  # the same number on all ranks
        return (
            None,
            f"pressures change by their scale from cycle to cycle. {LONGER}",
        )
    system = with_reduced_heat(system)
    return system.team.lead(partial(_stationary_growth, system, pressure, surfaces, phase, change))


def _stationary_growth(
    system: Tribosystem, pressure: Array, surfaces: tuple[Array, Array], phase: int, change: float
) -> tuple[float | None, str]:
    try:
        rate = growth_rate(system, pressure)
        heat, states = repeating_temperatures(system, pressure)
    except (CaseError, ConvergenceError) as error:
        return None, str(error)
    if states:
        temperatures = np.array(heat.exchange.contact_temperatures(states[phase], phase - 1))
        away = float(np.abs(temperatures - surfaces).max())
        scale = float(np.abs(temperatures - heat.exchange.heat.initial).max())
        if away > APART * scale:
            return None, f"temperatures are still {away:.2g} K from those that repeat at these pressures. {LONGER}"
    drift = change / system.motion.period
    if drift > APART * abs(rate):
        return None, (
            f"pressures still drift by {100 * drift:.2g} % per second. Disturbances "
            f"{'grow' if rate > 0 else 'decay'} by {100 * abs(rate):.2g} % per second, "
            f"and a drift above a tenth of that hides them. {LONGER}"
        )
    return rate, ""


def repeating_temperatures(
    system: Tribosystem, pressure: Array, conductances: Array | None = None
) -> tuple[CycleHeat, list[HeatState]]:
    """Return the heat of cycles and the temperatures that repeat at these pressures, before each phase; collective.

    None where no law and no conductance depends on the state: then any temperatures do.

    Raises:
        ConvergenceError: there are none, or friction and the temperatures that it depends on do not converge.
    """
    heat = cycle_heat(system)
    if not heat.dim or (system.phases.constant and not heat.exchange.by_pressure):
        return heat, []
    if conductances is None:
        conductances = heat.conductances(touching(pressure))
    surfaces: list[tuple[Array, Array] | None] = [None] * len(pressure)
    before = None
    for _ in range(MAX_ITERATIONS):
        if not system.laws.friction.constant:
            conditions = [system.phases.conditions(k, pressure[k], surfaces[k]) for k in range(len(pressure))]
            friction = [system.laws.friction.values(c) for c in conditions]
            mu = np.array([heating_friction(system, ratio, phase) for phase, ratio in enumerate(friction)])
            heat = CycleHeat(heat.exchange.with_friction(mu))
        exchange = heat.exchange
        try:
            end = heat.jump(heat.initial(), np.inf, conductances)
        except scipy.linalg.LinAlgError:
            raise ConvergenceError("no temperatures repeat: the bodies lose no heat. Set heat.convection") from None
        states = [exchange.at(end.state(pressure))]
        for phase in range(len(pressure) - 1):
            states.append(exchange.half_cycle(states[-1], phase, pressure[phase], conductances[phase])[0])
        surfaces = [exchange.contact_temperatures(state, phase - 1) for phase, state in enumerate(states)]
        temperatures = np.array(surfaces)
        if system.laws.friction.constant:
            return heat, states
        if before is not None and np.abs(temperatures - before).max() <= CLOSE * max(1.0, float(np.ptp(temperatures))):
            return heat, states
        before = temperatures
    raise ConvergenceError(
        f"friction and the temperatures that it depends on did not converge in {MAX_ITERATIONS} iterations at "
        "these pressures. No state exists whose growth rate can be computed"
    )


def _rested(system: Tribosystem, pressure: Array, heat: CycleHeat, states: Sequence[HeatState]) -> WornDepths | None:
    """Return the states of laws and debris at rest at pressures and temperatures of the phases; None without.

    Raises:
        ConvergenceError: debris has no thickness at which as much is lost as comes.
    """
    layers = system.layers
    if not layers.memory.names and not layers.debris.present:
        return None
    warm: list[tuple[Array, Array] | None] = [None] * len(pressure)
    if states:
        warm = [heat.exchange.contact_temperatures(state, phase - 1) for phase, state in enumerate(states)]
    conditions = [
        system.phases.conditions(k, np.asarray(p), warmth)
        for k, (p, warmth) in enumerate(zip(pressure, warm, strict=True))
    ]
    rest = system.phases.rested(conditions)
    if not layers.debris.present:
        return rest
    thickness = layers.lies(rest)
    for _ in range(MAX_ITERATIONS):
        lying = layers.with_thickness(rest, thickness)
        pairs = zip(conditions, system.sliding.pairs, strict=True)
        now = [replace(condition, debris=layers.facing(pair, lying)) for condition, pair in pairs]
        passing, before = system.phases.passing(system.phases.wear.phases(now), None, None, now), thickness
        thickness = passing.resting_at_debris(pressure)
        if not layers.varies and not system.laws.asks("debris"):
            break
        if np.abs(thickness - before).max() <= CLOSE * float(thickness.max()):
            break
    else:
        raise ConvergenceError("the thickness of debris at which gain and loss balance did not converge")
    return layers.with_thickness(rest, thickness)


def critical_speed(system: Tribosystem, direction: int) -> float:
    """Return the sliding speed above which full contact is thermo-elastically unstable; collective.

    Of disturbances that grow without moving along the contact, and without wear: there the steady
    temperature of a pressure makes just this pressure, p = -V X Theta p, with X the elastic stiffness
    of the contact and Theta the thermal gap of the friction heat at unit speed (for a half-plane on
    an insulator: Burton, V = 2 (1 - nu) k m / (mu E alpha)). Infinite where no speed is critical.
    In mm/s; in rad/s where the strip turns.

    Args:
        system: The assembled problem, with heat.
        direction: Sliding direction d.

    Raises:
        CaseError: the case has no heat, or a body no heat sink.
    """
    n, rigid, friction_ratio = len(system.pair.weights), system.rigid, system.phases.middle_ratio(direction)
    compliance, balance = (
        system.elastic.interface.compliance(friction_ratio).matrix(),
        rigid.equilibrium(friction_ratio),
    )
    everywhere, none = np.ones(n, dtype=bool), np.zeros((len(balance), n))
    pressed = answered(system.elastic.interface, compliance, balance, everywhere, np.eye(n), none)
    speed = system.motion.mean_speed
    for _ in range(50):  # the strip's temperature depends on its speed
        exchange = steady_exchange(system, [direction * speed])
        uniform = np.full(n, system.rigid.mean_pressure)
        states, _terms = exchange.change(0, exchange.conductance(uniform), pressure=np.eye(n))
        thermal = exchange.gap_change(states) / speed
        before, speed = speed, system.team.lead(partial(_unstable_speed, pressed, thermal))
        if np.isinf(speed):
            break
        if abs(speed - before) < 1e-6 * speed:
            break
    return speed


def _unstable_speed(pressed: Array, thermal: NDArray[Any]) -> float:
    """Return the lowest V of p = -V X Theta p, -X the pressures of unit gaps; infinite where there is none."""
    values = np.linalg.eigvals(pressed @ thermal)
    growing = values.real[(np.abs(values.imag) < 1e-6 * np.abs(values.real).max()) & (values.real > 0)]
    return float(1 / growing.max()) if len(growing) else float("inf")


def stability_number(system: Tribosystem) -> float:
    """Return the wear step over its explicit limit: above 1 an explicit run oscillates and diverges; collective.

    On closed contact an opened gap lowers the pressure by P, the leading block of the inverse of
    [[S, H], [E, 0]], and the pressure of a phase opens the gap by its wear by W: beta~ S b p^(b-1) of both
    bodies at the mean pressure, the strip's put on its nodes and read there. An explicit step multiplies an
    error of the shape by I - W P: stable while the largest eigenvalue of W P is below 2, in each direction in
    the phase that wears most.
    """
    ratios, largest = system.phases.ratios(), 0.0
    for phase, opened in system.team.lead(partial(_most_worn, system)):
        interface = system.elastic.interfaces[phase]
        contact = CondensedContact([SlidingContact(interface, ratios[phase])], team=system.team)
        worn = csr_array(opened / interface.elastic_length)  # as the contact is scaled
        largest = max(largest, contact.on_closed_contact(partial(_worn_response, worn, contact.size)))
    return largest / 2


def _most_worn(system: Tribosystem) -> list[tuple[int, csr_array]]:
    """Return of each direction the phase that wears most, if any does, and its S b p^(b-1), on the strip's nodes."""
    n = len(system.rigid.rigid_normal)
    uniform = np.full((len(system.motion.phases), n), system.rigid.mean_pressure)
    wear = system.phases.mean_wear
    slopes = sum((body.slope(uniform) for body in wear.bodies), np.zeros_like(uniform))
    directions, most = np.array(system.motion.directions), slopes.max(axis=1)
    phases = [int(np.argmax(np.where(directions == d, most, -1.0))) for d in np.unique(directions)]
    opened = [
        system.phases.wear.phases([system.phases.conditions(k)], [k]).slopes(uniform[k : k + 1])[0] for k in phases
    ]
    return [(k, slope) for k, slope in zip(phases, opened, strict=True) if slope.data.any()]


def _worn_response(worn: csr_array, size: int, solve: Solve) -> float:
    """Return the largest eigenvalue of W P: the gap (n,) worn open by the pressure lost to a gap."""
    n = worn.shape[0]

    def apply(gap: Array) -> Array:
        right = np.zeros(size)
        right[:n] = gap.ravel()
        return np.asarray(worn @ solve(right)[:n])

    start = np.where(np.arange(n) % 2, 1.0, -1.0)  # the fastest mode alternates from node to node
    return largest_eigenvalue(apply, start, np.abs)


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
    if (
        not exchange.conducts or system.law.sticks
    ):  # there every time step tells whether its answer is the only one near
        return None
    gains = [0.0]
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
        sliding = SlidingContact(system.elastic.interfaces[phase], system.phases.ratio(phase, slope))
        contact = CondensedContact([sliding], team=system.team)
        modes = contact.size - len(closed)
        gains.append(contact.on_closed_contact(partial(_gain, opened, modes), closed))
    return max(gains)


def _steepest_traction(system: Tribosystem, phase: int, pressure: Array, state: HeatState | None) -> Array:
    """Return the largest d(mu p)/dp of each node from no pressure to the largest one (n,)."""
    exchange, friction = system.exchange, system.laws.friction
    surfaces = exchange.contact_temperatures(exchange.on_bases(state), phase - 1)
    conditions = system.phases.conditions(phase, pressure, surfaces)
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
    conductance, rise = exchange.conductance(pressure, phase), exchange.conductance_slope(pressure, phase)
    changes, _ = exchange.change(phase, conductance, pressure=unit)
    if state is not None and rise.any():
        by_rise = system.exchange.by_conductance(phase, state, pressure, conductance) * rise
        changes = changes + by_rise[:, pressure > 0]
    return np.asarray(exchange.gap_change(changes, phase) / system.elastic.interfaces[phase].elastic_length)


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

    start = np.cos(np.pi * np.arange(n) / n)  # the longest waves are fed most
    return largest_eigenvalue(apply, start, np.real)


def largest_eigenvalue(apply: Solve, start: Array, size: Callable[[NDArray[Any]], NDArray[Any]]) -> float:
    """Return the eigenvalue of a product with a vector (n,) that is largest by `size`, which is np.abs or np.real.

    All of few nodes are found, and of many those that Arnoldi's method does not separate: modes of two shoes that are
    alike lie together.
    """
    operator = LinearOperator((len(start),) * 2, matvec=apply, dtype=float)
    if len(start) > FEW:
        which = "LM" if size is np.abs else "LR"
        with suppress(ArpackNoConvergence):
            return float(size(eigs(operator, k=1, which=which, v0=start, return_eigenvectors=False, tol=1e-4)).max())
    return float(size(np.linalg.eigvals(operator @ np.eye(len(start)))).max())
