"""The error of a cycle jump, estimated from the jump made whole and in two halves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fenwear.arrays import Array
from fenwear.assembly import Tribosystem
from fenwear.cycle.state import RunState, present
from fenwear.sliding.wear import WornDepths

ORDER = 2  # of the steps of a jump
REST = 1e-2  # of all that has crept: where creep comes to its end it is no longer measured by what a jump adds


@dataclass(frozen=True)
class Estimate:
    """Estimated error of a jump.

    Attributes:
        depth: Of the worn depths over what the jump wears, both integrated over the surfaces; so the errors of
            all jumps add up to at most the largest of them times the depth. Or, where a coating ends in the jump, the
            largest at such a place over the largest that the jump wears: it may wear many times as much by itself.
        pressure: How far the contact force lies from where it should, over the width in contact, in the worst phase.
        temperature: Of the contact surfaces over their rise from the initial one, root mean squares.
        state: Of the states that laws remember, and of the thickness of debris, over the largest they are in the jump,
            both integrated.
    """

    depth: float
    pressure: float
    temperature: float
    state: float = 0.0

    @property
    def largest(self) -> float:
        """The largest of all."""
        return max(self.depth, self.pressure, self.temperature, self.state)

    def longer(self, tolerance: float) -> float:
        """Return how many times as long a jump of that tolerance is.

        Depths are measured by what the jump wears, and err with the square of its length; the others with its cube.
        """
        by_wear = tolerance / max(self.depth, 1e-300)
        whole = tolerance / max(self.pressure, self.temperature, self.state, 1e-300)
        return float(min(by_wear ** (1 / ORDER), whole ** (1 / (ORDER + 1))))


def estimated(system: Tribosystem, before: RunState, whole: RunState, halves: RunState) -> Estimate:
    """Return the error of two half steps from their difference to the whole one, by Richardson."""
    apart, step = whole.worn - halves.worn, halves.worn - before.worn
    wrong, worn = area(system, apart), area(system, step)
    pressure = max(
        force_difference(system, present(one).pressure[0], present(other).pressure[0])
        for one, other in zip(whole.contacts, halves.contacts, strict=True)
    )
    share, depth = 1 / (2**ORDER - 1), wrong / max(worn, 1e-300)
    depth = max(
        depth,
        _creep_difference(system, apart, step, halves.worn),
        _carried_difference(system, apart, step, halves.worn),
    )
    remembered, lies = (of(system, before, whole, halves) for of in (_state_difference, _debris_difference))
    return Estimate(
        max(share * depth, _through_difference(system, before, whole, halves)),
        share * pressure,
        share * _heat_difference(system, whole, halves),
        share * max(remembered, lies),
    )


def _creep_difference(system: Tribosystem, apart: WornDepths, step: WornDepths, end: WornDepths) -> float:
    """Return the difference of what has crept over what the jump creeps; near the end of creep over a part of all."""
    creep, weights = system.creep, system.pair.weights
    wrong, moved, there = (float(weights @ np.abs(creep.depth(one.crept))) for one in (apart, step, end))
    return wrong / max(moved, REST * there, 1e-300)


def _carried_difference(system: Tribosystem, apart: WornDepths, step: WornDepths, end: WornDepths) -> float:
    """Return the same of debris that the strip carries: along a track it is thin, and nothing beside what is worn."""
    lies, weights = [system.layers.on_strip(one) for one in (apart, step, end)], system.pair.strip.weights
    wrong, moved, there = (0.0 if one is None else float(weights @ np.abs(one)) for one in lies)
    return wrong / max(moved, REST * there, 1e-300)


def _through_difference(system: Tribosystem, before: RunState, whole: RunState, halves: RunState) -> float:
    """Return the largest difference of depths where coatings end, over the largest that the jump wears.

    Not a part of it: in a step that a coating ends in depths bend, and its order is not that of others.
    """
    found = 0.0
    for body, thickness in zip(("punch", "strip"), system.coatings, strict=True):
        first, one, other = (getattr(state.worn, body) for state in (before, whole, halves))
        ended = (first < thickness) & (np.maximum(one, other) >= thickness)
        apart = float(np.abs(one - other).max(where=ended, initial=0.0))
        found = max(found, apart / max(float((other - first).max()), 1e-300))
    return found


def area(system: Tribosystem, worn: WornDepths) -> float:
    """Return the integral of the size of depths over both surfaces, and of what lies between."""
    pair = system.pair
    between = pair.weights @ np.broadcast_to(np.abs(system.layers.opening(worn.between)), pair.weights.shape)
    if (lies := system.layers.on_strip(worn)) is not None:
        between += pair.strip.weights @ np.abs(lies)  # as of its wear
    return float(pair.weights @ np.abs(worn.punch) + pair.strip.weights @ np.abs(worn.strip) + between)


def force_difference(system: Tribosystem, first: Array, second: Array) -> float:
    """Return how far the force of one pressure (n,) lies from that of another, over the extent of the contact.

    The Wasserstein distance of the two distributions, and the difference of their forces. Not a norm of the pressures'
    difference: a node at the edge closes as soon as the shape changes by what a node gives way, and a norm would be
    that of this node alone.
    """
    x, weights = system.pair.punch.x, system.pair.weights
    forces = [weights * first, weights * second]
    one, other = (float(force.sum()) for force in forces)
    if min(one, other) <= 0:
        return float(max(one, other) > 0)
    touched = x[(first > 0) | (second > 0)]
    width = max(float(np.ptp(touched, axis=0).max()), float(weights.min()))
    apart = forces[0] / one - forces[1] / other
    moved = 0.0
    for along in x.T:  # each axis; scipy's function for it would take half a second of imports
        order = along.argsort()
        moved = max(moved, float(np.abs(apart[order].cumsum())[:-1] @ np.diff(along[order])))
    return moved / width + abs(one - other) / max(one, other)


def _heat_difference(system: Tribosystem, one: RunState, other: RunState) -> float:
    """Return the difference of the reduced contact temperatures over their rise; 0 without heat."""
    exchange = system.exchange
    first, second, initial = (
        np.array(exchange.contact_temperatures(exchange.own(t))) for t in (one.temperature, other.temperature, None)
    )
    weights = system.pair.weights
    apart, rise = (float(np.sqrt((t**2 @ weights).sum())) for t in (first - second, second - initial))
    return apart / max(rise, 1e-300)


def _state_difference(system: Tribosystem, before: RunState, whole: RunState, halves: RunState) -> float:
    """Return the largest difference of a state that laws remember over its size; 0 without."""
    first, one, other = (system.layers.held(state.worn) for state in (before, whole, halves))
    return max(
        float((weights @ np.abs(a - b).T / np.maximum(size, 1e-300)).max(initial=0.0))
        for weights, a, b, size in (
            (own, x, y, np.maximum(own @ np.abs(y).T, own @ np.abs(z).T))
            for own, x, y, z in (
                (system.pair.weights, one.contact, other.contact, first.contact),
                (system.pair.strip.weights, one.strip, other.strip, first.strip),
            )
        )
    )


def _debris_difference(system: Tribosystem, before: RunState, whole: RunState, halves: RunState) -> float:
    """Return the difference of the debris' thickness over its size; 0 without.

    Beside what a jump wears, in many of its lives, it is next to nothing: an error of that says nothing of it.
    """
    first, one, other = (system.layers.thickness(state.worn) for state in (before, whole, halves))
    weights = system.pair.weights
    return float(weights @ np.abs(one - other)) / max(float(weights @ first), float(weights @ other), 1e-300)
