"""One time step of contact with stick: Newton's method on its equations, and remedies where it fails.

On a contact grid its equations are solved by products alone, in a memory that is linear in the nodes.

Of the contact status of a Newton step the unknowns are fields on the grid: pressures dp where nodes touch, tractions u
where they stick, and across the direction n of the trial where they slip in two directions; where they slip
dt = mu n dp + u. With the projector Q on what is unknown, and f = N x of x = (dp, u),

    Q (C N x + H a - V delta) + D x = -residual,

D of slipping nodes is (|z| - r) / (r c): the derivative of the cone's projection (`cone`), solved for the slip across
n; of nodes in contact, the slope of the compliance beside the bodies. GMRES solves the system to some digits;
Newton's method continues. The preconditioner is the inverse of C on an endless grid, restricted to the unknowns,
between roots of 1 + D / C_ii, with the balances of forces held exactly: about as many iterations at any number of
nodes. The sign of the determinant is not known: other solutions are not sought.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fenwear.algebra.krylov import flexible
from fenwear.common.arrays import Array, Mask
from fenwear.common.errors import ConvergenceError
from fenwear.steps.stick_equations import ContactStatus, StatusSolution, Step, SurfaceDisplacement
from fenwear.steps.stick_interface import StickInterface
from fenwear.steps.stick_position import Position, along_tangents
from fenwear.steps.stick_state import Imposed, StickState
from fenwear.surfaces.grid_compliance import STIFF

CLOSE = 1e-7  # residual of the laws over the largest pressure
FEW = 20  # Newton steps from where it should take some
PATIENCE = 15  # Newton steps that may go by without success
ROUGH = {2: 1e-6, 3: 1e-2}  # of a residual that is left, at most: in the plane more costs next to nothing
AHEAD = 0.1  # of a residual that is left, over that of the laws: Newton's steps speed up
FINEST = {2: 1e-10, 3: 2e-5}  # of a residual that may be left in them
SHARE = 0.03  # of the residual of the laws that ends a step, in its last solution
RESTART, RESTARTS = 80, 2
FAR = 0.5  # of a residual that may be left: more is no solution
STIFFEST = 1e8  # D over the diagonal of C, at most
LOOSE = "the contact with stick has a singular step: nothing holds the bodies as they slip"
FLAT = 1e-6  # of the largest singular value: balances that nothing holds


class GridStep(Step):
    """The equations of one time step on a grid; arguments as of `Step`."""

    close, few, patience = CLOSE, FEW, PATIENCE

    def __init__(
        self, interface: StickInterface, position: Position, before: StickState, imposed: Imposed, friction: Array
    ) -> None:
        super().__init__(interface, position, before, imposed, friction)
        on = self.position.compliance.on_grid
        assert on is not None
        self.on = on
        self.forget()

    def forget(self) -> None:
        """Look for the next solution from where the step begins, not from the last one, which may be far off."""
        self._last: StatusSolution | None = None
        self._wrong = 1.0

    @cached_property
    def reachable(self) -> Mask:
        """Which nodes may touch at first (n,): no farther apart than the whole load on one node would bring them."""
        load = np.abs(self.imposed.loaded.resultant * self.units).max(initial=0.0) / self.length
        gap = self.free[: self.n]
        far = load / float(self.position.pair.weights.min()) * float(self.scale[0].max())
        return np.asarray(gap <= gap.min() + far) if far > 0 else super().reachable

    @cached_property
    def _rigid(self) -> tuple[Array, Array]:
        """Unit rigid modes, and the strip's displacement where it is free, over the length (r, d, n); their forces."""
        position, loose = self.position, self.imposed.force is not None
        moved = position.modes.T * (self.units / self.length)[:, None]
        forces = position.balance * (self.units / (self.length * self.area))[:, None]
        if loose:
            moved = np.concatenate([moved, -position.drive[None]])
            forces = np.concatenate([forces, position.pull[None] / self.area])
        shape = len(moved), self.d, self.n
        return moved.reshape(shape), forces.reshape(shape)

    def solve(self, status: ContactStatus) -> StatusSolution:
        """Return a solution of a contact status, better by some digits than the last one.

        Raises:
            ConvergenceError: its equations are singular.
        """
        last, piece = self._last, _Piece.of(self, status)
        f = self._begun(status) if last is None else last.f.reshape(self.d, -1)
        rigid, displacement = (
            (self.before.rigid, self.before.displacement) if last is None else (last.rigid, last.displacement)
        )
        if self.imposed.force is None:
            displacement = float(self.imposed.displacement or 0.0)
        x = piece.known(f)
        f = piece.tractions(x) + piece.fixed
        solution = StatusSolution(f.ravel(), rigid, displacement, 1, jump=self.on.apply(f.ravel()))
        rest, forces = piece.residual(x, self._opened(solution)), self._missing(solution)
        closed = piece.closed
        moved, held = (part[:, :, closed] for part in self._rigid)
        solver = _Solver(self, piece, moved, held)
        size = max(float(np.sqrt(np.mean(rest[:, closed] ** 2))), float(np.abs(forces).max(initial=0.0)))
        enough = SHARE * self.close * float(f[0].max())
        least = max(FINEST[self.d], min(FAR, enough / max(size, 1e-300)))
        accuracy = max(min(ROUGH[self.d], AHEAD * self._wrong), least)
        dx, by = solver.solve(-rest[:, closed], -forces, accuracy)
        change = np.zeros_like(x)
        change[:, closed] = dx
        f = piece.tractions(x + change) + piece.fixed
        loose = self.imposed.force is not None
        r = len(rigid)
        displacement += float(by[-1] * self.length) if loose else 0.0
        jump, rigid = self.on.apply(f.ravel()), rigid + by[:r] * self.units
        self._last = StatusSolution(f.ravel(), rigid, displacement, 1, jump=jump)
        return self._last

    def status_of(self, solution: StatusSolution) -> tuple[ContactStatus, float]:
        """Return a solution's contact status, and the residual of the laws there over the largest pressure."""
        status, self._wrong = super().status_of(solution)
        return status, self._wrong

    def _begun(self, status: ContactStatus) -> Array:
        """Return tractions (d, n) that a status came from."""
        size = np.linalg.norm(status.trial, axis=1)
        limit = self.mu * status.pressure
        inside = np.where(size > limit, limit / np.maximum(size, 1e-300), 1.0)
        return np.concatenate([status.pressure[None], (status.trial * inside[:, None]).T])

    def _opened(self, solution: StatusSolution) -> Array:
        """Return gap and slip over the length (d, n)."""
        gap, slip = self.jumps(solution)
        return np.asarray(np.concatenate([gap[None], slip.T]) / self.length)

    def _missing(self, solution: StatusSolution) -> Array:
        """Return the residuals of the balances (r,), as means over the area."""
        forces = self.position.balance @ solution.f + self.imposed.loaded.resultant
        forces = forces * (self.units / (self.length * self.area))
        if self.imposed.force is None:
            return np.asarray(forces)
        return np.append(forces, (self.position.pull @ solution.f - self.imposed.force) / self.area)

    def _moved(self, f: Array, jump: Array | None) -> SurfaceDisplacement:
        """Return the immediate displacements by tractions (d n,); the strip's follow from the punch's and the jump."""
        if jump is None or self.interface.moves:
            return super()._moved(f, jump)
        position, bodies = self.position, jump.copy()
        bodies[: self.n] -= position.interface.layer * f[: self.n]
        on_punch = self.interface.punch.apply(position.in_space(f * position.weights))
        punch, strip, _ = self.creep.factors(self.imposed.duration)
        on_strip = (punch * on_punch - position.in_space(bodies)) / strip  # the jump is that of bodies that creep
        return SurfaceDisplacement(np.zeros(0), on_punch, np.asarray(on_strip))


@dataclass(frozen=True)
class _Piece:
    """The unknowns of a contact status, fields (d, n).

    Attributes:
        closed: Nodes that touch (k,).
        pressed: Nodes whose pressure is unknown (n,).
        kept: Unknown parts of tractions: nodes that stick (n,).
        across: Unit vectors across the trial where nodes slip in two directions, else zero (m, n).
        slides: mu n where nodes slip, else zero (m, n).
        stiff: D over the length (d, n), of u along `across`.
        fixed: Tractions that are known: what flows (d, n).
    """

    closed: NDArray[np.int64]
    pressed: Mask
    kept: Mask
    across: Array
    slides: Array
    stiff: Array
    fixed: Array

    @classmethod
    def of(cls, step: GridStep, status: ContactStatus) -> _Piece:
        """Return the linear pieces of a status."""
        closed, slips = status.closed, status.closed & status.slipping
        flows = closed & status.flowing
        size = np.maximum(np.linalg.norm(status.trial, axis=1), 1e-300)
        direction = np.where(slips, status.trial.T / size, 0.0)
        slides = step.mu * direction
        across, stiff = np.zeros_like(direction), np.zeros((step.d, step.n))
        scale = step.scale / step.length
        if step.m == 2:
            across = np.stack([-direction[1], direction[0]])
            over = (size - status.radius) / np.maximum(status.radius, size / STIFFEST)
            stiff[1:] = np.where(slips, scale[1:] * np.clip(over, 0.0, STIFFEST), 0.0)
        if step.closure is not None:
            stiff[0] = np.where(closed, step.closure.slope(status.pressure) / step.length, 0.0)
        fixed = np.zeros((step.d, step.n))
        if flows.any():
            fixed[0, flows] = step.hardness
            fixed[1:] = slides * fixed[0]
        every = np.flatnonzero(closed).astype(np.int64)
        return cls(every, closed & ~flows, closed & ~slips, across, slides, stiff, fixed)

    def on_box(self, at: NDArray[np.int64], size: int) -> _Piece:
        """The same over the places of a box, the nodes that touch at these of them."""
        arrays = (self.across, self.slides, self.stiff, self.fixed)
        masks, fields = (
            [_spread(values[..., self.closed], at, size) for values in some]
            for some in ((self.pressed, self.kept), arrays)
        )
        return _Piece(at, *masks, *fields)

    def known(self, f: Array) -> Array:
        """Return the unknowns (d, n) that tractions have."""
        return self.unknown(np.concatenate([f[:1], f[1:] - self.slides * f[:1]]))

    @cached_property
    def _projector(self) -> Array:
        """Q of the normal, and of the tangents with themselves, and in two directions with each other (d or 4, n)."""
        kept, across = self.kept.astype(float), self.across
        projector = [self.pressed.astype(float), *(kept + part * part for part in across)]
        return np.array(projector if len(across) == 1 else [*projector, across[0] * across[1]])

    def unknown(self, fields: Array) -> Array:
        """Return Q of fields (d, n)."""
        Q, d = self._projector, len(fields)
        unknowns = Q[:d] * fields
        if d == 3:
            unknowns[1] += Q[3] * fields[2]
            unknowns[2] += Q[3] * fields[1]
        return unknowns

    def tractions(self, x: Array) -> Array:
        """Return N x (d, n)."""
        tractions = x.copy()
        if x[0].any():
            tractions[1:] += self.slides * x[0]
        return tractions

    def residual(self, x: Array, opened: Array) -> Array:
        """Return Q of gap and slip, with D of slipping nodes; the compliance of layers is in the gap."""
        return np.concatenate([(opened[0] * self.pressed)[None], self.unknown(opened)[1:] + self.stiff[1:] * x[1:]])


def _spread(values: NDArray[Any], at: NDArray[np.int64], size: int) -> NDArray[Any]:
    """Return values (..., k) at their places of a box, zero elsewhere (..., size)."""
    spread = np.zeros((*values.shape[:-1], size), dtype=values.dtype)
    spread[..., at] = values
    return spread


class _Solver:
    """The linear equations of a piece on a box around the nodes that touch (k), zero elsewhere.

    Args:
        step: Their system.
        piece: The unknowns.
        moved, held: Unit rigid modes and their forces at the nodes that touch (r, d, k).

    Raises:
        ConvergenceError: nothing holds the bodies.
    """

    def __init__(self, step: GridStep, piece: _Piece, moved: Array, held: Array) -> None:
        if not len(piece.closed):
            raise ConvergenceError(LOOSE)
        self.on = step.on.boxes.around(piece.closed)
        self.at = self.on.box.where(step.on.of.places[piece.closed])
        self.fields, self.length = (self.on.d, self.on.box.size), float(step.length)
        self.cut = int(np.prod(self.fields))
        self.piece = piece.on_box(self.at, self.fields[1])
        scale = step.scale[:, piece.closed].mean(axis=1)[:, None]
        self._share(self.piece.stiff * (step.length / scale))
        moved, held = (_spread(fields, self.at, self.fields[1]) for fields in (moved, held))
        self.moved = np.array([self.piece.unknown(field) for field in moved]).reshape(len(moved), -1)
        self.held = np.array([self._weighed(force) for force in held]).reshape(len(held), -1)
        self.by_moved = np.array([self._inverse(field) for field in self.moved]).reshape(self.moved.shape)
        self.schur = self.held @ self.by_moved.T
        if len(held):
            singular = np.linalg.svd(self.schur, compute_uv=False)
            if not singular.min() > FLAT * max(singular.max(), 1e-300):
                raise ConvergenceError(LOOSE)

    def _share(self, over: Array) -> None:
        """Share places out among the inverses with compliant tangents, by D / C_ii (d, size)."""
        sizes = np.log(STIFF)
        places = np.append(2 * sizes[0] - sizes[1], sizes)
        at = np.interp(np.log(np.maximum(over[1:].max(axis=0), 1e-9)), places, np.arange(len(places)))
        shares = np.clip(1 - np.abs(at - np.arange(len(places))[:, None]), 0.0, 1.0)
        self.shares, self.rest = shares[1:], shares[0]
        known = np.append(0.0, np.full(len(over) - 1, STIFF[-1]))[:, None]
        self.shrunk = np.sqrt((1 + known) / np.maximum(1 + over, 1 + known))

    def _weighed(self, force: Array) -> Array:
        """Return the products N^T of forces by tractions (d, size), as unknowns."""
        unknowns = self.piece.unknown(force)
        unknowns[0] += (self.piece.slides * force[1:]).sum(axis=0) * self.piece.pressed
        return unknowns

    def _inverse(self, fields: Array) -> Array:
        """Return the unknowns that solve the equations of the endless grid for residuals (d size,)."""
        shrunk, counts = fields.reshape(self.fields) * self.shrunk, (self.fields[0], *self.on.counts)
        stiff = shrunk * self.shares[:, None]
        stiff[:, 0] = 0.0
        shrunk[1:] *= self.rest
        unknowns = self.on.solve(shrunk.reshape(counts), stiff.reshape(-1, *counts)).reshape(self.fields)
        unknowns *= self.shrunk
        unknowns *= self.length
        return self.piece.unknown(unknowns).ravel()

    def _precondition(self, r: Array) -> Array:
        x = self._inverse(r[: self.cut])
        y = np.linalg.solve(self.schur, self.held @ x - r[self.cut :]) if len(self.held) else r[self.cut :]
        return np.concatenate([x - y @ self.by_moved, y])

    def _multiply(self, z: Array) -> Array:
        x, y = z[: self.cut].reshape(self.fields), z[self.cut :]
        opened = self.on.products(self.piece.tractions(x).reshape(-1, *self.on.counts)).reshape(self.fields)
        opened /= self.length
        product = self.piece.unknown(opened) + self.piece.stiff * x
        return np.concatenate([product.ravel() + y @ self.moved, self.held @ z[: self.cut]])

    def solve(self, rest: Array, forces: Array, accuracy: float) -> tuple[Array, Array]:
        """Return unknowns (d, k) and rigid motions (r,) for what misses at nodes that touch, to so much of it.

        Raises:
            ConvergenceError: nothing holds the bodies.
        """
        size = max(float(np.abs(rest).max(initial=0.0)), float(np.abs(forces).max(initial=0.0)), 1e-300)
        fields = self.piece.unknown(_spread(rest / size, self.at, self.fields[1]))
        right = np.concatenate([fields.ravel(), forces / size])
        x, left, self.iterations, _ = flexible(self._multiply, self._precondition, right, accuracy, RESTART, RESTARTS)
        x = x * size
        if not (left <= FAR and np.isfinite(x).all()):
            raise ConvergenceError(LOOSE)
        return x[: self.cut].reshape(self.fields)[:, self.at], x[self.cut :]


MOST = 60  # Newton steps
IDLE = 0.5  # of a residual: steps that lessen it by less, all of a step's patience, go round
HALVINGS = 6  # of a step that does not converge
TOO_LARGE = "friction is so large that the step may have no or several solutions. Reduce contact.friction"


class ManyAnswersError(ConvergenceError):
    """Newton's method met pieces of both orientations and found no answer."""


def advance(
    interface: StickInterface,
    before: StickState,
    start: Imposed,
    end: Imposed,
    friction: Array,
    position: Position | None = None,
    near: tuple[Array, Array] | None = None,
) -> StickState:
    """Return the state after a time step.

    Newton starts from the contact status of a state that is near, from that of the step before, then from full stick;
    where all fail the step is halved.

    Args:
        interface: The bodies.
        before: The state at the start.
        start, end: Imposed loads and motions at the start and at the end.
        friction: mu (n,).
        position: The place of the strip; by default its middle one.
        near: Pressure (n,) and trial (n, m) after a step that is nearly the same; None where none is known.

    Raises:
        ConvergenceError: no way converged.
    """
    position = position or interface.middle
    if near is not None:
        step = _step(interface, position, before, end, friction)
        try:
            return _from(step, _status(*near, friction, step.hardness), step.few)
        except ConvergenceError:
            pass
    try:
        return _advance(interface, position, before, start, end, friction, HALVINGS)
    except ConvergenceError:
        if end.force is not None:
            _check_force(interface, position, before, start, end, friction)
        raise


def _step(interface: StickInterface, position: Position, before: StickState, end: Imposed, friction: Array) -> Step:
    """Return the equations of a time step, on a grid by its products."""
    gridded = position.compliance.on_grid is not None
    return (GridStep if gridded else Step)(interface, position, before, end, friction)


def _check_force(
    interface: StickInterface, position: Position, before: StickState, start: Imposed, end: Imposed, friction: Array
) -> None:
    """Raise where an imposed force is more than the contact in gross sliding carries.

    Raises:
        ConvergenceError: gross sliding starts.
    """
    force = end.force or 0.0
    largest = float(before.pressure.max(initial=0.0)) or position.interface.pressure_scale
    far = 1e3 * float(np.median(position.compliance.diagonal())) * largest
    held, pushed = (
        replace(start, displacement=before.displacement, force=None),
        replace(end, displacement=before.displacement + np.copysign(far, force), force=None),
    )
    position = along_tangents(position)
    try:
        most = abs(_advance(interface, position, before, held, pushed, friction, HALVINGS).force)
    except ConvergenceError:
        return
    if abs(force) >= most * (1 - 1e-9):
        raise ConvergenceError(
            f"gross sliding starts: the tangential force {force:.6g} reaches mu P = {most:.4g}, and nothing else holds "
            "the bodies. Reduce the force, or impose a displacement"
        )


def _advance(
    interface: StickInterface,
    position: Position,
    before: StickState,
    start: Imposed,
    end: Imposed,
    friction: Array,
    halvings: int,
) -> StickState:
    step = _step(interface, position, before, end, friction)
    try:
        return _newton(step)
    except ConvergenceError as error:
        if halvings == 0:
            raise
        failure = error
    middle = start.towards(end, 0.5)
    try:
        first = _advance(interface, position, before, start, middle, friction, halvings - 1)
        middle = replace(middle, opening=middle.opening + first.flowed)
        rest = replace(end, duration=end.duration - middle.duration, opening=end.opening + first.flowed)
        second = _advance(interface, position, first, middle, rest, friction, halvings - 1)
    except ConvergenceError as error:
        raise (failure if isinstance(failure, ManyAnswersError) else error) from None
    return replace(
        second,
        slip=first.slip + second.slip,
        approach=first.approach + second.approach,
        iterations=first.iterations + second.iterations,
        unique=first.unique and second.unique and not isinstance(failure, ManyAnswersError),
        parts=first.parts + second.parts,
        flowed=first.flowed + second.flowed,
    )


def _newton(step: Step) -> StickState:
    """Return the state after a step, from the first start that leads to it.

    Raises:
        ConvergenceError: none does.
    """
    first = _status(step.before.pressure, step.before.trial, step.mu, step.hardness)
    first, none = first._replace(closed=first.closed & step.reachable), np.zeros_like(first.closed)
    first = first._replace(slipping=first.slipping & step.going_on)
    starts = [first, first._replace(slipping=none), first._replace(closed=step.reachable, slipping=none, flowing=none)]
    failure = ConvergenceError("the contact with stick did not converge")
    for status in starts:
        try:
            state = _from(step, status)
            return replace(state, unique=state.unique and not isinstance(failure, ManyAnswersError))
        except ConvergenceError as error:
            failure = failure if isinstance(failure, ManyAnswersError) else error
    if step.hardness < np.inf:  # a curved layer, linearised where it hardly presses, would have all nodes flow
        harder = copy(step)
        harder.hardness = np.inf
        pressed = _newton(harder)
        return _from(step, _status(pressed.pressure, pressed.trial, step.mu, step.hardness))
    raise failure


def _status(pressure: Array, trial: Array, friction: Array, hardness: float) -> ContactStatus:
    """Return the contact status of a state of this pressure (n,) and trial (n, m)."""
    closed = pressure > 0
    closed = closed if closed.any() else ~closed
    limit = friction * pressure
    slipping = closed & (np.linalg.norm(trial, axis=1) > limit)
    return ContactStatus(closed, slipping, trial, limit, pressure, pressure >= hardness)


def _from(step: Step, status: ContactStatus, most: int = MOST) -> StickState:
    """Return the state after a step, by Newton's method from a contact status, in at most so many steps.

    Raises:
        ConvergenceError: it does not converge.
    """
    step.forget()
    solution, iterations, unique = _iterate(step, status, most)
    return step.state(solution, iterations, unique=unique)


def _iterate(step: Step, status: ContactStatus, most: int = MOST) -> tuple[StatusSolution, int, bool]:
    wrong, signs, course = np.inf, set[int](), list[float]()
    for iteration in range(1, most + 1):
        solution = _solve(step, status)
        signs.add(solution.sign)
        status, wrong = step.status_of(solution)
        course.append(wrong)
        if wrong < step.close:
            return solution, iteration, min(signs) > 0
        if iteration > step.patience and min(course[-step.patience :]) > IDLE * min(course[: -step.patience]):
            break
        if not status.closed.any():
            status = status._replace(closed=step.reachable, flowing=np.zeros_like(status.closed))
    failed = f"the contact with stick did not converge in {iteration} Newton steps, residual {wrong:.3g}"
    if len(signs) > 1:
        raise ManyAnswersError(f"{failed}: {TOO_LARGE}")
    raise ConvergenceError(f"{failed}. Increase stick.steps, or reduce contact.friction")


def _solve(step: Step, status: ContactStatus) -> StatusSolution:
    """Return the solution of a contact status; with a node stuck where an imposed force is held by nothing else.

    In two directions nodes that all slip hold a force: their slips turn with it, where bodies spread unlike each other.

    Raises:
        ConvergenceError: its equations are singular.
    """
    if step.imposed.force is None or (status.closed & ~status.slipping).any():
        return step.solve(status)
    if step.m == 1:
        return step.solve(_with_nearest_stuck(status))
    try:
        return step.solve(status)
    except ConvergenceError:
        return step.solve(_with_nearest_stuck(status))


def _with_nearest_stuck(status: ContactStatus) -> ContactStatus:
    """Return the status with the node stuck that is nearest to it: under an imposed force something must hold."""
    excess = np.linalg.norm(status.trial, axis=1) - status.radius
    nearest = np.argmin(np.where(status.closed, excess, np.inf))
    slipping = status.slipping.copy()
    slipping[nearest] = False
    return status._replace(slipping=slipping)
