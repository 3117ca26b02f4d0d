"""Cycles of contact with stick: time step by time step, with slip, friction's work and wear of every node."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from fenwear.arrays import Array, Mask
from fenwear.sliding.wear import Worn
from fenwear.stick.increment import advance
from fenwear.stick.interface import Position, StickInterface
from fenwear.stick.program import Program, TimeStep
from fenwear.stick.state import Imposed, StickState, untouched
from fenwear.stick.strain import surface_gradient, surface_strain
from fenwear.stick.wear import LocalWear


@dataclass(frozen=True)
class Records:
    """k time steps of n contact nodes, m = d - 1 tangential directions; forces and work per thickness in the plane.

    Attributes:
        displacement: delta of the strip's supports at the end (k,), mm or rad.
        force: Q on the strip (k,), N/mm or N.
        pressure: (k, n), MPa.
        traction: On the punch along the tangents (k, n, m), MPa.
        slip: Of the punch against the strip in the step (k, n, m), mm.
        gap: (k, n), mm.
        work: What rig and loads do in the step (k,), N or N mm.
        stored: What both bodies take up (k,).
        dissipated: Friction's work of each node over its area (k, n), N/mm.
        closing: Work of the pressure on gaps that close or open in the step (k,): of the step's size, it vanishes
            with it.
        punch_depth, strip_depth: Worn off each body in the step, at the contact nodes (k, n), mm.
        strain: Of the strip's surface opposite each node, along and across the sliding (k, n, m).
        iterations: Newton steps (k,).
        unique: Whether the answer was the only one near (k,).
    """

    displacement: Array
    force: Array
    pressure: Array
    traction: Array
    slip: Array
    gap: Array
    work: Array
    stored: Array
    dissipated: Array
    closing: Array
    punch_depth: Array
    strip_depth: Array
    strain: Array
    iterations: Array
    unique: Mask

    def __len__(self) -> int:
        return len(self.force)

    @property
    def slid(self) -> Array:
        """abs(slip) (k, n), mm."""
        return np.linalg.norm(self.slip, axis=2)

    @property
    def sticking(self) -> Mask:
        """Which nodes carry pressure and have not slipped (k, n)."""
        return (self.pressure > 0) & (self.slid == 0)

    def energy(self, weights: Array) -> float:
        """Return what friction has dissipated, N in the plane and N mm in a solid."""
        return float(self.dissipated.sum(axis=0) @ weights)

    def balance_error(self, weights: Array) -> float:
        """Return what is missing in the balance of energy of all steps together, over its largest term."""
        terms = np.array([self.work.sum(), self.stored.sum(), self.energy(weights), self.closing.sum()])
        largest = max(np.abs(self.work).sum(), np.abs(terms).max(), 1e-300)
        return float(abs(terms[0] - terms[1] - terms[2] + terms[3]) / largest)

    @staticmethod
    def joined(parts: Sequence[Records]) -> Records:
        """Return records one after the other."""
        return Records(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Records)))


@dataclass(frozen=True)
class RigState:
    """Where a run is: the contact, what is imposed on it, the worn depths, and the number of the next time step."""

    contact: StickState
    imposed: Imposed
    worn: Worn
    next_step: int = 0


class Rig:
    """Two bodies, what is done to them, and their wear.

    Args:
        interface: The bodies.
        program: Of a cycle.
        wear: By local slip.
        friction: mu (n,).
        watch: Called before every time step: may raise InterruptedRunError.
    """

    def __init__(
        self,
        interface: StickInterface,
        program: Program,
        wear: LocalWear,
        friction: Array,
        watch: Callable[[], None] = lambda: None,
    ) -> None:
        self.interface, self.program, self.wear, self.friction = interface, program, wear, friction
        self.weights, self.watch = interface.middle.pair.weights, watch
        self._gradient = surface_gradient(interface.middle.pair.punch)

    def watched(self, watch: Callable[[], None]) -> Rig:
        """Return the same, watched."""
        return Rig(self.interface, self.program, self.wear, self.friction, watch)

    def unworn(self) -> Worn:
        """Return the worn depths at the start: none."""
        pair = self.interface.middle.pair
        return Worn(np.zeros(len(pair.weights)), np.zeros(len(pair.strip.weights)))

    def beginning(self, shape: Worn | None = None) -> RigState:
        """Return the state in which the first cycle begins: pressed, and moved to its start; collective.

        Args:
            shape: Depths worn before; by default none.

        Raises:
            ConvergenceError: a step did not converge.
        """
        interface, program, worn = self.interface, self.program, shape or self.unworn()
        loaded = interface.loaded(None if program.steps[-1].fraction is None else 0.0)
        opening = self.opening(interface.middle, worn)
        state, before = untouched(interface), Imposed(loaded.times(0), opening)
        for k in range(1, program.pressing + 1):
            imposed = Imposed(loaded.times(k / program.pressing), opening)
            state, before = advance(interface, state, before, imposed, self.friction), imposed
        if program.steps[0].force is not None:
            before = replace(before, displacement=None, force=state.force)
        at = RigState(state, before, worn)
        for step in program.lead_in:
            at, _ = self.step(at, step)
        return replace(at, next_step=0)

    def opening(self, position: Position, worn: Worn) -> Array:
        """Return the gap of the unloaded, worn bodies (n,), mm."""
        return position.pair.initial_gap + position.pair.opening(worn.punch, worn.strip)

    def imposed(self, step: TimeStep, worn: Worn) -> tuple[Position, Imposed]:
        """Return the place of the strip in a time step, and what is imposed at its end; collective."""
        interface = self.interface
        position = interface.position(step.offset)
        loaded = interface.loaded(step.fraction if step.fraction is not None else 0.0)
        return position, Imposed(loaded, self.opening(position, worn), step.displacement, step.force, step.strain)

    def step(self, at: RigState, step: TimeStep) -> tuple[RigState, Records]:
        """Return the state after a time step, and its record; the shape stays."""
        self.watch()
        position, imposed = self.imposed(step, at.worn)
        state = advance(self.interface, at.contact, at.imposed, imposed, self.friction, position)
        number = (at.next_step + 1) % len(self.program.steps)
        return RigState(state, imposed, at.worn, number), self._record(at, state, imposed, position, step)

    def half_cycle(self, at: RigState) -> tuple[RigState, Records]:
        """Return the state at the end of the half-cycle that comes next, and its records; the shape stays."""
        steps, parts = self.program.steps, []
        number = steps[at.next_step].half_cycle
        while steps[at.next_step].half_cycle == number:
            at, record = self.step(at, steps[at.next_step])
            parts.append(record)
            if at.next_step == 0:
                break
        return at, Records.joined(parts)

    def cycle(self, at: RigState) -> tuple[RigState, list[Records]]:
        """Return the state a cycle later and the records of its half-cycles; the shape stays."""
        found = []
        for _ in range(self.program.half_cycles):
            at, records = self.half_cycle(at)
            found.append(records)
        return at, found

    def worn_in(self, records: Records, first: int) -> Worn:
        """Return what the steps of a record wear off both bodies, the first of them that of this number."""
        pair, steps = self.interface.middle.pair, self.program.steps
        strip = np.zeros(len(pair.strip.weights))
        if self.wear.strip is not None:
            places = [steps[(first + k) % len(steps)].offset for k in range(len(records))]
            for place in sorted(set(places)):
                depth = records.strip_depth[[k for k, own in enumerate(places) if own == place]].sum(axis=0)
                strip += self.interface.position(place).pair.deposit @ depth
        return Worn(records.punch_depth.sum(axis=0), strip)

    def _record(self, at: RigState, state: StickState, imposed: Imposed, position: Position, step: TimeStep) -> Records:
        before, weights = at.contact, position.pair.weights
        f = np.concatenate([state.pressure, state.traction.T.ravel()])
        force = position.in_space(f * position.weights)
        back = position.reading.T @ position.pair.placement.back(force)
        stored = np.vdot(force, state.on_punch - before.on_punch) - np.vdot(back, state.on_strip - before.on_strip)
        lowered = float(imposed.loaded.resultant @ (state.rigid - before.rigid))
        work = state.force * (state.displacement - before.displacement) + lowered
        slid = np.linalg.norm(state.slip, axis=1)
        punch, strip = self.wear.depths(state.pressure, slid, step.duration)
        values = (
            state.displacement,
            state.force,
            state.pressure,
            state.traction,
            state.slip,
            state.gap,
            work,
            stored,
            -(state.traction * state.slip).sum(axis=1),
            weights @ (state.pressure * state.approach),
            punch,
            strip,
            surface_strain(position, self._gradient, state.on_strip),
            float(state.iterations),
            state.unique,
        )
        return Records(*(np.asarray(value)[None] for value in values))
