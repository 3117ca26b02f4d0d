"""Phases of many nodes that meet in what they wear, solved by one iteration of all of them.

No matrix of all nodes is made: the ranks share the rows of the compliances (one rank has them all), rank 0 leads and
asks for products. Unknown at the nodes that touch are the pressures p of m phases and a shape omega, with
amplitudes a of few motions beside them:

    S_k p_k + omega + B_k a = b_k,    -(sum of M_k p_k) + D omega + B_w a = b_w,    C p = c.

GMRES is preconditioned by the same with S_k and M_k of runs of neighbouring nodes alone, eliminated on the rank that
has their rows, and the few other rows and columns by their Schur complement.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from scipy.sparse import csr_array, hstack

from fenwear.arrays import Array, Mask
from fenwear.contact.krylov import NotSolvedError, gmres_solution
from fenwear.contact.operators import Solve, eliminate
from fenwear.contact.phase_rows import OwnPhases, PhaseRows
from fenwear.interface import Interface
from fenwear.parallel import Rows, Team

ENOUGH = 2e-12  # residual, scaled to 1, that ends the iterations


class SpreadPhases:
    """The compliances of phases whose rows the ranks share, for rank 0 to ask for while it leads.

    Args:
        interfaces: Of each phase.
        ratios: tau of each phase (n, d), the traction of friction on the punch over the pressure.
        scale: Of the compliances.
    """

    def __init__(self, interfaces: Sequence[Interface], ratios: Sequence[Array], scale: float) -> None:
        rows = interfaces[0].rows or Rows.equal(MPI.COMM_SELF, len(interfaces[0].pair.weights))
        self.team = Team.of(rows.comm)
        places = list({id(own): own for own in interfaces}.values())
        which = [np.flatnonzero([own is place for own in interfaces]) for place in places]
        traction = [
            (own.pair.normal + ratio) * own.pair.weights[:, None] * scale
            for own, ratio in zip(interfaces, ratios, strict=True)
        ]
        phases = PhaseRows(places, [np.array([traction[k] for k in one]) for one in which], which)
        self.own = self.team.serve(OwnPhases(rows.own, phases))

    def multiply(self, pressure: Array) -> Array:
        """Return what pressures open in all phases (m, n)."""
        return np.concatenate(self.team.call(self.own, "multiply", pressure), axis=1)

    def multiply_within(self, pressure: Array) -> Array:
        """Return the same among the prepared nodes (m, c)."""
        return np.concatenate(self.team.call(self.own, "multiply_within", pressure), axis=1)

    def prepare(self, nodes: NDArray[np.int64], free: Mask, wear: Array, held: Array) -> bool:
        """Take the nodes that are solved for; return whether all runs can be eliminated: see `OwnPhases.prepare`."""
        return all(self.team.call(self.own, "prepare", nodes, free, wear, held))

    def near(self, v: Array) -> Array:
        """Return the solution of all runs of the prepared nodes (m + 1, c, q)."""
        return np.concatenate(self.team.call(self.own, "near", v), axis=1)


@dataclass(frozen=True)
class Meeting:
    """What phases meet in, and what is beside them.

    Attributes:
        wear: M_k (n, n) of each phase.
        held: D (n,).
        opened: B (m + 1, n, q), the last of the balance of wear.
        balance: C (q, m, n).
    """

    wear: Sequence[csr_array]
    held: Array
    opened: Array
    balance: Array


class RowBlocks:
    """The solution operator of the free unknowns.

    Args:
        phases: The compliances.
        meeting: What they meet in.
        free: Which pressures and, last, shapes are free (m + 1, n).
        count: Told of the iterations of each solution.

    Raises:
        LinAlgError: it is singular, or a run or what is beside them by itself.
    """

    def __init__(self, phases: SpreadPhases, meeting: Meeting, free: Mask, count: Callable[[int], None]) -> None:
        self._phases, self._told = phases, count
        nodes = np.flatnonzero(free.any(axis=0))
        self._free = free[:, nodes]
        self._count = int(self._free.sum())
        self._held = meeting.held[nodes]
        wear = [csr_array(csr_array(own[nodes])[:, nodes]) for own in meeting.wear]
        self._wear = csr_array(hstack(wear))
        self._opened = meeting.opened[:, nodes] * self._free[:, :, None]
        self._balance = meeting.balance[:, :, nodes] * self._free[:-1]
        diagonals = np.array([own.diagonal() for own in wear])
        worn = sum(own @ touching.astype(float) for own, touching in zip(wear, self._free, strict=False))
        idle = self._free[-1] & (worn == 0) & (self._held == 0)  # shapes that nothing of their balance holds
        if idle.sum() > self._opened[-1].any(axis=0).sum():
            raise np.linalg.LinAlgError("singular matrix")
        if not phases.prepare(nodes, self._free, diagonals, self._held):
            raise np.linalg.LinAlgError("singular matrix")
        self._followed = phases.near(self._opened)
        self._solve_beside: Solve = eliminate(np.einsum("qkn,knj->qj", self._balance, self._followed[:-1]))

    def _parts(self, x: Array) -> tuple[Array, Array]:
        """Return pressures and shapes at the nodes (m + 1, c), and the amplitudes, of the free unknowns."""
        whole = np.zeros(self._free.shape)
        whole[self._free] = x[: self._count]
        return whole, x[self._count :]

    def multiply(self, x: Array) -> Array:
        """Return the rows of the free unknowns."""
        whole, a = self._parts(x.ravel())
        p, omega = whole[:-1], whole[-1]
        rows = self._opened @ a
        rows[:-1] += self._phases.multiply_within(p) + omega
        rows[-1] += self._held * omega - self._wear @ p.ravel()
        return np.concatenate([rows[self._free], np.einsum("qkn,kn->q", self._balance, p)])

    def precondition(self, v: Array) -> Array:
        """Return nearly what the matrix takes to v."""
        rows, beside = self._parts(v.ravel())
        z = self._phases.near(rows[:, :, None])[:, :, 0]
        a = self._solve_beside(np.einsum("qkn,kn->q", self._balance, z[:-1]) - beside)
        return np.concatenate([(z - self._followed @ a)[self._free], a])

    def solve(self, b: Array) -> Array:
        """Return the unknowns: of the phases, shapes, amplitudes.

        Raises:
            LinAlgError: GMRES did not reach its accuracy.
        """
        try:
            return gmres_solution(self.multiply, self.precondition, b, self._told, ENOUGH)
        except NotSolvedError:
            raise np.linalg.LinAlgError("the iterations of a large contact did not converge") from None
