"""Contact on a few nodes, whose pressures are not those of the contact.

The largest pressure of a Hertzian contact is 1.03, 1.05, 1.26 and 1.46 times Hertz's with 45, 21, 9 and 5 nodes of a
solid in contact, which are 7.6, 5.2, 3.4 and 2.5 across it. Only ends of the contact within the surface count: what
ends with the surface, as a flat punch, or at a plane of symmetry, is as wide there as it was made.
"""

from __future__ import annotations

import math

import numpy as np

from fenwear.arrays import Array
from fenwear.bodies.constants import constants
from fenwear.bodies.mesh import find_geometry
from fenwear.case import Case
from fenwear.errors import CaseError
from fenwear.results.zone import ContactNet, Zone

ENOUGH = 4  # nodes from the middle of a contact to each of its ends: eight across it
# Of the ready geometries, and of others that name them so: numbers of elements along the contact.
COUNTS = ("elements_along_contact", "elements_along_flat", "across", "core_elements", "along", "around",
          "across_x", "across_y")  # fmt: skip


def few_text(case: Case, net: ContactNet, pressure: Array, when: str, width: float | None = None) -> str:
    """Say that a contact has few nodes across it, and with how many elements it had enough; "" where it has enough.

    Args:
        case: The problem.
        net: The nodes of its contact.
        pressure: At them (n,), MPa.
        when: In words.
        width: About how wide the contact is, where that is known otherwise than by the nodes, mm.
    """
    zone = net.zone(pressure)
    if zone is None:
        return ""
    wanted = ENOUGH * zone.free
    few = np.flatnonzero(np.round(zone.nodes, 6) < wanted)
    if not len(few):
        return ""
    finer = max((wanted[k] + 1) * zone.spacing[k] / _width(zone, k, width) for k in few)  # w / h - 1 nodes at least
    worst = few[np.argmin(zone.nodes[few] / wanted[few])]
    nodes = f"{zone.nodes[worst]:.0f} node" + ("s lie" if round(zone.nodes[worst]) > 1 else " lies")
    return (
        f"only {nodes} across the contact {when}: pressures there are as rough as that, and the largest may be off by "
        f"tens of per cent; {_remedy(case, net, zone, finer)}"
    )


def _width(zone: Zone, k: int, width: float | None) -> float:
    """Return how wide the contact is along a coordinate, mm: from its outermost nodes on up to those beside them."""
    least = max((zone.nodes[k] - 1) * zone.spacing[k], zone.spacing[k] / 4)
    return float(least if width is None else np.clip(width, least, least + 2 * zone.spacing[k]))


def _remedy(case: Case, net: ContactNet, zone: Zone, finer: float) -> str:
    """Say with how many elements along the contact it has enough nodes, each `finer` times smaller."""
    counts = {name: count for name, count in _counts(case).items() if count > 0}
    if not counts:
        each = net.surface.degree if net.surface.cell != "triangle" else 1
        return f"make the elements at the contact {each * zone.spacing.min() / finer:.2g} mm long"
    told = []
    for name, count in counts.items():
        step = 2 if count % 2 == 0 else 1
        told.append(f"geometry.parameters.{name} = {step * math.ceil(count * finer / step)}")
    return f"set {' and '.join(told)}"


def _counts(case: Case) -> dict[str, float]:
    """Return the numbers of elements along the contact that the geometry has as parameters, by their names."""
    geometry = case.geometry
    try:
        path = find_geometry(geometry, case.folder)
        known = constants(path) if path.suffix == ".geo" else {}
        return {name: float(geometry.parameters.get(name, known[name])) for name in COUNTS if name in known}
    except (CaseError, OSError, ValueError):  # the file is gone, or what it gives is no number
        return {}
