"""Creep at a constant Poisson's ratio: the growth of a body's compliance, without any state in its volume.

Where all of a body creeps alike, its displacement by forces f(t) on its surface is that of an elastic body whose
compliance has a history (the correspondence principle; E. H. Lee, Q. Appl. Math. 13, 1955, 183),

    u(t) = integral of J(t - s) / J(0) d[G f](s) = v(t) + sum of c_k y_k(t),    tau_k dy_k/dt = v - y_k,    v = G f,

with G the elastic answer and J / J(0) = 1 + sum of c_k (1 - exp(-t / tau_k)). So the memory of the whole body is one
displacement y_k of its contact surface for each term. Displacements that do not depend on the modulus, of moved
supports and of thermal expansion, do not creep.

Growth with the logarithm of time is an endless sum of such terms, ln(1 + t / t_0) = integral of
(1 - exp(-t / tau)) exp(-t_0 / tau) d(ln tau), taken by the trapezoidal rule in ln tau, which errs by exp(-pi^2 / step).

In a march v is constant within each phase of the motion: exactly,

    y -> e y + (1 - e) v,    e = exp(-T / tau),

T its duration. With v that of the end of the phase, creep is implicit, and stable for any duration. Where the load
varies within a phase, by l(t) over that of its middle, v does, and exactly

    y -> e y + v integral of exp(-(T - t) / tau) l(t) dt / tau,

in closed form for straight lines between times. Contact has the load of the middle, and then sees y of the middle.

The phases of a
cycle one after the other make y -> E y + sum of g_i v_i of it; the solution after whole cycles of

    dy/dn = X (sum of g_i v_i / (1 - E) - y),    X = -ln E,

which jumps take as its rate.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fenwear.case.material_tables import Creep
from fenwear.common.arrays import Array

STAYS = 1e-12  # change of a load over that of the middle: rounding
PER_DECADE, FIRST, LAST = 2, -1, 15  # terms of a logarithm's, and the decades around its onset that they reach over


@dataclass(frozen=True)
class Retardation:
    """J(t) / J(0) = 1 + sum of c_k (1 - exp(-t / tau_k)).

    Attributes:
        compliances: c (terms,).
        times: tau (terms,), s.
        endless: Whether it stands for a growth that has no end.
    """

    compliances: Array
    times: Array
    endless: bool = False

    @classmethod
    def of(cls, creep: Creep | None) -> Retardation:
        """Return the law of a case's table; without one that of no terms, which does not creep."""
        if creep is None:
            return cls(np.zeros(0), np.zeros(0))
        compliances = [term.compliance for term in creep.terms]
        times = [term.time for term in creep.terms]
        if creep.per_decade is not None and creep.onset is not None:
            step = np.log(10) / PER_DECADE
            decades = np.arange(FIRST * PER_DECADE, LAST * PER_DECADE + 1) / PER_DECADE
            compliances += list(creep.per_decade / np.log(10) * step * np.exp(-(10.0**-decades)))
            times += list(creep.onset * 10.0**decades)
        return cls(np.array(compliances), np.array(times), creep.per_decade is not None)

    @property
    def creeps(self) -> bool:
        """Whether it has terms."""
        return len(self.times) > 0

    def growth(self, time: Array | float) -> Array:
        """Return J(t) / J(0) at times (...), s."""
        shares = -np.expm1(-np.asarray(time)[..., None] / self.times)
        return np.asarray(1 + shares @ self.compliances)

    def over(self, durations: Array, courses: Array | None = None) -> RetardedCycle:
        """Return the creep over a cycle whose phases have these durations (m,), s.

        Args:
            durations: Of the phases.
            courses: Loads over those of the middle, at even times from begin to end of each phase (m, 2 k + 1); by
                default they stay.
        """
        even = np.ones((len(durations), 3)) if courses is None else courses
        return RetardedCycle(self, np.asarray(durations, dtype=float), even)

    def taken(self, duration: float, course: Array) -> Array:
        """Return the y (terms,) that v = 1 at loads of a course, at even times (k + 1,), gives to y = 0."""
        step = duration / (len(course) - 1) / self.times
        kept, grown = np.exp(-step), -np.expm1(-step)
        mean = np.divide(grown, step, out=np.ones_like(step), where=step > 0)
        y = np.zeros(len(self.times))
        for first, last in pairwise(course):
            y = kept * y + last - first * kept - (last - first) * mean
        return y

    def shares(self, duration: float) -> tuple[Array, Array]:
        """Return the shares (terms,) of v at the begin and at the end of a step that y takes up, v changing evenly."""
        return self.taken(duration, np.array([1.0, 0.0])), self.taken(duration, np.array([0.0, 1.0]))


@dataclass(frozen=True)
class RetardedCycle:
    """A cycle of m phases, in each of which the elastic displacement v is constant, or varies as its loads do.

    Attributes:
        of: The law, with its c (terms,).
        durations: Of the phases (m,), s.
        courses: Loads over those of the middle, at even times of each phase (m, 2 k + 1).
    """

    of: Retardation
    durations: Array
    courses: Array

    @cached_property
    def decays(self) -> Array:
        """Share of y that remains after each phase, e (m, terms)."""
        return np.asarray(np.exp(-self.durations[:, None] / self.of.times))

    @cached_property
    def taken(self) -> Array:
        """Share of v that y takes in each phase, 1 - e where v stays (m, terms)."""
        phases = range(len(self.durations))
        return np.array([self.of.taken(float(self.durations[k]), self.courses[k, :]) for k in phases])

    @cached_property
    def varies(self) -> NDArray[np.bool_]:
        """Phases whose loads vary (m,): their contact sees y of the middle, that of others y of the end."""
        return np.asarray(np.ptp(self.courses, axis=1) > STAYS)

    @cached_property
    def seen_decays(self) -> Array:
        """Share of the y at the start of a phase that its contact sees (m, terms)."""
        seen = np.where(self.varies, 0.5, 1.0) * self.durations
        return np.asarray(np.exp(-seen[:, None] / self.of.times))

    @cached_property
    def seen_taken(self) -> Array:
        """Share of v in y as the contact of a phase sees it (m, terms)."""
        middle, shares = self.courses.shape[1] // 2 + 1, self.taken.copy()
        for k in np.flatnonzero(self.varies):
            shares[k] = self.of.taken(float(self.durations[k]) / 2, self.courses[k, :middle])
        return shares

    @cached_property
    def factors(self) -> Array:
        """Compliance in each phase, over that of the elastic body (m,)."""
        return 1 + self.seen_taken @ self.of.compliances

    @cached_property
    def left(self) -> Array:
        """Gap that each y at the start of a phase opens for its contact (m, terms)."""
        return self.of.compliances * self.seen_decays

    @cached_property
    def cycles(self) -> Array:
        """X, the duration of a cycle over tau (terms,)."""
        return np.asarray(self.durations.sum() / self.of.times)

    @cached_property
    def _kept(self) -> Array:
        """Share of the y at the start of a cycle that the contact of each phase sees (m, terms)."""
        begins = np.cumsum(self.durations) - self.durations
        return np.asarray(np.exp(-begins[:, None] / self.of.times)) * self.seen_decays

    @cached_property
    def _given(self) -> Array:
        """Part of y from each v_i that the contact of each phase sees (phases, i, terms)."""
        ends, phases = np.cumsum(self.durations), np.arange(len(self.durations))
        since = (ends - self.durations)[:, None] - ends  # from the end of phase i to the begin of a phase
        later = np.exp(-np.maximum(since, 0.0)[:, :, None] / self.of.times)
        before = (phases[:, None] > phases)[:, :, None]
        parts = np.where(before, later * self.seen_decays[:, None] * self.taken, 0.0)
        parts[phases, phases] = self.seen_taken
        return parts

    @cached_property
    def lasting(self) -> Array:
        """Shares of the v_i in what y comes to at the end of cycles that repeat, g / (1 - E) (i, terms)."""
        since = self.durations.sum() - np.cumsum(self.durations)
        return np.asarray(np.exp(-since[:, None] / self.of.times) * self.taken / -np.expm1(-self.cycles))

    def within(self, cycles: float) -> tuple[Array, Array]:
        """Return the additions by creep after each phase of the middle cycle at the end of an implicit step.

        The cycle begins by half of its change before.

        Returns:
            Of each v_i (phases, i), and of each y at the start of the step (phases, terms).
        """
        x = self.cycles
        before = (1 + x / 2) / (1 + cycles * x)
        begun = self._kept * before
        by_lasting = self._kept * (1 - before)
        by_phase = by_lasting[:, None] * self.lasting + self._given
        return np.asarray(by_phase @ self.of.compliances), self.of.compliances * begun

    def rate(self, cycles: float) -> tuple[Array, Array]:
        """Return the change of y in each cycle of such a step: by each v_i (terms, i), and by y itself (terms,)."""
        share = self.cycles / (1 + cycles * self.cycles)
        return np.asarray((share * self.lasting).T), -share
