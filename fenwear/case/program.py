"""Test programs: tables over cycles, distance or time, read and cut into stages of constant motion."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from fenwear.case.motion_table import Cycle, OneWay, Rotation, Tabulated
from fenwear.case.run_tables import ProgramStep
from fenwear.case.schema import Case
from fenwear.common.csv_table import CsvTable, read_csv
from fenwear.common.errors import CaseError, InputError

LENGTHS = {"cycles": "", "distance": "mm", "time": "s"}
COLUMNS = {
    "load": "N",
    "load_factor": "",
    "speed": "mm/s",
    "angular_speed": "rad/s",
    "amplitude": "mm",
    "angular_frequency": "rad/s",
    "period": "s",
    "ambient": "K",
}
MOTION = ("speed", "angular_speed", "amplitude", "angular_frequency", "period")
MIDDLES = (np.arange(200) + 0.5) / 200  # of a ramp, over which durations are averaged


@dataclass(frozen=True)
class Stage:
    """Cycles of constant motion and ambient temperature, over which loads may change linearly.

    Attributes:
        begin, end: Half-cycles before its first, and its last one.
        case: With its motion and ambient temperature.
        load: The normal force at its begin and end, N; None where it is not given.
        load_factor: All loads over those of the case, where `load` is None.
        time: At its begin, s.
        slid: Before its begin, mm or rad.
        step: Number of the program's step.
    """

    begin: int
    end: int
    case: Case
    load: tuple[float, float] | None
    load_factor: tuple[float, float]
    time: float
    slid: float
    step: int


@dataclass(frozen=True)
class Held:
    """Loads, motion and temperatures at the end of a step of a program, held constant.

    Attributes:
        step: Its number, from 0.
        steps: Number of steps of the program.
        case: With its motion and ambient temperature, and without a program.
        load: The normal force, N; None where it is not given.
        load_factor: All loads over those of the case, where `load` is None.
    """

    step: int
    steps: int
    case: Case
    load: float | None
    load_factor: float

    @property
    def key(self) -> str:
        """The key of the step in a case."""
        return f"program.steps.{self.step}"


def read_program(path: Path) -> list[dict[str, Any]]:
    """Return the steps of a table in a CSV file: straight lines between its rows, jumps where one is repeated.

    Args:
        path: Of the file; one of the columns cycles, distance and time comes first, each heading has its unit.

    Raises:
        CaseError: it cannot be read, runs backwards or overlaps; names column and row.
    """
    table = read_csv(path, "program.file", {**LENGTHS, **COLUMNS}, least=2)
    names, values = table.names, table.rows
    if names[0] not in LENGTHS or any(name in LENGTHS for name in names[1:]) or len(set(names)) < len(names):
        raise table.wrong("expected one of cycles, distance and time as the first column, and no column twice")
    if len(names) < 2:
        raise table.wrong(f"expected a column of what changes: {', '.join(COLUMNS)}")
    _check_order(table)
    steps = []
    for before, after in itertools.pairwise(values):
        length = after[0] - before[0]
        if length > 0:
            step: dict[str, Any] = {names[0]: round(length) if names[0] == "cycles" else length}
            step |= {
                name: [a, b] if a != b else [a] for name, a, b in zip(names[1:], before[1:], after[1:], strict=True)
            }
            steps.append(step)
    return steps


def _check_order(table: CsvTable) -> None:
    """Raise where a table does not begin at zero, runs backwards, or has a place more than twice."""
    name, lines, places = table.names[0], table.lines, [row[0] for row in table.rows]
    for line, place in zip(lines, places, strict=True):
        if name == "cycles" and place != round(place):
            raise table.wrong(f"row {line}: cycles: expected a whole number, got {place:g}")
    if places[0] != 0:
        raise table.wrong(f"row {lines[0]}: expected {name} = 0 in the first row, got {places[0]:g}")
    for k in range(1, len(places)):
        if places[k] < places[k - 1]:
            raise table.wrong(f"row {lines[k]}: {name} runs backwards, from {places[k - 1]:g} to {places[k]:g}")
        if k > 1 and places[k] == places[k - 2]:
            raise table.wrong(f"row {lines[k]}: {name} = {places[k]:g} is given three times. Give it twice for a jump")
    if places[-1] == 0:
        raise table.wrong(f"{name} ends at 0; expected a longer table")


@dataclass(frozen=True)
class _Acting:
    """Values over a step, from its begin to its end: `given` of the motion and the ambient temperature."""

    loads: tuple[float, float] | None = None
    factors: tuple[float, float] = (1.0, 1.0)
    given: dict[str, tuple[float, float]] = field(default_factory=dict)
    motion: Cycle | None = None  # another table than that of the case
    single: dict[str, float] = field(default_factory=dict)  # factors of loads by their groups

    def of(self, case: Case) -> Case:
        """Return the case with the table that acts, and its loads with factors of their own."""
        changes: dict[str, Any] = {} if self.motion is None else {"motion": self.motion}
        for name, body in case.bodies.items():
            loads = tuple(load.times(self.single.get(load.on, 1.0)) for load in body.loads)
            if self.single and loads != body.loads:
                changes[name] = body.model_copy(update={"loads": loads})
        return case.stage(changes) if changes else case


def _acting(steps: Sequence[ProgramStep]) -> Iterator[_Acting]:
    """Yield what acts over each step: what it does not name stays as it was."""
    now = _Acting()
    for step in steps:
        ramps = {key: _ends(getattr(step, key), now.given.get(key)) for key in (*MOTION, "ambient")}
        now = _Acting(
            _ends(step.load, now.loads if step.load_factor is None else None),
            _ends(step.load_factor, now.factors) or (1.0, 1.0),
            {key: ends for key, ends in ramps.items() if ends is not None},
            step.motion or now.motion,
            {**now.single, **(step.load_factors or {})},
        )
        yield now


def held_at(case: Case, step: int | None = None) -> Held | None:
    """Return the loads and motion at the end of a step of a case's program; None without a program.

    Args:
        step: Its number from 0; by default the last.

    Raises:
        CaseError: there is no such step, or nothing slides at its end.
    """
    program = case.program
    if program is None:
        if step is not None:
            raise CaseError(InputError("program", "missing, so that there is no step to hold. Leave out --step"))
        return None
    count = len(program.steps)
    number = count - 1 if step is None else step
    if not 0 <= number < count:
        raise CaseError(InputError("program.steps", f"the program has {count} steps, and none of number {number + 1}"))
    acting = list(_acting(program.steps))[number]
    for key in ("speed", "angular_speed"):
        if acting.given.get(key, (1.0, 1.0))[1] == 0:
            reason = f"nothing slides at the end of step {number + 1}, so that it has no state. Choose another step"
            raise CaseError(InputError(f"program.steps.{number}.{key}", reason))
    at_end = _at(acting.of(case), acting.given, 1.0).model_copy(update={"program": None})
    return Held(number, count, at_end, acting.loads and acting.loads[1], acting.factors[1])


def stages_of(case: Case) -> tuple[Stage, ...]:
    """Return the stages of a case's program; none without a program.

    Each lasts whole cycles. Ramps of the motion and of the ambient temperature are cut into levels, each at the
    value of its middle: what they slide and how long they take adds up as over the ramp.

    Raises:
        CaseError: a step is shorter than a cycle.
    """
    program = case.program
    if program is None:
        return ()
    stages: list[Stage] = []
    half_cycle, time, slid = 0, 0.0, 0.0
    for number, (step, acting) in enumerate(zip(program.steps, _acting(program.steps), strict=True)):
        given, loads, factors, acting_case = acting.given, acting.loads, acting.factors, acting.of(case)
        strokes, cycles = _cycles(acting_case, step, given, number)
        count = min(cycles, program.levels) if any(a != b for a, b in given.values()) else 1
        edges = [round(cycles * k / count) for k in range(count + 1)]
        for low, high in itertools.pairwise(edges):
            at = _at(acting_case, given, (low + high) / 2 / cycles)
            part = (low / cycles, high / cycles)
            period, distance, _ = cycle_of(at)
            stages.append(
                Stage(
                    half_cycle + strokes * low,
                    half_cycle + strokes * high,
                    at,
                    None if loads is None else _between(loads, part),
                    _between(factors, part),
                    time,
                    slid,
                    number,
                )
            )
            time += (high - low) * period
            slid += (high - low) * distance
        half_cycle += strokes * cycles
    return tuple(stages)


def _ends(ramp: tuple[float, ...] | None, before: tuple[float, float] | None) -> tuple[float, float] | None:
    """Return the values at the begin and the end of a step: those given, or what the step before has ended with."""
    if ramp is not None:
        return ramp[0], ramp[-1]
    return None if before is None else (before[1], before[1])


def _between(ends: tuple[float, float], part: tuple[float, float]) -> tuple[float, float]:
    first, last = (ends[0] + share * (ends[1] - ends[0]) for share in part)
    return first, last


def _at(case: Case, ramps: Mapping[str, tuple[float, float]], share: float) -> Case:
    """Return the case at a share of a step."""
    values = {key: a + share * (b - a) for key, (a, b) in ramps.items()}
    motion: dict[str, float | None] = {key: value for key, value in values.items() if key in MOTION}
    if "period" in motion:
        motion["angular_frequency"] = None
    elif "angular_frequency" in motion:
        motion["period"] = None
    update: dict[str, Any] = {"motion": case.motion.model_copy(update=motion)}
    if "ambient" in values and case.heat is not None:
        update["heat"] = case.heat.model_copy(update={"ambient": values["ambient"]})
    return case.stage(update)


def _cycles(case: Case, step: ProgramStep, ramps: Mapping[str, tuple[float, float]], number: int) -> tuple[int, int]:
    """Return how many half-cycles a cycle has, and how many cycles a step takes."""
    strokes = cycle_of(case)[2]
    if step.cycles is not None:
        return strokes, step.cycles
    varies = any(a != b for a, b in ramps.values())
    samples = [cycle_of(_at(case, ramps, share)) for share in (MIDDLES if varies else MIDDLES[:1])]
    duration, distance = (float(np.mean([sample[k] for sample in samples])) for k in (0, 1))
    radius = None if case.program is None else case.program.radius
    key, amount, each, unit = "distance", step.distance, distance * (radius or 1.0), "mm"
    if step.time is not None:
        key, amount, each, unit = "time", step.time, duration, "s"
    cycles = round((amount or 0.0) / each)
    if cycles < 1:
        key = f"program.steps.{number}.{key}"
        raise CaseError(InputError(key, f"expected at least a cycle of {each:.4g} {unit}, got {amount:.4g} {unit}"))
    return strokes, cycles


def cycle_of(case: Case) -> tuple[float, float, int]:
    """Return the duration of a cycle in s, what it slides in mm or rad, and its number of half-cycles.

    The contact alone gives the sliding of a table of places: it is counted in cycles.
    """
    motion = case.motion
    if isinstance(motion, OneWay):
        return motion.duration, motion.speed * motion.duration, 1
    if isinstance(motion, Rotation):
        return motion.duration, motion.angular_speed * motion.duration, 1
    if isinstance(motion, Tabulated):
        moved = np.diff(motion.displacements)
        ways = np.sign(moved[moved != 0])
        return motion.times[-1], float(np.abs(moved).sum()), 1 + int(np.count_nonzero(np.diff(ways)))
    if isinstance(motion, Cycle):
        return motion.course.duration, 1.0, 1
    return 2 * motion.half_period, 4 * motion.amplitude, 2


def speeds_of(case: Case) -> list[float]:
    """Return the velocities of all stages of a program one way, mm/s or rad/s, with their signs; none without one."""
    if not isinstance(case.motion, OneWay | Rotation):
        return []
    way = 1 if case.motion.direction in ("rightward", "counterclockwise") else -1
    cycles = (cycle_of(stage.case) for stage in stages_of(case))
    return sorted({way * distance / duration for duration, distance, _ in cycles})


def half_cycles_of(case: Case) -> int:
    """Return the number of half-cycles of a case's program."""
    return stages_of(case)[-1].end


def check_length(case: Case) -> None:
    """Raise where a run would continue beyond the end of its program.

    Raises:
        CaseError: it is.
    """
    if case.program is None:
        return
    last = half_cycles_of(case)
    if case.run.half_cycles > last:
        raise CaseError(
            InputError(
                "run.half_cycles",
                f"the program ends after {last:,} half-cycles, but run.half_cycles is "
                f"{case.run.half_cycles:,}. Add a step, or remove run.half_cycles",
            )
        )
