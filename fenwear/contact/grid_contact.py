"""Phases on one grid, whose compliances are convolutions: any number of nodes, by products alone.

Each phase has the unknowns (p, a) and [S_k, H; E_k, 0]; with wear in the step all pressures open all phases, too. The
rows and columns of nodes in contact are solved by GMRES, with products by Fourier transforms no wider than the contact.
The preconditioner is the inverse on an endless grid (`endless_grid`), restricted to the nodes in contact, with the
balance of forces held exactly: about as many iterations for any number of nodes and any length of the step.

Newton's method takes its steps to some digits, in double precision: rounding in single precision, other for every last
bit of what comes in, would be left in pressures that few digits are asked of (1e-7 of them from one rank to two).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, hstack, vstack

from fenwear.algebra.krylov import flexible
from fenwear.algebra.submatrices import Indices, Solve
from fenwear.common.arrays import Array
from fenwear.contact.endless_grid import SAME, EndlessGrid, Passing, Patch
from fenwear.surfaces import ContactPair
from fenwear.surfaces.grid_compliance import Box, Boxes, GridCompliance, OnBox

ACCURACY = 1e-12  # residual over the right-hand side
FAR = 1e-5  # the same that is no solution, where the accuracy was not reached
ROUGH = 0.1  # residual over that before, of a set that may change
SETS = 60  # of nodes, after each other
FEW = 1e-3  # of a set: by how much the next one may differ for it to be solved to all digits
SHARE = 0.3  # of a residual that is enough, to be below it with all nodes, too
FALLS = 0.5  # of the residual on a set that stays: by less rounding is at its end
RESTART, RESTARTS = 40, 15
SLIGHT = 1e-2  # of pressures: what brings them into balance


class Opened(NamedTuple):
    """Gap that unit pressures open besides the bodies, over the phases' nodes (m, n); 0 for nothing.

    Attributes:
        common: At their own nodes of the punch, in every phase.
        strip: On the strip's material below them, wherever it is in each phase.
        own: At their own nodes in their own phase alone.
    """

    common: Array | float = 0.0
    strip: Array | float = 0.0
    local: Array | float = 0.0


NOTHING = Opened()


class PhasesGrid:
    """The grid that phases stand on, and what products on boxes of it need, which is kept.

    Args:
        of: Compliance of each phase, on one grid.
        modes: H of each phase (n, r), the gap that each rigid mode opens.
        balances: E of each phase (r, n), what each node's pressure puts on each mode.
        pairs: The surfaces opposite each other in each phase.
    """

    def __init__(
        self,
        of: Sequence[GridCompliance],
        modes: Sequence[Array],
        balances: Sequence[Array],
        pairs: Sequence[ContactPair],
    ) -> None:
        self.of, self.modes, self.balances, self.pairs = list(of), list(modes), list(balances), list(pairs)
        self.places, self.shape = self.of[0].of.places, self.of[0].of.counts
        self.boxes = Boxes(self.places, self.shape, lambda box: PhasesBox(self, box))

    @cached_property
    def passing(self) -> list[Passing]:
        """Weights by which the node in the middle reads the strip, and puts the wear below it there, in each phase."""
        middle = int(np.abs(self.places - np.array(self.shape) / 2).sum(axis=1).argmin())
        punch, strip = self.pairs[0].punch, self.pairs[0].strip
        far = int(np.abs(self.places - self.places[middle]).sum(axis=1).argmax())
        apart = (self.places[far] - self.places[middle]).astype(float)
        axes = [axis for axis in range(punch.dim) if axis != int(np.abs(punch.outward[middle]).argmax())]
        spacing = (punch.x[far] - punch.x[middle])[axes] / apart
        places = np.rint((strip.x - punch.x[middle])[:, axes] / spacing).astype(np.int64)
        weights = []
        for pair in self.pairs:
            read = csr_array(pair.wear_interpolation[[middle]])
            put = csr_array(csr_array(pair.wear_projection)[:, [middle]].T)
            weights.append(Passing(read.data, places[read.indices], put.data, places[put.indices]))
        return weights


class PhasesBox:
    """Products of all phases on a box of the grid.

    Args:
        grid: Their system.
        box: The box.
    """

    def __init__(self, grid: PhasesGrid, box: Box) -> None:
        self.grid, self.box = grid, box
        self.products = OnBox(grid.of, box)
        self.modes = self._boxed(np.array([modes.T for modes in grid.modes]))  # (m, r, ...)
        self.balance = self._boxed(np.array(grid.balances))
        # Where weights are even, a balance is its motion times a number.
        size = np.abs(self.balance).sum() / max(np.abs(self.modes).sum(), 1e-300)
        apart = np.abs(self.balance - size * self.modes).max(initial=0.0)
        self.even = size if apart <= SAME * np.abs(self.balance).max(initial=0.0) else None

    def multiply(self, p: Array, a: Array, by: Opened) -> tuple[Array, Array]:
        """Return the gaps (m, ...) of pressures and of rigid motions (m, r), and the forces (m, r) of pressures."""
        gaps, (m, r) = self.products.apply(p[:, None])[:, 0], a.shape
        gaps += self.opened(by, p)
        size = p[0].size  # of the box: there may be no rigid motions
        gaps += (a[:, None] @ self.modes.reshape(m, r, size)).reshape(gaps.shape)
        return gaps, (self.balance.reshape(m, r, size) @ p.reshape(m, size, 1))[:, :, 0]

    def _boxed(self, values: Array) -> Array:
        m, r, n = values.shape
        return self.box.spread(values.reshape(m * r, n)).reshape(m, r, *self.box.counts)

    @cached_property
    def endless(self) -> EndlessGrid:
        """The inverse on an endless grid."""
        wears = any(pair.wear_projection.nnz for pair in self.grid.pairs)
        return EndlessGrid(self.products, self.grid.passing if wears else ())

    @cached_property
    def _strip(self) -> tuple[csr_array, csr_array]:
        """Sums of all phases' weights, to put on the strip and to read there, over the places of the box."""
        box, pairs = self.box, self.grid.pairs
        nodes, size = len(box.nodes), int(np.prod(box.counts))
        there = csr_array((np.ones(nodes), (np.arange(nodes), box.at)), shape=(nodes, size))
        to = hstack([csr_array(pair.wear_projection)[:, box.nodes] @ there for pair in pairs], format="csr")
        back = vstack([there.T @ csr_array(pair.wear_interpolation)[box.nodes] for pair in pairs], format="csr")
        return csr_array(to), csr_array(back)

    def opened(self, by: Opened, p: Array) -> Array:
        """Return the openings by pressures in the box (m, ...) besides the bodies, by slopes there."""
        openings = by.local * p + (by.common * p).sum(axis=0)
        if np.any(by.strip):
            to, back = self._strip
            openings += (back @ (to @ (by.strip * p).ravel())).reshape(p.shape)
        return openings

    def slopes(self, by: Opened) -> Opened:
        """Return slopes of all nodes in the box."""
        return Opened(*(self.box.spread(slope) if isinstance(slope, np.ndarray) else slope for slope in by))


class GriddedPhases:
    """The phases' blocks side by side; where something opens besides, with what all phases' pressures open in each.

    Args:
        grid: The phases.
        opened: Gap that unit pressures open besides the bodies; by default nothing.
    """

    def __init__(self, grid: PhasesGrid, opened: Opened = NOTHING) -> None:
        self.grid, self.opened = grid, opened
        self.m, (self.n, r) = len(grid.of), grid.modes[0].shape
        self.size = self.n + r
        self._slopes = grid.boxes.of_all.slopes(opened)

    def multiply(self, x: Array) -> Array:
        """Return the matrix times x."""
        parts, on = x.reshape(self.m, -1), self.grid.boxes.of_all
        gaps, forces = on.multiply(on.box.spread(parts[:, : self.n]), parts[:, self.n :], self._slopes)
        return np.concatenate([on.box.values(gaps), forces], axis=1).ravel()

    def factor(self, kept: Indices) -> Solve:
        """Return the solution operator of the rows and columns `kept`.

        Raises:
            LinAlgError: nothing touches, or its loads are not balanced; the operator, where it finds no solution.
        """
        free = np.zeros(self.m * self.size, dtype=bool)
        free[kept] = True
        parts = free.reshape(self.m, self.size)
        touched = np.flatnonzero(parts[:, : self.n].any(axis=0))
        if not len(touched):
            raise np.linalg.LinAlgError("singular matrix")
        on = self.grid.boxes.around(touched)
        slopes = on.slopes(self.opened)
        closed = _Closed(on, slopes, on.box.spread(parts[:, : self.n]) > 0, parts[:, self.n :])

        def solve(b: Array) -> Array:
            right = np.zeros(self.m * self.size)
            right[kept] = b
            rights = right.reshape(self.m, -1)
            p, a, *_, rest = closed.solve(on.box.spread(rights[:, : self.n]), rights[:, self.n :], ACCURACY)
            if not rest <= FAR:
                raise np.linalg.LinAlgError("singular matrix")
            unknowns = np.zeros((self.m, self.size))
            unknowns[:, on.box.nodes], unknowns[:, self.n :] = on.box.values(p), a
            return np.asarray(unknowns.ravel()[kept])

        return solve

    def improved(self, x: Array, f: Array, enough: float, below: float) -> Array:
        """Return a solution of the inequality, better by some digits, from one with pressures >= 0.

        The change is solved for on a box around the contact: f is what changes are worth there.

        Args:
            x: Unknowns.
            f: Their residual.
            enough: The norm of it that need not be less.
            below: Largest negative gap that is allowed.

        Raises:
            LinAlgError: nothing touches, or the loads are not balanced by what does.
        """
        n, (parts, rest) = self.n, (vector.reshape(self.m, -1) for vector in (x, f))
        touched = np.flatnonzero(((parts[:, :n] > 0) | (rest[:, :n] < -below)).any(axis=0))
        if not len(touched):
            raise np.linalg.LinAlgError("singular matrix")
        on = self.grid.boxes.around(touched)
        slopes = on.slopes(self.opened)
        change = _Change(on, slopes, on.box.spread(parts[:, :n]), on.box.spread(rest[:, :n]), rest[:, n:])
        p, a, touches = change.solve(enough, below)
        better = parts.copy()
        changed = better[:, on.box.nodes] + on.box.values(p)
        better[:, on.box.nodes] = np.where(on.box.values(touches.astype(np.float64)) > 0, np.maximum(changed, 0.0), 0.0)
        better[:, n:] += a
        return better.ravel()

    def balanced(self, x: Array, f: Array) -> Array:
        """Return unknowns with pressures scaled to balance the loads, by factors that vary as the rigid motions.

        Args:
            x: Unknowns, whose pressures are >= 0.
            f: Their residual, small in the balances.
        """
        parts, forces = x.reshape(self.m, -1).copy(), f.reshape(self.m, -1)[:, self.n :]
        for phase_unknowns, modes, balance, rest in zip(
            parts, self.grid.modes, self.grid.balances, forces, strict=True
        ):
            pressure = phase_unknowns[: self.n]
            by_share = balance @ (pressure[:, None] * modes)
            share = modes @ np.linalg.lstsq(by_share, -rest)[0]
            if np.abs(share).max(initial=0.0) < SLIGHT:
                phase_unknowns[: self.n] = pressure * (1 + share)
        return np.asarray(parts.ravel())


class _Change:
    """The change of pressures and rigid motions that takes gaps and forces to those of contact.

    Args:
        on: The box.
        slopes: Gap that opens besides in it.
        before: Pressures (m, ...).
        gaps: Of them (m, ...).
        forces: That are not balanced (m, r).
    """

    def __init__(self, on: PhasesBox, slopes: Opened, before: Array, gaps: Array, forces: Array) -> None:
        self.on, self.slopes = on, slopes
        self.before, self.gaps, self.forces = before, gaps, forces

    def solve(self, enough: float, below: float) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Return the changes of pressures (m, ...) and motions (m, r), and the sets of nodes in contact in turn."""
        least = -self.before
        p, a = np.zeros_like(self.before), np.zeros_like(self.forces)
        gaps, forces = self.gaps, self.forces
        closed, all_motions = (self.before > 0) | (gaps < -below), np.ones(forces.shape, dtype=bool)
        last, changed, idle = np.inf, closed.sum(), False
        solver: _Closed | None = None
        for number in range(SETS):
            wrong = closed | (gaps < -below)  # as of what asks for the change
            size = float(np.sqrt((gaps[wrong] ** 2).sum() + (forces**2).sum()))
            wanted, stays = SHARE * enough, size > FALLS * last
            if number and (size <= wanted or (stays and (idle or not changed))):
                break
            last, idle = size, stays
            solver = _Closed(self.on, self.slopes, closed, all_motions, solver)
            final = changed <= FEW * closed.sum()
            by_p, by_a, *by, _ = solver.solve(-gaps, -forces, max(wanted / size, 0.0 if final else ROUGH))
            p, a, gaps, forces = p + by_p, a + by_a, gaps + by[0], forces + by[1]
            if (p < least).any():
                p = np.maximum(p, least)
                products = self.on.multiply(p, a, self.slopes)
                gaps, forces = self.gaps + products[0], self.forces + products[1]
            now = (p > least) | (~closed & (gaps < -below))
            changed, closed = (now != closed).sum(), now
        return p, a, p > least


class _Closed:
    """The solution on nodes in contact.

    Vectors are of a box that holds them, zero where no node is in contact, and of the rigid motions.

    Args:
        on: The box.
        slopes: Gap that opens besides in it.
        closed: Whether a node touches in each phase (m, ...).
        rigid: Whether a motion is free (m, r).
        before: Of another set of nodes: what opens besides is taken from there.

    Raises:
        LinAlgError: the nodes in contact do not balance the loads.
    """

    def __init__(
        self,
        on: PhasesBox,
        slopes: Opened,
        closed: NDArray[np.bool_],
        rigid: NDArray[np.bool_],
        before: _Closed | None = None,
    ) -> None:
        self.on, self.slopes, self.rigid = on, slopes, rigid
        self.closed = closed.astype(np.float64)
        self._shape = (len(closed), -1)
        if before is None:
            self._mean(slopes)
        free = rigid.reshape(*rigid.shape, *(1,) * len(on.box.counts)) * self.closed[:, None]
        self.patch = Patch(on.endless, on.modes * free, on.balance * free if on.even is None else on.even)

    def _mean(self, slopes: Opened) -> None:
        """Take what unit pressures open on average, on the endless grid."""
        inner = tuple(range(1, self.closed.ndim))
        count = np.maximum(self.closed.sum(axis=inner), 1.0)

        common, strip, local = (np.asarray((values * self.closed).sum(axis=inner) / count) for values in slopes)
        self.on.endless.take(common, strip, float(local.mean()))

    def _parts(self, x: Array) -> tuple[Array, Array]:
        """Return pressures (m, ...) and rigid motions (m, r) of a vector."""
        cut = self.closed.size
        return x[:cut].reshape(self.closed.shape), x[cut:].reshape(self.rigid.shape)

    def _multiply(self, x: Array) -> Array:
        """Return the product at all nodes in the box."""
        p, a = self._parts(x)
        return np.concatenate([part.ravel() for part in self.on.multiply(p, a, self.slopes)])

    def _precondition(self, x: Array) -> Array:
        return self._joined(*self.patch.solve(*self._parts(x)))

    def _joined(self, p: Array, a: Array) -> Array:
        return np.concatenate([(p * self.closed).ravel(), (a * self.rigid).ravel()])

    def solve(self, gaps: Array, forces: Array, accuracy: float) -> tuple[Array, Array, Array, Array, float]:
        """Return pressures (m, ...) and rigid motions (m, r), their gaps in all of the box and their forces.

        And what residual is left over the right-hand side.
        """
        kept = np.concatenate([self.closed.ravel(), self.rigid.ravel()])
        right = self._joined(gaps, forces)
        x, rest, self.iterations, product = flexible(
            self._multiply, self._precondition, right, accuracy, RESTART, RESTARTS, kept
        )
        return *self._parts(x), *self._parts(product), rest
