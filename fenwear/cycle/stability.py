"""Stability: the limit of explicit wear steps, and the thermo-elastic stability of a state."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.linalg import LinearOperator, eigs

from fenwear.arrays import Array, Mask
from fenwear.assembly import Creep, Tribosystem, heating_friction, steady_exchange, with_reduced_heat
from fenwear.contact import CondensedContact, SlidingContact
from fenwear.contact.operators import Solve
from fenwear.cycle.coupled import cycle_heat, touching
from fenwear.errors import CaseError, ConvergenceError, InputError
from fenwear.heat.field import HeatState
from fenwear.heat.periodic import CycleHeat
from fenwear.interface import PressureCompliance
from fenwear.sliding.friction import ContactConditions
from fenwear.sliding.pressure_law import PressureLaw
from fenwear.sliding.wear import PhasesWear, WornDepths

ROUNDING = 1e-12  # of a disturbance: what is left of it that is gone
NEUTRAL = 1e-8  # distance of an eigenvalue from 1 that counts as none
MAX_ITERATIONS = 60  # of friction and the temperatures that it depends on
CLOSE = 1e-10  # change of these temperatures over their range that ends them
APART = 0.1  # what a nearly stationary state may be away from itself a cycle later, or from its own temperatures
STEP, MAX_HALVINGS, SETTLED = 1.0, 10, 1e-6  # of differences to temperatures, K; of their steps; of the slopes
THIN = 1e-9  # mm: the least of differences to the thickness of debris


def stability_number(system: Tribosystem) -> float:
    """Return the wear step over its explicit limit: above 1 an explicit run oscillates and diverges; collective.

    On closed contact an opened gap lowers the pressure by P, the leading block of the inverse of
    [[S, H], [E, 0]], and the pressure of a phase opens the gap by its wear by W: beta~ S b p^(b-1) of both
    bodies at the mean pressure, the strip's put on its nodes and read there. An explicit step multiplies an
    error of the shape by I - W P: stable while the largest eigenvalue of W P is below 2, in each direction in
    the phase that wears most.
    """
    ratios, largest = system.friction_ratios(), 0.0
    for phase, opened in system.team.lead(partial(_most_worn, system)):
        interface = system.interfaces[phase]
        contact = CondensedContact([SlidingContact(interface, ratios[phase])], team=system.team)
        worn = csr_array(opened / interface.elastic_length)  # as the contact is scaled
        largest = max(largest, contact.on_closed_contact(partial(_worn_response, worn, contact.size)))
    return largest / 2


def _most_worn(system: Tribosystem) -> list[tuple[int, csr_array]]:
    """Return of each direction the phase that wears most, if any does, and its S b p^(b-1), on the strip's nodes."""
    n = len(system.rigid.rigid_normal)
    uniform = np.full((len(system.motion.phases), n), system.rigid.mean_pressure)
    wear = system.phases_wear
    slopes = sum((body.slope(uniform) for body in (wear.punch, wear.strip) if body is not None), np.zeros_like(uniform))
    directions, most = np.array(system.motion.directions), slopes.max(axis=1)
    phases = [int(np.argmax(np.where(directions == d, most, -1.0))) for d in np.unique(directions)]
    opened = [system.wear.phases([system.conditions(k)], [k]).slopes(uniform[k : k + 1])[0] for k in phases]
    return [(k, slope) for k, slope in zip(phases, opened, strict=True) if slope.data.any()]


def _worn_response(worn: csr_array, size: int, solve: Solve) -> float:
    """Return the largest eigenvalue of W P: the gap (n,) worn open by the pressure that a gap takes away."""
    n = worn.shape[0]

    def apply(gap: Array) -> Array:
        right = np.zeros(size)
        right[:n] = gap.ravel()
        return np.asarray(worn @ solve(right)[:n])

    start = np.where(np.arange(n) % 2, 1.0, -1.0)  # the fastest mode alternates from node to node
    operator = LinearOperator((n, n), matvec=apply, dtype=float)
    return float(np.abs(eigs(operator, k=1, v0=start, return_eigenvectors=False, tol=1e-4)).max())


def growth_rate(
    system: Tribosystem, pressure: Array, conductances: Array | None = None, *, implicit: bool = True
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
        pressure: Of each phase (phases, n), MPa; positive where the nodes are in contact.
        conductances: By which its temperatures have come about (phases, n), as `SteadyState.conductances`; by
            default those of the nodes that these pressures close by more than rounding.
        implicit: Which of the two steps wears; explicit ones may grow where implicit ones do not.

    Raises:
        CaseError: a coefficient is negative or not finite there.
        ConvergenceError: friction and the temperatures that it depends on do not come together, or numbers overflow.
    """
    if system.passing_laws:
        raise CaseError(
            InputError(system.passing_laws[0], "changes as long as it slides: no state of it grows or decays")
        )
    system = with_reduced_heat(system)  # before rank 0 leads
    return system.led_whole(partial(_growth_rate, system, pressure, conductances, implicit=implicit))


def decay_rates(system: Tribosystem, pressure: Array, conductances: Array | None = None) -> Array:
    """Return the rates at which all disturbances of a state grow, 1/s, the largest first; collective.

    Real parts; those that neither grow nor decay, such as rigid motions of the shape, and those that are gone after a
    cycle are left out. Arguments and errors as of `growth_rate`, which is the first of them.
    """
    if system.passing_laws:
        raise CaseError(
            InputError(system.passing_laws[0], "changes as long as it slides: no state of it grows or decays")
        )
    system = with_reduced_heat(system)
    sizes = np.abs(system.led_whole(partial(_factors, system, pressure, conductances, implicit=True)))
    counted = (np.abs(sizes - 1) > NEUTRAL) & (sizes > ROUNDING)
    return np.sort(np.log(sizes[counted]) / system.motion.period)[::-1]


def _growth_rate(system: Tribosystem, pressure: Array, conductances: Array | None, *, implicit: bool) -> float:
    values = _factors(system, pressure, conductances, implicit=implicit)
    counted = np.abs(values - 1.0) > NEUTRAL
    if not counted.any():  # as where all that is worn stays, and fills what it opens
        return 0.0
    return float(np.log(np.abs(values[counted]).max()) / system.motion.period)


def _factors(
    system: Tribosystem, pressure: Array, conductances: Array | None, *, implicit: bool
) -> NDArray[np.complex128]:
    """Return what a cycle multiplies each disturbance of a state by: the eigenvalues of its map."""
    pressure = touching(pressure)
    heat, states = repeating_temperatures(system, pressure, conductances)
    n = pressure.shape[1]
    dim = (0 if heat is None else heat.dim) + (0 if system.creep is None else len(system.creep.beginning()))
    dim += 0 if system.layers.debris is None else len(system.pair.strip.weights) if system.layers.strip_carries else n
    cycle, rest = np.eye(dim + n), _rested(system, pressure, heat, states)
    for phase in range(len(pressure)):
        conductance = None if conductances is None else conductances[phase]
        state = states[phase] if states else None
        tangent = phase_tangent(system, phase, pressure[phase], heat, state, conductance, implicit=implicit, worn=rest)
        cycle, rest = tangent @ cycle, _lies_after(system, phase, pressure[phase], heat, state, rest)
    if not np.isfinite(cycle).all():
        raise ConvergenceError(
            "what disturbances become in a cycle is beyond all numbers: wear, heat or load are too large"
        )
    return np.asarray(np.linalg.eigvals(cycle), dtype=complex)


def explicit_growth(system: Tribosystem) -> float | None:
    """Return the rate at which explicit steps of wear let disturbances of full contact grow, 1/s; collective.

    What the friction heat gives back leaves less of the pressure that an opened gap takes away, half-cycle for
    half-cycle, so that explicit steps may fail far below `stability_number` = 1. None where they do not, where implicit
    ones let disturbances grow, too, and where nothing can be told: without heat, or with laws that pass.
    """
    if system.exchange is None or system.passing_laws:
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
        return None, "the last cycle is the first, or not like the one before"
    system = with_reduced_heat(system)
    return system.led_whole(partial(_stationary_growth, system, pressure, surfaces, phase, change))


def _stationary_growth(
    system: Tribosystem, pressure: Array, surfaces: tuple[Array, Array], phase: int, change: float
) -> tuple[float | None, str]:
    try:
        rate = growth_rate(system, pressure)
        heat, states = repeating_temperatures(system, pressure)
    except (CaseError, ConvergenceError) as error:
        return None, str(error)
    if heat is not None and states:
        found = np.array(heat.exchange.contact_temperatures(states[phase], phase - 1))
        away = float(np.abs(found - surfaces).max())
        scale = float(np.abs(found - heat.exchange.heat.initial).max())
        if away > APART * scale:
            return None, f"the temperatures are still {away:.3g} K away from those that its pressures would keep up"
    drift = change / system.motion.period
    if drift > APART * abs(rate):
        return None, (
            f"the pressures still change by {drift:.3g} of their scale a second, and its disturbances by {rate:.3g}"
        )
    return rate, ""


def repeating_temperatures(
    system: Tribosystem, pressure: Array, conductances: Array | None = None
) -> tuple[CycleHeat | None, list[HeatState]]:
    """Return the heat of cycles and the temperatures that repeat at these pressures, before each phase; collective.

    None where no law and no conductance depends on the state: then any temperatures do.

    Raises:
        ConvergenceError: there are none, or friction and the temperatures that it depends on do not come together.
    """
    heat = cycle_heat(system)
    if heat is None:
        return None, []
    if system.constant_coefficients and heat.exchange.heat.conductance_per_pressure is None:
        return heat, []
    if conductances is None:
        conductances = heat.conductances(touching(pressure))
    surfaces: list[tuple[Array, Array] | None] = [None] * len(pressure)
    before = None
    for _ in range(MAX_ITERATIONS):
        if not system.friction.constant:
            conditions = [system.conditions(k, pressure[k], surfaces[k]) for k in range(len(pressure))]
            friction = [system.friction.values(c) for c in conditions]
            mu = np.array([heating_friction(system, own, phase) for phase, own in enumerate(friction)])
            heat = CycleHeat(heat.exchange.with_friction(mu))
        exchange = heat.exchange
        try:
            end = heat.jump(heat.initial(), np.inf, conductances)
        except scipy.linalg.LinAlgError:
            raise ConvergenceError("no temperatures repeat: the bodies lose heat nowhere") from None
        states = [exchange.at(end.state(pressure))]
        for phase in range(len(pressure) - 1):
            states.append(exchange.half_cycle(states[-1], phase, pressure[phase], conductances[phase])[0])
        surfaces = [exchange.contact_temperatures(state, phase - 1) for phase, state in enumerate(states)]
        found = np.array(surfaces)
        if system.friction.constant:
            return heat, states
        if before is not None and np.abs(found - before).max() <= CLOSE * max(1.0, float(np.ptp(found))):
            return heat, states
        before = found
    raise ConvergenceError(
        f"friction and the temperatures that it depends on did not come together in {MAX_ITERATIONS} iterations at "
        "these pressures: there is no state whose growth could be told"
    )


@dataclass(frozen=True)
class _Laws:
    """Friction and wear of a phase, and their derivatives to its pressure and to the temperatures at its start.

    Attributes:
        mu: (n,).
        rate: What each node slides for a unit of the stroke's law (n,): friction heat is mu p times that.
        mu_p: To the pressure of the same node (n,), 1/MPa.
        mu_s: To the state of the heat, and to the thickness of debris at its start where there is any, of L nodes where
            it lies (n, dim).
        worn_p, worn_s: Of the gap that the wear of the phase opens (n, n) and (n, dim).
        lies: Of the thickness of debris at its end (L, n) and (L, dim), and what of it lies at the contact's nodes
            (n, L); None without.
    """

    mu: Array
    rate: Array
    mu_p: Array
    mu_s: Array
    worn_p: Array
    worn_s: Array
    lies: tuple[Array, Array, Array] | None = None


def _rested(
    system: Tribosystem, pressure: Array, heat: CycleHeat | None, states: Sequence[HeatState]
) -> WornDepths | None:
    """Return what laws remember, and debris, at rest at pressures and temperatures of the phases; None without.

    Raises:
        ConvergenceError: debris has no thickness at which as much is lost as comes.
    """
    layers = system.layers
    if layers.memory is None and layers.debris is None:
        return None
    warm: list[tuple[Array, Array] | None] = [None] * len(pressure)
    if heat is not None and states:
        warm = [heat.exchange.contact_temperatures(state, phase - 1) for phase, state in enumerate(states)]
    conditions = [
        system.conditions(k, np.asarray(p), own) for k, (p, own) in enumerate(zip(pressure, warm, strict=True))
    ]
    rest = system.rested(conditions)
    if layers.debris is None:
        return rest
    thickness = np.asarray(layers.where_it_lies(rest))
    for _ in range(MAX_ITERATIONS):
        lying = layers.with_thickness(rest, thickness)
        pairs = zip(conditions, system.pairs, strict=True)
        now = [replace(one, debris=layers.facing(pair, lying)) for one, pair in pairs]
        passing, before = system.passing(system.wear.phases(now), None, None, now), thickness
        thickness = np.asarray(passing.resting_where_it_lies(pressure))
        if not layers.varies and not system.asks("debris"):
            break
        if np.abs(thickness - before).max() <= CLOSE * float(thickness.max()):
            break
    else:
        raise ConvergenceError("debris does not come to a thickness at which as much is lost as comes")
    return layers.with_thickness(rest, thickness)


def _lies_after(
    system: Tribosystem,
    phase: int,
    pressure: Array,
    heat: CycleHeat | None,
    state: HeatState | None,
    worn: WornDepths | None,
) -> WornDepths | None:
    """Return what lies between after a phase, of what does at its start."""
    if worn is None or system.layers.debris is None:
        return worn
    conditions = _conditions(system, phase, pressure, heat, state, worn)
    passing = system.passing(system.wear.phases([conditions], [phase]), [phase], None, [conditions])
    added, _ = passing.debris_changes(pressure[None], worn, None)
    return system.layers.with_thickness(worn, np.asarray(system.layers.where_it_lies(worn)) + added)


def _conditions(
    system: Tribosystem,
    phase: int,
    pressure: Array,
    heat: CycleHeat | None,
    state: HeatState | None,
    worn: WornDepths | None,
) -> ContactConditions:
    """Return the conditions of a phase, at temperatures and with what lies between at its start."""
    surfaces = None
    if heat is not None and state is not None:
        surfaces = heat.exchange.contact_temperatures(state, phase - 1)
    return system.conditions(phase, pressure, surfaces, worn)


def _laws(
    system: Tribosystem,
    phase: int,
    pressure: Array,
    heat: CycleHeat | None,
    state: HeatState | None,
    worn: WornDepths | None = None,
) -> _Laws:
    n, conditions = len(pressure), _conditions(system, phase, pressure, heat, state, worn)
    lies = () if conditions.debris is None else (conditions.debris,)
    around = (pressure, *conditions.temperatures, *lies)

    def at(p: Array, punch: Array, strip: Array, *debris: Array) -> ContactConditions:
        return replace(conditions, pressure=p, temperatures=(punch, strip), debris=debris[0] if debris else None)

    def friction(*values: Array) -> Array:
        return system.friction.values(at(*values))

    def depths(*values: Array) -> Array:
        wear = system.wear.phases([at(*values)], [phase])
        worn = (None if body is None else body.depth(values[0][None])[0] for body in (wear.punch, wear.strip))
        return np.array([np.zeros(n) if depth is None else depth for depth in worn])

    wear = system.wear.phases([at(*around)], [phase])
    mu_p, *mu_t = _slopes(friction, around)
    by_depths = _slopes(depths, around)
    worn_p, *worn_t = (_opened(wear, slope) for slope in by_depths)
    picked, rate = _picked(heat, phase, n), heating_friction(system, np.ones(n), phase)
    mu_s: Array = (np.array(mu_t[:2])[:, :, None] * picked).sum(axis=0)
    worn_s: Array = (np.array(worn_t[:2]) @ picked).sum(axis=0)
    if not lies:
        return _Laws(friction(*around), rate, mu_p, mu_s, worn_p, worn_s)
    debris, pair = system.layers.debris, system.pairs[phase]
    assert debris is not None
    if system.layers.strip_carries:
        onto, reads, puts = [pair.wear_projection], pair.wear_interpolation.toarray(), pair.wear_projection.toarray()
    else:
        onto, reads, puts = None, np.eye(n), np.eye(n)
    path, taken, thickness = system.path[phase], depths(*around).sum(axis=0), system.layers.where_it_lies(worn)
    over = debris.over(path[None], [conditions], onto)
    # Of what is fed, by what is worn at the nodes of the contact, to pressure, temperatures and thickness there.
    put = over.slope(None)[0][:, None] * puts
    lies_p, *lies_t, lies_here = (put * slope.sum(axis=0) for slope in by_depths)
    if system.layers.varies:
        by_loss = over.by_loss(np.asarray(thickness), (puts @ taken)[None])[:, None] * puts * path
        more_p, *more_t, more_here = (
            by_loss * slope for slope in _slopes(lambda *values: debris.lost(at(*values)), around)
        )
        lies_p, lies_here = lies_p + more_p, lies_here + more_here
        lies_t = [own + more for own, more in zip(lies_t, more_t, strict=True)]
    lies_s: Array = np.hstack(
        [(np.array(lies_t) @ picked).sum(axis=0), np.diag(np.exp(-over.loss)) + lies_here @ reads]
    )
    mu_s, worn_s = np.hstack([mu_s, mu_t[2][:, None] * reads]), np.hstack([worn_s, worn_t[2] @ reads])
    return _Laws(friction(*around), rate, mu_p, mu_s, worn_p, worn_s, (lies_p, lies_s, reads))


def phase_tangent(
    system: Tribosystem,
    phase: int,
    pressure: Array,
    heat: CycleHeat | None = None,
    state: HeatState | None = None,
    conductance: Array | None = None,
    *,
    implicit: bool = True,
    worn: WornDepths | None = None,
) -> Array:
    """Return what a phase makes of small changes of temperature and worn depth (dim + n, dim + n); collective.

    With changes ds, dw at its start and dp of its pressure, d(mu p) = (mu + p mu_p) dp + p mu_s ds,

        ds' = P ds + Q d(mu p) + Q_h h_p dp,   dw' = dw + D_p dp + D_s ds,

    and where nodes are in contact the gap stays closed at its end, and the load balanced:

        dw' + G ds' + S dp + S_tau p dtau + H da = 0,   E dp + E_tau p dtau = 0,

    with dw in place of dw' where the wear is explicit. Debris stands beside the temperatures, after them: s has its
    thickness, which closes the gap, by that at the start of the phase where the wear is explicit. So does what creeps:
    s has its state, S is that of the grown compliances, and G of a state what it opens at the end of the phase.

    Args:
        system: The assembled problem.
        phase: Its number in the cycle.
        pressure: During it (n,), MPa.
        heat: Of cycles, at the friction there; None without heat.
        state: Temperatures at its start; None where nothing depends on them.
        conductance: Of each node (n,), N/(mm s K); by default that of the nodes with a pressure.
        implicit: Whether the wear is.
        worn: With debris, and the states that laws remember, which disturbances leave; by default those at the start.
    """
    n, interface, creep = len(pressure), system.interfaces[phase], system.creep
    laws, rigid = _laws(system, phase, pressure, heat, state, worn), interface.rigid
    dim = laws.mu_s.shape[1]
    friction_ratio, further = (system.phase_friction(phase, mu) for mu in (laws.mu, laws.mu + 1))
    by_mu = PressureCompliance(interface, further - friction_ratio).matrix()  # all are linear in mu
    balance_by_mu = rigid.equilibrium(further) - rigid.equilibrium(friction_ratio)
    traction_p, traction_s = pressure * laws.mu_p, pressure[:, None] * laws.mu_s
    gap_rows, before_s, state_s, state_p = _goes_on(laws, phase, pressure, heat, state, conductance, implicit=implicit)
    if creep is not None:
        crept = _creeping(creep, phase, (friction_ratio, further), traction_p, traction_s)
        none: Array = np.zeros((n, len(crept.stays)))
        laws = replace(laws, worn_s=np.hstack([laws.worn_s, none]))
        traction_s, before_s = np.hstack([traction_s, none]), np.hstack([before_s, none])
        gap_rows = np.hstack([gap_rows, crept.opened])
        state_s = np.block([[state_s, np.zeros((dim, none.shape[1]))], [crept.by_state, np.diag(crept.stays)]])
        state_p, dim = np.vstack([state_p, crept.by_pressure]), len(state_s)
    closed = pressure > 0
    k, r, scale = int(closed.sum()), rigid.rigid_normal.shape[1], interface.elastic_length
    opened = interface.compliance(friction_ratio).matrix() + by_mu * traction_p + gap_rows @ state_p
    by_state = by_mu @ traction_s + gap_rows @ state_s + before_s
    slope = system.layers.slope(pressure[None])
    if slope is not None:
        opened = opened + np.diag(slope[0])
    if implicit:
        opened, by_state = opened + laws.worn_p, by_state + laws.worn_s
    matrix: Array = np.zeros((k + r, k + r))
    matrix[:k, :k] = opened[np.ix_(closed, closed)] / scale
    matrix[:k, k:] = rigid.rigid_normal[closed]
    matrix[k:, :k] = (rigid.equilibrium(friction_ratio) + balance_by_mu * traction_p)[:, closed]
    disturbance: Array = np.zeros((k + r, dim + n))
    disturbance[:k, :dim] = by_state[closed] / scale
    disturbance[:k, dim:] = np.eye(n)[closed] / scale
    disturbance[k:, :dim] = balance_by_mu @ traction_s
    answer: Array = np.zeros((n, dim + n))
    answer[closed] = -np.linalg.solve(matrix, disturbance)[:k]
    change: Array = np.zeros((dim + n, dim + n))
    change[:dim, :dim], change[dim:, :dim], change[dim:, dim:] = state_s, laws.worn_s, np.eye(n)
    change[:dim] += state_p @ answer
    change[dim:] += laws.worn_p @ answer
    return change


def _goes_on(
    laws: _Laws,
    phase: int,
    pressure: Array,
    heat: CycleHeat | None,
    state: HeatState | None,
    conductance: Array | None,
    *,
    implicit: bool,
) -> tuple[Array, Array, Array, Array]:
    """Return what the state of heat and debris does in a phase.

    Returns:
        The gap by it at the end and at the start of the phase (n, dim), and itself at the end by what it was at the
        start (dim, dim) and by the pressure (dim, n).
    """
    n, dim = laws.mu_s.shape
    of_heat = 0 if heat is None else heat.dim
    gap_rows, before_s, state_s, state_p = (np.zeros(shape) for shape in ((n, dim), (n, dim), (dim, dim), (dim, n)))
    if heat is not None:
        gap_rows[:, :of_heat] = heat.gap_rows[phase]
        if conductance is None:
            conductance = heat.exchange.conductance(pressure)
        state_s[:of_heat], state_p[:of_heat] = _heated(heat, phase, pressure, state, laws, conductance)
    if laws.lies is not None:
        state_p[of_heat:], state_s[of_heat:], reads = laws.lies
        (gap_rows if implicit else before_s)[:, of_heat:] = -reads
    return gap_rows, before_s, state_s, state_p


class _Creeping(NamedTuple):
    """What creeps in a phase.

    Attributes:
        opened: Gap by its state (n, k).
        stays: What is left of its state (k,).
        by_state: Its state at the end by that of the heat (k, dim).
        by_pressure: By the pressures (k, n).
    """

    opened: Array
    stays: Array
    by_state: Array
    by_pressure: Array


def _creeping(creep: Creep, phase: int, ratios: tuple[Array, Array], traction_p: Array, traction_s: Array) -> _Creeping:
    """Return what creeps in a phase.

    Args:
        creep: All that does.
        phase: Its number.
        ratios: tau (n, d), and that of a friction that is larger by 1.
        traction_p, traction_s: What changes of pressure and of the state of the heat add to mu, times the pressure.
    """
    opened, stays, by_pressure = creep.tangent(phase, ratios[0])
    by_mu = creep.tangent(phase, ratios[1])[2] - by_pressure
    return _Creeping(opened, stays, by_mu @ traction_s, by_pressure + by_mu * traction_p)


def _heated(
    heat: CycleHeat, phase: int, pressure: Array, state: HeatState | None, laws: _Laws, conductance: Array
) -> tuple[Array, Array]:
    """Return the changes of the state at the end of a phase by those at its start, and by its pressure."""
    exchange = heat.exchange
    unit = exchange.with_friction(np.tile(laws.rate, (len(exchange.friction), 1)))
    by_power, _ = unit.change(phase, conductance, pressure=np.eye(len(pressure)))
    by_state, _ = exchange.change(phase, conductance, changes=np.eye(heat.dim))
    by_pressure: Array = by_power * (laws.mu + pressure * laws.mu_p)
    if state is not None and exchange.heat.conductance_per_pressure is not None:  # h_c is proportional to p
        rise = np.divide(conductance, pressure, out=np.zeros_like(pressure), where=pressure > 0)
        by_pressure += exchange.by_conductance(phase, state, pressure, conductance) * rise
    changes: Array = by_power @ (pressure[:, None] * laws.mu_s)
    changes[:, : heat.dim] += by_state
    return changes, by_pressure


def _picked(heat: CycleHeat | None, phase: int, n: int) -> Array:
    """Return the rows that pick the temperatures of both surfaces at the start of a phase (2, n, dim)."""
    if heat is None:
        return np.zeros((2, n, 0))
    return np.array(heat.exchange.contact_changes(np.eye(heat.dim), phase - 1))


def _opened(wear: PhasesWear, slope: Array) -> Array:
    """Return the gap (n, n) that depths worn off punch and strip open, for each unit at a node `slope` (2, n)."""
    punch, strip = (
        None if body is None else replace(body, rate=slope[k : k + 1], law=PressureLaw())
        for k, body in enumerate((wear.punch, wear.strip))
    )
    if punch is None and strip is None:
        return np.zeros((slope.shape[1],) * 2)
    left, right = replace(wear, punch=punch, strip=strip).border(slope[:1])
    return np.asarray(left[0] @ right[0])


def _slopes(law: Callable[..., Array], around: Sequence[Array]) -> list[Array]:
    """Return the derivatives of a law of (p, T_punch, T_strip), and of debris, node by node, to each of them.

    Central differences whose step is made smaller until it makes no difference; 0 where p is.
    """
    found = []
    for which, value in enumerate(around):
        step = 0.01 * value if which in (0, 3) else np.full(len(value), STEP)
        if which == 3:
            step = np.maximum(step, THIN)
        before: Array | None = None
        for _ in range(MAX_HALVINGS):
            ends = [law(*(v + sign * step if k == which else v for k, v in enumerate(around))) for sign in (1, -1)]
            difference = ends[0] - ends[1]
            slope = np.divide(difference, 2 * step, out=np.zeros_like(difference), where=step > 0)
            if before is not None and np.abs(slope - before).max() <= SETTLED * np.abs(slope).max():
                break
            before, step = slope, step / 4
        found.append(slope)
    return found


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


def _unstable_speed(stiffness: Array, thermal: NDArray[Any]) -> float:
    """Return the lowest V of p = -V X Theta p; infinite where there is none."""
    values = np.linalg.eigvals(-stiffness @ thermal)
    growing = values.real[(np.abs(values.imag) < 1e-6 * np.abs(values.real).max()) & (values.real > 0)]
    return float(1 / growing.max()) if len(growing) else float("inf")


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
    n = len(system.pair.weights)
    everywhere = np.ones(n, dtype=bool)
    friction_ratio = system.friction_ratio(direction)
    compliance = system.interface.compliance(friction_ratio).matrix()
    stiffness = _restricted_stiffness(system, friction_ratio, compliance, everywhere)
    speed = system.motion.mean_speed
    for _ in range(50):  # the strip's temperature depends on its speed
        exchange = steady_exchange(system, [direction * speed])
        uniform = np.full(n, system.rigid.mean_pressure)
        states, _terms = exchange.change(0, exchange.conductance(uniform), pressure=np.eye(n))
        thermal = exchange.gap_change(states) / speed
        before, speed = speed, system.team.lead(partial(_unstable_speed, stiffness, thermal))
        if np.isinf(speed):
            break
        if abs(speed - before) < 1e-6 * speed:
            break
    return speed
