"""From a case to bodies with stick that are ready to be driven, with as many time steps as they need."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from fenwear.arrays import Array
from fenwear.assembly import Bodies, build_bodies, make_sliding
from fenwear.bodies.contact_surface import ContactSurface
from fenwear.case import Case, Oscillation
from fenwear.errors import CaseError, InputError
from fenwear.results.surfaces import border_nodes
from fenwear.stick.cycle import Rig
from fenwear.stick.heat import stick_heat
from fenwear.stick.interface import StickInterface, meshed
from fenwear.stick.program import far_enough, make_program
from fenwear.stick.wear import local_wear


def make_rig(
    case: Case,
    comm: MPI.Comm = MPI.COMM_WORLD,
    *,
    steps: int | None = None,
    fresh: bool = False,
    bodies: Bodies | None = None,
) -> Rig:
    """Return the bodies of a case with what is done to them; collective.

    The condensed bodies and the bases of their temperatures are kept on disk for the next time.

    Args:
        case: With contact.law = "coulomb".
        comm: The ranks.
        steps: Of a half-cycle, in place of the case's.
        fresh: Condense the bodies again, even where they are kept.
        bodies: Of the case, where they are built already.

    Raises:
        CaseError: it is a case of gross sliding, or what only the geometry can tell is wrong.
    """
    if case.contact.law != "coulomb":
        raise CaseError(InputError("contact.law", "expected 'coulomb' for contact with stick"))
    bodies, sliding = bodies or build_bodies(case, comm), make_sliding(case)
    moves = _moves(case, bodies.punch.surface)
    full = case.contact.solver == "full"
    far = case.stick.force is None and far_enough(case, bodies.punch.surface)
    interface = StickInterface(bodies, sliding, case, moves=moves, far=far, keep=True, fresh=fresh, full=full)
    middle = interface.middle
    wear = local_wear(sliding.wear, sliding.friction, middle.pair, middle.rigid.mean_pressure)
    mu = case.contact.friction
    if not isinstance(mu, float):
        raise CaseError(InputError("contact.friction", "expected a constant with contact.law = 'coulomb'"))
    rig = Rig(interface, make_program(case, steps), wear, np.full(len(middle.pair.weights), mu))
    return heated(rig, case)


def with_steps(rig: Rig, case: Case, steps: int) -> Rig:
    """Return the same with other time steps."""
    return heated(Rig(rig.interface, make_program(case, steps), rig.wear, rig.friction, rig.watch), case)


def heated(rig: Rig, case: Case) -> Rig:
    """Return the same with the heat of the case for its time steps; collective."""
    if case.heat is None:
        return rig
    steps = len(rig.program.steps) // rig.program.half_cycles
    heat = stick_heat(meshed(rig.interface), case, steps)
    return Rig(rig.interface, rig.program, rig.wear, rig.friction, rig.watch, heat)


def reaches_border(rig: Rig, pressure: Array) -> bool:
    """Return whether contact reaches where its meshed surface ends, but for planes of symmetry; collective.

    Args:
        rig: The bodies.
        pressure: Of some time steps (k, n), MPa.
    """
    border = border_nodes(rig.interface.middle.pair.punch)
    free = border[~rig.interface.held_nodes()[border]]
    return bool((pressure[:, free] > 0).any())


def _moves(case: Case, surface: ContactSurface) -> bool:
    """Return whether the strip's surface passes under the punch: by default where it wears, and moves far enough."""
    motion = case.motion
    positions = getattr(motion, "positions", None)
    if case.stick.force is not None or isinstance(motion, Oscillation) or positions == 1:
        return False
    if positions is not None:
        return True
    return case.wear.strip is not None and far_enough(case, surface)
