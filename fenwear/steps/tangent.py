"""The response of a phase to small changes of temperature, wear and layers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fenwear.common.arrays import Array, Mask
from fenwear.heat.periodic_heat import CycleHeat
from fenwear.heat.temperature import HeatState
from fenwear.laws.friction import ContactConditions
from fenwear.laws.pressure_law import PressureLaw
from fenwear.laws.wear import PhasesWear, WornDepths
from fenwear.surfaces import Compliance, Interface
from fenwear.system import Tribosystem, heating_friction

STEP, MAX_HALVINGS, SETTLED = 1.0, 10, 1e-6  # of differences to temperatures, K; of their steps; of the slopes
THIN = 1e-9  # mm: the least of differences to the thickness of debris


def phase_tangent(
    system: Tribosystem,
    phase: int,
    pressure: Array,
    heat: CycleHeat,
    state: HeatState | None = None,
    conductance: Array | None = None,
    *,
    implicit: bool = True,
    worn: WornDepths | None = None,
) -> Array:
    """Return the response of a phase to small changes of temperature and worn depth (dim + n, dim + n); collective.

    With changes ds, dw at its start and dp of its pressure, d(mu p) = (mu + p mu_p) dp + p mu_s ds,

        ds' = P ds + Q d(mu p) + Q_h h_p dp,   dw' = dw + D_p dp + D_s ds,

    and where nodes are in contact the gap stays closed at its end, and the load balanced:

        dw' + G ds' + S dp + S_tau p dtau + H da = 0,   E dp + E_tau p dtau = 0,

    with dw in place of dw' where the wear is explicit. Debris stands beside the temperatures, after them: s has its
    thickness, which closes the gap, by that at the start of the phase where the wear is explicit. So does what creeps:
    s has its state, S is that of the grown compliances, and G of a state what it opens at the end of the phase.

    Args:
        system: The assembled problem.
        phase: Number of the phase in the cycle.
        pressure: During it (n,), MPa.
        heat: Of cycles, at the friction there.
        state: Temperatures at its start; None where nothing depends on them.
        conductance: Of each node (n,), N/(mm s K); by default that of the nodes with a pressure.
        implicit: Whether the wear is.
        worn: With debris, and the states that laws remember, which disturbances leave; by default those at the start.
    """
    n, interface, creep = len(pressure), system.elastic.interfaces[phase], system.elastic.creep
    laws, rigid = _laws(system, phase, pressure, heat, state, worn), interface.rigid
    dim = laws.mu_s.shape[1]
    friction_ratio, further = (system.phases.ratio(phase, mu) for mu in (laws.mu, laws.mu + 1))
    by_mu = Compliance(interface, (further - friction_ratio)[:, :, None], {}).matrix()  # all are linear in mu
    balance_by_mu = rigid.equilibrium(further) - rigid.equilibrium(friction_ratio)
    traction_p, traction_s = pressure * laws.mu_p, pressure[:, None] * laws.mu_s
    gap_rows, before_s, state_s, state_p = _goes_on(laws, phase, pressure, heat, state, conductance, implicit=implicit)
    crept, steeper = creep.tangent(phase, friction_ratio), creep.tangent(phase, further)
    by_mu_crept, seen_by_mu = steeper.by_pressure - crept.by_pressure, steeper.seen_by_pressure - crept.seen_by_pressure
    none: Array = np.zeros((n, len(crept.stay)))
    gap_by_p = gap_rows @ state_p + crept.opened @ (crept.seen_by_pressure + seen_by_mu * traction_p)
    gap_by_s = np.hstack([gap_rows @ state_s + crept.opened @ seen_by_mu @ traction_s, crept.opened * crept.seen])
    state_s = np.block([[state_s, np.zeros((dim, len(crept.stay)))], [by_mu_crept @ traction_s, np.diag(crept.stay)]])
    state_p, dim = np.vstack([state_p, crept.by_pressure + by_mu_crept * traction_p]), len(state_s)
    laws = replace(laws, worn_s=np.hstack([laws.worn_s, none]))
    traction_s, before_s = np.hstack([traction_s, none]), np.hstack([before_s + laws.closed_s, none])
    opened = interface.compliance(friction_ratio).matrix() + by_mu * traction_p + gap_by_p
    by_state = by_mu @ traction_s + gap_by_s + before_s
    opened = opened + np.diag(laws.closed_p)
    if implicit:
        opened, by_state = opened + laws.worn_p, by_state + laws.worn_s
    balance = rigid.equilibrium(friction_ratio) + balance_by_mu * traction_p
    gap: Array = np.hstack([by_state, np.eye(n)])
    missing: Array = np.hstack([balance_by_mu @ traction_s, np.zeros((len(balance), n))])
    answer = answered(interface, opened, balance, pressure > 0, gap, missing)
    change: Array = np.zeros((dim + n, dim + n))
    change[:dim, :dim], change[dim:, :dim], change[dim:, dim:] = state_s, laws.worn_s, np.eye(n)
    change[:dim] += state_p @ answer
    change[dim:] += laws.worn_p @ answer
    return change


def answered(interface: Interface, opened: Array, balance: Array, closed: Mask, gap: Array, missing: Array) -> Array:
    """Return the pressures (n, q) that q disturbances make where nodes stay closed, and the loads balanced.

    Args:
        interface: The surfaces.
        opened: Gap by the pressures (n, n).
        balance: E, forces along the rigid motions by the pressures (r, n).
        closed: Which nodes are (n,).
        gap: By each disturbance (n, q).
        missing: Of the balance, by each (r, q).
    """
    modes, scale, k = interface.rigid.rigid_normal, interface.elastic_length, int(closed.sum())
    matrix: Array = np.zeros((k + len(balance),) * 2)
    matrix[:k, :k], matrix[:k, k:] = opened[np.ix_(closed, closed)] / scale, modes[closed]
    matrix[k:, :k] = balance[:, closed]
    pressures: Array = np.zeros(gap.shape)
    pressures[closed] = -np.linalg.solve(matrix, np.vstack([gap[closed] / scale, missing]))[:k]
    return pressures


def lies_after(
    system: Tribosystem,
    phase: int,
    pressure: Array,
    heat: CycleHeat,
    state: HeatState | None,
    worn: WornDepths | None,
) -> WornDepths | None:
    """Return the depths with the debris at the end of a phase, from those at its start."""
    if worn is None or not system.layers.debris.present:
        return worn
    conditions = _conditions(system, phase, pressure, heat, state, worn)
    passing = system.phases.passing(system.phases.wear.phases([conditions], [phase]), [phase], None, [conditions])
    added, _ = passing.debris_changes(pressure[None], worn, None)
    return system.layers.with_thickness(worn, system.layers.lies(worn) + added)


def _goes_on(
    laws: _Laws,
    phase: int,
    pressure: Array,
    heat: CycleHeat,
    state: HeatState | None,
    conductance: Array | None,
    *,
    implicit: bool,
) -> tuple[Array, Array, Array, Array]:
    """Return the derivatives of the state of heat and debris in a phase.

    Returns:
        The gap's by the state at the end and at the start of the phase (n, dim), and the end state's by the state at
        the start (dim, dim) and by the pressure (dim, n).
    """
    n, dim = laws.mu_s.shape
    of_heat = heat.dim
    gap_rows, before_s, state_s, state_p = (np.zeros(shape) for shape in ((n, dim), (n, dim), (dim, dim), (dim, n)))
    gap_rows[:, :of_heat] = heat.gap_rows[phase]
    if conductance is None:
        conductance = heat.exchange.conductance(pressure, phase)
    state_s[:of_heat], state_p[:of_heat] = _heated(heat, phase, pressure, state, laws, conductance)
    if laws.lies is not None:
        state_p[of_heat:], state_s[of_heat:], reads = laws.lies
        (gap_rows if implicit else before_s)[:, of_heat:] = -reads
    return gap_rows, before_s, state_s, state_p


@dataclass(frozen=True)
class _Laws:
    """Friction and wear of a phase, and their derivatives to its pressure and to the temperatures at its start.

    Attributes:
        mu: (n,).
        rate: Sliding of each node for a unit of the stroke's law (n,): friction heat is mu p times that.
        mu_p: To the pressure of the same node (n,), 1/MPa.
        mu_s: To the state of the heat, and to the thickness of debris at its start where there is any, of L nodes where
            it lies (n, dim).
        worn_p, worn_s: Of the gap that the wear of the phase opens (n, n) and (n, dim).
        closed_p, closed_s: Of the closure of layers (n,) and (n, dim).
        lies: Of the thickness of debris at its end (L, n) and (L, dim), and what of it lies at the contact's nodes
            (n, L); None without.
    """

    mu: Array
    rate: Array
    mu_p: Array
    mu_s: Array
    worn_p: Array
    worn_s: Array
    closed_p: Array
    closed_s: Array
    lies: tuple[Array, Array, Array] | None = None


def _conditions(
    system: Tribosystem,
    phase: int,
    pressure: Array,
    heat: CycleHeat,
    state: HeatState | None,
    worn: WornDepths | None,
) -> ContactConditions:
    """Return the conditions of a phase, at the temperatures and with the layers of its start."""
    surfaces = None if state is None else heat.exchange.contact_temperatures(state, phase - 1)
    return system.phases.conditions(phase, pressure, surfaces, worn)


def _laws(
    system: Tribosystem,
    phase: int,
    pressure: Array,
    heat: CycleHeat,
    state: HeatState | None,
    worn: WornDepths | None = None,
) -> _Laws:
    n, conditions = len(pressure), _conditions(system, phase, pressure, heat, state, worn)
    lies = (np.asarray(conditions.debris),) if system.layers.debris.present else ()
    around = (pressure, *conditions.temperatures, *lies)

    def at(p: Array, punch: Array, strip: Array, *debris: Array) -> ContactConditions:
        return replace(conditions, pressure=p, temperatures=(punch, strip), debris=debris[0] if debris else 0.0)

    def friction(*values: Array) -> Array:
        return system.laws.friction.values(at(*values))

    def depths(*values: Array) -> Array:
        wear = system.phases.wear.phases([at(*values)], [phase])
        return np.array([body.depth(values[0][None])[0] for body in (wear.punch, wear.strip)])

    def closed(*values: Array) -> Array:
        return system.layers.at([phase]).under([at(*values)]).closing(values[0][None])[0]

    wear = system.phases.wear.phases([at(*around)], [phase])
    closed_p = system.layers.at([phase]).under([conditions]).slope(pressure[None])[0]
    _, *closed_t = _slopes(closed, around)
    mu_p, *mu_t = _slopes(friction, around)
    by_depths = _slopes(depths, around)
    worn_p, *worn_t = (_opened(wear, slope) for slope in by_depths)
    # The rows that pick the temperatures of both surfaces at the start of the phase (2, n, dim).
    picked: Array = np.array(heat.exchange.contact_changes(np.eye(heat.dim), phase - 1))
    rate = heating_friction(system, np.ones(n), phase)
    mu_s: Array = (np.array(mu_t[:2])[:, :, None] * picked).sum(axis=0)
    worn_s: Array = (np.array(worn_t[:2]) @ picked).sum(axis=0)
    closed_s: Array = (np.array(closed_t[:2])[:, :, None] * picked).sum(axis=0)
    laws = _Laws(friction(*around), rate, mu_p, mu_s, worn_p, worn_s, closed_p, closed_s)
    if not lies:
        return laws
    debris, taken = system.layers.debris, depths(*around).sum(axis=0)
    by_lost = _slopes(lambda *values: debris.lost(at(*values)), around)
    left, (lies_p, *lies_t, lies_here), reads = _lying(
        system, phase, conditions, by_depths, by_lost, taken, worn or system.unworn()
    )
    lies_s: Array = np.hstack([(np.array(lies_t) @ picked).sum(axis=0), left + lies_here @ reads])
    mu_s, worn_s = np.hstack([mu_s, mu_t[2][:, None] * reads]), np.hstack([worn_s, worn_t[2] @ reads])
    closed_s = np.hstack([closed_s, np.zeros_like(reads)])
    return replace(laws, mu_s=mu_s, worn_s=worn_s, closed_s=closed_s, lies=(lies_p, lies_s, reads))


def _lying(
    system: Tribosystem,
    phase: int,
    conditions: ContactConditions,
    by_depths: Sequence[Array],
    by_lost: Sequence[Array],
    taken: Array,
    worn: WornDepths,
) -> tuple[Array, list[Array], Array]:
    """Return the derivatives of debris in a phase.

    Args:
        system: The assembled problem.
        phase: Number of the phase.
        conditions: In it.
        by_depths, by_lost: Derivatives of what both bodies lose and of what is lost over a unit of sliding, to the
            pressure, the temperatures and the thickness of debris at the nodes of the contact.
        taken: Wear of both bodies (n,), mm.
        worn: With the debris at the start.

    Returns:
        Its remaining share (L, L), its derivatives at the end (L, n), and its part at the contact's nodes (n, L).
    """
    layers, pair, path = system.layers, system.sliding.pairs[phase], system.sliding.path[phase]
    reads, puts = np.eye(len(path)), np.eye(len(path))
    if layers.strip_carries:
        reads, puts = pair.wear_interpolation.toarray(), pair.wear_projection.toarray()
    over, thickness = layers.debris.over(path[None], [conditions], layers.places([pair])), layers.lies(worn)
    fed = over.slope(None)[0][:, None] * puts
    ends = [fed * by_depth.sum(axis=0) for by_depth in by_depths]
    if layers.varies:
        by_loss = over.by_loss(thickness, (puts @ taken)[None])[:, None] * puts * path
        ends = [end + by_loss * lost for end, lost in zip(ends, by_lost, strict=True)]
    return np.diag(np.exp(-over.loss)), ends, reads


def _heated(
    heat: CycleHeat, phase: int, pressure: Array, state: HeatState | None, laws: _Laws, conductance: Array
) -> tuple[Array, Array]:
    """Return the changes of the state at the end of a phase by those at its start, and by its pressure."""
    exchange = heat.exchange
    unit = exchange.with_friction(np.tile(laws.rate, (len(exchange.friction), 1)))
    by_power, _ = unit.change(phase, conductance, pressure=np.eye(len(pressure)))
    by_state, _ = exchange.change(phase, conductance, changes=np.eye(heat.dim))
    by_pressure: Array = by_power * (laws.mu + pressure * laws.mu_p)
    rise = exchange.conductance_slope(pressure, phase)
    if state is not None and rise.any():
        by_pressure += exchange.by_conductance(phase, state, pressure, conductance) * rise
    changes: Array = by_power @ (pressure[:, None] * laws.mu_s)
    changes[:, : heat.dim] += by_state
    return changes, by_pressure


def _opened(wear: PhasesWear, slope: Array) -> Array:
    """Return the gap (n, n) that depths worn off punch and strip open, for each unit at a node `slope` (2, n)."""
    punch, strip = (
        replace(body, rate=slope[k : k + 1], law=PressureLaw()) for k, body in enumerate((wear.punch, wear.strip))
    )
    left, right = replace(wear, punch=punch, strip=strip).border(slope[:1])
    return np.asarray(left[0] @ right[0])


def _slopes(law: Callable[..., Array], around: Sequence[Array]) -> list[Array]:
    """Return the derivatives of a law of (p, T_punch, T_strip), and of debris, node by node, to each of them.

    Central differences whose step is made smaller until it makes no difference; 0 where p is.
    """
    slopes = []
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
        slopes.append(slope)
    return slopes
