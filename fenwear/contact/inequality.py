"""Finite-dimensional variational inequalities by PETSc's SNES, on one process.

Find x within its bounds with F_i(x) = 0 where x_i is free, F_i >= 0 where x_i is at its lower and
F_i <= 0 where it is at its upper bound: reduced-space active-set Newton (vinewtonrsls). These
systems are piecewise linear or nearly so, hence full steps, without line search unless asked for.

SNES decides which unknowns are at their bounds. Solves that follow one another mostly end with the
same ones: a start that is near is first taken on by Newton's method with its own set, whose factor is
kept. Where the result fulfils all conditions it is the solution; where it does not, SNES starts. Where unknowns are
many the sets themselves are gone through first: that of the next step holds what has come out below its bound, and lets
go what is held with a residual of the wrong sign (M. Hintermueller, K. Ito, K. Kunisch, SIAM J. Optim. 13, 2003). It
takes fewer of them than steps that are cut off at the bounds, but need not end. Where the derivative changes with the
solution they are gone through in the same way, a step of each, by the factor of an earlier solve: see
`fenwear.contact.chords`. An operator whose solutions cost by their digits goes through sets itself, to some
of them, and what it finds is taken on as it is.
"""

from __future__ import annotations

import math
import weakref
from collections.abc import Callable
from functools import cached_property

import numpy as np
from petsc4py import PETSc

from fenwear.arrays import Array, Mask
from fenwear.contact.chords import Chord, Diagonal, Factor
from fenwear.contact.operators import LARGE, Approximate, Indices, Operator, Shifted, Solve
from fenwear.contact.pivoting import complementary
from fenwear.errors import ConvergenceError

REASONS = {value: name for name, value in vars(PETSc.SNES.ConvergedReason).items() if isinstance(value, int)}
TOLERANCE = 1e-11  # of residuals, which are scaled to 1
AT_BOUND = 1e-12  # of unknowns, which are scaled to 1: how near to their bound they count as at it
EPSILON = 1e-13  # of the parts that residuals add up: what rounding may leave of them
SETS = 30  # that are gone through before SNES starts
AGAIN = 3  # times that a set may come again, where its derivative is another one
CHORDS, FALLS = 40, 0.3  # steps where the derivative changes; fall of the residual by which its factor serves anyway
SLOWEST = 0.8  # fall by which it may, where few steps are left: beyond it Newton's own are surer
STAYS = 1e-6  # residual below which the next step changes no derivative by itself
SERVES = 3  # such steps at least that a factor costs
STEP_COSTS = 50  # unknowns by which it costs a step more
STEPS = 4  # of Newton's method with the set of the start, before SNES looks for another one
PIVOTS_COST = 10  # iterations of SNES, as which pivots are counted that look for the set
ROUNDS = 40  # of some digits each, where the derivative changes
CLOSE = 1e-9  # of residuals, where solutions cost by their digits


def configure(snes: PETSc.SNES, prefix: str, line_search: str = "basic") -> None:
    """Set what all of fenwear's inequalities share; options with `prefix` override it."""
    snes.setOptionsPrefix(prefix)
    snes.setType("vinewtonrsls")
    # Residuals are scaled to 1 and need few steps; a step that changes nothing ends the iteration.
    snes.setTolerances(rtol=0.0, atol=TOLERANCE, stol=0.0, max_it=100)
    options = PETSc.Options()
    for name, value in (("snes_linesearch_type", line_search), ("snes_vi_zero_tolerance", AT_BOUND)):
        if not options.hasName(f"{prefix}{name}"):
            options[f"{prefix}{name}"] = value
    snes.ksp.setType("preonly")
    snes.ksp.pc.setType("lu")


def check(snes: PETSc.SNES, what: str) -> None:
    """Raise if the last solve did not converge.

    Raises:
        ConvergenceError: names `what`, PETSc's reason and the options that may help.
    """
    reason = snes.getConvergedReason()
    if reason <= 0:
        raise ConvergenceError(
            f"{what} did not converge: {REASONS.get(reason, reason)} after {snes.getIterationNumber()} iterations, "
            f"residual {snes.getFunctionNorm():.3g} (options: -{snes.getOptionsPrefix()}snes_monitor, ..snes_max_it)"
        )


class Inequality:
    """A variational inequality on one process, kept for many solves.

    Args:
        lower, upper: Bounds (size,); infinite where there is none.
        residual: Returns F(x) (size,).
        jacobian: Returns dF/dx as an operator; the same object as before where it has not changed.
        prefix: Of the PETSc options.
        name: What is solved, for error messages.
        rounding: Returns how large the parts are that the residual adds up, which leave that much rounding; asked for
            where Newton's method has not come to `TOLERANCE` at once.

    Attributes:
        iterations: Newton iterations of the last solve.
        residual: F at its solution (size,).
    """

    def __init__(
        self,
        lower: Array,
        upper: Array,
        residual: Callable[[Array], Array],
        jacobian: Callable[[Array], Operator],
        prefix: str,
        name: str,
        rounding: Callable[[], float] = lambda: 1.0,
    ) -> None:
        self.iterations = 0
        self.residual: Array = np.zeros(len(lower))
        self.name = name
        self._function, self._jacobian, self._prefix, self._rounding = residual, jacobian, prefix, rounding
        self._lower, self._upper = lower, upper
        self._bounded_above = bool((upper < np.inf).any())
        self._kept: Factor | None = None
        self._operator: Operator | None = None
        self._chord: Chord | None = None  # the last factor's, where the derivative changes with the solution
        self.curved = False  # whether the derivative changes with the solution
        self.diagonal: Diagonal | None = None  # of the derivative, of what unknowns share and what is their own
        self.by_digits = False  # whether solutions may cost by their digits
        self.sets_first = False  # whether sets are gone through before SNES starts; without upper bounds
        self.close = 0.0  # residual of a row in the mean that ends solves, where they cost by their digits
        self.singular = False  # whether the last set that SNES took had no factor
        self._cost = max(SERVES, len(lower) // STEP_COSTS)  # of a factor, in steps
        self._stepped: Array | None = None  # where the first step from the last start led to, on its own set

    @cached_property
    def _full_steps(self) -> PETSc.SNES:
        return self._make(self._prefix, "basic")

    @cached_property
    def _searching(self) -> PETSc.SNES:
        return self._make(f"{self._prefix}search_", "l2")

    def _make(self, prefix: str, line_search: str) -> PETSc.SNES:
        comm, size = PETSc.COMM_SELF, len(self._lower)
        snes = PETSc.SNES().create(comm)
        own = weakref.proxy(self)  # Python does not see what PETSc holds: a circle through it would never be freed

        def residual(_snes: PETSc.SNES, x: PETSc.Vec, f: PETSc.Vec) -> None:
            f.array_w[:] = own._function(x.array_r)

        def update(_snes: PETSc.SNES, x: PETSc.Vec, J: PETSc.Mat, _P: PETSc.Mat) -> None:
            own._operator = own._jacobian(x.array_r)
            J.assemble()

        snes.setFunction(residual, PETSc.Vec().createSeq(size, comm=comm))
        snes.setJacobian(update, _shell(size, _Matrix(own)))
        configure(snes, prefix, line_search)
        bounds = [np.clip(b, PETSc.NINFINITY, PETSc.INFINITY) for b in (self._lower, self._upper)]
        snes.setVariableBounds(*(PETSc.Vec().createWithArray(b, comm=comm) for b in bounds))
        snes.ksp.pc.setType("python")
        snes.ksp.pc.setPythonContext(_Solver())
        snes.setFromOptions()
        return snes

    def multiply(self, x: Array) -> Array:
        """Return the present derivative times x."""
        if self._operator is None:
            raise ConvergenceError(f"{self.name} has no derivative yet")
        return self._operator.multiply(x)

    def factor(self, kept: Indices) -> Solve:
        """Return the solution operator of these rows and columns of the present derivative.

        Raises:
            LinAlgError: they are singular.
        """
        if self._operator is None:
            raise ConvergenceError(f"{self.name} has no derivative yet")
        free = np.zeros(len(self._lower), dtype=bool)
        free[kept] = True
        return self._factor(self._operator, free.tobytes()).solve

    def _factor(self, operator: Operator, key: bytes) -> Factor:
        """Return the factor of an operator's free rows and columns; the last one is kept."""
        last = self._kept
        if last is None or last.operator is not operator or last.key != key:
            self._kept = None
            free = np.frombuffer(key, dtype=bool)
            kept, bounded = (np.flatnonzero(one).astype(np.int32) for one in (free, ~free))
            rows = kept if len(bounded) else slice(None)
            last = self._kept = Factor(operator, key, rows, bounded, operator.factor(kept))
        return last

    def solve(self, start: Array, *, near: bool = False, line_search: bool = False, most: int | None = None) -> Array:
        """Return the solution (size,).

        Args:
            start: Where Newton starts (size,).
            near: Whether the solution may well have the unknowns of the start at their bounds, and no others.
            line_search: Whether steps are cut to where the residual is least: slower, but it ends where
                full steps go to and fro between two sets of unknowns at their bounds.
            most: Iterations of SNES, where they are fewer than its own options allow.

        Raises:
            ConvergenceError: SNES did not converge.
        """
        if self.by_digits and not line_search and isinstance(self._jacobian(start), Approximate):
            x = self._improved(start)
            return self._by_snes(start, line_search) if x is None else x
        self._stepped = None
        stepwise = self.curved or self._bounded_above  # sets change more often, or there is more than one factor's step
        x = (self._by_chords(start) if stepwise else self._on_set(start)) if near else None
        if x is None and self.sets_first and not line_search:
            x = self._through_sets(start)
        return self._by_snes(start, line_search, most) if x is None else x

    def solve_by_pivots(self, start: Array) -> Array:
        """Return the solution (size,) by Lemke's method, of the derivative at the start, at its solution, and so on.

        Where there are lower bounds alone, and they are zero. It is as often as a tenth of the iterations that SNES may
        take where it tries again: options that limit those limit this.

        Raises:
            ConvergenceError: pivots find none, or their solutions do not settle.
        """
        x, free = start, np.isneginf(self._lower)
        for _ in range(self._searching.getTolerances()[3] // PIVOTS_COST):
            operator = self._jacobian(x)
            matrix = np.array([operator.multiply(unit) for unit in np.eye(len(x))]).T
            x = complementary(matrix, self._function(x) - operator.multiply(x), free)
            found = self._by_chords(x) if self.curved else self._on_set(x)
            if found is not None:
                return found
        raise ConvergenceError(f"{self.name} did not converge by pivots")

    def _on_set(self, start: Array) -> Array | None:
        """Return the solution where it has the same free unknowns as the start, else None."""
        key, x = self._free(start), start.copy()
        try:
            # Whatever is kept: what a solution is found with does not depend on what was solved before.
            kept = self._factor(self._jacobian(x), key)
            for iteration in range(STEPS + 1):
                f = self._function(x)
                rest = f[kept.free]
                if rest @ rest < (self._tolerance if iteration > 1 else TOLERANCE) ** 2:
                    break
                if iteration == STEPS or (iteration and self._free(x) != key):
                    return None
                if iteration:
                    kept = self._factor(self._jacobian(x), key)
                x[kept.free] -= kept.solve(rest)
                if not iteration:
                    self._stepped = x.copy()
        except np.linalg.LinAlgError:
            return None
        if self._free(x) != key:
            return None
        if not self._holds(x, f, kept.bounded):
            return None
        self.iterations, self.residual = iteration, f
        return x

    def _by_chords(self, start: Array) -> Array | None:
        """Return the solution from a start that is near, where the derivative changes with it; None if it is not."""
        x, key, seen = start.copy(), self._free(start), set[bytes]()
        before, free = np.inf, _mask(key)
        try:
            chord = self._chord_at(x, key)
            for self.iterations in range(CHORDS):
                f = self._function(x)
                wanted = self._wanted(x, f, free) if self.iterations else key
                same = wanted == key
                if not same:
                    if wanted in seen:
                        return None
                    seen.add(key)
                    key, before, free = wanted, np.inf, _mask(wanted)
                    self._onto_bounds(x, key)
                    chord = self._chord_at(x, key)
                    f = self._function(x)
                rest = f if free is None else np.where(free, f, 0.0)
                size = math.sqrt(rest @ rest)
                small = size < TOLERANCE or (size > FALLS * before and size < self._tolerance)
                if small and same and (wanted if self.iterations else self._wanted(x, f, free)) == key:
                    self.residual = f
                    chord.solved(self.iterations)
                    return x
                if not self._falls(size, before):
                    chord = self._new_chord(x, key)
                elif before < np.inf and size > STAYS:
                    chord.bend(self._bent(x))
                before = size
                x += chord.step(rest, key)
        except np.linalg.LinAlgError:
            pass
        return None

    def _chord_at(self, x: Array, key: bytes) -> Chord:
        """Return steps that begin at a place with these free unknowns, by the last factor where that serves."""
        chord = self._chord
        if chord is None or chord.factor is not self._kept or chord.worn_out:
            return self._new_chord(x, key)
        if not self._serves(chord, x, key):
            if len(key) <= LARGE or isinstance(chord.factor.operator, Shifted):
                return self._new_chord(x, key)
            # Of a large set that differs by a few the factor of the same derivative costs little.
            chord = self._chord = chord.of(self._factor(chord.factor.operator, key))
        chord.begin(self._bent(x))
        return chord

    def _new_chord(self, x: Array, key: bytes) -> Chord:
        """Return steps by the derivative at a place."""
        bent = self._bent(x)
        self._chord = Chord(self._factor(self._jacobian(x), key), self._cost, bent)
        self._chord.begin(bent)
        return self._chord

    def _bent(self, x: Array) -> Array | None:
        """Return the diagonal of the derivative at a place (size,); None where it is not known."""
        parts = None if self.diagonal is None else self.diagonal(x)
        return None if parts is None else np.add(*parts)

    def _serves(self, chord: Chord, x: Array, key: bytes) -> bool:
        """Return whether a factor serves for these free unknowns."""
        if key == chord.factor.key:
            return True
        parts = None if self.diagonal is None or chord.bent is None else self.diagonal(x)
        return parts is not None and chord.serves(np.frombuffer(key, dtype=bool), *parts)

    def _falls(self, size: float, before: float) -> bool:
        """Return whether the residual falls so fast that what is left of it costs less than a new factor."""
        if size <= FALLS * before:
            return True
        return size < SLOWEST * before and math.log(size / TOLERANCE) < self._cost * math.log(before / size)

    def _wanted(self, x: Array, f: Array, free: Mask | None) -> bytes:
        """Return which unknowns are free next: those within their bounds, and those that their residual lets go.

        Args:
            x, f: Unknowns and residual (size,).
            free: Which are free now (size,); None for all.
        """
        wanted = x > self._lower
        if free is None and not self._bounded_above:
            return wanted.tobytes()
        if free is not None:
            wanted = np.where(free, wanted, f < -TOLERANCE)
        if self._bounded_above:
            within = np.ones(len(x), dtype=bool) if free is None else free
            above = np.where(within, x < self._upper, f > TOLERANCE)
            wanted = np.where(within, wanted & above, np.where(x >= self._upper, above, wanted))
        return wanted.tobytes()

    def _onto_bounds(self, x: Array, key: bytes) -> None:
        """Put unknowns that are not free on the bound that is next."""
        held = ~np.frombuffer(key, dtype=bool)
        x[held] = np.where(x[held] >= self._upper[held], self._upper[held], self._lower[held])

    @property
    def _tolerance(self) -> float:
        """Of the residual, where rounding leaves more than `TOLERANCE`."""
        return max(TOLERANCE, EPSILON * self._rounding())

    def _through_sets(self, start: Array) -> Array | None:
        """Return the solution by a sequence of sets, each solved for as it is; None where they come again and again.

        Where pressures are beyond a cap, or below a threshold, the derivative is another one, and a set may come twice.
        """
        x, key, stepped = start.copy(), self._free(start), self._stepped
        seen: dict[bytes, list[Operator]] = {}
        for _ in range(SETS):
            free = np.frombuffer(key, dtype=bool)
            if stepped is not None:
                x, stepped = stepped, None
            else:
                x[~free] = self._lower[~free]
                operator = self._jacobian(x)
                before = seen.setdefault(key, [])
                if len(before) == AGAIN or any(one is operator for one in before):
                    return None
                before.append(operator)
                try:
                    kept = self._factor(operator, key)
                    x[kept.free] -= kept.solve(self._function(x)[kept.free])
                except np.linalg.LinAlgError:
                    return None
            wanted = np.where(free, x > self._lower, self._function(x) < -TOLERANCE)
            if np.array_equal(wanted, free):
                found = self._on_set(x)
                if found is not None:
                    return found
            key = wanted.tobytes()
        return None

    def _improved(self, start: Array) -> Array | None:
        """Return the solution by some digits after each other; None where they do not come."""
        x, least = start.copy(), max(CLOSE, self._tolerance)
        below = max(self.close, least)
        f = self._function(x)
        for self.iterations in range(ROUNDS):
            wrong = (x > self._lower) | (f < -below)
            enough = max(self.close * float(np.sqrt(wrong.sum())), least)  # as many digits for any number of nodes
            if np.linalg.norm(f[wrong]) < enough:
                self.residual = f
                return x
            operator = self._jacobian(x)
            if not isinstance(operator, Approximate):
                return None
            try:
                x = operator.improved(x, f, enough, below)
            except np.linalg.LinAlgError:
                return None
            f = self._function(x)
        return None

    def _free(self, x: Array) -> bytes:
        """Return which unknowns are within their bounds, as bytes."""
        within = x > self._lower
        return (within & (x < self._upper) if self._bounded_above else within).tobytes()

    def _holds(self, x: Array, f: Array, bounded: Indices) -> bool:
        """Return whether the residuals of unknowns at their bounds have the right signs."""
        if not len(bounded):
            return True
        signed = f[bounded]
        if self._bounded_above:
            signed = np.where(x[bounded] == self._lower[bounded], signed, -signed)
        return bool(signed.min() >= 0)

    def _by_snes(self, start: Array, line_search: bool, most: int | None = None) -> Array:
        snes = self._searching if line_search else self._full_steps
        x: Array = start.copy()
        self.singular = False
        limit = snes.getTolerances()[3]
        snes.setTolerances(atol=self._tolerance, max_it=limit if most is None else min(most, limit))
        try:
            snes.solve(None, PETSc.Vec().createWithArray(x, comm=PETSc.COMM_SELF))
        except (np.linalg.LinAlgError, PETSc.Error) as error:  # PETSc passes on what its callbacks raise, or wraps it
            if not isinstance(error.__cause__ or error, np.linalg.LinAlgError):
                raise
            raise ConvergenceError(f"{self.name} did not converge: its Jacobian is singular") from None
        finally:
            snes.setTolerances(max_it=limit)
        if self.singular:
            raise ConvergenceError(f"{self.name} did not converge: its Jacobian is singular")
        check(snes, self.name)
        self.iterations = snes.getIterationNumber()
        self.residual = self._function(x)
        return x


def _mask(key: bytes) -> Mask | None:
    """Return which unknowns are free (size,), from bytes; None for all."""
    return np.frombuffer(key, dtype=bool) if b"\0" in key else None


def _shell(size: int, context: _Matrix) -> PETSc.Mat:
    shell = PETSc.Mat().createPython((size, size), context, comm=PETSc.COMM_SELF)
    shell.setUp()
    return shell


class _Matrix:
    """PETSc's view of an operator, or of some of its rows and columns: what the active-set method asks of it."""

    def __init__(self, inequality: Inequality, kept: Indices | None = None) -> None:
        self.inequality, self.kept = inequality, kept

    def mult(self, _mat: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        y.array_w[:] = self.inequality.multiply(x.array_r)

    def createSubMatrix(self, _mat: PETSc.Mat, rows: PETSc.IS, _columns: PETSc.IS, _out: object) -> PETSc.Mat:  # noqa: N802
        kept = rows.getIndices().copy()
        return _shell(len(kept), _Matrix(self.inequality, kept))


class _Solver:
    """PETSc's preconditioner that solves with the factor that the inequality keeps."""

    solve: Solve | None = None

    def setUp(self, pc: PETSc.PC) -> None:
        """Take the factor; a set without one ends SNES: what is raised in here may bring petsc4py down."""
        context = pc.getOperators()[1].getPythonContext()
        pc.setFailedReason(PETSc.PC.FailedReason.NOERROR)  # else a set without a factor would end all later solves
        try:
            self.solve = context.inequality.factor(context.kept)
        except np.linalg.LinAlgError:
            self.solve = None
            context.inequality.singular = True
            pc.setFailedReason(PETSc.PC.FailedReason.FACTOR_NUMERIC_ZEROPIVOT)

    def apply(self, pc: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        try:
            y.array_w[:] = 0.0 if self.solve is None else self.solve(x.array_r)
        except np.linalg.LinAlgError:  # of a large set, whose factor was put off
            pc.getOperators()[1].getPythonContext().inequality.singular = True
            pc.setFailedReason(PETSc.PC.FailedReason.FACTOR_NUMERIC_ZEROPIVOT)
