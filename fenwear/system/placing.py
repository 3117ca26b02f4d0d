"""Bringing both surfaces opposite each other in every phase of the motion.

In how many positions of each half-cycle the strip passes under the punch, where a case leaves that open.

Each position is a contact of its own, and what it wears lies where the strip's material is then. Positions that are
further apart than contact nodes leave steps in the strip's scar: its wear is a comb, not that of a sliding pressure. An
uneven strip that stood still would leave its imprint in the punch.
"""

from __future__ import annotations

import numpy as np

from fenwear.case import Case
from fenwear.case.body_names import with_body_names
from fenwear.case.motion_table import Cycle
from fenwear.case.program import stages_of
from fenwear.heat.passage import Passage
from fenwear.laws.optimum import check_equilibrium
from fenwear.surfaces import (
    ContactPair,
    RigidEquilibrium,
    check_distance,
    pair,
    pass_material,
    rigid_equilibrium,
)
from fenwear.surfaces.motion import DEFAULT_POSITIONS, Motion
from fenwear.surfaces.placement import HERE
from fenwear.surfaces.track import Border, on_closed_track
from fenwear.system.both_bodies import Bodies
from fenwear.system.contact_laws import ContactLaw
from fenwear.system.contact_setup import ContactSetup
from fenwear.system.strokes import Sliding, check_stays, make_sliding

STILL = 0.1  # of the distance of contact nodes: how far a strip moves that stays in its place for the heat


@with_body_names
def place(bodies: Bodies, sliding: Sliding, case: Case) -> ContactSetup:
    """Bring the surfaces opposite each other in every phase of the motion; collective.

    Without heat the strip moves as a whole. With heat its elasticity is that of the middle position: then only its
    worn depth and, to and fro, its temperature change place.

    Args:
        bodies: Both bodies.
        sliding: Motion, friction and wear.
        case: The problem: it gives the heat, the loads of each phase, and whether meshes follow the wear.

    Raises:
        CaseError: the surfaces do not face each other, the stroke runs off them, or no pressure balances the loads.
    """
    rings = bodies.punch.law.kind == "axisymmetric"
    middle = pair(bodies.punch.surface, bodies.strip.surface, axisymmetric=rings)
    if bodies.followed is None:
        check_distance(middle)
    check_stays(middle, sliding)
    if sliding.track is not None:
        middle = on_closed_track(middle, sliding.field, sliding.track)
    sliding = sliding.measured_on(middle)
    # Round surfaces that slide along themselves stay; a whole strip is moved where it does not turn by a table.
    paired = case.heat is None and not any(any(phase.place.turn) for phase in sliding.motion.phases)
    places = [sliding.placement(phase) for phase in sliding.motion.phases]
    pairs = {
        moved: pair(middle.punch, middle.strip, moved) if paired else pass_material(middle, moved)
        for moved in dict.fromkeys(places)
        if moved != HERE
    }
    pairs[HERE] = middle
    swept = sliding.track is None
    border = Border.of_swept([pairs[at] for at in places]) if swept else Border.of_rings(middle, sliding.field)
    pairs = border.on_all(pairs)
    middle = pairs[HERE]
    loaded = _loaded(bodies, sliding.motion, case)
    rigid = rigid_equilibrium(middle, bodies.punch, bodies.strip)
    made = {HERE: rigid}  # phases there and back share theirs
    rigids: list[RigidEquilibrium] = []
    for moved, loaded_bodies in zip(places, loaded, strict=True):
        if loaded_bodies is not bodies:
            rigids.append(rigid_equilibrium(pairs[moved], loaded_bodies.punch, loaded_bodies.strip))
            continue
        if moved not in made:
            made[moved] = rigid_equilibrium(pairs[moved], bodies.punch, bodies.strip)
        rigids.append(made[moved])
    passage = None if case.heat is None else _passage(middle, sliding, rings=rings)
    placed = ContactSetup(
        bodies=bodies,
        sliding=sliding.over(middle, [pairs[at] for at in places], passage),
        case=case,
        loaded=loaded,
        rigids=tuple(rigids),
        rigid=rigid,
    )
    for phase, equilibrium, ratio in zip(sliding.motion.phases, rigids, placed.phases.ratios(), strict=True):
        when, key = f"in {placed.sliding.words[phase.direction]} sliding", "punch.loads"
        if isinstance(case.motion, Cycle):
            row = int(np.searchsorted(case.motion.course.fraction, phase.fraction))
            when, key = f"from row {row} to row {row + 1}", "punch.loads" if case.motion.load is None else "motion.load"
        check_equilibrium(equilibrium, when, ratio, key)
    return placed


@with_body_names
def place_at_rest(
    bodies: Bodies, sliding: Sliding, middle: ContactPair, law: ContactLaw, case: Case, *, passes: bool = False
) -> ContactSetup:
    """Return the surfaces opposite each other in the middle of the motion, in every half-cycle; collective.

    Where nodes stick or slip by themselves their law says how friction acts, and where the strip is in a time step.

    Args:
        bodies: Both bodies, under the mean of their loads.
        sliding: Motion, friction and wear; a phase for each half-cycle.
        middle: The surfaces there.
        law: Of the contact.
        case: The problem.
        passes: Whether the strip's material moves past the punch's.
    """
    loaded = _loaded(bodies, sliding.motion, case)
    rigid = rigid_equilibrium(middle, bodies.punch, bodies.strip)
    rigids = [
        rigid if loaded_bodies is bodies else rigid_equilibrium(middle, loaded_bodies.punch, loaded_bodies.strip)
        for loaded_bodies in loaded
    ]
    return ContactSetup(
        bodies=bodies,
        sliding=sliding.over(middle, (middle,) * len(loaded), passes=passes),
        law=law,
        case=case,
        loaded=loaded,
        rigids=tuple(rigids),
        rigid=rigid,
    )


def _passage(middle: ContactPair, sliding: Sliding, *, rings: bool) -> Passage | None:
    """Return the place of the punch on a strip that passes under it to and fro or through a cycle.

    None where it hardly moves, or is of rings, whose temperatures are the same all around.

    Raises:
        CaseError: the stroke runs off the strip's contact surface.
    """
    motion, here = sliding.motion, middle.strip.trace
    if motion.one_way or rings:
        return None
    ends = [way.at(share).points(here) for row in motion.ways(sliding.field, 1) for way in row for share in (0.0, 1.0)]
    moved = max(float(np.linalg.norm(end - here, axis=1).max()) for end in ends)
    return Passage(middle, sliding.field, motion) if moved > STILL * middle.punch.spacing() else None


def _loaded(bodies: Bodies, motion: Motion, case: Case) -> tuple[Bodies, ...]:
    """Return the bodies under the loads of each phase; collective."""
    if all(load.steady for body in ("punch", "strip") for load in case.loads_of(body)):
        return (bodies,) * len(motion.phases)
    return tuple(bodies.under(case, phase.fraction) for phase in motion.phases)


MOST = 61  # positions that are taken unasked: each is a contact to solve
ENTRIES = 2e7  # of their matrices together


def place_case_bodies(case: Case, bodies: Bodies, sliding: Sliding | None = None) -> ContactSetup:
    """Return the bodies of a case opposite each other; collective.

    Args:
        case: The problem.
        bodies: Built from it.
        sliding: Their sliding; by default as the case has it, in as many positions as contact nodes ask for.
    """
    made = sliding or make_sliding(case)
    placed = place(bodies, made, case)
    wanted = _wanted(case, placed) if sliding is None else 0
    if wanted <= made.motion.positions:
        return placed
    return place(bodies, make_sliding(case, positions=wanted), case)


def _wanted(case: Case, placed: ContactSetup) -> int:
    """Return the number of positions that are as close as contact nodes; 0 where the case does not leave it open.

    Of a program the longest stroke counts. None are added on contact grids, which cover what positions need, nor with
    heat, whose response is another in each.
    """
    if (
        not case.leaves_positions
        or not (case.strip_varies and placed.sliding.to_and_fro)
        or case.grid is not None
        or case.heat is not None
    ):
        return 0
    longest = max([_step(make_sliding(stage.case).motion) for stage in stages_of(case)], default=0.0)
    step = _step(placed.motion)
    spacing = placed.sliding.position_spacing * max(1.0, longest / step if step else 1.0)
    nearest = int(np.ceil(DEFAULT_POSITIONS * spacing))
    most = min(MOST, int(ENTRIES / len(placed.pair.x) ** 2))
    return min(nearest + 1 - nearest % 2, most - 1 + most % 2)  # odd: one is the middle of the stroke


def _step(motion: Motion) -> float:
    """Return the largest distance between neighbouring positions, mm or rad."""
    return float(np.diff(np.unique([phase.offset for phase in motion.phases])).max(initial=0.0))
