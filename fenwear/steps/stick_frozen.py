"""A cycle with stick whose nodes slip as they did in the last one, whatever they carry: the implicit part of a jump.

With the slip of each time step of a cycle frozen, what it wears follows from its pressures alone, as in gross sliding:
the wear of many cycles stands in one inequality with all its contacts. One contact serves time steps in one place of
the strip under the same loads: in each of them a node carries the share of its pressure that it had. Gaps are offset so
that the pressures of the cycle itself are the solution where nothing more is worn.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fenwear.common.arrays import Array
from fenwear.contact import CondensedContact, ContactState, SlidingContact
from fenwear.laws.layer_step import LayerStep
from fenwear.laws.wear import WornDepths
from fenwear.steps.stick_creep import CreepNear, opened_by_creep
from fenwear.steps.stick_cycle import PartialSlipProblem
from fenwear.steps.stick_position import Position
from fenwear.steps.stick_records import FrettingCycle


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
        return np.array([np.einsum("k...n,kn->...n", slopes[own], self.share[own]) for own in members])


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
        found = self.step.local(self.groups.pressure(pressure))
        return None if found is None else self.groups.summed(found)

    def by_body(self, pressure: Array) -> tuple[Array | None, Array | None]:
        """Return the openings by unit pressures at the punch's nodes, and on the strip's (m, n), mm/MPa."""
        both = self.step.by_body(self.groups.pressure(pressure))
        punch, strip = (None if one is None else self.groups.summed(one) for one in both)
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
        found, first = self.step.layer(self.groups.pressure(pressure)), self.groups.first
        return None if found is None else found[first] * self.groups.share[first]


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
        self._passing = problem.losses.over(records, cycle.begin)
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
    interface, steps, records = problem.interface, problem.program.steps, cycle.records
    own = [steps[(cycle.first_step + k) % len(steps)] for k in range(len(records))]
    keys = [
        (step.offset if interface.moves else 0.0, id(interface.loaded(step.fraction)), None if step.way is None else k)
        for k, step in enumerate(own)
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
    places = [interface.position(own[k].offset if interface.moves else 0.0) for k in first]
    rigid = np.zeros((len(first), interface.middle.modes.shape[1]))
    return places, Groups(of, first, share), ContactState(mean, gap, rigid, 0)
