"""The inequality of the cyclic steady state: its unknowns, its scales and its start; see `fenwear.steps.steady`."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import numpy as np
from scipy.sparse import csr_array

from fenwear.algebra.submatrices import Operator
from fenwear.common.arrays import Array
from fenwear.common.errors import ConvergenceError
from fenwear.common.parallel import check_memory
from fenwear.contact import ContactSolver, ContactState
from fenwear.contact.grid_contact import PhasesGrid
from fenwear.contact.inequality import AT_BOUND, Inequality
from fenwear.contact.steady_blocks import ShapeEquations
from fenwear.contact.steady_products import GridShape
from fenwear.laws import Evolution, LayerEvolution, Layers, LayerStep
from fenwear.laws.debris import NO_CYCLE
from fenwear.laws.friction import ContactConditions
from fenwear.laws.optimum import Optimum
from fenwear.system import Tribosystem

DRIVE = 1e-6  # scaled stiffness of the shape at nodes that are open in all phases
GRAZING = 1e-7  # of the wear by the mean pressure: a motion of open nodes that leaves them where they are
SOFTENED = (1.0, 0.3, 0.1, 0.03, 0.01, 1e-3, 1e-4, 0.0)  # shares of the pressure beyond a cap that wears
GRIDDED = 1000  # nodes of a grid from which on products take the place of matrices
NUMBER, COUPLED = 8, 3  # bytes; copies of what the heat of all phases opens in all phases, as they are scaled
STEPS = 0.1, 1.0  # wear by the mean pressure over the elastic gap, of steps from afar
LONGER = 10.0, 1e2, 1e3, 1e4, 1e5  # and of those before the last one, which has no end
UNBALANCED = 0.3  # of the mean pressure times the surface: from there on a start is far
APART = 1e-9  # of gaps by rigid motions: what is rounding
AT_ONCE = 30  # Newton iterations, before the wear is followed and in its steps
OPEN = 1e4  # bound of omega over the elastic gap of the mean pressure: never touched again
NO_STEP = 0.0, 0.0


class SteadyInequality:
    """Unknown: p of each phase, omega, the rigid modes a of all phases but the first, lambda.

    Args:
        system: The assembled problem.

    Attributes:
        peak_without_cap: Largest pressure where no cap holds the wear, MPa; 0 before that was solved for.
    """

    def __init__(self, system: Tribosystem) -> None:
        rigid, interface = system.rigid, system.interface
        self.system = system
        m, n, r = len(system.motion.phases), len(system.pair.weights), len(rigid.resultant)
        self.m, self.n, self.r = m, n, r
        self.wear, self.closure = system.phases_wear, system.layers.closure
        self.conditions: Sequence[ContactConditions] = ()  # of the mean pressure
        self.p_scale = interface.pressure_scale
        self.gap_scale = self.p_scale * interface.elastic_length
        above = max(law.pressure_threshold for law in system.sliding.wear)
        self.wear_scale = float(self.wear.opening(np.full((m, n), self.p_scale + above)).max()) / m
        self.lengths = system.mode_lengths
        self.moment = self.lengths[:, None] * self.p_scale * rigid.pair.weights.sum()
        self.omega = slice(m * n, m * n + n)
        self._slide(system.friction_ratios())
        self._creep = system.creep.end(system.friction_ratios())
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
        self.peak_without_cap = 0.0
        self._solved = False
        # Of a step towards the state: the inverse of its length, and the shape where it begins.
        self._step: tuple[float, Array | float] = NO_STEP
        self.inequality = Inequality(
            lower, upper, self._residual, self._jacobian, "fenwear_steady_", "the cyclic steady state"
        )

    def _slide(self, ratios: Sequence[Array]) -> None:
        """Take friction."""
        interfaces, scale = self.system.interfaces, self.p_scale / self.gap_scale
        modes, pairs = self.system.rigid.rigid_normal / self.lengths, list(zip(interfaces, ratios, strict=True))
        balances = np.array([own.rigid.equilibrium(ratio) for own, ratio in pairs]) * self.p_scale / self.moment
        self.equations: ShapeEquations | GridShape
        linear = self.system.heat is None and self.closure is None and not self.system.creep.creeps
        linear = linear and not self.system.track_changes
        grid = self._grid(ratios, scale, modes, balances) if linear and self.n >= GRIDDED else None
        if grid is not None:
            self.equations = GridShape(grid, modes, balances)
        else:
            made: dict[tuple[int, bytes], Array] = {}  # phases of one place and direction share theirs
            keys = [(id(own), np.asarray(ratio + own.pair.normal).tobytes()) for own, ratio in pairs]
            for key, (own, ratio) in zip(keys, pairs, strict=True):
                if key not in made:
                    made[key] = own.compliance(ratio, scale).matrix()
            self.equations = ShapeEquations([made[key] for key in keys], modes, balances)
        # The last derivative, and what it is of.
        self._known: tuple[list[csr_array], Array, Array | None, Operator] | None = None

    def _grid(self, ratios: Sequence[Array], scale: float, modes: Array, balances: Array) -> PhasesGrid | None:
        """Return what multiplies on the grid that all compliances are convolutions on; None where they are not."""
        interfaces = self.system.interfaces
        if self.system.pair.punch.grid is None or any(own.in_memory for own in interfaces):
            return None
        known: dict[bytes, Array] = {}
        found = [own.compliance(ratio, scale, known).on_grid for own, ratio in zip(interfaces, ratios, strict=True)]
        if None in found:
            return None
        on_grid = [one for one in found if one is not None]
        return PhasesGrid(on_grid, [modes] * len(on_grid), list(balances), self.system.pairs)

    def take(self, conditions: Sequence[ContactConditions], evolution: Evolution | None = None) -> None:  # noqa: ARG002
        """Take friction and wear at the conditions of the phases; what states of laws do there, they have done."""
        self.wear, self.conditions = self.system.wear.phases(conditions), conditions
        self._known = None
        if not self.system.friction.constant:
            ratios = self.system.friction_ratios(conditions)
            self._slide(ratios)
            self._creep = self.system.creep.end(ratios)

    def _residual(self, x: Array) -> Array:
        m, n = self.m, self.n
        f = self.equations.multiply(x) + self.offset
        pressure = x[: m * n].reshape(m, n) * self.p_scale
        f[self.omega] -= self.wear.opening(pressure)[0] / self.wear_scale
        inverse, before = self._step
        f[self.omega] += inverse * (x[self.omega] - before)
        # A rim that looks square to the motion, where nothing wears, either: rounding would drive it for ever.
        still = (pressure.max(axis=0) <= AT_BOUND * self.p_scale) & (np.abs(f[self.omega]) < GRAZING)
        f[self.omega] = np.where(still, 0.0, f[self.omega])
        if self.closure is not None:
            f[: m * n] += self.closure.closure(pressure).ravel() / self.gap_scale
        if self.system.track_changes:
            lies = self._passing.resting_where_it_lies(pressure)
            f[: m * n] -= np.concatenate([own.wear_interpolation @ lies for own in self.wear.pairs]) / self.gap_scale
        return f

    @property
    def _passing(self) -> LayerEvolution:
        """Change of debris over a cycle."""
        return self.system.passing(self.wear, conditions=self.conditions)

    def _by_debris(self, pressure: Array) -> Array:
        """Return the gaps of each phase by pressures of each phase through debris that the strip carries to and fro.

        It lies otherwise under the punch in each position, so that the shape has it not: (m n, m n), mm/MPa.
        """
        debris, taken, pairs = self._passing.debris, self.wear.taken_slope(pressure), self.wear.pairs
        found = np.zeros((self.m, self.n, self.m, self.n))
        for j, (own, slope) in enumerate(zip(pairs, taken, strict=True)):
            put = (own.wear_projection * slope).multiply((debris.fed[j] / debris.loss)[:, None])
            for k, reads in enumerate(pairs):
                found[k, :, j] = -(reads.wear_interpolation @ put).toarray()
        return found.reshape(self.m * self.n, -1)

    def _jacobian(self, x: Array) -> Operator:
        pressure = x[: self.m * self.n].reshape(self.m, self.n)
        slopes = self.wear.slopes(pressure * self.p_scale)
        # Open in all phases no equation holds omega: let the excess of wear or motion drive it to its bound or back.
        held = np.where(pressure.max(axis=0) <= AT_BOUND, DRIVE, 0.0) + self._step[0]
        layer = None if self.closure is None else self.closure.slope(pressure * self.p_scale)
        known = self._known
        if known is not None and np.array_equal(held, known[1]) and all(map(_same, slopes, known[0])):
            gives_alike = layer is None or known[2] is None or np.array_equal(layer, known[2])
            if gives_alike:
                return known[3]
        scaled = [slope * (self.p_scale / self.wear_scale) for slope in slopes]
        equations = self.equations
        if layer is not None and isinstance(equations, ShapeEquations):
            equations = equations.given_way(layer * (self.p_scale / self.gap_scale))
        if self.system.track_changes and isinstance(equations, ShapeEquations):
            by_debris = self._by_debris(pressure * self.p_scale) * (self.p_scale / self.gap_scale)
            others = equations.coupling
            equations = equations.with_heat(by_debris if others is None else others + by_debris)
        self._known = (slopes, held, layer, equations.derivative(scaled, held))
        return self._known[3]

    def solve(self, thermal: Array | float = 0.0, coupling: Array | None = None) -> ContactState:
        """Return the contact of all phases, starting from the last solution.

        Args:
            thermal: Thermal gap without pressure (m, n), mm.
            coupling: Thermal gap from the pressures of the phases (m, n, m, n), mm/MPa.
        """
        m, n = self.m, self.n
        thermal, coupling = self._creep.opening(np.zeros((m, n)) + thermal, coupling)
        self.offset = self._cold.copy()
        self.offset[: m * n] += thermal.ravel() / self.gap_scale
        if isinstance(self.equations, ShapeEquations) and (coupling is not None or self.equations.coupling is not None):
            scale = self.p_scale / self.gap_scale
            by_heat = None if coupling is None else coupling.reshape(m * n, m * n) * scale
            self.equations, self._known = self.equations.with_heat(by_heat), None
        self.x = self._found()
        f, iterations = self.inequality.residual, self.inequality.iterations
        self._solved = True
        pressure, gap = (v[: m * n].reshape(m, n) for v in (self.x * self.p_scale, f * self.gap_scale))
        return ContactState(pressure, gap, np.zeros((m, self.r)), iterations)

    @property
    def _may_follow(self) -> bool:
        """Whether a first solution of several phases is looked for, of wear that something makes and no cap holds."""
        return self.m > 1 and not self._solved and self.wear.cap == np.inf and self.wear_scale > 0

    @property
    def _far(self) -> bool:
        """Whether the start leaves much of the loads of some phase unbalanced, as an even pressure in a bore does."""
        forces = np.einsum("krn,kn->kr", self.equations.balances, self.equations.parts(self.x)[0])
        loads = self._cold[(self.m + 1) * self.n :].reshape(forces.shape)
        return bool(np.abs(forces + loads).max(initial=0.0) > UNBALANCED)

    def _found(self) -> Array:
        """Return the unknowns found from the last ones, or from the start, or where the wear leads.

        Raises:
            ConvergenceError: none are found.
        """
        follows = self._may_follow
        if not (follows and self._far):
            self.x = self._touching(self.x) if self.m == 1 or not self._solved else self.x
            try:
                return self._newton(self.x, AT_ONCE if follows else None, near=self._solved)
            except ConvergenceError:
                if not follows:
                    raise
        return self._followed(self.system.phase_contact(range(self.m)))

    def _followed(self, contact: ContactSolver) -> Array:
        """Return the unknowns found from where the wear leads, followed by implicit steps of ever more cycles.

        Where loads and motions change much over a cycle no even pressure is near its end, and sets of nodes in contact
        go round from it. Source: pseudo-transient continuation, C. T. Kelley, D. E. Keyes, SIAM J. Numer. Anal. 35,
        1998, by steps of the implicit Euler method.

        Args:
            contact: Of all phases.
        """
        x = begin = self._touching(self.x)
        base = self.system.pair.initial_gap
        moved = np.array([own.pair.initial_gap - base for own in self.system.interfaces])
        omega, solved, worn = begin[self.omega], None, np.zeros(self.n)
        alone = LayerEvolution(Layers(self.n), self.wear, NO_CYCLE)  # nothing between the surfaces
        for length in STEPS:
            cycles = length * self.gap_scale / self.wear_scale
            try:
                wearing = LayerStep(alone, self.system.unworn(), cycles)
                solved = contact.solve(moved + omega * self.gap_scale, solved, wearing)
            except ConvergenceError:
                return self._newton(begin, None, near=False)
            worn = self.wear.opening(solved.pressure)[0] / self.wear_scale
            omega = omega + length * worn
            x = self._unknowns(solved, omega, worn)
        for length in LONGER:
            self._step = 1 / length, x[self.omega].copy()
            with suppress(ConvergenceError):
                x = self._newton(x, AT_ONCE, near=True)
        self._step = NO_STEP
        try:
            return self._newton(x, AT_ONCE, near=True)
        except ConvergenceError:
            return self._newton(begin, None, near=False)

    def _unknowns(self, contact: ContactState, omega: Array, worn: Array) -> Array:
        """Return the unknowns of contacts on a shape omega (n,) that wears by `worn` (n,) a cycle, both scaled."""
        touched = worn > 0
        rigid = np.einsum("kij,kj->ki", rigid_of_phases(self.system), contact.rigid) * (self.lengths / self.gap_scale)
        velocity = np.linalg.lstsq(self.equations.modes[touched], worn[touched], rcond=None)[0]
        shape = np.minimum(omega + self.equations.modes @ rigid[0], OPEN)
        pressure = contact.pressure / self.p_scale
        return np.concatenate([pressure.ravel(), shape, (rigid[1:] - rigid[0]).ravel(), velocity])

    def crept(self, pressure: Array) -> Array:
        """Return the state of what creeps in the end (size,), at pressures (m, n)."""
        return self._creep.end(pressure)

    def _newton(self, x: Array, most: int | None, *, near: bool) -> Array:
        """Return the solution from a start, within so many iterations.

        Where wear is capped it is found by those of ever harder caps, from none at all.
        At nodes beyond the cap the balance of wear says nothing of the pressure: from afar it holds nothing.
        """
        capped = self.wear
        if capped.cap == np.inf:
            return self.inequality.solve(x, near=near, most=most)
        if self._solved:
            try:
                return self.inequality.solve(x, near=True)
            except ConvergenceError:
                pass
        try:
            for share in SOFTENED:
                self.wear, self._known = capped.softened(share), None
                x = self.inequality.solve(x, near=share < SOFTENED[0])
                peak = float(x[: self.m * self.n].max()) * self.p_scale
                if share == SOFTENED[0]:
                    self.peak_without_cap = peak
                if peak <= capped.cap:
                    break  # it is the solution whatever is beyond
        finally:
            self.wear, self._known = capped, None
        return x

    def _start(self) -> Array:
        """Return where Newton starts: the optimum in one-way sliding, else the uniform pressure."""
        m, n, r = self.m, self.n, self.r
        x = np.zeros(self.equations.size)
        optimum = self.system.team.lead(self._optimum) if m == 1 else None
        if optimum is not None:
            x[:n] = optimum.pressure / self.p_scale
            velocity = np.array([optimum.velocity[name] for name in self.system.rigid.mode_names])
            x[n + n :] = velocity * self.system.motion.period * self.lengths / self.wear_scale
        else:
            x[: m * n] = 1.0
            if r:
                x[-r:] = np.linalg.lstsq(self.equations.modes, np.full(n, float(m)), rcond=None)[0]
        return x

    def _optimum(self) -> Optimum | None:
        """Return the optimum of one-way sliding; None where a cap leaves none."""
        try:
            return self.system.optimum(self.system.motion.directions[0])
        except ConvergenceError:
            return None

    def _touching(self, x: Array) -> Array:
        """Return x with the shape that carries its first pressure, open where the motion leaves the wear behind."""
        n = self.n
        x = x.copy()
        pressure, _, _, velocity = self.equations.parts(x)
        outrun = (x[:n] == 0) & (self.equations.modes @ velocity < 0)
        x[self.omega] = -(self.equations.gaps(pressure)[0] + self.offset[:n])
        if self.closure is not None:
            x[self.omega] -= self.system.layers.at(0).gives.closure(pressure[0] * self.p_scale) / self.gap_scale
        x[self.omega] = np.where(outrun & (self.m == 1), OPEN, x[self.omega])
        return x


def _same(one: csr_array, other: csr_array) -> bool:
    return all(np.array_equal(getattr(one, n), getattr(other, n)) for n in ("indptr", "indices", "data"))


def rigid_of_phases(system: Tribosystem) -> Array:
    """Return what turns the rigid motions of each phase to those of the middle position (m, modes, modes).

    A strip that is free to move and passes as a whole opens in each place the same gaps by other motions, as where it
    tilts about a point that moves with it: H_k = H T_k. So wear that a motion follows in one place one follows in all.

    Raises:
        ConvergenceError: they open other gaps: to follow the wear takes H_k lambda_k of one shape in all phases.
    """
    middle, found = system.rigid.rigid_normal, []
    for own in system.rigids:
        here = own.rigid_normal
        turned = np.linalg.lstsq(middle, here, rcond=None)[0]
        back = here @ np.linalg.lstsq(here, middle, rcond=None)[0]
        if max(np.abs(middle @ turned - here).max(), np.abs(back - middle).max()) > APART * np.abs(middle).max():
            raise ConvergenceError(
                "no cyclic steady state exists, and no shape stays. The rigid motions that follow the wear in one "
                "position of the strip open the contact in another. This happens where only a strip on a hinge "
                "moves. Follow the wear by `run`"
            )
        found.append(turned)
    return np.array(found)


def check_heat_memory(system: Tribosystem) -> None:
    """Make sure that what the heat of all phases opens in all phases fits into the memory; collective.

    Raises:
        CaseError: it does not.
    """
    m, n = len(system.motion.phases), len(system.pair.weights)
    if system.heat is not None:
        what = f"the steady state with heat of {n:,} contact nodes in {m} phases"
        advice = "Use larger elements at the contact or fewer `motion.positions`, or follow the wear by `run`."
        check_memory(system.comm, COUPLED * NUMBER * float(m * n) ** 2, "geometry", what, advice)
