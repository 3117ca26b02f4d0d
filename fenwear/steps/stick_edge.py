"""Ends of a stick zone within their elements: in the plane, where the zone is one or more lengths along x.

From the edge c of a stick zone the slip of a cycle grows as (x - c)^(3/2), as that of half-planes does (Cattaneo).
A line through s^(2/3) at the second and third node that slip is zero there; the first one carries what the discrete
edge makes of it. On the exact solution that is within a tenth of the distance of the nodes, mostly: ends are known to
a quarter of it, where the edge of nodes that stick is off by up to a whole one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fenwear.bodies.contact_surface import ContactSurface
from fenwear.common.arrays import Array, Mask

KNOWN = 0.25  # of the distance of nodes: how far an edge may be from where it is located


@dataclass(frozen=True)
class Edge:
    """An end of a stick zone.

    Attributes:
        node: The last one that sticks.
        side: 1 for an end to the right, -1 for one to the left.
        x: Where it is, mm.
        within: Half the interval that is left, mm.
    """

    node: int
    side: int
    x: float
    within: float


def stick_edges(x: Array, stick: Mask, slid: Array, closed: Mask) -> list[Edge]:
    """Return the ends of each stick zone, from left to right.

    Args:
        x: Of the contact nodes, ascending (n,), mm.
        stick: Nodes that stick all through a cycle (n,).
        slid: Slip of each in the cycle, to and fro (n,), mm.
        closed: Nodes that carry pressure at any time of it (n,).
    """
    step = np.diff(np.concatenate([[0], stick.astype(np.int8), [0]]))
    found = []
    for first, last in zip(np.flatnonzero(step == 1), np.flatnonzero(step == -1) - 1, strict=True):
        found += [_edge(x, int(first), -1, slid, closed), _edge(x, int(last), 1, slid, closed)]
    return found


def _edge(x: Array, node: int, side: int, slid: Array, closed: Mask) -> Edge:
    beside, far = node + side, node + 3 * side
    if not 0 <= beside < len(x):
        return Edge(node, side, float(x[node]), 0.0)
    spacing = abs(float(x[beside] - x[node]))
    unknown = Edge(node, side, float(x[beside] + x[node]) / 2, spacing / 2)
    if not 0 <= far < len(x):
        return unknown
    places = np.array([node + 2 * side, far])
    grown = slid[places] ** (2 / 3)
    if not closed[[beside, *places]].all() or not 0 < grown[0] < grown[1]:
        return unknown
    near, away = x[places]
    at = side * float(near - grown[0] * (away - near) / (grown[1] - grown[0]))
    low, high = side * float(x[node]) - KNOWN * spacing, side * float(x[beside])
    return Edge(node, side, side * min(max(at, low), high), KNOWN * spacing)


def zone_width(edges: Sequence[Edge]) -> tuple[float, float]:
    """Return the width of the zones between these ends, and half the interval that is left of it, mm."""
    return sum(edge.side * edge.x for edge in edges), sum(edge.within for edge in edges)


def beside(surface: ContactSurface, zone: Mask) -> Mask:
    """Return the nodes beside a zone of pressure nodes: they share a facet with it (n,)."""
    number = np.full(len(surface.trace), -1)
    number[surface.nodes] = np.arange(len(surface.nodes))
    facets = number[surface.facets]
    touched = (zone[facets] & (facets >= 0)).any(axis=1)
    found = np.zeros(len(zone), dtype=bool)
    found[facets[touched][facets[touched] >= 0]] = True
    return found & ~zone
