"""One cycle jump: its two stages, its error, and the length of the next; laws of contact give the stages.

The state y(n) after n cycles, the worn depths and layers, follows dy/dn = M(y) + R(n): M is the wear of
a contact inequality, R what cycles do beside it, linear in n and zero in gross sliding. One step of N cycles has the
two stages of the second-order, L-stable and stiffly accurate method SDIRK2 (Alexander, SIAM J. Numer. Anal. 14, 1977),
with R the implicit-explicit method ARS(2,2,2) (U. M. Ascher et al., Applied Numerical Mathematics 25, 1997). With
g = 1 - 1/sqrt(2)

    y_1 = y + g N (M(y_1) + R(g N)),
    y_2 = y + (1 - g) N (M(y_1) + R(g N)) + g N (M(y_2) + R(N)).

The weights 1 - g and g are positive, so that no depth decreases by M. The end y_2 is itself a solved contact. A
jump is made whole and in two halves; the halves are kept.

A node that comes into contact within a step has M(y_1) = 0: all that it must lose to follow its neighbours it loses by
g N M(y_2), and at the end it carries up to 1 / g = 3.4 times their pressure. So a jump in which nodes come into contact
ends by one step of the implicit Euler method over a share of it, `LAST`. In it such a node loses what its neighbours
do.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Generic, Protocol, TypeVar

import numpy as np

from fenwear.common.arrays import Array
from fenwear.common.errors import ConvergenceError
from fenwear.contact import ContactState
from fenwear.laws import Layers
from fenwear.laws.wear import WornDepths
from fenwear.surfaces import ContactPair

GAMMA = 1 - np.sqrt(0.5)
LAST = 1 / 8  # of a jump in which nodes come into contact, that its last step covers
ROUGH, FINE = 0.1, 0.01  # of the tolerance, to which the stages of a jump are solved, and its end
ORDER = 2  # of the steps of a jump
HALVES = 1 / (2**ORDER - 1)  # of the difference of a whole step to two halves, that these are off
BEFORE = 1e-2  # of all that has crept, or lies on the strip: what a jump adds is measured by no less
SAFETY, LEAST, MOST = 0.9, 0.2, 5.0  # of the next jump's length over the last one's
FEW = 4  # cycles: shorter jumps grow by one at least


@dataclass(frozen=True)
class Moment:
    """A moment of a jump; laws of contact add what else they follow.

    Attributes:
        worn: Depths and layers.
        contact: Of all phases, as last solved; of none before the first.
        time: Of that contact, cycles since the begin of the jump.
    """

    worn: WornDepths
    contact: ContactState
    time: float


M = TypeVar("M", bound=Moment)
T = TypeVar("T")


class JumpLaw(Protocol[M]):
    """Data of a law of contact for a jump."""

    def stage(self, before: M, cycles: float, time: float, near: ContactState, digits: float) -> M:
        """Return z = before + cycles (M(z) + R(time)), its contact looked for near one, to a share of the tolerance."""

    def after(self, before: M, stage: M, cycles: float) -> M:
        """Return before + cycles (M + R), at the rate of a stage."""

    def settled(self, end: M) -> M:
        """Return the end of a step, which may have overshot."""

    def apart(self, base: M, first: M, other: M, share: float) -> M:
        """Return base + share (one - other)."""
        return replace(base, worn=base.worn + (first.worn - other.worn).times(share))

    def halfway(self, half: M, cycles: float) -> M:  # noqa: ARG002
        """Return the state halfway through so many cycles, with R there; by default none."""
        return half

    def ended(self, end: M, cycles: float) -> None:
        """Take the cycle at the end of a jump."""


class Trend:
    """Change of contacts over a jump, by its stages solved so far: where the next ones are looked for.

    Lines through two of them, as those near borders that move come and go: parabolas begin farther away.
    """

    def __init__(self, contacts: dict[float, ContactState] | None = None) -> None:
        self._contacts = dict(contacts or {})  # by their time, cycles since the begin of the jump

    def copy(self) -> Trend:
        """Return a copy that later changes do not affect."""
        return Trend(self._contacts)

    def add(self, moment: Moment) -> None:
        """Take the contact of a moment, if none is known at its time."""
        if len(moment.contact.pressure):
            self._contacts.setdefault(moment.time, moment.contact)

    def expected_from(self, moment: Moment, to: float) -> ContactState:
        """Return the contact expected at a time from that of a moment; where it has none, from the next one known."""
        contact, since = moment.contact, moment.time
        if not len(contact.pressure) and self._contacts:
            since = min(self._contacts, key=lambda known: abs(known - to))
            contact = self._contacts[since]
        if len(self._contacts) < 2:
            return contact
        pressure, rigid = contact.pressure.copy(), contact.rigid.copy()
        for time, sign in ((to, 1.0), (since, -1.0)):
            for share, known in self._line(time):
                pressure += sign * share * known.pressure
                rigid += sign * share * known.rigid
        return replace(contact, pressure=np.maximum(pressure, 0.0), rigid=rigid)

    def _line(self, time: float) -> list[tuple[float, ContactState]]:
        """Return the shares at a time of the two contacts next to it, and them; of one alone that is of that time."""
        if time in self._contacts:
            return [(1.0, self._contacts[time])]
        nearest, other = sorted(self._contacts, key=lambda known: abs(known - time))[:2]
        share = (time - nearest) / (other - nearest)
        return [(1 - share, self._contacts[nearest]), (share, self._contacts[other])]


def two_stages(law: JumpLaw[M], before: M, cycles: float, since: float, near: Trend, digits: float = ROUGH) -> M:
    """Return the moment so many cycles later, by the two stages of one step.

    Args:
        law: Gives the stages.
        before: Where it begins.
        cycles: Length of the jump.
        since: Cycles from the begin of the jump to that of the step.
        near: Change of contacts, which takes those of the step, too.
        digits: Share of the tolerance that its last contact is solved to; of a first stage its wear is all that stays.
    """
    share = GAMMA * cycles
    near.add(before)
    first = law.stage(before, share, since + share, near.expected_from(before, since + share), ROUGH)
    near.add(first)
    between = law.after(before, first, cycles - share)
    end = law.stage(between, share, since + cycles, near.expected_from(first, since + cycles), digits)
    near.add(end)
    return law.settled(end)


@dataclass(frozen=True)
class Attempt(Generic[M]):
    """A jump, made whole and in two halves.

    Attributes:
        begin, half, end: Of the halves.
        whole: The end of the whole step.
        cycles: Length of the jump.
        comes: Whether nodes come into contact, so that it ends by a last step.
        near: Change of contacts in it.
    """

    begin: M
    half: M
    end: M
    full: M
    cycles: float
    comes: bool
    near: Trend

    @property
    def bent(self) -> WornDepths:
        """The error of the last step, which is of first order: h^2 y'' / 2 by 4 (d_2 - d_1) / N^2."""
        first, second = self.half.worn - self.begin.worn, self.full.worn - self.half.worn
        return (second - first).times(2 * LAST**2 if self.comes else 0.0)

    def finer(self, law: JumpLaw[M], fine: M) -> M:
        """Return the end of jumps of vanishing length from the earlier end of such jumps.

        From the begin y to y_h in halves and to y_w as a whole y_h is off by a third of y_w - y_h; the earlier error, y
        - f, continues as a whole step takes it, to y_w - f_w. So they lead to f_w + 4/3 (y_h - y_w). Where nodes have
        come into contact y_h has the error of its last step, of first order, too, which is taken from it.
        """
        moved = self.full
        if fine is not self.begin:  # of the first jump it is
            try:
                moved = two_stages(law, fine, self.cycles, 0.0, self.near.copy())
            except ConvergenceError:  # it may lie where no contact is: then what was off stays
                moved = law.apart(self.full, fine, self.begin, 1.0)
        halves = replace(self.end, worn=self.end.worn - self.bent)
        return law.apart(moved, halves, self.full, 1 + HALVES)


def attempt(law: JumpLaw[M], begin: M, cycles: float) -> Attempt[M]:
    """Return a jump of so many cycles.

    Raises:
        ConvergenceError: it did not converge.
    """
    near = Trend()
    half = two_stages(law, begin, cycles / 2, 0.0, near)
    half = law.halfway(half, cycles)
    early = _comes(begin, half, half)  # then begun near the halves, whose steps are not as long
    full = half if early else two_stages(law, begin, cycles, 0.0, near.copy())
    comes = _comes(begin, half, full)
    last = LAST * cycles if comes else 0.0
    end = two_stages(law, half, cycles / 2 - last, cycles / 2, near, ROUGH if comes else FINE)
    if comes:
        end = law.settled(law.stage(end, last, cycles, near.expected_from(end, cycles), FINE))
        near.add(end)
    law.ended(end, cycles)
    if early:
        full = two_stages(law, begin, cycles, 0.0, near.copy())
    return Attempt(begin, half, end, full, cycles, comes, near)


def _comes(begin: Moment, half: Moment, end: Moment) -> bool:
    """Return whether a node comes into contact from the begin of a jump or from its middle to its end."""
    before = half.contact.pressure
    if len(begin.contact.pressure):
        before = np.minimum(before, begin.contact.pressure)
    return bool(np.any((end.contact.pressure > 0) & (before <= 0)))


@dataclass(frozen=True)
class Estimate:
    """Estimated error of a jump.

    Attributes:
        depth: Of the worn depths over what the jump wears, both integrated over the surfaces; so the errors of
            all jumps add up to at most the largest of them times the depth. Or, where a coating ends in the jump, the
            largest at such a place over the largest that the jump wears: it may wear many times as much by itself.
        pressure: Distance of the contact force from its place in equilibrium, over the width in contact, in the worst
            phase.
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
        """Return the factor on the length of the jump at which it has this tolerance.

        Depths are measured by what the jump wears, and err with the square of its length; the others with its cube.
        """
        by_wear = tolerance / max(self.depth, 1e-300)
        by_state = tolerance / max(self.pressure, self.temperature, self.state, 1e-300)
        return float(min(by_wear ** (1 / ORDER), by_state ** (1 / (ORDER + 1))))


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

    def accepted(
        self,
        length: float,
        left: Callable[[float], float],
        attempt: Callable[[float], tuple[T, Estimate]],
        fits: Callable[[T], bool],
    ) -> tuple[T, Estimate, float, float]:
        """Return the next jump that is accurate enough, its error, its length and that of the one after it.

        Args:
            length: To be tried first.
            left: Cycles that are left at most where a length is tried.
            attempt: Makes a jump of a length.
            fits: Whether the system suffices for one of several cycles: it is halved where it does not.

        Raises:
            ConvergenceError: the shortest jump did not converge.
        """
        while True:
            most = left(length)
            tried = most if most < min(length, 1) + self.shortest else min(length, most)
            try:
                made, estimate = attempt(tried)
            except ConvergenceError:
                if tried <= self.shortest:
                    raise
                length = self.cut(tried / 4)
                continue
            if tried > 1 and not fits(made):
                length = self.cut(tried / 2)
            elif estimate.largest > self.tolerance and tried > self.shortest:
                length = self.shorter(tried, estimate)
            else:
                return made, estimate, tried, self.following(tried, length, estimate)


@dataclass(frozen=True)
class Sizes:
    """Norms of depths and states of two surfaces, and of their errors.

    One measure serves all: the size of an error over that of what the jump adds, and over no less than a share of all
    that there is at its end. A state that lives and dies many times in a jump is measured by all of it.

    Attributes:
        layers: The layers.
        pair: The surfaces.
        crept: The gap (n,) that a state of what creeps opens, mm.
        rest: Share of all depths: near the end of wear errors are no longer measured by what a jump wears alone.
    """

    layers: Layers
    pair: ContactPair
    crept: Callable[[Array], Array]
    rest: float = 0.0

    def area(self, worn: WornDepths) -> float:
        """Return the integral of the size of depths over both surfaces, and of what lies between."""
        weights, on_strip = self.pair.weights, self.pair.strip.weights
        between = float(weights @ np.broadcast_to(np.abs(self.layers.opened(worn.between)), weights.shape))
        return float(weights @ np.abs(worn.punch) + on_strip @ np.abs(worn.strip)) + between + self._carried(worn)

    def of_depth(self, wrong: WornDepths, begin: WornDepths, end: WornDepths) -> float:
        """Return the largest relative error of depths, of creep, and of debris that the strip carries.

        Along a track debris is thin, and nothing beside what is worn: it is measured by itself, as creep is.
        """
        kinds = ((self.area, self.rest), (self._crept, BEFORE), (self._carried, BEFORE))
        return max(float(_relative(size, share, wrong, begin, end)) for size, share in kinds)

    def of_states(self, wrong: WornDepths, begin: WornDepths, end: WornDepths) -> float:
        """Return the largest relative error of a state that laws remember, or of the thickness of debris."""
        return float(_relative(self._states, 1.0, wrong, begin, end).max(initial=0.0))

    def _crept(self, worn: WornDepths) -> float:
        return float(self.pair.weights @ np.abs(self.crept(worn.crept)))

    def _carried(self, worn: WornDepths) -> float:
        carried = worn.carried[:1] if self.layers.strip_carries else ()  # none where depths alone are measured
        return float(sum(self.pair.strip.weights @ np.abs(depth) for depth in carried))

    def _states(self, worn: WornDepths) -> Array:
        """Return the integrals of the size of all states."""
        held, lies = self.layers.held(worn), worn.between[:1] if self.layers.lies_here else ()
        on_contact = [float(self.pair.weights @ np.abs(state)) for state in (*held.contact, *lies)]
        return np.array([*on_contact, *(float(self.pair.strip.weights @ np.abs(state)) for state in held.strip)])

    def estimate(
        self, worn: Sequence[WornDepths], made: Attempt[M], parts: Sequence[WornDepths], of_heat: float
    ) -> Estimate:
        """Return the error of a jump.

        Args:
            worn: Depths at its begin and its end.
            made: The jump.
            parts: Errors of its depths, which add up.
            of_heat: That of temperatures.
        """
        first, second = made.full.contact.pressure, made.end.contact.pressure
        bent = _relative(self.area, self.rest, made.bent, made.begin.worn, made.full.worn)
        return Estimate(
            max(float(bent), sum(self.of_depth(part, *worn) for part in parts)),
            HALVES * max(force_difference(self.pair, first[k], second[k]) for k in range(len(first))),
            of_heat,
            sum(self.of_states(part, *worn) for part in parts),
        )


def _relative(
    size: Callable[[WornDepths], T], share: float, wrong: WornDepths, begin: WornDepths, end: WornDepths
) -> Array:
    """Return the size of an error over the size of a jump's additions, or over a share of the size at its end."""
    step, reached = np.asarray(size(end - begin)), np.asarray(size(end))
    return np.asarray(size(wrong) / np.maximum(np.maximum(step, share * reached), 1e-300))


def force_difference(pair: ContactPair, first: Array, second: Array) -> float:
    """Return the distance between the forces of two pressures (n,), over the extent of the contact.

    The Wasserstein distance of the two distributions, and the difference of their forces. Not a norm of the pressures'
    difference: a node at the edge closes as soon as the shape changes by a node's compliance, and a norm would be
    that of this node alone.
    """
    x, weights = pair.punch.x, pair.weights
    forces = [weights * first, weights * second]
    first_force, other = (float(force.sum()) for force in forces)
    if min(first_force, other) <= 0:
        return float(max(first_force, other) > 0)
    touched = x[(first > 0) | (second > 0)]
    width = max(float(np.ptp(touched, axis=0).max()), float(weights.min()))
    apart = forces[0] / first_force - forces[1] / other
    moved = 0.0
    for along in x.T:  # each axis; scipy's function for it would take half a second of imports
        order = along.argsort()
        moved = max(moved, float(np.abs(apart[order].cumsum())[:-1] @ np.diff(along[order])))
    return moved / width + abs(first_force - other) / max(first_force, other)
