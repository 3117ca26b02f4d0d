"""Coulomb's law with stick, as a law of contact: its bodies, its steps over half-cycles and over many cycles.

A half-cycle goes in time steps (`cycle`), on the shape at its start; its wear is taken off at its end. A jump over many
cycles is that of `jump`. The state of a run has a `Memory`: values that a time step needs of the step before.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from zlib import crc32

import numpy as np

from fenwear.bodies.surface_operators import SurfaceOperator
from fenwear.case import Case
from fenwear.case.body_names import with_body_names
from fenwear.common.arrays import Array, Mask
from fenwear.common.errors import CaseError, ConvergenceError, InputError
from fenwear.contact import ContactState
from fenwear.heat.temperature import HeatState
from fenwear.laws.wear import WornDepths
from fenwear.steps.block import HalfCycle, HeatRecord, PhaseRecord
from fenwear.steps.driver import Loading, Watch
from fenwear.steps.gross_sliding import LAW as SLIDING
from fenwear.steps.run_state import RunState, Totals, approach, counted_back, with_worn
from fenwear.steps.stick_cycle import PartialSlipProblem, on_other_grid
from fenwear.steps.stick_final import FinalShape, final_shape
from fenwear.steps.stick_interface import StickInterface
from fenwear.steps.stick_jump import first_cycle, jumped
from fenwear.steps.stick_program import TimeStep
from fenwear.steps.stick_setup import (
    Ends,
    Fineness,
    fine_enough,
    heated,
    placed_by_slip,
    same_steps,
    touches,
    unheated_problem,
    with_ends,
)
from fenwear.steps.stick_state import NO_HEAT, FrettingCycle, PartialSlipState, TimeStepRecords
from fenwear.surfaces.motion import Motion, make_motion
from fenwear.surfaces.placement import in_model
from fenwear.system import (
    Bodies,
    ContactLaw,
    Preparation,
    Tribosystem,
    at_rim,
    build_conduction,
    carried,
    joined,
    node_maps,
    on_nodes,
    on_sufficient_grid,
    place_at_rest,
)
from fenwear.system.tribosystem import Condensed

ROUNDING = 1e-9  # of a half-cycle: times that are the same


@dataclass(frozen=True)
class Memory:
    """Memory of a run besides depths and temperatures.

    Attributes:
        at: Where the time steps are; its depths and temperature are those of the run.
        stuck: Which nodes stuck in each half-cycle of the last cycle (half-cycles, n).
        made_of: Identity of the bodies and loads that it belongs to.
        cycle: The last one, on the shape of the run, from which jumps continue; None where there is none.
        warm: Temperatures at the end of that cycle, where there is one with heat; else none.
    """

    at: PartialSlipState
    stuck: Array
    made_of: float
    cycle: FrettingCycle | None = None
    warm: tuple[HeatState, ...] = ()


@dataclass(frozen=True)
class Steps:
    """The time steps of a half-cycle.

    Attributes:
        records: k of them.
        before: Their pressures a cycle ago (k, n), MPa; NaN where there was none.
        stuck: Which nodes stick all through the cycle that ends with them (n,).
        energy_ratio: Friction's work over twice the largest force times the stroke.
        jump_error: Estimated error of the jump that they end; 0 without.
        first: Number of the first one in the cycle.
        wear: Depths worn off both bodies in all of them.
    """

    records: TimeStepRecords
    before: Array
    stuck: Mask
    energy_ratio: float
    jump_error: float
    first: int
    wear: WornDepths

    @property
    def pressure(self) -> Array:
        """At the end of each step (k, n), MPa."""
        return self.records.pressure

    @property
    def gap(self) -> Array:
        """At the end of each step (k, n), mm."""
        return self.records.gap


@dataclass(frozen=True)
class StickSetup:
    """Parts of a system that belong to the law.

    Attributes:
        problem: The bodies, and what is done to them in a cycle.
        fineness: Of its time steps; None where they are taken as they are given.
        made_of: Identity of these bodies and loads: it differs on other meshes, with other properties or in another
            stage of a program.
        ends: Where its time steps end, as numbers of the finest ones; None where they are taken as they are given.
        prepared: Whether heat is, and its time steps are fine enough, where they are to be.
    """

    problem: PartialSlipProblem
    fineness: Fineness | None
    made_of: float
    ends: Ends | None = None
    prepared: bool = True


class Coulomb:
    """The law: nodes stick, or slip against their friction."""

    name = "coulomb"
    sticks = True
    memory: type | None = Memory

    def of_bodies(self, case: Case, bodies: Bodies, *, heat: Preparation, fresh: bool) -> Tribosystem:
        """Return the system of a case whose bodies are built; collective."""
        if bodies.punch.reach is not None:  # its grid begins around the first contact, pressed alone
            bodies = SLIDING.of_bodies(case, bodies, heat="none", fresh=fresh).bodies
        return system_of(case, bodies, law=self, heat=heat, fresh=fresh)

    def renewed(self, system: Tribosystem, bodies: Bodies) -> Tribosystem:
        """Return the system of the same case with the meshes or properties that these bodies have; collective."""
        same = bodies.punch is system.bodies.punch
        condensed = (system.elastic.condensed.punch, system.elastic.condensed.strip) if same else None
        heat: Preparation = "as set" if system.law_state.prepared else "none"
        ends = system.law_state.ends
        return system_of(system.case, bodies, law=self, heat=heat, condensed=condensed, ends=ends)

    def varied(self, system: Tribosystem, case: Case) -> Tribosystem:
        """Return the system of another case that shares the bodies that the change leaves; collective."""
        before = system.case
        bodies, condensed = system.bodies, (system.elastic.condensed.punch, system.elastic.condensed.strip)
        if before.loading != case.loading:
            bodies = bodies.under(case)
            condensed = condensed[0].under(bodies.punch), condensed[1].under(bodies.strip)
        held, asked = (
            (variant.heat, variant.punch.boundary_of_heat, variant.strip.boundary_of_heat) for variant in (before, case)
        )
        if held != asked:
            bodies = replace(bodies, heat=build_conduction(case, bodies.punch, bodies.strip, bodies.warmed))
        moves = unheated_problem(case, bodies, condensed=condensed).interface.moves
        same = condensed if moves == system.elastic.condensed.strip_moves else None
        ends = system.law_state.ends if same_steps(before, case) else None
        return system_of(case, bodies, law=self, condensed=same, ends=ends)

    def elastic_length(self, system: Tribosystem) -> float:
        """Return the gap that unit pressures open on average, mm/MPa."""
        return float(system.law_state.problem.interface.middle.elastic_length)

    @with_body_names
    def check_touching(self, system: Tribosystem) -> None:
        """Make sure that the load brings the surfaces together; collective.

        Raises:
            CaseError: it does not.
        """
        if not touches(system.law_state.problem):
            raise CaseError(InputError("geometry", "the surfaces never meet under the load"))

    def end(self, system: Tribosystem, properties_within: float | None = None) -> FinalShape:  # noqa: ARG002
        """Return the shape to which partial slip wears, of the grid that its scar has grown to; collective.

        Raises:
            ConvergenceError: there is none, or none that does not depend on the way there.
        """
        if any(law.pressure_threshold > 0 for law in system.sliding.wear):
            raise ConvergenceError(
                "no unique final shape exists with a pressure_threshold: the pressure below it that slipping nodes "
                "keep depends on the run before. Follow the wear by `run`"
            )
        system, shape = on_sufficient_grid(
            system,
            lambda grown: final_shape(grown.law_state.problem),
            lambda final: np.asarray((final.depth > 0) | (final.pressures > 0).any(axis=0)),
        )
        return replace(shape, system=system)

    def on_other_grid(self, memory: Memory, before: Tribosystem, after: Tribosystem) -> Memory:
        """Return the memory of a run on another contact grid; collective. Jumps continue from a cycle made there."""
        nodes, _ = node_maps(before, after)
        problems = before.law_state.problem, after.law_state.problem
        worn = carried(memory.at.worn, before, after)
        at = problems[1].led(partial(on_other_grid, memory.at, *problems, nodes, worn))
        return Memory(at, on_nodes(memory.stuck, nodes, np.zeros(len(nodes))), memory.made_of)

    def half_cycles(self, system: Tribosystem, watch: Watch, loading: Loading, *, implicit: bool) -> HalfCycles:
        """Return the step of one half-cycle; implicitly, of one cycle."""
        return (Cycles if implicit else HalfCycles)(system, watch, loading)

    def jumps(self, system: Tribosystem, tolerance: float, watch: Watch, loading: Loading) -> Jumps:
        """Return the step of many cycles."""
        return Jumps(system, tolerance, watch, loading)


LAW: ContactLaw = Coulomb()


def system_of(
    case: Case,
    bodies: Bodies,
    *,
    law: ContactLaw,
    heat: Preparation = "as set",
    fresh: bool = False,
    condensed: tuple[SurfaceOperator, SurfaceOperator] | None = None,
    ends: Ends | None = None,
) -> Tribosystem:
    """Return the system of bodies that are built; collective.

    Args:
        case: With contact.law = "coulomb", or that of another law that resolves slip.
        bodies: Of it.
        law: Of the contact.
        heat: Whether heat is prepared, and the time steps are halved until they are fine enough: "none" for neither.
        fresh: Condense the bodies again, even where they are kept on disk.
        condensed: Both, where they are condensed already.
        ends: Where time steps end, in place of those that are fine enough.

    Raises:
        CaseError: a property of the geometry is wrong.
        ConvergenceError: a time step of the first cycle did not converge.
    """
    problem = placed_by_slip(case, bodies, fresh=fresh, condensed=condensed)
    interface, fineness = problem.interface, None
    sliding = replace(interface.sliding, motion=_motion_at_rest(interface, case))
    placed = place_at_rest(bodies, sliding, interface.middle.pair, law, case, passes=interface.moves)
    system = joined(placed, Condensed(interface.punch, interface.strip, interface.moves))
    if ends is not None:
        problem = with_ends(problem, case, ends)
    elif heat != "none":
        problem = heated(problem, case)
        if touches(problem):
            problem, fineness = fine_enough(problem, case)
            ends = fineness.ends
    exchange = system.exchange if problem.heat is None else problem.heat.exchange
    setup = StickSetup(problem, fineness, _checksum(case, bodies), ends, heat != "none")
    return replace(system, exchange=exchange, law_state=setup)


def _motion_at_rest(interface: StickInterface, case: Case) -> Motion:
    """Return the motion with a phase for each half-cycle."""
    sliding, pair = interface.sliding, interface.middle.pair
    if not sliding.motion.steps:
        return make_motion(case.motion.model_copy(update={"positions": 1}))
    rate = pair.weights @ sliding.field.rate(pair.opposite, pair.normal) / pair.weights.sum()
    return sliding.measured_on(pair).motion.as_single_phase(sliding.field.over(float(rate)))


def _checksum(case: Case, bodies: Bodies) -> float:
    """Return a number of the wear that the meshes follow, the warmth of properties and what is done; collective."""
    worn = 0.0 if bodies.followed is None else float(bodies.followed.punch.sum() + bodies.followed.strip.sum())
    warm = 0.0 if bodies.warmed is None else float(sum(temperature.sum() for temperature in bodies.warmed))
    done = case.motion, case.stick, case.contact, case.wear, case.heat, case.loading
    return float(crc32(repr((worn, bodies.comm.allreduce(warm), done)).encode()))


class _Run:
    """Common part of steps over half-cycles and over many cycles."""

    def __init__(self, system: Tribosystem, watch: Watch, loading: Loading) -> None:
        setup: StickSetup = system.law_state
        self.system, self.setup, self.loading = system, setup, loading
        self.problem = replace(setup.problem, watch=watch)
        self.strokes = system.motion.half_cycles
        self.meter = Meter(system, self.problem)

    def temperature(self, state: RunState) -> Array:
        """Return the temperatures of a state on this system's bases (dim,)."""
        return self.system.exchange.on_bases(state.temperature).values

    def at(self, state: RunState, load: float) -> PartialSlipState:
        """Return the state of the time steps in a run, with the run's depths, temperatures and load."""
        memory: Memory | None = state.memory
        warm = self.temperature(state)
        if memory is None:
            at = self.problem.beginning(state.worn, load)
            return replace(at, temperature=warm)
        at, steps = memory.at, self.problem.program.steps
        if len(at.pressures) != len(steps):
            at = self.problem.forgotten(at)
        at = replace(self.problem.shaped(at, state.worn), load=load, temperature=warm)
        while steps[at.next_step].half_cycle != state.half_cycle % self.strokes:  # a jump ends half a cycle later
            at, _ = self.problem.half_cycle(at)
        worn = self.problem.interface.layers.flown_as(state.worn, at.worn)
        return replace(self.problem.shaped(at, worn), temperature=warm, slid=memory.at.slid)

    def half_cycle(
        self,
        number: int,
        steps: Steps,
        states: tuple[WornDepths, Totals],
        adds: Totals,
        load: float,
    ) -> HalfCycle:
        """Return the record of a half-cycle.

        Args:
            number: Number of the half-cycle.
            steps: Time steps of the half-cycle.
            states: Depths and totals at its end.
            adds: Additions of the half-cycle to the totals.
            load: Factor of all loads.
        """
        problem, records, middle = self.problem, steps.records, self.middle(steps)
        at_middle, stroke = slice(middle, middle + 1), (number - 1) % self.strokes
        iterations = int(records.iterations[middle])
        contact = ContactState(
            records.pressure[at_middle], records.gap[at_middle], records.rigid[at_middle], iterations
        )
        step = problem.program.steps[steps.first + middle]
        position = problem.interface.position(step.offset)
        pressed = records.pressure[middle] > 0
        f = np.concatenate([records.pressure[middle], records.traction[middle].T.ravel()])
        force = position.in_space(f) - records.pressure[middle][:, None] * position.frame[:, 0]
        ratio = np.where(pressed[:, None], force, 0.0) / np.where(pressed, records.pressure[middle], 1.0)[:, None]
        loaded = problem.interface.loaded(step.fraction)
        equilibrium = replace(position.rigid, resultant=loaded.resultant)
        phase = PhaseRecord(stroke, contact, steps.before[middle], adds, ratio, equilibrium)
        heat = None
        if problem.heat is not None:
            punch, strip = records.temperature[-1]
            heat = HeatRecord(
                punch, strip, records.heat.sum(axis=0), np.array(int(records.coupling.max())), np.array(np.nan)
            )
        return HalfCycle(number, [phase], states[0], states[1], heat, load, steps)

    def middle(self, steps: Steps) -> int:
        """Return the time step of a half-cycle that ends nearest to its middle, the earlier of two, whatever rounds."""
        ends = np.cumsum(steps.records.duration)
        away = np.abs(ends / ends[-1] - 0.5)
        return int(np.argmax(away <= away.min() + ROUNDING))


class HalfCycles(_Run):
    """Steps of one half-cycle; its wear is taken off at its end."""

    def __call__(self, state: RunState, _until: int, /) -> tuple[RunState, list[HalfCycle]]:
        """Return the state after the next half-cycle, and its record."""
        problem, load = self.problem, self.loading(state.half_cycle + 0.5)
        begin = self.at(state, load)
        at, records = problem.half_cycle(begin)
        first, number = begin.next_step, state.half_cycle + 1
        rows = slice(first, first + len(records))
        before = begin.pressures[rows]
        lost = problem.worn(records, begin)
        worn = replace(begin.worn + lost, crept=at.contact.crept)
        adds = self.meter(records, first, lost)
        totals = state.totals + adds
        stroke, earlier = state.half_cycle % self.strokes, np.ones((self.strokes, len(problem.weights)))
        stuck = np.array((earlier if state.memory is None else state.memory.stuck) > 0)
        stuck[stroke] = records.stuck
        steps = Steps(
            records, before, np.asarray(stuck.all(axis=0)), _energy_ratio(records, problem.weights), 0.0, first, lost
        )
        record = self.half_cycle(number, steps, (worn, totals), adds, load)
        contacts = list(state.contacts)
        contacts[stroke] = record.phases[0].contact
        warm = self.system.exchange.at(at.temperature) if self.system.exchange.conducts else None
        kept = replace(at, worn=worn, held=None, temperature=NO_HEAT)
        memory = Memory(kept, stuck.astype(float), self.setup.made_of)
        return RunState(number, worn, tuple(contacts), warm, totals, memory=memory), [record]


class Cycles(HalfCycles):
    """Steps of one cycle whose wear is implicit, that of a jump over it; what is left of a cycle goes explicitly."""

    def __init__(self, system: Tribosystem, watch: Watch, loading: Loading) -> None:
        super().__init__(system, watch, loading)
        self._jumps = Jumps(system, np.inf, watch, loading)

    def __call__(self, state: RunState, until: int, /) -> tuple[RunState, list[HalfCycle]]:
        """Return the state after the next cycle, and the record of its half-cycles."""
        if state.half_cycle % self.strokes or until < state.half_cycle + self.strokes:
            return super().__call__(state, until)
        after, records = self._jumps(replace(state, jump_length=1), until)
        return replace(after, jump_length=1), records


class Jumps(_Run):
    """Steps of as many cycles as the tolerance allows."""

    def __init__(self, system: Tribosystem, tolerance: float, watch: Watch, loading: Loading) -> None:
        super().__init__(system, watch, loading)
        self.tolerance = tolerance

    def __call__(self, state: RunState, until: int, /) -> tuple[RunState, list[HalfCycle]]:
        """Return the state after the next jump that is accurate enough, and its last cycle."""
        problem, strokes, exchange = self.problem, self.strokes, self.system.exchange
        now = self._cycle(state)
        begun = None if state.finer is None else state.finer.worn
        begin = replace(now, length=state.jump_length, finer=begun)
        then = jumped(problem, begin, until // strokes, self.tolerance, self._load, self._fits)
        cycles, number = then.number - now.number, round(then.number) * strokes
        totals = state.totals + self._adds(now, then, cycles)
        parts, old = _in_order(problem, then), _in_order(problem, now)
        stuck = np.array([records.stuck for _, records, _ in parts])
        lost = [problem.worn(then.records, then.begin, which) for *_, which in parts]
        adds = [self.meter(records, first, loss) for (first, records, _), loss in zip(parts, lost, strict=True)]
        depths, sums, made = counted_back(then.worn, lost), counted_back(totals, adds), []
        for k, ((first, records, _), (_, earlier, _)) in enumerate(zip(parts, old, strict=True)):
            before = records.pressure - (records.pressure - earlier.pressure) / cycles
            ratio = _energy_ratio(records, problem.weights)
            steps = Steps(records, before, np.asarray(stuck.all(axis=0)), ratio, then.error, first, lost[k])
            record = self.half_cycle(number - strokes + 1 + k, steps, (depths[k], sums[k]), adds[k], then.end.load)
            made.append(record)
        contacts = tuple(record.phases[0].contact for record in made)
        warm, after = state.temperature, tuple[HeatState, ...]()
        if exchange.conducts:
            warm, after = exchange.at(then.warm), (exchange.at(then.end.temperature),)
        kept = replace(then, end=replace(then.end, temperature=NO_HEAT), warm=NO_HEAT, finer=None)
        memory = Memory(kept.end, stuck.astype(float), self.setup.made_of, kept, after)
        done = RunState(number, then.worn, contacts, warm, totals, then.length, memory=memory)
        return (done if then.finer is None else replace(done, finer=self._finer(done, then, until))), made

    def _finer(self, done: RunState, then: FrettingCycle, until: int) -> RunState:
        """Return the state on the depths to which shorter jumps would have led; at the end with the cycle on them."""
        assert then.finer is not None
        off = with_worn(self.system, done.totals.times(0.0), then.worn - then.finer)
        memory: Memory | None = done.memory
        if done.half_cycle == until and memory is not None:
            cycle = first_cycle(self.problem, then.end, then.finer, then.number, then.warm)
            memory = replace(memory, cycle=replace(cycle, warm=NO_HEAT, end=replace(cycle.end, temperature=NO_HEAT)))
        return replace(done, worn=then.finer, totals=done.totals - off, memory=memory)

    def _fits(self, cycle: FrettingCycle) -> bool:
        """Return whether the contact has room on its grid: it grows before its rim is reached."""
        return not at_rim(self.system, (cycle.worn.punch > 0) | cycle.records.touched)

    def _load(self, cycles: float) -> float:
        """Return the factor of all loads after so many cycles."""
        return self.loading(cycles * self.strokes)

    def _cycle(self, state: RunState) -> FrettingCycle:
        """Return the cycle on the shape of a state: a new one where a stage of a program begins, or meshes are new."""
        memory, exchange = state.memory, self.system.exchange
        number = state.half_cycle // self.strokes
        cycle: FrettingCycle | None = None if memory is None else memory.cycle
        load = self._load(number)
        if cycle is None or memory is None or memory.made_of != self.setup.made_of or cycle.end.load != load:
            return first_cycle(self.problem, self.at(state, load), state.worn, number, self.temperature(state))
        if not exchange.conducts:
            return cycle
        (after,) = memory.warm
        end = replace(cycle.end, temperature=exchange.on_bases(after).values)
        return replace(cycle, end=end, warm=self.temperature(state))

    def _adds(self, now: FrettingCycle, then: FrettingCycle, cycles: float) -> Totals:
        """Return the additions of a jump: by the trapezoidal rule, but for the wear, which follows from its depths."""
        adds = [self.meter(cycle.records, cycle.first_step, cycle.rate) for cycle in (now, then)]
        totals = (adds[0] + adds[1]).times(cycles / 2)
        return with_worn(self.system, totals, then.worn - now.worn)


def _energy_ratio(records: TimeStepRecords, weights: Array) -> float:
    """Return friction's work of a half-cycle over twice its largest force times half the stroke."""
    stroke, most = float(np.ptp(records.displacement)), float(np.abs(records.force).max())
    return records.energy(weights) / max(most * stroke, 1e-300)


def _in_order(problem: PartialSlipProblem, cycle: FrettingCycle) -> list[tuple[int, TimeStepRecords, slice]]:
    """Return first step, records and place in the cycle's record of each half-cycle, in the order of the motion."""
    steps, ends = problem.program.steps, np.cumsum([len(records) for records in cycle.half_cycles])
    half_cycles = [
        ((cycle.first_step + int(end) - len(records)) % len(steps), records, slice(end - len(records), end))
        for records, end in zip(cycle.half_cycles, ends, strict=True)
    ]
    return sorted(half_cycles, key=lambda part: part[0])


class Meter:
    """Additions of time steps to the totals: see `fenwear.steps.run_state`.

    Args:
        system: The bodies.
        problem: Their loads.
    """

    def __init__(self, system: Tribosystem, problem: PartialSlipProblem) -> None:
        self.system, self.problem = system, problem
        self.thickness = system.bodies.punch.thickness

    def __call__(self, records: TimeStepRecords, first: int, worn: WornDepths) -> Totals:
        """Return the additions of time steps; the first has this number in the cycle, and all wear these depths."""
        weights, pressure = self.problem.weights, records.pressure
        path, forces = (pressure * records.slip_magnitude) @ weights, pressure @ weights
        distance = path / np.where(forces > 0, forces, 1.0)
        steps = self.problem.program.following(first, len(records))
        loads, drags = np.transpose([self._carried(records, k, step) for k, step in enumerate(steps)])
        work = self.thickness * records.energy(weights)
        sums = [distance.sum(), self.thickness * path.sum(), loads @ distance, drags @ distance, work, *np.zeros(4)]
        of = np.array([step.half_cycle for step in steps])
        share = records.duration / np.bincount(of, records.duration)[of]  # of its half-cycle: there may be several
        totals = Totals(np.array(sums), records.dissipated.sum(axis=0), share @ pressure)
        return with_worn(self.system, totals, worn)

    def _carried(self, records: TimeStepRecords, k: int, step: TimeStep) -> tuple[float, float]:
        """Return the force of a time step along the approach of the bodies, and the resultant of its friction, N."""
        position, pressure = self.problem.interface.position(step.offset), records.pressure[k]
        f = np.concatenate([pressure, records.traction[k].T.ravel()])
        force = self.thickness * position.in_space(f * position.weights)
        normal = self.thickness * (pressure * position.pair.weights)[:, None] * position.frame[:, 0]
        carried = (in_model(force, position.pair.punch.dim) * approach(position.rigid)).sum()
        return float(carried), float(np.linalg.norm((force - normal).sum(axis=0)))
