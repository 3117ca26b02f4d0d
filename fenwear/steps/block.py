"""Half-cycles in blocks: what the controller yields, with the measures of each half-cycle."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fenwear.common.arrays import Array
from fenwear.common.errors import ConvergenceError
from fenwear.contact import ContactState
from fenwear.contact.complementarity import complementarity_error
from fenwear.heat.heat_exchange import TERMS
from fenwear.laws.sliding_tensors import SlidingTensor
from fenwear.laws.wear import WornDepths
from fenwear.steps.run_state import RunState, Totals, pressure_scales, stacked
from fenwear.surfaces import RigidEquilibrium
from fenwear.system import Tribosystem


@dataclass(frozen=True)
class HeatRecord:
    """The heat of a phase or half-cycle, or of k half-cycles in rows.

    Attributes:
        temperature_punch: Of the punch's contact surface at the end of each (n,) or (k, n), K.
        temperature_strip: Of the strip's (n,) or (k, n), K.
        terms: Heat of each by `fenwear.heat.heat_exchange.TERMS`, and by `CROSSING` (8,) or (k, 8), mJ.
        coupling_iterations: Of heat and contact () or (k,).
        temperature_bulk: Of the bulk of the strip's closed track at the end () or (k,), K; NaN where there is none.
    """

    temperature_punch: Array
    temperature_strip: Array
    terms: Array
    coupling_iterations: NDArray[np.int64]
    temperature_bulk: Array

    def then(self, later: HeatRecord) -> HeatRecord:
        """Return the heat of this phase and the next one."""
        iterations = np.asarray(np.maximum(self.coupling_iterations, later.coupling_iterations))
        return replace(later, terms=self.terms + later.terms, coupling_iterations=iterations)

    @property
    def largest_temperature(self) -> Array:
        """Largest temperature of the contact surfaces (k,), K."""
        return np.maximum(self.temperature_punch.max(axis=1), self.temperature_strip.max(axis=1))

    @property
    def balance_error(self) -> Array:
        """Missing heat of each half-cycle relative to its largest term (k,)."""
        balance = self.terms[:, : len(TERMS)]
        missing = balance[:, 0] - balance[:, 1:].sum(axis=1)
        return np.abs(missing) / np.maximum(np.abs(balance).max(axis=1), 1e-300)


def heat_of_phases(heats: Iterable[HeatRecord | None]) -> HeatRecord | None:
    """Return the heat of phases one after the other; None of those without."""
    known = [heat for heat in heats if heat is not None]
    return reduce(HeatRecord.then, known) if known else None


@dataclass(frozen=True, repr=False)
class Block:
    """k consecutive records of half-cycles, of n contact nodes.

    Attributes:
        system: Their system.
        half_cycle: Number of each half-cycle (k,), from 1.
        direction: Sliding direction d (k,).
        pressure: p in its middle position (k, n), MPa.
        gap: Gap there (k, n), mm.
        wear: Worn depth of the punch at its end (k, n), mm.
        wear_strip: Of the strip, on its material (k, n_strip), mm.
        between: State of what lies between at its end, by the rows of `fenwear.laws.Layers` (k, rows, n).
        crept: State of what creeps at its end, as `fenwear.system.Creep` has it (k, size).
        carried: States of the strip's material that laws remember (k, rows, n_strip).
        rigid: Amplitudes of the rigid modes there (k, modes).
        totals: Totals of all half-cycles up to its end, k of them.
        adds: Additions of the block, k of them.
        optimum_distance: Share of the load that is carried elsewhere than in the optimum: half the integral of the
            difference to the optimal pressure of the present contact zone, over the pressure's (k,).
        periodicity: Largest change of pressure against the same phase one cycle earlier, over the
            pressure scale (k,); NaN in the first cycle.
        equilibrium_error: Largest error of the force and moment balance relative to the contact force (k,).
        complementarity_error: Largest error of p >= 0, gap >= 0 and p gap = 0 at a node in any phase, over their scales
            (k,): see `fenwear.contact.complementarity`.
        retries: Number of its solves in another way (k,).
        heat: Temperatures and heat balance; None without heat.
        remedies: Other ways of solving, with their counts.
        load_factor: Of all loads in it (k,).
        end: State from which the run continues.
        steps: Time steps of each half-cycle, where the law of contact resolves it in time; else none.
        friction_ratio: tau of each in its middle position (n, d), k of them.
        sliding: Tensor of the sliding of a cycle that is a table in a solid, of the work, k of them; else none.
    """

    system: Tribosystem
    half_cycle: NDArray[np.int64]
    direction: NDArray[np.int64]
    pressure: Array
    gap: Array
    wear: Array
    wear_strip: Array
    rigid: Array
    totals: Totals
    adds: Totals
    optimum_distance: Array
    periodicity: Array
    equilibrium_error: Array
    complementarity_error: Array
    retries: NDArray[np.int64]
    heat: HeatRecord | None = field(default=None, kw_only=True)
    remedies: Counter[str] = field(default_factory=Counter, kw_only=True)
    load_factor: Array = field(kw_only=True)
    end: RunState = field(kw_only=True)
    between: Array = field(kw_only=True)
    crept: Array = field(kw_only=True)
    carried: Array = field(kw_only=True)
    steps: tuple[Any, ...] = field(default=(), kw_only=True)
    friction_ratio: tuple[Array, ...] = field(kw_only=True)
    sliding: tuple[SlidingTensor, ...] = field(default=(), kw_only=True)

    def __len__(self) -> int:
        return len(self.half_cycle)

    def __repr__(self) -> str:
        """Say in a line what it is."""
        first, last, nodes = self.half_cycle[0], self.half_cycle[-1], self.pressure.shape[1]
        return f"<Block: {len(self)} records of half-cycles {first} to {last}, {nodes} contact nodes>"

    @property
    def x(self) -> Array:
        """Abscissae of the contact nodes (n,), mm."""
        return self.system.pair.x

    @property
    def coordinates(self) -> Array:
        """Coordinates of the contact nodes (n, 2) or (n, 3), mm, as those of a steady state."""
        return self.system.pair.punch.x

    @property
    def time(self) -> Array:
        """Time at the end of each half-cycle (k,), s."""
        return self.system.sliding.time(self.half_cycle)

    @property
    def load(self) -> Array:
        """Mean normal force of each half-cycle (k,), N; 0 where supports and not the contact carry the loads."""
        return self.system.normal_force * self.load_factor

    @property
    def speed(self) -> Array:
        """Mean speed of the motion (k,), mm/s or rad/s."""
        return np.full(len(self), self.system.motion.mean_speed)

    @property
    def ambient(self) -> Array:
        """Temperature of the surroundings (k,), K; 0 without heat."""
        return np.full(len(self), self.system.exchange.ambient)

    @property
    def largest_pressure(self) -> Array:
        """Largest pressure of each half-cycle (k,), MPa."""
        return self.pressure.max(axis=1)

    @property
    def worn_area_increment(self) -> Array:
        """Cross-section worn off the punch in each, the integral of its wear (k,), mm²; a volume in mm³ else."""
        return self.adds.of("volume_punch") * (1 / self.system.bodies.punch.thickness)

    @property
    def worn_area_increment_strip(self) -> Array:
        """The area worn off the strip in each half-cycle (k,), mm²."""
        return self.adds.of("volume_strip") * (1 / self.system.bodies.punch.thickness)

    @property
    def contact_width(self) -> Array:
        """Width of the nodes in contact, by their weights (k,), mm."""
        # Added up by numpy: a product by BLAS may end in other bits where the arrays lie elsewhere in memory.
        return np.where(self.pressure > 0, self.system.rigid.pair.weights, 0.0).sum(axis=1)


@dataclass(frozen=True)
class PhaseRecord:
    """Result of one phase of a half-cycle.

    Attributes:
        phase: Number of the phase in the cycle.
        contact: Contact of the phase.
        before: Pressure of the same phase one cycle ago (n,), MPa; NaN in the first cycle.
        adds: Additions of the phase to the totals.
        friction_ratio: tau (n, d), the traction of friction on the punch over the pressure.
        equilibrium: Its half-cycle; by default that of the phase.
    """

    phase: int
    contact: ContactState
    before: Array
    adds: Totals
    friction_ratio: Array
    equilibrium: RigidEquilibrium | None = None


class HalfCycle(NamedTuple):
    """One half-cycle that is to be recorded.

    Attributes:
        number: From 1.
        phases: In their order.
        worn: Depths at its end.
        totals: Of all half-cycles up to its end.
        heat: Of all its phases; None without heat.
        load: Factor of all loads.
        steps: Of a law that resolves it in time, with pressures, those a cycle ago, and gaps (k, n); None of phases.
    """

    number: int
    phases: Sequence[PhaseRecord]
    worn: WornDepths
    totals: Totals
    heat: HeatRecord | None
    load: float = 1.0
    steps: Any = None


@dataclass
class Recorder:
    """Collects half-cycles into blocks: one append a half-cycle, all measures once a block."""

    system: Tribosystem
    size: int
    _rows: list[HalfCycle] = field(default_factory=list)
    _retries: list[int] = field(default_factory=list)
    _remedies: Counter[str] = field(default_factory=Counter)
    _optima: dict[tuple[int, bytes], Array] = field(default_factory=dict)

    def add(self, half_cycle: HalfCycle) -> None:
        """Record one half-cycle."""
        taken = self.system.remedies.take()
        if taken:
            self._remedies += taken
        self._rows.append(half_cycle)
        self._retries.append(taken.total())

    def change(self) -> float:
        """Return the periodicity of the last half-cycle."""
        return float(self._changes(self._rows[-1:])[0])

    def _changes(self, rows: Sequence[HalfCycle]) -> Array:
        """Return the periodicity of half-cycles (k,)."""
        if rows[0].steps is not None:  # their numbers need not be equal
            pairs = [(row.steps.pressure, row.steps.before) for row in rows if row.steps is not None]
            scales = np.array([pressure_scales(self.system, now[None])[0] for now, _ in pairs])
            return np.array([np.abs(now - before).max() for now, before in pairs]) / scales
        pressure = np.array([[p.contact.pressure[0] for p in row.phases] for row in rows])
        before = np.array([[p.before for p in row.phases] for row in rows])
        changes: Array = np.abs(pressure - before).max(axis=(1, 2)) / pressure_scales(self.system, pressure)
        return changes

    @property
    def full(self) -> bool:
        """Whether the block is as large as asked for."""
        return len(self._rows) >= self.size

    def take(self, end: RunState) -> Block:
        """Return the block that ends with `end`, and begin the next one."""
        rows, system = self._rows, self.system
        changes, weights = self._changes(rows), system.pair.weights
        middles = [row.phases[len(row.phases) // 2] for row in rows]
        directions = [system.motion.phases[middle.phase].direction for middle in middles]
        pressure = np.concatenate([middle.contact.pressure for middle in middles])
        pressures = [np.concatenate([phase.contact.pressure for phase in row.phases]) for row in rows]
        adds = [reduce(Totals.__add__, [p.adds for p in row.phases]) for row in rows]
        loads = np.array([row.load for row in rows])
        # Pressures that balance the loads grow with them.
        optima = np.array([f * self._optimum(d, p) for d, p, f in zip(directions, pressure, loads, strict=True)])
        heat, heats = None, [row.heat for row in rows if row.heat is not None]
        if heats:
            heat = HeatRecord(*map(np.array, zip(*(vars(heat).values() for heat in heats), strict=True)))
        block = Block(
            system,
            np.array([row.number for row in rows]),
            np.array(directions),
            pressure,
            np.concatenate([middle.contact.gap for middle in middles]),
            np.array([row.worn.punch for row in rows]),
            np.array([row.worn.strip for row in rows]),
            np.concatenate([middle.contact.rigid for middle in middles]),
            stacked([row.totals for row in rows]),
            stacked(adds),
            _weighed(np.abs(pressure - optima), weights) / (2 * np.maximum(_weighed(pressure, weights), 1e-300)),
            changes,
            self._balances(),
            self._complementarity(),
            np.array(self._retries),
            heat=heat,
            remedies=self._remedies,
            load_factor=loads,
            end=end,
            between=np.array([row.worn.between for row in rows]),
            crept=np.array([row.worn.crept for row in rows]),
            carried=np.array([row.worn.carried for row in rows]),
            steps=tuple(row.steps for row in rows if row.steps is not None),
            friction_ratio=tuple(middle.friction_ratio for middle in middles),
            sliding=tuple(map(system.phases.ways.tensor, pressures)) if system.sliding.many_ways else (),
        )
        self._rows, self._retries, self._remedies = [], [], Counter()
        return block

    def __bool__(self) -> bool:
        return bool(self._rows)

    def _balances(self) -> Array:
        """Return the largest error of the force and moment balance of each half-cycle relative to the contact force."""
        groups: dict[tuple[int, int], list[tuple[int, PhaseRecord]]] = {}  # of a phase on its surfaces
        for number, row in enumerate(self._rows):
            for record in row.phases:
                groups.setdefault((record.phase, id(record.equilibrium)), []).append((number, record))
        errors = np.zeros(len(self._rows))
        for members in groups.values():
            numbers, records = zip(*members, strict=True)
            equilibrium = records[0].equilibrium or self.system.elastic.interfaces[records[0].phase].rigid
            pressure = np.concatenate([record.contact.pressure for record in records])
            force = (pressure * equilibrium.pair.weights).sum(axis=1)
            force[force == 0] = np.abs(equilibrium.resultant).max(initial=0.0) or 1.0
            loads = np.array([self._rows[number].load for number in numbers])
            ratios = [record.friction_ratio for record in records]
            if all(ratio is ratios[0] for ratio in ratios):
                carried = np.einsum("kn,mn->km", pressure, equilibrium.equilibrium(ratios[0]))
            else:
                carried = equilibrium.of(pressure, np.array(ratios))
            balance = carried + loads[:, None] * equilibrium.resultant
            error = np.abs(balance / (self.system.rigid.mode_lengths * force[:, None])).max(axis=1, initial=0.0)
            np.maximum.at(errors, list(numbers), error)
        return errors

    def _complementarity(self) -> Array:
        """Return the largest error of Signorini's conditions in each half-cycle (k,)."""
        length = self.system.law.elastic_length(self.system)
        if self._rows and self._rows[0].steps is not None:
            steps = [row.steps for row in self._rows if row.steps is not None]
            return np.array([complementarity_error(step.pressure, step.gap, length).max() for step in steps])
        states = [[record.contact for record in row.phases] for row in self._rows]
        pressure, gap = (
            np.array([[getattr(c, name)[0] for c in row] for row in states]) for name in ("pressure", "gap")
        )
        return complementarity_error(pressure, gap, length).max(axis=1)

    def _optimum(self, direction: int, pressure: Array) -> Array:
        """Return the optimal pressure on the present contact zone, NaN where there is none.

        So where a threshold or cap leaves none, nodes stick, or directions change. Solved again only when the zone
        changes.
        """
        if self.system.law.sticks or self.system.motion.steps:
            return np.full(len(pressure), np.nan)
        zone = pressure > 0
        key = (direction, zone.tobytes())
        if key not in self._optima:
            if len(self._optima) > 1000:
                self._optima.clear()
            try:
                self._optima[key] = self.system.optimum(direction, zone).pressure
            except ConvergenceError:
                self._optima[key] = np.full(len(zone), np.nan)
        return self._optima[key]


def _weighed(values: Array, weights: Array) -> Array:
    """Return the integrals of rows (k, n) by weights (n,); a product would round as the places in memory have it."""
    return np.asarray((values * weights).sum(axis=1))
