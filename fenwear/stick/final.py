"""The shape to which partial slip wears in the end, directly.

Wear goes on wherever there is slip and pressure. Half-planes of one material that stick in the middle of their contact
under a fixed load and tangential force keep this zone; around it wear goes on until the pressure has vanished there.
So in the end the stick zone alone carries the load, and beside it the surfaces are worn by what they would otherwise
overlap at any time of the cycle (M. Ciavarella and D. A. Hills, J. Strain Anal. 34, 1999): one cycle with contact in
the stick zone only,

    p >= 0, gap >= 0, p gap = 0 in the stick zone;    p = 0, depth = max(0, -gap) outside of it.

Where nothing slips under pressure friction makes no heat. So in the end both bodies are as warm as held temperatures
and surroundings make them, and the shape is that of bodies of these temperatures.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fenwear.arrays import Array, Mask
from fenwear.errors import ConvergenceError
from fenwear.sliding.wear import Worn
from fenwear.stick.cycle import Records, Rig
from fenwear.stick.heat import Course

FAR = 1e3  # times the largest gap: never closes
MOST_TIMES, SAME = 30, 1e-9  # times that contact and temperatures are found; their change, over the warmest


@dataclass(frozen=True)
class FinalShape:
    """The end of partial-slip wear.

    Attributes:
        stick: The zone that carries the load (n,).
        pressure: At the end of a cycle (n,), MPa.
        depth: Worn off both bodies together (n,), mm.
        gap: Beside the scar (n,), mm.
        worn: The depth shared between the bodies by their wear rates.
        pressures: In each time step of a cycle (k, n), MPa.
        temperature: Of the contact surfaces of punch and strip (2, n), K; None without heat.
    """

    stick: Mask
    pressure: Array
    depth: Array
    gap: Array
    worn: Worn
    pressures: Array
    temperature: Array | None = None


def stick_zone(rig: Rig) -> Mask:
    """Return the nodes that stick all through the second cycle without wear (n,); collective.

    What slips in the first cycle only, until it has settled, does not wear on. Finite bodies rock, and give way along
    the surface otherwise than across it; in the course of the wear that takes about a node at the edge.

    Raises:
        ConvergenceError: a time step did not converge.
    """

    def found() -> Mask:
        settled, _ = rig.cycle(rig.beginning())
        return np.asarray(Records.joined(rig.cycle(settled)[1]).sticking.all(axis=0))

    return rig.led(found)


def final_shape(rig: Rig, stick: Mask | None = None) -> FinalShape:
    """Return the shape to which partial slip wears; collective. With heat it and its temperatures go together.

    Args:
        rig: The bodies and what is done to them.
        stick: The zone that never slips (n,); by default that of the second cycle, see `stick_zone`.

    Raises:
        ConvergenceError: nothing sticks, so that wear goes on for ever; the contact did not converge.
        CaseError: the bodies lose no heat.
    """
    return rig.led(partial(_with_heat, rig, stick))


def _with_heat(rig: Rig, stick: Mask | None) -> FinalShape:
    heat = rig.heat
    if heat is None:
        return _final_shape(rig, stick)
    pressures = rig.beginning().contact.pressure[None].repeat(len(rig.program.steps), axis=0)
    before: Array = np.zeros((2, len(rig.weights)))
    for _ in range(MOST_TIMES):
        conductance = np.array([heat.conductance(pressure) for pressure in pressures])
        course = Course(list(range(len(pressures))), np.zeros_like(pressures), conductance)
        warm = heat.through(course).at_rest()
        found, now = _final_shape(rig.kept_at(heat, warm), stick), heat.surfaces(warm)
        if np.abs(now - before).max() <= SAME * max(float(np.abs(now).max()), 1e-300):
            return replace(found, temperature=now)
        pressures, before = found.pressures, now
    raise ConvergenceError(f"contact and temperatures of the end did not come together in {MOST_TIMES} times")


def _final_shape(rig: Rig, stick: Mask | None) -> FinalShape:
    """Return the shape of bodies whose temperatures stay."""
    zone = stick_zone(rig) if stick is None else stick
    if not zone.any():
        raise ConvergenceError(
            "no final shape exists: every node slips in a cycle, so that wear goes on for ever; expected a smaller "
            "stroke or force, or contact.law = 'gross-sliding'"
        )
    unworn = rig.unworn()
    gap = rig.opening(rig.interface.middle, unworn)
    far = FAR * (np.abs(gap).max() + float(np.abs(rig.interface.middle.compliance.diagonal()).max()))
    at = rig.beginning(Worn(np.where(zone, 0.0, far), unworn.strip))
    records = Records.joined(rig.cycle(at)[1])
    found = records.gap.min(axis=0) - np.where(zone, 0.0, far)
    depth = np.where(zone, 0.0, np.maximum(-found, 0.0))
    rates = [0.0 if law is None else float(law.rate.mean()) for law in (rig.wear.punch, rig.wear.strip)]
    share = rates[0] / sum(rates) if sum(rates) > 0 else 1.0
    strip = rig.interface.middle.pair.deposit @ ((1 - share) * depth)
    worn = Worn(share * depth, strip)
    return FinalShape(zone, records.pressure[-1], depth, np.maximum(found, 0.0), worn, records.pressure)
