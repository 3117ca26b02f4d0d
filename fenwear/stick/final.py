"""The shape to which partial slip wears in the end, directly.

Wear goes on wherever there is slip and pressure. Under a fixed stroke, or force, a contact that sticks in its
middle keeps this zone; around it wear goes on until the pressure has vanished there. So in the end the stick zone
alone carries the load, and beside it the surfaces are worn by what they would otherwise overlap
(M. Ciavarella and D. A. Hills, J. Strain Anal. 34, 1999): one contact problem without friction,

    p >= 0, gap >= 0, p gap = 0 in the stick zone;    p = 0, depth = max(0, -gap) outside of it.

Like bodies only: between unlike ones tangential traction moves the gap, too, and is left out here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fenwear.arrays import Array, Mask
from fenwear.errors import ConvergenceError
from fenwear.sliding.wear import Worn
from fenwear.stick.cycle import Records, Rig
from fenwear.stick.increment import advance
from fenwear.stick.state import Imposed, untouched

FAR = 1e6  # times the largest gap: never closes


@dataclass(frozen=True)
class FinalShape:
    """The end of partial-slip wear.

    Attributes:
        stick: The zone that carries the load (n,).
        pressure: (n,), MPa.
        depth: Worn off both bodies together (n,), mm.
        gap: Beside the scar (n,), mm.
        worn: The depth shared between the bodies by their wear rates.
    """

    stick: Mask
    pressure: Array
    depth: Array
    gap: Array
    worn: Worn


def stick_zone(rig: Rig) -> Mask:
    """Return the nodes that stick all through the first cycle (n,); collective.

    Raises:
        ConvergenceError: a time step did not converge.
    """
    return np.asarray(Records.joined(rig.cycle(rig.beginning())[1]).sticking.all(axis=0))


def final_shape(rig: Rig, stick: Mask | None = None) -> FinalShape:
    """Return the shape to which partial slip wears; collective.

    Args:
        rig: The bodies and what is done to them; its mean loads count.
        stick: The zone that never slips (n,); by default that of the first cycle.

    Raises:
        ConvergenceError: nothing sticks, so that wear goes on for ever; the contact did not converge.
    """
    zone = stick_zone(rig) if stick is None else stick
    if not zone.any():
        raise ConvergenceError(
            "no final shape exists: every node slips in a cycle, so that wear goes on for ever; expected a smaller "
            "stroke or force, or contact.law = 'gross-sliding'"
        )
    interface = rig.interface
    gap = rig.opening(interface.middle, rig.unworn())
    far = FAR * (np.abs(gap).max() + float(np.abs(interface.middle.compliance.diagonal()).max()))
    end = Imposed(interface.loaded(None), np.where(zone, gap, gap + far))
    start = Imposed(end.loaded.times(0), end.opening)
    state = advance(interface, untouched(interface), start, end, np.zeros(len(gap)))
    found = np.where(zone, state.gap, state.gap - far)
    depth = np.where(zone, 0.0, np.maximum(-found, 0.0))
    rates = [0.0 if law is None else float(law.rate.mean()) for law in (rig.wear.punch, rig.wear.strip)]
    share = rates[0] / sum(rates) if sum(rates) > 0 else 1.0
    strip = interface.middle.pair.deposit @ ((1 - share) * depth)
    return FinalShape(zone, state.pressure, depth, np.maximum(found, 0.0), Worn(share * depth, strip))
