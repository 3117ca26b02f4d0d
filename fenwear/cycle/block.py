"""Half-cycles in blocks: what the controller yields, with the measures of each half-cycle."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.assembly import Tribosystem
from fenwear.contact import ContactState
from fenwear.cycle.state import RunState, pressure_scale
from fenwear.sliding.wear import Worn


@dataclass(frozen=True)
class BlockHeat:
    """The heat of k half-cycles.

    Attributes:
        temperature_punch: Of the punch's contact surface at the end of each half-cycle (k, n), K.
        temperature_strip: Of the strip's (k, n), K.
        terms: Heat of each half-cycle by `fenwear.heat.exchange.TERMS` (k, 6), mJ.
        coupling_iterations: Of heat and contact (k,).
    """

    temperature_punch: Array
    temperature_strip: Array
    terms: Array
    coupling_iterations: NDArray[np.int64]

    @property
    def max_temperature(self) -> Array:
        """Largest temperature of the contact surfaces (k,), K."""
        return np.maximum(self.temperature_punch.max(axis=1), self.temperature_strip.max(axis=1))

    @property
    def balance_error(self) -> Array:
        """Missing heat of each half-cycle relative to its largest term (k,)."""
        missing = self.terms[:, 0] - self.terms[:, 1:].sum(axis=1)
        return np.abs(missing) / np.maximum(np.abs(self.terms).max(axis=1), 1e-300)


@dataclass(frozen=True)
class HalfCycleHeat:
    """The heat of one half-cycle, or of one of its phases: one row of `BlockHeat`."""

    temperature_punch: Array
    temperature_strip: Array
    terms: Array
    coupling_iterations: int

    def then(self, later: HalfCycleHeat) -> HalfCycleHeat:
        """Return the heat of this phase and the next one."""
        iterations = max(self.coupling_iterations, later.coupling_iterations)
        return HalfCycleHeat(later.temperature_punch, later.temperature_strip, self.terms + later.terms, iterations)


@dataclass(frozen=True)
class Block:
    """k consecutive records of half-cycles, of n contact nodes.

    Attributes:
        system: What they were computed on.
        half_cycle: Number of each half-cycle (k,), from 1.
        direction: Its sliding direction d (k,).
        pressure: p in its middle position (k, n), MPa.
        gap: Gap there (k, n), mm.
        wear: Worn depth of the punch at its end (k, n), mm.
        wear_strip: Of the strip, on its material (k, n_strip), mm.
        rigid: Amplitudes of the rigid modes there (k, modes).
        worn_area: Cross-section worn off the punch in it, the integral of its wear (k,), mm².
        worn_area_strip: The same of the strip (k,), mm².
        optimum_distance: Largest distance to the optimal pressure of the present contact zone, over the pressure
            scale, see `fenwear.cycle.state.pressure_scale` (k,).
        periodicity: Largest change of pressure against the same phase one cycle earlier, over the
            pressure scale (k,); NaN in the first cycle.
        equilibrium_error: Largest error of the force and moment balance relative to the contact force (k,).
        retries: What had to be solved in another way in it, a count (k,).
        heat: Temperatures and heat balance; None without heat.
        remedies: How it was solved then, and how often.
        end: From where the run goes on.
    """

    system: Tribosystem
    half_cycle: NDArray[np.int64]
    direction: NDArray[np.int64]
    pressure: Array
    gap: Array
    wear: Array
    wear_strip: Array
    rigid: Array
    worn_area: Array
    worn_area_strip: Array
    optimum_distance: Array
    periodicity: Array
    equilibrium_error: Array
    retries: NDArray[np.int64]
    heat: BlockHeat | None = field(default=None, kw_only=True)
    remedies: Counter[str] = field(default_factory=Counter, kw_only=True)
    end: RunState = field(kw_only=True)

    def __len__(self) -> int:
        return len(self.half_cycle)

    @property
    def time(self) -> Array:
        """Time at the end of each half-cycle (k,), s."""
        return self.system.motion.time(self.half_cycle)

    @property
    def max_pressure(self) -> Array:
        """Largest pressure of each half-cycle (k,), MPa."""
        return self.pressure.max(axis=1)

    @property
    def contact_width(self) -> Array:
        """Width of the nodes in contact, by their weights (k,), mm."""
        return (self.pressure > 0) @ self.system.rigid.pair.weights


@dataclass(frozen=True)
class PhaseRecord:
    """What one phase of a half-cycle came to.

    Attributes:
        phase: Its number in the cycle.
        contact: Its contact.
        before: Pressure of the same phase one cycle ago (n,), MPa; None in the first cycle.
        areas: Cross-sections worn off punch and strip, mm².
        friction_ratio: tau (n, d), the traction of friction on the punch over the pressure.
    """

    phase: int
    contact: ContactState
    before: Array | None
    areas: tuple[float, float]
    friction_ratio: Array


@dataclass
class Recorder:
    """Collects half-cycles into blocks; one append a half-cycle, one copy a block."""

    system: Tribosystem
    size: int
    _rows: list[tuple[object, ...]] = field(default_factory=list)
    _heat: list[HalfCycleHeat] = field(default_factory=list)
    _remedies: Counter[str] = field(default_factory=Counter)
    _optima: dict[tuple[int, bytes], Array] = field(default_factory=dict)
    _equilibria: dict[int, tuple[Array, Array]] = field(default_factory=dict)  # of each phase at its last friction

    def add(self, half_cycle: int, phases: Sequence[PhaseRecord], worn: Worn, heat: HalfCycleHeat | None) -> float:
        """Record one half-cycle and return its periodicity.

        Args:
            half_cycle: Its number.
            phases: Its phases in their order.
            worn: Depths at its end.
            heat: Of all its phases.
        """
        middle = phases[len(phases) // 2]
        state, pressure = middle.contact, middle.contact.pressure[0]
        scale = pressure_scale(self.system, np.array([p.contact.pressure[0] for p in phases]))
        direction = self.system.motion.phases[middle.phase].direction
        change = max(
            float("nan") if p.before is None else float(np.abs(p.contact.pressure[0] - p.before).max()) / scale
            for p in phases
        )
        distance = float(np.abs(pressure - self._optimum(direction, pressure)).max()) / scale
        row = (half_cycle, direction, pressure, state.gap[0], worn.punch, worn.strip, state.rigid[0])
        areas = np.sum([p.areas for p in phases], axis=0).tolist()
        taken = self.system.remedies.take()
        self._remedies += taken
        balance = max(self._balance(p) for p in phases)
        self._rows.append((*row, *areas, distance, change, balance, taken.total()))
        if heat is not None:
            self._heat.append(heat)
        return change

    def _balance(self, record: PhaseRecord) -> float:
        """Return the largest error of the force and moment balance relative to the contact force."""
        equilibrium = self.system.interfaces[record.phase].rigid
        force = float(equilibrium.pair.weights @ record.contact.pressure[0])
        scale = self.system.mode_lengths * (force or np.abs(equilibrium.resultant).max(initial=0.0) or 1.0)
        known = self._equilibria.get(record.phase)
        if known is None or known[0] is not record.friction_ratio:
            self._equilibria[record.phase] = known = (
                record.friction_ratio,
                equilibrium.equilibrium(record.friction_ratio),
            )
        balance = known[1] @ record.contact.pressure[0] + equilibrium.resultant
        return float(np.abs(balance / scale).max(initial=0.0))

    @property
    def full(self) -> bool:
        """Whether the block is as large as asked for."""
        return len(self._rows) >= self.size

    def take(self, end: RunState) -> Block:
        """Return the block that ends with `end`, and begin the next one."""
        columns = [np.array(column) for column in zip(*self._rows, strict=True)]
        heat = None
        if self._heat:
            names = ("temperature_punch", "temperature_strip", "terms", "coupling_iterations")
            heat = BlockHeat(*(np.array([getattr(row, name) for row in self._heat]) for name in names))
        remedies = self._remedies
        self._rows, self._heat, self._remedies = [], [], Counter()
        return Block(self.system, *columns, heat=heat, remedies=remedies, end=end)

    def __bool__(self) -> bool:
        return bool(self._rows)

    def _optimum(self, direction: int, pressure: Array) -> Array:
        """Return the optimal pressure on the present contact zone; solved anew only when that changes."""
        zone = pressure > 0
        key = (direction, zone.tobytes())
        if key not in self._optima:
            if len(self._optima) > 1000:
                self._optima.clear()
            self._optima[key] = self.system.optimum(direction, zone).pressure
        return self._optima[key]
