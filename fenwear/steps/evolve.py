"""A run from Python as on the command line: its program, meshes that follow the wear, properties of the temperature.

Half-cycle by half-cycle: heat, contact, wear, and the next half-cycle the other way.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from fenwear.common.arrays import Array
from fenwear.common.errors import ConvergenceError
from fenwear.steps.block import Block
from fenwear.steps.cycle_jumps import jump
from fenwear.steps.driver import BLOCK, Loading, RunLimits, Watch, Watching, as_given, run_steps, unwatched
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
    block: int = BLOCK,
    start: RunState | None = None,
    stops: frozenset[int] = frozenset(),
    leave: Callable[[RunState], bool] = lambda _: False,
    watch: Watch = unwatched,
    loading: Loading = as_given,
) -> Iterator[Block]:
    """Yield all half-cycles, in blocks; collective.

    The explicit step wears the surface by the pressure on the shape at its start, as in the paper;
    the implicit one by the pressure on the shape at its end, and is stable for any step.

    Args:
        system: The assembled problem.
        half_cycles: The last one at most.
        implicit: Which of the two steps.
        periodic_within, block, stops, leave, watch: As of `fenwear.steps.driver.RunLimits`.
        start: The state to resume from, such as the end of a block; by default the beginning.
        loading: Factor of all loads; that in the middle of a half-cycle acts in it.

    Raises:
        ConvergenceError: a half-cycle, which it names, did not converge; all before it are yielded.
        InterruptedRunError: as `watch`.
    """
    state = on_exchange(start or beginning(system), system.exchange)  # before rank 0 leads
    watching = Watching(system.team, watch)
    course = RunLimits(half_cycles, periodic_within, block, stops, leave, watching)
    step = system.contact_law.half_cycles(system, watching, loading, implicit=implicit)
    yield from run_steps(system, step, state, course)


def integrate(system: Tribosystem, how: str, span: Span, tolerance: float, **course: Any) -> Iterator[Block]:
    """Yield the blocks of a span in the way that `run.integration` of a case names; collective.

    Args:
        system: The assembled problem.
        how: "explicit", "implicit" or "jump".
        span: Length, and loads.
        tolerance: Of jumps.
        course: Common part of `march` and `jump`: where it starts, and what ends it before.
    """
    if how == "jump":
        return _told_of_heat(system, jump(system, span.until, tolerance=tolerance, loading=span.loading, **course))
    return march(system, span.until, implicit=how == "implicit", loading=span.loading, **course)


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
            f"{error}; within a half-cycle, friction heat raises the pressure by up to {gain:.3g} times "
            f"itself: {NO_JUMPS}"
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
        bound = tolerance or run.jump_tolerance
        within = span.periodic_within(run.periodic_within)
        return integrate(own, how, span, bound, start=state, leave=leave, periodic_within=within)

    if how == "jump":
        system = with_reduced_heat(system)
        strokes = system.motion.half_cycles
        last = last // strokes * strokes
    for block in follow_program(system, over, last, start):
        yield block
        if block.end.half_cycle >= last:
            return
