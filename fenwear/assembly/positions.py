"""In how many positions of each half-cycle the strip passes under the punch, where a case leaves that open.

Each position is a contact of its own, and what it wears lies where the strip's material is then. Positions that are
further apart than contact nodes leave steps in the strip's scar: what wears it is a comb, not a sliding pressure. An
uneven strip that stood still would leave its imprint in the punch.
"""

from __future__ import annotations

import numpy as np

from fenwear.assembly.bodies import Bodies
from fenwear.assembly.contact_setup import ContactSetup
from fenwear.assembly.placing import place
from fenwear.assembly.strokes import Sliding, make_sliding
from fenwear.case import Case
from fenwear.case.program import stages_of
from fenwear.sliding.motion import DEFAULT_POSITIONS, Motion

MOST = 61  # positions that are taken unasked: each is a contact to solve
ENTRIES = 2e7  # of their matrices together


def place_case_bodies(case: Case, bodies: Bodies, sliding: Sliding | None = None) -> ContactSetup:
    """Return the bodies of a case opposite each other; collective.

    Args:
        case: The problem.
        bodies: Built from it.
        sliding: How they slide; by default as the case has it, in as many positions as contact nodes ask for.
    """
    made = sliding or make_sliding(case)
    placed = place(bodies, made, case)
    wanted = _wanted(case, placed) if sliding is None else 0
    if wanted <= made.motion.positions:
        return placed
    return place(bodies, make_sliding(case, positions=wanted), case)


def _wanted(case: Case, placed: ContactSetup) -> int:
    """Return how many positions bring them as near to each other as contact nodes; 0 where that is not open.

    Of a program the longest stroke counts. None are added on contact grids, which cover what positions need, nor with
    heat, whose response is another in each.
    """
    if not case.leaves_positions or not placed.track_varies or case.grid is not None or case.heat is not None:
        return 0
    longest = max([_step(make_sliding(stage.case).motion) for stage in stages_of(case)], default=0.0)
    own = _step(placed.motion)
    spacing = placed.position_spacing * max(1.0, longest / own if own else 1.0)
    nearest = int(np.ceil(DEFAULT_POSITIONS * spacing))
    most = min(MOST, int(ENTRIES / len(placed.pair.x) ** 2))
    return min(nearest + 1 - nearest % 2, most - 1 + most % 2)  # odd: one is the middle of the stroke


def _step(motion: Motion) -> float:
    """Return the largest distance between neighbouring positions, mm or rad."""
    return float(np.diff(np.unique([phase.offset for phase in motion.phases])).max(initial=0.0))
