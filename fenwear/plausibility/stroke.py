"""What gross sliding leaves out of a stroke: the way that the bodies follow friction elastically before they slide.

And distances that a program has measured at a radius where nothing touches.
"""

from __future__ import annotations

import numpy as np

from fenwear.assembly import Tribosystem

TAKEN_UP = 0.1  # of the amplitude: slip and worn volume are too large by that


def elastic_way(system: Tribosystem) -> float:
    """Return about how far each way the bodies follow friction elastically before they slide as a whole, mm.

    mu times the mean displacement of the contact by an even pressure under the load, in which the bodies give way
    along the surface as they do across it: on a half-plane the displacement along a line force across the surface
    and along it is the same, on a half-space (2 - nu) / (2 - 2 nu) times larger along it (K. L. Johnson, Contact
    Mechanics, 1985). 0 where supports and not the contact carry the load.
    """
    if not system.normal_force:
        return 0.0
    weights = system.pair.weights
    pressed_in = float(weights @ system.interface.by_even / weights.sum()) * system.rigid.mean_pressure
    ratio = float(weights @ np.linalg.norm(system.friction_ratio(1), axis=1) / weights.sum())
    return ratio * max(pressed_in, 0.0)


def elastic_and_amplitude(system: Tribosystem) -> tuple[float, float]:
    """Return the elastic way, see `elastic_way`, and the mean amplitude of the sliding to and fro, mm."""
    slid = float((system.sliding_ratio.mean(axis=1) * system.motion.sliding()).sum())
    return elastic_way(system), slid / (2 * system.motion.half_cycles)


def elastic_share(system: Tribosystem) -> float | None:
    """Return the share of the amplitude that the bodies take up elastically before they slide as a whole.

    None for sliding one way, and where nodes stick: there it is followed.
    """
    if system.sticks or len(set(system.motion.directions)) == 1:
        return None
    way, amplitude = elastic_and_amplitude(system)
    return way / max(amplitude, 1e-300)


def _radius_warnings(system: Tribosystem) -> list[str]:
    """Return what is to be said of distances that are measured where nothing touches."""
    program = (system.made_from or system.case).program
    if program is None or program.radius is None:
        return []
    radii, weights = system.sliding_ratio[0], system.pair.weights
    if radii.min() <= program.radius <= radii.max():
        return []
    return [
        f"program.radius: distances are those at {program.radius:g} mm from the axis, but the contact lies between "
        f"{radii.min():.4g} and {radii.max():.4g} mm, in the mean at {weights @ radii / weights.sum():.4g} mm"
    ]


def stroke_warnings(system: Tribosystem) -> list[str]:
    """Return what is to be said of a stroke that bodies take up elastically, or that is measured beside the contact."""
    told, share = _radius_warnings(system), elastic_share(system)
    if share is None or share <= TAKEN_UP:
        return told
    way, amplitude = elastic_and_amplitude(system)
    against = system.case.against_stick
    remedy = f"stick and slip cannot be followed here: {against[0]}" if against else ""
    return [
        *told,
        f"before they slide as a whole the bodies follow friction elastically, by an estimate {1e3 * way:.3g} µm each "
        f"way, {100 * share:.3g} % of the amplitude of {1e3 * amplitude:.3g} µm; gross sliding leaves that "
        f"out, and its slip and wear are too large by it; "
        + (remedy or 'set contact.law = "coulomb" to follow stick and slip'),
    ]
