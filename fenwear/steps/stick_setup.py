"""From a case to bodies with stick that are ready to be driven, with as many time steps as they need.

Time steps of a cycle as fine as they need to be, and where they need to be.

The first cycle is computed with its steps and with each of them in halves. Where force and work of friction differ by
more than the tolerance, the steps that make most of the difference are halved (Doerfler's marking), until they do not.
Heat wants equal steps: there all are halved.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from fenwear.bodies.contact_surface import ContactSurface
from fenwear.bodies.surface_operators import SurfaceOperator
from fenwear.case import Case, Cycle, Oscillation
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError
from fenwear.common.parallel import memory_size
from fenwear.steps.stick_cycle import PartialSlipProblem
from fenwear.steps.stick_heat import stick_heat
from fenwear.steps.stick_interface import StickInterface
from fenwear.steps.stick_program import Program, far_enough, make_program, passes, steps_of
from fenwear.steps.stick_state import TimeStepRecords
from fenwear.surfaces.sliding_field import Screw
from fenwear.system import Bodies, build_bodies, make_sliding
from fenwear.system.both_bodies import laws_of

MOST_PASSING = 3000  # nodes of a grid under which a strip passes


def partial_slip_problem(
    case: Case,
    comm: MPI.Comm = MPI.COMM_WORLD,
    *,
    steps: int | None = None,
    fresh: bool = False,
    bodies: Bodies | None = None,
    condensed: tuple[SurfaceOperator, SurfaceOperator] | None = None,
) -> PartialSlipProblem:
    """Return the bodies of a case with their loads and motions; collective.

    The condensed bodies and the bases of their temperatures are kept on disk for the next time.

    Args:
        case: With contact.law = "coulomb".
        comm: The ranks.
        steps: Of a half-cycle, in place of the case's.
        fresh: Condense the bodies again, even where they are kept.
        bodies: Of the case, where they are built already.
        condensed: Both, where they are condensed already.

    Raises:
        CaseError: it is a case of gross sliding, or a property of the geometry is wrong.
    """
    if case.contact.law != "coulomb":
        raise CaseError(InputError("contact.law", "expected 'coulomb' for contact with stick"))
    bodies = bodies or build_bodies(case, comm, fresh=fresh)
    return heated(placed_by_slip(case, bodies, steps, fresh=fresh, condensed=condensed), case)


def placed_by_slip(
    case: Case,
    bodies: Bodies,
    steps: int | None = None,
    *,
    fresh: bool = False,
    condensed: tuple[SurfaceOperator, SurfaceOperator] | None = None,
) -> PartialSlipProblem:
    """Return the problem without heat, in which the strip passes if it slips as far; collective.

    Arguments as of `partial_slip_problem`, bodies being built.
    """
    problem = unheated_problem(case, bodies, steps, fresh=fresh, condensed=condensed)
    by_default = not isinstance(case.motion, Cycle) and getattr(case.motion, "positions", 2) is None
    if problem.interface.moves and by_default and touches(problem) and not _slips_far(problem):
        return unheated_problem(case, bodies, steps, fresh=fresh, moves=False)
    return problem


def unheated_problem(
    case: Case,
    bodies: Bodies,
    steps: int | None = None,
    *,
    fresh: bool = False,
    condensed: tuple[SurfaceOperator, SurfaceOperator] | None = None,
    moves: bool | None = None,
) -> PartialSlipProblem:
    """Return the problem without heat; collective. Arguments as of `partial_slip_problem`.

    Args:
        moves: Whether the strip's surface passes under the punch; None as the motion says.
    """
    sliding, surface = make_sliding(case), bodies.punch.surface
    if bodies.punch.reach is None or surface.grid != bodies.punch.reach.grid:  # else it is looked for first
        _check_passing(case, surface)
    interface = StickInterface(
        bodies,
        sliding,
        case,
        moves=_moves(case, surface) if moves is None else moves,
        far=case.stick.force is None and far_enough(case, surface),
        keep=bodies.warmed is None,
        fresh=fresh,
        condensed=condensed,
    )
    middle = interface.middle
    laws = laws_of(bodies, middle.pair, sliding, case)
    mean = np.full(len(middle.pair.weights), middle.rigid.mean_pressure)
    layers = interface.layers
    conditions = laws.conditions(
        middle.pair, mean, states=layers.known(middle.pair, None), debris=layers.facing(middle.pair, None)
    )
    wear, mu = laws.wear_at(conditions), laws.friction.values(conditions)
    changing = None if laws.constant and not layers.varies else laws
    coated = laws.coated(middle.pair, conditions)
    return PartialSlipProblem(interface, make_program(case, steps), wear, mu, laws=changing, coatings=coated)


def with_steps(problem: PartialSlipProblem, case: Case, steps: int) -> PartialSlipProblem:
    """Return the problem with another number of time steps."""
    return heated(problem.driven(make_program(case, steps)), case)


def heated(problem: PartialSlipProblem, case: Case) -> PartialSlipProblem:
    """Return the problem with the heat of the case for its time steps; collective."""
    if case.heat is None:
        return problem
    steps = len(problem.program.steps) // problem.program.half_cycles
    return replace(problem, heat=stick_heat(problem.interface, case, case.heat, steps))


def _check_passing(case: Case, surface: ContactSurface) -> None:
    """Make sure that a strip which passes under the punch does not do so on a grid that is too fine for factors.

    Raises:
        CaseError: it does.
    """
    if surface.grid is not None and len(surface.x) > MOST_PASSING and _moves(case, surface):
        matrix = memory_size(8.0 * surface.x.size**2)
        raise CaseError(
            InputError(
                "motion.positions",
                f"with stick, a strip that passes under the punch is solved by factors of its contact nodes, up to "
                f"{MOST_PASSING:,} of a grid, got {len(surface.x):,}. Each Newton step would factor a matrix of "
                f"{matrix}. Set 1 (surfaces stay opposite each other, with any number of nodes), or fewer grid nodes",
            )
        )


def _moves(case: Case, surface: ContactSurface) -> bool:
    """Return whether the strip's surface passes under the punch: by default where it varies, and moves far enough.

    Whether it slips so far is seen in the first cycle alone, see `placed_by_slip`.
    """
    motion = case.motion
    positions = getattr(motion, "positions", None)
    if isinstance(motion, Cycle) and positions is not None:
        return positions == "steps"
    if case.stick.force is not None or isinstance(motion, Oscillation) or positions == 1:
        return False
    if positions is not None:
        return True
    return case.strip_varies and far_enough(case, surface)


def touches(problem: PartialSlipProblem) -> bool:
    """Return whether the load brings the surfaces together; collective."""
    return problem.led(lambda: bool(problem.beginning().contact.closed.any()))


def _slips_far(problem: PartialSlipProblem) -> bool:
    """Return whether the slip of the first cycle passes nodes, however far the supports move; collective."""
    pair, cycle = problem.interface.middle.pair, TimeStepRecords.joined(problem.cycle(problem.beginning())[1])
    return passes(cycle.slip_amplitude(pair.weights, problem.program.half_cycles), pair.punch)


HALVINGS = 4  # of a step at most
WHOLE = 2 ** (HALVINGS + 1)  # of the finest steps in a step: the halves of the last ones are compared with, too
SHARE = 0.9  # of the difference that the halved steps make
Ends = NDArray[np.int64]  # of steps, as numbers of the finest ones


@dataclass(frozen=True)
class Fineness:
    """Fineness of the time steps.

    Attributes:
        steps: Of a half-cycle, on average.
        change: By halving every step, of the largest force and, in all steps together, of friction's work; shares of
            the first cycle's.
        enough: Whether that is within the case's tolerance.
        ends: Of the steps, as numbers of the finest ones.
    """

    steps: int
    change: float
    enough: bool
    ends: Ends

    def text(self) -> str:
        """Return the message about time steps that are too coarse; "" where they are fine enough."""
        if self.enough:
            return ""
        return (
            f"stick.steps: time steps are too coarse. Halving the {self.steps} of a half-cycle changes force or "
            f"friction work of the first cycle by {100 * self.change:.2g} %. Increase `stick.steps`"
        )


def fine_enough(problem: PartialSlipProblem, case: Case) -> tuple[PartialSlipProblem, Fineness]:
    """Return the rig with steps that are halved until the first cycle changes little; collective.

    Args:
        problem: With the case's steps.
        case: Gives their number and the tolerance.

    Raises:
        ConvergenceError: a time step did not converge.
    """
    count, finest = WHOLE, _finest(case)
    ends = np.arange(count - 1, len(finest.steps), count)
    while True:
        halves, of = _halved(ends)
        fine = _driven(problem, case, finest, halves)
        splits = np.diff(ends, prepend=-1) > 2
        change, marked = problem.led(partial(_judged, problem, fine, of, splits, case.stick.step_tolerance))
        if marked is None:
            enough = change <= case.stick.step_tolerance
            return problem, Fineness(round(len(ends) / finest.half_cycles), change, enough, ends)
        if case.heat is not None:
            marked[:] = True
        ends = halves[marked[of] | _last(of)]
        problem = _driven(problem, case, finest, ends)


def with_ends(problem: PartialSlipProblem, case: Case, ends: Ends) -> PartialSlipProblem:
    """Return the rig with steps that end at these of the finest ones; collective."""
    return _driven(problem, case, _finest(case), ends)


def same_steps(case: Case, other: Case) -> bool:
    """Return whether time steps chosen for one case are steps of the other: both ask for as many, as fine."""
    return case.stick == other.stick and len(_finest(case).steps) == len(_finest(other).steps)


def _finest(case: Case) -> Program:
    return make_program(case, steps_of(case) * WHOLE)


def _judged(
    problem: PartialSlipProblem, fine: PartialSlipProblem, of: Ends, splits: NDArray[np.bool_], tolerance: float
) -> tuple[float, NDArray[np.bool_] | None]:
    """Return the change by halving all steps, and the steps to halve; None where the halving is to end."""
    after, coarse = problem.cycle(problem.beginning())
    known = np.where(_last(of)[:, None], after.pressures[of], np.nan)  # second halves end where their steps do
    begin = replace(fine.beginning(), pressures=known, trials=after.trials[of])
    halves = TimeStepRecords.joined(fine.cycle(begin)[1])
    local, change = _compare(TimeStepRecords.joined(coarse), halves, of, problem.weights)
    if change <= tolerance or local[~splits].sum() > tolerance:  # the finest steps alone are too coarse
        return change, None
    return change, _marked(local, splits)


def merged(finest: Program, ends: Ends) -> Program:
    """Return a program whose steps end where these of another one do."""
    merged_steps, steps = [], finest.steps
    for begin, end in zip(np.append(0, ends[:-1] + 1), ends, strict=True):
        first, last, place = steps[begin].way, steps[end], steps[begin - 1].displacement
        if first is not None and last.way is not None:
            way = Screw(first.first, last.way.last)
            last = replace(last, offset=way.at(0.5), way=way)
        elif place is not None and last.displacement is not None:
            last = replace(last, offset=(place + last.displacement) / 2)
        merged_steps.append(replace(last, duration=sum(step.duration for step in steps[begin : end + 1])))
    return replace(finest, steps=tuple(merged_steps))


def _driven(problem: PartialSlipProblem, case: Case, finest: Program, ends: Ends) -> PartialSlipProblem:
    """Return the rig with the steps that end there; the way to the beginning stays."""
    if case.heat is not None:
        return with_steps(problem, case, len(ends) // finest.half_cycles)
    return problem.driven(replace(merged(finest, ends), lead_in=problem.program.lead_in))


def _halved(ends: Ends) -> tuple[Ends, Ends]:
    """Return the ends of the halves of all steps, and the step that each is of."""
    begins = np.append(-1, ends[:-1])
    return np.stack([(begins + ends) // 2, ends], axis=1).ravel(), np.repeat(np.arange(len(ends)), 2)


def _last(of: Ends) -> NDArray[np.bool_]:
    """Return which halves are the last of their steps."""
    return np.append(of[1:] != of[:-1], True)


def _compare(coarse: TimeStepRecords, fine: TimeStepRecords, of: Ends, weights: Array) -> tuple[Array, float]:
    """Return the changes by halved steps in each step, and their change of the cycle, as shares."""
    force = max(float(np.abs(fine.force).max()), 1e-300)
    full_stick = 1e-6 * force * float(np.ptp(fine.displacement))  # no work but rounding
    work = max(fine.energy(weights), full_stick, 1e-300)
    by_step = coarse.dissipated @ weights - np.bincount(of, fine.dissipated @ weights)
    pulled = np.diff(coarse.force - fine.force[_last(of)], prepend=0.0)
    # Differences of either sign do not make up for each other: that would be by chance.
    change = max(abs(float(np.abs(coarse.force).max()) - force) / force, float(np.abs(by_step).sum()) / work)
    return np.abs(by_step) / work + np.abs(pulled) / force, change


def _marked(local: Array, splits: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the steps that make most of the difference, of those that can be halved."""
    able = np.where(splits, local, 0.0)
    order = np.argsort(-able)
    count = int(np.searchsorted(np.cumsum(able[order]), SHARE * able.sum())) + 1
    marked = np.zeros(len(local), dtype=bool)
    marked[order[:count]] = True
    return marked & splits
