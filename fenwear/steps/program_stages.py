"""Test programs: stages of constant motion and surroundings one after the other, each on the operators of the last.

A stage begins with the depths and temperatures that the stage before it has left. Loads may change within it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from fenwear.case import Case, Cycle
from fenwear.case.program import Stage, held_at, stages_of
from fenwear.common.errors import CaseError, InputError
from fenwear.steps.block import Block
from fenwear.steps.driver import Loading, RunLimits, as_given
from fenwear.steps.run_state import RunState, carried_by, on_other_grid, with_phases
from fenwear.steps.slow_changes import Integrate, follow
from fenwear.system import Clock, ContactSetup, Tribosystem, grows, regridded, with_case, with_room

MOST_RECURRING = 16  # systems of stages that are held at once, each with its steps of heat


def follow_program(
    system: Tribosystem, integrate: Integrate, limits: RunLimits, start: RunState | None = None
) -> Iterator[Block]:
    """Yield the blocks of a run over the program of its case, whose meshes follow large wear; collective.

    Args:
        system: The assembled problem, of the case as it stands without its program.
        integrate: Yields the blocks on one system within limits, such as `march_within`.
        limits: Of all stages. Only the last one may end before, where its cycles repeat.
        start: State to continue from; by default the beginning.

    Raises:
        CaseError: a load is given where supports and not the contact carry the loads.
        ConvergenceError: as `integrate`.
        MeshQualityError: an element does not survive the motion of its mesh.
    """
    stages = stages_of(system.case)
    if not stages:
        yield from follow(system, integrate, limits, start)
        return
    base, state, again = system, start, Recurring(stages)
    for stage in stages:
        done = 0 if state is None else state.half_cycle
        if stage.end <= done:
            continue
        if stage.begin >= limits.half_cycles:
            return
        until, loading = min(stage.end, limits.half_cycles), loading_of(base, stage)
        repeats = limits.periodic_within if stage is stages[-1] else None
        within = replace(limits, half_cycles=until, periodic_within=repeats, loading=loading)

        def adapt(moved: Tribosystem, stage: Stage = stage) -> Tribosystem:
            nonlocal base
            base = moved
            again.forget()
            return again.at_stage(base, stage)

        larger, state = _with_larger_grid(base, stage, state, loading(max(done, stage.begin)))
        if larger is not base:
            base = larger
            again.forget()
        staged = again.at_stage(base, stage)
        for block in follow(staged, integrate, within, with_phases(state, len(staged.motion.phases)), adapt):
            yield block
            state = block.end
            if state.half_cycle >= until:  # what it asks for by now the next stage has
                break


def _with_larger_grid(
    base: Tribosystem, stage: Stage, state: RunState | None, load: float
) -> tuple[Tribosystem, RunState | None]:
    """Return both on a grid that has room for the contact under loads that begin to act; collective.

    Args:
        base: Of the case.
        stage: Stage that begins, or within which a run continues: its grid grows as it would have, not to a wider one.
        state: Where a run is; None at its beginning, whose grid is around its first contact.
        load: Factor of all loads.
    """
    while state is not None and state.half_cycle == stage.begin and grows(base):
        staged = at_stage(base, stage)
        grid = with_room(staged, state.worn, carried_by(state), load)
        if grid is None:
            break
        base, before = regridded(base, grid), with_phases(state, len(staged.motion.phases)) or state
        state = on_other_grid(before, staged, at_stage(base, stage))
    return base, state


def at_stage(system: Tribosystem, stage: Stage) -> Tribosystem:
    """Return the system with the motion and surroundings of a stage, sharing all operators that they leave; collective.

    Args:
        system: Of the case, on meshes as they are now.
        stage: Of its program.
    """
    return _at_its_time(system.law.varied(system, stage.case), system, stage)


def _at_its_time(staged: Tribosystem, system: Tribosystem, stage: Stage) -> Tribosystem:
    return replace(
        staged,
        case=system.case,
        sliding=replace(staged.sliding, clock=Clock(stage.begin, stage.time, stage.slid)),
    )


class Recurring:
    """The systems of stages that come again in their program: the heat of a motion may take longer than its cycles."""

    def __init__(self, stages: Sequence[Stage]) -> None:
        """Take the stages of a program."""
        self._cases, self._made = [stage.case for stage in stages], list[tuple[Case, Tribosystem]]()

    def forget(self) -> None:
        """Make all further systems on other meshes."""
        self._made.clear()

    def at_stage(self, system: Tribosystem, stage: Stage) -> Tribosystem:
        """Return the bodies of a stage, as the function `at_stage`; collective."""
        known = next((made for case, made in self._made if case == stage.case), None)
        staged = at_stage(system, stage) if known is None else _at_its_time(known, system, stage)
        if known is None and self._cases.count(stage.case) > 1 and len(self._made) < MOST_RECURRING:
            self._made.append((stage.case, staged))
        return staged


def loading_of(system: Tribosystem, stage: Stage) -> Loading:
    """Return the factor of all loads over a stage, linear in the half-cycles.

    Raises:
        CaseError: a load is given where supports and not the contact carry the loads, or the hardness does not carry
            it.
    """
    ends = stage.load_factor
    if stage.load is not None:
        nominal = _nominal(system, f"program.steps.{stage.step}.load")
        ends = stage.load[0] / nominal, stage.load[1] / nominal
    mean = max(ends) * system.rigid.mean_pressure
    if system.layers.hardness <= mean:
        message = f"expected more than the mean pressure of {mean:.6g} MPa in program.steps.{stage.step}"
        raise CaseError(InputError("contact.hardness", f"{message}, which no softer surface carries"))
    if ends == (1.0, 1.0):
        return as_given
    first, last = ends

    def loading(half_cycles: float) -> float:
        share = (half_cycles - stage.begin) / (stage.end - stage.begin)
        return first + share * (last - first)

    return loading


def _nominal(placed: ContactSetup, key: str) -> float:
    """Return the normal force of the loads of a case, N."""
    if placed.normal_force <= 0:
        raise CaseError(InputError(key, "expected load_factor: supports carry the loads, not the contact alone"))
    return placed.normal_force


def held(placed: ContactSetup, step: int | None = None) -> tuple[Case, str]:
    """Return the case with the conditions at the end of a program's step, held for ever, and the step in words.

    Args:
        placed: The bodies of the case.
        step: Number of the step, from 0; by default the last.

    Returns:
        Without a program the case itself and "".

    Raises:
        CaseError: there is no such step, nothing slides at its end, or a load is given where supports and not the
            contact carry the loads.
    """
    held_stage = held_at(placed.case, step)
    if held_stage is None:
        return placed.case, ""
    factor = held_stage.load_factor
    if held_stage.load is not None:
        factor = held_stage.load / _nominal(placed, f"{held_stage.key}.load")
    force = placed.normal_force * factor
    acts = f"normal force {force:,.6g} N" if force else f"all loads times {factor:.6g}"
    step_text = f"step {held_stage.step + 1} of {held_stage.steps} of the program ({held_stage.key})"
    text = f"{step_text}, as it ends, held for ever: {acts}"
    return loads_times(held_stage.case, factor), text


def at_step(system: Tribosystem, step: int | None = None) -> Tribosystem:
    """Return the system under the conditions at the end of a program's step, held for ever; collective.

    A system of a case without a program is returned as it is. Operators that the step leaves are shared.

    Args:
        system: Of a case.
        step: Number of the step from 0; by default the last.

    Raises:
        CaseError: there is no such step, nothing slides at its end, or a load is given where supports and not the
            contact carry the loads.
    """
    case, text = held(system, step)
    return with_case(system, case) if text else system


def loads_times(case: Case, factor: float) -> Case:
    """Return the case with all its loads times a factor."""
    if factor == 1:
        return case
    bodies: dict[str, Any] = {
        name: body.model_copy(update={"loads": tuple(load.times(factor) for load in body.loads)})
        for name, body in case.bodies.items()
    }
    motion = case.motion
    if isinstance(motion, Cycle) and motion.load is not None:
        load = motion.load.model_copy(update={"factor": factor * motion.load.factor})
        bodies["motion"] = motion.model_copy(update={"load": load})
    return case.model_copy(update=bodies)


def at_loads(system: Tribosystem, factor: float) -> Tribosystem:
    """Return the system under all its loads times a factor; collective."""
    if factor == 1:
        return system
    case = loads_times(system.case, factor)
    loaded = tuple(
        bodies.under(case, phase.fraction) for bodies, phase in zip(system.loaded, system.motion.phases, strict=True)
    )
    return replace(system, loaded=loaded)
