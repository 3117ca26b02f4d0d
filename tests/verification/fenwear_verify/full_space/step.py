"""A time step of contact with stick on all displacements of both bodies, nothing condensed: slow, to compare with.

What the tractions f = (p, t) do to the bodies is solved for in every Newton step together with them,

    K_1 u_1 - J_1^T W f = 0,    K_2 u_2 + J_2^T W f = 0,    A f + B (J_1 u_1 - J_2 u_2 + H a - V delta + free) = b,

with the balance of the rigid modes and of an imposed force; A and B say of each node whether it is open, sticks, slips
or flows (`equations`), and how what lies between gives way. A body that has crept to c times its compliance over the
step has K / c. The loads' own displacements are in `free`, as there. Rank 0 has all of it: cases must be small.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_array, csc_array, csr_array, diags_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from fenwear.common.arrays import Array
from fenwear.common.errors import ConvergenceError
from fenwear.common.parallel import on_root
from fenwear.steps.stick_equations import ContactStatus, StatusSolution, Step, SurfaceDisplacement, derivative
from fenwear_verify.full_space.bodies import WholeBodies, whole_bodies


class FullStep(Step):
    """The equations of one time step on all displacements; arguments as of `Step`."""

    def solve(self, status: ContactStatus) -> StatusSolution:
        """Return the solution of a contact status; collective.

        Raises:
            ConvergenceError: its equations are singular.
        """
        bodies = self.interface
        whole = whole_bodies(bodies.bodies, self.position, moves=bodies.moves)
        return on_root(bodies.bodies.comm, lambda: self._solve(whole, status))

    def _solve(self, whole: WholeBodies, status: ContactStatus) -> StatusSolution:
        position, r, loose = self.position, self.position.modes.shape[1], self.imposed.force is not None
        count, size = self.d * self.n, whole.stiffness.shape[0]
        softer = self.creep.factors(self.imposed.duration)
        gives, closed_at_none = self._given_way(status)
        A, B = self._laws_of(status, gives)
        rigid = csr_array(position.modes * self.units)
        drive = csr_array(-position.drive[:, None] * self.length)
        none = csr_array((size, 1))
        rows: list[list[Any]] = [
            [whole.softened(softer[0], softer[1]), -whole.pushed, csr_array((size, r))],
            [B @ whole.seen, A, B @ rigid],
            [None, csr_array(position.balance * (self.units / (self.length * self.area))[:, None]), None],
        ]
        rest, right = self.free.copy(), [np.zeros(size)]
        rest[: self.n] += closed_at_none
        if loose:
            rows = [[*row, extra] for row, extra in zip(rows, (none, B @ drive, None), strict=True)]
            rows.append([None, csr_array((position.pull / self.area)[None]), None, None])
        else:
            rest = rest - position.drive * (self.imposed.displacement or 0.0)
        laws = -(B @ rest)
        laws[: self.n][status.flowing] = self.hardness
        right += [laws, -self.imposed.loaded.resultant * self.units / (self.length * self.area)]
        right += [np.array([(self.imposed.force or 0.0) / self.area])] if loose else []
        if not r:
            rows = [[part for k, part in enumerate(row) if k != 2] for row in (*rows[:2], *rows[3:])]
        x, sign = _solved(csc_array(block_array(rows)), np.concatenate(right))
        u, f, a, problem = np.split(x, np.cumsum([size, count, r]))
        displacement = float(problem[0] * self.length) if loose else float(self.imposed.displacement or 0.0)
        on_punch, on_strip = (
            (trace @ u).reshape(self.d, -1).T / times for trace, times in zip(whole.trace, softer, strict=False)
        )
        apart = whole.seen @ u
        apart[: self.n] += position.interface.layer * f[: self.n]
        moved = SurfaceDisplacement(apart, on_punch, on_strip)
        return StatusSolution(f, a * self.units, displacement, sign * (-1) ** r, moved)

    def _given_way(self, status: ContactStatus) -> tuple[Array, Array]:
        """Return how what lies between gives way at the pressures of a status: slope, closure at no pressure (n,)."""
        slope = np.zeros(self.n) + self.position.interface.layer
        if self.closure is None:
            return slope, np.zeros(self.n)
        own, pressure = self.closure.slope(status.pressure), status.pressure
        return slope + own, np.where(status.closed, self.closure.closure(pressure) - own * pressure, 0.0)

    def _laws_of(self, status: ContactStatus, gives: Array) -> tuple[csr_array, csr_array]:
        """Return A and B (d n, d n) of the laws A f + B j = b of a contact status, where unit pressures give way.

        Without pressure it may give way as much as it likes: those rows are made of one size.
        """
        n, m, closed, slips = self.n, self.m, status.closed, status.closed & status.slipping
        A = np.zeros((self.d, self.d, n))
        B = np.zeros((self.d, self.d, n))
        unit = 1 / self.scale
        size = unit[0] / (1 + gives * unit[0])
        A[0, 0] = np.where(closed, gives * size, 1.0)
        B[0, 0] = np.where(closed, size, 0.0)
        A[0, 0, status.flowing], B[0, 0, status.flowing] = 1.0, 0.0
        K, direction = np.zeros((n, m, m)), np.zeros((n, m))
        if slips.any():
            K[slips], direction[slips] = derivative(status.trial[slips], status.radius[slips])
        for k in range(m):
            for j in range(m):
                same = float(k == j)
                A[1 + k, 1 + j] = np.where(slips, same - K[:, k, j], same * ~closed)
                B[1 + k, 1 + j] = np.where(slips, K[:, k, j], same * closed) * unit[1 + j]
            A[1 + k, 0] = np.where(slips, -self.mu * direction[:, k], 0.0)
        both = ([[diags_array(X[k, j]) for j in range(self.d)] for k in range(self.d)] for X in (A, B))
        found = [csr_array(block_array(parts)) for parts in both]
        return found[0], found[1]


def _solved(matrix: csc_array, right: Array) -> tuple[Array, int]:
    """Return the solution and the sign of the determinant.

    Raises:
        ConvergenceError: the matrix is singular.
    """
    singular = ConvergenceError("the contact with stick has a singular step: nothing holds the bodies as they slip")
    try:
        factor = splu(matrix)
    except RuntimeError:
        raise singular from None
    diagonal = factor.U.diagonal()
    if not np.isfinite(diagonal).all() or np.abs(diagonal).min() < 1e-14 * np.abs(diagonal).max():
        raise singular
    swaps = _swaps(factor.perm_r) + _swaps(factor.perm_c)
    return factor.solve(right), (-1) ** (swaps + int((diagonal < 0).sum()))


def _swaps(order: NDArray[np.int32]) -> int:
    """Return the number of exchanges that make up a permutation: its length less the number of its cycles."""
    size = len(order)
    cycles, _ = connected_components(csr_array((np.ones(size), (np.arange(size), order)), shape=(size, size)))
    return size - int(cycles)
