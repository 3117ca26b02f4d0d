"""A run from Python as on the command line: its program, meshes that follow the wear, properties of the temperature.

Half-cycle by half-cycle: heat, contact, wear, and the next half-cycle the other way.

Cycle jumps: N cycles in one implicit step, N chosen by an error estimate; the law of contact says how.

The error of all jumps of a run differs from the sum of their errors: a jump takes on what those before
it have left, and wear evens it out. Beside a state y a run may have its `finer`, y - e, where e continues as the next
jump takes it, and that jump's own error is added (the global error by local extrapolation beside the solution, as of R.
D. Skeel, BIT 26, 1986): how fast errors fade is found by the jumps themselves.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from math import ceil

import numpy as np

from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, ConvergenceError, InputError
from fenwear.steps.block import Block, HalfCycle
from fenwear.steps.driver import Jumps, RunLimits, Watching, run_steps
from fenwear.steps.program_stages import follow_program
from fenwear.steps.run_state import RunState, all_phases, beginning, on_exchange
from fenwear.steps.stability import NO_JUMPS, heat_gain
from fenwear.system import Tribosystem, with_reduced_heat

LATE = 1.5  # times the wear from which on meshes follow, at most at the end of a jump of several cycles


def jump(
    system: Tribosystem,
    half_cycles: int,
    *,
    tolerance: float,
    periodic_within: float | None = None,
    start: RunState | None = None,
) -> Iterator[Block]:
    """Yield the last cycle of every jump, in blocks; collective.

    Args:
        system: The assembled problem.
        half_cycles: Where to end, a whole number of cycles.
        tolerance: Largest estimated error of one jump, see `fenwear.steps.jump_method.Estimate`.
        periodic_within: Fraction of the pressure scale by which the pressure changes in a cycle where the run ends.
        start: State to continue from, such as the end of a block; by default the beginning.

    Raises:
        CaseError: `start` lies within a cycle, or the maps of the heat do not fit into the memory.
        ConvergenceError: the shortest jump did not converge; what came before it is yielded.
    """
    return jump_within(system, RunLimits(half_cycles, periodic_within), start, tolerance=tolerance)


def jump_within(
    system: Tribosystem, limits: RunLimits, start: RunState | None = None, *, tolerance: float, finer: bool = False
) -> Iterator[Block]:
    """Yield the last cycle of every jump, as `jump`, within limits; collective.

    Args:
        system: The assembled problem.
        limits: End, loads and stops.
        start: As of `jump`.
        tolerance: As of `jump`.
        finer: Whether to follow where jumps of next to no length would lead; from a start that has it, it is followed.
    """
    strokes = system.motion.half_cycles
    if start is not None and start.half_cycle % strokes:
        message = f"jumps start from a whole cycle only, got half-cycle {start.half_cycle}"
        raise CaseError(InputError("run.integration", message))
    watching = Watching(system.team, limits.watch)
    step: Jumps = system.law.jumps(system, tolerance, watching, limits.loading)
    state = on_exchange(start or beginning(step.system), step.system.exchange)  # before rank 0 leads
    if finer and state.finer is None:
        state = replace(state, finer=state)
    stops = frozenset(-(-stop // strokes) * strokes for stop in limits.stops)
    limits = replace(limits, half_cycles=limits.half_cycles // strokes * strokes, stops=stops, watch=watching)
    system.bodies.wear_on_meshes(state.worn, system.case)  # before rank 0 leads: the elements' heights take all ranks
    yield from run_steps(step.system, partial(_on_meshes, system, step), state, limits)


def _on_meshes(system: Tribosystem, step: Jumps, state: RunState, until: int) -> tuple[RunState, list[HalfCycle]]:
    """Return the state and the records of a jump, shortened where it wears far more than meshes are to follow."""
    after, recorded = step(state, until)
    before, worn = (
        system.team.lead(partial(system.bodies.wear_on_meshes, moment.worn, system.case)) for moment in (state, after)
    )
    strokes = system.motion.half_cycles
    cycles = (after.half_cycle - state.half_cycle) // strokes
    if worn <= LATE or before > 1 or cycles == 1:  # beyond it already: nobody has them follow
        return after, recorded
    fewer = ceil(cycles * max((1 + LATE) / 2 - before, 0.0) / (worn - before))
    return step(state, state.half_cycle + strokes * max(fewer, 1)) if fewer < cycles else (after, recorded)


def march(
    system: Tribosystem,
    half_cycles: int,
    *,
    implicit: bool = False,
    periodic_within: float | None = None,
    start: RunState | None = None,
) -> Iterator[Block]:
    """Yield all half-cycles, in blocks; collective.

    The explicit step wears the surface by the pressure on the shape at its start, as in the paper;
    the implicit one by the pressure on the shape at its end, and is stable for any step.

    Args:
        system: The assembled problem.
        half_cycles: The last one at most.
        implicit: Which of the two steps.
        periodic_within: Fraction of the pressure scale by which the pressure of a cycle differs from the one before
            where the run ends.
        start: The state to resume from, such as the end of a block; by default the beginning.

    Raises:
        ConvergenceError: a half-cycle, which it names, did not converge; all before it are yielded.
    """
    return march_within(system, RunLimits(half_cycles, periodic_within), start, implicit=implicit)


def march_within(
    system: Tribosystem, limits: RunLimits, start: RunState | None = None, *, implicit: bool = False
) -> Iterator[Block]:
    """Yield all half-cycles, as `march`, within limits; collective."""
    state = on_exchange(start or beginning(system), system.exchange)  # before rank 0 leads
    watching = Watching(system.team, limits.watch)
    step = system.law.half_cycles(system, watching, limits.loading, implicit=implicit)
    yield from run_steps(system, step, state, replace(limits, watch=watching))


def integrate(
    system: Tribosystem, limits: RunLimits, start: RunState | None = None, *, how: str, tolerance: float
) -> Iterator[Block]:
    """Yield the blocks within limits in the way that `run.integration` of a case names; collective.

    Args:
        system: The assembled problem.
        limits: End, loads and stops.
        start: The state to resume from; by default the beginning.
        how: "explicit", "implicit" or "jump".
        tolerance: Of jumps.
    """
    if how == "jump":
        return _naming_feedback(system, jump_within(system, limits, start, tolerance=tolerance))
    return march_within(system, limits, start, implicit=how == "implicit")


def _naming_feedback(system: Tribosystem, blocks: Iterator[Block]) -> Iterator[Block]:
    """Yield the blocks of jumps; name thermoelastic feedback where it makes them fail; collective."""
    pressure: Array = np.zeros((0, 0))
    try:
        for block in blocks:
            pressure = all_phases(block.end.contacts).pressure
            yield block
    except ConvergenceError as error:
        system = with_reduced_heat(system)
        at = [None, pressure] if len(pressure) else [None]  # bands of few nodes have less
        gain = max(heat_gain(system, pressure) or 0.0 for pressure in at)
        if gain < 1:
            raise
        raise type(error)(
            f"{error}. Within a half-cycle, friction heat raises the pressure by up to {gain:.3g} times itself. "
            f"{NO_JUMPS}"
        ) from error


def evolve(
    system: Tribosystem,
    half_cycles: int | None = None,
    *,
    integration: str | None = None,
    tolerance: float | None = None,
    start: RunState | None = None,
) -> Iterator[Block]:
    """Yield the blocks of a run as `fenwear run` computes them, without its folder; collective.

    Meshes follow large wear, properties the temperature, and loads, motion and surroundings the program of the case.

    Args:
        system: Of a case.
        half_cycles: The last one at most; by default that of the case.
        integration: "explicit", "implicit" or "jump"; by default that of the case.
        tolerance: Of jumps; by default that of the case.
        start: The state to resume from, such as the end of a block; by default the beginning.

    Raises:
        ConvergenceError: a half-cycle did not converge; all before it are yielded.
        MeshQualityError: an element does not survive the motion of its mesh.
    """
    run = system.case.run
    last, how = half_cycles or run.half_cycles, integration or run.integration
    if how == "jump":
        system = with_reduced_heat(system)
        strokes = system.motion.half_cycles
        last = last // strokes * strokes
    way = partial(integrate, how=how, tolerance=tolerance or run.jump_tolerance)
    for block in follow_program(system, way, RunLimits(last, run.periodic_within), start):
        yield block
        if block.end.half_cycle >= last:
            return
