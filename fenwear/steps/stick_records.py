"""Records of time steps of contact with stick: pressure, slip, friction's work, wear and energy; cycles of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace

import numpy as np

from fenwear.common.arrays import Array, Mask
from fenwear.laws.wear import WornDepths
from fenwear.steps.stick_heat import StickHeat
from fenwear.steps.stick_interface import OppositeBodies
from fenwear.steps.stick_position import Position, surface_strain
from fenwear.steps.stick_program import TimeStep
from fenwear.steps.stick_state import NO_HEAT, PartialSlipState


@dataclass(frozen=True)
class TimeStepRecords:
    """k time steps of n contact nodes, m = d - 1 tangential directions; forces and work per thickness in the plane.

    Attributes:
        displacement: delta of the strip's supports at the end (k,), mm or rad.
        force: Q on the strip (k,), N/mm or N.
        pressure: (k, n), MPa.
        traction: On the punch along the tangents (k, n, m), MPa.
        slip: Of the punch against the strip in the step (k, n, m), mm.
        gap: (k, n), mm.
        work: Work of rig and loads in the step (k,), N or N mm.
        stored: Energy that both bodies store, or lose in creep (k,).
        dissipated: Friction's work of each node over its area (k, n), N/mm.
        closing: Work of the pressure on gaps that close or open in the step (k,): of the step's size, it vanishes
            with it.
        strain: Of the strip's surface opposite each node, along and across the sliding (k, n, m).
        iterations: Newton steps (k,).
        unique: Whether the answer was the only one near (k,).
        duration: s (k,).
        heat: Terms of the balance of heat (k, 8), mJ, as `heat.exchange.TERMS` and `CROSSING`; (k, 0) without heat, as
            the next two.
        temperature: Of both contact surfaces, punch and strip, at the end (k, 2, n), K.
        conductance: Of each node (k, n), N/(mm s K); NaN where none conducts.
        coupling: Iterations of contact and heat (k,); 0 without heat.
        rigid: Amplitudes of the rigid modes at the end (k, r).
        flowed: Depth that the surfaces have flown beyond the hardness (k, n), mm.
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
    strain: Array
    iterations: Array
    unique: Mask
    duration: Array
    heat: Array
    temperature: Array
    conductance: Array
    coupling: Array
    rigid: Array
    flowed: Array

    def __len__(self) -> int:
        return len(self.force)

    @property
    def slip_magnitude(self) -> Array:
        """abs(slip) (k, n), mm."""
        return np.linalg.norm(self.slip, axis=2)

    @property
    def sticking(self) -> Mask:
        """Which nodes carry pressure and have not slipped (k, n)."""
        return (self.pressure > 0) & (self.slip_magnitude == 0)

    @property
    def stuck(self) -> Mask:
        """Which nodes stick in all steps (n,)."""
        return np.asarray(self.sticking.all(axis=0))

    @property
    def touched(self) -> Mask:
        """Which nodes carry pressure in any step (n,)."""
        return np.asarray((self.pressure > 0).any(axis=0))

    def slip_amplitude(self, weights: Array, half_cycles: int) -> float:
        """Return the mean slip of the surfaces to each side in steps of so many half-cycles, mm.

        The pressure weights the mean: where nodes stick, the strip's surface moves with the punch's.
        """
        carried = np.maximum(self.pressure @ weights, 1e-300)
        return float(((self.pressure * self.slip_magnitude) @ weights / carried).sum()) / (2 * half_cycles)

    def energy(self, weights: Array) -> float:
        """Return the energy that friction has dissipated, N in the plane and N mm in a solid."""
        return float(self.dissipated.sum(axis=0) @ weights)

    def balance_error(self, weights: Array) -> float:
        """Return the error in the energy balance of all steps together, over its largest term."""
        terms = np.array([self.work.sum(), self.stored.sum(), self.energy(weights), self.closing.sum()])
        largest = max(np.abs(self.work).sum(), np.abs(terms).max(), 1e-300)
        return float(abs(terms[0] - terms[1] - terms[2] + terms[3]) / largest)

    @staticmethod
    def joined(parts: Sequence[TimeStepRecords]) -> TimeStepRecords:
        """Return records one after the other."""
        return TimeStepRecords(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(TimeStepRecords)))


@dataclass(frozen=True)
class FrettingCycle:
    """A cycle at the shape that so many cycles have worn.

    Attributes:
        number: Of cycles done before it.
        worn: Depths at its shape.
        half_cycles: Records of its half-cycles.
        rate: Depths that a cycle wears there.
        error: Estimated error of the jump that led there, 0 where there was none: of its depths over what it wore, or
            of the contact temperatures over the warmest if that is more.
        first_step: Number of the time step that its records begin with.
        end: State at its end, with the slip from the start to its middle. The next step follows from it.
        length: Cycles of the next jump, as wished; below 1 a part of one.
        warm: Temperatures at the start of its records (dim,); empty without heat.
        finer: Depths to which jumps of next to no length would have led, to the next order; None where nobody asks.
    """

    number: float
    worn: WornDepths
    half_cycles: list[TimeStepRecords]
    rate: WornDepths
    error: float
    first_step: int
    end: PartialSlipState
    length: float = 1
    warm: Array = field(default_factory=lambda: NO_HEAT)
    finer: WornDepths | None = None

    @property
    def records(self) -> TimeStepRecords:
        """All time steps."""
        return TimeStepRecords.joined(self.half_cycles)

    @property
    def begin(self) -> PartialSlipState:
        """State in which its records begin."""
        slid = self.end.slid - self.records.slip_magnitude.sum(axis=0) / 2
        at = replace(self.end, worn=self.worn, held=None, temperature=self.warm)
        return replace(at, next_step=self.first_step, slid=slid)


def record(
    interface: OppositeBodies,
    heat: StickHeat | None,
    at: PartialSlipState,
    after: PartialSlipState,
    step: TimeStep,
) -> TimeStepRecords:
    """Return the record of a time step.

    Args:
        interface: The bodies.
        heat: Of friction; None without.
        at, after: The states at its start and end.
        step: Loads and motions of the step.
    """
    state, position = after.contact, interface.position(step.offset)
    weights, (work, stored) = position.pair.weights, _work(interface, position, at, after)
    values = (
        state.displacement,
        state.force,
        state.pressure,
        state.traction,
        state.slip,
        state.gap,
        work,
        stored,
        state.heat,
        weights @ (state.pressure * state.approach),
        surface_strain(position, interface.gradient, state.on_strip),
        float(state.iterations),
        state.unique,
        step.duration,
        *_of_heat(heat, at, after),
        float(after.coupling),
        state.rigid,
        state.flowed,
    )
    return TimeStepRecords(*(np.asarray(value)[None] for value in values))


def _work(
    interface: OppositeBodies, position: Position, at: PartialSlipState, after: PartialSlipState
) -> tuple[float, float]:
    """Return the work of rig and loads in a time step at a place of the strip, and the energy stored in both bodies."""
    before, state = at.contact, after.contact
    f = np.concatenate([state.pressure, state.traction.T.ravel()])
    force, back = position.forces(f)
    on_punch, on_strip = state.on_punch - before.on_punch, state.on_strip - before.on_strip
    layers, closure = interface.layers, interface.layers.closure_at(position.pair, at.worn)
    closed = layers.given(state.pressure, closure) - layers.given(before.pressure, closure)
    if interface.creep.creeps:
        crept = zip(*map(interface.creep.displaced, (state.crept, before.crept)), strict=True)
        on_punch, on_strip, closed = (
            own + now - had for own, (now, had) in zip((on_punch, on_strip, closed), crept, strict=True)
        )
    stored = float(np.vdot(force, on_punch) - np.vdot(back, on_strip))
    lowered = float(after.imposed.loaded.resultant @ (state.rigid - before.rigid))
    work = state.force * (state.displacement - before.displacement) + lowered
    carried = position.beside(state.beside) - position.beside(before.beside)
    work += float((f * position.weights) @ carried)
    return work, stored + float(position.pair.weights @ (state.pressure * closed))


def _of_heat(heat: StickHeat | None, at: PartialSlipState, after: PartialSlipState) -> tuple[Array, Array, Array]:
    """Return the terms of the heat, the contact temperatures, and the conductances; empty without heat."""
    if heat is None:
        return NO_HEAT, np.zeros((2, 0)), NO_HEAT
    warm, terms = heat.step(at.next_step, at.temperature, after.heating, after.conductance)
    return terms, np.array(heat.exchange.contact_temperatures(warm, at.next_step)), after.conductance
