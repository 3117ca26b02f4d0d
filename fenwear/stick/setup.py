"""From a case to bodies with stick that are ready to be driven, with as many time steps as they need."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from mpi4py import MPI

from fenwear.assembly import Bodies, build_bodies, make_sliding
from fenwear.assembly.bodies import edges_of
from fenwear.bodies.contact_surface import ContactSurface
from fenwear.bodies.operators import SurfaceOperator
from fenwear.case import Case, Cycle, Oscillation
from fenwear.errors import CaseError, InputError
from fenwear.parallel import memory_size
from fenwear.sliding.coating import coatings_of
from fenwear.sliding.regions import regions_opposite
from fenwear.stick.cycle import PartialSlipProblem
from fenwear.stick.heat import stick_heat
from fenwear.stick.interface import StickInterface, meshed
from fenwear.stick.losses import CoatedBodies
from fenwear.stick.program import far_enough, make_program, passes
from fenwear.stick.records import TimeStepRecords
from fenwear.stick.wear import LocalLaws

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
    """Return the bodies of a case with what is done to them; collective.

    The condensed bodies and the bases of their temperatures are kept on disk for the next time.

    Args:
        case: With contact.law = "coulomb".
        comm: The ranks.
        steps: Of a half-cycle, in place of the case's.
        fresh: Condense the bodies again, even where they are kept.
        bodies: Of the case, where they are built already.
        condensed: Both, where they are condensed already.

    Raises:
        CaseError: it is a case of gross sliding, or what only the geometry can tell is wrong.
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
    """Return the same without heat, its strip passing if it slips as far; collective.

    Arguments as of `partial_slip_problem`, bodies being built.
    """
    problem = unheated_problem(case, bodies, steps, fresh=fresh, condensed=condensed)
    if _asks_for_slip(problem, case) and touches(problem) and not _slips_far(problem):
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
    """Return the same without heat; collective. Arguments as of `partial_slip_problem`.

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
    regions = regions_opposite(bodies.regions, middle.pair)
    initial = case.initial_temperature
    coatings = coatings_of(middle.pair, sliding.wear)
    edges = edges_of(bodies, middle.pair.punch) if case.contact.asks("edge", sliding.wear) else None
    friction = replace(sliding.friction, split=regions[0].split(sliding.friction.contact.friction))
    laws = LocalLaws(friction, sliding.wear, coatings, regions, initial, edges)
    mean = np.full(len(middle.pair.weights), middle.rigid.mean_pressure)
    layers = interface.layers
    conditions = laws.conditions(
        middle.pair, mean, states=layers.known(middle.pair, None), debris=layers.facing(middle.pair, None)
    )
    wear, mu = laws.wear_at(conditions), laws.friction.values(conditions)
    changing = None if laws.constant and not layers.varies else laws
    coated = CoatedBodies(*laws.coated(middle.pair, conditions))
    return PartialSlipProblem(interface, make_program(case, steps), wear, mu, laws=changing, coatings=coated)


def with_steps(problem: PartialSlipProblem, case: Case, steps: int) -> PartialSlipProblem:
    """Return the same with other time steps."""
    return heated(problem.driven(make_program(case, steps)), case)


def heated(problem: PartialSlipProblem, case: Case) -> PartialSlipProblem:
    """Return the same with the heat of the case for its time steps; collective."""
    if case.heat is None:
        return problem
    steps = len(problem.program.steps) // problem.program.half_cycles
    heat = stick_heat(meshed(problem.interface), case, steps)
    return problem.with_heat(heat)


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
                f"{MOST_PASSING:,} of a grid, got {len(surface.x):,}: where all touch each Newton step factors a "
                f"matrix of {matrix}, beside copies of it. Expected 1 (surfaces stay opposite each other, and any "
                "number of nodes goes), or fewer nodes of the grid",
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


def _asks_for_slip(problem: PartialSlipProblem, case: Case) -> bool:
    """Return whether a strip passes by default, as far as its supports tell."""
    by_default = not isinstance(case.motion, Cycle) and getattr(case.motion, "positions", 2) is None
    return problem.interface.moves and by_default


def _slips_far(problem: PartialSlipProblem) -> bool:
    """Return whether what slips in the first cycle passes nodes, however far the supports go; collective."""

    def found() -> bool:
        pair, cycle = problem.interface.middle.pair, TimeStepRecords.joined(problem.cycle(problem.beginning())[1])
        return passes(cycle.slip_amplitude(pair.weights, problem.program.half_cycles), pair.punch)

    return problem.led(found)
