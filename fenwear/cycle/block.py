"""Half-cycles in blocks: what the controller yields, with the measures of each half-cycle."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.contact import ContactState
from fenwear.cycle.moment import Moment
from fenwear.system import System


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
    """The heat of one half-cycle: one row of `BlockHeat`."""

    temperature_punch: Array
    temperature_strip: Array
    terms: Array
    coupling_iterations: int


@dataclass(frozen=True)
class Block:
    """k consecutive records of half-cycles, of n contact nodes.

    Attributes:
        system: What they were computed on.
        half_cycle: Number of each half-cycle (k,), from 1.
        direction: Its sliding direction d (k,).
        pressure: p during it (k, n), MPa.
        gap: Gap during it (k, n), mm.
        wear: Worn depth at its end (k, n), mm.
        rigid: Amplitudes of the rigid modes (k, modes).
        worn_area: Cross-section worn off in it, the integral of its wear (k,), mm².
        optimum_distance: Largest distance to the optimal pressure of the present contact zone,
            over the mean pressure (k,).
        periodicity: Largest change of pressure against the same phase one cycle earlier, over the
            mean pressure (k,); NaN in the first cycle.
        heat: Temperatures and heat balance; None without heat.
        end: From where the run goes on.
    """

    system: System
    half_cycle: NDArray[np.int64]
    direction: NDArray[np.int64]
    pressure: Array
    gap: Array
    wear: Array
    rigid: Array
    worn_area: Array
    optimum_distance: Array
    periodicity: Array
    heat: BlockHeat | None = field(default=None, kw_only=True)
    end: Moment = field(kw_only=True)

    def __len__(self) -> int:
        return len(self.half_cycle)

    @property
    def time(self) -> Array:
        """Time at the end of each half-cycle (k,), s."""
        return self.half_cycle.astype(float) * self.system.motion.duration

    @property
    def max_pressure(self) -> Array:
        """Largest pressure of each half-cycle (k,), MPa."""
        return self.pressure.max(axis=1)

    @property
    def contact_width(self) -> Array:
        """Width of the nodes in contact, by their weights (k,), mm."""
        return (self.pressure > 0) @ self.system.statics.facing.weights

    @cached_property
    def equilibrium_error(self) -> Array:
        """Largest error of the force and moment balance relative to the load (k,)."""
        statics, friction = self.system.statics, self.system.case.contact.friction
        lengths = np.abs(statics.rigid_normal).max(axis=0, initial=1e-300)
        scale = lengths * statics.mean_pressure * statics.facing.weights.sum()
        error = np.zeros(len(self))
        for d in np.unique(self.direction):
            rows = self.direction == d
            balance = self.pressure[rows] @ statics.equilibrium(d, friction).T + statics.resultant
            error[rows] = np.abs(balance / scale).max(axis=1, initial=0.0)
        return error


@dataclass
class Recorder:
    """Collects half-cycles into blocks; one append a half-cycle, one copy a block."""

    system: System
    size: int
    _rows: list[tuple[object, ...]] = field(default_factory=list)
    _heat: list[HalfCycleHeat] = field(default_factory=list)
    _optima: dict[tuple[int, bytes], Array] = field(default_factory=dict)

    def add(
        self,
        half_cycle: int,
        direction: int,
        phase: int,
        state: ContactState,
        wear: Array,
        worn: Array,
        previous: Array | None,
        heat: HalfCycleHeat | None = None,
    ) -> float:
        """Record one half-cycle and return its periodicity."""
        pressure = state.pressure[phase]
        scale = self.system.statics.mean_pressure
        change = float("nan") if previous is None else float(np.abs(pressure - previous).max()) / scale
        distance = float(np.abs(pressure - self._optimum(direction, pressure)).max()) / scale
        area = float(self.system.statics.facing.weights @ worn)
        row = (half_cycle, direction, pressure, state.gap[phase], wear, state.rigid[phase], area, distance, change)
        self._rows.append(row)
        if heat is not None:
            self._heat.append(heat)
        return change

    @property
    def full(self) -> bool:
        """Whether the block is as large as asked for."""
        return len(self._rows) >= self.size

    def take(self, end: Moment) -> Block:
        """Return the block that ends with `end`, and begin the next one."""
        columns = [np.array(column) for column in zip(*self._rows, strict=True)]
        heat = None
        if self._heat:
            names = ("temperature_punch", "temperature_strip", "terms", "coupling_iterations")
            heat = BlockHeat(*(np.array([getattr(row, name) for row in self._heat]) for name in names))
        self._rows, self._heat = [], []
        return Block(self.system, *columns, heat=heat, end=end)

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
