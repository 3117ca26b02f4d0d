"""Gross sliding: every node slips in the direction of the motion; its steps over half-cycles and over many cycles.

A half-cycle is solved phase by phase (`phase`). A jump takes the implicit step of `jump_step`, whole and in two halves.
A third of their difference is the error estimate of the halves, which are kept: of the depths, of the pressures and of
the temperatures, see `jump_method`.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial, reduce
from typing import Any

import numpy as np

from fenwear.case import Case
from fenwear.case.body_names import with_body_names
from fenwear.common.errors import MARCHED, SHORTER_JUMPS, SMALLER_STEPS, CaseError, ConvergenceError, InputError
from fenwear.contact import ContactState
from fenwear.heat.temperature import HeatState
from fenwear.laws.layers import PLASTIC
from fenwear.laws.wear import WornDepths
from fenwear.steps.block import HalfCycle, PhaseRecord, heat_of_phases
from fenwear.steps.driver import Loading, Watch
from fenwear.steps.jump_method import Attempt, Estimate, Lengths
from fenwear.steps.jump_step import Stepper
from fenwear.steps.phase import PhaseEnd, PhaseStep
from fenwear.steps.run_state import RunState, Totals, all_phases, carried_by
from fenwear.steps.steady import SteadyState, steady_state
from fenwear.surfaces.motion import DEFAULT_POSITIONS
from fenwear.system import (
    Bodies,
    ContactLaw,
    ContactSetup,
    Preparation,
    Sliding,
    Tribosystem,
    at_rim,
    build_conduction,
    elastic,
    heating_frictions,
    in_parts,
    joined,
    make_sliding,
    on_first_contact,
    on_sufficient_grid,
    place_case_bodies,
    preparation,
    property_change,
    with_exchange,
    with_reduced_heat,
)
from fenwear.system.contact_laws import GROSS
from fenwear.system.tribosystem import answers_for, condense_bodies, layer_conductance
from fenwear.system.variants import same_conduction

WARMED = 2.0  # times heat.property_tolerance that properties may change by in a jump of several cycles
_Made = tuple[
    Attempt[Any] | None, RunState, list[HalfCycle]
]  # a jump, None where it was marched; its end, its last cycle
CARRIED = 1e-6  # of the loads: what the contact carries by rounding
PARTS = (5, 25)  # of each phase; odd, so that one is in the middle


class SmallerSteps:
    """Half-cycles that do not converge, tried again from where they began in smaller steps.

    Each phase is cut into parts of equal time at the same position of the strip. Each part has a contact of its own,
    wears its share, and heats for its share of the time. Their data are made at the first one and kept.

    Args:
        system: The assembled problem.
        implicit: Whether the wear of a part is implicit.
    """

    def __init__(self, system: Tribosystem, *, implicit: bool) -> None:
        self.system, self.implicit = system, implicit
        self._steps: dict[int, list[PhaseStep]] = {}
        system.team.serve(self)

    def half_cycle(self, state: RunState, phases: range, error: ConvergenceError, load: float = 1.0) -> list[PhaseEnd]:
        """Return the ends of the phases of a half-cycle.

        Args:
            state: At its start.
            phases: Their numbers in the cycle.
            error: Why it is not solved as a whole.
            load: Factor of all loads.

        Raises:
            ConvergenceError: it does not converge in the smallest parts either; `error` as it was.
        """
        for parts in PARTS:
            try:
                ends = self._in_parts(state, phases, parts, load)
            except ConvergenceError:
                continue
            self.system.remedies.note(SMALLER_STEPS.format(parts * len(phases)))
            return ends
        raise error

    def _in_parts(self, state: RunState, phases: range, parts: int, load: float) -> list[PhaseEnd]:
        steps = self._prepared(parts)
        temperature, worn, ends = state.temperature, state.worn, []
        for phase in phases:
            before, place = state.contacts[phase], phase - phases.start
            contact, part_ends = before, []
            for part, step in enumerate(steps[phase * parts : (phase + 1) * parts]):
                done = state.half_cycle + (place + (part + 0.5) / parts) / len(phases)
                end = step.solve(temperature, worn, contact, load, done)
                contact, temperature, worn = end.record.contact, end.temperature, worn + end.worn
                part_ends.append(end)
            ends.append(_joined_parts(part_ends, phase, before, temperature))
        return ends

    def _prepared(self, parts: int) -> list[PhaseStep]:
        if parts not in self._steps:
            self.system.team.each(self, "prepare", parts)
        return self._steps[parts]

    def prepare(self, parts: int) -> None:
        """Make the steps; collective."""
        system = in_parts(self.system, parts)
        phases = range(len(system.motion.phases))
        self._steps[parts] = [PhaseStep(system, phase, implicit=self.implicit) for phase in phases]


def _joined_parts(ends: list[PhaseEnd], phase: int, before: ContactState, temperature: HeatState | None) -> PhaseEnd:
    """Return the parts of a phase as one: the contact in its middle, and all that it wears and heats."""
    middle = ends[len(ends) // 2].record
    adds = reduce(Totals.__add__, [end.record.adds for end in ends])
    return PhaseEnd(
        PhaseRecord(phase, middle.contact, before.pressure[0], adds, middle.friction_ratio),
        temperature,
        heat_of_phases(end.heat for end in ends),
        reduce(WornDepths.__add__, [end.worn for end in ends]),
    )


class HalfCycles:
    """Steps of one half-cycle."""

    def __init__(self, system: Tribosystem, watch: Watch, loading: Loading, *, implicit: bool) -> None:
        self.system, self.watch, self.loading = system, watch, loading
        phases = range(len(system.motion.phases))
        self.steps = [PhaseStep(system, phase, implicit=implicit) for phase in phases]
        self.smaller = SmallerSteps(system, implicit=implicit)
        self._of_cycle = system.phases.ways.asked  # whether a coefficient depends on what a whole cycle does

    def __call__(self, state: RunState, _until: int, /) -> tuple[RunState, list[HalfCycle]]:
        """Return the state after the next half-cycle, and its record."""
        motion = self.system.motion
        first = state.half_cycle % motion.half_cycles * motion.positions
        phases = range(first, first + motion.positions)
        load = self.loading(state.half_cycle + 0.5)
        try:
            ends = self._phase_ends(state, phases, load)
        except ConvergenceError as error:
            ends = self.smaller.half_cycle(state, phases, error, load)
        worn, totals, contacts = state.worn, state.totals, list(state.contacts)
        for phase, end in zip(phases, ends, strict=True):
            worn, totals, contacts[phase] = worn + end.worn, totals + end.record.adds, end.record.contact
        heat = heat_of_phases(end.heat for end in ends)
        number = state.half_cycle + 1
        after = RunState(number, worn, tuple(contacts), ends[-1].temperature, totals)
        return after, [HalfCycle(number, [end.record for end in ends], worn, totals, heat, load)]

    def _phase_ends(self, state: RunState, phases: range, load: float) -> list[PhaseEnd]:
        """Return the ends of the phases of a half-cycle, each solved as a whole."""
        worn, temperature = state.worn, state.temperature
        ends: list[PhaseEnd] = []
        known = all_phases(state.contacts).pressure if self._of_cycle else np.zeros((0, 0))
        cycle = self.system.phases.ways.shear(known) if len(known) else None
        for number, phase in enumerate(phases):
            if number:
                self.watch()
            done = state.half_cycle + (number + 0.5) / len(phases)
            near = ends[-1].record.contact if ends and self.system.motion.steps else None
            end = self.steps[phase].solve(temperature, worn, state.contacts[phase], load, done, near, cycle)
            worn, temperature = worn + end.worn, end.temperature
            ends.append(end)
        return ends


class Jumps:
    """Steps of as many cycles as the tolerance allows, and the materials whose properties change with the warmth."""

    def __init__(self, stepper: Stepper, tolerance: float) -> None:
        self.stepper, self.tolerance = stepper, tolerance
        self.system = stepper.system
        self._half_cycles: HalfCycles | None = None
        stepper.system.team.serve(self)

    def prepare(self) -> None:
        """Make the steps of half-cycles; collective."""
        self._half_cycles = HalfCycles(self.system, self.stepper.watch, self.stepper.loading, implicit=True)

    def _marched(self, state: RunState) -> tuple[RunState, list[HalfCycle]]:
        """Return the state after one cycle of half-cycles, and its record.

        Raises:
            ConvergenceError: a half-cycle did not converge.
        """
        if self._half_cycles is None:
            self.system.team.each(self, "prepare")
        assert self._half_cycles is not None
        after, recorded = state, list[HalfCycle]()
        for _ in range(self.system.motion.half_cycles):
            after, half_cycles = self._half_cycles(after, after.half_cycle + 1)
            recorded += half_cycles
        return replace(after, finer=None if state.finer is None else after), recorded

    def change(self, temperature: HeatState | None) -> float:
        """Return the largest change of a property at temperatures; collective."""
        return property_change(self.stepper.system, temperature)

    def __call__(self, state: RunState, until: int, /) -> tuple[RunState, list[HalfCycle]]:
        """Return the state after the next jump that is accurate enough, and its last cycle."""
        stepper, tolerance = self.stepper, self.tolerance
        strokes, given = stepper.system.motion.half_cycles, tolerance == float("inf")  # where jumps end
        left = (until - state.half_cycle) // strokes
        # What flows in a first cycle, or as a load rises, depends on the order of the phases and on what they heat.
        if self.system.layers.hardness < np.inf and (left == 1 or not given):
            after, recorded = self._marched(state)
            if not state.contacts[0].solved or self._flown(state, after) > tolerance or given:
                return after, recorded

        def made(cycles: float) -> tuple[_Made, Estimate]:
            number = state.half_cycle + int(cycles) * strokes
            try:
                jump, estimate, recorded = stepper.attempt(state, int(cycles))
            except ConvergenceError:
                stepper.system.remedies.note(SHORTER_JUMPS if cycles > 1 else MARCHED)
                if cycles > 1:
                    raise
                end, recorded = self._marched(state)
                return (None, end, recorded), Estimate(np.inf, np.inf, np.inf)  # it says nothing of the error
            return (jump, stepper.state(jump.end, number), recorded), estimate

        def fits(made: _Made) -> bool:
            """Whether the grid has room, which grows before its rim is reached, and properties have changed little."""
            _, end, _ = made
            if at_rim(stepper.system, carried_by(end)):
                return False
            return given or stepper.system.team.each(self, "change", end.temperature) <= WARMED

        lengths = Lengths(tolerance)
        (jump, after, recorded), _, _, length = lengths.accepted(state.jump_length, lambda _: left, made, fits)
        after = replace(after, jump_length=length)
        return after if state.finer is None else replace(after, finer=stepper.finer(jump, after)), recorded

    def _flown(self, before: RunState, after: RunState) -> float:
        """Return the volume that surfaces flow in a step, over all that has flown."""
        row, weights = self.system.layers.row(PLASTIC), self.system.pair.weights
        first, last = (float(weights @ state.worn.between[row]) for state in (before, after))
        return (last - first) / max(last, 1e-300)


class GrossSliding:
    """The law of gross sliding."""

    name = GROSS
    sticks = False
    memory: type | None = None

    def of_bodies(self, case: Case, bodies: Bodies, *, heat: Preparation, fresh: bool) -> Tribosystem:
        """Return the system of a case whose bodies are built; collective."""
        system = on_first_contact(elastic(self._placed(case, bodies), fresh=fresh))
        if heat == "none":
            return system
        return (with_reduced_heat if heat == "reduced" else with_exchange)(system, keep=True, fresh=fresh)

    def renewed(self, system: Tribosystem, bodies: Bodies) -> Tribosystem:
        """Return the system of the same case with the meshes or properties that these bodies have; collective."""
        placed = self._placed(system.case, bodies, _sliding_as(system, system.case))
        condensed = system.elastic.condensed if bodies.punch is system.bodies.punch else condense_bodies(placed)
        return _with_heat_as(system, joined(placed, condensed), keep=bodies.warmed is None)

    def varied(self, system: Tribosystem, case: Case) -> Tribosystem:
        """Return the system of another case; collective.

        Loads, friction, wear, motion and the exchange of heat factor no stiffness again; another motion prepares the
        steps of heat again.
        """
        before, bodies, condensed = system.case, system.bodies, system.elastic.condensed
        sliding: Sliding = system.sliding
        if (before.motion, before.contact, before.wear) != (case.motion, case.contact, case.wear):
            sliding = _sliding_as(system, case)
        if before.loading != case.loading:
            bodies = bodies.under(case)
        conducts_alike = same_conduction(before, case)
        if not conducts_alike:
            bodies = replace(bodies, heat=build_conduction(case, bodies.punch, bodies.strip, bodies.warmed))
        placed = self._placed(case, bodies, sliding)
        if not answers_for(system, placed):
            condensed = condense_bodies(placed)
        elif (bodies.punch, bodies.strip) != (system.bodies.punch, system.bodies.strip):
            condensed = condensed.under_loads(bodies)
        if not system.exchange.conducts or case.heat is None:
            return joined(placed, condensed)
        if not conducts_alike or placed.motion != system.motion:
            return _with_heat_as(system, joined(placed, condensed))
        exchange = system.exchange.varied(case.heat, heating_frictions(placed))
        return joined(placed, condensed, exchange.through(layer_conductance(placed)))

    def _placed(self, case: Case, bodies: Bodies, sliding: Sliding | None = None) -> ContactSetup:
        return replace(place_case_bodies(case, bodies, sliding), law=self)

    def elastic_length(self, system: Tribosystem) -> float:
        """Return the gap that unit pressures open on average, mm/MPa."""
        return system.elastic.interface.elastic_length

    @with_body_names
    def check_touching(self, system: Tribosystem) -> None:
        """Make sure that the surfaces touch in some phase; collective.

        Raises:
            CaseError: they never meet, or supports carry all of the load.
            ConvergenceError: the contact of a phase did not converge.
        """
        gaps = []
        for phase in range(len(system.motion.phases)):
            contact = system.phase_contact((phase,)).solve(system.gap(phase, system.unworn()))
            if contact.pressure.max() > 0:
                _check_carried(system, float(system.sliding.pairs[phase].weights @ contact.pressure[0]))
                return
            gaps.append(float(contact.gap.min()))
        raise CaseError(
            InputError(
                "geometry",
                f"the surfaces never meet within the stroke: under load they stay {min(gaps):.3g} mm apart. "
                "Let the punch's supports free its motion towards the strip, or start in contact",
            )
        )

    def end(self, system: Tribosystem, properties_within: float | None = None) -> SteadyState:
        """Return the cyclic steady state; collective."""
        find = partial(steady_state, properties_within=properties_within)
        return on_sufficient_grid(system, find, lambda state: np.asarray((state.phase_pressure > 0).any(axis=0)))[1]

    def on_other_grid(self, memory: Any, before: Tribosystem, after: Tribosystem) -> Any:  # noqa: ARG002
        """Return the memory of the steps, which does not depend on the grid."""
        return memory

    def half_cycles(self, system: Tribosystem, watch: Watch, loading: Loading, *, implicit: bool) -> HalfCycles:
        """Return the step of one half-cycle."""
        return HalfCycles(system, watch, loading, implicit=implicit)

    def jumps(self, system: Tribosystem, tolerance: float, watch: Watch, loading: Loading) -> Jumps:
        """Return the step of many cycles."""
        return Jumps(Stepper(system, tolerance, watch, loading), tolerance)


def _check_carried(system: Tribosystem, force: float) -> None:
    """Raise where supports carry all of the loads.

    Args:
        system: The bodies.
        force: Of the contact, N/mm in the plane, N else.
    """
    bodies = (system.bodies.punch, system.bodies.strip)
    given = max(float(np.abs(body.given).max(initial=0.0)) for body in bodies)
    moved = system.rigid.mode_names or any(body.moved for body in bodies)
    if moved or force * bodies[0].thickness > CARRIED * given:
        return
    raise CaseError(
        InputError(
            "punch.supports",
            f"the supports carry all of the load of {given:.4g} N, and none of it reaches the contact. Free the "
            "punch along the contact's normal, or move a support `by` an approach in place of the load",
        )
    )


def _sliding_as(system: Tribosystem, case: Case) -> Sliding:
    """Return the sliding of a case in as many positions as a system has, where the case leaves them open."""
    least = 0 if system.motion.steps else system.motion.positions
    return make_sliding(case, positions=max(DEFAULT_POSITIONS, least))


def _with_heat_as(system: Tribosystem, new: Tribosystem, *, keep: bool = False) -> Tribosystem:
    """Return a new system with its heat prepared as that of another one; collective."""
    prepared = preparation(system)
    if prepared == "none":
        return new
    return (with_reduced_heat if prepared == "reduced" else with_exchange)(new, keep=keep)


LAW: ContactLaw = GrossSliding()
