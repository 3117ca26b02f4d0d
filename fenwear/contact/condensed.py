"""Contact as a variational inequality: Signorini's conditions with friction of known direction.

For every phase of the motion (a sliding direction d) and every contact node:

    gap = S(tau) p + H a + g >= 0,    p >= 0,    p gap = 0,
    sum of w_i p_i (e_n + tau)_i . m_i + F = 0   for the rigid modes a and their motions m,

tau the traction of friction over the pressure, g the gap of the unloaded bodies with their
loads' effect and the worn depth. A `WearCompliance` adds to the gaps of all phases what their own pressures
open, such as the wear of the step they belong to, and to those of each phase its compliance under its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Protocol, TypeVar

import numpy as np
from mpi4py import MPI
from scipy.linalg import block_diag

from fenwear.algebra.submatrices import Blocks, Dense, Operator, Solve, eliminate, joined
from fenwear.common.arrays import Array, Mask, Nodes
from fenwear.common.errors import FULL_START, INTERIOR, SOFTER_START, ConvergenceError, Remedies
from fenwear.common.parallel import Team
from fenwear.contact.grid_contact import GriddedPhases, Opened, PhasesGrid
from fenwear.contact.inequality import TOLERANCE, Inequality
from fenwear.surfaces import Interface
from fenwear.surfaces.compliance import EVERY
from fenwear.surfaces.grid_compliance import GridCompliance

T = TypeVar("T")
PREFIX, NAME = "fenwear_contact_", "the contact of punch and strip"
MANY = 400  # nodes from which on sets are gone through before SNES starts, and meshes are taken for grids
NUDGE = 1e-6  # of the largest pressure, for differences
NONE = np.zeros(())
SETTLED, ROUNDS = 1e-10, 50  # change of gaps over those of the load that ends iterations of friction; the most of them
STIFFER, LEAST = 3.0, 1.05  # than before, of bodies that give way less and less; and where it does not get there
ZERO = 1e-12  # of the mean pressure: what an open node may have left by rounding


@dataclass(frozen=True)
class ContactState:
    """Contact in each of m phases.

    Attributes:
        pressure: p (m, n), MPa.
        gap: (m, n), mm.
        rigid: Amplitudes a of the rigid modes (m, modes).
        iterations: Newton iterations of the inequality; -1 where it has not been solved yet.
    """

    pressure: Array
    gap: Array
    rigid: Array
    iterations: int

    @classmethod
    def unsolved(cls, nodes: int) -> ContactState:
        """Return the contact of a phase that has not been solved yet: NaN."""
        unknown = np.full((1, nodes), np.nan)
        return cls(unknown, unknown, np.zeros((1, 0)), -1)

    @property
    def solved(self) -> bool:
        """Whether it has been solved."""
        return self.iterations >= 0


@dataclass(frozen=True)
class SlidingContact:
    """Sliding in one phase.

    Attributes:
        interface: The surfaces opposite each other, under the loads of the phase.
        friction_ratio: tau (n, d), the traction of friction on the punch over the pressure.
    """

    interface: Interface
    friction_ratio: Array


class WearCompliance(Protocol):
    """Addition of the phases' own pressures to every phase's gap."""

    def opening(self, pressure: Array) -> Array:
        """Return the added gap (m, n), mm, from the pressures (m, n)."""

    def local(self, pressure: Array) -> Array | None:
        """Return the gap that unit pressures open at their own nodes (m, n), mm/MPa; None where others open, too."""

    def by_body(self, pressure: Array) -> tuple[Array | None, Array | None]:
        """Return the openings by unit pressures at the punch's nodes, and on the strip's, without `layer`.

        (m, n) each, mm/MPa; None for nothing.
        """

    def border(self, pressure: Array) -> tuple[Array, Array]:
        """Return L (m, n, q) and R (m, q, n): its derivative, of phase k to pressures j, is L_k R_j, mm/MPa."""

    @property
    def curved(self) -> bool:
        """Whether a layer has a compliance that is not linear."""

    def layer(self, pressure: Array) -> Array | None:
        """Return the gap that unit pressures open at their own nodes in their own phase alone (m, n); None for none."""


class ContactSolver(Protocol):
    """Contact in a fixed sequence of phases, kept for many solves."""

    def press(self, factor: float) -> None:
        """Take all loads times a factor."""

    def slide(self, ratios: Sequence[Array]) -> None:
        """Set tau of each phase, (n, d) each."""

    def solve(
        self,
        gap: Array,
        start: ContactState | None = None,
        wearing: WearCompliance | None = None,
        coupling: Array | None = None,
    ) -> ContactState:
        """Return the contact for the unloaded gap (n,) or (m, n), mm."""


class CondensedContact:
    """The inequality on the condensed interface, with unknown (p, a) for each phase.

    Pressure is scaled by the mean pressure, gap by the elastic length that belongs to it, so that
    PETSc's absolute tolerances mean the same for every case. Phases meet in the wear of the step only: where
    there are many, one small elimination for each of them takes the place of one of all. Where both bodies are
    convolutions on a grid no matrix is made. On several ranks rank 0 solves it.

    Attributes:
        gridded: Whether all compliances are convolutions on a grid.
        most: The largest pressure, MPa.
    """

    def __init__(
        self,
        phases: Sequence[SlidingContact],
        remedies: Remedies | None = None,
        team: Team | None = None,
        most: float = np.inf,
    ) -> None:
        """Take the phases, where to note that a contact was solved in another way than usual, and ranks that have it.

        By default every rank has a contact of its own. Of one phase by a matrix no pressure exceeds `most`, MPa: there
        the surfaces flow, and the gap is what they have to, below zero.
        """
        self.phases = list(phases)
        self._remedies = remedies or Remedies()
        interface = phases[0].interface
        rigid = interface.rigid
        n, r, m = len(rigid.pair.weights), len(rigid.resultant), len(self.phases)
        self.shape = (m, n)
        self._pressure_scale = interface.pressure_scale
        self._gap_scale = self._pressure_scale * interface.elastic_length
        # Arrays of one number: numpy takes twice as long for numbers of Python.
        self._scales = np.array(self._pressure_scale), np.array(1 / self._gap_scale)
        lengths = np.abs(rigid.rigid_normal).max(axis=0, initial=0.0)
        self._rigid_scale = self._gap_scale / lengths
        self._resultant_scale = lengths * self._pressure_scale * rigid.pair.weights.sum()
        size = n + r
        self._team = team or Team.of(MPI.COMM_SELF)
        self._tables: dict[bytes, Array] = {}  # of convolutions, by their traction
        self._offset = np.zeros((m, size))
        self._rigid_normals = np.array([phase.interface.rigid.rigid_normal.T for phase in self.phases])
        self.press(1.0)
        self._ratios = [phase.friction_ratio for phase in self.phases]
        self._even: dict[int, Array] = {}  # where friction differs from node to node, that which products are of
        self._beside = np.zeros((m, *phases[0].friction_ratio.shape))  # what differs from it
        self._modes = np.zeros((m, n, r))
        self._balances = np.zeros((m, r, n))
        self._on_grid: list[GridCompliance | None] = [None] * m
        self._take(range(m))
        self.gridded = None not in self._on_grid
        self._dense: Array = np.zeros((m, 0 if self.gridded else size, size))
        self._slide(range(m))
        self._coupling: Array | None = None
        self._wearing: WearCompliance | None = None
        self._mu: Callable[[Array], Array] | None = None  # of friction that follows the pressure
        self._by_mu: Array = np.zeros((0, 0))  # what unit pressures add by the traction of a unit of it (size, n)
        self._slopes: list[
            Array | float
        ] = []  # of what wears in the step, and of what gives way, and what is made of it
        self._operator: Operator
        lower = np.tile(np.concatenate([np.zeros(n), np.full(r, -np.inf)]), m)
        upper, functions = np.full(m * size, np.inf), (self._residual, self._jacobian)
        self.most = np.inf if self.gridded or m > 1 else most
        upper[:n] = self.most / self._pressure_scale
        self.inequality = Inequality(lower, upper, *functions, PREFIX, NAME, self._rounding)
        self.inequality.sets_first, self.inequality.by_digits = self.gridded or n > MANY, self.gridded

    def _take(self, phases: Iterable[int]) -> None:
        """Take the friction of phases: their rigid motions, balances, and compliances on a grid.

        On a grid products are of one friction: that of the first mean. The difference from it is found by iterations.
        """
        for k in phases:
            interface, ratio = self.phases[k].interface, self._ratios[k]
            rigid, pair = interface.rigid, interface.pair
            self._modes[k] = rigid.rigid_normal * (self._rigid_scale / self._gap_scale)
            self._balances[k] = rigid.equilibrium(ratio) * (self._pressure_scale / self._resultant_scale[:, None])
            if interface.in_memory or (pair.punch.grid is None and len(pair.weights) <= MANY):
                continue
            even = ratio
            if np.ptp(ratio, axis=0).any():
                even = self._even.setdefault(k, np.broadcast_to(ratio.mean(axis=0), ratio.shape))
            self._on_grid[k] = interface.compliance(even, self._scale, self._tables).on_grid
            self._beside[k] = (ratio - even) * pair.weights[:, None]

    def _slide(self, phases: Iterable[int]) -> None:
        """Make the matrices of phases from their friction, or the products in their place."""
        self.__dict__.pop("_grid", None)
        self._differs = self.gridded and bool(self._beside.any())
        for k in phases if not self.gridded else ():
            self._dense[k] = self._matrix(self.phases[k].interface.compliance(self._ratios[k], self._scale).matrix(), k)
        self._blocks = Blocks(self._dense, self.shape[1])

    @property
    def _scale(self) -> float:
        return self._pressure_scale / self._gap_scale

    def _matrix(self, compliance: Array, k: int, nodes: Nodes = EVERY) -> Array:
        """Return [S, H; E, 0] of a phase, or the rows and columns of some nodes."""
        modes, balance = self._modes[k][nodes], self._balances[k][:, nodes]
        return np.block([[compliance, modes], [balance, np.zeros((len(balance),) * 2)]])

    def press(self, factor: float) -> None:
        """Take all loads times a factor."""
        n = self.shape[1]
        self._loads = factor * np.array([phase.interface.load_gap for phase in self.phases])
        for phase, offset in zip(self.phases, self._offset, strict=True):
            offset[n:] = factor * phase.interface.rigid.resultant / self._resultant_scale

    def slide(self, ratios: Sequence[Array]) -> None:
        """Set tau of each phase, (n, d) each."""
        self._mu = None
        pairs = enumerate(zip(ratios, self._ratios, strict=True))
        changed = [k for k, (ratio, before) in pairs if ratio is not before and not np.array_equal(ratio, before)]
        self._ratios = list(ratios)
        if changed:
            self._take(changed)
            self._slide(changed)
            self._forget()

    def _forget(self) -> None:
        """Forget the derivatives that were made."""
        self.__dict__.pop("_linear", None)
        self._slopes = []

    @property
    def can_follow(self) -> bool:
        """Whether friction may follow the pressure: of one phase, by a matrix."""
        return not self.gridded and len(self.phases) == 1

    def follow(self, mu: Callable[[Array], Array], bare: Array, along: Array) -> None:
        """Take friction that follows the pressure, tau = bare + mu(p) along, until `slide` is called again.

        Pressure and friction are found together, by one Newton's method: tau p has the slope bare + (mu + p mu') along.

        Args:
            mu: By the pressure (n,), MPa.
            bare: Part of tau without mu (n, d).
            along: Tau of a unit of mu (n, d).
        """
        n = self.shape[1]
        if not self._by_mu.size:
            self.slide([bare + along])
            full = self._dense[0, :, :n].copy()
            self.slide([bare])
            self._by_mu = full - self._dense[0, :, :n]
        elif self._ratios[0] is not bare:
            self.slide([bare])
        self._mu = mu

    def _following(self, x: Array) -> Operator:
        """Return the derivative with friction that follows the pressure, as `_jacobian`."""
        n = self.shape[1]
        assert self._mu is not None
        pressure = np.maximum(x[:n], 0.0) * self._pressure_scale
        mu, nudge = self._mu(pressure), NUDGE * max(float(pressure.max()), self._pressure_scale)
        slope = (self._mu(pressure + nudge) - mu) / nudge
        matrix = self._dense[0].copy()
        matrix[:, :n] += self._by_mu * (mu + pressure * slope)
        if self._wearing is not None:
            added, layer = self._wearing.local(pressure[None]), self._wearing.layer(pressure[None])
            assert added is not None
            matrix[:n, :n] += np.diag(self._scale * (added[0] if layer is None else added[0] + layer[0]))
        return Dense(matrix)

    def _residual(self, x: Array) -> Array:
        f = self._linear.multiply(x)
        f += self._offset.reshape(-1)
        if self._mu is not None:
            trial = x[: self.shape[1]]
            pressure = np.maximum(trial, NONE)
            pressure *= self._scales[0]
            f += self._by_mu @ (self._mu(pressure) * trial)
        if self._wearing is not None:
            m, n = self.shape
            opened = self._wearing.opening(x.reshape(m, -1)[:, :n] * self._scales[0])
            f.reshape(m, -1)[:, :n] += opened * self._scales[1]
        return f

    def _rounding(self) -> float:
        """Return the wear of a step at the mean pressure over the elastic gap: thousands where bodies are stiff."""
        if self._wearing is None:
            return 1.0
        mean = np.full(self.shape, self._pressure_scale)
        return float(np.abs(self._wearing.opening(mean)).max()) / self._gap_scale

    @cached_property
    def _linear(self) -> Operator:
        """The derivative of the residual without the wear of the step."""
        return GriddedPhases(self._grid) if self.gridded and self._coupling is None else self._as_phases()

    @cached_property
    def _grid(self) -> PhasesGrid:
        """The grid of the phases."""
        of = [operator for operator in self._on_grid if operator is not None]
        return PhasesGrid(of, list(self._modes), list(self._balances), [phase.interface.pair for phase in self.phases])

    def _as_phases(
        self, border: tuple[Array, Array] | None = None, local: Array | None = None, layer: Array | None = None
    ) -> Operator:
        """Return the derivative by matrices of all nodes."""
        blocks = self._blocks
        if self.gridded:
            matrices = [self._matrix(operator.matrix(), k) for k, operator in enumerate(self._grid.of)]
            blocks = Blocks(np.array(matrices), self.shape[1])
        if layer is not None:
            blocks = blocks.added(layer)
        return joined(blocks, None if self._coupling is None else self._coupling * self._scale, border, local)

    def _jacobian(self, x: Array) -> Operator:
        if self._mu is not None:
            return self._following(x)
        if self._wearing is None:
            return self._linear
        m, n = self.shape
        pressure, scale = x.reshape(m, -1)[:, :n] * self._pressure_scale, self._scale
        if self.gridded and self._coupling is None:
            return self._worn_on_grid(pressure, scale)
        left, slope = None, self._wearing.local(pressure)
        if slope is None:
            left, slope = self._wearing.border(pressure)
        layer = self._wearing.layer(pressure)
        if self._changed([slope] if layer is None else [slope, layer]):
            layer = None if layer is None else layer * scale
            if left is not None:
                self._operator = self._as_phases(border=(left, slope * scale), layer=layer)
            else:
                self._operator = self._as_phases(local=slope * scale, layer=layer)
        return self._operator

    def _worn_on_grid(self, pressure: Array, scale: float) -> Operator:
        """Return the derivative with the wear at a pressure (m, n), on a grid."""
        assert self._wearing is not None
        parts = *self._wearing.by_body(pressure), self._wearing.layer(pressure)
        slopes = [0.0 if slope is None else scale * slope for slope in parts]
        if self._changed(slopes):
            self._operator = GriddedPhases(self._grid, Opened(*slopes))
        return self._operator

    def _changed(self, slopes: list[Array | float]) -> bool:
        """Take these slopes, and return whether the last derivative is of others."""
        before, self._slopes = self._slopes, slopes
        return len(before) != len(slopes) or not all(map(np.array_equal, before, slopes))

    def solve(
        self,
        gap: Array,
        start: ContactState | None = None,
        wearing: WearCompliance | None = None,
        coupling: Array | None = None,
    ) -> ContactState:
        """Return the contact of all phases; collective.

        Args:
            gap: Gap of the undeformed bodies, initial gap and worn depth together, (n,) or (m, n), mm.
            start: Where Newton starts, such as the same phases one cycle ago; by default full contact.
            wearing: The wear of the step: adds what the pressures themselves open.
            coupling: Gap of each phase's nodes from each phase's pressures (m, n, m, n), mm/MPa, on
                top of the elastic compliance: what the heat of these pressures opens.

        Raises:
            ConvergenceError: SNES did not converge.
        """
        return self._team.lead(partial(self._iterated, gap, start, wearing, coupling))

    def _iterated(
        self, gap: Array, start: ContactState | None, wearing: WearCompliance | None, coupling: Array | None
    ) -> ContactState:
        """Return the contact, with the gaps that friction opens where it differs from that of the products.

        Raises:
            ConvergenceError: SNES did not converge, or these gaps do not settle.
        """
        if not self._differs:
            return self._solved(gap, start, wearing, coupling)
        opened = np.zeros(self.shape) if start is None else self._opened_beside(start.pressure)
        enough = max(self.inequality.close, SETTLED) * self._gap_scale
        for _ in range(ROUNDS):
            contact = self._solved(gap + opened, start, wearing, coupling)
            before, start = opened, contact
            opened = self._opened_beside(contact.pressure)
            if np.abs(opened - before).max() <= enough:
                return contact
        raise ConvergenceError(
            f"{self.inequality.name} did not converge: friction differs much from node to node. Reduce contact.friction"
        )

    def _opened_beside(self, pressure: Array) -> Array:
        """Return the gaps (m, n) by pressures (m, n) and the difference of friction from that of the products."""
        forces = self._beside * pressure[:, :, None]
        return np.array([phase.interface.apply(forces[k])[:, 0] for k, phase in enumerate(self.phases)])

    def _solved(
        self, gap: Array, start: ContactState | None, wearing: WearCompliance | None, coupling: Array | None
    ) -> ContactState:
        m, n = self.shape
        # From the rigid motions of the start: they take up a worn depth that may be thousands of times what the bodies
        # give. What is left at the nodes in contact is as small as the elastic gap, and so is the residual's rounding.
        begun = np.zeros((m, self._offset.shape[1] - n)) if start is None else start.rigid
        rigid = np.matmul(begun[:, None, :], self._rigid_normals)[:, 0]
        self._offset[:, :n] = (gap + self._loads + rigid) / self._gap_scale
        if not math.isfinite(self._offset.sum()):  # nor is a sum with one that is not
            raise ConvergenceError(f"{self.inequality.name}: the gap overflows. Check loads and units")
        if coupling is not self._coupling:
            self._coupling = coupling
            self._forget()
        self._wearing = wearing
        x, f, iterations = self._solve(start)
        if self.gridded and isinstance(operator := self._linear, GriddedPhases):
            x = operator.balanced(x, f)
        x, f = x.reshape(m, -1), f.reshape(m, -1)
        pressure, open_ = x[:, :n] * self._pressure_scale, x[:, :n] <= ZERO
        if self._mu is not None or (
            wearing is not None and wearing.curved
        ):  # where layers are soft without pressure next to none closes some of a gap
            open_ &= f[:, :n] > TOLERANCE
        pressure[open_] = 0.0
        if self.most < np.inf:
            pressure[x[:, :n] >= self.most / self._pressure_scale] = self.most
        return ContactState(pressure, f[:, :n] * self._gap_scale, begun + x[:, n:] * self._rigid_scale, iterations)

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return int(self._offset.size)

    def on_closed_contact(self, use: Callable[[Solve], T], closed: Mask | None = None) -> T:
        """Return the result of `use` for the solution operator of (p, a) where nodes touch, scaled; collective.

        Args:
            use: Called with the operator on the unknowns of `closed` and of the rigid motions.
            closed: Nodes of the only phase that touch (n,); by default all nodes of all phases.
        """
        n = self.shape[1]
        closed = np.ones(n, dtype=bool) if closed is None else closed
        if not self._differs:
            kept = np.append(closed, np.ones(self._offset.shape[1] - n, dtype=bool))
            every = np.flatnonzero(np.tile(kept, len(self.phases))).astype(np.int32)
            return self._team.lead(lambda: use(self._linear.factor(every)))
        nodes, matrices = np.flatnonzero(closed), []
        for k, (phase, ratio) in enumerate(zip(self.phases, self._ratios, strict=True)):
            compliance = phase.interface.compliance(ratio, self._scale).entries(nodes, nodes)
            matrices.append(self._matrix(compliance, k, nodes))
        return self._team.lead(lambda: use(eliminate(block_diag(*matrices))))

    def _solve(self, start: ContactState | None) -> tuple[Array, Array, int]:
        """Return the solution: unknowns, residual and iterations.

        SNES starts from a contact that is given, else from full contact. Where both fail the interior-point method
        leads to the solution, but without a matrix, for a largest pressure, and where heat bulges the surfaces, which
        it has no proof for: there a homotopy in the bodies' compliance does.
        """
        n, inequality = self.shape[1], self.inequality
        if start is not None:
            warm = np.zeros_like(self._offset)
            warm[:, :n] = start.pressure / self._pressure_scale
            try:
                return inequality.solve(warm.ravel(), near=True), inequality.residual, inequality.iterations
            except ConvergenceError:
                pass
        begin = np.zeros_like(self._offset)
        begin[:, :n] = 1.0
        failure: ConvergenceError | None = None
        for remedy, attempt in (
            (FULL_START if start is not None else "", inequality.solve),
            (INTERIOR, self._from_inside),
            (SOFTER_START, self._from_softer_bodies),
        ):
            try:
                x = attempt(begin.ravel())
            except ConvergenceError as error:
                failure = failure or error  # the first says most
                continue
            if remedy:
                self._remedies.note(remedy)
            return x, inequality.residual, inequality.iterations
        assert failure is not None
        raise failure

    def _from_inside(self, begin: Array) -> Array:
        """Return the solution by the interior-point method.

        Raises:
            ConvergenceError: it does not find one, or the contact is none for it.
        """
        if self._coupling is not None or self.most < np.inf:
            raise ConvergenceError(f"{self.inequality.name} has a largest pressure or heat")
        return self.inequality.solve_from_inside(begin)

    def _from_softer_bodies(self, begin: Array) -> Array:  # noqa: ARG002 (its own start)
        """Return the solution by way of softer bodies, whose contact is larger.

        Bodies that are softer by a factor press alike on gaps that are as much smaller. So a contact shrinks to its
        size, where sets of nodes that start from the few which touch first go round.

        Raises:
            ConvergenceError: one of them has no solution that is found.
        """
        n, gaps = self.shape[1], self._offset[:, : self.shape[1]].copy()
        softer, stiffer = max(float(np.ptp(gaps, axis=1).max()), 1.0), STIFFER
        known, x = softer, np.zeros_like(self._offset)  # how soft the last bodies were, and their contact
        x[:, :n] = 1.0
        try:
            while True:
                self._offset[:, :n] = gaps / softer
                near = x.copy()
                near[:, n:] *= known / softer
                try:
                    solution = self.inequality.solve(near.ravel())
                except ConvergenceError:
                    stiffer = np.sqrt(stiffer)
                    if softer == known or stiffer < LEAST:
                        raise
                    softer = max(known / stiffer, 1.0)
                    continue
                if softer == 1.0:
                    return solution
                x, known = solution.reshape(x.shape).copy(), softer
                softer = max(softer / stiffer, 1.0)
        finally:
            self._offset[:, :n] = gaps
