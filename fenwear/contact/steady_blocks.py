"""The linear system of the cyclic steady state, in blocks: the phases meet in the worn shape, and in the heat.

Unknown are the pressures p of m phases, the shape omega, the rigid modes a of all phases but the first, and the
velocity lambda; the rows are, in the same order,

    S_k p_k + omega + H a_k + sum of C_kj p_j        the gap of phase k, with a_1 = 0,
    -(sum of M_k p_k) + D omega + H lambda           the balance of wear,
    E_k p_k                                          the balance of forces of phase k.

The whole matrix has ((m + 1) n)^2 numbers. Where they are many it is never made: with factors of each phase's nodes
in contact, which stay while these do, the pressures and rigid modes follow from the gaps and the shape. The rest,

    (sum of M_k S_k^-1) omega + H lambda = ...,

is solved by GMRES. The sum is near (sum of M_k) times the inverse of the phases' mean compliance, whose product is
the preconditioner: 15 to 20 iterations for any number of nodes and of phases.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from fenwear.algebra.krylov import solution
from fenwear.algebra.submatrices import Dense, Indices, Solve, Updating
from fenwear.common.arrays import Array, Mask

WHOLE = 600


def worn_by(wear: Sequence[csr_array], pressure: Array) -> Array:
    """Return what pressures (m, n) wear in a cycle (n,), by M_k of each phase."""
    return np.asarray(sum(own @ p for own, p in zip(wear, pressure, strict=True)))


class ShapeRows(ABC):
    """The rows of all unknowns, without wear.

    Attributes:
        modes: H (n, r), the gap that each rigid mode opens.
        balances: E_k (m, r, n), what each node's pressure puts on each mode.
    """

    modes: Array
    balances: Array

    @property
    def shape(self) -> tuple[int, int, int]:
        """Phases m, nodes n, rigid modes r."""
        m, r, n = self.balances.shape
        return m, n, r

    @property
    def size(self) -> int:
        """Number of unknowns."""
        m, n, r = self.shape
        return (m + 1) * n + m * r

    def parts(self, x: Array) -> tuple[Array, Array, Array, Array]:
        """Return views of p (m, n), omega (n,), a of the later phases (m - 1, r) and lambda (r,) of the unknowns."""
        m, n, r = self.shape
        p, omega, a, velocity = np.split(x, [m * n, (m + 1) * n, len(x) - r])
        return p.reshape(m, n), omega, a.reshape(m - 1, r), velocity

    @abstractmethod
    def gaps(self, pressure: Array) -> Array:
        """Return what pressures open in all phases (m, n)."""

    def multiply(self, x: Array) -> Array:
        """Return the left side of all rows, without wear."""
        p, omega, a, velocity = self.parts(x)
        gaps = self.gaps(p) + omega
        gaps[1:] += a @ self.modes.T
        forces = np.einsum("krn,kn->kr", self.balances, p)
        return np.concatenate([gaps.ravel(), self.modes @ velocity, forces.ravel()])

    def multiply_with(self, x: Array, wear: Sequence[csr_array], held: Array) -> Array:
        """Return the left side of all rows with wear; arguments as of `derivative`."""
        m, n, _ = self.shape
        p, omega, _, _ = self.parts(x)
        result = self.multiply(x)
        result[m * n : (m + 1) * n] += held * omega - worn_by(wear, p)
        return result


@dataclass(frozen=True)
class ShapeEquations(ShapeRows):
    """Residual of contact and equilibrium, linear in the unknowns and scaled.

    Attributes:
        compliances: S_k of each phase (n, n); phases may share one array.
        modes: H (n, r), the gap that each rigid mode opens.
        balances: E_k (m, r, n), what each node's pressure puts on each mode.
        coupling: C (m n, m n), the gap that the pressures of all phases open by heat; None without.
    """

    compliances: Sequence[Array]
    modes: Array
    balances: Array
    coupling: Array | None = None

    def gaps(self, pressure: Array) -> Array:
        """Return what pressures open in all phases (m, n)."""
        found = np.array([own @ p for own, p in zip(self.compliances, pressure, strict=True)])
        if self.coupling is not None:
            found += (self.coupling @ pressure.ravel()).reshape(pressure.shape)
        return found

    def matrix(self) -> Array:
        """Return the equations as one matrix (size, size)."""
        (m, n, r), found = self.shape, np.zeros((self.size, self.size))
        omega, last = slice(m * n, (m + 1) * n), (m + 1) * n
        if self.coupling is not None:
            found[: m * n, : m * n] = self.coupling
        for k, own in enumerate(self.compliances):
            rows = slice(k * n, (k + 1) * n)
            found[rows, rows] += own
            found[rows, omega] = np.eye(n)
            if k:
                found[rows, last + (k - 1) * r : last + k * r] = self.modes
            found[last + k * r : last + (k + 1) * r, rows] = self.balances[k]
        found[omega, self.size - r :] = self.modes
        return found

    @cached_property
    def phases(self) -> list[Updating]:
        """Factors of each phase's pressures and rigid modes.

        To the gap of the first phase, which has no rigid motion, its balance of forces is added: else a body far from
        its supports, or with friction, might be next to singular.
        """
        return [Updating(self._entries(k)) for k in range(len(self.compliances))]

    def _entries(self, k: int) -> Callable[[Indices, Indices], Array]:
        own, balance, modes, n = self.compliances[k], self.balances[k], self.modes, self.shape[1]

        def entries(rows: Indices, columns: Indices) -> Array:
            i, j = rows[rows < n], columns[columns < n]
            if k == 0:
                return np.asarray(own[np.ix_(i, j)] + modes[i] @ balance[:, j])
            found: Array = np.zeros((len(rows), len(columns)))
            found[: len(i), : len(j)] = own[np.ix_(i, j)]
            found[: len(i), len(j) :] = modes[np.ix_(i, columns[len(j) :] - n)]
            found[len(i) :, : len(j)] = balance[np.ix_(rows[len(i) :] - n, j)]
            return found

        return entries

    @cached_property
    def mean(self) -> Array:
        """The mean of the phases' compliances, with the balance of forces as above (n, n)."""
        found: Array = self.modes @ self.balances.mean(axis=0)
        for own in self.compliances:
            found += own / len(self.compliances)
        return found

    def with_heat(self, coupling: Array | None) -> ShapeEquations:
        """Return the equations with another coupling, and with the factors of this one."""
        other = replace(self, coupling=coupling)
        for name in ("phases", "mean"):
            if name in self.__dict__:
                other.__dict__[name] = self.__dict__[name]
        return other

    def given_way(self, layer: Array) -> ShapeEquations:
        """Return the equations with the gap (m, n) that unit pressures open at their own nodes in their own phase."""
        found = [own.copy() for own in self.compliances]
        for own, slope in zip(found, layer, strict=True):
            own[np.diag_indices_from(own)] += slope
        return replace(self, compliances=found)

    def derivative(self, wear: Sequence[csr_array], held: Array) -> Dense | ByShape:
        """Return the left side's derivative with wear, as the number of unknowns makes it cheapest.

        Args:
            wear: M_k, the wear of each node by the pressures of phase k (n, n).
            held: D (n,), what holds the shape where no phase touches; else zero.
        """
        return self.whole(wear, held) if self.size <= WHOLE else ByShape(self, wear, held)

    def whole(self, wear: Sequence[csr_array], held: Array) -> Dense:
        """Return the equations of implicit wear as one matrix."""
        (m, n, _), matrix = self.shape, self.matrix()
        omega = np.arange(m * n, (m + 1) * n)
        for k, own in enumerate(wear):
            rows, columns = own.nonzero()
            matrix[m * n + rows, k * n + columns] -= own[rows, columns]
        matrix[omega, omega] += held
        return Dense(matrix)


class ByShape:
    """The derivative of the cyclic steady state, solved phase by phase and then for the shape.

    Args:
        equations, wear, held: As of `ShapeEquations.derivative`.
    """

    def __init__(self, equations: ShapeEquations, wear: Sequence[csr_array], held: Array) -> None:
        self.equations, self.wear, self.held = equations, list(wear), held

    def multiply(self, x: Array) -> Array:
        """Return the matrix times x."""
        return self.equations.multiply_with(x, self.wear, self.held)

    def factor(self, kept: Indices) -> Solve:
        """Return the solution operator of the rows and columns `kept`.

        Raises:
            LinAlgError: they are singular.
        """
        equations = self.equations
        m, n, _ = equations.shape
        free = np.zeros(equations.size, dtype=bool)
        free[kept] = True
        touching, shaped = free[: m * n].reshape(m, n), free[m * n : (m + 1) * n]
        reduced = _Reduced(self, touching, shaped)

        def solve(b: Array) -> Array:
            right = np.zeros(equations.size)
            right[kept] = b
            try:
                return reduced.solve(right)[kept]
            except np.linalg.LinAlgError:
                return equations.whole(self.wear, self.held).factor(kept)(b)

        return solve


class _Reduced:
    """The rest for GMRES once pressures and rigid modes are eliminated: the thermal gaps, the shape, lambda.

    Args:
        derivative: The problem that is solved.
        touching: The pressures that are free (m, n).
        shaped: The shapes that are free (n,).

    Raises:
        LinAlgError: a phase by itself is singular.
    """

    def __init__(self, derivative: ByShape, touching: Mask, shaped: Mask) -> None:
        self.derivative, self.equations = derivative, derivative.equations
        _, n, r = self.equations.shape
        self.nodes = [np.flatnonzero(own) for own in touching]
        self.shaped = np.flatnonzero(shaped)
        rigid = np.arange(n, n + r)
        rows = [own if k == 0 else np.concatenate([own, rigid]) for k, own in enumerate(self.nodes)]
        factors = zip(self.equations.phases, rows, strict=True)
        self.solves = [updating.factor(own.astype(np.int32)) for updating, own in factors]
        # The preconditioner: omega = (mean compliance) (its row) / (sum of M), and lambda by the balance of forces.
        sums = sum(own @ on.astype(float) for own, on in zip(derivative.wear, touching, strict=True))
        worn = np.asarray(sums)[self.shaped]
        self.worn = np.where(worn > 0, worn, 1.0)
        self.touched, self.held = worn > 0, derivative.held[self.shaped]
        self.forces = -self.equations.balances[0][:, self.shaped] * self.touched / self.worn
        self.schur = np.linalg.pinv(self.forces @ self.equations.modes[self.shaped])

    def pressed(self, gaps: Array, forces: Array) -> tuple[Array, Array]:
        """Return the pressures (m, n) and rigid modes (m - 1, r) that give gaps (m, n) and forces (m, r)."""
        m, n, r = self.equations.shape
        p, a = np.zeros((m, n)), np.zeros((m - 1, r))
        for k, (nodes, solve) in enumerate(zip(self.nodes, self.solves, strict=True)):
            if k == 0:
                p[0, nodes] = solve(gaps[0, nodes] + self.equations.modes[nodes] @ forces[0])
            else:
                found = solve(np.concatenate([gaps[k, nodes], forces[k]]))
                p[k, nodes], a[k - 1] = found[: len(nodes)], found[len(nodes) :]
        return p, a

    def _opened(self, y: Array) -> tuple[Array, Array, Array]:
        """Return thermal gaps (m, n), shape (n,) and lambda of the reduced unknowns."""
        m, n, r = self.equations.shape
        thermal = np.zeros((m, n))
        if self.equations.coupling is not None:
            thermal = y[: m * n].reshape(m, n)
        omega = np.zeros(n)
        omega[self.shaped] = y[len(y) - r - len(self.shaped) : len(y) - r]
        return thermal, omega, y[len(y) - r :]

    def _rows(self, p: Array, thermal: Array, omega: Array, velocity: Array) -> Array:
        """Return the reduced rows: thermal gaps, wear, and forces of the first phase."""
        equations = self.equations
        wear = self.derivative.held * omega - worn_by(self.derivative.wear, p) + equations.modes @ velocity
        rows = [wear[self.shaped], equations.balances[0] @ p[0]]
        if equations.coupling is not None:
            rows.insert(0, thermal.ravel() - equations.coupling @ p.ravel())
        return np.concatenate(rows)

    def multiply(self, y: Array) -> Array:
        """Return the reduced matrix times y."""
        m, _, r = self.equations.shape
        thermal, omega, velocity = self._opened(y.ravel())
        p, _ = self.pressed(-thermal - omega, np.zeros((m, r)))
        return self._rows(p, thermal, omega, velocity)

    def precondition(self, rows: Array) -> Array:
        """Return nearly what the reduced matrix takes to `rows`."""
        modes, r, rows = self.equations.modes[self.shaped], self.equations.shape[2], rows.ravel()
        thermal, wear, force = np.split(rows, [len(rows) - r - len(self.shaped), len(rows) - r])
        velocity = -self.schur @ (force - self.forces @ wear) if r else force
        left = wear - modes @ velocity
        every = np.zeros(self.equations.shape[1])
        every[self.shaped] = np.where(self.touched, left / self.worn, 0.0)
        omega = (self.equations.mean @ every)[self.shaped]
        if not self.touched.all():
            alone = np.where(self.touched, 1.0, np.where(self.held > 0, self.held, 1.0))
            omega = np.where(self.touched, omega, left / alone)
        return np.concatenate([thermal, omega, velocity])

    def solve(self, right: Array) -> Array:
        """Return all unknowns for the right sides of all rows, those that are not free zero.

        Raises:
            LinAlgError: GMRES did not converge.
        """
        m, n, r = self.equations.shape
        gaps, wear = right[: m * n].reshape(m, n), right[m * n : (m + 1) * n]
        forces = right[(m + 1) * n :].reshape(m, r)
        p, _ = self.pressed(gaps, forces)
        none = np.zeros((m, n))
        target = -self._rows(p, none, none[0], np.zeros(r))
        target[len(target) - r :] += forces[0]
        target[len(target) - r - len(self.shaped) : len(target) - r] += wear[self.shaped]
        y = solution(self.multiply, self.precondition, target)
        thermal, omega, velocity = self._opened(y)
        p, a = self.pressed(gaps - thermal - omega, forces)
        return np.concatenate([p.ravel(), omega, a.ravel(), velocity])
