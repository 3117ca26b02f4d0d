"""One time step of contact with stick, by a semismooth Newton method.

Unknown are the pressure p and the tangential traction t of each node, the rigid modes a, and the displacement
delta of the rig where its force is imposed. With the gap g and the slip s of the step, both linear in them,

    p = max(0, p - c g),        t = P(t - c s),        P: projection on abs(t) <= mu p,

are Signorini's conditions and Coulomb's law (P. Alart and A. Curnier, Comput. Methods Appl. Mech. Engrg. 92, 1991),
together with the balance of the rigid modes. With a hardness H

    p = min(H, max(0, p - c g)):

surfaces that are pressed by H flow by -g, which stays; the limit of their friction is mu H. Each Newton step solves
the linear piece that its iterate lies in: open nodes carry nothing, flowing ones H, sticking ones do not slip,
slipping ones in the plane carry +-mu p.
Both laws stand in one system, so that the coupling of unlike bodies needs no outer iteration.

Coulomb's law with large friction has pieces of opposite orientation: then the step has no or several
answers (A. Klarbring, Ing.-Archiv 60, 1990). The sign of the determinant of the piece shows it.

Coulomb's cone: the tangential traction t of a node never exceeds mu p, in one or two tangential directions.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from fenwear.common.arrays import Array, Mask
from fenwear.common.errors import ConvergenceError
from fenwear.steps.stick_creep import Displaced, StickCreep
from fenwear.steps.stick_interface import StickInterface
from fenwear.steps.stick_position import Position
from fenwear.steps.stick_state import Imposed, StickState


def project(trial: Array, radius: Array) -> Array:
    """Return the points of the discs abs(t) <= radius that are nearest to `trial`.

    Args:
        trial: (n, m), m = d - 1 tangential directions, MPa.
        radius: mu p (n,), MPa; negative ones count as zero.
    """
    size = np.linalg.norm(trial, axis=1)
    limit = np.maximum(radius, 0.0)
    outside = size > limit
    return trial * np.where(outside, limit / np.where(outside, size, 1.0), 1.0)[:, None]


def derivative(trial: Array, radius: Array) -> tuple[Array, Array]:
    """Return the derivatives of the projection of points outside of their disc: to the trial, and to the radius.

    With the direction n of z: (r / |z|) (I - n n^T), of (n, m, m), and n, of (n, m).

    Args:
        trial: z (n, m), abs(z) > radius.
        radius: r (n,).
    """
    size = np.maximum(np.linalg.norm(trial, axis=1), 1e-300)
    direction = trial / size[:, None]
    across = np.eye(trial.shape[1]) - direction[:, :, None] * direction[:, None, :]
    return (np.maximum(radius, 0.0) / size)[:, None, None] * across, direction


CLOSE = 1e-10  # residual of the laws over the largest pressure
FEW = 8  # Newton steps from where it should take one or two
NEVER = 1000
ROUNDING = 1e-12  # of what the largest pressure gives way: no slip


class ContactStatus(NamedTuple):
    """Status of each node in a Newton step: closed (n,), slipping (n,), their trial (n, m), mu p and p there (n,).

    `flowing` are nodes whose pressure is the hardness (n,).
    """

    closed: Mask
    slipping: Mask
    trial: Array
    radius: Array
    pressure: Array
    flowing: Mask


class SurfaceDisplacement(NamedTuple):
    """Displacements by tractions: the surfaces against each other (d n,), the punch's (n, d), the strip's (q, d)."""

    jump: Array
    on_punch: Array
    on_strip: Array


class StatusSolution(NamedTuple):
    """Solver of the equations of a contact status: f (d n,), a, delta, the sign of the determinant, what moves.

    `jump` is what f moves the surfaces by against each other (d n,), where it is known.
    """

    f: Array
    rigid: Array
    displacement: float
    sign: int
    moved: SurfaceDisplacement | None = None
    jump: Array | None = None


class Step:
    """The equations of one time step.

    Args:
        interface: The bodies.
        position: The place of the strip.
        before: The state at the start.
        imposed: At the end.
        friction: mu (n,).
    """

    close, few = CLOSE, FEW  # residual that is enough; Newton steps that may be taken from a near status
    patience = NEVER  # Newton steps without success that end it

    def __init__(
        self, interface: StickInterface, position: Position, before: StickState, imposed: Imposed, friction: Array
    ) -> None:
        creep = interface.creep
        position = creep.grown(position, imposed.duration)
        self.interface, self.position, self.before, self.imposed = interface, position, before, imposed
        self.mu, self.creep = friction, creep
        self.n, self.d, _ = position.frame.shape
        self.m = self.d - 1
        self.free_punch = imposed.loaded.on_punch
        self.free_strip = imposed.loaded.on_strip + imposed.strain * interface.bulk
        read, turn = position.reading, position.pair.placement.vectors

        def apart(on_punch: Array, on_strip: Array) -> Array:
            return position.in_frame(on_punch - turn(read @ on_strip))

        now, old = apart(self.free_punch, self.free_strip), apart(before.on_punch, before.on_strip)
        self.closure, self.hardness = imposed.closure or interface.layers.closure, interface.layers.hardness
        closed = interface.layers.given(before.pressure, self.closure)
        if creep.creeps:
            (*crept, layer), (*had, closed_before) = self._crept(creep)
            now, old = now + apart(crept[0], crept[1]), old + apart(had[0], had[1])
            now[: self.n] += layer
            closed = closed + closed_before
        now, old = now - position.beside(imposed.beside), old - position.beside(before.beside)
        old += position.modes @ before.rigid - position.drive * before.displacement
        self.free = np.concatenate([imposed.opening + now[: self.n], now[self.n :] - old[self.n :]])
        self.approached = now[: self.n] - old[: self.n] - self.free[: self.n] - closed
        # Scales: c = 1 / scale of each node; lengths that belong to a unit of pressure; the area. One c for both
        # tangents: t = P(t - c s) turns slip against the traction only where c is a number, not a matrix.
        self.scale = np.abs(position.compliance.diagonal()).reshape(self.d, self.n)
        self.scale[1:] = self.scale[1:].mean(axis=0)
        self.length = float(np.median(self.scale[0]))
        self.units = self.length / np.maximum(np.abs(position.modes).max(axis=0, initial=0.0), 1e-300)
        self.area = float(position.pair.weights.sum())

    @cached_property
    def reachable(self) -> Mask:
        """Which nodes may touch at first (n,)."""
        return np.ones(self.n, dtype=bool)

    @cached_property
    def going_on(self) -> Mask:
        """Which nodes would slip on as their traction has them, if it stayed (n,): none where a motion turns back."""
        before = self.before
        if self.imposed.displacement is None:
            along = self.position.pull[self.n :].reshape(self.m, self.n).T
            grows = (self.imposed.force or 0.0) - before.force
            return np.asarray((along * before.traction).sum(axis=1) * grows >= 0)
        f = np.concatenate([before.pressure, before.traction.T.ravel()])
        _, slip = self.jumps(StatusSolution(f, before.rigid, self.imposed.displacement, 1))
        return np.asarray((slip * before.traction).sum(axis=1) <= 0)

    def _crept(self, creep: StickCreep) -> tuple[Displaced, Displaced]:
        """Return the crept displacements at the end of the step without its tractions, and at its start.

        Of punch, strip and layer: what was there before, and what the loads add in the step.
        """
        duration, state = self.imposed.duration, self.before.crept
        punch, strip, layer = creep.displaced(state, self.before.elastic, duration)
        loaded, factors = self.imposed.loaded, creep.factors(duration)
        punch, strip = punch + (factors[0] - 1) * loaded.forced_punch, strip + (factors[1] - 1) * loaded.forced_strip
        return (punch, strip, layer), creep.displaced(state)

    def jumps(self, solution: StatusSolution) -> tuple[Array, Array]:
        """Return the gap (n,) and the slip of the step (n, m)."""
        position, known = self.position, solution.jump if solution.moved is None else solution.moved.jump
        j = position.compliance.apply(solution.f) if known is None else known
        j = j + position.modes @ solution.rigid - position.drive * solution.displacement + self.free
        if self.closure is not None:
            j[: self.n] += self.closure.closure(solution.f[: self.n])
        return j[: self.n], j[self.n :].reshape(self.m, self.n).T

    def forget(self) -> None:
        """Restart, where solutions are sought from the last one; here they are not."""

    def solve(self, status: ContactStatus) -> StatusSolution:
        """Return the solution of a contact status.

        Raises:
            ConvergenceError: its equations are singular.
        """
        n, m, r, mu = self.n, self.m, self.position.modes.shape[1], self.mu
        closed = np.flatnonzero(status.closed)
        tied = status.slipping[closed] if m == 1 else np.zeros(len(closed), dtype=bool)  # t = +-mu p
        untied = closed[~tied]
        columns = np.concatenate([closed, (n * (1 + np.arange(m)) + untied[:, None]).ravel()])
        ratio = np.sign(status.trial[closed[tied], 0]) * mu[closed[tied]]
        k, loose = len(columns), self.imposed.force is not None
        A, b = np.zeros((k + r + loose, k + r + loose)), np.zeros(k + r + loose)

        def fill(rows: slice, matrix: NDArray[Any]) -> None:
            A[rows, :k] = matrix[:, columns]
            A[rows, : len(closed)][:, tied] += matrix[:, n + closed[tied]] * ratio

        unit, C = 1 / self.scale.ravel()[columns][:, None], self.position.compliance
        A[:k, :k] = C.entries(columns, columns) * unit
        A[:k, : len(closed)][:, tied] += C.entries(columns, n + closed[tied]) * unit * ratio
        A[:k, k : k + r] = self.position.modes[columns] * (unit * self.units)
        b[:k] = -unit[:, 0] * self.free[columns]
        if loose:
            A[:k, -1] = -self.position.drive[columns] * unit[:, 0] * self.length
            fill(slice(k + r, None), (self.position.pull / self.area)[None])
            b[-1] = (self.imposed.force or 0.0) / self.area
        else:
            b[:k] += self.position.drive[columns] * unit[:, 0] * (self.imposed.displacement or 0.0)
        if self.closure is not None:
            self._give_way(A, b, status, closed)
        if m > 1:
            self._slide(A, b, status, untied, len(closed))
        flows = np.flatnonzero(status.flowing[closed])
        A[flows], A[flows, flows], b[flows] = 0.0, 1.0, self.hardness
        balance = self.units / (self.length * self.area)
        fill(slice(k, k + r), self.position.balance * balance[:, None])
        b[k : k + r] = -self.imposed.loaded.resultant * balance
        x, sign = _solved(A, b)
        f = np.zeros(self.d * n)
        f[columns] = x[:k]
        f[n + closed[tied]] = ratio * f[closed[tied]]
        moved = float(x[-1] * self.length) if loose else float(self.imposed.displacement or 0.0)
        return StatusSolution(f, x[k : k + r] * self.units, moved, sign * (-1) ** r)

    def _give_way(self, A: Array, b: Array, status: ContactStatus, closed: NDArray[np.int64]) -> None:
        """Add the compliance beside the bodies to the rows c g = 0, linearised at the pressure of the status.

        Without pressure its compliance is unlimited: the rows are made of one size again.
        """
        if self.closure is None:
            return
        rows, pressure = np.arange(len(closed)), status.pressure[closed]
        slope = self.closure.slope(status.pressure)[closed]
        A[rows, rows] += slope / self.scale[0, closed]
        b[rows] -= (self.closure.closure(status.pressure)[closed] - slope * pressure) / self.scale[0, closed]
        size = 1 + slope / self.scale[0, closed]
        A[rows] /= size[:, None]
        b[rows] /= size

    def _slide(self, A: Array, b: Array, status: ContactStatus, untied: NDArray[np.int64], k: int) -> None:
        """Turn the rows c s = 0 of nodes that slip in two directions into t - P(t - c s) = 0, linearised."""
        m, places = self.m, np.flatnonzero(status.slipping[untied])
        nodes = untied[places]
        K, direction = derivative(status.trial[nodes], status.radius[nodes])
        rows = k + m * places[:, None] + np.arange(m)
        A[rows] = K @ A[rows]
        b[rows] = (K @ b[rows][:, :, None])[:, :, 0]
        A[rows[:, :, None], rows[:, None, :]] += np.eye(m) - K
        pressures = np.searchsorted(np.flatnonzero(status.closed), nodes)
        A[rows, pressures[:, None]] -= self.mu[nodes, None] * direction

    def status_of(self, solution: StatusSolution) -> tuple[ContactStatus, float]:
        """Return a solution's contact status, and the residual of the laws there over the largest pressure."""
        n = self.n
        gap, slip = self.jumps(solution)
        pressure, traction = solution.f[:n], solution.f[n:].reshape(self.m, n).T
        pushed = pressure - gap / self.scale[0]
        trial = traction - slip / self.scale[1:].T
        kept = np.clip(pushed, 0.0, self.hardness)
        radius = self.mu * kept
        wrong = max(np.abs(pressure - kept).max(), np.abs(traction - project(trial, radius)).max())
        slipping = (np.linalg.norm(trial, axis=1) > radius) & (pushed > 0)
        flowing = pushed > self.hardness
        status = ContactStatus(pushed > 0, slipping, trial, radius, np.maximum(pressure, 0.0), flowing)
        return status, float(wrong / max(pressure.max(), 1e-300))

    def state(self, solution: StatusSolution, iterations: int, *, unique: bool) -> StickState:
        """Return the state at the end of the step, without rounding errors in the laws."""
        n, position = self.n, self.position
        status, _ = self.status_of(solution)
        gap, slip = self.jumps(solution)
        pressure = np.where(status.closed, np.clip(solution.f[:n], 0.0, self.hardness), 0.0)
        pressure[status.flowing] = self.hardness
        traction = project(solution.f[n:].reshape(self.m, n).T, self.mu * pressure)
        flowed = np.where(status.flowing, np.maximum(-gap, 0.0), 0.0)
        gap = np.where(status.closed, 0.0, gap)
        rounding = ROUNDING * pressure.max() * self.scale[1:].T
        stuck = status.closed & (~status.slipping | (np.abs(slip) <= rounding).all(axis=1))
        slip = np.where(stuck[:, None], 0.0, slip)
        f = np.concatenate([pressure, traction.T.ravel()])
        moved = solution.moved or self._moved(f, solution.jump)
        crept, elastic = self.before.crept, self.before.elastic
        if self.creep.creeps:
            elastic = self.creep.of_contact(self.position, f, (moved.on_punch, moved.on_strip), self.imposed.loaded)
            crept = self.creep.after(crept, self.before.elastic, elastic, self.imposed.duration)
        return StickState(
            pressure,
            traction,
            gap,
            slip,
            self.approached + gap - flowed,
            solution.rigid,
            solution.displacement,
            float(position.pull @ f),
            self.free_punch + moved.on_punch,
            self.free_strip + moved.on_strip,
            status.trial,
            iterations,
            unique,
            crept=crept,
            elastic=elastic,
            beside=self.imposed.beside,
            flowed=flowed,
        )

    def _moved(self, f: Array, jump: Array | None) -> SurfaceDisplacement:
        """Return the displacements of both surfaces by tractions (d n,); the jump between the surfaces is not used.

        Args:
            f: Tractions.
            jump: Displacements of the surfaces by them (d n,); None where it is not known.
        """
        del jump
        (force, back), interface = self.position.forces(f), self.interface
        return SurfaceDisplacement(np.zeros(0), interface.punch.apply(force), -interface.strip.apply(back))


def _solved(A: Array, b: Array) -> tuple[Array, int]:
    """Return the solution of A x = b and the sign of det A.

    Raises:
        ConvergenceError: A is singular.
    """
    factor, pivots, info = scipy.linalg.lapack.dgetrf(A)
    diagonal = np.diag(factor)
    if info or not np.isfinite(diagonal).all() or np.abs(diagonal).min(initial=1.0) < 1e-14 * np.abs(diagonal).max():
        raise ConvergenceError("the contact with stick has a singular step: nothing holds the bodies as they slip")
    x = scipy.linalg.lapack.dgetrs(factor, pivots, b)[0]
    swaps = int((pivots != np.arange(len(pivots))).sum())
    return x, (-1) ** (swaps + int((diagonal < 0).sum()))
