"""Cycle jumps in partial slip: many cycles in one implicit-explicit step.

A cycle at a fixed shape y, after half a cycle that makes it forget the shape before, wears F(y) off both
bodies, so that dy/dn = F(y) over the number n of cycles. Where the strip passes it takes many cycles to forget: there
the contact runs in at y over as many cycles as the jump has, or until one ends as it begins.
With M(y) the wear of a cycle whose nodes slip as in the last one (`Frozen`), and R = F - M what cycles do beside
it, a jump is that of `fenwear.steps.jump_method`, as in gross sliding, where nothing is beside M.

R is known from the cycle at the begin and one halfway, to which a first step with R as it is at the begin leads. A
second step starts there; the cycle at its end begins the next jump. The error has two
parts: of M a third of the difference to one step over the whole jump, and of R Simpson's rule against the line, each as
the last stage damps it.

Layers change with the depths: y has their state, too. Coated bodies wear through the coating that is left where a step
begins, and below it the base. No depth decreases. A cycle whose error is too large goes in parts, of which each is
such a jump: N is below 1. Loads that change are those of each cycle's own time.

With heat the temperatures go over the jump by one implicit Euler step with the heat of the cycle at its end, which
is computed again until both belong together; the trapezoidal rule gives its error, too, over the warmest contact.

A cycle with stick whose nodes slip as they did in the last one, whatever they carry: the implicit part of a jump.

With the slip of each time step of a cycle frozen, what it wears follows from its pressures alone, as in gross sliding:
the wear of many cycles stands in one inequality with all its contacts. One contact serves time steps in one place of
the strip under the same loads: in each of them a node carries the share of its pressure that it had. Gaps are offset so
that the pressures of the cycle itself are the solution where nothing more is worn.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from fenwear.common.arrays import Array
from fenwear.common.errors import ConvergenceError
from fenwear.contact import CondensedContact, ContactState, SlidingContact
from fenwear.laws.law_states import Held
from fenwear.laws.layer_step import LayerStep
from fenwear.laws.wear import WornDepths
from fenwear.steps.jump_method import FINE, HALVES, Attempt, Estimate, JumpLaw, Lengths, Moment, Sizes, attempt
from fenwear.steps.stick_creep import CreepNear, opened_by_creep
from fenwear.steps.stick_cycle import PartialSlipProblem
from fenwear.steps.stick_heat import CycleMap, StickHeat
from fenwear.steps.stick_position import Position
from fenwear.steps.stick_state import NO_HEAT, FrettingCycle, PartialSlipState, TimeStepRecords


@dataclass(frozen=True)
class Groups:
    """Time steps that share a contact.

    Attributes:
        of: The contact of each time step (k,).
        first: The first time step of each contact (m,).
        share: Pressure of each time step over that of its contact (k, n).
    """

    of: NDArray[np.int64]
    first: NDArray[np.int64]
    share: Array

    def pressure(self, pressure: Array) -> Array:
        """Return the pressures of the time steps (k, n) by those of the contacts (m, n)."""
        return np.asarray(self.share * pressure[self.of])

    def summed(self, slopes: Array) -> Array:
        """Return derivatives to the pressures of the time steps (k, ..., n) as those to the contacts' (m, ..., n)."""
        members = [self.of == contact for contact in range(len(self.first))]
        return np.array([np.einsum("k...n,kn->...n", slopes[group], self.share[group]) for group in members])


@dataclass(frozen=True)
class GroupedStep:
    """Gap that the pressures of time steps open in a step of many cycles, as a compliance of their contacts."""

    step: LayerStep
    groups: Groups

    def opening(self, pressure: Array) -> Array:
        """Return the gap opened in each contact (m, n), mm."""
        return self.step.opening(self.groups.pressure(pressure))[self.groups.first]

    def local(self, pressure: Array) -> Array | None:
        """Return the gap that unit pressures open at their own nodes (m, n), mm/MPa; None where others open, too."""
        opened = self.step.local(self.groups.pressure(pressure))
        return None if opened is None else self.groups.summed(opened)

    def by_body(self, pressure: Array) -> tuple[Array | None, Array | None]:
        """Return the openings by unit pressures at the punch's nodes, and on the strip's (m, n), mm/MPa."""
        both = self.step.by_body(self.groups.pressure(pressure))
        punch, strip = (None if opened is None else self.groups.summed(opened) for opened in both)
        return punch, strip

    def border(self, pressure: Array) -> tuple[Array, Array]:
        """Return L (m, n, q) and R (m, q, n) of the derivative L_k R_j."""
        left, right = self.step.border(self.groups.pressure(pressure))
        return left[self.groups.first], self.groups.summed(right)

    @property
    def curved(self) -> bool:
        """Whether a layer has a closure that is not linear."""
        return self.step.curved

    def layer(self, pressure: Array) -> Array | None:
        """Return the gap that unit pressures open at their own nodes in their own contact alone (m, n)."""
        opened, first = self.step.layer(self.groups.pressure(pressure)), self.groups.first
        return None if opened is None else opened[first] * self.groups.share[first]


class Frozen:
    """The cycle, for steps of many like it.

    Args:
        problem: The bodies and what is done to them.
        cycle: Whose slip it has.

    Attributes:
        contact: That of the cycle itself.
    """

    def __init__(self, problem: PartialSlipProblem, cycle: FrettingCycle) -> None:
        self.problem, records, interface = problem, cycle.records, problem.interface
        self._duration = records.duration / records.duration.sum()
        self.positions, self.groups, self.contact = _grouped(problem, cycle)
        pressure = self.contact.pressure
        self._passing = problem.passing(records, cycle.begin)
        phases, offsets = [], []
        closed = LayerStep(self._passing, cycle.worn, None, implicit=False).opening(self.groups.pressure(pressure))
        for k, (position, first) in enumerate(zip(self.positions, self.groups.first, strict=True)):
            p, gap = pressure[k], self.contact.gap[k]
            rigid = position.rigid
            rigid = replace(rigid, resultant=-rigid.equilibrium(0.0) @ p)
            surfaces = replace(position.interface, rigid=rigid, frame=None, like=None)
            bent = position.compliance.apply(np.concatenate([p, np.zeros(len(position.weights) - len(p))]))[: len(p)]
            phases.append(SlidingContact(surfaces, np.zeros_like(rigid.pair.normal)))
            offsets.append(gap - bent - closed[first] - problem.opening(position, cycle.worn) - surfaces.load_gap)
        self._offset = np.array(offsets)
        self._solver = CondensedContact(phases, team=interface.team)
        period, self._crept = problem.program.period, cycle.worn.crept
        self._creep = CreepNear(interface.creep, interface.middle, period, self._crept, cycle.rate.crept)
        self._mean = self._duration @ self.groups.pressure(pressure)

    def stage(self, before: WornDepths, cycles: float, near: ContactState) -> tuple[WornDepths, ContactState]:
        """Return depths z = before + cycles M(z), and their contact.

        Args:
            before: Depths.
            cycles: Number.
            near: Where the contact is looked for.

        Raises:
            ConvergenceError: it is not found.
        """
        self.problem.watch()
        gap = np.array([self.problem.opening(position, before) for position in self.positions]) + self._offset
        step = self._passing.step(before, cycles)
        gap = gap + self._opened(self._creep.after(before.crept, cycles, -self._mean))
        coupling = self._coupling(cycles) if self.problem.interface.creep.creeps else None
        contact = self._solver.solve(gap, near, None if step is None else GroupedStep(step, self.groups), coupling)
        pressure = self.groups.pressure(contact.pressure)
        crept = self._creep.after(before.crept, cycles, self._duration @ pressure - self._mean)
        worn = self.worn(contact, before, cycles)
        return replace(before + worn.times(cycles), crept=crept), contact

    def _opened(self, crept: Array) -> Array:
        """Return the gap (m, n) that a state of creep opens beside that of the cycle, mm."""
        creep, away = self.problem.interface.creep, crept - self._crept
        return np.array([opened_by_creep(position, creep, away) for position in self.positions])

    def _coupling(self, cycles: float) -> Array:
        """Return the gap (m, n, m, n) that unit pressures open by creep in a step, mm/MPa."""
        by_mean = self._creep.coupling(cycles)
        of_time = self.groups.summed(np.repeat(self._duration[:, None], len(by_mean), axis=1))
        return np.broadcast_to(by_mean[None, :, None, :] * of_time[None, None], (len(of_time), len(by_mean)) * 2).copy()

    def rate(self, contact: ContactState, worn: WornDepths) -> WornDepths:
        """Return M, by how much depths change in a cycle with this contact."""
        crept = self._creep.rate(worn.crept, self._duration @ self.groups.pressure(contact.pressure) - self._mean)
        return replace(self.worn(contact, worn, 0.0), crept=crept)

    def worn(self, contact: ContactState, before: WornDepths, cycles: float) -> WornDepths:
        """Return the wear of each of so many cycles with this contact, from depths on; with 0 cycles the rate."""
        return self._passing.worn(self.groups.pressure(contact.pressure), before, cycles)


def _grouped(problem: PartialSlipProblem, cycle: FrettingCycle) -> tuple[list[Position], Groups, ContactState]:
    """Return the places of contacts, which time steps share them, and the contacts: means of the steps."""
    interface, records = problem.interface, cycle.records
    time_steps = problem.program.following(cycle.first_step, len(records))
    keys = [
        (step.offset if interface.moves else 0.0, id(interface.loaded(step.fraction)), None if step.way is None else k)
        for k, step in enumerate(time_steps)
    ]
    pressure = np.maximum(records.pressure, 0.0)
    touching: NDArray[np.bool_] = np.any(pressure, axis=1)
    touching = touching if touching.any() else ~touching  # one that is open all through a time step needs no contact
    first_key = keys[int(touching.argmax())]
    keys = [key if touching[k] else first_key for k, key in enumerate(keys)]
    known = {key: number for number, key in enumerate(dict.fromkeys(keys))}
    of = np.array([known[key] for key in keys])
    first = np.array([next(k for k in np.flatnonzero(touching) if of[k] == number) for number in range(len(known))])
    members = [(of == k) & touching for k in range(len(first))]
    mean = np.array([pressure[some].mean(axis=0) for some in members])
    gap = np.where(mean > 0, 0.0, [records.gap[some].mean(axis=0) for some in members])
    share = np.divide(pressure, mean[of], out=np.ones_like(pressure), where=mean[of] > 0)
    share[~touching] = 0.0
    places = [interface.position(time_steps[k].offset if interface.moves else 0.0) for k in first]
    rigid = np.zeros((len(first), interface.middle.modes.shape[1]))
    return places, Groups(of, first, share), ContactState(mean, gap, rigid, 0)


MOST_HEATINGS, SAME_HEAT = 20, 1e-6  # cycles that a jump's temperatures take; their change, over the warmest
TOO_LARGE = "wear of many cycles overflows. Reduce the wear coefficient"
REST = 1e-3  # of all depths: near the end of wear, errors are no longer measured by what a jump wears alone
MOST_RUN_IN, CLOSED = 20, 1e-3  # cycles until one closes; its change of tractions, over all of them
SHORTEST = 1 / 256  # of a cycle: the shortest part of one


def jumped(
    problem: PartialSlipProblem,
    now: FrettingCycle,
    cycles: int,
    tolerance: float,
    load: Callable[[float], float] = lambda _: 1.0,
    fits: Callable[[FrettingCycle], bool] = lambda _: True,
) -> FrettingCycle:
    """Return the cycle after the next jump that is accurate enough: of many cycles, or of one in parts.

    Args:
        problem: The bodies and what is done to them.
        now: The cycle to continue from.
        cycles: Number in all.
        tolerance: Largest estimated error of one jump.
        load: Factor of all loads after so many cycles.
        fits: Whether the nodes suffice for the cycle after it: it is halved where they do not.

    Raises:
        ConvergenceError: the shortest part of a cycle did not converge.
    """
    begin, length, error, lengths = now, now.length, 0.0, Lengths(tolerance, SHORTEST)

    def left(length: float) -> float:
        return cycles - begin.number if now is begin and length >= 1 else begin.number + 1 - now.number

    def made(tried: float) -> tuple[FrettingCycle, Estimate]:
        nonlocal now
        if tried < 1 and now is begin and problem.interface.moves:  # parts of a cycle begin with what has run in by it
            again = _cycle_after(problem, begin, begin.end, begin.worn, begin.number, 1)
            now = replace(again, worn=begin.worn, finer=begin.finer)
        return _attempt(problem, now, tried, load, begin)

    while True:
        then, estimate, _, length = lengths.accepted(length, left, made, fits)
        error = max(error, estimate.largest)
        if then.number > begin.number + 1 - SHORTEST / 2:
            return replace(then, number=round(then.number), length=length, error=error)
        now = then


def first_cycle(
    problem: PartialSlipProblem, at: PartialSlipState, worn: WornDepths, number: float, warm: Array = NO_HEAT
) -> FrettingCycle:
    """Return the cycle at a shape from which jumps continue, with its temperatures at its start (dim,).

    Raises:
        ConvergenceError: a time step did not converge.
    """
    led, heat = _led_to(problem, at, worn, 1), problem.heat
    if heat is not None:
        led = replace(led, temperature=warm if len(warm) else heat.initial())
    return _recorded(problem, led, at.slid, worn, number)


def _led_to(problem: PartialSlipProblem, at: PartialSlipState, worn: WornDepths, cycles: int) -> PartialSlipState:
    """Return the state at a shape from which the last of so many cycles there begins.

    Slip, distance and states of laws are those of a cycle whose middle is `at`. Where the strip passes, the contact
    runs in from cycle to cycle until they close. Elsewhere it forgets within one, or half a one where nothing else
    changes in a cycle.
    """
    program, interface, slid, half = problem.program, problem.interface, at.slid, np.zeros_like(at.slid)
    layers, memory = interface.layers, interface.layers.memory
    at = problem.shaped(at, layers.flown_as(worn, at.worn))
    middle, before = layers.held(at.worn), at

    def begun(before: PartialSlipState, after: PartialSlipState) -> Held:
        return memory.bounded(middle - ((after.held or middle) - (before.held or middle)).times(0.5))

    if interface.moves:
        for _ in range(min(cycles - 1, MOST_RUN_IN)):
            before = at
            at, _ = problem.cycle(at)
            half = (at.slid - before.slid) / 2
            last = at.contact.traction
            if np.abs(last - before.contact.traction).sum() <= CLOSED * np.abs(last).sum():
                break
        return replace(at, slid=slid - half, held=begun(before, at))
    # What goes to and fro in a cycle is its own; what laws know of a whole one is of the shape before.
    constant = not memory.names and not interface.creep.creeps and not problem.asks_cycle
    if program.half_cycles == 2 and constant and problem.heat is None:
        at, _ = problem.half_cycle(at)
        return replace(at, slid=2 * slid - at.slid)
    after, _ = problem.cycle(at)
    return replace(after, slid=slid - (after.slid - slid) / 2, held=begun(at, after))


def _cycle_after(
    problem: PartialSlipProblem,
    before: FrettingCycle,
    at: PartialSlipState,
    worn: WornDepths,
    number: float,
    cycles: int,
) -> FrettingCycle:
    """Return the cycle at a shape, with the temperatures that the cycles since one before lead to.

    Args:
        problem: The bodies and what is done to them.
        before: The last whole cycle.
        at: Where the time steps are, so many cycles earlier.
        worn: Depths.
        number: Number of the cycle.
        cycles: Run there, of which it is the last.

    Raises:
        ConvergenceError: a time step did not converge, or contact and temperatures over the jump did not.
    """
    led, heat, slid = _led_to(problem, at, worn, cycles), problem.heat, at.slid
    if heat is None:
        return _recorded(problem, led, slid, worn, number)
    since, rate = number - before.number, before.end.temperature - before.warm
    if since <= 1:  # nothing is jumped over: the temperatures go to those after the cycle before
        return _recorded(problem, replace(led, temperature=before.warm + since * rate), slid, worn, number)
    warm = _through(heat, before).after(before.warm, since)
    for _ in range(MOST_HEATINGS):
        cycle = _recorded(problem, replace(led, temperature=warm), slid, worn, number)
        over = _through(heat, cycle)
        again = over.after(before.warm, since)
        warmest = float(np.abs(heat.surfaces(again)).max())
        if np.abs(heat.surfaces(again) - heat.surfaces(warm)).max() <= SAME_HEAT * warmest:
            wrong = heat.exchange.contact_changes(over.error(before.warm, again, rate, since))
            return replace(cycle, error=float(np.abs(wrong).max() / max(warmest, 1e-300)))
        warm = again
    raise ConvergenceError(f"the temperatures of a jump did not settle in {MOST_HEATINGS} cycles")


def _recorded(
    problem: PartialSlipProblem, at: PartialSlipState, slid: Array, worn: WornDepths, number: float
) -> FrettingCycle:
    """Return the cycle at a shape from a state; its nodes have slid so far (n,), mm, in its middle."""
    layers, creep = problem.interface.layers, problem.interface.creep
    begin = replace(problem.shaped(at, layers.flown_as(worn, at.worn)), held=at.held)
    first, warm = begin.next_step, begin.temperature
    at, parts = problem.cycle(begin)
    records = TimeStepRecords.joined(parts)
    rate = problem.passing(records, begin).worn(records.pressure, begin.worn, 0.0)
    rate = replace(rate, crept=creep.rate(worn.crept, at.contact.crept, problem.program.period))
    end = replace(at, slid=slid)
    return FrettingCycle(number, layers.flown_as(worn, at.worn), parts, rate, 0.0, first, end, warm=warm)


def _through(heat: StickHeat, cycle: FrettingCycle) -> CycleMap:
    """Return the map of temperatures by the heat of a cycle that begins with the first time step."""
    records = cycle.records
    return heat.through(records.dissipated / records.duration[:, None], records.conductance)


@dataclass(frozen=True)
class _Moment(Moment):
    """The end of a stage, and where it began and how many cycles it was long."""

    begin: WornDepths
    length: float = 0.0


class _Jump(JumpLaw[_Moment]):
    """Data of the law for a jump from a cycle; temperatures continue from those of the last whole cycle."""

    def __init__(
        self, problem: PartialSlipProblem, now: FrettingCycle, load: Callable[[float], float], full: FrettingCycle
    ) -> None:
        self.problem, self._now, self._load, self._full = problem, now, load, full
        self._layers, self._frozen = problem.interface.layers, Frozen(problem, now)
        self.begin = _Moment(now.worn, self._frozen.contact, 0.0, now.worn)
        self._first = self._beside(now, self.begin)
        self._bend = self._first.times(0.0)  # R is their line
        self._middle = self.then = now  # the cycles halfway and at the end

    def depths(self, worn: WornDepths) -> WornDepths:
        """Return the depths of a moment, no thickness below zero."""
        return self._layers.settled(self._layers.bounded(worn))

    def stage(
        self,
        before: _Moment,
        cycles: float,
        time: float,
        near: ContactState,
        digits: float,  # noqa: ARG002
    ) -> _Moment:
        """Return z = before + cycles (M(z) + R(time)); to all digits."""
        begin = before.worn + self._at(time).times(cycles)
        worn, contact = self._frozen.stage(self._layers.bounded(begin), cycles, near)
        return _Moment(worn, contact, time, begin, cycles)

    def after(self, before: _Moment, stage: _Moment, cycles: float) -> _Moment:
        """Return before + cycles (M + R), at the rate of a stage."""
        rate = (stage.worn - stage.begin).times(1 / stage.length)
        through = self._frozen.worn(stage.contact, before.worn, cycles)  # coatings as thick as they are there
        rate = replace(rate, punch=through.punch, strip=through.strip) + self._at(stage.time)
        return replace(stage, worn=before.worn + rate.times(cycles))

    def settled(self, end: _Moment) -> _Moment:
        """Return the end of a step, without depths below those at the begin of the jump."""
        (punch, strip), first = (end.worn.punch, end.worn.strip), self.begin.worn
        worn = replace(end.worn, punch=np.maximum(punch, first.punch), strip=np.maximum(strip, first.strip))
        return replace(end, worn=worn)

    def halfway(self, half: _Moment, cycles: float) -> _Moment:
        """Return the state halfway with R as it is found there, in place of that at the begin all the way."""
        self._middle = self._cycle(half, cycles / 2)
        self._bend = (self._beside(self._middle, half) - self._first).times(2 / cycles)
        return self.settled(replace(half, worn=half.worn + self._bend.times(cycles**2 / 8)))

    def ended(self, end: _Moment, cycles: float) -> None:
        """Take the cycle at the end of a jump."""
        self.then = self._cycle(end, cycles)

    def estimate(self, made: Attempt[_Moment]) -> tuple[Estimate, WornDepths]:
        """Return the error of a jump, and its remainder with R, by Simpson's rule."""
        end, interface = made.end, self.problem.interface
        curved = self._beside(self.then, end) - self._at(made.cycles)
        start = replace(end, worn=end.begin - self._at(end.time).times(end.length) + curved.times(made.cycles / 6))
        missed = end.worn - self.stage(start, end.length, end.time, end.contact, FINE).worn
        opened = partial(opened_by_creep, interface.middle, interface.creep)
        begin, full, last = (self.depths(moment.worn) for moment in (made.begin, made.full, end))
        parts = (full - last).times(HALVES), missed
        sizes = Sizes(self._layers, interface.middle.pair, opened, REST)
        of_heat = max(self._middle.error, self.then.error)
        return sizes.estimate((begin, last), made, parts, of_heat), missed

    def _at(self, time: float) -> WornDepths:
        """Return R after so many cycles of the jump."""
        return self._first + self._bend.times(time)

    def _beside(self, cycle: FrettingCycle, at: _Moment) -> WornDepths:
        """Return R of a cycle at the end of a stage.

        Raises:
            ConvergenceError: it is beyond all numbers.
        """
        rate = cycle.rate
        if not all(
            np.isfinite(part).all() for part in (rate.punch, rate.strip, rate.between, rate.carried, rate.crept)
        ):
            raise ConvergenceError(TOO_LARGE)
        return rate - self._frozen.rate(at.contact, cycle.worn)

    def _cycle(self, end: _Moment, done: float) -> FrettingCycle:
        """Return the cycle so many later, at the end of a step.

        It continues from the last one of the jump; but where not a whole cycle lies between them, from the last whole
        one, as all its parts do.
        """
        now, full, last = self._now, self._full, self._middle
        worn = _balanced(self.problem, now.worn, self.depths(end.worn))
        number = now.number + done
        cycles = max(1, int(number - full.number)) - max(int(last.number - full.number), int(last is not full))
        after = last if cycles else full
        slid = now.end.slid + done * now.records.slip_magnitude.sum(axis=0)
        at = replace(after.end, slid=slid, load=self._load(number))
        return _cycle_after(self.problem, full, at, worn, number, max(cycles, 1))


def _attempt(
    problem: PartialSlipProblem,
    now: FrettingCycle,
    cycles: float,
    load: Callable[[float], float],
    begin_of_heat: FrettingCycle,
) -> tuple[FrettingCycle, Estimate]:
    """Return the cycle after a jump, and its error; temperatures continue from those of the last whole cycle."""
    law = _Jump(problem, now, load, begin_of_heat)
    made = attempt(law, law.begin, cycles)
    estimate, missed = law.estimate(made)
    finer = None
    if now.finer is not None:
        fine = law.begin if now.finer is now.worn else replace(law.begin, worn=now.finer)
        finer = law.depths(made.finer(law, fine).worn - missed)
    return replace(law.then, finer=finer), estimate


def _balanced(problem: PartialSlipProblem, before: WornDepths, after: WornDepths) -> WornDepths:
    """Return depths whose ejected debris is what was worn and does not lie there, to rounding.

    Else it would not be where depths are kept from falling, or coatings end. Ejected debris opens nothing: what is
    missing of it is spread evenly.
    """
    layers, pair = problem.interface.layers, problem.interface.middle.pair
    if not layers.debris.present:
        return after
    change = after - before
    worn = pair.weights @ change.punch + pair.strip.weights @ change.strip
    if layers.strip_carries:
        weights, changed, state = pair.strip.weights, change.carried, after.carried.copy()
    else:
        weights, changed, state = pair.weights, change.between, after.between.copy()
    state[1] += (worn - float(weights @ changed[:2].sum(axis=0))) / weights.sum()
    return layers.with_debris(after, state)
