"""One time step of contact with stick: Newton's method on its equations, and remedies where it fails."""

from __future__ import annotations

from copy import copy
from dataclasses import replace

import numpy as np

from fenwear.common.arrays import Array
from fenwear.common.errors import ConvergenceError
from fenwear.steps.stick_equations import ContactStatus, StatusSolution, Step
from fenwear.steps.stick_interface import StickInterface
from fenwear.steps.stick_position import Position, along_tangents
from fenwear.steps.stick_products import GridStep
from fenwear.steps.stick_state import Imposed, StickState

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
