"""The cyclic steady state in one inequality, without any time stepping.

At the end the wear of a cycle is a rigid motion of the punch, H lambda, and the shape omega (worn
depth, initial gap and the rigid motion of the first phase together) no longer changes:

    gap_k = S_k p_k + H a_k + omega + g_load >= 0,  p_k >= 0,  p_k gap_k = 0     for each phase,
    beta~ (sum of S_k p_k^b) - H lambda >= 0,  omega <= a bound far above any elastic gap,

with the equilibrium of each phase; a of the first phase is zero by the choice of omega. Where the
wear outruns the rigid motion for ever the surface opens without limit: there omega is at its bound.

Wear of the strip joins where it keeps the strip's shape: sliding out of the plane, or on a closed
track. Under a punch that goes to and fro the strip's track deepens for ever, most where every
position touches it: there is no state that repeats.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import csr_array

from fenwear.arrays import Array, Mask
from fenwear.assembly import Tribosystem
from fenwear.contact import ContactState
from fenwear.contact.inequality import Inequality
from fenwear.contact.operators import Operator
from fenwear.contact.worn_shape import ShapeEquations
from fenwear.cycle.coupled import Coupled
from fenwear.cycle.jump import jump
from fenwear.cycle.state import pressure_scale
from fenwear.errors import CaseError, ConvergenceError
from fenwear.heat.conduction import no_heat_sink
from fenwear.heat.periodic import CycleHeat
from fenwear.sliding.friction import ContactConditions

DRIVE = 1e-6  # scaled stiffness of the shape at nodes that are open in all phases
ZERO = 1e-12  # of the largest: a velocity that is rounding
OPEN = 1e4  # bound of omega over the elastic gap of the mean pressure: never touched again


@dataclass(frozen=True, repr=False)
class SteadyHeat:
    """The temperatures of the cyclic steady state.

    Attributes:
        punch: Of the punch's contact surface at the end of each half-cycle (half_cycles, n), K.
        strip: Of the strip's (half_cycles, n), K.
    """

    punch: Array
    strip: Array

    def __repr__(self) -> str:
        """Say in a line what it is."""
        return f"<SteadyHeat: largest temperature {max(self.punch.max(), self.strip.max()):.5g} K>"


@dataclass(frozen=True, repr=False)
class Steady:
    """The cyclic steady state; for one-way sliding the steady state, equal to the optimum.

    Attributes:
        directions: Sliding direction of each half-cycle.
        pressure: In the middle position of each half-cycle (half_cycles, n), MPa.
        phase_pressure: In every phase, that is in every position (phases, n), MPa.
        gap: The same (half_cycles, n), mm.
        shape: Worn depth without its rigid part (n,), mm; NaN where the surfaces never touch.
        contact_width: Width in contact there (half_cycles,), mm.
        wear_per_cycle: Depth worn off both bodies in a cycle (n,), mm.
        velocity: Rigid-body wear lambda per cycle of each mode: mm and rad.
        iterations: Newton iterations.
        seconds: Wall time of the solve.
        heat: Temperatures; None without heat.
        coordinates: Of the contact nodes (n, 2) or (n, 3), mm: x and z; of rings r and z, of solids x, y and z.
    """

    directions: tuple[int, ...]
    pressure: Array
    phase_pressure: Array
    gap: Array
    shape: Array
    contact_width: Array
    wear_per_cycle: Array
    velocity: dict[str, float]
    iterations: int
    seconds: float
    heat: SteadyHeat | None = None
    coordinates: Array = field(kw_only=True)

    @property
    def x(self) -> Array:
        """Abscissae of the contact nodes (n,), mm."""
        return self.coordinates[:, 0]

    def __repr__(self) -> str:
        """Say in a line what it is."""
        n, most = len(self.coordinates), self.pressure.max()
        return f"<Steady: {n} contact nodes, {len(self.directions)} half-cycles, largest pressure {most:.5g} MPa>"


class _SteadyInequality:
    """Unknown: p of each phase, omega, the rigid modes a of all phases but the first, lambda."""

    def __init__(self, system: Tribosystem) -> None:
        rigid, interface = system.rigid, system.interface
        self.system = system
        m, n, r = len(system.motion.phases), len(system.pair.weights), len(rigid.resultant)
        self.m, self.n, self.r = m, n, r
        self.wear = system.phases_wear
        self.p_scale = rigid.mean_pressure
        self.gap_scale = self.p_scale * interface.elastic_length
        self.wear_scale = float(self.wear.opening(np.full((m, n), self.p_scale)).max()) / m
        self.lengths = system.mode_lengths
        self.moment = self.lengths[:, None] * self.p_scale * rigid.pair.weights.sum()
        self.omega = slice(m * n, m * n + n)
        self._slide(system.friction_ratios())
        size = self.equations.size
        self._cold: Array = np.zeros(size)  # what the rows have besides the unknowns, without heat
        for k, own in enumerate(system.interfaces):
            moved = own.pair.initial_gap - system.pair.initial_gap
            self._cold[k * n : (k + 1) * n] = (own.load_gap + moved) / self.gap_scale
            last = m * n + n + k * r
            self._cold[last : last + r] = own.rigid.resultant / self.moment[:, 0]
        self.offset: Array = self._cold
        # At its upper bound a variational inequality wants F <= 0: the wear balance with its sign turned.
        lower, upper = np.full(size, -np.inf), np.full(size, np.inf)
        lower[: m * n] = 0.0
        upper[self.omega] = OPEN
        self.x = self._start()
        self._solved = False
        self.inequality = Inequality(
            lower, upper, self._residual, self._jacobian, "fenwear_steady_", "the cyclic steady state"
        )

    def _slide(self, ratios: Sequence[Array]) -> None:
        """Take friction."""
        made: dict[tuple[int, bytes], Array] = {}  # phases of one place and direction share theirs
        compliances, balances = [], []
        for own, ratio in zip(self.system.interfaces, ratios, strict=True):
            key = (id(own.gap_by_force), np.asarray(ratio + own.pair.normal).tobytes())
            if key not in made:
                made[key] = own.compliance(ratio) * (self.p_scale / self.gap_scale)
            compliances.append(made[key])
            balances.append(own.rigid.equilibrium(ratio) * self.p_scale / self.moment)
        modes = self.system.rigid.rigid_normal / self.lengths
        self.equations = ShapeEquations(compliances, modes, np.array(balances))
        self._known: tuple[list[csr_array], Array, Operator] | None = None  # the last derivative, and what it is of

    def take(self, conditions: Sequence[ContactConditions]) -> None:
        """Take friction and wear at the conditions of the phases."""
        self.wear = self.system.wear.phases(conditions)
        if not self.system.friction.constant:
            self._slide(self.system.friction_ratios(conditions))

    def _residual(self, x: Array) -> Array:
        m, n = self.m, self.n
        f = self.equations.multiply(x) + self.offset
        pressure = x[: m * n].reshape(m, n) * self.p_scale
        f[self.omega] -= self.wear.opening(pressure)[0] / self.wear_scale
        return f

    def _jacobian(self, x: Array) -> Operator:
        pressure = x[: self.m * self.n].reshape(self.m, self.n)
        slopes = self.wear.slopes(pressure * self.p_scale)
        # Open in all phases no equation holds omega: let the excess of wear or motion drive it to its bound or back.
        held = np.where(pressure.max(axis=0) <= 0, DRIVE, 0.0)
        known = self._known
        if known is not None and np.array_equal(held, known[1]) and all(map(_same, slopes, known[0])):
            return known[2]
        scaled = [slope * (self.p_scale / self.wear_scale) for slope in slopes]
        self._known = (slopes, held, self.equations.derivative(scaled, held))
        return self._known[2]

    def solve(self, thermal: Array | None = None, coupling: Array | None = None) -> ContactState:
        """Return the contact of all phases, starting from the last solution.

        Args:
            thermal: Thermal gap without pressure (m, n), mm.
            coupling: Thermal gap from the pressures of the phases (m, n, m, n), mm/MPa.
        """
        m, n = self.m, self.n
        self.offset = self._cold
        if thermal is not None:
            self.offset = self._cold.copy()
            self.offset[: m * n] += thermal.ravel() / self.gap_scale
        if coupling is not None or self.equations.coupling is not None:
            scale = self.p_scale / self.gap_scale
            by_heat = None if coupling is None else coupling.reshape(m * n, m * n) * scale
            self.equations, self._known = self.equations.with_heat(by_heat), None
        if self.m == 1 or not self._solved:
            self.x = self._touching(self.x)
        self.x = self.inequality.solve(self.x, near=self._solved)
        self._solved = True
        f = self.inequality.residual
        pressure, gap = (v[: m * n].reshape(m, n) for v in (self.x * self.p_scale, f * self.gap_scale))
        return ContactState(pressure, gap, np.zeros((m, self.r)), self.inequality.iterations)

    def _start(self) -> Array:
        """Return where Newton starts: the optimum in one-way sliding, else the uniform pressure."""
        m, n, r = self.m, self.n, self.r
        x = np.zeros(self.equations.size)
        if m == 1:
            optimum = self.system.optimum(self.system.motion.directions[0])
            x[:n] = optimum.pressure / self.p_scale
            velocity = np.array([optimum.velocity[name] for name in self.system.rigid.mode_names])
            x[n + n :] = velocity * self.system.motion.period * self.lengths / self.wear_scale
        else:
            x[: m * n] = 1.0
            if r:
                x[-r:] = np.linalg.lstsq(self.equations.modes, np.full(n, float(m)), rcond=None)[0]
        return x

    def _touching(self, x: Array) -> Array:
        """Return x with the shape that carries its first pressure, open where the motion leaves the wear behind."""
        n = self.n
        x = x.copy()
        pressure, _, _, velocity = self.equations.parts(x)
        outrun = (x[:n] == 0) & (self.equations.modes @ velocity < 0)
        x[self.omega] = -(self.equations.gaps(pressure)[0] + self.offset[:n])
        x[self.omega] = np.where(outrun & (self.m == 1), OPEN, x[self.omega])
        return x


def _same(one: csr_array, other: csr_array) -> bool:
    return all(np.array_equal(getattr(one, n), getattr(other, n)) for n in ("indptr", "indices", "data"))


def steady(system: Tribosystem) -> Steady:
    """Solve for the cyclic steady state; collective.

    With heat the temperatures are periodic too; their reduced form is used whatever heat.operator is.

    Raises:
        CaseError: with heat, a body that loses heat nowhere.
        ConvergenceError: the inequality did not converge, or not with the nodes that conduct.
    """
    _check_exists(system)
    begin = time.perf_counter()
    problem = _SteadyInequality(system)
    for body, side in zip(system.bodies.heat or (), system.exchange.sides if system.exchange else (), strict=True):
        if not side.cooled:
            raise CaseError(no_heat_sink(body.body.name))
    contact, heat, temperature = _solve(problem)
    return _result(problem, contact, heat, temperature, time.perf_counter() - begin)


def check_constant_materials(system: Tribosystem) -> None:
    """Raise where the properties of materials follow the temperature: a state at once would have to find both.

    Raises:
        ConvergenceError: they do.
    """
    if system.made_from is not None and system.case.warming:
        used = sorted({*system.case.punch.regions.values(), *system.case.strip.regions.values()})
        name = next(name for name in used if system.case.materials[name].dependent)
        key = f"materials.{name}.{system.case.materials[name].dependent[0]}"
        raise ConvergenceError(
            f"no steady state is solved for at once where {key} depends on the temperature: `run` with "
            'run.integration = "jump" and run.periodic_within comes to it'
        )


def _check_exists(system: Tribosystem) -> None:
    """Raise where the strip's wear never comes to a shape that stays, or no one rigid motion can follow it."""
    if system.track_deepens:
        raise ConvergenceError(
            "no cyclic steady state exists: the strip wears, and under a punch that goes to and fro its track deepens "
            "for ever, most where every position touches it. Follow the wear by `run` with run.integration = "
            '"jump", or take wear.strip away'
        )
    if system.passing_laws:
        raise ConvergenceError(
            f"no cyclic steady state exists: {system.passing_laws[0]} changes with the worn depth or the distance "
            "slid, as long as it slides. Follow the wear by `run`"
        )
    check_constant_materials(system)
    if any(law is not None and law.pressure_threshold > 0 for law in system.sliding.wear):
        raise ConvergenceError(
            "no cyclic steady state is solved for with a pressure_threshold: below it any pressure stays. Follow the "
            "wear by `run`"
        )
    first = system.interfaces[0].rigid.rigid_normal
    for own in system.interfaces[1:]:
        if np.abs(own.rigid.rigid_normal - first).max(initial=0.0) > 1e-9 * np.abs(first).max(initial=1.0):
            raise ConvergenceError(
                "no cyclic steady state is solved for where the rigid motions open other gaps in other positions, as "
                "of a strip that is free to move and slides as a whole: follow the wear by `run`"
            )


def _solve(problem: _SteadyInequality) -> tuple[ContactState, CycleHeat | None, Array | None]:
    """Return the contact of all phases, and with heat the temperature."""
    system = problem.system
    try:
        contact = problem.solve()
    except ConvergenceError as error:
        if system.strip_wears or _uniform_wear_exists(system):
            raise
        raise ConvergenceError(
            f"{error}; friction tips the punch so far that no pressures wear the whole contact by a rigid motion: "
            "it goes on changing its shape. Expected less friction, a lower pin or a wider contact"
        ) from error
    coupled = Coupled(system, problem.take)
    if coupled.heat is None and system.constant_coefficients:
        return contact, None, None
    initial = None if coupled.heat is None else coupled.heat.initial()
    contact, temperature = coupled.solve(
        initial, np.inf, contact, lambda thermal, coupling, _: problem.solve(thermal, coupling)
    )
    return contact, coupled.at_friction(), temperature


def _result(
    problem: _SteadyInequality, contact: ContactState, heat: CycleHeat | None, temperature: Array | None, seconds: float
) -> Steady:
    system = problem.system
    weights, motion = system.pair.weights, system.motion
    omega = problem.x[problem.omega] * problem.gap_scale
    touched = problem.x[problem.omega] < OPEN
    shape = np.where(touched, omega - _rigid_part(system, omega - system.pair.initial_gap, touched), np.nan)
    depths: Array = problem.x[len(problem.x) - problem.r :] * problem.wear_scale
    depths = np.where(np.abs(depths) > ZERO * np.abs(depths).max(initial=0.0), depths, 0.0)
    velocity = depths / problem.lengths
    middle = slice(motion.positions // 2, None, motion.positions)
    return Steady(
        motion.stroke_directions,
        contact.pressure[middle],
        contact.pressure,
        contact.gap[middle],
        shape - system.pair.initial_gap,
        (contact.pressure[middle] > 0) @ weights,
        problem.wear.opening(contact.pressure)[0],
        {name: float(value) for name, value in zip(system.rigid.mode_names, velocity, strict=True)},
        contact.iterations,
        seconds,
        None if heat is None or temperature is None else _steady_heat(heat, temperature, contact.pressure, middle),
        coordinates=system.pair.punch.x,
    )


def _steady_heat(heat: CycleHeat, state: Array, pressure: Array, middle: slice) -> SteadyHeat:
    """Follow the temperatures through one cycle of the steady state."""
    exchange, now = heat.exchange, heat.exchange.at(state)
    punch, strip = [], []
    for phase in range(len(pressure)):
        now, _ = exchange.half_cycle(now, phase, pressure[phase], exchange.conductance(pressure[phase]))
        temperatures = exchange.contact_temperatures(now)
        punch.append(temperatures[0])
        strip.append(temperatures[1])
    ends = slice(middle.step - 1, None, middle.step)  # the last phase of each half-cycle
    return SteadyHeat(np.array(punch)[ends], np.array(strip)[ends])


def _uniform_wear_exists(system: Tribosystem) -> bool:
    """Return whether any pressures of the phases wear the whole contact by a rigid motion (b = 1)."""
    n, r = system.rigid.rigid_normal.shape
    m = len(system.motion.phases)
    lengths = system.mode_lengths
    equality = np.zeros((n + m * r, m * n + r))
    target = np.zeros(n + m * r)
    equality[:n, m * n :] = -system.rigid.rigid_normal / lengths
    for k, (own, friction_ratio) in enumerate(zip(system.interfaces, system.friction_ratios(), strict=True)):
        equality[:n, k * n : (k + 1) * n] = np.eye(n)
        rows = slice(n + k * r, n + (k + 1) * r)
        equality[rows, k * n : (k + 1) * n] = own.rigid.equilibrium(friction_ratio) / lengths[:, None]
        target[rows] = -own.rigid.resultant / lengths
    bounds = [(0, None)] * (m * n) + [(None, None)] * r
    return bool(linprog(np.zeros(m * n + r), A_eq=equality, b_eq=target, bounds=bounds).status != 2)


def _rigid_part(system: Tribosystem, values: Array, where: Mask) -> Array:
    """Return the rigid motion that fits `values` best in the weighted least-squares sense."""
    modes = system.rigid.rigid_normal
    root = np.sqrt(system.pair.weights * where)
    values = np.where(where, values, 0.0)
    return modes @ np.linalg.lstsq(modes * root[:, None], values * root, rcond=None)[0]


def cycles_to_reach(system: Tribosystem, state: Steady, fraction: float, limit: int = 10_000_000) -> int | None:
    """Return after how many cycles from the initial shape the pressures come this near to the end.

    Found by a run of cycle jumps; within the jump that crosses the distance is taken to decay exponentially.

    Args:
        state: The steady state.
        fraction: Of the pressure scale.
        limit: Cycles tried; None is returned beyond.
    """
    phases, goal = len(state.directions), fraction * pressure_scale(system, state.phase_pressure)
    before: tuple[int, float] | None = None
    for block in jump(system, limit * phases, tolerance=fraction / 10, block=phases):
        cycles, distance = int(block.half_cycle[-1]) // phases, float(np.abs(block.pressure - state.pressure).max())
        if distance < goal:
            if before is None or distance == 0:
                return cycles
            share = np.log(before[1] / goal) / np.log(before[1] / distance)
            return round(before[0] + share * (cycles - before[0]))
        before = (cycles, distance)
    return None
