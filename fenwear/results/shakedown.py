"""The largest pressure that contacts between curved surfaces settle under elastically: their shakedown limit.

Under a contact that rolls or slides to and fro, what yields at first leaves residual stresses by which the rest is
carried elastically, as long as the largest pressure p_0 is at most 4 k in line contact and 4.7 k in point contact. k is
the yield stress in shear, by von Mises that in tension over sqrt(3) (K. L. Johnson, Contact Mechanics, 1985, 9.1, 9.2;
A. R. S. Ponter et al., J. Mech. Phys. Solids 33, 1985, 339). These are the limits without friction
and hardening: friction lowers them, hardening raises them. Beyond them the surface flows in every cycle.
"""

from __future__ import annotations

import numpy as np

from fenwear.assembly import ContactSetup
from fenwear.results.scar import conforming

LINE, POINT = 4.0, 4.7  # p_0 / k


def shakedown_limit(placed: ContactSetup) -> tuple[float, str] | None:
    """Return the limit, MPa, and the material that has it; None for conforming surfaces, or without a yield stress."""
    case = placed.case
    if conforming(placed.pair):
        return None
    punch, strip = placed.bodies.regions
    used = case.punch.materials_at(punch) | case.strip.materials_at(strip)
    known = {name: case.materials[name].yield_stress for name in sorted(used)}
    given = {name: value for name, value in known.items() if value is not None}
    if not given:
        return None
    softest = min(given, key=lambda name: given[name])
    return float(factor(placed) * given[softest] / np.sqrt(3)), softest


def factor(placed: ContactSetup) -> float:
    """Return p_0 / k: in space of a point, else of a line."""
    return POINT if placed.pair.punch.dim == 3 else LINE
