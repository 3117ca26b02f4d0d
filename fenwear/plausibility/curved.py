"""What is told of round contacts that wear so deep that their bodies look past each other.

Pressures and depths are counted along the common normals of the surfaces as they were made. A shaft that has moved by
delta into its bore touches it along other normals, turned by delta sin psi / R.
"""

from __future__ import annotations

import numpy as np

from fenwear.arrays import Array
from fenwear.interface import ContactPair

DEEP = 0.05  # of the radius: turns that are told of, rad
WORN = 0.01  # of the largest depth: nodes that count


def turned(pair: ContactPair, depth: Array) -> float:
    """Return by how much worn depths of both bodies together (n,), mm, turn the normals of round contacts, rad."""
    rounds, number = pair.punch.rounds
    number = number[pair.punch.nodes]
    found = 0.0
    for k, one in enumerate(rounds):
        own = (number == k) & (depth > WORN * depth.max(initial=0.0))
        if not own.any():
            continue
        deepest = pair.normal[own][depth[own].argmax()]
        across = np.sqrt(np.maximum(1 - (pair.normal[own] @ deepest) ** 2, 0.0))
        found = max(found, float(depth[own].max() * across.max() / one.radius))
    return found


def curved_text(pair: ContactPair, depth: Array, when: str) -> str:
    """Return what is to be said of such depths; "" of others."""
    turn = turned(pair, depth)
    if turn < DEEP:
        return ""
    return (
        f"{when} what is worn of a round contact has moved the bodies by {100 * turn:.2g} % of its radius: pressures "
        "and depths are counted along the normals of the surfaces as they were made, and may be off by half as much"
    )
