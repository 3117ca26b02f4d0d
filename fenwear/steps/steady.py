"""The cyclic steady state: the end of implicit steps of ever so many cycles, each one inequality.

At the end the wear of a cycle is a rigid motion of the punch, H lambda, and the shape no longer changes but for it:

    gap_k = S_k p_k + H a_k + omega >= 0,  p_k >= 0,  p_k gap_k = 0     for each phase,
    beta~ (sum of S_k p_k^b) - H lambda >= 0,

with the equilibrium of each phase. Where the motion outruns the wear for ever the surface opens without limit.

The steady state is the root of the change M of the state y in a cycle, up to that motion. Stages of a jump find it,
z = y + N M(z), of N cycles each (`jump_step`): implicit Euler's steps of one length, FAR over the rate of running in.
Each divides the distance from the end by about that factor (pseudo-transient continuation, C. T. Kelley, D. E. Keyes,
SIAM J. Numer. Anal. 35, 1998). Heat, creep, layers and states reach their ends within such a step.

Wear of the strip joins where it keeps the strip's shape: sliding out of the plane, or on a closed
track. Under a punch that goes to and fro the strip's track deepens for ever, most where every
position touches it: there is no state that repeats.

Where properties of materials depend on the temperature, state and bodies follow each other; see
`fenwear.steps.slow_changes`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
import scipy
from scipy.sparse import block_diag, csr_array, eye_array, hstack, vstack

from fenwear.case.body_names import with_body_names
from fenwear.common.arrays import Array, Mask
from fenwear.common.errors import CaseError, ConvergenceError
from fenwear.contact.complementarity import complementarity_error
from fenwear.heat.conduction import no_heat_sink
from fenwear.heat.temperature import HeatState
from fenwear.laws.wear import STIFF, WornDepths
from fenwear.steps.block import Block
from fenwear.steps.coupled_phases import end_temperatures
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import jump_within
from fenwear.steps.jump_method import FINE
from fenwear.steps.jump_step import JumpMoment, Stepper
from fenwear.steps.program_stages import at_step
from fenwear.steps.run_state import RunState, beginning, pressure_scale
from fenwear.steps.slow_changes import with_own_properties
from fenwear.system import (
    Tribosystem,
    friction_power,
    with_reduced_heat,
)

# Lengths of steps over the elastic gap of the mean pressure by its wear of a cycle; from afar they grow.
FAR, MIDWAY = 1e3, 30.0
NEAR = (0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0)
MOST, RESTING = 12, 1e-8  # steps that far; change of the shape in a step over the elastic gap, that ends them
DIGITS = 1e-9  # of contacts and heat
NEARLY = 1e-4 / DIGITS  # of these digits: what contacts on the way are solved to
APART = 1e-9  # of gaps by rigid motions: what is rounding
ALONG = 1e-9  # cosine between loads and a motion: what is along none
ZERO = 1e-12  # of the largest: a velocity that is rounding
JUMPS = 0.3  # tolerance of jumps over the distance that is looked for
BESIDE = 0.05  # of the cycles: how far the last two ends are apart between which they are interpolated
REFINED, SETTLED = 3, 0.02  # times that the jump across it is made again; change of the cycles that ends it
NOTHING_WEARS = (
    "no unique cyclic steady state exists: pressures below the pressure_threshold balance the loads, and nothing "
    "wears. Reduce pressure_threshold, and set a wear coefficient above zero"
)
NO_ONE_MOTION = (
    "no cyclic steady state exists: no single rigid motion follows the wear of all nodes under pressure. This happens "
    "where loads press a body to either side in turn, and both sides wear without end. Follow the wear by `run`"
)


@dataclass(frozen=True, repr=False)
class SteadyHeat:
    """The temperatures of the cyclic steady state.

    Attributes:
        punch: Of the punch's contact surface at the end of each half-cycle (half_cycles, n), K.
        strip: Of the strip's (half_cycles, n), K.
        end: Of the whole bodies at the end of a cycle, which is its beginning.
    """

    punch: Array
    strip: Array
    end: HeatState

    def __repr__(self) -> str:
        """Say in a line what it is."""
        return f"<SteadyHeat: largest temperature {max(self.punch.max(), self.strip.max()):.5g} K>"


@dataclass(frozen=True, repr=False)
class SteadyState:
    """The cyclic steady state; for one-way sliding the steady state, equal to the optimum.

    Attributes:
        directions: Sliding direction of each half-cycle.
        pressure: In the middle position of each half-cycle (half_cycles, n), MPa.
        phase_pressure: In every phase, that is in every position (phases, n), MPa.
        gap: The same (half_cycles, n), mm.
        shape: Worn depth without its rigid part (n,), mm; NaN where the surfaces never touch.
        closest_shape: The same; where they never touch the least depth that keeps them apart (n,), mm.
        contact_width: Width in contact there (half_cycles,), mm.
        wear_per_cycle: Depth worn off both bodies in a cycle (n,), mm.
        velocity: Rigid-body wear lambda per cycle of each mode: mm and rad.
        debris: Thickness of the third body (n,), mm: what a cycle feeds, times its life; None without.
        crept: Depth that has crept (n,), mm, at the end of a cycle.
        states: States of laws, at rest, at the start of a cycle, by their names (n,); those of the strip's
            material by `NAME_strip` (n_strip,).
        iterations: Newton iterations.
        seconds: Wall time of the solve.
        heat: Temperatures; None without heat.
        coordinates: Of the contact nodes (n, 2) or (n, 3), mm: x and z; of rings r and z, of solids x, y and z.
        system: System of the state: with the properties at its temperatures, where they depend on them.
        passes: Number of updates of the properties; 0 where they are constants.
        conductances: By which its temperatures have come about (phases, n), N/(mm s K), NaN where none conducts; None
            without heat.
    """

    directions: tuple[int, ...]
    pressure: Array
    phase_pressure: Array
    gap: Array
    shape: Array
    closest_shape: Array
    contact_width: Array
    wear_per_cycle: Array
    velocity: dict[str, float]
    iterations: int
    seconds: float
    heat: SteadyHeat | None = None
    coordinates: Array = field(kw_only=True)
    system: Tribosystem = field(kw_only=True)
    passes: int = field(default=0, kw_only=True)
    conductances: Array | None = field(default=None, kw_only=True)
    debris: Array | None = field(default=None, kw_only=True)
    crept: Array = field(default_factory=lambda: STIFF, kw_only=True)
    states: dict[str, Array] = field(default_factory=dict, kw_only=True)

    @property
    def x(self) -> Array:
        """Abscissae of the contact nodes (n,), mm."""
        return self.coordinates[:, 0]

    @property
    def complementarity_error(self) -> float:
        """Largest error of p >= 0, gap >= 0 and p gap = 0 in any half-cycle, over their scales."""
        return float(complementarity_error(self.pressure, self.gap, self.system.elastic.interface.elastic_length).max())

    def __repr__(self) -> str:
        """Say in a line what it is."""
        n, most = len(self.coordinates), self.pressure.max()
        return f"<Steady: {n} contact nodes, {len(self.directions)} half-cycles, largest pressure {most:.5g} MPa>"


@with_body_names
def steady(system: Tribosystem, *, properties_within: float | None = None) -> SteadyState:
    """Solve for the cyclic steady state; collective.

    With heat the temperatures are periodic too; their reduced form is used whatever heat.operator is. Of a case with a
    program it is the state of what acts at the end of its last step: see `at_step` for another one. Where nodes stick
    or slip by themselves it is the shape to which partial slip wears, `steps.stick_final.FinalShape`.

    Args:
        system: The assembled problem.
        properties_within: Relative change of the materials' properties that is left where they depend on the
            temperature; by default a tenth of heat.property_tolerance.

    Raises:
        CaseError: with heat, a body that loses heat nowhere, or more nodes than fit into the memory; a property that is
            not positive; a program at whose end nothing slides.
        ConvergenceError: the inequality did not converge, or not with the nodes that conduct, or not with the
            properties of the temperatures.
    """
    system = at_step(system)
    state: SteadyState = system.law.end(system, properties_within)
    return state


def steady_state(system: Tribosystem, properties_within: float | None = None) -> SteadyState:
    """Return the cyclic steady state of gross sliding, see `steady`; collective."""
    begin = time.perf_counter()
    state, passes = with_own_properties(system, _of_these_bodies, _temperatures, properties_within)
    return replace(state, passes=passes, seconds=time.perf_counter() - begin)


def _temperatures(state: SteadyState) -> HeatState | None:
    """Return the temperatures of the whole bodies at the end of a cycle; None without heat."""
    return None if state.heat is None else state.heat.end


def _of_these_bodies(system: Tribosystem) -> SteadyState:
    """Return the state of the bodies as they are, whatever its temperatures; collective."""
    system.team.lead(lambda: _check_exists(system))
    prepared = system.team.serve(_elastic(with_reduced_heat(system)))  # as which a state of one rank names its bodies
    _check_sinks(prepared)
    end = _End(prepared, system.layers.hardness)

    def state_of_bodies() -> SteadyState:
        try:
            return end.state()
        except ConvergenceError as error:
            raise ConvergenceError(_why_none(prepared, error)) from error

    return replace(prepared.team.lead(state_of_bodies), system=system)


def _elastic(system: Tribosystem) -> Tribosystem:
    """Return the system with surfaces of unlimited hardness: at the end nothing flows any more."""
    if system.layers.hardness == np.inf:
        return system
    friction = system.sliding.friction
    contact = friction.contact.model_copy(update={"hardness": None})
    return replace(system, sliding=replace(system.sliding, friction=replace(friction, contact=contact)))


def _why_none(system: Tribosystem, error: ConvergenceError) -> str:
    """Return why there is no state, as far as it is known.

    Raises:
        ConvergenceError: states of laws have no end.
    """
    wear, shape = system.phases.mean_wear, (len(system.motion.phases), len(system.pair.weights))
    if float(wear.opening(np.full(shape, system.elastic.interface.pressure_scale)).max()) == 0:
        return NOTHING_WEARS
    system.phases.rested(
        [system.phases.conditions(phase) for phase in range(len(system.motion.phases))]
    )  # or tells what goes on
    if _loads_oppose(system):
        return NO_ONE_MOTION
    if wear.cap < np.inf:
        return _none_under_cap(system)
    if system.layers.debris.present:  # it presses most where it is thickest, and comes from where it presses
        return (
            f"{error}; where much debris lies between, there may be several states, or none that is stable. Follow "
            "it by `run`, or give the debris a shorter life"
        )
    if system.sliding.strip_wears or _uniform_wear_exists(system):
        return str(error)
    return (
        f"{error}; no cyclic steady state exists: friction tips the punch so far that no pressures wear the whole "
        "contact by a rigid motion. Reduce the friction, lower the pin or widen the contact"
    )


def _check_sinks(system: Tribosystem) -> None:
    """Raise where a body loses heat nowhere; collective."""
    if not system.exchange.conducts:
        return
    heat = system.exchange.heat
    shares = (heat.partition, 1 - heat.partition) if heat.conductance == 0 else (1.0, 1.0)
    for body, side, share in zip(system.bodies.heat, system.exchange.sides, shares, strict=True):
        if not side.cooled:
            power = share * (1 - heat.debris) * friction_power(system)
            raise CaseError(no_heat_sink(body.body.name, body.enough_convection(power)))


def _check_exists(system: Tribosystem) -> None:
    """Raise where the strip's wear never comes to a shape that stays, or no one rigid motion can follow it."""
    if system.sliding.strip_wears and system.sliding.to_and_fro:
        raise ConvergenceError(
            "no cyclic steady state exists: the strip wears, and under a punch that moves to and fro its track deepens "
            "without end. Follow the wear by `run` with run.integration = "
            '"jump", or remove wear.strip'
        )
    if system.case.passing_laws:
        raise ConvergenceError(
            f"no cyclic steady state exists: {system.case.passing_laws[0]} changes with the worn depth or the distance "
            "slid, as long as it slides. Follow the wear by `run`"
        )
    if system.elastic.creep.endless:
        raise ConvergenceError(
            f"no cyclic steady state exists: {system.elastic.creep.endless} grows with the logarithm of time, for "
            "ever. Follow it by `run`, or give it terms alone"
        )
    if not np.abs(system.rigid.rigid_normal).max(initial=0.0):
        raise ConvergenceError(
            "no cyclic steady state with any pressure exists: supports hold the bodies along the contact's normal, so "
            "that wear continues until no pressure is left. Follow the wear by `run`"
        )
    rigid_of_phases(system)


def _loads_oppose(system: Tribosystem) -> bool:
    """Return whether no rigid motion is along the loads of all phases that slide.

    Worn depths of a cycle are H v, so that, without friction, sum of w p (H v) = -F v is positive for the loads F of
    each phase that wears, on the motions H of the middle position.
    """
    pairs = zip(system.elastic.interfaces, rigid_of_phases(system), strict=True)
    loads = np.array([-interface.rigid.resultant @ np.linalg.pinv(turned) for interface, turned in pairs])
    loads = loads[system.sliding.path.max(axis=1) > 0]
    loads = loads / system.rigid.mode_lengths
    sizes = np.linalg.norm(loads, axis=1)
    loads = loads[sizes > 0] / sizes[sizes > 0, None]
    if not len(loads):
        return False
    along = scipy.optimize.linprog(  # the largest t with F v >= t for all of them
        np.append(np.zeros(loads.shape[1]), -1.0),
        np.hstack([-loads, np.ones((len(loads), 1))]), np.zeros(len(loads)),
        bounds=[*[(-1.0, 1.0)] * loads.shape[1], (None, 1.0)],
    )  # fmt: skip
    return bool(along.status == 0 and -along.fun <= ALONG)


def _none_under_cap(system: Tribosystem) -> str:
    """Return why there is no state where wear grows no more beyond a cap."""
    mean, cap = system.elastic.interface.pressure_scale, system.phases.mean_wear.cap
    laws = zip(("punch", "strip"), system.sliding.wear, strict=True)
    keys = [
        f"wear.{body}.{'pressure_cap' if law.per_area is None else 'touching_from'}"
        for body, law in laws
        if law.cap == cap
    ]
    why = (
        "the mean pressure is above it, so that all nodes wear at one rate in any shape"
        if cap <= mean
        else "no pressures wear the contact by a rigid motion"
    )
    return (
        f"no cyclic steady state exists with {keys[0]} = {cap:.4g} MPa: above it wear does not grow with pressure, and "
        f"{why}. The mean pressure is {mean:.4g} MPa. Raise the cap, or follow the wear by `run`"
    )


class _End:
    """The end of ever so many cycles of bodies as they are; made on all ranks.

    Args:
        system: The bodies, with reduced heat, of unlimited hardness.
        hardness: From which on surfaces flow, MPa.
    """

    def __init__(self, system: Tribosystem, hardness: float) -> None:
        self.system, self.hardness, self.stepper = system, hardness, Stepper(system, DIGITS, periodic=True)
        above = max(law.pressure_threshold for law in system.sliding.wear)
        even = np.full(
            (len(system.motion.phases), len(system.pair.weights)), system.elastic.interface.pressure_scale + above
        )
        self._rate = float(system.phases.mean_wear.opening(even).max()) / len(even)

    def state(self) -> SteadyState:
        """Return the state.

        Raises:
            ConvergenceError: a step did not converge, or what it changes is no rigid motion in the end.
        """
        if self._rate == 0:
            raise ConvergenceError(NOTHING_WEARS)
        wear = self.system.phases.mean_wear
        loads_vary = (MIDWAY,) if self.system.motion.steps else ()
        try:
            end = self._resting(loads_vary if wear.punch.linear and wear.strip.linear else NEAR[::2])
        except ConvergenceError:
            end = self._resting(NEAR)
        return self._state(end)

    def _resting(self, lengths: Sequence[float]) -> JumpMoment:
        """Return the end of steps of these lengths, and then of FAR, when the shape rests but for a rigid motion."""
        system, interface, begin = self.system, self.system.elastic.interface, beginning(self.system)
        gap = interface.pressure_scale * interface.elastic_length
        at = self.stepper.moment(replace(begin, worn=begin.worn + self._coatings))
        near, far = [(length, NEARLY) for length in (*lengths, FAR)], [(FAR, FINE)] * MOST
        for length, digits in (*near, *far):
            then = self.stepper.stage(at, length * gap / self._rate, 0.0, at.contact, digits)
            touched = then.contact.pressure.max(axis=0) > 0
            moved = _rigid_part(system, self._shape(then.worn), touched)
            changed = self._shape(then.worn) - self._shape(at.worn)
            change = np.abs(changed - _rigid_part(system, changed, touched))[touched].max()
            if digits == FINE and change <= RESTING * gap:
                return then
            at = (
                then
                if system.laws.any_coating
                else replace(then, worn=replace(then.worn, punch=then.worn.punch - moved))
            )
        raise ConvergenceError(f"the cyclic steady state did not converge in {MOST} steps")

    @property
    def _coatings(self) -> WornDepths:
        """Depths at which all coatings are worn through."""
        punch, strip = self.system.laws.coatings
        return replace(self.system.unworn().times(0.0), punch=punch, strip=strip)

    def _shape(self, worn: WornDepths) -> Array:
        """Return the gap that depths and layers at rest open (n,), mm."""
        system = self.system
        if system.phases.track_changes:
            worn = replace(worn, carried=0 * worn.carried)
        return system.gap(0, worn) - system.pair.initial_gap

    def _state(self, end: JumpMoment) -> SteadyState:
        """Return the state at the end of steps."""
        system, contact, stepper = self.system, end.contact, self.stepper
        if float(contact.pressure.max()) >= self.hardness:
            raise ConvergenceError(
                f"no cyclic steady state without plastic flow exists: its largest pressure reaches contact.hardness = "
                f"{self.hardness:.4g} MPa. The surface would flow in every cycle. Follow it by `run`"
            )
        assert end.rate is not None
        wear, conductances = stepper.wear, end.rate.conductances
        weights, motion, worn = system.pair.weights, system.motion, wear.opening(contact.pressure)[0]
        if worn.max() <= DIGITS * self._rate:
            raise ConvergenceError(NOTHING_WEARS)
        touched = contact.pressure.max(axis=0) > 0
        capped = contact.pressure[contact.pressure > 0] >= (1 - DIGITS) * wear.cap
        per_area = any(law.per_area is not None for law in system.sliding.wear)
        if (not per_area and capped.all()) or (len(contact.pressure) == 1 and capped.any()):
            raise ConvergenceError(_none_under_cap(system))
        shape = self._shape(end.worn)
        closest = np.where(touched, shape, shape - contact.gap.min(axis=0))
        closest = closest - _rigid_part(system, shape, touched)
        depths = np.linalg.lstsq(
            system.rigid.rigid_normal[touched] / system.rigid.mode_lengths, worn[touched], rcond=None
        )[0]
        depths = np.where(np.abs(depths) > ZERO * np.abs(depths).max(initial=0.0), depths, 0.0)
        middle = slice(motion.positions // 2, None, motion.positions)
        passing, rest = (
            system.phases.passing(wear, conditions=stepper.conditions),
            system.phases.rested(stepper.conditions),
        )
        return SteadyState(
            motion.stroke_directions,
            contact.pressure[middle],
            contact.pressure,
            contact.gap[middle],
            np.where(touched, closest, np.nan),
            closest,
            (contact.pressure[middle] > 0) @ weights,
            worn,
            dict(zip(system.rigid.mode_names, (depths / system.rigid.mode_lengths).tolist(), strict=True)),
            contact.iterations,
            0.0,
            self._heat(end, conductances) if stepper.coupled.heat.dim else None,
            coordinates=system.pair.punch.x,
            system=system,
            conductances=conductances,
            debris=passing.resting(contact.pressure) if system.layers.debris.present else None,
            crept=system.elastic.creep.depth(end.worn.crept),
            states=system.layers.memory.by_name(system.layers.held(rest)),
        )

    def _heat(self, end: JumpMoment, conductances: Array) -> SteadyHeat:
        """Follow the temperatures through one cycle of the steady state."""
        coupled, positions = self.stepper.coupled, self.system.motion.positions
        heated = coupled.mu * end.contact.pressure
        surfaces, after = end_temperatures(coupled.heat, end.temperature, heated, conductances)
        ends = surfaces[positions - 1 :: positions]  # the last phase of each half-cycle
        return SteadyHeat(ends[:, 0], ends[:, 1], after)


def rigid_of_phases(system: Tribosystem) -> Array:
    """Return the matrices from each phase's rigid motions to those of the middle position (m, modes, modes).

    A strip that is free to move and passes as a whole opens in each place the same gaps by other motions, as where it
    tilts about a point that moves with it: H_k = H T_k. So wear that a motion follows in one place one follows in all.

    Raises:
        ConvergenceError: they open other gaps: to follow the wear takes H_k lambda_k of one shape in all phases.
    """
    middle, matrices = system.rigid.rigid_normal, []
    for rigid in system.rigids:
        here = rigid.rigid_normal
        turned = np.linalg.lstsq(middle, here, rcond=None)[0]
        back = here @ np.linalg.lstsq(here, middle, rcond=None)[0]
        if max(np.abs(middle @ turned - here).max(), np.abs(back - middle).max()) > APART * np.abs(middle).max():
            raise ConvergenceError(
                "no cyclic steady state exists, and no shape stays. The rigid motions that follow the wear in one "
                "position of the strip open the contact in another. This happens where only a strip on a hinge "
                "moves. Follow the wear by `run`"
            )
        matrices.append(turned)
    return np.array(matrices)


def _uniform_wear_exists(system: Tribosystem) -> bool:
    """Return whether any pressures of the phases wear the whole contact by a rigid motion (b = 1)."""
    n, r = system.rigid.rigid_normal.shape
    m, lengths = len(system.motion.phases), system.rigid.mode_lengths
    balances: list[Array] = []
    target: list[Array] = [np.zeros(n)]
    for interface, friction_ratio in zip(system.elastic.interfaces, system.phases.ratios(), strict=True):
        balances.append(interface.rigid.equilibrium(friction_ratio) / lengths[:, None])
        target.append(-interface.rigid.resultant / lengths)
    motion = -system.rigid.rigid_normal / lengths
    uniform = hstack([eye_array(n)] * m + [motion])
    equality = vstack([uniform, hstack([block_diag(balances), csr_array((m * r, r))])], format="csr")
    bounds = [(0, None)] * (m * n) + [(None, None)] * r
    return bool(
        scipy.optimize.linprog(np.zeros(m * n + r), A_eq=equality, b_eq=np.concatenate(target), bounds=bounds).status
        != 2
    )


def _rigid_part(system: Tribosystem, values: Array, where: Mask) -> Array:
    """Return the rigid motion that fits `values` best in the weighted least-squares sense."""
    modes = system.rigid.rigid_normal
    root = np.sqrt(system.pair.weights * where)
    values = np.where(where, values, 0.0)
    return modes @ np.linalg.lstsq(modes * root[:, None], values * root, rcond=None)[0]


@dataclass(frozen=True)
class RunningIn:
    """The number of cycles in which the pressures come near to those of a steady state.

    Attributes:
        cycles: From the initial shape; no whole number, so that it has derivatives.
        uncertainty: Of these, by the tolerance of the jumps and by the curve that is laid through them.
        ends: Cycles at whose ends jumps on the way ended; the level lies at about the last but one.
    """

    cycles: float
    uncertainty: float
    ends: tuple[int, ...] = ()


def cycles_to_reach(system: Tribosystem, state: SteadyState, fraction: float, limit: int = 10_000_000) -> int | None:
    """Return after how many cycles from the initial shape the pressures come this near to the end, see `running_in`."""
    running = running_in(system, state, fraction, limit)
    return None if running is None else round(running.cycles)


def running_in(
    system: Tribosystem,
    state: SteadyState,
    fraction: float,
    limit: int = 10_000_000,
    *,
    jumps: float = JUMPS,
    ends: Sequence[int] = (),
) -> RunningIn | None:
    """Return after how many cycles from the initial shape the pressures come this near to the end; collective.

    Found by a run of cycle jumps. Between two of them the distance is taken to decay exponentially; the jump across it
    is made again to where that leads, until that no longer changes. A last jump goes a little further, so that the
    cycle at which the level is reached is interpolated between two that are near to it. Pressures that are off by the
    tolerance of the jumps, a share s of the distance, put the cycles off by s over the rate of decay.

    Args:
        system: The assembled problem. Its properties stay: where they depend on the temperature take the state's own.
        state: The steady state.
        fraction: Of the pressure scale.
        limit: Cycles tried; None is returned beyond.
        jumps: Tolerance of the jumps over the fraction.
        ends: Of a problem nearby, whose jumps this one is to follow: the result is then smooth in what they differ by.
    """
    goal = system.team.lead(lambda: fraction * pressure_scale(system, state.phase_pressure))
    way, tolerance = _Way(system, state, goal), jumps * fraction
    if ends:  # of which the last two are near to the level
        start = replace(beginning(system), jump_length=ends[-1])
        *_, low, high = way.passed(ends[-1], np.inf, start, ends)
        return RunningIn(way.leads(low.meets, high), np.inf, tuple(ends))
    before = list[_Passed]()
    for high in way.passed(limit, tolerance):
        if high.distance < goal:
            break
        before.append(high)
    else:
        return None
    if not before or high.distance == 0:
        return RunningIn(high.cycles, high.cycles)
    first = before[-1]
    cycles, uncertainty = way.across(first, high, tolerance, jumps)
    near = max(round(cycles), first.cycles + 1)
    stops = near, near + max(1, round(BESIDE * cycles))
    passed = list(way.passed(stops[1], tolerance, first.end, stops))
    reached = way.leads(passed[-2].meets, passed[-1])
    if not np.isfinite(reached):
        return RunningIn(cycles, uncertainty)
    return RunningIn(reached, uncertainty, tuple(moment.cycles for moment in (*before, *passed)))


@dataclass(frozen=True)
class _Passed:
    """A jump's end on the way to a steady state.

    Attributes:
        cycles: Done.
        distance: Of its pressures from those of the state, MPa.
        end: The state that the run continues from.
    """

    cycles: int
    distance: float
    end: RunState

    @classmethod
    def of(cls, block: Block, state: SteadyState) -> _Passed:
        """Return the end of a jump."""
        distance = float(np.abs(block.pressure - state.pressure).max())
        return cls(int(block.half_cycle[-1]) // len(state.directions), distance, block.end)

    def meets(self, later: _Passed, goal: float) -> float:
        """Return the cycles at which an exponential through both ends meets the goal; NaN where it does not decay."""
        if not 0 < later.distance < self.distance:
            return float("nan")
        rate = np.log(self.distance / later.distance) / (later.cycles - self.cycles)
        return float(self.cycles + np.log(self.distance / goal) / rate)

    def until(self, later: _Passed, goal: float) -> float:
        """Return after how many cycles the distance is this one, where it decays exponentially from here to later."""
        decayed = np.log(self.distance / max(later.distance, 1e-300))
        share = np.log(self.distance / goal) / decayed if decayed > 0 else 1.0
        return self.cycles + float(np.clip(share, 0.0, 1.0)) * (later.cycles - self.cycles)


@dataclass(frozen=True)
class _Way:
    """The way to a steady state.

    Attributes:
        system: The assembled problem.
        state: The steady state.
        goal: Distance of the pressures from its own, MPa.
    """

    system: Tribosystem
    state: SteadyState
    goal: float

    def passed(
        self, until: int, tolerance: float, start: RunState | None = None, stops: Sequence[int] = ()
    ) -> Iterator[_Passed]:
        """Yield the ends of the jumps of a run of so many cycles, which stop at some of them; collective."""
        phases = len(self.state.directions)
        ends = frozenset(phases * stop for stop in stops)
        limits = RunLimits(until * phases, block=phases, stops=ends)
        for block in jump_within(self.system, limits, tolerance=tolerance, start=start):
            yield _Passed.of(block, self.state)

    def leads(self, law: Callable[[_Passed, float], float], later: _Passed) -> float:
        """Return the cycles at which a law of decay to a later end meets the goal, as rank 0 computes them."""
        return self.system.team.lead(partial(law, later, self.goal))

    def across(self, low: _Passed, high: _Passed, tolerance: float, share: float) -> tuple[float, float]:
        """Return the cycles at the goal between two ends, by jumps made again to there, and their uncertainty.

        Args:
            low, high: The ends.
            tolerance: Of the jumps.
            share: Of the goal, that it is.
        """
        cycles = before = self.leads(low.until, high)
        for _ in range(REFINED):
            if not low.cycles < round(cycles) < high.cycles:
                break
            *_, between = self.passed(round(cycles), tolerance, low.end)
            low, high = (low, between) if between.distance < self.goal else (between, high)
            before, cycles = cycles, self.leads(low.until, high)
            if abs(cycles - before) < SETTLED * cycles:
                break
        life = (high.cycles - low.cycles) / max(np.log(low.distance / max(high.distance, 1e-300)), 1e-300)
        return cycles, share * life + abs(cycles - before)
