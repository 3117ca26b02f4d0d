"""Contact with stick: loads and motions of a time step, the state at its end, the place of a run, records of cycles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fenwear.common.arrays import Array, Mask
from fenwear.laws.compliant_layer import Closure
from fenwear.laws.law_states import Held
from fenwear.laws.wear import STIFF, WornDepths
from fenwear.steps.stick_position import LoadEffect

NO_HEAT: Array = np.zeros(0)  # of bodies whose temperatures stay
NO_SHIFT: Array = np.zeros((1, 1))  # of any node along any axis


@dataclass(frozen=True)
class Imposed:
    """Loads and motions at the end of a time step.

    Attributes:
        loaded: The loads.
        opening: Initial gap and worn depths (n,), mm.
        displacement: delta of the strip's supports along the motion, mm or rad; None where the force is imposed.
        force: Tangential force on the strip along the motion, N/mm or N; None where the displacement is.
        strain: Bulk strain eps_xx of the strip's surface.
        duration: Of the step, s: what creeps does so over it.
        beside: Motion of the strip's supports beside the displacement, at the contact nodes (n, d), mm; by
            default nothing.
        closure: Closure of all layers at the present wear; None where nothing does.
    """

    loaded: LoadEffect
    opening: Array
    displacement: float | None = 0.0
    force: float | None = None
    strain: float = 0.0
    duration: float = 0.0
    beside: Array = field(default_factory=lambda: NO_SHIFT)
    closure: Closure | None = None

    def towards(self, other: Imposed, share: float) -> Imposed:
        """Return the imposed motions and loads a share of the way to the others."""

        def between(a: float | None, b: float | None) -> float | None:
            return b if a is None or b is None else a + share * (b - a)

        return Imposed(
            self.loaded.times(1 - share) + other.loaded.times(share),
            self.opening + share * (other.opening - self.opening),
            between(self.displacement, other.displacement),
            between(self.force, other.force),
            self.strain + share * (other.strain - self.strain),
            share * other.duration,
            (1 - share) * self.beside + share * other.beside,
            other.closure,
        )


@dataclass(frozen=True)
class StickState:
    """The contact at the end of a time step, and what the next one must remember.

    Attributes:
        pressure: p (n,), MPa.
        traction: t on the punch along the tangents (n, m), MPa.
        gap: (n,), mm.
        slip: Of the punch against the strip in the step (n, m), mm; exactly zero where it sticks.
        approach: Relative displacement along e_n in the step (n,), mm.
        rigid: a (r,).
        displacement: delta.
        force: Q, the tangential force on the strip along the motion, N/mm, in a solid N.
        on_punch: Displacement of the punch's contact nodes but for rigid modes and creep (n, d), mm.
        on_strip: Of what the strip was condensed onto (q, d), mm.
        trial: t - c s (n, m), MPa: where Newton starts from in the next step.
        iterations: Newton steps.
        unique: Whether Newton's method met pieces of one orientation only; else there may be other answers.
        parts: Of the step: more than one where it did not converge as a whole; `slip` and `approach` are their sums.
        crept: State of what creeps, see `fenwear.steps.stick_creep`; empty where nothing does.
        elastic: Displacements by the forces of now of all that may creep, from which it creeps on; empty where nothing
            does.
        beside: Motion of the strip's supports beside the displacement (n, d), mm.
        flowed: Depth that the surfaces have flown in the step (n,), mm.
    """

    pressure: Array
    traction: Array
    gap: Array
    slip: Array
    approach: Array
    rigid: Array
    displacement: float
    force: float
    on_punch: Array
    on_strip: Array
    trial: Array
    iterations: int = 0
    unique: bool = True
    parts: int = 1
    crept: Array = field(default_factory=lambda: STIFF)
    elastic: Array = field(default_factory=lambda: STIFF)
    beside: Array = field(default_factory=lambda: NO_SHIFT)
    flowed: Array = field(kw_only=True)

    @property
    def heat(self) -> NDArray[Any]:
        """Work of friction in the step over the area of each node (n,), N/mm."""
        return -(self.traction * self.slip).sum(axis=1)

    @property
    def closed(self) -> Mask:
        """Which nodes carry pressure (n,)."""
        return self.pressure > 0

    @property
    def slipping(self) -> Mask:
        """Which nodes have slipped in the step (n,)."""
        return self.closed & (np.abs(self.slip) > 0).any(axis=1)

    @property
    def sticking(self) -> Mask:
        """Which nodes carry pressure and have not slipped (n,)."""
        return self.closed & ~self.slipping


@dataclass(frozen=True)
class PartialSlipState:
    """State of a run between two time steps.

    Attributes:
        contact: With what it remembers.
        imposed: On it, expansion by heat among it.
        worn: Depths.
        next_step: Number of the next time step in the cycle.
        temperature: Of both bodies, on the bases of the rig's heat (dim,); empty without heat, as the next two.
        heating: Heat of friction of the nodes in the last step (n,), mW/mm².
        conductance: Of the nodes in the last step (n,), N/(mm s K), NaN where none conducts.
        pressures, trials: Of each time step of the cycle when it was computed last (k, n) and (k, n, m), NaN where it
            was not: zones come back from cycle to cycle, so that Newton starts there.
        load: Factor of all loads in the steps to come.
        slid: Slip of each node from the start (n,), mm.
        speed: Of the slip of each node in the last step (n,), mm/s.
        coupling: Iterations of contact and heat in the last step.
        held: States of laws after the last step, where they differ from those of `worn`; the shape stays until the end
            of a half-cycle.
        slips: Of the nodes in each time step of the cycle (k, n, m), mm, as `trials`.
    """

    contact: StickState
    imposed: Imposed
    worn: WornDepths
    pressures: Array
    trials: Array
    slips: Array
    slid: Array
    speed: Array
    next_step: int = 0
    temperature: Array = field(default_factory=lambda: NO_HEAT)
    heating: Array = field(default_factory=lambda: NO_HEAT)
    conductance: Array = field(default_factory=lambda: NO_HEAT)
    load: float = 1.0
    coupling: int = 0
    held: Held | None = None

    @property
    def near(self) -> tuple[Array, Array] | None:
        """Pressure and trial of the next time step a cycle ago; None where there was none."""
        if np.isnan(self.pressures[self.next_step, 0]):
            return None
        return self.pressures[self.next_step], self.trials[self.next_step]

    def then(self, state: StickState, imposed: Imposed, worn: WornDepths, duration: float) -> PartialSlipState:
        """Return the state of a run after its next time step, without the heat of the step."""
        k, slipped = self.next_step, np.linalg.norm(state.slip, axis=1)
        pressures, trials, slips = self.pressures.copy(), self.trials.copy(), self.slips.copy()
        pressures[k], trials[k], slips[k] = state.pressure, state.trial, state.slip
        slid, following = self.slid + slipped, (k + 1) % len(pressures)
        known = pressures, trials, slips, slid, slipped / duration
        return PartialSlipState(state, imposed, worn, *known, next_step=following, load=self.load)


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
