"""The linear system of the cyclic steady state on one grid, by products alone; see `fenwear.contact.steady_blocks`.

The balance of wear, with D on its diagonal, is a step of the length h = 1 / D: with

    omega = h (q + sum of M_k p_k - H lambda),    a'_k = a_k - h lambda,    a_0 = 0,

q the right-hand side of the balance and g_k, f_k those of gaps and forces, what is left are the phases of that step,

    S_k p_k + h (sum of M_j p_j) + H a'_k = g_k - h q,    E_k p_k = f_k,

whose inverse on an endless grid (`fenwear.contact.endless_grid`), restricted to the nodes in contact, is the
preconditioner: of a long step where D is none. GMRES takes about as many iterations for any number of nodes and
of phases.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from fenwear.algebra.krylov import flexible
from fenwear.algebra.submatrices import Indices, Solve
from fenwear.common.arrays import Array, Mask
from fenwear.contact.endless_grid import EndlessGrid, Patch
from fenwear.contact.grid_contact import PhasesGrid
from fenwear.contact.steady_blocks import ShapeRows, worn_by

ACCURACY, FAR = 1e-13, 1e-6  # residual over the right-hand side, and what is no solution
LONGEST = 1e4  # step of the preconditioner: wear by the mean pressure over the elastic gap
RESTART, RESTARTS = 60, 10


@dataclass(frozen=True)
class GridShape(ShapeRows):
    """Residual of contact and equilibrium, linear in the unknowns and scaled.

    Attributes:
        grid: Product with S_k of all phases.
        modes: H (n, r), the gap that each rigid mode opens.
        balances: E_k (m, r, n), what each node's pressure puts on each mode.
    """

    grid: PhasesGrid
    modes: Array
    balances: Array

    def gaps(self, pressure: Array) -> Array:
        """Return what pressures open in all phases (m, n)."""
        on = self.grid.boxes.whole
        return on.box.values(on.products.apply(on.box.spread(pressure)[:, None])[:, 0])

    def derivative(self, wear: Sequence[csr_array], held: Array) -> WornGrid:
        """Return the left side's derivative with wear.

        Args:
            wear: M_k, the wear of each node by the pressures of phase k (n, n).
            held: D (n,), what holds the shape where no phase touches; else zero.
        """
        return WornGrid(self, list(wear), held)


class WornGrid:
    """The derivative of the cyclic steady state.

    Attributes:
        iterations: All that its solutions took.
    """

    def __init__(self, equations: GridShape, wear: list[csr_array], held: Array) -> None:
        self.equations, self.wear, self.held = equations, wear, held
        self.iterations = 0

    def multiply(self, x: Array) -> Array:
        """Return the matrix times x."""
        return self.equations.multiply_with(x, self.wear, self.held)

    def factor(self, kept: Indices) -> Solve:
        """Return the solution operator of the rows and columns `kept`, all rigid motions among them.

        Raises:
            LinAlgError: nothing touches, or its loads are not balanced; the operator, where it finds no solution.
        """
        free = np.zeros(self.equations.size, dtype=bool)
        free[kept] = True
        near = _Near(self, free)

        def solve(b: Array) -> Array:
            right: Array = np.zeros(len(free))
            right[kept] = b
            multiply, precondition = (lambda x: self.multiply(x) * free), (lambda rows: near.solve(rows) * free)
            x, rest, iterations, _ = flexible(multiply, precondition, right, ACCURACY, RESTART, RESTARTS)
            self.iterations += iterations
            if not rest <= FAR:
                raise np.linalg.LinAlgError("singular matrix")
            return np.asarray(x[kept])

        return solve


class _Near:
    """Approximate inverse of the rows and columns of some unknowns.

    Args:
        of: The derivative.
        free: Which unknowns are free (size,).

    Raises:
        LinAlgError: nothing touches, or its loads are not balanced by what does.
    """

    def __init__(self, of: WornGrid, free: Mask) -> None:
        self.of, self.equations = of, of.equations
        m, n, r = self.equations.shape
        touching = free[: m * n].reshape(m, n)
        touched = np.flatnonzero(touching.any(axis=0))
        if not len(touched):
            raise np.linalg.LinAlgError("singular matrix")
        sums = np.asarray(sum(own @ on.astype(float) for own, on in zip(of.wear, touching, strict=True)))
        self.worn = free[m * n : (m + 1) * n] & (sums > 0)
        self.alone = np.where(of.held > 0, of.held, 1.0)
        self.length = min(LONGEST, 1 / max(float(of.held[self.worn].max(initial=0.0)), 1e-300))
        self.on = on = self.equations.grid.boxes.around(touched)
        self.touching = on.box.spread(touching.astype(float))
        rate = np.array([own.diagonal()[touched].mean() for own in of.wear])
        endless = EndlessGrid(on.products)
        endless.take(self.length * rate, np.zeros(m), 0.0)
        moved, balanced = (
            on.box.spread(values.reshape(-1, n)).reshape(m, r, *on.box.counts) * self.touching[:, None]
            for values in (np.broadcast_to(self.equations.modes.T, (m, r, n)), self.equations.balances)
        )
        self.patch = Patch(endless, moved, balanced)

    def solve(self, rows: Array) -> Array:
        """Return nearly the unknowns (size,) of rows (size,), which are zero where they are not asked for."""
        m, n, r = self.equations.shape
        h, on, modes = self.length, self.on, self.equations.modes
        gaps, wear = rows[: m * n].reshape(m, n), rows[m * n : (m + 1) * n]
        forces = rows[(m + 1) * n :].reshape(m, r)
        boxed, own = self.patch.solve(on.box.spread(gaps - h * wear) * self.touching, forces)
        p: Array = np.zeros((m, n))
        p[:, on.box.nodes] = on.box.values(boxed * self.touching)
        velocity = -own[0] / h
        left = wear - modes @ velocity
        omega = np.where(self.worn, h * (left + worn_by(self.of.wear, p)), left / self.alone)
        return np.concatenate([p.ravel(), omega, (own[1:] - own[0]).ravel(), velocity])
