"""Finite-dimensional variational inequalities by PETSc's SNES, on one process.

Find x within its bounds with F_i(x) = 0 where x_i is free, F_i >= 0 where x_i is at its lower and
F_i <= 0 where it is at its upper bound: reduced-space active-set Newton (vinewtonrsls). These
systems are piecewise linear or nearly so, hence full steps, without line search.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from petsc4py import PETSc

from fenwear.arrays import Array
from fenwear.errors import ConvergenceError

REASONS = {value: name for name, value in vars(PETSc.SNES.ConvergedReason).items() if isinstance(value, int)}
ZERO_PIVOT = 71  # PETSC_ERR_MAT_LU_ZRPVT


def configure(snes: PETSc.SNES, prefix: str) -> None:
    """Set what all of fenwear's inequalities share; options with `prefix` override it."""
    snes.setOptionsPrefix(prefix)
    snes.setType("vinewtonrsls")
    # Residuals are scaled to 1 and need few steps; a step that changes nothing ends the iteration.
    snes.setTolerances(rtol=0.0, atol=1e-11, stol=0.0, max_it=100)
    options = PETSc.Options()
    for name, value in (("snes_linesearch_type", "basic"), ("snes_vi_zero_tolerance", 1e-12)):
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


class DenseInequality:
    """A variational inequality with a dense Jacobian, kept for many solves.

    Args:
        lower, upper: Bounds (size,); infinite where there is none.
        residual: Writes F(x) into its second argument.
        jacobian: Writes dF/dx into its second argument (size, size).
        prefix: Of the PETSc options.
        name: What is solved, for error messages.
    """

    def __init__(
        self,
        lower: Array,
        upper: Array,
        residual: Callable[[Array, Array], None],
        jacobian: Callable[[Array, Array], None],
        prefix: str,
        name: str,
    ) -> None:
        size, comm = len(lower), PETSc.COMM_SELF
        self.x = np.zeros(size)
        self.name = name
        self._matrix = np.zeros((size, size), order="F")
        self._bounds = [np.clip(b, PETSc.NINFINITY, PETSc.INFINITY) for b in (lower, upper)]
        self._x = PETSc.Vec().createWithArray(self.x, comm=comm)
        self._f = PETSc.Vec().createSeq(size, comm=comm)
        self._J = PETSc.Mat().createDense((size, size), array=self._matrix, comm=comm)
        self.snes = PETSc.SNES().create(comm)
        self.snes.setFunction(lambda snes, x, f: residual(x.array_r, f.array_w), self._f)
        self.snes.setJacobian(lambda snes, x, J, P: self._fill(jacobian, x, J), self._J)
        configure(self.snes, prefix)
        self._bound_vectors = [PETSc.Vec().createWithArray(b, comm=comm) for b in self._bounds]
        self.snes.setVariableBounds(*self._bound_vectors)
        self.snes.setFromOptions()

    def _fill(self, jacobian: Callable[[Array, Array], None], x: PETSc.Vec, J: PETSc.Mat) -> None:
        jacobian(x.array_r, self._matrix)
        J.assemble()

    def solve(self, start: Array) -> Array:
        """Return the solution (size,), valid until the next solve.

        Raises:
            ConvergenceError: SNES did not converge.
        """
        self.x[:] = start
        try:
            self.snes.solve(None, self._x)
        except PETSc.Error as error:
            if error.ierr != ZERO_PIVOT:
                raise
            raise ConvergenceError(f"{self.name} did not converge: its Jacobian is singular") from None
        check(self.snes, self.name)
        return self.x
