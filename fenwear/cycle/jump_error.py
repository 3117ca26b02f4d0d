"""The error of a cycle jump, from the jump made whole and in two halves, and how long the next one is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fenwear.arrays import Array
from fenwear.assembly import Tribosystem
from fenwear.cycle.state import RunState, present
from fenwear.interface import ContactPair
from fenwear.layers import Layers
from fenwear.sliding.wear import WornDepths

ORDER = 2  # of the steps of a jump
HALVES = 1 / (2**ORDER - 1)  # of the difference of a whole step to two halves, that these are off
REST = 1e-2  # of all that has crept: where creep comes to its end it is no longer measured by what a jump adds
SAFETY, LEAST, MOST = 0.9, 0.2, 5.0  # of the next jump's length over the last one's
FEW = 4  # cycles: shorter jumps grow by one at least


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


@dataclass(frozen=True)
class Lengths:
    """Lengths of jumps in cycles: whole ones, or a part of one.

    Attributes:
        tolerance: Largest estimated error of a jump.
        shortest: Length.
    """

    tolerance: float
    shortest: float = 1.0

    def cut(self, cycles: float) -> float:
        """Return a length of at most so many cycles."""
        return int(cycles) if cycles >= 1 else max(float(cycles), self.shortest)

    def shorter(self, tried: float, estimate: Estimate) -> float:
        """Return the length to try after one whose error was too large."""
        return self.cut(tried * min(0.5, max(LEAST, self._factor(estimate))))

    def following(self, tried: float, asked: float, estimate: Estimate) -> float:
        """Return the length after a jump; one cut short by an end says little of it."""
        factor = self._factor(estimate)
        if tried != asked and factor >= 1:
            return asked
        length = self.cut(tried * min(MOST, max(LEAST, factor)))
        return max(length, tried + 1) if factor > 1 and 1 <= tried < FEW else length

    def _factor(self, estimate: Estimate) -> float:
        return SAFETY * estimate.longer(self.tolerance)


@dataclass(frozen=True)
class Sizes:
    """How large depths and states of two surfaces are, and errors of them.

    Attributes:
        layers: What lies between.
        pair: The surfaces.
        crept: The gap (n,) that a state of what creeps opens, mm.
    """

    layers: Layers
    pair: ContactPair
    crept: Callable[[Array], Array]

    def area(self, worn: WornDepths) -> float:
        """Return the integral of the size of depths over both surfaces, and of what lies between."""
        weights, on_strip = self.pair.weights, self.pair.strip.weights
        between = float(weights @ np.broadcast_to(np.abs(self.layers.opened(worn.between)), weights.shape))
        return float(weights @ np.abs(worn.punch) + on_strip @ np.abs(worn.strip)) + between + self._carried(worn)

    def of_depth(self, wrong: WornDepths, step: WornDepths, end: WornDepths, rest: float = 0.0) -> float:
        """Return an error of depths over what a jump wears, or of what creeps and of debris that the strip carries.

        Args:
            wrong: The error.
            step: What the jump wears.
            end: All that is worn then.
            rest: Share of it that counts as worn in the jump.
        """
        found = self.area(wrong) / max(self.area(step) + rest * self.area(end), 1e-300)
        for size in (self._crept, self._carried):  # along a track it is thin, and nothing beside what is worn
            found = max(found, size(wrong) / max(size(step) + rest * size(end), REST * size(end), 1e-300))
        return found

    def of_states(self, wrong: WornDepths, begin: WornDepths, end: WornDepths) -> float:
        """Return the largest error of a state that laws remember, or of the thickness of debris, over its size.

        Beside what a jump wears, in many of its lives, debris is next to nothing: an error of that says nothing of it.
        """
        off, first, last = map(self._states, (wrong, begin, end))
        return float((off / np.maximum(np.maximum(first, last), 1e-300)).max(initial=0.0))

    def _crept(self, worn: WornDepths) -> float:
        return float(self.pair.weights @ np.abs(self.crept(worn.crept)))

    def _carried(self, worn: WornDepths) -> float:
        return float(self.pair.strip.weights @ np.abs(self.layers.lies(worn))) if self.layers.strip_carries else 0.0

    def _states(self, worn: WornDepths) -> Array:
        """Return the integrals of the size of all states."""
        held, lies = self.layers.held(worn), worn.between[:1] if self.layers.lies_here else ()
        on_contact = [float(self.pair.weights @ np.abs(one)) for one in (*held.contact, *lies)]
        return np.array([*on_contact, *(float(self.pair.strip.weights @ np.abs(one)) for one in held.strip)])


def estimated(system: Tribosystem, before: RunState, whole: RunState, halves: RunState) -> Estimate:
    """Return the error of two half steps from their difference to the whole one, by Richardson."""
    sizes, step = sizes_of(system), halves.worn - before.worn
    wrong = (whole.worn - halves.worn).times(HALVES)
    pressure = max(
        force_difference(system.pair, present(one).pressure[0], present(other).pressure[0])
        for one, other in zip(whole.contacts, halves.contacts, strict=True)
    )
    return Estimate(
        max(sizes.of_depth(wrong, step, halves.worn), _through_difference(system, before, whole, halves)),
        HALVES * pressure,
        HALVES * _heat_difference(system, whole, halves),
        sizes.of_states(wrong, before.worn, halves.worn),
    )


def sizes_of(system: Tribosystem) -> Sizes:
    """Return how large depths and states of a system are."""
    return Sizes(system.layers, system.pair, system.creep.depth)


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


def force_difference(pair: ContactPair, first: Array, second: Array) -> float:
    """Return how far the force of one pressure (n,) lies from that of another, over the extent of the contact.

    The Wasserstein distance of the two distributions, and the difference of their forces. Not a norm of the pressures'
    difference: a node at the edge closes as soon as the shape changes by what a node gives way, and a norm would be
    that of this node alone.
    """
    x, weights = pair.punch.x, pair.weights
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
