"""Finite-dimensional variational inequalities by PETSc's SNES, on one process.

Find x within its bounds with F_i(x) = 0 where x_i is free, F_i >= 0 where x_i is at its lower and
F_i <= 0 where it is at its upper bound: reduced-space active-set Newton (vinewtonrsls). These
systems are piecewise linear or nearly so, hence full steps, without line search unless asked for.

SNES decides which unknowns are at their bounds. Solves that follow one another mostly end with the same ones: a start
that is near is first taken on by a primal-dual active-set method, a step of Newton's for each set, that begins with its
own set, whose factor is kept. The next set holds what has come out beyond a bound, and lets go what is held with a
residual of the wrong sign (M. Hintermueller, K. Ito, K. Kunisch, SIAM J. Optim. 13, 2003). Where sets come again and
again, SNES starts. An operator whose solutions cost by their digits goes through sets itself, to some of them.

Where SNES does not converge an interior-point method does, which ends at a solution wherever there is one, for matrices
as those of contact without friction (see `fenwear.algebra.interior_point`).
"""

from __future__ import annotations

import weakref
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from fenwear.algebra.interior_point import complementary
from fenwear.algebra.submatrices import Approximate, Dense, Indices, Operator, Phases, Solve
from fenwear.common.arrays import Array, Mask
from fenwear.common.errors import ConvergenceError

REASONS = {value: name for name, value in vars(PETSc.SNES.ConvergedReason).items() if isinstance(value, int)}
TOLERANCE = 1e-11  # of residuals, which are scaled to 1
AT_BOUND = 1e-12  # of unknowns, which are scaled to 1: how near to their bound they count as at it
EPSILON = 1e-13  # of the parts that residuals add up: what rounding may leave of them
SETS = 40  # steps, each on a set of its own, before SNES starts
AGAIN = 2  # times that a set may come again: where the derivative changes it is another one
FALLS = 0.3  # of the residual in a step: by less rounding may be at its end
INTERIOR_COST = 10  # iterations of SNES, as which a linear problem by the interior-point method counts
ROUNDS = 40  # of some digits each, where the derivative changes
CLOSE = 1e-9  # of residuals, where solutions cost by their digits


@dataclass(frozen=True)
class Factor:
    """The factor of the free rows and columns of an operator.

    Attributes:
        operator: The matrix that is factored.
        key: Which of all are free, as bytes.
        free: Their numbers; a slice where all are free.
        solve: The solution operator.
    """

    operator: Operator
    key: bytes
    free: Indices | slice
    solve: Solve


def configure(snes: PETSc.SNES, prefix: str) -> None:
    """Set what all of fenwear's inequalities share; options with `prefix` override it."""
    snes.setOptionsPrefix(prefix)
    snes.setType("vinewtonrsls")
    # Residuals are scaled to 1 and need few steps; a step that changes nothing ends the iteration.
    snes.setTolerances(rtol=0.0, atol=TOLERANCE, stol=0.0, max_it=100)
    options = PETSc.Options()
    for name, value in (("snes_linesearch_type", "basic"), ("snes_vi_zero_tolerance", AT_BOUND)):
        if not options.hasName(f"{prefix}{name}"):
            options[f"{prefix}{name}"] = value
    snes.ksp.setType("preonly")
    snes.ksp.pc.setType("lu")


def check(snes: PETSc.SNES, problem: str) -> None:
    """Raise if the last solve did not converge.

    Raises:
        ConvergenceError: names `what`, PETSc's reason and the options that may help.
    """
    reason = snes.getConvergedReason()
    if reason <= 0:
        raise ConvergenceError(
            f"{problem} did not converge: {REASONS.get(reason, reason)} after {snes.getIterationNumber()} iterations, "
            f"residual {snes.getFunctionNorm():.3g} (options: -{snes.getOptionsPrefix()}snes_monitor, ..snes_max_it)"
        )


class Inequality:
    """A variational inequality on one process, kept for many solves.

    Args:
        lower, upper: Bounds (size,); infinite where there is none.
        residual: Returns F(x) (size,).
        jacobian: Returns dF/dx as an operator; the same object as before where it has not changed.
        prefix: Of the PETSc options.
        name: Name of the problem, for error messages.
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
        self._operator: Operator  # of the last Jacobian
        self.by_digits = False  # whether solutions may cost by their digits
        self.sets_first = False  # whether sets are gone through before SNES starts, from afar, too
        self.close = 0.0  # residual of a row in the mean that ends solves, where they cost by their digits
        self.singular = False  # whether the last set that SNES took had no factor
        self._snes: PETSc.SNES | None = None

    def _make(self) -> PETSc.SNES:
        comm, size = PETSc.COMM_SELF, len(self._lower)
        snes = PETSc.SNES().create(comm)
        proxy = weakref.proxy(self)  # Python does not see what PETSc holds: a circle through it would never be freed

        def residual(_snes: PETSc.SNES, x: PETSc.Vec, f: PETSc.Vec) -> None:
            f.array_w[:] = proxy._function(x.array_r)

        def update(_snes: PETSc.SNES, x: PETSc.Vec, J: PETSc.Mat, _P: PETSc.Mat) -> None:
            proxy._operator = proxy._jacobian(x.array_r)
            J.assemble()

        snes.setFunction(residual, PETSc.Vec().createSeq(size, comm=comm))
        snes.setJacobian(update, _shell(size, _Matrix(proxy)))
        configure(snes, self._prefix)
        bounds = [np.clip(b, PETSc.NINFINITY, PETSc.INFINITY) for b in (self._lower, self._upper)]
        snes.setVariableBounds(*(PETSc.Vec().createWithArray(b, comm=comm) for b in bounds))
        snes.ksp.pc.setType("python")
        snes.ksp.pc.setPythonContext(_Solver())
        snes.setFromOptions()
        return snes

    def multiply(self, x: Array) -> Array:
        """Return the present derivative times x."""
        return self._operator.multiply(x)

    def factor(self, kept: Indices) -> Solve:
        """Return the solution operator of these rows and columns of the present derivative.

        Raises:
            LinAlgError: they are singular.
        """
        free = np.zeros(len(self._lower), dtype=bool)
        free[kept] = True
        return self._factor(self._operator, free.tobytes()).solve

    def _factor(self, operator: Operator, key: bytes) -> Factor:
        """Return the factor of an operator's free rows and columns; the last one is kept."""
        last = self._kept
        if last is None or last.operator is not operator or last.key != key:
            self._kept = None
            kept = np.flatnonzero(np.frombuffer(key, dtype=bool)).astype(np.int32)
            rows = kept if len(kept) < len(key) else slice(None)
            last = self._kept = Factor(operator, key, rows, operator.factor(kept))
        return last

    def solve(self, start: Array, *, near: bool = False, most: int | None = None) -> Array:
        """Return the solution (size,).

        Args:
            start: Where Newton starts (size,).
            near: Whether the solution may well have nearly the unknowns of the start at their bounds.
            most: Iterations of SNES, where they are fewer than its own options allow.

        Raises:
            ConvergenceError: SNES did not converge.
        """
        x: Array | None = None
        if self.by_digits and isinstance(self._jacobian(start), Approximate):
            x = self._improved(start)
        elif near or self.sets_first:
            x = self._by_sets(start)
        return self._by_snes(start, most) if x is None else x

    def solve_from_inside(self, start: Array) -> Array:
        """Return the solution (size,) by the interior-point method, of the derivative at the start, and so on.

        There have to be lower bounds alone, and they have to be zero.

        Raises:
            ConvergenceError: it finds none, its solutions do not settle, or the derivative is no matrix.
        """
        x, free = start, np.isneginf(self._lower)
        snes = self._snes = self._snes or self._make()
        for _ in range(snes.getTolerances()[3] // INTERIOR_COST):  # options that limit SNES limit this
            operator = self._jacobian(x)
            if not isinstance(operator, Dense | Phases):
                break
            x = complementary(operator.matrix, self._function(x) - operator.multiply(x), free)
            solution = self._by_sets(x)
            if solution is not None:
                return solution
        raise ConvergenceError(f"{self.name} did not converge from inside its bounds")

    def _by_sets(self, start: Array) -> Array | None:
        """Return the solution by a step of Newton's on each of a sequence of sets; None where they come again."""
        x, before, seen = np.clip(start, self._lower, self._upper), np.inf, Counter[bytes]()  # a start may lie beyond
        key = self._free(x)
        free = _mask(key)
        try:
            for self.iterations in range(SETS):
                f = self._function(x)
                if self.iterations and (wanted := self._wanted(x, f, free)) != key:
                    seen[wanted] += 1
                    if seen[wanted] > AGAIN:
                        return None
                    key, free, before = wanted, _mask(wanted), np.inf
                    self._onto_bounds(x, key)
                    f = self._function(x)
                rest = f if free is None else f[free]
                size = float(rest @ rest) ** 0.5
                small = size < TOLERANCE or (size > FALLS * before and size < self._tolerance(len(rest)))
                if small and self._wanted(x, f, free) == key:
                    self.residual = f
                    return x
                before = size
                kept = self._factor(self._jacobian(x), key)
                x[kept.free] -= kept.solve(rest)
        except np.linalg.LinAlgError:
            pass
        return None

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

    def _tolerance(self, rows: int = 1) -> float:
        """Return the tolerance of the residual's norm, where rounding of so many rows leaves more than `TOLERANCE`."""
        return max(TOLERANCE, EPSILON * self._rounding() * float(np.sqrt(rows)))

    def _improved(self, start: Array) -> Array | None:
        """Return the solution by some digits after each other; None where they do not come."""
        x, least = start.copy(), max(CLOSE, self._tolerance())
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

    def _by_snes(self, start: Array, most: int | None = None) -> Array:
        snes = self._snes = self._snes or self._make()
        x: Array = start.copy()
        self.singular = False
        limit = snes.getTolerances()[3]
        snes.setTolerances(atol=self._tolerance(len(x)), max_it=limit if most is None else min(most, limit))
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
