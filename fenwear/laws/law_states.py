"""States that laws of one's own remember at the nodes of the contact: their evolution and their rest.

With the conditions of a phase of the motion, which lasts tau, the states y of a node follow dy/dt = r(y). A step of it
is that of the exponential Rosenbrock and Euler method (M. Hochbruck, A. Ostermann, Acta Numerica 19, 2010), exact where
r is linear in y and of second order elsewhere,

    y -> y + tau phi(tau J) r(y),    J = dr/dy,    phi(z) = (e^z - 1) / z,

in as many parts as two halvings of them agree on. Phases one after the other make a cycle y -> F(y), with Z the sum of
their tau J. At whole cycles n the solution is that of

    dy/dn = f(y) = phi(Z)^-1 (F(y) - y),

exactly where r is linear, which jumps take as the rate of the states, as of debris: a step of h cycles is implicit,
y_1 = y_0 + h f(y_1), by Newton's method with f' = Z. In the steady state F(y) = y.

The strip's states are on its material. In a phase they are read at the contact's nodes as its worn depth is, and what
they change by there is put back as wear is, by the shares of the strip's nodes that are under the punch; the rest of
each continues without pressure, speed and wear, at the initial temperature.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, cast

import numpy as np
import scipy.linalg

from fenwear.case.dependence import WEAR, State, evaluate_of_state
from fenwear.case.wear_table import FILM
from fenwear.common.arrays import Added, Array
from fenwear.common.errors import ConvergenceError
from fenwear.laws.friction import ContactConditions
from fenwear.laws.wear import PhasesWear
from fenwear.surfaces import ContactPair
from fenwear.surfaces.placement import in_space

Side = Literal["punch", "strip", "friction"]
NUDGE = 1e-5  # of a state, for differences
AGREE, HALVINGS = 1e-6, 10  # change of a state by halving the parts of a phase, over the state; how often they are
SETTLED, MOST_STEPS = 1e-9, 60  # change that ends Newton's method, over the state; its steps
# Cycles after which a state at rest is looked for, where it is not in sight at once.
STRIDES = (1.0, 1e3, 1e6, 1e9, 1e12)


@dataclass(frozen=True)
class Memory:
    """The states of all laws of a contact.

    Attributes:
        contact: Kept at the contact's nodes, by their names.
        strip: Kept on the strip's material.
        of_punch: Which of the first are the punch's, at its temperature; others are at the mean of both surfaces.
        initial: Temperature of strip that is not under the punch, K.
    """

    contact: Mapping[str, State]
    strip: Mapping[str, State]
    of_punch: frozenset[str]
    initial: float = 0.0

    def beginning(self, pair: ContactPair) -> Held:
        """Return the states at the start.

        Raises:
            CaseError: an initial value is not finite somewhere.
        """
        beginnings = []
        for states, surface in ((self.contact, pair.punch), (self.strip, pair.strip)):
            place = {axis: np.asarray(x) for axis, x in zip("xyz", in_space(surface.x).T, strict=True)}
            n = len(surface.x)
            rows = [
                evaluate_of_state(name, state.initial, "xyz", place, (n,))
                if callable(state.initial)
                else np.full(n, float(state.initial))
                for name, state in states.items()
            ]
            beginnings.append(np.array(rows).reshape(len(rows), n))
        return Held(*beginnings)

    @cached_property
    def fills(self) -> tuple[Array, Array]:
        """Gap that a unit of each state of the contact fills (q,), and of the strip (q_s,), mm."""
        contact, strip = (np.array([state.fills for state in states.values()]) for states in (self.contact, self.strip))
        return contact, strip

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Of all states, those of the contact first."""
        return (*self.contact, *self.strip)

    @cached_property
    def states(self) -> tuple[State, ...]:
        """All states, those of the contact first."""
        return (*self.contact.values(), *self.strip.values())

    @cached_property
    def named(self) -> tuple[tuple[str, State], ...]:
        """All states with their names, those of the contact first."""
        return tuple(zip(self.names, self.states, strict=True))

    @cached_property
    def bodies(self) -> tuple[Side, ...]:
        """Whose conditions the rate of each state is at."""
        of_contact: list[Side] = ["punch" if name in self.of_punch else "friction" for name in self.contact]
        return (*of_contact, *(cast(Side, "strip") for _ in self.strip))

    @cached_property
    def rows(self) -> tuple[Mapping[str, int], ...]:
        """The rows of all states at the contact's nodes by name, as the rate of each knows them."""
        contact = {name: row for row, name in enumerate(self.contact)}
        strip = {name: row for row, name in enumerate(self.strip, len(contact))}
        punch_knows, strip_knows = {**strip, **contact}, {**contact, **strip}
        return tuple(strip_knows if body == "strip" else punch_knows for body in self.bodies)

    @cached_property
    def of_wear(self) -> bool:
        """Whether a rate depends on the wear."""
        return any(variable in state.of for state in self.states for variable in WEAR)

    @cached_property
    def filling(self) -> bool:
        """Whether a state fills a part of the gap."""
        return any(bool(fills.any()) for fills in self.fills)

    def known(self, values: Array) -> tuple[Mapping[str, Array], Mapping[str, Array]]:
        """Return the states (Q, n) at the contact's nodes by name, as laws of punch and strip know them."""
        q = len(self.contact)
        contact: dict[str, Array] = dict(zip(self.contact, values[:q], strict=True))
        if not self.strip:
            return contact, contact
        strip: dict[str, Array] = dict(zip(self.strip, values[q:], strict=True))
        return {**strip, **contact}, {**contact, **strip}

    def by_name(self, held: Held) -> dict[str, Array]:
        """Return states by their names (n,), those of the strip's material by `NAME_strip` (n_strip,)."""
        states = {name: np.asarray(row) for name, row in zip(self.contact, held.contact, strict=True)}
        return states | {f"{name}_strip": np.asarray(row) for name, row in zip(self.strip, held.strip, strict=True)}

    def bounded(self, held: Held) -> Held:
        """Return states within their bounds."""
        if not self._bounded:
            return held
        least, most = self._bounds
        contact = np.minimum(np.maximum(held.contact, least.contact), most.contact)
        return Held(contact, np.minimum(np.maximum(held.strip, least.strip), most.strip))

    @cached_property
    def _bounded(self) -> bool:
        """Whether a state has bounds."""
        return any(state.least > -np.inf or state.most < np.inf for state in self.states)

    @cached_property
    def _bounds(self) -> tuple[Held, Held]:
        """The least and the most of all states (q, 1) and (q_s, 1)."""
        both = self.contact.values(), self.strip.values()
        least = Held(*(np.array([state.least for state in states], dtype=float)[:, None] for states in both))
        return least, Held(*(np.array([state.most for state in states], dtype=float)[:, None] for states in both))


FORGETFUL = Memory({}, {}, frozenset())  # of laws that remember nothing


@dataclass(frozen=True)
class Held(Added):
    """States of the contact (q, n) and of the strip (q_s, n_s), or changes of them."""

    contact: Array
    strip: Array

    def at_contact(self, pair: ContactPair) -> Array:
        """Return the states at the contact's nodes (q + q_s, n)."""
        if not len(self.strip):
            return self.contact
        return np.vstack([self.contact, self.strip @ pair.wear_interpolation.T])

    @property
    def size(self) -> Held:
        """Absolute values."""
        return Held(np.abs(self.contact), np.abs(self.strip))

    def small_against(self, other: Held, share: float) -> bool:
        """Return whether each row is at most this share of the largest of another's."""
        return all(
            bool((np.abs(row).max(axis=1, initial=0) <= share * np.abs(all_).max(axis=1, initial=1e-300)).all())
            for row, all_ in ((self.contact, other.contact), (self.strip, other.strip))
        )


@dataclass(frozen=True)
class _Slopes:
    """Square matrices of the states of each node: of the contact (n, q, q) and of the strip (n_s, q_s, q_s)."""

    contact: Array
    strip: Array

    def __add__(self, other: _Slopes) -> _Slopes:
        return _Slopes(self.contact + other.contact, self.strip + other.strip)

    def each(self, function: Callable[[Array], Array]) -> _Slopes:
        """Return a function of both."""
        return _Slopes(function(self.contact), function(self.strip))

    def solve(self, right: Held) -> Held:
        """Return the solution of the equations with this right side."""
        return Held(_solved(self.contact, right.contact), _solved(self.strip, right.strip))


def _solved(matrices: Array, rows: Array) -> Array:
    if not len(rows):
        return rows
    return np.asarray(np.linalg.solve(matrices, rows.T[:, :, None])[:, :, 0].T)


def _phi(z: Array) -> Array:
    """Return (e^z - 1) / z of matrices (n, q, q)."""
    n, q, _ = z.shape
    if q <= 1:
        if z.all():
            return np.asarray(np.expm1(z) / z)
        still = z == 0
        return np.where(still, 1.0, np.expm1(z + still) / (z + still))
    block = np.zeros((n, 2 * q, 2 * q))
    block[:, :q, :q], block[:, :q, q:] = z, np.eye(q)
    return np.asarray(scipy.linalg.expm(block)[:, :q, q:])


def _taken_away(z: Array) -> Array:
    """Return 1 - e^z of matrices (n, q, q)."""
    return -np.einsum("nab,nbc->nac", z, _phi(z))


@dataclass(frozen=True)
class Evolution:
    """Change of the states by phases of the motion, or time steps, one after the other.

    Attributes:
        memory: The states.
        conditions: Of each phase; their own states do not count.
        durations: Of the phases (m,), s.
        pairs: The surfaces opposite each other in each phase.
        worn: Wear of a phase at conditions.
        strip_depth: Worn off the strip (n_s,), mm.
        near: Where steps of many cycles look for their end; by default at their start.
    """

    memory: Memory
    conditions: Sequence[ContactConditions]
    durations: Array
    pairs: Sequence[ContactPair]
    worn: Callable[[int, ContactConditions], PhasesWear]
    strip_depth: Array
    near: Held | None = None

    def at(self, pressure: Array) -> Evolution:
        """Return the evolution at other pressures of the phases (m, n), MPa."""
        pairs = zip(self.conditions, pressure, strict=True)
        return replace(
            self,
            conditions=[replace(condition, pressure=np.asarray(phase_pressure)) for condition, phase_pressure in pairs],
        )

    def some(self, phases: Sequence[int]) -> Evolution:
        """Return the evolution over some of the phases, by their places among these."""
        chosen = list(phases)
        conditions, pairs = [self.conditions[k] for k in chosen], [self.pairs[k] for k in chosen]

        def worn(k: int, conditions: ContactConditions) -> PhasesWear:
            return self.worn(chosen[k], conditions)

        return replace(self, conditions=conditions, durations=self.durations[chosen], pairs=pairs, worn=worn)

    def through(self, start: Held) -> tuple[list[ContactConditions], Held, _Slopes]:
        """Return the conditions of each phase with the states in its middle, the states at the end, and Z.

        Between phases states are bounded, at the end they are as their rates would have them.

        Raises:
            CaseError: a rate fails, or is not finite.
            ConvergenceError: a state changes too fast within a phase.
        """
        if not self.memory.names:
            nothing = (np.zeros((rows.shape[1], 0, 0)) for rows in (start.contact, start.strip))
            return list(self.conditions), start, _Slopes(*nothing)
        q, held, middles, slopes = len(self.memory.contact), start, [], _Slopes(np.zeros(()), np.zeros(()))
        for k, (pair, tau) in enumerate(zip(self.pairs, self.durations, strict=True)):
            begin = held.at_contact(pair)
            middle, end, z = self._over(begin, float(tau), self._under(k))
            middles.append(self.conditions[k].remembering(self.memory.known(middle)))
            strip, z_strip = held.strip, np.zeros((held.strip.shape[1], len(held.strip), len(held.strip)))
            if len(strip):
                onto = pair.wear_projection
                left = 1 - onto @ np.ones(len(pair.weights))
                _, free, z_free = self._over(strip, float(tau), self._beside(k))
                strip = strip + (end - begin)[q:] @ onto.T + left * (free - strip)
                under = (onto @ z[:, q:, q:].reshape(len(z), -1)).reshape(z_strip.shape)
                z_strip = under + left[:, None, None] * z_free
            held = Held(end[:q], strip)
            held = held if k == len(self.pairs) - 1 else self.memory.bounded(held)
            slopes += _Slopes(z[:, :q, :q], z_strip)
        return middles, held, slopes

    def after(self, start: Held) -> Held:
        """Return the states at the end of these phases."""
        return self.memory.bounded(self.through(start)[1])

    def rate(self, start: Held) -> tuple[Held, _Slopes]:
        """Return f and Z of the cycle of these phases."""
        _, end, slopes = self.through(start)
        return slopes.each(_phi).solve(end - start), slopes

    def implicit(self, before: Held, cycles: float) -> Held:
        """Return y = before + cycles f(y).

        Args:
            before: States at the start of a step; they may be out of bounds.
            cycles: Length of the step.

        Raises:
            ConvergenceError: it does not converge; a shorter step may.
        """
        now = self.memory.bounded(self.near or before)
        for _ in range(MOST_STEPS):
            rate, slopes = self.rate(now)
            change = rate.times(cycles)
            missing, scale = before + change - now, now.size + change.size
            if missing.small_against(scale, SETTLED):
                return now
            unit = slopes.each(lambda z: np.eye(z.shape[1]) - cycles * z)
            now, last = self.memory.bounded(now + unit.solve(missing)), now
            if (now - last).small_against(scale, SETTLED):
                return now
        raise ConvergenceError(f"{self._named()} did not converge in a step of {cycles:.3g} cycles. Use smoother rates")

    def around(self, middle: Held, change: Held | None = None) -> list[ContactConditions]:
        """Return the conditions of the phases of the cycle that has these states in its middle.

        Args:
            middle: The states.
            change: Of them in that cycle, where it is known.
        """
        change = self.rate(middle)[0] if change is None else change
        return self.through(self.memory.bounded(middle - change.times(0.5)))[0]

    def rest(self, near: Held) -> Held:
        """Return the states that a cycle leaves as they are.

        Raises:
            ConvergenceError: there are none, or they are not found.
        """
        now, going = near, near
        for stride in (0.0, *STRIDES):
            try:
                now = self.implicit(now, stride) if stride else now
            except ConvergenceError:
                break
            for _ in range(MOST_STEPS):
                _, end, slopes = self.through(now)
                going, away = self.memory.bounded(end) - now, slopes.each(_taken_away)
                if not self._comes_to_rest(going, away):
                    break
                kept = away.each(lambda z: np.where(z == 0, np.eye(z.shape[1]), z))
                now, last = self.memory.bounded(now + kept.solve(going)), now
                if (now - last).small_against(now, SETTLED):
                    return now
        rows = zip(self.memory.names, (*going.contact, *going.strip), strict=True)
        name = next((name for name, row in rows if row.any()), self.memory.names[0])
        raise ConvergenceError(
            f"no cyclic steady state exists: the state {name!r} of a law continues as long as it slides, and nothing "
            "brings it to rest. Follow it by `run`"
        )

    def _comes_to_rest(self, going: Held, away: _Slopes) -> bool:
        """Return whether a cycle reduces a disturbance wherever states still change."""
        pairs = ((going.contact, away.contact), (going.strip, away.strip))
        return all(not bool(((np.diagonal(part, axis1=1, axis2=2).T <= 0) & (rows != 0)).any()) for rows, part in pairs)

    def _named(self) -> str:
        return f"the states {', '.join(self.memory.names)} of laws"

    def _under(self, k: int) -> _Rates:
        """Return the rates at the contact's nodes in a phase."""
        memory, conditions = self.memory, self.conditions[k]

        def worn(values: Array) -> Mapping[str, Array]:
            at = conditions.remembering(memory.known(values))
            rates = [depth[0] / self.durations[k] for depth in self.worn(k, at).by_bodies(at.pressure[None])]
            return dict(zip(WEAR, (sum(rates), *rates), strict=True))

        without = [conditions.of(body) for body in memory.bodies]
        return _Rates.of(memory.named, memory.rows, without, conditions.shape, worn if memory.of_wear else None)

    def _beside(self, k: int) -> _Rates:
        """Return the rates of the strip's states where nothing presses in a phase."""
        memory, strip = self.memory, self.pairs[k].strip
        n, x = len(strip.x), in_space(strip.x)
        none, slid = np.zeros(n), np.full(n, float(np.mean(self.conditions[k].slid)))
        now = {
            "T": np.full(n, memory.initial),
            "p": none,
            "v": none,
            "depth": self.strip_depth,
            "s": slid,
            "debris": none,
            "edge": none,
            "cs": none,
            "pm": none,
            **dict.fromkeys((*WEAR, FILM), none),
            **{axis: np.asarray(coordinate) for axis, coordinate in zip("xyz", x.T, strict=True)},
            **dict.fromkeys(memory.contact, none),
        }
        rows = {name: row for row, name in enumerate(memory.strip)}
        many = len(memory.strip)
        return _Rates.of(tuple(memory.strip.items()), [rows] * many, [now] * many, (n,), None)

    def _over(self, start: Array, tau: float, rates: _Rates) -> tuple[Array, Array, Array]:
        """Return states (Q, n) in the middle and at the end of a time, and the integral of J over it (n, Q, Q)."""
        first = rates(start)
        slope = rates.slope(start, first, tau)
        end = start + _increment(first, _phi(tau * slope), tau)
        for halving in range(1, HALVINGS + 1):
            parts = 2**halving
            dt, now, rate, jacobian = tau / parts, start, first, slope
            growth = _phi(dt * jacobian)
            z, middle = dt * jacobian, start
            for part in range(parts):
                if part:
                    rate = rates(now)
                    if parts > 2:  # else the same, which it is where r is linear
                        jacobian = rates.slope(now, rate, dt)
                        growth = _phi(dt * jacobian)
                    z += dt * jacobian
                now = now + _increment(rate, growth, dt)
                if 2 * (part + 1) == parts:
                    middle = now
            missing, end = now - end, now
            apart, size, gone = _most(np.array([missing, end, end - start]))
            if (apart <= AGREE * (size + gone)).all():
                return middle, end + missing / 3, z
        raise ConvergenceError(f"{self._named()} change too fast within a half-cycle. Use smoother rates")


def _most(values: Array) -> Array:
    """Return the largest of each row without its sign (...,)."""
    return np.asarray(np.maximum.reduce(np.abs(values), axis=-1, initial=0.0))


@dataclass(frozen=True)
class _Rates:
    """The rates of states at nodes, and their derivatives.

    Attributes:
        states: By their names, Q of them.
        given: Variables of each rate that stay constant (n,), by name.
        rows: States that each rate depends on, by name: their rows.
        asked: Variables of each rate.
        worn: Wear rates at states (n,), mm/s, by the names of WEAR; None where no rate asks for them.
    """

    states: Sequence[tuple[str, State]]
    given: Sequence[Mapping[str, Array]]
    rows: Sequence[Mapping[str, int]]
    asked: Sequence[frozenset[str]]
    worn: Callable[[Array], Mapping[str, Array]] | None

    @classmethod
    def of(
        cls,
        states: Sequence[tuple[str, State]],
        rows: Sequence[Mapping[str, int]],
        variables: Sequence[Mapping[str, Array]],
        shape: tuple[int, ...],
        worn: Callable[[Array], Mapping[str, Array]] | None,
    ) -> _Rates:
        """Return rates whose states have these rows and whose variables, of each, are these at nodes."""
        asked = [frozenset((*state.of, name)) for name, state in states]
        moving = () if worn is None else WEAR
        given = [
            {
                name: now[name] if now[name].shape == shape else np.full(shape, now[name])
                for name in names
                if name not in at and name not in moving
            }
            for names, at, now in zip(asked, rows, variables, strict=True)
        ]
        own_rows = [
            {name: row for name, row in at.items() if name in names} for names, at in zip(asked, rows, strict=True)
        ]
        return cls(states, given, own_rows, asked, worn)

    def known(self, values: Array) -> list[Mapping[str, Array]]:
        """Return the variables of each rate at states (Q, n)."""
        worn = {} if self.worn is None else self.worn(values)
        pairs = zip(self.given, self.rows, strict=True)
        return [{**variables, **{name: values[row] for name, row in at.items()}, **worn} for variables, at in pairs]

    def __call__(self, values: Array) -> Array:
        """Return the rates (Q, n) at states (Q, n)."""
        shape = values.shape[1:]
        rows = [
            evaluate_of_state(name, state.rate, asked, now, shape)
            for (name, state), asked, now in zip(self.states, self.asked, self.known(values), strict=True)
        ]
        return rows[0][None] if len(rows) == 1 else np.array(rows).reshape(values.shape)

    def slope(self, values: Array, rate: Array, tau: float) -> Array:
        """Return J (n, Q, Q): as given, else by differences that are small against what states change by in a time."""
        q, n = values.shape
        jacobian = np.zeros((n, q, q))
        for j, (other, state) in enumerate(self.states):
            asked = [i for i, (name, state) in enumerate(self.states) if _feels(name, state, other)]
            if not asked:
                continue
            size = NUDGE * (np.abs(values[j]) + tau * np.abs(rate[j]))
            if not size.all():
                if not size.any():
                    continue
                size = np.where(size > 0, size, size.max())
            if state.most < np.inf:
                size = np.where(values[j] + size > state.most, -size, size)
            moved = values.copy()
            moved[j] += size
            change = (self(moved) - rate) / (moved[j] - values[j])
            for i in asked:
                jacobian[:, i, j] = change[i]
        if any(state.slope is not None for _, state in self.states):
            for i, ((name, state), now) in enumerate(zip(self.states, self.known(values), strict=True)):
                if state.slope is not None:
                    jacobian[:, i, i] = evaluate_of_state(name, state.slope, {*state.of, name}, now, (n,))
        return jacobian


def _feels(name: str, state: State, other: str) -> bool:
    """Return whether the derivative of a state's rate to another one is to be taken by differences."""
    return other in state.of or not set(WEAR).isdisjoint(state.of) or (other == name and state.slope is None)


def _increment(rate: Array, growth: Array, tau: float) -> Array:
    """Return the changes of states in a time, by their rates (Q, n) and phi of tau J (n, Q, Q)."""
    return np.asarray(tau * np.einsum("nab,bn->an", growth, rate))
