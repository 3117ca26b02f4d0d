"""A run from Python as on the command line: its program, meshes that follow the wear, properties of the temperature.

Half-cycle by half-cycle: heat, contact, wear, and the next half-cycle the other way.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from fenwear.common.arrays import Array
from fenwear.common.errors import ConvergenceError
from fenwear.steps.block import Block
from fenwear.steps.cycle_jumps import jump_within
from fenwear.steps.driver import RunLimits, Watching, run_steps
from fenwear.steps.program_stages import Span, follow_program
from fenwear.steps.run_state import RunState, all_phases, beginning, on_exchange
from fenwear.steps.uniqueness import NO_JUMPS, heat_gain
from fenwear.system import Tribosystem, with_reduced_heat


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
    return march_within(system, RunLimits(half_cycles, periodic_within), implicit=implicit, start=start)


def march_within(
    system: Tribosystem, limits: RunLimits, *, implicit: bool = False, start: RunState | None = None
) -> Iterator[Block]:
    """Yield all half-cycles, as `march`, within limits; collective."""
    state = on_exchange(start or beginning(system), system.exchange)  # before rank 0 leads
    watching = Watching(system.team, limits.watch)
    step = system.contact_law.half_cycles(system, watching, limits.loading, implicit=implicit)
    yield from run_steps(system, step, state, replace(limits, watch=watching))


def integrate(
    system: Tribosystem, how: str, limits: RunLimits, tolerance: float, start: RunState | None = None
) -> Iterator[Block]:
    """Yield the blocks within limits in the way that `run.integration` of a case names; collective.

    Args:
        system: The assembled problem.
        how: "explicit", "implicit" or "jump".
        limits: End, loads and stops.
        tolerance: Of jumps.
        start: The state to resume from; by default the beginning.
    """
    if how == "jump":
        return _told_of_heat(system, jump_within(system, limits, tolerance=tolerance, start=start))
    return march_within(system, limits, implicit=how == "implicit", start=start)


def _told_of_heat(system: Tribosystem, blocks: Iterator[Block]) -> Iterator[Block]:
    """Yield the blocks of jumps; name thermoelastic feedback where it makes them fail; collective."""
    pressure: Array = np.zeros((0, 0))
    try:
        for block in blocks:
            pressure = all_phases(block.end.contacts).pressure
            yield block
    except ConvergenceError as error:
        system = with_reduced_heat(system)
        at = [None, pressure] if len(pressure) else [None]  # bands of few nodes have less
        gain = max(heat_gain(system, own) or 0.0 for own in at)
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

    def over(
        own: Tribosystem, state: RunState | None, leave: Callable[[RunState], bool], span: Span
    ) -> Iterator[Block]:
        limits = span.limits(run.periodic_within, leave=leave)
        return integrate(own, how, limits, tolerance or run.jump_tolerance, state)

    if how == "jump":
        system = with_reduced_heat(system)
        strokes = system.motion.half_cycles
        last = last // strokes * strokes
    for block in follow_program(system, over, last, start):
        yield block
        if block.end.half_cycle >= last:
            return
